//! What is said of two surfaces, and what their nodes are counted against.

use thiserror::Error;

use crate::mesh::point::minus;
use crate::mesh::{Mesh, Point};

/// From the slave's nodes to the master's displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// Node against node.
    Match,
    /// Dual mortar.
    Dual,
}

/// Which of the two surfaces gives up its inertia along the normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sides {
    /// Both: the master's normal displacements are contact displacements that face nothing.
    #[default]
    Both,
    /// The slave alone.
    Slave,
}

/// What is said of two surfaces that meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Group of sides whose nodes are contact nodes.
    pub slave: String,
    /// Group of sides that they meet.
    pub master: String,
    /// None: [`Projection::Match`] where every node has its partner, [`Projection::Dual`] elsewhere.
    pub projection: Option<Projection>,
    /// Whose inertia.
    pub sides: Sides,
}

/// A node of the slave before the master.
#[derive(Debug, Clone, PartialEq)]
pub struct Against {
    /// The node.
    pub node: usize,
    /// `n_i`: outward normal of the slave.
    pub normal: Point,
    /// `D_i`: the area that belongs to it and is covered; zero where nothing is.
    pub share: f64,
    /// `P_ij` of the master's nodes.
    pub masters: Vec<(usize, f64)>,
}

impl Against {
    /// `Σ_j P_ij x_m,j − x_s,i`: from the node to what it meets.
    pub fn way(&self, mesh: &Mesh) -> Point {
        let x = mesh.nodes();
        let there = self
            .masters
            .iter()
            .fold([0.0; 3], |s: Point, (j, p)| std::array::from_fn(|c| s[c] + p * x[*j][c]));
        minus(&there, &x[self.node])
    }
}

/// Why two surfaces do not meet.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum PairError {
    /// They share sides, or all nodes.
    #[error("the slave and its master share {what}")]
    Shared {
        /// What they share.
        what: &'static str,
    },
    /// No node of the slave sees the master.
    #[error("none of the {count} nodes of the slave sees its master along its normal")]
    Apart {
        /// Number of nodes.
        count: usize,
    },
    /// A node of which the master covers next to nothing.
    #[error("the master covers {share:.1e} of what belongs to node {node}")]
    Thin {
        /// Node of the slave.
        node: usize,
        /// Covered share.
        share: f64,
    },
    /// The surfaces do not face each other.
    #[error("at node {node} the normals of the two surfaces are {degrees:.0}° apart")]
    Turned {
        /// Node of the slave.
        node: usize,
        /// Angle between them; 180° where they face each other.
        degrees: f64,
    },
    /// Node against node was asked for.
    #[error("node {node} has no partner of its own on its normal")]
    NoPartner {
        /// Node of the slave.
        node: usize,
    },
}

/// The least share of a node's area that the master must cover: `P` grows with its inverse.
pub const LEAST_SHARE: f64 = 1e-3;
/// What is covered by less than this is not covered.
pub const NOTHING: f64 = 1e-9;
/// Cosine beyond which two normals do not face each other.
pub const FACES: f64 = -0.5;
