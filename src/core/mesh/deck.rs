//! Decks of Abaqus and CalculiX (`.inp`): nodes, elements, sets and surfaces, as the [`File`] that a mesh of Gmsh gives.
//!
//! | keyword | becomes |
//! | --- | --- |
//! | `*NODE`, `*ELEMENT` | nodes and cells; node numbers stay |
//! | `*ELSET`, `ELSET=` of elements | groups of cells, for `[[material]] group` |
//! | `*NSET`, `NSET=` of nodes | groups of sides: the sides of the boundary all of whose nodes are in the set |
//! | `*SURFACE, TYPE=ELEMENT` | groups of sides |
//!
//! Materials, supports and loads are those of the scene. What bears forces and is no element of a mesh (ties, equations, springs, shells, beams) is refused by its
//! name; all else is passed over, everything from the first `*STEP` on too.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::fortran::real;
use super::gmsh::{Cell, File, GmshError, Type, types};
use super::{ElementKind, Point};

/// Keywords that change what the body does.
const MECHANICS: [&str; 21] = [
    "EQUATION",
    "MPC",
    "RIGID BODY",
    "COUPLING",
    "KINEMATIC",
    "DISTRIBUTING",
    "DISTRIBUTING COUPLING",
    "SPRING",
    "DASHPOT",
    "MASS",
    "ROTARY INERTIA",
    "CONNECTOR SECTION",
    "SHELL SECTION",
    "BEAM SECTION",
    "MEMBRANE SECTION",
    "TIE",
    "ORIENTATION",
    "PRE-TENSION SECTION",
    "CYCLIC SYMMETRY MODEL",
    "EMBEDDED ELEMENT",
    "INCLUDE",
];

/// Whether a text begins like a deck: with a keyword, behind comments.
pub fn is_deck(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(20_000)]).into_owned();
    let first = start.lines().map(str::trim).find(|l| !l.is_empty() && !l.starts_with("**"));
    first.is_some_and(|l| {
        l.strip_prefix('*').is_some_and(|k| k.starts_with(|c: char| c.is_ascii_alphabetic()))
    })
}

fn error(line: usize, message: impl Into<String>, help: &str) -> GmshError {
    GmshError { line, section: String::new(), message: message.into(), help: help.into() }
}

/// A keyword line with its parameters.
#[derive(Debug, Clone, Default)]
struct Keyword {
    line: usize,
    name: String,
    parameters: Vec<(String, String)>,
}

impl Keyword {
    /// `*ELEMENT, TYPE=C3D8, ELSET=BODY`
    fn parse(line: usize, text: &str) -> Keyword {
        let mut parts = text.trim_start_matches('*').split(',');
        let name: Vec<&str> = parts.next().unwrap_or_default().split_whitespace().collect();
        let parameter = |p: &str| {
            let (key, value) = p.split_once('=').unwrap_or((p, ""));
            let value = value.trim().trim_matches('"').to_owned();
            (key.trim().to_ascii_uppercase(), value)
        };
        Keyword {
            line,
            name: name.join(" ").to_ascii_uppercase(),
            parameters: parts.map(parameter).filter(|p| !p.0.is_empty()).collect(),
        }
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|p| p.0 == key).map(|p| p.1.as_str())
    }
}

/// The kind of an element type, if it is one of a mesh: `C3D20R`, `CPS4`, `CAX8`.
fn kind_of(name: &str) -> Option<ElementKind> {
    let (family, rest) =
        ["C3D", "CPS", "CPE", "CAX"].into_iter().find_map(|f| Some((f, name.strip_prefix(f)?)))?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    // integration, hybrid, incompatible, modified: the nodes are those of the full element
    if !rest[digits.len()..].chars().all(|c| "RIHMSE".contains(c)) {
        return None;
    }
    let dim = if family == "C3D" { 3 } else { 2 };
    let nodes: usize = digits.parse().ok()?;
    use ElementKind::{Hex8, Hex20, Prism6, Prism15, Quad4, Quad8, Tet4, Tet10, Tri3, Tri6};
    Some(match (dim, nodes) {
        (2, 3) => Tri3,
        (2, 4) => Quad4,
        (2, 6) => Tri6,
        (2, 8) => Quad8,
        (3, 4) => Tet4,
        (3, 10) => Tet10,
        (3, 8) => Hex8,
        (3, 20) => Hex20,
        (3, 6) => Prism6,
        (3, 15) => Prism15,
        _ => return None,
    })
}

