//! Drawing: axes, colours, and one way to write a figure as SVG and PNG.
//!
//! plotters draws the SVG; the PNG is rasterised from that same SVG with the font that the program carries, so both
//! show the same and neither needs fonts of the system.

use std::path::PathBuf;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

use crate::store::{MARK, Outputs, StoreError, beside, replace};

static FONT: &[u8] = include_bytes!("fonts/DejaVuSans.ttf");
const FAMILY: &str = "sans-serif";
/// plotters places everything on whole pixels: draw on a sheet this much finer than the picture.
const FINE: u32 = 8;
/// Dots per inch of a PNG where nobody asks for others.
pub const DPI: u16 = 192;
/// Units of length of a picture in an inch.
const UNITS: f32 = 96.0;

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

impl FigureError {
    pub(super) fn draw(e: impl std::fmt::Display) -> Self {
        FigureError::Draw(e.to_string())
    }
}

/// Ink of axes and text.
pub const INK: RGBColor = RGBColor(40, 40, 45);
/// Fine lines of the grid.
pub const GRID: RGBColor = RGBColor(228, 228, 232);
/// Contact intervals.
pub const SHADE: RGBColor = RGBColor(236, 231, 218);
/// Line colours, distinguishable in grey and by colour-blind readers (Okabe–Ito).
pub const LINES: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 86, 86),
];

/// The colour map viridis, `s ∈ [0, 1]`.
pub fn viridis(s: f64) -> RGBColor {
    const TABLE: [[u8; 3]; 9] = [
        [68, 1, 84],
        [71, 44, 122],
        [59, 81, 139],
        [44, 113, 142],
        [33, 144, 141],
        [39, 173, 129],
        [92, 200, 99],
        [170, 220, 50],
        [253, 231, 37],
    ];
    let x = s.clamp(0.0, 1.0) * 8.0;
    let i = (x as usize).min(7);
    let f = x - i as f64;
    let mix = |c: usize| {
        (f64::from(TABLE[i][c]) * (1.0 - f) + f64::from(TABLE[i + 1][c]) * f).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
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
pub fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Area) -> Result<(), FigureError>,
) -> Result<String, FigureError> {
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

/// A picture that is drawn and not yet written.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// Its name without the ending.
    pub stem: PathBuf,
    /// What is on it.
    pub svg: String,
}

/// Write `STEM.svg` and `STEM.png` of all drawings, or, where one of them may not be written, none; returns the paths.
pub fn save(
    drawings: &[Drawing],
    outputs: &Outputs,
    dpi: u16,
) -> Result<Vec<PathBuf>, FigureError> {
    let mut files = vec![];
    for Drawing { stem, svg } in drawings {
        let marked = match svg.find('>') {
            Some(end) => format!("{}\n{MARK}{}", &svg[..=end], &svg[end + 1..]),
            None => svg.clone(),
        };
        files.push((beside(stem, ".svg"), marked.into_bytes()));
        files.push((beside(stem, ".png"), marked_png(png(svg, f32::from(dpi) / UNITS)?)));
    }
    files.iter().try_for_each(|(path, _)| outputs.check_derived(path))?;
    files.iter().try_for_each(|(path, bytes)| replace(path, bytes))?;
    Ok(files.into_iter().map(|f| f.0).collect())
}

/// A PNG that says which program made it: a chunk of text behind the header.
fn marked_png(png: Vec<u8>) -> Vec<u8> {
    /// Signature and header.
    const HEAD: usize = 8 + 25;
    let text = b"tEXtSoftware\0signorini";
    if png.len() < HEAD {
        return png;
    }
    let mut out = png[..HEAD].to_vec();
    out.extend(((text.len() - 4) as u32).to_be_bytes());
    out.extend(text);
    out.extend(crc32fast::hash(text).to_be_bytes());
    out.extend(&png[HEAD..]);
    out
}

