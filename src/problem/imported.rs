//! Bodies whose mesh comes from a file: what the scene names in it, and what does not work on it.

use std::path::Path;

use super::ProblemError;
use super::form::Form;
use super::given::folder;
use super::materials::{body_key, generated};
use crate::fem::{DofMap, Facing, Shape, shape};
use crate::mesh::gmsh::{self, File, Imported, Sides};
use crate::mesh::vtu;
use crate::mesh::{Block, ElementKind, Facet, Family, Mesh};
use crate::mesh::{bulk, deck};
use crate::scenario::{Body, ContactMethod, Issue, MassKind, Scene, State, StressKey, Whole};

/// A mesh of Gmsh, a deck of Abaqus or CalculiX, bulk data of Nastran, or a file of VTK.
pub fn read(bytes: &[u8]) -> Result<File, gmsh::GmshError> {
    match bytes {
        deck if deck::is_deck(deck) => deck::read(deck),
        vtk if vtu::is_vtk(vtk) => vtu::read(vtk),
        bulk if bulk::is_bulk(bulk) => bulk::read(bulk),
        other => gmsh::read(other),
    }
}

/// The same from a file, a deck with what it includes; of what goes wrong the message, and what helps where that is known.
pub fn read_file(path: &Path) -> Result<File, (String, Option<String>)> {
    let whole = Whole::read(path)?;
    read(&whole.bytes).map_err(|e| (whole.place(&e) + &e.message, Some(e.help)))
}

/// The mesh of the file of a body, its regions numbered as the materials of the scene, and the tags of its nodes.
pub(super) fn body(
    scene: &Scene,
    (key, body): (&str, &Body),
) -> Result<(Mesh, Vec<i64>), ProblemError> {
    let path = folder(scene).join(body.file.as_deref().unwrap_or("".as_ref()));
    let fault = |message: String, help: String| -> ProblemError {
        let message = format!("{}: {message}", path.display());
        scene.error(Issue::new(format!("{key}.file"), message, help)).into()
    };
    let of_gmsh = |e: gmsh::GmshError| fault(e.place() + &e.message, e.help.clone());
    let file = read_file(&path).map_err(|(message, help)| {
        let kinds = "give a mesh of Gmsh, a deck (.inp), bulk data (.bdf) or a file of VTK (.vtu), relative to the scene";
        fault(message, help.unwrap_or_else(|| kinds.to_owned()))
    })?;
    let named = |word: &str| Some(file.named(file.dim() - 1, scene.within(body, word)?));
    let pairs = scene.contact.iter().flat_map(|c| &c.obstacles);
    let pairs = pairs.filter_map(|o| Some([named(&o.group)?, named(&o.meeting.as_ref()?.master)?]));
    let pairs: Vec<[String; 2]> = pairs.collect();
    let imported = file.body(body.scale.unwrap_or(1.0), &pairs).map_err(of_gmsh)?;
    check_state(scene, (key, body), imported.mesh.dim())?;
    let regions = materials(scene, body, &file, &imported)?;
    let sides = sides(scene, body, &file, &imported)?;
    let mesh = imported.mesh.with_regions(&regions).with_groups(sides);
    if body.state == Some(State::Axisymmetric)
        && let Some(n) = mesh.nodes().iter().position(|p| p[0] < 0.0)
    {
        let tag = imported.node_tags[n];
        let message = format!("node {tag} has the radius {}", mesh.nodes()[n][0]);
        return Err(fault(message, "give x ≥ 0: x is the radius, y the axis".to_owned()));
    }
    Ok((mesh, imported.node_tags))
}

/// A body in the plane has a state, one in space has none.
fn check_state(scene: &Scene, (key, body): (&str, &Body), dim: usize) -> Result<(), ProblemError> {
    let issue = |message: &str, help: &str| {
        Err(scene.error(Issue::new(format!("{key}.state"), message, help)).into())
    };
    match (dim, body.state) {
        (2, None) => issue(
            "is missing: the mesh lies in the plane",
            "state = \"plane stress\", \"plane strain\" or \"axisymmetric\"",
        ),
        (3, Some(_)) => {
            issue("belongs to a body in the plane, and the mesh is one in space", "remove the key")
        }
        _ => Ok(()),
    }
}

/// The groups of one dimension in words.
fn known(file: &File, dim: usize) -> String {
    let is_cells = dim == file.dim();
    let word = |(d, tag, name, n): (usize, i64, String, usize)| {
        let unit = if is_cells { "cells" } else { "sides" };
        (d == dim).then(|| format!("\"{name}\" (#{tag}, {n} {unit})"))
    };
    let all: Vec<String> = file.groups().into_iter().filter_map(word).collect();
    let kind = ["Point", "Curve", "Surface", "Volume"][dim.min(3)];
    match (all.is_empty(), is_cells) {
        (true, false) => {
            let what = if dim == 1 { "lines" } else { "faces" };
            format!("the file has no groups of {what}: add Physical {kind} in Gmsh")
        }
        (true, true) => format!("the file has no groups of cells: add Physical {kind} in Gmsh"),
        (false, _) => format!("the file has {}", all.join(", ")),
    }
}

