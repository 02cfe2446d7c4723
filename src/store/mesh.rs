//! `/mesh`: nodes, elements, and where the displacements of a node stand.

use super::{StoreError, write_text};
use crate::contact::{Constraint, System};
use crate::mesh::Point;

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
    let regions: Vec<i64> = mesh.elements().map(|e| e.region as i64).collect();
    g.new_dataset_builder().with_data(&regions).create("regions")?;
    let index = |n: usize, c: usize| {
        (c < mesh.dim()).then(|| dofs.column(n, c)).flatten().map_or(-1, |i| i as i64)
    };
    let map = (0..mesh.n_nodes()).flat_map(|n| [index(n, 0), index(n, 1)]).collect();
    g.new_dataset_builder().with_data(&array(mesh.n_nodes(), 2, map)?).create("dof_map")?;
    let table = |of: &dyn Fn(&Constraint) -> Point| {
        let values = system.constraints.iter().flat_map(|c| [of(c)[0], of(c)[1]]).collect();
        ndarray::Array2::from_shape_vec((system.n_contact(), 2), values)
            .map_err(|e| hdf5::Error::from(e.to_string()))
    };
    // springs push at points of quadrature, every other method at nodes
    if !system.promise().yields {
        let nodes: Vec<i64> = system.constraints.iter().map(|c| c.node as i64).collect();
        g.new_dataset_builder().with_data(&nodes).create("contact_nodes")?;
    } else {
        let places = table(&|c| c.position)?;
        g.new_dataset_builder().with_data(&places).create("contact_points")?;
        let dataset = g.dataset("contact_points")?;
        write_text(&dataset, "units", "length")?;
    }
    let normals = table(&|c| c.normal)?;
    g.new_dataset_builder().with_data(&normals).create("contact_normals")?;
    let groups: Vec<i64> = system.constraints.iter().map(|c| c.group as i64).collect();
    g.new_dataset_builder().with_data(&groups).create("contact_groups")?;
    let names: Vec<&str> = dofs.facing.iter().map(|f| f.group.as_str()).collect();
    let of_groups = g.dataset("contact_groups")?;
    write_text(&of_groups, "names", &names.join("\n"))?;
    // columns of u that are contact displacements up to their sign
    let along_axis = |c: &Constraint| c.normal.iter().filter(|x| **x != 0.0).count() == 1;
    let of_point = |(i, c): (usize, &Constraint)| match system.promise().yields || along_axis(c) {
        true => (dofs.n_o + system.conditions().points[i].0) as i64,
        false => -1,
    };
    let contact_dofs: Vec<i64> = system.constraints.iter().enumerate().map(of_point).collect();
    g.new_dataset_builder().with_data(&contact_dofs).create("contact_dofs")?;
    g.new_dataset_builder().with_data(&system.gaps()).create("gap")?;
    let area: Vec<f64> = system.constraints.iter().map(|c| c.area).collect();
    g.new_dataset_builder().with_data(&area).create("contact_area")?;
    for (name, key, text) in [
        ("nodes", "units", "length"),
        ("gap", "units", "length along the contact normal"),
        ("regions", "meaning", "material of each element, counted from 0"),
        (
            "contact_dofs",
            "meaning",
            "index into u of the displacement along the normal, up to its sign; -1 along no axis",
        ),
        ("dof_map", "meaning", "index into u of the x and y displacement, -1 prescribed"),
    ] {
        let dataset = g.dataset(name)?;
        write_text(&dataset, key, text)?;
    }
    let axes = [("+x", [1.0, 0.0]), ("-x", [-1.0, 0.0]), ("+y", [0.0, 1.0]), ("-y", [0.0, -1.0])];
    let is_normal = |n: &[f64; 2]| system.constraints.iter().all(|c| c.normal[..2] == n[..]);
    let common = axes.iter().find(|(_, n)| is_normal(n));
    write_text(&g, "contact_normal", common.map_or("several", |(name, _)| name))
}
