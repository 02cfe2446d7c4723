//! Stress at nodes from displacements of the nodes around: polynomial preserving recovery (Zhang and Naga, SIAM J. Sci. Comput. 26, 2005, 1192–1213), and what the
//! difference to the stress of the elements says of its error (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24, 1987, 337–357).
//!
//! ```text
//! u*(x) = Σ_j a_j p_j(x)          Σ_k |u*(x_k) − u_k|² → min          over the nodes x_k of the elements around a corner
//! σ* = D ε(u*)                    at the corner, and at the nodes beside it that are no corners (the mean of the patches that reach them)
//! η² = Σ_e ∫ (σ* − σ) : D⁺ (σ* − σ)                                   in an element σ* = Σ_a φ_a σ*_a
//! ```
//!
//! `p_j` are the polynomials of one degree more than the elements have, so that `σ*` is of one order more, at the boundary too. A patch stays in one material and grows
//! by the elements next to it until its nodes decide all polynomials; what a body that is one element thick does not decide is left out.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Vector6};

use super::element::{Shape, StrainRows, of_gradients};
use super::law::Material;
use super::shape::{self, Integrand};
use super::stress::Stress;
use crate::mesh::{Element, Point, bounds};

/// How often a patch grows.
const LAYERS: usize = 2;

/// A polynomial of which less than this is new at the nodes of a patch, over its size there, is not decided by them.
const NEW: f64 = 0.02;

/// The gradient of the displacement of a node in one of the materials around it: `∇u* = Σ_k u_k ⊗ w_k`.
#[derive(Debug, Clone, PartialEq)]
pub struct AtNode {
    /// Which node.
    pub node: usize,
    /// Which material.
    pub region: usize,
    /// Nodes `k`, and `w_k`.
    pub weights: Vec<(usize, Point)>,
}

impl AtNode {
    /// The stress as six rows over the components of the displacements of the nodes in [`AtNode::weights`], where this one stands at `place`.
    pub fn rows(&self, material: &Material, place: &Point, dim: usize) -> StrainRows {
        let gradients: Vec<Point> = self.weights.iter().map(|w| w.1).collect();
        let own = |k: &(usize, Point)| f64::from(u8::from(k.0 == self.node));
        let values = self.weights.iter().map(own).collect();
        material.stiffness() * of_gradients(gradients, (values, place[0]), (dim, material))
    }

    /// The stress.
    pub fn stress(
        &self,
        material: &Material,
        (place, dim): (&Point, usize),
        u: impl Fn(usize) -> Point,
    ) -> Stress {
        let rows = self.rows(material, place, dim);
        let mut sum = Vector6::zeros();
        for (k, (node, _)) in self.weights.iter().enumerate() {
            let u = u(*node);
            (0..dim).for_each(|c| sum += rows.column(dim * k + c) * u[c]);
        }
        Stress::of_vector(sum)
    }
}

/// Elements with what lies around their nodes.
#[derive(Debug)]
pub struct Recovery<'m> {
    points: &'m [Point],
    elements: &'m [Element<'m>],
    around: Vec<Vec<usize>>,
}

/// `u*` around a corner: the coefficients of its polynomials over its nodes.
struct Patch {
    nodes: Vec<usize>,
    polynomials: Polynomials,
    coefficients: DMatrix<f64>,
}

/// Products of powers of `(x − centre)/size`.
#[derive(Debug, Clone)]
struct Polynomials {
    centre: Point,
    size: Point,
    exponents: Vec<[i32; 3]>,
}

impl Polynomials {
    /// All of a degree; those with many factors before those with high powers.
    fn new((dim, degree): (usize, i32), around: &[Point]) -> Polynomials {
        let [low, high] = bounds(around);
        let half = |c: usize| 0.5 * (high[c] - low[c]);
        let largest = half(0).max(half(1)).max(half(2)).max(f64::MIN_POSITIVE);
        let upto = |c: usize| 0..=if c < dim { degree } else { 0 };
        let mut exponents = vec![];
        for i in upto(0) {
            for j in upto(1) {
                let of = |k: i32| [i, j, k];
                exponents.extend(upto(2).map(of).filter(|e| e.iter().sum::<i32>() <= degree));
            }
        }
        exponents.sort_by_key(|e| (e.iter().sum::<i32>(), *e.iter().max().unwrap_or(&0)));
        Polynomials {
            centre: std::array::from_fn(|c| 0.5 * (low[c] + high[c])),
            // an axis without extent decides nothing
            size: std::array::from_fn(|c| if half(c) > 1e-9 * largest { half(c) } else { largest }),
            exponents,
        }
    }

