// A clip of the last seconds. States are kept, which costs nothing; a film is made by playing
// them once more on a canvas of its own and recording that.
import * as THREE from "three";

const SECONDS = 20, WIDTH = 960, HEIGHT = 600, RATE = 25; // a slow device draws half of each
const PIECE = 100; // ms
const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

export const clipKind = () =>
  window.MediaRecorder && HTMLCanvasElement.prototype.captureStream && KINDS.find((kind) => MediaRecorder.isTypeSupported(kind));

export class Past {
  constructor() {
    this.moments = [];
  }

  keep(state) {
    const { angles, face, hand, hand_out: out } = state;
    this.moments.push({ at: performance.now(), angles, face, hand, out });
    while (this.moments[0].at < performance.now() - 1000 * SECONDS) this.moments.shift();
  }
}

export async function film(moments, scene, camera, pose, slow) {
  // `pose` puts a moment into the scene and returns what puts it back. Resolves to a file's content.
  const canvas = document.createElement("canvas"), part = slow ? 0.5 : 1;
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: !slow });
  renderer.shadowMap.enabled = !slow;
  renderer.setSize(part * WIDTH, part * HEIGHT, false);
  const eye = camera.clone();
  eye.aspect = WIDTH / HEIGHT;
  eye.updateProjectionMatrix();
  const recorder = new MediaRecorder(canvas.captureStream(RATE), { mimeType: clipKind(), videoBitsPerSecond: 4e6 });
  const pieces = [];
  recorder.ondataavailable = (event) => { if (event.data.size) pieces.push(event.data); };
  const ended = new Promise((resolve) => { recorder.onstop = resolve; });
  const draw = (moment) => {
    const putBack = pose(moment);
    renderer.render(scene, eye);
    putBack();
  };
  // Draws what `show` gives, until it gives nothing.
  const play = (show) => new Promise((resolve) => {
    const step = () => {
      const moment = show();
      if (!moment) return resolve();
      draw(moment);
      requestAnimationFrame(step);
    };
    step();
  });
  // A recorder takes its first picture, and the last one, later than they are drawn: each of the
  // two stands until pieces of the film have come.
  recorder.start(PIECE);
  await play(() => !pieces.length && moments[0]);
  const begin = performance.now() - moments[0].at;
  let next = 0;
  await play(() => {
    const time = performance.now() - begin;
    while (next < moments.length - 1 && moments[next + 1].at <= time) next++;
    return next < moments.length - 1 && moments[next];
  });
  const played = pieces.length;
  await play(() => pieces.length < played + 2 && moments.at(-1));
  recorder.stop();
  await ended;
  renderer.dispose();
  return new Blob(pieces, { type: recorder.mimeType });
}

export function download(blob) {
  const name = new Date().toISOString().slice(0, 19).replace(/\D/g, "");
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `miburi-${name}.${blob.type.includes("mp4") ? "mp4" : "webm"}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
