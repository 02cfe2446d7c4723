//! Poincaré's section at a switch: the closings of the contact point that closes most often.

use std::path::Path;

use super::Options;
use crate::event::SwitchKind;
use crate::report::figure::{Axis, Cell, Chart, FigureError, LINES, Mark, Point, Sheet, range};
use crate::scenario::Scene;
use crate::store::Stored;

/// Fewer closings make no section.
const FEWEST: usize = 3;

/// More of them are drawn small.
const MANY: usize = 400;

/// The closings of a contact point: times, and velocities towards the obstacle before them.
struct Closings {
    point: usize,
    at: Vec<(f64, f64)>,
}

impl Closings {
    /// Those of the point that has most.
    fn of(stored: &Stored) -> Option<Closings> {
        let closes = |k: &usize| {
            let kind = SwitchKind::of_name(&stored.switch_kind[*k]);
            matches!(kind, SwitchKind::Close | SwitchKind::Impact)
        };
        let all: Vec<usize> = (0..stored.switch_t.len()).filter(closes).collect();
        let of = |point: usize| all.iter().filter(move |k| stored.switch_point[**k] == point);
        // the first of those that close as often
        let point = (0..stored.facing()).rev().max_by_key(|point| of(*point).count())?;
        let at = |k: &usize| (stored.switch_t[*k], -stored.switch_rate[*k]);
        let at: Vec<(f64, f64)> = of(point).map(at).collect();
        (at.len() >= FEWEST).then_some(Closings { point, at })
    }
}

/// Velocity before each closing over the phase of the loads, or over the time since the one before; and that time over the one before.
pub(super) fn section<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let why = "a section needs a contact point that closes three times";
    let closings = Closings::of(stored).ok_or(FigureError::Empty(why))?;
    let period = Scene::parse(&stored.scene, Path::new("stored")).ok().and_then(|s| s.period());
    let unit = period.unwrap_or(1.0);
    let returns: Vec<f64> =
        closings.at.windows(2).map(|pair| (pair[1].0 - pair[0].0) / unit).collect();
    let arrivals: Vec<Point> = match period {
        Some(period) => {
            closings.at.iter().map(|(t, v)| ((t / period).rem_euclid(1.0), *v)).collect()
        }
        None => returns.iter().zip(&closings.at[1..]).map(|(tau, (_, v))| (*tau, *v)).collect(),
    };
    let name = match period {
        Some(_) => "return time, periods of the loads",
        None => "return time",
    };
    let chart = |names: [&str; 2], points: Vec<Point>, x: Option<std::ops::Range<f64>>| {
        let x = x.unwrap_or_else(|| range(points.iter().map(|p| p.0)));
        let y = range(points.iter().map(|p| p.1));
        let mut chart = Chart::new(Axis::linear(names[0], x), Axis::linear(names[1], y));
        let mark = if points.len() > MANY { Mark::Speck } else { Mark::Dot };
        chart.marks(points, mark, LINES[0]);
        Cell::from(chart)
    };
    let (first, whole) = match period {
        Some(_) => ("phase of the loads, periods", Some(0.0..1.0)),
        None => (name, None),
    };
    let next = returns.windows(2).map(|pair| (pair[0], pair[1])).collect();
    let what = format!(
        "section at the closings of contact point {}: {} of them",
        stored.contact_name(closings.point),
        closings.at.len()
    );
    Ok(Sheet::new(&stored.title, &what).row(
        460.0,
        vec![
            chart([first, "velocity towards the obstacle"], arrivals, whole),
            chart([name, "next one"], next, None),
        ],
    ))
}
