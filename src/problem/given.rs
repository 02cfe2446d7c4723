//! Bodies whose matrices come from files.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use nalgebra::DMatrix;

use super::elements;
use super::friction::anchor;
use super::gaps::check_way;
use super::{Notes, ProblemError};
use crate::contact::Tangent;
use crate::contact::boundary::{self, BoundaryOperator};
use crate::fem::formats::{DofName, Uneven, uneven_nodes};
use crate::fem::{
    Body, ContactRows, Csr, FemError, Massless, SuperelementError, free_interface_form,
    motions_without_mass, standing_beside, with_elements,
};
use crate::matrices::{read_matrix, read_written};
use crate::scenario::{
    Contact, Counted, End, Issue, LoadKind, Obstacle, Scene, SidesKey, StressKey, Turned,
};

/// Files are named relative to the scene.
pub(super) fn folder(scene: &Scene) -> &Path {
    scene.source.file.parent().unwrap_or(Path::new(""))
}

/// Gaps of the given contact displacements of an obstacle.
fn given_gaps(scene: &Scene, obstacle: &Obstacle) -> Vec<f64> {
    let given = &obstacle.given;
    match (&given.gaps, &obstacle.gap) {
        (Some(list), _) => list.clone(),
        (None, Some(gap)) => {
            let at = |row: &usize| scene.rows.places.get(row).copied().unwrap_or_default();
            given.rows().iter().map(|row| gap.at(at(row))).collect()
        }
        (None, None) => vec![],
    }
}

/// Gaps behind given contact displacements, of those of obstacles that have one there.
pub(super) fn given_gaps_behind(
    scene: &Scene,
    front: &[f64],
) -> Result<Vec<(usize, f64)>, ProblemError> {
    let mut all = vec![];
    let mut first = 0;
    for (k, o) in obstacles(scene) {
        let own = first..first + o.given.rows().len();
        first = own.end;
        let Some(field) = &o.gap_behind else { continue };
        let gap = field.at([0.0; 3]);
        let key = contact_key(scene, k, "gap_behind");
        front[own.clone()].iter().try_for_each(|g| check_way(scene, &key, g + gap))?;
        all.extend(own.map(|d| (d, gap)));
    }
    Ok(all)
}

/// All obstacles, with their tables.
fn obstacles(scene: &Scene) -> impl Iterator<Item = (usize, &Obstacle)> {
    scene.contact.iter().flat_map(|c| c.obstacles.iter().enumerate())
}

/// The key of a table of contact.
fn contact_key(scene: &Scene, table: usize, name: &str) -> String {
    scene.contact.as_ref().map_or_else(|| format!("contact.{name}"), |c| c.key(table, name))
}

