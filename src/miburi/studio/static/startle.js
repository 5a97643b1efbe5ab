// A sound that startles: a clap or a bang, or a voice much louder than what was usual here. In go
// samples, out come strengths; no sound is kept, only the levels of the last seconds. Levels are in
// dB over full scale; all numbers are ours, chosen on sounds of tests/fixtures and bench/startle.py.
const PART = 0.005, FRAME = 4; // s; parts in a frame
const KEPT = 250; // frames of which it knows the level: 5 s
const SILENT = -85; // below it nothing was recorded yet
const LEARNING = 25; // frames until it knows what is usual
const ATTACK = 12, BEFORE = 8, FLOOR = 25; // a bang rises so far over the last 40 ms, and over the room
const BRIGHT = 1800; // Hz: a bang is no thud, and no vowel
const TAIL = 18, ALONE = 70, DECAY = 4; // parts after it: it fades so far, and nothing comes; speech and music go on
const LOUDER = -5; // than what was loud in the last seconds, or it is usual
const LATELY = 50, EASED = 6; // frames: what was as loud a second ago is usual, too
const SHOUT = 12, LOUD = -16, LOUDEST = -9; // over the loud parts; at least; where nothing was usual
const ACTIVE = 50; // frames of sound that tell what is usual: 1 s
const DEAF = 100; // parts after a startle

const decibels = (power) => 10 * Math.log10(power + 1e-12);

function percentile(levels, share) {
  const sorted = [...levels].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}

export class Startle {
  constructor(rate) {
    Object.assign(this, { rate, size: Math.round(rate * PART), power: 0, steep: 0, count: 0, sample: 0 });
    Object.assign(this, { parts: [], frame: [], levels: [], bang: null, shout: null, wait: 0 });
  }
  take(samples) {
    // Take the next samples, -1 to 1; return how strong a startle ended in them, 0.5 to 1, or 0.
    let strongest = 0;
    for (const sample of samples) {
      this.power += sample * sample;
      this.steep += (sample - this.sample) ** 2;
      this.sample = sample;
      if (++this.count < this.size) continue;
      strongest = Math.max(strongest, this.hear(this.power / this.size, this.steep / this.size));
      this.power = this.steep = this.count = 0;
    }
    return strongest;
  }
  hear(power, steep) {
    const level = decibels(power);
    if (level < SILENT) return 0; // zeros say nothing of the room
    const pitch = (this.rate / Math.PI) * Math.asin(Math.min(1, Math.sqrt(steep / (4 * power))));
    this.frame.push(power);
    let strength = this.bangs(level, pitch);
    if (this.frame.length === FRAME) {
      const whole = decibels(this.frame.reduce((sum, one) => sum + one, 0) / FRAME);
      this.frame = [];
      strength = Math.max(strength, this.shouts(whole));
      if (!this.bang && !this.shout) this.levels = [...this.levels.slice(1 - KEPT), whole];
    }
    this.parts = [...this.parts.slice(1 - BEFORE), level];
    if (this.wait > 0) this.wait--;
    if (!strength || this.wait > 0 || this.levels.length < LEARNING) return 0;
    this.wait = DEAF;
    return Math.min(1, strength);
  }
  usual() {
    // Return the room's level, that of its loud parts, and whether there was sound enough to know.
    const floor = percentile(this.levels, 0.3);
    const active = this.levels.filter((level) => level > floor + 10);
    const lately = Math.max(...this.levels.slice(-LATELY)) - EASED;
    return { floor, loud: Math.max(percentile(this.levels, 0.95), lately), known: active.length >= ACTIVE };
  }
  bangs(level, pitch) {
    const at = this.bang;
    if (!at) {
      if (this.levels.length < LEARNING || this.parts.length < BEFORE) return 0;
      if (level - Math.max(...this.parts.slice(0, -1)) < ATTACK) return 0;
      const { floor, loud } = this.usual();
      if (level > floor + FLOOR) this.bang = { top: level, pitch, loud, count: 0, after: -120 };
      return 0;
    }
    at.count++;
    if (at.count < FRAME && level > at.top) Object.assign(at, { top: level, pitch });
    if (at.count > TAIL) at.after = Math.max(at.after, level);
    const over = at.top - at.loud, none = at.pitch < BRIGHT || over < LOUDER || at.after > at.top - DECAY;
    if (!none && at.count < ALONE) return 0;
    this.bang = null;
    return none ? 0 : 0.5 + (over - LOUDER) / 60;
  }
  shouts(level) {
    const at = this.shout;
    if (!at) {
      if (this.levels.length < LEARNING) return 0;
      const { loud, known } = this.usual();
      if (level > (known ? Math.max(LOUD, loud + SHOUT) : LOUDEST)) this.shout = { top: level, loud: known ? loud : -30, count: 0 };
      return 0;
    }
    at.top = Math.max(at.top, level);
    if (++at.count < FRAME) return 0;
    this.shout = null;
    return 0.5 + (at.top - at.loud - SHOUT) / 40;
  }
}
