"""The page of `signorini view` in a real browser: `make page`.

Loads without an error and without a request, plays, answers to clicks and keys, gives its picture as SVG; sizes and speeds are measured and held against
what was promised. Screenshots go to out/page/.
"""

import re
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as xml
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

OUT = Path("out/page")
BIN = Path("target/release/signorini")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
FLAGS += ["--disable-component-update", "--disable-sync"]
failures: list[str] = []


def check(holds: bool, what: str) -> None:
    print(("ok      " if holds else "FAILED  ") + what)
    if not holds:
        failures.append(what)


def signorini(*words: object) -> None:
    subprocess.run([BIN, *map(str, words), "-q"], check=True)


def changed(scene: str, name: str, *changes: tuple[str, str]) -> Path:
    text = Path(f"scenarios/{scene}.toml").read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = OUT / name
    path.write_text(text)
    return path


def made(name: str, *files: Path) -> Path:
    page = OUT / f"{name}.html"
    signorini("view", *files, "-o", page, "--no-open")
    return page.resolve()


class Looker:
    """A browser that notes what goes wrong."""

    def __init__(self, browser):
        self.page: Page = browser.new_page(viewport={"width": 1400, "height": 950})
        self.heard: list[str] = []
        self.page.on("console", lambda m: self.heard.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda e: self.heard.append(str(e)))
        self.page.on("request", lambda r: self.heard.append(r.url[:80]) if r.url.startswith(("http", "ws")) else None)

    def open(self, path: Path) -> float:
        start = time.monotonic()
        self.page.goto(path.as_uri())
        self.page.wait_for_function("window.signorini?.page?.section.querySelector('canvas, svg') != null")
        return time.monotonic() - start

    def value(self, code: str):
        return self.page.evaluate(code)

    def played(self, seconds: float) -> float:
        """Frames a second while it plays."""
        before = self.value("signorini.page.player.painted")
        start = time.monotonic()
        self.page.wait_for_timeout(1000 * seconds)
        return (self.value("signorini.page.player.painted") - before) / (time.monotonic() - start)

    def colours(self, selector: str) -> int:
        """Different colours on a canvas."""
        return self.page.locator(selector).first.evaluate(
            """(c) => { const d = new Uint32Array(c.getContext("2d").getImageData(0, 0, c.width, c.height).data.buffer); return new Set(d).size; }"""
        )

    def shot(self, name: str) -> None:
        path = OUT / f"{name}.png"
        self.page.screenshot(path=path, full_page=True)
        check(path.stat().st_size > 40_000, f"{name}: a screenshot with something on it ({path.stat().st_size // 1000} kB)")

    def picture(self, name: str) -> None:
        text = self.value("signorini.picture()")
        (OUT / f"{name}.svg").write_text(text)
        drawn = len(list(xml.fromstring(text).iter()))
        # the letters of an embedded image spell anything
        text = re.sub(r"data:image/[^\"']*", "", text)
        check(drawn > 100 and "NaN" not in text and "undefined" not in text, f"{name}: a picture in SVG ({drawn} elements)")

    def silent(self, name: str) -> None:
        check(not self.heard, f"{name}: no error, no request {self.heard[:3]}")
        self.heard.clear()


def run(looker: Looker) -> None:
    scene = changed("plate", "plate-40.toml", ("elements = [20, 10]", "elements = [40, 20]"), ('"dop853"', '"modal"'))
    file = OUT / "plate-40.h5"
    signorini("run", scene, "-o", file, "--force")
    page = made("run", file)
    check(page.stat().st_size < 15e6, f"run of the 40 x 20 plate: {page.stat().st_size / 1e6:.1f} MB")
    took = looker.open(page)
    states = looker.value("signorini.data.views[0].motion.states")
    check(took < 2 and states >= 400, f"run: {states} states open in {took:.2f} s")
    check(looker.colours("canvas") > 50, "run: the body is drawn")
    looker.page.keyboard.press(" ")
    rate = looker.played(2.0)
    check(rate >= 30, f"run: plays at {rate:.0f} frames a second")
    looker.page.keyboard.press(" ")
    check(not looker.value("signorini.page.player.playing"), "run: the space bar stops it")
    looker.page.keyboard.press("End")
    check(abs(looker.value("signorini.page.player.time") - 3.36) < 1e-12, "run: End goes to the end")
    # the cursor goes where one clicks, in all diagrams: displacement, pressure, map, forces of contact and of supports, energies
    box = looker.page.locator("svg.diagram").first.bounding_box()
    looker.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 60)
    t = looker.value("signorini.page.player.time")
    lines = looker.page.locator("svg .cursor").evaluate_all("(all) => all.map((c) => c.getAttribute('x1'))")
    check(1.4 < t < 2.0 and len(lines) == 6 and len(set(lines)) == 1, f"run: a click at t = {t:.3f} moves {len(lines)} cursors")
    looker.page.locator("select[aria-label=colour]").select_option("stress")
    check(looker.colours("canvas") > 50, "run: coloured by the stress")
    looker.picture("run")
    looker.shot("run")
    looker.page.keyboard.press("t")
    looker.page.wait_for_timeout(200)
    check(looker.value("document.documentElement.dataset.theme") == "dark", "run: dark")
    looker.shot("run-dark")
    looker.silent("run")


