//! Forced, damped half plate: peaks, and stability told by 200 periods of time integration.
//!
//! `F₀ = 3·2ξω₁²q_gr` (a linear peak of three times grazing), `C = βK` with ξ at mode 1, ω from 1.2 to 2.1. Peaks of an independent
//! harmonic balance with eleven harmonics: 1.751 (5 %), 1.707 (2 %), 1.666 (1 %), 1.645 (0.5 %), ±0.01. From some thirty points of each
//! branch a state 10⁻⁵ away is integrated for 200 periods: it must come back where the multipliers say stable, and leave where they say
//! unstable (with multipliers from 0.99 to 1.04 200 periods decide nothing; there either is accepted, and so it is where the disturbance reaches over a
//! grazing, `√10⁻⁵` away: multipliers are those of one side).

use std::f64::consts::TAU;

use signorini::continuation::Go;
use signorini::orbit::Propagator;
use signorini::orbit::along::section_of;
use signorini::orbit::period_map::integrate;
use signorini::orbit::section::at_origin;
use signorini::problem::Problem;
use signorini::records::PointRecord;

use super::{Case, Check, Effort, Outcome, forced_response, scene};

pub const CASE: Case = Case {
    name: "forced",
    title: "forced half plate: peaks of four damping ratios, stability against 200 periods in time",
    source: "peaks: independent harmonic balance with eleven harmonics",
    only_by_name: false,
    run,
};

const PEAKS: [(f64, f64); 4] = [(0.05, 1.751), (0.02, 1.707), (0.01, 1.666), (0.005, 1.645)];

/// Unstable points that must be met on every branch.
const UNSTABLE: f64 = 2.0;

/// Orbits this near to a grazing, over the gap, are those of one side only.
const NEAR_GRAZING: f64 = 3e-3;

/// Points of a branch that are disturbed.
const DISTURBED: usize = 30;

fn body(ratio: f64) -> Result<Propagator, String> {
    let mut scene = scene(include_str!("../../scenarios/half-plate-response.toml"), None)?;
    if let Some(damping) = &mut scene.damping {
        damping.ratio = Some(ratio);
    }
    let problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
    Propagator::new(problem.system).map_err(|e| e.to_string())
}

/// Whether a disturbed state behaves as the multipliers say; none where they are too near to the unit circle.
fn behaves(body: &mut Propagator, p: &PointRecord) -> Result<Option<bool>, String> {
    let (Some(orbit), Some(place)) = (&p.orbit, &p.place) else { return Ok(None) };
    body.system.loads_mut().set_frequency(p.omega);
    let (size, section) = (2 * body.n(), (section_of(place), 1));
    let z = &at_origin(body, &place.x[..size], p.omega, section).map_err(|e| e.to_string())?;
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = norm(z);
    let distance =
        |y: &[f64]| y.iter().zip(z).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size;
    let noise: Vec<f64> = (0..z.len()).map(|i| (i as f64 * 1.618 + 0.3).sin()).collect();
    let scale = 1e-5 * size / norm(&noise);
    let mut y: Vec<f64> = z.iter().zip(&noise).map(|(z, n)| z + scale * n).collect();
    let (mut furthest, mut last) = (0.0f64, 0.0);
    for _ in 0..200 {
        let end = integrate(body, &body.state(&y), TAU / p.omega).map_err(|e| e.to_string())?;
        y = body.frame(&end.report.last);
        last = distance(&y);
        furthest = furthest.max(last);
    }
    let moduli = orbit.multipliers[orbit.trivial..].iter().map(|m| m[0].hypot(m[1]));
    let largest = moduli.fold(0.0, f64::max);
    Ok(match orbit.stable {
        _ if orbit.grazing < NEAR_GRAZING => None,
        _ if (0.99..1.04).contains(&largest) => None,
        Some(true) => Some(last < 1e-6),
        Some(false) => Some(furthest > 1e-4),
        None => None,
    })
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let ratios = if effort.short { &PEAKS[..1] } else { &PEAKS[..] };
    for &(ratio, expected) in ratios {
        let mut body = body(ratio)?;
        let points = forced_response(&mut body, 1.2, |_| Go::Continue(()))?;
        let name = |what: &str| format!("ξ = {} %: {what}", 100.0 * ratio);
        let amplitudes =
            points.iter().filter_map(|p| p.orbit.as_ref().map(|o| (o.amplitude, p.omega)));
        let peak = amplitudes.fold((0.0, 0.0), |m, p| if p.0 > m.0 { p } else { m }).1;
        checks.push(Check {
            what: name("frequency of the largest displacement"),
            measured: peak,
            accepted: (expected - 0.01, expected + 0.01),
        });
        let last = points.last().map_or(0.0, |p| p.omega);
        checks.push(Check::near(name("end of the branch"), last, 2.1, 1e-12));
        let failed = points.iter().filter(|p| p.orbit.is_none()).count();
        checks.push(Check::near(name("points that are no orbits"), failed as f64, 0.0, 0.0));
        let (mut right, mut wrong, mut unstable) = (0, 0, 0);
        let regular = points.iter().filter(|p| p.place.is_some() && !p.special.is_border());
        let regular: Vec<&PointRecord> = regular.collect();
        let every = (regular.len() / DISTURBED).max(1);
        for p in regular.into_iter().step_by(every) {
            match behaves(&mut body, p)? {
                Some(true) => {
                    right += 1;
                    unstable +=
                        u32::from(p.orbit.as_ref().is_some_and(|o| o.stable == Some(false)));
                }
                Some(false) => wrong += 1,
                None => {}
            }
        }
        checks.push(Check::at_least(
            name("points that do as their multipliers say"),
            f64::from(right),
            1.0,
        ));
        checks.push(Check::near(name("points that do not"), f64::from(wrong), 0.0, 0.0));
        // between the folds of each branch; at least that many were met when the case was made
        let met = if effort.short { 1.0 } else { UNSTABLE };
        checks.push(Check::at_least(name("unstable ones that left"), f64::from(unstable), met));
    }
    Ok(checks)
}
