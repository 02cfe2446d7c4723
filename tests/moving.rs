//! Supports and obstacles that move, and loads with a measured history.

use std::f64::consts::PI;

use signorini::contact::State;
use signorini::event::Silent;
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::Stored;

fn problem(text: &str) -> (Scene, Problem) {
    let scene = Scene::parse(text, std::path::Path::new("scene.toml")).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    (scene, problem)
}

/// The state at the end of a run, as nodal displacements and velocities of `u_O`.
fn end(text: &str) -> (State, usize) {
    let (scene, problem) = problem(text);
    let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    assert!(report.energy_drift_total < 1e-6, "{}", report.energy_drift_total);
    (report.last, report.switches.len())
}

fn distance(a: &State, b: &State) -> f64 {
    let (x, y) = (a.u.iter().chain(&a.v), b.u.iter().chain(&b.v));
    let off = x.zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    off / b.u.iter().chain(&b.v).map(|b| b * b).sum::<f64>().sqrt()
}

fn plate(contact: &str, rest: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [8, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n\
         [contact]\nedge = \"right\"\ngap = 0.4\n{contact}\n{rest}\n"
    )
}

/// A shaker table that carries support and obstacle is an inertial load in its own frame.
#[test]
fn a_table_that_carries_both_is_an_inertial_load() {
    let (amplitude, omega, phase) = (0.3, 1.4, 0.4);
    let run = |integrator: &str| {
        format!(
            "[damping]\nratio = 0.02\nmode = 1\n[run]\nuntil = 9.0\nintegrator = \"{integrator}\"\n"
        )
    };
    for method in [
        "",
        "method = \"mass-redistribution\"",
        "method = \"mass-redistribution\"\nmass = \"optimal\"",
        "inertia = \"constant\"",
    ] {
        for (integrator, reduction) in
            [("modal", ""), ("dop853", ""), ("modal", "[reduction]\nmodes = 12\n")]
        {
            if method.contains("optimal") && !reduction.is_empty() {
                continue;
            }
            let motion = format!("{{ amplitude = {amplitude}, omega = {omega}, phase = {phase} }}");
            let moving = plate(
                &format!("motion = {motion}\n{method}"),
                &format!(
                    "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [{amplitude}, 0.0]\nomega = {omega}\nphase = {phase}\n\
                     [initial]\ndisplacement = [\"{}\", \"0\"]\nvelocity = [\"{}\", \"0\"]\n{}{reduction}",
                    amplitude * f64::cos(phase),
                    -amplitude * omega * f64::sin(phase),
                    run(integrator)
                ),
            );
            let inertial = plate(
                method,
                &format!(
                    "[[load]]\nkind = \"gravity\"\namplitude = [{}, 0.0]\nomega = {omega}\nphase = {phase}\n{}{reduction}",
                    amplitude * omega * omega,
                    run(integrator)
                ),
            );
            let ((a, n), (b, m)) = (end(&moving), end(&inertial));
            assert!(n == m && n > 8, "{n} and {m} switches");
            assert!(distance(&a, &b) < 1e-10, "{method} {integrator}: {}", distance(&a, &b));
        }
    }
}

/// A bar whose support moves as `a cos ωt` and whose end is far from the obstacle: `u = a cos(ω(1 − x))/cos ω cos ωt`, the error falls with h².
#[test]
fn a_moving_support_drives_standing_waves() {
    let (a, omega) = (0.1, 1.0);
    let errors: Vec<f64> = [10, 20, 40]
        .map(|n| {
            let exact = |x: f64| a * (omega * (1.0 - x)).cos() / f64::cos(omega);
            // the standing wave is there from the start
            let text = format!(
                "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\narea = 1.0\n\
                 [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 9.0\nmethod = \"mass-redistribution\"\n\
                 [[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = {a}\nomega = {omega}\n\
                 [initial]\ndisplacement = [\"{a}*cos({omega}*(1-x))/cos({omega})\"]\n\
                 [run]\nuntil = 4.0\nintegrator = \"modal\"\n"
            );
            let state = end(&text).0;
            let at = |i: usize| exact((i + 1) as f64 / n as f64) * (4.0 * omega).cos();
            let off = state.u.iter().enumerate().map(|(i, u)| (u - at(i)).powi(2)).sum::<f64>();
            (off / n as f64).sqrt()
        })
        .to_vec();
    assert!(errors[2] < 2e-4, "{errors:?}");
    assert!(errors.windows(2).all(|e| e[1] < 0.3 * e[0]), "{errors:?}");
}