def family(looker: Looker) -> None:
    scene = changed("half-plate-viscous", "half-plate.toml", ("elements = [46, 21]", "elements = [10, 3]"))
    file = OUT / "family.h5"
    signorini("backbone", scene, "--viscous", "--quick", "--range", "1.7,1.9", "--step", "0.001", "-o", file, "--force")
    page = made("family", file)
    check(page.stat().st_size < 15e6, f"family of 200 points: {page.stat().st_size / 1e6:.1f} MB")
    took = looker.open(page)
    points = looker.value("signorini.data.views[0].points.filter((p) => p.orbit).length")
    plays = looker.value("signorini.data.views[0].points.filter((p) => p.orbit && p.frames).length")
    check(took < 2 and points >= 190 and plays == points, f"family: {points} orbits, {plays} of them play, open in {took:.2f} s")
    mark = looker.page.locator('[data-point="0:100"]').bounding_box()
    looker.page.mouse.move(mark["x"] + 4, mark["y"] + 4)
    check("energy" in looker.page.locator(".tip").inner_text(), "family: a point says its numbers")
    looker.page.mouse.click(mark["x"] + 4, mark["y"] + 4)
    rate = looker.played(1.5)
    check(rate >= 30, f"family: a click plays an orbit at {rate:.0f} frames a second")
    check(looker.colours("canvas") > 20, "family: the body is drawn")
    chosen = "signorini.page.spectrum.chosen.number"
    before = looker.value(chosen)
    looker.page.locator("svg[role=listbox]").focus()
    looker.page.keyboard.press("ArrowRight")
    check(looker.value(chosen) != before, "family: the arrow keys go to the next orbit")
    largest = looker.page.locator("h2", has_text="Floquet").locator("..").inner_text()
    check("largest of size" in largest, f"family: multipliers are there ({largest.splitlines()[-1]})")
    # the motion closes, and is that of the file
    closes = looker.value(
        """(() => { const f = signorini.page.spectrum.chosen.decoded, n = f.u.length / f.t.length, last = f.u.length - n; let d = 0, m = 0;
        for (let i = 0; i < n; i++) { d = Math.max(d, Math.abs(f.u[i] - f.u[last + i])); m = Math.max(m, Math.abs(f.u[i])); } return d / m; })()"""
    )
    check(closes < 1e-3, f"family: the orbit closes to {closes:.0e}, the digits of its places")
    looker.picture("family")
    looker.shot("family")
    looker.silent("family")


def several(looker: Looker) -> None:
    scene = "scenarios/half-plate-orbit.toml"
    files = [OUT / f"{name}.h5" for name in ("shooting", "series", "checked")]
    signorini("backbone", scene, "--range", "1.7,1.75", "-o", files[0], "--force")
    signorini("backbone", scene, "--range", "1.7,1.75", "--method", "hbm", "--harmonics", "3,7", "-o", files[1], "--force")
    signorini("crosscheck", files[1], scene, "-o", files[2], "--force")
    orbit = OUT / "orbit.h5"
    signorini("orbit", scene, "--omega", "1.8", "-o", orbit, "--force")
    looker.open(made("several", *files, orbit))
    check(looker.page.locator("nav button").count() == 2, "several: families in one diagram, an orbit beside them")
    check(looker.page.locator(".legend button").count() == 5, "several: five branches")
    for number in ("0:1", "1:2", "2:0"):
        mark = looker.page.locator(f'[data-point="{number}"]').bounding_box()
        looker.page.mouse.click(mark["x"] + 4, mark["y"] + 4)
        looker.page.wait_for_timeout(300)
    check(looker.value("signorini.page.player.playing"), "several: orbits of different files play one after the other")
    looker.page.locator("nav button").nth(1).click()
    check(looker.played(0.1) == 0 and looker.page.locator("canvas").count() == 1, "several: the orbit is shown")
    looker.picture("orbit")
    looker.shot("several")
    looker.silent("several")


def bodies(looker: Looker) -> None:
    """Every kind of body."""
    for name in ("bar", "bracket", "valve", "half-disc", "two-mass-stop"):
        file = OUT / f"{name}.h5"
        signorini("run", f"scenarios/{name}.toml", "-o", file, "--force")
        looker.open(made(name, file))
        looker.page.keyboard.press("End")
        looker.page.wait_for_timeout(100)
        shapeless = name == "two-mass-stop"
        check(looker.page.locator("canvas").count() == (0 if shapeless else 1), f"{name}: {'no shape' if shapeless else 'a body'}")
        if not shapeless:
            check(looker.colours("canvas") > 10, f"{name}: it is drawn")
        looker.shot(name)
        looker.picture(name)
        looker.silent(name)


def main() -> int:
    OUT.mkdir(parents=True, exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        print("no Chromium on this machine: install the package chromium of the distribution", file=sys.stderr)
        return 1
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=FLAGS)
        for part in (run, family, several, bodies):
            looker = Looker(browser)
            part(looker)
            looker.page.close()
        browser.close()
    print(f"{len(failures)} failed" if failures else "all as it should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
