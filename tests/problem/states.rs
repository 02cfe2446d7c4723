//! Gaps, modes, damping, initial states, rigid motions, reduction.

use signorini::contact::System;
use signorini::contact::{grazing_scale, phase_modes};

use super::{assert_near, dense, plate, refused, vector};
use crate::common::{bar, problem};

/// `body.rs`: a gap is the expression at the node; from a plane, how far the node may go along its normal.
#[test]
fn gaps_are_ways_to_the_obstacle() {
    let of_field = problem(&plate("gap = '0.1 + 0.2*y*y'\n")).system;
    assert_eq!(of_field.constraints.len(), 3);
    for c in &of_field.constraints {
        let [x, y, _] = c.position;
        assert_eq!(x, 1.5);
        assert!((c.gap - (0.1 + 0.2 * y * y)).abs() < 1e-15);
    }
    let of_plane = problem(&plate("plane = { normal = [3.0, 0.5], offset = 5.1 }\n")).system;
    for c in &of_plane.constraints {
        // bisection for the way to 3x + y/2 = 5.1
        let (mut low, mut high) = (-10.0, 10.0);
        for _ in 0..80 {
            let t = 0.5 * (low + high);
            let [x, y] = [0, 1].map(|k| c.position[k] + t * c.normal[k]);
            if 3.0 * x + 0.5 * y < 5.1 { low = t } else { high = t }
        }
        assert!((c.gap - low).abs() < 1e-13, "{} {low}", c.gap);
        let [a, b, _] = c.normal;
        assert!((a * a + b * b - 1.0).abs() < 1e-14 && (a * 0.5 - b * 3.0).abs() < 1e-14);
    }
    let behind = problem(&plate("gap = 0.3\ngap_behind = '0.2 + y'\n")).system;
    assert_eq!(behind.constraints.len(), 6);
    for c in &behind.constraints[3..] {
        assert!((c.gap - (0.2 + c.position[1])).abs() < 1e-15);
    }
}

/// Dense `M_α`, `K_α` of the open phase, and their eigenvalues by `L⁻¹ K L⁻ᵀ`.
fn dense_modes(system: &System) -> (Vec<f64>, nalgebra::DMatrix<f64>, nalgebra::DMatrix<f64>) {
    let (k, m) = system.open_phase().matrices();
    let (k, m) = (dense(&k), dense(&m));
    let l = m.clone().cholesky().unwrap().l();
    let inverse = l.try_inverse().unwrap();
    let a = &inverse * &k * inverse.transpose();
    let mut squares: Vec<f64> = a.symmetric_eigenvalues().iter().copied().collect();
    squares.sort_by(f64::total_cmp);
    (squares.into_iter().map(f64::sqrt).collect(), k, m)
}

/// `modes.rs`: frequencies of dense matrices, shapes that are eigenvectors of unit mass and lean towards the obstacle; the least factor by which one touches.
#[test]
fn modes_are_those_of_the_dense_matrices() {
    let system = problem(&plate("gap = '0.1 + 0.2*y'\n")).system;
    let (omega, k, m) = dense_modes(&system);
    let phase = system.open_phase();
    let modes = phase_modes(&system, &phase, 4).unwrap();
    assert_near(&modes.omega, &omega[..4], 1e-10);
    for (w, shape) in modes.omega.iter().zip(&modes.shapes) {
        let x = vector(shape);
        let rest = &k * &x - w * w * (&m * &x);
        assert!(rest.norm() < 1e-9 * (&k * &x).norm());
        assert!((x.dot(&(&m * &x)) - 1.0).abs() < 1e-10);
        let mut full = vec![0.0; system.n()];
        phase.expand(shape, &mut full);
        let at = system.along_normals(&full);
        // of two displacements of one size either may lead
        let (low, high) =
            at.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
        assert!(high >= -low * (1.0 - 1e-8), "{at:?}");
        // the smallest of all factors that bring a node to its gap, on either side
        let touches = |s: f64| at.iter().zip(&system.constraints).any(|(u, c)| s * u >= c.gap);
        let scale = grazing_scale(&system, &full).unwrap();
        assert!(touches(scale * (1.0 + 1e-12)));
        for share in [0.999_999, 0.5, -0.5, -0.999_999] {
            assert!(!touches(share * scale), "{scale}");
        }
    }
}

