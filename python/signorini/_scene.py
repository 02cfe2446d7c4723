"""Scenes: what is computed, as a file, a dict, or matrices of another program."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
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

    __slots__ = ("_scene",)

    def __init__(self, source: ScenePath | Mapping[str, Any]):
        if isinstance(source, Mapping):
            self._scene = _Scene(_toml.document(source), "scene.toml")
        elif isinstance(source, (str, PathLike)):
            self._scene = _Scene.read(fspath(source))
        else:
            raise TypeError("give the path of a scene, or a dict")

    @classmethod
    def _of(cls, scene: _Scene) -> Scene:
        new = cls.__new__(cls)
        new._scene = scene
        return new

    @classmethod
    def parse(cls, text: str, file: ScenePath = "scene.toml") -> Scene:
        """A scene from its text; ``file`` is its name in messages, and its folder that of the files it names."""
        return cls._of(_Scene(text, fspath(file)))

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
            contact: the displacements that the obstacle limits (row numbers from 0), [n_C]; positive towards it.
            gap: their distance from the obstacle, a length or one each, [n_C].
            N_C, N_O: the contact stresses of the nodal boundary method, lambda = N_C u_C + N_O u_O, [n_C, n_C] and
                [n_C, N - n_C]; u_O are all other displacements in their order. Left out: the stress is the nodal reaction
                (``stress = "reaction"``), for which the matrices suffice.
            C: damping, a combination of M and K, [N, N].
            stress: other forms of ``[contact] stress``.
            tables: further tables of the scene, as ``initial={"mode": 1, "amplitude": -1.1}``,
                ``run={"until": 10.0}``, ``orbit={"omega": 1.8}``; ``contact={...}`` entries as
                ``contact_table={"method": "mass-redistribution"}``.

        Units are those of the matrices. ``scene.save(path)`` writes the scene with its matrices beside it, for the command line.
        """
        files: dict[str, Any] = {"M.mtx": M, "K.mtx": K}
        body = {"kind": "matrices", "mass_matrix": "M.mtx", "stiffness_matrix": "K.mtx"}
        table: dict[str, Any] = {"displacements": [int(i) for i in np.atleast_1d(contact)]}
        gaps = np.asarray(gap, dtype=float)
        table["gap" if gaps.ndim == 0 else "gaps"] = float(gaps) if gaps.ndim == 0 else gaps
        if (N_C is None) != (N_O is None):
            raise SceneError("N_C and N_O belong together: give both, or none for the nodal reaction")
        if N_C is not None:
            files |= {"N_C.mtx": N_C, "N_O.mtx": N_O}
            table |= {"n_c": "N_C.mtx", "n_o": "N_O.mtx"}
        else:
            table["stress"] = "reaction" if stress is None else stress
        if C is not None:
            files["C.mtx"] = C
            body["damping_matrix"] = "C.mtx"
        table |= tables.pop("contact_table", {})
        text = _toml.document({"title": title, "body": body, "contact": table, **tables})
        return cls._of(_Scene(text, "scene.toml", {name: _triplets(name, a) for name, a in files.items()}))

    def with_(self, changes: Mapping[str, Any] | None = None, /, **keywords: Any) -> Scene:
        """The scene with some keys changed; everything else, and the comments, stay.

        Keys are paths: ``with_({"contact.gap": 1.2, "load[0].amplitude": 0.1})``, or with two underscores for the point:
        ``with_(contact__gap=1.2)``. None removes a key.
        """
        pairs = [*(changes or {}).items(), *((k.replace("__", "."), v) for k, v in keywords.items())]
        return Scene._of(self._scene.changed([(k, None if v is None else _toml.value(v)) for k, v in pairs]))

    def save(self, path: ScenePath, overwrite: bool = False) -> Path:
        """Write the scene as TOML, and its matrices beside it; the path."""
        path = Path(path)
        texts = {path: self.text} | {path.parent / name: text for name, text in self._scene.matrices().items()}
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

    def __repr__(self) -> str:
        return f"<Scene {self.title!r}>"

    def __reduce__(self) -> Any:
        matrices = self._scene.matrices()
        if matrices:
            raise TypeError("a scene with matrices is not pickled: save it, and read it where it is needed")
        return (Scene.parse, (self.text, str(self.file)))


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
