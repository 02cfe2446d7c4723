//! `signorini inspect`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use signorini::store::Stored;

use super::{CliError, Global};

/// Arguments of `inspect`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini inspect plate.h5\n  signorini inspect plate.h5 --scene > again.toml"
)]
pub struct Arguments {
    /// A file written by this program
    file: PathBuf,
    /// Print the scene that made it, and nothing else
    #[arg(long)]
    scene: bool,
}

/// Say what a file holds.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let s = Stored::read(&arguments.file)?;
    if arguments.scene && !global.json {
        print!("{}", s.scene);
        return Ok(());
    }
    let span = [s.t.first().copied(), s.t.last().copied()];
    let closings = s.switch_kind.iter().filter(|k| *k == "close").count();
    global.print(
        || {
            json!({
                "title": s.title, "status": s.status, "version": s.version, "created": s.created,
                "command": s.command, "scene": s.scene, "states": s.t.len(), "t": span,
                "n_dof": s.u.ncols(), "n_contact": s.gap.len(), "nodes": s.nodes.nrows(),
                "elements": s.elements.nrows(), "switches": s.switch_t.len(), "grazings": s.grazings,
            })
        },
        || {
            let mut out = String::new();
            let mut line = |label: &str, text: String| {
                let _ = writeln!(out, "  {label:<12}{text}");
            };
            line("title", s.title.clone());
            line("status", s.status.clone());
            line("made by", format!("signorini {} at {}", s.version, s.created));
            line("command", s.command.clone());
            line(
                "mesh",
                format!("{} nodes, {} elements, {} displacements, {} contact nodes", s.nodes.nrows(), s.elements.nrows(), s.u.ncols(), s.gap.len()),
            );
            if let [Some(a), Some(b)] = span {
                line("trajectory", format!("{} states from t = {a} to {b}", s.t.len()));
            }
            line("switches", format!("{} ({closings} close, {} open)", s.switch_t.len(), s.switch_t.len() - closings));
            line("grazings", s.grazings.to_string());
            line("scene", format!("{} lines (print it with --scene)", s.scene.lines().count()));
            out
        },
    );
    Ok(())
}
