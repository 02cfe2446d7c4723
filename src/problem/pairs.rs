//! Pairs of surfaces: how they meet, what they leave between them, in the words of the scene.

use std::collections::HashSet;

use super::ProblemError;
use super::discretisation::discretisation;
use super::form::Form;
use super::gaps::gaps_at;
use super::notes::Notes;
use super::places::place;
use crate::contact::{MassChoice, Stress};
use crate::fem::pair::{Against, Meeting, Pair, PairError, Projection, Sides};
use crate::fem::{Body, Material};
use crate::mesh::Point;
use crate::mesh::point::dot;
use crate::scenario::{Contact, Issue, Obstacle, ProjectionKey, Scene, SidesKey};

/// Gaps below this share of the body's size are those of surfaces that touch.
const TOUCHING: f64 = 1e-12;

/// How the two surfaces of an obstacle's table meet; nothing of a rigid obstacle.
pub(super) fn meeting(
    scene: &Scene,
    (contact, table): (&Contact, usize),
    form: &Form,
    materials: &[Material],
) -> Result<Option<Meeting>, ProblemError> {
    let obstacle = &contact.obstacles[table];
    let Some(of) = &obstacle.meeting else { return Ok(None) };
    let pair = Pair {
        slave: obstacle.group.clone(),
        master: of.master.clone(),
        projection: of.projection.map(|p| match p {
            ProjectionKey::Match => Projection::Match,
            ProjectionKey::Dual => Projection::Dual,
        }),
        sides: match contact.sides.unwrap_or_default() {
            SidesKey::Both => Sides::Both,
            SidesKey::Slave => Sides::Slave,
        },
    };
    let mesh = &form.mesh;
    let material = mesh
        .group(&pair.slave)
        .first()
        .and_then(|&facet| materials.get(mesh.element(facet).region));
    let measure = |p: Point| material.map_or(1.0, |m| m.measure(p[0]));
    let found = Meeting::new(mesh, &pair, &measure);
    let meeting = found.map_err(|e| scene.error(issue(form, (contact, table), &pair, &e)))?;
    let strong = discretisation(scene).0 != Stress::Reaction;
    if strong && pair.sides == Sides::Both && meeting.projection == Projection::Dual {
        let message = "compares the stresses of two surfaces node by node, and these do not match";
        let help = "remove it (nodal reactions), or give sides = \"slave\"";
        return Err(scene.error(Issue::new(contact.key(table, "stress"), message, help)).into());
    }
    Ok(Some(meeting))
}

fn issue(form: &Form, (contact, table): (&Contact, usize), pair: &Pair, e: &PairError) -> Issue {
    let Pair { slave, master, .. } = pair;
    let of =
        |key: &str, message: String, help: &str| Issue::new(contact.key(table, key), message, help);
    match e {
        PairError::Shared { what } => of(
            "master",
            format!("\"{slave}\" and \"{master}\" share {what}: they cannot part"),
            "give two surfaces with nodes of their own; the lips of a crack need duplicated nodes (Gmsh's plugin Crack)",
        ),
        PairError::Apart { count } => of(
            "slave",
            format!("none of the {count} nodes of \"{slave}\" sees \"{master}\" along its normal"),
            "give two surfaces that face each other, or move one of the bodies",
        ),
        PairError::Thin { node, share } => of(
            "slave",
            format!(
                "\"{master}\" covers {} of what belongs to {}: 1e-3 at the least{}",
                match share.is_finite() {
                    true => format!("a share of {share:.1e}"),
                    false => "no share".to_owned(),
                },
                form.node(*node),
                if *share < 0.0 {
                    " (sides of second order weigh less than nothing at an end)"
                } else {
                    ""
                }
            ),
            "exchange slave and master, or extend the master",
        ),
        PairError::Turned { node, degrees } => of(
            "slave",
            format!(
                "the normals of \"{slave}\" and \"{master}\" are {degrees:.0}° apart near {}: 120° to 180° face each other",
                form.node(*node)
            ),
            "leave the sides out that do not face the other surface",
        ),
        PairError::NoPartner { node } => of(
            "projection",
            format!(
                "\"match\" needs a node of \"{master}\" for every node of \"{slave}\" on its normal, and one each: {} has none",
                form.node(*node)
            ),
            "give projection = \"dual\", or remove the key",
        ),
    }
}

