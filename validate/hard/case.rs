//! Hard cases: grazing, simultaneous switches, prestressed and resting contact, long times, contrasts, and random states: ten
//! thousand through the three integrators, which share the operators of a phase, the search for switches and the choice of the next
//! set; and a hundred thousand against an integration that shares nothing with the program but the matrices ([`independent`]).

mod agreement;
mod bodies;
mod independent;
mod witness;

pub use independent::MILLION;

use rayon::prelude::*;

use signorini::contact::State;
use signorini::contact::phase_modes;
use signorini::event::{self, GrazingKind, Options, Report, Silent};
use signorini::flow::{Flow, Tolerances};
use signorini::problem::Problem;
use signorini::scenario::{Components, Field, Integrator, Scene};
use signorini::simulate::by_name;

use super::oscillator::closed_form;
use super::{Case, Check, Effort, Outcome, integrate, scene};

pub const CASE: Case = Case {
    name: "hard",
    title: "hard cases of contact: grazing, simultaneity, rest, prestress, long times, contrasts, random states",
    source: "closed forms, equilibria, symmetry, agreement of three integrators, and of an independent one from the matrices alone",
    only_by_name: false,
    run,
};

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    grazing(&mut checks)?;
    long_times(effort, &mut checks)?;
    simultaneous(&mut checks)?;
    equilibria(&mut checks)?;
    contrasts(&mut checks)?;
    random_states(effort, &mut checks)?;
    independent::against_witness(if effort.short { 1_000 } else { 100_000 }, &mut checks)?;
    Ok(checks)
}

fn with_displacement(text: &str, fields: &[&str]) -> Result<Scene, String> {
    let mut scene = scene(text, None)?;
    scene.initial.displacement = Some(Components::Everywhere(
        fields.iter().map(|f| Field::parse(f)).collect::<Result<_, _>>()?,
    ));
    Ok(scene)
}

/// Amplitudes just below, at and just above the gap, down to one part in 10¹².
fn grazing(checks: &mut Vec<Check>) -> Result<(), String> {
    for excess in [-1e-3, -1e-6, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
        let a = 0.5 * (1.0 + excess);
        let scene = with_displacement(include_str!("grazing.toml"), &[&format!("-{a:e}*x")])?;
        let (_, report, _) = integrate(&scene)?;
        let name = |what: &str| format!("touch by {excess:+.0e} of the gap: {what}");
        let (state, switches) = if excess > 0.0 {
            closed_form(a, report.t_end)
        } else {
            let w = 0.75f64.sqrt();
            let t = report.t_end;
            ((-a * (w * t).cos(), a * w * (w * t).sin()), vec![])
        };
        let error = (report.last.u[0] - state.0).abs().max((report.last.v[0] - state.1).abs());
        checks.push(Check::at_most(name("final state"), error, 1e-10));
        if excess.abs() > 1e-10 {
            let count = report.switches.len() as f64;
            checks.push(Check::near(name("switches"), count, switches.len() as f64, 0.0));
        }
        if (-1e-9..=0.0).contains(&excess) {
            let seen = report.grazings.iter().any(|g| {
                matches!(
                    g.kind,
                    GrazingKind::NearMiss | GrazingKind::Undecided | GrazingKind::Decided
                )
            });
            let told = if seen || !report.switches.is_empty() { 1.0 } else { 0.0 };
            checks.push(Check::near(name("recorded"), told, 1.0, 0.0));
        }
    }
    Ok(())
}

/// Thousands of periods of the oscillator: the ledger closes, the period does not drift.
fn long_times(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let mut scene = with_displacement(include_str!("grazing.toml"), &["-x"])?;
    let until = if effort.short { 2e3 } else { 2e4 };
    if let Some(run) = &mut scene.run {
        run.until = Some(until);
    }
    let (_, report, _) = integrate(&scene)?;
    let ((u, v), switches) = closed_form(1.0, until);
    let error = (report.last.u[0] - u).abs().max((report.last.v[0] - v).abs());
    let periods = switches.len() / 2;
    checks.push(Check::near(
        format!("{periods} periods: switches"),
        report.switches.len() as f64,
        switches.len() as f64,
        0.0,
    ));
    checks.push(Check::at_most(format!("{periods} periods: final state"), error, 1e-12 * until));
    let drift =
        report.switches.iter().zip(&switches).map(|(s, t)| (s.t - t).abs()).fold(0.0, f64::max);
    checks.push(Check::at_most(
        format!("{periods} periods: drift of switching times"),
        drift,
        1e-12 * until,
    ));
    checks.push(Check::at_most(
        format!("{periods} periods: energy drift over the number of phases"),
        report.energy_drift_total / report.phases as f64,
        1e-10,
    ));
    Ok(())
}

