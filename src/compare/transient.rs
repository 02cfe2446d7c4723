//! Motions: `run` with each variant on each mesh, against the reference.

use std::time::Instant;

use super::plan::{Plan, Task};
use super::reference::{Reference, Trace, moved};
use super::{CompareError, Means, Take};
use crate::contact::March;
use crate::continuation::{Go, norm};
use crate::event::{Observer, Report, Sample, SwitchKind};
use crate::mesh::Mesh;
use crate::problem::Problem;
use crate::records::{Quantity, Row};
use crate::scenario::{Change, Scene};
use crate::simulate::{run_table, simulate};

/// Instants at which pressures are looked at, at the least.
const SAMPLES: usize = 2000;
/// The same in the shortest natural period of any phase, and at the most.
const PER_PERIOD: f64 = 16.0;
const MOST: usize = 100_000;
/// A reference that is smaller than this at the end, over the largest displacement of the motion, is small; smaller than this, it is not there.
const SMALL: f64 = 0.05;
const VANISHED: f64 = 1e-6;
/// A run is timed until this time in seconds has passed, at most so often; the shortest counts.
const TIMED: f64 = 0.2;
const REPEATS: usize = 7;

/// A motion, looked at closely.
#[derive(Debug)]
pub struct Measured {
    /// The mesh.
    pub mesh: Mesh,
    /// Displacement at the end, `dim` components a node.
    pub u: Vec<f64>,
    /// Nodes of the contact edge.
    contact_nodes: Vec<usize>,
    /// Largest displacement.
    pub largest: f64,
    /// The contact force.
    pub trace: Trace,
    report: Report,
    /// Size of the elements along the normal.
    h: f64,
    unknowns: usize,
    /// No pressures: impulses alone, or over steps.
    march: Option<March>,
    has_impacts: bool,
    has_potential: bool,
    /// Neither loads nor damping.
    is_free: bool,
    wall: f64,
}

/// Keeps the contact force and the last displacement.
struct Watch<'a> {
    stop: &'a dyn Fn() -> bool,
    areas: &'a [f64],
    touched: Vec<bool>,
    trace: Trace,
    u: Vec<f64>,
    largest: f64,
}

impl Observer for Watch<'_> {
    type Error = std::convert::Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Self::Error> {
        self.trace.push(s.t, s.pressure, self.areas, &self.touched);
        self.touched = s.active.flags();
        s.u.clone_into(&mut self.u);
        self.largest = s.u.iter().fold(self.largest, |m, u| m.max(u.abs()));
        Ok(())
    }
    fn progress(&mut self, _: f64) -> Result<Go, Self::Error> {
        Ok(if (self.stop)() { Go::Break(()) } else { Go::Continue(()) })
    }
}

/// Keeps nothing, and can be stopped.
struct Stoppable<'a>(&'a dyn Fn() -> bool);

impl Observer for Stoppable<'_> {
    type Error = std::convert::Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Self::Error> {
        Ok(())
    }
    fn progress(&mut self, _: f64) -> Result<Go, Self::Error> {
        Ok(if (self.0)() { Go::Break(()) } else { Go::Continue(()) })
    }
}

/// Run a problem as its scene says, and look closely; `timed` runs it again without looking.
pub fn measure(
    scene: &Scene,
    problem: &Problem,
    timed: bool,
    stop: &dyn Fn() -> bool,
) -> Result<Measured, String> {
    let (run, until) = run_table(scene).map_err(|e| e.to_string())?;
    let system = &problem.system;
    let march = system.impact().and_then(|law| law.march);
    let mut watched = scene.clone();
    let highest = system.units.highest;
    let needed = match march {
        // an impulse over a step is seen where the step ends
        Some(March::Steps(s)) => until / s.step,
        // stiff springs chatter as fast as they can
        None if highest.is_finite() => PER_PERIOD * until * highest / std::f64::consts::TAU,
        _ => 0.0,
    };
    let needed = (needed.ceil() as usize).min(MOST);
    if let Some(table) = watched.run.as_mut() {
        table.samples = run.samples.max(SAMPLES).max(needed);
    }
    let areas: Vec<f64> = system.constraints.iter().map(|c| c.area).collect();
    let touched = vec![true; areas.len()];
    let trace = Trace::default();
    let mut watch = Watch { stop, areas: &areas, touched, trace, u: vec![], largest: 0.0 };
    let report = simulate(&watched, problem, false, &mut watch).map_err(|e| e.to_string())?;
    if !report.outcome.is_complete() {
        return Err(report.outcome.to_string());
    }
    let wall = if timed { time(scene, problem, stop)? } else { f64::NAN };
    let body = &system.body;
    let u = body.nodal_dofs().scatter(&body.nodal(&watch.u));
    let facing = &body.dofs.facing;
    let contact_nodes = match facing.is_empty() {
        false => facing.iter().flat_map(|f| body.mesh.group_nodes(&f.group)).collect(),
        true => system.constraints.iter().map(|c| c.node).collect(),
    };
    Ok(Measured {
        mesh: body.mesh.clone(),
        u,
        contact_nodes,
        largest: watch.largest,
        trace: watch.trace,
        report,
        h: body.size_at_contact().unwrap_or(1.0),
        unknowns: system.n_o(),
        march,
        has_impacts: system.impact().is_some(),
        has_potential: system.has_potential(),
        is_free: system.loads.is_none() && !system.is_damped(),
        wall,
    })
}

