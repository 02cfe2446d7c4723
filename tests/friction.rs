//! Friction at the contact: exact flows against Dormand–Prince in every state, the equations of a phase against themselves, relations between scenes, refusals.
//! References that this program did not produce are in `validate/friction`.

use crate::common::{
    Splitmix, datasets, derivative_error, json, problem, program, relative, run, run_by, scene,
};
use signorini::contact::{PointState, State, States, System};
use signorini::event::{self, Options, Report, Silent, SwitchKind};
use signorini::flow::Modal;
use signorini::orbit::period_map::integrate;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};
use signorini::store::Stored;

fn plate(size: &str, tables: &str) -> String {
    format!("[body]\nkind = 'plate'\n{size}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{tables}")
}

const SIZE: &str = "size = [0.5, 1.0]\nelements = [2, 4]";
const DAMPER: &str = "[[damper]]\nat = [0.0, 0.75]\ndirection = [0.6, 0.8]\nviscosity = 0.3\n";
const JENKINS: &str = "[[slider]]\nat = [0.0, 0.0]\ndirection = [0.0, 1.0]\nlimit = 0.02\nstiffness = 0.5\n[[load]]\nkind = 'gravity'\namplitude = [0.03, -0.01]\n";
const CLAMPED: &str = "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n";

fn friction_work(r: &Report) -> f64 {
    r.rubbed.as_ref().map_or(0.0, |f| f.work())
}

/// Free and clamped plates, with belts, loads on the contact edge, viscosity of both kinds, two obstacles: states, switches and all books.
#[test]
fn exact_flows_slip_and_stick_as_dormand_prince_does() {
    let wall = |gap: f64, more: &str| format!("[contact]\nedge = 'right'\ngap = {gap}\n{more}\n");
    let press = "[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.0]\n";
    let shake = "[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 0.1]\nomega = 1.3\n";
    let on_contact = "[[load]]\nkind = 'traction'\nedge = 'right'\namplitude = [0.1, 0.05]\nomega = 2.1\nphase = 0.3\n";
    let thrown = "[initial]\nvelocity = ['0.2', '0.1']\n[run]\nuntil = 6.0\n";
    let from_rest = "[initial]\nequilibrium = true\n[run]\nuntil = 8.0\n";
    let pushed = "[initial]\nvelocity = ['0.3*x', '0.2*x']\n[run]\nuntil = 6.0\n";
    let two = "[[contact]]\nedge = 'right'\ngap = 0.02\nfriction = 0.4\n[[contact]]\nedge = 'top'\ngap = 0.01\nfriction = 0.2\nsurface = [0.1, 0.0]\n";
    let damped = |a: f64, b: f64| format!("[damping]\nrayleigh = [{a}, {b}]\n");
    let cases = [
        ("free, undamped", wall(0.02, "friction = 0.3") + thrown),
        ("free, damped", wall(0.02, "friction = 0.3") + &damped(0.1, 0.0) + thrown),
        ("free, viscous", wall(0.02, "friction = 0.6") + &damped(0.1, 0.02) + thrown),
        (
            "free, belt",
            wall(0.02, "friction = 0.3\nsurface = [0.0, 0.15]") + &damped(0.05, 0.01) + thrown,
        ),
        ("block", wall(0.0, "friction = 0.5") + &damped(0.2, 0.0) + press + shake + from_rest),
        (
            "block, viscous",
            wall(0.0, "friction = 0.5") + &damped(0.1, 0.03) + press + shake + from_rest,
        ),
        ("block, undamped", wall(0.0, "friction = 0.5") + press + shake + from_rest),
        (
            "block, load on the contact",
            wall(0.0, "friction = 0.5") + &damped(0.1, 0.02) + press + on_contact + from_rest,
        ),
        (
            "clamped on a belt, load on the contact",
            CLAMPED.to_owned()
                + &wall(-0.02, "friction = 0.3\nsurface = [0.0, -0.2]")
                + &damped(0.1, 0.02)
                + on_contact
                + from_rest,
        ),
        ("clamped", CLAMPED.to_owned() + &wall(0.01, "friction = 0.4") + pushed),
        (
            "clamped, belt, viscous",
            CLAMPED.to_owned()
                + &wall(-0.02, "friction = 0.4\nsurface = [0.0, 0.1]")
                + &damped(0.0, 0.02)
                + pushed,
        ),
        ("two obstacles", two.to_owned() + &damped(0.1, 0.01) + thrown),
        // dampers and springs of sliders hold what moves rigidly, each in its own way
        ("free, damper", wall(0.02, "friction = 0.3") + &damped(0.05, 0.0) + DAMPER + thrown),
        ("free, damper alone", wall(0.02, "friction = 0.3") + DAMPER + thrown),
        (
            "free, spring of a slider, viscous",
            wall(0.02, "friction = 0.3") + &damped(0.05, 0.02) + JENKINS + thrown,
        ),
        (
            "free, spring of a slider, damper",
            wall(0.02, "friction = 0.3") + &damped(0.05, 0.02) + JENKINS + DAMPER + thrown,
        ),
    ];
    let (mut sticks, mut slips) = (0, 0);
    for (name, tables) in cases {
        let scene = scene(&plate(SIZE, &tables));
        let (exact, stepped) =
            (run_by(&scene, Integrator::Modal), run_by(&scene, Integrator::Dop853));
        let state = |r: &Report| [&r.last.u[..], &r.last.v[..]].concat();
        let off = relative(&state(&exact), &state(&stepped));
        println!(
            "{name}: {off:.1e}, {} switches, ledger {:.1e}",
            exact.switches.len(),
            exact.energy_drift_total
        );
        assert!(off < 1e-9, "{name}: {off:e}");
        assert_eq!(exact.switches.len(), stepped.switches.len(), "{name}");
        assert!(exact.energy_drift_total < 1e-11 && stepped.energy_drift_total < 1e-11, "{name}");
        let scale = stepped.energy_end + stepped.energy_start + stepped.energy_external.abs();
        let books = |r: &Report| {
            let rubbed = r.rubbed.clone().unwrap();
            let points = rubbed.points.iter().flat_map(|p| [p.0, p.1]);
            let all = [r.energy_external, r.energy_dissipated, rubbed.belt];
            points.chain(all).collect::<Vec<f64>>()
        };
        for (a, b) in books(&exact).into_iter().zip(books(&stepped)) {
            assert!((a - b).abs() < 1e-8 * (scale + b.abs()), "{name}: {a} {b}");
        }
        assert!(books(&exact)[0] >= 0.0 && friction_work(&exact) > 0.0, "{name}");
        sticks += exact.log.of_kind(SwitchKind::Sticking);
        slips += exact.log.of_kind(SwitchKind::Slipping);
    }
    assert!(sticks > 40 && slips > 40, "{sticks} {slips}");
}

/// A body pressed against one rough obstacle and drawn along it lies before another without pressure: reactions and accelerations there are rounding errors, and decide
/// nothing until it is let go.
#[test]
fn what_lies_without_pressure_goes_on() {
    let tables = "[[contact]]\nedge = 'bottom'\ngap = 0.0\nfriction = 0.5\n[[contact]]\nedge = 'top'\ngap = 0.0\nfriction = 1.2\n\
                  [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.01, 0.02]\nomega = 1.0\nphase = 0.3\n\
                  [damping]\nrayleigh = [0.0, 0.01]\n[run]\nuntil = 6.0\n";
    let scene = scene(&plate(SIZE, tables));
    let [exact, stepped] = [Integrator::Modal, Integrator::Dop853].map(|i| run_by(&scene, i));
    let state = |r: &Report| [&r.last.u[..], &r.last.v[..]].concat();
    assert!(relative(&state(&exact), &state(&stepped)) < 1e-9);
    // the load lets go where it has no part towards the obstacle
    let let_go = std::f64::consts::FRAC_PI_2 - 0.3;
    let of = |r: &Report| -> Vec<(usize, SwitchKind, f64)> {
        let moving = r.switches.iter().filter(|s| s.t > let_go + 0.1);
        moving.map(|s| (s.point, s.kind, s.t)).collect()
    };
    let (a, b) = (of(&exact), of(&stepped));
    assert!(a.len() > 20 && a.len() == b.len(), "{} {}", a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert!((a.0, a.1) == (b.0, b.1) && (a.2 - b.2).abs() < 1e-7, "{a:?} {b:?}");
    }
}

