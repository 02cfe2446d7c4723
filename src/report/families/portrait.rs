//! The phase portrait of the contact nodes of an orbit.

use plotters::prelude::ShapeStyle;

use crate::report::curve::{self, Knot};
use crate::report::edge::Edge;
use crate::report::figure::{
    self, Chart, Drawn, Entry, FigureError, INK, Mark, draw_dashes, draw_line, legend, line, panel,
    px, range, symbols, title,
};
use crate::store::Stored;

/// Contact displacement and its velocity.
type State = (f64, f64);

/// A switch of a contact node.
struct Switch {
    /// The first stored state at or after it: that after the switch.
    row: usize,
    /// The state before it.
    before: State,
    /// Whether the node closes.
    closes: bool,
}

/// What a portrait is drawn from.
struct Portrait<'s> {
    stored: &'s Stored,
    edge: Edge<'s>,
    /// Rates of the monitors at the switches.
    rates: &'s [f64],
}

impl Portrait<'_> {
    fn knot(&self, row: usize, (x, v): State) -> Knot {
        Knot { t: self.stored.t[row], x, v }
    }

    /// The curve through some knots; the velocity of a free contact displacement jumps at the switches of its neighbours too.
    fn smooth(&self, knots: &[Knot]) -> Vec<State> {
        let last = knots.len() - 1;
        let jump = |k: usize| k < last && self.stored.switch_t.contains(&knots[k].t);
        curve::through(knots, jump).iter().map(|k| (k.x, k.v)).collect()
    }

    /// The switches of a node: the stored state is that after it; a node that closes came with the rate of its gap.
    fn switches(&self, i: usize) -> Vec<Switch> {
        let stored = self.stored;
        let row_of = |t: f64| stored.t.partition_point(|&s| s < t).min(stored.t.len() - 1);
        let switch = |k: usize| {
            let row = row_of(stored.switch_t[k]);
            let x = self.edge.motion(row, i).0;
            let closes = stored.switch_kind[k] != "open";
            let last = || self.edge.motion(row.saturating_sub(1), i).1;
            let arrival = || self.rates.get(k).map_or_else(last, |rate| -rate);
            Switch { row, before: (x, if closes { arrival() } else { 0.0 }), closes }
        };
        let of_point = |k: &usize| stored.switch_point[*k] == i;
        (0..stored.switch_t.len()).filter(of_point).map(switch).collect()
    }

    /// The curve of a node; thin: the jumps of its velocity at its switches.
    fn draw(&self, chart: &mut Chart, i: usize) -> Drawn {
        let style = |width: f64| -> ShapeStyle { line(self.edge.colour(i), width) };
        let knot = |row: usize| self.knot(row, self.edge.motion(row, i));
        let mut from = 0;
        for Switch { row, before, .. } in self.switches(i).into_iter().filter(|s| s.row > 0) {
            let knots: Vec<Knot> = (from..row).map(knot).chain([self.knot(row, before)]).collect();
            draw_line(chart, self.smooth(&knots), style(1.8))?;
            draw_line(chart, vec![before, self.edge.motion(row, i)], style(0.8))?;
            from = row;
        }
        let knots: Vec<Knot> = (from..self.stored.t.len()).map(knot).collect();
        draw_line(chart, self.smooth(&knots), style(1.8))
    }

    /// Where a node leaves or meets the free motion.
    fn ends(&self, i: usize, closing: bool) -> Vec<State> {
        let chosen = self.switches(i).into_iter().filter(|s| s.closes == closing);
        chosen.map(|s| if s.closes { s.before } else { self.edge.motion(s.row, i) }).collect()
    }
}

/// Contact displacement along the outward normal and its velocity, a curve a node; thin: jumps of the velocity at its switches.
pub(super) fn portrait(stored: &Stored, rates: &[f64]) -> Result<String, FigureError> {
    let rows = stored.t.len();
    if stored.gap.is_empty() || rows < 2 {
        return Err(FigureError::Empty("a portrait needs a contact node and two states"));
    }
    let portrait = Portrait { stored, edge: Edge::of(stored), rates };
    let edge = &portrait.edge;
    let shown = edge.shown();
    let all = || shown.iter().flat_map(|&i| (0..rows).map(move |r| edge.motion(r, i)));
    let limits = edge.fronts.iter().flat_map(|&i| {
        let behind = edge.behind(i).map(|i| -stored.gap[i]);
        std::iter::once(stored.gap[i]).chain(behind)
    });
    let x = range(all().map(|p| p.0).chain(limits));
    let arrivals = shown.iter().flat_map(|&i| portrait.switches(i)).map(|s| s.before.1);
    let y = range(all().map(|p| p.1).chain(arrivals));
    figure::svg((980, 640), |root| {
        title(root, &stored.title, "phase portrait of the contact nodes")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = edge.beside_bar(sheet, px(895.0));
        let (strip, main) = main.split_vertically(px(20.0));
        let mut entries: Vec<Entry> = vec![];
        let mut chart = panel(&main, x.clone(), y.clone(), "contact displacement", "its velocity")?;
        let limits = edge.even_limits();
        for &wall in &limits {
            draw_dashes(&mut chart, vec![(wall, y.start), (wall, y.end)], line(INK, 1.0))?;
        }
        if !limits.is_empty() {
            entries.push(("obstacle", INK, Mark::Dashes));
        }
        shown.iter().try_for_each(|&i| portrait.draw(&mut chart, i))?;
        for (closing, mark, name) in [(true, Mark::Dot, "closes"), (false, Mark::Ring, "opens")] {
            let points: Vec<State> =
                shown.iter().flat_map(|&i| portrait.ends(i, closing)).collect();
            if !points.is_empty() {
                symbols(&chart, points, mark, INK)?;
                entries.push((name, INK, mark));
            }
        }
        legend(&strip, &entries)?;
        edge.bar(bar.as_ref())
    })
}
