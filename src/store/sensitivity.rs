//! Derivatives of an orbit in HDF5: `/sensitivity`.

use super::orbits::{matrix, scalar};
use super::report::fresh_group;
use super::{StoreError, Writer};
use crate::contact::System;
use crate::records::{PeakRecord, SensitivityRecord};

impl Writer {
    /// Write `/sensitivity` beside `/orbit`: the largest values, and a group a parameter.
    pub fn sensitivity(
        &mut self,
        peaks: &[PeakRecord],
        parameters: &[SensitivityRecord],
        system: &System,
    ) -> Result<(), StoreError> {
        let dofs = system.body.nodal_dofs();
        let all = fresh_group(self.file(), "sensitivity")?;
        for peak in peaks {
            scalar(&all, peak.name, peak.value)?;
            scalar(&all, &format!("{}_time", peak.name), peak.t)?;
            if let Some(node) = peak.node {
                scalar(&all, &format!("{}_node", peak.name), node as f64)?;
            }
        }
        for p in parameters {
            let g = all.create_group(&p.key)?;
            scalar(&g, "value", p.value)?;
            for (peak, by) in peaks.iter().zip(&p.peaks) {
                scalar(&g, peak.name, *by)?;
            }
            scalar(&g, "period", p.period)?;
            p.alpha.map_or(Ok(()), |by| scalar(&g, "alpha", by))?;
            g.new_dataset_builder().with_data(&dofs.along_axes(&p.u0)).create("u0")?;
            g.new_dataset_builder().with_data(&dofs.along_axes(&p.v0)).create("v0")?;
            let flat: Vec<f64> = p.multipliers.iter().flatten().copied().collect();
            let multipliers = matrix(p.multipliers.len(), 2, flat)?;
            g.new_dataset_builder().with_data(&multipliers).create("multipliers")?;
        }
        Ok(())
    }
}
