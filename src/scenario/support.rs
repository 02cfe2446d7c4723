//! `[[support]]`: prescribed displacements.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::Check;
use super::portion::{Keys, Portion};
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
    /// The part of the edge or group between two shares of its length (in the plane), in the order of its nodes: the other sides are free.
    #[schemars(extend("examples" = [[0.9, 1.0]]))]
    from: Option<[f64; 2]>,
    /// In its place: the part in a box along the axes, by the middles of its sides: the lower corner, the upper one.
    #[schemars(extend("examples" = [[[0.9, 0.0], [1.0, 0.5]]]))]
    r#box: Option<[Vec<f64>; 2]>,
    /// In its place: the part where conditions hold.
    #[schemars(extend("examples" = ["x > 0.9"]))]
    r#where: Option<String>,
    /// In its place: chosen nodes of the edge or group, by their numbers in the file of the mesh (of plates by those in results, from 0).
    #[schemars(extend("examples" = [[12, 17]]))]
    nodes: Option<Vec<i64>>,
    /// The part, with the name of its group.
    #[serde(skip)]
    part: Option<(String, Portion)>,
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
    /// The group of sides, or of what is chosen of it.
    pub fn group(&self) -> &str {
        self.part.as_ref().map_or(self.whole(), |(name, _)| name)
    }

    /// The edge or group of which a part may be chosen.
    pub(super) fn whole(&self) -> &str {
        self.edge.as_ref().map(EdgeKey::name).or(self.group.as_deref()).unwrap_or_default()
    }

    /// The edge or group, and which part of it holds.
    pub(crate) fn part(&self) -> Option<(&str, &Portion)> {
        self.part.as_ref().map(|(_, portion)| (self.whole(), portion))
    }
}

impl Scene {
    /// The parts of edges and groups that supports hold.
    pub(super) fn take_parts(&mut self) -> Check {
        for (i, s) in self.supports.iter_mut().enumerate() {
            let keys = Keys {
                from: s.from,
                r#box: s.r#box.as_ref(),
                nodes: s.nodes.as_deref(),
                r#where: s.r#where.as_deref(),
            };
            let part = Portion::given(&keys, &|name| format!("support[{i}].{name}"))?;
            s.part = part.map(|part| (part.name(s.whole()), part));
        }
        Ok(())
    }

    pub(super) fn check_supports(&self) -> Check {
        for (i, s) in self.supports.iter().enumerate() {
            side(
                self.body.kind,
                &format!("support[{i}]"),
                s.edge.as_ref(),
                s.group.as_ref(),
                "left",
            )?;
            if let Some((_, portion)) = &s.part {
                portion.check(self, &|name| format!("support[{i}].{name}"))?;
            }
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
