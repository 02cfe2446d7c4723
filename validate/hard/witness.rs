//! A witness for the search of switches: the nodal boundary equations integrated a second time, slowly and plainly.
//!
//! It takes `M`, `K`, `N_C`, `N_O` and the gaps, and no other code of the program. For each of the `2^{n_C}` active sets the contact
//! displacements are eliminated, `u_C = A_α u_O + d_α`, and with `A* = [I; A_α]`, `d* = [0; d_α]`
//!
//! ```text
//! A*ᵀM A* ü_O + A*ᵀK A* u_O = −A*ᵀK d*          h_i = g_i − u_C,i  (free)   or   −(N_C u_C + N_O u_O)_i  (in contact)
//! ```
//!
//! is diagonalised once. Every monitor is `h(t) = h̄ + Σ_k r_k (a_k cos ω_k t + b_k sin ω_k t)`, so
//! `|ḧ| ≤ B := Σ_k |r_k| ω_k² √(a_k² + b_k²)` at all times, and from a time with `h ≥ 0` and `ḣ` known *no* root lies before the positive
//! root `s` of `h + ḣ s − ½ B s² = 0`. The safe march goes on by that `s`, again and again: it cannot step over a root, and
//! where its steps shrink to nothing there is one.
//!
//! At a root all active sets are tried: the next one is that in which every monitor is positive a little later, `h > 0`, or `h = 0` and
//! `ḣ > 0` (both in the new set; the complementarity problem and its rates at once, by enumeration). Where these signs do not
//! stand out from rounding errors, or the root is almost a tangency, the motion grazes: the witness says so and stops.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use signorini::contact::System;

use super::random;

/// Steps of the march below this fraction of the period have come to a root.
const TINY: f64 = 1e-12;
/// Monitors below this fraction of their terms are zero.
const ZERO: f64 = 2e-14;
/// The relative rounding errors of a motion are taken to be at least this.
const LEAST: f64 = 1e-13;
/// And those of a monitor, over its terms, this.
const FRESH: f64 = 8.0 * f64::EPSILON;
/// Rates below this fraction of their terms decide nothing.
const FLAT: f64 = 1e-6;
/// Steps of the march after which a motion counts as grazing.
const PATIENCE: usize = 1_000_000;

/// A node that came into contact or left it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Time.
    pub t: f64,
    /// Contact node.
    pub contact: usize,
    /// Into contact, or out of it.
    pub closes: bool,
}

/// What became of an initial state.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// All switches.
    pub changes: Vec<Change>,
    /// The time at which it ends.
    pub end: f64,
    /// Displacements there.
    pub u: Vec<f64>,
    /// Velocities there.
    pub v: Vec<f64>,
    /// Largest displacement and velocity at any of its switches.
    pub largest: (f64, f64),
    /// It ends in a grazing, beyond which nothing is known.
    pub grazes: bool,
}

/// All phases of a small body.
pub struct Witness {
    phases: Vec<Phase>,
    /// Longest natural period of the open body.
    pub period: f64,
    /// Relative rounding errors of a motion: those of its slowest frequency, `ε (ω_max/ω_min)²`, or 10⁻¹³.
    pub rounding: f64,
}

/// One active set: bit `i` of its number says that node `i` is in contact.
pub struct Phase {
    /// Natural frequencies, ascending.
    pub omega: Vec<f64>,
    /// Mode shapes `Φ`, `Φᵀ M_α Φ = I`.
    pub shapes: DMatrix<f64>,
    /// `Φᵀ M_α`
    to_modes: DMatrix<f64>,
    /// Equilibrium.
    pub rest: DVector<f64>,
    /// Monitors `constants + rows · u_O`.
    constants: DVector<f64>,
    rows: DMatrix<f64>,
    row_sums: Vec<f64>,
    /// The same over modal coordinates from the equilibrium.
    pub at_rest: DVector<f64>,
    modal_rows: DMatrix<f64>,
}

/// Whether a set is the next one.
enum Next {
    Yes,
    No,
    Undecided,
}

