//! A problem's operators in HDF5, for other programs to solve the same equations.

use std::path::Path;

use ndarray::{Array1, Array2};

use super::StoreError;
use crate::contact::{ActiveSet, System};
use crate::fem::Csr;
use crate::problem::Problem;

fn dense(a: &Csr) -> Array2<f64> {
    let mut d = Array2::zeros((a.n_rows(), a.n_cols()));
    a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
    d
}

/// Write a problem as numbers one after the other (little-endian, double precision, matrices dense and by rows): `n_O`, `n_C`, end time, `M`, `K`, `N_C`,
/// `N_O`, `gap`, `f`, `u0`, `v0`, `active0` (1 = contact).
pub fn write_problem_flat(
    path: &Path,
    problem: &Problem,
    active: &ActiveSet,
    until: f64,
) -> Result<(), StoreError> {
    let system: &System = &problem.system;
    let conditions = system.conditions();
    let n_c = system.n_contact();
    let mut all = vec![system.n_o() as f64, n_c as f64, until];
    all.extend(dense(system.mass()));
    all.extend(dense(&system.body.stiffness));
    all.extend((0..n_c * n_c).map(|k| conditions.n_c[(k / n_c, k % n_c)]));
    all.extend(dense(&conditions.n_o));
    all.extend(system.gaps());
    all.extend(system.loads.constant.clone().unwrap_or_else(|| vec![0.0; system.n()]));
    all.extend(problem.initial.u.iter().chain(&problem.initial.v));
    all.extend(active.flags().iter().map(|&a| f64::from(u8::from(a))));
    let bytes: Vec<u8> = all.iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    std::fs::write(path, bytes).map_err(|e| StoreError::write(path, e))
}

/// Write `M`, `K`, `N_C`, `N_O` (dense, over `u = (u_O, u_C)`), `gap`, the constant load `f`, the initial state, its active set
/// and the end time.
pub fn write_problem(
    path: &Path,
    problem: &Problem,
    active: &ActiveSet,
    until: f64,
) -> Result<(), StoreError> {
    let system: &System = &problem.system;
    let conditions = system.conditions();
    let file = hdf5::File::create(path).map_err(|e| StoreError::unusable(path, e))?;
    let n_c = system.n_contact();
    let matrix = |name: &str, a: Array2<f64>| file.new_dataset_builder().with_data(&a).create(name);
    matrix("M", dense(system.mass()))?;
    matrix("K", dense(&system.body.stiffness))?;
    matrix("N_C", Array2::from_shape_fn((n_c, n_c), |(i, j)| conditions.n_c[(i, j)]))?;
    matrix("N_O", dense(&conditions.n_o))?;
    let vector = |name: &str, x: Vec<f64>| {
        file.new_dataset_builder().with_data(&Array1::from_vec(x)).create(name)
    };
    vector("gap", system.gaps())?;
    vector("f", system.loads.constant.clone().unwrap_or_else(|| vec![0.0; system.n()]))?;
    vector("u0", problem.initial.u.clone())?;
    vector("v0", problem.initial.v.clone())?;
    let active: Vec<u8> = active.flags().iter().map(|&a| u8::from(a)).collect();
    file.new_dataset_builder().with_data(&active).create("active0")?;
    file.new_dataset::<f64>().create("until")?.write_scalar(&until)?;
    file.flush()?;
    Ok(())
}
