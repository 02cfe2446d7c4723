"""Results: each is its file, with the names of the JSON keys and of the HDF5 layout."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn, Union, overload

import numpy as np

from . import _signorini
from ._errors import FileError, NumericsError
from ._files import Group, PathOrText, Store, _near
from ._scene import Scene

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

FloatArray = "np.ndarray[Any, np.dtype[np.float64]]"


class Result(Group):
    """What a command computed, or a file holds.

    Attributes:
        path: the file (one that nobody named is gone with the object: ``save`` keeps it).
        title, status, created, command: as the file says; ``status`` is ``"complete"``, ``"interrupted"`` or
            ``"failed: ..."`` with the verdict of the numerics.
        mesh: group with ``nodes`` [n, 2 or 3], ``elements`` [m, k], ``dof_map`` [n, 2 or 3] (column of u, -1 prescribed),
            ``contact_nodes`` [n_C], ``contact_normals`` [n_C, 2], ``gap`` [n_C], ...
        output: the file's name as text, as in the JSON object.
    """

    title: str
    status: str
    created: str
    command: str
    mesh: Group

    def __init__(self, store: Store, said: dict[str, Any] | None = None):
        super().__init__(store, "")
        self._said = said or {}

    @property
    def path(self) -> Path:
        return self._store.path

    @property
    def output(self) -> str:
        return str(self._store.path)

    @property
    def scene(self) -> Scene:
        """The scene that made it. Matrices that a program gave have to be given again."""
        return Scene.parse(self["scene"], self.get("scene_file", "scene.toml"))

    @property
    def is_complete(self) -> bool:
        """Whether the computation came to its end."""
        return self.status == "complete"

    def __bool__(self) -> bool:
        return True

    def _own(self, name: str) -> Any:
        """What is known under a name: in the groups whose names are attributes, then in what was said."""
        for group in self._groups():
            if group in self._entries() and name in self[group]:
                return self[group][name]
        if name in self._said:
            return self._said[name]
        declared = {k: a for c in type(self).__mro__ for k, a in c.__dict__.get("__annotations__", {}).items()}
        if name in declared:
            # a key of the JSON object that is null, or a list that is empty
            return [] if str(declared[name]).startswith("list[") else None
        raise KeyError(name)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return super().__getitem__(name)
        except KeyError:
            try:
                return self._own(name)
            except KeyError:
                names = [n for n in dir(self) if not n.startswith("_")]
                raise AttributeError(f"{type(self).__name__} has no {name}{_near(name, names)}") from None

    def _groups(self) -> list[str]:
        """Groups whose names are attributes of the result, the first one first."""
        return []

    def __dir__(self) -> list[str]:
        own = [n for c in type(self).__mro__ for n in c.__dict__.get("__annotations__", ())]
        held = [n for g in self._groups() if g in self._entries() for n in self[g].keys()]
        return sorted({*super().__dir__(), *own, *held})

    def inspect(self) -> dict[str, Any]:
        """What ``signorini inspect --json`` says of the file."""
        text, _, _ = _signorini.call(["inspect", "--json", "--", self._store.name()])
        return json.loads(text)

    def save(self, path: PathOrText, overwrite: bool = False) -> Path:
        """Keep the file under a name; the path. ``sg.open`` and the command line read it."""
        path = Path(path)
        if path.exists() and not overwrite:
            raise FileExistsError(f"{path} is there already; give another name, or overwrite=True")
        if not (path.exists() and path.samefile(self.path)):
            part = path.with_name(path.name + ".part")
            shutil.copyfile(self.path, part)
            part.replace(path)
        return path

    def plot(self, to: PathOrText | None = None, **options: Any) -> Figure:
        """A figure of it, by matplotlib (``pip install "signorini[plot]"``): a notebook shows it, ``to`` names a file for it (PNG, SVG, PDF by its ending).

        Options: of a run ``at``, the time at which the body is drawn, and ``nodes``, the contact nodes that have curves; of a family ``axis="energy"`` or
        ``"amplitude"`` in place of both; of a comparison ``column="error"`` or another of its columns.
        """
        from . import _plot

        figure = _plot.draw(self, **options)
        if to is not None:
            figure.savefig(to)
        return figure

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a table (``pip install "signorini[tables]"``): of a run its stored states by time, with energies, contact, forces and probes; of what has rows
        (points of a family, values of a diagram, cells of basins, points of curves) these."""
        from . import _tables

        return _tables.pandas_of(self)

    def to_xarray(self) -> xarray.Dataset:
        """The same with named axes: of a run ``displacement`` and ``velocity`` by ``t``, ``node``, ``axis``, contact by ``t`` and ``contact`` (the node)."""
        from . import _tables

        return _tables.xarray_of(self)

    def _facts(self) -> list[tuple[str, Any]]:
        """What a notebook shows of it first."""
        return [("status", self.status), ("command", self.command)]

    def _repr_html_(self) -> str:
        from . import _html

        try:
            return _html.table(f"{type(self).__name__}: {self.title}", [("", self._text().split(": ", 1)[-1]), *self._facts()]) + _html.picture(self)
        except (OSError, FileError):
            return _html.table(repr(self)[1:-1], [])

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}"

    def __repr__(self) -> str:
        try:
            return f"<{type(self).__name__} {self._text()}>"
        except (OSError, FileError):
            return f"<{type(self).__name__}: {self._store.path} is gone, or another file>"


