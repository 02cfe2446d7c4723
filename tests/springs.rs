//! Penalty and Nitsche's method. Reference numbers: an independent prototype (event-driven modal flow in another language, two resolutions of its
//! search agreeing to 2e-15).

use crate::common::{bar_with as bar, event_driven as run, half_plate_with as half_plate};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::Integrator;

const PENALTY: &str = "method = \"penalty\"\n";
const NITSCHE: &str = "method = \"nitsche\"\n";
const NITSCHE_0: &str = "method = \"nitsche\"\ntheta = 0\ngamma = 5\n";

#[test]
fn bars_move_as_the_prototype_says() {
    for (method, first, middle, end, energies) in [
        (PENALTY, 1.364644931457, 1.388246841529, 1.115423195377, [3.858024691358; 2]),
        (NITSCHE, 1.360136650730, 1.386131698309, 0.963183180145, [3.761574074074; 2]),
        (
            NITSCHE_0,
            1.363152726435,
            1.389253922047,
            1.003517890458,
            [3.858024691358, 3.890351043302],
        ),
    ] {
        let p = bar(method, 20);
        let integrators = match method {
            NITSCHE_0 => vec![Integrator::Dop853, Integrator::Auto],
            _ => vec![Integrator::Modal, Integrator::Chebyshev, Integrator::Dop853],
        };
        for integrator in integrators {
            let report = run(&p.system, &p.initial, 1.68, integrator);
            let found = [
                report.switches[0].t,
                report.last.u[9],
                report.last.u[19],
                report.energy_start,
                report.energy_end,
            ];
            for (a, b) in found.iter().zip([first, middle, end, energies[0], energies[1]]) {
                assert!((a - b).abs() < 1e-9, "{method} {integrator:?}: {found:?}");
            }
            assert_eq!(report.switches.len(), 1);
            // what the forces without a potential do is in the ledger: nothing is left over
            assert!(report.energy_drift_total < 1e-10, "{method}: {:e}", report.energy_drift_total);
        }
    }
}

#[test]
fn half_plates_move_as_the_prototype_says() {
    for (method, first, bottom, top, energy, switches) in [
        (PENALTY, 1.483257770761, -1.150165470007, -1.250677761123, 0.364763641067, 12),
        (NITSCHE, 1.487476264986, -1.198409474280, -1.285195041308, 0.364763549720, 24),
    ] {
        let p = half_plate(method);
        for integrator in [Integrator::Modal, Integrator::Chebyshev, Integrator::Dop853] {
            let report = run(&p.system, &p.initial, 3.36, integrator);
            let u = p.system.body.dofs.scatter(&report.last.u);
            let at = |x, y| u[2 * p.system.body.mesh.nearest_node([x, y, 0.0])];
            let found = [report.switches[0].t, at(1.0, 0.0), at(1.0, 0.3), report.energy_end];
            for (a, b) in found.iter().zip([first, bottom, top, energy]) {
                assert!((a - b).abs() < 1e-9, "{method} {integrator:?}: {found:?}");
            }
            assert_eq!(report.switches.len(), switches, "{method}");
            assert!(report.switches.iter().all(|s| s.energy_jump.abs() < 1e-14));
        }
    }
}

#[test]
fn orbits_have_the_energies_of_the_prototype() {
    for (method, omega, energy) in [(PENALTY, 1.80, 1.5795871110), (NITSCHE, 1.80, 0.7846731695)] {
        let mut body = Propagator::new(half_plate(method).system).unwrap();
        let mut found = vec![];
        for amplitude in [-1.02, -1.05, -1.1, -1.2, -1.35, -1.5, -2.0, -3.0] {
            let z = signorini::orbit::branch::mode_guess(&body, 1, amplitude).unwrap();
            let verdict = find(&mut body, Closure::Reversible, &z, omega, &Effort::default());
            if let Some(orbit) = verdict.ok().as_ref().and_then(|v| v.orbit()) {
                let (u, v) = orbit.state.full(&body.system).unwrap();
                found.push((
                    body.system.kinetic(0.0, &v) + body.system.elastic(0.0, &u),
                    orbit.switches.len(),
                ));
            }
        }
        assert!(
            found.iter().any(|&(e, n)| (e - energy).abs() < 1e-8 && n == 12),
            "{method} {omega}: {found:?}"
        );
    }
}

/// Two-switch orbits of a bar: contact time and energy by the prototype.
#[test]
fn a_bar_has_the_orbit_of_the_prototype() {
    let mut body = Propagator::new(bar(PENALTY, 10).system).unwrap();
    let mut found = vec![];
    for amplitude in [-1.1, -1.4, -1.8, -2.2, -2.6, -3.0, -3.4] {
        let z = signorini::orbit::branch::mode_guess(&body, 1, amplitude).unwrap();
        let verdict = find(&mut body, Closure::Reversible, &z, 1.87, &Effort::default());
        if let Some(orbit) = verdict.ok().as_ref().and_then(|v| v.orbit()) {
            found.push((orbit.contact_time, orbit.energy, orbit.switches.len()));
        }
    }
    let near = |&(t, e, n): &(f64, f64, usize)| {
        n == 2 && (t - 0.7941957178).abs() < 1e-8 && (e - 6.1615093532).abs() < 1e-8
    };
    assert!(found.iter().any(near), "{found:?}");
}

