//! `/bodies`: which nodes are whose; `/contact`: what each contact point's displacement is counted against, and the pairs of surfaces.

use hdf5::types::VarLenUnicode;

use super::StoreError;
use super::careful::Careful;
use crate::contact::System;
use crate::fem::pair::{Meeting, Projection, Sides};
use crate::problem::parts;
use crate::scenario::Scene;

/// Words as a dataset.
pub(super) fn words(group: &hdf5::Group, name: &str, all: &[&str]) -> Result<(), StoreError> {
    let all: Vec<VarLenUnicode> = all.iter().map(|w| w.parse().unwrap_or_default()).collect();
    group.new_dataset_builder().with_data(&all).create(name)?;
    Ok(())
}

/// The words of a dataset.
pub(super) fn read_words(data: &hdf5::Dataset) -> Result<Vec<String>, StoreError> {
    Ok(data.values::<VarLenUnicode>()?.iter().map(|w| w.as_str().to_owned()).collect())
}

/// Write `/bodies`, of a scene that has several names for its parts.
pub(super) fn write_bodies(
    file: &hdf5::File,
    scene: &Scene,
    system: &System,
) -> Result<(), StoreError> {
    let parts = parts(scene, &system.body.mesh);
    if parts.names.len() < 2 {
        return Ok(());
    }
    let group = file.create_group("bodies")?;
    words(&group, "name", &parts.names.iter().map(String::as_str).collect::<Vec<_>>())?;
    let of_node: Vec<i64> = parts.of_node.iter().map(|p| *p as i64).collect();
    group.new_dataset_builder().with_data(&of_node).create("of_node")?;
    Ok(())
}

/// Write `/contact`, of a body some of whose surfaces meet.
pub(super) fn write_contact(file: &hdf5::File, system: &System) -> Result<(), StoreError> {
    let dofs = system.body.nodal_dofs();
    if (0..dofs.n_facing).all(|i| dofs.against(i).is_empty()) {
        return Ok(());
    }
    let group = file.create_group("contact")?;
    let against = group.create_group("against")?;
    let (mut first, mut nodes, mut weights) = (vec![0i64], vec![], vec![]);
    for i in 0..system.n_contact() {
        let masters = if i < dofs.n_facing { dofs.against(i) } else { &[] };
        nodes.extend(masters.iter().map(|m| m.0 as i64));
        weights.extend(masters.iter().map(|m| m.1));
        first.push(nodes.len() as i64);
    }
    against.new_dataset_builder().with_data(&first).create("indptr")?;
    against.new_dataset_builder().with_data(&nodes).create("indices")?;
    against.new_dataset_builder().with_data(&weights).create("data")?;
    let meetings: Vec<&Meeting> = dofs.facing.iter().filter_map(|f| f.meeting.as_deref()).collect();
    if meetings.is_empty() {
        return Ok(());
    }
    let pairs = group.create_group("pairs")?;
    let column = |name: &str, of: fn(&Meeting) -> &str| {
        words(&pairs, name, &meetings.iter().map(|m| of(m)).collect::<Vec<_>>())
    };
    column("slave", |m| &m.pair.slave)?;
    column("master", |m| &m.pair.master)?;
    column("projection", |m| match m.projection {
        Projection::Match => "match",
        Projection::Dual => "dual",
    })?;
    column("sides", |m| match m.pair.sides {
        Sides::Both => "both",
        Sides::Slave => "slave",
    })?;
    let levers: Vec<f64> = meetings.iter().map(|m| m.lever(&system.body.mesh)).collect();
    pairs.new_dataset_builder().with_data(&levers).create("lever")?;
    Ok(())
}
