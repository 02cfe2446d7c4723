//! Tests of phase resonance: against a slow integrator, the closed form of the free motion, and the numbers of an independent program.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde_json::Value;
use tempfile::TempDir;

use signorini::records::{PhaseResonance, ResonanceRow};
use signorini::store::read_resonance;

use crate::common::{elastic_stop, json, refused, small_steps, with_unit_matrix as written};

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
