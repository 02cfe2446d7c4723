//! The text and the JSON of a family that is computed.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use signorini::problem::changes_mass_at_switches;
use signorini::records::{
    Branch, BranchEnd, EndReason, FamilyKind, GapReason, Peak, PointKind, PointMethod, PointRecord,
    Solver, Walk, Way,
};
use signorini::report::summary::{plural, significant};
use signorini::scenario::Scene;
use signorini::store::StoredFamily;

use super::jobs::Carried;
use super::statement::{statement_json, statement_text};
use crate::cli::task::Work;
use crate::cli::viscous::{AROUND, CONSERVATIVE, MEANING};
use crate::cli::{Answer, title};

/// Handed round a period, over the energy: beyond, a viscosity is no small change of the body.
const MUCH: f64 = 0.5;

/// Special points that are listed.
const MOST: usize = 30;

/// The text or the JSON of a family.
pub fn answer(work: &Work, carried: &Carried) -> Answer {
    let (path, wall) = (&work.path, work.wall());
    let text = || to_text(&work.scene, carried, path, wall);
    work.global.answer(|| to_json(carried, path, wall), text)
}

fn to_json(carried: &Carried, path: &Path, wall: f64) -> Value {
    let Carried { stored, ends, resumed } = carried;
    // a whole number of an orbit, a mean of what is none
    let switches = |p: &PointRecord| match &p.orbit {
        Some(orbit) => json!(orbit.switches.len()),
        None => json!(p.switches()),
    };
    let point = |p: &PointRecord| {
        let o = p.orbit.as_ref();
        let mut point = json!({
            "omega": p.omega, "branch": p.branch, "special": p.special.to_string(), "converged": o.is_some(),
            "energy": p.energy(), "amplitude": p.amplitude(), "residual": o.map(|o| o.residual),
            "switches": switches(p), "stable": o.and_then(|o| o.stable), "no_orbit_near": o.is_some_and(|o| o.no_orbit_near),
            "largest_multiplier": o.and_then(|o| o.largest_multiplier()), "multipliers_within": o.and_then(|o| o.multipliers_within),
            "alpha": o.and_then(|o| o.viscous.as_ref()).map(|v| v.alpha),
            "beta": o.and_then(|o| o.viscous.as_ref()).map(|v| v.beta), "zeta": p.damping_ratio(),
            "energy_turned_over": o.and_then(|o| o.viscous.as_ref()).map(|v| v.turned_over),
        });
        if let Some(seen) = &p.attractor {
            point["sweep"] = json!({"kind": seen.kind.word(), "period_number": seen.kind.periods(), "lyapunov": seen.exponent,
                "lyapunov_error": seen.exponent_error, "amplitude": seen.amplitude(), "force": seen.force, "maps": seen.maps, "note": seen.note});
        }
        point
    };
    let stop = |e: &BranchEnd| json!({"branch": e.branch, "end": e.reason.word(), "stop": e.text, "complete": e.complete});
    let points: Vec<Value> = stored.points.iter().map(point).collect();
    let stops: Vec<Value> = ends.iter().map(stop).collect();
    let branches: Vec<String> = stored.branches.iter().map(Branch::to_string).collect();
    let mut json = json!({"points": points, "branches": branches, "stops": stops, "resumed": resumed, "wall_s": wall,
        "output": path.display().to_string()});
    if stored.outline().way == Way::Response {
        let peak = |p: &Peak| json!({"branch": p.branch, "omega": p.omega, "amplitude": p.amplitude, "energy": p.energy});
        json["ridge"] = stored.peaks().iter().map(peak).collect();
    }
    if let Some(statement) = &stored.statement {
        json["error_statement"] = statement_json(statement);
    }
    json
}

