//! Matrices that a program gives together with a scene, in place of files.

use std::collections::BTreeMap;
use std::sync::Arc;

/// A sparse matrix: its shape and its entries; entries at one place add up.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Matrix {
    /// Number of rows and columns.
    pub shape: (usize, usize),
    /// `(row, column, value)`, from 0.
    pub entries: Vec<(usize, usize, f64)>,
}

impl Matrix {
    /// As a file in the Matrix Market format, digit for digit.
    pub fn to_matrix_market(&self) -> String {
        use std::fmt::Write as _;
        let (rows, columns) = self.shape;
        let mut text = format!(
            "%%MatrixMarket matrix coordinate real general\n{rows} {columns} {}\n",
            self.entries.len()
        );
        for (i, j, v) in &self.entries {
            // the shortest text that is read back as the same number
            let _ = writeln!(text, "{} {} {v:e}", i + 1, j + 1);
        }
        text
    }
}

/// Matrices by the names that the scene calls them by.
#[derive(Debug, Clone, Default)]
pub struct Attached(Arc<BTreeMap<String, Matrix>>);

impl Attached {
    /// These matrices.
    pub fn new(matrices: BTreeMap<String, Matrix>) -> Attached {
        Attached(Arc::new(matrices))
    }

    /// The matrix of a name.
    pub fn get(&self, name: &str) -> Option<&Matrix> {
        self.0.get(name)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = (&String, &Matrix)> {
        self.0.iter()
    }
}
