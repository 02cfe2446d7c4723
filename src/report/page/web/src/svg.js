// What is shown as one SVG picture: light, with plain colours, so that every program reads it.

/** Words of the page that belong into the picture. */
const WORDS = "h2, .head .soft, dt, dd, p, .legend > *, .scale";

/** The panels of a section where they stand, as a text. */
export function pictureOf(page) {
  const root = document.documentElement;
  const { theme } = root.dataset;
  root.dataset.theme = "light";
  page.bodies.forEach((b) => b.paint());
  const picture = drawn(page);
  root.dataset.theme = theme;
  page.bodies.forEach((b) => b.paint());
  return picture;
}

function drawn(page) {
  const { section } = page;
  const own = section.getBoundingClientRect();
  const colours = getComputedStyle(document.documentElement);
  const plain = (text) => text.replace(/var\((--[a-z]+)\)/g, (_, name) => colours.getPropertyValue(name).trim());
  const rules = [...document.styleSheets[0].cssRules].map((r) => r.cssText).filter((r) => r.startsWith("svg.diagram "));
  const parts = [];
  const place = (box) => [box.left - own.left, box.top - own.top];
  const title = document.querySelector("h1").textContent;
  parts.push(`<text x="18" y="2" style="font-size:17px;font-weight:600;fill:${colours.getPropertyValue("--ink").trim()}">${escape(title)}</text>`);
  // rings lie on the body
  for (const body of page.bodies) {
    const box = body.canvas.getBoundingClientRect();
    if (section.contains(body.canvas)) parts.push(nested(place(box), box, `0 0 ${box.width} ${box.height}`, body.svg()));
  }
  for (const diagram of section.querySelectorAll("svg")) {
    const box = diagram.getBoundingClientRect();
    parts.push(nested(place(box), box, diagram.getAttribute("viewBox"), serialised(diagram)));
  }
  for (const words of section.querySelectorAll(WORDS)) parts.push(...written(words, place));
  const [width, height] = [own.width, own.height + 20].map((x) => x.toFixed(0));
  const style = plain(rules.join("\n")).replaceAll("svg.diagram ", "");
  return `<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 -20 ${width} ${height}" font-family="DejaVu Sans, sans-serif"><style>${style}</style><rect y="-20" width="100%" height="100%" fill="#ffffff"/>${plain(parts.join("\n"))}</svg>`;
}

const nested = ([x, y], box, view, inner) => `<svg x="${x.toFixed(1)}" y="${y.toFixed(1)}" width="${box.width.toFixed(1)}" height="${box.height.toFixed(1)}" viewBox="${view}">${inner}</svg>`;

/** Words where they stand, with the dots and scales of colours before them. */
function written(words, place) {
  const parts = [];
  for (const dot of words.querySelectorAll(".swatch")) {
    const box = dot.getBoundingClientRect();
    const [x, y] = place(box);
    parts.push(`<circle cx="${x + box.width / 2}" cy="${y + box.height / 2}" r="${box.width / 2}" fill="${getComputedStyle(dot).backgroundColor}"/>`);
  }
  const walker = document.createTreeWalker(words, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (!node.textContent.trim()) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    const style = getComputedStyle(node.parentElement);
    if (!box.width || style.visibility === "hidden") continue;
    const [x, y] = place(box);
    const size = parseFloat(style.fontSize);
    parts.push(`<text x="${x.toFixed(1)}" y="${(y + size).toFixed(1)}" style="font-size:${size}px;font-weight:${style.fontWeight};fill:${style.color}">${escape(node.textContent)}</text>`);
  }
  for (const bar of words.matches(".scale") ? words.querySelectorAll("i") : []) {
    const box = bar.getBoundingClientRect();
    const [x, y] = place(box);
    const stops = bar.style.background.match(/rgb\([^)]*\)/g) ?? [];
    stops.forEach((colour, k) => parts.push(`<rect x="${x + (k * box.width) / stops.length}" y="${y}" width="${box.width / stops.length + 0.5}" height="${box.height}" fill="${colour}"/>`));
  }
  return parts;
}

const escape = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

/** The children of a diagram as XML. */
function serialised(diagram) {
  const writer = new XMLSerializer();
  return [...diagram.childNodes].map((node) => writer.serializeToString(node)).join("");
}
