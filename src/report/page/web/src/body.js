// The body of a page, and the panel that shows it as it moves: what both kinds of pictures, in the plane and in space,
// have in common.

import { interpolateViridis } from "d3-scale-chromatic";
import { decode, place } from "./decode.js";
import { element, number } from "./words.js";

const SHADES = Array.from({ length: 256 }, (_, i) => interpolateViridis(i / 255));
/** The colour of a share of the scale. */
export const shade = (x) => SHADES[Math.max(0, Math.min(255, Math.round(255 * x)))];

/** Largest displacement as drawn, over the length of the body; near the true size the true size is drawn. */
const DRAWN = 0.25;
const AS_IT_IS = 4;
/** How far from a contact point a click may be, in pixels. */
const REACH = 14;

/** A body, decoded once. */
export function bodyOf(raw) {
  const { solid } = raw;
  const body = {
    dim: raw.dim,
    axes: solid ? 3 : 2,
    nodes: decode(solid ? solid.nodes : raw.nodes),
    corners: decode(raw.corners),
    cells: decode(raw.cells),
    sides: decode(raw.sides),
    stress: raw.stress && { rows: decode(raw.stress.rows), nodes: decode(raw.stress.nodes), counts: decode(raw.stress.counts) },
    solid: solid && {
      ...solid,
      ...Object.fromEntries(["triangles", "coarse", "lines", "edges", "bearing"].map((name) => [name, decode(solid[name])])),
    },
    contact: {
      ...raw.contact,
      position: decode(raw.contact.position),
      gap: decode(raw.contact.gap),
      node: decode(raw.contact.node),
      place: decode(raw.contact.place),
      normal: decode(raw.contact.normal),
    },
  };
  const extent = (c) => {
    let [low, high] = [Infinity, -Infinity];
    for (let i = c; i < body.nodes.length; i += body.axes) {
      low = Math.min(low, body.nodes[i]);
      high = Math.max(high, body.nodes[i]);
    }
    return high - low;
  };
  body.length = Math.max(...Array.from({ length: body.axes }, (_, c) => extent(c))) || 1;
  return body;
}

/** Shows a body; `frames` is given by `show`. What is drawn, and how, is that of the classes below it. */
export class BodyPanel {
  /** `quantities`: values and words of what colours may say. */
  constructor(body, canvas, quantities) {
    this.body = body;
    this.canvas = canvas;
    this.quantity = quantities[0][0];
    this.factor = null;
    this.time = 0;
    this.marked = [];
    this.picker = element(
      "select",
      { "aria-label": "colour", onchange: () => this.paint((this.quantity = this.picker.value)) },
      ...quantities.map(([value, words]) => element("option", { value }, words)),
    );
    this.magnifier = element("input", {
      type: "number",
      min: 0,
      step: "any",
      "aria-label": "magnification of displacements",
      onchange: () => {
        const factor = Number(this.magnifier.value);
        // what is no magnification is left out; a thousand times the body's size shows nothing
        const most = (1e3 * DRAWN * this.body.length) / (this.largest.u || this.body.length);
        this.factor = factor > 0 && factor <= most ? factor : null;
        if (this.factor === null) this.magnifier.value = "";
        this.measure();
        this.draw(this.time);
      },
    });
    this.shown = element("span", { class: "soft" });
    const stops = [0, 0.25, 0.5, 0.75, 1].map((x) => shade(x)).join(",");
    this.most = element("span");
    this.scale = element("span", { class: "scale" }, "0", element("i", { style: `background:linear-gradient(90deg,${stops})` }), this.most);
    this.tools = element("div", { class: "bar" }, element("label", {}, "colour", this.picker), element("label", {}, "displacements ×", this.magnifier), this.scale);
    this.stage = element("div", { class: "stage" }, this.canvas);
    this.element = element("div", { class: "panel body" }, element("div", { class: "head" }, element("h2", {}, "Body"), this.shown), this.stage, this.tools);
    new ResizeObserver(() => this.draw(this.time)).observe(this.canvas);
  }

