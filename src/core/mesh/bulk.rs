//! Bulk data of Nastran (`.bdf`, `.nas`, `.dat`): grid points, elements and sets, as the [`File`] that a mesh of Gmsh gives.
//!
//! | card | becomes |
//! | --- | --- |
//! | `GRID` | nodes; their numbers stay |
//! | `CTETRA`, `CHEXA`, `CPENTA` with or without nodes on their sides | cells; `CTRIA3`, `CTRIA6`, `CQUAD4`, `CQUAD8` where all z are 0 |
//! | the property of an element | a group of cells, `property 1`, for `[[material]] group` |
//! | `SET1`, `SET3` of grid points | groups of sides, `set 2`: the sides of the boundary all of whose nodes are in the set |
//! | `SET3` of elements | a group of cells |
//! | `SPC`, `SPC1` | groups of sides, `spc 1`, for `[[support]] group` |
//!
//! Fields of eight or sixteen letters, or between commas. Materials, supports and loads are those of the scene. What
//! bears forces and is no element of a mesh is refused by its name; all else is passed over.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::assembly::error;
use super::fortran::real;
use super::gmsh::{File, GmshError, types};
use super::listed::{Listed, ordered};
use super::{ElementKind, Point};

/// Cards that change what the body does.
const MECHANICS: [&str; 26] = [
    "RBE1", "RBE2", "RBE3", "RBAR", "RROD", "RSPLINE", "MPC", "MPCADD", "CONM1", "CONM2", "CMASS1",
    "CMASS2", "CELAS1", "CELAS2", "CELAS3", "CELAS4", "CBUSH", "CDAMP1", "CDAMP2", "CVISC", "CGAP",
    "CBAR", "CBEAM", "CROD", "CONROD", "INCLUDE",
];

/// Cards by which a file is known.
const KNOWN: [&str; 17] = [
    "GRID", "CTETRA", "CHEXA", "CPENTA", "CTRIA3", "CTRIA6", "CQUAD4", "CQUAD8", "PSOLID",
    "PSHELL", "MAT1", "SOL", "CEND", "BEGIN", "NASTRAN", "PARAM", "INIT",
];

/// Whether a text begins like bulk data: with one of its cards, behind comments.
pub fn is_bulk(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(20_000)]).into_owned();
    let first = start.lines().map(str::trim).find(|l| !l.is_empty() && !l.starts_with('$'));
    first.is_some_and(|l| {
        let word: String = l.chars().take_while(char::is_ascii_alphanumeric).collect();
        KNOWN.contains(&word.to_ascii_uppercase().as_str())
    })
}

/// A card: its name, and the fields behind it; nothing of the fields that continue lines.
struct Card {
    line: usize,
    name: String,
    fields: Vec<String>,
}

impl Card {
    fn get(&self, k: usize) -> &str {
        self.fields.get(k).map_or("", String::as_str)
    }

    fn fault(&self, message: impl std::fmt::Display, help: &str) -> GmshError {
        error(self.line, format!("{} {}: {message}", self.name, self.get(0)), help)
    }

    fn whole(&self, k: usize) -> Result<i64, GmshError> {
        let text = self.get(k);
        let no = || self.fault(format!("\"{text}\" is no whole number"), "write the file anew");
        text.parse().map_err(|_| no())
    }

    /// Numbers from field `k` on, `5 THRU 9` among them.
    fn list(&self, k: usize) -> Result<Vec<i64>, GmshError> {
        let mut all: Vec<i64> = vec![];
        let mut through = false;
        for at in k..self.fields.len() {
            match self.get(at).to_ascii_uppercase().as_str() {
                "" | "EXCEPT" => {}
                "THRU" => through = true,
                _ => {
                    let number = self.whole(at)?;
                    match (through, all.last()) {
                        (true, Some(&first)) if number.saturating_sub(first) <= 100_000_000 => {
                            all.extend(first + 1..=number);
                        }
                        (true, _) => {
                            return Err(self.fault("THRU has no range", "write the file anew"));
                        }
                        _ => all.push(number),
                    }
                    through = false;
                }
            }
        }
        Ok(all)
    }
}

