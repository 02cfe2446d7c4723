//! A picture: a title, legends, rows of charts, a bar that explains colours, a footer. It is laid out for the width that is asked for: on a narrow one charts
//! that stand side by side stand below one another.

use std::ops::Range;

use plotters::prelude::*;

use super::colour::colour_bar;
use super::legend::{Entry, ROW, columns, rows, strip, width_of};
use super::{Area, Chart, Drawn, FAMILY, FINE, FONT, FigureError, INK, line, panel, px, text};

/// Width of a sheet where nobody asks for another, in units of 1/96 inch.
const WIDTH: f64 = 980.0;
/// Below this width letters are smaller, and charts stand below one another.
const NARROW: f64 = 640.0;
/// Size of everything on a narrow sheet, over that on a wide one: letters of 7 points.
const SMALL: f64 = 0.72;
/// Height of a line of the title.
const TITLE: f64 = 32.0;
/// Of the footer.
const FOOTER: f64 = 26.0;
/// Width of the bar of colours.
const BAR: f64 = 85.0;

/// How sheets are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Width in inches; none: that of the picture.
    pub width: Option<f64>,
    /// Whether there are titles and footers.
    pub titles: bool,
}

impl Default for Style {
    fn default() -> Self {
        Style { width: None, titles: true }
    }
}

/// Names with their marks.
pub enum Legend {
    /// In as many rows as they need, at the right end.
    Rows(Vec<Entry>),
    /// Several rows have their marks one below the other.
    Columns(Vec<Entry>),
}

impl Legend {
    /// Its rows on a sheet of some width.
    fn laid(&self, width: i32) -> Result<Vec<Vec<(i32, &Entry)>>, FigureError> {
        match self {
            Legend::Rows(entries) => rows(entries, width),
            Legend::Columns(entries) => columns(entries, width),
        }
    }
}

/// What is drawn by hand.
type Canvas<'s> = Box<dyn Fn(&Area) -> Drawn + Send + Sync + 's>;

enum Content<'s> {
    Chart(Box<Chart>),
    Canvas(Canvas<'s>),
}

/// A part of a row.
pub struct Cell<'s> {
    legend: Vec<Entry>,
    note: String,
    content: Content<'s>,
}

impl From<Chart> for Cell<'_> {
    fn from(chart: Chart) -> Self {
        Cell { legend: vec![], note: String::new(), content: Content::Chart(Box::new(chart)) }
    }
}

impl<'s> Cell<'s> {
    /// What is drawn by hand.
    pub(crate) fn canvas(draw: impl Fn(&Area) -> Drawn + Send + Sync + 's) -> Self {
        Cell { legend: vec![], note: String::new(), content: Content::Canvas(Box::new(draw)) }
    }

    /// A legend of its own.
    pub fn legend(self, legend: Vec<Entry>) -> Self {
        Cell { legend, ..self }
    }

    /// Words at the left end of its legend.
    pub(crate) fn note(self, note: String) -> Self {
        Cell { note, ..self }
    }

    fn has_head(&self) -> bool {
        !(self.legend.is_empty() && self.note.is_empty())
    }
}

/// A bar that explains colours.
pub(crate) struct Bar {
    pub range: Range<f64>,
    pub label: String,
    pub colour: fn(f64) -> RGBColor,
    /// What white means.
    pub white: Option<&'static str>,
}

/// A row: its height on a wide sheet, and what stands side by side.
struct Row<'s> {
    height: f64,
    cells: Vec<Cell<'s>>,
    /// Whether its cells may stand below one another.
    breaks: bool,
}

/// A picture.
pub struct Sheet<'s> {
    width: f64,
    title: String,
    footer: String,
    legends: Vec<Legend>,
    rows: Vec<Row<'s>>,
    bar: Option<Bar>,
}

impl<'s> Sheet<'s> {
    /// A sheet whose title is that of the scene, if it has one, and what is shown.
    pub fn new(title: &str, what: &str) -> Self {
        let title: String = title.chars().filter(|c| !c.is_control()).take(90).collect();
        let parts = [title.as_str(), what].into_iter().filter(|p| !p.is_empty());
        let title = parts.collect::<Vec<_>>().join(": ");
        let (footer, legends, rows) = (String::new(), vec![], vec![]);
        Sheet { width: WIDTH, title, footer, legends, rows, bar: None }
    }

    /// Another width than the usual one.
    pub(crate) fn wide(self, width: f64) -> Self {
        Sheet { width, ..self }
    }

    /// Small words at the lower end.
    pub fn footer(self, footer: String) -> Self {
        Sheet { footer, ..self }
    }

    /// A legend below those that it has.
    pub fn legend(mut self, legend: Legend) -> Self {
        self.legends.push(legend);
        self
    }

    /// A row below those that it has.
    pub fn row(mut self, height: f64, cells: Vec<Cell<'s>>) -> Self {
        self.rows.push(Row { height, cells, breaks: true });
        self
    }

    /// The same, whose cells stay side by side.
    pub(crate) fn strip(mut self, height: f64, cells: Vec<Cell<'s>>) -> Self {
        self.rows.push(Row { height, cells, breaks: false });
        self
    }

    /// A bar at the right end.
    pub(crate) fn bar(self, bar: Option<Bar>) -> Self {
        Sheet { bar, ..self }
    }

