//! The flow that follows the surroundings of the contact from switch to switch and the rest of the body in steps: the same motion as that of the body as one,
//! whose flow is checked against matrix exponentials and modes elsewhere.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::ops::ControlFlow;

use crate::common::rectangle::{msh, rectangle};
use crate::common::{problem, relative, scene};
use signorini::event::{Checkpoint, Observer, Outcome, Report, Resumed, Sample, Switch};
use signorini::flow::Zoned;
use signorini::mesh::{ElementKind, Facet, Mesh};
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::{go_on, simulate};

/// A long plate whose contact edge chatters: every mode moves it.
fn plate(elements: [usize; 2], contact: &str, more: &str) -> String {
    let [nx, ny] = elements;
    format!(
        "[body]\nkind = \"plate\"\nsize = [4.0, 0.4]\nelements = [{nx}, {ny}]\nmass = \"lumped\"\nyoung = 1.0\n\
         poisson = 0.3\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n\
         [contact]\nedge = \"right\"\n{contact}\n[initial]\n\
         displacement = [\"-0.3*sin(PI*x/8) + 0.02*x*sin(9*x)*cos(7*y)\", \"0.01*x*sin(5*x + 11*y)\"]\n\
         velocity = [\"0.4*sin(PI*x/8) + 0.3*sin(6*x)\", \"0.05*sin(4*x)\"]\n{more}\n\
         [run]\nintegrator = \"chebyshev\"\nuntil = 9.0\nsamples = 31\nstore = \"contact\"\n"
    )
}

/// Sees the contact alone, or everything; may want no more from some time on.
#[derive(Default)]
struct Watch {
    alone: bool,
    until: Option<f64>,
    n_o: usize,
    /// Times, and displacements and velocities of the contact.
    t: Vec<f64>,
    contact: Vec<Vec<f64>>,
    /// Total energies, where they are known, with all displacements there.
    whole: Vec<(f64, f64, Vec<f64>)>,
    switches: Vec<Switch>,
    checkpoints: Vec<(Checkpoint, usize)>,
}

impl Observer for Watch {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        self.t.push(s.t);
        self.contact.push([&s.u[self.n_o..], &s.v[self.n_o..], s.pressure].concat());
        if let Some(e) = s.energies {
            self.whole.push((s.t, e.total(), [s.u, s.v].concat()));
        }
        Ok(())
    }
    fn switch(&mut self, s: &Switch) -> Result<(), Infallible> {
        self.switches.push(s.clone());
        Ok(())
    }
    fn sees_contact_alone(&self) -> bool {
        self.alone
    }
    fn progress(&mut self, t: f64) -> Result<ControlFlow<()>, Infallible> {
        Ok(match self.until.is_some_and(|until| t >= until) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
    }
    fn keeps_checkpoints(&self) -> bool {
        true
    }
    fn phase(&mut self, c: Checkpoint) {
        self.checkpoints.push((c, self.switches.len()));
    }
}

fn run(scene: &Scene, body: &Problem, alone: bool, until: Option<f64>) -> (Report, Watch) {
    let mut watch = Watch { alone, until, n_o: body.system.n_o(), ..Watch::default() };
    (simulate(scene, body, false, &mut watch).unwrap(), watch)
}

fn state(report: &Report) -> Vec<f64> {
    [&report.last.u[..], &report.last.v].concat()
}

