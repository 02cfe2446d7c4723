//! Tests of phase resonance: against a slow integrator, the closed form of the free motion, and the numbers of an independent program.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde_json::Value;
use tempfile::TempDir;

use signorini::records::{PhaseResonance, Resonance, ResonanceRow};
use signorini::store::read_resonance;

use crate::common::{
    elastic_stop, hdf5_files, json, refused, small_steps, with_unit_matrix as written,
};

/// Stiffness of the stop; its gap is 1.
const STOP: f64 = 20.0;

/// The test of a mass before an elastic stop, of some damping, over its load; with what was said of it.
fn tested(
    folder: &TempDir,
    (damping, loads): (f64, &str),
    more: &[&str],
) -> (PhaseResonance, Value) {
    let text = elastic_stop((0.2, 1.3), STOP, 1.0, [0.8, 1.6]);
    let damped = text.replace("[0.1, 0.0]", &format!("[{damping:?}, 0.0]"));
    assert!(damping == 0.1 || damped != text);
    let scene = written(folder.path(), &damped);
    let file = folder.path().join("test.h5");
    let over = format!("load[0].amplitude={loads}");
    let own = ["phase-resonance", &scene, "--over", &over, "-o", file.to_str().unwrap(), "--force"];
    let said = json(&[&own, more].concat());
    (read_resonance(&file).unwrap().found, said)
}

/// By Runge–Kutta's method with small steps, from `q = 0` with a velocity: first harmonic `û/F` of the displacement in the last of so many periods, and its largest magnitude.
fn marched(
    damping: f64,
    (load, omega): (f64, f64),
    velocity: f64,
    periods: u32,
) -> ([f64; 2], f64) {
    let steps = 4000;
    let (mut first, mut most) = ([0.0; 2], 0.0f64);
    let of_last = (periods - 1) * steps;
    small_steps(
        (damping, STOP),
        (load, omega),
        [0.0, velocity],
        (periods, steps),
        |k, t, [q, _]| {
            if k >= of_last {
                let (sin, cos) = (omega * t).sin_cos();
                first = [first[0] + q * cos, first[1] - q * sin];
                most = most.max(q.abs());
            }
        },
    );
    (first.map(|f| 2.0 * f / f64::from(steps) / load), most)
}

#[test]
fn loops_come_to_rest_where_an_independent_program_does() {
    let folder = TempDir::new().unwrap();
    let more = ["--steps", "2", "--omega", "1.0", "--tolerance", "1e-10"];
    let (found, said) = tested(&folder, (0.1, "0.1,0.3"), &more);
    let [linear, touches, _] = &found.rows[..] else { panic!("{} rows", found.rows.len()) };
    // F = 0.1 grazes at ω = 1, where q = sin t: W = π α ω A²
    assert!((linear.omega.mean - 1.0).abs() < 1e-8 && (linear.amplitude.mean - 1.0).abs() < 1e-8);
    assert!((linear.work.mean - PI * 0.1).abs() < 1e-8 && (linear.damping() - 0.05).abs() < 1e-8);
    // dynamics of a prototype in Python: where F = 0.2 locks
    assert!((touches.omega.mean - 1.272_600_325_6).abs() < 3e-9, "{}", touches.omega.mean);
    assert!((touches.lag.mean - FRAC_PI_2).abs() < 1e-9 && touches.is_locked);
    assert_eq!(said["omega"][1].as_f64(), Some(touches.omega.mean));
    assert_eq!(said["locked"], serde_json::json!([true, true, true]));
}

/// Lag, amplitude and work of the motion at the frequency that the loop found, from small steps; there is one beside that does not touch, which begins at rest.
#[test]
fn the_lag_is_a_quarter_turn_by_a_slow_integrator() {
    let folder = TempDir::new().unwrap();
    let (found, _) = tested(&folder, (0.3, "0.5,1.5"), &["--steps", "2"]);
    for row in &found.rows {
        let omega = row.omega.mean;
        // a quarter of a period behind F cos ωt: about A sin ωt
        let velocity = omega * row.amplitude.mean;
        let ([re, im], amplitude) = marched(0.3, (row.value, omega), velocity, 80);
        assert!(re.abs() < 2e-6 * im.abs(), "{} at {omega}: {re} + {im}i", row.value);
        assert!((row.amplitude.mean / amplitude - 1.0).abs() < 1e-6, "{}", row.amplitude.mean);
        // W = −π Im(f̂ û), û = F (re + i im)
        let work = -PI * row.value * row.value * im;
        assert!((row.work.mean / work - 1.0).abs() < 1e-6, "{} {work}", row.work.mean);
    }
}

