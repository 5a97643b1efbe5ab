// Touches of the face: from a pointer's way to pats, strokes, pokes and holds. Times are in ms,
// places in CSS pixels. Numbers are ours.
const WAY = 80, SLOW = 10, FAST = 4000, AGAIN = 2000; // a stroke: px, px/s, and ms until it counts again
const HOLD = 700, POKES = 6, WITHIN = 2000; // ms; so many taps in so many ms are pokes

export class Touch {
  // Say what a pointer does; each answer is the name of a happening, or null.
  constructor() {
    this.taps = [];
    this.begin = null;
  }
  down(x, y, time) {
    this.begin = { x, y, time, way: 0, whole: 0, since: time, stroked: false, told: -Infinity };
    return null;
  }
  move(x, y, time) {
    const at = this.begin;
    if (!at) return null;
    const step = Math.hypot(x - at.x, y - at.y);
    Object.assign(at, { x, y, way: at.way + step, whole: at.whole + step });
    if (at.way < WAY) return null;
    const speed = at.way / Math.max(0.001, (time - at.since) / 1000);
    Object.assign(at, { way: 0, since: time });
    if (speed < SLOW || speed > FAST) return null;
    if (time - at.told < AGAIN) return null;
    Object.assign(at, { stroked: true, told: time });
    return "stroke"; // as long as it lasts; what is felt so often fades
  }
  up(time) {
    const at = this.begin;
    this.begin = null;
    if (!at || at.stroked || at.whole > WAY / 4) return null;
    return time - at.time > HOLD ? "hold" : this.tap(time);
  }
  cancel() {
    this.begin = null;
  }
  tap(time) {
    this.taps = [...this.taps.filter((one) => time - one < WITHIN), time];
    return this.taps.length >= POKES ? "poke" : "pat";
  }
}

export function feelTouches(element, happen) {
  // Call `happen(kind)` at each touch of an element; a press by keyboard is a pat.
  const touch = new Touch();
  const tell = (kind) => kind && happen(kind);
  element.addEventListener("pointerdown", (event) => {
    if (!event.isPrimary) return;
    element.setPointerCapture(event.pointerId);
    touch.down(event.clientX, event.clientY, event.timeStamp);
  });
  element.addEventListener("pointermove", (event) => {
    if (event.isPrimary) tell(touch.move(event.clientX, event.clientY, event.timeStamp));
  });
  element.addEventListener("pointerup", (event) => event.isPrimary && tell(touch.up(event.timeStamp)));
  element.addEventListener("pointercancel", () => touch.cancel());
  element.addEventListener("click", (event) => event.detail || tell(touch.tap(event.timeStamp)));
  element.addEventListener("contextmenu", (event) => event.preventDefault());
}
