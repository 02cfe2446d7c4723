//! A damped nonlinear mode: frequency and damping ratio over the amplitude.

use super::branches::{branches, colour, of_branch};
use super::head::{Head, family_head};
use super::look::Look;
use crate::records::PointRecord;
use crate::report::figure::{Axis, Chart, FigureError, Sheet, range};
use crate::store::StoredFamily;

/// Amplitude, frequency and ratio `ζ = α/2ω`.
fn place(family: &StoredFamily, p: &PointRecord) -> Option<[f64; 3]> {
    p.orbit.as_ref()?;
    let zeta = p.damping_ratio().unwrap_or(f64::NAN);
    Some([family.identity.walk.amplitude(p.index)?, p.omega, zeta])
}

/// Both over the amplitude.
pub(super) fn damped(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    let places: Vec<[f64; 3]> = family.points.iter().filter_map(|p| place(family, p)).collect();
    if places.is_empty() {
        return Err(FigureError::Empty("the family holds no orbit"));
    }
    // with too few harmonics it is not
    let is_told = places.iter().any(|p| p[2].is_finite());
    let what = match is_told {
        true => "damped nonlinear mode",
        false => "damped nonlinear mode; its ratio is told from 7 harmonics on",
    };
    let head = Head { what: what.into(), look: Look::of(family), extra: vec![], below: vec![] };
    let mut sheet = family_head(family, head);
    let x = range(places.iter().map(|p| p[0].log10()));
    // a ratio of nothing has no logarithm
    let tells = places.iter().all(|p| p[2] > 0.0);
    let panels = [(1, "frequency ω"), (2, "damping ratio ζ = α/2ω")];
    let shown = if is_told { &panels[..] } else { &panels[..1] };
    for &(k, label) in shown {
        let logarithmic = k == 2 && tells;
        let scaled = |v: f64| if logarithmic { v.log10() } else { v };
        let finite = places.iter().map(|p| scaled(p[k])).filter(|v| v.is_finite());
        let is_last = k == shown.len();
        let (y, x_label) = (
            range(finite),
            if is_last { "amplitude: largest displacement of the mode" } else { "" },
        );
        let axes = (Axis::scaled(x_label, x.clone(), true), Axis::scaled(label, y, logarithmic));
        let mut chart = Chart::new(axes.0, axes.1);
        for branch in branches(family) {
            let points = of_branch(family, branch).filter_map(|p| place(family, p));
            let line: Vec<(f64, f64)> = points.map(|p| (p[0].log10(), scaled(p[k]))).collect();
            let line = line.into_iter().filter(|p| p.1.is_finite()).collect();
            chart.line(line, colour(family, branch), 1.8);
        }
        sheet = sheet.row(if is_last { 375.0 } else { 355.0 }, vec![chart.into()]);
    }
    Ok(sheet)
}
