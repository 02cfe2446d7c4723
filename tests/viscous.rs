//! The viscous nonlinear mode against numbers of an independent program (Python, sampled switch search, its own reduction).

use crate::common::{bar, half_plate};

use signorini::contact::{Contacts, Gaps, MassChoice, Stress, System};
use signorini::continuation::{Go, Options, Stop};
use signorini::event::{self, Silent};
use signorini::fem::Csr;
use signorini::flow::Tolerances;
use signorini::orbit::Pin;
use signorini::orbit::along::{Start, arclength};
use signorini::orbit::branch::mode_guess;
use signorini::orbit::search::{Effort, Verdict, find};
use signorini::orbit::viscous;
use signorini::orbit::{Closure, Orbit, Propagator};
use signorini::records::{PointKind, PointRecord};
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

/// The plate of the README, 1 × 0.5, both halves.
fn full_plate(nx: usize, ny: usize, more: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{more}"
    )
}

fn viscous_orbit(scene: &str, beta: f64, omega: f64) -> Orbit {
    orbit_of(crate::common::problem(scene).system, beta, omega)
}

fn orbit_of(system: System, beta: f64, omega: f64) -> Orbit {
    let mut body = Propagator::new(system).unwrap();
    let pin = Pin::new(&body, viscous::pinned_mode(&body).unwrap(), beta);
    for guess in pin.guesses(&body, omega) {
        let verdict =
            find(&mut body, Closure::Viscous(pin), &guess, omega, &Effort::default()).unwrap();
        if let Verdict::Orbit(orbit) = verdict {
            return *orbit;
        }
    }
    panic!("no orbit");
}

/// Energy at `t = 0`, `α`, switches, first switch over the period, largest multiplier.
type Expected = (f64, f64, usize, Option<f64>, Option<f64>);

fn check(scene: &str, omega: f64, expected: Expected) {
    compare(&viscous_orbit(scene, 0.01, omega), expected);
}

fn compare(orbit: &Orbit, (energy, alpha, switches, first, multiplier): Expected) {
    let feedback = orbit.viscous.as_ref().unwrap();
    assert!((orbit.energy / energy - 1.0).abs() < 1e-9, "{} {energy}", orbit.energy);
    assert!((feedback.alpha - alpha).abs() < 1e-8, "{} {alpha}", feedback.alpha);
    assert_eq!(orbit.switches.len(), switches);
    if let Some(expected) = first {
        assert!((orbit.switches[0].t / orbit.period - expected).abs() < 1e-9);
    }
    assert!(orbit.residual <= 1e-11 && orbit.flaws().is_empty(), "{:?}", orbit.flaws());
    let largest = orbit.stability.as_ref().unwrap().largest;
    if let Some(expected) = multiplier {
        assert!((largest - expected).abs() < 2e-6, "{largest} {expected}");
    }
}

#[test]
fn bars_have_the_orbits_of_the_prototype() {
    check(&bar(20), 1.80, (2.1069895626, 0.1278276517, 2, Some(0.4023081199), Some(1.070501)));
    check(&bar(40), 1.87, (3.9649665467, 0.1193954523, 2, Some(0.3912843109), None));
}

#[test]
fn half_plates_have_the_orbits_of_the_prototype() {
    let coarse = half_plate(10, 3, "");
    check(&coarse, 1.80, (0.6567459227, 0.1464499459, 8, Some(0.3921846766), Some(1.055849)));
    check(&coarse, 1.86, (1.2201058041, 0.1285546307, 8, Some(0.3770531586), None));
    let condensed = "method = \"mass-redistribution\"\n";
    check(&half_plate(10, 3, condensed), 1.80, (0.6698282879, 0.1076510245, 8, None, None));
    let fine = half_plate(20, 6, "");
    check(&fine, 1.70, (0.3647804280, 0.1165816475, 14, Some(0.3961274087), None));
    check(&fine, 1.80, (0.7005171606, 0.1224353780, 14, Some(0.4001689603), Some(1.095843)));
}

/// One more redistribution, that of the prototype's first table: the mass of the contact displacements goes to their neighbours inside.
#[test]
fn mass_moved_to_the_neighbours_has_the_orbit_of_the_prototype() {
    let whole = crate::common::problem(&half_plate(10, 3, "")).system;
    let mut body = (*whole.body).clone();
    let (n, n_o) = (body.dofs.n(), body.dofs.n_o);
    let least = 1e-12;
    // u_C moves as the neighbour inside does
    let behind = |node: usize| {
        let p = body.mesh.nodes()[node];
        let inside = |q: &[f64; 3]| (q[1] - p[1]).abs() < 1e-9 && (p[0] - q[0] - 0.1).abs() < 1e-9;
        let node = body.mesh.nodes().iter().position(inside).unwrap();
        body.dofs.terms(node, 0).next().unwrap().0
    };
    let place = |i: usize| if i < n_o { i } else { behind(body.dofs.contact[i - n_o].node) };
    let kept = body.mass.triplets().map(|(i, j, m)| (place(i), place(j), m));
    let kept = kept.chain((n_o..n).map(|i| (i, i, least))).collect();
    body.mass = Csr::from_triplets(n, n, kept);
    let contacts = Contacts { gaps: Gaps::front(whole.gaps()), lumped: true };
    let system = System::new(body, &contacts, (Stress::Reaction, MassChoice::Condensed)).unwrap();
    let orbit = orbit_of(system, 0.01, 1.80);
    compare(&orbit, (0.6763363078, 0.1116876097, 8, Some(0.3997916034), None));
}

