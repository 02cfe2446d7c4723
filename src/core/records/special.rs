//! What a point of a family is: a regular one, or what is special about it.
//!
//! Files keep a kind as data (JSON), with its words beside it for people and tables (the column `special` of `/backbone`): one word, and behind a colon its details.

use std::borrow::Cow;
use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

use super::{AttractorKind, VerdictKind, bits};

/// What a point of a family is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub enum PointKind {
    /// Nothing special.
    #[default]
    Regular,
    /// The first point of a branch.
    Start,
    /// Far from what the points before it let expect: another branch.
    Jump,
    /// A sweep meets another kind of motion.
    Change {
        /// What the body did.
        before: AttractorKind,
        /// What it does from here on.
        after: AttractorKind,
    },
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
    /// It changes because a contact grazes: a visit begins or ends to be.
    Grazing(GrazingRecord),
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
}

/// A contact that grazes: behind it orbits have a visit more or less, of a point that touches (closing) or that leaves for a moment (opening).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GrazingRecord {
    /// Node of the mesh (or number of the contact point where points are no nodes).
    pub node: usize,
    /// The visit is an opening, of a node that rests.
    pub opening: bool,
    /// The frequency turns back there.
    pub turns: bool,
    /// Other nodes that graze with it, of a symmetric body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<usize>,
}

impl GrazingRecord {
    /// All nodes that graze.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        std::iter::once(self.node).chain(self.together.iter().copied())
    }
}

/// So many nodes are named that graze together with one.
const NAMED: usize = 5;

/// How multipliers cross the unit circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bifurcation {
    /// A real one through +1.
    PlusOne,
    /// A real one through −1.
    PeriodDoubling,
    /// A complex pair.
    NeimarkSacker,
}

/// A change of stability, with the numbers of multipliers outside of the unit circle: real ones above +1, real ones below −1, complex ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StabilityChange {
    /// How multipliers cross the unit circle.
    pub how: Bifurcation,
    /// How many lie outside of it before the change.
    pub before: Vec<i64>,
    /// How many behind it.
    pub after: Vec<i64>,
}

/// Why there is no solution at a frequency.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum GapReason {
    /// The verdict of shooting.
    Verdict(VerdictKind),
    /// The iteration of harmonic balance did not converge.
    NotConverged {
        /// Least residual.
        #[serde(with = "bits::plain")]
        residual: f64,
        /// Newton steps.
        iterations: usize,
    },
    /// It converged to a motion without contact.
    NoContact,
    /// It converged along active sets that violate the contact conditions.
    Inadmissible {
        /// Phase angle at which they do.
        #[serde(with = "bits::plain")]
        theta: f64,
    },
    /// There was nothing to start from.
    NoStart,
    /// No conservative orbit is near a viscous one.
    NoneNear {
        /// Smallest defect that was reached, over the size of the motion.
        #[serde(with = "bits::plain")]
        defect: f64,
    },
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

    /// Whether the motion is another one than at the point before it.
    pub fn is_another_motion(&self) -> bool {
        matches!(self, PointKind::Jump | PointKind::Change { .. })
    }

    /// Whether the sequence of switches changes.
    pub fn is_border(&self) -> bool {
        matches!(self, PointKind::Border(_) | PointKind::Grazing(_))
    }

    /// Whether something happens to the branch there, whatever the solution is.
    pub(crate) fn is_event(&self) -> bool {
        use PointKind::{Border, BranchPoint, Fold, Grazing, Stability};
        matches!(self, Fold | BranchPoint | Border(_) | Grazing(_) | Stability(_))
    }

    /// The name without details.
    pub fn word(&self) -> &str {
        match self {
            PointKind::Regular => "regular",
            PointKind::Start => "start",
            PointKind::Jump => "jump",
            PointKind::Change { .. } => "change",
            PointKind::EndOfRange => "end of range",
            PointKind::Fold => "fold",
            PointKind::BranchPoint => "branch point",
            PointKind::Stability(change) => change.how.name(),
            PointKind::Border(_) | PointKind::Grazing(_) => "border",
            PointKind::Undecided(_) => "grazing",
            PointKind::NoOrbitNear(_) => "no orbit near",
            PointKind::NotExamined => "orbit not examined",
            PointKind::Gap(_) => "gap",
            PointKind::Failed(_) => "failed",
        }
    }
}

