//! `T_{k+1}x = 2S̃T_k x − T_{k−1}x` with `S̃ = 2S/s_max − I`, `S = M_α⁻¹K_α`: the products of flows without modes, in one pass over the body.
//!
//! The vectors are full ones, `u_C` following from `u_O`. Where the mass is a diagonal, a row of the product, its division by the mass
//! and the recurrence are one operation, and what the active set adds (the projection of the paper's mass, the forces on `u_C` of a constant one) is
//! mended at the displacements next to the contact alone. There a product is local, too: one of the displacements of some rows, the others at rest,
//! knows nothing of what lies further away.

use std::ops::Range;

use super::condensed::Condensed;
use super::expansion::Part;
use super::inertia::{ConstantMass, Inertia, Projector};
use super::phase::{Parts, Phase};
use super::scratch::Scratch;
use super::system::System;
use crate::fem::{Csr, SpdFactor};

/// What the recurrences of all phases of a body share.
#[derive(Debug)]
pub struct Recurrence {
    /// `2/s_max`
    scale: f64,
    /// Displacements that the projection looks at.
    near: Vec<usize>,
    /// Displacements of `u_O` that move; the others are at rest.
    rows: Range<usize>,
    /// Displacements of `u_O` that act on these.
    reach: Range<usize>,
}

/// Three vectors that follow each other in a recurrence: the first step has none before.
#[derive(Debug)]
pub struct Step<'a> {
    /// `T_{k−1}x`
    pub before: Option<&'a [f64]>,
    /// `T_k x`
    pub now: &'a [f64],
    /// `T_{k+1}x`
    pub next: &'a mut [f64],
}

/// `next = f S now − g now − before`
#[derive(Debug, Clone, Copy)]
struct Factors {
    f: f64,
    g: f64,
}

impl Recurrence {
    /// Of a body whose frequencies are bounded.
    pub fn new(system: &System) -> Recurrence {
        let near = match system.inertia() {
            Inertia::Projected(p) => p.support(),
            Inertia::Constant(c) => match &**c {
                ConstantMass::Condensed { mass, .. } => mass.support(),
                ConstantMass::Formed { .. } => vec![],
            },
        };
        let highest = system.units.highest;
        let all = 0..system.n_o();
        Recurrence { scale: 2.0 / (highest * highest), near, rows: all.clone(), reach: all }
    }

    /// The same of some displacements, among them all next to the contact; the mass must be local ([`Recurrence::is_local`]).
    pub fn within(system: &System, rows: Range<usize>) -> Recurrence {
        let n_o = system.n_o();
        let columns = rows.clone().flat_map(|i| system.body.stiffness.row(i).map(|(j, _)| j));
        let reach = columns
            .filter(|j| *j < n_o)
            .fold(rows.clone(), |r, j| r.start.min(j)..r.end.max(j + 1));
        Recurrence { rows, reach, ..Recurrence::new(system) }
    }

    /// Whether the mass is a diagonal, so that forces accelerate what they act on and nothing else.
    pub(crate) fn is_local(system: &System) -> bool {
        match system.inertia() {
            Inertia::Projected(p) => p.diagonal().is_some(),
            Inertia::Constant(c) => match &**c {
                ConstantMass::Condensed { .. } => true,
                ConstantMass::Formed { factor, .. } => matches!(factor, SpdFactor::Diagonal(_)),
            },
        }
    }

    /// Displacements of `u_O` that move.
    pub fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Accelerations of the displacements that move, of an undamped body under constant loads, where all displacements are `u_O`; those next to the
    /// moving ones must be right, too.
    pub fn acceleration(
        &self,
        phase: &Phase,
        t: f64,
        u_o: &[f64],
        s: &mut Scratch,
        a_o: &mut [f64],
    ) {
        let mut u = std::mem::take(&mut s.u);
        u[self.reach.clone()].copy_from_slice(&u_o[self.reach.clone()]);
        phase.data.expansion.fill(&mut u, u_o.len(), Part::Whole(t));
        let load = phase.parts.loads.constant.as_deref();
        let mut step = [Step { before: None, now: &u, next: a_o }];
        if let Some(inverse) = self.local(phase, Factors { f: -1.0, g: 0.0 }, &mut step, load, s) {
            let moving =
                self.rows.clone().zip(load.into_iter().flat_map(|f| &f[self.rows.clone()]));
            moving.for_each(|(i, f)| a_o[i] += inverse[i] * f);
            // the pushes so far were linear
            let (o, rest) = (&phase.parts.obstacle, &phase.data.pushes);
            for (o, &k) in o.iter().flat_map(|o| rest.iter().map(move |k| (o, k))) {
                let push = o.push(k, u_o, true) - o.push(k, u_o, false);
                o.direction.row(k).for_each(|(j, t)| a_o[j] -= inverse[j] * t * push);
            }
        }
        s.u = u;
    }

