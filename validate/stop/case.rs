//! One bar element before a bilinear stop: `m ü + k u + [P + k_s (u − g)]_{u > g} = f(t)` with `m = 1/3`, `k = 1`.
//!
//! Both phases are harmonic oscillators, `ω_o² = k/m` about zero and `ω_c² = (k + k_s)/m` about `u_e = (k_s g − P)/(k + k_s)`; displacement and velocity are continuous. Free
//! flight from rest at `−a` lasts `2 t₁`, `cos ω_o t₁ = −g/a`; contact `2 t₂`, `cos ω_c t₂ = (g − u_e)/b`, `b² = (g − u_e)² + (v/ω_c)²`. Without gap and preload this is
//! the bilinear frequency `2 ω_o ω_c/(ω_o + ω_c)`.
//!
//! A body that rests against the stop, pushed by less than `P`, stays there until the load exceeds it: `P/2 + P sin Ωt = P` at `Ωt = π/6`. From then on
//! `m d̈ + (k + k_s) d = P sin Ωt − P/2` with the penetration `d = u − g` from rest.

use std::f64::consts::{PI, TAU};

use signorini::event::GrazingKind;
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;

use super::{Case, Check, Effort, Outcome, integrate, scene};

pub const CASE: Case = Case {
    name: "stop",
    title: "one bar element before a bilinear stop with a gap and a preload",
    source: "pencil and paper: matching of two harmonic oscillators; rest under a load below the preload",
    only_by_name: false,
    run,
};

/// Mass and stiffness of the element, stiffness of the stop.
const M: f64 = 1.0 / 3.0;
const K: f64 = 1.0;
const STOP: f64 = 3.0;

/// A motion from rest at `−a` before a stop with a gap and a preload.
struct Motion {
    a: f64,
    /// Half of the free flight, half of the contact.
    t: [f64; 2],
    wo: f64,
    wc: f64,
    middle: f64,
    b: f64,
}

impl Motion {
    fn new(a: f64, gap: f64, preload: f64) -> Motion {
        let (wo, wc) = ((K / M).sqrt(), ((K + STOP) / M).sqrt());
        let middle = (STOP * gap - preload) / (K + STOP);
        let t1 = (-gap / a).acos() / wo;
        let v = a * wo * (wo * t1).sin();
        let b = (gap - middle).hypot(v / wc);
        Motion { a, t: [t1, ((gap - middle) / b).acos() / wc], wo, wc, middle, b }
    }

    fn period(&self) -> f64 {
        2.0 * (self.t[0] + self.t[1])
    }

    /// Displacement and velocity.
    fn at(&self, t: f64) -> (f64, f64) {
        let [t1, t2] = self.t;
        let phase = t % self.period();
        if phase > t1 && phase < t1 + 2.0 * t2 {
            let s = self.wc * (phase - t1 - t2);
            return (self.middle + self.b * s.cos(), -self.b * self.wc * s.sin());
        }
        let s = self.wo * if phase <= t1 { phase } else { phase - self.period() };
        (-self.a * s.cos(), self.a * self.wo * s.sin())
    }

    /// Switches up to a time.
    fn switches(&self, until: f64) -> Vec<f64> {
        let [t1, t2] = self.t;
        let of_period = |k: usize| [t1, t1 + 2.0 * t2].map(|s| k as f64 * self.period() + s);
        let periods = (until / self.period()) as usize + 1;
        (0..periods).flat_map(of_period).filter(|s| *s <= until).collect()
    }
}

/// Final state, states on the way and switches of a free motion.
fn free(text: &str, motion: &Motion, name: &str) -> Result<Vec<Check>, String> {
    let (_, report, trajectory) = integrate(&scene(text, None)?)?;
    let (u, v) = motion.at(report.t_end);
    let last = (report.last.u[0] - u).abs().max((report.last.v[0] - v).abs());
    let stored = trajectory.t.iter().zip(&trajectory.u);
    let way = stored.map(|(&t, u)| (u[0] - motion.at(t).0).abs()).fold(0.0, f64::max);
    let switches = motion.switches(report.t_end);
    let times = report.switches.iter().zip(&switches).map(|(s, t)| (s.t - t).abs());
    Ok(vec![
        Check::at_most(format!("{name}: final state"), last, 1e-11),
        Check::at_most(format!("{name}: displacement at every stored state"), way, 1e-11),
        Check::near(
            format!("{name}: switches"),
            report.switches.len() as f64,
            switches.len() as f64,
            0.0,
        ),
        Check::at_most(format!("{name}: switching times"), times.fold(0.0, f64::max), 1e-11),
        Check::at_most(format!("{name}: energy drift"), report.energy_drift_total, 1e-12),
    ])
}

