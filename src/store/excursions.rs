//! How far the parts of a body strayed over a run.

use super::StoreError;
use super::careful::Careful;
use super::writer::Writer;

/// The farthest that something strayed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ExcursionRecord {
    /// `sliding` of a pair over the length of its sides, or the `rotation` of a part.
    pub kind: &'static str,
    /// Slave and master, or the part.
    pub of: Vec<String>,
    /// The largest, of the stored states.
    pub largest: f64,
    /// When.
    pub t: f64,
}

impl Writer {
    /// How far surfaces that meet slid over each other, and parts turned.
    pub fn excursions(&mut self) -> Result<Vec<ExcursionRecord>, StoreError> {
        self.flush()?;
        let (file, excursions) = (self.file(), &self.kept().excursions);
        let t: Vec<f64> = file.dataset("trajectory/t")?.values()?;
        let pairs: Vec<Vec<String>> = excursions.pairs.iter().map(|p| p.to_vec()).collect();
        let parts = excursions.parts.iter().map(|p| vec![p.clone()]).collect();
        let mut all = vec![];
        for (kind, path, of, width) in [
            ("sliding", "contact/pairs/sliding", pairs, 1),
            ("rotation", "bodies/rotation", parts, excursions.turns),
        ] {
            if of.is_empty() {
                continue;
            }
            let table = file.dataset(path)?.table()?;
            for (k, of) in of.into_iter().enumerate() {
                let size = |row: usize| {
                    (0..width).map(|c| table[(row, width * k + c)]).fold(0.0f64, f64::hypot)
                };
                let rows = 0..t.len().min(table.nrows());
                let most = rows.max_by(|&a, &b| size(a).total_cmp(&size(b)));
                all.extend(most.map(|row| ExcursionRecord {
                    kind,
                    of,
                    largest: size(row),
                    t: t[row],
                }));
            }
        }
        Ok(all)
    }
}
