"""Many scenes by one function, on processes."""

from __future__ import annotations

import hashlib
import itertools
import json
import multiprocessing
import operator
import os
import signal
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union, overload

import numpy as np

from . import _commands
from ._errors import SignoriniError
from ._files import scratch, _remove
from ._progress import Progress, Shown
from ._results import AnyResult, Result, Verdict
from ._results import open as open_results
from ._scene import Scene, as_scene
from ._tables import needs

if TYPE_CHECKING:
    import pandas

#: What a scene may be carried out by.
FUNCTIONS = ("run", "orbit", "backbone", "response", "curve", "basins", "diagram", "phase_resonance", "tori")


class Failure:
    """Why there is no result: ``bool(failure)`` is False."""

    def __init__(self, error: str):
        self.error = error

    def __bool__(self) -> bool:
        return False

    def __repr__(self) -> str:
        return f"<Failure: {self.error}>"


Outcome = Union[AnyResult, Verdict, Failure]


def _alone() -> None:
    """A process of a sweep computes on one thread: the sweep has the processors. Ctrl-C is for who called."""
    os.environ["RAYON_NUM_THREADS"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _one(function: str, scene: Scene, path: str, options: dict[str, Any]) -> dict[str, Any]:
    """Carry out one scene; what is left beside its file. The file is whole before it has its name."""
    part = f"{path.removesuffix('.h5')}-{os.getpid()}.part.h5"
    try:
        found = getattr(_commands, function)(scene, output=part, force=True, progress=False, **options)
    except (SignoriniError, FileExistsError) as e:
        return {"error": str(e)}
    if isinstance(found, Verdict):
        return {"verdict": found._said}
    said = {k: v for k, v in found._said.items() if isinstance(v, (bool, int, float, str)) or v is None}
    os.replace(part, path)
    return {"said": said}


def _known(path: Path) -> dict[str, Any] | None:
    """What an earlier sweep left of a scene; nothing where it is damaged, or was a failure of circumstance."""
    try:
        outcome = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        if "verdict" in outcome:
            return {"verdict": Verdict(outcome["verdict"])._said}
        open_results(path)
        return {"said": dict(outcome["said"])}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, SignoriniError):
        return None


def _plain(x: Any) -> Any:
    """A value as a cell of a table."""
    if isinstance(x, np.generic):
        return x.item()
    return x if isinstance(x, (int, float, str, bool)) or x is None else str(x)


