//! Schemes that go through time in their own way, without events: what a run by events is compared with.

pub(crate) mod moreau_jean;
pub mod quasistatic;
pub(crate) mod waves;

use crate::contact::{March, State, System};
use crate::event::{Observer, Options, Report, Resumed, RunError};

/// Integrate a system whose method marches; none for one that goes from event to event.
pub fn run<O: Observer>(
    system: &System,
    initial: &State,
    resumed: Option<Resumed>,
    options: &Options,
    observer: &mut O,
) -> Result<Option<Report>, RunError<O::Error>> {
    match system.impact().and_then(|law| law.march) {
        None => Ok(None),
        Some(March::Steps(_)) => moreau_jean::run(system, initial, resumed, options, observer),
        Some(March::Waves(_)) => waves::run(system, initial, resumed, options, observer),
    }
}
