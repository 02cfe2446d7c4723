//! Bands of families: derivatives of all orbits against differences of other orbits, and by how lengths grow.

use serde_json::Value;
use tempfile::TempDir;

use signorini::records::Bands;
use signorini::store::read_bands;

use crate::common::{elastic_stop, json, refused, with_unit_matrix as written};

/// Stiffness of the stop; its gap is 1.
const STOP: f64 = 20.0;

/// Bands of a family file.
fn bands(folder: &TempDir, family: &str, deviations: &str) -> (Bands, Value) {
    let file = folder.path().join("bands.h5");
    let own = ["bands", family, "--deviation", deviations, "-o", file.to_str().unwrap(), "--force"];
    let said = json(&own);
    (read_bands(&file).unwrap().bands, said)
}

/// A response with both of its folds: at fixed frequency the amplitude changes as that of orbits of other scenes does, and along the branch as that of its neighbours.
#[test]
fn bands_of_a_response() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = written(folder.path(), &elastic_stop((0.2, 1.3), STOP, 1.0, [0.9, 1.4]));
    let family = at("response.h5");
    json(&["response", &scene, "--method", "shooting", "-o", &family]);
    let keys =
        "contact.gap=2%,load[0].amplitude=0.01,damping.rayleigh[0]=10%,contact.stiffness=10%";
    let (all, said) = bands(&folder, &family, keys);
    let keys: Vec<&str> = all.deviations.iter().map(|d| d.key.as_str()).collect();
    let sorted = ["contact.gap", "contact.stiffness", "damping.rayleigh[0]", "load[0].amplitude"];
    assert_eq!(keys, sorted);
    assert!((all.deviations[0].sigma - 0.02).abs() < 1e-15);
    let known: Vec<_> = all.rows.iter().filter(|row| row.note.is_empty()).collect();
    assert!(known.len() + 4 > all.rows.len() && known.len() > 60, "{}", known.len());
    for row in &known {
        let [gap, .., load] = &row.by[..] else { panic!("{row:?}") };
        let sum = |k: usize| gap[k] + 0.2 * load[k];
        let size = gap[0].abs() + load[0].abs();
        assert!((sum(0) - row.heights[0]).abs() < 1e-8 * size, "{row:?}");
        let size = gap[1].abs() + load[1].abs();
        assert!((sum(1) - 2.0 * row.heights[1]).abs() < 1e-8 * size, "{row:?}");
        let squares: f64 =
            row.by.iter().zip(&all.deviations).map(|(by, d)| (by[0] * d.sigma).powi(2)).sum();
        assert!((all.sigma(row)[0] - squares.sqrt()).abs() <= 1e-14 * squares.sqrt());
        let shares: f64 = (0..4).map(|k| all.share(row, k)).sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }
    // both folds are among them: the slope changes its sign through infinity
    let steep = known.iter().filter(|row| row.along[0].abs() > 30.0).count();
    assert!(steep > 2, "{steep}");
    // where the height is that of a fold the band stays finite
    let widest = known.iter().map(|row| {
        let (x, y) = all.across(row, 0, [0.5, 1.0]);
        x.abs() / 0.5 + y.abs()
    });
    assert!(widest.fold(0.0, f64::max) < 0.3);
    assert_eq!(said["sensitivity"]["contact.gap"]["deviation"].as_f64(), Some(0.02));

    // orbits of other dampings and stops, at the frequency of one on the upper branch
    let upper = known.iter().max_by(|a, b| a.heights[0].total_cmp(&b.heights[0])).unwrap();
    let row =
        known.iter().find(|r| r.index == upper.index - 6 && r.branch == upper.branch).unwrap();
    let omega = row.omega.to_string();
    let amplitude = |damping: f64, stop: f64, omega: &str| -> f64 {
        let text = elastic_stop((0.2, 1.3), stop, 1.0, [0.9, 1.4]);
        let text = text.replace("[0.1, 0.0]", &format!("[{damping:?}, 0.0]"));
        let start = format!("[initial]\nmode = 1\namplitude = {:?}\n", -row.heights[0]);
        let path = folder.path().join("other.toml");
        std::fs::write(&path, text + &start).unwrap();
        let sweep = at("sweep.h5");
        let from = row.omega - 0.2;
        let range = format!("{from},{omega}");
        let walk = ["response", path.to_str().unwrap(), "--sweep", "up", "--range", &range];
        json(&[&walk[..], &["--step", "0.2", "-o", &sweep, "--force"]].concat());
        let last = signorini::store::StoredFamily::read(sweep.as_ref()).unwrap();
        let last = last.points.iter().max_by(|a, b| a.omega.total_cmp(&b.omega)).unwrap().clone();
        assert!((last.omega - omega.parse::<f64>().unwrap()).abs() < 1e-12);
        last.orbit.unwrap().amplitude
    };
    assert!((amplitude(0.1, STOP, &omega) / row.heights[0] - 1.0).abs() < 1e-9, "another branch");
    let h = 1e-4;
    for (number, found) in [
        (
            2,
            (amplitude(0.1 * (1.0 + h), STOP, &omega) - amplitude(0.1 * (1.0 - h), STOP, &omega))
                / (0.2 * h),
        ),
        (
            1,
            (amplitude(0.1, STOP * (1.0 + h), &omega) - amplitude(0.1, STOP * (1.0 - h), &omega))
                / (40.0 * h),
        ),
    ] {
        assert!((row.by[number][0] / found - 1.0).abs() < 1e-5, "{number}: {row:?} {found}");
    }
    let beside = |s: f64| amplitude(0.1, STOP, &(row.omega * (1.0 + s * h)).to_string());
    let found = (beside(1.0) - beside(-1.0)) / (2.0 * h * row.omega);
    assert!((row.along[0] / found - 1.0).abs() < 1e-5, "{row:?} {found}");
}

