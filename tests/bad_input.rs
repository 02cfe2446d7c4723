//! Input that was believed, misread or misjudged: every case once broke the program or its results.

use std::process::Output;

use crate::common::{program, refused, root};
use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = "scenarios/half-plate-orbit.toml";

fn run(arguments: &[&str]) -> Output {
    let output = program().args(arguments).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{arguments:?}: {text}");
    output
}

fn json(arguments: &[&str]) -> Value {
    let output = run(&[arguments, &["--json"]].concat());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {text}");
    serde_json::from_slice(&output.stdout).unwrap()
}

struct Folder(TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(TempDir::new().unwrap())
    }
    fn at(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }
    fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.0.path().join(name), text).unwrap();
        self.at(name)
    }
}

/// Equal masses on equal springs, each to the ground: the stiffness is a multiple of the mass, and so is any damping matrix.
#[test]
fn damping_of_a_stiffness_in_proportion_to_the_mass_is_mass_damping() {
    let folder = Folder::new();
    let matrix = |name: &str, x: f64| {
        let text =
            format!("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 {x}\n2 2 {x}\n");
        folder.write(name, &text);
    };
    for (name, value) in [("M.mtx", 3.0), ("K.mtx", 0.7), ("C.mtx", 0.06)] {
        matrix(name, value);
    }
    let text = "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\ndamping_matrix = \"C.mtx\"\n\
                [contact]\ndisplacements = [0]\ngap = 1.0\nmethod = \"penalty\"\nstiffness = 10.0\n\
                [[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = 0.1\n[run]\nuntil = 1.0\n";
    let scene = folder.write("scene.toml", text);
    let said = json(&["run", &scene, "-o", &folder.at("out.h5")]);
    assert!(
        (said["damping"]["alpha"].as_f64().unwrap() - 0.02).abs() < 1e-15,
        "{}",
        said["damping"]
    );
    assert_eq!(said["damping"]["beta"], 0.0);
}

/// Four masses in a row between springs, two of them before stops; `N_C`, `N_O` are not symmetric and n_C = n_O.
fn chain(folder: &Folder, n_c: &str, n_o: &str) -> String {
    folder.write(
        "M.mtx",
        "%%MatrixMarket matrix array real symmetric\n4 4\n1\n0\n0\n0\n1\n0\n0\n1\n0\n1\n",
    );
    folder.write(
        "K.mtx",
        "%%MatrixMarket matrix array real symmetric\n4 4\n2\n-1\n0\n0\n2\n-1\n0\n2\n-1\n1\n",
    );
    folder.write("NC.mtx", "%%MatrixMarket matrix array real general\n2 2\n2\n-0.1\n-0.9\n1\n");
    folder.write("NO.mtx", "%%MatrixMarket matrix array real general\n2 2\n0\n0.3\n-1\n-0.8\n");
    let text = format!(
        "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n\
         [contact]\ndisplacements = [2, 3]\ngap = 1.0\nn_c = \"{n_c}\"\nn_o = \"{n_o}\"\n\
         [initial]\nmode = 1\namplitude = -1.4\n[run]\nuntil = 50.0\nintegrator = \"modal\"\n"
    );
    folder.write("chain.toml", &text)
}

/// A dense matrix in HDF5: as a C program writes it, or as MATLAB does (transposed, and saying so).
fn store(file: &hdf5::File, name: &str, rows: [[f64; 2]; 2], matlab: bool) {
    let [[a, b], [c, d]] = rows;
    let stored = if matlab { [[a, c], [b, d]] } else { rows };
    let data = ndarray::arr2(&stored);
    let dataset = file.new_dataset_builder().with_data(&data).create(name).unwrap();
    if matlab {
        let word: hdf5::types::FixedAscii<6> =
            hdf5::types::FixedAscii::from_ascii("double").unwrap();
        dataset
            .new_attr::<hdf5::types::FixedAscii<6>>()
            .create("MATLAB_class")
            .unwrap()
            .write_scalar(&word)
            .unwrap();
    }
}

