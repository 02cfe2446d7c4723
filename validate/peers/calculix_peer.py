"""CalculiX on the same mesh and data: the peer of `signorini precision --peer calculix`.

Reads a body written by signorini (argument 1: JSON with nodes, elements, material, held displacements, contact nodes with their
normals and gaps, initial displacements and velocities, end time), writes decks, has `ccx` run them, and prints one JSON object: frequencies of the body without
contact, first touch, last release, impulse of the contact, largest force, largest change of the energy, wall_s.

Elements and assembly are CalculiX's, and so are its explicit scheme and its massless contact (`*CONTACT PAIR, TYPE=MASSLESS`: rows of the mass of both surfaces
are dropped, the inclusion is solved at the level of velocities). It knows no rigid plane: the obstacle is an anvil of nine bricks, STIFF times as stiff and as heavy
as the body, whose supports say what the contact bears. Steps are STEP of the time that a wave takes through the smallest element: its own choice is not stable.
"""

import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STEP, STIFF, FREQUENCIES = 0.1, 1000.0, 5
# below this share of the largest force nothing touches
TOUCHES = 0.02

HEX = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
WEDGE = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
HEX_SIDES = ["12", "23", "34", "41", "56", "67", "78", "85", "15", "26", "37", "48"]
TET_SIDES = ["12", "23", "31", "14", "24", "34"]
WEDGE_SIDES = ["12", "23", "31", "45", "56", "64", "14", "25", "36"]
# name there, places of the corners, sides whose middles follow, faces in the order of their numbers
KINDS = {
    "Hex8": ("C3D8", HEX, [], ["1234", "5876", "1562", "2673", "3784", "4851"]),
    "Hex20": ("C3D20", HEX, HEX_SIDES, ["1234", "5876", "1562", "2673", "3784", "4851"]),
    "Tet4": ("C3D4", TET, [], ["123", "142", "243", "341"]),
    "Tet10": ("C3D10", TET, TET_SIDES, ["123", "142", "243", "341"]),
    "Prism6": ("C3D6", WEDGE, [], ["123", "465", "1254", "2365", "3146"]),
    "Prism15": ("C3D15", WEDGE, WEDGE_SIDES, ["123", "465", "1254", "2365", "3146"]),
}


def real(x):
    """A number as CalculiX reads it: it looks at twenty letters."""
    return f"{x:.12e}"


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def refuse(what):
    sys.exit(f"CalculiX's peer takes {what}")


def elements_of(body):
    """Kind there, nodes in its order (from 1), faces by number: their corners."""
    for block in body["blocks"]:
        if block["kind"] not in KINDS:
            refuse(f"elements of {', '.join(KINDS)}, not {block['kind']}")
        name, corners, sides, faces = KINDS[block["kind"]]
        middles = [[(a + b) / 2 for a, b in zip(corners[int(s[0]) - 1], corners[int(s[1]) - 1])] for s in sides]
        order = []
        for place in [*corners, *middles]:
            order.append(min(range(len(block["places"])), key=lambda k: sum(abs(a - b) for a, b in zip(block["places"][k], place))))
        assert sorted(order) == list(range(len(block["places"]))), block["kind"]
        for element in block["elements"]:
            own = [element[k] + 1 for k in order]
            yield name, own, [[own[int(c) - 1] for c in face] for face in faces]


