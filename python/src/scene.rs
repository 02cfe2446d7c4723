//! Scenes in Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use signorini::scenario::{self, Attached, Change, Matrix, SceneError};

/// A scene that was read and checked.
#[pyclass(frozen, module = "signorini._signorini")]
pub struct Scene(pub(crate) scenario::Scene);

/// A matrix as Python gives it: shape, rows, columns, values.
type Triplets<'py> = (
    (usize, usize),
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, f64>,
);

/// Bad input, with its place where a scene shows it.
pub(crate) fn bad(py: Python<'_>, e: &SceneError) -> PyErr {
    match e {
        SceneError::Value(v) => {
            let place = (v.file.as_str(), v.line, v.column, v.key.as_str());
            crate::error(py, "SceneError", (v.message.as_str(), v.help.as_str(), place))
        }
        SceneError::Unreadable { file, .. } => {
            let help = "give the path of a TOML scene";
            let place = (file.as_str(), py.None(), py.None(), py.None());
            crate::error(py, "SceneError", (e.to_string(), help, place))
        }
    }
}

fn matrix(py: Python<'_>, name: &str, triplets: &Triplets) -> PyResult<Matrix> {
    let (shape, rows, columns, values) = triplets;
    let (rows, columns, values) = (rows.as_array(), columns.as_array(), values.as_array());
    let place = |i: i64, n: usize| usize::try_from(i).ok().filter(|i| *i < n);
    let entry = |((i, j), v): ((&i64, &i64), &f64)| {
        let place = place(*i, shape.0).zip(place(*j, shape.1));
        place.filter(|_| v.is_finite()).map(|(i, j)| (i, j, *v))
    };
    let entries: Option<Vec<_>> = rows.iter().zip(columns).zip(values).map(entry).collect();
    let entries = entries.ok_or_else(|| {
        crate::error(py, "SceneError", (format!("{name}: an entry is no number, or outside"),))
    })?;
    Ok(Matrix { shape: *shape, entries })
}

#[pymethods]
impl Scene {
    /// Check the text of a scene; `file` is for messages and for files that the scene names.
    #[new]
    #[pyo3(signature = (text, file, matrices = BTreeMap::new()))]
    fn new(
        py: Python<'_>,
        text: &str,
        file: PathBuf,
        matrices: BTreeMap<String, Triplets<'_>>,
    ) -> PyResult<Scene> {
        let mut scene = scenario::Scene::parse(text, &file).map_err(|e| bad(py, &e))?;
        let matrices: PyResult<BTreeMap<String, Matrix>> = matrices
            .into_iter()
            .map(|(name, triplets)| Ok((name.clone(), matrix(py, &name, &triplets)?)))
            .collect();
        scene.attached = Attached::new(matrices?);
        Ok(Scene(scene))
    }

    /// Read a scene.
    #[staticmethod]
    fn read(py: Python<'_>, file: PathBuf) -> PyResult<Scene> {
        scenario::Scene::read(&file).map(Scene).map_err(|e| bad(py, &e))
    }

    /// The scene with keys changed: `(key, value as TOML)`, none to remove a key.
    fn changed(&self, py: Python<'_>, changes: Vec<(String, Option<String>)>) -> PyResult<Scene> {
        let changes: Vec<Change> =
            changes.into_iter().map(|(key, value)| Change { key, value }).collect();
        self.0.with(&changes).map(Scene).map_err(|e| bad(py, &e))
    }

    /// The text, as TOML.
    #[getter]
    fn text(&self) -> &str {
        &self.0.source.text
    }

    /// Where it was read from.
    #[getter]
    fn file(&self) -> &std::path::Path {
        &self.0.source.file
    }

    /// Its title, or where it has none the name of its file.
    #[getter]
    fn title(&self) -> String {
        self.0.name()
    }

    /// End time of a run, if the scene has one.
    #[getter]
    fn until(&self) -> Option<f64> {
        self.0.until()
    }

    /// Its tables as JSON.
    fn tables(&self, py: Python<'_>) -> PyResult<String> {
        self.0.to_json().map_err(|e| bad(py, &e))
    }

    /// Files that it names.
    fn files(&self) -> Vec<PathBuf> {
        self.0.files()
    }

    /// Its matrices as texts in the Matrix Market format, by name.
    fn matrices(&self) -> BTreeMap<String, String> {
        self.0.attached.iter().map(|(name, m)| (name.clone(), m.to_matrix_market())).collect()
    }
}
