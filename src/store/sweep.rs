//! `/sweep`: what a forced body settles to, frequency by frequency.

use hdf5::types::{FixedAscii, FixedUnicode};
use ndarray::Array2;

use super::StoreError;
use super::careful::Careful;
use super::columns::{SECTIONS, SWEEP, SectionRow, SweepRow};
use super::schema::{About, Rows};
use super::table::Form;
use crate::records::{AttractorKind, AttractorRecord, ExtremesRecord};

/// The open tables of `/sweep`.
pub(super) struct SweepWriter {
    rows: Rows<SweepRow>,
    sections: Rows<SectionRow>,
    count: usize,
    n_c: usize,
}

impl SweepWriter {
    /// Create `/sweep` for a body of `n_c` contact points, with so many lines of a spectrum.
    pub fn create(file: &hdf5::File, n_c: usize, lines: usize) -> Result<SweepWriter, StoreError> {
        let form = |about: &About| {
            let columns = match about.axes {
                [_] => None,
                [_, "line"] => Some(lines),
                _ => Some(n_c),
            };
            Form::plain(columns, 64)
        };
        let rows = Rows::create(file, SWEEP, &form)?;
        let sections = Rows::create(file, SECTIONS, &form)?;
        Ok(SweepWriter { rows, sections, count: 0, n_c })
    }

    /// Append what a body does at row `point` of `/backbone`.
    pub fn push(
        &mut self,
        seen: &AttractorRecord,
        omega: f64,
        point: usize,
    ) -> Result<(), StoreError> {
        self.rows.push(&SweepRow { point: point as i64, omega, seen: seen.clone() });
        let n_c = self.n_c.max(1);
        for (at, least) in seen.sections.chunks_exact(n_c).zip(seen.least.chunks_exact(n_c)) {
            let (row, at, least) = (self.count as i64, at.to_vec(), least.to_vec());
            self.sections.push(&SectionRow { row, at, least });
        }
        self.count += 1;
        self.rows.append()?;
        self.sections.append()
    }
}

/// The rows of `/sweep`, each with its row of `/backbone`.
pub(super) fn read_sweep(file: &hdf5::File) -> Result<Vec<(i64, AttractorRecord)>, StoreError> {
    let g = file.group("sweep")?;
    let numbers = |name: &str| g.dataset(name)?.values::<f64>();
    let table = |name: &str| g.dataset(name)?.table::<f64>();
    let points: Vec<i64> = g.dataset("point")?.values()?;
    let kinds: Vec<FixedAscii<32>> = g.dataset("kind")?.values()?;
    let notes: Vec<FixedUnicode<256>> = g.dataset("note")?.values()?;
    let periods: Vec<i64> = g.dataset("period_number")?.values()?;
    let maps: Vec<i64> = g.dataset("maps")?.values()?;
    let (exponent, error) = (numbers("lyapunov")?, numbers("lyapunov_error")?);
    let (force, energy, switches) = (numbers("force")?, numbers("energy")?, numbers("switches")?);
    let (peak, trough, spectrum) = (table("peak")?, table("trough")?, table("spectrum")?);
    let of: Vec<i64> = g.dataset("points_of")?.values()?;
    let (at, least) = (table("points")?, table("least")?);
    let row = |table: &Array2<f64>, k: usize| match k < table.nrows() {
        true => table.row(k).to_vec(),
        false => vec![],
    };
    // the sections of each row, in one pass
    let gathered = |table: &Array2<f64>| {
        let mut rows = vec![vec![]; points.len()];
        for (&row, at) in of.iter().zip(table.rows()) {
            if let Some(own) = usize::try_from(row).ok().and_then(|row| rows.get_mut(row)) {
                own.extend(at.iter().copied());
            }
        }
        rows
    };
    let (mut sections, mut depths) = (gathered(&at), gathered(&least));
    let own = |rows: &mut [Vec<f64>], k: usize| std::mem::take(&mut rows[k]);
    let mut all = vec![];
    for (k, &point) in points.iter().enumerate() {
        let number = |list: &[f64]| list.get(k).copied().unwrap_or(f64::NAN);
        let whole = |list: &[i64]| list.get(k).map_or(0, |n| *n as usize);
        let word = kinds.get(k).map_or("", |word| word.as_str());
        let kind = AttractorKind::of_word(word, whole(&periods));
        let seen = AttractorRecord {
            kind: kind.unwrap_or(AttractorKind::Lost),
            exponent: number(&exponent),
            exponent_error: number(&error),
            peak: row(&peak, k),
            trough: row(&trough, k),
            force: number(&force),
            energy: number(&energy),
            switches: number(&switches),
            sections: own(&mut sections, k),
            least: own(&mut depths, k),
            spectrum: row(&spectrum, k),
            extremes: ExtremesRecord::default(),
            maps: whole(&maps),
            note: notes.get(k).map_or(String::new(), |n| n.as_str().to_owned()),
        };
        all.push((point, seen));
    }
    Ok(all)
}
