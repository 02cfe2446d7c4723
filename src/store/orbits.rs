//! Orbits and families of orbits in HDF5: `/orbit`, `/backbone`.
//!
//! `/backbone` has one row a point; what a point is in full, and where the continuation stood there, is in
//! `/backbone/points/NNNN`. Every point is on disk before the next one is computed: a killed continuation goes on from the last.

use std::path::{Path, PathBuf};

use hdf5::types::FixedAscii;
use hdf5::{Group, Location};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

use super::journal::{self, Journal, bits};
use super::reader::open;
use super::series::{Names, SeriesRecord, SeriesWriter, read_series};
use super::table::Table;
use super::writer::{along_axes, create_file};
use super::{StoreError, Writer, WriterOptions, read_text, write_text};
use crate::contact::Nbm;
use crate::scenario::Scene;

type Word = FixedAscii<64>;

/// An orbit as it is stored.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OrbitRecord {
    /// Period.
    #[serde(with = "bits::one")]
    pub period: f64,
    /// Largest energy over the period.
    #[serde(with = "bits::one")]
    pub energy: f64,
    /// Largest contact displacement.
    #[serde(with = "bits::one")]
    pub amplitude: f64,
    /// Return error.
    #[serde(with = "bits::one")]
    pub residual: f64,
    /// Time in contact.
    #[serde(with = "bits::one")]
    pub contact_time: f64,
    /// Distance from grazing.
    #[serde(with = "bits::one")]
    pub grazing: f64,
    /// Largest penetration over the unit of length.
    #[serde(with = "bits::one")]
    pub penetration: f64,
    /// Largest tension, likewise.
    #[serde(with = "bits::one")]
    pub tension: f64,
    /// Energy that is not accounted for, over the energy.
    #[serde(with = "bits::one")]
    pub balance: f64,
    /// All displacements at `t = 0`, `u_C` along the outward normal.
    #[serde(with = "bits::many")]
    pub u0: Vec<f64>,
    /// All velocities.
    #[serde(with = "bits::many")]
    pub v0: Vec<f64>,
    /// Multipliers: real and imaginary parts. Empty: not computed.
    #[serde(with = "bits::pairs")]
    pub multipliers: Vec<[f64; 2]>,
    /// How many of them belong to the family.
    pub trivial: usize,
    /// Whether it is stable, if that is known.
    pub stable: Option<bool>,
    /// Switches: time, mesh node, whether it closes.
    #[serde(with = "bits::switches")]
    pub switches: Vec<(f64, usize, bool)>,
    /// Energy jumps at the switches.
    #[serde(with = "bits::many")]
    pub jumps: Vec<f64>,
}

/// Where a continuation stood.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaceRecord {
    /// Unknowns, the parameter last.
    #[serde(with = "bits::many")]
    pub x: Vec<f64>,
    /// Tangent.
    #[serde(with = "bits::many")]
    pub tangent: Vec<f64>,
    /// Step.
    #[serde(with = "bits::one")]
    pub step: f64,
    /// Sign of the bordered determinant.
    #[serde(with = "bits::one")]
    pub orientation: f64,
    /// Signature.
    pub signature: Vec<i64>,
    /// Active sets of the chart, one row each.
    pub sets: Vec<Vec<bool>>,
    /// Contact node of each event.
    pub nodes: Vec<usize>,
}

/// One row of `/backbone`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Which branch (one for each damping ratio, number of harmonics, …).
    pub branch: usize,
    /// `regular`, or what is special.
    pub special: String,
    /// The orbit; none: a point that was asked for and does not exist.
    pub orbit: Option<OrbitRecord>,
    /// Where to go on.
    pub place: Option<PlaceRecord>,
    /// The series, if harmonic balance made the point.
    pub series: Option<SeriesRecord>,
}

fn word(text: &str) -> Word {
    let text: String = text.chars().filter(char::is_ascii).take(63).collect();
    Word::from_ascii(text.as_bytes()).unwrap_or_default()
}

fn scalar(g: &Location, name: &str, value: f64) -> Result<(), StoreError> {
    g.new_attr::<f64>().create(name)?.write_scalar(&value)?;
    Ok(())
}

fn read_scalar(g: &Location, name: &str) -> Result<f64, StoreError> {
    Ok(g.attr(name)?.read_scalar()?)
}

fn matrix<T: Clone>(rows: usize, columns: usize, values: Vec<T>) -> Result<Array2<T>, StoreError> {
    Ok(Array2::from_shape_vec((rows, columns), values)
        .map_err(|e| hdf5::Error::from(e.to_string()))?)
}

const NUMBERS: [&str; 9] = [
    "period",
    "energy",
    "amplitude",
    "residual",
    "contact_time",
    "grazing_distance",
    "penetration",
    "tension",
    "energy_balance",
];

