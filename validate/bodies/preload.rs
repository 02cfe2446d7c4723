//! Joints that a preload holds together, through their opening.

use signorini::contact::phase_modes;
use signorini::hbm::newton::Settings;
use signorini::hbm::viscous::Viscous;
use signorini::orbit::search::{Effort as Search, Verdict, chain_of, find};
use signorini::orbit::{Closure, Orbit, Pin, Propagator};
use signorini::problem::Problem;

use super::super::{Check, Effort, nodal_x, scene};
use super::{go, hold, plate};

/// Two masses, 1 and 2, on massless springs, 3 and 6, whose tips a bolt presses together.
pub(super) fn joint(checks: &mut Vec<Check>) -> Result<(), String> {
    let (pressed, open, mass, rest) = (2.5f64, 0.5f64, 2.0 / 3.0f64, 0.08);
    for (ratio, omega) in [
        (1.5, 1.822_946_654_139),
        (2.0, 1.705_019_142_953),
        (4.0, 1.460_636_010_419),
        (8.0, 1.324_118_374_596),
    ] {
        let (k1, k2, a) = (pressed, open, ratio * rest);
        let (w1, w2) = ((k1 / mass).sqrt(), (k2 / mass).sqrt());
        let centre = rest * (1.0 - k1 / k2);
        let b = ((rest - centre).powi(2) + k1 / k2 * (a * a - rest * rest)).sqrt();
        let period = 2.0 / w1 * (std::f64::consts::PI - (rest / a).acos())
            + 2.0 / w2 * ((rest - centre) / b).acos();
        let name = format!("joint at A = {ratio} x_s");
        checks.push(Check::near(
            format!("{name}: frequency, closed form"),
            std::f64::consts::TAU / period,
            omega,
            1e-12,
        ));
        // pressed by A more than at rest; the tips follow
        let closing = rest + a;
        let element = |name: &str, stiff: f64, heavy: f64, at: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nkind = \"bar\"\nsize = [1.0]\nelements = [1]\nyoung = {stiff:?}\ndensity = {heavy:?}\nmove = [{at:?}]\n"
            )
        };
        let text = element("a", 3.0, 1.0, 0.0)
            + &element("b", 6.0, 2.0, 1.0)
            + "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\n[[spring]]\nedge = \"a:left\"\nto = \"b:right\"\nstiffness = 0.5\npreload = 0.2\n"
            + &format!(
                "[initial]\ndisplacement = {{ a = [\"{:?}*(1-x)\"], b = [\"{:?}*(x-1)\"] }}\n[run]\nuntil = {period:?}\nsamples = 1\n",
                closing * 2.0 / 3.0,
                -closing / 3.0
            );
        let (problem, report, _) = go(&text)?;
        let off =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let back =
            off(&report.last.u, &problem.initial.u).max(off(&report.last.v, &problem.initial.v));
        checks.push(Check::at_most(format!("{name}: return after a period"), back, 1e-13));
    }
    Ok(())
}

/// A row of the table: elements of the two blocks, whose surfaces are massless, frequencies closed and open, the face's displacement at the first opening,
/// frequencies at these amplitudes over it, the energy at twice.
struct Row {
    elements: [[usize; 2]; 2],
    sides: &'static str,
    closed: f64,
    open: f64,
    first: f64,
    omegas: [f64; 6],
    energy: f64,
}

const AMPLITUDES: [f64; 6] = [1.05, 1.10, 1.28, 1.5, 2.0, 3.0];

const ROWS: [Row; 4] = [
    Row {
        elements: [[4, 2], [4, 2]],
        sides: "both",
        closed: 0.986_076_980_6,
        open: 0.594_165_5,
        first: 0.089_980_088_4,
        omegas: [
            0.985_415_77,
            0.976_358_94,
            0.922_009_79,
            0.888_585_28,
            0.845_091_99,
            0.804_920_65,
        ],
        energy: 0.018_728_80,
    },
    Row {
        elements: [[6, 3], [6, 4]],
        sides: "both",
        closed: 0.984_299_495_8,
        open: 0.593_531_3,
        first: 0.090_995_567_0,
        omegas: [
            0.983_673_62,
            0.976_873_62,
            0.928_614_16,
            0.886_262_08,
            0.840_919_54,
            0.799_904_17,
        ],
        energy: 0.019_962_99,
    },
    Row {
        elements: [[8, 4], [8, 5]],
        sides: "both",
        closed: 0.983_573_964_3,
        open: 0.593_342_3,
        first: 0.091_410_381_0,
        omegas: [
            0.982_959_53,
            0.976_862_17,
            0.931_718_72,
            0.885_259_02,
            0.838_913_13,
            0.797_681_58,
        ],
        energy: 0.020_509_10,
    },
    Row {
        elements: [[4, 2], [4, 2]],
        sides: "slave",
        closed: 0.997_379_556_7,
        open: 0.593_751_1,
        first: 0.089_124_449_3,
        omegas: [
            0.996_671_55,
            // printed .98490260 there, a 0 for a 2: all other digits of the row are these
            0.984_922_60,
            0.926_631_70,
            0.890_938_06,
            0.847_029_76,
            0.804_437_99,
        ],
        energy: 0.019_354_72,
    },
];

