//! The summary of a run in words, a paragraph for each thing that there is to say.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::Value;

use super::promises::{certificate, promises};
use super::{energy_warning, mass_ratio, plural, significant};
use crate::contact::lcp::PMatrix;
use crate::contact::{March, Rayleigh, System};
use crate::event::{Report, SwitchKind};
use crate::fem::{Facing, Interface};
use crate::mesh::ElementKind;
use crate::problem::Notes;
use crate::scenario::{BodyKind, Scene, State};

/// The summary of a run in words, and what its object says of it.
pub(crate) fn run_text(
    scene: &Scene,
    (system, notes): (&System, &Notes),
    (report, said): (&Report, &Value),
    wall_s: f64,
) -> String {
    let given = scene.body.kind == BodyKind::Matrices;
    let mut out = Lines::default();
    body(&mut out, scene, system, given);
    if let Some(stiff) = said["mesh_warning"].as_str() {
        out.line("WARNING", stiff.to_owned());
    }
    damping(&mut out, system);
    places(&mut out, notes);
    if system.n_contact() > 0 {
        contact(&mut out, system, given);
        on_mesh(&mut out, scene, system);
    }
    elements(&mut out, system);
    out.line("time", format!("0 to {}: {}", significant(report.t_end, 7), report.outcome));
    if system.n_contact() > 0 {
        let yields = system.promise().yields;
        switches(&mut out, report, (scene, yields));
        search(&mut out, system, report);
    }
    energy(&mut out, system, report);
    let warnings = said["warnings"].as_array().map_or(&[][..], Vec::as_slice);
    warnings.iter().filter_map(Value::as_str).for_each(|w| out.line("warning", w.to_owned()));
    lcp_check(&mut out, report);
    work(&mut out, (scene, system), report, wall_s);
    seen(&mut out, (scene, system), said);
    out.0
}

/// What is told of a motion that a file keeps, in words: forces, the largest pressure, what probes saw.
pub(crate) fn seen_text(scene: &Scene, system: &System, said: &Value) -> String {
    let mut out = Lines::default();
    seen(&mut out, (scene, system), said);
    out.0
}

fn seen(out: &mut Lines, (scene, system): (&Scene, &System), said: &Value) {
    forces(out, &said["forces"]);
    let place = |node| place_of(scene, system.promise().yields, node);
    pressure(out, &said["largest_pressure"], place);
    probes(out, &said["probes"]);
}

/// Labelled lines.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, label: &str, text: String) {
        let _ = writeln!(self.0, "  {label:<14}{text}");
    }
}

/// What was discretised, and how far it moves by itself; `given`: by matrices.
fn body(out: &mut Lines, scene: &Scene, system: &System, given: bool) {
    let kind = match system.body.mesh.dim() {
        _ if given => "matrices".to_owned(),
        _ if scene.body.kind.has_groups() => mesh(scene, system),
        1 => format!("bar, {}", plural(scene.body.elements[0], "element", "elements")),
        _ => format!("plate, {} × {} elements", scene.body.elements[0], scene.body.elements[1]),
    };
    let follow = match system.facing().len() {
        0 => String::new(),
        _ if system.contact_has_inertia() => String::new(),
        _ => {
            let (n, moving) = (system.body.dofs.n_c, system.n_o() - system.n_remembered());
            format!(": {moving} move by themselves, {n} at the contact follow from them")
        }
    };
    let unknowns = match system.body.reduction() {
        None => plural(system.n_displacements(), "displacement", "displacements"),
        Some(_) => plural(system.n_displacements(), "coordinate", "coordinates"),
    };
    out.line("body", format!("{kind}, {unknowns}{follow}"));
    if let Some(reduction) = system.body.reduction() {
        let next = reduction
            .cutoff
            .map_or(String::new(), |w| format!(", all below omega = {}", significant(w, 4)));
        let text = format!(
            "in place of {} displacements of the mesh: {} modes of {}{next}; u_C is not reduced",
            reduction.dofs.n(),
            reduction.modes,
            match reduction.interface {
                Interface::Fixed => "the body whose interface is held",
                Interface::Free => "the open body, with the statics of contact and loads",
            }
        );
        out.line("reduction", text);
    }
}

