//! The sections of a file.

use std::collections::{BTreeMap, HashMap};

use super::{Cell, File, GmshError, Type, types};

/// Most nodes and elements that are believed before they are read.
const MOST: usize = 100_000_000;
/// Coordinates beyond this are not.
const LARGEST: f64 = 1e100;

/// Physical tags of the entities by dimension and tag.
type Entities = HashMap<(usize, i64), Vec<i64>>;

/// Words of a section with their lines.
struct Words<'t> {
    section: &'t str,
    words: Vec<(usize, &'t str)>,
    next: usize,
    /// Line of the section's end.
    end: usize,
}

impl<'t> Words<'t> {
    fn fail<T>(&self, message: impl Into<String>, help: impl Into<String>) -> Result<T, GmshError> {
        let line = self.words.get(self.next.saturating_sub(1)).map_or(self.end, |w| w.0);
        let section = self.section.to_owned();
        Err(GmshError { line, section, message: message.into(), help: help.into() })
    }

    fn word(&mut self, what: &str) -> Result<&'t str, GmshError> {
        match self.words.get(self.next) {
            Some((_, word)) => {
                self.next += 1;
                Ok(word)
            }
            None => {
                self.next = self.words.len() + 1;
                self.fail(
                    format!("ends where {what} is expected"),
                    "save the mesh anew: it is cut off",
                )
            }
        }
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, GmshError> {
        let word = self.word(what)?;
        match word.parse() {
            Ok(number) => Ok(number),
            Err(_) => {
                let shown: String = word.chars().take(40).collect();
                self.fail(
                    format!("\"{shown}\" where {what} is expected"),
                    "save the mesh anew as ASCII",
                )
            }
        }
    }

    fn count(&mut self, what: &str) -> Result<usize, GmshError> {
        let n: usize = self.number(what)?;
        match n <= MOST {
            true => Ok(n),
            false => self.fail(format!("{n} is more than can be held"), "give a smaller mesh"),
        }
    }

    fn coordinate(&mut self) -> Result<f64, GmshError> {
        let x: f64 = self.number("a coordinate")?;
        match x.abs() <= LARGEST {
            true => Ok(x),
            false => self.fail(format!("the coordinate {x} is none"), "mesh the body anew"),
        }
    }

    /// What is left behind the last number that was announced is a sign that a count is wrong.
    fn done(&mut self) -> Result<(), GmshError> {
        match self.words.get(self.next) {
            None => Ok(()),
            Some((_, word)) => {
                self.next += 1;
                let shown: String = word.chars().take(40).collect();
                self.fail(
                    format!("goes on with \"{shown}\" behind what it announces"),
                    "a count is wrong: save the mesh anew",
                )
            }
        }
    }
}

/// Read a mesh.
pub fn read(bytes: &[u8]) -> Result<File, GmshError> {
    let convert = "convert it: gmsh FILE -save -format msh41 -o ascii.msh";
    let Some(head) = bytes.get(..11) else {
        return Err(GmshError::of_file("is no mesh of Gmsh: it is empty, or nearly", convert));
    };
    if head != b"$MeshFormat" {
        let message = "is no mesh of Gmsh: it does not begin with $MeshFormat";
        let help = "other formats (.inp, .unv, .med, .stl) are converted by gmsh IN -save -format msh41 -o out.msh; check that sets became physical groups";
        return Err(GmshError::of_file(message, help));
    }
    let text = String::from_utf8_lossy(bytes);
    // before anything else is looked at: what follows may be binary
    let line = text.lines().nth(1).unwrap_or_default();
    let words = line.split_ascii_whitespace().map(|w| (2, w)).collect();
    let mut format = Words { section: "MeshFormat", words, next: 0, end: 2 };
    let version: String = format.word("the version")?.to_owned();
    let kind: usize = format.number("0 for ASCII")?;
    if kind != 0 {
        return format.fail("is binary", convert);
    }
    if version != "4.1" && version != "2.2" {
        let message = format!("is of version {version}: 4.1 and 2.2 are read");
        return format.fail(message, convert);
    }
    let mut sections = sections(&text)?;
    let mut take = |name: &str| sections.remove(name);
    let names = take("PhysicalNames").map_or(Ok(BTreeMap::new()), physical_names)?;
    let missing = |name: &str| {
        let help = "save the mesh, not only the geometry";
        GmshError::of_file(format!("there is no section ${name}"), help)
    };
    let nodes = take("Nodes").ok_or_else(|| missing("Nodes"))?;
    let elements = take("Elements").ok_or_else(|| missing("Elements"))?;
    let entities = match take("Entities") {
        Some(words) if version == "4.1" => entities(words)?,
        _ => Entities::new(),
    };
    let nodes = if version == "4.1" { nodes_41(nodes)? } else { nodes_22(nodes)? };
    let mut places: HashMap<i64, usize> = HashMap::with_capacity(nodes.len());
    for (k, (tag, _)) in nodes.iter().enumerate() {
        if places.insert(*tag, k).is_some() {
            return Err(GmshError::of_file(
                format!("node {tag} is there twice"),
                "save the mesh anew",
            ));
        }
    }
    let cells = match version == "4.1" {
        true => elements_41(elements, &entities, &places)?,
        false => elements_22(elements, &places)?,
    };
    Ok(File { version, nodes, cells, names })
}

