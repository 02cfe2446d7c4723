//! Work of harmonic loads and dissipated energy in a window, in closed form.
//!
//! With the velocities `v = g′(S)v₀ + g(S)a₀ + Re[z p′(S)]b`, the work `∫ cos(ωt + φ) Fᵀv` is a sum over the pseudo-modes of `F`'s row. The dissipated
//! energy `∫ vᵀ(αM + βK)v = Σ_xy ⟨x, f_xy(S) y⟩_M`, with `f_xy = ∫(α + βs) f_x f_y` over the velocity functions of two vectors, needs the moments
//!
//! ```text
//! ⟨x, T_{2k} y⟩ = 2⟨T_k x, T_k y⟩ − ⟨x, y⟩,   ⟨x, T_{2k+1} y⟩ = 2⟨T_k x, T_{k+1} y⟩ − ⟨x, T_1 y⟩
//! ```
//!
//! (`S` is self-adjoint in `M`), which turn into weights of twice as many nodes: no time stepping, and independent of the balance of energy.

use std::rc::Rc;

use nalgebra::Complex;

use super::drive::{Split, amplitude};
use super::nodes::Nodes;
use super::series::dot;
use crate::contact::System;
use crate::fem::Harmonic;
use crate::flow::exponential::{Term, product_integral};
use crate::flow::oscillator::{GAUSS10, Oscillator};

/// What the powers of one window are made of.
#[derive(Debug)]
pub(super) struct Powers {
    /// Twice as many nodes less one, and the weights of each pair of vectors (of different ones twice).
    nodes: Rc<Nodes>,
    pairs: Vec<((usize, usize), Vec<f64>)>,
}

/// The velocity of one pseudo-mode along each vector, as sums of exponentials over `[0, h]`; none where they are no such sums.
fn velocities(
    mode: &Oscillator,
    loads: &[Vec<&Harmonic>],
    (t0, h): (f64, f64),
) -> Option<Vec<Vec<Term>>> {
    let free =
        |start: (f64, f64)| -> Option<Vec<Term>> { Some(mode.free(start, 0.0, h)?.to_vec()) };
    let mut all = vec![free((1.0, -2.0 * mode.c))?, free((0.0, 1.0))?];
    for loads in loads {
        let mut start = (0.0, 0.0);
        let mut terms = vec![];
        for load in loads {
            let part = Split::of(mode, load.omega, amplitude(load, t0))?;
            start = (start.0 + part.free.0, start.1 + part.free.1);
            let s = Complex::new(0.0, load.omega);
            terms.push(Term { c: s * part.steady, s, growth: (s * h).exp() });
        }
        terms.extend(free(start)?);
        all.push(terms);
    }
    Some(
        all.into_iter()
            .map(|t| t.into_iter().filter(|t| t.c != Complex::default()).collect())
            .collect(),
    )
}

/// `∫ Re(Σx) Re(Σy)` over `[0, h]`.
fn integral(x: &[Term], y: &[Term], h: f64) -> f64 {
    x.iter().flat_map(|x| y.iter().map(move |y| product_integral(x, y, h))).sum()
}

/// The points of a Gauss–Legendre rule that resolves one pseudo-mode under its loads on `[0, h]`, with the velocity along each vector there.
fn points(
    mode: &Oscillator,
    loads: &[Vec<&Harmonic>],
    (t0, h): (f64, f64),
    mut each: impl FnMut(f64, f64, &[f64]),
) {
    let highest = loads.iter().flatten().map(|l| l.omega).fold(0.0, f64::max);
    let panels = (0.5 * h * (mode.omega + highest).max(2.0 * mode.c)).ceil().max(1.0);
    let step = h / panels;
    for k in 0..panels as usize {
        let middle = (k as f64 + 0.5) * step;
        for (x, weight) in GAUSS10 {
            for t in [middle - 0.5 * step * x, middle + 0.5 * step * x] {
                let basis = mode.basis(t);
                let mut v = vec![basis.ds, basis.s];
                v.extend(loads.iter().map(|loads| -> f64 {
                    let rate =
                        |l: &&Harmonic| amplitude(l, t0) * mode.response_from_rest(l.omega, t)[1];
                    loads.iter().map(|l| rate(l).re).sum()
                }));
                each(t, 0.5 * step * weight, &v);
            }
        }
    }
}

