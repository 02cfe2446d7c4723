//! One orbit of a scene at a frequency.

use std::f64::consts::TAU;

use super::start;
use crate::contact::State;
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::settle::ladder;
use crate::orbit::viscous::by_viscosity;
use crate::orbit::{Closure, OrbitError, Propagator, cycle};

/// The limit cycle near a state with a period, if one is given, or else that which the body comes to.
pub fn limit_cycle(
    body: &mut Propagator,
    from: &State,
    period: Option<f64>,
) -> Result<Verdict, OrbitError> {
    if let Some(period) = period {
        let guess = [body.frame(from), vec![period]].concat();
        let found = find(body, Closure::Limit, &guess, TAU / period, &Effort::default())?;
        if found.orbit().is_some() {
            return Ok(found);
        }
    }
    Ok(match cycle::approach(body, from)? {
        Ok(orbit) => Verdict::Orbit(orbit),
        Err(why) => Verdict::not_found(why),
    })
}

/// The orbit that the first of the guesses leads to which leads to one, or why the first of all does not.
pub fn search(
    body: &mut Propagator,
    closure: Closure,
    guesses: &[Vec<f64>],
    omega: f64,
) -> Result<Verdict, OrbitError> {
    if guesses.is_empty() {
        return Ok(Verdict::not_found("there is nothing to start from"));
    }
    for guess in guesses {
        let effort = Effort { rescue: guesses.len() == 1, ..Effort::of(closure) };
        let found = find(body, closure, guess, omega, &effort)?;
        if found.orbit().is_some() {
            return Ok(found);
        }
    }
    if let Closure::Viscous(pin) = closure {
        let effort = Effort::of(closure);
        let mut found = by_viscosity(body, pin, omega, &effort)?;
        if found.as_ref().and_then(Verdict::orbit).is_none()
            && let Some(guess) = start::by_series(body, closure, omega)
        {
            found = Some(find(body, closure, &guess, omega, &effort)?);
        }
        if let Some(found) = found.filter(|found| found.orbit().is_some()) {
            return Ok(found);
        }
    }
    let mut why = None;
    if closure == Closure::FORCED {
        match ladder(body, guesses, omega)? {
            Ok(orbit) => return Ok(Verdict::Orbit(orbit)),
            Err(words) => why = Some(words),
        }
    }
    // the search for the cause, from the first guess
    let mut found = find(body, closure, &guesses[0], omega, &Effort::of(closure))?;
    if let Verdict::NotFound { reason, .. } = &mut found {
        *reason = why.or(reason.take());
    }
    Ok(found)
}
