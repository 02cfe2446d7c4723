//! The picture `contact`: contact displacement and pressure of nodes along the edge.

use plotters::prelude::*;

use super::Options;
use super::time::{over_time, time_range};
use crate::report::curve::{self, Knot};
use crate::report::edge::Edge;
use crate::report::figure::{
    self, Area, Drawn, Entry, FigureError, INK, Mark, SHADE, legend, line, px, range, text, title,
};
use crate::store::Stored;

/// Contact displacement and pressure against time, contact intervals shaded.
pub(super) fn contact(stored: &Stored, options: &Options) -> Result<String, FigureError> {
    if stored.gap.is_empty() || stored.t.is_empty() {
        return Err(FigureError::Empty("the body has no contact nodes"));
    }
    let edge = Edge::of(stored);
    let chosen = |i: &usize| options.nodes.contains(&stored.contact_nodes[*i]);
    let shown: Vec<usize> = match options.nodes.is_empty() {
        true => edge.shown(),
        false => (0..stored.gap.len()).filter(chosen).collect(),
    };
    figure::svg((980, 620), |root| {
        title(root, &stored.title, &what(&edge, &shown))?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = edge.beside_bar(sheet, px(900.0));
        let (strip, main) = main.split_vertically(px(20.0));
        let panels = main.split_evenly((2, 1));
        displacements(&panels[0], &strip, stored, &edge, &shown)?;
        let unseen = shown.iter().map(|&i| unseen_contacts(stored, i)).sum::<usize>();
        if unseen > 0 {
            let contacts = if unseen == 1 { "contact lies" } else { "contacts lie" };
            let words = format!(
                "{unseen} {contacts} between two stored states: no pressure is drawn (more samples show it)"
            );
            strip
                .draw(&Text::new(words, (px(12.0), px(2.0)), text(13)))
                .map_err(FigureError::draw)?;
        }
        pressures(&panels[1], stored, &edge, &shown)?;
        edge.bar(bar.as_ref())
    })
}

/// The picture's name, with how many of the nodes it shows.
fn what(edge: &Edge, shown: &[usize]) -> String {
    match (shown.len(), edge.fronts.len()) {
        (some, all) if some < all => format!("contact, {some} of {all} nodes"),
        _ => "contact".to_owned(),
    }
}

/// Contacts of a point that begin and end without a stored state in between that has a pressure.
fn unseen_contacts(stored: &Stored, i: usize) -> usize {
    let rows: Vec<usize> = (0..stored.t.len()).collect();
    let touches = |r: &usize| stored.active[(*r, i)] != 0;
    let contacts = rows.chunk_by(|a, b| touches(a) == touches(b)).filter(|run| touches(&run[0]));
    let whole = contacts.filter(|run| run.last() != rows.last());
    let largest = stored.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    // it begins without pressure
    let behind = |run: &[usize]| run[1..].iter().any(|&r| stored.pressure[(r, i)] > 1e-6 * largest);
    whole.filter(|run| !behind(run)).count()
}

/// Contact displacements, with the obstacle where all nodes have the same; and the legend.
fn displacements(
    area: &Area,
    strip: &Area,
    stored: &Stored,
    edge: &Edge,
    shown: &[usize],
) -> Drawn {
    let rows = stored.t.len();
    let all = shown.iter().flat_map(|&i| (0..rows).map(move |r| edge.motion(r, i).0));
    let fronts = edge.fronts.iter().map(|&i| stored.gap[i]);
    let behind = edge.fronts.iter().filter_map(|&i| edge.behind(i)).map(|i| -stored.gap[i]);
    let y = range(all.chain(fronts).chain(behind));
    let mut chart = over_time(area, stored, y, ("", "contact displacement"))?;
    let mut entries: Vec<Entry> = vec![("in contact", SHADE, Mark::Patch)];
    let limits = edge.even_limits();
    for &limit in &limits {
        let time = time_range(stored);
        let ends = [(time.start, limit), (time.end, limit)];
        let dashes = DashedLineSeries::new(ends, px(6.0), px(4.0), line(INK, 1.0));
        chart.draw_series(dashes).map_err(FigureError::draw)?;
    }
    if !limits.is_empty() {
        entries.push(("obstacle", INK, Mark::Dashes));
    }
    legend(strip, &entries)?;
    for &i in shown {
        let knot = |r: usize| {
            let (x, v) = edge.motion(r, i);
            Knot { t: stored.t[r], x, v }
        };
        let knots: Vec<Knot> = (0..rows).map(knot).collect();
        let jump = |r: usize| stored.switch_t.contains(&stored.t[r]);
        let series = curve::through(&knots, jump).into_iter().map(|k| (k.t, k.x));
        chart
            .draw_series(LineSeries::new(series, line(edge.colour(i), 2.0)))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// Contact pressures.
fn pressures(area: &Area, stored: &Stored, edge: &Edge, shown: &[usize]) -> Drawn {
    let rows = stored.t.len();
    let both = |&i: &usize| std::iter::once(i).chain(edge.behind(i));
    let shown: Vec<usize> = shown.iter().flat_map(both).collect();
    let all = shown.iter().flat_map(|&i| (0..rows).map(move |r| stored.pressure[(r, i)]));
    let y = range(all.chain([0.0]));
    let mut chart = over_time(area, stored, y, ("time", "contact pressure"))?;
    for &i in &shown {
        let series = (0..rows).map(|r| (stored.t[r], stored.pressure[(r, i)]));
        chart
            .draw_series(LineSeries::new(series, line(edge.colour(i), 2.0)))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}
