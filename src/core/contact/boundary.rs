//! Contact stress from the displacement field: `λ = G⁻¹ R u = N_C u_C + N_O u_O` (seed eq. 5, theory §2).
//!
//! `R_i = ∫_Γc P_i σ_n(P u) ds`, taken element by element from inside; `G_ij = ∫_Γc P_i P_j ds`.
//! Both carry the thickness (or cross-section), which cancels.

use std::collections::HashMap;

use nalgebra::DMatrix;

use super::coupling::Coupling;
use crate::fem::shape::{self, Local};
use crate::fem::{Body, ContactPoint, Csr, DofMap, Material, Shape};
use crate::mesh::{Element, Facet, Point};

/// Where the pressure comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stress {
    /// The stress of the displacement field, projected onto the nodes: the paper's.
    #[default]
    Projection,
    /// The mean of the stresses in the elements that have the node, weighted by their volumes.
    NodalMean,
    /// The nodal reaction `(K u − f)_C` over the node's area.
    Reaction,
}

/// The operators of all contact points.
#[derive(Debug, Clone)]
pub struct BoundaryOperator {
    /// `N_C`, `n_C × n_C`, stress per displacement along the outward normal.
    pub n_c: Coupling,
    /// `N_O`, `n_C × n_O`.
    pub n_o: Csr,
    /// Lumped `G`: the area that belongs to each contact node.
    pub area: Vec<f64>,
}

impl BoundaryOperator {
    /// That of a body without contact.
    pub fn none(n_o: usize) -> BoundaryOperator {
        let n_o = Csr::from_triplets(0, n_o, vec![]);
        BoundaryOperator { n_c: DMatrix::zeros(0, 0).into(), n_o, area: vec![] }
    }
}

impl BoundaryOperator {
    /// From rows over `(u_O, u_C)`.
    fn of_rows(n: &Csr, n_o: usize, area: Vec<f64>) -> BoundaryOperator {
        let n_c = area.len();
        let (mut contact, mut rest) = (vec![], vec![]);
        for (i, j, v) in n.triplets() {
            match j.checked_sub(n_o) {
                Some(c) => contact.push((i, c, v)),
                None => rest.push((i, j, v)),
            }
        }
        let contact = Csr::from_triplets(n_c, n_c, contact);
        BoundaryOperator { n_c: contact.into(), n_o: Csr::from_triplets(n_c, n_o, rest), area }
    }
}

/// The nodal reaction over the node's area in place of the stress: `N = diag(area)⁻¹ [K_CC, K_CO]`.
pub fn reaction(body: &Body, area: Vec<f64>) -> BoundaryOperator {
    let (n_o, n_c) = (body.dofs.n_o, body.dofs.n_c);
    let row = |i: usize| body.stiffness.row(n_o + i).map(move |(j, v)| (i, j, v));
    let rows = (0..n_c).flat_map(row).map(|(i, j, v)| (i, j, v / area[i])).collect();
    BoundaryOperator::of_rows(&Csr::from_triplets(n_c, body.dofs.n(), rows), n_o, area)
}

/// The mean of the stresses at a node in the elements that have it, weighted by their volumes: `λ_i = Σ_e w_e mᵀσ_e n / Σ_e w_e`. Elements count that
/// touch the edge in this node alone. With it meshes of triangles, whose stress has fewer values along an edge than the edge has nodes, have a P-matrix.
pub fn nodal_mean(body: &Body) -> BoundaryOperator {
    let (dofs, mesh) = (&body.dofs, &body.mesh);
    let mut at_node: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, point) in dofs.contact.iter().enumerate() {
        at_node.entry(point.node).or_default().push(i);
    }
    let mut volume = vec![0.0; dofs.n_c];
    let mut rows: Vec<(usize, usize, f64)> = vec![];
    for element in mesh.elements().filter(|e| e.nodes.iter().any(|n| at_node.contains_key(n))) {
        let Some(material) = body.materials().get(element.region) else { continue };
        let x = mesh.corners(element);
        let shape = Shape { kind: element.kind, x: &x };
        let weight = shape.volume(material);
        for (local, node) in element.nodes.iter().enumerate() {
            let place = shape::places(element.kind)[local];
            for &i in at_node.get(node).into_iter().flatten() {
                let ContactPoint { direction, normal, .. } = dofs.contact[i];
                volume[i] += weight;
                let rule = shape.traction_row(material, place, (direction, normal));
                rows.extend(row_over(dofs, element.nodes, &rule).map(|(j, s)| (i, j, weight * s)));
            }
        }
    }
    let n = scale_rows(&Csr::from_triplets(dofs.n_c, dofs.n(), rows), &volume);
    BoundaryOperator::of_rows(&against_each_other(dofs, n), dofs.n_o, areas(body))
}