impl Witness {
    /// All active sets of a body.
    pub fn new(system: &System) -> Result<Witness, String> {
        let (n, n_o) = (system.n(), system.n_o());
        let (mut mass, mut stiffness) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        system.body.mass.triplets().for_each(|(i, j, x)| mass[(i, j)] = x);
        system.body.stiffness.triplets().for_each(|(i, j, x)| stiffness[(i, j)] = x);
        let mut of_others = DMatrix::zeros(system.n_contact(), n_o);
        system.conditions().n_o.triplets().for_each(|(i, j, x)| of_others[(i, j)] = x);
        let phases: Vec<Phase> = (0..1usize << system.n_contact())
            .map(|set| {
                Phase::new(
                    set,
                    &mass,
                    &stiffness,
                    &system.conditions().n_c.dense(),
                    &of_others,
                    &system.conditions().gap,
                )
            })
            .collect::<Option<_>>()
            .ok_or("an active set has a singular matrix")?;
        let period = TAU / phases[0].omega[0];
        let fastest = phases.iter().flat_map(|p| &p.omega).fold(0.0f64, |m, w| m.max(*w));
        let rounding = f64::EPSILON * (fastest / phases[0].omega[0]).powi(2);
        Ok(Witness { phases, period, rounding: rounding.max(LEAST) })
    }

    /// The set whose equilibrium lies strictly inside it, if there is one; else the open set.
    pub fn resting(&self) -> &Phase {
        let inside = |p: &&Phase| {
            let size = p.at_rest.amax();
            size > 0.0 && p.at_rest.iter().all(|h| *h > 1e-6 * size)
        };
        self.phases.iter().find(inside).unwrap_or(&self.phases[0])
    }

    /// The motion from `(u, v)` at `t = 0` until a time, or half-way to the switch that would be one too many.
    pub fn integrate(&self, u: &[f64], v: &[f64], until: f64, most: usize) -> Course {
        self.follow(u, v, (until, most), || 0.0)
    }

    /// The same with random errors of the size of rounding errors: in the initial state, and in every monitor that has just switched.
    pub fn disturbed(&self, u: &[f64], v: &[f64], until: f64, seed: u64) -> Course {
        let mut count = seed << 20;
        let mut noise = |size: f64, n: usize| {
            count += 1;
            random(n, count).into_iter().map(move |r| size * r)
        };
        let mut moved = |x: &[f64]| -> Vec<f64> {
            let size = self.rounding * x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            x.iter().zip(noise(size, x.len())).map(|(x, r)| x + r).collect()
        };
        let (u, v) = (moved(u), moved(v));
        self.follow(&u, &v, (until, usize::MAX), || noise(FRESH, 1).sum())
    }

    fn follow(
        &self,
        u: &[f64],
        v: &[f64],
        (until, most): (f64, usize),
        mut error: impl FnMut() -> f64,
    ) -> Course {
        let (mut u, mut v) = (DVector::from_column_slice(u), DVector::from_column_slice(v));
        let mut largest = (u.amax(), v.amax());
        let (mut t, mut changes, mut patience) = (0.0, vec![], PATIENCE);
        let course = |changes, end, u: DVector<f64>, v: DVector<f64>, largest, grazes| {
            let (u, v) = (u.as_slice().to_vec(), v.as_slice().to_vec());
            Course { changes, end, u, v, largest, grazes }
        };
        let Some(mut set) = self.next(&u, &v, largest) else {
            return course(changes, t, u, v, largest, true);
        };
        let mut switched = vec![];
        loop {
            let mut motion = Motion::from_state(&self.phases[set], &u, &v);
            for contact in switched.drain(..) {
                motion
                    .starts_from_zero(contact, error() * self.phases[set].size(contact, largest.0));
            }
            let (length, root) = motion.march(until - t, TINY * self.period, &mut patience);
            // not between two switches that are almost one
            if changes.len() >= most && length > 1e-3 * self.period {
                (u, v) = motion.state(0.5 * length);
                return course(changes, t + 0.5 * length, u, v, largest, false);
            }
            t += length;
            (u, v) = motion.state(length);
            match root {
                Root::None => return course(changes, until, u, v, largest, false),
                Root::Grazing => return course(changes, t, u, v, largest, true),
                Root::Crossing => {}
            }
            largest = (largest.0.max(u.amax()), largest.1.max(v.amax()));
            let next = self.next(&u, &v, largest).filter(|next| *next != set);
            let Some(next) = next else {
                return course(changes, t, u, v, largest, true);
            };
            for contact in (0..).take_while(|i| self.phases.len() >> i > 1) {
                if (set ^ next) >> contact & 1 == 1 {
                    changes.push(Change { t, contact, closes: next >> contact & 1 == 1 });
                    switched.push(contact);
                }
            }
            set = next;
        }
    }

