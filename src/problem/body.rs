//! Bodies of elements, their supports, their obstacles and the discretisation of the contact.

use std::collections::BTreeMap;

use super::ProblemError;
use super::elements;
use super::form::Form;
use super::gaps::{check_way, gaps_at, gaps_to};
use super::given::{folder, given_length};
use super::imported;
use super::materials::materials;
use super::pairs;
use crate::contact::{Contacts, Gaps};
use crate::fem::{Body, DofMap, Facing, Fix, FrameError, Held, MassForm, Material, finer};
use crate::matrices::read_matrix;
use crate::mesh::point::{minus, norm};
use crate::mesh::{Facet, Mesh, Point, bounds, structured};
use crate::scenario;
use crate::scenario::{
    BodyKind, BoundaryMass, Contact, Direction, Issue, MassKind, Obstacle, Portion, Scene, Support,
};

/// The mesh of a scene; regions are its materials.
pub fn mesh(scene: &Scene) -> Result<Mesh, ProblemError> {
    Ok(shape(scene)?.mesh)
}

/// The mesh of a scene with the names of its nodes.
fn shape(scene: &Scene) -> Result<Form, ProblemError> {
    let bodies = scene.bodies();
    let (mut parts, mut regions, mut tags): (Vec<(&str, Mesh)>, _, _) = (vec![], vec![], vec![]);
    let mut generated = 0;
    for (key, body) in &bodies {
        let (mesh, mut names) = part(scene, (key, body))?;
        let mesh = match finer(&mesh, scene.finer) {
            Some(mesh) => mesh,
            None => {
                let message = "has two nodes at one place of a side, which elements of half the size or second order do not tell apart";
                let issue = Issue::new(format!("{key}.file"), message, "mesh it finer around them");
                return Err(scene.error(issue).into());
            }
        };
        names.resize(mesh.n_nodes(), None);
        // bars and plates have the first materials, in their order; a mesh knows its own among all
        regions.push(if body.kind == BodyKind::Mesh { 0 } else { generated });
        generated += usize::from(body.kind != BodyKind::Mesh);
        tags.extend(names);
        parts.push((body.name.as_deref().unwrap_or_default(), mesh));
    }
    let mesh = match parts.pop() {
        Some((_, alone)) if scene.parts.is_empty() => alone,
        last => {
            parts.extend(last);
            Mesh::joined(&parts, &regions)
        }
    };
    check_names(scene, &mesh)?;
    let mesh = portions(scene, mesh, &tags)?;
    Ok(Form { mesh, tags })
}

/// Of several bodies every group that the scene names is there; the readers of files say so of their own.
fn check_names(scene: &Scene, mesh: &Mesh) -> Result<(), ProblemError> {
    let named = scene.named_sides().into_iter().filter(|_| !scene.parts.is_empty());
    let Some((key, word)) = named.into_iter().find(|(_, word)| mesh.group(word).is_empty()) else {
        return Ok(());
    };
    let body = word.split(':').next().unwrap_or_default();
    let of = |b: &scenario::Body| b.name.clone().unwrap_or_default();
    let (message, help) = match scene.parts.iter().find(|b| of(b) == body) {
        None => {
            let names: Vec<String> = scene.parts.iter().map(|b| format!("\"{}\"", of(b))).collect();
            (format!("no [[body]] is called \"{body}\""), format!("there are {}", names.join(", ")))
        }
        Some(b) => {
            let edges = mesh.groups().filter(|g| scene.within(b, g).is_some());
            let edges: Vec<String> = edges.map(|g| format!("\"{g}\"")).collect();
            (format!("\"{body}\" has no edge \"{word}\""), format!("it has {}", edges.join(", ")))
        }
    };
    Err(scene.error(Issue::new(key, message, help)).into())
}

