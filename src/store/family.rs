//! Families of orbits in HDF5: `/backbone`, and `/hbm`, `/crosscheck` where the points have such a part.
//!
//! `/backbone` has one row a point; what a point is in full, and where the continuation stood there, is in
//! `/backbone/points/NNNN`. Every point is on disk before the next one is computed: a killed continuation goes on from the last.
//! Points of branches that are computed side by side come as they come; a finished file has them in one order.

use std::path::Path;

use hdf5::Group;
use serde::Serialize;
use serde_json as json;

use super::columns::{BRANCHES, FAMILY, RUBBED, VISCOUS};
use super::crosscheck::write_crosscheck;
use super::describe::describe;
use super::extremes::ExtremesWriter;
use super::grazings::{Passage, write_grazings};
use super::header::create_file;
use super::journal::Journal;
use super::mesh::size_of_mesh;
use super::orbits::{scalar, write_orbit, write_place};
use super::output::{Staged, check_room};
use super::ridge::write_ridge;
use super::schema::Rows;
use super::series::SeriesWriter;
use super::stored::StoredFamily;
use super::sweep::SweepWriter;
use super::table::Form;
use super::{StoreError, WriterOptions, write_text};
use crate::contact::{States, System};
use crate::event::Watch;
use crate::records::{
    Branch, BranchEnd, CheckRow, FamilyKind, Peak, PointRecord, Solver, Status, Walk, Way, peaks,
};
use crate::scenario::Scene;

/// What is known of a family before its first point.
#[derive(Debug, Clone)]
pub struct FamilyPlan {
    /// What determines it.
    pub identity: FamilyKind,
    /// Frequencies it covers.
    pub range: [f64; 2],
    /// The branches.
    pub branches: Vec<Branch>,
    /// Most harmonics that a series of it may have.
    pub harmonics: usize,
}

/// Which energy of a motion a family has.
fn energy_of(kind: &FamilyKind) -> &'static str {
    match (kind.outline().solver, kind.outline().way) {
        _ if kind.method.viscosity().is_some() => {
            "energy at t = 0 of the motion, which is fed and damped"
        }
        (Solver::HarmonicBalance, Way::Response) => "largest energy of the series over a period",
        (Solver::HarmonicBalance, _) => "energy of the series at t = 0",
        (Solver::Check, _) => {
            "largest energy of the orbit over a period; of viscous motions that at t = 0"
        }
        _ => "largest energy of the motion over a period",
    }
}

/// The open file of a family.
pub struct FamilyWriter {
    staged: Staged,
    file: hdf5::File,
    points: Group,
    rows: Rows<PointRecord>,
    series: Option<SeriesWriter>,
    sweep: Option<SweepWriter>,
    extremes: Option<ExtremesWriter>,
    checks: Vec<CheckRow>,
    /// Where each row belongs.
    order: Vec<(i64, i64)>,
    /// Branch, place on it, and frequency, amplitude, energy of every orbit: what the ridge of a response is made of.
    heights: Vec<Height>,
    passages: Vec<Passage>,
    journal: Option<Journal>,
    /// Whether nothing was there to go on with.
    is_new: bool,
    scene: Scene,
    options: WriterOptions,
    plan: FamilyPlan,
}

/// A point as the ridge sees it.
type Height = (usize, i64, [f64; 3]);

/// The peaks of all branches that are responses: those that a branch told at its end, else by its points; `heights` come as they were found.
pub(super) fn ridge_of(
    branches: &[Branch],
    heights: &mut [Height],
    ends: &[BranchEnd],
) -> Vec<Peak> {
    heights.sort_by_key(|h| (h.0, h.1));
    let of_branch = |branch: usize| {
        let told = ends.iter().find(|e| e.branch == branch && !e.peaks.is_empty());
        if let Some(end) = told {
            return end.peaks.clone();
        }
        let own = heights.iter().filter(|h| h.0 == branch);
        peaks(branch, own.map(|h| h.2).collect())
    };
    let responses = branches.iter().enumerate();
    let responses =
        responses.filter(|(_, b)| matches!(b, Branch::Response { .. } | Branch::Sweep { .. }));
    responses.flat_map(|(branch, _)| of_branch(branch)).collect()
}