/// `damping.rs`: `φᵀCφ = 2ξω` of the modes named, with dense matrices of the open phase.
#[test]
fn damping_has_the_ratios_that_are_asked_for() {
    for (table, wanted) in [
        ("rayleigh = [0.3, 0.02]\n", vec![]),
        ("ratio = 0.03\n", vec![(1, 0.03)]),
        ("ratio = 0.04\nmode = 3\n", vec![(3, 0.04)]),
        ("ratios = [[1, 0.02], [4, 0.05]]\n", vec![(1, 0.02), (4, 0.05)]),
    ] {
        let system = problem(&plate(&format!("gap = 1.0\n[damping]\n{table}"))).system;
        let damping = system.damping.unwrap();
        if wanted.is_empty() {
            assert_eq!((damping.alpha, damping.beta), (0.3, 0.02));
        }
        let (_, k, m) = dense_modes(&system);
        let c = damping.alpha * &m + damping.beta * &k;
        let modes = phase_modes(&system, &system.open_phase(), 4).unwrap();
        for (mode, ratio) in wanted {
            let x = vector(&modes.shapes[mode - 1]);
            let found = x.dot(&(&c * &x)) / (2.0 * modes.omega[mode - 1]);
            assert!((found / ratio - 1.0).abs() < 1e-9, "{table}: {found}");
        }
        if table.starts_with("ratio =") {
            assert_eq!(damping.alpha, 0.0);
        }
    }
}

/// `initial.rs`: a mode by its amplitude in gaps, fields at nodes, a state of equilibrium; what penetrates is refused.
#[test]
fn initial_states_are_what_the_scene_says() {
    let p = problem(&plate("gap = 0.2\n[initial]\nmode = 1\namplitude = -0.7\n"));
    let (_, k, m) = dense_modes(&p.system);
    let x = vector(&p.initial.u);
    let quotient = x.dot(&(&k * &x)) / x.dot(&(&m * &x));
    assert!((&k * &x - quotient * (&m * &x)).norm() < 1e-9 * (&k * &x).norm());
    let (full, _) = p.initial.full(&p.system).unwrap();
    let at = p.system.along_normals(&full);
    let leading = at.iter().copied().fold(0.0f64, |m, x| if x.abs() > m.abs() { x } else { m });
    assert!((leading + 0.7 * 0.2).abs() < 1e-12, "{leading}");
    assert!(p.initial.v.iter().all(|v| *v == 0.0));

    let text = "gap = 0.2\n[initial]\ndisplacement = ['-0.1*x*(1 + y)', '0.05*x*x']\nvelocity = ['x', 'x*y']\n";
    let p = problem(&plate(text));
    let body = &p.system.body;
    for (n, [x, y, _]) in body.mesh.nodes().iter().enumerate() {
        let u = [-0.1 * x * (1.0 + y), 0.05 * x * x];
        let v = [*x, x * y];
        for c in 0..2 {
            let (mut i, mut sign) = (None, 0.0);
            body.dofs.terms(n, c).for_each(|(k, t)| (i, sign) = (Some(k), t));
            let Some(i) = i.filter(|i| *i < p.system.n_o()) else { continue };
            assert!((sign * p.initial.u[i] - u[c]).abs() < 1e-15);
            assert!((sign * p.initial.v[i] - v[c]).abs() < 1e-15);
        }
    }

    // at rest under a load that does not reach the obstacle: K_α u = f_α
    let load = "[[load]]\nkind = 'gravity'\namplitude = [0.01, -0.02]\n";
    let p = problem(&plate(&format!("gap = 5.0\n{load}[initial]\nequilibrium = true\n")));
    let phase = p.system.open_phase();
    let (k, _) = phase.matrices();
    let mut force = vec![0.0; p.system.n()];
    p.system.loads.at(0.0, &mut force);
    // the columns of A* from unit vectors
    let n_o = p.system.n_o();
    let columns: Vec<f64> = (0..n_o)
        .flat_map(|i| {
            let unit: Vec<f64> = (0..n_o).map(|j| f64::from(u8::from(i == j))).collect();
            let mut column = vec![0.0; p.system.n()];
            phase.expand(&unit, &mut column);
            column
        })
        .collect();
    let a = nalgebra::DMatrix::from_column_slice(p.system.n(), n_o, &columns);
    let wanted = dense(&k).lu().solve(&(a.transpose() * vector(&force))).unwrap();
    assert_near(&p.initial.u, wanted.as_slice(), 1e-9);

    let said = refused(&plate("gap = 0.2\n[initial]\ndisplacement = ['0.3*x', '0']\n"));
    // 0.3·1.5 − 0.2 at a node of the edge
    assert!(said.contains("penetrates") && said.contains("2.500000e-1"), "{said}");
}