    /// The set to follow from a state: one, or the state is degenerate.
    fn next(&self, u: &DVector<f64>, v: &DVector<f64>, largest: (f64, f64)) -> Option<usize> {
        let mut found = None;
        for (set, phase) in self.phases.iter().enumerate() {
            match phase.follows(u, v, largest) {
                Next::No => {}
                Next::Yes if found.is_none() => found = Some(set),
                Next::Yes | Next::Undecided => return None,
            }
        }
        found
    }
}

impl Phase {
    fn new(
        set: usize,
        mass: &DMatrix<f64>,
        stiffness: &DMatrix<f64>,
        n_c: &DMatrix<f64>,
        n_o: &DMatrix<f64>,
        gap: &[f64],
    ) -> Option<Phase> {
        let (size, others) = n_o.shape();
        let contact = |i: usize| set >> i & 1 == 1;
        let gap = DVector::from_column_slice(gap);
        // a node in contact: u_C,i = g_i; a free one: (N_C u_C + N_O u_O)_i = 0
        let system = DMatrix::from_fn(size, size, |i, j| match contact(i) {
            true => f64::from(u8::from(i == j)),
            false => n_c[(i, j)],
        });
        let slope = DMatrix::from_fn(size, others, |i, j| match contact(i) {
            true => 0.0,
            false => -n_o[(i, j)],
        });
        let value = DVector::from_fn(size, |i, _| if contact(i) { gap[i] } else { 0.0 });
        let system = system.lu();
        let (a, d) = (system.solve(&slope)?, system.solve(&value)?);

        let mut full = DMatrix::identity(others + size, others);
        full.rows_mut(others, size).copy_from(&a);
        let mut shift = DVector::zeros(others + size);
        shift.rows_mut(others, size).copy_from(&d);
        let symmetric = |m: DMatrix<f64>| 0.5 * (&m + m.transpose());
        let m = symmetric(full.transpose() * mass * &full);
        let k = symmetric(full.transpose() * stiffness * &full);
        let force = -(full.transpose() * (stiffness * shift));

        // with M_α = L Lᵀ: L⁻¹ K_α L⁻ᵀ = Q Ω² Qᵀ, Φ = L⁻ᵀ Q
        let rest = k.clone().cholesky()?.solve(&force);
        let l = m.cholesky()?.l();
        let half = l.solve_lower_triangular(&k)?.transpose();
        let eigen = symmetric(l.solve_lower_triangular(&half)?).symmetric_eigen();
        let mut order: Vec<usize> = (0..others).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let omega: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k].sqrt()).collect();
        let q = eigen.eigenvectors.select_columns(&order);
        let shapes = l.tr_solve_lower_triangular(&q)?;
        let to_modes = q.transpose() * l.transpose();
        if !omega.iter().all(|w| *w > 0.0) {
            return None;
        }

        let gaps = (&gap - &d, -&a);
        let pressures = (-(n_c * &d), -(n_c * &a + n_o));
        let of = |i: usize| if contact(i) { &pressures } else { &gaps };
        let constants = DVector::from_fn(size, |i, _| of(i).0[i]);
        let rows = DMatrix::from_fn(size, others, |i, j| of(i).1[(i, j)]);
        Some(Phase {
            at_rest: &constants + &rows * &rest,
            row_sums: rows.row_iter().map(|r| r.iter().map(|x| x.abs()).sum()).collect(),
            modal_rows: &rows * &shapes,
            omega,
            shapes,
            to_modes,
            rest,
            constants,
            rows,
        })
    }

    /// How far a mode moves the monitors.
    pub fn leverage(&self, mode: usize) -> f64 {
        self.modal_rows.column(mode).amax()
    }

    /// Whether a mode moves the first and the last contact node alike.
    pub fn is_even(&self, mode: usize) -> bool {
        let column = self.modal_rows.column(mode);
        let (first, last) = (column[0], column[column.len() - 1]);
        (first - last).abs() <= 1e-6 * column.amax()
    }

    /// Size of the terms of a monitor at displacements up to `largest`.
    fn size(&self, i: usize, largest: f64) -> f64 {
        self.constants[i].abs() + self.row_sums[i] * largest
    }

    /// Whether all monitors are positive a little later; `largest` displacement and velocity give the size of rounding errors.
    fn follows(&self, u: &DVector<f64>, v: &DVector<f64>, largest: (f64, f64)) -> Next {
        let mut next = Next::Yes;
        for (i, &constant) in self.constants.iter().enumerate() {
            let (h, rate) = (constant + self.rows.row(i).tr_dot(u), self.rows.row(i).tr_dot(v));
            let zero = ZERO * self.size(i, largest.0);
            let flat = FLAT * self.row_sums[i] * largest.1;
            if h > zero {
                continue;
            }
            if h < -zero || rate < -flat {
                return Next::No;
            }
            if rate <= flat {
                next = Next::Undecided;
            }
        }
        next
    }
}

