//! Masses without inertia at the contact points, and how far they are from the body's own (Khenous, Laborde, Renard 2008).
//!
//! *Condensed*: `M_0 = A_∅ᵀ M A_∅`, positive definite by construction, exact for rigid motions. *Optimal* (Khenous, Laborde, Renard 2008): the
//! nearest `m*` to the scalar nodal mass `m`, with its sparsity, without the rows of the contact nodes, and with all moments up to the second,
//! `Xᵀm*X = XᵀmX`, `X = [1, x, y]`:
//!
//! ```text
//! m* = m_oo + P ∘ (X Λ Xᵀ)
//! ```
//!
//! with `P` the pattern of the remaining pairs and a small symmetric `Λ`; for the normal component alone. Moments are those about the middle of the
//! body, over its size: those about a far point would lose all digits in the square of its distance.

use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use super::ContactError;
use super::boundary::Stress;
use super::condensed::Condensed;
use super::conditions::Conditions;
use super::expansion::Expansion;
use super::gram::gram;
use super::inertia::ConstantMass;
use super::lcp;
use crate::fem::{Body, Csr, SpdFactor, largest, load};
use crate::mesh::Point;

/// The mass of the phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MassChoice {
    /// `M_α = A*ᵀ M A*`: the paper's.
    #[default]
    Paper,
    /// `M_0 = A_∅ᵀ M A_∅` in every phase.
    Condensed,
    /// The nearest mass without inertia at the contact that keeps all moments (Khenous, Laborde, Renard 2008).
    Optimal,
}

/// A mass over `u_O`, and what gravity acts on.
#[derive(Debug)]
pub(super) enum Redistributed {
    /// `M_0 = A_∅ᵀ M A_∅`
    Condensed(Arc<ConstantMass>),
    /// The nearest mass; row sums of `m*` and of `m`, prescribed nodes included; the direction of the contact.
    Optimal { mass: Arc<ConstantMass>, new: Vec<f64>, old: Vec<f64>, direction: Point },
}

impl Redistributed {
    /// The load of a uniform acceleration: none on the contact points, so that free fall deforms nothing.
    pub fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64> {
        let n_o = body.dofs.n_o;
        let mut force = load::gravity(body, acceleration);
        match self {
            Redistributed::Condensed(mass) => {
                let of_c: Vec<f64> = force.drain(n_o..).collect();
                mass.push_open(&of_c, |j, v| force[j] += v);
                force.resize(body.dofs.n(), 0.0);
            }
            Redistributed::Optimal { new, old, direction, .. } => {
                let along: f64 = acceleration.iter().zip(direction).map(|(a, d)| a * d).sum();
                let nodal: Vec<f64> = (0..new.len())
                    .flat_map(|n| {
                        (0..acceleration.len()).map(move |c| {
                            let part = along * direction[c];
                            new[n] * part + old[n] * (acceleration[c] - part)
                        })
                    })
                    .collect();
                force = body.dofs.gather_forces(&nodal);
            }
        }
        force
    }
}

/// `M_0 = A_∅ᵀ M A_∅`.
pub(super) fn condensed(
    body: &Body,
    conditions: &Arc<Conditions>,
) -> Result<Redistributed, ContactError> {
    let mass = match Condensed::new(body, conditions)? {
        Some(mass) => ConstantMass::Condensed { gram: OnceLock::new(), mass: mass.into() },
        None => {
            let a_star = Expansion::open(conditions).a_star();
            let mass = body.mass.congruence(&a_star);
            ConstantMass::formed(mass, &body.dofs, conditions, Some(a_star))?
        }
    };
    Ok(Redistributed::Condensed(mass.into()))
}

/// By how much the moments of the optimal mass may differ from those of the body, over mass and size.
const MOMENTS: f64 = 1e-10;

