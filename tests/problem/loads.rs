//! Loads, supports and obstacles that move, measured histories.

use signorini::contact::System;
use signorini::contact::{grazing_scale, phase_modes};
use signorini::fem::{Body, DofMap, MassForm, Material};

use super::{assert_near, dense, plate, vector};
use crate::common::{problem, scene};

/// Forces on nodes at a time.
fn at(system: &System, t: f64) -> Vec<f64> {
    let mut force = vec![0.0; system.n()];
    system.loads.at(t, &mut force);
    force
}

/// The entry of `u` of a nodal displacement, with its sign.
fn entry(body: &Body, node: usize, c: usize) -> Option<(usize, f64)> {
    body.dofs.terms(node, c).next()
}

/// `loads.rs`: forces on nodes of rectangles by hand — a side's traction goes to its ends in halves, a weight to the corners of a cell in quarters.
#[test]
fn forces_on_nodes_are_shares_of_what_acts() {
    let (dx, dy, thickness) = (0.5, 0.4, 0.5);
    let p = problem(&plate(
        "gap = 1.0\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.3, -0.2]\nomega = 2.0\nphase = 0.3\n",
    ));
    let force = at(&p.system, 0.7);
    let factor = (2.0f64 * 0.7 + 0.3).cos();
    for (n, [x, y, _]) in p.system.body.mesh.nodes().iter().enumerate() {
        let share = if *y < 0.8 - 1e-9 {
            0.0
        } else if *x > 1.5 - 1e-9 {
            0.5
        } else {
            1.0
        };
        for (c, t) in [0.3, -0.2].into_iter().enumerate() {
            let Some((i, sign)) = entry(&p.system.body, n, c) else { continue };
            let wanted = share * dx * thickness * t * factor;
            assert!((sign * force[i] - wanted).abs() < 1e-15, "{x} {y}");
        }
    }
    let p = problem(&plate("gap = 1.0\n[[load]]\nkind = 'gravity'\namplitude = [0.1, -9.0]\n"));
    let force = at(&p.system, 3.0);
    for (n, [x, y, _]) in p.system.body.mesh.nodes().iter().enumerate() {
        let cells_x = if *x > 1e-9 && *x < 1.5 - 1e-9 { 2.0 } else { 1.0 };
        let cells_y = if *y > 1e-9 && *y < 0.8 - 1e-9 { 2.0 } else { 1.0 };
        let mass = 2.0 * thickness * dx * dy * 0.25 * cells_x * cells_y;
        for (c, a) in [0.1, -9.0].into_iter().enumerate() {
            let Some((i, sign)) = entry(&p.system.body, n, c) else { continue };
            assert!((sign * force[i] - mass * a).abs() < 1e-14, "{x} {y}");
        }
    }
    let p = problem(&plate(
        "gap = 1.0\n[[load]]\nkind = 'point'\nat = [0.9, 0.75]\namplitude = [0.3, -0.2]\n",
    ));
    let force = at(&p.system, 0.0);
    let node = p
        .system
        .body
        .mesh
        .nodes()
        .iter()
        .position(|q| (q[0] - 1.0).hypot(q[1] - 0.8) < 1e-9)
        .unwrap();
    let mut wanted = vec![0.0; p.system.n()];
    for (c, f) in [0.3, -0.2].into_iter().enumerate() {
        let (i, sign) = entry(&p.system.body, node, c).unwrap();
        wanted[i] = sign * f;
    }
    assert_near(&force, &wanted, 1e-15);
}

