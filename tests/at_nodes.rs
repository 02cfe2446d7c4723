//! Elements at nodes: springs, dampers, masses, sliders, Iwan models, modal damping: closed forms, integrals over edges, exact flows against Dormand–Prince, random systems
//! against small projected steps that know no events.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::cuboid::cuboid;
use crate::common::rectangle::msh;
use crate::common::{Splitmix, derivative_error, json, problem, program, relative, run_by, scene};
use nalgebra::{DMatrix, DVector};
use signorini::contact::{PointState, State, System};
use signorini::event::{self, Options, Report, Silent, SwitchKind};
use signorini::flow::{Modal, complex_modes};
use signorini::mesh::ElementKind;
use signorini::orbit::period_map::integrate;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Attached, Integrator, Matrix, Scene};

/// `m = 1` on a spring `k`, of one lumped element.
fn oscillator(k: f64, tables: &str) -> String {
    format!(
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = {k:?}\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n{tables}"
    )
}

/// `ẍ + 2δẋ + ω²x = f` from `x₀` at rest.
fn damped(x0: f64, (delta, omega, f): (f64, f64, f64), t: f64) -> f64 {
    let (rest, w) = (f / (omega * omega), (omega * omega - delta * delta).sqrt());
    rest + (x0 - rest) * (-delta * t).exp() * ((w * t).cos() + delta / w * (w * t).sin())
}

#[test]
fn an_oscillator_moves_as_its_elements_say() {
    let tables = "[[spring]]\nat = [1.0]\nstiffness = 3.0\npreload = 0.7\n[[mass]]\nedge = 'right'\nmass = 0.5\n[[damper]]\nedge = 'right'\nviscosity = 0.2\n\
                  [initial]\ndisplacement = ['0.4*x']\n[run]\nuntil = 7.0\nsamples = 1\n";
    let scene = scene(&oscillator(1.0, tables));
    let (m, k, c) = (1.5f64, 4.0f64, 0.2f64);
    let closed = damped(0.4, (0.5 * c / m, (k / m).sqrt(), -0.7 / m), 7.0);
    for integrator in [Integrator::Modal, Integrator::Dop853] {
        let report = run_by(&scene, integrator);
        assert!((report.last.u[0] - closed).abs() < 1e-11, "{} {closed}", report.last.u[0]);
        assert!(report.energy_drift_total < 1e-12);
    }
}

/// Energies of fields whose means over edges are known: `∫u/|Γ|` of a linear field, `∫u²` of a constant one, differences of two edges; gravity acts on masses.
#[test]
fn ends_are_means_over_edges_and_differences_of_two() {
    let plate = |tables: &str| {
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [2.0, 1.0]\nelements = [6, 5]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nthickness = 0.5\n{tables}"
        );
        let scene = scene(&text);
        // a body that nothing holds is refused where nothing carries it: not what is asked here
        let held = "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n";
        drop(scene);
        problem(&(text + held)).system
    };
    let bare = plate("");
    // u = (x (1 + y), x y): zero on the left
    let field = |system: &System| {
        let nodes = system.body.mesh.nodes();
        let nodal: Vec<f64> = nodes.iter().flat_map(|[x, y, _]| [x * (1.0 + y), x * y]).collect();
        system.body.dofs.gather(&nodal)
    };
    let added = |tables: &str| {
        let system = plate(tables);
        let (u, own) = (field(&system), field(&bare));
        let elastic = system.elastic(0.0, &u) - bare.elastic(0.0, &own);
        [elastic, system.kinetic(0.0, &u) - bare.kinetic(0.0, &own)]
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    // mean of (u, v)·(3, 4)/5 over x = 2: (0.6 · 3 + 0.8 · 1)
    let spring = "[[spring]]\nedge = 'right'\ndirection = [3.0, 4.0]\nstiffness = 2.0\n";
    near(added(spring)[0], 2.6 * 2.6);
    near(added("[[mass]]\nedge = 'right'\ndirection = [0.0, 1.0]\nmass = 4.0\n")[1], 2.0);
    // top minus bottom, u_x: means of 2x and of x over 0 … 2
    let both = "[[spring]]\nedge = 'top'\nto = 'bottom'\ndirection = [1.0, 0.0]\nstiffness = 6.0\n";
    near(added(both)[0], 3.0);
    let places = "[[spring]]\nat = [2.0, 1.0]\nto_at = [2.0, 0.0]\ndirection = [1.0, 0.0]\nstiffness = 1.0\n";
    near(added(places)[0], 0.5 * 4.0);
    // one at every node: Σ area u², the area that of the thickness 0.5
    let each = "[[spring]]\nedge = 'top'\neach = true\ndirection = [0.0, 1.0]\nstiffness = 3.0\n";
    let h = 1.0 / 3.0;
    let trapeze: f64 = (0..7)
        .map(|i| {
            let (x, share) = (f64::from(i) * h, if i == 0 || i == 6 { 0.5 } else { 1.0 });
            share * h * 0.5 * x * x
        })
        .sum();
    near(added(each)[0], 1.5 * trapeze);
    // weight of a mass, along its direction
    let system = plate("[[mass]]\nat = [2.0, 1.0]\ndirection = [0.0, 1.0]\nmass = 4.0\n");
    let (heavy, light) = (system.gravity(&[0.3, -2.0]), bare.gravity(&[0.3, -2.0]));
    let all: f64 = heavy.iter().zip(&light).map(|(a, b)| a - b).sum();
    near(all, -8.0);
}

/// Bounds of all frequencies stay bounds with springs, and rigid motions end where springs hold them.
#[test]
fn springs_hold_and_stiffen() {
    let text = |tables: &str| {
        format!(
            "[body]\nkind = 'plate'\nsize = [1.0, 1.0]\nelements = [3, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{tables}"
        )
    };
    let spring = |at: &str, d: &str, k: f64| {
        format!("[[spring]]\nat = {at}\ndirection = {d}\nstiffness = {k:?}\n")
    };
    let two = spring("[0.0, 0.0]", "[1.0, 0.0]", 2.0) + &spring("[0.0, 0.0]", "[0.0, 1.0]", 3.0);
    let three = two.clone() + &spring("[1.0, 1.0]", "[1.0, 0.0]", 1e3);
    let held = problem(&text(&three)).system;
    assert!(held.body.rigid_motions(false).is_empty());
    let modes = signorini::fem::eigen::all(&held.body.stiffness, &held.body.mass, 1e-9).unwrap();
    let highest = modes.omega.iter().fold(0.0f64, |m, w| m.max(*w));
    assert!(modes.omega[0] > 1e-3 && highest <= held.body.frequency_bound());
    // one rotation is left, about the corner
    let refused = Problem::new(&scene(&text(&two)), None).unwrap_err().to_string();
    assert!(refused.contains("can move rigidly"), "{refused}");
}