/// The stresses of two surfaces that give up their inertia, node against node, are one: `λ_slave − λ_master = 0` in the rows of the masters, which have had the second
/// of them with its sign.
fn against_each_other(dofs: &DofMap, n: Csr) -> Csr {
    if dofs.n_facing == dofs.n_c {
        return n;
    }
    let mut entries: Vec<(usize, usize, f64)> = n.triplets().collect();
    for (group, facing) in dofs.facing.iter().enumerate() {
        for against in facing.meeting.iter().flat_map(|m| &m.nodes) {
            let Some(slave) = dofs.contact_at(group, against.node) else { continue };
            for (node, p) in &against.masters {
                if let Some(master) = dofs.contact_at(dofs.facing.len() + group, *node) {
                    entries.extend(n.row(slave).map(|(j, v)| (master, j, p * v)));
                }
            }
        }
    }
    Csr::from_triplets(n.n_rows(), n.n_cols(), entries)
}

/// A row over the displacements of an element as entries of one over `u`.
fn row_over(dofs: &DofMap, nodes: &[usize], row: &[f64]) -> impl Iterator<Item = (usize, f64)> {
    row.iter().enumerate().flat_map(move |(k, s)| {
        dofs.terms(nodes[k / dofs.dim], k % dofs.dim).map(move |(j, c)| (j, s * c))
    })
}

/// A point of quadrature before an obstacle, seen from the element inside.
pub(super) struct EdgePoint<'a> {
    /// Which of the groups before obstacles; these counted on, which of the masters.
    pub group: usize,
    /// Which side of which group.
    side: (usize, Facet),
    /// Place.
    pub place: Point,
    /// Outward normal.
    pub normal: Point,
    /// Share of the edge's area.
    pub weight: f64,
    /// Nodes of the side with their shape functions.
    pub shape: Vec<(usize, f64)>,
    /// Extent of the element along the normal.
    pub size: f64,
    pub material: &'a Material,
    element: Element<'a>,
    local: Local,
    x: Vec<Point>,
}

impl EdgePoint<'_> {
    /// The stress `mᵀσn` over the displacements `u`, as entries of a row.
    pub fn stress(&self, dofs: &DofMap, m: Point) -> Vec<(usize, f64)> {
        let shape = Shape { kind: self.element.kind, x: &self.x };
        let row = shape.traction_row(self.material, self.local, (m, self.normal));
        row_over(dofs, self.element.nodes, &row).collect()
    }

    /// Direction of the contact here: towards the obstacle's plane, or the normal.
    pub fn direction(&self, dofs: &DofMap) -> Point {
        dofs.facing.get(self.group).and_then(|f| f.direction).unwrap_or(self.normal)
    }

    /// The displacement `m·u` over the displacements `u`, as entries of a row.
    pub fn displacement(&self, dofs: &DofMap, m: Point) -> Vec<(usize, f64)> {
        let of_node = |&(n, p): &(usize, f64)| {
            let along = move |c: usize| dofs.terms(n, c).map(move |(j, t)| (j, t * m[c] * p));
            (0..dofs.dim).filter(move |&c| m[c] != 0.0).flat_map(along)
        };
        let mut row: Vec<(usize, f64)> = vec![];
        for (j, v) in self.shape.iter().flat_map(of_node) {
            match row.iter_mut().find(|e| e.0 == j) {
                Some(e) => e.1 += v,
                None => row.push((j, v)),
            }
        }
        row
    }
}

