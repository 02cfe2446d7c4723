//! `/moving`: supports that move. What they hold is no displacement of the tables: nodes stand where these motions are.

use std::collections::BTreeMap;
use std::sync::Arc;

use ndarray::Array3;

use super::StoreError;
use super::careful::Careful;
use crate::contact::System;
use crate::fem::{Course, Spline};
use crate::mesh::Point;

/// What held nodes do.
#[derive(Debug, Clone, Default)]
pub struct StoredMoving {
    courses: Vec<Course>,
    /// Of each node how far it moves with each course.
    of_node: BTreeMap<usize, Vec<Point>>,
}

impl StoredMoving {
    /// That of a body under its loads.
    pub(crate) fn of(system: &System) -> StoredMoving {
        let dim = system.body.mesh.dim();
        let all: Vec<(&Course, &[f64])> = system.loads.carried.of_supports().collect();
        let mut of_node: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
        for (k, (_, field)) in all.iter().enumerate() {
            for (node, own) in field.chunks_exact(dim).enumerate() {
                if own.iter().any(|x| *x != 0.0) {
                    let motions = of_node.entry(node).or_insert_with(|| vec![[0.0; 3]; all.len()]);
                    motions[k][..dim].copy_from_slice(own);
                }
            }
        }
        StoredMoving { courses: all.iter().map(|(c, _)| (*c).clone()).collect(), of_node }
    }

    /// Where a node is at a time, or the derivative of this order.
    pub(super) fn at(&self, node: usize, t: f64, order: u32) -> Point {
        let mut moved = [0.0; 3];
        for (course, w) in self.courses.iter().zip(self.of_node.get(&node).into_iter().flatten()) {
            let s = course.at(t, order);
            moved.iter_mut().zip(w).for_each(|(x, w)| *x += s * w);
        }
        moved
    }

    /// Whether all of it is of nodes that there are.
    pub(super) fn fits(&self, nodes: usize) -> bool {
        let is_finite = |p: &Point| p.iter().all(|x| x.is_finite());
        self.of_node.iter().all(|(n, w)| *n < nodes && w.iter().all(is_finite))
    }
}

/// Write `/moving`, where supports move.
pub(super) fn write_moving(file: &hdf5::File, system: &System) -> Result<(), StoreError> {
    let own = StoredMoving::of(system);
    if own.of_node.is_empty() {
        return Ok(());
    }
    let g = file.create_group("moving")?;
    let nodes: Vec<i64> = own.of_node.keys().map(|n| *n as i64).collect();
    g.new_dataset_builder().with_data(&nodes).create("node")?;
    let width = system.body.mesh.dim().max(2);
    let motions: Vec<&Vec<Point>> = own.of_node.values().collect();
    let shape = (own.courses.len(), nodes.len(), width);
    let motion = Array3::from_shape_fn(shape, |(k, i, c)| motions[i][k][c]);
    g.new_dataset_builder().with_data(&motion).create("motion")?;
    let harmonic = |of: fn(f64, f64) -> f64| -> Vec<f64> {
        let number = |course: &Course| match course {
            Course::Constant => 0.0,
            Course::Harmonic { omega, phase } => of(*omega, *phase),
            Course::Measured(_) => f64::NAN,
        };
        own.courses.iter().map(number).collect()
    };
    g.new_dataset_builder().with_data(&harmonic(|omega, _| omega)).create("omega")?;
    g.new_dataset_builder().with_data(&harmonic(|_, phase| phase)).create("phase")?;
    let mut rows: (Vec<i64>, Vec<f64>, Vec<f64>) = Default::default();
    for (k, course) in own.courses.iter().enumerate() {
        if let Course::Measured(table) = course {
            rows.0.extend(table.times().iter().map(|_| k as i64));
            rows.1.extend(table.times());
            rows.2.extend(table.values());
        }
    }
    if !rows.0.is_empty() {
        g.new_dataset_builder().with_data(&rows.0).create("table_part")?;
        g.new_dataset_builder().with_data(&rows.1).create("table_t")?;
        g.new_dataset_builder().with_data(&rows.2).create("table_value")?;
    }
    Ok(())
}

/// Read `/moving`; nothing where supports stay, and in files of earlier versions.
pub(super) fn read_moving(file: &hdf5::File) -> Result<StoredMoving, hdf5::Error> {
    let Ok(g) = file.group("moving") else { return Ok(StoredMoving::default()) };
    let nodes: Vec<i64> = g.dataset("node")?.values()?;
    let motion = g.dataset("motion")?.array::<f64>()?;
    let motion = motion.into_dimensionality::<ndarray::Ix3>().map_err(|e| e.to_string())?;
    let [omega, phase] = ["omega", "phase"].map(|name| g.dataset(name)?.values::<f64>());
    let (omega, phase) = (omega?, phase?);
    let (parts, of_parts, _) = motion.dim();
    if omega.len() != parts || phase.len() != parts || nodes.len() != of_parts {
        return Err("/moving: its parts do not fit together".into());
    }
    let mut tables: BTreeMap<usize, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
    if g.link_exists("table_part") {
        let part: Vec<i64> = g.dataset("table_part")?.values()?;
        let t: Vec<f64> = g.dataset("table_t")?.values()?;
        let y: Vec<f64> = g.dataset("table_value")?.values()?;
        for ((k, t), y) in part.iter().zip(t).zip(y) {
            let own = tables.entry(usize::try_from(*k).unwrap_or(usize::MAX)).or_default();
            own.0.push(t);
            own.1.push(y);
        }
    }
    let mut courses = vec![];
    for (k, (omega, phase)) in omega.into_iter().zip(phase).enumerate() {
        courses.push(match tables.remove(&k) {
            Some((t, y)) if t.len() > 1 && t.windows(2).all(|w| w[0] < w[1]) => {
                Course::Measured(Arc::new(Spline::new(t, y)))
            }
            None if omega.is_finite() && phase.is_finite() => Course::Harmonic { omega, phase },
            _ => return Err("/moving: a part has no course".into()),
        });
    }
    let of = |(i, n): (usize, &i64)| {
        let along = |k: usize| -> Point {
            std::array::from_fn(|c| motion.get((k, i, c)).copied().unwrap_or(0.0))
        };
        (usize::try_from(*n).unwrap_or(usize::MAX), (0..parts).map(along).collect())
    };
    Ok(StoredMoving { of_node: nodes.iter().enumerate().map(of).collect(), courses })
}
