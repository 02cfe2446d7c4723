//! diffsol with root finding on the same matrices: the peer of `signorini precision --peer diffsol`.
//!
//! Reads a problem written by signorini (argument 1: little-endian doubles, see [`Problem::read`]) and prints one JSON object a line: method, rtol, wall_s
//! (median of argument 2 repetitions), nfev, u, v, switches. A right-hand side is one product with the dense `M_α⁻¹K_α` of the phase, kept for every
//! active set; roots are those of the gaps of free nodes and of the pressures of nodes in contact. diffsol finds roots of either direction, and cannot go on
//! behind one: what is a rounding error below zero when a phase begins is lifted by [`LIFT`], and it begins anew behind a rising root.

use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;
use std::time::Instant;

use diffsol::{
    MatrixCommon, NalgebraMat, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverProblem, OdeSolverStopReason, Vector,
};
use nalgebra::{DMatrix, DVector};

type Failure = Box<dyn std::error::Error>;
type M = NalgebraMat<f64>;

/// A monitor this close to zero at the start of a phase is one that has just switched.
const LIFT: f64 = 1e-12;

struct Problem {
    n_o: usize,
    n_c: usize,
    until: f64,
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    n_cc: DMatrix<f64>,
    n_co: DMatrix<f64>,
    gap: DVector<f64>,
    force: DVector<f64>,
    u: Vec<f64>,
    v: Vec<f64>,
    active: Vec<bool>,
}

impl Problem {
    /// `n_O, n_C, until`, then `M`, `K`, `N_C`, `N_O`, gaps, forces, `u_O`, `u̇_O`, active set; matrices row by row.
    fn read(name: &str) -> Result<Problem, Failure> {
        let bytes = std::fs::read(name)?;
        let mut all = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or_default()));
        let mut take = |n: usize| -> Result<Vec<f64>, Failure> {
            let x: Vec<f64> = all.by_ref().take(n).collect();
            if x.len() == n { Ok(x) } else { Err("the problem is cut short".into()) }
        };
        let head = take(3)?;
        let (o, c) = (head[0] as usize, head[1] as usize);
        let n = o + c;
        Ok(Problem {
            n_o: o,
            n_c: c,
            until: head[2],
            mass: DMatrix::from_row_slice(n, n, &take(n * n)?),
            stiffness: DMatrix::from_row_slice(n, n, &take(n * n)?),
            n_cc: DMatrix::from_row_slice(c, c, &take(c * c)?),
            n_co: DMatrix::from_row_slice(c, o, &take(c * o)?),
            gap: DVector::from_vec(take(c)?),
            force: DVector::from_vec(take(n)?),
            u: take(o)?,
            v: take(o)?,
            active: take(c)?.into_iter().map(|a| a != 0.0).collect(),
        })
    }

    fn phase(&self, active: &[bool]) -> Result<Phase, Failure> {
        let (o, c) = (self.n_o, self.n_c);
        let open: Vec<usize> = (0..c).filter(|&i| !active[i]).collect();
        let mut star = DMatrix::<f64>::zeros(o + c, o);
        star.view_mut((0, 0), (o, o)).fill_with_identity();
        let mut d = DVector::<f64>::zeros(o + c);
        (0..c).filter(|&i| active[i]).for_each(|i| d[o + i] = self.gap[i]);
        // u_f = N_ff⁻¹ (−N_fO u_O − N_fc g_c)
        let closed = &self.n_cc * d.rows(o, c);
        let block = DMatrix::from_fn(open.len(), open.len(), |a, b| self.n_cc[(open[a], open[b])]);
        let of_u = DMatrix::from_fn(open.len(), o, |a, j| -self.n_co[(open[a], j)]);
        let constant = DVector::from_fn(open.len(), |a, _| -closed[open[a]]);
        let lu = block.lu();
        let (of_u, constant) = match open.is_empty() {
            true => (of_u, constant),
            false => (lu.solve(&of_u).ok_or("N_ff is singular")?, lu.solve(&constant).ok_or("N_ff is singular")?),
        };
        for (a, &i) in open.iter().enumerate() {
            star.row_mut(o + i).copy_from(&of_u.row(a));
            d[o + i] = constant[a];
        }
        let mass = (star.transpose() * &self.mass * &star).cholesky().ok_or("the mass is singular")?;
        let stiffness = mass.solve(&(star.transpose() * &self.stiffness * &star));
        let force = mass.solve(&(star.transpose() * (&self.force - &self.stiffness * &d)));
        // gaps of free nodes, pressures of nodes in contact
        let (of_c, d_c) = (star.rows(o, c), d.rows(o, c));
        let pressure = -(&self.n_cc * of_c) - &self.n_co;
        let constant = -(&self.n_cc * d_c);
        let rows = DMatrix::from_fn(c, o, |i, j| if active[i] { pressure[(i, j)] } else { -of_c[(i, j)] });
        let offset = DVector::from_fn(c, |i, _| if active[i] { constant[i] } else { self.gap[i] - d_c[i] });
        Ok(Phase { stiffness, force, rows: rows.transpose(), offset })
    }
}

/// `ü = f − S u`, monitors `R u + h`; matrices by columns (of `R` the rows).
struct Phase {
    stiffness: DMatrix<f64>,
    force: DVector<f64>,
    rows: DMatrix<f64>,
    offset: DVector<f64>,
}

