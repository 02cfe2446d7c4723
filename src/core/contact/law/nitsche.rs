//! Nitsche's method: consistent springs at points of quadrature (Chouly, Hild, Renard 2015).
//!
//! With the displacement `n u` of the body at a point along its normal, the normal stress `s u` there, the weight `w` and `γ = γ₀E′/h`
//!
//! ```text
//! M ü + K u − (θ/γ) Σ w (s u) sᵀ + (1/γ) Σ w [γ(n u − g) − s u]₊ (γ n − θ s)ᵀ = f
//! ```
//!
//! so that `b = n − s/γ` meets the obstacle, which pushes along `t = n − θ s/γ`. `θ = 1` has the energy `½u̇ᵀMu̇ + ½uᵀKu − (1/2γ) Σ w (s u)² + ½ Σ γ w [b u − g]₊²` and
//! keeps it. With `θ ≠ 1` the matrix of forces is not symmetric, and the energy `E_θ = H + (θ/2γ) Σ w (p² − (s u)²)` changes by `Ė_θ = (θ − 1) Σ w p n u̇`.

use super::{Conduct, Law, Push};
use crate::contact::ContactError;
use crate::contact::gram::gram;
use crate::contact::obstacle::Spring;
use crate::contact::site::{Site, combine};
use crate::contact::states::PointState;
use crate::fem::{Body, Csr, SpdFactor};

/// The law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nitsche {
    /// `γ₀`: stiffness over the unit of the point.
    pub gamma: f64,
    /// `θ`: 1, 0 or −1.
    pub theta: f64,
}

impl Law for Nitsche {
    fn name(&self) -> String {
        format!("Nitsche, θ = {}, γ₀ = {}", self.theta, self.gamma)
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Moves,
            _ => Conduct::Pushed,
        }
    }

    fn push(&self, site: &Site) -> Option<Push> {
        let gamma = self.gamma * site.unit;
        let less = |share: f64| combine(&site.displacement, &site.stress, -share / gamma);
        let spring = Spring { stiffness: gamma, preload: 0.0, share: self.theta };
        Some(Push { spring, depth: less(1.0), direction: less(self.theta) })
    }

    /// `−(θ/γ) w sᵀs`; those of a point behind are those of the one in front.
    fn consistent_terms(&self, site: &Site) -> Vec<(usize, usize, f64)> {
        if site.is_behind() || self.theta == 0.0 {
            return vec![];
        }
        let c = -self.theta * site.weight / (self.gamma * site.unit);
        let row = |&(i, x): &(usize, f64)| site.stress.iter().map(move |&(j, y)| (i, j, c * x * y));
        site.stress.iter().flat_map(row).collect()
    }

    fn check(&self, body: &Body, sites: &[Site]) -> Result<(), ContactError> {
        let (gamma, bound) = (self.gamma, coercivity(body, sites)?);
        if gamma <= bound { Err(ContactError::NotCoercive { gamma, bound }) } else { Ok(()) }
    }

    fn dissipates(&self) -> bool {
        self.theta != 1.0
    }
}

/// What `γ₀` must exceed: the largest eigenvalue of `(Σ w sᵀs / unit, K)`, as that of the Gram matrix of the rows. Rigid motions have no stress: a
/// shift by a rounding-sized share of the mass holds them and changes nothing else.
fn coercivity(body: &Body, points: &[Site]) -> Result<f64, ContactError> {
    let shift = 1e-9 * body.frequency_unit().powi(2);
    let stiffness = Csr::combination(1.0, &body.stiffness, shift, &body.mass);
    let factor = SpdFactor::new(&stiffness, "stiffness matrix")?;
    let front = points.iter().enumerate().filter(|(_, p)| !p.is_behind());
    let entries = front.flat_map(|(q, p)| {
        let scale = (p.weight / p.unit).sqrt();
        p.stress.iter().map(move |&(j, s)| (q, j, scale * s))
    });
    let rows = Csr::from_triplets(points.len(), body.dofs.n_o, entries.collect());
    let gram = gram(&factor, &rows);
    Ok((0.5 * (&gram + gram.transpose())).symmetric_eigenvalues().max())
}
