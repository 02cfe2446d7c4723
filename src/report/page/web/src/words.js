// Numbers and elements.

import { format } from "d3-format";

const six = format(".6~g");
/** A number to six digits; nothing for what is none. */
export const number = (x) => (x === null || x === undefined || !Number.isFinite(x) ? "–" : six(x).replace("−", "-").replace("e+", "e"));

/** An element with attributes, listeners (`onclick`) and children. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.filter((c) => c !== null && c !== undefined));
  return made;
}

/** Names and numbers side by side. */
export function numbers(pairs) {
  const list = element("dl", { class: "numbers" });
  for (const [name, value] of pairs) {
    if (value === null || value === undefined || value === "") continue;
    list.append(element("dt", {}, name), element("dd", {}, String(value)));
  }
  return list;
}

/** Colours of curves, told apart by colour-blind readers as well (Okabe and Ito, brightened for dark pages). */
export const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6BB1", "#7F7F7F"];

/** A colour in numbers from 0 to 1. */
export function rgb(colour) {
  const hex = colour.match(/^#(..)(..)(..)$/);
  if (hex) return hex.slice(1).map((x) => parseInt(x, 16) / 255);
  return (colour.match(/[\d.]+/g) ?? [0, 0, 0]).slice(0, 3).map((x) => Number(x) / 255);
}

/** A colour of the page. */
export const theme = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
