//! Checks of numbers, whatever table they stand in.

use super::Issue;

/// What a check finds.
pub(super) type Check = Result<(), Issue>;

/// Products of a few numbers of a scene must neither overflow nor vanish.
const LARGEST: f64 = 1e60;

pub(super) fn positive(key: &str, value: f64) -> Check {
    if (1.0 / LARGEST..=LARGEST).contains(&value) {
        return Ok(());
    }
    if value.is_finite() && value > 0.0 {
        return Err(Issue::new(
            key,
            format!("is {value:e}: results would overflow"),
            format!("choose units in which it lies between {:e} and {LARGEST:e}", 1.0 / LARGEST),
        ));
    }
    Err(Issue::new(key, format!("must be positive and finite, is {value}"), "give a number > 0"))
}

pub(super) fn finite(key: &str, value: f64) -> Check {
    if value.abs() <= LARGEST {
        return Ok(());
    }
    if value.is_finite() {
        return Err(Issue::new(
            key,
            format!("is {value:e}: results would overflow"),
            format!("choose units in which its size is at most {LARGEST:e}"),
        ));
    }
    Err(Issue::new(key, format!("must be finite, is {value}"), "give an ordinary number"))
}

pub(super) fn count_from_one(key: &str, value: usize) -> Check {
    if value >= 1 {
        return Ok(());
    }
    Err(Issue::new(key, "modes are counted from 1", "give 1 for the lowest mode"))
}

pub(super) fn length(key: &str, found: usize, wanted: usize, example: &str) -> Check {
    if found == wanted {
        return Ok(());
    }
    let s = if wanted == 1 { "" } else { "s" };
    Err(Issue::new(
        key,
        format!("needs {wanted} number{s}, has {found}"),
        format!("for example {example}"),
    ))
}