/// The nodes of a group that a scene names, and the sides that they are on.
fn chosen(
    scene: &Scene,
    (key, wanted): (String, &[i64]),
    (mesh, group): (&Mesh, &str),
    tags: &[Option<i64>],
) -> Result<(Vec<usize>, Vec<Facet>), ProblemError> {
    let all = mesh.group_nodes(group);
    let number = |n: usize| tags[n].unwrap_or(n as i64);
    let mut nodes = vec![];
    for tag in wanted {
        let Some(node) = all.iter().find(|n| number(**n) == *tag) else {
            let known: Vec<String> = all.iter().map(|&n| number(n).to_string()).collect();
            let shown = match known.len() {
                0..=12 => known.join(", "),
                _ => format!("{}, … {}", known[..10].join(", "), known[known.len() - 1]),
            };
            let message = format!("\"{group}\" has no node {tag}");
            let help = format!("its {} nodes are {shown}", known.len());
            return Err(scene.error(Issue::new(key, message, help)).into());
        };
        nodes.push(*node);
    }
    let touches = |f: &&Facet| mesh.side_nodes(**f).iter().any(|n| nodes.contains(n));
    let facets = mesh.group(group).iter().filter(touches).copied().collect();
    Ok((nodes, facets))
}

/// A part of a group, as a scene chooses it.
struct Part<'s> {
    /// Where.
    key: String,
    group: &'s str,
    portion: &'s Portion,
    /// What it is called.
    name: &'s str,
    faces_obstacle: bool,
}

/// The parts of groups that obstacles face, then those that supports hold.
fn parts_of(scene: &Scene) -> Vec<Part<'_>> {
    let contact = scene.contact.iter();
    let obstacles = contact.flat_map(|c| c.obstacles.iter().enumerate().map(move |o| (c, o)));
    let of_obstacles = obstacles.filter_map(|(c, (k, o))| {
        let (group, portion) = o.portion.as_ref()?;
        let key = c.key(k, portion.key());
        Some(Part { key, group, portion, name: &o.group, faces_obstacle: true })
    });
    let of_supports = scene.supports.iter().enumerate().filter_map(|(i, s)| {
        let (group, portion) = s.part()?;
        let key = format!("support[{i}].{}", portion.key());
        Some(Part { key, group, portion, name: s.group(), faces_obstacle: false })
    });
    of_obstacles.chain(of_supports).collect()
}

/// The mesh with the parts of groups that obstacles face and supports hold, as groups of their own.
fn portions(scene: &Scene, mesh: Mesh, tags: &[Option<i64>]) -> Result<Mesh, ProblemError> {
    let mut added: Vec<(String, Vec<Facet>)> = vec![];
    let mut at_nodes: Vec<(String, Vec<usize>)> = vec![];
    for Part { key, group, portion, name, faces_obstacle } in parts_of(scene) {
        if added.iter().any(|(other, _)| other == name) {
            if !faces_obstacle {
                continue;
            }
            let issue = Issue::new(key, "is that of another obstacle", "give it once");
            return Err(scene.error(issue).into());
        }
        let facets = mesh.group(group);
        let middle = |f: &Facet| {
            let nodes = mesh.side_nodes(*f);
            let sum = nodes.iter().fold([0.0; 3], |sum: Point, &n| {
                std::array::from_fn(|c| sum[c] + mesh.nodes()[n][c])
            });
            sum.map(|x| x / nodes.len() as f64)
        };
        let length = |f: &Facet| {
            let nodes = mesh.side_nodes(*f);
            let piece = |w: &[usize]| norm(&minus(&mesh.nodes()[w[1]], &mesh.nodes()[w[0]]));
            nodes.windows(2).map(piece).sum::<f64>()
        };
        let whole: f64 = facets.iter().map(length).sum();
        let mut behind = 0.0;
        let mut sides = vec![];
        for facet in facets {
            let own = length(facet);
            if portion.has(middle(facet), (behind + 0.5 * own) / whole) {
                sides.push(*facet);
            }
            behind += own;
        }
        if let Portion::Nodes(wanted) = portion {
            let (nodes, on) = chosen(scene, (key.clone(), wanted), (&mesh, group), tags)?;
            at_nodes.push((name.to_owned(), nodes));
            sides = on;
        }
        if sides.is_empty() {
            let middles: Vec<Point> = facets.iter().map(middle).collect();
            let [low, high] = bounds(&middles);
            let range = |c: usize| format!("{} {} to {}", ["x", "y", "z"][c], low[c], high[c]);
            let ranges: Vec<String> = (0..mesh.dim()).map(range).collect();
            let message = format!(
                "the middle of no side of \"{group}\" lies there: of its {} they reach over {}",
                facets.len(),
                ranges.join(", ")
            );
            let help = "give a larger part, or a finer mesh";
            return Err(scene.error(Issue::new(key, message, help)).into());
        }
        added.push((name.to_owned(), sides));
    }
    if added.is_empty() {
        return Ok(mesh);
    }
    let own: Vec<(String, Vec<Facet>)> =
        mesh.groups().map(|g| (g.to_owned(), mesh.group(g).to_vec())).collect();
    Ok(mesh.with_groups(own.into_iter().chain(added)).with_chosen(at_nodes))
}