fn pressed([a, b]: [[usize; 2]; 2], sides: &str) -> String {
    plate("a", [1.0, 0.5], a, 0.0)
        + &plate("b", [1.0, 0.5], b, 1.0)
        + &hold("a:left", "[\"x\", \"y\"]")
        + &hold("a:bottom", "[\"y\"]")
        + &hold("b:bottom", "[\"y\"]")
        + &format!(
            "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\ngap = 0.0\nprojection = \"dual\"\nsides = \"{sides}\"\n"
        )
        + "[[spring]]\nedge = \"b:right\"\ndirection = [1.0, 0.0]\nstiffness = 0.2\n"
        + "[[load]]\nkind = \"traction\"\nedge = \"b:right\"\namplitude = [-0.1, 0.0]\n"
        + "[initial]\nequilibrium = true\n[orbit]\nomega = 0.9\n"
}

/// The mean of `u_x` over the face that the spring holds, `∫u_x ds / .5`.
fn face(problem: &Problem, u: &[f64]) -> f64 {
    let nodes = problem.system.body.mesh.nodes();
    let end = nodes.iter().fold(0.0f64, |m, x| m.max(x[0]));
    let mut on: Vec<usize> = (0..nodes.len()).filter(|n| nodes[*n][0] > end - 1e-9).collect();
    on.sort_by(|a, b| nodes[*a][1].total_cmp(&nodes[*b][1]));
    let part = |w: &[usize]| {
        let length = nodes[w[1]][1] - nodes[w[0]][1];
        0.5 * length * (nodal_x(problem, u, w[0]) + nodal_x(problem, u, w[1]))
    };
    on.windows(2).map(part).sum::<f64>() / 0.5
}

/// Where a displacement `of(u)` is least: it, and `H − fᵀu` there. Of several turning points in a period it is the last.
pub(super) fn turning_point(
    body: &Propagator,
    orbit: &Orbit,
    of: &dyn Fn(&[f64]) -> f64,
) -> Result<(f64, f64), String> {
    let system = &body.system;
    let words = |e: &dyn std::fmt::Display| e.to_string();
    let (chain, times) = chain_of(body, orbit).map_err(|e| words(&e))?;
    let z = orbit.closure.frame(&orbit.z);
    let walk = body.walk(&chain, z, &times, orbit.period).map_err(|e| words(&e))?;
    let phases: Vec<_> = chain.sets.iter().map(|set| system.phase(set)).collect();
    let at = |t: f64| -> Option<(f64, f64, f64)> {
        let (k, u_o, v_o) = walk.state(t)?;
        let (mut u, mut v) = (vec![0.0; system.n()], vec![0.0; system.n()]);
        phases[k].expand_displacement(t, &u_o, &mut u);
        phases[k].expand_velocity(t, &v_o, &mut v);
        let energy = system.elastic(t, &u) + system.kinetic(t, &v);
        Some((of(&u), of(&v), energy - system.loads.constant_potential(&u)))
    };
    let none = || "no state along the orbit".to_owned();
    // where the velocity passes zero upwards, by halving
    let steps = 400;
    let mut best = None;
    let mut last = at(0.0).ok_or_else(none)?;
    for k in 1..=steps {
        let time = |k: usize| orbit.period * k as f64 / steps as f64;
        let now = at(time(k)).ok_or_else(none)?;
        if last.1 < 0.0 && now.1 >= 0.0 {
            let (mut a, mut b) = (time(k - 1), time(k));
            while b - a > 1e-13 {
                let middle = 0.5 * (a + b);
                if at(middle).ok_or_else(none)?.1 < 0.0 { a = middle } else { b = middle }
            }
            best = at(b);
        }
        last = now;
    }
    let (there, _, energy) = best.ok_or_else(none)?;
    Ok((there, energy))
}

