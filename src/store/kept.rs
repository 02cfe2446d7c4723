//! Which displacements a file keeps of a state: `run.store`.

use std::sync::Arc;

use crate::contact::distance::NEXT;
use crate::contact::{Borne, Excursions, System};
use crate::event::{Sample, Watch};
use crate::fem::{Body, Csr};
use crate::problem::parts;
use crate::scenario::{Precision, Scene, Store};

/// A displacement along an axis as a combination of entries of `u`.
type Terms = Vec<(usize, f64)>;

/// Some of the displacements.
#[derive(Debug)]
struct Columns {
    /// Which of all, ascending.
    places: Vec<usize>,
    /// What they are made of, over `u`.
    rows: Csr,
}

/// What is kept of the displacements and velocities of a body, and with how many digits.
#[derive(Debug)]
pub struct Kept {
    /// What is watched besides: forces of groups, supports and springs, probes.
    pub(super) watch: Watch,
    /// What is kept where it is not all.
    part: Option<Columns>,
    /// Tangents of the contact points with friction, over `u`; no row without friction, empty ones where there is none.
    tangents: Csr,
    /// What tells how far parts stray.
    pub(super) excursions: Excursions,
    /// Nothing but what the contact does.
    pub(super) contact_alone: bool,
    /// In single precision.
    pub(super) single: bool,
}

impl Kept {
    /// All displacements of a body.
    pub fn all(system: &System) -> Kept {
        Kept::of(system, None, (false, false))
    }

    fn of(system: &System, part: Option<Columns>, (contact_alone, single): (bool, bool)) -> Kept {
        let all = system.tangents().unwrap_or_default();
        let entries = all.iter().enumerate().flat_map(|(i, tangent)| {
            let row = tangent.as_ref().map_or(vec![], |t| t.row_over(system.n_o()));
            row.into_iter().map(move |(j, w)| (i, j, w))
        });
        let tangents = Csr::from_triplets(all.len(), system.n(), entries.collect());
        let (mut watch, excursions) = (Watch::new(system), Excursions::default());
        if contact_alone {
            // nobody knows what supports bear
            watch.bearings = Arc::default();
        }
        Kept { watch, part, tangents, excursions, contact_alone, single }
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
            && system.probes.is_empty()
            && part.as_ref().is_some_and(|p| is_next(p, system));
        let part = part.map(|p| Columns::of(p, &system.body));
        let mut kept = Kept::of(system, part, (contact_alone, single));
        if !contact_alone {
            let parts = parts(scene, &system.body.mesh);
            kept.excursions = Excursions::new(&system.body, (&parts.of_node, &parts.names));
        }
        kept
    }

    /// Number of displacements that are kept.
    pub fn len(&self) -> usize {
        match &self.part {
            None => self.all_columns(),
            Some(part) => part.places.len(),
        }
    }

    /// Number of all displacements.
    pub(super) fn all_columns(&self) -> usize {
        self.watch.body.nodal_dofs().n_columns()
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
        Some(part.places.iter().map(|k| *k as i64).collect())
    }

    /// Whether somebody asks for accelerations.
    pub(super) fn takes_accelerations(&self) -> bool {
        self.watch.takes_accelerations()
    }

    /// What supports and springs bear at a state, and the momenta.
    pub(super) fn borne(&self, s: &Sample) -> Borne {
        let Watch { body, loads, bearings, .. } = &self.watch;
        let [u, v, a] = s.at_rest(loads);
        bearings.of(body, (loads, s.t), [&u, &v, &a])
    }

    /// The displacements along the tangents, `e u`.
    pub(super) fn slides(&self, u: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.tangents.n_rows()];
        self.tangents.mul(u, &mut all);
        all
    }

    /// What is kept of `u` or `u̇`, along the axes.
    pub(super) fn row(&self, x: &[f64]) -> Vec<f64> {
        match &self.part {
            None => {
                let body = &self.watch.body;
                body.nodal_dofs().along_axes(&body.nodal(x))
            }
            Some(part) => {
                let mut row = vec![0.0; part.places.len()];
                part.rows.mul(x, &mut row);
                row
            }
        }
    }
}

impl Columns {
    fn of(part: Vec<(usize, Terms)>, body: &Body) -> Columns {
        let of = |(r, (_, terms)): (usize, &(usize, Terms))| -> Vec<(usize, usize, f64)> {
            terms.iter().map(|&(i, c)| (r, i, c)).collect()
        };
        let entries = part.iter().enumerate().flat_map(of).collect();
        let rows = Csr::from_triplets(part.len(), body.nodal_dofs().n(), entries);
        let rows = match body.reduction() {
            Some(reduction) => reduction.rows(&rows),
            None => rows,
        };
        Columns { places: part.into_iter().map(|(k, _)| k).collect(), rows }
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
    let masters = dofs.facing.iter().filter_map(|f| Some(f.meeting.as_ref()?.pair.master.as_str()));
    let facing = dofs.facing.iter().map(|f| f.group.as_str()).chain(masters);
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
