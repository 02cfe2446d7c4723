"""Scenes, errors, verdicts, interruption, files."""

import gc
import importlib
import json
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.io import mmread

import signorini as sg

BAR = {
    "title": "A bar",
    "body": {"kind": "bar", "size": [1.0], "elements": [10], "young": 1.0, "density": 1.0},
    "support": [{"edge": "left", "fix": ["x"]}],
    "contact": {"edge": "right", "gap": 1.0},
    "initial": {"mode": 1, "amplitude": -1.1},
    "run": {"until": 4.0},
}


def test_scenes_from_dicts_and_files_are_the_same():
    bar = sg.Scene(BAR)
    again = sg.Scene.parse(bar.text)
    assert again.text == bar.text and bar.title == "A bar"
    assert np.array_equal(sg.run(bar).u, sg.run(again).u)
    assert np.array_equal(sg.run(BAR).u, sg.run(pickle.loads(pickle.dumps(bar))).u)
    finer = bar.with_(body__elements=[20], contact__method="nitsche", contact__gamma=3)
    assert "elements = [20]" in finer.text and bar.with_({"contact.gap": np.float64(0.5)}).text.count("gap = 0.5") == 1
    assert "title" not in bar.with_(title=None).text
    numpy = BAR | {"body": BAR["body"] | {"elements": np.array([10]), "size": np.ones(1)}}
    assert np.array_equal(sg.run(numpy).u, sg.run(bar).u)


def test_bad_input_says_where():
    with pytest.raises(sg.SceneError) as e:
        sg.Scene("scenarios/plate.toml").with_(body__young=-1)
    assert (e.value.file, e.value.line, e.value.key) == ("scenarios/plate.toml", 8, "body.young")
    assert "must be positive" in e.value.message and "> 0" in e.value.help and "plate.toml:8" in str(e.value)
    # what only the mesh tells is found when the problem is set up
    with pytest.raises(sg.SceneError) as e:
        sg.run(BAR | {"support": []} | {"initial": {"mode": 1, "amplitude": 0.5}})
    assert e.value.key is not None
    with pytest.raises(sg.SceneError) as e:
        sg.run("nowhere.toml")
    assert e.value.file == "nowhere.toml" and e.value.line is None
    with pytest.raises(TypeError, match="backbone.. got an unexpected keyword argument 'nonsense'"):
        sg.backbone(BAR, nonsense=1)
    with pytest.raises(sg.SceneError, match="run"):
        sg.run({k: v for k, v in BAR.items() if k != "run"})
    with pytest.raises(sg.SceneError, match="output"):
        sg.run(BAR, resume=True)
    with pytest.raises(TypeError):
        sg.Scene(3)
    with pytest.raises(TypeError):
        sg.Scene(BAR | {"title": object()})
    assert issubclass(sg.SceneError, ValueError)