/// A viscous body at rest before two rough obstacles, drawn into them and along them by springs under preload, and by a load that has yet to grow from zero: what
/// touches without a pressure is held by nothing, and what begins to slip does so by a rate.
#[test]
fn a_viscous_body_at_rest_before_rough_obstacles_begins() {
    let tables = |preloads: [f64; 2], load: &str| {
        let contact = |edge: &str| {
            format!(
                "[[contact]]\nedge = '{edge}'\ngap = 0.0\nfriction = 0.9\nstress = 'reaction'\n"
            )
        };
        let spring = |direction: &str, preload: f64| {
            format!(
                "[[spring]]\nedge = 'left'\ndirection = {direction}\nstiffness = 0.5\npreload = {preload:?}\n"
            )
        };
        let springs = spring("[1.0, 0.0]", preloads[0]) + &spring("[0.0, 1.0]", preloads[1]);
        format!(
            "{}{}{springs}[damping]\nrayleigh = [0.0, 0.05]\n[[load]]\nkind = 'traction'\nedge = 'top'\n{load}omega = 1.0\n[run]\nuntil = 2.0\n",
            contact("bottom"),
            contact("right")
        )
    };
    let cases = [
        ([-0.02, 0.02], "amplitude = [0.0, -0.02]\nphase = 0.3\n"),
        ([0.02, 0.0], "amplitude = [0.02, -0.02]\n"),
        ([0.0, 0.0], "amplitude = [0.02, -0.02]\nphase = -1.5707963267948966\n"),
    ];
    for (preloads, load) in cases {
        let free = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [4, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmass = 'lumped'\n";
        let scene = scene(&(free.to_owned() + &tables(preloads, load)));
        let [exact, stepped] = [Integrator::Modal, Integrator::Dop853].map(|i| run_by(&scene, i));
        assert!(exact.switches.len() > 3, "{}", exact.switches.len());
        assert_eq!(exact.switches.len(), stepped.switches.len());
        let state = |r: &Report| [&r.last.u[..], &r.last.v[..]].concat();
        assert!(relative(&state(&exact), &state(&stepped)) < 1e-9, "{load}");
    }
}

/// `M ü + C u̇ + K_α u + Σ e r_t = f_α` row by row, with the tractions that files hold: what sticks has no acceleration, what slips is pushed by `σ μ p`.
#[test]
fn accelerations_and_tractions_balance() {
    let tables = "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.3\nsurface = [0.0, 0.2]\n[damping]\nrayleigh = [0.1, 0.03]\n\
                  [[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.05]\n\
                  [[load]]\nkind = 'traction'\nedge = 'right'\namplitude = [0.1, 0.05]\nomega = 2.1\nphase = 0.3\n";
    let system = problem(&plate(SIZE, tables)).system;
    let tangents = system.tangents().unwrap().to_vec();
    let (n, t) = (system.n_o(), 0.7);
    let wave = |k: f64| (0..n).map(|i| 0.1 * ((i as f64) * k + k).sin()).collect::<Vec<f64>>();
    let (u, mut v) = (wave(0.9), wave(1.7));
    let states = [
        PointState::Stick,
        PointState::SlipPlus,
        PointState::Open,
        PointState::SlipMinus,
        PointState::Stick,
    ];
    let set: States = states.into_iter().collect();
    for (tangent, state) in tangents.iter().zip(states) {
        let tangent = tangent.as_ref().unwrap();
        if state == PointState::Stick {
            tangent.settle(&mut v);
        }
    }
    let phase = system.phase(&set);
    let mut a = vec![0.0; n];
    phase.acceleration(t, &u, &v, &mut system.scratch(), &mut a);
    let (mut q, mut p) = (vec![0.0; 5], vec![0.0; 5]);
    phase.tractions(t, (&u, &v), &mut q);
    phase.pressures(t, &u, &mut p);
    // everything but friction, with u_C put in
    let (stiffness, mass) = phase.matrices();
    let mut full = vec![0.0; system.n()];
    phase.expand_displacement(t, &vec![0.0; n], &mut full);
    let mut force = vec![0.0; system.n()];
    system.loads.at(t, &mut force);
    let mut held = vec![0.0; system.n()];
    system.body.stiffness.mul(&full, &mut held);
    force.iter_mut().zip(&held).for_each(|(f, k)| *f -= k);
    let force = phase.reduce(&force);
    let times = |m: &signorini::fem::Csr, x: &[f64]| {
        let mut y = vec![0.0; n];
        m.mul(x, &mut y);
        y
    };
    let (ma, mv, ku, kv) =
        (times(&mass, &a), times(&mass, &v), times(&stiffness, &u), times(&stiffness, &v));
    let scale = ku.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for i in 0..n {
        let rest = force[i] - ma[i] - 0.1 * mv[i] - 0.03 * kv[i] - ku[i];
        let of_friction: f64 = tangents
            .iter()
            .enumerate()
            .filter_map(|(k, t)| Some((k, t.as_ref()?)))
            .filter(|(_, t)| t.row[0].0 == i)
            .map(|(k, t)| -t.row[0].1 * q[k] * system.constraints[k].area)
            .sum();
        assert!((rest - of_friction).abs() < 1e-11 * scale, "row {i}: {rest} {of_friction}");
    }
    for (k, state) in states.into_iter().enumerate() {
        let tangent = tangents[k].as_ref().unwrap();
        match state.slip() {
            Some(sigma) => assert!((q[k] + sigma * 0.3 * p[k]).abs() < 1e-12 * scale),
            None if state == PointState::Stick => {
                assert!(tangent.along(&a).abs() < 1e-12 * scale && q[k] != 0.0)
            }
            None => assert_eq!(q[k], 0.0),
        }
    }
    // rates of all monitors are those of their values along the motion
    let h = 1e-6;
    let along = |s: f64| {
        let at = |x: &[f64], dx: &[f64], ddx: &[f64]| -> Vec<f64> {
            let all = x.iter().zip(dx).zip(ddx);
            all.map(|((x, dx), ddx)| x + s * dx + 0.5 * s * s * ddx).collect()
        };
        phase.monitor_values(t + s, &at(&u, &v, &a), &at(&v, &a, &vec![0.0; n]))
    };
    let rates = phase.monitor_rates(t, &v, &a);
    for (k, (up, down)) in along(h).iter().zip(along(-h)).enumerate() {
        let slope = (up - down) / (2.0 * h);
        assert!((slope - rates[k]).abs() < 1e-6 * (1.0 + rates[k].abs()), "{slope} {}", rates[k]);
    }
}

const THROWN: &str = "[initial]\nvelocity = ['0.2', '0.1']\n[run]\nuntil = 3.0\n";

/// Without a coefficient, or with a zero, it is the frictionless program to the last bit.
#[test]
fn no_friction_is_the_frictionless_program() {
    let of = |more: &str| {
        let method = "method = 'mass-redistribution'";
        let wall = format!("{CLAMPED}[contact]\nedge = 'right'\ngap = 0.02\n{method}\n{more}\n");
        let text =
            plate(SIZE, &(wall + "[initial]\nvelocity = ['0.2*x', '0.1*x']\n[run]\nuntil = 3.0\n"));
        run_by(&scene(&text), Integrator::Modal)
    };
    let (plain, zero) = (of(""), of("friction = 0.0"));
    assert!(plain.rubbed.is_none() && zero.rubbed.is_none());
    assert_eq!(plain.switches, zero.switches);
    let bits = |s: &State| s.u.iter().chain(&s.v).map(|x| x.to_bits()).collect::<Vec<u64>>();
    assert_eq!(bits(&plain.last), bits(&zero.last));
}

/// Turned by a right angle, mirrored, in other units, cut in two: the same motion.
#[test]
fn the_motion_knows_no_axes_and_no_units() {
    let of = |size: &str, edge: &str, gap: f64, velocity: &str, until: f64| {
        let wall = format!("[contact]\nedge = '{edge}'\ngap = {gap}\nfriction = 0.3\n");
        let end = format!("[initial]\nvelocity = {velocity}\n[run]\nuntil = {until}\n");
        run_by(&scene(&plate(size, &(wall + &end))), Integrator::Modal)
    };
    let base = of(SIZE, "right", 0.02, "['0.2', '0.1']", 3.0);
    let turned = "size = [1.0, 0.5]\nelements = [4, 2]";
    let [on_top, on_floor] = [("top", "['-0.1', '0.2']"), ("bottom", "['0.1', '-0.2']")]
        .map(|(edge, v)| of(turned, edge, 0.02, v, 3.0));
    let left = of(SIZE, "left", 0.02, "['-0.2', '0.1']", 3.0);
    let mirrored = of(SIZE, "right", 0.02, "['0.2', '-0.1']", 3.0);
    let larger = of("size = [5.0, 10.0]\nelements = [2, 4]", "right", 0.2, "['0.2', '0.1']", 30.0);
    for (name, other, unit) in [
        ("top", &on_top, 1.0),
        ("bottom", &on_floor, 1.0),
        ("left", &left, 1.0),
        ("mirrored", &mirrored, 1.0),
        ("ten times as large", &larger, 100.0),
    ] {
        assert_eq!(base.switches.len(), other.switches.len(), "{name}");
        for (a, b) in
            [(base.energy_end, other.energy_end), (friction_work(&base), friction_work(other))]
        {
            assert!((a * unit - b).abs() < 1e-11 * b, "{name}: {a} {b}");
        }
    }
    // at the left wall forwards is down: the tangent is the normal turned by +90°
    let first = |r: &Report| r.switches[0].to();
    assert_eq!((first(&base), first(&left)), (PointState::SlipPlus, PointState::SlipMinus));
    assert_eq!(first(&mirrored), PointState::SlipMinus);
}

/// A run that was interrupted ends as one that was not, to the last bit; its file has tractions, books and the totals by point.
#[test]
fn a_run_that_was_interrupted_ends_in_the_same_file() {
    let folder = tempfile::TempDir::new().unwrap();
    let text =
        plate(SIZE, &format!("[contact]\nedge = 'right'\ngap = 0.02\nfriction = 0.3\n{THROWN}"));
    std::fs::write(folder.path().join("a.toml"), text).unwrap();
    let call = |output: &str, more: &[&str], look: Option<&str>| {
        let mut command = program();
        command.current_dir(folder.path()).args(["run", "a.toml", "-q", "-o", output]).args(more);
        if let Some(look) = look {
            command.env("SIGNORINI_AT_LOOK", look);
        }
        command.status().unwrap().code()
    };
    assert_eq!(call("whole.h5", &[], None), Some(0));
    assert_eq!(call("parts.h5", &[], Some("INT 12")), Some(130));
    assert_eq!(call("parts.h5", &["--resume"], None), Some(0));
    let [whole, parts] = ["whole.h5", "parts.h5"].map(|name| datasets(&folder.path().join(name)));
    assert_eq!(whole.keys().collect::<Vec<_>>(), parts.keys().collect::<Vec<_>>());
    for (name, value) in &whole {
        assert!(parts[name] == *value, "{name}");
    }
    for name in [
        "/trajectory/traction",
        "/energy/friction",
        "/energy/belt",
        "/friction/work",
        "/friction/path",
    ] {
        assert!(whole.contains_key(name), "{name}");
    }
    // who draws a file asks whether a point touches, not for one code
    let stored = signorini::store::Stored::read(&folder.path().join("whole.h5")).unwrap();
    let (rows, n_c) = stored.active.dim();
    let all = (0..rows).flat_map(|r| (0..n_c).map(move |i| (r, i)));
    let slips = all.filter(|&(r, i)| stored.active[(r, i)] > 1 && stored.touches(r, i)).count();
    assert!(slips > rows / 4, "{slips} of {rows}");
}

/// What is refused, and the words that say so.
#[test]
fn what_friction_does_not_go_with_is_said() {
    let wall = |more: &str| format!("[contact]\nedge = 'right'\ngap = 0.02\n{more}\n");
    let base = |contact: &str| plate(SIZE, &format!("{CLAMPED}{contact}[run]\nuntil = 1.0\n"));
    let with = |contact: &str, more: &str| {
        plate(SIZE, &format!("{CLAMPED}{contact}{more}[run]\nuntil = 1.0\n"))
    };
    let massless = |contact: &str, more: &str| {
        with(&wall(&format!("friction = 0.3\ntangent = 'massless'\n{contact}")), more)
    };
    let bar = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = 1.0\nfriction = 0.1\n[run]\nuntil = 1.0\n";
    for (text, words) in [
        (base(&wall("friction = -0.1")), "is -0.1"),
        (base(&wall("friction = [0.3, 0.2]")), "no Filippov system"),
        (base(&wall("friction = { static = 0.3, kinetic = 0.2 }")), "no Filippov system"),
        (base(&wall("friction = 'rough'")), "contact.friction: invalid type"),
        (base(&wall("friction = 0.3\nmethod = 'penalty'")), "is not read by method = \"penalty\""),
        (base(&wall("friction = 0.3\nstress = 'projection'")), "friction acts on nodal reactions"),
        (base(&wall("friction = 0.3\ninertia = 'paper'")), "friction acts on nodal reactions"),
        (massless("", "[[slider]]\nat = [0.0, 0.5]\nlimit = 0.1\n"), "does not go with sliders"),
        (base(&wall("friction = 0.3\nstress = 'nodal-mean'")), "friction acts on nodal reactions"),
        (massless("", "[reduction]\nmodes = 3\n"), "does not go with a [reduction]"),
        (massless("gap_behind = 0.1\n", ""), "does not go with obstacles behind"),
        (massless("", "[initial]\nequilibrium = true\n"), "a start at an equilibrium"),
        (
            massless("", "").replace("friction = 0.3", "friction = 2.5"),
            "beyond: several would go on",
        ),
        (base(&wall("surface = [0.0, 0.1]")), "is not read without friction"),
        (base(&wall("tangents = [1]\nfriction = 0.1")), "belongs to body.kind = \"matrices\""),
        (base(&wall("friction = 0.3\nsurface = [0.1, 0.1]")), "along its normal"),
        (base(&wall("friction = 0.3\nsurface = [0.1]")), "surface"),
        (bar.to_owned(), "a bar has no displacement along the obstacle"),
        (
            with(&wall("friction = 0.3\nmotion = { amplitude = 0.1, omega = 1.0 }"), ""),
            "seen from what moves",
        ),
    ] {
        let parsed = Scene::parse(&text, std::path::Path::new("test.toml"));
        let error = match parsed {
            Ok(scene) => Problem::new(&scene, None).map(|_| ()).unwrap_err().to_string(),
            Err(e) => e.to_string(),
        };
        assert!(error.contains(words), "{words}: {error}");
    }
    let on_contact =
        "[[load]]\nkind = 'traction'\nedge = 'right'\namplitude = [0.1, 0.0]\nomega = 1.0\n";
    let found = problem(&massless("", on_contact));
    assert!(found.notes.warnings.iter().any(|w| w.contains("in the open body")));
    // a tangent that a support holds has none, and that is said
    let held = "[[support]]\nedge = 'bottom'\nfix = ['y']\n";
    let found = problem(&with(&wall("friction = 0.3"), held));
    assert_eq!(found.system.tangents().unwrap().iter().flatten().count(), 4);
    assert!(found.notes.warnings.iter().any(|w| w.contains("1 of 5 contact points")));
}

/// The derivative of the motion through stick, slip, lift-off and landing against differences of it, in random directions: what sticks at the beginning may be pushed too,
/// its impulse is taken up at once.
#[test]
fn tangents_pass_stick_and_slip() {
    let block = "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.5\n";
    let loads = "[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.0]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 0.08]\nomega = 1.0\n[initial]\nequilibrium = true\n";
    let belt = "[contact]\nedge = 'right'\ngap = -0.02\nfriction = 0.4\nsurface = [0.0, 0.05]\n";
    let thrown = "[contact]\nedge = 'right'\ngap = 0.02\nfriction = 0.3\n[initial]\nvelocity = ['0.2', '0.1']\n";
    let damped = |a: f64, b: f64| format!("[damping]\nrayleigh = [{a}, {b}]\n");
    let cases = [
        ("block", block.to_owned() + loads + &damped(0.3, 0.0), 6.1),
        ("block, viscous", block.to_owned() + loads + &damped(0.1, 0.02), 6.1),
        // viscous forces of a point that opens at 9.123 push another one loose
        (
            "block, taken along",
            block.to_owned() + &loads.replace("0.08", "0.12") + &damped(0.1, 0.1),
            9.5,
        ),
        (
            "belt",
            CLAMPED.to_owned()
                + belt
                + &damped(0.0, 0.02)
                + "[initial]\nvelocity = ['0.02*x', '0.03*x']\n",
            4.0,
        ),
        ("thrown", thrown.to_owned(), 2.6),
        ("thrown, damped", thrown.to_owned() + &damped(0.2, 0.0), 2.6),
    ];
    let without_mass = |(name, tables, until): &(&'static str, String, f64)| {
        let massless = tables.replace("friction =", "tangent = 'massless'\nfriction =");
        // points that begin to stick at one instant are a corner, too
        let apart = massless.replace("gap = 0.02", "gap = '0.02 + 0.013*y'");
        let started = apart.replace("[initial]\nequilibrium = true\n", "");
        (*name, started, *until)
    };
    let others: Vec<(&str, String, f64)> = cases.iter().map(without_mass).collect();
    for (name, tables, until) in cases.into_iter().chain(others) {
        let problem = problem(&plate(SIZE, &(tables + "[run]\nuntil = 1.0\n")));
        let creeps = problem.system.creeps();
        let mut body = Propagator::new(problem.system).unwrap();
        // what slips without mass might stick to one side of where it is: such a state is a corner of the map
        let slips = |x: &State| {
            let sets = integrate(&body, x, 1e-3).unwrap().chain.sets;
            creeps && sets[0].iter().any(|s| s.slip().is_some())
        };
        // so is a state at rest before a load that comes at once
        let after = |t: f64| match creeps {
            true => integrate(&body, &problem.initial, t).unwrap().report.last,
            false => problem.initial.clone(),
        };
        let mut starts = (0..40).map(|k| after(0.07 + 0.1 * f64::from(k)));
        let start = starts.find(|x| !slips(x)).unwrap_or_else(|| panic!("{name}: slips always"));
        let z = body.frame(&start);
        let passage = integrate(&body, &start, until).unwrap();
        let stuck_first = passage.chain.sets[0].iter().any(|s| s == PointState::Stick);
        let worst = derivative_error(&mut body, Closure::FORCED, &z, until, 1e-8);
        println!(
            "{name}: {worst:.1e}, {} switches, stick at first: {stuck_first}",
            passage.times.len()
        );
        assert!(worst < 1e-6, "{name}: {worst:.1e}");
    }
}

/// A block that friction alone holds, shaken on a slope, walks down: its orbit comes back but for that, and the way is that of a long run by Runge–Kutta.
#[test]
fn a_shaken_block_walks_down_a_slope() {
    let tables = "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.5\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.02]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 0.08]\nomega = 1.0\n[initial]\nequilibrium = true\n[damping]\nrayleigh = [0.3, 0.0]\n";
    let place = tempfile::tempdir().unwrap();
    let (file, out) = (place.path().join("slope.toml"), place.path().join("o.h5"));
    let text = plate(SIZE, &(tables.to_owned() + "[orbit]\nomega = 1.0\n"));
    std::fs::write(&file, text + "[run]\nuntil = 1.0\n").unwrap();
    let orbit = json(&["orbit", file.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    let drift = orbit["drift"].as_f64().unwrap();
    assert!(orbit["residual"].as_f64().unwrap() < 1e-11 && drift > 0.1, "{drift}");
    // friction leaves the position to the body, and nothing else
    assert_eq!(
        (orbit["family_dimension"].as_u64(), orbit["stable"].as_bool()),
        (Some(1), Some(true))
    );
    let periods = |k: f64| {
        let until = k * std::f64::consts::TAU;
        let text = plate(SIZE, &(tables.to_owned() + &format!("[run]\nuntil = {until}\n")));
        run_by(&scene(&text), Integrator::Dop853).last.u
    };
    let ways: Vec<f64> = periods(41.0).iter().zip(periods(40.0)).map(|(a, b)| a - b).collect();
    let farthest = ways.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    println!("{drift} {farthest}");
    assert!(relative(&[farthest], &[drift]) < 1e-6, "{farthest} {drift}");
}

/// A block that friction alone holds, damped by ratios of its modes: on the way to its orbit are phases whose eigenvectors are dependent, which Newton's method goes around. From its
/// state Runge–Kutta takes the same in a period.
#[test]
fn phases_without_modes_do_not_end_a_search() {
    let tables = "[contact]\nedge = 'bottom'\ngap = 0.0\nfriction = 0.3\n[damping]\nmodal = 0.02\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.0, -0.1]\n\
                  [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.05, 0.0]\nomega = 1.3\n[initial]\nequilibrium = true\n";
    let body = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [1, 1]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n";
    let place = tempfile::tempdir().unwrap();
    let [file, out] = ["block.toml", "o.h5"].map(|n| place.path().join(n).display().to_string());
    let text = format!("{body}{tables}");
    std::fs::write(&file, text.clone() + "[run]\nperiods = 1\n").unwrap();
    let orbit = json(&["orbit", &file, "-o", &out]);
    assert!(orbit["residual"].as_f64().unwrap() < 1e-12);
    let until = std::f64::consts::TAU / 1.3;
    let from =
        format!("[initial]\nfile = '{out}'\n[run]\nuntil = {until:?}\nintegrator = 'dop853'\n");
    std::fs::write(&file, text.replace("[initial]\nequilibrium = true\n", "") + &from).unwrap();
    let run = json(&["run", &file, "-o", &out.replace("o.h5", "r.h5")]);
    let wanted = run["friction_work"].as_f64().unwrap();
    let found = orbit["friction_work"].as_f64().unwrap();
    println!("{found} {wanted}");
    assert!(relative(&[found], &[wanted]) < 1e-5, "{found} {wanted}");
}

/// Tables have what friction took and did: their columns add up to one energy; what is said of a file counts every kind of switch.
#[test]
fn tables_and_what_is_said_of_files_know_friction() {
    let tables = "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.3\nsurface = [0.0, 0.1]\n[[slider]]\nedge = 'left'\ndirection = [1.0, 0.0]\nlimit = 0.03\nstiffness = 0.5\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.02]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.05, 0.15]\nomega = 1.0\n[damping]\nrayleigh = [0.1, 0.0]\n[run]\nuntil = 12.0\nsamples = 50\n";
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name).display().to_string();
    std::fs::write(path("s.toml"), plate(SIZE, tables)).unwrap();
    let run = json(&["run", &path("s.toml"), "-o", &path("s.h5")]);
    json(&["export", &path("s.h5"), "--format", "csv", "-o", &path("s")]);
    let text = std::fs::read_to_string(path("s.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let column = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let terms = [
        ("kinetic", 1.0),
        ("elastic", 1.0),
        ("jumps", -1.0),
        ("external", -1.0),
        ("dissipated", 1.0),
        ("friction", 1.0),
        ("belt", -1.0),
    ];
    let terms = terms.map(|(name, sign)| (column(name), sign));
    let sums: Vec<f64> = lines
        .map(|row| terms.iter().map(|(k, sign)| sign * row[*k].parse::<f64>().unwrap()).sum())
        .collect();
    let (low, high) =
        sums.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(*s), b.max(*s)));
    assert!(run["friction_work"].as_f64().unwrap() > 1e-3 && high - low < 1e-11, "{low} {high}");
    assert!(
        head.iter().any(|h| h.starts_with("traction["))
            && head.iter().any(|h| h.starts_with("slide[slider0"))
    );
    let said = crate::common::run(&["inspect", &path("s.h5")]);
    let said = String::from_utf8(said.stdout).unwrap();
    let stored = Stored::read(path("s.h5").as_ref()).unwrap();
    let count = |kind: &str| stored.switch_kind.iter().filter(|k| *k == kind).count();
    let wanted = format!(
        "({} close, {} open, {} sticking, {} slipping)",
        count("close"),
        count("open"),
        count("sticking"),
        count("slipping")
    );
    assert!(count("slipping") > 2 && said.contains(&wanted), "{wanted}: {said}");
    assert!(said.contains(", 1 slider\n"), "{said}");
}

/// A body that slides steadily and squeals: its complex modes are those of the phase, growth and all, and a surface that rests has none.
#[test]
fn modes_of_steady_sliding_grow() {
    let belt = json(&["modes", "scenarios/squeal-belt.toml", "--sliding"]);
    assert_eq!((belt["unstable"].as_u64(), belt["active"].as_str()), (Some(1), Some("-")));
    let first = &belt["sliding"][0];
    let (growth, omega) = (first["growth"].as_f64().unwrap(), first["omega"].as_f64().unwrap());
    // λ² + αλ + κ = 0 with α = 0.1 and the κ of the undamped flutter: λ₀² = −κ, λ₀ = 0.2548 + …i
    let (k11, k12, k22, k3) = (23.25, 0.25 * 3f64.sqrt() * 9.0, 18.75, 11.0);
    let half: f64 = 0.5 * (k11 + k22);
    let square: f64 = 0.25f64 * (k11 - k22) * (k11 - k22) + k12 * (k12 - 0.6 * k3);
    // κ = half ± i sqrt(−square); λ + 0.05 = sqrt(0.0025 − κ)
    let (re, im) = (0.0025 - half, (-square).sqrt());
    let size = re.hypot(im);
    let (a, b) = ((0.5 * (size + re)).sqrt(), (0.5 * (size - re)).sqrt());
    assert!((growth - (a - 0.05)).abs() < 1e-11 && (omega - b).abs() < 1e-10, "{growth} {omega}");
    let out = run(&["modes", "scenarios/rough-wall.toml", "--sliding"]);
    assert_eq!(out.status.code(), Some(2));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains("contact.surface"), "{said}");
}

