//! What a point of a family is: a regular one, or what is special about it.
//!
//! In files (the column `special` of `/backbone`, JSON, the journal) a kind stands as a name: one word, and behind a colon its details.
//! A name is written by [`std::fmt::Display`] and read by [`PointKind::of_name`], here and nowhere else. A column of HDF5 has room
//! for 127 characters, more than any name that says more than words: details that were cut off are kept as the words that are left, and every name that is read is printed as it was.

use std::borrow::Cow;
use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

use super::VerdictKind;

/// What a point of a family is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum PointKind {
    /// Nothing special.
    #[default]
    Regular,
    /// The first point of a branch.
    Start,
    /// Far from what the points before it let expect: another branch.
    Jump,
    /// An end of the range of frequencies.
    EndOfRange,
    /// The frequency turns back.
    Fold,
    /// A simple branch point.
    BranchPoint,
    /// Multipliers cross the unit circle.
    Stability(StabilityChange),
    /// The sequence of switches changes; in words, which contact does what.
    Border(String),
    /// A solution of harmonic balance with touches of which it is not known whether they are contacts: their number.
    Undecided(usize),
    /// A solution of harmonic balance from which shooting reaches no orbit that it approximates, and its verdict.
    NoOrbitNear(VerdictKind),
    /// A solution of harmonic balance with an orbit near it, whose multipliers are not known: a grazing, or a body that is too large for them.
    NotExamined,
    /// A frequency without a solution.
    Gap(GapReason),
    /// A solution of the equations that is no orbit, and what speaks against it.
    Failed(String),
    /// A name of another version, or of a damaged file.
    Other(String),
}

/// How multipliers cross the unit circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bifurcation {
    /// A real one through +1.
    PlusOne,
    /// A real one through −1.
    PeriodDoubling,
    /// A complex pair.
    NeimarkSacker,
}

/// A change of stability.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StabilityChange {
    /// How multipliers cross the unit circle.
    pub how: Bifurcation,
    /// How many lie outside of it.
    pub outside: Outside,
}

/// Numbers of multipliers outside of the unit circle: real ones above +1, real ones below −1, complex ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outside {
    /// As they are known.
    Known {
        /// Before the change.
        before: Vec<i64>,
        /// Behind it.
        after: Vec<i64>,
    },
    /// What a file had room for of large ones.
    Cut(String),
}

/// Why there is no solution at a frequency.
#[derive(Debug, Clone, PartialEq)]
pub enum GapReason {
    /// The verdict of shooting.
    Verdict(VerdictKind),
    /// The iteration of harmonic balance did not converge.
    NotConverged {
        /// Least residual.
        residual: f64,
        /// Newton steps.
        iterations: usize,
    },
    /// It converged to a motion without contact.
    NoContact,
    /// It converged along active sets that violate the contact conditions.
    Inadmissible {
        /// Phase angle at which they do.
        theta: f64,
    },
    /// There was nothing to start from.
    NoStart,
    /// No conservative orbit is near a viscous one.
    NoneNear {
        /// Smallest defect that was reached, over the size of the motion.
        defect: f64,
    },
    /// In words: of another version, or cut off by a file.
    Words(String),
}

/// What stands before the first colon of a name.
fn heading(text: &str) -> &str {
    text.split(": ").next().unwrap_or(text)
}

impl PointKind {
    /// Whether a frequency has no solution.
    pub fn is_gap(&self) -> bool {
        matches!(self, PointKind::Gap(_))
    }

    /// Whether something happens to the branch there, whatever the solution is.
    pub(crate) fn is_event(&self) -> bool {
        use PointKind::{Border, BranchPoint, Fold, Stability};
        matches!(self, Fold | BranchPoint | Border(_) | Stability(_))
    }

    /// The name without details.
    pub fn word(&self) -> &str {
        match self {
            PointKind::Regular => "regular",
            PointKind::Start => "start",
            PointKind::Jump => "jump",
            PointKind::EndOfRange => "end of range",
            PointKind::Fold => "fold",
            PointKind::BranchPoint => "branch point",
            PointKind::Stability(change) => change.how.name(),
            PointKind::Border(_) => "border",
            PointKind::Undecided(_) => "grazing",
            PointKind::NoOrbitNear(_) => "no orbit near",
            PointKind::NotExamined => "orbit not examined",
            PointKind::Gap(_) => "gap",
            PointKind::Failed(_) => "failed",
            PointKind::Other(text) => heading(text),
        }
    }

