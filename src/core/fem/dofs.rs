//! Numbering of the displacements: prescribed ones leave, `u = (u_O, u_C)`.
//!
//! `u_C` are displacements of contact nodes along their contact directions `m`, `u_C,i = m_i·u`; what is left of these nodes' displacements belongs to
//! `u_O`: no friction. Where two surfaces meet they are counted against those of the master, `u_C,i = m_i·(u_i − Σ_j P_ij u_j)`. Nodal displacements along the axes are
//! `T u`, `T` made of the local bases of [`super::frame`] and of these rows: `M' = TᵀMT`, `K' = TᵀKT`, forces `Tᵀf`.

use std::collections::BTreeMap;

use super::frame::{ContactPoint, Facing, Frame, FrameError, Frames, Held, Slot};
use super::massless::Massless;
use super::order::order;
use super::sparse::Csr;
use crate::mesh::{Mesh, Point};

/// Rows of given matrices that are contact displacements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactRows {
    /// Those that face something.
    pub facing: Vec<usize>,
    /// The obstacle of each of these; empty: one for all.
    pub groups: Vec<usize>,
    /// `P_ij` of the rows against which each of these is counted; may be empty: rigid obstacles.
    pub against: Vec<Vec<(usize, f64)>>,
    /// Rows of masters that give up their inertia, and those that have none.
    pub idle: Vec<usize>,
    /// Of some of these: which of those that face something moves along its obstacle by them.
    pub tangents: Vec<(usize, usize)>,
    /// Motions without mass of several rows, each with the idle row that stands for it: the others move with that one, and by themselves.
    pub massless: Vec<Massless>,
}

impl ContactRows {
    /// Before rigid obstacles.
    pub fn facing(rows: &[usize]) -> ContactRows {
        ContactRows { facing: rows.to_vec(), ..ContactRows::default() }
    }

    /// All of them, in the order of `u_C`.
    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.facing.iter().chain(&self.idle).copied()
    }
}

/// From nodes and components to the entries of `u`.
#[derive(Debug, Clone, PartialEq)]
pub struct DofMap {
    /// Components per node.
    pub dim: usize,
    /// Length of `u_O`.
    pub n_o: usize,
    /// Length of `u_C`.
    pub n_c: usize,
    /// `u_C` are displacements of the body that are but seen: they have no rows of their own.
    pub is_seen: bool,
    /// Contact points of the mesh, in the order of `u_C` where these are their displacements: those that face something, then the nodes of masters that give up their
    /// inertia, then displacements along obstacles that do.
    pub contact: Vec<ContactPoint>,
    /// Number of those that face something.
    pub n_facing: usize,
    /// The displacements along obstacles without inertia, places in `u_C`, and the contact points that they are of.
    pub tangents: Vec<(usize, usize)>,
    /// `P_ij` of the nodes against whose displacements that of a contact point is counted.
    against: Vec<Vec<(usize, f64)>>,
    /// Rows of `T` of the nodes that follow others, one a component.
    tied: BTreeMap<usize, Vec<Vec<(usize, f64)>>>,
    /// The groups before obstacles.
    pub facing: Vec<Facing>,
    /// Contact point of a node in a group.
    in_group: BTreeMap<(usize, usize), usize>,
    /// Bases other than the axes.
    frames: BTreeMap<usize, Frame>,
    /// Entry of `u` of each direction of a node's basis.
    index: Vec<Option<usize>>,
    /// Entries of `u` that are the displacements of the contact points, with their signs.
    places: Vec<(usize, f64)>,
    /// Nodal displacements (node and component as one number) that move, and only with others: see [`DofMap::column`].
    slaves: Vec<usize>,
    /// Of given matrices: place in `u` of each row.
    rows: Vec<usize>,
    /// Of given matrices: entries of `u` whose rows move with others as well, `u_i = û_i + Σ_p Z_ip û_p`.
    mixed: Vec<(usize, Vec<(usize, f64)>)>,
}

