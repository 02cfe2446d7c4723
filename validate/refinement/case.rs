//! Refinement: viscous orbits have a limit, conservative ones of the same body have none.
//!
//! Bars of 10 to 160 elements at 13 frequencies against the closed form of the first nonsmooth mode, `E = g²/(2 (T − 3)²)`, started at its state
//! `u = −x g/(T − 3)`; half plates of four meshes by three discretisations of the contact, against an independent prototype where it has the
//! same discretisation, and against one another.

use std::f64::consts::TAU;

use signorini::contact::State;
use signorini::orbit::nearest::nearest;
use signorini::orbit::{Orbit, Propagator};

use super::{Case, Check, Effort, Outcome, scene};

#[path = "orbits.rs"]
pub(super) mod orbits;

pub const CASE: Case = Case {
    name: "refinement",
    title: "viscous nonlinear modes converge with the mesh; orbits of the discrete conservative system do not",
    source: "closed form of the bar; independent prototype; three discretisations, one limit",
    only_by_name: false,
    run,
};

/// 13 frequencies of the first family.
fn frequencies() -> impl Iterator<Item = f64> {
    (0..13).map(|k| 1.64 + 0.03 * f64::from(k))
}

fn exact(omega: f64) -> f64 {
    0.5 / (TAU / omega - 3.0).powi(2)
}

fn median(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x.get(x.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Relative errors of the energies that are found on a mesh: viscous with `β`, or conservative.
fn errors(body: &mut Propagator, beta: Option<f64>) -> Result<Vec<f64>, String> {
    let mut found = vec![];
    for omega in frequencies() {
        let orbit = match beta {
            Some(beta) => orbits::viscous(body, beta, omega)?,
            None => {
                let slope = 1.0 / (TAU / omega - 3.0);
                let (n, n_o) = (body.system.body.mesh.n_nodes() - 1, body.n());
                let u = (1..=n_o).map(|i| -slope * i as f64 / n as f64).collect();
                conservative(body, u, omega)?
            }
        };
        found.extend(orbit.map(|o| (o.energy / exact(omega) - 1.0).abs()));
    }
    Ok(found)
}

/// The conservative orbit nearest to displacements `u_O` at rest.
fn conservative(body: &mut Propagator, u: Vec<f64>, omega: f64) -> Result<Option<Orbit>, String> {
    let v = vec![0.0; u.len()];
    let z = body.frame(&State { u, v })[..body.n()].to_vec();
    let verdict = nearest(body, &z, omega).map_err(|e| e.to_string())?;
    Ok(verdict.orbit().cloned())
}

fn bars(short: bool, checks: &mut Vec<Check>) -> Result<(), String> {
    let meshes = [10, 20, 40, 80, 160];
    let meshes = if short { &meshes[..3] } else { &meshes[..] };
    let (mut at_fixed, mut at_rising) = (0, 0);
    for &n in meshes {
        let mut body = orbits::body(&scene(include_str!("bar.toml"), Some(&[n]))?)?;
        let fixed = errors(&mut body, Some(0.01))?;
        // 1/√β = 2.2 √n
        let rising = errors(&mut body, Some(1.0 / (2.2 * 2.2 * n as f64)))?;
        at_fixed += fixed.len();
        at_rising += rising.len();
        if n == 160 {
            checks.push(Check::at_most(
                "bar, 160 elements: median error, sharpness 2.2 √n",
                median(rising),
                0.04,
            ));
        }
        body.set_damping(None).map_err(|e| e.to_string())?;
        let discrete = errors(&mut body, None)?;
        if n >= 40 {
            let what = format!("bar, {n} elements: median error of conservative orbits");
            checks.push(Check::at_least(what, median(discrete), 0.10));
        }
    }
    let all = 13.0 * meshes.len() as f64;
    checks.push(Check::at_least("bars: viscous orbits found, beta = 0.01", at_fixed as f64, all));
    checks.push(Check::at_least(
        "bars: viscous orbits found, sharpness 2.2 √n",
        at_rising as f64,
        all,
    ));
    Ok(())
}

/// Energies at `ω = 1.80`, `β = 0.01` of the prototype: the nodal boundary method.
const PROTOTYPE: [([usize; 2], f64); 4] =
    [([10, 3], 0.65675), ([15, 5], 0.68738), ([20, 6], 0.70052), ([30, 9], 0.71646)];

fn plates(short: bool, checks: &mut Vec<Check>) -> Result<(), String> {
    let meshes = if short { &PROTOTYPE[..3] } else { &PROTOTYPE[..] };
    let mut spread = vec![];
    for (elements, expected) in meshes {
        let mut energies = vec![];
        for method in 0..orbits::METHODS.len() {
            let plain = scene(include_str!("half-plate.toml"), None)?;
            let mut body = orbits::body(&orbits::with_method(plain, elements, method))?;
            let orbit = orbits::viscous(&mut body, 0.01, 1.8)?;
            energies.push(orbit.map_or(f64::NAN, |o| o.energy));
        }
        let [nx, ny] = elements;
        checks.push(Check::near(
            format!("half plate {nx} × {ny}: energy, nodal boundary method"),
            energies[0],
            *expected,
            1e-5,
        ));
        let largest = energies.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = energies.iter().copied().fold(f64::INFINITY, f64::min);
        spread.push(if energies.iter().any(|e| e.is_nan()) {
            f64::NAN
        } else {
            largest / least - 1.0
        });
    }
    let last = spread.len() - 1;
    checks.push(Check::at_most(
        "half plates: spread of three discretisations, finest mesh",
        spread[last],
        if short { 0.03 } else { 0.02 },
    ));
    checks.push(Check::at_most(
        "half plates: the same over that of the coarsest mesh",
        spread[last] / spread[0],
        if short { 0.7 } else { 0.4 },
    ));
    Ok(())
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    bars(effort.short, &mut checks)?;
    plates(effort.short, &mut checks)?;
    Ok(checks)
}