/// How many elements of which kind, and their state.
fn mesh(scene: &Scene, system: &System) -> String {
    let mut counts: BTreeMap<ElementKind, usize> = BTreeMap::new();
    system.body.mesh.elements().for_each(|e| *counts.entry(e.kind).or_default() += 1);
    let counts: Vec<String> = counts.iter().map(|(k, n)| format!("{n} × {}", k.name())).collect();
    let state = match scene.body.state {
        Some(State::PlaneStrain) => "plane strain",
        Some(State::Axisymmetric) => "axisymmetric",
        Some(State::PlaneStress) => "plane stress",
        None => "in space",
    };
    let state = if system.body.mesh.dim() == 1 { "along x" } else { state };
    let bodies = match scene.parts.len() {
        0 => String::new(),
        n => format!("{}, ", plural(n, "body", "bodies")),
    };
    format!("{bodies}mesh of {}, {state}", counts.join(", "))
}

fn damping(out: &mut Lines, system: &System) {
    let d = system.damping.unwrap_or(Rayleigh { alpha: 0.0, beta: 0.0 });
    let terms = [(d.alpha, "M"), (d.beta, "K")];
    let terms = terms.iter().filter(|(c, _)| *c != 0.0);
    let mut terms: Vec<_> = terms.map(|(c, m)| format!("{} {m}", significant(*c, 7))).collect();
    if let Some(dampers) = &system.dampers {
        let rows = plural(dampers.rows().n_rows(), "damper or mode", "dampers and modes");
        terms.push(format!("sum of {rows}"));
    }
    if !terms.is_empty() {
        out.line("damping", format!("C = {}", terms.join(" + ")));
    }
}

/// Springs, masses, dampers and sliders at nodes.
fn elements(out: &mut Lines, system: &System) {
    let discrete = &system.body.discrete;
    let springs = discrete.iter().filter(|e| e.stiffness != 0.0).count();
    let masses = discrete.iter().filter(|e| e.mass != 0.0).count();
    let kinds = [(springs, "spring", "springs"), (masses, "mass", "masses")];
    let some = kinds.into_iter().filter(|k| k.0 > 0).map(|(n, one, many)| plural(n, one, many));
    let all: Vec<String> = some.collect();
    if !all.is_empty() {
        out.line("elements", format!("{} at nodes", all.join(", ")));
    }
}

/// Which nodes places in the scene name.
fn places(out: &mut Lines, notes: &Notes) {
    for p in &notes.places {
        let place = |x: &[f64]| {
            let x: Vec<String> = x.iter().map(|x| significant(*x, 7)).collect();
            format!("({})", x.join(", "))
        };
        let found = place(&p.found[..p.wanted.len()]);
        let away = match p.distance {
            0.0 => format!("there at {found}"),
            d => format!("nearest to {}: at {found}, {} away", place(&p.wanted), significant(d, 3)),
        };
        out.line("place", format!("{}: node {}, {away}", p.key, p.node));
    }
}

