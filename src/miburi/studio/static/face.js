// The face: a few numbers (the looks of eight feelings, mixed) become shapes, and the shapes an
// SVG or a drawing on a canvas. Everything is laid out in a square of 200 by 200; y points down.

const REST = {
  open: 0.86, slant: 0, cheek: 0, pupil: 1, lookX: 0, lookY: 0, eye: 1, spark: 0,
  browY: 0, browTilt: 0, browArch: 0.35, browWeight: 1, browSkew: 0,
  mouthW: 26, smile: 7, gape: 0, up: 0.2, square: 0.5, wave: 0, skew: 0, teeth: 0, tongue: 0,
  mouthY: 0, blush: 0.12, tear: 0, sweat: 0, wrinkle: 0, vein: 0, stars: 0, shake: 0, pale: 0,
};

// What each feeling changes at full strength. Brow tilt: above 0 the inner ends rise. Slant:
// above 0 the lids fall towards the nose, below 0 towards the temples.
const LOOKS = {
  happiness: {
    open: 0.92, cheek: 0.5, pupil: 1.15, spark: 0.5, browY: 8, browArch: 0.75, mouthW: 43,
    smile: 22, gape: 17, up: 0.05, square: 0.75, tongue: 0.7, blush: 0.95, mouthY: -4,
  },
  sadness: {
    open: 0.58, slant: -0.75, lookY: 0.62, browTilt: 0.85, browY: 1, browArch: -0.1, mouthW: 24,
    smile: -14, mouthY: 6, tear: 1, blush: 0, pupil: 1.1, spark: 0.25,
  },
  fright: {
    open: 1.2, eye: 1.22, pupil: 0.26, browY: 19, browTilt: 0.62, browArch: 0.15, mouthW: 34,
    smile: -8, gape: 35, up: 0.5, square: 0.24, teeth: 1, blush: 0, shake: 1, pale: 1, mouthY: 3,
  },
  fear: {
    open: 0.98, slant: -0.22, pupil: 0.62, lookX: 0.72, lookY: 0.1, browTilt: 0.9, browY: 10,
    browArch: -0.1, mouthW: 33, smile: -5, gape: 3, wave: 5.5, blush: 0, sweat: 1, shake: 0.6,
    mouthY: 3, eye: 1.02,
  },
  thrill: {
    open: 1.15, eye: 1.14, pupil: 1.55, spark: 1, browY: 20, browArch: 0.95, mouthW: 50,
    smile: 27, gape: 36, up: 0.02, square: 0.68, teeth: 0.55, tongue: 1, blush: 1, stars: 1,
    mouthY: -4,
  },
  disgust: {
    open: 0.5, slant: 0.12, cheek: 0.62, pupil: 0.8, lookX: -0.6, lookY: 0.15, browY: -5,
    browTilt: -0.32, browSkew: 1, mouthW: 31, smile: -13, gape: 9, up: 0.75, skew: 1, tongue: 1,
    wrinkle: 1, blush: 0, square: 0.6, mouthY: 2,
  },
  anger: {
    open: 0.74, slant: 0.95, cheek: 0.12, pupil: 0.68, browY: -11, browTilt: -1, browArch: -0.25,
    browWeight: 1.65, mouthW: 36, smile: -8, gape: 13, up: 0.5, square: 0.2, teeth: 1.6,
    blush: 0, vein: 1, mouthY: 2,
  },
  surprise: {
    open: 1.16, eye: 1.1, pupil: 0.85, browY: 24, browArch: 1.35, mouthW: 15, smile: 0, gape: 34,
    up: 0.5, square: 0.5, blush: 0.1, mouthY: 7,
  },
};
export const FEELINGS = Object.keys(LOOKS);

const TINTS = {
  rest: [246, 236, 221], happiness: [255, 224, 130], sadness: [164, 192, 226],
  fright: [222, 216, 238], fear: [190, 176, 214], thrill: [255, 178, 120],
  disgust: [188, 208, 128], anger: [240, 134, 112], surprise: [158, 222, 224],
};

export function mix(weights) {
  // weights: eight numbers from 0 to 1. Faint feelings must be seen: they count as w^0.55.
  const held = weights.map((weight) => Math.pow(Math.max(0, weight), 0.55));
  const sum = held.reduce((a, b) => a + b, 0);
  const share = held.map((weight) => (sum > 1 ? weight / sum * Math.max(...held, 1e-9) ** 0.2 : weight));
  const look = { ...REST };
  const tint = [...TINTS.rest];
  FEELINGS.forEach((name, i) => {
    for (const [key, value] of Object.entries(LOOKS[name])) look[key] += share[i] * (value - REST[key]);
    TINTS[name].forEach((value, c) => (tint[c] += share[i] * (value - TINTS.rest[c])));
  });
  look.tint = tint;
  return look;
}

