// The partner's ears: a clap or a shout startles it. The sound stays in this page; only the name of
// what happened and its strength go to the partner.
import { lips } from "/static/face.js";
import { ask, listen } from "/static/live.js";

const ECHO = 400; // ms after its own voice or motors

export async function start() {
  if (!window.isSecureContext) throw new Error("insecure");
  if (!navigator.mediaDevices) throw new Error("none");
  // With automatic gain, loudness would mean nothing.
  const audio = { echoCancellation: false, noiseSuppression: false, autoGainControl: false };
  const sound = await navigator.mediaDevices.getUserMedia({ audio }).catch((error) => {
    throw new Error(error.name === "NotFoundError" ? "no_microphone" : "denied");
  });
  const context = new AudioContext();
  const stop = () => {
    sound.getTracks().forEach((track) => track.stop());
    context.close();
  };
  let ear;
  try {
    await context.audioWorklet.addModule("/static/startle-worklet.js");
    ear = new AudioWorkletNode(context, "startle", { numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
    context.createMediaStreamSource(sound).connect(ear);
    await context.resume();
  } catch (error) {
    stop();
    throw error;
  }
  let own = -Infinity; // when it last made a noise itself
  ear.port.onmessage = ({ data: strength }) => {
    const now = performance.now();
    if (lips.open(now) !== null) own = now;
    if (now - own > ECHO) ask("/sense", { kind: "startle", clearness: Math.round(100 * strength) / 100 });
  };
  const leave = listen((state) => {
    // What it does at rest is slow, and no louder than the room.
    const acts = state?.expressed || state?.asked;
    const moves = state?.body === "card" && (state.phase === "returning" || (state.phase === "moving" && acts));
    if (moves || lips.open(performance.now()) !== null) own = performance.now();
  });
  return () => {
    leave();
    stop();
  };
}
