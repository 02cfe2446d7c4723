//! Energies of bodies whose supports move, or whose obstacle does: against `½uᵀKu` and `½u̇ᵀMu̇` of all nodes, from matrices formed here, and against the
//! work of the supports' reactions.

use std::convert::Infallible;

use crate::common::problem;
use nalgebra::{DMatrix, DVector};
use signorini::contact::System;
use signorini::event::{self, Observer, Options, Report, Sample};
use signorini::flow::Modal;
use signorini::problem::Problem;
use signorini::simulate::simulate;

/// `K` and `M` of four-node quadrilaterals in plane stress, E = ρ = 1, over all nodes: two by two points of Gauss.
fn matrices(system: &System, nu: f64) -> [DMatrix<f64>; 2] {
    let mesh = &system.body.mesh;
    let n = 2 * mesh.n_nodes();
    let [mut k, mut m] = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
    let c = 1.0 / (1.0 - nu * nu);
    let law =
        nalgebra::Matrix3::new(c, c * nu, 0.0, c * nu, c, 0.0, 0.0, 0.0, 0.5 * c * (1.0 - nu));
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for e in mesh.elements() {
        let x: Vec<[f64; 3]> = e.nodes.iter().map(|&n| mesh.nodes()[n]).collect();
        for (a, b) in corners.map(|(a, b): (f64, f64)| (a / 3f64.sqrt(), b / 3f64.sqrt())) {
            let value = corners.map(|(p, q)| 0.25 * (1.0 + p * a) * (1.0 + q * b));
            let slope = corners.map(|(p, q)| [0.25 * p * (1.0 + q * b), 0.25 * q * (1.0 + p * a)]);
            let jacobian = nalgebra::Matrix2::from_fn(|r, s| {
                (0..4).map(|i| slope[i][r] * x[i][s]).sum::<f64>()
            });
            let (inverse, det) = (jacobian.try_inverse().unwrap(), jacobian.determinant());
            let grad: Vec<[f64; 2]> = slope
                .iter()
                .map(|s| [0, 1].map(|r| inverse[(r, 0)] * s[0] + inverse[(r, 1)] * s[1]))
                .collect();
            let strain = |i: usize, d: usize| match d {
                0 => nalgebra::Vector3::new(grad[i][0], 0.0, grad[i][1]),
                _ => nalgebra::Vector3::new(0.0, grad[i][1], grad[i][0]),
            };
            for (i, j, d, f) in (0..64).map(|z| (z / 16, z / 4 % 4, z / 2 % 2, z % 2)) {
                let place = (2 * e.nodes[i] + d, 2 * e.nodes[j] + f);
                k[place] += det * strain(i, d).dot(&(law * strain(j, f)));
                m[place] += if d == f { det * value[i] * value[j] } else { 0.0 };
            }
        }
    }
    [k, m]
}

fn square(a: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
    x.dot(&(a * x))
}

/// A stored state with its books, and all nodes of it.
struct Row {
    t: f64,
    u: DVector<f64>,
    v: DVector<f64>,
    energies: event::Energies,
    jumps: f64,
}

/// What held nodes do: the displacement along x of those on the left, or its rate.
type Held<'a> = &'a dyn Fn(f64, usize) -> f64;

struct Rows<'a> {
    system: &'a System,
    held: Held<'a>,
    rows: Vec<Row>,
}

impl Observer for Rows<'_> {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let (body, n) = (&self.system.body, self.system.n());
        let nodal = |x: &[f64], order: usize| {
            let mut x = DVector::from_vec(body.dofs.scatter(&x[..n]));
            for node in body.mesh.group_nodes("left") {
                x[2 * node] += (self.held)(s.t, order);
            }
            x
        };
        let (u, v) = (nodal(s.u, 0), nodal(s.v, 1));
        self.rows.push(Row { t: s.t, u, v, energies: s.energies.unwrap(), jumps: s.jumps });
        Ok(())
    }
}

fn plate(contact: &str, rest: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [5, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n{contact}\n{rest}\n"
    )
}

const BASE: &str = "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [0.3, 0.0]\nomega = 1.3\nphase = 0.4\n";
const MOTION: &str = "motion = { amplitude = 0.3, omega = 1.3, phase = 0.4 }\n";

