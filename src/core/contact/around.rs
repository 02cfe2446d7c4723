//! Modes, amplitudes and energies around the equilibrium ([`super::rest`]).

use std::sync::Arc;

use super::equilibrium::NoEquilibrium;
use super::modes::grazing_of;
use super::monitor::MonitorKind;
use super::rest::Rest;
use super::system::System;
use crate::fem::largest;

/// A monitor that a shape changes by less, as a displacement over its own largest one, is not changed.
const UNCHANGED: f64 = 1e-9;

impl System {
    /// Have modes, amplitudes and energies told around the static equilibrium.
    pub fn set_rest(&mut self) -> Result<(), NoEquilibrium> {
        self.rest = None;
        let (set, u) = self.equilibrium()?;
        let mut full = vec![0.0; self.n()];
        self.phase(&set).expand_displacement(0.0, &u, &mut full);
        let energy = self.elastic(0.0, &full) - self.loads.constant_potential(&full);
        let at_points = self.at_points(&full);
        self.rest = Some(Arc::new(Rest { set, u, at_points, energy }));
        Ok(())
    }

    /// The equilibrium that things are told around; none: the open, undeformed body.
    pub fn rest(&self) -> Option<&Rest> {
        self.rest.as_deref()
    }

    /// The least factor by which a shape of `u_O` takes the body from its rest to a first switch, with its sign: grazing of the open body, where things are told around no equilibrium.
    pub fn first_switch(&self, shape: &[f64]) -> Option<f64> {
        match self.rest() {
            Some(rest) => rest.first_switch(self, shape),
            None => grazing_of(self, shape),
        }
    }

    /// An energy `H` of a full displacement as it is told: over that of the rest, with the potential of the constant loads.
    pub(crate) fn beyond_rest(&self, energy: f64, u: &[f64]) -> f64 {
        self.rest().map_or(energy, |rest| energy - self.loads.constant_potential(u) - rest.energy)
    }

    /// Displacements of the contact points along their normals as they are told: from those of the rest.
    pub(crate) fn beside_rest(&self, at_points: &[f64]) -> Vec<f64> {
        let still = |i: usize| self.rest().map_or(0.0, |rest| rest.at_points[i]);
        at_points.iter().enumerate().map(|(i, u)| u - still(i)).collect()
    }
}

impl Rest {
    /// The least factor in magnitude by which a shape of `u_O`, added to the equilibrium, opens a point that touches or closes one that does not, with its sign: what grazing is
    /// to the open body.
    pub fn first_switch(&self, system: &System, shape: &[f64]) -> Option<f64> {
        let phase = system.phase(&self.set);
        let still = vec![0.0; self.u.len()];
        let monitors = |u: &[f64]| {
            let mut h = vec![0.0; phase.monitors.len()];
            phase.monitor_undriven(u, &still, &mut h);
            h
        };
        let moved: Vec<f64> = self.u.iter().zip(shape).map(|(u, x)| u + x).collect();
        let (before, after) = (monitors(&self.u), monitors(&moved));
        // as displacements: where it is, by how much it changes
        let row = |k: usize| {
            let m = &phase.monitors[k];
            let unit = system.monitor_unit(m.kind, m.point);
            let kinds = [MonitorKind::Gap, MonitorKind::Pressure, MonitorKind::Depth];
            let is_of_contact = kinds.contains(&m.kind);
            is_of_contact.then(|| (before[k] / unit, (after[k] - before[k]) / unit))
        };
        let rows: Vec<(f64, f64)> = (0..before.len()).filter_map(row).collect();
        // a rigid motion changes nothing but by rounding
        let most = largest(shape);
        let factors = rows.iter().filter(|r| r.1.abs() > UNCHANGED * most).map(|r| -r.0 / r.1);
        factors.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }
}
