// Families of orbits: a diagram over the frequency, whose points play.

import { bodyOf } from "./body.js";
import { Diagram, MARGIN, Multipliers, range } from "./chart.js";
import { framesOf } from "./decode.js";
import { MotionView } from "./motion.js";
import { ofOrbit, stability } from "./run.js";
import { COLOURS, element, number, numbers } from "./words.js";

/** How far from a point the pointer may be. */
const REACH = 14;

/** Points of all families over the frequency. */
class Spectrum extends Diagram {
  constructor(families, onChoose) {
    super({ title: "Families", height: 380, x: "circular frequency ω", y: "energy", label: "energy of orbits against their frequency; arrow keys choose a point" });
    Object.assign(this, { families, onChoose, axis: "energy", log: true, chosen: null });
    this.tip = element("div", { class: "tip", hidden: true });
    this.element.append(this.tip);
    // one orbit after the other, as a slider goes
    this.svg.attr("tabindex", 0).attr("role", "slider").attr("aria-valuemin", 0);
    this.svg.on("pointermove", (event) => this.say(this.nearest(event), event)).on("pointerleave", () => (this.tip.hidden = true));
    this.svg.on("click", (event) => {
      const p = this.nearest(event);
      if (p) this.choose(p);
    });
    this.axisPicker = element("select", { "aria-label": "what is shown over the frequency", onchange: () => this.set({ axis: this.axisPicker.value }) }, element("option", { value: "energy" }, "energy"), element("option", { value: "amplitude" }, "amplitude"));
    this.scalePicker = element("select", { "aria-label": "scale", onchange: () => this.set({ log: this.scalePicker.value === "log" }) }, element("option", { value: "log" }, "logarithmic"), element("option", { value: "linear" }, "linear"));
    this.element.append(element("div", { class: "bar" }, element("label", {}, "over the frequency", this.axisPicker), this.scalePicker));
    this.branches = families.flatMap((f, k) => f.branches.map((name, b) => ({ family: k, branch: b, shown: true, name: families.length > 1 ? `${f.name}: ${name}` : name })));
    this.branches.forEach((b, k) => (b.colour = COLOURS[k % COLOURS.length]));
    this.legend.append(
      ...this.branches.map((b) =>
        element("button", { type: "button", "aria-pressed": "true", title: "show or hide", onclick: (event) => this.hide(b, event.currentTarget) }, element("span", { class: "swatch", style: `background:${b.colour}` }), b.name),
      ),
      element("span", {}, `filled: stable · hollow: unstable · pale: not known · crosses on the axis: no orbit${families.some((f) => f.why) ? " · small: does not play" : ""}`),
    );
    this.points = families.flatMap((f, k) => f.points.map((p, i) => ({ ...p, family: k, number: i, of: this.branches.find((b) => b.family === k && b.branch === p.branch) ?? this.branches[0] })));
  }

  set(options) {
    Object.assign(this, options);
    this.names.y = this.axis;
    this.draw();
  }

  hide(branch, button) {
    branch.shown = !branch.shown;
    button.setAttribute("aria-pressed", branch.shown);
    this.draw();
  }

  /** Energy or amplitude of a point. */
  value(p) {
    return p.orbit?.[this.axis] ?? null;
  }

  /** Where a point is drawn: one without an orbit on the axis. */
  at(p) {
    const y = this.value(p);
    return [this.x(p.omega), y === null ? this.height - MARGIN.bottom - 5 : this.y(y)];
  }

  visible() {
    return this.points.filter((p) => p.of?.shown && this.value(p) !== null && (!this.log || this.value(p) > 0));
  }

  draw() {
    if (!this.width) return;
    const shown = this.visible();
    const group = this.frame(range(this.points.map((p) => p.omega)), range(shown.map((p) => this.value(p)), this.log), { log: this.log, marksX: 8 });
    const crosses = this.points.filter((p) => p.of?.shown && this.value(p) === null);
    this.drawn = [...crosses, ...shown];
    for (const p of crosses) {
      const [x, y] = this.at(p);
      group.append("path").attr("d", `M${x - 2.5},${y - 2.5}l5,5m0,-5l-5,5`).attr("stroke", p.of.colour).attr("fill", "none");
    }
    for (const b of this.branches) {
      if (!b.shown || this.families[b.family].sequential) continue;
      const own = shown.filter((p) => p.of === b).sort((p, q) => p.index - q.index);
      const d = own.map((p, k) => `${k ? "L" : "M"}${this.x(p.omega).toFixed(1)},${this.y(this.value(p)).toFixed(1)}`).join("");
      group.append("path").attr("class", "curve").attr("stroke", b.colour).attr("stroke-opacity", 0.5).attr("d", d);
    }
    for (const p of shown) {
      const hollow = p.orbit.stable === false;
      const mark = group.append("circle").attr("class", "point").attr("cx", this.x(p.omega)).attr("cy", this.y(this.value(p))).attr("r", p.frames || !this.families[p.family].why ? 4 : 2.5).attr("fill", hollow ? "var(--panel)" : p.of.colour).attr("stroke", p.of.colour).attr("stroke-width", 1.3).attr("fill-opacity", p.orbit.stable === null ? 0.35 : 1);
      mark.attr("data-point", `${p.family}:${p.number}`);
    }
    this.ring = group.append("circle").attr("class", "chosen").attr("r", 8).attr("visibility", "hidden");
    this.mark();
  }

