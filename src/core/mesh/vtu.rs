//! Meshes of VTK (`.vtu`, an unstructured grid in XML): points, cells, and what data of cells and points say of groups, as the [`File`] that a mesh of Gmsh gives.
//!
//! | in the file | becomes |
//! | --- | --- |
//! | cells of the highest dimension | the body |
//! | whole-numbered data of cells, `material` with the values 1 and 2 | groups `"material 1"`, `"material 2"` of cells, or, of cells of one dimension less, of sides |
//! | data of points that are 0 and 1, `WALL` | a group of the sides of the boundary all of whose nodes have 1 |
//!
//! Numbers stand as text, as base64, or appended (raw or base64), whole or in blocks that zlib compressed.

use std::collections::{BTreeMap, HashSet};
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};

use super::gmsh::{File, GmshError, Type, types};
use super::listed::{Listed, ordered};
use super::{ElementKind, Point};

/// Data of cells with more different values are numbers of something, and no groups.
const MOST_GROUPS: usize = 100;

/// Bytes that arrays of a file of a given size may unfold to: zlib at its best.
const MOST_UNFOLDED: usize = 1100;

/// Whether a file is one of VTK in XML.
pub fn is_vtk(bytes: &[u8]) -> bool {
    find(&bytes[..bytes.len().min(2000)], b"<VTKFile").is_some()
}

fn fault(message: impl Into<String>, help: &str) -> GmshError {
    GmshError { line: 0, section: String::new(), message: message.into(), help: help.into() }
}

/// The file is not what it says.
fn damaged(message: impl Into<String>) -> GmshError {
    fault(message, "write the file anew: it is damaged")
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|w| w == word)
}

/// How the arrays of a file are written.
struct Arrays<'f> {
    big_endian: bool,
    /// Bytes of a number in a header.
    header: usize,
    is_compressed: bool,
    /// What stands behind the underscore, and whether it is base64.
    appended: (&'f [u8], bool),
    /// No array unfolds to more bytes.
    most: usize,
}

/// Read a file.
pub fn read(bytes: &[u8]) -> Result<File, GmshError> {
    // what is appended may be raw, and is no XML
    let tail = find(bytes, b"<AppendedData");
    let xml = &bytes[..tail.unwrap_or(bytes.len())];
    let text = std::str::from_utf8(xml).map_err(|_| damaged("is no text in UTF-8"))?;
    let whole = match tail {
        None => text.to_owned(),
        Some(_) => format!("{text}</VTKFile>"),
    };
    let document = Document::parse(&whole).map_err(|e| damaged(format!("is no XML: {e}")))?;
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if kind != "UnstructuredGrid" {
        let help = match kind.starts_with('P') {
            true => "save it as one .vtu file: ParaView: File, Save Data",
            false => {
                "save it as an unstructured grid: ParaView: filter Append Datasets, then Save Data"
            }
        };
        return Err(fault(format!("is a file of type \"{kind}\", and no UnstructuredGrid"), help));
    }
    let appended = match tail {
        None => (&bytes[..0], false),
        Some(at) => {
            let rest = &bytes[at..];
            let end = find(rest, b">").ok_or_else(|| damaged("ends in a tag"))?;
            let tag = String::from_utf8_lossy(&rest[..end]).into_owned();
            let start = rest[end..].iter().position(|b| *b == b'_');
            let start = end + start.ok_or_else(|| damaged("has no data behind AppendedData"))? + 1;
            (&rest[start..], tag.contains("base64"))
        }
    };
    let is_compressed = match root.attribute("compressor") {
        None => false,
        Some(name) if name.contains("ZLib") => true,
        Some(other) => {
            let help = "save it with zlib or without compression";
            return Err(fault(format!("is compressed by {other}, which is not read"), help));
        }
    };
    let arrays = Arrays {
        big_endian: root.attribute("byte_order") == Some("BigEndian"),
        header: if root.attribute("header_type") == Some("UInt64") { 8 } else { 4 },
        is_compressed,
        appended,
        most: MOST_UNFOLDED.saturating_mul(bytes.len()),
    };
    let pieces: Vec<Node> = root.descendants().filter(|n| n.has_tag_name("Piece")).collect();
    let [piece] = pieces[..] else {
        let message = format!("has {} pieces, and one is read", pieces.len());
        return Err(fault(message, "join them: ParaView: filter Merge Blocks, then Save Data"));
    };
    listed(piece, &arrays).map(Listed::file)
}

