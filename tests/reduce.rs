//! `signorini reduce`: its arrays are the body.

use std::path::Path;

use crate::common::{json, run};
use serde_json::Value;

fn times(said: &Value) -> Vec<f64> {
    let all = said["switches"].as_array().unwrap();
    all.iter().map(|s| s["t"].as_f64().unwrap()).collect()
}

fn solved(folder: &Path, name: &str, text: &str) -> Value {
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, text).unwrap();
    let out = folder.join(format!("{name}.h5")).display().to_string();
    json(&["run", path.to_str().unwrap(), "-o", &out, "--force"])
}

/// A reduced plate, and the same from the arrays of its file as a body of matrices: same switches.
#[test]
fn a_reduced_body_comes_back_from_its_arrays() {
    let folder = tempfile::tempdir().unwrap();
    for reduction in
        ["", "[reduction]\nmodes = 4\n", "[reduction]\nkind = \"free-interface\"\nmodes = 6\n"]
    {
        let plate = format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [5, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n\
             [contact]\nedge = \"right\"\ngap = \"0.1 + 0.02*y\"\nmethod = \"mass-redistribution\"\n\
             [damping]\nrayleigh = [0.02, 0.03]\n\
             [[load]]\nkind = \"traction\"\nedge = \"top\"\namplitude = [0.08, 0.02]\nomega = 1.3\nphase = 0.4\n\
             [run]\nuntil = 30.0\nsamples = 10\n{reduction}"
        );
        let whole = times(&solved(folder.path(), "plate", &plate));
        assert!(whole.len() > 10, "{whole:?}");
        let scene = folder.path().join("plate.toml").display().to_string();
        for ending in ["h5", "mat", "npz"] {
            let file = folder.path().join(format!("rom.{ending}"));
            let said = json(&["reduce", &scene, "-o", file.to_str().unwrap(), "--force"]);
            // what the file says of itself
            let held = json(&["inspect", file.to_str().unwrap()]);
            let key = if ending == "h5" { "arrays" } else { "matrices" };
            let names = |all: &Value| -> Vec<String> {
                let all = all.as_array().unwrap().iter();
                let mut names: Vec<String> =
                    all.map(|a| a["name"].as_str().unwrap().replace('/', "")).collect();
                names.sort();
                names
            };
            assert_eq!(names(&held[key]), names(&said["arrays"]), "{ending}");
            let shape = |name: &str| -> Option<[usize; 2]> {
                let all = said["arrays"].as_array().unwrap();
                let own = all.iter().find(|a| a["name"] == name)?;
                serde_json::from_value(own["shape"].clone()).ok()
            };
            let [points, n] = shape("W").unwrap();
            assert_eq!((points, shape("K"), shape("force")), (4, Some([n, n]), Some([1, n])));
            // the columns of W that are not zero: contact displacements come last
            let rows: Vec<usize> = (n - points..n).collect();
            let h5 = folder.path().join("arrays.h5");
            json(&["reduce", &scene, "-o", h5.to_str().unwrap(), "--force"]);
            let arrays = hdf5::File::open(&h5).unwrap();
            let list = |name: &str| arrays.dataset(name).unwrap().read_raw::<f64>().unwrap();
            let (force, gap) = (list("force"), list("gap"));
            let w = list("W");
            assert!((0..points).all(|k| w[n * k + rows[k]] == 1.0));
            let name = format!("rom.{ending}");
            let matrices = format!(
                "[body]\nkind = \"matrices\"\nstiffness_matrix = \"{name}:/K\"\nmass_matrix = \"{name}:/M\"\n\
                 damping_matrix = \"{name}:/C\"\n\
                 [contact]\ndisplacements = {rows:?}\ngaps = {gap:?}\nmethod = \"mass-redistribution\"\n\
                 [[load]]\nkind = \"force\"\namplitude = {force:?}\nomega = 1.3\nphase = 0.4\n\
                 [run]\nuntil = 30.0\nsamples = 10\n"
            );
            let own = times(&solved(folder.path(), "matrices", &matrices));
            assert_eq!(own.len(), whole.len(), "{reduction} {ending}");
            for (a, b) in own.iter().zip(&whole) {
                assert!((a - b).abs() < 1e-7, "{reduction} {ending}: {a} {b}");
            }
        }
        let kept = run(&["inspect", folder.path().join("rom.h5").to_str().unwrap(), "--scene"]);
        assert_eq!(String::from_utf8_lossy(&kept.stdout).trim(), plate.trim());
        // what stands there and is not ours stays
        let other = folder.path().join("other.mat");
        std::fs::write(&other, "somebody's").unwrap();
        let refused = run(&["reduce", &scene, "-o", other.to_str().unwrap(), "--force"]);
        assert_eq!(refused.status.code(), Some(2));
        assert_eq!(std::fs::read(&other).unwrap(), b"somebody's");
        let refused = run(&["reduce", &scene, "-o", "rom.txt"]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(".npz"), "{said}");
    }
}

/// A basis takes coordinates to displacements of the mesh: those that a run of the reduced body stores.
#[test]
fn the_basis_is_that_of_the_files_of_runs() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "scenarios/blade.toml";
    let file = folder.path().join("blade.h5");
    let said = json(&["reduce", scene, "-o", file.to_str().unwrap(), "--basis"]);
    let n = said["arrays"][0]["shape"][0].as_u64().unwrap() as usize;
    let arrays = hdf5::File::open(&file).unwrap();
    let basis: ndarray::Array2<f64> = arrays.dataset("B").unwrap().read_2d().unwrap();
    let u_0: Vec<f64> = arrays.dataset("u_0").unwrap().read_raw().unwrap();
    let out = folder.path().join("run.h5").display().to_string();
    json(&["run", scene, "-o", &out]);
    let stored = hdf5::File::open(&out).unwrap();
    let u: ndarray::Array2<f64> = stored.dataset("trajectory/u").unwrap().read_2d().unwrap();
    assert_eq!((basis.nrows(), basis.ncols()), (u.ncols(), n));
    assert_eq!(u_0.len(), n);
    let first = u.row(0);
    let size = first.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (i, seen) in first.iter().enumerate() {
        let own: f64 = u_0.iter().enumerate().map(|(j, y)| basis[(i, j)] * y).sum();
        assert!((own - seen).abs() < 1e-12 * size, "{i}");
    }
}

/// What the arrays do not say is said.
#[test]
fn what_no_array_holds_is_said() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, word) in [
        ("driven-stop", "impact law"),
        ("rough-wall", "friction"),
        ("rotating-casing", "gap moves"),
        ("half-plate-redistribution", ""),
    ] {
        let out = folder.path().join(format!("{scene}.npz")).display().to_string();
        let said = json(&["reduce", &format!("scenarios/{scene}.toml"), "-o", &out]);
        let warnings = said["warnings"].to_string();
        assert!(warnings.contains(word) && (warnings == "[]") == word.is_empty(), "{warnings}");
    }
    let refused = run(&["reduce", "scenarios/joint.toml", "-o", "x.npz"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && said.contains("remember"), "{said}");
}