def _impulse(t: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The integral of a force by trapezia, summed one after the other."""
    steps = 0.5 * np.diff(t)[:, None] * (force[:-1] + force[1:])
    return np.cumsum(steps, axis=0)[-1] if len(steps) else np.zeros(force.shape[1])


def _harmonic(omega: float, phase: float, t: np.ndarray, order: int) -> np.ndarray:
    """cos(omega t + phase), or its rate."""
    angle = omega * t + phase
    return -omega * np.sin(angle) if order else np.cos(angle)


def _spline(x: np.ndarray, y: np.ndarray, t: np.ndarray, order: int) -> np.ndarray:
    """The cubic spline through points that is straight at its ends, or its rate."""
    h = np.diff(x)
    slope = np.diff(y) / h
    diagonal, rest = np.ones(len(x)), np.zeros(len(x))
    for i in range(1, len(x) - 1):
        share = h[i - 1] / diagonal[i - 1] if i > 1 else 0.0
        diagonal[i] = 2 * (h[i - 1] + h[i]) - share * h[i - 1]
        rest[i] = 6 * (slope[i] - slope[i - 1]) - share * rest[i - 1]
    second = np.zeros(len(x))
    for i in range(len(x) - 2, 0, -1):
        second[i] = (rest[i] - h[i] * second[i + 1]) / diagonal[i]
    k = np.clip(np.searchsorted(x, t, side="right") - 1, 0, len(h) - 1)
    b = (t - x[k]) / h[k]
    a = 1 - b
    if order:
        return slope[k] + h[k] / 6 * ((1 - 3 * a**2) * second[k] + (3 * b**2 - 1) * second[k + 1])
    return a * y[k] + b * y[k + 1] + h[k] ** 2 / 6 * ((a**3 - a) * second[k] + (b**3 - b) * second[k + 1])


class Run(Result):
    """A motion in time (``/trajectory``), its switches and its energies.

    Attributes:
        t: times of the stored states [s].
        u, v: displacements and velocities, all of them, contact displacements included, along the axes [s, N];
            ``mesh.dof_map`` says which column is which. With ``run.store = "contact"`` or groups the file keeps some
            of the columns only: ``columns`` says which (``None`` where it keeps all).
        active: what a contact point does [s, n_C]: 0 open, 1 in contact; with friction 2 sticks, 3 slips forwards, 4 backwards.
        pressure: contact pressure, > 0 in contact [s, n_C].
        traction: with friction, that of the obstacle on the body along the tangent [s, n_C]; slide: its displacement along it [s, n_C]; ``friction_work``, ``belt_work`` and the group
            ``friction`` with ``work``, ``path`` [n_C] say what friction took and how far points slipped.
        switches: table with ``t``, ``node``, ``point``, ``monitor`` (what vanished: "gap", "pressure"), ``from``, ``to`` ("open", "closed"; with friction "stick", "slip+", "slip-"), ``kind`` ("close", "open"; of an impact law also "impact", "rest"; with friction "sticking", "slipping"), ``energy_jump``, ``monitor_rate``.
        grazings: table with ``t``, ``node``, ``distance``, ``kind``.
        ledger: group with ``t``, ``kinetic``, ``elastic``, ``external``, ``dissipated``, ``jumps``, with friction also ``friction``, ``belt`` [s].
        n_dof, n_o, n_contact: numbers of displacements, of those that move by themselves, of contact points.
        t_end, phases, energy_start, energy_end, energy_jumps, energy_external, energy_dissipated: as they say.
        energy_drift: largest relative drift of the energy inside phases; ``energy_drift_total`` with the jumps.
        max_penetration, max_tension: largest violation of the contact conditions (length, stress).
        certified: whether the run reached its end and every switch was proved to be the next one (docs/theory.md, section 12).
        certified_until: the time up to which that is proved, or None; state_error: how far gaps and pressures may have been
            from those of the equations at the end of a phase, over their sizes.
        verdict: how the run ended, in words; ``status`` says it too.
        method: group with ``name``, ``conserves_energy``, ``mass_ratio``, ...
        final: group with ``u``, ``v`` [n_o] at ``t_end``, in the order of u_O.
        rhs_evaluations, products, rows (that these read, times vectors), factorisations, steps, rejected, wall_s: what it cost.
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    active: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray
    slide: np.ndarray
    friction_work: float
    belt_work: float
    friction: Group
    n_dof: int
    n_o: int
    n_contact: int
    t_end: float
    phases: int
    energy_start: float
    energy_end: float
    energy_jumps: float
    energy_external: float
    energy_dissipated: float
    energy_drift: float
    energy_drift_total: float
    max_penetration: float
    max_tension: float
    violation: float
    certified: bool
    certified_until: float | None
    state_error: float
    uncertified_phases: int
    undecided_tangencies: int
    missed_switches: int
    loosened_monitors: int
    verdict: str
    warning: str | None
    mesh_warning: str | None
    warnings: list[str]
    places: list[dict]
    integrator_note: str | None
    lcp_check: Group | None
    damping: Group | None
    method: Group
    final: Group
    rhs_evaluations: int
    products: int
    rows: int
    factorisations: int
    steps: int
    rejected: int
    wall_s: float

    @property
    def columns(self) -> np.ndarray | None:
        trajectory = self["trajectory"]
        return trajectory["columns"] if "columns" in trajectory.keys() else None

    @property
    def switches(self) -> np.recarray:
        return self["switches"].table()

    @property
    def grazings(self) -> np.recarray:
        return self["grazings"].table()

    @property
    def ledger(self) -> Group:
        return self["energy"]

    @property
    def lyapunov(self) -> Group | None:
        """``run(..., lyapunov=k)``: ``exponents``, ``errors``, ``bounds`` [k] over time, ``growths`` [period, k], ``period``, ``divergence``, ``dimension``."""
        return self["lyapunov"] if "lyapunov" in self._entries() else None

    def _groups(self) -> list[str]:
        return ["trajectory", "report"]

    def of_rows(self, table: np.ndarray) -> np.ndarray:
        """Of a body of matrices: ``u`` or ``v`` with its columns in the order of the matrices' rows [s, N]."""
        if self.mesh.elements.size and (self.mesh.dof_map[:, 1] >= 0).any():
            raise TypeError("the body has a mesh: displacement(node) and mesh.dof_map say which column is which")
        columns = self.mesh.dof_map[:, 0]
        return self._columns(table, columns[columns >= 0])

    def displacement(self, node: int) -> np.ndarray:
        """Displacement of a mesh node along the axes [s, dim]; zero where it is prescribed."""
        return self._at_node(self.u, node) + self._gone(node, 0)

    def at(self, *place: float, velocity: bool = False) -> np.ndarray:
        """Displacement (or velocity) at a place of the undeformed body along the axes [s, dim], by the shape functions of its element: ``run.at(0.5, 0.2)``."""
        table = self.v if velocity else self.u
        order = int(velocity)
        parts = [w * (self._at_node(table, node) + self._gone(node, order)) for node, w in _signorini.weights(self.path, list(map(float, place)))]
        return np.sum(parts, axis=0)

    @property
    def contact_displacement(self) -> np.ndarray:
        """Displacements of the contact points along their normals, u_C [s, n_C]; the gap that is left is ``mesh.gap - u_C``.
        Where gaps move they are counted from where these have gone (``run["obstacle"]``)."""
        return self._along_normals(self.u)

    @property
    def contact_velocity(self) -> np.ndarray:
        """Their velocities [s, n_C]."""
        return self._along_normals(self.v)

    def _gone(self, node: int, order: int) -> np.ndarray:
        """What a node has besides its stored displacement, or velocity [s, dim]: at supports that move, and where gaps move, from where it is counted there."""
        gone = np.zeros((len(self.t), self.mesh.nodes.shape[1]))
        if "moving" in self and node in self["moving"].node:
            moving = self["moving"]
            own = list(moving.node).index(node)
            for part, (omega, phase, motion) in enumerate(zip(moving.omega, moving.phase, moving.motion)):
                course = _harmonic(omega, phase, self.t, order)
                if np.isnan(omega):
                    rows = moving.table_part == part
                    course = _spline(moving.table_t[rows], moving.table_value[rows], self.t, order)
                gone += np.outer(course, motion[own])
        if "obstacle" not in self or node not in self.mesh.contact_nodes:
            return gone
        point = list(self.mesh.contact_nodes).index(node)
        obstacle = self["obstacle"]
        for omega, phase, motion in zip(obstacle.omega, obstacle.phase, obstacle.motion):
            gone += np.outer(_harmonic(omega, phase, self.t, order), motion[point])
        return gone

    def _at_node(self, table: np.ndarray, node: int) -> np.ndarray:
        columns = self.mesh.dof_map[node]
        at_node = np.zeros((len(table), len(columns)))
        at_node[:, columns >= 0] = self._columns(table, columns[columns >= 0])
        return at_node

    def _columns(self, table: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Columns of all displacements, where the file keeps them."""
        kept = self.columns
        if kept is None:
            return table[:, columns]
        if not np.isin(columns, kept).all():
            raise ValueError("the file does not keep this displacement: run the scene with store = \"all\"")
        return table[:, np.searchsorted(kept, columns)]

    def _against(self, table: np.ndarray, point: int, node: int) -> np.ndarray:
        """A node's displacements, less what the surface that it meets does."""
        own = self._at_node(table, node)
        if "contact" not in self:
            return own
        rows = self["contact"]["against"]
        for k in range(rows.indptr[point], rows.indptr[point + 1]):
            own = own - rows.data[k] * self._at_node(table, rows.indices[k])
        return own

    @property
    def resultants(self) -> dict[str, np.ndarray]:
        """Force on the body at each group of contact points [s, dim], by its name; what it meets has the opposite."""
        return self._forces_of("contact", "group")

    @property
    def support_forces(self) -> dict[str, np.ndarray]:
        """Force of each support on the body [s, dim], by its group."""
        return self._forces_of("support", "group")

    @property
    def spring_forces(self) -> dict[str, np.ndarray]:
        """Force of each spring [s, 1], by its ends; positive where it pulls."""
        return self._forces_of("spring", "name")

    def _forces_of(self, kind: str, names: str) -> dict[str, np.ndarray]:
        if "forces" not in self or kind not in self["forces"]:
            return {}
        table = self["forces"][kind]
        words = [str(name) for name in table[names]]
        return dict(zip(words, np.split(table["force"], len(words), axis=1)))

    @property
    def forces(self) -> np.recarray:
        """What forces of contact, supports and springs come to: table with ``kind``, ``group``,
        ``maximum`` (largest force in magnitude, of the stored states), ``t`` (when), ``impulse`` (a list, by trapezia), ``impulse_error`` (how far that over every second state is from it).

        Forces that nobody knows (of supports under Moreau and Jean's scheme) are left out.
        """
        rows = []
        of_kinds = {"contact": self.resultants, "support": self.support_forces, "spring": self.spring_forces}
        for kind, name, force in ((k, name, f) for k, forces in of_kinds.items() for name, f in forces.items()):
            size = np.hypot.reduce(force, axis=1)
            last = len(size) - 1 - int(np.argmax(size[::-1]))
            # over every state, over every second and the last
            states = np.arange(len(force))
            impulse, coarse = (_impulse(self.t[own], force[own]) for own in (states, states[(states % 2 == 0) | (states == len(states) - 1)]))
            doubt = np.hypot.reduce(np.abs(impulse - coarse))
            if np.isfinite(size[last]):
                rows.append((kind, name, size[last], self.t[last], impulse.tolist(), doubt))
        names = max((len(row[1]) for row in rows), default=1)
        kinds = [("kind", "U7"), ("group", f"U{names}"), ("maximum", float), ("t", float), ("impulse", object), ("impulse_error", float)]
        return np.array(rows, dtype=kinds).view(np.recarray)

    @property
    def probes(self) -> dict[str, dict[str, np.ndarray]]:
        """What ``[[probe]]`` of the scene saw: by name, then by quantity (``"displacement"``, ``"velocity"``, ``"acceleration"``, ``"stress"``, ``"recovered-stress"``) [s, components].

        Components are those of the axes; of stress xx, yy, zz, xy, yz, zx (in the plane the first four, of a bar the first).
        """
        if "probes" not in self:
            return {}
        group = self["probes"]
        return {name: {quantity: group[name][quantity] for quantity in group[name].keys()} for name in group.keys()}

    @property
    def excursions(self) -> np.recarray:
        """How far bodies that meet strayed: table with ``kind`` (``"sliding"`` of a pair over the length of its sides, ``"rotation"`` of a part),
        ``of`` (slave and master, or the part), ``largest`` of the stored states, ``t`` (when)."""
        rows = []
        if "contact/pairs/sliding" in self:
            pairs = self["contact/pairs"]
            for k, of in enumerate(zip(map(str, pairs.slave), map(str, pairs.master))):
                rows.append(("sliding", list(of), pairs.sliding[:, k]))
        if "bodies/rotation" in self:
            names, rotation = list(map(str, self["bodies/name"])), self["bodies/rotation"]
            width = rotation.shape[1] // len(names)
            for k, name in enumerate(names):
                turns = np.hypot.reduce(rotation[:, width * k : width * (k + 1)], axis=1)
                rows.append(("rotation", [name], turns))
        table = []
        for kind, of, size in rows:
            last = len(size) - 1 - int(np.argmax(size[::-1]))
            table.append((kind, of, size[last], self.t[last]))
        kinds = [("kind", "U8"), ("of", object), ("largest", float), ("t", float)]
        return np.array(table, dtype=kinds).view(np.recarray)

    def _along_normals(self, table: np.ndarray) -> np.ndarray:
        mesh = self.mesh
        if "contact_points" in mesh:
            # points of quadrature have columns of their own
            sign = -1.0 if str(mesh.get("contact_normal", "")).startswith("-") else 1.0
            return sign * self._columns(table, mesh.contact_dofs)
        normals = mesh.contact_normals
        size = normals.shape[1] if normals.ndim > 1 else 0
        columns = [self._against(table, i, n)[:, :size] @ normals[i] for i, n in enumerate(mesh.contact_nodes)]
        return np.stack(columns, axis=1) if columns else np.zeros((len(table), 0))

    def _facts(self) -> list[tuple[str, Any]]:
        proved = "proved" if self.certified else "not proved: that takes an exact flow (run.integrator) to the end"
        facts: list[tuple[str, Any]] = [("energy drift", self.energy_drift), ("every switch is the next", proved)]
        return [*facts, ("largest penetration", self.max_penetration), *super()._facts()]

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {len(self.t)} states, {len(self.switches)} switches"


class _OfOrbit:
    """What an orbit and a point of a family have in common."""

    #: Whether it is an orbit.
    converged = True

    @staticmethod
    def _pairs(pairs: np.ndarray) -> np.ndarray:
        return pairs[:, 0] + 1j * pairs[:, 1]

    @staticmethod
    def _stable(word: Any) -> bool | None:
        return {"yes": True, "no": False, True: True, False: False}.get(word)


class Orbit(_OfOrbit, Run):
    """A periodic orbit by shooting, with its motion over one period (everything that a ``Run`` has).

    Attributes:
        period, omega, energy, amplitude, contact_time: of the orbit.
        residual: of the period map, relative; ``newton_iterations`` led there.
        multipliers: Floquet multipliers, complex [2 n_o]; ``largest_multiplier`` without the trivial ones.
        stable: None where multipliers were not computed, or say nothing of the body (viscous modes).
        admissible: no penetration, no tension, every switch proved.
        u0, v0: the state at t = 0, all displacements along the axes [N].
        alpha, beta, energy_start, energy_turned_over: of a viscous nonlinear mode.
        family_dimension: with friction, parameters of the family of residual positions that the orbit is a member of; ``friction_work``, ``belt_work`` are those of a period.
        drift: how far a body that only friction keeps in place walks along its obstacle in a period.
    """

    period: float
    omega: float
    energy: float
    amplitude: float
    residual: float
    newton_iterations: int
    contact_time: float
    penetration: float
    tension: float
    energy_balance: float
    grazing_distance: float
    admissible: bool
    forcing_periods: int | None
    trivial_multipliers: int | None
    largest_multiplier: float | None
    stability_lost_by: str | None
    alpha: float | None
    beta: float | None
    energy_turned_over: float | None
    family_dimension: int | None
    drift: float | None

    @property
    def multipliers(self) -> np.ndarray:
        return self._pairs(self["orbit"]["multipliers"])

    @property
    def sensitivity(self) -> dict[str, Group]:
        """``orbit(..., sensitivity=[...])``: by key of the scene ``value`` and the derivatives by it of ``amplitude``, ``pressure``, ``energy`` (largest values, see ``peaks``),
        ``period``, ``alpha``, ``u0``, ``v0``, ``multipliers`` [2 n_o, 2] (real, imaginary)."""
        return {key: x for key, x in self._sensitivity() if isinstance(x, Group)}

    @property
    def peaks(self) -> dict[str, dict[str, Any]]:
        """Beside ``sensitivity``: ``amplitude``, ``pressure``, ``energy``, each with ``value``, ``t``, ``node``."""
        at = dict(self._sensitivity())
        names = [name for name in ("amplitude", "pressure", "energy") if name in at]
        node = {name: int(at[f"{name}_node"]) if f"{name}_node" in at else None for name in names}
        return {name: {"value": at[name], "t": at[f"{name}_time"], "node": node[name]} for name in names}

    def _sensitivity(self) -> list[tuple[str, Any]]:
        if "sensitivity" not in self._entries():
            return []
        group = self["sensitivity"]
        return [(key, group[key]) for key in group.keys()]

    @property
    def stable(self) -> bool | None:
        return self._stable(self["orbit"]["stable"])

    @property
    def energy(self) -> float:  # type: ignore[no-redef]
        return self["orbit"]["energy"]

    @property
    def omega(self) -> float:  # type: ignore[no-redef]
        return 2 * np.pi * self.periods / self["orbit"]["period"]

    @property
    def periods(self) -> int:
        """Periods of the loads in one of the orbit."""
        return int(self["orbit"].get("forcing_periods", 1))

    def found(self) -> Orbit:
        """The orbit itself; a ``Verdict`` raises: ``sg.orbit(scene, 1.8).found()`` is an orbit or an error."""
        return self

    def _facts(self) -> list[tuple[str, Any]]:
        facts: list[tuple[str, Any]] = [("period", float(self.period)), ("amplitude", float(self.amplitude)), ("residual", float(self["orbit"]["residual"]))]
        return [*facts, *Result._facts(self)]

    def _groups(self) -> list[str]:
        # what it says of itself stands before what was said of it
        return ["orbit", *super()._groups()]

    def _text(self) -> str:
        stable = {True: "stable", False: "unstable", None: "stability not known"}[self.stable]
        return f"omega = {self.omega:.9g}, energy {self.energy:.9g}, {len(self.switches)} switches, {stable}"


class Verdict:
    """What came of a search that found no orbit: ``bool(verdict)`` is False.

    Attributes:
        converged: False.
        omega: the frequency.
        verdict: a word: "fold", "grazing", "no contact", "flawed", "not found".
        message: the sentence.
        fold, grazing, residual: the numbers that belong to it, None otherwise.
    """

    converged: Literal[False] = False

    def __init__(self, said: dict[str, Any]):
        self._said = said
        self.omega: float = said["omega"]
        self.verdict: str = said["verdict"]
        self.message: str = said["message"]
        self.fold: dict[str, Any] | None = said.get("fold")
        self.grazing: dict[str, Any] | None = said.get("grazing")
        self.residual: float | None = said.get("residual")

    def __bool__(self) -> Literal[False]:
        return False

    def found(self) -> NoReturn:
        """There is no orbit: raises a ``NumericsError`` that says why."""
        raise NumericsError(self.message)

    def _repr_html_(self) -> str:
        from . import _html

        return _html.table(f"No orbit at omega = {self.omega:.9g}", [("verdict", self.verdict), ("", self.message)])

    def __repr__(self) -> str:
        return f"<Verdict at omega = {self.omega:.9g}: {self.message}>"


class OrbitFound:
    """An orbit that ``sg.orbits`` found: the attributes of the JSON object, lists as arrays, without a file.

    ``u0``, ``v0`` [n_o] are in the order of u_O; ``multipliers`` are complex. ``sg.orbit`` from its neighbourhood gives the
    motion over a period.
    """

    def __init__(self, said: dict[str, Any]):
        for key, x in said.items():
            if "multipliers" in key and isinstance(x, list):
                x = np.array([complex(*pair) for pair in x])
            elif key == "switches":
                x = np.rec.fromrecords(
                    [(s["t"], s["node"], s["kind"], s["energy_jump"]) for s in x] or np.zeros((0, 4)),
                    names="t,node,kind,energy_jump",
                )
            elif isinstance(x, list):
                x = np.array(x, dtype=float)
            setattr(self, key, x)

    def __repr__(self) -> str:
        d = self.__dict__
        return f"<OrbitFound omega = {d['omega']:.9g}, energy {d['energy']:.9g}, stable: {d['stable']}>"


class Point(_OfOrbit, Group):
    """One point of a family: ``omega``, and where it is an orbit ``period``, ``energy``, ``amplitude``, ``residual``, ``u0``, ``v0`` [N],
    ``multipliers`` (complex), ``switches``, ``stable``, ``contact_time``, ...; of viscous modes ``alpha``, ``beta``; of harmonic balance without an orbit near
    ``multipliers_within``: how far multipliers of half the harmonics are from those along the series."""

    @property
    def converged(self) -> bool:  # type: ignore[override]
        """Whether there is an orbit."""
        return "u0" in self

    @property
    def multipliers(self) -> np.ndarray | None:
        return self._pairs(self["multipliers"]) if self.converged else None

    @property
    def largest_multiplier(self) -> float | None:
        """Size of the largest multiplier besides the trivial ones at +1."""
        if self.multipliers is None or not len(self.multipliers):
            return None
        rest = self.multipliers[np.argsort(np.abs(self.multipliers - 1))[int(self["trivial_multipliers"]) :]]
        return float(np.abs(rest).max()) if len(rest) else None

    @property
    def switches(self) -> np.recarray | None:
        return self["switches"].table() if self.converged else None

    @property
    def stable(self) -> bool | None:
        return self._stable(self.get("stable"))

    def __repr__(self) -> str:
        what = f"energy {self.energy:.9g}" if self.converged else "no orbit"
        return f"<Point omega = {self.omega:.9g}, {what}>"


class Family(Result):
    """A family of orbits, or of solutions of harmonic balance (``/backbone``): a backbone, a response.

    Arrays over its points [p] (not numbers where there is no orbit):

    Attributes:
        omega, energy, amplitude, residual, contact_time, grazing_distance: of the points.
        stable: 1 stable, 0 unstable, -1 not computed.
        branch: number of the branch; ``branches`` are their names.
        special: "regular", "fold", "grazing", ... or why there is no orbit.
        alpha, beta, energy_turned_over: of viscous nonlinear modes, None otherwise.
        stops: how each branch ended: a list of dicts with ``branch``, ``reason``, ``text``, ``complete``.
        grazings: where contacts begin or end to be along the branches, or None: ``grazings.omega``, ``.node``, ``.kind`` ("closing", "opening"), ``.turns``,
            ``.multiplier`` (the largest behind it), ``.point``.
        error_statement: how far the energies may be off (viscous families): a group, or None.
        hbm: the series of harmonic balance, or None: ``hbm.omega`` [q], ``hbm.coefficients`` [q, 2 N_h + 1, n_O] in the order
            a_0, a_1, b_1, ..., ``hbm.point``: their rows among the points.
        sweep: what a body settles to (``response(..., sweep="both")``), or None: ``sweep.kind``, ``sweep.period_number``, ``sweep.lyapunov``, ``sweep.peak`` [row, contact point],
            ..., ``sweep.point``: their rows among the points.

    ``family[k]`` is a point with its state, multipliers and switches; ``for point in family`` goes through all.
    """

    omega: np.ndarray
    energy: np.ndarray
    amplitude: np.ndarray
    residual: np.ndarray
    contact_time: np.ndarray
    grazing_distance: np.ndarray
    alpha: np.ndarray | None
    beta: np.ndarray | None
    energy_turned_over: np.ndarray | None
    hbm: Group | None
    sweep: Group | None
    grazings: Group | None
    error_statement: Group | None
    wall_s: float
    resumed: int
    kind: str
    range: np.ndarray

    @property
    def branches(self) -> list[str]:
        return self["backbone"]["branches"].split("\n")

    @property
    def branch(self) -> np.ndarray:
        return self["backbone"]["branch"].astype(int)

    @property
    def stable(self) -> np.ndarray:
        return np.nan_to_num(self["backbone"]["stable"], nan=-1).astype(int)

    @property
    def switches(self) -> np.ndarray:
        """Switches a period [p]; -1 where there is no orbit."""
        return np.nan_to_num(self["backbone"]["switches"], nan=-1).astype(int)

    @property
    def extremes(self) -> dict[str, np.ndarray]:
        """What forces and probes come to over the period at each point: by name, ``"force[right]"``, ``"support_x[left]"``, ``"displacement_x[tip]"``, the least and the largest [p, 2]."""
        group = self["backbone"].get("extremes")
        if group is None:
            return {}
        return {str(name): np.stack([group["least"][:, k], group["largest"][:, k]], axis=1) for k, name in enumerate(group["name"])}

    @property
    def is_followed(self) -> bool:
        """Whether neighbours on a branch belong together: not those that were found one by one, each at its own frequency."""
        solver, way, *_ = self.kind.replace(",", "").split()
        return not (way in ("sequential", "sweep") or (solver, way) == ("hbm", "response"))

    @property
    def converged(self) -> np.ndarray:
        """Whether there is an orbit [p]: of a sweep also what is none has an energy."""
        return np.isfinite(self["backbone"]["residual"])

    @property
    def stops(self) -> list[dict[str, Any]]:
        return json.loads(self["backbone"]["ends"])

    def _groups(self) -> list[str]:
        return ["backbone"]

    def _facts(self) -> list[tuple[str, Any]]:
        ends = [f"{self.branches[stop['branch']]}: {stop['text']}" for stop in self.stops]
        frequencies = self.omega[np.isfinite(self.omega)]
        facts: list[tuple[str, Any]] = [("frequencies", f"{frequencies.min():.6g} to {frequencies.max():.6g}")] if len(frequencies) else []
        return [*facts, ("ends", "; ".join(ends)), *super()._facts()]

    def __len__(self) -> int:
        return len(self["backbone"]["omega"])

    @overload
    def __getitem__(self, key: int) -> Point: ...
    @overload
    def __getitem__(self, key: slice | list[int] | np.ndarray) -> list[Point]: ...
    @overload
    def __getitem__(self, key: str) -> Any: ...
    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, (int, np.integer)):
            k = int(key) + (len(self) if key < 0 else 0)
            if not 0 <= k < len(self):
                raise IndexError(f"point {key} of {len(self)}")
            return Point(self._store, f"backbone/points/{k:04d}")
        if isinstance(key, (slice, list, np.ndarray)):
            return [self[int(k)] for k in np.arange(len(self))[key]]
        return super().__getitem__(key)

    def __iter__(self) -> Iterator[Point]:
        return (self[k] for k in range(len(self)))

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {int(self.converged.sum())} orbits at {len(self)} points"


class Crosscheck(Family):
    """Solutions of harmonic balance against the equations in time. As a ``Family`` it holds the orbits that were found.

    Attributes:
        verdict, message: what shooting from the series found [p]: "orbit" where the series approximates it (within 0.1, with the same switches),
            "another orbit" where shooting ended in another one.
        harmonics: number of harmonics of the series [p].
        hbm_energy, residual, return_error: of the series: its energy, its residual in time, how far it is from where it began
            after a period [p].
        moved: distance from the series to the orbit, relative [p]; ``orbit_energy``, ``contact_change``, ``same_sequence``.
        summary: the same by number of harmonics (list of dicts).
    """

    harmonics: np.ndarray
    hbm_energy: np.ndarray
    return_error: np.ndarray
    verdict: np.ndarray
    message: np.ndarray
    moved: np.ndarray
    orbit_energy: np.ndarray
    contact_change: np.ndarray

    @property
    def residual(self) -> np.ndarray:  # type: ignore[override]
        return self["crosscheck"]["residual"]

    @property
    def same_sequence(self) -> np.ndarray:
        return self["crosscheck"]["same_sequence"] == 1

    @property
    def summary(self) -> list[dict[str, Any]]:
        return self.inspect()["crosscheck"]

    def _groups(self) -> list[str]:
        return ["crosscheck", "backbone"]



class Curve(Group):
    """A curve of orbits that are singled out, its points in their order.

    ``omega``, ``value`` (the number of the scene), ``theta`` (angle of the multipliers of a Neimark-Sacker point, else not a number), ``amplitude``, ``energy``,
    ``outside`` (multipliers outside of the unit circle besides), ``special`` ("", "start", "cusp", "turn", "end of range") [p]; ``u0``, ``v0`` [p, N];
    ``periods``, ``ends`` (in words, on both sides), and for grazings ``node``.
    """

    @property
    def periods(self) -> int:
        """Periods of the loads in one of the orbits."""
        return int(self["periods"])

    @property
    def node(self) -> int | None:
        """Mesh node that grazes."""
        return None if "node" not in self else int(self["node"])

    @property
    def closed(self) -> bool:
        """Whether it comes back to its start."""
        return bool(self["closed"])

    def __len__(self) -> int:
        return len(self["omega"])

    def __repr__(self) -> str:
        return f"<Curve of {len(self)} points{', closed' if self.closed else ''}>"


class _Numbered(Result):
    """A result whose parts stand in a group of their own, by number."""

    _parts: str
    _part: type[Group]

    def __len__(self) -> int:
        return sum(name.isdecimal() for name in self[self._parts].keys())

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, (int, np.integer)):
            k = int(key) + (len(self) if key < 0 else 0)
            if not 0 <= k < len(self):
                raise IndexError(f"{self._part.__name__.lower()} {key} of {len(self)}")
            return self._part(self._store, f"{self._parts}/{k}")
        return super().__getitem__(key)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))