/// The tangents of given contact displacements.
pub(super) fn given_tangents(
    scene: &Scene,
    contact: &Contact,
    body: &Body,
) -> Result<Vec<Option<Tangent>>, ProblemError> {
    let n = body.dofs.n();
    let own = contact.displacements();
    let masters = obstacles(scene).flat_map(|(_, o)| rows_of(o.given.against.as_deref()));
    let masters: Vec<usize> = masters.collect();
    let tangents = contact.tangents();
    let mut all = vec![];
    for (k, obstacle) in obstacles(scene) {
        let key = contact_key(scene, k, "tangents");
        let count = obstacle.given.rows().len();
        let Some(coefficient) = obstacle.coefficient() else {
            all.extend(vec![None; count]);
            continue;
        };
        let Some(rows) = obstacle.given.tangents.as_deref() else {
            let help = match obstacle.given.by_nodes() {
                true => {
                    "tangents = [\"101.2\"]: in space the nodes leave a choice, one displacement each"
                }
                false => "tangents = [1, 3]: rows of the matrices, one a contact displacement",
            };
            return Err(fault(scene, &key, "is missing beside friction", help));
        };
        let is_wrong = |i: &usize| {
            let times = tangents.iter().filter(|other| *other == i).count();
            *i >= n || own.contains(i) || masters.contains(i) || times > 1
        };
        if rows.len() != count || rows.iter().any(is_wrong) {
            let message =
                format!("{rows:?} beside the contact displacements {:?}", obstacle.given.rows());
            let help = format!("give one row from 0 to {} for each, none twice", n - 1);
            return Err(fault(scene, &key, message, &help));
        }
        let surface = obstacle.surface.as_ref().map_or(0.0, |v| v[0]);
        let is_massless = contact.is_massless_along();
        let follows = |r: &&usize| body.dofs.terms(**r, 0).any(|t| t.0 >= body.dofs.n_o);
        if let Some(row) = rows.iter().find(follows).filter(|_| !is_massless) {
            let message = format!(
                "{row} moves with motions that have no mass, and friction is of displacements that have some"
            );
            let help = "export the body with a mass that is integrated in full, or remove friction";
            return Err(fault(scene, &key, message, help));
        }
        let taken = [&tangents[..], &own, &masters].concat();
        let against = tangents_against(scene, (k, obstacle), (count, &taken, n))?;
        for (row, masters) in rows.iter().zip(against) {
            // u_t − Σ P u_m
            let masters = masters.into_iter().map(|(m, p)| (m, -p));
            let terms = std::iter::once((*row, 1.0)).chain(masters);
            let of_row = |(i, w): (usize, f64)| body.dofs.terms(i, 0).map(move |(j, t)| (j, w * t));
            let anchor = anchor(body, scene, all.len());
            let row = if anchor.is_some() { vec![] } else { terms.flat_map(of_row).collect() };
            let direction = [0.0, 1.0, 0.0];
            let only_slips = false;
            all.push(Some(Tangent { row, anchor, coefficient, surface, direction, only_slips }));
        }
    }
    Ok(all)
}

/// What tangents are counted against: nothing before rigid obstacles.
fn tangents_against(
    scene: &Scene,
    (table, obstacle): (usize, &Obstacle),
    (count, taken, n): (usize, &[usize], usize),
) -> Result<Vec<Vec<(usize, f64)>>, ProblemError> {
    let key = &contact_key(scene, table, "tangents_against");
    match (&obstacle.given.tangents_against, &obstacle.given.against) {
        (None, None) => Ok(vec![vec![]; count]),
        (Some(_), None) => {
            let message = "belongs to contact displacements that are counted against others";
            Err(fault(scene, key, message, "give against, or remove the key"))
        }
        (None, Some(_)) => {
            let help =
                "tangents_against = [11, 13]: rows of the other body, one a contact displacement";
            Err(fault(scene, key, "is missing beside friction", help))
        }
        (Some(all), Some(_)) => counted(scene, key, all, (count, taken, n)),
    }
}

/// All rows against which others are counted.
fn rows_of(all: Option<&[Counted]>) -> Vec<usize> {
    all.unwrap_or_default().iter().flat_map(|c| &c.0).map(|term| term.0).collect()
}

/// What `count` displacements are counted against: rows of the matrices, none that is `taken`.
fn counted(
    scene: &Scene,
    key: &str,
    all: &[Counted],
    (count, taken, n): (usize, &[usize], usize),
) -> Result<Vec<Vec<(usize, f64)>>, ProblemError> {
    if all.len() != count {
        let message = format!("{} entries for {count} displacements", all.len());
        return Err(fault(scene, key, message, "give a row, or a list of [row, weight], for each"));
    }
    let terms = || all.iter().flat_map(|c| &c.0);
    if let Some((row, _)) =
        terms().find(|(row, p)| *row >= n || taken.contains(row) || !p.is_finite())
    {
        let message = format!(
            "{row} is no row of the matrices, or is a contact displacement, a tangent or what one of them is counted against"
        );
        let help = format!("give rows from 0 to {}, of the other body, and finite weights", n - 1);
        return Err(fault(scene, key, message, &help));
    }
    if let Some(k) = all.iter().position(|c| c.0.is_empty()) {
        let message = format!("entry {k} is empty");
        return Err(fault(scene, key, message, "give a row, or a list of [row, weight]"));
    }
    Ok(all.iter().map(|c| c.0.clone()).collect())
}