fn png(svg: &str, scale: f32) -> Result<Vec<u8>, FigureError> {
    use resvg::{tiny_skia, usvg};
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    let tree = usvg::Tree::from_str(svg, &options).map_err(FigureError::draw)?;
    let size = tree.size();
    let pixels = |x: f32| (x * scale).round() as u32;
    let mut pixmap = tiny_skia::Pixmap::new(pixels(size.width()), pixels(size.height()))
        .ok_or_else(|| FigureError::Draw("the picture is too large".into()))?;
    let transform = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&tree, transform, &mut pixmap.as_mut());
    pixmap.encode_png().map_err(FigureError::draw)
}

/// The range of some numbers with a margin of 6 %.
pub fn range(values: impl IntoIterator<Item = f64>) -> std::ops::Range<f64> {
    let (mut a, mut b) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values.into_iter().filter(|v| v.is_finite()) {
        (a, b) = (a.min(v), b.max(v));
    }
    if a > b {
        return 0.0..1.0;
    }
    let margin = if b > a { 0.06 * (b - a) } else { 0.5 * a.abs().max(1e-12) };
    a - margin..b + margin
}

/// A panel with axes, a light grid and labels; an empty label leaves out that axis's name.
pub fn panel<'a, 'b>(
    area: &'a Area<'b>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    panel_with(area, x, y, x_label, y_label, Ground::Grid, |_| Ok(()))
}

/// What lies under the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ground {
    /// A light grid.
    Grid,
    /// A map that covers the panel.
    Map,
}

/// As [`panel`], with something drawn first.
pub fn panel_with<'a, 'b>(
    area: &'a Area<'b>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    x_label: &str,
    y_label: &str,
    ground: Ground,
    under: impl FnOnce(&mut Chart<'a, 'b>) -> Result<(), FigureError>,
) -> Result<Chart<'a, 'b>, FigureError> {
    let (x_style, y_style) = (TickStyle::new(&x), TickStyle::new(&y));
    let x_ticks = Ticks { label: x_label, count: 8, text: &|v| x_style.text(*v) };
    let y_ticks = Ticks { label: y_label, count: 6, text: &|v| y_style.text(*v) };
    axes(area, (x, x_ticks), (y, y_ticks), ground, under)
}

/// The name of an axis and how it is divided.
struct Ticks<'t> {
    label: &'t str,
    count: usize,
    text: &'t dyn Fn(&f64) -> String,
}

/// Around a panel.
const MARGIN: f64 = 6.0;
/// At its right end.
const MARGIN_RIGHT: f64 = 24.0;
/// For the ticks and the name of the horizontal axis.
const X_LABELS: f64 = 40.0;
/// For those of the vertical axis.
const Y_LABELS: f64 = 80.0;

/// Axes, grid and labels: the look of every panel.
fn axes<'a, 'b>(
    area: &'a Area<'b>,
    (x, x_ticks): (std::ops::Range<f64>, Ticks),
    (y, y_ticks): (std::ops::Range<f64>, Ticks),
    ground: Ground,
    under: impl FnOnce(&mut Chart<'a, 'b>) -> Result<(), FigureError>,
) -> Result<Chart<'a, 'b>, FigureError> {
    let mut chart = ChartBuilder::on(area)
        .margin(px(MARGIN))
        .margin_right(px(MARGIN_RIGHT))
        .x_label_area_size(px(if x_ticks.label.is_empty() { 20.0 } else { X_LABELS }))
        .y_label_area_size(px(Y_LABELS))
        .build_cartesian_2d(x, y)
        .map_err(FigureError::draw)?;
    under(&mut chart)?;
    // a map that covers the panel shows no grid through its data
    let grid = if matches!(ground, Ground::Map) { TRANSPARENT } else { GRID.into() };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(grid.stroke_width(px(1.0) as u32))
        .axis_style(line(INK, 1.0))
        .x_labels(x_ticks.count)
        .y_labels(y_ticks.count)
        .x_label_formatter(&x_ticks.text)
        .y_label_formatter(&y_ticks.text)
        .set_all_tick_mark_size(px(4.0))
        .label_style(text(13))
        .axis_desc_style(text(14))
        .x_desc(x_ticks.label)
        .y_desc(y_ticks.label)
        .draw()
        .map_err(FigureError::draw)?;
    Ok(chart)
}

