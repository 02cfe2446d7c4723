//! `/forces`: those of contact groups, supports and springs over time, and what they come to; the largest pressure.

use ndarray::Array2;

use super::StoreError;
use super::careful::Careful;
use super::writer::Writer;

/// What a force came to.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ForceRecord {
    /// `contact`, `support` or `spring`.
    pub kind: &'static str,
    /// The group, or the spring.
    pub group: String,
    /// Largest force in magnitude, of the stored states.
    pub maximum: f64,
    /// When.
    pub t: f64,
    /// `∫F dt` by trapezia over the stored states, one number an axis.
    pub impulse: Vec<f64>,
    /// How far that over every second state is from it: more than what it is off by, where forces are smooth.
    pub impulse_error: f64,
}

/// The largest pressure of the stored states.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PressureRecord {
    /// It; of contact points without an area (all areas are 1) a force.
    pub largest: f64,
    /// When.
    pub t: f64,
    /// Mesh node (number of the contact point where points are no nodes).
    pub node: i64,
    /// No contact point has an area.
    pub is_force: bool,
}

/// Maximum and impulse of forces over time, some columns a force.
fn records(
    kind: &'static str,
    (names, dim): (&[String], usize),
    t: &[f64],
    force: &Array2<f64>,
) -> Vec<ForceRecord> {
    let of = |(k, name): (usize, &String)| {
        let at = |row: usize| -> Vec<f64> { (0..dim).map(|c| force[(row, dim * k + c)]).collect() };
        let size = |row: usize| at(row).iter().fold(0.0f64, |m, x| m.hypot(*x));
        let rows = t.len().min(force.nrows());
        let most = (0..rows).max_by(|&a, &b| size(a).total_cmp(&size(b)));
        // over every state, over every second and the last
        let [impulse, coarse] = [1, 2].map(|every| {
            let chosen: Vec<usize> =
                (0..rows).filter(|row| row % every == 0 || row + 1 == rows).collect();
            let mut impulse = vec![0.0; dim];
            for w in chosen.windows(2) {
                let (a, b) = (at(w[0]), at(w[1]));
                let half = 0.5 * (t[w[1]] - t[w[0]]);
                impulse.iter_mut().enumerate().for_each(|(c, sum)| *sum += half * (a[c] + b[c]));
            }
            impulse
        });
        let apart = impulse.iter().zip(&coarse).fold(0.0f64, |m, (a, b)| m.hypot(a - b));
        ForceRecord {
            kind,
            group: name.clone(),
            maximum: most.map_or(0.0, size),
            t: most.map_or(f64::NAN, |row| t[row]),
            impulse,
            impulse_error: apart,
        }
    };
    names.iter().enumerate().map(of).filter(|r| r.maximum.is_finite()).collect()
}

impl Writer {
    /// What the forces of contact groups, of supports and of springs came to; not those that nobody knows.
    pub fn forces(&mut self) -> Result<Vec<ForceRecord>, StoreError> {
        self.flush()?;
        let (file, kept) = (self.file(), self.kept());
        let t: Vec<f64> = file.dataset("trajectory/t")?.values()?;
        let mut all = vec![];
        for (kind, names, dim) in [
            ("contact", &kept.watch.resultants.names, kept.watch.resultants.dim),
            ("support", &kept.watch.bearings.supports, kept.watch.bearings.dim),
            ("spring", &kept.watch.bearings.springs, 1),
        ] {
            if let Ok(dataset) = file.dataset(&format!("forces/{kind}/force")) {
                all.extend(records(kind, (names, dim), &t, &dataset.table()?));
            }
        }
        Ok(all)
    }

    /// The largest pressure of the contact points before obstacles, the first `facing`: those behind them are sliders, whose pressures are limits. None where nothing touches.
    pub fn largest_pressure(
        &mut self,
        facing: usize,
    ) -> Result<Option<PressureRecord>, StoreError> {
        self.flush()?;
        let file = self.file();
        let Ok(pressure) = file.dataset("trajectory/pressure") else { return Ok(None) };
        let pressure: Array2<f64> = pressure.table()?;
        let t: Vec<f64> = file.dataset("trajectory/t")?.values()?;
        // points need not be nodes
        let nodes: Vec<i64> = match file.dataset("mesh/contact_nodes") {
            Ok(nodes) => nodes.values()?,
            Err(_) => (0..pressure.ncols() as i64).collect(),
        };
        let areas: Vec<f64> = file.dataset("mesh/contact_area")?.values()?;
        let before_obstacles = pressure.indexed_iter().filter(|((_, point), _)| *point < facing);
        let most = before_obstacles.max_by(|a, b| a.1.total_cmp(b.1));
        Ok(most.filter(|(_, p)| **p > 0.0).map(|((row, point), &largest)| PressureRecord {
            largest,
            t: t[row],
            node: nodes.get(point).copied().unwrap_or(-1),
            is_force: areas.iter().take(facing).all(|a| *a == 1.0),
        }))
    }
}
