"""Meshes of other programs, by meshio, as files that scenes name."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import SceneError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: Of each kind of cell: its number in files of Gmsh, its dimension, and, in meshio's order, the nodes of its sides (corners first).
_KINDS: dict[str, tuple[int, int, tuple[tuple[int, ...], ...]]] = {
    "line": (1, 1, ((0,), (1,))),
    "line3": (8, 1, ((0,), (1,))),
    "triangle": (2, 2, ((0, 1), (1, 2), (2, 0))),
    "triangle6": (9, 2, ((0, 1, 3), (1, 2, 4), (2, 0, 5))),
    "quad": (3, 2, ((0, 1), (1, 2), (2, 3), (3, 0))),
    "quad8": (16, 2, ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))),
    "quad9": (10, 2, ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))),
    "tetra": (4, 3, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))),
    "tetra10": (11, 3, ((0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (0, 3, 2, 7, 9, 6))),
    "hexahedron": (5, 3, ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))),
    "hexahedron20": (
        17,
        3,
        (
            (0, 3, 2, 1, 11, 10, 9, 8),
            (4, 5, 6, 7, 12, 13, 14, 15),
            (0, 1, 5, 4, 8, 17, 12, 16),
            (1, 2, 6, 5, 9, 18, 13, 17),
            (2, 3, 7, 6, 10, 19, 14, 18),
            (3, 0, 4, 7, 11, 16, 15, 19),
        ),
    ),
    "wedge": (6, 3, ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))),
}

#: Where the order of nodes of meshio (VTK's) is not that of Gmsh.
_ORDER: dict[str, list[int]] = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hexahedron20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14],
}

#: Sides by their dimension and number of nodes.
_SIDES = {(0, 1): 15, (1, 2): 1, (1, 3): 8, (2, 3): 2, (2, 4): 3, (2, 6): 9, (2, 8): 16}


class Mesh:
    """A mesh on disk, as Gmsh writes it: what ``[body] file`` of a scene names.

    ``scene = {"body": {"kind": "mesh", "file": mesh}, ...}``
    """

    __slots__ = ("groups", "path")

    def __init__(self, path: Path, groups: list[str]) -> None:
        #: The file.
        self.path = path
        #: Names of its groups: regions of cells, and of sides.
        self.groups = groups

    def __fspath__(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"Mesh({str(self.path)!r}, groups={self.groups!r})"

    @classmethod
    def from_meshio(cls, mesh: Any, path: str | PathLike[str], *, groups: str | None = None) -> Mesh:
        """Write a mesh of `meshio <https://pypi.org/project/meshio>`_ (``meshio.read("part.vtu")``) with its groups; its units stay.

        Args:
            mesh: points, cells, ``cell_sets`` and ``point_sets``. Cells of the highest dimension are the body; a set of cells of one
                dimension less is a group of sides, and so are the sides on the boundary all of whose nodes are in a set of points
                (point data of zeros and ones are sets, too).
            path: the file that is written, ``part.msh``.
            groups: name of integer cell data (``material``, ``medit:ref``): cells with the number 3 are the group ``"material 3"``.
                Sets of cells and physical groups of Gmsh need none.

        Raises:
            SceneError: cells of a kind that is not read (shells, beams, pyramids), no cells, names that are taken twice.
        """
        path = Path(path)
        points = np.asarray(mesh.points, dtype=float)
        blocks = [(block.type, np.asarray(block.data)) for block in mesh.cells if block.type != "vertex"]
        strange = sorted({kind for kind, _ in blocks} - set(_KINDS) - {"hexahedron27", "wedge18"})
        if strange or not blocks:
            what = f"cells of kind {', '.join(strange)}" if strange else "no cells"
            raise SceneError(f"{what}: read are {', '.join(_KINDS)}")
        if any(kind in ("hexahedron27", "wedge18") for kind, _ in blocks):
            raise SceneError("cells with nodes in their middle: save them as a file of Gmsh, whose order is known")
        highest = max(_KINDS[kind][1] for kind, _ in blocks)
        sets = _cell_sets(mesh, blocks, groups)
        lines: list[tuple[int, np.ndarray, np.ndarray]] = []  # type, groups, nodes from 0: a row a cell
        names: dict[str, tuple[int, int]] = {}  # dimension, number

        def group(name: str, dim: int) -> int:
            if name in names and names[name][0] != dim:
                raise SceneError(f'"{name}" is a set of cells and of sides: rename one of them')
            return names.setdefault(name, (dim, len(names) + 1))[1]

        for k, (kind, cells) in enumerate(blocks):
            number, dim, _ = _KINDS[kind]
            own = [(name, rows[k]) for name, rows in sets.items() if len(rows[k])]
            order = _ORDER.get(kind)
            ordered = cells if order is None else cells[:, order]
            if dim == highest:
                of = np.zeros(len(cells), dtype=int)
                for name, rows in own:
                    free = rows[of[rows] == 0]
                    of[free] = group(name, dim)
                if (of == 0).any():
                    of[of == 0] = group("body", dim)
                lines.append((number, of, ordered))
            elif dim == highest - 1:
                for name, rows in own:
                    g = group(name, dim)
                    lines.append((number, np.full(len(rows), g), ordered[rows]))
        sides = _boundary(blocks, highest)
        for name, nodes in _point_sets(mesh).items():
            inside = np.zeros(len(points), dtype=bool)
            inside[nodes] = True
            found = [rows[inside[rows].all(axis=1)] for rows in sides]
            if any(len(rows) for rows in found):
                g = group(name if name not in names else f"{name} nodes", highest - 1)
                lines += [(_SIDES[(highest - 1, rows.shape[1])], np.full(len(rows), g), rows) for rows in found]
        path.write_text(_text(points, lines, names))
        return cls(path, list(names))


def _cell_sets(mesh: Any, blocks: list[tuple[str, np.ndarray]], groups: str | None) -> dict[str, list[np.ndarray]]:
    """Rows of each block of cells in each set."""
    kept = [k for k, block in enumerate(mesh.cells) if block.type != "vertex"]
    none = np.zeros(0, dtype=int)
    sets: dict[str, list[np.ndarray]] = {}
    for name, rows in (getattr(mesh, "cell_sets", None) or {}).items():
        if not name.startswith("gmsh:"):
            sets[name] = [none if rows[k] is None else np.asarray(rows[k], dtype=int) for k in kept]
    data: Mapping[str, list[Any]] = getattr(mesh, "cell_data", None) or {}
    if groups is not None:
        if groups not in data:
            raise SceneError(f'no cell data "{groups}"; there are {", ".join(map(repr, data)) or "none"}')
        columns = [np.asarray(data[groups][k]) for k in kept]
        for value in np.unique(np.concatenate(columns)):
            sets[f"{groups} {int(value)}"] = [np.flatnonzero(column == value) for column in columns]
    assert all(len(rows) == len(blocks) for rows in sets.values())
    return sets


def _point_sets(mesh: Any) -> dict[str, np.ndarray]:
    sets = {name: np.asarray(rows, dtype=int) for name, rows in (getattr(mesh, "point_sets", None) or {}).items()}
    for name, values in (getattr(mesh, "point_data", None) or {}).items():
        values = np.asarray(values)
        values = values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values
        if values.ndim == 1 and set(np.unique(values).tolist()) == {0, 1}:
            sets.setdefault(name, np.flatnonzero(values))
    return {name: rows for name, rows in sets.items() if not name.startswith("gmsh:")}


def _boundary(blocks: Iterable[tuple[str, np.ndarray]], highest: int) -> list[np.ndarray]:
    """The sides that belong to one cell alone, a row a side, by their numbers of nodes."""
    found: dict[int, list[np.ndarray]] = {}
    for kind, cells in blocks:
        _, dim, sides = _KINDS[kind]
        if dim == highest:
            for side in sides:
                found.setdefault(len(side), []).append(cells[:, list(side)])
    alone = []
    for parts in found.values():
        rows = np.concatenate(parts)
        key = np.sort(rows, axis=1)
        order = np.lexsort(key.T)
        differs = np.ones(len(rows) + 1, dtype=bool)
        differs[1:-1] = (key[order[1:]] != key[order[:-1]]).any(axis=1)
        alone.append(rows[np.sort(order[differs[1:] & differs[:-1]])])
    return alone


def _text(points: np.ndarray, lines: list[tuple[int, np.ndarray, np.ndarray]], names: dict[str, tuple[int, int]]) -> str:
    """Format 2.2 of Gmsh."""
    out = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    out += [f'{dim} {number} "{name}"' for name, (dim, number) in names.items()]
    out += ["$EndPhysicalNames", "$Nodes", str(len(points))]
    full = np.zeros((len(points), 3))
    full[:, : points.shape[1]] = points
    out += [f"{k + 1} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(full.tolist())]
    out += ["$EndNodes", "$Elements", str(sum(len(groups) for _, groups, _ in lines))]
    first = 1
    for number, groups, nodes in lines:
        count = len(groups)
        of = [np.arange(first, first + count), np.full(count, number), np.full(count, 2), groups, groups]
        table = np.column_stack([*of, nodes + 1])
        row = " ".join(["%d"] * table.shape[1])
        out += ["\n".join([row] * count) % tuple(table.ravel().tolist())] if count else []
        first += count
    out.append("$EndElements")
    return "\n".join(out) + "\n"