class Curves(_Numbered):
    """Folds, period doublings, Neimark-Sacker points, grazings or peaks of a response over a number of its scene.

    Attributes:
        of: "fold", "doubling", "torus", "grazing" or "peak".
        key: key of the number in the scene; ``range``, its range; ``frequencies``, that of the circular frequencies.

    ``curves[k]`` is a ``Curve``; ``for curve in curves`` goes through all.
    """

    _parts, _part = "curves", Curve
    of: str
    key: str
    range: np.ndarray
    frequencies: np.ndarray
    wall_s: float
    lost: list[str]

    def _groups(self) -> list[str]:
        return ["curves"]

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {len(self)} curves of {self.of} over {self.key}"


class Attractor(Group):
    """What a forced body does in the long run.

    ``kind`` ("periodic", "quasi-periodic", "chaotic"), ``period_number``, ``lyapunov`` and ``lyapunov_error`` (a period of the loads), ``amplitude``, ``force``,
    ``energy``, ``switches``; ``share`` of the states that lead here with ``share_error`` and the interval of 95 %, ``share_low`` to ``share_high``; ``at`` [s, axes]: its states
    at phase zero of the loads in the coordinates of the basins; ``u0``, ``v0`` [p, N]: displacements and velocities there.
    """

    @property
    def period_number(self) -> int:
        """Periods of the loads in one of an orbit, else 0."""
        return int(self["period_number"])

    def __repr__(self) -> str:
        name = f"period {self.period_number}" if self.period_number else self["kind"]
        return f"<Attractor: {name}, share {self['share']:.3f}>"