class Sweep:
    """What ``sg.sweep`` computed: one outcome a combination of values, the last key fastest.

    Attributes:
        keys: the keys that were varied.
        values: a dict of them for each outcome.
        folder: where the files are.

    ``sweep[k]`` and ``for outcome in sweep`` give results (read when they are asked for), a ``Verdict``, or a ``Failure`` with its ``error``.
    """

    def __init__(self, values: list[dict[str, Any]], outcomes: list[dict[str, Any]], paths: list[Path], owned: str | None):
        self.values, self._outcomes, self._paths = values, outcomes, paths
        self.keys: list[str] = list(values[0]) if values else []
        self.folder: Path = paths[0].parent
        self._is_owner = owned is not None
        if owned is not None:
            weakref.finalize(self, _remove, owned, os.getpid())

    def __getstate__(self) -> dict[str, Any]:
        if self._is_owner:
            raise TypeError("a sweep without a folder cannot be sent: give it one (folder=...)")
        return self.__dict__

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, k: int) -> Outcome: ...
    @overload
    def __getitem__(self, k: slice) -> list[Outcome]: ...
    def __getitem__(self, k: int | slice) -> Outcome | list[Outcome]:
        if isinstance(k, slice):
            return [self[i] for i in range(len(self))[k]]
        try:
            k = range(len(self))[operator.index(k)]
        except IndexError:
            raise IndexError(f"outcome {k} of {len(self)}") from None
        outcome = self._outcomes[k]
        if "error" in outcome:
            return Failure(outcome["error"])
        if "verdict" in outcome:
            return Verdict(outcome["verdict"])
        result = open_results(self._paths[k])
        result._said = outcome["said"]
        # a folder that nobody named lives as long as what is read from it, and its files go along where that goes
        result._store.owner = self if self._is_owner else None
        return result

    def __iter__(self) -> Iterator[Outcome]:
        return (self[k] for k in range(len(self)))

    def to_pandas(self, **columns: Callable[[Any], Any]) -> pandas.DataFrame:
        """A row an outcome: the values that were varied, and of each result what a function of it gives: ``force=lambda r: r.forces.maximum[r.forces.kind == "contact"].max()``.

        Without functions: the numbers that the command said. Where there is no result, nothing; ``outcome`` says why.
        """
        try:
            import pandas
        except ImportError as e:
            raise needs("pandas", "to_pandas") from e
        taken = {*self.keys, "outcome"} & columns.keys()
        if taken:
            raise ValueError(f"{', '.join(sorted(taken))}: a column of that name is there")
        rows: list[dict[str, Any]] = []
        for k, values in enumerate(self.values):
            outcome = self[k]
            row: dict[str, Any] = {key: _plain(x) for key, x in values.items()}
            if isinstance(outcome, Result):
                said = {n: x for n, x in outcome._said.items() if isinstance(x, (int, float)) and n != "wall_s"}
                row |= {name: of(outcome) for name, of in columns.items()} if columns else said
            row["outcome"] = outcome.status if isinstance(outcome, Result) else outcome.verdict if isinstance(outcome, Verdict) else outcome.error
            rows.append(row)
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        found = sum("said" in o for o in self._outcomes)
        return f"<Sweep over {', '.join(self.keys)}: {found} results of {len(self)}>"

    def _repr_html_(self) -> str:
        from . import _html

        try:
            numbers = self.to_pandas().drop(columns="outcome", errors="ignore")
            return _html.table(repr(self)[1:-1], []) + numbers.iloc[:, :12]._repr_html_()  # type: ignore[operator]
        except ImportError:
            return _html.table(repr(self)[1:-1], [])


