//! Decks of Abaqus and CalculiX (`.inp`): nodes, elements, sets and surfaces, as the [`File`] that a mesh of Gmsh gives.
//!
//! | keyword | becomes |
//! | --- | --- |
//! | `*NODE`, `*ELEMENT` | nodes and cells; node numbers stay |
//! | `*ELSET`, `ELSET=` of elements | groups of cells, for `[[material]] group` |
//! | `*NSET`, `NSET=` of nodes | groups of sides: the sides of the boundary all of whose nodes are in the set |
//! | `*SURFACE, TYPE=ELEMENT` | groups of sides |
//! | `*PART`, `*INSTANCE`, `*TIE` | one body: see [`super::assembly`] |
//!
//! Materials, supports and loads are those of the scene. What bears forces and is no element of a mesh (equations, springs, shells, beams) is refused by its
//! name; all else is passed over, everything from the first `*STEP` on too.

use std::collections::{HashMap, HashSet};

use super::assembly::{Assembly, Face, Instance, Member, Part, Tie, error};
use super::fortran::real;
use super::gmsh::{File, GmshError, types};
use super::listed::{Listed, ordered};
use super::{ElementKind, Point};

/// Keywords that change what the body does.
const MECHANICS: [&str; 19] = [
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
    "ORIENTATION",
    "PRE-TENSION SECTION",
    "CYCLIC SYMMETRY MODEL",
    "EMBEDDED ELEMENT",
];

/// Keywords whose lines of data may stand in a file of their own.
const WITH_INPUT: [&str; 6] = ["NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "TIE"];

/// Keywords that make or move nodes and elements.
const GENERATORS: [&str; 10] = [
    "SYSTEM",
    "NCOPY",
    "NFILL",
    "NGEN",
    "NMAP",
    "ELCOPY",
    "ELGEN",
    "ELEMENT MATRIX",
    "IMPERFECTION",
    "IMPORT",
];

/// Whether a text begins like a deck: with a keyword, behind comments.
pub fn is_deck(bytes: &[u8]) -> bool {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(20_000)]).into_owned();
    let first = start.lines().map(str::trim).find(|l| !l.is_empty() && !l.starts_with("**"));
    first.is_some_and(|l| {
        l.strip_prefix('*').is_some_and(|k| k.starts_with(|c: char| c.is_ascii_alphabetic()))
    })
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

/// What a keyword line takes from another file, `*INCLUDE, INPUT=…` or `*NODE, INPUT=…`: the file, and the line without it, if anything is left.
pub fn input_of(line: &str) -> Option<(String, Option<String>)> {
    let keyword = Keyword::parse(0, line);
    let file = keyword.get("INPUT").filter(|file| !file.is_empty())?.to_owned();
    if keyword.name == "INCLUDE" {
        return Some((file, None));
    }
    let others = keyword.parameters.iter().filter(|p| p.0 != "INPUT");
    let rest = others.fold(format!("*{}", keyword.name), |rest, (key, value)| match &value[..] {
        "" => format!("{rest}, {key}"),
        value => format!("{rest}, {key}={value}"),
    });
    WITH_INPUT.contains(&&keyword.name[..]).then_some((file, Some(rest)))
}

/// Whether a keyword line begins the first step, behind which nothing is read.
pub fn begins_step(line: &str) -> bool {
    Keyword::parse(0, line).name == "STEP"
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

/// Where lines belong.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Scope {
    /// To no part.
    #[default]
    Whole,
    Part(usize),
    Assembly,
    Instance(usize),
}

/// A deck that is being read.
#[derive(Debug, Default)]
struct Deck {
    all: Assembly,
    scope: Scope,
    /// Lines of data of the instance so far.
    lines: usize,
    /// Nothing but nodes and their sets is read.
    only_nodes: bool,
}

/// The nodes of a deck and their sets, whatever else it has.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// Numbers and places.
    pub nodes: Vec<(i64, Point)>,
    /// Names of sets, and the numbers of their nodes, ascending.
    pub sets: Vec<(String, Vec<i64>)>,
    /// Nodes in equations (`*EQUATION`, `*MPC`), ascending: matrices have some of their displacements in those of others.
    pub coupled: Vec<i64>,
}

