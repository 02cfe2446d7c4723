// Time: play, pause, scrub, speed.

import { element, number } from "./words.js";

/** Seconds that the whole motion takes at speed one. */
const WHOLE = 8;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

/** Moves the cursor of all that listens. */
export class Player {
  constructor(listen, loops) {
    Object.assign(this, { listen, loops, time: 0, span: [0, 1], speed: 1, playing: false, painted: 0, busy: 0 });
    this.button = element("button", { type: "button", "aria-label": "play", onclick: () => this.toggle() }, "▶ play");
    this.slider = element("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, "aria-label": "time", oninput: () => this.seek(this.span[0] + (this.slider.value / 1000) * (this.span[1] - this.span[0])) });
    this.shown = element("span", { class: "time" });
    this.speeds = element("select", { "aria-label": "speed", onchange: () => (this.speed = Number(this.speeds.value)) }, ...SPEEDS.map((s) => element("option", { value: s, selected: s === 1 }, `speed ${s}`)));
    this.element = element("div", { class: "bar" }, this.button, this.slider, this.shown, this.speeds);
  }

  /** The times of a motion; it begins anew. */
  over(span) {
    this.span = span;
    this.seek(span[0]);
  }

  seek(t) {
    this.time = t;
    this.slider.value = (1000 * (t - this.span[0])) / (this.span[1] - this.span[0] || 1);
    this.shown.textContent = `t = ${number(t)}`;
    this.listen(t);
  }

  toggle(on = !this.playing) {
    this.playing = on;
    this.button.textContent = on ? "❚❚ pause" : "▶ play";
    this.button.setAttribute("aria-label", on ? "pause" : "play");
    if (!on) return;
    if (this.time >= this.span[1] && !this.loops) this.seek(this.span[0]);
    this.last = null;
    requestAnimationFrame((now) => this.step(now));
  }

  step(now) {
    if (!this.playing) return;
    const length = this.span[1] - this.span[0];
    const passed = this.last === null ? 0 : Math.min(0.25, (now - this.last) / 1000);
    this.last = now;
    let t = this.time + (passed * this.speed * length) / WHOLE;
    if (t >= this.span[1]) {
      if (!this.loops) {
        this.seek(this.span[1]);
        this.toggle(false);
        return;
      }
      t = this.span[0] + ((t - this.span[0]) % length);
    }
    const start = performance.now();
    this.seek(t);
    this.painted += 1;
    this.busy += performance.now() - start;
    requestAnimationFrame((later) => this.step(later));
  }

  /** A step of a hundredth of the motion. */
  nudge(sign) {
    const step = (this.span[1] - this.span[0]) / 100;
    this.seek(Math.max(this.span[0], Math.min(this.span[1], this.time + sign * step)));
  }

  faster(sign) {
    const k = SPEEDS.indexOf(this.speed) + sign;
    if (SPEEDS[k]) this.speeds.value = this.speed = SPEEDS[k];
  }
}
