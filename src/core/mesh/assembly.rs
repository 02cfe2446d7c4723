//! Parts of a deck, their instances, and what ties them, as one part.
//!
//! An instance is its part, moved and then turned about an axis in space. Where there are several, sets and surfaces of a part are called `INSTANCE.NAME`, and nodes and elements are numbered on. A tie makes
//! the nodes of its first surface those of its second, where each has a partner there.

use std::collections::{HashMap, HashSet};

use super::gmsh::GmshError;
use super::listed::corners;
use super::point::{minus, norm};
use super::{ElementKind, Point};

/// A member of a set: a number, one in an instance, or another set.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Member {
    Number(i64),
    In(usize, i64),
    Set(String),
}

/// A face of a surface: its line, an element or set, the number behind S.
pub(super) type Face = (usize, Member, usize);

/// Sets by name, in the order in which they came.
#[derive(Debug, Clone, Default)]
pub(super) struct Sets(pub Vec<(String, Vec<Member>)>);

impl Sets {
    pub fn add(&mut self, name: &str, members: impl IntoIterator<Item = Member>) {
        match self.0.iter_mut().find(|s| s.0.eq_ignore_ascii_case(name)) {
            Some(set) => set.1.extend(members),
            None => self.0.push((name.to_owned(), members.into_iter().collect())),
        }
    }

    /// All numbers of a set; sets within sets, each once.
    pub fn numbers(&self, name: &str) -> HashSet<i64> {
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
                    Member::Number(n) | Member::In(_, n) => {
                        found.insert(*n);
                    }
                    Member::Set(name) => open.push(name.clone()),
                }
            }
        }
        found
    }
}

/// Nodes, elements and their sets.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub nodes: Vec<(i64, Point)>,
    pub place: HashMap<i64, usize>,
    pub elements: Vec<(i64, ElementKind, Vec<usize>)>,
    pub node_sets: Sets,
    pub element_sets: Sets,
    /// Surfaces: element or set, and its face.
    pub surfaces: Vec<(String, Vec<Face>)>,
}

/// A part where it stands.
#[derive(Debug, Clone, Default)]
pub(super) struct Instance {
    pub name: String,
    pub part: Part,
    pub shift: Point,
    /// Two points of an axis, and an angle in degrees.
    pub turn: Option<([Point; 2], f64)>,
}

/// Two surfaces whose nodes are the same.
#[derive(Debug, Clone)]
pub(super) struct Tie {
    pub line: usize,
    pub slave: String,
    pub master: String,
    /// How far apart partners may be.
    pub tolerance: Option<f64>,
    /// Nodes of the slave may be moved to their partners.
    pub moves: bool,
}

/// Everything of a deck.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    /// What stands outside of parts and instances.
    pub whole: Part,
    pub parts: Vec<(String, Part)>,
    pub instances: Vec<Instance>,
    pub ties: Vec<Tie>,
    /// Nodes and sets in equations.
    pub coupled: Vec<String>,
}

pub(super) fn error(line: usize, message: impl Into<String>, help: &str) -> GmshError {
    GmshError { line, section: String::new(), message: message.into(), help: help.into() }
}

impl Instance {
    /// Where a place of the part is: moved first, then turned.
    fn at(&self, p: Point) -> Point {
        let p: Point = std::array::from_fn(|c| p[c] + self.shift[c]);
        let Some(([a, b], degrees)) = self.turn else { return p };
        let axis = minus(&b, &a);
        let length = norm(&axis);
        let n = axis.map(|x| x / length);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let r = minus(&p, &a);
        let along: f64 = (0..3).map(|c| n[c] * r[c]).sum();
        let across = |c: usize| n[(c + 1) % 3] * r[(c + 2) % 3] - n[(c + 2) % 3] * r[(c + 1) % 3];
        // Rodrigues
        std::array::from_fn(|c| a[c] + cos * r[c] + sin * across(c) + (1.0 - cos) * along * n[c])
    }
}

