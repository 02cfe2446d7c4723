//! Bodies of elements, their contact edge and the discretisation of the contact.

use super::ProblemError;
use super::given::{folder, given_length};
use crate::contact::{ContactEdge, MassChoice, Stress};
use crate::fem::{Body, DofMap, Material, read_matrix, stress};
use crate::mesh::{Mesh, Point, structured};
use crate::scenario::{
    Axis, BodyKind, ContactMethod, Edge, Field, Inertia, Issue, MassKind, RedistributedMass, Scene,
    StressKey,
};

/// Stress and mass of the contact method that a scene names.
pub(super) fn discretisation(scene: &Scene) -> (Stress, MassChoice) {
    let Some(c) = &scene.contact else { return (Stress::Projection, MassChoice::Paper) };
    let stress = match c.stress {
        _ if c.is_reaction() => Stress::Reaction,
        Some(StressKey::NodalMean) => Stress::NodalMean,
        _ => Stress::Projection,
    };
    let mass = match (c.method, c.inertia, c.mass) {
        (ContactMethod::MassRedistribution, _, Some(RedistributedMass::Optimal)) => {
            MassChoice::Optimal
        }
        (ContactMethod::MassRedistribution, ..) | (_, Some(Inertia::Constant), _) => {
            MassChoice::Condensed
        }
        _ => MassChoice::Paper,
    };
    (stress, mass)
}

/// The mesh of a scene.
pub fn mesh(scene: &Scene) -> Mesh {
    let b = &scene.body;
    match b.kind {
        BodyKind::Bar => structured::bar(b.size[0], b.elements[0]),
        BodyKind::Plate => {
            structured::rectangle(b.size[0], b.size[1], b.elements[0], b.elements[1])
        }
        BodyKind::Matrices => {
            // as many points as displacements; the files are read when the problem is set up
            let folder = folder(scene);
            let rows = b.mass_matrix.as_ref().and_then(|name| read_matrix(folder, name).ok());
            structured::row(given_length(scene), rows.map_or(1, |m| m.n_rows()))
        }
    }
}

pub(super) fn assemble(scene: &Scene) -> Body {
    let b = &scene.body;
    let material = stress::material(b).unwrap_or(Material::bar(1.0, 1.0, 1.0));
    let mesh = mesh(scene);
    let fixed: Vec<_> = scene
        .supports
        .iter()
        .flat_map(|s| s.fix.iter().map(|&axis| (s.edge, usize::from(axis == Axis::Y))))
        .collect();
    let contact = scene.contact.as_ref();
    let dofs = match contact.and_then(|c| c.edge.filter(|_| c.moves_contact())) {
        Some(edge) => DofMap::beside(&mesh, &fixed, edge),
        None => DofMap::new(&mesh, &fixed, contact.and_then(|c| c.edge)),
    };
    Body::assemble(mesh, dofs, &[material], b.mass == MassKind::Lumped)
}

pub(super) fn empty(scene: &Scene, body: &Body) -> Option<Issue> {
    let with_contact =
        if scene.contact.is_some() { " besides the contact displacements" } else { "" };
    (body.dofs.n_o == 0).then(|| {
        Issue::new(
            "body.elements",
            format!("no displacement is left free{with_contact}"),
            "use more elements or fewer supports",
        )
    })
}

pub(super) fn contact_edge(
    scene: &Scene,
    body: &Body,
) -> Result<Option<ContactEdge>, ProblemError> {
    let Some(c) = &scene.contact else { return Ok(None) };
    let (Some(edge), Some(field)) = (c.edge, c.gap.as_ref()) else { return Ok(None) };
    check_edge_moves(scene, body, edge)?;
    let places = body.dofs.contact_nodes.iter().map(|&n| body.mesh.nodes()[n]);
    let gap = gaps_at(scene, "contact.gap", field, places)?;
    Ok(Some(ContactEdge { edge, gap, lumped: c.boundary_mass == MassKind::Lumped }))
}

/// Some node of the edge can move along the normal.
pub(super) fn check_edge_moves(scene: &Scene, body: &Body, edge: Edge) -> Result<(), ProblemError> {
    if !body.dofs.contact_nodes.is_empty() {
        return Ok(());
    }
    let axis = ["x", "y"][edge.axis()];
    let message =
        format!("all {axis} displacements of the edge \"{}\" are prescribed", edge.name());
    let help = "choose another edge, or free it in [[support]]";
    Err(scene.error(Issue::new("contact.edge", message, help)).into())
}

/// A gap at places of the edge.
pub(super) fn gaps_at(
    scene: &Scene,
    key: &str,
    field: &Field,
    places: impl Iterator<Item = Point> + Clone,
) -> Result<Vec<f64>, ProblemError> {
    let gap: Vec<f64> = places.clone().map(|p| field.at(plane(p))).collect();
    // squares of gaps must not overflow
    let wrong = gap.iter().zip(places).find(|(g, _)| g.is_nan() || g.abs() > 1e60);
    if let Some((gap, [x, y, _])) = wrong {
        let message = format!("is {gap:e} at ({x}, {y})");
        let help = "give an expression of at most 1e60 on the whole edge";
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    Ok(gap)
}

/// A place in the plane of the expressions of a scene.
pub(super) fn plane([x, y, _]: Point) -> [f64; 2] {
    [x, y]
}
