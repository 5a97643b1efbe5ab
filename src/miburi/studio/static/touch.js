// Touches of the face: from a pointer's way to pats, strokes, pokes and holds. Times are in ms,
// places in CSS pixels. Numbers are ours.
const WAY = 120, SLOW = 100, FAST = 900; // a stroke: px, and px/s
const HOLD = 700, POKES = 6, WITHIN = 2000; // ms; so many taps in so many ms are pokes

export class Touch {
  // Say what a pointer does; each answer is the name of a happening, or null.
  constructor() {
    this.taps = [];
    this.begin = null;
  }
  down(x, y, time) {
    this.begin = { x, y, time, way: 0, whole: 0, since: time, stroked: false };
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
    const first = !at.stroked;
    at.stroked = true;
    return first ? "stroke" : null; // one for each time that the finger comes down
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
