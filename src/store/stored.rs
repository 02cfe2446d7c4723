//! A family of orbits as a file, or the journal of an unfinished one, holds it.

use std::path::{Path, PathBuf};

use hdf5::Group;
use serde::de::DeserializeOwned;
use serde_json as json;

use super::careful::{Careful, open, reading};
use super::crosscheck::read_crosscheck;
use super::extremes::{StoredWatched, read_extremes, set_extremes};
use super::family::ridge_of;
use super::journal;
use super::orbits::{read_orbit, read_place, read_scalar};
use super::series::{Names, read_series};
use super::statement::read_statement;
use super::sweep::read_sweep;
use super::{StoreError, read_text};
use crate::fem::Body;
use crate::records::{
    Branch, BranchEnd, ErrorStatement, FamilyKind, Outline, Peak, PointRecord, Status,
};

/// A stored family.
#[derive(Debug, Clone, Default)]
pub struct StoredFamily {
    /// Path.
    pub path: PathBuf,
    /// Scene title.
    pub title: String,
    /// Scene text.
    pub scene: String,
    /// How it ended.
    pub status: Status,
    /// What determines it.
    pub identity: FamilyKind,
    /// Frequencies that it was asked for.
    pub range: [f64; 2],
    /// The branches.
    pub branches: Vec<Branch>,
    /// How the branches ended; empty while they are computed.
    pub ends: Vec<BranchEnd>,
    /// All points, displacements along the axes.
    pub points: Vec<PointRecord>,
    /// Forces and quantities of probes that extremes of points are of.
    pub watched: Vec<StoredWatched>,
    /// Most harmonics of `/hbm`.
    pub harmonics: usize,
    /// How far its energies may be off, if that was computed.
    pub statement: Option<ErrorStatement>,
}

impl StoredFamily {
    /// Its kind without numbers.
    pub fn outline(&self) -> Outline {
        self.identity.outline()
    }

    /// The family of an unfinished file, from its journal if there is one: the file itself may not open after a kill. With what there
    /// is to say of a damaged journal.
    pub fn recover(path: &Path) -> Result<(StoredFamily, Option<String>), StoreError> {
        match journal::read(path) {
            Some((family, None)) => Ok((family, None)),
            Some((family, Some(line))) => {
                let text = format!(
                    "line {line} of the journal of {} is damaged; the {} points before it are kept, all others are computed anew",
                    path.display(),
                    family.points.len()
                );
                Ok((family, Some(text)))
            }
            None => {
                let note = journal::exists(path).then(|| {
                    format!("the journal of {} cannot be read; its file is taken", path.display())
                });
                Ok((Self::read(path)?, note))
            }
        }
    }

    /// Count the displacements of its orbits along the directions of a body's numbering in place of the axes.
    pub(crate) fn count_along_directions(&mut self, body: &Body) {
        for orbit in self.points.iter_mut().filter_map(|p| p.orbit.as_mut()) {
            for x in [&mut orbit.u0, &mut orbit.v0] {
                *x = body.nodal_dofs().from_axes(x);
            }
        }
    }

    /// The points of a branch, in the order of the walk.
    pub fn branch(&self, branch: usize) -> Vec<&PointRecord> {
        let mut points: Vec<&PointRecord> =
            self.points.iter().filter(|p| p.branch == branch).collect();
        points.sort_by_key(|p| p.index);
        points
    }

    /// The peaks of its responses, branch by branch.
    pub fn peaks(&self) -> Vec<Peak> {
        let height = |p: &PointRecord| {
            let o = p.orbit.as_ref()?;
            Some((p.branch, p.index, [p.omega, o.amplitude, o.energy]))
        };
        let mut heights: Vec<_> = self.points.iter().filter_map(height).collect();
        ridge_of(&self.branches, &mut heights, &self.ends)
    }

    /// Whether an earlier run left a journal, which it only does if it did not end.
    pub(crate) fn is_unfinished(path: &Path) -> bool {
        journal::exists(path)
    }

    /// Whether there is something of this name to go on with.
    pub(crate) fn is_begun(path: &Path) -> bool {
        path.exists() || journal::exists(path)
    }

