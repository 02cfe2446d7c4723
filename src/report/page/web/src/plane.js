// A body in the plane as it moves: cells coloured by a quantity, its outline at rest, obstacles, pressures.

import { BodyPanel, shade } from "./body.js";
import { element, theme } from "./words.js";

/** Thickness of a bar, and the longest pressure, over the length of the body. */
const THICKNESS = 0.1;
const LONGEST = 0.13;

/** Draws on a canvas. */
class OnCanvas {
  constructor(context) {
    this.context = context;
  }
  path(points, closed) {
    const c = this.context;
    c.beginPath();
    points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
    if (closed) c.closePath();
  }
  polygon(points, fill) {
    this.path(points, true);
    this.context.fillStyle = fill;
    this.context.fill();
    // no seams between cells
    this.context.strokeStyle = fill;
    this.context.lineWidth = 0.6;
    this.context.stroke();
  }
  line(points, stroke, width) {
    this.path(points, false);
    this.context.strokeStyle = stroke;
    this.context.lineWidth = width;
    this.context.stroke();
  }
  text(x, y, words, fill) {
    this.context.fillStyle = fill;
    this.context.font = '12px system-ui, "DejaVu Sans", sans-serif';
    this.context.fillText(words, x, y);
  }
}

/** Writes the same as SVG. */
class AsSvg {
  constructor() {
    this.parts = [];
  }
  list(points) {
    return points.map(([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`).join(" ");
  }
  polygon(points, fill) {
    this.parts.push(`<polygon points="${this.list(points)}" fill="${fill}" stroke="${fill}" stroke-width="0.6"/>`);
  }
  line(points, stroke, width) {
    this.parts.push(`<polyline points="${this.list(points)}" fill="none" stroke="${stroke}" stroke-width="${width}"/>`);
  }
  text(x, y, words, fill) {
    this.parts.push(`<text x="${x}" y="${y}" fill="${fill}" font-size="12" font-family="sans-serif">${words}</text>`);
  }
}

/** Shows a body in the plane, or a bar. */
export class PlaneView extends BodyPanel {
  constructor(body) {
    const stress = body.dim === 1 ? "stress" : "von Mises stress";
    const quantities = [["u", "displacement ‖u‖"], ...(body.stress ? [["stress", stress]] : []), ["none", "one colour"]];
    super(body, element("canvas", { role: "img", "aria-label": "the deformed body" }), quantities);
    this.u = new Float32Array(body.nodes.length);
  }

  survey() {
    const { u, t } = this.frames;
    if (!this.body.stress) return;
    for (let f = 0; f < t.length; f += Math.ceil(t.length / 40)) {
      this.u.set(u.subarray(f * this.u.length, (f + 1) * this.u.length));
      for (const s of this.stresses()) this.largest.stress = Math.max(this.largest.stress, Math.abs(s));
    }
  }

  /** The part of the plane that is shown, and the magnification. */
  measure() {
    const { body, frames } = this;
    const m = this.magnify();
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const take = (x, y) => {
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], y);
    };
    const n = body.nodes.length;
    for (let i = 0; i < n; i += 2) take(body.nodes[i], body.nodes[i + 1]);
    for (let i = 0; i < frames.u.length; i += 2) take(body.nodes[i % n] + m * frames.u[i], body.nodes[(i + 1) % n] + m * frames.u[i + 1]);
    const room = this.largest.pressure > 0 ? LONGEST * body.length : 0;
    body.contact.gap.forEach((_, i) => {
      const [x, y] = this.wall(i);
      take(x + room * body.contact.normal[2 * i], y + room * body.contact.normal[2 * i + 1]);
    });
    if (body.dim === 1) {
      take(box[0], box[1] - THICKNESS * body.length);
      take(box[2], box[3] + THICKNESS * body.length);
    }
    this.box = box;
  }

  /** The obstacle before a contact point. */
  wall(i) {
    const { place: x, normal, gap } = this.body.contact;
    const m = this.magnification;
    return [x[2 * i] + m * gap[i] * normal[2 * i], x[2 * i + 1] + m * gap[i] * normal[2 * i + 1]];
  }

  /** Stress of each cell at its centre: von Mises, of a bar along it. */
  stresses() {
    const { stress, dim } = this.body;
    const own = [];
    let row = 0;
    let at = 0;
    for (let k = 0; k < stress.counts.length; k++) {
      const s = [0, 0, 0, 0];
      for (let j = 0; j < stress.counts[k]; j++) {
        const node = stress.nodes[at++];
        for (let c = 0; c < dim; c++, row += 4) {
          const u = this.u[2 * node + c];
          for (let d = 0; d < 4; d++) s[d] += stress.rows[row + d] * u;
        }
      }
      const [x, y, z, xy] = s;
      own.push(dim === 1 ? x : Math.sqrt(0.5 * ((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) + 3 * xy * xy));
    }
    return own;
  }

  draw(time) {
    this.time = time;
    if (!this.frames) return;
    const width = this.canvas.clientWidth || 600;
    const [a, b, c, d] = this.box;
    const height = Math.max(120, Math.min(440, (width * (d - b)) / (c - a || 1) + 24));
    const density = this.size(width, height);
    const context = this.canvas.getContext("2d");
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, width, height);
    this.with(new OnCanvas(context), width, height);
    this.say();
    this.drawRings();
  }

  /** The view at this time as SVG. */
  svg() {
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    const painter = new AsSvg();
    this.with(painter, width, height);
    return painter.parts.join("\n");
  }

  with(painter, width, height) {
    const { body, frames, magnification: m } = this;
    const [k, next, share] = this.moment();
    const n = body.nodes.length;
    for (let i = 0; i < n; i++) this.u[i] = (1 - share) * frames.u[k * n + i] + share * frames.u[next * n + i];
    const [a, b, c, d] = this.box;
    const border = 10;
    const scale = Math.min((width - 2 * border) / (c - a || 1), (height - 2 * border) / (d - b || 1));
    const left = (width - scale * (c - a)) / 2;
    const below = (height - scale * (d - b)) / 2;
    const pixel = (x, y) => [left + scale * (x - a), height - below - scale * (y - b)];
    this.pixel = ([x, y]) => pixel(x, y);
    const moved = (i) => pixel(body.nodes[2 * i] + m * this.u[2 * i], body.nodes[2 * i + 1] + m * this.u[2 * i + 1]);
    this.cells(painter, moved, scale);
    for (let i = 0; i < body.sides.length; i += 2) {
      const ends = [body.sides[i], body.sides[i + 1]].map((s) => pixel(body.nodes[2 * s], body.nodes[2 * s + 1]));
      if (body.dim === 2) painter.line(ends, theme("--soft"), 0.7);
    }
    this.obstacles(painter, pixel);
    this.forces(painter, pixel, [k, next, share]);
  }

  cells(painter, moved, scale) {
    const { body } = this;
    const size = (i) => Math.hypot(this.u[2 * i], this.u[2 * i + 1]);
    const stresses = this.quantity === "stress" ? this.stresses() : null;
    let at = 0;
    for (let k = 0; k < body.corners.length; k++) {
      const own = body.cells.subarray(at, at + body.corners[k]);
      at += body.corners[k];
      let value = 0;
      if (stresses) value = Math.abs(stresses[k]) / (this.largest.stress || 1);
      else if (this.quantity === "u") value = own.reduce((sum, i) => sum + size(i), 0) / own.length / (this.largest.u || 1);
      const fill = this.quantity === "none" ? "#7aa6c9" : shade(value);
      let outline = Array.from(own, moved);
      if (body.dim === 1) {
        const half = (THICKNESS / 2) * body.length * scale;
        const [p, q] = outline;
        outline = [[p[0], p[1] - half], [q[0], q[1] - half], [q[0], q[1] + half], [p[0], p[1] + half]];
      }
      painter.polygon(outline, fill);
    }
  }

  obstacles(painter, pixel) {
    const { contact, length, dim } = this.body;
    const ink = theme("--wall");
    contact.parts.forEach((part, p) => {
      // where two surfaces meet there is no wall
      if (contact.meets[p]) return;
      let places = part.map((i) => this.wall(i));
      const normals = part.map((i) => [contact.normal[2 * i], contact.normal[2 * i + 1]]);
      if (contact.closed[p]) {
        places.push(places[0]);
        normals.push(normals[0]);
      }
      if (places.length === 1) {
        // a line across the normal stands for the obstacle of a point
        const [[x, y]] = places;
        const [nx, ny] = normals[0];
        const half = (dim === 1 ? 0.9 * THICKNESS : 0.06) * length;
        places = [[x - half * ny, y + half * nx], [x + half * ny, y - half * nx]];
        normals.push(normals[0]);
      }
      painter.line(places.map(([x, y]) => pixel(x, y)), ink, 2);
      for (let k = 0; k + 1 < places.length; k++) {
        const [p, q] = [pixel(...places[k]), pixel(...places[k + 1])];
        const strokes = Math.max(1, Math.ceil(Math.hypot(q[0] - p[0], q[1] - p[1]) / 8));
        const [nx, ny] = normals[k];
        for (let s = 0; s < strokes; s++) {
          const x = p[0] + ((q[0] - p[0]) * s) / strokes;
          const y = p[1] + ((q[1] - p[1]) * s) / strokes;
          painter.line([[x, y], [x + 7 * (0.77 * nx + 0.64 * ny), y - 7 * (0.77 * ny - 0.64 * nx)]], ink, 0.8);
        }
      }
    });
  }

  forces(painter, pixel, [k, next, share]) {
    const { contact, length } = this.body;
    if (!(this.largest.pressure > 0)) return;
    const n = contact.gap.length;
    for (let i = 0; i < n; i++) {
      const p = (1 - share) * this.frames.pressure[k * n + i] + share * this.frames.pressure[next * n + i];
      if (!(p > 0)) continue;
      const [x, y] = this.wall(i);
      const size = (LONGEST * length * p) / this.largest.pressure;
      painter.line([pixel(x, y), pixel(x + size * contact.normal[2 * i], y + size * contact.normal[2 * i + 1])], theme("--force"), 3);
    }
  }
}
