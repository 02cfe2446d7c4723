"""The commands as functions. Every option of the command line can be given as a keyword, with underscores: ``locate=True``, ``form="acceleration"``."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike, fspath
from typing import Any, Union

import numpy as np

from . import _signorini
from ._errors import SceneError
from ._files import Store, scratch
from ._progress import Progress, Shown
from ._results import Bands, Basins, Comparison, Crosscheck, Curves, Diagram, Family, Modes, Orbit, OrbitFound, PhaseResonance, Result, Run, Tori, Trust, Verdict, load
from ._results import open as open_results
from ._scene import Scene, ScenePath, as_scene

AnyScene = Union[Scene, ScenePath, Mapping[str, Any]]
Output = Union[str, "PathLike[str]", None]


def _word(x: Any) -> str:
    if isinstance(x, (bool, np.bool_)):
        return "true" if x else "false"
    if isinstance(x, (float, np.floating)):
        return repr(float(x))
    return fspath(x) if isinstance(x, PathLike) else str(x)


def _list(x: Any) -> str:
    return ",".join(_word(v) for v in x) if isinstance(x, (list, tuple, np.ndarray, range)) else _word(x)


class _Again(list):
    """Values of an option that is given once for each."""


def _arguments(options: Mapping[str, Any]) -> list[str]:
    """Keywords as options of the command line; None and False are left out."""
    words = []
    for name, x in options.items():
        option = "--" + name.strip("_").replace("_", "-")
        if x is None or x is False:
            continue
        # one word, so that a number below zero is no option
        words += [option if v is True else f"{option}={_list(v)}" for v in (x if isinstance(x, _Again) else [x])]
    return words


def _call(
    command: str,
    scene: Scene,
    places: Sequence[str],
    options: Mapping[str, Any],
    progress: Progress,
    is_scratch: bool = False,
) -> tuple[dict[str, Any], str | None]:
    """The JSON object of a command, and why the numerics failed, if they did."""
    words = [command, *_arguments(options), "--", *places]
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise TypeError("progress: give None, a bool, or a function of the share that is done and what is being done")
    try:
        with Shown(progress, f"{command} {scene.title}") as shown:
            text, failure, heard = _signorini.call(words, scene._scene, is_scratch, shown.tell)
    except SceneError as e:
        raise _reworded(command, e) from None
    except KeyboardInterrupt as e:
        kept = str(e).replace("with the same command and --resume", "with the same call and resume=True")
        nothing = "interrupted; name an output to keep what is computed, and to go on with it"
        raise KeyboardInterrupt(nothing if is_scratch else kept) from None
    _warn(heard)
    return json.loads(text), failure


#: Options that are either given or not.
_FLAGS = {"force", "resume", "all", "full", "viscous", "quick", "locate", "shoot", "orbit", "force-large"}


def _reworded(command: str, e: SceneError) -> Exception:
    """Options of the command line as the keywords that they are here."""
    message = e.message
    if message.startswith("error: "):
        message = message.removeprefix("error: ").split("\n\n")[0]
        unknown = re.match(r"unexpected argument '--([\w-]+)", message)
        if unknown:
            return TypeError(f"{command}() got an unexpected keyword argument {unknown[1].replace('-', '_')!r}")
        message = re.sub(r" <[^>]*>", "", message)

    def keyword(m: re.Match[str]) -> str:
        name = m[1].replace("-", "_")
        return f"{name}=True" if m[1] in _FLAGS else name

    words = [re.sub(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)", keyword, text).replace(" -o,", " output,") for text in (message, e.help)]
    words = [re.sub(r" with -o\b", "", text) for text in words]
    return SceneError(*words, (e.file, e.line, e.column, e.key))


def _warn(heard: Iterable[str]) -> None:
    """Warn at the line of the first caller outside of this package."""
    depth, frame = 1, sys._getframe()
    while frame is not None and frame.f_globals.get("__package__") == __package__:
        depth, frame = depth + 1, frame.f_back
    for warning in heard:
        warnings.warn(warning, stacklevel=depth)


def _to_file(
    command: str,
    scene: AnyScene,
    output: Output,
    options: dict[str, Any],
    progress: Progress,
    before: Sequence[str] = (),
    ending: str = "",
    scene_file: bool = True,
) -> tuple[dict[str, Any], str | None, Store | None]:
    """Carry out a command that writes a file: the user's, or one that goes with the result; ``ending`` is what the command adds to its name; some read the scene out
    of a file of results."""
    scene = as_scene(scene)
    folder = None
    if output is None:
        if options.get("resume"):
            raise SceneError("resume goes on with a file: say which, with output")
        named, folder = scratch(command if ending else f"{command}.h5")
    else:
        named = os.fsdecode(output)
    path = named + ending
    places = [*before, fspath(scene.file)] if scene_file else [*before]
    try:
        said, failure = _call(command, scene, places, options | {"output": named}, progress, folder is not None)
        if os.path.exists(path):
            store, folder = Store(path, folder), None
            return said, failure, store
        return said, failure, None
    finally:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)


def _result(said: dict[str, Any], failure: str | None, store: Store | None) -> Any:
    assert store is not None, failure
    return load(store, {**said, "failure": failure})


def run(
    scene: AnyScene,
    output: Output = None,
    *,
    verify_lcp: bool = False,
    lyapunov: int | None = None,
    lyapunov_periods: int | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Run:
    """Integrate a scene from switch to switch of the active set, as its ``[run]`` table says.

    Args:
        scene: a ``Scene``, the path of one, or a dict.
        output: keep the results in this file while they are computed (an interrupted run can be gone on with); left out, they
            live as long as the object, and ``save`` keeps them.
        verify_lcp: compare every stored contact solution with enumeration and an interior-point method.
        lyapunov: so many Lyapunov exponents of the motion from the end of the run on, over ``lyapunov_periods`` periods of the loads [default: 1000].
        resume: go on with an interrupted run in ``output``.
        force: replace ``output`` if this program made it.
        progress: None: shown in a terminal or a notebook; False: never; or a function of the share done and what is being done.

    Returns:
        Run: complete, or as far as the numerics came: ``status`` and ``verdict`` say so.

    Raises:
        SceneError: bad input, with file, line and key.
        KeyboardInterrupt: Ctrl-C; what was computed is in ``output``.

    Example:
        >>> r = sg.run("scenarios/plate.toml")          # doctest: +SKIP
        >>> r.energy_drift, len(r.switches), r.u.shape   # doctest: +SKIP
    """
    options |= {"verify_lcp": verify_lcp, "resume": resume, "force": force}
    options |= {"lyapunov": lyapunov, "lyapunov_periods": lyapunov_periods}
    return _result(*_to_file("run", scene, output, options, progress))


def modes(scene: AnyScene, count: int = 8) -> Modes:
    """Natural modes of the open body and of the closed one: ``modes.open.omega`` [k], ``modes.open.shapes`` [k, n_o]."""
    scene = as_scene(scene)
    said, _ = _call("modes", scene, [fspath(scene.file)], {"count": count}, False)
    return Modes(said)


def trust(scene: AnyScene, *, orbit: bool = False, omega: float | None = None, progress: Progress = None) -> Trust:
    """The same scene on a finer mesh, or with elements of second order, and with the other discretisation of the contact: what moves, and by how much.

    Args:
        orbit: also the periodic motion at the frequency of the scene's [orbit], or of its loads; ``omega``: at this one.
    """
    scene = as_scene(scene)
    said, _ = _call("trust", scene, [fspath(scene.file)], {"orbit": orbit, "omega": omega}, progress)
    return Trust(said)


def orbit(
    scene: AnyScene,
    omega: float | None = None,
    output: Output = None,
    *,
    period: float | None = None,
    viscous: bool = False,
    beta: float | None = None,
    amplitude: float | None = None,
    near_return: Output | Run = None,
    periods: int = 1,
    sensitivity: str | Iterable[str] | None = None,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Orbit | Verdict:
    """One periodic orbit by shooting, with its Floquet multipliers and its motion over a period.

    Args:
        omega: circular frequency [default: the scene's]; or ``period``.
        viscous: the viscous nonlinear mode: C = beta K, kept going by -alpha M, alpha unknown; ``beta`` is a time.
        amplitude: start from the first mode of the open body at this amplitude over grazing, in place of the scene's state.
        near_return: a ``Run`` or its file: start from its best near-return (of a forced body: after ``periods`` of the loads).
        periods: periods of the loads in one of the orbit.
        sensitivity: keys of the scene by whose numbers the orbit is differentiated (``"contact.gap"``, ``"load[0].amplitude"``, ``"omega"``): ``orbit.sensitivity``.
        output, force, progress: as for ``run``.

    Returns:
        Orbit, or a Verdict (``bool(verdict)`` is False) that names why there is none: fold, grazing, not found ... Then nothing is
        written, and what stood in ``output`` stays.
    """
    # a result without a name lives as long as it is held
    held = near_return
    if isinstance(near_return, Result):
        near_return = near_return.path
    options |= {"omega": omega, "period": period, "viscous": viscous, "beta": beta, "amplitude": amplitude}
    options |= {"near_return": near_return, "periods": periods, "force": force, "sensitivity": sensitivity or None}
    said, failure, store = _to_file("orbit", scene, output, options, progress)
    del held
    return _result(said, failure, store) if said["converged"] else Verdict(said)


def orbits(
    scene: AnyScene,
    omega: float | None = None,
    *,
    amplitudes: int = 16,
    largest: float = 4.0,
    progress: Progress = None,
    **options: Any,
) -> list[OrbitFound]:
    """All different orbits of one frequency that a set of starts leads to, by energy; others may exist.

    Args:
        omega: circular frequency [default: the scene's].
        amplitudes, largest: number of amplitudes of the first mode to start from, and the largest, over grazing.
    """
    scene = as_scene(scene)
    options |= {"all": True, "omega": omega, "amplitudes": amplitudes, "largest": largest}
    said, _ = _call("orbit", scene, [fspath(scene.file)], options, progress)
    return [OrbitFound(o) for o in said["orbits"]]


def backbone(
    scene: AnyScene,
    output: Output = None,
    *,
    range: tuple[float, float] | None = None,
    method: str = "shooting",
    harmonics: int | Iterable[int] | None = None,
    follow: str | None = None,
    step: float | None = None,
    viscous: bool = False,
    beta: float | None = None,
    quick: bool = False,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Family:
    """A family of periodic orbits, or of solutions of harmonic balance, by continuation.

    Args:
        range: lowest and highest circular frequency [default: ``range`` of ``[orbit]``].
        method: "shooting" (orbits), "hbm" (harmonic balance) or "bem" (bars).
        harmonics: number or numbers of harmonics, for "hbm" and "bem".
        follow: "sequential" (a grid, the default), "arclength" (through folds and grazings) or "natural".
        step: of the frequency on a grid, of arclength otherwise.
        viscous, beta: viscous nonlinear modes, which converge with the mesh; with an error statement unless ``quick``.
        resume: go on with an unfinished ``output``, or widen its range.
        output, force, progress: as for ``run``.
        options: ``locate``, ``points``, ``omega``, ``conservative_from``, ``form``, ``aft``, ``shoot`` as for the command line.

    Returns:
        Family: with frequencies without an orbit, and how each branch ended (``stops``).
    """
    options |= {"range": range, "method": method, "harmonics": _numbers(harmonics), "follow": follow, "step": step}
    options |= {"viscous": viscous, "beta": beta, "quick": quick, "resume": resume, "force": force}
    return _result(*_to_file("backbone", scene, output, options, progress))


def response(
    scene: AnyScene,
    output: Output = None,
    *,
    ratios: float | Iterable[float] | None = None,
    range: tuple[float, float] | None = None,
    method: str = "shooting",
    harmonics: int | Iterable[int] | None = None,
    step: float | None = None,
    doublings: Output | Family = None,
    sweep: str | None = None,
    dwell: int | None = None,
    through: Output | Family = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Family:
    """Forced response over a range of frequencies, stable and unstable branches, for one or several damping ratios.

    Args:
        ratios: damping ratios [default: those of the scene].
        doublings: a response of this scene (object or file): follow the orbits of twice the period from its period doublings.
        sweep: "up", "down" or "both": what the body settles to at each frequency from where it was, in place of a branch (``family.sweep``).
        dwell: sweeps: so many periods at each frequency, without waiting.
        through: a sweep of this scene (object or file): follow the branches through the orbits that it met.
        range, method, harmonics, step, resume, output, force, progress, options: as for ``backbone``.
    """
    held = (doublings, through)
    doublings, through = (f.path if isinstance(f, Result) else f for f in held)
    options |= {"ratios": ratios, "range": range, "method": method, "harmonics": _numbers(harmonics)}
    options |= {"step": step, "doublings": doublings, "sweep": sweep, "dwell": dwell, "through": through}
    options |= {"resume": resume, "force": force}
    result = _result(*_to_file("response", scene, output, options, progress))
    del held
    return result


def _over(over: Mapping[str, tuple[float, float]]) -> str:
    """A key with its range as the command line has it."""
    if len(over) != 1:
        raise SceneError("over: give one key with its range: {'contact.gap': (0.5, 2)}")
    [(key, ends)] = over.items()
    return f"{key}={_list(ends)}"


def curve(
    scene: AnyScene,
    of: str,
    over: Mapping[str, tuple[float, float]],
    output: Output = None,
    *,
    range: tuple[float, float] | None = None,
    response: Output | Family = None,
    ratio: float | None = None,
    step: float | None = None,
    points: int | None = None,
    force: bool = False,
    progress: Progress = None,
) -> Curves:
    """Where folds, period doublings, Neimark-Sacker points, grazings or peaks of a forced response lie over a number of its scene.

    Args:
        of: "fold", "doubling", "torus", "grazing" or "peak".
        over: the key of the number, and its range: ``{"load[0].amplitude": (0.5, 2)}``. Curves begin at its value in the scene.
        range: lowest and highest circular frequency [default: ``range`` of ``[orbit]``].
        response: a response of this scene (object or file) in which curves begin [default: one that is followed first].
        ratio: damping ratio [default: that of the scene].
        step, points: largest step of arclength, most points on either side of a start.
        output, force, progress: as for ``run``.
    """
    held = response
    if isinstance(response, Result):
        response = response.path
    options = {"of": of, "over": _over(over), "range": range, "response": response, "ratio": ratio}
    options |= {"step": step, "points": points, "force": force}
    result = _result(*_to_file("curve", scene, output, options, progress))
    del held
    return result


def basins(
    scene: AnyScene,
    output: Output = None,
    *,
    plane: Mapping[str, float | tuple[float, float]] | None = None,
    size: int | None = None,
    samples: int | None = None,
    seed: int | None = None,
    omega: float | None = None,
    ratio: float | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
) -> Basins:
    """From which states a forced body comes to which of its attractors, and the shares of their basins.

    Args:
        plane: coordinates of the states with their ranges, or with one value for all [default: ``{"q1": (-3, 3), "v1": (-3, 3)}``]: ``qK`` is the
            amplitude of mode K of the open body, 1 where the first contact point grazes, ``vK`` its velocity over its frequency.
        size: cells along each of two axes [default: 50].
        samples, seed: in place of cells so many states, drawn uniformly.
        omega: circular frequency of the loads [default: that of ``[orbit]``, or of the load].
        ratio: damping ratio [default: that of the scene].
        output, resume, force, progress: as for ``run``.
    """
    axes = None if plane is None else _Again(f"{name}={_list(ends)}" for name, ends in plane.items())
    options = {"plane": axes, "size": size, "samples": samples, "seed": seed, "omega": omega, "ratio": ratio}
    options |= {"resume": resume, "force": force}
    return _result(*_to_file("basins", scene, output, options, progress))


def diagram(
    scene: AnyScene,
    over: Mapping[str, tuple[float, float]],
    output: Output = None,
    *,
    steps: int | None = None,
    way: str | None = None,
    dwell: int | None = None,
    omega: float | None = None,
    ratio: float | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
) -> Diagram:
    """A bifurcation diagram: what a forced body settles to while a number of its scene goes up, or down.

    Args:
        over: the key of the number, and its range: ``{"contact.gap": (0.5, 2)}``.
        steps: from one end of the range to the other [default: 200]; changes between two values are closed in on.
        way: "up", "down" or "both" [default: "up"].
        dwell: so many periods of the loads at each value, without waiting until the body has settled.
        omega: circular frequency of the loads [default: that of ``[orbit]``, or of the load].
        ratio: damping ratio [default: that of the scene].
        output, resume, force, progress: as for ``run``.
    """
    options = {"over": _over(over), "steps": steps, "way": way, "dwell": dwell, "omega": omega, "ratio": ratio}
    options |= {"resume": resume, "force": force}
    return _result(*_to_file("diagram", scene, output, options, progress))


def phase_resonance(
    scene: AnyScene,
    over: Mapping[str, tuple[float, float]],
    output: Output = None,
    *,
    steps: int | None = None,
    omega: float | None = None,
    gains: tuple[float, float] | None = None,
    tolerance: float | None = None,
    noise: float | None = None,
    average: int | None = None,
    seed: int | None = None,
    ratio: float | None = None,
    sensitivity: str | Iterable[str] | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
) -> PhaseResonance:
    """A laboratory's test: the frequency is steered until the displacement lags a quarter of a period behind the loads, value by value of one of them.

    Args:
        over: the key of the number, mostly the size of a load, and its range: ``{"load[0].amplitude": (0.05, 0.5)}``.
        steps: from one end of the range to the other [default: 20].
        omega: circular frequency to begin with [default: that of mode 1 of the body at rest].
        gains: of the loop, of frequency over radians: the proportional one, and that of the sum [default: from the decay of the mode next to ``omega``].
        tolerance: the loop is at rest where the lag is as near as this to a quarter turn, in radians [default: 1e-6].
        noise: standard deviation of what each period's readings are off by, relative, and of the lag in radians [default: 0]; seed, that of the noise.
        average: periods that are averaged over at each value [default: with noise 200, or 30 times as many as the body takes to settle; else 1].
        ratio: damping ratio [default: that of the scene].
        sensitivity: keys of the scene by whose numbers frequency, amplitude and work are differentiated at phase resonance, exactly: ``result.sensitivity[key].omega``.
        output, resume, force, progress: as for ``run``.
    """
    pair = None if gains is None else _list(gains)
    options = {"over": _over(over), "steps": steps, "omega": omega, "gains": pair, "tolerance": tolerance, "noise": noise}
    options |= {"average": average, "seed": seed, "ratio": ratio, "sensitivity": sensitivity or None, "resume": resume, "force": force}
    return _result(*_to_file("phase-resonance", scene, output, options, progress))


def tori(
    scene: AnyScene,
    omega: float,
    output: Output = None,
    *,
    curves: int | None = None,
    size: float | None = None,
    range: tuple[float, float] | None = None,
    ratio: float | None = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
) -> Tori:
    """Motions of two frequencies, from where an orbit loses its stability to one on: closed curves of the period map, size by size.

    Args:
        omega: circular frequency of an orbit next to the point at which a pair of its multipliers leaves the unit circle.
        curves: how many [default: 20].
        size: of the first one, and first step: norm of its first coefficient [default: a hundredth of the unit of states].
        range: frequencies that they are followed in [default: within a fifth of ``omega``].
        ratio: damping ratio [default: that of the scene].
        output, resume, force, progress: as for ``run``.
    """
    ends = None if range is None else _list(range)
    options = {"omega": omega, "curves": curves, "size": size, "range": ends, "ratio": ratio, "resume": resume, "force": force}
    return _result(*_to_file("tori", scene, output, options, progress))


def bands(
    family: Family | ScenePath,
    deviations: Mapping[str, float | str],
    output: Output = None,
    *,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
) -> Bands:
    """How far a family moves with numbers of its scene that are known to a standard deviation only.

    Args:
        family: of ``backbone`` or ``response``, or its file.
        deviations: by key of the scene the standard deviation, in the number's unit or in per cent of it: ``{"contact.gap": 0.02, "damping.ratio": "10%"}``.
        output, resume, force, progress: as for ``run``.
    """
    # a family without a name lives as long as it is held
    held = open_results(family) if isinstance(family, (str, PathLike)) else family
    if not isinstance(held, Family):
        raise SceneError("no orbits of a family are in it", "give the result of backbone or response")
    options: dict[str, Any] = {"deviation": [f"{key}={size}" for key, size in deviations.items()], "resume": resume, "force": force}
    return _result(*_to_file("bands", held.scene, output, options, progress, [fspath(held.path)], scene_file=False))


def crosscheck(
    backbone: Family | ScenePath | tuple[Any, Any] | Mapping[str, Any],
    scene: AnyScene,
    output: Output = None,
    *,
    quick: bool = False,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Crosscheck:
    """Results of harmonic balance against the equations in time: is each point a true motion, and where does shooting lead from it?

    Args:
        backbone: a ``Family`` of harmonic balance, a file (own, CSV, MATLAB v7.3), or your own result: a pair
            ``(omega, coefficients)``, or a dict with these keys (and ``alpha`` [p] for viscous modes): frequencies [p] and
            coefficients [p, 2 N_h + 1, n_O] of u_O in the order a_0, a_1, b_1, a_2, b_2, ...
        scene: the body that they are solutions of.
        quick: do not look for the cause where shooting fails.
        output, resume, force, progress: as for ``run``.
    """
    options |= {"quick": quick, "resume": resume, "force": force}
    if isinstance(backbone, Result):
        if not isinstance(backbone, Family) or backbone.hbm is None:
            raise SceneError("no series of harmonic balance are in it", "give a family computed with method='hbm'")
        result = _result(*_to_file("crosscheck", scene, output, options, progress, [fspath(backbone.path)]))
        # a family without a name lives as long as it is held
        del backbone
        return result
    if isinstance(backbone, (str, PathLike)):
        return _result(*_to_file("crosscheck", scene, output, options, progress, [os.fsdecode(backbone)]))
    given = dict(backbone) if isinstance(backbone, Mapping) else dict(zip(("omega", "coefficients"), backbone))
    if not {"omega", "coefficients"} <= given.keys() <= {"omega", "coefficients", "alpha"}:
        raise SceneError(f"a series with {', '.join(given)}", "give omega, coefficients, and for viscous modes alpha")
    with tempfile.TemporaryDirectory(prefix="signorini-") as folder:
        path = os.path.join(folder, "series.csv")
        _write_series(path, given["omega"], given["coefficients"], given.get("alpha"))
        try:
            return _result(*_to_file("crosscheck", scene, output, options, progress, [path]))
        except SceneError as e:
            raise SceneError(e.message.replace(path, "your series"), e.help, (e.file, e.line, e.column, e.key)) from None


def compare(
    scene: AnyScene,
    methods: str | Iterable[str] | None = None,
    elements: Iterable[Any] | None = None,
    *,
    parameter: Mapping[str, Iterable[Any]] | None = None,
    reference: Output = None,
    orbit: bool = False,
    viscous: bool = False,
    omega: float | Iterable[float] | None = None,
    output: Output = None,
    resume: bool = False,
    force: bool = False,
    progress: Progress = None,
    **options: Any,
) -> Comparison:
    """The same scene with different contact methods, meshes and parameters: error, penetration, pressure, energy, switches, time.

    Args:
        methods: ``["nbm", "nbm:constant", "nitsche", "penalty", ...]`` [default: those that suit the body].
        elements: meshes: ``[10, 20, 40]`` or ``[(10, 3), (20, 6)]``.
        parameter: keys of the scene with the values they are given: ``{"contact.gamma": [2, 5]}``.
        reference: "waves", "METHOD@MESH", or a file of a run that motions are compared with.
        orbit, viscous, omega: compare orbits or viscous nonlinear modes at these frequencies.
        output: beginning of the names of HDF5, CSV, SVG and PNG.
    """
    mesh = lambda m: "x".join(str(int(k)) for k in np.atleast_1d(m))  # noqa: E731
    options |= {
        "methods": [methods] if isinstance(methods, str) else list(methods) if methods is not None else None,
        "elements": [mesh(m) for m in elements] if elements is not None else None,
        "reference": reference,
        "orbit": orbit,
        "viscous": viscous,
        "omega": omega,
        "resume": resume,
        "force": force,
    }
    options["parameter"] = _Again(f"{key}={_list(values)}" for key, values in (parameter or {}).items())
    return _result(*_to_file("compare", scene, output, options, progress, ending=".h5"))


def _numbers(x: int | Iterable[int] | None) -> list[int] | int | None:
    return x if x is None or isinstance(x, (int, np.integer)) else [int(k) for k in x]


def _write_series(path: str, omega: Any, coefficients: Any, alpha: Any) -> None:
    """Series as the CSV that the cross-check reads."""
    omega, a = np.atleast_1d(np.asarray(omega, dtype=float)), np.asarray(coefficients, dtype=float)
    if a.ndim == 2 and len(omega) == 1:
        a = a[None]
    if a.ndim != 3 or len(a) != len(omega) or a.shape[1] % 2 == 0:
        raise SceneError(
            f"coefficients of shape {a.shape} for {len(omega)} frequencies: give [p, 2 N_h + 1, n_O] in the order a_0, a_1, b_1, ..."
        )
    if not (np.isfinite(a).all() and np.isfinite(omega).all()):
        raise SceneError("the series has entries that are no finite numbers")
    with_alpha = alpha is not None
    fed = np.broadcast_to(np.asarray(alpha if with_alpha else 0.0, dtype=float), omega.shape)
    with open(path, "w", encoding="ascii") as file:
        names = [f"u_{i + 1}" for i in range(a.shape[2])]
        file.write(",".join(["point", "omega", *(["alpha"] if with_alpha else []), "k", "part", *names]) + "\n")
        for p, (w, series) in enumerate(zip(omega, a)):
            for f, row in enumerate(series):
                head = [str(p), repr(float(w)), *([repr(float(fed[p]))] if with_alpha else [])]
                head += [str((f + 1) // 2), "sin" if f > 0 and f % 2 == 0 else "cos"]
                file.write(",".join([*head, *(repr(float(x)) for x in row)]) + "\n")
