//! The flow of phases with held nodes (Filippov, theory §5): no exact flow knows them, so they go by Dormand–Prince at a tight tolerance, and their
//! weights `θ`, which depend on the acceleration, are interpolated over each window.

use super::{Bernstein, Layout, Tolerances};
use crate::contact::{MonitorKind, Phase, Scratch};

/// Tolerance of these phases where an exact flow was asked for.
pub(super) const TIGHT: Tolerances = Tolerances { rtol: 1e-13, atol: 1e-16 };

/// Points of the interpolation.
const POINTS: usize = 6;

/// Enclosures of the monitors of held nodes over a window, with their index; `state` gives the state at a fraction of the window.
pub(super) fn enclose(
    phase: &Phase,
    layout: Layout,
    (t0, t1): (f64, f64),
    scratch: &mut Scratch,
    state: impl Fn(f64, &mut [f64]),
) -> Vec<(usize, Bernstein)> {
    let at = |i: usize| i as f64 / (POINTS - 1) as f64;
    let interpolation = nalgebra::SMatrix::<f64, POINTS, POINTS>::from_fn(|i, j| {
        let mut unit = [0.0; POINTS];
        unit[j] = 1.0;
        Bernstein::new(&unit).at(at(i))
    });
    let Some(inverse) = interpolation.try_inverse() else { return vec![] };
    let mut y = vec![0.0; layout.len()];
    let thetas: Vec<Vec<f64>> = (0..POINTS)
        .map(|i| {
            state(at(i), &mut y);
            phase.held_theta(t0 + at(i) * (t1 - t0), layout.u(&y), layout.v(&y), scratch)
        })
        .collect();
    let of_monitor = |(index, monitor): (usize, &crate::contact::Monitor)| {
        let j = phase.held.iter().position(|&i| i == monitor.point)?;
        let value = |theta: f64| match monitor.kind {
            MonitorKind::HeldToFree => 1.0 - theta,
            _ => theta,
        };
        let samples = nalgebra::SVector::<f64, POINTS>::from_fn(|i, _| value(thetas[i][j]));
        Some((index, Bernstein::new((inverse * samples).as_slice())))
    };
    phase.monitors.iter().enumerate().filter_map(of_monitor).collect()
}