/// A load in the shape of a mode by its peak: the answer of the damped linear body at that frequency, from dense complex matrices, reaches `peak` gaps.
#[test]
fn peaks_are_those_of_the_linear_answer() {
    for (mode, peak) in [(1, 0.8), (2, 2.5)] {
        let text = plate(&format!(
            "gap = '0.1 + 0.1*y'\n[damping]\nrayleigh = [0.02, 0.01]\n[[load]]\nkind = 'mode'\nmode = {mode}\npeak = {peak}\nomega = 1.0\n"
        ));
        let system = problem(&text).system;
        let phase = system.open_phase();
        let omega = phase_modes(&system, &phase, mode).unwrap().omega[mode - 1];
        let (k, m) = phase.matrices();
        let (k, m) = (dense(&k), dense(&m));
        let damping = system.damping.unwrap();
        let (n, n_o) = (system.n(), system.n_o());
        let mut column = vec![0.0; n];
        let expand = |x: &[f64], out: &mut Vec<f64>| phase.expand(x, out);
        let mut a = nalgebra::DMatrix::zeros(n, n_o);
        for j in 0..n_o {
            let unit: Vec<f64> = (0..n_o).map(|i| f64::from(u8::from(i == j))).collect();
            expand(&unit, &mut column);
            a.column_mut(j).copy_from_slice(&column);
        }
        let force = a.transpose() * vector(&system.loads.harmonics[0].force);
        // (K − ω²M) x + ωC y = F, (K − ω²M) y − ωC x = 0 with the answer x cos ωt + y sin ωt
        let stiff = &k - omega * omega * &m;
        let c = omega * (damping.alpha * &m + damping.beta * &k);
        let mut whole = nalgebra::DMatrix::zeros(2 * n_o, 2 * n_o);
        whole.view_mut((0, 0), (n_o, n_o)).copy_from(&stiff);
        whole.view_mut((n_o, n_o), (n_o, n_o)).copy_from(&stiff);
        whole.view_mut((0, n_o), (n_o, n_o)).copy_from(&c);
        whole.view_mut((n_o, 0), (n_o, n_o)).copy_from(&-c);
        let mut right = nalgebra::DVector::zeros(2 * n_o);
        right.rows_mut(0, n_o).copy_from(&force);
        let answer = whole.lu().solve(&right).unwrap();
        let y: Vec<f64> = answer.rows(n_o, n_o).iter().copied().collect();
        assert!(answer.rows(0, n_o).norm() < 1e-8 * answer.norm());
        expand(&y, &mut column);
        let reached = 1.0 / grazing_scale(&system, &column).unwrap().abs();
        assert!((reached / peak - 1.0).abs() < 1e-8, "{reached} {peak}");
    }
}

/// The body of [`plate`] with nothing held: `K`, `M` over all nodal displacements.
fn unheld(of: &Body) -> (nalgebra::DMatrix<f64>, nalgebra::DMatrix<f64>) {
    let dofs = DofMap::new(&of.mesh, &[], &[]).unwrap();
    let free = Body::assemble(
        of.mesh.clone(),
        dofs,
        &[Material::plate(1.0, 0.3, 2.0, 0.5)],
        MassForm::Consistent,
    );
    let (k, m) = (dense(&free.stiffness), dense(&free.mass));
    let place = |i: usize| free.dofs.terms(i / 2, i % 2).next().unwrap().0;
    let n = k.nrows();
    let sorted = |a: &nalgebra::DMatrix<f64>| {
        nalgebra::DMatrix::from_fn(n, n, |i, j| a[(place(i), place(j))])
    };
    (sorted(&k), sorted(&m))
}

/// `moving.rs`: what a support or an obstacle in motion does to the free displacements, from the blocks of the matrices of the body that nothing holds.
#[test]
fn motions_act_through_the_blocks_of_the_free_body() {
    let (alpha, beta, omega, phase, t) = (0.02, 0.01, 1.3, 0.4, 0.9);
    let damping = format!("[damping]\nrayleigh = [{alpha}, {beta}]\n");
    let angle: f64 = omega * t + phase;
    let course = [angle.cos(), -omega * angle.sin(), -omega * omega * angle.cos()];
    let at_free = |system: &System, nodal: &nalgebra::DVector<f64>| {
        let body = &system.body;
        let mut wanted = vec![0.0; system.n()];
        for n in 0..body.mesh.n_nodes() {
            for c in 0..2 {
                if let Some((i, sign)) = entry(body, n, c) {
                    wanted[i] = sign * nodal[2 * n + c];
                }
            }
        }
        wanted
    };
    // −(K w s + C w ṡ + M w s̈), w = (0.2, −0.1) on the left
    let load = format!(
        "[[load]]\nkind = 'base'\nedge = 'left'\namplitude = [0.2, -0.1]\nomega = {omega}\nphase = {phase}\n"
    );
    let system = problem(&plate(&format!("gap = 1.0\n{damping}{load}"))).system;
    let (k, m) = unheld(&system.body);
    let c = alpha * &m + beta * &k;
    let w = nalgebra::DVector::from_fn(k.nrows(), |i, _| {
        let on = system.body.mesh.nodes()[i / 2][0] < 1e-9;
        if on { [0.2, -0.1][i % 2] } else { 0.0 }
    });
    let nodal = -(course[0] * (&k * &w) + course[1] * (&c * &w) + course[2] * (&m * &w));
    assert_near(&at(&system, t), &at_free(&system, &nodal), 1e-12);
    // an obstacle that moves by m(t) along x: with u = ũ + n m the supports move by −m, and M n m̈ + α M n ṁ acts on all of the body
    let motion = format!(
        "gap = 1.0\nmotion = {{ amplitude = 0.3, omega = {omega}, phase = {phase} }}\n{damping}"
    );
    let system = problem(&plate(&motion)).system;
    let along = |held_only: bool| {
        nalgebra::DVector::from_fn(k.nrows(), |i, _| {
            let held = system.body.mesh.nodes()[i / 2][0] < 1e-9;
            if i % 2 == 0 && (held || !held_only) { 0.3 } else { 0.0 }
        })
    };
    let (held, all) = (along(true), along(false));
    // M ũ¨ + C ũ˙ + K ũ = −(M n m̈ + C n ṁ + K n m) over all free displacements, supports at −n m: rigid n has K n = 0
    assert!((&k * &all).norm() < 1e-12);
    let nodal = course[0] * (&k * &held) + course[1] * (&c * &held) + course[2] * (&m * &held)
        - course[1] * alpha * (&m * &all)
        - course[2] * (&m * &all);
    assert_near(&at(&system, t), &at_free(&system, &nodal), 1e-12);
    let (u, v) = (&problem(&plate(&motion)).initial.u, &problem(&plate(&motion)).initial.v);
    let (of_u, of_v) = (-0.3 * phase.cos(), 0.3 * omega * phase.sin());
    for n in 0..system.body.mesh.n_nodes() {
        for (c, share) in [(0, 1.0), (1, 0.0)] {
            let Some((i, sign)) = entry(&system.body, n, c).filter(|e| e.0 < system.n_o()) else {
                continue;
            };
            assert!((sign * u[i] - share * of_u).abs() < 1e-15);
            assert!((sign * v[i] - share * of_v).abs() < 1e-15);
        }
    }
}