/// Fields of a line: its name, what it holds, whether it goes on with the card before it.
fn fields(line: &str) -> (String, Vec<String>) {
    let cut = |from: usize, width: usize| -> String {
        line.chars().skip(from).take(width).collect::<String>().trim().to_owned()
    };
    if line.contains(',') {
        let mut all = line.split(',').map(|f| f.trim().to_owned());
        let name = all.next().unwrap_or_default();
        let count = if name.ends_with('*') { 4 } else { 8 };
        return (name, all.take(count).collect());
    }
    let name = cut(0, 8);
    let (count, width) =
        if name.ends_with('*') || name.starts_with('*') { (4, 16) } else { (8, 8) };
    let own = (0..count).map(|k| cut(8 + k * width, width)).collect();
    (name, own)
}

/// The cards of the bulk data.
fn cards(text: &str) -> Vec<Card> {
    let begins = |l: &str| {
        let mut words = l.split_whitespace().map(str::to_ascii_uppercase);
        words.next().as_deref() == Some("BEGIN") && words.next().as_deref() == Some("BULK")
    };
    let skipped = text.lines().position(begins).map_or(0, |k| k + 1);
    let mut all: Vec<Card> = vec![];
    for (k, line) in text.lines().enumerate().skip(skipped) {
        let line = line.split('$').next().unwrap_or_default().replace('\t', "        ");
        if line.trim().is_empty() {
            continue;
        }
        let (name, own) = fields(&line);
        let goes_on = name.is_empty() || name.starts_with(['+', '*']);
        match all.last_mut() {
            Some(card) if goes_on => {
                // of a card in small fields the line before it may have left out its last ones
                let whole = card.fields.len().div_ceil(4) * 4;
                card.fields.resize(whole, String::new());
                card.fields.extend(own);
            }
            _ => {
                let name = name.trim_end_matches('*').to_ascii_uppercase();
                if name == "ENDDATA" {
                    break;
                }
                all.push(Card { line: k + 1, name, fields: own });
            }
        }
    }
    for card in &mut all {
        let last = card.fields.iter().rposition(|f| !f.is_empty()).map_or(0, |k| k + 1);
        card.fields.truncate(last);
    }
    all
}

/// The kind of an element with so many nodes.
fn kind_of(name: &str, nodes: usize) -> Option<ElementKind> {
    use ElementKind::{Hex8, Hex20, Prism6, Prism15, Quad4, Quad8, Tet4, Tet10, Tri3, Tri6};
    Some(match (name, nodes) {
        ("CTETRA", 4) => Tet4,
        ("CTETRA", 10) => Tet10,
        ("CHEXA", 8) => Hex8,
        ("CHEXA", 20) => Hex20,
        ("CPENTA", 6) => Prism6,
        ("CPENTA", 15) => Prism15,
        ("CTRIA3", 3) => Tri3,
        ("CTRIA6", 6) => Tri6,
        ("CQUAD4", 4) => Quad4,
        ("CQUAD8", 8) => Quad8,
        _ => return None,
    })
}

/// Fields of nodes of an element, at most, and how many a plane one has.
fn nodes_of(name: &str) -> Option<(usize, bool)> {
    Some(match name {
        "CTETRA" => (10, false),
        "CHEXA" => (20, false),
        "CPENTA" => (15, false),
        // behind them stand angles and thicknesses
        "CTRIA3" => (3, true),
        "CTRIA6" => (6, true),
        "CQUAD4" => (4, true),
        "CQUAD8" => (8, true),
        _ => return None,
    })
}

/// Nodes of an element in the order of VTK: here those on upright sides come before those above.
fn as_vtk(kind: ElementKind, own: &[usize]) -> Vec<usize> {
    let (below, upright) = match kind {
        ElementKind::Hex20 => (12, 4),
        ElementKind::Prism15 => (9, 3),
        _ => return own.to_vec(),
    };
    let (low, rest) = own.split_at(below);
    let (upright, above) = rest.split_at(upright);
    [low, above, upright].concat()
}

