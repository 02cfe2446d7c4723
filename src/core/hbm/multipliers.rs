//! Multipliers along a series: the product of the flows of its phases with the saltation of each of its switches (theory §9).
//!
//! Whatever the series, there are `2m` of them, of a conservative body in reciprocal pairs: both sides of a switch are seen from the state of the series there.
//! Their error is that of the switching times, which falls like `N_h⁻³`.

use std::f64::consts::TAU;

use super::{HbmError, Series, Solution};
use crate::orbit::floquet::{Multiplier, monodromy, multipliers};
use crate::orbit::{Closure, LARGE, Propagator, Stability};

/// A solution, the series of its displacements, and `α` if it has one.
pub(super) struct Told {
    pub solution: Solution,
    pub displacements: Series,
    pub alpha: Option<f64>,
}

/// Multipliers along a series.
#[derive(Debug)]
pub(super) struct AlongSeries {
    /// What they are.
    pub stability: Stability,
    /// By how much those of series with half the harmonics differ from them.
    pub error: f64,
}

impl AlongSeries {
    /// The multipliers of a solution, and by how much those of the solutions that `fewer` finds with half the harmonics, and with one more, differ. None where it finds neither: nothing is
    /// known of the error then; none of a body that is too large for the modes of its phases.
    pub fn new(
        (body, closure): (&mut Propagator, Closure),
        whole: (&Solution, &Series, Option<f64>),
        fewer: &mut dyn FnMut(usize) -> Result<Option<Told>, HbmError>,
    ) -> Result<Option<AlongSeries>, HbmError> {
        let n_h = whole.0.q.n_h;
        if body.n() > LARGE {
            return Ok(None);
        }
        let stability = along(body, closure, whole)?;
        let mut error = None;
        for half in [n_h.div_ceil(2), n_h.div_ceil(2) + 1].into_iter().filter(|h| *h < n_h) {
            let Some(Told { solution, displacements, alpha }) = fewer(half)? else { continue };
            let other = along(body, closure, (&solution, &displacements, alpha))?;
            error = Some(apart(&stability, &other).max(error.unwrap_or(0.0)));
        }
        Ok(error.map(|error| AlongSeries { stability, error }))
    }
}

/// The multipliers of the product of the flows along a solution.
fn along(
    body: &mut Propagator,
    closure: Closure,
    (s, u, alpha): (&Solution, &Series, Option<f64>),
) -> Result<Stability, HbmError> {
    body.system.loads_mut().set_frequency(s.omega);
    let (chain, times, states) = s.chain(u);
    let mut z = body.frame(&states[0]);
    z.truncate(closure.sizes(body.n()).1);
    z.extend(alpha);
    closure.adopt(body, &z)?;
    let walk = body.walk_beside(&chain, &states, &times, TAU / s.omega)?;
    let mut values = multipliers(&monodromy(body, (&chain, &walk))?)?;
    // the velocity is no eigenvector of what is no motion: what belongs to every orbit of a kind lies near +1
    let far = |v: &Multiplier| (v.0 - 1.0).hypot(v.1);
    values.sort_by(|a, b| far(a).total_cmp(&far(b)));
    let others = values.split_off(closure.trivial().min(values.len()));
    Ok(Stability::of(values, others))
}

