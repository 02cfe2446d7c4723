//! Harmonic-balance results: `/hbm` of own files, and those of other programs (MATLAB v7.3, CSV).
//!
//! `coefficients[p, 2N_h+1, n_O]` in the order `a_0, a_1, b_1, a_2, b_2, …` of `u_O(t) = Σ a_k cos kωt + b_k sin kωt`.

use std::path::Path;

use hdf5::Dataset;
use ndarray::{Array3, ArrayD};
use serde::{Deserialize, Serialize};

use super::journal::bits;
use super::reader::open;
use super::table::Table;
use super::{FamilyWriter, StoreError, write_text};

/// Where a function (harmonic, whether it is the sine) stands in `a_0, a_1, b_1, a_2, b_2, …`.
pub fn place_of_function((k, is_sine): (usize, bool)) -> usize {
    if k == 0 { 0 } else { 2 * k - 1 + usize::from(is_sine) }
}

/// One series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SeriesRecord {
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Number of harmonics.
    pub n_h: usize,
    /// `a_0, a_1, b_1, …`, each of length `n_O`.
    #[serde(with = "bits::many")]
    pub coefficients: Vec<f64>,
}

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
    let file = open(path)?;
    let missing = |what: &str| StoreError::Missing {
        path: path.to_owned(),
        what: format!("variable {what}"),
    };
    let omega: Vec<f64> =
        file.dataset(&names.omega).map_err(|_| missing(&names.omega))?.read_raw()?;
    let data = file.dataset(&names.coefficients).map_err(|_| missing(&names.coefficients))?;
    let all: ArrayD<f64> = data.read_dyn()?;
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
        return Err(StoreError::unusable(
            path,
            format!(
                "{} has the shape {shape:?}; {p} frequencies and {n_o} displacements u_O need [{p}, 2 N_h + 1, {n_o}]",
                names.coefficients
            ),
        ));
    };
    let own: Option<Vec<i64>> = file
        .dataset("hbm/harmonics")
        .and_then(|d| d.read_raw())
        .ok()
        .filter(|h: &Vec<i64>| h.len() == p);
    let flat: Vec<f64> = all.iter().copied().collect();
    let at = |i: usize, f: usize, n: usize| match reversed {
        false => flat[(i * functions + f) * n_o + n],
        true => flat[(n * functions + f) * p + i],
    };
    Ok((0..p)
        .map(|i| {
            let n_h = own.as_ref().map_or((functions - 1) / 2, |h| h[i] as usize);
            let used = (2 * n_h + 1).min(functions);
            let coefficients = (0..used)
                .flat_map(|f| (0..n_o).map(move |n| (f, n)))
                .map(|(f, n)| at(i, f, n))
                .collect();
            SeriesRecord { omega: omega[i], n_h, coefficients }
        })
        .collect())
}

/// Most harmonics of a series.
const MOST_HARMONICS: usize = 500;

/// One row of a CSV: harmonic, whether it is the sine, values.
type Function = (usize, bool, Vec<f64>);