/// Square plates on a belt, all nodes slipping: without viscosity the number of unstable modes grows with the mesh, with it there are two (numbers of an independent program, both
/// variants). A gap that narrows along the edge presses all nodes; which modes there are depends on the states alone.
#[test]
fn modes_of_sliding_need_viscosity() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("square.toml").display().to_string();
    let unstable = |n: usize, tangent: &str, beta: f64| {
        let size = format!("size = [0.7, 0.7]\nelements = [{n}, {n}]");
        let damping = match beta {
            0.0 => String::new(),
            _ => format!("[damping]\nrayleigh = [0.0, {beta}]\n"),
        };
        let wall = "[contact]\nedge = 'right'\ngap = '-0.02 - 0.6*y^2'\nfriction = 0.6\nsurface = [0.0, 0.05]\n";
        let tables = format!("{CLAMPED}{wall}tangent = '{tangent}'\n{damping}[run]\nuntil = 1.0\n");
        std::fs::write(&file, plate(&size, &tables)).unwrap();
        let said = json(&["modes", &file, "--sliding"]);
        assert_eq!(said["active"].as_str(), Some(&*"-".repeat(n + 1)));
        said["unstable"].as_u64().unwrap()
    };
    for (tangent, wanted) in [("massless", [3, 9, 24]), ("inertia", [6, 17, 37])] {
        assert_eq!([4, 8, 12].map(|n| unstable(n, tangent, 0.0)), wanted, "{tangent}");
        assert_eq!([4, 8, 12].map(|n| unstable(n, tangent, 0.01)), [2, 2, 2], "{tangent}");
    }
}

