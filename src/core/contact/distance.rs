//! How far each displacement is from the contact: over how many entries of the stiffness.
//!
//! Where the mass is a diagonal, a row of `S = M_α⁻¹K_α` that is no neighbour of `u_C` is the same in every phase, and a polynomial of degree `m` in `S`
//! moves nothing further than `m` entries.

use super::system::System;

/// What is no further than this from the contact lies next to it.
pub const NEXT: u32 = 4;

impl System {
    /// Distances of all of `u_O` from the rows on which phases differ, which have 0; what is not connected to them has `u32::MAX`.
    pub fn distances(&self) -> Vec<u32> {
        let (n_o, stiffness) = (self.n_o(), &self.body.stiffness);
        let followed = self.conditions().n_o.triplets().map(|e| e.1);
        let next_to = (n_o..self.n()).flat_map(|i| stiffness.row(i).map(|(j, _)| j));
        let mut distances = vec![u32::MAX; n_o];
        let mut front = vec![];
        for j in followed.chain(next_to).filter(|j| *j < n_o) {
            if std::mem::replace(&mut distances[j], 0) != 0 {
                front.push(j);
            }
        }
        for distance in 1.. {
            if front.is_empty() {
                break;
            }
            let mut next = vec![];
            for i in front {
                for (j, _) in stiffness.row(i).filter(|(j, _)| *j < n_o) {
                    if distances[j] == u32::MAX {
                        distances[j] = distance;
                        next.push(j);
                    }
                }
            }
            front = next;
        }
        distances
    }
}