/// Pairs on a symmetric plate; all nodes of a strip.
fn simultaneous(checks: &mut Vec<Check>) -> Result<(), String> {
    let scene_ = scene(include_str!("symmetric.toml"), None)?;
    let (problem, report, states) = integrate(&scene_)?;
    let body = &problem.system.body;
    let [_, height, _] = body.mesh.size();
    let mirror: Vec<usize> = body
        .mesh
        .nodes()
        .iter()
        .map(|p| body.mesh.nearest_node([p[0], height - p[1], 0.0]))
        .collect();
    let asymmetry = |u: &[f64]| {
        let nodal = body.dofs.scatter(u);
        (0..mirror.len())
            .map(|n| {
                let m = mirror[n];
                (nodal[2 * n] - nodal[2 * m]).abs().max((nodal[2 * n + 1] + nodal[2 * m + 1]).abs())
            })
            .fold(0.0, f64::max)
    };
    let worst = states.u.iter().map(|u| asymmetry(u)).fold(0.0, f64::max);
    checks.push(Check::at_most("symmetric plate, 50 periods: loss of symmetry", worst, 1e-10));
    checks.push(Check::near(
        "symmetric plate: missed switches",
        report.proof.missed as f64,
        0.0,
        0.0,
    ));

    let strip = scene(include_str!("../strip/scene.toml"), Some(&[20, 6]))?;
    let mut strip = strip;
    if let Some(run) = &mut strip.run {
        run.integrator = Integrator::Modal;
    }
    let (_, report, _) = integrate(&strip)?;
    let spread = |kind| {
        let times = report.switches.iter().filter(|s| s.kind == kind).map(|s| s.t);
        let (a, b) =
            times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        b - a
    };
    use signorini::event::SwitchKind::{Close, Open};
    checks.push(Check::near(
        "strip: all seven nodes close and open",
        report.switches.len() as f64,
        14.0,
        0.0,
    ));
    checks.push(Check::at_most(
        "strip: spread of their times",
        spread(Close).max(spread(Open)),
        1e-10,
    ));
    Ok(())
}

/// Prestressed and resting contact stay as they are; a bar that is suddenly lighter springs off.
fn equilibria(checks: &mut Vec<Check>) -> Result<(), String> {
    let (_, report, states) = integrate(&scene(include_str!("prestressed.toml"), None)?)?;
    let speed = report.last.v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let pressure = states.pressure.iter().flatten().map(|p| (p - 0.1).abs()).fold(0.0, f64::max);
    checks.push(Check::near("prestressed bar: switches", report.switches.len() as f64, 0.0, 0.0));
    checks.push(Check::at_most("prestressed bar: speed after 100 units of time", speed, 1e-13));
    checks.push(Check::at_most("prestressed bar: |pressure − 0.1|", pressure, 1e-13));

    let standing = scene(include_str!("resting.toml"), None)?;
    let (_, report, _) = integrate(&standing)?;
    let speed = report.last.v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    checks.push(Check::near("standing bar: switches", report.switches.len() as f64, 0.0, 0.0));
    checks.push(Check::at_most("standing bar: speed after 60 units of time", speed, 1e-12));
    let mut lighter = standing;
    if let Some(load) = lighter.loads.first_mut() {
        load.amplitude = Some(signorini::scenario::Amplitude::Scalar(-0.3));
    }
    let (_, report, _) = integrate(&lighter)?;
    let first = report.switches.first().is_some_and(|s| s.kind == event::SwitchKind::Open);
    checks.push(Check::near(
        "bar made lighter: it leaves the floor first",
        f64::from(u8::from(first)),
        1.0,
        0.0,
    ));
    checks.push(Check::at_most("bar made lighter: penetration", report.max_penetration, 1e-13));
    Ok(())
}

/// Extreme shapes and materials: exact flow and Dormand–Prince agree.
fn contrasts(checks: &mut Vec<Check>) -> Result<(), String> {
    let mut scene_ = scene(include_str!("slender.toml"), None)?;
    let (_, exact, _) = integrate(&scene_)?;
    if let Some(run) = &mut scene_.run {
        run.integrator = Integrator::Dop853;
    }
    let (_, stepped, _) = integrate(&scene_)?;
    let size = exact.last.u.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let distance = exact.last.u.iter().zip(&stepped.last.u).map(|(a, b)| (a - b).abs());
    checks.push(Check::near(
        "slender steel: switches, modal − dop853",
        exact.switches.len() as f64 - stepped.switches.len() as f64,
        0.0,
        0.0,
    ));
    checks.push(Check::at_most(
        "slender steel: modal − dop853, relative",
        distance.fold(0.0, f64::max) / size,
        1e-7,
    ));
    Ok(())
}