impl FamilyWriter {
    /// Create the file.
    pub fn create(
        path: &Path,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
        plan: &FamilyPlan,
    ) -> Result<FamilyWriter, StoreError> {
        if super::output::is_null(path) {
            return Err(StoreError::unusable(
                path,
                "a family is read back when it is complete; give it a name",
            ));
        }
        let staged = Staged::begin(&options.outputs, path)?;
        let mut writer = Self::on(staged, scene, system, options, plan, 0)?;
        writer.begin_journal(&[])?;
        writer.is_new = true;
        Ok(writer)
    }

    /// A new version of an unfinished file, with the points that are known, to go on with.
    pub fn resume(
        path: &Path,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
        plan: &FamilyPlan,
        known: &[PointRecord],
    ) -> Result<FamilyWriter, StoreError> {
        let outputs = options.outputs.with_force(true);
        let mut staged = Staged::begin(&outputs, path)?;
        staged.restart();
        let size = known.iter().map(|p| size_of_point(p, plan.harmonics, system.n_o())).sum();
        let mut writer = Self::on(staged, scene, system, options, plan, size)?;
        let moved = writer.put_all(known, system).and_then(|()| writer.begin_journal(known));
        if let Err(e) = moved {
            writer.staged.discard();
            return Err(e);
        }
        writer.staged.commit()?;
        Ok(writer)
    }

    /// A file without points, where the stage says, with room for `size` bytes of them.
    fn on(
        staged: Staged,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
        plan: &FamilyPlan,
        size: u64,
    ) -> Result<FamilyWriter, StoreError> {
        let begin = || {
            check_room(staged.at(), size + size_of_mesh(system))?;
            let file = create_file(staged.at(), scene, system, options)?;
            let g = file.create_group("backbone")?;
            write_text(&g, "kind", &plan.identity.to_string())?;
            write_record(&g, "identity", &plan.identity)?;
            let names: Vec<String> = plan.branches.iter().map(Branch::to_string).collect();
            write_text(&g, "branches", &names.join("\n"))?;
            write_record(&g, "branch_records", &plan.branches)?;
            g.new_attr::<f64>().shape(2).create("range")?.write(&plan.range)?;
            // every row is flushed on its own: small chunks, no compression
            let viscous = if plan.identity.method.is_fed() { VISCOUS } else { &[] };
            let rubs = system.tangents().map_or(&[][..], |_| RUBBED);
            let columns = FAMILY.iter().chain(viscous).chain(rubs);
            let rows = Rows::create(&file, columns, &|_| Form::plain(None, 64))?;
            let points = g.create_group("points")?;
            let extremes = ExtremesWriter::create(&file, &Watch::new(system).all())?;
            describe(&file)?;
            let energies = g.dataset("energy")?;
            write_text(&energies, "description", energy_of(&plan.identity))?;
            file.flush()?;
            Ok((file, points, rows, extremes))
        };
        // a file that could not even be begun is of no use; an old one stands untouched
        let (file, points, rows, extremes) =
            begin().inspect_err(|_: &StoreError| staged.discard())?;
        Ok(FamilyWriter {
            staged,
            file,
            points,
            rows,
            series: None,
            sweep: None,
            extremes,
            checks: vec![],
            order: vec![],
            heights: vec![],
            passages: vec![],
            journal: None,
            is_new: false,
            scene: scene.clone(),
            options: options.clone(),
            plan: plan.clone(),
        })
    }

    fn begin_journal(&mut self, known: &[PointRecord]) -> Result<(), StoreError> {
        let FamilyPlan { identity, range, branches, harmonics } = self.plan.clone();
        let family = StoredFamily {
            scene: self.scene.source.text.clone(),
            identity,
            range,
            branches,
            harmonics,
            points: known.to_vec(),
            ..StoredFamily::default()
        };
        self.journal = Some(Journal::create(self.staged.path(), &family)?);
        Ok(())
    }

