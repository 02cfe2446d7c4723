//! The time-stepping scheme of Moreau and Jean: contact on the level of velocities, impulses over steps, no events (Moreau 1988, Jean 1999).
//!
//! With `w = g − n q`, a step `h` and `θ = ½`,
//!
//! ```text
//! W = M + hθC + h²θ²K
//! v_f = v_k + W⁻¹(−hC v_k − hK q_k − h²θK v_k + h(θ f_{k+1} + (1−θ) f_k))
//! 0 ≤ ẇ_{k+1} + e ẇ_k  ⟂  P ≥ 0      on the points with w_k + γ h ẇ_k ≤ 0,      v_{k+1} = v_f − W⁻¹nᵀP
//! q_{k+1} = q_k + h (θ v_{k+1} + (1−θ) v_k)
//! ```
//!
//! Where points touch is not looked for: a point enters the obstacle by `O(h v)` and stays there until it leaves. A step changes the energy by
//! `½ (1 − e) Pᵀẇ_k ≤ 0` and what loads and damping do; `P/h` is no pressure (it grows as `h` falls).

use std::ops::ControlFlow;

use nalgebra::DMatrix;

use crate::contact::{ContactError, March, PointState, Rule, State, States, System, lcp};
use crate::event::{
    Checkpoint, Energies, Ledger, Log, Marched, Observer, Options, Outcome, Proof, Report, Resumed,
    RunError, Sample, Switch, SwitchKind,
};
use crate::fem::{Csr, SolveScratch, SpdFactor};
use crate::flow::Counters;

const THETA: f64 = 0.5;

/// What does not change from step to step.
struct Scheme<'a> {
    system: &'a System,
    rule: Rule,
    restitution: f64,
    h: f64,
    steps: usize,
    stiffness: Csr,
    /// `C`
    damping: Option<Csr>,
    factor: SpdFactor,
    normal: &'a Csr,
    /// `W⁻¹nᵀ` and `n W⁻¹nᵀ`.
    columns: Vec<Vec<f64>>,
    gram: DMatrix<f64>,
}

impl<'a> Scheme<'a> {
    /// None for a system that is not stepped.
    fn new(system: &'a System, until: f64) -> Result<Option<Scheme<'a>>, ContactError> {
        let Some(law) = system.impact() else { return Ok(None) };
        let normal = law.normal();
        let Some(March::Steps(stepping)) = law.march else { return Ok(None) };
        let n_o = system.n_o();
        let steps = (until / stepping.step - 1e-9).ceil().max(1.0) as usize;
        let h = until / steps as f64;
        let (mass, stiffness) = (system.mass().leading(n_o), system.body.structure().leading(n_o));
        let damping = system.damping.map(|d| Csr::combination(d.alpha, &mass, d.beta, &stiffness));
        let elastic = Csr::combination(1.0, &mass, h * h * THETA * THETA, &stiffness);
        let w = match &damping {
            Some(c) => Csr::combination(1.0, &elastic, h * THETA, c),
            None => elastic,
        };
        let factor = SpdFactor::new(&w, "matrix of a step")?;
        let mut scratch = factor.scratch();
        let column = |k: usize| {
            let mut x = vec![0.0; n_o];
            normal.row(k).for_each(|(j, v)| x[j] = v);
            factor.solve(&mut x, &mut scratch);
            x
        };
        let columns: Vec<Vec<f64>> = (0..system.n_contact()).map(column).collect();
        let size = columns.len();
        let gram = DMatrix::from_fn(size, size, |i, j| normal.row_dot(i, &columns[j]));
        Ok(Some(Scheme {
            system,
            rule: stepping.rule,
            restitution: law.restitution,
            h,
            steps,
            stiffness,
            damping,
            factor,
            normal,
            columns,
            gram,
        }))
    }

    fn force(&self, t: f64) -> Vec<f64> {
        let mut f = vec![0.0; self.system.n()];
        if !self.system.loads.is_none() {
            self.system.loads.at(t, &mut f);
        }
        f.truncate(self.system.n_o());
        f
    }
}

/// A run by steps.
struct Stepper<'a, O: Observer> {
    scheme: Scheme<'a>,
    options: &'a Options,
    observer: &'a mut O,
    scratch: SolveScratch,
    step: usize,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Points that were pushed in the last step, and the impulses.
    set: States,
    impulse: Vec<f64>,
    force: Vec<f64>,
    /// Work of the loads on the displacements that are not held.
    external: f64,
    /// What supports that move had of the energy at the start.
    carried: f64,
    dissipated: f64,
    ledger: Ledger,
    next_sample: usize,
    stored: usize,
    penetration: f64,
    /// Impulses of all steps.
    blows: f64,
    log: Log,
}