/// Two elements, `u_1` and `u_C = min(u_1, g + m(t))`, an obstacle that hammers: against small steps in the frame at rest.
#[test]
fn a_moving_obstacle_is_the_one_that_small_steps_see() {
    let (gap, amplitude, omega, phase) = (0.2, 0.35, 2.3, 1.0);
    let until = 8.0;
    let text = format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [2]\nyoung = 1.0\ndensity = 1.0\narea = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = {gap}\nmotion = {{ amplitude = {amplitude}, omega = {omega}, phase = {phase} }}\n\
         [initial]\nvelocity = [\"0.4*x\"]\n[run]\nuntil = {until}\nintegrator = \"modal\"\n"
    );
    let parsed = Scene::parse(&text, std::path::Path::new("scene.toml")).unwrap();
    // the support stands beside the contact's element for one element, and the rows between are one here
    let problem = Problem::new(&parsed, None).unwrap();
    let report = simulate(&parsed, &problem, false, &mut Silent).unwrap();
    assert!(report.switches.len() >= 4, "{}", report.switches.len());
    let h = 0.5;
    let m = |t: f64| amplitude * (omega * t + phase).cos();
    let (m_dot, m_ddot) = (
        |t: f64| -amplitude * omega * (omega * t + phase).sin(),
        |t: f64| -omega * omega * amplitude * (omega * t + phase).cos(),
    );
    // consistent mass h/6 [4 1; 1 2], stiffness 1/h [2 −1; −1 1]
    let acceleration = |t: f64, u: f64| match u < gap + m(t) {
        true => -(1.0 / h) * u / (h / 6.0 * (4.0 + 1.0 + 1.0 + 2.0)),
        false => (-(2.0 / h) * u + (gap + m(t)) / h - h / 6.0 * m_ddot(t)) / (h / 6.0 * 4.0),
    };
    let (steps, mut u, mut v) = (800_000, 0.0, 0.2);
    let dt = until / steps as f64;
    for k in 0..steps {
        let t = k as f64 * dt;
        let (a1, v1) = (acceleration(t, u), v);
        let (a2, v2) = (acceleration(t + 0.5 * dt, u + 0.5 * dt * v1), v + 0.5 * dt * a1);
        let (a3, v3) = (acceleration(t + 0.5 * dt, u + 0.5 * dt * v2), v + 0.5 * dt * a2);
        let (a4, v4) = (acceleration(t + dt, u + dt * v3), v + dt * a3);
        u += dt / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
        v += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    // the program's state is seen from the obstacle
    let (x, y) = (report.last.u[0] + m(until), report.last.v[0] + m_dot(until));
    assert!((x - u).abs() < 2e-5 && (y - v).abs() < 5e-5, "{x} {u}, {y} {v}");
}

/// A cosine sampled finely is the cosine, as a force and as the motion of a support.
#[test]
fn a_measured_history_is_its_spline() {
    let folder = tempfile::tempdir().unwrap();
    let omega = 1.7;
    let samples = |n: usize| -> String {
        (0..=n)
            .map(|k| 10.0 * k as f64 / n as f64)
            .map(|t| format!("{t}, {}\n", (omega * t).cos()))
            .collect()
    };
    std::fs::write(
        folder.path().join("load.csv"),
        format!("# a header\ntime, value\n{}", samples(4000)),
    )
    .unwrap();
    for load in [
        "kind = \"gravity\"\namplitude = [0.5, 0.1]",
        "kind = \"base\"\nedge = \"left\"\namplitude = [0.2, 0.0]",
    ] {
        let state = |course: &str| {
            let run = "[damping]\nratio = 0.02\nmode = 1\n[run]\nuntil = 6.0\nintegrator = \"dop853\"\nrtol = 1e-10\natol = 1e-12\n";
            let text = plate("", &format!("[[load]]\n{load}\n{course}\n{run}"));
            let scene = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap();
            let problem = Problem::new(&scene, None).unwrap();
            let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
            assert!(report.outcome.is_complete() && report.energy_drift_total < 1e-6);
            (report.last, report.switches.len())
        };
        let ((a, n), (b, m)) = (state("table = \"load.csv\""), state(&format!("omega = {omega}")));
        assert!(n == m && n > 2, "{n} {m}");
        // the natural spline bends at its ends, where the cosine does not: what it leaves there decays with the step
        assert!(distance(&a, &b) < 2e-5, "{load}: {}", distance(&a, &b));
    }
}

/// A period of the moving obstacle is a period of forced orbits.
#[test]
fn an_obstacle_that_moves_forces_orbits() {
    use signorini::orbit::search::{Effort, find};
    use signorini::orbit::{Closure, Propagator};
    let text = plate(
        "motion = { amplitude = 0.5, omega = 1.3 }",
        "[damping]\nratio = 0.05\nmode = 1\n[orbit]\nomega = 1.3\n",
    );
    let (_, problem) = problem(&text);
    let mut body = Propagator::new(problem.system).unwrap();
    let guess = body.linear_response();
    let verdict = find(&mut body, Closure::FORCED, &guess, 1.3, &Effort::default()).unwrap();
    let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}"));
    assert!(orbit.switches.len() > 1 && (orbit.period - 2.0 * PI / 1.3).abs() < 1e-12);
    assert!(orbit.stability.as_ref().unwrap().is_stable());
}

