// A motion with everything that is linked to its cursor: the body, curves of the contact, the map of the gap, energies.

import { interpolateViridis } from "d3-scale-chromatic";
import { Curves, GapMap } from "./chart.js";
import { decode } from "./decode.js";
import { PlaneView } from "./plane.js";
import { Player } from "./player.js";
import { SolidView } from "./solid.js";
import { COLOURS, element } from "./words.js";

const FORCES = { contact: "Forces of contact", support: "Forces of supports", spring: "Forces of springs" };

/** Stretches of time in which something touches. */
export function bandsOf({ t, active }) {
  const n = active.length / t.length;
  const bands = [];
  let from = null;
  for (let k = 0; k < t.length; k++) {
    let touches = false;
    for (let i = 0; i < n; i++) touches ||= active[k * n + i] === 1;
    if (touches && from === null) from = t[k];
    if (from !== null && (!touches || k === t.length - 1)) {
      bands.push([from, t[k]]);
      from = null;
    }
  }
  return bands;
}

/** Views of a body's motions, one at a time. */
export class MotionView {
  constructor(body, { loops = false, compact = false, rubs = false, forces = [] } = {}) {
    this.body = body;
    this.player = new Player((t) => this.linked.forEach((view) => view.at(t)), loops);
    const seek = (t) => this.player.seek(t);
    const { contact } = body;
    this.view = body.dim === 3 ? new SolidView(body) : body.dim > 0 ? new PlaneView(body) : null;
    const height = compact ? 150 : 170;
    this.displacement = new Curves({ title: "", x: "t", y: "u_C", label: "displacement of contact points", height }, seek);
    this.pressure = new Curves({ title: "", x: "t", y: "p", label: "pressure of contact points", height }, seek);
    this.traction = rubs ? new Curves({ title: "", x: "t", y: "τ", label: "traction of contact points", height }, seek) : null;
    // none: those that the page was written with
    this.chosen = [];
    this.chooser = element("input", { type: "text", "aria-label": "contact nodes that have curves", onchange: () => this.choose(this.named(this.chooser.value)) });
    this.unknown = element("span", { class: "soft", "aria-live": "polite" });
    if (contact.fronts.length > 1) {
      const where = this.view ? "numbers, or click the body" : "numbers";
      this.displacement.element.append(element("div", { class: "bar" }, element("label", {}, "curves of nodes", this.chooser), element("span", { class: "soft" }, where), this.unknown));
      this.view?.picks((i) => this.choose(this.chosen.includes(i) ? this.chosen.filter((j) => j !== i) : [...this.chosen, i]));
    }
    this.map = contact.fronts.length > 1 ? new GapMap({ title: "Gap and pressure along the contact edge", x: "t", y: contact.axis, height: 190 }, seek) : null;
    this.ledger = compact ? null : new Curves({ title: "Energies", x: "t", y: "energy" }, seek);
    this.forces = forces.map(({ kind }) => new Curves({ title: FORCES[kind] ?? kind, x: "t", y: "force", height }, seek));
    const curves = [this.displacement, this.pressure, this.traction, this.map, ...this.forces, this.ledger].filter(Boolean);
    this.linked = [...curves];
    if (this.view) this.linked.push({ at: (t) => this.view.draw(t) });
    const charts = curves.map((c) => c.element);
    this.left = element("div", { class: "column" }, this.view?.element ?? element("p", { class: "soft" }, "A body of matrices has no shape to show."), this.player.element);
    this.right = element("div", { class: "column" }, ...charts);
  }

  show(frames, ledger, forces = []) {
    const { contact } = this.body;
    const { t } = frames;
    this.player.span = [t[0], t[t.length - 1]];
    this.view?.show(frames);
    const { fronts } = contact;
    const bands = bandsOf(frames);
    Object.assign(this, { frames, bands });
    this.curves();
    const s = fronts.map((i) => contact.position[i]);
    this.map?.show({ t, rows: fronts, gap: contact.gap, contact: frames.contact, pressure: frames.pressure, bound: [Math.min(...s), Math.max(...s)] });
    if (this.ledger && ledger) this.energies(ledger, bands);
    forces.forEach(({ curves }, k) => this.bear(this.forces[k], decode(ledger.t), curves, bands));
    this.player.seek(t[0]);
  }

