//! The table for people.

use std::fmt::Write as _;

use crate::records::{Compared, Comparison, Orders, Quantity, Row};
use crate::report::summary::significant;

/// What stands above a column, and how its numbers are written.
fn column(quantity: Quantity) -> (&'static str, usize) {
    match quantity {
        Quantity::Omega => ("omega", 8),
        Quantity::Unknowns => ("n", 6),
        Quantity::Error => ("error", 9),
        Quantity::Difference => ("diff", 9),
        Quantity::Penetration => ("penetr.", 9),
        Quantity::Tension => ("tension", 9),
        Quantity::Overshoot => ("p/p_ref", 8),
        Quantity::PressureError => ("F error", 8),
        Quantity::Impulse => ("impulse", 10),
        Quantity::EnergyChange => ("E change", 9),
        Quantity::EnergyDrift => ("E drift", 9),
        Quantity::Energy => ("energy", 12),
        Quantity::EnergyError => ("E/exact-1", 12),
        Quantity::Alpha => ("alpha", 10),
        Quantity::ContactTime => ("contact", 10),
        Quantity::Multiplier => ("largest µ", 10),
        Quantity::Residual => ("residual", 10),
        Quantity::Iterations => ("its", 5),
        Quantity::Switches => ("sw", 5),
        Quantity::Wall => ("time", 10),
    }
}

/// A number of a column.
fn cell(quantity: Quantity, x: f64) -> String {
    if x.is_nan() {
        return "-".into();
    }
    match quantity {
        Quantity::Unknowns | Quantity::Switches | Quantity::Iterations => format!("{x:.0}"),
        Quantity::Omega => significant(x, 5),
        Quantity::Overshoot | Quantity::PressureError => format!("{x:.3}"),
        Quantity::Impulse | Quantity::Alpha | Quantity::Multiplier => format!("{x:.4}"),
        Quantity::ContactTime => format!("{x:.6}"),
        Quantity::Energy => format!("{x:.7}"),
        Quantity::EnergyError => format!("{:+.2} %", 100.0 * x),
        Quantity::EnergyChange if x.abs() >= 1e3 => format!("{x:+.1e}"),
        Quantity::EnergyChange if x.abs() >= 1e-4 => format!("{:+.2} %", 100.0 * x),
        Quantity::Error | Quantity::Difference if x != 0.0 => format!("{x:.2e}"),
        Quantity::Wall if x < 1.0 => format!("{:.2} ms", 1e3 * x),
        Quantity::Wall => format!("{x:.2} s"),
        _ if x == 0.0 => "0".into(),
        _ => format!("{x:.1e}"),
    }
}

/// `1.05 (0.98 to 1.33)`, and what shows none.
fn orders(orders: &Orders) -> String {
    let [low, high] = orders.spread();
    let missing = match orders.missing() {
        0 => String::new(),
        n => format!("; {n} of {} show none", orders.0.len()),
    };
    match orders.0.len() - orders.missing() {
        0 => "none: differences change sign or grow".into(),
        1 => format!("{:.2}{missing}", orders.mean()),
        _ => format!("{:.2} ({low:.2} to {high:.2}){missing}", orders.mean()),
    }
}

/// The table, what it says together, the notes.
pub fn text(comparison: &Comparison) -> String {
    let mut out = format!("{}\n", comparison.title);
    let heading = match comparison.compared {
        Compared::Run => "errors against ",
        _ => "",
    };
    let with = comparison.common().map_or(String::new(), |c| format!("; with {c}"));
    let _ = writeln!(out, "  {heading}{}{with}", comparison.reference);
    if comparison.compared == Compared::Run {
        out += "  (error, diff: displacements of the nodes that do not touch, at the end; F error: contact force over time)\n";
    }
    out.push('\n');
    let name = |r: &Row| comparison.name(r);
    let width =
        comparison.rows.iter().map(|r| name(r).chars().count()).max().unwrap_or(0).max(7) + 2;
    let mesh_width = comparison.rows.iter().map(|r| r.mesh.len()).max().unwrap_or(0).max(4);
    // what no row has is not shown
    let shown: Vec<Quantity> = comparison
        .compared
        .quantities()
        .iter()
        .copied()
        .filter(|q| comparison.rows.iter().any(|r| r.values.contains_key(q)))
        .collect();
    let _ = write!(out, "  {:<width$}{:>mesh_width$}", "method", "mesh");
    for &q in &shown {
        let (head, wide) = column(q);
        let _ = write!(out, "{head:>wide$}");
    }
    out.push('\n');
    for r in &comparison.rows {
        let _ = write!(out, "  {:<width$}{:>mesh_width$}", name(r), r.mesh);
        for &q in &shown {
            // a number that is too long pushes the others, but does not run into them
            let wide = column(q).1 - 1;
            let _ = write!(out, " {:>wide$}", cell(q, r.get(q)));
        }
        out.push('\n');
    }
    together(&mut out, comparison, width);
    let mut notes: Vec<String> = vec![];
    for r in comparison.rows.iter().filter(|r| !r.note.is_empty()) {
        let of_mesh = if r.mesh.is_empty() { String::new() } else { format!(", {}", r.mesh) };
        let note = format!("{}{of_mesh}: {}", name(r), r.note);
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    if !notes.is_empty() {
        out.push('\n');
        notes.iter().for_each(|n| out += &format!("  {n}\n"));
    }
    out + &format!("\n  {}\n", comparison.footer)
}

/// Orders and limits of series on several meshes.
fn together(out: &mut String, comparison: &Comparison, width: usize) {
    let series: Vec<Vec<&Row>> = comparison.series().into_iter().filter(|s| s.len() > 1).collect();
    if series.is_empty() {
        return;
    }
    if comparison.compared == Compared::Run {
        let of = match comparison.exact {
            true => "from neighbouring meshes",
            false => "from differences of neighbouring meshes",
        };
        let mut lines = String::new();
        for s in &series {
            let found = comparison.orders_of_error(s);
            if !found.0.is_empty() {
                lines += &format!("  {:<width$}{}\n", comparison.name(s[0]), orders(&found));
            }
        }
        if !lines.is_empty() {
            *out += &format!(
                "\n  observed order of the error ({of}): mean, least and largest\n{lines}"
            );
        }
        return;
    }
    for &q in comparison.compared.limits() {
        let mut lines = String::new();
        for s in series.iter().filter(|s| s.len() > 2) {
            let limits: Vec<String> = comparison
                .limits_of(s, q)
                .into_iter()
                .map(|x| if x.is_finite() { significant(x, 5) } else { "-".into() })
                .collect();
            if limits.is_empty() {
                continue;
            }
            let omega = significant(s[0].get(Quantity::Omega), 5);
            lines += &format!(
                "  {:<width$}omega = {omega}: limits {}; order {}\n",
                comparison.name(s[0]),
                limits.join(", "),
                orders(&comparison.orders_of(s, q))
            );
        }
        if !lines.is_empty() {
            *out += &format!(
                "\n  {} under refinement (Richardson, from each three neighbouring meshes)\n{lines}",
                q.name()
            );
        }
    }
}
