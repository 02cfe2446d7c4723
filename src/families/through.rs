//! Branches through the orbits that sweeps met: of several periods of the loads, isolas that no other branch leads to, and what lies between as unstable orbits.
//!
//! Of every stretch of a sweep without a change one orbit is a seed. From it the branch is followed both ways, until it leaves the range, closes, or meets one that
//! is there already; a seed that lies on an earlier branch is none.

use super::follow::{self, BranchTask, Glimpse, Take, Trace};
use super::{FamilyError, Known, ended};
use crate::continuation::{Go, Options};
use crate::orbit::along::Start;
use crate::orbit::search::{Effort, find};
use crate::orbit::{Closure, Propagator};
use crate::records::{Branch, BranchEnd, Direction, EndReason, PointRecord};
use crate::store::StoredFamily;

/// An orbit of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Seed {
    /// Damping ratio of its sweep in percent.
    pub percent: Option<f64>,
    /// Periods of the loads in one of it.
    pub periods: usize,
    /// Frequency.
    pub omega: f64,
    /// Frame vector.
    pub z: Vec<f64>,
    seen: Glimpse,
}

/// Orbits of both directions at one frequency whose energies differ by less, relative, are one.
const SAME: f64 = 1e-6;

impl Seed {
    fn of(p: &PointRecord, percent: Option<f64>) -> Option<Seed> {
        let (orbit, place) = (p.orbit.as_ref()?, p.place.as_ref()?);
        let (&omega, z) = place.x.split_last()?;
        let (periods, seen) = (orbit.periods, Glimpse { omega, ..Glimpse::of(p)? });
        Some(Seed { percent, periods, omega, z: z.to_vec(), seen })
    }

    fn is_same(&self, other: &Seed) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= SAME * a.abs().max(b.abs());
        self.percent == other.percent
            && self.periods == other.periods
            && near(self.omega, other.omega)
            && near(self.seen.energy, other.seen.energy)
    }

    fn closure(&self) -> Closure {
        Closure::Forced(self.periods)
    }
}

/// The seeds of the sweeps of a family, in their order.
pub fn seeds(family: &StoredFamily) -> Vec<Seed> {
    let mut seeds: Vec<Seed> = vec![];
    let mut seen: Vec<Seed> = vec![];
    for (k, branch) in family.branches.iter().enumerate() {
        let mut stretches: Vec<Vec<Seed>> = vec![vec![]];
        for p in family.branch(k) {
            if p.special.is_another_motion() || p.orbit.is_none() {
                stretches.push(vec![]);
            }
            if let Some(last) = stretches.last_mut() {
                last.extend(Seed::of(p, branch.percent()));
            }
        }
        let middles = stretches.iter().filter_map(|s| s.get(s.len() / 2));
        // what the sweep the other way saw at the same frequency is there already
        let new = |s: &&Seed| !seen.iter().any(|other| other.is_same(s));
        seeds.extend(middles.filter(new).cloned());
        seen.extend(stretches.into_iter().flatten());
    }
    seeds.sort_by(|a, b| a.percent.partial_cmp(&b.percent).unwrap_or(std::cmp::Ordering::Equal));
    seeds
}

/// The branches through seeds: two each, up and down.
pub fn branches(seeds: &[Seed]) -> Vec<Branch> {
    let both = |s: &Seed| {
        let (percent, periods, omega) = (s.percent, s.periods, s.omega);
        Direction::BOTH.map(|direction| Branch::Through { percent, periods, omega, direction })
    };
    seeds.iter().flat_map(both).collect()
}

/// So many points in a row on an earlier branch mean that it is met.
const MET: usize = 3;

/// A branch that is there already.
struct Way {
    index: usize,
    periods: usize,
    trace: Trace,
}

/// Follow the branches through the seeds of one body, the first of which has the number `first`.
pub fn follow(
    body: &mut Propagator,
    seeds: &[Seed],
    (first, known, options): (usize, &Known, &Options),
    take: Take,
) -> Result<Vec<BranchEnd>, FamilyError> {
    let (mut ways, mut ends): (Vec<Way>, Vec<BranchEnd>) = (vec![], vec![]);
    for (k, seed) in seeds.iter().enumerate() {
        let of_seed = |way: &&Way| way.periods == seed.periods && way.trace.knows(seed.seen, 0);
        let on = ways.iter().find(of_seed).map(|way| way.index);
        let mut own: Vec<Way> = vec![];
        let mut is_closed = false;
        for (d, direction) in Direction::BOTH.into_iter().enumerate() {
            let index = first + 2 * k + d;
            let there = |text: String| ended(index, EndReason::Met, text, true);
            if let Some(on) = on {
                ends.push(there(format!("lies on branch {}", on + 1)));
                continue;
            }
            if is_closed {
                ends.push(there("the branch is closed".into()));
                continue;
            }
            let earlier = known.branch(index);
            // an earlier run may have closed it
            is_closed = known.end(index).is_some() && Trace::comes_back(&earlier);
            let mut trace = Trace::of(&earlier);
            let mut met = (0, None);
            let mut watched = |mut point: PointRecord| {
                point.branch = index;
                trace.add(&point);
                let way = Glimpse::of(&point).and_then(|at| {
                    ways.iter().find(|w| w.periods == seed.periods && w.trace.knows(at, 0))
                });
                met = way.map_or((0, None), |way| (met.0 + 1, Some(way.index)));
                match take(point) {
                    Go::Continue(()) if trace.retraced || met.0 >= MET => Go::Break(()),
                    go => go,
                }
            };
            let task = BranchTask { index, known, options, points_suffice: false };
            let start = |body: &mut Propagator| {
                let verdict =
                    find(body, seed.closure(), &seed.z, seed.omega, &Effort::of(seed.closure()))?;
                Ok(match verdict.orbit() {
                    Some(orbit) => Ok(Start::Orbit(Box::new(orbit.clone()), direction.sign())),
                    None => Err(format!("the orbit of the sweep is not found again: {verdict}")),
                })
            };
            let mut end = follow::orbits(body, seed.closure(), task, start, &mut watched)?;
            if end.reason == EndReason::Interrupted {
                match met {
                    (MET.., Some(way)) => end = there(format!("meets branch {}", way + 1)),
                    _ if trace.retraced => {
                        is_closed = true;
                        end = there(format!("comes back along itself at {:.9}", trace.omega()));
                    }
                    _ => {
                        ends.push(end);
                        return Ok(ends);
                    }
                }
            }
            ends.push(BranchEnd { branch: index, ..end });
            own.push(Way { index, periods: seed.periods, trace });
        }
        ways.extend(own);
    }
    Ok(ends)
}
