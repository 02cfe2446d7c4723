//! `signorini crosscheck`

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc;

use clap::Args;
use serde_json::{Value, json};

use signorini::contact::System;
use signorini::families::{Asked, check, start};
use signorini::hbm::check::NEAR;
use signorini::orbit::Closure;
use signorini::problem::Problem;
use signorini::records::{
    Branch, BranchEnd, CheckRow, FamilyKind, PointMethod, PointRecord, SeriesRecord, Walk,
    fingerprint,
};
use signorini::report::crosscheck::{Tally, by_harmonics};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{
    Content, FamilyPlan, FamilyWriter, Names, StoreError, StoredFamily, content, read_csv,
    read_origin, read_series,
};

use super::family::{self, Carried, Output};
use super::progress::Bar;
use super::task::{Files, Task, Work};
use super::{Answer, CliError, Global, load, plain, viscous};

/// Arguments of `crosscheck`.
#[derive(Debug, Args)]
#[command(
    after_help = "BACKBONE is a file of `backbone --method hbm`, a MATLAB v7.3 file (name its variables), or CSV with the columns \
    point, omega, k, part (cos or sin), u_1, …, u_nO: any label a point, a row for the cosine of every harmonic k = 0, 1, … and \
    for its sines unless all are zero.\n\n\
    u_1 … u_nO are u_O: all displacements that no support holds but those of the contact along its normals, which follow from \
    them and are left out; in the order of mesh/dof_map in any file of the scene (0 … nO - 1; of matrices the other rows in their order).\n\n\
    Example:\n  signorini backbone scenarios/half-plate-orbit.toml --method hbm -o hbm.h5\n  signorini crosscheck hbm.h5 scenarios/half-plate-orbit.toml -o checked.h5\n  signorini plot checked.h5\n  signorini crosscheck theirs.mat scenarios/half-plate-orbit.toml --omega w --coefficients Q"
)]
pub struct Arguments {
    /// Harmonic-balance results: own file, CSV, or MATLAB v7.3
    backbone: PathBuf,
    /// The scene that they are solutions of
    scene: PathBuf,
    /// Name of the variable that holds the frequencies (MATLAB)
    #[arg(long, value_name = "NAME")]
    omega: Option<String>,
    /// Name of the variable that holds the coefficients: points × (2 N_h + 1) × n_O, order a_0, a_1, b_1, a_2, b_2, …
    #[arg(long, value_name = "NAME")]
    coefficients: Option<String>,
    /// Name of the variable that holds alpha, for viscous nonlinear modes (MATLAB)
    #[arg(long, value_name = "NAME")]
    alpha: Option<String>,
    /// Viscous nonlinear modes of another program: beta [default: that of the file, or of the scene's [orbit]]
    #[arg(long, value_name = "BETA", allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Do not look for the cause where shooting fails
    #[arg(long)]
    quick: bool,
    /// Go on with an unfinished file
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    output: Output,
}

impl Arguments {
    /// How the orbits close: those of a viscous body where the series have `α`; `known` is the viscosity of an own file.
    fn closure(
        &self,
        scene: &Scene,
        problem: &Problem,
        series: &[SeriesRecord],
        known: Option<f64>,
    ) -> Result<Closure, CliError> {
        let fed = series.iter().filter(|s| s.alpha.is_some()).count();
        if fed > 0 && fed < series.len() {
            return Err(CliError::Input("some points have an alpha, and others have none".into()));
        }
        if fed > 0 {
            let body = family::propagator(problem.system.clone())?;
            let beta = self.beta.or(known);
            return Ok(viscous::closure(&viscous::with_beta(scene, &body, beta)?));
        }
        if self.beta.is_some() {
            return Err(CliError::Input(
                "--beta: the series have no alpha, so they are not those of a viscous body".into(),
            ));
        }
        start::check_sought(scene, &problem.system, start::Sought::Series)?;
        Ok(match start::closure(scene, problem)? {
            Closure::Autonomous => Closure::Reversible,
            other => other,
        })
    }
}

/// Displacements of a series over the scene's unit of length: beyond, the units are others.
const LARGEST: f64 = 1e6;

/// What is asked for, checked.
pub(crate) struct Request {
    problem: Problem,
    series: Vec<SeriesRecord>,
    closure: Closure,
    /// Numbers of harmonics, ascending.
    harmonics: Vec<usize>,
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Carried;

