//! `signorini validate`

use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{Answer, CliError, Global};
use cases::{CASES, Case, Check, Effort};

#[path = "../../validate/mod.rs"]
mod cases;

/// Arguments of `validate`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini validate\n  signorini validate bar oscillator --short"
)]
pub struct Arguments {
    /// Names of cases [default: all but those that --list marks]
    names: Vec<String>,
    /// Leave out the finest meshes
    #[arg(long)]
    short: bool,
    /// List the cases and their sources
    #[arg(long)]
    list: bool,
}

struct Done {
    case: &'static Case,
    result: Result<Vec<Check>, String>,
    seconds: f64,
}

impl Done {
    fn passes(&self) -> bool {
        self.result.as_ref().is_ok_and(|checks| checks.iter().all(Check::passes))
    }

    fn json(&self) -> Value {
        let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        let check = |c: &Check| {
            json!({
                "what": c.what, "measured": finite(c.measured),
                "accepted": [finite(c.accepted.0), finite(c.accepted.1)], "passes": c.passes(),
            })
        };
        let (checks, error) = match &self.result {
            Ok(checks) => (checks.iter().map(check).collect(), None),
            Err(e) => (vec![], Some(e)),
        };
        json!({
            "name": self.case.name, "title": self.case.title, "source": self.case.source,
            "passes": self.passes(), "error": error, "checks": checks, "wall_s": self.seconds,
        })
    }

    fn text(&self) -> String {
        let mut out =
            format!("{}: {}\n  against: {}\n", self.case.name, self.case.title, self.case.source);
        match &self.result {
            Err(e) => out += &format!("  FAILED: {e}\n"),
            Ok(checks) => {
                for c in checks {
                    let number = |x: f64| {
                        if x == x.round() && x.abs() < 1e6 {
                            format!("{x}")
                        } else {
                            format!("{x:.4e}")
                        }
                    };
                    let accepted = match c.accepted {
                        (a, b) if a == b => format!("= {}", number(a)),
                        (a, b) if a == f64::NEG_INFINITY => format!("≤ {}", number(b)),
                        (a, b) if b == f64::INFINITY => format!("≥ {}", number(a)),
                        (a, b) => format!("{} to {}", number(a), number(b)),
                    };
                    let mark = if c.passes() { "ok    " } else { "FAILED" };
                    out += &format!(
                        "  {mark} {:<58} {:>12}   accepted {accepted}\n",
                        c.what,
                        number(c.measured)
                    );
                }
            }
        }
        out
    }
}

/// Run the cases, print measured beside accepted.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let known: Vec<&str> = CASES.iter().map(|c| c.name).collect();
    if let Some(unknown) = arguments.names.iter().find(|n| !known.contains(&n.as_str())) {
        return Err(CliError::Input(format!(
            "no case \"{unknown}\"; there are {}",
            known.join(", ")
        )));
    }
    if arguments.list {
        let row = |c: &Case| json!({"name": c.name, "title": c.title, "source": c.source, "only_by_name": c.only_by_name});
        return Ok(global.answer(
            || CASES.iter().map(row).collect(),
            || {
                let note = |c: &Case| if c.only_by_name { " (only if named)" } else { "" };
                CASES
                    .iter()
                    .map(|c| {
                        format!("{:<18}{}{}\n{:18}{}\n", c.name, c.title, note(c), "", c.source)
                    })
                    .collect()
            },
        ));
    }
    let chosen: Vec<&'static Case> = CASES
        .iter()
        .filter(|c| match arguments.names.is_empty() {
            true => !c.only_by_name,
            false => arguments.names.iter().any(|n| n == c.name),
        })
        .collect();
    let done: Vec<Done> = chosen
        .into_par_iter()
        .map(|case| {
            let start = Instant::now();
            let result = (case.run)(Effort { short: arguments.short });
            Done { case, result, seconds: start.elapsed().as_secs_f64() }
        })
        .collect();
    let failed: Vec<&str> = done.iter().filter(|d| !d.passes()).map(|d| d.case.name).collect();
    let count: usize = done.iter().filter_map(|d| d.result.as_ref().ok()).map(Vec::len).sum();
    let answer = global.answer(
        || json!({"cases": done.iter().map(Done::json).collect::<Vec<_>>(), "failed": failed}),
        || {
            let text: String = done.iter().map(|d| d.text() + "\n").collect();
            format!("{text}{count} checks in {} cases, {} cases failed\n", done.len(), failed.len())
        },
    );
    if failed.is_empty() {
        return Ok(answer);
    }
    Ok(answer.failed(format!("validation failed: {}", failed.join(", "))))
}
