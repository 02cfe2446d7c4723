//! `[[support]]`: prescribed displacements.

use schemars::JsonSchema;
use serde::Deserialize;

use super::nodes::NodesKey;
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
    /// In its place: chosen nodes of the edge or group, by their numbers in the file of the mesh (of plates by those in results, from 0). Of bodies from matrices whose rows have
    /// names: nodes by theirs, or a set of `body.deck`; what is held is no row.
    #[schemars(extend("examples" = [[12, 17], "BASE"]))]
    nodes: Option<NodesKey>,
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

    /// Whether only a part is to be held.
    fn part_is_given(&self) -> bool {
        self.from.is_some() || self.r#box.is_some() || self.r#where.is_some()
    }

    /// The edge or group, and which part of it holds.
    pub(crate) fn part(&self) -> Option<(&str, &Portion)> {
        self.part.as_ref().map(|(_, portion)| (self.whole(), portion))
    }
}

impl Scene {
    /// The parts of edges and groups that supports hold.
    pub(super) fn take_parts(&mut self) -> Check {
        if self.body.kind == BodyKind::Matrices {
            return Ok(());
        }
        for (i, s) in self.supports.iter_mut().enumerate() {
            let nodes = match &s.nodes {
                None => None,
                Some(NodesKey::Numbers(nodes)) => Some(nodes.as_slice()),
                Some(NodesKey::Set(set)) => {
                    let message = format!("\"{set}\" is a set of a deck, and this body is a mesh");
                    let help = "give nodes by their numbers, [12, 17], or a group";
                    return Err(Issue::new(format!("support[{i}].nodes"), message, help));
                }
            };
            let keys = Keys {
                from: s.from,
                r#box: s.r#box.as_ref(),
                nodes,
                r#where: s.r#where.as_deref(),
            };
            let part = Portion::given(&keys, &|name| format!("support[{i}].{name}"))?;
            s.part = part.map(|part| (part.name(s.whole()), part));
        }
        Ok(())
    }

    /// Of bodies from matrices supports hold nodes, whose rows have names.
    fn check_held_rows(&self) -> Check {
        for (i, s) in self.supports.iter().enumerate() {
            let issue = |key: &str, message: &str, help: &str| {
                Err(Issue::new(format!("support[{i}].{key}"), message, help))
            };
            let of_sides = s.edge.is_some() || s.group.is_some() || s.part_is_given();
            if of_sides && s.nodes.is_some() {
                let message = "holds nodes, and says sides beside them";
                return issue("nodes", message, "remove edge, group, from, box and where");
            }
            if s.nodes.is_none() {
                let help = "give nodes = [101, 102], or a set of body.deck, and fix; or leave prescribed displacements out of the matrices";
                return issue("nodes", "is missing: a body from matrices has no edges", help);
            }
            if self.rows.of_file.is_empty() && self.rows.missing.is_none() {
                let help = "leave prescribed displacements out of the matrices, or give matrices whose rows have names";
                return issue("nodes", "are those of no row: the rows have no names", help);
            }
            if s.fix.is_empty() || s.fix.iter().any(|d| d.axis().is_none()) {
                let message = "rows of matrices are displacements along axes";
                return issue("fix", message, "give some of \"x\", \"y\", \"z\"");
            }
        }
        Ok(())
    }

    pub(super) fn check_supports(&self) -> Check {
        if self.body.kind == BodyKind::Matrices {
            return self.check_held_rows();
        }
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
