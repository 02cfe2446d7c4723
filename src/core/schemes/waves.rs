//! The uniform bar before an obstacle, exactly: waves that run along characteristics.
//!
//! With `r = v − cε` running to the contact and `l = v + cε` running back, the bar is a loop of length `2L` of pieces of constant value, shifted
//! by `ct`: at the held end `r = −l`, at the contact end
//!
//! ```text
//! open:     σ = 0,  l = r,    u̇(L) = r          until u(L) = g
//! contact:  v = 0,  l = −r,   p = E r/c         until r ≤ 0
//! ```
//!
//! so that a piece keeps its value around the loop but for its sign when it passes the open end. Both instants are known in closed form.
//! Exact for displacements linear and velocities constant over each element: no mesh, no modes, no search. With decisions at multiples of `h/c` only it
//! is the wave finite element method (Yoong, Thorin, Legrand 2015).

use std::collections::VecDeque;
use std::ops::ControlFlow;

use crate::contact::{Instants, March, State, States, System};
use crate::event::{
    Checkpoint, Energies, Ledger, Log, Marched, Observer, Options, Outcome, Proof, Report, Resumed,
    RunError, Sample, Switch, SwitchKind,
};
use crate::fem::{Material, StressState};
use crate::flow::Counters;

/// Lengths and displacements below this, over those of the bar, are rounding errors.
const ROUNDING: f64 = 1e-12;

/// Part of the loop: its length, its value.
type Piece = (f64, f64);

/// A run.
struct Bar<'a, O: Observer> {
    system: &'a System,
    options: &'a Options,
    observer: &'a mut O,
    instants: Instants,
    /// Wave speed, Young's modulus, density, cross-section.
    c: f64,
    young: f64,
    density: f64,
    area: f64,
    length: f64,
    gap: f64,
    /// Nodes from the held end on, each with its distance from it and its displacement's place and sign (along the outward normal of the contact).
    nodes: Vec<(f64, Option<(usize, f64)>)>,
    /// In the order in which they reach the contact end.
    pieces: VecDeque<Piece>,
    t: f64,
    end: f64,
    touches: bool,
    ledger: Ledger,
    next_sample: usize,
    stored: usize,
    last_stored: f64,
    log: Log,
    fronts: u64,
}

/// Integrate a system of waves; none if it is of another kind.
pub fn run<O: Observer>(
    system: &System,
    initial: &State,
    resumed: Option<Resumed>,
    options: &Options,
    observer: &mut O,
) -> Result<Option<Report>, RunError<O::Error>> {
    let Some(mut bar) = Bar::new(system, initial, options, observer) else { return Ok(None) };
    match resumed {
        None => {
            bar.ledger = Ledger::new(bar.energies());
            bar.sample()?;
        }
        Some(resumed) => bar.go_on(resumed),
    }
    let outcome = bar.integrate()?;
    Ok(Some(bar.report(outcome)))
}

impl<'a, O: Observer> Bar<'a, O> {
    fn new(
        system: &'a System,
        initial: &State,
        options: &'a Options,
        observer: &'a mut O,
    ) -> Option<Self> {
        let law = system.impact()?;
        let Some(March::Waves(instants)) = law.march else { return None };
        let materials = system.body.materials();
        let &[Material { young, density, state: StressState::Uniaxial { area }, .. }] = materials
        else {
            return None;
        };
        let point = system.constraints.first()?;
        let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
        let sign = point.normal[0];
        let length = mesh.length();
        let mut nodes: Vec<(f64, Option<(usize, f64)>)> = (0..mesh.n_nodes())
            .map(|n| {
                let x = mesh.nodes()[n][0];
                let distance = if sign > 0.0 { x } else { length - x };
                (distance, dofs.terms(n, 0).next().map(|(i, s)| (i, s * sign)))
            })
            .collect();
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let c = (young / density).sqrt();
        let at = |x: &[f64], place: Option<(usize, f64)>| place.map_or(0.0, |(i, s)| s * x[i]);
        // of each element: velocity, c times strain
        let elements: Vec<(f64, f64, f64)> = nodes
            .windows(2)
            .map(|p| {
                let h = p[1].0 - p[0].0;
                let v = 0.5 * (at(&initial.v, p[0].1) + at(&initial.v, p[1].1));
                (h, v, c * (at(&initial.u, p[1].1) - at(&initial.u, p[0].1)) / h)
            })
            .collect();
        let to_contact = elements.iter().rev().map(|&(h, v, s)| (h, v - s));
        let to_support = elements.iter().map(|&(h, v, s)| (h, -(v + s)));
        let end = nodes.last().map_or(0.0, |&(_, place)| at(&initial.u, place));
        // pressed against the obstacle, and at rest
        let pressed = elements.last().is_some_and(|&(_, v, s)| v == 0.0 && s < 0.0);
        let touches = pressed && point.gap - end <= ROUNDING * point.gap.abs().max(end.abs());
        let log = Log::new(!observer.takes_events());
        Some(Bar {
            pieces: to_contact.chain(to_support).collect(),
            system,
            options,
            observer,
            instants,
            c,
            young,
            density,
            area,
            length,
            gap: point.gap,
            nodes,
            t: 0.0,
            end,
            touches,
            ledger: Ledger::default(),
            next_sample: 1,
            stored: 0,
            last_stored: f64::NEG_INFINITY,
            log,
            fronts: 0,
        })
    }

