//! What `signorini export` writes: the fields against closed forms and against other programs' readers, the choice of
//! states, and what stays in the folder.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::{json, root};
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
    crate::common::hdf5_files().open(file).unwrap().dataset(path).unwrap().read_raw().unwrap()
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
        // the largest of all states and elements, which `inspect` tells
        let said = json(&["inspect", place.path().join(format!("{name}.h5")).to_str().unwrap()]);
        let states = said["states"].as_u64().unwrap();
        let of_state = |k: u64| dataset(&heavy, &format!("/states/{k:06}/von_mises"));
        let all: Vec<Vec<f64>> = (0..states).map(of_state).collect();
        let largest = all.iter().flatten().fold(0.0f64, |m, s| m.max(*s));
        let told = &said["largest_stress"];
        assert_eq!(told["von_mises"].as_f64(), Some(largest));
        let at = all.iter().position(|s| s.contains(&largest)).unwrap();
        assert_eq!(told["element"].as_u64().map(|e| all[at][e as usize]), Some(largest));
        assert_eq!(told["place"].as_array().unwrap().len(), 2);
        // recovered at nodes a linear field is what it is, and nothing is lost between elements and nodes
        let found = dataset(&heavy, "/states/000000/stress_recovered");
        assert_eq!(found.len(), 24 * 9);
        for stress in found.chunks(9) {
            assert!(stress.iter().zip(tensor).all(|(s, t)| (s - t).abs() < 1e-14), "{stress:?}");
        }
        let found = dataset(&heavy, &format!("/states/{at:06}/von_mises_recovered"));
        let (node, most) =
            (0..24).zip(&found).max_by(|a, b| a.1.total_cmp(b.1)).map(|(n, m)| (n, *m)).unwrap();
        assert_eq!(told["recovered"]["von_mises"].as_f64(), Some(most));
        assert_eq!(found[told["recovered"]["node"].as_u64().unwrap() as usize], found[node]);
        let error = told["estimated_error"].as_f64().unwrap();
        assert!((0.0..1.0).contains(&error), "{error}");
    }
    let body = "kind = 'bar'\nsize = [2.0]\nelements = [8]\nyoung = 3.0\ndensity = 1.0\narea = 0.5";
    run(place.path(), "bar", &linear(body, "['-0.04*x']"));
    fine(place.path(), &["export", "bar.h5", "--format", "xdmf"]);
    let found = dataset(&place.path().join("bar.xdmf.h5"), "/states/000000/stress");
    assert!(found.len() == 8 && found.iter().all(|s| (s + 0.12).abs() < 1e-15), "{found:?}");
    let said = json(&["inspect", place.path().join("bar.h5").to_str().unwrap()]);
    let heavy = place.path().join("bar.xdmf.h5");
    let states = (0..said["states"].as_u64().unwrap())
        .flat_map(|k| dataset(&heavy, &format!("/states/{k:06}/stress")));
    let largest = states.fold(0.0f64, |m, s| m.max(s.abs()));
    assert!(largest >= 0.12 - 1e-15);
    assert_eq!(said["largest_stress"]["von_mises"].as_f64(), Some(largest));
}