impl Display for PointKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let word = self.word();
        match self {
            PointKind::Stability(change) => {
                write!(f, "{word}: {:?} to {:?} outside", change.before, change.after)
            }
            PointKind::Change { before, after } => write!(f, "{word}: {before} to {after}"),
            PointKind::Undecided(n) => write!(f, "{word}: {n} touches could not be decided"),
            PointKind::NoOrbitNear(verdict) => write!(f, "{word}: {verdict}"),
            PointKind::Gap(reason) => write!(f, "{word}: {reason}"),
            PointKind::Grazing(grazing) => write!(f, "{word}: {grazing}"),
            PointKind::Border(what) | PointKind::Failed(what) => write!(f, "{word}: {what}"),
            _ => f.write_str(word),
        }
    }
}

impl GrazingRecord {
    /// What the visit is that begins or ends to be.
    pub fn visit(&self) -> &'static str {
        if self.opening { "opening" } else { "closing" }
    }
}

impl GrazingRecord {
    /// What happens, in words, with nodes by a name of theirs.
    pub fn told(&self, name: impl Fn(usize) -> String) -> String {
        let what = if self.opening { "grazes to open" } else { "grazes" };
        let turns = if self.turns { ", the frequency turns back" } else { "" };
        let others = match &self.together[..] {
            [] => String::new(),
            [other] => format!(" together with node {}", name(*other)),
            others => {
                let first: Vec<String> = others.iter().take(NAMED).map(|n| name(*n)).collect();
                let more = match others.len().saturating_sub(NAMED) {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                format!(" together with nodes {}{more}", first.join(", "))
            }
        };
        format!("node {} {what}{others}{turns}", name(self.node))
    }
}

impl Display for GrazingRecord {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(&self.told(|node| node.to_string()))
    }
}

impl Bifurcation {
    /// Its name.
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
        StabilityChange { how, before: before.to_vec(), after: after.to_vec() }
    }

    /// Whether the orbits are unstable on both sides.
    pub fn stays_unstable(&self) -> bool {
        [&self.before, &self.after].iter().all(|n| **n != [0, 0, 0])
    }
}

impl GapReason {
    /// The reason without its numbers.
    pub fn word(&self) -> Cow<'_, str> {
        match self {
            GapReason::Verdict(verdict) => Cow::Borrowed(verdict.name()),
            _ => Cow::Owned(heading(&self.to_string()).to_owned()),
        }
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
                write!(
                    f,
                    "the active sets violate the contact conditions at phase {theta:.6} (more harmonics may do)"
                )
            }
            GapReason::NoStart => write!(f, "no solution with fewer harmonics to start from"),
            GapReason::NoneNear { defect } => write!(f, "none near: smallest defect {defect:.1e}"),
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
            PointKind::Change { before: AttractorKind::Periodic(1), after: AttractorKind::Chaotic },
            PointKind::EndOfRange,
            PointKind::Fold,
            PointKind::BranchPoint,
            PointKind::NotExamined,
            PointKind::Border("switches of nodes 41 and 43 change places".into()),
            PointKind::Grazing(GrazingRecord {
                node: 7,
                opening: false,
                turns: true,
                together: vec![],
            }),
            PointKind::Grazing(GrazingRecord {
                node: 7,
                opening: false,
                turns: true,
                together: vec![9, 4],
            }),
            PointKind::Undecided(3),
            PointKind::Failed("penetration 1e-3; not closed".into()),
        ];
        all.extend(VerdictKind::ALL.map(PointKind::NoOrbitNear));
        all.extend(changes.map(PointKind::Stability));
        all.extend(gaps.into_iter().chain(verdicts).map(PointKind::Gap));
        all
    }

    #[test]
    fn every_kind_is_read_as_it_was_written() {
        for kind in all() {
            assert_eq!(kind.word(), heading(&kind.to_string()));
            let json = serde_json::to_string(&kind).unwrap();
            assert_eq!(serde_json::from_str::<PointKind>(&json).unwrap(), kind, "{json}");
        }
        let change = PointKind::Stability(StabilityChange::new(&[0, 0, 0], &[0, 2, 1]));
        assert_eq!(change.to_string(), "period doubling: [0, 0, 0] to [0, 2, 1] outside");
        let together: Vec<usize> = (1000..1030).collect();
        let many = GrazingRecord { node: 999, opening: true, turns: true, together };
        let said = PointKind::Grazing(many).to_string();
        // the column of the table has 128 letters
        assert!(said.ends_with("1004 and 25 more, the frequency turns back") && said.len() <= 128);
        let json = r#"{"Gap":{"NotConverged":{"residual":null,"iterations":60}}}"#;
        let kind: PointKind = serde_json::from_str(json).unwrap();
        assert_eq!(kind.to_string(), "gap: not converged: residual NaN after 60 steps");
        assert_eq!(serde_json::to_string(&kind).unwrap(), json);
    }
}
