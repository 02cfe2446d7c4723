//! The continuum of the uniform bar by waves: against closed forms.

use signorini::event::{Report, Silent};
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::simulate;

fn run(body: &str, contact: &str, initial: &str, until: f64) -> Report {
    let text = format!(
        "[body]\nkind = \"bar\"\n{body}[[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\n\
         method = \"waves\"\n{contact}[initial]\n{initial}[run]\nuntil = {until}\nsamples = 37\n"
    );
    let scene = Scene::parse(&text, "bar.toml".as_ref()).unwrap();
    let p = Problem::new(&scene, None).unwrap();
    let report = simulate(&scene, &p, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete() && report.energy_drift_total < 1e-11);
    report
}

fn bar(n: usize) -> String {
    format!("size = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n")
}

/// The far point `u = −2αx` of the first nonsmooth mode of period `T`.
fn far(period: f64) -> String {
    format!("displacement = [\"-{:.17}*x\"]\n", 1.0 / (period - 3.0))
}

fn off(report: &Report, exact: impl Fn(f64) -> f64) -> f64 {
    let n = report.last.u.len();
    let of = |k: usize| exact((k + 1) as f64 / n as f64);
    let size = (0..n).map(|k| of(k).abs()).fold(0.0, f64::max);
    (0..n).map(|k| (report.last.u[k] - of(k)).abs()).fold(0.0, f64::max) / size
}

/// The family of nonsmooth modes in closed form: contact from `t = (T − t_c)/2` on, `t_c = 4 − T`; after every period the far point again.
#[test]
fn nonsmooth_modes_of_the_bar_come_back() {
    for period in [3.05, 3.2, 3.36, 3.5, 3.7, 3.9] {
        for n in [10, 20, 40] {
            let report = run(&bar(n), "gap = 1.0\n", &far(period), 10.0 * period);
            let e = off(&report, |x| -x / (period - 3.0));
            assert!(e < 1e-11, "T = {period}, {n} elements, ten periods: {e:e}");
            assert_eq!(report.switches.len(), 20);
            let first = report.switches[0].t;
            assert!((first - (period - 2.0)).abs() < 1e-13, "T = {period}: {first}");
            assert!((report.switches[1].t - 2.0).abs() < 1e-13);
            assert_eq!(report.max_penetration, 0.0);
            let alpha = 0.5 / (period - 3.0);
            assert!((report.energy_end - 2.0 * alpha * alpha).abs() < 1e-11 * report.energy_end);
        }
    }
}

/// Half a period, by d'Alembert: behind the front from the support `u = 2αx`, behind that from the contact `1 + 2α(1 − x)`; they meet at `x = T/2 − 1`.
#[test]
fn half_a_period_is_that_of_the_closed_form() {
    for period in [3.2, 3.36, 3.7] {
        for n in [10, 20, 40] {
            let report = run(&bar(n), "gap = 1.0\n", &far(period), 0.5 * period);
            let slope = 1.0 / (period - 3.0);
            let e = off(&report, |x| (slope * x).min(1.0 + slope * (1.0 - x)));
            assert!(e < 1e-14, "T = {period}, {n} elements: {e:e}");
        }
    }
}

/// With decisions once an element's travel time: exact where contact closes at such a time, stopped early elsewhere.
#[test]
fn wave_finite_elements_stop_at_their_own_times() {
    let step = "gap = 1.0\ninstants = \"step\"\n";
    for n in [25, 50] {
        let report = run(&bar(n), step, &far(3.36), 3.36);
        let e = off(&report, |x| -x / 0.36);
        assert!(e < 1e-12, "{n} elements: {e:e}");
    }
    for n in [10, 20, 40, 80] {
        let report = run(&bar(n), step, &far(3.36), 1.68);
        let end = report.last.u[n - 1];
        // it stops before the obstacle: by the rest of the last step
        let rest = (1.36 * n as f64).fract();
        let short = rest / n as f64 / 0.36;
        assert!((1.0 - end - short).abs() < 1e-12, "{n} elements: {end} {short}");
    }
}

/// Other units, a contact on the left, a velocity at the start, a run that is interrupted nowhere: the same motion.
#[test]
fn units_and_sides_do_not_matter() {
    let here = run(&bar(12), "gap = 1.0\n", &far(3.3), 5.0);
    let (l, e, rho) = (2.5, 7.0, 0.3);
    let time = l / f64::sqrt(e / rho);
    let body = format!("size = [{l}]\nelements = [12]\nyoung = {e}\ndensity = {rho}\narea = 0.2\n");
    let far = format!("displacement = [\"-{:.17}*x\"]\n", 0.01 / l / 0.3);
    let there = run(&body, "gap = 0.01\n", &far, 5.0 * time);
    for (a, b) in here.last.u.iter().zip(&there.last.u) {
        assert!((a - b / 0.01).abs() < 1e-11, "{a} {b}");
    }
    let text = format!(
        "[body]\nkind = \"bar\"\n{}[[support]]\nedge = \"right\"\nfix = [\"x\"]\n[contact]\nedge = \"left\"\n\
         method = \"waves\"\ngap = 1.0\n[initial]\ndisplacement = [\"{:.17}*(1 - x)\"]\n[run]\nuntil = 5.0\n",
        bar(12),
        1.0 / 0.3
    );
    let scene = Scene::parse(&text, "bar.toml".as_ref()).unwrap();
    let p = Problem::new(&scene, None).unwrap();
    let report = simulate(&scene, &p, false, &mut Silent).unwrap();
    assert_eq!(report.switches.len(), here.switches.len());
    for (a, b) in report.last.u.iter().zip(here.last.u.iter().rev()) {
        assert!((a + b).abs() < 1e-12, "{a} {b}");
    }
}

/// A velocity at the start is its mean over each element: the one at the support, which rests, has half of it.
#[test]
fn a_bar_thrown_against_the_obstacle() {
    let report = run(&bar(16), "gap = 0.3\n", "velocity = [\"1\"]\n", 1.5);
    // the end moves at speed one until it is stopped
    let close = report.switches[0].t;
    assert!((close - 0.3).abs() < 1e-13, "{close}");
    assert!((report.energy_end - 0.5 * 15.25 / 16.0).abs() < 1e-13, "{}", report.energy_end);
}

/// What waves do not know is refused.
#[test]
fn other_bodies_are_refused() {
    let refused = |change: (&str, &str), words: &str| {
        let text = format!(
            "[body]\nkind = \"bar\"\n{}[[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\n\
             gap = 1.0\nmethod = \"waves\"\n[run]\nuntil = 1.0\n",
            bar(4)
        );
        assert!(text.contains(change.0));
        let scene = Scene::parse(&text.replace(change.0, change.1), "bar.toml".as_ref()).unwrap();
        let e = Problem::new(&scene, None).unwrap_err().to_string();
        assert!(e.contains(words), "{words}: {e}");
    };
    refused(("[run]", "[damping]\nrayleigh = [0.1, 0]\n[run]"), "carries unchanged");
    let load = "[[load]]\nkind = \"gravity\"\namplitude = 1\n[run]";
    refused(("[run]", load), "without loads");
    refused(("[run]", "[initial]\ndisplacement = [\"2*x\"]\n[run]"), "penetrates the obstacle");
}
