//! Bifurcation diagrams over a number of the scene: jumps where the response folds and grazes, doublings where another program has them.

use serde_json::Value;
use tempfile::TempDir;

use signorini::continuation::Go;
use signorini::families::diagram::follow;
use signorini::problem::Problem;
use signorini::records::Diagram;
use signorini::scenario::Scene;
use signorini::store::read_diagram;

use crate::common::{elastic_stop, json, refused, with_unit_matrix as written};

const WIDE: [f64; 2] = [0.8, 1.6];

/// The diagram of a scene in a folder.
fn diagram(folder: &TempDir, text: &str, over: &str, more: &[&str]) -> (Diagram, Value) {
    let scene = written(folder.path(), text);
    let file = folder.path().join("diagram.h5");
    let own = ["diagram", &scene, "-o", file.to_str().unwrap(), "--over", over, "--force"];
    let said = json(&[&own, more].concat());
    (read_diagram(&file).unwrap().diagram, said)
}

/// The values beside the jump of a walk: before it, and behind it.
fn jump(found: &Diagram, falls: bool) -> (f64, f64) {
    let rows: Vec<_> = found.walk(falls).collect();
    let jumps: Vec<usize> = (1..rows.len()).filter(|&k| rows[k].special.word() == "jump").collect();
    assert_eq!(jumps.len(), 1, "{falls}");
    (rows[jumps[0] - 1].value, rows[jumps[0]].value)
}

#[test]
fn jumps_are_at_folds_and_grazings() {
    let folder = TempDir::new().unwrap();
    let text = elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE);
    let over = "load[0].amplitude=0.05,0.6";
    let (found, said) = diagram(&folder, &text, over, &["--way", "both", "--steps", "40"]);
    // upwards until the linear response touches, in closed form
    let grazing = ((1.0f64 - 1.44).powi(2) + 0.12f64.powi(2)).sqrt();
    let (before, behind) = jump(&found, false);
    assert!(before <= grazing * (1.0 + 1e-4) && grazing <= behind, "{before} {grazing} {behind}");
    let halved = (0.6 - 0.05) / 40.0 / 64.0;
    assert!((behind - before - halved).abs() < 1e-9, "{before} {behind}");
    // downwards until the upper branch folds, which is followed over the load by another method
    let scene = folder.path().join("scene.toml").display().to_string();
    let file = folder.path().join("folds.h5").display().to_string();
    let folds =
        json(&["curve", &scene, "--of", "fold", "--over", over, "--step", "0.01", "-o", &file]);
    let curve = &folds["curves"][0];
    let of = |name: &str| -> Vec<f64> {
        curve[name].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let (omega, value, amplitude) = (of("omega"), of("value"), of("amplitude"));
    let fold = (1..omega.len())
        .filter(|&k| (omega[k - 1] - 1.2) * (omega[k] - 1.2) <= 0.0 && amplitude[k] > 1.2)
        .map(|k| {
            let s = (1.2 - omega[k - 1]) / (omega[k] - omega[k - 1]);
            value[k - 1] + s * (value[k] - value[k - 1])
        })
        .next()
        .unwrap();
    let (before, behind) = jump(&found, true);
    let within = 1e-4;
    assert!(behind - within <= fold && fold <= before + within, "{behind} {fold} {before}");
    assert!(before - behind < 1.01 * halved);
    // rows of both are in the order of their walks
    let directions = said["direction"].as_array().unwrap();
    assert_eq!(directions.first().unwrap(), 1);
    assert_eq!(directions.last().unwrap(), -1);
}

/// A stop without gap: motions scale with the load, and double where another program has it, whatever the load.
/// In a grid so coarse that amplitudes multiply from value to value: what grows in proportion does not jump, what jumps does, and no load is rest.
#[test]
fn growth_is_no_jump() {
    let folder = TempDir::new().unwrap();
    let text = elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE);
    let (found, _) = diagram(&folder, &text, "load[0].amplitude=0,0.6", &["--steps", "12"]);
    let rows: Vec<_> = found.walk(false).collect();
    assert_eq!((rows[0].seen.kind.periods(), rows[0].seen.amplitude()), (1, 0.0));
    assert_eq!(rows[0].seen.note, "at rest");
    let grazing = ((1.0f64 - 1.44).powi(2) + 0.12f64.powi(2)).sqrt();
    let (before, behind) = jump(&found, false);
    assert!(before <= grazing * (1.0 + 1e-4) && grazing <= behind, "{before} {grazing} {behind}");
    assert!(behind - before < 0.05 / 60.0);
    assert!(rows.iter().all(|row| row.seen.kind.periods() == 1));
}

