//! Forces of supports and springs, momenta of parts: closed forms, and what Newton's second law says of all of them together.

use crate::common::{json, scene};

use signorini::contact::Borne;
use signorini::event::{Observer, Sample};
use signorini::problem::Problem;
use signorini::simulate::simulate;

/// What a body bears at the stored states, the forces of its contact groups with it.
#[derive(Default)]
struct Seen {
    t: Vec<f64>,
    borne: Vec<Borne>,
    contact: Vec<Vec<f64>>,
}

struct Look<'p>(&'p Problem, Seen);

impl Observer for Look<'_> {
    type Error = std::convert::Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Self::Error> {
        let system = &self.0.system;
        self.1.t.push(s.t);
        self.1.borne.push(system.bearings.of(&system.body, (&system.loads, s.t), [s.u, s.v, s.a]));
        let resultants = signorini::contact::Resultants::new(system);
        let [force, _] = resultants.of(s.pressure, s.traction, s.u);
        self.1.contact.push(force);
        Ok(())
    }
    fn takes_accelerations(&self) -> bool {
        true
    }
}

fn seen(text: &str) -> Seen {
    let scene = scene(text);
    let problem = Problem::new(&scene, None).unwrap();
    let mut look = Look(&problem, Seen::default());
    let report = simulate(&scene, &problem, false, &mut look).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    look.1
}

/// `∫ f dt` by trapezia.
fn integral(t: &[f64], f: impl Fn(usize) -> f64) -> f64 {
    (1..t.len()).map(|r| 0.5 * (t[r] - t[r - 1]) * (f(r) + f(r - 1))).sum()
}

/// One element, `u = cos ωt`, `ω² = 3E/(ρL²)`: the wall's force is `−(E/L) u + (ρL/6) ü`, with a consistent mass; with a lumped one `ω² = 2E/(ρL²)`, and no mass between them.
#[test]
fn a_bar_of_one_element_pulls_at_its_wall() {
    for (mass, square, between) in [("consistent", 3.0, 1.0 / 6.0), ("lumped", 2.0, 0.0)] {
        let text = format!(
            "[body]\nkind = 'bar'\nmass = '{mass}'\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
             [initial]\ndisplacement = ['x']\n[run]\nuntil = 5.0\nsamples = 50\nrtol = 1e-12\natol = 1e-14\n"
        );
        let seen = seen(&text);
        for (t, borne) in seen.t.iter().zip(&seen.borne) {
            let u = (f64::sqrt(square) * t).cos();
            let exact = -u - between * square * u;
            assert!(
                (borne.supports[0] - exact).abs() < 1e-9,
                "{mass} {t}: {:?} {exact}",
                borne.supports
            );
        }
    }
}

/// Weight, pressure and a force at a held corner go into the support; of a body that an obstacle bears too, the rest.
#[test]
fn at_rest_supports_bear_what_obstacles_leave() {
    let body = "[body]\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 2.0\nthickness = 0.5\n";
    let loads = "[[load]]\nkind = 'gravity'\namplitude = [0.0, -0.01]\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.003, -0.002]\n\
                 [[load]]\nkind = 'point'\nat = [0.0, 0.0]\namplitude = [0.0, 0.007]\n";
    let rest = "[initial]\nequilibrium = true\n[run]\nuntil = 0.1\nsamples = 2\n";
    // weight 2 · .4 · .5 · .01, traction over 1 · .5
    let (across, down) = (0.0015, -0.004 - 0.001 + 0.007);
    let clamp = "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n";
    for reduction in ["", "[reduction]\nkind = 'fixed-interface'\nmodes = 12\n"] {
        for contact in ["", "[contact]\nedge = 'bottom'\ngap = '0.02*x'\nstress = 'reaction'\n"] {
            if !reduction.is_empty() && contact.is_empty() {
                continue;
            }
            let seen = seen(&format!("{body}{clamp}{contact}{loads}{reduction}{rest}"));
            let [x, y] = [seen.borne[0].supports[0], seen.borne[0].supports[1]];
            let from_below = seen.contact[0].get(1).copied().unwrap_or(0.0);
            assert_eq!(from_below > 1e-4, !contact.is_empty());
            // modes of a reduction do not know how gravity pulls at the wall
            let off = if reduction.is_empty() { 1e-10 } else { 1e-4 };
            assert!((x + across).abs() < off, "{reduction}{contact}: {x}");
            assert!((y + from_below + down).abs() < off, "{reduction}{contact}: {y} {from_below}");
        }
    }
    // two supports that share a corner bear it once
    let rollers =
        "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n";
    let seen = seen(&format!("{body}{rollers}{loads}{rest}"));
    let all = &seen.borne[0].supports;
    assert!((all[0] + across).abs() < 1e-10 && (all[1] + all[3] + down).abs() < 1e-10, "{all:?}");
    assert_eq!(all[2], 0.0);
}

