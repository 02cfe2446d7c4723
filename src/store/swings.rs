//! `/obstacle`: gaps that move. Contact displacements are counted from where the gap has gone; nodes stand where these do, and farther by that.

use std::collections::BTreeMap;

use ndarray::Array3;

use super::StoreError;
use super::careful::Careful;
use crate::contact::System;
use crate::fem::{Course, Loads};
use crate::mesh::Point;

/// A harmonic part of what contact displacements are counted from.
#[derive(Debug, Clone)]
pub(super) struct StoredSwing {
    pub omega: f64,
    pub phase: f64,
    /// Amplitudes along the axes, a contact point each.
    pub of_points: Vec<Point>,
}

/// What contact displacements of a file are counted from.
#[derive(Debug, Clone, Default)]
pub struct StoredSwings {
    parts: Vec<StoredSwing>,
    /// The contact points of nodes: one each, as all of a node have the same motion along the axes.
    of_node: BTreeMap<usize, usize>,
}

impl StoredSwings {
    /// Of contact points at nodes.
    pub(super) fn new(parts: Vec<StoredSwing>, nodes: &[usize]) -> StoredSwings {
        let of_node = match parts.is_empty() {
            true => BTreeMap::new(),
            false => nodes.iter().enumerate().map(|(i, n)| (*n, i)).collect(),
        };
        StoredSwings { parts, of_node }
    }

    /// Those of a body under its loads.
    pub(crate) fn of(system: &System) -> StoredSwings {
        let nodes: Vec<usize> = system.constraints.iter().map(|c| c.node).collect();
        StoredSwings::new(parts(system, &system.loads), &nodes)
    }

    /// What a node has besides its stored displacement at a time, or the derivative of this order.
    pub(super) fn at(&self, node: usize, t: f64, order: u32) -> Point {
        self.of_node.get(&node).map_or([0.0; 3], |&point| self.moved(point, t, order))
    }

    /// What a contact point is counted from at a time.
    pub(super) fn of_point(&self, point: usize, t: f64) -> Point {
        self.moved(point, t, 0)
    }

    fn moved(&self, point: usize, t: f64, order: u32) -> Point {
        let mut moved = [0.0; 3];
        for part in &self.parts {
            let s = Course::Harmonic { omega: part.omega, phase: part.phase }.at(t, order);
            moved.iter_mut().zip(part.of_points[point]).for_each(|(x, q)| *x += s * q);
        }
        moved
    }

    /// Whether gaps stay.
    pub(super) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Add to a nodal field what stands in [`StoredSwings::at`].
    pub(super) fn add(&self, field: &mut [f64], dim: usize, (t, order): (f64, u32)) {
        for &node in self.of_node.keys() {
            let own = field.chunks_exact_mut(dim).nth(node).into_iter().flatten();
            own.zip(self.at(node, t, order)).for_each(|(x, q)| *x += q);
        }
    }

    /// Whether all of it fits to so many contact points.
    pub(super) fn fits(&self, points: usize) -> bool {
        let fits = |p: &StoredSwing| {
            let all = p.of_points.iter().flatten();
            p.of_points.len() == points && all.chain([&p.omega, &p.phase]).all(|x| x.is_finite())
        };
        self.parts.iter().all(fits)
    }
}

/// What the contact points of a body are counted from, along the axes.
fn parts(system: &System, loads: &Loads) -> Vec<StoredSwing> {
    let (body, dofs) = (&system.body, system.body.nodal_dofs());
    let dim = body.mesh.dim();
    let of = |(course, q): (&Course, &[f64])| {
        let Course::Harmonic { omega, phase } = course else { return None };
        let mut full = vec![0.0; system.n()];
        full[system.n() - q.len()..].copy_from_slice(q);
        let columns = dofs.along_axes(&body.nodal(&full));
        let of_point = |node: usize| -> Point {
            let along = |c: usize| (c < dim).then(|| dofs.column(node, c)).flatten();
            std::array::from_fn(|c| along(c).map_or(0.0, |k| columns[k]))
        };
        let of_points = system.constraints.iter().map(|c| of_point(c.node)).collect();
        Some(StoredSwing { omega: *omega, phase: *phase, of_points })
    };
    loads.carried.of_contact().filter_map(of).collect()
}

/// Write `/obstacle`, where gaps move.
pub(super) fn write_swings(file: &hdf5::File, system: &System) -> Result<(), StoreError> {
    let parts = parts(system, &system.loads);
    if parts.is_empty() {
        return Ok(());
    }
    let width = system.body.mesh.dim().max(2);
    let g = file.create_group("obstacle")?;
    let column = |of: fn(&StoredSwing) -> f64| parts.iter().map(of).collect::<Vec<f64>>();
    g.new_dataset_builder().with_data(&column(|p| p.omega)).create("omega")?;
    g.new_dataset_builder().with_data(&column(|p| p.phase)).create("phase")?;
    let of_points = |c: usize, p: &StoredSwing, i: usize| p.of_points[i][c];
    let shape = (parts.len(), system.n_contact(), width);
    let motion = Array3::from_shape_fn(shape, |(k, i, c)| of_points(c, &parts[k], i));
    g.new_dataset_builder().with_data(&motion).create("motion")?;
    Ok(())
}

/// Read `/obstacle`; nothing where gaps stay.
pub(super) fn read_swings(file: &hdf5::File, nodes: &[usize]) -> Result<StoredSwings, hdf5::Error> {
    let Ok(g) = file.group("obstacle") else { return Ok(StoredSwings::default()) };
    let [omega, phase] = ["omega", "phase"].map(|name| g.dataset(name)?.values::<f64>());
    let motion = g.dataset("motion")?.array::<f64>()?;
    let motion = motion.into_dimensionality::<ndarray::Ix3>().map_err(|e| e.to_string())?;
    let part = |(k, (omega, phase)): (usize, (f64, f64))| {
        let of_points = motion.outer_iter().nth(k).map_or(vec![], |table| {
            let of = |row: ndarray::ArrayView1<f64>| {
                std::array::from_fn(|c| row.get(c).copied().unwrap_or(0.0))
            };
            table.rows().into_iter().map(of).collect()
        });
        StoredSwing { omega, phase, of_points }
    };
    let parts = omega?.into_iter().zip(phase?).enumerate().map(part).collect();
    Ok(StoredSwings::new(parts, nodes))
}
