//! The phase portrait of the contact nodes of an orbit.

use crate::event::SwitchKind;
use crate::report::curve::{self, Knot};
use crate::report::edge::Edge;
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, Mark, Sheet, entry, range,
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

    /// The switches of a node between free motion and contact: the stored state is that after it; a node that closes came with the rate of its gap.
    fn switches(&self, i: usize) -> Vec<Switch> {
        let stored = self.stored;
        let row_of = |t: f64| stored.t.partition_point(|&s| s < t).min(stored.t.len() - 1);
        let kind = |k: usize| SwitchKind::of_name(&stored.switch_kind[k]);
        let switch = |k: usize| {
            let row = row_of(stored.switch_t[k]);
            let x = self.edge.motion(row, i).0;
            let closes = kind(k) != SwitchKind::Open;
            Switch { row, before: (x, if closes { -stored.switch_rate[k] } else { 0.0 }), closes }
        };
        let of_point = |k: &usize| stored.switch_point[*k] == i && !kind(*k).is_tangential();
        (0..stored.switch_t.len()).filter(of_point).map(switch).collect()
    }

    /// The curve of a node; thin: the jumps of its velocity at its switches.
    fn draw(&self, chart: &mut Chart, i: usize) {
        let colour = self.edge.colour(i);
        let knot = |row: usize| self.knot(row, self.edge.motion(row, i));
        let mut from = 0;
        for Switch { row, before, .. } in self.switches(i).into_iter().filter(|s| s.row > 0) {
            let knots: Vec<Knot> = (from..row).map(knot).chain([self.knot(row, before)]).collect();
            chart.line(self.smooth(&knots), colour, 1.8);
            chart.line(vec![before, self.edge.motion(row, i)], colour, 0.8);
            from = row;
        }
        let knots: Vec<Knot> = (from..self.stored.t.len()).map(knot).collect();
        chart.line(self.smooth(&knots), colour, 1.8);
    }

    /// Where a node leaves or meets the free motion.
    fn ends(&self, i: usize, closing: bool) -> Vec<State> {
        let chosen = self.switches(i).into_iter().filter(|s| s.closes == closing);
        chosen.map(|s| if s.closes { s.before } else { self.edge.motion(s.row, i) }).collect()
    }
}

/// Contact displacement along the outward normal and its velocity, a curve a node; thin: jumps of the velocity at its switches.
pub(super) fn portrait(stored: &Stored) -> Result<Sheet<'static>, FigureError> {
    let rows = stored.t.len();
    if stored.facing() == 0 || rows < 2 {
        return Err(FigureError::Empty("a portrait needs a contact node and two states"));
    }
    let portrait = Portrait { stored, edge: Edge::of(stored) };
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
    let axes = (Axis::linear("contact displacement", x), Axis::linear("its velocity", y.clone()));
    let mut chart = Chart::new(axes.0, axes.1);
    let mut entries: Vec<Entry> = vec![];
    let limits = edge.even_limits();
    for &wall in &limits {
        chart.dashes(vec![(wall, y.start), (wall, y.end)], INK, 1.0);
    }
    if !limits.is_empty() {
        entries.push(entry("obstacle", INK, Mark::Dashes));
    }
    shown.iter().for_each(|&i| portrait.draw(&mut chart, i));
    for (closing, mark, name) in [(true, Mark::Dot, "closes"), (false, Mark::Ring, "opens")] {
        let points: Vec<State> = shown.iter().flat_map(|&i| portrait.ends(i, closing)).collect();
        if !points.is_empty() {
            chart.marks(points, mark, INK);
            entries.push(entry(name, INK, mark));
        }
    }
    Ok(Sheet::new(&stored.title, "phase portrait of the contact nodes")
        .row(610.0, vec![Cell::from(chart).legend(entries)])
        .bar(edge.bar()))
}