/// The parts of a piece.
fn listed(piece: Node, arrays: &Arrays) -> Result<Listed, GmshError> {
    let part = |name: &str| piece.children().find(|n| n.has_tag_name(name));
    let in_part = |name: &str| {
        part(name).into_iter().flat_map(|p| p.children()).filter(|n| n.has_tag_name("DataArray"))
    };
    let points = in_part("Points").next().ok_or_else(|| damaged("has no points"))?;
    let flat = arrays.numbers(points)?;
    if flat.len() % 3 != 0 || flat.iter().any(|x| !x.is_finite()) {
        return Err(damaged("has points that are no places"));
    }
    // VTK counts from 0
    let place = |(k, p): (usize, &[f64])| (k as i64, [p[0], p[1], p[2]]);
    let nodes: Vec<(i64, Point)> = flat.chunks_exact(3).enumerate().map(place).collect();
    let of_cells = |name: &str| {
        let found = in_part("Cells").find(|n| n.attribute("Name") == Some(name));
        let array = found.ok_or_else(|| damaged(format!("has no array \"{name}\" of cells")))?;
        arrays.whole(array, name)
    };
    let (connectivity, offsets, kinds) =
        (of_cells("connectivity")?, of_cells("offsets")?, of_cells("types")?);
    if offsets.len() != kinds.len() {
        return Err(damaged(format!("has {} cells and {} types", offsets.len(), kinds.len())));
    }
    for (key, found) in [("NumberOfPoints", nodes.len()), ("NumberOfCells", kinds.len())] {
        let said = piece.attribute(key).and_then(|n| n.trim().parse::<usize>().ok());
        if let Some(said) = said.filter(|n| *n != found) {
            return Err(damaged(format!("says {key}=\"{said}\", and has {found}")));
        }
    }
    let (mut cells, mut rows, mut begin) = (vec![], vec![], 0);
    for (k, (&end, &kind)) in offsets.iter().zip(&kinds).enumerate() {
        let own = connectivity
            .get(begin..end)
            .ok_or_else(|| damaged(format!("has no nodes for its cell {k}")))?;
        begin = end;
        if let Some(n) = own.iter().find(|n| **n >= nodes.len()) {
            return Err(damaged(format!("has a cell {k} with node {n} of {}", nodes.len())));
        }
        // vertices are no sides of anything
        if matches!(kind, 1 | 2) {
            continue;
        }
        let (of, nodes) = cell(kind, own, k)?;
        cells.push((k as i64 + 1, of, nodes));
        rows.push(k);
    }
    if !cells.iter().any(|c| c.1.dim > 1) {
        return Err(fault("has no cells of a body", "give a file with triangles, tetrahedra, …"));
    }
    let cell_sets = cell_sets(in_part("CellData"), arrays, (kinds.len(), &rows))?;
    let node_sets = node_sets(in_part("PointData"), arrays, nodes.len())?;
    let names: Vec<&String> =
        node_sets.iter().map(|s| &s.0).chain(cell_sets.iter().map(|s| &s.0)).collect();
    if let Some(twice) = names.iter().enumerate().find(|(k, n)| names[..*k].contains(n)) {
        let message = format!("has two groups \"{}\"", twice.1);
        return Err(fault(message, "give data of cells and points names of their own"));
    }
    let version = "VTK".to_owned();
    Ok(Listed { version, nodes, cells, cell_sets, node_sets, surfaces: vec![] })
}

