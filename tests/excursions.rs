//! How far bodies that meet stray from where they were joined; what the contact does to the nodes of both.

use std::path::Path;

use crate::common::{hdf5_files, json, run};
use serde_json::Value;

/// A plate: name, size, elements, where it stands.
fn plate(name: &str, size: [f64; 2], elements: [usize; 2], place: &str) -> String {
    format!(
        "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = {size:?}\nelements = {elements:?}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{place}\n"
    )
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn table(file: &str, path: &str) -> ndarray::Array2<f64> {
    hdf5_files().open(file).unwrap().dataset(path).unwrap().read_2d().unwrap()
}

fn warnings(said: &Value) -> Vec<&str> {
    said["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect()
}

/// A plate flies past a held one, and turns: what it slides is `v t`, what it turns `ω t`; beyond a side and a tenth that is said.
#[test]
fn a_body_that_flies_past_slides_and_turns() {
    let folder = tempfile::tempdir().unwrap();
    let (speed, spin) = (0.3, 0.04);
    let text = |until: f64| {
        plate("a", [1.0, 0.4], [5, 2], "")
            + &plate("b", [0.6, 0.4], [3, 2], "move = [0.2, 0.5]")
            + &format!(
                "[[support]]\nedge = 'a:bottom'\nfix = ['x', 'y']\n[[contact]]\nslave = 'b:bottom'\nmaster = 'a:top'\n\
                 [initial]\nvelocity = {{ b = ['{speed} - {spin}*(y - 0.7)', '{spin}*(x - 0.5) + 0.2'] }}\n[run]\nuntil = {until}\nsamples = 20\n"
            )
    };
    let at = |name: &str| folder.path().join(name).display().to_string();
    let near = written(folder.path(), "near.toml", &text(0.5));
    let said = json(&["run", &near, "-o", &at("near.h5")]);
    assert!(warnings(&said).is_empty(), "{said}");
    let t: Vec<f64> = hdf5_files()
        .open(at("near.h5"))
        .unwrap()
        .dataset("trajectory/t")
        .unwrap()
        .read_raw()
        .unwrap();
    let (sliding, rotation) =
        (table(&at("near.h5"), "contact/pairs/sliding"), table(&at("near.h5"), "bodies/rotation"));
    for (row, t) in t.iter().enumerate() {
        // its lower face lies 0.2 below the centre about which it turns
        let expected = (speed + 0.2 * spin) * t / 0.2;
        assert!((sliding[(row, 0)] - expected).abs() < 1e-12, "{t}: {}", sliding[(row, 0)]);
        let (held, flying) = (rotation[(row, 0)], rotation[(row, 1)]);
        assert!((flying - spin * t).abs() < 1e-12 && held.abs() < 1e-12, "{held} {flying}");
    }
    let far = written(folder.path(), "far.toml", &text(3.0));
    let said = json(&["run", &far, "-o", &at("far.h5")]);
    let found = warnings(&said);
    let slides = "\"b:bottom\" slides over \"a:top\" by up to 4.62 of its sides (at t = 3.00000)";
    assert!(found.iter().any(|w| w.starts_with(slides)), "{found:?}");
    assert!(found.iter().any(|w| w.starts_with("\"b\" turns by up to 0.120 ")), "{found:?}");
    assert_eq!(said["excursions"][0]["kind"], "sliding");
    // people are told the same
    let output = run(&["run", &far, "-o", &at("again.h5")]);
    assert!(String::from_utf8_lossy(&output.stdout).contains(slides));
}

/// Blocks under a uniform pressure, of meshes that do not match: the pressure on both sides, the forces of one those of the other.
#[test]
fn both_sides_bear_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = plate("low", [1.0, 0.5], [4, 2], "")
        + &plate("high", [1.0, 0.5], [7, 3], "move = [0.0, 0.5]")
        + "[[support]]\nedge = 'low:bottom'\nfix = ['y']\n[[support]]\nedge = 'low:left'\nfix = ['x']\n[[support]]\nedge = 'high:left'\nfix = ['x']\n\
           [[contact]]\nslave = 'high:bottom'\nmaster = 'low:top'\n[[load]]\nkind = 'traction'\nedge = 'high:top'\namplitude = [0.0, -0.01]\n\
           [initial]\nequilibrium = true\n[run]\nuntil = 0.1\nsamples = 2\n";
    let scene = written(folder.path(), "pressed.toml", &text);
    json(&["run", &scene, "-o", &at("pressed.h5")]);
    let export = ["export", &at("pressed.h5"), "--format", "xdmf", "-o", &at("x")];
    assert_eq!(run(&export).status.code(), Some(0));
    let file = hdf5_files().open(at("x.xdmf.h5")).unwrap();
    let field = |name: &str| -> Vec<f64> {
        file.dataset(&format!("states/000000/{name}")).unwrap().read_raw().unwrap()
    };
    let nodes = table(&at("pressed.h5"), "mesh/nodes");
    let (pressure, force) = (field("contact_pressure"), field("contact_force"));
    let mut sums = [0.0; 2];
    for (n, p) in pressure.iter().enumerate() {
        let meets = nodes[(n, 1)] == 0.5;
        let expected = if meets { 0.01 } else { 0.0 };
        assert!((p - expected).abs() < 1e-14, "{n}: {p}");
        // the upper body comes second
        sums[usize::from(n >= 15)] += force[3 * n + 1];
        assert!(force[3 * n].abs() < 1e-16 && (meets || force[3 * n + 1] == 0.0));
    }
    assert!((sums[1] - 0.01).abs() < 1e-14 && (sums[0] + 0.01).abs() < 1e-14, "{sums:?}");
    // the same as a table
    let said = run(&["export", &at("pressed.h5"), "--format", "csv", "-o", &at("x")]);
    assert_eq!(said.status.code(), Some(0));
    let text = std::fs::read_to_string(at("x.csv")).unwrap();
    let mut lines = text.lines();
    let column = |name: &str, head: &str| head.split(',').position(|c| c == name).unwrap();
    let (head, first) = (lines.next().unwrap(), lines.next().unwrap());
    let number =
        |name: &str| -> f64 { first.split(',').nth(column(name, head)).unwrap().parse().unwrap() };
    assert!((number("force_y[high:bottom]") - 0.01).abs() < 1e-14);
    assert!((number("support_y[low:bottom]") - 0.01).abs() < 1e-13);
    assert!(number("force_x[high:bottom]").abs() < 1e-16);
}

/// Friction acts on both as well, and both on the page.
#[test]
fn tractions_and_forces_are_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = plate("a", [0.8, 0.6], [5, 4], "")
        + &plate("b", [0.5, 0.4], [3, 3], "move = [0.9, 0.1]")
        + "[[contact]]\nslave = 'b:left'\nmaster = 'a:right'\nfriction = 0.4\n[initial]\nvelocity = { b = ['-0.5', '0.2'] }\n[run]\nuntil = 1.2\nsamples = 40\n";
    let scene = written(folder.path(), "thrown.toml", &text);
    json(&["run", &scene, "-o", &at("thrown.h5")]);
    let export = ["export", &at("thrown.h5"), "--format", "xdmf", "-o", &at("x")];
    assert_eq!(run(&export).status.code(), Some(0));
    let file = hdf5_files().open(at("x.xdmf.h5")).unwrap();
    let resultant = table(&at("thrown.h5"), "forces/contact/force");
    let mut largest = 0.0f64;
    for row in 0..resultant.nrows() {
        let force: Vec<f64> =
            file.dataset(&format!("states/{row:06}/contact_force")).unwrap().read_raw().unwrap();
        for c in 0..2 {
            let of = |nodes: std::ops::Range<usize>| nodes.map(|n| force[3 * n + c]).sum::<f64>();
            let (a, b) = (of(0..30), of(30..46));
            assert!((a + b).abs() < 1e-15 && (b - resultant[(row, c)]).abs() < 1e-15, "{row}");
        }
        largest = largest.max(resultant[(row, 1)].abs());
    }
    assert!(largest > 1e-3, "friction acts: {largest}");
    let output = run(&["view", &at("thrown.h5"), "-o", &at("page.html")]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(at("page.html")).unwrap();
    let begin = "<script type=\"application/json\" id=\"data\">";
    let data = page.split_once(begin).unwrap().1.split_once("</script>").unwrap().0;
    let data: Value = serde_json::from_str(data).unwrap();
    let motion = &data["views"][0]["motion"];
    assert!(motion["frames"]["traction"]["data"].is_string());
    assert!(motion["ledger"]["friction"]["data"].is_string());
    let names: Vec<&str> = motion["forces"][0]["curves"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        (names, &motion["forces"][0]["kind"]),
        (vec!["b:left, x", "b:left, y"], &Value::from("contact"))
    );
}
