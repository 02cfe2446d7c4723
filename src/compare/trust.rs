//! How far the mesh of a scene may be trusted: the same scene on a finer mesh, and with the other discretisation of the contact.
//!
//! Of linear triangles and tetrahedra the same mesh with elements of second order; of all others elements of half the size.

use crate::contact::{Resultants, System, phase_modes, relief};
use crate::continuation::Go;
use crate::event::{Observer, Sample};
use crate::families::statement::other_contact;
use crate::fem::Finer;
use crate::mesh::{Basis, ElementKind, Family};
use crate::problem::Problem;
use crate::records::{Beside, Figure, Relief, Replaced, Trust};
use crate::report::summary::{inward_corners, significant};
use crate::scenario::{MassKind, Scene};
use crate::simulate::{run_table, simulate};

use super::SetUp;

/// Frequencies that are looked at.
const FREQUENCIES: usize = 3;
/// Switches whose times are looked at.
const SWITCHES: usize = 3;

/// What a body comes to.
struct Seen {
    n_dof: usize,
    /// Kind, name, value.
    figures: Vec<(&'static str, String, f64)>,
    /// The nodes that switch, and how.
    switches: Option<Vec<(usize, &'static str)>>,
}

/// Sees a motion go by.
struct Watch<'a> {
    system: &'a System,
    resultants: Resultants,
    /// What of the last state is still needed: its time and forces.
    before: Option<(f64, Vec<f64>)>,
    forces: Vec<f64>,
    impulses: Vec<f64>,
    supports: Vec<f64>,
    displacement: f64,
    energy: f64,
    probes: Vec<Vec<f64>>,
    go: &'a mut dyn FnMut(f64) -> Go,
}

/// An error in words.
fn said(e: impl std::fmt::Display) -> String {
    e.to_string()
}

fn size(x: &[f64]) -> f64 {
    x.iter().fold(0.0f64, |m, x| m.hypot(*x))
}

impl<'a> Watch<'a> {
    fn new(system: &'a System, go: &'a mut dyn FnMut(f64) -> Go) -> Watch<'a> {
        let resultants = Resultants::new(system);
        let (groups, dim) = (resultants.names.len(), resultants.dim);
        let quantities =
            system.probes.iter().flat_map(|p| p.quantities.iter().map(move |q| (p, q)));
        Watch {
            system,
            before: None,
            forces: vec![0.0; groups],
            impulses: vec![0.0; groups * dim],
            supports: vec![0.0; system.bearings.supports.len()],
            displacement: 0.0,
            energy: 0.0,
            probes: quantities.map(|(p, q)| vec![0.0; p.components(*q).len()]).collect(),
            resultants,
            go,
        }
    }

    fn figures(self) -> Vec<(&'static str, String, f64)> {
        let mut all = vec![];
        let dim = self.resultants.dim.max(1);
        let impulses = self.impulses.chunks_exact(dim).map(size);
        for ((group, force), impulse) in self.resultants.names.iter().zip(self.forces).zip(impulses)
        {
            all.push(("force", format!("contact \"{group}\""), force));
            all.push(("impulse", format!("contact \"{group}\""), impulse));
        }
        for (group, force) in self.system.bearings.supports.iter().zip(self.supports) {
            all.push(("force", format!("support \"{group}\""), force));
        }
        if self.system.n_contact() > 0 {
            all.push(("displacement", "at the contact".into(), self.displacement));
        }
        all.push(("energy", "largest".into(), self.energy));
        let mut seen = self.probes.into_iter();
        for probe in self.system.probes.iter() {
            for quantity in &probe.quantities {
                let values = seen.next().unwrap_or_default();
                for (component, value) in probe.components(*quantity).iter().zip(values) {
                    let name = format!("\"{}\" {} {component}", probe.name, quantity.name());
                    all.push(("probe", name, value));
                }
            }
        }
        all.retain(|(_, _, value)| value.is_finite());
        all
    }
}

