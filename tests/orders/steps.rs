//! Integrators step by step of one size: Dormand–Prince 5 and 8 on a smooth phase and through switches, Moreau and Jean through impacts.

use std::f64::consts::PI;

use signorini::contact::{Phase, State, System};
use signorini::event::{self, Options, Silent};
use signorini::flow::dop853::DOP853;
use signorini::flow::dopri5::DOPRI5;
use signorini::flow::tableau::Tableau;
use signorini::flow::{Counters, Enclosure, Flow, FlowError, RungeKutta, Tolerances};
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::simulate;

use super::{rms, slope};
use crate::common::{problem, scene, shipped};

/// A Runge–Kutta flow that accepts every step, of size `h` or up to the limit.
struct Fixed<'a> {
    flow: RungeKutta<'a>,
    h: f64,
}

impl<'a> Fixed<'a> {
    fn new(system: &'a System, tableau: &'static Tableau, h: f64) -> Fixed<'a> {
        let mut flow = RungeKutta::new(system, tableau, Tolerances { rtol: 1e200, atol: 1e200 });
        // the step that it would take next: longer than any limit
        let mut memory = flow.memory();
        memory[2] = 1e9;
        flow.recall(&memory);
        Fixed { flow, h }
    }
}

impl Flow for Fixed<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        self.flow.begin(phase, t, y);
    }
    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        let t = self.flow.window().1;
        let end = if t_limit - t < 1.000_001 * self.h { t_limit } else { t + self.h };
        self.flow.advance(phase, end)
    }
    fn cut(&mut self, phase: &Phase, t: f64) {
        self.flow.cut(phase, t);
    }
    fn window(&self) -> (f64, f64) {
        self.flow.window()
    }
    fn end_state(&mut self) -> &[f64] {
        self.flow.end_state()
    }
    fn state(&self, t: f64, y: &mut [f64]) {
        self.flow.state(t, y);
    }
    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        self.flow.enclose(index, a, b)
    }
    fn counters(&self) -> Counters {
        self.flow.counters()
    }
    fn name(&self) -> &'static str {
        self.flow.name()
    }
}

/// The end of a run at `t` with steps of size `until/steps`.
fn end(
    system: &System,
    u: &[f64],
    v: &[f64],
    tableau: &'static Tableau,
    until: f64,
    steps: usize,
) -> (Vec<f64>, Vec<f64>, usize) {
    let mut flow = Fixed::new(system, tableau, until / steps as f64);
    let initial = State { u: u.to_vec(), v: v.to_vec() };
    let options = Options { until, samples: 1, switch_limit: 40.0 };
    let report = event::run(system, &initial, &options, &mut flow, &mut Silent).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    (report.last.u, report.last.v, report.log.switches())
}

const METHODS: [(&Tableau, f64, [usize; 3]); 2] =
    [(&DOPRI5, 5.0, [60, 120, 240]), (&DOP853, 8.0, [24, 36, 54])];

/// One mass on a spring under a harmonic load, which a quadrature rule has to follow, and damping, far from the obstacle:
/// `ü + 2δ u̇ + w² u = p cos Ωt` in closed form.
#[test]
fn smooth_phases_have_the_order_of_the_method() {
    let (delta, w, drive) = (0.05, 0.75f64.sqrt(), 1.7);
    let text = format!(
        "[body]\nkind = 'bar'\nsize = [2.0]\nelements = [2]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [contact]\nedge = 'right'\ngap = 50.0\n[damping]\nrayleigh = [{}, 0.0]\n\
         [[load]]\nkind = 'mode'\nmode = 1\namplitude = 1.0\nomega = {drive}\n[run]\nuntil = 10.0\n",
        2.0 * delta
    );
    let system = &problem(&text).system;
    // M φ_1 with φ_1ᵀ M φ_1 = 1 and M = 4/3: the acceleration it gives is φ_1 = √¾
    let p = 0.75f64.sqrt();
    assert_eq!(system.n_o(), 1);
    let closed = |t: f64| {
        let a = w * w - drive * drive;
        let b = 2.0 * delta * drive;
        let c = p / (a * a + b * b);
        // particular solution and its free companion from u(0) = −1, u̇(0) = 0
        let (us, vs) = (c * a, c * b * drive);
        let (u0, v0) = (-1.0 - us, -vs);
        let wd = (w * w - delta * delta).sqrt();
        let free =
            (-delta * t).exp() * (u0 * (wd * t).cos() + (v0 + delta * u0) / wd * (wd * t).sin());
        free + c * (a * (drive * t).cos() + b * (drive * t).sin())
    };
    for (tableau, order, steps) in METHODS {
        let points: Vec<(f64, f64)> = steps
            .iter()
            .map(|&n| {
                // at twelve ends, as an error passes through zero
                let errors: Vec<f64> = (0..12)
                    .map(|k| {
                        let until = 10.0 + 0.61 * f64::from(k);
                        let (u, _, switches) = end(system, &[-1.0], &[0.0], tableau, until, n);
                        assert_eq!(switches, 0);
                        u[0] - closed(until)
                    })
                    .collect();
                (1.0 / n as f64, rms(&errors))
            })
            .collect();
        let found = slope(&points);
        println!("{}: slope {found:.3}, errors {points:?}", tableau.name);
        assert!((found - order).abs() < 0.15, "{}: {found}", tableau.name);
    }
}