/// At every node of faces of second order, whose consistent areas are not positive: shares that are, and add up to the face; all elements run.
#[test]
fn every_node_of_a_face_has_a_share_of_it() {
    let folder = tempfile::tempdir().unwrap();
    for kind in [ElementKind::Tet10, ElementKind::Hex20, ElementKind::Prism15, ElementKind::Hex8] {
        let mesh = cuboid(kind, [1.0, 0.5, 0.8], [2, 1, 2], 0.0);
        std::fs::write(folder.path().join("box.msh"), msh(&mesh, |_| 0)).unwrap();
        let file = folder.path().join("a.toml");
        let held = "[body]\nkind = 'mesh'\nfile = 'box.msh'\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
                    [[support]]\ngroup = 'xmin'\nfix = ['x', 'y', 'z']\n";
        let each = "group = 'xmax'\neach = true\ndirection = [0.0, 1.0, 0.0]\n";
        let elements = format!(
            "[[spring]]\n{each}stiffness = 3.0\n[[damper]]\n{each}viscosity = 0.1\n[[mass]]\n{each}mass = 0.2\n[[slider]]\n{each}limit = 0.05\nstiffness = 2.0\n"
        );
        let motion = "[initial]\nvelocity = ['0', '0.1*x', '0.1*x*z']\n[run]\nuntil = 3.0\nintegrator = 'dop853'\n";
        let text = format!("{held}{elements}{motion}");
        std::fs::write(&file, text).unwrap();
        let scene = Scene::read(&file).unwrap();
        let system = Problem::new(&scene, None).unwrap().system;
        let springs = system.body.discrete.iter().filter(|e| e.stiffness > 0.0 && e.mass == 0.0);
        let (count, sum) = springs.fold((0, 0.0), |(n, k), e| (n + 1, k + e.stiffness));
        assert!((sum / (3.0 * 0.5 * 0.8) - 1.0).abs() < 1e-12, "{kind:?} {sum}");
        let nodes = mesh.nodes().iter().filter(|x| x[0] == 1.0).count();
        assert_eq!(count, nodes, "{kind:?}");
        assert!(system.sliders().iter().all(|s| s.limit > 0.0));
        let said = json(&[
            "run",
            &file.display().to_string(),
            "-o",
            &folder.path().join("a.h5").display().to_string(),
            "--force",
        ]);
        assert!(said["energy_drift_total"].as_f64().unwrap() < 1e-9, "{kind:?} {said}");
        assert_eq!(said["status"], "complete", "{kind:?} {said}");
    }
}

/// The same of springs in series with sliders: while they stick, no mode is above the bound, and the bound is not far above.
#[test]
fn springs_of_sliders_stiffen() {
    let bar = |k: f64| {
        let text = format!(
            "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
             [[slider]]\nat = [0.5]\ndirection = [1.0]\nlimit = 0.1\nstiffness = {k:?}\n[[slider]]\nedge = 'right'\ndirection = [1.0]\nlimit = 0.1\nstiffness = {k:?}\n"
        );
        problem(&text).system
    };
    for k in [1.0, 1e4, 1e8] {
        let system = bar(k);
        let (stiffness, mass) = system.phase(&system.closed_states()).matrices();
        let modes = signorini::fem::eigen::all(&stiffness, &mass, 1e-9).unwrap();
        let highest = modes.omega.iter().fold(0.0f64, |m, w| m.max(*w));
        let bound = system.frequency_bound();
        assert!(highest <= bound && bound < 2.0 * highest, "{k}: {highest} {bound}");
    }
}

/// Every mode of the open body decays by its own ratio; in contact the ratios couple, and two flows agree.
#[test]
fn modal_damping_is_that_of_the_open_body() {
    let bar = |tables: &str| {
        format!(
            "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [8]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n{tables}"
        )
    };
    for (k, ratio, modal) in [(1, 0.03, "0.03"), (2, 0.2, "[0.1, 0.2]"), (3, 0.0, "[0.1, 0.2]")] {
        let tables = format!(
            "[damping]\nmodal = {modal}\n[initial]\nmode = {k}\namplitude = 0.1\n[run]\nuntil = 3.0\n"
        );
        let scene = scene(&bar(&tables));
        let p = Problem::new(&scene, None).unwrap();
        let phase = p.system.open_phase();
        let (stiffness, mass) = phase.matrices();
        let omega = signorini::fem::eigen::all(&stiffness, &mass, 1e-9).unwrap().omega[k - 1];
        let wanted = damped(1.0, (ratio * omega, omega, 0.0), 3.0);
        let report = run_by(&scene, Integrator::Modal);
        for (u, u0) in report.last.u.iter().zip(&p.initial.u) {
            assert!((u - wanted * u0).abs() < 1e-13, "{k}: {u} {wanted}");
        }
        assert!(report.is_certified() && report.energy_drift_total < 1e-13);
    }
    let tables = "[damping]\nmodal = 0.02\n[contact]\nedge = 'right'\ngap = 0.1\n[[load]]\nkind = 'point'\nat = [1.0]\namplitude = 0.3\nomega = 1.4\n[run]\nuntil = 30.0\n";
    for law in
        ["stress = 'reaction'\ninertia = 'constant'\n", "method = 'penalty'\nstiffness = 3.0\n"]
    {
        let text = bar(&tables.replace("gap = 0.1\n", &format!("gap = 0.1\n{law}")));
        let (exact, stepped) =
            (run_by(&scene(&text), Integrator::Modal), run_by(&scene(&text), Integrator::Dop853));
        assert!(exact.switches.len() > 10 && exact.switches.len() == stepped.switches.len());
        assert!(relative(&exact.last.u, &stepped.last.u) < 1e-9, "{law}");
        assert!(exact.energy_drift_total < 1e-12 && exact.energy_dissipated > 0.01);
        let gap = (exact.energy_dissipated - stepped.energy_dissipated).abs();
        assert!(gap < 1e-9 * exact.energy_dissipated);
    }
}

/// Friction beside dampers and modal ratios, on a belt: what sticks to it moves the dampers.
#[test]
fn dampers_act_beside_friction() {
    let tables = "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = -0.02\nfriction = 0.4\nsurface = [0.0, 0.1]\n\
                  [[damper]]\nedge = 'top'\ndirection = [0.0, 1.0]\nviscosity = 0.3\n[[damper]]\nat = [0.25, 0.0]\nto_at = [0.5, 0.5]\ndirection = [0.0, 1.0]\nviscosity = 0.2\n\
                  [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.0, 0.1]\nomega = 2.1\n[initial]\nvelocity = ['0.3*x', '0.2*x']\n[run]\nuntil = 8.0\n";
    for damping in ["", "[damping]\nmodal = 0.05\n", "[damping]\nrayleigh = [0.1, 0.02]\n"] {
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{tables}{damping}"
        );
        let (exact, stepped) =
            (run_by(&scene(&text), Integrator::Modal), run_by(&scene(&text), Integrator::Dop853));
        let off = relative(&exact.last.v, &stepped.last.v);
        assert!(off < 1e-9, "{damping} {off:e}");
        assert_eq!(exact.switches.len(), stepped.switches.len());
        assert!(exact.log.of_kind(SwitchKind::Sticking) > 2);
        assert!(exact.energy_drift_total < 1e-12 && stepped.energy_drift_total < 1e-11);
        assert!((exact.energy_dissipated - stepped.energy_dissipated).abs() < 1e-9);
    }
}

/// A mass on a spring under dry friction loses `2 μN/k` a half swing and stops (SDND100 of code_aster: at +0.05 mm after four, at `t = 4π/100`).
#[test]
fn a_dry_oscillator_stops_where_it_should() {
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 10000.0\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [[slider]]\nedge = 'right'\nlimit = 1.0\n[initial]\ndisplacement = ['0.00085*x']\n[run]\nuntil = 0.2\n";
    for integrator in [Integrator::Modal, Integrator::Dop853] {
        let report = run_by(&scene(text), integrator);
        let times: Vec<f64> = report.switches.iter().map(|s| s.t).collect();
        for (k, t) in times.iter().enumerate() {
            let half = (k + 1) as f64 * std::f64::consts::PI / 100.0;
            assert!((t - half).abs() < 1e-12, "{t} {half}");
        }
        assert_eq!(times.len(), 4);
        assert!((report.last.u[0] - 5e-5).abs() < 1e-14, "{:?}", report.last);
        assert!(report.last.v[0].abs() < 1e-15);
        let work = report.rubbed.as_ref().unwrap().work();
        assert!((work - 0.0036).abs() < 1e-14, "{work}");
    }
}

