//! What an overlay shows, by its looks, and the colours that tell branches apart.

use plotters::prelude::RGBColor;

use super::curves::{Curve, curves};
use crate::records::{Branch, OrbitRecord, Peak, Solver, Way};
use crate::report::families::{Axis, branches, of_branch};
use crate::report::figure::LINES;
use crate::store::StoredFamily;

/// How the curves and dots of a branch are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Look {
    /// Forced response by shooting, of a damping ratio in percent; which of the files of such.
    Response(Option<f64>, usize),
    /// Forced response by harmonic balance.
    ThinResponse(Option<f64>, usize),
    /// Backbone by harmonic balance, of a number of harmonics; whether its points are a grid of frequencies.
    Backbone(Option<usize>, bool),
    /// Orbits found from harmonic balance.
    Checked,
    /// Free orbits by shooting, and series beside those of another file: a curve of its own.
    Curve(usize),
}

fn look(family: &StoredFamily, branch: usize, curve: Option<usize>, file: usize) -> Look {
    if let Some(curve) = curve {
        return Look::Curve(curve);
    }
    let known = family.branches.get(branch);
    let ratio = known.and_then(Branch::percent);
    let outline = family.outline();
    match (outline.solver, outline.way) {
        (Solver::HarmonicBalance, Way::Response) => Look::ThinResponse(ratio, file),
        (Solver::HarmonicBalance, way) => {
            Look::Backbone(known.and_then(Branch::harmonics), way == Way::Sequential)
        }
        (Solver::Shooting | Solver::Viscous, _) => Look::Response(ratio, file),
        (Solver::Check, _) => Look::Checked,
    }
}

/// A colour on a scale through some anchors, `s ∈ [0, 1]`.
fn scale(anchors: &[[u8; 3]], s: f64) -> RGBColor {
    let x = s.clamp(0.0, 1.0) * (anchors.len() - 1) as f64;
    let i = (x as usize).min(anchors.len().saturating_sub(2));
    let f = x - i as f64;
    let [a, b] = [anchors[i], anchors[(i + 1).min(anchors.len() - 1)]];
    let mix = |c: usize| (f64::from(a[c]) * (1.0 - f) + f64::from(b[c]) * f).round() as u8;
    RGBColor(mix(0), mix(1), mix(2))
}

/// Numbers of harmonics: blue to green.
const HARMONICS: [[u8; 3]; 4] = [[130, 170, 235], [30, 105, 190], [0, 150, 160], [0, 110, 50]];
/// Damping ratios: grey to orange; of a second file, and so on, other scales.
const RATIOS: [[[u8; 3]; 4]; 4] = [
    [[105, 105, 112], [172, 172, 178], [240, 180, 105], [215, 95, 0]],
    [[40, 60, 110], [70, 110, 175], [110, 165, 225], [0, 90, 200]],
    [[30, 80, 60], [70, 140, 105], [120, 190, 140], [0, 125, 70]],
    [[85, 40, 95], [140, 85, 155], [195, 140, 205], [150, 30, 140]],
];
/// The colour of a response without a ratio on each scale.
const UNNAMED: f64 = 1.0;

/// Where the `k`-th of `n` stands on a scale; one alone has the end that is easier to see.
fn standing(k: usize, n: usize) -> f64 {
    if n < 2 { 1.0 } else { k as f64 / (n - 1) as f64 }
}

/// Numbers that occur, ascending.
fn ascending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// All that is drawn, with the colours' scales.
pub(super) struct Scene<'f> {
    pub branches: Vec<(&'f StoredFamily, usize, Look)>,
    pub harmonics: Vec<f64>,
    pub ratios: Vec<f64>,
    pub curves: Vec<Curve<'f>>,
    pub axis: Axis,
}