/// The words of each section; of several with one name the first counts.
fn sections(text: &str) -> Result<HashMap<&str, Words<'_>>, GmshError> {
    let mut all: HashMap<&str, Words> = HashMap::new();
    let mut open: Option<Words> = None;
    let mut last = 0;
    for (k, line) in text.lines().enumerate() {
        last = k + 1;
        let line = line.trim();
        match (line.strip_prefix('$'), &mut open) {
            (Some(name), Some(words)) if name.strip_prefix("End") == Some(words.section) => {
                words.end = k + 1;
                if let Some(words) = open.take() {
                    all.entry(words.section).or_insert(words);
                }
            }
            (Some(name), None) => {
                open = Some(Words { section: name, words: vec![], next: 0, end: k + 1 });
            }
            (Some(name), Some(words)) if words.section != "PhysicalNames" => {
                let message = format!("${name} before $End{}", words.section);
                let (section, help) = (
                    words.section.to_owned(),
                    "the file is cut off or mixed up: save it anew".into(),
                );
                return Err(GmshError { line: k + 1, section, message, help });
            }
            // names may hold spaces: the whole line
            (_, Some(words)) if words.section == "PhysicalNames" => words.words.push((k + 1, line)),
            (_, Some(words)) => {
                words.words.extend(line.split_ascii_whitespace().map(|w| (k + 1, w)))
            }
            (None, None) => {}
        }
    }
    match open {
        None => Ok(all),
        Some(words) => Err(GmshError {
            line: last,
            section: words.section.to_owned(),
            message: "does not end".into(),
            help: "the file is cut off: save it anew".into(),
        }),
    }
}

/// `dim tag "name"`, a line each.
fn physical_names(mut lines: Words) -> Result<BTreeMap<(usize, i64), String>, GmshError> {
    let count: usize = lines.count("the number of names")?;
    let mut names = BTreeMap::new();
    for _ in 0..count {
        let line = lines.word("a name")?;
        let mut parts = line.splitn(3, char::is_whitespace);
        let dim = parts.next().and_then(|d| d.parse().ok());
        let tag = parts.next().and_then(|t| t.parse().ok());
        let name = parts.next().map(str::trim).and_then(|n| n.strip_prefix('"')?.strip_suffix('"'));
        let (Some(dim), Some(tag), Some(name)) = (dim, tag, name) else {
            return lines
                .fail("is no dimension, tag and name in quotation marks", "save the mesh anew");
        };
        names.insert((dim, tag), name.to_owned());
    }
    lines.done()?;
    Ok(names)
}

fn entities(mut words: Words) -> Result<Entities, GmshError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = words.count("a number of entities")?;
    }
    let mut all = Entities::new();
    for (dim, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag: i64 = words.number("the tag of an entity")?;
            for _ in 0..if dim == 0 { 3 } else { 6 } {
                words.coordinate()?;
            }
            let n = words.count("a number of physical groups")?;
            let mut groups: Vec<i64> = vec![];
            for _ in 0..n {
                // a sign tells the orientation
                groups.push(words.number::<i64>("a physical group")?.abs());
            }
            if dim > 0 {
                let n = words.count("a number of boundaries")?;
                for _ in 0..n {
                    words.number::<i64>("a boundary")?;
                }
            }
            all.insert((dim, tag), groups);
        }
    }
    words.done()?;
    Ok(all)
}

type Nodes = Vec<(i64, [f64; 3])>;

