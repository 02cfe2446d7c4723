//! Exact flow without eigenvectors, for large meshes (theory §7).
//!
//! From the state at the start of a window, with `A = M_α⁻¹K_α`, `a₀ = ü_O` there and constant loads,
//!
//! ```text
//! u(t) = u₀ + S(t) v₀ + Z(t) a₀        C = cos(t√A),  S = ∫ C,  Z = ∫ S
//! v(t) = C(t) v₀ + S(t) a₀
//! ```
//!
//! (no static solution is needed, and rigid motions are no exception). With `Ã = 2A/ω_max² − I`, `R = t ω_max`,
//! `C = J₀(R) + 2 Σ (−1)^k J_2k(R) T_k(Ã)`; `S` and `Z` have the integrals of the Bessel functions instead:
//! `∫J_n = 2 Σ_j J_{n+2j+1}`, `∫∫J_n = 4 Σ_p p J_{n+2p}`. The vectors `T_k(Ã)v₀`, `T_k(Ã)a₀` do not depend on `t`: each monitor
//! becomes a series in scalar moments, known at every time of the window without further products, and
//! `|h⁗| ≤ ‖∇h‖_{M⁻¹} (‖A a₀‖_M + ‖A^{3/2} v₀‖_M)` makes its cubic Hermite interpolant a rigorous enclosure.

use std::cell::RefCell;
use std::rc::Rc;

use super::{Counters, Enclosure, Flow, FlowError, Layout};
use crate::contact::{Phase, Scratch, System};

/// Terms below this are left out.
const SMALLEST_TERM: f64 = 1e-18;
/// Length of the first window after a switch, and of the longest, in `R = t ω_max`.
const FIRST: f64 = 8.0;
const LONGEST: f64 = 480.0;
/// Memory for the vectors of a window, in numbers.
const MEMORY: usize = 60_000_000;

/// `J_0(x) … J_m(x)`, `m` large enough that all further ones are below 1e-18: Miller's backward
/// recurrence, normalised by `J₀ + 2 Σ J_2k = 1`.
pub fn bessel(x: f64) -> Vec<f64> {
    if x == 0.0 {
        return vec![1.0];
    }
    let top = (x + 16.0 * x.cbrt() + 48.0) as usize;
    let mut j = vec![0.0; top + 2];
    j[top] = 1e-300;
    for m in (1..=top).rev() {
        j[m - 1] = 2.0 * m as f64 / x * j[m] - j[m + 1];
        if j[m - 1].abs() > 1e200 {
            j[m - 1..].iter_mut().for_each(|v| *v *= 1e-250);
        }
    }
    let norm = j[0] + 2.0 * j.iter().skip(2).step_by(2).sum::<f64>();
    j.iter_mut().for_each(|v| *v /= norm);
    while j.len() > 1 && j[j.len() - 1].abs() < SMALLEST_TERM {
        j.pop();
    }
    j
}

/// Coefficients of `T_k` in `C`, `S` and `Z` at a time.
#[derive(Debug)]
struct Coefficients {
    c: Vec<f64>,
    s: Vec<f64>,
    z: Vec<f64>,
}

fn coefficients(t: f64, omega: f64, terms: usize) -> Coefficients {
    let j = bessel(t * omega);
    let at = |n: usize| j.get(n).copied().unwrap_or(0.0);
    let mut out = Coefficients { c: vec![0.0; terms], s: vec![0.0; terms], z: vec![0.0; terms] };
    // from the end: Σ_{i≥0} J_{n+2i+1}, and Σ_{p≥1} p J_{n+2p} = Σ_{p≥1} Σ_{q≥p} J_{n+2q}
    let highest = j.len() / 2 + 1;
    let (mut odd, mut even, mut double) = (0.0, 0.0, 0.0);
    for k in (0..highest.max(terms)).rev() {
        odd += at(2 * k + 1);
        even += at(2 * k + 2);
        double += even;
        if k < terms {
            let weight = if k == 0 { 1.0 } else { 2.0 } * if k % 2 == 0 { 1.0 } else { -1.0 };
            out.c[k] = weight * at(2 * k);
            out.s[k] = weight * 2.0 * odd / omega;
            out.z[k] = weight * 4.0 * double / (omega * omega);
        }
    }
    out
}

