//! The HDF5 layout seen from outside, with h5py; and what a killed program leaves.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::root;

/// What a script in Python with h5py says of a file; none where there is no h5py.
fn check(script: &str, file: &Path) -> Option<String> {
    let mut child = Command::new(crate::common::python("h5py, numpy", "h5py")?)
        .arg("-")
        .arg(file)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let fault = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "the outside reader found a fault: {fault}");
    Some(String::from_utf8(output.stdout).unwrap())
}

fn fine(script: &str, file: &Path) {
    let said = check(script, file);
    assert!(said.as_ref().is_none_or(|s| s.starts_with("fine")), "{said:?}");
}

fn signorini() -> Command {
    Command::new(env!("CARGO_BIN_EXE_signorini"))
}

const LAYOUT: &str = r#"
import sys, h5py, numpy as np
f = h5py.File(sys.argv[1], "r")
assert f.attrs["status"] == "complete", f.attrs["status"]
assert f.attrs["scene"].count("[body]") == 1 and f.attrs["signorini_version"]
assert "run" in f.attrs["command"] and f.attrs["created"].endswith("Z")
mesh, traj, sw, en = f["mesh"], f["trajectory"], f["switches"], f["energy"]
n = mesh["nodes"].shape[0]
assert mesh["nodes"].shape == (n, 2) and mesh["dof_map"].shape == (n, 2)
assert mesh["elements"].shape[1] == 4
N = traj["u"].shape[1]
s = traj["t"].shape[0]
n_c = mesh["contact_nodes"].shape[0]
assert mesh["dof_map"][:].max() == N - 1 and (mesh["dof_map"][:] >= -1).all()
assert list(mesh["contact_dofs"]) == list(range(N - n_c, N))
for name, width in [("u", N), ("v", N), ("active", n_c), ("pressure", n_c)]:
    assert traj[name].shape == (s, width), name
    assert traj[name].chunks is not None and traj[name].compression == "gzip"
t = traj["t"][:]
assert (np.diff(t) > 0).all() and t[0] == 0.0
for name in ["t", "kinetic", "elastic", "external", "dissipated", "jumps"]:
    assert en[name].shape == (s,), name
assert np.array_equal(en["t"][:], t)
kinds = sw["kind"].asstr()[:] if sw["kind"].dtype.kind == "O" else np.char.decode(sw["kind"][:], "ascii")
assert set(kinds) == {"close", "open"}
for name in ["t", "node", "point", "monitor", "from", "to", "monitor_rate", "energy_jump"]:
    assert sw[name].shape == kinds.shape, name
words = {name: np.char.decode(sw[name][:], "ascii") for name in ["monitor", "from", "to"]}
assert sw["active_before"].shape == (len(kinds), n_c) == sw["active_after"].shape
# every switch is a stored time, and flips one node
for k in range(len(kinds)):
    assert np.abs(t - sw["t"][k]).min() == 0.0
    before, after = sw["active_before"][k], sw["active_after"][k]
    node = list(mesh["contact_nodes"]).index(sw["node"][k])
    changed = np.flatnonzero(before != after)
    assert list(changed) == [node] == [sw["point"][k]] and after[node] == (kinds[k] == "close")
    states = np.array(["open", "closed"])
    assert words["from"][k] == states[before[node]] and words["to"][k] == states[after[node]]
    assert words["monitor"][k] == ("pressure" if before[node] else "gap")
# complementarity of what is stored
u = traj["u"][:, N - n_c:]
gap = mesh["gap"][:] - u
p, active = traj["pressure"][:], traj["active"][:]
assert gap.min() > -1e-12 and p.min() > -1e-12
assert np.abs(gap[active == 1]).max() < 1e-12 and np.abs(p[active == 0]).max() == 0.0
# the ledger closes
H = en["kinetic"][:] + en["elastic"][:]
assert np.abs(H - H[0] - en["jumps"][:]).max() < 1e-7 * H.max()
assert abs(sw["energy_jump"][:].sum() - en["jumps"][-1]) < 1e-12
assert traj["u"].attrs["units"] == "length"
print("fine", s, len(kinds))
"#;

#[test]
fn h5py_reads_the_layout() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plate.h5");
    let scene = root().join("scenarios/plate-half.toml");
    let status = signorini().arg("run").arg(scene).arg("-q").arg("-o").arg(&file).status().unwrap();
    assert!(status.success());
    fine(LAYOUT, &file);
    fine(DESCRIBED, &file);
}

/// Every dataset says what it is, and what its dimensions count.
const DESCRIBED: &str = r#"
import sys, h5py
f = h5py.File(sys.argv[1], "r")
found = []
f.visititems(lambda name, o: found.append(name) if isinstance(o, h5py.Dataset) else None)
assert len(found) > 25
for name in found:
    d = f[name]
    assert len(d.attrs["description"]) > 2, name
    assert len(d.dims) == len(d.attrs["DIMENSION_LABELS"]) and all(x.label for x in d.dims), name
assert [x.label for x in f["trajectory/u"].dims] == ["state", "displacement"]
print("fine")
"#;

