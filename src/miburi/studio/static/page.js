// On every page: Stop and Release by button and by keyboard, and a word when something is refused.
import { ask, listen, send } from "/static/live.js";

export function say(words) {
  let box = document.getElementById("said");
  if (!box) {
    box = document.body.appendChild(document.createElement("div"));
    box.id = "said";
    box.setAttribute("role", "alert");
  }
  box.textContent = words;
  box.classList.add("shown");
  clearTimeout(say.timer);
  say.timer = setTimeout(() => box.classList.remove("shown"), 4000);
}

async function wish(path) {
  // A browser opens six connections to a server: where others hold them, the socket is open already.
  if (path === "/stop") send({ do: "stop" });
  const refusal = await ask(path);
  if (refusal) say(refusal);
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-ask]");
  if (button) wish(button.dataset.ask);
}, true);  // before any dialog can take it

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
  const typing = event.target.closest?.("input:not([type=range]), textarea, [contenteditable]");
  if (event.key === "Escape") wish("/stop");
  else if (event.key.toLowerCase() === "r" && !typing) {
    document.querySelector(".release-button, #release")?.click();
  }
}, true);

listen((state, connected) => {
  const root = document.documentElement;
  root.dataset.connected = connected;
  if (!state) return;
  root.dataset.phase = state.phase;
  root.dataset.paused = state.paused;
  root.dataset.serial = state.serial;
});
