"""The first frequency of a cantilever with a breathing crack over the depth of the crack, beside the bilinear formula 2 ω_o ω_c / (ω_o + ω_c).

    python3 validate/bodies/crack_depth.py target/release/signorini out/crack-depth

A beam of 6 × 1 in plane stress (E = ρ = 1, ν = .3), clamped on its left, cracked from above at x = 1.5; 12 × 8 elements Q8. Open and closed frequencies by `signorini modes`, that of the
breathing beam by `signorini orbit --viscous --displacement` (C = .1 K). Writes the table (CSV) and, where Matplotlib is there, the picture (PNG, SVG).
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

LENGTH, HEIGHT, AT = 6.0, 1.0, 1.5
NX, NY = 12, 8

SCENE = """title = "crack"
[body]
kind = "mesh"
file = "crack.msh"
state = "plane stress"
[[material]]
young = 1.0
poisson = 0.3
density = 1.0
[[support]]
group = "left"
fix = ["x", "y"]
[[contact]]
slave = "crack"
master = "lip"
[orbit]
mode = 1
beta = 0.1
"""


def mesh(rows):
    """The beam in Gmsh's format 2.2, with a crack through so many rows of elements; beyond its tip the nodes on it are there twice."""
    nodes, of = [], {}

    def node(i, j, side):
        # corners have even numbers, nodes on sides one odd one
        cracked = i == 2 * NX * AT / LENGTH and j > 2 * (NY - rows)
        key = (i, j, side if cracked else 0)
        if key not in of:
            nodes.append((i * LENGTH / (2 * NX), j * HEIGHT / (2 * NY)))
            of[key] = len(nodes)
        return of[key]

    lines = []
    for a in range(NX):
        # which lip an element has
        side = 1 if (a + 0.5) * LENGTH / NX > AT else 0
        for b in range(NY):
            i, j = 2 * a, 2 * b
            around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
            lines.append("16 2 1 1 " + " ".join(str(node(i + p, j + q, side)) for p, q in around))
    for b in range(NY):
        ends = lambda i, side: " ".join(str(node(i, 2 * b + q, side)) for q in (0, 2, 1))
        lines.append("8 2 2 2 " + ends(0, 0))
        if b >= NY - rows:
            at = round(2 * NX * AT / LENGTH)
            lines.append("8 2 3 3 " + ends(at, 0))
            lines.append("8 2 4 4 " + ends(at, 1))
    names = ['2 1 "body"', '1 2 "left"', '1 3 "crack"', '1 4 "lip"']
    text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names)), *names, "$EndPhysicalNames"]
    text += ["$Nodes", str(len(nodes)), *(f"{k + 1} {x!r} {y!r} 0.0" for k, (x, y) in enumerate(nodes)), "$EndNodes"]
    text += ["$Elements", str(len(lines)), *(f"{k + 1} {line}" for k, line in enumerate(lines)), "$EndElements", ""]
    return "\n".join(text)


def main(program, stem):
    program = str(Path(program).resolve())
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "crack.toml").write_text(SCENE)

        def said(*words):
            done = subprocess.run([program, *words, "--json", "-q"], cwd=folder, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"signorini {' '.join(words)}: {done.stderr}")
            return json.loads(done.stdout)

        for depth in range(1, NY):
            (folder / "crack.msh").write_text(mesh(depth))
            modes = said("modes", "crack.toml", "--count", "1")
            opened, closed = modes["open"]["omega"][0], modes["closed"]["omega"][0]
            orbit = said("orbit", "crack.toml", "--viscous", "--displacement", "-0.1", "-o", "crack.h5", "--force")
            bilinear = 2 * opened * closed / (opened + closed)
            rows.append((depth / NY, opened, closed, bilinear, orbit["omega"]))
            print("depth %.3f: open %.10f, closed %.10f, bilinear %.10f, breathing %.10f (%+.1e)" % (*rows[-1], orbit["omega"] / bilinear - 1))
    stem = Path(stem)
    stem.parent.mkdir(parents=True, exist_ok=True)
    table = "\n".join(",".join(repr(x) for x in row) for row in rows)
    stem.with_suffix(".csv").write_text("depth,open,closed,bilinear,breathing\n" + table + "\n")
    try:
        import matplotlib
    except ImportError:
        return
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    depth, opened, closed, bilinear, breathing = zip(*rows)
    figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
    axes.plot(depth, closed, "-", color="0.6", label="closed")
    axes.plot(depth, opened, "--", color="0.6", label="open")
    axes.plot(depth, bilinear, "-", color="#0072b2", label=r"$2\omega_o\omega_c/(\omega_o + \omega_c)$")
    axes.plot(depth, breathing, "o", color="#d55e00", label="breathing")
    axes.set(xlabel="depth of the crack over the height", ylabel="first frequency", xlim=(0, 1), ylim=(0, None))
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    for ending in ["png", "svg"]:
        figure.savefig(stem.with_suffix(f".{ending}"), dpi=200)


if __name__ == "__main__":
    main(*sys.argv[1:])
