//! Rows of given matrices by the names that their program gave them: `"109.3"`, node and direction.
//!
//! Names stand where rows may stand. Before a scene is read they are replaced by their numbers, as wide as they were: what a message says of a place in the file stays true.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use toml::de::{DeTable, DeValue};

use super::nodes::{AXES, in_set, places_of};
use super::turned::Turned;
use super::{FileName, Issue, Superelement};
use crate::fem::formats::{
    DofName, may_have_names, parse_dof_names, parse_mapping, parse_name, parse_name_list,
    read_matrix,
};
use crate::mesh::Point;

/// A row as a scene may call it; for the schema alone.
pub(super) struct Row;

impl JsonSchema for Row {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Row".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "integer", "minimum": 0, "description": "A row of the matrices, counted from 0."},
            {"type": "string", "pattern": "^-?[A-Za-z0-9_.-]+\\.([0-6]|n|t[12]?)$", "description": "Node and direction, `\"109.3\"`, where the matrices have names; of `tangents` and probes before an oblique obstacle `\"109.t\"`, of probes `\"109.n\"`."},
        ]})
    }
}

/// What is known of the rows of given matrices.
#[derive(Debug, Clone, Default)]
pub struct RowNames {
    /// Their names in their order; none where nobody says.
    pub names: Vec<DofName>,
    /// Names of the rows of the file of the stiffness, those that the scene holds among them.
    pub of_file: Vec<DofName>,
    /// Displacements that the program holds, and that its mass may have all the same; and those that supports of the scene hold. They are no rows.
    pub held: Vec<DofName>,
    /// Rows of the files that count along other directions: contact displacements whose names have a minus, and those of nodes before oblique obstacles.
    pub turned: Vec<Turned>,
    /// Keys of tangents and probes that are called by what they are before an oblique obstacle, `101.t`.
    pub(super) oblique: HashMap<String, String>,
    /// What supports of the scene hold: their sets, or their keys, with the rows of the files. Each row belongs to the first that holds it.
    pub supports: Vec<(String, Vec<DofName>)>,
    /// Why nobody says.
    pub(super) unnamed: Option<String>,
    /// What stays of them, where modes stand for all others: `names` are those of the files.
    pub superelement: Option<Superelement>,
    /// Where the nodes of its rows are, for those that a deck knows.
    pub places: HashMap<usize, Point>,
    /// Names that stand in the scene and are not known, as where a stored scene is read without the files beside it.
    pub missing: Option<Issue>,
}

impl RowNames {
    /// The name of a row of the body.
    pub fn name(&self, row: usize) -> Option<&DofName> {
        let of_file = match &self.superelement {
            None => row,
            Some(kept) => *kept.rows.get(row)?,
        };
        self.names.get(of_file)
    }

    /// Whether the value of a key is called by what it is before an oblique obstacle.
    pub fn called_oblique(&self, key: &str) -> bool {
        self.oblique.contains_key(key)
    }

