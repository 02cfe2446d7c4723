//! The rows as CSV.

use std::fmt::Write as _;

use crate::records::Comparison;
use crate::report::export::{number, quoted};

/// A row a variant, mesh and frequency; what there is no number for is empty.
pub fn csv(comparison: &Comparison) -> String {
    let quantities = comparison.compared.quantities();
    let names: Vec<&str> = quantities.iter().map(|q| q.name()).collect();
    let mut out = format!("variant,changed,mesh,h,{},note\n", names.join(","));
    let finite = |x: f64| if x.is_finite() { number(x) } else { String::new() };
    for row in &comparison.rows {
        let words = [&row.variant, &row.changed, &row.mesh].map(|w| quoted(w));
        let _ = write!(out, "{},{}", words.join(","), finite(row.h));
        quantities.iter().for_each(|&q| out += &format!(",{}", finite(row.get(q))));
        let _ = writeln!(out, ",{}", quoted(&row.note));
    }
    out
}
