//! `signorini inspect FILE.msh`: what is in a mesh of Gmsh, in a deck of Abaqus or CalculiX, in bulk data of Nastran, or in a file of VTK.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use serde_json::{Value, json};

use signorini::mesh::gmsh::{File, Imported, Sides};
use signorini::mesh::slender::stiff_in_bending;
use signorini::mesh::{Mesh, corner};
use signorini::problem::read_mesh_file;
use signorini::report::summary::significant;

use super::{Answer, CliError, Global};

/// Whether a file is a mesh, by its name or its first word.
pub(crate) fn is_mesh(path: &Path) -> bool {
    let ends = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let named = ["msh", "inp", "bdf", "nas", "vtu"].into_iter().any(ends);
    let mut head = [0; 11];
    let read = std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut head));
    named || (read.is_ok() && &head == b"$MeshFormat")
}

/// Say what a mesh holds.
pub fn run(path: &Path, global: &Global) -> Result<Answer, CliError> {
    let refuse = |e: &dyn std::fmt::Display| CliError::Input(format!("{}: {e}", path.display()));
    let file = read_mesh_file(path).map_err(|(message, help)| match help {
        Some(help) => refuse(&format!("{message}; {help}")),
        None => refuse(&message),
    })?;
    // what cannot be a body is told all the same, with the reason
    let body = file.body(1.0, &[]);
    let (found, why) = match &body {
        Ok(found) => (Some(found), None),
        Err(e) => (None, Some(e.to_string())),
    };
    Ok(global.answer(
        || as_json(&file, found, why.as_deref()),
        || as_text(path, &file, found, why.as_deref()),
    ))
}

/// Least and mean quality of the cells.
fn quality(mesh: &Mesh) -> (f64, f64) {
    let all: Vec<f64> =
        mesh.elements().map(|e| corner::quality(e.kind, &mesh.corners(e))).collect();
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    (least, all.iter().sum::<f64>() / all.len() as f64)
}

/// Pairs of nodes at one place.
fn coincident(mesh: &Mesh) -> usize {
    let mut nodes: Vec<[f64; 3]> = mesh.nodes().to_vec();
    let along = |a: &[f64; 3], b: &[f64; 3]| {
        let of = |c: usize| a[c].total_cmp(&b[c]);
        of(0).then(of(1)).then(of(2))
    };
    nodes.sort_by(along);
    let near = 1e-9 * mesh.length();
    let same = |p: &&[[f64; 3]]| (0..3).all(|c| (p[0][c] - p[1][c]).abs() <= near);
    nodes.windows(2).filter(same).count()
}

/// What a group of lines, or of faces, is good for.
fn use_of(unit: &str, sides: Option<&Sides>) -> String {
    match sides {
        Some(Sides::Boundary(facets)) => {
            let n = facets.len();
            format!("{unit}, {n} of them sides of the boundary: for supports, loads, contact")
        }
        Some(Sides::Elsewhere { owners: 0, nodes }) => {
            format!("{unit}, no side of the body at nodes {nodes:?}: of no use here")
        }
        Some(Sides::Elsewhere { nodes, .. }) => {
            format!("{unit} inside the body, for example at nodes {nodes:?}: of no use here")
        }
        None => format!("no {unit}: of no use here"),
    }
}

fn as_text(path: &Path, file: &File, body: Option<&Imported>, why: Option<&str>) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: String| {
        let _ = writeln!(out, "  {label:<12}{text}");
    };
    let format = match file.version.as_str() {
        "deck" => "deck of Abaqus or CalculiX".to_owned(),
        "VTK" => "unstructured grid of VTK".to_owned(),
        "bulk data" => "bulk data of Nastran".to_owned(),
        version => format!("Gmsh {version} ASCII"),
    };
    line("file", format!("{}, {format}", path.display()));
    let types: Vec<String> =
        file.types().into_iter().map(|(t, n)| format!("{n} × {}", t.name)).collect();
    line("elements", types.join(", "));
    if let Some(body) = body {
        let size = body.mesh.size();
        let size: Vec<String> =
            size[..body.mesh.dim()].iter().map(|x| significant(*x, 6)).collect();
        line(
            "body",
            format!(
                "{} nodes, {} cells, {} (units? coordinates are multiplied by scale)",
                body.mesh.n_nodes(),
                body.mesh.n_elements(),
                size.join(" × ")
            ),
        );
        let (least, mean) = quality(&body.mesh);
        line(
            "quality",
            format!(
                "{} at the worst cell, {} on the average (least sine of a corner, or volume of its unit edges, over that of the regular cell; 1 is best)",
                significant(least, 3),
                significant(mean, 3)
            ),
        );
        let twice = coincident(&body.mesh);
        if twice > 0 {
            let text = format!(
                "{twice} pairs at the same place are not joined: a crack, or parts that are (Coherence Mesh joins them)"
            );
            line("nodes", text);
        }
        if body.unused > 0 {
            line("unused", format!("{} nodes that no cell has", body.unused));
        }
        let bare: usize = bare_cells(body);
        if bare > 0 {
            line(
                "warning",
                format!("{bare} cells are in no physical group: they have no material"),
            );
        }
        if let Some(stiff) = stiff_in_bending(&body.mesh) {
            line("warning", stiff.to_string());
        }
    }
    for (dim, tag, name, count) in file.groups() {
        let of = match body.map(|b| (b, b.mesh.dim())) {
            _ if dim == file.dim() => "cells: for materials".to_owned(),
            Some((body, 2)) if dim == 1 => use_of("lines", body.sides.get(&name)),
            Some((body, 3)) if dim == 2 => use_of("faces", body.sides.get(&name)),
            _ => "elements".into(),
        };
        let dim = ["points", "lines", "surface", "volume"].get(dim).copied().unwrap_or("?");
        line("group", format!("\"{name}\" ({dim}, #{tag}): {count} {of}"));
    }
    if let Some(why) = why {
        line("no body", why.to_owned());
    }
    out
}

/// Cells that are in no physical group.
fn bare_cells(body: &Imported) -> usize {
    let is_bare = |region: usize| body.regions[region].is_empty();
    body.mesh.elements().filter(|e| is_bare(e.region)).count()
}

fn as_json(file: &File, body: Option<&Imported>, why: Option<&str>) -> Value {
    let types: Vec<Value> =
        file.types().into_iter().map(|(t, n)| json!({"type": t.name, "count": n})).collect();
    let groups: Vec<Value> = file
        .groups()
        .into_iter()
        .map(|(dim, tag, name, count)| {
            let sides = body.and_then(|b| b.sides.get(&name)).filter(|_| dim + 1 == file.dim());
            let boundary = sides.map(|s| matches!(s, Sides::Boundary(_)));
            json!({"name": name, "dim": dim, "tag": tag, "elements": count, "on_boundary": boundary})
        })
        .collect();
    let mut all = json!({"format": file.version, "nodes": file.nodes.len(), "elements": types, "groups": groups, "error": why});
    if let Some(body) = body {
        let (least, mean) = quality(&body.mesh);
        all["body"] = json!({
            "nodes": body.mesh.n_nodes(), "cells": body.mesh.n_elements(), "size": body.mesh.size(), "unused_nodes": body.unused,
            "quality": {"least": least, "mean": mean}, "cells_without_group": bare_cells(body),
            "warning": stiff_in_bending(&body.mesh).map(|s| s.to_string()),
        });
    }
    all
}
