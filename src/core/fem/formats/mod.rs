//! Matrices of other programs. Which program wrote a file is found out by its content, not by its ending.
//!
//! | sign | format |
//! | --- | --- |
//! | `%%MatrixMarket` | Matrix Market |
//! | three numbers a line, `1 2 -8.4e4` | CalculiX's `.sti` and `.mas`, Abaqus's `COORDINATE` |
//! | five, with commas, `101,2, 101,1, 3.5e1` | Abaqus's `MATRIX INPUT` |
//! | `RSA` in the third line | Harwell–Boeing, as Ansys's `HBMAT` writes it |
//! | `PK` | SciPy's `.npz` of a sparse matrix, NumPy's of arrays |
//! | `MATLAB 5.0 MAT-file` | MATLAB's files older than 7.3 |
//! | five whole numbers and a name | MATLAB's files of version 4 |
//! | `DMIG` | Nastran's punch files and bulk data |
//! | integers in `4I8`, a name, a format | Nastran's `OUTPUT4` as text |
//! | `*USER ELEMENT` | substructures of Abaqus and CalculiX |

mod harwell_boeing;
mod mat;
mod mat4;
mod nastran;
mod npz;
mod op4;
mod substructure;
mod triplets;
mod uneven;

use std::collections::{BTreeSet, HashSet};
use std::fmt;

use super::matrix_market::parse_matrix_market;
use super::sparse::Csr;
pub use uneven::{Uneven, uneven_nodes};

use crate::mesh::fortran::real;

/// A displacement as the program that made a matrix calls it: node and direction, `109.3`; 1 2 3 along x y z, 4 5 6 rotations, 0 a scalar.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DofName {
    /// The node.
    pub node: String,
    /// The direction.
    pub direction: u8,
}

impl DofName {
    /// What its direction is called.
    pub fn along(&self) -> &'static str {
        let axes = ["scalar", "x", "y", "z", "rx", "ry", "rz"];
        axes[usize::from(self.direction).min(axes.len() - 1)]
    }
}

impl fmt::Display for DofName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.node, self.direction)
    }
}

/// A matrix as a program wrote it.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// The format.
    pub format: &'static str,
    /// The whole matrix: of one triangle both.
    pub matrix: Csr,
    /// Entries in the file.
    pub entries: usize,
    /// The file has one triangle.
    pub one_triangle: bool,
    /// What its rows are called; empty: nobody says.
    pub names: Vec<DofName>,
    /// Displacements that the program holds, which are no rows.
    pub held: Vec<DofName>,
}

/// One of the matrices of a file that has several, by name.
#[derive(Debug)]
struct Named {
    name: String,
    /// As it stands there, perhaps one triangle; or why it is none.
    matrix: Result<Csr, String>,
    entries: usize,
    one_triangle: bool,
    names: Vec<DofName>,
}

impl Named {
    fn new(name: String, matrix: Result<Csr, String>) -> Named {
        let entries = matrix.as_ref().map_or(0, Csr::n_entries);
        Named { name, matrix, entries, one_triangle: false, names: vec![] }
    }

    fn refused(name: String, why: &str) -> Named {
        Named::new(name, Err(why.into()))
    }

    fn is_square(&self) -> bool {
        self.matrix.as_ref().is_ok_and(|a| a.n_rows() == a.n_cols() && a.n_rows() > 1)
    }
}

/// Rows and columns.
type Sizes = (usize, usize);

/// A full matrix from its numbers column by column.
fn by_columns((rows, columns): Sizes, values: &[f64]) -> Csr {
    let at = |k: usize, v: &f64| (*v != 0.0).then_some((k % rows, k / rows, *v));
    let entries = values.iter().enumerate().filter_map(|(k, v)| at(k, v));
    Csr::from_triplets(rows, columns, entries.collect())
}

/// So many rows may be empty: sizes are not believed alone.
const EMPTY: usize = 1_000_000;

