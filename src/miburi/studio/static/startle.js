// A sound that startles: sudden, and much louder than what is usual here. In go samples, out come
// strengths; no sound is kept beyond 20 ms. Thresholds are ours, in dB over full scale.
const FRAME = 0.02; // s
const RISE = 15, ABOVE = 20, OVER = 10; // within three frames; over the floor; over the usual
const LEAST = 0.5; // of 1: weaker ones startle nobody
const LEARNING = 2; // s in which it does not yet know what is usual
const TOP = 4, DEAF = 25; // frames that are looked at after the rise, and after a startle

export class Startle {
  constructor(rate) {
    this.size = Math.round(rate * FRAME);
    Object.assign(this, { sum: 0, count: 0, frames: 0, last: [], floor: null, usual: -35, rise: null, wait: 0 });
  }
  take(samples) {
    // Take the next samples, -1 to 1; return how strong a startle ended in them, 0.5 to 1, or 0.
    let strongest = 0;
    for (const sample of samples) {
      this.sum += sample * sample;
      if (++this.count < this.size) continue;
      strongest = Math.max(strongest, this.hear(10 * Math.log10(this.sum / this.size + 1e-9)));
      this.sum = this.count = 0;
    }
    return strongest;
  }
  hear(level) {
    this.frames++;
    this.floor ??= level;
    const before = Math.min(...this.last, level);
    this.last = [...this.last.slice(-2), level];
    const risen = level - before > RISE && level - this.floor > ABOVE;
    const active = level > this.floor + 10 || level > -45;
    this.floor += (level - this.floor) * (level < this.floor ? FRAME / 0.1 : FRAME / 5);
    let strength = 0;
    if (this.wait > 0) this.wait--;
    else if (this.rise) {
      this.rise.top = Math.max(this.rise.top, level);
      if (++this.rise.frames >= TOP) {
        strength = this.judge(this.rise.top);
        this.rise = null;
      }
    } else if (risen) this.rise = { top: level, frames: 0 };
    if (active && !this.rise) this.usual += (level - this.usual) * (FRAME / 6);
    return strength;
  }
  judge(top) {
    const over = top - this.usual;
    if (over < OVER) return 0;
    const strength = Math.min(1, (over - 6) / 24) * (this.frames * FRAME < LEARNING ? 0.5 : 1);
    if (strength < LEAST) return 0;
    this.wait = DEAF;
    return strength;
  }
}