    /// The kind that is written so.
    pub fn of_name(name: &str) -> PointKind {
        let plain = [
            PointKind::Regular,
            PointKind::Start,
            PointKind::Jump,
            PointKind::EndOfRange,
            PointKind::Fold,
            PointKind::BranchPoint,
            PointKind::NotExamined,
        ];
        if let Some(kind) = plain.into_iter().find(|kind| kind.word() == name) {
            return kind;
        }
        let other = || PointKind::Other(name.to_owned());
        let Some((word, details)) = name.split_once(": ") else { return other() };
        if let Some(how) = Bifurcation::ALL.into_iter().find(|how| how.name() == word) {
            return PointKind::Stability(StabilityChange {
                how,
                outside: Outside::of_name(details),
            });
        }
        match word {
            "border" => PointKind::Border(details.to_owned()),
            "gap" => PointKind::Gap(GapReason::of_name(details)),
            "failed" => PointKind::Failed(details.to_owned()),
            "no orbit near" => PointKind::NoOrbitNear(VerdictKind::of_name(details)),
            "grazing" => {
                let count = details.split(' ').next().and_then(|n| n.parse().ok());
                let kind = count.map(PointKind::Undecided);
                kind.filter(|kind| kind.to_string() == name).unwrap_or_else(other)
            }
            _ => other(),
        }
    }
}

impl Display for PointKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let word = self.word();
        match self {
            PointKind::Stability(change) => write!(f, "{word}: {}", change.outside),
            PointKind::Undecided(n) => write!(f, "{word}: {n} touches could not be decided"),
            PointKind::NoOrbitNear(verdict) => write!(f, "{word}: {verdict}"),
            PointKind::Gap(reason) => write!(f, "{word}: {reason}"),
            PointKind::Border(what) | PointKind::Failed(what) => write!(f, "{word}: {what}"),
            PointKind::Other(text) => f.write_str(text),
            _ => f.write_str(word),
        }
    }
}

impl From<String> for PointKind {
    fn from(name: String) -> Self {
        PointKind::of_name(&name)
    }
}

impl From<PointKind> for String {
    fn from(kind: PointKind) -> Self {
        kind.to_string()
    }
}

impl Bifurcation {
    const ALL: [Bifurcation; 3] =
        [Bifurcation::PlusOne, Bifurcation::PeriodDoubling, Bifurcation::NeimarkSacker];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Bifurcation::PlusOne => "multiplier through +1",
            Bifurcation::PeriodDoubling => "period doubling",
            Bifurcation::NeimarkSacker => "Neimark-Sacker",
        }
    }
}

impl StabilityChange {
    /// The change between two triples of numbers outside of the unit circle (numbers that are missing are none).
    pub fn new(before: &[i64], after: &[i64]) -> StabilityChange {
        let change = |k: usize| after.get(k).unwrap_or(&0) - before.get(k).unwrap_or(&0);
        let how = match [change(1) != 0, change(2) != 0] {
            [true, _] => Bifurcation::PeriodDoubling,
            [_, true] => Bifurcation::NeimarkSacker,
            _ => Bifurcation::PlusOne,
        };
        let outside = Outside::Known { before: before.to_vec(), after: after.to_vec() };
        StabilityChange { how, outside }
    }

    /// Whether the orbits are unstable on both sides.
    pub fn stays_unstable(&self) -> bool {
        match &self.outside {
            Outside::Known { before, after } => [before, after].iter().all(|n| **n != [0, 0, 0]),
            // beside three zeros there is room for any other numbers
            Outside::Cut(_) => true,
        }
    }
}

impl Outside {
    fn of_name(name: &str) -> Outside {
        let list = |text: &str| serde_json::from_str::<Vec<i64>>(text).ok();
        let known = || {
            let (before, after) = name.strip_suffix(" outside")?.split_once(" to ")?;
            Some(Outside::Known { before: list(before)?, after: list(after)? })
        };
        let same = |outside: &Outside| outside.to_string() == name;
        known().filter(same).unwrap_or_else(|| Outside::Cut(name.to_owned()))
    }
}

impl Display for Outside {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Outside::Known { before, after } => write!(f, "{before:?} to {after:?} outside"),
            Outside::Cut(words) => f.write_str(words),
        }
    }
}