/// Carry a perturbation `(δu, δu̇)` over the time `tau` of a phase, without modes: `δu ← C δu + S δu̇`, `δu̇ ← C δu̇ − A S δu`. Returns the
/// number of products.
pub fn propagate(
    system: &System,
    phase: &Phase,
    tau: f64,
    scratch: &mut Scratch,
    (du, dv): (&mut Vec<f64>, &mut Vec<f64>),
) -> u64 {
    let n = du.len();
    let omega = system.units.highest;
    let terms = bessel(tau * omega).len() / 2 + 2;
    let f = coefficients(tau, omega, terms);
    let scale = 2.0 / (omega * omega);
    let mut last = [vec![0.0; n], vec![0.0; n]];
    let mut now = [du.clone(), dv.clone()];
    // C δu + S δu̇, C δu̇, S δu
    let [mut u, mut v, mut w] = [0; 3].map(|_| vec![0.0; n]);
    let mut next = [vec![0.0; n], vec![0.0; n]];
    for k in 0..terms {
        let (c, s) = (f.c[k], f.s[k]);
        for i in 0..n {
            u[i] += c * now[0][i] + s * now[1][i];
            v[i] += c * now[1][i];
            w[i] += s * now[0][i];
        }
        if k + 1 == terms {
            break;
        }
        let [y0, y1] = &mut next;
        phase.stiffness_products([&now[0], &now[1]], scratch, [y0, y1]);
        for p in 0..2 {
            for i in 0..n {
                let x = scale * next[p][i] - now[p][i];
                let y = if k == 0 { x } else { 2.0 * x - last[p][i] };
                (last[p][i], next[p][i]) = (now[p][i], y);
            }
        }
        std::mem::swap(&mut now, &mut next);
    }
    let zero = vec![0.0; n];
    let [y0, y1] = &mut next;
    phase.stiffness_products([&w, &zero], scratch, [y0, y1]);
    v.iter_mut().zip(&next[0]).for_each(|(v, y)| *v -= y);
    (*du, *dv) = (u, v);
    2 * terms as u64
}

/// Monitor values and slopes at one time.
type Values = (f64, Rc<(Vec<f64>, Vec<f64>)>);

/// The flow; see the module's text.
pub struct Chebyshev<'a> {
    system: &'a System,
    layout: Layout,
    scratch: Scratch,
    omega: f64,
    /// Bounds of `‖∇h‖_{M⁻¹}` of the phase's monitors.
    gradients: Vec<f64>,
    t0: f64,
    t1: f64,
    length: f64,
    start: Vec<f64>,
    /// State at the end of the window, once it has been asked for.
    end: Vec<f64>,
    end_known: bool,
    a0: Vec<f64>,
    /// `T_k(Ã)v₀` and `T_k(Ã)a₀`.
    v_terms: Vec<Vec<f64>>,
    a_terms: Vec<Vec<f64>>,
    /// Moments of the monitors, one row a term; values at the start.
    v_moments: Vec<Vec<f64>>,
    a_moments: Vec<Vec<f64>>,
    h0: Vec<f64>,
    fourth: Vec<f64>,
    values: RefCell<Vec<Values>>,
    counters: Counters,
}

impl<'a> Chebyshev<'a> {
    /// A flow for an undamped body under constant loads (the caller sees to that).
    pub fn new(system: &'a System) -> Self {
        let layout = Layout::new(system);
        let n = layout.len();
        Chebyshev {
            system,
            layout,
            scratch: system.scratch(),
            omega: system.units.highest,
            gradients: vec![],
            t0: 0.0,
            t1: 0.0,
            length: FIRST,
            start: vec![0.0; n],
            end: vec![0.0; n],
            end_known: true,
            a0: vec![0.0; layout.n_o],
            v_terms: vec![],
            a_terms: vec![],
            v_moments: vec![],
            a_moments: vec![],
            h0: vec![],
            fourth: vec![],
            values: RefCell::new(vec![]),
            counters: Counters::default(),
        }
    }

