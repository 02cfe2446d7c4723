// A body in space as it moves: its surface coloured by pressure or displacement, turned as one likes.

import { BodyPanel } from "./body.js";
import { Camera } from "./camera.js";
import { Painter } from "./painter.js";
import { WebGl } from "./webgl.js";
import { element, number, rgb } from "./words.js";

/** What carries no pressure. */
const BODY = [205, 208, 214].map((x) => x / 255);
/** Where a picture takes more milliseconds, and the next does too, fewer triangles are drawn while the body moves. */
const SLOW = 80;
/** Milliseconds behind the last change after which all are drawn. */
const REST = 250;
const BORDER = 10;

export class SolidView extends BodyPanel {
  constructor(body) {
    const label = "the deformed body in space: arrow keys turn it, plus and minus magnify it, 0 turns it back";
    const canvas = element("canvas", { role: "application", "aria-label": label, tabindex: 0, class: "turns" });
    super(body, canvas, [...(body.solid.bearing.length ? [["pressure", "contact pressure"]] : []), ["u", "displacement ‖u‖"], ["none", "one colour"]]);
    this.sides = element("select", { "aria-label": "seen from", onchange: () => this.look(this.sides.value) }, element("option", { value: "" }, "a corner"), ...Camera.sides.map((s) => element("option", { value: s }, s)));
    this.camera = new Camera(body.solid.eye, () => {
      // the list names what it was turned to last
      if (!this.camera.stands) this.sides.selectedIndex = -1;
      this.paint();
    });
    this.camera.on(canvas, () => this.look(""));
    this.tools.prepend(element("label", {}, "from", this.sides));
    this.bears = new Float32Array(body.nodes.length / 3);
    this.painter = new Painter(body);
    this.processor = new WebGl(body);
    this.late = 0;
  }

  /** Whether it is painted: there is no WebGL, or it is gone. */
  get isPainted() {
    return !this.processor.works;
  }

  turned() {
    return this.camera.moved();
  }

  survey() {
    this.painter.show(this.frames);
    this.processor.show(this.frames);
    // what nodes show, not points between them
    if (this.frames.bears) this.largest.pressure = this.frames.bears.reduce((m, p) => Math.max(m, p), 0);
  }

  /** All places that are drawn, in a box; and the magnification. */
  measure() {
    const { nodes } = this.body;
    const { u } = this.frames;
    const m = this.magnify();
    const [low, high] = [Array(3).fill(Infinity), Array(3).fill(-Infinity)];
    const n = nodes.length;
    const take = (c, x) => {
      low[c] = Math.min(low[c], x);
      high[c] = Math.max(high[c], x);
    };
    for (let i = 0; i < n; i++) take(i % 3, nodes[i]);
    for (let i = 0; i < u.length; i++) take(i % 3, nodes[i % n] + m * u[i]);
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((c) => ((k >> c) & 1 ? high[c] : low[c])));
    this.centre = low.map((x, c) => (x + high[c]) / 2);
    this.radius = 0.5 * Math.hypot(...low.map((x, c) => high[c] - x)) || 1;
    this.fit();
  }

  /** The picture is as large as the box as it is seen now. */
  fit() {
    const axes = this.camera.axes();
    const along = (d) => this.corners.map((p) => axes[d].reduce((sum, a, c) => sum + a * (p[c] - this.centre[c]), 0));
    this.extent = [0, 1].map((d) => 2 * Math.max(...along(d)) || this.radius);
  }

  /** From a side, or the corner that it began at. */
  look(side) {
    this.camera.look(side);
    this.fit();
    this.sides.value = side;
    this.paint();
  }

  draw(time) {
    this.time = time;
    if (!this.frames) return;
    const width = this.canvas.clientWidth || 600;
    const height = Math.max(260, Math.min(440, (width * this.extent[1]) / this.extent[0] + 2 * BORDER));
    this.size(width, height);
    this.clock();
    const at = this.view(width, height);
    (this.isPainted ? this.painter : this.processor).draw(this.canvas, at);
    this.say(this.told());
    this.drawRings();
  }

  /** Numbers of the picture for what draws it. */
  view(width, height) {
    const { camera, radius, extent, quantity } = this;
    const scale = camera.zoom * Math.min((width - 2 * BORDER) / extent[0], (height - 2 * BORDER) / extent[1]);
    const axes = camera.axes();
    this.pixel = (p) => {
      const [x, y] = [0, 1].map((d) => scale * axes[d].reduce((sum, a, c) => sum + a * (p[c] - this.centre[c]), 0));
      return [width / 2 + x + camera.shift[0], height / 2 - y + camera.shift[1]];
    };
    const moment = this.moment();
    return {
      moment,
      axes,
      quantity,
      centre: this.centre,
      // places are of the size of one, whatever the units
      unit: 1 / radius,
      magnified: this.magnification,
      size: [(2 * scale * radius) / width, (2 * scale * radius) / height],
      shift: [(2 * camera.shift[0]) / width, (-2 * camera.shift[1]) / height],
      depth: 0.4,
      largest: this.largest[quantity] ?? 1,
      bears: quantity === "pressure" ? this.pressures(moment) : null,
      plain: quantity === "none" ? rgb("#7aa6c9") : BODY,
      coarse: this.isCoarse(),
    };
  }

  /** Whether a contact point faces the eye. */
  faces(i) {
    const { normal } = this.body.contact;
    const eye = this.camera.axes()[2];
    return eye.reduce((sum, a, c) => sum + a * normal[3 * i + c], 0) > 0.02;
  }

  /** Pressures of all nodes. */
  pressures([k, next, share]) {
    const { bearing } = this.body.solid;
    const { bears } = this.frames;
    if (bears) bearing.forEach((node, i) => (this.bears[node] = (1 - share) * bears[k * bearing.length + i] + share * bears[next * bearing.length + i]));
    return this.bears;
  }

  /** Whether pictures of all triangles come too late while things move: by when the browser asks for the next. */
  clock() {
    if (this.isPainted || this.slow || !this.body.solid.coarse.length) return;
    const begun = performance.now();
    requestAnimationFrame(() => {
      this.late = performance.now() - begun > SLOW ? this.late + 1 : 0;
      this.slow = this.late > 1;
    });
  }

  /** Whether fewer triangles are drawn now; all of them follow when nothing moves. */
  isCoarse() {
    clearTimeout(this.later);
    this.coarse = Boolean(this.slow) && !this.resting;
    if (this.coarse) this.later = setTimeout(() => this.whole(() => this.paint()), REST);
    return this.coarse;
  }

  /** Do this with all triangles. */
  whole(act) {
    this.resting = true;
    const done = act();
    this.resting = false;
    return done;
  }

  /** How many triangles are not drawn. */
  told() {
    const { triangles, coarse, count } = this.body.solid;
    const least = coarse.length ? coarse : triangles;
    const drawn = (this.isPainted || this.coarse ? least : triangles).length / 3;
    const why = this.isPainted ? " (no WebGL here)" : this.coarse ? " while it moves" : "";
    return drawn < count ? `, ${number(drawn)} of ${number(count)} triangles${why}` : "";
  }

  /** The view at this time in a picture of the page: as it is drawn. */
  svg() {
    this.whole(() => this.draw(this.time));
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return `<image width="${width}" height="${height}" href="${this.canvas.toDataURL("image/png")}"/>`;
  }
}
