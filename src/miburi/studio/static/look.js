// From faces in pictures, a few a second, to what somebody shows. Times are in ms; numbers are ours.
const KINDS = {
  happy: "smile", surprise: "surprised_face", sad: "sad_face", angry: "angry_face", fear: "scared_face",
  disgust: "disgusted_face",
};
const SURE = ["happy", "surprise"]; // models take whoever looks down, or is tired, for the others
const MEAN = 700, CLEAR = 0.5; // a moving mean, and what it must reach
const LEVEL = 0.35, LASTING = 1500; // what is not sure: rad that the head may lean, and how long it must last
const AGAIN = 3000, ALONE = 60000; // a face that stays is told again; after so long alone, one is greeted

const NEAR = 0.2; // of the picture's width, how far a face moves between two pictures at most
const WIDER = 1.3, MEANWHILE = 1500, HIDDEN = 1000; // when another face is taken: how much wider, for how long; ms

// Of several faces, the one that is looked at: the nearest (widest) at first, and no other before that has
// been clearly nearer for a while, or before the one that is looked at has been gone for a moment.
export class Choice {
  constructor() {
    Object.assign(this, { held: null, seen: -Infinity, since: null });
  }
  take(faces, time) {
    // Take [{x, y, width, …}, …]; return one of them, null if nobody is there, undefined while it may come back.
    const widest = faces.reduce((a, b) => (a && a.width >= b.width ? a : b), null);
    const apart = (face) => Math.hypot(face.x - this.held.x, face.y - this.held.y);
    const near = this.held && faces.filter((face) => apart(face) < NEAR);
    const same = near?.reduce((a, b) => (a && apart(a) <= apart(b) ? a : b), null);
    if (!same && this.held && time - this.seen < HIDDEN) return undefined;
    const other = same && widest !== same && widest.width > WIDER * same.width;
    this.since = other ? this.since ?? time : null;
    const taken = !same || (other && time - this.since >= MEANWHILE) ? widest : same;
    if (taken) Object.assign(this, { seen: time, since: taken === same ? this.since : null });
    return (this.held = taken);
  }
}

export class Look {
  constructor(time) {
    Object.assign(this, { time, seen: time, means: {}, shown: null, since: time, told: null, toldAt: 0 });
  }
  take(face, time) {
    // Take {pitch, roll, shows: {happy: 0.9, …}} or null; return [{kind, clearness}, …], mostly none.
    const share = 1 - Math.exp(-(time - this.time) / MEAN), news = [];
    this.time = time;
    if (face && time - this.seen > ALONE) news.push({ kind: "greet", clearness: 1 });
    if (face) this.seen = time;
    const level = face && Math.abs(face.pitch) < LEVEL && Math.abs(face.roll) < LEVEL;
    for (const name of Object.keys(KINDS)) {
      const shows = face && (level || SURE.includes(name)) ? face.shows[name] ?? 0 : 0;
      this.means[name] = (this.means[name] ?? 0) + share * (shows - (this.means[name] ?? 0));
    }
    const strongest = Object.keys(KINDS).reduce((a, b) => (this.means[b] > this.means[a] ? b : a));
    const shown = this.means[strongest] > CLEAR ? strongest : null;
    if (shown !== this.shown) Object.assign(this, { shown, since: time });
    const lasts = shown && (SURE.includes(shown) || time - this.since >= LASTING);
    if (!shown) this.told = null;
    else if (lasts && (shown !== this.told || time - this.toldAt >= AGAIN)) {
      Object.assign(this, { told: shown, toldAt: time });
      news.push({ kind: KINDS[shown], clearness: Math.round(100 * this.means[shown]) / 100 });
    }
    return news;
  }
}
