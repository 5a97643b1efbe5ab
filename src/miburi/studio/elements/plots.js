// Three plots over the last minute: moods, hands, and each motor's speed ratio with the limit.
import { listen } from "/static/live.js";

const SPAN = 60;
const JOINT_COLOURS = ["#e2a400", "#3d78c2", "#8d7cc3", "#6d4f9c", "#ee7f2d", "#7d9a2c", "#d2402f", "#1ba3a8"];

export default {
  template: `<div class="plots">
    <figure v-for="plot in plots" :key="plot.key">
      <figcaption>{{ plot.title }} <small>{{ plot.limit ? limit && '≥ ' + limit : plot.unit }}</small></figcaption>
      <canvas ref="canvases" role="img" :aria-label="plot.title"></canvas>
      <div class="key" :title="words.only"><button v-for="(name, i) in plot.names" :key="name" type="button"
        :aria-pressed="alone[plot.key] === i" @click="alone[plot.key] = alone[plot.key] === i ? null : i">
        <i :style="{ background: plot.colours[i] }"></i>{{ name }}</button></div>
      <p v-if="plot.limit" class="note">{{ carded ? words.card : words.guards }}</p>
    </figure>
  </div>`,
  props: { words: Object, feelings: Array, colours: Array, joints: Array },
  data() {
    const { words } = this.$props;
    return {
      carded: false,
      limit: null, // the running rule's, once a state has told it
      alone: {}, // the one series that each plot shows, where somebody chose one
      plots: [
        { key: "mood", title: words.moods, unit: "0 – 1", top: 1, fixed: true, colours: this.colours, names: this.feelings,
          values: (s) => s.mood },
        { key: "hands", title: words.hands, unit: "m/s · m", top: 0.3, colours: ["#d2402f", "#3d78c2"],
          names: [words.hand_speed, words.extent], values: (s) => [s.hand_speed, s.extent] },
        { key: "ratio", title: words.ratio, top: 1.4, fixed: true, colours: JOINT_COLOURS, names: this.joints,
          values: (s) => s.ratios, limit: true, dots: true },
      ],
    };
  },

  async mounted() {
    this.samples = [];
    try {
      this.samples = await (await fetch("/api/v1/samples")).json();
    } catch { /* the WebSocket will bring them */ }
    let due = 0;
    this.unlisten = listen((state) => {
      if (!state) return;
      this.carded = state.body !== "simulated";
      this.limit = state.rule.ratio;
      const last = this.samples.at(-1)?.time ?? -1;
      if (state.time < last) this.samples = [];
      if (state.time - last >= 0.1) {
        this.samples.push({ ...state, stopped: Boolean(state.stop) });
        while (this.samples.length && this.samples[0].time < state.time - SPAN) this.samples.shift();
      }
      if (performance.now() > due && this.$el.offsetParent) {
        due = performance.now() + 200;
        this.plots.forEach((plot, i) => this.draw(plot, this.$refs.canvases[i]));
      }
    });
  },
  beforeUnmount() { this.unlisten?.(); },

  methods: {
    draw(plot, canvas) {
      const scale = window.devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width) return;
      if (canvas.width !== Math.round(width * scale)) {
        canvas.width = Math.round(width * scale);
        canvas.height = Math.round(height * scale);
      }
      const c = canvas.getContext("2d");
      c.setTransform(scale, 0, 0, scale, 0, 0);
      c.clearRect(0, 0, width, height);
      const style = getComputedStyle(canvas);
      const ink = style.getPropertyValue("--ink-2"), grid = style.getPropertyValue("--line");
      const left = 30, bottom = 16, above = 8, w = width - left - 4, h = height - bottom - above;
      const now = this.samples.at(-1)?.time ?? 0;
      const values = this.samples.map(plot.values);
      const highest = Math.max(...values.flat().filter((value) => value !== null), 0);
      const top = plot.fixed ? plot.top : Math.max(plot.top, Math.ceil(10 * highest) / 10);
      const x = (time) => left + w * (1 - (now - time) / SPAN);
      const y = (value) => above + h * (1 - Math.min(value, top) / top);
      c.fillStyle = "rgba(210,64,47,0.14)";
      this.samples.forEach((s, i) => {
        if (s.stopped) c.fillRect(x(s.time), above, Math.max(1, x(this.samples[i + 1]?.time ?? now) - x(s.time)), h);
      });
      c.font = "11px system-ui, sans-serif";
      c.fillStyle = ink;
      c.strokeStyle = grid;
      c.lineWidth = 1;
      c.textAlign = "right";
      c.textBaseline = "middle";
      for (const part of [0, 0.5, 1]) {
        const value = part * top;
        line(c, left, y(value), left + w, y(value));
        c.fillText(value.toFixed(top < 1 ? 2 : 1), left - 5, y(value));
      }
      c.textBaseline = "alphabetic";
      c.textAlign = "center";
      for (let s = 0; s <= SPAN; s += 15)
        c.fillText(s ? `−${s} s` : "0", Math.min(width - 8, Math.max(left + 8, x(now - s))), height - 3);
      if (plot.limit && this.limit) {
        c.strokeStyle = "#d2402f";
        c.setLineDash([5, 4]);
        line(c, left, y(this.limit), left + w, y(this.limit));
        c.setLineDash([]);
      }
      plot.colours.forEach((colour, k) => {
        c.strokeStyle = c.fillStyle = colour;
        const alone = this.alone[plot.key] ?? null;
        c.globalAlpha = alone === null || alone === k ? 1 : 0.08;
        c.lineWidth = 1.8;
        c.beginPath();
        let pen = false;
        for (const [i, sample] of this.samples.entries()) {
          const value = values[i][k];
          if (value === null || value === undefined) { pen = false; continue; }
          if (plot.dots) {
            c.fillRect(x(sample.time) - 1.2, y(value) - 1.2, 2.4, 2.4);
            continue;
          }
          pen ? c.lineTo(x(sample.time), y(value)) : c.moveTo(x(sample.time), y(value));
          pen = true;
        }
        c.stroke();
        c.globalAlpha = 1;
      });
    },
  },
};

function line(c, x0, y0, x1, y1) {
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(x1, y1);
  c.stroke();
}