impl DofMap {
    /// Number the displacements that supports leave.
    pub fn new(mesh: &Mesh, held: &[Held], facing: &[Facing]) -> Result<DofMap, FrameError> {
        DofMap::number(mesh, Frames::new(mesh, held, facing, true)?, facing, true)
    }

    /// The numbering of a body whose contact displacements move by themselves: they are among `u_O`.
    pub fn beside(mesh: &Mesh, held: &[Held], facing: &[Facing]) -> Result<DofMap, FrameError> {
        DofMap::number(mesh, Frames::new(mesh, held, facing, false)?, facing, false)
    }

    fn number(
        mesh: &Mesh,
        frames: Frames,
        facing: &[Facing],
        apart: bool,
    ) -> Result<DofMap, FrameError> {
        let Frames { of_node, slots, contact, n_facing, tangents, against, in_group } = frames;
        let dim = mesh.dim();
        let mut index = vec![None; slots.len()];
        let mut n_o = 0;
        let at_contact: Vec<usize> = contact.iter().map(|c| c.node).collect();
        let in_order = order(mesh, &at_contact).into_iter();
        for d in in_order.flat_map(|node| dim * node..dim * (node + 1)) {
            let leaves = match slots[d] {
                Slot::Free => false,
                Slot::Held => true,
                Slot::Contact(_) => apart,
            };
            if !leaves {
                index[d] = Some(n_o);
                n_o += 1;
            }
        }
        let mut places = vec![(0, 1.0); contact.len()];
        for (d, slot) in slots.iter().enumerate() {
            if let &Slot::Contact(i) = slot {
                if apart {
                    index[d] = Some(n_o + i);
                }
                let own = of_node.get(&(d / dim)).map_or(1.0, |f| f.rows[d % dim][d % dim]);
                let sign = contact[i].direction[d % dim].signum() * own.signum();
                places[i] = (index[d].unwrap_or(0), sign);
            }
        }
        let mut dofs = DofMap {
            dim,
            n_o,
            n_c: if apart { contact.len() } else { 0 },
            is_seen: false,
            contact,
            n_facing,
            tangents,
            against,
            tied: BTreeMap::new(),
            facing: facing.to_vec(),
            in_group,
            frames: of_node,
            index,
            places,
            slaves: vec![],
            rows: vec![],
            mixed: vec![],
        };
        dofs.tie(&slots)?;
        let components = |n: usize| dofs.dim * n..dofs.dim * (n + 1);
        let moves = |&k: &usize| dofs.index[k].is_none() && dofs.terms_of(k).next().is_some();
        dofs.slaves = dofs.skew().into_iter().flat_map(components).filter(moves).collect();
        Ok(dofs)
    }

