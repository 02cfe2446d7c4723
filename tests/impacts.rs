//! Newton's law of impact. Reference numbers: an independent prototype (event-driven modal flow in another language).

use crate::common::{bar_with, event_driven as run, half_plate_with, problem};
use signorini::event::{Outcome, Report, Silent, SwitchKind};
use signorini::problem::Problem;
use signorini::scenario::Integrator;

fn method(e: f64) -> String {
    format!("method = \"impact\"\nrestitution = {e}\n")
}

fn bar(e: f64, n: usize) -> Problem {
    bar_with(&method(e), n)
}

fn half_plate(e: f64) -> Problem {
    half_plate_with(&method(e))
}

/// Times at which points are hit: two points at one time count once.
fn impacts(report: &Report) -> usize {
    let mut times: Vec<f64> =
        report.switches.iter().filter(|s| s.kind.arrives()).map(|s| s.t).collect();
    times.dedup();
    times.len()
}

#[test]
fn bars_move_as_the_prototype_says() {
    for (e, middle, energy, count) in
        [(0.0, 1.386849683794, 3.828421486226, 1), (1.0, 1.384859184417, 3.858024691358, 11)]
    {
        let p = bar(e, 20);
        for integrator in [Integrator::Modal, Integrator::Dop853] {
            let report = run(&p.system, &p.initial, 1.68, integrator);
            let found = [report.switches[0].t, report.last.u[9], report.energy_end];
            for (a, b) in found.iter().zip([1.364644931457, middle, energy]) {
                assert!((a - b).abs() < 1e-9, "e = {e} {integrator:?}: {found:?}");
            }
            assert_eq!(impacts(&report), count, "e = {e}");
            assert!(report.energy_drift_total < 1e-10);
        }
    }
}

#[test]
fn half_plates_move_as_the_prototype_says() {
    for (e, bottom, energy, count) in
        [(0.0, -1.116289131137, 0.352883929983, 15), (1.0, -1.127164182041, 0.364763641067, 26)]
    {
        let p = half_plate(e);
        let report = run(&p.system, &p.initial, 3.36, Integrator::Modal);
        let u = p.system.body.dofs.scatter(&report.last.u);
        let at = u[2 * p.system.body.mesh.nearest_node([1.0, 0.0, 0.0])];
        let found = [report.switches[0].t, at, report.energy_end];
        for (a, b) in found.iter().zip([1.482354956487, bottom, energy]) {
            assert!((a - b).abs() < 1e-9, "e = {e}: {found:?} {}", impacts(&report));
        }
        assert_eq!(impacts(&report), count, "e = {e}");
        assert!(report.is_certified());
    }
}

/// Rebounds that accumulate come to rest: no hang, and energy only falls.
#[test]
fn accumulations_end_and_take_energy() {
    for e in [0.2, 0.5, 0.8, 0.95] {
        let p = half_plate(e);
        let report = run(&p.system, &p.initial, 3.36, Integrator::Modal);
        assert_eq!(report.outcome, Outcome::EndTime, "e = {e}");
        let rests = report.switches.iter().filter(|s| s.kind == SwitchKind::Rest).count();
        println!(
            "e = {e}: {} impacts, {rests} accumulations, energy {}",
            impacts(&report),
            report.energy_end
        );
        assert!(rests > 0 || e > 0.9, "e = {e}");
        assert!(report.switches.iter().all(|s| s.energy_jump <= 1e-14), "e = {e}: energy grows");
        assert!(report.energy_drift_total < 1e-10 && report.energy_end < report.energy_start);
    }
    // of a single point rebounds end as a geometric series: each begins with e times the velocity that the last ended with
    let report = {
        let p = bar(0.5, 20);
        run(&p.system, &p.initial, 1.68, Integrator::Modal)
    };
    let rates: Vec<f64> = report.switches.iter().map(|s| s.monitor_rate).collect();
    assert_eq!(report.switches.last().map(|s| s.kind), Some(SwitchKind::Rest));
    // as files of earlier versions called it
    assert_eq!(SwitchKind::of_name("stick"), SwitchKind::Rest);
    for pair in rates[rates.len() - 8..].windows(2) {
        assert!((pair[1] / pair[0] - 0.5).abs() < 1e-3, "{rates:?}");
    }
}

