//! The same friction where displacements along the obstacle have no mass either (`tangent = "massless"`): the numbers of the independent program for its second variant.
//!
//! - Free plates thrown against a rough wall: energy, mean velocities and spin behind.
//! - The same thrown with viscosity; a plate that squeals on a belt: growth rate of steady sliding, period and loss of the limit cycle.
//! - Orbits: an oscillator behind a spring, shaken blocks: what friction and dampers take a period, multipliers.
//! - The coefficient from which on a state has several motions, of contact edges of four elements with sides in several ratios.

use std::f64::consts::TAU;

use signorini::contact::{
    Anchor, Gaps, MassChoice, Rayleigh, Rubs, State, Stress, System, Tangent, boundary,
};
use signorini::event::SwitchKind;
use signorini::families::single::limit_cycle;
use signorini::fem::{Body, ContactRows, Csr};
use signorini::flow::{RungeKutta, complex_modes, dop853::DOP853};
use signorini::orbit::search::Verdict;
use signorini::orbit::{Orbit, Propagator};
use signorini::problem::Problem;

use super::super::{Check, Effort, Outcome, integrate, scene};
use super::{TIGHT, run_by, shoot, velocities, work};

/// A scene with displacements of no mass along its obstacle.
fn massless(text: &str) -> String {
    text.replace("friction =", "tangent = \"massless\"\nfriction =")
}

/// Energy and switches at the end; `mean` are velocities along x and y.
fn impacts(effort: Effort) -> Outcome {
    let text = massless(include_str!("plate.toml"));
    let mut checks = vec![];
    for (elements, mu, energy, mean, spin, switches) in [
        (
            [4, 8],
            "0.1",
            0.011_153_072_892,
            [-0.181_990_211_858, 0.062_138_247_952],
            -0.020_663_867_241,
            14,
        ),
        (
            [4, 8],
            "0.3",
            0.011_292_399_297,
            [-0.188_419_698_948, 0.002_594_175_197],
            -0.055_295_864_427,
            25,
        ),
        (
            [6, 12],
            "0.3",
            0.011_472_352_454,
            [-0.188_987_868_817, 0.004_101_163_770],
            -0.058_576_801_396,
            51,
        ),
    ] {
        if effort.short && elements[0] > 4 {
            continue;
        }
        let text = text.replace("friction = 0.3", &format!("friction = {mu}"));
        let [nx, ny] = elements;
        let name = format!("plate without mass at the wall {nx} × {ny}, μ = {mu}");
        for integrator in ["modal", "dop853"] {
            let more = format!("integrator = \"{integrator}\"\nrtol = 1e-12\natol = 1e-14");
            let more = if integrator == "modal" { "integrator = \"modal\"" } else { &more };
            let text = text.replace("integrator = \"modal\"", more);
            let (problem, report, _) = integrate(&scene(&text, Some(&elements))?)?;
            let name = format!("{name}, {integrator}");
            checks.push(Check::near(format!("{name}: energy"), report.energy_end, energy, 1e-10));
            let drift = report.energy_drift_total;
            checks.push(Check::at_most(format!("{name}: ledger"), drift, 1e-12));
            // what switches at one instant counts once there
            let count = report.phases as f64 - 1.0;
            let text = format!("{name}: instants of switches");
            checks.push(Check::near(text, count, f64::from(switches), 0.0));
            let found = velocities(&problem, &report.last);
            for (axis, (found, wanted)) in ["x", "y"].into_iter().zip(found.into_iter().zip(mean)) {
                let text = format!("{name}: mean velocity along {axis}");
                checks.push(Check::near(text, found, wanted, 1e-9));
            }
            let found = turning(&problem, &report.last);
            checks.push(Check::near(format!("{name}: mean angular velocity"), found, spin, 1e-9));
        }
    }
    checks.extend(slides()?);
    Ok(checks)
}

/// With little friction all points slip from landing to leaving: `v_y = v_y⁰ − μ(v_x⁰ − v_x)`. With more the lowest one sticks as all land.
fn slides() -> Outcome {
    let text = massless(include_str!("plate.toml"));
    let with = |from: &str, to: &str| -> Result<_, String> {
        integrate(&scene(&text.replace(from, to), Some(&[4, 8]))?)
    };
    let (problem, report, _) = with("friction = 0.3", "friction = 0.02")?;
    let [x, y] = velocities(&problem, &report.last);
    let lands =
        text.replace("friction = 0.3", "friction = 0.1").replace("until = 2.6", "until = 0.1001");
    let (_, landed, _) = integrate(&scene(&lands, Some(&[4, 8]))?)?;
    let states = f64::from(u8::from(landed.active.to_string() == "S++++++++"));
    Ok(vec![
        Check::near(
            "plate without mass at the wall, gross sliding: velocity along it",
            y,
            0.1 - 0.02 * (0.2 - x),
            2e-7,
        ),
        Check::near(
            "plate without mass at the wall, landed: the lowest point sticks, the others slip upwards",
            states,
            1.0,
            0.0,
        ),
    ])
}

