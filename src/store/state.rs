//! The state that a file offers as an initial one, on a mesh with the same nodes or interpolated from another; in the frame at rest, whatever moved.

use std::path::Path;

use ndarray::Array2;

use super::careful::{Careful, open, reading};
use super::reader::partial;
use super::swings::read_swings;
use super::{StoreError, read_text};
use crate::fem::interpolate::{Cell, at_cells, cells};
use crate::mesh::{ElementKind, Mesh, Point};
use crate::scenario::Scene;

/// Displacement and velocity.
type State = (Vec<f64>, Vec<f64>);

/// The attribute of `mesh/row_names` that says which rows count along other directions than in the files.
pub(super) const TURNS: &str = "turned";

/// A state of a body of matrices whose rows have names is one of the same rows, along the same directions.
pub fn check_rows(path: &Path, scene: &Scene) -> Result<(), StoreError> {
    let own = scene.rows.labels();
    if own.is_empty() {
        return Ok(());
    }
    reading(path, || {
        let Ok(data) = open(path)?.dataset("mesh/row_names") else { return Ok(()) };
        let names: Vec<hdf5::types::VarLenUnicode> = data.values()?;
        let differs = own.iter().zip(&names).find(|(own, name)| own.as_str() != name.as_str());
        if let Some((own, name)) = differs {
            let what = format!(
                "its displacement {} stands where {own} of this scene does: rows are others, or turned to another obstacle",
                name.as_str()
            );
            return Err(StoreError::unusable(path, what));
        }
        // files of before do not say
        match read_text(&data, TURNS) {
            Some(turns) if turns != scene.rows.turns() => {
                let what = "contact displacements of its scene count along other directions than those of this one";
                Err(StoreError::unusable(path, what))
            }
            _ => Ok(()),
        }
    })
}

/// The state that a file offers as an initial one: of `/orbit` if there is one, else the last of `/trajectory`; as nodal
/// fields (displacement, velocity) for a mesh, with the same nodes unless they may be interpolated.
pub fn read_state(path: &Path, mesh: &Mesh, interpolate: bool) -> Result<State, StoreError> {
    reading(path, || read_state_of(path, mesh, interpolate))
}

fn damaged(path: &Path, what: &str) -> StoreError {
    StoreError::unusable(path, format!("damaged: {what}"))
}

fn read_state_of(path: &Path, mesh: &Mesh, interpolate: bool) -> Result<State, StoreError> {
    let dim = mesh.dim();
    let file = open(path)?;
    let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
    let stored: Array2<f64> =
        file.dataset("mesh/nodes").map_err(|_| missing("/mesh/nodes"))?.table()?;
    let width = dim.max(2);
    if stored.ncols() != width {
        let what =
            format!("its body has {} dimensions, that of this scene has {dim}", stored.ncols());
        return match stored.ncols() {
            2 | 3 => Err(StoreError::unusable(path, what)),
            _ => Err(damaged(path, "/mesh/nodes")),
        };
    }
    let same = is_same(mesh.nodes(), &stored);
    if !same && !interpolate {
        return Err(StoreError::unusable(path, "its body has other displacements than this scene"));
    }
    let cells = if same { None } else { Some(cells_of(&file, &stored, mesh, path)?) };
    let map: Array2<i64> = file.dataset("mesh/dof_map")?.table()?;
    if map.dim() != (stored.nrows(), width) {
        return Err(damaged(path, "/mesh/dof_map"));
    }
    // what is but seen of a contact, and what springs of sliders remember, stands behind the displacements
    let of_points = |name: &str| file.dataset(name).map_or(0, |d| d.size());
    let most = map.len() + of_points("mesh/contact_dofs") + of_points("mesh/contact_area");
    let (u, v) = stored_state(&file, path, most)?;
    if !u.iter().chain(&v).all(|x| x.is_finite()) {
        return Err(damaged(path, "a state that is not finite"));
    }
    let fits = |i: &i64| *i == -1 || usize::try_from(*i).is_ok_and(|i| i < u.len().min(v.len()));
    if !map.iter().all(fits) {
        return Err(damaged(path, "/mesh/dof_map"));
    }
    let (frame, t) = (frame(&file, path)?, time_of(&file)?);
    let contact_nodes: Vec<usize> = match file.dataset("mesh/contact_nodes") {
        Ok(nodes) => nodes.values::<i64>()?.into_iter().map(|i| i as usize).collect(),
        Err(_) => vec![],
    };
    let swings = read_swings(&file, &contact_nodes)?;
    if !swings.fits(contact_nodes.len()) {
        return Err(damaged(path, "/obstacle"));
    }
    let on_nodes = |x: &[f64], k: usize| {
        let mut field = nodal(x, &map, dim);
        if let Some((direction, motion)) = &frame {
            let rows = (0..map.nrows()).flat_map(|n| (0..dim).map(move |c| (n, c)));
            for (n, c) in rows.filter(|&(n, c)| map[(n, c)] >= 0) {
                field[dim * n + c] += direction[c] * motion[k];
            }
        }
        swings.add(&mut field, dim, (t, k as u32));
        match &cells {
            None => field,
            Some(cells) => at_cells(&field, cells, dim),
        }
    };
    Ok((on_nodes(&u, 0), on_nodes(&v, 1)))
}

