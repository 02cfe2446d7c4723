//! Random scenes of bodies that meet: turned, mirrored, in other units, in another order, in two runs instead of one, and by steps of Dormand and Prince, they move as they do.

use std::fmt::Write as _;

use crate::common::rectangle::{msh, rectangle};
use crate::common::{Collector, Splitmix, run_by, scene};
use signorini::event::Report;
use signorini::mesh::ElementKind;
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::simulate;

/// How a scene is told: units of length, time and mass, an angle in degrees, seen in a mirror along x, the tables of bodies in reverse order.
#[derive(Clone, Copy)]
struct View {
    l: f64,
    t: f64,
    m: f64,
    turn: f64,
    mirror: bool,
    reverse: bool,
}

const PLAIN: View = View { l: 1.0, t: 1.0, m: 1.0, turn: 0.0, mirror: false, reverse: false };

impl View {
    /// A vector of the plane.
    fn of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn.to_radians().sin_cos();
        let y = if self.mirror { -y } else { y };
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// What a vector was.
    fn back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn.to_radians().sin_cos();
        let (x, y) = (cos * x + sin * y, cos * y - sin * x);
        [x, if self.mirror { -y } else { y }]
    }
}

/// A rectangular body.
struct Block {
    kind: ElementKind,
    size: [f64; 2],
    elements: (usize, usize),
    material: [f64; 3],
    at: [f64; 2],
    velocity: [f64; 2],
    spin: f64,
    held: Option<&'static str>,
}

/// A random scene: two or three blocks in a row.
struct Blocks {
    blocks: Vec<Block>,
    /// Whether the second of two neighbours is the slave.
    is_slave: [bool; 2],
    choice: String,
    damping: [f64; 2],
    state: &'static str,
    lumped: bool,
    has_friction: bool,
}

const KINDS: [ElementKind; 5] = [
    ElementKind::Quad4,
    ElementKind::Tri3,
    ElementKind::Quad8,
    ElementKind::Quad9,
    ElementKind::Tri6,
];

/// Time to which scenes run.
const UNTIL: f64 = 2.5;

fn draw(case: usize) -> Blocks {
    let random = Splitmix::new(3700 + case as u64);
    let between = |a: f64, b: f64| a + (b - a) * (random.bits() >> 11) as f64 / (1u64 << 53) as f64;
    let pick = |n: usize| (random.bits() >> 20) as usize % n;
    let count = if pick(4) == 0 { 3 } else { 2 };
    let kind = KINDS[case % KINDS.len()];
    let linear = matches!(kind, ElementKind::Quad4 | ElementKind::Tri3);
    let mut blocks: Vec<Block> = vec![];
    let mut x = 0.0;
    // higher and lower in turn: a slave of second order must be covered
    let first = pick(2);
    for k in 0..count {
        let is_high = (k + first) % 2 == 0;
        let height = if is_high { between(0.45, 0.6) } else { between(0.25, 0.33) };
        let size = [between(0.5, 1.0), height];
        let (most, least) = if linear { (4, 2) } else { (2, 2) };
        let elements = (least + pick(most), least + pick(most));
        let held = match (k, k + 1 == count) {
            (0, _) if pick(3) > 0 => Some("left"),
            (_, true) if pick(3) == 0 => Some("right"),
            _ => None,
        };
        let speed = if k == 0 { between(0.0, 0.3) } else { between(-0.6, -0.2) };
        let (velocity, spin) = match held {
            Some(_) => ([0.0, 0.0], 0.0),
            None => ([speed, between(-0.1, 0.1)], between(-0.2, 0.2)),
        };
        // no side ends beside the end of another: who covers what is not left to rounding
        let below = if is_high { between(-0.05, -0.02) } else { between(0.0, 0.05) };
        let at = [x, below];
        x += size[0] + between(0.02, 0.08);
        let material = [between(0.5, 3.0), between(0.0, 0.35), between(0.5, 2.0)];
        blocks.push(Block { kind, size, elements, material, at, velocity, spin, held });
    }
    let has_friction = pick(3) == 0;
    let mut choice = String::new();
    let sides = if pick(2) == 0 { "both" } else { "slave" };
    let _ = writeln!(choice, "sides = '{sides}'");
    if has_friction {
        let _ = writeln!(choice, "friction = {:?}", between(0.1, 0.8));
    } else if pick(4) == 0 {
        choice += "method = 'mass-redistribution'\n";
    }
    let damping = match pick(3) {
        0 => [between(0.0, 0.2), 0.0],
        1 if !has_friction => [0.0, between(0.001, 0.02)],
        _ => [0.0, 0.0],
    };
    Blocks {
        blocks,
        is_slave: [0, 1].map(|k| if linear { pick(2) == 0 } else { (k + first) % 2 == 0 }),
        choice,
        damping,
        state: ["plane stress", "plane strain"][pick(2)],
        lumped: linear && pick(2) == 0,
        has_friction,
    }
}

