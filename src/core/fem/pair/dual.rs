//! Dual mortar: `P_ij = ∫ψ_i Φ_j / D_i` with `ψ = D_e G_e⁻¹ φ` on each side, all integrals over what the master covers of it.

use std::collections::{BTreeMap, HashMap};

use nalgebra::DMatrix;

use super::super::normals::GroupNode;
use super::against::{Against, LEAST_SHARE, NOTHING, PairError};
use super::overlap::{Meet, Patch};
use super::{clipping, segments};
use crate::mesh::Point;

/// Entries of `P` below this are rounding.
const ROUNDING: f64 = 1e-14;

/// What the nodes of the slave are counted against.
pub fn of(
    slave: &[GroupNode],
    (patches, masters): (&[Patch], &[Patch]),
    whole: &BTreeMap<usize, f64>,
    measure: &dyn Fn(Point) -> f64,
) -> Result<Vec<Against>, PairError> {
    let normals: HashMap<usize, Point> = slave.iter().map(|n| (n.node, n.normal)).collect();
    let meets = match patches.first().and_then(Patch::face) {
        Some(_) => clipping::of(patches, masters)?,
        None if patches.iter().any(|p| p.nodes.len() == 1) => vec![],
        None => {
            let of = |p: &Patch| p.nodes.iter().map(|n| (*n, p.normal)).collect::<Vec<_>>();
            // of tips, which are no contact nodes, that of a side
            let others: HashMap<usize, Point> = patches.iter().flat_map(of).collect();
            let normal = |n: usize| normals.get(&n).or(others.get(&n)).copied().unwrap_or_default();
            segments::of(patches, masters, &normal)?
        }
    };
    let mut share: HashMap<usize, f64> = HashMap::new();
    let mut rows: HashMap<usize, BTreeMap<usize, f64>> = HashMap::new();
    for of_side in meets.chunk_by(|a, b| a.slave == b.slave) {
        let nodes = &patches[of_side[0].slave].nodes;
        let Some(dual) = coefficients(of_side, nodes.len(), measure) else { continue };
        for meet in of_side {
            let weight = meet.weight * measure(meet.place);
            for (i, node) in nodes.iter().enumerate() {
                *share.entry(*node).or_insert(0.0) += weight * meet.own[i];
                let psi: f64 = (0..nodes.len()).map(|l| dual[(i, l)] * meet.own[l]).sum();
                let row = rows.entry(*node).or_default();
                for (j, phi) in masters[meet.master].nodes.iter().zip(&meet.theirs) {
                    *row.entry(*j).or_insert(0.0) += weight * psi * phi;
                }
            }
        }
    }
    let mut against = |n: &GroupNode| {
        let (node, normal) = (n.node, n.normal);
        let (share, whole) = (share.get(&node).copied().unwrap_or(0.0), whole[&node]);
        if share.abs() <= NOTHING * whole.abs() {
            return Ok(Against { node, normal, share: 0.0, masters: vec![] });
        }
        if share < LEAST_SHARE * whole {
            return Err(PairError::Thin { node, share: share / whole });
        }
        let row = rows.remove(&node).unwrap_or_default();
        let entries = row.into_iter().map(|(j, v)| (j, v / share));
        let masters = entries.filter(|(_, p)| p.abs() > ROUNDING).collect();
        Ok(Against { node, normal, share, masters })
    };
    slave.iter().map(&mut against).collect()
}

/// `A_e = D_e G_e⁻¹` over the covered part of a side; none where next to nothing is covered.
fn coefficients(
    meets: &[Meet],
    nodes: usize,
    measure: &dyn Fn(Point) -> f64,
) -> Option<DMatrix<f64>> {
    let mut gram = DMatrix::<f64>::zeros(nodes, nodes);
    let mut sums = vec![0.0; nodes];
    for meet in meets {
        let weight = meet.weight * measure(meet.place);
        for (a, va) in meet.own.iter().enumerate() {
            sums[a] += weight * va;
            for (b, vb) in meet.own.iter().enumerate() {
                gram[(a, b)] += weight * va * vb;
            }
        }
    }
    let inverse = gram.cholesky()?.inverse();
    Some(DMatrix::from_fn(nodes, nodes, |a, b| sums[a] * inverse[(a, b)]))
}
