//! Fields on the mesh at a stored state, for every format that draws.
//!
//! | field | where | is |
//! | --- | --- | --- |
//! | `displacement`, `velocity` | points | `u`, `u̇` with three components, 0 where prescribed |
//! | `contact_pressure` | points | `p = −λ ≥ 0`, on both sides where two surfaces meet; 0 off the contact |
//! | `contact_force` | points | force of the contact on the body, its tangential part included, with three components |
//! | `contact_status` | points | 1 in contact (with friction its state), 0 open, −1 no contact node (of two surfaces the slave has them) |
//! | `gap` | points | the distance `g − u_C ≥ 0` to the obstacle along the contact direction, NaN off the contact edge |
//! | `stress` | cells | `σ = D B u` at the centre: a tensor (in the plane with `σ_zz`), the axial stress of a bar |
//! | `stress_averaged` | points, not of bars | the mean of what the elements around have at the node, by their volumes: at corners and edges of the body of first order, and across materials a mixture |
//! | `stress_recovered` | points | recovered from the displacements of the nodes around ([`crate::fem::recovery`]), as `stress`: of one order more, at the boundary too; where materials meet the mean of theirs |
//! | `von_mises_recovered` | points, not of bars | that of `stress_recovered` |
//! | `von_mises` | cells, not of bars | `√(½((σ_xx − σ_yy)² + (σ_yy − σ_zz)² + (σ_zz − σ_xx)²) + 3 (σ_xy² + σ_yz² + σ_zx²))` |
//!
//! The four fields of contact are left out where the scene has none.

use std::cell::OnceCell;
use std::collections::HashMap;

use super::put::ExportError;
use crate::fem::recovery::{self, AtNode, Recovery};
use crate::fem::stress::{self, AtCentre, Stress};
use crate::fem::{Material, Shape};
use crate::mesh::{Element, ElementKind, Point};
use crate::problem::materials;
use crate::scenario::{BodyKind, Scene};
use crate::store::Stored;

/// What a field's values belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Centre {
    /// Nodes.
    Point,
    /// Elements.
    Cell,
}

/// Values, one after the other, the components of one place together.
#[derive(Debug, Clone)]
pub(super) enum Values {
    /// Floating point.
    Real(Vec<f64>),
    /// Whole numbers.
    Whole(Vec<i32>),
}

/// Stress over Young's modulus that is none.
const ROUNDING: f64 = 1e-14;

/// A named field at one state.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub name: &'static str,
    pub place: Centre,
    pub components: usize,
    pub values: Values,
}

/// The largest of von Mises' stresses of a run, of a bar the largest axial one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestStress {
    /// At the centre of the element.
    pub von_mises: f64,
    /// When.
    pub t: f64,
    /// Where: number of the element.
    pub element: usize,
    /// The mean of its nodes.
    pub place: Point,
    /// Of a bar 1, of a body in the plane 2.
    pub dim: usize,
    /// The largest that is recovered at a node, at this time.
    pub recovered: f64,
    /// Where.
    pub node: usize,
    /// The place of the node.
    pub at_node: Point,
    /// `‖σ* − σ‖/‖σ*‖` at this time, in the norm of the energy: an estimate of the error of the stress of the elements (Zienkiewicz and Zhu).
    pub error: f64,
}

/// The fields of a stored run.
#[derive(Debug)]
pub(super) struct Fields<'s> {
    pub stored: &'s Stored,
    cells: Vec<Cell>,
    materials: Vec<Material>,
    recovered: OnceCell<Vec<AtNode>>,
}

/// An element.
#[derive(Debug)]
pub(super) struct Cell {
    pub kind: ElementKind,
    pub nodes: Vec<usize>,
    x: Vec<Point>,
    material: Material,
}

impl Cell {
    /// The nodes in the order of VTK.
    pub fn ordered(&self) -> Vec<i64> {
        self.kind.ordered(&self.nodes)
    }
}

