//! What a branch of a family holds.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

/// What a branch of a family holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Branch {
    /// Orbits by shooting, one at each frequency of a grid.
    Sequential,
    /// Orbits by shooting, along the family.
    Along(Direction),
    /// Solutions of harmonic balance.
    Series {
        /// Number of harmonics.
        harmonics: usize,
        /// Along the family; none: at each frequency of a grid.
        direction: Option<Direction>,
    },
    /// Forced response.
    Response {
        /// Damping ratio in percent; none: the scene's own damping.
        percent: Option<f64>,
        /// Number of harmonics and direction of the walk, by harmonic balance; none: by shooting.
        series: Option<(usize, Direction)>,
    },
    /// Subharmonic orbits of two periods of the loads.
    Doubled {
        /// Damping ratio in percent; none: the scene's own damping.
        percent: Option<f64>,
        /// Frequency of the period doubling at which they begin.
        omega: f64,
    },
    /// What a body does while the frequency of its loads goes up or down.
    Sweep {
        /// Damping ratio in percent; none: the scene's own damping.
        percent: Option<f64>,
        /// Which way the frequency goes.
        direction: Direction,
    },
    /// Orbits along the branch through one of a sweep.
    Through {
        /// Damping ratio in percent; none: the scene's own damping.
        percent: Option<f64>,
        /// Periods of the loads in one of an orbit.
        periods: usize,
        /// Frequency of the orbit of the sweep.
        omega: f64,
        /// Which way it is followed.
        direction: Direction,
    },
    /// Orbits shot from the series of another file.
    Checked {
        /// Number of harmonics of the series.
        harmonics: usize,
    },
}

/// Where a branch goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Direction {
    /// To higher frequencies.
    Up,
    /// To lower frequencies.
    Down,
}

impl Direction {
    /// Both, in the order in which branches stand.
    pub(crate) const BOTH: [Direction; 2] = [Direction::Up, Direction::Down];

    /// `±1`
    pub fn sign(self) -> f64 {
        match self {
            Direction::Up => 1.0,
            Direction::Down => -1.0,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Direction::Up => "up",
            Direction::Down => "down",
        }
    }
}

impl Branch {
    /// Damping ratio in percent, where several were asked for.
    pub fn percent(&self) -> Option<f64> {
        match self {
            Branch::Response { percent, .. }
            | Branch::Doubled { percent, .. }
            | Branch::Sweep { percent, .. }
            | Branch::Through { percent, .. } => *percent,
            _ => None,
        }
    }

    /// Number of harmonics of the series.
    pub fn harmonics(&self) -> Option<usize> {
        match self {
            Branch::Series { harmonics, .. } | Branch::Checked { harmonics } => Some(*harmonics),
            Branch::Response { series, .. } => series.map(|s| s.0),
            _ => None,
        }
    }

    /// Where it goes, if it is walked along.
    pub fn direction(&self) -> Option<Direction> {
        match self {
            Branch::Along(direction)
            | Branch::Sweep { direction, .. }
            | Branch::Through { direction, .. } => Some(*direction),
            Branch::Series { direction, .. } => *direction,
            Branch::Response { series, .. } => series.map(|s| s.1),
            _ => None,
        }
    }
}

impl Display for Branch {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Branch::Sequential => write!(f, "shooting, sequential"),
            Branch::Along(Direction::Up) => write!(f, "shooting, to higher frequencies"),
            Branch::Along(Direction::Down) => write!(f, "shooting, to lower frequencies"),
            Branch::Series { harmonics, direction } => {
                write!(f, "N_h = {harmonics}")?;
                direction.map_or(Ok(()), |d| write!(f, ", {}", d.word()))
            }
            Branch::Response { percent, series } => {
                match percent {
                    Some(percent) => write!(f, "damping ratio {percent} %")?,
                    None => write!(f, "forced response")?,
                }
                series.map_or(Ok(()), |(n_h, d)| write!(f, ", N_h = {n_h}, {}", d.word()))
            }
            Branch::Doubled { percent, omega } => {
                let of = Branch::Response { percent: *percent, series: None };
                write!(f, "{of}, doubled at {omega}")
            }
            Branch::Sweep { percent, direction } => {
                if let Some(percent) = percent {
                    write!(f, "damping ratio {percent} %, ")?;
                }
                write!(f, "sweep {}", direction.word())
            }
            Branch::Through { percent, periods, omega, direction } => {
                if let Some(percent) = percent {
                    write!(f, "damping ratio {percent} %, ")?;
                }
                write!(f, "period {periods} through {omega:.6}, {}", direction.word())
            }
            Branch::Checked { harmonics } => write!(f, "orbits shot from N_h = {harmonics}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_branch_is_read_as_it_was_written() {
        let walks = [None, Some(Direction::Up), Some(Direction::Down)];
        let mut all = vec![Branch::Sequential, Branch::Checked { harmonics: 7 }];
        let doubled = |percent| Branch::Doubled { percent, omega: 1.539_028_15 };
        all.extend([None, Some(1.0)].map(doubled));
        all.extend(Direction::BOTH.map(Branch::Along));
        all.extend(walks.map(|direction| Branch::Series { harmonics: 11, direction }));
        for percent in [None, Some(0.5), Some(100.0 * 0.07)] {
            let series = walks.map(|walk| walk.map(|d| (3, d)));
            all.extend(series.map(|series| Branch::Response { percent, series }));
            all.extend(Direction::BOTH.map(|direction| Branch::Sweep { percent, direction }));
        }
        for branch in all {
            let json = serde_json::to_string(&branch).unwrap();
            assert_eq!(serde_json::from_str::<Branch>(&json).unwrap(), branch, "{json}");
        }
    }

    #[test]
    fn names_say_what_a_branch_holds() {
        let series = Some((11, Direction::Up));
        let branch = Branch::Response { percent: Some(0.5), series };
        assert_eq!(branch.to_string(), "damping ratio 0.5 %, N_h = 11, up");
        let doubled = Branch::Doubled { percent: None, omega: 1.5 };
        assert_eq!(doubled.to_string(), "forced response, doubled at 1.5");
    }
}