/// A matrix as Matrix Market has it.
fn market(a: &DMatrix<f64>) -> String {
    let numbers: Vec<String> = a.iter().map(|x| format!("{x:?}")).collect();
    format!(
        "%%MatrixMarket matrix array real general\n{} {}\n{}\n",
        a.nrows(),
        a.ncols(),
        numbers.join("\n")
    )
}

/// A body of these matrices.
fn of_matrices(
    place: &tempfile::TempDir,
    [mass, stiffness]: [&DMatrix<f64>; 2],
    tables: &str,
) -> Scene {
    std::fs::write(place.path().join("M.mtx"), market(mass)).unwrap();
    std::fs::write(place.path().join("K.mtx"), market(stiffness)).unwrap();
    let text = format!(
        "[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n{tables}"
    );
    Scene::parse(&text, &place.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
}

/// A rigid block on a shaken plane (SDND104 of code_aster, seen from the plane): it sticks, sticks and slips, or slips all the time, by the ratio of friction to inertia. The
/// block is two halves on a spring that nothing stretches: they switch at one instant.
#[test]
fn a_block_on_a_shaken_plane_takes_what_it_should() {
    let (amplitude, omega) = (2.0f64, 3.0f64);
    let halves = DMatrix::<f64>::identity(2, 2);
    let spring = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
    let period = std::f64::consts::TAU / omega;
    let moved = |limit: f64, phase: f64| {
        let tables = format!(
            "[[slider]]\nrow = 0\nlimit = {limit:?}\n[[slider]]\nrow = 1\nlimit = {limit:?}\n[[load]]\nkind = 'force'\namplitude = [{amplitude:?}, {amplitude:?}]\nomega = {omega:?}\nphase = {phase:?}\n[run]\nuntil = {:?}\n",
            3.0 * period
        );
        let place = tempfile::tempdir().unwrap();
        let scene = of_matrices(&place, [&halves, &spring], &tables);
        let reports = [Integrator::Modal, Integrator::Dop853].map(|by| run_by(&scene, by));
        assert_eq!(reports[0].switches.len(), reports[1].switches.len());
        reports
    };
    // slips all the time: from rest at the right instant it is in its cycle at once
    let limit = 0.8;
    let phase = -(std::f64::consts::FRAC_PI_2 * limit / amplitude).asin();
    for report in moved(limit, phase) {
        for switch in &report.switches {
            let halves = switch.t / (0.5 * period);
            assert!((halves - halves.round()).abs() < 1e-9, "{halves}");
        }
        let work = report.rubbed.unwrap().work();
        let closed = 2.0 * 3.0 * 4.0 * limit * amplitude * phase.cos() / (omega * omega);
        assert!((work - closed).abs() < 1e-9 * closed, "{work} {closed}");
    }
    // sticks and slips: it breaks loose where inertia comes to the limit, and grips where its velocity ends
    let limit = 1.5;
    let loose = -(limit / amplitude).acos();
    let slip = |x: f64| amplitude / omega * (x.sin() - loose.sin()) - limit / omega * (x - loose);
    let (mut a, mut b) = (loose + 0.5, loose + std::f64::consts::PI);
    while b - a > 1e-15 * b {
        let middle = 0.5 * (a + b);
        if middle <= a || middle >= b {
            break;
        }
        if slip(middle) > 0.0 { a = middle } else { b = middle }
    }
    let way = (amplitude * (loose.cos() - a.cos())
        - amplitude * loose.sin() * (a - loose)
        - 0.5 * limit * (a - loose).powi(2))
        / (omega * omega);
    let start = -std::f64::consts::FRAC_PI_2;
    for report in moved(limit, start) {
        assert_eq!(report.switches.len(), 24);
        for (k, switch) in report.switches.iter().enumerate() {
            // both halves
            let k = k / 2;
            let at = if k % 2 == 0 { loose } else { a } - start;
            let t = at / omega + 0.5 * period * (k / 2) as f64;
            assert!((switch.t - t).abs() < 1e-10, "{k}: {} {t}", switch.t);
        }
        let work = report.rubbed.unwrap().work();
        assert!((work - 12.0 * limit * way).abs() < 1e-10 * work, "{work} {}", 12.0 * limit * way);
    }
    // sticks
    assert!(moved(2.1, start).iter().all(|r| r.switches.is_empty()));
}

/// The cantilever of NLstep's example 02: eight Euler–Bernoulli elements, a slider at the fourth node; free and stuck frequencies.
#[test]
fn a_beam_on_a_slider_has_the_frequencies_of_another_program() {
    let (length, count, young, density) = (2000.0f64, 8, 185e3f64, 7.83e-9f64);
    let (height, width) = (100.0f64, 300.0f64);
    let (l, bending, line) =
        (length / count as f64, young * width * height.powi(3) / 12.0, density * width * height);
    let k = DMatrix::from_row_slice(
        4,
        4,
        &[
            12.0,
            6.0 * l,
            -12.0,
            6.0 * l,
            6.0 * l,
            4.0 * l * l,
            -6.0 * l,
            2.0 * l * l,
            -12.0,
            -6.0 * l,
            12.0,
            -6.0 * l,
            6.0 * l,
            2.0 * l * l,
            -6.0 * l,
            4.0 * l * l,
        ],
    ) * (bending / l.powi(3));
    let m = DMatrix::from_row_slice(
        4,
        4,
        &[
            156.0,
            22.0 * l,
            54.0,
            -13.0 * l,
            22.0 * l,
            4.0 * l * l,
            13.0 * l,
            -3.0 * l * l,
            54.0,
            13.0 * l,
            156.0,
            -22.0 * l,
            -13.0 * l,
            -3.0 * l * l,
            -22.0 * l,
            4.0 * l * l,
        ],
    ) * (line * l / 420.0);
    let n = 2 * count + 2;
    let (mut stiffness, mut mass) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for e in 0..count {
        let add = |whole: &mut DMatrix<f64>, part: &DMatrix<f64>| {
            let mut view = whole.view_mut((2 * e, 2 * e), (4, 4));
            view += part;
        };
        add(&mut stiffness, &k);
        add(&mut mass, &m);
    }
    let clamped = |a: DMatrix<f64>| a.view((2, 2), (n - 2, n - 2)).into_owned();
    // the displacement of the fourth node, the clamped one counted
    let tables = "[[slider]]\nrow = 4\nlimit = 1500.0\n[run]\nuntil = 1.0\n";
    let place = tempfile::tempdir().unwrap();
    let scene = of_matrices(&place, [&clamped(mass), &clamped(stiffness)], tables);
    let system = Problem::new(&scene, None).unwrap().system;
    for (state, wanted) in [(PointState::SlipPlus, 123.3406), (PointState::Stick, 248.9732)] {
        let phase = system.phase(&[state].into_iter().collect());
        let modes = complex_modes(&system, &phase).unwrap();
        let lowest =
            modes.iter().map(|m| m.lambda.im).filter(|w| *w > 1.0).fold(f64::INFINITY, f64::min);
        assert!((lowest / wanted - 1.0).abs() < 5e-7, "{state:?}: {lowest} {wanted}");
    }
}

/// The preload of a slider's spring pulls from the beginning, and is where `equilibrium` begins; the slider gives way where preload and motion come to its limit.
#[test]
fn a_slider_may_be_preloaded() {
    let slider = |preload: f64| {
        format!("[[slider]]\nat = [1.0]\nlimit = 1.0\nstiffness = 3.0\npreload = {preload:?}\n")
    };
    let with = |preload: f64, rest: &str| scene(&oscillator(1.0, &(slider(preload) + rest)));
    for integrator in [Integrator::Modal, Integrator::Dop853] {
        // sticks: a spring of 1 + 3 with a force
        let report = run_by(&with(0.5, "[run]\nuntil = 2.0\n"), integrator);
        let closed = -0.125 * (1.0 - 4f64.cos());
        assert!(report.switches.is_empty() && (report.last.u[0] - closed).abs() < 1e-11);
        // breaks loose where 0.9 + 3x = 1, from x' = 1: x = −0.225 + a cos(2t − φ)
        let report =
            run_by(&with(0.9, "[initial]\nvelocity = ['x']\n[run]\nuntil = 0.2\n"), integrator);
        let (a, phase) = (0.225f64.hypot(0.5), 0.5f64.atan2(0.225));
        let t = 0.5 * (phase - ((0.1 / 3.0 + 0.225) / a).acos());
        assert_eq!(report.switches.len(), 1);
        assert!((report.switches[0].t - t).abs() < 1e-11, "{} {t}", report.switches[0].t);
        assert!(report.energy_drift_total < 1e-12);
    }
    let at_rest = run_by(
        &with(0.5, "[initial]\nequilibrium = true\n[run]\nuntil = 3.0\n"),
        Integrator::Modal,
    );
    assert!((at_rest.last.u[0] + 0.125).abs() < 1e-14 && at_rest.switches.is_empty());
    for (preload, words) in
        [("preload = 1.5", "beyond the limit"), ("preload = 0.1", "a rigid slider has none")]
    {
        let stiff = if preload.contains("1.5") { "stiffness = 3.0\n" } else { "" };
        let text = oscillator(
            1.0,
            &format!("[[slider]]\nat = [1.0]\nlimit = 1.0\n{stiff}{preload}\n[run]\nuntil = 1.0\n"),
        );
        let error = Scene::parse(&text, Path::new("test.toml")).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

/// Springs of sliders beside a reduction: with all modes the body itself, with few near it.
#[test]
fn a_reduced_body_remembers_what_its_sliders_do() {
    let whole = "[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [8, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
         [[iwan]]\nat = [1.0, 0.0]\ndirection = [0.0, 1.0]\ntable = [[0.002, 0.1], [0.005, 0.08]]\n[[slider]]\nat = [1.0, 0.3]\ndirection = [1.0, 0.0]\nlimit = 0.003\n\
         [[load]]\nkind = 'point'\nat = [1.0, 0.3]\namplitude = [0.0, 0.02]\nomega = 0.25\n[damping]\nrayleigh = [0.05, 0.0]\n[run]\nuntil = 60.0\nsamples = 10\n";
    let reduced = |count: &str| format!("{whole}[reduction]\n{count}\n");
    let books = |text: &str| {
        let report = run_by(&scene(text), Integrator::Dop853);
        assert!(report.energy_drift_total < 1e-10);
        let work = report.rubbed.as_ref().unwrap().work();
        (report.switches.len(), [work, report.energy_external])
    };
    let (count, own) = books(whole);
    let (all, same) = books(&reduced("cutoff = 1e9"));
    assert!(count > 30 && all == count, "{count} {all}");
    assert!(relative(&same, &own) < 1e-8, "{same:?} {own:?}");
    let (_, few) = books(&reduced("modes = 6"));
    assert!(relative(&few, &own) < 2e-2, "{few:?} {own:?}");
    let free = scene(&reduced("kind = 'free-interface'\nmodes = 6"));
    let error = Problem::new(&free, None).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("nothing holds what springs of sliders remember"), "{error}");
}

/// Den Hartog's amplitudes without a stop, by the loss `4 F X` of an orbit; Jenkins' by `4 f_s (X − f_s/k_t)` (data of JuliaJIM, a march of another program).
#[test]
fn sliders_respond_as_in_closed_form() {
    let folder = tempfile::tempdir().unwrap();
    let orbit = |name: &str, text: String| {
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, text).unwrap();
        let out = folder.path().join(format!("{name}.h5"));
        let said = json(&["orbit", path.to_str().unwrap(), "-q", "-o", out.to_str().unwrap()]);
        assert!(said["residual"].as_f64().unwrap() < 1e-13 && said["stable"] == true);
        (said["friction_work"].as_f64().unwrap(), said["amplitude"].as_f64().unwrap())
    };
    let load = |f: f64, w: f64| {
        format!("[[load]]\nkind = 'point'\nat = [1.0]\namplitude = {f:?}\nomega = {w:?}\n")
    };
    for (i, (r, f)) in [(0.8, 0.3), (1.25, 0.3), (1.5, 0.5), (2.0, 0.4)].into_iter().enumerate() {
        let slider = format!("[[slider]]\nat = [1.0]\nlimit = {f:?}\n");
        let (work, amplitude) =
            orbit(&format!("dry{i}"), oscillator(1.0, &(slider + &load(1.0, r))));
        let (v, angle) = (1.0 / (1.0 - r * r), std::f64::consts::PI / r);
        let u = angle.sin() / (r * (1.0 + angle.cos()));
        let closed = (v * v - f * f * u * u).sqrt();
        assert!((work / (4.0 * f) - closed).abs() < 1e-11, "{r}: {work} {closed}");
        assert!((amplitude - closed).abs() < 2e-3 * closed);
    }
    let jenkins =
        "[damping]\nrayleigh = [0.02, 0.0]\n[[slider]]\nat = [1.0]\nlimit = 1.0\nstiffness = 5.0\n";
    let found = [
        (2.94, 0.212305195004),
        (2.96, 0.214393681635),
        (2.98, 0.214692204523),
        (3.0, 0.213898058872),
    ];
    for (i, (w, wanted)) in found.into_iter().enumerate() {
        let text = oscillator(4.0, &(jenkins.to_owned() + &load(0.1, w)));
        let (work, _) = orbit(&format!("jenkins{i}"), text);
        let x = work / 4.0 + 0.2;
        assert!((x - wanted).abs() < 1e-11, "{w}: {x} {wanted}");
    }
}

/// A spring with a slider at the end of two elements, a damper in their middle: the orbit takes a period what a march by small steps takes, which knows no modes and no events.
#[test]
fn a_slider_with_its_spring_has_orbits_beside_a_damper() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["scene.toml", "out.h5"].map(|n| folder.path().join(n).display().to_string());
    let (c, k, limit, f, w) = (0.05, 0.5, 0.02, 0.05, 0.9);
    let text = format!(
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [2]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [[slider]]\nedge = 'right'\nlimit = {limit}\nstiffness = {k}\n[[damper]]\nat = [0.5]\nviscosity = {c}\n\
         [[load]]\nkind = 'point'\nat = [1.0]\namplitude = {f}\nomega = {w}\n[run]\nperiods = 1\n"
    );
    std::fs::write(&file, &text).unwrap();
    let orbit = json(&["orbit", &file, "-o", &out]);
    // M⁻¹ of two elements of length one half
    let (m, d) = ([1.0 / 3.0, 1.0 / 12.0, 1.0 / 6.0], 1.0 / 3.0 / 6.0 - 1.0 / 144.0);
    let rate = |t: f64, x: [f64; 4], s: f64| {
        let r =
            [-4.0 * x[0] + 2.0 * x[1] - c * x[2], 2.0 * x[0] - 2.0 * x[1] - s + f * (w * t).cos()];
        [x[2], x[3], (m[2] * r[0] - m[1] * r[1]) / d, (m[0] * r[1] - m[1] * r[0]) / d]
    };
    // the spring's force by its place, which a slip takes along
    let (steps, periods) = (40_000, 40);
    let h = std::f64::consts::TAU / w / f64::from(steps);
    let (mut x, mut z, mut work) = ([0.0; 4], 0.0, 0.0);
    for j in 0..steps * periods {
        let t = f64::from(j) * h;
        let force = |x: [f64; 4]| (k * (x[1] - z)).clamp(-limit, limit);
        let along = |a: [f64; 4], by: [f64; 4], h: f64| std::array::from_fn(|i| a[i] + h * by[i]);
        let a = rate(t, x, force(x));
        let half = along(x, a, 0.5 * h);
        let b = rate(t + 0.5 * h, half, force(half));
        x = along(x, b, h);
        let slip = (x[1] - z) - force(x) / k;
        z += slip;
        work += if j >= steps * (periods - 1) { limit * slip.abs() } else { 0.0 };
    }
    let taken = orbit["friction_work"].as_f64().unwrap();
    println!("{taken} {work}");
    assert!(orbit["residual"].as_f64().unwrap() < 1e-12 && orbit["stable"] == true);
    // of the first order in the step: 2e-5
    assert!((taken / work - 1.0).abs() < 1e-4, "{taken} {work}");
    // the rate of switches that ends a run is one of the spring, too, however stiff
    let stiff =
        text.replace("stiffness = 0.5", "stiffness = 1e6").replace("periods = 1", "periods = 5");
    std::fs::write(&file, stiff).unwrap();
    let run = json(&["run", &file, "-o", &out, "--force"]);
    assert_eq!(run["status"], "complete", "{run}");
}