/// `10ⁿ`.
fn power_of_ten(exponent: i32) -> String {
    let digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let raise = |c: char| digits.chars().nth(c.to_digit(10)? as usize);
    let raised: String = exponent.abs().to_string().chars().filter_map(raise).collect();
    format!("10{}{}", if exponent < 0 { "⁻" } else { "" }, raised)
}

/// A panel whose axes are decimal logarithms, labelled as powers of ten.
pub fn loglog<'a, 'b>(
    area: &'a Area<'b>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let decades = |r: &std::ops::Range<f64>| (r.end - r.start).round() as usize + 1;
    let power = |v: &f64| {
        let exponent = v.round();
        let whole = (v - exponent).abs() <= 1e-6;
        if whole { power_of_ten(exponent as i32) } else { String::new() }
    };
    let ticks =
        |range: &std::ops::Range<f64>, label| Ticks { label, count: decades(range), text: &power };
    let (x_ticks, y_ticks) = (ticks(&x, x_label), ticks(&y, y_label));
    axes(area, (x, x_ticks), (y, y_ticks), Ground::Grid, |_| Ok(()))
}

/// A panel whose vertical axis is a decimal logarithm: `y` and what is drawn are logarithms, the ticks are numbers.
pub fn semilog<'a, 'b>(
    area: &'a Area<'b>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let x_style = TickStyle::new(&x);
    let x_ticks = Ticks { label: x_label, count: 8, text: &|v| x_style.text(*v) };
    let y_ticks = Ticks { label: y_label, count: 0, text: &|_| String::new() };
    let ticks = log_ticks(&y);
    let under = |chart: &mut Chart<'a, 'b>| row_ticks(area, chart, &ticks);
    axes(area, (x.clone(), x_ticks), (y.clone(), y_ticks), Ground::Grid, under)
}

/// A panel whose horizontal ticks are at given places and have given names; the vertical axis is a decimal logarithm
/// as in [`semilog`] if `logarithmic`.
pub fn columns<'a, 'b>(
    area: &'a Area<'b>,
    x: (std::ops::Range<f64>, &[(f64, String)]),
    (y, logarithmic): (std::ops::Range<f64>, bool),
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let y_style = TickStyle::new(&y);
    let x_ticks = Ticks { label: x_label, count: 0, text: &|_| String::new() };
    let count = if logarithmic { 0 } else { 6 };
    let y_ticks = Ticks { label: y_label, count, text: &|v| y_style.text(*v) };
    let ticks = if logarithmic { log_ticks(&y) } else { vec![] };
    let under = |chart: &mut Chart<'a, 'b>| {
        row_ticks(area, chart, &ticks)?;
        column_ticks(area, chart, x.1)
    };
    axes(area, (x.0.clone(), x_ticks), (y.clone(), y_ticks), Ground::Grid, under)
}

/// A straight stroke on the pixels of an area.
fn stroke(area: &Area, ends: [(i32, i32); 2], style: ShapeStyle) -> Result<(), FigureError> {
    area.draw(&PathElement::new(ends.to_vec(), style)).map_err(FigureError::draw)
}

