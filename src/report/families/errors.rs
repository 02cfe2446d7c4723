//! The error statement of a family around its energies: a band along its points, or bars where it is no graph over the frequency.

use plotters::prelude::{Color, RGBColor};

use super::branches::{branches, of_branch, runs};
use crate::records::{Changed, ErrorStatement, Solver, Variation};
use crate::report::figure::{Chart, Entry, INK, Mark, entry, line, tint};
use crate::store::StoredFamily;

/// Share of the colour that is left in the band of everything.
const LIGHT: f64 = 0.18;
/// The same where what is numerical lies on top of it.
const DARK: f64 = 0.42;
/// Name of the only band where the viscosity does nowhere more than what is numerical.
const WITHIN: &str = "mesh and contact (the viscosity within)";
/// Bands that are nowhere wider, over the energy, are thinner than the line and not drawn.
const THIN: f64 = 1e-3;
/// Name of the only one of reduced responses.
const MODES: &str = "number of modes";
/// On a logarithmic axis a band goes down at most to this part of the least energy.
const LOWEST: f64 = 0.3;

/// How far everything reaches, and what is numerical alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reach {
    Everything,
    Numerical,
}

impl Reach {
    /// The lighter one first: the other lies on it.
    const BOTH: [Reach; 2] = [Reach::Everything, Reach::Numerical];

    fn name(self) -> &'static str {
        match self {
            Reach::Everything => "viscosity",
            Reach::Numerical => "mesh and contact",
        }
    }

    fn share(self) -> f64 {
        match self {
            Reach::Everything => LIGHT,
            Reach::Numerical => DARK,
        }
    }

    fn bar(self) -> Mark {
        match self {
            Reach::Everything => Mark::Bar,
            Reach::Numerical => Mark::Beam,
        }
    }

    /// Frequencies, ascending, with the energy and the half width of the band there; where the viscosity reaches no further there is no second band.
    fn knots(self, statement: &ErrorStatement) -> Vec<Knot> {
        let widths = statement.band(self == Reach::Numerical);
        let further =
            |(w, numerical): (&f64, f64)| *w > numerical || (numerical.is_nan() && !w.is_nan());
        if self == Reach::Everything && !widths.iter().zip(statement.band(true)).any(further) {
            return vec![];
        }
        let all = statement.omega.iter().zip(&statement.energy).zip(widths);
        let mut knots: Vec<Knot> =
            all.map(|((&omega, &energy), width)| Knot { omega, energy, width }).collect();
        knots.retain(|k| [k.omega, k.energy, k.width].iter().all(|x| x.is_finite()));
        knots.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        knots
    }
}

/// What is known at a frequency of the statement.
struct Knot {
    omega: f64,
    energy: f64,
    width: f64,
}

/// The half width between the knots.
fn width_at(knots: &[Knot], omega: f64) -> Option<f64> {
    let near = |k: &&Knot| (k.omega - omega).abs() <= 1e-9 * omega.abs();
    if let Some(knot) = knots.iter().find(near) {
        return Some(knot.width);
    }
    let next = knots.partition_point(|k| k.omega < omega);
    let (a, b) = (knots.get(next.checked_sub(1)?)?, knots.get(next)?);
    let s = (omega - a.omega) / (b.omega - a.omega);
    Some(a.width + s * (b.width - a.width))
}

/// Whether a family has one energy at each frequency.
fn is_graph(family: &StoredFamily) -> bool {
    let mut spans = vec![];
    for branch in branches(family) {
        let orbits = of_branch(family, branch).filter(|p| p.orbit.is_some());
        let omega: Vec<f64> = orbits.map(|p| p.omega).collect();
        let goes = |sign: f64| omega.windows(2).all(|w| sign * (w[1] - w[0]) > 0.0);
        match omega[..] {
            [] => {}
            [first, .., last] if goes(1.0) || goes(-1.0) => {
                spans.push((first.min(last), first.max(last)));
            }
            [only] => spans.push((only, only)),
            _ => return false,
        }
    }
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    spans.windows(2).all(|w| w[1].0 >= w[0].1)
}

/// What is drawn of a statement.
enum Shape {
    /// Branch, and a line of frequencies, lower and upper energies.
    Band(usize, Vec<(f64, [f64; 2])>),
    /// Frequency, lower and upper energy.
    Bar(f64, [f64; 2]),
}

fn around(energy: f64, width: f64) -> [f64; 2] {
    [energy * (1.0 - width), energy * (1.0 + width)]
}

/// Bands along the branches, or bars.
fn shapes(family: &StoredFamily, reach: Reach) -> Vec<Shape> {
    let knots = family.statement.as_ref().map(|s| reach.knots(s)).unwrap_or_default();
    if knots.iter().all(|k| k.width < THIN) {
        return vec![];
    }
    if !is_graph(family) {
        return knots.iter().map(|k| Shape::Bar(k.omega, around(k.energy, k.width))).collect();
    }
    let mut bands = vec![];
    for branch in branches(family) {
        for run in runs(family, branch, &|o| o.energy.is_finite().then_some(o.energy)) {
            let ends = |&(omega, energy): &(f64, f64)| {
                width_at(&knots, omega).map(|width| (omega, around(energy, width)))
            };
            let known: Vec<_> = run.iter().map(ends).collect();
            let parts = known.split(Option::is_none).filter(|part| part.len() > 1);
            bands.extend(parts.map(|p| Shape::Band(branch, p.iter().flatten().copied().collect())));
        }
    }
    bands
}

