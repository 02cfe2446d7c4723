//! What every command is asked with and answers: options, an object or a text.

use clap::Args;
use serde_json::Value;

use super::caller::Caller;
use crate::scenario::{Scene, SceneError};

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct Global {
    /// Print one JSON object on standard output and nothing else there
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress, no summary
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Number of threads (all cores by default); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Start even what seems too large for this machine's memory or disk, or for a lifetime
    #[arg(long, global = true)]
    pub force_large: bool,
    #[arg(skip)]
    pub(super) caller: Caller,
}

/// What a command has to say.
#[derive(Debug, Clone)]
pub struct Answer {
    pub(super) said: Said,
    /// What the numerics failed at, if they did; the object says it too.
    pub failure: Option<String>,
}

/// In which form.
#[derive(Debug, Clone)]
pub(super) enum Said {
    Object(Value),
    Text(String),
}

impl Answer {
    /// Nothing but a text, in whatever form results are asked for.
    pub(super) fn text(text: String) -> Answer {
        Answer { said: Said::Text(text), failure: None }
    }

    /// What is said is the result, and the numerics failed.
    pub(super) fn failed(self, why: impl Into<String>) -> Answer {
        Answer { failure: Some(why.into()), ..self }
    }

    /// The JSON object of the command.
    pub fn object(self) -> Value {
        match self.said {
            Said::Object(value) => value,
            Said::Text(text) => text.into(),
        }
    }
}

impl Global {
    /// An object in JSON mode and for a program, a text otherwise.
    pub(super) fn answer(
        &self,
        json: impl FnOnce() -> Value,
        text: impl FnOnce() -> String,
    ) -> Answer {
        if self.json || self.caller.desk.is_some() {
            return Answer { said: Said::Object(json()), failure: None };
        }
        if self.quiet {
            return Answer::text(String::new());
        }
        // a terminal obeys control characters, and titles come from files
        let is_text = |c: &char| !c.is_control() || matches!(c, '\n' | '\t');
        Answer::text(text().chars().filter(is_text).collect())
    }

    /// The scene of a command: the caller's, or the file that the arguments name.
    pub(super) fn scene(&self, path: &std::path::Path) -> Result<Scene, SceneError> {
        let mut scene = self.caller.scene.clone().map_or_else(|| Scene::read(path), Ok)?;
        scene.unlimited = self.force_large;
        Ok(scene)
    }
}

/// What a scene is called in a summary. A terminal obeys control characters: they are left out.
pub(super) fn title(scene: &Scene) -> String {
    scene.name().chars().filter(|c| !c.is_control()).collect()
}

/// A number as one writes it: no row of three hundred zeros.
pub(super) fn plain(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e9).contains(&size) => x.to_string(),
        _ => format!("{x:e}"),
    }
}
