//! What a run has seen of its own quality: counts and extremes. A checkpoint keeps them, the report tells them.

/// Counts and extremes so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evidence {
    /// Switches that the search missed: another point had changed when the complementarity problem was solved anew.
    pub missed: usize,
    /// Phases whose search is not proved.
    pub uncertified: usize,
    /// Touches that may be switches, and were taken for none.
    pub undecided: usize,
    /// Times that a slack had to grow.
    pub loosened: usize,
    /// Largest displacement.
    pub largest_u: f64,
    /// Largest velocity at a switch of an impact law.
    pub largest_v: f64,
    /// Largest error of a gap behind a switch.
    pub gap_error: f64,
    /// Largest tension.
    pub max_tension: f64,
    /// Largest violation of a contact condition over its size.
    pub violation: f64,
    /// Largest penetration of an obstacle that yields.
    pub entered: f64,
    /// Impulses of blows.
    pub blows: f64,
    /// How far monitors may have been from those of the equations at the end of a phase, over their sizes.
    pub state_error: f64,
}
