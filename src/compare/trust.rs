//! How far the mesh of a scene may be trusted: the same scene on a finer mesh, and with the other discretisation of the contact.
//!
//! Of linear triangles and tetrahedra the same mesh with elements of second order; of all others elements of half the size.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::contact::{System, phase_modes, relief};
use crate::continuation::Go;
use crate::event::{self, Options, Switch};
use crate::families::single::{limit_cycle, search};
use crate::families::start;
use crate::families::statement::other_contact;
use crate::fem::Finer;
use crate::mesh::{Basis, ElementKind, Family};
use crate::orbit::search::Verdict;
use crate::orbit::{Closure, Propagator, period_map};
use crate::problem::Problem;
use crate::records::{Beside, Figure, Relief, Replaced, Trust};
use crate::report::summary::{inward_corners, significant};
use crate::scenario::{MassKind, Scene};
use crate::simulate::{run_table, simulate};

use super::SetUp;
use super::watch::{Reading, Watch};

/// A periodic motion that is looked at.
pub struct Periodic {
    /// Its frequency.
    pub omega: f64,
    /// What ends the search for it.
    pub stop: Option<Arc<AtomicBool>>,
}

/// Frequencies that are looked at.
const FREQUENCIES: usize = 3;
/// Switches whose times are looked at.
const SWITCHES: usize = 3;

/// What is read off a motion, and its switches.
type Motion = (Vec<Reading>, Vec<Switch>);

