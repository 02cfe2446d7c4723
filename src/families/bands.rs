//! Families with bands: how far each orbit moves with numbers of the scene that are not known exactly ([`crate::orbit::sensitivity`]), all points side by side.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use super::parameters::parameter;
use super::start;
use super::viscous::Viscosity;
use super::{FamilyError, digest, state_of};
use crate::continuation::Go;
use crate::orbit::parameter::Parameter;
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::sensitivity::{Differentiable, Observable};
use crate::orbit::{Closure, Orbit, OrbitError, Propagator};
use crate::problem::{Problem, ProblemError};
use crate::records::{BandRow, Bands, Branch, Deviation, Heights, OrbitRecord, PointRecord};
use crate::scenario::Scene;
use crate::store::StoredFamily;

/// Amplitudes of one orbit agree to this.
const SAME: f64 = 1e-6;

/// Told of what is known after each row.
pub type Take<'a> = &'a mut dyn FnMut(&Bands) -> Result<Go, FamilyError>;

/// The orbits of a family that can be looked at, branch by branch in the order of the walk.
pub fn orbits(family: &StoredFamily) -> Vec<&PointRecord> {
    let mut all: Vec<&PointRecord> = family.points.iter().filter(|p| p.orbit.is_some()).collect();
    all.sort_by_key(|p| (p.branch, p.index));
    all
}

/// Their frequencies and heights, as one number.
pub fn fingerprint(family: &StoredFamily) -> u64 {
    let all = orbits(family);
    let numbers =
        all.iter().flat_map(|p| [&p.omega].into_iter().chain(p.orbit.iter().map(|o| &o.amplitude)));
    digest(all.len(), numbers)
}

/// The body of a branch, with the numbers that its orbits are differentiated by.
struct Ready {
    body: Propagator,
    parameters: Vec<Parameter>,
    /// Of viscous orbits and of those of free bodies: how they close.
    closure: Closure,
}

/// Why a branch has no body.
fn failed(e: &ProblemError) -> FamilyError {
    OrbitError::Value(f64::NAN, e.to_string().replace('\n', " ")).into()
}

/// The scene of a branch: with the damping ratio that is its own.
fn of_branch(scene: &Scene, branch: Option<&Branch>) -> Result<Scene, ProblemError> {
    match branch.and_then(Branch::percent) {
        Some(percent) => Ok(scene.with_number("damping.ratio", percent / 100.0)?),
        None => Ok(scene.clone()),
    }
}

/// The numbers of a scene at some keys, with parameters of orbits of a closure.
fn parameters(
    scene: &Scene,
    body: &Propagator,
    closure: Closure,
    deviations: &[Deviation],
) -> Result<Vec<Parameter>, ProblemError> {
    let of = |d: &Deviation| parameter(scene, &body.system, (closure, f64::NAN), &d.key);
    deviations.iter().map(of).collect()
}

impl Ready {
    fn new(
        scene: &Scene,
        (branch, orbit): (Option<&Branch>, &OrbitRecord),
        deviations: &[Deviation],
    ) -> Result<Ready, ProblemError> {
        let scene = of_branch(scene, branch)?;
        let problem = Problem::new(&scene, None)?;
        let closure = start::closure(&scene, &problem)?;
        let body = Propagator::new(problem.system)?;
        let closure = match &orbit.viscous {
            Some(v) => Closure::Viscous(Viscosity::of_scene(&scene, &body, Some(v.beta))?.pin),
            None => closure,
        };
        let parameters = parameters(&scene, &body, closure, deviations)?;
        Ok(Ready { body, parameters, closure })
    }

    /// The orbit of a record, by Newton's method from its state; in words, why there is none.
    fn orbit(&mut self, record: &OrbitRecord) -> Result<Result<Orbit, String>, OrbitError> {
        let body = &mut self.body;
        let closure = match self.closure {
            Closure::Forced(_) => Closure::Forced(record.periods.max(1)),
            other => other,
        };
        let omega = record.omega();
        if closure.is_forced() {
            body.system.loads_mut().set_frequency(omega);
        }
        let mut z = body.frame(&state_of(&body.system, record));
        z.truncate(closure.sizes(body.n()).1);
        z.extend(record.viscous.as_ref().map(|v| v.alpha));
        // multipliers tell a family that friction holds: its orbits have no derivative of their own
        let multipliers = body.system.tangents().is_some();
        let effort = Effort { multipliers, rescue: false, ..Effort::of(closure) };
        Ok(match find(body, closure, &z, omega, &effort) {
            Ok(Verdict::Orbit(orbit)) if orbit.residual_positions().is_some_and(|k| k > 0) => Err(
                "the orbit is one of a family that friction holds: it has no derivative of its own"
                    .into(),
            ),
            Ok(Verdict::Orbit(mut orbit)) => {
                orbit.stability = None;
                Ok(*orbit)
            }
            Ok(other) => Err(other.to_string()),
            Err(e) if e.is_of_one_motion() => Err(e.to_string()),
            Err(e) => return Err(e),
        })
    }