/// The type of a cell and its nodes in this program's order.
fn cell(kind: usize, own: &[usize], k: usize) -> Result<(Type, Vec<usize>), GmshError> {
    let known = ElementKind::ALL.into_iter().find(|e| usize::from(e.vtk()) == kind);
    let of = match (known, kind) {
        (Some(known), _) => types().find(|t| t.number == known.gmsh().0),
        // a line with a node in its middle
        (None, 21) => types().find(|t| t.dim == 1 && t.nodes == 3),
        _ => None,
    };
    let Some(of) = of else {
        let message = format!("has a cell {k} of type {kind} of VTK, which is not read");
        let help = "triangles, quadrilaterals, tetrahedra, hexahedra and wedges are, of first and second order: types 5, 9, 10, 12, 13, 22 to 26, 28, 29, 32";
        return Err(fault(message, help));
    };
    if own.len() != of.nodes {
        let message = format!("has a cell {k}, a {}, with {} nodes", of.name, own.len());
        return Err(damaged(message));
    }
    let distinct: HashSet<&usize> = own.iter().collect();
    if distinct.len() < own.len() {
        let message = format!("has a cell {k} with a node twice: a degenerate {}", of.name);
        return Err(fault(message, "mesh it with wedges or tetrahedra in its place"));
    }
    let nodes = known.map_or_else(|| own.to_vec(), |known| ordered(known, own));
    Ok((of, nodes))
}

/// Data of one component; nothing of those that have several.
fn column(array: Node, arrays: &Arrays, count: usize) -> Result<Vec<f64>, GmshError> {
    let components =
        array.attribute("NumberOfComponents").map_or(Some(1), |n| n.trim().parse().ok());
    if components != Some(1usize) {
        return Ok(vec![]);
    }
    let values = arrays.numbers(array)?;
    match values.len() == count {
        true => Ok(values),
        false => {
            let name = array.attribute("Name").unwrap_or_default();
            Err(damaged(format!("has {} numbers in \"{name}\" for {count} of them", values.len())))
        }
    }
}

/// Groups of cells: by each value of whole-numbered data.
fn cell_sets<'d>(
    data: impl Iterator<Item = Node<'d, 'd>>,
    arrays: &Arrays,
    (count, rows): (usize, &[usize]),
) -> Result<Vec<(String, Vec<usize>)>, GmshError> {
    let mut sets = vec![];
    for array in data {
        let Some(name) = array.attribute("Name") else { continue };
        let values = column(array, arrays, count)?;
        let is_whole = values.iter().all(|v| v.fract() == 0.0 && v.abs() < 1e9);
        if values.len() != count || !is_whole {
            continue;
        }
        let mut of_value: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        for (place, row) in rows.iter().enumerate() {
            of_value.entry(values[*row] as i64).or_default().push(place);
        }
        if of_value.len() <= MOST_GROUPS {
            sets.extend(of_value.into_iter().map(|(v, own)| (format!("{name} {v}"), own)));
        }
    }
    Ok(sets)
}

/// Groups of nodes: where data are 1, and 0 elsewhere.
fn node_sets<'d>(
    data: impl Iterator<Item = Node<'d, 'd>>,
    arrays: &Arrays,
    count: usize,
) -> Result<Vec<(String, HashSet<usize>)>, GmshError> {
    let mut sets = vec![];
    for array in data {
        let Some(name) = array.attribute("Name") else { continue };
        let values = column(array, arrays, count)?;
        let is_mark = |v: &f64| *v == 0.0 || *v == 1.0;
        if values.len() != count || !values.iter().all(is_mark) || !values.contains(&1.0) {
            continue;
        }
        let own = values.iter().enumerate().filter(|v| *v.1 == 1.0).map(|v| v.0).collect();
        sets.push((name.to_owned(), own));
    }
    Ok(sets)
}