  /** The point under the pointer: points lie one over another. */
  nearest(event) {
    const box = this.svg.node().getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) * this.width) / box.width, ((event.clientY - box.top) * this.height) / box.height];
    let [found, least] = [null, REACH];
    for (const p of this.drawn ?? []) {
      const [px, py] = this.at(p);
      const distance = Math.hypot(px - x, py - y);
      // of points at one place that which lies on top
      if (distance <= least) [found, least] = [p, distance];
    }
    return found;
  }

  say(p, event) {
    this.tip.hidden = !p;
    if (!p) return;
    const lines = [p.of.name, `ω = ${number(p.omega)}`];
    if (p.orbit) lines.push(`energy ${number(p.orbit.energy)}, amplitude ${number(p.orbit.amplitude)}`, ...(p.orbit.alpha === null ? [stability(p.orbit)] : []), `${p.orbit.switches} switches, residual ${number(p.orbit.residual)}`);
    if (p.orbit && p.orbit.alpha !== null) lines.push(`α = ${number(p.orbit.alpha)}`);
    if (p.hbm) lines.push(`series of ${p.hbm.harmonics} harmonics: energy ${number(p.hbm.energy)}, ${p.hbm.verdict}${p.hbm.moved === null ? "" : `, ${number(p.hbm.moved)} away`}`);
    if (p.special) lines.push(p.special);
    lines.push(p.frames ? "click: play" : "no motion stored");
    this.tip.textContent = lines.join("\n");
    this.tip.style.left = `${Math.min(event.clientX + 14, window.innerWidth - 300)}px`;
    this.tip.style.top = `${event.clientY + 14}px`;
  }

  choose(p, plays = true) {
    this.chosen = p;
    this.mark();
    const all = this.visible();
    this.svg.attr("aria-valuemax", Math.max(0, all.length - 1)).attr("aria-valuenow", Math.max(0, all.indexOf(p)));
    this.svg.attr("aria-valuetext", `${p.of?.name ?? ""}, ω = ${number(p.omega)}${p.orbit ? `, energy ${number(p.orbit.energy)}` : ""}`);
    this.onChoose(p, plays);
  }

  mark() {
    const p = this.chosen;
    const there = p && p.of?.shown;
    this.ring?.attr("visibility", there ? "visible" : "hidden");
    if (there && this.ring) this.ring.attr("cx", this.at(p)[0]).attr("cy", this.at(p)[1]);
  }

  /** The orbit of the largest amplitude that plays, without playing it. */
  begin() {
    const all = this.visible();
    const size = (p) => (p.frames ? (p.orbit.amplitude ?? 0) : -1);
    if (all.length) this.choose(all.reduce((best, p) => (size(p) > size(best) ? p : best)), false);
  }

  /** The next or the last orbit, in the order of its family. */
  move(sign, plays = true) {
    const all = this.visible();
    if (!all.length) return;
    const k = all.indexOf(this.chosen);
    this.choose(all[k < 0 ? 0 : (k + sign + all.length) % all.length], plays);
  }
}

export function familySection(families) {
  const spectrum = new Spectrum(families, (p, plays) => play(p, plays));
  const slots = new Map();
  const words = element("div", { class: "panel", "aria-live": "polite" }, element("h2", {}, "Orbit"), element("p", { class: "soft" }, "Click a point to play its orbit."));
  const multipliers = new Multipliers({ title: "Floquet multipliers", x: "Re", y: "Im", height: 230 });
  const left = element("div", { class: "column" }, spectrum.element, words, multipliers.element);
  const right = element("div", { class: "column" });
  const said = families.map((f) => element("p", { class: "soft" }, `${f.name}: ${f.title} – ${f.what}; ${f.status}; ${f.points.filter((p) => p.orbit).length} orbits at ${f.points.length} points${f.why ? `; ${f.why}` : ""}`));
  const section = element("section", { "aria-label": "families" }, element("div", { class: "columns" }, left, right), ...said);
  const page = { section, spectrum, bodies: [], player: null };

  function play(p, plays) {
    const family = families[p.family];
    words.replaceChildren(element("h2", {}, `${p.of.name}, ω = ${number(p.omega)}`), p.orbit ? numbers(ofOrbit(p.orbit, p.omega)) : element("p", {}, p.special ?? "no orbit"));
    if (p.orbit && p.special) words.append(element("p", { class: "soft" }, `special point: ${p.special}`));
    if (p.hbm) words.append(element("p", { class: "soft" }, `from a series of ${p.hbm.harmonics} harmonics: ${p.hbm.verdict}`));
    multipliers.show(p.orbit?.multipliers ?? [], p.orbit?.alpha === null ? "" : " (of the self-excited system)");
    if (!p.frames) {
      words.append(element("p", { class: "soft" }, family.why ? `Its motion is not on this page: ${family.why}.` : "Its motion is not on this page."));
      page.player?.toggle(false);
      right.replaceChildren();
      Object.assign(page, { motion: null, player: null, bodies: [] });
      return;
    }
    if (!slots.has(p.family)) slots.set(p.family, new MotionView(bodyOf(family.body), { loops: true, compact: true, rubs: p.frames.traction !== null }));
    const motion = slots.get(p.family);
    page.player?.toggle(false);
    if (right.firstChild !== motion.left) right.replaceChildren(motion.left, ...motion.right.children, ...(motion.charts ?? []));
    motion.charts ??= [...right.children].slice(1);
    Object.assign(page, { motion, player: motion.player });
    page.bodies = [motion.view].filter(Boolean);
    p.decoded ??= framesOf(p.frames);
    motion.show(p.decoded, null);
    motion.player.toggle(plays);
  }
  // something to look at from the start
  requestAnimationFrame(() => spectrum.chosen ?? spectrum.begin());
  return page;
}