/// Every method with a diagonal mass, constant loads or none, meshes: the same switches, contact, energies and last state; no product of the whole body for
/// a switch.
#[test]
fn a_zone_moves_as_in_the_whole_body() {
    let gravity = "[[load]]\nkind = \"gravity\"\namplitude = [0.02, -0.01]\n";
    let cases = [
        ([120, 8], "gap = 0.05", ""),
        ([120, 8], "gap = 0.05", gravity),
        ([120, 8], "gap = 0.05\nmethod = \"penalty\"", ""),
        ([120, 8], "gap = 0.05\nmethod = \"nitsche\"\ngamma = 4.0", gravity),
        ([160, 5], "gap = 0.0", ""),
        ([90, 12], "gap = 0.02\nstress = \"nodal-mean\"", ""),
        ([120, 8], "gap = 0.05\ninertia = \"constant\"", ""),
        ([90, 12], "gap = 0.02\nstress = \"nodal-mean\"\ninertia = \"constant\"", gravity),
        ([120, 8], "gap = 0.03\nmethod = \"mass-redistribution\"", ""),
    ];
    for (elements, contact, load) in cases {
        let text = plate(elements, contact, load);
        let (scene, body) = (scene(&text), problem(&text));
        assert!(Zoned::new(&body.system).is_some(), "{contact}");
        let ((one, as_one), (parts, in_parts)) =
            (run(&scene, &body, false, None), run(&scene, &body, true, None));
        let of = |w: &Watch| w.switches.iter().map(|s| (s.node, s.kind)).collect::<Vec<_>>();
        let latest = as_one.switches.iter().zip(&in_parts.switches);
        let apart = latest.fold(0.0f64, |m, (a, b)| m.max((a.t - b.t).abs()));
        println!(
            "{contact:?}: {} switches, {apart:.1e} apart, {} products ({}), {} of {} samples whole, {:.1e}",
            one.log.switches(),
            parts.counters.products,
            one.counters.products,
            in_parts.whole.len(),
            in_parts.t.len(),
            relative(&state(&parts), &state(&one)),
        );
        assert!(one.is_certified() && parts.is_certified(), "{contact}");
        assert!(one.log.switches() > 40 && of(&as_one) == of(&in_parts), "{contact}");
        assert!(apart < 1e-10);
        let jumps = |w: &Watch| w.switches.iter().map(|s| s.energy_jump).collect::<Vec<_>>();
        let scale = one.energy_start;
        for (a, b) in jumps(&as_one).into_iter().zip(jumps(&in_parts)) {
            assert!((a - b).abs() < 1e-10 * scale);
        }
        assert!(relative(&state(&parts), &state(&one)) < 1e-10, "{contact}");
        assert_eq!(as_one.t.len(), in_parts.t.len());
        for (a, b) in as_one.contact.iter().zip(&in_parts.contact) {
            assert!(relative(b, a) < 1e-9, "{contact}");
        }
        // what is told to be whole is
        assert_eq!(as_one.whole.len(), as_one.t.len());
        assert!(in_parts.whole.len() >= 2 && in_parts.whole.len() < in_parts.t.len());
        for (t, energy, x) in &in_parts.whole {
            let same = as_one.whole.iter().find(|w| (w.0 - t).abs() < 1e-10).unwrap();
            assert!((energy - same.1).abs() < 1e-10 * scale && relative(x, &same.2) < 1e-9);
        }
        for report in [&one, &parts] {
            assert!(report.energy_drift < 1e-11 && report.energy_drift_total < 1e-11, "{contact}");
        }
        assert!(parts.counters.products < one.counters.products, "{contact}");
    }
}

