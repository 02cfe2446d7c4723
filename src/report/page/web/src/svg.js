// What is shown as one SVG picture.

const NAMES = ["--back", "--panel", "--ink", "--soft", "--line", "--accent", "--band", "--wall", "--force"];

/** The panels of a section where they stand, as a text. */
export function pictureOf(page) {
  const { section } = page;
  const own = section.getBoundingClientRect();
  const colours = getComputedStyle(document.documentElement);
  const root = NAMES.map((n) => `${n}:${colours.getPropertyValue(n).trim()}`).join(";");
  const rules = [...document.styleSheets[0].cssRules].map((r) => r.cssText).filter((r) => r.startsWith("svg "));
  const parts = [];
  const title = (panel, x, y) => {
    const words = panel.querySelector("h2")?.textContent ?? "";
    parts.push(`<text x="${x + 10}" y="${y + 20}" style="font-weight:600;font-size:13px">${escape(words)}</text>`);
  };
  for (const panel of section.querySelectorAll(".panel")) {
    const box = panel.getBoundingClientRect();
    const [x, y] = [box.left - own.left, box.top - own.top];
    const diagram = panel.querySelector("svg");
    const body = page.bodies.find((b) => b.element === panel);
    if (!diagram && !body) continue;
    title(panel, x, y);
    const inner = (diagram ?? body.canvas).getBoundingClientRect();
    const at = `x="${(inner.left - own.left).toFixed(1)}" y="${(inner.top - own.top).toFixed(1)}" width="${inner.width.toFixed(1)}" height="${inner.height.toFixed(1)}"`;
    const view = diagram ? diagram.getAttribute("viewBox") : `0 0 ${inner.width} ${inner.height}`;
    parts.push(`<svg ${at} viewBox="${view}">${diagram ? serialised(diagram) : body.svg()}</svg>`);
  }
  return `<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" width="${own.width}" height="${own.height}" viewBox="0 0 ${own.width} ${own.height}" style="${root}"><style>${rules.join("\n").replaceAll("svg .", ".").replaceAll("svg text", "text")}</style><rect width="100%" height="100%" fill="${colours.getPropertyValue("--back")}"/>${parts.join("\n")}</svg>`;
}

const escape = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

/** The children of a diagram as XML. */
function serialised(diagram) {
  const writer = new XMLSerializer();
  return [...diagram.childNodes].map((node) => writer.serializeToString(node)).join("");
}