/// The mesh of one body where it stands, with the names of its nodes.
fn part(
    scene: &Scene,
    (key, b): (&str, &scenario::Body),
) -> Result<(Mesh, Vec<Option<i64>>), ProblemError> {
    let mesh = match b.kind {
        BodyKind::Bar => structured::bar(b.size[0], b.elements[0]),
        BodyKind::Plate => {
            structured::rectangle(b.size[0], b.size[1], b.elements[0], b.elements[1])
        }
        BodyKind::Mesh => {
            let (mesh, tags) = imported::body(scene, (key, b))?;
            return Ok((placed(mesh, b), tags.into_iter().map(Some).collect()));
        }
        BodyKind::Matrices | BodyKind::Parts => {
            // as many points as displacements; the files are read when the problem is set up
            let folder = folder(scene);
            let rows = b.mass_matrix.as_ref().and_then(|name| read_matrix(folder, name).ok());
            structured::row(given_length(scene), rows.map_or(1, |m| m.n_rows()))
        }
    };
    let names = vec![None; mesh.n_nodes()];
    Ok((placed(mesh, b), names))
}

/// A mesh mirrored, turned and moved as its table says.
fn placed(mesh: Mesh, b: &scenario::Body) -> Mesh {
    if b.mirror.is_none() && b.turn.is_none() && b.shift.is_none() {
        return mesh;
    }
    let mesh = match b.mirror.map(|axis| axis as usize) {
        None => mesh,
        Some(axis) => {
            mesh.mirrored(|p| std::array::from_fn(|c| if c == axis { -p[c] } else { p[c] }))
        }
    };
    let (sin, cos) = b.turn.unwrap_or(0.0).to_radians().sin_cos();
    let shift = |c: usize| b.shift.as_ref().and_then(|s| s.get(c)).copied().unwrap_or(0.0);
    mesh.moved(|[x, y, z]| match b.turn {
        None => [x + shift(0), y + shift(1), z + shift(2)],
        Some(_) => [cos * x - sin * y + shift(0), sin * x + cos * y + shift(1), z + shift(2)],
    })
}

/// How a scene spreads the mass.
fn form_of(kind: MassKind) -> MassForm {
    match kind {
        MassKind::Consistent => MassForm::Consistent,
        MassKind::Lumped => MassForm::Lumped,
        MassKind::ScaledDiagonal => MassForm::ScaledDiagonal,
    }
}

/// The body of a scene.
pub(super) fn assemble(scene: &Scene) -> Result<Body, ProblemError> {
    let form = shape(scene)?;
    let b = &scene.body;
    let materials = materials(scene);
    let dofs = numbering(scene, &form, &materials)?;
    imported::check_elements(scene, &form, &dofs)?;
    let body = Body::assemble(form.mesh, dofs, &materials, form_of(b.mass));
    let body = elements::attach(scene, body)?;
    if let Some(issue) = empty(scene, &body) {
        return Err(scene.error(issue).into());
    }
    Ok(body)
}