/// A block that is shaken so little that nothing slips: friction takes nothing, every point is free in where it sticks, and that is said.
#[test]
fn a_block_shakes_down() {
    let tables = "[contact]\nedge = 'bottom'\ngap = 0.0\nfriction = 0.5\ntangent = 'massless'\n[damping]\nrayleigh = [0.3, 0.02]\n\
                  [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.0, -0.2]\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.02, 0.0]\nomega = 1.0\n\
                  [orbit]\nomega = 1.0\n[run]\nuntil = 1.0\n";
    let place = tempfile::tempdir().unwrap();
    let [file, out] = ["block.toml", "o.h5"].map(|n| place.path().join(n).display().to_string());
    std::fs::write(&file, plate("size = [1.0, 0.5]\nelements = [4, 2]", tables)).unwrap();
    let orbit = json(&["orbit", &file, "-o", &out]);
    assert_eq!(
        (orbit["friction_work"].as_f64(), orbit["shakedown"].as_str()),
        (Some(0.0), Some("within"))
    );
    assert_eq!(orbit["family_dimension"].as_u64(), Some(5));
    let size = |m: &serde_json::Value| m[0].as_f64().unwrap().hypot(m[1].as_f64().unwrap());
    let sizes: Vec<f64> = orbit["multipliers"].as_array().unwrap().iter().map(size).collect();
    assert_eq!(sizes.iter().filter(|m| (**m - 1.0).abs() < 1e-10).count(), 5, "{sizes:?}");
    // shaken ten times as much it slips
    let more = plate("size = [1.0, 0.5]\nelements = [4, 2]", &tables.replace("[0.02,", "[0.1,"));
    std::fs::write(&file, more).unwrap();
    let orbit = json(&["orbit", &file, "-o", &out, "--force"]);
    assert!(orbit["friction_work"].as_f64().unwrap() > 1e-6 && orbit["shakedown"].is_null());
}

