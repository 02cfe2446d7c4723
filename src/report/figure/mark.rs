//! Marks: what stands at a point of a panel, and before a name in a legend.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, line, px};

/// What stands before a name in a legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A full line.
    Line,
    /// A thin line.
    Thin,
    /// A dashed line.
    Dashes,
    /// A full line that bears marks.
    Bearing(&'static Mark),
    /// A filled patch.
    Patch,
    /// A filled dot.
    Dot,
    /// An open circle.
    Ring,
    /// A filled disc that is seen on a line.
    Disc,
    /// An open circle that is seen on a line.
    Circle,
    /// A filled square.
    Square,
    /// A filled triangle.
    Triangle,
    /// A filled triangle that points down.
    Falling,
    /// A filled diamond.
    Diamond,
    /// A cross.
    Cross,
    /// A small cross, where many lie side by side.
    Speck,
    /// A short stroke, as on the edge of a panel.
    Tick,
    /// A thin upright stroke with caps.
    Bar,
    /// A thick upright stroke.
    Beam,
    /// The name alone.
    Nothing,
}

impl Mark {
    /// Length of the sample in a legend.
    pub(super) fn sample(self) -> i32 {
        match self {
            Mark::Line | Mark::Thin | Mark::Dashes | Mark::Bearing(_) | Mark::Patch => px(24.0),
            Mark::Nothing => 0,
            _ => px(9.0),
        }
    }
}

/// A small mark at a pixel of an area; marks that are drawn as lines are left out.
pub(crate) fn symbol(area: &Area, (x, y): (i32, i32), mark: Mark, colour: RGBColor) -> Drawn {
    let at = |corners: &[(f64, f64)]| -> Vec<(i32, i32)> {
        corners.iter().map(|(dx, dy)| (x + px(*dx), y + px(*dy))).collect()
    };
    let filled = |corners: &[(f64, f64)]| {
        // a white rim keeps neighbours and lines apart from it
        let closed: Vec<_> = corners.iter().chain(&corners[..2]).copied().collect();
        area.draw(&PathElement::new(at(&closed), line(WHITE, 1.6))).map_err(FigureError::draw)?;
        area.draw(&Polygon::new(at(corners), colour.filled())).map_err(FigureError::draw)
    };
    let stroke = |ends: &[(f64, f64)], width: f64| {
        area.draw(&PathElement::new(at(ends), line(colour, width))).map_err(FigureError::draw)
    };
    match mark {
        Mark::Dot => {
            area.draw(&Circle::new((x, y), px(2.2), colour.filled())).map_err(FigureError::draw)
        }
        Mark::Ring => {
            area.draw(&Circle::new((x, y), px(2.1), WHITE.filled())).map_err(FigureError::draw)?;
            area.draw(&Circle::new((x, y), px(2.1), line(colour, 1.0))).map_err(FigureError::draw)
        }
        Mark::Disc => {
            area.draw(&Circle::new((x, y), px(4.2), WHITE.filled())).map_err(FigureError::draw)?;
            area.draw(&Circle::new((x, y), px(3.5), colour.filled())).map_err(FigureError::draw)
        }
        Mark::Circle => {
            area.draw(&Circle::new((x, y), px(3.4), WHITE.filled())).map_err(FigureError::draw)?;
            area.draw(&Circle::new((x, y), px(3.4), line(colour, 1.4))).map_err(FigureError::draw)
        }
        Mark::Bearing(mark) => symbol(area, (x, y), *mark, colour),
        Mark::Square => filled(&[(-3.2, -3.2), (3.2, -3.2), (3.2, 3.2), (-3.2, 3.2)]),
        Mark::Triangle => filled(&[(0.0, -5.2), (4.5, 3.2), (-4.5, 3.2)]),
        Mark::Falling => filled(&[(0.0, 5.2), (4.5, -3.2), (-4.5, -3.2)]),
        Mark::Diamond => filled(&[(0.0, -4.8), (4.0, 0.0), (0.0, 4.8), (-4.0, 0.0)]),
        Mark::Cross => {
            stroke(&[(-4.0, -4.0), (4.0, 4.0)], 1.6)?;
            stroke(&[(-4.0, 4.0), (4.0, -4.0)], 1.6)
        }
        Mark::Speck => {
            stroke(&[(-2.4, -2.4), (2.4, 2.4)], 1.1)?;
            stroke(&[(-2.4, 2.4), (2.4, -2.4)], 1.1)
        }
        Mark::Bar => {
            stroke(&[(0.0, -5.0), (0.0, 5.0)], 1.0)?;
            stroke(&[(-3.0, -5.0), (3.0, -5.0)], 1.0)?;
            stroke(&[(-3.0, 5.0), (3.0, 5.0)], 1.0)
        }
        Mark::Beam => stroke(&[(0.0, -5.0), (0.0, 5.0)], 2.6),
        Mark::Tick => stroke(&[(0.0, -4.0), (0.0, 4.0)], 1.2),
        Mark::Line | Mark::Thin | Mark::Dashes | Mark::Patch | Mark::Nothing => Ok(()),
    }
}