/// The loss of a cycle of given displacement is that of the sliders that slide, `Σ 4 f (X − f/k)`: of Segalman's four parameters what their density says,
/// `4 R X^{χ+3}/((χ+2)(χ+3))`.
#[test]
fn an_iwan_element_is_its_sliders() {
    let four = "[[iwan]]\nat = [1.0]\nlimit = 1.0\nstiffness = 5.0\nchi = -0.5\nbeta = 0.2\nsliders = 400\n";
    let with = scene(&oscillator(1.0, four));
    let all = with.all_sliders();
    assert_eq!(all.len(), 401);
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        all.iter().map(|s| of(s.limit, s.stiffness.unwrap())).sum()
    };
    assert!((sum(&|f, _| f) - 1.0).abs() < 1e-13 && (sum(&|_, k| k) - 5.0).abs() < 1e-13);
    let (chi, beta) = (-0.5f64, 0.2);
    let share = beta + (chi + 1.0) / (chi + 2.0);
    let last = (1.0 + beta) / (5.0 * share);
    let density = (chi + 1.0) / (last.powf(chi + 2.0) * share);
    for x in [0.1 * last, 0.5 * last, 0.9 * last] {
        let loss = sum(&|f, k| 4.0 * f * (x - f / k).max(0.0));
        let closed = 4.0 * density * x.powf(chi + 3.0) / ((chi + 2.0) * (chi + 3.0));
        assert!((loss - closed).abs() < 2e-4 * closed, "{x}: {loss} {closed}");
    }
    // in motion: a table, and the same as sliders of their own
    let motion = "[[load]]\nkind = 'point'\nat = [1.0]\namplitude = 0.8\nomega = 1.7\n[damping]\nrayleigh = [0.05, 0.0]\n[run]\nuntil = 20.0\n";
    let table = "[[iwan]]\nat = [1.0]\ntable = [[0.2, 3.0], [0.3, 2.0]]\n";
    let two = "[[slider]]\nat = [1.0]\nlimit = 0.2\nstiffness = 3.0\n[[slider]]\nat = [1.0]\nlimit = 0.3\nstiffness = 2.0\n";
    let run =
        |elements: &str, by| run_by(&scene(&oscillator(1.0, &format!("{elements}{motion}"))), by);
    let (a, b) = (run(table, Integrator::Modal), run(two, Integrator::Modal));
    assert_eq!((&a.last.u, a.switches.len()), (&b.last.u, b.switches.len()));
    assert!(a.switches.len() > 20);
    let c = run(table, Integrator::Dop853);
    assert!(relative(&a.last.u, &c.last.u) < 1e-9 && a.energy_drift_total < 1e-12);
}

