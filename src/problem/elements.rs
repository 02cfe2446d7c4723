//! Elements at nodes: springs, dampers and masses of a scene as rows over the displacements.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::places::{Placed, place, placed};
use super::{Problem, ProblemError};
use crate::contact::{Dampers, Elastic, Pull, Slider, System};
use crate::fem::{Body, Csr, Discrete, Loads, load};
use crate::mesh::Point;
use crate::scenario::{
    BodyKind, ContactMethod, End, Ends, Issue, LoadKind, RedistributedMass, Scene, Sliding,
};

/// `w` of an element, and what its values are multiplied by: an area, where there is one at every node of a group.
type Row = (Vec<(usize, f64)>, f64);

/// Springs and masses of the body of elements of a scene.
fn discrete(scene: &Scene, body: &Body) -> Result<Vec<Discrete>, ProblemError> {
    elements(scene, |table, ends| rows(scene, body, table, ends))
}

/// Those of a scene whose body comes from `n × n` matrices.
pub(super) fn of_matrices(scene: &Scene, n: usize) -> Result<Vec<Discrete>, ProblemError> {
    elements(scene, |table, ends| Ok(vec![(on_rows(scene, table, ends, n)?, 1.0)]))
}

/// Springs, then masses, on their rows.
fn elements(
    scene: &Scene,
    rows: impl Fn(&str, &Ends) -> Result<Vec<Row>, ProblemError>,
) -> Result<Vec<Discrete>, ProblemError> {
    let mut all = vec![];
    for (i, spring) in scene.springs.iter().enumerate() {
        let placed = rows(&format!("spring[{i}]"), &spring.ends())?;
        let of =
            |(row, share): Row| Discrete { row, stiffness: share * spring.stiffness, mass: 0.0 };
        all.extend(placed.into_iter().map(of));
    }
    for (i, mass) in scene.masses.iter().enumerate() {
        let placed = rows(&format!("mass[{i}]"), &mass.ends())?;
        let of = |(row, share): Row| Discrete { row, stiffness: 0.0, mass: share * mass.mass };
        all.extend(placed.into_iter().map(of));
    }
    Ok(all)
}

/// The direction of an element, of length one.
fn unit(ends: &Ends) -> Vec<f64> {
    let given = ends.direction.unwrap_or(&[1.0]);
    let size = given.iter().fold(0.0f64, |m, x| m.hypot(*x));
    given.iter().map(|x| x / size).collect()
}

/// Entries of a row below this share of the largest are rounding errors.
const ROUNDING: f64 = 1e-12;

/// The rows of an element over the displacements of the body.
fn rows(scene: &Scene, body: &Body, table: &str, ends: &Ends) -> Result<Vec<Row>, ProblemError> {
    if scene.body.kind == BodyKind::Matrices {
        let row = on_rows(scene, table, ends, body.dofs.n_rows())?;
        let of_row = |(i, w): (usize, f64)| body.dofs.terms(i, 0).map(move |(j, t)| (j, w * t));
        return Ok(vec![(row.into_iter().flat_map(of_row).collect(), 1.0)]);
    }
    let dim = body.mesh.dim();
    let direction = unit(ends);
    let (nodal, each) = over_nodes(scene, body, table, ends)?;
    let entries = |nodal: &[f64]| -> Vec<(usize, f64)> {
        let row = body.dofs.gather_forces(nodal);
        // what a frame leaves of an axis by rounding is none
        let least = ROUNDING * row.iter().fold(0.0f64, |m, w| m.max(w.abs()));
        row.into_iter().enumerate().filter(|e| e.1.abs() > least).collect()
    };
    let all: Vec<Row> = match ends.each {
        false => vec![(entries(&nodal), 1.0)],
        true => {
            let of_node = |(node, area): (usize, &f64)| {
                let mut nodal = vec![0.0; dim * body.mesh.n_nodes()];
                nodal[dim * node..dim * (node + 1)].copy_from_slice(&direction);
                (entries(&nodal), *area)
            };
            let at_nodes = each.iter().enumerate().filter(|(_, area)| **area != 0.0).map(of_node);
            at_nodes.filter(|(row, _)| !row.is_empty()).collect()
        }
    };
    if all.iter().all(|(row, _)| row.is_empty()) {
        let message = "acts on displacements that supports hold, or on two ends that move alike";
        let help = "choose another place or direction, or remove it";
        return Err(scene.error(Issue::new(table, message, help)).into());
    }
    Ok(all)
}