impl Arrays<'_> {
    /// An array of numbers that are not negative.
    fn whole(&self, array: Node, name: &str) -> Result<Vec<usize>, GmshError> {
        let own = |v: &f64| {
            let is_whole = *v >= 0.0 && v.fract() == 0.0 && *v < 1e15;
            is_whole.then_some(*v as usize).ok_or_else(|| damaged(format!("has {v} in \"{name}\"")))
        };
        self.numbers(array)?.iter().map(own).collect()
    }

    /// The numbers of an array.
    fn numbers(&self, array: Node) -> Result<Vec<f64>, GmshError> {
        let name = array.attribute("Name").unwrap_or_default();
        let text = || -> String { array.children().filter_map(|n| n.text()).collect() };
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let number = |w: &str| {
                    w.parse::<f64>().map_err(|_| damaged(format!("has \"{w}\" in \"{name}\"")))
                };
                return text().split_whitespace().map(number).collect();
            }
            "binary" => self.unfolded(text().trim().as_bytes(), true, name)?,
            "appended" => {
                let offset = array.attribute("offset").and_then(|o| o.trim().parse().ok());
                let (all, is_base64) = self.appended;
                let own = offset.and_then(|o: usize| all.get(o..));
                let own = own.ok_or_else(|| damaged(format!("has no data at \"{name}\"")))?;
                self.unfolded(own, is_base64, name)?
            }
            other => return Err(damaged(format!("has an array \"{name}\" as \"{other}\""))),
        };
        let word = array.attribute("type").unwrap_or_default();
        macro_rules! numbers {
            ($t:ty) => {{
                let number = |chunk: &[u8]| {
                    let mut own = [0u8; size_of::<$t>()];
                    own.copy_from_slice(chunk);
                    let value = if self.big_endian {
                        <$t>::from_be_bytes(own)
                    } else {
                        <$t>::from_le_bytes(own)
                    };
                    value as f64
                };
                bytes.chunks_exact(size_of::<$t>()).map(number).collect()
            }};
        }
        Ok(match word {
            "Float64" => numbers!(f64),
            "Float32" => numbers!(f32),
            "Int64" => numbers!(i64),
            "UInt64" => numbers!(u64),
            "Int32" => numbers!(i32),
            "UInt32" => numbers!(u32),
            "Int16" => numbers!(i16),
            "UInt16" => numbers!(u16),
            "Int8" => numbers!(i8),
            "UInt8" => numbers!(u8),
            other => return Err(damaged(format!("has an array \"{name}\" of type \"{other}\""))),
        })
    }

    /// The bytes of an array: behind their number, or block by block behind the number of blocks, the size of all but the last, that of the last (0: the same), and the compressed size of each.
    fn unfolded(&self, data: &[u8], is_base64: bool, name: &str) -> Result<Vec<u8>, GmshError> {
        let short = || damaged(format!("has an array \"{name}\" that ends before its data"));
        let mut stream = Stream { data, is_base64, pending: vec![] };
        let number = |stream: &mut Stream| -> Result<usize, GmshError> {
            let own = stream.take(self.header).ok_or_else(short)?;
            let fold = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
            let value = match self.big_endian {
                true => own.iter().fold(0, fold),
                false => own.iter().rev().fold(0, fold),
            };
            usize::try_from(value).ok().filter(|v| *v <= self.most).ok_or_else(short)
        };
        if !self.is_compressed {
            let count = number(&mut stream)?;
            return stream.take(count).ok_or_else(short);
        }
        let [blocks, size, last] =
            [number(&mut stream)?, number(&mut stream)?, number(&mut stream)?];
        let mut sizes = vec![];
        for _ in 0..blocks {
            sizes.push(number(&mut stream)?);
        }
        let mut all = vec![];
        for (k, packed) in sizes.iter().enumerate() {
            let own = stream.take(*packed).ok_or_else(short)?;
            let wanted = if k + 1 == blocks && last > 0 { last } else { size };
            let before = all.len();
            let room = self.most.saturating_sub(before).min(wanted) as u64;
            let unpacked = ZlibDecoder::new(own.as_slice()).take(room).read_to_end(&mut all);
            if unpacked.is_err() || all.len() - before != wanted {
                return Err(damaged(format!("has an array \"{name}\" that zlib cannot unfold")));
            }
        }
        Ok(all)
    }
}

/// Bytes that are taken one after the other, of base64 those that it stands for.
struct Stream<'d> {
    data: &'d [u8],
    is_base64: bool,
    /// What the last letters stand for besides.
    pending: Vec<u8>,
}

