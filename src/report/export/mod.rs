//! Stored runs in other formats: CSV for a spreadsheet, VTKHDF, VTU and XDMF for ParaView, meshio and everything built on VTK.
//!
//! A [`Plan`] says what will be written, state by state, before anything is: [`Plan::targets`]. Every file is written beside its
//! name and renamed when it is complete, and carries a mark that this program made it.

mod csv;
mod fields;
mod put;
mod vtkhdf;
mod vtu;
mod xdmf;

use std::fs;
use std::path::{Path, PathBuf};

use crate::store::{Stored, beside as named};
use fields::Fields;
pub use fields::LargestStress;
pub use put::ExportError;
use put::at;
pub(in crate::report) use put::{number, quoted};

/// Formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `STEM.csv` and `STEM-switches.csv`.
    Csv,
    /// `STEM-vtu/STEM-NNNNNN.vtu` and the collection `STEM-vtu/STEM.pvd`.
    Vtu,
    /// `STEM.vtkhdf`.
    VtkHdf,
    /// `STEM.xdmf` and its numbers in `STEM.xdmf.h5`.
    Xdmf,
}

/// The largest stress of a run; none of a body without elements, or whose displacements are not kept.
pub fn largest_stress(stored: &Stored) -> Option<LargestStress> {
    Fields::of(stored).ok()?.largest_stress()
}

/// Which of the stored states are written: those with `from ≤ t ≤ to`, and of these the first and each `every`th after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection {
    /// Each so many-th stored state, at least 1.
    pub every: usize,
    /// Earliest time.
    pub from: Option<f64>,
    /// Latest time.
    pub to: Option<f64>,
}

impl Default for Selection {
    fn default() -> Self {
        Selection { every: 1, from: None, to: None }
    }
}

impl Selection {
    /// Whether a time lies in the window; `last` is the largest time of the file, whose rounding is forgiven, so that 0.3 finds the
    /// state that an evenly spaced sampling put at 0.30000000000000004.
    fn contains(&self, t: f64, last: f64) -> bool {
        let slack = 4.0 * f64::EPSILON * last.abs();
        self.from.is_none_or(|from| t >= from - slack) && self.to.is_none_or(|to| t <= to + slack)
    }

    /// Positions of the chosen times in an increasing list.
    pub fn rows(&self, t: &[f64]) -> Vec<usize> {
        let last = t.last().copied().unwrap_or(0.0);
        let inside = (0..t.len()).filter(|&row| self.contains(t[row], last));
        inside.step_by(self.every.max(1)).collect()
    }
}

/// What has been done.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Written {
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Files removed: states of an earlier, longer export of the same name.
    pub removed: Vec<PathBuf>,
}

/// Everything that is needed to write, checked.
#[derive(Debug)]
pub struct Plan<'s> {
    stored: &'s Stored,
    format: Format,
    rows: Vec<usize>,
    selection: Selection,
    stem: PathBuf,
    fields: Option<Fields<'s>>,
    /// What else a table has the motions of.
    points: Vec<Followed>,
}

/// A point whose motion a table has: what it is called, and the nodes that it is interpolated from.
#[derive(Debug, Clone)]
pub(super) struct Followed {
    pub name: String,
    pub weights: Vec<(usize, f64)>,
}

