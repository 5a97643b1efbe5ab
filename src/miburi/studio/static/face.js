// The face: a few numbers (the faces of the feelings, mixed) become shapes, and the shapes an
// SVG or a drawing on a canvas. Everything is laid out in a square of 200 by 200; y points down.

const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));

export function mix(faces, weights) {
  // faces: the server's {rest, feelings}, where a feeling has what it changes at full strength;
  // weights: a number from 0 to 1 for each. Faint feelings must be seen: they count as w^0.55.
  const { tint, ...parts } = faces.rest;
  const held = faces.feelings.map((_, i) => Math.pow(Math.max(0, weights[i] ?? 0), 0.55));
  const sum = held.reduce((a, b) => a + b, 0);
  const share = held.map((weight) => (sum > 1 ? weight / sum * Math.max(...held, 1e-9) ** 0.2 : weight));
  const look = { tint: rgb(tint) };
  for (const [part, numbers] of Object.entries(parts)) look[part] = { ...numbers };
  faces.feelings.forEach((feeling, i) => {
    for (const part of Object.keys(parts))
      for (const [key, value] of Object.entries(feeling[part]))
        look[part][key] += share[i] * (value - parts[part][key]);
    rgb(feeling.tint).forEach((value, c) => (look.tint[c] += share[i] * (value - rgb(tint)[c])));
  });
  return look;
}

// What moves in a face beside its feelings: how far the voice opens the mouth, 0 to 1, and where the
// eyes look, {right, down}; null while there is none. voice.js and eyes.js say so.
export const lips = { open: () => null };
export const gaze = { at: () => null };
// Where the partner's own looks lead its eyes, [right, down], -1 to 1; pages take it from the state.
export const led = { eyes: [0, 0] };

const within = (place) => Math.min(1.2, Math.max(-1.2, place)); // where the lids still show the pupil