#[test]
fn matrices_of_matlab_are_transposed() {
    let folder = Folder::new();
    for matlab in [false, true] {
        let file = crate::common::hdf5_files().create(folder.at(&format!("{matlab}.mat"))).unwrap();
        store(&file, "NC", [[2.0, -0.9], [-0.1, 1.0]], matlab);
        store(&file, "NO", [[0.0, -1.0], [0.3, -0.8]], matlab);
    }
    let switches = |n_c: &str, n_o: &str, out: &str| {
        let scene = chain(&folder, n_c, n_o);
        json(&["run", &scene, "-o", &folder.at(out)])["switches"].as_array().unwrap().len()
    };
    let text = switches("NC.mtx", "NO.mtx", "a.h5");
    assert_eq!(text, switches("false.mat:/NC", "false.mat:/NO", "b.h5"));
    assert_eq!(text, switches("true.mat:/NC", "true.mat:/NO", "c.h5"));
    // what would come of the same bytes, were they believed to stand row by row
    let file = crate::common::hdf5_files().create(folder.at("wrong.h5")).unwrap();
    store(&file, "NC", [[2.0, -0.1], [-0.9, 1.0]], false);
    store(&file, "NO", [[0.0, 0.3], [-1.0, -0.8]], false);
    drop(file);
    assert_ne!(text, switches("wrong.h5:/NC", "wrong.h5:/NO", "d.h5"));
}

#[test]
fn sizes_of_matrices_are_not_believed() {
    let folder = Folder::new();
    let scene = chain(&folder, "NC.mtx", "NO.mtx");
    for sizes in [
        "coordinate real general\n2000000000000000000 2000000000000000000 0",
        "coordinate real general\n1000000000000000000 1000000000000000000 0",
        "coordinate real general\n4000000000 4000000000 7\n1 1 1.0",
        "coordinate real general\n18446744073709551615 18446744073709551615 1\n1 1 1.0",
        "coordinate real symmetric\n100000 100000 1\n1 1 1.0",
        "array real general\n4294967296 4294967296\n1.0",
    ] {
        folder.write("M.mtx", &format!("%%MatrixMarket matrix {sizes}\n"));
        refused(&["modes", &scene], "body.mass_matrix");
    }
    chain(&folder, "NC.mtx", "NO.mtx");
    // not positive definite: said of the matrix that is not
    folder.write(
        "M.mtx",
        "%%MatrixMarket matrix array real symmetric\n4 4\n1\n0\n0\n0\n-1\n0\n0\n1\n0\n1\n",
    );
    refused(&["modes", &scene], "body.mass_matrix");
    chain(&folder, "NC.mtx", "NO.mtx");
    folder.write(
        "K.mtx",
        "%%MatrixMarket matrix array real symmetric\n4 4\n2\n-1\n0\n0\n2\n-1\n0\n2\n-1\n-5\n",
    );
    refused(&["modes", &scene], "body.stiffness_matrix");
    // not a number
    let file = crate::common::hdf5_files().create(folder.at("nan.h5")).unwrap();
    store(&file, "NC", [[2.0, f64::NAN], [-0.1, 1.0]], false);
    drop(file);
    let scene = chain(&folder, "nan.h5:/NC", "NO.mtx");
    refused(&["modes", &scene], "(0, 1)");
}

/// A body of matrices is no bar: its summary names displacements, and it has no shape to draw.
#[test]
fn a_body_of_matrices_is_called_so() {
    let folder = Folder::new();
    let scene = chain(&folder, "NC.mtx", "NO.mtx");
    let file = folder.at("chain.h5");
    let output = run(&["run", &scene, "-o", &file]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains("matrices, 4 displacements: 2 move by themselves, 2 at the contact follow"),
        "{text}"
    );
    assert!(text.contains("(displacement "), "{text}");
    refused(&["plot", &file, "--only", "shapes", "-o", &folder.at("p")], "no shape");
    refused(&["export", &file, "--format", "vtu", "-o", &folder.at("p")], "csv");
}