/// Wherever a run is left, its last state is one of the whole body, and it goes on from its checkpoints to the same end, to the last bit.
#[test]
fn a_run_in_parts_can_be_left_anywhere() {
    let text = plate([120, 8], "gap = 0.02\nmethod = \"nitsche\"\ngamma = 4.0", "");
    let (scene, body) = (scene(&text), problem(&text));
    let (whole, all) = run(&scene, &body, true, None);
    for until in [0.3, 2.2, 3.71, 5.0, 6.9] {
        let (left, watch) = run(&scene, &body, true, Some(until));
        assert_eq!(left.outcome, Outcome::Interrupted { t: left.t_end });
        let mut short = scene.clone();
        short.run.as_mut().unwrap().until = Some(left.t_end);
        short.run.as_mut().unwrap().samples = 1;
        let (same, _) = run(&short, &body, false, None);
        let difference = relative(&state(&left), &state(&same));
        // a switch at the very end is behind one of them
        let energy = |r: &Report| r.energy_end - r.energy_jumps;
        let apart = energy(&left) - energy(&same);
        println!("left at {:.4}: {difference:.1e}, energies {apart:.1e}", left.t_end);
        assert!(difference < 1e-10 && apart.abs() < 1e-10);
        let (checkpoint, switches) = watch.checkpoints.last().unwrap().clone();
        assert!(checkpoint.t <= left.t_end);
        let mut log = signorini::event::Log::new(true);
        watch.switches[..switches].iter().for_each(|s| log.add_switch(s.clone()));
        let mut rest = Watch { alone: true, n_o: body.system.n_o(), ..Watch::default() };
        let resumed = Resumed { checkpoint, log };
        let end = go_on(&scene, &body, false, resumed, &mut rest).unwrap();
        assert_eq!(end.last, whole.last);
        assert_eq!(end.switches, whole.switches);
        assert_eq!(rest.switches[..], all.switches[switches..]);
    }
    // some of them are in the midst of a phase
    let at_switch = |c: &Checkpoint| all.switches.iter().any(|s| s.t == c.t);
    let anchors = all.checkpoints.iter().filter(|(c, _)| c.t > 0.0 && !at_switch(c)).count();
    println!("{} checkpoints, {anchors} between switches", all.checkpoints.len());
    assert!(anchors > 0);
}