export function enliven(look, now) {
  const open = lips.open(now), place = gaze.at(now);
  if (open !== null) look.mouth.gape = 2 + open * Math.max(18, look.mouth.gape);
  if (place !== null) Object.assign(look.eyes, place);
  look.eyes.right = within(look.eyes.right + led.eyes[0]);
  look.eyes.down = within(look.eyes.down + led.eyes[1]);
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
  const tremble = look.signs.shake * Math.sin(time * 55) * 0.9;
  const breath = Math.sin(time * 1.7) * 0.8;
  for (const side of [-1, 1]) {
    if (look.signs.blush > 0.02)
      add(oval(100 + side * 68, 122 + breath, 15, 9), "#f0705c", { opacity: 0.55 * look.signs.blush });
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
  const rx = 22 * look.eyes.size, ry = 27 * look.eyes.size;
  const open = Math.max(0.04, look.eyes.open * (1 - blink));
  // t runs from the left to the right of the picture; inner is +1 at the nose.
  const top = (t) => {
    const inner = -t * side;
    const lid = -ry * (2 * open - 1) + look.eyes.slant * inner * ry * 0.5 - 0.16 * ry * (1 - t * t);
    const rim = -ry * Math.sqrt(1 - t * t), blend = 0.1 * ry;
    return (rim + lid + Math.hypot(rim - lid, blend)) / 2; // the lower of both, without a corner
  };
  const bottom = (t) => {
    const lid = ry * (1 - 1.25 * look.eyes.cheek * (1 - 0.35 * t * t)) * (blink > 0.6 ? 0.5 : 1);
    return Math.min(ry * Math.sqrt(1 - t * t), lid);
  };
  // Points lie closer where the rim is steep, or else it has corners there.
  const along = (edge) => line(28, (t) => {
    const x = Math.sin((Math.PI / 2) * t);
    return [cx + x * rx, cy + edge(x)];
  });
  const upper = along((t) => Math.min(top(t), bottom(t)));
  const lower = along(bottom).reverse();
  const d = path([...upper, ...lower]);
  add(d, "#fffdf8");
  const px = cx + look.eyes.right * 10 - side * 1.5, py = cy + look.eyes.down * 11 + 1;
  const r = 11.5 * look.eyes.pupil;
  add(oval(px, py, r, r * 1.12), INK, { clip: d });
  add(oval(px - r * 0.32, py - r * 0.42, r * 0.3, r * 0.34), "#fff", { clip: d });
  if (look.eyes.spark > 0.05) {
    add(oval(px + r * 0.36, py + r * 0.42, r * 0.2 * look.eyes.spark, r * 0.22 * look.eyes.spark), "#fff", { clip: d });
    if (look.eyes.spark > 0.7) add(star(px - r * 0.28, py - r * 0.36, r * 0.55 * look.eyes.spark), "#fff", { clip: d });
  }
  add(d, "none", { stroke: INK, width: 2.6 });
  const lidded = upper.slice(4, -4);
  add(path(lidded, false), "none", { stroke: INK, width: 4.6 });
}

function star(x, y, r) {
  return path(Array.from({ length: 8 }, (_, i) => {
    const a = (i * Math.PI) / 4, s = i % 2 ? r * 0.36 : r;
    return [x + s * Math.sin(a), y - s * Math.cos(a)];
  }));
}

function brow(add, look, side, tremble, breath) {
  const lift = look.brows.skew * side * 7;
  const cx = 100 + side * 41 + tremble, cy = 47 - look.brows.lift * 0.82 + breath - lift;
  const points = line(14, (t) => {
    const inner = -t * side;
    return [cx + t * 21, cy - look.brows.tilt * inner * 11.5 - look.brows.arch * 10 * (1 - t * t)];
  });
  add(path(points, false), "none", { stroke: INK, width: 5.6 * look.brows.weight });
}

function nose(add, look, breath) {
  if (look.signs.wrinkle < 0.08) return;
  for (const k of [-1, 0, 1]) {
    const y = 103 + k * 7 + breath;
    const d = `M${number(91 - k)} ${number(y + 2)}Q100 ${number(y - 6)} ${number(109 + k)} ${number(y + 2)}`;
    add(d, "none", { stroke: INK, width: 2.6, opacity: Math.min(1, 1.3 * look.signs.wrinkle) });
  }
}

function mouth(add, look, tremble, breath, time) {
  const cx = 100 + tremble * 0.6, cy = 143 + look.mouth.down + breath;
  const w = look.mouth.width, gape = look.mouth.gape;
  const swell = (t) => Math.pow(Math.max(0, 1 - t * t), look.mouth.square);
  const base = (t) =>
    look.mouth.smile * (0.45 - t * t) + look.mouth.wave * Math.sin(t * 8.2 + time * 9 * look.signs.shake) -
    look.mouth.skew * 9 * Math.max(0, t) * (1 - 0.3 * t);
  const top = (t) => base(t) - gape * look.mouth.upper * swell(t) - look.mouth.skew * 5 * Math.exp(-6 * (t - 0.55) ** 2);
  const bottom = (t) => base(t) + gape * (1 - look.mouth.upper) * swell(t);
  const upper = line(36, (t) => [cx + t * w, cy + top(t)]);
  const lower = line(36, (t) => [cx + t * w, cy + bottom(t)]);
  if (gape < 1.5) {
    add(path(upper, false), "none", { stroke: INK, width: 4.8 });
    return;
  }
  const d = path([...upper, ...[...lower].reverse()]);
  add(d, "#6d1f2b");
  const low = cy + bottom(0);
  if (look.mouth.tongue > 0.05 && !look.mouth.skew)
    add(oval(cx, low + gape * 0.12, w * 0.56, gape * 0.5 * look.mouth.tongue), "#f08a86", { clip: d });
  if (look.mouth.teeth > 1.05) {
    // Gritted: both rows shut on each other.
    add(d, "#fffdf5", { opacity: Math.min(1, 2 * (look.mouth.teeth - 1)) });
    add(path(line(36, (t) => [cx + t * w, cy + (top(t) + bottom(t)) / 2]), false), "none",
      { stroke: INK, width: 2.2, clip: d });
    for (let k = -3; k <= 3; k++)
      add(`M${number(cx + k * w * 0.27)} ${number(cy - gape - 30)}V${number(cy + gape + 30)}`, "none",
        { stroke: INK, width: 2, clip: d });
  } else if (look.mouth.teeth > 0.08) {
    const row = gape * (0.14 + 0.12 * look.mouth.teeth);
    add(path([...upper, ...line(36, (t) => [cx + t * w, cy + top(t) + row]).reverse()]), "#fffdf5",
      { clip: d });
    if (look.mouth.teeth > 0.75)
      add(path([...lower, ...line(36, (t) => [cx + t * w, cy + bottom(t) - row * 0.8]).reverse()]),
        "#fffdf5", { clip: d });
  }
  add(d, "none", { stroke: INK, width: 4.4 });
  if (look.mouth.skew > 0.15 && look.mouth.tongue > 0.3) {
    // The tongue comes out, as after a bad bite.
    const x = cx - w * 0.18, y = cy + bottom(-0.18) - 3, s = look.mouth.skew * look.mouth.tongue;
    const t = `M${number(x - 11)} ${number(y)}v${number(11 * s)}a11 ${number(12 * s)} 0 0 0 22 0v${number(-11 * s)}Z`;
    add(t, "#f08a86", { stroke: INK, width: 3.2 });
    add(`M${number(x)} ${number(y + 2)}v${number(11 * s)}`, "none", { stroke: INK, width: 1.8, opacity: 0.6 });
  }
}

function extras(add, look, time) {
  if (look.signs.tear > 0.12) {
    const fall = (time * 0.35) % 1, y = 112 + 52 * fall * fall, s = 5.5 + 3.5 * look.signs.tear;
    add(drop(49, y, s), "#58a6e8", { stroke: "#2f79bd", width: 1.6, opacity: look.signs.tear * (1 - 0.5 * fall) });
    add(drop(146, 118 + 3 * Math.sin(time), s * 0.9), "#58a6e8",
      { stroke: "#2f79bd", width: 1.6, opacity: look.signs.tear });
  }
  if (look.signs.sweat > 0.12)
    for (const [x, y, s] of [[22, 66, 8], [178, 52, 9], [184, 88, 6.5]])
      add(drop(x, y + 3 * Math.sin(time * 1.3 + x), s), "#8cc8f2",
        { stroke: "#3f86bf", width: 1.6, opacity: look.signs.sweat });
  if (look.signs.vein > 0.15) {
    const s = 0.9 + 0.1 * Math.sin(time * 6);
    for (const a of [0, 1, 2, 3]) {
      const q = (p) => {
        const c = Math.cos((a * Math.PI) / 2), n = Math.sin((a * Math.PI) / 2);
        return [166 + s * (c * p[0] - n * p[1]), 26 + s * (n * p[0] + c * p[1])];
      };
      const [p0, p1, p2] = [[4, 14], [4, 4], [14, 4]].map(q);
      add(`M${p0.map(number).join(" ")}Q${p1.map(number).join(" ")} ${p2.map(number).join(" ")}`, "none",
        { stroke: "#a31621", width: 4.2, opacity: look.signs.vein });
    }
  }
  if (look.signs.stars > 0.15)
    for (const [x, y, r] of [[18, 36, 10], [183, 30, 12], [12, 92, 6.5], [190, 84, 7.5]])
      add(star(x, y, r * look.signs.stars * (0.85 + 0.15 * Math.sin(time * 5 + x))), "#fff7c2",
        { stroke: "#c9742a", width: 1.6 });
  if (look.signs.pale > 0.15)
    for (const k of [-2, -1, 0, 1, 2])
      add(`M${number(100 + k * 9)} 4v${number(15 * look.signs.pale - 2 * Math.abs(k))}`, "none",
        { stroke: "#6b5b95", width: 3, opacity: 0.75 * look.signs.pale });
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

// Blinks as people do: 17 times a minute at rest, 26 times while talking, at intervals whose
// logarithm is normal (Bentivoglio et al. 1997, Movement Disorders 12; their spread is ours).
const AT_REST = 60 / 17, TALKING = 60 / 26, SPREAD = 0.5;

// 0 open, 1 shut.
export class Blinker {
  constructor(random = Math.random) {
    this.random = random;
    this.next = 2;
  }
  at(time, talks = false) {
    if (time > this.next + 0.18) {
      const normal = Math.sqrt(-2 * Math.log(1 - this.random())) * Math.cos(2 * Math.PI * this.random());
      const mean = talks ? TALKING : AT_REST;
      this.next += Math.max(0.36, mean * Math.exp(SPREAD * normal - SPREAD ** 2 / 2));
      if (this.next < time) this.next = time;  // the page was hidden
    }
    const into = time - this.next;
    return into > 0 && into < 0.18 ? Math.sin((into / 0.18) * Math.PI) : 0;
  }
}

// Weights that follow their goal within about a quarter of a second.
export class Easer {
  constructor(count) {
    this.now = new Array(count).fill(0);
  }
  towards(goal, dt) {
    const share = 1 - Math.exp(-dt / 0.12);
    this.now = this.now.map((value, i) => value + share * ((goal[i] ?? 0) - value));
    return this.now;
  }
}