/// Masses, springs, dampers and sliders between random rows.
struct Random {
    scene: Scene,
    mass: Vec<f64>,
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
    /// Row, limit, stiffness.
    sliders: Vec<(Vec<f64>, f64, Option<f64>)>,
    constant: Vec<f64>,
    harmonic: Vec<f64>,
    omega: f64,
}

const UNTIL: f64 = 12.0;

impl Random {
    fn new(seed: u64) -> Random {
        let random = Splitmix::new(seed);
        let unit = || (random.bits() >> 11) as f64 / (1u64 << 53) as f64;
        let between = |a: f64, b: f64| a + (b - a) * unit();
        let n = 3 + random.below(3);
        let mass: Vec<f64> = (0..n).map(|_| between(0.5, 2.0)).collect();
        let mut stiffness = DMatrix::<f64>::zeros(n, n);
        let mut damping = DMatrix::<f64>::zeros(n, n);
        let mut text =
            "[body]\nkind = 'matrices'\nmass_matrix = 'M'\nstiffness_matrix = 'K'\n".to_owned();
        let add = |m: &mut DMatrix<f64>, w: &[f64], c: f64| {
            for i in 0..n {
                for j in 0..n {
                    m[(i, j)] += c * w[i] * w[j];
                }
            }
        };
        let mut pairs: Vec<(usize, Option<usize>)> = vec![];
        let mut ends = || -> (String, Vec<f64>) {
            loop {
                let i = random.below(n);
                let to = Some(random.below(n + 1)).filter(|j| *j < n && *j != i);
                let key = to.map_or((i, None), |j| (i.min(j), Some(i.max(j))));
                // no two rigid sliders over one displacement, nor over a loop of them: a tree
                if pairs.contains(&key) {
                    continue;
                }
                pairs.push(key);
                let mut row = vec![0.0; n];
                row[i] = 1.0;
                let mut words = format!("row = {i}\n");
                if let Some(j) = to {
                    row[j] = -1.0;
                    words += &format!("to_row = {j}\n");
                }
                return (words, row);
            }
        };
        for i in 0..n {
            let k = between(0.5, 3.0);
            let mut w = vec![0.0; n];
            w[i] = 1.0;
            if i > 0 {
                w[i - 1] = -1.0;
            }
            add(&mut stiffness, &w, k);
        }
        let mut sliders = vec![];
        for elastic in [false, true, true] {
            let (words, row) = ends();
            let (limit, k) = (between(0.05, 0.5), between(0.5, 5.0));
            text += &format!("[[slider]]\n{words}limit = {limit:?}\n");
            if elastic {
                text += &format!("stiffness = {k:?}\n");
            }
            sliders.push((row, limit, elastic.then_some(k)));
        }
        let given = stiffness.clone();
        if random.below(2) == 0 {
            let (words, row) = ends();
            let k = between(0.2, 2.0);
            text += &format!("[[spring]]\n{words}stiffness = {k:?}\n");
            add(&mut stiffness, &row, k);
        }
        if random.below(2) == 0 {
            let (words, row) = ends();
            let c = between(0.02, 0.4);
            text += &format!("[[damper]]\n{words}viscosity = {c:?}\n");
            add(&mut damping, &row, c);
        }
        if random.below(2) == 0 {
            let (alpha, beta) = (between(0.0, 0.2), between(0.0, 0.1));
            text += &format!("[damping]\nrayleigh = [{alpha:?}, {beta:?}]\n");
            damping += beta * &stiffness + alpha * DMatrix::from_diagonal(&mass.clone().into());
        }
        let force = |size: f64| (0..n).map(|_| between(-size, size)).collect::<Vec<f64>>();
        let (constant, harmonic, omega) = (force(0.2), force(0.8), between(0.5, 3.0));
        text += &format!("[[load]]\nkind = 'force'\namplitude = {constant:?}\n");
        text += &format!("[[load]]\nkind = 'force'\namplitude = {harmonic:?}\nomega = {omega:?}\n");
        text += &format!("[run]\nuntil = {UNTIL:?}\nsamples = 1\n");
        let mut scene =
            Scene::parse(&text, Path::new("random.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let entries = |a: &DMatrix<f64>| Matrix {
            shape: (n, n),
            entries: (0..n)
                .flat_map(|i| (0..n).map(move |j| (i, j)))
                .map(|(i, j)| (i, j, a[(i, j)]))
                .filter(|e| e.2 != 0.0)
                .collect(),
        };
        let m = DMatrix::from_diagonal(&mass.clone().into());
        let files = [("M".to_owned(), entries(&m)), ("K".to_owned(), entries(&given))];
        scene.attached = Attached::new(BTreeMap::from(files));
        Random { scene, mass, stiffness, damping, sliders, constant, harmonic, omega }
    }

    /// Semi-implicit steps; rigid sliders by projections, springs cut off at their limits.
    fn stepped(&self, h: f64) -> (Vec<f64>, f64) {
        let n = self.mass.len();
        let (mut u, mut v) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
        let mut z = vec![0.0; self.sliders.len()];
        let mut lambda = vec![0.0; self.sliders.len()];
        let mut work = 0.0;
        for step in 0..(UNTIL / h).round() as usize {
            let t = (step as f64 + 0.5) * h;
            // displacements half a step on, velocities a whole one
            u += 0.5 * h * &v;
            let mut f = -&self.stiffness * &u - &self.damping * &v;
            for i in 0..n {
                f[i] += self.constant[i] + self.harmonic[i] * (self.omega * t).cos();
            }
            for (s, (row, limit, k)) in self.sliders.iter().enumerate() {
                let Some(k) = k else { continue };
                let along: f64 = (0..n).map(|i| row[i] * u[i]).sum();
                let trial = k * (along - z[s]);
                let force = trial.clamp(-limit, *limit);
                if force != trial {
                    work += force * (along - force / k - z[s]);
                    z[s] = along - force / k;
                }
                (0..n).for_each(|i| f[i] -= force * row[i]);
            }
            let mut next = v.clone();
            (0..n).for_each(|i| next[i] += h * f[i] / self.mass[i]);
            for (s, (row, ..)) in self.sliders.iter().enumerate().filter(|s| s.1.2.is_none()) {
                (0..n).for_each(|i| next[i] -= h * lambda[s] * row[i] / self.mass[i]);
            }
            for _ in 0..60 {
                for (s, (row, limit, k)) in self.sliders.iter().enumerate() {
                    if k.is_some() {
                        continue;
                    }
                    let slip: f64 = (0..n).map(|i| row[i] * next[i]).sum();
                    let inertia: f64 = (0..n).map(|i| row[i] * row[i] / self.mass[i]).sum();
                    let new = (lambda[s] + slip / (h * inertia)).clamp(-limit, *limit);
                    let change = new - lambda[s];
                    lambda[s] = new;
                    (0..n).for_each(|i| next[i] -= h * change * row[i] / self.mass[i]);
                }
            }
            for (s, (row, ..)) in self.sliders.iter().enumerate().filter(|s| s.1.2.is_none()) {
                let along = |v: &DVector<f64>| (0..n).map(|i| row[i] * v[i]).sum::<f64>();
                work += 0.5 * h * lambda[s] * (along(&v) + along(&next));
            }
            v = next;
            u += 0.5 * h * &v;
        }
        (u.iter().copied().collect(), work)
    }
}

fn check_random(seeds: std::ops::Range<u64>, least: usize) {
    let (mut switches, mut worst, mut far) = (0, 0.0f64, 0.0f64);
    for seed in seeds {
        let random = Random::new(seed);
        let (exact, stepped) =
            (run_by(&random.scene, Integrator::Modal), run_by(&random.scene, Integrator::Dop853));
        let state = |r: &Report| [&r.last.u[..], &r.last.v[..]].concat();
        let off = relative(&state(&exact), &state(&stepped));
        assert!(off < 1e-8, "{seed}: {off:e}");
        assert_eq!(exact.switches.len(), stepped.switches.len(), "{seed}");
        assert!(exact.energy_drift_total < 1e-11, "{seed}: {:e}", exact.energy_drift_total);
        worst = worst.max(off);
        switches += exact.switches.len();
        let n = random.mass.len();
        let work = exact.rubbed.as_ref().unwrap().work();
        let errors = [4e-3, 1e-3].map(|h| {
            let (u, other) = random.stepped(h);
            let scale = exact.last.u[..n].iter().fold(0.1f64, |m, u| m.max(u.abs()));
            let of_u = u.iter().zip(&exact.last.u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            (of_u / scale).max((work - other).abs() / (0.1 + work))
        });
        far = far.max(errors[1]);
        assert!(errors[1] < 4e-3, "{seed}: {errors:?}");
    }
    println!("{switches} switches, {worst:.1e} between flows, {far:.1e} to small steps");
    assert!(switches > least, "{switches}");
}

#[test]
fn random_systems_slide_as_small_steps_do() {
    check_random(0..100, 2000);
}

/// The derivative of the map passes sticking and slipping of rigid sliders and of springs, whose memory is among the unknowns.
#[test]
fn tangents_know_what_springs_remember() {
    for seed in 20..28 {
        let random = Random::new(seed);
        let p = Problem::new(&random.scene, None).unwrap();
        let mut body = Propagator::new(p.system).unwrap();
        // from the middle of a motion, which goes on under the same loads
        let period = std::f64::consts::TAU / random.omega;
        let first = integrate(&body, &p.initial, 2.0 * period).unwrap();
        let z = body.frame(&first.report.last);
        let passage = integrate(&body, &body.state(&z), period).unwrap();
        // what sticks at the start is pushed by as much as it takes to come to rest: differences of the first order
        let worst = derivative_error(&mut body, Closure::FORCED, &z, period, 1e-6);
        println!("{seed}: {worst:.1e}, {} switches", passage.times.len());
        assert!(worst < 2e-5, "{seed}: {worst:.1e}");
    }
}

/// A run in two halves through a checkpoint is the run: what springs remember is in the state; nodes by themselves know nothing of it, and a file of them is refused.
#[test]
fn memory_is_in_the_state() {
    let tables = "[[slider]]\nat = [1.0]\nlimit = 0.2\nstiffness = 3.0\n[[load]]\nkind = 'point'\nat = [1.0]\namplitude = 0.8\nomega = 1.7\n";
    let system = problem(&oscillator(1.0, tables)).system;
    let run = |start: &State, until: f64| {
        let mut flow = Modal::new(&system);
        let options = Options { until, samples: 0, switch_limit: 400.0 };
        event::run(&system, start, &options, &mut flow, &mut Silent).unwrap()
    };
    let rest = signorini::contact::State { u: vec![0.0; 2], v: vec![0.0; 2] };
    let period = std::f64::consts::TAU / 1.7;
    let (whole, half) = (run(&rest, 4.0 * period), run(&rest, 2.0 * period));
    let rest_of_it = run(&half.last, 2.0 * period);
    assert!(relative(&whole.last.u, &rest_of_it.last.u) < 1e-12);
    assert!(half.active.at(0) == PointState::Stick || half.active.at(0).slip().is_some());
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("a.toml"), oscillator(1.0, &format!("{tables}[run]\nperiods = 2\n")))
        .unwrap();
    json(&["run", &path("a.toml"), "-q", "-o", &path("a.h5")]);
    let again = format!("{tables}[initial]\nfile = 'a.h5'\n[run]\nperiods = 2\n");
    std::fs::write(path("b.toml"), oscillator(1.0, &again)).unwrap();
    let out = program().args(["run", &path("b.toml"), "-o", &path("b.h5")]).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.code() == Some(2) && said.contains("remember"), "{said}");
}

