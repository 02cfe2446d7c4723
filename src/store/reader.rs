//! Reading what this program wrote.

use std::path::{Path, PathBuf};

use hdf5::types::FixedAscii;
use ndarray::Array2;

use super::{StoreError, read_text};
use crate::fem::check_size;
use crate::records::Status;

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
    /// Mesh nodes on the contact edge.
    pub contact_nodes: Vec<usize>,
    /// Gaps.
    pub gap: Vec<f64>,
    /// `+x`, `-x`, `+y`, `-y`.
    pub contact_normal: String,
    /// Times.
    pub t: Vec<f64>,
    /// Displacements along the axes, one row a time.
    pub u: Array2<f64>,
    /// Velocities.
    pub v: Array2<f64>,
    /// 1 = contact.
    pub active: Array2<u8>,
    /// Pressures.
    pub pressure: Array2<f64>,
    /// Energies: `kinetic, elastic, external, dissipated, jumps`, one column each.
    pub energy: Vec<Vec<f64>>,
    /// Switching times.
    pub switch_t: Vec<f64>,
    /// Switching nodes.
    pub switch_node: Vec<usize>,
    /// `close` or `open`.
    pub switch_kind: Vec<String>,
    /// Energy jumps.
    pub switch_jump: Vec<f64>,
    /// Number of grazings.
    pub grazings: usize,
}

impl Stored {
    /// Read a whole run.
    pub fn read(path: &Path) -> Result<Stored, StoreError> {
        reading(path, || Self::read_all(path))
    }

    fn read_all(path: &Path) -> Result<Stored, StoreError> {
        let file = open(path)?;
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let mesh = file.group("mesh").map_err(|_| missing("/mesh"))?;
        let trajectory = file.group("trajectory").map_err(|_| missing("/trajectory"))?;
        let switches = file.group("switches").map_err(|_| missing("/switches"))?;
        let energy = file.group("energy").map_err(|_| missing("/energy"))?;
        let text = |name: &str| read_text(&file, name).unwrap_or_default();
        let indices = |v: Vec<i64>| v.into_iter().map(|i| i as usize).collect();
        let column = |name: &str| energy.dataset(name)?.values::<f64>();
        let energy: Result<Vec<_>, hdf5::Error> =
            ["kinetic", "elastic", "external", "dissipated", "jumps"]
                .map(column)
                .into_iter()
                .collect();
        let stored = Stored {
            path: path.to_owned(),
            title: text("title"),
            scene: text("scene"),
            version: text("signorini_version"),
            created: text("created"),
            command: text("command"),
            status: Status::of_name(&text("status")),
            nodes: mesh.dataset("nodes")?.table()?,
            elements: mesh.dataset("elements")?.table()?,
            dof_map: mesh.dataset("dof_map")?.table()?,
            contact_nodes: indices(mesh.dataset("contact_nodes")?.values()?),
            gap: mesh.dataset("gap")?.values()?,
            contact_normal: read_text(&mesh, "contact_normal").unwrap_or_default(),
            t: trajectory.dataset("t")?.values()?,
            u: trajectory.dataset("u")?.table()?,
            v: trajectory.dataset("v")?.table()?,
            active: trajectory.dataset("active")?.table()?,
            pressure: trajectory.dataset("pressure")?.table()?,
            energy: energy?,
            switch_t: switches.dataset("t")?.values()?,
            switch_node: indices(switches.dataset("node")?.values()?),
            switch_kind: switches
                .dataset("kind")?
                .values::<FixedAscii<32>>()?
                .iter()
                .map(|w| w.as_str().to_owned())
                .collect(),
            switch_jump: switches.dataset("energy_jump")?.values()?,
            grazings: file.dataset("grazings/t").map_or(0, |d| d.size()),
        };
        match stored.inconsistency() {
            None => Ok(stored),
            Some(what) => Err(StoreError::unusable(path, format!("damaged: {what}"))),
        }
    }

