//! The picture `overlay`: families of several files in one panel, energy or amplitude against frequency.

mod curves;
mod draw;
mod legend;
mod names;
mod scene;

use std::ops::Range;
use std::path::Path;

use super::families::{Axis, LOGARITHMIC, reached};
use super::figure::{
    self, Chart, Drawing, Entry, FigureError, INK, Legend, Mark, Sheet, entry, range,
};
use crate::store::{StoredFamily, StoredResonance};
use draw::draw;
use scene::Scene;

/// What a user may choose.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// What is shown over the frequency.
    pub axis: Axis,
    /// Its limits.
    pub value: Option<Range<f64>>,
    /// Limits of the frequency.
    pub frequency: Option<Range<f64>>,
    /// Places that are marked: frequency, energy or amplitude, name.
    pub points: Vec<(f64, f64, String)>,
    /// Tests of phase resonance, whose points are shown besides.
    pub tests: Vec<StoredResonance>,
}

impl Options {
    /// The points of a test.
    fn tested<'t>(&self, test: &'t StoredResonance) -> impl Iterator<Item = (f64, f64)> + use<'t> {
        let axis = self.axis;
        test.found.rows.iter().filter(|row| row.is_locked).map(move |row| match axis {
            Axis::Energy => (row.omega.mean, row.energy),
            Axis::Amplitude => (row.omega.mean, row.amplitude.mean),
        })
    }
}

/// How the points of tests are marked, one after the other.
const TESTED: [Mark; 3] = [Mark::Cross, Mark::Circle, Mark::Triangle];

/// Draw the families, to be written as `STEM.svg` and `STEM.png`.
pub fn picture(
    families: &[StoredFamily],
    options: &Options,
    stem: &Path,
) -> Result<Drawing<'static>, FigureError> {
    Ok(Drawing { stem: stem.to_owned(), sheet: overlay(families, options)? })
}

fn overlay(families: &[StoredFamily], options: &Options) -> Result<Sheet<'static>, FigureError> {
    let common = common_title(families);
    let scene = Scene::new(families, options.axis, &common);
    let checked = match options.axis {
        Axis::Energy => scene.checked_series(),
        Axis::Amplitude => vec![],
    };
    let all = || {
        let points = scene.branches.iter().flat_map(|(f, b, _)| scene.points(f, *b));
        points.chain(checked.iter().copied())
    };
    let marked = || {
        let named = options.points.iter().map(|(omega, value, _)| (*omega, *value));
        named.chain(options.tests.iter().flat_map(|test| options.tested(test)))
    };
    if all().next().is_none() {
        return Err(FigureError::Empty("the families hold no orbit"));
    }
    let x = options.frequency.clone();
    let x = x.unwrap_or_else(|| range(all().chain(marked()).map(|p| p.0)));
    let within = |v: f64| options.value.as_ref().is_none_or(|y| y.contains(&v));
    let shown: Vec<f64> =
        all().chain(marked()).filter(|p| x.contains(&p.0) && within(p.1)).map(|p| p.1).collect();
    if shown.is_empty() {
        return Err(FigureError::Empty("no orbit lies within these limits"));
    }
    let (y, logarithmic) = vertical(&scene, options, &shown);
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    let free: Vec<&StoredFamily> = families.iter().collect();
    let y = figure::Axis::scaled(options.axis.label(&free), y, logarithmic);
    let mut chart = Chart::new(figure::Axis::linear("frequency ω", x), y);
    draw(&mut chart, &scene, &scaled);
    for (omega, value, name) in options.points.iter().filter(|p| p.1 > 0.0) {
        chart.pin((*omega, scaled(*value)), name);
    }
    let mut measured: Vec<Entry> = vec![];
    for (test, mark) in options.tests.iter().zip(TESTED.into_iter().cycle()) {
        let points = options.tested(test).map(|(omega, value)| (omega, scaled(value)));
        chart.marks(points, mark, INK);
        let name = match test.head.title == common {
            true => "phase resonance".into(),
            false => format!("phase resonance: {}", test.head.title),
        };
        measured.push(entry(name, INK, mark));
    }
    let sheet = Sheet::new(&common, &format!("{} against frequency", options.axis.name()));
    let sheet = sheet.legend(Legend::Rows(measured));
    let sheet = legend::legends(&scene).into_iter().fold(sheet, Sheet::legend);
    Ok(sheet.row(600.0, vec![chart.into()]))
}

/// The range of the vertical axis, or of its logarithm, and whether it is the latter.
fn vertical(scene: &Scene, options: &Options, shown: &[f64]) -> (Range<f64>, bool) {
    let least = shown.iter().copied().fold(f64::INFINITY, f64::min);
    let ends = options.value.clone();
    let ends = ends.unwrap_or_else(|| least..shown.iter().copied().fold(0.0, f64::max));
    let logarithmic = ends.start > 0.0 && ends.end > LOGARITHMIC * ends.start;
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    if options.value.is_some() {
        return (scaled(ends.start)..scaled(ends.end), logarithmic);
    }
    let mut all = vec![ends.start, ends.end];
    if options.axis == Axis::Energy {
        let stated = scene.curves.iter().flat_map(|c| reached(c.family, least, logarithmic));
        all.extend(stated);
    }
    (range(all.into_iter().map(scaled)), logarithmic)
}

/// What the titles of all families begin with, up to a comma.
fn common_title(families: &[StoredFamily]) -> String {
    let [first, rest @ ..] = families else { return String::new() };
    let first = &first.title;
    if rest.iter().all(|f| f.title == *first) {
        return first.clone();
    }
    let commas = first.match_indices([',', ':']).map(|(i, _)| i);
    let shared = |i: &usize| rest.iter().all(|f| f.title.get(..=*i) == first.get(..=*i));
    commas.rev().find(shared).map_or(String::new(), |i| first[..i].to_owned())
}
