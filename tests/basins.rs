//! Basins of attraction: against a slow, obvious integrator, and the numbers of an independent program.

use serde_json::Value;
use tempfile::TempDir;

use signorini::continuation::Go;
use signorini::families::basins::{Plane, coordinates, find};
use signorini::problem::{Problem, mode_shapes};
use signorini::records::{AttractorKind, Basins, Fate, Starts, StateAxis};
use signorini::scenario::Scene;
use signorini::store::read_basins;

use crate::common::{elastic_stop, json, refused, small_steps, with_unit_matrix as written};

const WIDE: [f64; 2] = [0.8, 1.6];

/// The basins of a scene in a folder, and what was said of them.
fn basins(folder: &TempDir, text: &str, more: &[&str]) -> (Basins, Value) {
    let scene = written(folder.path(), text);
    let file = folder.path().join("basins.h5");
    let own = ["basins", &scene, "-o", file.to_str().unwrap(), "--force"];
    let said = json(&[&own, more].concat());
    (read_basins(&file).unwrap().basins, said)
}

/// The motion from a state by Runge–Kutta's method with small steps: the states after each period.
fn marched(load: (f64, f64), start: [f64; 2], periods: u32, steps: u32) -> Vec<[f64; 2]> {
    let mut all = vec![];
    let last = small_steps((0.1, 20.0), load, start, (periods, steps), |k, _, x| {
        if k > 0 && k.is_multiple_of(steps) {
            all.push(x);
        }
    });
    all.push(last);
    all
}

/// The attractor that has a state which is nearest to another one.
fn nearest(found: &Basins, x: [f64; 2]) -> usize {
    let far = |k: &usize| {
        let states = found.attractors[*k].at.iter();
        states.map(|s| (s[0] - x[0]).hypot(s[1] - x[1])).fold(f64::INFINITY, f64::min)
    };
    (0..found.attractors.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
}

#[test]
fn every_cell_is_that_of_a_slow_integrator() {
    let folder = TempDir::new().unwrap();
    let (found, _) = basins(&folder, &elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE), &["--size", "12"]);
    assert_eq!(found.attractors.len(), 2);
    // the one that does not touch has no force, and comes first
    assert_eq!(found.attractors[0].seen.force, 0.0);
    let at = coordinates(&found.axes, found.starts);
    for (x, fate) in at.iter().zip(&found.fates) {
        let last = *marched((0.2, 1.2), [x[0], x[1]], 200, 400).last().unwrap();
        let expected = Fate::Attractor(nearest(&found, last));
        assert_eq!(*fate, Some(expected), "{x:?}");
    }
}

/// Three ends, of one, three and nine periods, whose basins are finely mixed: an orbit that lies near a motion is not yet where it goes. A motion that long hangs on every digit: shares
/// are compared.
#[test]
fn shares_of_mixed_basins_are_those_of_a_slow_integrator() {
    let folder = TempDir::new().unwrap();
    let more = ["--omega", "4", "--plane", "q1=-6,6", "v1=-10,10", "--size", "16"];
    let (found, _) = basins(&folder, &elastic_stop((10.0, 1.2), 20.0, 1.0, WIDE), &more);
    let kinds: Vec<usize> = found.attractors.iter().map(|a| a.seen.kind.periods()).collect();
    assert_eq!(kinds, [1, 3, 9]);
    let mut counts = [0; 3];
    for x in coordinates(&found.axes, found.starts) {
        let last = *marched((10.0, 4.0), [x[0], x[1]], 250, 300).last().unwrap();
        counts[nearest(&found, last)] += 1;
    }
    for (k, count) in counts.into_iter().enumerate() {
        let share = found.share(Fate::Attractor(k));
        let expected = f64::from(count) / 256.0;
        let error = 1.5 * (expected * (1.0 - expected) / 256.0).sqrt();
        println!("period {}: {:.3}, {expected:.3} by small steps", kinds[k], share.share);
        assert!((share.share - expected).abs() < 3.0 * error, "{k}: {share:?} for {expected}");
    }
}

/// Shares of 1000 drawn states by another program: each with its standard error.
#[test]
fn shares_are_those_of_another_program() {
    // frequency, share of the attractor that touches
    for (omega, touching) in [(1.15, 0.673), (1.2, 0.589), (1.25, 0.425)] {
        let folder = TempDir::new().unwrap();
        let omega = omega.to_string();
        let more = ["--omega", &omega, "--samples", "1000"];
        let (found, said) = basins(&folder, &elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE), &more);
        let share = found.share(Fate::Attractor(1));
        let error = share.error.hypot((touching * (1.0 - touching) / 1000.0f64).sqrt());
        assert!((share.share - touching).abs() < 3.0 * error, "{omega}: {share:?}");
        let of_json = &said["attractors"][1];
        assert_eq!(of_json["share"].as_f64(), Some(share.share));
        assert!(share.interval.0 < share.share && share.share < share.interval.1);
        // some twenty periods a state, as there
        let maps = said["maps"].as_f64().unwrap() / 1000.0;
        assert!(maps < 25.0, "{maps}");
    }
}

