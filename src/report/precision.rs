//! Speed against error: table, CSV and picture of a work–precision study.

use std::fmt::Write as _;
use std::ops::Range;

use plotters::prelude::RGBColor;

use super::figure::{Axis, Chart, FigureError, Legend, Mark, Sheet, entry, series_colour};

/// One solution of the scene.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Point {
    /// Program and method: `dop853`, `scipy DOP853`.
    pub method: String,
    /// Relative tolerance, where the method has one.
    pub rtol: Option<f64>,
    /// Relative error of the final state against the reference; none for the reference itself.
    pub error: Option<f64>,
    /// Largest error of a switching time over the end time; none where the switches differ, and for the reference.
    pub switch_error: Option<f64>,
    /// Number of switches.
    pub switches: usize,
    /// Median wall time in seconds.
    pub wall_s: f64,
    /// Right-hand sides or products.
    pub work: u64,
}

/// What another finite element program makes of the same mesh and data, signorini's numbers first.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Elsewhere {
    /// Its name.
    pub program: String,
    /// Lowest frequencies of the body without contact, rigid motions left out.
    pub frequencies: Vec<[f64; 2]>,
    /// First touch; none where there was no contact.
    pub touch: Option<[f64; 2]>,
    /// From the first touch to the last release.
    pub contact_time: Option<[f64; 2]>,
    /// `∫ F dt` of the contact.
    pub impulse: Option<[f64; 2]>,
    /// Largest contact force.
    pub force: Option<[f64; 2]>,
    /// Largest change of the energy, over that at the start.
    pub energy: Option<[f64; 2]>,
    /// Time steps of the other program.
    pub steps: u64,
    /// Seconds.
    pub wall_s: [f64; 2],
}

impl Elsewhere {
    fn text(&self) -> String {
        let mut out = format!(
            "\n  the same mesh and data in {} ({} steps, {:.1} s; here {:.1} s)\n  {:<22}{:>14}{:>14}{:>12}\n",
            self.program,
            self.steps,
            self.wall_s[1],
            self.wall_s[0],
            "",
            "signorini",
            self.program,
            "difference"
        );
        let frequencies = self
            .frequencies
            .iter()
            .enumerate()
            .map(|(k, w)| (format!("frequency {}", k + 1), Some(*w)));
        let rest = [
            ("first touch", self.touch),
            ("time of contact", self.contact_time),
            ("impulse", self.impulse),
            ("largest force", self.force),
        ];
        let rest = rest.into_iter().map(|(name, pair)| (name.to_owned(), pair));
        for (name, pair) in frequencies.chain(rest) {
            let Some([own, other]) = pair else { continue };
            let difference = other / own - 1.0;
            let _ = writeln!(out, "  {name:<22}{own:>14.6e}{other:>14.6e}{difference:>+12.1e}");
        }
        if let Some([own, other]) = self.energy {
            let _ = writeln!(out, "  {:<22}{own:>14.1e}{other:>14.1e}", "change of the energy");
        }
        out
    }
}

/// A whole study.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Study {
    /// Scene title.
    pub title: String,
    /// Number of unknowns.
    pub n_o: usize,
    /// Which solution the errors refer to.
    pub reference: String,
    /// Machine and version.
    pub footer: String,
    /// All points.
    pub points: Vec<Point>,
    /// The same body in other finite element programs.
    pub bodies: Vec<Elsewhere>,
}

/// Errors below this are drawn here: rounding.
const FLOOR: f64 = 1e-15;