impl Observer for Watch<'_> {
    type Error = std::convert::Infallible;

    fn sample(&mut self, s: &Sample) -> Result<(), Self::Error> {
        let dim = self.resultants.dim.max(1);
        let [force, _] = self.resultants.of(s.pressure, s.traction, s.u);
        for (most, own) in self.forces.iter_mut().zip(force.chunks_exact(dim)) {
            *most = most.max(size(own));
        }
        if let Some((t, before)) = &self.before {
            let half = 0.5 * (s.t - t);
            let sums = self.impulses.iter_mut().zip(before.iter().zip(&force));
            sums.for_each(|(sum, (a, b))| *sum += half * (a + b));
        }
        self.before = Some((s.t, force));
        let loads = (self.system.loads.as_ref(), s.t);
        let [u, v, a] = s.at_rest(loads.0);
        let borne = self.system.bearings.of(&self.system.body, loads, [&u, &v, &a]);
        for (most, own) in self.supports.iter_mut().zip(borne.supports.chunks_exact(dim)) {
            // what nobody knows stays unknown
            let own = size(own);
            *most = if own.is_nan() { own } else { most.max(own) };
        }
        let normal = self.system.along_normals(&u);
        self.displacement = normal.iter().fold(self.displacement, |m, u| m.max(u.abs()));
        if let Some(e) = s.energies {
            self.energy = self.energy.max(e.total());
        }
        let mut place = 0;
        for probe in self.system.probes.iter() {
            for quantity in &probe.quantities {
                let values = probe.of(*quantity, [&u, &v, &a], (&loads.0.carried, s.t));
                let most = self.probes[place].iter_mut().zip(values);
                most.for_each(|(m, x)| *m = if x.is_nan() { x } else { m.max(x.abs()) });
                place += 1;
            }
        }
        Ok(())
    }

    fn takes_accelerations(&self) -> bool {
        true
    }

    fn progress(&mut self, t: f64) -> Result<Go, Self::Error> {
        Ok((self.go)(t))
    }
}

/// What a scene comes to; `go` hears how far its run is.
fn seen(
    scene: &Scene,
    problem: &Problem,
    go: &mut dyn FnMut(f64) -> Go,
) -> Result<Option<Seen>, String> {
    let system = &problem.system;
    let mut figures = vec![];
    let jumps = system.impact().is_some();
    let rigid = system.body.rigid_motions(false).len();
    let count = (rigid + FREQUENCIES).min(system.n_o());
    let open = phase_modes(system, &system.open_phase(), count).map_err(said)?;
    let closed = system.closed_states();
    let has_closed = system.n_contact() > 0 && !jumps && system.has_potential();
    let mut add = |name: &str, omega: &[f64]| {
        let highest = omega.last().copied().unwrap_or(0.0);
        let elastic = omega.iter().filter(|w| **w > 1e-6 * highest).take(FREQUENCIES);
        for (k, omega) in elastic.enumerate() {
            figures.push(("frequency", format!("{name} {}", k + 1), *omega));
        }
    };
    add("open", &open.omega);
    if has_closed {
        let modes = phase_modes(system, &system.phase(&closed), count);
        add("closed", &modes.map_err(said)?.omega);
    }
    let Ok((_, until)) = run_table(scene) else {
        return Ok(Some(Seen { n_dof: system.n_displacements(), figures, switches: None }));
    };
    let mut stopped = false;
    let mut hear = |t: f64| {
        let go = go(t / until);
        stopped |= go.is_break();
        go
    };
    let mut watch = Watch::new(system, &mut hear);
    let report = simulate(scene, problem, false, &mut watch).map_err(said)?;
    let of_motion = watch.figures();
    if stopped {
        return Ok(None);
    }
    if !report.outcome.is_complete() {
        return Err(format!("the run did not end: {}", report.outcome));
    }
    figures.extend(of_motion);
    if system.n_contact() > 0 {
        figures.push(("switches", "number".into(), report.switches.len() as f64));
    }
    for (k, s) in report.switches.iter().take(SWITCHES).enumerate() {
        figures.push(("switches", format!("time of number {}", k + 1), s.t));
    }
    let switches = report.switches.iter().map(|s| (s.node, s.kind.name())).collect();
    Ok(Some(Seen { n_dof: system.n_displacements(), figures, switches: Some(switches) }))
}

/// The body of a problem in words.
fn words(scene: &Scene, problem: &Problem) -> String {
    let mesh = &problem.system.body.mesh;
    if problem.system.body.materials().is_empty() {
        return "matrices".into();
    }
    let mut kinds: Vec<(ElementKind, usize)> = vec![];
    for e in mesh.elements() {
        match kinds.iter_mut().find(|k| k.0 == e.kind) {
            Some(known) => known.1 += 1,
            None => kinds.push((e.kind, 1)),
        }
    }
    let words: Vec<String> = kinds.iter().map(|(k, n)| format!("{n} {}", k.name())).collect();
    match scene.contact.as_ref() {
        Some(_) => format!("{}, {}", words.join(" and "), problem.system.method_name()),
        None => words.join(" and "),
    }
}

/// Which finer mesh tells most.
fn choice(problem: &Problem) -> Replaced {
    let linear = |k: ElementKind| k.family() == Family::Simplex && k.basis() == Basis::Linear;
    match problem.system.body.mesh.elements().all(|e| linear(e.kind)) {
        true => Replaced::Raised,
        false => Replaced::Halved,
    }
}

