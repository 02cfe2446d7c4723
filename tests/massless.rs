//! Matrices whose mass knows fewer points than the body has motions: what has no mass follows statically.

use std::path::Path;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde_json::Value;
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::store::Stored;

use crate::common::json;

/// A plate of Q4 elements, held at its left.
const PLATE: &str = "[body]\nkind = 'plate'\nsize = [2.0, 1.0]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
    [[support]]\nedge = 'left'\nfix = ['x', 'y']\n";

struct Body {
    k: DMatrix<f64>,
    m: DMatrix<f64>,
    /// Rows of the right edge along x.
    tip: Vec<usize>,
}

/// The stiffness as it is, and a mass that is integrated with one point an element: `ρA NᵀN`, all four `N` a quarter.
fn body(folder: &Path) -> Body {
    let path = folder.join("plate.toml");
    std::fs::write(&path, PLATE).unwrap();
    let system = Problem::new(&Scene::read(&path).unwrap(), None).unwrap().system;
    let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
    let n = system.n();
    let mut k = DMatrix::zeros(n, n);
    system.body.stiffness.triplets().for_each(|(i, j, v)| k[(i, j)] = v);
    let mut m = DMatrix::zeros(n, n);
    for element in mesh.elements() {
        for c in 0..2 {
            let own: Vec<usize> =
                element.nodes.iter().filter_map(|&node| dofs.column(node, c)).collect();
            for (&i, &j) in own.iter().flat_map(|i| own.iter().map(move |j| (i, j))) {
                m[(i, j)] += 0.25 / 16.0;
            }
        }
    }
    let right = mesh.group_nodes("right");
    let tip = right.into_iter().filter_map(|node| dofs.column(node, 0)).collect();
    Body { k, m, tip }
}

fn written(folder: &Path, name: &str, a: &DMatrix<f64>) {
    let mut text = String::from("%%MatrixMarket matrix coordinate real general\n");
    let all = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
    let entries: Vec<_> = all.filter(|&(i, j)| a[(i, j)] != 0.0).collect();
    text += &format!("{} {} {}\n", a.nrows(), a.ncols(), entries.len());
    for (i, j) in entries {
        text += &format!("{} {} {:.17e}\n", i + 1, j + 1, a[(i, j)]);
    }
    std::fs::write(folder.join(name), text).unwrap();
}

/// The motions that move no mass, and those that their forces do not: `M Z = 0`, `SᵀK X = 0` for `S = [e_C, Z]`.
struct Split {
    s: DMatrix<f64>,
    x: DMatrix<f64>,
}

impl Split {
    fn of(b: &Body, contact: &[usize]) -> Split {
        let n = b.k.nrows();
        let eigen = SymmetricEigen::new(b.m.clone());
        let largest = eigen.eigenvalues.amax();
        let null: Vec<DVector<f64>> = (0..n)
            .filter(|&i| eigen.eigenvalues[i].abs() < 1e-12 * largest)
            .map(|i| eigen.eigenvectors.column(i).into_owned())
            .collect();
        assert!(null.len() > 4, "{} motions without mass", null.len());
        let unit = |&i: &usize| {
            let mut e = DVector::zeros(n);
            e[i] = 1.0;
            e
        };
        let all: Vec<DVector<f64>> = contact.iter().map(unit).chain(null).collect();
        // some of them move contact rows alone: a basis, by Gram and Schmidt, twice for rounding
        let mut own: Vec<DVector<f64>> = vec![];
        for mut z in all {
            for _ in 0..2 {
                for e in &own {
                    z -= e * e.dot(&z);
                }
            }
            if z.norm() > 1e-9 {
                own.push(z.normalize());
            }
        }
        let s = DMatrix::from_columns(&own);
        // the null space of SᵀK, as that of (SᵀK)ᵀ(SᵀK)
        let rows = s.transpose() * &b.k;
        let eigen = SymmetricEigen::new(rows.transpose() * &rows);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].abs().total_cmp(&eigen.eigenvalues[b].abs()));
        let free =
            order[..n - s.ncols()].iter().map(|&i| eigen.eigenvectors.column(i).into_owned());
        Split { s, x: DMatrix::from_columns(&free.collect::<Vec<_>>()) }
    }

    fn frequencies(&self, b: &Body) -> Vec<f64> {
        let m = self.x.transpose() * &b.m * &self.x;
        let k = self.x.transpose() * &b.k * &self.x;
        let l = m.cholesky().unwrap().l();
        let half = l.solve_lower_triangular(&k).unwrap();
        let whole = l.solve_lower_triangular(&half.transpose()).unwrap();
        let whole = 0.5 * (&whole + whole.transpose());
        let mut all: Vec<f64> =
            SymmetricEigen::new(whole).eigenvalues.iter().map(|w| w.max(0.0).sqrt()).collect();
        all.sort_by(f64::total_cmp);
        all
    }
}

fn ran(folder: &Path, contact: &str, rest: &str) -> (Value, Stored) {
    let path = folder.join("matrices.toml");
    let text = format!(
        "[body]\nkind = 'matrices'\nstiffness_matrix = 'k.mtx'\nmass_matrix = 'm.mtx'\n{contact}\n{rest}"
    );
    std::fs::write(&path, text).unwrap();
    let out = folder.join("matrices.h5").display().to_string();
    let said = json(&["run", path.to_str().unwrap(), "-o", &out, "--force"]);
    (said, Stored::read(Path::new(&out)).unwrap())
}