/// One impact takes `½ (1 − e²) ẇ²/D`, and reverses the velocity of its point.
#[test]
fn an_impact_takes_what_it_should() {
    let p = bar(0.6, 12);
    let report = run(&p.system, &p.initial, 1.68, Integrator::Modal);
    let law = p.system.impact().unwrap();
    let mut v = vec![0.0; p.system.n_o()];
    // a unit of velocity of the end alone: D from what the impact does to it
    v[11] = 1.0;
    let blow = law.strike(&[0], &mut v).unwrap();
    let d = 1.6 / blow.impulse[0];
    for s in &report.switches {
        let taken = 0.5 * (1.0 - 0.36) * s.monitor_rate.powi(2) / d;
        assert!((s.energy_jump + taken).abs() < 1e-12, "{} {taken}", s.energy_jump);
    }
    assert!((v[11] + 0.6).abs() < 1e-14);
}

fn stepped(keys: &str, until: f64) -> (Problem, Report) {
    let text = format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [20]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n\
         method = \"moreau-jean\"\n{keys}[initial]\ndisplacement = [\"-x/0.36\"]\n[run]\nuntil = {until}\n"
    );
    let scene = signorini::scenario::Scene::parse(&text, "bar.toml".as_ref()).unwrap();
    let p = Problem::new(&scene, None).unwrap();
    let report = signorini::simulate::simulate(&scene, &p, false, &mut Silent).unwrap();
    (p, report)
}

#[test]
fn steps_of_moreau_and_jean_are_those_of_the_prototype() {
    let (_, report) = stepped("step = 0.00525\n", 1.68);
    let found = [report.last.u[9], report.last.u[19], report.energy_end];
    for (a, b) in found.iter().zip([1.389447509474, 1.003476380486, 3.828833127309]) {
        assert!((a - b).abs() < 1e-9, "{found:?}");
    }
    assert_eq!(report.counters.steps, 320);
    // ΔE = ½(1 − e) Pᵀẇ: none for e = 1, never a gain
    for (keys, gain) in [("restitution = 1\n", 1e-13), ("restitution = 0.5\n", 0.0)] {
        let (_, report) = stepped(keys, 10.0);
        assert!(report.energy_drift_total < 1e-12, "{keys}: {:e}", report.energy_drift_total);
        assert!(report.energy_jumps <= gain && report.energy_end - report.energy_start <= 1e-11);
    }
}

/// Under loads and damping the books of the scheme balance to rounding, and with smaller steps it comes to what the events give.
#[test]
fn steps_converge_to_events() {
    let scene = |method: &str, step: f64| {
        let text = format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = \"0.5 + 0.1*y\"\n\
             method = \"{method}\"\n{}[damping]\nrayleigh = [0.05, 0.0]\n\
             [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.05, 0.02]\nomega = 2.3\n\
             [[load]]\nkind = \"gravity\"\namplitude = [0.03, -0.02]\n\
             [initial]\ndisplacement = [\"-0.9*x\", \"0\"]\n[run]\nuntil = 2.0\n{}",
            if step > 0.0 { format!("step = {step}\n") } else { String::new() },
            if step > 0.0 { "" } else { "integrator = \"modal\"\n" },
        );
        signorini::scenario::Scene::parse(&text, "plate.toml".as_ref()).unwrap()
    };
    let end = |method: &str, step: f64| {
        let scene = scene(method, step);
        let p = Problem::new(&scene, None).unwrap();
        let report = signorini::simulate::simulate(&scene, &p, false, &mut Silent).unwrap();
        assert!(report.energy_drift_total < 1e-11, "{method}: {:e}", report.energy_drift_total);
        report.last.u
    };
    let exact = end("impact", 0.0);
    let size = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let error = |step: f64| {
        let u = end("moreau-jean", step);
        u.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
    };
    let errors = [1e-3, 2.5e-4, 6.25e-5].map(error);
    println!("{errors:?}");
    assert!(errors[2] < 0.2 * errors[0] && errors[2] < 2e-3, "{errors:?}");
}