/// The unit of length of a body without geometry: its largest gap.
pub(super) fn given_length(scene: &Scene) -> f64 {
    let gaps = obstacles(scene).flat_map(|(_, o)| given_gaps(scene, o));
    let largest = gaps.fold(0.0f64, |m, g| m.max(g.abs()));
    if largest > 0.0 { largest } else { 1.0 }
}

/// A fault of a file, as an error that names the key.
fn fault(scene: &Scene, key: &str, message: impl Into<String>, help: &str) -> ProblemError {
    scene.error(Issue::new(key, message, help)).into()
}

/// A matrix of the scene: of its files, or given with it.
pub(super) fn read(scene: &Scene, key: &str, name: Option<&String>) -> Result<Csr, ProblemError> {
    let name = name.map_or("", String::as_str);
    if let Some(matrix) = scene.attached.get(name) {
        let (rows, columns) = matrix.shape;
        return Ok(Csr::from_triplets(rows, columns, matrix.entries.clone()));
    }
    let help = "give a file of one of the formats that `signorini inspect FILE` knows (Matrix Market, HDF5, MATLAB, .npz, Abaqus, CalculiX, Ansys, Nastran), relative to the scene";
    read_matrix(folder(scene), name).map_err(|e| fault(scene, key, e, help))
}

/// A square matrix of the scene over the rows of its stiffness: where its file names its rows it may have fewer, in another order. Rows that the scene turns are turned.
pub(super) fn square(scene: &Scene, key: &str, name: Option<&String>) -> Result<Csr, ProblemError> {
    bordered(scene, key, name).map(|all| moving_part(scene, all))
}

/// The same, and behind these rows those that supports of the scene hold.
fn bordered(scene: &Scene, key: &str, name: Option<&String>) -> Result<Csr, ProblemError> {
    let file = name.map_or("", String::as_str);
    if scene.rows.names.is_empty() || scene.attached.get(file).is_some() {
        return read(scene, key, name);
    }
    let names = &scene.rows.names;
    let help = "give a matrix of the same body";
    let written = read_written(folder(scene), file).map_err(|e| fault(scene, key, e, help))?;
    let n = names.len() + scene.rows.held_rows().count();
    let of_file = &scene.rows.of_file;
    let own = if written.names.is_empty() { of_file } else { &written.names };
    let matrix = match own.len() == written.matrix.n_rows() {
        true if own == names => written.matrix,
        false => {
            let rows = written.matrix.n_rows();
            let why = match rows == 2 * own.len() {
                true => ": cyclic symmetry of CalculiX is stored as a real pair, which is not read",
                false => "",
            };
            let message = format!("{file} has {rows} rows, and there are {} names{why}", own.len());
            let key = if scene.body.names.is_some() { "body.names" } else { key };
            return Err(fault(scene, key, message, "give the names of these matrices"));
        }
        true => {
            let held = scene.rows.held_rows().map(|(_, name)| name);
            let place: HashMap<&DofName, usize> =
                names.iter().chain(held).enumerate().map(|(k, name)| (name, k)).collect();
            let is_held = |name: &DofName| scene.rows.held.contains(name);
            let strange = own.iter().find(|name| !place.contains_key(name) && !is_held(name));
            if let Some(name) = strange {
                let message = format!("{file} has a row {name}, which the stiffness has not");
                return Err(fault(scene, key, message, help));
            }
            // what is held is no row, though it may have a mass
            let at = |k: usize| place.get(&own[k]).copied();
            let entries = written.matrix.triplets();
            let entries = entries.filter_map(|(i, j, v)| Some((at(i)?, at(j)?, v))).collect();
            Csr::from_triplets(n, n, entries)
        }
    };
    let turns = &scene.rows.turned;
    if turns.is_empty() {
        return Ok(matrix);
    }
    let of_row: HashMap<usize, &Turned> =
        turns.iter().flat_map(|t| t.rows().iter().map(move |row| (*row, t))).collect();
    let terms = |i: usize| -> Vec<(usize, f64)> {
        let turned = of_row.get(&i).and_then(|t| t.terms(i));
        turned.map_or_else(|| vec![(i, 1.0)], Iterator::collect)
    };
    let mut entries = vec![];
    for (i, j, v) in matrix.triplets() {
        let columns = terms(j);
        let of = |(a, x): (usize, f64)| columns.iter().map(move |(b, y)| (a, *b, x * y * v));
        entries.extend(terms(i).into_iter().flat_map(of));
    }
    Ok(Csr::from_triplets(n, n, entries))
}

