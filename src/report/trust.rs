//! How far a mesh may be trusted, in words and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json as object};

use super::summary::significant;
use crate::records::{Beside, Figure, Replaced, Trust};

/// Below this an error is small for an engineer.
const SMALL: f64 = 0.02;

/// A share in percent, with its sign.
fn percent(share: f64) -> String {
    let size = 100.0 * share.abs();
    match size {
        _ if size < 1e-7 => "0 %".to_owned(),
        _ if size >= 9.95 => format!("{:+.0} %", 100.0 * share),
        _ if size >= 0.0995 => format!("{:+.2} %", 100.0 * share),
        _ => format!("{:+.0e} %", 100.0 * share),
    }
}

/// The same of a size.
fn up_to(share: f64) -> String {
    percent(share.abs()).trim_start_matches('+').to_owned()
}

/// A value: numbers of things are whole.
fn value(f: &Figure, x: f64) -> String {
    match f.kind == "switches" && f.name.starts_with("number") {
        true => format!("{x}"),
        false => significant(x, 6),
    }
}

/// What the difference from a body beside means.
fn meaning(beside: &Beside) -> &'static str {
    match beside.replaced {
        Replaced::Raised => {
            "the difference is the error of this mesh, to about a fifth (measured: .88 to 1 of it in frequencies and displacements, .8 to 1.1 in forces)"
        }
        Replaced::Halved => {
            "the error of this mesh is 1 to 2 times the difference: 4/3 where errors fall with the square of the size, 2 where they fall with the size (corners, edges of the contact)"
        }
        Replaced::OtherContact => {
            "the same mesh: what the treatment of the contact decides, and not the elements"
        }
    }
}

/// Which of the two bodies switches nowhere, where the other does.
fn never_touches(trust: &Trust, k: usize) -> Option<&'static str> {
    let is_count = |f: &&Figure| f.kind == "switches" && f.name == "number";
    let figure = trust.figures.iter().find(is_count)?;
    match (figure.value, figure.beside.get(k).copied().flatten()?) {
        (own, 0.0) if own > 0.0 => Some("that body"),
        (0.0, other) if other > 0.0 => Some("this body, other than that one,"),
        _ => None,
    }
}

/// What is to be said of all numbers together: the largest errors, and what hides them.
pub fn words(trust: &Trust) -> Vec<String> {
    let mut all = vec![];
    for (k, beside) in trust.beside.iter().enumerate() {
        if let Some(why) = &beside.refused {
            all.push(format!("{}: not computed: {why}", beside.text));
            continue;
        }
        all.push(format!("{}: {}", beside.text, meaning(beside)));
        if beside.same_switches == Some(false) {
            let rest = match beside.replaced {
                Replaced::OtherContact => "",
                _ => {
                    ": the contact takes another course, of which no order of convergence is known; both values are told, and none between them"
                }
            };
            let gone = never_touches(trust, k).map(|who| {
                format!(
                    "{}: {who} never touches; forces, impulses and times of contact mean nothing yet: refine until both touch",
                    beside.text
                )
            });
            let text = || format!("{}: the nodes switch in another order{rest}", beside.text);
            all.push(gone.unwrap_or_else(text));
        }
        if beside.replaced == Replaced::OtherContact {
            continue;
        }
        let (frequency, force) = (trust.largest(k, "frequency"), trust.largest(k, "force"));
        if let (Some(f), Some(p)) = (frequency, force)
            && f > SMALL
            && p < 0.25 * f
        {
            all.push(format!(
                "forces agree to {} where frequencies differ by {}: forces are no measure of trust",
                up_to(p),
                up_to(f)
            ));
        }
        if let Some(most) = frequency.filter(|f| *f > SMALL) {
            all.push(format!(
                "frequencies are off by up to {}: take elements of second order, or a finer mesh",
                up_to(most)
            ));
        }
    }
    let taken = trust.relief.iter().map(|r| 1.0 - (1.0 - r.share).max(0.0).sqrt());
    if let Some(worst) = taken.reduce(f64::max)
        && worst > SMALL
    {
        let list: Vec<String> =
            trust.relief.iter().map(|r| significant(r.omega * (1.0 - r.share).sqrt(), 5)).collect();
        all.push(format!(
            "without another solution: what these elements lack takes up to {} off the frequencies; they come to {}",
            up_to(worst),
            list.join(", ")
        ));
    }
    all.extend(trust.warnings.iter().cloned());
    if trust.beside.is_empty() {
        all.push(
            "a body from matrices, whose contact takes nodal reactions if it has one: nothing here tells what its mesh leaves out; its deck as kind = \"mesh\" is judged"
                .into(),
        );
    }
    all.push("these are errors of the mesh; `certified` and `signorini precision` are about the integrator, and say nothing of them".into());
    all
}

/// A row of the table.
fn row(trust: &Trust, f: &Figure) -> String {
    let mut line = format!("  {:<14}{:<26}{:>13}", f.kind, f.name, value(f, f.value));
    for k in 0..trust.beside.len() {
        let words = f.beside.get(k).copied().flatten();
        let words = words.map_or_else(|| "–".to_owned(), |x| value(f, x));
        let off = f.relative(k).map_or_else(String::new, percent);
        let _ = write!(line, "{words:>15}{off:>10}");
    }
    line.trim_end().to_owned() + "\n"
}

/// The table with what it means.
pub fn text(trust: &Trust) -> String {
    let mut out = format!("  {:<14}{} ({} displacements)\n", "this mesh", trust.mesh, trust.n_dof);
    for (k, beside) in trust.beside.iter().enumerate() {
        let size = match beside.refused {
            None => format!(" ({} displacements)", beside.n_dof),
            Some(_) => " (not computed)".to_owned(),
        };
        let _ = writeln!(out, "  {:<14}{}{size}", format!("beside it {}", k + 1), beside.text);
    }
    let mut head = format!("\n  {:<14}{:<26}{:>13}", "what", "", "this mesh");
    for k in 1..=trust.beside.len() {
        let _ = write!(head, "{:>15}{:>10}", format!("beside it {k}"), "off by");
    }
    out.push_str(&head);
    out.push('\n');
    trust.figures.iter().for_each(|f| out.push_str(&row(trust, f)));
    out.push('\n');
    words(trust).iter().for_each(|w| {
        let _ = writeln!(out, "  {w}");
    });
    out
}

/// As JSON.
pub fn json(trust: &Trust) -> Value {
    let figure = |f: &Figure| {
        let relative: Vec<Option<f64>> = (0..trust.beside.len()).map(|k| f.relative(k)).collect();
        object!({"kind": f.kind, "name": f.name, "value": f.value, "beside": f.beside, "relative": relative})
    };
    let figures: Vec<Value> = trust.figures.iter().map(figure).collect();
    object!({"mesh": trust.mesh, "n_dof": trust.n_dof, "beside": trust.beside, "figures": figures, "warnings": trust.warnings, "relief": trust.relief,
        "words": words(trust)})
}