/// Read the nodes of a deck alone: beside matrices, which know everything else.
pub fn places(bytes: &[u8]) -> Result<Places, GmshError> {
    let deck = parsed(bytes, true)?;
    let words = deck.coupled.clone();
    let all = deck.part()?;
    if all.nodes.is_empty() {
        return Err(error(0, "has no nodes", "give a deck with *NODE"));
    }
    let of_set = |(name, _): &(String, Vec<Member>)| {
        let mut numbers: Vec<i64> = all.node_sets.numbers(name).into_iter().collect();
        numbers.sort_unstable();
        (name.clone(), numbers)
    };
    let sets: Vec<(String, Vec<i64>)> = all.node_sets.0.iter().map(of_set).collect();
    let in_word = |word: &String| -> Vec<i64> {
        let set = || sets.iter().find(|s| s.0.eq_ignore_ascii_case(word)).map(|s| s.1.clone());
        word.parse().map_or_else(|_| set().unwrap_or_default(), |n| vec![n])
    };
    let mut coupled: Vec<i64> = words.iter().flat_map(in_word).collect();
    coupled.sort_unstable();
    coupled.dedup();
    Ok(Places { sets, nodes: all.nodes, coupled })
}

/// Read a deck.
pub fn read(bytes: &[u8]) -> Result<File, GmshError> {
    file(&parsed(bytes, false)?.part()?)
}