/// Nodes of the contact's group that a support holds are no contact; their displacements along it are stored, however far away they are.
#[test]
fn what_is_stored_far_away_is_no_older_state() {
    let mesh = rectangle(ElementKind::Quad4, [0.0, 10.0], 0.16, (300, 4), 0.0);
    let mut groups: BTreeMap<String, Vec<Facet>> =
        ["left", "bottom"].map(|g| (g.to_owned(), mesh.group(g).to_vec())).into();
    let first = |f: &Facet| mesh.nodes()[mesh.element(*f).nodes[0]][0];
    let held = mesh.group("bottom").iter().copied().filter(|f| first(f) < 9.6).collect();
    groups.insert("top".to_owned(), held);
    let mesh = Mesh::new(2, mesh.nodes().to_vec(), mesh.blocks().to_vec(), groups);
    let folder = tempfile::TempDir::new().unwrap();
    std::fs::write(folder.path().join("strip.msh"), msh(&mesh, |_| 0)).unwrap();
    let of = |store: &str| {
        let text = format!(
            "[body]\nkind = \"mesh\"\nfile = \"strip.msh\"\nstate = \"plane stress\"\nmass = \"lumped\"\n\
             [[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\ngroup = \"left\"\nfix = [\"x\"]\n[[support]]\ngroup = \"top\"\nfix = [\"y\"]\n\
             [contact]\ngroup = \"bottom\"\nmethod = \"penalty\"\nplane = {{ normal = [0.0, -1.0], offset = 0.01 }}\n\
             [initial]\ndisplacement = [\"0.05*sin(3*x)\", \"0\"]\nvelocity = [\"0.2*sin(PI*x/20)\", \"0\"]\n\
             [run]\nintegrator = \"chebyshev\"\nuntil = 6.0\nsamples = 40\nstore = \"{store}\"\n"
        );
        let scene = folder.path().join(format!("{store}.toml"));
        std::fs::write(&scene, text).unwrap();
        let file = scene.with_extension("h5");
        let done = crate::common::run(&[
            "run",
            scene.to_str().unwrap(),
            "-o",
            file.to_str().unwrap(),
            "-q",
        ]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        crate::common::hdf5_files().open(&file).unwrap()
    };
    let (part, all) = (of("contact"), of("all"));
    let columns = part.dataset("trajectory/columns").unwrap().read_raw::<i64>().unwrap();
    for name in ["trajectory/u", "trajectory/v"] {
        let of_part = part.dataset(name).unwrap().read_2d::<f64>().unwrap();
        let of_all = all.dataset(name).unwrap().read_2d::<f64>().unwrap();
        assert!(of_part.nrows() > 60 && of_part.nrows() == of_all.nrows() && columns.len() > 250);
        for (k, &c) in columns.iter().enumerate() {
            for row in 0..of_part.nrows() {
                let apart = (of_part[(row, k)] - of_all[(row, c as usize)]).abs();
                assert!(apart < 1e-10, "{name} row {row} column {c}: {apart}");
            }
        }
    }
}

/// Bodies that the zone is no part of, or gains nothing for, go as one.
#[test]
fn other_bodies_go_as_one() {
    let thin = plate([12, 8], "gap = 0.05", "");
    let damped = plate([120, 8], "gap = 0.05", "[damping]\nrayleigh = [0.1, 0.0]\n");
    let driven = plate(
        [120, 8],
        "gap = 0.05",
        "[[load]]\nkind = \"gravity\"\namplitude = [0.02, 0.0]\nomega = 1.0\n",
    );
    let consistent = plate([120, 8], "gap = 0.05", "").replace("\"lumped\"", "\"consistent\"");
    let along = plate([120, 8], "gap = 0.05", "").replace("edge = \"right\"", "edge = \"bottom\"");
    for text in [thin, damped, driven, consistent, along] {
        assert!(Zoned::new(&problem(&text).system).is_none(), "{text}");
    }
}

/// Gmsh numbers nodes as it makes them: the body is the same however they are numbered, and so is its zone.
#[test]
fn numbers_of_nodes_say_nothing() {
    let mesh = rectangle(ElementKind::Quad4, [0.0, 4.0], 0.4, (120, 8), 0.2);
    let n = mesh.n_nodes();
    let new = |k: usize| (k * 647 + 5) % n;
    assert_ne!(n % 647, 0);
    let mut nodes = vec![[0.0; 3]; n];
    (0..n).for_each(|k| nodes[new(k)] = mesh.nodes()[k]);
    let mut blocks = mesh.blocks().to_vec();
    blocks.iter_mut().flat_map(|b| &mut b.connectivity).for_each(|k| *k = new(*k));
    let groups: BTreeMap<String, Vec<Facet>> =
        mesh.groups().map(|g| (g.to_owned(), mesh.group(g).to_vec())).collect();
    let shuffled = Mesh::new(2, nodes, blocks, groups);
    let folder = tempfile::tempdir().unwrap();
    let of = |name: &str, mesh: &Mesh| {
        let file = folder.path().join(name);
        std::fs::write(&file, msh(mesh, |_| 0)).unwrap();
        let text = plate([120, 8], "gap = 0.05", "")
            .replace("kind = \"plate\"", &format!("kind = \"mesh\"\nfile = \"{}\"", file.display()))
            .replace("size = [4.0, 0.4]\nelements = [120, 8]\n", "state = \"plane stress\"\n")
            .replace("mass = \"lumped\"\n", "mass = \"lumped\"\n[[material]]\n")
            .replace("edge = ", "group = ");
        let body = problem(&text);
        assert!(Zoned::new(&body.system).is_some());
        run(&scene(&text), &body, true, None)
    };
    let ((ordered, seen), (other, as_made)) = (of("ordered.msh", &mesh), of("made.msh", &shuffled));
    assert!(seen.switches.len() > 10 && seen.switches.len() == as_made.switches.len());
    for (a, b) in seen.switches.iter().zip(&as_made.switches) {
        assert!((a.t - b.t).abs() < 1e-10 && new(a.node) == b.node, "{} {}", a.t, b.t);
    }
    let products = |r: &Report| r.counters.products as f64;
    assert!((products(&other) / products(&ordered) - 1.0).abs() < 0.05);
}