    fn files(&self) -> Files<'_> {
        let (read, force) = (vec![self.backbone.as_path()], self.output.force);
        Files { scene: &self.scene, read, force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "crosscheck"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        let scene = &work.scene;
        let problem = load::warned(scene, work.global)?;
        let series = read(self, &problem.system)?;
        let own = StoredFamily::read(&self.backbone).ok().filter(|f| !f.scene.is_empty());
        let known = own.as_ref().and_then(|f| f.identity.method.viscosity());
        let closure = self.closure(scene, &problem, &series, known)?;
        if own.is_some_and(|f| f.scene != scene.source.text) {
            work.global.caller.warn(&format!(
                "{} was made from another scene than {}; if it is another body, the verdicts mean nothing",
                self.backbone.display(),
                scene.source.file.display()
            ));
        }
        check_units(self, &problem, &series)?;
        let mut harmonics: Vec<usize> = series.iter().map(|s| s.n_h).collect();
        harmonics.sort_unstable();
        harmonics.dedup();
        Ok(Request { problem, series, closure, harmonics })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Carried, CliError> {
        let Request { problem, series, closure, harmonics } = &*plan;
        let asked = Asked {
            path: &work.path,
            scene: &work.scene,
            system: &problem.system,
            plan: family_plan(self, (&work.scene, problem), (series, *closure), harmonics),
            points: series.len(),
            unknowns: None,
            options: work.options.clone(),
        };
        family::carry_out(work.global, &asked, work.resume, |writer, known, bar| {
            let done: BTreeSet<i64> = known.points().iter().map(|p| p.index).collect();
            let left: Vec<usize> =
                (0..series.len()).filter(|k| !done.contains(&(*k as i64))).collect();
            let branch = |n_h: usize| harmonics.iter().position(|n| *n == n_h).unwrap_or(0);
            let (what, into) = ((*closure, &series[..], &left[..]), (writer, &problem.system));
            check_all((self, work.global), &work.scene, what, into, branch, bar)
        })
    }

    fn say(&self, work: &Work, _: &Request, carried: Carried) -> Result<Answer, CliError> {
        let rows: Vec<CheckRow> =
            carried.stored.points.into_iter().filter_map(|p| p.check).collect();
        let (resumed, wall) = (carried.resumed, work.wall());
        let text = || to_text(&work.scene, &rows, &work.path, wall);
        Ok(work.global.answer(|| to_json(&rows, &work.path, resumed, wall), text))
    }
}

/// Refuse series that are not in the scene's units, or of frequencies that its body has not.
fn check_units(
    arguments: &Arguments,
    problem: &Problem,
    series: &[SeriesRecord],
) -> Result<(), CliError> {
    let file = arguments.backbone.display();
    if series.is_empty() {
        return Err(CliError::Input(format!("{file} holds no points")));
    }
    let gaps = problem.system.facing().iter().map(|c| c.gap.abs());
    let unit = problem.system.body.mesh.size().into_iter().chain(gaps).fold(0.0, f64::max);
    for (k, s) in series.iter().enumerate() {
        let largest = s.coefficients.iter().fold(0.0f64, |m, c| m.max(c.abs()));
        if largest > LARGEST * unit {
            return Err(CliError::Input(format!(
                "{file}, point {k}: a displacement of {}, where lengths are of the order of {}: is it in the scene's units?",
                plain(largest),
                plain(unit)
            )));
        }
        family::check_frequency(problem, s.omega)
            .map_err(|e| CliError::Input(format!("{file}, point {k}: {}", e.text())))?;
    }
    Ok(())
}

fn family_plan(
    arguments: &Arguments,
    (scene, problem): (&Scene, &Problem),
    (series, closure): (&[SeriesRecord], Closure),
    harmonics: &[usize],
) -> FamilyPlan {
    let frequencies = || series.iter().map(|s| s.omega);
    let (low, high) =
        (frequencies().fold(f64::INFINITY, f64::min), frequencies().fold(0.0, f64::max));
    let beta = if let Closure::Viscous(pin) = closure { pin.beta.to_bits() } else { 0 };
    FamilyPlan {
        identity: FamilyKind {
            method: PointMethod::Check { quick: arguments.quick },
            walk: Walk::Given,
            problem: fingerprint(scene, problem) ^ check::fingerprint(series) ^ beta,
        },
        range: [low, high],
        branches: harmonics.iter().map(|&harmonics| Branch::Checked { harmonics }).collect(),
        harmonics: harmonics.last().copied().unwrap_or(0),
    }
}

/// The series of a file, in the coordinates of the body: of a reduced one as they stand, or its displacements of the mesh.
fn read(arguments: &Arguments, system: &System) -> Result<Vec<SeriesRecord>, CliError> {
    let (body, memory) = (&*system.body, system.n_remembered());
    let mut own = read_as(arguments, body.dofs.n_o);
    if own.is_err() && memory > 0 {
        // other programs know displacements alone
        let n = body.dofs.n_o - memory;
        own = read_as(arguments, n);
        for series in own.iter_mut().flatten() {
            let parts = series.coefficients.chunks(n);
            series.coefficients =
                parts.flat_map(|u| u.iter().copied().chain(vec![0.0; memory])).collect();
        }
    }
    let (Err(_), Some(reduction)) = (&own, body.reduction()) else { return own };
    let n_o = reduction.dofs.n_o;
    let Ok(mut of_mesh) = read_as(arguments, n_o) else { return own };
    for series in &mut of_mesh {
        let parts = series.coefficients.chunks(n_o);
        series.coefficients = parts.flat_map(|x| body.coordinates(x).into_owned()).collect();
    }
    Ok(of_mesh)
}

fn read_as(arguments: &Arguments, n_o: usize) -> Result<Vec<SeriesRecord>, CliError> {
    let path = &arguments.backbone;
    let given = [&arguments.omega, &arguments.coefficients, &arguments.alpha];
    let named = given.iter().any(|name| name.is_some());
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
        if named {
            return Err(CliError::Input(
                "--omega, --coefficients and --alpha name variables of a MATLAB file, not of CSV: leave them out"
                    .into(),
            ));
        }
        return Ok(read_csv(path, n_o)?);
    }
    let own = Names::default();
    let names = Names {
        omega: arguments.omega.clone().unwrap_or(own.omega),
        alpha: arguments.alpha.clone().unwrap_or(own.alpha),
        coefficients: arguments.coefficients.clone().unwrap_or(own.coefficients),
    };
    read_series(path, &names, n_o).map_err(|e| match e {
        StoreError::Missing { .. } if !named && is_own(path) => CliError::Input(format!(
            "{} is a file of this program, of {}: it holds no series of harmonic balance (those of `backbone` and `response` with --method hbm do)",
            path.display(),
            kind(path)
        )),
        StoreError::Missing { .. } if !named => CliError::Input(format!(
            "{e}; for a file of another program name its variables with --omega and --coefficients"
        )),
        e => e.into(),
    })
}