fn name(k: usize) -> String {
    ["a", "b", "c"][k].to_owned()
}

impl Blocks {
    /// The scene in TOML; meshes go to the folder.
    fn text(&self, view: View, folder: &std::path::Path) -> String {
        let View { l, t, m, turn, mirror, reverse } = view;
        let order = |n: usize| -> Vec<usize> {
            if reverse { (0..n).rev().collect() } else { (0..n).collect() }
        };
        let mut text = String::new();
        let all = order(self.blocks.len());
        for &k in &all {
            let b = &self.blocks[k];
            let file = folder.join(format!("{}-{l:e}.msh", name(k)));
            let mesh = rectangle(b.kind, [0.0, b.size[0]], b.size[1], b.elements, 0.0);
            std::fs::write(&file, msh(&mesh.moved(|x| x.map(|x| l * x)), |_| 0)).unwrap();
            let place = view.of(b.at).map(|x| l * x);
            let mirror = if mirror { "mirror = 'y'\n" } else { "" };
            let mass = if self.lumped { "mass = 'lumped'\n" } else { "" };
            let _ = write!(
                text,
                "[[body]]\nname = '{}'\nkind = 'mesh'\nfile = '{}'\nstate = '{}'\nthickness = {l:?}\n{mass}{mirror}turn = {turn:?}\nmove = {place:?}\n",
                name(k),
                file.display(),
                self.state
            );
        }
        for &k in &all {
            let [e, nu, rho] = self.blocks[k].material;
            let (e, rho) = (e * m / (l * t * t), rho * m / l.powi(3));
            let _ = write!(
                text,
                "[[material]]\ngroup = '{}'\nyoung = {e:?}\npoisson = {nu:?}\ndensity = {rho:?}\n",
                name(k)
            );
            if let Some(side) = self.blocks[k].held {
                let _ =
                    write!(text, "[[support]]\ngroup = '{}:{side}'\nfix = ['x', 'y']\n", name(k));
            }
        }
        for k in order(self.blocks.len() - 1) {
            let [left, right] = [format!("{}:right", name(k)), format!("{}:left", name(k + 1))];
            let [slave, master] = if self.is_slave[k] { [right, left] } else { [left, right] };
            let _ = write!(
                text,
                "[[contact]]\nslave = '{slave}'\nmaster = '{master}'\n{}",
                self.choice
            );
        }
        let mut velocities = vec![];
        for (k, b) in self.blocks.iter().enumerate().filter(|(_, b)| b.held.is_none()) {
            // v + spin × (x − centre)
            let centre =
                view.of([b.at[0] + 0.5 * b.size[0], b.at[1] + 0.5 * b.size[1]]).map(|x| l * x);
            let [vx, vy] = view.of(b.velocity).map(|v| v * l / t);
            let spin = if mirror { -b.spin } else { b.spin } / t;
            velocities.push(format!(
                "{} = ['{vx:?} - ({spin:?})*(y - ({:?}))', '{vy:?} + ({spin:?})*(x - ({:?}))']",
                name(k),
                centre[1],
                centre[0]
            ));
        }
        let [alpha, beta] = [self.damping[0] / t, self.damping[1] * t];
        let _ = write!(
            text,
            "[damping]\nrayleigh = [{alpha:?}, {beta:?}]\n[initial]\nvelocity = {{ {} }}\n[run]\nuntil = {:?}\nsamples = 1\n",
            velocities.join(", "),
            UNTIL * t
        );
        text
    }
}

/// A motion in the first view: displacements at the end, body after body, instants of switches, energy at the end.
struct Motion {
    u: Vec<[f64; 2]>,
    switches: Vec<f64>,
    energy: f64,
}

fn told(
    view: View,
    problem: &Problem,
    report: &Report,
    states: &Collector,
    bodies: usize,
) -> Motion {
    let mesh = &problem.system.body.mesh;
    let nodal = problem.system.body.dofs.scatter(states.u.last().unwrap());
    let part = mesh.parts();
    let order: Vec<usize> =
        if view.reverse { (0..bodies).rev().collect() } else { (0..bodies).collect() };
    let of_part = |k: usize| (0..mesh.n_nodes()).filter(|&n| part[n] == k).collect::<Vec<_>>();
    let nodes = order.into_iter().flat_map(of_part);
    let u = nodes.map(|n| view.back([nodal[2 * n], nodal[2 * n + 1]]).map(|x| x / view.l));
    Motion {
        u: u.collect(),
        switches: report.switches.iter().map(|s| s.t / view.t).collect(),
        energy: report.energy_end * view.t * view.t / (view.m * view.l * view.l),
    }
}

