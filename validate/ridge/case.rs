//! The ridge of forced responses lies on the viscous backbone.
//!
//! `C = βK`, `β = 0.01`, load `F M φ_1 cos ωt`; `a_1` is the first harmonic of mode 1. For each level `F` the response is followed over its peak in `a_1`; the
//! viscous nonlinear mode (`C = βK − αM`) with the same `a_1` must have nearly the same frequency. Levels and peaks of an independent harmonic balance
//! with fifteen harmonics, whose own backbone is within 0.45 % outside the 3:1 tongue. The level itself is not that of a balance of energies (6 to
//! 26 % less): `−αM` feeds all harmonics, a load of one frequency the first alone.

use signorini::continuation::Go;
use signorini::hbm::check::series_of_orbit;
use signorini::orbit::Propagator;
use signorini::orbit::along::section_of;
use signorini::orbit::section::at_origin;
use signorini::records::peaks;

use super::refinement::orbits;
use super::{Case, Check, Effort, Outcome, forced_response, scene};

pub const CASE: Case = Case {
    name: "ridge",
    title: "peaks of forced responses lie on the backbone of the viscous nonlinear mode",
    source: "the two are computed from different equations; peaks: independent harmonic balance with fifteen harmonics",
    only_by_name: false,
    run,
};

/// Mesh, level, and frequency and `a_1` of the peak.
const LEVELS: [([usize; 2], f64, f64, f64); 8] = [
    ([10, 3], 0.04270, 1.65384, 0.43069),
    ([10, 3], 0.08220, 1.70754, 0.48103),
    ([10, 3], 0.13970, 1.77054, 0.55497),
    ([10, 3], 0.19143, 1.84524, 0.68716),
    ([10, 3], 0.23743, 1.86818, 0.78936),
    ([20, 6], 0.06132, 1.66450, 0.45129),
    ([20, 6], 0.11296, 1.72941, 0.50748),
    ([20, 6], 0.16387, 1.82242, 0.65718),
];

/// Fifteen harmonics are within these of a peak, in frequency and in `a_1`: the states are off by 0.3 to 1 %.
const OF_PEAK: f64 = 5e-3;
const OF_HARMONIC: f64 = 1.5e-2;

/// A peak and its place on the backbone may be so far apart in frequency, relative.
const APART: f64 = 0.005;

fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}

/// `a_1` of a motion.
fn first_harmonic(body: &Propagator, z: &[f64], omega: f64) -> Result<f64, String> {
    let n = body.n();
    let series = series_of_orbit(body, z, omega, 1).map_err(text)?;
    let mut parts = [0.0; 2];
    for (part, c) in parts.iter_mut().zip(series.coefficients[n..].chunks_exact(n)) {
        let mut both = c.to_vec();
        both.resize(2 * n, 0.0);
        let mut q = vec![0.0; 2 * n];
        body.home.to_modes(&both, &mut q);
        *part = q[0];
    }
    Ok(parts[0].hypot(parts[1]))
}

/// Frequency and `a_1` of the peak of a response.
fn peak(body: &mut Propagator) -> Result<(f64, f64), String> {
    let (mut most, mut furthest) = (0.0f64, 0.0f64);
    let points = forced_response(body, 1.45, |p| {
        let energy = p.orbit.as_ref().map_or(0.0, |o| o.energy);
        most = most.max(energy);
        furthest = furthest.max(p.omega);
        // down the other side of the peak, behind the fold
        let down = energy > 0.0 && energy < 0.85 * most && p.omega < furthest - 1e-3;
        if down { Go::Break(()) } else { Go::Continue(()) }
    })?;
    let near_top =
        points.iter().filter(|p| p.orbit.as_ref().is_some_and(|o| o.energy > 0.5 * most));
    let mut row = vec![];
    for p in near_top {
        let Some(place) = &p.place else { continue };
        body.system.loads_mut().set_frequency(p.omega);
        let (size, section) = (2 * body.n(), (section_of(place), 1));
        let z = at_origin(body, &place.x[..size], p.omega, section).map_err(|e| e.to_string())?;
        let amplitude = first_harmonic(body, &z, p.omega)?;
        row.push([p.omega, amplitude, 0.0]);
    }
    let found = peaks(0, row);
    let top = found.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    top.map(|p| (p.omega, p.amplitude)).ok_or_else(|| "the response has no peak".into())
}

/// The frequency at which the viscous mode has the first harmonic `wanted`, near `omega`, by the secant.
fn on_backbone(body: &mut Propagator, omega: f64, wanted: f64) -> Result<f64, String> {
    let mut at = |omega: f64| -> Result<f64, String> {
        let orbit = orbits::viscous(body, 0.01, omega)?.ok_or("no viscous orbit")?;
        first_harmonic(body, &orbit.z[..2 * body.n()], omega)
    };
    let (mut a, mut b) = (omega, omega + 0.004);
    let (mut fa, mut fb) = (at(a)? - wanted, at(b)? - wanted);
    for _ in 0..4 {
        let c = (b - fb * (b - a) / (fb - fa)).clamp(omega - 0.05, omega + 0.05);
        (a, fa, b) = (b, fb, c);
        if (b - a).abs() < 1e-5 {
            break;
        }
        fb = at(b)? - wanted;
    }
    Ok(b)
}

fn run(effort: Effort) -> Outcome {
    let levels = if effort.short { &LEVELS[..2] } else { &LEVELS[..] };
    let mut checks = vec![];
    for (elements, level, omega, a1) in levels {
        let half_plate = include_str!("../refinement/half-plate.toml");
        let load = format!(
            "[damping]\nrayleigh = [0.0, 0.01]\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = {level}\nomega = 1.7\n"
        );
        let mut forced = orbits::body(&scene(&format!("{half_plate}\n{load}"), Some(elements))?)?;
        let (peak_omega, peak_a1) = peak(&mut forced)?;
        let mut free = orbits::body(&scene(half_plate, Some(elements))?)?;
        let backbone = on_backbone(&mut free, peak_omega, peak_a1)?;
        let name = |what: &str| format!("{} × {}, F = {level}: {what}", elements[0], elements[1]);
        checks.push(Check::near(name("frequency of the peak"), peak_omega, *omega, OF_PEAK));
        checks.push(Check::near(name("first harmonic there"), peak_a1, *a1, OF_HARMONIC));
        checks.push(Check::near(
            name("backbone at that first harmonic"),
            backbone,
            peak_omega,
            APART,
        ));
    }
    Ok(checks)
}
