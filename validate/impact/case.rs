//! Bars that strike a rigid wall: published dynamic contact benchmarks in one dimension, in space and around an axis.
//!
//! * **VM265** (Ansys Mechanical APDL Verification Manual, after Carpenter, Taylor and Katona, Int. J. Numer. Meth. Engng 32 (1991) 103–128): a rod of
//!   `L = 10` in, `E = 3·10⁷` psi, `A = 1` in², `0.01` in before the wall at `202.2` in/s; impact at `5·10⁻⁵` s. Its density, printed as 0.73, is
//!   `0.73·10⁻³` lbf s²/in⁴: with that the manual's time step, `0.2226·10⁻⁵` s, is 0.9 of what a wave takes through an element at `c = √(E/ρ)`. Release `2L/c` later, force `ρ c v A`.
//! * **SDNV100** (Code_Aster, manual of validation, V5.03.100, sections 1 and 2): a square beam, `L = 0.2` m, `a = 0.02` m, `E = 2·10¹¹` Pa, `ν = 0.3`,
//!   `ρ = 8000` kg/m³, `U₀ = 2` mm before the wall at `V₀ = 100` m/s, a quarter of it of 21 Hex8 (model F). The reference (Gibert 1988) is the wave of uniaxial strain,
//!   `c_p = √(E(1 − ν)/(ρ(1 + ν)(1 − 2ν)))`, contact for `2L/c_p`; with free sides, as the boundary conditions of the manual leave
//!   them, a thin bar stays for `2L/√(E/ρ)`.
//! * **Skalak**, J. Appl. Mech. 24 (1957) 59–64: a round bar of radius `a` whose end is stopped without friction. Far from the end the velocity behind the front is
//!   `v/V = −1 + 1/3 + ∫₀^B Ai(−ξ) dξ`, `B = (c₀t − z)/(3ν²a²c₀t/4)^{1/3}`: the front is a third of the jump at `z = c₀t`, and overshoots to 1.2743.

use super::cuboid::cuboid;
use super::rectangle::{msh, rectangle};
use super::{Case, Check, Effort, Outcome, Trajectory, integrate, nodal_x, scene};
use signorini::event::Report;
use signorini::mesh::{ElementKind, Mesh};
use signorini::problem::Problem;

pub const CASE: Case = Case {
    name: "impact",
    title: "bars that strike a wall: in one dimension, in space, around an axis",
    source: "Ansys Verification Manual VM265 (Carpenter, Taylor, Katona, IJNME 32 (1991) 103–128); Code_Aster V5.03.100 SDNV100; Skalak, J. Appl. Mech. 24 (1957) 59–64",
    only_by_name: false,
    run,
};

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    rod(effort, &mut checks)?;
    beam(effort, &mut checks)?;
    round(effort, &mut checks)?;
    Ok(checks)
}

type Run = (Problem, Report, Trajectory);

/// A scene whose mesh is written for it, and removed.
fn on(mesh: &Mesh, text: &str) -> Result<Run, String> {
    let file = std::env::temp_dir().join(format!("signorini-impact-{}.msh", std::process::id()));
    std::fs::write(&file, msh(mesh, |_| 0)).map_err(|e| e.to_string())?;
    let text = text.replace("mesh.msh", &file.display().to_string());
    let done = scene(&text, None).and_then(|s| integrate(&s));
    // a temporary file that cannot be removed is no reason to fail
    let _ = std::fs::remove_file(&file);
    done
}

/// First touch and last release.
fn contact(report: &Report) -> [f64; 2] {
    let [first, last] = [report.switches.first(), report.switches.last()];
    [first, last].map(|s| s.map_or(f64::NAN, |s| s.t))
}

/// `∫ F dt` over all stored times, by trapezia.
fn impulse(problem: &Problem, trajectory: &Trajectory) -> f64 {
    let areas = &problem.system.conditions().area;
    let force: Vec<f64> =
        trajectory.pressure.iter().map(|p| p.iter().zip(areas).map(|(p, a)| p * a).sum()).collect();
    let steps = trajectory.t.windows(2).zip(force.windows(2));
    steps.map(|(t, f)| 0.5 * (t[1] - t[0]) * (f[0] + f[1])).sum()
}

