// A body in space as it moves: its surface coloured by pressure or displacement, turned as one likes.

import { BodyPanel } from "./body.js";
import { Camera } from "./camera.js";
import { Painter } from "./painter.js";
import { webglOf } from "./webgl.js";
import { element, number, rgb, theme } from "./words.js";

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
    super(body, canvas, [["pressure", "contact pressure"], ["u", "displacement ‖u‖"], ["none", "one colour"]]);
    this.camera = new Camera(body.solid.eye, () => this.paint());
    this.camera.on(canvas);
    const sides = element("select", { "aria-label": "seen from", onchange: () => this.camera.look(sides.value) }, element("option", { value: "" }, "a corner"), ...Camera.sides.map((s) => element("option", { value: s }, s)));
    this.tools.prepend(element("label", {}, "from", sides));
    this.bears = new Float32Array(body.nodes.length / 3);
    this.begin();
    // a graphics processor may be taken away, and come back
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.begin();
      this.painter.show(this.frames);
      this.paint();
    });
    this.late = 0;
  }

  begin() {
    const painter = webglOf(this.canvas, this.body);
    this.painter = painter ?? new Painter(this.canvas, this.body);
    this.isPainted = painter === null;
  }

  turned() {
    return this.camera.moved();
  }

  survey() {
    this.painter.show(this.frames);
  }

  /** A ball around all places, and the magnification. */
  measure() {
    const { nodes, solid } = this.body;
    const { u } = this.frames;
    const m = this.magnify();
    const [low, high] = [Array(3).fill(Infinity), Array(3).fill(-Infinity)];
    const corner = new Camera(solid.eye, () => {}).axes();
    // extents to the right and up as it is seen at first
    const seen = [[Infinity, -Infinity], [Infinity, -Infinity]];
    const take = (p) => {
      for (let c = 0; c < 3; c++) {
        low[c] = Math.min(low[c], p[c]);
        high[c] = Math.max(high[c], p[c]);
      }
      for (let d = 0; d < 2; d++) {
        const x = corner[d][0] * p[0] + corner[d][1] * p[1] + corner[d][2] * p[2];
        seen[d][0] = Math.min(seen[d][0], x);
        seen[d][1] = Math.max(seen[d][1], x);
      }
    };
    const n = nodes.length;
    for (let i = 0; i < n; i += 3) take([nodes[i], nodes[i + 1], nodes[i + 2]]);
    for (let i = 0; i < u.length; i += 3) take([0, 1, 2].map((c) => nodes[(i + c) % n] + m * u[i + c]));
    this.centre = low.map((x, c) => (x + high[c]) / 2);
    this.radius = 0.5 * Math.hypot(...low.map((x, c) => high[c] - x)) || 1;
    this.extent = seen.map(([a, b]) => b - a || this.radius);
  }

  draw(time) {
    this.time = time;
    if (!this.frames) return;
    const width = this.canvas.clientWidth || 600;
    const height = Math.max(260, Math.min(440, (width * this.extent[1]) / this.extent[0] + 2 * BORDER));
    this.size(width, height);
    this.clock();
    this.painter.draw(this.view(width, height));
    this.say(this.told());
    this.drawRings();
  }

  /** Numbers of the picture for what draws it. */
  view(width, height) {
    const { camera, radius, extent, quantity } = this;
    const scale = camera.zoom * Math.min((width - 2 * BORDER) / Math.max(extent[0], 1.2 * radius), (height - 2 * BORDER) / extent[1]);
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
      magnified: this.magnification,
      size: [(2 * scale) / width, (2 * scale) / height],
      shift: [(2 * camera.shift[0]) / width, (-2 * camera.shift[1]) / height],
      depth: 0.4 / radius,
      largest: this.largest[quantity] ?? 1,
      bears: quantity === "pressure" ? this.pressures(moment) : null,
      plain: quantity === "none" ? rgb("#7aa6c9") : BODY,
      ink: rgb(theme("--wall")),
      coarse: this.isCoarse(),
    };
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
    if (this.coarse) {
      this.later = setTimeout(() => {
        this.resting = true;
        this.paint();
        this.resting = false;
      }, REST);
    }
    return this.coarse;
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
    this.draw(this.time);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return `<image width="${width}" height="${height}" href="${this.canvas.toDataURL("image/png")}"/>`;
  }
}
