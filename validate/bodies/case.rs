//! Bodies that meet: numbers of an independent program (`bodies.md` 7 and 8, Python, dense, sampled search of switches) and closed forms.
//!
//! - **Mirror**: a body and its image meet as one body meets a wall half as far away, to all digits.
//! - **Collisions** of bars: velocities and times of the same discrete bars in that program; a cradle hands its velocity on, as steps of Dormand and Prince do
//!   with the complementarity problem in every right-hand side (`cradle.py`).
//! - **Patch**: a uniform pressure passes from one mesh to another, in the plane and in space, whoever is the slave, also where a slave is partly covered.
//! - **Blocks** that collide (T3, meshes that do not match), a **beam with a crack** (T6), **rings** that were pressed together (Q9; Lamé).
//! - **Preload**: two masses on massless springs whose joint opens, `T = (2/ω₁)(π − arccos(x_s/A)) + (2/ω₂) arccos((x_s − x_c)/B)`,
//!   `x_c = x_s(1 − k₁/k₂)`, `B² = (x_s − x_c)² + (k₁/k₂)(A² − x_s²)`: after it everything is where it was. Two blocks that a spring and a force press together: frequencies of
//!   their viscous mode from the equilibrium through the opening, by shooting and by harmonic balance.
//! - **Viscous modes** of bars and half plates.
//! - **Round noses** pressed together (`hertz.rs`): cylinders and spheres, meshes that do not match, beside Hertz.
//! - **Clatter** (`clatter.rs`): a driven cantilever below another one.

#[path = "clatter.rs"]
mod clatter;
#[path = "hertz.rs"]
mod hertz;
#[path = "meshes.rs"]
mod meshes;
#[path = "preload.rs"]
mod preload;

use signorini::contact::{States, phase_modes};
use signorini::event::Report;
use signorini::mesh::{ElementKind, Facet};
use signorini::orbit::search::{Effort as Search, Verdict, find};
use signorini::orbit::{Closure, Orbit, Pin, Propagator, displaced, viscous};
use signorini::problem::Problem;

use super::cuboid::cuboid;
use super::rectangle::rectangle;
use super::{Case, Check, Effort, Outcome, Trajectory, integrate, nodal_x, scene};
use meshes::Folder;

pub const CASE: Case = Case {
    name: "bodies",
    title: "two bodies that meet: mirror images, collisions, patch tests, a crack, a press fit, preload, viscous modes",
    source: "numbers of an independent program in Python; closed forms (Lamé's rings, a joint of massless springs)",
    only_by_name: false,
    run,
};

type Run = (Problem, Report, Trajectory);

fn go(text: &str) -> Result<Run, String> {
    integrate(&scene(text, None)?)
}

/// The mean velocity of each part of the body along x: momentum over mass.
fn velocities((problem, report, _): &Run) -> Vec<f64> {
    let system = &problem.system;
    let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
    let part_of = mesh.parts();
    let (mut v, mut momentum) = (vec![0.0; system.n()], vec![0.0; system.n()]);
    system.phase(&report.active).expand_velocity(report.t_end, &report.last.v, &mut v);
    system.mass().mul(&v, &mut momentum);
    let of_part = |part: usize| {
        let along = |n: usize, c: usize| f64::from(u8::from(part_of[n] == part && c == 0));
        let nodes = 0..mesh.n_nodes();
        let field: Vec<f64> = nodes
            .flat_map(|n| (0..mesh.dim()).map(move |c| (n, c)))
            .map(|(n, c)| along(n, c))
            .collect();
        let motion = dofs.gather(&field);
        let sum: f64 = motion.iter().zip(&momentum).map(|(a, b)| a * b).sum();
        sum / system.mass().quadratic(&motion)
    };
    (0..=part_of.iter().copied().max().unwrap_or(0)).map(of_part).collect()
}

fn first_and_last(report: &Report) -> [f64; 2] {
    let [first, last] = [report.switches.first(), report.switches.last()];
    [first, last].map(|s| s.map_or(f64::NAN, |s| s.t))
}

fn material(group: &str, [young, poisson, density]: [f64; 3]) -> String {
    format!(
        "[[material]]\ngroup = \"{group}\"\nyoung = {young:?}\npoisson = {poisson:?}\ndensity = {density:?}\n"
    )
}

