//! Reading what this program wrote.

use std::path::{Path, PathBuf};

use hdf5::types::FixedAscii;
use ndarray::Array2;

use super::bodies::read_words;
use super::careful::{Careful, open, reading};
use super::columns::{ENERGY, FRICTION};
use super::events::{point_of, read_states};
use super::moving::{StoredMoving, read_moving};
use super::swings::{StoredSwings, read_swings};
use super::watched::{self, StoredProbe, columns_that_act};
use super::{StoreError, read_text};
use crate::contact::States;
use crate::fem::interpolate::{Cell, elements_at, is_between_surfaces};
use crate::mesh::point::plus;
use crate::mesh::{ElementKind, Point, bounds};
use crate::records::Status;
use crate::scenario::{BodyKind, Scene};

/// A stored run.
#[derive(Debug, Clone)]
pub struct Stored {
    /// Path of the file.
    pub path: PathBuf,
    /// Scene title.
    pub title: String,
    /// Scene text.
    pub scene: String,
    /// Program version.
    pub version: String,
    /// Time of creation.
    pub created: String,
    /// Command line.
    pub command: String,
    /// `running`, `complete`, `failed: …`.
    pub status: Status,
    /// Node positions.
    pub nodes: Array2<f64>,
    /// Elements.
    pub elements: Array2<i64>,
    /// Index into `u`, −1 prescribed.
    pub dof_map: Array2<i64>,
    /// What the file calls the contact points: nodes of the mesh, or their numbers where they are points of quadrature.
    pub contact_nodes: Vec<usize>,
    /// Places of points of quadrature, one row each.
    points: Option<Array2<f64>>,
    /// Their columns of `u`.
    contact_dofs: Vec<usize>,
    /// What makes of these displacements along the normals.
    point_sign: f64,
    /// Gaps.
    pub gap: Vec<f64>,
    /// Areas of the contact points; not numbers in files of earlier versions.
    pub contact_area: Vec<f64>,
    /// What contact displacements are counted from, where gaps move.
    pub(crate) swings: StoredSwings,
    /// What supports do that move.
    pub(crate) moving: StoredMoving,
    /// Contact directions, one row each.
    pub contact_normals: Array2<f64>,
    /// Nodes against which the displacement of each contact point is counted, with their weights; none before rigid obstacles.
    against: Vec<Vec<(usize, f64)>>,
    /// Which obstacle each contact point belongs to.
    pub contact_groups: Vec<usize>,
    /// Names of the rows of a body of matrices, where its program gave them.
    row_names: Vec<String>,
    /// The groups before the obstacles; files of earlier versions do not name them.
    groups: Vec<String>,
    /// Material of each element.
    pub regions: Vec<usize>,
    /// Times.
    pub t: Vec<f64>,
    /// Displacements along the axes that the file keeps, one row a time.
    u: Array2<f64>,
    /// Velocities.
    v: Array2<f64>,
    /// Their columns among all displacements, where these are not all (`run.store`).
    columns: Option<Vec<i64>>,
    /// The column that holds each displacement; none where it is not kept.
    held: Vec<Option<usize>>,
    /// What the contact points do, by their codes: 0 is open.
    pub active: Array2<u8>,
    /// Pressures.
    pub pressure: Array2<f64>,
    /// What friction did; none without it.
    pub rubbed: Option<StoredFriction>,
    /// Forces of contact groups, supports and springs; files of earlier versions have fewer.
    pub forces: Vec<StoredForces>,
    /// What probes saw.
    pub probes: Vec<StoredProbe>,
    /// Energies: `kinetic, elastic, external, dissipated, jumps`, …, one column each.
    pub energy: Vec<Vec<f64>>,
    /// Switching times.
    pub switch_t: Vec<f64>,
    /// Switching nodes.
    pub switch_node: Vec<usize>,
    /// Switching contact points.
    pub switch_point: Vec<usize>,
    /// `close` or `open`.
    pub switch_kind: Vec<String>,
    /// Energy jumps.
    pub switch_jump: Vec<f64>,
    /// Rates of the monitors that vanish: of a point that closes the negative of its velocity towards the obstacle just before.
    pub switch_rate: Vec<f64>,
    /// Number of grazings.
    pub grazings: usize,
}

/// What friction did at stored states.
#[derive(Debug, Clone)]
pub struct StoredFriction {
    /// Tractions along the tangents.
    pub traction: Array2<f64>,
    /// Displacements along the tangents; files of earlier versions have none.
    pub slide: Option<Array2<f64>>,
    /// What it took at each contact point over the run, and how far the point slipped; empty in a file of a run that has not ended.
    pub work: Vec<f64>,
    /// Slip paths.
    pub path: Vec<f64>,
    /// Tangents of the contact points; none in a file of a run that has not ended.
    pub direction: Option<Array2<f64>>,
    /// What it took so far.
    pub taken: Vec<f64>,
    /// Work so far of surfaces that move.
    pub belt: Vec<f64>,
}