impl GapReason {
    /// The reason without its numbers.
    pub fn word(&self) -> Cow<'_, str> {
        match self {
            GapReason::Verdict(verdict) => Cow::Borrowed(verdict.name()),
            GapReason::Words(words) => Cow::Borrowed(heading(words)),
            _ => Cow::Owned(heading(&self.to_string()).to_owned()),
        }
    }

    /// The reason that is written so.
    pub fn of_name(name: &str) -> GapReason {
        let converged = || {
            let numbers = name.strip_prefix("not converged: residual ")?.strip_suffix(" steps")?;
            let (residual, iterations) = numbers.split_once(" after ")?;
            let (residual, iterations) = (residual.parse().ok()?, iterations.parse().ok()?);
            Some(GapReason::NotConverged { residual, iterations })
        };
        let inadmissible = || {
            let theta = name.rsplit(' ').next()?.parse().ok()?;
            Some(GapReason::Inadmissible { theta })
        };
        let none_near = || {
            let defect = name.strip_prefix("none near: smallest defect ")?.parse().ok()?;
            Some(GapReason::NoneNear { defect })
        };
        let verdict = match VerdictKind::of_name(name) {
            VerdictKind::Other(_) => None,
            known => Some(GapReason::Verdict(known)),
        };
        let plain = [Some(GapReason::NoContact), Some(GapReason::NoStart)];
        [verdict, converged(), inadmissible(), none_near()]
            .into_iter()
            .chain(plain)
            .flatten()
            .find(|reason| reason.to_string() == name)
            .unwrap_or_else(|| GapReason::Words(name.to_owned()))
    }
}

impl Display for GapReason {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            GapReason::Verdict(verdict) => write!(f, "{verdict}"),
            GapReason::NotConverged { residual, iterations } => {
                write!(f, "not converged: residual {residual:.1e} after {iterations} steps")
            }
            GapReason::NoContact => write!(f, "a motion without contact"),
            GapReason::Inadmissible { theta } => {
                write!(f, "the active sets violate the contact conditions at phase {theta:.6}")
            }
            GapReason::NoStart => write!(f, "no solution with fewer harmonics to start from"),
            GapReason::NoneNear { defect } => write!(f, "none near: smallest defect {defect:.1e}"),
            GapReason::Words(words) => f.write_str(words),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<PointKind> {
        let gaps = [
            GapReason::NotConverged { residual: 1.2e-3, iterations: 60 },
            GapReason::NoContact,
            GapReason::Inadmissible { theta: 1.25 },
            GapReason::NoStart,
            GapReason::NoneNear { defect: 2.5e-4 },
            GapReason::Words("what another version says: 7".into()),
        ];
        let verdicts = VerdictKind::ALL.map(GapReason::Verdict);
        let changes = [
            StabilityChange::new(&[0, 0, 0], &[1, 0, 0]),
            StabilityChange::new(&[1, 0, 12], &[1, 1, 12]),
            StabilityChange::new(&[1, 0, 12], &[1, 0, 10]),
        ];
        let mut all = vec![
            PointKind::Regular,
            PointKind::Start,
            PointKind::Jump,
            PointKind::EndOfRange,
            PointKind::Fold,
            PointKind::BranchPoint,
            PointKind::NotExamined,
            PointKind::Border("switches of nodes 41 and 43 change places".into()),
            PointKind::Undecided(3),
            PointKind::Failed("penetration 1e-3; not closed".into()),
            PointKind::Other("cusp".into()),
        ];
        all.extend(VerdictKind::ALL.map(PointKind::NoOrbitNear));
        all.extend(changes.map(PointKind::Stability));
        all.extend(gaps.into_iter().chain(verdicts).map(PointKind::Gap));
        all
    }

    #[test]
    fn every_kind_is_read_as_it_was_written() {
        for kind in all() {
            let name = kind.to_string();
            assert_eq!(PointKind::of_name(&name), kind, "{name}");
            assert_eq!(kind.word(), heading(&name));
            let json = serde_json::to_string(&kind).unwrap();
            assert_eq!(json, format!("{name:?}"));
            assert_eq!(serde_json::from_str::<PointKind>(&json).unwrap(), kind);
        }
        let name = PointKind::Stability(StabilityChange::new(&[0, 0, 0], &[0, 2, 1])).to_string();
        assert_eq!(name, "period doubling: [0, 0, 0] to [0, 2, 1] outside");
    }

    #[test]
    fn every_name_is_printed_as_it_was_read() {
        let names: Vec<String> = all().iter().map(PointKind::to_string).collect();
        let cut = names.iter().flat_map(|n| (0..=n.len()).filter_map(|k| n.get(..k)));
        let strange =
            ["gap: residual NaN", "gap: not converged: residual NaN after 0 steps", "x: y"];
        for name in cut.chain(strange) {
            assert_eq!(PointKind::of_name(name).to_string(), name);
        }
    }

    #[test]
    fn what_a_file_cut_off_keeps_its_kind() {
        let whole = "Neimark-Sacker: [100, 100, 1000] to [100, 100, 1002] outside";
        let PointKind::Stability(change) = PointKind::of_name(&whole[..55]) else { panic!() };
        assert!(change.how == Bifurcation::NeimarkSacker && change.stays_unstable());
        let violated = GapReason::Inadmissible { theta: 1.5 }.to_string();
        assert!(PointKind::of_name(&format!("gap: {}", &violated[..58])).is_gap());
    }
}
