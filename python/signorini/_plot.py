"""Figures of results, by matplotlib."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from ._results import Bands, Basins, Comparison, Crosscheck, Curves, Diagram, Family, Orbit, PhaseResonance, Result, Run, Tori

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Safe for colour-blind readers (Okabe and Ito).
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]


def draw(result: Result, **options: Any) -> Figure:
    """The figure of a result."""
    try:
        from matplotlib.figure import Figure
    except ImportError as e:
        raise ImportError('pictures need matplotlib: pip install "signorini[plot]"') from e

    class Shown(Figure):
        """A figure that a notebook shows, without pyplot."""

        def _repr_png_(self) -> bytes:
            image = io.BytesIO()
            self.savefig(image, format="png", dpi=110)
            return image.getvalue()

    drawn = [(Bands, _bands), (Basins, _basins), (Comparison, _comparison), (Crosscheck, _crosscheck), (Curves, _curves), (Diagram, _diagram), (Family, _family), (Orbit, _orbit), (PhaseResonance, _phase_resonance), (Run, _run), (Tori, _tori)]
    for kind, of in drawn:
        if isinstance(result, kind):
            return of(Shown, result, **options)
    raise TypeError(f"no figure of {type(result).__name__}")


def _clean(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.spines[["top", "right"]].set_visible(False)


def _above(axes: Axes, columns: int) -> None:
    """The legend above the chart, where no line is."""
    axes.legend(fontsize="small", frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=columns, borderaxespad=0.2)


def _basins(figure: type[Figure], basins: Basins) -> Figure:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    shown = figure(figsize=(7, 6), layout="constrained")
    axes = shown.subplots()
    free = [k for k, (low, high) in enumerate(basins.range) if low < high]
    x, y = free[0], free[min(1, len(free) - 1)]
    marks = []
    for k in np.unique(basins.attractor):
        colour = COLOURS[k % len(COLOURS)] if k >= 0 else "0.6"
        own = basins.attractor == k
        if basins.size:
            edges = [np.linspace(*basins.range[j], basins.size + 1) for j in (x, y)]
            cells = np.ma.masked_equal(own.reshape(basins.size, basins.size), False)
            axes.pcolormesh(*edges, cells, cmap=ListedColormap([colour]), alpha=0.45, lw=0, rasterized=True)
        else:
            axes.plot(basins.starts[own, x], basins.starts[own, y], "o", ms=3, color=colour, alpha=0.45, mew=0)
        name = repr(basins[int(k)])[1:-1].removeprefix("Attractor: ") if k >= 0 else f"code {k}"
        marks.append(Patch(color=colour, alpha=0.45, label=name))
    for k, attractor in enumerate(basins):
        axes.plot(attractor.at[:, x], attractor.at[:, y], "o", ms=3, color=COLOURS[k % len(COLOURS)])
    shown.legend(handles=marks, frameon=False, loc="outside lower center", ncols=2)
    _clean(axes, basins.axes[x], basins.axes[y])
    axes.set_title(f"{basins.title}: basins at ω = {basins.omega:.6g}", loc="left")
    return shown


def _diagram(figure: type[Figure], diagram: Diagram) -> Figure:
    shown = figure(figsize=(7, 6), layout="constrained")
    depths, exponents = shown.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    lead = int(np.argmax(np.nanmax(diagram.peak - diagram.trough, axis=0)))
    for sign, colour in [(1, COLOURS[0]), (-1, COLOURS[1])]:
        rows = diagram.direction == sign
        dots = rows[diagram.points_of]
        depths.plot(diagram.value[diagram.points_of[dots]], diagram.least[dots, lead], ".", ms=3, color=colour)
        exponents.plot(diagram.value[rows], diagram.lyapunov[rows], ".", ms=3, color=colour)
    exponents.axhline(0, color="0.3", lw=0.8)
    _clean(depths, "", "least contact displacement in each period")
    _clean(exponents, diagram.key, "largest exponent a period")
    depths.set_title(f"{diagram.title}: over {diagram.key} at ω = {diagram.omega:.6g}", loc="left")
    return shown


def _phase_resonance(figure: type[Figure], test: PhaseResonance) -> Figure:
    shown = figure(figsize=(7, 6), layout="constrained")
    heights, losses = shown.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    at = test.locked == 1
    bars = {"xerr": 2 * test.omega_error[at], "fmt": ".-", "color": COLOURS[0], "ecolor": COLOURS[1], "lw": 1}
    heights.errorbar(test.omega[at], test.amplitude[at], yerr=2 * test.amplitude_error[at], **bars)
    losses.errorbar(test.omega[at], test.damping[at], yerr=2 * (test.damping * test.work_error / test.work)[at], **bars)
    _clean(heights, "", "largest contact displacement")
    _clean(losses, "frequency", "damping ratio W/(4πK)")
    heights.set_title(f"{test.title}: phase resonance over {test.key}", loc="left")
    return shown


def _tori(figure: type[Figure], tori: Tori) -> Figure:
    shown = figure(figsize=(7, 6), layout="constrained")
    section, numbers = shown.subplots(2, 1, height_ratios=[2, 1])
    for k, curve in enumerate(tori.curves):
        closed = np.vstack([curve.lead, curve.lead[:1]])
        section.plot(*closed.T, lw=1, color=COLOURS[0], alpha=0.3 + 0.7 * (k + 1) / len(tori))
    numbers.plot(tori.omega, tori.rotation_number, ".-", color=COLOURS[0], lw=1)
    _clean(section, "displacement of the contact point that moves most", "its velocity")
    _clean(numbers, "frequency of the loads", "rotation number")
    section.set_title(f"{tori.title}: motions of two frequencies", loc="left")
    return shown


def _bands(figure: type[Figure], bands: Bands) -> Figure:
    shown = figure(figsize=(7, 6), layout="constrained")
    heights, shares = shown.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k in np.unique(bands.branch):
        own = bands.branch == k
        omega, height, sigma = bands.omega[own], bands.amplitude[own], bands.amplitude_deviation[own]
        # across the curve, in units of both axes: finite at folds
        units = np.ptp(bands.omega) or 1.0, np.ptp(bands.amplitude) or 1.0
        slope = bands.amplitude_along[own] * units[0] / units[1]
        up = 2 * sigma / (1 + slope**2)
        aside = -slope * up * units[0] / units[1]
        for i in range(len(omega) - 1):
            # behind a fold the upper side is the other one
            turn = np.sign(aside[i] * aside[i + 1] / units[0] ** 2 + up[i] * up[i + 1] / units[1] ** 2)
            corners = [(omega[j] + s * aside[j], height[j] + s * up[j]) for j, s in [(i, -1), (i, 1), (i + 1, turn), (i + 1, -turn)]]
            if np.isfinite(corners).all():
                heights.fill(*zip(*corners), color=COLOURS[0], alpha=0.25, lw=0)
        heights.plot(omega, height, color=COLOURS[0], lw=1.2)
        for number, (key, by) in enumerate(bands.sensitivity.items()):
            part = (by.amplitude[own] * by.deviation / sigma) ** 2
            shares.plot(omega, part, color=COLOURS[(number + 1) % len(COLOURS)], lw=1.2, label=key if k == bands.branch[0] else None)
    shares.legend(frameon=False)
    _clean(heights, "", "largest contact displacement")
    _clean(shares, "frequency", "share of the variance")
    heights.set_title(f"{bands.title}: ± 2 standard deviations, across the curve", loc="left")
    return shown


def _curves(figure: type[Figure], curves: Curves) -> Figure:
    shown = figure(figsize=(7, 5), layout="constrained")
    plane, heights = shown.subplots(2, 1, height_ratios=[3, 2])
    for k, curve in enumerate(curves):
        colour = COLOURS[k % len(COLOURS)]
        rows = np.r_[0 : len(curve), 0] if curve.closed else np.arange(len(curve))
        for axes, x, y in [(plane, curve.omega, curve.value), (heights, curve.value, curve.amplitude)]:
            axes.plot(x[rows], y[rows], color=colour)
            cusps = np.array([word == "cusp" for word in curve.special])
            axes.plot(x[cusps], y[cusps], "o", color=colour)
    _clean(plane, "frequency", curves.key)
    _clean(heights, curves.key, "largest contact displacement")
    plane.set_title(f"{curves.title}: {curves.of}", loc="left")
    return shown


#: At most so many contact points have curves where nobody chooses.
SHOWN = 12


def _shown(r: Run, nodes: Sequence[int] | None) -> list[int]:
    """The contact points that have curves, as the command's pictures choose them: those of the largest pressures first, the rest evenly."""
    count = r.pressure.shape[1]
    if nodes is not None:
        names = list(r.mesh.get("contact_nodes", range(count)))
        missing = [n for n in nodes if n not in names]
        if missing:
            raise ValueError(f"nodes={missing}: not contact nodes; these are {names}")
        return [i for i in range(count) if names[i] in nodes]
    if count <= SHOWN:
        return list(range(count))
    largest = r.pressure.max(axis=1)
    drawn, chosen = np.zeros(len(largest)), []
    while len(chosen) < SHOWN:
        # where those drawn fall shortest of the largest pressure
        row = int((largest - drawn).argmax())
        if largest[row] - drawn[row] <= 0.01 * largest.max():
            break
        chosen.append(int(r.pressure[row].argmax()))
        drawn = np.maximum(drawn, r.pressure[:, chosen[-1]])
    rest = [i for i in range(count) if i not in chosen]
    missing = SHOWN - len(chosen)
    chosen += [rest[k * (len(rest) - 1) // max(missing - 1, 1)] for k in range(missing)]
    return sorted(chosen)


def _name(r: Run, i: int) -> str:
    nodes = r.mesh.get("contact_nodes")
    return f"point {i}" if nodes is None else f"node {nodes[i]}"


def _shade(axes: Axes, t: np.ndarray, touching: np.ndarray) -> None:
    """Grey where any contact point touches."""
    edges = np.flatnonzero(np.diff(np.r_[False, touching, False].astype(int)))
    for a, b in zip(edges[::2], edges[1::2]):
        axes.axvspan(t[a], t[min(b, len(t) - 1)], color="0.92", lw=0)


def _deformed(axes: Axes, r: Run, row: int) -> None:
    """The deformed mesh at a stored state, with the undeformed outline."""
    from matplotlib.collections import PolyCollection

    nodes = r.mesh.nodes[:, :2]
    moved = nodes.copy()
    for c in range(2):
        column = r.mesh.dof_map[:, c] if r.mesh.dof_map.shape[1] > c else np.full(len(nodes), -1)
        moved[column >= 0, c] += r.u[row, column[column >= 0]]
    for node in set(r.mesh.contact_nodes):
        moved[node] += r._gone(node, 0)[row, :2]
    # corners come first; nodes on sides are left out
    corners = {3: 3, 6: 3, 4: 4, 8: 4, 9: 4}
    faces = []
    for e in r.mesh.elements:
        e = e[e >= 0]
        faces.append(moved[e[: corners.get(len(e), len(e))]])
    size = np.linalg.norm(moved - nodes, axis=1)
    shade = [size[e[e >= 0]].mean() for e in r.mesh.elements]
    cells = PolyCollection(faces, array=np.array(shade), cmap="viridis", edgecolors="white", linewidths=0.3)
    axes.add_collection(cells)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_title(f"t = {r.t[row]:.4g}, coloured by |u|", fontsize="medium")
    _clean(axes, "x", "y")


def _run(make: type[Figure], r: Run, at: float | None = None, nodes: Sequence[int] | None = None) -> Figure:
    """Contact displacements and pressures in time (of ``nodes``), the energies, and (in the plane) the body at time ``at``
    [default: when the pressure is largest]; not the body where the file keeps a part of it (``run.store``)."""
    from matplotlib import colormaps

    u_c = r.contact_displacement
    in_plane = r.columns is None and r.mesh.elements.size > 0 and r.mesh.nodes.shape[1] > 1 and np.ptp(r.mesh.nodes[:, 1]) > 0
    figure = make(figsize=(9, 9 if in_plane else 7), layout="constrained")
    axes = figure.subplots(4 if in_plane else 3, 1, sharex=False, height_ratios=[1, 1, 1, 1.6] if in_plane else None)
    touching = r.active.any(axis=1)
    shown = _shown(r, nodes)
    for k, i in enumerate(shown):
        colour = COLOURS[k] if len(shown) <= len(COLOURS) else colormaps["viridis"](0.92 * k / (len(shown) - 1))
        axes[0].plot(r.t, u_c[:, i], color=colour, lw=1.2, label=_name(r, i))
        axes[1].plot(r.t, r.pressure[:, i], color=colour, lw=1.2)
    if shown:
        axes[0].plot(r.t, np.full(len(r.t), r.mesh.gap[shown[0]]), color="black", lw=0.8, ls="--", label="obstacle")
        _above(axes[0], 7)
    for a in axes[:3]:
        _shade(a, r.t, touching)
        a.set_xlim(r.t[0], r.t[-1])
    _clean(axes[0], "t", "contact displacement")
    _clean(axes[1], "t", "pressure")
    e = r.ledger
    known = np.isfinite(e.kinetic)
    # a run may know the whole body at some states only (run.store): those stand by themselves
    style = "-" if known.all() else "o"
    for name, colour in zip(("kinetic", "elastic"), COLOURS):
        axes[2].plot(e.t[known], e[name][known], style, color=colour, lw=1.2, ms=4, label=name)
    axes[2].plot(e.t[known], (e.kinetic + e.elastic)[known], style, color="black", lw=1.2, ms=4, label="sum")
    _above(axes[2], 3)
    _clean(axes[2], "t", "energy")
    if in_plane:
        loaded = r.pressure.max(axis=1) if r.pressure.size else np.zeros(1)
        _deformed(axes[3], r, int(loaded.argmax()) if at is None else int(np.abs(r.t - at).argmin()))
    figure.suptitle(r.title)
    return figure


def _orbit(make: type[Figure], o: Orbit) -> Figure:
    """Phase portrait of the contact point that moves most, the motion over a period, the multipliers."""
    figure = make(figsize=(11, 4), layout="constrained")
    portrait, motion, plane = figure.subplots(1, 3)
    u_c = o.contact_displacement
    i = int(np.ptp(u_c, axis=0).argmax())
    portrait.plot(u_c[:, i], o.contact_velocity[:, i], color=COLOURS[0], lw=1.2)
    portrait.axvline(o.mesh.gap[i], color="black", lw=0.8, ls="--")
    _clean(portrait, f"displacement of {_name(o, i)}", "velocity")
    motion.plot(o.t / o.period, u_c, lw=1.0)
    motion.axhline(o.mesh.gap[i], color="black", lw=0.8, ls="--")
    _shade(motion, o.t / o.period, o.active.any(axis=1))
    _clean(motion, "t / T", "contact displacements")
    _unit_circle(plane, o.multipliers)
    figure.suptitle(f"{o.title}: omega = {o.omega:.6g}, energy {o.energy:.6g}")
    return figure


def _unit_circle(axes: Axes, multipliers: np.ndarray) -> None:
    angle = np.linspace(0, 2 * np.pi, 361)
    axes.plot(np.cos(angle), np.sin(angle), color="0.6", lw=0.8)
    axes.plot(multipliers.real, multipliers.imag, "o", ms=4, mfc="none", color=COLOURS[1])
    axes.set_aspect("equal")
    _clean(axes, "Re", "Im")
    axes.set_title("Floquet multipliers", fontsize="medium")


def _family(make: type[Figure], f: Family, axis: str | None = None) -> Figure:
    """Energy and amplitude (or one of them, ``axis="energy"``) against frequency, joined along branches that were followed; unstable orbits hollow."""
    shown = ["energy", "amplitude"] if axis is None else [axis]
    figure = make(figsize=(7, 2 + 3 * len(shown)), layout="constrained")
    charts = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, axis in zip(charts, shown):
        y = f[f"backbone/{axis}"]
        for k, name in enumerate(f.branches):
            own = (f.branch == k) & np.isfinite(y)
            colour = COLOURS[k % 7]
            if f.is_followed:
                along = np.flatnonzero(own)[np.argsort(f["backbone"]["index"][own], kind="stable")]
                axes.plot(f.omega[along], y[along], "-", lw=1.1, color=colour, alpha=0.6)
            hollow = own & (f.stable == 0)
            axes.plot(f.omega[own & ~hollow], y[own & ~hollow], "o", ms=3.5, color=colour, label=name)
            axes.plot(f.omega[hollow], y[hollow], "o", ms=3.5, mfc="none", color=colour)
        _clean(axes, "", axis)
    if len(f.branches) > 1:
        charts[0].legend(fontsize="small", frameon=False)
    charts[-1].set_xlabel("circular frequency")
    charts[0].set_title(f.title + (" (hollow: unstable)" if (f.stable == 0).any() else ""), fontsize="medium")
    return figure


def _wide(axes: Axes, *values: np.ndarray) -> None:
    """A logarithmic axis where the values span a decade; a linear one has readable ticks below."""
    x = np.abs(np.concatenate(values))
    x = x[np.isfinite(x) & (x > 0)]
    if len(x) and x.max() > 10 * x.min():
        axes.set_yscale("log")
        axes.set_ylim(10 ** np.floor(np.log10(x.min() / 1.2)), 10 ** np.ceil(np.log10(1.2 * x.max())))


def _crosscheck(make: type[Figure], c: Crosscheck) -> Figure:
    """Energies of the series and of the orbits that shooting finds from them; how far both are from each other."""
    figure = make(figsize=(9.5, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    own_orbit, other = c.verdict == "orbit", c.verdict == "another orbit"
    found = own_orbit | other
    for k, n in enumerate(np.unique(c.harmonics)):
        own, colour = c.harmonics == n, COLOURS[k % 7]
        left.plot(c.omega[own], c.hbm_energy[own], "-", lw=1.2, color=colour, label=f"series, N_h = {int(n)}")
        right.plot(c.omega[own], c.residual[own], "-", lw=1.2, color=colour)
        for which, filled in [(own & own_orbit, colour), (own & other, "none")]:
            left.plot(c.omega[which], c.orbit_energy[which], "o", ms=4.5, mfc=filled, color=colour)
            right.plot(c.omega[which], c.moved[which], "o", ms=4.5, mfc=filled, color=colour)
    # what marks mean, once, in grey
    marks = [(own_orbit, "0.3", "orbit of the series"), (other, "none", "another orbit")]
    for _, filled, name in (m for m in marks if m[0].any()):
        left.plot([], [], "o", ms=4.5, mfc=filled, color="0.3", label=name)
    right.plot([], [], "-", lw=1.2, color="0.3", label="residual in time")
    if found.any():
        right.plot([], [], "o", ms=4.5, mfc="none", color="0.3", label="distance to the orbit")
    _wide(left, c.hbm_energy, c.orbit_energy[found])
    _wide(right, c.residual, c.moved[found])
    for axes, y in [(left, "energy"), (right, "relative")]:
        _above(axes, 3)
        _clean(axes, "circular frequency", y)
    figure.suptitle(c.title, x=0.01, ha="left")
    return figure


def _comparison(make: type[Figure], c: Comparison, column: str = "error") -> Figure:
    """A column against the size of the elements."""
    figure = make(figsize=(6.5, 5), layout="constrained")
    axes = figure.subplots()
    y, h = c["comparison"][column], c["comparison"]["h"]
    for k, name in enumerate(dict.fromkeys(c["comparison"]["variant"])):
        own = c["comparison"]["variant"] == name
        axes.loglog(h[own], np.abs(y[own]), "o-", ms=4, lw=1.2, color=COLOURS[k % 7], label=name)
    axes.legend(fontsize="small", frameon=False)
    _clean(axes, "size of the elements", column)
    axes.set_title(c.title, fontsize="medium")
    return figure
