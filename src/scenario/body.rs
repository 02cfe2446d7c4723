//! `[body]`: a bar, a plate, a mesh from a file, or matrices from files.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{Check, length, positive};
use super::parts::Axis;
use super::{BodyKind, Issue, Scene};

/// Most nodes of a mesh.
const MOST_NODES: usize = 50_000_000;

/// `[body]`
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Of several bodies: its name. Other tables call its sides by it: `edge = "first:left"`, `group = "first:nose"`.
    #[schemars(extend("examples" = ["first"]))]
    pub name: Option<String>,
    /// What it is.
    pub kind: BodyKind,
    /// Length of a bar `[L]`, length and height of a plate `[L, H]`.
    #[serde(default)]
    #[schemars(extend("examples" = [[1.0], [1.0, 0.5]]))]
    pub size: Vec<f64>,
    /// Elements of a bar `[n]`, of a plate `[nx, ny]`.
    #[serde(default)]
    #[schemars(extend("examples" = [[20], [20, 10]]))]
    pub elements: Vec<usize>,
    /// Young's modulus E of a bar or plate.
    pub young: Option<f64>,
    /// Poisson's ratio ν of a plate, −1 < ν < 1.
    pub poisson: Option<f64>,
    /// Mass density ρ of a bar or plate.
    pub density: Option<f64>,
    /// Thickness of a plate, or of a mesh in plane stress or strain.
    #[schemars(extend("default" = 1.0))]
    pub thickness: Option<f64>,
    /// File of the mesh, relative to the scene: of Gmsh (4.1 or 2.2, ASCII), a deck of Abaqus or CalculiX (`.inp`), bulk data of Nastran (`.bdf`), or of VTK (`.vtu`).
    #[schemars(extend("examples" = ["meshes/bracket.msh"]))]
    pub file: Option<PathBuf>,
    /// What a mesh in the plane stands for; a mesh in space has none.
    pub state: Option<State>,
    /// What the coordinates of a mesh are multiplied by.
    #[schemars(extend("default" = 1.0))]
    pub scale: Option<f64>,
    /// Of several bodies: mirrored, along this axis about the origin, before it is turned and moved.
    pub mirror: Option<Axis>,
    /// Of several bodies: turned in the plane of x and y about the origin, in degrees, counter-clockwise.
    #[schemars(extend("default" = 0.0))]
    pub turn: Option<f64>,
    /// Of several bodies: moved by this.
    #[serde(rename = "move")]
    #[schemars(extend("examples" = [[1.0], [1.0, 0.5]]))]
    pub shift: Option<Vec<f64>>,
    /// Cross-section A of a bar.
    #[schemars(extend("default" = 1.0))]
    pub area: Option<f64>,
    /// How the mass matrix is integrated.
    #[serde(default)]
    pub mass: MassKind,
    /// `M` over all displacements, symmetric, positive definite: a Matrix Market file, or a dataset as `FILE.h5:/path`, relative to the scene.
    #[schemars(extend("examples" = ["M.mtx", "model.h5:/M"]))]
    pub mass_matrix: Option<String>,
    /// `K`, likewise.
    pub stiffness_matrix: Option<String>,
    /// `C`, likewise; a combination of `M` and `K`.
    pub damping_matrix: Option<String>,
    /// The deck (`.inp`) that the matrices come from: sets and places of its nodes, for `[contact] nodes` and for gaps that are expressions of x, y and z.
    #[schemars(extend("examples" = ["block.inp"]))]
    pub deck: Option<PathBuf>,
    /// What the rows of the matrices are called, where neither they nor a file beside them say (Abaqus's COORDINATE, OP4, Matrix Market, `.npz`): a list, a row a line, node and
    /// direction (1 to 6, or x y z rx ry rz).
    #[schemars(extend("examples" = ["rows.csv"]))]
    pub names: Option<PathBuf>,
}

