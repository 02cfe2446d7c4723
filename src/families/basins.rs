//! Basins of attraction: where the motions from many states lead under loads of one frequency.
//!
//! The states come one after the other from a list, in batches, on all threads. What is recognised in a batch are the attractors of the batches before it, and what a batch finds anew is
//! compared and numbered behind it in the order of the list: nothing depends on which thread was faster, nor on where an earlier run was interrupted.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{FamilyError, uniform};
use crate::contact::{State, System};
use crate::continuation::Go;
use crate::orbit::attractor::Attractor;
use crate::orbit::basin::{Destination, Known, destination};
use crate::orbit::rotation::rotation_number;
use crate::orbit::{OrbitError, Propagator};
use crate::problem::ModeShape;
use crate::records::{AttractorFound, AttractorKind, Basins, Fate, Starts, StateAxis};

/// States of the first batch, and of the largest: each is twice the one before.
const BATCH: (usize, usize) = (4, 128);
/// So many attractors are a family of them, or none at all.
const MOST: usize = 100;
/// A state is inside of an obstacle by more than this, over the unit of length.
const INSIDE: f64 = 1e-9;

/// What states are made of.
#[derive(Debug, Clone)]
pub struct Plane {
    /// The state that they are told around.
    pub around: State,
    /// The coordinates.
    pub axes: Vec<StateAxis>,
    /// The shape of each.
    pub shapes: Vec<ModeShape>,
}

impl Plane {
    /// The coordinates of frame vectors along the axes: modes are orthogonal in the energy.
    fn along(&self, body: &Propagator, states: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let count = self.axes.len();
        let origin = body.frame(&self.around);
        let from = |z: &[f64]| -> Vec<f64> { z.iter().zip(&origin).map(|(z, o)| z - o).collect() };
        let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let unit = |k: usize| {
            let at: Vec<f64> = (0..count).map(|j| f64::from(u8::from(j == k))).collect();
            from(&body.frame(&self.state(&at)))
        };
        let units: Vec<Vec<f64>> = (0..count).map(unit).collect();
        let coordinates = |z: &Vec<f64>| {
            let away = from(z);
            units.iter().map(|unit| inner(&away, unit) / inner(unit, unit)).collect()
        };
        states.iter().map(coordinates).collect()
    }

    /// The state with some coordinates.
    pub fn state(&self, at: &[f64]) -> State {
        let mut state = self.around.clone();
        for ((axis, shape), x) in self.axes.iter().zip(&self.shapes).zip(at) {
            let (into, scale) = match axis.is_velocity {
                false => (&mut state.u, *x),
                true => (&mut state.v, x * shape.omega),
            };
            into.iter_mut().zip(&shape.u).for_each(|(into, u)| *into += scale * u);
        }
        state
    }
}

/// The coordinates of all states, along all axes.
pub fn coordinates(axes: &[StateAxis], starts: Starts) -> Vec<Vec<f64>> {
    let along = |axis: &StateAxis, share: f64| {
        let (low, high) = axis.range;
        if axis.is_fixed() { low } else { low + share * (high - low) }
    };
    match starts {
        Starts::Grid(n) => {
            let middle = |k: usize| (k as f64 + 0.5) / n as f64;
            let state = |k: usize| {
                // the first free axis runs fastest
                let mut shares = [middle(k % n), middle(k / n)].into_iter();
                let share = |axis: &StateAxis| match axis.is_fixed() {
                    true => 0.0,
                    false => shares.next().unwrap_or(0.5),
                };
                let shares: Vec<f64> = axes.iter().map(share).collect();
                axes.iter().zip(shares).map(|(axis, share)| along(axis, share)).collect()
            };
            (0..n * n).map(state).collect()
        }
        Starts::Drawn { count, seed } => {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            let mut share = || uniform(&mut generator);
            let mut coordinate = |axis: &StateAxis| match axis.is_fixed() {
                true => axis.range.0,
                false => along(axis, share()),
            };
            (0..count).map(|_| axes.iter().map(&mut coordinate).collect()).collect()
        }
    }
}

