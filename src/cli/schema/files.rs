//! The datasets of files, as a list or as a page: a table for every group.

use serde_json::{Value, json};

use signorini::store::About;

const HEAD: &str = "\n| dataset | dimensions | unit | meaning |\n| --- | --- | --- | --- |\n";

/// The list.
pub fn of(datasets: &[&About], markdown: bool) -> String {
    if !markdown {
        let dataset = |a: &&About| json!({"path": a.path, "units": a.units, "dimensions": a.axes, "description": a.what});
        return format!("{:#}\n", datasets.iter().map(dataset).collect::<Value>());
    }
    let mut out = String::from("# Datasets of files\n");
    let mut group = "";
    for a in datasets {
        let (of, name) = a.place();
        if of != group {
            out += &format!("\n## /{of}\n{HEAD}");
            group = of;
        }
        let cell = |text: &str| text.replace('|', "\\|");
        let axes = a.axes.join(", ");
        out += &format!("| `{name}` | {axes} | {} | {} |\n", cell(a.units), cell(a.what));
    }
    out
}