/// What a deck says up to its first step.
fn parsed(bytes: &[u8], only_nodes: bool) -> Result<Assembly, GmshError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| error(0, "is no text in UTF-8", "save the deck as plain text"))?;
    let mut deck = Deck { only_nodes, ..Deck::default() };
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
    Ok(deck.all)
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
        if name == "INCLUDE" {
            let help = "*INCLUDE, INPUT=file, relative to the deck";
            return Err(error(keyword.line, "*INCLUDE names no file that is read here", help));
        }
        if MECHANICS.contains(&name) && !self.only_nodes {
            let (what, help) = match name {
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
        let refuse = |what: String, help: &str| Err(error(keyword.line, what, help));
        if GENERATORS.contains(&name) {
            let help = "write the deck anew with all its nodes and elements";
            return refuse(format!("*{name} makes or moves nodes or elements"), help);
        }
        if let Some(key) = ["INPUT", "SYSTEM"].into_iter().find(|k| keyword.get(k).is_some())
            && WITH_INPUT.contains(&name)
        {
            let help = "write the deck anew with its nodes and elements in it, along x, y and z";
            return refuse(format!("*{name} with {key}= is not read"), help);
        }
        if self.only_nodes && ["EQUATION", "MPC"].contains(&name) && keyword.get("INPUT").is_some()
        {
            let help = "write its lines into the deck, or leave the deck out";
            return refuse(format!("*{name} with INPUT= is not read"), help);
        }
        // rows of matrices are then along these axes
        if self.only_nodes && name == "TRANSFORM" {
            let help = "leave the deck out, and name rows";
            return refuse("*TRANSFORM turns the directions of nodes".to_owned(), help);
        }
        if name == "TIE" && keyword.get("CYCLIC SYMMETRY").is_some() {
            return refuse("*TIE of cyclic symmetry is not read".to_owned(), "mesh the whole body");
        }
        match name {
            "PART" => {
                let name = keyword.get("NAME").unwrap_or_default().to_owned();
                self.scope = Scope::Part(self.all.parts.len());
                self.all.parts.push((name, Part::default()));
            }
            "ASSEMBLY" | "END INSTANCE" => self.scope = Scope::Assembly,
            "END PART" | "END ASSEMBLY" => self.scope = Scope::Whole,
            "INSTANCE" => self.instance(keyword)?,
            _ if self.only_nodes => {}
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
                    self.here().surfaces.push((name, vec![]));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// An instance begins: a copy of its part, which may have nodes of its own.
    fn instance(&mut self, keyword: &Keyword) -> Result<(), GmshError> {
        let name = keyword.get("NAME").unwrap_or_default().to_owned();
        let of = keyword.get("PART").unwrap_or_default();
        let found = self.all.parts.iter().find(|p| p.0.eq_ignore_ascii_case(of));
        let Some((_, part)) = found else {
            let message = format!("*INSTANCE of the part \"{of}\", which the deck does not have");
            return Err(error(keyword.line, message, "write the part before its instance"));
        };
        if self.all.instances.iter().any(|i| i.name.eq_ignore_ascii_case(&name)) {
            let message = format!("has two instances \"{name}\"");
            return Err(error(keyword.line, message, "give each a name of its own"));
        }
        let instance = Instance { name, part: part.clone(), ..Instance::default() };
        self.scope = Scope::Instance(self.all.instances.len());
        self.lines = 0;
        self.all.instances.push(instance);
        Ok(())
    }

    /// Whether a set is one of an instance that is there.
    fn check_instance(&self, line: usize, name: Option<&str>) -> Result<(), GmshError> {
        let is_it = |n: &str| self.all.instances.iter().any(|i| i.name.eq_ignore_ascii_case(n));
        match name.filter(|n| !is_it(n)) {
            None => Ok(()),
            Some(n) => {
                let message =
                    format!("a set is of the instance \"{n}\", which the deck does not have");
                Err(error(line, message, "write the deck anew"))
            }
        }
    }

    /// What lines belong to.
    fn here(&mut self) -> &mut Part {
        match self.scope {
            Scope::Part(k) => &mut self.all.parts[k].1,
            Scope::Instance(k) => &mut self.all.instances[k].part,
            Scope::Whole | Scope::Assembly => &mut self.all.whole,
        }
    }

    /// How an instance is moved, in its first line, and turned, in its second.
    fn placed(&mut self, k: usize, (line, words): (usize, &[&str])) -> Result<(), GmshError> {
        let numbers: Option<Vec<f64>> = words.iter().map(|w| real(w)).collect();
        let instance = &mut self.all.instances[k];
        self.lines += 1;
        match (self.lines, numbers.as_deref()) {
            (1, Some(&[x, y])) => instance.shift = [x, y, 0.0],
            (1, Some(&[x, y, z])) => instance.shift = [x, y, z],
            (2, Some(&[a, b, c, d, e, f, angle])) if [a, b, c] != [d, e, f] => {
                instance.turn = Some(([[a, b, c], [d, e, f]], angle));
            }
            _ => {
                let message =
                    "says no place of an instance: a translation, then an axis and an angle";
                return Err(error(line, message, "write the deck anew"));
            }
        }
        Ok(())
    }

    /// A member of a set: a number, or the name of a set. In an assembly it may be one of an instance, `Arm-1.12`.
    fn member(&self, word: &str, instance: Option<&str>) -> Member {
        let own = word.trim_matches('"');
        let named =
            |name: &str| self.all.instances.iter().position(|i| i.name.eq_ignore_ascii_case(name));
        match (own.parse(), own.rsplit_once('.'), instance.and_then(named)) {
            (Ok(n), _, Some(k)) => Member::In(k, n),
            (Ok(n), _, None) => Member::Number(n),
            (Err(_), Some((of, n)), _) if n.parse::<i64>().is_ok() => {
                let n = n.parse().unwrap_or_default();
                named(of).map_or(Member::Number(n), |k| Member::In(k, n))
            }
            (Err(_), _, Some(k)) => Member::Set(format!("{}.{own}", self.all.instances[k].name)),
            (Err(_), ..) => Member::Set(own.to_owned()),
        }
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
        let of_nodes = matches!(keyword.name.as_str(), "NODE" | "NSET" | "INSTANCE");
        // node, direction, factor, behind their number; a kind and nodes
        let name = |w: &str| w.trim_matches('"').to_owned();
        match &keyword.name[..] {
            "EQUATION" if self.only_nodes && words.len() > 2 => {
                self.all.coupled.extend(words.chunks(3).map(|term| name(term[0])));
            }
            "MPC" if self.only_nodes => self.all.coupled.extend(words[1..].iter().map(|w| name(w))),
            _ => {}
        }
        if self.only_nodes && !of_nodes {
            return Ok(());
        }
        match (keyword.name.as_str(), self.scope) {
            ("INSTANCE", Scope::Instance(k)) => self.placed(k, (line, &words))?,
            // points of reference
            ("NODE", Scope::Assembly) => {}
            ("NODE", _) => {
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
                let part = self.here();
                if part.place.insert(tag, part.nodes.len()).is_some() {
                    return Err(error(
                        line,
                        format!("node {tag} stands there twice"),
                        "number nodes once",
                    ));
                }
                part.nodes.push((tag, place));
                if let Some(set) = keyword.get("NSET") {
                    part.node_sets.add(set, [Member::Number(tag)]);
                }
            }
            ("ELEMENT", _) => {
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
                let part = self.here();
                let place = |n: &i64| {
                    part.place.get(n).copied().ok_or_else(|| {
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
                part.elements.push((tag, kind, ordered(kind, &nodes)));
                if let Some(set) = keyword.get("ELSET") {
                    part.element_sets.add(set, [Member::Number(tag)]);
                }
            }
            ("NSET" | "ELSET", _) => {
                let instance = keyword.get("INSTANCE");
                self.check_instance(line, instance)?;
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
                        members.push(self.member(&n.to_string(), instance));
                        n += step;
                    }
                } else {
                    members.extend(words.iter().map(|w| self.member(w, instance)));
                }
                match keyword.name.as_str() {
                    "NSET" => self.here().node_sets.add(&name, members),
                    _ => self.here().element_sets.add(&name, members),
                }
            }
            ("SURFACE", _) => {
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
                let member = self.member(words[0], keyword.get("INSTANCE"));
                if let Some((_, of)) = self.here().surfaces.last_mut() {
                    of.push((line, member, face));
                }
            }
            ("TIE", _) => {
                let [slave, master] = words[..] else {
                    let message = "*TIE names two surfaces, the slave and the master";
                    return Err(error(line, message, "write the deck anew"));
                };
                let [slave, master] = [slave, master].map(|w| w.trim_matches('"').to_owned());
                let tolerance = keyword.get("POSITION TOLERANCE").and_then(real);
                let moves = !keyword.get("ADJUST").is_some_and(|a| a.eq_ignore_ascii_case("no"));
                self.all.ties.push(Tie { line, slave, master, tolerance, moves });
            }
            _ => {}
        }
        Ok(())
    }
}

/// The mesh with its groups.
fn file(part: &Part) -> Result<File, GmshError> {
    if part.elements.is_empty() {
        return Err(error(0, "has no elements", "give a deck with *NODE and *ELEMENT"));
    }
    let place_of: HashMap<i64, usize> =
        part.elements.iter().enumerate().map(|(k, e)| (e.0, k)).collect();
    if place_of.len() < part.elements.len() {
        return Err(error(0, "numbers an element twice", "number elements once"));
    }
    let of_cells = |(name, _): &(String, Vec<Member>)| {
        let members = part.element_sets.numbers(name);
        (name.clone(), members.iter().filter_map(|n| place_of.get(n).copied()).collect())
    };
    let of_nodes = |(name, _): &(String, Vec<Member>)| {
        let numbers = part.node_sets.numbers(name);
        (name.clone(), numbers.iter().filter_map(|n| part.place.get(n).copied()).collect())
    };
    let sides = |(name, faces): &(String, Vec<Face>)| {
        Ok::<_, GmshError>((name.clone(), part.sides(name, faces)?))
    };
    let cell = |(tag, kind, nodes): &(i64, ElementKind, Vec<usize>)| {
        let of = types().find(|t| t.number == kind.gmsh().0)?;
        Some((*tag, of, nodes.clone()))
    };
    let listed = Listed {
        version: "deck".to_owned(),
        nodes: part.nodes.clone(),
        cells: part.elements.iter().filter_map(cell).collect(),
        cell_sets: part.element_sets.0.iter().map(of_cells).collect(),
        node_sets: part.node_sets.0.iter().map(of_nodes).collect(),
        surfaces: part.surfaces.iter().map(sides).collect::<Result<_, _>>()?,
    };
    Ok(listed.file())
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
            ("*Heading", "*Include", "*INCLUDE names"),
            ("2, 1., 0.", "2, 1., x", "no coordinate"),
            ("2, 1., 0.", "1, 1., 0.", "twice"),
            ("*Heading", "*PART, NAME=A\n*PART, NAME=B", "has 2 parts"),
            ("*Heading", "*INSTANCE, NAME=A-1, PART=A", "does not have"),
            ("*STEP", "*TIE, NAME=t\nnose", "two surfaces"),
            ("*STEP", "*TIE, NAME=t, CYCLIC SYMMETRY\nnose, nose", "cyclic"),
            ("*Heading", "*SYSTEM\n0,0,0,0,1,0", "makes or moves"),
            ("*Node, nset=ALL", "*Node, nset=ALL, INPUT=a.txt", "INPUT="),
            ("*NSET, NSET=wall", "*NSET, NSET=wall, INSTANCE=A-1", "\"A-1\""),
            ("*STEP", "*TIE, NAME=t\nnose, tip", "\"tip\""),
        ] {
            let said = read(SQUARE.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(said.contains(words), "{from}: {said}");
        }
        // lines of commas alone say nothing
        let odd = SQUARE.replacen("*STEP", ",\n*NODE\n,,\n*SURFACE, NAME=x\n,\n*STEP", 1);
        assert!(read(odd.as_bytes()).is_ok());
        assert!(read(b"*NODE\n1, 0, 0\n").unwrap_err().to_string().contains("no elements"));
    }

    #[test]
    fn nodes_are_read_beside_what_is_no_mesh() {
        let text = SQUARE.replacen("*Heading", "*EQUATION\n2\n1,1,1.,2,1,-1.\n*Heading", 1);
        let text = text.replacen("CPS4R", "S4R", 1);
        let found = places(text.as_bytes()).unwrap();
        assert_eq!(found.nodes.len(), 6);
        assert_eq!(found.nodes[5], (6, [2.0, 1.0, 0.0]));
        let all = ("ALL".to_owned(), vec![1, 2, 3, 4, 5, 6]);
        assert_eq!(found.sets, [all, ("wall".to_owned(), vec![1, 4])]);
        assert!(places(b"*HEADING\n").unwrap_err().to_string().contains("no nodes"));
        let turned = text.replacen("*Heading", "*TRANSFORM, NSET=ALL\n0,1,0,-1,0,0\n*Heading", 1);
        assert!(
            places(turned.as_bytes()).unwrap_err().to_string().contains("turns the directions")
        );
    }
}
