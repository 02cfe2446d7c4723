//! What determines a family of orbits, but for its range.
//!
//! Two files of one kind hold the same points wherever both have points; a file may be gone on with, or its range be widened, by a
//! command of the same kind only.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::{Peak, bits};

/// Method, way of walking, options, and the problem.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FamilyKind {
    /// How a point is computed.
    pub method: PointMethod,
    /// How the next one is chosen.
    pub walk: Walk,
    /// Everything that it hangs on beside the text of its scene, as one number (`fingerprint`).
    pub problem: u64,
}

/// How a point of a family is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub enum PointMethod {
    /// In time.
    #[default]
    Shooting,
    /// In time: the viscous nonlinear mode.
    Viscous {
        /// `β` of `C = βK − αM`.
        #[serde(with = "bits::one")]
        beta: f64,
        /// The mode it is pinned to, from 1.
        mode: usize,
    },
    /// By harmonic balance.
    HarmonicBalance {
        /// The equation solved for the acceleration, in place of the balance of forces.
        acceleration: bool,
        /// Samples a period (AFT); none: switches resolved.
        samples: Option<usize>,
        /// An orbit was shot from every point.
        shot: bool,
    },
    /// By harmonic balance: the viscous nonlinear mode, the equation solved for the acceleration.
    ViscousBalance {
        /// `β` of `C = βK − αM`.
        #[serde(with = "bits::one")]
        beta: f64,
        /// The mode it is pinned to, from 1.
        mode: usize,
        /// An orbit was shot from every point.
        shot: bool,
    },
    /// By harmonic balance: the damped nonlinear mode of a body with friction.
    DampedMode {
        /// The mode of the body that sticks, from 1.
        mode: usize,
    },
    /// Of a bar by boundary elements in the frequency domain.
    BoundaryElements,
    /// Given by a file, checked in time.
    Check {
        /// The cause of failures was not looked for.
        quick: bool,
    },
}

/// How a family is walked through.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub enum Walk {
    /// At each frequency of a grid: a backbone.
    Grid(Grid),
    /// At each frequency of a grid a response: by harmonic balance once upwards and once downwards, of a body with friction upwards.
    Response(Grid),
    /// Along the branch, from an orbit in both directions.
    Branch {
        /// Frequency of the orbit.
        #[serde(with = "bits::one")]
        start: f64,
        /// First step.
        #[serde(with = "bits::one")]
        step: f64,
        /// Changes of stability are located.
        locate: bool,
        /// In steps of frequency.
        natural: bool,
    },
    /// Along the branch, upwards from the orbit at the low end of the range.
    Upwards {
        /// Frequency of the orbit.
        #[serde(with = "bits::one")]
        start: f64,
        /// Largest step.
        #[serde(with = "bits::one")]
        step: f64,
        /// Changes of stability are located.
        locate: bool,
    },
    /// At each frequency of a grid what the body settles to from where it was: sweeps.
    Sweep {
        /// Frequencies.
        grid: Grid,
        /// Periods at each; none: until it has settled.
        dwell: Option<usize>,
    },
    /// From amplitude to amplitude.
    Amplitudes {
        /// The lowest.
        #[serde(with = "bits::one")]
        low: f64,
        /// The highest.
        #[serde(with = "bits::one")]
        high: f64,
        /// Decades between two.
        #[serde(with = "bits::one")]
        step: f64,
    },
    /// Point by point as a file gives them.
    #[default]
    Given,
}

/// Frequencies `origin + k step`, `k ∈ ℤ`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Frequency of `k = 0`.
    #[serde(with = "bits::one")]
    pub origin: f64,
    /// Distance.
    #[serde(with = "bits::one")]
    pub step: f64,
}

impl Grid {
    /// Frequency of `k`.
    pub fn at(&self, k: i64) -> f64 {
        self.origin + k as f64 * self.step
    }

    /// The numbers of the frequencies within a range, to rounding.
    pub fn within(&self, (low, high): (f64, f64)) -> RangeInclusive<i64> {
        let place = |w: f64| (w - self.origin) / self.step;
        (place(low) - 1e-9).ceil() as i64..=(place(high) + 1e-9).floor() as i64
    }

    /// Whether a frequency is one of the grid's, to a millionth of a step.
    pub fn holds(&self, omega: f64) -> bool {
        let k = (omega - self.origin) / self.step;
        (k - k.round()).abs() < 1e-6
    }
}

impl Walk {
    /// The amplitude of a point, where one goes from amplitude to amplitude.
    pub fn amplitude(&self, index: i64) -> Option<f64> {
        match self {
            Walk::Amplitudes { low, step, .. } => Some(low * 10f64.powf(step * index as f64)),
            _ => None,
        }
    }

