//! Probes: what is watched of a motion at a place, over a group of sides, or at a node.
//!
//! ```text
//! u(x) = Σ_a φ_a(x) u_a          in the element of a place        ∫u/|Γ|        over a group
//! σ(x) = D B(x) u_e              of the element, the mean of several where they meet; over a group ∫σ/|Γ|
//! σ*(x) = Σ_a φ_a(x) σ*_a        the same with stress that is recovered at the nodes of the element
//! ```
//!
//! All of them are rows over `u = (u_O, u_C)`: velocities and accelerations have those of displacements.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::body::Body;
use super::carried::Carried;
use super::element::Shape;
use super::interpolate::{Inside, elements_at, is_between_surfaces};
use super::load::nodal_areas;
use super::recovery::Recovery;
use super::reduction::Reduction;
use super::shape::{self, Local};
use super::sparse::Csr;
use crate::mesh::{Element, ElementKind, Point};

/// What is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// `u`, along the axes.
    Displacement,
    /// `u̇`
    Velocity,
    /// `ü`
    Acceleration,
    /// `σ`, positive in tension: xx, yy, zz, xy, yz, zx; in the plane the first four, of a bar the first.
    Stress,
    /// `σ*`: the same recovered from the displacements of the nodes around, of one order more, at the boundary too.
    #[serde(rename = "recovered-stress")]
    RecoveredStress,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Quantity; 5] = [
        Quantity::Displacement,
        Quantity::Velocity,
        Quantity::Acceleration,
        Quantity::Stress,
        Quantity::RecoveredStress,
    ];

    /// Its name in scenes and files.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Displacement => "displacement",
            Quantity::Velocity => "velocity",
            Quantity::Acceleration => "acceleration",
            Quantity::Stress => "stress",
            Quantity::RecoveredStress => "recovered-stress",
        }
    }

    /// Whether only elements have it.
    pub fn is_of_elements(self) -> bool {
        matches!(self, Quantity::Stress | Quantity::RecoveredStress)
    }

    /// Its components, of a body of so many dimensions.
    pub fn components(self, dim: usize) -> &'static [&'static str] {
        match (self, dim) {
            (Quantity::Stress | Quantity::RecoveredStress, dim) => match dim {
                1 => &["xx"],
                2 => &["xx", "yy", "zz", "xy"],
                _ => &["xx", "yy", "zz", "xy", "yz", "zx"],
            },
            (_, dim) => &["x", "y", "z"][..dim.clamp(1, 3)],
        }
    }
}

/// Where.
#[derive(Debug, Clone, PartialEq)]
pub enum Spot {
    /// At a place of the undeformed body.
    Place(Point),
    /// The mean over a group of sides.
    Group(String),
    /// At a node.
    Node(usize),
    /// A sum of rows of given matrices.
    Rows(Vec<(usize, f64)>),
}

/// Why there is no probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nowhere {
    /// The place lies in no element.
    Outside,
    /// Surfaces that touch meet there: it belongs to both.
    Between,
}

/// A place of an element with its share.
type Share<'m> = (Element<'m>, Local, f64);

/// A probe.
#[derive(Debug, Clone)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// What it watches.
    pub quantities: Vec<Quantity>,
    /// Dimensions of the body.
    pub dim: usize,
    /// Of a row of given matrices: what its direction is called.
    pub axis: Option<&'static str>,
    /// Over displacements that are free, those of tables.
    free: Rows,
    /// Over those of all nodes, for supports that move.
    nodal: Rows,
}

/// What a probe reads of displacements.
#[derive(Debug, Clone)]
struct Rows {
    /// `u` at the probe, a row an axis.
    motion: Csr,
    /// `σ`, a row a component; none where it is not asked for.
    stress: Csr,
    /// `σ*`, likewise.
    recovered: Csr,
}

impl Rows {
    fn of(&self, quantity: Quantity) -> &Csr {
        match quantity {
            Quantity::Stress => &self.stress,
            Quantity::RecoveredStress => &self.recovered,
            _ => &self.motion,
        }
    }
}