fn nodes_41(mut words: Words) -> Result<Nodes, GmshError> {
    let blocks = words.count("a number of blocks")?;
    let count = words.count("a number of nodes")?;
    words.number::<i64>("the least tag")?;
    words.number::<i64>("the largest tag")?;
    let mut nodes: Nodes = vec![];
    for _ in 0..blocks {
        let dim: usize = words.number("a dimension")?;
        words.number::<i64>("the tag of an entity")?;
        let parametric: usize = words.number("0 or 1")?;
        let n = words.count("a number of nodes")?;
        let mut tags: Vec<i64> = vec![];
        for _ in 0..n {
            tags.push(words.number("the tag of a node")?);
        }
        for tag in tags {
            let place = [words.coordinate()?, words.coordinate()?, words.coordinate()?];
            for _ in 0..if parametric == 1 { dim } else { 0 } {
                words.coordinate()?;
            }
            nodes.push((tag, place));
        }
    }
    words.done()?;
    announced(&words, "nodes", count, nodes.len())?;
    Ok(nodes)
}

fn nodes_22(mut words: Words) -> Result<Nodes, GmshError> {
    let count = words.count("a number of nodes")?;
    let mut nodes: Nodes = vec![];
    for _ in 0..count {
        let tag = words.number("the tag of a node")?;
        nodes.push((tag, [words.coordinate()?, words.coordinate()?, words.coordinate()?]));
    }
    words.done()?;
    Ok(nodes)
}

fn announced(words: &Words, what: &str, said: usize, found: usize) -> Result<(), GmshError> {
    match said == found {
        true => Ok(()),
        false => words
            .fail(format!("{said} {what} are announced, {found} are there"), "save the mesh anew"),
    }
}

fn of_number(words: &Words, number: usize) -> Result<Type, GmshError> {
    match types().find(|t| t.number == number) {
        Some(t) => Ok(t),
        None => {
            let help = "mesh with elements of first or second order";
            words.fail(format!("elements of type {number} are not known"), help)
        }
    }
}

fn cell(
    words: &mut Words,
    of: Type,
    (tag, groups): (i64, Vec<i64>),
    places: &HashMap<i64, usize>,
) -> Result<Cell, GmshError> {
    let mut nodes = vec![];
    for _ in 0..of.nodes {
        let node: i64 = words.number("the tag of a node")?;
        match places.get(&node) {
            Some(&k) => nodes.push(k),
            None => {
                return words.fail(
                    format!("element {tag} has node {node}, which is not there"),
                    "save the mesh anew",
                );
            }
        }
    }
    Ok(Cell { tag, of, groups, nodes })
}

fn elements_41(
    mut words: Words,
    entities: &Entities,
    places: &HashMap<i64, usize>,
) -> Result<Vec<Cell>, GmshError> {
    let blocks = words.count("a number of blocks")?;
    let count = words.count("a number of elements")?;
    words.number::<i64>("the least tag")?;
    words.number::<i64>("the largest tag")?;
    let mut cells = vec![];
    for _ in 0..blocks {
        let dim: usize = words.number("a dimension")?;
        let entity: i64 = words.number("the tag of an entity")?;
        let number = words.number("a type of element")?;
        let of = of_number(&words, number)?;
        let groups = entities.get(&(dim, entity)).cloned().unwrap_or_default();
        let n = words.count("a number of elements")?;
        for _ in 0..n {
            let tag = words.number("the tag of an element")?;
            cells.push(cell(&mut words, of, (tag, groups.clone()), places)?);
        }
    }
    words.done()?;
    announced(&words, "elements", count, cells.len())?;
    Ok(cells)
}

fn elements_22(mut words: Words, places: &HashMap<i64, usize>) -> Result<Vec<Cell>, GmshError> {
    let count = words.count("a number of elements")?;
    let mut cells = vec![];
    for _ in 0..count {
        let tag = words.number("the tag of an element")?;
        let number = words.number("a type of element")?;
        let of = of_number(&words, number)?;
        let n = words.count("a number of tags")?;
        let mut tags: Vec<i64> = vec![];
        for _ in 0..n {
            tags.push(words.number("a tag")?);
        }
        // the first one is the physical group, 0 for none
        let groups = tags.first().map(|t| t.abs()).filter(|t| *t != 0).into_iter().collect();
        cells.push(cell(&mut words, of, (tag, groups), places)?);
    }
    words.done()?;
    Ok(cells)
}
