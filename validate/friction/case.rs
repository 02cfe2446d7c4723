//! Coulomb friction at the contact: closed forms of one oscillator, limit cycles and impacts computed by another program of other design (`friction.md` 15, in Python,
//! dense, sampled events), and random scenes against small projected steps that know no events.
//!
//! - An oscillator on a belt sticks at `asin(V/μN)` (m = k = N = 1, from rest) and breaks loose when the belt has carried it to `μN/k`.
//! - Under `P cos Ωt` it slips without a stop at Den Hartog's amplitude `√((P/kV)² − (μN/kU)²)`, `V = 1/(1 − r²)`, `U = sin(π/r)/(r(1 + cos(π/r)))`, and loses
//!   `4μNA` a period; with two stops it slides from `A` to `−A` from where `P cos φ = A − μN`.
//! - Behind a spring a slider turns, loses and comes to Den Hartog's oscillator as in `sliders.rs`.
//! - The second variant, displacements without mass along the obstacle: `massless.rs`.
//! - Without inertia a bar on a rough floor moves its end by `F²/2qEA`; see `paths.rs`.

#[path = "massless.rs"]
mod massless;
#[path = "paths.rs"]
mod paths;
#[path = "sliders.rs"]
mod sliders;
#[path = "witness.rs"]
mod witness;

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;
use signorini::contact::{
    Gaps, MassChoice, Rayleigh, Rubs, State, Stress, System, Tangent, boundary,
};
use signorini::event::{self, Options, Report, Silent, SwitchKind};
use signorini::families::single::limit_cycle;
use signorini::fem::{Body, ContactRows, Csr};
use signorini::flow::{Flow, Modal, RungeKutta, Tolerances, complex_modes, dop853::DOP853, exact};
use signorini::orbit::search::Verdict;
use signorini::orbit::settle::ladder;
use signorini::orbit::{Orbit, Propagator};
use signorini::problem::Problem;

use super::{Case, Check, Effort, Outcome, integrate, scene};
use witness::Scene;

pub const CASE: Case = Case {
    name: "friction",
    title: "Coulomb friction with tangents that keep their mass, and with tangents that do not",
    source: "closed forms (Den Hartog 1931, an oscillator on a belt); numbers of an independent program in Python; small projected steps",
    only_by_name: false,
    run,
};

const TIGHT: Tolerances = Tolerances { rtol: 1e-13, atol: 1e-15 };

fn sparse(a: &DMatrix<f64>) -> Csr {
    let all = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
    Csr::from_triplets(a.nrows(), a.ncols(), all.map(|(i, j)| (i, j, a[(i, j)])).collect())
}

/// The system of a scene of the witness: contact displacements have no mass.
fn system(scene: &Scene) -> Result<System, String> {
    let (n, c) = (scene.mass.nrows(), scene.gap.len());
    let mass = scene.mass.clone().resize(n + c, n + c, 0.0);
    let contact: Vec<usize> = (n..n + c).collect();
    let body = Body::from_matrices(
        &sparse(&mass),
        &sparse(&scene.stiffness),
        &ContactRows::facing(&contact),
        1.0,
    )
    .map_err(|e| e.to_string())?;
    let operator = boundary::reaction(&body, vec![1.0; c]);
    let tangent = |&(entry, coefficient, surface): &(usize, f64, f64)| {
        let direction = [0.0, 1.0, 0.0];
        Some(Tangent {
            anchor: None,
            row: vec![(entry, 1.0)],
            coefficient,
            surface,
            direction,
            only_slips: false,
        })
    };
    let tangents = scene.tangents.iter().map(tangent).collect();
    let rubs = Rubs { tangents, sliders: vec![] };
    let choice = (Stress::Reaction, MassChoice::Condensed);
    let gaps = Gaps::front(scene.gap.clone());
    let mut system =
        System::with_operator(body, operator, gaps, choice, rubs).map_err(|e| e.to_string())?;
    system.damping = Some(Rayleigh { alpha: scene.alpha, beta: 0.0 }).filter(|d| d.alpha != 0.0);
    system.loads_mut().push(scene.constant.clone(), None, 0.0);
    if scene.harmonic.0.iter().any(|f| *f != 0.0) {
        system.loads_mut().push(scene.harmonic.0.clone(), Some(scene.harmonic.1), 0.0);
    }
    Ok(system)
}

