//! Commands whose results are written as one whole: at the end, or again and again while they are computed.

use std::time::{Duration, Instant};

use serde_json::Value;

use signorini::continuation::Go;
use signorini::families::FamilyError;
use signorini::records::Status;
use signorini::scenario::Scene;
use signorini::store::{Head, StoreError};

use super::task::Work;
use super::{Answer, CliError, Global, title};

/// Results as they are said.
pub(super) trait Whole {
    /// As an object.
    fn to_json(&self) -> Value;

    /// In words.
    fn to_text(&self) -> String;
}

/// What a command says of its results.
pub(super) fn said(work: &Work, found: &impl Whole) -> Answer {
    let wall = work.wall();
    work.global.answer(
        || {
            let mut object = found.to_json();
            object["wall_s"] = wall.into();
            object["output"] = work.path.display().to_string().into();
            object
        },
        || {
            let file = work.path.display();
            format!(
                "{}\n{}  {:<14}{wall:.3} s\n  {:<14}{file} (picture: signorini plot {file})\n",
                title(&work.scene),
                found.to_text(),
                "time",
                "written to",
            )
        },
    )
}

/// What a file holds, or its scene alone.
pub(super) fn inspected(global: &Global, scene: bool, head: Head, found: &impl Whole) -> Answer {
    if scene && !global.json {
        return Answer::text(head.scene);
    }
    let Head { title, scene, status } = head;
    global.answer(
        || {
            let mut json = found.to_json();
            json["title"] = title.clone().into();
            json["status"] = status.to_string().into();
            json["scene"] = scene.into();
            json
        },
        || {
            let text = found.to_text();
            format!("  {:<14}{title}\n  {:<14}{status}\n{text}", "title", "status")
        },
    )
}

/// What a command begins with: what is asked for, or what an earlier run of it left, which is read, and checked, where this one goes on with it. And whether nothing is left to do.
pub(super) fn begun<T>(
    (work, resume): (&Work, bool),
    asked: T,
    earlier: impl FnOnce(&T) -> Result<(Head, T), CliError>,
) -> Result<(T, bool), CliError> {
    if !(resume && work.path.exists()) {
        return Ok((asked, false));
    }
    let (head, found) = earlier(&asked)?;
    Ok((found, head.status == Status::Complete))
}

/// Whether a file is of a scene and of what that depends on, for [`super::task::check_same`].
pub(super) fn of_scene(
    (head, problem): (&Head, u64),
    (scene, fingerprint): (&Scene, u64),
) -> [(&'static str, bool); 2] {
    [
        ("another scene", head.scene == scene.source.text),
        ("another problem: a file that the scene names has changed", problem == fingerprint),
    ]
}

/// How often what is found is written down.
const EVERY: Duration = Duration::from_secs(10);

/// Results that are written down again and again.
pub(super) struct Kept<'w, T> {
    work: &'w Work<'w>,
    write: &'w (dyn Fn(&T, &Status) -> Result<(), StoreError> + Sync),
    last: Instant,
}

impl<'w, T> Kept<'w, T> {
    /// Where the file cannot be written, that is said before anything is computed. From now on signals are noted.
    pub fn begin(
        work: &'w Work<'w>,
        write: &'w (dyn Fn(&T, &Status) -> Result<(), StoreError> + Sync),
        found: &T,
    ) -> Result<Kept<'w, T>, CliError> {
        write(found, &Status::Running)?;
        work.global.caller.watch();
        Ok(Kept { work, write, last: Instant::now() })
    }

    /// Something more is found: write it down if that is due, and go on unless a signal came.
    pub fn step(&mut self, found: &T) -> Result<Go, FamilyError> {
        if self.last.elapsed() >= EVERY {
            self.last = Instant::now();
            (self.write)(found, &Status::Running)?;
        }
        Ok(match self.work.global.caller.signal() {
            Some(_) => Go::Break(()),
            None => Go::Continue(()),
        })
    }

    /// The end: whether all is found, or why not; `told` says how much there is.
    pub fn end(
        self,
        found: T,
        is_whole: Result<bool, FamilyError>,
        told: &str,
    ) -> Result<T, CliError> {
        match (is_whole, self.work.global.caller.signal()) {
            (Ok(true), _) => {
                (self.write)(&found, &Status::Complete)?;
                Ok(found)
            }
            (Ok(false), Some(signal)) => {
                (self.write)(&found, &Status::Interrupted)?;
                let file = self.work.path.display();
                let next = "go on with the same command and --resume";
                let text = format!("interrupted; {told} in {file}: {next}");
                Err(CliError::Interrupted(signal, text))
            }
            (Ok(false), None) => Err(CliError::Other("ended abnormally".into())),
            (Err(e), _) => {
                let e = CliError::from(e);
                // the reason of the failure matters more than a failure to record it
                let _ = (self.write)(&found, &Status::Failed(e.text()));
                Err(e)
            }
        }
    }
}