/// `table.rs`: the natural cubic spline through the points of a file, from a dense system for the four coefficients of every piece.
#[test]
fn histories_are_natural_splines() {
    let place = tempfile::tempdir().unwrap();
    let points = [(0.0, 0.3), (0.4, -0.2), (1.0, 0.9), (1.3, 0.5), (2.0, 0.0)];
    let text: String = points.iter().map(|(t, y)| format!("{t}; {y}\n")).collect();
    std::fs::write(place.path().join("load.csv"), format!("t; f\n# measured\n\n{text}")).unwrap();
    let base = plate(
        "gap = 1.0\n[[load]]\nkind = 'gravity'\namplitude = [0.5, 0.0]\ntable = 'load.csv'\n[run]\nuntil = 2.0\n",
    );
    let mut here = scene(&base);
    here.source.file = place.path().join("scene.toml");
    let system = signorini::problem::Problem::new(&here, None).unwrap().system;
    let unit =
        problem(&plate("gap = 1.0\n[[load]]\nkind = 'gravity'\namplitude = [0.5, 0.0]\n")).system;
    let unit = at(&unit, 0.0);
    // pieces a + bs + cs² + ds³ from their left ends
    let pieces = points.len() - 1;
    let mut rows: Vec<(Vec<(usize, f64)>, f64)> = vec![];
    for (i, pair) in points.windows(2).enumerate() {
        let (h, k): (f64, usize) = (pair[1].0 - pair[0].0, 4 * i);
        rows.push((vec![(k, 1.0)], pair[0].1));
        rows.push(((0..4).map(|p| (k + p, h.powi(p as i32))).collect(), pair[1].1));
        if i + 1 < pieces {
            rows.push((
                vec![(k + 1, 1.0), (k + 2, 2.0 * h), (k + 3, 3.0 * h * h), (k + 5, -1.0)],
                0.0,
            ));
            rows.push((vec![(k + 2, 2.0), (k + 3, 6.0 * h), (k + 6, -2.0)], 0.0));
        } else {
            rows.push((vec![(k + 2, 2.0), (k + 3, 6.0 * h)], 0.0));
        }
    }
    rows.push((vec![(2, 1.0)], 0.0));
    let mut a = nalgebra::DMatrix::zeros(4 * pieces, 4 * pieces);
    for (i, (row, _)) in rows.iter().enumerate() {
        row.iter().for_each(|(j, v)| a[(i, *j)] += v);
    }
    let right = nalgebra::DVector::from_iterator(4 * pieces, rows.iter().map(|r| r.1));
    let x = a.lu().solve(&right).unwrap();
    for t in [0.0, 0.1, 0.4, 0.77, 1.0, 1.2, 1.31, 1.9, 2.0] {
        let i = points.iter().rposition(|p| p.0 <= t).unwrap().min(pieces - 1);
        let s: f64 = t - points[i].0;
        let value: f64 = (0..4).map(|p| x[4 * i + p] * s.powi(p as i32)).sum();
        let wanted: Vec<f64> = unit.iter().map(|f| value * f).collect();
        assert_near(&at(&system, t), &wanted, 1e-12);
    }
}
