//! Legends: names with their marks, above a panel.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, Mark, line, px, symbol, text};

/// A name in a legend, with its colour and mark.
pub type Entry<'e> = (&'e str, RGBColor, Mark);

/// At the right end of a row.
const MARGIN: f64 = 16.0;
/// Between a mark and its name.
const GAP: f64 = 6.0;
/// Between two entries.
const SPACE: f64 = 18.0;
/// Height of a row.
const ROW: f64 = 20.0;

/// Length of an entry.
fn length(area: &Area, (name, _, mark): &Entry) -> Result<i32, FigureError> {
    let (width, _) = area.estimate_text_size(name, &text(13)).map_err(FigureError::draw)?;
    Ok(mark.sample() + px(GAP) + width as i32)
}

/// Entries of a legend in as many rows as they need.
fn legend_rows<'e>(area: &Area, entries: &[Entry<'e>]) -> Result<Vec<Vec<Entry<'e>>>, FigureError> {
    let width = area.dim_in_pixel().0 as i32 - px(2.0 * MARGIN);
    let mut rows: Vec<Vec<Entry>> = vec![];
    let mut left = 0;
    for entry in entries {
        let needed = length(area, entry)? + px(SPACE);
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
        let (strip, rest) = area.split_vertically(px(ROW));
        legend(&strip, &row)?;
        area = rest;
    }
    Ok(area)
}

/// As [`legend_above`]; several rows have their marks one below the other.
pub fn legend_columns<'b>(area: Area<'b>, entries: &[Entry]) -> Result<Area<'b>, FigureError> {
    if legend_rows(&area, entries)?.len() < 2 {
        return legend_above(area, entries);
    }
    let lengths =
        entries.iter().map(|entry| length(&area, entry)).collect::<Result<Vec<_>, _>>()?;
    let step = lengths.into_iter().max().unwrap_or(0) + px(SPACE);
    let width = area.dim_in_pixel().0 as i32;
    let columns = ((width - px(2.0 * MARGIN)) / step).max(1);
    let left = width - px(MARGIN) - columns * step + px(SPACE);
    let mut area = area;
    for row in entries.chunks(columns as usize) {
        let (strip, rest) = area.split_vertically(px(ROW));
        for (k, entry) in row.iter().enumerate() {
            draw_entry(&strip, left + k as i32 * step, entry)?;
        }
        area = rest;
    }
    Ok(area)
}

/// Names in a row at the right end of a strip above a panel.
pub fn legend(strip: &Area, entries: &[Entry]) -> Drawn {
    let mut x = strip.dim_in_pixel().0 as i32 - px(MARGIN);
    for entry in entries.iter().rev() {
        x -= length(strip, entry)?;
        draw_entry(strip, x, entry)?;
        x -= px(SPACE);
    }
    Ok(())
}

/// A mark and its name from a place of a strip on.
fn draw_entry(strip: &Area, x: i32, (name, colour, mark): &Entry) -> Drawn {
    let middle = strip.dim_in_pixel().1 as i32 / 2;
    let sample = mark.sample();
    let begin = (x + sample + px(GAP), middle - px(5.2));
    strip.draw(&Text::new((*name).to_owned(), begin, text(13))).map_err(FigureError::draw)?;
    if *mark == Mark::Patch {
        let corners = [(x, middle - px(6.0)), (x + sample, middle + px(6.0))];
        strip.draw(&Rectangle::new(corners, colour.filled())).map_err(FigureError::draw)?;
    }
    let pieces: &[(f64, f64)] = match mark {
        Mark::Line | Mark::Thin | Mark::Bearing(_) => &[(0.0, 1.0)],
        Mark::Dashes => &[(0.0, 0.25), (0.375, 0.625), (0.75, 1.0)],
        _ => &[],
    };
    let width = if *mark == Mark::Thin { 0.9 } else { 1.8 };
    for &(a, b) in pieces {
        let at = |s: f64| (x + (s * f64::from(sample)) as i32, middle);
        let piece = PathElement::new(vec![at(a), at(b)], line(*colour, width));
        strip.draw(&piece).map_err(FigureError::draw)?;
    }
    symbol(strip, (x + sample / 2, middle), *mark, *colour)
}
