"""Results as tables of pandas and arrays of xarray with names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._results import Basins, Curves, Family, Modes, Result, Run, Trust

if TYPE_CHECKING:
    import pandas
    import xarray

#: Axes of components, by their number.
AXES = ["x", "y", "z"]


def needs(name: str, what: str) -> ImportError:
    return ImportError(f'{what} needs {name}: pip install "signorini[tables]"')


def pandas_of(result: Result | Modes | Trust) -> pandas.DataFrame:
    """The rows of a result: stored states of a run, by time; points of a family, a diagram, a test, a comparison; cells of basins; points of curves."""
    try:
        import pandas
    except ImportError as e:
        raise needs("pandas", "to_pandas") from e
    if isinstance(result, Modes):
        phases = [("open", result.open), ("closed", result.closed), ("rest", result.rest)]
        return pandas.DataFrame({name: pandas.Series(of.omega) for name, of in phases if of is not None})
    if isinstance(result, Trust):
        columns = {"kind": [f.kind for f in result.figures], "name": [f.name for f in result.figures], "value": [f.value for f in result.figures]}
        relative = {body["replaced"]: [f.relative[k] for f in result.figures] for k, body in enumerate(result.beside)}
        return pandas.DataFrame({**columns, **relative})
    if isinstance(result, Run):
        return pandas.DataFrame(_of_run(result), index=pandas.Index(result.t, name="t"))
    if isinstance(result, Basins):
        columns = dict(zip(result.axes, result.starts.T))
        return pandas.DataFrame({**columns, "attractor": result.attractor, "maps": result.maps})
    if isinstance(result, Curves):
        tables = [_rows([curve], len(curve)) | {"curve": np.full(len(curve), k)} for k, curve in enumerate(result)]
        return pandas.concat([pandas.DataFrame(t) for t in tables], ignore_index=True) if tables else pandas.DataFrame()
    rows = _rows([result[g] for g in result._groups() if g in result], len(result))  # type: ignore[arg-type]
    if isinstance(result, Family):
        for name, ends in result.extremes.items():
            rows |= {f"least_{name}": ends[:, 0], f"largest_{name}": ends[:, 1]}
    return pandas.DataFrame(rows)


def _rows(groups: list[Any], count: int) -> dict[str, np.ndarray]:
    """Datasets of groups that have one entry a row; the group that comes first has the name."""
    columns: dict[str, np.ndarray] = {}
    for group in groups:
        for name in group.keys():
            value = group[name]
            if isinstance(value, np.ndarray) and value.ndim == 1 and len(value) == count:
                columns.setdefault(name, value)
    return columns


def _of_run(run: Run) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {}
    ledger = run.ledger
    for name in ledger.keys():
        value = ledger[name]
        if name != "t" and isinstance(value, np.ndarray) and len(value) == len(run.t):
            columns[name] = value
    nodes = _contact_names(run, run.pressure.shape[1])
    tables = {"contact_displacement": run.contact_displacement, "pressure": run.pressure, "active": run.active}
    for name, table in tables.items():
        for i in range(table.shape[1]):
            columns[f"{name}[{nodes[i]}]"] = table[:, i]
    forces = {"contact": run.resultants, "support": run.support_forces, "spring": run.spring_forces}
    for kind, of_kind in forces.items():
        for name, force in of_kind.items():
            for axis, column in zip(AXES, force.T):
                columns[f"{kind} {name}" if force.shape[1] == 1 else f"{kind} {name} {axis}"] = column
    for name, quantities in run.probes.items():
        for quantity, table in quantities.items():
            for k, column in enumerate(table.T):
                columns[f"{name} {quantity}[{k}]"] = column
    return columns


def _contact_names(run: Run, points: int) -> np.ndarray:
    """What contact points are called: nodes of the mesh; numbers where they are points of quadrature."""
    if "contact_nodes" in run.mesh and len(run.mesh.contact_nodes) == points:
        return run.mesh.contact_nodes
    return np.arange(points)


def xarray_of(result: Result) -> xarray.Dataset:
    """A dataset with names: of a run displacements and velocities by time, node and axis, contact by time and contact node; of what has rows these."""
    try:
        import xarray
    except ImportError as e:
        raise needs("xarray", "to_xarray") from e
    about = {"title": result.title, "command": result.command, "status": result.status, "units": "those of the scene"}
    if not isinstance(result, Run):
        table = pandas_of(result)
        table.index.name = "row"
        return xarray.Dataset.from_dataframe(table).assign_attrs(about)
    nodes = _nodes(result)
    data: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"t": result.t}
    if nodes is None:
        order = np.arange(result.u.shape[1])
        coordinates["row"] = order
        data |= {"displacement": (("t", "row"), result.u), "velocity": (("t", "row"), result.v)}
    else:
        coordinates |= {"node": nodes, "axis": AXES[: result.mesh.nodes.shape[1]]}
        coordinates |= {f"{axis}0": ("node", result.mesh.nodes[nodes, k]) for k, axis in enumerate(coordinates["axis"])}
        for name, table in [("displacement", result.u), ("velocity", result.v)]:
            at_nodes = [result._at_node(table, n) + result._gone(n, int(name == "velocity")) for n in nodes]
            data[name] = (("t", "node", "axis"), np.stack(at_nodes, axis=1) if at_nodes else np.zeros((len(result.t), 0, len(coordinates["axis"]))))
    points = result.pressure.shape[1]
    coordinates["contact"] = _contact_names(result, points)
    of_contact = {"contact_displacement": result.contact_displacement, "pressure": result.pressure, "active": result.active}
    data |= {name: (("t", "contact"), table) for name, table in of_contact.items()}
    ledger = result.ledger
    for name in ledger.keys():
        if name != "t" and len(ledger[name]) == len(result.t):
            data[name] = (("t",), ledger[name])
    return xarray.Dataset(data, coordinates, about)


def _nodes(run: Run) -> np.ndarray | None:
    """The nodes of which the file keeps all displacements; none where the body has no mesh."""
    body = run.scene.to_dict().get("body")
    if isinstance(body, dict) and body.get("kind") == "matrices":
        return None
    kept = run.columns
    of_nodes = run.mesh.dof_map
    has = np.ones(len(of_nodes), dtype=bool) if kept is None else (np.isin(of_nodes, kept) | (of_nodes < 0)).all(axis=1) & (of_nodes >= 0).any(axis=1)
    return np.flatnonzero(has)
