//! Modes of the open body, and the static compliance of its contact.
//!
//! A phase differs from the open one by forces on `u_O` at the contact, and what loads do slowly is static. The columns of `T` are
//!
//! - the modes of the open phase,
//! - the static shapes `K_OO⁻¹ f` of the forces `f` by which the contact (`−K_OC`, or the rows along which an obstacle pushes) and the loads act on `u_O`,
//!
//! orthonormal in `K_OO`. (The open phase has the stiffness `K_OO + K_OC A`; its inverse takes these forces to the same span.)

use faer::Mat;

use super::{Interface, Kept, Reduction, independent, kept};
use crate::fem::FemError;
use crate::fem::body::Body;
use crate::fem::eigen::Modes;
use crate::fem::factor::SpdFactor;

impl Reduction {
    /// The basis of a body whose open phase has the modes of which `lowest` gives so many as are asked for, with `forces` over `u_O` whose static shapes are kept.
    pub fn free_interface(
        body: &Body,
        count: Kept,
        lowest: impl FnMut(usize) -> Result<Modes, FemError>,
        mut forces: Vec<Vec<f64>>,
    ) -> Result<Reduction, FemError> {
        let n_o = body.dofs.n_o;
        let k = body.stiffness.leading(n_o);
        let factor = SpdFactor::new(&k, "stiffness matrix of the body whose contact is held")?;
        let mut scratch = factor.scratch();
        forces.iter_mut().for_each(|f| factor.solve(f, &mut scratch));
        let (modes, cutoff) = kept(n_o, count, lowest)?;
        let count = modes.omega.len();
        let unit = |x: Vec<f64>| {
            let energy = k.quadratic(&x);
            let scale = 1.0 / energy.sqrt();
            (energy > 0.0).then(|| x.iter().map(|v| v * scale).collect())
        };
        let scaled = |shapes: Vec<Vec<f64>>| shapes.into_iter().filter_map(unit).collect();
        let modes = independent(&k, vec![], scaled(modes.shapes))?;
        let all = independent(&k, modes, scaled(forces))?;
        let mut basis = Mat::zeros(n_o, all.len());
        let mut dual = Mat::zeros(n_o, all.len());
        for (c, x) in all.iter().enumerate() {
            basis.col_as_slice_mut(c).copy_from_slice(x);
            k.mul(x, dual.col_as_slice_mut(c));
        }
        let (dofs, interface) = (body.dofs.clone(), Interface::Free);
        Ok(Reduction { basis, dual, dofs, interface, coordinates: vec![], modes: count, cutoff })
    }
}