/// Angular momentum over the moment of inertia, about the middle of the undeformed body.
fn turning(problem: &Problem, last: &State) -> f64 {
    let body = &problem.system.body;
    let nodes = body.mesh.nodes();
    let middle = [0, 1].map(|c| nodes.iter().map(|p| p[c]).sum::<f64>() / nodes.len() as f64);
    let turn: Vec<f64> = nodes.iter().flat_map(|p| [middle[1] - p[1], p[0] - middle[0]]).collect();
    let turn = body.dofs.gather(&turn);
    // the contact has no mass: whatever its velocities are
    let mass = problem.system.mass();
    let all = |v: &[f64]| -> Vec<f64> {
        let mut all = v.to_vec();
        all.resize(mass.n_rows(), 0.0);
        all
    };
    let momentum = |v: &[f64]| -> f64 {
        let mut p = vec![0.0; mass.n_rows()];
        mass.mul(&all(v), &mut p);
        p.iter().zip(all(&turn)).map(|(p, r)| p * r).sum()
    };
    momentum(&last.v) / momentum(&turn)
}

/// A plate thrown with viscosity.
fn viscous() -> Outcome {
    let text = massless(include_str!("plate.toml"));
    let text = format!("{text}[damping]\nrayleigh = [0.0, 0.01]\n");
    let (problem, report, _) = integrate(&scene(&text, Some(&[4, 8]))?)?;
    let name = "viscous plate without mass at the wall 4 × 8, μ = 0.3";
    let energy = report.energy_end;
    let mut checks = vec![Check::near(format!("{name}: energy"), energy, 0.009_206_184_315, 1e-9)];
    let found = velocities(&problem, &report.last);
    for (axis, found, wanted) in
        [("x", found[0], -0.175_512_879_977), ("y", found[1], 0.004_378_961_954)]
    {
        let text = format!("{name}: mean velocity along {axis}");
        checks.push(Check::near(text, found, wanted, 1e-9));
    }
    Ok(checks)
}

/// A clamped plate that is pressed on a belt: growth of steady sliding; what it comes to.
fn squeal(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let belt = |elements: [usize; 2], mu: &str, more: &str| {
        format!(
            "[body]\nkind = \"plate\"\nsize = [0.5, 1.0]\nelements = {elements:?}\nyoung = 1.0\ndensity = 1.0\npoisson = 0.3\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n\
             [contact]\nedge = \"right\"\ngap = -0.02\ntangent = \"massless\"\nfriction = {mu}\nsurface = [0.0, 0.02]\n\
             [damping]\nrayleigh = [0.0, 0.01]\n{more}[run]\nuntil = 1.0\n"
        )
    };
    let cycle = |name: &str, problem: Problem| -> Result<Box<Orbit>, String> {
        let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
        match limit_cycle(&mut body, &problem.initial, None).map_err(|e| e.to_string())? {
            Verdict::Orbit(orbit) => Ok(orbit),
            other => Err(format!("{name}: {other}")),
        }
    };
    for (mu, growth, omega, period, loss, switches) in [
        ("0.35", 0.048_928_431_787, Some(5.748_304_547), 1.106_494_984_155, 0.000_271_773_523, 9),
        ("0.4", 0.081_006_804_065, None, 1.110_389_351_095, 0.000_319_637_517, 7),
    ] {
        let text = belt([4, 8], mu, "");
        let name = format!("plate on a belt, without mass, μ = {mu}");
        let problem = Problem::new(&scene(&text, None)?, None).map_err(|e| e.to_string())?;
        let system = &problem.system;
        let (set, _) = system.equilibrium().map_err(|e| e.to_string())?;
        let modes = complex_modes(system, &system.phase(&set)).map_err(|e| e.to_string())?;
        let found = modes.first().map_or(f64::NAN, |m| m.lambda.re);
        checks.push(Check::near(format!("{name}: growth rate"), found, growth, 1e-10));
        if let Some(wanted) = omega {
            let found = modes.first().map_or(f64::NAN, |m| m.lambda.im.abs());
            checks.push(Check::near(format!("{name}: its frequency"), found, wanted, 1e-9));
        }
        let orbit = cycle(&name, problem)?;
        let count = orbit.switches.len() as f64;
        checks.push(Check::near(format!("{name}: switches"), count, f64::from(switches), 0.0));
        checks.push(Check::near(format!("{name}: period"), orbit.period, period, 1e-10));
        checks.push(Check::near(format!("{name}: friction a period"), work(&orbit), loss, 1e-8));
    }
    // under refinement; on 4 × 8 there are two cycles, and this start leads to that one
    for (elements, more, period, loss) in [
        ([4, 8], "[initial]\nvelocity = [\"0\", \"-0.02*x\"]\n", 1.117_174, 4.28e-4),
        ([6, 12], "", 1.132_216, 3.58e-4),
    ] {
        if effort.short && elements[0] > 4 {
            continue;
        }
        let name =
            format!("plate {} × {} on a belt, without mass, μ = 0.5", elements[0], elements[1]);
        let problem = Problem::new(&scene(&belt(elements, "0.5", more), None)?, None);
        let orbit = cycle(&name, problem.map_err(|e| e.to_string())?)?;
        // six decimals are given, and three digits
        checks.push(Check::near(format!("{name}: period"), orbit.period, period, 5e-7));
        checks.push(Check::near(format!("{name}: friction a period"), work(&orbit), loss, 2e-3));
    }
    Ok(checks)
}

