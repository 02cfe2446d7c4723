//! Harmonic-balance results: `/hbm` of own files, and those of other programs (MATLAB v7.3, CSV).
//!
//! `coefficients[p, 2N_h+1, n_O]` in the order `a_0, a_1, b_1, a_2, b_2, …` of `u_O(t) = Σ a_k cos kωt + b_k sin kωt`.

use std::path::Path;

use hdf5::Dataset;
use ndarray::{Array3, ArrayD};

use super::StoreError;
use super::careful::{Careful, open, reading};
use super::columns::{SERIES, SeriesRow};
use super::schema::Rows;
use super::table::Form;
use crate::records::SeriesRecord;

/// The open tables of `/hbm`.
pub struct SeriesWriter {
    rows: Rows<SeriesRow>,
    coefficients: Dataset,
    count: usize,
    functions: usize,
    n_o: usize,
}

impl SeriesWriter {
    /// Create `/hbm` for up to `n_h` harmonics in the file of a family; `fed`: with `α`.
    pub fn create(
        file: &hdf5::File,
        n_h: usize,
        n_o: usize,
        fed: bool,
    ) -> Result<SeriesWriter, StoreError> {
        let functions = 2 * n_h + 1;
        let columns = SERIES.iter().filter(|c| fed || c.about.path != "hbm/alpha");
        let rows = Rows::create(file, columns, &|_| Form::plain(None, 64))?;
        let g = file.group("hbm")?;
        let builder = g.new_dataset::<f64>().chunk((1, functions, n_o)).deflate(1);
        let coefficients = builder.shape((0.., functions, n_o)).create("coefficients")?;
        Ok(SeriesWriter { rows, coefficients, count: 0, functions, n_o })
    }

    /// Append a series that belongs to row `point` of `/backbone`.
    pub fn push(&mut self, s: &SeriesRecord, point: usize) -> Result<(), StoreError> {
        self.rows.push(&SeriesRow {
            omega: s.omega,
            harmonics: s.n_h as i64,
            point: point as i64,
            alpha: s.alpha.unwrap_or(f64::NAN),
        });
        self.rows.append()?;
        let mut all = vec![0.0; self.functions * self.n_o];
        let shared = all.len().min(s.coefficients.len());
        all[..shared].copy_from_slice(&s.coefficients[..shared]);
        let view = Array3::from_shape_vec((1, self.functions, self.n_o), all)
            .map_err(|e| hdf5::Error::from(e.to_string()))?;
        self.coefficients.resize((self.count + 1, self.functions, self.n_o))?;
        self.coefficients.write_slice(view.view(), (self.count..self.count + 1, .., ..))?;
        self.count += 1;
        Ok(())
    }
}

/// Names of the variables in a file of another program.
#[derive(Debug, Clone)]
pub struct Names {
    /// Frequencies, `p` numbers.
    pub omega: String,
    /// `α` of viscous nonlinear modes, `p` numbers, if there is such a variable.
    pub alpha: String,
    /// Coefficients, of shape `p × (2N_h+1) × n_O` in MATLAB's or in C's order.
    pub coefficients: String,
}

impl Default for Names {
    fn default() -> Self {
        Names {
            omega: "hbm/omega".into(),
            alpha: "hbm/alpha".into(),
            coefficients: "hbm/coefficients".into(),
        }
    }
}

/// Read series from an HDF5 file (own, or MATLAB v7.3) for a body of `n_o` displacements.
pub(crate) fn read_series(
    path: &Path,
    names: &Names,
    n_o: usize,
) -> Result<Vec<SeriesRecord>, StoreError> {
    reading(path, || read_series_of(path, names, n_o))
}

