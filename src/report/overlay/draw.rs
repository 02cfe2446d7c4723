//! Bands, lines and dots of an overlay.

use super::scene::{Look, Scene, is_response};
use crate::records::Solver;
use crate::report::crosscheck::{DASH, dash, parted};
use crate::report::families::{Axis, draw_errors, pieces, runs};
use crate::report::figure::{Chart, INK, Mark};
use crate::store::StoredFamily;

/// Distance between the marks of a curve.
const SPACING: f64 = 42.0;

/// A chart, and what leads to its vertical axis.
struct Sheet<'s> {
    chart: &'s mut Chart,
    scene: &'s Scene<'s>,
    scaled: &'s dyn Fn(f64) -> f64,
}

/// Bands first, lines above them, dots on top.
pub(super) fn draw(chart: &mut Chart, scene: &Scene, scaled: &dyn Fn(f64) -> f64) {
    let sheet = &mut Sheet { chart, scene, scaled };
    if scene.axis == Axis::Energy {
        for curve in &scene.curves {
            draw_errors(sheet.chart, curve.family, (&|_| curve.colour, curve.colour), scaled);
        }
    }
    for layer in Layer::ALL {
        for (family, branch, look) in &scene.branches {
            match (layer, look) {
                (Layer::Responses, Look::Response(..)) => sheet.response(family, *branch, *look),
                (Layer::Thin, Look::ThinResponse(..)) => sheet.series(family, *branch, *look),
                (Layer::Series, Look::Backbone(..)) => sheet.series(family, *branch, *look),
                (Layer::Curves, Look::Curve(_)) => sheet.curve(family, *branch, *look),
                (Layer::Marks, Look::Curve(k)) => sheet.marks(family, *branch, *k),
                (Layer::Ridge, Look::Response(..) | Look::ThinResponse(..)) if *branch == 0 => {
                    sheet.ridge(family);
                }
                (Layer::Dots, Look::Checked) => sheet.dots(family, *branch, *look),
                _ => {}
            }
        }
    }
    // series that were checked and that no other file draws
    if scene.axis == Axis::Energy {
        let points = sheet.flat(scene.checked_series());
        sheet.chart.marks(points, Mark::Circle, INK);
    }
}

/// What lies on what.
#[derive(Clone, Copy)]
enum Layer {
    Responses,
    Thin,
    Series,
    Curves,
    Marks,
    Ridge,
    Dots,
}

impl Layer {
    const ALL: [Layer; 7] = [
        Layer::Responses,
        Layer::Thin,
        Layer::Series,
        Layer::Curves,
        Layer::Marks,
        Layer::Ridge,
        Layer::Dots,
    ];
}

impl Sheet<'_> {
    fn flat(&self, points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        points.into_iter().map(|(x, v)| (x, (self.scaled)(v))).collect()
    }

    /// A forced response, stable and unstable.
    fn response(&mut self, family: &StoredFamily, branch: usize, look: Look) {
        let colour = self.scene.colour(look);
        for piece in pieces(family, branch, &|o| self.scene.value(o)) {
            let points = self.flat(piece.points);
            match piece.stable {
                Some(false) => self.chart.dashes(points, colour, 1.3),
                _ => self.chart.line(points, colour, 2.0),
            }
        }
    }

    /// Solutions of harmonic balance: a point alone is a dash.
    fn series(&mut self, family: &StoredFamily, branch: usize, look: Look) {
        let width = if is_response(&look) { 0.8 } else { 1.2 };
        let (x, _) = self.chart.frame();
        let all: Vec<(f64, f64)> = self.scene.points(family, branch).collect();
        let parts = match look {
            Look::Backbone(_, false) => vec![all],
            _ => parted(&all),
        };
        for part in parts {
            let points = self.flat(dash(part, DASH * (x.end - x.start)));
            self.chart.line(points, self.scene.colour(look), width);
        }
    }

    /// The pieces of a curve on the chart.
    fn parts(&self, family: &StoredFamily, branch: usize) -> Vec<Vec<(f64, f64)>> {
        let series = family.outline().solver == Solver::HarmonicBalance;
        let parts = match series && family.outline().is_point_by_point() {
            true => parted(&self.scene.points(family, branch).collect::<Vec<_>>()),
            false => runs(family, branch, &|o| self.scene.value(o)),
        };
        parts.into_iter().map(|part| self.flat(part)).collect()
    }

    /// A curve with a name of its own.
    fn curve(&mut self, family: &StoredFamily, branch: usize, look: Look) {
        for part in self.parts(family, branch) {
            self.chart.line(part, self.scene.colour(look), 1.4);
        }
    }

    /// Its marks, here and there along it; those of different curves begin at different places.
    fn marks(&mut self, family: &StoredFamily, branch: usize, k: usize) {
        let curve = &self.scene.curves[k];
        let begin = SPACING * (0.5 + 0.37 * k as f64).fract();
        let parts = self.parts(family, branch);
        self.chart.along(parts, (*curve.mark, curve.colour), [SPACING, begin]);
    }

    /// The peaks of a set of responses.
    fn ridge(&mut self, family: &StoredFamily) {
        for run in self.scene.ridge(family) {
            let points = self.flat(run);
            self.chart.dashes(points.clone(), INK, 1.0);
            self.chart.marks(points, Mark::Diamond, INK);
        }
    }

    /// Orbits one by one.
    fn dots(&mut self, family: &StoredFamily, branch: usize, look: Look) {
        let points = self.flat(self.scene.points(family, branch).collect());
        self.chart.marks(points, Mark::Dot, self.scene.colour(look));
    }
}