#[test]
#[ignore = "a minute; `cargo test --release -- --ignored`"]
fn large_bodies_are_reduced() {
    let reduced = |modes: usize| format!("[reduction]\nmodes = {modes}\n");
    let cases = [
        (half_plate(40, 12, &reduced(146)), 183, (0.7229586779, 0.1179269283, 26, 0.3999563637)),
        (half_plate(46, 21, &reduced(146)), 210, (0.7271429782, 0.1175337019, 44, 0.3997268600)),
        (full_plate(46, 21, &reduced(230)), 296, (1.2833768306, 0.1760989338, 44, 0.3869266830)),
    ];
    for (scene, unknowns, (energy, alpha, switches, first)) in cases {
        let system = crate::common::problem(&scene).system;
        assert_eq!(system.n_o(), unknowns);
        let orbit = orbit_of(system, 0.01, 1.80);
        let found = orbit.viscous.as_ref().unwrap().alpha;
        println!("{} {found} {:?}", orbit.energy, orbit.stability.as_ref().map(|s| s.largest));
        assert!((orbit.energy / energy - 1.0).abs() < 1e-6, "{} {energy}", orbit.energy);
        assert!((found - alpha).abs() < 1e-6, "{found} {alpha}");
        assert_eq!(orbit.switches.len(), switches);
        assert!((orbit.switches[0].t / orbit.period - first).abs() < 1e-6);
        assert!(orbit.residual <= 1e-11 && orbit.flaws().is_empty(), "{:?}", orbit.flaws());
    }
}

/// The load that keeps the phase: `F M φ_1 sin ωt` with `v_1(0) = 0`, a forced orbit of the damped body.
#[test]
fn the_damped_body_under_a_load_has_the_orbit_of_the_prototype() {
    let load = "[damping]\nrayleigh = [0.0, 0.02]\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.2220197576\nomega = 1.8\nphase = -1.5707963267948966\n";
    let mut body =
        Propagator::new(crate::common::problem(&half_plate(10, 3, load)).system).unwrap();
    let found = [1.2, 1.5, 1.8, 2.2].into_iter().find_map(|a| {
        let mut guess = mode_guess(&body, 1, -a).unwrap();
        guess.resize(2 * body.n(), 0.0);
        let verdict = find(&mut body, Closure::FORCED, &guess, 1.8, &Effort::default()).unwrap();
        verdict.orbit().cloned()
    });
    let orbit = found.unwrap();
    let (u, v) = orbit.state.full(&body.system).unwrap();
    let energy = body.system.elastic(0.0, &u) + body.system.kinetic(0.0, &v);
    assert!((energy / 0.6895774880 - 1.0).abs() < 1e-8, "{energy}");
    assert!((orbit.switches[0].t / orbit.period - 0.3789585768).abs() < 1e-8);
    assert_eq!(orbit.switches.len(), 8);
    let largest = orbit.stability.as_ref().unwrap().largest;
    assert!((largest - 0.697024).abs() < 2e-6, "{largest}");
    // the velocity of the mode vanishes at t = 0
    let z = &orbit.z;
    assert!(z[body.n()].abs() < 1e-8 * z[0].abs());
}

/// Through the 3:1 tongue: two folds, which harmonic balance with 31 harmonics has at 1.9205051 and 1.9151740 (2e-5), and three orbits between them.
#[test]
fn a_tongue_is_passed_from_the_linear_mode() {
    let scene = half_plate(10, 3, "method = \"mass-redistribution\"\n");
    let mut body = Propagator::new(crate::common::problem(&scene).system).unwrap();
    let pin = Pin::new(&body, viscous::pinned_mode(&body).unwrap(), 0.01);
    let closure = Closure::Viscous(pin);
    let start = pin.guesses(&body, 1.87).into_iter().find_map(|guess| {
        let verdict = find(&mut body, closure, &guess, 1.87, &Effort::of(closure)).unwrap();
        verdict.orbit().cloned()
    });
    let start = Start::Orbit(Box::new(start.unwrap()), 1.0);
    let range = (1.85, 1.94);
    let options =
        Options { range, step: (0.005, 1e-8, 0.05), points: 600, locate: false, natural: false };
    let mut points = vec![];
    let ending = arclength(&mut body, closure, start, &options, |p| {
        points.push(p);
        Go::Continue(())
    });
    assert_eq!(ending.unwrap().unwrap().stop, Stop::Range);
    let folds: Vec<f64> =
        points.iter().filter(|p| p.special == PointKind::Fold).map(|p| p.omega).collect();
    assert_eq!(folds.len(), 2);
    assert!((folds[0] - 1.9205051).abs() < 2e-5 && (folds[1] - 1.9151740).abs() < 2e-5);
    // every crossing of one frequency between the folds leads to an orbit of its own
    let omega = 1.918;
    let between = |p: &&[PointRecord]| (p[0].omega - omega) * (p[1].omega - omega) < 0.0;
    let mut energies = vec![];
    for pair in points.windows(2).filter(between) {
        let place = pair[0].place.as_ref().or(pair[1].place.as_ref()).unwrap();
        let guess = &place.x[..place.x.len() - 1];
        let verdict = find(&mut body, closure, guess, omega, &Effort::of(closure)).unwrap();
        let orbit = verdict.orbit().unwrap();
        assert!(orbit.flaws().is_empty() && orbit.residual < 1e-11);
        energies.push(orbit.energy);
    }
    assert_eq!(energies.len(), 3);
    assert!(energies[0] < 0.9 * energies[2] && energies[2] < 0.95 * energies[1], "{energies:?}");
}