fn read_series_of(path: &Path, names: &Names, n_o: usize) -> Result<Vec<SeriesRecord>, StoreError> {
    let file = open(path)?;
    let missing = |what: &str| StoreError::Missing {
        path: path.to_owned(),
        what: format!("variable {what}"),
    };
    let omega: Vec<f64> =
        file.dataset(&names.omega).map_err(|_| missing(&names.omega))?.values()?;
    let data = file.dataset(&names.coefficients).map_err(|_| missing(&names.coefficients))?;
    let all: ArrayD<f64> = data.array()?;
    let unusable = |why: String| StoreError::unusable(path, why);
    let of_matlab = data.attr("MATLAB_class").is_ok();
    let points = omega.len();
    let order = Order::of(all.shape(), of_matlab, points, n_o).ok_or_else(|| {
        unusable(format!(
            "{} has the shape {:?}; {points} frequencies and {n_o} displacements u_O need [{points}, 2 N_h + 1, {n_o}]",
            names.coefficients,
            all.shape()
        ))
    })?;
    let most = (order.functions - 1) / 2;
    if most > MOST_HARMONICS {
        return Err(unusable(format!("{most} harmonics: at most {MOST_HARMONICS}")));
    }
    if let Some(i) = omega.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        let what = format!("{}, point {i}: {} is not a positive frequency", names.omega, omega[i]);
        return Err(unusable(what));
    }
    let alpha: Option<Vec<f64>> = match file.dataset(&names.alpha) {
        Ok(data) => Some(data.values()?),
        Err(_) => None,
    };
    if let Some(alpha) = &alpha
        && (alpha.len() != points || !alpha.iter().all(|a| is_reasonable(*a)))
    {
        return Err(unusable(format!("{}: not one finite number a frequency", names.alpha)));
    }
    let own = own_harmonics(&file, points, most, path)?;
    let flat: Vec<f64> = all.iter().copied().collect();
    let series = |i: usize| {
        let coefficients: Vec<f64> = (0..2 * own[i] + 1)
            .flat_map(|f| (0..n_o).map(move |n| (f, n)))
            .map(|(f, n)| flat[order.place(i, f, n)])
            .collect();
        match coefficients.iter().find(|c| !is_reasonable(**c)) {
            Some(c) => Err(unusable(format!("{}, point {i}: {c}", names.coefficients))),
            None => {
                let alpha = alpha.as_ref().map(|a| a[i]);
                Ok(SeriesRecord { omega: omega[i], n_h: own[i], coefficients, alpha })
            }
        }
    };
    (0..points).map(series).collect()
}

/// How the coefficients stand in their array.
struct Order {
    points: usize,
    functions: usize,
    n_o: usize,
    /// Points last, as MATLAB's order looks from here.
    reversed: bool,
}

impl Order {
    /// MATLAB stores the dimensions in reverse, and says so; a single point may have lost its dimension.
    fn of(shape: &[usize], of_matlab: bool, points: usize, n_o: usize) -> Option<Order> {
        let p = points;
        let (reversed, functions) = match *shape {
            [a, f, n] if !of_matlab && a == p && n == n_o && f % 2 == 1 => (false, f),
            [n, f, a] if a == p && n == n_o && f % 2 == 1 => (true, f),
            [f, n] if !of_matlab && p == 1 && n == n_o && f % 2 == 1 => (false, f),
            [n, f] if p == 1 && n == n_o && f % 2 == 1 => (true, f),
            _ => return None,
        };
        Some(Order { points, functions, n_o, reversed })
    }

    /// Of function `f` of displacement `n` at a point.
    fn place(&self, point: usize, f: usize, n: usize) -> usize {
        match self.reversed {
            false => (point * self.functions + f) * self.n_o + n,
            true => (n * self.functions + f) * self.points + point,
        }
    }
}

/// The number of harmonics of each point, which an own file says.
fn own_harmonics(
    file: &hdf5::File,
    points: usize,
    most: usize,
    path: &Path,
) -> Result<Vec<usize>, StoreError> {
    let Ok(data) = file.dataset("hbm/harmonics") else { return Ok(vec![most; points]) };
    let own = data.values::<i64>()?;
    // the frequencies of other programs may stand beside an own table of another length
    if own.len() != points {
        return Ok(vec![most; points]);
    }
    let wrong = |(i, n): (usize, i64)| {
        StoreError::unusable(
            path,
            format!("/hbm/harmonics, point {i}: {n} harmonics, and the coefficients have {most}"),
        )
    };
    let known = |(i, n): (usize, i64)| match usize::try_from(n) {
        Ok(n) if n <= most => Ok(n),
        _ => Err(wrong((i, n))),
    };
    own.into_iter().enumerate().map(known).collect()
}

/// A coefficient that a motion can have: finite, and no overflow in its square.
pub(super) fn is_reasonable(x: f64) -> bool {
    x.is_finite() && x.abs() <= 1e100
}

/// Most harmonics of a series.
pub(super) const MOST_HARMONICS: usize = 500;
