"""Tables, notebooks, sweeps, types."""

import gc
import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import signorini as sg
from test_use import BAR

ROOT = Path(__file__).resolve().parents[2]
ORBIT = "scenarios/half-plate-orbit.toml"


def test_a_run_is_a_table_by_time():
    run = sg.run(sg.Scene("scenarios/probed-plate.toml"))
    table = run.to_pandas()
    assert table.index.name == "t" and np.array_equal(table.index, run.t)
    assert np.array_equal(table["kinetic"], run.ledger.kinetic)
    node = run.mesh.contact_nodes[3]
    assert np.array_equal(table[f"pressure[{node}]"], run.pressure[:, 3])
    assert np.array_equal(table[f"contact_displacement[{node}]"], run.contact_displacement[:, 3])
    name, force = next(iter(run.resultants.items()))
    assert np.array_equal(table[f"contact {name} x"], force[:, 0])
    probe, quantities = next(iter(run.probes.items()))
    quantity = next(iter(quantities))
    assert np.array_equal(table[f"{probe} {quantity}[0]"], quantities[quantity][:, 0])
    data = run.to_xarray()
    assert data.displacement.dims == ("t", "node", "axis") and data.attrs["title"] == run.title
    assert np.array_equal(data.displacement.sel(node=node).values, run.displacement(int(node)))
    assert np.array_equal(data.pressure.sel(contact=node).values, run.pressure[:, 3])
    assert float(data.x0.sel(node=node)) == run.mesh.nodes[node, 0]


def test_bodies_of_matrices_have_rows():
    run = sg.run(sg.Scene("scenarios/two-mass-stop.toml").with_({"run": {"until": 5.0}}))
    data = run.to_xarray()
    assert data.displacement.dims == ("t", "row") and np.array_equal(data.displacement.values, run.u)
    assert len(run.to_pandas()) == len(run.t)


def test_families_are_tables_of_points():
    family = sg.backbone(ORBIT, range=(1.8, 1.82), step=0.01)
    table = family.to_pandas()
    assert len(table) == len(family) and np.array_equal(table["omega"], family.omega)
    assert np.array_equal(table["energy"].to_numpy(), family.energy, equal_nan=True) and "special" in table
    assert family.to_xarray().energy.dims == ("row",)
    for name, ends in family.extremes.items():
        assert ends.shape == (len(family), 2) and np.array_equal(table[f"largest_{name}"], ends[:, 1], equal_nan=True)
    assert any(name.startswith("force_x[") for name in family.extremes)
    modes = sg.modes(ORBIT).to_pandas()
    assert modes["open"].iloc[0] < modes["closed"].iloc[0]


def test_notebooks_see_facts_and_a_picture():
    run = sg.run(BAR | {"title": "A <bar> & more"})
    page = run._repr_html_()
    assert "A &lt;bar&gt; &amp; more" in page and "<bar>" not in page.replace("&lt;bar&gt;", "")
    assert 'src="data:image/png;base64,' in page and "energy drift" in page and "complete" in page
    orbit = sg.orbit(ORBIT, 1.8)
    assert "residual" in orbit._repr_html_() and orbit.found() is orbit
    none = sg.orbit(ORBIT, 1.3)
    assert not none and "No orbit at omega = 1.3" in none._repr_html_()
    with pytest.raises(sg.NumericsError):
        none.found()
    scene = sg.Scene(BAR)._repr_html_()
    assert "<details>" in scene and "[contact]" in scene and "bar [1.0] [10]" in scene


def test_a_sweep_has_every_combination_and_goes_on(tmp_path):
    over = {"contact.gap": [0.8, 1.0, 1.2], "body.elements": [[10], [20]]}
    swept = sg.sweep(BAR, over, folder=tmp_path, workers=2)
    assert len(swept) == 6 and swept.keys == ["contact.gap", "body.elements"]
    assert swept.values[1] == {"contact.gap": 0.8, "body.elements": [20]}
    for values, found in zip(swept.values, swept):
        alone = sg.run(sg.Scene(BAR).with_(values))
        assert isinstance(found, sg.Run) and np.array_equal(found.u, alone.u), values
    table = swept.to_pandas(force=lambda r: r.forces.maximum.max())
    assert list(table["contact.gap"]) == [0.8, 0.8, 1.0, 1.0, 1.2, 1.2] and (table["outcome"] == "complete").all()
    assert np.array_equal(table["force"], [r.forces.maximum.max() for r in swept])
    assert "energy_end" in swept.to_pandas() and "6 results of 6" in repr(swept)
    # with one more value the others are not computed again
    before = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    more = sg.sweep(BAR, over | {"contact.gap": [0.8, 0.9, 1.2]}, folder=tmp_path)
    after = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    assert {p: t for p, t in after.items() if p in before} == before and len(after) == len(before) + 4
    assert np.array_equal(more[-1].u, swept[5].u)
    assert not [p for p in tmp_path.iterdir() if ".part" in p.name]