/// What the supports of a scene hold.
pub(super) fn held(scene: &Scene) -> Vec<Held> {
    let of = |s: &Support| {
        let group = s.group().to_owned();
        let fix = |d: &Direction| d.axis().map_or(Fix::Normal, Fix::Axis);
        s.fix.iter().map(move |d| Held { group: group.clone(), fix: fix(d) }).collect::<Vec<_>>()
    };
    scene.supports.iter().flat_map(of).collect()
}

/// Supports and obstacles as the numbering needs them.
fn numbering(scene: &Scene, form: &Form, materials: &[Material]) -> Result<DofMap, ProblemError> {
    let held = held(scene);
    let contact = scene.contact.as_ref();
    let facing = |c: &Contact, k: usize, o: &Obstacle| -> Result<Facing, ProblemError> {
        if let Some(meeting) = pairs::meeting(scene, (c, k), form, materials)? {
            return Ok(Facing::pair(meeting));
        }
        let direction = o.plane.as_ref().map(|p| {
            let size = p.scale();
            std::array::from_fn(|c| p.normal.get(c).map_or(0.0, |n| n / size))
        });
        let is_massless = c.is_massless_along() && o.coefficient().is_some();
        Ok(Facing { is_massless, ..Facing::plane(&o.group, direction) })
    };
    let facing: Vec<Facing> = match contact {
        None => vec![],
        Some(c) => {
            let all = c.obstacles.iter().enumerate();
            all.map(|(k, o)| facing(c, k, o)).collect::<Result<_, _>>()?
        }
    };
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
        let key = contact.map_or(String::new(), |c| c.side_key(k, scene.body.kind.side_key()));
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
            k => c.side_key(k.unwrap_or(0), scene.body.kind.side_key()),
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
        FrameError::TwoMasters { node } => of_contact(
            "",
            format!("{} meets two surfaces in one direction", form.node(*node)),
            "put both surfaces into one group, the master of one pair",
        ),
        FrameError::Circle { group } => of_contact(
            group,
            format!(
                "the pair of \"{group}\" refers to itself: its masters are counted against its slaves"
            ),
            "exchange slave and master of one of the pairs",
        ),
        FrameError::TooMany { node } => of_contact(
            "",
            format!(
                "the directions in which {} meets obstacles depend on each other: there are more than dimensions, or they lie in one plane",
                form.node(*node)
            ),
            "leave the sides at that node out of one of the groups",
        ),
        FrameError::PartlyHeld { node, degrees, least } => of_contact(
            "",
            format!(
                "a support holds a part of the contact displacement of {}: {degrees:.1}° lie between the two, and from {least:.0}° on the normal is turned into what is free",
                form.node(*node)
            ),
            "leave the node out of the contact group, or hold it altogether",
        ),
    }
}

fn empty(scene: &Scene, body: &Body) -> Option<Issue> {
    let with_contact =
        if scene.contact.is_some() { " besides the contact displacements" } else { "" };
    let key = match scene.body.kind {
        BodyKind::Mesh => "body.file",
        BodyKind::Parts => "body",
        _ => "body.elements",
    };
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
    let mut gap = vec![f64::INFINITY; dofs.n_facing];
    let mut behind = BTreeMap::new();
    for (k, obstacle) in c.obstacles.iter().enumerate() {
        let nodes = body.mesh.group_nodes(&obstacle.group);
        let at: Vec<(usize, usize)> =
            nodes.into_iter().filter_map(|n| Some((dofs.contact_at(k, n)?, n))).collect();
        let points: Vec<(usize, Point)> =
            at.iter().map(|&(i, n)| (i, body.mesh.nodes()[n])).collect();
        let own = match obstacle.meeting {
            Some(_) => pairs::gaps(scene, (c, k), body, &at)?,
            None => gaps_to(scene, k, points.iter().map(|p| p.1))?,
        };
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
    Ok(Contacts { gaps, lumped: c.boundary_mass == BoundaryMass::Lumped })
}
