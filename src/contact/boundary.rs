//! Contact stress from the displacement field: `λ = G⁻¹ R u = N_C u_C + N_O u_O` (seed eq. 5, theory §2).
//!
//! `R_i = ∫_Γc P_i σ_n(P u) ds`, taken element by element from inside; `G_ij = ∫_Γc P_i P_j ds`.
//! Both carry the thickness (or cross-section), which cancels.

use std::collections::HashMap;

use nalgebra::DMatrix;

use crate::fem::{Body, Csr, DofMap, Material, Shape, shape};
use crate::mesh::{Edge, Point};

/// The operators of one contact edge.
#[derive(Debug, Clone)]
pub struct BoundaryOperator {
    /// `N_C`, `n_C × n_C`, stress per displacement along the outward normal.
    pub n_c: DMatrix<f64>,
    /// `N_O`, `n_C × n_O`.
    pub n_o: Csr,
    /// Lumped `G`: the area that belongs to each contact node.
    pub area: Vec<f64>,
}

impl BoundaryOperator {
    /// That of a body without contact.
    pub fn none(n_o: usize) -> BoundaryOperator {
        let n_o = Csr::from_triplets(0, n_o, vec![]);
        BoundaryOperator { n_c: DMatrix::zeros(0, 0), n_o, area: vec![] }
    }
}

impl BoundaryOperator {
    /// From rows over `(u_O, u_C)`.
    fn of_rows(n: &Csr, n_o: usize, area: Vec<f64>) -> BoundaryOperator {
        let n_c = area.len();
        let mut contact = DMatrix::zeros(n_c, n_c);
        let mut rest = vec![];
        for (i, j, v) in n.triplets() {
            match j.checked_sub(n_o) {
                Some(c) => contact[(i, c)] = v,
                None => rest.push((i, j, v)),
            }
        }
        BoundaryOperator { n_c: contact, n_o: Csr::from_triplets(n_c, n_o, rest), area }
    }
}

/// The nodal reaction over the node's area in place of the stress: `N = diag(area)⁻¹ [K_CC, K_CO]`.
pub fn reaction(body: &Body, area: Vec<f64>) -> BoundaryOperator {
    let (n_o, n_c) = (body.dofs.n_o, body.dofs.n_c);
    let row = |i: usize| body.stiffness.row(n_o + i).map(move |(j, v)| (i, j, v));
    let rows = (0..n_c).flat_map(row).map(|(i, j, v)| (i, j, v / area[i])).collect();
    BoundaryOperator::of_rows(&Csr::from_triplets(n_c, body.dofs.n(), rows), n_o, area)
}

/// The mean of the normal stresses at a node in the elements that have it, weighted by their volumes: `λ_i = Σ_e w_e nᵀσ_e n / Σ_e w_e`. Elements count that
/// touch the edge in this node alone. With it meshes of triangles, whose stress has fewer values along an edge than the edge has nodes, have a P-matrix.
pub fn nodal_mean(body: &Body, edge: Edge) -> BoundaryOperator {
    let (dofs, mesh) = (&body.dofs, &body.mesh);
    let normal = [0, 1].map(|c| if c == edge.axis() { 1.0 } else { 0.0 });
    let index: HashMap<usize, usize> =
        dofs.contact_nodes.iter().enumerate().map(|(i, &n)| (n, i)).collect();
    let mut volume = vec![0.0; dofs.n_c];
    let mut rows: Vec<(usize, usize, f64)> = vec![];
    for element in mesh.elements() {
        let Some(material) = body.materials().get(element.region) else { continue };
        let at_contact = |&(_, n): &(usize, &usize)| index.contains_key(n);
        if !element.nodes.iter().enumerate().any(|k| at_contact(&k)) {
            continue;
        }
        let x = mesh.plane_corners(element);
        let shape = Shape { kind: element.kind, x: &x };
        let weight = shape.volume(material);
        for (local, node) in element.nodes.iter().enumerate().filter(at_contact) {
            let i = index[node];
            volume[i] += weight;
            let place = shape::places(element.kind)[local];
            let row = shape.traction_row(material, place, (normal, normal));
            for (k, s) in row.iter().enumerate() {
                if let Some((j, sign)) = dofs.of(element.nodes[k / dofs.dim], k % dofs.dim) {
                    rows.push((i, j, weight * s * sign));
                }
            }
        }
    }
    let n = scale_rows(&Csr::from_triplets(dofs.n_c, dofs.n(), rows), &volume);
    BoundaryOperator::of_rows(&n, dofs.n_o, areas(body, edge))
}

