//! `signorini view`

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::json;

use signorini::families::motions::{Motions, NoMotion};
use signorini::problem::materials;
use signorini::report::figure::Style;
use signorini::report::page::{self, View, Words};
use signorini::scenario::Scene;
use signorini::store::{
    Content, Outputs, Stored, StoredFamily, content, read_stored_orbit, replace,
};

use super::progress::Bar;
use super::{Answer, CliError, Global, load, one_picture};

/// Arguments of `view`.
#[derive(Debug, Args)]
#[command(
    after_help = "The page needs no network and no other file: it can be sent to others, and be part of a paper's supplement.\n\nExample:\n  signorini view plate.h5\n  signorini view backbone.h5 hbm.h5 viscous.h5 -o compared.html\n  signorini view orbit.h5 --no-open\n  signorini view plate.h5 --title 'Plate 2' --text 'After the second test.'"
)]
pub struct Arguments {
    /// Files of this program; several families are shown in one diagram
    #[arg(required = true, value_name = "FILE.h5")]
    files: Vec<PathBuf>,
    /// Where to write the page [default: the file's name with .html; for several files overlay.html]
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,
    /// Title of the page, in place of those of the files
    #[arg(long)]
    title: Option<String>,
    /// A text of your own below it; paragraphs stand apart by an empty line
    #[arg(long)]
    text: Option<String>,
    /// Write the page, and do not show it
    #[arg(long)]
    no_open: bool,
}

/// Write the page and show it.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let Arguments { title, text, .. } = arguments;
    let words = Words { title: title.clone(), text: text.clone() };
    let path = write(global, &arguments.files, arguments.output.clone(), &words)?;
    let shown = !arguments.no_open && !global.json && global.caller.desk.is_none() && show(&path);
    let name = path.display().to_string();
    Ok(global.answer(
        || json!({"written": [name]}),
        || match shown {
            true => format!("{name} (shown in the browser)\n"),
            false => format!("{name}: open it in a browser\n"),
        },
    ))
}

/// Write the page of some files; where it is.
pub(super) fn write(
    global: &Global,
    files: &[PathBuf],
    output: Option<PathBuf>,
    words: &Words,
) -> Result<PathBuf, CliError> {
    // what cannot be read is said first
    files.iter().try_for_each(|file| content(file).map(drop))?;
    let path = output.unwrap_or_else(|| match files {
        [file] => file.with_extension("html"),
        _ => PathBuf::from("overlay.html"),
    });
    let outputs = Outputs::new(false).reads_all(files.iter().cloned());
    outputs.check_derived(&path)?;
    let views: Result<Vec<View>, CliError> =
        files.iter().map(|file| of_file(global, file, files.len())).collect();
    replace(&path, page::html(&views?, words).as_bytes())?;
    Ok(path)
}

fn of_file(global: &Global, file: &Path, files: usize) -> Result<View, CliError> {
    let kind = content(file)?;
    if let Some((title, sheet)) = one_picture::picture(kind, file)? {
        return Ok(View::picture(&name(file), &title, &sheet.svg(&Style::default())?));
    }
    Ok(match kind {
        Content::Study => {
            let text = "is of a study; give the files of its tasks (NAME.study/tasks/…/result.h5)";
            return Err(CliError::Input(format!("{} {text}", file.display())));
        }
        Content::Family => of_family(global, file, files)?,
        // all others are of one picture
        _ => {
            let stored = Stored::read(file)?;
            let scene = load::stored(file, &stored.scene);
            let of_bodies = scene.as_ref().map(materials).unwrap_or_default();
            View::run(stored.whole()?, &of_bodies, read_stored_orbit(file)?.as_ref())
        }
    })
}

fn name(file: &Path) -> String {
    file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// States of an orbit, at least and at most.
const STATES: (usize, usize) = (20, 96);
/// Bytes of all orbits of the families of a page.
const BYTES: usize = 9_500_000;

/// A family with the motions of its points.
fn of_family(global: &Global, file: &Path, files: usize) -> Result<View, CliError> {
    let family = StoredFamily::read(file)?;
    let rest = Stored::body(file)?;
    let Some(scene) = load::stored(file, &family.scene) else {
        let why =
            "the scene that made it cannot be read by this version: its orbits cannot be played";
        return Ok(View::family(&family, &rest, &[], (&[], 1), Some(why)));
    };
    let playable = family.points.iter().filter(|p| p.orbit.is_some() || p.series.is_some()).count();
    let per_state = 4 * rest.nodes.nrows() + 5 * rest.gap.len();
    let states = BYTES / files / (per_state * playable).max(1);
    // where not even few states of each fit, some points are not played
    let every = STATES.0.div_ceil(states.max(1)).max(1);
    let states = states.clamp(STATES.0, STATES.1);
    let (mut motions, mut why) = (vec![], None);
    if every > 1 {
        why = Some(format!(
            "one orbit in {every} plays: with all of them the page would be too large"
        ));
    }
    let bar = Bar::new(global, &scene);
    let set_up = |scene: &Scene| load::of_scene(scene).map_err(|e| e.text());
    let count = family.points.len();
    let mut all = Motions::new(family, rest, &scene, &set_up);
    for k in 0..count {
        if k % every != 0 {
            motions.push(None);
            continue;
        }
        match all.of(k, states) {
            Ok(motion) => motions.push(motion),
            Err(NoMotion::Point(_)) => motions.push(None),
            Err(NoMotion::Body(text)) => {
                let text = format!("its orbits cannot be played: {text}");
                global.caller.warn(&format!("{}: {text}", file.display()));
                why = Some(text);
                break;
            }
        }
        if let Some(bar) = &bar {
            bar.set((k + 1) as f64 / count as f64, format!("{} of {count} orbits", k + 1));
        }
    }
    if let Some(bar) = &bar {
        bar.clear();
    }
    Ok(View::family(
        all.family(),
        all.rest(),
        &materials(&scene),
        (&motions, states),
        why.as_deref(),
    ))
}

/// Show a page in the browser of this machine, if there is one to look at.
fn show(path: &Path) -> bool {
    let there = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    let (program, words): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ if there("DISPLAY") || there("WAYLAND_DISPLAY") => ("xdg-open", &[]),
        _ => return false,
    };
    let mut command = Command::new(program);
    command.args(words).arg(path).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().is_ok()
}