/// Nodes of a deck's element in the order of this program: decks have the order of VTK.
fn ordered(kind: ElementKind, own: &[usize]) -> Vec<usize> {
    let places: Vec<usize> = (0..kind.nodes()).collect();
    let mut nodes = vec![0; kind.nodes()];
    for (of_deck, place) in kind.ordered(&places).into_iter().enumerate() {
        nodes[place as usize] = own[of_deck];
    }
    nodes
}

/// Corners of the faces that decks call S1, S2, …, from 1.
fn faces(kind: ElementKind) -> &'static [&'static [usize]] {
    match (kind.dim(), kind.corners()) {
        (2, 3) => &[&[1, 2], &[2, 3], &[3, 1]],
        (2, _) => &[&[1, 2], &[2, 3], &[3, 4], &[4, 1]],
        (_, 4) => &[&[1, 2, 3], &[1, 4, 2], &[2, 4, 3], &[3, 4, 1]],
        (_, 6) => &[&[1, 2, 3], &[4, 6, 5], &[1, 2, 5, 4], &[2, 3, 6, 5], &[3, 1, 4, 6]],
        _ => &[
            &[1, 2, 3, 4],
            &[5, 8, 7, 6],
            &[1, 5, 6, 2],
            &[2, 6, 7, 3],
            &[3, 7, 8, 4],
            &[4, 8, 5, 1],
        ],
    }
}

/// A member of a set: a number or another set.
#[derive(Debug, Clone)]
enum Member {
    Number(i64),
    Set(String),
}

/// A face of a surface: its line, an element or set, the number behind S.
type Face = (usize, Member, usize);

/// Sets by name, in the order in which they came.
#[derive(Debug, Default)]
struct Sets(Vec<(String, Vec<Member>)>);

impl Sets {
    fn add(&mut self, name: &str, members: impl IntoIterator<Item = Member>) {
        match self.0.iter_mut().find(|s| s.0.eq_ignore_ascii_case(name)) {
            Some(set) => set.1.extend(members),
            None => self.0.push((name.to_owned(), members.into_iter().collect())),
        }
    }

    /// All numbers of a set; sets within sets, each once.
    fn numbers(&self, name: &str) -> HashSet<i64> {
        let (mut found, mut open, mut known) =
            (HashSet::new(), vec![name.to_owned()], HashSet::new());
        while let Some(next) = open.pop() {
            if !known.insert(next.to_ascii_uppercase()) {
                continue;
            }
            for member in
                self.0.iter().filter(|s| s.0.eq_ignore_ascii_case(&next)).flat_map(|s| &s.1)
            {
                match member {
                    Member::Number(n) => {
                        found.insert(*n);
                    }
                    Member::Set(name) => open.push(name.clone()),
                }
            }
        }
        found
    }
}

/// What a deck says of the mesh.
#[derive(Debug, Default)]
struct Deck {
    nodes: Vec<(i64, Point)>,
    place: HashMap<i64, usize>,
    elements: Vec<(i64, ElementKind, Vec<usize>)>,
    node_sets: Sets,
    element_sets: Sets,
    /// Surfaces: element or set, and its face.
    surfaces: Vec<(String, Vec<Face>)>,
    parts: usize,
    instances: usize,
}

/// Read a deck.
pub fn read(bytes: &[u8]) -> Result<File, GmshError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| error(0, "is no text in UTF-8", "save the deck as plain text"))?;
    let mut deck = Deck::default();
    let mut keyword = Keyword::default();
    // an element, or a list, goes on while its line ends in a comma or it lacks nodes
    let mut element: Vec<i64> = vec![];
    let mut lines = text.lines().enumerate().peekable();
    while let Some((k, line)) = lines.next() {
        let (number, line) = (k + 1, line.trim());
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        if line.starts_with('*') {
            if !element.is_empty() {
                return Err(short(&keyword, element[0]));
            }
            let mut whole = line.to_owned();
            while whole.ends_with(',') {
                let Some((_, more)) = lines.next() else { break };
                whole += more.trim();
            }
            keyword = Keyword::parse(number, &whole);
            if keyword.name == "STEP" {
                break;
            }
            deck.begin(&keyword)?;
            continue;
        }
        deck.data(&keyword, (number, line), &mut element)?;
    }
    if !element.is_empty() {
        return Err(short(&keyword, element[0]));
    }
    deck.file()
}

