"""Scenes: what is computed, as a file, a dict, or matrices of another program."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Union

import numpy as np

from . import _toml
from ._errors import SceneError
from ._signorini import Scene as _Scene

ScenePath = Union[str, "PathLike[str]"]


class Scene:
    """A scene, read and checked; it never changes.

    Args:
        source: path of a TOML file, or a dict with the same tables and keys
            (``{"body": {"kind": "bar", ...}, "contact": {...}}``; lists of tables as lists of dicts).
            Files that a dict names (meshes, tables, matrices) are looked for in the working directory.

    Raises:
        SceneError: with file, line, key, and what would be accepted.

    Example:
        >>> import signorini as sg
        >>> bar = sg.Scene({"body": {"kind": "bar", "size": [1.0], "elements": [10], "young": 1.0, "density": 1.0},
        ...                 "support": [{"edge": "left", "fix": ["x"]}],
        ...                 "contact": {"edge": "right", "gap": 1.0},
        ...                 "initial": {"mode": 1, "amplitude": -1.1}, "run": {"until": 4.0}})
        >>> finer = bar.with_(body__elements=[20])
    """

    __slots__ = ("_matrices", "_scene")

    def __init__(self, source: ScenePath | Mapping[str, Any] | Scene):
        self._matrices: dict[str, Any] = {}
        if isinstance(source, Scene):
            self._scene, self._matrices = source._scene, source._matrices
        elif isinstance(source, Mapping):
            self._scene = _Scene(_toml.document(source), "scene.toml")
        elif isinstance(source, (str, PathLike)):
            self._scene = _Scene.read(os.fsdecode(source))
        else:
            raise TypeError(f"give the path of a scene, or a dict, not {type(source).__name__}")

    @classmethod
    def _of(cls, scene: _Scene, matrices: dict[str, Any]) -> Scene:
        new = cls.__new__(cls)
        new._scene, new._matrices = scene, matrices
        return new

    @classmethod
    def _given(cls, text: str, file: str, matrices: dict[str, Any]) -> Scene:
        return cls._of(_Scene(text, file, matrices), matrices)

    @classmethod
    def parse(cls, text: str, file: ScenePath = "scene.toml") -> Scene:
        """A scene from its text; ``file`` is its name in messages, and its folder that of the files it names."""
        return cls._given(text, os.fsdecode(file), {})

    @classmethod
    def from_matrices(
        cls,
        M: Any,
        K: Any,
        contact: Any,
        gap: Any,
        *,
        N_C: Any = None,
        N_O: Any = None,
        C: Any = None,
        stress: Any = None,
        title: str = "Body from matrices",
        **tables: Any,
    ) -> Scene:
        """A body of another finite-element program: its matrices over all free displacements.

        Args:
            M, K: mass and stiffness, symmetric, [N, N]; any SciPy sparse matrix or array, or NumPy array.
            contact: the displacements that the obstacle limits, [n_C]: row numbers from 0, or a mask over all rows; positive
                towards it.
            gap: their distance from the obstacle, a length or one each, [n_C].
            N_C, N_O: the contact stresses of the nodal boundary method, lambda = N_C u_C + N_O u_O, [n_C, n_C] and
                [n_C, N - n_C]; u_O are all other displacements in their order. Left out: the stress is the nodal reaction
                (``stress = "reaction"``), for which the matrices suffice.
            C: damping, a combination of M and K, [N, N].
            stress: other forms of ``[contact] stress``.
            tables: further tables of the scene, as ``initial={"mode": 1, "amplitude": -1.1}``,
                ``run={"until": 10.0}``, ``orbit={"omega": 1.8}``; ``contact={...}`` entries as
                ``contact_table={"method": "mass-redistribution"}``.

        Units are those of the matrices. In results u_C comes last: ``run.of_rows(run.u)`` has the columns in the order of the
        matrices. ``scene.save(path)`` writes the scene with its matrices beside it, for the command line; a file of results names
        the matrices, but does not hold them.
        """
        files: dict[str, Any] = {"given M": M, "given K": K}
        body = {"kind": "matrices", "mass_matrix": "given M", "stiffness_matrix": "given K"}
        table: dict[str, Any] = {"displacements": _rows(contact, M)}
        gaps = np.asarray(gap, dtype=float)
        table["gap" if gaps.ndim == 0 else "gaps"] = float(gaps) if gaps.ndim == 0 else gaps
        if (N_C is None) != (N_O is None):
            raise SceneError("N_C and N_O belong together: give both, or none for the nodal reaction")
        if N_C is not None:
            files |= {"given N_C": N_C, "given N_O": N_O}
            table |= {"n_c": "given N_C", "n_o": "given N_O"}
        elif stress is not None:
            table["stress"] = stress
        if C is not None:
            files["given C"] = C
            body["damping_matrix"] = "given C"
        table |= tables.pop("contact_table", {})
        # other methods have stresses of their own
        if N_C is None and table.get("method", "nbm") == "nbm":
            table.setdefault("stress", "reaction")
        text = _toml.document({"title": title, "body": body, "contact": table, **tables})
        return cls._given(text, "scene.toml", {name: _triplets(name, a) for name, a in files.items()})

    def with_(self, changes: Mapping[str, Any] | None = None, /, **keywords: Any) -> Scene:
        """The scene with some keys changed; everything else, and the comments, stay.

        Keys are paths: ``with_({"contact.gap": 1.2, "load[0].amplitude": 0.1})``, or with two underscores for the point:
        ``with_(contact__gap=1.2)``. None removes a key.
        """
        pairs = [*(changes or {}).items(), *((k.replace("__", "."), v) for k, v in keywords.items())]
        changed = self._scene.changed([(k, None if v is None else _toml.value(v)) for k, v in pairs])
        return Scene._of(changed, self._matrices)

    def save(self, path: ScenePath, overwrite: bool = False) -> Path:
        """Write the scene as TOML, and matrices that were given with it beside it; the path."""
        path = Path(os.fsdecode(path))
        named = [str(f) for f in self._scene.files()]
        if named and path.resolve().parent != self.file.resolve().parent:
            raise SceneError(
                f"the scene names files ({', '.join(named)}), relative to its folder", "save it there, or copy them and change their keys"
            )
        names = {name: f"{path.stem}-{name.removeprefix('given ')}.mtx" for name in self._matrices}
        text = self.text
        for name, file in names.items():
            text = text.replace(f'"{name}"', _toml.value(file))
        texts = {path: text} | {path.parent / names[name]: text for name, text in self._scene.matrices().items()}
        there = [str(p) for p in texts if p.exists()]
        if there and not overwrite:
            raise FileExistsError(f"{', '.join(there)}: there already; give another name, or overwrite=True")
        for p, text in texts.items():
            p.write_text(text, encoding="utf-8")
        return path

    @property
    def text(self) -> str:
        """The scene as TOML."""
        return self._scene.text

    @property
    def file(self) -> Path:
        """Where it was read from; a name that messages use where it was not."""
        return Path(self._scene.file)

    @property
    def title(self) -> str:
        """Its title, or the name of its file."""
        return self._scene.title

    def to_dict(self) -> dict[str, Any]:
        """Its tables and keys, as ``Scene`` takes them."""
        return json.loads(self._scene.tables())

    def __getitem__(self, key: str) -> Any:
        """The value of a key: ``scene["contact.gap"]``, ``scene["load[0].amplitude"]``."""
        value: Any = self.to_dict()
        for part in key.split("."):
            name, _, index = part.partition("[")
            try:
                value = value[name]
                value = value[int(index.rstrip("]"))] if index else value
            except (KeyError, IndexError, TypeError, ValueError):
                raise KeyError(f"the scene has no {key}") from None
        return value

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scene):
            return NotImplemented
        return self.text == other.text and self._scene.matrices() == other._scene.matrices()

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"<Scene {self.title!r}>"

    def _repr_html_(self) -> str:
        from . import _html

        tables = self.to_dict()
        body, contact = tables.get("body", {}), tables.get("contact", {})
        facts = [("file", self.file.name)]
        if isinstance(body, dict):
            facts.append(("body", " ".join(str(body[k]) for k in ("kind", "size", "elements", "file") if k in body)))
        if isinstance(contact, dict):
            facts.append(("contact", ", ".join(f"{k} {contact[k]}" for k in ("edge", "group", "method", "gap", "friction") if k in contact)))
        return _html.table(f"Scene: {self.title}", facts) + _html.folded("all of it", self.text)

    def __reduce__(self) -> Any:
        return (Scene._given, (self.text, str(self.file), self._matrices))


def _rows(contact: Any, matrix: Any) -> list[int]:
    rows = np.atleast_1d(np.asarray(contact))
    if rows.dtype == bool:
        if rows.shape != (matrix.shape[0],):
            raise SceneError(f"contact: a mask of shape {rows.shape} for {matrix.shape[0]} rows")
        rows = np.flatnonzero(rows)
    if rows.size and not np.issubdtype(rows.dtype, np.integer):
        raise TypeError("contact: give row numbers (integers), or a mask")
    return [int(i) for i in rows]


def _triplets(name: str, a: Any) -> tuple[tuple[int, int], Any, Any, Any]:
    if hasattr(a, "tocoo"):
        a = a.tocoo()
        rows, columns, values, shape = a.row, a.col, a.data, a.shape
    else:
        a = np.asarray(a, dtype=float)
        if a.ndim != 2:
            raise SceneError(f"{name}: give a matrix, not an array of {a.ndim} dimensions")
        rows, columns = np.nonzero(a)
        values, shape = a[rows, columns], a.shape
    if np.iscomplexobj(values):
        raise SceneError(f"{name}: give a real matrix")
    return (
        (int(shape[0]), int(shape[1])),
        np.ascontiguousarray(rows, dtype=np.int64),
        np.ascontiguousarray(columns, dtype=np.int64),
        np.ascontiguousarray(values, dtype=np.float64),
    )


def as_scene(scene: Scene | ScenePath | Mapping[str, Any]) -> Scene:
    """A scene from whatever a function takes for one."""
    return scene if isinstance(scene, Scene) else Scene(scene)
