//! Bodies whose matrices come from files.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::DMatrix;

use super::ProblemError;
use super::elements;
use super::friction::anchor;
use super::gaps::check_way;
use crate::contact::Tangent;
use crate::contact::boundary::{self, BoundaryOperator};
use crate::fem::formats::DofName;
use crate::fem::{
    Body, ContactRows, Csr, FemError, Massless, SuperelementError, free_interface_form,
    motions_without_mass, standing_beside, with_elements,
};
use crate::matrices::{read_matrix, read_written};
use crate::scenario::{Contact, Counted, Issue, Obstacle, Scene, SidesKey, StressKey};

/// Files are named relative to the scene.
pub(super) fn folder(scene: &Scene) -> &Path {
    scene.source.file.parent().unwrap_or(Path::new(""))
}

/// Gaps of given contact displacements.
pub(super) fn given_gaps(scene: &Scene, count: usize) -> Vec<f64> {
    let Some(c) = &scene.contact else { return vec![] };
    match (&c.gaps, c.gap()) {
        (Some(list), _) => list.clone(),
        (None, Some(gap)) => {
            let rows = c.displacements.as_deref().unwrap_or_default();
            let at = |k: usize| rows.get(k).and_then(|row| scene.rows.places.get(row));
            (0..count).map(|k| gap.at(at(k).copied().unwrap_or_default())).collect()
        }
        (None, None) => vec![],
    }
}

/// Gaps behind given contact displacements, if the scene has an obstacle there.
pub(super) fn given_gaps_behind(
    scene: &Scene,
    front: &[f64],
) -> Result<Vec<(usize, f64)>, ProblemError> {
    let contact = scene.contact.as_ref();
    let obstacle = contact.and_then(|c| c.obstacles.first());
    let Some(field) = obstacle.and_then(|o| o.gap_behind.as_ref()) else { return Ok(vec![]) };
    let gap = field.at([0.0; 3]);
    front.iter().try_for_each(|g| check_way(scene, "contact.gap_behind", g + gap))?;
    Ok((0..front.len()).map(|d| (d, gap)).collect())
}

/// The tangents of given contact displacements.
pub(super) fn given_tangents(
    scene: &Scene,
    contact: &Contact,
    body: &Body,
) -> Result<Vec<Option<Tangent>>, ProblemError> {
    let n = body.dofs.n();
    let own = contact.displacements.as_deref().unwrap_or_default();
    let Some(rows) = contact.tangents.as_deref() else {
        let help = "tangents = [1, 3]: rows of the matrices, one a contact displacement";
        return Err(fault(scene, "contact.tangents", "is missing beside friction", help));
    };
    let masters = rows_of(contact.against.as_deref());
    let is_wrong = |(k, i): (usize, &usize)| {
        *i >= n || own.contains(i) || masters.contains(i) || rows[..k].contains(i)
    };
    if rows.len() != own.len() || rows.iter().enumerate().any(is_wrong) {
        let message = format!("{rows:?} beside the contact displacements {own:?}");
        let help = format!("give one row from 0 to {} for each, none twice", n - 1);
        return Err(fault(scene, "contact.tangents", message, &help));
    }
    let obstacle = contact.obstacles.first();
    let coefficient = obstacle.and_then(Obstacle::coefficient);
    let surface = obstacle.and_then(|o| o.surface.as_ref()).map_or(0.0, |v| v[0]);
    let is_massless = contact.is_massless_along();
    let follows = |r: &&usize| body.dofs.terms(**r, 0).any(|t| t.0 >= body.dofs.n_o);
    if let Some(row) = rows.iter().find(follows).filter(|_| !is_massless) {
        let message = format!(
            "{row} moves with motions that have no mass, and friction is of displacements that have some"
        );
        let help = "export the body with a mass that is integrated in full, or remove friction";
        return Err(fault(scene, "contact.tangents", message, help));
    }
    let taken = [rows, own, &masters].concat();
    let against = tangents_against(scene, contact, (rows.len(), &taken, n))?;
    let tangent = |point: usize| {
        // u_t − Σ P u_m
        let masters = against[point].iter().map(|&(m, p)| (m, -p));
        let all = std::iter::once((rows[point], 1.0)).chain(masters);
        let of_row = |(i, w): (usize, f64)| body.dofs.terms(i, 0).map(move |(j, t)| (j, w * t));
        let anchor = anchor(body, scene, point);
        let row = if anchor.is_some() { vec![] } else { all.flat_map(of_row).collect() };
        let direction = [0.0, 1.0, 0.0];
        coefficient.map(|coefficient| Tangent {
            row,
            anchor,
            coefficient,
            surface,
            direction,
            only_slips: false,
        })
    };
    Ok((0..rows.len()).map(tangent).collect())
}