fn write_orbit(g: &Group, o: &OrbitRecord, nbm: &Nbm) -> Result<(), StoreError> {
    let dofs = &nbm.body.dofs;
    let numbers = [
        o.period,
        o.energy,
        o.amplitude,
        o.residual,
        o.contact_time,
        o.grazing,
        o.penetration,
        o.tension,
        o.balance,
    ];
    NUMBERS.iter().zip(numbers).try_for_each(|(name, x)| scalar(g, name, x))?;
    scalar(g, "trivial_multipliers", o.trivial as f64)?;
    let stable = o.stable.map_or("not computed", |s| if s { "yes" } else { "no" });
    write_text(g, "stable", stable)?;
    g.new_dataset_builder().with_data(&along_axes(dofs, &o.u0)).create("u0")?;
    g.new_dataset_builder().with_data(&along_axes(dofs, &o.v0)).create("v0")?;
    let flat: Vec<f64> = o.multipliers.iter().flatten().copied().collect();
    let multipliers = matrix(o.multipliers.len(), 2, flat)?;
    g.new_dataset_builder().with_data(&multipliers).create("multipliers")?;
    let s = g.create_group("switches")?;
    let column =
        |f: &dyn Fn(&(f64, usize, bool)) -> f64| o.switches.iter().map(f).collect::<Vec<f64>>();
    s.new_dataset_builder().with_data(&column(&|s| s.0)).create("t")?;
    let nodes: Vec<i64> = o.switches.iter().map(|s| s.1 as i64).collect();
    s.new_dataset_builder().with_data(&nodes).create("node")?;
    let kinds: Vec<Word> =
        o.switches.iter().map(|s| word(if s.2 { "close" } else { "open" })).collect();
    s.new_dataset_builder().with_data(&kinds).create("kind")?;
    s.new_dataset_builder().with_data(&o.jumps).create("energy_jump")?;
    Ok(())
}

fn read_orbit(g: &Group) -> Result<OrbitRecord, StoreError> {
    let mut n = [0.0; 9];
    for (x, name) in n.iter_mut().zip(NUMBERS) {
        *x = read_scalar(g, name)?;
    }
    let multipliers: Array2<f64> = g.dataset("multipliers")?.read_2d()?;
    let s = g.group("switches")?;
    let t: Vec<f64> = s.dataset("t")?.read_raw()?;
    let node: Vec<i64> = s.dataset("node")?.read_raw()?;
    let kind: Vec<Word> = s.dataset("kind")?.read_raw()?;
    let switches = t.iter().zip(&node).zip(&kind);
    Ok(OrbitRecord {
        period: n[0],
        energy: n[1],
        amplitude: n[2],
        residual: n[3],
        contact_time: n[4],
        grazing: n[5],
        penetration: n[6],
        tension: n[7],
        balance: n[8],
        u0: g.dataset("u0")?.read_raw()?,
        v0: g.dataset("v0")?.read_raw()?,
        multipliers: multipliers.rows().into_iter().map(|r| [r[0], r[1]]).collect(),
        trivial: read_scalar(g, "trivial_multipliers")? as usize,
        stable: match read_text(g, "stable").as_deref() {
            Some("yes") => Some(true),
            Some("no") => Some(false),
            _ => None,
        },
        switches: switches.map(|((&t, &n), k)| (t, n as usize, k.as_str() == "close")).collect(),
        jumps: s.dataset("energy_jump")?.read_raw()?,
    })
}

impl Writer {
    /// Write `/orbit` beside the trajectory of its period.
    pub fn orbit(&mut self, orbit: &OrbitRecord, nbm: &Nbm) -> Result<(), StoreError> {
        write_orbit(&self.file().create_group("orbit")?, orbit, nbm)
    }
}

/// The open file of a family.
pub struct FamilyWriter {
    file: hdf5::File,
    points: Group,
    rows: Vec<Table<f64>>,
    special: Table<Word>,
    count: usize,
    series: Option<SeriesWriter>,
    harmonics: usize,
    journal: Option<Journal>,
}

const ROWS: [(&str, &str); 9] = [
    ("omega", "1/time"),
    ("energy", "energy"),
    ("amplitude", "length"),
    ("residual", "relative"),
    ("contact_time", "time"),
    ("grazing_distance", "relative"),
    ("switches", "number a period"),
    ("stable", "1 stable, 0 unstable, -1 not computed"),
    ("branch", "number"),
];

impl FamilyWriter {
    /// Create the file; `names` are those of the branches, `harmonics` the most that a series of it may have.
    pub fn create(
        path: &Path,
        scene: &Scene,
        nbm: &Nbm,
        options: &WriterOptions,
        kind: &str,
        names: &[String],
        harmonics: usize,
    ) -> Result<FamilyWriter, StoreError> {
        let mut writer = Self::without_journal(path, scene, nbm, options, kind, names)?;
        writer.harmonics = harmonics;
        let empty = StoredFamily {
            scene: scene.source.text.clone(),
            kind: kind.into(),
            branches: names.to_vec(),
            harmonics,
            ..StoredFamily::default()
        };
        writer.journal = Some(Journal::create(path, &empty)?);
        Ok(writer)
    }

