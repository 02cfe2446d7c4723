"""Files of results as objects: groups whose datasets and attributes are read when they are asked for."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Union

import numpy as np

from . import _signorini

PathOrText = Union[str, "PathLike[str]"]


class Store:
    """A file; one that nobody named goes with the last object that reads it."""

    def __init__(self, path: PathOrText, folder: str | None = None):
        self.path = Path(path)
        if folder is not None:
            self._finalizer = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)


def scratch(name: str) -> tuple[str, str]:
    """A path of that name in a folder of its own, and the folder."""
    folder = tempfile.mkdtemp(prefix="signorini-")
    return os.path.join(folder, name), folder


class Group:
    """A group of a file: its datasets (NumPy arrays, read once, when asked for) and attributes by name.

    ``dir(group)`` and ``group.keys()`` list the names; ``group["a/b"]`` reads a dataset further down.
    """

    def __init__(self, store: Store, name: str):
        self._store, self._name, self._read = store, name, {}

    def _attributes(self) -> dict[str, Any]:
        if "" not in self._read:
            self._read[""] = dict(_signorini.attributes(fspath(self._store.path), self._name))
        return self._read[""]

    def _entries(self) -> dict[str, Any]:
        if "/" not in self._read:
            self._read["/"] = dict(_signorini.entries(fspath(self._store.path), self._name))
        return self._read["/"]

    def _path(self, name: str) -> str:
        return f"{self._name}/{name}" if self._name else name

    def keys(self) -> list[str]:
        """Names of groups, datasets and attributes."""
        return sorted({*self._entries(), *self._attributes()})

    def __contains__(self, name: object) -> bool:
        return name in self._entries() or name in self._attributes()

    def __getitem__(self, name: str) -> Any:
        if name in self._read:
            return self._read[name]
        if "/" in name:
            first, rest = name.split("/", 1)
            return self[first][rest]
        if name in self._entries():
            is_group = self._entries()[name] is None
            whole = self._path(name)
            value = Group(self._store, whole) if is_group else array(_signorini.read(fspath(self._store.path), whole))
        elif name in self._attributes():
            value = self._attributes()[name]
        else:
            raise KeyError(f"{self._store.path} holds no /{self._path(name)}; there are {', '.join(self.keys())}")
        self._read[name] = value
        return value

    def get(self, name: str, default: Any = None) -> Any:
        """What has a name, or something else if there is nothing."""
        return self[name] if name in self else default

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as e:
            raise AttributeError(e.args[0]) from None

    def __dir__(self) -> Iterator[str]:
        return iter([*super().__dir__(), *self.keys()])

    def __repr__(self) -> str:
        return f"<Group /{self._name} of {self._store.path.name}: {', '.join(self.keys())}>"

    def to_dict(self) -> dict[str, Any]:
        """All of it, groups as dicts."""
        return {k: v.to_dict() if isinstance(v := self[k], Group) else v for k in self.keys()}

    def rows(self, *names: str) -> np.recarray:
        """Columns side by side: ``table.t`` is a column, ``table[0]`` a row."""
        return np.rec.fromarrays([self[n] for n in names], names=list(names))


def array(value: Any) -> Any:
    """Words as an array of texts; arrays as they are."""
    return np.array(value, dtype=str) if isinstance(value, list) else value
