//! What a comparison consists of: variants × meshes × parameters.

use super::reference::Named;
use super::variant::Variant;
use crate::records::{Compared, Row};
use crate::scenario::{BodyKind, Change, ContactMethod, Elements, Issue, Scene, SceneError};

/// What is asked for.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Contact methods; empty: those that suit the body.
    pub variants: Vec<Variant>,
    /// Meshes (one number keeps the shape of the elements); empty: the scene's own.
    pub elements: Vec<Elements>,
    /// Keys, each with its values: all combinations are computed.
    pub parameters: Vec<(String, Vec<String>)>,
    /// What motions are compared with.
    pub reference: Option<Named>,
    /// Frequencies of orbits; empty: the scene's.
    pub omega: Vec<f64>,
    /// Viscosity.
    pub beta: Option<f64>,
}

/// A comparison, laid out.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What is compared.
    pub compared: Compared,
    /// The scene that is varied.
    pub scene: Scene,
    /// Frequencies of orbits.
    pub omega: Vec<f64>,
    /// Viscosity.
    pub beta: Option<f64>,
    /// What motions are compared with.
    pub reference: Named,
    /// Meshes, from coarse to fine.
    pub meshes: Vec<Elements>,
    /// Series of tasks that differ in the mesh alone.
    pub series: Vec<Vec<Task>>,
}

/// One row to compute.
#[derive(Debug, Clone)]
pub struct Task {
    /// The variant.
    pub variant: Variant,
    /// The parameters that it reads.
    pub parameters: Vec<Change>,
    /// Its mesh; empty for bodies that have but one.
    pub elements: Elements,
}

/// Keys that belong to how a problem is solved, not to what is solved.
fn is_numerical(change: &Change) -> bool {
    let key = &change.key;
    let of_method = key.strip_prefix("contact.").is_some_and(|k| {
        k == "method" || !ContactMethod::ALL.iter().all(|m| m.reads(k)) && k != "gap_behind"
    });
    of_method
        || key == "body.mass"
        || (key.starts_with("run.") && key != "run.until" && key != "run.periods")
}

impl Task {
    /// `contact.gamma = 2, body.mass = lumped`
    pub fn changed(&self) -> String {
        let all: Vec<String> = self.parameters.iter().map(Change::to_string).collect();
        all.join(", ")
    }

    /// Name of the mesh.
    pub fn mesh(&self) -> String {
        self.elements.to_string()
    }

    /// All in one line.
    pub fn title(&self) -> String {
        [self.variant.name.clone(), self.changed(), self.mesh()]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Whether a row is its.
    pub(crate) fn is_of(&self, row: &Row) -> bool {
        (&row.variant, &row.changed, &row.mesh)
            == (&self.variant.name, &self.changed(), &self.mesh())
    }

    /// A row without numbers.
    pub fn row(&self) -> Row {
        Row {
            variant: self.variant.name.clone(),
            changed: self.changed(),
            mesh: self.mesh(),
            ..Row::default()
        }
    }

    /// The parameters that make it another problem.
    pub fn problem(&self) -> Vec<Change> {
        self.parameters.iter().filter(|c| !is_numerical(c)).cloned().collect()
    }

    /// Its scene.
    pub fn scene(&self, of: &Scene) -> Result<Scene, SceneError> {
        let mut changes = self.variant.changes();
        changes.extend(self.elements.changes(of));
        changes.extend(self.parameters.iter().cloned());
        of.with(&changes)
    }
}

/// Methods that suit a body, if none is named.
fn suitable(scene: &Scene, compared: Compared) -> Vec<&'static str> {
    let mut names = vec!["nbm", "nbm:constant"];
    match (scene.body.kind, compared) {
        // friction knows one of them, whatever it is called, and tangents with mass or without
        _ if scene.rubs() => {
            let massless = Change::set("contact.tangent", "massless");
            let has_both = compared == Compared::Run && scene.with(&[massless]).is_ok();
            return match has_both {
                true => vec!["mass-redistribution:inertia", "mass-redistribution:massless"],
                false => vec!["mass-redistribution"],
            };
        }
        (BodyKind::Matrices, _) => return vec!["nbm", "mass-redistribution"],
        // the default of meshes has constant inertia
        // two surfaces that meet are for these alone
        _ if scene.contact.as_ref().is_some_and(|c| c.has_pairs()) => {
            return vec!["nbm", "mass-redistribution"];
        }
        (BodyKind::Mesh | BodyKind::Parts, _) => {
            names = vec!["nbm", "mass-redistribution", "nitsche", "penalty"];
        }
        (BodyKind::Plate, _) => names.extend(["mass-redistribution", "nitsche", "penalty"]),
        (BodyKind::Bar, _) => names.extend(["nitsche", "penalty"]),
    }
    match (scene.body.kind, compared) {
        (BodyKind::Bar, Compared::Run) => names.extend(["impact", "moreau-jean", "waves"]),
        (_, Compared::Run) => names.extend(["impact", "moreau-jean"]),
        _ => {}
    }
    names
}

