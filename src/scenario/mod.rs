//! Scenes: what a TOML file says, checked, before anything is computed.
//!
//! Keys and their meaning are the product's public face; unknown keys are errors. A table that
//! is absent costs nothing: no `[damping]` means an undamped body, no `[contact]` a linear one.

mod attached;
mod body;
mod change;
mod check;
mod coefficient;
mod contact;
mod counted;
mod damping;
mod element;
mod elements;
mod error;
mod expression;
mod file;
mod given;
mod included;
mod initial;
mod load;
mod material;
mod matrices;
mod meeting;
mod method;
mod names;
mod nodes;
mod number;
mod orbit;
mod pair;
mod parts;
mod portion;
mod probe;
mod reduction;
mod run;
mod schema;
mod side;
mod superelement;
mod support;
mod swing;
mod turned;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

pub(crate) use crate::mesh::Edge;
pub use attached::{Attached, Matrix};
pub use body::{Body, State};
pub(crate) use body::{BoundaryMass, MassKind};
pub use change::Change;
pub(crate) use contact::Obstacle;
pub use contact::{Contact, Motion};
pub use counted::Counted;
pub use damping::Damping;
pub use element::{Damper, Iwan, Mass, Slider, Sliding, Spring};
pub(crate) use element::{End, Ends};
pub use elements::Elements;
pub(crate) use error::Issue;
pub use error::SceneError;
pub(crate) use error::{from_toml as misread, locate};
pub use expression::{Amplitude, Field};
pub use file::FileName;
pub use given::Given;
pub use included::Whole;
pub use initial::Components;
pub(crate) use initial::Initial;
pub use load::Load;
pub(crate) use load::LoadKind;
pub(crate) use material::MaterialTable;
pub(crate) use meeting::{ProjectionKey, SidesKey};
pub(crate) use method::{
    Activation, Instants, METHOD_KEYS, RedistributedMass, StressKey, TangentKey,
};
pub use method::{ContactMethod, Inertia};
pub use names::{RowNames, names_beside};
pub(crate) use orbit::Beta;
pub use orbit::{Auto, Orbit};
pub(crate) use portion::Portion;
pub use probe::Probe;
pub use reduction::{Reduction, ReductionKind};
pub use run::{Integrator, Run};
pub(crate) use run::{Precision, Store};
pub(crate) use schema::schema_of;
pub(crate) use side::BodyKind;
pub use superelement::Superelement;
pub use support::Direction;
pub(crate) use support::Support;
pub use swing::{Swings, Wave};
pub use turned::Turned;

/// A body, its supports, an obstacle, loads, an initial state, and what is to be computed, in coherent units of your choice. Unknown keys are errors; a
/// table that is absent costs nothing.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Title for pictures and summaries; summaries have the name of the file where there is none.
    #[serde(default)]
    pub title: String,
    /// The elastic body, `[body]`; or several of them, `[[body]]`, each with a name.
    #[serde(rename = "body")]
    bodies: parts::Bodies,
    /// The elastic body; of several what they have in common.
    #[serde(skip)]
    pub body: Body,
    /// The bodies, where there are several.
    #[serde(skip)]
    pub parts: Vec<Body>,
    /// What the cells of a mesh are made of; every cell has exactly one material.
    #[serde(default, rename = "material")]
    pub materials: Vec<MaterialTable>,
    /// Displacements that are held at zero. A rigid motion may stay free only along the contact normal, with a constant load or a velocity towards the obstacle.
    #[serde(default, rename = "support")]
    pub supports: Vec<Support>,
    /// Unilateral contact, with Coulomb friction if asked for, along the outward normal of the body: `[contact]`, or several obstacles as `[[contact]]`. Absent: a linear body.
    #[serde(default, rename = "contact")]
    tables: contact::Tables,
    /// Unilateral contact; absent: a linear body.
    #[serde(skip)]
    pub contact: Option<Contact>,
    /// Springs between displacements of the body, or from one to the ground. They belong to its stiffness: to its modes, and to what damps in proportion to it.
    #[serde(default, rename = "spring")]
    pub springs: Vec<Spring>,
    /// Viscous dampers, likewise.
    #[serde(default, rename = "damper")]
    pub dampers: Vec<Damper>,
    /// Masses at displacements of the body. They belong to its mass, and have weight.
    #[serde(default, rename = "mass")]
    pub masses: Vec<Mass>,
    /// Sliders: dry friction between displacements of the body, or from one to the ground, under forces that stay.
    #[serde(default, rename = "slider")]
    pub sliders: Vec<Slider>,
    /// Sliders with springs in parallel (Iwan's model): smooth hysteresis, as joints have it.
    #[serde(default, rename = "iwan")]
    pub iwans: Vec<Iwan>,
    /// Damping: exactly one of `rayleigh`, `ratio`, `ratios`, `modal`. Absent: none.
    pub damping: Option<Damping>,
    /// Loads; several add up.
    #[serde(default, rename = "load")]
    pub loads: Vec<Load>,
    /// What is watched besides the contact: motion and stress at places, groups, nodes.
    #[serde(default, rename = "probe")]
    pub probes: Vec<Probe>,
    /// The state at the start: `mode` and `amplitude`, or `displacement` and `velocity` (bodies of elements), or `equilibrium`, or `file`. Absent: at rest, undeformed.
    #[serde(default)]
    pub initial: Initial,
    /// What `run` does: exactly one of `until`, `periods`.
    pub run: Option<Run>,
    /// What `orbit`, `backbone` and `response` do; their options go before.
    pub orbit: Option<Orbit>,
    /// Modes of `u_O` in place of all displacements: exactly one of `modes`, `cutoff`. Not for `mass = "optimal"`, impact laws, `waves`. Of bodies from matrices `kind = "free-interface"` with
    /// `modes`: modes of the matrices as they are, and displacements without mass of the rows that the scene names; the way for superelements with fixed-interface modes.
    pub reduction: Option<Reduction>,
    /// Where the scene was read from.
    #[serde(skip)]
    pub source: Source,
    /// Matrices in place of files.
    #[serde(skip)]
    pub attached: Attached,
    /// What the rows of given matrices are called.
    #[serde(skip)]
    pub rows: RowNames,
    /// Its meshes in place of those that it names.
    #[serde(skip)]
    pub finer: crate::fem::Finer,
    /// It may be larger than the machine seems to allow: the user knows better.
    #[serde(skip)]
    pub unlimited: bool,
}