#[test]
fn frequencies_and_harmonics_of_files_are_checked() {
    let folder = Folder::new();
    let hbm = folder.at("hbm.h5");
    json(&[
        "backbone",
        SCENE,
        "--method",
        "hbm",
        "--harmonics",
        "3",
        "--range",
        "1.79,1.80",
        "-o",
        &hbm,
    ]);
    let spoil = |name: &str, change: &dyn Fn(&hdf5::File)| {
        let copy = folder.at(name);
        std::fs::copy(&hbm, &copy).unwrap();
        change(&crate::common::hdf5_files().open_rw(&copy).unwrap());
        copy
    };
    for (k, value) in [1e15 as i64, -1].into_iter().enumerate() {
        let file = spoil(&format!("h{k}.h5"), &|f| {
            let data = f.dataset("hbm/harmonics").unwrap();
            let mut all = data.read_raw::<i64>().unwrap();
            all[0] = value;
            data.write_raw(&all).unwrap();
        });
        refused(&["crosscheck", &file, SCENE, "-o", &folder.at("no.h5")], "/hbm/harmonics");
    }
    for (k, value) in [f64::NAN, -1.8, f64::INFINITY, 0.0].into_iter().enumerate() {
        let file = spoil(&format!("w{k}.h5"), &|f| {
            let data = f.dataset("hbm/omega").unwrap();
            let mut all = data.read_raw::<f64>().unwrap();
            all[0] = value;
            data.write_raw(&all).unwrap();
        });
        refused(&["crosscheck", &file, SCENE, "-o", &folder.at("no.h5")], "positive frequency");
    }
    let file = spoil("c.h5", &|f| {
        let data = f.dataset("hbm/coefficients").unwrap();
        let mut all = data.read_dyn::<f64>().unwrap();
        all[[0, 1, 3]] = f64::NAN;
        data.write(&all).unwrap();
    });
    refused(&["crosscheck", &file, SCENE, "-o", &folder.at("no.h5")], "NaN");
    let file = spoil("large.h5", &|f| {
        let data = f.dataset("hbm/coefficients").unwrap();
        let mut all = data.read_dyn::<f64>().unwrap();
        all[[0, 1, 3]] = 1e16;
        data.write(&all).unwrap();
    });
    refused(&["crosscheck", &file, SCENE, "-o", &folder.at("no.h5")], "units");
    // text where numbers should be
    let mat = folder.at("words.mat");
    let f = crate::common::hdf5_files().create(&mat).unwrap();
    let words: Vec<hdf5::types::FixedAscii<8>> =
        vec![hdf5::types::FixedAscii::from_ascii("1.8").unwrap()];
    f.new_dataset_builder().with_data(&words).create("w").unwrap();
    f.new_dataset_builder().with_data(&[1.0]).create("Q").unwrap();
    drop(f);
    let named = ["--omega", "w", "--coefficients", "Q"];
    refused(
        &[&["crosscheck", &mat, SCENE, "-o", &folder.at("no.h5")], &named[..]].concat(),
        "words.mat",
    );
}

#[test]
fn damaged_tables_are_refused() {
    let folder = Folder::new();
    let checked = folder.at("checked.h5");
    json(&["crosscheck", "validate/foreign/half-plate.csv", SCENE, "--quick", "-o", &checked]);
    for name in ["omega", "harmonics", "moved", "verdict", "same_sequence"] {
        let copy = folder.at("copy.h5");
        std::fs::copy(&checked, &copy).unwrap();
        let f = crate::common::hdf5_files().open_rw(&copy).unwrap();
        f.group("crosscheck").unwrap().unlink(name).unwrap();
        if name == "verdict" {
            let words: Vec<hdf5::types::FixedAscii<32>> = vec![Default::default(); 40];
            f.new_dataset_builder().with_data(&words).create("crosscheck/verdict").unwrap();
        } else {
            f.new_dataset_builder()
                .with_data(&[1.0, 2.0])
                .create(format!("crosscheck/{name}").as_str())
                .unwrap();
        }
        drop(f);
        for command in ["inspect", "plot", "export"] {
            let out: &[&str] = if command == "inspect" { &[] } else { &["-o", &folder.at("out")] };
            refused(&[&[command, &copy], out].concat(), "damaged");
        }
    }
    let file = folder.at("bar.h5");
    json(&["run", "scenarios/bar.toml", "-o", &file]);
    let f = crate::common::hdf5_files().open_rw(&file).unwrap();
    let nodes = f.dataset("mesh/nodes").unwrap();
    let mut all = nodes.read_2d::<f64>().unwrap();
    all[(3, 0)] = f64::NAN;
    nodes.write(&all).unwrap();
    drop((nodes, f));
    refused(&["plot", &file, "-o", &folder.at("out")], "/mesh/nodes");
    refused(&["inspect", &folder.0.path().display().to_string()], "folder");
}

fn bar(changes: &[(&str, &str)], more: &str) -> String {
    let mut text = std::fs::read_to_string(root().join("scenarios/bar.toml")).unwrap();
    text = text.replace("elements = [40]", "elements = [6]");
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text + more
}