/// A matrix of some sizes with its entries.
fn sparse((rows, columns): Sizes, entries: Vec<(usize, usize, f64)>) -> Result<Csr, String> {
    if rows.max(columns) > EMPTY + entries.len() {
        return Err(format!("is {rows} × {columns} with {} entries", entries.len()));
    }
    if let Some((i, j, _)) = entries.iter().find(|(i, j, _)| *i >= rows || *j >= columns) {
        return Err(format!("has an entry ({}, {}), and is {rows} × {columns}", i + 1, j + 1));
    }
    Ok(Csr::from_triplets(rows, columns, entries))
}

/// A sparse matrix by columns.
struct Sparse<'a> {
    sizes: Sizes,
    /// First entry of each column, and how many there are.
    starts: &'a [usize],
    rows: &'a [usize],
    values: &'a [f64],
}

fn from_columns(a: &Sparse) -> Result<Csr, String> {
    let columns = a.sizes.1;
    let count = a.starts.last().copied().unwrap_or(0);
    let fits = a.starts.len() == columns + 1
        && a.starts.windows(2).all(|w| w[0] <= w[1])
        && count <= a.values.len().min(a.rows.len());
    if !fits {
        return Err("its columns, rows and entries do not fit together".into());
    }
    let of = |j: usize| (a.starts[j]..a.starts[j + 1]).map(move |p| (p, j));
    let entries = (0..columns).flat_map(of).map(|(p, j)| (a.rows[p], j, a.values[p]));
    sparse(a.sizes, entries.collect())
}

/// Names of rows, where a file has them beside its matrices: `node` and `direction`, or both as the columns of `dof`.
fn names_among(found: &[Named]) -> Vec<DofName> {
    let column = |name: &str, j: usize| -> Option<Vec<f64>> {
        let a = found.iter().find(|m| m.name == name)?.matrix.as_ref().ok()?;
        let at = |i: usize| a.entry(i, j).copied().unwrap_or(0.0);
        (a.n_cols() > j).then(|| (0..a.n_rows()).map(at).collect())
    };
    let both = column("node", 0).zip(column("direction", 0));
    let Some((nodes, directions)) = both.or_else(|| column("dof", 0).zip(column("dof", 1))) else {
        return vec![];
    };
    let whole = |x: f64| (x.fract() == 0.0 && (0.0..1e15).contains(&x)).then_some(x as u64);
    let name = |(node, direction): (&f64, &f64)| {
        let direction = u8::try_from(whole(*direction)?).ok().filter(|d| *d <= 6)?;
        Some(DofName { node: whole(*node)?.to_string(), direction })
    };
    let all: Option<Vec<DofName>> = nodes.iter().zip(&directions).map(name).collect();
    all.and_then(|all| distinct(all).ok()).unwrap_or_default()
}

/// Give the matrices of a file the names that stand beside them.
fn with_names(mut found: Vec<Named>) -> Vec<Named> {
    let names = names_among(&found);
    for own in &mut found {
        if own.matrix.as_ref().is_ok_and(|a| a.n_rows() == names.len()) {
            own.names.clone_from(&names);
        }
    }
    found
}