/// Rows without mass follow statically where the contact takes nodal reactions.
fn check_followers(scene: &Scene, count: usize, n: usize) -> Result<(), ProblemError> {
    let Some(contact) = &scene.contact else { return Ok(()) };
    let what = format!("{count} of {n} rows have no mass, and follow the others statically");
    if contact.has_springs() {
        let help = "give method = \"mass-redistribution\", or stress = \"reaction\"";
        return Err(fault(
            scene,
            &contact.key(0, "method"),
            format!("{what}: not beside springs"),
            help,
        ));
    }
    if !contact.is_reaction() {
        let help = "give stress = \"reaction\", or method = \"mass-redistribution\"";
        return Err(fault(
            scene,
            &contact.key(0, "stress"),
            format!("{what}: beside nodal reactions alone"),
            help,
        ));
    }
    Ok(())
}

/// The motions of several rows that have no mass: programs that integrate the mass with few points leave them behind.
fn massless_motions(scene: &Scene, mass: &Csr) -> Result<Vec<Massless>, ProblemError> {
    let key = "body.mass_matrix";
    motions_without_mass(mass).map_err(|e| {
        let help = "give a mass that no motion has a negative share of; rows and motions without any follow statically";
        fault(scene, key, e.to_string(), help)
    })
}

/// A body and its boundary operator from files.
pub(super) fn given_body(
    scene: &Scene,
) -> Result<(Body, BoundaryOperator, Vec<f64>), ProblemError> {
    let (body, rows, gap) = given_matrices(scene, true)?;
    let operator = match scene.contact.as_ref() {
        None if rows.all().next().is_none() => BoundaryOperator::none(body.dofs.n_o),
        // rows without mass alone
        None => boundary::reaction(&body, vec![1.0; rows.all().count()]),
        Some(c) if c.is_reaction() => boundary::reaction(&body, vec![1.0; rows.all().count()]),
        Some(c) => given_operator(scene, c, &body)?,
    };
    Ok((body, operator, gap))
}