/// Energies that a picture must have room for; on a logarithmic axis not all of what is below the least of the orbits.
pub(in crate::report) fn reached(family: &StoredFamily, least: f64, logarithmic: bool) -> Vec<f64> {
    let ends = Reach::BOTH.into_iter().flat_map(|reach| shapes(family, reach));
    let ends = ends.flat_map(|shape| match shape {
        Shape::Band(_, points) => points.into_iter().flat_map(|p| p.1).collect::<Vec<f64>>(),
        Shape::Bar(_, ends) => ends.to_vec(),
    });
    ends.map(|e| if logarithmic { e.max(LOWEST * least) } else { e }).collect()
}

/// Draw what is stated about the energies, in the colours of the branches and in that of the family; `scaled` leads to the
/// vertical axis.
pub(in crate::report) fn draw_errors(
    chart: &mut Chart,
    family: &StoredFamily,
    (colour, ink): (&dyn Fn(usize) -> RGBColor, RGBColor),
    scaled: &dyn Fn(f64) -> f64,
) {
    // a logarithm of what is not positive lies below every frame
    let scaled = |e: f64| scaled(e.max(f64::MIN_POSITIVE));
    let light = !shapes(family, Reach::Everything).is_empty();
    for reach in Reach::BOTH {
        for shape in shapes(family, reach) {
            match shape {
                Shape::Band(branch, points) => {
                    let lower = points.iter().map(|p| (p.0, scaled(p.1[0])));
                    let upper = points.iter().rev().map(|p| (p.0, scaled(p.1[1])));
                    let share = match reach {
                        Reach::Numerical if light => 1.0 - (1.0 - DARK) / (1.0 - LIGHT),
                        _ => reach.share(),
                    };
                    let style = colour(branch).mix(share).filled();
                    chart.area(lower.chain(upper).collect(), style);
                }
                // thin with caps for everything, thick without for what is numerical
                Shape::Bar(omega, ends) => {
                    let capped = reach == Reach::Everything;
                    let style = line(bar_colour(reach, ink), if capped { 1.0 } else { 2.6 });
                    chart.bar(omega, ends.map(scaled), style, capped);
                }
            }
        }
    }
}

/// Thin strokes need more colour than areas.
fn bar_colour(reach: Reach, ink: RGBColor) -> RGBColor {
    tint(ink, if reach == Reach::Everything { 0.6 } else { 0.8 })
}

/// Whether the viscosity was changed and does nowhere more than the rest.
fn viscosity_is_within(family: &StoredFamily) -> bool {
    let known = family.statement.as_ref().and_then(|s| s.of(Changed::HalfViscosity));
    known.is_some_and(|v| v.energy.iter().any(|e| e.is_finite()))
        && shapes(family, Reach::Everything).is_empty()
}

/// What the legend says of the statements of some families with their colours; nothing if there are none.
pub(in crate::report) fn error_entries(families: &[(&StoredFamily, RGBColor)]) -> Vec<Entry> {
    // those of several families share an entry
    let common = |colours: &[RGBColor]| if let [only] = colours { *only } else { INK };
    let stated = || families.iter().filter(|(f, _)| f.statement.is_some());
    let within = stated().all(|(f, _)| viscosity_is_within(f));
    let of_modes = |v: &Variation| v.changed == Changed::MoreModes;
    let is_of_modes =
        |f: &StoredFamily| f.statement.as_ref().is_some_and(|s| s.variations.iter().all(of_modes));
    let all_of_modes = stated().all(|(f, _)| is_of_modes(f));
    let (mut bands, mut bars): (Vec<Entry>, Vec<Entry>) = (vec![], vec![]);
    for reach in Reach::BOTH.into_iter().rev() {
        let (mut of_bands, mut of_bars) = (vec![], vec![]);
        for (family, colour) in families {
            match shapes(family, reach).first() {
                Some(Shape::Band(..)) => of_bands.push(*colour),
                Some(Shape::Bar(..)) => of_bars.push(*colour),
                None => {}
            }
        }
        let name = match reach {
            Reach::Numerical if all_of_modes => MODES,
            Reach::Numerical if within => WITHIN,
            _ => reach.name(),
        };
        if !of_bands.is_empty() {
            bands.push(entry(name, tint(common(&of_bands), reach.share()), Mark::Patch));
        }
        if !of_bars.is_empty() {
            bars.push(entry(name, bar_colour(reach, common(&of_bars)), reach.bar()));
        }
    }
    let mut entries = [bands, bars].concat();
    if !entries.is_empty() {
        entries.insert(0, entry("error of the energy:", INK, Mark::Nothing));
    }
    let is_open =
        |f: &&StoredFamily| f.outline().solver == Solver::Viscous && f.statement.is_none();
    if families.iter().map(|(f, _)| f).any(is_open) {
        entries.push(entry("no statement of the error (--quick)", INK, Mark::Nothing));
    }
    entries
}
