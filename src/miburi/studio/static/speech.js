// Spoken words: hold a button, and this browser's own recogniser writes down what is said. It is used
// only where it works on the device itself; elsewhere it would send the voice to the browser's maker.
// Meanwhile this page measures how loud and high the voice is; of that, only a word such as "raised"
// goes with what was said.
import { ask } from "/static/live.js";
import { judge } from "/static/tone.js";

const HELD = 400; // ms; who lets go sooner has pressed, and speaks until a pause or another press

export async function start({ tones }) {
  if (!window.isSecureContext) throw new Error("insecure");
  const Recogniser = window.SpeechRecognition;
  const page = document.documentElement.lang;
  const lang = { en: "en-US", ja: "ja-JP" }[page] ?? page;
  if (!Recogniser?.available || !("processLocally" in Recogniser.prototype)) throw new Error("not_here");
  const wish = { langs: [lang], processLocally: true };
  const there = await Recogniser.available(wish);
  // Its language pack comes from the browser's maker, like any update; no sound goes there.
  if (there === "unavailable" || (there !== "available" && !(await Recogniser.install(wish)))) throw new Error("not_here");
  const leave = [...document.querySelectorAll("[data-talk]")].map((talk) => add(talk, Recogniser, lang, tones));
  return () => leave.forEach((one) => one());
}

async function measure() {
  // Return what stops measuring and returns what was measured; nothing where there is no microphone.
  const audio = { echoCancellation: false, noiseSuppression: false, autoGainControl: false };
  const sound = await navigator.mediaDevices?.getUserMedia({ audio }).catch(() => null);
  if (!sound) return () => [];
  const windows = [], context = new AudioContext();
  try {
    await context.audioWorklet.addModule("/static/tone-worklet.js");
    const ear = new AudioWorkletNode(context, "tone", { numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
    ear.port.onmessage = ({ data }) => windows.push(...data);
    context.createMediaStreamSource(sound).connect(ear);
  } catch {} // then every tone is plain
  return () => {
    sound.getTracks().forEach((track) => track.stop());
    context.close();
    return windows;
  };
}

function add(form, Recogniser, lang, tones) {
  const words = JSON.parse(form.dataset.talk), line = form.elements.text;
  const button = document.createElement("button");
  button.type = "button";
  button.className = "plain-button speak";
  form.insertBefore(button, form.querySelector("output"));
  const before = [];
  let ear = null, since = 0;

  function show() {
    button.textContent = words[ear ? "listening" : "speak"];
    button.setAttribute("aria-pressed", String(Boolean(ear)));
  }

  function begin() {
    if (ear) return ear.stop();
    dispatchEvent(new Event("hush")); // it does not listen to itself
    const attend = () => ask("/attend", { turn: "listening" });
    attend();
    const attends = setInterval(attend, 5000);
    const now = (ear = new Recogniser());
    let ready = null, over = false;
    measure().then((end) => (over ? end() : (ready = end)));
    const measured = () => {
      over = true;
      const windows = ready?.() ?? [];
      ready = null;
      return windows;
    };
    Object.assign(now, { lang, processLocally: true, continuous: false, interimResults: false });
    now.onresult = ({ results }) => {
      const text = [...results].map((result) => result[0].transcript).join(" ").trim().slice(0, 1000);
      if (!text) return;
      form.tone = judge(measured(), before, tones);
      line.value = text;
      form.requestSubmit();
    };
    now.onerror = ({ error }) => {
      if (error !== "no-speech" && error !== "aborted") form.querySelector("output").textContent = words.unheard;
    };
    now.onend = () => {
      clearInterval(attends);
      if (ear === now) ear = null;
      measured();
      show();
    };
    since = performance.now();
    now.start();
    show();
  }

  button.onpointerdown = begin;
  button.onpointerup = button.onpointercancel = () => performance.now() - since > HELD && ear?.stop();
  button.onclick = (event) => event.detail === 0 && begin(); // by a key
  show();
  return () => {
    ear?.abort();
    button.remove();
  };
}