/// A body from files, the displacements that an obstacle limits, which follow from the others where they are `constrained`, and their gaps.
pub(super) fn given_matrices(
    scene: &Scene,
    constrained: bool,
) -> Result<(Body, ContactRows, Vec<f64>), ProblemError> {
    let b = &scene.body;
    if let Some(issue) = &scene.rows.missing {
        return Err(scene.error(issue.clone()).into());
    }
    let mass = bordered(scene, "body.mass_matrix", b.mass_matrix.as_ref())?;
    let stiffness = bordered(scene, "body.stiffness_matrix", b.stiffness_matrix.as_ref())?;
    let falls = scene.loads.iter().any(|l| l.kind == LoadKind::Gravity);
    let holds = scene.rows.held_rows().next().is_some() && scene.rows.superelement.is_none();
    let held = (holds || falls).then(|| [stiffness.clone(), mass.clone()]);
    let [mass, stiffness] = [mass, stiffness].map(|a| moving_part(scene, a));
    let [mass, stiffness] = as_superelement(scene, [mass, stiffness])?;
    let n = mass.n_rows();
    let (mut rows, gap) = contact_rows(scene, n)?;
    // what has no mass follows statically, as the contact does
    let own: Vec<usize> = rows.all().collect();
    let has_mass = |i: &usize| mass.row(*i).any(|e| e.1 != 0.0);
    let without: Vec<usize> = (0..n).filter(|i| !has_mass(i) && !own.contains(i)).collect();
    // of a file that lacks most of its mass something else is wrong
    let most = scene.rows.superelement.is_none() && 2 * without.len() >= n;
    if constrained && !without.is_empty() && !most {
        check_followers(scene, without.len(), n)?;
        rows.against.resize(rows.facing.len(), vec![]);
        rows.idle.extend(&without);
    }
    // so do motions of several rows
    let motions = massless_motions(scene, &mass)?;
    if !motions.is_empty() {
        if constrained {
            check_followers(scene, motions.len(), n)?;
        } else {
            let help = "give stress = \"reaction\", or method = \"mass-redistribution\"";
            let key =
                scene.contact.as_ref().map_or("body.mass_matrix".into(), |c| c.key(0, "method"));
            let message = format!(
                "{} motions of the body have no mass, and follow statically: not beside displacements at the contact that move by themselves",
                motions.len()
            );
            return Err(fault(scene, &key, message, help));
        }
        rows.against.resize(rows.facing.len(), vec![]);
        let tangents = scene.contact.as_ref().map_or(vec![], Contact::tangents);
        rows.massless = standing_beside(motions, &[own.clone(), tangents].concat());
        let standing = rows.massless.iter().map(|m| m.pivot).filter(|p| !own.contains(p));
        rows.idle.extend(standing);
    }
    if constrained && rows.all().count() >= n {
        let message = "leaves no motion of the body that has inertia: all follow statically";
        let help = "give the mass of more displacements, or fewer contact displacements";
        return Err(fault(scene, "body.mass_matrix", message, help));
    }
    let of_contact = if constrained { rows.clone() } else { ContactRows::default() };
    // contact displacements that follow the others need no mass
    let massless = of_contact.all().filter(|i| !has_mass(i)).count();
    check_symmetric(scene, "body.mass_matrix", (&mass, massless), n, mass.n_cols())?;
    check_symmetric(scene, "body.stiffness_matrix", (&stiffness, 0), n, mass.n_cols())?;
    let discrete = elements::of_matrices(scene, n)?;
    let mass = with_elements(mass, &discrete, |e| e.mass);
    let stiffness = with_elements(stiffness, &discrete, |e| e.stiffness);
    if constrained {
        check_stillness(scene, (&mass, &stiffness), &own)?;
    }
    let length = given_length(scene);
    let body = Body::from_matrices(&mass, &stiffness, &of_contact, length).map_err(|e| {
        let of_mass = matches!(&e, FemError::NotPositiveDefinite { what } if what.contains("mass"));
        let key = if of_mass { "body.mass_matrix" } else { "body.stiffness_matrix" };
        let help = match of_mass {
            true => "give a mass that no motion has a negative share of; rows and motions without any follow statically",
            false => "give a stiffness that opposes some motion",
        };
        fault(scene, key, e.to_string(), help)
    })?;
    let body = match held {
        Some([stiffness, mass]) => {
            let mass = with_elements(mass, &discrete, |e| e.mass);
            body.with_held_rows([stiffness, mass], length)
        }
        None => body,
    };
    let body = if falls { body.with_translations(scene.rows.translations()) } else { body };
    let elastic = scene.all_sliders().iter().filter(|s| s.stiffness.is_some()).count();
    Ok((body.with_memory(rows.tangents.len()).with_memory(elastic), rows, gap))
}

