//! `signorini new`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::store::replace;

use super::{Answer, CliError, Global};

/// Arguments of `new`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini new plate\n  signorini new mesh disc && signorini run disc.toml && signorini plot disc.h5"
)]
pub struct Arguments {
    /// What kind of body
    #[arg(value_enum)]
    kind: Kind,
    /// Name of the scene, without ending [default: the kind]
    name: Option<String>,
}

/// Kinds of scenes.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// A bar
    Bar,
    /// A plate in plane stress
    Plate,
    /// A body from a mesh of Gmsh, with a mesh
    Mesh,
    /// A body in space from a mesh, with a mesh
    Space,
    /// A driven and damped plate, for a frequency response
    Response,
    /// Matrices of your own, with matrices
    Matrices,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Bar => "bar",
            Kind::Plate => "plate",
            Kind::Mesh => "mesh",
            Kind::Space => "space",
            Kind::Response => "response",
            Kind::Matrices => "matrices",
        }
    }

    /// The scene, and the files that it names: what stands behind NAME, and their texts.
    fn files(self) -> Vec<(&'static str, &'static str)> {
        match self {
            Kind::Bar => vec![(".toml", include_str!("bar.toml"))],
            Kind::Plate => vec![(".toml", include_str!("plate.toml"))],
            Kind::Mesh => vec![
                (".toml", include_str!("mesh.toml")),
                (".msh", include_str!("../../../scenarios/meshes/half-disc.msh")),
            ],
            Kind::Space => vec![
                (".toml", include_str!("space.toml")),
                (".msh", include_str!("../../../scenarios/meshes/block.msh")),
            ],
            Kind::Response => vec![(".toml", include_str!("response.toml"))],
            Kind::Matrices => vec![
                (".toml", include_str!("matrices.toml")),
                ("-M.mtx", include_str!("../../../scenarios/two-mass-stop-M.mtx")),
                ("-K.mtx", include_str!("../../../scenarios/two-mass-stop-K.mtx")),
            ],
        }
    }
}

/// Write a scene to begin with.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let given = arguments.name.as_deref().unwrap_or(arguments.kind.name());
    let stem = given.strip_suffix(".toml").unwrap_or(given);
    let name = Path::new(stem).file_name().map(|n| n.to_string_lossy().into_owned());
    let name = name.filter(|n| !n.contains(['"', '\\', '\n'])).ok_or_else(|| {
        CliError::Input(format!("{given} is no name of a scene; give one like my-plate"))
    })?;
    let files: Vec<(PathBuf, String)> = arguments
        .kind
        .files()
        .into_iter()
        .map(|(ending, text)| (format!("{stem}{ending}").into(), text.replace("NAME", &name)))
        .collect();
    if let Some((taken, _)) = files.iter().find(|(path, _)| path.exists()) {
        let text =
            format!("{} exists already, and stays as it is; give another name", taken.display());
        return Err(CliError::Input(text));
    }
    for (path, text) in &files {
        replace(path, text.as_bytes())?;
    }
    let written: Vec<String> = files.iter().map(|f| f.0.display().to_string()).collect();
    let command = match arguments.kind {
        Kind::Response => "response",
        _ => "run",
    };
    let next = format!("signorini {command} {}", written[0]);
    Ok(global.answer(
        || json!({"written": written}),
        || format!("written: {}\n  next: {next}\n", written.join(", ")),
    ))
}
