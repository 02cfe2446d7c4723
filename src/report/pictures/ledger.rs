//! The picture `energy`: energies, jumps at switches, and what the ledger leaves unexplained.

use plotters::prelude::*;

use super::Options;
use super::time::over_time;
use crate::report::figure::{
    self, Area, Drawn, Entry, FigureError, INK, LINES, Mark, SHADE, legend, line, px, range,
    symbols, title,
};
use crate::store::Stored;

/// The column of the jumps among those of the energies.
const JUMPS: usize = 4;
/// Relative defects below this are drawn here: rounding.
const FLOOR: f64 = 1e-16;

/// The columns of a ledger, and the sum of the stored energies.
struct Ledger {
    t: Vec<f64>,
    /// The energies of some stored states are not known: those that are stand by themselves.
    has_gaps: bool,
    kinetic: Vec<f64>,
    elastic: Vec<f64>,
    external: Vec<f64>,
    dissipated: Vec<f64>,
    jumps: Vec<f64>,
    total: Vec<f64>,
}

impl Ledger {
    /// Of the states whose energies are known: all, but where a run followed the surroundings of the contact alone.
    fn of(stored: &Stored) -> Option<Self> {
        let [kinetic, elastic, external, dissipated, jumps] = &stored.energy[..] else {
            return None;
        };
        let rows: Vec<usize> = (0..stored.t.len()).filter(|&r| kinetic[r].is_finite()).collect();
        let known = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
        let total = rows.iter().map(|&r| kinetic[r] + elastic[r]).collect();
        let (t, has_gaps) = (known(&stored.t), rows.len() < stored.t.len());
        let [kinetic, elastic, external, dissipated, jumps] =
            [kinetic, elastic, external, dissipated, jumps].map(|c| known(c));
        Some(Ledger { t, has_gaps, kinetic, elastic, external, dissipated, jumps, total })
    }

    /// The energies with their names, but those that are zero throughout.
    fn present(&self) -> Vec<(&'static str, &[f64])> {
        let curves: [(&str, &[f64]); 5] = [
            ("kinetic", &self.kinetic),
            ("elastic", &self.elastic),
            ("work of the loads", &self.external),
            ("dissipated", &self.dissipated),
            ("kinetic + elastic", &self.total),
        ];
        curves.into_iter().filter(|(_, c)| c.iter().any(|&v| v != 0.0)).collect()
    }

    /// Decimal logarithms of what no entry explains, relative to the largest energy.
    fn unexplained(&self) -> Vec<f64> {
        let total = &self.total;
        let known = total.iter().chain(&self.external).chain(&self.dissipated);
        let scale = known.fold(0.0f64, |m, x| m.max(x.abs()));
        let defect = |r: usize| {
            let explained = total[0] + self.external[r] - self.dissipated[r] + self.jumps[r];
            ((total[r] - explained).abs() / scale.max(f64::MIN_POSITIVE)).max(FLOOR).log10()
        };
        (0..total.len()).map(defect).collect()
    }
}

/// Energies, and what the ledger leaves unexplained.
pub(super) fn energy(stored: &Stored, _: &Options) -> Result<String, FigureError> {
    let Some(ledger) = Ledger::of(stored) else {
        return Err(FigureError::Empty("no energies are stored"));
    };
    if ledger.t.is_empty() {
        return Err(FigureError::Empty("no states are stored"));
    }
    figure::svg((980, 760), |root| {
        title(root, &stored.title, "energy ledger")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (strip, sheet) = sheet.split_vertically(px(20.0));
        let panels = sheet.split_evenly((3, 1));
        energies(&panels[0], &strip, stored, &ledger)?;
        jumps(&panels[1], stored)?;
        defects(&panels[2], stored, &ledger)
    })
}

/// The energies and their legend.
fn energies(area: &Area, strip: &Area, stored: &Stored, ledger: &Ledger) -> Drawn {
    let present = ledger.present();
    let y = range(present.iter().flat_map(|(_, c)| c.iter().copied()).chain([0.0]));
    let mut chart = over_time(area, stored, y, ("", "energy"))?;
    let mut entries: Vec<Entry> = vec![("in contact", SHADE, Mark::Patch)];
    entries.truncate(usize::from(!stored.gap.is_empty()));
    for (k, (name, values)) in present.iter().enumerate() {
        let colour = if *name == "kinetic + elastic" { INK } else { LINES[k % LINES.len()] };
        let series = ledger.t.iter().copied().zip(values.iter().copied());
        if ledger.has_gaps {
            symbols(&chart, series, Mark::Circle, colour)?;
            entries.push((*name, colour, Mark::Circle));
            continue;
        }
        chart.draw_series(LineSeries::new(series, line(colour, 2.0))).map_err(FigureError::draw)?;
        entries.push((*name, colour, Mark::Line));
    }
    legend(strip, &entries)
}

/// The sum of the jumps so far, in steps.
fn jumps(area: &Area, stored: &Stored) -> Drawn {
    let (t, jumps) = (&stored.t, &stored.energy[JUMPS]);
    let y = range(jumps.iter().copied().chain([0.0]));
    let mut chart = over_time(area, stored, y, ("", "Σ jumps at switches"))?;
    let steps = (0..t.len()).flat_map(|r| {
        let before = if r > 0 { jumps[r - 1] } else { jumps[0] };
        [(t[r], before), (t[r], jumps[r])]
    });
    chart.draw_series(LineSeries::new(steps, line(LINES[1], 2.0))).map_err(FigureError::draw)?;
    Ok(())
}

/// What is unexplained, at least over the decades of rounding.
fn defects(area: &Area, stored: &Stored, ledger: &Ledger) -> Drawn {
    let digits = ledger.unexplained();
    let low = digits.iter().copied().fold(-16.0f64, f64::min).floor() - 0.3;
    let high = digits.iter().copied().fold(-14.0f64, f64::max).ceil() + 0.3;
    let labels = ("time", "log₁₀ |unexplained| / energy");
    let mut chart = over_time(area, stored, low..high, labels)?;
    let series = ledger.t.iter().copied().zip(digits);
    if ledger.has_gaps {
        return symbols(&chart, series, Mark::Circle, LINES[2]);
    }
    chart.draw_series(LineSeries::new(series, line(LINES[2], 1.0))).map_err(FigureError::draw)?;
    Ok(())
}