/// Ticks of the vertical axis with their grid, on the whole area: a panel cuts off what lies beside it.
fn row_ticks(area: &Area, chart: &Chart, ticks: &[(f64, String)]) -> Result<(), FigureError> {
    let (panel, x) = (chart.plotting_area(), chart.x_range());
    let (x0, y0) = area.get_base_pixel();
    let style = text(13).pos(Pos::new(HPos::Right, VPos::Center));
    for (value, name) in ticks {
        let place = |x: f64| panel.map_coordinate(&(x, *value));
        let (left, height) = (place(x.start).0 - x0, place(x.start).1 - y0);
        let right = place(x.end).0 - x0;
        if name.is_empty() {
            stroke(area, [(left - px(2.5), height), (left, height)], line(INK, 0.7))?;
            continue;
        }
        stroke(area, [(left, height), (right, height)], line(GRID, 1.0))?;
        stroke(area, [(left - px(4.0), height), (left, height)], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (left - px(8.0), height), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// The same for the horizontal axis.
fn column_ticks(area: &Area, chart: &Chart, ticks: &[(f64, String)]) -> Result<(), FigureError> {
    let (panel, y) = (chart.plotting_area(), chart.y_range());
    let (x0, y0) = area.get_base_pixel();
    let style = text(13).pos(Pos::new(HPos::Center, VPos::Top));
    for (value, name) in ticks {
        let place = |y: f64| panel.map_coordinate(&(*value, y));
        let (at, bottom, top) = (place(y.start).0 - x0, place(y.start).1 - y0, place(y.end).1 - y0);
        stroke(area, [(at, bottom), (at, top)], line(GRID, 1.0))?;
        stroke(area, [(at, bottom), (at, bottom + px(4.0))], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (at, bottom + px(7.0)), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// Ticks of a logarithmic axis from 1, 2, …, 9 times powers of ten, and their names: none for those that would crowd.
fn log_ticks(range: &std::ops::Range<f64>) -> Vec<(f64, String)> {
    let decades = range.end - range.start;
    let named = |digit: i32, exponent: i32| match decades {
        d if d <= 1.0 => digit <= 5,
        d if d <= 2.5 => [1, 2, 5].contains(&digit),
        d => digit == 1 && exponent.rem_euclid((d / 8.0).ceil() as i32) == 0,
    };
    let mut ticks = vec![];
    for exponent in range.start.floor() as i32..=range.end.ceil() as i32 {
        for digit in 1..10 {
            let value = f64::from(exponent) + f64::from(digit).log10();
            // between many decades nothing but the powers
            if !range.contains(&value) || (digit > 1 && decades > 6.0) {
                continue;
            }
            let name = match exponent {
                _ if !named(digit, exponent) => String::new(),
                -3..=4 => super::summary::significant(10f64.powi(exponent) * f64::from(digit), 1),
                _ if digit == 1 => power_of_ten(exponent),
                _ => format!("{digit}·{}", power_of_ten(exponent)),
            };
            ticks.push((value, name));
        }
    }
    ticks
}

/// A panel with the same scale on both axes; the ranges are widened to fill it.
pub fn equal_panel<'a, 'b>(
    area: &'a Area<'b>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let (w, h) = area.dim_in_pixel();
    let width = f64::from(w as i32 - px(MARGIN + MARGIN_RIGHT + Y_LABELS)).max(1.0);
    let height = f64::from(h as i32 - px(2.0 * MARGIN + X_LABELS)).max(1.0);
    let scale = ((x.end - x.start) / width).max((y.end - y.start) / height);
    let widened = |r: std::ops::Range<f64>, pixels: f64| {
        let middle = 0.5 * (r.start + r.end);
        middle - 0.5 * scale * pixels..middle + 0.5 * scale * pixels
    };
    panel(area, widened(x, width), widened(y, height), x_label, y_label)
}

/// How the ticks of a range are written.
#[derive(Debug, Clone, Copy)]
struct TickStyle {
    /// Decimals that tell them apart; `None` for powers of ten.
    decimals: Option<usize>,
    /// Numbers below this are rounding errors of zero.
    zero: f64,
}

impl TickStyle {
    fn new(range: &std::ops::Range<f64>) -> Self {
        let span = (range.end - range.start).abs();
        let largest = range.start.abs().max(range.end.abs());
        let decimals = (1e-2..1e5)
            .contains(&largest)
            .then(|| (2.0 - span.log10()).floor().clamp(0.0, 6.0) as usize);
        TickStyle { decimals, zero: 1e-6 * span }
    }

    fn text(&self, v: f64) -> String {
        if v.abs() <= self.zero {
            return "0".into();
        }
        let text = match self.decimals {
            Some(d) => {
                let s = format!("{v:.d$}");
                match s.contains('.') {
                    true => s.trim_end_matches('0').trim_end_matches('.').to_owned(),
                    false => s,
                }
            }
            None => {
                let s = format!("{v:.2e}");
                match s.split_once('e') {
                    Some((m, e)) => {
                        format!("{}e{e}", m.trim_end_matches('0').trim_end_matches('.'))
                    }
                    None => s,
                }
            }
        };
        text.replace('-', "−")
    }
}

/// What stands before a name in a legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A full line.
    Line,
    /// A thin line.
    Thin,
    /// A dashed line.
    Dashes,
    /// A filled patch.
    Patch,
    /// A filled dot.
    Dot,
    /// An open circle.
    Ring,
    /// A filled triangle.
    Triangle,
    /// A filled diamond.
    Diamond,
    /// A cross.
    Cross,
    /// A small cross, where many lie side by side.
    Speck,
    /// A short stroke, as on the edge of a panel.
    Tick,
    /// The name alone.
    Nothing,
}

impl Mark {
    /// Length of the sample in a legend.
    fn sample(self) -> i32 {
        match self {
            Mark::Line | Mark::Thin | Mark::Dashes | Mark::Patch => px(24.0),
            Mark::Nothing => 0,
            _ => px(9.0),
        }
    }
}

/// A name in a legend, with its colour and mark.
pub type Entry<'e> = (&'e str, RGBColor, Mark);

/// A small mark at a pixel of an area; marks that are drawn as lines are left out.
pub fn symbol(
    area: &Area,
    (x, y): (i32, i32),
    mark: Mark,
    colour: RGBColor,
) -> Result<(), FigureError> {
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
        Mark::Triangle => filled(&[(0.0, -5.2), (4.5, 3.2), (-4.5, 3.2)]),
        Mark::Diamond => filled(&[(0.0, -4.8), (4.0, 0.0), (0.0, 4.8), (-4.0, 0.0)]),
        Mark::Cross => {
            stroke(&[(-4.0, -4.0), (4.0, 4.0)], 1.6)?;
            stroke(&[(-4.0, 4.0), (4.0, -4.0)], 1.6)
        }
        Mark::Speck => {
            stroke(&[(-2.4, -2.4), (2.4, 2.4)], 1.1)?;
            stroke(&[(-2.4, 2.4), (2.4, -2.4)], 1.1)
        }
        Mark::Tick => stroke(&[(0.0, -4.0), (0.0, 4.0)], 1.2),
        Mark::Line | Mark::Thin | Mark::Dashes | Mark::Patch | Mark::Nothing => Ok(()),
    }
}

/// The pixels of a chart's panel, and where a point of it lies on them.
pub fn flat<'b>(chart: &Chart<'_, 'b>) -> (Area<'b>, impl Fn((f64, f64)) -> (i32, i32)) {
    let panel = chart.plotting_area();
    let area = panel.strip_coord_spec();
    let (x0, y0) = area.get_base_pixel();
    let place = move |point: (f64, f64)| {
        let (x, y) = panel.map_coordinate(&point);
        (x - x0, y - y0)
    };
    (area, place)
}

/// Small marks at points of a chart.
pub fn symbols(
    chart: &Chart,
    points: impl IntoIterator<Item = (f64, f64)>,
    mark: Mark,
    colour: RGBColor,
) -> Result<(), FigureError> {
    let (area, place) = flat(chart);
    points.into_iter().try_for_each(|p| symbol(&area, place(p), mark, colour))
}

/// Entries of a legend in as many rows as they need.
pub fn legend_rows<'e>(
    area: &Area,
    entries: &[Entry<'e>],
) -> Result<Vec<Vec<Entry<'e>>>, FigureError> {
    let width = area.dim_in_pixel().0 as i32 - px(32.0);
    let mut rows: Vec<Vec<Entry>> = vec![];
    let mut left = 0;
    for entry in entries {
        let (text, _) = area.estimate_text_size(entry.0, &text(13)).map_err(FigureError::draw)?;
        let needed = text as i32 + entry.2.sample() + px(24.0);
        match rows.last_mut() {
            Some(row) if needed <= left => row.push(*entry),
            _ => {
                rows.push(vec![*entry]);
                left = width;
            }
        }
        left -= needed;
    }
    Ok(rows)
}

/// Draw a legend on top of an area, in as many rows as it needs; what is left of the area.
pub fn legend_above<'b>(area: Area<'b>, entries: &[Entry]) -> Result<Area<'b>, FigureError> {
    let mut area = area;
    for row in legend_rows(&area, entries)? {
        let (strip, rest) = area.split_vertically(px(20.0));
        legend(&strip, &row)?;
        area = rest;
    }
    Ok(area)
}