/// The free motion without damping that has an amplitude away from the stop: its frequency.
fn frequency(amplitude: f64) -> f64 {
    // the first touch with the velocity √(A² − g²); in the stop a half turn of frequency w about k/(1 + k) g
    let (w, g) = ((1.0 + STOP).sqrt(), 1.0);
    let speed = (amplitude * amplitude - g * g).sqrt();
    let free = 2.0 * (PI - (g / amplitude).acos());
    TAU / (free + 2.0 / w * (speed / w).atan2(g / (1.0 + STOP)))
}

/// The distance of phase resonance from the free motion is of the second order in the damping.
#[test]
fn lightly_damped_bodies_move_as_if_free() {
    let folder = TempDir::new().unwrap();
    let off = |damping: f64| -> Vec<f64> {
        let loads = format!("{},{}", 1.2 * damping, 3.0 * damping);
        let more = ["--steps", "3", "--tolerance", "1e-9"];
        let (found, _) = tested(&folder, (damping, &loads), &more);
        let of = |row: &ResonanceRow| row.omega.mean / frequency(row.amplitude.mean) - 1.0;
        found.rows.iter().map(of).collect()
    };
    let (coarse, fine) = (off(0.1), off(0.05));
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert!(coarse.abs() < 1e-3 && fine.abs() < 3e-4, "{coarse} {fine}");
        assert!((coarse / fine - 4.0).abs() < 0.2, "{coarse} {fine}");
    }
}

/// A bar of ten elements under a load of the shape of its first mode, beside its viscous mode at the same frequency: −0.2 to +0.8 % in the amplitude by an independent program.
#[test]
fn a_bar_at_phase_resonance_is_near_its_viscous_mode() {
    let folder = TempDir::new().unwrap();
    let body = "title = \"bar\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n\
                [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"mass-redistribution\"\n";
    let loaded = "[damping]\nrayleigh = [0.0, 0.01]\n[[load]]\nkind = \"mode\"\nmode = 1\npeak = 3.0\nomega = 1.6\n";
    let free = "[orbit]\nomega = 1.7\nbeta = 0.01\n";
    let write = |name: &str, more: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("{body}{more}")).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let (loaded, free) = (write("loaded.toml", loaded), write("free.toml", free));
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let test = at("test.h5");
    let over = "load[0].peak=1.5,4.5";
    json(&["phase-resonance", &loaded, "--over", over, "--steps", "2", "-o", &test]);
    let mut off = vec![];
    for (k, row) in
        read_resonance(std::path::Path::new(&test)).unwrap().found.rows.iter().enumerate()
    {
        let (omega, file) = (row.omega.mean.to_string(), at(&format!("{k}.h5")));
        let said = json(&["orbit", &free, "--viscous", "--omega", &omega, "-o", &file]);
        off.push(100.0 * (row.amplitude.mean / said["amplitude"].as_f64().unwrap() - 1.0));
    }
    assert!(off.iter().all(|x| (-0.4..0.9).contains(x)), "{off:?}");
    assert!(off[0] < 0.0 && off[2] > 0.5, "{off:?}");
}