impl Assembly {
    /// All of it as one part.
    pub fn part(mut self) -> Result<Part, GmshError> {
        if self.instances.is_empty() {
            match self.parts.len() {
                0 => {}
                1 => {
                    let (_, part) = self.parts.remove(0);
                    self.instances.push(Instance { part, ..Instance::default() });
                }
                n => {
                    let message = format!("has {n} parts, and no *INSTANCE says where they are");
                    return Err(error(0, message, "write the deck with its assembly, or flat"));
                }
            }
        }
        let whole = std::mem::take(&mut self.whole);
        let mut all = if self.instances.is_empty() { whole.clone() } else { Part::default() };
        let mut first: Vec<[i64; 2]> = vec![];
        let alone = self.instances.len() == 1;
        for instance in &self.instances {
            first.push(all.append(instance, alone));
        }
        if !self.instances.is_empty() {
            all.take_sets(&whole, |member, elements| match member {
                Member::Number(n) => Member::Number(*n),
                Member::In(k, n) => Member::Number(first[*k][usize::from(elements)] + n),
                Member::Set(name) => Member::Set(self.plain(name, alone)),
            });
        }
        for tie in &self.ties {
            let name = |word: &str| self.plain(word, alone);
            all.tie(tie, [name(&tie.slave), name(&tie.master)])?;
        }
        Ok(all)
    }

    /// What a set is called here: that of the only instance without its name.
    fn plain(&self, name: &str, alone: bool) -> String {
        let own = self.instances.first().filter(|_| alone);
        let inner = own.and_then(|i| {
            let (instance, set) = name.split_once('.')?;
            instance.eq_ignore_ascii_case(&i.name).then(|| set.to_owned())
        });
        inner.unwrap_or_else(|| name.to_owned())
    }
}

impl Part {
    /// The faces of a surface, as elements and their sides.
    pub fn sides(&self, name: &str, faces: &[Face]) -> Result<Vec<(usize, usize)>, GmshError> {
        let place_of: HashMap<i64, usize> =
            self.elements.iter().enumerate().map(|(k, e)| (e.0, k)).collect();
        let mut own = vec![];
        for (line, member, face) in faces {
            let elements: Vec<i64> = match member {
                Member::Number(n) | Member::In(_, n) => vec![*n],
                Member::Set(set) => {
                    let mut all: Vec<i64> = self.element_sets.numbers(set).into_iter().collect();
                    all.sort_unstable();
                    all
                }
            };
            for n in elements {
                let Some(&element) = place_of.get(&n) else {
                    let message = format!(
                        "surface \"{name}\" names element {n}, which the deck does not have"
                    );
                    return Err(error(*line, message, "write the deck anew"));
                };
                let (_, kind, nodes) = &self.elements[element];
                let Some(of_face) = faces_of(*kind).get(face - 1) else {
                    let message = format!("element {n} has no face S{face}");
                    return Err(error(*line, message, "write the deck anew"));
                };
                let mut wanted: Vec<usize> = of_face.iter().map(|&c| nodes[c - 1]).collect();
                wanted.sort_unstable();
                let side = (0..kind.sides()).find(|&s| corners(*kind, nodes, s) == wanted);
                own.extend(side.map(|side| (element, side)));
            }
        }
        Ok(own)
    }

    /// Take an instance in; what is added to the numbers of its nodes and elements.
    fn append(&mut self, instance: &Instance, alone: bool) -> [i64; 2] {
        let part = &instance.part;
        let highest = |numbers: &mut dyn Iterator<Item = i64>| numbers.max().unwrap_or(0).max(0);
        let first = [
            highest(&mut self.nodes.iter().map(|n| n.0)),
            highest(&mut self.elements.iter().map(|e| e.0)),
        ];
        let places = self.nodes.len();
        for (k, (tag, p)) in part.nodes.iter().enumerate() {
            self.place.insert(first[0] + tag, places + k);
            self.nodes.push((first[0] + tag, instance.at(*p)));
        }
        self.elements.extend(part.elements.iter().map(|(tag, kind, nodes)| {
            (first[1] + tag, *kind, nodes.iter().map(|n| places + n).collect())
        }));
        let called = |name: &str| match alone {
            true => name.to_owned(),
            false => format!("{}.{name}", instance.name),
        };
        let mut renamed = part.clone();
        renamed.node_sets.0.iter_mut().for_each(|s| s.0 = called(&s.0));
        renamed.element_sets.0.iter_mut().for_each(|s| s.0 = called(&s.0));
        renamed.surfaces.iter_mut().for_each(|s| s.0 = called(&s.0));
        self.take_sets(&renamed, |member, elements| match member {
            Member::Number(n) | Member::In(_, n) => {
                Member::Number(first[usize::from(elements)] + n)
            }
            Member::Set(name) => Member::Set(called(name)),
        });
        first
    }