#[test]
fn the_load_changes_nothing_without_a_gap() {
    let folder = TempDir::new().unwrap();
    for (omega, periods) in [(2.55, 1), (2.58, 2)] {
        let text = elastic_stop((1.0, omega), 200.0, 0.0, WIDE);
        let (found, _) = diagram(&folder, &text, "load[0].amplitude=0.5,2", &["--steps", "6"]);
        let unit = found.rows[0].seen.amplitude() / 0.5;
        for row in found.rows.iter().filter(|row| row.goes_on) {
            assert_eq!(row.seen.kind.periods(), periods);
            let scaled = row.seen.amplitude() / row.value;
            assert!((scaled / unit - 1.0).abs() < 1e-8, "{}: {scaled} {unit}", row.value);
        }
    }
}

/// A change of what modes are made of: the state is handed on from body to body.
#[test]
fn a_density_shifts_the_frequency() {
    let folder = TempDir::new().unwrap();
    // M q'' + K q with M = ρ/3: far below its stop a linear oscillator
    let bar = "title = \"bar\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 3.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
               [contact]\nedge = \"right\"\ngap = 9.0\nmethod = \"penalty\"\nstiffness = 20.0\n[damping]\nrayleigh = [0.1, 0.0]\n\
               [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.2\nomega = 1.2\n";
    let (found, _) = diagram(&folder, bar, "body.density=2.5,3.5", &["--steps", "20"]);
    assert!(found.rows.len() >= 21);
    for row in &found.rows {
        let mass = row.value / 3.0;
        let expected = 0.2 / ((1.0 - mass * 1.44).powi(2) + (0.1 * mass * 1.2).powi(2)).sqrt();
        let found = row.seen.amplitude();
        assert!((found / expected - 1.0).abs() < 1e-6, "{}: {found} for {expected}", row.value);
    }
}

#[test]
fn an_interrupted_walk_goes_on_to_the_same() {
    let folder = TempDir::new().unwrap();
    let path = written(folder.path(), &elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE));
    let scene = Scene::read(std::path::Path::new(&path)).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    let asked = Diagram {
        key: "load[0].amplitude".into(),
        range: [0.3, 0.6],
        steps: 8,
        omega: 1.2,
        dwell: None,
        rows: vec![],
    };
    let go_on = |diagram: &mut Diagram, most: usize| {
        let mut count = 0;
        let mut take = |_: &Diagram| {
            count += 1;
            Ok(if count < most { Go::Continue(()) } else { Go::Break(()) })
        };
        follow((&scene, &problem), diagram, &[false, true], &mut take).unwrap()
    };
    let mut whole = asked.clone();
    assert!(go_on(&mut whole, usize::MAX).is_continue());
    assert_eq!(whole.walk(true).count(), whole.rows.len() - whole.walk(false).count());
    for most in [8, 11] {
        let mut pieces = asked.clone();
        let mut runs = 1;
        while go_on(&mut pieces, most).is_break() {
            runs += 1;
            assert!(runs < 50);
        }
        assert!(runs > 2);
        assert_eq!(pieces, whole);
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = TempDir::new().unwrap();
    // nothing settles that loses nothing
    let undamped = elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE).replace("[0.1, 0.0]", "[0.0, 0.0]");
    let own = written(folder.path(), &undamped);
    let other = folder.path().join("other.h5").display().to_string();
    for words in [
        &["diagram", &own, "--over", "contact.gap=0.5,1", "-o", &other][..],
        &["basins", &own, "--size", "2", "-o", &other],
        &["response", &own, "--sweep", "up", "-o", &other],
        &["phase-resonance", &own, "--over", "contact.gap=0.5,1", "-o", &other],
    ] {
        refused(words, "is zero");
    }
    let scene = written(folder.path(), &elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE));
    let file = folder.path().join("d.h5").display().to_string();
    let words = |over: &str, more: &[&str], why: &str| {
        refused(&[&["diagram", &scene, "-o", &file, "--over", over], more].concat(), why);
    };
    words("load[0].amplitude=2,1", &[], "--over");
    words("load[0].omega=1,2", &[], "is the frequency of the");
    words("contact.stiffness=-1,20", &[], "contact.stiffness");
    words("contact.nothing=1,2", &[], "contact.nothing");
    words("run.samples=1,2", &[], "is no number of the equations");
    let over = "load[0].amplitude=0.1,0.2";
    let first = json(&["diagram", &scene, "-o", &file, "--over", over, "--steps", "2"]);
    words(over, &["--steps", "3", "--resume"], "another --steps");
    words(over, &["--steps", "2", "--way", "down", "--resume"], "another --way");
    words(over, &["--steps", "2"], "exists");
    let again = json(&["diagram", &scene, "-o", &file, "--over", over, "--steps", "2", "--resume"]);
    assert_eq!(again["value"], first["value"]);
}
