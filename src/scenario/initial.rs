//! `[initial]`: the state at the start.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, count_from_one, finite, length};
use super::{Field, Issue, Scene};

/// `[initial]`
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// A mode of the open body, from 1.
    pub mode: Option<usize>,
    /// With `mode`: its contact displacement of largest magnitude, over the gap; negative: away from the obstacle.
    pub amplitude: Option<f64>,
    /// Components of the displacement, numbers or expressions; what a support holds is left out. Those of contact nodes along the normal follow from the contact conditions, where they have no mass.
    #[schemars(extend("examples" = [["-2*x", "0"]]))]
    pub displacement: Option<Vec<Field>>,
    /// Components of the velocity, likewise.
    pub velocity: Option<Vec<Field>>,
    /// An orbit, or the last state of a run, relative to the scene; interpolated from another mesh of the same body.
    pub file: Option<PathBuf>,
    /// The static equilibrium under the constant loads, contact included; `velocity` may be given with it.
    #[serde(default)]
    pub equilibrium: bool,
}

impl Scene {
    pub(super) fn check_initial(&self) -> Check {
        let s = &self.initial;
        let field = s.displacement.is_some() || s.velocity.is_some() && !s.equilibrium;
        let forms = [s.mode.is_some(), field, s.file.is_some(), s.equilibrium];
        if forms.iter().filter(|&&g| g).count() > 1 {
            return Err(Issue::new(
                "initial",
                "mixes several forms",
                "give mode and amplitude, or displacement and velocity, or equilibrium, or file",
            ));
        }
        match (s.mode, s.amplitude) {
            (Some(m), Some(a)) => {
                count_from_one("initial.mode", m)?;
                finite("initial.amplitude", a)?;
                let scalable = match &self.contact {
                    Some(c) => !matches!(c.gap(), Some(Field::Constant(0.0))),
                    None => true,
                };
                if !scalable {
                    return Err(Issue::new(
                        "initial.amplitude",
                        "counts in gaps, and the gap is 0",
                        "give the initial state as displacement = [\"…\"]",
                    ));
                }
            }
            (Some(_), None) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "is missing",
                    "give amplitude = -1.4 (in gaps)",
                ));
            }
            (None, Some(_)) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "goes with `mode` only",
                    "give mode = 1",
                ));
            }
            (None, None) => {}
        }
        for (key, list) in
            [("initial.displacement", &s.displacement), ("initial.velocity", &s.velocity)]
        {
            if let Some(list) = list {
                let all = ["[\"-2*x\"]", "[\"-2*x\", \"0\"]", "[\"-2*x\", \"0\", \"0\"]"];
                let example = self.example(all);
                length(key, list.len(), self.dim(), example)?;
            }
        }
        Ok(())
    }
}
