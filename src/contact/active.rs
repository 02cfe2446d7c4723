//! Active sets: which contact nodes touch the obstacle.

use std::fmt;

/// One flag a contact node: in contact (`w = 0`) or free (`p = 0`).
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ActiveSet(Vec<bool>);

impl ActiveSet {
    /// No node touches.
    pub fn open(n_c: usize) -> Self {
        ActiveSet(vec![false; n_c])
    }

    /// Every node touches.
    pub fn closed(n_c: usize) -> Self {
        ActiveSet(vec![true; n_c])
    }

    /// From flags.
    pub fn new(flags: Vec<bool>) -> Self {
        ActiveSet(flags)
    }

    /// The flags.
    pub fn flags(&self) -> &[bool] {
        &self.0
    }

    /// Whether contact node `i` touches.
    pub fn is_active(&self, i: usize) -> bool {
        self.0[i]
    }

    /// Set node `i`.
    pub fn set(&mut self, i: usize, active: bool) {
        self.0[i] = active;
    }

    /// The same set with node `i` changed.
    pub fn with(&self, i: usize, active: bool) -> Self {
        let mut set = self.clone();
        set.0[i] = active;
        set
    }

    /// Nodes in contact.
    pub fn closed_nodes(&self) -> Vec<usize> {
        (0..self.0.len()).filter(|&i| self.0[i]).collect()
    }

    /// Free nodes.
    pub fn free_nodes(&self) -> Vec<usize> {
        (0..self.0.len()).filter(|&i| !self.0[i]).collect()
    }

    /// Number of nodes in contact.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|&&a| a).count()
    }
}

impl fmt::Debug for ActiveSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|&a| f.write_str(if a { "C" } else { "." }))
    }
}