#[test]
fn readings_are_off_by_what_they_say() {
    let folder = TempDir::new().unwrap();
    let exact = tested(&folder, (0.1, "0.12,0.3"), &["--steps", "9"]).0;
    let off = ["--steps", "9", "--noise", "0.02", "--average", "400"];
    let (first, _) = tested(&folder, (0.1, "0.12,0.3"), &off);
    assert_eq!(tested(&folder, (0.1, "0.12,0.3"), &off).0, first);
    let other = tested(&folder, (0.1, "0.12,0.3"), &[&off[..], &["--seed", "2"]].concat()).0;
    let mut squares = vec![];
    for (exact, row) in exact.rows.iter().zip(&first.rows).chain(exact.rows.iter().zip(&other.rows))
    {
        assert!(row.is_locked);
        for (is, should) in [(row.omega, exact.omega), (row.work, exact.work)] {
            assert!(is.error > 0.0 && is.error < 0.01 * is.mean);
            squares.push(((is.mean - should.mean) / is.error).powi(2));
        }
        // 0.02/√400
        let expected = 0.001 * row.amplitude.mean;
        assert!((0.3..3.0).contains(&(row.amplitude.error / expected)));
    }
    assert_ne!(first.rows[0].omega, other.rows[0].omega);
    // forty deviates of ten blocks: their mean square is 1.3 ± 0.4
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.4..2.6).contains(&mean), "{mean}");
}

/// At the frequency of its mode the lag is right from the first period on, and the amplitude grows for hundreds: in closed form F/αω in the end.
#[test]
fn light_damping_is_waited_for() {
    let folder = TempDir::new().unwrap();
    for damping in [0.01, 0.003] {
        let loads = format!("{},{}", 0.8 * damping, 0.9 * damping);
        let (found, _) = tested(&folder, (damping, &loads), &["--steps", "1"]);
        let (row, ratio) = (&found.rows[0], 0.5 * damping);
        assert!((row.amplitude.mean / 0.8 - 1.0).abs() < 1e-4, "{}", row.amplitude.mean);
        assert!((row.damping() / ratio - 1.0).abs() < 1e-4, "{}", row.damping());
    }
    let more = ["--steps", "1", "--noise", "0.01"];
    let (found, _) = tested(&folder, (0.01, "0.008,0.009"), &more);
    let amplitude = found.rows[0].amplitude;
    assert!((amplitude.mean - 0.8).abs() < 5.0 * amplitude.error, "{amplitude:?}");
    assert!(amplitude.error < 0.002, "{amplitude:?}");
}

#[test]
fn values_that_do_not_lock_are_told() {
    let folder = TempDir::new().unwrap();
    // without a load there is no lag
    let (found, said) = tested(&folder, (0.1, "0,0.1"), &["--steps", "1"]);
    assert!(!found.rows[0].is_locked && found.rows[1].is_locked);
    assert!(said["note"][0].as_str().unwrap().contains("do not move"));
    // gains beyond what the body follows
    let (found, _) = tested(&folder, (0.1, "0.2,0.3"), &["--steps", "1", "--gains", "1.5,1.0"]);
    assert!(found.rows.iter().all(|row| !row.is_locked && !row.note.is_empty()));
}

#[test]
fn files_are_shown_and_what_makes_no_sense_is_refused() {
    let folder = TempDir::new().unwrap();
    let (found, _) = tested(&folder, (0.1, "0.1,0.3"), &["--steps", "4", "--noise", "0.01"]);
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (file, scene) = (at("test.h5"), at("scene.toml"));
    assert_eq!(json(&["inspect", &file])["value"].as_array().unwrap().len(), 5);
    json(&["plot", &file, "-o", &at("picture.png")]);
    assert!(
        folder.path().join("picture.svg").exists() && folder.path().join("picture.png").exists()
    );
    json(&["export", &file]);
    let table = std::fs::read_to_string(folder.path().join("test.csv")).unwrap();
    let omega: f64 = table.lines().nth(2).unwrap().split(',').nth(3).unwrap().parse().unwrap();
    assert_eq!(omega, found.rows[1].omega.mean);
    let over = "load[0].amplitude=0.1,0.3";
    for (more, why) in [
        (&["--over", "load[0].amplitude=0.3,0.1"][..], "--over"),
        (&["--over", over, "--gains", "0.1"], "two positive numbers"),
        (&["--over", over, "--tolerance", "0"], "--tolerance"),
        (&["--over", over, "--noise", "2"], "--noise"),
        (&["--over", over, "--omega", "-1"], "--omega"),
        (&["--over", "damping.rayleigh[0]=0,0.1"], "damping"),
        (&["--over", over], "exists"),
    ] {
        let other = if why == "exists" { file.clone() } else { at("other.h5") };
        refused(&[&["phase-resonance", &scene, "-o", &other][..], more].concat(), why);
    }
    let other =
        ["phase-resonance", &scene, "--over", over, "-o", &file, "--steps", "4", "--resume"];
    refused(&other, "another");
}