    /// What a row of the body is before an oblique obstacle: `n`, `t`; nothing of all others.
    pub fn suffix(&self, row: usize) -> Option<&'static str> {
        let row = self.superelement.as_ref().map_or(Some(row), |s| s.rows.get(row).copied())?;
        self.turned.iter().find_map(|t| t.suffix(row))
    }

    /// The row that is called so before an oblique obstacle; an issue where there is none.
    pub(super) fn row_of_oblique(&self, key: &str, word: &str) -> Result<usize, Issue> {
        let mut all = self.turned.iter().filter(|t| !t.is_flip()).flat_map(Turned::rows).copied();
        all.find(|row| self.label(*row) == *word).ok_or_else(|| {
            let message = format!("no row is called \"{word}\"");
            let help = "\"101.n\" and \"101.t\" are those of nodes of a table with a direction between two axes, \"101.t1\" and \"101.t2\" of one between three";
            Issue::new(key, message, help)
        })
    }

    /// Whether rows of the body are called by more than their places in the files.
    pub fn has_labels(&self) -> bool {
        !self.names.is_empty() || self.superelement.is_some()
    }

    /// What a row of the body is called: by its name, else by its number in the files.
    pub fn label(&self, row: usize) -> String {
        let of_file = |row: usize| {
            let Some(name) = self.names.get(row) else { return row.to_string() };
            let across = self.turned.iter().find_map(|t| t.suffix(row));
            across.map_or_else(|| name.to_string(), |suffix| format!("{}.{suffix}", name.node))
        };
        match &self.superelement {
            None => of_file(row),
            Some(kept) => match kept.rows.get(row) {
                Some(row) => of_file(*row),
                None => format!("mode.{}", row + 1 - kept.rows.len()),
            },
        }
    }

    /// The displacement along the axis of a row of the body: the row itself, but for those of nodes before oblique obstacles.
    pub fn terms(&self, row: usize) -> Vec<(usize, f64)> {
        let kept = self.superelement.as_ref().map(|s| &s.rows);
        let of_file = kept.map_or(Some(row), |rows| rows.get(row).copied());
        let place = |i: usize| kept.map_or(i, |rows| rows.binary_search(&i).unwrap_or(row));
        let mut oblique = self.turned.iter().filter(|t| !t.is_flip());
        match of_file.and_then(|i| oblique.find_map(|t| t.terms(i))) {
            Some(terms) => terms.map(|(a, b)| (place(a), b)).collect(),
            None => vec![(row, 1.0)],
        }
    }

    /// Unit translations along x, y and z, over the rows and behind them those that supports of the scene hold.
    pub fn translations(&self) -> [Vec<f64>; 3] {
        let all: Vec<&DofName> =
            self.names.iter().chain(self.held_rows().map(|(_, name)| name)).collect();
        [1, 2, 3].map(|axis| {
            let along = |row: usize| f64::from(u8::from(all[row].direction == axis));
            let mut own: Vec<f64> = (0..all.len()).map(along).collect();
            for turned in &self.turned {
                turned.rows().iter().for_each(|&row| own[row] = turned.component(row, along));
            }
            own
        })
    }

    /// What all rows are called; nothing where they have numbers alone.
    pub fn labels(&self) -> Vec<String> {
        let count = match &self.superelement {
            None => self.names.len(),
            Some(kept) => kept.rows.len() + kept.modes,
        };
        (0..count).map(|row| self.label(row)).collect()
    }

    /// Which rows count along other directions than those of the files, as text; empty: none.
    pub(crate) fn turns(&self) -> String {
        let mut all: Vec<String> = self.turned.iter().map(Turned::text).collect();
        all.sort();
        all.join("; ")
    }

    /// Whether a support is the one that a load names, by its set however that is written; all of them where it names none.
    pub fn is_support(&self, k: usize, name: &str) -> bool {
        name.is_empty() || self.supports[k].0.eq_ignore_ascii_case(name)
    }

    /// The rows of the files that supports of the scene hold, in the order in which they stand behind those of the body, with the support of each.
    pub fn held_rows(&self) -> impl Iterator<Item = (usize, &DofName)> {
        let supports = self.supports.iter().enumerate();
        supports.flat_map(|(k, support)| support.1.iter().map(move |name| (k, name)))
    }
}

/// Endings of files of names beside a matrix.
pub(super) const BESIDE: [&str; 2] = ["dof", "mapping"];

/// Keys whose values are rows: table, key.
const ROWS: [(&str, &str); 14] = [
    ("contact", "displacements"),
    ("contact", "tangents"),
    ("load", "displacement"),
    ("probe", "node"),
    ("spring", "row"),
    ("spring", "to_row"),
    ("damper", "row"),
    ("damper", "to_row"),
    ("mass", "row"),
    ("mass", "to_row"),
    ("slider", "row"),
    ("slider", "to_row"),
    ("iwan", "row"),
    ("iwan", "to_row"),
];

/// What helps where rows have no names.
pub(super) const NAME_THEM: &str = "give rows, counted from 0; or put the names beside the matrices: .dof of CalculiX, .mapping of Ansys, MATRIX INPUT of Abaqus; or list them: [body] names = \"rows.csv\"";

