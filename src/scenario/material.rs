//! `[[material]]`: what the cells of a mesh are made of.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, positive};
use super::{Body, BodyKind, Issue, Scene, State};

/// `[[material]]`
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialTable {
    /// Physical group of surfaces (in space: of volumes), by name, or `"#3"` by tag; may be left out where there is one material. Of several bodies `"name"` for all of one, or
    /// `"name:group"`.
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
        let meshes: Vec<&Body> =
            self.bodies().into_iter().map(|b| b.1).filter(|b| b.kind == BodyKind::Mesh).collect();
        if meshes.is_empty() {
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
            if let (Some(group), false) = (&m.group, self.parts.is_empty())
                && self.owner(m).is_none()
            {
                let message = format!("\"{group}\" is no cells of a mesh");
                let names: Vec<String> = meshes
                    .iter()
                    .filter_map(|b| Some(format!("\"{}\"", b.name.as_ref()?)))
                    .collect();
                let help = format!(
                    "give the name of a mesh, {}, or a group of it, \"NAME:GROUP\"",
                    names.join(" or ")
                );
                return Err(Issue::new(key("group"), message, help));
            }
            positive(&key("young"), m.young)?;
            positive(&key("density"), m.density)?;
            self.check_ratio(&key("poisson"), m.poisson)?;
        }
        Ok(())
    }

    /// The mesh whose cells a material is for, and their group; all cells where there is none.
    pub(crate) fn owner<'m>(
        &self,
        material: &'m MaterialTable,
    ) -> Option<(&Body, Option<&'m str>)> {
        let meshes = self.bodies().into_iter().map(|b| b.1).filter(|b| b.kind == BodyKind::Mesh);
        let of = |b: &Body| -> Option<Option<&'m str>> {
            match (&material.group, &b.name) {
                (None, _) => Some(None),
                (Some(group), Some(name)) if group == name => Some(None),
                (Some(group), _) => self.within(b, group).map(Some),
            }
        };
        let mut all = meshes.filter_map(|b| Some((b, of(b)?)));
        all.next()
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
