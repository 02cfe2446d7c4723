//! What a run says of itself is what is proved: errors of modes, ends before time, causes of a drift.

use std::convert::Infallible;
use std::ops::ControlFlow;

use crate::common::{problem, root};
use signorini::contact::State;
use signorini::continuation::Go;
use signorini::event::{self, Observer, Options, Outcome, Report, Sample, Silent};
use signorini::flow::Tolerances;
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{Summary, Track, Walk, sequential};
use signorini::hbm::{Form, Reduction};
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};
use signorini::simulate::by_name;

/// The two masses before their spring, of which damping knows nothing: stiffness of the spring, and `β`.
fn two_masses(stiffness: f64, beta: f64) -> Problem {
    let path = root().join("scenarios/two-mass-stop.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text
        .replace("stiffness = 10.0", &format!("stiffness = {stiffness:e}"))
        .replace("[0.0, 0.06]", &format!("[0.0, {beta:e}]"));
    Problem::new(&Scene::parse(&text, &path).unwrap(), None).unwrap()
}

fn run(p: &Problem, state: &State, until: f64, integrator: Integrator) -> Report {
    let options = Options { until, samples: 3, switch_limit: 1e3 };
    let mut flow = by_name(integrator, &p.system, Tolerances { rtol: 1e-13, atol: 1e-16 });
    event::run(&p.system, state, &options, flow.as_mut(), &mut Silent).unwrap()
}

/// Where two complex modes of the closed phase become one: `(λ² + λβK + K + k)` has a double root at these numbers (Newton's method on its discriminant). What the
/// modes err by is told, is not less than what they do err by, and ends the certificate before it is seen in a switch.
#[test]
fn nearly_dependent_modes_tell_their_error() {
    let (k, beta) = (2.927_050_983_124_841_5, 0.743_496_068_920_368_7);
    let state = State { u: vec![1.6, 1.5], v: vec![0.2, 0.1] };
    let mut told = vec![];
    for off in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13] {
        let p = two_masses(k * (1.0 + off), beta);
        let exact = run(&p, &state, 0.6, Integrator::Modal);
        let steps = run(&p, &state, 0.6, Integrator::Dop853);
        assert!(steps.outcome.is_complete() && steps.phases == 1, "{} phases", steps.phases);
        if !exact.outcome.is_complete() {
            println!("{off:e}: {}", exact.outcome);
            continue;
        }
        let of = |r: &Report| [r.last.u.clone(), r.last.v.clone()].concat();
        let error =
            of(&exact).iter().zip(of(&steps)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!(
            "{off:e}: error {error:.1e}, told {:.1e}, certified {}",
            exact.proof.state_error,
            exact.is_certified()
        );
        // gaps and pressures are told over their sizes, which are above one; the steps err by 1e-13
        assert!(
            error <= 20.0 * exact.proof.state_error + 2e-13,
            "{off:e}: {error:e} {:e}",
            exact.proof.state_error
        );
        assert_eq!(exact.is_certified(), exact.proof.state_error <= 1e-4);
        told.push(exact.proof.state_error);
    }
    assert!(told.len() >= 4 && told[0] < 1e-12, "{told:?}");
    assert!(told.iter().fold(0.0f64, |m, x| m.max(*x)) > 1e3 * told[0], "{told:?}");
}

/// Stops at the first window behind a time.
struct Until(f64);

impl Observer for Until {
    type Error = Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Infallible> {
        Ok(())
    }
    fn progress(&mut self, t: f64) -> Result<ControlFlow<()>, Infallible> {
        Ok(if t > self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }
}

/// A run that ended before its time is not certified; what it did is proved.
#[test]
fn a_run_that_ended_early_is_not_certified() {
    let p = problem(
        "[body]\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.1\n\
         [initial]\nvelocity = ['3*x', '0.1*x']\n",
    );
    let options = Options { until: 8.0, samples: 3, switch_limit: 40.0 };
    for integrator in [Integrator::Modal, Integrator::Chebyshev] {
        let flow = || by_name(integrator, &p.system, Tolerances { rtol: 1e-9, atol: 1e-12 });
        let whole =
            event::run(&p.system, &p.initial, &options, flow().as_mut(), &mut Silent).unwrap();
        assert!(whole.is_certified() && whole.proof.holds());
        assert!(
            whole.proof.state_error > 0.0 && whole.proof.state_error < 1e-10,
            "{:e}",
            whole.proof.state_error
        );
        let part =
            event::run(&p.system, &p.initial, &options, flow().as_mut(), &mut Until(3.0)).unwrap();
        assert!(matches!(part.outcome, Outcome::Interrupted { .. }), "{}", part.outcome);
        assert!(part.proof.holds() && !part.is_certified());
        assert!(part.t_end > 3.0 && part.t_end < 8.0);
    }
}

/// Twelve masses in a chain, three before stops, a harmonic force on one of these: the inertia that the method leaves out is named, not the digits.
#[test]
fn an_inertia_that_is_left_out_is_named() {
    let place = tempfile::tempdir().unwrap();
    let n = 12;
    let mut k = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}\n", 2 * n - 1);
    let mut m = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {n}\n");
    for i in 1..=n {
        k += &format!("{i} {i} {}\n", if i == n { 1.0 } else { 2.0 });
        m += &format!("{i} {i} 1.0\n");
        if i > 1 {
            k += &format!("{i} {} -1.0\n", i - 1);
        }
    }
    std::fs::write(place.path().join("K.mtx"), k).unwrap();
    std::fs::write(place.path().join("M.mtx"), m).unwrap();
    let scene = |contact: &str| {
        let text = format!(
            "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n\
             [contact]\ndisplacements = [5, 8, 11]\ngap = 0.2\n{contact}\n[damping]\nrayleigh = [0.0, 0.5]\n\
             [[load]]\nkind = \"force\"\ndisplacement = 11\namplitude = 0.01\nomega = 0.11\n\
             [run]\nuntil = 60.0\nsamples = 10\n[orbit]\nrange = [0.11, 0.4]\n"
        );
        let path = place.path().join("m.toml");
        std::fs::write(&path, text).unwrap();
        path
    };
    let said = |command: &str, path: &std::path::Path, more: &[&str]| {
        let output = crate::common::program()
            .arg(command)
            .arg(path)
            .args(more)
            .args(["-o", place.path().join(format!("{command}.h5")).to_str().unwrap(), "--force"])
            .output()
            .unwrap();
        let all = [output.stdout, output.stderr].concat();
        let text = String::from_utf8_lossy(&all).replace('│', " ");
        text.split_whitespace().collect::<Vec<&str>>().join(" ")
    };
    let remedy = "inertia = \"constant\" or method = \"mass-redistribution\"";
    let path = scene("stress = \"reaction\"");
    let run = said("run", &path, &[]);
    assert!(run.contains("WARNING") && run.contains(remedy), "{run}");
    assert!(!run.contains("frequencies so far apart"), "{run}");
    let response = said("response", &path, &["--method", "shooting", "--points", "3"]);
    assert!(response.contains("energy balance") && response.contains(remedy), "{response}");
    let run = said("run", &scene("stress = \"reaction\"\ninertia = \"constant\""), &[]);
    assert!(!run.contains("WARNING") && run.contains("proved complete"), "{run}");
}

/// The monitors of harmonic balance have a slack in their own units: the balance of a body that is softer, and lighter, by sixteen orders is the same.
#[test]
fn a_soft_body_has_the_same_balance() {
    let text = std::fs::read_to_string(root().join("scenarios/half-plate-orbit.toml")).unwrap();
    let solved = |unit: f64| {
        let text = text
            .replace("young = 1.0", &format!("young = {unit:e}"))
            .replace("density = 1.0", &format!("density = {unit:e}"));
        let system = problem(&text).system;
        let mut r = Reduction::new(system, Form::Force).unwrap();
        let grid: Vec<f64> = (0..6).map(|k| 1.59 + 0.005 * f64::from(k)).collect();
        let mut found = vec![];
        let mut tracks = vec![Track::default(); 2];
        let settings = Settings::default();
        let walk = Walk::new(&[1], &grid, &settings);
        sequential(&mut r, &walk, &mut tracks, |r, p| {
            if let Ok(s) = &p.solution {
                found.push((s.crossings.len(), Summary::new(r, s).unwrap().energy / unit));
            }
            Go::Continue(())
        })
        .unwrap();
        found
    };
    let (hard, soft) = (solved(1.0), solved(1e-16));
    assert!(!hard.is_empty());
    assert_eq!(hard.len(), soft.len(), "{hard:?} {soft:?}");
    for (a, b) in hard.iter().zip(&soft) {
        assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-8 * a.1, "{hard:?} {soft:?}");
    }
}