impl<'s> Plan<'s> {
    /// Choose states and check that the format can hold them.
    pub fn new(
        stored: &'s Stored,
        format: Format,
        selection: Selection,
        stem: &Path,
    ) -> Result<Plan<'s>, ExportError> {
        check_name(stem, format)?;
        let fields = match format {
            Format::Csv => None,
            Format::Vtu | Format::VtkHdf | Format::Xdmf => {
                let whole = stored.whole();
                Some(Fields::of(whole.map_err(|e| ExportError::Nothing(e.to_string()))?)?)
            }
        };
        let rows = selection.rows(&stored.t);
        if rows.is_empty() {
            return Err(ExportError::Nothing(nothing(stored, &selection)));
        }
        Ok(Plan { stored, format, rows, selection, stem: stem.to_owned(), fields, points: vec![] })
    }

    /// The same with displacements and velocities of some nodes, in a table.
    pub(crate) fn with_nodes(self, words: &[String]) -> Result<Plan<'s>, ExportError> {
        let nothing = |text: String| Err(ExportError::Nothing(text));
        if !words.is_empty() && self.format != Format::Csv {
            return nothing(
                "--nodes adds columns to --format csv; the other formats have all nodes".into(),
            );
        }
        let mut plan = self;
        for word in words {
            let node = match plan.stored.node_called(word) {
                Ok(node) => node,
                Err(why) => return nothing(format!("--nodes {word}: {why}")),
            };
            if !plan.stored.keeps(node) {
                return nothing(format!(
                    "--nodes {word}: {} does not keep its displacements ([run] store); run the scene with store = \"all\"",
                    plan.stored.path.display()
                ));
            }
            let name = plan.stored.node_name(node);
            plan.points.push(Followed { name, weights: vec![(node, 1.0)] });
        }
        Ok(plan)
    }

    /// The same with displacements and velocities at some places, which the shape functions of their elements give.
    pub(crate) fn with_places(self, places: &[Vec<f64>]) -> Result<Plan<'s>, ExportError> {
        let nothing = |text: String| Err(ExportError::Nothing(text));
        if !places.is_empty() && self.format != Format::Csv {
            return nothing(
                "--place adds columns to --format csv; the other formats have the whole body"
                    .into(),
            );
        }
        let mut plan = self;
        for place in places {
            let words: Vec<String> = place.iter().map(|x| number(*x)).collect();
            let weights = match plan.stored.weights_at(place) {
                Ok(weights) => weights,
                Err(why) => return nothing(format!("--place {}: {why}", words.join(","))),
            };
            if let Some((node, _)) = weights.iter().find(|(n, _)| !plan.stored.keeps(*n)) {
                return nothing(format!(
                    "--place {}: {} does not keep the displacements of node {node} there ([run] store); run the scene with store = \"all\"",
                    words.join(","),
                    plan.stored.path.display()
                ));
            }
            plan.points.push(Followed { name: words.join(" "), weights });
        }
        Ok(plan)
    }

    /// Number of states that will be written.
    pub fn states(&self) -> usize {
        self.rows.len()
    }

    /// The files that will be written, all of them; the collection of VTU files stands first.
    pub fn targets(&self) -> Vec<PathBuf> {
        targets(self.format, &self.stem, self.rows.len())
    }

    /// The files that are in the way of this set and will be removed when it is complete.
    pub(crate) fn leftovers(&self) -> Vec<PathBuf> {
        match self.format {
            Format::Vtu => vtu::leftovers(&self.stem, self.rows.len()),
            Format::Csv | Format::VtkHdf | Format::Xdmf => vec![],
        }
    }

    /// Write all files.
    pub fn write(&self) -> Result<Written, ExportError> {
        let files = self.targets();
        match (self.format, &self.fields) {
            (Format::Vtu, Some(fields)) => vtu::write(fields, &self.rows, &files)?,
            (Format::VtkHdf, Some(fields)) => vtkhdf::write(fields, &self.rows, &files)?,
            (Format::Xdmf, Some(fields)) => xdmf::write(fields, &self.rows, &files)?,
            (_, _) => csv::write(self.stored, &self.rows, &self.switches(), &self.points, &files)?,
        }
        let mut removed = vec![];
        for path in self.leftovers() {
            fs::remove_file(&path).map_err(|e| at(&path, &e))?;
            removed.push(path);
        }
        Ok(Written { files, removed })
    }

    /// Switches in the window, all of them.
    fn switches(&self) -> Vec<usize> {
        let last = self.stored.t.last().copied().unwrap_or(0.0);
        let inside = |&k: &usize| self.selection.contains(self.stored.switch_t[k], last);
        (0..self.stored.switch_t.len()).filter(inside).collect()
    }
}

/// The files that an export of so many states writes.
pub fn targets(format: Format, stem: &Path, states: usize) -> Vec<PathBuf> {
    match format {
        Format::Csv => vec![named(stem, ".csv"), named(stem, "-switches.csv")],
        Format::Vtu => vtu::targets(stem, states),
        Format::VtkHdf => vec![named(stem, ".vtkhdf")],
        Format::Xdmf => vec![named(stem, ".xdmf"), named(stem, ".xdmf.h5")],
    }
}

