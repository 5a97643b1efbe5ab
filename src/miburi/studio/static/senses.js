// The switches of the partner's voice and senses. Each is a module that is loaded when it is first
// switched on; its start() returns what switches it off again, or throws the name of a refusal.
import { listen, live } from "/static/live.js";

const MODULES = {
  voice: "/static/voice.js", motion: "/static/motion.js", ears: "/static/ears.js", eyes: "/static/eyes.js",
  speech: "/static/speech.js",
};
const SECURE = ["motion", "ears", "eyes", "speech"]; // browsers give these to secure pages alone
const KEPT = ["voice"]; // what a reload leaves on; microphone and camera are off after it
const AGAIN = "miburi_again", LONG = 30_000; // but not where a page that has lost its partner loads itself again, within ms
let lost = -Infinity;
const running = new Map(), wishes = new Map();

const kept = (name) => `miburi_${name} ${location.pathname}`;

async function set(form, name, on) {
  const told = JSON.parse(form.dataset.senses), box = form.querySelector(`[data-sense="${name}"]`);
  const out = form.querySelector("output"), wish = Symbol();
  wishes.set(name, wish);
  out.textContent = "";
  if (KEPT.includes(name)) localStorage.setItem(kept(name), on ? "on" : "off");
  running.get(name)?.();
  running.delete(name);
  try {
    const stop = on && (await (await import(MODULES[name])).start(told));
    // A browser may have asked for leave meanwhile: the latest wish counts.
    if (wishes.get(name) !== wish) return stop && stop();
    if (stop) running.set(name, stop);
  } catch (error) {
    if (wishes.get(name) !== wish) return;
    out.textContent = told.refused[error.message] ?? error.message;
  }
  box.checked = running.has(name);
  document.documentElement.dataset[name] = box.checked ? "on" : "off";
}

document.addEventListener("change", (event) => {
  const name = event.target.dataset?.sense;
  if (name) set(event.target.closest("[data-senses]"), name, event.target.checked);
});

listen((_state, connected) => {
  if (!connected) lost = performance.now();
});
addEventListener("pagehide", () => {
  if (live.connected === false || performance.now() - lost < LONG)
    sessionStorage.setItem(AGAIN, JSON.stringify([...running.keys()].filter((name) => !KEPT.includes(name))));
});

// What was on comes back with the first touch: before, no browser lets a page sound.
function restore() {
  const form = document.querySelector("[data-senses]");
  if (!form) return false;
  for (const name of window.isSecureContext ? [] : SECURE) {
    const box = form.querySelector(`[data-sense="${name}"]`);
    if (!box) continue;
    box.disabled = true;
    document.getElementById(box.getAttribute("aria-describedby")).textContent = JSON.parse(form.dataset.senses).refused.insecure;
  }
  const again = JSON.parse(sessionStorage.getItem(AGAIN) ?? "[]");
  sessionStorage.removeItem(AGAIN);
  for (const name of again) if (form.querySelector(`[data-sense="${name}"]`)) set(form, name, true);
  for (const name of KEPT.filter((name) => localStorage.getItem(kept(name)) === "on")) {
    form.querySelector(`[data-sense="${name}"]`).checked = true;
    const wake = () => {
      for (const kind of ["pointerup", "keydown"]) removeEventListener(kind, wake, true);
      const box = form.querySelector(`[data-sense="${name}"]`);
      if (box.checked && !running.has(name)) set(form, name, true);
    };
    for (const kind of ["pointerup", "keydown"]) addEventListener(kind, wake, true);
  }
  return true;
}
if (!restore()) {
  const observer = new MutationObserver(() => restore() && observer.disconnect());
  observer.observe(document, { childList: true, subtree: true });
}