/// The scene with something replaced, and how in words.
fn replaced(scene: &Scene, what: Replaced) -> Option<(Scene, String)> {
    let mut scene = scene.clone();
    let text = match what {
        Replaced::Raised => {
            scene.finer = Finer::Raised;
            // of a diagonal mass corners have nothing, or errors of the order of the linear elements
            match std::mem::take(&mut scene.body.mass) {
                MassKind::Consistent => "the same mesh of second order".to_owned(),
                _ => "the same mesh of second order, with a consistent mass".to_owned(),
            }
        }
        Replaced::Halved => {
            scene.finer = Finer::Halved;
            "elements of half the size".to_owned()
        }
        Replaced::OtherContact => other_contact(&mut scene)?,
    };
    Some((scene, text))
}

/// What a finer mesh moves past a load: its resonance.
fn near_resonance(problem: &Problem, own: &[Figure], finer: &[Option<f64>]) -> Option<String> {
    let loads = problem.system.loads.harmonics.iter().map(|h| h.omega);
    let mut pairs = loads.flat_map(|omega| own.iter().zip(finer).map(move |f| (omega, f)));
    let passed = |&(omega, (f, finer)): &(f64, (&Figure, &Option<f64>))| {
        let moved = finer.map_or(0.0, |x| (x - f.value).abs());
        let is_open = f.kind == "frequency" && f.name.starts_with("open");
        is_open && moved > SEEN * f.value && (omega - f.value).abs() <= 2.0 * moved
    };
    let (omega, (f, finer)) = pairs.find(passed)?;
    Some(format!(
        "a load of frequency {} stands beside the frequency {}, {}, which is {} on the finer mesh: what it drives differs by where its resonance is; give loads at one share of the frequency and compare again",
        significant(omega, 6),
        f.name,
        significant(f.value, 6),
        significant(finer.unwrap_or(f.value), 6)
    ))
}

/// Shares of a frequency that move nothing.
const SEEN: f64 = 0.01;

/// Everything that is known of the errors of a mesh. `set_up` makes the problems of the others; `tick` hears the share that is done of what. None if it was stopped.
pub fn trust(
    scene: &Scene,
    problem: &Problem,
    set_up: SetUp,
    mut tick: impl FnMut(f64, &str) -> Go,
) -> Result<Option<Trust>, String> {
    let elements = !problem.system.body.materials().is_empty();
    let mut wanted: Vec<Replaced> = vec![];
    if elements {
        wanted.push(choice(problem));
    }
    if scene.contact.is_some() {
        wanted.push(Replaced::OtherContact);
    }
    // the body itself counts as one part, a finer one as four
    let parts = |w: &Replaced| if *w == Replaced::OtherContact { 1.0 } else { 4.0 };
    let whole = 1.0 + wanted.iter().map(parts).sum::<f64>();
    let mut done = 0.0;
    let name = words(scene, problem);
    let own = seen(scene, problem, &mut |share| tick((done + share) / whole, "the scene"))?;
    let Some(own) = own else { return Ok(None) };
    done += 1.0;
    let share = relief(&problem.system).map_err(said)?;
    let relief = share.into_iter().map(|(omega, share)| Relief { omega, share }).collect();
    let figure = |(kind, name, value): &(&'static str, String, f64)| Figure {
        kind,
        name: name.clone(),
        value: *value,
        beside: vec![],
    };
    let mut trust = Trust {
        mesh: name,
        n_dof: own.n_dof,
        beside: vec![],
        figures: own.figures.iter().map(figure).collect(),
        warnings: inward_corners(&problem.system.body.mesh).into_iter().collect(),
        relief,
    };
    let mut next = 0;
    while let Some(what) = wanted.get(next).copied() {
        next += 1;
        let Some((other, text)) = replaced(scene, what) else { continue };
        let found = set_up(&other).and_then(|p| {
            seen(&other, &p, &mut |share| tick((done + parts(&what) * share) / whole, &text))
        });
        let mut beside = Beside {
            replaced: what,
            text: text.clone(),
            n_dof: 0,
            same_switches: None,
            refused: None,
        };
        let mut values = vec![None; trust.figures.len()];
        match found {
            Ok(None) => return Ok(None),
            Ok(Some(seen)) => {
                beside.n_dof = seen.n_dof;
                for (value, f) in values.iter_mut().zip(&trust.figures) {
                    let same = |g: &&(&'static str, String, f64)| g.0 == f.kind && g.1 == f.name;
                    *value = seen.figures.iter().find(same).map(|g| g.2);
                }
                beside.same_switches =
                    own.switches.as_ref().zip(seen.switches.as_ref()).map(|(a, b)| a == b);
                if what != Replaced::OtherContact {
                    trust.warnings.extend(near_resonance(problem, &trust.figures, &values));
                }
            }
            Err(why) => {
                beside.refused = Some(why);
                // of second order the contact conditions may not do: elements of half the size may
                if what == Replaced::Raised {
                    wanted.insert(next, Replaced::Halved);
                }
            }
        }
        trust.figures.iter_mut().zip(values).for_each(|(f, v)| f.beside.push(v));
        trust.beside.push(beside);
        done += parts(&what);
    }
    Ok(Some(trust))
}
