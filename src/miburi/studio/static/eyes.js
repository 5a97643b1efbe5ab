// The partner's eyes: who is there, and what the face shows, by a model that runs in this page. No
// picture leaves it; the name of what a face showed, how clearly, and where it is across the picture
// go to the partner, which turns to it.
import { gaze } from "/static/face.js";
import { ask } from "/static/live.js";
import { Choice, Look } from "/static/look.js";

const FILES = "/static/human/", EVERY = 334; // ms: three pictures a second at most
const REACH = 0.12, SOFT = 250; // the pupils' dead zone, of the picture's width; ms to follow
const OFTEN = 1000, AGAIN = 2000, MOVED = 0.04; // ms between two places told; ms after which one that stays is told again
const OFF = { enabled: false };

function load() {
  // Once a page; human.js is no module.
  return (load.done ??= new Promise((done, fail) => {
    const script = document.createElement("script");
    Object.assign(script, { src: FILES + "human.js", onload: () => done(window.Human), onerror: () => fail(new Error("none")) });
    document.head.append(script);
  }));
}

async function picture(view) {
  // Without a graphics card Chromium keeps each picture of a video that it draws, up to a thousand of
  // them (300 MB), and none that it copies. Where copying fails, or would turn it, the video is drawn.
  let frame;
  try {
    frame = new VideoFrame(view);
    const { width, height } = frame.visibleRect, form = { format: "RGBA" };
    const turned = frame.rotation || frame.flip || width !== view.videoWidth || height !== view.videoHeight;
    if (turned || frame.allocationSize(form) !== 4 * width * height) return view; // or form is unknown to it
    const pixels = new ImageData(width, height);
    await frame.copyTo(pixels.data, form);
    return pixels;
  } catch {
    return view;
  } finally {
    frame?.close();
  }
}

export async function start() {
  if (!window.isSecureContext) throw new Error("insecure");
  if (!navigator.mediaDevices) throw new Error("none");
  const video = { width: 320, height: 240, facingMode: "user" };
  const stream = await navigator.mediaDevices.getUserMedia({ video }).catch((error) => {
    throw new Error(error.name === "NotFoundError" ? "no_camera" : "denied");
  });
  const stop = () => stream.getTracks().forEach((track) => track.stop());
  const view = Object.assign(document.createElement("video"), { srcObject: stream, muted: true, playsInline: true });
  let human;
  try {
    await view.play();
    const { Human } = await load();
    human = new Human({
      backend: "wasm", wasmPath: FILES, modelBasePath: FILES + "models", debug: false, warmup: "none",
      cacheSensitivity: 0, filter: OFF, gesture: OFF, hand: OFF, body: OFF, object: OFF, segmentation: OFF,
      face: {
        enabled: true, iris: OFF, description: OFF, mesh: { enabled: true }, emotion: { enabled: true, minConfidence: 0.01 },
        detector: { modelPath: "blazeface.json", rotation: false, maxDetected: 3 },
      },
    });
    await human.load();
  } catch (error) {
    stop();
    throw error;
  }
  const look = new Look(performance.now()), choice = new Choice();
  let place = null, at = null, last = 0, running = true, told = null, toldAt = -Infinity;

  function tell(x) {
    const since = performance.now() - toldAt, lost = x === null;
    if (lost ? told === null : since < OFTEN || (since < AGAIN && told !== null && Math.abs(x - told) < MOVED)) return;
    told = x;
    toldAt = performance.now();
    ask("/face", { x: lost ? null : Math.round(1000 * x) / 1000 });
  }

  async function see() {
    const begin = performance.now();
    if (!document.hidden && view.readyState >= 2) {
      const faces = (await human.detect(await picture(view))).face.map(read);
      if (!running) return;
      const face = choice.take(faces, performance.now());
      for (const news of look.take(face ?? null, performance.now())) ask("/sense", news);
      if (face !== undefined) tell(face ? Math.min(1, Math.max(0, face.x)) : null);
      // The camera is not mirrored: its left is the partner's left, which is the right of its face.
      if (face === null) place = null;
      else if (face && (!place || Math.hypot(face.x - place.x, face.y - place.y) > REACH)) place = { x: face.x, y: face.y };
      const spent = performance.now() - begin;
      Object.assign(document.documentElement.dataset, { faces: faces.length, seeing: spent.toFixed(0) });
    }
    setTimeout(see, Math.max(EVERY / 3, EVERY - (performance.now() - begin)));
  }
  see();

  gaze.at = (now) => {
    const goal = place && { right: 1.6 * (0.5 - place.x), down: 1.2 * (place.y - 0.5) };
    const share = 1 - Math.exp(-Math.min(100, now - last) / SOFT);
    last = now;
    if (!goal) return (at = null);
    at = at ?? { right: 0, down: 0 };
    at = { right: at.right + share * (goal.right - at.right), down: at.down + share * (goal.down - at.down) };
    return at;
  };

  return () => {
    running = false;
    tell(null);
    gaze.at = () => null;
    stop();
    view.srcObject = null;
  };
}

function read({ boxRaw: [x, y, width, height], rotation, emotion }) {
  const shows = Object.fromEntries((emotion ?? []).map((one) => [one.emotion, one.score]));
  const { pitch, roll } = rotation?.angle ?? { pitch: 9, roll: 9 }; // unknown: not level
  return { x: x + width / 2, y: y + height / 2, width, pitch, roll, shows };
}
