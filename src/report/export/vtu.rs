//! VTU: one file a state in a folder of their own, and the collection (PVD) that gives them their times.
//!
//! Numbers are the bytes of the stored ones (base64, behind their count), so nothing is rounded and NaN needs no spelling. Each
//! file holds its time as `TimeValue` besides.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::fields::{Cell, Centre, Field, Fields, Values};
use super::put::{at, escape, number, put};
use crate::store::MARK;

/// What stands before everything else; leftovers are known by it.
const HEAD: &str = "<?xml version=\"1.0\"?>\n";

fn folder(stem: &Path) -> PathBuf {
    super::named(stem, "-vtu")
}

/// Stem of the names inside the folder.
fn name(stem: &Path) -> String {
    stem.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The collection and the states.
pub(super) fn targets(stem: &Path, states: usize) -> Vec<PathBuf> {
    let (folder, name) = (folder(stem), name(stem));
    let collection = folder.join(format!("{name}.pvd"));
    let state = |k: usize| folder.join(format!("{name}-{k:06}.vtu"));
    std::iter::once(collection).chain((0..states).map(state)).collect()
}

/// States of an earlier export of this name that do not belong to a set of `states`: their names have the form, and the
/// program's mark is in them. Anything else in the folder is the user's.
pub(super) fn leftovers(stem: &Path, states: usize) -> Vec<PathBuf> {
    let mine: HashSet<PathBuf> = targets(stem, states).into_iter().collect();
    let prefix = format!("{}-", name(stem));
    let is_state = |path: &Path| {
        let file = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
        let digits = file.strip_prefix(&prefix).and_then(|f| f.strip_suffix(".vtu"));
        digits.is_some_and(|d| d.len() >= 6 && d.bytes().all(|b| b.is_ascii_digit()))
    };
    let entries = fs::read_dir(folder(stem)).into_iter().flatten().flatten();
    let mut found: Vec<_> = entries
        .map(|e| e.path())
        .filter(|p| is_state(p) && !mine.contains(p) && is_marked(p))
        .collect();
    found.sort();
    found
}

fn is_marked(path: &Path) -> bool {
    let wanted = format!("{HEAD}{MARK}");
    let mut head = vec![0; wanted.len()];
    let read = fs::File::open(path).and_then(|mut f| f.read_exact(&mut head));
    read.is_ok() && head == wanted.as_bytes()
}

/// Write the states and then the collection, `files[0]`, so that it never names a file that is not there.
pub(super) fn write(fields: &Fields, rows: &[usize], files: &[PathBuf]) -> io::Result<()> {
    let Some((collection, states)) = files.split_first() else { return Ok(()) };
    if let Some(folder) = collection.parent().filter(|f| !f.is_dir()) {
        fs::create_dir(folder).map_err(|e| at(folder, &e))?;
    }
    let mesh = mesh(fields);
    let mut list =
        format!("{HEAD}{MARK}\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n");
    for (path, &row) in states.iter().zip(rows) {
        put(path, state(fields, row, &mesh).as_bytes())?;
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let time = number(fields.stored.t[row]);
        let _ =
            writeln!(list, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>", escape(&file));
    }
    list.push_str("</Collection>\n</VTKFile>\n");
    put(collection, list.as_bytes())
}

/// Points and cells, which are those of every state.
fn mesh(fields: &Fields) -> String {
    let cells = fields.cells();
    let connectivity = cells.iter().flat_map(Cell::ordered);
    let offsets = cells.iter().scan(0, |sum, c| {
        *sum += c.nodes.len() as i64;
        Some(*sum)
    });
    format!(
        "<Points>\n{}</Points>\n<Cells>\n{}{}{}</Cells>\n",
        array("Float64", "Points", 3, bytes(fields.points(), f64::to_le_bytes)),
        array("Int64", "connectivity", 1, bytes(connectivity, i64::to_le_bytes)),
        array("Int64", "offsets", 1, bytes(offsets, i64::to_le_bytes)),
        array("UInt8", "types", 1, cells.iter().map(|c| c.kind.vtk()).collect()),
    )
}

fn state(fields: &Fields, row: usize, mesh: &str) -> String {
    let (points, cells) = (fields.n_nodes(), fields.cells().len());
    let all = fields.at(row);
    let data =
        |place: Centre| all.iter().filter(|f| f.place == place).map(field).collect::<String>();
    format!(
        "{HEAD}{MARK}\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <UnstructuredGrid>\n<FieldData>\n\
         <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n</FieldData>\n\
         <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n\
         <PointData>\n{}</PointData>\n<CellData>\n{}</CellData>\n{mesh}</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        number(fields.stored.t[row]),
        data(Centre::Point),
        data(Centre::Cell),
    )
}

fn field(f: &Field) -> String {
    match &f.values {
        Values::Real(v) => {
            array("Float64", f.name, f.components, bytes(v.iter().copied(), f64::to_le_bytes))
        }
        Values::Whole(v) => {
            array("Int32", f.name, f.components, bytes(v.iter().copied(), i32::to_le_bytes))
        }
    }
}

fn bytes<T, const N: usize>(values: impl IntoIterator<Item = T>, of: fn(T) -> [u8; N]) -> Vec<u8> {
    values.into_iter().flat_map(of).collect()
}

/// An array with its values as base64 behind the number of their bytes.
fn array(kind: &str, name: &str, components: usize, values: Vec<u8>) -> String {
    let mut block = (values.len() as u64).to_le_bytes().to_vec();
    block.extend(values);
    let text = base64(&block);
    // meshio takes a scalar with a number of components for a table of one column
    let width = match components {
        1 => String::new(),
        n => format!(" NumberOfComponents=\"{n}\""),
    };
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\"{width} format=\"binary\">{text}</DataArray>\n"
    )
}

/// Three bytes in four letters (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, k| bits << 8 | usize::from(*group.get(k).unwrap_or(&0)));
        for k in 0..4 {
            let letter = LETTERS[bits >> (18 - 6 * k) & 63];
            out.push(if k <= group.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (text, code) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), code);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    /// Only states with the name's form and our mark, outside the new set, are leftovers.
    #[test]
    fn leftovers_are_ours_alone() {
        let place = tempfile::tempdir().unwrap();
        let stem = place.path().join("plate");
        assert!(leftovers(&stem, 3).is_empty());
        let folder = place.path().join("plate-vtu");
        fs::create_dir(&folder).unwrap();
        let ours = format!("{HEAD}{MARK}\n<VTKFile/>");
        for (name, text) in [
            ("plate-000002.vtu", ours.as_str()),
            ("plate-000003.vtu", &ours),
            ("plate-1000000.vtu", &ours),
            ("plate-000004.vtu", "<?xml version=\"1.0\"?>\n<VTKFile/>"),
            ("plate-00005.vtu", &ours),
            ("plate-00000x.vtu", &ours),
            ("other-000003.vtu", &ours),
            ("plate-000005.vtp", &ours),
        ] {
            fs::write(folder.join(name), text).unwrap();
        }
        let found = leftovers(&stem, 3);
        assert_eq!(found, [folder.join("plate-000003.vtu"), folder.join("plate-1000000.vtu")]);
    }
}
