//! A command as a function: it works on a thread of its own, without the interpreter's lock; the thread that called it looks for Ctrl-C and hands
//! on the progress.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use signorini::cli::{self, Answer, Call, CliError, Desk};
use signorini::event::{Energies, Observer, Sample, Silent};
use signorini::problem::Problem;
use signorini::simulate::simulate;

use crate::scene::{self, Scene};

/// How often signals are looked for.
const EVERY: Duration = Duration::from_millis(20);
/// How often progress is told.
const TELL: Duration = Duration::from_millis(200);

type Done = Result<Answer, CliError>;

/// Carry out a command: its JSON object as text, why the numerics failed if they did, and the warnings. `tell(share, what)` is called now and then.
#[pyfunction]
#[pyo3(signature = (arguments, scene = None, is_scratch = false, tell = None))]
pub fn call(
    py: Python<'_>,
    arguments: Vec<String>,
    scene: Option<Py<Scene>>,
    is_scratch: bool,
    tell: Option<Py<PyAny>>,
) -> PyResult<(String, Option<String>, Vec<String>)> {
    let scene = scene.map(|s| s.get().0.clone());
    let call = Call { arguments, scene, is_scratch };
    let desk = Arc::new(Desk::default());
    let (sender, receiver) = mpsc::channel();
    let shared = desk.clone();
    let worker = std::thread::Builder::new().name("signorini".into()).spawn(move || {
        // who waited no longer hears it
        let _ = sender.send(cli::call(call, shared));
    });
    worker.map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    let done = wait(py, receiver, &desk, tell.as_ref())?;
    let answer = done.map_err(|e| failed(py, &e))?;
    let failure = answer.failure.clone();
    Ok((answer.object().to_string(), failure, desk.warnings()))
}

/// Wait for the end of the work. The first Ctrl-C asks it to end, a second one no longer waits for that.
fn wait(
    py: Python<'_>,
    mut receiver: Receiver<Done>,
    desk: &Desk,
    tell: Option<&Py<PyAny>>,
) -> PyResult<Done> {
    let (mut told, mut interrupted) = (Instant::now(), None::<PyErr>);
    loop {
        let ends = &mut receiver;
        match py.detach(move || ends.recv_timeout(EVERY)) {
            Ok(done) => {
                return match (interrupted, done) {
                    (None, done) => Ok(done),
                    // what is kept, and how to go on, is said in the error
                    (Some(e), Err(CliError::Interrupted(_, text)))
                        if e.is_instance_of::<PyKeyboardInterrupt>(py) =>
                    {
                        Err(PyKeyboardInterrupt::new_err(text))
                    }
                    (Some(e), _) => Err(e),
                };
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the command ended abnormally; please report it",
                ));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        let mut heard = py.check_signals();
        if let (Ok(()), Some(tell), None, true) =
            (&heard, tell, &interrupted, told.elapsed() >= TELL)
        {
            told = Instant::now();
            heard = tell.call1(py, desk.progress()).map(drop);
        }
        if let Err(e) = heard {
            desk.stop();
            if interrupted.is_some() {
                return Err(e);
            }
            interrupted = Some(e);
        }
    }
}

/// The exception of an error.
fn failed(py: Python<'_>, e: &CliError) -> PyErr {
    match e {
        CliError::Scene(e) => scene::bad(py, e),
        CliError::Input(text) => crate::error(py, "SceneError", (text.as_str(),)),
        CliError::Numerics(text) => crate::error(py, "NumericsError", (text.as_str(),)),
        CliError::Interrupted(_, text) => PyKeyboardInterrupt::new_err(text.clone()),
        CliError::Other(text) => crate::error(py, "SignoriniError", (text.as_str(),)),
    }
}

/// The states of a run in memory.
#[derive(Default)]
struct States(Vec<f64>);

impl Observer for States {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let [kinetic, elastic, external, dissipated, ..] = Energies::numbers(s.energies);
        [s.u, s.v, s.pressure].iter().for_each(|x| self.0.extend_from_slice(x));
        self.0.extend([s.t, kinetic, elastic, external, dissipated, s.jumps]);
        Ok(())
    }
}

/// What `run` costs without Python and without a file: seconds of set-up and integration, with the states kept in memory or not, for comparison.
#[pyfunction]
pub fn library_run(py: Python<'_>, scene: &Scene, keeps: bool) -> PyResult<f64> {
    let scene = &scene.0;
    py.detach(|| {
        let start = Instant::now();
        let problem = Problem::new(scene, None).map_err(|e| e.to_string())?;
        let mut states = States::default();
        match keeps {
            true => simulate(scene, &problem, false, &mut states),
            false => simulate(scene, &problem, false, &mut Silent),
        }
        .map_err(|e| e.to_string())?;
        Ok(start.elapsed().as_secs_f64())
    })
    .map_err(|e: String| crate::error(py, "SignoriniError", (e,)))
}

/// The command line; its exit code.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| cli::main_with(arguments.into_iter().map(Into::into)))
}
