//! Kinds of body, and where on each a table acts: `edge` of a bar or plate, `group` of a mesh.

use schemars::JsonSchema;
use serde::Deserialize;

use super::error::Issue;
use crate::mesh::Edge;

/// Kinds of body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// A bar along x, of elements with two nodes.
    Bar,
    /// A rectangle in its plane (plane stress), of elements with four nodes.
    Plate,
    /// A mesh of Gmsh, in the plane or in space, with a `[[material]]`.
    Mesh,
    /// `M`, `K` and the boundary operator from files of your own.
    Matrices,
}

impl BodyKind {
    /// The key by which tables name sides of the body.
    pub(crate) fn side_key(self) -> &'static str {
        if self == BodyKind::Mesh { "group" } else { "edge" }
    }
}

/// The group of sides that a table names; `table` is its key, `example` an edge that would do.
pub(super) fn side(
    kind: BodyKind,
    table: &str,
    edge: Option<Edge>,
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
            format!("give group = \"{}\", a physical group of the file", edge.name()),
        ),
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
        (BodyKind::Bar, Some(edge), None) if edge.axis() == 1 => {
            let message = format!("a bar has no edge \"{}\"", edge.name());
            issue("edge", message, "give \"left\" or \"right\"".to_owned())
        }
        (_, Some(edge), None) => Ok(edge.name().to_owned()),
    }
}
