//! Perturbations along the homogeneous flow of a phase, without modes.

use super::length::Lengths;
use super::series::{Rows, Series, extend};
use crate::contact::{Phase, Recurrence, Scratch, System};

/// Carries perturbations of one body over phases.
#[derive(Debug)]
pub struct Tangent<'a> {
    system: &'a System,
    lengths: Lengths,
    recurrence: Recurrence,
    scratch: Scratch,
}

impl<'a> Tangent<'a> {
    /// Of a body whose frequencies are bounded.
    pub fn new(system: &'a System) -> Tangent<'a> {
        let lengths = Lengths::new(system.units.highest, system.damping);
        Tangent { system, lengths, recurrence: Recurrence::new(system), scratch: system.scratch() }
    }

    /// Carry `(δu, δu̇)` over the time `tau` of a phase: `δu ← (g′ + αg) δu + g δu̇ + βS g δu`, `δu̇ ← g′ δu̇ − S g δu`. Returns the number of products.
    pub fn carry(
        &mut self,
        phase: &Phase,
        tau: f64,
        (du, dv): (&mut Vec<f64>, &mut Vec<f64>),
    ) -> u64 {
        let n = du.len();
        let (alpha, beta) = self.system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let terms = self.lengths.of(tau).terms;
        let nodes = self.lengths.nodes(terms);
        let f = nodes.functions(tau);
        let (rate, g) = (nodes.coefficients(&f.rate), nodes.coefficients(&f.g));
        let (mut of_u, mut of_v) = (Series::default(), Series::default());
        of_u.begin(du, 0..n, phase);
        of_v.begin(dv, 0..n, phase);
        let rows = Rows { phase, forces: &[], n_o: n };
        let both = [&mut of_u, &mut of_v];
        let products = extend(both, terms, &self.recurrence, &rows, &mut self.scratch);
        // (g′ + αg) δu + g δu̇, g′ δu̇, g δu
        let [mut u, mut v, mut w] = [0; 3].map(|_| vec![0.0; n]);
        let all = of_u.terms(terms).iter().zip(of_v.terms(terms));
        for ((x, y), (rate, g)) in all.zip(rate.iter().zip(&g)) {
            for i in 0..n {
                u[i] += (rate + alpha * g) * x[i] + g * y[i];
                v[i] += rate * y[i];
                w[i] += g * x[i];
            }
        }
        let mut next = vec![0.0; n];
        phase.stiffness_product(&w, &mut self.scratch, &mut next);
        for ((u, v), y) in u.iter_mut().zip(&mut v).zip(&next) {
            *u += beta * y;
            *v -= y;
        }
        (*du, *dv) = (u, v);
        products + 1
    }
}
