//! Legends: names with their marks, above a panel.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, Mark, line, px, symbol, text};

/// A name in a legend, with its colour and mark.
pub type Entry = (String, RGBColor, Mark);

/// A name in a legend.
pub fn entry(name: impl Into<String>, colour: RGBColor, mark: Mark) -> Entry {
    (name.into(), colour, mark)
}

/// At the right end of a row.
const MARGIN: f64 = 16.0;
/// Between a mark and its name.
const GAP: f64 = 6.0;
/// Between two entries.
const SPACE: f64 = 18.0;
/// Height of a row.
pub(super) const ROW: f64 = 20.0;

/// Width of words in the pixels of a sheet.
pub(super) fn width_of(words: &str, size: u32) -> Result<i32, FigureError> {
    let (width, _) = text(size).font.box_size(words).map_err(FigureError::draw)?;
    Ok(width as i32)
}

/// Length of an entry.
fn length((name, _, mark): &Entry) -> Result<i32, FigureError> {
    Ok(mark.sample() + px(GAP) + width_of(name, 13)?)
}

/// A row of a legend: entries with their places on it.
type Row<'e> = Vec<(i32, &'e Entry)>;

/// Entries in as many rows as they need, at the right end of a sheet of some width.
pub(super) fn rows(entries: &[Entry], width: i32) -> Result<Vec<Row<'_>>, FigureError> {
    let mut rows: Vec<Vec<(i32, &Entry)>> = vec![];
    let mut left = 0;
    for entry in entries {
        let needed = length(entry)? + px(SPACE);
        match rows.last_mut() {
            Some(row) if needed <= left => row.push((needed, entry)),
            _ => {
                rows.push(vec![(needed, entry)]);
                left = width - px(2.0 * MARGIN);
            }
        }
        left -= needed;
    }
    for row in &mut rows {
        let all: i32 = row.iter().map(|(needed, _)| needed).sum();
        let mut x = width - px(MARGIN) - all + px(SPACE);
        for (place, _) in row {
            (*place, x) = (x, x + *place);
        }
    }
    Ok(rows)
}

/// The same; several rows have their marks one below the other.
pub(super) fn columns(entries: &[Entry], width: i32) -> Result<Vec<Row<'_>>, FigureError> {
    let one = rows(entries, width)?;
    if one.len() < 2 {
        return Ok(one);
    }
    let lengths = entries.iter().map(length).collect::<Result<Vec<_>, _>>()?;
    let step = lengths.into_iter().max().unwrap_or(0) + px(SPACE);
    let columns = ((width - px(2.0 * MARGIN)) / step).max(1);
    let left = width - px(MARGIN) - columns * step + px(SPACE);
    let place = |(k, entry)| (left + k as i32 * step, entry);
    Ok(entries
        .chunks(columns as usize)
        .map(|row| row.iter().enumerate().map(place).collect())
        .collect())
}

/// A row on its strip.
pub(super) fn strip(strip: &Area, row: &[(i32, &Entry)]) -> Drawn {
    row.iter().try_for_each(|(x, entry)| draw_entry(strip, *x, entry))
}

/// A mark and its name from a place of a strip on.
fn draw_entry(strip: &Area, x: i32, (name, colour, mark): &Entry) -> Drawn {
    let middle = strip.dim_in_pixel().1 as i32 / 2;
    let sample = mark.sample();
    let begin = (x + sample + px(GAP), middle - px(5.2));
    strip.draw(&Text::new(name.clone(), begin, text(13))).map_err(FigureError::draw)?;
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