    /// Read a family.
    pub fn read(path: &Path) -> Result<StoredFamily, StoreError> {
        reading(path, || Self::read_all(path))
    }

    fn read_all(path: &Path) -> Result<StoredFamily, StoreError> {
        let file = open(path)?;
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let g = file.group("backbone").map_err(|_| {
            missing("family of orbits (/backbone): files of `backbone` and `response` do")
        })?;
        let mut points = read_points(path, &g)?;
        let harmonics = read_parts(path, &file, &mut points)?;
        let (watched, extremes) = read_extremes(&file)?;
        set_extremes(&mut points, extremes);
        let text = |name: &str| read_text(&file, name).unwrap_or_default();
        let range = g.attr("range").and_then(|a| a.read_raw::<f64>()).unwrap_or_default();
        Ok(StoredFamily {
            path: path.to_owned(),
            title: text("title"),
            scene: text("scene"),
            status: Status::of_name(&text("status")),
            identity: typed(path, &g, "identity")?,
            range: if let [low, high] = range[..] { [low, high] } else { [f64::NAN; 2] },
            branches: typed(path, &g, "branch_records")?,
            // a family that is being computed has none yet
            ends: typed(path, &g, "ends").unwrap_or_default(),
            points,
            watched,
            harmonics,
            statement: read_statement(&g)?,
        })
    }
}

/// A record that stands as JSON in an attribute.
fn typed<T: DeserializeOwned>(path: &Path, g: &Group, name: &str) -> Result<T, StoreError> {
    let text = read_text(g, name);
    text.and_then(|text| json::from_str(&text).ok()).ok_or_else(|| {
        let what =
            format!("damaged, or of an earlier version: {}/{name}; compute it again", g.name());
        StoreError::unusable(path, what)
    })
}

/// The points of `/backbone`, without series and checks.
fn read_points(path: &Path, g: &Group) -> Result<Vec<PointRecord>, StoreError> {
    let branch: Vec<f64> = g.dataset("branch")?.values()?;
    let index: Vec<f64> = g.dataset("index")?.values()?;
    let points = g.group("points")?;
    let mut all: Vec<PointRecord> = vec![];
    for (k, (branch, index)) in branch.iter().zip(&index).enumerate() {
        let p = points.group(&format!("{k:04}"))?;
        let orbit = if p.link_exists("u0") { Some(read_orbit(&p)?) } else { None };
        all.push(PointRecord {
            omega: read_scalar(&p, "omega")?,
            branch: *branch as usize,
            index: *index as i64,
            special: typed(path, &p, "special")?,
            orbit,
            place: read_place(&p)?,
            series: None,
            check: None,
            attractor: None,
        });
    }
    Ok(all)
}

/// Give the points their series, checks, and what a sweep saw there, where the file holds such; most harmonics of a series.
fn read_parts(
    path: &Path,
    file: &hdf5::File,
    points: &mut [PointRecord],
) -> Result<usize, StoreError> {
    let mut harmonics = 0;
    if let Ok(hbm) = file.group("hbm") {
        let shape = hbm.dataset("coefficients")?.shape();
        let rows: Vec<i64> = hbm.dataset("point")?.values()?;
        harmonics = shape.get(1).map_or(0, |f| f / 2);
        let n_o = shape.get(2).copied().unwrap_or(0);
        let series = read_series(path, &Names::default(), n_o)?;
        for (row, series) in rows.iter().zip(series) {
            if let Some(point) = usize::try_from(*row).ok().and_then(|row| points.get_mut(row)) {
                point.series = Some(series);
            }
        }
    }
    if file.link_exists("sweep") {
        for (row, seen) in read_sweep(file)? {
            if let Some(point) = usize::try_from(row).ok().and_then(|row| points.get_mut(row)) {
                point.attractor = Some(seen);
            }
        }
    }
    if let Some(checks) = read_crosscheck(path)? {
        for (point, check) in points.iter_mut().zip(checks) {
            point.check = Some(check);
        }
    }
    Ok(harmonics)
}
