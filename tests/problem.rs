//! From a scene to the problem, file by file of `src/problem`, against slow obvious computations: dense matrices, fields written down at nodes, bisection.

#[path = "problem/given.rs"]
mod given;
#[path = "problem/loads.rs"]
mod loads;
#[path = "problem/states.rs"]
mod states;

use nalgebra::{DMatrix, DVector};
use signorini::fem::Csr;
use signorini::problem::Problem;
use signorini::scenario::Scene;

/// All entries of a sparse matrix.
fn dense(a: &Csr) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(a.n_rows(), a.n_cols());
    a.triplets().for_each(|(i, j, v)| all[(i, j)] += v);
    all
}

fn vector(x: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(x)
}

fn assert_near(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let size = b.iter().fold(1e-300f64, |m, x| m.max(x.abs()));
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= tolerance * size, "{k}: {a} {b}");
    }
}

/// A plate held at the left, before an obstacle at the right, of unit modulus and density.
fn plate(tables: &str) -> String {
    format!(
        "[body]\nkind = 'plate'\nsize = [1.5, 0.8]\nelements = [3, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 2.0\nthickness = 0.5\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\n{tables}"
    )
}

/// What is wrong with a scene.
fn refused(text: &str) -> String {
    let scene = Scene::parse(text, "test.toml".as_ref()).unwrap_or_else(|e| panic!("{e}"));
    match Problem::new(&scene, None) {
        Ok(_) => panic!("taken: {text}"),
        Err(e) => e.to_string(),
    }
}