/// Bulk data that are being read.
#[derive(Default)]
struct Bulk {
    nodes: Vec<(i64, Point)>,
    place: HashMap<i64, usize>,
    cells: Vec<(i64, ElementKind, Vec<usize>)>,
    cell: HashMap<i64, usize>,
    properties: BTreeMap<i64, Vec<usize>>,
    /// Nodes of sets and supports.
    node_sets: BTreeMap<String, HashSet<usize>>,
    cell_sets: BTreeMap<String, Vec<usize>>,
}

/// Read bulk data.
pub fn read(bytes: &[u8]) -> Result<File, GmshError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| error(0, "is no text in UTF-8", "save the bulk data as plain text"))?;
    let all = cards(text);
    if let Some(card) = all.iter().find(|c| MECHANICS.contains(&c.name.as_str())) {
        let help = match card.name.as_str() {
            "INCLUDE" => "put the lines of that file into this one",
            _ => {
                "export matrices (DMIG, OUTPUT4) in place of a mesh; springs, dampers and masses are keys of the scene"
            }
        };
        return Err(card.fault("is no part of a mesh", help));
    }
    let mut bulk = Bulk::default();
    // elements and sets may stand before what they name
    all.iter().filter(|c| c.name == "GRID").try_for_each(|c| bulk.grid(c))?;
    for card in &all {
        if let Some((most, plane)) = nodes_of(&card.name) {
            bulk.element(card, most, plane)?;
        }
    }
    all.iter().try_for_each(|c| bulk.set(c))?;
    bulk.file()
}

impl Bulk {
    fn grid(&mut self, card: &Card) -> Result<(), GmshError> {
        let tag = card.whole(0)?;
        for (k, what) in [(1, "place"), (5, "displacements")] {
            if !matches!(card.get(k), "" | "0") {
                let message = format!("its {what} are in coordinates of its own ({})", card.get(k));
                return Err(card.fault(message, "write the model in the basic coordinates"));
            }
        }
        let mut at = [0.0; 3];
        for (c, x) in at.iter_mut().enumerate() {
            let text = card.get(2 + c);
            let no = || card.fault(format!("\"{text}\" is no coordinate"), "write the file anew");
            *x = if text.is_empty() { 0.0 } else { real(text).ok_or_else(no)? };
        }
        if self.place.insert(tag, self.nodes.len()).is_some() {
            return Err(card.fault("stands there twice", "number grid points once"));
        }
        self.nodes.push((tag, at));
        Ok(())
    }

    fn element(&mut self, card: &Card, most: usize, plane: bool) -> Result<(), GmshError> {
        let (tag, property) = (card.whole(0)?, card.get(1));
        let property = if property.is_empty() { tag } else { card.whole(1)? };
        let own: Vec<&str> = (2..2 + most).map(|k| card.get(k)).collect();
        let count = own.iter().rposition(|f| !f.is_empty()).map_or(0, |k| k + 1);
        let kind =
            kind_of(&card.name, count).filter(|_| own[..count].iter().all(|f| !f.is_empty()));
        let Some(kind) = kind else {
            let there = own.iter().filter(|f| !f.is_empty()).count();
            let message = format!("has {there} nodes");
            return Err(card.fault(message, "give all nodes on sides, or none"));
        };
        let mut nodes = vec![];
        for k in 2..2 + count {
            let number = card.whole(k)?;
            let Some(&place) = self.place.get(&number) else {
                let message = format!("has grid point {number}, which the file does not have");
                return Err(card.fault(message, "write the file whole"));
            };
            nodes.push(place);
        }
        if nodes.iter().collect::<HashSet<_>>().len() < nodes.len() {
            let help = "mesh it with wedges or tetrahedra in its place";
            return Err(card.fault("has a grid point twice", help));
        }
        if plane && nodes.iter().any(|&n| self.nodes[n].1[2] != 0.0) {
            let help =
                "a body in the plane has z = 0; one in space consists of CTETRA, CHEXA, CPENTA";
            return Err(card.fault("is a shell", help));
        }
        if self.cell.insert(tag, self.cells.len()).is_some() {
            return Err(card.fault("stands there twice", "number elements once"));
        }
        self.properties.entry(property).or_default().push(self.cells.len());
        self.cells.push((tag, kind, ordered(kind, &as_vtk(kind, &nodes))));
        Ok(())
    }

