//! Scenes: what a TOML file says, checked, before anything is computed.
//!
//! Keys and their meaning are the product's public face; unknown keys are errors. A table that
//! is absent costs nothing: no `[damping]` means an undamped body, no `[contact]` a linear one.

mod check;
mod contact;
mod error;
mod expression;

use std::path::{Path, PathBuf};

use serde::Deserialize;

pub use crate::mesh::Edge;
pub use contact::{Contact, ContactMethod, Inertia, RedistributedMass, StressKey};
pub use error::{Issue, SceneError};
pub use expression::{Amplitude, Field};

/// A whole scene.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Title for pictures and summaries.
    #[serde(default)]
    pub title: String,
    /// The elastic body.
    pub body: Body,
    /// Prescribed displacements.
    #[serde(default, rename = "support")]
    pub supports: Vec<Support>,
    /// Unilateral contact; absent: a linear body.
    pub contact: Option<Contact>,
    /// Damping; absent: none.
    pub damping: Option<Damping>,
    /// Loads; several add up.
    #[serde(default, rename = "load")]
    pub loads: Vec<Load>,
    /// Initial state; absent: at rest, undeformed.
    #[serde(default)]
    pub initial: Initial,
    /// What `run` does.
    pub run: Option<Run>,
    /// What `orbit`, `backbone` and `response` do.
    pub orbit: Option<Orbit>,
    /// Where the scene was read from.
    #[serde(skip)]
    pub source: Source,
}

/// The text of a scene and its path.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// Path, as given.
    pub file: PathBuf,
    /// The whole text.
    pub text: String,
}

/// `[body]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Bar, plate, or matrices from files.
    pub kind: BodyKind,
    /// `[L]` or `[L, H]`.
    #[serde(default)]
    pub size: Vec<f64>,
    /// `[n]` or `[nx, ny]`.
    #[serde(default)]
    pub elements: Vec<usize>,
    /// Young's modulus E.
    pub young: Option<f64>,
    /// Poisson's ratio ν (plate).
    pub poisson: Option<f64>,
    /// Mass density ρ.
    pub density: Option<f64>,
    /// Thickness h (plate), 1 by default.
    pub thickness: Option<f64>,
    /// Cross-section A (bar), 1 by default.
    pub area: Option<f64>,
    /// Consistent or row-sum lumped mass.
    #[serde(default)]
    pub mass: MassKind,
    /// File of `M` over all displacements (kind `matrices`): Matrix Market, or `FILE.h5:/dataset`.
    pub mass_matrix: Option<String>,
    /// File of `K`.
    pub stiffness_matrix: Option<String>,
    /// File of `C`, which must be a combination of `M` and `K`.
    pub damping_matrix: Option<String>,
}

/// Kinds of body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// One-dimensional bar, two-node elements.
    Bar,
    /// Rectangular plate in its plane (plane stress), four-node elements.
    Plate,
    /// `M`, `K` and the boundary operator from files.
    Matrices,
}

/// How a mass matrix is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MassKind {
    /// `∫ Pᵀ P`.
    #[default]
    Consistent,
    /// Row sums on the diagonal.
    Lumped,
}

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

/// `[damping]`: exactly one of the three.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Damping {
    /// `C = α M + β K` as `[α, β]`.
    pub rayleigh: Option<[f64; 2]>,
    /// Ratio at one mode (stiffness proportional, α = 0).
    pub ratio: Option<f64>,
    /// The mode of `ratio`, 1 by default.
    pub mode: Option<usize>,
    /// Ratios at two modes: `[[mode, ξ], [mode, ξ]]`.
    pub ratios: Option<[(usize, f64); 2]>,
}

/// `[[load]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// What kind.
    pub kind: LoadKind,
    /// The mode (kind `mode`).
    pub mode: Option<usize>,
    /// The edge (kind `traction`).
    pub edge: Option<Edge>,
    /// The point (kind `point`); the load acts on the nearest node.
    pub at: Option<Vec<f64>>,
    /// Number or vector, as the kind needs.
    pub amplitude: Option<Amplitude>,
    /// Instead of the amplitude of a harmonic load of kind `mode`: the peak of the linear resonance of that mode, over the amplitude
    /// that grazes the obstacle.
    pub peak: Option<f64>,
    /// Harmonic `cos(ω t + phase)`; absent: constant.
    pub omega: Option<f64>,
    /// Phase of the harmonic.
    #[serde(default)]
    pub phase: f64,
}

/// Kinds of load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoadKind {
    /// `M A* φ_k`: in the shape of a mode of the open body.
    Mode,
    /// Acceleration of gravity on the mass.
    Gravity,
    /// Force per unit area on an edge.
    Traction,
    /// Force at a node.
    Point,
}