impl Probe {
    /// On a body.
    pub fn new(
        body: &Body,
        name: &str,
        spot: &Spot,
        quantities: &[Quantity],
    ) -> Result<Probe, Nowhere> {
        let (mesh, dofs, dim) = (&body.mesh, body.nodal_dofs(), body.mesh.dim());
        let all: Vec<Element> = mesh.elements().collect();
        let (weights, shares): (Vec<(usize, f64)>, Vec<Share>) = match spot {
            Spot::Node(node) => {
                let mut shares = vec![];
                for e in &all {
                    let corners = (0..e.nodes.len()).filter(|a| e.nodes[*a] == *node);
                    shares.extend(corners.map(|a| (*e, shape::places(e.kind)[a], 1.0)));
                }
                (vec![(*node, 1.0)], shares)
            }
            Spot::Rows(weights) => (weights.clone(), vec![]),
            Spot::Place(place) => {
                let cells: Vec<(ElementKind, Vec<usize>)> =
                    all.iter().map(|e| (e.kind, e.nodes.to_vec())).collect();
                let found = elements_at(place, mesh.nodes(), &cells);
                let first = found.first().ok_or(Nowhere::Outside)?;
                if is_between_surfaces(&found) {
                    return Err(Nowhere::Between);
                }
                let share = |i: &Inside| (all[i.element], i.local, 1.0);
                (first.weights.clone(), found.iter().map(share).collect())
            }
            Spot::Group(group) => {
                let areas = nodal_areas(body, group);
                let whole: f64 = areas.iter().sum();
                let weights = areas.into_iter().enumerate().filter(|(_, a)| *a != 0.0);
                let of_side = |&facet: &crate::mesh::Facet| {
                    let element = mesh.element(facet);
                    let x = mesh.corners(element);
                    let measure =
                        |p: Point| body.materials().get(element.region).map(|m| m.measure(p[0]));
                    let side = Shape { kind: element.kind, x: &x }.side(facet.side);
                    let share = move |p: super::element::OnSide| {
                        (element, p.local, p.area * measure(p.place).unwrap_or(1.0))
                    };
                    side.into_iter().map(share).collect::<Vec<_>>()
                };
                let shares = mesh.group(group).iter().flat_map(of_side).collect();
                (weights.map(|(n, a)| (n, a / whole)).collect(), shares)
            }
        };
        let of_axis = |c: usize| weights.iter().map(move |&(n, w)| (c, dim * n + c, w));
        let motion: Vec<(usize, usize, f64)> = (0..dim).flat_map(of_axis).collect();
        let components = Quantity::Stress.components(dim).len();
        let watches = |quantity: Quantity| quantities.contains(&quantity);
        let stress = match watches(Quantity::Stress) {
            true => stress_rows(body, &shares, components),
            false => vec![],
        };
        let recovered = match watches(Quantity::RecoveredStress) {
            true => recovered_rows(body, &all, &shares, components),
            false => vec![],
        };
        // entries over the components of all nodes, over those that are free
        let count = dim * mesh.n_nodes();
        let of_free = |entries: &[(usize, usize, f64)]| -> Vec<(usize, usize, f64)> {
            let of = |&(i, k, w): &(usize, usize, f64)| {
                dofs.terms(k / dim, k % dim).map(move |(j, t)| (i, j, w * t)).collect::<Vec<_>>()
            };
            entries.iter().flat_map(of).collect()
        };
        let free = Rows {
            motion: Csr::from_triplets(dim, dofs.n(), of_free(&motion)),
            stress: Csr::from_triplets(components, dofs.n(), of_free(&stress)),
            recovered: Csr::from_triplets(components, dofs.n(), of_free(&recovered)),
        };
        let nodal = Rows {
            motion: Csr::from_triplets(dim, count, motion),
            stress: Csr::from_triplets(components, count, stress),
            recovered: Csr::from_triplets(components, count, recovered),
        };
        let quantities = quantities.to_vec();
        Ok(Probe { name: name.to_owned(), quantities, dim, axis: None, free, nodal })
    }

    /// In the coordinates of a reduced body.
    pub fn reduced(&self, reduction: &Reduction) -> Probe {
        let Rows { motion, stress, recovered } = &self.free;
        let [motion, stress, recovered] =
            [motion, stress, recovered].map(|rows| reduction.rows(rows));
        Probe { free: Rows { motion, stress, recovered }, ..self.clone() }
    }

    /// The components of a quantity.
    pub fn components(&self, quantity: Quantity) -> Vec<&'static str> {
        self.axis.map_or_else(|| quantity.components(self.dim).to_vec(), |axis| vec![axis])
    }

    /// A quantity of displacements, velocities and accelerations, and of supports that move at this time; not numbers where these are not known.
    pub fn of(
        &self,
        quantity: Quantity,
        [u, v, a]: [&[f64]; 3],
        (carried, t): (&Carried, f64),
    ) -> Vec<f64> {
        let (order, x) = match quantity {
            Quantity::Displacement | Quantity::Stress | Quantity::RecoveredStress => (0, u),
            Quantity::Velocity => (1, v),
            Quantity::Acceleration => (2, a),
        };
        let rows = self.free.of(quantity);
        if x.is_empty() {
            return vec![f64::NAN; rows.n_rows()];
        }
        let mut values = vec![0.0; rows.n_rows()];
        rows.mul(x, &mut values);
        let mut own = vec![0.0; values.len()];
        for (course, field) in carried.of_supports() {
            let s = course.at(t, order);
            self.nodal.of(quantity).mul(field, &mut own);
            values.iter_mut().zip(&own).for_each(|(x, w)| *x += s * w);
        }
        values
    }
}