/// Of a matrix over rows that move and those that supports hold what moves.
fn moving_part(scene: &Scene, all: Csr) -> Csr {
    let count = scene.rows.held_rows().count();
    if count == 0 {
        return all;
    }
    let n = all.n_rows().saturating_sub(count);
    Csr::from_triplets(n, n, all.triplets().filter(|e| e.0 < n && e.1 < n).collect())
}

/// Matrices in free-interface form, where the scene asks for it.
fn as_superelement(scene: &Scene, [mass, stiffness]: [Csr; 2]) -> Result<[Csr; 2], ProblemError> {
    let Some(kept) = &scene.rows.superelement else { return Ok([mass, stiffness]) };
    let n = mass.n_rows();
    check_symmetric(scene, "body.mass_matrix", (&mass, 0), n, mass.n_cols())?;
    check_symmetric(scene, "body.stiffness_matrix", (&stiffness, 0), n, mass.n_cols())?;
    if let Some(row) = kept.rows.iter().find(|row| **row >= n) {
        let message = format!("keeps row {row}, which the scene names, and the matrices have {n}");
        return Err(fault(scene, "reduction", message, "give rows from 0 on"));
    }
    if kept.modes >= n {
        let message = format!("{} of matrices that have {n} rows", kept.modes);
        return Err(fault(scene, "reduction.modes", message, "give fewer"));
    }
    free_interface_form(&mass, &stiffness, &kept.rows, kept.modes).map_err(|e| {
        let help = match &e {
            SuperelementError::Stiff { .. } => {
                "give fewer modes; or export the superelement with more modes, or with the neighbours of its contact nodes"
            }
            SuperelementError::Fem(FemError::NotPositiveDefinite { what }) if what.contains("mass") => {
                "give a mass that no motion lacks"
            }
            SuperelementError::Fem(_) => "give matrices of a body that its supports hold",
        };
        fault(scene, "reduction", e.to_string(), help)
    })
}

/// Contact displacements whose stiffness leads to nothing with mass, be it through others without any: the static modes of a superelement with fixed-interface modes.
fn check_stillness(
    scene: &Scene,
    (mass, stiffness): (&Csr, &Csr),
    own: &[usize],
) -> Result<(), ProblemError> {
    let size = |i: usize| stiffness.entry(i, i).map_or(0.0, |k| k.abs().sqrt());
    let mut known = vec![false; mass.n_rows()];
    own.iter().for_each(|&i| known[i] = true);
    let mut open = own.to_vec();
    while let Some(i) = open.pop() {
        for (j, k) in stiffness.row(i) {
            if known[j] || k.abs() <= STILL * size(i) * size(j) {
                continue;
            }
            if mass.row(j).any(|e| e.1 != 0.0) {
                return Ok(());
            }
            known[j] = true;
            open.push(j);
        }
    }
    if own.is_empty() {
        return Ok(());
    }
    let message = "stand still while they are open: their stiffness ties them to nothing that has mass, as in a superelement with fixed-interface modes (Craig and Bampton)";
    let help = "[reduction] with kind = \"free-interface\" and modes = 12: fewer than the superelement has";
    let by_nodes = scene.contact.as_ref().is_some_and(Contact::by_nodes);
    let key = contact_key(scene, 0, if by_nodes { "nodes" } else { "displacements" });
    Err(fault(scene, &key, message, help))
}

/// A coupling below this, over the roots of both stiffnesses, is rounding.
const STILL: f64 = 1e-9;

