//! What the tasks of a study found.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use signorini::report::figure;
use signorini::report::study::{pictures, points_csv, tasks_csv};
use signorini::store::{Outputs, StoreError, beside, is_collected, replace, write_study};
use signorini::study::gather;

use super::which::Which;
use crate::cli::{Answer, CliError, Global};

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini study collect gaps.toml\n  signorini study collect gaps.toml --to gaps-all --show energy_drift,switches"
)]
pub struct Collect {
    #[command(flatten)]
    which: Which,
    /// Beginning of the names of HDF5, CSV and pictures [default: the name of the study, in this folder]
    #[arg(long, value_name = "STEM")]
    to: Option<PathBuf>,
    /// Overwrite files of signorini's
    #[arg(long)]
    force: bool,
    /// Results that are drawn over the varied parameters [default: the first four that differ]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    show: Vec<String>,
}

/// Gather, write, draw.
pub fn run(collect: &Collect, global: &Global) -> Result<Answer, CliError> {
    let folder = collect.which.open()?;
    if !folder.tasks().iter().any(|t| t.done().is_some()) {
        let text = "no task has an answer yet: `signorini study run` carries them out";
        return Err(CliError::Input(text.into()));
    }
    let stem = collect.to.clone().unwrap_or_else(|| PathBuf::from(folder.name()));
    let (file, tasks, points) =
        (beside(&stem, ".h5"), beside(&stem, ".csv"), beside(&stem, "-points.csv"));
    // what was collected from this study before is drawn anew, as its pictures are
    let outputs = Outputs::new(collect.force || is_collected(&file, folder.name()));
    outputs.check(&file).map_err(|e| match e {
        StoreError::Exists(path) => CliError::Input(format!(
            "{} exists already; choose another name with --to, or overwrite it with --force",
            path.display()
        )),
        other => other.into(),
    })?;
    for table in [&tasks, &points] {
        outputs.check_derived(table)?;
    }
    let table = gather(&folder)?;
    let known: Vec<&str> = table.results.iter().map(|c| c.0.as_str()).collect();
    if let Some(unknown) = collect.show.iter().find(|s| !known.contains(&s.as_str())) {
        let text = format!("no result \"{unknown}\"; there are {}", known.join(", "));
        return Err(CliError::Input(text));
    }
    write_study(&file, &table, &outputs)?;
    let mut written = vec![file, tasks];
    replace(&written[1], tasks_csv(&table).as_bytes())?;
    if !table.points.task.is_empty() {
        replace(&points, points_csv(&table).as_bytes())?;
        written.push(points);
    }
    let drawings = pictures(&table, &stem, &collect.show);
    written.extend(figure::save(&drawings, &outputs, &figure::Output::default())?);
    let count = |state: &str| table.states.iter().filter(|s| *s == state).count();
    let (done, failed) = (count("done"), count("failed"));
    let left = table.states.len() - done - failed;
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    let text = format!(
        "{}: {done} tasks done, {failed} failed, {left} without an answer\n  written: {}\n",
        table.name,
        names.join(", ")
    );
    Ok(global.answer(
        || json!({"done": done, "failed": failed, "left": left, "written": names}),
        || text,
    ))
}
