//! Harmonic-balance results: `/hbm` of own files, and those of other programs (MATLAB v7.3, CSV).
//!
//! `coefficients[p, 2N_h+1, n_O]` in the order `a_0, a_1, b_1, a_2, b_2, …` of `u_O(t) = Σ a_k cos kωt + b_k sin kωt`.

use std::path::Path;

use hdf5::Dataset;
use ndarray::{Array3, ArrayD};

use super::reader::{Careful, open, reading};
use super::table::Table;
use super::{StoreError, write_text};
use crate::records::{CheckRow, SeriesRecord, VerdictKind};

/// The open tables of `/hbm`.
pub struct SeriesWriter {
    omega: Table<f64>,
    harmonics: Table<i64>,
    point: Table<i64>,
    coefficients: Dataset,
    rows: usize,
    functions: usize,
    n_o: usize,
}

impl SeriesWriter {
    /// Create `/hbm` for up to `n_h` harmonics in the file of a family.
    pub fn create(file: &hdf5::File, n_h: usize, n_o: usize) -> Result<SeriesWriter, StoreError> {
        let g = file.create_group("hbm")?;
        let functions = 2 * n_h + 1;
        let omega = Table::create(&g, "omega", None, 64, false, "1/time")?;
        let harmonics = Table::create(&g, "harmonics", None, 64, false, "number")?;
        let point = Table::create(&g, "point", None, 64, false, "row of /backbone")?;
        let builder = g.new_dataset::<f64>().chunk((1, functions, n_o)).deflate(1);
        let coefficients = builder.shape((0.., functions, n_o)).create("coefficients")?;
        write_text(&coefficients, "units", "length; order a_0, a_1, b_1, a_2, b_2, … of u_O")?;
        Ok(SeriesWriter { omega, harmonics, point, coefficients, rows: 0, functions, n_o })
    }

    /// Append a series that belongs to row `point` of `/backbone`.
    pub fn push(&mut self, s: &SeriesRecord, point: usize) -> Result<(), StoreError> {
        self.omega.push(&[s.omega]);
        self.omega.append()?;
        self.harmonics.push(&[s.n_h as i64]);
        self.harmonics.append()?;
        self.point.push(&[point as i64]);
        self.point.append()?;
        let mut all = vec![0.0; self.functions * self.n_o];
        let shared = all.len().min(s.coefficients.len());
        all[..shared].copy_from_slice(&s.coefficients[..shared]);
        let view = Array3::from_shape_vec((1, self.functions, self.n_o), all)
            .map_err(|e| hdf5::Error::from(e.to_string()))?;
        self.coefficients.resize((self.rows + 1, self.functions, self.n_o))?;
        self.coefficients.write_slice(view.view(), (self.rows..self.rows + 1, .., ..))?;
        self.rows += 1;
        Ok(())
    }
}

/// Names of the variables in a file of another program.
#[derive(Debug, Clone)]
pub struct Names {
    /// Frequencies, `p` numbers.
    pub omega: String,
    /// Coefficients, of shape `p × (2N_h+1) × n_O` in MATLAB's or in C's order.
    pub coefficients: String,
}

impl Default for Names {
    fn default() -> Self {
        Names { omega: "hbm/omega".into(), coefficients: "hbm/coefficients".into() }
    }
}

/// Read series from an HDF5 file (own, or MATLAB v7.3) for a body of `n_o` displacements.
pub fn read_series(
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
    let unusable = |why: String| StoreError::unusable(path, why);
    let omega: Vec<f64> =
        file.dataset(&names.omega).map_err(|_| missing(&names.omega))?.values()?;
    let data = file.dataset(&names.coefficients).map_err(|_| missing(&names.coefficients))?;
    let all: ArrayD<f64> = data.array()?;
    let p = omega.len();
    let shape = all.shape().to_vec();
    // MATLAB stores the dimensions in reverse, and says so; a single point may have lost its dimension
    let of_matlab = data.attr("MATLAB_class").is_ok();
    let wanted = |s: &[usize]| match *s {
        [a, f, n] if !of_matlab && a == p && n == n_o && f % 2 == 1 => Some((false, f)),
        [n, f, a] if a == p && n == n_o && f % 2 == 1 => Some((true, f)),
        [f, n] if !of_matlab && p == 1 && n == n_o && f % 2 == 1 => Some((false, f)),
        [n, f] if p == 1 && n == n_o && f % 2 == 1 => Some((true, f)),
        _ => None,
    };
    let Some((reversed, functions)) = wanted(&shape) else {
        return Err(unusable(format!(
            "{} has the shape {shape:?}; {p} frequencies and {n_o} displacements u_O need [{p}, 2 N_h + 1, {n_o}]",
            names.coefficients
        )));
    };
    let most = (functions - 1) / 2;
    if most > MOST_HARMONICS {
        return Err(unusable(format!("{most} harmonics: at most {MOST_HARMONICS}")));
    }
    if let Some(i) = omega.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        let what = format!("{}, point {i}: {} is not a positive frequency", names.omega, omega[i]);
        return Err(unusable(what));
    }
    let own = match file.dataset("hbm/harmonics") {
        Err(_) => vec![most as i64; p],
        Ok(data) => data.values::<i64>()?,
    };
    // the frequencies of other programs may stand beside an own table of another length
    let own = if own.len() == p { own } else { vec![most as i64; p] };
    if let Some((i, n)) = own.iter().enumerate().find(|(_, n)| !(0..=most as i64).contains(*n)) {
        let what =
            format!("/hbm/harmonics, point {i}: {n} harmonics, and the coefficients have {most}");
        return Err(unusable(what));
    }
    let flat: Vec<f64> = all.iter().copied().collect();
    let at = |i: usize, f: usize, n: usize| match reversed {
        false => flat[(i * functions + f) * n_o + n],
        true => flat[(n * functions + f) * p + i],
    };
    (0..p)
        .map(|i| {
            let n_h = own[i] as usize;
            let coefficients: Vec<f64> = (0..2 * n_h + 1)
                .flat_map(|f| (0..n_o).map(move |n| (f, n)))
                .map(|(f, n)| at(i, f, n))
                .collect();
            match coefficients.iter().find(|c| !is_reasonable(**c)) {
                Some(c) => Err(unusable(format!("{}, point {i}: {c}", names.coefficients))),
                None => Ok(SeriesRecord { omega: omega[i], n_h, coefficients }),
            }
        })
        .collect()
}

