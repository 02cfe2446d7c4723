//! Load paths without inertia: a bar on a rough floor in closed form, a block sheared under pressure as an independent program did it.

use std::sync::Arc;

use signorini::event::{Options, Report, Silent};
use signorini::fem::{Course, Spline};
use signorini::problem::Problem;
use signorini::schemes::quasistatic;

use super::super::{Check, Outcome, scene};

/// A body under the loads of a scene, and one more that goes along straight lines.
fn driven(text: &str, load: &str, corners: &[(f64, f64)], until: f64) -> Result<Report, String> {
    let problem = |text: &str| {
        Problem::new(&scene(text, None)?, None).map(|p| p.system).map_err(|e| e.to_string())
    };
    let (mut system, with) = (problem(text)?, problem(&format!("{text}{load}"))?);
    let still = system.loads.constant.clone().unwrap_or_else(|| vec![0.0; system.n()]);
    let all = with.loads.constant.clone().unwrap_or_default();
    let force = all.iter().zip(&still).map(|(a, b)| a - b).collect();
    let (times, values) = corners.iter().copied().unzip();
    let course = Course::Measured(Arc::new(Spline::new(times, values)));
    system.loads_mut().follow(force, 0, &course);
    let options = Options { until, samples: 1, switch_limit: 40.0 };
    let report = quasistatic::run(&system, None, &options, &mut Silent);
    let report = report.map_err(|e| e.to_string())?;
    match report.outcome.is_complete() {
        true => Ok(report),
        false => Err(report.outcome.to_string()),
    }
}

fn work(r: &Report) -> f64 {
    r.rubbed.as_ref().map_or(f64::NAN, |r| r.work())
}

/// Pressed by 0.2, sheared to 0.08 and 0.09.
fn block() -> Outcome {
    let text = "[body]\nkind = \"plate\"\nsize = [0.25, 1.0]\nelements = [6, 12]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[contact]\nedge = \"right\"\ngap = 0.0\nfriction = 0.5\n[[load]]\nkind = \"traction\"\nedge = \"left\"\namplitude = [0.2, 0.0]\n";
    let load = "[[load]]\nkind = \"traction\"\nedge = \"left\"\namplitude = [0.0, 1.0]\n";
    let mut checks = vec![];
    for (shear, lost) in [(0.08, 2.516_451_067e-5), (0.09, 2.545_739_990e-4)] {
        let report = driven(text, load, &[(0.0, 0.0), (1.0, 1.0)], shear)?;
        let name = format!("sheared block at {shear}: friction");
        checks.push(Check::near(name, work(&report), lost, 1e-9));
        let drift = report.energy_drift_total;
        checks.push(Check::at_most(format!("sheared block at {shear}: ledger"), drift, 1e-12));
    }
    Ok(checks)
}

/// `EA = 1`, friction `q = 1/2` a length, pulled by `F = 0.3`: the end goes to `F²/2qEA`, half of it stays, a cycle of ±F takes `2F³/3qEA + h²/20`.
fn bar() -> Outcome {
    let (m, f, q) = (10, 0.3, 0.5);
    let h = 1.0 / m as f64;
    let slider = |k: usize| {
        let share = if k == 0 || k == m { 0.5 } else { 1.0 };
        format!("[[slider]]\nat = [{:?}]\nlimit = {:?}\n", k as f64 * h, share * q * h)
    };
    let sliders: String = (0..=m).map(slider).collect();
    let text = format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{m}]\nyoung = 1.0\ndensity = 1.0\n{sliders}"
    );
    let load = format!("[[load]]\nkind = \"point\"\nat = [1.0]\namplitude = {f}\n");
    let corners = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (3.0, -1.0), (5.0, 1.0)];
    let at = |t: f64| driven(&text, &load, &corners, t);
    let (pulled, unloaded, again) = (at(1.0)?, at(2.0)?, at(5.0)?);
    let cycle = work(&again) - work(&pulled);
    let closed = 2.0 * f * f * f / (3.0 * q) + 0.05 * h * h;
    Ok(vec![
        Check::near("bar on a rough floor: its end, pulled", pulled.last.u[m], 0.09, 1e-13),
        Check::near("bar on a rough floor: its end, let go", unloaded.last.u[m], 0.045, 1e-13),
        Check::near("bar on a rough floor: friction in a cycle", cycle, closed, 1e-13),
    ])
}

pub fn run() -> Outcome {
    let mut checks = block()?;
    checks.extend(bar()?);
    Ok(checks)
}