/// What an element acts on over the components of all nodes, held ones included; or, of one at every node of a group, their areas.
fn over_nodes(
    scene: &Scene,
    body: &Body,
    table: &str,
    ends: &Ends,
) -> Result<(Vec<f64>, Vec<f64>), ProblemError> {
    let dim = body.mesh.dim();
    let direction = unit(ends);
    let mut nodal = vec![0.0; dim * body.mesh.n_nodes()];
    let mut each = vec![];
    for (end, prefix, sign) in [(Some(ends.from), "", 1.0), (ends.to, "to_", -1.0)] {
        match end {
            Some(End::At(at)) => {
                let found = placed(scene, &body.mesh, &format!("{table}.{prefix}at"), Some(at))?;
                let own = &mut nodal[dim * found.node..dim * (found.node + 1)];
                own.iter_mut().zip(&direction).for_each(|(x, d)| *x += sign * d);
            }
            Some(End::Group(group)) => {
                let areas = load::nodal_areas(body, group);
                let whole: f64 = areas.iter().sum();
                if whole == 0.0 {
                    let message = format!("the body has no edge \"{group}\"");
                    let help = "give \"left\", \"right\", \"bottom\" or \"top\"";
                    return Err(scene
                        .error(Issue::new(format!("{table}.to"), message, help))
                        .into());
                }
                if ends.each {
                    each = load::positive_areas(body, group);
                    continue;
                }
                for (own, area) in nodal.chunks_exact_mut(dim).zip(&areas) {
                    own.iter_mut().zip(&direction).for_each(|(x, d)| *x += sign * area / whole * d);
                }
            }
            Some(End::Row(_)) | None => {}
        }
    }
    Ok((nodal, each))
}

/// The row of an element on given matrices.
fn on_rows(
    scene: &Scene,
    table: &str,
    ends: &Ends,
    n: usize,
) -> Result<Vec<(usize, f64)>, ProblemError> {
    let mut row: Vec<(usize, f64)> = vec![];
    for (end, name, sign) in [(Some(ends.from), "row", 1.0), (ends.to, "to_row", -1.0)] {
        let Some(End::Row(i)) = end else { continue };
        let twice = name == "to_row" && matches!(ends.from, End::Row(from) if from == i);
        if i >= n || twice {
            let message = match twice {
                true => "is the row of the first end".to_owned(),
                false => format!("{i} is no row of the matrices"),
            };
            let help = format!("give another row from 0 to {}", n - 1);
            return Err(scene.error(Issue::new(format!("{table}.{name}"), message, help)).into());
        }
        for (j, w) in scene.rows.terms(i) {
            match row.iter_mut().find(|e| e.0 == j) {
                Some(e) => e.1 += sign * w,
                None => row.push((j, sign * w)),
            }
        }
    }
    Ok(row)
}

/// The forces of the springs at rest, into the constant loads.
pub(super) fn preload(
    scene: &Scene,
    system: &System,
    loads: &mut Loads,
) -> Result<(), ProblemError> {
    for (i, spring) in scene.springs.iter().enumerate() {
        let stretch = Stretch::of(scene, &system.body, i)?;
        if spring.preload == 0.0 {
            continue;
        }
        let mut force = vec![0.0; system.n()];
        stretch.row.into_iter().for_each(|(j, w)| force[j] -= spring.preload * w);
        loads.push(force, None, 0.0);
    }
    Ok(())
}

/// How much longer a spring is: positive whichever end is named first, of one to the ground along its direction.
struct Stretch {
    /// `Σ w` over `u`, times areas where it is one at every node of a group.
    row: BTreeMap<usize, f64>,
    /// The sum of these areas, or one.
    share: f64,
    /// What it was multiplied by.
    sign: f64,
}

impl Stretch {
    /// Of a spring of a scene.
    fn of(scene: &Scene, body: &Body, i: usize) -> Result<Stretch, ProblemError> {
        let ends = scene.springs[i].ends();
        let placed = rows(scene, body, &format!("spring[{i}]"), &ends)?;
        let sign = if apart(body, &ends) < 0.0 { -1.0 } else { 1.0 };
        let (mut row, mut whole) = (BTreeMap::new(), 0.0);
        for (own, share) in placed {
            whole += share;
            own.into_iter().for_each(|(j, w)| *row.entry(j).or_insert(0.0) += sign * share * w);
        }
        Ok(Stretch { row, share: whole, sign })
    }
}