/// A body and its image at twice the distance of the wall.
fn mirror(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    for (file, state, stress, first, switches, energy) in [
        ("t3_plate", "plane stress", "reaction", 1.265_267_895_0, 17.0, 0.246_031_519_3),
        ("t3_plate", "plane stress", "nodal-mean", 1.254_313_893_3, 18.0, 0.246_272_169_4),
        ("t6_plate", "plane stress", "reaction", 1.274_853_639_2, 24.0, 0.266_319_867_2),
        ("t6_plate", "plane stress", "nodal-mean", 1.267_681_006_3, 22.0, 0.269_165_392_2),
        ("q4_distorted", "plane strain", "reaction", 1.189_547_113_7, 20.0, 0.296_083_277_3),
        ("q4_distorted", "plane strain", "projection", 1.183_575_830_8, 20.0, 0.296_382_145_5),
        ("hex8_box", "", "reaction", 1.208_159_693_3, 45.0, 0.132_173_046_9),
    ] {
        let (clamp, face, fix, third) = match state {
            "" => {
                ("xmin", "xmax", "[\"x\", \"y\", \"z\"]", [", \"0.02*x*z\"", ", \"0.02*(2-x)*z\""])
            }
            _ => ("left", "right", "[\"x\", \"y\"]", ["", ""]),
        };
        let state_key =
            if state.is_empty() { String::new() } else { format!("state = \"{state}\"\n") };
        let shift = if state.is_empty() { "[2.0, 0.0, 0.0]" } else { "[2.0, 0.0]" };
        let body = |name: &str, place: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nkind = \"mesh\"\nfile = {}\n{state_key}{place}",
                folder.file(file)
            )
        };
        let text = body("a", "")
            + &body("b", &format!("mirror = \"x\"\nmove = {shift}\n"))
            + &material("a", [1.0, 0.3, 1.0])
            + &material("b", [1.0, 0.3, 1.0])
            + &format!(
                "[[support]]\ngroup = \"a:{clamp}\"\nfix = {fix}\n[[support]]\ngroup = \"b:{clamp}\"\nfix = {fix}\n\
                 [[contact]]\nslave = \"a:{face}\"\nmaster = \"b:{face}\"\ngap = 0.6\nstress = \"{stress}\"\n\
                 [initial]\ndisplacement = {{ a = [\"-x*(1+0.1*y)\", \"0.03*x*y\"{}], b = [\"(2-x)*(1+0.1*y)\", \"0.03*(2-x)*y\"{}] }}\n\
                 [run]\nuntil = 8.0\nsamples = 1\nintegrator = \"modal\"\n",
                third[0], third[1]
            );
        let (_, report, _) = go(&text)?;
        let name = format!("{file} and its image, {stress}");
        checks.push(Check::near(
            format!("{name}: first switch"),
            first_and_last(&report)[0],
            first,
            1e-10,
        ));
        checks.push(Check::near(
            format!("{name}: switches"),
            report.log.switches() as f64,
            switches,
            0.0,
        ));
        checks.push(Check::near(
            format!("{name}: half the energy at the end"),
            report.energy_end / 2.0,
            energy,
            4e-10,
        ));
    }
    Ok(())
}

/// A bar: name, elements, length, `E = ρ`, place.
fn bar(name: &str, elements: usize, length: f64, stiff: f64, at: f64) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nkind = \"bar\"\nsize = [{length:?}]\nelements = [{elements}]\nyoung = {stiff:?}\ndensity = {stiff:?}\nmove = [{at:?}]\n"
    )
}

/// A plate along x from `at`.
fn plate(name: &str, size: [f64; 2], elements: [usize; 2], at: f64) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nkind = \"plate\"\nsize = {size:?}\nelements = {elements:?}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmove = [{at:?}, 0.0]\n"
    )
}

fn hold(edge: &str, fix: &str) -> String {
    format!("[[support]]\nedge = \"{edge}\"\nfix = {fix}\n")
}