/// Keys that have an option of their own.
const OPTIONS: [(&str, &str); 7] = [
    ("contact.method", "--methods"),
    ("body.elements", "--elements"),
    ("body.kind", "another scene"),
    ("title", "another scene"),
    ("orbit.omega", "--omega"),
    ("orbit.period", "--omega"),
    ("orbit.beta", "--beta"),
];

/// Keys that would be overwritten, or that nobody reads.
fn check_parameters(
    scene: &Scene,
    parameters: &[(String, Vec<String>)],
    variants: &[Variant],
) -> Result<(), SceneError> {
    for (k, (key, _)) in parameters.iter().enumerate() {
        let fail =
            |message: String, help: &str| Err(scene.error(Issue::new(key.clone(), message, help)));
        // of one of several bodies likewise
        let of_any = match (key.find("body["), key.find(']')) {
            (Some(0), Some(end)) => format!("body{}", &key[end + 1..]),
            _ => key.clone(),
        };
        if let Some((_, option)) = OPTIONS.iter().find(|o| o.0 == of_any) {
            return fail("is no parameter of a comparison".into(), &format!("give {option}"));
        }
        if parameters[..k].iter().any(|p| p.0 == *key) {
            return fail("is varied twice".into(), "give all its values in one --parameter");
        }
        if let Some(v) = variants.iter().find(|v| v.chooses(key)) {
            return fail(
                format!("is chosen by the name {} already", v.name),
                "leave one of them out",
            );
        }
        if !variants.iter().any(|v| v.reads(&Change::set(key, ""))) {
            let message = "is read by none of the methods that are compared";
            return fail(message.into(), "leave it out, or add a method that reads it");
        }
    }
    Ok(())
}

/// All combinations of the values of keys.
fn combinations(parameters: &[(String, Vec<String>)]) -> Vec<Vec<Change>> {
    parameters.iter().fold(vec![vec![]], |all, (key, values)| {
        let with = |before: &Vec<Change>, value: &String| {
            let mut changes = before.clone();
            changes.push(Change::set(key, value));
            changes
        };
        all.iter().flat_map(|before| values.iter().map(move |v| with(before, v))).collect()
    })
}

