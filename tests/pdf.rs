//! Pictures as PDF: what PDFium draws from them is what the PNG shows.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{root, run};
use serde_json::Value;

fn done(arguments: &[&str]) {
    let output = run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn pdfium_draws_what_the_png_shows() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).display().to_string();
    let scene = |name: &str| root().join("scenarios").join(name).display().to_string();
    let (plate, bar) = (scene("plate.toml"), scene("bar.toml"));
    let (beam, family) = (at("plate.h5"), at("family.h5"));
    done(&["run", &plate, "-o", &beam, "-q"]);
    done(&["plot", &beam]);
    let words = ["--viscous", "--range", "1.7,1.8", "--step", "0.02", "--quick", "-q"];
    done(&[&["backbone", &scene("half-plate-viscous.toml"), "-o", &family][..], &words].concat());
    done(&["plot", &family]);
    done(&["precision", &bar, "-o", &at("bar"), "-q"]);
    let mut pictures: Vec<PathBuf> = std::fs::read_dir(place.path())
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "pdf"))
        .collect();
    pictures.sort();
    assert!(pictures.len() >= 6, "{pictures:?}");
    // drawn again, the same bytes
    let first = std::fs::read(&pictures[0]).unwrap();
    done(&["plot", &family]);
    done(&["plot", &beam]);
    assert!(std::fs::read(&pictures[0]).unwrap() == first);
    // another program's file of that name stays
    let foreign = at("plate-gap.pdf");
    let ours = std::fs::read(&foreign).unwrap();
    std::fs::write(&foreign, b"%PDF-1.7\n% mine\n").unwrap();
    assert_eq!(run(&["plot", &beam, "--only", "gap"]).status.code(), Some(2));
    std::fs::write(&foreign, ours).unwrap();
    let Some(python) = crate::common::python("pypdfium2, PIL, numpy", "PDFium") else { return };
    for pdf in pictures {
        let png = pdf.with_extension("png");
        let words = [&root().join("tests/pdf.py"), &pdf, &png] as [&Path; 3];
        let output = Command::new(&python).args(words).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        let number = |v: &Value| v.as_f64().unwrap();
        let stem = pdf.file_stem().unwrap().to_str().unwrap();
        assert!(said["pages"] == 1 && said["producer"] == "signorini" && said["title"] == stem);
        // 192 dots and 72 points an inch
        for (points, dots) in [(0, 1), (1, 0)] {
            let (points, dots) = (number(&said["size"][points]), number(&said["shape"][dots]));
            assert!((points / 72.0 - dots / 192.0).abs() < 0.01, "{said}");
        }
        // letters and edges are smoothed in other ways
        assert!(number(&said["off"]) < 0.005 && number(&said["ink"]) > 0.01, "{stem}: {said}");
    }
}