    fn go_on(&mut self, resumed: Resumed) {
        let Resumed { checkpoint: k, log } = resumed;
        (self.t, self.end) = (k.t, k.y[0]);
        self.last_stored = k.t;
        self.pieces = k.y[1..].chunks_exact(2).map(|p| (p[0], p[1])).collect();
        self.touches = k.states.count_closed() > 0;
        self.ledger = Ledger::of_numbers(k.ledger);
        (self.next_sample, self.stored) = (k.next_sample, k.rows[0]);
        self.fronts = k.flow[0] as u64;
        self.log = log;
    }

    fn integrate(&mut self) -> Result<Outcome, RunError<O::Error>> {
        let until = self.options.until;
        while self.t < until {
            let due = match self.next_sample {
                k if k < self.options.samples => k as f64 * (until / self.options.samples as f64),
                _ => until,
            };
            self.advance(due)?;
            self.next_sample += 1;
            self.sample()?;
            let go = self.observer.progress(self.t).map_err(RunError::Observer)?;
            if matches!(go, ControlFlow::Break(())) && self.t < until {
                return Ok(Outcome::Interrupted { t: self.t });
            }
        }
        Ok(Outcome::EndTime)
    }

    /// Go on to a time.
    fn advance(&mut self, until: f64) -> Result<(), RunError<O::Error>> {
        let size = self.gap.abs().max(self.end.abs());
        while self.t < until {
            let Some(&(length, r)) = self.pieces.front() else { return Ok(()) };
            if length <= ROUNDING * self.length {
                self.pass(length);
                continue;
            }
            if self.touches && r <= 0.0 {
                self.switch(false, r)?;
            }
            let left = until - self.t;
            let (time, is_last) = ((length / self.c).min(left), length / self.c >= left);
            let rest = self.gap - self.end;
            let reaches = !self.touches && r > 0.0 && r * length / self.c > rest + ROUNDING * size;
            match (reaches, self.instants) {
                (true, Instants::Exact) if rest <= 0.0 => self.switch(true, r)?,
                (true, Instants::Exact) if rest / r <= until - self.t => {
                    self.pass_for(rest / r, r);
                    self.end = self.gap;
                    self.switch(true, r)?;
                }
                // one decision a piece: it is stopped whole
                (true, Instants::Step) => self.switch(true, r)?,
                _ => {
                    self.pass_for(time, r);
                    if is_last {
                        self.t = until;
                    }
                }
            }
        }
        Ok(())
    }

    fn pass_for(&mut self, time: f64, r: f64) {
        if !self.touches {
            self.end += r * time;
        }
        self.t += time;
        self.pass(time * self.c);
    }

    /// Let a length of the first piece pass the contact end.
    fn pass(&mut self, length: f64) {
        let Some((whole, value)) = self.pieces.pop_front() else { return };
        self.fronts += 1;
        if whole - length > ROUNDING * self.length {
            self.pieces.push_front((whole - length, value));
        }
        let back = if self.touches { value } else { -value };
        let length = if whole - length > ROUNDING * self.length { length } else { whole };
        match self.pieces.back_mut() {
            // decisions of steps are one a piece: pieces stay what they are
            Some(last) if last.1 == back && self.instants == Instants::Exact => last.0 += length,
            _ => self.pieces.push_back((length, back)),
        }
    }

    fn switch(&mut self, touches: bool, r: f64) -> Result<(), RunError<O::Error>> {
        let before = States::of_contact([self.touches]);
        self.touches = touches;
        let change = Switch {
            t: self.t,
            point: 0,
            node: self.system.constraints[0].node,
            kind: if touches { SwitchKind::Close } else { SwitchKind::Open },
            monitor: self.system.law().watched(before.at(0)),
            monitor_rate: -r.abs(),
            energy_jump: 0.0,
            struck: vec![],
            before,
            after: States::of_contact([touches]),
        };
        self.log.switch(change, self.observer).map_err(RunError::Observer)?;
        self.sample()
    }