/// How far the face goes to the left of where it rests, and the energy there beyond that of the rest: at large amplitudes it turns twice there, and the turning point before `t = 0` is that
/// of small ones.
fn farthest(problem: &Problem, body: &Propagator, orbit: &Orbit) -> Result<(f64, f64), String> {
    let (there, energy) = turning_point(body, orbit, &|u| face(problem, u))?;
    let (still, still_energy) = at_rest(problem, body)?;
    Ok((still - there, energy - still_energy))
}

fn at_rest(problem: &Problem, body: &Propagator) -> Result<(f64, f64), String> {
    let system = &body.system;
    let rest = system.rest().ok_or("no equilibrium")?;
    let mut u = vec![0.0; system.n()];
    system.phase(&rest.set).expand_displacement(0.0, &rest.u, &mut u);
    let energy = system.elastic(0.0, &u) - system.loads.constant_potential(&u);
    Ok((face(problem, &u), energy))
}

fn set_up(text: &str) -> Result<(Problem, Propagator, Pin), String> {
    let problem = Problem::new(&scene(text, None)?, None).map_err(|e| e.to_string())?;
    let body = Propagator::new(problem.system.clone()).map_err(|e| e.to_string())?;
    let pin = Pin::new(&body, 0, 0.05);
    Ok((problem, body, pin))
}

fn shot(body: &mut Propagator, pin: Pin, guess: &[f64], omega: f64) -> Result<Box<Orbit>, String> {
    match find(body, Closure::Viscous(pin), guess, omega, &Search::default()) {
        Ok(Verdict::Orbit(orbit)) => Ok(orbit),
        Ok(other) => Err(format!("no viscous mode at {omega}: {other}")),
        Err(e) => Err(e.to_string()),
    }
}

struct Reached {
    omega: f64,
    energy: f64,
}

/// The orbit at an amplitude of the face over that of the first opening, by secants in the frequency from a guess, between bounds once there are some; `z` is one nearby, then the one
/// that was found.
fn reach(
    problem: &Problem,
    body: &mut Propagator,
    (pin, first): (Pin, f64),
    (a, guess): (f64, f64),
    z: &mut Option<Vec<f64>>,
) -> Result<Reached, String> {
    let mut omega = guess;
    let mut points: Vec<(f64, f64)> = vec![];
    for _ in 0..60 {
        let guesses: Vec<Vec<f64>> = match z.as_ref() {
            Some(z) => vec![z.clone()],
            None => pin.guesses(body, omega),
        };
        let orbit = guesses.iter().find_map(|g| shot(body, pin, g, omega).ok());
        let orbit = orbit.ok_or_else(|| format!("no orbit at {omega}"))?;
        let (reached, energy) = farthest(problem, body, &orbit)?;
        *z = Some(orbit.z.clone());
        let off = reached / first - a;
        if off.abs() < 1e-9 {
            return Ok(Reached { omega, energy });
        }
        points.push((omega, off));
        let secant = match &points[..] {
            [.., (w0, f0), (w1, f1)] => w1 - f1 * (w1 - w0) / (f1 - f0),
            _ => guess * 1.0004,
        };
        // the amplitude falls with the frequency
        let above = points.iter().filter(|p| p.1 < 0.0).map(|p| p.0).fold(f64::INFINITY, f64::min);
        let below = points.iter().filter(|p| p.1 > 0.0).map(|p| p.0).fold(0.0, f64::max);
        let is_between = below > 0.0 && above.is_finite();
        let is_good = secant > below && secant < above && secant < pin.omega;
        omega = match (is_good, is_between) {
            (true, _) => secant,
            (false, true) => 0.5 * (below + above),
            (false, false) => omega + 0.3 * (secant - omega).clamp(-0.002, 0.002),
        };
    }
    Err(format!("no orbit of amplitude {a}"))
}