fn short(keyword: &Keyword, element: i64) -> GmshError {
    let message = format!(
        "element {element} has too few nodes for {}",
        keyword.get("TYPE").unwrap_or("its type")
    );
    error(keyword.line, message, "write the deck anew: it is cut off")
}

impl Deck {
    fn begin(&mut self, keyword: &Keyword) -> Result<(), GmshError> {
        let name = keyword.name.as_str();
        if MECHANICS.contains(&name) {
            let (what, help) = match name {
                "INCLUDE" => ("names another file", "put its lines into the deck"),
                "SHELL SECTION" | "BEAM SECTION" | "MEMBRANE SECTION" => (
                    "is of elements that are no solid bodies",
                    "mesh the body in solid elements, or bring its matrices",
                ),
                _ => (
                    "couples nodes, or adds what is in no element",
                    "leave it out, or bring the matrices of this body",
                ),
            };
            return Err(error(keyword.line, format!("*{name} {what}"), help));
        }
        match name {
            "PART" => self.parts += 1,
            "INSTANCE" => self.instances += 1,
            "ELEMENT" => {
                let of = keyword.get("TYPE").unwrap_or_default().to_ascii_uppercase();
                if kind_of(&of).is_none() {
                    let message = format!("elements of type {of} are not read");
                    let help = "C3D4 C3D6 C3D8 C3D10 C3D15 C3D20, CPS, CPE and CAX of 3, 4, 6 and 8 nodes are, also with R, I, H, M behind";
                    return Err(error(keyword.line, message, help));
                }
            }
            "SURFACE" => {
                let of = keyword.get("TYPE").unwrap_or("ELEMENT").to_ascii_uppercase();
                let name = keyword.get("NAME").unwrap_or_default().to_owned();
                if of == "ELEMENT" {
                    self.surfaces.push((name, vec![]));
                }
            }
            _ => {}
        }
        if self.parts > 1 || self.instances > 1 {
            let message = "has several parts or instances";
            let help = "write it flat (Abaqus: \"Do not use parts and assemblies in input files\"), or each body in a deck of its own as [[body]]";
            return Err(error(keyword.line, message, help));
        }
        Ok(())
    }

