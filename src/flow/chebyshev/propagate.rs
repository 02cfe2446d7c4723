//! Perturbations along the homogeneous flow of a phase, without modes.

use super::length::Lengths;
use crate::contact::{Phase, Scratch, System};

/// Carries perturbations of one body over phases.
#[derive(Debug)]
pub struct Tangent<'a> {
    system: &'a System,
    lengths: Lengths,
    scratch: Scratch,
}

impl<'a> Tangent<'a> {
    /// Of a body whose frequencies are bounded.
    pub fn new(system: &'a System) -> Tangent<'a> {
        let lengths = Lengths::new(system.units.highest, system.damping);
        Tangent { system, lengths, scratch: system.scratch() }
    }

    /// Carry `(δu, δu̇)` over the time `tau` of a phase: `δu ← (g′ + αg) δu + g δu̇ + βS g δu`, `δu̇ ← g′ δu̇ − S g δu`. Returns the number of products.
    pub fn carry(
        &mut self,
        phase: &Phase,
        tau: f64,
        (du, dv): (&mut Vec<f64>, &mut Vec<f64>),
    ) -> u64 {
        let n = du.len();
        let omega = self.system.units.highest;
        let (alpha, beta) = self.system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let terms = self.lengths.of(tau).terms;
        let nodes = self.lengths.nodes(terms);
        let f = nodes.functions(tau);
        let (rate, g) = (nodes.coefficients(&f.rate), nodes.coefficients(&f.g));
        let scale = 2.0 / (omega * omega);
        let mut last = [vec![0.0; n], vec![0.0; n]];
        let mut now = [du.clone(), dv.clone()];
        // (g′ + αg) δu + g δu̇, g′ δu̇, g δu
        let [mut u, mut v, mut w] = [0; 3].map(|_| vec![0.0; n]);
        let mut next = [vec![0.0; n], vec![0.0; n]];
        for k in 0..terms {
            let (rate, g) = (rate[k], g[k]);
            for i in 0..n {
                u[i] += (rate + alpha * g) * now[0][i] + g * now[1][i];
                v[i] += rate * now[1][i];
                w[i] += g * now[0][i];
            }
            if k + 1 == terms {
                break;
            }
            let [y0, y1] = &mut next;
            phase.stiffness_products([&now[0], &now[1]], &mut self.scratch, [y0, y1]);
            for p in 0..2 {
                for i in 0..n {
                    let x = scale * next[p][i] - now[p][i];
                    let y = if k == 0 { x } else { 2.0 * x - last[p][i] };
                    (last[p][i], next[p][i]) = (now[p][i], y);
                }
            }
            std::mem::swap(&mut now, &mut next);
        }
        phase.stiffness_product(&w, &mut self.scratch, &mut next[0]);
        for ((u, v), y) in u.iter_mut().zip(&mut v).zip(&next[0]) {
            *u += beta * y;
            *v -= y;
        }
        (*du, *dv) = (u, v);
        2 * terms as u64 - 1
    }
}