/// Matrices may have motions that the stiffness does not oppose: two masses and a spring between them fly, and are refused where nothing carries them.
#[test]
fn free_masses_fly() {
    let text = "[body]\nkind = 'matrices'\nmass_matrix = 'M'\nstiffness_matrix = 'K'\n[[slider]]\nrow = 0\nlimit = 0.5\n[[load]]\nkind = 'force'\namplitude = [0.0, 1.0]\n[run]\nuntil = 3.0\nsamples = 1\n";
    let matrix =
        |entries: &[(usize, usize, f64)]| Matrix { shape: (2, 2), entries: entries.to_vec() };
    let with = |text: &str| {
        let mut scene = scene(text);
        let m = matrix(&[(0, 0, 1.0), (1, 1, 3.0)]);
        let k = matrix(&[(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0)]);
        scene.attached = Attached::new(BTreeMap::from([("M".to_owned(), m), ("K".to_owned(), k)]));
        scene
    };
    let report = run_by(&with(text), Integrator::Modal);
    // slides at cos(ωt) = 1/2, ω² = 2/3; then the centre of mass goes by (F − s)/m
    let omega = (2.0f64 / 3.0).sqrt();
    let t1 = (0.5f64).acos() / omega;
    assert!((report.switches[0].t - t1).abs() < 1e-12, "{:?}", report.switches);
    let (x1, v1) = (0.5 * (1.0 - (omega * t1).cos()), 0.5 * omega * (omega * t1).sin());
    let t = 3.0 - t1;
    let centre = 0.75 * (x1 + v1 * t) + 0.5 * (0.5 / 4.0) * t * t;
    let found = 0.25 * report.last.u[0] + 0.75 * report.last.u[1];
    assert!(report.switches.len() == 1 && (found - centre).abs() < 1e-12, "{found} {centre}");
    let refused =
        Problem::new(&with(&text.replace("[[slider]]\nrow = 0\nlimit = 0.5\n", "")), None);
    assert!(refused.unwrap_err().to_string().contains("can move rigidly"));
}