/// The top of a curve through five values around its highest place, one step apart: its place and height.
fn top_of(values: impl Fn(f64) -> f64, near: f64, step: f64) -> (f64, f64) {
    let mut at = near;
    for _ in 0..6 {
        let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| values(at + k * step));
        // the quartic's slope and curvature, one step of Newton
        let slope = (a - 8.0 * b + 8.0 * d - e) / 12.0;
        let curvature = (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / 12.0;
        at -= (slope / curvature).clamp(-1.0, 1.0) * step;
    }
    (at, values(at))
}

/// Two masses and an elastic stop, damped structurally: the peak of the forced response in time and by harmonic balance.
#[test]
fn the_two_mass_system_peaks_where_both_say() {
    use signorini::hbm::newton::Settings;
    use signorini::hbm::response::Summary;
    use signorini::hbm::{Form, prepare};
    use std::cell::RefCell;
    let scene = crate::common::shipped("two-mass-stop.toml");
    let system = || Problem::new(&scene, None).unwrap().system;
    let body = RefCell::new(Propagator::new(system()).unwrap());
    body.borrow_mut().system.loads_mut().set_frequency(0.5);
    let z = RefCell::new(body.borrow().linear_response());
    let in_time = |omega: f64| {
        let mut body = body.borrow_mut();
        let verdict = find(&mut body, Closure::FORCED, &z.borrow(), omega, &Effort::default());
        let verdict = verdict.unwrap();
        let orbit = verdict.orbit().unwrap_or_else(|| panic!("no orbit at {omega}"));
        *z.borrow_mut() = orbit.z.clone();
        orbit.amplitude
    };
    let balance = RefCell::new(prepare(system(), Form::Acceleration).unwrap());
    let series = RefCell::new(None);
    let by_series = |omega: f64| {
        let mut body = balance.borrow_mut();
        body.set_frequency(omega);
        let none = signorini::hbm::series::Series::zeros(body.interface().basis, 31, 2);
        let guess = series.borrow().clone().unwrap_or(none);
        let found = body.solve(&guess, omega, &Settings::default()).unwrap();
        let solution = found.unwrap_or_else(|e| panic!("{omega}: {e}"));
        let amplitude = Summary::new(body.as_ref(), &solution).unwrap().amplitude;
        *series.borrow_mut() = Some(solution.q);
        amplitude
    };
    for k in 0..=500 {
        let omega = 0.5 + 0.23 / 500.0 * f64::from(k);
        let (a, b) = (in_time(omega), by_series(omega));
        assert!((a - b).abs() < 1e-4 * a, "{omega}: {a} {b}");
    }
    let (a, b) = (top_of(in_time, 0.7305, 1e-4), top_of(by_series, 0.7305, 1e-4));
    println!("in time {a:?}, by harmonic balance {b:?}");
    assert!((a.0 - b.0).abs() < 1e-6 * a.0 && (a.1 - b.1).abs() < 1e-6 * a.1, "{a:?} {b:?}");
}

/// The viscous nonlinear mode, whose springs do not damp: by harmonic balance and in time.
#[test]
fn viscous_modes_agree_in_time_and_in_series() {
    use signorini::hbm::Viscous;
    use signorini::orbit::Pin;
    use signorini::orbit::viscous::{by_viscosity, pinned_mode};
    for (method, energy) in [(PENALTY, 0.8496976213), (NITSCHE, 0.6920636643)] {
        let mut body = Propagator::new(half_plate(method).system).unwrap();
        let mode = pinned_mode(&body).unwrap();
        let pin = Pin::new(&body, mode, 0.01);
        let found = by_viscosity(&mut body, pin, 1.8, &Effort::default()).unwrap().unwrap();
        let orbit = found.orbit().unwrap();
        let alpha = orbit.viscous.as_ref().unwrap().alpha;
        println!("{method}: energy {}, alpha {alpha}, balance {:e}", orbit.energy, orbit.balance);
        assert!((orbit.energy - energy).abs() < 1e-8 && orbit.balance < 1e-11, "{}", orbit.energy);
        let mut viscous = Viscous::new(half_plate(method).system, pin).unwrap();
        let settings = signorini::hbm::newton::Settings::default();
        let fed = viscous.from_mode(31, 1.8, &settings).unwrap().unwrap();
        println!("N_h = 31: alpha {}", fed.alpha);
        assert!((fed.alpha - alpha).abs() < 2e-4 * alpha, "{} {alpha}", fed.alpha);
    }
}