    /// `T_0 x … T_{terms−1} x` for `x = v₀` and `x = a₀`.
    fn recurrences(&mut self, phase: &Phase, v0: &[f64], a0: &[f64], terms: usize) {
        let scale = 2.0 / (self.omega * self.omega);
        let start = |mut old: Vec<Vec<f64>>, x: &[f64]| {
            old.resize(terms, vec![]);
            old.iter_mut().for_each(|v| v.resize(x.len(), 0.0));
            old[0].copy_from_slice(x);
            old
        };
        let mut v = start(std::mem::take(&mut self.v_terms), v0);
        let mut a = start(std::mem::take(&mut self.a_terms), a0);
        for k in 1..terms {
            let (mut next_v, mut next_a) = (std::mem::take(&mut v[k]), std::mem::take(&mut a[k]));
            let x = [&v[k - 1][..], &a[k - 1][..]];
            let y = [&mut next_v[..], &mut next_a[..]];
            phase.stiffness_products(x, &mut self.scratch, y);
            self.counters.products += 2;
            for (next, t) in [(&mut next_v, &v), (&mut next_a, &a)] {
                if k == 1 {
                    next.iter_mut().zip(&t[0]).for_each(|(n, x)| *n = scale * *n - x);
                } else {
                    for ((n, x), p) in next.iter_mut().zip(&t[k - 1]).zip(&t[k - 2]) {
                        *n = 2.0 * (scale * *n - x) - p;
                    }
                }
            }
            (v[k], a[k]) = (next_v, next_a);
        }
        (self.v_terms, self.a_terms) = (v, a);
    }

    /// The monitors' rates along each vector.
    fn moments(&self, phase: &Phase, terms: &[Vec<f64>]) -> Vec<Vec<f64>> {
        terms.iter().map(|x| phase.monitor_gradient_at(x)).collect()
    }

    /// `‖A x‖_M` from `T_0 x`, `T_1 x`, or `‖A^{3/2} x‖_M` with the stiffness for the mass.
    fn operator_norm(&mut self, phase: &Phase, terms: &[Vec<f64>], with_stiffness: bool) -> f64 {
        let half = 0.5 * self.omega * self.omega;
        let ax: Vec<f64> = terms[0].iter().zip(&terms[1]).map(|(x, y)| half * (x + y)).collect();
        phase.expand(&ax, &mut self.scratch.v);
        let matrix = if with_stiffness { &self.system.body.stiffness } else { self.system.mass() };
        matrix.quadratic(&self.scratch.v).max(0.0).sqrt()
    }

    fn write_state(&self, t: f64, y: &mut [f64]) {
        let n = self.layout.n_o;
        let tau = t - self.t0;
        let f = coefficients(tau, self.omega, self.v_terms.len());
        y.copy_from_slice(&self.start);
        let (u, v) = y.split_at_mut(n);
        let v = &mut v[..n];
        v.fill(0.0);
        for k in 0..self.v_terms.len() {
            let (c, s, z) = (f.c[k], f.s[k], f.z[k]);
            if c == 0.0 && s == 0.0 && z == 0.0 {
                continue;
            }
            let (tv, ta) = (&self.v_terms[k], &self.a_terms[k]);
            for j in 0..n {
                u[j] += s * tv[j] + z * ta[j];
                v[j] += c * tv[j] + s * ta[j];
            }
        }
    }

    fn monitors_at(&self, t: f64) -> Rc<(Vec<f64>, Vec<f64>)> {
        let mut values = self.values.borrow_mut();
        if let Some((_, known)) = values.iter().find(|(s, _)| *s == t) {
            return known.clone();
        }
        let f = coefficients(t - self.t0, self.omega, self.v_moments.len());
        let (mut h, mut rate) = (self.h0.clone(), vec![0.0; self.h0.len()]);
        for k in 0..self.v_moments.len() {
            let (c, s, z) = (f.c[k], f.s[k], f.z[k]);
            for (i, (mv, ma)) in self.v_moments[k].iter().zip(&self.a_moments[k]).enumerate() {
                h[i] += s * mv + z * ma;
                rate[i] += c * mv + s * ma;
            }
        }
        let new = Rc::new((h, rate));
        values.push((t, new.clone()));
        new
    }
}