/// With all modes a reduced body is the whole one, of either kind; with some it is near: displacements along the obstacle are coordinates of it.
#[test]
fn a_reduced_body_sticks_and_slips_as_the_whole_one() {
    let tables = "[contact]\nedge = 'right'\ngap = -0.02\nfriction = 0.4\nsurface = [0.0, 0.05]\n[damping]\nrayleigh = [0.05, 0.02]\n[initial]\nvelocity = ['0.02*x', '0.03*x']\n[run]\nuntil = 5.0\n";
    let on = |size: &str, more: &str| {
        let text = plate(size, &format!("{CLAMPED}{tables}{more}"));
        run_by(&scene(&text), Integrator::Modal)
    };
    // the contact conditions touch all of two columns of elements: there is nothing to leave out
    let (all, none) = (on(SIZE, ""), on(SIZE, "[reduction]\nmodes = 3\n"));
    assert!(relative(&[none.energy_end], &[all.energy_end]) < 1e-9);
    let run = |more: &str| on("size = [0.5, 1.0]\nelements = [6, 4]", more);
    let whole = run("");
    let off = |r: &Report| {
        relative(&[friction_work(r), r.energy_end], &[friction_work(&whole), whole.energy_end])
    };
    for kind in ["fixed-interface", "free-interface"] {
        let reduced =
            |modes: usize| run(&format!("[reduction]\nkind = '{kind}'\nmodes = {modes}\n"));
        let all = reduced(60);
        println!("{kind}: all modes {:.1e}, {} switches", off(&all), all.switches.len());
        assert!(off(&all) < 1e-9, "{kind}: {:.1e}", off(&all));
        let states = |r: &Report| r.switches.iter().map(|s| (s.point, s.to())).collect::<Vec<_>>();
        assert_eq!(states(&all), states(&whole), "{kind}");
        let some = [2, 20].map(|modes| off(&reduced(modes)));
        println!("{kind}: 2 and 20 modes {some:?}");
        assert!(some[1] < 0.3 * some[0], "{kind}: {some:?}");
    }
}