/// The derivative of this order of `0.3 cos(1.3 t + 0.4)`.
fn course(t: f64, order: usize) -> f64 {
    let angle = 1.3 * t + 0.4;
    0.3 * [angle.cos(), -1.3 * angle.sin(), -1.69 * angle.cos()][order]
}

fn states(p: &Problem, text: &str, held: Held) -> (Vec<Row>, Report) {
    let mut rows = Rows { system: &p.system, held, rows: vec![] };
    let report = simulate(&crate::common::scene(text), p, false, &mut rows).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    (rows.rows, report)
}

#[test]
fn energies_are_those_of_the_whole_body() {
    let run = "[run]\nuntil = 12.0\nsamples = 60\n";
    let contact = |more: &str| format!("[contact]\nedge = \"right\"\ngap = 0.2\n{more}");
    let moving = |t: f64, order: usize| -course(t, order);
    let both = |t: f64, order: usize| course(t, order) - course(t, order);
    for damping in ["", "[damping]\nrayleigh = [0.05, 0.02]\n"] {
        for method in [
            "",
            "method = \"penalty\"\n",
            "method = \"mass-redistribution\"\n",
            "inertia = \"constant\"\n",
        ] {
            let cases: [(String, String, Held); 3] = [
                (contact(method), BASE.into(), &course),
                (contact(&format!("{MOTION}{method}")), String::new(), &moving),
                (contact(&format!("{MOTION}{method}")), BASE.into(), &both),
            ];
            for (contact, load, held) in cases {
                let text = plate(&contact, &format!("{load}{damping}{run}"));
                let p = problem(&text);
                let [k, m] = matrices(&p.system, 0.3);
                let (rows, report) = states(&p, &text, held);
                assert!(report.switches.len() > 2);
                let most = |x: &dyn Fn(&Row) -> f64| rows.iter().map(x).fold(0.0, f64::max);
                // the springs of the obstacle have energy of their own
                let is_structure = !method.contains("penalty");
                let scale = most(&|r| r.energies.total())
                    + most(&|r| 0.5 * square(&k, &r.u.map(|u| u + 0.3)));
                let of_mass = method.is_empty() || method.contains("penalty");
                for r in &rows {
                    let own = [0.5 * square(&k, &r.u), 0.5 * square(&m, &r.v)];
                    let e = r.energies;
                    assert!(
                        !is_structure || (e.elastic - own[0]).abs() < 1e-12 * scale,
                        "{text} {e:?} {own:?}"
                    );
                    assert!(
                        !of_mass || (e.kinetic - own[1]).abs() < 1e-12 * scale,
                        "{text} {e:?} {own:?}"
                    );
                    let first = rows[0].energies.total();
                    let rest = e.total() - first - e.external + e.dissipated - r.jumps;
                    assert!(rest.abs() < 1e-11 * scale, "{text}: {rest} at {}", r.t);
                }
                assert!(report.energy_drift_total < 1e-11, "{}", report.energy_drift_total);
                assert_eq!(report.energy_start, rows[0].energies.total());
            }
        }
    }
}

/// Carried along without strain: the energies of a body that its support takes with it so slowly that it does not feel it.
#[test]
fn a_body_that_is_carried_along_has_no_elastic_energy() {
    let still = "[contact]\nedge = \"right\"\ngap = 1000.0";
    let slow = BASE.replace("1.3", "0.05").replace("0.4", "0.0").replace("0.3", "0.5");
    let rest = format!("{slow}[initial]\ndisplacement = [\"0.5\", \"0\"]\n[run]\nuntil = 60.0\n");
    let text = plate(still, &rest);
    let p = problem(&text);
    assert!(p.notes.warnings.is_empty(), "{:?}", p.notes);
    let (rows, report) =
        states(&p, &text, &|t, order| 0.5 * [(0.05 * t).cos(), -0.05 * (0.05 * t).sin()][order]);
    assert!(report.energy_start.abs() < 1e-15, "{}", report.energy_start);
    let elastic = rows.iter().map(|r| r.energies.elastic).fold(0.0, f64::max);
    let kinetic = rows.iter().map(|r| r.energies.kinetic).fold(0.0, f64::max);
    // the whole mass, 0.3, at the speed of its support, but for a wave of the order of (ω/ω₁)²
    assert!(elastic < 1e-6, "{elastic}");
    assert!((kinetic / (0.5 * 0.3 * 0.025f64.powi(2)) - 1.0).abs() < 0.1, "{kinetic}");
    // seen from the obstacle that moves away, a body at rest has the energy of its mass
    let away = plate(&format!("{still}\n{MOTION}"), "[run]\nuntil = 1.0\nsamples = 50\n");
    let p = problem(&away);
    let (rows, _) = states(&p, &away, &|t, order| -course(t, order));
    for r in rows {
        assert!(r.energies.elastic.abs() < 1e-13, "{:?}", r.energies);
        let moved = 0.5 * 0.3 * course(r.t, 1).powi(2);
        assert!((r.energies.kinetic - moved).abs() < 1e-13, "{:?} {moved}", r.energies);
    }
}

