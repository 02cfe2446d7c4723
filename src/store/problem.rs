//! A problem's operators in HDF5, for other programs to solve the same equations.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use ndarray::{Array1, Array2, ArrayD};

use super::StoreError;
use crate::contact::{Conditions, States, System};
use crate::fem::Csr;
use crate::problem::Problem;

fn dense(a: &Csr) -> DMatrix<f64> {
    let mut d = DMatrix::zeros(a.n_rows(), a.n_cols());
    a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
    d
}

/// The contact displacements `y` of masters that give up their inertia, which face nothing and bear nothing, as others know nothing of them: `y = Y (u_O, u_C)` from
/// `N_yO u_O + N_yC u_C + N_yy y = 0`. `N_C`, `N_O` of the others, and `T` from `(u_O, u_C)` to `u`.
fn without_masters(conditions: &Conditions, n_o: usize) -> [DMatrix<f64>; 3] {
    let (all, of_o) = (conditions.n_c.dense(), dense(&conditions.n_o));
    let (count, n) = (all.nrows(), conditions.facing());
    let of_u =
        DMatrix::from_fn(
            count,
            n_o + n,
            |i, j| {
                if j < n_o { of_o[(i, j)] } else { all[(i, j - n_o)] }
            },
        );
    let mut t = DMatrix::identity(n_o + count, n_o + n);
    let mut seen = of_u.rows(0, n).into_owned();
    if count > n {
        let own = all.view((n, n), (count - n, count - n)).into_owned();
        // a P-matrix: every principal block is regular
        if let Some(y) = own.lu().solve(&of_u.rows(n, count - n)) {
            seen -= all.view((0, n), (n, count - n)) * &y;
            t.rows_mut(n_o + n, count - n).copy_from(&-y);
        }
    }
    [seen.columns(n_o, n).into_owned(), seen.columns(0, n_o).into_owned(), t]
}

fn by_rows(a: &DMatrix<f64>) -> ArrayD<f64> {
    Array2::from_shape_fn(a.shape(), |at| a[at]).into_dyn()
}

/// With friction `E`, a tangent a row over `u_O` (zeros where there is none), `limit`, the largest force over the pressure (`μ` times the area), and `surface`, the velocity of
/// the obstacle's surface, of each contact point.
fn friction(system: &System) -> Vec<(&'static str, ArrayD<f64>)> {
    let Some(tangents) = system.tangents() else { return vec![] };
    let count = tangents.len();
    let mut along = Array2::zeros((count, system.n_o()));
    let (mut limit, mut surface) = (Array1::zeros(count), Array1::zeros(count));
    for (i, tangent) in tangents.iter().enumerate() {
        let Some(tangent) = tangent else { continue };
        tangent.row.iter().for_each(|&(j, w)| along[(i, j)] = w);
        limit[i] = system.limit_over_pressure(i);
        surface[i] = tangent.surface;
    }
    vec![("E", along.into_dyn()), ("limit", limit.into_dyn()), ("surface", surface.into_dyn())]
}

/// `M`, `K`, `N_C`, `N_O` (dense, over `u = (u_O, u_C)`), `gap`, the constant load `f`, the initial state, by their names; displacements of masters are eliminated.
fn operators(problem: &Problem) -> Vec<(&'static str, ArrayD<f64>)> {
    let system: &System = &problem.system;
    let [n_c, n_o, t] = without_masters(system.conditions(), system.n_o());
    let reduced = |a: &Csr| by_rows(&(t.transpose() * dense(a) * &t));
    let load = system.loads.constant.clone().unwrap_or_else(|| vec![0.0; system.n()]);
    let vector = |x: Vec<f64>| Array1::from_vec(x).into_dyn();
    let load = t.transpose() * DVector::from_vec(load);
    vec![
        ("M", reduced(system.mass())),
        ("K", reduced(&system.body.stiffness)),
        ("N_C", by_rows(&n_c)),
        ("N_O", by_rows(&n_o)),
        ("gap", vector(system.gaps())),
        ("f", vector(load.as_slice().to_vec())),
        ("u0", vector(problem.initial.u.clone())),
        ("v0", vector(problem.initial.v.clone())),
    ]
}

/// Write a problem as numbers one after the other (little-endian, double precision, matrices by rows): `n_O`, `n_C`, end time, what [`write_problem`] writes in
/// its order, `active0` (1 = contact), and what belongs to friction, if there is any.
pub(crate) fn write_problem_flat(
    path: &Path,
    problem: &Problem,
    active: &States,
    until: f64,
) -> Result<(), StoreError> {
    let system = &problem.system;
    let mut all = vec![system.n_o() as f64, system.n_contact() as f64, until];
    operators(problem).into_iter().for_each(|(_, array)| all.extend(array));
    all.extend(active.codes().map(f64::from));
    friction(system).into_iter().for_each(|(_, array)| all.extend(array));
    let bytes: Vec<u8> = all.iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    std::fs::write(path, bytes).map_err(|e| StoreError::write(path, e))
}

/// Write `M`, `K`, `N_C`, `N_O` (dense, over `u = (u_O, u_C)`), `gap`, the constant load `f`, the initial state `u0`, `v0`, its active set
/// and the end time; with friction what belongs to it.
pub(crate) fn write_problem(
    path: &Path,
    problem: &Problem,
    active: &States,
    until: f64,
) -> Result<(), StoreError> {
    let file = hdf5::File::create(path).map_err(|e| StoreError::unusable(path, e))?;
    for (name, array) in operators(problem).into_iter().chain(friction(&problem.system)) {
        file.new_dataset_builder().with_data(&array).create(name)?;
    }
    let active: Vec<u8> = active.codes().collect();
    file.new_dataset_builder().with_data(&active).create("active0")?;
    file.new_dataset::<f64>().create("until")?.write_scalar(&until)?;
    file.flush()?;
    Ok(())
}