    /// The nodes whose displacements along the axes are combinations of entries of `u`.
    fn skew(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.frames.keys().chain(self.tied.keys()).copied().collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The rows of `T` of nodes that are counted against others; a master may be counted against others itself.
    fn tie(&mut self, slots: &[Slot]) -> Result<(), FrameError> {
        let mut waiting: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
        for (d, slot) in slots.iter().enumerate() {
            if let &Slot::Contact(i) = slot
                && !self.against[i].is_empty()
            {
                waiting.entry(d / self.dim).or_default().push((d % self.dim, i));
            }
        }
        while !waiting.is_empty() {
            let of_pair = |points: &[(usize, usize)]| {
                points
                    .iter()
                    .flat_map(|(_, i)| &self.against[*i])
                    .all(|(j, _)| !waiting.contains_key(j))
            };
            let ready: Vec<usize> =
                waiting.iter().filter(|(_, p)| of_pair(p)).map(|(n, _)| *n).collect();
            if ready.is_empty() {
                let first = waiting.values().flatten().next();
                let group = first.map_or(0, |(_, i)| self.contact[*i].group);
                return Err(FrameError::Circle { group: self.facing[group].group.clone() });
            }
            for node in ready {
                let points = waiting.remove(&node).unwrap_or_default();
                let rows = (0..self.dim).map(|c| self.tied_row(node, c, &points)).collect();
                self.tied.insert(node, rows);
            }
        }
        Ok(())
    }

    /// `u_s,c = Σ_k W⁻¹_ck (û_k + Σ_j P_ij m_i·u_j)`, the sum over masters for the slots of contact points.
    fn tied_row(&self, node: usize, c: usize, points: &[(usize, usize)]) -> Vec<(usize, f64)> {
        let mut row: BTreeMap<usize, f64> = self.terms(node, c).collect();
        let axis = |k: usize| f64::from(u8::from(c == k));
        for &(slot, i) in points {
            let factor = self.frames.get(&node).map_or(axis(slot), |f| f.inverse[c][slot]);
            // the slot may count against the contact direction
            let m = self.contact[i].direction;
            let own = self.frames.get(&node).map_or_else(|| m, |f| f.rows[slot]);
            for &(j, p) in &self.against[i] {
                for d in 0..self.dim {
                    for (e, t) in self.terms(j, d) {
                        *row.entry(e).or_insert(0.0) += factor * p * own[d] * t;
                    }
                }
            }
        }
        row.into_iter().filter(|(_, v)| *v != 0.0).collect()
    }

    /// The displacements of given matrices: node `i` of a row of points carries row `i`; the last node is the ground.
    pub(crate) fn of_rows(n: usize, rows: &ContactRows) -> DofMap {
        let contact: Vec<usize> = rows.all().collect();
        let mut index = vec![None; n + 1];
        let mut n_o = 0;
        for i in (0..n).filter(|i| !contact.contains(i)) {
            index[i] = Some(n_o);
            n_o += 1;
        }
        for (k, &i) in contact.iter().enumerate() {
            index[i] = Some(n_o + k);
        }
        let mut against = rows.against.clone();
        against.resize(contact.len(), vec![]);
        // u_i = û_i + Σ Z û_p; contact displacements and what follows with them are coordinates by themselves
        let mut with: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
        // one of contact displacements alone moves with these
        for motion in rows.massless.iter().filter(|m| rows.idle.contains(&m.pivot)) {
            let of_others = motion.others.iter().filter(|e| !contact.contains(&e.0));
            of_others.for_each(|&(i, z)| with.entry(i).or_default().push((motion.pivot, z)));
        }
        let place = |(row, z): (usize, f64)| index[row].map(|i| (i, z));
        let own = |row: usize| -> Vec<(usize, f64)> {
            let others = with.get(&row).into_iter().flatten().copied();
            std::iter::once((row, 1.0)).chain(others).filter_map(place).collect()
        };
        // u_s = u_C + Σ P u_m
        let tied = |(&s, masters): (&usize, &Vec<(usize, f64)>)| {
            let mut row: BTreeMap<usize, f64> = own(s).into_iter().collect();
            for &(m, p) in masters {
                own(m).into_iter().for_each(|(i, z)| *row.entry(i).or_insert(0.0) += p * z);
            }
            (!masters.is_empty()).then(|| (s, vec![row.into_iter().collect()]))
        };
        let mut tied: BTreeMap<usize, Vec<Vec<(usize, f64)>>> =
            contact.iter().zip(&against).filter_map(tied).collect();
        tied.extend(with.keys().map(|&row| (row, vec![own(row)])));
        let of_mixed = |(&row, others): (&usize, &Vec<(usize, f64)>)| {
            Some((index[row]?, others.iter().filter_map(|e| place(*e)).collect()))
        };
        let mixed = with.iter().filter_map(of_mixed).collect();
        let place_of = |row: usize| contact.iter().position(|i| *i == row);
        let tangent = |&(row, point): &(usize, usize)| Some((place_of(row)?, point));
        let tangents = rows.tangents.iter().filter_map(tangent).collect();
        let x = [1.0, 0.0, 0.0];
        let group = |k: usize| rows.groups.get(k).copied().unwrap_or(0);
        let point = |(k, &i): (usize, &usize)| ContactPoint {
            node: i,
            direction: x,
            normal: x,
            group: group(k),
        };
        DofMap {
            dim: 1,
            n_o,
            n_c: contact.len(),
            is_seen: false,
            contact: contact.iter().enumerate().map(point).collect(),
            n_facing: rows.facing.len(),
            tangents,
            against,
            tied,
            facing: vec![],
            in_group: BTreeMap::new(),
            frames: BTreeMap::new(),
            rows: index[..n].iter().flatten().copied().collect(),
            places: (n_o..n).map(|i| (i, 1.0)).collect(),
            slaves: vec![],
            index,
            mixed,
        }
    }

    /// Nodes behind the rows of given matrices, which move nothing: `all` of both, before the ground.
    pub(crate) fn hold_rows(&mut self, all: usize) {
        self.index.resize(all + 1, None);
    }

    /// Number of rows of given matrices.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// The same with `n_c` contact displacements that are but seen.
    pub(crate) fn with_points(self, n_c: usize) -> DofMap {
        DofMap { n_c, is_seen: true, ..self }
    }

    /// The same with `count` more entries of `u_O`, its last ones, that are displacements of no node.
    pub(crate) fn with_memory(mut self, count: usize) -> DofMap {
        let n_o = self.n_o;
        let moved = |i: &mut usize| {
            if *i >= n_o {
                *i += count;
            }
        };
        self.index.iter_mut().flatten().for_each(moved);
        self.rows.iter_mut().for_each(moved);
        self.places.iter_mut().for_each(|p| moved(&mut p.0));
        self.tied.values_mut().flatten().flatten().for_each(|t| moved(&mut t.0));
        for (i, others) in &mut self.mixed {
            moved(i);
            others.iter_mut().for_each(|e| moved(&mut e.0));
        }
        self.n_o += count;
        self
    }

    /// The same contact with `n_o` coordinates in place of `u_O`: no node has a number any more.
    pub(crate) fn of_coordinates(&self, n_o: usize) -> DofMap {
        let (index, tied) = (vec![None; self.index.len()], BTreeMap::new());
        DofMap { n_o, index, tied, mixed: vec![], ..self.clone() }
    }

    /// `Tᵀ A T` of a matrix over the displacements of given matrices.
    pub fn congruence(&self, a: &Csr) -> Csr {
        let of = |(i, j, v): (usize, usize, f64)| {
            self.terms(i, 0)
                .flat_map(move |(k, c)| self.terms(j, 0).map(move |(l, d)| (k, l, c * v * d)))
        };
        Csr::from_triplets(self.n(), self.n(), a.triplets().flat_map(of).collect())
    }

    /// Place in `u` of a row of given matrices that is counted against no other.
    pub fn row(&self, row: usize) -> usize {
        self.rows.get(row).copied().unwrap_or(row)
    }

    /// The node of each entry of `u`; entries that are no displacements have numbers of their own.
    pub(crate) fn node_of_entries(&self) -> Vec<usize> {
        let n = self.n();
        let mut nodes: Vec<usize> = (self.index.len()..self.index.len() + n).collect();
        for (k, i) in self.index.iter().enumerate() {
            if let Some(i) = i.filter(|i| *i < n) {
                nodes[i] = k / self.dim;
            }
        }
        nodes
    }

    /// First entries of `u` of the nodes all of whose displacements follow one another.
    pub(crate) fn whole_nodes(&self) -> Vec<usize> {
        let of = |node: &[Option<usize>]| {
            let first = node.first().copied().flatten()?;
            node.iter().enumerate().all(|(c, i)| *i == Some(first + c)).then_some(first)
        };
        self.index.chunks(self.dim).filter_map(of).collect()
    }

    /// Length of `u`.
    pub fn n(&self) -> usize {
        self.n_o + self.n_c
    }

    /// Entry of `u` that is, but for the sign given with it, the displacement of a contact point of the mesh along its direction.
    pub fn contact_place(&self, point: usize) -> (usize, f64) {
        self.places[point]
    }

    /// `P_ij` of the nodes against whose displacements that of a contact point is counted; none before a rigid obstacle.
    pub fn against(&self, point: usize) -> &[(usize, f64)] {
        &self.against[point]
    }

    /// The contact point of a node in one of the groups before obstacles, or, these counted on, in the masters that they meet.
    pub fn contact_at(&self, group: usize, node: usize) -> Option<usize> {
        self.in_group.get(&(group, node)).copied()
    }

    /// A nodal displacement along an axis as a combination of entries of `u`: a row of `T`.
    pub fn terms(&self, node: usize, component: usize) -> impl Iterator<Item = (usize, f64)> {
        let tied = self.tied.get(&node).map(|rows| rows[component].iter().copied());
        let own = tied.is_none().then(|| self.own_terms(node, component));
        tied.into_iter().flatten().chain(own.into_iter().flatten())
    }

    /// The same of a node that no other moves.
    fn own_terms(&self, node: usize, component: usize) -> impl Iterator<Item = (usize, f64)> {
        let frame = self.frames.get(&node);
        let slots = match frame {
            None => component..component + 1,
            Some(_) => 0..self.dim,
        };
        slots.filter_map(move |k| {
            let i = self.index[self.dim * node + k]?;
            let c = frame.map_or(1.0, |f| f.inverse[component][k]);
            (c != 0.0).then_some((i, c))
        })
    }

    fn terms_of(&self, k: usize) -> impl Iterator<Item = (usize, f64)> {
        self.terms(k / self.dim, k % self.dim)
    }

    /// The directions along which the displacements of a node are counted, with their entries in `u`; none for held ones.
    pub fn directions(&self, node: usize) -> impl Iterator<Item = (Point, Option<usize>)> {
        let frame = self.frames.get(&node);
        (0..self.dim).map(move |k| {
            let axis = std::array::from_fn(|c| f64::from(u8::from(c == k)));
            (frame.map_or(axis, |f| f.rows[k]), self.index[self.dim * node + k])
        })
    }

    /// `TᵀT` of a node whose displacements along all axes have the same mass.
    pub(super) fn gram(&self, node: usize) -> Vec<(usize, usize, f64)> {
        let Some(rows) = self.tied.get(&node) else { return self.own_gram(node).collect() };
        let of_row = |row: &Vec<(usize, f64)>| {
            let pairs = row.iter().flat_map(|a| row.iter().map(move |b| (a, b)));
            pairs.map(|(a, b)| (a.0, b.0, a.1 * b.1)).collect::<Vec<_>>()
        };
        rows.iter().flat_map(of_row).collect()
    }

    fn own_gram(&self, node: usize) -> impl Iterator<Item = (usize, usize, f64)> {
        let frame = self.frames.get(&node).filter(|f| !f.is_orthonormal);
        let pairs = (0..self.dim).flat_map(move |a| {
            match frame {
                None => a..a + 1,
                Some(_) => 0..self.dim,
            }
            .map(move |b| (a, b))
        });
        pairs.filter_map(move |(a, b)| {
            let (i, j) = (self.index[self.dim * node + a]?, self.index[self.dim * node + b]?);
            let of = |f: &Frame| (0..self.dim).map(|c| f.inverse[c][a] * f.inverse[c][b]).sum();
            Some((i, j, frame.map_or(1.0, of)))
        })
    }

    /// Whether a nodal field moves a held direction of a node.
    pub(crate) fn moves_held(&self, node: usize, field: &[f64]) -> bool {
        let w = &field[self.dim * node..self.dim * (node + 1)];
        self.directions(node).any(|(d, place)| {
            place.is_none() && w.iter().zip(&d).map(|(w, d)| w * d).sum::<f64>() != 0.0
        })
    }

    /// `u` from a nodal field of displacements (components interleaved): `û = W u` at every node, less what the masters of a contact point do.
    pub fn gather(&self, nodal: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.n()];
        let of = |node: usize| &nodal[self.dim * node..self.dim * (node + 1)];
        for node in 0..nodal.len() / self.dim {
            let own = of(node);
            let frame = self.frames.get(&node);
            for k in 0..self.dim {
                let Some(i) = self.index[self.dim * node + k] else { continue };
                u[i] = match frame {
                    None => own[k],
                    Some(f) => own.iter().zip(&f.rows[k]).map(|(x, w)| x * w).sum(),
                };
            }
        }
        self.count_against(&mut u, |node, c| of(node)[c]);
        self.unmix(&mut u);
        u
    }

