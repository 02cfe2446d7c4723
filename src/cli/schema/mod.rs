//! `signorini schema`: the keys of scenes and studies and the datasets of files, for editors and as pages.

mod files;
mod page;

use clap::{Args, ValueEnum};

use signorini::scenario::Scene;
use signorini::store::datasets;
use signorini::study::Study;

use super::Answer;

/// Arguments of `schema`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini schema > scene.schema.json\n\nWith the first line `#:schema scene.schema.json` in a scene, editors that know TOML schemas (VS Code\nwith Even Better TOML, Helix, Neovim and Emacs with Taplo) complete its keys and check it."
)]
pub struct Arguments {
    /// Of what
    #[arg(value_enum, default_value = "scene")]
    of: Kind,
    /// As Markdown: lists of the keys or datasets
    #[arg(long)]
    markdown: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// A scene
    Scene,
    /// A study
    Study,
    /// The datasets of files
    Files,
}

/// Print a schema.
pub fn run(arguments: &Arguments) -> Answer {
    let (schema, title) = match arguments.of {
        Kind::Scene => (Scene::schema(), "Keys of a scene"),
        Kind::Study => (Study::schema(), "Keys of a study"),
        Kind::Files => return Answer::text(files::of(&datasets(), arguments.markdown)),
    };
    Answer::text(match arguments.markdown {
        true => page::of(&schema, title),
        false => format!("{schema:#}\n"),
    })
}