/// The file that a family or a cross-check is written to as CSV.
pub fn table(stem: &Path) -> PathBuf {
    named(stem, ".csv")
}

/// Files that refer to one another by name need one that XML and its readers can spell.
fn check_name(stem: &Path, format: Format) -> Result<(), ExportError> {
    let refuse = |reason| Err(ExportError::Name { path: stem.to_owned(), reason });
    let ends_in_folder = stem.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
    let Some(name) = stem.file_name().filter(|_| !ends_in_folder) else {
        return refuse("is no beginning of a file name; give one, for example out/plate");
    };
    if matches!(format, Format::Csv | Format::VtkHdf) {
        return Ok(());
    }
    match name.to_str().filter(|name| !name.chars().any(char::is_control)) {
        None => refuse("XML cannot spell this name; choose another one with -o"),
        // readers split FILE:DATASET at the colon and trim both
        Some(name) if format == Format::Xdmf && (name.contains(':') || name.trim() != name) => {
            refuse(
                "XDMF takes no names with a colon or with spaces around them; choose another one with -o",
            )
        }
        Some(_) => Ok(()),
    }
}

/// Why no state is chosen, and which there are.
fn nothing(stored: &Stored, selection: &Selection) -> String {
    let file = stored.path.display();
    let (Some(&first), Some(&last)) = (stored.t.first(), stored.t.last()) else {
        return format!("{file} holds no stored state yet (status: {})", stored.status);
    };
    let window = match (selection.from, selection.to) {
        (Some(from), Some(to)) => format!("from t = {} to t = {}", number(from), number(to)),
        (Some(from), None) => format!("from t = {} on", number(from)),
        (None, Some(to)) => format!("up to t = {}", number(to)),
        (None, None) => "at all".into(),
    };
    format!(
        "{file} has no stored state {window}: its {} states lie between t = {} and t = {}",
        stored.t.len(),
        number(first),
        number(last)
    )
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::put::{put, replace};
    use super::*;

    #[test]
    fn numbers_are_short_and_read_back() {
        let words = [
            (0.0, "0"),
            (-0.0, "0"),
            (-3.0, "-3"),
            (0.0084, "0.0084"),
            (1.5e-13, "1.5e-13"),
            (1e300, "1e300"),
            (0.1 + 0.2, "0.30000000000000004"),
        ];
        for (x, text) in words {
            assert_eq!(number(x), text);
            assert_eq!(text.parse::<f64>().unwrap(), x);
        }
    }

    #[test]
    fn states_are_chosen_by_time_and_count() {
        let t: Vec<f64> = (0..=10).map(|k| 0.1 * f64::from(k)).collect();
        let rows = |every, from, to| Selection { every, from, to }.rows(&t);
        assert_eq!(rows(1, None, None).len(), 11);
        assert_eq!(rows(4, None, None), [0, 4, 8]);
        // 0.1 × 3 is above 0.3, 0.1 × 7 above 0.7
        assert_eq!(rows(1, Some(0.3), Some(0.7)), [3, 4, 5, 6, 7]);
        assert_eq!(rows(2, Some(0.25), Some(0.7)), [3, 5, 7]);
        assert_eq!(rows(100, Some(0.95), None), [10]);
        assert!(rows(1, Some(1.1), None).is_empty() && rows(1, Some(0.5), Some(0.4)).is_empty());
    }

    #[test]
    fn a_part_that_fails_is_removed_and_the_old_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        put(&path, b"old").unwrap();
        let failed = replace(&path, |part| {
            fs::write(part, "ne")?;
            Err(io::Error::other("the disk is full"))
        });
        let message = failed.unwrap_err().to_string();
        assert!(message.contains("a.csv") && message.contains("full"), "{message}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn names_that_readers_cannot_spell_are_refused() {
        for (name, format, fits) in [
            ("out/plate", Format::Xdmf, true),
            ("a b", Format::Xdmf, true),
            ("a:b", Format::Csv, true),
            ("a:b", Format::Vtu, true),
            ("a:b", Format::Xdmf, false),
            ("a ", Format::Xdmf, false),
            ("a\n", Format::Vtu, false),
            ("out/", Format::Csv, false),
            ("..", Format::Vtu, false),
        ] {
            assert_eq!(check_name(Path::new(name), format).is_ok(), fits, "{name} {format:?}");
        }
    }
}