/// The least coefficient with several motions, of four elements along the edge.
fn critical() -> Outcome {
    let mut checks = vec![];
    for (poisson, ratios) in [
        (0.0, [0.8056, 1.4244, 1.9682, 2.8284, 4.7228]),
        (0.3, [0.8698, 1.5335, 2.0266, 2.3934, 3.2228]),
        (0.45, [0.8960, 1.4116, 1.7455, 1.9303, 2.2301]),
    ] {
        for (k, wanted) in ratios.into_iter().enumerate() {
            // sides along the edge over those across it
            let along = 4.0 * 2f64.powi(k as i32 - 2);
            let text = format!(
                "[body]\nkind = \"plate\"\nsize = [2.0, {along:?}]\nelements = [2, 4]\nyoung = 1.0\ndensity = 1.0\npoisson = {poisson:?}\n\
                 [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n\
                 [contact]\nedge = \"right\"\ngap = 1.0\ntangent = \"massless\"\nfriction = 0.01\n[run]\nuntil = 1.0\n"
            );
            let problem = Problem::new(&scene(&text, None)?, None).map_err(|e| e.to_string())?;
            let found = problem.system.critical_friction().map_or(f64::NAN, |c| c.0);
            let name =
                format!("critical friction, ν = {poisson}, sides {}", 2f64.powi(k as i32 - 2));
            // four decimals are given: half of the last
            checks.push(Check::near(name, found, wanted, 5e-5 / wanted));
        }
    }
    Ok(checks)
}

/// A mass before a point that is pressed by a force of one, `m = k = 1`, behind a spring `k_t`, under `P cos Ωt`.
fn oscillator(
    (k_t, friction, load, omega, alpha): (f64, f64, f64, f64, f64),
) -> Result<System, String> {
    let entries = |all: &[(usize, usize, f64)]| Csr::from_triplets(3, 3, all.to_vec());
    let stiffness =
        entries(&[(0, 0, 1.0 + k_t), (0, 2, -k_t), (1, 1, 1.0), (2, 0, -k_t), (2, 2, k_t)]);
    let rows = ContactRows {
        facing: vec![1],
        against: vec![vec![]],
        idle: vec![2],
        tangents: vec![(2, 0)],
        ..ContactRows::default()
    };
    let body = Body::from_matrices(&entries(&[(0, 0, 1.0)]), &stiffness, &rows, 1.0);
    let body = body.map_err(|e| e.to_string())?.with_memory(1);
    let operator = boundary::reaction(&body, vec![1.0; 2]);
    let tangent = Tangent {
        row: vec![],
        anchor: Some(Anchor { displacement: 1, memory: 1 }),
        coefficient: friction,
        surface: 0.0,
        direction: [0.0, 1.0, 0.0],
        only_slips: false,
    };
    let rubs = Rubs { tangents: vec![Some(tangent)], sliders: vec![] };
    let choice = (Stress::Reaction, MassChoice::Condensed);
    let mut system = System::with_operator(body, operator, Gaps::front(vec![0.0]), choice, rubs)
        .map_err(|e| e.to_string())?;
    system.damping = Some(Rayleigh { alpha, beta: 0.0 }).filter(|d| d.alpha != 0.0);
    system.loads_mut().push(vec![0.0, 0.0, 1.0, 0.0], None, 0.0);
    system.loads_mut().push(vec![load, 0.0, 0.0, 0.0], Some(omega), 0.0);
    Ok(system)
}