/// The gaps of a pair at its contact points (point, node): what the scene says, or what the meshes leave.
pub(super) fn gaps(
    scene: &Scene,
    (contact, table): (&Contact, usize),
    body: &Body,
    points: &[(usize, usize)],
) -> Result<Vec<f64>, ProblemError> {
    let obstacle: &Obstacle = &contact.obstacles[table];
    let (mesh, dofs) = (&body.mesh, &body.dofs);
    let own = match (&obstacle.gap, dofs.facing.get(table).and_then(|f| f.meeting.as_ref())) {
        (Some(field), _) => {
            let places = points.iter().map(|(_, n)| mesh.nodes()[*n]);
            gaps_at(scene, &contact.key(table, "gap"), field, places)?
        }
        (None, Some(meeting)) => {
            let small = TOUCHING * mesh.length();
            let of = |&(point, node): &(usize, usize)| {
                let against = meeting.nodes.iter().find(|a| a.node == node);
                let gap =
                    against.map_or(f64::NAN, |a| dot(&a.way(mesh), &dofs.contact[point].direction));
                if gap.abs() <= small { 0.0 } else { gap }
            };
            points.iter().map(of).collect()
        }
        (None, None) => vec![],
    };
    let press = obstacle.meeting.as_ref().is_some_and(|m| m.press);
    let least = (0..own.len()).min_by(|&a, &b| own[a].total_cmp(&own[b]));
    if let Some(k) = least.filter(|&k| own[k] < 0.0 && !press) {
        let message = format!(
            "the two surfaces overlap by {:.3e} at {}",
            -own[k],
            place(mesh.nodes()[points[k].1], mesh.dim()),
        );
        let help = "give press = true where parts were pressed together, or gap = 0 where curved surfaces of different meshes are meant to coincide (they overlap by h²/8R)";
        return Err(scene.error(Issue::new(contact.key(table, "gap"), message, help)).into());
    }
    Ok(own)
}

/// A part of which every node gives up its inertia: it lies one element thick between two surfaces.
pub(super) fn thin(scene: &Scene, body: &Body) -> Option<Issue> {
    let (mesh, dofs) = (&body.mesh, &body.dofs);
    if !scene.contact.as_ref().is_some_and(Contact::has_pairs) {
        return None;
    }
    let parts = mesh.parts();
    let mut keeps = vec![false; parts.iter().max().map_or(0, |p| p + 1)];
    let contact: HashSet<usize> = dofs.contact.iter().map(|c| c.node).collect();
    (0..mesh.n_nodes()).for_each(|n| keeps[parts[n]] |= !contact.contains(&n));
    let part = keeps.iter().position(|keeps| !keeps)?;
    let node = parts.iter().position(|p| *p == part)?;
    let named = super::parts(scene, mesh);
    let name = &named.names[named.of_node[node]];
    let message = format!(
        "\"{name}\" lies one element thick between two surfaces: none of its nodes keeps its inertia"
    );
    let help = "give it two elements between them; or sides = \"slave\", and let it be slave on one side and master on the other";
    Some(Issue::new("contact", message, help))
}

/// What there is to say of pairs.
pub(super) fn note(scene: &Scene, body: &Body, notes: &mut Notes) {
    let meets = scene.contact.as_ref().is_some_and(Contact::has_pairs);
    if meets && discretisation(scene).1 == MassChoice::Paper {
        notes.warnings.push(
            "inertia = \"paper\" where two surfaces meet: a collision changes the energy by some per cent, of first order in the mesh (7 % on ten elements); \"constant\" keeps it"
                .into(),
        );
    }
    let ends = |n: usize| if n == 1 { "node" } else { "nodes" };
    for (group, of) in body.dofs.facing.iter().enumerate() {
        let Some(meeting) = &of.meeting else { continue };
        let Pair { slave, master, .. } = &meeting.pair;
        let is_held = |a: &&Against| body.dofs.contact_at(group, a.node).is_none();
        let held = meeting.nodes.iter().filter(is_held).count();
        if held > 0 {
            notes.warnings.push(format!(
                "{held} {} of \"{slave}\" {} held along the normal: no contact {}",
                ends(held),
                if held == 1 { "is" } else { "are" },
                ends(held)
            ));
        }
        if !meeting.uncovered.is_empty() {
            let n = meeting.uncovered.len();
            notes.warnings.push(format!(
                "{n} {} of \"{slave}\" see no \"{master}\" along their normals and are no contact nodes",
                ends(n)
            ));
        }
        if body.mesh.dim() == 2 && meeting.shared.len() > 1 {
            notes.warnings.push(format!(
                "\"{slave}\" and \"{master}\" share {} nodes: both ends of the crack are sewn. Right for one inside the body; one that opens at the surface needs OpenBoundaryPhysicalGroup in Gmsh's plugin Crack",
                meeting.shared.len()
            ));
        }
    }
}