/// A blow on a stiff stop lasts a five-hundredth of the period: its largest force, by small steps.
#[test]
fn the_force_of_a_stiff_stop_is_seen() {
    let folder = TempDir::new().unwrap();
    let stop = 6e4;
    let scene = written(folder.path(), &elastic_stop((0.2, 1.3), stop, 1.0, [0.8, 1.6]));
    let file = folder.path().join("test.h5");
    let over = ["--over", "load[0].amplitude=0.2,0.3", "--steps", "1", "--tolerance", "1e-9"];
    json(&[&["phase-resonance", &scene, "-o", file.to_str().unwrap()][..], &over].concat());
    for row in read_resonance(&file).unwrap().found.rows {
        let omega = row.omega.mean;
        let (steps, periods) = (60_000, 80);
        let (mut most, mut reached) = (0.0f64, 0.0f64);
        // from the state of the loop: there is a motion beside that does not touch
        let start = [row.x[0], row.x[1]];
        small_steps((0.1, stop), (row.value, omega), start, (periods, steps), |k, _, [q, v]| {
            if k >= (periods - 1) * steps {
                most = most.max(stop * (q - 1.0));
                reached = reached.max(0.5 * v * v);
            }
        });
        assert!((row.force.mean / most - 1.0).abs() < 1e-4, "{} {most}", row.force.mean);
        assert!((row.kinetic / reached - 1.0).abs() < 1e-4, "{} {reached}", row.kinetic);
    }
}

/// A preload holds energy that no vibration has: of a mass that a spring presses against its stop's other side only the motion counts in the damping ratio.
#[test]
fn a_preload_is_no_energy_of_the_vibration() {
    let folder = TempDir::new().unwrap();
    let text = elastic_stop((0.05, 1.0), STOP, 1.0, [0.8, 1.6]);
    let pushed = format!("{text}[[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = -3.0\n");
    let scene = written(folder.path(), &pushed);
    let file = folder.path().join("test.h5");
    let over = ["--over", "load[0].amplitude=0.05,0.1", "--steps", "1"];
    json(&[&["phase-resonance", &scene, "-o", file.to_str().unwrap()][..], &over].concat());
    for row in read_resonance(&file).unwrap().found.rows {
        assert!((row.damping() / 0.05 - 1.0).abs() < 1e-4, "{}", row.damping());
        assert!(row.energy > 4.0 && (row.omega.mean - 1.0).abs() < 1e-6, "{row:?}");
    }
}

