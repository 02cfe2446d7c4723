//! Bodies of elements, their supports, their obstacles and the discretisation of the contact.

use std::collections::BTreeMap;

use super::ProblemError;
use super::elements;
use super::given::{folder, given_length};
use super::imported;
use super::materials::materials;
use super::places::place;
use crate::contact::{Contacts, Gaps, MassChoice, Stress};
use crate::fem::{Body, DofMap, Facing, Fix, FrameError, Held};
use crate::matrices::read_matrix;
use crate::mesh::{Mesh, Point, structured};
use crate::scenario::{
    BodyKind, Contact, ContactMethod, Field, Inertia, Issue, MassKind, Obstacle, RedistributedMass,
    Scene, StressKey,
};

/// Stress and mass of the contact method that a scene names.
pub(super) fn discretisation(scene: &Scene) -> (Stress, MassChoice) {
    let slides = scene.slides();
    let Some(c) = &scene.contact else {
        return match slides {
            true => (Stress::Reaction, MassChoice::Condensed),
            false => (Stress::Projection, MassChoice::Paper),
        };
    };
    // meshes have defaults of their own: those that work with every element
    let is_mesh = scene.body.kind == BodyKind::Mesh;
    let stress = match c.stress {
        _ if c.is_reaction() => Stress::Reaction,
        None if slides => Stress::Reaction,
        Some(StressKey::NodalMean) => Stress::NodalMean,
        None if is_mesh => Stress::NodalMean,
        _ => Stress::Projection,
    };
    let mass = match (c.method, c.inertia, c.mass) {
        (ContactMethod::MassRedistribution, _, Some(RedistributedMass::Optimal)) => {
            MassChoice::Optimal
        }
        (ContactMethod::MassRedistribution, ..) | (_, Some(Inertia::Constant), _) => {
            MassChoice::Condensed
        }
        (ContactMethod::NodalBoundary, None, _) if is_mesh || slides || c.has_friction() => {
            MassChoice::Condensed
        }
        _ => MassChoice::Paper,
    };
    (stress, mass)
}

/// The mesh of a scene; regions are its materials.
pub fn mesh(scene: &Scene) -> Result<Mesh, ProblemError> {
    Ok(shape(scene)?.mesh)
}

/// A body without its matrices.
pub(super) struct Form {
    pub mesh: Mesh,
    /// What messages call a node.
    tags: Option<Vec<i64>>,
}

impl Form {
    /// A node in words.
    pub fn node(&self, node: usize) -> String {
        let place = place(self.mesh.nodes()[node], self.mesh.dim());
        match &self.tags {
            Some(tags) => format!("node {} at {place}", tags[node]),
            None => format!("the node at {place}"),
        }
    }
}

/// The mesh of a scene with the names of its nodes.
fn shape(scene: &Scene) -> Result<Form, ProblemError> {
    let b = &scene.body;
    let mesh = match b.kind {
        BodyKind::Bar => structured::bar(b.size[0], b.elements[0]),
        BodyKind::Plate => {
            structured::rectangle(b.size[0], b.size[1], b.elements[0], b.elements[1])
        }
        BodyKind::Mesh => {
            let (mesh, tags) = imported::body(scene)?;
            return Ok(Form { mesh, tags: Some(tags) });
        }
        BodyKind::Matrices => {
            // as many points as displacements; the files are read when the problem is set up
            let folder = folder(scene);
            let rows = b.mass_matrix.as_ref().and_then(|name| read_matrix(folder, name).ok());
            structured::row(given_length(scene), rows.map_or(1, |m| m.n_rows()))
        }
    };
    Ok(Form { mesh, tags: None })
}

/// The body of a scene.
pub(super) fn assemble(scene: &Scene) -> Result<Body, ProblemError> {
    let form = shape(scene)?;
    let dofs = numbering(scene, &form)?;
    let b = &scene.body;
    let materials = materials(scene);
    imported::check_elements(scene, &form, &dofs)?;
    let body = Body::assemble(form.mesh, dofs, &materials, b.mass == MassKind::Lumped);
    let body = elements::attach(scene, body)?;
    if let Some(issue) = empty(scene, &body) {
        return Err(scene.error(issue).into());
    }
    Ok(body)
}