/// Forces of one kind at stored states.
#[derive(Debug, Clone)]
pub struct StoredForces {
    /// `contact`, `support` or `spring`.
    pub kind: &'static str,
    /// Groups, or springs.
    pub names: Vec<String>,
    /// A row a state: components of the first, then of the next.
    pub values: Array2<f64>,
}

impl StoredForces {
    /// Components of one.
    pub fn components(&self) -> usize {
        self.values.ncols() / self.names.len().max(1)
    }

    /// The components that are more than rounding, with what they are called; none where nobody knows them.
    pub fn components_that_act(&self) -> Vec<(usize, String)> {
        let dim = self.components();
        let called = |c: usize| match (&self.names[c / dim], dim) {
            (name, 1) => name.clone(),
            (name, _) => format!("{name}, {}", ["x", "y", "z"][c % dim]),
        };
        columns_that_act(&self.values).into_iter().map(|c| (c, called(c))).collect()
    }

    fn fits(&self, rows: usize) -> bool {
        let (columns, names) = (self.values.ncols(), self.names.len());
        self.values.nrows() == rows && columns > 0 && columns <= 3 * names && columns % names == 0
    }
}

impl StoredFriction {
    fn fits(&self, rows: usize, n_c: usize) -> bool {
        let mut tables = std::iter::once(&self.traction).chain(&self.slide);
        let mut tangents = self.direction.iter();
        let mut points = [&self.work, &self.path].into_iter();
        tables.all(|table| table.dim() == (rows, n_c))
            && tangents.all(|t| t.nrows() == n_c && t.iter().all(|x| x.is_finite()))
            && self.work.len() == self.path.len()
            && points.all(|column| column.is_empty() || column.len() == n_c)
            && [&self.taken, &self.belt].iter().all(|column| column.len() == rows)
    }
}

impl Stored {
    /// Read a whole run.
    pub fn read(path: &Path) -> Result<Stored, StoreError> {
        reading(path, || {
            let file = open(path)?;
            let mut stored = Self::read_body(path, &file)?;
            stored.read_motion(&file)?;
            stored.checked()
        })
    }

    /// Read the body of any file, without a motion.
    pub fn body(path: &Path) -> Result<Stored, StoreError> {
        reading(path, || Self::read_body(path, &open(path)?)?.checked())
    }

    fn read_body(path: &Path, file: &hdf5::File) -> Result<Stored, StoreError> {
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let mesh = file.group("mesh").map_err(|_| missing("/mesh"))?;
        let text = |name: &str| read_text(file, name).unwrap_or_default();
        let indices = |v: Vec<i64>| v.into_iter().map(|i| i as usize).collect();
        let points = match mesh.dataset("contact_points") {
            Ok(places) => Some(places.table::<f64>()?),
            Err(_) => None,
        };
        let gap: Vec<f64> = mesh.dataset("gap")?.values()?;
        let elements: Array2<i64> = mesh.dataset("elements")?.table()?;
        // files of earlier versions have one normal along an axis, one obstacle, one material
        let name = read_text(&mesh, "contact_normal").unwrap_or_default();
        let sign = if name.starts_with('-') { -1.0 } else { 1.0 };
        let axis = usize::from(name.ends_with('y'));
        let normals = match mesh.dataset("contact_normals") {
            Ok(normals) => normals.table()?,
            Err(_) => {
                Array2::from_shape_fn((gap.len(), 2), |(_, c)| if c == axis { sign } else { 0.0 })
            }
        };
        let or_zeros = |name: &str, count: usize| -> Result<Vec<usize>, hdf5::Error> {
            match mesh.dataset(name) {
                Ok(dataset) => Ok(indices(dataset.values()?)),
                Err(_) => Ok(vec![0; count]),
            }
        };
        let groups = or_zeros("contact_groups", gap.len())?;
        let names = mesh.dataset("contact_groups").ok().and_then(|d| read_text(&d, "names"));
        let regions = or_zeros("regions", elements.nrows())?;
        let contact_nodes: Vec<usize> = match (&points, mesh.dataset("contact_nodes")) {
            (_, Ok(nodes)) => indices(nodes.values()?),
            (Some(points), Err(_)) => (0..points.nrows()).collect(),
            (None, Err(e)) => return Err(e.into()),
        };
        let contact_dofs: Vec<usize> = match &points {
            Some(_) => indices(mesh.dataset("contact_dofs")?.values()?),
            None => vec![],
        };
        let dof_map: Array2<i64> = mesh.dataset("dof_map")?.table()?;
        let n_c = gap.len();
        let n = check_displacements(path, &dof_map, (&contact_dofs, n_c))?;
        Ok(Stored {
            path: path.to_owned(),
            title: text("title"),
            scene: text("scene"),
            version: text("signorini_version"),
            created: text("created"),
            command: text("command"),
            status: Status::of_name(&text("status")),
            nodes: mesh.dataset("nodes")?.table()?,
            elements,
            dof_map,
            swings: read_swings(file, &contact_nodes)?,
            moving: read_moving(file)?,
            contact_nodes,
            contact_dofs,
            // their displacements stood along the axis
            point_sign: if mesh.link_exists("contact_groups") { 1.0 } else { sign },
            points,
            contact_area: match mesh.dataset("contact_area") {
                Ok(areas) => areas.values()?,
                Err(_) => vec![f64::NAN; mesh.dataset("gap")?.size()],
            },
            gap,
            against: read_against(path, file, n_c)?,
            contact_normals: normals,
            contact_groups: groups,
            row_names: match mesh.dataset("row_names") {
                Ok(names) => read_words(&names)?,
                Err(_) => vec![],
            },
            groups: names.unwrap_or_default().lines().map(str::to_owned).collect(),
            regions,
            t: vec![],
            u: Array2::zeros((0, n)),
            v: Array2::zeros((0, n)),
            columns: None,
            held: (0..n).map(Some).collect(),
            active: Array2::zeros((0, n_c)),
            pressure: Array2::zeros((0, n_c)),
            forces: vec![],
            probes: vec![],
            rubbed: None,
            energy: vec![vec![]; ENERGY.len() - 1],
            switch_t: vec![],
            switch_node: vec![],
            switch_point: vec![],
            switch_kind: vec![],
            switch_jump: vec![],
            switch_rate: vec![],
            grazings: 0,
        })
    }