/// Overflow is said of the number that overflows, not of the contact conditions.
#[test]
fn numbers_beyond_all_reason_are_named() {
    let folder = Folder::new();
    for (from, to, key) in [
        ("young = 1.0", "young = 1e300", "body.young"),
        ("gap = 1.0", "gap = 1e308", "contact.gap"),
        ("size = [1.0]", "size = [1e200]", "body.size"),
        ("until = 3.36", "until = 1e300", "run.until"),
        ("until = 3.36", "until = 1e12", "natural periods"),
        (
            "rtol = 1e-10",
            "[[load]]\nkind = \"mode\"\nmode = 1\npeak = 3.0\nomega = -1.0\n[damping]\nratio = 0.01",
            "omega",
        ),
    ] {
        let scene = folder.write("bar.toml", &bar(&[(from, to)], ""));
        refused(&["run", &scene, "-o", &folder.at("no.h5")], key);
        assert!(!std::path::Path::new(&folder.at("no.h5")).exists());
    }
    // a velocity whose square is no number any more
    let scene =
        folder.write("bar.toml", &bar(&[("[run]", "velocity = [\"1e300*exp(-x)\"]\n[run]")], ""));
    refused(&["run", &scene, "-o", &folder.at("no.h5")], "initial.velocity");
    let long = format!("gap = \"{}\"", vec!["1e-9*x"; 100_000].join("+"));
    let scene = folder.write("bar.toml", &bar(&[("gap = 1.0", &long)], ""));
    refused(&["run", &scene, "-o", &folder.at("no.h5")], "letters");
    let scene = folder.write("empty.toml", "");
    refused(&["run", &scene], "body");
    let load = "[[load]]\nkind = \"gravity\"\namplitude = -1.0\nphase = 3.141592653589793\n";
    let scene = folder.write("bar.toml", &bar(&[], load));
    refused(&["run", &scene, "-o", &folder.at("no.h5")], "phase");
}

/// What does not fit into memory or on the disk is refused before anything starts.
#[test]
fn what_cannot_fit_is_refused() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(root().join("scenarios/plate.toml")).unwrap();
    let scene = folder.write("large.toml", &text.replace("[20, 10]", "[2000, 2000]"));
    let limited =
        format!("ulimit -v 4000000; exec {} modes {scene}", env!("CARGO_BIN_EXE_signorini"));
    let output = std::process::Command::new("sh").args(["-c", &limited]).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("GB of memory") && words.contains("--force-large"), "{words}");
    let many = text.replace("rtol = 1e-9", "samples = 18446744073709551615");
    let scene = folder.write("many.toml", &many);
    let output = run(&["run", &scene, "-o", &folder.at("no.h5")]);
    assert!([1, 2].contains(&output.status.code().unwrap()));
    assert!(!std::path::Path::new(&folder.at("no.h5")).exists());
}

/// A plate that can slide and turn: a rotation meets the obstacle with one corner or the other.
#[test]
fn rigid_motions_are_judged_by_where_they_lead() {
    let folder = Folder::new();
    let plate = |velocity: &str, load: &str| {
        format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"y\"]\n[contact]\nedge = \"right\"\ngap = 0.1\n{load}\
             [initial]\nvelocity = [\"{velocity}\", \"0\"]\n[run]\nuntil = 0.5\n"
        )
    };
    let call = |text: String| {
        let scene = folder.write("free.toml", &text);
        run(&["run", &scene, "-o", &folder.at("free.h5"), "--force", "-q"]).status.code()
    };
    for velocity in ["-(y-0.25)", "y-0.25", "1", "1 + 0.1*y"] {
        assert_eq!(call(plate(velocity, "")), Some(0), "{velocity}");
    }
    for velocity in ["-1", "0", "-1 + 0.1*(y-0.25)"] {
        assert_eq!(call(plate(velocity, "")), Some(2), "{velocity}");
    }
    // a load that pushes through the obstacle holds the plate; one that turns it away from any support does not
    let push = |x: f64, y: f64| {
        format!("[[load]]\nkind = \"point\"\nat = [0.0, {y}]\namplitude = [{x}, 0.0]\n")
    };
    assert_eq!(call(plate("0", &push(0.1, 0.25))), Some(0));
    assert_eq!(call(plate("0", &push(-0.1, 0.25))), Some(2));
    assert_eq!(call(plate("1", &push(-0.1, 0.25))), Some(2));
}