/// A run to a time by a flow.
fn run_by(
    system: &System,
    start: &State,
    until: f64,
    flow: &mut dyn Flow,
) -> Result<Report, String> {
    let options = Options { until, samples: 0, switch_limit: 400.0 };
    let report =
        event::run(system, start, &options, flow, &mut Silent).map_err(|e| e.to_string())?;
    match report.outcome.is_complete() {
        true => Ok(report),
        false => Err(report.outcome.to_string()),
    }
}

fn exactly(scene: &Scene, until: f64) -> Result<Report, String> {
    let system = system(scene)?;
    let (u, v) = scene.start.clone();
    let mut flow = exact(Box::new(Modal::new(&system)), &system);
    run_by(&system, &State { u, v }, until, &mut flow)
}

/// `m = k = N = 1`, the normal displacement before a wall it touches.
fn oscillator(mu: f64, surface: f64, load: f64, omega: f64) -> Scene {
    Scene {
        mass: DMatrix::identity(1, 1),
        stiffness: DMatrix::identity(2, 2),
        gap: vec![0.0],
        tangents: vec![(0, mu, surface)],
        alpha: 0.0,
        constant: vec![0.0, 1.0],
        harmonic: (vec![load, 0.0], omega),
        start: (vec![0.0], vec![0.0]),
    }
}

/// Times of switches of a kind.
fn times(report: &Report, kind: SwitchKind) -> Vec<f64> {
    report.switches.iter().filter(|s| s.kind == kind).map(|s| s.t).collect()
}

fn belt() -> Outcome {
    let report = exactly(&oscillator(0.3, 0.2, 0.0, 1.0), 10.0)?;
    let t: Vec<f64> = report.switches.iter().map(|s| s.t).collect();
    let [stick, slip] = t[..] else { return Err(format!("{} switches on the belt", t.len())) };
    // y = μN (1 − cos t) until the velocity is V, then carried to μN
    let first = (0.2f64 / 0.3).asin();
    let second = first + 0.3 * first.cos() / 0.2;
    Ok(vec![
        Check::at_most("belt: error of the time at which it sticks", (stick - first).abs(), 1e-13),
        Check::at_most("belt: of the time at which it breaks loose", (slip - second).abs(), 1e-12),
    ])
}

/// Amplitude, loss a period and the length of a slide of the forced oscillator, after it has settled.
fn forced(mu: f64, load: f64, omega: f64, periods: f64) -> Result<[f64; 3], String> {
    let scene = oscillator(mu, 0.0, load, omega);
    let period = TAU / omega;
    let long = exactly(&scene, periods * period)?;
    let short = exactly(&scene, (periods - 1.0) * period)?;
    let taken = |r: &Report| r.rubbed.as_ref().map_or(f64::NAN, |r| r.work());
    let loss = taken(&long) - taken(&short);
    let stops = times(&long, SwitchKind::Sticking);
    let begins = times(&long, SwitchKind::Slipping);
    let last = stops.last().zip(begins.iter().rev().find(|t| Some(*t) < stops.last()));
    let length = last.map_or(f64::NAN, |(end, begin)| end - begin);
    Ok([loss / (4.0 * mu), loss, length])
}

