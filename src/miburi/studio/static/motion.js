// Motion of the device: lifted, shaken, knocked, dropped, from what its sensors say. The device
// rides on the robot, so nothing counts while the partner moves, and shortly after. Numbers are ours.
import { ask, listen } from "/static/live.js";

const STILL = 300; // ms after the partner's own motion
const HARD = 12, SPAN = 800, TURNS = 3, LONG = 2500; // shaken: m/s², in ms, and so many reversals
const SPIKE = 20, CALM = 6, QUIET = 300; // a knock: m/s², with calm before and after it, ms
const LIGHT = 3, FALL = 150; // falling: less than so many m/s² for so many ms
const TILT = 25, TURN = 1000; // lifted: degrees, within ms
const BETWEEN = 1500; // ms between two happenings

const size = ([x, y, z]) => Math.hypot(x, y, z);
const angle = (a, b) =>
  (180 / Math.PI) * Math.acos(Math.max(-1, Math.min(1, a.reduce((sum, x, i) => sum + x * b[i], 0) / (size(a) * size(b) || 1))));

export class Motion {
  constructor() {
    this.clear(0);
    this.last = -Infinity;
  }
  clear(time) {
    Object.assign(this, { begin: time, peaks: [], spike: null, falling: null, shaking: null, downs: [], calm: time - QUIET });
  }
  moved(time) {
    // The partner moves by itself: forget what was felt.
    this.clear(time + STILL);
  }
  take(own, all, time) {
    // Take one reading: its own acceleration, and that with gravity, m/s² each; return a happening or null.
    if (time < this.begin) return null;
    const kind = this.falls(all, time) ?? this.shakes(own, time) ?? this.knocks(own, time) ?? this.lifts(own, all, time);
    if (!kind || time - this.last < BETWEEN) return null;
    this.last = time;
    return kind;
  }
  falls(all, time) {
    if (size(all) >= LIGHT) this.falling = null;
    else if ((this.falling ??= time) <= time - FALL) return "drop";
    return null;
  }
  shakes(own, time) {
    if (size(own) > HARD) {
      const before = this.peaks.at(-1);
      const turned = before && own.reduce((sum, x, i) => sum + x * before.own[i], 0) < 0;
      if (!before || turned) this.peaks.push({ own, time });
    }
    this.peaks = this.peaks.filter((peak) => time - peak.time < SPAN);
    if (this.peaks.length <= TURNS) {
      if (!this.peaks.length) this.shaking = null;
      return null;
    }
    this.spike = null;
    this.shaking ??= time;
    return time - this.shaking > LONG ? "shake_on" : "shake";
  }
  knocks(own, time) {
    const force = size(own);
    if (force > SPIKE && !this.spike && time - this.calm > QUIET) this.spike = time;
    if (this.spike && time - this.spike > QUIET) {
      const single = this.peaks.length < TURNS && force < CALM;
      this.spike = null;
      this.calm = time;
      return single ? "knock" : null;
    }
    if (!this.spike && force > CALM) this.calm = time;
    return null;
  }
  lifts(own, all, time) {
    const down = all.map((x, i) => x - own[i]);
    if (size(down) < LIGHT) return null;
    this.downs = [...this.downs.filter((one) => time - one.time <= TURN), { down, time }];
    if (angle(this.downs[0].down, down) < TILT) return null;
    this.downs = [];
    return "lift";
  }
}

export async function start() {
  if (!window.isSecureContext) throw new Error("insecure");
  if (!("DeviceMotionEvent" in window)) throw new Error("none");
  if ((await DeviceMotionEvent.requestPermission?.()) === "denied") throw new Error("denied");
  const motion = new Motion();
  const leave = listen((state) => {
    // A breath or a glance at rest tilts and shakes the device less than a hand does.
    const acts = state?.phase === "moving" && (state.expressed || state.asked);
    if (acts || state?.phase === "returning") motion.moved(performance.now());
  });
  const take = ({ acceleration: own, accelerationIncludingGravity: all }) => {
    if (own?.x == null || all?.x == null) return; // no sensor
    const kind = motion.take([own.x, own.y, own.z], [all.x, all.y, all.z], performance.now());
    if (kind) ask("/sense", { kind });
  };
  addEventListener("devicemotion", take);
  return () => {
    leave();
    removeEventListener("devicemotion", take);
  };
}