/// Two blocks in series, pressed together by a force through a spring to the ground: their viscous mode (`β = .05`) at amplitudes of the face over that at which the joint first opens.
pub(super) fn blocks(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    for row in &ROWS {
        let name = format!("pressed blocks {:?}, {}", row.elements, row.sides);
        let (problem, mut body, pin) = set_up(&pressed(row.elements, row.sides))?;
        let system = &body.system;
        let rest = system.rest().ok_or("no equilibrium")?;
        checks.push(Check::near(format!("{name}: frequency closed"), pin.omega, row.closed, 1e-9));
        let open = phase_modes(system, &system.open_phase(), 1).map_err(|e| e.to_string())?;
        checks.push(Check::near(format!("{name}: frequency open"), open.omega[0], row.open, 1e-7));
        let modes = phase_modes(system, &system.phase(&rest.set), 1).map_err(|e| e.to_string())?;
        let far = rest.first_switch(system, &modes.shapes[0]).ok_or("opens nothing")?;
        let mut u = vec![0.0; system.n()];
        system.phase(&rest.set).expand(&modes.shapes[0], &mut u);
        let first = far.abs() * face(&problem, &u).abs();
        checks.push(Check::near(format!("{name}: first opening"), first, row.first, 1e-9));
        // from twice the first opening down, and up
        let down: &[usize] = if effort.short { &[4, 2, 0] } else { &[4, 3, 2, 1, 0] };
        let mut from_two = None;
        let mut z: Option<Vec<f64>> = None;
        for &k in down {
            let (a, expected) = (AMPLITUDES[k], row.omegas[k]);
            let found = reach(&problem, &mut body, (pin, first), (a, expected * 0.9993), &mut z)?;
            let what = format!("{name}: frequency at a = {a}");
            checks.push(Check::near(what, found.omega, expected, 2e-8));
            if a == 2.0 {
                from_two = z.clone();
                let what = format!("{name}: energy at a = 2");
                checks.push(Check::near(what, found.energy, row.energy, 3e-7));
            }
        }
        if effort.short {
            continue;
        }
        let mut z = from_two;
        let (low, high) = (row.omegas[4], row.omegas[5]);
        let mut omega = low;
        for step in 1..=8 {
            let share = f64::from(step) / 8.0;
            let guess = omega + (high - low) / 8.0;
            omega = reach(&problem, &mut body, (pin, first), (2.0 + share, guess), &mut z)?.omega;
        }
        checks.push(Check::near(format!("{name}: frequency at a = 3"), omega, high, 2e-8));
    }
    harmonics(checks)
}

/// A viscous mode by harmonic balance beside the orbit: `|E/E_orbit − 1|` at `t = 0` and `‖z − z_orbit‖/‖z_orbit‖`, for so many harmonics; what another program printed of both with one or two
/// digits.
pub(super) fn beside_harmonics(
    name: &str,
    (body, pin): (&Propagator, Pin),
    orbit: &Orbit,
    printed: &[(usize, [f64; 2])],
    checks: &mut Vec<Check>,
) -> Result<(), String> {
    let words = |e: &dyn std::fmt::Display| e.to_string();
    let mut viscous = Viscous::new(body.system.clone(), pin).map_err(|e| words(&e))?;
    for &(n_h, wanted) in printed {
        let found = viscous.from_mode(n_h, orbit.omega(), &Settings::default());
        let fed = found.map_err(|e| words(&e))?.map_err(|e| words(&e))?;
        let (q, dq) = fed.solution.q.at(0.0);
        let state = viscous.reduction().state(&q, &dq, orbit.omega());
        let z = body.frame(&state);
        let (u, v) = state.full(&viscous.reduction().system).map_err(|e| words(&e))?;
        let energy = body.system.elastic(0.0, &u) + body.system.kinetic(0.0, &v);
        let size = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
        let apart = size(&mut z.iter().zip(&orbit.z).map(|(a, b)| a - b));
        let found = [(energy / orbit.energy - 1.0).abs(), apart / size(&mut z.iter().copied())];
        for ((what, found), wanted) in ["energy", "distance"].into_iter().zip(found).zip(wanted) {
            let name = format!("{name}, {n_h} harmonics: {what} beside the orbit");
            checks.push(Check::near(name, found, wanted, 0.5));
        }
    }
    Ok(())
}

/// The same mode by harmonic balance converges to what is shot.
fn harmonics(checks: &mut Vec<Check>) -> Result<(), String> {
    let omega = 0.9;
    let (_, mut body, pin) = set_up(&pressed([[4, 2], [4, 2]], "both"))?;
    let guesses = pin.guesses(&body, omega);
    let orbit = guesses.iter().find_map(|g| shot(&mut body, pin, g, omega).ok());
    let orbit = orbit.ok_or("no viscous mode")?;
    let alpha = orbit.viscous.as_ref().map_or(f64::NAN, |v| v.alpha);
    let mut viscous = Viscous::new(body.system.clone(), pin).map_err(|e| e.to_string())?;
    for (n_h, most) in [(7, 3e-3), (15, 3e-4), (31, 3e-5)] {
        let found =
            viscous.from_mode(n_h, omega, &Settings::default()).map_err(|e| e.to_string())?;
        let fed = found.map_err(|e| e.to_string())?;
        let what = format!("pressed blocks, {n_h} harmonics: alpha beside that of shooting");
        checks.push(Check::at_most(what, (fed.alpha / alpha - 1.0).abs(), most));
    }
    Ok(())
}
