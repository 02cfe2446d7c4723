//! `/backbone/extremes`: what forces and probes come to at the points of a family.

use ndarray::Array2;

use super::StoreError;
use super::bodies::{read_words, words};
use super::careful::Careful;
use super::columns::EXTREMES;
use super::schema::Rows;
use super::table::Form;
use crate::event::Watched;
use crate::records::{ExtremesRecord, PointRecord};

/// A number that is watched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredWatched {
    /// `contact`, `support`, `spring` or `probe`.
    pub kind: String,
    /// As columns of tables are called: `force_x[right]`.
    pub label: String,
}

/// The open tables.
pub(super) struct ExtremesWriter {
    rows: Rows<ExtremesRecord>,
    count: usize,
}

impl ExtremesWriter {
    /// Create the group for what is watched; nothing where nothing is.
    pub fn create(file: &hdf5::File, all: &[Watched]) -> Result<Option<Self>, StoreError> {
        if all.is_empty() {
            return Ok(None);
        }
        let count = all.len();
        let rows = Rows::create(file, EXTREMES, &|_| Form::plain(Some(count), 64))?;
        let group = file.group("backbone/extremes")?;
        let labels: Vec<String> = all.iter().map(Watched::label).collect();
        words(&group, "name", &labels.iter().map(String::as_str).collect::<Vec<_>>())?;
        words(&group, "kind", &all.iter().map(|w| w.kind).collect::<Vec<_>>())?;
        Ok(Some(ExtremesWriter { rows, count }))
    }

    /// Append those of a point; not numbers where nobody has looked.
    pub fn push(&mut self, p: &PointRecord) -> Result<(), StoreError> {
        let unknown = || {
            let none = vec![f64::NAN; self.count];
            ExtremesRecord { largest: none.clone(), least: none }
        };
        let known = p.extremes().filter(|e| e.largest.len() == self.count);
        self.rows.push(&known.cloned().unwrap_or_else(unknown));
        self.rows.append()
    }
}

/// What is watched, and the extremes of the points, row by row; nothing in files that have none.
pub(super) fn read_extremes(
    file: &hdf5::File,
) -> Result<(Vec<StoredWatched>, Vec<ExtremesRecord>), StoreError> {
    let Ok(group) = file.group("backbone/extremes") else { return Ok((vec![], vec![])) };
    let watched: Vec<StoredWatched> = read_words(&group.dataset("kind")?)?
        .into_iter()
        .zip(read_words(&group.dataset("name")?)?)
        .map(|(kind, label)| StoredWatched { kind, label })
        .collect();
    let table = |name: &str| group.dataset(name)?.table::<f64>();
    let (largest, least): (Array2<f64>, Array2<f64>) = (table("largest")?, table("least")?);
    if [&largest, &least].iter().any(|t| t.ncols() != watched.len()) {
        return Err(hdf5::Error::from("extremes and their names do not fit").into());
    }
    let rows = largest.rows().into_iter().zip(least.rows());
    let record = |(a, b): (ndarray::ArrayView1<f64>, ndarray::ArrayView1<f64>)| ExtremesRecord {
        largest: a.to_vec(),
        least: b.to_vec(),
    };
    Ok((watched, rows.map(record).collect()))
}

/// Give points their extremes.
pub(super) fn set_extremes(points: &mut [PointRecord], all: Vec<ExtremesRecord>) {
    for (p, extremes) in points.iter_mut().zip(all) {
        if extremes.largest.iter().all(|x| x.is_nan()) {
            continue;
        }
        match (&mut p.orbit, &mut p.attractor) {
            (Some(orbit), _) => orbit.extremes = extremes,
            (None, Some(seen)) => seen.extremes = extremes,
            (None, None) => {}
        }
    }
}