    /// Take the sets and surfaces of another part in; `member` says what is a member here, of nodes or of elements.
    fn take_sets(&mut self, other: &Part, member: impl Fn(&Member, bool) -> Member) {
        for (name, members) in &other.node_sets.0 {
            self.node_sets.add(name, members.iter().map(|m| member(m, false)));
        }
        for (name, members) in &other.element_sets.0 {
            self.element_sets.add(name, members.iter().map(|m| member(m, true)));
        }
        let face = |(line, m, face): &Face| (*line, member(m, true), *face);
        let surfaces = other.surfaces.iter();
        self.surfaces
            .extend(surfaces.map(|(name, own)| (name.clone(), own.iter().map(face).collect())));
    }

    /// Make the nodes of one surface those of another.
    fn tie(&mut self, tie: &Tie, [slave, master]: [String; 2]) -> Result<(), GmshError> {
        let nodes_of = |name: &str| -> Result<Vec<usize>, GmshError> {
            let found = self.surfaces.iter().find(|s| s.0.eq_ignore_ascii_case(name));
            let Some((_, faces)) = found else {
                let message =
                    format!("*TIE names the surface \"{name}\", which the deck does not have");
                return Err(error(tie.line, message, "tie surfaces of elements (TYPE=ELEMENT)"));
            };
            let sides = self.sides(name, faces)?;
            let of = |(element, side): (usize, usize)| {
                let (_, kind, nodes) = &self.elements[element];
                kind.side(side).iter().map(|&l| nodes[l]).collect::<Vec<_>>()
            };
            let mut all: Vec<usize> = sides.into_iter().flat_map(of).collect();
            all.sort_unstable();
            all.dedup();
            Ok(all)
        };
        let (slaves, masters) = (nodes_of(&slave)?, nodes_of(&master)?);
        let away = |a: usize, b: usize| norm(&minus(&self.nodes[a].1, &self.nodes[b].1));
        let spread =
            |all: &[usize]| all.iter().skip(1).map(|&b| away(all[0], b)).fold(0.0f64, f64::max);
        // as Abaqus by default: a twentieth of an element. Further off elements would be bent
        let most = 0.05 * spread(&masters) / (masters.len() as f64).sqrt();
        let most = if tie.moves { most } else { 1e-4 * most };
        let within = tie.tolerance.map_or(most, |t| t.min(most));
        let mut now: HashMap<usize, usize> = HashMap::new();
        for &s in &slaves {
            let nearest =
                masters.iter().copied().min_by(|a, b| away(s, *a).total_cmp(&away(s, *b)));
            let Some(m) = nearest.filter(|m| away(s, *m) <= within) else {
                let message = format!(
                    "*TIE of \"{slave}\" to \"{master}\": node {} has no partner within {within:.3e}",
                    self.nodes[s].0
                );
                let help = "mesh both surfaces alike; or give the parts decks of their own as [[body]] and a pair of surfaces with gap = 0";
                return Err(error(tie.line, message, help));
            };
            if s != m {
                now.insert(s, m);
            }
        }
        // nodes that went leave their numbers
        let root = |mut n: usize| {
            while let Some(&next) = now.get(&n) {
                n = next;
            }
            n
        };
        let mut place = vec![usize::MAX; self.nodes.len()];
        let mut kept = vec![];
        for (k, node) in self.nodes.iter().enumerate() {
            if !now.contains_key(&k) {
                place[k] = kept.len();
                kept.push(*node);
            }
        }
        let new = |n: usize| place[root(n)];
        self.elements.iter_mut().for_each(|e| e.2.iter_mut().for_each(|n| *n = new(*n)));
        self.place.values_mut().for_each(|n| *n = new(*n));
        self.nodes = kept;
        Ok(())
    }
}

/// Corners of the faces that decks call S1, S2, …, from 1.
fn faces_of(kind: ElementKind) -> &'static [&'static [usize]] {
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
