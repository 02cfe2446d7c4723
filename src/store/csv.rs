//! Harmonic-balance results of other programs as CSV.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::StoreError;
use super::series::{MOST_HARMONICS, is_reasonable};
use crate::records::{SeriesRecord, place_of_function};

/// What is wrong with a line: its number, from 1, and why.
type Refused = (usize, String);

/// The rows of one point of a CSV.
struct CsvPoint {
    label: String,
    /// Line of its first row.
    line: usize,
    omega: f64,
    alpha: Option<f64>,
    /// Values and line of each function.
    rows: BTreeMap<(usize, bool), (usize, Vec<f64>)>,
}

/// One row of a CSV.
struct CsvRow {
    label: String,
    omega: f64,
    alpha: Option<f64>,
    function: (usize, bool),
    values: Vec<f64>,
}

/// Read series from CSV: a header, then one row a function: `point, omega, k, part, u_1, …, u_nO` with `part` `cos` or `sin`; for viscous nonlinear modes
/// `alpha` stands behind `omega`. The rows
/// may stand in any order; points come in the order of their first rows. A point has the cosine of every harmonic from 0 to its
/// last, and either all sines or none (a motion that is symmetric in time). Cells are parted by commas, semicolons or tabs.
pub(crate) fn read_csv(path: &Path, n_o: usize) -> Result<Vec<SeriesRecord>, StoreError> {
    let bytes = std::fs::read(path).map_err(|e| StoreError::unusable(path, e))?;
    read(&bytes, n_o)
        .map_err(|(line, why)| StoreError::unusable(path, format!("line {line}: {why}")))
}

fn read(bytes: &[u8], n_o: usize) -> Result<Vec<SeriesRecord>, Refused> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        (line, "is no text in UTF-8".into())
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let is_content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = text.lines().enumerate().filter(|(_, line)| is_content(line));
    let (first, header) = lines.next().ok_or_else(|| (1, "the file is empty".into()))?;
    let separator = [',', ';', '\t'].into_iter().find(|s| header.contains(*s)).unwrap_or(',');
    let names = cells_of(header, separator);
    let has_alpha = names.get(2).is_some_and(|name| name == "alpha");
    let begins = |wanted: &[&str]| names.len() >= wanted.len() && names[..wanted.len()] == *wanted;
    if !(begins(&["point", "omega", "k", "part"])
        || begins(&["point", "omega", "alpha", "k", "part"]))
    {
        let why = "the header must begin with point, omega, k, part (separated by commas; alpha behind omega for viscous modes)";
        return Err((first + 1, why.into()));
    }
    let mut points: Vec<CsvPoint> = vec![];
    let mut place_of: HashMap<String, usize> = HashMap::new();
    for (k, line) in lines {
        let number = k + 1;
        let row = CsvRow::read(line, separator, n_o, has_alpha).map_err(|why| (number, why))?;
        let Some(row) = row else { continue };
        let place = *place_of.entry(row.label.clone()).or_insert_with(|| {
            let (label, omega, alpha) = (row.label.clone(), row.omega, row.alpha);
            points.push(CsvPoint { label, line: number, omega, alpha, rows: BTreeMap::new() });
            points.len() - 1
        });
        points[place].add(row, number).map_err(|why| (number, why))?;
    }
    points.into_iter().map(|p| p.series(n_o)).collect()
}

fn cells_of(line: &str, separator: char) -> Vec<String> {
    line.split(separator).map(|c| c.trim().trim_matches('"').to_owned()).collect()
}

/// A finite number.
fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|x| x.is_finite())
}

impl CsvRow {
    /// Read a row; none if it is the sine of harmonic 0, which is zero.
    fn read(
        line: &str,
        separator: char,
        n_o: usize,
        has_alpha: bool,
    ) -> Result<Option<CsvRow>, String> {
        let mut cells = cells_of(line, separator);
        let mut alpha = None;
        if has_alpha && cells.len() > 2 {
            let text = cells.remove(2);
            let number = finite(&text).filter(|a| is_reasonable(*a));
            alpha = Some(number.ok_or_else(|| format!("alpha \"{text}\" is not a number"))?);
        }
        if cells.len() != 4 + n_o {
            let found = cells.len().saturating_sub(4);
            return Err(format!(
                "{found} displacements, the scene has {n_o} (columns: point, omega, k, part, u_1, …, u_{n_o})"
            ));
        }
        let omega = finite(&cells[1])
            .filter(|w| *w > 0.0)
            .ok_or_else(|| format!("omega \"{}\" is not a positive number", cells[1]))?;
        let harmonic: usize =
            cells[2].parse().map_err(|_| format!("k \"{}\" is not a whole number", cells[2]))?;
        let is_sine = match cells[3].as_str() {
            "cos" => false,
            "sin" => true,
            other => return Err(format!("part \"{other}\" is neither cos nor sin")),
        };
        let number = |c: &String| {
            let comma = separator != ',' && c.contains(',');
            let hint = if comma { " (write a point, no comma, before the decimals)" } else { "" };
            finite(c).ok_or_else(|| format!("\"{c}\" is not a finite number{hint}"))
        };
        let values = cells[4..].iter().map(number).collect::<Result<Vec<f64>, String>>()?;
        if harmonic > MOST_HARMONICS {
            return Err(format!("k = {harmonic}: at most {MOST_HARMONICS} harmonics"));
        }
        if harmonic == 0 && is_sine {
            let is_zero = values.iter().all(|v| *v == 0.0);
            return if is_zero { Ok(None) } else { Err("there is no sine of harmonic 0".into()) };
        }
        if !values.iter().all(|v| is_reasonable(*v)) {
            return Err("a displacement is beyond all reason".into());
        }
        let label = cells.into_iter().next().unwrap_or_default();
        Ok(Some(CsvRow { label, omega, alpha, function: (harmonic, is_sine), values }))
    }
}

impl CsvPoint {
    /// Add a row that stands in line `number`.
    fn add(&mut self, row: CsvRow, number: usize) -> Result<(), String> {
        let CsvRow { label, omega, alpha, function, values } = row;
        if self.alpha != alpha {
            return Err(format!("point {label} has two values of alpha"));
        }
        if self.omega != omega {
            return Err(format!("point {label} has omega {} and {omega}", self.omega));
        }
        match self.rows.insert(function, (number, values)) {
            None => Ok(()),
            Some((line, _)) => {
                let (harmonic, part) = (function.0, if function.1 { "sin" } else { "cos" });
                Err(format!(
                    "harmonic {harmonic} {part} of point {label} stands there twice, first in line {line}"
                ))
            }
        }
    }

    /// The series, if no row is missing.
    fn series(self, n_o: usize) -> Result<SeriesRecord, Refused> {
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
        Ok(SeriesRecord { omega: self.omega, n_h, coefficients, alpha: self.alpha })
    }
}
