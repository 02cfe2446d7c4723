//! Viscous nonlinear modes by harmonic balance along the branch, through the folds of tongues: `X = (n, α, ω)` with the interface projections as unknowns.
//!
//! With `q = D(α, ω)⁻¹ (f − Q n)` the equations are `n = N(Q̂ᵀq)` and `p(q) = 0`; `∂q/∂α = −D⁻¹ R_α` ([`super::viscous`]).

use std::convert::Infallible;

use faer::Mat;

use super::balance::{Balance, Quadrature};
use super::branch::{self, Begin, without};
use super::modes::{Linear, project_in};
use super::newton::condensed_residual;
use super::series::{Basis, Series};
use super::solution::Ended;
use super::viscous::{Fed, Viscous};
use super::viscous_mode::{ViscousBody, point};
use super::{HbmError, Solution};
use crate::continuation::{Family, Go, Options, Place, Stop, Units, norm};
use crate::records::{GapReason, PlaceRecord, PointRecord};

/// The family of `n_h` harmonics.
struct Tongue<'a> {
    body: &'a mut Viscous,
    n_h: usize,
}

/// The equations at a point: residual, linear part, the series, its projections.
type At = (Vec<f64>, Linear, Series, Balance);

impl Tongue<'_> {
    /// The interface projections, `α`, `ω`.
    fn parts<'x>(&self, x: &'x [f64]) -> (&'x [f64], f64, f64) {
        let m = x.len() - 2;
        (&x[..m], x[m], x[m + 1])
    }

    /// `X` of a solution.
    fn unknowns(fed: &Fed) -> Vec<f64> {
        let s = &fed.solution;
        s.n.a.iter().copied().chain([fed.alpha, s.omega]).collect()
    }

    /// The equations; none where they cannot be evaluated.
    fn at(&mut self, x: &[f64]) -> Result<Option<At>, HbmError> {
        let (n, alpha, omega) = self.parts(x);
        if !self.body.pin.is_feedback(alpha) || omega <= 0.0 {
            return Ok(None);
        }
        self.body.set_feedback(alpha)?;
        let reduction = self.body.reduction();
        let mut of_n = Series::zeros(Basis::Full, self.n_h, reduction.rank());
        of_n.a.copy_from_slice(n);
        let linear = Linear::new(reduction, self.n_h, omega);
        let (mut r, _, balance) = match condensed_residual(
            reduction,
            &linear.receptance,
            (&of_n, &[]),
            (omega, Quadrature::EventResolved),
        ) {
            Ok(found) => found,
            Err(HbmError::Switches(_) | HbmError::Contact(_)) => return Ok(None),
            Err(e) => return Err(e),
        };
        let q = linear.solve(reduction, &of_n);
        r.push(reduction.stiffness_unit() * self.body.phase(&q));
        Ok(Some((r, linear, q, balance)))
    }

    /// The solution at `X`, or why there is none of the contact problem.
    fn solution(&mut self, x: &[f64]) -> Result<Result<Fed, GapReason>, HbmError> {
        let (n, alpha, omega) = self.parts(x);
        let nowhere = GapReason::NotConverged { residual: f64::NAN, iterations: 0 };
        let Some((r, _, q, balance)) = self.at(x)? else { return Ok(Err(nowhere)) };
        let (reduction, exact) = (self.body.reduction(), Quadrature::EventResolved);
        let y = project_in(reduction, &q);
        let residual = norm(&r) / norm(n).max(f64::MIN_POSITIVE);
        let ended = Ended { omega, q, y, n: balance.n.clone(), residual, iterations: 0 };
        let found = Solution::examine(reduction, ended, balance, exact)?;
        Ok(found.map(|solution| Fed { solution, alpha }))
    }

    /// Size that makes a projection a number of the order of one.
    fn unit(&self) -> f64 {
        self.body.reduction().force_unit()
    }
}

impl Family for Tongue<'_> {
    type Chart = ();
    type Border = Infallible;
    type Error = HbmError;

    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, HbmError> {
        Ok(self.at(x)?.map_or_else(|| vec![f64::NAN; x.len() - 1], |at| at.0))
    }

    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), HbmError> {
        let m = x.len() - 1;
        let h = 1e-6 * x[m];
        let mut shifted = |s: f64| {
            let mut y = x.to_vec();
            y[m] += s;
            self.residual(&y)
        };
        let (up, down) = (shifted(h)?, shifted(-h)?);
        let Some((r, linear, q, balance)) = self.at(x)? else {
            return Ok((vec![f64::NAN; m], Mat::zeros(m, m + 1)));
        };
        // by n and α, q changes by −D⁻¹Q and −w: the last row has the other sign
        let (mut j, _) = self.body.bordered(&linear, &balance, &q, x[m]);
        let scale = self.body.reduction().stiffness_unit();
        (0..m).for_each(|c| j[(m - 1, c)] *= -scale);
        let of_omega = |i: usize| (up[i] - down[i]) / (2.0 * h);
        let whole = Mat::from_fn(m, m + 1, |i, c| if c < m { j[(i, c)] } else { of_omega(i) });
        Ok((r, whole))
    }

    fn units(&self) -> Units {
        let reduction = self.body.reduction();
        let (force, frequency) = (self.unit(), reduction.system.units.frequency);
        let mut unknowns = vec![force; Basis::Full.len(self.n_h) * reduction.rank()];
        unknowns.extend([frequency; 2]);
        Units { unknowns, residual: force }
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        1e-12 * norm(self.parts(x).0).max(self.unit())
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let n = self.parts(x).0;
        let size = n.iter().map(|x| x * x).sum::<f64>().max(1e-2 * self.unit().powi(2));
        n.iter().map(|_| 1.0 / size).chain(self.body.pin.weights()).collect()
    }

    fn chart(&self) {}

    fn set_chart(&mut self, (): &()) {}
}

/// Where a branch begins.
pub type Start = branch::Start<Fed>;

/// The place that a file kept, if it is one of this body's with `n_h` harmonics.
pub fn place_of(body: &Viscous, n_h: usize, record: &PlaceRecord) -> Option<Place<()>> {
    let unknowns = Basis::Full.len(n_h) * body.reduction().rank() + 2;
    branch::place_with(unknowns, record)
}

/// Follow a family of `n_h` harmonics by arclength (or, with `natural`, by frequency).
pub fn arclength(
    body: &mut ViscousBody,
    n_h: usize,
    start: Start,
    options: &Options,
    take: impl FnMut(PointRecord) -> Go,
) -> Result<Option<Stop>, HbmError> {
    let ViscousBody { viscous, shooter } = body;
    let mut family = Tongue { body: viscous, n_h };
    let begin = match start {
        Start::Place(place) => Begin::Place(place),
        Start::Solution(fed, direction) => Begin::At(Tongue::unknowns(&fed), direction),
    };
    let record = |family: &mut Tongue, x: &[f64], kind| match family.solution(x)? {
        Ok(fed) => point(family.body, shooter.as_mut(), &fed, kind),
        Err(failure) => Ok(without(x[x.len() - 1], kind, &failure)),
    };
    branch::along(&mut family, begin, options, record, take)
}
