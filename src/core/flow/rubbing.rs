//! What friction does in a window of a flow by modes: from the values of the monitors, which know pressures, slips and tractions.

use nalgebra::DMatrix;

use super::Layout;
use super::oscillator::GAUSS10;
use super::spectrum::Spectrum;
use crate::contact::{MonitorKind, RubbingRates, System};
use crate::fem::Loads;

/// The phase of the fastest product of two modes that ten points of Gauss integrate to rounding errors: `2ω h`, `(h ω)²⁰ 2²⁰ (10!)⁴/(21 (20!)³) ≈ 2e-15`.
const ANGLE: f64 = 6.0;

/// Powers of the points that rub, from the values of the monitors of a phase.
pub(super) fn rates(
    system: &System,
    phase: &Spectrum,
    h: &[f64],
    mut each: impl FnMut(usize, RubbingRates),
) {
    let Some(tangents) = system.tangents() else { return };
    for (k, monitor) in phase.monitors.iter().enumerate() {
        let point = monitor.point;
        let Some(tangent) = &tangents[point] else { continue };
        let (area, surface) = (system.constraints[point].area, tangent.surface);
        match monitor.kind {
            // behind the pressure of its point
            MonitorKind::Slip => {
                let force = tangent.coefficient * area * h[k - 1];
                let sigma = phase.states.at(point).slip().unwrap_or(0.0);
                let (work, belt) = (force * h[k], -sigma * force * surface);
                each(point, RubbingRates { work, path: h[k].abs(), belt });
            }
            // μp − q, before μp + q
            MonitorKind::StickPlus => {
                let belt = -0.5 * (h[k + 1] - h[k]) * area * surface;
                each(point, RubbingRates { belt, ..RubbingRates::default() });
            }
            _ => {}
        }
    }
}

/// Work of the harmonic loads, and dissipation by viscosity, at modal velocities.
pub(super) fn powers(phase: &Spectrum, loads: &Loads, t: f64, v: &[f64]) -> [f64; 2] {
    let dot = |f: &[f64]| f.iter().zip(v).map(|(f, v)| f * v).sum::<f64>();
    let of_load = |(h, f): (&crate::fem::Harmonic, &Vec<f64>)| h.factor(t, 0) * dot(f);
    let work = loads.harmonics.iter().zip(&phase.stuck.loads).map(of_load).sum();
    [work, phase.dissipation(v)]
}

/// Add to the integrals of a state what happens from `a` to `b`, summed over points of Gauss; `at` gives modal velocities and the monitors at some times, a column each.
pub(super) fn integrate(
    (system, phase, layout): (&System, &Spectrum, &Layout),
    (a, b): (f64, f64),
    at: impl Fn(&[f64]) -> [DMatrix<f64>; 2],
    y: &mut [f64],
) {
    let Some(rubbed) = layout.rubbed else { return };
    let highest = phase.scale().iter().fold(0.0f64, |m, w| m.max(*w));
    let parts = (2.0 * (b - a) * highest / ANGLE).ceil().max(1.0);
    let h = (b - a) / parts;
    for j in 0..parts as usize {
        let left = a + j as f64 * h;
        let both = |(x, weight)| {
            [(0.5 * h * (1.0 - x), 0.5 * h * weight), (0.5 * h * (1.0 + x), 0.5 * h * weight)]
        };
        let (times, weights): (Vec<f64>, Vec<f64>) =
            GAUSS10.into_iter().flat_map(both).map(|(x, weight)| (left + x, weight)).unzip();
        let [v, monitors] = at(&times);
        let columns = v.column_iter().zip(monitors.column_iter());
        for ((t, weight), (v, h)) in times.iter().zip(&weights).zip(columns) {
            let powers = powers(phase, &system.loads, *t, v.as_slice());
            for (place, power) in [layout.work, layout.dissipated].into_iter().zip(powers) {
                place.into_iter().for_each(|i| y[i] += weight * power);
            }
            rates(system, phase, h.as_slice(), |point, rates| {
                rubbed.add(y, point, &rates, *weight);
            });
        }
    }
}