/// The material of each region of a body: each has exactly one.
fn materials(
    scene: &Scene,
    body: &Body,
    file: &File,
    imported: &Imported,
) -> Result<Vec<usize>, ProblemError> {
    let fail = |i: usize, message: String, help: String| -> ProblemError {
        scene.error(Issue::new(format!("material[{i}].group"), message, help)).into()
    };
    // the tables of this body by their numbers, with the groups that they name
    let mut wanted: Vec<(usize, Option<String>)> = vec![];
    for (i, m) in scene.materials.iter().enumerate() {
        let Some((_, word)) = scene.owner(m).filter(|o| o.0.name == body.name) else { continue };
        let name = word.map(|word| (file.named(file.dim(), word), word));
        if let Some((name, word)) = &name
            && !imported.regions.iter().any(|r| r.contains(name))
        {
            let message = format!("the mesh has no group of cells \"{word}\"");
            return Err(fail(i, message, known(file, file.dim())));
        }
        wanted.push((i, name.map(|n| n.0)));
    }
    let first = generated(scene);
    let cells = |region: usize| -> usize {
        imported.mesh.elements().filter(|e| e.region == region).count()
    };
    let of_region = |(r, names): (usize, &Vec<String>)| {
        let own = |w: &&(usize, Option<String>)| w.1.as_ref().is_none_or(|w| names.contains(w));
        let found: Vec<usize> = wanted.iter().filter(own).map(|w| w.0).collect();
        let called = match names.is_empty() {
            true => "no physical group".to_owned(),
            false => format!("the group \"{}\"", names.join("\", \"")),
        };
        match found[..] {
            [one] => Ok(first + one),
            [] => {
                let message = format!("{} cells of {called} have no material", cells(r));
                let help = format!("add a [[material]] for them; {}", known(file, file.dim()));
                Err(fail(wanted.last().map_or(0, |w| w.0), message, help))
            }
            [first, second, ..] => {
                let count = cells(r);
                let message =
                    format!("{count} cells of {called} have this material and material[{first}]");
                Err(fail(second, message, "give every cell one material".to_owned()))
            }
        }
    };
    imported.regions.iter().enumerate().map(of_region).collect()
}

/// All groups of sides of a body that the scene names, under the names it uses there.
fn sides(
    scene: &Scene,
    body: &Body,
    file: &File,
    imported: &Imported,
) -> Result<Vec<(String, Vec<Facet>)>, ProblemError> {
    let mut found = vec![];
    let named = scene.named_sides();
    let own = named.into_iter().filter_map(|(key, word)| Some((key, scene.within(body, word)?)));
    for (key, word) in own {
        let fail = |message: String, help: String| -> ProblemError {
            scene.error(Issue::new(key.clone(), message, help)).into()
        };
        let of_sides = file.dim() - 1;
        match imported.sides.get(&file.named(of_sides, word)) {
            Some(Sides::Boundary(facets)) if !facets.is_empty() => {
                found.push((word.to_owned(), imported.mesh.in_chains(facets)));
            }
            Some(Sides::Elsewhere { nodes, owners }) => {
                let tags: Vec<String> = nodes.iter().map(i64::to_string).collect();
                let whose = match owners {
                    0 => "no cell has it",
                    _ => "two cells have it",
                };
                let message = format!(
                    "\"{word}\" is not on the boundary of the body: its side of the nodes {} is inside, {whose}",
                    tags.join(", ")
                );
                return Err(fail(message, "name a group of sides of the boundary".to_owned()));
            }
            _ => {
                let of_cells =
                    imported.regions.iter().flatten().any(|n| *n == file.named(file.dim(), word));
                let message = match of_cells {
                    true => format!("\"{word}\" is a group of cells, and sides are wanted"),
                    false => format!("the mesh has no group of sides \"{word}\""),
                };
                return Err(fail(message, known(file, of_sides)));
            }
        }
    }
    Ok(found)
}

