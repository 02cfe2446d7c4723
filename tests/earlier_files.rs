//! Files of earlier forms: what was written then is read now, number by number; what a later program writes is refused with its version.

use std::path::{Path, PathBuf};

use crate::common::{json, root, run};
use serde_json::Value;

/// Files of form 1 by the commands that they name: a bar of ten elements, and a mass before an elastic stop.
const FILES: [&str; 4] = ["run", "orbit", "backbone", "crosscheck"];

/// Unpacked into a folder.
fn file(name: &str, folder: &Path) -> PathBuf {
    let packed = root().join("tests/reference/files-1").join(format!("{name}.h5.gz"));
    let mut whole = flate2::read::GzDecoder::new(std::fs::File::open(packed).unwrap());
    let path = folder.join(format!("{name}.h5"));
    std::io::copy(&mut whole, &mut std::fs::File::create(&path).unwrap()).unwrap();
    path
}

#[test]
fn files_of_the_first_form_are_read() {
    let kept = std::fs::read_to_string(root().join("tests/reference/files-1/inspected.json"));
    let kept: Value = serde_json::from_str(&kept.unwrap()).unwrap();
    let place = tempfile::tempdir().unwrap();
    for name in FILES {
        let path = file(name, place.path()).display().to_string();
        let now = json(&["inspect", &path]);
        for (key, then) in kept[name].as_object().unwrap() {
            // where it lies is no matter of its form
            if !["file", "path", "bytes"].contains(&key.as_str()) {
                assert_eq!(&now[key], then, "{name}: {key}");
            }
        }
        let stem = place.path().join(name).display().to_string();
        let drawn = run(&["plot", &path, "-o", &stem]);
        assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
        let exported = run(&["export", &path, "--format", "csv", "-o", &stem]);
        assert!(exported.status.success(), "{}", String::from_utf8_lossy(&exported.stderr));
    }
    let csv = std::fs::read_to_string(place.path().join("run.csv")).unwrap();
    let last: Vec<f64> =
        csv.lines().last().unwrap().split(',').filter_map(|x| x.parse().ok()).collect();
    assert_eq!(last[0], kept["last_row"][0].as_f64().unwrap());
    for (now, then) in last.iter().zip(kept["last_row"].as_array().unwrap()) {
        assert_eq!(*now, then.as_f64().unwrap());
    }
}

#[test]
fn files_of_a_later_form_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let copy = file("run", place.path());
    let h5 = hdf5::File::open_rw(&copy).unwrap();
    h5.attr("format").unwrap().write_scalar(&7u32).unwrap();
    drop(h5);
    for command in ["inspect", "plot", "export", "view"] {
        let output = run(&[command, &copy.display().to_string()]);
        assert_eq!(output.status.code(), Some(2), "{command}");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("form (7)"), "{command}: {said}");
    }
}
