// Diagrams in SVG: a frame with axes, curves in time with a cursor, the map of the gap, multipliers in the plane.

import { axisBottom, axisLeft } from "d3-axis";
import { scaleLinear, scaleLog } from "d3-scale";
import { select } from "d3-selection";
import { place } from "./decode.js";
import { element, number, theme } from "./words.js";

const MARGIN = { left: 80, right: 24, top: 8, bottom: 34 };
/** Curves of more points are thinned out to so many. */
const MOST = 3000;

/** The extent of numbers, with a little room; logarithmic scales know no zero. */
function range(values, log = false) {
  let [low, high] = [Infinity, -Infinity];
  for (const x of values) {
    if (!Number.isFinite(x) || (log && x <= 0)) continue;
    low = Math.min(low, x);
    high = Math.max(high, x);
  }
  if (low > high) return log ? [0.1, 1] : [0, 1];
  if (log) return [low / 1.25, high * 1.25];
  const room = 0.05 * (high - low || Math.abs(high) || 1);
  return [low - room, high + room];
}

/** Marks of an axis, as one writes numbers. */
const marks = (axis, count) => axis.ticks(count).tickFormat((x) => number(Number(x.toPrecision(6))));

/** A panel with a diagram that is drawn anew when its size changes. */
export class Diagram {
  constructor({ title, height = 170, x, y, label }) {
    Object.assign(this, { height, names: { x, y } });
    this.svg = select(document.createElementNS("http://www.w3.org/2000/svg", "svg")).attr("role", "img").attr("aria-label", label ?? title).attr("class", "diagram");
    this.note = element("span", { class: "soft" });
    this.legend = element("div", { class: "legend" });
    this.heading = element("h2", {}, title);
    this.element = element("div", { class: "panel" }, element("div", { class: "head" }, this.heading, this.note), this.svg.node(), this.legend);
    new ResizeObserver(() => this.resize()).observe(this.element);
  }

  resize() {
    const width = Math.round(this.element.clientWidth - 22);
    if (width > 40 && width !== this.width) {
      this.width = width;
      this.draw();
    }
  }