/// Bars of which the first flies, in one dimension and as blocks of plates.
fn collisions(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let fly = |until: f64| {
        format!(
            "[initial]\nvelocity = {{ a = [\"1.0\"] }}\n[run]\nuntil = {until:?}\nsamples = 1\n"
        )
    };
    let pair = |sides: &str| {
        format!("[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\nsides = \"{sides}\"\n")
    };
    for (sides, opens, v) in [
        ("both", 2.091_280_612_6, [-0.330_964_090_4, 0.665_482_045_2]),
        ("slave", 2.076_243_326_6, [-0.324_398_849_2, 0.662_199_424_6]),
    ] {
        let text =
            bar("a", 20, 1.0, 1.0, 0.0) + &bar("b", 20, 1.0, 2.0, 1.1) + &pair(sides) + &fly(4.0);
        let run = go(&text)?;
        let name = format!("bars, E = rho = 2, {sides}");
        let [closes, last] = first_and_last(&run.1);
        checks.push(Check::near(format!("{name}: meet"), closes, 0.1, 1e-13));
        checks.push(Check::near(format!("{name}: part"), last, opens, 1e-10));
        for (k, (found, wanted)) in velocities(&run).into_iter().zip(v).enumerate() {
            checks.push(Check::near(
                format!("{name}: velocity of bar {}", k + 1),
                found,
                wanted,
                4e-10,
            ));
        }
        checks.push(Check::at_most(format!("{name}: energy"), run.1.energy_drift_total, 1e-12));
    }
    let lumped = (bar("a", 20, 1.0, 1.0, 0.0) + &bar("b", 20, 1.0, 1.0, 1.1))
        .replace("kind = \"bar\"\n", "kind = \"bar\"\nmass = \"lumped\"\n");
    let run = go(&(lumped + &pair("both") + &fly(4.0)))?;
    for (k, (found, wanted)) in
        velocities(&run).into_iter().zip([0.012_673_261_2, 0.987_326_738_8]).enumerate()
    {
        checks.push(Check::near(
            format!("lumped bars: velocity of bar {}", k + 1),
            found,
            wanted,
            4e-9,
        ));
    }
    for (n, v) in [
        (20, [-0.002_210_898_9, 0.005_480_823_8, 0.996_730_075_1]),
        (40, [-0.002_316_562_8, 0.008_351_792_0, 0.993_964_772_8]),
    ] {
        if effort.short && n > 20 {
            continue;
        }
        let three =
            bar("a", n, 1.0, 1.0, 0.0) + &bar("b", n, 1.0, 1.0, 1.0) + &bar("c", n, 1.0, 1.0, 2.0);
        let second =
            pair("both").replace("\"a:right\"", "\"b:right\"").replace("\"b:left\"", "\"c:left\"");
        let run = go(&(three + &pair("both") + &second + &fly(8.0)))?;
        for (k, (found, wanted)) in velocities(&run).into_iter().zip(v).enumerate() {
            let name = format!("cradle of three bars of {n}: velocity of bar {}", k + 1);
            let (low, high) = (wanted - 1e-8, wanted + 1e-8);
            checks.push(Check { what: name, measured: found, accepted: (low, high) });
        }
    }
    // the same as blocks, of meshes that do not match
    for ny in [3, 4, 7] {
        let block = |name: &str, ny: usize, at: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [20, {ny}]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0\nmove = [{at:?}, 0.0]\n"
            )
        };
        let bars = go(&(bar("a", 20, 1.0, 1.0, 0.0)
            + &bar("b", 20, 1.0, 1.0, 1.1)
            + &pair("both")
            + &fly(4.0)))?;
        let text = block("a", 3, 0.0)
            + &block("b", ny, 1.1)
            + &pair("both").replace("sides", "projection = \"dual\"\nsides")
            + &fly(4.0).replace("[\"1.0\"]", "[\"1.0\", \"0\"]");
        let blocks = go(&text)?;
        let off = velocities(&bars)
            .iter()
            .zip(velocities(&blocks))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        checks.push(Check::at_most(
            format!("blocks 20 x 3 and 20 x {ny}: velocities of the bars"),
            off,
            1e-12,
        ));
        let off = first_and_last(&bars.1)[1] - first_and_last(&blocks.1)[1];
        checks.push(Check::at_most(
            format!("blocks 20 x 3 and 20 x {ny}: last event of the bars"),
            off.abs(),
            1e-11,
        ));
    }
    Ok(())
}

/// The largest distance of displacements from those of a uniform pressure, and of pressures from one.
fn off_uniform(run: &Run, axis: usize) -> f64 {
    let (problem, _, trajectory) = run;
    let system = &problem.system;
    let (mesh, dofs, u) = (&system.body.mesh, &system.body.dofs, trajectory.at(0.0));
    let mut worst = pressure_off(run);
    for (n, x) in mesh.nodes().iter().enumerate() {
        for c in 0..mesh.dim() {
            let found: f64 = dofs.terms(n, c).map(|(i, w)| w * u[i]).sum();
            let exact = if c == axis { -x[c] } else { 0.3 * x[c] };
            worst = worst.max((found - exact).abs());
        }
    }
    worst
}