/// The weight of contact points that hang on a support goes into it: what all supports bear is the weight, at rest, and by the matrices of a program.
#[test]
fn supports_bear_the_weight_of_the_contact() {
    let body = "[body]\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n\
        [[load]]\nkind = 'gravity'\namplitude = [0.1, -0.2]\n[initial]\nequilibrium = true\n[run]\nuntil = 0.1\nsamples = 2\n";
    for method in [
        "method = 'mass-redistribution'",
        "stress = 'reaction'\ninertia = 'constant'",
        "method = 'penalty'",
    ] {
        let seen = seen(&format!("{body}[contact]\nedge = 'right'\ngap = 5.0\n{method}\n"));
        let all = &seen.borne[0].supports;
        let (across, down) = (all[0] + all[2] + 0.04, all[1] + all[3] - 0.08);
        assert!(across.abs() < 1e-12 && down.abs() < 1e-12, "{method}: {all:?}");
    }
}

/// One body is held, the other one thrown at it, against a spring with a preload, or the first one shaken: each momentum changes by what acts on it.
#[test]
fn momenta_change_by_the_forces() {
    let plate = |name: &str, size: &str, elements: &str, place: &str| {
        format!(
            "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = {size}\nelements = {elements}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{place}"
        )
    };
    // at nodes with inertia: what acts on massless ones moves some of their mass with it
    let spring = "[[spring]]\nat = [0.5, 0.0]\nto_at = [1.65, 0.05]\ndirection = [1.0, 0.0]\nstiffness = 0.1\npreload = 0.02\n";
    let shaken =
        "[[load]]\nkind = 'base'\nedge = 'held:left'\namplitude = [0.02, 0.01]\nomega = 1.3\n";
    // next to the contact
    let rolls = "[[support]]\nedge = 'held:bottom'\nfix = ['y']\n";
    for (friction, beta, more) in [
        (0.0, 0.0, spring),
        (0.3, 0.0, spring),
        (0.0, 0.02, shaken),
        (0.0, 0.0, shaken),
        (0.0, 0.0, rolls),
    ] {
        let text = plate("held", "[1.0, 0.5]", "[6, 3]", "")
            + &plate("thrown", "[0.6, 0.4]", "[4, 3]", "move = [1.05, 0.05]\n")
            + "[[support]]\nedge = 'held:left'\nfix = ['x', 'y']\n"
            + more
            + &format!(
                "[[contact]]\nslave = 'thrown:left'\nmaster = 'held:right'\nfriction = {friction:?}\n[damping]\nrayleigh = [0.0, {beta:?}]\n"
            )
            + "[[load]]\nkind = 'gravity'\namplitude = [0.0, 0.003]\n\
               [initial]\nvelocity = { thrown = ['-0.2', '0.1'] }\n[run]\nuntil = 4.0\nsamples = 4000\nrtol = 1e-10\natol = 1e-12\n";
        let seen = seen(&text);
        let momentum = |r: usize, k: usize| seen.borne[r].momentum[k];
        let last = seen.t.len() - 1;
        let weight = [0.003 * 0.5, 0.003 * 0.24];
        let mut largest = 0.0f64;
        for axis in 0..2 {
            let force = |r: usize| seen.contact[r][axis];
            // pressures are elastic ones: what stiffness-proportional damping adds to them is β times their rate
            let contact = integral(&seen.t, force) + beta * (force(last) - force(0));
            // tractions jump where a point comes to rest: trapezia are off by half a step times the variation at the most
            let variation: f64 = (1..=last).map(|r| (force(r) - force(r - 1)).abs()).sum();
            let within = if friction > 0.0 { 0.5 * 1e-3 * variation } else { 3e-7 };
            let of_supports =
                |r: usize| seen.borne[r].supports.iter().skip(axis).step_by(2).sum::<f64>();
            let support = integral(&seen.t, of_supports);
            let pulled = match axis {
                0 if more == spring => integral(&seen.t, |r| seen.borne[r].springs[0]),
                _ => 0.0,
            };
            let of_weight = |part: usize| if axis == 1 { 4.0 * weight[part] } else { 0.0 };
            let thrown = momentum(last, 2 + axis) - momentum(0, 2 + axis);
            let off = thrown - (contact - pulled + of_weight(1));
            assert!(off.abs() < within, "thrown, {friction} {beta}, axis {axis}: {off:e}");
            let held = momentum(last, axis) - momentum(0, axis);
            let off = held - (support - contact + pulled + of_weight(0));
            assert!(off.abs() < within, "held, {friction} {beta}, axis {axis}: {off:e}");
            largest = largest.max(contact.abs());
        }
        assert!(largest > 1e-3, "{largest}");
    }
}