    /// Sets, and what is held.
    fn set(&mut self, card: &Card) -> Result<(), GmshError> {
        let of_elements =
            card.name == "SET3" && card.get(1).to_ascii_uppercase().starts_with("ELEM");
        let (name, numbers) = match card.name.as_str() {
            "SET1" => (format!("set {}", card.get(0)), card.list(1)?),
            "SET3" => (format!("set {}", card.get(0)), card.list(2)?),
            "SPC1" => (format!("spc {}", card.get(0)), card.list(2)?),
            "SPC" => {
                let pairs = [1, 4].into_iter().filter(|&k| !card.get(k).is_empty());
                let numbers = pairs.map(|k| card.whole(k)).collect::<Result<_, _>>()?;
                (format!("spc {}", card.get(0)), numbers)
            }
            _ => return Ok(()),
        };
        // ranges may have gaps
        match of_elements {
            true => {
                let found = numbers.iter().filter_map(|n| self.cell.get(n)).copied();
                self.cell_sets.entry(name).or_default().extend(found);
            }
            false => {
                let found = numbers.iter().filter_map(|n| self.place.get(n)).copied();
                self.node_sets.entry(name).or_default().extend(found);
            }
        }
        Ok(())
    }

    fn file(self) -> Result<File, GmshError> {
        if self.cells.is_empty() {
            let help = "give CTETRA, CHEXA or CPENTA; in the plane CTRIA3, CTRIA6, CQUAD4, CQUAD8";
            return Err(error(0, "has no elements", help));
        }
        let of = |kind: ElementKind| types().find(|t| t.number == kind.gmsh().0);
        let cells = self.cells.into_iter();
        let cells = cells.filter_map(|(tag, kind, nodes)| Some((tag, of(kind)?, nodes))).collect();
        let properties = self.properties.into_iter();
        let properties = properties.map(|(id, own)| (format!("property {id}"), own));
        Ok(Listed {
            version: "bulk data".into(),
            nodes: self.nodes,
            cells,
            cell_sets: properties.chain(self.cell_sets).collect(),
            node_sets: self.node_sets.into_iter().collect(),
            surfaces: vec![],
        }
        .file())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same brick in fields of eight, of sixteen, and between commas.
    #[test]
    fn fields_of_all_widths_are_the_same() {
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        let small = |k: usize, p: [f64; 3]| {
            format!("GRID    {:8}{:8}{:8.1}{:8.1}{:8.1}\n", k, "", p[0], p[1], p[2])
        };
        let large = |k: usize, p: [f64; 3]| {
            format!("GRID*   {:16}{:16}{:16.9}{:16.9}*\n*       {:16.9}\n", k, "", p[0], p[1], p[2])
        };
        let free = |k: usize, p: [f64; 3]| format!("GRID,{k},,{:e},{},{}+0\n", p[0], p[1], p[2]);
        let of = |grid: &dyn Fn(usize, [f64; 3]) -> String, element: &str| {
            let nodes: String = corners.iter().enumerate().map(|(k, p)| grid(k + 1, *p)).collect();
            let text = format!(
                "SOL 103\nCEND\nBEGIN BULK\n$ nodes\n{nodes}{element}SET1,7,1,THRU,4\nENDDATA\nrubbish\n"
            );
            assert!(is_bulk(text.as_bytes()));
            read(text.as_bytes()).unwrap()
        };
        let one = of(
            &small,
            "CHEXA   1       3       1       2       3       4       5       6       +a\n+a      7       8\n",
        );
        let two = of(
            &large,
            "CHEXA*  1               3               1               2               *\n*       3               4               5               6               *\n*       7               8\n",
        );
        let three = of(&free, "CHEXA,1,3,1,2,3,4,5,6,\n,7,8\n");
        assert_eq!(one.nodes, two.nodes);
        assert_eq!(one.nodes, three.nodes);
        assert_eq!(one.cells, two.cells);
        assert_eq!(one.cells, three.cells);
        let mut names: Vec<&String> = one.names.values().collect();
        names.sort();
        assert_eq!(names, ["property 3", "set 7"]);
        // the side below is all that has its nodes in the set
        let sides: Vec<_> = one.cells.iter().filter(|c| c.of.dim == 2).collect();
        assert_eq!(sides.len(), 1);
        assert!(sides[0].nodes.iter().all(|&n| one.nodes[n].1[2] == 0.0));
    }

    /// Nodes on sides lie half way between the corners of these sides, whatever the order of the file.
    #[test]
    fn nodes_on_sides_lie_between_their_corners() {
        let hexa = [0, 1, 2, 3, 0, 1, 2, 3]
            .map(|k: usize| [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]][k]);
        let prism = [0, 1, 2, 0, 1, 2].map(|k: usize| [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]][k]);
        for (name, corners, sides) in [
            ("CHEXA", &hexa[..], "01 12 23 30 04 15 26 37 45 56 67 74"),
            ("CPENTA", &prism[..], "01 12 20 03 14 25 34 45 53"),
        ] {
            let half = corners.len() / 2;
            let mut places: Vec<Point> = corners
                .iter()
                .enumerate()
                .map(|(k, p)| [p[0], p[1], 2.0 * f64::from(u8::from(k >= half))])
                .collect();
            for side in sides.split(' ') {
                let end = |k: usize| places[side[k..=k].parse::<usize>().unwrap()];
                let (a, b) = (end(0), end(1));
                places.push(std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
            }
            let grids: String = places
                .iter()
                .enumerate()
                .map(|(k, p)| format!("GRID,{},,{},{},{}\n", k + 1, p[0], p[1], p[2]))
                .collect();
            let numbers: Vec<String> = (1..=places.len()).map(|k| k.to_string()).collect();
            let (first, rest) = numbers.split_at(6);
            let lines: Vec<String> = rest.chunks(8).map(|l| format!(",{}", l.join(","))).collect();
            let text = format!("{grids}{name},9,1,{}\n{}\n", first.join(","), lines.join("\n"));
            let file = read(text.as_bytes()).unwrap();
            let cell = file.cells.iter().find(|c| c.of.dim == 3).unwrap();
            let kind = cell.of.kind().unwrap();
            for side in 0..kind.sides() {
                let face = kind.face(side).unwrap();
                let own: Vec<Point> =
                    kind.side(side).iter().map(|&l| file.nodes[cell.nodes[l]].1).collect();
                let count = face.corners();
                for k in 0..count {
                    let (a, b, middle) = (own[k], own[(k + 1) % count], own[count + k]);
                    assert!(
                        (0..3).all(|c| (a[c] + b[c] - 2.0 * middle[c]).abs() < 1e-12),
                        "{name} {side} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let node = "GRID,1,,0.,0.,0.\n";
        for (text, said) in [
            (format!("{node}CHEXA,1,1,1,1\n"), "has 2 nodes"),
            (format!("{node}CTETRA,1,1,1,2,3,4\n"), "grid point 2"),
            (format!("{node}CTETRA,1,1,1,1,1,1\n"), "twice"),
            ("GRID,1,4,0.,0.,0.\n".into(), "coordinates of its own"),
            ("GRID,1,,x,0.,0.\n".into(), "\"x\" is no coordinate"),
            (format!("{node}{node}"), "twice"),
            (format!("{node}RBE2,1,1,123456,2\n"), "RBE2 1: is no part of a mesh"),
            (node.into(), "has no elements"),
            (
                "GRID,1,,0.,0.,1.\nGRID,2,,1.,0.,1.\nGRID,3,,1.,1.,1.\nCTRIA3,1,1,1,2,3\n".into(),
                "is a shell",
            ),
            (format!("{node}SET1,1,THRU,5\nCTRIA3,1,1,1,1,1\n"), "twice"),
        ] {
            let found = read(text.as_bytes()).unwrap_err();
            assert!(found.message.contains(said), "{text}: {}", found.message);
        }
        for text in ["*NODE\n1, 0\n", "$MeshFormat\n4.1 0 8\n", "<?xml?>", "", "title = 1"] {
            assert!(!is_bulk(text.as_bytes()), "{text}");
        }
    }
}
