//! An oscillator `m = k = 1` whose slider of limit `f` lies behind a spring `k_t`: the contact node without tangential mass of `friction.md` 15 under a pressure of one.
//!
//! - Free it turns at `A ↦ −a + √((A − a)² + 4ab)`, `a = f/k`, `b = f/k_t`.
//! - Under `P cos Ωt` it loses `4f(A − f/k_t)` a period, and comes to Den Hartog's amplitude like `k_t^{−½}`.

use signorini::event::SwitchKind;
use signorini::orbit::Propagator;
use signorini::problem::Problem;

use super::super::{Check, Outcome, integrate, scene};
use super::{shoot, times, work};

fn oscillator(limit: f64, stiffness: f64, more: &str) -> String {
    format!(
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [[slider]]\nat = [1.0]\nlimit = {limit:?}\nstiffness = {stiffness:?}\n{more}"
    )
}

fn free() -> Outcome {
    let (limit, stiffness, start) = (0.3, 10.0, 5.0);
    let run = |until: f64| {
        let more = format!("[initial]\ndisplacement = ['{start}*x']\n[run]\nuntil = {until:?}\n");
        integrate(&scene(&oscillator(limit, stiffness, &more), None)?).map(|(_, report, _)| report)
    };
    let long = run(60.0)?;
    let turns = times(&long, SwitchKind::Sticking);
    let (a, b) = (limit, limit / stiffness);
    let (mut amplitude, mut checks) = (start, vec![]);
    for (k, when) in [3.128_744_981_404, 6.254_714_527_092].into_iter().enumerate() {
        amplitude = -a + ((amplitude - a).powi(2) + 4.0 * a * b).sqrt();
        let name = format!("spring and slider, free: turn {}", k + 1);
        let found = turns.get(k).copied().unwrap_or(f64::NAN);
        checks.push(Check::near(format!("{name}, time"), found, when, 1e-12));
        let there = run(when)?.last.u[0].abs();
        checks.push(Check::near(format!("{name}, displacement"), there, amplitude, 1e-12));
    }
    let lost = long.rubbed.as_ref().map_or(f64::NAN, |r| r.work());
    let name = "spring and slider, free: friction until t = 60";
    checks.push(Check::near(name, lost, 12.493_986_214_706, 1e-12));
    Ok(checks)
}

/// Limit, stiffness of the spring, load, its frequency, damping in proportion to the mass.
type Forced = (f64, f64, f64, f64, f64);

/// Amplitude, friction a period and largest multiplier of the orbit.
fn forced(of: Forced) -> Result<[f64; 3], String> {
    let (limit, stiffness, load, omega, alpha) = of;
    let more = format!(
        "[[load]]\nkind = 'point'\nat = [1.0]\namplitude = {load:?}\nomega = {omega:?}\n[damping]\nrayleigh = [{alpha:?}, 0.0]\n[initial]\ndisplacement = ['0.9*x']\n"
    );
    let scene = scene(&oscillator(limit, stiffness, &more), None)?;
    let problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
    let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    let start = body.frame(&problem.initial);
    let orbit = shoot(&mut body, start, omega)?;
    let lost = work(&orbit);
    let largest = orbit.stability.as_ref().map_or(f64::NAN, |s| s.largest);
    Ok([lost / (4.0 * limit) + limit / stiffness, lost, largest])
}

pub fn run() -> Outcome {
    let mut checks = free()?;
    for (of, amplitude, lost) in [
        ((0.4, 3.0, 0.9, 0.8, 0.02), 1.652_663_708_462, 2.430_928_600_205),
        ((0.3, 10.0, 0.6, 0.7, 0.0), 0.867_849_979_010, 1.005_419_974_812),
    ] {
        let [found, work, largest] = forced(of)?;
        let name = format!("spring and slider, forced, k_t = {}", of.1);
        checks.push(Check::near(format!("{name}: amplitude"), found, amplitude, 1e-11));
        checks.push(Check::near(format!("{name}: friction a period"), work, lost, 1e-11));
        if of.4 > 0.0 {
            let name = format!("{name}: largest multiplier");
            checks.push(Check::near(name, largest, 0.394_610_52, 1e-7));
        }
    }
    for (stiffness, amplitude) in
        [(1e2, 0.994_181_321_0), (1e4, 1.041_497_902_0), (1e6, 1.046_048_761_8)]
    {
        let [found, ..] = forced((0.3, stiffness, 0.6, 0.7, 0.0))?;
        let name = format!("towards Den Hartog, k_t = {stiffness:e}: amplitude");
        checks.push(Check::near(name, found, amplitude, 1e-10));
    }
    Ok(checks)
}