/// `rigid.rs`: a bar without support is taken if a load or its velocity carries it to the obstacle, and refused otherwise.
#[test]
fn rigid_motions_must_end_at_the_obstacle() {
    let free = bar(4).replace("[[support]]\nedge = \"left\"\nfix = [\"x\"]\n", "");
    let load = |a: f64| format!("[[load]]\nkind = 'gravity'\namplitude = [{a}]\n");
    let speed = |v: f64| format!("[initial]\nvelocity = ['{v}']\n");
    for (tables, taken) in [
        (load(0.1), true),
        (load(-0.1), false),
        (speed(0.2), true),
        (speed(-0.2), false),
        (String::new(), false),
        // the load decides in the end
        (load(0.1) + &speed(-0.2), true),
        (load(-0.1) + &speed(0.2), false),
    ] {
        let text = free.clone() + &tables;
        match taken {
            true => drop(problem(&text)),
            false => assert!(refused(&text).contains("rigidly"), "{tables}"),
        }
    }
}

/// `reduction.rs`: `Tᵀ K T`, `Tᵀ M T` with `T` column by column, and a state that lies in the basis is kept.
#[test]
fn reduction_is_a_congruence() {
    let tables = "gap = 0.2\n[initial]\nmode = 1\namplitude = -0.7\n";
    let whole = problem(&plate(tables));
    let few = problem(&plate(&format!("{tables}[reduction]\nmodes = 3\n")));
    let all = problem(&plate(&format!("{tables}[reduction]\nmodes = 1000\n")));
    for reduced in [&few, &all] {
        let (n_y, n_o) = (reduced.system.n_o(), whole.system.n_o());
        let basis = reduced.system.body.reduction().unwrap();
        let columns: Vec<f64> = (0..n_y)
            .flat_map(|i| {
                basis.expand(&(0..n_y).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>())
            })
            .collect();
        let t = nalgebra::DMatrix::from_column_slice(n_o, n_y, &columns);
        let [(k, m), (k_y, m_y)] = [&whole, reduced].map(|p| p.system.open_phase().matrices());
        let expected = [t.transpose() * dense(&k) * &t, t.transpose() * dense(&m) * &t];
        for (found, wanted) in [k_y, m_y].iter().zip(expected) {
            assert_near(dense(found).as_slice(), wanted.as_slice(), 1e-11);
        }
        assert_eq!(reduced.system.n_contact(), whole.system.n_contact());
    }
    // with all modes nothing is lost
    let basis = all.system.body.reduction().unwrap();
    assert_near(&basis.expand(&all.initial.u), &whole.initial.u, 1e-9);
    assert!(few.system.n_o() < all.system.n_o());
}
