//! Newton's law of impact. Reference numbers: an independent prototype (event-driven modal flow in another language).

mod common;

use common::{problem, reference_problem};
use signorini::contact::{State, System};
use signorini::event::{self, Options, Outcome, Report, Silent, SwitchKind};
use signorini::flow::Tolerances;
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

fn run(system: &System, initial: &State, until: f64, integrator: Integrator) -> Report {
    let options = Options { until, samples: 1, switch_limit: 40.0 };
    let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-12, atol: 1e-15 });
    event::run(system, initial, &options, flow.as_mut(), &mut Silent).unwrap()
}

fn method(e: f64) -> String {
    format!("method = \"impact\"\nrestitution = {e}\n")
}

fn bar(e: f64, n: usize) -> Problem {
    problem(&format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{}\
         [initial]\ndisplacement = [\"-x/0.36\"]\n",
        method(e)
    ))
}

/// The half plate with all displacements of the reference file.
fn half_plate(e: f64) -> Problem {
    let reference = reference_problem("half-plate-10x3");
    let text = reference.text.replace("[contact]\n", &format!("[contact]\n{}", method(e)));
    let text = text.replace("boundary_mass = \"consistent\"\n", "");
    let system = problem(&text).system;
    let paper = &reference.problem.system;
    let (u, v) = reference.problem.initial.full(paper).unwrap();
    let moved =
        |x: &[f64]| system.body.dofs.gather(&paper.body.dofs.scatter(x))[..system.n_o()].to_vec();
    let initial = State { u: moved(&u), v: moved(&v) };
    Problem { system, initial }
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
        let sticks = report.switches.iter().filter(|s| s.kind == SwitchKind::Stick).count();
        println!(
            "e = {e}: {} impacts, {sticks} accumulations, energy {}",
            impacts(&report),
            report.energy_end
        );
        assert!(sticks > 0 || e > 0.9, "e = {e}");
        assert!(report.switches.iter().all(|s| s.energy_jump <= 1e-14), "e = {e}: energy grows");
        assert!(report.energy_drift_total < 1e-10 && report.energy_end < report.energy_start);
    }
    // of a single point rebounds end as a geometric series: each begins with e times the velocity that the last ended with
    let report = {
        let p = bar(0.5, 20);
        run(&p.system, &p.initial, 1.68, Integrator::Modal)
    };
    let rates: Vec<f64> = report.switches.iter().map(|s| s.monitor_rate).collect();
    assert_eq!(report.switches.last().map(|s| s.kind), Some(SwitchKind::Stick));
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
             [initial]\ndisplacement = [\"-0.9*x\", \"0\"]\n[run]\nuntil = 2.0\nintegrator = \"modal\"\n",
            if step > 0.0 { format!("step = {step}\n") } else { String::new() }
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
