//! Modes of the body whose interface is held.
//!
//! `I` are the displacements that the contact conditions touch, `R` the rest of `u_O`, `C` those of the contact. The columns of `T` are
//!
//! - the identity on `I` with its static extension `−K_RR⁻¹ K_RI`,
//! - the static shapes `−K_RR⁻¹ K_RC` of `u_C`, zero on `I`, as coordinates of `u_O` that are *independent* of `u_C`,
//! - the modes of `(K_RR, M_RR)`,
//!
//! the last two orthonormal in `K_RR`.

use faer::Mat;

use super::{Interface, Kept, Reduction, independent, kept};
use crate::fem::FemError;
use crate::fem::body::Body;
use crate::fem::eigen;
use crate::fem::factor::SpdFactor;

impl Reduction {
    /// The basis of a body whose contact conditions touch the displacements `interface` of `u_O`.
    pub fn fixed_interface(
        body: &Body,
        interface: &[usize],
        count: Kept,
    ) -> Result<Reduction, FemError> {
        let (n_o, n) = (body.dofs.n_o, body.dofs.n());
        let mut place = vec![None; n];
        let mut inside = vec![false; n_o];
        interface.iter().for_each(|&i| inside[i] = true);
        let rest: Vec<usize> = (0..n_o).filter(|&i| !inside[i]).collect();
        if rest.is_empty() {
            // nothing but the interface: the body itself
            return Ok(Reduction {
                basis: Mat::identity(n_o, n_o),
                dual: Mat::identity(n_o, n_o),
                dofs: body.dofs.clone(),
                interface: Interface::Fixed,
                coordinates: (0..n_o).collect(),
                modes: 0,
                cutoff: None,
            });
        }
        rest.iter().enumerate().for_each(|(r, &i)| place[i] = Some(r));
        let (k, m) = (body.stiffness.among(&rest), body.mass.among(&rest));
        let factor = SpdFactor::new(&k, "stiffness matrix of the body whose interface is held")?;
        let mut scratch = factor.scratch();
        let mut extension = |j: usize| {
            let mut x = vec![0.0; rest.len()];
            body.stiffness.row(j).for_each(|(i, v)| {
                if let Some(r) = place[i] {
                    x[r] -= v;
                }
            });
            factor.solve(&mut x, &mut scratch);
            x
        };
        let statics: Vec<Vec<f64>> = interface.iter().map(|&j| extension(j)).collect();
        let of_contact: Vec<Vec<f64>> = (n_o..n).map(&mut extension).collect();
        let lowest = |count| eigen::lowest(&k, &m, count, body.frequency_unit());
        let (modes, cutoff) = kept(rest.len(), count, lowest)?;
        let count = modes.omega.len();
        // φᵀKφ = 1
        let scaled = modes.shapes.into_iter().zip(&modes.omega);
        let scaled = scaled.map(|(x, w)| x.iter().map(|x| x / w).collect()).collect();
        let free = independent(&k, scaled, of_contact)?;
        let n_y = interface.len() + free.len();
        let mut basis = Mat::zeros(n_o, n_y);
        let mut dual = Mat::zeros(n_o, n_y);
        for (c, (&i, x)) in interface.iter().zip(&statics).enumerate() {
            basis[(i, c)] = 1.0;
            dual[(i, c)] = 1.0;
            rest.iter().zip(x).for_each(|(&r, &x)| basis[(r, c)] = x);
        }
        for (c, x) in free.iter().enumerate() {
            let c = interface.len() + c;
            let mut full = vec![0.0; n];
            rest.iter().zip(x).for_each(|(&r, &x)| full[r] = x);
            for i in 0..n_o {
                basis[(i, c)] = full[i];
                dual[(i, c)] = body.stiffness.row_dot(i, &full);
            }
        }
        let (dofs, coordinates) = (body.dofs.clone(), interface.to_vec());
        let interface = Interface::Fixed;
        Ok(Reduction { basis, dual, dofs, interface, coordinates, modes: count, cutoff })
    }
}
