//! The numbers of `trust` as a picture and as a table: how far each is off, beside every body that was computed.

use std::fmt::Write as _;

use super::export::{number, quoted};
use super::figure::{Axis, Chart, FigureError, INK, Legend, Mark, Sheet, entry, series_colour};
use crate::records::Trust;

/// Nothing is drawn as nearer than this.
const FLOOR: f64 = 1e-6;
/// Height of a row.
const ROW: f64 = 22.0;

/// A row a number: what it is, its value, and for each body beside the value there and the relative distance from it.
pub fn csv(trust: &Trust) -> String {
    let mut out = String::from("kind,name,value");
    for k in 1..=trust.beside.len() {
        let _ = write!(out, ",beside_{k},off_{k}");
    }
    out.push('\n');
    for f in &trust.figures {
        let _ = write!(out, "{},{},{}", f.kind, quoted(&f.name), number(f.value));
        for k in 0..trust.beside.len() {
            for x in [f.beside.get(k).copied().flatten(), f.relative(k)] {
                let _ = write!(out, ",{}", x.map(number).unwrap_or_default());
            }
        }
        out.push('\n');
    }
    out
}

/// How far each number is off, from one to a millionth: filled where this mesh has more, hollow where it has less.
pub fn picture(title: &str, trust: &Trust) -> Result<Sheet<'static>, FigureError> {
    let shown: Vec<usize> = (0..trust.figures.len())
        .filter(|i| (0..trust.beside.len()).any(|k| trust.figures[*i].relative(k).is_some()))
        .collect();
    if shown.is_empty() {
        return Err(FigureError::Empty("nothing stands beside this mesh"));
    }
    let count = shown.len() as f64;
    // the first stands above
    let place = |row: usize| count - row as f64;
    let name = |i: usize| format!("{} {}", trust.figures[i].kind, trust.figures[i].name);
    let names = shown.iter().enumerate().map(|(row, i)| (place(row), name(*i))).collect();
    let off = |i: usize, k: usize| {
        let off = trust.figures[i].relative(k)?;
        (off != 0.0 && off.is_finite()).then(|| (off.abs().max(FLOOR).log10(), off > 0.0))
    };
    let all = || shown.iter().flat_map(|i| (0..trust.beside.len()).filter_map(|k| off(*i, k)));
    let most = all().fold(0.0f64, |m, o| m.max(o.0)).ceil();
    let least = all().fold(most - 1.0, |m, o| m.min(o.0)).floor();
    let x = Axis::decades("distance from the number beside, over that", least..most);
    let mut chart = Chart::new(x, Axis::named("", 0.4..count + 0.6, names));
    let mut legend = vec![];
    for (k, beside) in trust.beside.iter().enumerate().filter(|(_, b)| b.refused.is_none()) {
        let colour = series_colour(k);
        for (mark, above) in [(Mark::Dot, true), (Mark::Ring, false)] {
            let points = shown.iter().enumerate().filter_map(|(row, i)| {
                let (x, is_above) = off(*i, k)?;
                (is_above == above).then_some((x, place(row)))
            });
            chart.marks(points, mark, colour);
        }
        legend.push(entry(beside.text.clone(), colour, Mark::Dot));
    }
    let marks = vec![
        entry("this mesh has more", INK, Mark::Dot),
        entry("this mesh has less", INK, Mark::Ring),
    ];
    let what = format!("how far this mesh is to be trusted ({})", trust.mesh);
    let sheet = Sheet::new(title, &what).legend(Legend::Rows(legend)).legend(Legend::Rows(marks));
    Ok(sheet.row(90.0 + ROW * count, vec![chart.into()]))
}