class Basins(_Numbered):
    """From which states a forced body comes to which of its attractors.

    Attributes:
        omega: circular frequency of the loads.
        starts: coordinates of the states [n, axes], in the order of ``axes``; ``range`` [axes, 2].
        attractor: number of the attractor that each state leads to [n]; -1: not settled, -2: unbounded, -3: lost, -4: inside an obstacle, -9: not computed.
        maps: periods of the loads that it took to tell [n].

    ``basins[k]`` is an ``Attractor``; ``for attractor in basins`` goes through all.
    """

    _parts, _part = "attractors", Attractor
    omega: float
    starts: np.ndarray
    range: np.ndarray
    maps: np.ndarray
    wall_s: float

    def _groups(self) -> list[str]:
        return ["basins"]

    @property
    def axes(self) -> list[str]:
        """Names of the coordinates."""
        return self["basins"]["axes"].split()

    @property
    def size(self) -> int | None:
        """Cells along each axis; None of states that were drawn."""
        return int(self["basins"]["size"]) if "size" in self["basins"] else None

    @property
    def attractor(self) -> np.ndarray:
        return self["basins"]["attractor"]

    @property
    def grid(self) -> np.ndarray:
        """``attractor`` as a table [second axis, first axis], of cells."""
        if self.size is None:
            raise ValueError("the states were drawn: they lie on no grid")
        return self.attractor.reshape(self.size, self.size)

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {len(self.attractor)} states, {len(self)} attractors"