  /** Play these frames from now on. */
  show(frames) {
    this.frames = frames;
    const { axes } = this.body;
    const { u, pressure } = frames;
    this.largest = { u: 0, stress: 0, pressure: 0 };
    for (let i = 0; i < u.length; i += axes) this.largest.u = Math.max(this.largest.u, Math.hypot(u[i], u[i + 1], axes === 3 ? u[i + 2] : 0));
    for (const p of pressure) this.largest.pressure = Math.max(this.largest.pressure, p);
    this.survey();
    this.measure();
    this.draw(frames.t[0]);
  }

  /** What else there is to know of the frames. */
  survey() {}

  paint() {
    this.draw(this.time);
  }

  /** How much larger displacements are drawn. */
  magnify() {
    const { body } = this;
    const own = (DRAWN * body.length) / (this.largest.u || body.length);
    const still = this.largest.u === 0 || (own > 1 / AS_IT_IS && own < AS_IT_IS);
    this.magnification = this.factor ?? (still ? 1 : own);
    this.magnifier.placeholder = number(Number(this.magnification.toPrecision(3)));
    return this.magnification;
  }

  /** The frames around a time, and how far it is towards the second. */
  moment() {
    const [k, share] = place(this.frames.t, this.time);
    return [k, Math.min(k + 1, this.frames.t.length - 1), share];
  }

  /** The canvas has this many pixels of the page; its own are set. */
  size(width, height) {
    const density = window.devicePixelRatio || 1;
    const own = [width, height].map((x) => Math.round(x * density));
    if (this.canvas.width !== own[0] || this.canvas.height !== own[1]) {
      [this.canvas.width, this.canvas.height] = own;
      this.canvas.style.height = `${height}px`;
    }
    return density;
  }

  /** What is said beside the picture. */
  say(more = "") {
    const m = this.magnification;
    this.scale.style.visibility = this.quantity === "none" ? "hidden" : "visible";
    this.most.textContent = number(Number((this.largest[this.quantity] ?? 0).toPrecision(3)));
    this.shown.textContent = `t = ${number(this.time)}${m === 1 ? "" : `, displacements × ${number(Number(m.toPrecision(3)))}`}${more}`;
  }

  /** Where a contact point is drawn now: the node that it lies at. */
  touching(i) {
    const { contact, nodes, axes } = this.body;
    const { u } = this.frames;
    const [k, next, share] = this.moment();
    const at = axes * contact.node[i];
    const [before, after] = [k, next].map((f) => f * nodes.length + at);
    return Array.from({ length: axes }, (_, c) => nodes[at + c] + this.magnification * ((1 - share) * u[before + c] + share * u[after + c]));
  }

  /** Rings around the contact points that have curves, and clicks that choose others. */
  picks(onPick) {
    this.rings = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.rings.setAttribute("class", "rings");
    this.rings.setAttribute("aria-hidden", "true");
    this.stage.append(this.rings);
    this.canvas.addEventListener("click", (event) => {
      if (this.turned?.()) return;
      const box = this.canvas.getBoundingClientRect();
      const at = [event.clientX - box.left, event.clientY - box.top];
      let [found, least] = [null, REACH];
      for (const i of this.body.contact.fronts) {
        if (!this.faces(i)) continue;
        const [x, y] = this.pixel(this.touching(i));
        const distance = Math.hypot(x - at[0], y - at[1]);
        if (distance < least) [found, least] = [i, distance];
      }
      if (found !== null) onPick(found);
    });
  }

  /** Whether a contact point can be seen. */
  faces() {
    return true;
  }

  /** Around these contact points, by colour. */
  mark(points) {
    this.marked = points;
    this.paint();
  }

  drawRings() {
    if (!this.rings) return;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.rings.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.rings.style.height = `${height}px`;
    const few = this.marked.length < this.body.contact.fronts.length;
    const ring = ([i, colour]) => {
      const at = this.pixel(this.touching(i)).map((x) => x.toFixed(1));
      const circle = (stroke, width) => `<circle cx="${at[0]}" cy="${at[1]}" r="4.5" fill="none" stroke="${stroke}" stroke-width="${width}"/>`;
      return circle("#ffffff", 4) + circle(colour, 2);
    };
    this.rings.innerHTML = few ? this.marked.filter(([i]) => this.faces(i)).map(ring).join("") : "";
  }
}