/// The text with numbers in place of names, and what is known of them; an issue where a name is none.
pub(super) fn in_numbers(text: &str, path: &Path) -> Result<(String, RowNames), Issue> {
    let same = || (text.to_owned(), RowNames::default());
    // what cannot be read is the reader's to say
    let Ok(root) = DeTable::parse(text) else { return Ok(same()) };
    let Some(DeValue::Table(body)) = root.get_ref().get("body").map(|b| b.get_ref()) else {
        return Ok(same());
    };
    let word = |key: &str| body.get(key).and_then(|v| v.get_ref().as_str()).map(str::to_owned);
    let (Some("matrices"), Some(file)) = (word("kind").as_deref(), word("stiffness_matrix")) else {
        return Ok(same());
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let listed = word("names").map(|list| listed(folder, &list)).transpose()?;
    let unread = listed.as_ref().and_then(|list| list.as_ref().err()).cloned();
    let found = match (listed, names_of(folder, &file)) {
        (None, found) => found,
        (Some(Ok(list)), Ok((names, _))) if list != names => {
            let message = "says other names than the matrices, or than the file beside them";
            return Err(Issue::new("body.names", message, "remove the key: these names are read"));
        }
        (Some(list), _) => list.map(|names| (names, vec![])),
    };
    let (names, mut held) = found.map_or_else(|why| (Err(why), vec![]), |n| (Ok(n.0), n.1));
    let of_file = names.clone().unwrap_or_default();
    let own = supported(root.get_ref(), &of_file, (folder, word("deck").as_deref()))?;
    let taken: HashSet<&DofName> = own.iter().flat_map(|s| &s.1).collect();
    let names = names.map(|mut names| {
        names.retain(|name| !taken.contains(name));
        names
    });
    held.extend(taken.into_iter().cloned());
    let known: HashMap<String, usize> = match &names {
        Ok(names) => names.iter().enumerate().map(|(k, name)| (name.to_string(), k)).collect(),
        Err(_) => HashMap::new(),
    };
    let known_names = names.clone().unwrap_or_default();
    let unnamed = names.as_ref().err().cloned();
    let missing = unread.map(|why| Issue::new("body.names", why, LIST));
    let mut found = RowNames {
        names: known_names,
        of_file,
        held,
        supports: own,
        unnamed,
        missing,
        ..RowNames::default()
    };
    let mut out = text.to_owned();
    let mut placed: Vec<(std::ops::Range<usize>, String)> = vec![];
    for (table, key) in ROWS {
        for (place, value) in values(root.get_ref(), table, key) {
            let Some(word) = value.get_ref().as_str() else { continue };
            let (minus, name) = match word.strip_prefix('-') {
                Some(name) => (true, name),
                None => (false, word),
            };
            if minus && key != "displacements" {
                let message =
                    format!("\"{word}\": a minus turns contact displacements, and no others");
                return Err(Issue::new(place, message, format!("give \"{name}\"")));
            }
            let suffix = word.rsplit_once('.').map(|(_, suffix)| suffix);
            let may_be_normal = table == "probe";
            if (key == "tangents" || may_be_normal)
                && matches!(
                    (suffix, may_be_normal),
                    (Some("t" | "t1" | "t2"), _) | (Some("n"), true)
                )
            {
                found.oblique.insert(place, word.to_owned());
                placed.push((value.span(), "0".to_owned()));
                continue;
            }
            let row = match (known.get(name), &names) {
                (Some(row), _) => *row,
                (None, Ok(names)) => return Err(unknown(place, name, names)),
                (None, Err(why)) => {
                    let message = format!("\"{word}\" is the name of no row: {why}");
                    found.missing.get_or_insert(Issue::new(place, message, NAME_THEM));
                    // any number that no other name has
                    placed.len()
                }
            };
            if minus {
                found.turned.push(Turned::flip(row));
            }
            placed.push((value.span(), row.to_string()));
        }
    }
    placed.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    for (span, number) in placed {
        let width = span.len();
        out.replace_range(span, &format!("{number:width$}"));
    }
    Ok((out, found))
}

/// The rows that supports hold: those of nodes by their numbers, or of a set of the deck, along axes. What its program holds already is no row.
fn supported(
    root: &DeTable,
    names: &[DofName],
    (folder, deck): (&Path, Option<&str>),
) -> Result<Vec<(String, Vec<DofName>)>, Issue> {
    let (mut held, mut all) = (HashSet::new(), vec![]);
    let Some(DeValue::Array(tables)) = root.get("support").map(|t| t.get_ref()) else {
        return Ok(all);
    };
    let known: HashSet<&DofName> = names.iter().collect();
    for (k, table) in tables.iter().enumerate() {
        let DeValue::Table(own) = table.get_ref() else { continue };
        let key = || format!("support[{k}].nodes");
        let mut name = format!("support[{k}]");
        let nodes: Vec<String> = match own.get("nodes").map(|v| v.get_ref()) {
            _ if names.is_empty() => continue,
            Some(DeValue::Array(list)) => {
                let number = |v: &toml::Spanned<DeValue>| match v.get_ref() {
                    DeValue::Integer(n) => Some(n.as_str().to_owned()),
                    _ => None,
                };
                list.iter().filter_map(number).collect()
            }
            Some(DeValue::String(set)) => {
                let places = places_of(folder, deck)?;
                let deck = deck.map(std::path::PathBuf::from);
                let (set, numbers) = in_set(key(), set, &places, &deck)?;
                name.clone_from(set);
                numbers.iter().map(i64::to_string).collect()
            }
            _ => continue,
        };
        let fix = own.get("fix").and_then(|v| v.get_ref().as_array());
        let axis = |v: &toml::Spanned<DeValue>| {
            let word = v.get_ref().as_str()?;
            (1..).zip(AXES).find(|(_, axis)| *axis == word).map(|(number, _)| number)
        };
        let axes: Vec<u8> = fix.into_iter().flatten().filter_map(axis).collect();
        if nodes.is_empty() {
            return Err(Issue::new(
                key(),
                "names no node",
                "nodes = [101, 102], or a set of body.deck",
            ));
        }
        let mut of_support = vec![];
        for node in nodes {
            let of = |direction: &u8| DofName { node: node.clone(), direction: *direction };
            let rows: Vec<DofName> = axes.iter().map(of).filter(|n| known.contains(n)).collect();
            if rows.is_empty() && !names.iter().any(|n| n.node == node) {
                return Err(unknown(
                    key(),
                    &format!("{node}.{}", axes.first().unwrap_or(&1)),
                    names,
                ));
            }
            of_support.extend(rows.into_iter().filter(|row| held.insert(row.clone())));
        }
        all.push((name, of_support));
    }
    Ok(all)
}

/// The values of a key of a table, or of all tables of its name, items of lists one by one; each with its key.
fn values<'t>(
    root: &'t DeTable<'t>,
    table: &str,
    key: &str,
) -> Vec<(String, &'t toml::Spanned<DeValue<'t>>)> {
    let Some(found) = root.get(table) else { return vec![] };
    let tables: Vec<(String, &DeTable)> = match found.get_ref() {
        DeValue::Table(one) => vec![(table.to_owned(), one)],
        DeValue::Array(list) => {
            let one = |(k, v): (usize, &'t toml::Spanned<DeValue<'t>>)| match v.get_ref() {
                DeValue::Table(own) => Some((format!("{table}[{k}]"), own)),
                _ => None,
            };
            list.iter().enumerate().filter_map(one).collect()
        }
        _ => vec![],
    };
    let mut all = vec![];
    for (name, own) in tables {
        let Some(value) = own.get(key) else { continue };
        let place = format!("{name}.{key}");
        match value.get_ref() {
            DeValue::Array(list) => {
                all.extend(list.iter().enumerate().map(|(k, v)| (format!("{place}[{k}]"), v)));
            }
            _ => all.push((place, value)),
        }
    }
    all
}

