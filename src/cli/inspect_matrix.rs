//! `signorini inspect block.sti`: what a matrix of another program holds.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde_json::json;

use signorini::contact::phase_modes;
use signorini::fem::formats::{
    DofName, Listed, Written, is_matlab, list_matrices, read_matrix, uneven_nodes,
};
use signorini::fem::motions_without_mass;
use signorini::problem::{Problem, uneven_text};
use signorini::report::summary::significant;
use signorini::scenario::{FileName, Scene, names_beside};

use super::{Answer, CliError, Global};

/// Endings under which programs write matrices.
const ENDINGS: [&str; 9] = ["sti", "mas", "mtx", "matrix", "hb", "rsa", "npz", "pch", "op4"];

/// Whether a file is one, by its name, of MATLAB by its content.
pub(crate) fn is_matrix(path: &Path) -> bool {
    let word = path.to_string_lossy();
    let file = Path::new(FileName::parse(&word).file);
    let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_old = || {
        let mut start = vec![];
        let read = std::fs::File::open(file).and_then(|f| f.take(400).read_to_end(&mut start));
        read.is_ok() && is_matlab(&start)
    };
    ending.is_some_and(|e| ENDINGS.contains(&e.as_str()) || e == "mat" && is_old())
}

/// Names of its rows: its own, or those of a file beside it.
fn names(path: &Path, written: &Written) -> Result<Vec<DofName>, CliError> {
    if !written.names.is_empty() {
        return Ok(written.names.clone());
    }
    names_beside(path).unwrap_or(Ok(vec![])).map_err(CliError::Input)
}

/// Say which matrices it holds.
fn several(path: &Path, (format, all): (&str, &[Listed]), global: &Global) -> Answer {
    let is_square = |m: &&Listed| m.held.as_ref().is_ok_and(|[rows, columns, _]| rows == columns);
    global.answer(
        || {
            let object = |m: &Listed| match &m.held {
                Ok([rows, columns, entries]) => {
                    json!({"name": m.name, "shape": [rows, columns], "entries": entries})
                }
                Err(why) => json!({"name": m.name, "not_read": why}),
            };
            json!({"format": format, "matrices": all.iter().map(object).collect::<Vec<_>>()})
        },
        || {
            let mut out = format!("  {:<12}{format}\n", "format");
            for m in all {
                let about = match &m.held {
                    Ok([rows, columns, entries]) => {
                        format!("{:<14}{entries} entries", format!("{rows} × {columns}"))
                    }
                    Err(why) => why.clone(),
                };
                let _ = writeln!(out, "  {:<12}{about}", m.name);
            }
            if let Some(first) = all.iter().find(is_square) {
                let word = format!("{}:/{}", path.display(), first.name);
                let _ =
                    writeln!(out, "  {:<12}signorini inspect {word}; in a scene {word}", "next");
            }
            out
        },
    )
}

/// The stiffness and the mass that one program writes under one name: one of them is the file.
fn partner(path: &Path) -> Option<[PathBuf; 2]> {
    let name = path.file_name()?.to_str()?;
    let pairs = [(".sti", ".mas"), ("_STIF", "_MASS"), ("_K.", "_M."), ("STIFF.", "MASS.")];
    let found = pairs.iter().find_map(|(stiffness, mass)| match name {
        name if name.contains(stiffness) => {
            Some([path.to_owned(), path.with_file_name(name.replacen(stiffness, mass, 1))])
        }
        name if name.contains(mass) => {
            Some([path.with_file_name(name.replacen(mass, stiffness, 1)), path.to_owned()])
        }
        _ => None,
    });
    found.filter(|pair| pair.iter().all(|file| file.is_file()))
}

/// More rows than these are left to `modes`.
const MOST_ROWS: usize = 200_000;

/// The first circular frequencies of two matrices, rigid motions (0) first; what has no mass follows statically.
fn first_frequencies([stiffness, mass]: &[PathBuf; 2], rows: usize) -> Result<Vec<f64>, String> {
    if rows > MOST_ROWS {
        return Err(format!("{rows} rows; signorini modes SCENE computes them"));
    }
    let absolute = |p: &PathBuf| {
        let p = p.canonicalize().unwrap_or_else(|_| p.clone());
        toml::Value::String(p.display().to_string()).to_string()
    };
    let text = format!(
        "[body]\nkind = \"matrices\"\nstiffness_matrix = {}\nmass_matrix = {}\n",
        absolute(stiffness),
        absolute(mass)
    );
    let scene = Scene::parse(&text, Path::new("matrices")).map_err(|e| e.to_string())?;
    let system = Problem::new(&scene, None).map_err(|e| e.to_string())?.system;
    let modes = phase_modes(&system, &system.open_phase(), 3).map_err(|e| e.to_string())?;
    Ok(modes.omega)
}