/// A body of a mesh in plane stress, of one material.
fn plane(folder: &Folder, name: &str, place: &str) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nkind = \"mesh\"\nfile = {}\nstate = \"plane stress\"\n{place}",
        folder.file(name)
    ) + &material(name, [1.0, 0.3, 1.0])
}

const STILL: &str =
    "[initial]\nequilibrium = true\n[run]\nuntil = 0.01\nsamples = 1\nintegrator = \"modal\"\n";

/// The largest distance of pressures from one.
fn pressure_off(run: &Run) -> f64 {
    run.2.pressure[0].iter().fold(0.0f64, |m, p| m.max((p - 1.0).abs()))
}

fn patch(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    for kind in [ElementKind::Quad4, ElementKind::Quad9] {
        let mut worst = 0.0f64;
        for (upper, lower) in [(3, 4), (3, 7), (8, 3)] {
            folder.put("upper", &rectangle(kind, [0.0, 1.0], 0.5, (upper, 2), 0.0))?;
            folder.put("lower", &rectangle(kind, [0.0, 1.0], 0.5, (lower, 2), 0.0))?;
            for (slave, master) in [("upper:bottom", "lower:top"), ("lower:top", "upper:bottom")] {
                for choice in [
                    "",
                    "sides = \"slave\"\n",
                    "sides = \"slave\"\nstress = \"nodal-mean\"\n",
                    "sides = \"slave\"\nstress = \"projection\"\n",
                ] {
                    let text = plane(folder, "lower", "")
                        + &plane(folder, "upper", "move = [0.0, 0.5]\n")
                        + "[[support]]\ngroup = \"lower:bottom\"\nfix = [\"y\"]\n[[support]]\ngroup = \"lower:left\"\nfix = [\"x\"]\n[[support]]\ngroup = \"upper:left\"\nfix = [\"x\"]\n"
                        + &format!(
                            "[[contact]]\nslave = \"{slave}\"\nmaster = \"{master}\"\n{choice}"
                        )
                        + "[[load]]\nkind = \"traction\"\ngroup = \"upper:top\"\namplitude = [0.0, -1.0]\n"
                        + STILL;
                    worst = worst.max(off_uniform(&go(&text)?, 1));
                }
            }
        }
        checks.push(Check::at_most(format!("patch of {}: 24 pairs", kind.name()), worst, 3e-13));
    }
    for kind in [ElementKind::Hex8, ElementKind::Tet4, ElementKind::Prism6, ElementKind::Hex27] {
        let mut worst = 0.0f64;
        folder.put("upper", &cuboid(kind, [1.0, 1.0, 0.5], [3, 2, 2], 0.0))?;
        folder.put("lower", &cuboid(kind, [1.0, 1.0, 0.5], [2, 3, 2], 0.0))?;
        for (slave, master) in [("upper:zmin", "lower:zmax"), ("lower:zmax", "upper:zmin")] {
            for sides in ["both", "slave"] {
                let body = |name: &str, place: &str| {
                    format!(
                        "[[body]]\nname = \"{name}\"\nkind = \"mesh\"\nfile = {}\n{place}",
                        folder.file(name)
                    )
                };
                let hold = |group: &str, axis: &str| {
                    format!("[[support]]\ngroup = \"{group}\"\nfix = [\"{axis}\"]\n")
                };
                let text = body("lower", "")
                    + &body("upper", "move = [0.0, 0.0, 0.5]\n")
                    + &material("lower", [1.0, 0.3, 1.0])
                    + &material("upper", [1.0, 0.3, 1.0])
                    + &hold("lower:zmin", "z")
                    + &hold("lower:xmin", "x")
                    + &hold("lower:ymin", "y")
                    + &hold("upper:xmin", "x")
                    + &hold("upper:ymin", "y")
                    + &format!(
                        "[[contact]]\nslave = \"{slave}\"\nmaster = \"{master}\"\nsides = \"{sides}\"\n"
                    )
                    + "[[load]]\nkind = \"traction\"\ngroup = \"upper:zmax\"\namplitude = [0.0, 0.0, -1.0]\n"
                    + STILL;
                worst = worst.max(off_uniform(&go(&text)?, 2));
            }
        }
        checks.push(Check::at_most(format!("patch of {}: 4 pairs", kind.name()), worst, 1e-12));
    }
    Ok(())
}

