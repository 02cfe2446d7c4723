//! Errors of commands and their exit codes.

use std::process::ExitCode;

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
    /// Anything else: exit code 1.
    Other(String),
}

impl CliError {
    /// Print the error on standard error; its exit code.
    pub fn report(self) -> ExitCode {
        let (code, text) = match self {
            CliError::Scene(e) => {
                eprintln!("{:?}", miette::Report::new(*e));
                return ExitCode::from(2);
            }
            CliError::Input(text) => (2, text),
            CliError::Numerics(text) => (3, text),
            CliError::Other(text) => (1, text),
        };
        eprintln!("signorini: {text}");
        ExitCode::from(code)
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
            StoreError::Hdf5(_) => CliError::Other(e.to_string()),
            _ => CliError::Input(e.to_string()),
        }
    }
}

impl From<FigureError> for CliError {
    fn from(e: FigureError) -> Self {
        match e {
            FigureError::Empty(_) => CliError::Input(e.to_string()),
            _ => CliError::Other(e.to_string()),
        }
    }
}
