//! `run --lyapunov`: how fast the neighbours of a motion part from it, from the end of the run on.

use clap::Args;
use serde_json::{Value, json};

use signorini::contact::{State, System};
use signorini::continuation::Go;
use signorini::families::start;
use signorini::orbit::lyapunov::{Asked, exponents};
use signorini::orbit::{LARGE, Propagator};
use signorini::problem::Problem;
use signorini::records::LyapunovRecord;
use signorini::report::summary::significant;
use signorini::scenario::{Issue, Scene};

use super::progress::Bar;
use super::{CliError, Global};

/// What is asked for.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// So many Lyapunov exponents, the largest first, of the motion from the end of the run on (let the run be long enough for it to settle)
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    lyapunov: Option<u32>,
    /// With --lyapunov: periods of the loads (of the first natural frequency where there are none) over which means are taken, behind a tenth as many in which the directions find
    /// themselves
    #[arg(long, default_value_t = 1000, value_name = "N", requires = "lyapunov", value_parser = clap::value_parser!(u32).range(16..=10_000_000))]
    lyapunov_periods: u32,
}

impl Arguments {
    /// What is looked for in a problem, checked.
    pub(super) fn asked(
        &self,
        scene: &Scene,
        problem: &Problem,
    ) -> Result<Option<Asked>, CliError> {
        let Some(count) = self.lyapunov else { return Ok(None) };
        start::closure(scene, problem).map_err(|e| {
            CliError::Input(format!("--lyapunov takes the motions that `orbit` takes: {e}"))
        })?;
        let n = problem.system.n_o();
        if n > LARGE {
            let message = format!(
                "--lyapunov: {n} displacements move by themselves, and tangents are carried by the modes of all phases, of at most {LARGE}"
            );
            let help = "give the scene [reduction] kind = \"free-interface\", modes = 100";
            return Err(scene.error(Issue::new("body", message, help)).into());
        }
        if count as usize > 2 * n {
            return Err(CliError::Input(format!(
                "--lyapunov: there are {} exponents, two a displacement",
                2 * n
            )));
        }
        let natural = || std::f64::consts::TAU / problem.system.body.frequency_unit();
        let period = scene.period().unwrap_or_else(natural);
        let periods = self.lyapunov_periods as usize;
        Ok(Some(Asked { count: count as usize, skip: periods.div_ceil(10), periods, period }))
    }
}

/// The exponents from a state on; a signal ends them where their means are what there is.
pub(super) fn found(
    global: &Global,
    scene: &Scene,
    system: &System,
    from: &State,
    asked: &Asked,
) -> Result<Option<LyapunovRecord>, CliError> {
    let body = Propagator::new(system.clone()).map_err(|e| CliError::Numerics(e.to_string()))?;
    let bar = Bar::named(global, format!("{}, exponents", scene.stem()));
    let all = (asked.skip + asked.periods) as f64;
    let found = exponents(&body, from, asked, |done| {
        bar.iter().for_each(|bar| bar.set(done as f64 / all, String::new()));
        match global.caller.signal() {
            Some(_) => Go::Break(()),
            None => Go::Continue(()),
        }
    });
    bar.iter().for_each(Bar::clear);
    found.map_err(|e| CliError::Numerics(format!("exponents: {e}; the run itself is stored")))
}

/// `lyapunov` of the run's JSON.
pub(super) fn to_json(found: &LyapunovRecord) -> Value {
    json!({
        "exponents": found.exponents, "errors": found.errors, "bounds": found.bounds, "period": found.period,
        "periods": found.growths.len(), "verdict": found.verdict(), "dimension": found.dimension(),
        "sum": found.sum(), "divergence": found.divergence,
    })
}

/// The same in words.
pub(super) fn to_text(said: &Value) -> String {
    // what is no finite number is null
    let numbers = |key: &str| -> Vec<f64> {
        let all = said[key].as_array().into_iter().flatten();
        all.map(|x| x.as_f64().unwrap_or(f64::NEG_INFINITY)).collect()
    };
    let number = |key: &str| said[key].as_f64();
    let mut out = String::new();
    let mut line = |label: &str, text: String| out += &format!("  {label:<14}{text}\n");
    let (errors, bounds) = (numbers("errors"), numbers("bounds"));
    let period = number("period").unwrap_or(f64::NAN);
    for (k, x) in numbers("exponents").iter().enumerate() {
        let at = |of: &[f64]| of.get(k).copied().unwrap_or(f64::NAN);
        let text = match x.is_finite() {
            true => format!(
                "{} ± {:.1e} (blocks of any length {:.1e}), a period {}",
                significant(*x, 6),
                at(&errors),
                at(&bounds),
                significant(x * period, 6)
            ),
            false => "minus infinity: nothing is left of this direction behind a period".into(),
        };
        line(if k == 0 { "Lyapunov" } else { "" }, text);
    }
    let periods = said["periods"].as_u64().unwrap_or(0);
    let verdict = match said["verdict"].as_str() {
        Some("chaotic") => "chaotic: the largest is above zero by more than four errors",
        Some("regular") => "regular: the largest is not above zero",
        _ => "open: the largest is zero within its errors; give more --lyapunov-periods",
    };
    line("", format!("{verdict} ({periods} periods of {})", significant(period, 8)));
    if let Some(dimension) = number("dimension") {
        line("", format!("dimension {} by Kaplan and Yorke", significant(dimension, 4)));
    }
    if let (Some(sum), Some(divergence)) = (number("sum"), number("divergence")) {
        let [sum, divergence] = [sum, divergence].map(|x| significant(x, 10));
        line("", format!("their sum is {sum}; volumes shrink by {divergence}"));
    }
    out
}
