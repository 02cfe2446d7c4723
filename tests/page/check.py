"""The page of `signorini view` in a real browser: `make page`.

Loads without an error and without a request, plays, answers to clicks and keys, gives its picture as SVG, and can be used by who does not see it or has no
mouse, as far as a tool (axe) can tell; sizes and speeds are measured and held against what was promised. Screenshots go to out/page/.
"""

import re
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as xml
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, sync_playwright

OUT = Path("out/page")
BIN = Path("target/release/signorini")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
FLAGS += ["--disable-component-update", "--disable-sync"]
# a graphics processor in software, for bodies in space
FLAGS += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# what the tool is asked for: levels A and AA of the guidelines
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
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
        self.page.wait_for_function("() => window.signorini?.page?.section.querySelector('canvas, svg') != null")
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

    def accessible(self, name: str, *more: str) -> None:
        """What axe finds: contrast, names of controls, order of headings."""
        found = Axe().run(self.page, options={"runOnly": [*RULES, *more]}).response["violations"]
        told = [f"{v['id']} ({len(v['nodes'])} times, {v['nodes'][0]['html'][:90]})" for v in found]
        check(not found, f"{name}: nothing that keeps readers out {told}")

    def surface(self) -> int:
        """Different colours of a body in space, of the picture that is drawn now."""
        return self.page.evaluate(
            """() => { const b = signorini.page.bodies[0]; b.paint(); const c = document.createElement("canvas"); c.width = b.canvas.width; c.height = b.canvas.height;
            const x = c.getContext("2d"); x.drawImage(b.canvas, 0, 0); return new Set(new Uint32Array(x.getImageData(0, 0, c.width, c.height).data.buffer)).size; }"""
        )

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
    looker.accessible("run", "best-practice")
    looker.shot("run")
    looker.page.keyboard.press("t")
    looker.page.wait_for_timeout(200)
    check(looker.value("document.documentElement.dataset.theme") == "dark", "run: dark")
    looker.accessible("run, dark", "best-practice")
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
    looker.page.locator("svg[role=slider]").focus()
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
    looker.accessible("family", "best-practice")
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


CHOSEN = "signorini.page.motion.chosen"


def points(looker: Looker) -> None:
    """Curves of contact points that one asks for, by name and by a click on the body."""
    file = OUT / "plate-40.h5"
    stored = looker.open(made("points", file))
    assert stored < 5
    field = looker.page.get_by_label("contact nodes that have curves")
    names = looker.value("signorini.data.views[0].body.contact.names")
    field.fill(f"{names[3]}, {names[5]}")
    field.press("Enter")
    heading = looker.page.locator("h2", has_text="Displacement of")
    check(heading.inner_text().startswith("Displacement of 2 of"), f"points: two by name ({heading.inner_text()})")
    check(looker.page.locator("svg.rings circle[stroke-width=\"2\"]").count() == 2, "points: they have rings on the body")
    ring = looker.page.locator("svg.rings circle").first.bounding_box()
    looker.page.mouse.click(ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2)
    check(looker.value(f"{CHOSEN}.length") == 1, "points: a click takes one away")
    field.fill("")
    field.press("Enter")
    check(looker.value(f"{CHOSEN}.length") == 0, "points: none is as at first")
    looker.silent("points")


def box(name: str, n: int, m: int) -> Path:
    """A slab of n x m x 2 bricks on a bent base, with a face that touches and one that is held."""

    def at(i: int, j: int, k: int) -> int:
        return 1 + (i * (m + 1) + j) * 3 + k

    nodes = [(i / n, 0.5 * j / m, 0.02 * k + 0.1 * (i / n) ** 2) for i in range(n + 1) for j in range(m + 1) for k in range(3)]
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    sides = [(group, [at(i, j + a, k + b) for a, b in square]) for group, i in ((2, n), (3, 0)) for j in range(m) for k in range(2)]
    bricks = [[at(i + a, j + b, k + c) for c in range(2) for a, b in square] for i in range(n) for j in range(m) for k in range(2)]
    elements = [f"3 2 {group} {group} {' '.join(map(str, own))}" for group, own in sides]
    elements += [f"5 2 1 1 {' '.join(map(str, own))}" for own in bricks]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "3", '3 1 "body"', '2 2 "end"', '2 3 "root"', "$EndPhysicalNames"]
    lines += ["$Nodes", str(len(nodes)), *(f"{k} {x} {y} {z}" for k, (x, y, z) in enumerate(nodes, 1)), "$EndNodes"]
    lines += ["$Elements", str(len(elements)), *(f"{k} {e}" for k, e in enumerate(elements, 1)), "$EndElements"]
    (OUT / f"{name}.msh").write_text("\n".join(lines) + "\n")
    scene = OUT / f"{name}.toml"
    scene.write_text(
        f"""
title = "A slab of {4 * (n * m + 2 * n + 2 * m)} triangles"
body = {{ kind = "mesh", file = "{name}.msh", mass = "lumped" }}
material = [{{ young = 1.0, poisson = 0.3, density = 1.0 }}]
support = [{{ group = "root", fix = ["x", "y", "z"] }}]
contact = {{ group = "end", plane = {{ normal = [1.0, 0.0, 0.0], offset = 1.002 }}, stress = "reaction" }}
initial = {{ velocity = ["0.05*x", "0", "0.08*x^2"] }}
run = {{ until = 0.02, samples = 8 }}
"""
    )
    return scene


TURNED = "[signorini.page.bodies[0].camera.longitude, signorini.page.bodies[0].camera.latitude, signorini.page.bodies[0].camera.zoom]"


