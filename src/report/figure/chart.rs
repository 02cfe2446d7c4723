//! A chart as data: two axes, and what lies on them. One renderer draws all of them (`panel.rs`).

use std::ops::Range;

use plotters::prelude::*;

use super::{Frame, Mark, line};

/// A point of a chart, in the units of its axes: of a logarithmic one the decimal logarithm.
pub type Point = (f64, f64);

/// How an axis is divided.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ticks {
    /// Numbers.
    Linear,
    /// The axis is a decimal logarithm; numbers.
    Logarithm,
    /// The same; powers of ten.
    Decades,
    /// Given places with names; without a name a short stroke.
    Named(Vec<(f64, String)>),
}

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Its name; empty: none.
    pub(super) label: String,
    /// Its ends.
    pub(super) range: Range<f64>,
    pub(super) ticks: Ticks,
}

impl Axis {
    fn new(label: impl Into<String>, range: Range<f64>, ticks: Ticks) -> Axis {
        Axis { label: label.into(), range, ticks }
    }

    /// Numbers.
    pub fn linear(label: impl Into<String>, range: Range<f64>) -> Axis {
        Axis::new(label, range, Ticks::Linear)
    }

    /// Numbers, or their decimal logarithms.
    pub fn scaled(label: impl Into<String>, range: Range<f64>, logarithmic: bool) -> Axis {
        Axis::new(label, range, if logarithmic { Ticks::Logarithm } else { Ticks::Linear })
    }

    /// Decimal logarithms over whole decades.
    pub fn decades(label: impl Into<String>, range: Range<f64>) -> Axis {
        Axis::new(label, range, Ticks::Decades)
    }

    /// Places with names.
    pub fn named(
        label: impl Into<String>,
        range: Range<f64>,
        mut ticks: Vec<(f64, String)>,
    ) -> Axis {
        ticks.retain(|(x, _)| range.contains(x));
        Axis::new(label, range, Ticks::Named(ticks))
    }
}

/// What lies on a chart.
pub(super) enum Layer {
    /// A line; with the lengths of dashes and gaps.
    Line(Vec<Point>, ShapeStyle, Option<(f64, f64)>),
    /// A filled area.
    Area(Vec<Point>, ShapeStyle),
    /// Filled rectangles, of two corners each.
    Cells(Vec<([Point; 2], RGBColor)>),
    /// Marks at points.
    Marks(Vec<Point>, Mark, RGBColor),
    /// Marks here and there along lines, so far apart, the first one so far from their beginning.
    Along(Vec<Vec<Point>>, Mark, RGBColor, [f64; 2]),
    /// Short strokes on the lower edge.
    Feet(Vec<f64>, RGBColor),
    /// An upright stroke between two heights, with caps or without.
    Bar(f64, [f64; 2], ShapeStyle, bool),
    /// Words beside a point.
    Words(Point, String),
    /// A name with a cross at a point.
    Pin(Point, String),
}

/// A chart.
pub struct Chart {
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// The same scale on both axes; the ranges are widened to fill it.
    pub(super) equal: bool,
    /// What lies under it covers it: no grid.
    pub(super) covered: bool,
    /// Below the grid.
    pub(super) under: Vec<Layer>,
    pub(super) layers: Vec<Layer>,
}

impl Chart {
    /// Axes with nothing on them.
    pub fn new(x: Axis, y: Axis) -> Chart {
        Chart { x, y, equal: false, covered: false, under: vec![], layers: vec![] }
    }

    /// The same scale on both axes.
    pub(crate) fn equal(self) -> Chart {
        Chart { equal: true, ..self }
    }

    /// Where it ends; of a chart with equal scales at least.
    pub(crate) fn frame(&self) -> Frame {
        (self.x.range.clone(), self.y.range.clone())
    }

    /// A full line.
    pub fn line(&mut self, points: Vec<Point>, colour: RGBColor, width: f64) {
        self.layers.push(Layer::Line(points, line(colour, width), None));
    }

    /// A dashed line.
    pub fn dashes(&mut self, points: Vec<Point>, colour: RGBColor, width: f64) {
        self.layers.push(Layer::Line(points, line(colour, width), Some((5.0, 3.5))));
    }

    /// A filled area.
    pub(crate) fn area(&mut self, outline: Vec<Point>, style: ShapeStyle) {
        self.layers.push(Layer::Area(outline, style));
    }

    /// Small marks.
    pub fn marks(&mut self, points: impl IntoIterator<Item = Point>, mark: Mark, colour: RGBColor) {
        self.layers.push(Layer::Marks(points.into_iter().collect(), mark, colour));
    }

    /// A line that bears marks.
    pub fn series(&mut self, points: &[Point], mark: Mark, colour: RGBColor) {
        self.line(points.to_vec(), colour, 1.4);
        self.marks(points.iter().copied(), mark, colour);
    }

    /// Marks here and there along lines.
    pub(crate) fn along(
        &mut self,
        lines: Vec<Vec<Point>>,
        (mark, colour): (Mark, RGBColor),
        spacing: [f64; 2],
    ) {
        self.layers.push(Layer::Along(lines, mark, colour, spacing));
    }

    /// Short strokes on the lower edge.
    pub(crate) fn feet(&mut self, x: Vec<f64>, colour: RGBColor) {
        self.layers.push(Layer::Feet(x, colour));
    }

    /// An upright stroke.
    pub(crate) fn bar(&mut self, x: f64, ends: [f64; 2], style: ShapeStyle, capped: bool) {
        self.layers.push(Layer::Bar(x, ends, style, capped));
    }

    /// Words beside a point.
    pub(crate) fn words(&mut self, at: Point, words: &str) {
        self.layers.push(Layer::Words(at, words.into()));
    }

    /// A cross with a name.
    pub(crate) fn pin(&mut self, at: Point, name: &str) {
        self.layers.push(Layer::Pin(at, name.into()));
    }

    /// Rectangles below the grid.
    pub(crate) fn ground(&mut self, cells: Vec<([Point; 2], RGBColor)>) {
        self.under.push(Layer::Cells(cells));
    }

    /// Rectangles that cover the chart.
    pub(crate) fn cover(&mut self, cells: Vec<([Point; 2], RGBColor)>) {
        self.covered = true;
        self.ground(cells);
    }
}
