//! `[[material]]`: what the cells of a mesh are made of.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, positive};
use super::{BodyKind, Issue, Scene, State};

/// `[[material]]`
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialTable {
    /// Physical group of surfaces (in space: of volumes), by name, or `"#3"` by tag; may be left out where there is one material.
    pub group: Option<String>,
    /// Young's modulus E.
    pub young: f64,
    /// Poisson's ratio ν: −1 < ν < 1/2, in plane stress < 1.
    pub poisson: f64,
    /// Mass density ρ.
    pub density: f64,
}

impl Scene {
    pub(super) fn check_materials(&self) -> Check {
        if self.body.kind != BodyKind::Mesh {
            return match self.materials.is_empty() {
                true => Ok(()),
                false => {
                    let message = "belongs to kind = \"mesh\"";
                    Err(Issue::new("material", message, "give young, poisson, density in [body]"))
                }
            };
        }
        if self.materials.is_empty() {
            let help = "[[material]] with group, young, poisson, density";
            return Err(Issue::new("material", "is missing", help));
        }
        for (i, m) in self.materials.iter().enumerate() {
            let key = |name: &str| format!("material[{i}].{name}");
            if m.group.is_none() && self.materials.len() > 1 {
                let message = "is missing, and there are several materials";
                return Err(Issue::new(key("group"), message, "name a physical group of cells"));
            }
            positive(&key("young"), m.young)?;
            positive(&key("density"), m.density)?;
            self.check_ratio(&key("poisson"), m.poisson)?;
        }
        Ok(())
    }

    /// Poisson's ratio for which the elastic constants are positive definite.
    fn check_ratio(&self, key: &str, nu: f64) -> Check {
        let (limit, state) = match self.body.state {
            Some(State::PlaneStress) => (1.0, "plane stress"),
            None => (0.5, "a body in space"),
            Some(State::PlaneStrain) => (0.5, "plane strain"),
            Some(State::Axisymmetric) => (0.5, "an axisymmetric body"),
        };
        if nu > -1.0 && nu < limit {
            return Ok(());
        }
        let message = format!("{nu} makes the stiffness indefinite");
        Err(Issue::new(key, message, format!("give -1 < ν < {limit} ({state})")))
    }
}