/// That of a name, or the only one.
fn pick(format: &'static str, all: Vec<Named>, wanted: Option<&str>) -> Result<Written, String> {
    let list = || {
        let names: Vec<&str> =
            all.iter().filter(|m| m.is_square()).map(|m| m.name.as_str()).collect();
        match names.first() {
            Some(first) => {
                format!("it has {}; name one behind the file, as FILE:/{first}", names.join(", "))
            }
            None => "it has no square matrix of numbers".to_owned(),
        }
    };
    let square: Vec<usize> = (0..all.len()).filter(|k| all[*k].is_square()).collect();
    let found = match (wanted, &square[..]) {
        (Some(name), _) => {
            let own = all.iter().position(|m| m.name == name);
            let alike = || all.iter().position(|m| m.name.eq_ignore_ascii_case(name));
            own.or_else(alike).ok_or_else(|| format!("has no matrix {name}: {}", list()))?
        }
        (None, [one]) => *one,
        (None, []) => {
            let why = all.iter().find_map(|m| Some((&m.name, m.matrix.as_ref().err()?)));
            return Err(match why {
                Some((name, why)) => format!("{name} {why}"),
                None => "has no square matrix".into(),
            });
        }
        (None, _) => return Err(format!("has several matrices: {}", list())),
    };
    let own = &all[found];
    let a = own.matrix.as_ref().map_err(|why| format!("{} {why}", own.name))?;
    if a.n_rows() != a.n_cols() {
        return Err(format!("{} is {} × {}", own.name, a.n_rows(), a.n_cols()));
    }
    if let Some((i, j, v)) = a.triplets().find(|e| !e.2.is_finite()) {
        return Err(format!("{}: entry ({}, {}) is {v}", own.name, i + 1, j + 1));
    }
    let (matrix, mirrored) = whole(a.n_rows(), a.triplets().collect(), false)
        .map_err(|why| format!("{}: {why}", own.name))?;
    let one_triangle = own.one_triangle || mirrored;
    let (entries, names) = (own.entries, own.names.clone());
    Ok(Written { format, matrix, entries, one_triangle, names, held: vec![] })
}

/// Whether a file is of a format that names its rows, by its beginning: others need not be read for names.
pub fn may_have_names(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]).to_uppercase();
    let is_labelled = |line: &&str| !line.trim_start().starts_with('*') && !line.trim().is_empty();
    let first = start.lines().find(is_labelled).unwrap_or_default();
    // Abaqus's MATRIX INPUT has five numbers a line
    first.matches(',').count() >= 4
        || ["DMIG", "*USER ELEMENT", "MATLAB 5.0"].iter().any(|word| start.contains(word))
        || mat4::is_one(bytes)
        || npz::is_of_arrays(bytes)
}

/// Whether a file is one of MATLAB's older than 7.3, by its beginning.
pub fn is_matlab(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0 MAT-file") || mat4::is_one(bytes)
}

/// Read a matrix, of a file that has several that of a name; the message says what is wrong with the file, and what would help.
pub fn read_matrix(bytes: &[u8], wanted: Option<&str>) -> Result<Written, String> {
    let written = of_content(bytes, wanted)?;
    match written.matrix.n_rows() {
        0 => Err("has no rows".into()),
        _ => Ok(written),
    }
}

/// A matrix of a file that may have several.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    /// Its name.
    pub name: String,
    /// Rows, columns and entries, or why it is not read.
    pub held: Result<[usize; 3], String>,
}

/// What a file of a format with several matrices has, and the format.
pub fn list_matrices(bytes: &[u8]) -> Result<Option<(&'static str, Vec<Listed>)>, String> {
    let listed = |m: Named| {
        let held = m.matrix.map(|a| [a.n_rows(), a.n_cols(), m.entries]);
        Listed { name: m.name, held }
    };
    let found = several(bytes)?;
    Ok(found.map(|(format, all)| (format, all.into_iter().map(listed).collect())))
}

/// The matrices of a file of a format that may have several, and the format.
fn several(bytes: &[u8]) -> Result<Option<(&'static str, Vec<Named>)>, String> {
    if bytes.starts_with(b"MATLAB 5.0 MAT-file") {
        return Ok(Some(("MATLAB 5", with_names(mat::read(bytes)?))));
    }
    if npz::is_of_arrays(bytes) {
        return Ok(Some(("NumPy npz", with_names(npz::read_arrays(bytes)?))));
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        if substructure::is_one(text) {
            return Ok(Some(("substructure", substructure::read(text)?)));
        }
        if nastran::is_one(text) {
            return Ok(Some(("Nastran DMIG", nastran::read(text)?)));
        }
        if op4::is_one(text) {
            return Ok(Some(("Nastran OUTPUT4", op4::read(text)?)));
        }
    }
    if mat4::is_one(bytes) {
        return Ok(Some(("MATLAB 4", with_names(mat4::read(bytes)?))));
    }
    Ok(None)
}