    fn put_all(&mut self, points: &[PointRecord], system: &System) -> Result<(), StoreError> {
        points.iter().try_for_each(|p| self.put(p, system))?;
        self.file.flush()?;
        Ok(())
    }

    /// Append a point; it is on disk when this returns.
    pub fn push(&mut self, p: &PointRecord, system: &System) -> Result<(), StoreError> {
        if let Some(journal) = &mut self.journal {
            journal.append(&along_axes(p, system))?;
        }
        self.put(p, system)?;
        self.file.flush()?;
        Ok(())
    }

    fn put(&mut self, p: &PointRecord, system: &System) -> Result<(), StoreError> {
        check_room(self.staged.at(), size_of_point(p, self.plan.harmonics, system.n_o()))?;
        let count = self.order.len();
        let g = self.points.create_group(&format!("{count:04}"))?;
        scalar(&g, "omega", p.omega)?;
        write_record(&g, "special", &p.special)?;
        if let Some(o) = &p.orbit {
            write_orbit(&g, o, system)?;
        }
        if let Some(place) = &p.place {
            write_place(&g, place)?;
        }
        self.rows.push(p);
        self.rows.append()?;
        if let Some(series) = &p.series {
            if self.series.is_none() {
                let most = self.plan.harmonics;
                self.series = Some(SeriesWriter::create(
                    &self.file,
                    most,
                    system.n_o(),
                    series.alpha.is_some(),
                )?);
            }
            if let Some(writer) = &mut self.series {
                writer.push(series, count)?;
            }
        }
        if let Some(seen) = &p.attractor {
            if self.sweep.is_none() {
                let (n_c, lines) = (system.n_contact(), seen.spectrum.len());
                self.sweep = Some(SweepWriter::create(&self.file, n_c, lines)?);
            }
            if let Some(writer) = &mut self.sweep {
                writer.push(seen, p.omega, count)?;
            }
        }
        if let Some(extremes) = &mut self.extremes {
            extremes.push(p)?;
        }
        self.checks.extend(p.check.clone());
        self.order.push(self.key(p));
        self.passages.push(Passage::of(p));
        self.heights.extend(
            p.orbit.as_ref().map(|o| (p.branch, p.index, [p.omega, o.amplitude, o.energy])),
        );
        Ok(())
    }

    /// Where a point belongs in a finished file.
    fn key(&self, p: &PointRecord) -> (i64, i64) {
        let branch = p.branch as i64;
        match self.plan.identity.walk {
            Walk::Grid(_) | Walk::Given => (p.index, branch),
            _ => (branch, p.index),
        }
    }

    /// Number of points so far.
    pub fn count(&self) -> usize {
        self.order.len()
    }

    /// What is computed.
    pub fn plan(&self) -> &FamilyPlan {
        &self.plan
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        self.staged.path()
    }

    /// Bring the points into their order, write how the branches ended and the final status. The journal of an unfinished family
    /// stays.
    pub(crate) fn finish(
        mut self,
        status: &Status,
        ends: &[BranchEnd],
        system: &System,
    ) -> Result<(), StoreError> {
        if !self.order.is_sorted() {
            self = self.sorted(system)?;
        }
        if !self.checks.is_empty() {
            write_crosscheck(&self.file, &self.checks)?;
        }
        let g = self.file.group("backbone")?;
        let ridge = match *status {
            Status::Complete => ridge_of(&self.plan.branches, &mut self.heights, ends),
            _ => vec![],
        };
        if !ridge.is_empty() {
            write_ridge(&self.file, &ridge)?;
        }
        write_grazings(&self.file, &self.passages)?;
        if !ends.is_empty() {
            let mut table = Rows::create(&self.file, BRANCHES, &|_| Form::plain(None, 64))?;
            ends.iter().for_each(|end| table.push(end));
            table.append()?;
        }
        write_record(&g, "ends", &ends)?;
        describe(&self.file)?;
        write_text(&self.file, "status", &status.to_string())?;
        self.file.flush()?;
        // all handles are closed before the file takes its place
        let FamilyWriter {
            mut staged, file, points, rows, series, sweep, extremes, journal, ..
        } = self;
        drop((points, rows, series, sweep, extremes, g, file));
        staged.commit()?;
        if let Some(journal) = journal.filter(|_| *status == Status::Complete) {
            journal.remove();
        }
        Ok(())
    }