/// The limit cycle of the belt: from the scene's start and from the near return of a run; its file, and its picture with velocities alone.
#[test]
fn a_limit_cycle_is_found_stored_and_drawn() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let (file, long) = (at("cycle.h5"), at("run.h5"));
    let scene = "scenarios/squeal-belt.toml";
    let cycle = json(&["orbit", scene, "-o", &file]);
    let number = |v: &serde_json::Value, key: &str| v[key].as_f64().unwrap();
    assert!((number(&cycle, "period") - 1.536_507_806_750).abs() < 1e-11, "{}", cycle["period"]);
    assert!((number(&cycle, "friction_work") - 0.011_543_792_220).abs() < 1e-11);
    assert_eq!(
        (cycle["family_dimension"].as_u64(), cycle["stable"].as_bool()),
        (Some(0), Some(true))
    );
    json(&["run", scene, "-o", &long]);
    let again =
        json(&["orbit", scene, "--near-return", &long, "--period", "1.5", "-o", &at("b.h5")]);
    assert!(relative(&[number(&again, "period")], &[number(&cycle, "period")]) < 1e-11);
    let all = datasets(std::path::Path::new(&file));
    assert!(all.keys().any(|k| k.ends_with("friction/work")), "{:?}", all.keys());
    assert!(run(&["plot", &file]).status.success());
    // accelerations at which a slip ends, of the order of one, are no velocities
    let drawn = std::fs::read_to_string(at("cycle-portrait.svg")).unwrap();
    let labels = drawn
        .split('>')
        .filter_map(|s| s.split('<').next()?.trim().replace('−', "-").parse::<f64>().ok());
    let largest = labels.fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(largest < 0.45, "{largest}");
    for (arguments, words) in [
        (&["orbit", scene, "--all"][..], "finds its own"),
        (&["orbit", "scenarios/rough-wall.toml", "--omega", "1"], "no orbit is left but rest"),
        (
            &["response", "scenarios/shaken-block.toml", "--range", "0.9,1.1", "--locate"],
            "frequency to frequency",
        ),
        (
            &["backbone", "scenarios/shaken-block.toml", "--viscous", "--range", "1,2"],
            "--amplitudes",
        ),
    ] {
        let out = run(arguments);
        let said =
            String::from_utf8_lossy(&out.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        let said = said.replace("│ ", "");
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// A measured load beside friction: a table of a cosine is the cosine, as far as its spline is, for walls, belts and sliders.
#[test]
fn a_measured_load_is_the_load_it_measures() {
    let place = tempfile::tempdir().unwrap();
    let (omega, count) = (1.3f64, 1600);
    // beyond the end, where a natural spline is none
    let row = |k: usize| {
        let t = 10.0 * k as f64 / count as f64 - 1.0;
        format!("{t:?},{:?}\n", (omega * t + 0.4).cos())
    };
    let table: String = (0..=count).map(row).collect();
    std::fs::write(place.path().join("load.csv"), table).unwrap();
    let wall =
        |more: &str| format!("[contact]\nedge = 'right'\ngap = -0.01\nfriction = 0.3\n{more}");
    let slider = "[[slider]]\nat = [0.0, 1.0]\ndirection = [0.0, 1.0]\nlimit = 0.01\n";
    let press = "[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.05, 0.0]\n";
    let balance = "equilibrium = true";
    // nothing holds the plate along a belt
    let (apart, belt) = ("displacement = ['-0.011', '0']", "surface = [0.0, 0.05]\n");
    for (contact, start) in [(wall(""), balance), (wall(belt), apart), (wall(slider), balance)] {
        let scene = |course: &str| {
            let tables = format!(
                "{contact}{press}[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.01, 0.03]\n{course}[damping]\nrayleigh = [0.1, 0.01]\n\
                 [initial]\n{start}\n[run]\nuntil = 7.0\n"
            );
            Scene::parse(&plate(SIZE, &tables), &place.path().join("scene.toml")).unwrap()
        };
        let closed =
            run_by(&scene(&format!("omega = {omega:?}\nphase = 0.4\n")), Integrator::Dop853);
        let measured = run_by(&scene("table = 'load.csv'\n"), Integrator::Dop853);
        println!("{} and {} switches", closed.switches.len(), measured.switches.len());
        assert_eq!(closed.switches.len(), measured.switches.len());
        assert!(
            closed.log.of_kind(SwitchKind::Sticking) + closed.log.of_kind(SwitchKind::Slipping)
                > 10
        );
        for (a, b) in closed.switches.iter().zip(&measured.switches) {
            assert!((a.t - b.t).abs() < 1e-6 && a.point == b.point, "{} {}", a.t, b.t);
        }
        let books = |r: &Report| [friction_work(r), r.energy_end, r.energy_external];
        assert!(relative(&books(&measured), &books(&closed)) < 1e-7);
        assert!(measured.energy_drift_total < 1e-9, "{}", measured.energy_drift_total);
    }
}

/// What loops of force over displacement enclose is what friction took: under sliders, whose force or whose displacement stays between any two stored states, to rounding.
#[test]
fn loops_enclose_what_friction_takes() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let scene = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [[slider]]\nedge = 'right'\nlimit = 0.1\n[[slider]]\nat = [0.5]\nlimit = 0.05\n\
         [initial]\ndisplacement = ['x']\n[run]\nuntil = 6.0\nsamples = 40\n";
    std::fs::write(at("bar.toml"), scene).unwrap();
    let file = at("bar.h5");
    json(&["run", &at("bar.toml"), "-o", &file]);
    let stored = Stored::read(std::path::Path::new(&file)).unwrap();
    let rubbed = stored.rubbed.as_ref().unwrap();
    let slide = rubbed.slide.as_ref().unwrap();
    for i in 0..2 {
        let step = |r: usize| {
            let force = 0.5 * (rubbed.traction[(r, i)] + rubbed.traction[(r + 1, i)]);
            -force * (slide[(r + 1, i)] - slide[(r, i)])
        };
        // between a switch and the state before it the force is that of the phase before
        let enclosed: f64 = (0..stored.t.len() - 1)
            .map(|r| match stored.active[(r, i)] == 2 {
                true => 0.0,
                false if stored.active[(r + 1, i)] == stored.active[(r, i)] => step(r),
                false => -rubbed.traction[(r, i)] * (slide[(r + 1, i)] - slide[(r, i)]),
            })
            .sum();
        assert!(rubbed.work[i] > 0.02 && relative(&[enclosed], &[rubbed.work[i]]) < 1e-10);
        let way: f64 = (1..stored.t.len()).map(|r| (slide[(r, i)] - slide[(r - 1, i)]).abs()).sum();
        assert!(way <= rubbed.path[i] * (1.0 + 1e-10) && way > 0.9 * rubbed.path[i]);
    }
    assert!(run(&["plot", &file]).status.success());
    let drawn = |name: &str| std::fs::read_to_string(at(&format!("bar-{name}.svg"))).unwrap();
    for (name, words) in [
        ("states", ["sticks", "slips backwards", "slider1"]),
        ("friction", ["force of friction", "slip path", "work taken by friction"]),
    ] {
        let svg = drawn(name);
        assert!(words.iter().all(|w| svg.contains(w)), "{name}");
    }
    // without friction there is nothing to draw
    let free = at("free.h5");
    json(&["run", "scenarios/oscillator.toml", "-o", &free]);
    let out = run(&["plot", &free, "--only", "states"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success() && said.contains("runs with friction"), "{said}");
}

/// A response goes from frequency to frequency, with what friction takes at each, and goes on where it was left.
#[test]
fn a_response_with_friction_goes_from_frequency_to_frequency() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let tables = "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.5\n[damping]\nrayleigh = [0.3, 0.02]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.0]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 0.08]\nomega = 1.0\n[initial]\nequilibrium = true\n[run]\nperiods = 1\n";
    let scene = at("block.toml");
    std::fs::write(&scene, plate(SIZE, tables)).unwrap();
    let (file, part) = (at("response.h5"), at("part.h5"));
    let whole = json(&["response", &scene, "--range", "0.9,1.1", "--step", "0.5", "-o", &file]);
    let points = whole["points"].as_array().unwrap();
    assert!(
        points.len() >= 9 && points.iter().all(|p| p["converged"] == true && p["stable"] == true)
    );
    let work = |path: &str| {
        let bytes = datasets(std::path::Path::new(path));
        let (_, (_, bytes)) =
            bytes.iter().find(|(k, _)| k.ends_with("backbone/friction_work")).unwrap();
        bytes
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect::<Vec<f64>>()
    };
    assert!(work(&file).iter().all(|w| *w > 0.0));
    json(&["response", &scene, "--range", "0.9,1.0", "--step", "0.5", "-o", &part]);
    json(&["response", &scene, "--range", "0.9,1.1", "--step", "0.5", "-o", &part, "--resume"]);
    assert_eq!(work(&part), work(&file));
    // the same orbits as those which are shot from the balance
    let orbit = json(&["orbit", &scene, "--omega", "1.1", "-o", &at("orbit.h5")]);
    let last = *work(&file).last().unwrap();
    assert!(relative(&[orbit["friction_work"].as_f64().unwrap()], &[last]) < 1e-8, "{last}");
}

/// A random plate before a rough wall on its right, or on the floor of a belt: as it is, or turned, mirrored and told in other units.
struct Rough {
    size: [f64; 2],
    elements: [usize; 2],
    poisson: f64,
    wall: (f64, f64, f64),
    damping: [f64; 2],
    clamped: bool,
    /// On the left edge: a constant traction, and a harmonic one with frequency and phase.
    press: [f64; 2],
    shake: ([f64; 2], f64, f64),
    /// Of the centre, and its gradient.
    velocity: ([f64; 2], [[f64; 2]; 2]),
    until: f64,
    /// Displacements along the wall have no mass.
    massless: bool,
}

/// A frame in which a scene is told: axes (a rotation by right angles, or a reflection) and units of length, time and mass.
struct Told {
    axes: [[f64; 2]; 2],
    units: [f64; 3],
}

impl Told {
    fn vector(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.axes.map(|[a, b]| a * x + b * y)
    }

    /// The edge whose outward normal this is.
    fn edge(&self, normal: [f64; 2]) -> &'static str {
        match self.vector(normal) {
            [x, _] if x > 0.5 => "right",
            [x, _] if x < -0.5 => "left",
            [_, y] if y > 0.5 => "top",
            _ => "bottom",
        }
    }
}