/// The points of quadrature on all sides before obstacles, then on those of masters.
pub(super) fn quadrature(body: &Body) -> Vec<EdgePoint<'_>> {
    let mesh = &body.mesh;
    let mut points = vec![];
    let facing = &body.dofs.facing;
    let slaves = facing.iter().enumerate().map(|(k, f)| (k, f.group.as_str()));
    let masters = facing
        .iter()
        .enumerate()
        .filter_map(|(k, f)| Some((facing.len() + k, f.meeting.as_ref()?.pair.master.as_str())));
    for (group, facet) in
        slaves.chain(masters).flat_map(|(k, group)| mesh.group(group).iter().map(move |s| (k, *s)))
    {
        let element = mesh.element(facet);
        let Some(material) = body.materials().get(element.region) else { continue };
        let x = mesh.corners(element);
        let side = element.kind.side(facet.side);
        for point in (Shape { kind: element.kind, x: &x }).side(facet.side) {
            let normal = point.normal;
            points.push(EdgePoint {
                group,
                side: (group, facet),
                place: point.place,
                normal,
                weight: point.area * material.measure(point.place[0]),
                shape: side.iter().map(|&l| element.nodes[l]).zip(point.values).collect(),
                size: mesh.extent(element, normal),
                material,
                element,
                local: point.local,
                x: x.clone(),
            });
        }
    }
    points
}

/// Entries below this fraction of their row's largest are rounding errors of `G⁻¹R` and are dropped.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Area that belongs to each contact point: row sums of `G`. On faces whose shape functions have integrals that are not all positive (second order
/// without a node in the middle) the area of the face is shared out by `∫ P²`. At chosen nodes there are forces and no pressures: it is one.
pub(super) fn areas(body: &Body) -> Vec<f64> {
    let mut area = vec![0.0; body.dofs.contact.len()];
    let mut add = |point: &EdgePoint, node: usize, share: f64| {
        if let Some(i) = body.dofs.contact_at(point.group, node) {
            area[i] += share;
        }
    };
    for of_side in quadrature(body).chunk_by(|a, b| a.side == b.side) {
        let bears = shape::bears(of_side[0].element.kind, of_side[0].side.1.side);
        let squares = || of_side.iter().flat_map(|p| p.shape.iter().map(|s| p.weight * s.1 * s.1));
        let whole = of_side.iter().map(|p| p.weight).sum::<f64>() / squares().sum::<f64>();
        for point in of_side {
            for &(node, shape) in &point.shape {
                let share = if bears { shape } else { whole * shape * shape };
                add(point, node, point.weight * share);
            }
        }
    }
    of_pairs(&body.dofs, &mut area);
    body.dofs.tangents.iter().for_each(|&(along, point)| area[along] = area[point]);
    for (area, point) in area.iter_mut().zip(&body.dofs.contact) {
        let group = body.dofs.facing.get(point.group).map_or("", |f| f.group.as_str());
        if body.mesh.chosen(group).is_some() {
            *area = 1.0;
        }
    }
    area
}

/// What a master covers of the area of its slaves, and what these give to its own nodes.
fn of_pairs(dofs: &DofMap, area: &mut [f64]) {
    for (group, meeting) in
        dofs.facing.iter().enumerate().filter_map(|(k, f)| Some((k, f.meeting.as_ref()?)))
    {
        let mut of_master: HashMap<usize, f64> = HashMap::new();
        for against in &meeting.nodes {
            if let Some(i) = dofs.contact_at(group, against.node) {
                area[i] = against.share;
            }
            for (j, p) in &against.masters {
                *of_master.entry(*j).or_insert(0.0) += p.abs() * against.share;
            }
        }
        let faceless = dofs.contact.iter().enumerate().skip(dofs.n_facing);
        for (i, _) in faceless.filter(|(_, c)| c.group == group) {
            area[i] = of_master.get(&dofs.contact[i].node).copied().unwrap_or(1.0);
        }
    }
}