/// The optimal mass of a body with a mesh whose contact points all have one direction: `m*` along it, `m` across.
pub(super) fn optimal(body: &Body, conditions: &Conditions) -> Result<Redistributed, ContactError> {
    let (mesh, dofs) = (&body.mesh, &body.dofs);
    let m = body.scalar_mass();
    let columns = mesh.dim() + 1;
    let mut direction = dofs.contact.first().map_or([1.0, 0.0, 0.0], |c| c.direction);
    let off = |d: &Point| (0..3).any(|k| (d[k] - direction[k]).abs() > 1e-9);
    if dofs.contact.iter().any(|c| off(&c.direction)) {
        return Err(ContactError::SeveralDirections);
    }
    let at_contact: HashSet<usize> = dofs.contact.iter().map(|c| c.node).collect();
    let touches = |node: usize| at_contact.contains(&node);
    let (middle, size) = (mesh.centre(), mesh.length());
    let x = |node: usize, a: usize| match a {
        0 => 1.0,
        _ => (mesh.nodes()[node][a - 1] - middle[a - 1]) / size,
    };
    let pairs: Vec<(usize, usize, f64)> =
        m.triplets().filter(|(i, j, _)| !touches(*i) && !touches(*j)).collect();
    // moments that are missing once the contact rows are gone
    let index: Vec<(usize, usize)> =
        (0..columns).flat_map(|a| (a..columns).map(move |b| (a, b))).collect();
    let moment = |entries: &mut dyn Iterator<Item = (usize, usize, f64)>,
                  (a, b): (usize, usize)| {
        entries.map(|(i, j, v)| x(i, a) * v * x(j, b)).sum::<f64>()
    };
    let missing = DVector::from_iterator(
        index.len(),
        index.iter().map(|&k| moment(&mut m.triplets(), k) - moment(&mut pairs.iter().copied(), k)),
    );
    // P ∘ (X E_ab Xᵀ), E_ab the symmetric unit matrix
    let unit = |i: usize, j: usize, (a, b): (usize, usize)| match a == b {
        true => x(i, a) * x(j, a),
        false => x(i, a) * x(j, b) + x(i, b) * x(j, a),
    };
    let system = DMatrix::from_fn(index.len(), index.len(), |r, c| {
        moment(&mut pairs.iter().map(|&(i, j, _)| (i, j, unit(i, j, index[c]))), index[r])
    });
    let lambda = system.lu().solve(&missing).unwrap_or_else(|| missing.map(|_| f64::NAN));
    let more = |i: usize, j: usize| -> f64 {
        index.iter().zip(lambda.iter()).map(|(&k, l)| l * unit(i, j, k)).sum()
    };
    let of_all: f64 = m.triplets().map(|e| e.2).sum();
    let left = |(k, missing): (&(usize, usize), &f64)| {
        moment(&mut pairs.iter().map(|&(i, j, _)| (i, j, more(i, j))), *k) - missing
    };
    let off = index.iter().zip(missing.iter()).map(left).map(|x| x.abs() / of_all);
    // the largest, and not a number where one is none
    let off = off.fold(0.0f64, |m, x| if x <= m { m } else { x });
    if off.is_nan() || off > MOMENTS {
        return Err(ContactError::Moments { off });
    }
    let mut weight = vec![0.0; mesh.n_nodes()];
    let mut entries = vec![];
    direction.iter_mut().filter(|d| d.abs() < 1e-15).for_each(|d| *d = 0.0);
    // the blocks m dᵀd and m (I − dᵀd) of a pair of nodes
    let mut block = |i: usize, j: usize, v: f64, along: bool| {
        for (a, b) in (0..mesh.dim()).flat_map(|a| (0..mesh.dim()).map(move |b| (a, b))) {
            let part = direction[a] * direction[b];
            let share = if along { part } else { f64::from(u8::from(a == b)) - part };
            for (k, s) in dofs.terms(i, a).filter(|_| share != 0.0) {
                entries.extend(dofs.terms(j, b).map(|(l, t)| (k, l, v * share * s * t)));
            }
        }
    };
    for (i, j, v) in pairs {
        let v = v + more(i, j);
        weight[i] += v;
        block(i, j, v, true);
    }
    m.triplets().for_each(|(i, j, v)| block(i, j, v, false));
    // what contact displacements would have is rounding
    entries.retain(|e| e.0 < dofs.n_o && e.1 < dofs.n_o);
    let mass = Csr::from_triplets(dofs.n_o, dofs.n_o, entries);
    let mass = ConstantMass::formed(mass, dofs, conditions, None)?.into();
    Ok(Redistributed::Optimal { mass, new: weight, old: body.nodal_mass(), direction })
}