/// Names in a row at the right end of a strip above a panel.
pub fn legend(strip: &Area, entries: &[Entry]) -> Result<(), FigureError> {
    let style = text(13);
    let (w, h) = strip.dim_in_pixel();
    let (middle, space) = (h as i32 / 2, px(18.0));
    let mut x = w as i32 - px(16.0);
    for (name, colour, mark) in entries.iter().rev() {
        let sample = mark.sample();
        let (width, _) = strip.estimate_text_size(name, &style).map_err(FigureError::draw)?;
        x -= width as i32;
        strip
            .draw(&Text::new((*name).to_owned(), (x, middle - px(5.2)), style.clone()))
            .map_err(FigureError::draw)?;
        x -= sample + px(6.0);
        if *mark == Mark::Patch {
            let corners = [(x, middle - px(6.0)), (x + sample, middle + px(6.0))];
            strip.draw(&Rectangle::new(corners, colour.filled())).map_err(FigureError::draw)?;
        }
        let pieces: &[(f64, f64)] = match mark {
            Mark::Line | Mark::Thin => &[(0.0, 1.0)],
            Mark::Dashes => &[(0.0, 0.25), (0.375, 0.625), (0.75, 1.0)],
            _ => &[],
        };
        symbol(strip, (x + sample / 2, middle), *mark, *colour)?;
        let width = if *mark == Mark::Thin { 0.9 } else { 1.8 };
        for &(a, b) in pieces {
            let at = |s: f64| (x + (s * f64::from(sample)) as i32, middle);
            strip
                .draw(&PathElement::new(vec![at(a), at(b)], line(*colour, width)))
                .map_err(FigureError::draw)?;
        }
        x -= space;
    }
    Ok(())
}