    fn read_motion(&mut self, file: &hdf5::File) -> Result<(), StoreError> {
        let group = |name: &str| {
            let path = self.path.clone();
            file.group(name).map_err(|_| StoreError::Missing { path, what: format!("/{name}") })
        };
        let (trajectory, switches) = (group("trajectory")?, group("switches")?);
        group("energy")?;
        let column = |name: &str| file.dataset(&format!("energy/{name}"))?.values::<f64>();
        self.energy = Self::energy_names().map(column).collect::<Result<_, hdf5::Error>>()?;
        self.t = trajectory.dataset("t")?.values()?;
        let (u, v) = (trajectory.dataset("u")?.table()?, trajectory.dataset("v")?.table()?);
        match trajectory.dataset("columns") {
            Ok(columns) => {
                let of = columns.attr("of")?.read_scalar::<i64>()?;
                self.hold((columns.values()?, of), u, v);
            }
            Err(_) => self.set_states(u, v),
        }
        self.active = trajectory.dataset("active")?.table()?;
        self.pressure = trajectory.dataset("pressure")?.table()?;
        if file.link_exists(FRICTION[0].about.path) {
            let of_points = |name: &str| match file.group("friction") {
                Ok(group) if group.link_exists(name) => Ok(group.dataset(name)?.values()?),
                _ => Ok::<_, StoreError>(vec![]),
            };
            self.rubbed = Some(StoredFriction {
                traction: trajectory.dataset("traction")?.table()?,
                slide: match trajectory.link_exists("slide") {
                    true => Some(trajectory.dataset("slide")?.table()?),
                    false => None,
                },
                work: of_points("work")?,
                path: of_points("path")?,
                direction: match file.link_exists("friction/direction") {
                    true => Some(file.dataset("friction/direction")?.table()?),
                    false => None,
                },
                taken: column("friction")?,
                belt: column("belt")?,
            });
        }
        for (kind, names) in [("contact", "group"), ("support", "group"), ("spring", "name")] {
            if file.link_exists(&format!("forces/{kind}/force")) {
                let group = file.group(&format!("forces/{kind}"))?;
                let names = read_words(&group.dataset(names)?)?;
                let values = group.dataset("force")?.table()?;
                self.forces.push(StoredForces { kind, names, values });
            }
        }
        self.probes = watched::read(file)?;
        self.switch_t = switches.dataset("t")?.values()?;
        let nodes: Vec<i64> = switches.dataset("node")?.values()?;
        self.switch_node = nodes.into_iter().map(|i| i as usize).collect();
        let before = read_states(file, "switches/active_before")?;
        let after = read_states(file, "switches/active_after")?;
        let point = |((node, before), after): ((&usize, &States), &States)| {
            point_of(&self.contact_nodes, *node, before, after)
        };
        self.switch_point = self.switch_node.iter().zip(&before).zip(&after).map(point).collect();
        let kinds = switches.dataset("kind")?.values::<FixedAscii<32>>()?;
        self.switch_kind = kinds.iter().map(|w| w.as_str().to_owned()).collect();
        self.switch_jump = switches.dataset("energy_jump")?.values()?;
        self.switch_rate = switches.dataset("monitor_rate")?.values()?;
        self.grazings = file.dataset("grazings/t").map_or(0, |d| d.size());
        Ok(())
    }