#[test]
fn bad_elements_are_named() {
    let bar = |tables: &str| oscillator(1.0, tables);
    let cases = [
        ("[[spring]]\nstiffness = 1.0\n", "spring[0]", "does not say where"),
        (
            "[[spring]]\nat = [1.0]\nedge = 'right'\nstiffness = 1.0\n",
            "spring[0]",
            "several first ends",
        ),
        (
            "[[spring]]\nat = [1.0]\nto = 'left'\nto_at = [0.0]\nstiffness = 1.0\n",
            "spring[0]",
            "several second ends",
        ),
        ("[[spring]]\nat = [1.0]\nstiffness = -1.0\n", "spring[0].stiffness", "positive"),
        ("[[spring]]\nat = [9.0]\nstiffness = 1.0\n", "spring[0].at", "outside"),
        ("[[spring]]\nat = [0.0]\nstiffness = 1.0\n", "spring[0]", "hold"),
        ("[[spring]]\nrow = 1\nstiffness = 1.0\n", "spring[0].row", "has nodes"),
        ("[[spring]]\nat = [1.0]\neach = true\nstiffness = 1.0\n", "spring[0].each", "every node"),
        ("[[spring]]\nat = [1.0]\nto = 'middle'\nstiffness = 1.0\n", "spring[0].to", "no edge"),
        ("[[damper]]\nat = [1.0]\nviscosity = 0.0\n", "damper[0].viscosity", "positive"),
        ("[[mass]]\nat = [1.0]\nmass = inf\n", "mass[0].mass", "finite"),
        ("[[slider]]\nat = [1.0]\nlimit = 0.0\n", "slider[0].limit", "positive"),
        (
            "[[slider]]\nat = [1.0]\nlimit = 1.0\nstiffness = nan\n",
            "slider[0].stiffness",
            "positive",
        ),
        (
            "[[slider]]\nat = [1.0]\nlimit = 1.0\n[[slider]]\nedge = 'right'\nlimit = 2.0\n",
            "slider[1]",
            "same displacement",
        ),
        (
            "[[slider]]\nat = [1.0]\nlimit = 1.0\n[contact]\nedge = 'right'\ngap = 0.1\n",
            "slider[0]",
            "no inertia",
        ),
        (
            "[[slider]]\nat = [1.0]\nlimit = 1.0\n[contact]\nedge = 'right'\ngap = 0.1\nmethod = 'penalty'\n",
            "slider[0]",
            "do not yield",
        ),
        (
            "[[damper]]\nat = [1.0]\nviscosity = 1.0\n[contact]\nedge = 'right'\ngap = 0.1\nstress = 'reaction'\n",
            "damper[0]",
            "no inertia",
        ),
        (
            "[[spring]]\nat = [1.0]\nstiffness = 1.0\n[contact]\nedge = 'right'\ngap = 0.1\n",
            "contact",
            "strains",
        ),
        ("[[iwan]]\nat = [1.0]\nlimit = 1.0\n", "iwan[0]", "all four"),
        (
            "[[iwan]]\nat = [1.0]\ntable = [[1.0, 1.0]]\nbeta = 1.0\n",
            "iwan[0]",
            "table and parameters",
        ),
        (
            "[[iwan]]\nat = [1.0]\nlimit = 1.0\nstiffness = 1.0\nchi = -1.5\nbeta = 0.0\n",
            "iwan[0].chi",
            "between",
        ),
        (
            "[[spring]]\nat = [1.0]\nstiffness = 1.0\ndirection = [1.0, 0.0]\n",
            "spring[0].direction",
            "needs 1 number",
        ),
        (
            "[damping]\nmodal = 0.1\n[contact]\nedge = 'right'\ngap = 0.1\nmethod = 'impact'\nrestitution = 1.0\n",
            "damping",
            "impact law",
        ),
        (
            "[[damper]]\nat = [0.5]\nviscosity = 1.0\n[contact]\nedge = 'right'\ngap = 0.1\nmethod = 'moreau-jean'\nrestitution = 1.0\n",
            "damper[0]",
            "impact law",
        ),
        (
            "[damping]\nmodal = 0.1\n[[load]]\nkind = 'base'\nedge = 'left'\namplitude = 0.1\nomega = 1.0\n",
            "damping.modal",
            "move here",
        ),
        (
            "[damping]\nmodal = 0.1\n[run]\nuntil = 1.0\nintegrator = 'chebyshev'\n",
            "run.integrator",
            "ratios of all modes",
        ),
        ("[damping]\nmodal = -0.1\n", "damping.modal", "negative"),
        ("[damping]\nmodal = 0.1\nratio = 0.1\n", "damping", "exactly one"),
    ];
    for (tables, key, word) in cases {
        // a body whose contact displacement is not all of it
        let text = bar(tables).replace("elements = [1]", "elements = [2]");
        let parsed = Scene::parse(&text, Path::new("bad.toml"));
        let said = match parsed {
            Err(e) => e.to_string(),
            Ok(scene) => match Problem::new(&scene, None) {
                Err(e) => e.to_string(),
                Ok(_) => panic!("accepted: {tables}"),
            },
        };
        assert!(said.contains(key) && said.contains(word), "{tables}: {said}");
    }
}

