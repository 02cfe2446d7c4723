//! Stress at nodes, recovered from where the elements have it best: superconvergent patch recovery (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 33, 1992,
//! 1331–1364 and 1365–1382).
//!
//! ```text
//! σ*(x) = Σ_j a_j p_j(x)          Σ_k |σ*(x_k) − D B u(x_k)|² → min          over the points x_k of the elements around a corner
//! η² = Σ_e ∫ (σ* − D B u) : D⁺ (σ* − D B u)                                  in an element σ* = Σ_a φ_a σ*_a
//! ```
//!
//! `p_j` are the polynomials of the order of the elements; nodes that are no corners have the mean of the patches that reach them. A patch stays in one material, and
//! grows by the elements next to it where its points do not decide the polynomials, at the boundary: the weights of the points at the node, whose sum is one, add up to
//! no more than [`EXTRAPOLATION`] without their signs. A body that is one element thick takes the points of integration in place of the best ones, then polynomials of
//! lower order.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::element::Shape;
use super::law::Material;
use super::shape::{self, Integrand, Local};
use super::stress::Stress;
use crate::mesh::{Element, ElementKind, Point, bounds};

/// `Σ|w|` of the weights of a node at most: how far a patch may be extrapolated.
const EXTRAPOLATION: f64 = 8.0;

/// How often a patch grows.
const LAYERS: usize = 3;

/// The points of an element that a patch reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Points {
    /// Where its stress is most accurate.
    Best,
    /// Those of its stiffness.
    Integration,
}

impl Points {
    fn of(self, kind: ElementKind) -> Vec<Local> {
        match self {
            Points::Best => shape::superconvergent(kind),
            Points::Integration => {
                shape::rule(kind, Integrand::Stiffness, false).into_iter().map(|p| p.0).collect()
            }
        }
    }
}

/// A point of an element whose stress is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Sample {
    element: usize,
    points: Points,
    index: usize,
}

/// A node in one of the materials around it: what the stress at places of elements weighs in its own.
#[derive(Debug, Clone, PartialEq)]
pub struct AtNode {
    /// Which node.
    pub node: usize,
    /// Which material.
    pub region: usize,
    /// Number of the place in [`Recovered::places`], weight.
    pub weights: Vec<(usize, f64)>,
}

/// How stress at nodes follows from that at places of elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovered {
    /// Elements and places in them.
    pub places: Vec<(usize, Local)>,
    /// Nodes, in each of their materials.
    pub nodes: Vec<AtNode>,
}

impl Recovered {
    /// `σ*` of the nodes where the elements have these stresses at their places.
    pub fn of(&self, stress: impl Fn(usize, Local) -> Stress) -> Vec<Stress> {
        let at: Vec<Stress> = self.places.iter().map(|&(k, local)| stress(k, local)).collect();
        let sum = |n: &AtNode| Stress::sum(n.weights.iter().map(|&(k, w)| (w, at[k])));
        self.nodes.iter().map(sum).collect()
    }
}

/// Elements with what lies around their nodes.
#[derive(Debug)]
pub struct Recovery<'m> {
    points: &'m [Point],
    elements: &'m [Element<'m>],
    around: Vec<Vec<usize>>,
}

/// `σ*` around a corner: the coefficients of its polynomials over its samples.
struct Patch {
    samples: Vec<Sample>,
    polynomials: Polynomials,
    coefficients: DMatrix<f64>,
}

/// All polynomials of a degree in `(x − centre)/size`.
#[derive(Debug, Clone)]
struct Polynomials {
    centre: Point,
    size: Point,
    exponents: Vec<[i32; 3]>,
}

impl Polynomials {
    fn new((dim, degree): (usize, usize), around: &[Point]) -> Polynomials {
        let [low, high] = bounds(around);
        let half = |c: usize| 0.5 * (high[c] - low[c]);
        // an axis without extent decides nothing
        let least = 1e-6 * half(0).max(half(1)).max(half(2)).max(f64::MIN_POSITIVE);
        let count = degree as i32;
        let upto = |c: usize| 0..=if c < dim { count } else { 0 };
        let mut exponents = vec![];
        for i in upto(0) {
            for j in upto(1) {
                exponents
                    .extend(upto(2).map(|k| [i, j, k]).filter(|e| e.iter().sum::<i32>() <= count));
            }
        }
        Polynomials {
            centre: std::array::from_fn(|c| 0.5 * (low[c] + high[c])),
            size: std::array::from_fn(|c| half(c).max(least)),
            exponents,
        }
    }