/// In which order states are looked at: those of a grid spread over the plane from the first on.
fn order(starts: Starts) -> Vec<usize> {
    let count = Basins::count(starts);
    let Starts::Grid(_) = starts else { return (0..count).collect() };
    let divides = |step: usize| {
        let (mut a, mut b) = (step, count);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a > 1
    };
    // the golden section
    let mut step = (0.618_034 * count as f64).round().max(1.0) as usize;
    while divides(step) && step < count {
        step += 1;
    }
    (0..count).map(|k| (k * step) % count).collect()
}

/// The ends of the batches of a list.
fn batches(count: usize) -> Vec<usize> {
    let (mut size, most) = BATCH;
    let mut ends = vec![];
    let mut end = 0;
    while end < count {
        end = (end + size).min(count);
        ends.push(end);
        size = (2 * size).min(most);
    }
    ends
}

/// What the threads share.
struct Board<'a> {
    basins: &'a mut Basins,
    known: Arc<Vec<Known>>,
    /// Ends of the batches that are left; the first is that of the batch in work.
    ends: Vec<usize>,
    /// The next place of the list.
    next: usize,
    /// How many are in work.
    running: usize,
    /// What motions of this batch settled to by themselves, by their places in the list.
    fresh: Vec<(usize, Box<Attractor>)>,
    over: bool,
    failed: Option<FamilyError>,
    take: Take<'a>,
}

/// Told of what is known after each state.
pub type Take<'a> = &'a mut (dyn FnMut(&Basins) -> Result<Go, FamilyError> + Send);

/// A place of the list, with what is recognised.
type Next = (usize, Arc<Vec<Known>>);

/// What does not change.
struct Work<'a> {
    system: &'a System,
    plane: &'a Plane,
    at: Vec<Vec<f64>>,
    list: Vec<usize>,
    omega: f64,
    stop: Arc<AtomicBool>,
    board: Mutex<Board<'a>>,
    changed: Condvar,
}

/// How often it is asked whether to end, while motions are followed.
const LOOK: Duration = Duration::from_millis(50);

/// What is missing of some basins. An interruption (`take` says so, or `ends_now` while motions are followed) leaves what is told.
pub fn find(
    system: &System,
    plane: &Plane,
    basins: &mut Basins,
    (take, ends_now): (Take, &(dyn Fn() -> bool + Sync)),
) -> Result<(), FamilyError> {
    let list = order(basins.starts);
    let mut ends = batches(list.len());
    let is_left =
        |from: usize, to: usize| list[from..to].iter().any(|&i| basins.fates[i].is_none());
    // whole batches stay as they are
    let mut begin = 0;
    while let Some(&end) = ends.first().filter(|end| !is_left(begin, **end)) {
        ends.remove(0);
        begin = end;
    }
    if ends.is_empty() {
        return Ok(());
    }
    let omega = basins.omega;
    let mut body = propagator(system)?;
    let known = basins.attractors.iter().map(|a| {
        let known = Known::new(&mut body, &a.seen, &a.x, omega)?;
        known.ok_or(FamilyError::Place)
    });
    let known = Arc::new(known.collect::<Result<Vec<_>, FamilyError>>()?);
    let work = Work {
        system,
        plane,
        at: coordinates(&basins.axes, basins.starts),
        list,
        omega,
        stop: Arc::default(),
        board: Mutex::new(Board {
            basins,
            known,
            ends,
            next: begin,
            running: 0,
            fresh: vec![],
            over: false,
            failed: None,
            take,
        }),
        changed: Condvar::new(),
    };
    let take_part = |_: rayon::BroadcastContext| {
        // a thread that ends abnormally must not let the others wait
        let result = catch_unwind(AssertUnwindSafe(|| work.take_part()));
        let (failed, panic) = match result {
            Ok(Ok(())) => return,
            Ok(Err(e)) => (Some(e), None),
            Err(panic) => (None, Some(panic)),
        };
        let mut board = work.lock();
        if board.failed.is_none() {
            board.failed = failed;
        }
        work.end(&mut board);
        drop(board);
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    };
    std::thread::scope(|scope| {
        // one more thread, which computes nothing
        scope.spawn(|| {
            while !work.stop.load(Ordering::Relaxed) {
                if ends_now() {
                    work.end(&mut work.lock());
                }
                std::thread::sleep(LOOK);
            }
        });
        rayon::broadcast(take_part);
        work.stop.store(true, Ordering::Relaxed);
    });
    let board = work.board.into_inner().unwrap_or_else(PoisonError::into_inner);
    board.failed.map_or(Ok(()), Err)
}

