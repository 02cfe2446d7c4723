//! `[body]`: a bar, a plate, a mesh from a file, or matrices from files.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{Check, length, positive};
use super::{BodyKind, Issue, Scene};

/// Most nodes of a mesh.
const MOST_NODES: usize = 50_000_000;

/// `[body]`
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
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
    /// File of the mesh (Gmsh 4.1 or 2.2, ASCII), relative to the scene.
    #[schemars(extend("examples" = ["meshes/bracket.msh"]))]
    pub file: Option<PathBuf>,
    /// What a mesh in the plane stands for; a mesh in space has none.
    pub state: Option<State>,
    /// What the coordinates of a mesh are multiplied by.
    #[schemars(extend("default" = 1.0))]
    pub scale: Option<f64>,
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
#[serde(rename_all = "lowercase")]
pub enum MassKind {
    /// `∫ ρ Pᵀ P`.
    #[default]
    Consistent,
    /// Row sums on the diagonal; elements of first order.
    Lumped,
}

impl Scene {
    pub(super) fn check_body(&self) -> Check {
        if self.body.kind == BodyKind::Matrices {
            return self.check_matrices();
        }
        self.body.check_presence()?;
        if self.body.kind == BodyKind::Mesh {
            return self.body.check_file();
        }
        self.body.check_mesh(self.dim())?;
        self.body.check_section()
    }
}

impl Body {
    /// What a body of elements must have, and what only matrices have.
    fn check_presence(&self) -> Check {
        let files = [
            ("body.mass_matrix", self.mass_matrix.is_some()),
            ("body.stiffness_matrix", self.stiffness_matrix.is_some()),
            ("body.damping_matrix", self.damping_matrix.is_some()),
        ];
        if let Some((key, _)) = files.iter().find(|f| f.1) {
            let message = "belongs to kind = \"matrices\", this body has elements";
            return Err(Issue::new(*key, message, "remove the key or change body.kind"));
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
            return Err(Issue::new(format!("body.{key}"), message, "remove the key"));
        }
        if is_mesh {
            return Ok(());
        }
        for (key, value) in [("young", self.young), ("density", self.density)] {
            if value.is_none() {
                return Err(Issue::new(
                    format!("body.{key}"),
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
                    format!("body.{key}"),
                    "is missing",
                    "see the reference of scenes (docs/reference/scenes.md)",
                ));
            }
        }
        Ok(())
    }

    /// What a mesh must have.
    fn check_file(&self) -> Check {
        if self.file.is_none() {
            return Err(Issue::new("body.file", "is missing", "file = \"bracket.msh\" (Gmsh)"));
        }
        let has_thickness = matches!(self.state, Some(State::PlaneStress | State::PlaneStrain));
        if self.thickness.is_some() && !has_thickness {
            let message = match self.state {
                Some(_) => "belongs to plane stress and plane strain; a ring has none",
                None => {
                    "belongs to a body in the plane, which has body.state; one in space has neither"
                }
            };
            return Err(Issue::new("body.thickness", message, "remove the key"));
        }
        positive("body.thickness", self.thickness.unwrap_or(1.0))?;
        positive("body.scale", self.scale.unwrap_or(1.0))
    }

    /// Size, elements and the numbers that every body of elements has.
    fn check_mesh(&self, dim: usize) -> Check {
        let (size, elements) =
            if dim == 1 { ("[1.0]", "[20]") } else { ("[1.0, 0.5]", "[20, 10]") };
        length("body.size", self.size.len(), dim, size)?;
        length("body.elements", self.elements.len(), dim, elements)?;
        self.size.iter().try_for_each(|&v| positive("body.size", v))?;
        positive("body.young", self.young.unwrap_or(f64::NAN))?;
        positive("body.density", self.density.unwrap_or(f64::NAN))?;
        if self.elements.contains(&0) {
            return Err(Issue::new("body.elements", "needs at least one element", elements));
        }
        let product = |n: usize, &e: &usize| n.saturating_mul(e.saturating_add(1));
        let n_nodes = self.elements.iter().fold(1usize, product);
        if n_nodes > MOST_NODES {
            return Err(Issue::new(
                "body.elements",
                format!("{n_nodes} nodes are more than this program can hold"),
                "give at most 50 million nodes",
            ));
        }
        Ok(())
    }

    /// What a bar or a plate has alone.
    fn check_section(&self) -> Check {
        let misplaced = |key: &str, owner: &str| {
            let message = format!("belongs to a {owner}, this body is not one");
            Err(Issue::new(key, message, "remove the key or change body.kind"))
        };
        match self.kind {
            BodyKind::Bar if self.poisson.is_some() => misplaced("body.poisson", "plate"),
            BodyKind::Bar if self.thickness.is_some() => misplaced("body.thickness", "plate"),
            BodyKind::Bar => positive("body.area", self.area.unwrap_or(1.0)),
            BodyKind::Plate if self.area.is_some() => misplaced("body.area", "bar"),
            BodyKind::Matrices | BodyKind::Mesh => Ok(()),
            BodyKind::Plate => {
                positive("body.thickness", self.thickness.unwrap_or(1.0))?;
                self.check_poisson()
            }
        }
    }

    fn check_poisson(&self) -> Check {
        let nu = self.poisson.ok_or_else(|| {
            Issue::new("body.poisson", "is missing", "a plate needs a Poisson ratio, -1 < ν < 1")
        })?;
        if nu > -1.0 && nu < 1.0 {
            return Ok(());
        }
        Err(Issue::new(
            "body.poisson",
            format!("{nu} makes the plane-stress stiffness indefinite"),
            "give -1 < ν < 1 (plane stress; isotropic solids have ν ≤ 0.5)",
        ))
    }
}