/// Where the displacements of a file are seen from, of a scene whose obstacle moves: the direction of its motion, and the obstacle's displacement and velocity at the time of
/// the state.
fn frame(file: &hdf5::File, path: &Path) -> Result<Option<(Point, [f64; 2])>, StoreError> {
    let text = read_text(file, "scene").unwrap_or_default();
    // scenes of files of other programs say nothing of motions
    let Ok(scene) = Scene::parse(&text, path) else { return Ok(None) };
    let Some(motion) = scene.contact.and_then(|c| c.motion) else { return Ok(None) };
    let t = time_of(file)?;
    let normals: Array2<f64> = file.dataset("mesh/contact_normals")?.table()?;
    let Some(normal) = normals.rows().into_iter().next() else { return Ok(None) };
    let direction = std::array::from_fn(|c| normal.get(c).copied().unwrap_or(0.0));
    let (sin, cos) = (motion.omega * t + motion.phase).sin_cos();
    Ok(Some((direction, [motion.amplitude * cos, -motion.amplitude * motion.omega * sin])))
}

/// The time of the state that a file offers.
fn time_of(file: &hdf5::File) -> Result<f64, StoreError> {
    Ok(match file.dataset("orbit/u0") {
        Ok(_) => 0.0,
        Err(_) => file.dataset("trajectory/t")?.values::<f64>()?.last().copied().unwrap_or(0.0),
    })
}

/// Whether a scene has the nodes of a file.
fn is_same(nodes: &[[f64; 3]], stored: &Array2<f64>) -> bool {
    let size = nodes.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    let near = |(i, p): (usize, &[f64; 3])| {
        (0..stored.ncols()).all(|c| (p[c] - stored[(i, c)]).abs() <= 1e-9 * size)
    };
    stored.nrows() == nodes.len() && nodes.iter().enumerate().all(near)
}

/// The displacements as a file holds them, at most `most` of them: of the orbit, or the last of the trajectory.
fn stored_state(file: &hdf5::File, path: &Path, most: usize) -> Result<State, StoreError> {
    if let (Ok(u), Ok(v)) = (file.dataset("orbit/u0"), file.dataset("orbit/v0")) {
        return Ok((u.values::<f64>()?, v.values::<f64>()?));
    }
    let missing = || StoreError::Missing { path: path.to_owned(), what: "state".into() };
    let last = |name: &str| -> Result<Vec<f64>, StoreError> {
        let table = file.dataset(name).map_err(|_| missing())?;
        match table.shape()[..] {
            [rows, columns] if rows > 0 && columns <= most => {
                let row = table.read_slice::<f64, _, ndarray::Ix1>((rows - 1, ..))?;
                Ok(row.to_vec())
            }
            _ => Err(missing()),
        }
    };
    if let Ok(columns) = file.dataset("trajectory/columns") {
        let all = columns.attr("of")?.read_scalar::<i64>()?.clamp(0, 2 * most as i64) as usize;
        if columns.size() < all {
            return Err(partial(path, (columns.size(), all)));
        }
    }
    Ok((last("trajectory/u")?, last("trajectory/v")?))
}

/// `dim` components a node; prescribed displacements are zero.
fn nodal(x: &[f64], map: &Array2<i64>, dim: usize) -> Vec<f64> {
    let mut field = vec![0.0; dim * map.nrows()];
    for n in 0..map.nrows() {
        for c in 0..dim {
            if let Some(&value) = usize::try_from(map[(n, c)]).ok().and_then(|i| x.get(i)) {
                field[dim * n + c] = value;
            }
        }
    }
    field
}

/// Where the nodes of a scene lie in a stored mesh of the same body: a state on another mesh is interpolated.
fn cells_of(
    file: &hdf5::File,
    stored: &Array2<f64>,
    mesh: &Mesh,
    path: &Path,
) -> Result<Vec<Cell>, StoreError> {
    let other = || {
        StoreError::unusable(
            path,
            "its body is not the body of this scene: the meshes cover different regions",
        )
    };
    let elements: Array2<i64> = file.dataset("mesh/elements")?.table()?;
    let element = |e: ndarray::ArrayView1<i64>| {
        let nodes: Vec<usize> = e.iter().filter_map(|&i| usize::try_from(i).ok()).collect();
        let kind = ElementKind::of_nodes(mesh.dim(), nodes.len())?;
        nodes.iter().all(|&i| i < stored.nrows()).then_some((kind, nodes))
    };
    let elements: Option<Vec<_>> = elements.rows().into_iter().map(element).collect();
    let elements = elements.ok_or_else(other)?;
    let place =
        |r: ndarray::ArrayView1<f64>| std::array::from_fn(|c| r.get(c).copied().unwrap_or(0.0));
    let places: Vec<Point> = stored.rows().into_iter().map(place).collect();
    cells(mesh, &places, &elements).ok_or_else(other)
}