/// Wall time of a run of which only the end is kept.
fn time(scene: &Scene, problem: &Problem, stop: &dyn Fn() -> bool) -> Result<f64, String> {
    let mut scene = scene.clone();
    if let Some(table) = scene.run.as_mut() {
        table.samples = 1;
    }
    let (begun, mut least) = (Instant::now(), f64::INFINITY);
    for _ in 0..REPEATS {
        let start = Instant::now();
        simulate(&scene, problem, false, &mut Stoppable(stop)).map_err(|e| e.to_string())?;
        least = least.min(start.elapsed().as_secs_f64());
        if begun.elapsed().as_secs_f64() > TIMED || stop() {
            break;
        }
    }
    Ok(least)
}

impl Measured {
    /// `‖u − w‖/‖w‖` over the nodes that do not touch.
    fn distance(&self, u: &[f64], w: &[f64]) -> f64 {
        let dim = self.mesh.dim();
        let counts = |k: &usize| !self.contact_nodes.contains(&(k / dim));
        let of = |x: &dyn Fn(usize) -> f64| {
            norm(&(0..u.len()).filter(counts).map(x).collect::<Vec<_>>())
        };
        of(&|k| u[k] - w[k]) / of(&|k| w[k])
    }

    /// The numbers of its row.
    fn row(
        &self,
        task: &Task,
        reference: &Reference,
        coarser: Option<&Measured>,
    ) -> Result<Row, String> {
        let exact = reference.field(&self.mesh)?;
        let r = &self.report;
        let mut row = Row { h: self.h, ..task.row() };
        let mut set = |quantity, value: f64| {
            if value.is_finite() {
                row.values.insert(quantity, value);
            }
        };
        set(Quantity::Unknowns, self.unknowns as f64);
        // at a passage through zero there is nothing that an error could be relative to
        let size = exact.iter().fold(0.0f64, |m, u| m.max(u.abs())) / self.largest;
        if size > VANISHED {
            set(Quantity::Error, self.distance(&self.u, &exact));
        }
        if let Some(coarser) = coarser
            && let Some(own) = moved(&self.u, &self.mesh, &coarser.mesh)
        {
            set(Quantity::Difference, coarser.distance(&own, &coarser.u));
        }
        set(Quantity::Penetration, r.max_penetration);
        set(Quantity::Tension, r.max_tension);
        let stepped = matches!(self.march, Some(March::Steps(_)));
        // blows have no pressure, and what steps push is a pressure by name only
        if !self.has_impacts || self.march.is_some() {
            set(Quantity::Overshoot, self.trace.peak / reference.trace().peak);
        }
        if !self.has_impacts || (self.march.is_some() && !stepped) {
            set(Quantity::PressureError, self.trace.distance(reference.trace()));
        }
        let pushed = if stepped { 0.0 } else { self.trace.impulse() };
        set(Quantity::Impulse, pushed + r.blows);
        // what forces without a potential do is booked with loads and damping, and is the method's
        let rubbed = r.rubbed.as_ref().map_or(0.0, |f| f.belt - f.work());
        let booked = r.energy_external - r.energy_dissipated + rubbed;
        let booked = if self.has_potential || r.rubbed.is_some() { booked } else { 0.0 };
        if self.has_potential || self.is_free {
            let change = r.energy_end - r.energy_start - booked;
            set(Quantity::EnergyChange, change / r.energy_start.abs());
        }
        set(Quantity::EnergyDrift, r.energy_drift_total);
        set(Quantity::Switches, r.switches.len() as f64);
        set(Quantity::Wall, self.wall);
        let rests = r.switches.iter().filter(|s| s.kind == SwitchKind::Rest).count();
        let mut notes = vec![];
        if rests > 0 {
            notes.push(format!("{rests} accumulations of impacts"));
        }
        if size <= VANISHED {
            notes.push(
                "the reference passes through zero at the end: there is no relative error".into(),
            );
        } else if size < SMALL {
            let share = 100.0 * size;
            notes.push(format!(
                "the error is relative to displacements of {share:.2} % of the largest"
            ));
        }
        if row.get(Quantity::EnergyChange) > 1.0 {
            notes.push("the method feeds the motion: its energy more than doubled".into());
        }
        row.note = notes.join("; ");
        Ok(row)
    }
}

/// All rows.
pub(super) fn rows(
    plan: &Plan,
    means: Means,
    known: &[Row],
    take: Take,
) -> Result<(), CompareError> {
    let count = plan.tasks().count().max(1) as f64;
    let mut references: Vec<(Vec<Change>, Reference)> = vec![];
    let mut done = 0;
    for series in &plan.series {
        // a mesh needs the one before it: what is known is known of a whole series
        let is_known = |t: &Task| known.iter().any(|r| t.is_of(r));
        if series.iter().all(is_known) {
            done += series.len();
            continue;
        }
        let mut coarser: Option<Measured> = None;
        for task in series {
            let problem = task.problem();
            let reference = match references.iter().position(|r| r.0 == problem) {
                Some(k) => &references[k].1,
                None => {
                    if take(None, done as f64 / count, "reference").is_break() {
                        return Ok(());
                    }
                    let reference = match Reference::new(plan, &problem, means) {
                        Err(_) if (means.stop)() => return Ok(()),
                        other => other?,
                    };
                    references.push((problem, reference));
                    &references[references.len() - 1].1
                }
            };
            if take(None, done as f64 / count, &task.title()).is_break() {
                return Ok(());
            }
            let measured = task
                .scene(&plan.scene)
                .map_err(|e| e.to_string())
                .and_then(|scene| measure(&scene, &(means.set_up)(&scene)?, true, means.stop));
            let row = measured.and_then(|m| Ok((m.row(task, reference, coarser.as_ref())?, m)));
            let row = match row {
                Ok((row, measured)) => {
                    coarser = Some(measured);
                    row
                }
                // a row that was stopped is none
                Err(_) if (means.stop)() => return Ok(()),
                Err(why) => Row { note: why, ..task.row() },
            };
            done += 1;
            if take(Some(row), done as f64 / count, &task.title()).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}