#[test]
fn chaos_is_one_attractor_and_so_is_a_torus() {
    let folder = TempDir::new().unwrap();
    let more = ["--omega", "2.75", "--size", "6"];
    let (found, _) = basins(&folder, &elastic_stop((1.0, 1.2), 200.0, 0.0, WIDE), &more);
    let kinds = |b: &Basins| b.attractors.iter().map(|a| a.seen.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&found), [AttractorKind::Chaotic]);
    assert_eq!(found.share(Fate::Attractor(0)).share, 1.0);
    assert!(found.attractors[0].at.len() >= 1000);
    // two masses before a stop, a little above their Neimark–Sacker point
    let masses = |name: &str, a: f64, b: f64| {
        let text =
            format!("%%MatrixMarket matrix array real general\n2 2\n{a:?}\n{b:?}\n{b:?}\n{a:?}\n");
        std::fs::write(folder.path().join(name), text).unwrap();
    };
    masses("m.mtx", 1.0, 0.0);
    masses("k.mtx", 2.0, -1.0);
    let text = "[body]\nkind = \"matrices\"\nmass_matrix = \"m.mtx\"\nstiffness_matrix = \"k.mtx\"\n\
                [contact]\nmethod = \"penalty\"\ndisplacements = [0]\ngap = 0.0\nstiffness = 10.0\n[damping]\nrayleigh = [0.04, 0.0]\n\
                [[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = 1.0\nomega = 2.94\n";
    let more = ["--plane", "q1=-1,1", "v2=-1,1", "q2=0.3", "--size", "4"];
    let (found, _) = basins(&folder, text, &more);
    assert_eq!(kinds(&found), [AttractorKind::QuasiPeriodic]);
    assert_eq!(found.told(), 16);
    assert_eq!(found.axes[2].range, (0.3, 0.3));
    assert!(found.attractors[0].rotation.unwrap().0 > 0.379);
    // an independent program: the weighted mean of Birkhoff of a settled motion
    let nearer = text.replace("omega = 2.94", "omega = 2.93");
    let (found, said) = basins(&folder, &nearer, &more);
    let (rho, error) = found.attractors[0].rotation.unwrap();
    assert!((rho - 0.379_992_1).abs() < 2e-7 && error < 1e-5, "{rho} {error}");
    assert_eq!(said["attractors"][0]["rotation_number"].as_f64(), Some(rho));
}

/// Without a load rest attracts everything.
#[test]
fn rest_is_an_attractor() {
    let folder = TempDir::new().unwrap();
    let (found, _) = basins(&folder, &elastic_stop((0.0, 1.2), 20.0, 1.0, WIDE), &["--size", "4"]);
    let kinds: Vec<AttractorKind> = found.attractors.iter().map(|a| a.seen.kind).collect();
    assert_eq!(kinds, [AttractorKind::Periodic(1)]);
    assert_eq!(
        (found.share(Fate::Attractor(0)).count, found.attractors[0].seen.amplitude()),
        (16, 0.0)
    );
}

/// The problem of the oscillator with its plane, and what is asked for.
fn asked(folder: &TempDir, size: usize) -> (Problem, Plane, Basins) {
    let path = written(folder.path(), &elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE));
    let scene = Scene::read(std::path::Path::new(&path)).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    let axis = |is_velocity| StateAxis { mode: 1, is_velocity, range: (-3.0, 3.0) };
    let (around, shapes) = mode_shapes(&problem.system, &[1, 1]).unwrap();
    let asked = Basins {
        omega: 1.2,
        axes: vec![axis(false), axis(true)],
        starts: Starts::Grid(size),
        fates: vec![None; size * size],
        maps: vec![0; size * size],
        attractors: vec![],
    };
    (problem, Plane { around, axes: asked.axes.clone(), shapes }, asked)
}

#[test]
fn an_interrupted_run_goes_on_to_the_same() {
    let folder = TempDir::new().unwrap();
    let (problem, plane, asked) = asked(&folder, 9);
    let all = |mut basins: Basins, most: usize| {
        let mut told = 0;
        let mut take = |_: &Basins| {
            told += 1;
            Ok(if told < most { Go::Continue(()) } else { Go::Break(()) })
        };
        find(&problem.system, &plane, &mut basins, (&mut take, &|| false)).unwrap();
        basins
    };
    let whole = all(asked.clone(), usize::MAX);
    assert_eq!(whole.told(), 81);
    for pieces in [7, 20] {
        let mut basins = asked.clone();
        let mut runs = 0;
        while basins.told() < 81 {
            basins = all(basins, pieces);
            runs += 1;
        }
        assert!(runs > 2);
        assert_eq!(basins, whole);
    }
    // and on one thread
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| all(asked.clone(), usize::MAX)), whole);
}