impl<'f> Scene<'f> {
    /// `title` begins the titles of all families.
    pub fn new(families: &'f [StoredFamily], axis: Axis, title: &str) -> Self {
        let curves = curves(families, title);
        let of = |f: &'f StoredFamily| {
            let curve = |b: usize| curves.iter().position(|c| c.holds(f, b));
            let before = families.iter().take_while(|g| !std::ptr::eq(*g, f));
            let file = before.filter(|g| is_of_responses(f) && are_drawn_alike(g, f)).count();
            branches(f).into_iter().map(|b| (f, b, look(f, b, curve(b), file))).collect::<Vec<_>>()
        };
        let branches: Vec<_> = families.iter().flat_map(of).collect();
        let harmonics = branches.iter().filter_map(|(_, _, look)| match look {
            Look::Backbone(n_h, _) => n_h.map(|n| n as f64),
            _ => None,
        });
        let ratios = branches.iter().filter_map(|(_, _, look)| match look {
            Look::Response(ratio, _) | Look::ThinResponse(ratio, _) => *ratio,
            _ => None,
        });
        let (harmonics, ratios) = (ascending(harmonics), ascending(ratios));
        Scene { branches, harmonics, ratios, curves, axis }
    }

    pub fn colour(&self, look: Look) -> RGBColor {
        let on = |anchors: &[[u8; 3]], all: &[f64], value: Option<f64>| {
            let k = value.and_then(|v| all.iter().position(|&o| o == v));
            k.map_or(LINES[4], |k| scale(anchors, standing(k, all.len())))
        };
        match look {
            Look::Response(None, file) | Look::ThinResponse(None, file) if file > 0 => {
                scale(&RATIOS[file % RATIOS.len()], UNNAMED)
            }
            Look::Response(ratio, file) | Look::ThinResponse(ratio, file) => {
                on(&RATIOS[file % RATIOS.len()], &self.ratios, ratio)
            }
            Look::Backbone(n_h, _) => on(&HARMONICS, &self.harmonics, n_h.map(|n| n as f64)),
            Look::Checked => RGBColor(0, 0, 0),
            Look::Curve(k) => self.curves[k].colour,
        }
    }

    /// What is drawn of an orbit: a logarithm may be asked for.
    pub fn value(&self, orbit: &OrbitRecord) -> Option<f64> {
        let value = self.axis.of(orbit);
        (value.is_finite() && value > 0.0).then_some(value)
    }

    /// Frequency and value of the orbits of a branch.
    pub fn points(&self, family: &StoredFamily, branch: usize) -> impl Iterator<Item = (f64, f64)> {
        let orbits = of_branch(family, branch).filter_map(|p| Some((p.omega, p.orbit.as_ref()?)));
        orbits.filter_map(|(omega, orbit)| Some((omega, self.value(orbit)?)))
    }

    /// The highest peak of each response of a set, in the order of the damping, in runs of neighbours: a response without a peak parts the ridge. A response
    /// alone has a peak where there are others of its kind in other files.
    pub fn ridge(&self, family: &StoredFamily) -> Vec<Vec<(f64, f64)>> {
        // a sweep has peaks, and no ridge: its branches are one body's
        let swept = family.outline().way == Way::Sweep;
        let all = if swept { vec![] } else { family.peaks() };
        let highest = |branch: usize| {
            let of_branch = all.iter().filter(|p| p.branch == branch);
            of_branch.max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))
        };
        let value = |p: &Peak| match self.axis {
            Axis::Energy => p.energy,
            Axis::Amplitude => p.amplitude,
        };
        let mut responses = branches(family);
        if responses.len() < 2 && self.files() < 2 {
            return vec![];
        }
        let ratio = |b: &usize| family.branches.get(*b).and_then(Branch::percent);
        responses.sort_by(|a, b| ratio(b).unwrap_or(0.0).total_cmp(&ratio(a).unwrap_or(0.0)));
        let place = |b: &usize| highest(*b).map(|p| (p.omega, value(p)));
        let peaks: Vec<Option<(f64, f64)>> = responses.iter().map(place).collect();
        let runs = peaks.split(Option::is_none).filter(|run| !run.is_empty());
        runs.map(|run| run.iter().flatten().copied().collect()).collect()
    }

    /// In how many files there are responses of one kind.
    pub fn files(&self) -> usize {
        let file = |look: &Look| match look {
            Look::Response(_, file) | Look::ThinResponse(_, file) => file + 1,
            _ => 0,
        };
        self.branches.iter().map(|(_, _, look)| file(look)).max().unwrap_or(0)
    }

    /// The series whose points were checked, where no other file draws them: frequency and energy.
    pub(crate) fn checked_series(&self) -> Vec<(f64, f64)> {
        let drawn: Vec<(f64, f64)> = self
            .branches
            .iter()
            .flat_map(|(f, b, look)| match look {
                Look::Checked => vec![],
                _ => of_branch(f, *b)
                    .filter_map(|p| Some((p.omega, p.orbit.as_ref()?.energy)))
                    .collect(),
            })
            .collect();
        // what lies on another mark is drawn
        let is_near = |a: f64, b: f64, within: f64| (a - b).abs() <= within * b.abs();
        let is_drawn = |p: &(f64, f64)| {
            drawn.iter().any(|q| is_near(p.0, q.0, 1e-9) && is_near(p.1, q.1, 1e-2))
        };
        let checked = self.branches.iter().filter(|(_, _, look)| *look == Look::Checked);
        let rows = checked.flat_map(|(f, b, _)| of_branch(f, *b)).filter_map(|p| p.check.as_ref());
        let places =
            rows.map(|row| (row.omega, row.energy)).filter(|p| p.1.is_finite() && p.1 > 0.0);
        places.filter(|p| !is_drawn(p)).collect()
    }

    pub fn any(&self, wanted: fn(&Look) -> bool) -> bool {
        self.branches.iter().any(|(_, _, look)| wanted(look))
    }
}

pub(super) fn is_response(look: &Look) -> bool {
    matches!(look, Look::Response(..) | Look::ThinResponse(..))
}

fn is_of_responses(family: &StoredFamily) -> bool {
    family.outline().is_response()
}

/// Whether two families have lines of one kind, which colours alone tell apart: branches and sweeps have.
fn are_drawn_alike(a: &StoredFamily, b: &StoredFamily) -> bool {
    let (a, b) = (a.outline(), b.outline());
    let settles = |way: Way| matches!(way, Way::Response | Way::Sweep);
    a.solver == b.solver && (a.way == b.way || settles(a.way) && settles(b.way))
}