/// Springs by name, with `Σ k w` and with their forces at rest; they pull where these are positive.
pub(super) fn pulls(scene: &Scene, system: &System) -> Result<Vec<Pull>, ProblemError> {
    let mut all: Vec<Pull> = vec![];
    for (i, spring) in scene.springs.iter().enumerate() {
        let ends = spring.ends();
        let Stretch { row, share, sign } = Stretch::of(scene, &system.body, i)?;
        let row = row.into_iter().map(|(j, w)| (j, spring.stiffness * w)).collect();
        let nodal = match scene.body.kind {
            BodyKind::Matrices => vec![],
            _ => over_nodes(scene, &system.body, &format!("spring[{i}]"), &ends)?.0,
        };
        let nodal = nodal.into_iter().map(|w| sign * w).collect();
        let name = scene.ends_name(&ends);
        let numbered = format!("{name} (");
        let twins = all.iter().filter(|s| s.name == name || s.name.starts_with(&numbered)).count();
        let name = if twins > 0 { format!("{numbered}{})", twins + 1) } else { name };
        all.push(Pull { name, row, preload: share * spring.preload, nodal });
    }
    Ok(all)
}

/// How far the first end of an element stands before its second one, along its direction; zero to the ground, and of given matrices.
fn apart(body: &Body, ends: &Ends) -> f64 {
    let (mesh, direction) = (&body.mesh, unit(ends));
    let along = |p: Point| direction.iter().zip(p).map(|(d, x)| d * x).sum::<f64>();
    let place = |end: End| match end {
        End::At(at) => Some(at.iter().zip(&direction).map(|(x, d)| x * d).sum::<f64>()),
        End::Group(group) => {
            let areas = load::nodal_areas(body, group);
            let moment = areas.iter().zip(mesh.nodes()).map(|(a, p)| a * along(*p));
            Some(moment.sum::<f64>() / areas.iter().sum::<f64>())
        }
        End::Row(_) => None,
    };
    let to = ends.to.and_then(place);
    place(ends.from).zip(to).map_or(0.0, |(from, to)| from - to)
}

/// Where the places of elements ended up.
pub(super) fn places(scene: &Scene, body: &Body) -> Result<Vec<Placed>, ProblemError> {
    let mut all = vec![];
    for (table, ends) in scene.all_ends() {
        for (end, key) in [(Some(ends.from), "at"), (ends.to, "to_at")] {
            if let Some(End::At(at)) = end {
                all.push(placed(scene, &body.mesh, &format!("{table}.{key}"), Some(at))?);
            }
        }
    }
    Ok(all)
}

/// The dampers of a scene.
pub(super) fn dampers(scene: &Scene, system: &System) -> Result<Option<Dampers>, ProblemError> {
    let mut entries = vec![];
    let mut count = 0;
    for (i, damper) in scene.dampers.iter().enumerate() {
        let table = format!("damper[{i}]");
        for (row, share) in rows(scene, &system.body, &table, &damper.ends())? {
            let root = (share * damper.viscosity).sqrt();
            if let Some((j, _)) = row.iter().find(|(j, _)| *j >= system.n_o()) {
                let message = format!(
                    "acts on the contact displacement {}, which has no inertia: its velocity follows from the others and jumps",
                    j - system.n_o()
                );
                let help = "choose a place beside the contact, or a direction along the obstacle; or give [damping]";
                return Err(scene.error(Issue::new(table, message, help)).into());
            }
            entries.extend(row.into_iter().map(|(j, w)| (count, j, root * w)));
            count += 1;
        }
    }
    Ok((count > 0).then(|| Dampers::new(Csr::from_triplets(count, system.n_o(), entries))))
}

/// The body of elements of a scene with its springs and masses, and with what springs of sliders remember.
pub(super) fn attach(scene: &Scene, body: Body) -> Result<Body, ProblemError> {
    let discrete = discrete(scene, &body)?;
    let body = body.with_elements(discrete);
    let elastic = sliders(scene, &body)?.iter().filter(|s| s.elastic.is_some()).count();
    let anchors = body.dofs.tangents.len();
    Ok(body.with_memory(anchors).with_memory(elastic))
}

/// The sliders of a scene on the displacements of a body; what their springs remember are the last entries of `u_O`.
pub(super) fn sliders(scene: &Scene, body: &Body) -> Result<Vec<Slider>, ProblemError> {
    let mut all: Vec<Slider> = vec![];
    for Sliding { table, ends, limit, stiffness, preload } in scene.all_sliders() {
        for (row, share) in rows(scene, body, &table, &ends)? {
            if row.iter().any(|(j, _)| *j >= body.dofs.n_o) {
                let message = "acts on contact displacements, which have no inertia: friction is known where there is some";
                let help = "choose a place beside the contact, or a direction along the obstacle";
                return Err(scene.error(Issue::new(table, message, help)).into());
            }
            if stiffness.is_none() && all.iter().any(|s| s.elastic.is_none() && s.row == row) {
                let message = "slides over the same displacement as another: only the sum of their limits would be known";
                let help = "give one slider with the sum, or each a stiffness";
                return Err(scene.error(Issue::new(table, message, help)).into());
            }
            let node = node_of(scene, body, &ends, &row);
            let position = body.mesh.nodes()[node];
            let mut direction = [0.0; 3];
            direction.iter_mut().zip(unit(&ends)).for_each(|(d, x)| *d = x);
            let elastic =
                |k: f64| Elastic { stiffness: share * k, memory: 0, preload: share * preload };
            let elastic = stiffness.map(elastic);
            let limit = share * limit;
            all.push(Slider { row, limit, elastic, node, position, direction });
        }
    }
    let mut springs: Vec<&mut Elastic> =
        all.iter_mut().filter_map(|s| s.elastic.as_mut()).collect();
    let first = body.dofs.n_o.saturating_sub(springs.len());
    springs.iter_mut().enumerate().for_each(|(k, e)| e.memory = first + k);
    Ok(all)
}