    fn data(
        &mut self,
        keyword: &Keyword,
        (line, text): (usize, &str),
        element: &mut Vec<i64>,
    ) -> Result<(), GmshError> {
        let words: Vec<&str> = text.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        if words.is_empty() {
            return Ok(());
        }
        let whole = |w: &str| {
            w.parse::<i64>().map_err(|_| {
                error(
                    line,
                    format!("\"{w}\" is no number of a node or element"),
                    "write the deck anew",
                )
            })
        };
        match keyword.name.as_str() {
            "NODE" => {
                let tag = whole(words[0])?;
                let mut place = [0.0; 3];
                for (x, w) in place.iter_mut().zip(&words[1..]) {
                    *x = real(w).filter(|x| x.abs() < 1e100).ok_or_else(|| {
                        error(line, format!("\"{w}\" is no coordinate"), "write the deck anew")
                    })?;
                }
                if words.len() < 3 {
                    return Err(error(
                        line,
                        format!("node {tag} has no place"),
                        "write the deck anew",
                    ));
                }
                if self.place.insert(tag, self.nodes.len()).is_some() {
                    return Err(error(
                        line,
                        format!("node {tag} stands there twice"),
                        "number nodes once",
                    ));
                }
                self.nodes.push((tag, place));
                if let Some(set) = keyword.get("NSET") {
                    self.node_sets.add(set, [Member::Number(tag)]);
                }
            }
            "ELEMENT" => {
                let of = keyword.get("TYPE").unwrap_or_default().to_ascii_uppercase();
                let Some(kind) = kind_of(&of) else { return Ok(()) };
                for w in &words {
                    element.push(whole(w)?);
                }
                if element.len() < kind.nodes() + 1 {
                    return Ok(());
                }
                let own = std::mem::take(element);
                let (tag, nodes) = (own[0], &own[1..]);
                if nodes.len() > kind.nodes() {
                    let message = format!(
                        "element {tag} has {} nodes, and {of} {}",
                        nodes.len(),
                        kind.nodes()
                    );
                    return Err(error(line, message, "write the deck anew"));
                }
                let place = |n: &i64| {
                    self.place.get(n).copied().ok_or_else(|| {
                        error(
                            line,
                            format!("element {tag} has node {n}, which the deck does not have"),
                            "write *NODE before *ELEMENT",
                        )
                    })
                };
                let nodes: Vec<usize> = nodes.iter().map(place).collect::<Result<_, _>>()?;
                let distinct: HashSet<&usize> = nodes.iter().collect();
                if distinct.len() < nodes.len() {
                    let message = format!("element {tag} has a node twice: a degenerate {of}");
                    return Err(error(
                        line,
                        message,
                        "mesh it with wedges or tetrahedra in its place",
                    ));
                }
                self.elements.push((tag, kind, ordered(kind, &nodes)));
                if let Some(set) = keyword.get("ELSET") {
                    self.element_sets.add(set, [Member::Number(tag)]);
                }
            }
            "NSET" | "ELSET" => {
                let name = keyword.get(&keyword.name).unwrap_or_default().to_owned();
                let mut members: Vec<Member> = vec![];
                if keyword.parameters.iter().any(|p| p.0 == "GENERATE") {
                    let numbers: Vec<i64> =
                        words.iter().map(|w| whole(w)).collect::<Result<_, _>>()?;
                    let (first, last, step) = match numbers[..] {
                        [a, b] => (a, b, 1),
                        [a, b, s] if s > 0 => (a, b, s),
                        _ => {
                            return Err(error(
                                line,
                                "GENERATE has no first, last and step",
                                "write the deck anew",
                            ));
                        }
                    };
                    if last.saturating_sub(first) / step > 100_000_000 {
                        return Err(error(
                            line,
                            "GENERATE makes more members than can be held",
                            "write the deck anew",
                        ));
                    }
                    let mut n = first;
                    while n <= last {
                        members.push(Member::Number(n));
                        n += step;
                    }
                } else {
                    members.extend(words.iter().map(|w| member(w)));
                }
                match keyword.name.as_str() {
                    "NSET" => self.node_sets.add(&name, members),
                    _ => self.element_sets.add(&name, members),
                }
            }
            "SURFACE" => {
                let Some((_, of)) = self.surfaces.last_mut() else { return Ok(()) };
                if keyword.get("TYPE").is_some_and(|t| !t.eq_ignore_ascii_case("ELEMENT")) {
                    return Ok(());
                }
                let face = words
                    .get(1)
                    .and_then(|w| w.trim_start_matches(['S', 's']).parse::<usize>().ok());
                let Some(face) = face.filter(|f| (1..=6).contains(f)) else {
                    let message = format!("\"{text}\" is no element or set with a face S1 to S6");
                    return Err(error(line, message, "give the faces of the surface"));
                };
                of.push((line, member(words[0]), face));
            }
            _ => {}
        }
        Ok(())
    }