impl Phase {
    fn rhs(&self, y: &[f64], out: &mut [f64]) {
        let n = self.force.len();
        let (u, v) = y.split_at(n);
        let (of_u, of_v) = out.split_at_mut(n);
        of_u.copy_from_slice(v);
        of_v.copy_from_slice(self.force.as_slice());
        for (s, x) in self.stiffness.as_slice().chunks_exact(n).zip(u) {
            of_v.iter_mut().zip(s).for_each(|(o, s)| *o -= s * x);
        }
    }

    fn monitor(&self, i: usize, x: &[f64]) -> f64 {
        let n = self.force.len();
        self.rows.as_slice()[i * n..(i + 1) * n].iter().zip(x).map(|(r, x)| r * x).sum()
    }

    /// What is added to the monitors of a phase that begins at a state.
    fn lifts(&self, y: &[f64]) -> Vec<f64> {
        let value = |i: usize| self.offset[i] + self.monitor(i, y);
        (0..self.offset.len()).map(|i| if value(i).abs() < LIFT { 2.0 * LIFT } else { 0.0 }).collect()
    }

    fn monitors(&self, lifts: &[f64], y: &[f64], out: &mut [f64]) {
        for (i, o) in out.iter_mut().enumerate() {
            *o = self.offset[i] + lifts[i] + self.monitor(i, y);
        }
    }
}

/// The phases that were needed so far.
struct Body<'p> {
    problem: &'p Problem,
    phases: HashMap<Vec<bool>, Rc<Phase>>,
    calls: Rc<Cell<u64>>,
}

impl Body<'_> {
    fn phase(&mut self, active: &[bool]) -> Result<Rc<Phase>, Failure> {
        if let Some(known) = self.phases.get(active) {
            return Ok(known.clone());
        }
        let phase = Rc::new(self.problem.phase(active)?);
        self.phases.insert(active.to_vec(), phase.clone());
        Ok(phase)
    }

    /// The last state and the times of the switches.
    fn run(&mut self, rtol: f64) -> Result<(Vec<f64>, Vec<f64>), Failure> {
        let p = self.problem;
        let (mut t, mut y) = (0.0, [&p.u[..], &p.v].concat());
        let mut active = p.active.clone();
        let mut times = vec![];
        self.calls.set(0);
        while t < p.until {
            let phase = self.phase(&active)?;
            let (of_rhs, of_roots, calls, start) = (phase.clone(), phase.clone(), self.calls.clone(), y.clone());
            let lifts = phase.lifts(&y);
            let problem = OdeBuilder::<M>::new()
                .t0(t)
                .rtol(rtol)
                .atol([1e-3 * rtol])
                .h0(1e-4)
                .rhs(move |y: &[f64], _: &[f64], _: f64, out: &mut [f64]| {
                    calls.set(calls.get() + 1);
                    of_rhs.rhs(y, out);
                })
                .init(move |_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&start), y.len())
                .root(move |y: &[f64], _: &[f64], _: f64, out: &mut [f64]| of_roots.monitors(&lifts, y, out), p.n_c)
                .build()?;
            let (reached, state, found) = flow(&problem, p.until, &phase)?;
            (t, y) = (reached, state);
            if let Some(node) = found {
                times.push(t);
                active[node] = !active[node];
            }
        }
        Ok((y, times))
    }
}

/// Time and state where the phase ends, and the node that ends it.
fn flow<E>(problem: &OdeSolverProblem<E>, until: f64, phase: &Phase) -> Result<(f64, Vec<f64>, Option<usize>), Failure>
where
    E: OdeEquations<M = M, V = <M as MatrixCommon>::V, T = f64, C = <M as MatrixCommon>::C>,
{
    let mut solver = problem.tsit45()?;
    solver.set_stop_time(until)?;
    loop {
        match solver.step()? {
            OdeSolverStopReason::InternalTimestep => {}
            OdeSolverStopReason::TstopReached => {
                return Ok((until, solver.state().y.clone_as_vec(), None));
            }
            OdeSolverStopReason::RootFound(t, node) => {
                let y = solver.interpolate(t)?.clone_as_vec();
                let falls = phase.monitor(node, &y[phase.force.len()..]) < 0.0;
                return Ok((t, y, falls.then_some(node)));
            }
        }
    }
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(repeats)) = (arguments.next(), arguments.next()) else {
        return Err("usage: diffsol_peer PROBLEM REPEATS".into());
    };
    let (problem, repeats) = (Problem::read(&file)?, repeats.parse::<usize>()?);
    for rtol in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
        let mut body = Body { problem: &problem, phases: HashMap::new(), calls: Rc::default() };
        // the phases, which are not counted
        let (mut y, mut times) = body.run(rtol)?;
        let mut walls = vec![];
        for _ in 0..repeats.max(1) {
            let start = Instant::now();
            (y, times) = body.run(rtol)?;
            walls.push(start.elapsed().as_secs_f64());
        }
        walls.sort_by(f64::total_cmp);
        let (u, v) = y.split_at(problem.n_o);
        println!(
            "{{\"method\": \"Tsit45\", \"rtol\": {rtol:e}, \"wall_s\": {:e}, \"nfev\": {}, \"u\": {u:?}, \"v\": {v:?}, \"switches\": {times:?}}}",
            walls[walls.len() / 2],
            body.calls.get(),
        );
    }
    Ok(())
}