    /// An orbit of a family with its derivatives.
    fn row(&mut self, point: &PointRecord, record: &OrbitRecord) -> Result<BandRow, OrbitError> {
        let place = (point.branch, point.index);
        let heights = [record.amplitude, record.energy];
        let numbers = self.parameters.len();
        if !record.u0.iter().chain(&record.v0).all(|x| x.is_finite()) {
            let note = "its state is damaged".into();
            return Ok(BandRow::without(place, (point.omega, heights), numbers, note));
        }
        let without =
            |note: String| Ok(BandRow::without(place, (point.omega, heights), numbers, note));
        let orbit = match self.orbit(record)? {
            Ok(orbit) => orbit,
            Err(why) => return without(why),
        };
        // those of a series of harmonic balance are of the orbit that it approximates
        let is_other = (orbit.amplitude - record.amplitude).abs() > SAME * record.amplitude.abs();
        let heights = match &point.series {
            Some(_) => [orbit.amplitude, orbit.energy],
            None if is_other => {
                return without(format!(
                    "from its state another orbit is found, of the amplitude {:.6e}",
                    orbit.amplitude
                ));
            }
            None => heights,
        };
        let mut by_frequency = match orbit.closure {
            Closure::Limit => None,
            _ => Some(Parameter::frequency(&self.body.system, orbit.omega())),
        };
        let mut along = match Differentiable::new(&mut self.body, &orbit) {
            Ok(along) => along,
            Err(e @ (OrbitError::Parameter(_) | OrbitError::Large(_))) => {
                return without(e.to_string());
            }
            Err(e) if e.is_of_one_motion() => return without(e.to_string()),
            Err(e) => return Err(e),
        };
        along.peaks.retain(|p| !matches!(p.of, Observable::Pressure(_)));
        let place_of = |of: fn(&Observable) -> bool| along.peaks.iter().position(|p| of(&p.of));
        let of_heights = [
            place_of(|of| matches!(of, Observable::Displacement(_))),
            place_of(|of| matches!(of, Observable::Energy)),
        ];
        let mut derivatives = |parameter: &mut Parameter| -> Result<Heights, OrbitError> {
            let all = along.by(parameter)?;
            Ok(of_heights.map(|k| k.map_or(0.0, |k| all.peaks[k])))
        };
        let mut row = BandRow::without(place, (point.omega, heights), numbers, String::new());
        let asked = self.parameters.iter_mut().zip(&mut row.by);
        for (parameter, derivative) in by_frequency.iter_mut().zip([&mut row.along]).chain(asked) {
            match derivatives(parameter) {
                Ok(found) => *derivative = found,
                Err(e @ OrbitError::Parameter(_)) => row.note = e.to_string(),
                Err(e) if e.is_of_one_motion() => row.note = e.to_string(),
                Err(e) => return Err(e),
            }
        }
        Ok(row)
    }
}

/// The numbers at keys of a scene, refused where the first orbit of a family has no derivative by them.
pub fn check(
    scene: &Scene,
    family: &StoredFamily,
    deviations: &[Deviation],
) -> Result<(), ProblemError> {
    let Some(first) = orbits(family).into_iter().find_map(|p| Some((p, p.orbit.as_ref()?))) else {
        return Ok(());
    };
    Ready::new(scene, (family.branches.get(first.0.branch), first.1), deviations).map(drop)
}

/// What is missing of the bands of a family. An interruption (`take` says so, or `ends_now` meanwhile) leaves whole rows.
pub fn follow(
    (scene, family): (&Scene, &StoredFamily),
    bands: &mut Bands,
    (take, ends_now): (Take, &(dyn Fn() -> bool + Sync)),
) -> Result<Go, FamilyError> {
    let done: BTreeSet<(usize, i64)> = bands.rows.iter().map(|r| (r.branch, r.index)).collect();
    let left: Vec<&PointRecord> =
        orbits(family).into_iter().filter(|p| !done.contains(&(p.branch, p.index))).collect();
    let deviations = bands.deviations.clone();
    let threads = rayon::current_num_threads().clamp(1, left.len().max(1));
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, receiver) = mpsc::sync_channel::<Result<BandRow, FamilyError>>(64);
    let work = |sender: mpsc::SyncSender<Result<BandRow, FamilyError>>| {
        let mut bodies: BTreeMap<usize, Ready> = BTreeMap::new();
        let mut row = |point: &PointRecord| -> Result<Option<BandRow>, FamilyError> {
            let Some(orbit) = &point.orbit else { return Ok(None) };
            let ready = match bodies.entry(point.branch) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => {
                    let branch = (family.branches.get(point.branch), orbit);
                    let ready = Ready::new(scene, branch, &deviations).map_err(|e| failed(&e))?;
                    place.insert(ready)
                }
            };
            Ok(Some(ready.row(point, orbit)?))
        };
        while let Some(point) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
            if stop.load(Ordering::Relaxed) || ends_now() {
                return;
            }
            let found = row(point).transpose();
            if found.is_some_and(|found| sender.send(found).is_err()) {
                return;
            }
        }
    };
    let go = std::thread::scope(|scope| -> Result<Go, FamilyError> {
        for _ in 0..threads {
            let sender = sender.clone();
            scope.spawn(|| work(sender));
        }
        drop(sender);
        let mut go = Go::Continue(());
        let mut failure = None;
        for found in receiver {
            // what other threads still have on the way is taken too
            match found {
                Ok(row) => bands.rows.push(row),
                Err(e) => failure = failure.or(Some(e)),
            }
            let taken = if go.is_continue() && failure.is_none() { take(bands) } else { Ok(go) };
            match taken {
                Ok(taken) => go = taken,
                Err(e) => failure = failure.or(Some(e)),
            }
            if go.is_break() || failure.is_some() {
                stop.store(true, Ordering::Relaxed);
            }
        }
        failure.map_or(Ok(go), Err)
    });
    bands.rows.sort_by_key(|row| (row.branch, row.index));
    let is_whole = bands.rows.len() == orbits(family).len();
    go.map(|go| if is_whole { go } else { Go::Break(()) })
}
