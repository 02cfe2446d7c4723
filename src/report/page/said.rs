//! What a run says of itself on its page: by which method, and how far it is off.

use std::path::Path;

use super::super::summary::significant;
use crate::store::{Raw, attributes};

/// Numbers of `/report` with what they are called.
const NUMBERS: [(&str, &str); 4] = [
    ("energy_drift", "energy drift"),
    ("max_penetration", "largest penetration"),
    ("state_error", "error of gaps and pressures"),
    ("energy_dissipated", "dissipated"),
];

/// Names and values; nothing of a file without a report (a run that goes on).
pub(super) fn of_run(path: &Path) -> Vec<[String; 2]> {
    let of = |group: &str| attributes(path, group).unwrap_or_default();
    let mut said = vec![];
    for (name, value) in of("report/method") {
        if let (true, Raw::Words(words)) = (name == "name", value) {
            said.extend(words.into_iter().next().map(|word| ["method".to_owned(), word]));
        }
    }
    let report = of("report");
    let value = |wanted: &str| report.iter().find(|(name, _)| name == wanted).map(|(_, v)| v);
    if let Some(Raw::Flag(proved)) = value("certified") {
        let word = if *proved { "proved to be the next" } else { "not all proved" };
        said.push(["every switch".to_owned(), word.to_owned()]);
    }
    for (name, word) in NUMBERS {
        if let Some(Raw::Float(x)) = value(name)
            // nothing lost, or an error that was not computed
            && let Some(x) = x.first().filter(|x| x.is_finite() && **x != 0.0)
        {
            said.push([word.to_owned(), significant(*x, 3)]);
        }
    }
    said
}