/// Frequencies of the body with and without contact rows, and what the file says of it.
#[test]
fn motions_without_mass_follow() {
    let folder = tempfile::tempdir().unwrap();
    let b = body(folder.path());
    written(folder.path(), "k.mtx", &b.k);
    written(folder.path(), "m.mtx", &b.m);
    for contact in [&[][..], &b.tip[..]] {
        let split = Split::of(&b, contact);
        let expected = split.frequencies(&b);
        let table = match contact {
            [] => String::new(),
            rows => format!(
                "[contact]\ndisplacements = {rows:?}\ngap = 0.1\nstress = 'reaction'\ninertia = 'constant'"
            ),
        };
        let path = folder.path().join("modes.toml");
        let text = format!(
            "[body]\nkind = 'matrices'\nstiffness_matrix = 'k.mtx'\nmass_matrix = 'm.mtx'\n{table}\n"
        );
        std::fs::write(&path, text).unwrap();
        let said = json(&["modes", path.to_str().unwrap(), "--count", "6"]);
        let found = said["open"]["omega"].as_array().unwrap();
        let found: Vec<f64> = found.iter().filter_map(Value::as_f64).collect();
        assert!(found.len() >= 6);
        for (a, b) in found.iter().zip(&expected) {
            assert!((a / b - 1.0).abs() < 1e-8, "{found:?} {expected:?}");
        }
    }
    let said = json(&["inspect", folder.path().join("m.mtx").to_str().unwrap()]);
    assert_eq!(said["null_motions"], 8, "{said}");
}

/// A load drives the tip against an obstacle: Runge-Kutta steps over the motions that have mass, forces of the contact by Gauss and Seidel.
#[test]
fn contact_and_motions_without_mass_follow_together() {
    let folder = tempfile::tempdir().unwrap();
    let b = body(folder.path());
    written(folder.path(), "k.mtx", &b.k);
    written(folder.path(), "m.mtx", &b.m);
    let n = b.k.nrows();
    let force: Vec<f64> =
        (0..n).map(|i| if b.tip.contains(&i) { 0.0 } else { 0.02 * (i as f64).sin() }).collect();
    let (gap, omega, until) = (0.02, 0.7, 12.0);
    let (said, stored) = ran(
        folder.path(),
        &format!(
            "[contact]\ndisplacements = {:?}\ngap = {gap}\nstress = 'reaction'\ninertia = 'constant'",
            b.tip
        ),
        &format!(
            "[[load]]\nkind = 'force'\namplitude = {force:?}\nomega = {omega}\n[run]\nuntil = {until}\nsamples = 48\n"
        ),
    );
    assert!(stored.switch_t.len() > 4, "{said}");
    let Split { s, x } = Split::of(&b, &b.tip);
    let inner = s.transpose() * &b.k * &s;
    let compliance = &s * inner.try_inverse().unwrap() * s.transpose();
    let m = (x.transpose() * &b.m * &x).cholesky().unwrap();
    let k = x.transpose() * &b.k * &x;
    let f = DVector::from_vec(force);
    // what follows from a, the load and the contact
    let displacement = |t: f64, a: &DVector<f64>, lambda: &mut DVector<f64>| -> DVector<f64> {
        let load = &f * (omega * t).cos();
        let free = &x * a + &compliance * &load;
        for _ in 0..2000 {
            let mut change = 0.0f64;
            for &i in &b.tip {
                let along: f64 = b.tip.iter().map(|&j| compliance[(i, j)] * lambda[j]).sum();
                let rest = free[i] + along - compliance[(i, i)] * lambda[i];
                let new = ((gap - rest) / compliance[(i, i)]).min(0.0);
                change = change.max((new - lambda[i]).abs());
                lambda[i] = new;
            }
            if change < 1e-16 {
                break;
            }
        }
        free + &compliance * &*lambda
    };
    let mut lambda = DVector::zeros(n);
    let mut worst = 0.0f64;
    let steps = 6000usize;
    let h = until / steps as f64;
    let (mut a, mut v) = (DVector::zeros(x.ncols()), DVector::zeros(x.ncols()));
    let mut size = 0.0f64;
    let mut seen = 0;
    for step in 0..=steps {
        let t = h * step as f64;
        // states at switches lie between the steps
        if let Some(row) = stored.t.iter().position(|s| (s - t).abs() < 1e-9) {
            let u = displacement(t, &a, &mut lambda);
            for i in 0..n {
                worst = worst.max((stored.displacement(row, i)[0] - u[i]).abs());
                size = size.max(u[i].abs());
            }
            seen += 1;
        }
        let mut rate = |t: f64, a: &DVector<f64>| {
            displacement(t, a, &mut lambda);
            let forces = &f * (omega * t).cos() + &lambda;
            m.solve(&(x.transpose() * forces - &k * a))
        };
        let a1 = rate(t, &a);
        let (u2, v2) = (&a + 0.5 * h * &v, &v + 0.5 * h * &a1);
        let a2 = rate(t + 0.5 * h, &u2);
        let (u3, v3) = (&a + 0.5 * h * &v2, &v + 0.5 * h * &a2);
        let a3 = rate(t + 0.5 * h, &u3);
        let (u4, v4) = (&a + h * &v3, &v + h * &a3);
        let a4 = rate(t + h, &u4);
        a += h / 6.0 * (&v + 2.0 * &v2 + 2.0 * &v3 + &v4);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    assert!(seen > 40 && worst < 1e-6 * size, "{seen} states, {worst} of {size}");
}