/// A punch on a block that carries the same pressure beside it: the nodes of the block at its ends are half covered.
fn punch(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    let mut worst = 0.0f64;
    for kind in [ElementKind::Quad4, ElementKind::Quad9] {
        let block = rectangle(kind, [0.0, 1.0], 0.5, (10, 3), 0.0);
        let x = |facet: Facet| {
            let nodes = block.side_nodes(facet);
            nodes.iter().map(|&n| block.nodes()[n][0]).sum::<f64>() / nodes.len() as f64
        };
        let is_below = |facet: &Facet| (0.3..0.7).contains(&x(*facet));
        let (below, beside): (Vec<Facet>, Vec<Facet>) =
            block.group("top").iter().partition(|f| is_below(f));
        let others = ["left", "bottom"].map(|g| (g.to_owned(), block.group(g).to_vec()));
        let groups =
            others.into_iter().chain([("top".to_owned(), below), ("zmax".to_owned(), beside)]);
        folder.put("lower", &block.clone().with_groups(groups))?;
        for elements in [3, 4] {
            folder.put("upper", &rectangle(kind, [0.0, 0.4], 0.5, (elements, 2), 0.0))?;
            for (slave, master) in [("upper:bottom", "lower:top"), ("lower:top", "upper:bottom")] {
                for sides in ["both", "slave"] {
                    let text = plane(folder, "lower", "")
                        + &plane(folder, "upper", "move = [0.3, 0.5]\n")
                        + "[[support]]\ngroup = \"lower:bottom\"\nfix = [\"y\"]\n[[support]]\ngroup = \"lower:left\"\nfix = [\"x\"]\n"
                        + "[[spring]]\ngroup = \"upper:left\"\ndirection = [1.0, 0.0]\nstiffness = 1.0\npreload = 0.09\n"
                        + &format!(
                            "[[contact]]\nslave = \"{slave}\"\nmaster = \"{master}\"\nsides = \"{sides}\"\n"
                        )
                        + "[[load]]\nkind = \"traction\"\ngroup = \"upper:top\"\namplitude = [0.0, -1.0]\n"
                        + "[[load]]\nkind = \"traction\"\ngroup = \"lower:zmax\"\namplitude = [0.0, -1.0]\n"
                        + STILL;
                    worst = worst.max(pressure_off(&go(&text)?));
                }
            }
        }
    }
    checks.push(Check::at_most("punch on a block, partly covered: 16 pairs", worst, 3e-13));
    Ok(())
}

/// Blocks of triangles that collide, meshes that do not match.
fn blocks(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    for (sides, ends, last, switches, mean, size) in [
        ("both", [9.041_707_586_7, 0.2], 2.199_207_063_8, 12.0, 0.452_686_599_0, 0.806_567_767_3),
        ("slave", [19.149_271_939_4, 0.2], 2.177_616_863_9, 26.0, 0.455_399_648_7, 0.799_918_130_2),
    ] {
        let text = format!(
            "[body]\nkind = \"mesh\"\nfile = {}\nstate = \"plane stress\"\n",
            folder.file("two_blocks")
        ) + &material("first", [1.0, 0.3, 1.0])
            + &material("second", [2.0, 0.25, 1.0])
            + &format!(
                "[[support]]\ngroup = \"wall\"\nfix = [\"x\", \"y\"]\n[[contact]]\nslave = \"nose\"\nmaster = \"face\"\nsides = \"{sides}\"\n\
                 [initial]\nvelocity = {{ second = [\"-0.5\", \"0\"] }}\n[run]\nuntil = 3.0\nsamples = 1\n"
            );
        let run = go(&text)?;
        let (problem, report, trajectory) = &run;
        let system = &problem.system;
        let name = format!("blocks of T3, {sides}");
        // N_C of the slave's end: both surfaces give way, one behind the other
        let conditions = system.conditions();
        let count = conditions.count();
        let first =
            (0..conditions.facing()).min_by_key(|&i| system.constraints[i].node).unwrap_or(0);
        let of_slave = conditions.n_c[(first, first)];
        let softened = match count > conditions.facing() {
            false => of_slave,
            true => {
                let unit = |k: usize| f64::from(u8::from(k == first));
                let all: Vec<usize> = (0..count).collect();
                let mut x: Vec<f64> = all.iter().map(|&k| unit(k)).collect();
                let free: Vec<usize> = (conditions.facing()..count).collect();
                let block = conditions.n_c.dense();
                let of_free = block.select_rows(&free).select_columns(&free);
                let across = block.select_rows(&free).column(first).into_owned();
                let y = of_free.lu().solve(&across).ok_or("singular")?;
                free.iter().zip(y.iter()).for_each(|(&k, v)| x[k] = -v);
                (0..count).map(|k| block[(first, k)] * x[k]).sum()
            }
        };
        checks.push(Check::near(
            format!("{name}: N_C of the first node"),
            softened,
            ends[0],
            1e-10,
        ));
        let [begins, ended] = first_and_last(report);
        checks.push(Check::near(format!("{name}: first switch"), begins, ends[1], 1e-12));
        checks.push(Check::near(format!("{name}: last switch"), ended, last, 1e-10));
        checks.push(Check::near(
            format!("{name}: switches"),
            report.log.switches() as f64,
            switches,
            0.0,
        ));
        let v = velocities(&run);
        checks.push(Check::near(
            format!("{name}: velocity of the second"),
            v.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean,
            4e-10,
        ));
        let u = trajectory.at(3.0);
        let nodal = system.body.dofs.scatter(u);
        let length = nodal.iter().map(|x| x * x).sum::<f64>().sqrt();
        checks.push(Check::near(format!("{name}: displacements at the end"), length, size, 4e-10));
        checks.push(Check::at_most(format!("{name}: energy"), report.energy_drift_total, 1e-12));
    }
    Ok(())
}

