//! How far a mesh may be trusted: what a scene comes to on it, on finer ones, and with the other discretisation of the contact.

use serde::Serialize;

/// A body in place of that of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Replaced {
    /// The same mesh with elements of second order.
    Raised,
    /// Elements of half the size.
    Halved,
    /// The other discretisation of the contact on the same mesh.
    OtherContact,
}

/// What stands beside the body of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Beside {
    /// What is replaced.
    pub replaced: Replaced,
    /// In words.
    pub text: String,
    /// Displacements.
    pub n_dof: usize,
    /// Sequence of nodes that switch is that of the scene, as far as its nodes go; none without a run.
    pub same_switches: Option<bool>,
    /// Why there are no numbers of it.
    pub refused: Option<String>,
}

/// A number that an answer hangs on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// `frequency`, `force`, `impulse`, `displacement`, `energy`, `switches`, `probe`.
    pub kind: &'static str,
    /// Which one.
    pub name: String,
    /// Its value on the body of the scene.
    pub value: f64,
    /// On each body beside it; none where it is not known there.
    pub beside: Vec<Option<f64>>,
}

impl Figure {
    /// How far the value is from that of a body beside it, over the latter.
    pub fn relative(&self, k: usize) -> Option<f64> {
        let other = self.beside.get(k).copied().flatten()?;
        (other != 0.0).then(|| self.value / other - 1.0)
    }
}

/// What linear elements lack takes so much off the stiffness of a mode: incompatible modes of elements of four or eight corners, functions of the edges of triangles and tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Relief {
    /// Circular frequency of the mode.
    pub omega: f64,
    /// `η = 1 − φᵀK_iφ/φᵀKφ`
    pub share: f64,
}

impl Relief {
    /// How far the frequency is too high: `1/√(1 − η) − 1`.
    pub fn excess(&self) -> f64 {
        1.0 / (1.0 - self.share).max(f64::MIN_POSITIVE).sqrt() - 1.0
    }
}

/// All that is known of the errors of a mesh.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Trust {
    /// The body of the scene in words.
    pub mesh: String,
    /// Its displacements.
    pub n_dof: usize,
    /// What stands beside it.
    pub beside: Vec<Beside>,
    /// What moves.
    pub figures: Vec<Figure>,
    /// What of the body makes errors fall slowly.
    pub warnings: Vec<String>,
    /// Of the lowest modes, where elements have incompatible modes.
    pub relief: Vec<Relief>,
}

impl Trust {
    /// The largest distance of figures of a kind from those of a body beside.
    pub fn largest(&self, k: usize, kind: &str) -> Option<f64> {
        let of_kind = self.figures.iter().filter(|f| f.kind == kind);
        of_kind.filter_map(|f| f.relative(k)).map(f64::abs).reduce(f64::max)
    }
}