    fn without_journal(
        path: &Path,
        scene: &Scene,
        nbm: &Nbm,
        options: &WriterOptions,
        kind: &str,
        names: &[String],
    ) -> Result<FamilyWriter, StoreError> {
        let file = create_file(path, scene, nbm, options)?;
        let g = file.create_group("backbone")?;
        write_text(&g, "kind", kind)?;
        write_text(&g, "branches", &names.join("\n"))?;
        // every row is flushed on its own: small chunks, no compression
        let rows: Result<Vec<_>, _> = ROWS
            .iter()
            .map(|(name, units)| Table::create(&g, name, None, 64, false, units))
            .collect();
        let special = Table::create(&g, "special", None, 64, false, "words")?;
        let points = g.create_group("points")?;
        file.flush()?;
        Ok(FamilyWriter {
            file,
            points,
            rows: rows?,
            special,
            count: 0,
            series: None,
            harmonics: 0,
            journal: None,
        })
    }

    /// A new file with the points of an unfinished one, to go on with.
    pub fn resume(
        path: &Path,
        scene: &Scene,
        nbm: &Nbm,
        options: &WriterOptions,
        kind: &str,
        known: &StoredFamily,
    ) -> Result<FamilyWriter, StoreError> {
        let temporary = PathBuf::from(format!("{}.part", path.display()));
        let fresh = WriterOptions { force: true, ..options.clone() };
        let mut writer =
            Self::without_journal(&temporary, scene, nbm, &fresh, kind, &known.branches)?;
        writer.harmonics = known.harmonics;
        for point in &known.points {
            writer.push_as_stored(point, nbm)?;
        }
        std::fs::rename(&temporary, path).map_err(|e| StoreError::unusable(path, e))?;
        writer.journal = Some(Journal::create(path, known)?);
        Ok(writer)
    }

    /// Stored displacements are along the axes already; the map between is its own inverse.
    fn push_as_stored(&mut self, point: &PointRecord, nbm: &Nbm) -> Result<(), StoreError> {
        let mut point = point.clone();
        if let Some(o) = &mut point.orbit {
            o.u0 = along_axes(&nbm.body.dofs, &o.u0);
            o.v0 = along_axes(&nbm.body.dofs, &o.v0);
        }
        self.push(&point, nbm)
    }

    /// Append a point; it is on disk when this returns.
    pub fn push(&mut self, p: &PointRecord, nbm: &Nbm) -> Result<(), StoreError> {
        if let Some(journal) = &mut self.journal {
            let mut as_stored = p.clone();
            if let Some(o) = &mut as_stored.orbit {
                o.u0 = along_axes(&nbm.body.dofs, &o.u0);
                o.v0 = along_axes(&nbm.body.dofs, &o.v0);
            }
            journal.append(&as_stored)?;
        }
        let g = self.points.create_group(&format!("{:04}", self.count))?;
        scalar(&g, "omega", p.omega)?;
        if let Some(o) = &p.orbit {
            write_orbit(&g, o, nbm)?;
        }
        if let Some(place) = &p.place {
            let c = g.create_group("continuation")?;
            scalar(&c, "step", place.step)?;
            scalar(&c, "orientation", place.orientation)?;
            c.new_dataset_builder().with_data(&place.x).create("x")?;
            c.new_dataset_builder().with_data(&place.tangent).create("tangent")?;
            c.new_dataset_builder().with_data(&place.signature).create("signature")?;
            let n_c = place.sets.first().map_or(0, Vec::len);
            let flags = place.sets.iter().flatten().map(|&a| u8::from(a)).collect();
            let sets = matrix(place.sets.len(), n_c, flags)?;
            c.new_dataset_builder().with_data(&sets).create("active")?;
            let nodes: Vec<i64> = place.nodes.iter().map(|&n| n as i64).collect();
            c.new_dataset_builder().with_data(&nodes).create("node")?;
        }
        let nan = f64::NAN;
        let o = p.orbit.as_ref();
        let of = |f: &dyn Fn(&OrbitRecord) -> f64| o.map_or(nan, f);
        let row = [
            p.omega,
            of(&|o| o.energy),
            of(&|o| o.amplitude),
            of(&|o| o.residual),
            of(&|o| o.contact_time),
            of(&|o| o.grazing),
            of(&|o| o.switches.len() as f64),
            of(&|o| o.stable.map_or(-1.0, |s| f64::from(u8::from(s)))),
            p.branch as f64,
        ];
        for (table, x) in self.rows.iter_mut().zip(row) {
            table.push(&[x]);
            table.append()?;
        }
        self.special.push(&[word(&p.special)]);
        self.special.append()?;
        if let Some(series) = &p.series {
            if self.series.is_none() {
                self.series = Some(SeriesWriter::create(&self.file, self.harmonics, nbm.n_o())?);
            }
            if let Some(writer) = &mut self.series {
                writer.push(series, self.count)?;
            }
        }
        self.count += 1;
        self.file.flush()?;
        Ok(())
    }