/// A beam with a crack from its upper side: frequencies open and closed.
fn crack(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    for (sides, wanted) in
        [("both", [0.020_902_881_1, 0.027_662_526_8]), ("slave", [f64::NAN, 0.027_662_573_2])]
    {
        let text = format!(
            "[body]\nkind = \"mesh\"\nfile = {}\nstate = \"plane stress\"\n",
            folder.file("cracked_beam")
        ) + "[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\ngroup = \"left\"\nfix = [\"x\", \"y\"]\n"
            + &format!(
                "[[contact]]\nslave = \"crack\"\nmaster = \"lip\"\nsides = \"{sides}\"\n[run]\nuntil = 1.0\n"
            );
        let problem = Problem::new(&scene(&text, None)?, None).map_err(|e| e.to_string())?;
        let system = &problem.system;
        let lowest = |closed: bool| -> Result<f64, String> {
            let set =
                if closed { system.closed_states() } else { States::open(system.n_contact()) };
            let modes = phase_modes(system, &system.phase(&set), 1).map_err(|e| e.to_string())?;
            Ok(modes.omega.first().copied().unwrap_or(f64::NAN))
        };
        let (open, closed) = (lowest(false)?, lowest(true)?);
        if wanted[0].is_finite() {
            checks.push(Check::near(format!("cracked beam, {sides}: open"), open, wanted[0], 4e-9));
            checks.push(Check::near(
                format!("cracked beam, {sides}: bilinear"),
                2.0 * open * closed / (open + closed),
                0.023_812_278_5,
                4e-9,
            ));
        }
        checks.push(Check::near(format!("cracked beam, {sides}: closed"), closed, wanted[1], 4e-9));
        breathing(problem, sides, checks)?;
    }
    Ok(())
}