/// `state` of a body in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum State {
    /// No stress across the plane.
    #[serde(rename = "plane stress")]
    PlaneStress,
    /// No strain across the plane.
    #[serde(rename = "plane strain")]
    PlaneStrain,
    /// A ring around y: x is the radius.
    #[serde(rename = "axisymmetric")]
    Axisymmetric,
}

/// How a mass matrix is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MassKind {
    /// `∫ ρ Pᵀ P`.
    #[default]
    Consistent,
    /// On the diagonal: row sums of elements of first order, Simpson's rule of nine-node quadrilaterals and 27-node hexahedra; others of second order have nodes without mass.
    Lumped,
    /// The consistent mass's diagonal, scaled to the mass of each element (Hinton, Rock and Zienkiewicz): for every element.
    ScaledDiagonal,
}

/// How the mass matrix of the boundary is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BoundaryMass {
    /// `∫ N_i N_j`.
    #[default]
    Consistent,
    /// Row sums on the diagonal.
    Lumped,
}

impl Scene {
    pub(super) fn check_body(&self) -> Check {
        match self.body.kind {
            BodyKind::Matrices => self.check_matrices(),
            // each was checked with its own key
            BodyKind::Parts => Ok(()),
            _ => self.body.check("body"),
        }
    }
}

impl Body {
    /// Space dimension of the displacement.
    pub(super) fn dim(&self) -> usize {
        match self.kind {
            BodyKind::Bar | BodyKind::Matrices => 1,
            // a state is one of the plane
            BodyKind::Mesh | BodyKind::Parts if self.state.is_none() => 3,
            BodyKind::Plate | BodyKind::Mesh | BodyKind::Parts => 2,
        }
    }

