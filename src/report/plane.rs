//! The plane of the frequency and a number of the scene, with the curves that divide it; and their table as CSV.

use std::fmt::Write as _;

use super::export::{number, quoted};
use super::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, LINES, Legend, Mark, Point, Sheet, entry, range,
};
use crate::records::{Curve, CurveOf, CurvePoint, CurvePointKind};
use crate::store::StoredCurves;

/// What a curve is called in a legend.
fn name(of: CurveOf, periods: usize) -> String {
    let what = match of {
        CurveOf::Fold => "fold",
        CurveOf::Doubling => "period doubling",
        CurveOf::Torus => "Neimark–Sacker",
        CurveOf::Grazing => "grazing",
        CurveOf::Peak => "peak of the amplitude",
    };
    match periods {
        1 => what.to_owned(),
        n => format!("{what} of period {n}"),
    }
}

/// A curve with what it is of.
type Of<'f> = (CurveOf, &'f Curve);

fn line(curve: &Curve, at: impl Fn(&CurvePoint) -> Point) -> Vec<Point> {
    let mut points: Vec<Point> = curve.points.iter().map(at).collect();
    if curve.closed {
        points.extend(points.first().copied());
    }
    points.retain(|p| p.0.is_finite() && p.1.is_finite());
    points
}

/// The curves of some files, of one number: over the frequency, and the amplitudes of their orbits.
pub fn picture(files: &[StoredCurves]) -> Result<Sheet<'static>, FigureError> {
    let all: Vec<Of> =
        files.iter().flat_map(|f| f.curves.all.iter().map(move |c| (f.curves.of, c))).collect();
    let first = files.first().filter(|_| !all.is_empty());
    let first = first.ok_or(FigureError::Empty("no curve was found"))?;
    // one colour for each kind of curve
    let mut kinds: Vec<(CurveOf, usize)> = all.iter().map(|(of, c)| (*of, c.periods)).collect();
    kinds.sort_by_key(|(of, periods)| (CurveOf::ALL.iter().position(|o| o == of), *periods));
    kinds.dedup();
    let colour = |of: CurveOf, periods: usize| {
        let place = kinds.iter().position(|kind| *kind == (of, periods)).unwrap_or(0);
        LINES[place % LINES.len()]
    };
    let mut legend: Vec<Entry> =
        kinds.iter().map(|k| entry(name(k.0, k.1), colour(k.0, k.1), Mark::Line)).collect();
    let has =
        |kind: CurvePointKind| all.iter().any(|(_, c)| c.points.iter().any(|p| p.kind == kind));
    let marked = [
        (CurvePointKind::Cusp, "cusp", Mark::Disc),
        (CurvePointKind::Turn, "the number turns back", Mark::Circle),
    ];
    legend
        .extend(marked.iter().filter(|m| has(m.0)).map(|(_, name, mark)| entry(*name, INK, *mark)));
    let chart = |axes: [&str; 2], at: fn(&CurvePoint) -> Point| {
        let points = || all.iter().flat_map(|(_, c)| &c.points).map(at);
        let x = range(points().map(|p| p.0).filter(|x| x.is_finite()));
        let y = range(points().map(|p| p.1).filter(|y| y.is_finite()));
        let mut chart = Chart::new(Axis::linear(axes[0], x), Axis::linear(axes[1], y));
        for (of, curve) in &all {
            chart.line(line(curve, at), colour(*of, curve.periods), 1.8);
        }
        for (of, curve) in &all {
            for (kind, _, mark) in marked {
                let special = curve.points.iter().filter(|p| p.kind == kind).map(at);
                chart.marks(special, mark, colour(*of, curve.periods));
            }
        }
        Cell::from(chart)
    };
    let key = first.curves.key.as_str();
    let plane = chart(["frequency ω", key], |p| (p.omega, p.value));
    let heights = chart([key, "largest contact displacement"], |p| (p.value, p.amplitude));
    Ok(Sheet::new(&first.head.title, &format!("curves over {key}"))
        .legend(Legend::Rows(legend))
        .row(400.0, vec![plane])
        .row(270.0, vec![heights]))
}

/// A row a point.
pub fn csv(stored: &StoredCurves) -> String {
    let mut out =
        String::from("curve,of,periods,omega,value,theta,amplitude,energy,outside,special\n");
    for (k, curve) in stored.curves.all.iter().enumerate() {
        for p in &curve.points {
            let theta = p.theta.map_or(String::new(), number);
            let outside = p.outside.map_or(String::new(), |n| n.to_string());
            let _ = writeln!(
                out,
                "{k},{},{},{},{},{theta},{},{},{outside},{}",
                stored.curves.of.word(),
                curve.periods,
                number(p.omega),
                number(p.value),
                number(p.amplitude),
                number(p.energy),
                quoted(p.kind.word())
            );
        }
    }
    out
}
