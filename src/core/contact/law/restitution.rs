//! Newton's law of impact in Moreau's form: a coefficient of restitution, reactions on what rests on the obstacle ([`crate::contact::Impact`]).

use super::{Conduct, Law};
use crate::contact::states::PointState;

/// The law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restitution {
    /// `e`
    pub coefficient: f64,
    /// A scheme of its own in place of events.
    pub march: Option<March>,
}

/// Schemes that go through time in their own way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum March {
    /// That of Moreau and Jean.
    Steps(Stepping),
    /// Waves along the characteristics of a uniform bar.
    Waves(Instants),
}

/// When the waves of a bar decide on contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instants {
    /// Where it closes and opens.
    Exact,
    /// Once an element's travel time.
    Step,
}

/// The scheme of Moreau and Jean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// Time step.
    pub step: f64,
    /// Which points are pushed.
    pub rule: Rule,
}

/// Which points are pushed over a step, with `w` and `ẇ` at its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// `w + ½hẇ ≤ 0`
    #[default]
    HalfStep,
    /// `w + hẇ ≤ 0` and `ẇ ≤ 0`
    FullStep,
}

impl Law for Restitution {
    fn name(&self) -> String {
        let e = self.coefficient;
        match self.march {
            None => format!("impact law, e = {e}"),
            Some(March::Steps(_)) => format!("Moreau-Jean, e = {e}"),
            Some(March::Waves(Instants::Exact)) => "waves of a uniform bar".to_owned(),
            Some(March::Waves(Instants::Step)) => "wave finite elements".to_owned(),
        }
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Moves,
            _ => Conduct::Held,
        }
    }

    fn dissipates(&self) -> bool {
        self.coefficient != 1.0 && !matches!(self.march, Some(March::Waves(_)))
    }

    fn has_memory(&self) -> bool {
        true
    }

    fn restitution(&self) -> Option<Restitution> {
        Some(*self)
    }
}