/// `Σ ∫ cos(ωt + φ) Fᵀv` from `t0` over `h`: `weights` are those of the vectors on the nodes, with the rows of the forces from `first` on.
pub(super) fn work(
    nodes: &Nodes,
    weights: &[Vec<Vec<f64>>],
    first: usize,
    loads: &[Vec<&Harmonic>],
    (t0, h): (f64, f64),
) -> f64 {
    let mut sum = 0.0;
    for (j, mode) in nodes.modes.iter().enumerate() {
        let row = |x: usize, shape: usize| weights[x][j][first + shape];
        if let Some(velocities) = velocities(mode, loads, (t0, h)) {
            for (shape, loads) in loads.iter().enumerate() {
                for load in loads {
                    let s = Complex::new(0.0, load.omega);
                    let force = [Term { c: amplitude(load, t0), s, growth: (s * h).exp() }];
                    let along = velocities.iter().enumerate();
                    sum += along.map(|(x, v)| row(x, shape) * integral(v, &force, h)).sum::<f64>();
                }
            }
            continue;
        }
        points(mode, loads, (t0, h), |t, weight, v| {
            for (shape, loads) in loads.iter().enumerate() {
                let force: f64 = loads.iter().map(|l| l.factor(t0 + t, 0)).sum();
                let along = v.iter().enumerate().map(|(x, v)| row(x, shape) * v);
                sum += weight * force * along.sum::<f64>();
            }
        });
    }
    sum
}

impl Powers {
    /// Of the vectors of a window, `N` terms `A*T_k x` each; `nodes` has `2N − 1`.
    pub fn new(system: &System, nodes: Rc<Nodes>, vectors: &[&[Vec<f64>]]) -> Powers {
        let terms = vectors[0].len();
        let pairs: Vec<(usize, usize)> =
            (0..vectors.len()).flat_map(|x| (x..vectors.len()).map(move |y| (x, y))).collect();
        let mut moments = vec![vec![0.0; pairs.len()]; 2 * terms - 1];
        // M*A*T_k x of all vectors
        let mut heavy = vec![vec![0.0; system.n()]; vectors.len()];
        for k in 0..terms {
            heavy.iter_mut().zip(vectors).for_each(|(h, x)| system.mass_product(&x[k], h));
            for (p, &(x, y)) in pairs.iter().enumerate() {
                let even = dot(&heavy[x], &vectors[y][k]);
                moments[2 * k][p] = if k == 0 { even } else { 2.0 * even - moments[0][p] };
                if k + 1 < terms {
                    let odd = dot(&heavy[x], &vectors[y][k + 1]);
                    moments[2 * k + 1][p] = if k == 0 { odd } else { 2.0 * odd - moments[1][p] };
                }
            }
        }
        let weights = nodes.spread(&moments);
        let of_pair = |(p, (x, y)): (usize, (usize, usize))| {
            let twice = if x == y { 1.0 } else { 2.0 };
            ((x, y), weights.iter().map(|w| twice * w[p]).collect())
        };
        let pairs = pairs.into_iter().enumerate().map(of_pair).collect();
        Powers { nodes, pairs }
    }

    /// `∫ vᵀ(αM + βK)v` over `h` from the start `t0` of the window.
    pub fn dissipated(&self, loads: &[Vec<&Harmonic>], (t0, h): (f64, f64)) -> f64 {
        let mut sum = 0.0;
        for (j, mode) in self.nodes.modes.iter().enumerate() {
            let rate = 2.0 * mode.c;
            match velocities(mode, loads, (t0, h)) {
                Some(v) => {
                    for ((x, y), weights) in &self.pairs {
                        sum += rate * weights[j] * integral(&v[*x], &v[*y], h);
                    }
                }
                None => points(mode, loads, (t0, h), |_, weight, v| {
                    for ((x, y), weights) in &self.pairs {
                        sum += weight * rate * weights[j] * v[*x] * v[*y];
                    }
                }),
            }
        }
        sum
    }
}