class Deck:
    def __init__(self, body):
        self.body = body
        if body["dim"] != 3 or body["lumped"]:
            refuse("bodies in space with a consistent mass")
        self.elements = list(elements_of(body))
        self.boundary = []
        for held in body["held"]:
            axis = max(range(3), key=lambda c: abs(held["along"][c]))
            if abs(held["along"][axis]) < 1 - 1e-12:
                refuse("supports along the axes")
            self.boundary.append(f"{held['node'] + 1}, {axis + 1}")
        touching = {c["node"] + 1 for c in body["contact"]}
        if touching & {h["node"] + 1 for h in body["held"]}:
            refuse("contact nodes that nothing holds")
        seen = {}
        for number, (_, _, faces) in enumerate(self.elements, 1):
            for side, face in enumerate(faces, 1):
                seen.setdefault(tuple(sorted(face)), []).append((number, side))
        self.slaves = [own[0] for face, own in seen.items() if len(own) == 1 and set(face) <= touching]
        self.plane()

    def plane(self):
        """The plane that all contact nodes meet."""
        contact, nodes = self.body["contact"], self.body["nodes"]
        self.normal = contact[0]["normal"]
        heights = [dot(nodes[c["node"]], self.normal) + c["gap"] for c in contact]
        self.height = heights[0]
        size = self.body["size"]
        if any(dot(c["normal"], self.normal) < 1 - 1e-9 for c in contact) or max(heights) - min(heights) > 1e-6 * size:
            refuse("contact with one plane")

    def model(self):
        """Nodes, elements, material, supports."""
        body = self.body
        lines = ["*NODE, NSET=NBODY"]
        lines += [f"{k}, {', '.join(real(x) for x in place)}" for k, place in enumerate(body["nodes"], 1)]
        for kind in dict.fromkeys(e[0] for e in self.elements):
            lines.append(f"*ELEMENT, TYPE={kind}, ELSET=BODY")
            for number, (own, nodes, _) in enumerate(self.elements, 1):
                words = [str(x) for x in [number, *nodes]]
                if own == kind:
                    lines += [", ".join(words[k : k + 15]) + ("," if k + 15 < len(words) else "") for k in range(0, len(words), 15)]
        lines += ["*MATERIAL, NAME=OWN", "*ELASTIC", f"{real(body['young'])}, {real(body['poisson'])}", "*DENSITY", real(body["density"])]
        lines.append("*SOLID SECTION, ELSET=BODY, MATERIAL=OWN")
        return lines

    def frequencies(self):
        held = ["*BOUNDARY", *self.boundary] if self.boundary else []
        return [*self.model(), *held, "*STEP", "*FREQUENCY", str(FREQUENCIES + 6), "*END STEP"]

    def anvil(self):
        """Nine bricks behind the plane; its supports on the far side."""
        body, n, depth = self.body, self.normal, self.body["size"]
        first = min(range(3), key=lambda c: abs(n[c]))
        along = [float(c == first) - n[first] * n[c] for c in range(3)]
        length = math.sqrt(dot(along, along))
        across = [x / length for x in along]
        # right-handed with the direction from the far side to the body, −n
        other = cross([-x for x in n], across)
        places = [body["nodes"][c["node"]] for c in body["contact"]]
        start, count = len(body["nodes"]) + 1, len(self.elements) + 1

        def marks(direction):
            own = [dot(p, direction) for p in places]
            room = 0.2 * (max(own) - min(own)) + depth
            low, high = min(own) - room, max(own) + room
            return [low + (high - low) * k / 3 for k in range(4)]

        a, b = marks(across), marks(other)
        lines = ["*NODE, NSET=NANVIL"]
        number = {}
        for layer, height in enumerate([self.height + depth, self.height]):
            for i in range(4):
                for j in range(4):
                    number[i, j, layer] = start + len(number)
                    place = [a[i] * across[c] + b[j] * other[c] + height * n[c] for c in range(3)]
                    lines.append(f"{number[i, j, layer]}, {', '.join(map(real, place))}")
        lines.append("*ELEMENT, TYPE=C3D8, ELSET=ANVIL")
        square = [(0, 0), (1, 0), (1, 1), (0, 1)]
        for k in range(9):
            own = [number[k // 3 + i, k % 3 + j, layer] for layer in (0, 1) for i, j in square]
            lines.append(f"{count + k}, {', '.join(map(str, own))}")
        far = [number[i, j, 0] for i in range(4) for j in range(4)]
        lines += ["*NSET, NSET=FAR", *[f"{k}," for k in far]]
        lines += ["*MATERIAL, NAME=STIFF", "*ELASTIC", f"{real(STIFF * body['young'])}, 0.", "*DENSITY", real(STIFF * body["density"])]
        lines += ["*SOLID SECTION, ELSET=ANVIL, MATERIAL=STIFF"]
        lines += ["*SURFACE, NAME=SBODY", *[f"{e}, S{s}" for e, s in self.slaves]]
        lines += ["*SURFACE, NAME=SANVIL", *[f"{count + k}, S2" for k in range(9)]]
        lines += ["*SURFACE INTERACTION, NAME=HARD", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD"]
        return [*lines, "*CONTACT PAIR, INTERACTION=HARD, TYPE=MASSLESS", "SBODY, SANVIL"]

    def drop(self):
        body = self.body
        self.step = STEP * body["size"] / body["wave_speed"]
        initial = []
        for kind, values in (("DISPLACEMENT", body["u0"]), ("VELOCITY", body["v0"])):
            # a value for each node and direction, one behind the other
            own = [x for row in values for x in row] if isinstance(values[0], list) else values
            moves = [f"{k // 3 + 1}, {k % 3 + 1}, {real(x)}" for k, x in enumerate(own) if x != 0]
            initial += [f"*INITIAL CONDITIONS, TYPE={kind}", *moves] if moves else []
        lines = [*self.model(), *self.anvil(), "*BOUNDARY", *self.boundary, "FAR, 1, 3", *initial]
        lines += ["*STEP, NLGEOM, INC=10000000", "*DYNAMIC, EXPLICIT", ", ".join(map(real, [self.step, body["until"], 1e-6 * self.step, self.step]))]
        lines += ["*NODE PRINT, NSET=FAR, TOTALS=ONLY, FREQUENCY=1", "RF", "*EL PRINT, ELSET=BODY, TOTALS=ONLY, FREQUENCY=1", "ELSE, ELKE", "*END STEP"]
        return lines


def ran(folder, name, lines):
    """What a deck makes CalculiX print."""
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    program = os.environ.get("SIGNORINI_CALCULIX", "ccx")
    done = subprocess.run([program, name], cwd=folder, capture_output=True, text=True)
    printed = folder / f"{name}.dat"
    if done.returncode != 0 or not printed.exists():
        said = [line for line in done.stdout.splitlines() if "ERROR" in line]
        sys.exit(f"ccx {name}: {said[0] if said else done.stdout[-200:]}")
    return printed.read_text()


def frequencies(printed, unit):
    table = printed.split("E I G E N V A L U E   O U T P U T")[1].split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s*\d+\s+\S+\s+(\S+)\s+\S+\s+\S+\s*$", table, re.M)
    return [w for w in map(float, rows) if w > 1e-2 * unit][:FREQUENCIES]


def contact(printed, deck):
    """Times, forces and energies of the steps."""
    block = re.compile(r"total (force|internal energy|kinetic energy)[^\n]*time\s+(\S+)\s+([^\n]+)")
    told = {"force": [], "internal energy": [], "kinetic energy": []}
    for what, t, values in block.findall(printed):
        told[what].append((float(t), [float(x) for x in values.split()]))
    t = [0.0, *(row[0] for row in told["force"])]
    # what the supports bear against the body
    force = [0.0, *(-dot(row[1], deck.normal) for row in told["force"])]
    most = max(force)
    closed = [k for k, f in enumerate(force) if f > TOUCHES * most] if most > 0 else []
    energy = [a[1][0] + b[1][0] for a, b in zip(told["internal energy"], told["kinetic energy"])]
    return {
        "touch": t[closed[0]] if closed else None,
        "release": t[closed[-1]] if closed else None,
        "impulse": sum(0.5 * (force[k] + force[k - 1]) * (t[k] - t[k - 1]) for k in range(1, len(t))),
        "force": most,
        "energy": max(abs(e / energy[0] - 1) for e in energy),
        "steps": len(t) - 1,
    }


def main():
    deck = Deck(json.loads(Path(sys.argv[1]).read_text()))
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        modes = frequencies(ran(Path(folder), "modes", deck.frequencies()), deck.body["unit"])
        answer = contact(ran(Path(folder), "drop", deck.drop()), deck)
    print(json.dumps({"frequencies": modes, **answer, "wall_s": time.perf_counter() - begun}))


main()
