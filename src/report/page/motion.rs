//! A motion of a page: places of nodes, contact curves, energies, switches.

use serde_json::{Value, json};

use super::block::{exact, flags, rounded, single};
use super::drawn::Drawn;
use crate::report::edge::Edge;
use crate::store::{Stored, StoredForces};

/// Bytes of all stored states of one page, at most; beyond, every second, third, … state is left out.
const MOST_BYTES: usize = 9_000_000;

/// Fewest states that a motion is shown by, as far as there are so many.
const FEWEST: usize = 24;

/// Every so many states are shown, so that they fit.
fn stride(stored: &Stored, drawn: &Drawn) -> usize {
    let of_point = if stored.rubbed.is_some() { 8 } else { 4 };
    let (states, points) = (stored.t.len(), stored.gap.len());
    let bytes = states * (drawn.bytes(points) + of_point * points);
    bytes.div_ceil(MOST_BYTES).min(states / FEWEST).max(1)
}

/// The states of a motion, and what it did.
pub(super) fn motion(stored: &Stored, drawn: &Drawn, nodes: &[usize]) -> Value {
    let stride = stride(stored, drawn);
    let last = stored.t.len().saturating_sub(1);
    let rows: Vec<usize> = (0..=last).filter(|r| r % stride == 0 || *r == last).collect();
    json!({
        "stride": stride,
        "states": stored.t.len(),
        "ledger": ledger(stored),
        "forces": forces(stored),
        "switches": {
            "t": exact(stored.switch_t.iter().copied()),
            "node": stored.switch_node,
            "kind": stored.switch_kind,
            "jump": exact(stored.switch_jump.iter().copied()),
        },
        "frames": frames(stored, drawn, &rows, nodes, false),
    })
}

/// About so many states of an orbit, in few bytes.
pub(super) fn orbit(stored: &Stored, drawn: &Drawn, states: usize, nodes: &[usize]) -> Value {
    let last = stored.t.len().saturating_sub(1);
    let count = states.clamp(1, last.max(1));
    let mut rows: Vec<usize> = (0..=count).map(|k| k * last / count).collect();
    rows.dedup();
    frames(stored, drawn, &rows, nodes, true)
}

/// Displacements of nodes and contact points, pressures, tractions, active sets; `short`: to a few digits.
fn frames(stored: &Stored, drawn: &Drawn, rows: &[usize], nodes: &[usize], short: bool) -> Value {
    let n_c = stored.gap.len();
    let number = |x: Vec<f64>| -> Value { if short { rounded(&x) } else { single(x) } };
    let u: Vec<f64> = rows.iter().flat_map(|&r| drawn.displacements(stored, r)).collect();
    let bears = (!drawn.bearing.is_empty()).then(|| {
        let pressure = stored.nodal_pressure();
        let of_row = |&r: &usize| {
            let all = pressure(r);
            drawn.bearing.iter().map(|&n| all[n]).collect::<Vec<_>>()
        };
        rounded(&rows.iter().flat_map(of_row).collect::<Vec<_>>())
    });
    let along = |&r: &usize| (0..n_c).map(move |i| stored.contact_displacement(r, i));
    let contact: Vec<f64> = rows.iter().flat_map(along).collect();
    let pressure: Vec<f64> = rows.iter().flat_map(|&r| stored.pressure.row(r).to_vec()).collect();
    let traction = stored
        .rubbed
        .as_ref()
        .map(|rubbed| number(rows.iter().flat_map(|&r| rubbed.traction.row(r).to_vec()).collect()));
    let edge = Edge::of(stored);
    let is_chosen = |i: &usize| nodes.contains(&stored.contact_nodes[*i]);
    let shown: Vec<usize> = match nodes {
        [] => edge.shown(),
        _ => edge.fronts.iter().copied().filter(is_chosen).collect(),
    };
    json!({
        "t": exact(rows.iter().map(|&r| stored.t[r])),
        "shown": shown,
        "u": rounded(&u),
        "bears": bears,
        "contact": number(contact),
        "pressure": number(pressure),
        "traction": traction,
        "active": flags(rows.iter().flat_map(|&r| (0..stored.gap.len()).map(move |i| stored.touches(r, i)))),
    })
}

fn ledger(stored: &Stored) -> Value {
    let column = |k: usize| exact(stored.energy[k].iter().copied());
    let mut all = json!({
        "t": exact(stored.t.iter().copied()),
        "kinetic": column(0), "elastic": column(1), "external": column(2), "dissipated": column(3), "jumps": column(4),
    });
    if let Some(rubbed) = &stored.rubbed {
        all["friction"] = exact(rubbed.taken.iter().copied());
        all["belt"] = exact(rubbed.belt.iter().copied());
    }
    all
}

/// What contact groups, supports and springs bear: curves of each kind over the times of the ledger.
fn forces(stored: &Stored) -> Vec<Value> {
    let of_kind = |of: &StoredForces| {
        let curve = |(c, name): (usize, String)| json!({"name": name, "y": single(of.values.column(c).to_vec())});
        let curves: Vec<Value> = of.components_that_act().into_iter().map(curve).collect();
        (!curves.is_empty()).then(|| json!({"kind": of.kind, "curves": curves}))
    };
    stored.forces.iter().filter_map(of_kind).collect()
}