/// The same load in the frequency domain: series of a body on a shaker converge to the orbit that shooting finds, and follow its frequency, with which
/// the size of the load changes.
#[test]
fn harmonic_balance_knows_loads_that_follow_the_frequency() {
    use signorini::continuation::Go;
    use signorini::hbm::newton::Settings;
    use signorini::hbm::response::{Track, Walk, sequential};
    use signorini::hbm::{Form, Reduction, Solution};
    use signorini::orbit::search::{Effort, find};
    use signorini::orbit::{Closure, Propagator};
    let text = plate(
        "motion = { amplitude = 0.5, omega = 1.3 }",
        "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [0.1, 0.0]\nomega = 1.3\nphase = 3.4\n[damping]\nratio = 0.05\nmode = 1\n",
    );
    let (_, problem) = problem(&text);
    let mut body = Propagator::new(problem.system.clone()).unwrap();
    let mut last = f64::INFINITY;
    for n_h in [7, 15, 31] {
        let mut r = Reduction::new(problem.system.clone(), Form::Acceleration).unwrap();
        let grid: Vec<f64> = (0..=20).map(|k| 1.1 + 0.01 * f64::from(k)).collect();
        let mut found: Option<Solution> = None;
        let mut tracks = vec![Track::default(); 2];
        let settings = Settings::default();
        let harmonics = [n_h];
        let walk = Walk::new(&harmonics, &grid, &settings);
        sequential(&mut r, &walk, &mut tracks, |_, p| {
            found = p.solution.ok();
            Go::Continue(())
        })
        .unwrap();
        let (s, omega) = (found.unwrap(), 1.3);
        assert!((s.omega - omega).abs() < 1e-12 && !s.crossings.is_empty());
        let (q, dq) = s.q.at(0.0);
        let z = body.frame(&r.state(&q, &dq, omega));
        let verdict = find(&mut body, Closure::FORCED, &z, omega, &Effort::default()).unwrap();
        let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}"));
        let d = crate::common::relative(&z, &orbit.z);
        assert!(d < 0.7 * last, "{n_h}: {d}");
        last = d;
    }
    assert!(last < 2e-3, "{last}");
}