impl Study {
    /// The table in words.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{}: {} unknowns; errors against {}\n  {:<22}{:>9}{:>12}{:>14}{:>10}{:>12}{:>12}\n",
            self.title,
            self.n_o,
            self.reference,
            "method",
            "rtol",
            "error",
            "switch times",
            "switches",
            "time",
            "work"
        );
        for p in &self.points {
            let rtol = p.rtol.map_or("exact".into(), |r| format!("{r:.0e}"));
            let error = p.error.map_or("reference".into(), |e| format!("{e:.1e}"));
            let switch = match (p.error, p.switch_error) {
                (None, _) => "reference".into(),
                (_, Some(e)) => format!("{e:.1e}"),
                (_, None) => "differ".into(),
            };
            let _ = writeln!(
                out,
                "  {:<22}{rtol:>9}{error:>12}{switch:>14}{:>10}{:>9.3} ms{:>12}",
                p.method,
                p.switches,
                1e3 * p.wall_s,
                p.work
            );
        }
        out.extend(self.bodies.iter().map(Elsewhere::text));
        out + &format!("  {}\n", self.footer)
    }

    /// The table as CSV.
    pub fn csv(&self) -> String {
        let mut out = String::from("method,rtol,error,switch_error,switches,wall_s,work\n");
        for p in &self.points {
            let or_empty = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:e}"));
            let _ = writeln!(
                out,
                "{},{},{},{},{},{:e},{}",
                p.method,
                or_empty(p.rtol),
                or_empty(p.error),
                or_empty(p.switch_error),
                p.switches,
                p.wall_s,
                p.work
            );
        }
        out
    }

    /// Error against time, both logarithmic.
    pub fn picture(&self) -> Result<Sheet<'static>, FigureError> {
        let drawn: Vec<&Point> = self.points.iter().filter(|p| p.is_drawn()).collect();
        if drawn.is_empty() {
            return Err(FigureError::Empty("no solution comes near the reference"));
        }
        let x = decades(drawn.iter().map(|p| p.place().0));
        let y = decades(drawn.iter().map(|p| p.place().1));
        let x = Axis::decades("relative error of the final state", x);
        let mut chart = Chart::new(x, Axis::decades("wall time in s", y));
        // other programs have a row of their own
        let (mut peers, mut own) = (vec![], vec![]);
        for (k, method) in self.methods().into_iter().enumerate() {
            let mut places: Vec<(f64, f64)> =
                drawn.iter().filter(|p| p.method == method).map(|p| p.place()).collect();
            if places.is_empty() {
                continue;
            }
            // joined by tolerance; those of another program are dashed
            places.sort_by(|a, b| b.0.total_cmp(&a.0));
            let colour = series_colour(k);
            chart_method(&mut chart, method, places, colour);
            match is_peer(method) {
                true => peers.push(entry(method, colour, Mark::Dashes)),
                false => own.push(entry(method, colour, Mark::Line)),
            }
        }
        let what = format!("time against error, {} unknowns", self.n_o);
        let footer = format!("{}; errors against {}", self.footer, self.reference);
        let sheet = Sheet::new(&self.title, &what).footer(footer);
        let sheet = sheet.legend(Legend::Rows(own)).legend(Legend::Rows(peers));
        Ok(sheet.row(500.0, vec![chart.into()]))
    }

    /// The methods in the order of the points.
    fn methods(&self) -> Vec<&str> {
        let mut methods: Vec<&str> = vec![];
        for p in &self.points {
            if !methods.contains(&p.method.as_str()) {
                methods.push(&p.method);
            }
        }
        methods
    }
}

impl Point {
    /// Whether it is near enough to the reference; the reference itself has no error to be drawn at.
    fn is_drawn(&self) -> bool {
        self.error.is_some_and(|e| e < 1.0)
    }

    /// Decimal logarithms of error and time.
    fn place(&self) -> (f64, f64) {
        (self.error.unwrap_or(f64::INFINITY).max(FLOOR).log10(), self.wall_s.log10())
    }
}

/// The decades that hold some logarithms, at least one.
fn decades(values: impl Iterator<Item = f64> + Clone) -> Range<f64> {
    let low = values.clone().fold(f64::INFINITY, f64::min).floor();
    let high = values.fold(f64::NEG_INFINITY, f64::max).ceil();
    low..high.max(low + 1.0)
}

/// Whether a method is that of another program.
fn is_peer(method: &str) -> bool {
    ["scipy", "sundials", "diffsol"].iter().any(|peer| method.starts_with(peer))
}

/// The solutions of a method.
fn chart_method(chart: &mut Chart, method: &str, places: Vec<(f64, f64)>, colour: RGBColor) {
    match is_peer(method) {
        true => chart.dashes(places.clone(), colour, 1.8),
        false => chart.line(places.clone(), colour, 1.8),
    }
    chart.marks(places, Mark::Disc, colour);
}