/// Of a backbone, conservative and viscous, all lengths grow with the gap.
#[test]
fn bands_of_backbones() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let body = "title = \"bar\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n\
                [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 0.5\nmethod = \"mass-redistribution\"\n\
                [orbit]\nrange = [1.62, 1.8]\nbeta = 0.03\n";
    let path = folder.path().join("bar.toml");
    std::fs::write(&path, body).unwrap();
    let scene = path.to_str().unwrap();
    for (more, name) in [(&[][..], "conservative.h5"), (&["--viscous"], "viscous.h5")] {
        let family = at(name);
        json(&[&["backbone", scene, "-o", &family][..], more].concat());
        let (all, _) = bands(&folder, &family, "contact.gap=0.01");
        let known: Vec<_> = all.rows.iter().filter(|row| row.note.is_empty()).collect();
        assert!(known.len() > 5 && 2 * known.len() > all.rows.len(), "{name}: {all:?}");
        for row in known {
            assert!((0.5 * row.by[0][0] / row.heights[0] - 1.0).abs() < 1e-8, "{name}: {row:?}");
            assert!((0.5 * row.by[0][1] / row.heights[1] - 2.0).abs() < 1e-8, "{name}: {row:?}");
        }
    }
}

#[test]
fn files_of_bands_are_shown_and_what_makes_no_sense_is_refused() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = written(folder.path(), &elastic_stop((0.2, 1.3), STOP, 1.0, [1.3, 1.4]));
    let family = at("response.h5");
    json(&["response", &scene, "--method", "shooting", "-o", &family]);
    let (all, _) = bands(&folder, &family, "contact.gap=0.02,contact.stiffness=1");
    let file = at("bands.h5");
    assert_eq!(json(&["inspect", &file])["omega"].as_array().unwrap().len(), all.rows.len());
    json(&["plot", &file, "-o", &at("picture.png")]);
    assert!(folder.path().join("picture.png").exists());
    json(&["export", &file]);
    let table = std::fs::read_to_string(folder.path().join("bands.csv")).unwrap();
    assert_eq!(table.lines().count(), all.rows.len() + 1);
    assert!(table.starts_with("branch,index,omega,amplitude,amplitude_deviation"));
    // where nothing is left to do a run that goes on does nothing
    let own = ["bands", &family, "-o", &file, "--resume", "--deviation"];
    let before = std::fs::read(&file).unwrap();
    json(&[&own[..], &["contact.gap=0.02,contact.stiffness=1"]].concat());
    assert_eq!(std::fs::read(&file).unwrap(), before);
    refused(&[&own[..], &["contact.gap=0.03,contact.stiffness=1"]].concat(), "another");
    let other = at("other.h5");
    for (words, why) in [
        ("contact.gap", "standard deviation"),
        ("contact.gap=0", "standard deviation"),
        ("contact.gap=-1%", "standard deviation"),
        ("contact.gap=0.1,contact.gap=0.2", "twice"),
        ("contact.gape=0.1", "contact.gape"),
        ("load[0].omega=0.1", "frequency"),
        ("orbit.range[0]=0.1", "orbit.range[0]"),
    ] {
        refused(&["bands", &family, "--deviation", words, "-o", &other], why);
    }
    refused(&["bands", &file, "--deviation", "contact.gap=0.1", "-o", &other], "backbone");
    refused(&["bands", &family, "--deviation", "contact.gap=0.1", "-o", &family], "response.h5");
}

/// Orbits of families that friction holds have no derivative: some rest is anybody's.
#[test]
fn what_friction_holds_has_no_band() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let text = std::fs::read_to_string(crate::common::root().join("scenarios/shaken-block.toml"));
    let text = text.unwrap();
    let line = text.lines().find(|l| l.starts_with("elements = ")).unwrap();
    let coarse = text.replace(line, "elements = [4, 2]") + "\n[orbit]\nrange = [0.7, 0.8]\n";
    std::fs::write(at("block.toml"), coarse).unwrap();
    let family = at("family.h5");
    json(&["response", &at("block.toml"), "--method", "shooting", "--step", "1", "-o", &family]);
    let (all, _) = bands(&folder, &family, "contact.friction=5%");
    assert!(!all.rows.is_empty());
    for row in &all.rows {
        assert!(row.by[0][0].is_nan() && row.note.contains("friction"), "{row:?}");
    }
}