/// Supports and obstacles as the numbering needs them.
fn numbering(scene: &Scene, form: &Form) -> Result<DofMap, ProblemError> {
    let held: Vec<Held> = scene
        .supports
        .iter()
        .flat_map(|s| {
            s.fix.iter().map(|direction| {
                let fix = direction.axis().map_or(Fix::Normal, Fix::Axis);
                Held { group: s.group().to_owned(), fix }
            })
        })
        .collect();
    let contact = scene.contact.as_ref();
    let facing = |o: &Obstacle| {
        let direction = o.plane.as_ref().map(|p| {
            let size = p.scale();
            std::array::from_fn(|c| p.normal.get(c).map_or(0.0, |n| n / size))
        });
        Facing { group: o.group.clone(), direction }
    };
    let facing: Vec<Facing> = contact.map_or(vec![], |c| c.obstacles.iter().map(facing).collect());
    let dofs = match contact.is_some_and(Contact::moves_contact) {
        true => DofMap::beside(&form.mesh, &held, &facing),
        false => DofMap::new(&form.mesh, &held, &facing),
    };
    let dofs = dofs.map_err(|e| scene.error(direction_issue(scene, form, &e)))?;
    if let Some((k, idle)) = facing.iter().enumerate().find(|(k, f)| {
        form.mesh.group_nodes(&f.group).iter().all(|&n| dofs.contact_at(*k, n).is_none())
    }) {
        let group = &idle.group;
        let message = format!("all displacements of \"{group}\" along its normal are prescribed");
        let help = "choose another edge or group, or free it in [[support]]";
        let key = contact.map_or(String::new(), |c| c.key(k, scene.body.kind.side_key()));
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    Ok(dofs)
}

/// Directions that do not go together, in the words of the scene.
fn direction_issue(scene: &Scene, form: &Form, error: &FrameError) -> Issue {
    let of_contact = |group: &str, message: String, help: &str| {
        let contact = scene.contact.as_ref();
        let k = contact.and_then(|c| c.obstacles.iter().position(|o| o.group == group));
        let key = contact.map_or(String::new(), |c| match k {
            Some(k) if c.obstacles[k].plane.is_some() => c.key(k, "plane"),
            k => c.key(k.unwrap_or(0), scene.body.kind.side_key()),
        });
        Issue::new(key, message, help)
    };
    match error {
        FrameError::NotFlat { group, degrees } => {
            let i = scene.supports.iter().position(|s| s.group() == group).unwrap_or(0);
            let message =
                format!("\"normal\" needs a flat group: \"{group}\" turns by {degrees:.3}°");
            Issue::new(
                format!("support[{i}].fix"),
                message,
                "give \"x\" and \"y\", or a flat group",
            )
        }
        FrameError::Turned { node, group, degrees } => of_contact(
            group,
            format!(
                "the contact direction lies {degrees:.1}° off the normal of a side at {}: 60° at the most",
                form.node(*node)
            ),
            "give a group that faces the obstacle: leave the sides out that do not (the lips of a crack do not meet each other)",
        ),
        FrameError::Corner { node, group, degrees } => of_contact(
            group,
            format!(
                "\"{group}\" turns by {degrees:.1}° at {}: one displacement cannot stand for two walls",
                form.node(*node)
            ),
            "give the sides on either side of it groups and [[contact]] tables of their own; or mesh a curved surface finer: 50° at the most",
        ),
        FrameError::Crossing { node, degrees } => of_contact(
            "",
            format!(
                "{} meets obstacles in two directions {degrees:.1}° apart: up to 10° are one direction, 30° to 150° are two",
                form.node(*node)
            ),
            "leave the sides at that node out of one of the groups",
        ),
        FrameError::TooMany { node } => of_contact(
            "",
            format!(
                "the directions in which {} meets obstacles depend on each other: there are more than dimensions, or they lie in one plane",
                form.node(*node)
            ),
            "leave the sides at that node out of one of the groups",
        ),
        FrameError::PartlyHeld { node, degrees } => of_contact(
            "",
            format!(
                "a support holds a part of the contact displacement of {}: {degrees:.1}° lie between the two",
                form.node(*node)
            ),
            "leave the node out of the contact group, or hold it altogether",
        ),
    }
}

fn empty(scene: &Scene, body: &Body) -> Option<Issue> {
    let with_contact =
        if scene.contact.is_some() { " besides the contact displacements" } else { "" };
    let key = if scene.body.kind == BodyKind::Mesh { "body.file" } else { "body.elements" };
    (body.dofs.n_o == 0).then(|| {
        Issue::new(
            key,
            format!("no displacement is left free{with_contact}"),
            "use more elements or fewer supports",
        )
    })
}

/// What the scene says of the contact points of a body.
pub(super) fn contacts(scene: &Scene, body: &Body) -> Result<Contacts, ProblemError> {
    let Some(c) = &scene.contact else { return Ok(Contacts::default()) };
    let dofs = &body.dofs;
    let mut gap = vec![f64::INFINITY; dofs.contact.len()];
    let mut behind = BTreeMap::new();
    for (k, obstacle) in c.obstacles.iter().enumerate() {
        let nodes = body.mesh.group_nodes(&obstacle.group);
        let points: Vec<(usize, Point)> = nodes
            .into_iter()
            .filter_map(|n| Some((dofs.contact_at(k, n)?, body.mesh.nodes()[n])))
            .collect();
        let own = gaps_to(scene, k, points.iter().map(|p| p.1))?;
        points.iter().zip(own).for_each(|((i, _), g)| gap[*i] = gap[*i].min(g));
        if let Some(field) = &obstacle.gap_behind {
            let key = c.key(k, "gap_behind");
            let own = gaps_at(scene, &key, field, points.iter().map(|p| p.1))?;
            for ((i, _), g) in points.iter().zip(own) {
                let least = behind.entry(*i).or_insert(f64::INFINITY);
                *least = f64::min(*least, g);
                check_way(scene, &key, gap[*i] + g)?;
            }
        }
    }
    let gaps = Gaps { front: gap, behind: behind.into_iter().collect() };
    Ok(Contacts { gaps, lumped: c.boundary_mass == MassKind::Lumped })
}

/// There is room between an obstacle in front and one behind.
pub(super) fn check_way(scene: &Scene, key: &str, way: f64) -> Result<(), ProblemError> {
    if way > 0.0 {
        return Ok(());
    }
    let message = format!("leaves no room: the way from one obstacle to the other is {way:e}");
    Err(scene.error(Issue::new(key, message, "give gap + gap_behind > 0")).into())
}

/// The gaps of an obstacle at places of its group.
pub(super) fn gaps_to(
    scene: &Scene,
    obstacle: usize,
    places: impl Iterator<Item = Point> + Clone,
) -> Result<Vec<f64>, ProblemError> {
    let Some(c) = &scene.contact else { return Ok(vec![]) };
    match (&c.obstacles[obstacle].gap, &c.obstacles[obstacle].plane) {
        (Some(field), _) => gaps_at(scene, &c.key(obstacle, "gap"), field, places),
        (None, Some(plane)) => {
            let along = |p: Point| plane.normal.iter().zip(p).map(|(n, x)| n * x).sum::<f64>();
            Ok(places.map(|p| (plane.offset - along(p)) / plane.scale()).collect())
        }
        (None, None) => Ok(vec![]),
    }
}

/// A gap at places of the edge.
pub(super) fn gaps_at(
    scene: &Scene,
    key: &str,
    field: &Field,
    places: impl Iterator<Item = Point> + Clone,
) -> Result<Vec<f64>, ProblemError> {
    let gap: Vec<f64> = places.clone().map(|p| field.at(p)).collect();
    // squares of gaps must not overflow
    let wrong = gap.iter().zip(places).find(|(g, _)| g.is_nan() || g.abs() > 1e60);
    if let Some((gap, p)) = wrong {
        let message = format!("is {gap:e} at {}", place(p, scene.dim().max(2)));
        let help = "give an expression of at most 1e60 on the whole edge";
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    Ok(gap)
}
