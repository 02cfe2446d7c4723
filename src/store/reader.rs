//! Reading what this program wrote.

use std::path::{Path, PathBuf};

use hdf5::types::FixedAscii;
use ndarray::Array2;

use super::{StoreError, read_text};

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
    pub status: String,
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
        let file = open(path)?;
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let mesh = file.group("mesh").map_err(|_| missing("/mesh"))?;
        let trajectory = file.group("trajectory").map_err(|_| missing("/trajectory"))?;
        let switches = file.group("switches").map_err(|_| missing("/switches"))?;
        let energy = file.group("energy").map_err(|_| missing("/energy"))?;
        let text = |name: &str| read_text(&file, name).unwrap_or_default();
        let indices = |v: Vec<i64>| v.into_iter().map(|i| i as usize).collect();
        let column = |name: &str| energy.dataset(name)?.read_raw::<f64>();
        let energy: Result<Vec<_>, hdf5::Error> =
            ["kinetic", "elastic", "external", "dissipated", "jumps"]
                .map(column)
                .into_iter()
                .collect();
        Ok(Stored {
            path: path.to_owned(),
            title: text("title"),
            scene: text("scene"),
            version: text("signorini_version"),
            created: text("created"),
            command: text("command"),
            status: text("status"),
            nodes: mesh.dataset("nodes")?.read_2d()?,
            elements: mesh.dataset("elements")?.read_2d()?,
            dof_map: mesh.dataset("dof_map")?.read_2d()?,
            contact_nodes: indices(mesh.dataset("contact_nodes")?.read_raw()?),
            gap: mesh.dataset("gap")?.read_raw()?,
            contact_normal: read_text(&mesh, "contact_normal").unwrap_or_default(),
            t: trajectory.dataset("t")?.read_raw()?,
            u: trajectory.dataset("u")?.read_2d()?,
            v: trajectory.dataset("v")?.read_2d()?,
            active: trajectory.dataset("active")?.read_2d()?,
            pressure: trajectory.dataset("pressure")?.read_2d()?,
            energy: energy?,
            switch_t: switches.dataset("t")?.read_raw()?,
            switch_node: indices(switches.dataset("node")?.read_raw()?),
            switch_kind: switches
                .dataset("kind")?
                .read_raw::<FixedAscii<32>>()?
                .iter()
                .map(|w| w.as_str().to_owned())
                .collect(),
            switch_jump: switches.dataset("energy_jump")?.read_raw()?,
            grazings: file.dataset("grazings/t").map_or(0, |d| d.size()),
        })
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

fn open(path: &Path) -> Result<hdf5::File, StoreError> {
    if !path.is_file() {
        return Err(StoreError::unusable(path, "no such file"));
    }
    hdf5::File::open(path).map_err(|_| StoreError::unusable(path, "not an HDF5 file, or damaged"))
}

/// The state that a file offers as an initial one: of `/orbit` if there is one, else the last of `/trajectory`; as nodal
/// fields (displacement, velocity) of `dim` components for a mesh with the same nodes.
pub fn read_state(
    path: &Path,
    nodes: &[[f64; 2]],
    dim: usize,
) -> Result<(Vec<f64>, Vec<f64>), StoreError> {
    let file = open(path)?;
    let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
    let stored: Array2<f64> =
        file.dataset("mesh/nodes").map_err(|_| missing("/mesh/nodes"))?.read_2d()?;
    let size = nodes.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    let same = stored.nrows() == nodes.len()
        && nodes
            .iter()
            .enumerate()
            .all(|(i, p)| (0..2).all(|c| (p[c] - stored[(i, c)]).abs() <= 1e-9 * size));
    if !same {
        return Err(StoreError::unusable(path, "its mesh is not the mesh of this scene"));
    }
    let map: Array2<i64> = file.dataset("mesh/dof_map")?.read_2d()?;
    let (u, v) = if let (Ok(u), Ok(v)) = (file.dataset("orbit/u0"), file.dataset("orbit/v0")) {
        (u.read_raw::<f64>()?, v.read_raw::<f64>()?)
    } else {
        let last = |name: &str| -> Result<Vec<f64>, StoreError> {
            let table = file.dataset(name).map_err(|_| missing("state"))?;
            match table.shape()[..] {
                [rows, _] if rows > 0 => {
                    let row = table.read_slice::<f64, _, ndarray::Ix1>((rows - 1, ..))?;
                    Ok(row.to_vec())
                }
                _ => Err(missing("state")),
            }
        };
        (last("trajectory/u")?, last("trajectory/v")?)
    };
    let nodal = |x: &[f64]| {
        let mut field = vec![0.0; dim * nodes.len()];
        for n in 0..nodes.len() {
            for c in 0..dim {
                if let Some(&value) = usize::try_from(map[(n, c)]).ok().and_then(|i| x.get(i)) {
                    field[dim * n + c] = value;
                }
            }
        }
        field
    };
    Ok((nodal(&u), nodal(&v)))
}
