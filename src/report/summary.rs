//! The summary of a run, for people and for programs.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::contact::System;
use crate::contact::lcp::PMatrix;
use crate::event::{Report, SwitchKind};
use crate::scenario::{BodyKind, Scene};

/// The JSON object of `run`; the keys are part of the product's public face.
pub fn run_json(scene: &Scene, system: &System, report: &Report, wall_s: f64) -> Value {
    let switches: Vec<Value> = report
        .switches
        .iter()
        .map(|s| {
            json!({
                "t": s.t, "node": s.node, "kind": s.kind.name(),
                "energy_jump": s.energy_jump, "monitor_rate": s.monitor_rate,
            })
        })
        .collect();
    let grazings: Vec<Value> = report
        .grazings
        .iter()
        .map(|g| json!({"t": g.t, "node": g.node, "distance": g.distance, "kind": g.kind.name()}))
        .collect();
    json!({
        "title": scene.title,
        "status": if report.outcome.is_complete() { "complete" } else { "failed" },
        "verdict": report.outcome.to_string(),
        "n_dof": system.n(),
        "n_o": system.n_o(),
        "n_contact": system.n_contact(),
        "t_end": report.t_end,
        "switches": switches,
        "grazings": grazings,
        "missed_switches": report.missed,
        "certified": report.is_certified(),
        "uncertified_phases": report.uncertified_phases,
        "undecided_tangencies": report.undecided,
        "integrator_note": report.flow_note,
        "phases": report.phases,
        "energy_start": report.energy_start,
        "energy_end": report.energy_end,
        "energy_jumps": report.energy_jumps,
        "warning": energy_warning(report),
        "energy_external": report.energy_external,
        "energy_dissipated": report.energy_dissipated,
        "energy_drift": report.energy_drift,
        "energy_drift_total": report.energy_drift_total,
        "max_penetration": report.max_penetration,
        "max_tension": report.max_tension, "violation": report.violation,
        "loosened_monitors": report.loosened,
        "final": {"u": report.last.u, "v": report.last.v},
        "rhs_evaluations": report.counters.rhs_evaluations,
        "products": report.counters.products,
        "factorisations": report.counters.factorisations,
        "steps": report.counters.steps,
        "rejected": report.counters.rejected,
        "lcp_check": report.lcp_check,
        "method": {
            "name": system.method_name(),
            "conserves_energy": system.promise().conserves_energy,
            "is_lipschitz": system.promise().is_lipschitz,
            "mass_ratio": mass_ratio(system),
        },
        "damping": system.damping.map(|d| json!({"alpha": d.alpha, "beta": d.beta})),
        "wall_s": wall_s,
    })
}

/// A number with so many significant digits, plain where that is readable.
pub fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let exponent = x.abs().log10().floor() as i32;
    if (-4..7).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        return format!("{x:.decimals$}");
    }
    format!("{x:.*e}", digits - 1)
}

/// The jumps at switches belong to the method, but a motion that they feed is not that of the body.
fn energy_warning(report: &Report) -> Option<String> {
    let brought = report.energy_start + report.energy_external.max(0.0);
    (report.energy_jumps > 0.1 * brought && report.energy_jumps > 0.0).then(|| {
        format!(
            "the jumps at switches have added {} to an energy of {}: on this mesh the method feeds the motion; refine it, \
             or damp it",
            significant(report.energy_jumps, 3),
            significant(brought, 3)
        )
    })
}

fn plural(n: usize, word: &str, plural: &str) -> String {
    format!("{n} {}", if n == 1 { word } else { plural })
}

/// What is proved of the switches, and what is not.
fn certificate(report: &Report) -> String {
    if report.is_certified() {
        return "proved complete in every phase, from bounds of the exact flow".to_owned();
    }
    let mut but = vec![];
    let on_interpolants = report.uncertified_phases == report.phases;
    if report.uncertified_phases > 0 && !on_interpolants {
        let phases = plural(report.uncertified_phases, "phase", "phases");
        but.push(format!("in {phases} on the interpolants of the steps only"));
    }
    if report.undecided > 0 {
        but.push(plural(report.undecided, "undecided tangency", "undecided tangencies"));
    }
    if report.missed > 0 {
        but.push(format!("{} that the search missed", plural(report.missed, "switch", "switches")));
    }
    if report.loosened > 0 {
        let monitors = plural(report.loosened, "monitor", "monitors");
        but.push(format!("{monitors} further below zero than rounding explains"));
    }
    match (but.is_empty(), on_interpolants) {
        (true, true) => "proved complete on the interpolant of every step".to_owned(),
        (true, false) => format!(
            "not proved complete: the contact conditions are violated by {:.1e}",
            report.violation
        ),
        (false, _) => format!("not proved complete: {}", but.join("; ")),
    }
}

/// Above this many contact points the jump of the mass is not computed for the sake of the summary.
const RATIO_LIMIT: usize = 200;

/// `μ` of the paper's mass, where it is worth its cost.
fn mass_ratio(system: &System) -> Option<f64> {
    let jumps =
        !system.promise().conserves_energy && (1..=RATIO_LIMIT).contains(&system.n_contact());
    jumps.then(|| system.mass_ratio().ok()).flatten()
}

