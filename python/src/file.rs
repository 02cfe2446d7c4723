//! Files of results as arrays.

use std::path::{Path, PathBuf};

use numpy::IntoPyArray;
use numpy::ToPyArray;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyFileNotFoundError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use signorini::store::{self, Raw, StoreError, Stored};

fn refused(py: Python<'_>, path: &Path, e: &StoreError) -> PyErr {
    match e {
        StoreError::Missing { .. } => PyKeyError::new_err(e.to_string()),
        _ if !path.exists() => PyFileNotFoundError::new_err(e.to_string()),
        _ => crate::error(py, "FileError", (e.to_string(),)),
    }
}

/// An array takes over the memory that was read into.
fn object(py: Python<'_>, raw: Raw) -> PyResult<Py<PyAny>> {
    Ok(match raw {
        Raw::Float(a) => a.into_pyarray(py).into_any().unbind(),
        Raw::Integer(a) => a.into_pyarray(py).into_any().unbind(),
        Raw::Byte(a) => a.into_pyarray(py).into_any().unbind(),
        Raw::Flag(yes) => yes.into_py_any(py)?,
        Raw::Words(words) => words.into_py_any(py)?,
    })
}

/// An attribute: a number, a word, a row of numbers.
fn attribute(py: Python<'_>, raw: Raw) -> PyResult<Py<PyAny>> {
    match raw {
        Raw::Float(a) if a.ndim() == 0 => a.first().into_py_any(py),
        Raw::Integer(a) if a.ndim() == 0 => a.first().into_py_any(py),
        Raw::Float(a) => Ok(a.to_pyarray(py).into_any().unbind()),
        Raw::Words(words) => words.into_iter().next().unwrap_or_default().into_py_any(py),
        other => object(py, other),
    }
}

/// A dataset of a file.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf, name: &str) -> PyResult<Py<PyAny>> {
    let raw = py.detach(|| store::read_raw(&path, name));
    object(py, raw.map_err(|e| refused(py, &path, &e))?)
}

/// The nodes and weights by which the element of a place interpolates.
#[pyfunction]
pub fn weights(py: Python<'_>, path: PathBuf, place: Vec<f64>) -> PyResult<Vec<(usize, f64)>> {
    let body = py.detach(|| Stored::body(&path)).map_err(|e| refused(py, &path, &e))?;
    body.weights_at(&place).map_err(|why| PyValueError::new_err(format!("the place {why}")))
}

/// What stands in a group: names, and the shapes of datasets (none for groups).
#[pyfunction]
pub fn entries(
    py: Python<'_>,
    path: PathBuf,
    group: &str,
) -> PyResult<Vec<(String, Option<Vec<usize>>)>> {
    let found = py.detach(|| store::entries(&path, group));
    let found = found.map_err(|e| refused(py, &path, &e))?;
    Ok(found.into_iter().map(|e| (e.name, e.shape)).collect())
}

/// The attributes of a group.
#[pyfunction]
pub fn attributes(
    py: Python<'_>,
    path: PathBuf,
    group: &str,
) -> PyResult<Vec<(String, Py<PyAny>)>> {
    let found = py.detach(|| store::attributes(&path, group));
    let found = found.map_err(|e| refused(py, &path, &e))?;
    found.into_iter().map(|(name, raw)| Ok((name, attribute(py, raw)?))).collect()
}