    /// The file, for other groups.
    pub(super) fn file(&self) -> &hdf5::File {
        &self.file
    }

    /// Number of points so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Write the final status.
    pub fn finish(self, status: &str) -> Result<(), StoreError> {
        write_text(&self.file, "status", status)?;
        self.file.flush()?;
        if let Some(journal) = self.journal {
            drop(self.file);
            journal.remove();
        }
        Ok(())
    }
}

/// A stored family.
#[derive(Debug, Clone, Default)]
pub struct StoredFamily {
    /// Path.
    pub path: PathBuf,
    /// Scene title.
    pub title: String,
    /// Scene text.
    pub scene: String,
    /// `running`, `complete`, …
    pub status: String,
    /// What kind of family.
    pub kind: String,
    /// Names of the branches.
    pub branches: Vec<String>,
    /// All points, displacements along the axes.
    pub points: Vec<PointRecord>,
    /// Most harmonics of `/hbm`.
    pub harmonics: usize,
}

impl StoredFamily {
    /// The family of an unfinished file, from its journal if there is one: the file itself may not open after a kill.
    pub fn recover(path: &Path) -> Result<StoredFamily, StoreError> {
        match journal::read(path) {
            Some(family) => Ok(family),
            None => Self::read(path),
        }
    }

    /// Read a family.
    pub fn read(path: &Path) -> Result<StoredFamily, StoreError> {
        let file = open(path)?;
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let g = file.group("backbone").map_err(|_| missing("/backbone"))?;
        let special: Vec<Word> = g.dataset("special")?.read_raw()?;
        let branch: Vec<f64> = g.dataset("branch")?.read_raw()?;
        let points = g.group("points")?;
        let mut all = vec![];
        for (k, (special, branch)) in special.iter().zip(&branch).enumerate() {
            let p = points.group(&format!("{k:04}"))?;
            let orbit = if p.link_exists("u0") { Some(read_orbit(&p)?) } else { None };
            let place = match p.group("continuation") {
                Err(_) => None,
                Ok(c) => {
                    let sets: Array2<u8> = c.dataset("active")?.read_2d()?;
                    let nodes: Vec<i64> = c.dataset("node")?.read_raw()?;
                    Some(PlaceRecord {
                        x: c.dataset("x")?.read_raw()?,
                        tangent: c.dataset("tangent")?.read_raw()?,
                        step: read_scalar(&c, "step")?,
                        orientation: read_scalar(&c, "orientation")?,
                        signature: c.dataset("signature")?.read_raw()?,
                        sets: sets
                            .rows()
                            .into_iter()
                            .map(|r| r.iter().map(|&a| a == 1).collect())
                            .collect(),
                        nodes: nodes.iter().map(|&n| n as usize).collect(),
                    })
                }
            };
            all.push(PointRecord {
                omega: read_scalar(&p, "omega")?,
                branch: *branch as usize,
                special: special.as_str().to_owned(),
                orbit,
                place,
                series: None,
            });
        }
        let mut harmonics = 0;
        if let Ok(hbm) = file.group("hbm") {
            let shape = hbm.dataset("coefficients")?.shape();
            let rows: Vec<i64> = hbm.dataset("point")?.read_raw()?;
            harmonics = shape.get(1).map_or(0, |f| f / 2);
            let n_o = shape.get(2).copied().unwrap_or(0);
            let series = read_series(path, &Names::default(), n_o)?;
            for (row, series) in rows.iter().zip(series) {
                if let Some(point) = all.get_mut(*row as usize) {
                    point.series = Some(series);
                }
            }
        }
        let text = |name: &str| read_text(&file, name).unwrap_or_default();
        Ok(StoredFamily {
            path: path.to_owned(),
            title: text("title"),
            scene: text("scene"),
            status: text("status"),
            kind: read_text(&g, "kind").unwrap_or_default(),
            branches: read_text(&g, "branches")
                .unwrap_or_default()
                .lines()
                .map(str::to_owned)
                .collect(),
            points: all,
            harmonics,
        })
    }
}

/// The orbit of a file, if it holds one.
pub fn read_stored_orbit(path: &Path) -> Result<Option<OrbitRecord>, StoreError> {
    let file = open(path)?;
    match file.group("orbit") {
        Ok(g) => Ok(Some(read_orbit(&g)?)),
        Err(_) => Ok(None),
    }
}