fn den_hartog() -> Outcome {
    let (mu, load, r): (f64, f64, f64) = (0.3, 0.6, 0.7);
    let v = 1.0 / (1.0 - r * r);
    let u = (PI / r).sin() / (r * (1.0 + (PI / r).cos()));
    let amplitude = ((load * v).powi(2) - (mu * u).powi(2)).sqrt();
    let [found, ..] = forced(mu, load, r, 400.0)?;
    // two stops: P cos φ = A − μN when it breaks loose at A, and it slides to −A
    let [two, _, slide] = forced(0.5, 0.6, 0.25, 40.0)?;
    let shot = |mu: f64, load: f64, omega: f64| -> Result<f64, String> {
        let scene = oscillator(mu, 0.0, load, omega);
        let mut body = Propagator::new(system(&scene)?).map_err(|e| e.to_string())?;
        let rest = vec![0.0; 2 * body.n()];
        let orbit = shoot(&mut body, rest, omega)?;
        Ok(work(&orbit) / (4.0 * mu))
    };
    let [without, stops] = [shot(mu, load, r)?, shot(0.5, 0.6, 0.25)?];
    Ok(vec![
        Check::near("Den Hartog: amplitude of the orbit", without, amplitude, 1e-11),
        Check::near("two stops a period: amplitude of the orbit", stops, 0.289_654_587_760, 1e-11),
        Check::near("Den Hartog: amplitude without a stop", found, amplitude, 1e-10),
        Check::near("two stops a period: amplitude", two, 0.289_654_587_760, 1e-10),
        Check::near("two stops a period: length of a slide", slide, 4.667_659_744, 1e-9),
    ])
}

/// The orbit of the loads' period from a guess.
fn shoot(body: &mut Propagator, z: Vec<f64>, omega: f64) -> Result<Box<Orbit>, String> {
    ladder(body, &[z], omega).map_err(|e| e.to_string())?
}

/// What friction takes a period.
fn work(orbit: &Orbit) -> f64 {
    orbit.rubbed.as_ref().map_or(f64::NAN, |r| r.work())
}

/// Hoffmann's two displacements on a belt: period and friction of the limit cycle.
fn squeal() -> Outcome {
    let third = 3f64.sqrt();
    // springs of 11 and 20 at 150° and 30°, one of 11 at the contact
    let [k11, k12, k22] = [0.75 * 31.0, 0.25 * third * 9.0, 0.25 * 31.0 + 11.0];
    let stiffness =
        DMatrix::from_row_slice(3, 3, &[k11, k12, 0.0, k12, k22, -11.0, 0.0, -11.0, 11.0]);
    let mut checks = vec![];
    for (mu, surface, alpha, period, loss) in [
        (0.5, 0.05, 0.02, 1.489_747_372_922, 0.020_326_578_686),
        (0.6, 0.02, 0.2, 1.459_873_354_868, 0.006_138_212_840),
        (0.6, 0.05, 0.1, 1.536_507_806_750, 0.011_543_792_220),
    ] {
        let scene = Scene {
            mass: DMatrix::identity(2, 2),
            stiffness: stiffness.clone(),
            gap: vec![0.0],
            tangents: vec![(0, mu, surface)],
            alpha,
            constant: vec![0.0, 1.0, 0.0],
            harmonic: (vec![0.0; 3], 1.0),
            start: (vec![0.0; 2], vec![0.0; 2]),
        };
        let until = 900.0;
        let report = exactly(&scene, until)?;
        let sticks = times(&report, SwitchKind::Sticking);
        let found = match sticks[..] {
            [.., a, b] => b - a,
            _ => f64::NAN,
        };
        let later = exactly(&scene, until + period)?;
        let taken = |r: &Report| r.rubbed.as_ref().map_or(f64::NAN, |r| r.work());
        let name = format!("two displacements on a belt, μ = {mu}, V = {surface}");
        checks.push(Check::near(format!("{name}: period"), found, period, 1e-10));
        let change = taken(&later) - taken(&report);
        checks.push(Check::near(format!("{name}: friction a period"), change, loss, 1e-9));
        let mut body = Propagator::new(system(&scene)?).map_err(|e| e.to_string())?;
        let (u, v) = scene.start.clone();
        let found = limit_cycle(&mut body, &State { u, v }, None).map_err(|e| e.to_string())?;
        let Verdict::Orbit(orbit) = found else { return Err(format!("{name}: {found}")) };
        checks.push(Check::near(
            format!("{name}: period of the orbit"),
            orbit.period,
            period,
            1e-11,
        ));
        let text = format!("{name}: friction of the orbit");
        checks.push(Check::near(text, work(&orbit), loss, 2e-10));
    }
    Ok(checks)
}

