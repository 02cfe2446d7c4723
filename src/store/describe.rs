//! What the datasets of a file mean, in words, and the names of their dimensions, as attributes of the datasets: `description` and HDF5's own
//! `DIMENSION_LABELS` (h5py: `dataset.dims[0].label`; MATLAB: `h5readatt`).

use hdf5::types::VarLenAscii;

use super::{StoreError, write_text};

/// Dataset, what it is, names of its dimensions.
type Entry = (&'static str, &'static str, &'static [&'static str]);

const DATASETS: [Entry; 62] = [
    ("mesh/nodes", "places of the nodes: x, y (and z in space)", &["node", "axis"]),
    (
        "mesh/elements",
        "nodes of each element, from 0; -1 behind the last of a smaller one",
        &["element", "corner"],
    ),
    ("mesh/regions", "material of each element, from 0", &["element"]),
    (
        "mesh/dof_map",
        "column of trajectory/u of each nodal displacement; -1: prescribed. Of a body of matrices: node i carries row i, the last node is the ground; u[:, dof_map[:-1, 0]] has the columns in the order of the rows",
        &["node", "axis"],
    ),
    (
        "mesh/contact_nodes",
        "mesh node of each contact point, from 0; of a body of matrices the row of its displacement",
        &["contact point"],
    ),
    (
        "mesh/contact_points",
        "place of each contact point that is no node",
        &["contact point", "axis"],
    ),
    (
        "mesh/contact_normals",
        "outward normal of the body at each contact point",
        &["contact point", "axis"],
    ),
    (
        "mesh/contact_groups",
        "which of the groups before obstacles each contact point belongs to",
        &["contact point"],
    ),
    (
        "mesh/contact_dofs",
        "column of trajectory/u along the normal, up to its sign; -1: along no axis",
        &["contact point"],
    ),
    (
        "mesh/contact_area",
        "area of each contact point: force = pressure x area",
        &["contact point"],
    ),
    ("mesh/gap", "distance to the obstacle along the normal, undeformed", &["contact point"]),
    ("trajectory/t", "time of each stored state", &["state"]),
    (
        "trajectory/u",
        "displacements; contact displacements come last: mesh/dof_map says which column is which",
        &["state", "displacement"],
    ),
    ("trajectory/v", "velocities, in the order of trajectory/u", &["state", "displacement"]),
    ("trajectory/active", "1 where a contact point touches", &["state", "contact point"]),
    (
        "trajectory/pressure",
        "contact pressure, positive in compression",
        &["state", "contact point"],
    ),
    ("trajectory/columns", "which of all displacements u and v hold", &["column"]),
    ("switches/t", "time of each switch of the active set", &["switch"]),
    ("switches/node", "mesh node that switches", &["switch"]),
    ("switches/point", "its contact point: column of the tables by contact point", &["switch"]),
    (
        "switches/monitor",
        "what vanishes: gap, pressure; of a point held on the surface: closing, opening",
        &["switch"],
    ),
    ("switches/from", "state of the point before the switch: open, closed", &["switch"]),
    ("switches/to", "state of the point behind the switch", &["switch"]),
    (
        "switches/kind",
        "close or open; of an impact law also impact (a rebound) or rest (rebounds that ended)",
        &["switch"],
    ),
    (
        "switches/monitor_rate",
        "rate of the gap (close) or the pressure (open) that vanishes",
        &["switch"],
    ),
    ("switches/energy_jump", "jump of the energy at the switch", &["switch"]),
    ("switches/active_before", "active set before the switch", &["switch", "contact point"]),
    ("switches/active_after", "active set behind the switch", &["switch", "contact point"]),
    ("grazings/t", "time of each grazing", &["grazing"]),
    ("grazings/node", "mesh node that grazes", &["grazing"]),
    ("grazings/kind", "gap or pressure that comes near zero", &["grazing"]),
    ("grazings/distance", "how near", &["grazing"]),
    ("energy/t", "time", &["state"]),
    (
        "energy/kinetic",
        "kinetic energy of the whole body, what moving supports carry included (seen from an obstacle that moves)",
        &["state"],
    ),
    (
        "energy/elastic",
        "elastic energy of the whole body, elements at moving supports included",
        &["state"],
    ),
    (
        "energy/external",
        "work so far of the loads, and of supports that move (all that changes the energy but damping of free displacements and jumps)",
        &["state"],
    ),
    (
        "energy/dissipated",
        "work so far of the damping forces of free displacements on themselves",
        &["state"],
    ),
    ("energy/jumps", "sum of the jumps at switches so far", &["state"]),
    ("report/final/u", "last state: displacements u_O", &["unknown"]),
    ("report/final/v", "last state: velocities of u_O", &["unknown"]),
    ("backbone/omega", "circular frequency", &["point"]),
    ("backbone/energy", "energy of the motion", &["point"]),
    ("backbone/amplitude", "largest contact displacement", &["point"]),
    (
        "backbone/residual",
        "what is left of the periodicity, over the size of the state",
        &["point"],
    ),
    ("backbone/contact_time", "time in contact in a period", &["point"]),
    ("backbone/stable", "1 stable, 0 unstable, -1 not computed", &["point"]),
    ("backbone/switches", "switches in a period", &["point"]),
    ("backbone/branch", "branch that the point belongs to", &["point"]),
    ("backbone/index", "place of the point in its branch", &["point"]),
    ("backbone/alpha", "feedback of a viscous nonlinear mode", &["point"]),
    ("backbone/beta", "viscosity", &["point"]),
    (
        "backbone/energy_turned_over",
        "energy that viscosity and feedback hand round in a period",
        &["point"],
    ),
    ("backbone/grazing_distance", "nearest grazing, over the gap", &["point"]),
    ("backbone/special", "what is special about the point", &["point"]),
    ("study/id", "folder of the task", &["task"]),
    ("study/state", "done, failed, running, interrupted or waiting", &["task"]),
    ("study/message", "why a task failed", &["task"]),
    ("points/special", "what is special about the point", &["point"]),
    ("points/task", "task that the point belongs to, from 0", &["point"]),
    ("points/omega", "circular frequency", &["point"]),
    ("points/energy", "energy of the motion", &["point"]),
    ("points/amplitude", "largest contact displacement", &["point"]),
];

/// Say of every dataset that a file has what it is.
pub(super) fn describe(file: &hdf5::File) -> Result<(), StoreError> {
    for (name, what, labels) in DATASETS {
        let group = name.rsplit_once('/').map_or("", |n| n.0);
        // a path through a group that is not there is an error of the library
        if !(name_exists(file, group) && file.link_exists(name)) {
            continue;
        }
        let dataset = file.dataset(name)?;
        // those of the mesh are there from the beginning
        if dataset.attr("description").is_ok() {
            continue;
        }
        write_text(&dataset, "description", what)?;
        if dataset.ndim() == labels.len() {
            let words: Result<Vec<VarLenAscii>, _> =
                labels.iter().map(VarLenAscii::from_ascii).collect();
            let words = words.map_err(|_| hdf5::Error::from("a label is not ASCII"))?;
            dataset.new_attr_builder().with_data(&words).create("DIMENSION_LABELS")?;
        }
    }
    Ok(())
}

fn name_exists(file: &hdf5::File, group: &str) -> bool {
    let mut at = String::new();
    group.split('/').all(|part| {
        at = if at.is_empty() { part.to_owned() } else { format!("{at}/{part}") };
        file.link_exists(&at)
    })
}
