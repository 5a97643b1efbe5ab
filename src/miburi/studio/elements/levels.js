// The feelings: a button with its face, and its three levels on their three time scales.
import { ask, listen } from "/static/live.js";
import { say } from "/static/page.js";
import { mix, SvgFace, tintOf } from "/static/face.js";

const FULL = 1.2; // seconds until a held button has its full strength

export default {
  template: `<div class="levels">
    <div class="mood-now" :class="{ faint: !shown }">
      <div class="mood-number" :aria-label="words.mood"><i>μ</i> <b ref="mu">0.00</b></div>
      <div class="mood-words"><b ref="what" role="status"></b><span ref="why"></span></div>
    </div>
    <div class="level-legend" aria-hidden="true">
      <span v-for="level in levels" :class="level">{{ words[level] }}</span>
    </div>
    <div class="level-grid">
      <button v-for="(name, i) in names" :key="name" class="feel" type="button" ref="buttons"
        :data-feeling="name" :title="words.press" :aria-label="words.names[name]"
        @pointerdown="press(i, $event)" @pointerup="release(i, $event)" @pointerleave="cancel(i)"
        @keydown.enter.prevent="tap(i)" @keydown.space.prevent="tap(i)" @contextmenu.prevent>
        <svg ref="faces" aria-hidden="true"></svg>
        <span class="feel-name">{{ words.names[name] }}</span>
        <span class="bars" role="img" ref="bars">
          <span v-for="level in levels" class="bar" :class="level"><i></i></span>
        </span>
        <span class="charge"></span>
      </button>
    </div>
  </div>`,
  props: { words: Object, faces: Object, strength: Number },
  data() {
    const names = this.faces.feelings.map((feeling) => feeling.name);
    return { names, levels: ["emotion", "feeling", "mood"], shown: false };
  },

  mounted() {
    this.$refs.faces.forEach((svg, i) => {
      const look = mix(this.faces, this.names.map((_, j) => (i === j ? 0.9 : 0)));
      svg.style.background = tintOf(look);
      new SvgFace(svg).draw(look, 0.1);
    });
    this.marks = this.$refs.bars.map((bars) => [...bars.querySelectorAll("i")]);
    this.due = 0;
    this.unlisten = listen((state) => this.take(state));
  },
  beforeUnmount() { this.unlisten?.(); },

  methods: {
    take(state) {
      if (!state || performance.now() < this.due) return;
      this.due = performance.now() + 90;
      this.levels.forEach((level) => state[level].forEach((value, i) => {
        const mark = this.marks[i][this.levels.indexOf(level)];
        mark.style.transform = `scaleX(${value.toFixed(4)})`;
      }));
      state.mood.forEach((mood, i) => {
        const said = this.levels.map((level) => `${this.words[level]} ${Math.round(100 * state[level][i])} %`);
        this.$refs.bars[i].setAttribute("aria-label", said.join(", "));
        this.$refs.buttons[i].dataset.mood = mood;
        this.$refs.buttons[i].classList.toggle("on", state.felt?.feeling === this.names[i]);
      });
      const now = state.expressed ?? state.felt;
      this.shown = Boolean(now);
      this.$refs.mu.textContent = (now?.mood ?? 0).toFixed(2);
      const name = now ? this.words.names[now.feeling] : this.words.neutral;
      if (this.$refs.what.textContent !== name) this.$refs.what.textContent = name; // else it is read again
      this.$refs.why.textContent = this.reason(state, now);
    },

    reason(state, now) {
      if (!now) return this.words.why_neutral;
      if (state.paused) return this.words.why_paused;
      if (state.stop) return this.words.why_stopped;
      if (state.asked && state.expressed) return this.words.why_asked;
      const i = this.names.indexOf(now.feeling);
      return this.words.why_felt.replace("{emotion}", state.emotion[i].toFixed(2));
    },

    press(i, event) {
      if (event.button) return;
      this.pressed = { i, since: event.timeStamp };
      this.$refs.buttons[i].classList.add("held");
    },
    cancel(i) {
      this.$refs.buttons[i].classList.remove("held");
      this.pressed = null;
    },
    release(i, event) {
      if (this.pressed?.i !== i) return;
      // The finger's own times: a slow page handles them late.
      const seconds = (event.timeStamp - this.pressed.since) / 1000;
      // A short press is a remark of the slider's strength; holding goes up to the full.
      const held = Math.max(0, Math.min(1, (seconds - 0.25) / (FULL - 0.25)));
      this.cancel(i);
      this.say(i, this.strength + (1 - this.strength) * held);
    },
    tap(i) { this.say(i, this.strength); },
    async say(i, strength) {
      const stimulus = { feeling: this.names[i], strength: Number(strength.toFixed(3)), source: "speech" };
      const refusal = await ask("/stimulus", stimulus);
      if (refusal) say(refusal);
      const button = this.$refs.buttons[i];
      button.classList.remove("said");
      void button.offsetWidth; // starts the animation anew
      button.classList.add("said");
    },
  },
};
