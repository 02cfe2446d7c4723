//! `/forces/contact`: the resultants of contact groups over time, and what they come to.

use super::StoreError;
use super::careful::Careful;
use super::writer::Writer;

/// What the force of a group came to.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ForceRecord {
    /// The group.
    pub group: String,
    /// Largest force in magnitude, of the stored states.
    pub maximum: f64,
    /// When.
    pub t: f64,
    /// `∫F dt` by trapezia over the stored states, one number an axis.
    pub impulse: Vec<f64>,
}

impl Writer {
    /// What the forces of all groups came to.
    pub fn forces(&mut self) -> Result<Vec<ForceRecord>, StoreError> {
        self.flush()?;
        let file = self.file();
        let Ok(dataset) = file.dataset("forces/contact/force") else { return Ok(vec![]) };
        let t: Vec<f64> = file.dataset("trajectory/t")?.values()?;
        let force: ndarray::Array2<f64> = dataset.table()?;
        let groups = &self.kept().resultants;
        let dim = groups.dim;
        let of = |(k, group): (usize, &String)| {
            let at =
                |row: usize| -> Vec<f64> { (0..dim).map(|c| force[(row, dim * k + c)]).collect() };
            let size = |row: usize| at(row).iter().fold(0.0f64, |m, x| m.hypot(*x));
            let rows = t.len().min(force.nrows());
            let most = (0..rows).max_by(|&a, &b| size(a).total_cmp(&size(b)));
            let mut impulse = vec![0.0; dim];
            for row in 1..rows {
                let (a, b) = (at(row - 1), at(row));
                let half = 0.5 * (t[row] - t[row - 1]);
                impulse.iter_mut().enumerate().for_each(|(c, sum)| *sum += half * (a[c] + b[c]));
            }
            ForceRecord {
                group: group.clone(),
                maximum: most.map_or(0.0, size),
                t: most.map_or(f64::NAN, |row| t[row]),
                impulse,
            }
        };
        Ok(groups.names.iter().enumerate().map(of).collect())
    }
}
