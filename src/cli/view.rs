//! `signorini view`

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::json;

use signorini::families::motions::{Motions, NoMotion};
use signorini::problem::materials;
use signorini::records::{PointKind, PointRecord};
use signorini::report::figure::Style;
use signorini::report::page::{self, Body, View, Words};
use signorini::scenario::Scene;
use signorini::store::{
    Content, Outputs, Stored, StoredFamily, content, read_stored_orbit, replace,
};

use super::progress::Bar;
use super::{Answer, CliError, Global, load, one_picture};

/// Arguments of `view`.
#[derive(Debug, Args)]
#[command(
    after_help = "The page needs no network and no other file: it can be sent to others, and be part of a paper's supplement. Bodies in space are turned by mouse, touch and arrow keys.\n\nExample:\n  signorini view plate.h5\n  signorini view backbone.h5 hbm.h5 viscous.h5 -o compared.html\n  signorini view orbit.h5 --no-open --nodes 3,7\n  signorini view response.h5 --orbits 40\n  signorini view plate.h5 --title 'Plate 2' --text 'After the second test.'"
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
    /// Contact nodes (numbers of mesh nodes, or names of rows of matrices) that have curves [default: up to twelve, those of the largest pressures
    /// first; the page lets its reader choose others]
    #[arg(long, value_delimiter = ',')]
    nodes: Vec<String>,
    /// Of a family: so many orbits play, evenly chosen, half of them special ones at the most [default: as many as fit a page of 14 MB]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    orbits: Option<u32>,
    /// Write the page, and do not show it
    #[arg(long)]
    no_open: bool,
}

/// Write the page and show it.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let Arguments { title, text, nodes, .. } = arguments;
    let words = Words { title: title.clone(), text: text.clone() };
    let orbits = arguments.orbits.map(|n| n as usize);
    let wanted = Wanted { words, nodes: nodes.clone(), orbits };
    let path = write(global, &arguments.files, arguments.output.clone(), &wanted)?;
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

/// What a page is to show.
#[derive(Default)]
pub(super) struct Wanted {
    pub words: Words,
    /// Contact nodes that have curves; none: as the page chooses.
    pub nodes: Vec<String>,
    /// How many orbits of a family play.
    pub orbits: Option<usize>,
}

/// Write the page of some files; where it is.
pub(super) fn write(
    global: &Global,
    files: &[PathBuf],
    output: Option<PathBuf>,
    wanted: &Wanted,
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
        files.iter().map(|file| of_file(global, file, files.len(), wanted)).collect();
    replace(&path, page::html(&views?, &wanted.words).as_bytes())?;
    Ok(path)
}

fn of_file(global: &Global, file: &Path, files: usize, wanted: &Wanted) -> Result<View, CliError> {
    let kind = content(file)?;
    if let Some((title, sheet)) = one_picture::picture(kind, file)? {
        return Ok(View::picture(&name(file), &title, &sheet.svg(&Style::default())?));
    }
    Ok(match kind {
        Content::Study => {
            let text = "is of a study; give the files of its tasks (NAME.study/tasks/…/result.h5)";
            return Err(CliError::Input(format!("{} {text}", file.display())));
        }
        Content::Family => of_family(global, file, files, wanted)?,
        // all others are of one picture
        _ => {
            let stored = Stored::read(file)?;
            let scene = load::stored(file, &stored.scene);
            let of_bodies = scene.as_ref().map(materials).unwrap_or_default();
            let nodes = contact_nodes(&wanted.nodes, &stored)?;
            let body = Body::of(stored.whole()?, &of_bodies);
            View::run(&stored, body, read_stored_orbit(file)?.as_ref(), &nodes)
        }
    })
}

/// Most numbers of nodes that a message tells.
const TOLD: usize = 40;

/// The contact nodes that are asked for, by their numbers or the names of their rows.
pub(super) fn contact_nodes(wanted: &[String], stored: &Stored) -> Result<Vec<usize>, CliError> {
    let there = &stored.contact_nodes;
    let of_word = |word: &String| {
        let node = stored.node_called(word).ok().filter(|n| there.contains(n));
        node.ok_or_else(|| {
            let told = there[..there.len().min(TOLD)].iter().map(|n| stored.node_name(*n));
            let told: Vec<String> = told.collect();
            let more = match there.len() - told.len() {
                0 => String::new(),
                n => format!(" and {n} more"),
            };
            let text = format!("not a contact node; these are {}{more}", told.join(", "));
            CliError::Input(format!("--nodes {word}: {text}"))
        })
    };
    wanted.iter().map(of_word).collect()
}

fn name(file: &Path) -> String {
    file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// States of an orbit, at least and at most.
const STATES: (usize, usize) = (20, 96);
/// Bytes of all orbits of the families of a page.
const BYTES: usize = 9_500_000;

/// A family with the motions of its points.
fn of_family(
    global: &Global,
    file: &Path,
    files: usize,
    wanted: &Wanted,
) -> Result<View, CliError> {
    let family = StoredFamily::read(file)?;
    let rest = Stored::body(file)?;
    let nodes = contact_nodes(&wanted.nodes, &rest)?;
    let Some(scene) = load::stored(file, &family.scene) else {
        let why =
            "the scene that made it cannot be read by this version: its orbits cannot be played";
        let body = Body::of(&rest, &[]);
        return Ok(View::family(&family, body, (&[], 1), &nodes, Some(why)));
    };
    let body = Body::of(&rest, &materials(&scene));
    let has_motion = |p: &PointRecord| p.orbit.is_some() || p.series.is_some();
    let all = family.points.iter().filter(|p| has_motion(p)).count();
    // so many fit with few states each; the rest is not played
    let room = BYTES / files / body.state.max(1);
    let count = wanted.orbits.unwrap_or(room / STATES.0).clamp(1, all.max(1));
    let states = (room / count).clamp(STATES.0, STATES.1);
    let plays = chosen(
        &family.points.iter().map(|p| (has_motion(p), is_special(p))).collect::<Vec<_>>(),
        count,
    );
    let (mut motions, mut why) = (vec![], None);
    if count < all {
        let size = match wanted.orbits {
            Some(_) => "",
            None => ": with all of them the page would be too large",
        };
        why = Some(format!("{count} of {all} orbits play{size}"));
    }
    let bar = Bar::new(global, &scene);
    let set_up = |scene: &Scene| load::of_scene(scene).map_err(|e| e.text());
    let count = family.points.len();
    let mut all = Motions::new(family, rest, &scene, &set_up);
    for (k, plays) in plays.into_iter().enumerate() {
        if !plays {
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
    Ok(View::family(all.family(), body, (&motions, states), &nodes, why.as_deref()))
}

fn is_special(p: &PointRecord) -> bool {
    p.special != PointKind::Regular
}

/// Which points play: so many of those that have a motion, at most half of them special ones, evenly chosen.
fn chosen(points: &[(bool, bool)], count: usize) -> Vec<bool> {
    let evenly = |from: &[usize], count: usize| -> Vec<usize> {
        let count = count.min(from.len());
        let last = from.len().saturating_sub(1);
        (0..count).map(|k| from[k * last / (count - 1).max(1)]).collect()
    };
    let of = |special: bool| -> Vec<usize> {
        (0..points.len()).filter(|&k| points[k] == (true, special)).collect()
    };
    let (special, regular) = (of(true), of(false));
    let first = evenly(&special, count - regular.len().min(count / 2));
    let rest = evenly(&regular, count - first.len());
    (0..points.len()).map(|k| first.contains(&k) || rest.contains(&k)).collect()
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