    fn local(&self, place: &Point) -> Point {
        std::array::from_fn(|c| (place[c] - self.centre[c]) / self.size[c])
    }

    fn at(&self, place: &Point) -> DVector<f64> {
        let x = self.local(place);
        let of = |e: &[i32; 3]| (0..3).map(|c| x[c].powi(e[c])).product();
        DVector::from_iterator(self.exponents.len(), self.exponents.iter().map(of))
    }

    /// Their derivatives along an axis.
    fn slopes(&self, place: &Point, axis: usize) -> DVector<f64> {
        let x = self.local(place);
        let power = |c: usize, e: i32| match c == axis {
            true if e == 0 => 0.0,
            true => f64::from(e) * x[c].powi(e - 1) / self.size[c],
            false => x[c].powi(e),
        };
        let of = |e: &[i32; 3]| (0..3).map(|c| power(c, e[c])).product();
        DVector::from_iterator(self.exponents.len(), self.exponents.iter().map(of))
    }

    /// Only those that are new at these places, each beside those before it.
    fn decided(mut self, places: &[Point]) -> Polynomials {
        let columns: Vec<DVector<f64>> = places.iter().map(|x| self.at(x)).collect();
        let rows = DMatrix::from_columns(&columns);
        let mut basis: Vec<DVector<f64>> = vec![];
        let mut is_new = |k: usize| {
            let whole = rows.row(k).transpose();
            let mut rest = whole.clone();
            // twice is enough
            for _ in 0..2 {
                basis.iter().for_each(|b| rest -= b * b.dot(&rest));
            }
            let decided = rest.norm() > NEW * whole.norm() && basis.len() < places.len();
            if decided {
                basis.push(rest.normalize());
            }
            decided
        };
        let exponents = self.exponents.clone();
        self.exponents =
            exponents.into_iter().enumerate().filter(|(k, _)| is_new(*k)).map(|(_, e)| e).collect();
        self
    }
}

