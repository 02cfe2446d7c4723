"""Meshes by meshio: their bodies have the frequencies that other programs found for them."""

import math

import numpy as np
import pytest

import signorini as sg

meshio = pytest.importorskip("meshio")

SAMPLES = "tests/reference/formats/"
MESHES = "tests/reference/meshes/"
STEEL = {"young": 210000.0, "poisson": 0.3, "density": 7.85e-9}


def frequencies(mesh, group, held, material=STEEL, count=6, plane=False):
    body = {"state": "plane stress", "thickness": 1.0} if plane else {}
    scene = sg.Scene(
        {
            "body": {"kind": "mesh", "file": mesh, **body},
            "material": [{"group": group, **material}],
            "support": [{"group": held, "fix": ["x", "y"] if plane else ["x", "y", "z"]}],
        }
    )
    return np.array(sg.modes(scene, count).open.omega)


@pytest.mark.parametrize(("file", "groups", "body"), [("brick.inp", None, "BODY"), ("brick.vtu", "material", "material 1"), ("block.inp", None, "BODY")])
def test_bodies_of_calculix_have_its_frequencies(tmp_path, file, groups, body):
    mesh = sg.Mesh.from_meshio(meshio.read(SAMPLES + file), tmp_path / "m.msh", groups=groups)
    assert mesh.groups == [body, "WALL", "TIP"]
    printed = {"brick": [10343.98, 11341.42, 33169.41], "block": [10555.31, 11798.26, 26737.78]}[file.split(".")[0]]
    own = frequencies(mesh, body, "WALL", count=3) / math.tau
    assert np.allclose(own, printed, rtol=1e-6)


@pytest.mark.parametrize(("file", "held"), [("hex8_box", "xmin"), ("prism6", "zmin"), ("sphere-eighth-coarse", "first")])
def test_files_of_gmsh_come_back(tmp_path, file, held):
    mesh = sg.Mesh.from_meshio(meshio.read(f"{MESHES}{file}.msh"), tmp_path / "m.msh")
    body = "sphere" if "sphere" in file else "body"
    theirs = frequencies(f"{MESHES}{file}.msh", body, held)
    assert np.allclose(frequencies(mesh, body, held), theirs, rtol=1e-12)


def test_sides_of_second_order(tmp_path):
    mesh = sg.Mesh.from_meshio(meshio.read(f"{MESHES}t6_plate.msh"), tmp_path / "m.msh")
    theirs = frequencies(f"{MESHES}t6_plate.msh", "body", "left", plane=True)
    assert np.allclose(frequencies(mesh, "body", "left", plane=True), theirs, rtol=1e-12)


#: Edges of cells in VTK's order: the nodes in their middle follow the corners.
EDGES = {
    "hexahedron20": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    "tetra10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
}


@pytest.mark.parametrize("kind", list(EDGES))
def test_cells_of_second_order_have_their_nodes_where_they_belong(tmp_path, kind):
    """A bar 4 x 1 x 1 in cubes, cut into wedges and tetrahedra where asked, with nodes in the middle of all edges; held by a set of points."""
    grid = {(i, j, k): n for n, (i, j, k) in enumerate(np.ndindex(5, 2, 2))}
    points = [np.array(p, dtype=float) for p in grid]
    cells = []
    for i in range(4):
        b, t = ([grid[i + x, y, z] for x, y in [(0, 0), (1, 0), (1, 1), (0, 1)]] for z in (0, 1))
        wedges = [[b[0], b[1], b[2], t[0], t[1], t[2]], [b[0], b[2], b[3], t[0], t[2], t[3]]]
        if kind == "hexahedron20":
            cells.append(b + t)
        else:
            cells += [[w[a] for a in tet] for w in wedges for tet in [(0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)]]
    middle: dict[tuple[int, int], int] = {}
    full = []
    for cell in cells:
        own = list(cell)
        for a, b in EDGES[kind]:
            edge = tuple(sorted((cell[a], cell[b])))
            if edge not in middle:
                middle[edge] = len(points)
                points.append((points[edge[0]] + points[edge[1]]) / 2)
            own.append(middle[edge])
        full.append(own)
    points = np.array(points)
    held = np.flatnonzero(points[:, 0] == 0.0)
    mesh = meshio.Mesh(points, [(kind, np.array(full))], point_sets={"wall": held})
    own = frequencies(sg.Mesh.from_meshio(mesh, tmp_path / "m.msh"), "body", "wall", {"young": 1.0, "poisson": 0.0, "density": 1.0}, 8)
    # bending by Euler and Bernoulli 0.0634, shear takes some per cent of it; tension at pi/2/4
    assert 0.058 < own[0] < 0.0634
    assert np.min(np.abs(own / (math.pi / 8) - 1)) < 2e-3


def test_what_is_not_read_is_said(tmp_path):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 1]])
    with pytest.raises(sg.SceneError, match="pyramid"):
        sg.Mesh.from_meshio(meshio.Mesh(points, [("pyramid", [[0, 1, 3, 2, 4]])]), tmp_path / "m.msh")
    with pytest.raises(sg.SceneError, match="no cell data"):
        sg.Mesh.from_meshio(meshio.Mesh(points, [("triangle", [[0, 1, 2]])]), tmp_path / "m.msh", groups="material")