/// What cannot be done is refused with the reason.
#[test]
fn refusals_name_the_key() {
    let words = |text: &str| -> String {
        match Scene::parse(text, std::path::Path::new("scene.toml")) {
            Err(e) => format!("{e}"),
            Ok(scene) => format!("{}", Problem::new(&scene, None).err().unwrap()),
        }
    };
    let load = |rest: &str| plate("", &format!("[[load]]\n{rest}\n[run]\nuntil = 1.0\n"));
    for (text, expected) in [
        (load("kind = \"base\"\namplitude = [0.1, 0.0]\nomega = 1.0"), "load[0].edge"),
        (
            load("kind = \"base\"\nedge = \"bottom\"\namplitude = [0.1, 0.0]\nomega = 1.0"),
            "no support holds",
        ),
        (
            load("kind = \"base\"\nedge = \"bottom\"\namplitude = [0.0, 0.1]\nomega = 1.0"),
            "contact stress",
        ),
        (
            load("kind = \"gravity\"\namplitude = [0.1, 0.0]\ntable = \"nothing.csv\""),
            "cannot read",
        ),
        (
            load(
                "kind = \"gravity\"\namplitude = [0.1, 0.0]\nomega = 1.0\ntable = \"nothing.csv\"",
            ),
            "beside omega",
        ),
        (plate("motion = { amplitude = 0.1 }", ""), "omega"),
        (plate("motion = { amplitude = 0.1, omega = -1.0 }", ""), "contact.motion.omega"),
    ] {
        let said = words(&text);
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

/// A run before an obstacle that moves is gone on with from its file: the file knows where the obstacle was. One run of two periods is two of one.
#[test]
fn a_run_before_a_moving_obstacle_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let omega = 1.45;
    let period = 2.0 * PI / omega;
    let motion = format!("motion = {{ amplitude = 0.3, omega = {omega}, phase = 0.5 }}\n");
    let text = |contact: &str, initial: &str, until: f64| {
        let run = format!("[run]\nuntil = {until:.17}\nintegrator = \"modal\"\n");
        plate(contact, &format!("{initial}\n{run}"))
    };
    let run = |name: &str, text: String| -> Vec<f64> {
        let scene = folder.path().join(format!("{name}.toml"));
        let file = folder.path().join(format!("{name}.h5"));
        std::fs::write(&scene, text).unwrap();
        let words = ["run", scene.to_str().unwrap(), "-q", "-o", file.to_str().unwrap()];
        let output = crate::common::run(&words);
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let file = crate::common::hdf5_files().open(file).unwrap();
        let u = file.dataset("trajectory/u").unwrap().read_2d::<f64>().unwrap();
        u.row(u.nrows() - 1).to_vec()
    };
    let start = "[initial]\ndisplacement = [\"0.3*x\", \"0\"]\n";
    let whole = run("whole", text(&motion, start, 2.0 * period));
    run("first", text(&motion, start, period));
    let then = run("second", text(&motion, "[initial]\nfile = \"first.h5\"\n", period));
    let size = whole.iter().map(|x| x * x).sum::<f64>().sqrt();
    let off =
        |a: &[f64]| a.iter().zip(&whole).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size;
    assert!(off(&then) < 1e-10, "{:e}", off(&then));
    // before an obstacle at rest, far away: the state is the same, seen from elsewhere; what is seen from the obstacle at 0.3 cos(0.5) at t = 0 lies behind it by that
    let seen = |contact: &str, name: &str| {
        let until = "[initial]\nfile = \"first.h5\"\n";
        let scene = text(contact, until, 1e-9).replace("gap = 0.4", "gap = 40.0");
        run(name, scene)
    };
    let moving = seen(&motion, "moving");
    let still = seen("", "still");
    let shift: Vec<f64> = still.iter().zip(&moving).map(|(a, b)| a - b).collect();
    let at = 0.3 * f64::cos(0.5);
    // along the normal x, and nothing along y
    for d in &shift {
        assert!((d - at).abs() < 1e-7 || d.abs() < 1e-7, "{d} {at}");
    }
    assert!(shift.iter().any(|d| (d - at).abs() < 1e-7));
}

/// What files, probes and pictures have of a support that moves: the motion of an inertial load in its frame, and the frame's.
#[test]
fn a_support_that_moves_is_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let (amplitude, omega, phase) = ([0.3, 0.2], 1.4, -PI / 2.0);
    let probes = "[[probe]]\nname = \"root\"\nat = [0.01, 0.01]\nquantity = [\"displacement\", \"velocity\", \"acceleration\", \"stress\"]\n\
                  [[probe]]\nname = \"edge\"\nedge = \"left\"\nquantity = [\"displacement\", \"stress\"]\n";
    let run = "[run]\nuntil = 6.0\nsamples = 60\nintegrator = \"modal\"\n";
    let scene =
        |rest: &str| plate("", &format!("{rest}{probes}{run}")).replace("gap = 0.4", "gap = 40.0");
    // nothing holds the bottom: it would have to move along
    let scene =
        |rest: &str| scene(rest).replace("[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n", "");
    let [x, y] = amplitude;
    let base = format!(
        "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [{x}, {y}]\nomega = {omega}\nphase = {phase}\n"
    );
    let w = omega * omega;
    let inertial = format!(
        "[[load]]\nkind = \"gravity\"\namplitude = [{}, {}]\nomega = {omega}\nphase = {phase}\n\
         [initial]\nvelocity = [\"{}\", \"{}\"]\n",
        w * x,
        w * y,
        -omega * x,
        -omega * y
    );
    let stored = |name: &str, text: &str| {
        let at = |end: &str| folder.path().join(format!("{name}.{end}"));
        std::fs::write(at("toml"), text).unwrap();
        let mut command = crate::common::program();
        let done = command.arg("run").arg(at("toml")).arg("-o").arg(at("h5")).arg("-q").output();
        assert!(done.unwrap().status.success(), "{name}");
        Stored::read(&at("h5")).unwrap()
    };
    let (moved, still) = (stored("moved", &scene(&base)), stored("still", &scene(&inertial)));
    for (row, &t) in moved.t.iter().enumerate() {
        let s = [0, 1, 2].map(|order| match order {
            0 => (omega * t + phase).cos(),
            1 => -omega * (omega * t + phase).sin(),
            _ => -w * (omega * t + phase).cos(),
        });
        for node in 0..moved.nodes.nrows() {
            for (order, of) in [Stored::displacement, Stored::velocity].into_iter().enumerate() {
                let (a, b) = (of(&moved, row, node), of(&still, row, node));
                for c in 0..2 {
                    let off = (a[c] - b[c] - amplitude[c] * s[order]).abs();
                    assert!(off < 1e-8, "node {node} at {t}: {off:e}");
                }
            }
        }
        for (a, b) in moved.probes.iter().zip(&still.probes) {
            let order = match a.quantity.name() {
                "displacement" => Some(0),
                "velocity" => Some(1),
                "acceleration" => Some(2),
                _ => None,
            };
            for c in 0..a.values.ncols() {
                let frame = order.map_or(0.0, |order| amplitude[c] * s[order]);
                let off = (a.values[(row, c)] - b.values[(row, c)] - frame).abs();
                assert!(off < 1e-7, "{} {} at {t}: {off:e}", a.name, a.quantity.name());
            }
        }
    }
    // along a table: the spline through its points, which stored states meet
    std::fs::write(folder.path().join("table.csv"), "0,0\n1,0.5\n2,-0.25\n4,1\n6,0\n").unwrap();
    let table = format!(
        "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [{x}, {y}]\ntable = \"table.csv\"\n"
    );
    let moved = stored("table", &scene(&table).replace("integrator = \"modal\"\n", ""));
    let edge = moved.probes.iter().find(|p| p.name == "edge").unwrap();
    for (t, value) in [(1.0, 0.5), (2.0, -0.25), (4.0, 1.0)] {
        let row = moved.t.iter().position(|s| (s - t).abs() < 1e-9).unwrap();
        for (c, size) in amplitude.into_iter().enumerate() {
            assert!((edge.values[(row, c)] - size * value).abs() < 1e-12);
            assert!((moved.displacement(row, 0)[c] - size * value).abs() < 1e-12);
        }
    }
}
