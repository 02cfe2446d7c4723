//! Bands, lines and dots of an overlay.

use super::scene::{Look, Scene, is_response};
use crate::records::Solver;
use crate::report::crosscheck::{DASH, dash, parted};
use crate::report::families::{Axis, draw_errors, pieces, runs};
use crate::report::figure::{
    Chart, Drawn, Frame, INK, Mark, clipped, draw_dashes, draw_line, flat, line, px, symbols,
};
use crate::store::StoredFamily;

/// Distance between the marks of a curve.
const SPACING: f64 = 42.0;

/// The panel, its frame, and what leads to its vertical axis.
struct Sheet<'s, 'a, 'b> {
    chart: &'s mut Chart<'a, 'b>,
    frame: Frame,
    scene: &'s Scene<'s>,
    scaled: &'s dyn Fn(f64) -> f64,
}

/// Bands first, lines above them, dots on top.
pub(super) fn draw(chart: &mut Chart, scene: &Scene, scaled: &dyn Fn(f64) -> f64) -> Drawn {
    let frame = (chart.x_range(), chart.y_range());
    let mut sheet = Sheet { chart, frame, scene, scaled };
    if scene.axis == Axis::Energy {
        for curve in &scene.curves {
            draw_errors(sheet.chart, curve.family, (&|_| curve.colour, curve.colour), scaled)?;
        }
    }
    for layer in Layer::ALL {
        for (family, branch, look) in &scene.branches {
            match (layer, look) {
                (Layer::Responses, Look::Response(..)) => sheet.response(family, *branch, *look)?,
                (Layer::Thin, Look::ThinResponse(..)) => sheet.series(family, *branch, *look)?,
                (Layer::Series, Look::Backbone(..)) => sheet.series(family, *branch, *look)?,
                (Layer::Curves, Look::Curve(_)) => sheet.curve(family, *branch, *look)?,
                (Layer::Marks, Look::Curve(k)) => sheet.marks(family, *branch, *k)?,
                (Layer::Ridge, Look::Response(..) | Look::ThinResponse(..)) if *branch == 0 => {
                    sheet.ridge(family)?;
                }
                (Layer::Dots, Look::Checked) => sheet.dots(family, *branch, *look)?,
                _ => {}
            }
        }
    }
    match scene.axis {
        Axis::Energy => sheet.series_checked(),
        Axis::Amplitude => Ok(()),
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

impl Sheet<'_, '_, '_> {
    fn flat(&self, points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        points.into_iter().map(|(x, v)| (x, (self.scaled)(v))).collect()
    }

    fn holds(&self, p: &(f64, f64)) -> bool {
        self.frame.0.contains(&p.0) && self.frame.1.contains(&p.1)
    }

    /// A forced response, stable and unstable.
    fn response(&mut self, family: &StoredFamily, branch: usize, look: Look) -> Drawn {
        let colour = self.scene.colour(look);
        for piece in pieces(family, branch, &|o| self.scene.value(o)) {
            for points in clipped(&self.flat(piece.points), &self.frame) {
                match piece.stable {
                    Some(false) => draw_dashes(self.chart, points, line(colour, 1.3))?,
                    _ => draw_line(self.chart, points, line(colour, 2.0))?,
                }
            }
        }
        Ok(())
    }

    /// Solutions of harmonic balance: a point alone is a dash.
    fn series(&mut self, family: &StoredFamily, branch: usize, look: Look) -> Drawn {
        let width = if is_response(&look) { 0.8 } else { 1.2 };
        let style = line(self.scene.colour(look), width);
        let dash_width = DASH * (self.frame.0.end - self.frame.0.start);
        let all: Vec<(f64, f64)> = self.scene.points(family, branch).collect();
        let parts = match look {
            Look::Backbone(_, false) => vec![all],
            _ => parted(&all),
        };
        for part in parts {
            for points in clipped(&self.flat(dash(part, dash_width)), &self.frame) {
                draw_line(self.chart, points, style)?;
            }
        }
        Ok(())
    }

    /// The pieces of a curve on the panel.
    fn parts(&self, family: &StoredFamily, branch: usize) -> Vec<Vec<(f64, f64)>> {
        let series = family.outline().solver == Solver::HarmonicBalance;
        let parts = match series && family.outline().is_point_by_point() {
            true => parted(&self.scene.points(family, branch).collect::<Vec<_>>()),
            false => runs(family, branch, &|o| self.scene.value(o)),
        };
        parts.into_iter().map(|part| self.flat(part)).collect()
    }

    /// A curve with a name of its own.
    fn curve(&mut self, family: &StoredFamily, branch: usize, look: Look) -> Drawn {
        let style = line(self.scene.colour(look), 1.4);
        for part in self.parts(family, branch) {
            for points in clipped(&part, &self.frame) {
                draw_line(self.chart, points, style)?;
            }
        }
        Ok(())
    }

    /// Its marks, here and there along it; those of different curves begin at different places.
    fn marks(&mut self, family: &StoredFamily, branch: usize, k: usize) -> Drawn {
        let curve = &self.scene.curves[k];
        let begin = SPACING * (0.5 + 0.37 * k as f64).fract();
        let mut shown = vec![];
        {
            let (_, place) = flat(self.chart);
            for part in self.parts(family, branch) {
                let visible: Vec<_> = part.into_iter().filter(|p| self.holds(p)).collect();
                shown.extend(spaced(&visible, &place, begin));
            }
        }
        symbols(self.chart, shown, *curve.mark, curve.colour)
    }

    /// The peaks of a set of responses.
    fn ridge(&mut self, family: &StoredFamily) -> Drawn {
        for run in self.scene.ridge(family) {
            let points = self.flat(run);
            for part in clipped(&points, &self.frame) {
                draw_dashes(self.chart, part, line(INK, 1.0))?;
            }
            let inside: Vec<_> = points.into_iter().filter(|p| self.holds(p)).collect();
            symbols(self.chart, inside, Mark::Diamond, INK)?;
        }
        Ok(())
    }

    /// Series that were checked and that no other file draws.
    fn series_checked(&mut self) -> Drawn {
        let points = self.flat(self.scene.checked_series());
        let inside: Vec<_> = points.into_iter().filter(|p| self.holds(p)).collect();
        symbols(self.chart, inside, Mark::Circle, INK)
    }

    /// Orbits one by one.
    fn dots(&mut self, family: &StoredFamily, branch: usize, look: Look) -> Drawn {
        let points = self.flat(self.scene.points(family, branch).collect());
        let inside = points.into_iter().filter(|p| self.holds(p));
        symbols(self.chart, inside, Mark::Dot, self.scene.colour(look))
    }
}

/// Some points of a line, at least one, at a distance on the paper.
fn spaced(
    points: &[(f64, f64)],
    place: &dyn Fn((f64, f64)) -> (i32, i32),
    begin: f64,
) -> Vec<(f64, f64)> {
    let mut left = begin;
    let mut before: Option<(i32, i32)> = None;
    let mut chosen = vec![];
    for &point in points {
        let here = place(point);
        if let Some((x, y)) = before {
            left -= f64::from(here.0 - x).hypot(f64::from(here.1 - y)) / f64::from(px(1.0));
        }
        before = Some(here);
        if left <= 0.0 {
            chosen.push(point);
            left = SPACING;
        }
    }
    if chosen.is_empty() {
        chosen.extend(points.get(points.len() / 2));
    }
    chosen
}