    /// States of which the file keeps these columns only.
    fn hold(&mut self, (columns, of): (Vec<i64>, i64), u: Array2<f64>, v: Array2<f64>) {
        (self.u, self.v) = (u, v);
        // at least as many as the mesh names; a number of a damaged file is not believed
        let named = self.held.len();
        let of = usize::try_from(of).unwrap_or(0);
        let all = of.clamp(named, named + self.gap.len());
        self.held = vec![None; all];
        for (k, &i) in columns.iter().enumerate() {
            if let Some(place) = usize::try_from(i).ok().and_then(|i| self.held.get_mut(i)) {
                *place = Some(k);
            }
        }
        self.columns = Some(columns);
    }

    /// Put states in place of those that it has.
    pub(crate) fn set_states(&mut self, u: Array2<f64>, v: Array2<f64>) {
        self.columns = None;
        self.held = (0..u.ncols()).map(Some).collect();
        (self.u, self.v) = (u, v);
    }

    /// Names of the columns of [`Stored::energy`].
    pub(crate) fn energy_names() -> impl Iterator<Item = &'static str> {
        // the first one is the time
        ENERGY[1..].iter().map(|column| column.about.place().1)
    }

    /// Whether a contact point touches in a state.
    pub fn touches(&self, row: usize, point: usize) -> bool {
        self.active[(row, point)] != 0
    }

    /// Number of displacements of the body.
    pub fn n_displacements(&self) -> usize {
        self.held.len()
    }

    /// Number of displacements that the file keeps.
    pub fn n_kept(&self) -> usize {
        self.u.ncols()
    }

    /// The displacements and velocities of a state, all of them; see [`Stored::whole`].
    pub fn state(&self, row: usize) -> (Vec<f64>, Vec<f64>) {
        (self.u.row(row).to_vec(), self.v.row(row).to_vec())
    }

    /// The same, if it keeps the displacements of the whole body.
    pub fn whole(&self) -> Result<&Stored, StoreError> {
        match self.held.iter().all(Option::is_some) {
            true => Ok(self),
            false => Err(partial(&self.path, (self.n_kept(), self.n_displacements()))),
        }
    }

    fn checked(self) -> Result<Stored, StoreError> {
        match self.inconsistency() {
            None => Ok(self),
            Some(what) => Err(StoreError::unusable(&self.path, format!("damaged: {what}"))),
        }
    }

    /// What does not fit together, if anything: everything that reads this may index without fear.
    fn inconsistency(&self) -> Option<&'static str> {
        let (nodes, rows, n) = (self.nodes.nrows(), self.t.len(), self.held.len());
        let kept = self.held.iter().flatten().count();
        let (n_c, width) = (self.gap.len(), self.nodes.ncols());
        let finite = |x: &f64| x.is_finite();
        let below = |i: i64, limit: usize| usize::try_from(i).is_ok_and(|i| i < limit);
        let tables = [self.u.nrows(), self.v.nrows(), self.active.nrows(), self.pressure.nrows()];
        let checks = [
            ((width == 2 || width == 3) && nodes > 0, "/mesh/nodes"),
            (self.nodes.iter().all(|x| x.is_finite()), "/mesh/nodes"),
            (self.gap.iter().all(|g| g.is_finite()), "/mesh/gap"),
            (self.elements.iter().all(|&e| e == -1 || below(e, nodes)), "/mesh/elements"),
            ((0..self.elements.nrows()).all(|k| self.kind(k).is_some()), "/mesh/elements"),
            (self.regions.len() == self.elements.nrows(), "/mesh/regions"),
            (self.contact_normals.dim() == (n_c, width), "/mesh/contact_normals"),
            (self.contact_normals.iter().all(finite), "/mesh/contact_normals"),
            (self.contact_groups.len() == n_c, "/mesh/contact_groups"),
            (
                self.against.iter().flatten().all(|(n, p)| *n < nodes && p.is_finite()),
                "/contact/against",
            ),
            (self.dof_map.dim() == (nodes, width), "/mesh/dof_map"),
            (self.dof_map.iter().all(|&i| i == -1 || below(i, n)), "/mesh/dof_map"),
            // several sliders may act on one displacement
            (self.contact_nodes.len() == n_c, "/mesh/contact_nodes"),
            (self.contact_area.len() == n_c, "/mesh/contact_area"),
            (self.swings.fits(n_c), "/obstacle"),
            (self.moving.fits(nodes), "/moving"),
            (self.contact_dofs.iter().all(|&i| i < n), "/mesh/contact_dofs"),
            (self.points.is_none() || self.contact_dofs.len() == n_c, "/mesh/contact_dofs"),
            (
                self.points.is_some() || self.contact_nodes.iter().all(|&i| i < nodes),
                "/mesh/contact_nodes",
            ),
            (
                self.points.as_ref().is_none_or(|p| p.ncols() == width && p.iter().all(finite)),
                "/mesh/contact_points",
            ),
            (self.columns.as_ref().is_none_or(|c| c.len() == kept), "/trajectory/columns"),
            (self.u.ncols() == kept, "/trajectory/u"),
            (self.v.ncols() == kept, "/trajectory/v"),
            (self.active.ncols() == n_c && self.pressure.ncols() == n_c, "/trajectory/active"),
            (tables.iter().all(|&r| r == rows), "/trajectory: rows"),
            (self.t.iter().all(|t| t.is_finite()), "/trajectory/t"),
            (self.t.windows(2).all(|w| w[0] < w[1]), "/trajectory/t"),
            (self.energy.iter().all(|c| c.len() == rows), "/energy"),
            (self.rubbed.as_ref().is_none_or(|r| r.fits(rows, n_c)), "/energy/friction"),
            (self.forces.iter().all(|f| f.fits(rows)), "/forces"),
            (self.probes.iter().all(|p| p.fits(rows)), "/probes"),
            (self.switch_node.len() == self.switch_t.len(), "/switches/node"),
            (self.switch_point.len() == self.switch_t.len(), "/switches/active_before"),
            (self.switch_kind.len() == self.switch_t.len(), "/switches/kind"),
            (self.switch_jump.len() == self.switch_t.len(), "/switches/energy_jump"),
            (self.switch_rate.len() == self.switch_t.len(), "/switches/monitor_rate"),
        ];
        checks.iter().find(|(fits, _)| !fits).map(|(_, what)| *what)
    }

    /// Place of contact point `i`.
    pub fn contact_place(&self, i: usize) -> Point {
        match &self.points {
            Some(points) => in_space(points.row(i)),
            None => self.place(self.contact_nodes[i]),
        }
    }

    /// Number of contact points before obstacles: sliders, which belong to no group, stand behind them.
    pub fn facing(&self) -> usize {
        self.contact_groups.iter().take_while(|g| **g != usize::MAX).count()
    }

    /// What a contact point is called where it needs a name of its own: its node; where the node meets several obstacles `GROUP:NODE`, and on the other
    /// side of the same displacement `NODE:behind`; a slider by its number.
    pub(crate) fn contact_name(&self, i: usize) -> String {
        if let Some(slider) = i.checked_sub(self.facing()) {
            return format!("slider{slider}");
        }
        let same = |&j: &usize| self.contact_nodes[j] == self.contact_nodes[i];
        let group = self.contact_groups[i];
        let several = (0..self.gap.len()).filter(same).any(|j| self.contact_groups[j] != group);
        let is_behind = (0..i).filter(same).any(|j| self.contact_groups[j] == group);
        let node = self.node_name(self.contact_nodes[i]);
        let before = match (several, self.groups.get(group).filter(|name| !name.is_empty())) {
            (false, _) => String::new(),
            (true, Some(name)) => format!("{name}:"),
            (true, None) => format!("{group}:"),
        };
        format!("{before}{node}{}", if is_behind { ":behind" } else { "" })
    }

    /// The node that a word means: its number, or of a body of matrices the name of a row.
    pub fn node_called(&self, word: &str) -> Result<usize, String> {
        if let Some(row) = self.row_names.iter().position(|name| name == word) {
            return Ok(row);
        }
        // the last node of a body from matrices is the ground
        let count = self.nodes.nrows() - usize::from(self.is_of_matrices());
        match (word.parse(), &self.row_names[..]) {
            (Ok(node), _) if node < count => Ok(node),
            (Ok(_), []) => Err(format!("the nodes count from 0 to {}", count - 1)),
            (Ok(_), [first, ..]) => Err(format!(
                "the rows count from 0 to {}; by name they are called such as {first}",
                count - 1
            )),
            (Err(_), [first, .., last]) => {
                // of a node that supports hold, or whose rows are turned
                let node = word.rsplit_once('.').map_or(word, |(node, _)| node);
                let is_of_node =
                    |name: &&String| name.rsplit_once('.').is_some_and(|n| n.0 == node);
                let own: Vec<&str> =
                    self.row_names.iter().filter(is_of_node).map(String::as_str).collect();
                let there = match own.is_empty() {
                    true => format!("the first is {first}, the last {last}"),
                    false => format!("node {node} has {}", own.join(", ")),
                };
                Err(format!("no row is called so: {there}; numbers from 0 on are rows, too"))
            }
            (Err(_), _) => Err("give the numbers of nodes, from 0 on".to_owned()),
        }
    }

    /// What a node is called: the name of a row, else its number.
    pub fn node_name(&self, node: usize) -> String {
        self.row_names.get(node).cloned().unwrap_or_else(|| node.to_string())
    }

    /// Whether rows of matrices have names.
    pub(crate) fn has_row_names(&self) -> bool {
        !self.row_names.is_empty()
    }

    /// Direction of contact point `i`.
    pub(crate) fn contact_normal(&self, i: usize) -> Point {
        in_space(self.contact_normals.row(i))
    }

    /// Place of a node.
    pub fn place(&self, node: usize) -> Point {
        in_space(self.nodes.row(node))
    }

    /// Whether the body is one in space.
    pub(crate) fn is_solid(&self) -> bool {
        self.nodes.ncols() == 3
    }

    /// The node of the mesh nearest to a contact point.
    pub fn nearest_node(&self, i: usize) -> usize {
        if self.points.is_none() {
            return self.contact_nodes[i];
        }
        let place = self.contact_place(i);
        let distance =
            |n: usize| self.place(n).iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let all = 0..self.nodes.nrows();
        all.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// Contact pressure of every node at stored state `row`: the largest of the obstacles that it meets; of points that are no nodes the mean at the nearest one; of masters
    /// `p_j = Σ_i P_ij D_i p_i / Σ_i P_ij D_i`, for `Σ_i P_ij D_i = ∫Φ_j` over what is covered; zero off the contact.
    pub(crate) fn nodal_pressure(&self) -> impl Fn(usize) -> Vec<f64> + '_ {
        // sliders have forces, and no pressure
        let nearest: Vec<usize> = (0..self.facing()).map(|i| self.nearest_node(i)).collect();
        move |row| self.nodal_pressure_at(row, &nearest)
    }

    /// The nodes that can have a contact pressure, in their order.
    pub(crate) fn nodes_that_bear(&self) -> Vec<usize> {
        let slaves = (0..self.facing()).map(|i| self.nearest_node(i));
        let masters = self.against.iter().flatten().map(|(node, _)| *node);
        let mut all: Vec<usize> = slaves.chain(masters).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn nodal_pressure_at(&self, row: usize, nearest: &[usize]) -> Vec<f64> {
        let n = self.nodes.nrows();
        let (mut pressure, mut count) = (vec![0.0; n], vec![0.0; n]);
        for (i, &node) in nearest.iter().enumerate() {
            let (own, at_node) = (self.pressure[(row, i)], &mut pressure[node]);
            *at_node = match self.points.is_some() {
                true => *at_node + own,
                false if count[node] > 0.0 => at_node.max(own),
                false => own,
            };
            count[node] += 1.0;
        }
        if self.points.is_some() {
            pressure.iter_mut().zip(&count).for_each(|(p, n)| *p /= f64::max(*n, 1.0));
        }
        let (mut force, mut area) = (vec![0.0; n], vec![0.0; n]);
        for (i, masters) in self.against.iter().enumerate() {
            for &(j, weight) in masters {
                force[j] += weight * self.contact_area[i] * self.pressure[(row, i)];
                area[j] += weight * self.contact_area[i];
            }
        }
        // an end that is covered by next to nothing has no pressure of its own
        let most = area.iter().copied().fold(0.0, f64::max);
        for j in (0..n).filter(|&j| area[j] > COVERED * most) {
            pressure[j] += force[j] / area[j];
        }
        pressure
    }

    /// Force of the contact on every node at stored state `row`: `A_i (−p_i n_i + τ_i t_i)` at contact points, the opposite by `P` at the masters that
    /// these meet. Nothing where areas are not known.
    pub(crate) fn nodal_forces(&self, row: usize) -> Vec<Point> {
        let mut all = vec![[0.0; 3]; self.nodes.nrows()];
        for i in 0..self.facing() {
            let area = Some(self.contact_area[i]).filter(|a| a.is_finite()).unwrap_or(0.0);
            let normal = self.contact_normal(i);
            let along = self.rubbed.as_ref().map_or(0.0, |r| r.traction[(row, i)]);
            let tangent = self.tangent(i);
            let of = |c: usize| area * (along * tangent[c] - self.pressure[(row, i)] * normal[c]);
            let force: Point = std::array::from_fn(of);
            let masters = self.against.get(i).into_iter().flatten().map(|&(j, p)| (j, -p));
            for (node, weight) in std::iter::once((self.nearest_node(i), 1.0)).chain(masters) {
                all[node].iter_mut().zip(force).for_each(|(sum, f)| *sum += weight * f);
            }
        }
        all
    }

    /// Tangent of contact point `i`: in the plane its normal turned by +90°; zero where nobody knows it.
    fn tangent(&self, i: usize) -> Point {
        let [x, y, _] = self.contact_normal(i);
        let known = self.rubbed.as_ref().and_then(|r| r.direction.as_ref());
        match known {
            Some(table) => in_space(table.row(i)),
            None if self.is_solid() => [0.0; 3],
            None => [-y, x, 0.0],
        }
    }

    /// Whether contact point `i` meets another surface, and no rigid obstacle.
    pub fn meets(&self, i: usize) -> bool {
        self.against.get(i).is_some_and(|masters| !masters.is_empty())
    }

    /// Whether gaps move.
    pub(crate) fn swings(&self) -> bool {
        !self.swings.is_empty()
    }

    /// Distance of contact point `i`, undeformed, to its obstacle at stored state `row`.
    pub(crate) fn gap_at(&self, row: usize, i: usize) -> f64 {
        let moved = self.swings.of_point(i, self.time(row));
        self.gap[i] + self.contact_normal(i).iter().zip(moved).map(|(n, q)| n * q).sum::<f64>()
    }

    /// Displacement of contact point `i` along its direction, at stored state `row`; where two surfaces meet against that of the other.
    pub fn contact_displacement(&self, row: usize, i: usize) -> f64 {
        self.along_normal(&self.u, row, i)
    }

    /// Its velocity.
    pub fn contact_velocity(&self, row: usize, i: usize) -> f64 {
        self.along_normal(&self.v, row, i)
    }

    fn along_normal(&self, table: &Array2<f64>, row: usize, i: usize) -> f64 {
        // points that are no nodes have columns of their own, along the normal
        if self.points.is_some() {
            return self.point_sign * self.entry(table, row, self.contact_dofs[i]);
        }
        let mut along = self.at_node(table, row, self.contact_nodes[i]);
        for (node, weight) in self.against.get(i).into_iter().flatten() {
            let master = self.at_node(table, row, *node);
            along.iter_mut().zip(master).for_each(|(x, m)| *x -= weight * m);
        }
        self.contact_normal(i).iter().zip(along).map(|(n, x)| n * x).sum()
    }

    /// Kind of element `k`, by its number of nodes.
    pub fn kind(&self, k: usize) -> Option<ElementKind> {
        let row = self.elements.row(k);
        let nodes = row.iter().take_while(|n| **n >= 0).count();
        let filled = row.iter().skip(nodes).all(|n| *n == -1);
        let kind = match self.is_solid() {
            true => ElementKind::of_nodes(3, nodes),
            // a bar lies in the plane
            false => ElementKind::of_nodes(2, nodes).or(ElementKind::of_nodes(1, nodes)),
        };
        kind.filter(|_| filled)
    }

    /// Nodes of element `k`.
    pub fn nodes_of(&self, k: usize) -> Vec<usize> {
        let row = self.elements.row(k);
        row.iter().filter_map(|&n| usize::try_from(n).ok()).collect()
    }

    /// The nodes and weights by which the element of a place interpolates, a coordinate an axis of the body; an error says why there are none, or several.
    pub fn weights_at(&self, place: &[f64]) -> Result<Cell, String> {
        if self.is_of_matrices() {
            return Err(
                "is none of a body from matrices, which has rows: --nodes takes them".into()
            );
        }
        let is_bar = (0..self.elements.nrows()).all(|k| self.kind(k).is_some_and(|k| k.dim() == 1));
        let axes = if is_bar { 1 } else { self.nodes.ncols() };
        if place.len() != axes {
            let s = if axes == 1 { "" } else { "s" };
            return Err(format!("has {} coordinates: give {axes} coordinate{s}", place.len()));
        }
        let place = std::array::from_fn(|c| place.get(c).copied().unwrap_or(0.0));
        let all: Option<Vec<_>> =
            (0..self.elements.nrows()).map(|k| Some((self.kind(k)?, self.nodes_of(k)))).collect();
        let nodes: Vec<Point> = (0..self.nodes.nrows()).map(|n| self.place(n)).collect();
        let found = elements_at(&place, &nodes, &all.unwrap_or_default());
        let Some(first) = found.first() else {
            let [low, high] = bounds(&nodes);
            // digits of rounding are left out
            let short = |x: f64| format!("{x:.6e}").parse().unwrap_or(x);
            let range = |c: usize| format!("{} to {}", short(low[c]), short(high[c]));
            let ranges: Vec<String> = (0..axes).map(range).collect();
            return Err(format!("lies in no element; the body reaches over {}", ranges.join(", ")));
        };
        if is_between_surfaces(&found) {
            let why = "lies where two surfaces touch: give a place inside one of them, or one of their nodes with --nodes";
            return Err(why.into());
        }
        Ok(first.weights.clone())
    }

    /// Whether its body was given by matrices, whose nodes are rows and the ground.
    pub(crate) fn is_of_matrices(&self) -> bool {
        let scene = Scene::parse(&self.scene, &self.path);
        scene.is_ok_and(|scene| scene.body.kind == BodyKind::Matrices)
    }

    /// Displacement and velocity by these weights at stored state `row`.
    pub(crate) fn motion_at(&self, row: usize, weights: &Cell) -> [Point; 2] {
        [Stored::displacement, Stored::velocity].map(|of| {
            weights.iter().fold([0.0; 3], |sum: Point, &(node, w)| {
                let own = of(self, row, node);
                std::array::from_fn(|c| sum[c] + w * own[c])
            })
        })
    }

    /// Displacement of a node at stored state `row`; not numbers where it is not kept.
    pub fn displacement(&self, row: usize, node: usize) -> Point {
        self.of_node(&self.u, row, node, 0)
    }

    /// Its velocity.
    pub fn velocity(&self, row: usize, node: usize) -> Point {
        self.of_node(&self.v, row, node, 1)
    }

    /// What a table has of a node, and what it does besides: before a gap that moves, at a support that does.
    fn of_node(&self, table: &Array2<f64>, row: usize, node: usize, order: u32) -> Point {
        let (own, t) = (self.at_node(table, row, node), self.time(row));
        plus(&plus(&own, &self.swings.at(node, t, order)), &self.moving.at(node, t, order))
    }

    /// Whether the file keeps the displacements of a node, as far as it moves.
    pub fn keeps(&self, node: usize) -> bool {
        let mut moving =
            self.dof_map.row(node).into_iter().filter_map(|&i| usize::try_from(i).ok());
        moving.all(|i| self.held[i].is_some())
    }

    fn time(&self, row: usize) -> f64 {
        self.t.get(row).copied().unwrap_or_default()
    }

    fn at_node(&self, table: &Array2<f64>, row: usize, node: usize) -> Point {
        let mut all = [0.0; 3];
        for (x, &place) in all.iter_mut().zip(self.dof_map.row(node)) {
            if let Ok(i) = usize::try_from(place) {
                *x = self.entry(table, row, i);
            }
        }
        all
    }

    /// One displacement; not a number where it is not kept.
    fn entry(&self, table: &Array2<f64>, row: usize, i: usize) -> f64 {
        self.held[i].map_or(f64::NAN, |k| table[(row, k)])
    }
}