/// Integrate `R` and `G` over the sides before obstacles and form `N_C`, `N_O`.
pub fn projection(body: &Body, lumped: bool) -> BoundaryOperator {
    let dofs = &body.dofs;
    let n_c = dofs.n_c;
    let mut g = DMatrix::<f64>::zeros(n_c, n_c);
    let mut r: Vec<(usize, usize, f64)> = vec![];
    for point in quadrature(body) {
        for &(node, shape) in &point.shape {
            let Some(i) = dofs.contact_at(point.group, node) else { continue };
            for &(other, of_other) in &point.shape {
                if let Some(j) = dofs.contact_at(point.group, other) {
                    g[(i, j)] += point.weight * shape * of_other;
                }
            }
            let stress = point.stress(dofs, dofs.contact[i].direction);
            r.extend(stress.iter().map(|&(j, s)| (i, j, point.weight * shape * s)));
        }
    }
    let sums: Vec<f64> = (0..n_c).map(|i| g.row(i).sum()).collect();
    let r = Csr::from_triplets(n_c, dofs.n(), r);
    let n = if lumped { scale_rows(&r, &sums) } else { solve_rows(g, &r) };
    let positive = sums.iter().all(|a| *a > 0.0);
    let n = against_each_other(dofs, n);
    BoundaryOperator::of_rows(&n, dofs.n_o, if positive { sums } else { areas(body) })
}

/// `diag(area)⁻¹ R`.
fn scale_rows(r: &Csr, area: &[f64]) -> Csr {
    let entries = r.triplets().map(|(i, j, v)| (i, j, v / area[i])).collect();
    drop_rounding(r.n_rows(), r.n_cols(), entries)
}

/// `G⁻¹ R` with the columns of `R` that are not empty.
fn solve_rows(g: DMatrix<f64>, r: &Csr) -> Csr {
    let n = r.n_rows();
    let mut columns: Vec<usize> = r.triplets().map(|(_, j, _)| j).collect();
    columns.sort_unstable();
    columns.dedup();
    let mut dense = DMatrix::<f64>::zeros(n, columns.len());
    for (i, j, v) in r.triplets() {
        if let Ok(k) = columns.binary_search(&j) {
            dense[(i, k)] = v;
        }
    }
    match g.cholesky() {
        Some(cholesky) => cholesky.solve_mut(&mut dense),
        // no boundary operator at all: the test for a P-matrix refuses it
        None => dense.fill(0.0),
    }
    let entry = |i: usize, k: usize| (i, columns[k], dense[(i, k)]);
    let entries = (0..n).flat_map(|i| (0..columns.len()).map(move |k| (i, k)));
    drop_rounding(n, r.n_cols(), entries.map(|(i, k)| entry(i, k)).collect())
}

