//! Curves of an overlay that have a name of their own, and how they are told apart: by a colour and, without colours, by a mark.

use plotters::prelude::RGBColor;

use super::names::names;
use crate::records::{Branch, Solver};
use crate::report::families::branches;
use crate::report::figure::{LINES, Mark};
use crate::store::StoredFamily;

/// One after the other is given to the curves; a number without common divisor with that of the colours.
const MARKS: [Mark; 6] =
    [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Circle, Mark::Cross];

/// A family by shooting, or the series of a family with one number of harmonics.
pub(super) struct Curve<'f> {
    pub family: &'f StoredFamily,
    harmonics: Option<usize>,
    pub name: String,
    pub colour: RGBColor,
    pub mark: &'static Mark,
}

impl Curve<'_> {
    /// Whether a branch belongs to it.
    pub fn holds(&self, family: &StoredFamily, branch: usize) -> bool {
        std::ptr::eq(self.family, family) && self.harmonics == harmonics(family, branch)
    }
}

fn harmonics(family: &StoredFamily, branch: usize) -> Option<usize> {
    family.branches.get(branch).and_then(Branch::harmonics)
}

/// The curves of some families. Series of one kind have colours by their harmonics and are none.
pub(super) fn curves<'f>(families: &'f [StoredFamily], title: &str) -> Vec<Curve<'f>> {
    let solver = |f: &StoredFamily| f.outline().solver;
    let free = families.iter().filter(|f| !f.outline().is_response() && solver(f) != Solver::Check);
    let free: Vec<&StoredFamily> = free.collect();
    let names = names(&free, title);
    let is_series = |f: &StoredFamily| solver(f) == Solver::HarmonicBalance;
    let mut kinds = free.iter().zip(&names).filter(|(f, _)| is_series(f)).map(|(_, name)| name);
    let first = kinds.next();
    let alike = kinds.all(|name| Some(name) == first);
    let order = colours(families, alike && first.is_some());
    let mut curves: Vec<Curve> = vec![];
    for (family, name) in free.iter().zip(&names) {
        if alike && is_series(family) {
            continue;
        }
        let mut all: Vec<Option<usize>> =
            branches(family).into_iter().map(|b| harmonics(family, b)).collect();
        all.sort_unstable();
        all.dedup();
        for harmonics in all {
            let k = curves.len();
            curves.push(Curve {
                family,
                harmonics,
                name: match harmonics {
                    Some(n) => format!("{name}, N_h = {n}"),
                    None => name.clone(),
                },
                colour: order[k % order.len()],
                mark: &MARKS[k % MARKS.len()],
            });
        }
    }
    curves
}

/// Line colours, those last that resemble a scale in use: blue and green of series, orange and grey of responses.
fn colours(families: &[StoredFamily], series: bool) -> [RGBColor; 5] {
    let responses = families.iter().any(|f| f.outline().is_response());
    let mut order = [0, 1, 2, 3, 4];
    order.sort_by_key(|k| match k {
        0 | 2 => series,
        1 | 4 => responses,
        _ => false,
    });
    order.map(|k| LINES[k])
}
