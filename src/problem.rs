//! From a scene to the initial-value problem of the nodal boundary equations.
//!
//! Finds what only the mesh and the matrices can tell: rigid motions, prescribed contact edges, penetrating
//! initial states. Every such finding is an [`Issue`] that names the key of the scene.

use std::path::Path;

use thiserror::Error;

use nalgebra::{DMatrix, DVector};

use crate::contact::boundary::{self, BoundaryOperator};
use crate::contact::{
    ContactEdge, ContactError, MassChoice, Phase, Rayleigh, State, Stress, System, oracle,
};
use crate::fem::{Body, Csr, DofMap, FemError, Loads, Material, Modes, eigen, load, read_matrix};
use crate::mesh::Mesh;
use crate::scenario::{
    self, Amplitude, Axis, BodyKind, ContactMethod, Field, Inertia, Issue, Load, LoadKind,
    MassKind, RedistributedMass, Scene, SceneError, StressKey,
};

/// Why a problem cannot be set up.
#[derive(Debug, Error)]
pub enum ProblemError {
    /// The scene asks for something that is not possible.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The operators failed.
    #[error("setting up the contact operators: {0}")]
    Contact(#[from] ContactError),
    /// Matrices failed.
    #[error("setting up the matrices: {0}")]
    Fem(#[from] FemError),
}

/// The body, its loads and its initial state.
#[derive(Debug)]
pub struct Problem {
    /// Operators.
    pub system: System,
    /// State at `t = 0`.
    pub initial: State,
}

/// Nodal fields `(displacement, velocity)` read from a file, components interleaved.
pub type StoredState = (Vec<f64>, Vec<f64>);

impl Problem {
    /// Set up a scene. `stored` is the state of the file named in `[initial]`, if any.
    pub fn new(scene: &Scene, stored: Option<StoredState>) -> Result<Problem, ProblemError> {
        let given = match scene.body.kind {
            BodyKind::Matrices => Some(given_body(scene)?),
            _ => None,
        };
        let built = match given {
            Some((body, operator, gap)) => {
                System::with_operator(body, operator, gap, discretisation(scene))
            }
            None => {
                let body = assemble(scene);
                let edge = contact_edge(scene, &body)?;
                if let Some(issue) = empty(scene, &body) {
                    return Err(scene.error(issue).into());
                }
                System::on_edge(body, edge.as_ref(), discretisation(scene))
            }
        };
        let mut system = built.map_err(|e| match e {
            ContactError::NotPMatrix { .. } => ProblemError::Scene(scene.error(Issue::new(
                if scene.body.kind == BodyKind::Matrices { "contact.n_c" } else { "contact.edge" },
                e.to_string(),
                "give the elements along the contact edge regular shapes, or boundary_mass = \"consistent\"",
            ))),
            ContactError::Fem(FemError::NotPositiveDefinite { .. })
                if discretisation(scene).1 == MassChoice::Optimal =>
            {
                let message = "the redistributed mass is not positive definite on this mesh";
                ProblemError::Scene(scene.error(Issue::new(
                    "contact.mass",
                    message,
                    "give mass = \"condensed\", or refine the mesh near the contact edge",
                )))
            }
            other => other.into(),
        })?;
        let modes = OpenModes::for_scene(scene, &system)?;
        system.damping = damping(scene, &modes)?;
        if let Some(name) = &scene.body.damping_matrix {
            system.damping = Some(rayleigh_of(scene, &system, name)?);
        }
        *system.loads_mut() = loads(scene, &system, &modes)?;
        let initial = initial_state(scene, &system, &modes, stored)?;
        let problem = Problem { system, initial };
        problem.check_rigid_motion(scene)?;
        Ok(problem)
    }

    /// A motion that nothing opposes is an error; one that ends at the obstacle is not.
    fn check_rigid_motion(&self, scene: &Scene) -> Result<(), ProblemError> {
        let system = &self.system;
        let body = &system.body;
        let free = body.rigid_motions(false);
        if free.is_empty() {
            return Ok(());
        }
        let fail = |message: &str| {
            let help = "add a [[support]] that holds it, for example edge = \"left\", fix = [\"x\", \"y\"]";
            let key = if scene.supports.is_empty() { "body" } else { "support" };
            Err(scene.error(Issue::new(key, message, help)).into())
        };
        if system.n_contact() == 0 || !body.rigid_motions(true).is_empty() {
            return fail("the body can move rigidly");
        }
        if !self.is_carried_to_the_obstacle(&free)? {
            return fail(
                "the body can move rigidly, and neither a constant load nor the initial velocity carries it to \
                 the obstacle",
            );
        }
        Ok(())
    }

    /// Whether no rigid motion escapes. With the rigid motions `Φ` (mass-orthonormal) of the open body, the loads `b = Φᵀf₀` hold it at the
    /// obstacle if pressures can bear them: `b = Φ_Cᵀλ, λ ≥ 0` (otherwise, by Farkas' lemma, some motion that leaves the obstacle gains
    /// energy). Without loads it flies as it was thrown, `m = Φᵀ M u̇`, and must meet the obstacle somewhere: `(Φ_C m)_i > 0`.
    fn is_carried_to_the_obstacle(&self, free: &[Vec<f64>]) -> Result<bool, ProblemError> {
        let system = &self.system;
        let (n, n_o, n_c) = (system.n(), system.n_o(), system.n_contact());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut momentum = vec![0.0; n];
        let mut motions: Vec<Vec<f64>> = vec![];
        for motion in free {
            let mut x = system.body.dofs.gather(motion);
            for _ in 0..2 {
                system.mass().mul(&x, &mut momentum);
                for other in &motions {
                    let c = dot(other, &momentum);
                    x.iter_mut().zip(other).for_each(|(x, o)| *x -= c * o);
                }
            }
            let norm = system.mass().quadratic(&x).sqrt();
            x.iter_mut().for_each(|x| *x /= norm);
            motions.push(x);
        }
        /// Sums below this share of their terms are rounding errors.
        const ROUNDING: f64 = 1e-10;
        let contact = |z: &[f64]| -> Vec<f64> {
            (n_o..n).map(|i| motions.iter().zip(z).map(|(m, z)| z * m[i]).sum()).collect()
        };
        let load: Vec<f64> = motions.iter().map(|m| system.loads.constant_potential(m)).collect();
        let force = system.loads.constant.as_ref();
        let terms: f64 = force.map_or(0.0, |f| {
            motions.iter().map(|m| m.iter().zip(f).map(|(m, f)| (m * f).abs()).sum::<f64>()).sum()
        });
        if load.iter().any(|b| b.abs() > ROUNDING * terms) {
            let phi = DMatrix::from_fn(n_c, motions.len(), |i, k| motions[k][n_o + i]);
            let b = DVector::from_column_slice(&load);
            let q: Vec<f64> = (-(&phi * &b)).iter().copied().collect();
            let Some(pressure) = oracle::clarabel(&(&phi * phi.transpose()), &q) else {
                return Ok(false);
            };
            let rest = phi.transpose() * DVector::from_vec(pressure) - &b;
            return Ok(rest.norm() <= 1e-5 * b.norm());
        }
        let (_, v) = self.initial.full(system)?;
        system.mass().mul(&v, &mut momentum);
        let thrown: Vec<f64> = motions.iter().map(|m| dot(m, &momentum)).collect();
        let speed = contact(&thrown);
        let largest = v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        Ok(speed.iter().any(|s| *s > ROUNDING * largest))
    }
}

/// Stress and mass of the contact method that a scene names.
fn discretisation(scene: &Scene) -> (Stress, MassChoice) {
    let Some(c) = &scene.contact else { return (Stress::Projection, MassChoice::Paper) };
    let stress = if c.is_reaction() { Stress::Reaction } else { Stress::Projection };
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
        BodyKind::Bar => Mesh::bar(b.size[0], b.elements[0]),
        BodyKind::Plate => Mesh::rectangle(b.size[0], b.size[1], b.elements[0], b.elements[1]),
        BodyKind::Matrices => {
            // as many points as displacements; the files are read when the problem is set up
            let folder = folder(scene);
            let rows = b.mass_matrix.as_ref().and_then(|name| read_matrix(folder, name).ok());
            Mesh::bar(given_length(scene), rows.map_or(1, |m| m.n_rows()))
        }
    }
}

/// Files are named relative to the scene.
fn folder(scene: &Scene) -> &Path {
    scene.source.file.parent().unwrap_or(Path::new(""))
}

/// Gaps of given contact displacements.
fn given_gaps(scene: &Scene, count: usize) -> Vec<f64> {
    let Some(c) = &scene.contact else { return vec![] };
    match (&c.gaps, &c.gap) {
        (Some(list), _) => list.clone(),
        (None, Some(gap)) => vec![gap.at([0.0, 0.0]); count],
        (None, None) => vec![],
    }
}

/// The unit of length of a body without geometry: its largest gap.
fn given_length(scene: &Scene) -> f64 {
    let count = scene.contact.as_ref().and_then(|c| c.displacements.as_ref()).map_or(0, Vec::len);
    let largest = given_gaps(scene, count).iter().fold(0.0f64, |m, g| m.max(g.abs()));
    if largest > 0.0 { largest } else { 1.0 }
}

/// A body and its boundary operator from files.
fn given_body(scene: &Scene) -> Result<(Body, BoundaryOperator, Vec<f64>), ProblemError> {
    let folder = folder(scene);
    let issue = |key: &str, message: String, help: &str| -> ProblemError {
        scene.error(Issue::new(key, message, help)).into()
    };
    let read = |key: &str, name: &Option<String>| -> Result<Csr, ProblemError> {
        let name = name.as_deref().unwrap_or("");
        let help = "give a Matrix Market file, or FILE.h5:/dataset, relative to the scene";
        read_matrix(folder, name).map_err(|e| issue(key, e, help))
    };
    let b = &scene.body;
    let mass = read("body.mass_matrix", &b.mass_matrix)?;
    let stiffness = read("body.stiffness_matrix", &b.stiffness_matrix)?;
    let n = mass.n_rows();
    for (key, a) in [("body.mass_matrix", &mass), ("body.stiffness_matrix", &stiffness)] {
        if a.n_entries() < a.n_rows() {
            let (entries, rows) = (a.n_entries(), a.n_rows());
            let message = format!(
                "{entries} entries in {rows} rows: a positive definite matrix has one on every diagonal"
            );
            return Err(issue(key, message, "give positive definite matrices"));
        }
        if (a.n_rows(), a.n_cols()) != (n, n) {
            let message = format!(
                "is {} × {}, and the mass matrix {n} × {}",
                a.n_rows(),
                a.n_cols(),
                mass.n_cols()
            );
            return Err(issue(key, message, "give square matrices of one size"));
        }
        let largest = a.triplets().fold(0.0f64, |m, e| m.max(e.2.abs()));
        let transposed =
            Csr::from_triplets(n, n, a.triplets().map(|(i, j, v)| (j, i, v)).collect());
        let skew = Csr::combination(1.0, a, -1.0, &transposed)
            .triplets()
            .fold(0.0f64, |m, e| m.max(e.2.abs()));
        if skew > 1e-10 * largest {
            return Err(issue(
                key,
                format!("is not symmetric: entries differ by {skew:.1e}"),
                "give a symmetric matrix",
            ));
        }
    }
    let none = vec![];
    let contact = scene.contact.as_ref();
    let rows: &Vec<usize> = contact.and_then(|c| c.displacements.as_ref()).unwrap_or(&none);
    if let Some(bad) = rows.iter().enumerate().find(|(k, i)| **i >= n || rows[..*k].contains(*i)) {
        let message = format!("{} is no row of the matrices, or stands there twice", bad.1);
        return Err(issue(
            "contact.displacements",
            message,
            &format!("give rows from 0 to {}", n - 1),
        ));
    }
    let gap = given_gaps(scene, rows.len());
    if gap.len() != rows.len() || gap.iter().any(|g| !g.is_finite()) {
        let message = format!("{} gaps for {} contact displacements", gap.len(), rows.len());
        return Err(issue("contact.gaps", message, "give one finite number each"));
    }
    let body = Body::from_matrices(&mass, &stiffness, rows, given_length(scene)).map_err(|e| {
        let of_mass = matches!(&e, FemError::NotPositiveDefinite { what } if what.contains("mass"));
        issue(
            if of_mass { "body.mass_matrix" } else { "body.stiffness_matrix" },
            e.to_string(),
            "give positive definite matrices: a body that is held",
        )
    })?;
    let (n_o, n_c) = (body.dofs.n_o, rows.len());
    if contact.is_some_and(scenario::Contact::is_reaction) {
        let operator = boundary::reaction(&body, vec![1.0; n_c]);
        return Ok((body, operator, gap));
    }
    let (c_part, o_part) = match contact.and_then(|c| c.stress.as_ref()) {
        Some(StressKey::Terms(stress)) => {
            if stress.len() != n_c || stress.iter().flatten().any(|(i, _)| *i >= n) {
                let message =
                    "needs one list of [displacement, coefficient] for each contact displacement"
                        .to_owned();
                return Err(issue(
                    "contact.stress",
                    message,
                    "stress = [[[66, 10.0], [62, -10.0]]]",
                ));
            }
            let (mut c_part, mut o_part) = (vec![], vec![]);
            for (k, terms) in stress.iter().enumerate() {
                for &(i, v) in terms {
                    match body.dofs.of(i + 1, 0).map_or(0, |(p, _)| p) {
                        p if p < n_o => o_part.push((k, p, v)),
                        p => c_part.push((k, p - n_o, v)),
                    }
                }
            }
            (Csr::from_triplets(n_c, n_c, c_part), Csr::from_triplets(n_c, n_o, o_part))
        }
        _ if n_c == 0 => (Csr::from_triplets(0, 0, vec![]), Csr::from_triplets(0, n_o, vec![])),
        _ => {
            let c = read("contact.n_c", &contact.and_then(|c| c.n_c.clone()))?;
            let o = read("contact.n_o", &contact.and_then(|c| c.n_o.clone()))?;
            for (key, a, wanted) in [("contact.n_c", &c, n_c), ("contact.n_o", &o, n_o)] {
                if (a.n_rows(), a.n_cols()) != (n_c, wanted) {
                    let message = format!("is {} × {}", a.n_rows(), a.n_cols());
                    return Err(issue(key, message, &format!("give a {n_c} × {wanted} matrix")));
                }
            }
            (c, o)
        }
    };
    let mut dense = nalgebra::DMatrix::zeros(n_c, n_c);
    c_part.triplets().for_each(|(i, j, v)| dense[(i, j)] = v);
    Ok((body, BoundaryOperator { n_c: dense, n_o: o_part, area: vec![1.0; n_c] }, gap))
}

/// `α`, `β` of a damping matrix that is a combination of `M` and `K`.
fn rayleigh_of(scene: &Scene, system: &System, name: &str) -> Result<Rayleigh, ProblemError> {
    let issue = |message: String| -> ProblemError {
        let help = "give a C that is α M + β K, or [damping] in its place";
        scene.error(Issue::new("body.damping_matrix", message, help)).into()
    };
    let c = read_matrix(folder(scene), name).map_err(&issue)?;
    let n = system.n();
    if (c.n_rows(), c.n_cols()) != (n, n) {
        return Err(issue(format!(
            "is {} × {}, the other matrices {n} × {n}",
            c.n_rows(),
            c.n_cols()
        )));
    }
    let place = |i: usize| system.body.dofs.of(i + 1, 0).map_or(0, |(k, _)| k);
    let c =
        Csr::from_triplets(n, n, c.triplets().map(|(i, j, v)| (place(i), place(j), v)).collect());
    let dense = |a: &Csr| -> Vec<f64> {
        let mut d = vec![0.0; n * n];
        a.triplets().for_each(|(i, j, v)| d[i * n + j] = v);
        d
    };
    let (c, m, k) = (dense(&c), dense(&system.body.mass), dense(&system.body.stiffness));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // an orthonormal basis of M and K, so that nothing is lost where they are of very different size, or nearly parallel
    let norm = |a: &[f64]| dot(a, a).sqrt();
    let (of_m, of_c) = (norm(&m), norm(&c));
    let along: f64 = dot(&k, &m) / of_m;
    let across: Vec<f64> = k.iter().zip(&m).map(|(k, m)| k - along * m / of_m).collect();
    let of_k = norm(&across);
    let (c_m, c_k) = (dot(&c, &m) / of_m, dot(&c, &across) / of_k);
    let beta = c_k / of_k;
    let alpha = (c_m - beta * along) / of_m;
    let rest: Vec<f64> = (0..n * n).map(|i| c[i] - alpha * m[i] - beta * k[i]).collect();
    let share = norm(&rest) / of_c;
    // what each part contributes, over the whole
    let (part_m, part_k) = (alpha * of_m / of_c, beta * norm(&k) / of_c);
    if !(share <= 1e-8 && part_m >= -1e-8 && part_k >= -1e-8) {
        return Err(issue(format!(
            "is not α M + β K with α, β ≥ 0: {share:.1e} of it is left over (α = {alpha:.3e}, β = {beta:.3e})"
        )));
    }
    // a part that is a rounding error is none
    let clean = |x: f64, part: f64| if part.abs() <= 1e-12 { 0.0 } else { x.max(0.0) };
    Ok(Rayleigh { alpha: clean(alpha, part_m), beta: clean(beta, part_k) })
}

fn assemble(scene: &Scene) -> Body {
    let b = &scene.body;
    let (young, density) = (b.young.unwrap_or(1.0), b.density.unwrap_or(1.0));
    let material = match b.kind {
        BodyKind::Bar => Material::Bar { young, density, area: b.area.unwrap_or(1.0) },
        BodyKind::Plate => Material::Plate {
            young,
            poisson: b.poisson.unwrap_or(0.0),
            density,
            thickness: b.thickness.unwrap_or(1.0),
        },
        BodyKind::Matrices => Material::Bar { young: 1.0, density: 1.0, area: 1.0 },
    };
    let mesh = mesh(scene);
    let fixed: Vec<_> = scene
        .supports
        .iter()
        .flat_map(|s| s.fix.iter().map(|&axis| (s.edge, usize::from(axis == Axis::Y))))
        .collect();
    let dofs = DofMap::new(&mesh, &fixed, scene.contact.as_ref().and_then(|c| c.edge));
    Body::assemble(mesh, dofs, material, b.mass == MassKind::Lumped)
}

fn empty(scene: &Scene, body: &Body) -> Option<Issue> {
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

fn contact_edge(scene: &Scene, body: &Body) -> Result<Option<ContactEdge>, ProblemError> {
    let Some(c) = &scene.contact else { return Ok(None) };
    let (Some(edge), Some(field)) = (c.edge, c.gap.as_ref()) else { return Ok(None) };
    let nodes = &body.dofs.contact_nodes;
    if nodes.is_empty() {
        let axis = ["x", "y"][edge.axis()];
        return Err(scene
            .error(Issue::new(
                "contact.edge",
                format!("all {axis} displacements of the edge \"{}\" are prescribed", edge.name()),
                "choose another edge, or free it in [[support]]",
            ))
            .into());
    }
    let gap: Vec<f64> = nodes.iter().map(|&n| field.at(body.mesh.nodes[n])).collect();
    // squares of gaps must not overflow
    if let Some(k) = gap.iter().position(|g| g.is_nan() || g.abs() > 1e60) {
        let [x, y] = body.mesh.nodes[nodes[k]];
        return Err(scene
            .error(Issue::new(
                "contact.gap",
                format!("is {:e} at ({x}, {y})", gap[k]),
                "give an expression of at most 1e60 on the whole edge",
            ))
            .into());
    }
    Ok(Some(ContactEdge { edge, gap, lumped: c.boundary_mass == MassKind::Lumped }))
}

/// The modes of the open phase that a scene names, computed once and only if it names any.
struct OpenModes {
    modes: Option<Modes>,
    phase: Option<Phase>,
}

impl OpenModes {
    fn for_scene(scene: &Scene, system: &System) -> Result<OpenModes, ProblemError> {
        let damping = scene.damping.as_ref();
        let named = [
            scene.initial.mode,
            damping.and_then(|d| d.ratio.map(|_| d.mode.unwrap_or(1))),
            damping.and_then(|d| d.ratios.map(|[(a, _), (b, _)]| a.max(b))),
        ];
        let loads = scene.loads.iter().map(|l| l.mode);
        let Some(count) = named.into_iter().chain(loads).flatten().max() else {
            return Ok(OpenModes { modes: None, phase: None });
        };
        let phase = system.open_phase();
        let modes = phase_modes(system, &phase, count)?;
        Ok(OpenModes { modes: Some(modes), phase: Some(phase) })
    }

    /// Frequency and full shape `A* φ_k` of mode `k` (from 1).
    fn get(
        &self,
        scene: &Scene,
        key: &str,
        k: usize,
        system: &System,
    ) -> Result<(f64, Vec<f64>), ProblemError> {
        let found = match (&self.modes, &self.phase) {
            (Some(m), Some(p)) if k <= m.omega.len() => Some((m, p)),
            _ => None,
        };
        let Some((modes, phase)) = found else {
            let message =
                format!("mode {k} does not exist: the open body has {} modes", system.n_o());
            let help = format!("give 1 to {}", system.n_o());
            return Err(scene.error(Issue::new(key, message, help)).into());
        };
        let mut shape = vec![0.0; system.n()];
        phase.expand(&modes.shapes[k - 1], &mut shape);
        Ok((modes.omega[k - 1], shape))
    }
}

/// The `count` lowest modes of a phase, `φᵀ M_α φ = 1`, with the sign that makes the contact
/// displacement of largest magnitude positive (the largest displacement where there is no contact).
pub fn phase_modes(system: &System, phase: &Phase, count: usize) -> Result<Modes, FemError> {
    let (k, m) = phase.matrices();
    let mut modes = eigen::lowest(&k, &m, count, system.units.frequency)?;
    let mut full = vec![0.0; system.n()];
    for shape in &mut modes.shapes {
        phase.expand(shape, &mut full);
        let largest = |x: &[f64]| {
            x.iter()
                .copied()
                .fold(0.0f64, |m, x| if x.abs() > m.abs() * (1.0 + 1e-9) { x } else { m })
        };
        let of_contact = largest(&full[system.n_o()..]);
        let of_all = largest(&full);
        let leading = if of_contact.abs() > 1e-9 * of_all.abs() { of_contact } else { of_all };
        if leading < 0.0 {
            shape.iter_mut().for_each(|x| *x = -*x);
        }
    }
    Ok(modes)
}

fn damping(scene: &Scene, modes: &OpenModes) -> Result<Option<Rayleigh>, ProblemError> {
    let Some(d) = &scene.damping else { return Ok(None) };
    let omega = |key: &str, k: usize| -> Result<f64, ProblemError> {
        let w = modes.modes.as_ref().and_then(|m| m.omega.get(k - 1)).copied().unwrap_or(0.0);
        if w > 0.0 {
            return Ok(w);
        }
        let message = format!("mode {k} is a rigid motion or does not exist");
        Err(scene.error(Issue::new(key, message, "name an elastic mode of the open body")).into())
    };
    let rayleigh = match (d.rayleigh, d.ratio, d.ratios) {
        (Some([alpha, beta]), _, _) => Rayleigh { alpha, beta },
        (_, Some(ratio), _) => {
            let w = omega("damping.mode", d.mode.unwrap_or(1))?;
            Rayleigh { alpha: 0.0, beta: 2.0 * ratio / w }
        }
        (_, _, Some([(m1, r1), (m2, r2)])) => {
            // 2 ξ ω = α + β ω² at both
            let (w1, w2) = (omega("damping.ratios", m1)?, omega("damping.ratios", m2)?);
            let beta = 2.0 * (r2 * w2 - r1 * w1) / (w2 * w2 - w1 * w1);
            let alpha = 2.0 * r1 * w1 - beta * w1 * w1;
            if alpha < 0.0 || beta < 0.0 {
                let message = format!(
                    "these ratios need α = {alpha:.3e}, β = {beta:.3e}: negative damping of other modes"
                );
                let help = "choose ratios closer to each other";
                return Err(scene.error(Issue::new("damping.ratios", message, help)).into());
            }
            Rayleigh { alpha, beta }
        }
        _ => return Ok(None),
    };
    let none = rayleigh.alpha == 0.0 && rayleigh.beta == 0.0;
    Ok((!none).then_some(rayleigh))
}

fn loads(scene: &Scene, system: &System, modes: &OpenModes) -> Result<Loads, ProblemError> {
    let body = &system.body;
    let mut loads = Loads::default();
    for (i, l) in scene.loads.iter().enumerate() {
        let Load { kind, amplitude, .. } = l;
        let vector = match amplitude {
            Some(Amplitude::Scalar(a)) => vec![*a],
            Some(Amplitude::Vector(v)) => v.clone(),
            None => vec![peak_amplitude(scene, i, system, modes)?],
        };
        let force = match kind {
            LoadKind::Gravity => system.gravity(&vector),
            LoadKind::Traction => match l.edge {
                Some(edge) => load::traction(body, edge, &vector),
                None => continue,
            },
            LoadKind::Point => {
                let at = l.at.as_deref().unwrap_or(&[]);
                load::point(body, [at[0], at.get(1).copied().unwrap_or(0.0)], &vector)
            }
            LoadKind::Mode => {
                let key = format!("load[{i}].mode");
                let (_, shape) = modes.get(scene, &key, l.mode.unwrap_or(1), system)?;
                let mut force = vec![0.0; system.n()];
                system.mass().mul(&shape, &mut force);
                force.iter_mut().for_each(|f| *f *= vector[0]);
                force
            }
        };
        loads.push(force, l.omega, l.phase);
    }
    Ok(loads)
}

/// The amplitude `F` of a load `F M A*φ cos ωt` whose linear resonance peak `F / (2ξω²)` is `peak` times the modal amplitude that
/// grazes the obstacle.
fn peak_amplitude(
    scene: &Scene,
    i: usize,
    system: &System,
    modes: &OpenModes,
) -> Result<f64, ProblemError> {
    let l = &scene.loads[i];
    let mode = l.mode.unwrap_or(1);
    let (omega, shape) = modes.get(scene, &format!("load[{i}].mode"), mode, system)?;
    let (alpha, beta) = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
    let grazing = grazing_scale(system, &shape).ok_or_else(|| {
        let message = format!("mode {mode} never reaches the obstacle");
        let help = "choose a mode that moves the contact edge, or give amplitude";
        scene.error(Issue::new(format!("load[{i}].peak"), message, help))
    })?;
    if system.constraints.iter().any(|c| c.gap <= 0.0) {
        let help = "give amplitude, or a positive gap";
        let message = "counts in grazing amplitudes, and the gap is not positive everywhere";
        return Err(scene.error(Issue::new(format!("load[{i}].peak"), message, help)).into());
    }
    Ok(l.peak.unwrap_or(0.0) * (alpha + beta * omega * omega) * omega * grazing)
}

/// The least factor in magnitude by which a full shape touches the obstacle, with its sign.
pub fn grazing_scale(system: &System, shape: &[f64]) -> Option<f64> {
    let largest = shape.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let contact = shape[system.n_o()..].iter().zip(&system.constraints);
    let factors = contact.filter(|(u, _)| u.abs() > 1e-9 * largest).map(|(u, c)| c.gap / u);
    factors.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

fn initial_state(
    scene: &Scene,
    system: &System,
    modes: &OpenModes,
    stored: Option<StoredState>,
) -> Result<State, ProblemError> {
    let s = &scene.initial;
    let n_o = system.n_o();
    let dofs = &system.body.dofs;
    if let (Some(mode), Some(amplitude)) = (s.mode, s.amplitude) {
        let (_, mut shape) = modes.get(scene, "initial.mode", mode, system)?;
        // the leading contact displacement, or the leading displacement of a body without contact
        let range = if system.n_contact() > 0 { n_o..system.n() } else { 0..system.n() };
        let lead = range.clone().max_by(|&a, &b| shape[a].abs().total_cmp(&shape[b].abs()));
        let lead = lead.unwrap_or(0);
        let largest = shape.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if shape[lead].abs() < 1e-9 * largest {
            let message = format!(
                "mode {mode} does not move the contact edge: it cannot be scaled by the gap"
            );
            let help = "choose another mode, or give displacement = [\"…\"]";
            return Err(scene.error(Issue::new("initial.mode", message, help)).into());
        }
        let unit = if system.n_contact() > 0 { system.constraints[lead - n_o].gap } else { 1.0 };
        let scale = amplitude * unit / shape[lead];
        shape.iter_mut().for_each(|x| *x *= scale);
        check_penetration(scene, system, "initial.amplitude", &shape)?;
        return Ok(State { u: shape[..n_o].to_vec(), v: vec![0.0; n_o] });
    }
    if let Some((u, v)) = stored {
        let (u, v) = (dofs.gather(&u), dofs.gather(&v));
        check_penetration(scene, system, "initial.file", &u)?;
        return Ok(State { u: u[..n_o].to_vec(), v: v[..n_o].to_vec() });
    }
    let at_rest = match s.equilibrium {
        true => Some(system.equilibrium().map_err(|e| {
            let help = "give other constant loads, or displacement = [\"…\"]";
            scene.error(Issue::new("initial.equilibrium", e.to_string(), help))
        })?),
        false => None,
    };
    let field = |key: &str, list: &Option<Vec<Field>>| -> Result<Vec<f64>, ProblemError> {
        let Some(list) = list else { return Ok(vec![0.0; system.n()]) };
        let nodal: Vec<f64> = system
            .body
            .mesh
            .nodes
            .iter()
            .flat_map(|&p| list.iter().map(move |f| f.at(p)))
            .collect();
        // squares must not overflow
        if nodal.iter().any(|x| x.is_nan() || x.abs() > 1e60) {
            let message = "is not finite, or beyond 1e60, at a node";
            return Err(scene.error(Issue::new(key, message, "check the expression")).into());
        }
        Ok(dofs.gather(&nodal))
    };
    let u = field("initial.displacement", &s.displacement)?;
    let v = field("initial.velocity", &s.velocity)?;
    if s.displacement.is_some() {
        check_penetration(scene, system, "initial.displacement", &u)?;
    }
    if let Some((_, u)) = at_rest {
        return Ok(State { u, v: v[..n_o].to_vec() });
    }
    Ok(State { u: u[..n_o].to_vec(), v: v[..n_o].to_vec() })
}

fn check_penetration(
    scene: &Scene,
    system: &System,
    key: &str,
    u: &[f64],
) -> Result<(), ProblemError> {
    let n_o = system.n_o();
    let excess = |i: usize| u[n_o + i] - system.constraints[i].gap;
    let Some(worst) = (0..system.n_contact()).max_by(|&a, &b| excess(a).total_cmp(&excess(b)))
    else {
        return Ok(());
    };
    let scale = u.iter().fold(system.units.length, |m, x| m.max(x.abs()));
    if excess(worst) <= 1e-9 * scale {
        return Ok(());
    }
    let node = system.constraints[worst].node;
    let place = match scene.body.kind {
        // the points of such a body count from 1, its displacements from 0
        BodyKind::Matrices => format!("displacement {}", node.saturating_sub(1)),
        _ => {
            let [x, y] = system.body.mesh.nodes[node];
            format!("the node ({x}, {y})")
        }
    };
    let message =
        format!("the initial state penetrates the obstacle by {:.6e} at {place}", excess(worst));
    Err(scene
        .error(Issue::new(key, message, "give a state with u·n ≤ gap on the contact edge"))
        .into())
}
