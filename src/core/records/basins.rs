//! Which states lead where: basins of attraction as plain data.

use std::fmt::{Display, Formatter, Result};

use super::AttractorRecord;

/// Where the motion from a state leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// To the attractor of this number.
    Attractor(usize),
    /// Still on its way when the patience was at its end.
    Slow,
    /// It grows without bound.
    Unbounded,
    /// It could not be followed.
    Lost,
    /// The state is inside of an obstacle that does not yield: no motion begins there.
    Inside,
}

impl Fate {
    /// What leads to no attractor.
    pub const OTHERS: [Fate; 4] = [Fate::Slow, Fate::Unbounded, Fate::Lost, Fate::Inside];

    /// As files have it: the number of the attractor, or a negative one.
    pub fn code(self) -> i64 {
        match self {
            Fate::Attractor(k) => k as i64,
            Fate::Slow => -1,
            Fate::Unbounded => -2,
            Fate::Lost => -3,
            Fate::Inside => -4,
        }
    }

    /// From what a file has; none: not computed yet.
    pub fn of_code(code: i64) -> Option<Fate> {
        match usize::try_from(code) {
            Ok(k) => Some(Fate::Attractor(k)),
            Err(_) => Fate::OTHERS.into_iter().find(|fate| fate.code() == code),
        }
    }
}

impl Display for Fate {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Fate::Attractor(k) => write!(f, "attractor {k}"),
            Fate::Slow => f.write_str("not settled"),
            Fate::Unbounded => f.write_str("unbounded"),
            Fate::Lost => f.write_str("lost"),
            Fate::Inside => f.write_str("inside the obstacle"),
        }
    }
}

/// An attractor that basins lead to.
#[derive(Debug, Clone, PartialEq)]
pub struct AttractorFound {
    /// What is seen of it.
    pub seen: AttractorRecord,
    /// How far it goes around its torus in a period of the loads, in turns, with an estimate of the error, if it goes around one.
    pub rotation: Option<(f64, f64)>,
    /// A state of it at phase zero of the loads, in the frame of the body: from there a computation goes on.
    pub x: Vec<f64>,
    /// All displacements at phase zero of the loads: of an orbit one row for each of its periods, else one.
    pub u0: Vec<Vec<f64>>,
    /// All velocities there.
    pub v0: Vec<Vec<f64>>,
    /// Its states at phase zero of the loads along the axes of the basins: those of an orbit, or a cloud.
    pub at: Vec<Vec<f64>>,
}

/// A coordinate of states: an amplitude of a mode, or its velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateAxis {
    /// Mode of the open body (of the phase at rest, where states are told around an equilibrium), from 1.
    pub mode: usize,
    /// Its velocity over its frequency; else its displacement.
    pub is_velocity: bool,
    /// Its range; of a coordinate that is the same for all states its two ends are.
    pub range: (f64, f64),
}

impl StateAxis {
    /// `q1`, `v2`
    pub fn name(&self) -> String {
        format!("{}{}", if self.is_velocity { "v" } else { "q" }, self.mode)
    }

    /// Whether all states have the same.
    pub fn is_fixed(&self) -> bool {
        self.range.0 == self.range.1
    }
}

/// Which states of a box are begun from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Starts {
    /// The middles of so many cells along each of two axes.
    Grid(usize),
    /// So many, drawn uniformly by a generator with this seed.
    Drawn {
        /// How many.
        count: usize,
        /// Seed.
        seed: u64,
    },
}

/// A share of states with its uncertainty, as if they were drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// How many.
    pub count: usize,
    /// `p = k/N`
    pub share: f64,
    /// `√(p(1 − p)/N)`
    pub error: f64,
    /// Wilson's interval of 95 %.
    pub interval: (f64, f64),
}

/// Of the normal distribution: 95 % are within so many standard deviations.
const WITHIN: f64 = 1.959_963_984_540_054;

