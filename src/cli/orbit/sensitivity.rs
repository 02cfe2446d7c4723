//! `orbit --sensitivity`: how the orbit changes with numbers of its scene.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use signorini::contact::System;
use signorini::families::parameters::parameter;
use signorini::orbit::sensitivity::{Differentiable, Observable};
use signorini::orbit::{Orbit, OrbitError, Propagator};
use signorini::records::{PeakRecord, SensitivityRecord};
use signorini::report::summary::significant;
use signorini::scenario::{Issue, Scene};

use crate::cli::progress::Bar;
use crate::cli::{CliError, Global};

/// Derivatives of an orbit by all parameters that were asked for.
pub(super) struct Sensitivities {
    pub peaks: Vec<PeakRecord>,
    pub parameters: Vec<SensitivityRecord>,
}

/// Differentiate an orbit.
pub(super) fn sensitivities(
    global: &Global,
    scene: &Scene,
    body: &mut Propagator,
    orbit: &Orbit,
    keys: &[String],
) -> Result<Sensitivities, CliError> {
    let refused = |key: &str, why: &OrbitError| match why {
        OrbitError::Parameter(message) => {
            let help = "leave it out: orbits are differentiated by numbers that enter the equations smoothly";
            CliError::from(scene.error(Issue::new(key, message.to_string(), help)))
        }
        other => CliError::Numerics(other.to_string()),
    };
    let mut found = vec![];
    for key in keys {
        found.push((key, parameter(scene, &body.system, (orbit.closure, orbit.omega()), key)?));
    }
    let mut along = Differentiable::new(body, orbit).map_err(|e| refused("orbit", &e))?;
    let mut parameters = vec![];
    let bar = Bar::named(global, format!("{}, derivatives", scene.stem()));
    for (k, (key, mut parameter)) in found.into_iter().enumerate() {
        bar.iter().for_each(|bar| bar.set(k as f64 / keys.len() as f64, key.clone()));
        let by = along.by(&mut parameter).map_err(|e| refused(key, &e))?;
        let nodal = |x: &[f64]| along.system().body.nodal(x).into_owned();
        let [u0, v0] = [&by.state[0], &by.state[1]].map(|x| nodal(x));
        let multipliers = by.multipliers.iter().map(|m| [m.0, m.1]).collect();
        parameters.push(SensitivityRecord {
            key: key.clone(),
            value: by.value,
            u0,
            v0,
            peaks: by.peaks,
            period: by.period,
            alpha: by.alpha,
            multipliers,
        });
    }
    bar.iter().for_each(Bar::clear);
    let peaks = along.peaks.iter().map(|p| told(p.of, p.value, p.t, along.system())).collect();
    Ok(Sensitivities { peaks, parameters })
}

fn told(of: Observable, value: f64, t: f64, system: &System) -> PeakRecord {
    let node = |point: usize| Some(system.constraints[point].node);
    let (name, node) = match of {
        Observable::Displacement(point) => ("amplitude", node(point)),
        Observable::Pressure(point) => ("pressure", node(point)),
        Observable::Energy => ("energy", None),
    };
    PeakRecord { name, value: if name == "amplitude" { value.abs() } else { value }, t, node }
}

impl Sensitivities {
    /// `peaks` and `sensitivity` of the orbit's JSON.
    pub(super) fn json(&self, object: &mut Value) {
        let peak = |p: &PeakRecord| {
            (p.name.to_owned(), json!({"value": p.value, "t": p.t, "node": p.node}))
        };
        object["peaks"] = Value::Object(self.peaks.iter().map(peak).collect());
        let of = |p: &SensitivityRecord| {
            let mut by = Map::new();
            by.insert("value".into(), json!(p.value));
            for (peak, x) in self.peaks.iter().zip(&p.peaks) {
                by.insert(peak.name.into(), json!(x));
            }
            by.insert("period".into(), json!(p.period));
            by.insert("alpha".into(), json!(p.alpha));
            by.insert("multipliers".into(), json!(p.multipliers));
            (p.key.clone(), Value::Object(by))
        };
        object["sensitivity"] = Value::Object(self.parameters.iter().map(of).collect());
    }

    /// A table: what one per cent more of each parameter makes, in per cent.
    pub(super) fn text(&self, orbit: &Orbit) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "  {:<14}per cent for one per cent more of a number of the scene (of a zero: the derivative)",
            "sensitivity"
        );
        let finds_period = orbit.closure == signorini::orbit::Closure::Limit;
        let mut heads: Vec<&str> = self.peaks.iter().map(|p| p.name).collect();
        let alpha = orbit.viscous.as_ref().map(|v| v.alpha);
        heads.extend(alpha.map(|_| "alpha"));
        heads.extend(finds_period.then_some("period"));
        let widest = self.parameters.iter().map(|p| p.key.chars().count()).max().unwrap_or(0);
        let row = |name: &str, number: &str, cells: Vec<String>| {
            let cells: String = cells.iter().map(|c| format!("{c:>15}")).collect();
            format!("  {:<14}{name:<widest$}  {number:>12}{cells}\n", "")
        };
        out += &row("", "", heads.iter().map(|h| (*h).to_owned()).collect());
        for p in &self.parameters {
            let share = |by: f64, of: f64| match p.value == 0.0 || of == 0.0 {
                true => significant(by, 7),
                false => significant(by * p.value / of, 7),
            };
            let peaks = self.peaks.iter().zip(&p.peaks).map(|(peak, by)| share(*by, peak.value));
            let alpha = alpha.zip(p.alpha).map(|(of, by)| share(by, of));
            let period = finds_period.then(|| share(p.period, orbit.period));
            out +=
                &row(&p.key, &significant(p.value, 6), peaks.chain(alpha).chain(period).collect());
        }
        out
    }
}