def test_files_that_are_none_of_ours(tmp_path):
    with pytest.raises(FileNotFoundError):
        sg.open(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("no")
    with pytest.raises(sg.FileError):
        sg.open(tmp_path / "text.h5")
    import h5py

    with h5py.File(tmp_path / "other.h5", "w") as f:
        f["x"] = 1.0
    with pytest.raises(sg.FileError):
        sg.open(tmp_path / "other.h5")
    r = sg.run(BAR)
    with pytest.raises(AttributeError, match="velocities"):
        r.velocities
    with pytest.raises(KeyError):
        r["trajectory/w"]


def test_verdicts_are_values():
    verdict = sg.orbit("scenarios/half-plate-orbit.toml", 2.07)
    assert isinstance(verdict, sg.Verdict) and not verdict and not verdict.converged
    assert verdict.verdict == "not found" and verdict.omega == 2.07 and verdict.residual > 0
    # a run that ends early is a run; its status says why
    early = sg.run(sg.Scene("scenarios/plate.toml").with_(run__switch_limit=0.5))
    assert isinstance(early, sg.Run) and not early.is_complete
    assert early.status.startswith("failed") and "switches" in early.failure and early.t[-1] < 3
    assert early.verdict in early.status and 0 < len(early.switches) < 22


def test_results_live_as_long_as_they_are_used(tmp_path):
    r = sg.run(BAR)
    path, mesh = r.path, r.mesh
    assert path.exists()
    kept = r.save(tmp_path / "kept.h5")
    with pytest.raises(FileExistsError):
        r.save(kept)
    r.save(kept, overwrite=True)
    del r
    gc.collect()
    # a group keeps the file that it reads
    assert path.exists() and len(mesh.nodes) == 11
    del mesh
    gc.collect()
    assert not path.exists() and not path.parent.exists()
    assert sg.open(kept).scene.text == sg.Scene(BAR).text


def test_output_is_kept_and_not_overwritten(tmp_path):
    path = tmp_path / "bar.h5"
    r = sg.run(BAR, path)
    assert r.path == path
    with pytest.raises(sg.SceneError, match="exists already; choose another name or overwrite it with force=True"):
        sg.run(BAR, path)
    r = sg.run(BAR, path, force=True)
    inspected = sg.open(path).inspect()
    assert inspected["status"] == "complete" and inspected["n_dof"] == r.n_dof


def foreign():
    return {name: mmread(f"validate/foreign/{name}.mtx") for name in ("M", "K", "N_C", "N_O")}


@pytest.mark.parametrize("as_what", [sp.csr_matrix, sp.csc_array, lambda a: a.toarray(), sp.lil_matrix])
def test_matrices_of_another_program(tmp_path, as_what):
    a = {name: as_what(m) for name, m in foreign().items()}
    scene = sg.Scene.from_matrices(
        a["M"], a["K"], [66, 67, 68, 69], 1.0, N_C=a["N_C"], N_O=a["N_O"],
        initial={"mode": 1, "amplitude": -1.1}, run={"periods": 1, "integrator": "modal"}, orbit={"omega": 1.8},
    )  # fmt: skip
    r = sg.run(scene)
    theirs = sg.run("validate/foreign/half-plate.toml")
    assert np.array_equal(r.u, theirs.u) and np.array_equal(r.switches.t, theirs.switches.t)
    scene.save(tmp_path / "own.toml")
    with pytest.raises(FileExistsError):
        scene.save(tmp_path / "own.toml")
    assert np.array_equal(sg.run(tmp_path / "own.toml").u, r.u)
    changed = scene.with_(contact__gap=0.9)
    assert sg.run(changed).switches.t[0] < r.switches.t[0]
    assert sg.orbit(scene).energy == pytest.approx(1.0436743675832565, rel=1e-9)


def test_matrices_that_cannot_be(tmp_path):
    a = foreign()
    with pytest.raises(sg.SceneError, match="belong together"):
        sg.Scene.from_matrices(a["M"], a["K"], [69], 1.0, N_C=a["N_C"])
    with pytest.raises(sg.SceneError, match="not symmetric|66"):
        sg.run(sg.Scene.from_matrices(a["M"], sp.triu(a["K"]), [69], 1.0, run={"until": 1.0}))
    with pytest.raises(sg.SceneError, match="dimensions"):
        sg.Scene.from_matrices(np.ones(3), a["K"], [69], 1.0)
    with pytest.raises(sg.SceneError, match="no number"):
        sg.Scene.from_matrices(a["M"] * np.nan, a["K"], [69], 1.0)
    with pytest.raises(sg.SceneError, match="real"):
        sg.Scene.from_matrices(a["M"] * 1j, a["K"], [69], 1.0)


def test_progress_is_told_and_may_end_the_work():
    told = []
    scene = sg.Scene("scenarios/plate.toml").with_(run__until=60.0)
    sg.run(scene, progress=lambda share, what: told.append(share))
    assert told and all(0 <= s <= 1 for s in told) and told == sorted(told)

    def enough(share, what):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sg.run(scene.with_(run__until=1e4), progress=enough)


def test_the_interpreter_goes_on_meanwhile():
    scene = sg.Scene("scenarios/plate.toml").with_(run__until=20.0)
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.monotonic()
    sg.run(scene)
    took = time.monotonic() - start
    stop.set()
    thread.join()
    # with the interpreter held it could not have counted at all
    assert counted[0] > 50 * took


@pytest.mark.parametrize(
    "code",
    [
        "sg.run(sg.Scene('scenarios/plate.toml').with_(run__until=1e4), 'out.h5')",
        "sg.orbits('scenarios/half-plate-20x6.toml', 1.8, amplitudes=500)",
        "sg.orbit(sg.Scene('scenarios/half-plate-20x6.toml').with_(body__elements=[60, 18]), 1.8)",
        "sg.backbone('scenarios/half-plate-20x6.toml', 'b.h5', range=(1.5, 2.0), step=0.0005)",
    ],
)
def test_ctrl_c(code, tmp_path):
    script = f"""
        import os, signal, sys, threading, time
        # what is started in the background of a script ignores the signal, and hands that on
        signal.signal(signal.SIGINT, signal.default_int_handler)
        root = os.getcwd()
        import signorini as sg
        os.makedirs({str(tmp_path)!r}, exist_ok=True)
        os.symlink(os.path.join(root, "scenarios"), os.path.join({str(tmp_path)!r}, "scenarios"))
        os.chdir({str(tmp_path)!r})
        at = []
        threading.Timer(2.0, lambda: (at.append(time.process_time()), os.kill(os.getpid(), signal.SIGINT))).start()
        try:
            {code}
        except KeyboardInterrupt as e:
            # of the processor: that does not depend on what else the machine does
            print("heard after", time.process_time() - at[0], e)
            sys.exit(0)
        sys.exit("was not interrupted")
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert float(done.stdout.split()[2]) < 20
    if "out.h5" in code:
        kept = sg.open(tmp_path / "out.h5")
        assert kept.status == "interrupted" and len(kept.t) > 1 and "resume" in done.stdout


def test_an_interrupted_family_goes_on(tmp_path):
    path = tmp_path / "b.h5"
    scene = sg.Scene("scenarios/half-plate-orbit.toml")
    seen = []

    def stop(share, what):
        seen.append(what)
        if what.startswith(("3", "4", "5", "6", "7", "8", "9")):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sg.backbone(scene, path, range=(1.60, 2.0), progress=stop)
    part = sg.open(path)
    assert part.status == "interrupted" and 0 < len(part) < 81
    short = sg.backbone(scene, range=(1.60, 1.65))
    whole = sg.backbone(scene, path, range=(1.60, 2.0), resume=True)
    assert whole.resumed >= len(part) - 1 and len(whole) == 81
    assert np.array_equal(whole.energy[: len(short)], short.energy, equal_nan=True)


def test_warnings_are_warnings():
    scene = sg.Scene("scenarios/half-plate-orbit.toml")
    series = sg.backbone(scene, method="hbm", harmonics=3, range=(1.70, 1.705))
    with pytest.warns(UserWarning, match="another scene") as heard:
        sg.crosscheck(series, scene.with_(contact__gap=1.1))
    # at the line of the caller
    assert heard[0].filename == __file__


@pytest.mark.parametrize("backend", ["agg"])
def test_figures(backend, tmp_path):
    # pinned for this test: where that is wanted, its absence is a fault
    matplotlib = importlib.import_module("matplotlib") if os.environ.get("SIGNORINI_STRICT") == "1" else pytest.importorskip("matplotlib")
    matplotlib.use(backend)
    scene = "scenarios/half-plate-orbit.toml"
    series = sg.backbone(scene, method="hbm", harmonics=3, range=(1.70, 1.71))
    results = [
        sg.run(BAR), sg.run("scenarios/valve.toml"), sg.run("scenarios/two-mass-stop.toml"), sg.run("scenarios/bracket.toml"),
        sg.orbit(scene, 1.8), series, sg.crosscheck(series, scene), sg.compare("scenarios/bar.toml", ["nbm"], [10, 20]),
    ]  # fmt: skip
    for k, r in enumerate(results):
        r.plot().savefig(tmp_path / f"{k}.png")
        assert (tmp_path / f"{k}.png").stat().st_size > 5000


def test_figures_show_what_the_command_shows(command, tmp_path):
    pytest.importorskip("matplotlib")
    # the same contact points of many have curves
    r = sg.run(sg.Scene("scenarios/plate.toml").with_(body__elements=[20, 16]))
    page = tmp_path / "page.html"
    subprocess.run([command, "view", str(r.path), "--no-open", "-o", str(page), "-q"], check=True)
    data = page.read_text().split('id="data">')[1].split("</script>")[0]
    names = [r.mesh.contact_nodes[i] for i in json.loads(data)["views"][0]["motion"]["frames"]["shown"]]
    assert len(names) == 12 < r.pressure.shape[1]
    labels = [line.get_label() for line in r.plot().axes[0].lines]
    assert labels == [f"node {n}" for n in names] + ["obstacle"]
    assert len(r.plot(nodes=[int(names[3])]).axes[0].lines) == 2
    with pytest.raises(ValueError, match="not contact nodes"):
        r.plot(nodes=[10**6])
    # families: energy and amplitude over a linear scale, joined where neighbours belong together
    followed = sg.backbone("scenarios/half-plate-orbit.toml", follow="arclength", omega=1.8, points=6)
    single = sg.backbone("scenarios/half-plate-orbit.toml", range=(1.7, 1.71))
    assert followed.is_followed and not single.is_followed
    for family in (followed, single):
        axes = family.plot().axes
        assert [a.get_ylabel() for a in axes] == ["energy", "amplitude"] and axes[0].get_yscale() == "linear"
        assert any(line.get_linestyle() == "-" for line in axes[0].lines) == family.is_followed
    assert len(single.plot(axis="amplitude").axes) == 1


def test_the_command_came_with_the_wheel(command, tmp_path):
    said = subprocess.run([command, "--version"], capture_output=True, text=True, check=True)
    assert said.stdout.split() == ["signorini", sg.__version__]
    refused = subprocess.run([command, "run", "nowhere.toml"], capture_output=True, text=True)
    assert refused.returncode == 2 and "nowhere.toml" in refused.stderr
    as_module = subprocess.run([sys.executable, "-m", "signorini", "modes", "scenarios/bar.toml"], capture_output=True, text=True)
    assert as_module.returncode == 0 and "open body" in as_module.stdout
    # Ctrl-C ends it, and what is there is kept
    words = [command, "run", "scenarios/bouncing-bar.toml", "-o", str(tmp_path / "x.h5"), "-q"]
    long = Path("scenarios/plate.toml").read_text().replace("until = 3.36", "until = 1e5")
    (tmp_path / "long.toml").write_text(long)
    words[2] = str(tmp_path / "long.toml")
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    time.sleep(2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130 and "--resume" in err
    assert sg.open(tmp_path / "x.h5").status == "interrupted"


def test_tutorials_print_what_stands_there():
    done = subprocess.run(
        [sys.executable, "python/tutorials/render.py", "--check"], capture_output=True, text=True, env={**os.environ, "MPLBACKEND": "agg"}
    )
    assert done.returncode == 0, done.stderr + done.stdout


def test_readme_lines_run(tmp_path):
    for readme in ("python/README.md", "README.md"):
        text = Path(readme).read_text(encoding="utf-8")
        for part in text.split("```python\n")[1:]:
            code = part.split("```")[0]
            if "import signorini" in code:
                code = code.replace('"plate.png"', repr(str(tmp_path / "plate.png")))
                exec(compile(code, readme, "exec"), {})


def test_stubs_and_docstrings():
    assert (Path(sg.__file__).parent / "py.typed").exists()
    for name in sg.__all__:
        assert name.startswith("__") or getattr(sg, name).__doc__, name


def test_results_travel_between_processes(tmp_path):
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(1) as pool:
        r = pool.submit(sg.run, BAR).result()
    assert np.array_equal(r.u, sg.run(BAR).u)
    # a forked child that ends does not take the file with it
    child = os.fork()
    if child == 0:
        try:
            del r
            gc.collect()
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    assert r.path.exists() and len(r.mesh.nodes) == 11
    matrices = foreign()
    scene = sg.Scene.from_matrices(matrices["M"], matrices["K"], [66, 67, 68, 69], 1.0, run={"until": 1.0})
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_a_file_that_was_written_anew_is_another(tmp_path):
    path = tmp_path / "a.h5"
    a = sg.run(BAR, path)
    assert len(a.t) > 0
    sg.run(sg.Scene(BAR).with_(run__until=3.0), path, force=True)
    with pytest.raises(sg.FileError, match="written anew"):
        a.u
    assert "gone" in repr(a)
    with pytest.raises(sg.SceneError, match="another scene"):
        sg.run(BAR, path, resume=True)


def test_results_given_inline_live_as_long_as_they_are_needed():
    scene = "scenarios/half-plate-orbit.toml"
    o = sg.orbit(scene, 1.8, near_return=sg.run(sg.Scene(scene).with_(run__periods=2)))
    assert o is not None
    c = sg.crosscheck(sg.backbone(scene, method="hbm", harmonics=3, range=(1.70, 1.705)), scene)
    assert c.message.shape == (2,) and all(isinstance(m, str) for m in c.message.tolist())
    assert len(c["crosscheck"].to_dict()) > 8
    with pytest.raises(sg.SceneError, match="no series"):
        sg.crosscheck(sg.backbone(scene, range=(1.70, 1.70001)), scene)
    with pytest.raises(sg.SceneError, match="coefficients"):
        sg.crosscheck({"omega": [1.8]}, scene)
    with pytest.raises(sg.SceneError, match="finite"):
        sg.crosscheck(([1.8], np.full((1, 3, 66), np.nan)), scene)
    with pytest.raises(sg.SceneError, match="your series"):
        sg.crosscheck(([1.8], np.zeros((1, 3, 65))), scene)


def test_a_part_of_the_displacements():
    scene = sg.Scene("scenarios/plate-half.toml").with_(run__until=2.0, run__samples=20)
    whole, part = sg.run(scene), sg.run(scene.with_(run__store="contact"))
    assert whole.columns is None and part.u.shape[1] == len(part.columns) < whole.u.shape[1]
    assert np.array_equal(part.u, whole.u[:, part.columns])
    assert np.array_equal(part.contact_displacement, whole.contact_displacement)
    assert np.array_equal(part.contact_velocity, whole.contact_velocity)
    with pytest.raises(ValueError, match='store = "all"'):
        part.displacement(len(part.mesh.nodes) // 2)
    assert len(part.plot().axes) == len(whole.plot().axes) - 1
    short = sg.run(scene.with_(run__precision="single"))
    assert np.array_equal(short.u, whole.u.astype(np.float32)) and np.array_equal(short.t, whole.t)


def test_any_place():
    scene = sg.Scene("scenarios/plate-half.toml").with_(run__until=2.0, run__samples=20)
    r = sg.run(scene)
    nodes, corners = r.mesh.nodes, r.mesh.elements[5]
    assert np.allclose(r.at(*nodes[9]), r.displacement(9), atol=1e-15)
    middle = nodes[corners].mean(axis=0)
    expected = np.mean([r.displacement(n) for n in corners], axis=0)
    assert np.allclose(r.at(*middle), expected, atol=1e-15)
    assert np.abs(r.at(*middle, velocity=True)).max() > 0.01
    with pytest.raises(ValueError, match="lies in no element"):
        r.at(7.0, 0.1)
    with pytest.raises(ValueError, match="2 coordinates"):
        r.at(0.1, 0.1, 0.1)


def test_matrices_keep_their_order_and_their_damping(tmp_path):
    n = 6
    k = sp.diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]).tocsr()
    m = sp.identity(n)
    tables = {"initial": {"mode": 1, "amplitude": -1.2}, "run": {"until": 10.0}}
    for contact in ([2], np.arange(n) == 2):
        r = sg.run(sg.Scene.from_matrices(m, k, contact, 1.0, **tables))
        u = r.of_rows(r.u)
        assert u.shape == (len(r.t), n) and np.array_equal(u[:, 2], r.contact_displacement[:, 0])
        assert 0.5 * np.einsum("si,ij,sj->s", u, k.toarray(), u) == pytest.approx(r.ledger.elastic, rel=1e-10, abs=1e-12)
    damped = sg.run(sg.Scene.from_matrices(m, k, [2], 1.0, C=0.01 * k, **tables))
    assert damped.damping.beta == pytest.approx(0.01) and damped.energy_dissipated > 0
    for table in ({"method": "mass-redistribution"}, {"method": "penalty", "stiffness": 100.0}):
        other = sg.run(sg.Scene.from_matrices(m, k, [2], 1.0, contact_table=table, **tables))
        assert other.is_complete
    for wrong in ([2.5], ["a"]):
        with pytest.raises((TypeError, ValueError)):
            sg.Scene.from_matrices(m, k, wrong, 1.0, **tables)
    # the scene of the result does not take other matrices for its own
    with pytest.raises(sg.SceneError, match="given M"):
        sg.run(r.scene)


def test_scenes_are_read_and_compared():
    scene = sg.Scene("scenarios/plate-forced.toml")
    assert scene["contact.gap"] == scene.to_dict()["contact"]["gap"]
    assert scene == sg.Scene(scene) and scene != scene.with_(title="x") and len({scene, sg.Scene(scene)}) == 1
    with pytest.raises(KeyError):
        scene["contact.none"]
    made = sg.Scene(BAR).with_(load=[{"kind": "traction", "edge": "right", "amplitude": 0.1}])
    assert made.with_({"load[0].amplitude": 0.2})["load[0].amplitude"] == 0.2
    with pytest.raises(sg.SceneError):
        made.with_({"load[0]": None})
    with pytest.raises(sg.SceneError, match="names files"):
        sg.Scene("scenarios/beam.toml").save("target/beam.toml")


def test_names_are_found():
    r = sg.run(BAR)
    assert {"u", "t", "energy_drift", "switches", "mesh", "contact_displacement"} <= set(dir(r))
    assert "mesh/gap" in r and "/mesh/gap" in r and r["/mesh/gap"] is r.mesh.gap and r.get("none", 3) == 3
    with pytest.raises(AttributeError, match="did you mean energy_drift"):
        r.energy_drfit
    with pytest.raises(TypeError):
        r[0]
    with pytest.raises(TypeError):
        list(r.mesh)
    b = sg.backbone("scenarios/half-plate-orbit.toml", range=(1.70, 1.71))
    assert "omega" in dir(b) and [p.omega for p in b[0:2]] == b.omega[:2].tolist()
    assert [p.converged for p in b[b.converged]] == [True] * int(b.converged.sum())
    assert all((p.multipliers is None) == (not p.converged) for p in b)
    k = int(np.flatnonzero(b.converged)[0])
    o = sg.orbit("scenarios/half-plate-orbit.toml", 1.8)
    assert b[k].largest_multiplier > 1 and o.largest_multiplier == pytest.approx(1.7404, abs=1e-3)