/// What does not work with the elements of a mesh.
pub(super) fn check_elements(
    scene: &Scene,
    form: &Form,
    dofs: &DofMap,
) -> Result<(), ProblemError> {
    if !scene.body.kind.has_groups() {
        return Ok(());
    }
    let fail = |key: String, message: String, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    let mesh = &form.mesh;
    // curved sides may fold an element whose corners are in order
    for e in mesh.elements().filter(|e| e.kind.is_quadratic()) {
        let x = mesh.corners(e);
        let shape = Shape { kind: e.kind, x: &x };
        let worst = shape::places(e.kind).iter().map(|&p| shape.determinant(p));
        let least = worst.fold(f64::INFINITY, f64::min);
        if least <= 0.0 || least.is_nan() {
            let message = format!(
                "the cell at {} is folded: det J = {least:.3e} at one of its nodes",
                form.node(e.nodes[0])
            );
            let help = "mesh finer there, or with straight sides (Mesh.SecondOrderLinear = 1)";
            return fail(body_key(scene, e.region) + ".file", message, help);
        }
    }
    // Simpson's rule gives nodes on the axis of a ring nothing
    let has_simpson = |k: ElementKind| {
        matches!(k, ElementKind::Quad9 | ElementKind::Hex27)
            && scene.body.state != Some(State::Axisymmetric)
    };
    let massless = |b: &&Block| b.kind.is_quadratic() && !has_simpson(b.kind);
    let massless = mesh.blocks().iter().find(massless);
    if let Some(block) = massless.filter(|_| scene.body.mass == MassKind::Lumped) {
        let kind = block.kind.name();
        let (message, help) = match block.kind {
            // of a ring
            ElementKind::Quad9 => (
                format!("\"lumped\" gives nodes on the axis no mass (axisymmetric, {kind})"),
                "give mass = \"scaled-diagonal\" or \"consistent\", or mesh with elements of first order",
            ),
            _ => (
                format!(
                    "\"lumped\" gives nodes of second-order elements ({kind}) no mass, or a negative one"
                ),
                "give mass = \"scaled-diagonal\" or \"consistent\", or mesh with elements of first order, \
                 quadrilaterals of nine nodes or hexahedra of 27",
            ),
        };
        return fail(body_key(scene, block.region) + ".mass", message, help);
    }
    if scene.body.state == Some(State::Axisymmetric) {
        let size = mesh.length();
        let free =
            |n: &usize| mesh.nodes()[*n][0] <= 1e-12 * size && dofs.terms(*n, 0).next().is_some();
        if let Some(n) = (0..mesh.n_nodes()).find(free) {
            let message = format!("{} lies on the axis and may move off it", form.node(n));
            let help = "add [[support]] with the group of the axis and fix = [\"x\"]";
            return fail("support".to_owned(), message, help);
        }
    }
    let Some(c) = &scene.contact else { return Ok(()) };
    let on = |is_so: &dyn Fn(Facet, ElementKind) -> bool| {
        let own = |f: &Facing| mesh.group(&f.group).iter().any(|&s| is_so(s, mesh.element(s).kind));
        // a force at one node has the sign of its contact on any side
        let any = |f: &Facing| mesh.chosen(&f.group).is_none() && own(f);
        dofs.facing.iter().position(any)
    };
    let projects =
        c.method == ContactMethod::NodalBoundary && c.stress == Some(StressKey::Projection);
    let of_one = |s: Facet, family: Family| mesh.element(s).kind.family() == family;
    let projectless = |s: Facet, _: ElementKind| !of_one(s, Family::Cube);
    if let Some(k) = on(&projectless).filter(|_| projects) {
        let is_prism = |s: &Facet| of_one(*s, Family::Prism);
        let name = match mesh.group(&dofs.facing[k].group).iter().any(is_prism) {
            true => "prisms",
            false if mesh.dim() == 3 => "tetrahedra",
            false => "triangles",
        };
        let message = format!(
            "\"projection\" does not work on {name}: the projected stress has fewer values than there are contact nodes"
        );
        let help = "give stress = \"nodal-mean\" (the default) or \"reaction\"";
        return fail(c.key(k, "stress"), message, help);
    }
    // nodal forces of a uniform pressure: all positive, or their signs say nothing of the contact
    let bears_no_signs =
        |s: Facet, kind: ElementKind| kind.dim() == 3 && !shape::bears(kind, s.side);
    let by_forces =
        c.is_reaction() || matches!(c.method, ContactMethod::Impact | ContactMethod::MoreauJean);
    if let Some(k) = on(&bears_no_signs).filter(|_| by_forces) {
        let kinds = mesh.group(&dofs.facing[k].group).iter().map(|&s| (s, mesh.element(s).kind));
        let found = kinds.into_iter().find(|(s, kind)| bears_no_signs(*s, *kind));
        let name = found.map_or_else(String::new, |(s, kind)| match kind.family() {
            Family::Prism => {
                format!("{} {}", kind.face(s.side).map_or("", |f| f.name()), kind.name())
            }
            _ => kind.name().to_owned(),
        });
        let message = format!(
            "contact forces at nodes do not work on {name} faces: a uniform pressure has zero or tensile corner forces"
        );
        let (named, help) = match c.stress == Some(StressKey::Reaction) {
            true => {
                ("stress", "give stress = \"nodal-mean\", or mesh with Hex27, Hex8, Tet4 or Prism6")
            }
            false => ("method", "give method = \"nbm\", or mesh with Hex27, Hex8, Tet4 or Prism6"),
        };
        return fail(c.key(k, named), message, help);
    }
    Ok(())
}
