//! Two surfaces of a body, or of two, that meet: against which displacement of the master a slave node's is counted.
//!
//! ```text
//! u_C,i = n_i · (u_s,i − Σ_j P_ij u_m,j),   g_i = n_i · (Σ_j P_ij x_m,j − x_s,i)
//! ```
//!
//! over the slave's nodes `i` with their outward normals `n_i` and the master's nodes `j`. *Match*: `P_ij = 1` for the node that stands on the normal. *Dual* mortar
//! (Wohlmuth 2000): `P_ij = ∫ψ_i Φ_j / D_i` over what the master covers, in segments on which all functions are smooth, with `ψ = D_e G_e⁻¹ φ` on each side;
//! `D_i = ∫ψ_i = ∫φ_i`. Rows of `P` add up to one and reproduce linear fields on flat interfaces; a uniform pressure passes from one mesh to the other.

mod against;
mod clipping;
mod dual;
mod matching;
mod overlap;
mod segments;

pub use against::{Against, Pair, PairError, Projection, Sides};

use std::collections::BTreeMap;

use super::normals::{GroupNode, nodes_of};
use crate::mesh::point::{dot, norm};
use crate::mesh::{Mesh, Point};
use overlap::Patch;

/// Two surfaces as they meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Meeting {
    /// What was said of them.
    pub pair: Pair,
    /// How nodes were told apart.
    pub projection: Projection,
    /// The slave's nodes before the master, in the order of the group.
    pub nodes: Vec<Against>,
    /// Nodes of the slave that see no master.
    pub uncovered: Vec<usize>,
    /// Nodes that both surfaces share: tips of cracks, which are no contact nodes.
    pub shared: Vec<usize>,
}

impl Meeting {
    /// How two surfaces of a mesh meet; `measure` of a place is what an area there counts (a thickness, `2πr` of a ring).
    pub fn new(
        mesh: &Mesh,
        pair: &Pair,
        measure: &dyn Fn(Point) -> f64,
    ) -> Result<Meeting, PairError> {
        let [slave, master] = [&pair.slave, &pair.master].map(|group| mesh.group(group));
        if slave.iter().any(|facet| master.contains(facet)) {
            return Err(PairError::Shared { what: "sides" });
        }
        let masters = mesh.group_nodes(&pair.master);
        let all = nodes_of(mesh, &pair.slave);
        let (shared, own): (Vec<GroupNode>, Vec<GroupNode>) =
            all.into_iter().partition(|n| masters.contains(&n.node));
        let shared: Vec<usize> = shared.into_iter().map(|n| n.node).collect();
        if own.is_empty() {
            return Err(PairError::Shared { what: "all nodes" });
        }
        let patches = |group: &str| -> Vec<Patch> {
            mesh.group(group).iter().map(|&f| Patch::new(mesh, f)).collect()
        };
        let [slave, master] = [patches(&pair.slave), patches(&pair.master)];
        let whole = overlap::areas(&slave, measure);
        let free: Vec<usize> = masters.into_iter().filter(|n| !shared.contains(n)).collect();
        let matched = match pair.projection {
            Some(Projection::Dual) => None,
            _ => match matching::of(mesh, &own, &free, &slave, &whole) {
                Err(node) if pair.projection.is_some() => {
                    return Err(PairError::NoPartner { node });
                }
                found => found.ok(),
            },
        };
        let (projection, found) = match matched {
            Some(nodes) => (Projection::Match, nodes),
            None => (Projection::Dual, dual::of(&own, (&slave, &master), &whole, measure)?),
        };
        let (nodes, uncovered): (Vec<Against>, Vec<Against>) =
            found.into_iter().partition(|n| n.share > 0.0);
        if nodes.is_empty() {
            return Err(PairError::Apart { count: own.len() });
        }
        let uncovered = uncovered.into_iter().map(|n| n.node).collect();
        Ok(Meeting { pair: pair.clone(), projection, nodes, uncovered, shared })
    }

    /// The nodes of the master that meet something, with the normals of the slave that they meet: `n̄_j ∝ Σ_i |P_ij| n_i`.
    pub fn masters(&self) -> Vec<(usize, Point)> {
        let mut all: BTreeMap<usize, Point> = BTreeMap::new();
        for Against { normal, masters, .. } in &self.nodes {
            for (j, p) in masters {
                let sum = all.entry(*j).or_default();
                (0..3).for_each(|c| sum[c] += p.abs() * normal[c]);
            }
        }
        all.into_iter().filter(|(_, n)| norm(n) > 0.0).collect()
    }

    /// The largest distance by which the line of action misses a node's normal, `|Σ_j P_ij x_m,j − x_s,i − g_i n_i|`: a force has a couple of its own with this lever.
    pub fn lever(&self, mesh: &Mesh) -> f64 {
        let off = |n: &Against| {
            let way = n.way(mesh);
            let gap = dot(&way, &n.normal);
            norm(&std::array::from_fn(|c| way[c] - gap * n.normal[c]))
        };
        self.nodes.iter().map(off).fold(0.0, f64::max)
    }
}
