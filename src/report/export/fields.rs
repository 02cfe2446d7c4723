//! Fields on the mesh at a stored state, for every format that draws.
//!
//! | field | where | is |
//! | --- | --- | --- |
//! | `displacement`, `velocity` | points | `u`, `u̇` with three components, 0 where prescribed |
//! | `contact_pressure` | points | `p = −λ ≥ 0`, 0 off the contact edge |
//! | `contact_status` | points | 1 in contact, 0 open, −1 no contact node |
//! | `gap` | points | the distance `g − u_C ≥ 0` to the obstacle along the normal, NaN off the contact edge |
//! | `stress` | cells | `σ = D B u` at the centre: a tensor of a plate, the axial stress of a bar |
//! | `von_mises` | cells of a plate | `√(σ_xx² − σ_xx σ_yy + σ_yy² + 3 σ_xy²)` |
//!
//! The three fields of contact are left out where the scene has none.

use super::ExportError;
use crate::fem::stress::{self, Stress};
use crate::fem::{Material, Shape, StressState};
use crate::mesh::ElementKind;
use crate::scenario::Scene;
use crate::store::Stored;

/// What a field's values belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
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

/// A named field at one state.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub name: &'static str,
    pub place: Place,
    pub components: usize,
    pub values: Values,
}

/// The fields of a stored run.
#[derive(Debug)]
pub(super) struct Fields<'s> {
    pub stored: &'s Stored,
    material: Material,
    kind: ElementKind,
    corners: Vec<Vec<[f64; 2]>>,
}

impl<'s> Fields<'s> {
    /// The constants of the stress are in the scene that made the run.
    pub fn of(stored: &'s Stored) -> Result<Fields<'s>, ExportError> {
        let scene = Scene::parse(&stored.scene, &stored.path)
            .map_err(|e| ExportError::damaged(stored, e))?;
        let Some(material) = stress::material(&scene.body) else {
            return Err(ExportError::NoGeometry(stored.path.clone()));
        };
        let kind = match material.state {
            StressState::Uniaxial { .. } => ElementKind::Bar2,
            _ => ElementKind::Quad4,
        };
        if stored.elements.ncols() != kind.nodes() {
            return Err(ExportError::damaged(stored, "it is not the one of this mesh"));
        }
        let at = |&n: &i64| [stored.nodes[(n as usize, 0)], stored.nodes[(n as usize, 1)]];
        let elements = stored.elements.rows().into_iter();
        let corners = elements.map(|e| e.iter().map(at).collect()).collect();
        Ok(Fields { stored, material, kind, corners })
    }

    /// Node positions, three coordinates each.
    pub fn points(&self) -> Vec<f64> {
        self.stored.nodes.rows().into_iter().flat_map(|p| [p[0], p[1], 0.0]).collect()
    }

    /// Nodes of the elements.
    pub fn connectivity(&self) -> Vec<i64> {
        self.stored.elements.iter().copied().collect()
    }

    /// Number of nodes, number of elements, nodes of an element.
    pub fn counts(&self) -> (usize, usize, usize) {
        let e = &self.stored.elements;
        (self.stored.nodes.nrows(), e.nrows(), e.ncols())
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
            real("displacement", Place::Point, 3, self.vectors(&s.u, row)),
            real("velocity", Place::Point, 3, self.vectors(&s.v, row)),
        ];
        if !s.contact_nodes.is_empty() {
            let n = s.nodes.nrows();
            let (mut pressure, mut status, mut gap) =
                (vec![0.0; n], vec![-1; n], vec![f64::NAN; n]);
            // a node has the mean of the points of quadrature next to it, and the least of their gaps
            let mut count = vec![0.0; n];
            for i in 0..s.gap.len() {
                let node = s.nearest_node(i);
                pressure[node] += s.pressure[(row, i)];
                count[node] += 1.0;
                status[node] = status[node].max(i32::from(s.active[(row, i)]));
                gap[node] = gap[node].min(s.gap[i] - s.contact_displacement(row, i));
            }
            pressure.iter_mut().zip(&count).for_each(|(p, n)| *p /= f64::max(*n, 1.0));
            all.push(real("contact_pressure", Place::Point, 1, pressure));
            let (name, values) = ("contact_status", Values::Whole(status));
            all.push(Field { name, place: Place::Point, components: 1, values });
            all.push(real("gap", Place::Point, 1, gap));
        }
        let stress = self.stress(row);
        match self.kind {
            ElementKind::Bar2 => {
                let axial = stress.iter().map(|s| s.xx).collect();
                all.push(real("stress", Place::Cell, 1, axial));
            }
            _ => {
                let tensors = stress.iter().flat_map(Stress::tensor).collect();
                all.push(real("stress", Place::Cell, 9, tensors));
                let equivalent = stress.iter().map(Stress::von_mises).collect();
                all.push(real("von_mises", Place::Cell, 1, equivalent));
            }
        }
        all
    }

    fn vectors(&self, table: &ndarray::Array2<f64>, row: usize) -> Vec<f64> {
        let component = |i: &i64| usize::try_from(*i).map_or(0.0, |i| table[(row, i)]);
        let nodes = self.stored.dof_map.rows().into_iter();
        nodes.flat_map(|dof| [component(&dof[0]), component(&dof[1]), 0.0]).collect()
    }

    fn stress(&self, row: usize) -> Vec<Stress> {
        let displacement = |&n: &i64| self.stored.displacement(row, n as usize);
        let elements = self.stored.elements.rows().into_iter();
        let each = elements.zip(&self.corners).map(|(e, x)| {
            let u: Vec<_> = e.iter().map(displacement).collect();
            stress::at_centre(&self.material, Shape { kind: self.kind, x }, &u)
        });
        each.collect()
    }
}