impl Flow for Chebyshev<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.end.copy_from_slice(y);
        self.end_known = true;
        self.length = FIRST;
        self.gradients = phase.gradient_bounds();
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        if !self.omega.is_finite() {
            return Err(FlowError::NoBound);
        }
        let n = self.layout.n_o;
        // where the last window ended without an event, nobody has asked yet
        self.end_state();
        self.t0 = self.t1;
        std::mem::swap(&mut self.start, &mut self.end);
        let rest = t_limit - self.t0;
        let longest = (MEMORY as f64 / n as f64 - 40.0).clamp(FIRST, LONGEST);
        let length = self.length.min(longest) / self.omega;
        self.length = (2.0 * self.length).min(longest);
        let t = if length * 1.01 >= rest { t_limit } else { self.t0 + length };
        if t <= self.t0 {
            return Err(FlowError::StepTooSmall { t: self.t0, h: length });
        }
        let start = std::mem::take(&mut self.start);
        let (u0, v0) = (&start[..n], &start[n..2 * n]);
        let mut a0 = std::mem::take(&mut self.a0);
        phase.acceleration(self.t0, u0, v0, &mut self.scratch, &mut a0);
        self.counters.products += 1;
        // at least two terms, for the bounds
        let terms = (bessel((t - self.t0) * self.omega).len() / 2 + 1).max(2);
        self.recurrences(phase, v0, &a0, terms);
        self.v_moments = self.moments(phase, &self.v_terms);
        self.a_moments = self.moments(phase, &self.a_terms);
        self.h0.resize(phase.monitors.len(), 0.0);
        phase.monitor_values(self.t0, u0, &mut self.h0);
        (self.start, self.a0) = (start, a0);
        let (v_terms, a_terms) =
            (std::mem::take(&mut self.v_terms), std::mem::take(&mut self.a_terms));
        let bound =
            self.operator_norm(phase, &a_terms, false) + self.operator_norm(phase, &v_terms, true);
        (self.v_terms, self.a_terms) = (v_terms, a_terms);
        self.fourth = self.gradients.iter().map(|gradient| bound * gradient).collect();
        self.values.borrow_mut().clear();
        self.counters.steps += 1;
        self.cut(phase, t);
        // the recurrences carry whatever is not finite to their last terms
        let last = [self.v_terms.last(), self.a_terms.last()].into_iter().flatten().flatten();
        if self.start.iter().chain(last).any(|x| !x.is_finite()) {
            return Err(FlowError::NotFinite { t: self.t0 });
        }
        Ok(())
    }

    fn cut(&mut self, _: &Phase, t: f64) {
        self.t1 = t;
        self.end_known = false;
    }

    fn window(&self) -> (f64, f64) {
        (self.t0, self.t1)
    }

    fn end_state(&mut self) -> &[f64] {
        if !self.end_known {
            let mut end = std::mem::take(&mut self.end);
            self.write_state(self.t1, &mut end);
            self.end = end;
            self.end_known = true;
        }
        &self.end
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        if t == self.t1 && self.end_known {
            y.copy_from_slice(&self.end);
        } else {
            self.write_state(t, y);
        }
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        let (at_a, at_b) = (self.monitors_at(a), self.monitors_at(b));
        let ends = |x: &Rc<(Vec<f64>, Vec<f64>)>| (x.0[index], x.1[index]);
        Enclosure::hermite(ends(&at_a), ends(&at_b), b - a, self.fourth[index])
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn name(&self) -> &'static str {
        "chebyshev"
    }

    fn is_exact(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_are_those_of_the_tables() {
        // Abramowitz and Stegun, tables 9.1 and 9.4
        let j = bessel(5.0);
        assert!((j[0] + 0.177_596_771_314_338_3).abs() < 1e-15);
        assert!((j[1] + 0.327_579_137_591_465_2).abs() < 1e-15);
        assert!((j[10] - 1.467_802_647_310_474e-3).abs() < 1e-16);
        assert!((bessel(100.0)[0] - 0.019_985_850_304_223_12).abs() < 1e-14);
        assert!((bessel(1e-9)[1] - 0.5e-9).abs() < 1e-24);
    }

    #[test]
    fn series_sum_to_the_functions() {
        let omega = 3.0;
        for t in [1e-7, 0.01, 1.0, 20.0, 100.0] {
            let f = coefficients(t, omega, bessel(t * omega).len() / 2 + 1);
            for w in [1e-3, 0.5, 1.7, 2.999] {
                let x: f64 = 2.0 * (w / omega) * (w / omega) - 1.0;
                let chebyshev = |c: &[f64]| -> f64 {
                    c.iter().enumerate().map(|(k, c)| c * (k as f64 * x.acos()).cos()).sum()
                };
                assert!((chebyshev(&f.c) - (w * t).cos()).abs() < 1e-12);
                assert!((chebyshev(&f.s) - (w * t).sin() / w).abs() < 1e-12 * t.max(1.0));
                let z = 2.0 * (0.5 * w * t).sin().powi(2) / (w * w);
                assert!((chebyshev(&f.z) - z).abs() < 1e-12 * (t * t).max(1.0), "{t} {w}");
            }
        }
    }
}