fn to_text(scene: &Scene, carried: &Carried, path: &Path, wall: f64) -> String {
    let Carried { stored, ends, resumed } = carried;
    let mut out = format!("{}\n", title(scene));
    let mut line = |label: &str, text: String| {
        let _ = writeln!(out, "  {label:<14}{text}");
    };
    line("found", found(stored, *resumed));
    match stored.outline().solver {
        _ if stored.identity.method.viscosity().is_some() => {
            line("what", MEANING.into());
            if let Some(beta) = stored.identity.method.viscosity() {
                line("viscosity", format!("beta = {}", significant(beta, 6)));
            }
        }
        _ if stored.outline().way == Way::Amplitudes => {
            line("what", DAMPED.into());
            if let Some(text) = ratios(stored) {
                line("ratio", text);
            }
        }
        Solver::Shooting if is_free(scene) => line("what", CONSERVATIVE.into()),
        _ => {}
    }
    if scene.is_around_equilibrium() {
        line("counted", AROUND.into());
    }
    for e in ends {
        let name = match ends.len() {
            1 => String::new(),
            _ => format!("{}: ", stored.branches[e.branch]),
        };
        line(if e.branch == 0 { "branches" } else { "" }, format!("{name}{}", e.text));
    }
    for (k, text) in what_next(scene, stored, ends).into_iter().enumerate() {
        line(if k == 0 { "next" } else { "" }, text);
    }
    // of a sweep a jump is what it is about
    let jumps = |p: &PointRecord| p.special == PointKind::Jump && p.attractor.is_some();
    let specials: Vec<&PointRecord> =
        stored.points.iter().filter(|p| is_on_the_way(&p.special) || jumps(p)).collect();
    for (k, p) in specials.iter().take(MOST).enumerate() {
        let energy =
            p.orbit.as_ref().map_or(String::new(), |o| format!(", energy {}", energy(o.energy)));
        let whose = match (&p.special, stored.outline().solver) {
            (PointKind::Stability(_), Solver::Viscous) => " (self-excited system)",
            _ => "",
        };
        // rows of matrices by their names
        let what = match &p.special {
            PointKind::Grazing(grazing) if scene.rows.has_labels() => {
                let told = grazing.told(|node| scene.rows.label(node));
                format!("{}: {told}", p.special.word())
            }
            other => other.to_string(),
        };
        let text = format!("omega = {:.8}{energy}: {what}{whose}", p.omega);
        line(if k == 0 { "on the way" } else { "" }, text);
    }
    if specials.len() > MOST {
        line("", format!("… and {} more; all are in the file", specials.len() - MOST));
    }
    let name_of = |branch: usize| match stored.branches.len() {
        1 => String::new(),
        _ => format!("{}: ", stored.branches[branch]),
    };
    let ranges = unstable(stored);
    for (k, (branch, first, last, count)) in ranges.iter().take(RANGES).enumerate() {
        let orbits = plural(*count, "orbit", "orbits");
        let range = match count {
            1 => format!("omega = {first:.6}"),
            _ => format!("omega = {first:.6} to {last:.6}"),
        };
        let text = format!("{}{range}, {orbits}", name_of(*branch));
        line(if k == 0 { "unstable" } else { "" }, text);
    }
    if ranges.len() > RANGES {
        line("", format!("… and {} more ranges", ranges.len() - RANGES));
    }
    for (k, p) in stored.peaks().iter().enumerate() {
        let name = name_of(p.branch);
        let text = format!(
            "{name}amplitude {:.6} at omega = {:.6}, energy {}",
            p.amplitude,
            p.omega,
            energy(p.energy)
        );
        line(if k == 0 { "peaks" } else { "" }, text);
    }
    let is_viscous = stored.outline().solver == Solver::Viscous;
    if is_viscous || stored.statement.is_some() {
        for (k, text) in errors(stored).into_iter().enumerate() {
            line(if k == 0 { "errors" } else { "" }, text);
        }
    }
    line("time", format!("{wall:.1} s"));
    let path = path.display();
    line("written to", format!("{path} (pictures: signorini plot {path})"));
    out
}

