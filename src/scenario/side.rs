//! Kinds of body, and where on each a table acts: `edge` of a bar or plate, `group` of a mesh.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use serde_json::json;

use super::error::Issue;
use super::{End, Scene};
use crate::mesh::Edge;

/// Kinds of body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// A bar along x, of elements with two nodes.
    #[default]
    Bar,
    /// A rectangle in its plane (plane stress), of elements with four nodes.
    Plate,
    /// A mesh of Gmsh, in the plane or in space, with a `[[material]]`.
    Mesh,
    /// `M`, `K` and the boundary operator from files of your own.
    Matrices,
    /// Several bodies, each in its own table.
    #[serde(skip)]
    Parts,
}

impl BodyKind {
    /// The key by which tables name sides of the body.
    pub(crate) fn side_key(self) -> &'static str {
        if self.has_groups() { "group" } else { "edge" }
    }

    /// Whether its sides have names of their own: a mesh, or several bodies.
    pub(crate) fn has_groups(self) -> bool {
        matches!(self, BodyKind::Mesh | BodyKind::Parts)
    }
}

/// An edge of a bar or plate; of one of several bodies behind its name: `"first:left"`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EdgeKey {
    text: String,
    edge: Edge,
}

impl EdgeKey {
    /// As it stands in the scene: the group of its sides.
    pub fn name(&self) -> &str {
        &self.text
    }

    /// Whether it names one of several bodies.
    fn is_of_part(&self) -> bool {
        self.text.contains(':')
    }
}

impl<'de> Deserialize<'de> for EdgeKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let name = text.rsplit(':').next().unwrap_or_default();
        let unknown = || D::Error::unknown_variant(name, &["left", "right", "bottom", "top"]);
        let edge = Edge::ALL.into_iter().find(|e| e.name() == name).ok_or_else(unknown)?;
        Ok(EdgeKey { text, edge })
    }
}

impl JsonSchema for EdgeKey {
    fn schema_name() -> Cow<'static, str> {
        Edge::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let edge = Edge::json_schema(generator).to_value();
        let mut choices = edge["oneOf"].as_array().cloned().unwrap_or_default();
        choices.push(json!({
            "type": "string",
            "pattern": "^[^:]+:(left|right|bottom|top)$",
            "description": "Of one of several bodies: `\"first:left\"`",
        }));
        json_schema!({"oneOf": choices})
    }
}

impl Scene {
    /// The groups of sides that the scene names, with the key of each.
    pub(crate) fn named_sides(&self) -> Vec<(String, &str)> {
        let supports = self.supports.iter().enumerate();
        let mut named: Vec<(String, &str)> =
            supports.map(|(i, s)| (format!("support[{i}].group"), s.whole())).collect();
        if let Some(c) = &self.contact {
            let obstacles = c.obstacles.iter().enumerate();
            named.extend(obstacles.flat_map(|(k, o)| {
                let master = o.meeting.as_ref().map(|m| (c.key(k, "master"), m.master.as_str()));
                let group = o.portion.as_ref().map_or(&o.group, |(group, _)| group);
                std::iter::once((c.side_key(k, "group"), group.as_str())).chain(master)
            }));
        }
        let loads = self.loads.iter().enumerate().filter(|(_, l)| !l.group().is_empty());
        named.extend(loads.map(|(i, l)| (format!("load[{i}].group"), l.group())));
        for (table, ends) in self.all_ends() {
            for (end, key) in [(Some(ends.from), "group"), (ends.to, "to")] {
                if let Some(End::Group(group)) = end {
                    named.push((format!("{table}.{key}"), group));
                }
            }
        }
        let probes = self.probes.iter().enumerate();
        named.extend(probes.filter_map(|(i, p)| Some((format!("probe[{i}].group"), p.group()?))));
        named.extend(self.stored_groups());
        named
    }
}

/// The group of sides that a table names; `table` is its key, `example` an edge that would do.
pub(super) fn side(
    kind: BodyKind,
    table: &str,
    edge: Option<&EdgeKey>,
    group: Option<&String>,
    example: &str,
) -> Result<String, Issue> {
    let issue = |name: &str, message: String, help: String| {
        Err(Issue::new(format!("{table}.{name}"), message, help))
    };
    match (kind, edge, group) {
        (BodyKind::Matrices, Some(_), _) | (BodyKind::Matrices, _, Some(_)) => {
            let name = if edge.is_some() { "edge" } else { "group" };
            let message = "there are no edges: the body comes from files".to_owned();
            issue(name, message, "give displacements = [66, 67]".to_owned())
        }
        (BodyKind::Mesh, Some(edge), _) => issue(
            "edge",
            "belongs to a bar or a plate; a mesh has groups".to_owned(),
            format!("give group = \"{}\", a physical group of the file", edge.edge.name()),
        ),
        (BodyKind::Parts, Some(edge), None) if edge.is_of_part() => Ok(edge.text.clone()),
        (BodyKind::Parts, None, Some(group)) if group.contains(':') => Ok(group.clone()),
        (BodyKind::Parts, Some(_), Some(_)) => {
            let message = "stands beside edge: one of them is enough".to_owned();
            issue("group", message, "remove one of them".to_owned())
        }
        (BodyKind::Parts, edge, group) => {
            let key = if group.is_some() { "group" } else { "edge" };
            let name = edge.map(EdgeKey::name).or(group.map(String::as_str));
            let message = match name {
                Some(_) => "does not say of which body",
                None => "is missing",
            };
            let help = format!(
                "give the name of a [[body]] before it: {key} = \"NAME:{}\"",
                name.unwrap_or(example)
            );
            issue(key, message.to_owned(), help)
        }
        (BodyKind::Mesh, None, Some(group)) => Ok(group.clone()),
        (BodyKind::Mesh, None, None) => issue(
            "group",
            "is missing".to_owned(),
            format!("group = \"{example}\", a physical group of the mesh; or \"#3\" by its tag"),
        ),
        (_, _, Some(_)) => issue(
            "group",
            "belongs to a mesh; a bar or a plate has edges".to_owned(),
            format!("edge = \"{example}\""),
        ),
        (_, None, None) => issue("edge", "is missing".to_owned(), format!("edge = \"{example}\"")),
        (_, Some(edge), None) if edge.is_of_part() => {
            let message = "names one of several bodies, and there is one".to_owned();
            issue("edge", message, format!("edge = \"{}\"", edge.edge.name()))
        }
        (BodyKind::Bar, Some(edge), None) if edge.edge.axis() == 1 => {
            let message = format!("a bar has no edge \"{}\"", edge.name());
            issue("edge", message, "give \"left\" or \"right\"".to_owned())
        }
        (_, Some(edge), None) => Ok(edge.name().to_owned()),
    }
}
