//! `/mesh`: nodes, elements, and where the displacements of a node stand.

use super::{StoreError, write_text};
use crate::contact::{Constraint, System};
use crate::mesh::Point;

/// Bytes that the mesh and the attributes of a file take at the most.
pub(super) fn size_of_mesh(system: &System) -> u64 {
    let mesh = &system.body.mesh;
    let numbers: usize = mesh.blocks().iter().map(|b| b.connectivity.len()).sum();
    (48 * mesh.n_nodes() + 8 * numbers + (64 << 10)) as u64
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
    // a bar lies in the plane
    let width = mesh.dim().max(2);
    let places = |rows: usize, places: &mut dyn Iterator<Item = Point>| {
        let values = places.flat_map(|p| p.into_iter().take(width)).collect();
        ndarray::Array2::from_shape_vec((rows, width), values)
            .map_err(|e| hdf5::Error::from(e.to_string()))
    };
    let nodes = places(mesh.n_nodes(), &mut mesh.nodes().iter().copied())?;
    g.new_dataset_builder().with_data(&nodes).create("nodes")?;
    // elements with fewer nodes than others are filled up with −1
    let most = mesh.blocks().iter().map(|b| b.kind.nodes()).max().unwrap_or(0);
    let elements = mesh
        .elements()
        .flat_map(|e| (0..most).map(move |k| e.nodes.get(k).map_or(-1, |&n| n as i64)));
    let elements = array(mesh.n_elements(), most, elements.collect())?;
    g.new_dataset_builder().with_data(&elements).create("elements")?;
    let regions: Vec<i64> = mesh.elements().map(|e| e.region as i64).collect();
    g.new_dataset_builder().with_data(&regions).create("regions")?;
    let index = |n: usize, c: usize| {
        (c < mesh.dim()).then(|| dofs.column(n, c)).flatten().map_or(-1, |i| i as i64)
    };
    let map =
        (0..mesh.n_nodes()).flat_map(|n| (0..width).map(move |c| (n, c))).map(|(n, c)| index(n, c));
    let map = array(mesh.n_nodes(), width, map.collect())?;
    let map = g.new_dataset_builder().with_data(&map).create("dof_map")?;
    map.new_attr::<i64>().create("n_o")?.write_scalar(&(dofs.n_o as i64))?;
    let table = |of: fn(&Constraint) -> Point| {
        places(system.n_contact(), &mut system.constraints.iter().map(of))
    };
    // springs push at points of quadrature, every other method at nodes, and all at displacements of given matrices
    let at_points = system.promise().yields;
    if !at_points || system.body.materials().is_empty() {
        let nodes: Vec<i64> = system.constraints.iter().map(|c| c.node as i64).collect();
        g.new_dataset_builder().with_data(&nodes).create("contact_nodes")?;
    }
    if at_points {
        let places = table(|c| c.position)?;
        g.new_dataset_builder().with_data(&places).create("contact_points")?;
    }
    let normals = table(|c| c.normal)?;
    g.new_dataset_builder().with_data(&normals).create("contact_normals")?;
    let groups: Vec<i64> =
        system.constraints.iter().map(|c| i64::try_from(c.group).unwrap_or(-1)).collect();
    g.new_dataset_builder().with_data(&groups).create("contact_groups")?;
    let names: Vec<&str> = dofs.facing.iter().map(|f| f.group.as_str()).collect();
    let of_groups = g.dataset("contact_groups")?;
    write_text(&of_groups, "names", &names.join("\n"))?;
    // columns of u that are contact displacements up to their sign
    let along_axis = |(i, c): (usize, &Constraint)| {
        let alone = i >= dofs.n_facing || dofs.against(i).is_empty();
        alone && c.normal.iter().filter(|x| **x != 0.0).count() == 1
    };
    let of_point = |(i, c): (usize, &Constraint)| match system.promise().yields
        || along_axis((i, c))
    {
        true if i < system.facing().len() => (dofs.n_o + system.conditions().points[i].0) as i64,
        _ => -1,
    };
    let contact_dofs: Vec<i64> = system.constraints.iter().enumerate().map(of_point).collect();
    g.new_dataset_builder().with_data(&contact_dofs).create("contact_dofs")?;
    g.new_dataset_builder().with_data(&system.gaps()).create("gap")?;
    let area: Vec<f64> = system.constraints.iter().map(|c| c.area).collect();
    g.new_dataset_builder().with_data(&area).create("contact_area")?;
    let is_common = |&(axis, sign): &(usize, f64)| {
        let along: Point = std::array::from_fn(|c| if c == axis { sign } else { 0.0 });
        system.facing().iter().all(|c| c.normal == along)
    };
    let mut axes = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]);
    let common = axes.find(is_common).map_or("several".to_owned(), |(axis, sign)| {
        format!("{}{}", if sign > 0.0 { '+' } else { '-' }, ["x", "y", "z"][axis])
    });
    write_text(&g, "contact_normal", &common)
}