/// Say what it holds.
pub fn run(path: &Path, global: &Global) -> Result<Answer, CliError> {
    let input = |why: String| CliError::Input(format!("{}: {why}", path.display()));
    let word = path.to_string_lossy();
    let FileName { file, dataset } = FileName::parse(&word);
    let bytes = std::fs::read(file).map_err(|e| input(e.to_string()))?;
    if dataset.is_none()
        && let Some((format, all)) = list_matrices(&bytes).map_err(input)?
        && all.len() > 1
    {
        return Ok(several(path, (format, &all), global));
    }
    let written = read_matrix(&bytes, dataset).map_err(input)?;
    let names = names(Path::new(file), &written)?;
    let a = &written.matrix;
    let n = a.n_rows();
    if !names.is_empty() && names.len() != n {
        return Err(input(format!("{n} rows and {} names", names.len())));
    }
    // of a mass matrix: the mass that moves in each direction
    let along = |d: u8| -> f64 {
        let is_so: Vec<bool> = names.iter().map(|name| name.direction == d).collect();
        a.triplets().filter(|e| is_so[e.0] && is_so[e.1]).map(|e| e.2).sum()
    };
    let directions: Vec<u8> = (0..=6).filter(|d| names.iter().any(|n| n.direction == *d)).collect();
    let sums: Vec<f64> = directions.iter().map(|d| along(*d)).collect();
    let empty = (0..n).filter(|&i| a.row(i).all(|e| e.1 == 0.0)).count();
    // of a stiffness they are the rigid motions of what is not held
    let without = motions_without_mass(a).map(|all| all.len()).unwrap_or(0);
    let trace: f64 = a.triplets().filter(|e| e.0 == e.1).map(|e| e.2).sum();
    let other = partner(Path::new(file));
    // of a mass: what a constraint left behind
    let diagonal: Vec<f64> = (0..n).map(|i| a.entry(i, i).copied().unwrap_or(0.0)).collect();
    let uneven = uneven_nodes(&names, &diagonal);
    let frequencies = other.as_ref().map(|pair| first_frequencies(pair, n));
    let words = |all: &[DofName]| all.iter().map(DofName::to_string).collect::<Vec<_>>();
    Ok(global.answer(
        || {
            json!({
                "format": written.format, "rows": n, "entries": written.entries, "one_triangle": written.one_triangle,
                "empty_rows": empty, "null_motions": without, "trace": trace, "names": words(&names), "held": words(&written.held),
                "directions": directions, "sums": sums, "uneven": uneven.iter().map(|u| &u.node).collect::<Vec<_>>(),
                "first_omega": frequencies.as_ref().and_then(|f| f.as_ref().ok()),
            })
        },
        || {
            let mut out = String::new();
            let mut line = |label: &str, text: String| {
                let _ = writeln!(out, "  {label:<12}{text}");
            };
            line("format", written.format.into());
            let triangle = if written.one_triangle { ", one triangle, which is mirrored" } else { "" };
            line("rows", format!("{n}, {} entries{triangle}", written.entries));
            line("trace", significant(trace, 10));
            if empty > 0 {
                line("", format!("{empty} rows are empty: of a mass, motions that follow statically"));
            }
            if without > 0 {
                line("", format!("{without} motions of several rows come to nothing: of a mass, they follow statically; of a stiffness, the body moves so freely"));
            }
            match (names.first(), names.last()) {
                (Some(first), Some(last)) => {
                    line("names", format!("{first} to {last}, for displacements = [\"{first}\"]"));
                    for (d, sum) in directions.iter().zip(&sums) {
                        let text = format!("direction {d}: {} (if it is a mass: that which moves so)", significant(*sum, 7));
                        line("sum", text);
                    }
                }
                _ => line("names", "none: rows count from 0, or are listed by [body] names = \"rows.csv\"".into()),
            }
            if !uneven.is_empty() {
                line("WARNING", uneven_text(&uneven));
            }
            match (&frequencies, &other) {
                (Some(Ok(omega)), Some([_, mass])) => {
                    let hertz = |w: &f64| significant(w / std::f64::consts::TAU, 7);
                    let all: Vec<String> = omega.iter().map(hertz).collect();
                    let beside = mass.file_name().unwrap_or_default().to_string_lossy();
                    line("frequencies", format!("{} cycles per unit of time, with {beside}", all.join(", ")));
                }
                (Some(Err(why)), _) => line("frequencies", format!("none: {why}")),
                _ => {}
            }
            if !written.held.is_empty() {
                line("held", format!("{}: no rows", words(&written.held).join(", ")));
            }
            line("next", "[body] kind = \"matrices\", stiffness_matrix = \"…\", mass_matrix = \"…\"".into());
            out
        },
    ))
}
