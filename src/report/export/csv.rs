//! CSV: energies, contact and forces, one row a stored state; switches in a second file.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use super::Followed;
use super::put::{number, put, quoted};
use crate::event::label;
use crate::store::{About, Raw, StoreError, Stored, read_raw, switch_columns};

/// The states `rows` and the switches `switches`, into the two files.
pub(super) fn write(
    stored: &Stored,
    rows: &[usize],
    switches: &[usize],
    points: &[Followed],
    files: &[PathBuf],
) -> io::Result<()> {
    let texts = [states(stored, rows, points), events(stored, switches)?];
    files.iter().zip(texts).try_for_each(|(path, text)| put(path, text.as_bytes()))
}

/// How many components the displacements of the nodes have.
fn components(stored: &Stored) -> usize {
    let moves = |c: &usize| stored.dof_map.column(*c).iter().any(|i| *i >= 0);
    (0..stored.dof_map.ncols()).rev().find(moves).map_or(1, |c| c + 1)
}

fn states(stored: &Stored, rows: &[usize], points: &[Followed]) -> String {
    let mut out = String::from("t");
    for name in Stored::energy_names() {
        let _ = write!(out, ",{name}");
    }
    // what friction did in all, and at each point along its tangent
    let (mut books, mut along) = (vec![], vec![]);
    if let Some(rubbed) = &stored.rubbed {
        books = vec![("friction", &rubbed.taken), ("belt", &rubbed.belt)];
        along = vec![("traction", &rubbed.traction)];
        along.extend(rubbed.slide.as_ref().map(|slide| ("slide", slide)));
    }
    for (name, _) in &books {
        let _ = write!(out, ",{name}");
    }
    for i in 0..stored.gap.len() {
        let point = stored.contact_name(i);
        for column in ["u_n", "pressure", "active"].iter().chain(along.iter().map(|of| &of.0)) {
            let _ = write!(out, ",{}", quoted(&format!("{column}[{point}]")));
        }
    }
    // of rows nobody knows along what they are
    let in_rows = stored.is_of_matrices();
    for of in &stored.forces {
        let kind = if of.kind == "contact" { "force" } else { of.kind };
        for (k, name) in (0..of.values.ncols()).map(|k| (k, &of.names[k / of.components()])) {
            let axis = ["x", "y", "z"][k % of.components()];
            let axis = (of.kind != "spring" && !in_rows).then_some(axis);
            let _ = write!(out, ",{}", quoted(&label(kind, axis, name)));
        }
    }
    for of in &stored.probes {
        for component in &of.components {
            let column = label(of.quantity.name(), Some(component), &of.name);
            let _ = write!(out, ",{}", quoted(&column));
        }
    }
    // names of rows have their direction
    let axes: &[Option<&str>] = match stored.has_row_names() {
        true => &[None],
        false => &[Some("x"), Some("y"), Some("z")][..components(stored).min(3)],
    };
    for point in points {
        for of in ["u", "v"] {
            axes.iter().for_each(|axis| {
                let _ = write!(out, ",{}", quoted(&label(of, *axis, &point.name)));
            });
        }
    }
    out.push('\n');
    for &row in rows {
        out.push_str(&number(stored.t[row]));
        for column in stored.energy.iter().chain(books.iter().map(|of| of.1)) {
            // not known where the run followed the surroundings of the contact alone
            let known = Some(column[row]).filter(|e| !e.is_nan()).map(number);
            let _ = write!(out, ",{}", known.unwrap_or_default());
        }
        for i in 0..stored.gap.len() {
            let (u, p) = (stored.contact_displacement(row, i), stored.pressure[(row, i)]);
            let _ = write!(out, ",{},{},{}", number(u), number(p), stored.active[(row, i)]);
            for (_, of) in &along {
                let _ = write!(out, ",{}", number(of[(row, i)]));
            }
        }
        let of_forces = stored.forces.iter().flat_map(|of| of.values.row(row));
        for force in of_forces.chain(stored.probes.iter().flat_map(|of| of.values.row(row))) {
            // a scheme may know no accelerations, and not what supports bear
            let known = Some(*force).filter(|f| !f.is_nan()).map(number);
            let _ = write!(out, ",{}", known.unwrap_or_default());
        }
        for point in points {
            for of in stored.motion_at(row, &point.weights) {
                of.iter().take(axes.len()).for_each(|x| {
                    let _ = write!(out, ",{}", number(*x));
                });
            }
        }
        out.push('\n');
    }
    out
}

fn events(stored: &Stored, switches: &[usize]) -> io::Result<String> {
    let read = |about: &About| Ok((about.place().1, read_raw(&stored.path, about.path)?));
    let columns: Result<Vec<_>, StoreError> = switch_columns().map(read).collect();
    let columns = columns.map_err(io::Error::other)?;
    let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
    // as it is called in the table of states
    let mut out = names.join(",") + ",contact\n";
    let cell = |column: &Raw, k: usize| match column {
        Raw::Float(x) => x.get(&[k][..]).map(|x| number(*x)),
        Raw::Integer(x) => x.get(&[k][..]).map(i64::to_string),
        Raw::Words(words) => words.get(k).map(|word| quoted(word)),
        Raw::Byte(_) | Raw::Flag(_) => None,
    };
    for &k in switches {
        let mut cells: Vec<_> = columns.iter().map(|c| cell(&c.1, k).unwrap_or_default()).collect();
        let point = stored.switch_point.get(k).filter(|i| **i < stored.gap.len());
        cells.push(point.map(|i| quoted(&stored.contact_name(*i))).unwrap_or_default());
        out += &(cells.join(",") + "\n");
    }
    Ok(out)
}