class Diagram(Result):
    """What a forced body settles to while a number of its scene goes up, or down, a row a value.

    Attributes:
        key: key of the number in the scene; ``range``, its range; ``omega``, circular frequency of the loads.
        value, direction (1: up, -1: down), special [n]; kind, period_number, lyapunov, lyapunov_error, amplitude, force, energy, switches [n]; peak,
            trough [n, n_C].
        least [m, n_C]: least contact displacements of each period, ``points`` those at phase zero of the loads; ``points_of`` [m], the row that each
            belongs to.
    """

    key: str
    range: np.ndarray
    value: np.ndarray
    direction: np.ndarray
    special: np.ndarray
    kind: np.ndarray
    period_number: np.ndarray
    lyapunov: np.ndarray
    amplitude: np.ndarray
    force: np.ndarray
    least: np.ndarray
    points: np.ndarray
    points_of: np.ndarray
    wall_s: float

    def _groups(self) -> list[str]:
        return ["diagram", "sweep"]

    @property
    def omega(self) -> float:
        """Circular frequency of the loads."""
        return float(self["diagram"]["omega"])

    def __len__(self) -> int:
        return len(self.value)

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {len(self)} values of {self.key}"


class PhaseResonance(Result):
    """A test of phase resonance, a row a value of a number of the scene.

    Attributes:
        key: key of the number in the scene; ``range``, its range; ``gains``, those of the loop; ``noise``, what readings are off by.
        value, locked (1: the loop came to rest), periods (until it did), note [n].
        omega, lag, amplitude, force, work [n], and their standard errors omega_error, lag_error, amplitude_error, force_error, work_error.
        energy, kinetic (the largest ones), damping (W/(4πK) with K the largest kinetic energy) [n].
        sensitivity: by key of the scene ``omega``, ``amplitude`` and ``work`` [n]: derivatives at phase resonance.
    """

    key: str
    range: np.ndarray
    gains: np.ndarray
    value: np.ndarray
    locked: np.ndarray
    periods: np.ndarray
    omega: np.ndarray
    omega_error: np.ndarray
    lag: np.ndarray
    lag_error: np.ndarray
    amplitude: np.ndarray
    amplitude_error: np.ndarray
    force: np.ndarray
    force_error: np.ndarray
    work: np.ndarray
    work_error: np.ndarray
    energy: np.ndarray
    kinetic: np.ndarray
    damping: np.ndarray
    note: np.ndarray
    wall_s: float

    def _groups(self) -> list[str]:
        return ["phase_resonance"]

    @property
    def sensitivity(self) -> dict[str, Group]:
        """``phase_resonance(..., sensitivity=[...])``: by key of the scene the derivatives by it of ``omega``, ``amplitude`` and ``work`` [n], the frequency following the phase."""
        group = self["phase_resonance"]["sensitivity"]
        return {key: group[key] for key in group.keys()}

    @property
    def noise(self) -> float:
        """Standard deviation of what readings are off by."""
        return float(self["phase_resonance"]["noise"])

    def __len__(self) -> int:
        return len(self.value)

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {int(self.locked.sum())} of {len(self)} values of {self.key} at phase resonance"


