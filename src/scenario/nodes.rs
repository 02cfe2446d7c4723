//! Contact of bodies from matrices by nodes: `nodes = "TIP"`, `direction = "-z"`, with the sets and places of `body.deck`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use super::element::End;
use super::names::{NAME_THEM, unknown};
use super::number::Check;
use super::turned::Turned;
use super::{BodyKind, Field, Issue, RowNames, Scene, Whole};
use crate::fem::formats::DofName;
use crate::fem::normals_of;
use crate::mesh::deck::{self, Places};
use crate::mesh::{Point, gmsh::Sides};

/// Nodes by their numbers, or a set by its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "nodes by their numbers, [12, 17], or the name of a set, \"TIP\"")]
pub(super) enum NodesKey {
    Numbers(Vec<i64>),
    Set(String),
}

/// Where an obstacle is from its nodes: an axis, with a minus the other way, or a vector.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "an axis, \"x\" or \"-z\", or a vector, [0.6, 0.8, 0.0]")]
pub(super) enum DirectionKey {
    Axis(String),
    Vector(Vec<f64>),
}

impl JsonSchema for DirectionKey {
    fn schema_name() -> Cow<'static, str> {
        "Towards".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "string", "description": "An axis: `\"x\"`, `\"-z\"`; or `\"normal\"`."},
            {"type": "array", "items": {"type": "number"}, "description": "A vector, of any length."},
        ]})
    }
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
        let tables = self.contact.as_ref().map_or(0, |c| c.obstacles.len());
        for k in 0..tables {
            self.take_table(k, &places)?;
        }
        self.take_oblique_probes()?;
        self.check_coupled(&places)?;
        self.check_turned()?;
        self.check_places()
    }

    /// Probes that are called by what they are before an oblique obstacle, now that rows are turned.
    fn take_oblique_probes(&mut self) -> Result<(), Issue> {
        if self.rows.missing.is_some() {
            return Ok(());
        }
        for (i, probe) in self.probes.iter_mut().enumerate() {
            let key = format!("probe[{i}].node");
            if let Some(word) = self.rows.oblique.get(&key) {
                probe.node = Some(self.rows.row_of_oblique(&key, word)?);
            }
        }
        Ok(())
    }

    /// Rows of nodes in equations of the deck move others along: what acts on them acts elsewhere too.
    fn check_coupled(&self, places: &Places) -> Result<(), Issue> {
        if self.rows.missing.is_some() {
            return Ok(());
        }
        let is_in = |node: &str| {
            node.parse().is_ok_and(|node: i64| places.coupled.binary_search(&node).is_ok())
        };
        let held = self.rows.held_rows().map(|(k, name)| (format!("support[{k}].nodes"), name));
        let named = self.named_rows().into_iter();
        let named = named.filter_map(|(key, row)| Some((key, self.rows.names.get(row)?)));
        match held.chain(named).find(|(_, name)| is_in(&name.node)) {
            None => Ok(()),
            Some((key, name)) => {
                let message = format!(
                    "{name} is of a node in an *EQUATION or *MPC of the deck: its row moves other displacements along"
                );
                let help = "name nodes that no equation has, or export matrices without it";
                Err(Issue::new(key, message, help))
            }
        }
    }

    /// All rows of given matrices that it names, with their keys.
    pub(crate) fn named_rows(&self) -> Vec<(String, usize)> {
        let mut all = vec![];
        if let Some(contact) = &self.contact {
            for (k, o) in contact.obstacles.iter().enumerate() {
                all.extend(o.given.rows().iter().map(|row| (contact.key(k, o.given.key()), *row)));
                let tangents = o.given.tangents.iter().flatten();
                all.extend(tangents.map(|row| (contact.key(k, "tangents"), *row)));
            }
        }
        let loads = self.loads.iter().enumerate();
        let loads =
            loads.filter_map(|(i, l)| Some((format!("load[{i}].displacement"), l.displacement?)));
        let probes = self.probes.iter().enumerate();
        let probes = probes.filter_map(|(i, p)| Some((format!("probe[{i}].node"), p.node?)));
        let ends = self.all_ends().flat_map(|(table, ends)| {
            let both = [(Some(ends.from), "row"), (ends.to, "to_row")];
            both.into_iter()
                .filter_map(move |(end, key)| match end? {
                    End::Row(row) => Some((format!("{table}.{key}"), row)),
                    _ => None,
                })
                .collect::<Vec<_>>()
        });
        all.extend(loads.chain(probes).chain(ends));
        all
    }

    /// Rows of nodes before an oblique obstacle are its own: no other table, and no axis, has them.
    fn check_turned(&self) -> Result<(), Issue> {
        let Some(contact) = &self.contact else { return Ok(()) };
        let oblique = || self.rows.turned.iter().filter(|t| !t.is_flip());
        let all: Vec<&Turned> = self.rows.turned.iter().collect();
        for (k, o) in contact.obstacles.iter().enumerate() {
            let key = |name: &str| contact.key(k, name);
            let is_other = |row: &&usize| {
                let mut own = oblique().filter(|t| t.rows().contains(row));
                let flipped = all.iter().filter(|t| t.rows().contains(row)).count() > 1;
                flipped || own.any(|t| t.normal_row() != **row)
            };
            if let Some(row) = o.given.rows().iter().find(is_other) {
                let node = &self.rows.names[*row].node;
                let message =
                    format!("names {node}, which a table has turned to its own direction");
                let help = "give each node one direction, unless all of them are axes";
                return Err(Issue::new(key(o.given.key()), message, help));
            }
            let axis = |(i, row): &(usize, &usize)| {
                let named = self.rows.called_oblique(&key(&format!("tangents[{i}]")));
                !named && oblique().any(|t| t.rows().contains(row))
            };
            if let Some((_, row)) = o.given.tangents.iter().flatten().enumerate().find(axis) {
                let name = &self.rows.names[*row];
                let message =
                    format!("{name} is turned with its node to the direction of the obstacle");
                let help = format!("give \"{}.t\", the direction along the obstacle", name.node);
                return Err(Issue::new(key("tangents"), message, help));
            }
            let masters =
                [("against", &o.given.against), ("tangents_against", &o.given.tangents_against)];
            for (name, against) in masters {
                let mut rows = against.iter().flatten().flat_map(|c| &c.0);
                if let Some((row, _)) = rows.find(|m| oblique().any(|t| t.rows().contains(&m.0))) {
                    let message =
                        format!("{row} is turned with its node to the direction of an obstacle");
                    let help =
                        "give displacements that face nothing else, or one direction along axes";
                    return Err(Issue::new(key(name), message, help));
                }
            }
        }
        Ok(())
    }

    /// The contact displacements of the nodes of one table; nothing where it has rows.
    fn take_table(&mut self, k: usize, places: &Places) -> Result<(), Issue> {
        let Some(contact) = &self.contact else { return Ok(()) };
        let key = |name: &str| contact.key(k, name);
        let given = &contact.obstacles[k].given;
        let Some(nodes) = &given.nodes else {
            return match &given.direction {
                None => Ok(()),
                Some(_) => {
                    let message = "is that of nodes, and there are none";
                    Err(Issue::new(key("direction"), message, "nodes = [101, 102]"))
                }
            };
        };
        if given.displacements.is_some() {
            let message = "stands beside displacements, which are the same by rows";
            return Err(Issue::new(key("nodes"), message, "give one of them"));
        }
        let is_normal =
            |d: &DirectionKey| matches!(d, DirectionKey::Axis(word) if word == "normal");
        let towards = match &given.direction {
            Some(word) if is_normal(word) => None,
            other => Some(direction(key("direction"), other.as_ref())?),
        };
        if let Some(why) = &self.rows.unnamed {
            let message = format!("are those of no row: {why}");
            self.rows.missing.get_or_insert(Issue::new(key("nodes"), message, NAME_THEM));
        }
        let numbers = match nodes {
            NodesKey::Numbers(numbers) => numbers.clone(),
            NodesKey::Set(set) => match in_set(key("nodes"), set, places, &self.body.deck) {
                Ok((_, numbers)) => numbers.clone(),
                Err(issue) if places.nodes.is_empty() => {
                    self.rows.missing.get_or_insert(issue);
                    vec![]
                }
                Err(issue) => return Err(issue),
            },
        };
        let rows = match self.rows.missing.is_some() {
            // any rows: they are not read
            true => (0..numbers.len().max(1)).collect(),
            false => {
                if numbers.is_empty() {
                    let help = "nodes = [101, 102], or a set of body.deck";
                    return Err(Issue::new(key("nodes"), "names no node", help));
                }
                check_once(&numbers, || key("nodes"))?;
                let keys = (key("nodes"), key("direction"));
                let by_node = self.rows.by_node();
                let normals = match (&towards, nodes) {
                    (Some(_), _) => HashMap::new(),
                    (None, NodesKey::Set(set)) => self.normals(key("direction"), set)?,
                    (None, NodesKey::Numbers(_)) => {
                        let message =
                            "\"normal\" is that of a set of body.deck, whose faces have it";
                        let help = "nodes = \"TIP\", or a direction such as [0.6, 0.8, 0.0]";
                        return Err(Issue::new(key("direction"), message, help));
                    }
                };
                let before = |n: &i64| {
                    let towards = towards.or_else(|| normals.get(n).copied()).ok_or_else(|| {
                        let message = format!("node {n} is on no face of the boundary all of whose nodes are in the set");
                        let help = "give a set of the nodes of faces, or a direction such as [0.6, 0.8, 0.0]";
                        Issue::new(key("direction"), message, help)
                    })?;
                    self.rows.before((*n, &by_node), &towards, &keys)
                };
                let found = numbers.iter().map(before);
                let (rows, turned): (Vec<usize>, Vec<_>) =
                    found.collect::<Result<Vec<_>, Issue>>()?.into_iter().unzip();
                let turned: Vec<Turned> = turned.into_iter().flatten().collect();
                self.rows.turned.extend(turned);
                rows
            }
        };
        self.take_tangents(k, &rows)?;
        if let Some(contact) = &mut self.contact {
            contact.obstacles[k].given.displacements = Some(rows);
        }
        Ok(())
    }

    /// The displacements along a rough obstacle of a body in the plane, which its nodes leave no choice of.
    fn take_tangents(&mut self, k: usize, rows: &[usize]) -> Result<(), Issue> {
        let Some(contact) = &self.contact else { return Ok(()) };
        if self.rows.missing.is_some() {
            return Ok(());
        }
        let obstacle = &contact.obstacles[k];
        if let Some(own) = &obstacle.given.tangents {
            let at = |(i, row): (usize, &usize)| {
                let key = contact.key(k, &format!("tangents[{i}]"));
                let word = self.rows.oblique.get(&key);
                word.map_or(Ok(*row), |word| self.rows.row_of_oblique(&key, word))
            };
            let all = own.iter().enumerate().map(at).collect::<Result<Vec<usize>, Issue>>()?;
            if let Some(contact) = &mut self.contact {
                contact.obstacles[k].given.tangents = Some(all);
            }
            return Ok(());
        }
        if obstacle.coefficient().is_none() {
            return Ok(());
        }
        let (names, by_node) = (&self.rows.names, self.rows.by_node());
        let others = |row: &usize| -> Vec<usize> {
            let of_node = by_node.get(&names[*row].node[..]).into_iter().flatten().copied();
            of_node.filter(|i| i != row && (1..=3).contains(&names[*i].direction)).collect()
        };
        let all: Vec<Vec<usize>> = rows.iter().map(others).collect();
        if all.iter().all(|of_node| of_node.len() == 1) {
            let tangents: Vec<usize> = all.into_iter().flatten().collect();
            let called = |(i, row): (usize, &usize)| {
                (contact.key(k, &format!("tangents[{i}]")), self.rows.label(*row))
            };
            let called: Vec<(String, String)> = tangents.iter().enumerate().map(called).collect();
            self.rows.oblique.extend(called);
            if let Some(contact) = &mut self.contact {
                contact.obstacles[k].given.tangents = Some(tangents);
            }
        }
        Ok(())
    }

    /// Gaps that are expressions of places need those of all contact displacements.
    fn check_places(&self) -> Result<(), Issue> {
        let Some(contact) = &self.contact else { return Ok(()) };
        if self.body.deck.is_none() || self.rows.missing.is_some() {
            return Ok(());
        }
        for (k, obstacle) in contact.obstacles.iter().enumerate() {
            if !matches!(obstacle.gap, Some(Field::Expression { .. })) {
                continue;
            }
            let mut rows = obstacle.given.rows().iter();
            if let Some(row) = rows.find(|row| !self.rows.places.contains_key(row)) {
                let row = self.rows.label(*row);
                let message =
                    format!("is an expression of places, and body.deck has no node of row {row}");
                let help = "give the deck of these matrices";
                return Err(Issue::new(contact.key(k, "gap"), message, help));
            }
        }
        Ok(())
    }

    /// Outward normals of the nodes of a set of the deck, those of its faces on the boundary weighted by their areas.
    fn normals(&self, key: String, set: &str) -> Result<HashMap<i64, [f64; 3]>, Issue> {
        let folder = self.source.file.parent().unwrap_or(Path::new(""));
        let path = folder.join(self.body.deck.as_deref().unwrap_or(Path::new("")));
        let help = "give a direction such as [0.6, 0.8, 0.0]";
        let issue = |why: String| {
            Issue::new(
                &key,
                format!("\"normal\" reads the faces of {}: {why}", path.display()),
                help,
            )
        };
        let whole = Whole::read(&path).map_err(|(why, _)| issue(why))?;
        let file = deck::read(&whole.bytes).map_err(|e| issue(whole.place(&e) + &e.message))?;
        let body = file.body(1.0, &[]).map_err(|e| issue(e.message))?;
        let found = body.sides.iter().find(|s| s.0.eq_ignore_ascii_case(set));
        let Some((_, Sides::Boundary(facets))) =
            found.filter(|s| matches!(s.1, Sides::Boundary(f) if !f.is_empty()))
        else {
            return Err(issue(format!("no face of the boundary has all its nodes in \"{set}\"")));
        };
        let mesh = body.mesh.clone().with_groups(vec![(set.to_owned(), facets.clone())]);
        let tags = &body.node_tags;
        // what a face along axes leaves by rounding is none
        let clean = |n: Point| n.map(|x| if x.abs() < 1e-12 { 0.0 } else { x });
        Ok(normals_of(&mesh, set).into_iter().map(|(n, normal)| (tags[n], clean(normal))).collect())
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

/// The unit vector of a direction.
fn direction(key: String, given: Option<&DirectionKey>) -> Result<[f64; 3], Issue> {
    let help = "direction = \"x\", \"-z\", [0.6, 0.8, 0.0] or \"normal\" (of a set of body.deck): from the nodes towards the obstacle";
    let fail = |message: String| Err(Issue::new(&key, message, help));
    let mut along = [0.0; 3];
    match given {
        None => return fail("is missing".to_owned()),
        Some(DirectionKey::Axis(word)) => {
            let (name, sense) = match word.strip_prefix('-') {
                Some(name) => (name, -1.0),
                None => (&word[..], 1.0),
            };
            match AXES.iter().position(|axis| *axis == name) {
                Some(axis) => along[axis] = sense,
                None => return fail(format!("\"{word}\" is no axis")),
            }
        }
        Some(DirectionKey::Vector(v)) => {
            let size = v.iter().fold(0.0f64, |m, x| m.hypot(*x));
            if v.len() > 3 || !size.is_finite() || size == 0.0 {
                return fail(format!("{v:?} is no direction"));
            }
            along.iter_mut().zip(v).for_each(|(n, x)| *n = x / size);
        }
    }
    Ok(along)
}

impl RowNames {
    /// The rows of each node.
    fn by_node(&self) -> HashMap<&str, Vec<usize>> {
        let mut all: HashMap<&str, Vec<usize>> = HashMap::new();
        let names = self.names.iter().enumerate();
        names.for_each(|(row, name)| all.entry(&name.node).or_default().push(row));
        all
    }

    /// The row of a node that counts along a direction, and what of its displacements is turned for it.
    fn before(
        &self,
        (node, by_node): (i64, &HashMap<&str, Vec<usize>>),
        towards: &[f64; 3],
        (of_nodes, of_direction): &(String, String),
    ) -> Result<(usize, Option<Turned>), Issue> {
        let names = &self.names;
        let axes = (1..).zip(towards).filter(|(_, n)| **n != 0.0);
        let (axes, n): (Vec<u8>, Vec<f64>) = axes.unzip();
        let name = |direction: u8| DofName { node: node.to_string(), direction };
        let own = by_node.get(&node.to_string()[..]).map_or(&[][..], Vec::as_slice);
        let row = |axis: &u8| own.iter().copied().find(|i| names[*i].direction == *axis);
        let rows: Vec<Option<usize>> = axes.iter().map(row).collect();
        if rows.iter().all(Option::is_none) {
            return Err(unknown(of_nodes.clone(), &name(axes[0]).to_string(), names));
        }
        let rows: Vec<usize> = match rows.iter().position(Option::is_none) {
            None => rows.into_iter().flatten().collect(),
            Some(held) => {
                let missing = name(axes[held]);
                let message =
                    format!("needs {missing}, which the matrices do not have: it is held or tied");
                let help =
                    "give a direction along the displacements of the node, or leave the node out";
                return Err(Issue::new(of_direction, message, help));
            }
        };
        Ok(match (&rows[..], &n[..]) {
            ([row], [n]) if *n > 0.0 => (*row, None),
            ([row], _) => (*row, Some(Turned::flip(*row))),
            _ => {
                let turned = Turned::towards(rows, &n);
                (turned.normal_row(), Some(turned))
            }
        })
    }
}

/// A set as the deck spells its name, with the nodes of it.
pub(super) fn in_set<'p>(
    key: String,
    set: &str,
    places: &'p Places,
    deck: &Option<std::path::PathBuf>,
) -> Result<&'p (String, Vec<i64>), Issue> {
    let found = places.sets.iter().find(|s| s.0.eq_ignore_ascii_case(set));
    if let Some(set) = found.filter(|s| !s.1.is_empty()) {
        return Ok(set);
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