/// A point of quadrature on the contact edge, seen from the element inside.
pub(super) struct EdgePoint<'a> {
    /// Place.
    pub place: Point,
    /// Share of the edge's area.
    pub weight: f64,
    /// Nodes of the side with their shape functions.
    pub shape: Vec<(usize, f64)>,
    /// Nodes of the element.
    nodes: &'a [usize],
    /// Normal stress over the displacements of these nodes.
    stress: Vec<f64>,
    /// Extent of the element along the normal.
    pub size: f64,
    pub material: &'a Material,
}

impl EdgePoint<'_> {
    /// Normal stress over the displacements `u`, as entries of a row.
    pub fn stress(&self, dofs: &DofMap) -> Vec<(usize, f64)> {
        let entry = |(k, s): (usize, &f64)| {
            let (j, sign) = dofs.of(self.nodes[k / dofs.dim], k % dofs.dim)?;
            Some((j, s * sign))
        };
        self.stress.iter().enumerate().filter_map(entry).collect()
    }
}

/// Two points of Gauss a side; the end of a bar.
pub(super) fn quadrature(body: &Body, edge: Edge) -> Vec<EdgePoint<'_>> {
    let (mesh, axis) = (&body.mesh, edge.axis());
    let mut points = vec![];
    for &facet in mesh.group(edge.name()) {
        let element = mesh.element(facet);
        let Some(material) = body.materials().get(element.region) else { continue };
        let (nodes, x) = (element.nodes, mesh.plane_corners(element));
        let along = || x.iter().map(|p| p[axis]);
        let (low, high) =
            along().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let shape = Shape { kind: element.kind, x: &x };
        let side = element.kind.side(facet.side);
        let normal = [0, 1].map(|c| if c == axis { 1.0 } else { 0.0 });
        for point in shape.side(facet.side, material) {
            points.push(EdgePoint {
                place: [point.place[0], point.place[1], 0.0],
                weight: point.area,
                shape: side.iter().map(|&l| nodes[l]).zip(point.values).collect(),
                nodes,
                stress: shape.traction_row(material, point.local, (normal, normal)),
                size: high - low,
                material,
            });
        }
    }
    points
}

/// Entries below this fraction of their row's largest are rounding errors of `G⁻¹R` and are dropped.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Area that belongs to each contact node: row sums of `G`.
pub(super) fn areas(body: &Body, edge: Edge) -> Vec<f64> {
    let nodes = &body.dofs.contact_nodes;
    let mut area = vec![0.0; nodes.len()];
    for point in quadrature(body, edge) {
        for (node, shape) in &point.shape {
            if let Some(k) = nodes.iter().position(|n| n == node) {
                area[k] += point.weight * shape;
            }
        }
    }
    area
}

