//! Solving a problem by one flow after another, with time and error.

use std::time::Instant;

use signorini::event::{self, Options, Report, Silent};
use signorini::flow::Flow;
use signorini::problem::Problem;
use signorini::report::precision::Point;

use crate::cli::CliError;

/// A problem that is solved again and again, and the solution that all others are compared with.
pub(super) struct Bench<'a> {
    /// What is solved.
    pub problem: &'a Problem,
    /// Until when.
    pub options: Options,
    /// How often each solution is timed.
    pub repeats: u32,
    /// The final state.
    pub reference: Vec<f64>,
    /// The switching times.
    pub times: Vec<f64>,
    /// Frequency that scales velocities.
    pub omega: f64,
}

impl Bench<'_> {
    pub(super) fn state(&self, u: &[f64], v: &[f64]) -> Vec<f64> {
        u.iter().copied().chain(v.iter().map(|v| v / self.omega)).collect()
    }

    pub(super) fn integrate(&self, flow: &mut dyn Flow) -> Result<Report, CliError> {
        let report = event::run(
            &self.problem.system,
            &self.problem.initial,
            &self.options,
            flow,
            &mut Silent,
        )
        .map_err(|e| CliError::Numerics(e.to_string()))?;
        match report.outcome.is_complete() {
            true => Ok(report),
            false => Err(CliError::Numerics(report.outcome.to_string())),
        }
    }

    pub(super) fn error(&self, state: &[f64]) -> f64 {
        let square = |x: f64| x * x;
        let distance: f64 = state.iter().zip(&self.reference).map(|(a, b)| square(a - b)).sum();
        (distance / self.reference.iter().map(|&b| square(b)).sum::<f64>()).sqrt()
    }

    pub(super) fn switch_error(&self, times: &[f64]) -> Option<f64> {
        let same = times.len() == self.times.len();
        let distance = times.iter().zip(&self.times).map(|(a, b)| (a - b).abs());
        same.then(|| distance.fold(0.0, f64::max) / self.options.until)
    }

    /// Time a flow made anew for each repeat, or (`warm`) one that keeps what it knows.
    pub(super) fn point(
        &self,
        name: &str,
        rtol: Option<f64>,
        warm: bool,
        make: &dyn Fn() -> Box<dyn Flow + 'static>,
    ) -> Result<Point, CliError> {
        let mut walls = vec![];
        let mut flow = make();
        let mut before = 0;
        let mut report = None;
        if warm {
            self.integrate(flow.as_mut())?;
        }
        for _ in 0..self.repeats {
            if !warm {
                flow = make();
            }
            let counters = flow.counters();
            before = counters.rhs_evaluations + counters.products;
            let start = Instant::now();
            report = Some(self.integrate(flow.as_mut())?);
            walls.push(start.elapsed().as_secs_f64());
        }
        walls.sort_by(f64::total_cmp);
        let report = report.ok_or_else(|| CliError::Other("no repeat was run".into()))?;
        let times: Vec<f64> = report.switches.iter().map(|s| s.t).collect();
        Ok(Point {
            method: name.to_owned(),
            rtol,
            error: Some(self.error(&self.state(&report.last.u, &report.last.v))),
            switch_error: self.switch_error(&times),
            switches: times.len(),
            wall_s: walls[walls.len() / 2],
            work: report.counters.rhs_evaluations + report.counters.products - before,
        })
    }
}