    /// All of them.
    pub fn amplitudes(&self) -> Vec<f64> {
        let Walk::Amplitudes { low, high, step } = self else { return vec![] };
        let last = ((high / low).log10() / step + 1e-9).floor() as i64;
        (0..=last).filter_map(|k| self.amplitude(k)).collect()
    }

    /// The grid, if there is one.
    pub fn grid(&self) -> Option<Grid> {
        match self {
            Walk::Grid(grid) | Walk::Response(grid) | Walk::Sweep { grid, .. } => Some(*grid),
            _ => None,
        }
    }
}

impl FamilyKind {
    /// What makes `asked` another kind, in words; nothing if it is the same.
    pub fn difference(&self, asked: &FamilyKind) -> Option<String> {
        if self.problem != asked.problem {
            return Some("the files that the scene names have changed since, or another version of signorini made it".into());
        }
        let same_walk = match (self.walk, asked.walk) {
            (Walk::Sweep { dwell: a, .. }, Walk::Sweep { dwell: b, .. }) if a != b => false,
            (Walk::Grid(a), Walk::Grid(b))
            | (Walk::Response(a), Walk::Response(b))
            | (Walk::Sweep { grid: a, .. }, Walk::Sweep { grid: b, .. }) => {
                if a.step == b.step && !a.holds(b.origin) {
                    return Some(format!(
                        "its frequencies are {} + k × {}, and {} is none of them",
                        a.origin, a.step, b.origin
                    ));
                }
                a.step == b.step
            }
            (a, b) => a == b,
        };
        (self.method != asked.method || !same_walk)
            .then(|| format!("it was made by: {self}; this is: {asked}"))
    }
}

impl PointMethod {
    /// Whether the body is kept going by a feedback, `−αM u̇`.
    pub fn is_fed(&self) -> bool {
        self.viscosity().is_some() || matches!(self, PointMethod::DampedMode { .. })
    }

    /// `β`, if the orbits are those of a viscous body.
    pub fn viscosity(&self) -> Option<f64> {
        match self {
            PointMethod::Viscous { beta, .. } | PointMethod::ViscousBalance { beta, .. } => {
                Some(*beta)
            }
            _ => None,
        }
    }
}

impl FamilyKind {
    /// The kind without its numbers.
    pub fn outline(&self) -> Outline {
        let solver = match self.method {
            PointMethod::Shooting => Solver::Shooting,
            PointMethod::Viscous { .. } => Solver::Viscous,
            PointMethod::HarmonicBalance { .. }
            | PointMethod::ViscousBalance { .. }
            | PointMethod::DampedMode { .. }
            | PointMethod::BoundaryElements => Solver::HarmonicBalance,
            PointMethod::Check { .. } => Solver::Check,
        };
        let way = match self.walk {
            Walk::Grid(_) | Walk::Given => Way::Sequential,
            Walk::Response(_) | Walk::Upwards { .. } => Way::Response,
            Walk::Sweep { .. } => Way::Sweep,
            Walk::Branch { natural: false, .. } => Way::Arclength,
            Walk::Branch { natural: true, .. } => Way::Natural,
            Walk::Amplitudes { .. } => Way::Amplitudes,
        };
        Outline { solver, way }
    }
}

impl std::fmt::Display for FamilyKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.outline())?;
        match self.method {
            PointMethod::Shooting => {}
            PointMethod::Viscous { beta, mode } => write!(f, ", beta {beta}, mode {mode}")?,
            PointMethod::HarmonicBalance { acceleration, samples, shot } => {
                let form = if acceleration { "acceleration" } else { "force" };
                write!(f, ", {form} form")?;
                if let Some(n) = samples {
                    write!(f, ", {n} samples")?;
                }
                if shot {
                    write!(f, ", orbits shot")?;
                }
            }
            PointMethod::ViscousBalance { beta, mode, shot } => {
                let shot = if shot { ", orbits shot" } else { "" };
                write!(f, ", viscous, beta {beta}, mode {mode}{shot}")?;
            }
            PointMethod::DampedMode { mode } => write!(f, ", damped mode {mode}")?,
            PointMethod::BoundaryElements => write!(f, ", boundary elements")?,
            PointMethod::Check { quick } => write!(f, "{}", if quick { ", quick" } else { "" })?,
        }
        match self.walk {
            Walk::Grid(g) | Walk::Response(g) => write!(f, ", step {}", g.step),
            Walk::Branch { start, step, locate, .. } | Walk::Upwards { start, step, locate } => {
                let located = if locate { ", stability located" } else { "" };
                write!(f, ", step {step}, from {start}{located}")
            }
            Walk::Sweep { grid, dwell } => {
                let periods = dwell.map_or(String::new(), |n| format!(", {n} periods at each"));
                write!(f, ", step {}{periods}", grid.step)
            }
            Walk::Amplitudes { low, high, step } => {
                write!(f, ", amplitudes from {low} to {high}, {step} decades apart")
            }
            Walk::Given => Ok(()),
        }
    }
}