impl Stream<'_> {
    fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        if !self.is_base64 {
            let (own, rest) = self.data.split_at_checked(count)?;
            self.data = rest;
            return Some(own.to_vec());
        }
        // four letters are three bytes, fewer where a part ends
        while self.pending.len() < count {
            let (own, rest) = self.data.trim_ascii_start().split_at_checked(4)?;
            self.pending.extend(STANDARD.decode(own).ok()?);
            self.data = rest;
        }
        let rest = self.pending.split_off(count);
        Some(std::mem::replace(&mut self.pending, rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles and a line, as text.
    fn file(points: &str, cells: [&str; 3]) -> String {
        let array = |kind: &str, name: &str, body: &str| {
            format!("<DataArray type='{kind}' Name='{name}' format=\"ascii\">{body}</DataArray>")
        };
        let [a, b, c] = cells;
        format!(
            "<?xml version='1.0'?><VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece>\
             <Points>{}</Points><Cells>{}{}{}</Cells><PointData>{}</PointData><CellData>{}</CellData>\
             </Piece></UnstructuredGrid></VTKFile>",
            array("Float64", "Points", points),
            array("Int64", "connectivity", a),
            array("Int64", "offsets", b),
            array("UInt8", "types", c),
            array("Int64", "left", "1 0 0 1"),
            array("Int32", "material", "7 8 7"),
        )
    }

    const POINTS: &str = "0 0 0 1 0 0 1 1 0 0 1 0";
    const CELLS: [&str; 3] = ["0 1 2 0 2 3 1 2", "3 6 8", "5 5 3"];

    #[test]
    fn data_become_groups() {
        let found = read(file(POINTS, CELLS).as_bytes()).unwrap();
        let groups: Vec<(usize, String, usize)> =
            found.groups().into_iter().map(|(d, _, name, n)| (d, name, n)).collect();
        for (dim, name, count) in
            [(2, "material 7", 1), (2, "material 8", 1), (1, "material 7", 1), (1, "left", 1)]
        {
            assert!(groups.contains(&(dim, name.to_owned(), count)), "{name} {groups:?}");
        }
        let mesh = found.body(1.0, &[]).unwrap().mesh;
        assert_eq!((mesh.n_nodes(), mesh.n_elements(), mesh.dim()), (4, 2, 2));
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        for (points, cells, from, to, words) in [
            ("0 0 0 1", CELLS, "", "", "no places"),
            ("0 0 x", CELLS, "", "", "\"x\""),
            (POINTS, ["0 1 9 0 2 3 1 2", "3 6 8", "5 5 3"], "", "", "node 9 of 4"),
            (POINTS, ["0 1 2", "3 6 8", "5 5 3"], "", "", "no nodes for its cell 1"),
            (POINTS, ["0 1 2 0 2 3 1 2", "3 6 8", "5 5 14"], "", "", "type 14"),
            (POINTS, ["0 1 2 0 2 3 1 2", "3 6 8", "5 9 3"], "", "", "with 3 nodes"),
            (POINTS, ["0 1 1 0 2 3 1 2", "3 6 8", "5 5 3"], "", "", "node twice"),
            (POINTS, ["1 2", "2", "3"], "", "", "no cells of a body"),
            (POINTS, CELLS, "UnstructuredGrid\"", "PolyData\"", "PolyData"),
            (POINTS, CELLS, "<Piece>", "<Piece/><Piece>", "2 pieces"),
            (POINTS, CELLS, "</Points>", "", "no XML"),
            (POINTS, CELLS, "ascii", "appended\" offset=\"4", "no data at"),
            (POINTS, CELLS, "ascii", "binary", "ends before"),
            (POINTS, CELLS, "<VTKFile", "<VTKFile compressor=\"vtkLZ4DataCompressor\"", "LZ4"),
        ] {
            let text = file(points, cells);
            let text = if from.is_empty() { text } else { text.replacen(from, to, 1) };
            let said = read(text.as_bytes()).unwrap_err().to_string();
            assert!(said.contains(words), "{words}: {said}");
        }
    }
}