/// `external − dissipated` is the work of the support's reaction less what all of `C` dissipates: both by Simpson's rule along the motion of a body without
/// contact.
#[test]
fn the_supports_work_by_their_reactions() {
    for (alpha, beta) in [(0.0, 0.0), (0.05, 0.02)] {
        let damping = format!("[damping]\nrayleigh = [{alpha}, {beta}]\n");
        let damping = if alpha == 0.0 { "" } else { &damping };
        // from a state without strain, so that no fast mode is there that the rule would miss
        let start = format!(
            "[initial]\ndisplacement = [\"{}\", \"0\"]\nvelocity = [\"{}\", \"0\"]\n",
            course(0.0, 0),
            course(0.0, 1)
        );
        let text =
            plate("", &format!("{BASE}{damping}{start}[run]\nuntil = 5.0\nsamples = 2000\n"));
        let p = problem(&text);
        let [k, m] = matrices(&p.system, 0.3);
        let c = alpha * &m + beta * &k;
        let (rows, _) = states(&p, &text, &course);
        let left = p.system.body.mesh.group_nodes("left");
        let held: Vec<usize> = left.iter().flat_map(|n| [2 * n, 2 * n + 1]).collect();
        let free: Vec<usize> = (0..k.nrows()).filter(|i| !held.contains(i)).collect();
        let factor = m.select_rows(&free).select_columns(&free).cholesky().unwrap();
        let power = |r: &Row| {
            let mut a = DVector::zeros(k.nrows());
            left.iter().for_each(|n| a[2 * n] = course(r.t, 2));
            let rest = -(&k * &r.u + &c * &r.v + &m * &a);
            let of_free = factor.solve(&rest.select_rows(&free));
            free.iter().zip(of_free.iter()).for_each(|(&i, x)| a[i] = *x);
            let reaction = &k * &r.u + &c * &r.v + &m * a;
            held.iter().map(|&i| reaction[i] * r.v[i]).sum::<f64>() - square(&c, &r.v)
        };
        let h = 5.0 / 2000.0;
        let mut sum = 0.0;
        for three in rows.windows(3).step_by(2) {
            sum += h / 3.0 * (power(&three[0]) + 4.0 * power(&three[1]) + power(&three[2]));
            let e = three[2].energies;
            assert!((e.external - e.dissipated - sum).abs() < 1e-8, "{e:?} {sum}");
        }
        assert!(sum.abs() > 1e-3, "{sum}");
    }
}