/// Every time and value of CSV, VTU and XDMF as `meshio` (and VTK, if it is there) read them, against the run's file.
#[test]
fn others_read_what_is_written() {
    let Some(python) = crate::common::python("meshio, h5py", "meshio") else { return };
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
                    crate::common::hdf5_files()
                        .open(path)
                        .unwrap()
                        .attr("signorini_version")
                        .is_ok()
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

/// A field that is linear between the nodes is itself at any place; where surfaces touch it has two values.
#[test]
fn places_are_followed() {
    let place = tempfile::tempdir().unwrap();
    let scene = linear("kind = 'plate'\nsize = [1.0, 0.7]\nelements = [5, 3]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0", "['0.01*x', '0.03*x']")
        .replace("['x']", "['x', 'y']");
    run(place.path(), "sheared", &scene);
    fine(
        place.path(),
        &["export", "sheared.h5", "--place", "0.33,0.41", "--place", "1.0,0.7", "--nodes", "3"],
    );
    let text = fs::read_to_string(place.path().join("sheared.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (head, first) = (lines.next().unwrap(), lines.next().unwrap());
    let number = |name: &str| -> f64 {
        first[head.iter().position(|h| *h == name).unwrap_or_else(|| panic!("{name} {head:?}"))]
            .parse()
            .unwrap()
    };
    assert!((number("u_x[0.33 0.41]") - 0.0033).abs() < 1e-15);
    assert!((number("u_y[0.33 0.41]") - 0.0099).abs() < 1e-15);
    assert!((number("u_y[1 0.7]") - 0.03).abs() < 1e-15 && number("v_x[1 0.7]") == 0.0);
    assert!((number("u_x[3]") - 0.0).abs() < 1e-15);
    // beside a node, and beside a side, by what files and people round
    for place_of in
        ["0.20000000001,0.41", "0.2,0.2333333", "0.200001,0.233333", "0.5999999,0.7000001"]
    {
        fine(place.path(), &["export", "sheared.h5", "--force", "--place", place_of]);
        let text = fs::read_to_string(place.path().join("sheared.csv")).unwrap();
        let first = text.lines().nth(1).unwrap().to_owned();
        let end: Vec<f64> = first.split(',').rev().take(4).map(|x| x.parse().unwrap()).collect();
        let x: f64 = place_of.split(',').next().unwrap().parse().unwrap();
        assert!((end[3] - 0.01 * x).abs() < 1e-9, "{place_of}: {end:?}");
    }
    let plate = |name: &str, at: f64| {
        format!(
            "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [2, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmove = [{at}, 0.0]\n"
        )
    };
    let two = plate("a", 0.0)
        + &plate("b", 1.0)
        + "[[support]]\nedge = 'a:left'\nfix = ['x', 'y']\n[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\n[initial]\nvelocity = { b = ['0.5', '0'] }\n[run]\nuntil = 1.0\nsamples = 2\n";
    run(place.path(), "two", &two);
    for (given, said) in [
        ("1.0,0.2", "two surfaces touch"),
        ("2.5,0.2", "lies in no element; the body reaches over 0 to 2, 0 to 0.5"),
        ("0.5,0.2,0.1", "has 3 coordinates: give 2 coordinates"),
        ("0.5", "has 1 coordinates: give 2 coordinates"),
        ("0.5,x", "give coordinates"),
    ] {
        let message = refused(place.path(), &["export", "two.h5", "--place", given]);
        let plain: Vec<&str> = message.split_whitespace().collect();
        assert!(plain.join(" ").contains(said), "{given}: {message}");
    }
    // each side keeps its own displacement
    fine(place.path(), &["export", "two.h5", "--place", "0.99999,0.2", "--place", "1.00001,0.2"]);
    let text = fs::read_to_string(place.path().join("two.csv")).unwrap();
    let (head, last) = (text.lines().next().unwrap(), text.lines().last().unwrap());
    let at = |name: &str| -> f64 {
        let k = head.split(',').position(|h| h == name).unwrap();
        last.split(',').nth(k).unwrap().parse().unwrap()
    };
    let (still, flies) = (at("u_x[0.99999 0.2]"), at("u_x[1.00001 0.2]"));
    assert!((flies - 0.5).abs() < 1e-12 && still.abs() < 1e-12, "{still} {flies}");
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
        Some(
            "t,kinetic,elastic,external,dissipated,jumps,u_n[10],pressure[10],active[10],force_x[right],support_x[left]"
        )
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

fn whole(file: &Path, path: &str) -> Vec<i64> {
    crate::common::hdf5_files().open(file).unwrap().dataset(path).unwrap().read_raw().unwrap()
}

/// A chain of five different masses, two of which meet an obstacle that they do not reach.
fn chain(folder: &Path) -> Vec<Vec<f64>> {
    let n = 5;
    let stiff = |i: usize| 1.0 + i as f64;
    let mut k = vec![vec![0.0; n]; n];
    for i in 0..n {
        k[i][i] += stiff(i);
        if i > 0 {
            k[i - 1][i - 1] += stiff(i);
            k[i][i - 1] -= stiff(i);
            k[i - 1][i] -= stiff(i);
        }
    }
    let head = "%%MatrixMarket matrix array real general\n5 5\n";
    let column = |a: &dyn Fn(usize, usize) -> f64| -> String {
        (0..n * n).map(|e| format!("{}\n", a(e % n, e / n))).collect()
    };
    let mass = |i: usize, j: usize| if i == j { 1.0 + 0.3 * i as f64 } else { 0.0 };
    fs::write(folder.join("K.mtx"), format!("{head}{}", column(&|i, j| k[i][j]))).unwrap();
    fs::write(folder.join("M.mtx"), format!("{head}{}", column(&mass))).unwrap();
    k
}

/// Numbers of displacements in files, tables and messages are the rows of the matrices, and the files say in which order `u` is.
#[test]
fn a_body_of_matrices_has_one_numbering() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let k = chain(folder);
    let scene = "title = 'chain'\n[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n\
        [contact]\ndisplacements = [3, 1]\ngap = GAP\nmethod = 'penalty'\nstiffness = 5.0\n\
        [[load]]\nkind = 'force'\ndisplacement = 4\namplitude = 0.3\nomega = 0.7\n[run]\nuntil = 12.0\nsamples = 40\n";
    run(folder, "free", &scene.replace("GAP", "100.0"));
    let file = folder.join("free.h5");
    fine(folder, &["export", "free.h5", "--nodes", "4,0"]);
    let table = fs::read_to_string(folder.join("free.csv")).unwrap();
    let header = table.lines().next().unwrap();
    let ours: Vec<&str> = header.split(',').skip(6).collect();
    assert_eq!(ours[..3], ["u_n[3]", "pressure[3]", "active[3]"], "{header}");
    let rest = ["force[contact]", "u_x[4]", "v_x[4]", "u_x[0]", "v_x[0]"];
    assert_eq!(ours[6..], rest, "{header}");
    // u[:, dof_map[:-1, 0]] has the rows in their order: the elastic energy is that of the given matrix
    let (u, map) = (dataset(&file, "trajectory/u"), whole(&file, "mesh/dof_map"));
    let (elastic, n) = (dataset(&file, "energy/elastic"), 5);
    let column: Vec<usize> = (0..n).map(|i| map[2 * i] as usize).collect();
    assert_eq!((map.len(), map[2 * n]), (2 * (n + 1), -1));
    // a spring's displacement has a column of its own besides
    let columns = n + 2;
    for (row, elastic) in u.chunks(columns).zip(&elastic) {
        let own: Vec<f64> = column.iter().map(|&c| row[c]).collect();
        let energy: f64 = (0..n * n).map(|e| 0.5 * own[e / n] * k[e / n][e % n] * own[e % n]).sum();
        assert!((energy - elastic).abs() <= 1e-12 * elastic.max(1.0), "{energy} {elastic}");
    }
    // the force acts on row 4: it moves first
    let moved: Vec<f64> = column.iter().map(|&c| u[columns + c].abs()).collect();
    assert!(moved[..4].iter().all(|x| *x < moved[4]), "{moved:?}");
    let description =
        crate::common::hdf5_files().open(&file).unwrap().dataset("mesh/dof_map").unwrap();
    assert!(description.attr("description").is_ok());
    // displacement 3 meets the obstacle, by this name in the summary and in the list of switches
    run(
        folder,
        "near",
        &scene.replace(
            "gap = GAP\nmethod = 'penalty'\nstiffness = 5.0",
            "gaps = [0.05, 10.0]\nstress = 'reaction'\ninertia = 'constant'",
        ),
    );
    let nodes = whole(&folder.join("near.h5"), "mesh/contact_nodes");
    assert_eq!(nodes, [3, 1]);
    fine(folder, &["export", "near.h5"]);
    let switches = fs::read_to_string(folder.join("near-switches.csv")).unwrap();
    let rows: Vec<&str> = switches.lines().skip(1).collect();
    assert!(
        !rows.is_empty() && rows.iter().all(|r| r.split(',').nth(1) == Some("3")),
        "{switches}"
    );
    let header = fs::read_to_string(folder.join("near.csv")).unwrap();
    assert!(header.contains("u_n[3],pressure[3],active[3],u_n[1],pressure[1],active[1]"));
    fs::remove_file(folder.join("near.h5")).unwrap();
    let said = fine(folder, &["run", "near.toml", "-o", "near.h5"]);
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(said.contains("(displacement 3)"), "{said}");
}

/// A corner between two obstacles has two columns of each kind, which say whose they are.
#[test]
fn a_node_before_two_obstacles_has_columns_with_names() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let corner =
        PLATE.replace("fix = ['x', 'y']", "fix = ['x']\n[[support]]\nedge = 'bottom'\nfix = ['y']");
    let corner = corner.replace("mode = 2\namplitude = -1.4", "velocity = ['0.3*x', '0.3*y']");
    let corner = corner.replace(
        "[contact]\nedge = 'right'\ngap = '1.0 + 0.02*y'",
        "[[contact]]\nedge = 'right'\ngap = 1.0\n[[contact]]\nedge = 'top'\ngap = 1.0",
    );
    run(folder, "corner", &corner);
    fine(folder, &["export", "corner.h5"]);
    let table = fs::read_to_string(folder.join("corner.csv")).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let different: BTreeSet<&str> = header.iter().copied().collect();
    assert_eq!(different.len(), header.len(), "{header:?}");
    let corners: Vec<&&str> =
        header.iter().filter(|h| h.starts_with("pressure[") && h.contains(':')).collect();
    assert_eq!(corners, [&"pressure[right:27]", &"pressure[top:27]"]);
    assert!(header.contains(&"pressure[26]"));
}

/// The motion of any node, as it is in the file; what cannot be given is refused.
#[test]
fn a_table_has_the_motion_of_any_node() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder, "plate", PLATE);
    fine(folder, &["export", "plate.h5", "--nodes", "9,0"]);
    let table = fs::read_to_string(folder.join("plate.csv")).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let first = header.len() - 8;
    assert_eq!(
        header[first..],
        ["u_x[9]", "u_y[9]", "v_x[9]", "v_y[9]", "u_x[0]", "u_y[0]", "v_x[0]", "v_y[0]"]
    );
    let stored = Stored::read(&folder.join("plate.h5")).unwrap();
    for (r, line) in table.lines().skip(1).enumerate() {
        let x: Vec<f64> = line.split(',').skip(first).map(|c| c.parse().unwrap()).collect();
        let (u, v) = (stored.displacement(r, 9), stored.velocity(r, 9));
        assert_eq!(x, [u[0], u[1], v[0], v[1], 0.0, 0.0, 0.0, 0.0]);
    }
    let message = refused(folder, &["export", "plate.h5", "--nodes", "28"]);
    assert!(message.contains("from 0 to 27"), "{message}");
    let message = refused(folder, &["export", "plate.h5", "--nodes", "2", "--format", "vtu"]);
    assert!(message.contains("--nodes"), "{message}");
}

