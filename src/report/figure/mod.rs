//! Drawing: axes, colours, and one way to write a figure as SVG, PNG and PDF.
//!
//! plotters draws the SVG; the PNG is rasterised and the PDF made from that same SVG with the font that the program carries, so all
//! show the same and none needs fonts of the system.

mod clip;
mod colour;
mod legend;
mod logarithmic;
mod mark;
mod panel;
mod pdf;
mod save;
mod scale;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use thiserror::Error;

use crate::store::StoreError;

pub(crate) use clip::{Frame, clipped, clipped_area};
pub(crate) use colour::{GRID, SHADE, colour_bar, series_colour, tint, viridis};
pub use colour::{INK, LINES};
pub use legend::{Entry, legend, legend_above, legend_columns};
pub(crate) use logarithmic::semilog;
pub use logarithmic::{columns, loglog};
pub(crate) use mark::symbol;
pub use mark::{Mark, flat, symbols};
pub use panel::panel;
pub(crate) use panel::{Ground, equal_panel, panel_with};
pub use save::{DPI, Drawing, animate, save};
pub(crate) use scale::log_ticks;
pub use scale::range;

static FONT: &[u8] = include_bytes!("../fonts/DejaVuSans.ttf");
const FAMILY: &str = "sans-serif";
/// plotters places everything on whole pixels: draw on a sheet this much finer than the picture.
const FINE: u32 = 8;

/// A drawing area.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A chart with linear axes.
pub type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

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

/// Draw a figure; `draw` gets the white sheet.
pub fn svg(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> Result<String, FigureError> {
    // registering twice is harmless
    plotters::style::register_font(FAMILY, FontStyle::Normal, FONT)
        .map_err(|_| FigureError::Draw("the built-in font cannot be read".into()))?;
    let mut out = String::new();
    {
        let fine = (size.0 * FINE, size.1 * FINE);
        let root = SVGBackend::with_string(&mut out, fine).into_drawing_area();
        root.fill(&WHITE).map_err(FigureError::draw)?;
        draw(&root)?;
        root.present().map_err(FigureError::draw)?;
    }
    // the view box keeps the fine sheet; the picture has its own size
    let fine = format!("width=\"{}\" height=\"{}\"", size.0 * FINE, size.1 * FINE);
    Ok(out.replacen(&fine, &format!("width=\"{}\" height=\"{}\"", size.0, size.1), 1))
}

/// The title of a sheet: that of the scene, if it has one, and what is shown.
pub fn title(area: &Area, title: &str, what: &str) -> Drawn {
    let title: String = title.chars().filter(|c| !c.is_control()).take(90).collect();
    let name = if title.is_empty() { String::new() } else { format!("{title}: ") };
    area.draw(&Text::new(format!("{name}{what}"), (px(12.0), px(8.0)), text(16)))
        .map_err(FigureError::draw)
}

/// A full line through points of a chart.
pub fn draw_line(chart: &mut Chart, points: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    let path = PathElement::new(points, style);
    chart.draw_series(std::iter::once(path)).map(|_| ()).map_err(FigureError::draw)
}

/// An area of a chart, so far within its frame.
pub(crate) fn draw_area(chart: &mut Chart, outline: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    let outline = clipped_area(outline, &(chart.x_range(), chart.y_range()));
    if outline.len() < 3 {
        return Ok(());
    }
    let area = Polygon::new(outline, style);
    chart.draw_series(std::iter::once(area)).map(|_| ()).map_err(FigureError::draw)
}

/// A dashed line through points of a chart.
pub fn draw_dashes(chart: &mut Chart, points: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    let dashes = DashedLineSeries::new(points, px(5.0), px(3.5), style);
    chart.draw_series(dashes).map(|_| ()).map_err(FigureError::draw)
}