impl Share {
    /// `k` of `n`.
    pub fn new(k: usize, n: usize) -> Share {
        if n == 0 {
            let none = f64::NAN;
            return Share { count: 0, share: none, error: none, interval: (none, none) };
        }
        let (p, n) = (k as f64 / n as f64, n as f64);
        let z2 = WITHIN * WITHIN;
        let middle = (p + 0.5 * z2 / n) / (1.0 + z2 / n);
        let half = WITHIN / (1.0 + z2 / n) * (p * (1.0 - p) / n + 0.25 * z2 / (n * n)).sqrt();
        Share {
            count: k,
            share: p,
            error: (p * (1.0 - p) / n).sqrt(),
            interval: ((middle - half).max(0.0), (middle + half).min(1.0)),
        }
    }
}

/// Basins of attraction of a forced body.
#[derive(Debug, Clone, PartialEq)]
pub struct Basins {
    /// Circular frequency of the loads.
    pub omega: f64,
    /// Coordinates of the states, those that are the same for all besides.
    pub axes: Vec<StateAxis>,
    /// Which states.
    pub starts: Starts,
    /// Where each leads; none: not computed yet. Of a grid the first axis runs fastest.
    pub fates: Vec<Option<Fate>>,
    /// Periods of the loads that it took to tell.
    pub maps: Vec<usize>,
    /// What they lead to.
    pub attractors: Vec<AttractorFound>,
}

impl Basins {
    /// How many states there are.
    pub fn count(starts: Starts) -> usize {
        match starts {
            Starts::Grid(n) => n * n,
            Starts::Drawn { count, .. } => count,
        }
    }

    /// How many states are told.
    pub fn told(&self) -> usize {
        self.fates.iter().flatten().count()
    }

    /// The share of a fate among the states from which a motion begins.
    pub fn share(&self, fate: Fate) -> Share {
        let all = self.fates.iter().flatten().filter(|f| **f != Fate::Inside).count();
        Share::new(self.fates.iter().flatten().filter(|f| **f == fate).count(), all)
    }

    /// Number the attractors: orbits by their periods and then by their largest force, others behind them.
    pub fn sort(&mut self) {
        let key = |a: &AttractorFound| match a.seen.kind.periods() {
            0 => usize::MAX,
            p => p,
        };
        let mut order: Vec<usize> = (0..self.attractors.len()).collect();
        order.sort_by(|&a, &b| {
            let (a, b) = (&self.attractors[a], &self.attractors[b]);
            let by_force = a.seen.force.total_cmp(&b.seen.force);
            let by_size = || a.seen.amplitude().total_cmp(&b.seen.amplitude());
            key(a).cmp(&key(b)).then(by_force).then_with(by_size)
        });
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| place[old] = new);
        self.attractors = order.iter().map(|&old| self.attractors[old].clone()).collect();
        for fate in self.fates.iter_mut().flatten() {
            if let Fate::Attractor(k) = fate {
                *k = place[*k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fates_are_found_by_their_codes() {
        for fate in Fate::OTHERS.into_iter().chain([Fate::Attractor(0), Fate::Attractor(7)]) {
            assert_eq!(Fate::of_code(fate.code()), Some(fate));
        }
        assert_eq!(Fate::of_code(-9), None);
    }

    /// Wilson's interval has for its ends the shares from which what was seen is z standard deviations away.
    #[test]
    fn ends_of_an_interval_are_z_deviations_away() {
        for (k, n) in [(589, 1000), (1, 40), (12, 13)] {
            let s = Share::new(k, n);
            for end in [s.interval.0, s.interval.1] {
                let away = (s.share - end).abs() / (end * (1.0 - end) / n as f64).sqrt();
                assert!((away - 1.96).abs() < 1e-3, "{k}/{n}: {away}");
            }
        }
        let none = Share::new(0, 50);
        assert_eq!((none.share, none.error, none.interval.0), (0.0, 0.0, 0.0));
        assert!((none.interval.1 - 0.0713).abs() < 1e-4);
    }
}
