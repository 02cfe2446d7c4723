// The page: what there is to see, one part at a time; keys.

import { familySection } from "./family.js";
import { runSection } from "./run.js";
import { pictureOf } from "./svg.js";
import { element } from "./words.js";

const begun = performance.now();
const data = JSON.parse(document.getElementById("data").textContent);

function pictureSection(view) {
  const panel = element("div", { class: "panel picture" });
  panel.innerHTML = view.svg;
  return { section: element("section", { "aria-label": view.name }, panel), bodies: [] };
}

/** Parts of the page, each made when it is first looked at. */
function partsOf(views) {
  const families = views.filter((v) => v.kind === "family");
  const parts = families.length ? [{ title: families[0].title, name: families.length > 1 ? `${families.length} families` : families[0].name, make: () => familySection(families) }] : [];
  for (const view of views) {
    if (view.kind === "run") parts.push({ title: view.title, name: view.name, make: () => runSection(view) });
    if (view.kind === "picture") parts.push({ title: view.title, name: view.name, make: () => pictureSection(view) });
  }
  return parts;
}

const parts = partsOf(data.views);
const holder = element("main");
const heading = element("h1");
let page = null;

function look(k) {
  page?.player?.toggle(false);
  parts[k].page ??= parts[k].make();
  page = parts[k].page;
  holder.replaceChildren(page.section);
  heading.textContent = data.title || parts[k].title || parts[k].name || "signorini";
  document.querySelectorAll("nav button").forEach((b, i) => b.setAttribute("aria-selected", i === k));
}

function save() {
  const blob = new Blob([pictureOf(page)], { type: "image/svg+xml" });
  const link = element("a", { href: URL.createObjectURL(blob), download: `${(parts.find((p) => p.page === page)?.name ?? "view").replace(/\.h5$/, "")}.svg` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const root = document.documentElement;
const dark = window.matchMedia("(prefers-color-scheme: dark)");
function paint(theme) {
  root.dataset.theme = theme;
  // canvases know no style sheet
  page?.bodies.forEach((b) => b.paint());
}
dark.addEventListener("change", () => paint(dark.matches ? "dark" : "light"));
const toggleTheme = () => paint(root.dataset.theme === "dark" ? "light" : "dark");

const HELP = [
  ["Space", "play, pause"],
  ["← →", "a step back, on; on the diagram of families: the last, the next orbit"],
  ["Home, End", "to the start, to the end"],
  ["+ −", "faster, slower"],
  ["body in space", "drag to turn it, with shift or the right button to move it, two fingers or the wheel (once it is clicked) to magnify it; its keys, once it is chosen: arrows, + −, 0"],
  ["T", "light, dark"],
  ["S", "what is shown as an SVG picture"],
  ["?", "this list"],
];
const help = element("div", { class: "panel help", hidden: true, role: "note" }, ...HELP.map(([keys, what]) => element("div", {}, element("kbd", {}, keys), ` ${what}`)));
const toggleHelp = () => (help.hidden = !help.hidden);

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const { target, key } = event;
  // controls have keys of their own
  const slides = target.matches("input[type=range]");
  if (target.matches("select, input") && !slides) return;
  if (slides && /^(Arrow|Home|End|Page)/.test(key)) return;
  if (target.matches("button") && (key === " " || key === "Enter")) return;
  const onDiagram = page?.spectrum && (target === page.spectrum.svg.node() || !page.player);
  const acts = {
    " ": () => (page?.player ? page.player.toggle() : page?.spectrum?.move(1)),
    ArrowRight: () => (onDiagram ? page.spectrum.move(1) : page?.player?.nudge(1)),
    ArrowLeft: () => (onDiagram ? page.spectrum.move(-1) : page?.player?.nudge(-1)),
    Home: () => page?.player?.seek(page.player.span[0]),
    End: () => page?.player?.seek(page.player.span[1]),
    "+": () => page?.player?.faster(1),
    "-": () => page?.player?.faster(-1),
    t: toggleTheme,
    s: save,
    "?": toggleHelp,
    Escape: () => (help.hidden = true),
  };
  const act = acts[key] ?? acts[key.toLowerCase()];
  if (act) {
    event.preventDefault();
    act();
  }
});

root.dataset.theme = dark.matches ? "dark" : "light";
const button = (words, act, label) => element("button", { type: "button", onclick: act, "aria-label": label }, words);
document.body.append(
  element("header", {}, heading, element("span", { class: "soft" }, `signorini ${data.version}`), element("div", { class: "tools" }, button("SVG", save, "save what is shown as SVG"), button("light / dark", toggleTheme, "light or dark"), button("?", toggleHelp, "keys"))),
  parts.length > 1 ? element("nav", { role: "tablist" }, ...parts.map((p, k) => element("button", { type: "button", role: "tab", onclick: () => look(k) }, p.name))) : "",
  help,
  ...data.text.map((words) => element("p", { class: "text" }, words)),
  holder,
);
look(0);

// for tests, and for who wants to drive the page from its console
window.signorini = {
  data,
  get page() {
    return page;
  },
  picture: () => pictureOf(page),
  opened: performance.now() - begun,
};