/// So does every dataset of the other kinds of files, with its unit: the schema that their writers go by has it.
#[test]
fn every_dataset_is_listed_with_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenarios/half-plate-orbit.toml").display().to_string();
    let at = |name: &str| folder.path().join(name).display().to_string();
    for (name, words) in [
        ("orbit.h5", vec!["orbit"]),
        ("shot.h5", vec!["backbone", "--range", "1.79,1.80", "--points", "4"]),
        ("hbm.h5", vec!["backbone", "--method", "hbm", "--harmonics", "3", "--range", "1.79,1.80"]),
    ] {
        let status = signorini()
            .args(&words[..1])
            .arg(&scene)
            .args(&words[1..])
            .args(["-q", "-o", &at(name)])
            .status();
        assert!(status.unwrap().success(), "{words:?}");
    }
    let checked = ["crosscheck", &at("hbm.h5"), &scene, "-q", "-o", &at("checked.h5")];
    assert!(signorini().args(checked).status().unwrap().success());
    for (name, least) in [("orbit.h5", 40), ("shot.h5", 20), ("hbm.h5", 25), ("checked.h5", 30)] {
        let said = crate::common::json(&["inspect", "--datasets", &at(name)]);
        let all = said["datasets"].as_array().unwrap();
        assert!(all.len() >= least, "{name}: {}", all.len());
        for dataset in all {
            let has = |key: &str| dataset[key].as_str().is_some_and(|text| !text.is_empty());
            assert!(has("units") && has("description"), "{name}: {dataset}");
        }
    }
}

/// A linear body has no contact: its file has empty contact tables and still opens.
#[test]
fn a_body_without_contact_is_stored_too() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("linear.toml");
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [5]\nyoung = 1.0\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x']\n[initial]\nmode = 1\namplitude = 1.0\n[run]\nuntil = 5.0\n";
    std::fs::write(&scene, text).unwrap();
    let file = folder.path().join("linear.h5");
    let status =
        signorini().arg("run").arg(&scene).arg("-q").arg("-o").arg(&file).status().unwrap();
    assert!(status.success());
    let script = "import sys, h5py\nf = h5py.File(sys.argv[1], 'r')\n\
        assert f['trajectory/u'].shape == (401, 5) and f['trajectory/pressure'].shape == (401, 0)\n\
        assert f['switches/t'].shape == (0,)\nprint('fine')";
    fine(script, &file);
    let status = signorini().arg("plot").arg(&file).arg("-q").status().unwrap();
    assert!(status.success());
}

const KILLED: &str = r#"
import sys, h5py, numpy as np
f = h5py.File(sys.argv[1], "r")
assert f.attrs["status"] == "running"
t = f["trajectory/t"][:]
assert len(t) > 0 and (np.diff(t) > 0).all()
assert np.isfinite(f["trajectory/u"][:]).all() and f["trajectory/u"].shape[0] == len(t)
assert f["energy/kinetic"].shape == (len(t),)
print("fine", len(t), t[-1])
"#;

/// Killed at arbitrary moments, the program leaves a file that opens and says that it was running.
#[test]
fn a_killed_run_leaves_a_readable_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("long.toml");
    let text = std::fs::read_to_string(root().join("scenarios/plate.toml")).unwrap();
    let text = text.replace("until = 3.36", "until = 100000.0\nsamples = 30000000");
    std::fs::write(&scene, text).unwrap();
    for k in 0..6u64 {
        let file = folder.path().join(format!("killed-{k}.h5"));
        let mut child = signorini()
            .args(["run", "--force-large", "-q"])
            .arg(&scene)
            .arg("-o")
            .arg(&file)
            .spawn()
            .unwrap();
        // wait for the first flush, then a little longer
        let start = Instant::now();
        let size = || std::fs::metadata(&file).map_or(0, |m| m.len());
        while size() < 1_500_000 && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(37 * k));
        child.kill().unwrap();
        child.wait().unwrap();
        fine(KILLED, &file);
        let shown = signorini().arg("inspect").arg(&file).output().unwrap();
        let fault = String::from_utf8_lossy(&shown.stderr);
        assert!(String::from_utf8_lossy(&shown.stdout).contains("running"), "{fault}");
    }
}

/// A file whose parts do not fit together is refused, whatever reads it.
#[test]
fn damaged_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let good = folder.path().join("good.h5");
    let scene = root().join("scenarios/plate-half.toml");
    let status =
        signorini().arg("run").arg(&scene).arg("-q").arg("-o").arg(&good).status().unwrap();
    assert!(status.success());
    for (k, damage) in [
        "f['mesh/dof_map'][...] = 10**9",
        "f['mesh/dof_map'][-1, 0] = 10**15",
        "del f['mesh/dof_map']; f['mesh/dof_map'] = np.zeros((3, 2), dtype='i8')",
        "f['mesh/contact_nodes'][...] = -7",
        "f['mesh/elements'][...] = 10**6",
        "f['trajectory/t'][3] = np.nan",
        "f['trajectory/u'].resize((5, f['trajectory/u'].shape[1]))",
        "f['energy/kinetic'].resize((5,))",
        "del f['mesh/gap']; f['mesh/gap'] = np.ones(500)",
        "del f['switches/kind']; f['switches/kind'] = np.array([b'close'], dtype='S32')",
    ]
    .iter()
    .enumerate()
    {
        let file = folder.path().join(format!("damaged-{k}.h5"));
        std::fs::copy(&good, &file).unwrap();
        let script = format!(
            "import sys, h5py, numpy as np\nf = h5py.File(sys.argv[1], 'r+')\n{damage}\nf.close()\nprint('done')"
        );
        if check(&script, &file).is_none() {
            return;
        }
        // a number that claims more displacements than the file can name is not believed: nothing of its size is asked for
        let read = signorini::store::Stored::read(&file).map(|_| ()).unwrap_err().to_string();
        assert!(read.contains("damaged"), "{damage}: {read}");
        for arguments in [
            &["plot"][..],
            &["inspect"],
            &["export", "--format", "csv"],
            &["export", "--format", "vtu"],
        ] {
            let output = signorini().args(arguments).arg(&file).output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{damage}, {arguments:?}: {message}");
            assert!(message.contains("damaged"), "{message}");
        }
    }
}