    fn at(&self, place: &Point) -> DVector<f64> {
        let x = |c: usize| (place[c] - self.centre[c]) / self.size[c];
        let x = [x(0), x(1), x(2)];
        let of = |e: &[i32; 3]| (0..3).map(|c| x[c].powi(e[c])).product();
        DVector::from_iterator(self.exponents.len(), self.exponents.iter().map(of))
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
    pub fn all(&self) -> Recovered {
        let mut sums: BTreeMap<(usize, usize), Sum> = BTreeMap::new();
        for corner in (0..self.points.len()).filter(|&n| self.is_corner(n)) {
            for region in self.regions(corner) {
                let patch = self.patch(corner, region);
                for node in self.reached(corner, region) {
                    sums.entry((node, region)).or_default().add(&patch, &self.points[node]);
                }
            }
        }
        self.recovered(sums)
    }

    /// Of some nodes, each in one of the materials around it.
    pub fn at(&self, nodes: impl IntoIterator<Item = (usize, usize)>) -> Recovered {
        let sum = |(node, region): (usize, usize)| {
            let mut sum = Sum::default();
            let corners: BTreeSet<usize> = match self.is_corner(node) {
                true => BTreeSet::from([node]),
                false => self.of_region(node, region).flat_map(|k| self.corners(k)).collect(),
            };
            corners.iter().for_each(|&c| sum.add(&self.patch(c, region), &self.points[node]));
            ((node, region), sum)
        };
        self.recovered(nodes.into_iter().map(sum).collect())
    }

    /// The materials around a node.
    pub fn regions(&self, node: usize) -> BTreeSet<usize> {
        self.around[node].iter().map(|&k| self.elements[k].region).collect()
    }

    fn recovered(&self, sums: BTreeMap<(usize, usize), Sum>) -> Recovered {
        let samples: BTreeSet<Sample> =
            sums.values().flat_map(|s| s.weights.keys()).copied().collect();
        let number: BTreeMap<Sample, usize> = samples.iter().copied().zip(0..).collect();
        let place = |s: &Sample| (s.element, s.points.of(self.elements[s.element].kind)[s.index]);
        let mean = |((node, region), sum): ((usize, usize), Sum)| {
            let share = 1.0 / sum.count as f64;
            let weights = sum.weights.iter().map(|(s, w)| (number[s], share * w)).collect();
            AtNode { node, region, weights }
        };
        Recovered {
            places: samples.iter().map(place).collect(),
            nodes: sums.into_iter().map(mean).collect(),
        }
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

    /// The smallest patch of a corner that decides its polynomials there; in the end the mean of all points, which always is one.
    fn patch(&self, corner: usize, region: usize) -> Patch {
        let mut elements: BTreeSet<usize> = self.of_region(corner, region).collect();
        let mut patches = vec![elements.clone()];
        for _ in 0..LAYERS {
            let nodes = elements.iter().flat_map(|&k| self.elements[k].nodes);
            let next: BTreeSet<usize> = nodes.flat_map(|&n| self.of_region(n, region)).collect();
            if next.len() == elements.len() {
                break;
            }
            patches.push(next.clone());
            elements = next;
        }
        let quadratic = self.around[corner].iter().any(|&k| self.elements[k].kind.is_quadratic());
        let order = if quadratic { 2 } else { 1 };
        for degree in (1..=order).rev() {
            for points in [Points::Best, Points::Integration] {
                let mut all = patches.iter();
                let found = all.find_map(|of| self.fitted(corner, of, (degree, points)));
                if let Some(patch) = found {
                    return patch;
                }
            }
        }
        let (samples, places) = self.samples(&patches[0], Points::Best);
        let share = 1.0 / samples.len() as f64;
        Patch {
            polynomials: Polynomials::new((0, 0), &places),
            coefficients: DMatrix::from_element(1, samples.len(), share),
            samples,
        }
    }

    /// The fit over these elements, if it decides the stress at the corner.
    fn fitted(
        &self,
        corner: usize,
        elements: &BTreeSet<usize>,
        (degree, points): (usize, Points),
    ) -> Option<Patch> {
        let dim = self.elements[*elements.first()?].kind.dim();
        let (samples, places) = self.samples(elements, points);
        let polynomials = Polynomials::new((dim, degree), &places);
        let terms = polynomials.exponents.len();
        if samples.len() < terms {
            return None;
        }
        let columns: Vec<DVector<f64>> = places.iter().map(|x| polynomials.at(x)).collect();
        let svd = DMatrix::from_columns(&columns).transpose().svd(true, true);
        let [most, least] = [svd.singular_values.max(), svd.singular_values.min()];
        if least <= 1e-8 * most {
            return None;
        }
        let coefficients = svd.pseudo_inverse(0.0).ok()?;
        let patch = Patch { samples, polynomials, coefficients };
        let stretch: f64 = patch.weights(&self.points[corner]).iter().map(|w| w.abs()).sum();
        (stretch <= EXTRAPOLATION).then_some(patch)
    }

    fn samples(&self, elements: &BTreeSet<usize>, points: Points) -> (Vec<Sample>, Vec<Point>) {
        let of = |&element: &usize| {
            let Element { kind, nodes, .. } = self.elements[element];
            let x: Vec<Point> = nodes.iter().map(|&n| self.points[n]).collect();
            let place = move |(index, local): (usize, Local)| {
                (Sample { element, points, index }, Shape { kind, x: &x }.place(local))
            };
            points.of(kind).into_iter().enumerate().map(place)
        };
        elements.iter().flat_map(of).unzip()
    }
}

impl Patch {
    /// What the samples weigh at a place.
    fn weights(&self, place: &Point) -> DVector<f64> {
        self.coefficients.tr_mul(&self.polynomials.at(place))
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
        let energy = |s: nalgebra::Vector6<f64>| volume * s.dot(&(compliance * s));
        all[0] += energy(smooth.vector() - own.vector());
        all[1] += energy(own.vector());
    }
    all
}

/// What the patches that reach a node say of it.
#[derive(Default)]
struct Sum {
    weights: BTreeMap<Sample, f64>,
    count: usize,
}

impl Sum {
    fn add(&mut self, patch: &Patch, place: &Point) {
        for (sample, w) in patch.samples.iter().zip(&patch.weights(place)) {
            *self.weights.entry(*sample).or_default() += w;
        }
        self.count += 1;
    }
}