const number = (x) => x.toFixed(1);
const path = (points, closed = true) =>
  "M" + points.map(([x, y]) => `${number(x)} ${number(y)}`).join("L") + (closed ? "Z" : "");
const line = (n, shape) => Array.from({ length: n + 1 }, (_, i) => shape((2 * i) / n - 1));
const INK = "#3a2a2a";

export function shapes(look, time = 0, blink = 0) {
  // What to draw, from back to front: {d, fill, stroke, width, opacity, clip}.
  const out = [];
  const add = (d, fill, more = {}) => out.push({ d, fill, ...more });
  const tremble = look.shake * Math.sin(time * 55) * 0.9;
  const breath = Math.sin(time * 1.7) * 0.8;
  for (const side of [-1, 1]) {
    if (look.blush > 0.02)
      add(oval(100 + side * 68, 122 + breath, 15, 9), "#f0705c", { opacity: 0.55 * look.blush });
    eye(add, look, side, tremble, breath, blink);
    brow(add, look, side, tremble, breath);
  }
  nose(add, look, breath);
  mouth(add, look, tremble, breath, time);
  extras(add, look, time);
  return out;
}

function oval(x, y, rx, ry) {
  return `M${number(x - rx)} ${number(y)}a${number(rx)} ${number(ry)} 0 1 0 ${number(2 * rx)} 0` +
    `a${number(rx)} ${number(ry)} 0 1 0 ${number(-2 * rx)} 0Z`;
}

function eye(add, look, side, tremble, breath, blink) {
  const cx = 100 + side * 40 + tremble, cy = 84 + breath;
  const rx = 22 * look.eye, ry = 27 * look.eye;
  const open = Math.max(0.04, look.open * (1 - blink));
  // t runs from the left to the right of the picture; inner is +1 at the nose.
  const top = (t) => {
    const inner = -t * side;
    const lid = -ry * (2 * open - 1) + look.slant * inner * ry * 0.5 - 0.16 * ry * (1 - t * t);
    return Math.max(-ry * Math.sqrt(1 - t * t), lid);
  };
  const bottom = (t) => {
    const lid = ry * (1 - 1.25 * look.cheek * (1 - 0.35 * t * t)) * (blink > 0.6 ? 0.5 : 1);
    return Math.min(ry * Math.sqrt(1 - t * t), lid);
  };
  const upper = line(28, (t) => [cx + t * rx, cy + Math.min(top(t), bottom(t))]);
  const lower = line(28, (t) => [cx + t * rx, cy + bottom(t)]).reverse();
  const d = path([...upper, ...lower]);
  add(d, "#fffdf8");
  const px = cx + look.lookX * 10 - side * 1.5, py = cy + look.lookY * 11 + 1;
  const r = 11.5 * look.pupil;
  add(oval(px, py, r, r * 1.12), INK, { clip: d });
  add(oval(px - r * 0.32, py - r * 0.42, r * 0.3, r * 0.34), "#fff", { clip: d });
  if (look.spark > 0.05) {
    add(oval(px + r * 0.36, py + r * 0.42, r * 0.2 * look.spark, r * 0.22 * look.spark), "#fff", { clip: d });
    if (look.spark > 0.7) add(star(px - r * 0.28, py - r * 0.36, r * 0.55 * look.spark), "#fff", { clip: d });
  }
  add(d, "none", { stroke: INK, width: 2.6 });
  const lidded = upper.filter((_, i) => i > 0 && i < 28);
  add(path(lidded, false), "none", { stroke: INK, width: 4.6 });
}

function star(x, y, r) {
  return path(Array.from({ length: 8 }, (_, i) => {
    const a = (i * Math.PI) / 4, s = i % 2 ? r * 0.36 : r;
    return [x + s * Math.sin(a), y - s * Math.cos(a)];
  }));
}

function brow(add, look, side, tremble, breath) {
  const lift = look.browSkew * side * 7;
  const cx = 100 + side * 41 + tremble, cy = 47 - look.browY * 0.82 + breath - lift;
  const points = line(14, (t) => {
    const inner = -t * side;
    return [cx + t * 21, cy - look.browTilt * inner * 11.5 - look.browArch * 10 * (1 - t * t)];
  });
  add(path(points, false), "none", { stroke: INK, width: 5.6 * look.browWeight });
}

function nose(add, look, breath) {
  if (look.wrinkle < 0.08) return;
  for (const k of [-1, 0, 1]) {
    const y = 103 + k * 7 + breath;
    const d = `M${number(91 - k)} ${number(y + 2)}Q100 ${number(y - 6)} ${number(109 + k)} ${number(y + 2)}`;
    add(d, "none", { stroke: INK, width: 2.6, opacity: Math.min(1, 1.3 * look.wrinkle) });
  }
}

