//! Sides of two surfaces, and the points at which both are integrated.

use std::collections::BTreeMap;

use super::super::element::Shape;
use super::super::shape::{self, Integrand};
use crate::mesh::point::{cross, norm, unit};
use crate::mesh::{ElementKind, Facet, Mesh, Point};

/// A side of one of the surfaces.
#[derive(Debug, Clone)]
pub struct Patch {
    kind: ElementKind,
    side: usize,
    /// Its nodes: ends, then the middle; of a face in the order of its kind.
    pub nodes: Vec<usize>,
    /// Their places.
    pub x: Vec<Point>,
    /// Outward normal, the mean of its points.
    pub normal: Point,
    /// Its length or area.
    pub size: f64,
    /// How many of its nodes are ends or corners: the first.
    pub corners: usize,
}

/// A place of a side: its functions, and where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    pub values: Vec<f64>,
    pub place: Point,
    /// Derivatives of the place along the side's own coordinates.
    pub tangents: [Point; 2],
}

/// Points of Gauss on a segment: exact for products of functions on quadratic lines, of rings too.
pub const POINTS: usize = 6;

impl Spot {
    /// Length or area there over that in the side's own coordinates.
    pub fn stretch(&self, patch: &Patch) -> f64 {
        match patch.face() {
            Some(_) => norm(&cross(&self.tangents[0], &self.tangents[1])),
            None => norm(&self.tangents[0]),
        }
    }
}

/// A point at which both sides are integrated.
#[derive(Debug, Clone, PartialEq)]
pub struct Meet {
    /// Which side of the slave.
    pub slave: usize,
    /// Which side of the master.
    pub master: usize,
    /// Share of the slave's length or area.
    pub weight: f64,
    pub place: Point,
    /// Functions of the slave's side, and of the master's.
    pub own: Vec<f64>,
    pub theirs: Vec<f64>,
}

impl Patch {
    pub fn new(mesh: &Mesh, facet: Facet) -> Patch {
        let element = mesh.element(facet);
        let local = element.kind.side(facet.side);
        let all = mesh.corners(element);
        let points = (Shape { kind: element.kind, x: &all }).side(facet.side);
        let sum = points
            .iter()
            .fold([0.0; 3], |s: Point, p| std::array::from_fn(|c| s[c] + p.area * p.normal[c]));
        Patch {
            kind: element.kind,
            side: facet.side,
            nodes: local.iter().map(|&l| element.nodes[l]).collect(),
            x: local.iter().map(|&l| all[l]).collect(),
            normal: unit(sum),
            size: points.iter().map(|p| p.area).sum(),
            corners: element.kind.side_corners(facet.side),
        }
    }

    /// A place in its own coordinates.
    pub fn at(&self, s: [f64; 2]) -> Spot {
        let of = match self.nodes.len() {
            // the end of a bar
            1 => vec![(1.0, [0.0; 2])],
            _ => shape::on_side(self.kind, self.side, s),
        };
        let weighted = |weight: &dyn Fn(usize) -> f64| -> Point {
            let add =
                |sum: Point, k: usize| std::array::from_fn(|c| sum[c] + weight(k) * self.x[k][c]);
            (0..of.len()).fold([0.0; 3], add)
        };
        Spot {
            place: weighted(&|k| of[k].0),
            tangents: [0, 1].map(|c| weighted(&|k| of[k].1[c])),
            values: of.iter().map(|f| f.0).collect(),
        }
    }

    /// The plane element that a face is; none of a line.
    pub fn face(&self) -> Option<ElementKind> {
        self.kind.face(self.side)
    }
}

/// What belongs to each node of a surface, `∫φ`.
pub fn areas(patches: &[Patch], measure: &dyn Fn(Point) -> f64) -> BTreeMap<usize, f64> {
    let mut all = BTreeMap::new();
    for patch in patches {
        let rule: Vec<([f64; 2], f64)> = match patch.face() {
            Some(face) => {
                let of = |(at, w): (shape::Local, f64)| ([at[0], at[1]], w);
                shape::rule(face, Integrand::Mass, false).into_iter().map(of).collect()
            }
            None if patch.nodes.len() == 1 => vec![([0.0; 2], 1.0)],
            None => shape::gauss(POINTS).into_iter().map(|(s, w)| ([s, 0.0], w)).collect(),
        };
        for (at, weight) in rule {
            let spot = patch.at(at);
            let size = if patch.nodes.len() == 1 { 1.0 } else { spot.stretch(patch) };
            let whole = weight * size * measure(spot.place);
            for (node, value) in patch.nodes.iter().zip(&spot.values) {
                *all.entry(*node).or_insert(0.0) += whole * value;
            }
        }
    }
    all
}
