//! Errors of commands and their exit codes.

use serde_json::json;
use signal_hook::consts::SIGINT;
use signorini::families::FamilyError;
use signorini::hbm::HbmError;
use signorini::orbit::OrbitError;
use signorini::problem::ProblemError;
use signorini::report::figure::FigureError;
use signorini::scenario::SceneError;
use signorini::store::StoreError;

/// Why a command ended.
#[derive(Debug)]
pub enum CliError {
    /// Bad input that a scene's text shows: exit code 2.
    Scene(Box<SceneError>),
    /// Bad input of another kind: exit code 2.
    Input(String),
    /// The numerics failed: exit code 3.
    Numerics(String),
    /// A signal ended it, and what was there is saved: exit code 128 and the signal's number.
    Interrupted(u8, String),
    /// Anything else: exit code 1.
    Other(String),
}

impl CliError {
    /// The message alone.
    pub fn text(&self) -> String {
        match self {
            CliError::Scene(e) => e.to_string(),
            CliError::Input(text)
            | CliError::Numerics(text)
            | CliError::Interrupted(_, text)
            | CliError::Other(text) => text.clone(),
        }
    }

    /// The exit code of a command that ends with it.
    pub fn exit_code(&self) -> u8 {
        match self {
            CliError::Scene(_) | CliError::Input(_) => 2,
            CliError::Numerics(_) => 3,
            CliError::Interrupted(signal, _) => 128 + signal,
            CliError::Other(_) => 1,
        }
    }

    /// Print the error on standard error, and as an object on standard output if that is what the
    /// user reads and nothing was printed there yet; its exit code.
    pub fn report(self, json: bool) -> u8 {
        let (code, text) = (self.exit_code(), self.text());
        if json {
            let object = json!({"status": "error", "exit_code": code, "error": text});
            // standard error says it too
            let _ = print(&format!("{object}\n"));
        }
        match self {
            CliError::Scene(e) => eprintln!("{:?}", miette::Report::new(*e)),
            _ => eprintln!("signorini: {text}"),
        }
        code
    }
}

impl From<SceneError> for CliError {
    fn from(e: SceneError) -> Self {
        CliError::Scene(Box::new(e))
    }
}

impl From<ProblemError> for CliError {
    fn from(e: ProblemError) -> Self {
        match e {
            ProblemError::Scene(e) => e.into(),
            other => CliError::Numerics(other.to_string()),
        }
    }
}

impl From<StoreError> for CliError {
    fn from(e: StoreError) -> Self {
        match e {
            StoreError::Hdf5(_) | StoreError::DiskFull { .. } | StoreError::Write { .. } => {
                CliError::Other(e.to_string())
            }
            _ => CliError::Input(e.to_string()),
        }
    }
}

impl From<OrbitError> for CliError {
    fn from(e: OrbitError) -> Self {
        match e {
            OrbitError::Stopped => {
                let text = "interrupted before an orbit was found; nothing is written";
                CliError::Interrupted(SIGINT as u8, text.into())
            }
            _ => CliError::Numerics(e.to_string()),
        }
    }
}

impl From<HbmError> for CliError {
    fn from(e: HbmError) -> Self {
        match e {
            HbmError::Free(_) | HbmError::Floats | HbmError::NoMode(..) | HbmError::Impacts => {
                CliError::Input(e.to_string())
            }
            _ => CliError::Numerics(e.to_string()),
        }
    }
}

impl From<FamilyError> for CliError {
    fn from(e: FamilyError) -> Self {
        match e {
            FamilyError::Store(e) => e.into(),
            FamilyError::Orbit(e) => e.into(),
            FamilyError::Hbm(e) => e.into(),
            FamilyError::NoStart(_) => CliError::Numerics(format!(
                "{e}; try another frequency: `signorini orbit` (of undamped bodies with --all) looks for one at each"
            )),
            _ => CliError::Input(e.to_string()),
        }
    }
}

impl From<FigureError> for CliError {
    fn from(e: FigureError) -> Self {
        match e {
            FigureError::Empty(_) => CliError::Input(e.to_string()),
            FigureError::Store(e) => e.into(),
            _ => CliError::Other(e.to_string()),
        }
    }
}

/// Write to standard output. Who closed it wants no more; a disk that is full is an error like any other.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::Other(format!("writing to standard output: {e}")))
        }
        _ => Ok(()),
    }
}
