//! Forced responses come to an answer.
//!
//! - *Starts*: an orbit at every frequency of a range, each from nothing known.
//! - *Grazings*: a bracket loaded in its first mode is linear until it touches, `|q₁(ω)| = 1.6 · 2ξω₁² / |ω₁² − ω² + 2iξω₁ω|` over grazing, which is one at two
//!   frequencies: there the branch grazes, with and without a reduction.
//! - *Sections*: the beam between two stops has its fold at .06948769 and its turn at .059285 (an independent prototype: mass redistribution, modes of the open body
//!   with static compliance), at any phase of the load.
//! - *Sweeps*: what a half plate settles to, on the way up and on the way down, lies on its branch.
//! - *Any scene*: random bodies, methods, loads, dampings: every frequency of a sweep has a row, every branch reaches the end of its range.

use signorini::continuation::{Go, Options};
use signorini::families::follow::{self, BranchTask};
use signorini::families::sweep::{self, Sweep};
use signorini::families::{FamilyError, Known};
use signorini::fem::{Interface, Kept};
use signorini::orbit::along::{Start, section_of};
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::section::at_origin;
use signorini::orbit::settle::ladder;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{
    AttractorKind, BranchEnd, Direction, EndReason, Grid, PointKind, PointRecord,
};
use signorini::scenario::Scene;

use super::{Case, Check, Effort, Outcome};

pub const CASE: Case = Case {
    name: "response",
    title: "forced responses: grazings, sections, sweeps, and any scene",
    source: "closed form of a linear response; an independent prototype of the beam; Newton's method from neighbours",
    only_by_name: false,
    run,
};

/// A scene of the gallery with its mesh in a folder of its own.
struct Gallery(std::path::PathBuf);

impl Gallery {
    fn new() -> Result<Gallery, String> {
        let folder =
            std::env::temp_dir().join(format!("signorini-validate-{}", std::process::id()));
        let text = |e: std::io::Error| format!("{}: {e}", folder.display());
        std::fs::create_dir_all(folder.join("meshes")).map_err(text)?;
        let meshes = [
            ("beam", include_str!("../../scenarios/meshes/beam.msh")),
            ("bracket", include_str!("../../scenarios/meshes/bracket.msh")),
        ];
        for (name, mesh) in meshes {
            std::fs::write(folder.join("meshes").join(format!("{name}.msh")), mesh)
                .map_err(text)?;
        }
        Ok(Gallery(folder))
    }

    fn scene(&self, text: &str) -> Result<Scene, String> {
        Scene::parse(text, &self.0.join("scene.toml")).map_err(|e| e.to_string())
    }
}