/// Energies of forced orbits and of their series are the largest along the motion.
#[test]
fn orbits_and_series_have_the_energy_of_the_whole_body() {
    use signorini::continuation::Go;
    use signorini::hbm::newton::Settings;
    use signorini::hbm::response::{Summary, Track, Walk, sequential};
    use signorini::hbm::{Form, Reduction};
    use signorini::orbit::search::{Effort, find};
    use signorini::orbit::{Closure, Propagator};
    let text = plate(
        "[contact]\nedge = \"right\"\ngap = 0.4\nmotion = { amplitude = 0.5, omega = 1.3 }",
        "[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [0.1, 0.0]\nomega = 1.3\nphase = 3.4\n\
         [damping]\nratio = 0.05\nmode = 1\n",
    );
    let held = |t: f64, order: usize| {
        let of = |a: f64, phase: f64| {
            a * [(1.3 * t + phase).cos(), -1.3 * (1.3 * t + phase).sin()][order]
        };
        of(0.1, 3.4) - of(0.5, 0.0)
    };
    let p = problem(&text);
    let [k, m] = matrices(&p.system, 0.3);
    let mut r = Reduction::new(p.system.clone(), Form::Acceleration).unwrap();
    let grid: Vec<f64> = (0..=20).map(|k| 1.1 + 0.01 * f64::from(k)).collect();
    let (mut found, mut tracks) = (None, vec![Track::default(); 2]);
    let settings = Settings::default();
    let walk = Walk::new(&[31], &grid, &settings);
    sequential(&mut r, &walk, &mut tracks, |_, p| {
        found = p.solution.ok();
        Go::Continue(())
    })
    .unwrap();
    let s = found.unwrap();
    let (q, dq) = s.q.at(0.0);
    let mut body = Propagator::new(p.system.clone()).unwrap();
    // families have other frequencies than their scene
    body.system.loads_mut().set_frequency(1.0);
    let z = body.frame(&r.state(&q, &dq, 1.3));
    let verdict = find(&mut body, Closure::FORCED, &z, 1.3, &Effort::default()).unwrap();
    let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}"));
    assert!(!orbit.switches.is_empty());
    let mut rows = Rows { system: &p.system, held: &held, rows: vec![] };
    let options = Options { until: orbit.period, samples: 400, switch_limit: 40.0 };
    event::run(&p.system, &orbit.state, &options, &mut Modal::new(&p.system), &mut rows).unwrap();
    let own = |r: &Row| 0.5 * square(&k, &r.u) + 0.5 * square(&m, &r.v);
    let most = rows.rows.iter().map(own).fold(0.0, f64::max);
    for r in &rows.rows {
        assert!((r.energies.total() - own(r)).abs() < 1e-12 * most, "{:?}", r.energies);
    }
    assert!((orbit.energy / most - 1.0).abs() < 0.01, "{} {most}", orbit.energy);
    let energy = Summary::new(&r, &s).unwrap().energy;
    assert!((energy / most - 1.0).abs() < 0.01, "{energy} {most}");
    // that of the series is the largest of it, at ends of phases as well: none of many states has more
    assert!(s.crossings.len() >= 2);
    let mut dense = 0.0f64;
    for (set, (a, b)) in s.phases() {
        for k in 0..=4000 {
            let theta = a + (b - a) * f64::from(k) / 4000.0;
            let (q, dq) = s.q.at(theta);
            dense = dense.max(p.system.energy_in(
                &p.system.phase(set),
                theta / 1.3,
                &r.state(&q, &dq, 1.3),
            ));
        }
    }
    println!(
        "energy of the series over that of dense states, less 1: {:.1e}",
        energy / dense - 1.0
    );
    assert!(energy > dense * (1.0 - 1e-13) && energy < dense * (1.0 + 1e-6), "{energy} {dense}");
}

/// With a mass that leaves the contact points out, gravity acts on that mass: the equilibrium under weight is that of the mesh but for what hangs on the
/// neighbours of these points.
#[test]
fn weight_acts_on_the_redistributed_mass() {
    let far = "[contact]\nedge = \"right\"\ngap = 50.0\n";
    let off = |method: &str, mesh: &str| {
        let load =
            "[[load]]\nkind = \"gravity\"\namplitude = [0.1, 0.0]\n[initial]\nequilibrium = true\n";
        let p = problem(&plate(&format!("{far}{method}"), load).replace("[5, 2]", mesh));
        let [k, m] = matrices(&p.system, 0.3);
        let (u, _) = p.initial.full(&p.system).unwrap();
        let u = p.system.body.dofs.scatter(&u[..p.system.n()]);
        let left = p.system.body.mesh.group_nodes("left");
        let free: Vec<usize> = (0..k.nrows()).filter(|i| !left.contains(&(i / 2))).collect();
        let weight = m * DVector::from_fn(k.nrows(), |i, _| if i % 2 == 0 { 0.1 } else { 0.0 });
        let own = k
            .select_rows(&free)
            .select_columns(&free)
            .lu()
            .solve(&weight.select_rows(&free))
            .unwrap();
        let u: Vec<f64> = free.iter().map(|&i| u[i]).collect();
        crate::common::relative(&u, own.as_slice())
    };
    let redistributed =
        ["[5, 3]", "[10, 6]", "[20, 12]"].map(|n| off("method = \"mass-redistribution\"\n", n));
    println!("weight: {redistributed:?}");
    assert!(redistributed.windows(2).all(|r| r[1] < 0.35 * r[0]), "{redistributed:?}");
    assert!((redistributed[0] - 2.08e-2).abs() < 1e-4, "{redistributed:?}");
    assert!(off("method = \"penalty\"\n", "[5, 3]") < 1e-12);
}