fn rod(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let (length, modulus, density, speed, gap) = (10.0, 3.0e7, 0.73e-3, 202.2, 0.01);
    let c = f64::sqrt(modulus / density);
    let (touch, release) = (gap / speed, gap / speed + 2.0 * length / c);
    let meshes: &[usize] = if effort.short { &[20, 80] } else { &[20, 80, 320] };
    for &n in meshes {
        let (_, report, trajectory) = integrate(&scene(include_str!("rod.toml"), Some(&[n]))?)?;
        let name = |what: &str| format!("VM265, {n} elements: {what}");
        let [first, last] = contact(&report);
        checks.push(Check::near(name("time of impact"), first, touch, 1e-9));
        // kinks spread over a width of the order of h^(2/3)
        let spread = 0.6 / (n as f64).powf(2.0 / 3.0);
        checks.push(Check::near(name("time of release"), last, release, spread));
        let pressures = trajectory.t.iter().zip(&trajectory.pressure);
        let middle: Vec<f64> = pressures
            .filter(|(t, _)| {
                (**t - touch) / (release - touch) > 0.3 && **t < touch + 0.8 * (release - touch)
            })
            .map(|(_, p)| p[0])
            .collect();
        let mean = middle.iter().sum::<f64>() / middle.len() as f64;
        checks.push(Check::near(name("mean contact force"), mean, density * c * speed, spread));
    }
    Ok(())
}

fn beam(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let (length, half, modulus, nu, density, speed) = (0.2, 0.01, 2.0e11, 0.3, 8000.0, 100.0);
    let strain = f64::sqrt(modulus * (1.0 - nu) / (density * (1.0 + nu) * (1.0 - 2.0 * nu)));
    let stress = f64::sqrt(modulus / density);
    let touch = 0.002 / speed;
    let held = "[[support]]\ngroup = \"ymax\"\nfix = [\"y\"]\n\n[[support]]\ngroup = \"zmax\"\nfix = [\"z\"]\n\n[contact]";
    let meshes: &[usize] = if effort.short { &[21, 42] } else { &[21, 42, 84] };
    for (sides, c) in [("held", strain), ("free", stress)] {
        for &n in meshes {
            let across = (n / 21).min(2);
            let mesh = cuboid(ElementKind::Hex8, [length, half, half], [n, across, across], 0.0);
            let mut text = include_str!("beam.toml").to_owned();
            if sides == "held" {
                text = text.replace("[contact]", held);
            }
            let (problem, report, trajectory) = on(&mesh, &text)?;
            let name = |what: &str| {
                format!("SDNV100, {n} × {across} × {across} Hex8, sides {sides}: {what}")
            };
            let [first, last] = contact(&report);
            checks.push(Check::near(name("time of impact"), first, touch, 1e-9));
            let spread = 0.6 / (n as f64).powf(2.0 / 3.0);
            let stay = 2.0 * length / c;
            checks.push(Check::near(name("time of contact"), last - first, stay, spread));
            let mass = density * length * half * half;
            let pushed = impulse(&problem, &trajectory) / (2.0 * mass * speed);
            // with free sides a part of the motion stays as vibration across: (a/L)² of it, and what the mesh spreads
            let across = if sides == "held" { 0.0 } else { 0.02 };
            let close = 0.25 * spread + across;
            checks.push(Check::near(name("impulse over 2 m V₀"), pushed, 1.0, close));
            // the other end flies on until the wave is there
            let far = |u: &Vec<f64>| nodal_x(&problem, u, 0);
            let most = trajectory.u.iter().map(far).fold(0.0, f64::max);
            let reached = speed * (touch + length / c);
            checks.push(Check::near(name("largest displacement of B"), most, reached, close));
        }
    }
    Ok(())
}

/// `1/3 + ∫₀^B Ai(−ξ) dξ` by the two power series of Airy's function.
fn front(b: f64) -> f64 {
    // Ai(x) = c₁ f(x) − c₂ g(x), f = Σ 3^k (1/3)_k x^{3k}/(3k)!, g = Σ 3^k (2/3)_k x^{3k+1}/(3k+1)!
    let (c1, c2) = (0.355_028_053_887_817_2, 0.258_819_403_792_806_8);
    let x = -b;
    let (mut f, mut g, mut sum) = (1.0, x, 0.0);
    for k in 0..60 {
        let m = 3.0 * f64::from(k);
        sum += c1 * f * x / (m + 1.0) - c2 * g * x / (m + 2.0);
        f *= x.powi(3) / ((m + 2.0) * (m + 3.0));
        g *= x.powi(3) / ((m + 3.0) * (m + 4.0));
    }
    1.0 / 3.0 - sum
}