/// A table that the program made may be written anew, whatever it is of; another's stays.
#[test]
fn own_tables_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = "[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n[contact]\nedge = 'right'\ngap = 1.0\n\
        [damping]\nratio = 0.05\nmode = 1\n[[load]]\nkind = 'mode'\nmode = 1\npeak = 2.0\nomega = 1.7\n\
        [orbit]\nomega = 1.7\nrange = [1.7, 1.9]\n";
    fs::write(folder.join("s.toml"), scene).unwrap();
    let over = ["--over", "contact.gap=1.0,1.1", "--steps", "2"];
    fine(folder, &[&["diagram", "s.toml", "-o", "diagram.h5"][..], &over].concat());
    fine(folder, &[&["phase-resonance", "s.toml", "-o", "resonance.h5"][..], &over].concat());
    fine(folder, &["basins", "s.toml", "--size", "2", "-o", "basins.h5"]);
    let peak = ["--of", "peak", "--over", "contact.gap=0.98,1.02", "--points", "1"];
    signorini(folder, &[&["curve", "s.toml", "-o", "curve.h5"][..], &peak].concat());
    signorini(folder, &["response", "s.toml", "--points", "3", "-o", "response.h5"]);
    fine(folder, &["bands", "response.h5", "--deviation", "contact.gap=2%", "-o", "bands.h5"]);
    for name in ["diagram", "resonance", "basins", "curve", "bands", "response"] {
        let file = format!("{name}.h5");
        fine(folder, &["export", &file]);
        let table = folder.join(format!("{name}.csv"));
        let first = fs::read(&table).unwrap();
        fine(folder, &["export", &file, "--force"]);
        assert!(fs::read(&table).unwrap() == first, "{name}");
        fs::write(&table, "a,b\n1,2\n").unwrap();
        let message = refused(folder, &["export", &file, "--force"]);
        assert!(message.contains("was not made by signorini"), "{name}: {message}");
    }
    fine(folder, &["trust", "s.toml", "-o", "margins"]);
    fine(folder, &["trust", "s.toml", "-o", "margins", "--force"]);
}