/// How frequency, amplitude and work change: by small steps at phase resonance, found by bisection; and by Euler's theorem, since with gap and load all lengths grow.
#[test]
fn derivatives_at_phase_resonance() {
    let folder = TempDir::new().unwrap();
    let keys = "contact.gap,contact.stiffness,damping.rayleigh[0],load[0].amplitude";
    let more = ["--steps", "1", "--omega", "1.0", "--sensitivity", keys];
    let (found, said) = tested(&folder, (0.1, "0.1,0.2"), &more);
    let [grazes, row] = &found.rows[..] else { panic!("{} rows", found.rows.len()) };
    // F = 0.1 grazes
    assert!(grazes.is_locked && grazes.by[0].omega.is_nan() && !grazes.note.is_empty());
    assert_eq!(said["sensitivity"]["contact.gap"]["omega"][0], Value::Null);
    let [gap, stop, damping, load] = &row.by[..] else { panic!("{:?}", row.by) };
    let sums = |of: fn(&Resonance) -> f64| 1.0 * of(gap) + row.value * of(load);
    assert!(sums(|by| by.omega).abs() < 1e-9, "{row:?}");
    assert!((sums(|by| by.amplitude) / row.amplitude.mean - 1.0).abs() < 1e-9, "{row:?}");
    assert!((sums(|by| by.work) / row.work.mean - 2.0).abs() < 1e-9, "{row:?}");
    let point = |damping: f64, stop: f64, load: f64| -> [f64; 3] {
        let at = |omega: f64| -> (f64, f64, f64) {
            let (steps, periods) = (4000, 200);
            let (mut re, mut im, mut most) = (0.0, 0.0, 0.0f64);
            let start = [0.0, 1.3 * omega];
            small_steps((damping, stop), (load, omega), start, (periods, steps), |k, t, [q, _]| {
                if k >= (periods - 1) * steps {
                    re += q * (omega * t).cos();
                    im -= q * (omega * t).sin();
                    most = most.max(-q);
                }
            });
            (re, -PI * load * 2.0 * im / f64::from(steps), most)
        };
        let (mut low, mut high) = (row.omega.mean - 0.02, row.omega.mean + 0.02);
        for _ in 0..22 {
            let middle = 0.5 * (low + high);
            // ahead of resonance the displacement follows the load
            if at(middle).0 > 0.0 { low = middle } else { high = middle }
        }
        let omega = 0.5 * (low + high);
        let (_, work, most) = at(omega);
        [omega, most, work]
    };
    let slope = |up: [f64; 3], down: [f64; 3], width: f64| -> [f64; 3] {
        std::array::from_fn(|k| (up[k] - down[k]) / width)
    };
    let h = 0.02;
    for (by, differences) in [
        (damping, slope(point(0.1 + 0.1 * h, STOP, 0.2), point(0.1 - 0.1 * h, STOP, 0.2), 0.2 * h)),
        (stop, slope(point(0.1, STOP + 20.0 * h, 0.2), point(0.1, STOP - 20.0 * h, 0.2), 40.0 * h)),
        (load, slope(point(0.1, STOP, 0.2 + 0.2 * h), point(0.1, STOP, 0.2 - 0.2 * h), 0.4 * h)),
    ] {
        for (exact, difference) in by.numbers().into_iter().zip(differences) {
            // what is left out of differences is their square
            assert!((exact / difference - 1.0).abs() < 4e-3, "{by:?} {differences:?}");
        }
    }
}

/// The same of a bar that touches with the nodal boundary method, under a load in units of its gap: all lengths grow with that alone; and by differences of loops.
#[test]
fn derivatives_of_a_bar_at_phase_resonance() {
    let folder = TempDir::new().unwrap();
    let tested = |damping: f64, more: &[&str]| -> Vec<ResonanceRow> {
        let body = "title = \"bar\"\n[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n\
                    [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"mass-redistribution\"\n";
        let loaded = format!(
            "[damping]\nrayleigh = [0.0, {damping:?}]\n[[load]]\nkind = \"mode\"\nmode = 1\npeak = 3.0\nomega = 1.6\n"
        );
        let path = folder.path().join("bar.toml");
        std::fs::write(&path, format!("{body}{loaded}")).unwrap();
        let file = folder.path().join("test.h5");
        let own =
            ["phase-resonance", path.to_str().unwrap(), "-o", file.to_str().unwrap(), "--force"];
        let over = ["--over", "load[0].peak=2.5,3.5", "--steps", "1"];
        json(&[&own[..], &over, more].concat());
        read_resonance(&file).unwrap().found.rows
    };
    let keys = ["--sensitivity", "damping.rayleigh[1],contact.gap,load[0].peak"];
    let rows = tested(0.01, &keys);
    let h = 1e-4;
    let beside = |s: f64| tested(0.01 * (1.0 + s * h), &["--tolerance", "1e-11"]);
    let (up, down) = (beside(1.0), beside(-1.0));
    for (k, row) in rows.iter().enumerate() {
        let [gap, damping, load] = &row.by[..] else { panic!("{row:?}") };
        assert!(gap.omega.abs() < 1e-9 * row.omega.mean && load.omega > 0.0, "{row:?}");
        assert!((gap.amplitude / row.amplitude.mean - 1.0).abs() < 1e-9, "{row:?}");
        assert!((gap.work / row.work.mean - 2.0).abs() < 1e-9, "{row:?}");
        let difference = |of: fn(&ResonanceRow) -> f64| (of(&up[k]) - of(&down[k])) / (0.02 * h);
        for (exact, difference) in [
            (damping.omega, difference(|row| row.omega.mean)),
            (damping.work, difference(|row| row.work.mean)),
        ] {
            assert!((exact / difference - 1.0).abs() < 1e-3, "{exact} {difference}");
        }
    }
}

