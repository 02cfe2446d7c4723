//! What a reduction of `u_O` keeps of a body before an obstacle.

use super::modes::phase_modes;
use super::system::System;
use crate::fem::{FemError, Interface, Kept, Reduction};

impl System {
    /// The basis of a reduction by so many modes; displacements along obstacles with friction are coordinates of it.
    pub fn reduction(&self, interface: Interface, count: Kept) -> Result<Reduction, FemError> {
        match interface {
            Interface::Fixed => Reduction::fixed_interface(&self.body, &self.touched(), count),
            Interface::Free => {
                let open = self.open_phase();
                let lowest = |count| phase_modes(self, &open, count);
                Reduction::free_interface(&self.body, count, lowest, self.static_forces())?
                    .with_coordinates(&self.rubbed())
            }
        }
    }

    /// Displacements of `u_O` that the contact conditions touch, and what springs of sliders remember.
    fn touched(&self) -> Vec<usize> {
        let mut touched: Vec<usize> = self.conditions().n_o.triplets().map(|e| e.1).collect();
        let tangents = self.tangents().unwrap_or_default().iter().flatten();
        touched.extend(tangents.flat_map(|t| t.row.iter().map(|e| e.0)));
        touched.extend(self.sliders().iter().filter_map(|s| Some(s.elastic?.memory)));
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// Displacements of `u_O` along which friction acts by themselves.
    fn rubbed(&self) -> Vec<usize> {
        let tangents = self.tangents().unwrap_or_default().iter().flatten();
        let single = tangents.filter_map(|t| match t.row[..] {
            [(j, _)] => Some(j),
            _ => None,
        });
        let mut rubbed: Vec<usize> = single.collect();
        rubbed.sort_unstable();
        rubbed.dedup();
        rubbed
    }

    /// Forces over `u_O`: of the contact at each point, of friction there, and of each load.
    fn static_forces(&self) -> Vec<Vec<f64>> {
        let n_o = self.n_o();
        let mut forces: Vec<Vec<f64>> = vec![];
        let mut push = |entries: &mut dyn Iterator<Item = (usize, f64)>| {
            let mut force = vec![0.0; n_o];
            entries.filter(|e| e.0 < n_o).for_each(|(i, f)| force[i] = f);
            forces.push(force);
        };
        match self.obstacle_rows() {
            Some([_, _, direction]) => {
                (0..direction.n_rows()).for_each(|k| push(&mut direction.row(k)));
            }
            // −K_OC, up to the sign
            None => (n_o..self.n()).for_each(|j| push(&mut self.body.stiffness.row(j))),
        }
        let tangents = self.tangents().unwrap_or_default().iter().flatten();
        tangents.for_each(|t| push(&mut t.row.iter().copied()));
        let harmonic = self.loads.harmonics.iter().map(|h| &h.force);
        let measured = self.loads.measured.iter().map(|m| &m.force);
        for f in self.loads.constant.iter().chain(harmonic).chain(measured) {
            push(&mut f.iter().copied().enumerate());
        }
        forces
    }
}
