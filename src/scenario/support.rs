//! `[[support]]`: prescribed displacements.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::Check;
use super::side::{EdgeKey, side};
use super::{BodyKind, Issue, Scene};

/// `[[support]]`: displacements set to zero on sides of the body.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// The edge of a bar or plate; a bar has `left` and `right`.
    edge: Option<EdgeKey>,
    /// The physical group of a mesh, by name, or `"#3"` by tag: of curves, in space of surfaces.
    group: Option<String>,
    /// What is held: components, or the normal (a plane of symmetry, however it lies). A roller holds one of them.
    #[schemars(extend("examples" = [["x", "y"], ["normal"]]))]
    pub fix: Vec<Direction>,
}

/// What is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// The displacement along x.
    X,
    /// That along y.
    Y,
    /// That along z.
    Z,
    /// That along the normal of a flat group.
    Normal,
}

impl Direction {
    /// Those along the axes.
    pub(crate) const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

    /// The axis that it is along.
    pub fn axis(self) -> Option<usize> {
        Direction::AXES.iter().position(|d| *d == self)
    }
}

impl Support {
    /// The group of sides.
    pub fn group(&self) -> &str {
        self.edge.as_ref().map(EdgeKey::name).or(self.group.as_deref()).unwrap_or_default()
    }
}

impl Scene {
    pub(super) fn check_supports(&self) -> Check {
        for (i, s) in self.supports.iter().enumerate() {
            side(
                self.body.kind,
                &format!("support[{i}]"),
                s.edge.as_ref(),
                s.group.as_ref(),
                "left",
            )?;
            let key = format!("support[{i}].fix");
            if s.fix.is_empty() {
                return Err(Issue::new(
                    key,
                    "fixes nothing",
                    "give [\"x\"], [\"y\"], [\"x\", \"y\"] or [\"normal\"]",
                ));
            }
            let beyond = |d: &&Direction| d.axis().is_some_and(|axis| axis >= self.dim());
            let too_many = s.fix.iter().find(beyond).map(|d| (d, self.body.kind));
            match too_many {
                None => {}
                Some((Direction::Y, BodyKind::Bar)) => {
                    return Err(Issue::new(key, "a bar has no y displacement", "give [\"x\"]"));
                }
                Some(_) => {
                    let message = "a body in the plane has no z displacement";
                    return Err(Issue::new(key, message, "give [\"x\"], [\"y\"] or both"));
                }
            }
        }
        Ok(())
    }
}