/// A coefficient that a motion can have: finite, and no overflow in its square.
pub(super) fn is_reasonable(x: f64) -> bool {
    x.is_finite() && x.abs() <= 1e100
}

/// Most harmonics of a series.
pub(super) const MOST_HARMONICS: usize = 500;

/// Write `/crosscheck` into the file of a family.
pub(super) fn write_crosscheck(file: &hdf5::File, rows: &[CheckRow]) -> Result<(), StoreError> {
    let g = file.create_group("crosscheck")?;
    let column = |name: &str, f: &dyn Fn(&CheckRow) -> f64| -> Result<(), StoreError> {
        let values: Vec<f64> = rows.iter().map(f).collect();
        g.new_dataset_builder().with_data(&values).create(name)?;
        Ok(())
    };
    column("omega", &|r| r.omega)?;
    column("harmonics", &|r| r.n_h as f64)?;
    column("hbm_energy", &|r| r.energy)?;
    column("residual", &|r| r.residual)?;
    column("return_error", &|r| r.return_error)?;
    column("moved", &|r| r.moved)?;
    column("orbit_energy", &|r| r.orbit_energy)?;
    column("contact_change", &|r| r.contact_change)?;
    column("same_sequence", &|r| f64::from(u8::from(r.same_sequence)))?;
    use hdf5::types::{FixedAscii, FixedUnicode};
    // what a file has room for
    let cut = |text: &str| {
        let mut end = text.len().min(255);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text[..end].replace('\0', " ").parse().unwrap_or_default()
    };
    let words: Vec<FixedAscii<32>> = rows
        .iter()
        .map(|r| FixedAscii::from_ascii(r.verdict.name().as_bytes()).unwrap_or_default())
        .collect();
    g.new_dataset_builder().with_data(&words).create("verdict")?;
    let messages: Vec<FixedUnicode<256>> = rows.iter().map(|r| cut(&r.message)).collect();
    g.new_dataset_builder().with_data(&messages).create("message")?;
    Ok(())
}

/// Read `/crosscheck`, if the file holds one.
pub fn read_crosscheck(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    reading(path, || read_crosscheck_of(path))
}

fn read_crosscheck_of(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    use hdf5::types::FixedAscii;
    let file = open(path)?;
    let Ok(g) = file.group("crosscheck") else { return Ok(None) };
    let words: Vec<FixedAscii<32>> = g.dataset("verdict")?.values()?;
    // files of earlier versions keep the verdict only
    let messages: Vec<hdf5::types::FixedUnicode<256>> = match g.dataset("message") {
        Ok(data) => data.values()?,
        Err(_) => vec![],
    };
    let names = [
        "omega",
        "harmonics",
        "hbm_energy",
        "residual",
        "return_error",
        "moved",
        "orbit_energy",
        "contact_change",
        "same_sequence",
    ];
    let mut c: Vec<Vec<f64>> = vec![];
    for name in names {
        let column: Vec<f64> = g.dataset(name)?.values()?;
        if column.len() != words.len() {
            let what =
                format!("damaged: /crosscheck/{name} has {} rows of {}", column.len(), words.len());
            return Err(StoreError::unusable(path, what));
        }
        c.push(column);
    }
    Ok(Some(
        (0..words.len())
            .map(|i| CheckRow {
                omega: c[0][i],
                n_h: c[1][i] as usize,
                energy: c[2][i],
                residual: c[3][i],
                return_error: c[4][i],
                verdict: VerdictKind::of_name(words[i].as_str()),
                message: messages.get(i).map_or(String::new(), |m| m.as_str().to_owned()),
                moved: c[5][i],
                orbit_energy: c[6][i],
                contact_change: c[7][i],
                same_sequence: c[8][i] == 1.0,
            })
            .collect(),
    ))
}