/// What the contact method promises: its conditions, its energy.
fn promises(system: &System) -> [String; 2] {
    let promise = system.promise();
    let stress = match promise.is_strong {
        true => "gap and stress of the displacement field",
        false => "gap and nodal reaction",
    };
    let energy = match (promise.conserves_energy, promise.is_lipschitz) {
        (true, true) => "energy conserved, acceleration continuous".to_owned(),
        (true, false) => "energy conserved".to_owned(),
        _ => {
            let ratio = mass_ratio(system).map_or(String::new(), |mu| {
                let trust = match mu {
                    mu if mu < 3.5 => "tens of periods",
                    mu if mu < 10.0 => "a few periods",
                    _ => "an undamped motion gains energy within periods, inertia = \"constant\" conserves it",
                };
                format!(" (the mass jumps by μ = {}: {trust})", significant(mu, 3))
            });
            format!(
                "energy exact between switches, jumps at them{ratio}; the contact impulse is O(h) low"
            )
        }
    };
    [stress.to_owned(), energy]
}

/// The summary of a run in words.
pub fn run_text(scene: &Scene, system: &System, report: &Report, wall_s: f64) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: String| {
        let _ = writeln!(out, "  {label:<14}{text}");
    };
    let given = scene.body.kind == BodyKind::Matrices;
    let kind = match system.body.mesh.dim() {
        _ if given => "matrices".to_owned(),
        1 => format!("bar, {}", plural(scene.body.elements[0], "element", "elements")),
        _ => format!("plate, {} × {} elements", scene.body.elements[0], scene.body.elements[1]),
    };
    let follow = match system.n_contact() {
        0 => String::new(),
        n => format!(": {} move by themselves, {n} at the contact follow from them", system.n_o()),
    };
    line(
        "body",
        format!("{kind}, {}{follow}", plural(system.n(), "displacement", "displacements")),
    );
    if let Some(d) = system.damping {
        let terms = [(d.alpha, "M"), (d.beta, "K")];
        let terms = terms.iter().filter(|(c, _)| *c != 0.0);
        let terms: Vec<_> = terms.map(|(c, m)| format!("{} {m}", significant(*c, 7))).collect();
        line("damping", format!("C = {}", terms.join(" + ")));
    }
    if system.n_contact() > 0 {
        let proof = match system.conditions().p_matrix {
            PMatrix::Minors => "unique (all principal minors of N_C positive)",
            _ => "unique (N_C positive definite)",
        };
        let nodes = match given {
            true => plural(system.n_contact(), "displacement", "displacements"),
            false => plural(system.n_contact(), "node", "nodes"),
        };
        line("contact", format!("{nodes}; contact displacements {proof}"));
        let [stress, energy] = promises(system);
        line("method", format!("{}: {stress}", system.method_name()));
        line("", energy);
    }
    line("time", format!("0 to {}: {}", significant(report.t_end, 7), report.outcome));
    if system.n_contact() > 0 {
        let closings = report.switches.iter().filter(|s| s.kind == SwitchKind::Close).count();
        let mut text = format!(
            "{} ({closings} close, {} open) in {}",
            plural(report.switches.len(), "switch", "switches"),
            report.switches.len() - closings,
            plural(report.phases, "smooth phase", "smooth phases"),
        );
        if !report.grazings.is_empty() {
            let _ = write!(text, "; {}", plural(report.grazings.len(), "grazing", "grazings"));
        }
        if report.missed > 0 {
            let _ = write!(text, "; {} MISSED by the search", report.missed);
        }
        line("switches", text);
        if let (Some(a), Some(b)) = (report.switches.first(), report.switches.last()) {
            let (first, last) = (significant(a.t, 10), significant(b.t, 10));
            let place = |node: usize| match given {
                // the points of a body from matrices count from 1, its displacements from 0
                true => format!("displacement {}", node.saturating_sub(1)),
                false => format!("node {node}"),
            };
            let text = format!(
                "first at t = {first} ({}), last at t = {last} ({})",
                place(a.node),
                place(b.node)
            );
            line("", text);
        }
        line("search", certificate(report));
        line(
            "contact error",
            format!(
                "penetration ≤ {:.1e}, tension ≤ {:.1e} at every step and stored state ({:.1e} of the sizes at play)",
                report.max_penetration, report.max_tension, report.violation
            ),
        );
    }
    let (start, end) = (significant(report.energy_start, 10), significant(report.energy_end, 10));
    line("energy", format!("{start} at the start, {end} at the end (kinetic + elastic)"));
    let mut part = |x: f64, what: &str| {
        let sign = if x >= 0.0 { "+" } else { "" };
        line("", format!("{sign}{} {what}", significant(x, 7)));
    };
    if !system.loads.is_none() {
        part(report.energy_external, "by the work of the loads");
    }
    if system.damping.is_some() {
        part(-report.energy_dissipated, "by damping");
    }
    if system.n_contact() > 0 {
        part(report.energy_jumps, "by the jumps at switches (part of the method)");
    }
    line(
        "",
        format!(
            "{:.1e} relative drift inside phases, {:.1e} over the whole run (integration error)",
            report.energy_drift, report.energy_drift_total
        ),
    );
    if let Some(warning) = energy_warning(report) {
        line("WARNING", warning);
    }
    if let Some(check) = report.lcp_check {
        let enumeration = match check.enumeration {
            Some(e) => format!("{e:.1e} from enumeration, "),
            None => String::new(),
        };
        line(
            "LCP check",
            format!(
                "{} states: {enumeration}{:.1e} from the interior-point method",
                check.states, check.interior_point
            ),
        );
    }
    let c = &report.counters;
    let integrator = scene.run.as_ref().map_or("", |r| r.integrator.name());
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
    line("work", format!("{work}, {wall_s:.3} s"));
    if let Some(note) = &report.flow_note {
        line("", note.clone());
    }
    out
}