const AS_IT_IS: Told = Told { axes: [[1.0, 0.0], [0.0, 1.0]], units: [1.0; 3] };

impl Rough {
    fn new(seed: u64) -> Rough {
        let source = Splitmix::new(seed);
        let unit = |_: usize| source.bits() as f64 / u64::MAX as f64;
        let between = |a: f64, b: f64| a + (b - a) * unit(0);
        let clamped = source.below(3) > 0;
        let vector = |size: f64| [between(-size, size), between(-size, size)];
        let belt = if source.below(2) == 0 { between(-0.2, 0.2) } else { 0.0 };
        Rough {
            size: [between(0.4, 1.0), between(0.5, 1.2)],
            elements: [2 + source.below(2), 3 + source.below(3)],
            poisson: between(-0.2, 0.45),
            wall: (
                if clamped { between(-0.02, 0.02) } else { between(0.0, 0.02) },
                between(0.1, 1.5),
                belt,
            ),
            damping: [
                between(0.0, 0.2),
                if source.below(2) == 0 { between(0.0, 0.02) } else { 0.0 },
            ],
            clamped,
            press: [between(0.0, 0.1), between(-0.03, 0.03)],
            shake: (vector(0.08), between(0.7, 2.5), between(-3.0, 3.0)),
            velocity: ([between(0.05, 0.2), between(-0.1, 0.1)], [vector(0.1), vector(0.1)]),
            until: between(3.0, 5.0),
            massless: false,
        }
    }

    /// The same without mass along the wall, with friction below what the mesh allows.
    fn without_mass(seed: u64) -> Rough {
        let mut rough = Rough::new(seed);
        rough.massless = true;
        rough.wall.1 *= 0.5;
        rough
    }

    fn text(&self, told: &Told, more: &str) -> String {
        let [l, t, m] = told.units;
        let scaled = |v: [f64; 2], unit: f64| told.vector(v).map(|x| x * unit);
        let along = |v: [f64; 2]| told.vector(v).map(f64::abs);
        let [sx, sy] = along(self.size).map(|x| x * l);
        let [nx, ny] = along(self.elements.map(|n| n as f64)).map(|n| n.round() as usize);
        let (gap, friction, belt) = self.wall;
        // R B Rᵀ
        let (centre, gradient) = self.velocity;
        let columns = [0, 1].map(|j| {
            let axis = [told.axes[j][0], told.axes[j][1]];
            told.vector(gradient.map(|row| row[0] * axis[0] + row[1] * axis[1]))
        });
        let centre = scaled(centre, l / t);
        let field = |i: usize| {
            format!(
                "'{} + {}*(x - {}) + {}*(y - {})'",
                centre[i],
                columns[0][i] / t,
                0.5 * sx,
                columns[1][i] / t,
                0.5 * sy
            )
        };
        let far = told.edge([-1.0, 0.0]);
        let held = if self.clamped {
            format!("[[support]]\nedge = '{far}'\nfix = ['x', 'y']\n")
        } else {
            String::new()
        };
        let pulled = if self.clamped { told.edge([0.0, 1.0]) } else { far };
        let (shake, omega, phase) = self.shake;
        let tangent = if self.massless { "tangent = 'massless'\n" } else { "" };
        format!(
            "[body]\nkind = 'plate'\nsize = [{sx}, {sy}]\nelements = [{nx}, {ny}]\nyoung = {}\npoisson = {}\ndensity = {}\n{held}\
             [contact]\nedge = '{}'\ngap = {}\nfriction = {friction}\nsurface = {:?}\n{tangent}[damping]\nrayleigh = [{}, {}]\n\
             [[load]]\nkind = 'traction'\nedge = '{pulled}'\namplitude = {:?}\n\
             [[load]]\nkind = 'traction'\nedge = '{pulled}'\namplitude = {:?}\nomega = {}\nphase = {phase}\n\
             [initial]\nvelocity = [{}, {}]\n[run]\nuntil = {}\n{more}",
            m / (t * t),
            self.poisson,
            m / (l * l),
            told.edge([1.0, 0.0]),
            gap * l,
            scaled([0.0, belt], l / t),
            self.damping[0] / t,
            self.damping[1] * t,
            scaled(self.press, m / (t * t)),
            scaled(shake, m / (t * t)),
            omega / t,
            field(0),
            field(1),
            self.until * t,
        )
    }
}