    /// What does not fit together, if anything: everything that reads this may index without fear.
    fn inconsistency(&self) -> Option<&'static str> {
        let (nodes, rows, n) = (self.nodes.nrows(), self.t.len(), self.u.ncols());
        let n_c = self.gap.len();
        let below = |i: i64, limit: usize| usize::try_from(i).is_ok_and(|i| i < limit);
        let tables = [self.u.nrows(), self.v.nrows(), self.active.nrows(), self.pressure.nrows()];
        let checks = [
            (self.nodes.ncols() == 2 && nodes > 0, "/mesh/nodes"),
            (self.nodes.iter().all(|x| x.is_finite()), "/mesh/nodes"),
            (self.gap.iter().all(|g| g.is_finite()), "/mesh/gap"),
            ([2, 4].contains(&self.elements.ncols()), "/mesh/elements"),
            (self.elements.iter().all(|&e| below(e, nodes)), "/mesh/elements"),
            (self.dof_map.dim() == (nodes, 2), "/mesh/dof_map"),
            (self.dof_map.iter().all(|&i| i == -1 || below(i, n)), "/mesh/dof_map"),
            (self.contact_nodes.len() == n_c && n_c <= n, "/mesh/contact_nodes"),
            (self.contact_nodes.iter().all(|&i| i < nodes), "/mesh/contact_nodes"),
            (self.v.ncols() == n, "/trajectory/v"),
            (self.active.ncols() == n_c && self.pressure.ncols() == n_c, "/trajectory/active"),
            (tables.iter().all(|&r| r == rows), "/trajectory: rows"),
            (self.t.iter().all(|t| t.is_finite()), "/trajectory/t"),
            (self.t.windows(2).all(|w| w[0] < w[1]), "/trajectory/t"),
            (self.energy.iter().all(|c| c.len() == rows), "/energy"),
            (self.switch_node.len() == self.switch_t.len(), "/switches/node"),
            (self.switch_kind.len() == self.switch_t.len(), "/switches/kind"),
            (self.switch_jump.len() == self.switch_t.len(), "/switches/energy_jump"),
        ];
        checks.iter().find(|(fits, _)| !fits).map(|(_, what)| *what)
    }

    /// Displacement of contact node `i` along the outward normal, at stored state `row`.
    pub fn contact_displacement(&self, row: usize, i: usize) -> f64 {
        let sign = if self.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
        sign * self.u[(row, self.u.ncols() - self.gap.len() + i)]
    }

    /// Displacement `(u_x, u_y)` of a node at stored state `row`.
    pub fn displacement(&self, row: usize, node: usize) -> [f64; 2] {
        [0, 1].map(|c| match self.dof_map[(node, c)] {
            -1 => 0.0,
            i => self.u[(row, i as usize)],
        })
    }
}

/// What the library says of a file that is read means that the file is damaged, or of another kind.
pub(super) fn reading<T>(
    path: &Path,
    read: impl FnOnce() -> Result<T, StoreError>,
) -> Result<T, StoreError> {
    read().map_err(|e| match e {
        StoreError::Hdf5(e) => {
            let text = e.to_string();
            // the innermost cause stands behind the last colon of the first line
            let line = text.lines().next().unwrap_or_default().to_owned();
            StoreError::unusable(path, format!("damaged, or not what it should be ({line})"))
        }
        e => e,
    })
}

/// Reading of datasets whose sizes are not believed.
pub(super) trait Careful {
    /// All values, in one row.
    fn values<T: hdf5::H5Type>(&self) -> Result<Vec<T>, hdf5::Error>;
    /// A table.
    fn table<T: hdf5::H5Type>(&self) -> Result<Array2<T>, hdf5::Error>;
    /// An array of any dimension.
    fn array<T: hdf5::H5Type>(&self) -> Result<ndarray::ArrayD<T>, hdf5::Error>;
}

impl Careful for hdf5::Dataset {
    fn values<T: hdf5::H5Type>(&self) -> Result<Vec<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_raw()
    }
    fn table<T: hdf5::H5Type>(&self) -> Result<Array2<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_2d()
    }
    fn array<T: hdf5::H5Type>(&self) -> Result<ndarray::ArrayD<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_dyn()
    }
}

pub(super) fn open(path: &Path) -> Result<hdf5::File, StoreError> {
    if path.is_dir() {
        return Err(StoreError::unusable(path, "is a folder; give a file"));
    }
    if !path.is_file() {
        return Err(StoreError::unusable(path, "no such file"));
    }
    hdf5::File::open(path).map_err(|_| StoreError::unusable(path, "not an HDF5 file, or damaged"))
}

/// The state that a file offers as an initial one: of `/orbit` if there is one, else the last of `/trajectory`; as nodal
/// fields (displacement, velocity) of `dim` components for a mesh with the same nodes.
pub fn read_state(
    path: &Path,
    nodes: &[[f64; 3]],
    dim: usize,
    interpolate: bool,
) -> Result<(Vec<f64>, Vec<f64>), StoreError> {
    reading(path, || read_state_of(path, nodes, dim, interpolate))
}

