//! What motions are compared with: the exact motion of a uniform bar, a fine mesh, or the file of a run.

use std::path::PathBuf;

use super::plan::{Plan, Task};
use super::transient::{Measured, measure};
use super::variant::Variant;
use super::{CompareError, Means};
use crate::fem::interpolate::{Cell, at_cells, cells};
use crate::mesh::Mesh;
use crate::scenario::{BodyKind, Change, ContactMethod, Elements, METHOD_KEYS, Scene};
use crate::store::{Stored, read_state};

/// A reference by name.
#[derive(Debug, Clone, PartialEq)]
pub enum Named {
    /// The motion of the bar along its characteristics, on a mesh that has all nodes of the others.
    Waves(usize),
    /// A contact method on a mesh.
    Mesh(Variant, Elements),
    /// The last state of a run in a file.
    File(PathBuf),
}

/// Most elements of the mesh whose nodes are those of all meshes.
const MOST: usize = 20_000;

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

impl Named {
    /// What a body is compared with if nobody says it: the exact motion of a bar where there is one, else mass redistribution on the finest mesh.
    pub(crate) fn of_body(scene: &Scene, meshes: &[Elements], first: Option<&Variant>) -> Named {
        let at_rest = scene.contact.as_ref().is_some_and(|c| !c.moves());
        let held = !scene.supports.is_empty();
        let free = scene.loads.is_empty() && scene.damping.is_none() && !scene.has_elements();
        if scene.body.kind == BodyKind::Bar && at_rest && held && free {
            return Named::waves(meshes);
        }
        let finest = meshes.last().cloned().unwrap_or_default();
        // without a mesh nothing is refined, and methods are compared with the first of them
        let own = first.filter(|_| !scene.has_elements_of_choice()).cloned();
        let common = || Variant::of_method(ContactMethod::MassRedistribution);
        Named::Mesh(own.unwrap_or_else(common), finest)
    }

    /// The exact motion of a bar, known at all nodes of these meshes.
    pub fn waves(meshes: &[Elements]) -> Named {
        let meshes = || meshes.iter().map(Elements::count);
        let least_common = |a: usize, b: usize| a / greatest_common_divisor(a, b).max(1) * b;
        let step = |a: usize, b: usize| if a > MOST { a } else { least_common(a, b) };
        let common = meshes().fold(1, step);
        let finest = meshes().fold(1, usize::max);
        Named::Waves(if common <= MOST { common } else { finest })
    }

    /// Whether it has no error of a mesh.
    pub(crate) fn is_exact(&self) -> bool {
        matches!(self, Named::Waves(_))
    }
}

impl std::fmt::Display for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Named::Waves(n) => {
                write!(f, "waves on {n} elements (exact for data that are linear between nodes)")
            }
            Named::Mesh(v, m) if m.is_empty() => write!(f, "{}", v.name),
            Named::Mesh(v, m) => write!(f, "{} on {m}", v.name),
            Named::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// A reference that is there.
#[derive(Debug)]
pub enum Reference {
    /// Computed.
    Motion(Box<Measured>),
    /// From a file.
    File(PathBuf, Trace),
}

/// The contact force of a motion over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// Times.
    pub t: Vec<f64>,
    /// `∫ p dA` at these times, from the right.
    pub force: Vec<f64>,
    /// The same from the left.
    pub before: Vec<f64>,
    /// Largest pressure at any point.
    pub peak: f64,
}

impl Trace {
    /// A further instant: pressures of the contact points and their areas, and which of them touched until then.
    pub fn push(&mut self, t: f64, pressure: &[f64], areas: &[f64], touched: &[bool]) {
        let force: f64 = pressure.iter().zip(areas).map(|(p, a)| p * a).sum();
        let all = pressure.iter().zip(areas).zip(touched);
        // a point that comes into contact at this instant was not pushed before it
        let before: f64 = all.filter(|(_, touched)| **touched).map(|((p, a), _)| p * a).sum();
        self.t.push(t);
        self.force.push(force);
        self.before.push(before);
        self.peak = pressure.iter().fold(self.peak, |m, p| m.max(*p));
    }

    /// `∫ F dt`
    pub fn impulse(&self) -> f64 {
        let step =
            |k: usize| 0.5 * (self.t[k] - self.t[k - 1]) * (self.force[k - 1] + self.before[k]);
        (1..self.t.len()).map(step).sum()
    }

    /// The force at an instant.
    fn at(&self, t: f64) -> f64 {
        let k = self.t.partition_point(|x| *x <= t).clamp(1, self.t.len().max(2) - 1);
        let (Some(a), Some(b)) = (self.t.get(k - 1), self.t.get(k)) else { return f64::NAN };
        let s = if b > a { ((t - a) / (b - a)).clamp(0.0, 1.0) } else { 1.0 };
        match s {
            1.0 => self.force[k],
            s => (1.0 - s) * self.force[k - 1] + s * self.before[k],
        }
    }

    /// `‖F − F_ref‖/‖F_ref‖` in `L²`; not a number if the reference never touches.
    pub fn distance(&self, reference: &Trace) -> f64 {
        let (mut distance, mut size) = (0.0, 0.0);
        for k in 1..self.t.len() {
            let (middle, dt) = (0.5 * (self.t[k] + self.t[k - 1]), self.t[k] - self.t[k - 1]);
            let (own, exact) = (0.5 * (self.force[k - 1] + self.before[k]), reference.at(middle));
            distance += dt * (own - exact).powi(2);
            size += dt * exact * exact;
        }
        if size > 0.0 { (distance / size).sqrt() } else { f64::NAN }
    }
}

