//! `/mesh`: nodes, elements, and where the displacements of a node stand.

use super::{StoreError, write_text};
use crate::contact::{Constraint, System};
use crate::fem::DofMap;
use crate::mesh::Point;

/// `u_C` points along the outward normal; files hold displacements along the axes.
pub(super) fn along_axes(dofs: &DofMap, x: &[f64]) -> Vec<f64> {
    let mut x = x.to_vec();
    x[dofs.n_o..].iter_mut().for_each(|x| *x *= dofs.contact_sign);
    x
}

/// Bytes that the mesh and the attributes of a file take at the most.
pub(super) fn size_of_mesh(system: &System) -> u64 {
    let mesh = &system.body.mesh;
    let numbers: usize = mesh.blocks().iter().map(|b| b.connectivity.len()).sum();
    (40 * mesh.n_nodes() + 8 * numbers + (64 << 10)) as u64
}

/// A table of whole numbers.
fn array(
    rows: usize,
    columns: usize,
    values: Vec<i64>,
) -> Result<ndarray::Array2<i64>, hdf5::Error> {
    ndarray::Array2::from_shape_vec((rows, columns), values)
        .map_err(|e| hdf5::Error::from(e.to_string()))
}

/// Write `/mesh`.
pub(super) fn write_mesh(file: &hdf5::File, system: &System) -> Result<(), StoreError> {
    let (mesh, dofs) = (&system.body.mesh, system.body.nodal_dofs());
    let g = file.create_group("mesh")?;
    let nodes: Vec<f64> = mesh.nodes().iter().flat_map(|p| [p[0], p[1]]).collect();
    let nodes = ndarray::Array2::from_shape_vec((mesh.n_nodes(), 2), nodes)
        .map_err(|e| hdf5::Error::from(e.to_string()))?;
    g.new_dataset_builder().with_data(&nodes).create("nodes")?;
    // elements with fewer nodes than others are filled up with −1
    let width = mesh.blocks().iter().map(|b| b.kind.nodes()).max().unwrap_or(0);
    let elements = mesh
        .elements()
        .flat_map(|e| (0..width).map(move |k| e.nodes.get(k).map_or(-1, |&n| n as i64)));
    let elements = array(mesh.n_elements(), width, elements.collect())?;
    g.new_dataset_builder().with_data(&elements).create("elements")?;
    let index = |n: usize, c: usize| match (c < mesh.dim()).then(|| dofs.of(n, c)).flatten() {
        Some((i, _)) => i as i64,
        None => -1,
    };
    let map = (0..mesh.n_nodes()).flat_map(|n| [index(n, 0), index(n, 1)]).collect();
    g.new_dataset_builder().with_data(&array(mesh.n_nodes(), 2, map)?).create("dof_map")?;
    // springs push at points of quadrature, every other method at nodes
    if !system.promise().yields {
        let nodes: Vec<i64> = system.constraints.iter().map(|c| c.node as i64).collect();
        g.new_dataset_builder().with_data(&nodes).create("contact_nodes")?;
    } else {
        let table = |of: &dyn Fn(&Constraint) -> Point| {
            let values = system.constraints.iter().flat_map(|c| [of(c)[0], of(c)[1]]).collect();
            ndarray::Array2::from_shape_vec((system.n_contact(), 2), values)
                .map_err(|e| hdf5::Error::from(e.to_string()))
        };
        let places = table(&|c| c.position)?;
        g.new_dataset_builder().with_data(&places).create("contact_points")?;
        let normals = table(&|c| c.normal)?;
        g.new_dataset_builder().with_data(&normals).create("contact_normals")?;
        let dataset = g.dataset("contact_points")?;
        write_text(&dataset, "units", "length")?;
    }
    let contact_dofs: Vec<i64> = (dofs.n_o..dofs.n()).map(|i| i as i64).collect();
    g.new_dataset_builder().with_data(&contact_dofs).create("contact_dofs")?;
    g.new_dataset_builder().with_data(&system.gaps()).create("gap")?;
    let area: Vec<f64> = system.constraints.iter().map(|c| c.area).collect();
    g.new_dataset_builder().with_data(&area).create("contact_area")?;
    for (name, key, text) in [
        ("nodes", "units", "length"),
        ("gap", "units", "length along the outward normal"),
        ("dof_map", "meaning", "index into u of the x and y displacement, -1 prescribed"),
    ] {
        let dataset = g.dataset(name)?;
        write_text(&dataset, key, text)?;
    }
    let normal = if dofs.contact_sign > 0.0 { ["+x", "+y"] } else { ["-x", "-y"] };
    write_text(&g, "contact_normal", normal[dofs.contact_axis])
}
