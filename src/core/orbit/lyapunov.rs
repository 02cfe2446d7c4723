//! Lyapunov exponents of a motion from its exact tangent: how fast neighbouring motions part, direction by direction (Benettin 1980).
//!
//! ```text
//! X_k Q_k = Q_{k+1} R_k        λ_i T = ⟨ln |R_k,ii|⟩
//! ```
//!
//! with the derivative `X_k` of the map over a period `T`, saltation at its switches inside, of frame vectors, whose norm is the energy. The sum of all exponents is the mean
//! rate at which volumes shrink, `−⟨tr M_α⁻¹C_α⟩`, which the phases tell without a tangent.

use faer::Mat;

use super::OrbitError;
use super::chain::{Chain, Propagator};
use super::period_map::integrate;
use super::tangent::Variation;
use super::walk::Walk;
use crate::contact::State;
use crate::continuation::Go;
use crate::records::LyapunovRecord;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Asked {
    /// How many exponents, the largest first.
    pub count: usize,
    /// Periods that are left out at first, in which the directions find themselves.
    pub skip: usize,
    /// Periods over which means are taken.
    pub periods: usize,
    /// The period.
    pub period: f64,
}

/// The exponents of the motion from a state; `told` hears how many periods are done and may end it where the means of those are what there is. None if it ended before there
/// was one.
pub fn exponents(
    body: &Propagator,
    from: &State,
    asked: &Asked,
    mut told: impl FnMut(usize) -> Go,
) -> Result<Option<LyapunovRecord>, OrbitError> {
    let n = 2 * body.n();
    let count = asked.count.clamp(1, n);
    let mut z = body.frame(from);
    let mut q = orthonormal(&Mat::from_fn(n, count, start)).0;
    let mut growths: Vec<Vec<f64>> = vec![];
    let mut shrinking = vec![];
    for done in 0..asked.skip + asked.periods {
        if told(done).is_break() {
            break;
        }
        let carried = Carried::over(body, &z, &q, asked.period)?;
        let (next, grown) = orthonormal(&carried.columns);
        (q, z) = (next, carried.z);
        if done >= asked.skip {
            growths.push(grown.iter().map(|g| g.max(f64::MIN_POSITIVE).ln()).collect());
            shrinking.push(divergence(body, &carried.chain, &carried.walk)?);
        }
    }
    Ok(match growths.is_empty() {
        true => None,
        false => {
            let all = count == n;
            Some(LyapunovRecord::of(asked.period, growths, &shrinking, all))
        }
    })
}

/// Columns that were carried over a period by the tangent of a motion.
pub(super) struct Carried {
    /// The columns at its end.
    pub columns: Mat<f64>,
    /// The frame vector there.
    pub z: Vec<f64>,
    chain: Chain,
    walk: Walk,
}

impl Carried {
    /// From the frame vector `z` over a period.
    pub fn over(
        body: &Propagator,
        z: &[f64],
        columns: &Mat<f64>,
        period: f64,
    ) -> Result<Carried, OrbitError> {
        let passage = integrate(body, &body.state(z), period)?;
        let walk = body.walk(&passage.chain, z, &passage.times, period)?;
        let along = (&passage.chain, &walk);
        let columns = body.tangent(along, columns.as_ref(), Variation::OF_MAP)?.end;
        let z = body.frame(&passage.report.last);
        Ok(Carried { columns, z, chain: passage.chain, walk })
    }
}

/// No direction is preferred.
fn start(i: usize, j: usize) -> f64 {
    (1.0 + i as f64 + 7.0 * j as f64).sqrt().fract() - 0.5 + f64::from(u8::from(i == j))
}

/// Columns by Gram–Schmidt, twice: orthonormal ones, and by how much each is longer than what the others leave of it.
fn orthonormal(a: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
    let (n, k) = (a.nrows(), a.ncols());
    let mut q = a.clone();
    let mut sizes = vec![];
    for c in 0..k {
        let mut column = q.col_as_slice(c).to_vec();
        for _ in 0..2 {
            for b in 0..c {
                let other = q.col_as_slice(b);
                let along: f64 = other.iter().zip(&column).map(|(x, y)| x * y).sum();
                column.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
            }
        }
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        sizes.push(size);
        for (i, x) in column.iter().enumerate().take(n) {
            q[(i, c)] = if size > 0.0 { x / size } else { 0.0 };
        }
    }
    (q, sizes)
}

/// `−∫ tr M_α⁻¹C_α dt` over a walk: of a phase minus the sum of its modes' rates.
fn divergence(body: &Propagator, chain: &Chain, walk: &Walk) -> Result<f64, OrbitError> {
    let mut sum = 0.0;
    for (set, link) in chain.sets.iter().zip(&walk.links) {
        let spectrum = body.spectra.of_set(&body.system, set)?;
        sum -= (link.span.1 - link.span.0) * spectrum.trace_of_damping();
    }
    Ok(sum)
}