#[test]
fn a_command_goes_on_with_its_own_file_alone() {
    let folder = TempDir::new().unwrap();
    let text = elastic_stop((0.2, 1.2), 20.0, 1.0, WIDE);
    let (found, _) = basins(&folder, &text, &["--size", "5"]);
    let scene = folder.path().join("scene.toml").display().to_string();
    let scene =
        if std::path::Path::new(&scene).exists() { scene } else { written(folder.path(), &text) };
    let file = folder.path().join("basins.h5").display().to_string();
    let again = json(&["basins", &scene, "-o", &file, "--size", "5", "--resume"]);
    assert_eq!(again["told"], 25);
    assert_eq!(read_basins(std::path::Path::new(&file)).unwrap().basins, found);
    refused(&["basins", &scene, "-o", &file, "--size", "6", "--resume"], "other states");
    refused(
        &["basins", &scene, "-o", &file, "--size", "5", "--omega", "1.3", "--resume"],
        "another --omega",
    );
    refused(
        &[
            "basins", &scene, "-o", &file, "--plane", "q1=-1,1", "v1=-1,1", "--size", "5",
            "--resume",
        ],
        "another --plane",
    );
    refused(&["basins", &scene, "-o", &file, "--size", "5"], "exists");
    for (axes, why) in [
        (&["q1=-1,1"][..], "give two for a plane"),
        (&["q1=-1,1", "v1=-1,1", "q1=0"], "q1 is given twice"),
        (&["q1=1,-1", "v1=-1,1"], "and its range"),
        (&["q2=-1,1", "v1=-1,1"], "does not exist"),
        (&["x=-1,1", "v1=-1,1"], "the amplitude of a mode"),
    ] {
        let words = [&["basins", &scene, "-o", "other.h5", "--plane"][..], axes].concat();
        refused(&words, why);
    }
    refused(&["basins", "scenarios/oscillator.toml", "-o", "other.h5"], "load");
    let rubs = ["basins", "scenarios/shaken-block.toml", "-o", "other.h5", "--size", "2"];
    refused(&rubs, "contact.friction");
}

/// A rigid stop: no motion begins behind it.
#[test]
fn states_inside_of_an_obstacle_are_left_out() {
    let text = "title = \"stop\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 3.0\n\
                [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"impact\"\nrestitution = 1.0\n\
                [damping]\nrayleigh = [0.1, 0.0]\n[[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.2\nomega = 1.2\n";
    let folder = TempDir::new().unwrap();
    let (found, said) = basins(&folder, text, &["--size", "6"]);
    let at = coordinates(&found.axes, found.starts);
    for (x, fate) in at.iter().zip(&found.fates) {
        assert_eq!(*fate == Some(Fate::Inside), x[0] > 1.0, "{x:?}: {fate:?}");
    }
    let shares =
        said["attractors"].as_array().unwrap().iter().map(|a| a["share"].as_f64().unwrap());
    assert!((shares.sum::<f64>() - 1.0).abs() < 1e-12, "{said}");
}

/// Two contact methods of one bar between the folds of its response: both ends are found, and each leads to itself.
#[test]
fn basins_of_a_bar() {
    let folder = TempDir::new().unwrap();
    let bar = |method: &str| {
        format!(
            "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
             [contact]\nedge = \"right\"\ngap = 1.0\nmethod = {method:?}\n[damping]\nratio = 0.01\nmode = 1\n\
             [[load]]\nkind = \"mode\"\nmode = 1\npeak = 3.0\nomega = 1.64\n"
        )
    };
    for method in ["mass-redistribution", "nbm"] {
        let (found, _) = basins(&folder, &bar(method), &["--size", "6"]);
        assert_eq!(found.told(), 36, "{method}");
        let kinds: Vec<_> = found.attractors.iter().map(|a| a.seen.kind).collect();
        assert_eq!(kinds, [AttractorKind::Periodic(1); 2], "{method}");
        // the linear response: peak is its amplitude at resonance over the gap
        assert!((found.attractors[0].seen.amplitude() - 0.745).abs() < 2e-3, "{method}");
        // a state at the middle of the plane of each attractor leads there
        for (k, a) in found.attractors.iter().enumerate() {
            let at = &a.at[0];
            let near = |x: f64| format!("{:?},{:?}", x - 1e-3, x + 1e-3);
            let (q, v) = (format!("q1={}", near(at[0])), format!("v1={}", near(at[1])));
            let (one, _) = basins(&folder, &bar(method), &["--size", "1", "--plane", &q, &v]);
            let same = (one.attractors[0].seen.amplitude() - a.seen.amplitude()).abs() < 1e-8;
            assert!(same, "{method}: {k}");
        }
    }
}