/// Random scenes turned, mirrored, in other units, reduced without leaving out anything, and cut in two: the same switches, the same books.
fn relations(scenes: u64, random: impl Fn(u64) -> Rough) {
    let (mut switches, mut worst) = (0, 0.0f64);
    for seed in 0..scenes {
        let rough = random(seed);
        let run =
            |told: &Told, more: &str| run_by(&scene(&rough.text(told, more)), Integrator::Modal);
        let base = run(&AS_IT_IS, "");
        let books =
            |r: &Report| [r.energy_end, friction_work(r), r.energy_external, r.energy_dissipated];
        let turned = Told { axes: [[0.0, -1.0], [1.0, 0.0]], ..AS_IT_IS };
        let mirrored = Told { axes: [[1.0, 0.0], [0.0, -1.0]], ..AS_IT_IS };
        let units = Told { axes: [[0.0, 1.0], [1.0, 0.0]], units: [0.013, 2.7e-4, 310.0] };
        let energy = |[l, t, m]: [f64; 3]| m * l * l / (t * t);
        let mut others = vec![
            ("turned", run(&turned, ""), 1.0),
            ("mirrored", run(&mirrored, ""), 1.0),
            ("in other units", run(&units, ""), energy(units.units)),
        ];
        if rough.clamped && !rough.massless {
            for kind in ["fixed-interface", "free-interface"] {
                let more = format!("[reduction]\nkind = '{kind}'\nmodes = 500\n");
                others.push((kind, run(&AS_IT_IS, &more), 1.0));
            }
        }
        switches += base.switches.len();
        let size = books(&base).iter().fold(0.0f64, |m, b| m.max(b.abs()));
        for (name, other, unit) in &others {
            assert_eq!(other.switches.len(), base.switches.len(), "{seed}: {name}");
            for (a, b) in books(&base).iter().zip(books(other)) {
                let off = (a - b / unit).abs() / size;
                assert!(off < 1e-8, "{seed}: {name}: {a} and {b}, {off:.1e}");
                worst = worst.max(off);
            }
        }
        // half the time, and the other half from there with the loads turned on
        let problem = problem(&rough.text(&AS_IT_IS, ""));
        let half = 0.5 * rough.until;
        let part = |system: &System, start: &State| {
            let options = Options { until: half, samples: 0, switch_limit: 40.0 };
            event::run(system, start, &options, &mut Modal::new(system), &mut Silent).unwrap()
        };
        let first = part(&problem.system, &problem.initial);
        let mut later = random(seed);
        later.shake.2 += later.shake.1 * half;
        let second = part(&crate::common::problem(&later.text(&AS_IT_IS, "")).system, &first.last);
        assert_eq!(
            first.switches.len() + second.switches.len(),
            base.switches.len(),
            "{seed}: cut in two"
        );
        let off =
            (friction_work(&first) + friction_work(&second) - friction_work(&base)).abs() / size;
        assert!(off < 1e-8, "{seed}: cut in two: {off:.1e}");
        worst = worst.max(off);
    }
    println!("{scenes} scenes, {switches} switches, relations to {worst:.1e}");
    assert!(switches > 10 * scenes as usize);
}

#[test]
fn random_scenes_keep_their_relations() {
    relations(40, Rough::new);
}

#[test]
fn random_scenes_without_mass_along_the_wall_keep_their_relations() {
    relations(30, Rough::without_mass);
}

#[test]
#[ignore = "a minute"]
fn many_random_scenes_keep_their_relations() {
    relations(300, Rough::new);
    relations(300, Rough::without_mass);
}

/// Without mass along the wall the exact flow and Dormand and Prince's steps tell the same motion: states, switches, all books.
#[test]
fn flows_agree_where_nothing_has_mass_along_the_wall() {
    let (mut switches, mut sticks) = (0, 0);
    for seed in 1000..1025 {
        let scene =
            scene(&Rough::without_mass(seed).text(&AS_IT_IS, "rtol = 1e-12\natol = 1e-14\n"));
        let [exact, stepped] = [Integrator::Modal, Integrator::Dop853].map(|i| run_by(&scene, i));
        assert!(exact.outcome.is_complete() && stepped.outcome.is_complete(), "{seed}");
        assert_eq!(exact.switches.len(), stepped.switches.len(), "{seed}");
        let state = |r: &Report| [&r.last.u[..], &r.last.v[..]].concat();
        let off = relative(&state(&exact), &state(&stepped));
        assert!(off < 1e-8, "{seed}: {off:e}");
        for report in [&exact, &stepped] {
            assert!(report.energy_drift_total < 1e-10, "{seed}: {:e}", report.energy_drift_total);
            assert!(report.rubbed.as_ref().unwrap().points.iter().all(|p| p.0 >= -1e-15));
        }
        switches += exact.switches.len();
        sticks += exact.log.of_kind(SwitchKind::Sticking);
    }
    assert!(switches > 300 && sticks > 60, "{switches} {sticks}");
}

/// A square grid without Poisson's ratio has equal frequencies in both directions, and friction pulls one by the other: no eigenvectors span such phases. They are followed without
/// them, to the same motion.
#[test]
fn phases_of_equal_frequencies_are_not_mistaken() {
    let text = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0\nmass = 'lumped'\n\
                [contact]\nedge = 'bottom'\ngap = 0.05\nfriction = 0.2\nmethod = 'mass-redistribution'\n[damping]\nrayleigh = [0.2, 0.02]\n\
                [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.01, -0.05]\n[run]\nuntil = 1.5\n";
    let scene = scene(text);
    let stepped = run_by(&scene, Integrator::Dop853);
    assert!(stepped.switches.len() > 3);
    for integrator in [Integrator::Modal, Integrator::Auto] {
        let exact = run_by(&scene, integrator);
        assert_eq!(exact.switches.len(), stepped.switches.len());
        let last = |r: &Report| r.switches.last().unwrap().t;
        assert!((last(&exact) - last(&stepped)).abs() < 1e-9, "{}", last(&exact));
        assert!(relative(&exact.last.u, &stepped.last.u) < 1e-9);
        assert!(exact.energy_drift_total < 1e-10, "{:e}", exact.energy_drift_total);
    }
}

/// Above a coefficient that the shape of the elements sets a state has several motions without mass along the wall, or none: numbers of an independent program, of four elements along the wall.
#[test]
fn the_bound_without_mass_is_that_of_the_mesh() {
    for (poisson, along, wanted) in
        [(0.0, 8.0, 2.8284), (0.3, 4.0, 2.0266), (0.45, 1.0, 0.8960), (0.3, 16.0, 3.2228)]
    {
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [2.0, {along}]\nelements = [2, 4]\nyoung = 1.0\npoisson = {poisson}\ndensity = 1.0\n{CLAMPED}\
             [contact]\nedge = 'right'\ngap = 1.0\ntangent = 'massless'\nfriction = 0.01\n[run]\nuntil = 1.0\n"
        );
        let system = problem(&text).system;
        let (found, _) = system.critical_friction().unwrap();
        assert!((found - wanted).abs() < 5e-5, "{poisson} {along}: {found} {wanted}");
    }
}
