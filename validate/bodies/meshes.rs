//! Meshes of the case in files, for as long as it runs.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::super::rectangle::msh;
use signorini::mesh::Mesh;

/// The meshes of the reference.
const REFERENCE: [(&str, &str); 6] = [
    ("t3_plate", include_str!("../../tests/reference/meshes/t3_plate.msh")),
    ("t6_plate", include_str!("../../tests/reference/meshes/t6_plate.msh")),
    ("q4_distorted", include_str!("../../tests/reference/meshes/q4_distorted.msh")),
    ("hex8_box", include_str!("../../tests/reference/meshes/hex8_box.msh")),
    ("two_blocks", include_str!("../../tests/reference/meshes/two_blocks.msh")),
    ("cracked_beam", include_str!("../../tests/reference/meshes/cracked_beam.msh")),
];

/// A folder with meshes that goes when it is no longer needed.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Result<Folder, String> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let name = format!(
            "signorini-bodies-{}-{}",
            std::process::id(),
            COUNT.fetch_add(1, Ordering::Relaxed)
        );
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
        for (name, text) in REFERENCE {
            let file = folder.join(format!("{name}.msh"));
            std::fs::write(file, text).map_err(|e| e.to_string())?;
        }
        Ok(Folder(folder))
    }

    /// A mesh of one region.
    pub fn put(&self, name: &str, mesh: &Mesh) -> Result<(), String> {
        std::fs::write(self.0.join(format!("{name}.msh")), msh(mesh, |_| 0))
            .map_err(|e| e.to_string())
    }

    /// The path of a mesh, for a scene.
    pub fn file(&self, name: &str) -> String {
        format!("{:?}", self.0.join(format!("{name}.msh")).display().to_string())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // what cannot be removed is left to the system
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
