// Spoken words: hold a button, and this browser's own recogniser writes down what is said. It is used
// only where it works on the device itself; elsewhere it would send the voice to the browser's maker.
const HELD = 400; // ms; who lets go sooner has pressed, and speaks until a pause or another press

export async function start() {
  if (!window.isSecureContext) throw new Error("insecure");
  const Recogniser = window.SpeechRecognition;
  const lang = document.documentElement.lang === "ja" ? "ja-JP" : "en-US";
  if (!Recogniser?.available || !("processLocally" in Recogniser.prototype)) throw new Error("not_here");
  const wish = { langs: [lang], processLocally: true };
  const there = await Recogniser.available(wish);
  // Its language pack comes from the browser's maker, like any update; no sound goes there.
  if (there === "unavailable" || (there !== "available" && !(await Recogniser.install(wish)))) throw new Error("not_here");
  const leave = [...document.querySelectorAll("[data-talk]")].map((talk) => add(talk, Recogniser, lang));
  return () => leave.forEach((one) => one());
}

function add(form, Recogniser, lang) {
  const words = JSON.parse(form.dataset.talk), line = form.elements.text;
  const button = document.createElement("button");
  button.type = "button";
  button.className = "plain-button speak";
  form.insertBefore(button, form.querySelector("output"));
  let ear = null, since = 0;

  function show() {
    button.textContent = words[ear ? "listening" : "speak"];
    button.setAttribute("aria-pressed", String(Boolean(ear)));
  }

  function begin() {
    if (ear) return ear.stop();
    window.speechSynthesis?.cancel(); // it does not listen to itself
    const now = (ear = new Recogniser());
    Object.assign(now, { lang, processLocally: true, continuous: false, interimResults: false });
    now.onresult = ({ results }) => {
      const text = [...results].map((result) => result[0].transcript).join(" ").trim().slice(0, 1000);
      if (!text) return;
      line.value = text;
      form.requestSubmit();
    };
    now.onerror = ({ error }) => {
      if (error !== "no-speech" && error !== "aborted") form.querySelector("output").textContent = words.unheard;
    };
    now.onend = () => {
      if (ear === now) ear = null;
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