/// Read series from CSV: a header, then one row a function: `point, omega, k, part, u_1, …, u_nO` with `part` `cos` or `sin`. Rows
/// that are not there are zero.
pub fn read_csv(path: &Path, n_o: usize) -> Result<Vec<SeriesRecord>, StoreError> {
    let text = std::fs::read_to_string(path).map_err(|e| StoreError::unusable(path, e))?;
    let bad = |line: usize, why: String| StoreError::unusable(path, format!("line {line}: {why}"));
    let header: Vec<&str> = text.lines().next().unwrap_or("").split(',').map(str::trim).collect();
    if header.len() < 4 || header[..4] != ["point", "omega", "k", "part"] {
        return Err(bad(1, "the header must begin with point, omega, k, part".into()));
    }
    let mut points: Vec<(String, f64, Vec<Function>)> = vec![];
    for (k, line) in text.lines().enumerate().skip(1) {
        let number = k + 1;
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() != 4 + n_o {
            let found = cells.len().saturating_sub(4);
            return Err(bad(
                number,
                format!(
                    "{found} displacements, the scene has {n_o} (columns: point, omega, k, part, u_1, …, u_{n_o})"
                ),
            ));
        }
        let parse = |s: &str| s.parse::<f64>().ok().filter(|x| x.is_finite());
        let omega = parse(cells[1]).filter(|w| *w > 0.0).ok_or_else(|| {
            bad(number, format!("omega \"{}\" is not a positive number", cells[1]))
        })?;
        let harmonic: usize = cells[2]
            .parse()
            .map_err(|_| bad(number, format!("k \"{}\" is not a whole number", cells[2])))?;
        let is_sine = match cells[3] {
            "cos" => false,
            "sin" => true,
            other => return Err(bad(number, format!("part \"{other}\" is neither cos nor sin"))),
        };
        let values: Option<Vec<f64>> = cells[4..].iter().map(|c| parse(c)).collect();
        let values = values.ok_or_else(|| bad(number, "a displacement is not a number".into()))?;
        if harmonic > MOST_HARMONICS {
            return Err(bad(number, format!("k = {harmonic}: at most {MOST_HARMONICS} harmonics")));
        }
        if harmonic == 0 && is_sine && values.iter().any(|v| *v != 0.0) {
            return Err(bad(number, "there is no sine of harmonic 0".into()));
        }
        if values.iter().any(|v| v.abs() > 1e100) {
            return Err(bad(number, "a displacement is beyond all reason".into()));
        }
        match points.last_mut() {
            Some(last) if last.0 == cells[0] => {
                if last.1 != omega {
                    return Err(bad(
                        number,
                        format!("point {} has omega {} and {omega}", cells[0], last.1),
                    ));
                }
                if last.2.iter().any(|r| (r.0, r.1) == (harmonic, is_sine)) {
                    return Err(bad(
                        number,
                        format!("harmonic {harmonic} {} stands there twice", cells[3]),
                    ));
                }
                last.2.push((harmonic, is_sine, values));
            }
            _ => points.push((cells[0].to_owned(), omega, vec![(harmonic, is_sine, values)])),
        }
    }
    Ok(points
        .into_iter()
        .map(|(_, omega, rows)| {
            let n_h = rows.iter().map(|r| r.0).max().unwrap_or(0);
            let mut coefficients = vec![0.0; (2 * n_h + 1) * n_o];
            for (k, is_sine, values) in rows {
                let f = place_of_function((k, is_sine));
                coefficients[f * n_o..(f + 1) * n_o].copy_from_slice(&values);
            }
            SeriesRecord { omega, n_h, coefficients }
        })
        .collect())
}

/// One row of a cross-check.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckRow {
    /// Frequency.
    pub omega: f64,
    /// Harmonics.
    pub n_h: usize,
    /// Energy of the series.
    pub energy: f64,
    /// Residual of the series in time.
    pub residual: f64,
    /// Return error of its initial state.
    pub return_error: f64,
    /// Verdict in one word.
    pub verdict: String,
    /// Verdict in words.
    pub message: String,
    /// How far shooting moved the state, relative (NaN: no orbit).
    pub moved: f64,
    /// Energy of the orbit.
    pub orbit_energy: f64,
    /// Change of the contact time over the period.
    pub contact_change: f64,
    /// Whether the sequence of switches stayed.
    pub same_sequence: bool,
}

/// Write `/crosscheck` into the file of a family.
pub fn write_crosscheck(family: &FamilyWriter, rows: &[CheckRow]) -> Result<(), StoreError> {
    let g = family.file().create_group("crosscheck")?;
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
    use hdf5::types::FixedAscii;
    let words: Vec<FixedAscii<32>> = rows
        .iter()
        .map(|r| FixedAscii::from_ascii(r.verdict.as_bytes()).unwrap_or_default())
        .collect();
    g.new_dataset_builder().with_data(&words).create("verdict")?;
    Ok(())
}

/// Read `/crosscheck`, if the file holds one.
pub fn read_crosscheck(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    use hdf5::types::FixedAscii;
    let file = open(path)?;
    let Ok(g) = file.group("crosscheck") else { return Ok(None) };
    let column = |name: &str| -> Result<Vec<f64>, StoreError> { Ok(g.dataset(name)?.read_raw()?) };
    let words: Vec<FixedAscii<32>> = g.dataset("verdict")?.read_raw()?;
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
    let columns: Result<Vec<Vec<f64>>, StoreError> = names.iter().map(|n| column(n)).collect();
    let c = columns?;
    Ok(Some(
        (0..words.len())
            .map(|i| CheckRow {
                omega: c[0][i],
                n_h: c[1][i] as usize,
                energy: c[2][i],
                residual: c[3][i],
                return_error: c[4][i],
                verdict: words[i].as_str().to_owned(),
                message: String::new(),
                moved: c[5][i],
                orbit_energy: c[6][i],
                contact_change: c[7][i],
                same_sequence: c[8][i] == 1.0,
            })
            .collect(),
    ))
}