  /** Contact points by the names of a text: `36`, or `wall:36` where a node meets several obstacles. */
  named(text) {
    const { fronts, names } = this.body.contact;
    // names of groups may have spaces
    const between = names.some((name) => name.includes(" ")) ? /[,;]+/ : /[\s,;]+/;
    const wanted = text.split(between).map((word) => word.trim()).filter(Boolean);
    const is = (i, word) => names[i] === word || names[i].split(":").includes(word);
    const missing = wanted.filter((word) => !fronts.some((i) => is(i, word)));
    this.unknown.textContent = missing.length ? `no contact node ${missing.join(", ")}` : "";
    return fronts.filter((i) => wanted.some((word) => is(i, word)));
  }

  /** Curves of these contact points from now on. */
  choose(points) {
    this.chosen = points;
    this.chooser.value = points.map((i) => this.body.contact.names[i]).join(", ");
    this.curves();
  }

  /** Displacements, pressures and tractions of the contact points that are chosen. */
  curves() {
    const { frames, bands } = this;
    const { contact } = this.body;
    const { fronts } = contact;
    const { t } = frames;
    const n = contact.gap.length;
    const some = this.chosen.length ? this.chosen : frames.shown;
    const point = fronts.length === 1 ? "of the contact point" : some.length < fronts.length ? `of ${some.length} of ${fronts.length} contact points` : "of contact points";
    this.displacement.heading.textContent = `Displacement ${point} towards ${contact.meets.some(Boolean) ? "what it meets" : "the obstacle"}`;
    this.pressure.heading.textContent = `Pressure ${point}`;
    if (this.traction) this.traction.heading.textContent = `Traction along the tangent ${point}`;
    this.chooser.placeholder = frames.shown.map((i) => contact.names[i]).join(", ");
    const shared = (i) => (contact.behind[i] === null ? [i] : [i, contact.behind[i]]);
    const colour = (i, points) => (points.length <= 4 ? COLOURS[points.indexOf(i)] : interpolateViridis(0.3 + (0.65 * points.indexOf(i)) / (points.length - 1)));
    const series = (values, points) => points.map((i) => ({ name: `node ${contact.names[i]}`, colour: colour(i, points), y: (row) => values[row * n + i] }));
    const gaps = new Set(contact.gap.map((g, i) => (fronts.includes(i) ? g : -g)));
    this.displacement.show({ t, series: series(frames.contact, some), bands, limits: gaps.size <= 2 ? [...gaps] : [] });
    this.pressure.show({ t, series: series(frames.pressure, some.flatMap(shared)), bands });
    if (frames.traction) this.traction?.show({ t, series: series(frames.traction, some), bands });
    this.view?.mark(some.map((i) => [i, colour(i, some)]));
  }

  /** What groups, supports or springs bear. */
  bear(chart, t, curves, bands) {
    const series = curves.map(({ name, y }, k) => {
      const values = decode(y);
      return { name, colour: COLOURS[k % COLOURS.length], y: (row) => values[row] };
    });
    chart.show({ t, series, bands });
  }

  energies(raw, bands) {
    const e = Object.fromEntries(Object.entries(raw).map(([name, block]) => [name, decode(block)]));
    const curve = (name, k) => ({ name, colour: COLOURS[k], y: (row) => e[name][row] });
    const moves = (name) => e[name]?.some((x) => x !== 0);
    const series = [curve("kinetic", 0), curve("elastic", 1), { name: "kinetic + elastic", colour: COLOURS[4], y: (row) => e.kinetic[row] + e.elastic[row] }];
    if (moves("external")) series.push(curve("external", 2));
    if (moves("dissipated")) series.push(curve("dissipated", 3));
    if (moves("friction")) series.push({ ...curve("friction", 6), name: "taken by friction" });
    if (moves("belt")) series.push({ ...curve("belt", 7), name: "work of moving surfaces" });
    if (moves("jumps")) series.push({ ...curve("jumps", 5), name: "sum of the jumps at switches" });
    this.ledger.show({ t: e.t, series, bands });
  }
}