/// The derivative of the event-driven map against differences of it.
fn check_derivative(p: Problem, closure: signorini::orbit::Closure, z: &[f64], period: f64) {
    use signorini::orbit::{Propagator, shooting::linearised};
    let mut body = Propagator::new(p.system).unwrap();
    let (r, j) = linearised(&mut body, closure, z, period).unwrap();
    let size = z.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let h = 1e-7 * size;
    let mut worst = 0.0f64;
    let mut largest = 0.0f64;
    for c in 0..z.len() {
        let mut at = |s: f64| {
            let mut z = z.to_vec();
            z[c] += s;
            linearised(&mut body, closure, &z, period).unwrap().0
        };
        let (up, down) = (at(h), at(-h));
        for i in 0..r.len() {
            let difference = (up[i] - down[i]) / (2.0 * h);
            largest = largest.max(j[(i, c)].abs());
            worst = worst.max((difference - j[(i, c)]).abs());
        }
    }
    println!("{closure:?}: derivative up to {largest:.2e}, differences off by {worst:.1e}");
    assert!(worst < 1e-5 * largest, "{worst:e} of {largest:e}");
}

#[test]
fn saltation_of_impacts_is_the_derivative_of_the_map() {
    use signorini::orbit::{Closure, Propagator};
    // rebounds: a bar over half a period, several impacts
    let body = Propagator::new(bar(1.0, 6).system).unwrap();
    let z = body.frame(&bar(1.0, 6).initial);
    let n = body.n();
    check_derivative(bar(1.0, 6), Closure::Reversible, &z[..n], 3.2);
    check_derivative(bar(1.0, 6), Closure::Autonomous, &z, 2.3);
    check_derivative(bar(0.0, 6), Closure::Autonomous, &z, 1.8);
    check_derivative(bar(0.0, 6), Closure::Autonomous, &z, 2.3);
    // points that stay, leave and are struck beside others
    let plate = || {
        problem(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [3, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = \"0.5 + 0.2*y\"\n\
             method = \"impact\"\n[damping]\nrayleigh = [0.1, 0.0]\n\
             [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.2, 0.02]\nomega = 1.6\n\
             [initial]\ndisplacement = [\"-0.9*x\", \"0\"]\n",
        )
    };
    let body = Propagator::new(plate().system).unwrap();
    let z = body.frame(&plate().initial);
    check_derivative(plate(), Closure::FORCED, &z, std::f64::consts::TAU / 1.6);
}

/// Orbits of an elastic impact and of a plastic one under a load close, and are told from what has none.
#[test]
fn impacts_have_orbits() {
    use signorini::orbit::search::{Effort, find};
    use signorini::orbit::{Closure, Propagator};
    let mut body = Propagator::new(bar(1.0, 6).system).unwrap();
    let mut found = 0;
    for amplitude in [-1.05, -1.2, -1.5, -2.0, -2.6] {
        let z = signorini::orbit::branch::mode_guess(&body, 1, amplitude).unwrap();
        let verdict = find(&mut body, Closure::Reversible, &z, 1.7, &Effort::default()).unwrap();
        if let Some(orbit) = verdict.orbit() {
            println!("elastic: energy {}, {} impacts", orbit.energy, orbit.switches.len());
            assert!(orbit.residual < 1e-9 && orbit.balance < 1e-9, "{}", orbit.residual);
            found += 1;
        }
    }
    assert!(found > 0, "no elastic orbit");
    let p = problem(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [8]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 0.3\nmethod = \"impact\"\n\
         [damping]\nrayleigh = [0.1, 0.0]\n[[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.1]\nomega = 1.5\nphase = 3.141592653589793\n",
    );
    let mut body = Propagator::new(p.system).unwrap();
    let mut z = body.linear_response();
    let mut touched = 0;
    for k in 0..=20 {
        let omega = 1.2 + 0.01 * f64::from(k);
        body.system.loads_mut().set_frequency(omega);
        let verdict = find(&mut body, Closure::FORCED, &z, omega, &Effort::default()).unwrap();
        let Some(orbit) = verdict.orbit() else { continue };
        touched += usize::from(!orbit.switches.is_empty());
        // stability is known, and the map at a stuck point has lost two dimensions
        let multipliers = &orbit.stability.as_ref().unwrap().multipliers;
        if orbit.switches.iter().any(|s| s.kind == SwitchKind::Close) {
            let size = |m: &&(f64, f64)| m.0.hypot(m.1) < 1e-9;
            assert!(multipliers.iter().filter(size).count() >= 2, "{multipliers:?}");
        }
        z = orbit.z.clone();
    }
    assert!(touched > 5, "only {touched} orbits touch");
}

/// What a hostile tester met: bodies inside the obstacle from the start, integrators that nothing reads, a body at rest on the obstacle.
#[test]
fn states_and_keys_that_mean_nothing_are_refused() {
    let scene = |method: &str, gap: f64, rest: &str| {
        let text = format!(
            "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = {gap}\n\
             method = \"{method}\"\n{rest}"
        );
        signorini::scenario::Scene::parse(&text, "bar.toml".as_ref()).unwrap()
    };
    let refused = |scene: signorini::scenario::Scene, words: &str| {
        let e = Problem::new(&scene, None).unwrap_err().to_string();
        assert!(e.contains(words), "{words}: {e}");
    };
    for method in ["impact", "moreau-jean", "waves"] {
        refused(scene(method, -0.1, "[run]\nuntil = 1\n"), "penetrates the obstacle by 1.0");
        let wrong = "[run]\nuntil = 1\nintegrator = \"chebyshev\"\n";
        refused(
            scene(method, 0.5, wrong),
            if method == "impact" { "needs a bound" } else { "is not read" },
        );
    }
    refused(scene("nitsche", 0.5, "gamma = 1e15\n"), "rounding errors");
    refused(scene("penalty", 0.5, "stiffness = 1e12\n"), "rounding errors");
    let at_rest = "theta = 0\n[initial]\nequilibrium = true\n";
    refused(scene("nitsche", -0.1, at_rest), "forces with a potential");
    // at rest on the obstacle nothing switches
    for method in ["impact", "waves"] {
        let scene = scene(method, -0.1, "[initial]\nequilibrium = true\n[run]\nuntil = 3\n");
        let p = Problem::new(&scene, None).unwrap();
        let report = signorini::simulate::simulate(&scene, &p, false, &mut Silent).unwrap();
        assert!(report.switches.is_empty(), "{method}: {:?}", report.switches);
        assert_eq!(report.active.count_closed(), 1, "{method}");
    }
}

/// Files name the nodes that are hit, and hold every kind of switch.
#[test]
fn files_of_impacts_name_their_nodes() {
    let folder = tempfile::TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = std::fs::read_to_string(crate::common::root().join("scenarios/bar.toml")).unwrap();
    let text = text.replace("gap = 1.0\n", "gap = 1.0\nmethod = \"impact\"\nrestitution = 0.5\n");
    std::fs::write(at("bar.toml"), text).unwrap();
    let output = crate::common::program()
        .args(["run", &at("bar.toml"), "-o", &at("bar.h5")])
        .output()
        .unwrap();
    assert!(output.status.success());
    let stored = signorini::store::Stored::read(at("bar.h5").as_ref()).unwrap();
    assert_eq!(stored.contact_nodes, [40]);
    assert!(stored.switch_node.iter().all(|n| *n == 40));
    for kind in ["impact", "rest", "open"] {
        assert!(stored.switch_kind.iter().any(|k| k == kind), "{kind}");
    }
    assert!(stored.t.windows(2).all(|t| t[0] < t[1]));
}

/// The bouncing ball: where nothing moves but the end that rebounds, rebounds shrink with every velocity that there is. They are cut off by the largest one so far, and the body
/// comes to rest where it must: pressed against the obstacle by the load.
#[test]
fn rebounds_end_where_nothing_else_moves() {
    let text = |elements: usize, (gap, gravity, e): (f64, f64, f64), damping: &str, until: f64| {
        format!(
            "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{elements}]\nyoung = 0.01\ndensity = 3.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
             [contact]\nedge = \"right\"\ngap = {gap}\nmethod = \"impact\"\nrestitution = {e}\n[[load]]\nkind = \"gravity\"\namplitude = {gravity}\n{damping}\n[run]\nuntil = {until}\n"
        )
    };
    let damped = "[damping]\nrayleigh = [5.0, 0.0]";
    for (elements, contact, damping, until) in [
        (1, (1.0, 0.2, 0.5), "", 20.0),
        (1, (1.0, 0.2, 0.9), "", 60.0),
        (3, (0.5, 20.0, 0.9), damped, 20.0),
    ] {
        let scene = text(elements, contact, damping, until);
        let scene = signorini::scenario::Scene::parse(&scene, "ball.toml".as_ref()).unwrap();
        let p = Problem::new(&scene, None).unwrap();
        let report = signorini::simulate::simulate(&scene, &p, false, &mut Silent).unwrap();
        assert_eq!(report.outcome, Outcome::EndTime, "{elements} elements: {}", report.outcome);
        let e = contact.2;
        // rebounds from one to a millionth of the first velocity, and not many more where the body has motions of its own
        let rebounds = 1.0 + 1e-6f64.ln() / f64::ln(e);
        let count = impacts(&report) as f64;
        assert!(count < 8.0 * rebounds, "{elements} elements, e = {e}: {count} of {rebounds}");
        assert!(report.switches.iter().any(|s| s.kind == SwitchKind::Rest));
        assert!(report.active.touches(0), "{elements} elements: it rests on the obstacle");
        assert!((report.last.u.last().unwrap() - contact.0).abs() < 1e-9);
        // of one element nothing is left to move
        if elements == 1 {
            assert!(report.last.v[0].abs() < 1e-12, "{}", report.last.v[0]);
            assert!((count - rebounds).abs() <= 2.0, "{count} of {rebounds}");
        }
    }
}

/// What a run by steps stores: the times and the last displacements and velocities.
fn stored(folder: &std::path::Path, name: &str, text: &str) -> [Vec<f64>; 2] {
    let (scene, file) = (folder.join(format!("{name}.toml")), folder.join(format!("{name}.h5")));
    std::fs::write(&scene, text).unwrap();
    let output =
        crate::common::run(&["run", scene.to_str().unwrap(), "-q", "-o", file.to_str().unwrap()]);
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let file = crate::common::hdf5_files().open(file).unwrap();
    let t = file.dataset("trajectory/t").unwrap().read_raw::<f64>().unwrap();
    let last = |name: &str| {
        let x = file.dataset(name).unwrap().read_2d::<f64>().unwrap();
        x.row(x.nrows() - 1).to_vec()
    };
    [t, [last("trajectory/u"), last("trajectory/v")].concat()]
}

fn by_steps(scale: f64, initial: &str, run: &str) -> String {
    format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [20]\nyoung = 1.0\ndensity = {}\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = 0.1\nmethod = \"moreau-jean\"\nrestitution = 0.0\nstep = {}\n[initial]\n{initial}\n[run]\n{run}\n",
        scale * scale,
        0.02 * scale
    )
}

