//! A plane-stress strip whose lateral edges are rollers carries the bar's closed form with modulus `E/(1−ν²)`; for `ν = 0`
//! so does one with free edges. On any mesh the strip must then move exactly as the bar with the same number of
//! elements along x: all its contact nodes switch at one time.

use super::{Case, Check, Effort, Outcome, integrate, nodal_x, scene};

pub const CASE: Case = Case {
    name: "strip",
    title: "plane-stress strip on rollers moves as a bar",
    source: "closed form of the bar with modulus E/(1 − ν²)",
    only_by_name: false,
    run,
};

fn run(effort: Effort) -> Outcome {
    let meshes: &[[usize; 2]] =
        if effort.short { &[[20, 2]] } else { &[[20, 2], [40, 3], [80, 1]] };
    let mut checks = vec![];
    for &[nx, ny] in meshes {
        let bar = scene(include_str!("../bar/scene.toml"), Some(&[nx]))?;
        let (bar_problem, bar_report, bar_states) = integrate(&bar)?;
        for free in [false, true] {
            let mut strip = scene(include_str!("scene.toml"), Some(&[nx, ny]))?;
            let kind = if free { "free edges, ν = 0" } else { "rollers" };
            if free {
                strip.supports.truncate(2); // the roller below stops the rigid motion along y
                (strip.body.young, strip.body.poisson) = (Some(1.0), Some(0.0));
            }
            let name = format!("{nx} × {ny}, {kind}");
            let (problem, report, states) = integrate(&strip)?;
            let mut worst = 0.0f64;
            for t in [0.84, 1.68, 2.52, 3.36] {
                for i in 0..=nx {
                    let exact = nodal_x(&bar_problem, bar_states.at(t), i);
                    for j in 0..=ny {
                        let u = nodal_x(&problem, states.at(t), i * (ny + 1) + j);
                        worst = worst.max((u - exact).abs());
                    }
                }
            }
            checks.push(Check::at_most(format!("{name}: distance to the bar"), worst, 2e-7));
            let times = |r: &signorini::event::Report| -> Vec<f64> {
                r.switches.iter().map(|s| s.t).collect()
            };
            let bar_times = times(&bar_report);
            let spread = times(&report)
                .iter()
                .map(|t| bar_times.iter().map(|b| (t - b).abs()).fold(f64::INFINITY, f64::min))
                .fold(0.0, f64::max);
            let expected = (bar_times.len() * (ny + 1)) as f64;
            let count = report.switches.len() as f64;
            checks.push(Check::near(format!("{name}: switches"), count, expected, 0.0));
            checks.push(Check::at_most(format!("{name}: switching times"), spread, 1e-8));
        }
    }
    Ok(checks)
}