function mouth(add, look, tremble, breath, time) {
  const cx = 100 + tremble * 0.6, cy = 143 + look.mouthY + breath;
  const w = look.mouthW, gape = look.gape;
  const swell = (t) => Math.pow(Math.max(0, 1 - t * t), look.square);
  const base = (t) =>
    look.smile * (0.45 - t * t) + look.wave * Math.sin(t * 8.2 + time * 9 * look.shake) -
    look.skew * 9 * Math.max(0, t) * (1 - 0.3 * t);
  const top = (t) => base(t) - gape * look.up * swell(t) - look.skew * 5 * Math.exp(-6 * (t - 0.55) ** 2);
  const bottom = (t) => base(t) + gape * (1 - look.up) * swell(t);
  const upper = line(36, (t) => [cx + t * w, cy + top(t)]);
  const lower = line(36, (t) => [cx + t * w, cy + bottom(t)]);
  if (gape < 1.5) {
    add(path(upper, false), "none", { stroke: INK, width: 4.8 });
    return;
  }
  const d = path([...upper, ...[...lower].reverse()]);
  add(d, "#6d1f2b");
  const low = cy + bottom(0);
  if (look.tongue > 0.05 && !look.skew)
    add(oval(cx, low + gape * 0.12, w * 0.56, gape * 0.5 * look.tongue), "#f08a86", { clip: d });
  if (look.teeth > 1.05) {
    // Gritted: both rows shut on each other.
    add(d, "#fffdf5", { opacity: Math.min(1, 2 * (look.teeth - 1)) });
    add(path(line(36, (t) => [cx + t * w, cy + (top(t) + bottom(t)) / 2]), false), "none",
      { stroke: INK, width: 2.2, clip: d });
    for (let k = -3; k <= 3; k++)
      add(`M${number(cx + k * w * 0.27)} ${number(cy - gape - 30)}V${number(cy + gape + 30)}`, "none",
        { stroke: INK, width: 2, clip: d });
  } else if (look.teeth > 0.08) {
    const row = gape * (0.14 + 0.12 * look.teeth);
    add(path([...upper, ...line(36, (t) => [cx + t * w, cy + top(t) + row]).reverse()]), "#fffdf5",
      { clip: d });
    if (look.teeth > 0.75)
      add(path([...lower, ...line(36, (t) => [cx + t * w, cy + bottom(t) - row * 0.8]).reverse()]),
        "#fffdf5", { clip: d });
  }
  add(d, "none", { stroke: INK, width: 4.4 });
  if (look.skew > 0.15 && look.tongue > 0.3) {
    // The tongue comes out, as after a bad bite.
    const x = cx - w * 0.18, y = cy + bottom(-0.18) - 3, s = look.skew * look.tongue;
    const t = `M${number(x - 11)} ${number(y)}v${number(11 * s)}a11 ${number(12 * s)} 0 0 0 22 0v${number(-11 * s)}Z`;
    add(t, "#f08a86", { stroke: INK, width: 3.2 });
    add(`M${number(x)} ${number(y + 2)}v${number(11 * s)}`, "none", { stroke: INK, width: 1.8, opacity: 0.6 });
  }
}

function extras(add, look, time) {
  if (look.tear > 0.12) {
    const fall = (time * 0.35) % 1, y = 112 + 52 * fall * fall, s = 5.5 + 3.5 * look.tear;
    add(drop(49, y, s), "#58a6e8", { stroke: "#2f79bd", width: 1.6, opacity: look.tear * (1 - 0.5 * fall) });
    add(drop(146, 118 + 3 * Math.sin(time), s * 0.9), "#58a6e8",
      { stroke: "#2f79bd", width: 1.6, opacity: look.tear });
  }
  if (look.sweat > 0.12)
    for (const [x, y, s] of [[22, 66, 8], [178, 52, 9], [184, 88, 6.5]])
      add(drop(x, y + 3 * Math.sin(time * 1.3 + x), s), "#8cc8f2",
        { stroke: "#3f86bf", width: 1.6, opacity: look.sweat });
  if (look.vein > 0.15) {
    const s = 0.9 + 0.1 * Math.sin(time * 6);
    for (const a of [0, 1, 2, 3]) {
      const q = (p) => {
        const c = Math.cos((a * Math.PI) / 2), n = Math.sin((a * Math.PI) / 2);
        return [166 + s * (c * p[0] - n * p[1]), 26 + s * (n * p[0] + c * p[1])];
      };
      const [p0, p1, p2] = [[4, 14], [4, 4], [14, 4]].map(q);
      add(`M${p0.map(number).join(" ")}Q${p1.map(number).join(" ")} ${p2.map(number).join(" ")}`, "none",
        { stroke: "#a31621", width: 4.2, opacity: look.vein });
    }
  }
  if (look.stars > 0.15)
    for (const [x, y, r] of [[18, 36, 10], [183, 30, 12], [12, 92, 6.5], [190, 84, 7.5]])
      add(star(x, y, r * look.stars * (0.85 + 0.15 * Math.sin(time * 5 + x))), "#fff7c2",
        { stroke: "#c9742a", width: 1.6 });
  if (look.pale > 0.15)
    for (const k of [-2, -1, 0, 1, 2])
      add(`M${number(100 + k * 9)} 4v${number(15 * look.pale - 2 * Math.abs(k))}`, "none",
        { stroke: "#6b5b95", width: 3, opacity: 0.75 * look.pale });
}

