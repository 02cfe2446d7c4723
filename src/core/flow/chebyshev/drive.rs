//! Harmonic loads on one phase: `Re Σ_j z_j e^{iω_j t} F`, loads of one shape together.

use nalgebra::Complex;

use super::nodes::Nodes;
use super::series::Series;
use crate::contact::{Phase, Scratch};
use crate::fem::{Harmonic, Loads};
use crate::flow::oscillator::Oscillator;

/// The loads of one shape.
#[derive(Debug)]
pub(super) struct Pattern {
    /// Which harmonic loads they are.
    pub loads: Vec<usize>,
    /// `b = M_α⁻¹A*ᵀF`, with its recurrence, which serves all windows of the phase.
    pub series: Series,
}

/// The shapes of the loads with `A*ᵀF`.
pub(super) fn patterns(
    loads: &Loads,
    phase: &Phase,
    scratch: &mut Scratch,
) -> (Vec<Pattern>, Vec<Vec<f64>>) {
    let mut patterns: Vec<Pattern> = vec![];
    let mut forces = vec![];
    for (k, load) in loads.harmonics.iter().enumerate() {
        let same = |p: &&mut Pattern| loads.harmonics[p.loads[0]].force == load.force;
        if let Some(known) = patterns.iter_mut().find(same) {
            known.loads.push(k);
            continue;
        }
        let force = phase.reduce(&load.force);
        let mut b = vec![0.0; force.len()];
        phase.force_acceleration(&load.force, scratch, &mut b);
        let mut series = Series::default();
        series.begin(&b, 0..b.len(), phase);
        patterns.push(Pattern { loads: vec![k], series });
        forces.push(force);
    }
    (patterns, forces)
}

/// `z` of a load, of times from `t0` on.
pub(super) fn amplitude(load: &Harmonic, t0: f64) -> Complex<f64> {
    Complex::from_polar(load.size(), load.omega * t0 + load.angle())
}

/// What the pseudo-modes do under the loads of one shape from `t0` on: `Re Σ z p` and its rate, at every node.
pub(super) fn responses(nodes: &Nodes, loads: &[&Harmonic], t0: f64, tau: f64) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; nodes.len()], vec![0.0; nodes.len()]];
    for load in loads {
        let z = amplitude(load, t0);
        for (j, p) in nodes.responses(load.omega, tau).into_iter().enumerate() {
            sums.iter_mut().zip(p).for_each(|(s, p)| s[j] += (z * p).re);
        }
    }
    sums
}

/// The response of one pseudo-mode to a load that sets in at the start of the window: `Re(P e^{iωt})`, and what of its velocity is free, by the
/// velocity's start and rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Split {
    pub steady: Complex<f64>,
    pub free: (f64, f64),
}

impl Split {
    /// None near resonance.
    pub fn of(mode: &Oscillator, omega: f64, z: Complex<f64>) -> Option<Split> {
        let steady = mode.steady(omega)? * z;
        let rate = Complex::new(0.0, omega) * steady;
        Some(Split { steady, free: (-rate.re, (z + steady * (omega * omega)).re) })
    }
}
