// Why the body is stopped, in words. Where it goes on by itself, this can still be read for a while.
import { listen } from "/static/live.js";

const LASTING = 15; // s of the robot's time (ours)
let told = null, ended = null; // the last state with a stop, and when the body went on

// As studio/contact_panel.py says it.
function words({ stop, held }, { contact, joint, reason, passes }) {
  const motor = joint[stop.motor];
  const kind = { asked: "asked", contact: motor && "met", touched: motor && "led" }[stop.reason] || "failed";
  const next = held || !passes.includes(stop.reason) ? "held" : kind === "led" ? "rests" : "waits";
  return [contact[kind].replace("{motor}", motor).replace("{reason}", reason[stop.reason]), contact[next]];
}

// The text is there before the box appears: an alert is read as it appears.
function show(box, ...sentences) {
  box.querySelectorAll("b, small").forEach((one, i) => {
    if (one.textContent !== (sentences[i] ?? "")) one.textContent = sentences[i] ?? "";
  });
  box.hidden = !sentences.length;
}

listen((state) => {
  const box = document.querySelector("[data-why]");
  if (!state || !box) return;
  if (state.stop) {
    [told, ended] = [state, null];
    show(box, ...words(state, (box.words ??= JSON.parse(box.dataset.why))));
  } else if (told) {
    ended ??= state.time;
    if (!told.held && state.time >= ended && state.time < ended + LASTING) show(box, words(told, box.words)[0]);
    else hide(box);
  }
});

function hide(box) {
  told = null;
  show(box);
}

document.addEventListener("click", ({ target }) => {
  if (target.closest("[data-why] button")) hide(target.closest("[data-why]"));
});