/// The contact problem, and the method with its promises.
fn contact(out: &mut Lines, system: &System, given: bool) {
    let proof = match system.conditions().p_matrix {
        PMatrix::HMatrix => "unique (N_C is an H-matrix)",
        PMatrix::Minors => "unique (all principal minors of N_C positive)",
        _ => "unique (N_C positive definite)",
    };
    let yields = system.promise().yields;
    let (one, many) = match given {
        true => ("displacement", "displacements"),
        false if yields => ("point", "points"),
        false => ("node", "nodes"),
    };
    let count = system.conditions().facing();
    let between = match system.facing().len() - count {
        0 => String::new(),
        n if n == count => " between two obstacles".to_owned(),
        n => format!(", {n} of them between two obstacles"),
    };
    let nodes = format!("{}{between}", plural(count, one, many));
    let sliders = plural(system.sliders().len(), "slider", "sliders");
    if count == 0 {
        out.line("friction", format!("{sliders}; energy exact but for what they take"));
        return;
    }
    if system.contact_has_inertia() {
        out.line("contact", nodes);
        let [stress, energy] = promises(system);
        out.line("method", format!("{}: {stress}", system.method_name()));
        out.line("", energy);
        return;
    }
    out.line("contact", format!("{nodes}; contact displacements {proof}"));
    let [stress, energy] = promises(system);
    out.line("method", format!("{}: {stress}", system.method_name()));
    out.line("", energy);
}

/// What tells whether stress and mass suit a mesh.
fn on_mesh(out: &mut Lines, scene: &Scene, system: &System) {
    if !scene.body.kind.has_groups() || system.contact_has_inertia() {
        return;
    }
    let dofs = system.body.nodal_dofs();
    let of_group = |(k, f): (usize, &Facing)| {
        let nodes = system.body.mesh.group_nodes(&f.group);
        nodes.into_iter().filter(|&n| dofs.contact_at(k, n).is_none()).count()
    };
    let held: usize = dofs.facing.iter().enumerate().map(of_group).sum();
    if held > 0 {
        let nodes = plural(held, "node", "nodes");
        out.line(
            "",
            format!("{nodes} of the contact groups left out: supports hold them along the normal"),
        );
    }
    let follow = significant(system.amplification(), 3);
    let ratio =
        mass_ratio(system).map_or(String::new(), |mu| format!("; μ = {}", significant(mu, 3)));
    out.line(
        "",
        format!("open contact nodes move by at most {follow} times the largest u_O{ratio}"),
    );
    let locks = |nu: &f64| *nu >= 0.45 && scene.body.state != Some(State::PlaneStress);
    if let Some(nu) = scene.materials.iter().map(|m| m.poisson).find(locks) {
        let jumps = match system.promise().conserves_energy {
            true => "",
            false => ", and energies at switches jump by more",
        };
        let text =
            format!("ν = {nu}: elements lock where a material hardly changes its volume{jumps}");
        out.line("warning", text);
    }
}

/// How many switches of each kind there were, in brackets.
pub fn kinds_of_switches(count: impl Fn(SwitchKind) -> usize) -> String {
    let (impacts, rests) = (count(SwitchKind::Impact), count(SwitchKind::Rest));
    let mut text = format!("({} close, {} open", count(SwitchKind::Close), count(SwitchKind::Open));
    if impacts + rests > 0 {
        let accumulations = plural(rests, "accumulation", "accumulations");
        let _ = write!(text, ", {}, {accumulations}", plural(impacts, "rebound", "rebounds"));
    }
    let (stops, slips) = (count(SwitchKind::Sticking), count(SwitchKind::Slipping));
    if stops + slips > 0 {
        let _ = write!(text, ", {stops} sticking, {slips} slipping");
    }
    text + ")"
}

/// How many switches there were, the first and the last.
fn switches(out: &mut Lines, report: &Report, (scene, yields): (&Scene, bool)) {
    let log = &report.log;
    let mut text = format!(
        "{} {} in {}",
        plural(log.switches(), "switch", "switches"),
        kinds_of_switches(|kind| log.of_kind(kind)),
        plural(report.phases, "smooth phase", "smooth phases")
    );
    if log.grazings() > 0 {
        let _ = write!(text, "; {}", plural(log.grazings(), "grazing", "grazings"));
    }
    if report.proof.missed > 0 {
        let _ = write!(text, "; {} MISSED by the search", report.proof.missed);
    }
    out.line("switches", text);
    if let Some([a, b]) = log.ends() {
        let (first, last) = (significant(a.t, 10), significant(b.t, 10));
        let place = |node: usize| place_of(scene, yields, node);
        let text = format!(
            "first at t = {first} ({}), last at t = {last} ({})",
            place(a.node),
            place(b.node)
        );
        out.line("", text);
    }
}

