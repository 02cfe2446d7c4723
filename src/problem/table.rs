//! Measured histories: CSV files of time and value.

use super::ProblemError;
use super::given::folder;
use crate::fem::Spline;
use crate::scenario::{Issue, Scene};

/// The history of a load: two columns, comma, semicolon or blanks between them; a first line of words and lines that begin with `#` are passed over.
pub(super) fn history(scene: &Scene, load: usize, name: &str) -> Result<Spline, ProblemError> {
    let issue = |message: String, help: &str| -> ProblemError {
        scene.error(Issue::new(format!("load[{load}].table"), message, help)).into()
    };
    let help = "give a CSV file of two columns, time and value, relative to the scene";
    let text = std::fs::read_to_string(folder(scene).join(name))
        .map_err(|e| issue(format!("cannot read {name}: {e}"), help))?;
    let (mut times, mut values) = (vec![], vec![]);
    let mut words_allowed = true;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line
            .split(|c: char| c == ',' || c == ';' || c.is_whitespace())
            .filter(|c| !c.is_empty())
            .collect();
        let numbers: Option<Vec<f64>> = cells.iter().map(|c| c.parse().ok()).collect();
        let numbers = match numbers {
            Some(numbers) => numbers,
            // a line of names above the numbers
            None if words_allowed && times.is_empty() => {
                words_allowed = false;
                continue;
            }
            None => {
                return Err(issue(
                    format!("{name}, line {}: \"{line}\" is no pair of numbers", k + 1),
                    help,
                ));
            }
        };
        let &[t, y] = &numbers[..] else {
            let message = format!("{name}, line {}: {} columns", k + 1, numbers.len());
            return Err(issue(message, help));
        };
        if !(t.is_finite() && y.abs() <= 1e60) {
            return Err(issue(format!("{name}, line {}: not finite, or beyond 1e60", k + 1), help));
        }
        if times.last().is_some_and(|last| t <= *last) {
            let message = format!("{name}, line {}: the time {t} does not grow", k + 1);
            return Err(issue(message, "sort the lines by time, each time once"));
        }
        times.push(t);
        values.push(y);
    }
    if times.len() < 2 {
        return Err(issue(format!("{name} has {} points", times.len()), help));
    }
    let spline = Spline::new(times, values);
    let (first, last) = spline.range();
    let until = scene.until().unwrap_or(0.0);
    if first > 0.0 || last < until {
        let message = format!(
            "{name} knows the load from t = {first} to {last}; the run goes from 0 to {until}"
        );
        return Err(issue(message, "give a longer history, or a shorter run"));
    }
    Ok(spline)
}