impl<'m> Recovery<'m> {
    /// Of elements whose nodes stand at these points.
    pub fn new(points: &'m [Point], elements: &'m [Element<'m>]) -> Recovery<'m> {
        let mut around = vec![vec![]; points.len()];
        for (k, e) in elements.iter().enumerate() {
            e.nodes.iter().for_each(|&n| around[n].push(k));
        }
        Recovery { points, elements, around }
    }

    /// Of every node, in each of the materials around it.
    pub fn all(&self) -> Vec<AtNode> {
        let mut sums: BTreeMap<(usize, usize), Sum> = BTreeMap::new();
        for corner in (0..self.points.len()).filter(|&n| self.is_corner(n)) {
            for region in self.regions(corner) {
                let patch = self.patch(corner, region);
                for node in self.reached(corner, region) {
                    sums.entry((node, region)).or_default().add(&patch, &self.points[node]);
                }
            }
        }
        sums.into_iter().map(|((node, region), sum)| sum.mean(node, region)).collect()
    }

    /// Of one node in one of the materials around it.
    pub fn at(&self, node: usize, region: usize) -> AtNode {
        let mut sum = Sum::default();
        let corners: BTreeSet<usize> = match self.is_corner(node) {
            true => BTreeSet::from([node]),
            false => self.of_region(node, region).flat_map(|k| self.corners(k)).collect(),
        };
        corners.iter().for_each(|&c| sum.add(&self.patch(c, region), &self.points[node]));
        sum.mean(node, region)
    }

    /// The materials around a node.
    fn regions(&self, node: usize) -> BTreeSet<usize> {
        self.around[node].iter().map(|&k| self.elements[k].region).collect()
    }

    fn of_region(&self, node: usize, region: usize) -> impl Iterator<Item = usize> {
        self.around[node].iter().copied().filter(move |&k| self.elements[k].region == region)
    }

    fn corners(&self, element: usize) -> impl Iterator<Item = usize> {
        let Element { kind, nodes, .. } = self.elements[element];
        nodes[..kind.corners()].iter().copied()
    }

    /// Nodes are corners of all of their elements, or of none.
    fn is_corner(&self, node: usize) -> bool {
        self.around[node].first().is_some_and(|&k| self.corners(k).any(|n| n == node))
    }

    /// The nodes that a patch speaks for: its corner, and those around it that are no corners.
    fn reached(&self, corner: usize, region: usize) -> BTreeSet<usize> {
        let inner = |k: usize| {
            let Element { kind, nodes, .. } = self.elements[k];
            nodes[kind.corners()..].iter().copied()
        };
        self.of_region(corner, region).flat_map(inner).chain([corner]).collect()
    }

    /// The smallest patch of a corner that decides the most polynomials.
    fn patch(&self, corner: usize, region: usize) -> Patch {
        let mut elements: BTreeSet<usize> = self.of_region(corner, region).collect();
        let degree = 1 + self.elements[self.around[corner][0]].kind.order();
        let (mut best, wanted) = self.over(&elements, degree);
        for _ in 0..LAYERS {
            if best.exponents() == wanted {
                break;
            }
            let nodes = elements.iter().flat_map(|&k| self.elements[k].nodes);
            elements = nodes.flat_map(|&n| self.of_region(n, region)).collect();
            let (larger, _) = self.over(&elements, degree);
            if larger.exponents() > best.exponents() {
                best = larger;
            }
        }
        best.fitted(self.points)
    }

    /// The nodes of elements and the polynomials that they decide, of so many.
    fn over(&self, elements: &BTreeSet<usize>, degree: usize) -> (Patch, usize) {
        let of = elements.iter().flat_map(|&k| self.elements[k].nodes.iter().copied());
        let nodes: Vec<usize> = of.collect::<BTreeSet<_>>().into_iter().collect();
        let places: Vec<Point> = nodes.iter().map(|&n| self.points[n]).collect();
        let dim = elements.first().map_or(0, |&k| self.elements[k].kind.dim());
        let all = Polynomials::new((dim, degree as i32), &places);
        let count = all.exponents.len();
        let patch =
            Patch { nodes, polynomials: all.decided(&places), coefficients: DMatrix::zeros(0, 0) };
        (patch, count)
    }
}

impl Patch {
    fn exponents(&self) -> usize {
        self.polynomials.exponents.len()
    }

    /// With the coefficients of its polynomials, by least squares.
    fn fitted(mut self, points: &[Point]) -> Patch {
        let columns: Vec<DVector<f64>> =
            self.nodes.iter().map(|&n| self.polynomials.at(&points[n])).collect();
        let rows = DMatrix::from_columns(&columns).transpose();
        let inverse = rows.pseudo_inverse(0.0);
        // it refuses negative thresholds alone
        self.coefficients = inverse.unwrap_or_else(|_| DMatrix::zeros(columns.len(), 0));
        self
    }
}

/// What the patches that reach a node say of it.
#[derive(Default)]
struct Sum {
    weights: BTreeMap<usize, Point>,
    count: usize,
}

impl Sum {
    fn add(&mut self, patch: &Patch, place: &Point) {
        for axis in 0..3 {
            let weights = patch.coefficients.tr_mul(&patch.polynomials.slopes(place, axis));
            for (node, w) in patch.nodes.iter().zip(&weights) {
                self.weights.entry(*node).or_default()[axis] += w;
            }
        }
        self.count += 1;
    }

    fn mean(self, node: usize, region: usize) -> AtNode {
        let share = 1.0 / self.count as f64;
        let weights = self.weights.into_iter().map(|(n, w)| (n, w.map(|w| share * w))).collect();
        AtNode { node, region, weights }
    }
}

/// Energies of an element, twice: of the difference between its stress and the recovered one of its nodes, `∫ (σ* − σ) : D⁺ (σ* − σ)`, and of its stress, `∫ σ : D⁺ σ`.
pub fn energies(
    material: &Material,
    element: Shape,
    (u, nodal): (&[Point], &[Stress]),
) -> [f64; 2] {
    // in plane stress and of a bar only some strains have a stress
    let compliance = material.stiffness().pseudo_inverse(1e-12 * material.young);
    let compliance = compliance.unwrap_or_else(|_| nalgebra::Matrix6::zeros());
    let mut all = [0.0; 2];
    for (local, weight) in shape::rule(element.kind, Integrand::Mass, material.is_radial()) {
        let values = shape::values(element.kind, local);
        let radius = element.place(local)[0];
        let volume = weight * element.determinant(local) * material.measure(radius);
        let own = Stress::at(material, element, local, u);
        let smooth = Stress::sum(values.into_iter().zip(nodal.iter().copied()));
        let energy = |s: Vector6<f64>| volume * s.dot(&(compliance * s));
        all[0] += energy(smooth.vector() - own.vector());
        all[1] += energy(own.vector());
    }
    all
}