impl Drop for Gallery {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn body(scene: &Scene) -> Result<Propagator, String> {
    let problem = Problem::new(scene, None).map_err(|e| e.to_string())?;
    Propagator::new(problem.system).map_err(|e| e.to_string())
}

/// The branch over a range, as `signorini response` follows it.
fn branch(
    body: &mut Propagator,
    range: (f64, f64),
) -> Result<(Vec<PointRecord>, BranchEnd), String> {
    let options =
        Options { range, step: (0.01, 1e-9, 0.05), points: 2000, locate: false, natural: false };
    let known = Known::default();
    let task = BranchTask { index: 0, known: &known, options: &options, points_suffice: false };
    let start = |body: &mut Propagator| -> Result<Result<Start, String>, FamilyError> {
        Ok(ladder(body, &[], range.0)?.map(|orbit| Start::Orbit(orbit, 1.0)))
    };
    let mut points = vec![];
    let end = follow::response(body, task, start, &mut |p| {
        points.push(p);
        Go::Continue(())
    });
    Ok((points, end.map_err(|e| e.to_string())?))
}

fn at(points: &[PointRecord], is: impl Fn(&PointKind) -> bool) -> Vec<f64> {
    points.iter().filter(|p| is(&p.special)).map(|p| p.omega).collect()
}

/// The bracket under a load in its first mode, 1.6 times as large as what makes it graze.
fn bracket() -> String {
    let text = include_str!("../../scenarios/bracket.toml")
        .replace("[initial]\nmode = 1\namplitude = -1.5\n", "");
    text + "[damping]\nratio = 0.02\nmode = 1\n[[load]]\nkind = \"mode\"\nmode = 1\npeak = 1.6\nomega = 8000.0\n"
}

/// Each frequency for itself, from nothing known: the linear response, Newton's method, settling from rest.
fn starts(effort: Effort, gallery: &Gallery, checks: &mut Vec<Check>) -> Result<(), String> {
    let bar = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [20]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
               [contact]\nedge = \"right\"\ngap = 1.0\n[damping]\nratio = 0.01\nmode = 1\n\
               [[load]]\nkind = \"mode\"\nmode = 1\npeak = 1.6\nomega = 1.7\n";
    let plate = include_str!("../../scenarios/half-plate-response.toml");
    let bodies = [
        ("bar", bar.to_owned(), (1.4, 2.1), 100),
        ("half plate", plate.to_owned(), (1.2, 2.1), 100),
        ("bracket", bracket(), (7800.0, 9500.0), 20),
    ];
    for (name, text, (low, high), count) in bodies {
        let count = if effort.short { 10 } else { count };
        let mut body = body(&gallery.scene(&text)?)?;
        let mut found = 0;
        for k in 0..count {
            let omega = low + (high - low) * f64::from(k) / f64::from(count - 1);
            let orbit = ladder(&mut body, &[], omega).map_err(|e| e.to_string())?;
            found += u32::from(orbit.is_ok());
        }
        let what = format!("{name}: orbits from nothing known at {count} frequencies");
        checks.push(Check::near(what, f64::from(found), f64::from(count), 0.0));
    }
    Ok(())
}

/// The bracket grazes where its linear response says.
fn grazings(effort: Effort, gallery: &Gallery, checks: &mut Vec<Check>) -> Result<(), String> {
    let text = bracket();
    let problem = Problem::new(&gallery.scene(&text)?, None).map_err(|e| e.to_string())?;
    let system = problem.system;
    let modes = signorini::contact::phase_modes(&system, &system.open_phase(), 1);
    let first = modes.map_err(|e| e.to_string())?.omega[0];
    // (1 − s)² + 4ξ²s = (1.6 · 2ξ)², s = ω²/ω₁²
    let xi = 0.02f64;
    let (b, c) = (1.0 - 2.0 * xi * xi, 1.0 - (1.6 * 2.0 * xi).powi(2));
    let root = (b * b - c).sqrt();
    let expected = [first * (b - root).sqrt(), first * (b + root).sqrt()];
    for modes in [Some(24), Some(48), None] {
        if effort.short && modes.is_none() {
            continue;
        }
        let (name, system) = match modes {
            None => ("all displacements".into(), system.clone()),
            Some(count) => {
                let reduction = system.reduction(Interface::Free, Kept::Modes(count));
                let reduction = std::sync::Arc::new(reduction.map_err(|e| e.to_string())?);
                let reduced = system.reduced(&reduction).map_err(|e| e.to_string())?;
                (format!("{count} free-interface modes"), reduced)
            }
        };
        let mut body = Propagator::new(system).map_err(|e| e.to_string())?;
        let (points, _) = branch(&mut body, (7800.0, 9500.0))?;
        let found = at(&points, |k| matches!(k, PointKind::Grazing(_)));
        for (k, expected) in expected.into_iter().enumerate() {
            let measured = found.get(k).copied().unwrap_or(f64::NAN);
            let what = format!("bracket, {name}: grazing {} off the closed form", k + 1);
            checks.push(Check::at_most(what, (measured / expected - 1.0).abs(), 1e-9));
        }
    }
    Ok(())
}

/// Fold, turn, and end of the beam's branch do not know the phase of the load.
fn sections(effort: Effort, gallery: &Gallery, checks: &mut Vec<Check>) -> Result<(), String> {
    let phases = if effort.short { &[0.0][..] } else { &[0.0, 0.8, 1.57, 2.4][..] };
    let reduction = "[reduction]\nkind = \"free-interface\"\nmodes = 24\n";
    let (mut folds, mut counts) = (vec![], vec![]);
    for phase in phases {
        let text = include_str!("../../scenarios/beam.toml");
        let text = text.replace("omega = 0.052", &format!("omega = 0.052\nphase = {phase}"));
        let text = if effort.short { text + reduction } else { text };
        let mut body = body(&gallery.scene(&text)?)?;
        let (points, _) = branch(&mut body, (0.045, 0.070))?;
        let fold = at(&points, |k| *k == PointKind::Fold).first().copied().unwrap_or(f64::NAN);
        let turn = points.iter().rev().find(|p| match &p.special {
            PointKind::Grazing(g) => g.turns,
            kind => *kind == PointKind::Fold,
        });
        let name = |what: &str| format!("beam, phase {phase}: {what}");
        let turn = turn.map_or(f64::NAN, |p| p.omega);
        let off = |measured: f64, prototype: f64| (measured / prototype - 1.0).abs();
        let fold_off = off(fold, 0.069_487_69);
        checks.push(Check::at_most(name("fold off the prototype's"), fold_off, 3e-5));
        // known to five digits
        let turn_off = off(turn, 0.059_285);
        checks.push(Check::at_most(
            name("turn at the grazing off the prototype's"),
            turn_off,
            1e-5,
        ));
        let end = points.last().map_or(f64::NAN, |p| p.omega);
        checks.push(Check::near(name("end"), end, 0.070, 1e-12));
        let ways = points.windows(2).map(|pair| (pair[1].omega / pair[0].omega - 1.0).abs());
        let widest = ways.fold(0.0f64, f64::max);
        checks.push(Check::at_most(name("widest way between two points"), widest, 0.02));
        folds.push(fold);
        counts.push(points.len() as f64);
    }
    let spread = |x: &[f64]| {
        let (low, high) =
            x.iter().fold((f64::INFINITY, 0.0f64), |(l, h), x| (l.min(*x), h.max(*x)));
        high / low - 1.0
    };
    if !effort.short {
        checks.push(Check::at_most("beam: folds over the phases", spread(&folds), 1e-7));
        checks.push(Check::at_most("beam: points over the phases", spread(&counts), 0.2));
    }
    Ok(())
}

/// The least relative difference of the energy of a settled orbit from those that Newton's method finds at its frequency from each piece of a branch.
fn off_branch(
    body: &mut Propagator,
    branch: &[PointRecord],
    (omega, energy): (f64, f64),
) -> Result<f64, String> {
    let places: Vec<(&PointRecord, Vec<f64>)> = {
        let mut all = vec![];
        for p in branch {
            if let Some(place) = &p.place {
                body.system.loads_mut().set_frequency(p.omega);
                let z = &place.x[..2 * body.n()];
                let z = at_origin(body, z, p.omega, (section_of(place), 1));
                all.push((p, z.map_err(|e| e.to_string())?));
            }
        }
        all
    };
    let mut least = f64::INFINITY;
    for pair in places.windows(2) {
        let [(p, a), (q, b)] = pair else { continue };
        let (low, high) = (p.omega.min(q.omega), p.omega.max(q.omega));
        // a little beyond: folds lie between points
        let margin = high - low;
        if omega < low - margin || omega > high + margin {
            continue;
        }
        let s = ((omega - p.omega) / (q.omega - p.omega)).clamp(0.0, 1.0);
        let guess: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + s * (b - a)).collect();
        let verdict = find(body, Closure::FORCED, &guess, omega, &Search::default());
        if let Some(orbit) = verdict.map_err(|e| e.to_string())?.orbit() {
            least = least.min((orbit.energy / energy - 1.0).abs());
        }
    }
    Ok(least)
}

