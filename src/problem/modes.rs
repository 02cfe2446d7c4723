//! The modes that a scene names.

use super::ProblemError;
use crate::contact::{Phase, System, phase_modes};
use crate::fem::Modes;
use crate::scenario::{Issue, Scene};

/// The modes of the open phase that a scene names, computed once and only if it names any.
pub(super) struct OpenModes {
    pub modes: Option<Modes>,
    phase: Option<Phase>,
}

impl OpenModes {
    pub(crate) fn for_scene(scene: &Scene, system: &System) -> Result<OpenModes, ProblemError> {
        let damping = scene.damping.as_ref();
        let named = [
            scene.initial.mode,
            damping.and_then(|d| d.ratio.map(|_| d.mode.unwrap_or(1))),
            damping.and_then(|d| d.ratios.map(|[(a, _), (b, _)]| a.max(b))),
        ];
        let loads = scene.loads.iter().map(|l| l.mode);
        let Some(count) = named.into_iter().chain(loads).flatten().max() else {
            return Ok(OpenModes { modes: None, phase: None });
        };
        let phase = system.open_phase();
        let modes = phase_modes(system, &phase, count)?;
        Ok(OpenModes { modes: Some(modes), phase: Some(phase) })
    }

    /// Frequency and full shape `A* φ_k` of mode `k` (from 1).
    pub fn get(
        &self,
        scene: &Scene,
        key: &str,
        k: usize,
        system: &System,
    ) -> Result<(f64, Vec<f64>), ProblemError> {
        let found = match (&self.modes, &self.phase) {
            (Some(m), Some(p)) if k <= m.omega.len() => Some((m, p)),
            _ => None,
        };
        let Some((modes, phase)) = found else {
            let message =
                format!("mode {k} does not exist: the open body has {} modes", system.n_o());
            let help = format!("give 1 to {}", system.n_o());
            return Err(scene.error(Issue::new(key, message, help)).into());
        };
        let mut shape = vec![0.0; system.n()];
        phase.expand(&modes.shapes[k - 1], &mut shape);
        Ok((modes.omega[k - 1], shape))
    }
}
