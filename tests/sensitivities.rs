//! Derivatives of orbits by numbers of their scenes: against scaling laws, closed forms, an independent program's numbers, and differences of orbits.

use serde_json::Value;
use tempfile::TempDir;

use crate::common::{json, program, with_unit_matrix as written};

/// One displacement: M = K = B = 1, an elastic stop, a load.
fn oscillator(gap: f64, stiffness: f64, damping: [f64; 2], load: Option<f64>) -> String {
    let load = load.map_or(String::new(), |a| {
        format!("[[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = {a:?}\nomega = 1.3\n")
    });
    let damping = match damping {
        [0.0, 0.0] => String::new(),
        _ => format!("[damping]\nrayleigh = {damping:?}\n"),
    };
    format!(
        "[body]\nkind = \"matrices\"\nmass_matrix = \"one.mtx\"\nstiffness_matrix = \"one.mtx\"\n\
         [contact]\ndisplacements = [0]\ngap = {gap:?}\nmethod = \"penalty\"\nstiffness = {stiffness:?}\n{damping}{load}"
    )
}

/// Ten elements before an obstacle, contact nodes without mass.
fn bar(more: &str) -> String {
    format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"mass-redistribution\"\nmass = \"condensed\"\n{more}"
    )
}

/// The orbit of a scene with its derivatives.
fn orbit(text: &str, keys: &str, more: &[&str]) -> Value {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), text);
    let file = folder.path().join("orbit.h5").display().to_string();
    let own = ["orbit", &scene, "-o", &file, "--sensitivity", keys];
    json(&[&own, more].concat())
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("{v} is no number"))
}

/// `∂/∂p` of a largest value.
fn by(orbit: &Value, key: &str, of: &str) -> f64 {
    number(&orbit["sensitivity"][key][of])
}

/// `p ∂/∂p` of a largest value over it.
fn share(orbit: &Value, key: &str, of: &str) -> f64 {
    by(orbit, key, of) * number(&orbit["sensitivity"][key]["value"]) / peak(orbit, of)
}

fn peak(orbit: &Value, of: &str) -> f64 {
    number(&orbit["peaks"][of]["value"])
}

fn near(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within * b.abs().max(1.0), "{a} for {b}");
}

const RATES: &str =
    "contact.gap,load[0].amplitude,contact.stiffness,damping.rayleigh[0],damping.rayleigh[1],omega";

/// Gap and load together scale every length; a scaling of time and forces that leaves the equations what they are.
#[test]
fn scaling_laws_hold_to_rounding() {
    let of_oscillator =
        orbit(&oscillator(1.0, 20.0, [0.1, 0.01], Some(1.5)), RATES, &["--omega", "1.3"]);
    for (of, degree) in [("amplitude", 1.0), ("pressure", 1.0), ("energy", 2.0)] {
        let sum = share(&of_oscillator, "contact.gap", of)
            + share(&of_oscillator, "load[0].amplitude", of);
        near(sum, degree, 1e-11);
    }
    let text = bar(
        "[damping]\nrayleigh = [0.0, 0.0127]\n[[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.04\nomega = 1.58\n",
    );
    let keys = "contact.gap,load[0].amplitude,body.young,body.density,damping.rayleigh[1],omega";
    let o = orbit(&text, keys, &["--omega", "1.58"]);
    assert!(peak(&o, "pressure") > 0.1);
    for (of, length, force) in
        [("amplitude", 1.0, 0.0), ("pressure", 1.0, 1.0), ("energy", 2.0, 1.0)]
    {
        let at = |key: &str| share(&o, key, of);
        near(at("contact.gap") + at("load[0].amplitude"), length, 1e-11);
        // of the size of the terms, which cancel
        let scale = at("body.young").abs().max(1.0);
        let close = |sum: f64, wanted: f64| near(sum / scale, wanted / scale, 1e-11);
        // all stiffness, mass and load
        close(at("body.young") + at("body.density") + at("load[0].amplitude"), force);
        // faster by the root of the stiffness
        let by_time = at("omega") + 2.0 * at("body.young") + 2.0 * at("load[0].amplitude")
            - at("damping.rayleigh[1]");
        close(by_time, 2.0 * force);
    }
}