/// Its viscous mode (`β = .1`): one frequency at all amplitudes, an energy in proportion to the square.
fn breathing(problem: Problem, sides: &str, checks: &mut Vec<Check>) -> Result<(), String> {
    let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    let pin = Pin::new(&body, 0, 0.1);
    let mesh = &body.system.body.mesh;
    let tip = mesh.nodes().iter().position(|x| x[0] == 6.0 && x[1] == 0.0).ok_or("no tip")?;
    let terms: Vec<(usize, f64)> = body.system.body.dofs.terms(tip, 1).collect();
    let near = displaced::bilinear(&body, pin).ok_or("no closed mode")?;
    let mut at = |size: f64| -> Result<[f64; 4], String> {
        let found = displaced::at_displacement(&mut body, pin, -size, near);
        let found = found.map_err(|e| e.to_string())?.ok_or("the mode does not move the crack")?;
        let orbit = found.orbit().ok_or_else(|| found.to_string())?;
        let alpha = orbit.viscous.as_ref().map_or(f64::NAN, |v| v.alpha);
        let of_tip = |u: &[f64]| terms.iter().map(|&(j, w)| w * u[j]).sum::<f64>();
        let (there, energy) = preload::turning_point(&body, orbit, &of_tip)?;
        Ok([orbit.omega(), alpha, orbit.energy / (size * size), energy / (there * there)])
    };
    let ([omega, alpha, energy, of_tip], [other, _, more, _]) = (at(0.1)?, at(0.3)?);
    let name = format!("breathing crack, {sides}");
    let wanted = if sides == "both" { 0.023_811_538_4 } else { 0.023_811_550_6 };
    checks.push(Check::near(format!("{name}: frequency"), omega, wanted, 4e-9));
    if sides == "both" {
        checks.push(Check::near(format!("{name}: alpha"), alpha, 8.877_85e-5, 1e-6));
    }
    let wanted = if sides == "both" { 3.354_145_987_5e-4 } else { 3.354_203_435_5e-4 };
    checks.push(Check::near(
        format!("{name}: energy over the square of the tip's displacement"),
        of_tip,
        wanted,
        1e-6,
    ));
    let off = (other / omega - 1.0).abs().max((more / energy - 1.0).abs());
    checks.push(Check::at_most(format!("{name}: three times the amplitude"), off, 1e-8));
    Ok(())
}

/// Quarter rings that were pressed together.
fn rings(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    let ring = |r: [f64; 2], around: usize| {
        let flat = rectangle(ElementKind::Quad9, r, std::f64::consts::FRAC_PI_2, (3, around), 0.0);
        flat.moved(|[r, angle, _]| [r * angle.cos(), r * angle.sin(), 0.0])
    };
    folder.put("inner", &ring([0.6, 1.0], 4))?;
    folder.put("outer", &ring([1.0, 1.5], 5))?;
    let hold = |name: &str| {
        format!(
            "[[support]]\ngroup = \"{name}:bottom\"\nfix = [\"y\"]\n[[support]]\ngroup = \"{name}:top\"\nfix = [\"x\"]\n"
        )
    };
    let text = plane(folder, "inner", "")
        + &plane(folder, "outer", "")
            .replace("young = 1.0\npoisson = 0.3", "young = 2.0\npoisson = 0.25")
        + &hold("inner")
        + &hold("outer")
        + "[[contact]]\nslave = \"inner:right\"\nmaster = \"outer:left\"\ngap = -0.01\npress = true\n[initial]\nequilibrium = true\n[run]\nuntil = 0.01\nsamples = 1\nintegrator = \"modal\"\n";
    let (problem, report, trajectory) = go(&text)?;
    let areas = &problem.system.conditions().area;
    let force: f64 = trajectory.pressure[0].iter().zip(areas).map(|(p, a)| p * a).sum();
    let whole: f64 = areas[..problem.system.conditions().facing()].iter().sum();
    checks.push(Check::near("press fit: mean pressure", force / whole, 0.003_076_889_1, 2e-8));
    checks.push(Check::near(
        "press fit: mean pressure, Lamé",
        force / whole,
        0.003_076_923_1,
        2e-5,
    ));
    checks.push(Check::near("press fit: energy", report.energy_end, 2.416_523_928_8e-5, 2e-8));
    let node = problem.system.body.mesh.nearest_node([0.6, 0.0, 0.0]);
    let moved = nodal_x(&problem, trajectory.at(0.0), node);
    // −2pa/(E(1 − a²)), p = 1/325
    let bore = -2.0 * 0.6 / (325.0 * 0.64);
    checks.push(Check::near("press fit: displacement of the bore, Lamé", moved, bore, 6e-5));
    Ok(())
}

/// `C = βK`, pinned to the mode that the contact moves most.
fn mode(text: &str, omega: f64) -> Result<(Propagator, Pin, Box<Orbit>), String> {
    let problem = Problem::new(&scene(text, None)?, None).map_err(|e| e.to_string())?;
    let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    let pinned = viscous::pinned_mode(&body).ok_or("no mode to pin to")?;
    let pin = Pin::new(&body, pinned, 0.01);
    for guess in pin.guesses(&body, omega) {
        let found = find(&mut body, Closure::Viscous(pin), &guess, omega, &Search::default());
        if let Verdict::Orbit(orbit) = found.map_err(|e| e.to_string())? {
            return Ok((body, pin, orbit));
        }
    }
    Err(format!("no viscous mode at {omega}"))
}

