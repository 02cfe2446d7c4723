//! Stress at nodes from displacements of the nodes around: polynomial preserving recovery (Zhang and Naga, SIAM J. Sci. Comput. 26, 2005, 1192–1213), and what the
//! difference to the stress of the elements says of its error (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24, 1987, 337–357).
//!
//! ```text
//! u*(x) = Σ_j a_j p_j(x)          Σ_k |u*(x_k) − u_k|² → min          over the nodes x_k of the elements around a corner
//! σ* = D ε(u*)                    at the corner, and at the nodes beside it that are no corners (the mean of the patches that reach them)
//! η² = Σ_e ∫ (σ* − σ) : D⁺ (σ* − σ)                                   in an element σ* = Σ_a φ_a σ*_a
//! ```
//!
//! `p_j` are the polynomials of one degree more than the elements have, in the local coordinates of one of them, so that `σ*` is of one order more, at the boundary too. A
//! patch stays in one material and grows by the elements next to it until its nodes decide all polynomials; what a body that is one element thick does not decide is left
//! out.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Vector6};

use super::element::{Shape, StrainRows, of_gradients};
use super::law::Material;
use super::shape::{self, Integrand};
use super::stress::Stress;
use crate::mesh::point::dot;
use crate::mesh::{Element, Family, Point, bounds};

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

/// Products of powers of `ξ = A (x − centre)`, the local coordinates of an element over their extent in the patch.
#[derive(Debug, Clone)]
struct Polynomials {
    centre: Point,
    axes: [Point; 3],
    exponents: Vec<[i32; 3]>,
}

impl Polynomials {
    /// Those of a degree in the local coordinates of an element: of cubes in each of them, of prisms in those of its triangle and in the third, of simplices in all together.
    fn new(element: Shape, around: &[Point]) -> Polynomials {
        let (dim, degree) = (element.kind.dim(), 1 + element.kind.order() as i32);
        let centre = element.place(shape::centre(element.kind));
        let mut own = Polynomials { centre, axes: element.axes(), exponents: vec![] };
        let places: Vec<Point> = around.iter().map(|x| own.local(x)).collect();
        let [low, high] = bounds(&places);
        let middle: Point = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
        // an axis without extent decides nothing
        let half = |c: usize| if c < dim { 0.5 * (high[c] - low[c]) } else { 1.0 };
        let edges = element.edges();
        own.centre = std::array::from_fn(|c| {
            centre[c] + (0..dim).map(|d| middle[d] * edges[d][c]).sum::<f64>()
        });
        own.axes = std::array::from_fn(|d| own.axes[d].map(|a| a / half(d)));
        let upto = |c: usize| 0..=if c < dim { degree } else { 0 };
        for i in upto(0) {
            for j in upto(1) {
                own.exponents.extend(upto(2).map(|k| [i, j, k]));
            }
        }
        let together = |e: &[i32; 3]| match element.kind.family() {
            Family::Cube => true,
            Family::Prism => e[0] + e[1] <= degree,
            Family::Simplex => e.iter().sum::<i32>() <= degree,
        };
        own.exponents.retain(together);
        own.exponents.sort_by_key(|e| (e.iter().sum::<i32>(), *e.iter().max().unwrap_or(&0)));
        own
    }

    fn local(&self, place: &Point) -> Point {
        let off: Point = std::array::from_fn(|c| place[c] - self.centre[c]);
        self.axes.map(|a| dot(&a, &off))
    }

    fn at(&self, place: &Point) -> DVector<f64> {
        let x = self.local(place);
        let of = |e: &[i32; 3]| (0..3).map(|c| x[c].powi(e[c])).product();
        DVector::from_iterator(self.exponents.len(), self.exponents.iter().map(of))
    }