/// Shares of the largest area below which a master's node is not covered.
const COVERED: f64 = 1e-6;

/// A place or direction of a table: zero along an axis that it does not have.
fn in_space(row: ndarray::ArrayView1<f64>) -> Point {
    std::array::from_fn(|c| row.get(c).copied().unwrap_or(0.0))
}

/// What the displacement of each contact point is counted against; nothing in files without pairs of surfaces.
fn read_against(
    path: &Path,
    file: &hdf5::File,
    n_c: usize,
) -> Result<Vec<Vec<(usize, f64)>>, StoreError> {
    let Ok(group) = file.group("contact/against") else { return Ok(vec![]) };
    let first: Vec<i64> = group.dataset("indptr")?.values()?;
    let nodes: Vec<i64> = group.dataset("indices")?.values()?;
    let weights: Vec<f64> = group.dataset("data")?.values()?;
    let damaged = || StoreError::unusable(path, "damaged: /contact/against".to_owned());
    if first.len() != n_c + 1 || nodes.len() != weights.len() {
        return Err(damaged());
    }
    let of_point = |ends: &[i64]| -> Option<Vec<(usize, f64)>> {
        let range = usize::try_from(ends[0]).ok()?..usize::try_from(ends[1]).ok()?;
        let (nodes, weights) = (nodes.get(range.clone())?, weights.get(range)?);
        nodes.iter().zip(weights).map(|(n, p)| Some((usize::try_from(*n).ok()?, *p))).collect()
    };
    first.windows(2).map(of_point).collect::<Option<_>>().ok_or_else(damaged)
}

/// Number of displacements that these tables name: one more than the largest number. It is at most as many as they have entries, and what each of some contact points
/// may remember (springs of sliders), for each displacement of the body stands in one of them; a larger one is that of a damaged file, and nothing of that size is
/// asked for.
fn check_displacements(
    path: &Path,
    dof_map: &Array2<i64>,
    (contact_dofs, points): (&[usize], usize),
) -> Result<usize, StoreError> {
    let of_nodes = dof_map.iter().filter_map(|&i| usize::try_from(i).ok());
    let n = of_nodes.chain(contact_dofs.iter().copied()).max().map_or(0, |i| i.saturating_add(1));
    match n <= dof_map.len() + contact_dofs.len() + points {
        true => Ok(n),
        false => Err(StoreError::unusable(path, "damaged: /mesh/dof_map")),
    }
}

/// A file keeps so many of so many displacements.
pub(super) fn partial(path: &Path, (kept, all): (usize, usize)) -> StoreError {
    let why = format!(
        "keeps {kept} of {all} displacements ([run] store), and all are wanted; run its scene with store = \"all\""
    );
    StoreError::unusable(path, why)
}
