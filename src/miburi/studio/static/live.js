// One WebSocket to the partner, shared by everything on a page; it comes back by itself.

const listeners = new Set();
let socket, timer, wait = 250, lastHeard = 0;
export const live = { state: null, connected: false };

export function listen(listener) {
  listeners.add(listener);
  if (!socket) open();
  else if (live.state) listener(live.state, live.connected);
  return () => listeners.delete(listener);
}

export function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

export async function ask(path, content) {
  // Commands that must say whether they worked go by HTTP. Returns the refusal's words, or null.
  try {
    const answer = await fetch("/api/v1" + path, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: content === undefined ? undefined : JSON.stringify(content),
    });
    return answer.ok ? null : (await answer.json()).detail;
  } catch {
    return "offline";
  }
}

function open() {
  const rate = document.documentElement.dataset.liveRate ?? 30;
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/api/v1/live?rate=${rate}`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.refused) return;
    wait = 250;
    lastHeard = performance.now();
    live.state = message;
    live.connected = true;
    for (const listener of listeners) listener(message, true);
  };
  socket.onclose = () => {
    lost();
    clearTimeout(timer);
    timer = setTimeout(open, wait);
    wait = Math.min(2 * wait, 4000);
  };
}

function lost() {
  if (!live.connected) return;
  live.connected = false;
  for (const listener of listeners) listener(live.state, false);
}

// A connection that is open but silent is lost as well.
setInterval(() => {
  if (live.connected && performance.now() - lastHeard > 3000) {
    lost();
    socket.close();
  }
}, 1000);