class Bands(Result):
    """A family with what the numbers of its scene are known to: a row an orbit, branch by branch in the order of the walk.

    Attributes:
        branch, index, note [n]: which orbit of the family; why derivatives are missing, where they are.
        omega, amplitude, energy [n]; amplitude_deviation, energy_deviation, standard deviations at the frequency of the orbit; amplitude_along, energy_along, derivatives
            by the frequency along the branch.
        sensitivity: by key of the scene ``value``, ``deviation``, and the derivatives ``amplitude`` and ``energy`` [n].
    """

    branch: np.ndarray
    index: np.ndarray
    omega: np.ndarray
    amplitude: np.ndarray
    amplitude_deviation: np.ndarray
    amplitude_along: np.ndarray
    energy: np.ndarray
    energy_deviation: np.ndarray
    energy_along: np.ndarray
    note: np.ndarray
    wall_s: float

    def _groups(self) -> list[str]:
        return ["bands"]

    @property
    def sensitivity(self) -> dict[str, Group]:
        group = self["bands"]["sensitivity"]
        return {key: group[key] for key in group.keys()}

    def __len__(self) -> int:
        return len(self.omega)

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {int(np.isfinite(self.amplitude_deviation).sum())} of {len(self)} orbits with derivatives by {', '.join(self.sensitivity)}"