fn sweeps(effort: Effort, gallery: &Gallery, checks: &mut Vec<Check>) -> Result<(), String> {
    let text = include_str!("../../scenarios/half-plate-response.toml");
    let scene = gallery.scene(text)?;
    let range = (1.4, 1.8);
    let mut body = body(&scene)?;
    let (points, _) = branch(&mut body, range)?;
    let step = if effort.short { 0.04 } else { 0.01 };
    let (mut worst, mut count, mut others) = (0.0f64, 0, 0);
    for direction in Direction::BOTH {
        let plan = Sweep { grid: Grid { origin: range.0, step }, range, direction, dwell: None };
        let rest = vec![0.0; 2 * body.n()];
        let mut settled = vec![];
        let end = sweep::sweep(&mut body, &plan, &rest, &[], &mut |p| {
            settled.push((p.omega, p.energy(), p.attractor.map(|a| a.kind)));
            Go::Continue(())
        });
        end.map_err(|e| e.to_string())?;
        for (omega, energy, kind) in settled {
            // right behind a grazing an orbit doubles its period, and more
            if kind != Some(AttractorKind::Periodic(1)) {
                others += 1;
                continue;
            }
            worst = worst.max(off_branch(&mut body, &points, (omega, energy))?);
            count += 1;
        }
    }
    let (all, told) = (f64::from(count), "energies of settled motions off the branch");
    let what = format!("half plate: settled motions of one period ({others} others)");
    checks.push(Check::at_least(what, all, 20.0));
    checks.push(Check::at_most(format!("half plate: {told}"), worst, 1e-6));
    Ok(())
}

/// A sequence of numbers from 0 to 1 (Weyl), the same everywhere.
struct Numbers(f64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = (self.0 + 0.618_033_988_749_894_9).fract();
        self.0
    }

    fn pick<'a>(&mut self, list: &[&'a str]) -> &'a str {
        let k = (self.next() * list.len() as f64) as usize;
        list[k.min(list.len() - 1)]
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }
}

