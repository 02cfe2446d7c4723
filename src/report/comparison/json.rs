//! The rows, orders and limits as JSON.

use serde_json::{Map, Value, json};

use crate::records::{Compared, Comparison, Orders, Quantity, Row};

/// A number, or null.
fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn orders(orders: &Orders) -> Value {
    let spread = orders.spread().map(finite);
    json!({"each": orders.0.iter().copied().map(finite).collect::<Vec<_>>(), "mean": finite(orders.mean()), "spread": spread})
}

/// Everything that there is to say of a comparison.
pub fn json(comparison: &Comparison) -> Value {
    let row = |r: &Row| {
        let mut row = Map::new();
        for (key, word) in [("variant", &r.variant), ("changed", &r.changed), ("mesh", &r.mesh)] {
            row.insert(key.into(), json!(word));
        }
        row.insert("h".into(), finite(r.h));
        for &q in comparison.compared.quantities() {
            row.insert(q.name().into(), finite(r.get(q)));
        }
        if !r.note.is_empty() {
            row.insert("note".into(), json!(r.note));
        }
        Value::Object(row)
    };
    let series = |s: &Vec<&Row>| {
        let mut entry = Map::new();
        entry.insert("variant".into(), json!(s[0].variant));
        entry.insert("changed".into(), json!(s[0].changed));
        match comparison.compared {
            Compared::Run => {
                entry.insert("order".into(), orders(&comparison.orders_of_error(s)));
            }
            _ => {
                entry.insert("omega".into(), finite(s[0].get(Quantity::Omega)));
            }
        }
        for &q in comparison.compared.limits() {
            let limits: Vec<Value> = comparison.limits_of(s, q).into_iter().map(finite).collect();
            let found = json!({"limits": limits, "order": orders(&comparison.orders_of(s, q))});
            entry.insert(q.name().into(), found);
        }
        Value::Object(entry)
    };
    json!({
        "compared": comparison.compared.name(), "title": comparison.title, "reference": comparison.reference, "exact": comparison.exact,
        "rows": comparison.rows.iter().map(row).collect::<Vec<_>>(),
        "series": comparison.series().iter().map(series).collect::<Vec<_>>(),
    })
}