/// The largest distance of a multiplier of one to the nearest of the other, but for those that belong to every orbit of a kind.
fn apart(a: &Stability, b: &Stability) -> f64 {
    let far = |a: &[Multiplier], b: &[Multiplier]| {
        let nearest = |v: &Multiplier| {
            b.iter().map(|w| (v.0 - w.0).hypot(v.1 - w.1)).fold(f64::INFINITY, f64::min)
        };
        a.iter().map(nearest).fold(0.0, f64::max)
    };
    let (a, b) = (&a.multipliers[a.trivial..], &b.multipliers[b.trivial..]);
    far(a, b).max(far(b, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Penalty, System};
    use crate::fem::Csr;
    use crate::hbm::branch::first_solution;
    use crate::hbm::newton::Settings;
    use crate::hbm::{Balanced, Form, prepare};
    use crate::model::Model;
    use crate::orbit::search::{Effort, find};

    /// One mass before a stop of stiffness 20 at distance 1.
    fn oscillator(alpha: f64, beta: f64) -> System {
        let one = || Csr::from_triplets(1, 1, vec![(0, 0, 1.0)]);
        let body = Model::matrices(one(), one(), &[0]).gap(1.0).law(Penalty { stiffness: 20.0 });
        body.damp(alpha, beta).forces(&[1.5]).harmonic(1.3, 0.0).build().unwrap()
    }

    /// Two masses between springs, the first one before a stop of stiffness 10.
    fn two_masses(gap: f64) -> Model {
        let mass = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (1, 1, 1.0)]);
        let springs = vec![(0, 0, 2.0), (1, 1, 2.0), (0, 1, -1.0), (1, 0, -1.0)];
        let stiffness = Csr::from_triplets(2, 2, springs);
        Model::matrices(mass, stiffness, &[0]).gap(gap).law(Penalty { stiffness: 10.0 })
    }

    fn solved(body: &dyn Balanced, s: &Solution, n_h: usize) -> Option<Told> {
        let guess = s.q.with_harmonics(n_h);
        let solution = body.solve(&guess, s.omega, &Settings::default()).unwrap().ok()?;
        let displacements = body.displacements(&solution).unwrap();
        Some(Told { solution, displacements, alpha: None })
    }

    /// Along series of 7 to 63 harmonics against the orbit: what the error tells is true to a factor, and falls like `N_h⁻³`.
    fn holds(
        system: impl Fn() -> System,
        omega: f64,
        (determinant, theirs): (Option<f64>, &[(usize, f64)]),
    ) {
        let mut body = Propagator::new(system()).unwrap();
        let mut balanced = prepare(system(), Form::Force).unwrap();
        let mut told = first_solution(balanced.as_mut(), 5, omega).unwrap().unwrap();
        for n_h in (7..32).step_by(2) {
            told = solved(balanced.as_ref(), &told, n_h).unwrap().solution;
        }
        let u = balanced.displacements(&told).unwrap();
        let z = body.frame(&told.state(&u, 0.0, 0));
        let verdict = find(&mut body, Closure::FORCED, &z, omega, &Effort::default()).unwrap();
        let exact = verdict.orbit().unwrap().stability.clone().unwrap();
        for n_h in [7, 9, 11, 15, 16, 23, 31, 47, 63] {
            let whole = solved(balanced.as_ref(), &told, n_h).unwrap();
            let mut fewer = |n_h: usize| Ok(solved(balanced.as_ref(), &told, n_h));
            let whole = (&whole.solution, &whole.displacements, None);
            let found =
                AlongSeries::new((&mut body, Closure::FORCED), whole, &mut fewer).unwrap().unwrap();
            let error = apart(&found.stability, &exact);
            assert!(error < 0.5 * found.error, "{n_h}: {error:e}, told {:e}", found.error);
            let cube = (n_h as f64).powi(3);
            assert!(error < 25.0 / cube && found.error < 150.0 / cube, "{n_h}: {error:e}");
            // as an independent program has it
            if let Some((_, known)) = theirs.iter().find(|t| t.0 == n_h) {
                assert!((error / known - 1.0).abs() < 0.02, "{n_h}: {error:e} {known:e}");
            }
            println!("{n_h}: {error:.1e}, told {:.1e}", found.error);
            // Liouville: whatever the switches, ln det = −αmT
            if let Some(determinant) = determinant {
                let product = found.stability.multipliers.iter().map(|m| m.0.hypot(m.1));
                let product: f64 = product.product();
                assert!((product / determinant - 1.0).abs() < 1e-11, "{n_h}: {product}");
            }
        }
    }

    #[test]
    fn multipliers_along_a_series_come_to_those_of_the_orbit() {
        let damped = |alpha: f64, omega: f64, n: f64| (-alpha * n * TAU / omega).exp();
        // errors of an independent program in Python, two digits
        let theirs = [(7, 4.3e-2), (15, 3.2e-3), (31, 4.7e-4), (63, 5.4e-5)];
        holds(|| oscillator(0.1, 0.0), 1.3, (Some(damped(0.1, 1.3, 1.0)), &theirs));
        holds(|| oscillator(0.0, 0.1), 1.3, (None, &[]));
        let masses = || {
            let forced = two_masses(0.0).damp(0.04, 0.0).forces(&[1.0, 0.0]);
            forced.harmonic(2.92, 0.0).build().unwrap()
        };
        holds(masses, 2.92, (Some(damped(0.04, 2.92, 2.0)), &[]));
    }

    /// Of a conservative body: symplectic along any series, walked there and back.
    #[test]
    fn along_a_cosine_series_the_pairs_are_reciprocal() {
        let system = || two_masses(1.0).build().unwrap();
        let mut body = Propagator::new(system()).unwrap();
        let mut balanced = prepare(system(), Form::Force).unwrap();
        let omega = 1.2;
        let first = first_solution(balanced.as_mut(), 9, omega).unwrap().unwrap();
        let s = solved(balanced.as_ref(), &first, 31).unwrap();
        let (chain, times, _) = s.solution.chain(&s.displacements);
        assert_eq!((chain.sets.len(), times.len()), (3, 2));
        assert!((times[0] + times[1] - TAU / omega).abs() < 1e-12);
        let mut fewer = |n_h: usize| Ok(solved(balanced.as_ref(), &first, n_h));
        let whole = (&s.solution, &s.displacements, None);
        let found =
            AlongSeries::new((&mut body, Closure::Reversible), whole, &mut fewer).unwrap().unwrap();
        let product =
            found.stability.multipliers.iter().fold((1.0, 0.0), |p: Multiplier, m| {
                (p.0 * m.0 - p.1 * m.1, p.0 * m.1 + p.1 * m.0)
            });
        assert!((product.0 - 1.0).abs() < 1e-10 && product.1.abs() < 1e-10, "{product:?}");
        for m in &found.stability.multipliers {
            let size = m.0 * m.0 + m.1 * m.1;
            let inverse = (m.0 / size, -m.1 / size);
            let far = |v: &Multiplier| (v.0 - inverse.0).hypot(v.1 - inverse.1);
            let nearest = found.stability.multipliers.iter().map(far).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-7, "{m:?}: {nearest:e}");
        }
        let z = body.frame(&s.solution.state(&s.displacements, 0.0, 0));
        let half = &z[..body.n()];
        let effort = Effort::of(Closure::Reversible);
        let verdict = find(&mut body, Closure::Reversible, half, omega, &effort).unwrap();
        let exact = verdict.orbit().unwrap().stability.clone().unwrap();
        let error = apart(&found.stability, &exact);
        assert!(error < found.error && found.error < 0.05, "{error:e} {:e}", found.error);
    }
}