/// What springs of sliders remember are displacements that no node has: files of bodies with many of them, and with contact, are read again.
#[test]
fn files_are_read_with_what_springs_remember() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["scene.toml", "out.h5"].map(|n| folder.path().join(n).display().to_string());
    let iwan = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [2]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [[iwan]]\nat = [0.5]\nlimit = 0.03\nstiffness = 1.0\nchi = -0.5\nbeta = 0.1\nsliders = 20\n[contact]\nedge = 'right'\ngap = 0.1\n\
                [[load]]\nkind = 'point'\nomega = 1.7\nat = [0.5]\namplitude = 0.01\n[run]\nuntil = 5.0\n";
    std::fs::write(&file, iwan).unwrap();
    json(&["run", &file, "-o", &out]);
    assert_eq!(json(&["inspect", &out])["n_contact"], 22);
    let stored = signorini::store::Stored::read(out.as_ref()).unwrap();
    assert_eq!(stored.n_displacements(), 2 + 21);
}

/// Two masses on a spring, one on a dry floor, that breaks loose at `μ_s F_N` and slides at `μ_d F_N` (SDND106 of code_aster, field by field): no law of this program has two
/// coefficients, so that each piece is computed with the one that rules it. Instants and states in closed form.
#[test]
fn a_block_breaks_loose_and_grips_again_where_it_should() {
    let (m, k, normal, force) = (5.0, 1e4, 1e4, 3000.0);
    let masses = DMatrix::<f64>::identity(2, 2) * m;
    let spring = DMatrix::from_row_slice(2, 2, &[k, -k, -k, k]);
    let place = tempfile::tempdir().unwrap();
    let go = |mu: f64, force: f64, from: &State, until: f64| -> Report {
        let load = match force {
            0.0 => String::new(),
            _ => format!("[[load]]\nkind = 'force'\namplitude = [0.0, {force:?}]\n"),
        };
        let limit = mu * normal;
        let tables = format!("[[slider]]\nrow = 0\nlimit = {limit:?}\n{load}[run]\nuntil = 1.0\n");
        let scene = of_matrices(&place, [&masses, &spring], &tables);
        let system = Problem::new(&scene, None).unwrap().system;
        let options = Options { until, samples: 0, switch_limit: 400.0 };
        event::run(&system, from, &options, &mut Modal::new(&system), &mut Silent).unwrap()
    };
    let rest = State { u: vec![0.0; 2], v: vec![0.0; 2] };
    // it holds until the spring pulls with μ_s F_N: arccos(1 − μ_s F_N/F)/ω
    let held = go(0.3, force, &rest, 0.04);
    let loose = held.switches[0].t;
    assert!((loose - 0.035_124_073_655).abs() < 1e-12, "{loose}");
    let at_break = go(0.3, force, &rest, loose);
    let pulled = go(0.2, force, &at_break.last, 0.2 - loose);
    assert!((pulled.last.u[0] - 2.593_088_362_759).abs() < 1e-10, "{:?}", pulled.last);
    assert!((pulled.last.v[0] - 25.470_972_480_594).abs() < 1e-9, "{:?}", pulled.last);
    assert!((pulled.last.u[1] - 2.637_361_421_008).abs() < 1e-10, "{:?}", pulled.last);
    let free = go(0.2, 0.0, &pulled.last, 0.13);
    let grips = 0.2 + free.switches[0].t;
    assert!((grips - 0.314_923_275_447).abs() < 1e-11, "{grips}");
    let at_grip = go(0.2, 0.0, &pulled.last, free.switches[0].t);
    assert!((at_grip.last.u[0] - 3.955_605_773_498).abs() < 1e-10, "{:?}", at_grip.last);
}

/// A bar whose end rubs, from uniform strain: `w(s + 2L) = −w(s) + F/EA sgn w(s)` where that slips and `w(s)` where it sticks bring the whole bar to rest at t = 6, after
/// friction took 1.98 of 2. The discrete bar comes to it as its fronts do; with 200 elements and a lumped mass within 2e-3 of another program.
#[test]
fn a_bar_with_a_dry_end_comes_to_rest() {
    let (friction, strain) = (0.3f64, 2.0f64);
    // u = f(ct + x) − f(ct − x), w = f′: the end is at ∫w over (t − L, t + L)
    let mut w = 0.5 * strain;
    let ends = [2.0, 4.0, 6.0].map(|t| {
        assert!(w.abs() > 0.5 * friction, "it slips on the way to {t}");
        w = -w + friction * w.signum();
        (t, 2.0 * w)
    });
    assert!(w.abs() < 0.5 * friction, "and sticks then");
    let left = 0.5 * (2.0 * w).powi(2);
    assert!((0.5 * strain * strain - left - 1.98).abs() < 1e-12);
    let at = |n: usize, until: f64| {
        let text = format!(
            "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n\
             [[slider]]\nedge = 'right'\nlimit = {friction}\n[initial]\ndisplacement = ['{strain}*x']\n[run]\nuntil = {until:?}\n"
        );
        let report = run_by(&scene(&text), Integrator::Modal);
        (*report.last.u.last().unwrap(), report.rubbed.unwrap().work())
    };
    let errors =
        |n: usize| ends.map(|(t, u)| (at(n, t).0 - u).abs()).into_iter().fold(0.0, f64::max);
    let [coarse, fine] = [50, 200].map(errors);
    assert!(fine < 0.017 && fine < 0.5 * coarse, "{coarse} {fine}");
    for (until, wanted) in [(2.0, -1.385), (4.0, 0.789), (6.0, -0.1985)] {
        let found = at(200, until).0;
        assert!((found - wanted).abs() < 2e-3, "{until}: {found} {wanted}");
    }
    // what dispersion left moving still creeps for a while
    let work = at(200, 8.0).1;
    assert!((work - 1.98).abs() < 1e-3, "{work}");
}