#[test]
fn a_damaged_file_is_not_gone_on_with() {
    let folder = TempDir::new().unwrap();
    for (name, value) in [("locked", 7.0), ("omega", -1e300), ("x", f64::NAN)] {
        tested(&folder, (0.1, "0.1,0.3"), &["--steps", "2"]);
        let path = folder.path().join("test.h5");
        {
            let file = hdf5_files().open_as(&path, hdf5::OpenMode::ReadWrite).unwrap();
            let data = file.dataset(&format!("phase_resonance/{name}")).unwrap();
            let mut all = data.read_raw::<f64>().unwrap();
            all[0] = value;
            data.write_raw(&all).unwrap();
        }
        refused(&["inspect", path.to_str().unwrap()], "damaged");
    }
}

/// Largest forces are those of the motion, wherever its period begins: a phase of the loads changes nothing, and neither does reading an exact orbit in place of the last period.
#[test]
fn largest_forces_do_not_know_the_phase_of_the_loads() {
    let folder = TempDir::new().unwrap();
    let [a, b, c] = [2.125_756_169_247_044, 2.417_389_227_821_019, 2.651_626_056_267_251_6];
    let [ab, bc] = [-1.243_152_630_637_911_5, -1.174_236_597_183_107_2];
    let mass = [0.701_546_366_168_601_9, 1.771_150_605_405_849, 1.645_661_928_464_921];
    let diagonal = [mass[0], 0.0, 0.0, 0.0, mass[1], 0.0, 0.0, 0.0, mass[2]];
    for (name, entries) in [("M", diagonal), ("K", [a, ab, 0.0, ab, b, bc, 0.0, bc, c])] {
        let lines = entries.map(|x: f64| format!("{x:?}\n")).concat();
        let text = format!("%%MatrixMarket matrix array real general\n3 3\n{lines}");
        std::fs::write(folder.path().join(format!("{name}.mtx")), text).unwrap();
    }
    let read = |phase: f64, more: &[&str]| -> ResonanceRow {
        let scene = folder.path().join("a.toml");
        let text = format!(
            "[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n[contact]\ndisplacements = [0]\ngap = 0.2\nmethod = 'penalty'\nstiffness = 10.0\n\
             [damping]\nrayleigh = [0.04, 0.02]\n[[load]]\nkind = 'force'\ndisplacement = 2\namplitude = 0.5\nomega = 0.8\nphase = {phase:?}\n"
        );
        std::fs::write(&scene, text).unwrap();
        let out = folder.path().join("a.h5");
        let own = [
            "phase-resonance",
            scene.to_str().unwrap(),
            "--over",
            "load[0].amplitude=0.3,0.31",
            "--steps",
            "1",
        ];
        let rest = ["--tolerance", "1e-10", "--force", "-o", out.to_str().unwrap()];
        json(&[&own[..], &rest, more].concat());
        read_resonance(&out).unwrap().found.rows[0].clone()
    };
    let first = read(0.0, &[]);
    assert!(first.is_locked && first.force.mean > 0.1, "{first:?}");
    let rows = [read(0.7, &[]), read(2.1, &[]), read(0.0, &["--sensitivity", "contact.gap"])];
    for row in rows {
        for (own, other) in [(row.force.mean, first.force.mean), (row.kinetic, first.kinetic)] {
            assert!((own / other - 1.0).abs() < 1e-4, "{own} {other}");
        }
    }
}