/// Numbers of an independent program in Python (augmented exponentials and shooting of its own).
#[test]
fn a_bar_has_the_derivatives_of_another_program() {
    // what the load of 1.6 times grazing at resonance is: 2 ξ ω₁² g/φ₁, with the first mode of ten elements whose last node has no mass
    let (w, phi) = (1.573_373_595_909_213_4, 1.401_143_989_460_057_5);
    let (beta, load) = (0.02 / w, 1.6 * 0.02 * w * w / phi);
    let text = bar(&format!(
        "[damping]\nrayleigh = [0.0, {beta:?}]\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = {load:?}\nomega = 1.58\n"
    ));
    let keys = "contact.gap,load[0].amplitude,body.young,body.density,damping.rayleigh[1],omega";
    let o = orbit(&text, keys, &["--omega", "1.58"]);
    near(peak(&o, "amplitude"), 1.047_970_285_35, 1e-10);
    near(peak(&o, "pressure"), 0.356_046_713_76, 1e-10);
    let known = [
        (
            "amplitude",
            [0.992_020_26, 0.055_950_02, -1.194_127_06, 1.138_177_04, -0.023_458_84, 1.425_883_06],
        ),
        (
            "pressure",
            [0.015_293_48, 0.340_753_24, -6.789_060_01, 6.804_353_49, -0.150_770_40, 8.517_681_38],
        ),
    ];
    for (of, numbers) in known {
        let at = |key: &str| by(&o, key, of) * number(&o["sensitivity"][key]["value"]);
        near(at("contact.gap"), numbers[0], 1e-7);
        near(at("load[0].amplitude"), numbers[1], 1e-7);
        near(at("body.young"), numbers[2], 1e-7);
        // the load M φ₁ of the scene has the root of the density in it
        near(at("body.density") - 0.5 * at("load[0].amplitude"), numbers[3], 1e-7);
        near(at("damping.rayleigh[1]"), numbers[4], 1e-7);
        near(by(&o, "omega", of), numbers[5], 1e-7);
    }
}

