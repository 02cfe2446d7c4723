//! Viscous nonlinear modes by harmonic balance along the branch, through the folds of tongues: `X = (n, α, ω)` with the interface projections as unknowns.
//!
//! With `q = D(α, ω)⁻¹ (f − Q n)` the equations are `n = N(Q̂ᵀq)` and `p(q) = 0`; `∂q/∂α = −D⁻¹ R_α` ([`super::viscous`]).

use faer::Mat;

use super::balance::{Balance, Quadrature, project_in};
use super::fed::{Body, point};
use super::newton::Linear;
use super::response::NoBorder;
use super::series::{Basis, Series};
use super::viscous::{Fed, Viscous};
use super::{HbmError, Solution};
use crate::continuation::{self, Family, Go, Options, Place, Stop, norm};
use crate::orbit::branch::kind_of;
use crate::records::{PlaceRecord, PointKind, PointRecord};

/// The family of `n_h` harmonics.
struct Tongue<'a> {
    body: &'a mut Viscous,
    n_h: usize,
}

/// Unit of `α` in the arclength, over the frequency of the pinned mode; and of `ω`.
const UNITS: (f64, f64) = (0.063, 0.032);

/// The equations at a point: residual, derivative by `(n, α)`, the series, its projections.
type At = (Vec<f64>, Mat<f64>, Series, Balance);

impl Tongue<'_> {
    /// The interface projections, `α`, `ω`.
    fn parts<'x>(&self, x: &'x [f64]) -> (&'x [f64], f64, f64) {
        let m = x.len() - 2;
        (&x[..m], x[m], x[m + 1])
    }

    /// `X` of a solution.
    fn unknowns(&mut self, fed: &Fed) -> Result<Vec<f64>, HbmError> {
        self.body.set_feedback(fed.alpha)?;
        let (reduction, s) = (self.body.reduction(), &fed.solution);
        let y = project_in(reduction, &s.q);
        let n = Balance::new(reduction, &s.q, &y, s.omega, Quadrature::EventResolved)?.n;
        Ok(n.a.into_iter().chain([fed.alpha, s.omega]).collect())
    }

    /// The equations; none where they cannot be evaluated.
    fn at(&mut self, x: &[f64]) -> Result<Option<At>, HbmError> {
        let (n, alpha, omega) = self.parts(x);
        if !self.body.pin.is_feedback(alpha) || omega <= 0.0 {
            return Ok(None);
        }
        self.body.set_feedback(alpha)?;
        let reduction = self.body.reduction();
        let (rank, mode) = (reduction.q.ncols(), self.body.pin.mode);
        let mut of_n = Series::zeros(Basis::Full, self.n_h, rank);
        of_n.a.copy_from_slice(n);
        let linear = Linear::new(reduction, Basis::Full, self.n_h, omega);
        let q = linear.solve(reduction, &of_n);
        let y = project_in(reduction, &q);
        let balance = match Balance::new(reduction, &q, &y, omega, Quadrature::EventResolved) {
            Ok(balance) => balance,
            Err(HbmError::Switches(_) | HbmError::Contact(_)) => return Ok(None),
            Err(e) => return Err(e),
        };
        let m = n.len();
        let scale = reduction.stiffness_unit();
        let mut r: Vec<f64> = n.iter().zip(&balance.n.a).map(|(a, b)| a - b).collect();
        r.push(scale * self.body.phase(&q));
        let mut w = Viscous::by_alpha(&q, omega);
        linear.divide(&mut w);
        let of_w = project_in(reduction, &w);
        let border = &balance.derivative * Mat::from_fn(of_w.a.len(), 1, |i, _| of_w.a[i]);
        let core = linear.times_g(reduction, &balance.derivative, Basis::Full, self.n_h);
        let mut j = Mat::<f64>::zeros(m + 1, m + 1);
        j.submatrix_mut(0, 0, m, m).copy_from(&core);
        for i in 0..m {
            j[(i, i)] += 1.0;
            j[(i, m)] = border[(i, 0)];
        }
        for k in 1..=self.n_h {
            let (cos, sin) = linear.sine_of(k, mode);
            for c in 0..rank {
                let weight = -scale * k as f64 * reduction.q[(mode, c)];
                j[(m, (2 * k - 1) * rank + c)] = weight * cos;
                j[(m, 2 * k * rank + c)] = weight * sin;
            }
        }
        j[(m, m)] = -scale * self.body.phase(&w);
        Ok(Some((r, j, q, balance)))
    }

    /// The solution at `X`.
    fn solution(&mut self, x: &[f64]) -> Result<Option<Fed>, HbmError> {
        let Some((r, _, q, balance)) = self.at(x)? else { return Ok(None) };
        let (n, alpha, omega) = self.parts(x);
        let residual = norm(&r) / norm(n).max(f64::MIN_POSITIVE);
        let Balance { crossings, sets, undecided, .. } = balance;
        let solution = Solution { omega, q, residual, iterations: 0, crossings, sets, undecided };
        Ok(Some(Fed { solution, alpha }))
    }

    /// Size that makes a projection a number of the order of one.
    fn unit(&self) -> f64 {
        let reduction = self.body.reduction();
        reduction.stiffness_unit() * reduction.system.units.length
    }
}

