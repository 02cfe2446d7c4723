"""The numbers that the Rust tests pin, and the files of the command line, through Python."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import signorini as sg

PINNED = re.findall(
    r'\("([\w-]+)", (\d+), ([\d.e-]+), ([\d.e-]+), ([\d.e-]+), \d+\),',
    (Path(__file__).parents[2] / "tests/scenes.rs").read_text(),
)


def test_all_pinned_scenes_are_there():
    assert len(PINNED) >= 18


@pytest.mark.parametrize("name,switches,first,last,energy", PINNED, ids=[p[0] for p in PINNED])
def test_pinned_numbers_of_scenes(name, switches, first, last, energy):
    r = sg.run(f"scenarios/{name}.toml", progress=False)
    assert r.is_complete and r.status == "complete"
    assert len(r.switches) == int(switches)
    assert r.switches.t[0] == pytest.approx(float(first), rel=1e-7)
    assert r.switches.t[-1] == pytest.approx(float(last), rel=1e-7)
    closes = np.isin(r.switches.kind, ["close", "rest"])
    assert set(r.switches.monitor[closes]) <= {"gap", "closing"}
    # with friction a point sticks or slips where it would be closed
    touching = ["stick", "slip+", "slip-"] if "traction" in r["trajectory"].keys() else ["closed"]
    opens = r.switches.kind == "open"
    assert (np.isin(r.switches["to"], touching) != opens).all() and (r.switches["to"][opens] == "open").all()
    if len(touching) > 1:
        sticks, slips = r.switches.kind == "sticking", r.switches.kind == "slipping"
        assert (r.switches["to"][sticks] == "stick").all() and np.isin(r.switches["to"][slips], ["slip+", "slip-"]).all()
        assert r.traction.shape == r.pressure.shape and r.friction_work == pytest.approx(r.friction.work.sum())
        assert r.ledger.friction[-1] == pytest.approx(r.friction_work) and (r.friction.path >= 0).all()
    scale = max(abs(r.energy_end), abs(r.energy_start))
    assert abs(r.energy_end - float(energy)) < 1e-7 * scale
    assert r.energy_drift < 1e-9
    # what is stored agrees with what is said
    assert r.t[-1] == r.t_end and len(r.t) == len(r.u) == len(r.v) == len(r.pressure)
    # what springs of sliders remember stands behind the displacements of nodes
    remembered = {"joint": 9, "brake-reuss": 24}.get(name, 0)
    assert r.u.shape[1] == (r.mesh.dof_map >= 0).sum() + remembered if "contact_points" not in r.mesh else True
    total = r.ledger.kinetic + r.ledger.elastic
    assert total[-1] == pytest.approx(r.energy_end, rel=1e-9, abs=1e-12 * scale)


def everything(path):
    """All datasets of a file by h5py, which knows nothing of this package."""
    import h5py

    found = {}
    with h5py.File(path) as f:
        f.visititems(lambda name, o: found.update({name: o[()]}) if isinstance(o, h5py.Dataset) else None)
    return found


def test_arrays_are_those_of_the_command_line_bit_for_bit(tmp_path, command):
    path = tmp_path / "plate.h5"
    subprocess.run([command, "run", "scenarios/plate.toml", "-o", path, "-q"], check=True)
    theirs = everything(path)
    r = sg.run("scenarios/plate.toml")
    kept = everything(r.save(tmp_path / "own.h5"))
    assert set(theirs) == set(kept)
    for name, data in theirs.items():
        mine = r[name]
        if data.dtype.kind in "SO":
            assert list(mine) == [x.decode() for x in data], name
            assert list(kept[name]) == list(data), name
        else:
            assert mine.dtype == data.dtype and np.array_equal(mine, data, equal_nan=True), name
            assert np.array_equal(kept[name], data, equal_nan=True), name


def test_matrices_of_a_reduced_body_are_the_same_in_all_formats(tmp_path, command):
    """NumPy, SciPy and h5py, which know nothing of this package, read what ``signorini reduce`` writes."""
    from scipy.io import loadmat

    for ending in "npz", "mat", "h5":
        subprocess.run([command, "reduce", "scenarios/blade.toml", "-o", tmp_path / f"blade.{ending}", "--basis", "-q"], check=True)
    by_numpy = np.load(tmp_path / "blade.npz")
    by_scipy = loadmat(tmp_path / "blade.mat")
    by_h5py = everything(tmp_path / "blade.h5")
    assert {"K", "M", "C", "W", "B", "gap", "force"} <= set(by_h5py)
    for name, data in by_h5py.items():
        assert np.array_equal(by_numpy[name], data), name
        assert np.array_equal(np.squeeze(by_scipy[name]), np.squeeze(data)), name
    k, m = by_h5py["K"], by_h5py["M"]
    assert np.allclose(k, k.T) and np.linalg.eigvalsh(k)[0] > 0
    # contact displacements have no mass: what has some is definite
    n_c = len(by_h5py["gap"])
    assert not m[-n_c:].any() and np.linalg.eigvalsh(m[:-n_c, :-n_c])[0] > 0


def test_attributes_have_the_names_of_the_json_keys(tmp_path, command):
    said = subprocess.run(
        [command, "run", "scenarios/plate.toml", "-o", tmp_path / "a.h5", "--json"], check=True, capture_output=True
    )
    said = json.loads(said.stdout)
    for r in [sg.run("scenarios/plate.toml"), sg.open(tmp_path / "a.h5")]:
        for key, value in said.items():
            mine = getattr(r, key)
            if key == "probes":
                assert value == [] and mine == {}
            elif key in ("switches", "grazings", "forces", "excursions"):
                assert len(mine) == len(value)
                for name in value[0] if value else ():
                    assert [row[name] for row in value] == mine[name].tolist()
            elif isinstance(value, dict):
                for name, x in value.items():
                    assert np.array_equal(getattr(mine, name), x) if x is not None else True
            elif key not in ("wall_s", "output"):
                assert mine == value, key


def test_excursions_are_those_of_the_command_line(tmp_path, command):
    said = subprocess.run([command, "run", "scenarios/blocks.toml", "-o", tmp_path / "b.h5", "--json"], check=True, capture_output=True)
    value = json.loads(said.stdout)["excursions"]
    assert [row["kind"] for row in value] == ["sliding", "rotation", "rotation"]
    for mine in [sg.run("scenarios/blocks.toml").excursions, sg.open(tmp_path / "b.h5").excursions]:
        for name in value[0]:
            assert [row[name] for row in value] == mine[name].tolist()


def test_probes_see_what_the_trajectory_has(tmp_path):
    with open("scenarios/plate.toml") as file:
        text = file.read()
    path = tmp_path / "probed.toml"
    path.write_text(text + '\n[[probe]]\nname = "tip"\nnode = 20\nquantity = ["displacement", "stress"]\n')
    r = sg.run(path)
    assert set(r.probes) == {"tip"} and set(r.probes["tip"]) == {"displacement", "stress"}
    assert np.array_equal(r.probes["tip"]["displacement"], r.displacement(20)[:, :2])
    assert r.probes["tip"]["stress"].shape == (len(r.t), 4)


def test_orbit_is_that_of_the_command_line(tmp_path, command):
    words = ["orbit", "scenarios/half-plate-orbit.toml", "--omega", "1.8", "-o", tmp_path / "o.h5", "--json"]
    said = json.loads(subprocess.run([command, *words], check=True, capture_output=True).stdout)
    for o in [sg.orbit("scenarios/half-plate-orbit.toml", 1.8), sg.open(tmp_path / "o.h5")]:
        assert isinstance(o, sg.Orbit) and o.converged and bool(o)
        for key in ["period", "omega", "energy", "amplitude", "contact_time", "stable", "admissible", "newton_iterations"]:
            assert getattr(o, key) == pytest.approx(said[key], rel=1e-14), key
        pairs = np.array(said["multipliers"])
        assert np.array_equal(o.multipliers, pairs[:, 0] + 1j * pairs[:, 1])
        assert len(o.switches) == len(said["switches"]) == 8
        # the motion closes
        assert np.abs(o.u[-1] - o.u[0]).max() < 1e-10
        assert o.alpha is None and o.forcing_periods is None
        assert o.energy_drift < 1e-12 and o.n_contact == 4
    viscous = sg.orbit("scenarios/half-plate-viscous.toml", 1.8, viscous=True)
    assert viscous.alpha > 0 and viscous.stable is None


def test_derivatives_of_an_orbit_are_those_of_the_command_line(tmp_path, command):
    keys = ["contact.gap", "damping.rayleigh[0]", "omega"]
    words = ["orbit", "scenarios/driven-stop.toml", "-o", tmp_path / "o.h5", "--json", "--sensitivity", ",".join(keys)]
    said = json.loads(subprocess.run([command, *words], check=True, capture_output=True).stdout)
    for o in [sg.orbit("scenarios/driven-stop.toml", sensitivity=keys), sg.open(tmp_path / "o.h5")]:
        assert list(o.sensitivity) == sorted(keys) and o.peaks == said["peaks"]
        for key, by in o.sensitivity.items():
            for name in ("value", "amplitude", "pressure", "energy"):
                assert by[name] == said["sensitivity"][key][name], (key, name)
            assert np.array_equal(by.multipliers, said["sensitivity"][key]["multipliers"])
    with pytest.raises(sg.SceneError, match="no number that stands in the scene"):
        sg.orbit("scenarios/driven-stop.toml", sensitivity="contact.gpa")
    assert sg.orbit("scenarios/half-plate-orbit.toml", 1.8).sensitivity == {}


def test_curves_are_those_of_the_command(command, tmp_path):
    words = ["curve", "scenarios/driven-stop.toml", "--of", "doubling", "--over", "load[0].amplitude=0.08,0.12", "--json"]
    said = json.loads(subprocess.run([command, *words, "-o", tmp_path / "c.h5"], check=True, capture_output=True).stdout)
    for c in [sg.curve("scenarios/driven-stop.toml", "doubling", {"load[0].amplitude": (0.08, 0.12)}), sg.open(tmp_path / "c.h5")]:
        assert (c.of, c.key, len(c)) == ("doubling", "load[0].amplitude", len(said["curves"])) and len(c) > 0
        for curve, of in zip(c, said["curves"]):
            assert curve.omega.tolist() == of["omega"] and curve.value.tolist() == of["value"]
            assert list(curve.special) == of["special"] and curve.closed == of["closed"]
            assert curve.u0.shape == (len(curve), 2) and curve.periods == 1 and curve.node is None
    assert c.plot() is not None
    with pytest.raises(sg.SceneError, match="outside of 0.2 to 0.3"):
        sg.curve("scenarios/driven-stop.toml", "fold", {"load[0].amplitude": (0.2, 0.3)})


def test_basins_are_those_of_the_command(command, tmp_path):
    words = ["basins", "scenarios/two-mass-stop.toml", "--omega", "0.7", "--size", "6", "--json", "-o", tmp_path / "b.h5"]
    said = json.loads(subprocess.run([command, *words], check=True, capture_output=True).stdout)
    for b in [sg.basins("scenarios/two-mass-stop.toml", omega=0.7, size=6), sg.open(tmp_path / "b.h5")]:
        assert (b.axes, b.size, b.omega, len(b)) == (["q1", "v1"], 6, 0.7, len(said["attractors"])) and len(b) == 2
        assert b.grid.shape == (6, 6) and b.starts.shape == (36, 2) and b.maps.sum() == said["maps"]
        assert b.starts[1, 0] > b.starts[0, 0] and b.starts[1, 1] == b.starts[0, 1]
        for k, (attractor, of) in enumerate(zip(b, said["attractors"])):
            assert (b.attractor == k).sum() == of["count"] and attractor.share == of["share"]
            assert attractor.period_number == 1 and len(attractor.u0) == 1 and attractor.at.shape == (1, 2)
    assert b.plot() is not None
    drawn = sg.basins("scenarios/two-mass-stop.toml", omega=0.7, plane={"q1": (-2, 2), "q2": (-1, 1), "v1": 0.5}, samples=20, seed=5)
    assert drawn.size is None and (drawn.starts[:, 2] == 0.5).all() and drawn["basins"]["seed"] == "5"
    with pytest.raises(sg.SceneError, match="two for a plane"):
        sg.basins("scenarios/two-mass-stop.toml", omega=0.7, plane={"q1": (-2, 2)})


def test_a_diagram_is_that_of_the_command(command, tmp_path):
    words = ["diagram", "scenarios/two-mass-stop.toml", "--omega", "0.7", "--over", "load[0].amplitude=0.05,0.4", "--steps", "6", "--way", "both", "--json"]
    said = json.loads(subprocess.run([command, *words, "-o", tmp_path / "d.h5"], check=True, capture_output=True).stdout)
    over = {"load[0].amplitude": (0.05, 0.4)}
    for d in [sg.diagram("scenarios/two-mass-stop.toml", over, omega=0.7, steps=6, way="both"), sg.open(tmp_path / "d.h5")]:
        assert d.key == "load[0].amplitude" and d.omega == 0.7 and len(d) == len(said["value"]) >= 14
        assert d.value.tolist() == said["value"] and d.lyapunov.tolist() == said["lyapunov"] and list(d.kind) == said["kind"]
        assert d.direction.tolist() == said["direction"] and d.least.shape[1] == 1
    assert d.plot() is not None


def test_a_test_of_phase_resonance_is_that_of_the_command(command, tmp_path):
    words = ["phase-resonance", "scenarios/driven-stop.toml", "--over", "load[0].amplitude=0.001,0.01", "--steps", "3", "--noise", "0.01", "--json"]
    said = json.loads(subprocess.run([command, *words, "-o", tmp_path / "p.h5"], check=True, capture_output=True).stdout)
    over = {"load[0].amplitude": (0.001, 0.01)}
    for p in [sg.phase_resonance("scenarios/driven-stop.toml", over, steps=3, noise=0.01), sg.open(tmp_path / "p.h5")]:
        assert p.key == "load[0].amplitude" and p.noise == 0.01 and len(p) == 4 and p.locked.all()
        assert p.omega.tolist() == said["omega"] and p.omega_error.tolist() == said["omega_error"] and (p.work > 0).all()
        assert abs(p.lag - np.pi / 2).max() < 0.01 and p.sensitivity == {}
    assert p.plot() is not None
    exact = sg.phase_resonance("scenarios/driven-stop.toml", over, steps=3, sensitivity=["contact.gap", "load[0].amplitude"])
    gap, load = (exact.sensitivity[key] for key in ["contact.gap", "load[0].amplitude"])
    # with gap and load all lengths grow
    assert 0.02 * gap.omega + exact.value * load.omega == pytest.approx(np.zeros(4), abs=1e-9)
    assert 0.02 * gap.amplitude + exact.value * load.amplitude == pytest.approx(exact.amplitude, rel=1e-9)


def test_bands_are_those_of_the_command(command, tmp_path):
    family = sg.response("scenarios/two-mass-stop.toml", tmp_path / "f.h5", method="shooting", range=(0.6, 0.65))
    words = ["bands", tmp_path / "f.h5", "--deviation", "contact.gap=2%,contact.stiffness=1", "-o", tmp_path / "b.h5", "--json"]
    said = json.loads(subprocess.run([command, *words], check=True, capture_output=True).stdout)
    deviations = {"contact.gap": "2%", "contact.stiffness": 1.0}
    for b in [sg.bands(family, deviations), sg.bands(tmp_path / "f.h5", deviations), sg.open(tmp_path / "b.h5")]:
        assert list(b.sensitivity) == ["contact.gap", "contact.stiffness"] and len(b) == len(family) > 5
        assert b.amplitude_deviation.tolist() == said["amplitude_deviation"] and b.sensitivity["contact.gap"].deviation == 0.02
        parts = [by.amplitude * by.deviation for by in b.sensitivity.values()]
        assert np.hypot(*parts) == pytest.approx(b.amplitude_deviation, rel=1e-12)
    assert b.plot() is not None
    with pytest.raises(sg.SceneError, match="orbits"):
        sg.bands(b, deviations)


def test_exponents_of_a_run():
    r = sg.run("scenarios/driven-stop.toml", lyapunov=2, lyapunov_periods=50)
    assert r.lyapunov.growths.shape == (50, 2)
    assert r.lyapunov.exponents.sum() == pytest.approx(r.lyapunov.divergence, abs=1e-12)
    assert sg.run("scenarios/oscillator.toml").lyapunov is None


def test_trust():
    t = sg.trust("scenarios/plate-half.toml")
    raised = [k for k, body in enumerate(t.beside) if body["replaced"] in ("raised", "halved")][0]
    first = next(f for f in t.figures if f.kind == "frequency")
    assert first.relative[raised] == first.value / first.beside[raised] - 1.0 > 0.0
    assert t.words and t.n_dof < t.beside[raised]["n_dof"] and "100 Q4" in repr(t)
    table = t.to_pandas()
    assert list(table["name"]) == [f.name for f in t.figures] and "other-contact" in table


def test_modes():
    m = sg.modes("scenarios/half-plate-orbit.toml", 3)
    assert m.open.omega.shape == (3,) and m.open.shapes.shape == (3, m.n_o)
    assert (m.closed.omega > 0).all()
    # by an eigenvalue solver of others, from the matrices of the same body
    from scipy.io import mmread
    from scipy.linalg import eigh

    k, mass = (mmread(f"validate/foreign/{n}.mtx").toarray() for n in "KM")
    foreign = sg.modes("validate/foreign/half-plate.toml", 3)
    n_c, n_o = (mmread(f"validate/foreign/{n}.mtx").toarray() for n in ("N_C", "N_O"))
    a = np.vstack([np.eye(66), -np.linalg.solve(np.eye(4), np.zeros((4, 66)))])
    # open: the contact stress vanishes, u_C = -N_C^-1 N_O u_O
    a[66:] = -np.linalg.solve(n_c, n_o)
    w = np.sqrt(eigh(a.T @ k @ a, a.T @ mass @ a, eigvals_only=True)[:3])
    assert foreign.open.omega == pytest.approx(w, rel=1e-9)


def test_families():
    scene = "scenarios/half-plate-orbit.toml"
    b = sg.backbone(scene, range=(1.70, 1.75))
    assert len(b) == 11 and np.allclose(b.omega, np.arange(1.70, 1.7501, 0.005))
    assert b.converged.sum() == len([p for p in b if p.converged]) > 0
    assert set(b.stable) <= {-1, 0, 1} and b.hbm is None and b.alpha is None and b.error_statement is None
    assert b.stops[0]["complete"] and b.branches == ["shooting, sequential"]
    k = int(np.flatnonzero(b.converged)[0])
    again = sg.orbit(scene, b.omega[k], near_return=None)
    point = b[k]
    assert point.omega == b.omega[k] and point.energy == b.energy[k] and len(point.switches) == b.switches[k]
    assert point.multipliers.dtype == complex and point.u0.shape == again.u0.shape
    with pytest.raises(IndexError):
        b[11]
    assert b[-1].omega == b.omega[-1]
    r = sg.response("scenarios/half-plate-response.toml", range=(1.4, 1.5), ratios=[0.05])
    assert isinstance(r, sg.Family) and r.converged.all() and (r.stable == 1).any()


def test_ones_own_series_are_checked():
    scene = "scenarios/half-plate-orbit.toml"
    series = sg.backbone(scene, method="hbm", harmonics=[3, 7], range=(1.70, 1.71))
    a = sg.crosscheck(series, scene)
    assert isinstance(a, sg.Crosscheck) and len(a) == len(series)
    own = series.branch[series.hbm.point] == 1
    b = sg.crosscheck((series.hbm.omega[own], series.hbm.coefficients[own]), scene)
    of = a.harmonics == 7
    assert list(b.verdict) == list(a.verdict[of])
    assert b.residual == pytest.approx(a.residual[of], rel=1e-9)
    assert b.moved == pytest.approx(a.moved[of], rel=1e-6, nan_ok=True)
    assert b.summary[0]["points"] == own.sum()
    with pytest.raises(sg.SceneError, match="2 N_h"):
        sg.crosscheck((series.hbm.omega[own], series.hbm.coefficients[own][:, :4]), scene)


def test_comparison(tmp_path):
    c = sg.compare("scenarios/bar.toml", ["nbm", "penalty"], [10, 20], output=tmp_path / "c")
    assert len(c) == 4 and list(c.variant) == ["nbm", "nbm", "penalty", "penalty"]
    assert c.error[1] < c.error[0] and c.rows[2]["mesh"] == "10"
    assert (tmp_path / "c.csv").exists() and sg.open(tmp_path / "c.h5").error == pytest.approx(c.error)
    d = sg.compare("scenarios/bar.toml", "nbm", [10], parameter={"contact.gap": [0.9, 1.0]})
    assert list(d.changed) == ["contact.gap = 0.9", "contact.gap = 1.0"] and not d.error[0] == d.error[1]


def test_all_orbits():
    found = sg.orbits("scenarios/half-plate-orbit.toml", 1.8, amplitudes=3)
    assert len(found) >= 2 and all(o.residual < 1e-10 for o in found)
    assert [o.energy for o in found] == sorted(o.energy for o in found)
    assert found[0].u0.shape == (66,) and len(found[0].switches) > 0 and found[0].multipliers.dtype == complex


def test_a_sweep_says_what_the_body_settles_to():
    s = sg.response("scenarios/driven-stop.toml", range=(1.41, 1.45), sweep="up", progress=False)
    kinds, periods = s.sweep.kind, s.sweep.period_number
    assert {"chaotic", "periodic"} <= set(kinds) and len(s) == len(kinds)
    assert (s.converged == (periods > 0)).all() and np.isfinite(s.energy).all()
    # far beyond the chaos: two periods, whose exponent is that of areas that shrink by e^(-alpha T) (a complex pair)
    last = np.flatnonzero(periods == 2)[-1]
    assert s.sweep.lyapunov[last] == pytest.approx(-0.02 * np.pi / s.omega[last], rel=1e-6)
    branches = sg.response("scenarios/driven-stop.toml", range=(1.41, 1.45), through=s, progress=False)
    assert branches.sweep is None and any(b.startswith("period 2 through") for b in branches.branches)