class Tori(Result):
    """Motions of two frequencies, a row a closed curve of the period map: from where an orbit loses its stability to one on.

    Attributes:
        omega, rotation_number, size (of the first coefficient), tail (the last coefficients over it), attraction (below 1: it attracts), amplitude, force [n].
        start: frequency of the orbit that it begins at; ``end``, how it ended.
        curves: by number ``x`` [2 K + 1, 2 n_o], states at phase zero of the loads, and ``lead`` [2 K + 1, 2], displacement and velocity of the contact point that moves most.
    """

    omega: np.ndarray
    rotation_number: np.ndarray
    size: np.ndarray
    tail: np.ndarray
    attraction: np.ndarray
    amplitude: np.ndarray
    force: np.ndarray
    start: float
    end: str
    wall_s: float

    def _groups(self) -> list[str]:
        return ["tori"]

    @property
    def curves(self) -> list[Group]:
        return [self["tori"][str(k)] for k in range(len(self))]

    def __len__(self) -> int:
        return len(self.omega)

    def _text(self) -> str:
        return f"{self.title!r}: {self.status}, {len(self)} curves, {self.end}"


class Comparison(Result):
    """Contact methods, meshes and parameters side by side, one row each; its columns by name [rows].

    Attributes:
        variant, changed, mesh_name, note: what the row is (``note``: why there is nothing, where there is nothing).
        error, difference, pressure_error, impulse, energy_change, energy_drift, switches, wall_s, ...: its numbers.
        rows: all of it, as a list of dicts.
    """

    @property
    def rows(self) -> list[dict[str, Any]]:  # type: ignore[override]
        columns = {k: v for k, v in self["comparison"].to_dict().items() if isinstance(v, np.ndarray)}
        count = len(columns["variant"])
        return [{k: v[i].item() for k, v in columns.items()} for i in range(count)]

    @property
    def mesh_name(self) -> np.ndarray:
        return self["comparison"]["mesh"]

    def _groups(self) -> list[str]:
        return ["comparison"]

    def __len__(self) -> int:
        return len(self["comparison"]["variant"])


