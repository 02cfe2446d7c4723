//! The Python module: the commands as functions, scenes, and files of results as arrays. What users see is written in Python, in
//! `signorini/`; here is what needs the library.

mod call;
mod file;
mod scene;

use pyo3::prelude::*;

/// The extension module `signorini._signorini`.
#[pymodule]
mod _signorini {
    #[pymodule_export]
    use crate::call::{call, library_run, main};
    #[pymodule_export]
    use crate::file::{attributes, entries, read, weights};
    #[pymodule_export]
    use crate::scene::Scene;

    #[pymodule_init]
    fn init(m: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        m.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

/// An error class of `signorini._errors`, with its arguments.
fn error<'py, A>(py: Python<'py>, class: &str, arguments: A) -> PyErr
where
    A: pyo3::call::PyCallArgs<'py>,
{
    let made = py
        .import("signorini._errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call1(arguments));
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(e) => e,
    }
}