/// Eigenvalues of `(M_open, M_closed)` other than 1, `M_open = A_∅ᵀ M A_∅`, `M_closed = M_OO`: with `M_open − M_OO = W S Wᵀ`, `W = [M_OC, A_∅ᵀ]`, they
/// are those of `I + S (Wᵀ M_OO⁻¹ W)`.
fn mass_spectrum(body: &Body, conditions: &Arc<Conditions>) -> Result<Vec<f64>, ContactError> {
    let (size, n_o) = (conditions.count(), body.dofs.n_o);
    let factor = SpdFactor::new(&body.mass.leading(n_o), "mass matrix of the displacements u_O")?;
    let a_star = Expansion::open(conditions).a_star();
    let mut entries = vec![];
    for i in 0..size {
        let coupling = body.mass.row(n_o + i).filter(|(j, _)| *j < n_o);
        entries.extend(coupling.map(|(j, v)| (i, j, v)));
        entries.extend(a_star.row(n_o + i).map(|(j, v)| (size + i, j, v)));
    }
    let rows = Csr::from_triplets(2 * size, n_o, entries);
    let gram = gram(&factor, &rows);
    let middle = DMatrix::from_fn(2 * size, 2 * size, |a, b| match (a < size, b < size) {
        (true, true) => 0.0,
        (false, false) => body
            .mass
            .row(n_o + a - size)
            .find(|(j, _)| *j == n_o + b - size)
            .map_or(0.0, |(_, v)| v),
        _ => f64::from(u8::from(a % size == b % size)),
    });
    // the symmetric root of the Gram matrix: its square has the eigenvalues of S Γ between two of them
    let eigen = (0.5 * (&gram + gram.transpose())).symmetric_eigen();
    let roots = eigen.eigenvalues.map(|x| x.max(0.0).sqrt());
    let root = &eigen.eigenvectors * DMatrix::from_diagonal(&roots);
    let product = root.transpose() * middle * root;
    Ok((0.5 * (&product + product.transpose()))
        .symmetric_eigenvalues()
        .iter()
        .map(|x| 1.0 + x)
        .collect())
}

/// With more contact displacements the least eigenvalue is bounded, not computed: all of them cost the cube of their number.
const SPECTRUM: usize = 256;

/// Steps of Lanczos for a first guess of the least eigenvalue, and by what share of it the first bound is lower.
const GUESS: (usize, f64) = (40, 0.01);

/// A lower bound of the eigenvalues of `(M_0, M_OO)`: `μ < λ` for all of them where `M_0 − μ M_OO` has a Cholesky factor. `μ` is little below what some steps of
/// Lanczos (in the inner product of `M_OO`) find.
fn least_ratio(body: &Body, mass: &ConstantMass) -> Result<f64, ContactError> {
    let n = body.dofs.n_o;
    let (own, reduced) = (body.mass.leading(n), mass.matrix(body).leading(n));
    let factor = SpdFactor::new(&own, "mass matrix of the displacements u_O")?;
    let mut scratch = factor.scratch();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // M_OO v is carried along with v
    let mut mv: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 0.754_877_666).fract()).collect();
    let (mut before, mut product) = (vec![0.0; n], vec![0.0; n]);
    let (mut on, mut off): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    for step in 0..GUESS.0 {
        let mut v = mv.clone();
        factor.solve(&mut v, &mut scratch);
        let size = dot(&v, &mv).sqrt();
        if on.first().is_some_and(|first| size <= 1e-12 * first) {
            break;
        }
        v.iter_mut().chain(&mut mv).for_each(|x| *x /= size);
        if step > 0 {
            off.push(size);
        }
        reduced.mul(&v, &mut product);
        let alpha = dot(&v, &product);
        on.push(alpha);
        let back = off.last().copied().unwrap_or(0.0);
        let next: Vec<f64> =
            (0..n).map(|i| product[i] - alpha * mv[i] - back * before[i]).collect();
        before = std::mem::replace(&mut mv, next);
    }
    let tridiagonal = DMatrix::from_fn(on.len(), on.len(), |i, j| match i.abs_diff(j) {
        0 => on[i],
        1 => off[i.min(j)],
        _ => 0.0,
    });
    let near = tridiagonal.symmetric_eigenvalues().min();
    let mut less = GUESS.1;
    while less < 1.0 {
        let below = (1.0 - less) * near;
        let rest = Csr::combination(1.0, &reduced, -below, &own);
        if below > 0.0 && SpdFactor::new(&rest, "bound of the mass").is_ok() {
            return Ok(below.min(1.0));
        }
        less *= 3.0;
    }
    Ok(0.0)
}

