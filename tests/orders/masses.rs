//! What spreading the mass otherwise does to natural frequencies.

use std::f64::consts::PI;

use signorini::fem::{Body, DofMap, Fix, Held, MassForm, Material, StressState, eigen};
use signorini::mesh::{ElementKind, Mesh};

use super::slope;
use crate::common::cuboid::cuboid;
use crate::common::rectangle::rectangle;

const POISSON: f64 = 0.3;

/// The largest relative error of the lowest frequencies of a square or a cube whose sides slide on rigid walls: shear waves with `ω² = μ/ρ k²`, pressure waves with
/// `ω² = c_P² k²`, `k = π (l, m, n)`.
fn error(kind: ElementKind, mesh: Mesh, form: MassForm) -> f64 {
    let shear = 0.5 / (1.0 + POISSON);
    let (groups, material, exact): (&[&str], _, _) = match kind.dim() {
        2 => {
            let pressure = 1.0 / (1.0 - POISSON * POISSON);
            let material = Material::plate(1.0, POISSON, 1.0, 1.0);
            (&["left", "right", "bottom", "top"], material, vec![2.0 * shear, pressure, pressure])
        }
        _ => {
            let state = StressState::Solid;
            let material = Material { young: 1.0, poisson: POISSON, density: 1.0, state };
            let groups = &["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
            (groups, material, vec![2.0 * shear; 3])
        }
    };
    let wall = |g: &&str| Held { group: (*g).into(), fix: Fix::Normal };
    let held: Vec<Held> = groups.iter().map(wall).collect();
    let dofs = DofMap::new(&mesh, &held, &[]).unwrap();
    let body = Body::assemble(mesh, dofs, &[material], form);
    let found = eigen::lowest(&body.stiffness, &body.mass, exact.len(), PI).unwrap().omega;
    let off = |(w, e): (&f64, &f64)| (w / (PI * e.sqrt()) - 1.0).abs();
    found.iter().zip(&exact).map(off).fold(0.0, f64::max)
}

/// A consistent mass leaves the order of the elements, Simpson's rule too; the scaled diagonal is of second order.
#[test]
fn frequencies_have_the_order_of_their_mass() {
    use ElementKind::*;
    use MassForm::*;
    let mut wrong = vec![];
    for (kind, form, order) in [
        (Quad4, Consistent, 2.0),
        (Quad4, Lumped, 2.0),
        (Quad4, ScaledDiagonal, 2.0),
        (Quad8, Consistent, 4.0),
        (Quad8, ScaledDiagonal, 2.0),
        (Quad9, Consistent, 4.0),
        (Quad9, Lumped, 4.0),
        (Quad9, ScaledDiagonal, 4.0),
        (Tri6, Consistent, 4.0),
        (Tri6, ScaledDiagonal, 2.0),
        (Hex8, Lumped, 2.0),
        (Hex20, Consistent, 4.0),
        (Hex20, ScaledDiagonal, 2.0),
        (Hex27, Consistent, 4.0),
        (Hex27, Lumped, 4.0),
        (Tet10, Consistent, 4.0),
        (Tet10, ScaledDiagonal, 2.0),
        (Prism15, ScaledDiagonal, 2.0),
    ] {
        let sizes: &[usize] = if kind.dim() == 2 { &[4, 8, 16] } else { &[4, 7] };
        let of_size = |&n: &usize| {
            let mesh = match kind.dim() {
                2 => rectangle(kind, [0.0, 1.0], 1.0, (n, n), 0.0),
                _ => cuboid(kind, [1.0; 3], [n; 3], 0.0),
            };
            (1.0 / n as f64, error(kind, mesh, form))
        };
        let errors: Vec<(f64, f64)> = sizes.iter().map(of_size).collect();
        let found = slope(&errors);
        let cells: Vec<String> = errors.iter().map(|e| format!("{:.1e}", e.1)).collect();
        println!("| {kind:?} | {form:?} | {} | {found:.1} |", cells.join(" | "));
        if (found - order).abs() > 0.5 {
            wrong.push(format!("{kind:?} {form:?}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
