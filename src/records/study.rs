//! What the tasks of a study found, as columns.

/// A row for each task, in the order of the study.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StudyTable {
    /// Name of the study.
    pub name: String,
    /// Command of all tasks.
    pub command: String,
    /// Texts of the study and of its scene.
    pub texts: [String; 2],
    /// Names of the tasks' folders.
    pub ids: Vec<String>,
    /// Varied keys, and a value for each task.
    pub varied: Vec<(String, Vec<String>)>,
    /// `done`, `failed`, `waiting`, …
    pub states: Vec<String>,
    /// Why a task failed.
    pub messages: Vec<String>,
    /// Numbers that the commands answered with; not a number where a task has none.
    pub results: Vec<(String, Vec<f64>)>,
    /// What they took: seconds, evaluations, products.
    pub work: Vec<(String, Vec<f64>)>,
    /// All points of families one after the other: the task of each, and its columns.
    pub points: Points,
}

/// Points of families.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// Place of the task in the study.
    pub task: Vec<usize>,
    /// Frequency, energy, …; not a number where no orbit was found.
    pub columns: Vec<(String, Vec<f64>)>,
    /// What is special about it: `regular`, `jump`, `gap: not found`, …
    pub special: Vec<String>,
}

impl Points {
    /// A column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.0 == name).map(|c| &c.1[..])
    }
}

impl StudyTable {
    /// The values of a varied key as numbers, if all are.
    pub fn numbers(&self, varied: usize) -> Option<Vec<f64>> {
        self.varied[varied].1.iter().map(|v| v.parse().ok()).collect()
    }
}