/// Energies of a backbone by the program, over a unit.
fn backbone(scene: &str, arguments: &[&str], unit: f64) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("scene.toml"), scene).unwrap();
    let output = crate::common::program()
        .args(["backbone", &at("scene.toml"), "--viscous", "--quick", "--json", "-o", &at("v.h5")])
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let points = json["points"].as_array().unwrap();
    points.iter().map(|p| p["energy"].as_f64().unwrap_or(f64::NAN) / unit).collect()
}

#[test]
fn units_do_not_matter() {
    let unit = backbone(
        &half_plate(10, 3, ""),
        &["--range", "1.6,1.88", "--step", "0.04", "--beta", "0.02"],
        1.0,
    );
    // steel, 0.2 m long, 5 mm thick, a gap of 30 μm
    let (young, density, length, thickness, gap) = (2.1e11f64, 7800.0, 0.2, 5e-3, 3e-5);
    let rate = (young / density).sqrt() / length;
    let scene = format!(
        "[body]\nkind = \"plate\"\nsize = [0.2, 0.06]\nelements = [10, 3]\nyoung = {young:e}\npoisson = 0.3\ndensity = {density:e}\n\
         thickness = {thickness:e}\n[[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n\
         [contact]\nedge = \"right\"\ngap = {gap:e}\n"
    );
    let number = |x: f64| format!("{x:.17e}");
    let range = format!("{},{}", number(1.6 * rate), number(1.8800001 * rate));
    let (step, beta) = (number(0.04 * rate), number(0.02 / rate));
    let steel = backbone(
        &scene,
        &["--range", &range, "--step", &step, "--beta", &beta],
        young * thickness * gap * gap,
    );
    assert_eq!(unit.len(), 8);
    assert_eq!(steel.len(), 8);
    for (a, b) in unit.iter().zip(&steel) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    // and the viscosity that the mesh resolves
    let unit = backbone(&half_plate(20, 6, ""), &["--range", "1.7,1.71", "--step", "0.1"], 1.0);
    let steel = backbone(
        &scene.replace("[10, 3]", "[20, 6]"),
        &[
            "--range",
            &format!("{},{}", number(1.7 * rate), number(1.71 * rate)),
            "--step",
            &number(rate),
        ],
        young * thickness * gap * gap,
    );
    assert!((unit[0] / steel[0] - 1.0).abs() < 1e-9);
}

/// Dormand and Prince, which know neither modes nor closed forms, come back to where they started.
#[test]
fn runge_kutta_returns_to_the_viscous_orbit() {
    let mut body = Propagator::new(crate::common::problem(&half_plate(10, 3, "")).system).unwrap();
    let pin = Pin::new(&body, viscous::pinned_mode(&body).unwrap(), 0.01);
    let closure = Closure::Viscous(pin);
    let guess = pin.guesses(&body, 1.8).remove(0);
    let verdict = find(&mut body, closure, &guess, 1.8, &Effort::of(closure)).unwrap();
    let orbit = verdict.orbit().unwrap();
    for (rtol, most) in [(1e-7, 1e-5), (1e-10, 2e-8)] {
        let tolerances = Tolerances { rtol, atol: 1e-3 * rtol };
        let mut flow = by_name(Integrator::Dop853, &body.system, tolerances);
        let options = event::Options { until: orbit.period, samples: 1, switch_limit: 40.0 };
        let report =
            event::run(&body.system, &orbit.state, &options, flow.as_mut(), &mut Silent).unwrap();
        let (start, end) = (body.frame(&orbit.state), body.frame(&report.last));
        let distance = crate::common::relative(&end, &start);
        assert!(distance < most, "{distance}");
        assert_eq!(report.switches.len(), orbit.switches.len());
        // the viscosity takes what the feedback gives, but for the jumps of the mass
        let balance = report.energy_dissipated - report.energy_jumps;
        assert!(balance.abs() < 1e-5 * orbit.energy, "{balance}");
    }
}
