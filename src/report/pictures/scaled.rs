//! How deformed shapes are drawn: magnified displacements, states with their times.

use std::ops::Range;
use std::path::Path;

use super::time::time_range;
use crate::report::figure::{Area, Bar, Cell, Drawn, Sheet, px};
use crate::report::summary;
use crate::scenario::Scene;
use crate::store::Stored;

/// Largest displacement as drawn, as a fraction of the body's length: linear elasticity knows no scale.
const DRAWN: f64 = 0.25;

/// Magnifications from one over this to this are not worth a falsified shape.
const AS_IT_IS: f64 = 4.0;

/// The span of time whose fractions are drawn: all that is stored, or the last period of a scene that
/// has one.
pub(super) fn shape_span(stored: &Stored) -> Range<f64> {
    let time = time_range(stored);
    let period = Scene::parse(&stored.scene, Path::new("stored")).ok().and_then(|s| s.period());
    match period {
        Some(t) if time.end - time.start > 2.0 * t => time.end - t..time.end,
        _ => time,
    }
}

/// How much displacements are magnified.
pub(super) struct Magnified {
    /// Largest `‖u‖` of the states.
    pub largest: f64,
    pub factor: f64,
}

impl Magnified {
    /// Of some stored states.
    pub fn of(stored: &Stored, rows: &[usize]) -> Magnified {
        let n = stored.nodes.nrows();
        let all = rows.iter().flat_map(|&r| (0..n).map(move |i| (r, i)));
        let largest = all.map(|(r, i)| size(stored, r, i)).fold(f64::MIN_POSITIVE, f64::max);
        let extent = |c: usize| {
            let x = || stored.nodes.column(c).into_iter().copied();
            x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min)
        };
        let length = (0..stored.nodes.ncols()).map(extent).fold(0.0, f64::max);
        // near the true size: the true size, in which plane obstacles are plane
        let factor = match DRAWN * length / largest {
            m if (1.0 / AS_IT_IS..AS_IT_IS).contains(&m) => 1.0,
            m => m,
        };
        Magnified { largest, factor }
    }
}

/// Height of a drawing, in units of the picture.
const TALLEST: f64 = 640.0;

/// States side by side in one or two rows, of drawings with these extents, and a bar that explains their colours.
pub(super) fn side_by_side<'s>(
    stored: &Stored,
    words: &str,
    rows: &[usize],
    (x, y): (&Range<f64>, &Range<f64>),
    draw: impl Fn(&Area, usize) -> Drawn + Clone + Send + Sync + 's,
    bar: Option<Bar>,
) -> Sheet<'s> {
    let aspect = (y.end - y.start) / (x.end - x.start);
    // tall bodies stand in one row
    let columns = if rows.len() > 3 && aspect < 1.3 { rows.len().div_ceil(2) } else { rows.len() };
    let width = 900.0 / columns.max(1) as f64;
    let lines = rows.len().div_ceil(columns.max(1)) as f64;
    // no higher than a screen
    let height = ((width - 12.0) * aspect + 32.0).min(TALLEST).max(185.0 / lines.max(1.0));
    let mut sheet = Sheet::new(&stored.title, words).bar(bar);
    for line in rows.chunks(columns.max(1)) {
        let cell = |k: usize| match line.get(k) {
            Some(&r) => {
                let draw = draw.clone();
                Cell::canvas(move |area| draw(area, r))
            }
            None => Cell::canvas(|_| Ok(())),
        };
        sheet = sheet.strip(height, (0..columns).map(cell).collect());
    }
    sheet
}

/// Where the plane lies on the pixels of a panel: equal scales in both directions.
#[derive(Clone, Copy)]
pub(super) struct Projection {
    start: [f64; 2],
    /// Pixels of a unit of length.
    pub(super) scale: f64,
    border: f64,
    /// What is left free on the left of a drawing that is narrower than its panel.
    left: f64,
    height: f64,
}

impl Projection {
    pub(super) fn on(canvas: &Area, border: f64, x: &Range<f64>, y: &Range<f64>) -> Self {
        let (w, h) = canvas.dim_in_pixel();
        let (w, height) = (f64::from(w), f64::from(h));
        let border = f64::from(px(border));
        let scale = ((w - 2.0 * border) / (x.end - x.start))
            .min((height - 2.0 * border) / (y.end - y.start));
        let left = (0.5 * (w - scale * (x.end - x.start))).max(border);
        Projection { start: [x.start, y.start], scale, border, left, height }
    }

    pub(super) fn pixel(&self, p: [f64; 2]) -> (i32, i32) {
        let along = self.left + (p[0] - self.start[0]) * self.scale;
        let up = self.height - self.border - (p[1] - self.start[1]) * self.scale;
        (along.round() as i32, up.round() as i32)
    }
}

/// `‖u‖` of a node at a stored state.
pub(super) fn size(stored: &Stored, r: usize, i: usize) -> f64 {
    let [ux, uy, uz] = stored.displacement(r, i);
    ux.hypot(uy).hypot(uz)
}

/// A state's time.
pub(super) fn label(stored: &Stored, r: usize) -> String {
    format!("t = {}", summary::significant(stored.t[r], 5))
}

/// Three significant digits, no trailing zeros.
pub(super) fn significant(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let decimals = (2.0 - v.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{v:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