    /// Their derivatives along an axis of space.
    fn slopes(&self, place: &Point, axis: usize) -> DVector<f64> {
        let x = self.local(place);
        let along = |e: &[i32; 3], d: usize| -> f64 {
            let power = |c: usize| match c == d {
                true => f64::from(e[c]) * x[c].powi(e[c] - 1),
                false => x[c].powi(e[c]),
            };
            if e[d] == 0 { 0.0 } else { self.axes[d][axis] * (0..3).map(power).product::<f64>() }
        };
        let of = |e: &[i32; 3]| (0..3).map(|d| along(e, d)).sum();
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
        for corner in 0..self.points.len() {
            let regions = self.regions(corner).into_iter();
            for region in regions.filter(|region| self.is_corner(corner, *region)) {
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
        let corners: BTreeSet<usize> = match self.is_corner(node, region) {
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

    /// Whether some element of a material has its corner there.
    fn is_corner(&self, node: usize, region: usize) -> bool {
        self.of_region(node, region).any(|k| self.corners(k).any(|n| n == node))
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
        let (mut nodes, mut polynomials, wanted) = self.over(&elements);
        for _ in 0..LAYERS {
            if polynomials.exponents.len() == wanted {
                break;
            }
            let reached = elements.iter().flat_map(|&k| self.elements[k].nodes);
            elements = reached.flat_map(|&n| self.of_region(n, region)).collect();
            let (more, larger, _) = self.over(&elements);
            if larger.exponents.len() > polynomials.exponents.len() {
                (nodes, polynomials) = (more, larger);
            }
        }
        Patch::fitted(nodes, polynomials, self.points)
    }

    /// The nodes of elements and the polynomials that they decide, of so many.
    fn over(&self, elements: &BTreeSet<usize>) -> (Vec<usize>, Polynomials, usize) {
        let of = elements.iter().flat_map(|&k| self.elements[k].nodes.iter().copied());
        let nodes: Vec<usize> = of.collect::<BTreeSet<_>>().into_iter().collect();
        let place = |n: &usize| self.points[*n];
        let places: Vec<Point> = nodes.iter().map(place).collect();
        let Element { kind, nodes: first, .. } =
            self.elements[elements.first().copied().unwrap_or_default()];
        let x: Vec<Point> = first.iter().map(place).collect();
        let all = Polynomials::new(Shape { kind, x: &x }, &places);
        let count = all.exponents.len();
        (nodes, all.decided(&places), count)
    }
}

impl Patch {
    /// The coefficients of polynomials by least squares: `A = Q R`, `R⁻¹ Qᵀ`.
    fn fitted(nodes: Vec<usize>, polynomials: Polynomials, points: &[Point]) -> Patch {
        let columns: Vec<DVector<f64>> =
            nodes.iter().map(|&n| polynomials.at(&points[n])).collect();
        let factors = DMatrix::from_columns(&columns).transpose().qr();
        let mut coefficients = factors.q().transpose();
        // they are independent
        factors.r().solve_upper_triangular_mut(&mut coefficients);
        Patch { nodes, polynomials, coefficients }
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

#[cfg(test)]
mod tests {
    use super::super::law::StressState;
    use super::*;
    use crate::mesh::{ElementKind, structured};

    fn recovered(
        (points, elements): (&[Point], &[Element]),
        u: impl Fn(&Point) -> Point,
    ) -> Vec<Stress> {
        let state = StressState::PlaneStress { thickness: 1.0 };
        let material = Material { young: 2.0, poisson: 0.3, density: 1.0, state };
        let all = Recovery::new(points, elements).all();
        assert!(all.iter().map(|n| n.node).eq(0..points.len()));
        let at = |n: &AtNode| n.stress(&material, (&points[n.node], 2), |k| u(&points[k]));
        all.iter().map(at).collect()
    }

    /// `σ_xx` and `σ_xy` of these slopes by Hooke's law.
    fn hooke([ux, uy]: [f64; 2], [vx, vy]: [f64; 2]) -> [f64; 2] {
        [2.0 / 0.91 * (ux + 0.3 * vy), 2.0 / 2.6 * (uy + vx)]
    }

    /// `D⁺` of every state gives strains back from stresses that have some: `D D⁺ D = D`, to rounding, whatever E and ν are.
    #[test]
    fn compliances_invert_what_has_stress() {
        let states = [
            StressState::Uniaxial { area: 2.0 },
            StressState::PlaneStress { thickness: 1.0 },
            StressState::PlaneStrain { thickness: 1.0 },
            StressState::Axisymmetric,
            StressState::Solid,
        ];
        for (state, young, poisson) in states
            .into_iter()
            .flat_map(|s| [(s, 2.1e11, 0.3), (s, 1e-3, 0.0), (s, 1.0, -0.4), (s, 70.0, 0.49)])
        {
            let d = Material { young, poisson, density: 1.0, state }.stiffness();
            let inverse = d.pseudo_inverse(1e-12 * young).unwrap();
            let apart = (d * inverse * d - d).abs().max();
            assert!(apart < 1e-12 * d.abs().max(), "{state:?} {poisson}: {apart:e}");
        }
    }

    /// Quadratic displacements have their linear stress at every node of a skewed mesh, corners included, wherever it stands.
    #[test]
    fn quadratic_displacements_are_recovered() {
        let mesh = structured::rectangle(2.0, 1.0, 4, 3);
        let skewed = |p: &Point| [100.0 + p[0] + 0.3 * p[1], 0.1 * p[0] + p[1] - 7.0, 0.0];
        let points: Vec<Point> = mesh.nodes().iter().map(skewed).collect();
        let elements: Vec<Element> = mesh.elements().collect();
        let off = |p: &Point| [p[0] - 100.0, p[1] + 7.0];
        let found = recovered((&points, &elements), |p| {
            let [x, y] = off(p);
            [0.3 * x * x - x * y + 0.2 * y, 0.5 * y * y + 0.1 * x * y - 0.4 * x, 0.0]
        });
        for (p, s) in points.iter().zip(&found) {
            let [x, y] = off(p);
            let [xx, xy] = hooke([0.6 * x - y, 0.2 - x], [0.1 * y - 0.4, y + 0.1 * x]);
            assert!((s.xx - xx).abs() < 1e-11 && (s.xy - xy).abs() < 1e-11, "{p:?} {s:?}");
        }
    }

    /// One element thick a beam bends as its displacements say: `u = −xy` has `σ_xx = −E′y` at its faces. A single element has what its shape functions say.
    #[test]
    fn what_is_not_decided_is_left_out() {
        for mesh in [structured::rectangle(3.0, 0.5, 6, 1), structured::rectangle(1.0, 0.5, 1, 1)] {
            let elements: Vec<Element> = mesh.elements().collect();
            let found = recovered((mesh.nodes(), &elements), |p| [-p[0] * p[1], 0.0, 0.0]);
            for (p, s) in mesh.nodes().iter().zip(&found) {
                let [xx, xy] = hooke([-p[1], -p[0]], [0.0, 0.0]);
                assert!((s.xx - xx).abs() < 1e-12 && (s.xy - xy).abs() < 1e-12, "{p:?} {s:?}");
            }
        }
    }

    /// Materials do not mix: each side of an interface has its own slopes.
    #[test]
    fn patches_stay_in_one_material() {
        let mesh = structured::rectangle(2.0, 1.0, 4, 2);
        let of = |e: Element<'_>| usize::from(mesh.nodes()[e.nodes[0]][0] > 0.99);
        let all: Vec<Element> = mesh.elements().collect();
        let elements: Vec<Element> = all.iter().map(|e| Element { region: of(*e), ..*e }).collect();
        let nodes = Recovery::new(mesh.nodes(), &elements).all();
        let u = |p: &Point| if p[0] > 1.0 { 1.0 + 3.0 * (p[0] - 1.0) } else { p[0] };
        for n in &nodes {
            let slope: f64 = n.weights.iter().map(|(k, w)| w[0] * u(&mesh.nodes()[*k])).sum();
            assert!((slope - [1.0, 3.0][n.region]).abs() < 1e-12, "{n:?}");
        }
        assert_eq!(nodes.len(), mesh.n_nodes() + 3);
        let one = Recovery::new(mesh.nodes(), &elements).at(7, 1);
        assert!(nodes.contains(&one) || one.region == 1);
        assert_eq!(elements[0].kind, ElementKind::Quad4);
    }
}