/// Nodes that the scene names and whose directions have different masses.
pub(super) fn note(scene: &Scene, body: &Body, notes: &mut Notes) {
    let names = &scene.rows.names;
    if names.is_empty() || scene.rows.superelement.is_some() {
        return;
    }
    let at = |row: usize| body.mass.entry(body.dofs.row(row), body.dofs.row(row));
    let mut diagonal: Vec<f64> =
        (0..names.len()).map(|row| at(row).copied().unwrap_or(0.0)).collect();
    let held: Vec<&DofName> = scene.rows.held_rows().map(|(_, name)| name).collect();
    diagonal.extend(body.held_masses());
    let all: Vec<DofName> = names.iter().chain(held.iter().copied()).cloned().collect();
    let mut uneven = uneven_nodes(&all, &diagonal);
    let named: BTreeSet<&str> = scene
        .named_rows()
        .into_iter()
        // rows that the matrices do not have are refused where they are read
        .filter_map(|(_, row)| Some(&names.get(row)?.node[..]))
        .chain(held.iter().map(|name| &name.node[..]))
        .collect();
    // point masses of the scene act along one direction
    let ends = scene.masses.iter().flat_map(|m| [Some(m.ends().from), m.ends().to]);
    let rows = ends.filter_map(|end| if let Some(End::Row(row)) = end { Some(row) } else { None });
    let loaded: Vec<&DofName> = rows.filter_map(|row| names.get(row)).collect();
    uneven.retain(|u| named.contains(&u.node[..]) && loaded.iter().all(|name| name.node != u.node));
    if !uneven.is_empty() {
        notes.warnings.push(uneven_text(&uneven));
    }
}

/// What there is to say of such nodes.
pub fn uneven_text(uneven: &[Uneven]) -> String {
    let first = &uneven[0];
    let others = match uneven.len() - 1 {
        0 => String::new(),
        count => format!(" (and {count} others)"),
    };
    let [more, less] = first.directions;
    format!(
        "node {}{others} has {:.3} times the mass in direction {more} that it has in {less}: its rows move other displacements along, as constraints of its program leave them (equations, rollers along no axis); \
         let contact, loads and supports name other nodes",
        first.node, first.ratio
    )
}

/// Square, of `n` rows as the mass matrix, symmetric, with a diagonal.
fn check_symmetric(
    scene: &Scene,
    key: &str,
    (a, without): (&Csr, usize),
    n: usize,
    columns: usize,
) -> Result<(), ProblemError> {
    if a.n_entries() + without < a.n_rows() {
        let (entries, rows) = (a.n_entries(), a.n_rows());
        let message = format!(
            "{entries} entries in {rows} rows: a positive definite matrix has one on every diagonal"
        );
        return Err(fault(scene, key, message, "give positive definite matrices"));
    }
    if (a.n_rows(), a.n_cols()) != (n, n) {
        let (rows, own) = (a.n_rows(), a.n_cols());
        let message = format!("is {rows} × {own}, and the mass matrix {n} × {columns}");
        return Err(fault(scene, key, message, "give square matrices of one size"));
    }
    let largest = |a: &Csr| a.triplets().fold(0.0f64, |m, e| m.max(e.2.abs()));
    let transposed = Csr::from_triplets(n, n, a.triplets().map(|(i, j, v)| (j, i, v)).collect());
    let skew = largest(&Csr::combination(1.0, a, -1.0, &transposed));
    if skew > 1e-10 * largest(a) {
        let message = format!("is not symmetric: entries differ by {skew:.1e}");
        return Err(fault(scene, key, message, "give a symmetric matrix"));
    }
    Ok(())
}