/// The mean of the stress that is recovered at the nodes of the elements, likewise.
fn recovered_rows(
    body: &Body,
    all: &[Element],
    shares: &[Share],
    components: usize,
) -> Vec<(usize, usize, f64)> {
    let (nodes, dim) = (body.mesh.nodes(), body.mesh.dim());
    let whole: f64 = shares.iter().map(|(_, _, w)| w).sum();
    let mut of_node: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for (element, local, share) in shares {
        for (&n, phi) in element.nodes.iter().zip(shape::values(element.kind, *local)) {
            *of_node.entry((n, element.region)).or_default() += share / whole * phi;
        }
    }
    let recovery = Recovery::new(nodes, all);
    let mut entries = vec![];
    for ((node, region), share) in of_node.into_iter().filter(|(_, w)| *w != 0.0) {
        let Some(material) = body.materials().get(region) else { continue };
        let at = recovery.at(node, region);
        let rows = at.rows(material, &nodes[node], dim);
        for (i, k) in (0..components).flat_map(|i| (0..rows.ncols()).map(move |k| (i, k))) {
            let (other, _) = at.weights[k / dim];
            entries.push((i, dim * other + k % dim, share * rows[(i, k)]));
        }
    }
    entries
}

/// The mean stress of places of elements, as entries of rows over the components of all nodes.
fn stress_rows(body: &Body, shares: &[Share], components: usize) -> Vec<(usize, usize, f64)> {
    let (mesh, dim) = (&body.mesh, body.mesh.dim());
    let whole: f64 = shares.iter().map(|(_, _, w)| w).sum();
    let mut entries = vec![];
    for (element, local, share) in shares {
        let Some(material) = body.materials().get(element.region) else { continue };
        let x = mesh.corners(*element);
        let rows = Shape { kind: element.kind, x: &x }.stress_rows(material, *local);
        for (i, k) in (0..components).flat_map(|i| (0..rows.ncols()).map(move |k| (i, k))) {
            entries.push((i, dim * element.nodes[k / dim] + k % dim, share / whole * rows[(i, k)]));
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::MassForm;
    use crate::fem::frame::{Facing, Held};
    use crate::fem::{DofMap, Material};
    use crate::mesh::structured;

    /// Of a bilinear motion every probe has its value and Hooke's stress, in an element, on a side and at a node.
    #[test]
    fn a_bilinear_motion_is_seen_as_it_is() {
        let (young, nu) = (3.0, 0.3);
        let mesh = structured::rectangle(2.0, 1.0, 6, 4);
        let held = [Held::along("left", 0)];
        let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
        let body = Body::assemble(
            mesh,
            dofs,
            &[Material::plate(young, nu, 1.0, 0.5)],
            MassForm::Consistent,
        );
        let (b, d) = (2e-2, -1e-2);
        let u = |p: Point| [b * p[0] + d * p[0] * p[1], 0.0];
        let field: Vec<f64> = body.mesh.nodes().iter().flat_map(|p| u(*p)).collect();
        let x = body.dofs.gather(&field);
        let sigma = |p: Point| {
            let (exx, gxy) = (b + d * p[1], d * p[0]);
            let xx = young / (1.0 - nu * nu) * exx;
            [xx, nu * xx, 0.0, young / (2.0 * (1.0 + nu)) * gxy]
        };
        let places = [[0.71, 0.33, 0.0], [1.0, 0.5, 0.0], [2.0, 0.4, 0.0]];
        let node = body.mesh.nearest_node([1.0, 0.5, 0.0]);
        let spots = places.map(|p| (Spot::Place(p), p, true)).into_iter().chain([
            (Spot::Node(node), [1.0, 0.5, 0.0], true),
            (Spot::Group("right".into()), [2.0, 0.5, 0.0], false),
        ]);
        for (spot, p, is_point) in spots {
            let probe = Probe::new(&body, "p", &spot, &Quantity::ALL).unwrap();
            let of = |q| probe.of(q, [&x, &x, &[]], (&Carried::default(), 0.0));
            let found = of(Quantity::Displacement);
            assert!((found[0] - u(p)[0]).abs() < 1e-14 && found[1].abs() < 1e-15, "{spot:?}");
            assert_eq!(found, of(Quantity::Velocity));
            assert!(of(Quantity::Acceleration).iter().all(|a| a.is_nan()));
            // shear is linear in an element along x alone: at sides of elements the mean of both
            let stress = of(Quantity::Stress);
            assert!((stress[0] - sigma(p)[0]).abs() < 1e-13, "{spot:?} {stress:?}");
            assert!((stress[1] - sigma(p)[1]).abs() < 1e-13 && stress[2] == 0.0);
            assert!(!is_point || (stress[3] - sigma(p)[3]).abs() < 1e-13, "{spot:?} {stress:?}");
            // recovered it is linear everywhere, as the motion's is
            let recovered = of(Quantity::RecoveredStress);
            let off = (0..4).map(|c| (recovered[c] - sigma(p)[c]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-13, "{spot:?} {recovered:?}");
        }
        let outside = Probe::new(&body, "p", &Spot::Place([2.1, 0.5, 0.0]), &[Quantity::Stress]);
        assert_eq!(outside.err(), Some(Nowhere::Outside));
    }
}
