// Triangles of a body in space on a canvas, far ones first: where a browser has no WebGL.

import { shade } from "./body.js";
import { rgb } from "./words.js";

const LIGHT = [-0.25, 0.4, 1].map((x) => x / Math.hypot(0.25, 0.4, 1));

/** Draws with the same words as `WebGl`. */
export class Painter {
  constructor({ nodes, solid }) {
    Object.assign(this, { nodes, solid });
    const coarse = solid.coarse.length > 0;
    this.triangles = coarse ? solid.coarse : solid.triangles;
    this.touching = solid.touching[coarse ? 1 : 0];
    this.places = new Float32Array(nodes.length);
    this.values = new Float32Array(nodes.length / 3);
  }

  show(frames) {
    this.frames = frames;
  }

  draw(canvas, at) {
    const { triangles, places } = this;
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    this.place(at);
    const own = (k) => [triangles[3 * k], triangles[3 * k + 1], triangles[3 * k + 2]];
    // those that are turned away lie behind others
    const order = Uint32Array.from({ length: triangles.length / 3 }, (_, k) => k).filter((k) => this.normal(own(k))[2] > 0);
    const depth = new Float32Array(triangles.length / 3);
    for (const k of order) depth[k] = own(k).reduce((sum, n) => sum + places[3 * n + 2], 0);
    order.sort((a, b) => depth[a] - depth[b]);
    const [width, height] = [canvas.width, canvas.height];
    const pixel = (n) => [((places[3 * n] * at.size[0] + at.shift[0] + 1) / 2) * width, ((1 - places[3 * n + 1] * at.size[1] - at.shift[1]) / 2) * height];
    for (const k of order) {
      const corners = own(k).map(pixel);
      context.beginPath();
      corners.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
      context.fillStyle = context.strokeStyle = this.colour(own(k), k < this.touching || at.quantity !== "pressure", at);
      context.lineWidth = 0.7;
      context.fill();
      context.stroke();
    }
  }

  /** Places towards the right, up and the eye, and what is coloured. */
  place({ moment, axes, centre, unit, magnified, quantity, largest, bears }) {
    const { nodes, frames, places, values } = this;
    const [k, next, share] = moment;
    const n = nodes.length;
    for (let i = 0; i < n; i += 3) {
      const u = [0, 1, 2].map((c) => (1 - share) * frames.u[k * n + i + c] + share * frames.u[next * n + i + c]);
      const p = u.map((x, c) => unit * (nodes[i + c] - centre[c] + magnified * x));
      axes.forEach((axis, c) => (places[i + c] = axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]));
      values[i / 3] = quantity === "u" ? Math.hypot(...u) / (largest || 1) : bears ? bears[i / 3] / (largest || 1) : 0;
    }
  }

  normal(own) {
    const [a, b, c] = own.map((n) => this.places.subarray(3 * n, 3 * n + 3));
    const [p, q] = [b, c].map((x) => [x[0] - a[0], x[1] - a[1], x[2] - a[2]]);
    return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  }

  colour(own, speaks, { quantity, plain }) {
    const normal = this.normal(own);
    const bright = Math.abs(normal.reduce((sum, x, d) => sum + x * LIGHT[d], 0)) / (Math.hypot(...normal) || 1);
    const value = own.reduce((sum, n) => sum + this.values[n], 0) / 3;
    const says = speaks && (quantity === "u" || (quantity === "pressure" && value > 1e-4));
    const ambient = says ? 0.8 : 0.5;
    const light = ambient + (1 - ambient) * bright;
    return `rgb(${(says ? rgb(shade(value)) : plain).map((x) => Math.round(255 * x * light)).join(",")})`;
  }
}