/// Integrate a system that is stepped; none if it is not.
pub fn run<O: Observer>(
    system: &System,
    initial: &State,
    resumed: Option<Resumed>,
    options: &Options,
    observer: &mut O,
) -> Result<Option<Report>, RunError<O::Error>> {
    let Some(scheme) = Scheme::new(system, options.until)? else { return Ok(None) };
    let mut stepper = Stepper::begin(scheme, initial, options, observer);
    stepper.carried = stepper.carried_now();
    match resumed {
        None => {
            stepper.ledger = Ledger::new(stepper.energies());
            stepper.sample()?;
        }
        Some(resumed) => stepper.go_on(resumed),
    }
    let outcome = stepper.integrate()?;
    Ok(Some(stepper.report(outcome)))
}

impl<'a, O: Observer> Stepper<'a, O> {
    fn begin(
        scheme: Scheme<'a>,
        initial: &State,
        options: &'a Options,
        observer: &'a mut O,
    ) -> Self {
        let size = scheme.system.n_contact();
        let log = Log::new(!observer.takes_events());
        Stepper {
            scratch: scheme.factor.scratch(),
            force: scheme.force(0.0),
            scheme,
            options,
            observer,
            step: 0,
            q: initial.u.clone(),
            v: initial.v.clone(),
            set: States::open(size),
            impulse: vec![0.0; size],
            external: 0.0,
            carried: 0.0,
            dissipated: 0.0,
            ledger: Ledger::default(),
            next_sample: 1,
            stored: 0,
            penetration: 0.0,
            blows: 0.0,
            log,
        }
    }

    fn go_on(&mut self, resumed: Resumed) {
        let Resumed { checkpoint: c, log } = resumed;
        let n = self.q.len();
        self.step = (c.t / self.scheme.h).round() as usize;
        self.q.copy_from_slice(&c.y[..n]);
        self.v.copy_from_slice(&c.y[n..2 * n]);
        (self.external, self.dissipated) = (c.y[2 * n], c.y[2 * n + 1]);
        self.set = c.states;
        self.ledger = Ledger::of_numbers(c.ledger);
        (self.next_sample, self.stored) = (c.next_sample, c.rows[0]);
        (self.penetration, self.blows) = (c.seen.gap_error, c.seen.blows);
        self.force = self.scheme.force(self.t());
        self.log = log;
    }

    fn t(&self) -> f64 {
        match self.step == self.scheme.steps {
            true => self.options.until,
            false => self.step as f64 * self.scheme.h,
        }
    }

    fn integrate(&mut self) -> Result<Outcome, RunError<O::Error>> {
        while self.step < self.scheme.steps {
            self.advance()?;
            let t = self.t();
            if self.q.iter().any(|x| !x.is_finite()) {
                return Ok(Outcome::Flow(crate::flow::FlowError::NotFinite { t }));
            }
            // by numbers of steps: a sample at the very end of one is not a rounding error behind it
            let due = |k: usize| {
                let share = k as f64 / self.options.samples as f64;
                (share * self.scheme.steps as f64 - 1e-9).ceil() as usize
            };
            let last = self.step == self.scheme.steps;
            let is_due = |k: usize| k < self.options.samples && due(k) <= self.step;
            if last || is_due(self.next_sample) {
                while is_due(self.next_sample) {
                    self.next_sample += 1;
                }
                self.sample()?;
            }
            let go = self.observer.progress(t).map_err(RunError::Observer)?;
            if matches!(go, ControlFlow::Break(())) && !last {
                return Ok(Outcome::Interrupted { t });
            }
        }
        Ok(Outcome::EndTime)
    }