    /// The mesh with its groups.
    fn file(self) -> Result<File, GmshError> {
        if self.elements.is_empty() {
            return Err(error(0, "has no elements", "give a deck with *NODE and *ELEMENT"));
        }
        let dim = self.elements.iter().map(|e| e.1.dim()).max().unwrap_or(2);
        let type_of =
            |kind: ElementKind| -> Option<Type> { types().find(|t| t.number == kind.gmsh().0) };
        let mut names = BTreeMap::new();
        let mut cells: Vec<Cell> = vec![];
        let place_of: HashMap<i64, usize> =
            self.elements.iter().enumerate().map(|(k, e)| (e.0, k)).collect();
        if place_of.len() < self.elements.len() {
            return Err(error(0, "numbers an element twice", "number elements once"));
        }
        for (tag, kind, nodes) in &self.elements {
            let Some(of) = type_of(*kind) else { continue };
            cells.push(Cell { tag: *tag, of, groups: vec![], nodes: nodes.clone() });
        }
        let mut next = 1;
        for (name, _) in &self.element_sets.0 {
            let members = self.element_sets.numbers(name);
            let own: Vec<usize> = members.iter().filter_map(|n| place_of.get(n).copied()).collect();
            own.iter().for_each(|&k| cells[k].groups.push(next));
            names.insert((dim, next), name.clone());
            next += 1;
        }
        // sides of the boundary, by their corners
        let mut owners: HashMap<Vec<usize>, Vec<(usize, usize)>> = HashMap::new();
        let corners = |(element, side): (usize, usize)| -> Vec<usize> {
            let (_, kind, nodes) = &self.elements[element];
            let count = kind.linear().side(side).len();
            let mut own: Vec<usize> = kind.side(side)[..count].iter().map(|&l| nodes[l]).collect();
            own.sort_unstable();
            own
        };
        let full = |e: &usize| self.elements[*e].1.dim() == dim;
        for element in (0..self.elements.len()).filter(full) {
            for side in 0..self.elements[element].1.sides() {
                owners.entry(corners((element, side))).or_default().push((element, side));
            }
        }
        let mut boundary: Vec<(usize, usize)> =
            owners.values().filter(|o| o.len() == 1).map(|o| o[0]).collect();
        boundary.sort_unstable();
        let mut groups: Vec<(String, Vec<(usize, usize)>)> = vec![];
        for (name, _) in &self.node_sets.0 {
            let set: HashSet<usize> = self
                .node_sets
                .numbers(name)
                .iter()
                .filter_map(|n| self.place.get(n).copied())
                .collect();
            let is_in = |&(element, side): &(usize, usize)| {
                let (_, kind, nodes) = &self.elements[element];
                kind.side(side).iter().all(|&l| set.contains(&nodes[l]))
            };
            groups.push((name.clone(), boundary.iter().copied().filter(is_in).collect()));
        }
        for (name, members) in &self.surfaces {
            let mut own = vec![];
            for (line, member, face) in members {
                let elements: Vec<i64> = match member {
                    Member::Number(n) => vec![*n],
                    Member::Set(set) => {
                        let mut all: Vec<i64> =
                            self.element_sets.numbers(set).into_iter().collect();
                        all.sort_unstable();
                        all
                    }
                };
                for n in elements {
                    let Some(&element) = place_of.get(&n) else {
                        return Err(error(
                            *line,
                            format!(
                                "surface \"{name}\" names element {n}, which the deck does not have"
                            ),
                            "write the deck anew",
                        ));
                    };
                    let (_, kind, nodes) = &self.elements[element];
                    let Some(of_face) = faces(*kind).get(face - 1) else {
                        return Err(error(
                            *line,
                            format!("element {n} has no face S{face}"),
                            "write the deck anew",
                        ));
                    };
                    let mut wanted: Vec<usize> = of_face.iter().map(|&c| nodes[c - 1]).collect();
                    wanted.sort_unstable();
                    let side = (0..kind.sides()).find(|&side| corners((element, side)) == wanted);
                    own.extend(side.map(|side| (element, side)));
                }
            }
            groups.push((name.clone(), own));
        }
        let mut tag = self.elements.iter().map(|e| e.0).max().unwrap_or(0);
        let mut line_types = types().filter(|t| t.dim == 1 && (2..=3).contains(&t.nodes));
        let lines: Vec<Type> = line_types.by_ref().collect();
        for (name, sides) in groups {
            // a name that sets and surfaces share is that of the surface
            names.retain(|key, own| *own != name || key.0 == dim);
            for (element, side) in sides {
                let (_, kind, nodes) = &self.elements[element];
                let own: Vec<usize> = kind.side(side).iter().map(|&l| nodes[l]).collect();
                let of = match kind.face(side) {
                    Some(face) => type_of(face),
                    None => lines.iter().copied().find(|t| t.nodes == own.len()),
                };
                let Some(of) = of else { continue };
                tag += 1;
                cells.push(Cell { tag, of, groups: vec![next], nodes: own });
            }
            names.insert((dim - 1, next), name);
            next += 1;
        }
        let version = "deck".to_owned();
        Ok(File { version, nodes: self.nodes, cells, names })
    }
}

