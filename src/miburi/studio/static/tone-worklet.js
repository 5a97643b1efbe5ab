// Measures how loud and high a microphone's sound is, on the thread of the sound; posts these numbers alone.
import { Prosody } from "./tone.js";

registerProcessor("tone", class extends AudioWorkletProcessor {
  constructor() {
    super();
    this.prosody = new Prosody(sampleRate);
  }
  process([[samples]]) {
    const windows = samples ? this.prosody.take(samples) : [];
    if (windows.length) this.port.postMessage(windows);
    return true;
  }
});