/// Growth rates about steady sliding of the same: `det([k₁₁ + λ², k₁₂ + μk₃; k₁₂, k₂₂ + λ²]) = 0`, a quadratic in `λ²`.
fn flutter() -> Outcome {
    let third = 3f64.sqrt();
    let [k11, k12, k22, k3] = [0.75 * 31.0, 0.25 * third * 9.0, 0.25 * 31.0 + 11.0, 11.0];
    let mut checks = vec![];
    for (mu, growth) in [(0.5, 0.118_690_019_100), (0.6, 0.254_812_981_182)] {
        let scene = Scene {
            mass: DMatrix::identity(2, 2),
            stiffness: DMatrix::from_row_slice(3, 3, &[k11, k12, 0.0, k12, k22, -k3, 0.0, -k3, k3]),
            gap: vec![0.0],
            tangents: vec![(0, mu, 0.05)],
            alpha: 0.0,
            constant: vec![0.0, 1.0, 0.0],
            harmonic: (vec![0.0; 3], 1.0),
            start: (vec![0.0; 2], vec![0.0; 2]),
        };
        let system = system(&scene)?;
        let (set, _) = system.equilibrium().map_err(|e| e.to_string())?;
        let modes = complex_modes(&system, &system.phase(&set)).map_err(|e| e.to_string())?;
        let found = modes.first().map_or(f64::NAN, |m| m.lambda.re);
        let name = format!("steady sliding, μ = {mu}: growth rate");
        checks.push(Check::near(name.clone(), found, growth, 1e-11));
        // λ² = −s ± i d of a pair, and the root with a positive real part; friction pulls by −σμk₃ where σ = −sgn V
        let half = 0.5 * (k11 + k22);
        let square = (0.5 * (k11 - k22)).powi(2) + k12 * (k12 - mu * k3);
        let root = (half * half + square.abs()).sqrt();
        let closed = (0.5 * (root - half)).sqrt();
        checks.push(Check::near(format!("{name}, closed form"), found, closed, 1e-12));
    }
    Ok(checks)
}

/// Mean velocities along x and y of a body of mass 0.5.
fn velocities(problem: &Problem, last: &State) -> [f64; 2] {
    [[1.0, 0.0], [0.0, 1.0]].map(|axis| {
        let force = problem.system.gravity(&axis);
        last.v.iter().zip(&force).map(|(v, f)| v * f).sum::<f64>() / 0.5
    })
}

/// Free plates thrown against a rough wall.
fn impacts(effort: Effort) -> Outcome {
    let text = include_str!("plate.toml");
    let mut checks = vec![];
    for (elements, mu, energy, mean, switches) in [
        ([4, 8], "0.1", 0.011_271_002_853, [-0.181_433_465_024, 0.062_069_069_182], 22),
        ([4, 8], "0.3", 0.011_691_924_914, [-0.189_489_530_949, 0.008_415_078_304], 36),
        ([6, 12], "0.3", 0.011_828_382_008, [-0.189_613_975_015, 0.006_956_396_839], 70),
        ([3, 6], "3.0", 0.012_252_151_061, [-0.198_606_350_908, -0.013_000_525_054], 28),
    ] {
        if effort.short && elements[0] > 4 {
            continue;
        }
        let text = text.replace("friction = 0.3", &format!("friction = {mu}"));
        let [nx, ny] = elements;
        let name = format!("plate {nx} × {ny}, μ = {mu}");
        for (integrator, off) in [("modal", 1e-10), ("dop853", 1e-10)] {
            let more = format!("integrator = \"{integrator}\"\nrtol = 1e-12\natol = 1e-14");
            let more = if integrator == "modal" { "integrator = \"modal\"" } else { &more };
            let text = text.replace("integrator = \"modal\"", more);
            let (problem, report, _) = integrate(&scene(&text, Some(&elements))?)?;
            let found = velocities(&problem, &report.last);
            for (axis, (found, wanted)) in ["x", "y"].into_iter().zip(found.into_iter().zip(mean)) {
                let text = format!("{name}, {integrator}: mean velocity along {axis}");
                checks.push(Check::near(text, found, wanted, 1e-9));
            }
            let found = report.energy_end;
            checks.push(Check::near(format!("{name}, {integrator}: energy"), found, energy, off));
            let drift = report.energy_drift_total;
            checks.push(Check::at_most(format!("{name}, {integrator}: ledger"), drift, 1e-12));
            let count = report.log.switches() as f64;
            let text = format!("{name}, {integrator}: switches");
            checks.push(Check::near(text, count, f64::from(switches), 0.0));
        }
    }
    Ok(checks)
}