/// What a scene with springs can get wrong, in words.
#[test]
fn wrong_springs_are_refused() {
    let folder = tempfile::TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let plate = crate::common::root().join("scenarios/half-plate-orbit.toml");
    let plate = std::fs::read_to_string(plate).unwrap();
    let two = std::fs::read_to_string(crate::common::root().join("scenarios/two-mass-stop.toml"))
        .unwrap();
    for file in ["two-mass-stop-M.mtx", "two-mass-stop-K.mtx"] {
        std::fs::copy(crate::common::root().join("scenarios").join(file), at(file)).unwrap();
    }
    let with = |keys: &str| plate.replace("gap = 1.0\n", &format!("gap = 1.0\n{keys}"));
    let refused = |text: String, command: &str, words: &str| {
        std::fs::write(at("scene.toml"), text).unwrap();
        let output = crate::common::program()
            .args([command, &at("scene.toml"), "-o", &at("x.h5")])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words}: {said}");
        // lines are broken where the terminal ends
        let joined: Vec<&str> = said.split_whitespace().filter(|w| *w != "│").collect();
        assert!(joined.join(" ").contains(words), "{words}: {said}");
    };
    // the bound of this mesh, by an independent prototype to the digits printed
    refused(with("method = \"nitsche\"\ngamma = 1.05\n"), "run", "it must exceed 1.08");
    for command in ["orbit", "backbone"] {
        refused(with("method = \"nitsche\"\ntheta = 0\n"), command, "is for run alone");
    }
    refused(with("method = \"nitsche\"\ntheta = 0.5\n"), "run", "give 1 (symmetric), 0 or -1");
    refused(with("method = \"penalty\"\nstiffness = 0\n"), "run", "contact.stiffness");
    refused(with("method = \"penalty\"\ngamma = 2\n"), "run", "it belongs to \"nitsche\"");
    refused(with("method = \"impact\"\ngap_behind = 2\n"), "run", "\"penalty\" and \"nitsche\"");
    refused(two.replace("stiffness = 10.0\n", ""), "run", "is missing: force over penetration");
    refused(
        two.replace("\"penalty\"\nstiffness = 10.0\n", "\"nitsche\"\n"),
        "run",
        "needs elements",
    );
    refused(
        two.replace("displacement = 1\n", "displacement = 2\n"),
        "run",
        "give rows from 0 to 1",
    );
    refused(two.replace("displacement = 1\n", ""), "run", "add displacement = 0");
}

/// Files of bodies with springs: places of the points, displacements of the body there; pictures, tables and exports are made of them.
#[test]
fn files_know_points_that_are_no_nodes() {
    let folder = tempfile::TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let plate = crate::common::root().join("scenarios/half-plate-orbit.toml");
    let text = std::fs::read_to_string(plate).unwrap();
    let text = text.replace("gap = 1.0\n", "gap = 1.0\nmethod = \"nitsche\"\n");
    std::fs::write(at("scene.toml"), text).unwrap();
    let run = |arguments: &[&str]| {
        let output =
            crate::common::program().args(arguments).current_dir(folder.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    run(&["run", "scene.toml", "-o", "run.h5"]);
    let stored = signorini::store::Stored::read(std::path::Path::new(&at("run.h5"))).unwrap();
    assert_eq!(stored.contact_nodes, [0, 1, 2, 3, 4, 5]);
    // two points of Gauss an edge, on the edge x = 1
    let gauss = [0.5 - 0.75f64.sqrt() / 3.0, 0.5 + 0.75f64.sqrt() / 3.0];
    for i in 0..6 {
        let [x, y, _] = stored.contact_place(i);
        let expected = 0.1 * (gauss[i % 2] + (i / 2) as f64);
        assert!((x - 1.0).abs() < 1e-15 && (y - expected).abs() < 1e-15, "{x} {y}");
        // the body's displacement there, between the nodes
        let node = |k: usize| stored.nodes.nrows() - 4 + k;
        let shape = [1.0 - gauss[i % 2], gauss[i % 2]];
        for row in 0..stored.t.len() {
            let u = [0, 1].map(|k| stored.displacement(row, node(i / 2 + k))[0]);
            let between = shape[0] * u[0] + shape[1] * u[1];
            assert!((stored.contact_displacement(row, i) - between).abs() < 1e-14);
        }
    }
    let entered = |row: usize, i: usize| stored.contact_displacement(row, i) - stored.gap[i];
    let deepest = (0..stored.t.len()).flat_map(|r| (0..6).map(move |i| (r, i)));
    assert!(deepest.map(|(r, i)| entered(r, i)).fold(0.0, f64::max) > 0.01, "no penetration");
    for command in [
        &["plot", "run.h5"][..],
        &["inspect", "run.h5"],
        &["export", "run.h5", "--format", "csv"],
        &["export", "run.h5", "--format", "vtu"],
    ] {
        run(command);
    }
    run(&["orbit", "scene.toml", "--omega", "1.7", "-o", "orbit.h5"]);
    run(&["plot", "orbit.h5"]);
    // a stored state goes on
    let text = std::fs::read_to_string(at("scene.toml")).unwrap();
    let again = text.replace("mode = 1\namplitude = -1.1\n", "file = \"run.h5\"\n");
    std::fs::write(at("again.toml"), again).unwrap();
    run(&["run", "again.toml", "-o", "again.h5"]);
}