/// Orbits by shooting: `4μN(A − μN/k_t)` a period; what was stuck is forgotten where it slips (a multiplier of zero).
fn orbits(effort: Effort) -> Outcome {
    let mut checks = vec![];
    for (of, amplitude, lost, stuck, largest) in [
        (
            (3.0, 0.4, 0.9, 0.8, 0.02),
            1.652_663_708_462,
            2.430_928_600_205,
            0.664_688_830_143,
            Some(0.394_610_52),
        ),
        ((10.0, 0.3, 0.6, 0.7, 0.0), 0.867_849_979_010, 1.005_419_974_812, 0.454_595_633_025, None),
    ] {
        let mut body = Propagator::new(oscillator(of)?).map_err(|e| e.to_string())?;
        let start = body.frame(&State { u: vec![0.9, 0.0], v: vec![0.0; 2] });
        let orbit = shoot(&mut body, start, of.3)?;
        let name = format!("orbit without mass at the wall, k_t = {}", of.0);
        let found = work(&orbit);
        checks.push(Check::near(format!("{name}: friction a period"), found, lost, 1e-11));
        let reach = found / (4.0 * of.1) + of.1 / of.0;
        checks.push(Check::near(format!("{name}: amplitude"), reach, amplitude, 1e-11));
        // from where it sticks to where it slips, over the period's end
        let of_kind = |kind: SwitchKind| orbit.switches.iter().find(|s| s.kind == kind);
        let both = of_kind(SwitchKind::Sticking).zip(of_kind(SwitchKind::Slipping));
        let lasts = both.map_or(f64::NAN, |(a, b)| (b.t - a.t).rem_euclid(0.5 * orbit.period));
        checks.push(Check::near(format!("{name}: how long it sticks"), lasts, stuck, 1e-10));
        if let Some(wanted) = largest {
            let all = orbit.stability.as_ref().map_or(&[][..], |s| &s.multipliers);
            let least = all.iter().map(|m| m.0.hypot(m.1)).fold(f64::INFINITY, f64::min);
            checks.push(Check::at_most(format!("{name}: smallest multiplier"), least, 1e-10));
            let found = orbit.stability.as_ref().map_or(f64::NAN, |s| s.largest);
            checks.push(Check::near(format!("{name}: largest multiplier"), found, wanted, 1e-7));
        }
    }
    for (elements, damping, loss, viscous, second) in [
        ([3, 6], "[0.3, 0.0]", 0.002_985_866_878, None, None),
        ([4, 8], "[0.3, 0.0]", 0.003_529_815_432, None, None),
        ([6, 12], "[0.3, 0.0]", 0.004_261_490_485, None, None),
        ([3, 6], "[0.1, 0.02]", 0.004_317_357_365, Some(0.003_297_995_056), Some(0.494_618_64)),
        ([4, 8], "[0.1, 0.02]", 0.005_521_583_299, Some(0.003_397_484_224), Some(0.456_364_27)),
        ([6, 12], "[0.1, 0.02]", 0.005_902_753_876, Some(0.003_484_155_794), None),
    ] {
        if effort.short && elements[0] > 3 {
            continue;
        }
        let text = massless(include_str!("block.toml")).replace("equilibrium = true", "");
        let text = text.replace("[0.3, 0.0]", damping);
        let problem =
            Problem::new(&scene(&text, Some(&elements))?, None).map_err(|e| e.to_string())?;
        let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
        let start = body.frame(&problem.initial);
        let orbit = shoot(&mut body, start, 1.0)?;
        let [nx, ny] = elements;
        let name = format!("shaken block without mass at the wall {nx} × {ny}, {damping}");
        checks.push(Check::near(format!("{name}: friction a period"), work(&orbit), loss, 1e-9));
        if let Some(wanted) = viscous {
            let mut flow = RungeKutta::new(&body.system, &DOP853, TIGHT);
            let report = run_by(&body.system, &orbit.state, TAU, &mut flow)?;
            let text = format!("{name}: loss of dampers a period");
            checks.push(Check::near(text, report.energy_dissipated, wanted, 1e-9));
        }
        if let Some(wanted) = second {
            let all = orbit.stability.as_ref().map_or(&[][..], |s| &s.multipliers);
            let mut sizes: Vec<f64> = all.iter().map(|m| m.0.hypot(m.1)).collect();
            sizes.sort_by(|a, b| b.total_cmp(a));
            let of = |k: usize| sizes.get(k).copied().unwrap_or(f64::NAN);
            let text = format!("{name}: multiplier of its position");
            checks.push(Check::near(text, of(0), 1.0, 1e-7));
            checks.push(Check::near(format!("{name}: second multiplier"), of(1), wanted, 1e-7));
        }
    }
    Ok(checks)
}

pub fn run(effort: Effort) -> Outcome {
    let mut checks = critical()?;
    checks.extend(orbits(effort)?);
    checks.extend(impacts(effort)?);
    checks.extend(viscous()?);
    checks.extend(squeal(effort)?);
    Ok(checks)
}
