// How loud and high somebody speaks. In go samples, out come two numbers for each window of 40 ms,
// and from those of an utterance, beside the ones before it, its tone. senses/tone.py does the same
// for `miburi listen`, and says what the numbers mean; no sound is kept beyond a window.
const RATE = 16000, WINDOW = 640, HOP = 320; // Hz, nearly; samples
const RANGE = 25, QUIET = 1e-10; // dB below the loudest window that still is speech; power of silence
const LOWEST = 70, HIGHEST = 400, ALIKE = 0.5, NEARLY = 0.9;
const USUAL = 20; // utterances that say what is usual

export class Prosody {
  constructor(rate) {
    this.every = Math.max(1, Math.round(rate / RATE));
    this.rate = rate / this.every;
    Object.assign(this, { sum: 0, count: 0, last: [] });
  }
  take(samples) {
    // Take the next samples, -1 to 1; return [power, pitch in Hz or null] of each window that ended.
    const windows = [];
    for (const sample of samples) {
      this.sum += sample;
      if (++this.count < this.every) continue;
      this.last.push(this.sum / this.every);
      this.sum = this.count = 0;
      if (this.last.length < WINDOW) continue;
      windows.push(measure(this.last, this.rate));
      this.last = this.last.slice(HOP);
    }
    return windows;
  }
}

function measure(samples, rate) {
  const mean = samples.reduce((sum, one) => sum + one, 0) / WINDOW, window = samples.map((one) => one - mean);
  const alike = (lag) => {
    let sum = 0;
    for (let at = lag; at < WINDOW; at++) sum += window[at] * window[at - lag];
    return sum / (WINDOW - lag); // fewer samples overlap
  };
  const power = alike(0);
  if (power < QUIET) return [power, null];
  const first = Math.floor(rate / HIGHEST), near = [];
  for (let lag = first; lag <= Math.floor(rate / LOWEST); lag++) near.push(alike(lag) / power);
  const most = Math.max(...near);
  if (most <= ALIKE) return [power, null];
  let place = near.findIndex((one) => one >= NEARLY * most); // two periods are as alike as one
  while (place + 1 < near.length && near[place + 1] > near[place]) place++;
  return [power, rate / (first + place)];
}

function median(values) {
  const sorted = [...values].sort((a, b) => a - b), half = sorted.length / 2;
  return sorted.length % 2 ? sorted[Math.floor(half)] : (sorted[half - 1] + sorted[half]) / 2;
}

export function summary(windows) {
  // Return an utterance's loudness, dB below full scale, and pitch, Hz or null; null of silence.
  const loudest = Math.max(0, ...windows.map(([power]) => power));
  if (loudest < QUIET) return null;
  const spoken = windows.filter(([power]) => power > loudest * 10 ** (-RANGE / 10));
  const pitches = spoken.map(([, pitch]) => pitch).filter((pitch) => pitch !== null);
  const power = spoken.reduce((sum, [one]) => sum + one, 0) / spoken.length;
  return { loudness: 10 * Math.log10(power), pitch: pitches.length ? median(pitches) : null };
}

export function judge(windows, before, tones) {
  // Return the tone of an utterance beside those `before`, to which it is added.
  const voice = summary(windows), usual = [...before];
  if (!voice) return "plain";
  before.push(voice);
  if (before.length > USUAL) before.shift();
  const pitches = usual.map((one) => one.pitch).filter((pitch) => pitch !== null);
  if (usual.length < tones.before || voice.pitch === null || !pitches.length) return "plain";
  const louder = voice.loudness - median(usual.map((one) => one.loudness)), higher = voice.pitch / median(pitches);
  if (louder >= tones.louder && higher >= tones.higher) return "raised";
  return louder <= -tones.softer && higher <= 1 + 1e-9 ? "soft" : "plain";
}
