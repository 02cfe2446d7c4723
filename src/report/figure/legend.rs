//! Legends: names with their marks, above a panel.

use plotters::prelude::*;

use super::{Area, Drawn, FigureError, Mark, line, px, symbol, text};

/// A name in a legend, with its colour and mark.
pub type Entry<'e> = (&'e str, RGBColor, Mark);

/// Entries of a legend in as many rows as they need.
fn legend_rows<'e>(area: &Area, entries: &[Entry<'e>]) -> Result<Vec<Vec<Entry<'e>>>, FigureError> {
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
pub fn legend(strip: &Area, entries: &[Entry]) -> Drawn {
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
            Mark::Line | Mark::Thin | Mark::Bearing(_) => &[(0.0, 1.0)],
            Mark::Dashes => &[(0.0, 0.25), (0.375, 0.625), (0.75, 1.0)],
            _ => &[],
        };
        let width = if *mark == Mark::Thin { 0.9 } else { 1.8 };
        for &(a, b) in pieces {
            let at = |s: f64| (x + (s * f64::from(sample)) as i32, middle);
            strip
                .draw(&PathElement::new(vec![at(a), at(b)], line(*colour, width)))
                .map_err(FigureError::draw)?;
        }
        symbol(strip, (x + sample / 2, middle), *mark, *colour)?;
        x -= space;
    }
    Ok(())
}
