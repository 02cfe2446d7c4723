//! Lyapunov exponents in HDF5: `/lyapunov`.

use super::orbits::{matrix, scalar};
use super::report::fresh_group;
use super::{StoreError, Writer};
use crate::records::LyapunovRecord;

impl Writer {
    /// Write `/lyapunov` beside the trajectory from whose end the exponents are.
    pub fn lyapunov(&mut self, found: &LyapunovRecord) -> Result<(), StoreError> {
        let g = fresh_group(self.file(), "lyapunov")?;
        scalar(&g, "period", found.period)?;
        scalar(&g, "divergence", found.divergence)?;
        found.dimension().map_or(Ok(()), |d| scalar(&g, "dimension", d))?;
        for (name, values) in
            [("exponents", &found.exponents), ("errors", &found.errors), ("bounds", &found.bounds)]
        {
            g.new_dataset_builder().with_data(values).create(name)?;
        }
        let flat: Vec<f64> = found.growths.iter().flatten().copied().collect();
        let growths = matrix(found.growths.len(), found.exponents.len(), flat)?;
        g.new_dataset_builder().with_data(&growths).create("growths")?;
        Ok(())
    }
}