/// At rest against the stop under a growing load.
fn resting(text: &str) -> Result<Vec<Check>, String> {
    let (gap, preload, load) = (0.5, 0.2, 0.9f64);
    let pushed = format!(
        "{}\n[[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = {}\n\
         [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = {preload}\nomega = {load}\nphase = {}\n",
        text.replace("\"-1.5*x\"", "\"0.5*x\"").replace("until = 20.0", "until = 0.8"),
        K * gap + 0.5 * preload,
        -0.5 * PI,
    );
    let (_, report, trajectory) = integrate(&scene(&pushed, None)?)?;
    let held = report.grazings.iter().filter(|g| g.kind == GrazingKind::Held).count();
    let leaves = PI / 6.0 / load;
    // d = A sin Ωt − P/(2(k + k_s)) + B cos w(t − t₁) + C sin w(t − t₁)
    let w = ((K + STOP) / M).sqrt();
    let forced = preload / (K + STOP - M * load * load);
    let particular = |t: f64| forced * (load * t).sin() - 0.5 * preload / (K + STOP);
    let rate = |t: f64| forced * load * (load * t).cos();
    let s = w * (report.t_end - leaves);
    let d = particular(report.t_end) - particular(leaves) * s.cos() - rate(leaves) / w * s.sin();
    // nothing switches when it is pushed away: it has touched all the time
    let before = trajectory.t.iter().zip(&trajectory.u).filter(|(t, _)| **t <= leaves);
    let still = before.map(|(_, u)| (u[0] - gap).abs()).fold(0.0, f64::max);
    Ok(vec![
        Check::near("rest: held at the start", held as f64, 1.0, 0.0),
        Check::at_most("rest: displacement until it is pushed away", still, 1e-13),
        Check::at_most("rest: penetration at the end", (report.last.u[0] - gap - d).abs(), 1e-9),
    ])
}

/// The frequency of an orbit by shooting, from its energy.
fn orbit(text: &str, motion: &Motion, name: &str) -> Result<Check, String> {
    let problem = Problem::new(&scene(text, None)?, None).map_err(|e| e.to_string())?;
    let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    // frame vectors: the root of twice the energy
    let z = vec![-1.02 * K.sqrt() * motion.a];
    let found = find(&mut body, Closure::Reversible, &z, TAU / motion.period(), &Search::default())
        .map_err(|e| e.to_string())?;
    let orbit = found.orbit().ok_or_else(|| found.to_string())?;
    let energy = 0.5 * K * motion.a * motion.a;
    Ok(Check::at_most(
        format!("{name}: energy of the orbit"),
        (orbit.energy / energy - 1.0).abs(),
        1e-10,
    ))
}

fn run(_: Effort) -> Outcome {
    let text = include_str!("scene.toml");
    let mut checks = free(text, &Motion::new(1.5, 0.5, 0.2), "preload")?;
    for integrator in ["dop853", "chebyshev"] {
        let text = text.replace("[run]\n", &format!("[run]\nintegrator = \"{integrator}\"\n"));
        checks.extend(free(&text, &Motion::new(1.5, 0.5, 0.2), integrator)?);
    }
    let plain = text.replace("preload = 0.2\n", "");
    checks.extend(free(&plain, &Motion::new(1.5, 0.5, 0.0), "no preload")?);
    checks.push(orbit(text, &Motion::new(1.5, 0.5, 0.2), "preload")?);
    // a gap of zero: the breathing crack's frequency, whatever the amplitude
    let closed = plain.replace("gap = 0.5", "gap = 0.0");
    let breathing = Motion::new(1.5, 0.0, 0.0);
    let bilinear = 2.0 * breathing.wo * breathing.wc / (breathing.wo + breathing.wc);
    checks.push(Check::at_most(
        "no gap: bilinear frequency",
        (TAU / breathing.period() / bilinear - 1.0).abs(),
        1e-14,
    ));
    checks.extend(free(&closed, &breathing, "no gap")?);
    checks.extend(resting(text)?);
    Ok(checks)
}