/// A colour bar with its range and name.
pub fn colour_bar(
    area: &Area,
    range: std::ops::Range<f64>,
    label: &str,
    colour: impl Fn(f64) -> RGBColor,
) -> Result<(), FigureError> {
    let (_, h) = area.dim_in_pixel();
    let (top, bottom) = (px(34.0), h as i32 - px(44.0));
    let (left, right) = (px(8.0), px(24.0));
    let steps = 64;
    for k in 0..steps {
        let y = |k: i32| bottom - (bottom - top) * k / steps;
        let fill = colour((f64::from(k) + 0.5) / f64::from(steps)).filled();
        // neighbours overlap, so that no seam shows
        let top = (y(k + 1) - px(1.0)).max(top);
        area.draw(&Rectangle::new([(left, top), (right, y(k))], fill))
            .map_err(FigureError::draw)?;
    }
    area.draw(&Rectangle::new([(left, top), (right, bottom)], line(INK, 1.0)))
        .map_err(FigureError::draw)?;
    let mut style = TickStyle::new(&range);
    style.decimals = style.decimals.map(|d| d + 1);
    for k in 0..=4 {
        let y = bottom - (bottom - top) * k / 4;
        let value = range.start + (range.end - range.start) * f64::from(k) / 4.0;
        area.draw(&Text::new(style.text(value), (right + px(5.0), y - px(7.0)), text(12)))
            .map_err(FigureError::draw)?;
    }
    area.draw(&Text::new(label.to_owned(), (left, px(10.0)), text(13))).map_err(FigureError::draw)
}