/// `[initial]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Start in a mode of the open phase.
    pub mode: Option<usize>,
    /// Contact displacement of largest magnitude, over the gap.
    pub amplitude: Option<f64>,
    /// Displacement components.
    pub displacement: Option<Vec<Field>>,
    /// Velocity components.
    pub velocity: Option<Vec<Field>>,
    /// A stored state.
    pub file: Option<PathBuf>,
    /// The static equilibrium under the constant loads, contact included (with `velocity`, if given).
    #[serde(default)]
    pub equilibrium: bool,
}

/// `[run]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// End time.
    pub until: Option<f64>,
    /// Or: number of periods of the load or orbit.
    pub periods: Option<f64>,
    /// The flow of a smooth phase.
    #[serde(default)]
    pub integrator: Integrator,
    /// Relative tolerance of a step.
    #[serde(default = "default_rtol")]
    pub rtol: f64,
    /// Absolute tolerance of a step, over the scales of the problem (largest gap; gap × frequency).
    #[serde(default = "default_atol")]
    pub atol: f64,
    /// Number of stored states, evenly spaced.
    #[serde(default = "default_samples")]
    pub samples: usize,
    /// Most switches a contact node may make within ten shortest natural periods before the run
    /// is ended as an accumulation.
    #[serde(default = "default_switch_limit")]
    pub switch_limit: f64,
}

fn default_rtol() -> f64 {
    1e-9
}
fn default_atol() -> f64 {
    1e-12
}
fn default_samples() -> usize {
    400
}
fn default_switch_limit() -> f64 {
    40.0
}

/// Flows of one smooth phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// Dormand–Prince 5(4).
    Dopri5,
    /// Dormand–Prince 8(5,3).
    Dop853,
    /// Exact, by the modes of each active set.
    Modal,
    /// Exact without modes, for large undamped bodies under constant loads.
    Chebyshev,
    /// Whichever costs least, phase by phase.
    #[default]
    Auto,
}

impl Integrator {
    /// The name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Integrator::Dopri5 => "dopri5",
            Integrator::Dop853 => "dop853",
            Integrator::Modal => "modal",
            Integrator::Chebyshev => "chebyshev",
            Integrator::Auto => "auto",
        }
    }
}

/// `[orbit]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Circular frequency.
    pub omega: Option<f64>,
    /// Or the period.
    pub period: Option<f64>,
    /// Number of harmonics.
    pub harmonics: Option<usize>,
    /// Range of continuation.
    pub range: Option<[f64; 2]>,
    /// Damping ratios of `response`, in place of the scene's own.
    pub ratios: Option<Vec<f64>>,
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
        let mut scene: Scene =
            toml::from_str(text).map_err(|e| error::from_toml(&e, &file, text))?;
        scene.source = Source { file: path.to_owned(), text: text.to_owned() };
        scene.check().map_err(|issue| scene.error(issue))?;
        Ok(scene)
    }

    /// Put an issue found later (on the mesh, in the matrices) at its place in the scene.
    pub fn error(&self, issue: Issue) -> SceneError {
        error::locate(issue, &self.source.file.display().to_string(), &self.source.text)
    }

    /// Period that `periods` counts: of the first harmonic load, or of the orbit.
    pub fn period(&self) -> Option<f64> {
        let omega = self.loads.iter().find_map(|l| l.omega);
        let orbit = self.orbit.as_ref();
        let omega = omega.or(orbit.and_then(|o| o.omega));
        omega.map(|w| std::f64::consts::TAU / w).or(orbit.and_then(|o| o.period))
    }

    /// End time of `run`.
    pub fn until(&self) -> Option<f64> {
        let run = self.run.as_ref()?;
        run.until.or(run.periods.and_then(|n| self.period().map(|t| n * t)))
    }

    /// All files that it names, relative to its own folder.
    pub fn files(&self) -> Vec<PathBuf> {
        let folder = self.source.file.parent().unwrap_or(Path::new(""));
        let contact = self.contact.as_ref();
        let matrices = [
            self.body.mass_matrix.as_ref(),
            self.body.stiffness_matrix.as_ref(),
            self.body.damping_matrix.as_ref(),
            contact.and_then(|c| c.n_c.as_ref()),
            contact.and_then(|c| c.n_o.as_ref()),
        ];
        // FILE.h5:/dataset
        let file = |name: &String| match name.split_once(":/") {
            Some((file, _)) => folder.join(file),
            None => folder.join(name),
        };
        let matrices = matrices.into_iter().flatten().map(file);
        matrices.chain(self.initial.file.iter().map(|f| folder.join(f))).collect()
    }

    /// The file name without folder and ending.
    pub fn stem(&self) -> String {
        let stem = self.source.file.file_stem();
        stem.map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
    }
}