/// One run of a scene; `halfway` stops and goes on.
fn moved(blocks: &Blocks, view: View, integrator: Integrator, halfway: bool) -> (Motion, Report) {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(&blocks.text(view, folder.path()));
    let mut problem = Problem::new(&scene, None).unwrap();
    let run = scene.run.as_mut().unwrap();
    (run.integrator, run.rtol, run.atol) = (integrator, 1e-11, 1e-14 * view.l);
    let until = run.until;
    let mut earlier = vec![];
    if halfway {
        run.until = until.map(|t| 0.43 * t);
        let report = run_by(&scene, integrator);
        earlier = report.switches.iter().map(|s| s.t).collect();
        problem.initial = report.last;
        scene.run.as_mut().unwrap().until = until.map(|t| 0.57 * t);
    }
    let mut states = Collector::default();
    let report = match simulate(&scene, &problem, false, &mut states) {
        Ok(report) => report,
        Err(e) => panic!("{e}: {}", blocks.text(view, &folder.keep())),
    };
    assert!(
        report.outcome.is_complete(),
        "{}: {}",
        report.outcome,
        blocks.text(view, folder.path())
    );
    let mut motion = told(view, &problem, &report, &states, blocks.blocks.len());
    if halfway {
        let later = motion.switches.iter().map(|t| t + 0.43 * UNTIL);
        motion.switches = earlier.into_iter().chain(later).collect();
    }
    (motion, report)
}

/// The largest distance of displacements over their size, of instants, of energies.
fn apart(a: &Motion, b: &Motion) -> f64 {
    let size = a.u.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    let off = |(p, q): (&[f64; 2], &[f64; 2])| (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) / size;
    let far = a.u.iter().zip(&b.u).map(off).fold(0.0, f64::max);
    // nodes that switch at one instant are told in either order
    let mut instants = [a.switches.clone(), b.switches.clone()];
    instants.iter_mut().for_each(|t| t.sort_by(f64::total_cmp));
    let late = instants[0].iter().zip(&instants[1]).map(|(s, t)| (s - t).abs());
    let energy = (a.energy - b.energy).abs() / a.energy;
    far.max(late.fold(0.0, f64::max)).max(energy)
}

#[test]
fn random_bodies_that_meet_know_no_units_no_order_and_no_direction() {
    agree(0..60);
}

#[test]
#[ignore = "a minute and a half"]
fn two_hundred_random_bodies_that_meet() {
    agree(0..200);
}

fn agree(cases: std::ops::Range<usize>) {
    let count = cases.len();
    let (mut switches, mut touched) = (0, 0);
    let mut worst: Vec<(f64, usize, &str)> = vec![];
    for case in cases {
        let blocks = draw(case);
        let (plain, report) = moved(&blocks, PLAIN, Integrator::Modal, false);
        switches += report.switches.len();
        touched += usize::from(!report.switches.is_empty());
        assert_eq!(report.proof.missed, 0, "scene {case}");
        if blocks.damping == [0.0, 0.0] {
            assert!(
                report.energy_drift_total < 1e-11,
                "scene {case}: {}",
                report.energy_drift_total
            );
        }
        let angle = 17.0 + 29.0 * case as f64;
        let (what, view, integrator, halfway) = match case / KINDS.len() % 6 {
            0 => ("turned", View { turn: angle, ..PLAIN }, Integrator::Modal, false),
            1 => ("mirrored", View { mirror: true, ..PLAIN }, Integrator::Modal, false),
            2 => {
                let (l, t, m) = (1e-3, 1e-5, 1e-4);
                ("other units", View { l, t, m, ..PLAIN }, Integrator::Modal, false)
            }
            3 => ("another order", View { reverse: true, ..PLAIN }, Integrator::Modal, false),
            4 => ("two runs", PLAIN, Integrator::Modal, true),
            _ => ("Dormand and Prince", PLAIN, Integrator::Dop853, false),
        };
        let (other, told) = moved(&blocks, view, integrator, halfway);
        assert_eq!(
            plain.switches.len(),
            other.switches.len(),
            "scene {case}, {what}: {}",
            told.outcome
        );
        worst.push((apart(&plain, &other), case, what));
        if !blocks.has_friction && case % 4 == 0 {
            let (other, _) = moved(&blocks, PLAIN, Integrator::Chebyshev, false);
            assert_eq!(plain.switches.len(), other.switches.len(), "scene {case}, without modes");
            worst.push((apart(&plain, &other), case, "without modes"));
        }
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!(
        "{count} scenes, {touched} with contact, {switches} switches; furthest apart {:?}",
        &worst[..8]
    );
    assert!(touched > count * 3 / 4 && switches > 10 * count, "{touched} {switches}");
    for (apart, case, what) in worst {
        let bound = if what == "Dormand and Prince" { 1e-6 } else { 1e-8 };
        assert!(apart < bound, "scene {case}, {what}: {apart:e}");
    }
}