/// `T = 2(π − acos(g/A)) + (2/w) atan2(√(A² − g²)/w, g/(1 + k))`, `w² = 1 + k`: the amplitude by its implicit derivative.
#[test]
fn the_free_oscillator_is_its_closed_form() {
    let (g, k) = (1.0f64, 20.0f64);
    let period = |a: f64, k: f64| {
        let w = (1.0 + k).sqrt();
        2.0 * (std::f64::consts::PI - (g / a).acos())
            + 2.0 / w * (((a * a - g * g).sqrt() / w).atan2(g / (1.0 + k)))
    };
    let o = orbit(
        &oscillator(g, k, [0.0; 2], None),
        "omega,contact.stiffness",
        &["--omega", "1.3", "--amplitude", "-2"],
    );
    let a = peak(&o, "amplitude");
    near(a, 1.975_275_274_110, 1e-10);
    let wanted = std::f64::consts::TAU / 1.3;
    near(period(a, k), wanted, 1e-11);
    let d = |f: &dyn Fn(f64) -> f64, h: f64| {
        (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
    };
    let by_a = d(&|h| period(a + h, k), 1e-3);
    near(by(&o, "omega", "amplitude"), -wanted / 1.3 / by_a, 1e-9);
    near(by(&o, "contact.stiffness", "amplitude"), -d(&|h| period(a, k + h), 1e-2) / by_a, 1e-9);
    near(by(&o, "omega", "amplitude"), 6.675_387_70, 1e-8);
    near(by(&o, "contact.stiffness", "amplitude") * k, -0.491_570_33, 1e-8);
}

/// A viscous mode: its feedback is found with it.
#[test]
fn a_viscous_mode_has_the_derivatives_of_another_program() {
    let o = orbit(
        &bar(""),
        "omega,beta,body.young,body.density,contact.gap",
        &["--omega", "1.8", "--viscous", "--beta", "0.01"],
    );
    near(number(&o["alpha"]), 0.092_210_679_4, 1e-9);
    near(by(&o, "omega", "alpha"), -0.042_956_948_9, 1e-8);
    near(by(&o, "omega", "energy"), 15.312_661_25, 1e-8);
    near(by(&o, "body.young", "alpha"), 0.123_197_9, 1e-6);
    near(by(&o, "beta", "alpha") * 0.01, 0.076_862_7, 1e-6);
    // a rate: faster by the root of the stiffness; no length is in it
    let alpha = |key: &str| by(&o, key, "alpha") * number(&o["sensitivity"][key]["value"]);
    let sum = alpha("omega") + 2.0 * alpha("body.young") - alpha("beta");
    near(sum, number(&o["alpha"]), 1e-11);
    near(alpha("contact.gap"), 0.0, 1e-11);
    near(share(&o, "contact.gap", "energy"), 2.0, 1e-11);
    // multipliers are numbers
    let of = |key: &str, k: usize| {
        let p = &o["sensitivity"][key];
        number(&p["multipliers"][k][0]) * number(&p["value"])
    };
    for k in 0..4 {
        let sum = of("omega", k) + 2.0 * of("body.young", k) - of("beta", k);
        near(sum, 0.0, 1e-7 * of("omega", k).abs().max(1.0));
        near(of("contact.gap", k), 0.0, 1e-7);
    }
}

/// What one number more or less of a scene changes of the orbit that is found there, with what is left of the fourth order taken out.
fn differences(
    text: &str,
    line: &str,
    value: f64,
    step: f64,
    keys: &str,
    more: &[&str],
    of: &[&str],
) -> Vec<f64> {
    let start = format!("{line}{value:?}");
    assert!(text.contains(&start), "{start}");
    let at = |x: f64| -> Vec<f64> {
        let o = orbit(&text.replacen(&start, &format!("{line}{x:?}"), 1), keys, more);
        of.iter()
            .map(|name| if *name == "period" { number(&o["period"]) } else { peak(&o, name) })
            .collect()
    };
    let central = |h: f64| -> Vec<f64> {
        at(value + h).iter().zip(at(value - h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
    };
    central(2.0 * step)
        .iter()
        .zip(central(step))
        .map(|(wide, narrow)| (4.0 * narrow - wide) / 3.0)
        .collect()
}

fn scene(name: &str) -> String {
    let folder = crate::common::root().join("scenarios");
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let matrices = format!("\"{}/squeal", folder.display());
    text.replace("\"squeal", &matrices)
}

/// The nodal boundary method, whose mass changes with the phase and whose energy jumps; near a fold, where derivatives are large.
#[test]
fn half_a_plate_changes_as_its_differences() {
    let text = scene("half-plate-orbit.toml");
    let o = orbit(&text, "body.young,contact.gap", &[]);
    let of = ["amplitude", "pressure", "energy"];
    let d = differences(&text, "young = ", 1.0, 1e-6, "contact.gap", &[], &of);
    for (name, d) in of.iter().zip(d) {
        near(by(&o, "body.young", name), d, 1e-7);
    }
    for (name, degree) in of.iter().zip([1.0, 1.0, 2.0]) {
        near(share(&o, "contact.gap", name), degree, 1e-10);
    }
}

/// Switches between sticking and slipping, and a period that is found with the orbit.
#[test]
fn a_limit_cycle_of_friction_changes_as_its_differences() {
    let text = scene("squeal-belt.toml");
    let o = orbit(&text, "contact.friction", &[]);
    let of = ["amplitude", "pressure", "energy", "period"];
    let d = differences(&text, "friction = ", 0.6, 1e-4, "contact.friction", &[], &of);
    for (name, d) in of.iter().zip(d) {
        near(by(&o, "contact.friction", name), d, 1e-8);
    }
}

/// Velocities that jump: a blow, rest on the obstacle across the instant at which the period begins, release.
#[test]
fn an_orbit_with_impacts_changes_as_its_differences() {
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [3]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
        [contact]\nedge = \"right\"\ngap = 0.5\nmethod = \"impact\"\nrestitution = 0.0\n[damping]\nrayleigh = [0.1, 0.0]\n\
        [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.4\nomega = 1.4\n";
    let o = orbit(
        text,
        "contact.gap,body.young,body.density,load[0].amplitude,contact.restitution",
        &[],
    );
    let kinds: Vec<&str> =
        o["switches"].as_array().unwrap().iter().filter_map(|s| s["kind"].as_str()).collect();
    assert!(kinds.contains(&"impact") && kinds.contains(&"open"), "{kinds:?}");
    let of = ["amplitude", "pressure", "energy"];
    for (key, line, value) in
        [("body.young", "young = ", 1.0), ("load[0].amplitude", "amplitude = ", 0.4)]
    {
        let d = differences(text, line, value, 1e-5, "omega", &[], &of);
        for (name, d) in of.iter().zip(d) {
            near(by(&o, key, name), d, 1e-6);
        }
    }
    for (name, degree) in of.iter().zip([1.0, 1.0, 2.0]) {
        near(share(&o, "contact.gap", name) + share(&o, "load[0].amplitude", name), degree, 1e-10);
    }
    // multipliers too: no length is in them
    let of = |key: &str| {
        number(&o["sensitivity"][key]["multipliers"][0][0])
            * number(&o["sensitivity"][key]["value"])
    };
    near(of("contact.gap") + of("load[0].amplitude"), 0.0, 1e-8);
    assert!(of("contact.gap").abs() > 1e-3);
}

/// Multipliers against those of the orbits beside.
#[test]
fn multipliers_change_as_their_differences() {
    let text = oscillator(1.0, 20.0, [0.1, 0.01], Some(1.5));
    let o = orbit(&text, "contact.stiffness", &["--omega", "1.3"]);
    let at = |k: f64| {
        let o = orbit(&oscillator(1.0, k, [0.1, 0.01], Some(1.5)), "omega", &["--omega", "1.3"]);
        number(&o["multipliers"][0][0])
    };
    let central = |h: f64| (at(20.0 + h) - at(20.0 - h)) / (2.0 * h);
    let d = (4.0 * central(0.01) - central(0.02)) / 3.0;
    near(
        number(&o["sensitivity"]["contact.stiffness"]["multipliers"][0][0]) * 20.0,
        20.0 * d,
        1e-8,
    );
}

/// The file beside the answer; what is no parameter is said, with its place.
#[test]
fn derivatives_are_stored_and_what_has_none_is_refused() {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), &oscillator(1.0, 20.0, [0.1, 0.01], Some(1.5)));
    let file = folder.path().join("o.h5");
    let name = file.display().to_string();
    let o =
        json(&["orbit", &scene, "-o", &name, "--sensitivity", "contact.gap,damping.rayleigh[1]"]);
    let stored = crate::common::hdf5_files().open(&file).unwrap();
    let of = |group: &str, attribute: &str| -> f64 {
        stored.group(group).unwrap().attr(attribute).unwrap().read_scalar().unwrap()
    };
    assert_eq!(of("sensitivity", "amplitude"), peak(&o, "amplitude"));
    assert_eq!(
        of("sensitivity/damping.rayleigh[1]", "energy"),
        by(&o, "damping.rayleigh[1]", "energy")
    );
    let u: Vec<f64> = stored.dataset("sensitivity/contact.gap/u0").unwrap().read_raw().unwrap();
    let start: Vec<f64> = stored.dataset("orbit/u0").unwrap().read_raw().unwrap();
    assert_eq!(u.len(), start.len());
    let refusals = [
        ("contact.gpa", "is no number that stands in the scene"),
        ("contact.displacements", "is no number that stands in the scene"),
        ("load[0].omega", "give omega"),
        ("contact.displacements[0]", "contact.displacements"),
    ];
    for (key, word) in refusals {
        let arguments = ["orbit", &scene, "-o", &name, "--force", "--sensitivity", key];
        let output = program().args(arguments).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
        assert_eq!(output.status.code(), Some(2), "{key}: {error}");
        assert!(error.contains(word), "{key}: {error}");
    }
}

/// The peak of a branch is the orbit at which the amplitude does not change with the frequency: an independent program's numbers, and the scaling laws of its derivatives.
#[test]
fn the_peak_of_a_response_is_solved_for() {
    let folder = TempDir::new().unwrap();
    let text = oscillator(1.0, 20.0, [0.1, 0.0], Some(0.2)) + "[orbit]\nrange = [0.8, 1.5]\n";
    let scene = written(folder.path(), &text);
    let file = folder.path().join("response.h5").display().to_string();
    let response = json(&["response", &scene, "-o", &file]);
    let ridge = response["ridge"].as_array().unwrap();
    assert_eq!(ridge.len(), 1, "{ridge:?}");
    let (omega, amplitude) = (number(&ridge[0]["omega"]), number(&ridge[0]["amplitude"]));
    near(omega, 1.271_772_58, 1e-8);
    near(amplitude, 1.808_939_43, 1e-8);
    // what the file says
    let stored = crate::common::hdf5_files().open(&file).unwrap();
    let of = |name: &str| -> f64 { stored.dataset(name).unwrap().read_raw().unwrap()[0] };
    assert_eq!([of("backbone/ridge/omega"), of("backbone/ridge/amplitude")], [omega, amplitude]);
    // at the peak the frequency follows at no cost: the derivative by a parameter is that at its frequency
    let keys = "load[0].amplitude,contact.gap,contact.stiffness,damping.rayleigh[0],omega";
    // the state that the body comes to from far away, at the frequency of the peak
    let far = text.replace("omega = 1.3", &format!("omega = {omega:?}"))
        + "[run]\nperiods = 150\nintegrator = \"modal\"\n";
    let run = folder.path().join("run.h5").display().to_string();
    let start = written(folder.path(), &format!("{far}[initial]\nmode = 1\namplitude = -4.0\n"));
    json(&["run", &start, "-o", &run]);
    let settled = written(folder.path(), &format!("{far}[initial]\nfile = {run:?}\n"));
    let file = folder.path().join("orbit.h5").display().to_string();
    let o = json(&["orbit", &settled, "-o", &file, "--sensitivity", keys]);
    near(peak(&o, "amplitude"), amplitude, 1e-9);
    near(by(&o, "omega", "amplitude"), 0.0, 1e-6);
    let known = [
        ("load[0].amplitude", 1.729_247_08),
        ("contact.gap", 0.079_692_35),
        ("contact.stiffness", -0.052_201_49),
        ("damping.rayleigh[0]", -1.726_750_27),
    ];
    for (key, wanted) in known {
        near(by(&o, key, "amplitude") * number(&o["sensitivity"][key]["value"]), wanted, 1e-7);
    }
}

/// Springs of the obstacle hold energy as long as they push: a polynomial in a phase, wherever the largest energy stands.
#[test]
fn energies_of_springs_change_as_their_differences() {
    let base = scene("driven-stop.toml");
    let stops = [
        ("method = \"penalty\"\nstiffness = 3.0\n", "stiffness = ", 3.0, "contact.stiffness"),
        (
            "method = \"stop\"\nstiffness = 20.0\npreload = 0.01\n",
            "preload = ",
            0.01,
            "contact.preload",
        ),
        ("method = \"nitsche\"\ngamma = 3.0\n", "gamma = ", 3.0, "contact.gamma"),
    ];
    let of = ["amplitude", "pressure", "energy"];
    for (keys, line, value, key) in stops {
        let text = base.replacen("gap = 0.02\n", &format!("gap = 0.02\n{keys}"), 1);
        let o = orbit(&text, &format!("{key},contact.gap,load[0].amplitude"), &[]);
        let d = differences(&text, line, value, 1e-4 * value, "omega", &[], &of);
        for (name, d) in of.iter().zip(d) {
            near(by(&o, key, name) * value / peak(&o, name), d * value / peak(&o, name), 1e-7);
        }
        // a preload is a force of its own
        if key != "contact.preload" {
            for (name, degree) in of.iter().zip([1.0, 1.0, 2.0]) {
                let sum = share(&o, "contact.gap", name) + share(&o, "load[0].amplitude", name);
                near(sum, degree, 1e-10);
            }
        }
    }
}

/// Where the largest displacement is that of the stop, it is the gap: nothing else changes it, whichever end of the touch rounding picks.
#[test]
fn what_rests_at_the_stop_moves_with_it() {
    let mean = "[[load]]\nkind = \"point\"\nat = [0.5]\namplitude = 0.04\n\n[orbit]";
    let text = scene("driven-stop.toml")
        .replacen("amplitude = 0.1", "amplitude = 0.04", 1)
        .replacen("[orbit]", mean, 1);
    for method in ["", "method = \"mass-redistribution\"\n"] {
        let text = text.replacen("gap = 0.02\n", &format!("gap = 0.02\n{method}"), 1);
        let o = orbit(&text, "contact.gap,load[1].amplitude,body.density", &[]);
        near(peak(&o, "amplitude"), 0.02, 1e-12);
        near(by(&o, "contact.gap", "amplitude"), 1.0, 1e-9);
        near(by(&o, "load[1].amplitude", "amplitude"), 0.0, 1e-9);
        near(by(&o, "body.density", "amplitude"), 0.0, 1e-9);
    }
}

#[test]
fn what_belongs_to_no_equations_is_no_parameter() {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), &oscillator(1.0, 20.0, [0.1, 0.0], Some(1.5)));
    let file = folder.path().join("o.h5");
    let refusals = [
        ("contact.gap,contact.gap", "twice"),
        ("contact.gap,", "give a key between commas"),
        ("beta", "belongs to viscous orbits"),
        ("run.rtol", "is no number of the equations"),
        ("contact.displacements[0]", "cannot be a little larger or smaller"),
    ];
    for (key, word) in refusals {
        let arguments = ["orbit", &scene, "-o", &file.display().to_string(), "--sensitivity", key];
        let output = program().args(arguments).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).replace("\n  │ ", " ");
        assert_eq!(output.status.code(), Some(2), "{key}: {error}");
        assert!(error.contains(word), "{key}: {error}");
        assert!(!file.exists(), "{key}");
    }
}