/// What files call the place of an element: a row, or the node of its first end that the row knows best.
fn node_of(scene: &Scene, body: &Body, ends: &Ends, row: &[(usize, f64)]) -> usize {
    if let (BodyKind::Matrices, End::Row(i)) = (scene.body.kind, ends.from) {
        return i;
    }
    let largest = row.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |e| e.0);
    let has = |n: &usize| body.dofs.directions(*n).any(|(_, place)| place == Some(largest));
    (0..body.mesh.n_nodes()).find(has).unwrap_or(0)
}

/// What sliders do not go with, before there is a body.
pub(super) fn check_sliders(scene: &Scene) -> Result<(), ProblemError> {
    let Some(contact) = scene.contact.as_ref().filter(|_| scene.slides()) else {
        return Ok(());
    };
    if matches!(contact.method, ContactMethod::NodalBoundary | ContactMethod::MassRedistribution) {
        return Ok(());
    }
    let message = "is known beside obstacles that do not yield: this contact method has springs, or velocities that jump";
    let help = "give [contact] method = \"nbm\" or \"mass-redistribution\", or no [contact]";
    let table = scene.all_sliders().first().map_or(String::new(), |s| s.table.clone());
    Err(scene.error(Issue::new(table, message, help)).into())
}

/// Add dampers to those that a system has.
pub(super) fn add(system: &mut System, more: Option<Dampers>) {
    let Some(more) = more else { return };
    system.dampers = Some(Arc::new(match &system.dampers {
        Some(own) => more.beside(own),
        None => more,
    }));
}

/// What elements at nodes do not go with.
pub(super) fn check(scene: &Scene, problem: &Problem) -> Result<(), ProblemError> {
    let modal = scene.damping.as_ref().is_some_and(|d| d.modal.is_some());
    let modal = modal.then(|| "damping.modal".to_owned());
    let Some(table) = scene.all_ends().next().map(|e| e.0).or(modal) else { return Ok(()) };
    let fail = |key: &str, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    let system = &problem.system;
    let waves = scene.contact.as_ref().is_some_and(|c| c.method == ContactMethod::Waves);
    if waves && scene.has_elements() {
        let message = "changes the bar, and \"waves\" knows a uniform one";
        return fail(&table, message, "remove it, or give another contact method");
    }
    let moves = scene.contact.as_ref().is_some_and(|c| c.motion.is_some())
        || scene.loads.iter().any(|l| l.kind == LoadKind::Base);
    if moves {
        let message = "acts against the ground, and supports or obstacles move here: the body is seen from what moves";
        return fail(&table, message, "move the loads in place of the supports, or remove it");
    }
    let optimal = scene.contact.as_ref().and_then(|c| c.mass) == Some(RedistributedMass::Optimal);
    if optimal && !scene.masses.is_empty() {
        let message = "is a mass of its own, and \"optimal\" spreads that of the elements";
        return fail("mass[0]", message, "give [contact] mass = \"condensed\"");
    }
    // pressures from strains do not know of springs at contact displacements
    let by_forces = system.contact_has_inertia()
        || system.n_contact() == 0
        || scene.contact.as_ref().is_some_and(|c| c.is_reaction());
    let at_contact =
        |e: &&Discrete| e.stiffness != 0.0 && e.row.iter().any(|(j, _)| *j >= system.n_o());
    if let Some(e) = system.body.discrete.iter().find(at_contact).filter(|_| !by_forces) {
        let at = e.row.iter().find(|(j, _)| *j >= system.n_o()).map_or(0, |e| e.0 - system.n_o());
        let node = system.body.dofs.contact[at].node;
        let message = format!(
            "a spring acts on a contact displacement at {}, and this method takes the pressure from strains",
            place(system.body.mesh.nodes()[node], scene.dim())
        );
        return fail("contact", &message, "give stress = \"reaction\", or another place");
    }
    Ok(())
}
