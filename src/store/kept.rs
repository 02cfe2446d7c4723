//! Which displacements a file keeps of a state: `run.store`.

use std::sync::Arc;

use crate::contact::System;
use crate::contact::distance::NEXT;
use crate::fem::Body;
use crate::scenario::{Precision, Scene, Store};

/// A displacement along an axis as a combination of entries of `u`.
type Terms = Vec<(usize, f64)>;

/// What is kept of the displacements and velocities of a body, and with how many digits.
#[derive(Debug)]
pub struct Kept {
    body: Arc<Body>,
    /// Columns of all displacements, ascending, with what they are made of; none: all are kept.
    part: Option<Vec<(usize, Terms)>>,
    /// Nothing but what the contact does.
    pub(super) contact_alone: bool,
    /// In single precision.
    pub(super) single: bool,
}

impl Kept {
    /// All displacements of a body.
    pub fn all(system: &System) -> Kept {
        Kept { body: system.body.clone(), part: None, contact_alone: false, single: false }
    }

    /// As `[run]` of a scene says.
    pub(crate) fn of_run(scene: &Scene, system: &System) -> Kept {
        let run = scene.run.as_ref();
        let part = match run.map(|r| &r.store) {
            None | Some(Store::All) => None,
            Some(Store::Contact | Store::Groups(_)) => Some(part(scene, system)),
        };
        let single = run.is_some_and(|r| r.precision == Precision::Single);
        // nodes of a group that are held along its normal are no contact, and may be far from it
        let contact_alone = run.is_some_and(|r| r.store == Store::Contact)
            && part.as_ref().is_some_and(|p| is_next(p, system));
        Kept { body: system.body.clone(), part, contact_alone, single }
    }

    /// Number of displacements that are kept.
    pub fn len(&self) -> usize {
        match &self.part {
            None => self.all_columns(),
            Some(part) => part.len(),
        }
    }

    /// Number of all displacements.
    pub(super) fn all_columns(&self) -> usize {
        self.body.nodal_dofs().n_columns()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of a state.
    pub fn bytes(&self) -> usize {
        2 * self.len() * if self.single { 4 } else { 8 }
    }

    /// The columns that are kept, where these are not all.
    pub(super) fn columns(&self) -> Option<Vec<i64>> {
        let part = self.part.as_ref()?;
        Some(part.iter().map(|(k, _)| *k as i64).collect())
    }

    /// What is kept of `u` or `u̇`, along the axes.
    pub(super) fn row(&self, x: &[f64]) -> Vec<f64> {
        let x = self.body.nodal(x);
        match &self.part {
            None => self.body.nodal_dofs().along_axes(&x),
            Some(part) => {
                part.iter().map(|(_, terms)| terms.iter().map(|(i, c)| c * x[*i]).sum()).collect()
            }
        }
    }
}

/// Whether nothing is kept but what lies next to the contact.
fn is_next(part: &[(usize, Terms)], system: &System) -> bool {
    let distances = system.distances();
    let mut all = part.iter().flat_map(|(_, terms)| terms);
    all.all(|(i, _)| distances.get(*i).is_none_or(|d| *d <= NEXT))
}

/// The columns of the contact and of the groups of a scene.
fn part(scene: &Scene, system: &System) -> Vec<(usize, Terms)> {
    let (mesh, dofs) = (&system.body.mesh, system.body.nodal_dofs());
    let facing = dofs.facing.iter().map(|f| f.group.as_str());
    let groups = facing.chain(scene.stored_groups().map(|(_, group)| group));
    // springs push at points of their own, which are no nodes; a body from matrices has nodes, and no groups
    let yields = system.promise().yields;
    let points = system.constraints.iter().map(|c| c.node);
    let points = points.filter(|_| !yields && dofs.facing.is_empty());
    let nodes = groups.flat_map(|group| mesh.group_nodes(group)).chain(points);
    let of_node = |n: usize| (0..mesh.dim()).map(move |c| (n, c));
    let of_nodes = nodes.flat_map(of_node).filter_map(|(n, c)| {
        let terms = dofs.terms(n, c).collect();
        dofs.column(n, c).map(|k| (k, terms))
    });
    let own = |i: usize| dofs.n_o + system.conditions().points[i].0;
    let apart = (0..system.n_contact()).filter(|_| yields);
    let mut all: Vec<(usize, Terms)> =
        of_nodes.chain(apart.map(|i| (own(i), vec![(own(i), 1.0)]))).collect();
    all.sort_by_key(|(k, _)| *k);
    all.dedup_by_key(|(k, _)| *k);
    all
}