impl Plan {
    /// Lay out what is asked for.
    pub fn new(scene: &Scene, compared: Compared, request: Request) -> Result<Plan, SceneError> {
        let fail =
            |key: &str, message: &str, help: &str| Err(scene.error(Issue::new(key, message, help)));
        if scene.contact.is_none() {
            return fail("contact", "is missing: contact methods are compared", "add [contact]");
        }
        let mut meshes = meshes(scene, &request.elements)?;
        // from coarse to fine
        meshes.sort_by_key(Elements::count);
        meshes.dedup();
        let mut variants = request.variants;
        if variants.is_empty() {
            let known = suitable(scene, compared).into_iter().map(Variant::of_name);
            let fits = |v: &Variant| scene.with(&v.changes()).is_ok();
            variants = known.filter_map(Result::ok).filter(fits).collect();
        }
        check_parameters(scene, &request.parameters, &variants)?;
        let mut omega: Vec<f64> = vec![];
        for w in request.omega {
            if !omega.contains(&w) {
                omega.push(w);
            }
        }
        if compared != Compared::Run && omega.is_empty() {
            match scene.orbit.as_ref().and_then(|o| o.omega) {
                Some(w) => omega.push(w),
                None => {
                    let message = "is missing: orbits are compared at given frequencies";
                    return fail("orbit.omega", message, "[orbit] omega = 1.8, or --omega 1.8");
                }
            }
        }
        let reference =
            request.reference.unwrap_or_else(|| Named::of_body(scene, &meshes, variants.first()));
        let mut series: Vec<Vec<Task>> = vec![];
        for parameters in combinations(&request.parameters) {
            for variant in &variants {
                let parameters: Vec<Change> =
                    parameters.iter().filter(|c| variant.reads(c)).cloned().collect();
                let task = |elements: &Elements| Task {
                    variant: variant.clone(),
                    parameters: parameters.clone(),
                    elements: elements.clone(),
                };
                let tasks: Vec<Task> = meshes.iter().map(task).collect();
                // a parameter that a method does not read makes no further rows
                let is_same = |s: &Vec<Task>| {
                    s[0].variant == tasks[0].variant && s[0].parameters == tasks[0].parameters
                };
                if !series.iter().any(is_same) {
                    series.push(tasks);
                }
            }
        }
        // where no task has a scene, that is said before anything is computed; where some have none, in their rows
        let mut scenes = series.iter().filter_map(|s| s.first()).map(|t| t.scene(scene));
        let first = scenes.next();
        if let Some(Err(e)) = first
            && scenes.all(|s| s.is_err())
        {
            return Err(e);
        }
        let beta = request.beta;
        Ok(Plan { compared, scene: scene.clone(), omega, beta, reference, meshes, series })
    }

    /// A mesh with as many numbers as the bodies have axes.
    pub fn mesh(&self, elements: Elements) -> Result<Elements, SceneError> {
        let mut all = meshes(&self.scene, &[elements])?;
        Ok(all.pop().unwrap_or_default())
    }

    /// All tasks.
    pub fn tasks(&self) -> impl Iterator<Item = &Task> {
        self.series.iter().flatten()
    }
}

/// The meshes that are asked for, with as many numbers as the bodies have axes.
fn meshes(scene: &Scene, asked: &[Elements]) -> Result<Vec<Elements>, SceneError> {
    let own = Elements::of(scene);
    if asked.is_empty() {
        return Ok(vec![own]);
    }
    for (key, body) in scene.bodies() {
        let message = match body.kind {
            BodyKind::Matrices => "a body of matrices has no elements that could be other ones",
            BodyKind::Mesh => "the mesh comes from a file: give another file in its place",
            BodyKind::Bar | BodyKind::Plate | BodyKind::Parts => continue,
        };
        let help = "leave --elements out";
        return Err(scene.error(Issue::new(format!("{key}.kind"), message, help)));
    }
    let whole = |m: &Elements| {
        let (key, _) = scene.bodies().swap_remove(0);
        let several = scene.bodies().len() > 1;
        m.in_shape_of(&own).ok_or_else(|| {
            let message = match several {
                true => format!("{m} is no mesh of these bodies, which have {own}"),
                false => format!("{m} is no mesh of this body, which has {own}"),
            };
            let help = "one number a mesh keeps the shape of the elements: --elements 10,20,40; or as many as there are axes, 10x3; of several bodies 10x3+8x4";
            scene.error(Issue::new(format!("{key}.elements"), message, help))
        })
    };
    asked.iter().map(whole).collect()
}