fn read_state_of(
    path: &Path,
    nodes: &[[f64; 3]],
    dim: usize,
    interpolate: bool,
) -> Result<(Vec<f64>, Vec<f64>), StoreError> {
    let file = open(path)?;
    let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
    let stored: Array2<f64> =
        file.dataset("mesh/nodes").map_err(|_| missing("/mesh/nodes"))?.table()?;
    if stored.ncols() != 2 {
        return Err(StoreError::unusable(path, "damaged: /mesh/nodes"));
    }
    let size = nodes.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    let same = stored.dim() == (nodes.len(), 2)
        && nodes
            .iter()
            .enumerate()
            .all(|(i, p)| (0..2).all(|c| (p[c] - stored[(i, c)]).abs() <= 1e-9 * size));
    if !same && !interpolate {
        return Err(StoreError::unusable(path, "its body has other displacements than this scene"));
    }
    let cells = if same { None } else { Some(cells_of(&file, &stored, nodes, dim, path)?) };
    let map: Array2<i64> = file.dataset("mesh/dof_map")?.table()?;
    let damaged = |what: &str| StoreError::unusable(path, format!("damaged: {what}"));
    if map.dim() != (stored.nrows(), 2) {
        return Err(damaged("/mesh/dof_map"));
    }
    let (u, v) = if let (Ok(u), Ok(v)) = (file.dataset("orbit/u0"), file.dataset("orbit/v0")) {
        (u.values::<f64>()?, v.values::<f64>()?)
    } else {
        let last = |name: &str| -> Result<Vec<f64>, StoreError> {
            let table = file.dataset(name).map_err(|_| missing("state"))?;
            match table.shape()[..] {
                [rows, columns] if rows > 0 && columns <= map.len() => {
                    let row = table.read_slice::<f64, _, ndarray::Ix1>((rows - 1, ..))?;
                    Ok(row.to_vec())
                }
                _ => Err(missing("state")),
            }
        };
        (last("trajectory/u")?, last("trajectory/v")?)
    };
    if !u.iter().chain(&v).all(|x| x.is_finite()) {
        return Err(damaged("a state that is not finite"));
    }
    let fits = |i: &i64| *i == -1 || usize::try_from(*i).is_ok_and(|i| i < u.len().min(v.len()));
    if !map.iter().all(fits) {
        return Err(damaged("/mesh/dof_map"));
    }
    let nodal = |x: &[f64]| {
        let mut field = vec![0.0; dim * stored.nrows()];
        for n in 0..stored.nrows() {
            for c in 0..dim {
                if let Some(&value) = usize::try_from(map[(n, c)]).ok().and_then(|i| x.get(i)) {
                    field[dim * n + c] = value;
                }
            }
        }
        let Some(cells) = &cells else { return field };
        let at =
            |cell: &Cell, c: usize| cell.iter().map(|(n, w)| w * field[dim * n + c]).sum::<f64>();
        cells.iter().flat_map(|cell| (0..dim).map(move |c| at(cell, c))).collect()
    };
    Ok((nodal(&u), nodal(&v)))
}

/// Corners of the element that a point lies in, with their weights.
type Cell = Vec<(usize, f64)>;

/// Where the nodes of a scene lie in a stored mesh of the same rectangle: a state on another mesh is interpolated.
fn cells_of(
    file: &hdf5::File,
    stored: &Array2<f64>,
    nodes: &[[f64; 3]],
    dim: usize,
    path: &Path,
) -> Result<Vec<Cell>, StoreError> {
    let other = || {
        StoreError::unusable(
            path,
            "its body is not the body of this scene: the meshes cover different regions",
        )
    };
    let bounds = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        points.fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |b, p| {
            [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
        })
    };
    let a = bounds(&mut nodes.iter().map(|p| [p[0], p[1]]));
    let b = bounds(&mut stored.rows().into_iter().map(|r| [r[0], r[1]]));
    let size = (a[2] - a[0]).max(a[3] - a[1]);
    let elements: Array2<i64> = file.dataset("mesh/elements")?.table()?;
    let corners = if dim == 1 { 2 } else { 4 };
    let fits = |i: &i64| usize::try_from(*i).is_ok_and(|i| i < stored.nrows());
    let near = a.iter().zip(&b).all(|(x, y)| (x - y).abs() <= 1e-9 * size);
    if stored.ncols() != 2 || elements.ncols() != corners || !near || !elements.iter().all(fits) {
        return Err(other());
    }
    let slack = 1e-9 * size;
    let cell = |p: &[f64; 3]| -> Option<Cell> {
        elements.rows().into_iter().find_map(|e| {
            let nodes: Vec<usize> = e.iter().map(|&i| i as usize).collect();
            let b = bounds(&mut nodes.iter().map(|&n| [stored[(n, 0)], stored[(n, 1)]]));
            let inside = (0..dim).all(|c| p[c] >= b[c] - slack && p[c] <= b[c + 2] + slack);
            let weight = |n: usize| -> f64 {
                let share = |c: usize| 1.0 - (p[c] - stored[(n, c)]).abs() / (b[c + 2] - b[c]);
                (0..dim).map(share).product()
            };
            inside.then(|| nodes.iter().map(|&n| (n, weight(n))).collect())
        })
    };
    nodes.iter().map(|p| cell(p).ok_or_else(other)).collect()
}
