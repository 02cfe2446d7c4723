//! `[[support]]`: prescribed displacements.

use serde::Deserialize;

use super::check::Check;
use super::{Edge, Issue, Scene};

/// `[[support]]`: displacements set to zero on an edge.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// The edge.
    pub edge: Edge,
    /// The components: `"x"`, `"y"`.
    pub fix: Vec<Axis>,
}

/// A coordinate direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
}

impl Scene {
    /// Whether the body has an edge.
    pub(super) fn check_edge(&self, key: &str, edge: Edge) -> Check {
        if self.dim() == 1 && edge.axis() == 1 {
            let message = format!("a bar has no edge \"{}\"", edge.name());
            return Err(Issue::new(key, message, "give \"left\" or \"right\""));
        }
        Ok(())
    }

    pub(super) fn check_supports(&self) -> Check {
        for (i, s) in self.supports.iter().enumerate() {
            self.check_edge(&format!("support[{i}].edge"), s.edge)?;
            let key = format!("support[{i}].fix");
            if s.fix.is_empty() {
                return Err(Issue::new(
                    key,
                    "fixes nothing",
                    "give [\"x\"], [\"y\"] or [\"x\", \"y\"]",
                ));
            }
            if self.dim() == 1 && s.fix.contains(&Axis::Y) {
                return Err(Issue::new(key, "a bar has no y displacement", "give [\"x\"]"));
            }
        }
        Ok(())
    }
}