fn drop_rounding(n_rows: usize, n_cols: usize, mut entries: Vec<(usize, usize, f64)>) -> Csr {
    let mut largest = vec![0.0f64; n_rows];
    entries.iter().for_each(|&(i, _, v)| largest[i] = largest[i].max(v.abs()));
    entries.retain(|&(i, _, v)| v.abs() > ROUNDING * largest[i]);
    Csr::from_triplets(n_rows, n_cols, entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Facing, Held, MassForm};
    use crate::mesh::structured;

    #[test]
    fn a_boundary_mass_that_is_not_positive_gives_no_operator() {
        let r = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (1, 1, 2.0)]);
        let g = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(solve_rows(g, &r).n_entries(), 0);
    }

    fn plate(edge: &str, held: &[Held], poisson: f64) -> Body {
        let mesh = structured::rectangle(2.0, 1.0, 8, 4);
        let dofs = DofMap::new(&mesh, held, &[Facing::surface(edge)]).unwrap();
        Body::assemble(mesh, dofs, &[Material::plate(5.0, poisson, 1.0, 0.2)], MassForm::Consistent)
    }

    #[test]
    fn consistent_boundary_mass_decouples_the_lcp() {
        let body = plate("right", &[Held::along("left", 1)], 0.3);
        let op = projection(&body, false);
        let k = 5.0 / (1.0 - 0.09) / 0.25;
        for i in 0..op.n_c.size() {
            for j in 0..op.n_c.size() {
                let exact = if i == j { k } else { 0.0 };
                assert!((op.n_c[(i, j)] - exact).abs() < 1e-12 * k);
            }
        }
        let lumped = projection(&body, true);
        assert!(lumped.n_c[(0, 1)].abs() > 0.1 * k && lumped.n_c[(0, 2)] == 0.0);
    }

    /// Without Poisson's ratio the stress at the edge of a uniform plate is that of the row of elements behind each node, and both operators read it.
    #[test]
    fn mean_and_projection_agree_on_uniform_plates_without_poisson() {
        let body = plate("top", &[], 0.0);
        let (a, b) = (projection(&body, false), nodal_mean(&body));
        let size = a.n_c.dense().norm();
        assert!((a.n_c.dense() - b.n_c.dense()).norm() < 1e-12 * size);
        let difference = Csr::combination(1.0, &a.n_o, -1.0, &b.n_o);
        assert!(difference.triplets().all(|t| t.2.abs() < 1e-12 * size));
        assert!(a.area.iter().zip(&b.area).all(|(a, b)| (a - b).abs() < 1e-15));
    }

    /// `λ = mᵀσn` of a uniform strain, on every edge of a plate that is turned, along the normals and towards an oblique plane.
    #[test]
    fn uniform_strain_gives_its_stress_on_every_edge() {
        let material = Material::plate(5.0, 0.3, 1.0, 0.2);
        let c = 5.0 / (1.0 - 0.09);
        let strain = [0.01, -0.02, 0.015]; // xx, yy, shear γ
        let stress = [
            c * (strain[0] + 0.3 * strain[1]),
            c * (strain[1] + 0.3 * strain[0]),
            5.0 / 2.6 * strain[2],
        ];
        for angle in [0.0f64, 0.4] {
            let turn = |[x, y, _]: Point| {
                let (sin, cos) = angle.sin_cos();
                [cos * x - sin * y, sin * x + cos * y, 0.0]
            };
            let mesh = structured::rectangle(2.0, 1.0, 8, 4).moved(turn);
            for (edge, n) in [
                ("left", [-1.0, 0.0, 0.0]),
                ("right", [1.0, 0.0, 0.0]),
                ("bottom", [0.0, -1.0, 0.0]),
                ("top", [0.0, 1.0, 0.0]),
            ] {
                for (oblique, which) in (0..6).map(|k| (k >= 3, k % 3)) {
                    let n = turn(n);
                    let m = if oblique {
                        [n[0] * 0.8 - n[1] * 0.6, n[1] * 0.8 + n[0] * 0.6, 0.0]
                    } else {
                        n
                    };
                    let facing = Facing::plane(edge, oblique.then_some(m));
                    let dofs = DofMap::new(&mesh, &[], &[facing]).unwrap();
                    let body =
                        Body::assemble(mesh.clone(), dofs, &[material], MassForm::Consistent);
                    let op = match which {
                        2 => nodal_mean(&body),
                        lumped => projection(&body, lumped == 1),
                    };
                    let field = |p: &Point| {
                        let half = strain[2] / 2.0;
                        [strain[0] * p[0] + half * p[1], half * p[0] + strain[1] * p[1]]
                    };
                    let nodal: Vec<f64> = body.mesh.nodes().iter().flat_map(field).collect();
                    let u = body.dofs.gather(&nodal);
                    let exact = m[0] * (stress[0] * n[0] + stress[2] * n[1])
                        + m[1] * (stress[2] * n[0] + stress[1] * n[1]);
                    for i in 0..op.area.len() {
                        let n_o = body.dofs.n_o;
                        let lambda = op.n_o.row_dot(i, &u[..n_o])
                            + (0..op.area.len()).map(|j| op.n_c[(i, j)] * u[n_o + j]).sum::<f64>();
                        assert!((lambda - exact).abs() < 1e-13, "{edge} {lambda} {exact}");
                    }
                }
            }
        }
    }
}