/// What tangents are counted against: nothing before rigid obstacles.
fn tangents_against(
    scene: &Scene,
    contact: &Contact,
    (count, taken, n): (usize, &[usize], usize),
) -> Result<Vec<Vec<(usize, f64)>>, ProblemError> {
    let key = "contact.tangents_against";
    match (&contact.tangents_against, &contact.against) {
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
    let count = scene.contact.as_ref().and_then(|c| c.displacements.as_ref()).map_or(0, Vec::len);
    let largest = given_gaps(scene, count).iter().fold(0.0f64, |m, g| m.max(g.abs()));
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
    let file = name.map_or("", String::as_str);
    if scene.rows.names.is_empty() || scene.attached.get(file).is_some() {
        return read(scene, key, name);
    }
    let names = &scene.rows.names;
    let help = "give a matrix of the same body";
    let written = read_written(folder(scene), file).map_err(|e| fault(scene, key, e, help))?;
    let n = names.len();
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
            return Err(fault(scene, key, message, "give the names of these matrices"));
        }
        true => {
            let place: HashMap<&DofName, usize> =
                names.iter().enumerate().map(|(k, name)| (name, k)).collect();
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
    if scene.rows.flipped.is_empty() {
        return Ok(matrix);
    }
    let sign = |i: usize| if scene.rows.flipped.contains(&i) { -1.0 } else { 1.0 };
    let turned = matrix.triplets().map(|(i, j, v)| (i, j, sign(i) * sign(j) * v)).collect();
    Ok(Csr::from_triplets(n, n, turned))
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
    let mass = square(scene, "body.mass_matrix", b.mass_matrix.as_ref())?;
    let stiffness = square(scene, "body.stiffness_matrix", b.stiffness_matrix.as_ref())?;
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
        let contact = scene.contact.as_ref();
        let tangents = contact.and_then(|c| c.tangents.clone()).unwrap_or_default();
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
    let elastic = scene.all_sliders().iter().filter(|s| s.stiffness.is_some()).count();
    Ok((body.with_memory(rows.tangents.len()).with_memory(elastic), rows, gap))
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
    let key = if by_nodes { "contact.nodes" } else { "contact.displacements" };
    Err(fault(scene, key, message, help))
}

/// A coupling below this, over the roots of both stiffnesses, is rounding.
const STILL: f64 = 1e-9;

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
    let rows = scene.contact.as_ref().and_then(|c| c.displacements.clone()).unwrap_or_default();
    if let Some(bad) = rows.iter().enumerate().find(|(k, i)| **i >= n || rows[..*k].contains(*i)) {
        let message = format!("{} is no row of the matrices, or stands there twice", bad.1);
        let help = format!("give rows from 0 to {}", n - 1);
        return Err(fault(scene, "contact.displacements", message, &help));
    }
    let gap = given_gaps(scene, rows.len());
    if gap.len() != rows.len() || gap.iter().any(|g| !g.is_finite()) {
        let odd = gap.iter().zip(&rows).find(|(g, _)| !g.is_finite());
        let (key, message) = match odd {
            Some((g, row)) if scene.contact.as_ref().is_some_and(|c| c.gap().is_some()) => {
                ("contact.gap", format!("is {g} at {}", scene.rows.label(*row)))
            }
            _ => {
                let (gaps, rows) = (gap.len(), rows.len());
                ("contact.gaps", format!("{gaps} gaps for {rows} contact displacements"))
            }
        };
        return Err(fault(scene, key, message, "give one finite number each"));
    }
    let contact = scene.contact.as_ref();
    let Some((contact, all)) = contact.and_then(|c| Some((c, c.against.as_ref()?))) else {
        let along = contact.filter(|c| c.is_massless_along()).and_then(|c| c.tangents.clone());
        let idle = along.unwrap_or_default();
        let against = if idle.is_empty() { vec![] } else { vec![vec![]; rows.len()] };
        let tangents = idle.iter().copied().zip(0..).collect();
        let all = ContactRows { facing: rows, against, idle, tangents, ..ContactRows::default() };
        return Ok((all, gap));
    };
    let against = counted(scene, "contact.against", all, (rows.len(), &rows, n))?;
    let mut idle: Vec<usize> = match contact.sides.unwrap_or_default() {
        SidesKey::Both => against.iter().flatten().map(|m| m.0).collect(),
        SidesKey::Slave => vec![],
    };
    idle.sort_unstable();
    idle.dedup();
    Ok((ContactRows { facing: rows, against, idle, ..ContactRows::default() }, gap))
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
