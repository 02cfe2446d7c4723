//! Drawing: axes, colours, and one way to write a figure as SVG, PNG and PDF.
//!
//! plotters draws the SVG; the PNG is rasterised and the PDF made from that same SVG with the font that the program carries, so all
//! show the same and none needs fonts of the system.

mod chart;
mod clip;
mod colour;
mod legend;
mod mark;
mod panel;
mod pdf;
mod save;
mod scale;
mod sheet;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use thiserror::Error;

use crate::store::StoreError;

pub use chart::{Axis, Chart, Point};
use clip::clipped_area;
pub(crate) use clip::{Frame, clipped};
use colour::GRID;
pub use colour::{INK, LINES};
pub(crate) use colour::{SHADE, series_colour, tint, viridis};
pub use legend::{Entry, entry};
pub use mark::Mark;
pub(crate) use mark::symbol;
pub use save::{Drawing, Output, animate, save};
pub(crate) use scale::log_ticks;
pub use scale::range;
pub(crate) use sheet::Bar;
pub use sheet::{Cell, Legend, Sheet, Style};

static FONT: &[u8] = include_bytes!("../fonts/DejaVuSans.ttf");
const FAMILY: &str = "sans-serif";
/// plotters places everything on whole pixels: draw on a sheet this much finer than the picture.
const FINE: u32 = 8;

/// A drawing area.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// What the library draws a chart on.
type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A figure could not be made.
#[derive(Debug, Error)]
pub enum FigureError {
    /// Drawing failed.
    #[error("drawing: {0}")]
    Draw(String),
    /// Writing failed, or is not allowed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// There is nothing to draw.
    #[error("nothing to draw: {0}")]
    Empty(&'static str),
}

/// What drawing something gives.
pub type Drawn = Result<(), FigureError>;

impl FigureError {
    pub(super) fn draw(e: impl std::fmt::Display) -> Self {
        FigureError::Draw(e.to_string())
    }
}

/// A text style.
pub fn text(size: u32) -> TextStyle<'static> {
    (FAMILY, size * FINE).into_font().color(&INK)
}

/// A length of the picture in the pixels of the sheet.
pub fn px(length: f64) -> i32 {
    (length * f64::from(FINE)).round() as i32
}

/// A line of a given width.
pub fn line(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width(px(width).max(1) as u32)
}