/// The largest eigenvalue of `(M_open, M_closed)`.
pub(super) fn mass_ratio(body: &Body, conditions: &Arc<Conditions>) -> Result<f64, ContactError> {
    if conditions.is_empty() {
        return Ok(1.0);
    }
    Ok(mass_spectrum(body, conditions)?.into_iter().fold(1.0, f64::max))
}

/// How much higher than the body's own bound the frequencies of the phases over the condensed mass can be.
///
/// With nodal reactions `K_α ≤ K_OO ≤ ω² M_OO`, and `M_OO` against `M_0` is known. With the stress of the field, `A_α` follows from `A_∅` by
/// `u_f = (A_∅x)_f + N_ff⁻¹N_fc (A_∅x)_c`, so `‖A*_α x‖_M ≤ ‖x‖_{M_0} + √(1 + κ²) ‖M_CC‖^½ ‖A_∅x‖` with `κ ≥ ‖N_ff⁻¹N_fc‖` ([`lcp::coupling_bound`]).
pub(super) fn bound(
    body: &Body,
    conditions: &Arc<Conditions>,
    mass: &ConstantMass,
    stress: Stress,
) -> Result<f64, ContactError> {
    if conditions.is_empty() {
        return Ok(1.0);
    }
    if let (Stress::Reaction, ConstantMass::Condensed { .. }) = (stress, mass) {
        // M_OO is the diagonal itself, and below M_0
        return Ok(1.0 + 1e-9);
    }
    if stress == Stress::Reaction {
        let least = match conditions.count() <= SPECTRUM {
            true => mass_spectrum(body, conditions)?.into_iter().fold(1.0, f64::min),
            false => least_ratio(body, mass)?,
        };
        return Ok((1.0 + 1e-9) * (1.0 / least.max(0.0)).sqrt());
    }
    let (size, n_o, n_c) = (conditions.count(), body.dofs.n_o, &conditions.n_c);
    if let ConstantMass::Condensed { mass, .. } = mass
        && n_c.is_sparse()
    {
        let ratio = mass.ratio(conditions);
        if ratio.is_finite() {
            return Ok((1.0 + 1e-9) * ratio);
        }
    }
    let inverse = n_c.dense().try_inverse();
    let Some(inverse) = inverse else { return Ok(f64::INFINITY) };
    let follow = &inverse * mass.gram(conditions) * inverse.transpose();
    let largest = (0.5 * (&follow + follow.transpose())).symmetric_eigenvalues().max();
    let weight = (0..size)
        .map(|i| body.mass.row(n_o + i).filter(|(j, _)| *j >= n_o).map(|(_, v)| v.abs()).sum())
        .fold(0.0, f64::max);
    let kappa = lcp::coupling_bound(n_c, &conditions.area);
    Ok((1.0 + 1e-9) * (1.0 + ((1.0 + kappa * kappa) * weight * largest.max(0.0)).sqrt()))
}

/// A bound of the frequencies of `(K, M_0)`, `K` over `u_O` not below that of any phase: estimated by power iteration, proved by a Cholesky factor of `ω²M_0 − K`.
/// Not finite where none was found.
pub(super) fn bound_of_all(stiffness: &Csr, body: &Body, mass: &ConstantMass) -> f64 {
    let n_o = body.dofs.n_o;
    let mut scratch = mass.scratch();
    let reduced = mass.matrix(body).leading(n_o);
    let mut x: Vec<f64> = (0..n_o).map(|i| (1.7 * (i * i) as f64 + 0.3).sin()).collect();
    let (mut y, mut square) = (vec![0.0; n_o], 0.0);
    for _ in 0..60 {
        stiffness.mul(&x, &mut y);
        square = stiffness.quadratic(&x) / reduced.quadratic(&x);
        mass.solve(&mut y, &mut scratch);
        let size = largest(&y);
        x.iter_mut().zip(&y).for_each(|(x, y)| *x = y / size);
    }
    for _ in 0..40 {
        square *= 1.05;
        let rest = Csr::combination(square, &reduced, -1.0, stiffness);
        if SpdFactor::new(&rest, "bound of the frequencies").is_ok() {
            return (1.0 + 1e-9) * square.sqrt();
        }
    }
    f64::INFINITY
}