/// Whether this program made a file.
fn is_own(path: &Path) -> bool {
    read_origin(path).is_ok_and(|origin| !origin.version.is_empty())
}

/// What a file of this program is of.
fn kind(path: &Path) -> &'static str {
    match content(path) {
        Ok(Content::Run) => "a run",
        Ok(Content::Orbit) => "an orbit",
        Ok(Content::Family) => "a family by shooting",
        Ok(Content::Basins) => "basins",
        Ok(Content::Diagram) => "a bifurcation diagram",
        Ok(Content::PhaseResonance) => "a test of phase resonance",
        Ok(Content::Tori) => "motions of two frequencies",
        Ok(Content::Bands) => "the bands of a family",
        Ok(Content::Curves) => "curves",
        Ok(Content::Comparison) => "`compare`",
        Ok(Content::Study) => "a study",
        Ok(Content::Arrays) => "matrices for other programs",
        Err(_) => "another kind",
    }
}

/// All points that are left, side by side; each is written as soon as it is there.
fn check_all(
    (arguments, global): (&Arguments, &Global),
    scene: &Scene,
    (closure, series, left): (Closure, &[SeriesRecord], &[usize]),
    (mut writer, system): (FamilyWriter, &System),
    branch: impl Fn(usize) -> usize,
    bar: Option<&Bar>,
) -> Result<Vec<BranchEnd>, CliError> {
    let threads = rayon::current_num_threads().clamp(1, left.len().max(1));
    let (sender, receiver) = mpsc::sync_channel::<Result<(usize, PointRecord), CliError>>(64);
    let checked = std::thread::scope(|scope| -> Result<(), CliError> {
        for thread in 0..threads {
            let sender = sender.clone();
            scope.spawn(move || {
                let body = load::of_scene(scene).and_then(|p| family::propagator(p.system));
                let mut body = match body {
                    Ok(body) => body,
                    Err(e) => {
                        let _ = sender.send(Err(e));
                        return;
                    }
                };
                for &k in left.iter().skip(thread).step_by(threads) {
                    let result = check::point(&mut body, closure, &series[k], arguments.quick);
                    if sender.send(result.map(|p| (k, p)).map_err(CliError::from)).is_err()
                        || global.caller.signal().is_some()
                    {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (count, result) in receiver.iter().enumerate() {
            let (k, point) = result?;
            let (index, branch) = (k as i64, branch(series[k].n_h));
            writer.push(&PointRecord { index, branch, ..point }, system)?;
            if let Some(bar) = bar {
                let share = (count + 1) as f64 / left.len() as f64;
                bar.set(share, format!("{} of {} points", count + 1, left.len()));
            }
        }
        drop(receiver);
        Ok(())
    });
    family::conclude(global, writer, checked.map(|()| vec![]), system)
}

fn to_json(rows: &[CheckRow], path: &Path, resumed: usize, wall: f64) -> Value {
    let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let points: Vec<Value> = rows
        .iter()
        .map(|r| {
            json!({
                "omega": r.omega, "harmonics": r.n_h, "hbm_energy": r.energy, "residual": number(r.residual),
                "return_error": number(r.return_error), "verdict": r.verdict, "message": r.message, "moved": number(r.moved),
                "orbit_energy": number(r.orbit_energy), "contact_change": number(r.contact_change),
                "same_sequence": r.same_sequence,
            })
        })
        .collect();
    let summary: Vec<Value> = by_harmonics(rows)
        .into_iter()
        .map(|t| {
            json!({"harmonics": t.n_h, "points": t.points, "orbits": t.orbits, "another_orbit": t.others,
                "median_moved": number(t.median_moved), "median_residual": number(t.median_residual)})
        })
        .collect();
    json!({"points": points, "summary": summary, "resumed": resumed, "wall_s": wall, "output": path.display().to_string()})
}

fn to_text(scene: &Scene, rows: &[CheckRow], path: &Path, wall: f64) -> String {
    let title = super::title(scene);
    let mut out = format!("{title}: harmonic balance against the equations in time\n");
    let _ = writeln!(
        out,
        "  {:>9} {:>5} {:>12} {:>10} {:>10}  {:<13} {:>9} {:>12} {:>9}  sequence",
        "omega",
        "N_h",
        "energy",
        "residual",
        "return",
        "verdict",
        "moved",
        "orbit energy",
        "contact"
    );
    for r in rows {
        let _ = write!(
            out,
            "  {:>9} {:>5} {:>12} {:>10.1e} {:>10.1e}  {:<13}",
            significant(r.omega, 6),
            r.n_h,
            significant(r.energy, 7),
            r.residual,
            r.return_error,
            r.verdict.name()
        );
        let _ = match r.has_orbit() {
            true => writeln!(
                out,
                " {:>9.1e} {:>12} {:>+9.1e}  {}",
                r.moved,
                significant(r.orbit_energy, 7),
                r.contact_change,
                if r.same_sequence { "same" } else { "other" }
            ),
            false => writeln!(out),
        };
    }
    for t in by_harmonics(rows) {
        let Tally { n_h, points, orbits, others, median_moved, median_residual, .. } = t;
        let _ = writeln!(
            out,
            "  N_h = {n_h}: {orbits} of {points} points approximate an orbit (within {NEAR}, with the same switches), from {others} shooting ends in another \
             orbit, from {} in none; median distance {median_moved:.1e}, median residual in time {median_residual:.1e}",
            points - orbits - others
        );
    }
    let _ = writeln!(
        out,
        "  {wall:.1} s; written to {} (pictures: signorini plot {})",
        path.display(),
        path.display()
    );
    out
}