/// A number, or the name of a set; of one instance its name before the point is left out.
fn member(word: &str) -> Member {
    let own = word.trim_matches('"');
    match own.parse() {
        Ok(n) => Member::Number(n),
        Err(_) => match own.rsplit_once('.').and_then(|(_, n)| n.parse().ok()) {
            Some(n) => Member::Number(n),
            None => Member::Set(own.to_owned()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "** two squares\n*Heading\n a title\n*Node, nset=ALL\n1, 0., 0.\n2, 1., 0.\n3, 2., 0.\n4, 0., 1.\n5, 1., 1.\n6, 2.,1.0D0\n\
*Element, type=CPS4R,\n elset=\"left half\"\n1, 1, 2,\n5, 4\n*ELEMENT, TYPE=CPS4, ELSET=RIGHT\n2, 2, 3, 6, 5\n*ELSET, ELSET=BODY\nleft half, RIGHT\n\
*NSET, NSET=wall, GENERATE\n1, 4, 3\n*SURFACE, NAME=nose, TYPE=ELEMENT\nRIGHT, S2\n*STEP\n*CLOAD\n3, 1, 5.\n";

    #[test]
    fn sets_and_surfaces_become_groups() {
        let file = read(SQUARE.as_bytes()).unwrap();
        assert!(is_deck(SQUARE.as_bytes()) && !is_deck(b"$MeshFormat\n"));
        let groups: Vec<(usize, String, usize)> =
            file.groups().into_iter().map(|(d, _, name, n)| (d, name, n)).collect();
        for wanted in [
            (2, "left half", 1),
            (2, "RIGHT", 1),
            (2, "BODY", 2),
            (1, "ALL", 6),
            (1, "wall", 1),
            (1, "nose", 1),
        ] {
            assert!(
                groups.contains(&(wanted.0, wanted.1.to_owned(), wanted.2)),
                "{wanted:?} {groups:?}"
            );
        }
        let mesh = file.body(1.0, &[]).unwrap().mesh;
        assert_eq!((mesh.n_nodes(), mesh.n_elements(), mesh.dim()), (6, 2, 2));
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        for (from, to, words) in [
            ("CPS4R", "S4", "type S4"),
            ("1, 1, 2,\n5, 4", "1, 1, 2,", "too few nodes"),
            ("2, 2, 3, 6, 5", "2, 2, 3, 6, 9", "node 9"),
            ("2, 2, 3, 6, 5", "2, 2, 3, 6, 6", "degenerate"),
            ("2, 2, 3, 6, 5", "2, 2, 3, 6, 5, 4", "has 5 nodes"),
            ("RIGHT, S2", "RIGHT, SPOS", "no element or set"),
            ("RIGHT, S2", "7, S2", "element 7"),
            ("RIGHT, S2", "RIGHT, S5", "no face S5"),
            ("*Heading", "*EQUATION", "*EQUATION couples"),
            ("*Heading", "*Include, input=a.inp", "*INCLUDE names"),
            ("2, 1., 0.", "2, 1., x", "no coordinate"),
            ("2, 1., 0.", "1, 1., 0.", "twice"),
            ("*Heading", "*PART, NAME=A\n*PART, NAME=B", "several parts"),
        ] {
            let said = read(SQUARE.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(said.contains(words), "{from}: {said}");
        }
        // lines of commas alone say nothing
        let odd = SQUARE.replacen("*STEP", ",\n*NODE\n,,\n*SURFACE, NAME=x\n,\n*STEP", 1);
        assert!(read(odd.as_bytes()).is_ok());
        assert!(read(b"*NODE\n1, 0, 0\n").unwrap_err().to_string().contains("no elements"));
    }
}
