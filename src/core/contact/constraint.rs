//! A contact point as everyone above sees it.

/// A contact point: one entry of an active set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constraint {
    /// What files and messages name: the mesh node, or the number of a point that is no node.
    pub node: usize,
    /// Place on the undeformed body.
    pub position: [f64; 3],
    /// Direction of the contact: `u_C` is the displacement along it.
    pub normal: [f64; 3],
    /// Which of the groups before obstacles it belongs to.
    pub group: usize,
    /// Gap.
    pub gap: f64,
    /// Area (force = pressure × area).
    pub area: f64,
    /// Pressure that a unit displacement of this point alone takes away: the unit of pressure over length.
    pub stiffness: f64,
}
