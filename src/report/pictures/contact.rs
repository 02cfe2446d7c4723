//! The picture `contact`: contact displacement and pressure of nodes along the edge, forces of sliders.

use ndarray::Array2;

use super::Options;
use super::time::{over_time, time_range};
use crate::report::curve::{self, Knot};
use crate::report::edge::Edge;
use crate::report::figure::{
    Cell, Chart, Entry, FigureError, INK, Mark, SHADE, Sheet, entry, range, viridis,
};
use crate::store::Stored;

/// Contact displacement and pressure against time, contact intervals shaded.
pub(super) fn contact<'s>(stored: &'s Stored, options: &Options) -> Result<Sheet<'s>, FigureError> {
    if stored.gap.is_empty() || stored.t.is_empty() {
        return Err(FigureError::Empty("the body has no contact nodes"));
    }
    if stored.facing() == 0 {
        return Ok(sliders(stored));
    }
    let edge = Edge::of(stored);
    let chosen = |i: &usize| options.nodes.contains(&stored.contact_nodes[*i]);
    let shown: Vec<usize> = match options.nodes.is_empty() {
        true => edge.shown(),
        false => (0..stored.facing()).filter(chosen).collect(),
    };
    let unseen = shown.iter().map(|&i| unseen_contacts(stored, i)).sum::<usize>();
    let contacts = if unseen == 1 { "contact lies" } else { "contacts lie" };
    let note = match unseen {
        0 => String::new(),
        n => format!(
            "{n} {contacts} between two stored states: no pressure is drawn (more samples show it)"
        ),
    };
    let name = |what: &'static str, is_last: bool| (if is_last { "time" } else { "" }, what);
    let traction = stored.rubbed.as_ref().map(|r| &r.traction);
    let pressures = forces(
        stored,
        &edge,
        &shown,
        (&stored.pressure, name("contact pressure", traction.is_none())),
    );
    let mut sheet = Sheet::new(&stored.title, &what(&edge, &shown))
        .row(305.0, vec![displacements(stored, &edge, &shown).note(note)])
        .row(285.0, vec![pressures.into()]);
    if let Some(traction) = traction {
        let tractions =
            forces(stored, &edge, &shown, (traction, name("traction by friction", true)));
        sheet = sheet.row(285.0, vec![tractions.into()]);
    }
    Ok(sheet.bar(edge.bar()))
}

/// So many sliders have names in the picture.
const LEGEND: usize = 10;

/// The forces of sliders over time, of a body that has nothing else.
fn sliders(stored: &Stored) -> Sheet<'_> {
    let all = 0..stored.gap.len();
    let force = |r: usize, i: usize| stored.rubbed.as_ref().map_or(0.0, |f| f.traction[(r, i)]);
    let rows = stored.t.len();
    let y = range(all.clone().flat_map(|i| (0..rows).map(move |r| force(r, i))).chain([0.0]));
    let mut chart = over_time(stored, y, ("time", "force of a slider on the body"));
    let mut entries = vec![];
    for i in all {
        let colour = viridis((i as f64 + 0.5) / stored.gap.len() as f64);
        chart.line((0..rows).map(|r| (stored.t[r], force(r, i))).collect(), colour, 1.5);
        entries.push(entry(stored.contact_name(i), colour, Mark::Line));
    }
    let shown = if entries.len() > LEGEND { vec![] } else { entries };
    Sheet::new(&stored.title, "sliders").row(420.0, vec![Cell::from(chart).legend(shown)])
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
    let touches = |r: &usize| stored.touches(*r, i);
    let contacts = rows.chunk_by(|a, b| touches(a) == touches(b)).filter(|run| touches(&run[0]));
    let whole = contacts.filter(|run| run.last() != rows.last());
    let largest = stored.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    // it begins without pressure
    let behind = |run: &[usize]| run[1..].iter().any(|&r| stored.pressure[(r, i)] > 1e-6 * largest);
    whole.filter(|run| !behind(run)).count()
}

/// Contact displacements, with the obstacle where all nodes have the same; and the legend.
fn displacements(stored: &Stored, edge: &Edge, shown: &[usize]) -> Cell<'static> {
    let rows = stored.t.len();
    let all = shown.iter().flat_map(|&i| (0..rows).map(move |r| edge.motion(r, i).0));
    let fronts = edge.fronts.iter().map(|&i| stored.gap[i]);
    let behind = edge.fronts.iter().filter_map(|&i| edge.behind(i)).map(|i| -stored.gap[i]);
    let y = range(all.chain(fronts).chain(behind));
    // where gaps move displacements are counted from where they have gone
    let name = if stored.swings() { "displacement less the gap's" } else { "contact displacement" };
    let mut chart = over_time(stored, y, ("", name));
    let mut entries: Vec<Entry> = vec![entry("in contact", SHADE, Mark::Patch)];
    let (limits, time) = (edge.even_limits(), time_range(stored));
    for &limit in &limits {
        chart.dashes(vec![(time.start, limit), (time.end, limit)], INK, 1.0);
    }
    if !limits.is_empty() {
        entries.push(entry("obstacle", INK, Mark::Dashes));
    }
    for &i in shown {
        let knot = |r: usize| {
            let (x, v) = edge.motion(r, i);
            Knot { t: stored.t[r], x, v }
        };
        let knots: Vec<Knot> = (0..rows).map(knot).collect();
        let jump = |r: usize| stored.switch_t.contains(&stored.t[r]);
        let series = curve::through(&knots, jump).into_iter().map(|k| (k.t, k.x));
        chart.line(series.collect(), edge.colour(i), 2.0);
    }
    Cell::from(chart).legend(entries)
}

/// Pressures or tractions of contact points.
fn forces(
    stored: &Stored,
    edge: &Edge,
    shown: &[usize],
    (values, labels): (&Array2<f64>, (&'static str, &'static str)),
) -> Chart {
    let rows = stored.t.len();
    let both = |&i: &usize| std::iter::once(i).chain(edge.behind(i));
    let shown: Vec<usize> = shown.iter().flat_map(both).collect();
    let all = shown.iter().flat_map(|&i| (0..rows).map(move |r| values[(r, i)]));
    let y = range(all.chain([0.0]));
    let mut chart = over_time(stored, y, labels);
    for &i in &shown {
        let series = (0..rows).map(|r| (stored.t[r], values[(r, i)]));
        chart.line(series.collect(), edge.colour(i), 2.0);
    }
    chart
}
