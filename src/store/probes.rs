//! What the quantities of probes came to over a run.

use ndarray::Array2;

use super::StoreError;
use super::careful::Careful;
use super::writer::Writer;
use crate::fem::Quantity;

/// What a quantity of a probe came to.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ProbeRecord {
    /// The probe.
    pub name: String,
    /// What it watches.
    pub quantity: Quantity,
    /// Its components.
    pub components: Vec<&'static str>,
    /// The largest of each in magnitude, with its sign, of the stored states.
    pub largest: Vec<f64>,
    /// When.
    pub t: Vec<f64>,
}

impl Writer {
    /// What the quantities of probes came to; not those that nobody knows.
    pub fn probes(&mut self) -> Result<Vec<ProbeRecord>, StoreError> {
        self.flush()?;
        let (file, kept) = (self.file(), self.kept());
        let t: Vec<f64> = file.dataset("trajectory/t")?.values()?;
        let mut all = vec![];
        for probe in kept.watch.probes.iter() {
            for &quantity in &probe.quantities {
                let path = format!("probes/{}/{}", probe.name, quantity.name());
                let table: Array2<f64> = file.dataset(&path)?.table()?;
                let components = probe.components(quantity);
                let most = |c: usize| {
                    let rows = 0..t.len().min(table.nrows());
                    let size = |row: usize| table[(row, c)].abs();
                    rows.max_by(|&a, &b| size(a).total_cmp(&size(b)))
                };
                let most: Option<Vec<usize>> = (0..components.len()).map(most).collect();
                let Some(most) = most else { continue };
                let largest: Vec<f64> =
                    most.iter().enumerate().map(|(c, row)| table[(*row, c)]).collect();
                if largest.iter().all(|x| x.is_finite()) {
                    let t = most.iter().map(|row| t[*row]).collect();
                    let name = probe.name.clone();
                    all.push(ProbeRecord { name, quantity, components, largest, t });
                }
            }
        }
        Ok(all)
    }
}