/// Whether all switches were found, and how well the contact conditions hold.
fn search(out: &mut Lines, system: &System, report: &Report) {
    let yields = system.promise().yields;
    match is_stepped(system) {
        true => out.line("search", "none: a point is pushed over whole steps".into()),
        false => out.line("search", certificate(report)),
    }
    if yields {
        let deepest = significant(report.max_penetration, 4);
        let text =
            format!("{deepest}, the deepest at steps and stored states (the obstacle yields)");
        out.line("penetration", text);
    }
    let gap = if yields { "gap error" } else { "penetration" };
    out.line(
        "contact error",
        format!(
            "{gap} ≤ {:.1e}, tension ≤ {:.1e} at every step and stored state ({:.1e} of the sizes at play)",
            report.gap_error, report.max_tension, report.proof.violation
        ),
    );
}

/// The ledger of energy.
fn energy(out: &mut Lines, system: &System, report: &Report) {
    let (start, end) = (significant(report.energy_start, 10), significant(report.energy_end, 10));
    out.line("energy", format!("{start} at the start, {end} at the end (kinetic + elastic)"));
    let mut part = |x: f64, what: &str| {
        let sign = if x >= 0.0 { "+" } else { "" };
        out.line("", format!("{sign}{} {what}", significant(x, 7)));
    };
    if !system.loads.is_none() {
        let what = match system.loads.carried.is_empty() {
            true => "by the work of the loads",
            false => "by the work of the loads, and of the supports and obstacles that move",
        };
        part(report.energy_external, what);
    }
    if system.is_damped() {
        part(-report.energy_dissipated, "by damping");
    } else if !system.has_potential() && report.rubbed.is_none() {
        part(-report.energy_dissipated, "by forces without a potential (part of the method)");
    }
    if let Some(rubbed) = &report.rubbed {
        part(-rubbed.work(), "by friction");
        if system.tangents().into_iter().flatten().flatten().any(|t| t.surface != 0.0) {
            part(rubbed.belt, "by the surface that moves");
        }
    }
    if system.n_contact() > 0 && !system.promise().yields && report.rubbed.is_none() {
        part(report.energy_jumps, "by the jumps at switches (part of the method)");
    }
    out.line(
        "",
        format!(
            "{:.1e} relative drift inside phases, {:.1e} over the whole run (integration error)",
            report.energy_drift, report.energy_drift_total
        ),
    );
    if let Some(warning) = energy_warning(system, report) {
        out.line("WARNING", warning);
    }
}

/// How far the contact solutions are from those of other methods.
fn lcp_check(out: &mut Lines, report: &Report) {
    let Some(check) = report.lcp_check else { return };
    let enumeration = match check.enumeration {
        Some(e) => format!("{e:.1e} from enumeration, "),
        None => String::new(),
    };
    out.line(
        "LCP check",
        format!(
            "{} states: {enumeration}{:.1e} from the interior-point method",
            check.states, check.interior_point
        ),
    );
}

/// What the integrator did, and how long it took.
/// By the scheme of Moreau and Jean.
fn is_stepped(system: &System) -> bool {
    system.impact().is_some_and(|law| matches!(law.march, Some(March::Steps(_))))
}

