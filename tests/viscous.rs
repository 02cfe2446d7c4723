//! The viscous nonlinear mode against numbers of an independent program (Python, sampled switch search, its own reduction).

mod common;

use signorini::contact::{ContactEdge, MassChoice, Stress, System};
use signorini::fem::Csr;
use signorini::mesh::Edge;
use signorini::orbit::search::{Effort, Verdict, find};
use signorini::orbit::viscous::{self, Pin};
use signorini::orbit::{Closure, Orbit, Propagator};

fn bar(n: usize) -> String {
    format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\n"
    )
}

/// The half plate of `scenarios/half-plate-orbit.toml` on any mesh.
fn half_plate(nx: usize, ny: usize, method: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\n{method}"
    )
}

/// The plate of the README, 1 × 0.5, both halves.
fn full_plate(nx: usize, ny: usize, more: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{more}"
    )
}

fn viscous_orbit(scene: &str, beta: f64, omega: f64) -> Orbit {
    orbit_of(common::problem(scene).system, beta, omega)
}

fn orbit_of(system: System, beta: f64, omega: f64) -> Orbit {
    let mut body = Propagator::new(system).unwrap();
    let pin = Pin::new(&body, viscous::pinned_mode(&body).unwrap(), beta);
    for guess in pin.guesses(&body, omega) {
        let verdict =
            find(&mut body, Closure::Viscous(pin), &guess, omega, &Effort::default()).unwrap();
        if let Verdict::Orbit(orbit) = verdict {
            return *orbit;
        }
    }
    panic!("no orbit");
}

/// Energy at `t = 0`, `α`, switches, first switch over the period, largest multiplier.
type Expected = (f64, f64, usize, Option<f64>, Option<f64>);

fn check(scene: &str, omega: f64, expected: Expected) {
    compare(&viscous_orbit(scene, 0.01, omega), expected);
}

fn compare(orbit: &Orbit, (energy, alpha, switches, first, multiplier): Expected) {
    let feedback = orbit.viscous.as_ref().unwrap();
    assert!((orbit.energy / energy - 1.0).abs() < 1e-9, "{} {energy}", orbit.energy);
    assert!((feedback.alpha - alpha).abs() < 1e-8, "{} {alpha}", feedback.alpha);
    assert_eq!(orbit.switches.len(), switches);
    if let Some(expected) = first {
        assert!((orbit.switches[0].t / orbit.period - expected).abs() < 1e-9);
    }
    assert!(orbit.residual <= 1e-11 && orbit.flaws().is_empty(), "{:?}", orbit.flaws());
    let largest = orbit.stability.as_ref().unwrap().largest;
    if let Some(expected) = multiplier {
        assert!((largest - expected).abs() < 2e-6, "{largest} {expected}");
    }
}

#[test]
fn bars_have_the_orbits_of_the_prototype() {
    check(&bar(20), 1.80, (2.1069895626, 0.1278276517, 2, Some(0.4023081199), Some(1.070501)));
    check(&bar(40), 1.87, (3.9649665467, 0.1193954523, 2, Some(0.3912843109), None));
}

#[test]
fn half_plates_have_the_orbits_of_the_prototype() {
    let coarse = half_plate(10, 3, "");
    check(&coarse, 1.80, (0.6567459227, 0.1464499459, 8, Some(0.3921846766), Some(1.055849)));
    check(&coarse, 1.86, (1.2201058041, 0.1285546307, 8, Some(0.3770531586), None));
    let condensed = "method = \"mass-redistribution\"\n";
    check(&half_plate(10, 3, condensed), 1.80, (0.6698282879, 0.1076510245, 8, None, None));
    let fine = half_plate(20, 6, "");
    check(&fine, 1.70, (0.3647804280, 0.1165816475, 14, Some(0.3961274087), None));
    check(&fine, 1.80, (0.7005171606, 0.1224353780, 14, Some(0.4001689603), Some(1.095843)));
}

/// One more redistribution, that of the prototype's first table: the mass of the contact displacements goes to their neighbours inside.
#[test]
fn mass_moved_to_the_neighbours_has_the_orbit_of_the_prototype() {
    let whole = common::problem(&half_plate(10, 3, "")).system;
    let mut body = (*whole.body).clone();
    let (n, n_o) = (body.dofs.n(), body.dofs.n_o);
    let least = 1e-12;
    // u_C moves as the neighbour inside does
    let behind = |node: usize| {
        let p = body.mesh.nodes()[node];
        let inside = |q: &[f64; 3]| (q[1] - p[1]).abs() < 1e-9 && (p[0] - q[0] - 0.1).abs() < 1e-9;
        let node = body.mesh.nodes().iter().position(inside).unwrap();
        body.dofs.of(node, 0).unwrap().0
    };
    let place = |i: usize| if i < n_o { i } else { behind(body.dofs.contact_nodes[i - n_o]) };
    let kept = body.mass.triplets().map(|(i, j, m)| (place(i), place(j), m));
    let kept = kept.chain((n_o..n).map(|i| (i, i, least))).collect();
    body.mass = Csr::from_triplets(n, n, kept);
    let edge = ContactEdge { edge: Edge::Right, gap: whole.gaps(), lumped: true };
    let system =
        System::on_edge(body, Some(&edge), (Stress::Reaction, MassChoice::Condensed)).unwrap();
    let orbit = orbit_of(system, 0.01, 1.80);
    compare(&orbit, (0.6763363078, 0.1116876097, 8, Some(0.3997916034), None));
}

#[test]
#[ignore = "a minute; `cargo test --release -- --ignored`"]
fn large_bodies_are_reduced() {
    let reduced = |modes: usize| format!("[reduction]\nmodes = {modes}\n");
    let cases = [
        (half_plate(40, 12, &reduced(146)), 183, (0.7229586779, 0.1179269283, 26, 0.3999563637)),
        (half_plate(46, 21, &reduced(146)), 210, (0.7271429782, 0.1175337019, 44, 0.3997268600)),
        (full_plate(46, 21, &reduced(230)), 296, (1.2833768306, 0.1760989338, 44, 0.3869266830)),
    ];
    for (scene, unknowns, (energy, alpha, switches, first)) in cases {
        let system = common::problem(&scene).system;
        assert_eq!(system.n_o(), unknowns);
        let orbit = orbit_of(system, 0.01, 1.80);
        let found = orbit.viscous.as_ref().unwrap().alpha;
        println!("{} {found} {:?}", orbit.energy, orbit.stability.as_ref().map(|s| s.largest));
        assert!((orbit.energy / energy - 1.0).abs() < 1e-6, "{} {energy}", orbit.energy);
        assert!((found - alpha).abs() < 1e-6, "{found} {alpha}");
        assert_eq!(orbit.switches.len(), switches);
        assert!((orbit.switches[0].t / orbit.period - first).abs() < 1e-6);
        assert!(orbit.residual <= 1e-11 && orbit.flaws().is_empty(), "{:?}", orbit.flaws());
    }
}