fn round(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let (nu, speed, touch, across) = (0.3, 1e-3, 1.0, 8);
    // the wave from the other end comes after the last front
    let (places, length): (&[f64], f64) =
        if effort.short { (&[20.0, 40.0], 60.0) } else { (&[20.0, 40.0, 80.0], 100.0) };
    let along = across * length as usize;
    let mesh = rectangle(ElementKind::Quad4, [0.0, 1.0], length, (across, along), 0.0);
    let until = format!("until = {}\nsamples = {}", length - 5.0, 20.0 * (length - 5.0));
    let text = include_str!("round.toml").replace("until = 95\nsamples = 1900", &until);
    let (problem, _, trajectory) = on(&mesh, &text)?;
    let body = &problem.system.body;
    // mean displacement of a section, by its rings
    let section = |z: f64| -> Vec<(usize, f64)> {
        let at = |p: &[f64; 3]| (p[1] - z).abs() < 1e-9;
        let nodes: Vec<usize> = (0..mesh.n_nodes()).filter(|&n| at(&mesh.nodes()[n])).collect();
        let ring =
            |n: usize| if mesh.nodes()[n][0] > 1.0 - 1e-9 { 0.5 } else { mesh.nodes()[n][0] };
        let all: f64 = nodes.iter().map(|&n| ring(n)).sum();
        nodes.iter().map(|&n| (n, ring(n) / all)).collect()
    };
    let mut distances = vec![];
    for &z in places {
        // the front is the first term of an expansion in z^(−1/3)
        let accepted = 0.22 / f64::cbrt(z);
        let nodes = section(z);
        let mean = |u: &[f64]| -> f64 {
            let of = |n: usize| body.dofs.terms(n, 1).map(|(i, c)| c * u[i]).sum::<f64>();
            nodes.iter().map(|&(n, w)| w * of(n)).sum()
        };
        let u: Vec<f64> = trajectory.u.iter().map(|u| mean(u)).collect();
        // velocities in the middle of the samples, as a share of the jump
        let share: Vec<(f64, f64)> = (1..u.len())
            .map(|k| {
                let dt = trajectory.t[k] - trajectory.t[k - 1];
                let t = 0.5 * (trajectory.t[k] + trajectory.t[k - 1]) - touch;
                (t, 1.0 + (u[k] - u[k - 1]) / (dt * speed))
            })
            .filter(|s| s.0 < z + 10.0)
            .collect();
        let name = |what: &str| format!("Skalak, z = {z} a: {what}");
        let peak = share.iter().fold((0.0, 0.0), |m, s| if s.1 > m.1 { *s } else { m });
        checks.push(Check::near(name("overshoot"), peak.1, front(2.338_107_410_459_767), accepted));
        // B(t) = 2.3381 by a few steps of the fixed point
        let width = |t: f64| (0.75 * nu * nu * t).cbrt();
        let late = (0..50).fold(z, |t, _| z + 2.338_107_410_459_767 * width(t));
        checks.push(Check::near(name("time of it, c₀t/z"), peak.0 / z, late / z, accepted));
        let worst = share
            .iter()
            .map(|&(t, s)| ((t - z) / width(t.max(1.0)), s))
            .filter(|(b, _)| (-2.0..3.5).contains(b))
            .map(|(b, s)| (s - front(b)).abs())
            .fold(0.0, f64::max);
        checks.push(Check::at_most(
            name("largest distance from Airy's front"),
            worst,
            2.0 * accepted,
        ));
        distances.push(worst);
    }
    let (near, far) = (places[0], places[places.len() - 1]);
    let closer = distances[distances.len() - 1] / distances[0];
    let name = format!("Skalak, distance at z = {far} a over that at {near} a");
    checks.push(Check::at_most(name, closer, 1.15 * f64::cbrt(near / far)));
    Ok(())
}
