//! `[orbit]`: periodic orbits and families of them.

use serde::Deserialize;

use super::check::{Check, positive};
use super::{Issue, Scene};

/// `[orbit]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Circular frequency.
    pub omega: Option<f64>,
    /// Or the period.
    pub period: Option<f64>,
    /// Number of harmonics.
    pub harmonics: Option<usize>,
    /// Range of continuation.
    pub range: Option<[f64; 2]>,
    /// Viscosity `β` of `C = βK − αM` for the viscous nonlinear mode.
    pub beta: Option<Beta>,
    /// The mode of the open body that the viscous nonlinear mode is pinned to, from 1.
    pub mode: Option<usize>,
    /// Damping ratios of `response`, in place of the scene's own.
    pub ratios: Option<Vec<f64>>,
}

/// `[orbit] beta`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged, expecting = "give a number (a time), or \"auto\"")]
pub enum Beta {
    /// In the scene's unit of time.
    Number(f64),
    /// What the mesh resolves.
    Word(Auto),
}

/// The word of [`Beta`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Auto {
    /// `"auto"`
    Auto,
}

impl Scene {
    pub(super) fn check_orbit(&self) -> Check {
        let Some(o) = &self.orbit else { return Ok(()) };
        if o.omega.is_some() && o.period.is_some() {
            return Err(Issue::new(
                "orbit.period",
                "stands beside omega",
                "give omega or period, not both",
            ));
        }
        if let Some(w) = o.omega {
            positive("orbit.omega", w)?;
        }
        if let Some(t) = o.period {
            positive("orbit.period", t)?;
        }
        if let Some([a, b]) = o.range {
            positive("orbit.range", a)?;
            positive("orbit.range", b)?;
            if a >= b {
                return Err(Issue::new(
                    "orbit.range",
                    format!("[{a}, {b}] is empty"),
                    "give the lower frequency first",
                ));
            }
        }
        if let Some(Beta::Number(beta)) = o.beta {
            positive("orbit.beta", beta)?;
        }
        if o.mode == Some(0) {
            return Err(Issue::new("orbit.mode", "modes count from 1", "mode = 1"));
        }
        if o.harmonics == Some(0) {
            return Err(Issue::new("orbit.harmonics", "needs at least one", "harmonics = 15"));
        }
        if let Some(ratios) = &o.ratios {
            if ratios.is_empty() {
                return Err(Issue::new("orbit.ratios", "is empty", "ratios = [0.01, 0.02]"));
            }
            ratios.iter().try_for_each(|&r| positive("orbit.ratios", r))?;
            if self.damping.as_ref().is_none_or(|d| d.ratio.is_none()) {
                return Err(Issue::new(
                    "orbit.ratios",
                    "stands in place of the ratio in [damping], and there is none",
                    "[damping] with ratio = 0.02 and mode = 1",
                ));
            }
        }
        Ok(())
    }
}