/// What ended a march.
enum Root {
    None,
    Crossing,
    Grazing,
}

/// A motion in one phase.
pub struct Motion<'a> {
    phase: &'a Phase,
    /// Constant parts of the monitors.
    at_rest: DVector<f64>,
    /// Amplitudes of `cos ω_k t` and `sin ω_k t`.
    amplitudes: Vec<(f64, f64)>,
}

impl<'a> Motion<'a> {
    /// From amplitudes about the equilibrium, lowest numbers first; modes without any are at rest.
    pub fn new(phase: &'a Phase, amplitudes: Vec<(f64, f64)>) -> Self {
        Motion { phase, at_rest: phase.at_rest.clone(), amplitudes }
    }

    fn from_state(phase: &'a Phase, u: &DVector<f64>, v: &DVector<f64>) -> Self {
        let (q, p) = (&phase.to_modes * (u - &phase.rest), &phase.to_modes * v);
        let pairs = q.iter().zip(p.iter()).zip(&phase.omega);
        Self::new(phase, pairs.map(|((q, p), w)| (*q, p / w)).collect())
    }

    /// A monitor that has just switched is zero: what rounding makes of it is taken off, since in a brief contact little errors weigh
    /// much. Another error may be put in its place.
    fn starts_from_zero(&mut self, contact: usize, error: f64) {
        let mut now = vec![(0.0, 0.0); self.at_rest.len()];
        self.monitors(0.0, &mut now);
        self.at_rest[contact] += error - now[contact].0;
    }

    /// Displacements and velocities at `t`.
    pub fn state(&self, t: f64) -> (DVector<f64>, DVector<f64>) {
        let (mut u, mut v) = (self.phase.rest.clone(), DVector::zeros(self.phase.rest.len()));
        for (k, (a, b)) in self.amplitudes.iter().enumerate() {
            let w = self.phase.omega[k];
            let (sin, cos) = (w * t).sin_cos();
            u.axpy(a * cos + b * sin, &self.phase.shapes.column(k), 1.0);
            v.axpy(w * (b * cos - a * sin), &self.phase.shapes.column(k), 1.0);
        }
        (u, v)
    }

    /// Value and rate of every monitor at `t`.
    pub fn monitors(&self, t: f64, out: &mut [(f64, f64)]) {
        out.iter_mut().zip(&self.at_rest).for_each(|(o, h)| *o = (*h, 0.0));
        for (k, (a, b)) in self.amplitudes.iter().enumerate() {
            let w = self.phase.omega[k];
            let (sin, cos) = (w * t).sin_cos();
            let (x, y) = (a * cos + b * sin, w * (b * cos - a * sin));
            for (o, r) in out.iter_mut().zip(self.phase.modal_rows.column(k).iter()) {
                o.0 += r * x;
                o.1 += r * y;
            }
        }
    }

