//! Period against energy of the two-element oscillator, through grazing.
//!
//! Beyond grazing, `E > g²/2`: `T = 2 (t₁ + t₂)`, free flight and contact of [`super::oscillator`]. Below, the motion is linear:
//! `T = 2π/ω_f` whatever the energy. The family is followed by arclength from a large orbit down to grazing, where its two switches
//! disappear, and on along the linear branch, which stands upright in frequency.

use std::f64::consts::TAU;

use signorini::continuation::{Go, Options};
use signorini::orbit::along::{Start, arclength};
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::PointKind;

use super::{Case, Check, Effort, Outcome, scene};

pub const CASE: Case = Case {
    name: "oscillator-orbits",
    title: "two-element bar: period against energy, through grazing",
    source: "pencil and paper: matching of two harmonic oscillators",
    only_by_name: false,
    run,
};

const GAP: f64 = 0.5;

/// Period of the orbit of energy `E = a²/2`.
fn period(energy: f64) -> f64 {
    let (wf, wc) = (0.75f64.sqrt(), 3f64.sqrt());
    let a = (2.0 * energy).sqrt();
    if a <= GAP {
        return TAU / wf;
    }
    let t1 = (-GAP / a).acos() / wf;
    let v = wf * (a * a - GAP * GAP).sqrt();
    let t2 = (v / wc).atan2(GAP / 2.0) / wc;
    2.0 * (t1 + t2)
}

/// Energy of the orbit of a period: the curve `T(E)` starts with infinite slope at grazing, its inverse is well conditioned.
fn energy(of_period: f64) -> f64 {
    let (mut low, mut high) = (0.5 * GAP * GAP, 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if period(middle) > of_period { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn run(_: Effort) -> Outcome {
    let scene = scene(include_str!("scene.toml"), None)?;
    let problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
    let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    let start_energy = 8.0;
    let omega = TAU / period(start_energy);
    let z = vec![-(2.0f64 * start_energy).sqrt() * 1.01];
    let text = |e: signorini::orbit::OrbitError| e.to_string();
    let verdict =
        find(&mut body, Closure::Reversible, &z, omega, &Search::default()).map_err(text)?;
    let orbit = verdict.orbit().ok_or_else(|| verdict.to_string())?.clone();
    let options = Options {
        range: (0.5, 1.5),
        step: (0.01, 1e-9, 0.1),
        points: 200,
        locate: false,
        natural: false,
    };
    let (mut worst, mut energies, mut grazed, mut linear) = (0.0f64, vec![], false, 0);
    // towards smaller energies the frequency falls
    arclength(&mut body, Closure::Reversible, Start::Orbit(Box::new(orbit), -1.0), &options, |p| {
        grazed |= matches!(p.special, PointKind::Grazing(_));
        if let Some(o) = &p.orbit {
            energies.push(o.energy);
            let t = TAU / p.omega;
            let error = if o.switches.is_empty() { t / period(0.0) } else { o.energy / energy(t) };
            worst = worst.max((error - 1.0).abs());
            linear += usize::from(o.switches.is_empty());
        }
        if energies.last().is_some_and(|e| *e < 0.01) { Go::Break(()) } else { Go::Continue(()) }
    })
    .map_err(text)?;
    let least = energies.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(vec![
        Check::at_most("period against energy, relative", worst, 1e-11),
        Check::near("grazing is passed", f64::from(u8::from(grazed)), 1.0, 0.0),
        Check::at_least("points on the linear branch", linear as f64, 3.0),
        Check::at_most("least energy", least, 0.02),
        Check::at_least("points", energies.len() as f64, 20.0),
    ])
}
