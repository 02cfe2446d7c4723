//! Inks, line colours, the colour map, and a bar that explains it.

use std::ops::Range;

use plotters::prelude::*;

use super::scale::TickStyle;
use super::{Area, Drawn, FigureError, line, px, text};

/// Ink of axes and text.
pub const INK: RGBColor = RGBColor(40, 40, 45);
/// Fine lines of the grid.
pub(super) const GRID: RGBColor = RGBColor(228, 228, 232);
/// Contact intervals.
pub(crate) const SHADE: RGBColor = RGBColor(236, 231, 218);
/// Line colours, distinguishable in grey and by colour-blind readers (Okabe–Ito).
pub const LINES: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 86, 86),
];

/// Colour of the `k`-th of several series.
pub(crate) fn series_colour(k: usize) -> RGBColor {
    match k % (LINES.len() + 3) {
        j if j < LINES.len() => LINES[j],
        j => [INK, viridis(0.85), viridis(0.1)][j - LINES.len()],
    }
}

/// A colour thinned with white, `share ∈ [0, 1]` of it left.
pub(crate) fn tint(colour: RGBColor, share: f64) -> RGBColor {
    let thin = |c: u8| (255.0 - share * (255.0 - f64::from(c))).round() as u8;
    RGBColor(thin(colour.0), thin(colour.1), thin(colour.2))
}

/// The colour map viridis, `s ∈ [0, 1]`.
pub(crate) fn viridis(s: f64) -> RGBColor {
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

/// A colour bar with its range and name.
pub(super) fn colour_bar(
    area: &Area,
    range: Range<f64>,
    label: &str,
    colour: impl Fn(f64) -> RGBColor,
) -> Drawn {
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