    /// Bounds of `|h^(order)|` for every monitor, but for the constant part.
    fn bounds(&self, order: i32) -> Vec<f64> {
        let mut bounds = vec![0.0; self.at_rest.len()];
        for (k, (a, b)) in self.amplitudes.iter().enumerate() {
            let size = self.phase.omega[k].powi(order) * a.hypot(*b);
            let column = self.phase.modal_rows.column(k);
            bounds.iter_mut().zip(column.iter()).for_each(|(s, r)| *s += r.abs() * size);
        }
        bounds
    }

    /// The safe march to the first root or to the end.
    fn march(&self, end: f64, tiny: f64, patience: &mut usize) -> (f64, Root) {
        let (second, first) = (self.bounds(2), self.bounds(1));
        let mut now = vec![(0.0, 0.0); second.len()];
        let mut t = 0.0;
        loop {
            self.monitors(t, &mut now);
            let (mut step, mut nearest) = (f64::INFINITY, 0);
            for (i, &(h, rate)) in now.iter().enumerate() {
                let s = safe_step(h, rate, second[i]);
                if s < step {
                    (step, nearest) = (s, i);
                }
            }
            if t + step >= end {
                return (end, Root::None);
            }
            t += step;
            if *patience == 0 {
                return (t, Root::Grazing);
            }
            *patience -= 1;
            if step <= tiny {
                let crosses = now[nearest].1 < -FLAT * first[nearest];
                return (t, if crosses { Root::Crossing } else { Root::Grazing });
            }
        }
    }
}

/// No root of a function that is `h ≥ 0` with slope `rate` now, and whose second derivative stays within ±`bound`, comes sooner:
/// the positive root of `h + rate s − ½ bound s²`.
fn safe_step(h: f64, rate: f64, bound: f64) -> f64 {
    if bound == 0.0 {
        return f64::INFINITY;
    }
    // a monitor that has just switched is zero to rounding
    let h = h.max(0.0);
    let root = (rate * rate + 2.0 * bound * h).sqrt();
    if rate > 0.0 {
        (rate + root) / bound
    } else if h > 0.0 {
        2.0 * h / (root - rate)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::scene;
    use super::super::closed_form;
    use super::*;
    use signorini::problem::Problem;

    #[test]
    fn a_safe_step_ends_at_the_root_of_the_worst_parabola() {
        for (h, rate, bound) in [(1.0, 0.3, 2.0), (1e-12, -0.5, 3.0), (0.0, 0.1, 5.0)] {
            let s = safe_step(h, rate, bound);
            assert!((h + rate * s - 0.5 * bound * s * s).abs() < 1e-14 * (1.0 + bound));
        }
        assert_eq!(safe_step(0.0, -1.0, 1.0), 0.0);
        assert_eq!(safe_step(1.0, 0.0, 0.0), f64::INFINITY);
    }

    #[test]
    fn one_degree_of_freedom_goes_as_in_closed_form() {
        let problem = Problem::new(&scene(include_str!("grazing.toml"), None).unwrap(), None);
        let problem = problem.unwrap();
        let witness = Witness::new(&problem.system).unwrap();
        let course = witness.integrate(&[-1.0], &[0.0], 40.0, usize::MAX);
        let ((u, v), switches) = closed_form(1.0, 40.0);
        assert!(!course.grazes && course.changes.len() == switches.len());
        for (change, t) in course.changes.iter().zip(&switches) {
            assert!((change.t - t).abs() < 1e-11, "{} {t}", change.t);
        }
        assert!((course.u[0] - u).abs() < 1e-10 && (course.v[0] - v).abs() < 1e-10);
    }

    #[test]
    fn a_little_more_than_a_touch_makes_two_switches() {
        let problem = Problem::new(&scene(include_str!("grazing.toml"), None).unwrap(), None);
        let problem = problem.unwrap();
        let witness = Witness::new(&problem.system).unwrap();
        let course = |excess: f64| witness.integrate(&[-0.5 * (1.0 + excess)], &[0.0], 5.0, 9);
        assert!(course(0.0).changes.is_empty());
        assert!(!course(1e-9).grazes && course(1e-9).changes.len() == 2);
        assert!(!course(-1e-9).grazes && course(-1e-9).changes.is_empty());
    }
}
