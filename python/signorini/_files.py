"""Files of results as objects: groups whose datasets and attributes are read when they are asked for."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any, Union

import numpy as np

from . import _signorini
from ._errors import FileError

PathOrText = Union[str, "PathLike[str]"]


class Store:
    """A file; one that nobody named goes with the last object that reads it."""

    def __init__(self, path: PathOrText, folder: str | None = None):
        self.path, self._folder = Path(os.fsdecode(path)), folder
        #: Who keeps the file, where that is not this object.
        self.owner: Any = None
        self._version = self._stat()
        if folder is not None:
            weakref.finalize(self, _remove, folder, os.getpid())

    def _stat(self) -> tuple[int, int, int]:
        s = os.stat(self.path)
        return (s.st_ino, s.st_size, s.st_mtime_ns)

    def name(self) -> str:
        """The path, as long as the file is the one that was opened."""
        if self._stat() != self._version:
            raise FileError(f"{self.path} was written anew since it was opened: sg.open reads what it holds now")
        return os.fspath(self.path)

    def __getstate__(self) -> dict[str, Any]:
        # a file that nobody named goes along
        data = self.path.read_bytes() if self._folder is not None or self.owner is not None else None
        return {"path": str(self.path), "data": data}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if state["data"] is None:
            self.__init__(state["path"])  # type: ignore[misc]
            return
        path, folder = scratch(os.path.basename(state["path"]))
        Path(path).write_bytes(state["data"])
        self.__init__(path, folder)  # type: ignore[misc]


def _remove(folder: str, owner: int) -> None:
    # a forked process is not the owner
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


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
            self._read[""] = dict(_signorini.attributes(self._store.name(), self._name))
        return self._read[""]

    def _entries(self) -> dict[str, Any]:
        if "/" not in self._read:
            self._read["/"] = dict(_signorini.entries(self._store.name(), self._name))
        return self._read["/"]

    def _path(self, name: str) -> str:
        return f"{self._name}/{name}" if self._name else name

    def keys(self) -> list[str]:
        """Names of groups, datasets and attributes."""
        return sorted({*self._entries(), *self._attributes()})

    def __contains__(self, name: object) -> bool:
        try:
            self[name]  # type: ignore[index]
        except (KeyError, TypeError):
            return False
        return True

    def __iter__(self) -> Iterator[Any]:
        raise TypeError(f"{type(self).__name__} is not iterable: keys() has its names")

    def __getitem__(self, name: str) -> Any:
        if not isinstance(name, str):
            raise TypeError(f"{type(self).__name__} has names, not {type(name).__name__}: {', '.join(self.keys())}")
        name = name.strip("/")
        if name in self._read:
            return self._read[name]
        if "/" in name:
            first, rest = name.split("/", 1)
            return self[first][rest]
        if name in self._entries():
            is_group = self._entries()[name] is None
            whole = self._path(name)
            value = Group(self._store, whole) if is_group else array(_signorini.read(self._store.name(), whole))
        elif name in self._attributes():
            value = self._attributes()[name]
        else:
            raise KeyError(f"{self._store.path} holds no /{self._path(name)}{_near(name, self.keys())}")
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

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.keys()})

    def __repr__(self) -> str:
        return f"<Group /{self._name} of {self._store.path.name}: {', '.join(self.keys())}>"

    def to_dict(self) -> dict[str, Any]:
        """All of it, groups as dicts."""
        return {k: v.to_dict() if isinstance(v := self[k], Group) else v for k in self.keys()}

    def table(self) -> np.recarray:
        """All columns of one number or word a row, side by side: ``table.t`` is a column, ``table[0]`` a row."""
        first = ("t", "node", "point", "kind", "monitor", "from", "to", "energy_jump", "monitor_rate")
        columns = {n for n, shape in self._entries().items() if shape is not None and len(shape) == 1}
        names = [n for n in first if n in columns] + sorted(columns.difference(first))
        return np.rec.fromarrays([self[n] for n in names], names=names)


def _near(name: str, names: list[str]) -> str:
    """What could be meant."""
    import difflib

    near = difflib.get_close_matches(name, names, 3)
    return f"; did you mean {' or '.join(near)}?" if near else f"; there are {', '.join(names)}"


def array(value: Any) -> Any:
    """Words as an array of texts; arrays as they are."""
    return np.array(value, dtype=str) if isinstance(value, list) else value