    /// One step of several recurrences at once.
    pub fn step<const N: usize>(&self, phase: &Phase, mut steps: [Step; N], scratch: &mut Scratch) {
        let factors = match steps[0].before {
            Some(_) => Factors { f: 2.0 * self.scale, g: 2.0 },
            None => Factors { f: self.scale, g: 1.0 },
        };
        if self.local(phase, factors, &mut steps, None, scratch).is_none() {
            self.general(phase, factors, &mut steps, scratch);
        }
        for step in &mut steps {
            phase.complete(step.next);
        }
    }

    /// `f S now − g now − before` of the displacements that move, with the reciprocal masses, where these are a diagonal; `load` is what else acts
    /// next to the contact: forces are `K now − load`.
    fn local<'p, const N: usize>(
        &self,
        phase: &'p Phase,
        factors: Factors,
        steps: &mut [Step; N],
        load: Option<&[f64]>,
        s: &mut Scratch,
    ) -> Option<&'p [f64]> {
        match &*phase.data.inertia.shared {
            Inertia::Projected(p) => {
                let (inverse, columns) = p.diagonal()?;
                self.pass(phase, inverse, factors, steps);
                for step in steps {
                    self.project(phase, (p, columns), (inverse, factors.f), step, load, s);
                }
                Some(inverse)
            }
            Inertia::Constant(c) => {
                let (inverse, condensed) = match &**c {
                    ConstantMass::Formed { factor: SpdFactor::Diagonal(inverse), .. } => {
                        (inverse, None)
                    }
                    ConstantMass::Condensed { mass, .. } => (&mass.inverse, Some(&**mass)),
                    ConstantMass::Formed { .. } => return None,
                };
                self.pass(phase, inverse, factors, steps);
                for step in steps {
                    self.add_pushes(phase, inverse, factors.f, step);
                    self.push(phase, (inverse, condensed), factors.f, step, (load, s));
                }
                Some(inverse)
            }
        }
    }

    /// What the obstacle adds where it pushes: `f D⁻¹ Σ wγ t bᵀ now`.
    fn add_pushes(&self, phase: &Phase, inverse: &[f64], f: f64, step: &mut Step) {
        let Some(o) = &phase.parts.obstacle else { return };
        let n_o = phase.parts.body.dofs.n_o;
        for &k in &phase.data.pushes {
            let push = o.push(k, &step.now[..n_o], false);
            o.direction.row(k).for_each(|(j, t)| step.next[j] += f * inverse[j] * t * push);
        }
    }

    /// `f D⁻¹K now − g now − before` of all displacements that move.
    fn pass<const N: usize>(
        &self,
        phase: &Phase,
        inverse: &[f64],
        Factors { f, g }: Factors,
        steps: &mut [Step; N],
    ) {
        let Parts { body, kernel, .. } = &phase.parts;
        let stiffness = &body.stiffness;
        let now = std::array::from_fn(|v| steps[v].now);
        let before: [Option<&[f64]>; N] = std::array::from_fn(|v| steps[v].before);
        let next = steps.each_mut().map(|s| &mut s.next[self.rows.clone()]);
        kernel.mul_rows(stiffness, self.rows.clone(), now, next, |first, y| {
            let rows = first..first + y[0].len();
            for (v, y) in y.into_iter().enumerate() {
                let of_rows = y.iter_mut().zip(&inverse[rows.clone()]).zip(&now[v][rows.clone()]);
                match before[v] {
                    Some(before) => {
                        for (((y, d), x), b) in of_rows.zip(&before[rows.clone()]) {
                            *y = f * d * *y - g * x - b;
                        }
                    }
                    None => of_rows.for_each(|((y, d), x)| *y = f * d * *y - g * x),
                }
            }
        });
    }

    /// The projection of the paper's mass: accelerations next to the contact, the multipliers of the conditions, what these take away.
    fn project(
        &self,
        phase: &Phase,
        (p, columns): (&Projector, &Csr),
        (inverse, f): (&[f64], f64),
        step: &mut Step,
        load: Option<&[f64]>,
        s: &mut Scratch,
    ) {
        let stiffness = &phase.parts.body.stiffness;
        let n_o = phase.parts.body.dofs.n_o;
        for &j in &self.near {
            let force = stiffness.row_dot(j, step.now) - load.map_or(0.0, |l| l[j]);
            s.x[j] = inverse[j] * force;
        }
        if !phase.data.inertia.multipliers(p, &s.x, &mut s.mu) {
            return step.next.fill(f64::NAN);
        }
        for (&mu, &k) in s.mu.iter().zip(phase.data.inertia.rows()) {
            for (j, v) in columns.row(k).filter(|(j, _)| *j < n_o) {
                step.next[j] -= f * mu * v;
            }
        }
    }

    /// What forces on `u_C` do to the displacements that these follow from, under a constant mass, and what a condensed one takes from all accelerations.
    fn push(
        &self,
        phase: &Phase,
        (inverse, condensed): (&[f64], Option<&Condensed>),
        f: f64,
        step: &mut Step,
        (load, s): (Option<&[f64]>, &mut Scratch),
    ) {
        let Some(solved) = phase.data.expansion.solved() else { return };
        let (stiffness, n_o) = (&phase.parts.body.stiffness, phase.parts.body.dofs.n_o);
        let force = |i: usize| stiffness.row_dot(i, step.now) - load.map_or(0.0, |l| l[i]);
        for i in n_o..stiffness.n_rows() {
            s.b[i] = force(i);
        }
        for &j in &self.near {
            s.x[j] = inverse[j] * force(j);
        }
        let (b, x) = (&s.b, &mut s.x);
        solved.push(&b[n_o..], |j, v| {
            x[j] += inverse[j] * v;
            step.next[j] += f * inverse[j] * v;
        });
        if let Some(condensed) = condensed {
            condensed.correct(&s.x, &mut s.solve, |j, v| step.next[j] -= f * v);
        }
    }

    /// Any mass.
    fn general<const N: usize>(
        &self,
        phase: &Phase,
        Factors { f, g }: Factors,
        steps: &mut [Step; N],
        s: &mut Scratch,
    ) {
        let n = s.u.len();
        let n_o = phase.parts.body.dofs.n_o;
        let [mut room, mut b] = std::mem::take(&mut s.pair);
        room.resize(N * n, 0.0);
        b.resize(N * n, 0.0);
        let now: [&[f64]; N] = std::array::from_fn(|v| steps[v].now);
        let mut rest = &mut b[..];
        let forces: [&mut [f64]; N] = std::array::from_fn(|_| {
            let (first, others) = std::mem::take(&mut rest).split_at_mut(n);
            rest = others;
            first
        });
        phase.parts.kernel.mul(&phase.parts.body.stiffness, now, forces);
        for (b, now) in b.chunks_exact_mut(n).zip(now) {
            phase.add_pushes(&now[..n_o], b, false);
        }
        let next = steps.each_mut().map(|s| &mut s.next[..n_o]);
        phase.data.inertia.accelerate_all(&phase.data.expansion, &mut b, &mut room, s, next);
        for step in steps {
            let of_rows = step.next[..n_o].iter_mut().zip(step.now);
            match step.before {
                Some(before) => {
                    of_rows.zip(before).for_each(|((y, x), b)| *y = f * *y - g * x - b);
                }
                None => of_rows.for_each(|(y, x)| *y = f * *y - g * x),
            }
        }
        s.pair = [room, b];
    }
}
