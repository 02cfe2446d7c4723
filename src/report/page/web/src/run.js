// A run, or an orbit over its period.

import { bodyOf } from "./body.js";
import { Multipliers } from "./chart.js";
import { decode, framesOf } from "./decode.js";
import { MotionView } from "./motion.js";
import { element, number, numbers } from "./words.js";

/** Whether an orbit is stable, in words. */
export const stability = (o) => (o.stable === null ? "stability not known" : o.stable ? "stable" : "unstable");

/** What there is to say of an orbit. */
export function ofOrbit(o, omega) {
  return [
    ["frequency ω", number(omega ?? (2 * Math.PI) / o.period)],
    ["period", number(o.period)],
    ["energy", number(o.energy)],
    ["amplitude", number(o.amplitude)],
    ["switches a period", o.switches],
    ["time in contact", number(o.contact_time)],
    ["residual", number(o.residual)],
    ["stability", o.alpha === null ? stability(o) : null],
    ["α", o.alpha === null ? null : number(o.alpha)],
    ["β", o.beta === null ? null : number(o.beta)],
  ];
}

export function runSection(raw) {
  const motion = new MotionView(bodyOf(raw.body), { loops: raw.orbit !== null, rubs: raw.motion.frames.traction !== null, forces: raw.motion.forces });
  const { switches, ledger, forces, stride, states } = raw.motion;
  const times = decode(switches.t);
  const about = [
    ["status", raw.status],
    ["states", stride > 1 ? `${states}, every ${stride}th shown` : states],
    ["switches", times.length],
    ...(raw.said ?? []),
    ...(raw.orbit ? ofOrbit(raw.orbit).slice(0, 4) : []),
  ];
  const multipliers = raw.orbit ? new Multipliers({ title: "Floquet multipliers", x: "Re", y: "Im", height: 230 }) : null;
  const said = element("div", { class: "panel" }, element("h2", {}, raw.title || raw.name), numbers(about), element("p", { class: "soft" }, raw.command));
  motion.left.append(...(multipliers ? [multipliers.element] : []), said);
  const section = element("section", { "aria-label": raw.name }, element("div", { class: "columns" }, motion.left, motion.right));
  motion.show(framesOf(raw.motion.frames), ledger, forces);
  multipliers?.show(raw.orbit.multipliers, raw.orbit.alpha === null ? "" : " (of the self-excited system)");
  return { section, motion, player: motion.player, bodies: [motion.view].filter(Boolean) };
}