fn modes(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let bars = |n: usize, m: usize, choice: &str| {
        bar("a", n, 1.0, 1.0, 0.0)
            + &bar("b", m, 0.7, 1.0, 2.0)
            + "[[support]]\nedge = \"a:left\"\nfix = [\"x\"]\n[[support]]\nedge = \"b:right\"\nfix = [\"x\"]\n"
            + &format!(
                "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\ngap = 1.0\n{choice}[orbit]\nomega = 1.65\n"
            )
    };
    let push = |checks: &mut Vec<Check>,
                name: String,
                orbit: &Orbit,
                (energy, alpha): (f64, f64),
                off: f64| {
        checks.push(Check::near(format!("{name}: energy"), orbit.energy, energy, off));
        let found = orbit.viscous.as_ref().map_or(f64::NAN, |v| v.alpha);
        checks.push(Check::near(format!("{name}: alpha"), found, alpha, off));
    };
    for (choice, energy, alpha) in [
        ("", 1.893_858_310_7, 0.082_049_336_3),
        ("sides = \"slave\"\n", 1.911_196_986_3, 0.081_726_576_2),
        ("stress = \"reaction\"\ninertia = \"paper\"\n", 1.876_867_004_2, 0.083_971_747_2),
    ] {
        let name = format!(
            "bars of 20 and 14, {}",
            if choice.is_empty() { "both" } else { choice.trim() }.replace('\n', ", ")
        );
        let (_, _, orbit) = mode(&bars(20, 14, choice), 1.65)?;
        push(checks, name, &orbit, (energy, alpha), 2e-9);
    }
    for (n, both, slave) in [(40, 1.919_210, 1.922_914), (80, 1.926_345, 1.927_133)] {
        if effort.short {
            continue;
        }
        for (choice, energy) in [("", both), ("sides = \"slave\"\n", slave)] {
            let (_, _, orbit) = mode(&bars(n, 7 * n / 10, choice), 1.65)?;
            let name = format!(
                "bars of {n} and {}, {}: energy",
                7 * n / 10,
                if choice.is_empty() { "both" } else { "slave" }
            );
            checks.push(Check::near(name, orbit.energy, energy, 4e-7));
        }
    }
    let plates = |sides: &str| {
        plate("a", [1.0, 0.3], [10, 3], 0.0)
            + &plate("b", [0.8, 0.3], [8, 4], 2.0)
            + &hold("a:left", "[\"x\", \"y\"]")
            + &hold("b:right", "[\"x\", \"y\"]")
            + &hold("a:bottom", "[\"y\"]")
            + &hold("b:bottom", "[\"y\"]")
            + &format!(
                "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\ngap = 1.0\nsides = \"{sides}\"\n[orbit]\nomega = 1.65\n"
            )
    };
    let [both, slave] = [
        [(7, [5e-3, 1.4e-2]), (15, [1e-4, 6e-4]), (31, [2.5e-6, 5e-5])],
        [(7, [8e-4, 2.4e-2]), (15, [3e-4, 3.5e-3]), (31, [4e-5, 4.7e-4])],
    ];
    for (sides, energy, alpha, harmonics) in [
        ("both", 0.703_522_169_9, 0.061_239_177_7, both),
        ("slave", 0.757_413_497_4, 0.065_825_271_0, slave),
    ] {
        let (body, pin, orbit) = mode(&plates(sides), 1.65)?;
        let name = format!("half plates 10 x 3 and 8 x 4, {sides}");
        push(checks, name.clone(), &orbit, (energy, alpha), 4e-9);
        preload::beside_harmonics(&name, (&body, pin), &orbit, &harmonics, checks)?;
    }
    Ok(())
}

fn run(effort: Effort) -> Outcome {
    let folder = Folder::new()?;
    let mut checks = vec![];
    mirror(&folder, &mut checks)?;
    collisions(effort, &mut checks)?;
    patch(&folder, &mut checks)?;
    punch(&folder, &mut checks)?;
    blocks(&folder, &mut checks)?;
    crack(&folder, &mut checks)?;
    rings(&folder, &mut checks)?;
    preload::joint(&mut checks)?;
    preload::blocks(effort, &mut checks)?;
    modes(effort, &mut checks)?;
    hertz::run(&folder, effort.short, &mut checks)?;
    clatter::run(&folder, &mut checks)?;
    Ok(checks)
}
