//! The datasets of files, as a list or as a page: a list for every group.

use serde_json::{Value, json};

use signorini::store::About;

use crate::cli::wrap::{item, paragraph};

/// How entries are written.
const HEAD: &str =
    "Each with its dimensions and, behind a semicolon, the unit of its values or what they number.";

/// The list.
pub fn of(datasets: &[&About], markdown: bool) -> String {
    if !markdown {
        let dataset = |a: &&About| json!({"path": a.path, "units": a.units, "dimensions": a.axes, "description": a.what});
        return format!("{:#}\n", datasets.iter().map(dataset).collect::<Value>());
    }
    let mut out = format!("# Datasets of files\n\n{}", paragraph(HEAD));
    let mut group = "";
    for a in datasets {
        let (of, name) = a.place();
        if of != group {
            out += &format!("\n## /{of}\n\n");
            group = of;
        }
        let axes = a.axes.join(" × ");
        let unit = if a.units.is_empty() { String::new() } else { format!("; {}", a.units) };
        out += &item(0, &format!("**`{name}`** ({axes}{unit}): {}", a.what));
    }
    out
}