/// Numbers in [−1, 1) from a seed (splitmix64).
fn random(n: usize, seed: u64) -> Vec<f64> {
    let mut s = seed;
    let mut next = || {
        s = s.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = s;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    (0..n).map(|_| (next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0).collect()
}

/// The same switches in the same order?
fn same(a: &Report, b: &Report, tolerance: f64) -> bool {
    a.switches.len() == b.switches.len()
        && a.switches.iter().zip(&b.switches).all(|(x, y)| {
            // simultaneous switches may be listed in either order
            let twin = || {
                b.switches.iter().any(|y| {
                    y.point == x.point && y.kind == x.kind && (x.t - y.t).abs() < tolerance
                })
            };
            (x.point == y.point && x.kind == y.kind && (x.t - y.t).abs() < tolerance) || twin()
        })
}

fn random_states(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let scene_ = scene(include_str!("random.toml"), None)?;
    let problem = Problem::new(&scene_, None).map_err(|e| e.to_string())?;
    let system = &problem.system;
    let open = system.open_phase();
    let modes = phase_modes(system, &open, 6).map_err(|e| e.to_string())?;
    let count: u64 = if effort.short { 400 } else { 10_000 };
    let options = Options { until: 4.0, samples: 1, switch_limit: 40.0 };
    let tight = Tolerances { rtol: 1e-12, atol: 1e-15 };
    // chunks keep the eigenbases of a thread's exact flow
    let chunk = 100;
    let results: Result<Vec<[u64; 5]>, String> = (0..count / chunk)
        .into_par_iter()
        .map(|c| {
            let flow = |i| by_name(i, system, tight);
            let (mut modal, mut chebyshev) = (flow(Integrator::Modal), flow(Integrator::Chebyshev));
            // switches, missed, chebyshev differs, dop853 differs, of these at no recorded grazing
            let mut tally = [0u64; 5];
            for seed in c * chunk..(c + 1) * chunk {
                let weights = random(12, seed);
                let mut state = State { u: vec![0.0; system.n_o()], v: vec![0.0; system.n_o()] };
                for (k, shape) in modes.shapes.iter().enumerate() {
                    for (j, x) in shape.iter().enumerate() {
                        state.u[j] += weights[k] * x / (1.0 + k as f64);
                        state.v[j] += weights[6 + k] * x;
                    }
                }
                let solve = |flow: &mut dyn Flow| -> Result<Report, String> {
                    let report = event::run(system, &state, &options, flow, &mut Silent)
                        .map_err(|e| e.to_string())?;
                    if report.outcome.is_complete() {
                        Ok(report)
                    } else {
                        Err(report.outcome.to_string())
                    }
                };
                let exact = solve(modal.as_mut())?;
                let other = solve(chebyshev.as_mut())?;
                let stepped = solve(flow(Integrator::Dop853).as_mut())?;
                let repeated =
                    exact.switches.windows(2).filter(|w| w[0].after != w[1].before).count();
                tally[0] += exact.switches.len() as u64;
                tally[1] +=
                    (exact.proof.missed + other.proof.missed + stepped.proof.missed + repeated)
                        as u64;
                let (c, d) = (!same(&exact, &other, 1e-8), !same(&exact, &stepped, 1e-7));
                tally[2] += u64::from(c);
                tally[3] += u64::from(d);
                let grazed = [&exact, &other, &stepped].iter().any(|r| !r.grazings.is_empty());
                tally[4] += u64::from((c || d) && !grazed);
            }
            Ok(tally)
        })
        .collect();
    let sum = results?.iter().fold([0u64; 5], |mut s, t| {
        s.iter_mut().zip(t).for_each(|(s, t)| *s += t);
        s
    });
    let name = |what: &str| format!("{count} random states: {what}");
    checks.push(Check::at_least(name("switches in all"), sum[0] as f64, 3.0 * count as f64));
    checks.push(Check::near(name("missed or repeated switches"), sum[1] as f64, 0.0, 0.0));
    checks.push(Check::near(name("modal and chebyshev differ"), sum[2] as f64, 0.0, 0.0));
    checks.push(Check::near(name("modal and dop853 differ"), sum[3] as f64, 0.0, 0.0));
    checks.push(Check::near(name("differences at no recorded grazing"), sum[4] as f64, 0.0, 0.0));
    Ok(())
}