def space(looker: Looker) -> None:
    """Bodies in space: drawn, turned by mouse, touch and keys; 300,000 triangles; without WebGL."""
    file = OUT / "sphere-eighth.h5"
    signorini("run", "scenarios/sphere-eighth.toml", "-o", file, "--force")
    page = made("space", file)
    looker.open(page)
    check(looker.value("!signorini.page.bodies[0].isPainted"), "space: WebGL draws it")
    looker.page.keyboard.press("End")
    check(looker.surface() > 30, f"space: the surface is drawn ({looker.surface()} colours)")
    place = looker.page.locator("canvas").bounding_box()
    middle = (place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)
    before = looker.value(TURNED)
    looker.page.mouse.move(*middle)
    looker.page.mouse.down()
    looker.page.mouse.move(middle[0] + 90, middle[1] + 40, steps=4)
    looker.page.mouse.up()
    after = looker.value(TURNED)
    check(abs(after[0] - before[0] + 0.72) < 1e-9 and abs(after[1] - before[1] - 0.32) < 1e-9, "space: the mouse turns it")
    time_before = looker.value("signorini.page.player.time")
    for key in ("ArrowLeft", "ArrowDown", "+"):
        looker.page.keyboard.press(key)
    keyed = looker.value(TURNED)
    check(keyed[0] > after[0] and keyed[1] < after[1] and keyed[2] > after[2], "space: keys turn and magnify it")
    check(looker.value("signorini.page.player.time") == time_before, "space: and leave the time")
    looker.page.keyboard.press("0")
    check(looker.value(TURNED) == before, "space: 0 turns it back")
    session = looker.page.context.new_cdp_session(looker.page)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]})

    left, right = [(middle[0] + d, middle[1]) for d in (-40, 40)]
    touch("touchStart", left, right)
    touch("touchMove", (left[0] - 40, left[1]), (right[0] + 40, right[1]))
    touch("touchEnd")
    check(looker.value(TURNED)[2] > 1.5, f"space: two fingers magnify it {looker.value(TURNED)[2]:.2f} times")
    looker.page.get_by_label("seen from").select_option("−z")
    check(looker.value(TURNED)[1] < -1.57, "space: it is seen from below")
    looker.page.get_by_label("seen from").select_option("")
    # where it touches the colours are those of pressures: between the shades of what does not
    looker.page.keyboard.press("Escape")
    looker.value("signorini.page.player.seek(0.5 * signorini.page.player.span[1])")
    looker.page.locator("select[aria-label=colour]").select_option("u")
    check(looker.surface() > 100, "space: coloured by the displacement")
    looker.page.locator("select[aria-label=colour]").select_option("pressure")
    looker.picture("space")
    looker.accessible("space", "best-practice")
    looker.shot("space")
    looker.page.keyboard.press("t")
    looker.page.wait_for_timeout(200)
    looker.accessible("space, dark", "best-practice")
    looker.shot("space-dark")
    looker.silent("space")
    # many triangles
    for n, m in ((90, 80), (300, 245)):
        file = OUT / f"slab-{n}.h5"
        signorini("run", box(f"slab-{n}", n, m), "-o", file, "--force")
        page = made(f"slab-{n}", file)
        took = looker.open(page)
        count = looker.value("signorini.data.views[0].body.solid.count")
        looker.page.keyboard.press(" ")
        rate = looker.played(4.0)
        looker.page.keyboard.press(" ")
        said = looker.page.locator(".body .head .soft").inner_text()
        size = page.stat().st_size / 1e6
        told = f"{count} triangles, {size:.1f} MB, open in {took:.1f} s, {rate:.0f} pictures a second without a graphics processor ({said})"
        check(rate > 5 and took < 10, f"space: {told}")
        looker.page.wait_for_timeout(500)
        check("triangles" not in looker.page.locator(".body .head .soft").inner_text(), "space: at rest all are drawn")
        looker.shot(f"slab-{n}")
        looker.silent(f"slab-{n}")
    # a browser without WebGL
    looker.page.add_init_script("const own = HTMLCanvasElement.prototype.getContext; HTMLCanvasElement.prototype.getContext = function (k, ...o) { return k === 'webgl2' ? null : own.call(this, k, ...o); };")
    for name in ("space", "slab-90"):
        looker.open(OUT.resolve() / f"{name}.html")
        check(looker.value("signorini.page.bodies[0].isPainted") and looker.colours("canvas") > 20, f"{name}: drawn without WebGL")
        looker.page.keyboard.press(" ")
        rate = looker.played(2.0)
        looker.page.keyboard.press(" ")
        check(rate > 3, f"{name}: {rate:.0f} pictures a second ({looker.page.locator('.body .head .soft').inner_text()})")
        looker.shot(f"{name}-painted")
        looker.silent(f"{name} without WebGL")


def site(looker: Looker) -> None:
    """The documentation as a site, where it was built (make docs)."""
    root = Path("target/site")
    if not (root / "index.html").exists():
        print("no target/site: the documentation is not looked at (make docs)")
        return
    for name in ("index", "start/index", "tutorials/response/index", "reference/scenes/index", "validation/index"):
        looker.page.goto((root / f"{name}.html").resolve().as_uri())
        looker.accessible(f"site, {name}")


def main() -> int:
    OUT.mkdir(parents=True, exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        print("no Chromium on this machine: install the package chromium of the distribution", file=sys.stderr)
        return 1
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=FLAGS)
        for part in (run, family, several, bodies, points, space, site):
            looker = Looker(browser)
            part(looker)
            looker.page.close()
        browser.close()
    print(f"{len(failures)} failed" if failures else "all as it should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
