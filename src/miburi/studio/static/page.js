// On every page: Stop by button and by Esc, Release by button, and a word when something is refused.
import { ask, listen, live, lost, release, send, stop } from "/static/live.js";

const UNSENT = "miburi_unsent", LOST = "miburi_lost", LINE = "miburi_line", HIDDEN = "miburi_hidden"; // the distress whose banner was hidden
const LONG = 30_000; // ms after it is connected again within which the studio may load anew
const ATTENDED = 3000; // ms until it is told again that somebody types
const RAISED = "a raised voice"; // as senses/tone.py has it

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
  const { press, refusal } = path === "/stop" ? await stop()
    : { refusal: await (path === "/release" ? release() : ask(path)) };
  if (refusal) say(refusal);
  // A Stop that reached nobody is sent when somebody is there again, even if the page loads anew.
  if (press && (refusal === null || !live.connected)) keep(refusal === null ? null : press);
}

function keep(unsent) {
  document.documentElement.dataset.unsent = unsent !== null;
  if (unsent) sessionStorage.setItem(UNSENT, unsent);
  else sessionStorage.removeItem(UNSENT);
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-ask]");
  if (button) wish(button.dataset.ask);
  const banner = event.target.closest("button") && event.target.closest("[data-needs]");
  if (!banner) return;
  // What was said about it goes, too.
  for (const one of document.querySelectorAll(".talk output, #spoken")) one.textContent = "";
  banner.hidden = true;
  sessionStorage.setItem(HIDDEN, banner.dataset.which);
}, true);  // before any dialog can take it

// Somebody seems to need help. A person whom they fear may be in the room, so a button hides it.
function showNeed({ boot, distress }) {
  const banner = document.querySelector("[data-needs]"), which = distress ? `${boot}:${distress.number}` : "";
  if (!banner || (banner.dataset.which ?? "") === which) return;
  banner.dataset.which = which;
  banner.hidden = !distress || sessionStorage.getItem(HIDDEN) === which;
  banner.firstElementChild.textContent = banner.hidden ? "" : JSON.parse(banner.dataset.needs)[distress.kind];
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
  if (event.key === "Escape") wish("/stop"); // Release has no key: a letter would be typed by mistake
}, true);

const MUTE = ".stage, .levels, .strength, .tabs-card, .bar-more, .senses, .talk button";
let wasLost = sessionStorage.getItem(LOST) !== null, back = -Infinity;
listen((state, connected) => {
  const root = document.documentElement;
  root.dataset.connected = connected;
  // Without a connection only Stop can be pressed; it is sent as soon as the server is back. A line can be typed on.
  for (const one of document.querySelectorAll(MUTE)) one.inert = connected === false;
  if (connected === false) wasLost = true;
  const box = document.querySelector("[data-back]");
  if (connected && state && wasLost && box) {
    [wasLost, back] = [false, performance.now()];
    sessionStorage.removeItem(LOST);
    say(box.dataset[state.stop ? "backStopped" : "back"]);
  }
  if (connected && sessionStorage.getItem(UNSENT)) {
    send({ do: "stop", press: sessionStorage.getItem(UNSENT) });
    keep(null);
  }
  if (!state) return;
  root.dataset.phase = state.phase;
  root.dataset.paused = state.paused;
  root.dataset.serial = state.serial;
  showNeed(state);
});

// The log is written anew with each event; what somebody has opened in it stays open, and shut what was shut.
const opened = new Set();
const entries = (nodes) => [...nodes].flatMap((node) => [...(node.querySelectorAll?.("[data-entry]") ?? [])]);
new MutationObserver((changes) => {
  for (const { removedNodes, addedNodes } of changes) {
    for (const { open, dataset } of entries(removedNodes)) opened[open ? "add" : "delete"](dataset.entry);
    for (const entry of entries(addedNodes)) entry.open = opened.has(entry.dataset.entry);
  }
}).observe(document, { childList: true, subtree: true });

// The studio loads anew where its server was away for long: the line that was being typed is still there then.
addEventListener("pagehide", () => {
  const line = document.querySelector("[data-talk]")?.elements.text;
  if (wasLost) sessionStorage.setItem(LOST, "");
  if (line?.value && (wasLost || performance.now() - back < LONG)) sessionStorage.setItem(LINE, JSON.stringify([line.value, line === document.activeElement]));
});
function restore() {
  const line = document.querySelector("[data-talk]")?.elements.text;
  if (!line) return false;
  const [text, focused] = JSON.parse(sessionStorage.getItem(LINE) ?? "[]");
  sessionStorage.removeItem(LINE);
  if (text && !line.value) line.value = text;
  if (focused) line.focus();
  return true;
}
if (!restore()) {
  const observer = new MutationObserver(() => restore() && observer.disconnect());
  observer.observe(document, { childList: true, subtree: true });
}

// The partner attends to who types to it.
let attended = -Infinity;
document.addEventListener("input", ({ target }) => {
  if (!target.closest("[data-talk]") || performance.now() - attended < ATTENDED) return;
  attended = performance.now();
  ask("/attend", { turn: "listening" });
});

// A line typed to the partner; below its answer is what it heard in the words, and what it felt.
document.addEventListener("submit", async (event) => {
  const form = event.target.closest("[data-talk]");
  if (!form) return;
  event.preventDefault();
  const words = JSON.parse(form.dataset.talk), out = form.querySelector("output"), line = form.elements.text;
  const text = line.value.trim(), { tone } = form; // only what was spoken has a tone
  delete form.tone;
  if (!text) return;
  const number = (form.talks = (form.talks ?? 0) + 1); // who speaks on before an answer came is answered once
  const weights = form.querySelector("details");
  weights.hidden = true;
  out.textContent = "…";
  try {
    const answer = await fetch("/api/v1/say", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ text, tone, language: document.documentElement.lang || undefined }),
    });
    const heard = await answer.json();
    if (answer.ok && line.value.trim() === text) line.value = "";
    if (number !== form.talks) return;
    out.textContent = answer.ok ? heard.answer && words.quoted.replace("{what}", heard.answer) : heard.detail;
    if (!answer.ok) return;
    const more = out.appendChild(document.createElement("small")); // how it came to that
    more.textContent = `${understood(heard, words)}${alone(heard, words)}`.trim();
    weights.hidden = !heard.feeling || !heard.why.length;
    weights.querySelector("span").textContent = heard.why
      .map((part) => `${sign(part, words)} +${part.weight.toFixed(1)}`).join(", ");
    form.scrollIntoView({ block: "nearest" }); // the answer is below the line
  } catch {
    out.textContent = "";
    lost();
  }
});

function sign({ what }, words) {
  return what === RAISED ? words.raised : words.quoted.replace("{what}", what);
}

function alone({ trouble }, words) {
  return trouble ? ` ${words.alone.replace("{why}", trouble)}` : "";
}

function understood(heard, words) {
  const list = (items) => new Intl.ListFormat(document.documentElement.lang).format(items);
  if (heard.distress) return ""; // the banner says it
  if (!heard.feeling) return heard.asked ? words.asked : heard.meant ? "" : words.nothing;
  const why = list(heard.why.slice(0, 3).map((part) => sign(part, words)));
  const first = words[why ? "heard" : "heard_it"].replace("{feeling}", words.feelings[heard.feeling])
    .replace("{sure}", Math.round(100 * heard.strength)).replace("{why}", why);
  const felt = heard.felt.map((one) => `${words.feelings[one.feeling]} ${one.strength.toFixed(2)}`);
  return felt.length ? `${first} ${words.felt.replace("{felt}", list(felt))}` : first;
}
