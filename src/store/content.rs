//! What kind of results a file holds, and where it comes from.

use std::path::Path;

use super::careful::{Careful, open, reading};
use super::{StoreError, read_text};

/// Kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// A run.
    Run,
    /// A run over one period, and the orbit.
    Orbit,
    /// A family of orbits.
    Family,
    /// Basins of attraction.
    Basins,
    /// A bifurcation diagram over a number of the scene.
    Diagram,
    /// A test of phase resonance.
    PhaseResonance,
    /// Motions of two frequencies.
    Tori,
    /// Bands of a family.
    Bands,
    /// Curves over a number of the scene.
    Curves,
    /// Contact methods side by side.
    Comparison,
    /// What the tasks of a study found.
    Study,
    /// Matrices for other programs.
    Arrays,
}

/// The kind of a file.
pub fn content(path: &Path) -> Result<Content, StoreError> {
    let file = open(path)?;
    if file.link_exists("comparison") {
        return Ok(Content::Comparison);
    }
    if file.link_exists("study") {
        return Ok(Content::Study);
    }
    if file.link_exists("basins") {
        return Ok(Content::Basins);
    }
    if file.link_exists("diagram") {
        return Ok(Content::Diagram);
    }
    if file.link_exists("phase_resonance") {
        return Ok(Content::PhaseResonance);
    }
    if file.link_exists("tori") {
        return Ok(Content::Tori);
    }
    if file.link_exists("bands") {
        return Ok(Content::Bands);
    }
    if file.link_exists("curves") {
        return Ok(Content::Curves);
    }
    if !file.link_exists("mesh") && file.link_exists("K") && file.link_exists("M") {
        return Ok(Content::Arrays);
    }
    Ok(match (file.link_exists("backbone"), file.link_exists("orbit")) {
        (true, _) => Content::Family,
        (_, true) => Content::Orbit,
        _ => Content::Run,
    })
}

/// Who made a file, and on which mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// Program version.
    pub version: String,
    /// Time of creation.
    pub created: String,
    /// Command line.
    pub command: String,
    /// Number of mesh nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Number of displacements.
    pub displacements: usize,
    /// Number of contact points.
    pub contact_points: usize,
}

/// Read the origin of any file.
pub(crate) fn read_origin(path: &Path) -> Result<Origin, StoreError> {
    reading(path, || read_origin_of(path))
}

fn read_origin_of(path: &Path) -> Result<Origin, StoreError> {
    let file = open(path)?;
    let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/mesh".into() };
    let mesh = file.group("mesh").map_err(missing)?;
    let text = |name: &str| read_text(&file, name).unwrap_or_default();
    let rows = |name: &str| -> Result<usize, StoreError> {
        Ok(mesh.dataset(name)?.shape().first().copied().unwrap_or(0))
    };
    let map: Vec<i64> = mesh.dataset("dof_map")?.values()?;
    Ok(Origin {
        version: text("signorini_version"),
        created: text("created"),
        command: text("command"),
        nodes: rows("nodes")?,
        elements: rows("elements")?,
        displacements: map.iter().filter(|&&i| i >= 0).count(),
        contact_points: rows("gap")?,
    })
}