    /// One step.
    fn advance(&mut self) -> Result<(), RunError<O::Error>> {
        let s = &self.scheme;
        let (h, n) = (s.h, self.q.len());
        let next = s.force((self.step + 1) as f64 * h);
        // −hK(q + hθ v) − hC v + h f_θ
        let ahead: Vec<f64> = self.q.iter().zip(&self.v).map(|(q, v)| q + h * THETA * v).collect();
        let mean: Vec<f64> =
            next.iter().zip(&self.force).map(|(a, b)| THETA * a + (1.0 - THETA) * b).collect();
        let mut b = mean.clone();
        s.stiffness.mul_sub(&ahead, &mut b);
        if let Some(c) = &s.damping {
            c.mul_sub(&self.v, &mut b);
        }
        s.factor.solve(&mut b, &mut self.scratch);
        let mut v: Vec<f64> = self.v.iter().zip(&b).map(|(v, b)| v + h * b).collect();
        let gap = |k: usize| s.system.constraints[k].gap - s.normal.row_dot(k, &self.q);
        let rate = |k: usize, v: &[f64]| -s.normal.row_dot(k, v);
        let reached = |k: &usize| {
            let (w, dw) = (gap(*k), rate(*k, &self.v));
            match s.rule {
                Rule::HalfStep => w + 0.5 * h * dw <= 0.0,
                Rule::FullStep => w + h * dw <= 0.0 && dw <= 0.0,
            }
        };
        let touching: Vec<usize> = (0..s.system.n_contact()).filter(reached).collect();
        let before: Vec<f64> = touching.iter().map(|&k| rate(k, &self.v)).collect();
        let mut impulse = vec![0.0; s.system.n_contact()];
        let mut jump = 0.0;
        if !touching.is_empty() {
            let d = DMatrix::from_fn(touching.len(), touching.len(), |i, j| {
                s.gram[(touching[i], touching[j])]
            });
            let q: Vec<f64> = touching
                .iter()
                .zip(&before)
                .map(|(&k, w)| rate(k, &v) + s.restitution * w)
                .collect();
            let largest = v.iter().chain(&self.v).fold(0.0f64, |m, x| m.max(x.abs()));
            let start: Vec<bool> = touching.iter().map(|&k| !self.set.touches(k)).collect();
            let solution = lcp::solve(&d.into(), &q, &vec![4.0 * largest; q.len()], &start)
                .map_err(ContactError::from)?;
            for (&k, p) in touching.iter().zip(&solution.w) {
                impulse[k] = *p;
                v.iter_mut().zip(&s.columns[k]).for_each(|(v, c)| *v -= p * c);
            }
            // ½ Pᵀ(ẇ_{k+1} + ẇ_k)
            let middle = |(&k, w): (&usize, &f64)| 0.5 * impulse[k] * (rate(k, &v) + w);
            jump = touching.iter().zip(&before).map(middle).sum();
        }
        let halfway: Vec<f64> =
            v.iter().zip(&self.v).map(|(a, b)| THETA * a + (1.0 - THETA) * b).collect();
        self.external += h * mean.iter().zip(&halfway).map(|(f, v)| f * v).sum::<f64>();
        if let Some(c) = &s.damping {
            self.dissipated += h * c.quadratic(&halfway);
        }
        (0..n).for_each(|i| self.q[i] += h * halfway[i]);
        let was = std::mem::replace(&mut self.v, v);
        self.force = next;
        self.step += 1;
        self.blows += impulse.iter().sum::<f64>();
        self.impulse = impulse;
        let full = self.full().0;
        self.penetration = self.penetration.max(self.scheme.system.penetration(&full));
        let energies = self.energies();
        self.ledger.switch(jump, Some(&energies));
        self.ledger.note(&energies);
        self.tell_switches(jump, &was)
    }