fn propagator(system: &System) -> Result<Propagator, FamilyError> {
    Ok(Propagator::new(system.clone()).map_err(OrbitError::from)?)
}

impl<'a> Work<'a> {
    fn lock(&self) -> MutexGuard<'_, Board<'a>> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All threads end.
    fn end(&self, board: &mut Board) {
        board.over = true;
        self.stop.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    /// A thread: state after state.
    fn take_part(&self) -> Result<(), FamilyError> {
        let mut body = propagator(self.system)?;
        body.stop = Some(Arc::clone(&self.stop));
        while let Some((place, known)) = self.next(&mut body)? {
            let found = self.follow(&mut body, self.list[place], &known);
            let mut board = self.lock();
            board.running -= 1;
            match found {
                Ok(found) => board.tell(place, self.list[place], found),
                Err(OrbitError::Stopped) => return Ok(()),
                Err(e) => return Err(e.into()),
            }
            let Board { take, basins, .. } = &mut *board;
            match take(basins)? {
                Go::Break(()) => self.end(&mut board),
                Go::Continue(()) => self.changed.notify_all(),
            }
        }
        Ok(())
    }

    /// The next place of the list, with what is recognised; none where all is over.
    fn next(&self, body: &mut Propagator) -> Result<Option<Next>, FamilyError> {
        let mut board = self.lock();
        loop {
            let Some(&end) = board.ends.first().filter(|_| !board.over) else { return Ok(None) };
            while board.next < end && board.basins.fates[self.list[board.next]].is_some() {
                board.next += 1;
            }
            if board.next < end {
                board.next += 1;
                board.running += 1;
                return Ok(Some((board.next - 1, Arc::clone(&board.known))));
            }
            if board.running > 0 {
                board = self.changed.wait(board).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            board.close(body, self.plane, &self.list)?;
            self.changed.notify_all();
        }
    }

    /// Where the motion from a state leads.
    fn follow(
        &self,
        body: &mut Propagator,
        index: usize,
        known: &[Known],
    ) -> Result<Option<Destination>, OrbitError> {
        let state = self.plane.state(&self.at[index]);
        if is_inside(self.system, &state) {
            return Ok(None);
        }
        let z = body.frame(&state);
        destination(body, &z, self.omega, known).map(Some)
    }
}

/// Whether a state is inside of an obstacle that does not yield, where contact displacements do not follow from the conditions of contact.
fn is_inside(system: &System, state: &State) -> bool {
    if system.impact().is_none() {
        return false;
    }
    // contact displacements are among those of the body, and nothing follows them
    let mut full = state.u.clone();
    full.resize(system.n(), 0.0);
    let along = system.along_normals(&full);
    let unit = system.units.length;
    along.iter().zip(&system.constraints).any(|(u, c)| u - c.gap > INSIDE * unit)
}

impl Board<'_> {
    /// Where the motion from state `index`, at a place of the list, led; none: it is inside of an obstacle.
    fn tell(&mut self, place: usize, index: usize, found: Option<Destination>) {
        let (fate, maps) = match found {
            None => (Fate::Inside, 0),
            Some(Destination::Known(k, maps)) => (Fate::Attractor(k), maps),
            Some(Destination::Undecided(maps)) => (Fate::Slow, maps),
            Some(Destination::Settled(attractor)) => {
                let maps = attractor.seen.maps;
                let fate = match attractor.seen.kind {
                    AttractorKind::Slow | AttractorKind::Transient => Fate::Slow,
                    AttractorKind::Unbounded => Fate::Unbounded,
                    AttractorKind::Lost => Fate::Lost,
                    _ => {
                        self.basins.maps[index] = maps;
                        self.fresh.push((place, attractor));
                        return;
                    }
                };
                (fate, maps)
            }
        };
        self.basins.fates[index] = Some(fate);
        self.basins.maps[index] = maps;
    }

    /// Compare and number what a batch found, and go on to the next one.
    fn close(
        &mut self,
        body: &mut Propagator,
        plane: &Plane,
        list: &[usize],
    ) -> Result<(), FamilyError> {
        let mut fresh = std::mem::take(&mut self.fresh);
        fresh.sort_by_key(|(place, _)| *place);
        let mut all = Vec::clone(&self.known);
        for (place, attractor) in fresh {
            let omega = self.basins.omega;
            let known = Known::new(body, &attractor.seen, &attractor.z, omega)?;
            self.basins.fates[list[place]] = Some(match known {
                None => Fate::Lost,
                Some(known) => Fate::Attractor(match all.iter().position(|a| a.is(body, &known)) {
                    Some(k) => k,
                    None => {
                        let at = plane.along(body, known.states());
                        let found = found(body, (&attractor, &known), at, omega)?;
                        self.basins.attractors.push(found);
                        all.push(known);
                        all.len() - 1
                    }
                }),
            });
            if all.len() > MOST {
                return Err(FamilyError::Many(all.len()));
            }
        }
        self.known = Arc::new(all);
        self.ends.remove(0);
        Ok(())
    }
}

/// An attractor with all that is kept of it.
fn found(
    body: &mut Propagator,
    (attractor, known): (&Attractor, &Known),
    at: Vec<Vec<f64>>,
    omega: f64,
) -> Result<AttractorFound, FamilyError> {
    body.system.loads_mut().set_frequency(omega);
    let count = attractor.seen.kind.periods().max(1);
    let rotation = match attractor.seen.kind {
        AttractorKind::QuasiPeriodic => rotation_number(known.states()),
        _ => None,
    };
    let full = |z: &Vec<f64>| body.state(z).full(&body.system);
    let states = known.states().iter().take(count).map(full);
    let states = states.collect::<Result<Vec<_>, _>>().map_err(OrbitError::from)?;
    let nodal = |(u, v): (Vec<f64>, Vec<f64>)| {
        let of = |x: &[f64]| body.system.body.nodal(x).into_owned();
        (of(&u), of(&v))
    };
    let (u0, v0) = states.into_iter().map(nodal).unzip();
    Ok(AttractorFound {
        seen: attractor.seen.clone(),
        rotation,
        x: attractor.z.clone(),
        u0,
        v0,
        at,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(name: (usize, bool), range: (f64, f64)) -> StateAxis {
        StateAxis { mode: name.0, is_velocity: name.1, range }
    }

    #[test]
    fn a_list_has_every_state_once_and_spreads() {
        for n in [1, 2, 3, 10, 49, 50] {
            let list = order(Starts::Grid(n));
            let mut sorted = list.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..n * n).collect::<Vec<_>>());
        }
        // of the first sixteen of 50 × 50 four or so are in each quarter
        let list = order(Starts::Grid(50));
        let in_quarter = |k: &&usize| **k % 50 < 25 && **k / 50 < 25;
        let count = list[..16].iter().filter(in_quarter).count();
        assert!((2..=6).contains(&count), "{count}");
    }

    #[test]
    fn batches_cover_a_list() {
        assert_eq!(batches(4), [4]);
        assert_eq!(batches(30), [4, 12, 28, 30]);
        assert_eq!(batches(600).last(), Some(&600));
    }

    #[test]
    fn coordinates_are_middles_of_cells_or_drawn() {
        let axes = [
            axis((1, false), (-2.0, 2.0)),
            axis((2, false), (0.5, 0.5)),
            axis((1, true), (0.0, 1.0)),
        ];
        let grid = coordinates(&axes, Starts::Grid(2));
        let expected = [[-1.0, 0.5, 0.25], [1.0, 0.5, 0.25], [-1.0, 0.5, 0.75], [1.0, 0.5, 0.75]];
        assert_eq!(grid, expected);
        let drawn = coordinates(&axes, Starts::Drawn { count: 4000, seed: 3 });
        let mean = |k: usize| drawn.iter().map(|x| x[k]).sum::<f64>() / 4000.0;
        assert!(mean(0).abs() < 0.07 && mean(1) == 0.5 && (mean(2) - 0.5).abs() < 0.02);
        assert!(drawn.iter().all(|x| (-2.0..2.0).contains(&x[0]) && (0.0..1.0).contains(&x[2])));
        let more = coordinates(&axes, Starts::Drawn { count: 4001, seed: 3 });
        assert_eq!(more[..4000], drawn);
        assert_ne!(coordinates(&axes, Starts::Drawn { count: 1, seed: 4 })[0], drawn[0]);
    }
}
