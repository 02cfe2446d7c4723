//! Contact of bodies from matrices by nodes: `nodes = "TIP"`, `direction = "-z"`, with the sets and places of `body.deck`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use super::names::{NAME_THEM, unknown};
use super::number::Check;
use super::{BodyKind, Field, Issue, Scene, Whole};
use crate::fem::formats::DofName;
use crate::mesh::deck::{self, Places};

/// Nodes by their numbers, or a set by its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "nodes by their numbers, [12, 17], or the name of a set, \"TIP\"")]
pub(super) enum NodesKey {
    Numbers(Vec<i64>),
    Set(String),
}

impl JsonSchema for NodesKey {
    fn schema_name() -> Cow<'static, str> {
        "Nodes".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "array", "items": {"type": "integer"}, "description": "Nodes by their numbers."},
            {"type": "string", "description": "A set of nodes of `body.deck`."},
        ]})
    }
}

/// Directions along the axes, as the programs number them.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

impl Scene {
    /// The contact displacements that nodes and a direction stand for, and the places of all rows that a deck knows.
    pub(super) fn take_nodes(&mut self) -> Result<(), Issue> {
        if self.body.kind != BodyKind::Matrices {
            return Ok(());
        }
        let places = match self.deck() {
            Ok(places) => places,
            // as where a stored scene is read without the files beside it
            Err(issue) => {
                self.rows.missing.get_or_insert(issue);
                Places::default()
            }
        };
        let at: HashMap<String, _> =
            places.nodes.iter().map(|(n, place)| (n.to_string(), *place)).collect();
        let of_row = |(k, name): (usize, &DofName)| Some((k, *at.get(&name.node)?));
        self.rows.places = self.rows.names.iter().enumerate().filter_map(of_row).collect();
        if let Some((rows, is_back)) = self.rows_at_nodes(&places)? {
            if is_back {
                self.rows.flipped.extend(&rows);
            }
            if let Some(contact) = &mut self.contact {
                contact.displacements = Some(rows);
            }
        }
        self.check_places()
    }

    /// The rows of the nodes of the contact along its direction, and whether they count the other way; none where it has no nodes.
    fn rows_at_nodes(&mut self, places: &Places) -> Result<Option<(Vec<usize>, bool)>, Issue> {
        let Some(contact) = &self.contact else { return Ok(None) };
        let key = |name: &str| contact.key(0, name);
        let Some(nodes) = &contact.nodes else {
            return match &contact.direction {
                None => Ok(None),
                Some(_) => {
                    let message = "is that of nodes, and there are none";
                    Err(Issue::new(key("direction"), message, "nodes = [101, 102]"))
                }
            };
        };
        if contact.displacements.is_some() {
            let message = "stands beside displacements, which are the same by rows";
            return Err(Issue::new(key("nodes"), message, "give one of them"));
        }
        let (axis, is_back) = direction(key("direction"), contact.direction.as_deref())?;
        if let Some(why) = &self.rows.unnamed {
            let message = format!("are those of no row: {why}");
            self.rows.missing.get_or_insert(Issue::new(key("nodes"), message, NAME_THEM));
        }
        let numbers = match nodes {
            NodesKey::Numbers(numbers) => numbers.clone(),
            NodesKey::Set(set) => match in_set(key("nodes"), set, places, &self.body.deck) {
                Ok(numbers) => numbers,
                Err(issue) if places.nodes.is_empty() => {
                    self.rows.missing.get_or_insert(issue);
                    vec![]
                }
                Err(issue) => return Err(issue),
            },
        };
        if self.rows.missing.is_some() {
            // any rows: they are not read
            return Ok(Some(((0..numbers.len().max(1)).collect(), is_back)));
        }
        check_once(&numbers, || key("nodes"))?;
        let names = &self.rows.names;
        let place: HashMap<&DofName, usize> =
            names.iter().enumerate().map(|(k, name)| (name, k)).collect();
        let row = |n: &i64| {
            let name = DofName { node: n.to_string(), direction: axis };
            let missing = || unknown(key("nodes"), &name.to_string(), names);
            place.get(&name).copied().ok_or_else(missing)
        };
        let rows: Vec<usize> = numbers.iter().map(row).collect::<Result<_, _>>()?;
        Ok(Some((rows, is_back)))
    }