/// A sample at the end of a step is that of this step, in any unit of time.
#[test]
fn samples_of_steps_are_not_late() {
    let folder = tempfile::tempdir().unwrap();
    for scale in [1.0, 1e6, 1e-3] {
        let run = format!("until = {}\nsamples = 30", 6.0 * scale);
        let text = by_steps(scale, "displacement = [\"0.1*x\"]", &run);
        let [t, _] = stored(folder.path(), &format!("samples{scale:e}"), &text);
        assert_eq!(t.len(), 31);
        for (k, t) in t.iter().enumerate() {
            assert!((t / scale - 0.2 * k as f64).abs() < 1e-12, "{scale}: {t} for sample {k}");
        }
    }
}

/// A run by steps that ends in contact lies inside the obstacle by what it moves in a step: it goes on from its own file, and one run is two.
#[test]
fn steps_go_on_from_their_own_file() {
    let folder = tempfile::tempdir().unwrap();
    let start = "displacement = [\"-0.3*x\"]";
    let run = |until: f64| format!("until = {until}\nsamples = 10");
    let [_, whole] = stored(folder.path(), "whole", &by_steps(1.0, start, &run(4.0)));
    let [_, first] = stored(folder.path(), "first", &by_steps(1.0, start, &run(2.0)));
    // 20 displacements, the last one at the obstacle
    assert!(first[19] > 0.1 + 1e-6, "it ends inside the obstacle: {}", first[19]);
    let [_, then] = stored(folder.path(), "then", &by_steps(1.0, "file = \"first.h5\"", &run(2.0)));
    for (a, b) in then.iter().zip(&whole) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    // the exact law has no such states
    let exact = by_steps(1.0, "file = \"first.h5\"", &run(2.0));
    let exact = exact.replace("moreau-jean", "impact").replace("step = 0.02\n", "");
    let scene = folder.path().join("exact.toml");
    std::fs::write(&scene, exact).unwrap();
    let output = crate::common::run(&["run", scene.to_str().unwrap(), "-q", "-o", "/dev/null"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("penetrates"), "{said}");
}
