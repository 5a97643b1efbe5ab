// Runs the startle detector beside the page, on the thread of the sound. It posts strengths, nothing else.
import { Startle } from "./startle.js";

registerProcessor("startle", class extends AudioWorkletProcessor {
  constructor() {
    super();
    this.startle = new Startle(sampleRate);
  }
  process([[samples]]) {
    const strength = samples ? this.startle.take(samples) : 0;
    if (strength) this.port.postMessage(strength);
    return true;
  }
});