    /// Gaps that are expressions of places need those of all contact displacements.
    fn check_places(&self) -> Result<(), Issue> {
        let Some(contact) = &self.contact else { return Ok(()) };
        let by_places = matches!(contact.gap(), Some(Field::Expression { .. }));
        if !by_places || self.body.deck.is_none() || self.rows.missing.is_some() {
            return Ok(());
        }
        let rows = contact.displacements.as_deref().unwrap_or_default();
        match rows.iter().find(|row| !self.rows.places.contains_key(row)) {
            None => Ok(()),
            Some(row) => {
                let row = self.rows.label(*row);
                let message =
                    format!("is an expression of places, and body.deck has no node of row {row}");
                let help = "give the deck of these matrices";
                Err(Issue::new(contact.key(0, "gap"), message, help))
            }
        }
    }

    /// Nodes and sets of the deck beside the matrices; nothing without one.
    fn deck(&self) -> Result<Places, Issue> {
        let folder = self.source.file.parent().unwrap_or(Path::new(""));
        places_of(folder, self.body.deck.as_ref())
    }
}

/// Nodes and sets of a deck in a folder; nothing without one.
pub(super) fn places_of(folder: &Path, file: Option<impl AsRef<Path>>) -> Result<Places, Issue> {
    let Some(file) = file else { return Ok(Places::default()) };
    let path = folder.join(file);
    let issue = |why: String, help: String| {
        Issue::new("body.deck", format!("{}: {why}", path.display()), help)
    };
    let help = "give the deck (.inp) that the matrices come from, relative to the scene";
    let whole = Whole::read(&path)
        .map_err(|(why, what)| issue(why, what.unwrap_or_else(|| help.to_owned())))?;
    deck::places(&whole.bytes).map_err(|e| issue(whole.place(&e) + &e.message, e.help))
}

/// Each node is named once.
pub(super) fn check_once(nodes: &[i64], key: impl Fn() -> String) -> Check {
    match nodes.iter().enumerate().find(|(k, n)| nodes[..*k].contains(n)) {
        None => Ok(()),
        Some((_, twice)) => Err(Issue::new(key(), format!("names {twice} twice"), "give it once")),
    }
}

/// The number of a direction, and whether it points back.
fn direction(key: String, word: Option<&str>) -> Result<(u8, bool), Issue> {
    let help = "direction = \"x\", or \"-z\": from the nodes towards the obstacle";
    let Some(word) = word else { return Err(Issue::new(key, "is missing", help)) };
    let (name, is_back) = match word.strip_prefix('-') {
        Some(name) => (name, true),
        None => (word, false),
    };
    match (1..).zip(AXES).find(|(_, axis)| *axis == name) {
        Some((number, _)) => Ok((number, is_back)),
        None => {
            let message =
                format!("\"{word}\" is no axis: rows of matrices are displacements along axes");
            Err(Issue::new(key, message, help))
        }
    }
}

/// The nodes of a set.
pub(super) fn in_set(
    key: String,
    set: &str,
    places: &Places,
    deck: &Option<std::path::PathBuf>,
) -> Result<Vec<i64>, Issue> {
    let found = places.sets.iter().find(|s| s.0.eq_ignore_ascii_case(set));
    if let Some((_, numbers)) = found.filter(|s| !s.1.is_empty()) {
        return Ok(numbers.clone());
    }
    let all: Vec<String> = places.sets.iter().map(|s| format!("\"{}\"", s.0)).collect();
    let (message, help) = match (deck, found) {
        (None, _) => (
            format!("\"{set}\" is a set, and no deck says which nodes it has"),
            "body.deck = \"block.inp\", or nodes = [101, 102]".to_owned(),
        ),
        (_, Some(_)) => (format!("the set \"{set}\" has no nodes"), "name another".to_owned()),
        (_, None) if all.is_empty() => (
            format!("there is no set \"{set}\""),
            "the deck has no sets of nodes: give nodes = [101, 102]".to_owned(),
        ),
        _ => (format!("there is no set \"{set}\""), format!("the deck has {}", all.join(", "))),
    };
    Err(Issue::new(key, message, help))
}