  /** An empty frame over the ranges of both axes; the group for what is drawn. */
  frame(xs, ys, { log = false, marksX = 7, marksY = 5 } = {}) {
    const { width = 500, height } = this;
    this.svg.attr("viewBox", `0 0 ${width} ${height}`).attr("height", height).selectAll("*").remove();
    this.x = scaleLinear(xs, [MARGIN.left, width - MARGIN.right]);
    this.y = (log ? scaleLog : scaleLinear)(ys, [height - MARGIN.bottom, MARGIN.top]);
    const grid = marks(axisLeft(this.y).tickSize(-(width - MARGIN.left - MARGIN.right)), log ? 4 : marksY).tickFormat("");
    this.svg.append("g").attr("class", "grid").attr("transform", `translate(${MARGIN.left},0)`).call(grid);
    const group = this.svg.append("g");
    this.svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height - MARGIN.bottom})`).call(marks(axisBottom(this.x), marksX));
    this.svg.append("g").attr("class", "axis").attr("transform", `translate(${MARGIN.left},0)`).call(log ? axisLeft(this.y).ticks(4, "~g") : marks(axisLeft(this.y), marksY));
    this.svg.append("text").attr("class", "label").attr("x", (MARGIN.left + width - MARGIN.right) / 2).attr("y", height - 4).attr("text-anchor", "middle").text(this.names.x);
    this.svg.append("text").attr("class", "label").attr("transform", `translate(11,${(height - MARGIN.bottom) / 2 + MARGIN.top / 2}) rotate(-90)`).attr("text-anchor", "middle").text(this.names.y);
    return group;
  }
}

/** A diagram over time whose cursor is moved by the player, and moves it. */
class OverTime extends Diagram {
  constructor(options, onSeek) {
    super(options);
    this.seeking = false;
    const seek = (event) => {
      const box = this.svg.node().getBoundingClientRect();
      const t = this.x.invert(((event.clientX - box.left) * this.width) / box.width);
      onSeek(Math.max(this.span[0], Math.min(this.span[1], t)));
    };
    const node = this.svg.node();
    node.addEventListener("pointerdown", (event) => {
      node.setPointerCapture(event.pointerId);
      this.seeking = true;
      seek(event);
    });
    node.addEventListener("pointermove", (event) => this.seeking && seek(event));
    node.addEventListener("pointerup", () => (this.seeking = false));
  }

  cursorOn(group) {
    this.cursor = group.append("line").attr("class", "cursor").attr("y1", MARGIN.top).attr("y2", this.height - MARGIN.bottom);
    this.at(this.time ?? this.span[0]);
  }

  at(t) {
    this.time = t;
    if (this.cursor) this.cursor.attr("x1", this.x(t)).attr("x2", this.x(t));
  }
}

/** Curves in time. */
export class Curves extends OverTime {
  /** `series`: names, colours and values `y(k)`; `bands`: grey stretches of time; `limits`: dashed lines. */
  show({ t, series, bands = [], limits = [] }) {
    Object.assign(this, { t, series, bands, limits, span: [t[0], t[t.length - 1]] });
    this.legend.replaceChildren(
      ...(series.length > 1 ? series : []).map((s) => element("span", {}, element("span", { class: "swatch", style: `background:${s.colour}` }), s.name)),
    );
    this.draw();
  }

  draw() {
    if (!this.t || !this.width) return;
    const { t, series } = this;
    const step = Math.max(1, Math.ceil(t.length / MOST));
    const all = function* () {
      for (const s of series) for (let k = 0; k < t.length; k += step) yield s.y(k);
    };
    const group = this.frame(this.span, range([...all(), ...this.limits]));
    for (const [a, b] of this.bands) group.append("rect").attr("class", "band").attr("x", this.x(a)).attr("width", Math.max(0.5, this.x(b) - this.x(a))).attr("y", MARGIN.top).attr("height", this.height - MARGIN.top - MARGIN.bottom);
    for (const y of this.limits) group.append("line").attr("class", "limit").attr("x1", MARGIN.left).attr("x2", this.width - MARGIN.right).attr("y1", this.y(y)).attr("y2", this.y(y));
    for (const s of series) {
      let d = "";
      let pen = false;
      for (let k = 0; k < t.length; k += step) {
        const y = s.y(k);
        if (!Number.isFinite(y)) {
          pen = false;
          continue;
        }
        d += `${pen ? "L" : "M"}${this.x(t[k]).toFixed(1)},${this.y(y).toFixed(1)}`;
        pen = true;
      }
      group.append("path").attr("class", "curve").attr("stroke", s.colour).attr("d", d);
    }
    this.cursorOn(group);
  }

  at(t) {
    super.at(t);
    if (!this.t || this.series.length !== 1) return;
    const [k] = place(this.t, t);
    this.note.textContent = number(this.series[0].y(k));
  }
}

/** Times over the contact edge: blue the gap that is left, orange the pressure. */
export class GapMap extends OverTime {
  show({ t, position, rows, gap, contact, pressure, bound }) {
    Object.assign(this, { t, position, rows, gap, contact, pressure, bound, span: [t[0], t[t.length - 1]] });
    this.image = this.paint();
    this.draw();
  }

  /** The map as a picture: a column a time, a row a contact point. */
  paint() {
    const { t, rows, gap, contact, pressure } = this;
    const n = gap.length;
    const columns = Math.min(900, Math.max(200, t.length));
    const canvas = element("canvas", { width: columns, height: rows.length });
    const context = canvas.getContext("2d");
    const image = context.createImageData(columns, rows.length);
    let [widest, highest] = [1e-300, 1e-300];
    for (let k = 0; k < t.length; k++)
      for (const i of rows) {
        widest = Math.max(widest, gap[i] - contact[k * n + i]);
        highest = Math.max(highest, pressure[k * n + i]);
      }
    const [gapText, pressureText] = [widest, highest].map((x) => number(Number(x.toPrecision(3))));
    this.legend.replaceChildren(
      element("span", {}, element("span", { class: "swatch", style: "background:#4a78a8" }), `gap (dark: up to ${gapText})`),
      element("span", {}, element("span", { class: "swatch", style: "background:#c2410c" }), `contact (dark: pressure up to ${highest > 1e-299 ? pressureText : 0})`),
    );
    for (let c = 0; c < columns; c++) {
      const [k] = place(t, this.span[0] + ((this.span[1] - this.span[0]) * (c + 0.5)) / columns);
      rows.forEach((i, r) => {
        const p = pressure[k * n + i] / highest;
        const g = (gap[i] - contact[k * n + i]) / widest;
        const mix = (from, to, x) => from.map((a, j) => a + (to[j] - a) * Math.max(0, Math.min(1, x)));
        const [red, green, blue] = p > 0 ? mix([253, 208, 162], [166, 54, 3], p) : mix([240, 246, 252], [30, 74, 120], Math.sqrt(Math.max(0, g)));
        image.data.set([red, green, blue, 255], 4 * ((rows.length - 1 - r) * columns + c));
      });
    }
    context.putImageData(image, 0, 0);
    return canvas.toDataURL("image/png");
  }

  draw() {
    if (!this.t || !this.width) return;
    const group = this.frame(this.span, this.bound);
    const [top, low] = [this.y(this.bound[1]), this.y(this.bound[0])];
    group.append("image").attr("href", this.image).attr("x", MARGIN.left).attr("y", top).attr("width", this.width - MARGIN.left - MARGIN.right).attr("height", low - top).attr("preserveAspectRatio", "none").attr("style", "image-rendering: pixelated");
    this.cursorOn(group);
  }
}

/** Floquet multipliers in the complex plane. */
export class Multipliers extends Diagram {
  show(multipliers, whose = "") {
    this.multipliers = multipliers;
    const largest = Math.max(0, ...multipliers.map(([re, im]) => Math.hypot(re, im)));
    this.note.textContent = multipliers.length ? `${multipliers.length}, the largest of size ${number(largest)}${whose}` : "not computed";
    this.draw();
  }

  draw() {
    if (!this.multipliers || !this.width) return;
    const re = [-1.1, 1.1, ...this.multipliers.map((m) => 1.05 * m[0])];
    const im = [-1.1, 1.1, ...this.multipliers.map((m) => 1.05 * m[1])];
    const inner = [this.width - MARGIN.left - MARGIN.right, this.height - MARGIN.top - MARGIN.bottom];
    const [xs, ys] = [range(re), range(im)];
    // one scale for both axes
    const unit = Math.max((xs[1] - xs[0]) / inner[0], (ys[1] - ys[0]) / inner[1]);
    const widen = ([a, b], size) => [(a + b - unit * size) / 2, (a + b + unit * size) / 2];
    const group = this.frame(widen(xs, inner[0]), widen(ys, inner[1]));
    group.append("circle").attr("class", "circle").attr("cx", this.x(0)).attr("cy", this.y(0)).attr("r", 1 / unit);
    for (const [x, y] of this.multipliers) group.append("circle").attr("cx", this.x(x)).attr("cy", this.y(y)).attr("r", 3.2).attr("fill", "none").attr("stroke", theme("--force")).attr("stroke-width", 1.4);
  }
}

export { MARGIN, range };