/// Files, JSON and words know them.
#[test]
fn files_know_what_supports_and_springs_bear() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("run.h5");
    let said = json(&["run", "scenarios/pressed-blocks.toml", "-o", file.to_str().unwrap()]);
    let kinds: Vec<&str> =
        said["forces"].as_array().unwrap().iter().map(|f| f["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["contact", "support", "support", "support", "spring"]);
    let h5 = crate::common::hdf5_files().open(&file).unwrap();
    let supports = h5.dataset("forces/support/force").unwrap().read_2d::<f64>().unwrap();
    assert_eq!(supports.ncols(), 6);
    let springs = h5.dataset("forces/spring/force").unwrap().read_2d::<f64>().unwrap();
    let t = h5.dataset("trajectory/t").unwrap().read_raw::<f64>().unwrap();
    assert_eq!((springs.nrows(), springs.ncols()), (t.len(), 1));
    let largest = springs.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert_eq!(said["forces"][4]["maximum"].as_f64().unwrap(), largest);
    let pressure = h5.dataset("trajectory/pressure").unwrap().read_2d::<f64>().unwrap();
    let nodes = h5.dataset("mesh/contact_nodes").unwrap().read_raw::<i64>().unwrap();
    let most = pressure.iter().copied().fold(0.0, f64::max);
    let ((row, point), _) = pressure.indexed_iter().find(|(_, p)| **p == most).unwrap();
    let told = &said["largest_pressure"];
    assert!(most > 0.0 && told["largest"] == most && told["is_force"] == false, "{told}");
    assert!(told["t"] == t[row] && told["node"] == nodes[point], "{told}");
    // the limit of a slider is no pressure
    let joint = json(&["run", "scenarios/joint.toml", "-o", file.to_str().unwrap(), "--force"]);
    assert!(joint["largest_pressure"].is_null(), "{}", joint["largest_pressure"]);
    assert_eq!(h5.dataset("bodies/momentum").unwrap().shape(), [t.len(), 4]);
}

/// At a switch a pressure is a rounding error, and such a force acts nowhere; any other somewhere on the edge.
#[test]
fn what_rounding_errors_leave_acts_nowhere() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("run.h5");
    json(&["run", "scenarios/plate.toml", "-o", file.to_str().unwrap()]);
    let h5 = crate::common::hdf5_files().open(&file).unwrap();
    let table = |name: &str| h5.dataset(name).unwrap().read_2d::<f64>().unwrap();
    let (force, at) = (table("forces/contact/force"), table("forces/contact/place"));
    let (pressure, nodes) = (table("trajectory/pressure"), table("mesh/nodes"));
    let top = nodes.rows().into_iter().fold(0.0f64, |m, p| m.max(p[1]));
    let most = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    let [mut nowhere, mut somewhere] = [0; 2];
    for ((force, at), pressure) in force.rows().into_iter().zip(at.rows()).zip(pressure.rows()) {
        if force[0].abs() < 1e-10 * most {
            assert!(at.iter().all(|x| x.is_nan()), "{force} at {at}");
            nowhere += usize::from(pressure.iter().any(|p| *p != 0.0));
        } else {
            assert!((0.0..=top).contains(&at[1]), "{force} at {at}");
            somewhere += 1;
        }
    }
    assert!(nowhere > 0 && somewhere > 10, "{nowhere} {somewhere}");
}

/// An orbit at another frequency than the scene's is borne at its own: the wall of a shaken bar carries its momentum round, and back.
#[test]
fn orbits_at_other_frequencies_are_borne_at_them() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [contact]\nedge = 'right'\ngap = 100.0\nstress = 'reaction'\ninertia = 'constant'\n[damping]\nrayleigh = [0.2, 0.0]\n\
                [[load]]\nkind = 'base'\nedge = 'left'\namplitude = [0.1]\nomega = 0.9\n[orbit]\nomega = 1.3\n";
    std::fs::write(at("scene.toml"), text).unwrap();
    let file = at("orbit.h5");
    json(&["orbit", &at("scene.toml"), "--omega", "1.3", "-o", &file]);
    let h5 = crate::common::hdf5_files().open(&file).unwrap();
    let t = h5.dataset("trajectory/t").unwrap().read_raw::<f64>().unwrap();
    let force = h5.dataset("forces/support/force").unwrap().read_raw::<f64>().unwrap();
    // the force of α-damping on the whole body is taken up by the wall: over a period Σ forces = ∫ αρu̇ = 0
    let impulse = integral(&t, |r| force[r]);
    let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    assert!(largest > 0.01 && impulse.abs() < 1e-3 * largest, "{impulse} {largest}");
    // harmonic of the orbit's frequency: half a period later it is the opposite
    let half = 0.5 * t[t.len() - 1];
    let nearest = |x: f64| {
        let off = |r: &usize| (t[*r] - x).abs();
        (0..t.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
    };
    let mut compared = 0;
    for r in (0..t.len() / 2).step_by(7) {
        let other = nearest(t[r] + half);
        if (t[other] - t[r] - half).abs() < 1e-9 {
            compared += 1;
            assert!(
                (force[r] + force[other]).abs() < 1e-8 * largest,
                "{r}: {} {}",
                force[r],
                force[other]
            );
        }
    }
    assert!(compared > 10, "{compared}");
}