/// What may lead on where branches ended before they were done.
fn what_next(scene: &Scene, stored: &StoredFamily, ends: &[BranchEnd]) -> Vec<String> {
    let ended = |reason| ends.iter().any(|e| e.reason == reason && !e.complete);
    let is_response = stored.outline().way == Way::Response;
    let mut all = vec![];
    if ended(EndReason::Points) {
        all.push("more points with --points, or longer steps with --step".to_owned());
    }
    if ended(EndReason::Lost) {
        let elsewhere = if is_response { "another --range" } else { "another start with --omega" };
        all.push(format!("shorter steps with --step, or {elsewhere}"));
        if changes_mass_at_switches(scene) {
            all.push("contact.method = \"mass-redistribution\": with the paper's mass every node that begins to touch is a corner of the branch".to_owned());
        }
        if is_response {
            all.push(
                "--sweep both: what the body settles to covers the range whatever a branch does"
                    .to_owned(),
            );
        } else if stored.outline().solver == Solver::Shooting && is_free(scene) {
            all.push("--viscous: families of the undamped discrete body have corners and ends that are the mesh's".to_owned());
        }
    }
    all
}

/// How far the energies of a family may be off.
fn errors(stored: &StoredFamily) -> Vec<String> {
    let share = |p: &PointRecord| {
        let orbit = p.orbit.as_ref()?;
        Some(orbit.viscous.as_ref()?.turned_over / orbit.energy)
    };
    let shares = || stored.points.iter().filter_map(share);
    let mut lines = match &stored.statement {
        Some(statement) => statement_text(statement),
        None => {
            vec!["left out (--quick): nothing is said of viscosity, mesh, contact and modes".into()]
        }
    };
    if let (Some(low), Some(high)) = (shares().reduce(f64::min), shares().reduce(f64::max)) {
        lines.push(format!(
            "handed round a period by viscosity and feedback: {:.0} to {:.0} % of the energy",
            100.0 * low,
            100.0 * high
        ));
        let count = shares().filter(|s| *s > MUCH).count();
        if count > 0 {
            lines.push(format!(
                "WARNING: more than {:.0} % at {count} of {} points: that is no little viscosity, and these orbits say little about the conservative ones; a smaller beta needs a finer mesh",
                100.0 * MUCH,
                shares().count()
            ));
        }
    }
    lines
}

/// Whether motions of a scene conserve their energy.
fn is_free(scene: &Scene) -> bool {
    scene.damping.is_none()
        && scene.dampers.is_empty()
        && scene.loads.iter().all(|l| l.omega.is_none())
}

/// Whether a point is listed: not those that every family has, nor those that are counted.
fn is_on_the_way(kind: &PointKind) -> bool {
    use PointKind::{EndOfRange, Gap, Jump, Regular, Start};
    let none_near = matches!(kind, Gap(GapReason::NoneNear { .. }));
    none_near || !matches!(kind, Regular | Start | EndOfRange | Jump | Gap(_))
}

/// So many unstable ranges are told.
const RANGES: usize = 6;

/// Where branches are unstable: the branch, its first and its last frequency in the order of the branch, and the number of orbits. What is not known ends no range.
fn unstable(stored: &StoredFamily) -> Vec<(usize, f64, f64, usize)> {
    let mut ranges: Vec<(usize, f64, f64, usize)> = vec![];
    let mut is_open = false;
    let mut points: Vec<&PointRecord> = stored.points.iter().collect();
    points.sort_by_key(|p| (p.branch, p.index));
    for p in points {
        let known = p.orbit.as_ref().filter(|o| o.viscous.is_none()).and_then(|o| o.stable);
        match (known, ranges.last_mut()) {
            (Some(false), Some(range)) if is_open && range.0 == p.branch => {
                (range.2, range.3) = (p.omega, range.3 + 1);
            }
            (Some(false), _) => {
                ranges.push((p.branch, p.omega, p.omega, 1));
                is_open = true;
            }
            (Some(true), _) => is_open = false,
            (None, _) => {}
        }
    }
    ranges
}