/// What a body comes to.
struct Seen {
    n_dof: usize,
    figures: Vec<Reading>,
    /// The nodes that switch, and how, in the motions that were followed.
    switches: Option<Vec<(usize, &'static str)>>,
    /// Why there is no orbit, where one was asked for.
    no_orbit: Option<String>,
    /// What else is to be said.
    notes: Vec<String>,
}

impl Seen {
    fn add(&mut self, (figures, switches): Motion) {
        self.figures.extend(figures);
        self.switches.get_or_insert_default().extend(sequence(&switches));
    }
}

/// An error in words.
fn said(e: impl std::fmt::Display) -> String {
    e.to_string()
}

/// The lowest natural frequencies of the body, open and in contact everywhere.
fn frequencies(system: &System) -> Result<Vec<Reading>, String> {
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
    Ok(figures)
}

/// The nodes that switch, and how.
fn sequence(switches: &[Switch]) -> Vec<(usize, &'static str)> {
    switches.iter().map(|s| (s.node, s.kind.name())).collect()
}

/// The switches of a motion as figures; what is said of it stands behind their names.
fn of_switches(switches: &[Switch], of: &str) -> Vec<Reading> {
    let first = switches.iter().take(SWITCHES).enumerate();
    let times = first.map(|(k, s)| ("switches", format!("time of number {}{of}", k + 1), s.t));
    let number = ("switches", format!("number{of}"), switches.len() as f64);
    [number].into_iter().chain(times).collect()
}

/// The run of a scene; none if it was stopped.
fn of_run(
    scene: &Scene,
    problem: &Problem,
    until: f64,
    go: &mut dyn FnMut(f64) -> Go,
) -> Result<Option<Motion>, String> {
    let mut stopped = false;
    let mut hear = |t: f64| {
        let go = go(t / until);
        stopped |= go.is_break();
        go
    };
    let mut watch = Watch::new(&problem.system, &mut hear);
    let report = simulate(scene, problem, false, &mut watch).map_err(said)?;
    let mut figures = watch.figures();
    if stopped {
        return Ok(None);
    }
    if !report.outcome.is_complete() {
        return Err(format!("the run did not end: {}", report.outcome));
    }
    if problem.system.n_contact() > 0 {
        figures.extend(of_switches(&report.switches, ""));
    }
    Ok(Some((figures, report.switches)))
}

/// What stands behind the names of what an orbit comes to.
const OF_ORBIT: &str = ", orbit";

/// The orbit of a scene at a frequency: the first that the guesses of its body lead to, as `orbit` finds it; or why there is none.
fn of_orbit(
    scene: &Scene,
    problem: &Problem,
    asked: &Periodic,
) -> Result<Result<Motion, String>, String> {
    let closure = start::closure(scene, problem).map_err(said)?;
    let initial = &problem.initial;
    let mut body = Propagator::new(problem.system.clone()).map_err(said)?;
    body.stop.clone_from(&asked.stop);
    let omega = asked.omega;
    let verdict = if closure == Closure::Limit {
        limit_cycle(&mut body, initial, Some(TAU / omega)).map_err(said)?
    } else {
        body.system.loads_mut().set_frequency(omega);
        let guesses = start::guesses(scene, initial, &body, closure, omega);
        if guesses.is_empty() {
            return Ok(Err("there is nothing to start from".into()));
        }
        search(&mut body, closure, &guesses, omega).map_err(said)?
    };
    let Verdict::Orbit(orbit) = verdict else {
        return Ok(Err(verdict.to_string()));
    };
    let mut hear = |_| Go::Continue(());
    let mut watch = Watch::new(&body.system, &mut hear);
    let options = Options { until: orbit.period, samples: 400, switch_limit: 40.0 };
    let flow = &mut period_map::flow(&body);
    event::run(&body.system, &orbit.state, &options, flow, &mut watch).map_err(said)?;
    let mut figures: Vec<Reading> = watch.figures();
    figures.iter_mut().for_each(|(_, name, _)| name.push_str(OF_ORBIT));
    figures.push(("orbit", "frequency".into(), orbit.omega()));
    figures.push(("orbit", "time in contact".into(), orbit.contact_time));
    let largest = orbit.stability.as_ref().map(|s| s.largest);
    figures.extend(largest.map(|most| ("orbit", "largest multiplier".into(), most)));
    figures.extend(of_switches(&orbit.switches, OF_ORBIT));
    Ok(Ok((figures, orbit.switches)))
}

/// What a scene comes to; `go` hears how far its run is. None if it was stopped.
fn seen(
    scene: &Scene,
    problem: &Problem,
    (orbit, set_up): (Option<&Periodic>, SetUp),
    go: &mut dyn FnMut(f64) -> Go,
) -> Result<Option<Seen>, String> {
    let mut seen = Seen {
        n_dof: problem.system.n_displacements(),
        figures: frequencies(&problem.system)?,
        switches: None,
        no_orbit: None,
        notes: vec![],
    };
    if let Ok((_, until)) = run_table(scene) {
        let Some(found) = of_run(scene, problem, until, go)? else { return Ok(None) };
        seen.add(found);
    }
    if let Some(asked) = orbit {
        let reduced = match problem.system.is_conservative() {
            true => None,
            false => start::reduced_if_large(scene, &problem.system).map_err(said)?,
        };
        let found = match reduced {
            Some((scene, text)) => {
                seen.notes.push(text);
                of_orbit(&scene, &set_up(&scene)?, asked)?
            }
            None => of_orbit(scene, problem, asked)?,
        };
        match found {
            Ok(found) => seen.add(found),
            Err(why) => seen.no_orbit = Some(why),
        }
    }
    Ok(go(1.0).is_continue().then_some(seen))
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
    orbit: Option<&Periodic>,
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
    let asked = (orbit, set_up);
    let own = seen(scene, problem, asked, &mut |share| tick((done + share) / whole, "the scene"))?;
    let Some(own) = own else { return Ok(None) };
    if let Some(why) = own.no_orbit {
        return Err(format!("no orbit at omega = {}: {why}", orbit.map_or(f64::NAN, |o| o.omega)));
    }
    done += 1.0;
    let share = relief(&problem.system).map_err(said)?;
    let relief = share.into_iter().map(|(omega, share)| Relief { omega, share }).collect();
    let figure = |(kind, name, value): &Reading| Figure {
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
        warnings: inward_corners(&problem.system.body.mesh).into_iter().chain(own.notes).collect(),
        relief,
    };
    let mut next = 0;
    while let Some(what) = wanted.get(next).copied() {
        next += 1;
        let Some((other, text)) = replaced(scene, what) else { continue };
        let found = set_up(&other).and_then(|p| {
            seen(&other, &p, asked, &mut |share| tick((done + parts(&what) * share) / whole, &text))
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
                    let same = |g: &&Reading| g.0 == f.kind && g.1 == f.name;
                    *value = seen.figures.iter().find(same).map(|g| g.2);
                }
                let both = own.switches.as_ref().zip(seen.switches.as_ref());
                let both = both.filter(|_| seen.no_orbit.is_none());
                beside.same_switches = both.map(|(a, b)| a == b);
                let missed = seen.no_orbit.map(|why| format!("no orbit: {why}"));
                let notes = seen.notes.into_iter().chain(missed);
                trust.warnings.extend(notes.map(|note| format!("{text}: {note}")));
                if what != Replaced::OtherContact {
                    trust.warnings.extend(near_resonance(problem, &trust.figures, &values));
                }
            }
            // a search that was ended is no refusal
            Err(_) if tick(done / whole, &text).is_break() => return Ok(None),
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