function drop(x, y, s) {
  return `M${number(x)} ${number(y - 1.5 * s)}C${number(x + 0.5 * s)} ${number(y - 0.6 * s)} ` +
    `${number(x + s)} ${number(y - 0.3 * s)} ${number(x + s)} ${number(y + 0.2 * s)}` +
    `A${number(s)} ${number(s)} 0 0 1 ${number(x - s)} ${number(y + 0.2 * s)}` +
    `C${number(x - s)} ${number(y - 0.3 * s)} ${number(x - 0.5 * s)} ${number(y - 0.6 * s)} ` +
    `${number(x)} ${number(y - 1.5 * s)}Z`;
}

export const tintOf = (look) => `rgb(${look.tint.map((c) => Math.round(Math.min(255, Math.max(0, c)))).join(",")})`;

// An SVG that keeps its elements and only changes what they are.
let clips = 0;
const NS = "http://www.w3.org/2000/svg";
export class SvgFace {
  constructor(svg) {
    this.svg = svg;
    svg.setAttribute("viewBox", "0 0 200 200");
    this.elements = [];
    this.clips = new Map();
    this.defs = svg.appendChild(document.createElementNS(NS, "defs"));
  }

  draw(look, time = 0, blink = 0) {
    const list = shapes(look, time, blink);
    while (this.elements.length < list.length) {
      const element = this.svg.appendChild(document.createElementNS(NS, "path"));
      element.setAttribute("stroke-linecap", "round");
      element.setAttribute("stroke-linejoin", "round");
      this.elements.push({ element, last: {} });
    }
    this.elements.forEach(({ element, last }, i) => {
      const shape = list[i];
      const set = (name, value) => {
        if (last[name] !== value) element.setAttribute(name, (last[name] = value));
      };
      set("display", shape ? "inline" : "none");
      if (!shape) return;
      set("d", shape.d);
      set("fill", shape.fill);
      set("stroke", shape.stroke ?? "none");
      set("stroke-width", shape.width ?? 0);
      set("opacity", (shape.opacity ?? 1).toFixed(2));
      set("clip-path", shape.clip ? this.clip(i, shape.clip) : "none");
    });
  }

  clip(index, d) {
    let clip = this.clips.get(index);
    if (!clip) {
      const id = `face-clip-${clips++}`;
      const holder = this.defs.appendChild(document.createElementNS(NS, "clipPath"));
      holder.id = id;
      clip = { id, path: holder.appendChild(document.createElementNS(NS, "path")), d: "" };
      this.clips.set(index, clip);
    }
    if (clip.d !== d) clip.path.setAttribute("d", (clip.d = d));
    return `url(#${clip.id})`;
  }
}

export function drawOn(context, size, look, time = 0, blink = 0) {
  // The same face on a canvas: the middle of it is a square of `size` pixels at the origin.
  const scale = size / 200;
  context.save();
  context.scale(scale, scale);
  context.lineCap = context.lineJoin = "round";
  for (const shape of shapes(look, time, blink)) {
    context.save();
    context.globalAlpha = shape.opacity ?? 1;
    if (shape.clip) context.clip(new Path2D(shape.clip));
    const d = new Path2D(shape.d);
    if (shape.fill !== "none") {
      context.fillStyle = shape.fill;
      context.fill(d);
    }
    if (shape.stroke) {
      context.strokeStyle = shape.stroke;
      context.lineWidth = shape.width;
      context.stroke(d);
    }
    context.restore();
  }
  context.restore();
}

// Blinks every few seconds: 0 open, 1 shut.
export class Blinker {
  constructor() {
    this.next = 2;
  }
  at(time) {
    if (time > this.next + 0.18) this.next = time + 1.5 + 4 * Math.random();
    const into = time - this.next;
    return into > 0 && into < 0.18 ? Math.sin((into / 0.18) * Math.PI) : 0;
  }
}

// Weights that follow their goal within about a quarter of a second.
export class Easer {
  constructor() {
    this.now = new Array(FEELINGS.length).fill(0);
  }
  towards(goal, dt) {
    const share = 1 - Math.exp(-dt / 0.12);
    this.now = this.now.map((value, i) => value + share * ((goal[i] ?? 0) - value));
    return this.now;
  }
}
