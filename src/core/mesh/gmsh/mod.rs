//! Meshes of Gmsh: format 4.1 and 2.2, ASCII, with physical groups.
//!
//! [`read`] gives what the file says ([`File`]); [`File::body`] the mesh of the body in it: its cells by kind and material regions, and the sides that its groups
//! name. Errors name the line and the section, or the tags that Gmsh shows.

mod body;
mod read;
mod topology;

use std::collections::BTreeMap;

use thiserror::Error;

use super::{ElementKind, Point};

pub use body::{Imported, Sides};
pub use read::read;

/// Why a file cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}{message}; {help}", at(*line, section))]
pub struct GmshError {
    /// Line, from 1; 0 where the file as a whole is meant.
    pub line: usize,
    /// The section.
    pub section: String,
    /// What is wrong.
    pub message: String,
    /// What helps.
    pub help: String,
}

fn at(line: usize, section: &str) -> String {
    match (line, section.is_empty()) {
        (0, _) => String::new(),
        (line, true) => format!("line {line}: "),
        (line, false) => format!("line {line}, ${section}: "),
    }
}

impl GmshError {
    /// Where in the file: `line 3, $Nodes: `.
    pub fn place(&self) -> String {
        at(self.line, &self.section)
    }

    /// About the file as a whole.
    fn of_file(message: impl Into<String>, help: impl Into<String>) -> GmshError {
        GmshError { line: 0, section: String::new(), message: message.into(), help: help.into() }
    }
}

/// How an element is called and what it is to this program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Type {
    /// Number in files.
    pub number: usize,
    /// Name.
    pub name: &'static str,
    /// Dimension.
    pub dim: usize,
    /// Nodes.
    pub nodes: usize,
}

/// Types of element that the reader knows: those that a body has no use for, and every kind of element.
pub fn types() -> impl Iterator<Item = Type> {
    let other = [(15, "point", 0, 1), (8, "line of 3 nodes", 1, 3), (7, "pyramid", 3, 5)];
    let other = other.map(|(number, name, dim, nodes)| Type { number, name, dim, nodes });
    let of_kind = |kind: ElementKind| {
        let (number, name) = kind.gmsh();
        Type { number, name, dim: kind.dim(), nodes: kind.nodes() }
    };
    other.into_iter().chain(ElementKind::ALL.into_iter().map(of_kind))
}

impl Type {
    /// The kind of element that fills the plane or space.
    pub fn kind(&self) -> Option<ElementKind> {
        let own = |k: &ElementKind| k.gmsh().0 == self.number && self.dim > 1;
        ElementKind::ALL.into_iter().find(own)
    }
}

/// An element as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Its tag.
    pub tag: i64,
    /// Its type.
    pub of: Type,
    /// Tags of its physical groups, of its own dimension.
    pub groups: Vec<i64>,
    /// Places of its nodes in the list of nodes.
    pub nodes: Vec<usize>,
}

/// What a file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct File {
    /// `4.1` or `2.2`.
    pub version: String,
    /// Tags and places of the nodes.
    pub nodes: Vec<(i64, Point)>,
    /// Elements.
    pub cells: Vec<Cell>,
    /// Names of physical groups by dimension and tag.
    pub names: BTreeMap<(usize, i64), String>,
}

impl File {
    /// Name of a physical group: `#3` if the file gives none.
    pub fn name(&self, dim: usize, tag: i64) -> String {
        self.names.get(&(dim, tag)).cloned().unwrap_or_else(|| format!("#{tag}"))
    }

    /// The name of the group that a scene calls by name, or `#3` by tag.
    pub fn named(&self, dim: usize, word: &str) -> String {
        let tag = word.strip_prefix('#').and_then(|t| t.parse::<i64>().ok());
        tag.map_or_else(|| word.to_owned(), |tag| self.name(dim, tag))
    }

    /// The groups that have elements: dimension, tag, name, number of elements.
    pub fn groups(&self) -> Vec<(usize, i64, String, usize)> {
        let mut count: BTreeMap<(usize, i64), usize> = self.names.keys().map(|k| (*k, 0)).collect();
        for cell in &self.cells {
            for &tag in &cell.groups {
                *count.entry((cell.of.dim, tag)).or_default() += 1;
            }
        }
        count.into_iter().map(|((dim, tag), n)| (dim, tag, self.name(dim, tag), n)).collect()
    }

    /// How many elements there are of each type.
    pub fn types(&self) -> Vec<(Type, usize)> {
        let count = |t: &Type| self.cells.iter().filter(|c| c.of.number == t.number).count();
        types().map(|t| (t, count(&t))).filter(|(_, n)| *n > 0).collect()
    }

    /// The largest dimension of an element.
    pub fn dim(&self) -> usize {
        self.cells.iter().map(|c| c.of.dim).max().unwrap_or(0)
    }
}