/// Two bar elements, pieced together from two oscillators in closed form: over five switches the order is kept, as a switch is located on dense output of
/// the same order and the step is then made anew up to it. Where in a step switches fall is a matter of chance: the mean over forty-eight amplitudes.
#[test]
fn switches_keep_the_order_of_the_method() {
    let problem = Problem::new(&shipped("oscillator.toml"), None).unwrap();
    let system = &problem.system;
    let until = 10.0;
    for (tableau, order, steps) in METHODS {
        let points: Vec<(f64, f64)> = steps
            .iter()
            .map(|&n| {
                let errors: Vec<f64> = (0..48)
                    .map(|k| {
                        let a = 1.1 + 0.0137 * f64::from(k);
                        let (u, v, switches) = end(system, &[-a], &[0.0], tableau, until, n);
                        let (wanted, times) = oscillator(a, until);
                        assert_eq!(switches, times, "{a}");
                        (u[0] - wanted.0).hypot(v[0] - wanted.1)
                    })
                    .collect();
                (until / n as f64, rms(&errors))
            })
            .collect();
        let found = slope(&points);
        println!("{}: slope {found:.3}, errors {points:?}", tableau.name);
        assert!((found - order).abs() < 0.25, "{}: {found}", tableau.name);
    }
}

/// State at `t` from rest at `−a`, and the number of switches: open `ω² = ¾`; closed `ω² = 3` about `g/2`.
pub fn oscillator(a: f64, t: f64) -> ((f64, f64), usize) {
    let g = 0.5f64;
    let (open, closed) = (0.75f64.sqrt(), 3f64.sqrt());
    let t1 = (-g / a).acos() / open;
    let v = open * (a * a - g * g).sqrt();
    let (b, t2) = ((0.5 * g).hypot(v / closed), (v / closed).atan2(0.5 * g) / closed);
    let period = 2.0 * (t1 + t2);
    let (whole, s) = ((t / period).floor(), t % period);
    let passed = [t1, t1 + 2.0 * t2].iter().filter(|x| **x <= s).count();
    let state = match passed {
        1 => {
            let s = s - t1 - t2;
            (0.5 * g + b * (closed * s).cos(), -b * closed * (closed * s).sin())
        }
        _ => {
            let s = if passed == 0 { s } else { s - period };
            (-a * (open * s).cos(), a * open * (open * s).sin())
        }
    };
    (state, 2 * whole as usize + passed)
}

/// One mass `ü + w² u = 0` that a wall throws back at `u = g` without loss: a cosine whose part beyond the wall is left out.
#[test]
fn moreau_and_jean_are_of_the_first_order() {
    let points: Vec<(f64, f64)> = [4e-3, 2e-3, 1e-3, 5e-4]
        .into_iter()
        .map(|h| {
            let errors: Vec<f64> = (0..24)
                .map(|k| {
                    let a = 1.31 + 0.0217 * f64::from(k);
                    let (u, v) = run(&thrown_back(a, h));
                    let (w, until) = (3f64.sqrt(), 9.0);
                    let t1 = (PI - (0.5 / a).acos()) / w;
                    let s = until % (2.0 * t1);
                    let s = if s > t1 { s - 2.0 * t1 } else { s };
                    (u + a * (w * s).cos()).hypot(v / w - a * (w * s).sin())
                })
                .collect();
            (h, rms(&errors))
        })
        .collect();
    let found = slope(&points);
    println!("moreau-jean: slope {found:.3}, errors {points:?}");
    assert!((found - 1.0).abs() < 0.1, "{found}");
}

/// One bar element of unit length: mass 1/3, stiffness 1, `w² = 3`.
fn thrown_back(a: f64, h: f64) -> Scene {
    scene(&format!(
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [contact]\nedge = 'right'\ngap = 0.5\nmethod = 'moreau-jean'\nrestitution = 1\nstep = {h}\n\
         [initial]\ndisplacement = ['-{a}*x']\n[run]\nuntil = 9.0\n"
    ))
}

fn run(scene: &Scene) -> (f64, f64) {
    let problem = Problem::new(scene, None).unwrap();
    let report = simulate(scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    (report.last.u[0], report.last.v[0])
}