fn of_content(bytes: &[u8], wanted: Option<&str>) -> Result<Written, String> {
    if let Some((format, all)) = several(bytes)? {
        return pick(format, all, wanted);
    }
    if let Some(name) = wanted {
        return Err(format!("has one matrix, and no name such as {name}: leave \":/{name}\" out"));
    }
    if bytes.starts_with(b"PK\x03\x04") {
        return npz::read(bytes);
    }
    if bytes.starts_with(b"\x89HDF") {
        return Err("is an HDF5 file: name the dataset behind it, FILE.h5:/K".into());
    }
    let text = std::str::from_utf8(bytes).map_err(|_| {
        "is neither text nor a format that is read (Matrix Market, CalculiX .sti and .mas, Abaqus .mtx, Harwell-Boeing, Nastran DMIG and OUTPUT4 as text, MATLAB, SciPy .npz)".to_owned()
    })?;
    if text.get(..14).is_some_and(|s| s.eq_ignore_ascii_case("%%MatrixMarket")) {
        let matrix = parse_matrix_market(text)?;
        let entries = matrix.n_entries();
        let format = "Matrix Market";
        return Ok(Written {
            format,
            matrix,
            entries,
            one_triangle: false,
            names: vec![],
            held: vec![],
        });
    }
    if harwell_boeing::is_one(text) {
        return harwell_boeing::read(text);
    }
    triplets::read(text)
}

/// The names of CalculiX's `.dof`: `109.3`, a line a row.
pub fn parse_dof_names(text: &str) -> Result<Vec<DofName>, String> {
    let lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let name = |(k, line): (usize, &str)| {
        parse_name(line).ok_or_else(|| {
            format!("line {}: \"{}\" is no node and direction, as 109.3", k + 1, line.trim())
        })
    };
    distinct(lines.map(name).collect::<Result<_, _>>()?)
}

/// `109.3`
pub fn parse_name(text: &str) -> Option<DofName> {
    let (node, direction) = text.trim().rsplit_once('.')?;
    let direction = direction.parse().ok().filter(|d: &u8| *d <= 6)?;
    let is_node =
        !node.is_empty() && node.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(&b));
    is_node.then(|| DofName { node: node.to_owned(), direction })
}

/// Names in a list, a row a line: node and direction (1 to 6, 0 for scalars, or x y z rx ry rz), behind a comma, a semicolon, blanks or a dot. A heading may stand above them.
pub fn parse_name_list(text: &str) -> Result<Vec<DofName>, String> {
    let text = text.trim_start_matches('\u{feff}');
    let lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let name = |line: &str| {
        let words: Vec<&str> = line
            .split([',', ';', '\t', ' '])
            .map(|w| w.trim_matches('"'))
            .filter(|w| !w.is_empty())
            .collect();
        let axes = ["x", "y", "z", "rx", "ry", "rz"];
        match words[..] {
            [word] => parse_name(word),
            [node, direction] => {
                let axis = axes.iter().position(|a| direction.eq_ignore_ascii_case(a));
                let number = axis.map_or(direction.to_owned(), |k| (k + 1).to_string());
                parse_name(&format!("{node}.{number}"))
            }
            _ => None,
        }
    };
    let mut names = vec![];
    for (k, line) in lines {
        match name(line) {
            Some(name) => names.push(name),
            // a heading
            None if names.is_empty() && k == 0 => {}
            None => {
                let line = line.trim();
                return Err(format!(
                    "line {}: \"{line}\" is no node and direction, as 109,3",
                    k + 1
                ));
            }
        }
    }
    distinct(names)
}