/// A forced scene, and the range of frequencies around its first mode.
fn any_scene(numbers: &mut Numbers) -> String {
    let bodies = [
        "kind = \"bar\"\nsize = [1.0]\nelements = [8]\n",
        "kind = \"plate\"\nsize = [1.0, 0.3]\nelements = [5, 2]\npoisson = 0.3\n",
        "kind = \"plate\"\nsize = [1.0, 0.6]\nelements = [4, 3]\npoisson = 0.2\n",
    ];
    let of_body = numbers.pick(&bodies);
    let methods = [
        "stress = \"projection\"\n",
        "stress = \"reaction\"\ninertia = \"constant\"\n",
        "method = \"mass-redistribution\"\n",
        "method = \"penalty\"\nstiffness = 30.0\n",
    ];
    let method = numbers.pick(&methods);
    let fix = if of_body.contains("plate") {
        "[[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n"
    } else {
        "[[support]]\nedge = \"left\"\nfix = [\"x\"]\n"
    };
    let (ratio, peak) = (numbers.within(0.002, 0.1), numbers.within(1.2, 4.0));
    let phase = 6.0 * numbers.next();
    format!(
        "[body]\nyoung = 1.0\ndensity = 1.0\n{of_body}{fix}[contact]\nedge = \"right\"\ngap = 1.0\n{method}[damping]\nratio = {ratio}\nmode = 1\n\
         [[load]]\nkind = \"mode\"\nmode = 1\npeak = {peak}\nomega = 1.6\nphase = {phase}\n"
    )
}

fn any(effort: Effort, gallery: &Gallery, checks: &mut Vec<Check>) -> Result<(), String> {
    let count = if effort.short { 6 } else { 50 };
    let mut numbers = Numbers(0.377);
    let (range, rows) = ((1.3, 2.1), 17);
    // periodic, of several periods, quasi-periodic, chaotic, slow, unbounded, lost
    let mut kinds = [0u32; 7];
    let (mut missing, mut short, mut lost) = (0, 0, 0);
    for _ in 0..count {
        let text = any_scene(&mut numbers);
        let mut body = body(&gallery.scene(&text)?).map_err(|e| format!("{text}\n{e}"))?;
        let grid = Grid { origin: range.0, step: (range.1 - range.0) / f64::from(rows - 1) };
        let plan = Sweep { grid, range, direction: Direction::Up, dwell: None };
        let rest = vec![0.0; 2 * body.n()];
        let mut seen = vec![];
        let end = sweep::sweep(&mut body, &plan, &rest, &[], &mut |p| {
            seen.push(p.attractor.map(|a| a.kind));
            Go::Continue(())
        });
        end.map_err(|e| format!("{text}\n{e}"))?;
        missing += u32::from(seen.len() < rows as usize)
            + seen.iter().filter(|k| k.is_none()).count() as u32;
        for kind in seen.into_iter().flatten() {
            kinds[match kind {
                AttractorKind::Periodic(1) => 0,
                AttractorKind::Periodic(_) => 1,
                AttractorKind::QuasiPeriodic => 2,
                AttractorKind::Chaotic => 3,
                AttractorKind::Slow | AttractorKind::Transient => 4,
                AttractorKind::Unbounded => 5,
                AttractorKind::Lost => 6,
            }] += 1;
        }
        let (points, end) = branch(&mut body, range).map_err(|e| format!("{text}\n{e}"))?;
        let covered = points.last().is_some_and(|p| p.omega > range.1 * (1.0 - 1e-12));
        short += u32::from(!covered);
        // also where it goes on behind a jump
        lost += u32::from(end.reason == EndReason::Lost || end.text.contains("lost: "));
    }
    let none = |what: &str, count: u32| {
        Check::at_most(format!("any scene: {what}"), f64::from(count), 0.0)
    };
    checks.push(none("frequencies of sweeps without a row", missing));
    checks.push(none("frequencies at which a motion could not be followed", kinds[6]));
    checks.push(none("frequencies at which a damped motion grows without bound", kinds[5]));
    checks.push(none("branches that do not reach the end of the range", short));
    checks.push(none("branches that are lost anywhere", lost));
    let names = ["periodic", "of several periods", "quasi-periodic", "chaotic", "slow"];
    let told: Vec<String> =
        names.into_iter().zip(kinds).map(|(name, count)| format!("{count} {name}")).collect();
    let (all, least) = (kinds.iter().sum::<u32>(), (count * rows) as f64);
    let what = format!("any scene: motions ({})", told.join(", "));
    checks.push(Check::at_least(what, f64::from(all), least));
    Ok(())
}

fn run(effort: Effort) -> Outcome {
    let gallery = Gallery::new()?;
    let mut checks = vec![];
    starts(effort, &gallery, &mut checks)?;
    grazings(effort, &gallery, &mut checks)?;
    sections(effort, &gallery, &mut checks)?;
    sweeps(effort, &gallery, &mut checks)?;
    any(effort, &gallery, &mut checks)?;
    Ok(checks)
}