/// The text of a scene and its path.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// Path, as given.
    pub file: PathBuf,
    /// The whole text.
    pub text: String,
}

impl Scene {
    /// Read and check a scene.
    pub fn read(path: &Path) -> Result<Scene, SceneError> {
        let text = std::fs::read_to_string(path).map_err(|e| SceneError::Unreadable {
            file: path.display().to_string(),
            reason: e.to_string(),
        })?;
        Scene::parse(&text, path)
    }

    /// Check the text of a scene; `path` is for messages and for files that the scene names.
    pub fn parse(text: &str, path: &Path) -> Result<Scene, SceneError> {
        let file = path.display().to_string();
        let (numbered, rows) =
            names::in_numbers(text, path).map_err(|issue| error::locate(issue, &file, text))?;
        let mut scene: Scene =
            toml::from_str(&numbered).map_err(|e| error::from_toml(&e, &file, text))?;
        scene.rows = rows;
        scene.source = Source { file: path.to_owned(), text: text.to_owned() };
        let bodies = std::mem::take(&mut scene.bodies).merge();
        (scene.body, scene.parts) = bodies.map_err(|issue| scene.error(issue))?;
        let merged = std::mem::take(&mut scene.tables).merge(scene.body.kind);
        scene.contact = merged.map_err(|issue| scene.error(issue))?;
        scene.take_nodes().map_err(|issue| scene.error(issue))?;
        scene.take_parts().map_err(|issue| scene.error(issue))?;
        scene.take_superelement().map_err(|issue| scene.error(issue))?;
        scene.check().map_err(|issue| scene.error(issue))?;
        Ok(scene)
    }

    /// Put an issue found later (on the mesh, in the matrices) at its place in the scene.
    pub fn error(&self, issue: Issue) -> SceneError {
        error::locate(issue, &self.source.file.display().to_string(), &self.source.text)
    }

    /// Period that `periods` counts: of the first harmonic load, of the obstacle, or of the orbit.
    pub fn period(&self) -> Option<f64> {
        let obstacle = self.contact.as_ref().and_then(Contact::omega);
        let omega = self.loads.iter().find_map(|l| l.omega).or(obstacle);
        let orbit = self.orbit.as_ref();
        let omega = omega.or(orbit.and_then(|o| o.omega));
        omega.map(|w| std::f64::consts::TAU / w).or(orbit.and_then(|o| o.period))
    }

    /// End time of `run`.
    pub fn until(&self) -> Option<f64> {
        let run = self.run.as_ref()?;
        run.until.or(run.periods.and_then(|n| self.period().map(|t| n * t)))
    }

    /// Its tables and keys as JSON.
    pub fn to_json(&self) -> Result<String, SceneError> {
        let file = self.source.file.display().to_string();
        let tables: Result<serde_json::Value, _> = toml::from_str(&self.source.text);
        tables.map(|t| t.to_string()).map_err(|e| error::from_toml(&e, &file, &self.source.text))
    }

    /// Whether a key of a table stands in its text.
    pub fn gives(&self, table: &str, key: &str) -> bool {
        let tables: Result<serde_json::Value, _> = toml::from_str(&self.source.text);
        tables.is_ok_and(|t| !t[table][key].is_null())
    }

    /// Its title, or where it has none its stem.
    pub fn name(&self) -> String {
        if self.title.is_empty() { self.stem() } else { self.title.clone() }
    }

    /// The file name without folder and ending.
    pub fn stem(&self) -> String {
        let stem = self.source.file.file_stem();
        stem.map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
    }
}