fn work(out: &mut Lines, (scene, system): (&Scene, &System), report: &Report, wall_s: f64) {
    let c = &report.counters;
    let integrator = match system.impact().and_then(|law| law.march) {
        Some(March::Steps(_)) => "moreau-jean",
        Some(March::Waves(_)) => "waves",
        None => scene.run.as_ref().map_or("", |r| match r.quasistatic {
            true => "quasi-static",
            false => r.integrator.name(),
        }),
    };
    let rejected =
        if c.rejected > 0 { format!(" (+{} rejected)", c.rejected) } else { String::new() };
    let mut work = format!("{integrator}: {}{rejected}", plural(c.steps as usize, "step", "steps"));
    for (count, one, many) in [
        (c.rhs_evaluations, "right-hand side", "right-hand sides"),
        (c.products, "product", "products"),
        (c.factorisations, "eigensolution", "eigensolutions"),
    ] {
        if count > 0 {
            let _ = write!(work, ", {}", plural(count as usize, one, many));
        }
    }
    out.line("work", format!("{work}, {wall_s:.3} s"));
    if let Some(note) = &report.flow_note {
        out.line("", note.clone());
    }
}

/// Share of an impulse that is told.
const KNOWN: f64 = 0.01;

/// The largest forces of contact groups, supports and springs, with their impulses.
fn forces(out: &mut Lines, all: &Value) {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let all = all.as_array().map_or(&[][..], Vec::as_slice);
    let mut before = "";
    for of in all.iter().filter(|of| number(&of["maximum"]) > 0.0) {
        let kind = of["kind"].as_str().unwrap_or_default();
        let head = match kind {
            _ if kind == before => "",
            "contact" => "force",
            other => other,
        };
        before = kind;
        let impulse = of["impulse"].as_array().map_or(&[][..], Vec::as_slice);
        let size = impulse.iter().fold(0.0f64, |m, x| m.hypot(number(x)));
        // as far as stored states tell
        let error = of["impulse_error"].as_f64().unwrap_or(0.0);
        let told = match error > KNOWN * size && size > 0.0 {
            true => format!(
                " to some {} % (the states that are stored are few for it: raise run.samples)",
                significant(100.0 * error / size, 1)
            ),
            false => String::new(),
        };
        let text = format!(
            "\"{}\": at most {} (at t = {}), impulse {}{told}",
            of["group"].as_str().unwrap_or_default(),
            significant(number(&of["maximum"]), 6),
            significant(number(&of["t"]), 6),
            significant(size, 6)
        );
        out.line(head, text);
    }
}

/// A contact point, as messages name it: a displacement of matrices, a point where points are no nodes, a node.
fn place_of(scene: &Scene, yields: bool, node: usize) -> String {
    match scene.body.kind {
        BodyKind::Matrices => format!("displacement {}", scene.rows.label(node)),
        _ if yields => format!("point {node}"),
        _ => format!("node {node}"),
    }
}

/// The largest pressure, where and when.
fn pressure(out: &mut Lines, of: &Value, place: impl Fn(usize) -> String) {
    let (Some(largest), Some(t)) = (of["largest"].as_f64(), of["t"].as_f64()) else { return };
    let head = if of["is_force"] == true { "at a node" } else { "pressure" };
    let (largest, t) = (significant(largest, 6), significant(t, 6));
    let place = place(of["node"].as_u64().unwrap_or(0) as usize);
    out.line(head, format!("at most {largest} at {place} (at t = {t}, of the stored states)"));
}

/// The largest of what probes saw, by quantity.
fn probes(out: &mut Lines, all: &Value) {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let mut head = "probe";
    for of in list(all) {
        let (largest, t, names) = (list(&of["largest"]), list(&of["t"]), list(&of["components"]));
        let most = (0..largest.len())
            .max_by(|&a, &b| number(&largest[a]).abs().total_cmp(&number(&largest[b]).abs()));
        let Some(most) = most else { continue };
        let text = format!(
            "\"{}\": {} {} reaches {} (at t = {})",
            of["name"].as_str().unwrap_or_default(),
            of["quantity"].as_str().unwrap_or_default(),
            names[most].as_str().unwrap_or_default(),
            significant(number(&largest[most]), 6),
            significant(number(&t[most]), 6)
        );
        out.line(head, text);
        head = "";
    }
}