/// A nodal field of one mesh at the nodes of another one of the same body.
pub fn moved(field: &[f64], from: &Mesh, to: &Mesh) -> Option<Vec<f64>> {
    if from.nodes() == to.nodes() {
        return Some(field.to_vec());
    }
    let elements: Vec<_> = from.elements().map(|e| (e.kind, e.nodes.to_vec())).collect();
    let places: Vec<Cell> = cells(to, from.nodes(), &elements)?;
    Some(at_cells(field, &places, to.dim()))
}

impl Reference {
    /// Compute a reference of a problem: the scene with what makes it another one.
    pub fn new(plan: &Plan, problem: &[Change], means: Means) -> Result<Reference, CompareError> {
        let fail = |why: String| CompareError::Reference { name: plan.reference.to_string(), why };
        let (variant, elements) = match &plan.reference {
            Named::File(path) => {
                let stored = Stored::read(path).map_err(|e| fail(e.to_string()))?;
                check(plan, problem, &stored).map_err(fail)?;
                return Ok(Reference::File(path.clone(), trace_of(&stored)));
            }
            Named::Waves(n) => (Variant::of_method(ContactMethod::Waves), Elements::of_bar(*n)),
            Named::Mesh(variant, elements) => (variant.clone(), elements.clone()),
        };
        let task = Task { variant, parameters: problem.to_vec(), elements };
        let mut scene = task.scene(&plan.scene)?;
        // steps and tolerances of the scene are those of what is compared
        if let Some(run) = scene.run.as_mut() {
            run.integrator = Default::default();
        }
        let measured = measure(&scene, &(means.set_up)(&scene).map_err(fail)?, false, means.stop)
            .map_err(fail)?;
        Ok(Reference::Motion(Box::new(measured)))
    }

    /// The displacement at the end, at the nodes of a mesh.
    pub fn field(&self, mesh: &Mesh) -> Result<Vec<f64>, String> {
        match self {
            Reference::Motion(m) => moved(&m.u, &m.mesh, mesh).ok_or_else(|| {
                "the reference is another body: its mesh covers another region".into()
            }),
            Reference::File(path, _) => {
                read_state(path, mesh, true).map(|s| s.0).map_err(|e| e.to_string())
            }
        }
    }

    /// Its contact force.
    pub fn trace(&self) -> &Trace {
        match self {
            Reference::Motion(m) => &m.trace,
            Reference::File(_, trace) => trace,
        }
    }
}

/// Whether the file of a plan's reference serves all its problems; nothing where the reference is no file.
pub(crate) fn check_file(plan: &Plan) -> Result<(), String> {
    let Named::File(path) = &plan.reference else { return Ok(()) };
    let stored = Stored::read(path).map_err(|e| e.to_string())?;
    let told = |e: String| format!("--reference {}: {e}", path.display());
    stored.whole().map_err(|e| told(e.to_string()))?;
    plan.tasks().try_for_each(|task| check(plan, &task.problem(), &stored).map_err(told))
}

/// A stored run must be of the problem that is compared: all keys but those of how it is solved, and the end time.
fn check(plan: &Plan, problem: &[Change], stored: &Stored) -> Result<(), String> {
    let (ends, until) = (stored.t.last().copied(), plan.scene.until());
    if let (Some(ends), Some(until)) = (ends, until)
        && (ends - until).abs() > 1e-9 * until
    {
        return Err(format!("it ends at t = {ends}, and the scene at {until}"));
    }
    let changed = plan.scene.with(problem).map_err(|e| e.to_string())?;
    let (own, other) = (problem_keys(&changed.source.text), problem_keys(&stored.scene));
    let differs = |key: &&String| own.get(*key) != other.get(*key);
    match own.keys().chain(other.keys()).find(differs) {
        None => Ok(()),
        Some(key) => Err(format!(
            "it is a run of another problem: [{key}] differs; give METHOD@MESH, which is computed for each problem"
        )),
    }
}

/// The tables of a scene without what says how it is solved.
fn problem_keys(text: &str) -> toml::Table {
    let mut all: toml::Table = text.parse().unwrap_or_default();
    for key in ["title", "run", "orbit", "reduction"] {
        all.remove(key);
    }
    let mut without = |table: &str, key: &str| {
        if let Some(toml::Value::Table(inner)) = all.get_mut(table) {
            inner.remove(key);
        }
    };
    without("body", "elements");
    without("body", "mass");
    without("contact", "method");
    METHOD_KEYS.iter().filter(|k| k.0 != "gap_behind").for_each(|k| without("contact", k.0));
    all
}

/// The contact force of a stored run.
fn trace_of(stored: &Stored) -> Trace {
    let mut trace = Trace::default();
    let n = stored.pressure.ncols();
    let mut touched = vec![true; n];
    for (k, &t) in stored.t.iter().enumerate() {
        let pressure: Vec<f64> = stored.pressure.row(k).to_vec();
        trace.push(t, &pressure, &stored.contact_area, &touched);
        touched = (0..stored.gap.len()).map(|i| stored.touches(k, i)).collect();
    }
    trace
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_of_the_force_are_integrated_from_both_sides() {
        let mut trace = Trace::default();
        for (t, p, touched) in
            [(0.0, 0.0, false), (1.0, 2.0, false), (2.0, 2.0, true), (2.5, 0.0, true)]
        {
            trace.push(t, &[p], &[3.0], &[touched]);
        }
        // nothing, then 6 over one unit, then falling to zero
        assert_eq!(trace.impulse(), 6.0 + 0.5 * 0.5 * 6.0);
        assert_eq!(
            (trace.at(0.5), trace.at(1.0), trace.at(1.5), trace.at(2.25)),
            (0.0, 6.0, 6.0, 3.0)
        );
        assert_eq!(trace.distance(&trace), 0.0);
        assert_eq!(trace.peak, 2.0);
    }
}