def test_what_a_sweep_does_not_find_is_a_value(tmp_path):
    swept = sg.sweep(ORBIT, {"orbit.omega": [1.8, 1.3], "title": ["a", "b"]}, sg.orbit, side_by_side=True)
    assert isinstance(swept[0], sg.Orbit) and isinstance(swept[1], sg.Verdict)
    held = swept[0]
    del swept
    assert held.u.shape[1] > 0
    failed = sg.sweep(BAR, {"initial.amplitude": [-1.1, 1.3]})
    assert isinstance(failed[0], sg.Run) and not failed[1] and isinstance(failed[1], sg.Failure)
    assert "outcome" in failed.to_pandas()
    with pytest.raises(sg.SceneError):
        sg.sweep(BAR, {"contact.gap": [1.0, "wide"]})
    with pytest.raises(TypeError, match="function"):
        sg.sweep(BAR, {"contact.gap": [1.0]}, sg.modes)
    with pytest.raises(ValueError, match="one length"):
        sg.sweep(BAR, {"contact.gap": [1.0], "body.young": [1.0, 2.0]}, side_by_side=True)


def test_every_function_of_a_sweep_and_all_kinds_of_values(tmp_path):
    scene = sg.Scene("scenarios/two-mass-stop.toml").with_({"orbit.range": [0.6, 0.62]})
    basins = sg.sweep(scene, {"contact.gap": [1.0]}, "basins", samples=2)
    assert isinstance(basins[0], sg.Basins)
    diagram = sg.sweep(scene, {"contact.gap": (g for g in [1.0])}, "diagram", over={"load[0].amplitude": (0.9, 1.0)}, steps=2)
    assert isinstance(diagram[0], sg.Diagram)
    # options are told apart to the last bit, and results by what is in them
    ratios = [np.array([0.05, 0.06]), np.array([0.05, 0.060000001])]
    from signorini._sweep import _digest

    assert len({_digest("response", scene, {"ratios": r}) for r in ratios}) == 2
    runs = [sg.run(BAR | {"contact": {"edge": "right", "gap": g}}) for g in (1.0, 1.05)]
    assert len({_digest("orbit", scene, {"near_return": r}) for r in runs}) == 2
    with pytest.raises(TypeError, match="no value of an option"):
        _digest("run", scene, {"a": object()})
    for wrong, error in [({"threads": 2}, TypeError), ({"workers": 0}, ValueError), ({"resume": True}, TypeError)]:
        with pytest.raises(error):
            sg.sweep(BAR, {"contact.gap": [1.0]}, **wrong)
    swept = sg.sweep(BAR, {"contact.gap": np.array([1.0, 1.1])})
    assert swept.to_pandas()["contact.gap"].dtype == float and len(swept[0:2]) == 2
    with pytest.raises(IndexError):
        swept[2]
    # what is read later, and what is sent elsewhere, has its file
    held = swept[0]
    sent = pickle.loads(pickle.dumps(held))
    mesh = held.mesh
    del swept, held
    gc.collect()
    assert len(mesh.nodes) == 11 and len(sent.ledger.t) == len(sent.t)


def test_what_is_damaged_in_a_folder_is_computed_again(tmp_path):
    over = {"contact.gap": [1.0, 1.1]}
    first = sg.sweep(BAR, over, folder=tmp_path)
    ends = [r.energy_end for r in first]
    for damage in [b"", b"{", b"[]", b"{}", b"\xff\xfe"]:
        next(tmp_path.glob("*.json")).write_bytes(damage)
        assert [r.energy_end for r in sg.sweep(BAR, over, folder=tmp_path)] == ends, damage
    next(tmp_path.glob("*.h5")).write_bytes(b"no HDF5")
    assert [r.energy_end for r in sg.sweep(BAR, over, folder=tmp_path)] == ends


def test_points_of_quadrature_have_numbers():
    penalty = BAR | {"contact": {"edge": "right", "gap": 1.0, "method": "penalty"}}
    run = sg.run(penalty)
    assert np.array_equal(run.to_pandas()["pressure[0]"], run.pressure[:, 0])
    assert list(run.to_xarray().contact.values) == [0]


def test_files_of_a_later_form_are_refused(tmp_path):
    import h5py

    path = sg.run(BAR).save(tmp_path / "later.h5")
    with h5py.File(path, "r+") as f:
        f.attrs["format"] = 7
    with pytest.raises(sg.FileError, match="form"):
        sg.open(path)


def test_examples_of_the_documentation_are_typed(tmp_path):
    """pyright, strict, on the blocks of Python of the README, the package's and its page, against the package as it is installed."""
    pages = ["README.md", "python/README.md", "docs/tutorials/python.md"]
    for page in pages:
        blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
        assert blocks, page
        for k, block in enumerate(blocks):
            (tmp_path / f"{page.replace('/', '_').replace('.', '_')}_{k}.py").write_text(block)
    settings = {"typeCheckingMode": "strict", "include": ["."], "pythonPath": sys.executable}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [sys.executable, "-m", "pyright", "-p", str(tmp_path), "--pythonpath", sys.executable]
    found = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"})
    assert found.returncode == 0, found.stdout + found.stderr