impl<'s> Fields<'s> {
    /// The constants of the stress are in the scene that made the run.
    pub fn of(stored: &'s Stored) -> Result<Fields<'s>, ExportError> {
        let scene = Scene::parse(&stored.scene, &stored.path)
            .map_err(|e| ExportError::damaged(stored, e))?;
        if scene.body.kind == BodyKind::Matrices {
            return Err(ExportError::NoGeometry(stored.path.clone()));
        }
        let materials = materials(&scene);
        let cell = |k: usize| {
            let kind = stored.kind(k).filter(|kind| kind.dim() == scene.dim())?;
            let nodes = stored.nodes_of(k);
            let x = nodes.iter().map(|&n| stored.place(n)).collect();
            Some(Cell { kind, nodes, x, material: *materials.get(stored.regions[k])? })
        };
        let cells: Option<Vec<Cell>> = (0..stored.elements.nrows()).map(cell).collect();
        match cells {
            Some(cells) => Ok(Fields { stored, cells, materials, recovered: OnceCell::new() }),
            None => Err(ExportError::damaged(stored, "it is not the one of this mesh")),
        }
    }

    /// Node positions, three coordinates each.
    pub fn points(&self) -> Vec<f64> {
        (0..self.n_nodes()).flat_map(|n| self.stored.place(n)).collect()
    }

    /// The elements.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The kind of all elements, if they have one.
    pub fn kind(&self) -> Option<ElementKind> {
        let first = self.cells.first()?.kind;
        self.cells.iter().all(|c| c.kind == first).then_some(first)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.stored.nodes.nrows()
    }

    /// All fields at a stored state.
    pub fn at(&self, row: usize) -> Vec<Field> {
        let real = |name, place, components, values| Field {
            name,
            place,
            components,
            values: Values::Real(values),
        };
        let s = self.stored;
        let mut all = vec![
            real("displacement", Centre::Point, 3, self.vectors(|n| s.displacement(row, n))),
            real("velocity", Centre::Point, 3, self.vectors(|n| s.velocity(row, n))),
        ];
        if !s.contact_nodes.is_empty() {
            let n = s.nodes.nrows();
            let (mut status, mut gap) = (vec![-1; n], vec![f64::NAN; n]);
            // a node has the least gap of the points of quadrature next to it
            for i in 0..s.facing() {
                let node = s.nearest_node(i);
                status[node] = status[node].max(i32::from(s.active[(row, i)]));
                gap[node] = gap[node].min(s.gap[i] - s.contact_displacement(row, i));
            }
            all.push(real("contact_pressure", Centre::Point, 1, s.nodal_pressure()(row)));
            let forces = s.nodal_forces(row).into_iter().flatten().collect();
            all.push(real("contact_force", Centre::Point, 3, forces));
            let (name, values) = ("contact_status", Values::Whole(status));
            all.push(Field { name, place: Centre::Point, components: 1, values });
            all.push(real("gap", Centre::Point, 1, gap));
        }
        let stress = self.stress(row);
        match self.cells.first().map(|c| c.kind) {
            Some(ElementKind::Bar2) => {
                let axial = stress.iter().map(|s| s.xx).collect();
                all.push(real("stress", Centre::Cell, 1, axial));
                let axial = self.recovered(row).iter().map(|s| s.xx).collect();
                all.push(real("stress_recovered", Centre::Point, 1, axial));
            }
            _ => {
                let tensors = stress.iter().flat_map(Stress::tensor).collect();
                all.push(real("stress", Centre::Cell, 9, tensors));
                let equivalent = stress.iter().map(Stress::von_mises).collect();
                all.push(real("von_mises", Centre::Cell, 1, equivalent));
                all.push(real("stress_averaged", Centre::Point, 9, self.averaged(row)));
                let recovered = self.recovered(row);
                let tensors = recovered.iter().flat_map(Stress::tensor).collect();
                all.push(real("stress_recovered", Centre::Point, 9, tensors));
                let equivalent = recovered.iter().map(Stress::von_mises).collect();
                all.push(real("von_mises_recovered", Centre::Point, 1, equivalent));
            }
        }
        all
    }

    /// A vector of every node.
    fn vectors(&self, of: impl Fn(usize) -> Point) -> Vec<f64> {
        (0..self.n_nodes()).flat_map(of).collect()
    }

    /// The stress of the elements around each node, averaged by their volumes.
    fn averaged(&self, row: usize) -> Vec<f64> {
        let mut sums = vec![[0.0; 9]; self.n_nodes()];
        let mut volumes = vec![0.0; self.n_nodes()];
        for c in &self.cells {
            let u = self.displaced(row, c);
            let shape = Shape { kind: c.kind, x: &c.x };
            let volume = shape.volume(&c.material);
            for (&n, s) in c.nodes.iter().zip(stress::at_nodes(&c.material, shape, &u)) {
                volumes[n] += volume;
                sums[n].iter_mut().zip(s.tensor()).for_each(|(sum, x)| *sum += volume * x);
            }
        }
        let mean = |(sum, volume): ([f64; 9], f64)| sum.map(|x| x / volume.max(f64::MIN_POSITIVE));
        sums.into_iter().zip(volumes).flat_map(mean).collect()
    }

    /// How the stress of nodes follows from that of elements.
    fn recovery(&self) -> &[AtNode] {
        self.recovered.get_or_init(|| {
            let cells = self.cells.iter().zip(&self.stored.regions);
            let elements: Vec<Element> = cells
                .map(|(c, &region)| Element { kind: c.kind, region, nodes: &c.nodes })
                .collect();
            let points: Vec<Point> = (0..self.n_nodes()).map(|n| self.stored.place(n)).collect();
            Recovery::new(&points, &elements).all()
        })
    }

    /// Displacements of the nodes of an element.
    fn displaced(&self, row: usize, cell: &Cell) -> Vec<Point> {
        cell.nodes.iter().map(|&n| self.stored.displacement(row, n)).collect()
    }

    /// The recovered stress of the nodes in each of the materials around them, in the order of [`Fields::recovery`].
    fn recovered_by_region(&self, row: usize) -> Vec<Stress> {
        let dim = self.cells.first().map_or(0, |c| c.kind.dim());
        let displacement = |n: usize| self.stored.displacement(row, n);
        let stress = |n: &AtNode| {
            let place = self.stored.place(n.node);
            n.stress(&self.materials[n.region], (&place, dim), displacement)
        };
        self.recovery().iter().map(stress).collect()
    }

    /// The recovered stress of the nodes: where materials meet the mean.
    fn recovered(&self, row: usize) -> Vec<Stress> {
        let mut parts = vec![vec![]; self.n_nodes()];
        let of = self.recovery().iter().zip(self.recovered_by_region(row));
        of.for_each(|(n, stress)| parts[n.node].push(stress));
        let mean = |parts: Vec<Stress>| {
            let share = 1.0 / parts.len() as f64;
            Stress::sum(parts.into_iter().map(|s| (share, s)))
        };
        parts.into_iter().map(mean).collect()
    }

    /// The largest of von Mises' stresses at the centres of the elements over all stored states; none where displacements are not kept.
    pub fn largest_stress(&self) -> Option<LargestStress> {
        let mut most: Option<(f64, usize, usize)> = None;
        for (element, c) in self.cells.iter().enumerate() {
            let centre = AtCentre::new(&c.material, Shape { kind: c.kind, x: &c.x });
            for row in 0..self.stored.t.len() {
                let von_mises = centre.of(&self.displaced(row, c)).von_mises();
                let is_larger = most.is_none_or(|(m, ..)| von_mises > m);
                if von_mises.is_finite() && is_larger {
                    most = Some((von_mises, element, row));
                }
            }
        }
        // a body that moves rigidly has the stress of its rounding
        let (von_mises, element, row) =
            most.filter(|(s, element, _)| *s > ROUNDING * self.cells[*element].material.young)?;
        let c = &self.cells[element];
        let mean = |k: usize| c.x.iter().map(|x| x[k]).sum::<f64>() / c.x.len() as f64;
        let all = self.recovered_by_region(row);
        let nodes = || self.recovery().iter().zip(&all);
        let sizes = nodes().map(|(n, s)| (s.von_mises(), n.node));
        let (recovered, node) = sizes.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let of_node: HashMap<(usize, usize), Stress> =
            nodes().map(|(n, s)| ((n.node, n.region), *s)).collect();
        let [off, own]: [f64; 2] =
            self.cells.iter().zip(&self.stored.regions).fold([0.0; 2], |sum, (c, &r)| {
                let nodal: Vec<Stress> = c.nodes.iter().map(|&n| of_node[&(n, r)]).collect();
                let shape = Shape { kind: c.kind, x: &c.x };
                let [off, own] =
                    recovery::energies(&c.material, shape, (&self.displaced(row, c), &nodal));
                [sum[0] + off, sum[1] + own]
            });
        Some(LargestStress {
            von_mises,
            t: self.stored.t[row],
            element,
            place: [0, 1, 2].map(mean),
            dim: c.kind.dim(),
            recovered,
            node,
            at_node: self.stored.place(node),
            error: (off / (off + own).max(f64::MIN_POSITIVE)).sqrt(),
        })
    }

    fn stress(&self, row: usize) -> Vec<Stress> {
        let of_cell = |c: &Cell| {
            let shape = Shape { kind: c.kind, x: &c.x };
            stress::at_centre(&c.material, shape, &self.displaced(row, c))
        };
        self.cells.iter().map(of_cell).collect()
    }
}
