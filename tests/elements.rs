//! Elements of every kind against exact solutions: a bar's axial frequency, pure bending, a thick cylinder under pressure; energies converge at twice the order of the
//! element.

use crate::common::rectangle::rectangle;
use signorini::fem::{Body, DofMap, Held, MassForm, Material, SpdFactor, StressState, eigen, load};
use signorini::mesh::ElementKind;

fn is_quadratic(kind: ElementKind) -> bool {
    kind.nodes() > 4
}

/// The order from errors on two meshes, one twice as fine.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

#[test]
fn axial_frequencies_converge_at_twice_the_order() {
    let exact = std::f64::consts::FRAC_PI_2;
    for kind in ElementKind::ALL.into_iter().filter(|k| k.dim() == 2) {
        let error = |n: usize| {
            let mesh = rectangle(kind, [0.0, 1.0], 0.2, (n, 1), 0.0);
            // all nodes move along x alone
            let held = [("left", 0), ("bottom", 1), ("top", 1)].map(|(g, c)| Held::along(g, c));
            let dofs = DofMap::new(&mesh, &held, &[]).unwrap();
            let body = Body::assemble(
                mesh,
                dofs,
                &[Material::plate(1.0, 0.0, 1.0, 1.0)],
                MassForm::Consistent,
            );
            let modes = eigen::lowest(&body.stiffness, &body.mass, 1, 1.0).unwrap();
            modes.omega[0] / exact - 1.0
        };
        let (coarse, fine) = (error(4), error(8));
        // from above, as the mass is consistent
        assert!(coarse > 0.0 && fine > 0.0, "{kind:?}: {coarse} {fine}");
        let expected = if is_quadratic(kind) { 4.0 } else { 2.0 };
        assert!((order(coarse, fine) - expected).abs() < 0.2, "{kind:?}: {}", order(coarse, fine));
    }
}

/// `u = −κxy, v = κ(x² + νy²)/2` is in equilibrium without a force but at the ends, in plane stress: quadratic elements have it, distorted or not (with straight sides:
/// triangles and nine-node quadrilaterals; eight-node ones where they are parallelograms).
#[test]
fn quadratic_elements_bend_exactly() {
    let (kappa, nu) = (0.3, 0.3);
    for (kind, skew) in [
        (ElementKind::Tri6, 0.0),
        (ElementKind::Tri6, 0.15),
        (ElementKind::Quad8, 0.0),
        (ElementKind::Quad9, 0.0),
        (ElementKind::Quad9, 0.15),
    ] {
        let mesh = rectangle(kind, [0.0, 2.0], 1.0, (4, 3), skew);
        let dofs = DofMap::new(&mesh, &[], &[]).unwrap();
        let body =
            Body::assemble(mesh, dofs, &[Material::plate(2.0, nu, 1.0, 0.5)], MassForm::Consistent);
        let of =
            |p: &[f64; 3]| [-kappa * p[0] * p[1], 0.5 * kappa * (p[0] * p[0] + nu * p[1] * p[1])];
        let u: Vec<f64> = body.mesh.nodes().iter().flat_map(of).collect();
        let mut force = vec![0.0; body.dofs.n()];
        body.stiffness.mul(&body.dofs.gather(&u), &mut force);
        let nodal = body.dofs.scatter(&force);
        let mut largest = 0.0f64;
        for (n, p) in body.mesh.nodes().iter().enumerate() {
            let at_end = p[0] < 1e-12 || p[0] > 2.0 - 1e-12;
            let size = nodal[2 * n].hypot(nodal[2 * n + 1]);
            match at_end {
                true => largest = largest.max(size),
                false => assert!(size < 1e-13, "{kind:?} {skew}: {size} at {p:?}"),
            }
        }
        assert!(largest > 0.01);
    }
}

/// A thick cylinder under inner pressure, `ε_zz = 0`: `u_r = (1 + ν) p a²/(E(b² − a²)) ((1 − 2ν) r + b²/r)` (Lamé).
#[test]
fn thick_cylinders_converge_at_twice_the_order() {
    let (a, b, h, p, young) = (1.0, 2.0, 0.5, 0.7, 3.0);
    for nu in [0.0, 0.3, 0.45] {
        let state = StressState::Axisymmetric;
        let material = Material { young, poisson: nu, density: 1.0, state };
        let lame = |r: f64| {
            (1.0 + nu) * p * a * a / (young * (b * b - a * a)) * ((1.0 - 2.0 * nu) * r + b * b / r)
        };
        let exact = 0.5 * p * std::f64::consts::TAU * a * h * lame(a);
        for kind in ElementKind::ALL.into_iter().filter(|k| k.dim() == 2) {
            let solve = |n: usize| {
                let mesh = rectangle(kind, [a, b], h, (n, n / 2), 0.0);
                let held = [Held::along("bottom", 1), Held::along("top", 1)];
                let dofs = DofMap::new(&mesh, &held, &[]).unwrap();
                let body = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
                let force = load::traction(&body, "left", &[p, 0.0]);
                // the pressure on the whole inner face
                let total: f64 = force.iter().sum();
                assert!((total - p * std::f64::consts::TAU * a * h).abs() < 1e-12);
                let factor = SpdFactor::new(&body.stiffness, "stiffness").unwrap();
                let mut u = force.clone();
                factor.solve(&mut u, &mut factor.scratch());
                let energy: f64 = 0.5 * u.iter().zip(&force).map(|(u, f)| u * f).sum::<f64>();
                let nodal = body.dofs.scatter(&u);
                let square = |(n, q): (usize, &[f64; 3])| (nodal[2 * n] - lame(q[0])).powi(2);
                let sum: f64 = body.mesh.nodes().iter().enumerate().map(square).sum();
                let off = (sum / body.mesh.n_nodes() as f64).sqrt();
                ((energy / exact - 1.0).abs(), off / lame(a))
            };
            let (coarse, fine) = (solve(8), solve(16));
            let expected = if is_quadratic(kind) { 4.0 } else { 2.0 };
            let found = order(coarse.0, fine.0);
            assert!((found - expected).abs() < 0.35, "{kind:?}, nu = {nu}: order {found}");
            let least = if is_quadratic(kind) { 2.7 } else { 1.7 };
            let found = order(coarse.1, fine.1);
            assert!(found > least, "{kind:?}, nu = {nu}: order of displacements {found}");
            assert!(fine.1 < if is_quadratic(kind) { 1e-4 } else { 1e-2 });
        }
    }
}
