//! The summary of a run as a JSON object.

use serde_json::{Value, json};

use super::{energy_warning, mass_ratio, mesh_warning, warnings};
use crate::contact::System;
use crate::event::Report;
use crate::problem::Notes;
use crate::scenario::Scene;

/// With the name of a row of matrices that have names.
fn named(scene: &Scene, row: usize, mut said: Value) -> Value {
    if scene.rows.has_labels() {
        said["name"] = Value::from(scene.rows.label(row));
    }
    said
}

/// The JSON object of `run`; the keys are part of the product's public face.
pub(crate) fn run_json(
    scene: &Scene,
    (system, notes): (&System, &Notes),
    report: &Report,
    wall_s: f64,
) -> Value {
    let switches: Vec<Value> = report
        .switches
        .iter()
        .map(|s| {
            let said = json!({
                "t": s.t, "node": s.node, "point": s.point, "kind": s.kind.name(),
                "monitor": s.monitor.word(), "from": s.from().word(), "to": s.to().word(),
                "energy_jump": s.energy_jump, "monitor_rate": s.monitor_rate,
            });
            named(scene, s.node, said)
        })
        .collect();
    let grazings: Vec<Value> = report
        .grazings
        .iter()
        .map(|g| {
            let said =
                json!({"t": g.t, "node": g.node, "distance": g.distance, "kind": g.kind.name()});
            named(scene, g.node, said)
        })
        .collect();
    let places: Vec<Value> = notes
        .places
        .iter()
        .map(|p| {
            let found = &p.found[..p.wanted.len()];
            json!({"key": p.key, "place": p.wanted, "node": p.node, "at": found, "distance": p.distance})
        })
        .collect();
    let mut said = json!({
        "title": scene.title,
        "status": if report.outcome.is_complete() { "complete" } else { "failed" },
        "verdict": report.outcome.to_string(),
        "n_dof": system.n_displacements(),
        "n_o": system.n_o(),
        "n_contact": system.n_contact(),
        "t_end": report.t_end,
        "switches": switches,
        "grazings": grazings,
        "missed_switches": report.proof.missed,
        "certified": report.is_certified(),
        "uncertified_phases": report.proof.uncertified,
        "undecided_tangencies": report.proof.undecided,
        "integrator_note": report.flow_note,
        "phases": report.phases,
        "energy_start": report.energy_start,
        "energy_end": report.energy_end,
        "energy_jumps": report.energy_jumps,
        "warning": energy_warning(system, report),
        "mesh_warning": mesh_warning(system),
        "energy_external": report.energy_external,
        "energy_dissipated": report.energy_dissipated,
        "energy_drift": report.energy_drift,
        "energy_drift_total": report.energy_drift_total,
        "max_penetration": report.max_penetration,
        "max_tension": report.max_tension, "violation": report.proof.violation,
        "loosened_monitors": report.proof.loosened,
        "final": {"u": system.body.nodal_o(&report.last.u), "v": system.body.nodal_o(&report.last.v)},
        "lcp_check": report.lcp_check,
        "method": {
            "name": system.method_name(),
            "conserves_energy": system.promise().conserves_energy,
            "is_lipschitz": system.is_lipschitz(),
            "yields": system.promise().yields,
            "mass_ratio": mass_ratio(system),
        },
        "damping": system.damping.map(|d| json!({"alpha": d.alpha, "beta": d.beta})),
        "wall_s": wall_s,
    });
    let counters = &report.counters;
    for (name, count) in [
        ("rhs_evaluations", counters.rhs_evaluations),
        ("products", counters.products),
        ("rows", counters.rows),
        ("factorisations", counters.factorisations),
        ("steps", counters.steps),
        ("rejected", counters.rejected),
    ] {
        said[name] = count.into();
    }
    if let Some(rubbed) = &report.rubbed {
        let (work, path): (Vec<f64>, Vec<f64>) = rubbed.points.iter().copied().unzip();
        said["friction_work"] = json!(rubbed.work());
        said["belt_work"] = json!(rubbed.belt);
        said["friction"] = json!({"work": work, "path": path});
    }
    said["elements"] = json!({
        "springs": system.body.discrete.iter().filter(|e| e.stiffness != 0.0).count(),
        "masses": system.body.discrete.iter().filter(|e| e.mass != 0.0).count(),
        "dampers": system.dampers.as_ref().map_or(0, |d| d.rows().n_rows()),
        "sliders": system.sliders().len(),
    });
    said["warnings"] = warnings(scene, notes, report).into();
    said["places"] = places.into();
    said["certified_until"] = json!(report.proof.holds().then_some(report.t_end));
    said["state_error"] = json!(report.proof.state_error);
    said
}