/// The names of Ansys's `.mapping` beside `HBMAT`: `equation node UX`.
pub fn parse_mapping(text: &str) -> Result<Vec<DofName>, String> {
    let mut names = vec![];
    for (k, line) in text.lines().enumerate().skip(1) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (row, node, label) = match words[..] {
            [] => continue,
            [row, node, label] => (row, node, label),
            _ => {
                return Err(format!(
                    "line {}: \"{}\" is no equation, node and label",
                    k + 1,
                    line.trim()
                ));
            }
        };
        let labels = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"];
        let Some(direction) = labels.iter().position(|l| *l == label) else {
            return Err(format!(
                "line {}: {label} is no displacement: only UX UY UZ ROTX ROTY ROTZ are read",
                k + 1
            ));
        };
        if row.parse() != Ok(names.len() + 1) {
            return Err(format!(
                "line {}: equation {row} stands where {} belongs",
                k + 1,
                names.len() + 1
            ));
        }
        names.push(DofName { node: node.to_owned(), direction: direction as u8 + 1 });
    }
    distinct(names)
}

/// No name stands twice.
fn distinct(names: Vec<DofName>) -> Result<Vec<DofName>, String> {
    let mut known = BTreeSet::new();
    match names.iter().find(|name| !known.insert(*name)) {
        Some(twice) => Err(format!("{twice} stands there twice")),
        None => Ok(names),
    }
}

/// The whole of a symmetric matrix of `n` rows from its entries, of which one triangle may be missing; `partly`: of some entries the mirror image may.
fn whole(n: usize, entries: Vec<(usize, usize, f64)>, partly: bool) -> Result<(Csr, bool), String> {
    let mut known: HashSet<(usize, usize)> = HashSet::with_capacity(entries.len());
    if let Some((i, j, _)) = entries.iter().find(|e| !known.insert((e.0, e.1))) {
        return Err(format!("entry ({}, {}) stands there twice", i + 1, j + 1));
    }
    let alone = |e: &&(usize, usize, f64)| e.0 != e.1 && !known.contains(&(e.1, e.0));
    let missing: Vec<_> = entries.iter().filter(alone).map(|&(i, j, v)| (j, i, v)).collect();
    let off_diagonal = entries.iter().filter(|e| e.0 != e.1).count();
    let (lower, upper) = (missing.iter().any(|e| e.0 > e.1), missing.iter().any(|e| e.0 < e.1));
    let one_triangle = !missing.is_empty() && missing.len() == off_diagonal && lower != upper;
    if !missing.is_empty() && !one_triangle && !partly {
        return Err(format!(
            "{} of its {off_diagonal} entries off the diagonal have no partner across it, and it is no triangle: is it symmetric, and complete?",
            missing.len()
        ));
    }
    let all = entries.into_iter().chain(missing).collect();
    Ok((Csr::from_triplets(n, n, all), one_triangle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_split_at_their_last_point() {
        let names = parse_dof_names("101.1\n1001.3\n\nArm-2.12.2\n").unwrap();
        assert_eq!(names[1], DofName { node: "1001".into(), direction: 3 });
        assert_eq!(names[2].to_string(), "Arm-2.12.2");
        for bad in ["101", "101.7", ".3", "101.1\n101.1\n", "10 1.3"] {
            assert!(parse_dof_names(bad).is_err(), "{bad}");
        }
        let list = "node,direction\n\"Arm-2.12\",y\n7; 3\n8\tRX\n9.0\n";
        let names: Vec<String> =
            parse_name_list(list).unwrap().iter().map(DofName::to_string).collect();
        assert_eq!(names, ["Arm-2.12.2", "7.3", "8.4", "9.0"]);
        for bad in ["1,1\n1,1\n", "1,1\nnode,direction\n", "a\nb\n1,1\n", "1,1,1\n2,7\n"] {
            assert!(parse_name_list(bad).is_err(), "{bad}");
        }
        let map = "    Matrix Eqn          Node    DOF\n             1            48    UZ\n             2            44    ROTX\n";
        let names: Vec<String> =
            parse_mapping(map).unwrap().iter().map(DofName::to_string).collect();
        assert_eq!(names, ["48.3", "44.4"]);
        assert!(parse_mapping(&map.replace("ROTX", "PRES")).is_err());
        assert!(parse_mapping(&map.replace("             2 ", "             3 ")).is_err());
    }
}