class ModesOf:
    """Natural modes: ``omega`` [k] and ``shapes`` [k, n_o] in the order of u_O, of unit modal mass."""

    def __init__(self, said: dict[str, Any]):
        self.omega: np.ndarray = np.array(said["omega"], dtype=float)
        self.shapes: np.ndarray = np.array(said["shapes"], dtype=float)

    def __repr__(self) -> str:
        return f"<omega = {self.omega}>"


class Modes:
    """Natural modes of the body: ``open`` (no contact) and ``closed`` (all contact points held; None where that has no modes)."""

    def __init__(self, said: dict[str, Any]):
        self.title: str = said["title"]
        self.n_o: int = said["n_o"]
        self.open = ModesOf(said["open"])
        self.closed = ModesOf(said["closed"]) if said["closed"] else None
        # around the equilibrium, where the scene begins at it
        self.rest = ModesOf(said["rest"]) if said.get("rest") else None

    def to_pandas(self) -> pandas.DataFrame:
        """Frequencies, a column a state of the contact."""
        from . import _tables

        return _tables.pandas_of(self)

    def __repr__(self) -> str:
        return f"<Modes of {self.title!r}: open {self.open}, closed {self.closed}>"


class Figure:
    """A number that an answer hangs on: its ``kind`` ("frequency", "force", "displacement", ...), its ``name``, its ``value`` on the body of the scene, the values on the bodies
    ``beside`` it and how far it is from them (``relative``), both [bodies], not a number where one has none."""

    def __init__(self, said: dict[str, Any]):
        self.kind: str = said["kind"]
        self.name: str = said["name"]
        self.value: float = said["value"]
        self.beside: np.ndarray = np.array(said["beside"], dtype=float)
        self.relative: np.ndarray = np.array(said["relative"], dtype=float)

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name}: {self.value:.6g}, relative {self.relative}>"


class Trust:
    """How far a mesh may be trusted: ``figures`` on the body of the scene and on those ``beside`` it (dicts: what was replaced, in words, displacements), ``warnings``, and
    ``words`` to quote."""

    def __init__(self, said: dict[str, Any]):
        self.mesh: str = said["mesh"]
        self.n_dof: int = said["n_dof"]
        self.beside: list[dict[str, Any]] = said["beside"]
        self.figures = [Figure(f) for f in said["figures"]]
        self.warnings: list[str] = said["warnings"]
        self.words: list[str] = said["words"]

    def to_pandas(self) -> pandas.DataFrame:
        """The figures, a row each, with a column of relative distances for each body beside."""
        from . import _tables

        return _tables.pandas_of(self)

    def __repr__(self) -> str:
        return f"<Trust in {self.mesh}: " + "; ".join(self.words) + ">"


AnyResult = Union[Run, Orbit, Family, Crosscheck, Bands, Tori, Curves, Diagram, PhaseResonance, Basins, Comparison]


def load(store: Store, said: dict[str, Any] | None = None) -> AnyResult:
    """The object of a file, by what the file holds."""
    names = dict(_signorini.entries(fspath(store.path), ""))
    kinds: list[tuple[str, type]] = [
        ("comparison", Comparison),
        ("basins", Basins),
        ("diagram", Diagram),
        ("phase_resonance", PhaseResonance),
        ("bands", Bands),
        ("tori", Tori),
        ("curves", Curves),
        ("crosscheck", Crosscheck),
        ("backbone", Family),
        ("orbit", Orbit),
        ("trajectory", Run),
    ]
    for name, kind in kinds:
        if name in names:
            return kind(store, said)
    raise FileError(f"{store.path}: no results of signorini are in it")


def open(path: str | PathLike[str]) -> AnyResult:
    """A file of results, of this package or of the command line: a ``Run``, ``Orbit``, ``Family``, ``Crosscheck``, ``Bands``, ``Tori``, ``Curves``, ``Diagram``, ``PhaseResonance``, ``Basins`` or ``Comparison``.

    Raises:
        FileNotFoundError: there is none.
        FileError: it is none of this program's, or damaged.
    """
    return load(Store(path))