/// Integrate `R` and `G` over the contact edge and form `N_C`, `N_O`.
pub fn assemble(body: &Body, edge: Edge, lumped: bool) -> BoundaryOperator {
    let dofs = &body.dofs;
    let n_c = dofs.n_c;
    let contact_index =
        |node| dofs.of(node, edge.axis()).and_then(|(i, _)| i.checked_sub(dofs.n_o));

    let mut g = DMatrix::<f64>::zeros(n_c, n_c);
    let mut r: Vec<(usize, usize, f64)> = vec![];
    for point in quadrature(body, edge) {
        let stress = point.stress(dofs);
        for &(node, shape) in &point.shape {
            let Some(i) = contact_index(node) else { continue };
            for &(other, of_other) in &point.shape {
                if let Some(j) = contact_index(other) {
                    g[(i, j)] += point.weight * shape * of_other;
                }
            }
            r.extend(stress.iter().map(|&(j, s)| (i, j, point.weight * shape * s)));
        }
    }
    let area: Vec<f64> = (0..n_c).map(|i| g.row(i).sum()).collect();
    let r = Csr::from_triplets(n_c, dofs.n(), r);
    let n = if lumped { scale_rows(&r, &area) } else { solve_rows(g, &r) };

    BoundaryOperator::of_rows(&n, dofs.n_o, area)
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
    use crate::fem::{DofMap, Material};
    use crate::mesh::structured;

    #[test]
    fn a_boundary_mass_that_is_not_positive_gives_no_operator() {
        let r = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (1, 1, 2.0)]);
        let g = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(solve_rows(g, &r).n_entries(), 0);
    }

    fn plate(edge: Edge, lumped: bool) -> (Body, BoundaryOperator) {
        let mesh = structured::rectangle(2.0, 1.0, 8, 4);
        let dofs = DofMap::new(&mesh, &[(Edge::Left, 1)], Some(edge));
        let material = Material::plate(5.0, 0.3, 1.0, 0.2);
        let body = Body::assemble(mesh, dofs, &[material], false);
        let operator = assemble(&body, edge, lumped);
        (body, operator)
    }

    #[test]
    fn consistent_boundary_mass_decouples_the_lcp() {
        let (_, op) = plate(Edge::Right, false);
        let k = 5.0 / (1.0 - 0.09) / 0.25;
        for i in 0..op.n_c.nrows() {
            for j in 0..op.n_c.ncols() {
                let exact = if i == j { k } else { 0.0 };
                assert!((op.n_c[(i, j)] - exact).abs() < 1e-12 * k);
            }
        }
        let (_, lumped) = plate(Edge::Right, true);
        assert!(lumped.n_c[(0, 1)].abs() > 0.1 * k && lumped.n_c[(0, 2)] == 0.0);
    }

    /// Without Poisson's ratio the stress at the edge of a uniform plate is that of the row of elements behind each node, and both operators read it.
    #[test]
    fn mean_and_projection_agree_on_uniform_plates_without_poisson() {
        let mesh = structured::rectangle(2.0, 1.0, 8, 4);
        let dofs = DofMap::new(&mesh, &[], Some(Edge::Top));
        let body = Body::assemble(mesh, dofs, &[Material::plate(5.0, 0.0, 1.0, 0.2)], false);
        let (a, b) = (assemble(&body, Edge::Top, false), nodal_mean(&body, Edge::Top));
        assert!((&a.n_c - &b.n_c).norm() < 1e-12 * a.n_c.norm());
        let difference = Csr::combination(1.0, &a.n_o, -1.0, &b.n_o);
        assert!(difference.triplets().all(|t| t.2.abs() < 1e-12 * a.n_c.norm()));
        assert!(a.area.iter().zip(&b.area).all(|(a, b)| (a - b).abs() < 1e-15));
    }

    #[test]
    fn uniform_strain_gives_its_stress_on_every_edge() {
        for edge in [Edge::Left, Edge::Right, Edge::Bottom, Edge::Top] {
            for which in 0..3 {
                let mesh = structured::rectangle(2.0, 1.0, 8, 4);
                let dofs = DofMap::new(&mesh, &[], Some(edge));
                let material = Material::plate(5.0, 0.3, 1.0, 0.2);
                let body = Body::assemble(mesh, dofs, &[material], false);
                let op = match which {
                    2 => nodal_mean(&body, edge),
                    lumped => assemble(&body, edge, lumped == 1),
                };
                let strain = |p: &[f64; 3]| [0.01 * p[0], -0.02 * p[1]];
                let nodal: Vec<f64> = body.mesh.nodes().iter().flat_map(strain).collect();
                let u = body.dofs.gather(&nodal);
                let c = 5.0 / (1.0 - 0.09);
                let stress = [c * (0.01 - 0.3 * 0.02), c * (-0.02 + 0.3 * 0.01)][edge.axis()];
                for i in 0..op.area.len() {
                    let n_o = body.dofs.n_o;
                    let lambda = op.n_o.row_dot(i, &u[..n_o])
                        + (0..op.area.len()).map(|j| op.n_c[(i, j)] * u[n_o + j]).sum::<f64>();
                    assert!((lambda - stress).abs() < 1e-13, "{edge:?} {lambda} {stress}");
                }
            }
        }
    }
}
