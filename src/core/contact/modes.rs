//! Natural modes of a phase.

use super::phase::Phase;
use super::system::System;
use crate::fem::{Csr, FemError, Modes, Pivots, eigen, largest};

/// The `count` lowest modes of a phase, `φᵀ M_α φ = 1`, with the sign that makes the contact
/// displacement of largest magnitude positive (the largest displacement where there is no contact).
pub fn phase_modes(system: &System, phase: &Phase, count: usize) -> Result<Modes, FemError> {
    let (k, m) = phase.matrices();
    if !phase.stuck().is_empty() {
        return modes_beside(system, phase, (&k, &m), count);
    }
    // held displacements are modes of their own, and none of the body's
    let held = phase.held_displacements();
    let mut modes = eigen::lowest(&k, &m, count + held.len(), system.units.frequency)?;
    let is_own = |x: &[f64]| held.iter().all(|&j| x[j] == 0.0 || x[j].abs() < 1e-9 * largest(x));
    let kept: Vec<bool> = modes.shapes.iter().map(|x| is_own(x)).collect();
    let mut keep = kept.iter();
    modes.omega.retain(|_| keep.next() == Some(&true));
    let mut keep = kept.iter();
    modes.shapes.retain(|_| keep.next() == Some(&true));
    modes.omega.truncate(count);
    modes.shapes.truncate(count);
    orient(system, phase, &mut modes);
    Ok(modes)
}

/// Those of a phase in which something sticks.
fn modes_beside(
    system: &System,
    phase: &Phase,
    (k, m): (&Csr, &Csr),
    count: usize,
) -> Result<Modes, FemError> {
    let n = m.n_rows();
    let stuck = phase.stuck();
    let rows: Vec<&[(usize, f64)]> = stuck.iter().map(|s| s.0).collect();
    let singular = FemError::Singular { what: "matrix of what sticks" };
    let rows = Pivots::of(n, &rows).ok_or(singular)?;
    let free = rows.others(n);
    let among = |a: &Csr| rows.congruence(a).as_ref().unwrap_or(a).among(&free);
    let mut modes =
        eigen::lowest(&among(k), &among(m), count.min(free.len()), system.units.frequency)?;
    for shape in &mut modes.shapes {
        let mut whole = vec![0.0; n];
        free.iter().zip(shape.iter()).for_each(|(&i, x)| whole[i] = *x);
        rows.forth(&mut whole);
        *shape = whole;
    }
    orient(system, phase, &mut modes);
    Ok(modes)
}

/// Give shapes the sign that makes the contact displacement of largest magnitude positive.
fn orient(system: &System, phase: &Phase, modes: &mut Modes) {
    let mut full = vec![0.0; system.n()];
    for shape in &mut modes.shapes {
        phase.expand(shape, &mut full);
        let largest = |x: &[f64]| {
            x.iter()
                .copied()
                .fold(0.0f64, |m, x| if x.abs() > m.abs() * (1.0 + 1e-9) { x } else { m })
        };
        let of_contact = largest(&system.along_normals(&full));
        let of_all = largest(&full);
        let leading = if of_contact.abs() > 1e-9 * of_all.abs() { of_contact } else { of_all };
        if leading < 0.0 {
            shape.iter_mut().for_each(|x| *x = -*x);
        }
    }
}

/// The same of a shape of `u_O` of the open body.
pub(crate) fn grazing_of(system: &System, shape: &[f64]) -> Option<f64> {
    let mut full = vec![0.0; system.n()];
    system.open_phase().expand(shape, &mut full);
    grazing_scale(system, &full)
}

/// The least factor in magnitude by which a full shape touches the obstacle, with its sign.
pub fn grazing_scale(system: &System, shape: &[f64]) -> Option<f64> {
    let largest = largest(shape);
    let contact = system.along_normals(shape).into_iter().zip(&system.constraints);
    let factors = contact.filter(|(u, _)| u.abs() > 1e-9 * largest).map(|(u, c)| c.gap / u);
    factors.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}