/// The names in the file that stands beside a matrix, if there is one.
pub fn names_beside(path: &Path) -> Option<Result<Vec<DofName>, String>> {
    type Parse = fn(&str) -> Result<Vec<DofName>, String>;
    BESIDE.into_iter().zip([parse_dof_names as Parse, parse_mapping]).find_map(|(ending, parse)| {
        let beside = path.with_extension(ending);
        let text = std::fs::read_to_string(&beside).ok()?;
        Some(parse(&text).map_err(|why| format!("{}: {why}", beside.display())))
    })
}

/// The names in a list that the scene gives; why it cannot be read.
fn listed(folder: &Path, list: &str) -> Result<Result<Vec<DofName>, String>, Issue> {
    let path = folder.join(list);
    let of_file = |why: String| format!("{}: {why}", path.display());
    match std::fs::read_to_string(&path) {
        Err(e) => Ok(Err(of_file(e.to_string()))),
        Ok(text) => match parse_name_list(&text) {
            Ok(names) => Ok(Ok(names)),
            Err(why) => Err(Issue::new("body.names", of_file(why), LIST)),
        },
    }
}

/// What a list of names is.
const LIST: &str = "give a file of lines such as 109,3: node and direction, a line a row";

/// The names of the rows of a matrix, from its file or from one beside it, and those of what is held.
fn names_of(folder: &Path, file: &str) -> Result<(Vec<DofName>, Vec<DofName>), String> {
    let FileName { file, dataset } = FileName::parse(file);
    let path = folder.join(file);
    if let Some(names) = names_beside(&path) {
        return names.map(|names| (names, vec![]));
    }
    let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let none =
        || format!("{} has no names, and no .dof or .mapping stands beside it", path.display());
    if !may_have_names(&bytes) {
        return Err(none());
    }
    let written =
        read_matrix(&bytes, dataset).map_err(|why| format!("{}: {why}", path.display()))?;
    match written.names.is_empty() {
        true => Err(none()),
        false => Ok((written.names, written.held)),
    }
}

/// A name that is none, with what there is.
pub(super) fn unknown(place: String, word: &str, names: &[DofName]) -> Issue {
    let message = format!("no row is called \"{word}\"");
    let mut nodes: Vec<&str> = names.iter().map(|n| n.node.as_str()).collect();
    nodes.sort_by_key(|n| (n.parse::<i64>().unwrap_or(i64::MAX), *n));
    nodes.dedup();
    let of_node: Vec<String> = parse_name(word)
        .map(|w| names.iter().filter(|n| n.node == w.node).map(DofName::to_string).collect())
        .unwrap_or_default();
    let help = match (nodes.first(), nodes.last()) {
        _ if !of_node.is_empty() => {
            format!("this node has {}: others are held, tied or rotations", of_node.join(", "))
        }
        (Some(first), Some(last)) => {
            format!(
                "the nodes that move are {first} to {last} ({} nodes), the first row is \"{}\"; what supports hold is no row",
                nodes.len(),
                names[0]
            )
        }
        _ => "the matrices have no rows".to_owned(),
    };
    Issue::new(place, message, help)
}