    /// Take from displacements of rows what they move with others: `û_i = u_i − Σ_p Z_ip û_p`.
    fn unmix(&self, u: &mut [f64]) {
        for (i, others) in &self.mixed {
            u[*i] -= others.iter().map(|&(p, z)| z * u[p]).sum::<f64>();
        }
    }

    /// Take from contact displacements what their masters do: `Σ_j P_ij m_i·u_j`.
    fn count_against(&self, u: &mut [f64], of: impl Fn(usize, usize) -> f64) {
        for (i, masters) in self.against.iter().enumerate().filter(|(_, m)| !m.is_empty()) {
            let (m, (place, sign)) = (self.contact[i].direction, self.places[i]);
            let along = |j: usize| (0..self.dim).map(|c| m[c] * of(j, c)).sum::<f64>();
            u[place] -= sign * masters.iter().map(|(j, p)| p * along(*j)).sum::<f64>();
        }
    }

    /// Forces on `u` of nodal forces: `Tᵀ f`.
    pub fn gather_forces(&self, nodal: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; self.n()];
        for (k, x) in nodal.iter().enumerate() {
            self.terms_of(k).for_each(|(i, c)| f[i] += c * x);
        }
        f
    }

    /// Nodal displacements from `u`, prescribed ones zero: `T u`.
    pub fn scatter(&self, u: &[f64]) -> Vec<f64> {
        let of = |k: usize| self.terms_of(k).map(|(i, c)| c * u[i]).sum();
        (0..self.index.len()).map(of).collect()
    }

    /// The column in which files hold a nodal displacement along an axis: that of its entry of `u`, or behind them all where it moves with another
    /// one alone; none where it never moves.
    pub fn column(&self, node: usize, component: usize) -> Option<usize> {
        let k = self.dim * node + component;
        let behind = || self.slaves.iter().position(|s| *s == k).map(|s| self.n() + s);
        self.index[k].or_else(behind)
    }

    /// Number of columns in which files hold the displacements.
    pub fn n_columns(&self) -> usize {
        self.n() + self.slaves.len()
    }

    /// `u` as files hold it: displacements along the axes, one for each [`DofMap::column`]; those of contact points that are no nodes stay.
    pub fn along_axes(&self, u: &[f64]) -> Vec<f64> {
        let mut x = u.to_vec();
        let of = |k: usize| self.terms_of(k).map(|(i, c)| c * u[i]).sum::<f64>();
        for node in self.skew() {
            for k in self.dim * node..self.dim * (node + 1) {
                if let Some(i) = self.index[k] {
                    x[i] = of(k);
                }
            }
        }
        x.extend(self.slaves.iter().map(|&k| of(k)));
        x
    }

    /// The same back: `u` of what a file holds.
    pub fn from_axes(&self, x: &[f64]) -> Vec<f64> {
        let mut u = x[..self.n()].to_vec();
        let of = |node: usize, c: usize| self.column(node, c).map_or(0.0, |k| x[k]);
        for (&node, frame) in &self.frames {
            let own: Vec<f64> = (0..self.dim).map(|c| of(node, c)).collect();
            for k in 0..self.dim {
                if let Some(i) = self.index[self.dim * node + k] {
                    u[i] = own.iter().zip(&frame.rows[k]).map(|(x, w)| x * w).sum();
                }
            }
        }
        self.count_against(&mut u, of);
        self.unmix(&mut u);
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured;

    #[test]
    fn contact_displacements_come_last_and_point_outwards() {
        let mesh = structured::rectangle(1.0, 1.0, 2, 2);
        let held = [Held::along("right", 0), Held::along("bottom", 1)];
        let d = DofMap::new(&mesh, &held, &[Facing::surface("left")]).unwrap();
        assert_eq!((d.n_o, d.n_c), (3 + 6, 3));
        let node = mesh.group_nodes("left")[1];
        assert_eq!(d.terms(node, 0).collect::<Vec<_>>(), [(d.n_o + 1, -1.0)]);
        assert_eq!((d.contact[1].node, d.contact_place(1)), (node, (d.n_o + 1, 1.0)));
        let d = DofMap::beside(&mesh, &held, &[Facing::surface("left")]).unwrap();
        assert_eq!(d.terms(node, 0).collect::<Vec<_>>(), [(d.contact_place(1).0, 1.0)]);
        assert_eq!(d.contact_place(1).1, -1.0);
        let d = DofMap::new(&mesh, &held, &[Facing::surface("left")]).unwrap();
        let nodal: Vec<f64> = (0..18).map(|k| k as f64).collect();
        let back = d.scatter(&d.gather(&nodal));
        for (k, v) in back.iter().enumerate() {
            assert!(*v == nodal[k] || d.column(k / 2, k % 2).is_none());
        }
    }

    #[test]
    fn corner_held_in_the_normal_direction_is_no_contact_node() {
        let mesh = structured::rectangle(1.0, 1.0, 2, 2);
        let held = [Held::along("bottom", 0)];
        assert_eq!(DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap().n_c, 2);
    }

    /// A square turned by an angle, with a held plane of symmetry and two obstacles that share a corner: fields that the supports allow come back
    /// from `u`, from files, and work is the same in both numberings.
    #[test]
    fn fields_and_forces_go_through_oblique_bases() {
        let straight = structured::rectangle(1.0, 1.0, 3, 3);
        let (sin, cos) = 0.5f64.sin_cos();
        let turned = |[x, y, _]: Point| [cos * x - sin * y, sin * x + cos * y, 0.0];
        let mesh = straight.moved(turned);
        let held = [Held { group: "bottom".into(), fix: super::super::frame::Fix::Normal }];
        let oblique = Facing::plane("top", Some(turned([0.28, 0.96, 0.0])));
        let facing = [Facing::surface("right"), oblique];
        for d in [DofMap::new(&mesh, &held, &facing), DofMap::beside(&mesh, &held, &facing)] {
            let d = d.unwrap();
            assert_eq!((d.contact.len(), d.n_o + d.n_c), (8, 32 - 4));
            // along the plane of symmetry, free elsewhere
            let field = |k: usize| (1.3 * k as f64).sin();
            let nodal: Vec<f64> = (0..mesh.n_nodes())
                .flat_map(|n| {
                    let across = if straight.nodes()[n][1] == 0.0 { 0.0 } else { field(2 * n + 1) };
                    let [x, y, _] = turned([field(2 * n), across, 0.0]);
                    [x, y]
                })
                .collect();
            let near = |a: &[f64], b: &[f64]| {
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14));
            };
            let u = d.gather(&nodal);
            near(&d.scatter(&u), &nodal);
            let stored = d.along_axes(&u);
            near(&d.from_axes(&stored), &u);
            for (k, x) in nodal.iter().enumerate() {
                let of_file = d.column(k / 2, k % 2).map_or(0.0, |c| stored[c]);
                assert!((of_file - x).abs() < 1e-14);
            }
            for (i, c) in d.contact.iter().enumerate() {
                let along: f64 = (0..2).map(|a| c.direction[a] * nodal[2 * c.node + a]).sum();
                let (place, sign) = d.contact_place(i);
                assert!((sign * u[place] - along).abs() < 1e-14);
            }
            let force: Vec<f64> = (0..nodal.len()).map(|k| (0.7 * k as f64).cos()).collect();
            let work = |f: &[f64], u: &[f64]| f.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
            assert!((work(&force, &nodal) - work(&d.gather_forces(&force), &u)).abs() < 1e-13);
        }
    }
}