/// What friction takes a period of a block that is shaken: by shooting; the same period by Dormand–Prince from the orbit's state. The independent program looks at the motion of 6 × 12
/// elements at instants of a grid and finds 102 switches and 0.004402789214; every switch proved there are 108.
fn block(effort: Effort) -> Outcome {
    let text = include_str!("block.toml");
    let mut checks = vec![];
    for (elements, loss) in
        [([3, 6], Some(0.002_816_936_649)), ([4, 8], Some(0.003_004_480_531)), ([6, 12], None)]
    {
        if effort.short && elements[0] > 3 {
            continue;
        }
        let [nx, ny] = elements;
        let name = format!("shaken block {nx} × {ny}");
        let problem =
            Problem::new(&scene(text, Some(&elements))?, None).map_err(|e| e.to_string())?;
        let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
        let start = body.frame(&problem.initial);
        let orbit = shoot(&mut body, start, 1.0)?;
        if let Some(loss) = loss {
            let text = format!("{name}: friction a period");
            checks.push(Check::near(text, work(&orbit), loss, 2e-10));
        }
        let family = orbit.residual_positions().map_or(f64::NAN, |k| k as f64);
        let text = format!("{name}: residual positions, parameters");
        checks.push(Check::near(text, family, 1.0, 0.0));
        let system = &body.system;
        let mut flow = RungeKutta::new(system, &DOP853, TIGHT);
        let there = run_by(system, &orbit.state, TAU, &mut flow)?;
        let taken = there.rubbed.as_ref().map_or(f64::NAN, |r| r.work());
        let text = format!("{name}: friction by Dormand-Prince from the orbit's state");
        checks.push(Check::near(text, taken, work(&orbit), 1e-10));
        let off = |a: &[f64], b: &[f64]| -> f64 {
            let size = b.iter().fold(0.0f64, |m, b| m.max(b.abs()));
            a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / size
        };
        let back = off(&there.last.u, &orbit.state.u).max(off(&there.last.v, &orbit.state.v));
        checks.push(Check::at_most(format!("{name}: return by Dormand-Prince"), back, 1e-9));
    }
    Ok(checks)
}

/// Pseudo-random numbers: xorshift.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }

    /// `A Aᵀ/n + I`
    fn positive(&mut self, n: usize) -> DMatrix<f64> {
        let a = DMatrix::from_fn(n, n, |_, _| self.between(-1.0, 1.0));
        &a * a.transpose() / n as f64 + DMatrix::identity(n, n)
    }
}