    /// Points that begin or cease to be pushed.
    fn tell_switches(&mut self, jump: f64, was: &[f64]) -> Result<(), RunError<O::Error>> {
        let mut jump = jump;
        for point in 0..self.impulse.len() {
            let is = self.impulse[point] > 0.0;
            if is == self.set.touches(point) {
                continue;
            }
            let after = self.set.with(point, PointState::of_contact(is));
            let change = Switch {
                t: self.t(),
                point,
                node: self.scheme.system.constraints[point].node,
                kind: if is { SwitchKind::Close } else { SwitchKind::Open },
                monitor: self.scheme.system.law().watched(self.set.at(point)),
                monitor_rate: -self.scheme.normal.row_dot(point, was),
                energy_jump: std::mem::take(&mut jump),
                struck: vec![],
                before: self.set.clone(),
                after: after.clone(),
            };
            self.set = after;
            self.log.switch(change, self.observer).map_err(RunError::Observer)?;
        }
        Ok(())
    }

    /// All displacements and velocities, those of the contact points behind the others.
    fn full(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |x: &[f64]| {
            let points = (0..self.impulse.len()).map(|k| self.scheme.normal.row_dot(k, x));
            x.iter().copied().chain(points).collect()
        };
        (of(&self.q), of(&self.v))
    }

    fn energies(&self) -> Energies {
        let ((u, v), t, system) = (self.full(), self.t(), self.scheme.system);
        Energies {
            kinetic: system.kinetic(t, &v),
            elastic: system.elastic(t, &u),
            external: self.external_work(),
            dissipated: self.dissipated,
            ..Energies::default()
        }
    }

    /// What supports that move have of the energy.
    fn carried_now(&self) -> f64 {
        let (u, v) = self.full();
        self.scheme.system.loads.carried.energy(self.t(), &u, &v)
    }

    /// Work of all loads, supports that move among them.
    fn external_work(&self) -> f64 {
        self.external + self.carried_now() - self.carried
    }

    fn sample(&mut self) -> Result<(), RunError<O::Error>> {
        let (u, v) = self.full();
        // an impulse over its step is a mean pressure of this step, and no more
        let mean = |(p, c): (&f64, &crate::contact::Constraint)| p / (self.scheme.h * c.area);
        let pressure: Vec<f64> =
            self.impulse.iter().zip(&self.scheme.system.constraints).map(mean).collect();
        let sample = Sample {
            t: self.t(),
            u: &u,
            v: &v,
            a: &[],
            active: &self.set,
            pressure: &pressure,
            traction: &[],
            energies: Some(self.energies()),
            jumps: self.ledger.jumps(),
        };
        self.observer.sample(&sample).map_err(RunError::Observer)?;
        self.stored += 1;
        if self.observer.keeps_checkpoints() {
            let books = [self.external, self.dissipated];
            let state = self.q.iter().chain(&self.v).chain(&books).copied();
            let counts = [self.next_sample, self.stored, self.log.switches()];
            let at = (self.t(), state.collect());
            let sizes = (self.penetration, self.blows);
            let checkpoint = Checkpoint::marched(at, &self.set, &self.ledger, sizes, counts);
            self.observer.phase(checkpoint);
        }
        Ok(())
    }

    fn report(self, outcome: Outcome) -> Report {
        let (phases, t_end) = (self.log.switches() + 1, self.t());
        let energy_external = self.external_work();
        let size = self.scheme.system.units.length;
        let rule = match self.scheme.rule {
            Rule::HalfStep => "half a step ahead",
            Rule::FullStep => "a step ahead",
        };
        let marched = Marched {
            outcome,
            t_end,
            last: (State { u: self.q.clone(), v: self.v.clone() }, self.set.clone()),
            log: self.log,
            proof: Proof { violation: self.penetration / size, ..Proof::none(phases) },
            counters: Counters { steps: self.step as u64, ..Counters::default() },
            note: format!(
                "steps of {:.6e}; points are pushed where their gap closes {rule}",
                self.scheme.h
            ),
        };
        Report {
            blows: self.blows,
            energy_external,
            energy_dissipated: self.dissipated,
            max_penetration: self.penetration,
            gap_error: self.penetration,
            ..Report::of(marched, &self.ledger)
        }
    }
}
