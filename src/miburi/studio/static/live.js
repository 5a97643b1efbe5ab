// One WebSocket to the partner, shared by everything on a page; it comes back by itself.

const listeners = new Set();
let socket, timer, wait = 250, lastHeard = 0;
// Whether it is connected is null until it is known; `refused` is why a wish was refused last.
export const live = { state: null, connected: null, refused: null };

export function listen(listener) {
  listeners.add(listener);
  if (!socket) open();
  else if (live.state) listener(live.state, live.connected);
  return () => listeners.delete(listener);
}

export function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

// Commands that must say whether they worked go by HTTP. Returns the refusal's words, null if it
// worked, or undefined if nobody answered; live.connected is false then.
export const ask = (path, content) => post("/api/v1" + path, content);

// A browser opens six connections to a server: where others hold them, the socket is open already.
// So Stop goes both ways, under one name, and its second copy cannot undo a release after the first.
export async function stop() {
  const press = String.fromCharCode(...crypto.getRandomValues(new Uint8Array(24)).map((n) => 97 + n % 26));
  send({ do: "stop", press });
  return { press, refusal: await post("/api/v1/stop", undefined, press) };
}

// A person at this page releases the body as the page shows it: a Stop that it does not show holds.
export const release = () => post("/api/page/release", { seen: live.state?.serial });

// Stop is sent a second time where its connection breaks: a full server may have closed it.
async function post(path, content, press, again = true) {
  try {
    const answer = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json", ...(press ? { "Miburi-Press": press } : { "Miburi-By": "person" }) },
      body: content === undefined ? undefined : JSON.stringify(content),
    });
    return answer.ok ? null : (await answer.json()).detail;
  } catch {
    if (press && again) return post(path, content, press, false);
    lost();
  }
}

function open() {
  const rate = document.documentElement.dataset.liveRate ?? 30;
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/api/v1/live?rate=${rate}`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.refused) {
      live.refused = message.refused;
      return;
    }
    wait = 250;
    lastHeard = performance.now();
    live.state = message;
    live.connected = true;
    for (const listener of listeners) listener(message, true);
  };
  socket.onclose = (event) => {
    // Another tab may have paired this browser again.
    if (event.reason.includes("forgotten"))
      fetch("/api/v1/state").then((answer) => {
        if (answer.status === 401) location.replace("/pair#" + location.pathname);
      });
    lost();
    clearTimeout(timer);
    timer = setTimeout(open, wait);
    wait = Math.min(2 * wait, 4000);
  };
}

export function lost() {
  if (live.connected === false) return;
  live.connected = false;
  for (const listener of listeners) listener(live.state, false);
}

// A connection that is open but silent is lost as well. It is looked at twice, so that a page that
// was too busy to read what had come is not taken for lonely. One that hangs while it opens is
// replaced after 10 s; a browser would wait for minutes.
const PATIENCE = 10; // s
let silent = 0, opening = 0;
setInterval(() => {
  opening = socket?.readyState === WebSocket.CONNECTING ? opening + 1 : 0;
  if (opening > PATIENCE) socket.close();
  silent = live.connected && performance.now() - lastHeard > 2000 ? silent + 1 : 0;
  if (silent < 2) return;
  lost();
  socket.close();
}, 1000);
