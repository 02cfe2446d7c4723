//! Bifurcation diagrams in HDF5: `/diagram`, and what the body does row by row in `/sweep`.

use std::path::Path;

use hdf5::types::VarLenUnicode;

use super::bodies::words;
use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, read_problem, write_problem, write_whole};
use super::orbits::{matrix, read_scalar, scalar};
use super::sweep::{SweepWriter, read_sweep};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{AttractorKind, Diagram, DiagramRow, PointKind, Status};
use crate::scenario::Scene;

/// No walk has more steps.
const MOST_STEPS: f64 = 1e9;

/// The diagram of a file.
#[derive(Debug, Clone)]
pub struct StoredDiagram {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// All that the equations depend on, as one number.
    pub problem: u64,
    /// The diagram.
    pub diagram: Diagram,
}

/// Write the file of a diagram; `problem` is the fingerprint of what it is of.
pub fn write_diagram(
    path: &Path,
    (scene, system, problem): (&Scene, &System, u64),
    options: &WriterOptions,
    diagram: &Diagram,
    status: &Status,
) -> Result<(), StoreError> {
    let rows = &diagram.rows;
    let columns = rows.first().map_or(0, |row| row.x.len());
    let bytes = 8 * rows.len() * (columns + 200);
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let g = file.create_group("diagram")?;
        write_text(&g, "key", &diagram.key)?;
        write_problem(&g, problem)?;
        scalar(&g, "omega", diagram.omega)?;
        scalar(&g, "steps", diagram.steps as f64)?;
        diagram.dwell.map_or(Ok(()), |n| scalar(&g, "dwell", n as f64))?;
        g.new_dataset_builder().with_data(&diagram.range).create("range")?;
        let numbers = |name: &str, of: &dyn Fn(&DiagramRow) -> f64| {
            let values: Vec<f64> = rows.iter().map(of).collect();
            g.new_dataset_builder().with_data(&values).create(name).map(drop)
        };
        numbers("value", &|row| row.value)?;
        numbers("direction", &|row| if row.falls { -1.0 } else { 1.0 })?;
        numbers("goes_on", &|row| f64::from(u8::from(row.goes_on)))?;
        let kinds: Vec<&str> = rows.iter().map(|row| row.special.word()).collect();
        words(&g, "special", &kinds)?;
        let x = matrix(rows.len(), columns, rows.iter().flat_map(|r| r.x.clone()).collect())?;
        g.new_dataset_builder().deflate(4).with_data(&x).create("x")?;
        if let Some(first) = rows.first() {
            let lines = first.seen.spectrum.len();
            let mut sweep = SweepWriter::create(file, system.n_contact(), lines)?;
            for (k, row) in rows.iter().enumerate() {
                sweep.push(&row.seen, diagram.omega, k)?;
            }
        }
        Ok(())
    })
}

/// Read the diagram of a file.
pub fn read_diagram(path: &Path) -> Result<StoredDiagram, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/diagram".into() };
        let g = file.group("diagram").map_err(missing)?;
        let bad = |what: &str| StoreError::unusable(path, format!("/diagram: {what}"));
        let list = |name: &str| g.dataset(name)?.values::<f64>();
        let (values, directions, goes_on) = (list("value")?, list("direction")?, list("goes_on")?);
        let kinds: Vec<VarLenUnicode> = g.dataset("special")?.values()?;
        let x = g.dataset("x")?.table::<f64>()?;
        let seen = if values.is_empty() { vec![] } else { read_sweep(&file)? };
        let count = values.len();
        let lengths = [directions.len(), goes_on.len(), kinds.len(), x.nrows(), seen.len()];
        if lengths.iter().any(|n| *n != count) {
            return Err(bad("its rows do not fit each other"));
        }
        let mut rows: Vec<DiagramRow> = vec![];
        for (k, (_, seen)) in seen.into_iter().enumerate() {
            let falls = directions[k] < 0.0;
            let before = rows.last().filter(|row| row.falls == falls).map(|row| row.seen.kind);
            rows.push(DiagramRow {
                value: values[k],
                falls,
                special: special(kinds[k].as_str(), before, seen.kind),
                seen,
                x: x.row(k).to_vec(),
                goes_on: goes_on[k] == 1.0,
            });
        }
        let range: [f64; 2] = list("range")?.try_into().map_err(|_| bad("a range is damaged"))?;
        let steps = read_scalar(&g, "steps")?;
        let is_inside = |x: &f64| (range[0]..=range[1]).contains(x);
        if !range.iter().chain(&values).all(is_inside) || !(1.0..=MOST_STEPS).contains(&steps) {
            return Err(bad("its range, its steps or its values are damaged"));
        }
        let points = rows.iter().flat_map(|row: &DiagramRow| [&row.seen.peak, &row.seen.trough]);
        if points.map(Vec::len).any(|n| n == 0 || n != rows[0].seen.peak.len()) {
            return Err(bad("contact points are missing in /sweep"));
        }
        let diagram = Diagram {
            key: read_text(&g, "key").unwrap_or_default(),
            range,
            steps: steps as usize,
            omega: read_scalar(&g, "omega")?,
            dwell: read_scalar(&g, "dwell").ok().map(|n| n as usize),
            rows,
        };
        Ok(StoredDiagram {
            head: Head::read(&file),
            problem: read_problem(&g).ok_or_else(|| bad("no fingerprint of the problem"))?,
            diagram,
        })
    })
}

/// What a word says of a row, from the motion before it to its own.
fn special(word: &str, before: Option<AttractorKind>, after: AttractorKind) -> PointKind {
    let change = before.map(|before| PointKind::Change { before, after });
    let all = [PointKind::Start, PointKind::Jump].into_iter().chain(change);
    all.into_iter().find(|kind| kind.word() == word).unwrap_or_default()
}
