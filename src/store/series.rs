//! Harmonic-balance results: `/hbm` of own files, and those of other programs (MATLAB v7.3, CSV).
//!
//! `coefficients[p, 2N_h+1, n_O]` in the order `a_0, a_1, b_1, a_2, b_2, …` of `u_O(t) = Σ a_k cos kωt + b_k sin kωt`.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use hdf5::Dataset;
use ndarray::{Array3, ArrayD};

use super::reader::{Careful, open, reading};
use super::table::Table;
use super::{StoreError, write_text};
use crate::records::{CheckRow, SeriesRecord, VerdictKind, place_of_function};

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
fn is_reasonable(x: f64) -> bool {
    x.is_finite() && x.abs() <= 1e100
}

/// Most harmonics of a series.
const MOST_HARMONICS: usize = 500;

/// The rows of one point of a CSV.
struct CsvPoint {
    label: String,
    /// Line of its first row.
    line: usize,
    omega: f64,
    /// Values and line of each function.
    rows: BTreeMap<(usize, bool), (usize, Vec<f64>)>,
}

/// Read series from CSV: a header, then one row a function: `point, omega, k, part, u_1, …, u_nO` with `part` `cos` or `sin`. The rows
/// may stand in any order; points come in the order of their first rows. A point has the cosine of every harmonic from 0 to its
/// last, and either all sines or none (a motion that is symmetric in time). Cells are parted by commas, semicolons or tabs.
pub fn read_csv(path: &Path, n_o: usize) -> Result<Vec<SeriesRecord>, StoreError> {
    let bytes = std::fs::read(path).map_err(|e| StoreError::unusable(path, e))?;
    let bad = |line: usize, why: String| StoreError::unusable(path, format!("line {line}: {why}"));
    let text = std::str::from_utf8(&bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        bad(line, "is no text in UTF-8".into())
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let is_content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = text.lines().enumerate().filter(|(_, line)| is_content(line));
    let (first, header) = lines.next().ok_or_else(|| bad(1, "the file is empty".into()))?;
    let separator = [',', ';', '\t'].into_iter().find(|s| header.contains(*s)).unwrap_or(',');
    let cells_of = |line: &'_ str| -> Vec<String> {
        line.split(separator).map(|c| c.trim().trim_matches('"').to_owned()).collect()
    };
    let names = cells_of(header);
    if names.len() < 4 || names[..4] != ["point", "omega", "k", "part"] {
        let why = "the header must begin with point, omega, k, part (separated by commas)";
        return Err(bad(first + 1, why.into()));
    }
    let mut points: Vec<CsvPoint> = vec![];
    let mut place_of: HashMap<String, usize> = HashMap::new();
    for (k, line) in lines {
        let number = k + 1;
        let cells = cells_of(line);
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
        let omega = parse(&cells[1]).filter(|w| *w > 0.0).ok_or_else(|| {
            bad(number, format!("omega \"{}\" is not a positive number", cells[1]))
        })?;
        let harmonic: usize = cells[2]
            .parse()
            .map_err(|_| bad(number, format!("k \"{}\" is not a whole number", cells[2])))?;
        let is_sine = match cells[3].as_str() {
            "cos" => false,
            "sin" => true,
            other => return Err(bad(number, format!("part \"{other}\" is neither cos nor sin"))),
        };
        let values: Result<Vec<f64>, StoreError> = cells[4..]
            .iter()
            .map(|c| {
                let comma = separator != ',' && c.contains(',');
                let hint =
                    if comma { " (write a point, no comma, before the decimals)" } else { "" };
                parse(c).ok_or_else(|| bad(number, format!("\"{c}\" is not a finite number{hint}")))
            })
            .collect();
        let values = values?;
        if harmonic > MOST_HARMONICS {
            return Err(bad(number, format!("k = {harmonic}: at most {MOST_HARMONICS} harmonics")));
        }
        if harmonic == 0 && is_sine {
            if values.iter().any(|v| *v != 0.0) {
                return Err(bad(number, "there is no sine of harmonic 0".into()));
            }
            continue;
        }
        if !values.iter().all(|v| is_reasonable(*v)) {
            return Err(bad(number, "a displacement is beyond all reason".into()));
        }
        let place = *place_of.entry(cells[0].clone()).or_insert_with(|| {
            let (label, rows) = (cells[0].clone(), BTreeMap::new());
            points.push(CsvPoint { label, line: number, omega, rows });
            points.len() - 1
        });
        let point = &mut points[place];
        if point.omega != omega {
            let why = format!("point {} has omega {} and {omega}", cells[0], point.omega);
            return Err(bad(number, why));
        }
        if let Some((line, _)) = point.rows.insert((harmonic, is_sine), (number, values)) {
            let why = format!(
                "harmonic {harmonic} {} of point {} stands there twice, first in line {line}",
                cells[3], cells[0]
            );
            return Err(bad(number, why));
        }
    }
    points.into_iter().map(|p| p.series(n_o).map_err(|(line, why)| bad(line, why))).collect()
}

impl CsvPoint {
    /// The series, if no row is missing.
    fn series(self, n_o: usize) -> Result<SeriesRecord, (usize, String)> {
        let n_h = self.rows.keys().map(|r| r.0).max().unwrap_or(0);
        let has_sines = self.rows.keys().any(|r| r.1);
        let mut coefficients = vec![0.0; (2 * n_h + 1) * n_o];
        for function in (0..=n_h).flat_map(|k| [(k, false), (k, true)]) {
            let (k, is_sine) = function;
            if is_sine && (k == 0 || !has_sines) {
                continue;
            }
            let Some((_, values)) = self.rows.get(&function) else {
                let part = if is_sine { "sin" } else { "cos" };
                let why = format!(
                    "point {} has harmonics up to {n_h} and no row k = {k}, {part}; write zeros where a coefficient is zero",
                    self.label
                );
                return Err((self.line, why));
            };
            let f = place_of_function(function);
            coefficients[f * n_o..(f + 1) * n_o].copy_from_slice(values);
        }
        Ok(SeriesRecord { omega: self.omega, n_h, coefficients })
    }
}

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