/// A random body before one to three obstacles, some of which move along themselves, pressed, shaken, thrown.
fn random_scene(seed: u64) -> Scene {
    let mut r = Random(0x9e37_79b9_7f4a_7c15 ^ (seed + 1).wrapping_mul(0x2545_f491_4f6c_dd1d));
    for _ in 0..8 {
        r.unit();
    }
    let c = 1 + r.below(3);
    let n = c + 1 + r.below(3);
    let belt = r.unit() < 0.5;
    let tangent = |r: &mut Random, e: usize| {
        let mu = if r.unit() < 0.2 { r.between(1.0, 4.0) } else { r.between(0.05, 1.0) };
        (e, mu, if belt { r.between(-0.5, 0.5) } else { 0.0 })
    };
    let tangents = (0..c).map(|e| tangent(&mut r, e)).collect();
    let mut list = |count: usize, size: f64| -> Vec<f64> {
        (0..count).map(|_| r.between(-size, size)).collect()
    };
    let mut constant = list(n + c, 0.4);
    constant[n..].iter_mut().for_each(|f| *f += 0.5);
    let (harmonic, u, v) = (list(n + c, 0.8), list(n, 0.5), list(n, 1.0));
    let gap = list(c, 0.3);
    let omega = r.between(0.5, 3.0);
    let alpha = if r.unit() < 0.5 { 0.0 } else { r.between(0.0, 0.2) };
    let stiffness = 3.0 * r.positive(n + c);
    Scene {
        mass: r.positive(n),
        stiffness,
        gap,
        tangents,
        alpha,
        constant,
        harmonic: (harmonic, omega),
        start: (u, v),
    }
}

/// Random scenes by modes, by Dormand–Prince, and by small steps.
fn random(effort: Effort) -> Outcome {
    const UNTIL: f64 = 6.0;
    const NEAR: f64 = 1e-4;
    let count = if effort.short { 100 } else { 1000 };
    let (mut flows, mut steps, mut ledger, mut switches) = (0.0f64, 0.0f64, 0.0f64, 0usize);
    let (mut differ, mut refined) = (0usize, 0usize);
    for seed in 0..count {
        let scene = random_scene(seed);
        let failed = |e: String| format!("scene {seed}: {e}");
        let modal = exactly(&scene, UNTIL).map_err(failed)?;
        let system = system(&scene)?;
        let start = State { u: scene.start.0.clone(), v: scene.start.1.clone() };
        let mut flow = RungeKutta::new(&system, &DOP853, TIGHT);
        let by_steps = run_by(&system, &start, UNTIL, &mut flow).map_err(failed)?;
        let distance = |a: &State, b: &State| {
            let all = |s: &State| s.u.iter().chain(&s.v).copied().collect::<Vec<f64>>();
            let (a, b) = (all(a), all(b));
            let size = a.iter().fold(1.0f64, |m, x| m.max(x.abs()));
            a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
        };
        flows = flows.max(distance(&modal.last, &by_steps.last));
        differ += usize::from(modal.log.switches() != by_steps.log.switches());
        ledger = ledger.max(modal.energy_drift_total).max(by_steps.energy_drift_total);
        switches += modal.log.switches();
        // the witness is of first order: where its steps are too long they are shortened
        let off = |steps: usize| {
            let (u, v, _) = scene.march(UNTIL, steps);
            let state = State { u: u.as_slice().to_vec(), v: v.as_slice().to_vec() };
            distance(&modal.last, &state)
        };
        let coarse = off(16_000);
        let fine = if coarse > NEAR { off(256_000) } else { coarse };
        refined += usize::from(coarse > NEAR);
        steps = steps.max(fine);
    }
    let name = format!("{count} random scenes");
    Ok(vec![
        Check::at_least(format!("{name}: switches"), switches as f64, 5.0 * count as f64),
        Check::at_most(format!("{name}: states by modes and by Dormand–Prince"), flows, 1e-8),
        Check::at_most(format!("{name}: with another number of switches"), differ as f64, 0.0),
        Check::at_most(format!("{name}: ledger"), ledger, 1e-11),
        Check::at_most(format!("{name}: distance from small steps"), steps, NEAR),
        Check::at_most(
            format!("{name}: of these with 256,000 steps in place of 16,000"),
            refined as f64,
            0.1 * count as f64,
        ),
    ])
}

fn run(effort: Effort) -> Outcome {
    let mut checks = belt()?;
    checks.extend(den_hartog()?);
    checks.extend(squeal()?);
    checks.extend(flutter()?);
    checks.extend(impacts(effort)?);
    checks.extend(block(effort)?);
    checks.extend(massless::run(effort)?);
    checks.extend(paths::run()?);
    checks.extend(sliders::run()?);
    checks.extend(random(effort)?);
    Ok(checks)
}