def sweep(
    scene: _commands.AnyScene,
    over: Mapping[str, Sequence[Any]],
    function: Callable[..., Any] | str = "run",
    /,
    *,
    folder: str | PathLike[str] | None = None,
    workers: int | None = None,
    side_by_side: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Sweep:
    """Carry out a scene with every combination of values of its keys, each in a process of its own.

    Args:
        over: keys of the scene with the values that they take: ``{"contact.gap": [0.1, 0.2], "load[0].amplitude": [1.0, 2.0]}``.
        function: ``sg.run``, ``sg.orbit``, ``sg.backbone``, ``sg.response``, ... or its name.
        folder: keep the files there; called again with more values it computes what is missing. Left out, files live as long as the sweep.
        workers: processes at a time [default: as many as there are processors].
        side_by_side: the lists go together, first with first, in place of every combination.
        progress: as for ``run``.
        options: of the function, ``over`` of ``curve`` and its like among them.

    Returns:
        Sweep: its outcomes in the order of the values, whatever the order in which they were computed.

    Raises:
        SceneError: where a scene cannot be read, before anything is computed. What is found out later (a gap that the body is beyond) is a ``Failure``.

    In a script, processes are started anew: what calls this stands under ``if __name__ == "__main__":``.
    """
    name = function if isinstance(function, str) else getattr(function, "__name__", "")
    if name not in FUNCTIONS:
        raise TypeError(f"function: give one of {', '.join(FUNCTIONS)}")
    lists = [list(values) for values in over.values()]
    if not lists or not all(lists):
        raise ValueError("over: give keys of the scene, each with a list of values")
    if side_by_side and len({len(values) for values in lists}) > 1:
        raise ValueError("over: lists that go side by side have one length")
    own = {"output", "force", "resume", "progress", "threads"} & options.keys()
    if own:
        raise TypeError(f"{', '.join(sorted(own))}: the sweep says that itself; a folder keeps its files")
    if workers is not None and workers < 1:
        raise ValueError("workers: at least one")
    combined = zip(*lists) if side_by_side else itertools.product(*lists)
    values = [dict(zip(over, combination)) for combination in combined]
    scene = as_scene(scene)
    scenes = [scene.with_(value) for value in values]
    names = [f"{name}-{_digest(name, s, options)}.h5" for s in scenes]
    owned: str | None = None
    if folder is None:
        path, owned = scratch("sweep")
        folder = Path(path)
    try:
        return _carried_out(name, (scene, scenes, values), (Path(os.fsdecode(folder)).absolute(), names, owned), workers, progress, options)
    except BaseException:
        if owned is not None:
            _remove(owned, os.getpid())
        raise


def _carried_out(
    name: str,
    what: tuple[Scene, list[Scene], list[dict[str, Any]]],
    where: tuple[Path, list[str], str | None],
    workers: int | None,
    progress: Progress,
    options: dict[str, Any],
) -> Sweep:
    (scene, scenes, values), (folder, names, owned) = what, where
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / file for file in names]
    outcomes: dict[Path, dict[str, Any]] = {}
    for path in dict.fromkeys(paths):
        known = _known(path)
        if known is not None:
            outcomes[path] = known
    missing = {p: s for p, s in zip(paths, scenes) if p not in outcomes}
    count = min(workers or os.cpu_count() or 1, max(len(missing), 1))
    waiting = iter(missing.items())
    pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), initializer=_alone)
    with Shown(progress, f"{name} {scene.title}") as shown:
        try:
            # no more than are computed at a time: what is interrupted begins nothing more
            running = {pool.submit(_one, name, s, str(p), options): p for p, s in itertools.islice(waiting, count)}
            while running:
                done, _ = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    path = running.pop(future)
                    outcomes[path] = future.result()
                    if "error" not in outcomes[path]:
                        part = path.with_suffix(f".{os.getpid()}.part")
                        part.write_text(json.dumps(outcomes[path]), encoding="utf-8")
                        part.replace(path.with_suffix(".json"))
                    running |= {pool.submit(_one, name, s, str(p), options): p for p, s in itertools.islice(waiting, 1)}
                if shown.tell is not None:
                    shown.tell(len(outcomes) / len(set(paths)), f"{len(outcomes)} of {len(set(paths))}")
        except BrokenProcessPool as e:
            why = 'a process of the sweep ended. In a script the call stands under if __name__ == "__main__":, because processes read the script anew'
            raise SignoriniError(f"{why}; what is done is kept where a folder is named") from e
        except BaseException:
            for process in list((pool._processes or {}).values()):
                process.terminate()
                process.join(5.0)
                for left in folder.glob(f"{name}-*-{process.pid}.part.h5*"):
                    left.unlink(missing_ok=True)
            raise
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return Sweep(values, [outcomes[p] for p in paths], paths, owned)


def _digest(name: str, scene: Scene, options: Mapping[str, Any]) -> str:
    """What a file of results is named by: all that it depends on."""
    digest = hashlib.sha256()

    def add(x: Any) -> None:
        if isinstance(x, np.ndarray):
            add(["array", str(x.dtype), list(x.shape)])
            digest.update(np.ascontiguousarray(x).tobytes())
        elif isinstance(x, np.generic):
            add(x.item())
        elif isinstance(x, Mapping):
            for key in sorted(x):
                add([key, x[key]])
        elif isinstance(x, (list, tuple)):
            digest.update(f"[{len(x)}".encode())
            for part in x:
                add(part)
        elif isinstance(x, Result):
            digest.update(x.path.read_bytes())
        elif isinstance(x, (bool, int, float, str, PathLike)) or x is None:
            digest.update(f"{type(x).__name__}:{os.fspath(x) if isinstance(x, PathLike) else x!r};".encode())
            if isinstance(x, (str, PathLike)) and os.path.isfile(x):
                digest.update(Path(x).read_bytes())
        else:
            raise TypeError(f"{type(x).__name__} is no value of an option in a sweep: give numbers, texts, arrays, lists of them, or results")

    add([name, scene.text, scene._scene.matrices(), options])
    for file in scene._scene.files():
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:16]