/// A kind of family without its numbers; the first words of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outline {
    /// What computes a point.
    pub solver: Solver,
    /// How the next one is chosen.
    pub way: Way,
}

/// What computes a point of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Shooting.
    Shooting,
    /// Shooting of the viscous nonlinear mode.
    Viscous,
    /// Harmonic balance.
    HarmonicBalance,
    /// Shooting from the points of another file.
    Check,
}

/// How a family is walked through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Frequency by frequency.
    Sequential,
    /// A forced response.
    Response,
    /// What a body settles to, frequency by frequency.
    Sweep,
    /// By arclength.
    Arclength,
    /// In steps of frequency along the branch.
    Natural,
    /// From amplitude to amplitude.
    Amplitudes,
}

impl std::fmt::Display for Way {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Way::Sequential => "sequential",
            Way::Response => "response",
            Way::Sweep => "sweep",
            Way::Arclength => "arclength",
            Way::Natural => "natural",
            Way::Amplitudes => "amplitudes",
        })
    }
}

impl Outline {
    /// Whether it is what loads make of a body: branches of responses, sweeps.
    pub fn is_response(&self) -> bool {
        matches!(self.way, Way::Response | Way::Sweep)
    }

    /// Whether a point need not belong together with the one before it: each was found at its own frequency.
    pub(crate) fn is_point_by_point(&self) -> bool {
        match self.way {
            Way::Sequential | Way::Sweep => true,
            Way::Response => self.solver == Solver::HarmonicBalance,
            Way::Arclength | Way::Natural | Way::Amplitudes => false,
        }
    }
}

impl std::fmt::Display for Outline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let solver = match self.solver {
            Solver::Shooting => "shooting",
            Solver::Viscous => "viscous",
            Solver::HarmonicBalance => "hbm",
            Solver::Check => "crosscheck",
        };
        write!(f, "{solver} {}", self.way)
    }
}

/// Why a branch ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum EndReason {
    /// Everything that was asked for is there.
    Range,
    /// As many points as were asked for.
    Points,
    /// It met the branch that it came from.
    Met,
    /// It cannot be followed any further, and nothing else was found beyond.
    #[serde(alias = "Stuck")]
    Lost,
    /// Someone stopped it.
    Interrupted,
}

impl EndReason {
    /// In files.
    pub fn word(self) -> &'static str {
        match self {
            EndReason::Range => "range",
            EndReason::Points => "points",
            EndReason::Met => "met",
            EndReason::Lost => "lost",
            EndReason::Interrupted => "interrupted",
        }
    }
}

/// What a branch says at its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BranchEnd {
    /// Number of the branch.
    pub branch: usize,
    /// Why.
    pub reason: EndReason,
    /// In words.
    pub text: String,
    /// Whether it did what it was asked to do.
    pub complete: bool,
    /// Its peaks, where they were solved for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub peaks: Vec<Peak>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_counts_from_its_origin() {
        let grid = Grid { origin: 1.8, step: 0.005 };
        assert_eq!(grid.within((1.75, 1.84)), -10..=8);
        assert!(grid.holds(1.75) && !grid.holds(1.752));
        assert_eq!(grid.at(0), 1.8);
    }

    #[test]
    fn a_name_begins_with_the_outline() {
        let method = [
            PointMethod::Shooting,
            PointMethod::Viscous { beta: 0.01, mode: 2 },
            PointMethod::HarmonicBalance { acceleration: true, samples: Some(64), shot: true },
            PointMethod::ViscousBalance { beta: 0.01, mode: 1, shot: true },
            PointMethod::Check { quick: true },
        ];
        let grid = Grid { origin: 1.8, step: 0.005 };
        let walk = [
            Walk::Grid(grid),
            Walk::Response(grid),
            Walk::Branch { start: 1.8, step: 0.01, locate: true, natural: false },
            Walk::Branch { start: 1.8, step: 0.01, locate: false, natural: true },
            Walk::Upwards { start: 1.8, step: 0.01, locate: false },
            Walk::Sweep { grid, dwell: Some(20) },
            Walk::Given,
        ];
        for (method, walk) in method.iter().flat_map(|m| walk.iter().map(move |w| (*m, *w))) {
            let kind = FamilyKind { method, walk, problem: 7 };
            assert!(kind.to_string().starts_with(&kind.outline().to_string()));
        }
    }
}
