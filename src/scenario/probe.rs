//! `[[probe]]`: what is watched besides the contact, and where.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, finite, length};
use super::side::{EdgeKey, side};
use super::{BodyKind, Issue, Scene};
use crate::fem::Quantity;

/// A place, a group or a node whose motion and stress files keep, whatever else they keep.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Its name: letters, digits, `-` and `_`.
    #[schemars(extend("examples" = ["tip"]))]
    pub name: String,
    /// A place of the undeformed body: quantities are those there, in its element.
    #[schemars(extend("examples" = [[1.0, 0.25]]))]
    pub at: Option<Vec<f64>>,
    /// In its place an edge of a bar or plate: the mean, `∫u/|Γ|`.
    edge: Option<EdgeKey>,
    /// The physical group of a mesh, likewise.
    group: Option<String>,
    /// In their place a node, by its number in files (from 0); of a body from matrices a row, before an oblique obstacle `101.n` or `101.t` too.
    #[schemars(with = "Option<super::names::Row>")]
    pub node: Option<usize>,
    /// What is watched. Stress is that of the element at a place, the mean of the elements at a node, the mean over a group; recovered stress is smooth.
    #[serde(default = "motion")]
    #[schemars(extend("default" = ["displacement", "velocity"]))]
    pub quantity: Vec<Quantity>,
}

fn motion() -> Vec<Quantity> {
    vec![Quantity::Displacement, Quantity::Velocity]
}

impl Probe {
    /// The group of sides, if it is one.
    pub(crate) fn group(&self) -> Option<&str> {
        self.edge.as_ref().map(EdgeKey::name).or(self.group.as_deref())
    }

    fn check(&self, scene: &Scene, table: &str) -> Check {
        let issue = |key: &str, message: &str, help: &str| {
            Err(Issue::new(format!("{table}.{key}"), message, help))
        };
        let is_letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        if self.name.is_empty() || self.name.len() > 64 || !self.name.chars().all(is_letter) {
            let message = format!("\"{}\" is no name of a dataset", self.name);
            return issue("name", &message, "give up to 64 letters, digits, - and _: \"tip\"");
        }
        let is_side = self.edge.is_some() || self.group.is_some();
        let given = [self.at.is_some(), is_side, self.node.is_some()];
        let matrices = scene.body.kind == BodyKind::Matrices;
        let help = match matrices {
            true => "give node = 5, a row of the matrices",
            false => scene.example([
                "give at = [0.5]",
                "give at = [0.5, 0.2]",
                "give at = [0.5, 0.2, 0.1]",
            ]),
        };
        if given.iter().filter(|g| **g).count() != 1 {
            let message = match given.iter().any(|g| *g) {
                true => "says twice where it is: exactly one of at, edge or group, node",
                false => "does not say where it is: exactly one of at, edge or group, node",
            };
            return Err(Issue::new(table, message, help));
        }
        if is_side {
            side(scene.body.kind, table, self.edge.as_ref(), self.group.as_ref(), "right")?;
        }
        if let Some(at) = &self.at {
            if matrices {
                return issue("at", "is a place, and a body from matrices has rows", help);
            }
            let example = scene.example(["[0.5]", "[0.5, 0.2]", "[0.5, 0.2, 0.1]"]);
            length(&format!("{table}.at"), at.len(), scene.dim(), example)?;
            at.iter().try_for_each(|x| finite(&format!("{table}.at"), *x))?;
        }
        let all = "give some of \"displacement\", \"velocity\", \"acceleration\", \"stress\", \"recovered-stress\"";
        if self.quantity.is_empty() {
            return issue("quantity", "is empty", all);
        }
        let twice =
            (1..self.quantity.len()).any(|k| self.quantity[..k].contains(&self.quantity[k]));
        if twice {
            return issue("quantity", "names a quantity twice", all);
        }
        if let Some(q) = self.quantity.iter().find(|q| matrices && q.is_of_elements()) {
            let message =
                &format!("\"{}\" is that of elements, and a body from matrices has none", q.name());
            let help = "give some of \"displacement\", \"velocity\", \"acceleration\"";
            return issue("quantity", message, help);
        }
        Ok(())
    }
}

impl Scene {
    pub(super) fn check_probes(&self) -> Check {
        for (i, probe) in self.probes.iter().enumerate() {
            probe.check(self, &format!("probe[{i}]"))?;
            if self.probes[..i].iter().any(|p| p.name == probe.name) {
                let message = format!("\"{}\" is the name of another probe", probe.name);
                return Err(Issue::new(format!("probe[{i}].name"), message, "give another name"));
            }
        }
        Ok(())
    }
}