/// A damping matrix in SI units is judged by its parts, not by numbers with units.
#[test]
fn a_damping_matrix_has_no_units() {
    let folder = Folder::new();
    let (m, k) = (2.6e-3, 7.0e9);
    for beta in [1e-7, 1e-12] {
        let matrix = |d: f64, o: f64| {
            format!(
                "%%MatrixMarket matrix array real symmetric\n3 3\n{d:e}\n{o:e}\n0\n{d:e}\n{o:e}\n{d:e}\n"
            )
        };
        folder.write("M.mtx", &matrix(4.0 * m, m));
        folder.write("K.mtx", &matrix(2.0 * k, -k));
        folder.write("C.mtx", &matrix(2.0 * beta * k, -beta * k));
        let scene = |damping: &str| {
            format!(
                "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n{damping}\
                 [contact]\ndisplacements = [2]\ngap = 1e-3\nstress = [[[2, 1e9], [1, -1e9]]]\n\
                 [initial]\nmode = 1\namplitude = -1.4\n[run]\nuntil = 1e-5\n"
            )
        };
        let given = folder.write("given.toml", &scene("damping_matrix = \"C.mtx\"\n"));
        json(&["run", &given, "-o", &folder.at(&format!("{beta:e}.h5"))]);
        // a part that is negative is refused
        folder
            .write("C.mtx", &matrix(2.0 * beta * k - 4e-3 * beta * k, -beta * k - 1e-3 * beta * k));
        refused(&["run", &given, "-o", &folder.at("no.h5")], "α M + β K");
    }
}

/// The reference of a study has no error of its own.
#[test]
fn the_reference_is_called_reference() {
    let folder = Folder::new();
    // springs that do not damp: nothing but the modes is exact
    let contact = "[contact]\nmethod = \"penalty\"\nstiffness = 50.0\n";
    let more = "[damping]\nratio = 0.01\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.1\nomega = 1.5\n";
    let scene = folder.write("forced.toml", &bar(&[("[contact]", contact)], more));
    let study = json(&["precision", &scene, "--repeats", "1", "-o", &folder.at("study")]);
    let points = study["study"]["points"].as_array().unwrap();
    let modal: Vec<&Value> =
        points.iter().filter(|p| p["method"].as_str().unwrap().starts_with("modal")).collect();
    assert!(!modal.is_empty());
    for p in &modal {
        assert!(p["error"].is_null() && p["switch_error"].is_null(), "{p}");
    }
    assert!(points.iter().any(|p| p["error"].as_f64().is_some_and(|e| e > 0.0)));
    let output = run(&["precision", &scene, "--repeats", "1", "-o", &folder.at("again")]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("reference     reference"));
}

/// Harmonic balance of a body that can move rigidly: the whole system is solved where the condensed one is singular.
#[test]
fn harmonic_balance_holds_a_free_body() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(root().join("scenarios/bouncing-bar.toml")).unwrap();
    let scene = folder.write("free.toml", &text.replace("elements = [100]", "elements = [6]"));
    for form in ["force", "acceleration"] {
        let result = json(&[
            "backbone",
            &scene,
            "--method",
            "hbm",
            "--harmonics",
            "5",
            "--form",
            form,
            "--range",
            "0.55,0.6",
            "-o",
            &folder.at(&format!("{form}.h5")),
        ]);
        let points = result["points"].as_array().unwrap();
        assert!(points.len() >= 10);
        for p in points {
            assert_eq!(p["converged"], true, "{p}");
            assert!(p["residual"].as_f64().unwrap() < 1e-9, "{p}");
        }
    }
}

/// A decayed motion that rests on the obstacle is no near miss a step.
#[test]
fn rest_is_not_a_thousand_grazings() {
    let folder = Folder::new();
    for (integrator, until) in [("modal", 400.0), ("dop853", 20.0)] {
        let text = format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [8, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = 0.0\n\
             [damping]\nratio = 0.2\nmode = 2\n\
             [initial]\ndisplacement = [\"-x\", \"0\"]\n[run]\nuntil = {until}\nintegrator = \"{integrator}\"\n"
        );
        let scene = folder.write("rest.toml", &text);
        let result = json(&["run", &scene, "-o", &folder.at(&format!("{integrator}.h5"))]);
        let count = result["grazings"].as_array().unwrap().len();
        let switches = result["switches"].as_array().unwrap().len();
        assert!(count <= 20 + switches, "{integrator}: {count} grazings, {switches} switches");
    }
}