/// How many orbits there are, and of what stability.
fn found(stored: &StoredFamily, resumed: usize) -> String {
    let orbits = || stored.points.iter().filter_map(|p| p.orbit.as_ref());
    let stable = match orbits().any(|o| o.stable.is_some() && o.viscous.is_none()) {
        true => {
            let count = orbits().filter(|o| o.stable == Some(true)).count();
            format!(", {count} of them stable")
        }
        false => String::new(),
    };
    let before = match resumed {
        0 => String::new(),
        n => format!(" ({n} points of an earlier run)"),
    };
    let what = if stored.outline().way == Way::Sweep { settled(stored) } else { on_a_grid(stored) };
    let all = orbits().count();
    match orbits().filter(|o| o.no_orbit_near).count() {
        0 => format!("{all} orbits{stable}{what}{before}"),
        none => {
            let along = orbits().filter(|o| o.multipliers_within.is_some()).count();
            let led = all - none;
            format!(
                "{all} series: {led} lead to an orbit{stable}; {none} have none near (multipliers along the series at {along}){what}{before}"
            )
        }
    }
}

/// What a body settled to in a sweep: how often to what.
fn settled(stored: &StoredFamily) -> String {
    let mut kinds: Vec<(String, usize)> = vec![];
    for seen in stored.points.iter().filter_map(|p| p.attractor.as_ref()) {
        let name = seen.kind.to_string();
        match kinds.iter_mut().find(|(kind, _)| *kind == name) {
            Some((_, count)) => *count += 1,
            None => kinds.push((name, 1)),
        }
    }
    let each: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind}: {count}")).collect();
    format!("; {}", each.join(", "))
}

/// What a damped nonlinear mode is.
const DAMPED: &str = "damped nonlinear mode: kept going by -alpha M, which makes good what friction and damping take; zeta = alpha/2 omega";

/// Damping ratios at the lowest amplitude and at the highest, and the largest.
fn ratios(stored: &StoredFamily) -> Option<String> {
    let of = |p: &PointRecord| Some((stored.identity.walk.amplitude(p.index)?, p.damping_ratio()?));
    let all: Vec<(f64, f64)> = stored.points.iter().filter_map(of).collect();
    let (first, last) = (all.first()?, all.last()?);
    let largest = all.iter().fold(first, |m, p| if p.1 > m.1 { p } else { m });
    let text = |(x, z): &(f64, f64)| format!("{} at {}", significant(*z, 4), significant(*x, 4));
    Some(format!("{}, {}, at the most {}", text(first), text(last), text(largest)))
}

/// What a grid of frequencies left open, and what to do about it.
fn on_a_grid(stored: &StoredFamily) -> String {
    let near = stored
        .points
        .iter()
        .filter(|p| matches!(p.special, PointKind::Gap(GapReason::NoneNear { .. })));
    let FamilyKind { method, walk, .. } = stored.identity;
    if method == PointMethod::Shooting && walk == Walk::Given {
        return format!(" near viscous ones, none near {} others", near.count());
    }
    let gaps = stored.points.iter().filter(|p| p.special.is_gap()).count();
    let jumps = stored.points.iter().filter(|p| p.special == PointKind::Jump).count();
    let outline = stored.outline();
    if outline.way != Way::Sequential || gaps + jumps == 0 {
        return String::new();
    }
    let hint = match outline.solver {
        Solver::Shooting | Solver::Viscous => {
            "; the step is too wide, or the branch folds back there, or another crosses it: a smaller --step, or --follow arclength, tells"
        }
        _ => "; more harmonics, or --follow arclength, may close them",
    };
    format!(", {gaps} frequencies without one, {jumps} jumps to another branch{hint}")
}

/// Six decimals, or as many digits where they would show nothing.
fn energy(x: f64) -> String {
    if x == 0.0 || x.abs() >= 1e-3 { format!("{x:.6}") } else { significant(x, 7) }
}