/// The contact displacements and their gaps.
fn contact_rows(scene: &Scene, n: usize) -> Result<(ContactRows, Vec<f64>), ProblemError> {
    let Some(contact) = &scene.contact else { return Ok((ContactRows::default(), vec![])) };
    let all = contact.displacements();
    let mut rows = ContactRows::default();
    let mut gaps = vec![];
    for (k, o) in obstacles(scene) {
        let key = |name: &str| contact.key(k, name);
        let own = o.given.rows();
        let twice =
            (0..own.len()).find(|i| own[..*i].contains(&own[*i]) || rows.facing.contains(&own[*i]));
        if let Some(i) = twice {
            let message = format!("{} stands there twice", scene.rows.label(own[i]));
            let help = "one displacement meets one obstacle in front; gap_behind is one behind";
            return Err(fault(scene, &key(o.given.key()), message, help));
        }
        if let Some(bad) = own.iter().find(|row| **row >= n) {
            let message = format!("{bad} is no row of the matrices");
            let help = format!("give rows from 0 to {}", n - 1);
            return Err(fault(scene, &key(o.given.key()), message, &help));
        }
        let gap = given_gaps(scene, o);
        let fail = |name: &str, message: String| {
            Err(fault(scene, &key(name), message, "give one finite number each"))
        };
        match gap.iter().zip(own).find(|(g, _)| !g.is_finite()) {
            Some((g, row)) if o.gap.is_some() => {
                return fail("gap", format!("is {g} at {}", scene.rows.label(*row)));
            }
            None if gap.len() == own.len() => {}
            _ => {
                let (gaps, rows) = (gap.len(), own.len());
                return fail("gaps", format!("{gaps} gaps for {rows} contact displacements"));
            }
        }
        gaps.extend(gap);
        rows.facing.extend(own);
        rows.groups.extend(own.iter().map(|_| k));
        rows.against.extend(match &o.given.against {
            Some(against) => counted(scene, &key("against"), against, (own.len(), &all, n))?,
            None => vec![vec![]; own.len()],
        });
    }
    if contact.sides.unwrap_or_default() == SidesKey::Both {
        rows.idle.extend(rows.against.iter().flatten().map(|m| m.0));
        rows.idle.sort_unstable();
        rows.idle.dedup();
    }
    if contact.is_massless_along() {
        // not beside masters: these are refused
        let mut point = 0;
        for (_, o) in obstacles(scene) {
            let rough = o.given.tangents.iter().flatten().filter(|_| o.coefficient().is_some());
            rows.tangents.extend(rough.copied().zip(point..));
            point += o.given.rows().len();
        }
        rows.idle = rows.tangents.iter().map(|t| t.0).collect();
    }
    Ok((rows, gaps))
}

/// `N_C`, `N_O` from the terms of the contact stresses, or from files.
fn given_operator(
    scene: &Scene,
    contact: &Contact,
    body: &Body,
) -> Result<BoundaryOperator, ProblemError> {
    let (n_o, n_c) = (body.dofs.n_o, body.dofs.n_c);
    let mut dense = DMatrix::zeros(n_c, n_c);
    if let Some(StressKey::Terms(stress)) = &contact.stress {
        if stress.len() != n_c || stress.iter().flatten().any(|(i, _)| *i >= body.dofs.n()) {
            let message =
                "needs one list of [displacement, coefficient] for each contact displacement";
            let help = "stress = [[[66, 10.0], [62, -10.0]]]";
            return Err(fault(scene, "contact.stress", message, help));
        }
        let mut rest = vec![];
        for (k, &(row, v)) in
            stress.iter().enumerate().flat_map(|(k, terms)| terms.iter().map(move |t| (k, t)))
        {
            match body.dofs.row(row) {
                p if p < n_o => rest.push((k, p, v)),
                p => dense[(k, p - n_o)] += v,
            }
        }
        let n_o = Csr::from_triplets(n_c, n_o, rest);
        return Ok(BoundaryOperator { n_c: dense.into(), n_o, area: vec![1.0; n_c] });
    }
    let of_c = read(scene, "contact.n_c", contact.n_c.as_ref())?;
    let of_o = read(scene, "contact.n_o", contact.n_o.as_ref())?;
    for (key, a, wanted) in [("contact.n_c", &of_c, n_c), ("contact.n_o", &of_o, n_o)] {
        if (a.n_rows(), a.n_cols()) != (n_c, wanted) {
            let message = format!("is {} × {}", a.n_rows(), a.n_cols());
            return Err(fault(scene, key, message, &format!("give a {n_c} × {wanted} matrix")));
        }
    }
    Ok(BoundaryOperator { n_c: of_c.into(), n_o: of_o, area: vec![1.0; n_c] })
}