    /// Whether it has nothing that an earlier command, or this one, has computed.
    pub(crate) fn is_blank(&self) -> bool {
        self.is_new && self.order.is_empty()
    }

    /// Nothing of it is worth keeping: what was asked for is refused.
    pub(crate) fn discard(self) {
        let FamilyWriter { staged, file, points, rows, series, sweep, extremes, journal, .. } =
            self;
        drop((points, rows, series, sweep, extremes, file));
        staged.discard();
        if let Some(journal) = journal {
            journal.remove();
        }
    }

    /// The same family with its rows in order, in a new file beside.
    fn sorted(self, system: &System) -> Result<FamilyWriter, StoreError> {
        self.file.flush()?;
        let FamilyWriter {
            mut staged,
            file,
            points,
            rows,
            series,
            sweep,
            extremes,
            checks,
            order,
            ..
        } = self;
        drop((file, points, rows, series, sweep, extremes));
        let mut stored = StoredFamily::read(staged.at())?;
        stored.count_along_directions(&system.body);
        let stored = stored.points;
        let mut places: Vec<usize> = (0..stored.len()).collect();
        places.sort_by_key(|&k| order[k]);
        let in_order: Vec<PointRecord> = places
            .iter()
            .map(|&k| PointRecord { check: checks.get(k).cloned(), ..stored[k].clone() })
            .collect();
        staged.restart();
        let size =
            in_order.iter().map(|p| size_of_point(p, self.plan.harmonics, system.n_o())).sum();
        let mut new = Self::on(staged, &self.scene, system, &self.options, &self.plan, size)?;
        if let Err(e) = new.put_all(&in_order, system) {
            new.staged.discard();
            return Err(e);
        }
        new.journal = self.journal;
        Ok(new)
    }
}

/// A record as JSON in an attribute.
fn write_record<T: Serialize>(g: &Group, name: &str, record: &T) -> Result<(), StoreError> {
    let text = json::to_string(record).map_err(|e| hdf5::Error::from(format!("{name}: {e}")))?;
    write_text(g, name, &text)
}

/// A point with its displacements along the axes, as files hold them.
fn along_axes(p: &PointRecord, system: &System) -> PointRecord {
    let mut p = p.clone();
    if let Some(o) = &mut p.orbit {
        o.u0 = system.body.nodal_dofs().along_axes(&o.u0);
        o.v0 = system.body.nodal_dofs().along_axes(&o.v0);
    }
    p
}

/// Bytes that a point takes at the most.
fn size_of_point(p: &PointRecord, harmonics: usize, n_o: usize) -> u64 {
    let orbit = p.orbit.as_ref().map_or(0, |o| {
        o.u0.len() + o.v0.len() + 2 * o.multipliers.len() + 5 * o.switches.len() + 512
    });
    let place = p.place.as_ref().map_or(0, |place| {
        let sets: usize = place.sets.iter().map(States::len).sum();
        2 * place.x.len() + sets + place.base.len() + 512
    });
    let series = p.series.as_ref().map_or(0, |_| (2 * harmonics + 1) * n_o + 64);
    let sweep = p.attractor.as_ref().map_or(0, |a| {
        a.peak.len() + a.trough.len() + 3 * a.sections.len() + a.spectrum.len() + 128
    });
    let extremes = p.extremes().map_or(0, |e| e.largest.len() + e.least.len());
    8 * (orbit + place + series + sweep + extremes + 1024) as u64
}