    /// Draw it as SVG.
    pub fn svg(&self, style: &Style) -> Result<String, FigureError> {
        // registering twice is harmless
        plotters::style::register_font(FAMILY, FontStyle::Normal, FONT)
            .map_err(|_| FigureError::Draw("the built-in font cannot be read".into()))?;
        let asked = style.width.map_or(self.width, |inches| 96.0 * inches);
        let size = if asked < NARROW { SMALL } else { 1.0 };
        let width = asked / size;
        // rows are lower where they are shorter
        let flat = (width / self.width).clamp(0.55, 1.0);
        let whole = px(width);
        let title = match style.titles {
            true => wrapped(&self.title, whole - px(24.0), 16)?,
            false => vec![],
        };
        let footer = match style.titles {
            true => wrapped(&self.footer, whole - px(24.0), 11)?,
            false => vec![],
        };
        let legends: Result<Vec<_>, _> = self.legends.iter().map(|l| l.laid(whole)).collect();
        let legends: Vec<_> = legends?.into_iter().flatten().collect();
        let (mut lines, mut below) = (vec![], 0.0);
        for row in &self.rows {
            let count = row.cells.len();
            let abreast = match (asked < NARROW, row.breaks) {
                (true, true) => 1,
                (true, false) if count > 3 => count.div_ceil(2),
                _ => count.max(1),
            };
            for cells in row.cells.chunks(abreast) {
                let wider = count as f64 / abreast as f64;
                let height =
                    row.height * if row.breaks { flat } else { wider * width / self.width };
                below += height;
                lines.push((height, cells));
            }
        }
        let above = title.len() as f64 * TITLE + legends.len() as f64 * ROW;
        let height =
            above + below + footer.len() as f64 * FOOTER + if style.titles { 0.0 } else { 8.0 };
        let mut out = String::new();
        let fine = (px(width) as u32, px(height) as u32);
        {
            let root = SVGBackend::with_string(&mut out, fine).into_drawing_area();
            root.fill(&WHITE).map_err(FigureError::draw)?;
            let mut rest = root.clone();
            for words in &title {
                let (head, below) = rest.split_vertically(px(TITLE));
                put(&head, words, 16)?;
                rest = below;
            }
            for legend in &legends {
                let (line, below) = rest.split_vertically(px(ROW));
                strip(&line, legend)?;
                rest = below;
            }
            if let Some(bar) = &self.bar {
                let (main, at) = rest.split_horizontally(whole - px(BAR));
                bar.draw(&at, px(below))?;
                rest = main;
            }
            for (height, cells) in &lines {
                let (line, below) = rest.split_vertically(px(*height));
                rest = below;
                let parts = line.split_evenly((1, cells.len().max(1)));
                // what stands side by side has its panels side by side
                let head = cells.iter().any(Cell::has_head);
                parts.iter().zip(*cells).try_for_each(|(area, cell)| cell.draw(area, head))?;
            }
            for words in &footer {
                let (line, below) = rest.split_vertically(px(FOOTER));
                put(&line, words, 11)?;
                rest = below;
            }
            root.present().map_err(FigureError::draw)?;
        }
        // the view box keeps the fine sheet; the picture has its own size
        let own = |length: u32| f64::from(length) * size / f64::from(FINE);
        let of = |w: String, h: String| format!("width=\"{w}\" height=\"{h}\"");
        let fine_size = of(fine.0.to_string(), fine.1.to_string());
        Ok(out.replacen(&fine_size, &of(own(fine.0).to_string(), own(fine.1).to_string()), 1))
    }
}

impl Cell<'_> {
    fn draw(&self, area: &Area, head: bool) -> Drawn {
        let width = area.dim_in_pixel().0 as i32;
        let mut rest = area.clone();
        let laid = rows(&self.legend, width)?;
        // room for a row where a neighbour has one
        for k in 0..laid.len().max(usize::from(head)) {
            let (line, below) = rest.split_vertically(px(ROW));
            if let Some(legend) = laid.get(k) {
                strip(&line, legend)?;
            }
            if k == 0 && !self.note.is_empty() {
                line.draw(&Text::new(self.note.clone(), (px(12.0), px(2.0)), text(13)))
                    .map_err(FigureError::draw)?;
            }
            rest = below;
        }
        match &self.content {
            Content::Chart(chart) => panel::draw(&rest, chart),
            Content::Canvas(draw) => draw(&rest),
        }
    }
}

impl Bar {
    fn draw(&self, area: &Area, height: i32) -> Drawn {
        let (area, _) = area.split_vertically(height);
        colour_bar(&area, self.range.clone(), &self.label, self.colour)?;
        let Some(white) = self.white else { return Ok(()) };
        let top = height - px(30.0);
        let corners = [(px(8.0), top), (px(24.0), top + px(14.0))];
        area.draw(&Rectangle::new(corners, line(INK, 1.0))).map_err(FigureError::draw)?;
        area.draw(&Text::new(white, (px(29.0), top), text(12))).map_err(FigureError::draw)
    }
}

/// Words at the left end of a line.
fn put(area: &Area, words: &str, size: u32) -> Drawn {
    area.draw(&Text::new(words.to_owned(), (px(12.0), px(8.0)), text(size)))
        .map_err(FigureError::draw)
}

/// Words in lines that are no longer than a width.
fn wrapped(words: &str, width: i32, size: u32) -> Result<Vec<String>, FigureError> {
    let mut lines: Vec<String> = vec![];
    for word in words.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}"));
        match longer {
            Some(longer) if width_of(&longer, size)? <= width => {
                if let Some(last) = lines.last_mut() {
                    *last = longer;
                }
            }
            _ => lines.push(word.to_owned()),
        }
    }
    Ok(lines)
}
