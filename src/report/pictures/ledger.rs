//! The picture `energy`: energies, jumps at switches, and what the ledger leaves unexplained.

use plotters::style::RGBColor;

use super::Options;
use super::time::over_time;
use crate::report::figure::{
    Cell, Chart, Entry, FigureError, INK, LINES, Mark, Point, SHADE, Sheet, entry, range,
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
    /// What friction took, what moving surfaces brought.
    friction: Vec<f64>,
    belt: Vec<f64>,
    total: Vec<f64>,
}

impl Ledger {
    /// Of the states whose energies are known: all, but where a run followed the surroundings of the contact alone.
    fn of(stored: &Stored) -> Option<Self> {
        let [kinetic, elastic, external, dissipated, jumps, ..] = &stored.energy[..] else {
            return None;
        };
        let rows: Vec<usize> = (0..stored.t.len()).filter(|&r| kinetic[r].is_finite()).collect();
        let known = |column: &[f64]| rows.iter().map(|&r| column[r]).collect::<Vec<f64>>();
        let total = rows.iter().map(|&r| kinetic[r] + elastic[r]).collect();
        let (t, has_gaps) = (known(&stored.t), rows.len() < stored.t.len());
        let [kinetic, elastic, external, dissipated, jumps] =
            [kinetic, elastic, external, dissipated, jumps].map(|c| known(c));
        let zeros = || vec![0.0; rows.len()];
        let (friction, belt) = stored
            .rubbed
            .as_ref()
            .map_or_else(|| (zeros(), zeros()), |r| (known(&r.taken), known(&r.belt)));
        Some(Ledger {
            t,
            has_gaps,
            kinetic,
            elastic,
            external,
            dissipated,
            jumps,
            friction,
            belt,
            total,
        })
    }

    /// The energies with their names, but those that are zero throughout.
    fn present(&self) -> Vec<(&'static str, &[f64])> {
        let curves: [(&str, &[f64]); 7] = [
            ("kinetic", &self.kinetic),
            ("elastic", &self.elastic),
            ("work of the loads", &self.external),
            ("dissipated", &self.dissipated),
            ("taken by friction", &self.friction),
            ("work of the moving surface", &self.belt),
            ("kinetic + elastic", &self.total),
        ];
        curves.into_iter().filter(|(_, c)| c.iter().any(|&v| v != 0.0)).collect()
    }

    /// Decimal logarithms of what no entry explains, relative to the largest energy.
    fn unexplained(&self) -> Vec<f64> {
        let total = &self.total;
        let known = total.iter().chain(&self.external).chain(&self.dissipated);
        let known = known.chain(&self.friction).chain(&self.belt);
        let scale = known.fold(0.0f64, |m, x| m.max(x.abs()));
        let defect = |r: usize| {
            let taken = self.dissipated[r] + self.friction[r];
            let explained = total[0] + self.external[r] + self.belt[r] - taken + self.jumps[r];
            ((total[r] - explained).abs() / scale.max(f64::MIN_POSITIVE)).max(FLOOR).log10()
        };
        (0..total.len()).map(defect).collect()
    }
}

/// Jumps below this part of the largest energy are rounding, and have no chart.
const ROUNDING: f64 = 1e-9;

/// Energies, and what the ledger leaves unexplained.
pub(super) fn energy<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let Some(ledger) = Ledger::of(stored) else {
        return Err(FigureError::Empty("no energies are stored"));
    };
    if ledger.t.is_empty() {
        return Err(FigureError::Empty("no states are stored"));
    }
    let mut sheet = Sheet::new(&stored.title, "energy ledger");
    let largest = ledger.total.iter().fold(0.0f64, |m, e| m.max(e.abs()));
    let jumps_show = stored.energy[JUMPS].iter().any(|j| j.abs() > ROUNDING * largest);
    let height = if jumps_show { 240.0 } else { 350.0 };
    sheet = sheet.row(height, vec![energies(stored, &ledger)]);
    if jumps_show {
        sheet = sheet.row(height, vec![jumps(stored).into()]);
    }
    Ok(sheet.row(height, vec![defects(stored, &ledger).into()]))
}

/// A curve of a ledger; the states that are known stand by themselves where others are not.
fn curve(
    chart: &mut Chart,
    ledger: &Ledger,
    values: &[f64],
    (colour, width, is_repeated): (RGBColor, f64, bool),
) -> Mark {
    let points: Vec<Point> = ledger.t.iter().copied().zip(values.iter().copied()).collect();
    if ledger.has_gaps {
        chart.marks(points, Mark::Circle, colour);
        return Mark::Circle;
    }
    // more curves than colours: those that come again are dashed
    if is_repeated {
        chart.dashes(points, colour, width);
        return Mark::Dashes;
    }
    chart.line(points, colour, width);
    Mark::Line
}

/// The energies and their legend.
fn energies(stored: &Stored, ledger: &Ledger) -> Cell<'static> {
    let present = ledger.present();
    let y = range(present.iter().flat_map(|(_, c)| c.iter().copied()).chain([0.0]));
    let mut chart = over_time(stored, y, ("", "energy"));
    let mut entries: Vec<Entry> = vec![entry("in contact", SHADE, Mark::Patch)];
    entries.truncate(stored.facing().min(1));
    for (k, (name, values)) in present.iter().enumerate() {
        let is_total = *name == "kinetic + elastic";
        let colour = if is_total { INK } else { LINES[k % LINES.len()] };
        let is_repeated = k >= LINES.len() && !is_total;
        let mark = curve(&mut chart, ledger, values, (colour, 2.0, is_repeated));
        entries.push(entry(*name, colour, mark));
    }
    Cell::from(chart).legend(entries)
}

/// The sum of the jumps so far, in steps.
fn jumps(stored: &Stored) -> Chart {
    let (t, jumps) = (&stored.t, &stored.energy[JUMPS]);
    let y = range(jumps.iter().copied().chain([0.0]));
    let mut chart = over_time(stored, y, ("", "Σ jumps at switches"));
    let steps = (0..t.len()).flat_map(|r| {
        let before = if r > 0 { jumps[r - 1] } else { jumps[0] };
        [(t[r], before), (t[r], jumps[r])]
    });
    chart.line(steps.collect(), LINES[1], 2.0);
    chart
}

/// What is unexplained, at least over the decades of rounding.
fn defects(stored: &Stored, ledger: &Ledger) -> Chart {
    let digits = ledger.unexplained();
    let low = digits.iter().copied().fold(-16.0f64, f64::min).floor() - 0.3;
    let high = digits.iter().copied().fold(-14.0f64, f64::max).ceil() + 0.3;
    let labels = ("time", "log₁₀ unexplained");
    let mut chart = over_time(stored, low..high, labels);
    curve(&mut chart, ledger, &digits, (LINES[2], 1.0, false));
    chart
}