impl Family for Tongue<'_> {
    type Chart = ();
    type Border = NoBorder;
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
        let Some((r, j, ..)) = self.at(x)? else {
            return Ok((vec![f64::NAN; m], Mat::zeros(m, m + 1)));
        };
        let of_omega = |i: usize| (up[i] - down[i]) / (2.0 * h);
        let whole = Mat::from_fn(m, m + 1, |i, c| if c < m { j[(i, c)] } else { of_omega(i) });
        Ok((r, whole))
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        1e-12 * norm(self.parts(x).0).max(self.unit())
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let n = self.parts(x).0;
        let size = n.iter().map(|x| x * x).sum::<f64>().max(1e-2 * self.unit().powi(2));
        let unit = |share: f64| (share * self.body.pin.omega).powi(-2);
        n.iter().map(|_| 1.0 / size).chain([unit(UNITS.0), unit(UNITS.1)]).collect()
    }

    fn chart(&self) {}

    fn set_chart(&mut self, (): &()) {}

    fn overstepped(&mut self, _: &[f64]) -> Result<Vec<NoBorder>, HbmError> {
        Ok(vec![])
    }

    fn margin(&mut self, _: &[f64], border: &NoBorder) -> Result<f64, HbmError> {
        match *border {}
    }

    fn beyond(&mut self, _: &[f64], border: &NoBorder) -> Option<((), Vec<f64>)> {
        match *border {}
    }
}

/// Where a branch begins.
pub enum Start {
    /// At a solution, towards growing (`> 0`) or falling frequency.
    Solution(Box<Fed>, f64),
    /// Where an earlier continuation stood.
    Place(Place<()>),
}

/// The place that a file kept, if it is one of this body's with `n_h` harmonics.
pub fn place_of(body: &Viscous, n_h: usize, record: &PlaceRecord) -> Option<Place<()>> {
    let unknowns = Basis::Full.len(n_h) * body.reduction().q.ncols() + 2;
    let fits = record.x.len() == unknowns && record.tangent.len() == unknowns;
    fits.then(|| Place {
        x: record.x.clone(),
        tangent: record.tangent.clone(),
        step: record.step,
        chart: (),
        orientation: record.orientation,
        signature: record.signature.clone(),
    })
}

fn place_record(place: &Place<()>) -> PlaceRecord {
    PlaceRecord {
        x: place.x.clone(),
        tangent: place.tangent.clone(),
        step: place.step,
        orientation: place.orientation,
        signature: place.signature.clone(),
        ..PlaceRecord::default()
    }
}

/// Follow a family of `n_h` harmonics by arclength (or, with `natural`, by frequency).
pub fn arclength(
    body: &mut Body,
    n_h: usize,
    start: Start,
    options: &Options,
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<Option<Stop>, HbmError> {
    let Body { viscous, shooter } = body;
    let mut family = Tongue { body: viscous, n_h };
    let place = match start {
        Start::Place(place) => place,
        Start::Solution(fed, direction) => {
            let x = family.unknowns(&fed)?;
            match Place::start(&mut family, x, direction, options.step.0)? {
                Some(place) => place,
                None => return Ok(None),
            }
        }
    };
    let mut failed = None;
    let stop = continuation::follow(&mut family, place, options, |family, p| {
        // a special point inside a step is no place to go on from: the step is made anew
        let place = p.special.is_none().then(|| place_record(&p.place));
        let kind = p.special.as_ref().map_or(PointKind::Regular, kind_of);
        let found = match family.solution(&p.x) {
            Ok(Some(fed)) => point(family.body, shooter.as_mut(), &fed, kind),
            Ok(None) => return Go::Continue(()),
            Err(e) => Err(e),
        };
        match found {
            Ok(record) => take(PointRecord { place, ..record }),
            Err(e) => {
                failed = Some(e);
                Go::Break(())
            }
        }
    })?;
    failed.map_or(Ok(Some(stop)), Err)
}