    /// The example for a bar, a body in the plane or one in space.
    pub(super) fn example(&self, all: [&'static str; 3]) -> &'static str {
        all[self.dim() - 1]
    }

    /// What a body of elements, whose table has this key, must have.
    pub(super) fn check(&self, table: &str) -> Check {
        self.check_presence(table)?;
        if self.kind == BodyKind::Mesh {
            return self.check_file(table);
        }
        self.check_mesh(table)?;
        self.check_section(table)
    }

    /// What a body of elements must have, and what only matrices have.
    fn check_presence(&self, table: &str) -> Check {
        let files = [
            ("mass_matrix", self.mass_matrix.is_some()),
            ("stiffness_matrix", self.stiffness_matrix.is_some()),
            ("damping_matrix", self.damping_matrix.is_some()),
            ("deck", self.deck.is_some()),
            ("names", self.names.is_some()),
        ];
        if let Some((key, _)) = files.iter().find(|f| f.1) {
            let message = "belongs to kind = \"matrices\", this body has elements";
            return Err(Issue::new(
                format!("{table}.{key}"),
                message,
                "remove the key or change the kind",
            ));
        }
        let of_mesh = [
            ("file", self.file.is_some()),
            ("state", self.state.is_some()),
            ("scale", self.scale.is_some()),
        ];
        let generated = [
            ("size", !self.size.is_empty()),
            ("elements", !self.elements.is_empty()),
            ("young", self.young.is_some()),
            ("poisson", self.poisson.is_some()),
            ("density", self.density.is_some()),
            ("area", self.area.is_some()),
        ];
        let is_mesh = self.kind == BodyKind::Mesh;
        let (others, owner) = match is_mesh {
            true => (&generated[..], "a bar or a plate; a mesh has [[material]]"),
            false => (&of_mesh[..], "kind = \"mesh\""),
        };
        if let Some((key, _)) = others.iter().find(|k| k.1) {
            let message = format!("belongs to {owner}");
            return Err(Issue::new(format!("{table}.{key}"), message, "remove the key"));
        }
        if is_mesh {
            return Ok(());
        }
        for (key, value) in [("young", self.young), ("density", self.density)] {
            if value.is_none() {
                return Err(Issue::new(
                    format!("{table}.{key}"),
                    "is missing",
                    format!("{key} = 1.0"),
                ));
            }
        }
        for (key, is_empty) in
            [("size", self.size.is_empty()), ("elements", self.elements.is_empty())]
        {
            if is_empty {
                return Err(Issue::new(
                    format!("{table}.{key}"),
                    "is missing",
                    "see the reference of scenes (docs/reference/scenes.md)",
                ));
            }
        }
        Ok(())
    }

    /// What a mesh must have.
    fn check_file(&self, table: &str) -> Check {
        if self.file.is_none() {
            return Err(Issue::new(
                format!("{table}.file"),
                "is missing",
                "file = \"bracket.msh\" (Gmsh; or .inp, .bdf, .vtu)",
            ));
        }
        let has_thickness = matches!(self.state, Some(State::PlaneStress | State::PlaneStrain));
        if self.thickness.is_some() && !has_thickness {
            let message = match self.state {
                Some(_) => "belongs to plane stress and plane strain; a ring has none",
                None => {
                    "belongs to a body in the plane, which has body.state; one in space has neither"
                }
            };
            return Err(Issue::new(format!("{table}.thickness"), message, "remove the key"));
        }
        positive(&format!("{table}.thickness"), self.thickness.unwrap_or(1.0))?;
        positive(&format!("{table}.scale"), self.scale.unwrap_or(1.0))
    }

    /// Size, elements and the numbers that every body of elements has.
    fn check_mesh(&self, table: &str) -> Check {
        let dim = self.dim();
        let (size, elements) =
            if dim == 1 { ("[1.0]", "[20]") } else { ("[1.0, 0.5]", "[20, 10]") };
        length(&format!("{table}.size"), self.size.len(), dim, size)?;
        length(&format!("{table}.elements"), self.elements.len(), dim, elements)?;
        self.size.iter().try_for_each(|&v| positive(&format!("{table}.size"), v))?;
        positive(&format!("{table}.young"), self.young.unwrap_or(f64::NAN))?;
        positive(&format!("{table}.density"), self.density.unwrap_or(f64::NAN))?;
        if self.elements.contains(&0) {
            return Err(Issue::new(
                format!("{table}.elements"),
                "needs at least one element",
                elements,
            ));
        }
        let product = |n: usize, &e: &usize| n.saturating_mul(e.saturating_add(1));
        let n_nodes = self.elements.iter().fold(1usize, product);
        if n_nodes > MOST_NODES {
            return Err(Issue::new(
                format!("{table}.elements"),
                format!("{n_nodes} nodes are more than this program can hold"),
                "give at most 50 million nodes",
            ));
        }
        Ok(())
    }

    /// What a bar or a plate has alone.
    fn check_section(&self, table: &str) -> Check {
        let misplaced = |key: &str, owner: &str| {
            let message = format!("belongs to a {owner}, this body is not one");
            Err(Issue::new(format!("{table}.{key}"), message, "remove the key or change the kind"))
        };
        match self.kind {
            BodyKind::Bar if self.poisson.is_some() => misplaced("poisson", "plate"),
            BodyKind::Bar if self.thickness.is_some() => misplaced("thickness", "plate"),
            BodyKind::Bar => positive(&format!("{table}.area"), self.area.unwrap_or(1.0)),
            BodyKind::Plate if self.area.is_some() => misplaced("area", "bar"),
            BodyKind::Matrices | BodyKind::Mesh | BodyKind::Parts => Ok(()),
            BodyKind::Plate => {
                positive(&format!("{table}.thickness"), self.thickness.unwrap_or(1.0))?;
                self.check_poisson(table)
            }
        }
    }

    fn check_poisson(&self, table: &str) -> Check {
        let nu = self.poisson.ok_or_else(|| {
            Issue::new(
                format!("{table}.poisson"),
                "is missing",
                "a plate needs a Poisson ratio, -1 < ν < 1",
            )
        })?;
        if nu > -1.0 && nu < 1.0 {
            return Ok(());
        }
        Err(Issue::new(
            format!("{table}.poisson"),
            format!("{nu} makes the plane-stress stiffness indefinite"),
            "give -1 < ν < 1 (plane stress; isotropic solids have ν ≤ 0.5)",
        ))
    }
}