    /// Values `r` or `l` along the bar from the held end on, as pieces.
    fn along(&self) -> [Vec<Piece>; 2] {
        let (mut to_contact, mut to_support) = (vec![], vec![]);
        let mut rest = self.length;
        for &(length, value) in &self.pieces {
            let first = length.min(rest);
            if first > 0.0 {
                to_contact.push((first, value));
            }
            if length > first {
                to_support.push((length - first, -value));
            }
            rest -= first;
        }
        to_contact.reverse();
        [to_contact, to_support]
    }

    /// Displacements and velocities of the nodes, kinetic and elastic energy.
    fn state(&self) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
        let [r, l] = self.along();
        let (mut u, mut v) = (vec![0.0; self.system.n()], vec![0.0; self.system.n()]);
        let mut energy = [0.0; 2];
        let (mut i, mut j) = (0, 0);
        let mut left = [r.first().map_or(0.0, |p| p.0), l.first().map_or(0.0, |p| p.0)];
        let (mut x, mut displacement) = (0.0, 0.0);
        for &(node, place) in &self.nodes {
            let mut velocity = 0.0;
            while x < node && i < r.len() && j < l.len() {
                let (rv, lv) = (r[i].1, l[j].1);
                let step = left[0].min(left[1]).min(node - x);
                velocity = 0.5 * (rv + lv);
                let strain = 0.5 * (lv - rv) / self.c;
                displacement += strain * step;
                energy[0] += 0.5 * self.density * self.area * velocity * velocity * step;
                energy[1] += 0.5 * self.young * self.area * strain * strain * step;
                x = if step == node - x { node } else { x + step };
                left.iter_mut().for_each(|l| *l -= step);
                if left[0] <= 0.0 {
                    i += 1;
                    left[0] = r.get(i).map_or(0.0, |p| p.0);
                }
                if left[1] <= 0.0 {
                    j += 1;
                    left[1] = l.get(j).map_or(0.0, |p| p.0);
                }
            }
            if let Some((k, sign)) = place {
                (u[k], v[k]) = (sign * displacement, sign * velocity);
            }
        }
        // the contact end is known by itself
        if let Some(&(_, Some((k, sign)))) = self.nodes.last() {
            u[k] = sign * self.end;
        }
        let n_o = self.system.n_o();
        let (of_u, of_v) = (self.system.along_normals(&u), self.system.along_normals(&v));
        u[n_o..].copy_from_slice(&of_u);
        v[n_o..].copy_from_slice(&of_v);
        (u, v, energy)
    }

    fn energies(&self) -> Energies {
        let [kinetic, elastic] = self.state().2;
        Energies { kinetic, elastic, ..Energies::default() }
    }

    fn sample(&mut self) -> Result<(), RunError<O::Error>> {
        // switches at one time leave one state: times in a file ascend
        if std::mem::replace(&mut self.last_stored, self.t) >= self.t {
            return Ok(());
        }
        let (u, v, [kinetic, elastic]) = self.state();
        let energies = Energies { kinetic, elastic, ..Energies::default() };
        self.ledger.note(&energies);
        let r = self.pieces.front().map_or(0.0, |p| p.1);
        let pressure = if self.touches { self.young * r / self.c } else { 0.0 };
        let sample = Sample {
            t: self.t,
            u: &u,
            v: &v,
            a: &[],
            active: &States::of_contact([self.touches]),
            pressure: &[pressure],
            traction: &[],
            energies: Some(energies),
            jumps: 0.0,
        };
        self.observer.sample(&sample).map_err(RunError::Observer)?;
        self.stored += 1;
        if self.observer.keeps_checkpoints() {
            let pieces = self.pieces.iter().flat_map(|&(l, x)| [l, x]);
            let at = (self.t, std::iter::once(self.end).chain(pieces).collect());
            let counts = [self.next_sample, self.stored, self.log.switches()];
            let set = States::of_contact([self.touches]);
            let marched = Checkpoint::marched(at, &set, &self.ledger, (0.0, 0.0), counts);
            self.observer.phase(Checkpoint { flow: vec![self.fronts as f64], ..marched });
        }
        Ok(())
    }

    fn report(self, outcome: Outcome) -> Report {
        let (u, v, _) = self.state();
        let (n_o, phases) = (self.system.n_o(), self.log.switches() + 1);
        let exact = self.instants == Instants::Exact;
        let note = match exact {
            true => {
                format!("{} passages of the contact end, {} pieces", self.fronts, self.pieces.len())
            }
            false => "contact is decided once an element's travel time".to_owned(),
        };
        let marched = Marched {
            outcome,
            t_end: self.t,
            last: (
                State { u: u[..n_o].to_vec(), v: v[..n_o].to_vec() },
                States::of_contact([self.touches]),
            ),
            log: self.log,
            proof: Proof::none(if exact { 0 } else { phases }),
            counters: Counters { steps: self.fronts, ..Counters::default() },
            note,
        };
        Report {
            max_penetration: (self.end - self.gap).max(0.0),
            ..Report::of(marched, &self.ledger)
        }
    }
}
