//! What `signorini export` writes: the fields against closed forms and against other programs' readers, the choice of
//! states, and what stays in the folder.

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::root;
use serde_json::Value;
use signorini::report::export::{self, Format, Plan, Selection};
use signorini::store::Stored;

fn signorini(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signorini"));
    command.args(arguments).current_dir(folder).output().unwrap()
}

fn fine(folder: &Path, arguments: &[&str]) -> Output {
    let output = signorini(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    output
}

/// The words of a refusal.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = signorini(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    message
}

fn run(folder: &Path, name: &str, scene: &str) {
    fs::write(folder.join(format!("{name}.toml")), scene).unwrap();
    fine(folder, &["run", &format!("{name}.toml"), "-q", "-o", &format!("{name}.h5")]);
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

fn dataset(file: &Path, path: &str) -> Vec<f64> {
    common::hdf5_files().open(file).unwrap().dataset(path).unwrap().read_raw().unwrap()
}

const PLATE: &str = "title = 'a <plate> & \"a wall\"'\n[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [6, 3]\nyoung = 1.0\n\
    poisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\n\
    gap = '1.0 + 0.02*y'\n[initial]\nmode = 2\namplitude = -1.4\n[run]\nuntil = 3.0\nsamples = 40\n";

/// The obstacle stands before an edge whose outward normal points against the axis.
const BELOW: &str = "title = 'mesh'\n[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 4]\nyoung = 2.0\npoisson = 0.2\n\
    density = 1.5\nthickness = 0.1\n[[support]]\nedge = 'top'\nfix = ['x', 'y']\n[contact]\nedge = 'bottom'\ngap = 0.01\n\
    [initial]\nvelocity = ['0', '-0.1*(1-y)']\n[run]\nuntil = 2.0\nsamples = 30\n";

const BAR: &str = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [10]\nyoung = 3.0\ndensity = 1.0\narea = 2.0\n\
    [[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = 1.0\n\
    [initial]\nmode = 1\namplitude = -1.3\n[run]\nuntil = 4.0\nsamples = 40\n";

/// Without contact any field can be an initial one.
fn linear(kind: &str, displacement: &str) -> String {
    format!(
        "[body]\n{kind}\n[[support]]\nedge = 'left'\nfix = ['x']\n[initial]\ndisplacement = {displacement}\n\
         [run]\nuntil = 1.0\nsamples = 4\n"
    )
}

/// A plate under `u = (a x, c x)` and `(a x, d y)`, and a bar under `u = e x`: Hooke's law in every element.
#[test]
fn the_stress_of_linear_fields_is_hookes() {
    let place = tempfile::tempdir().unwrap();
    let (young, nu, a, c, d) = (2.5, 0.3, 0.01, -0.03, 0.02);
    let body = format!(
        "kind = 'plate'\nsize = [1.0, 0.7]\nelements = [5, 3]\nyoung = {young}\npoisson = {nu}\ndensity = 1.0\nthickness = 0.2"
    );
    // each with the supports that its field respects
    let roller = "[[support]]\nedge = 'bottom'\nfix = ['y']\n[initial]";
    let stretched = linear(&body, &format!("['{a}*x', '{d}*y']")).replace("[initial]", roller);
    let sheared = linear(&body, &format!("['{a}*x', '{c}*x']")).replace("['x']", "['x', 'y']");
    for (name, scene, c, d) in [("stretched", stretched, 0.0, d), ("sheared", sheared, c, 0.0)] {
        run(place.path(), name, &scene);
        fine(place.path(), &["export", &format!("{name}.h5"), "--format", "xdmf"]);
        let heavy = place.path().join(format!("{name}.xdmf.h5"));
        let scale = young / (1.0 - nu * nu);
        let (xx, yy) = (scale * (a + nu * d), scale * (d + nu * a));
        let xy = young / (2.0 * (1.0 + nu)) * c;
        let tensor = [xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, 0.0];
        let found = dataset(&heavy, "/states/000000/stress");
        assert_eq!(found.len(), 15 * 9);
        for stress in found.chunks(9) {
            assert!(stress.iter().zip(tensor).all(|(s, t)| (s - t).abs() < 1e-15), "{stress:?}");
        }
        let mises = (xx * xx - xx * yy + yy * yy + 3.0 * xy * xy).sqrt();
        let found = dataset(&heavy, "/states/000000/von_mises");
        assert!(found.len() == 15 && found.iter().all(|s| (s - mises).abs() < 1e-15));
    }
    let body = "kind = 'bar'\nsize = [2.0]\nelements = [8]\nyoung = 3.0\ndensity = 1.0\narea = 0.5";
    run(place.path(), "bar", &linear(body, "['-0.04*x']"));
    fine(place.path(), &["export", "bar.h5", "--format", "xdmf"]);
    let found = dataset(&place.path().join("bar.xdmf.h5"), "/states/000000/stress");
    assert!(found.len() == 8 && found.iter().all(|s| (s + 0.12).abs() < 1e-15), "{found:?}");
}

/// Python with h5py: `SIGNORINI_PYTHON`, or the virtual environment that `make setup` creates; with meshio, or none.
fn python_with_meshio() -> Option<PathBuf> {
    let python = match std::env::var_os("SIGNORINI_PYTHON") {
        Some(p) => p.into(),
        None => root().join(".venv/bin/python"),
    };
    let known = Command::new(&python).args(["-c", "import meshio, h5py"]).output();
    known.is_ok_and(|o| o.status.success()).then_some(python)
}

/// Every time and value of CSV, VTU and XDMF as `meshio` (and VTK, if it is there) read them, against the run's file.
#[test]
fn others_read_what_is_written() {
    let Some(python) = python_with_meshio() else {
        eprintln!("skipped: meshio is not there; run `make setup`, or set SIGNORINI_PYTHON");
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let linear = linear(
        "kind = 'plate'\nsize = [1.0, 1.0]\nelements = [2, 2]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0",
        "['0.1*x', '0']",
    )
    .replace("['x']", "['x', 'y']");
    let cases = [
        ("plate", PLATE, ["1", "0", "inf"]),
        ("my plate & wall", PLATE, ["7", "0.5", "2.25"]),
        ("below", BELOW, ["1", "0", "inf"]),
        ("bar", BAR, ["3", "1", "inf"]),
        ("linear", &linear, ["1", "0", "0.5"]),
    ];
    for (name, scene, [every, from, to]) in cases {
        run(place.path(), name, scene);
        for format in ["csv", "vtu", "xdmf"] {
            let file = format!("{name}.h5");
            let mut arguments = vec!["export", &file, "--format", format, "--every", every];
            for (option, value, default) in [("--from", from, "0"), ("--to", to, "inf")] {
                if value != default {
                    arguments.extend([option, value]);
                }
            }
            fine(place.path(), &arguments);
        }
        let output = Command::new(&python)
            .arg(root().join("tests/outside_export.py"))
            .args([&format!("{name}.h5"), name, every, from, to])
            .current_dir(place.path())
            .output()
            .unwrap();
        let fault = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {fault}");
        eprint!("{name}: {}", String::from_utf8_lossy(&output.stdout));
    }
}

/// What a plan says is what stands there afterwards, and every file says who made it.
#[test]
fn targets_are_told_before_and_files_are_marked() {
    let place = tempfile::tempdir().unwrap();
    run(place.path(), "plate", PLATE);
    let stored = Stored::read(&place.path().join("plate.h5")).unwrap();
    let before = names(place.path());
    let selection = Selection { every: 5, from: Some(1.0), to: None };
    let stem = place.path().join("some");
    for format in [Format::Csv, Format::Vtu, Format::Xdmf] {
        let plan = Plan::new(&stored, format, selection, &stem).unwrap();
        let targets = plan.targets();
        assert_eq!(targets, export::targets(format, &stem, plan.states()));
        assert!(targets.iter().all(|t| !t.exists()));
        let written = plan.write().unwrap();
        assert_eq!(written.files, targets);
        assert!(written.removed.is_empty() && targets.iter().all(|t| t.is_file()));
        for path in &targets {
            match path.extension().unwrap().to_str().unwrap() {
                "csv" => {}
                "h5" => assert!(
                    common::hdf5_files().open(path).unwrap().attr("signorini_version").is_ok()
                ),
                _ => {
                    let text = fs::read_to_string(path).unwrap();
                    let start = format!("<?xml version=\"1.0\"?>\n{}\n", signorini::store::MARK);
                    assert!(text.starts_with(&start), "{path:?}");
                }
            }
        }
    }
    let new: Vec<_> = names(place.path()).difference(&before).cloned().collect();
    assert_eq!(new, ["some-switches.csv", "some-vtu", "some.csv", "some.xdmf", "some.xdmf.h5"]);
}

/// A shorter set does not stand beside the rest of a longer one; what others put there stays.
#[test]
fn a_shorter_set_replaces_a_longer_one() {
    let place = tempfile::tempdir().unwrap();
    run(place.path(), "plate", PLATE);
    fine(place.path(), &["export", "plate.h5", "--format", "vtu"]);
    let folder = place.path().join("plate-vtu");
    let long = names(&folder);
    assert!(long.len() > 41 && long.contains("plate.pvd") && long.contains("plate-000040.vtu"));
    fs::write(folder.join("plate-999999.vtu"), "mine").unwrap();
    fs::write(folder.join("view.pvsm"), "mine").unwrap();
    let output =
        fine(place.path(), &["export", "plate.h5", "--format", "vtu", "--every", "20", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let states = json["states"].as_u64().unwrap() as usize;
    assert_eq!(json["written"].as_array().unwrap().len(), states + 1);
    assert_eq!(json["removed"].as_array().unwrap().len(), long.len() - states - 1);
    let mut expected: BTreeSet<String> = (0..states).map(|k| format!("plate-{k:06}.vtu")).collect();
    expected.extend(["plate.pvd", "plate-999999.vtu", "view.pvsm"].map(String::from));
    assert_eq!(names(&folder), expected);
}

#[test]
fn choices_that_make_no_sense_are_refused_with_what_would_do() {
    let place = tempfile::tempdir().unwrap();
    run(place.path(), "bar", BAR);
    let before = names(place.path());
    for format in ["csv", "vtu", "xdmf"] {
        for (options, word) in [
            (&["--every", "0"][..], "from 1 on"),
            (&["--every", "-2"], "from 1 on"),
            (&["--every", "2.5"], "from 1 on"),
            (&["--every", "few"], "from 1 on"),
            (&["--from", "-1"], "from 0 on"),
            (&["--from", "NaN"], "from 0 on"),
            (&["--to", "inf"], "from 0 on"),
            (&["--to", "later"], "from 0 on"),
            (&["--from", "3", "--to", "2"], "earlier"),
            (&["--from", "7.5"], "between t = 0 and t = 4"),
            (&["--from", "0.101", "--to", "0.102"], "between t = 0 and t = 4"),
            (&["-o", "out/"], "beginning of a file name"),
            (&["-o", "none/bar"], "no such folder"),
        ] {
            let arguments = [&["export", "bar.h5", "--format", format], options].concat();
            let message = refused(place.path(), &arguments);
            assert!(message.contains(word), "{arguments:?}: {message}");
        }
    }
    let message = refused(place.path(), &["export", "bar.h5", "--format", "xdmf", "-o", "a:b"]);
    assert!(message.contains("colon"), "{message}");
    assert_eq!(names(place.path()), before);
    // a time that was rounded when it was stored is found by its decimal
    fine(place.path(), &["export", "bar.h5", "--from", "0.3", "--to", "0.3"]);
    let rows = fs::read_to_string(place.path().join("bar.csv")).unwrap();
    assert_eq!(rows.lines().count(), 2, "{rows}");
}

/// A family has no states to choose from; a body of matrices no shape to show.
#[test]
fn what_has_no_states_or_no_shape_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let foreign = root().join("validate/foreign/half-plate.toml");
    let path = foreign.to_str().unwrap();
    fine(place.path(), &["run", path, "-q", "-o", "m.h5"]);
    for format in ["vtu", "xdmf"] {
        let message = refused(place.path(), &["export", "m.h5", "--format", format]);
        assert!(message.contains("matrices") && message.contains("--format csv"), "{message}");
    }
    fine(place.path(), &["export", "m.h5", "--format", "csv", "--every", "10"]);
    let scene = format!("{BAR}[orbit]\nomega = 2.9\n");
    fs::write(place.path().join("family.toml"), scene).unwrap();
    let hbm = ["backbone", "family.toml", "--method", "hbm", "--harmonics", "1"];
    fine(
        place.path(),
        &[&hbm[..], &["--range", "2.8,2.9", "--points", "3", "-o", "f.h5"]].concat(),
    );
    fine(place.path(), &["export", "f.h5", "--format", "csv"]);
    for options in [["--every", "2"], ["--from", "0"], ["--to", "1"]] {
        let message = refused(place.path(), &[&["export", "f.h5"][..], &options].concat());
        assert!(message.contains("family"), "{message}");
    }
}

/// What cannot be written is named, nothing half-written stays, and what stood there is whole.
#[test]
fn a_failure_names_the_file_and_leaves_no_part() {
    let place = tempfile::tempdir().unwrap();
    run(place.path(), "plate", PLATE);
    for (format, file) in [
        ("csv", "plate-switches.csv"),
        ("vtu", "plate-vtu/plate-000003.vtu"),
        ("vtu", "plate-vtu/plate.pvd"),
        ("xdmf", "plate.xdmf.h5"),
        ("xdmf", "plate.xdmf"),
    ] {
        // a folder stands in the way
        fs::create_dir_all(place.path().join(file)).unwrap();
        let output = signorini(place.path(), &["export", "plate.h5", "--format", format]);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(&format!("{file}: is a folder")), "{message}");
        fs::remove_dir(place.path().join(file)).unwrap();
    }
    let folder = place.path().join("plate-vtu");
    let all: Vec<String> = names(place.path()).into_iter().chain(names(&folder)).collect();
    assert!(all.iter().all(|name| !name.ends_with(".part")), "{all:?}");
}

/// Numbers that a shell can read, under the names that spreadsheets know.
#[test]
fn csv_is_plain() {
    let place = tempfile::tempdir().unwrap();
    run(place.path(), "bar", BAR);
    fine(place.path(), &["export", "bar.h5"]);
    let text = fs::read_to_string(place.path().join("bar.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("t,kinetic,elastic,external,dissipated,jumps,u_n[10],pressure[10],active[10]")
    );
    let stored = Stored::read(&place.path().join("bar.h5")).unwrap();
    for (row, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells[0].parse::<f64>().unwrap(), stored.t[row]);
        assert_eq!(cells[6].parse::<f64>().unwrap(), stored.contact_displacement(row, 0));
        let plain = |c: &&str| !c.ends_with("e0") && !c.ends_with(".0") && *c != "-0";
        assert!(cells.iter().all(plain), "{line}");
    }
    assert!(text.contains("\n0,0,"), "{text}");
}
