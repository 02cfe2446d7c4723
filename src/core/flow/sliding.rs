//! Coordinates beside the coupled ones: of phases in which points slip, or stick.
//!
//! With the natural modes of the elastic body, what sticks held, and static shapes of what sticks the coordinates are `q = (q_r, q_e, q_s)`: rigid motions,
//! elastic modes, displacements that stick,
//!
//! ```text
//! q̈_e + D q̇_e + K̂_ee q_e = F_e − K̂_es q_s
//! q̈_r + α q̇_r            = F_r − K̂_re q_e − D_re q̇_e − K̂_rs q_s
//! q_s = q_s⁰ + V t
//! ```
//!
//! for a rigid motion changes no pressure: `K̂` has no columns there. The elastic modes alone are an eigenproblem without zero eigenvalues; rigid motions
//! follow from them in closed form.

use faer::Mat;
use nalgebra::{Complex, DMatrix};

use super::coupled::{Amplitudes, CoupledMotion, Coupling, Operators, Rows};
use super::defect::Defect;
use super::exponential::power;
use crate::fem::FemError;
use crate::fem::dense::product;

type C = Complex<f64>;

/// The complex modes of a phase with the coordinates beside them.
#[derive(Debug)]
pub struct Coupled {
    /// Of `q_e`; of phases without friction all coordinates.
    modes: Coupling,
    /// Numbers of rigid motions, of elastic modes, of displacements that stick.
    counts: [usize; 3],
    alpha: f64,
    /// `K̂_re` and `D_re`
    cascade: [Mat<f64>; 2],
    /// `K̂_rs` over `K̂_es`
    feed: Mat<f64>,
    /// `q_r` of each mode: real and imaginary part.
    rigid: [Mat<f64>; 2],
    /// Forces on `q_r`: the constant one, those of the harmonic loads.
    rigid_forces: Vec<Vec<f64>>,
    /// `K̂`, `D` over all coordinates that move.
    whole: Operators,
}

/// Eigenvalues below this share of the largest are none to divide by.
const SINGULAR: f64 = 1e-7;

impl Coupled {
    /// The complex modes; `operators` are over all coordinates, of which the first `rigid` are rigid motions apart from the others and the last `frozen` stick.
    pub fn new(
        operators: Operators,
        scale: &[f64],
        (rigid, frozen): (usize, usize),
        alpha: f64,
        rows: Rows,
        forces: &[&[f64]],
    ) -> Result<Coupled, FemError> {
        let n = scale.len();
        let elastic = n - rigid - frozen;
        let moving = rigid + elastic;
        let range = rigid..moving;
        let k = &operators.stiffness;
        let part = |a: &Mat<f64>, i: usize, j: usize, rows: usize, columns: usize| {
            a.submatrix(i, j, rows, columns).to_owned()
        };
        let cascade = [k, &operators.damping].map(|a| part(a, 0, rigid, rigid, elastic));
        let feed = part(k, 0, moving, moving, frozen);
        let inner = match (rigid, frozen) {
            (0, 0) => operators.clone(),
            _ => Operators {
                stiffness: part(k, rigid, rigid, elastic, elastic),
                damping: part(&operators.damping, rigid, rigid, elastic, elastic),
                skew: None,
            },
        };
        let of_inner = |m: &DMatrix<f64>| m.columns(rigid, elastic).into_owned();
        let inner_rows = (of_inner(rows.0), rows.1.map(of_inner));
        let inner_forces: Vec<&[f64]> = forces.iter().map(|f| &f[range.clone()]).collect();
        let mut modes = Coupling::new(
            inner,
            &scale[range],
            (&inner_rows.0, inner_rows.1.as_ref()),
            &inner_forces,
        )?;
        // q_r of a mode: −(K̂_re + λD_re) U/(λ² + αλ)
        let p = modes.lambda().len();
        let mut shapes = [Mat::<f64>::zeros(rigid, p), Mat::<f64>::zeros(rigid, p)];
        for (c, l) in modes.lambda().to_vec().into_iter().enumerate() {
            let u = modes.shape(c);
            let mut along = vec![C::default(); rigid];
            for (i, x) in along.iter_mut().enumerate() {
                let [stiff, damps] = &cascade;
                let sum: C = (0..elastic).map(|j| u[j] * (stiff[(i, j)] + l * damps[(i, j)])).sum();
                // what does not pull it leaves it at rest, resonant or not
                *x = if sum == C::default() { sum } else { -sum / (l * l + l * alpha) };
                shapes[0][(i, c)] = x.re;
                shapes[1][(i, c)] = x.im;
            }
            for k in 0..rows.0.nrows() {
                let of_q: C = (0..rigid).map(|i| along[i] * rows.0[(k, i)]).sum();
                let of_v: C = rows
                    .1
                    .map_or(C::default(), |r| (0..rigid).map(|i| along[i] * l * r[(k, i)]).sum());
                modes.add_to_row(k, c, of_q + of_v);
            }
        }
        let rigid_forces = forces.iter().map(|f| f[..rigid].to_vec()).collect();
        Ok(Coupled {
            modes,
            counts: [rigid, elastic, frozen],
            alpha,
            cascade,
            feed,
            rigid: shapes,
            rigid_forces,
            whole: operators,
        })
    }

    /// The complex modes of `q_e`.
    pub fn modes(&self) -> &Coupling {
        &self.modes
    }

    /// Whether an eigenvalue vanishes beside those of the rigid motions, or is `−α` as of one: points that slip against each other may leave a body no stiffness, and then no load has
    /// a steady response.
    pub fn is_singular(&self) -> bool {
        let lambda = self.modes.lambda();
        let largest = lambda.iter().fold(0.0f64, |m, l| m.max(l.norm()));
        let is_rigid = |l: &C| self.counts[0] > 0 && (l + self.alpha).norm() < SINGULAR * largest;
        lambda.iter().any(|l| l.norm() < SINGULAR * largest || is_rigid(l))
    }

    /// `λ` and the coordinates that move of each complex mode with `Im λ ≥ 0`, rigid motions by themselves left out.
    pub fn complex_modes(&self) -> Vec<(C, Vec<C>)> {
        let [rigid, elastic, _] = self.counts;
        let of_mode = |(k, l): (usize, &C)| {
            let of_rigid = (0..rigid).map(|i| C::new(self.rigid[0][(i, k)], self.rigid[1][(i, k)]));
            let shape = self.modes.shape(k);
            (*l, of_rigid.chain(shape[..elastic].iter().copied()).collect())
        };
        self.modes.lambda().iter().enumerate().map(of_mode).collect()
    }

    /// Whether rigid motions stand beside the elastic ones.
    pub(super) fn has_rigid(&self) -> bool {
        self.counts[0] > 0
    }

    /// Where rigid motions end and where what sticks begins.
    fn bounds(&self) -> (usize, usize) {
        (self.counts[0], self.counts[0] + self.counts[1])
    }

    /// `D`
    pub fn damping(&self) -> &Mat<f64> {
        &self.whole.damping
    }

    /// The same phase under another mass-proportional damping, `alpha` more.
    pub fn shifted(&self, alpha: f64, scale: &[f64], rows: Rows) -> Result<Coupled, FemError> {
        let (mut operators, (first, last)) = (self.whole.clone(), self.bounds());
        (0..last).for_each(|i| operators.damping[(i, i)] += alpha);
        let outer = (first, self.counts[2]);
        Coupled::new(operators, scale, outer, self.alpha + alpha, rows, &[])
    }

    /// The homogeneous flow over `tau` of columns `[Q | V]`, `k` of each; what sticks keeps its displacement, and has no velocity of its own.
    pub fn carry(&self, b: &mut Mat<f64>, k: usize, tau: f64) {
        let (first, last) = self.bounds();
        let (rigid, elastic) = (first, last - first);
        // K̂_rs q_s over K̂_es q_s
        let pull = product(self.feed.as_ref(), b.submatrix(last, 0, self.counts[2], k));
        let start = Mat::from_fn(2 * elastic, k, |i, c| {
            if i < elastic { b[(first + i, c)] } else { b[(first + i - elastic, k + c)] }
        });
        let lambda = self.modes.lambda();
        let mut free = self.modes.amplitudes_of(start.as_ref());
        let mut statics = Mat::zeros(2 * elastic, k);
        if self.counts[2] > 0 {
            let force = Mat::from_fn(2 * elastic, k, |i, c| {
                if i < elastic { 0.0 } else { -pull[(rigid + i - elastic, c)] }
            });
            let quiet: Vec<C> = lambda.iter().map(|l| -1.0 / l).collect();
            let steady = self.modes.amplitudes_of(force.as_ref()).scaled(&quiet);
            free = free.minus(&steady);
            statics = self.modes.columns_of(&steady);
        }
        let growth: Vec<C> = lambda.iter().map(|l| power(l * tau)).collect();
        let grown = free.scaled(&growth);
        let moved = self.modes.columns_of(&grown);
        if rigid > 0 {
            let [g, once, _] = powers_of_time(self.alpha, tau);
            let decay = power(C::from(-self.alpha * tau)).re;
            let rates = |a: &Amplitudes| a.scaled(lambda).seen_by(&self.rigid);
            let (q0, v0) = (free.seen_by(&self.rigid), rates(&free));
            let (q1, v1) = (grown.seen_by(&self.rigid), rates(&grown));
            let along = product(self.cascade[0].as_ref(), statics.submatrix(0, 0, elastic, k));
            for c in 0..k {
                for i in 0..rigid {
                    let (x, dx) = (b[(i, c)] - q0[(i, c)], b[(i, k + c)] - v0[(i, c)]);
                    let force = -pull[(i, c)] - along[(i, c)];
                    b[(i, c)] = q1[(i, c)] + x + dx * g + force * once;
                    b[(i, k + c)] = v1[(i, c)] + dx * decay + force * g;
                }
            }
        }
        for c in 0..k {
            for i in 0..elastic {
                b[(first + i, c)] = moved[(i, c)] + statics[(i, c)];
                b[(first + i, k + c)] = moved[(elastic + i, c)];
            }
        }
    }

    /// A rigid motion and its rate in the modes of these amplitudes.
    fn rigid_in(&self, i: usize, amplitudes: &[C]) -> (f64, f64) {
        let each = amplitudes.iter().zip(self.modes.lambda()).enumerate();
        each.fold((0.0, 0.0), |(q, v), (k, (a, l))| {
            let z = a * C::new(self.rigid[0][(i, k)], self.rigid[1][(i, k)]);
            (q + z.re, v + (z * l).re)
        })
    }

    /// Acceleration `F − D q̇ − K̂ q` at a state, `force` the loads there; what sticks has none.
    pub fn acceleration(&self, q: &[f64], v: &[f64], force: &[f64], a: &mut [f64]) {
        let last = self.bounds().1;
        super::coupled::acceleration(&self.whole, q, v, force, a);
        a[last..].fill(0.0);
    }
}

/// A motion of such a phase.
#[derive(Debug)]
pub struct SlidingMotion {
    inner: CoupledMotion,
    /// `q_r` and `q̇_r` at the start of the part that is a polynomial and `e^{−αt}`; its force and the rate of that.
    rigid: Vec<[f64; 4]>,
    /// `q_r` in the response to each harmonic load.
    driven: Vec<Vec<C>>,
    /// `q_s` and its velocity at the start.
    frozen: Vec<(f64, f64)>,
}

/// `g = (1 − e^{−αt})/α` and its integrals, once and twice.
fn powers_of_time(alpha: f64, t: f64) -> [f64; 3] {
    let x = alpha * t;
    if x.abs() > 0.5 {
        let g = -(-x).exp_m1() / alpha;
        let once = (t - g) / alpha;
        return [g, once, (0.5 * t * t - once) / alpha];
    }
    // Σ (−x)^k/(k + m)! t^m
    let series = |m: i32| {
        let (mut sum, mut term) = (0.0, (1..=m).fold(1.0, |p, k| p / f64::from(k)));
        for k in 0..20 {
            sum += term;
            term *= -x / f64::from(k + 1 + m);
        }
        sum * t.powi(m)
    };
    [series(1), series(2), series(3)]
}

impl SlidingMotion {
    /// The motion from `x = (q, q̇)` at the start; of each harmonic load `Ω`, its angle there and its size. None where a load is at an eigenvalue.
    pub fn new(phase: &Coupled, q: &[f64], v: &[f64], loads: &[(f64, f64, f64)]) -> Option<Self> {
        let [rigid, elastic, _] = phase.counts;
        let (first, last) = phase.bounds();
        // what the displacements that stick push, and how fast that grows
        let fed = |i: usize, x: &[f64]| -> f64 {
            -x[last..].iter().enumerate().map(|(k, x)| phase.feed[(i, k)] * x).sum::<f64>()
        };
        let constant: Vec<f64> = (first..last).map(|i| fed(i, q)).collect();
        let ramp: Vec<f64> = (first..last).map(|i| fed(i, v)).collect();
        let x = [&q[first..last], &v[first..last]].concat();
        let inner = CoupledMotion::new(&phase.modes, &x, loads, (&constant, &ramp))?;
        let frozen = q[last..].iter().zip(&v[last..]).map(|(q, v)| (*q, *v)).collect();
        let mut motion = SlidingMotion { inner, rigid: vec![], driven: vec![], frozen };
        let along = |i: usize, x: &dyn Fn(usize) -> C, rate: C| -> C {
            let [stiff, damps] = &phase.cascade;
            (0..elastic).map(|j| x(j) * (stiff[(i, j)] + rate * damps[(i, j)])).sum()
        };
        for (j, &(omega, angle, size)) in loads.iter().enumerate().filter(|_| rigid > 0) {
            let response = &motion.inner.driven()[j].1;
            let of = |i: usize| {
                let force = C::from_polar(size * phase.rigid_forces[1 + j][i], angle);
                let denominator = C::new(-omega * omega, phase.alpha * omega);
                (force - along(i, &|e| response[e], C::new(0.0, omega))) / denominator
            };
            motion.driven.push((0..rigid).map(of).collect());
        }
        for i in 0..rigid {
            let free = phase.rigid_in(i, motion.inner.amplitudes());
            let (mut x, mut dx) = (q[i] - free.0, v[i] - free.1);
            for (p, &(omega, ..)) in motion.driven.iter().zip(loads) {
                x -= p[i].re;
                dx -= (p[i] * C::new(0.0, omega)).re;
            }
            let [steady, ramp] = motion.inner.polynomial();
            let over = |x: &[f64], which: usize| -> f64 {
                let each = x.iter().take(elastic).enumerate();
                each.map(|(j, x)| x * phase.cascade[which][(i, j)]).sum()
            };
            let force = phase.rigid_forces[0][i] + fed(i, q) - over(steady, 0) - over(ramp, 1);
            let rate = fed(i, v) - over(ramp, 0);
            motion.rigid.push([x, dx, force, rate]);
        }
        Some(motion)
    }

    /// The steady response `(q, q̇)` to the loads at the start, of all coordinates: what sticks does not respond, and constant forces have none along rigid motions.
    pub fn response(&self, phase: &Coupled) -> Vec<f64> {
        let ((first, last), n) = (phase.bounds(), phase.counts.iter().sum::<usize>());
        let inner = self.inner.response();
        let mut x = vec![0.0; 2 * n];
        x[first..last].copy_from_slice(&inner[..last - first]);
        x[n + first..n + last].copy_from_slice(&inner[last - first..]);
        for (p, (omega, _)) in self.driven.iter().zip(self.inner.driven()) {
            for (i, p) in p.iter().enumerate() {
                x[i] += p.re;
                x[n + i] += (p * C::new(0.0, *omega)).re;
            }
        }
        x
    }

    /// The motion of the coupled coordinates.
    pub fn inner(&self) -> &CoupledMotion {
        &self.inner
    }

    /// `(q, q̇)` at some times after the start, one behind the other.
    pub fn at(&self, phase: &Coupled, taus: &[f64], q: &mut [f64], v: &mut [f64]) {
        let n = phase.counts.iter().sum::<usize>().max(1);
        let (elastic, grown) = self.inner.at(&phase.modes, taus);
        let columns = q.chunks_exact_mut(n).zip(v.chunks_exact_mut(n));
        for ((j, tau), (q, v)) in taus.iter().enumerate().zip(columns) {
            self.complete(phase, *tau, (elastic.col_as_slice(j), &grown[j]), q, v);
        }
    }

    /// All coordinates at `tau`, where the elastic ones and the amplitudes of the modes are known.
    fn complete(
        &self,
        phase: &Coupled,
        tau: f64,
        (elastic, grown): (&[f64], &[C]),
        q: &mut [f64],
        v: &mut [f64],
    ) {
        let (first, last) = phase.bounds();
        q[first..last].copy_from_slice(&elastic[..last - first]);
        v[first..last].copy_from_slice(&elastic[last - first..]);
        for (k, &(x, dx)) in self.frozen.iter().enumerate() {
            (q[last + k], v[last + k]) = (x + dx * tau, dx);
        }
        if first == 0 {
            return;
        }
        let [g, once, twice] = powers_of_time(phase.alpha, tau);
        let decay = power(C::from(-phase.alpha * tau)).re;
        for (i, &[x, dx, force, rate]) in self.rigid.iter().enumerate() {
            let free = phase.rigid_in(i, grown);
            q[i] = free.0 + x + dx * g + force * once + rate * twice;
            v[i] = free.1 + dx * decay + force * g + rate * once;
            for (p, (omega, _)) in self.driven.iter().zip(self.inner.driven()) {
                let z = p[i] * C::from_polar(1.0, omega * tau);
                q[i] += z.re;
                v[i] += (z * C::new(0.0, *omega)).re;
            }
        }
    }

    /// Bounds of the changing part of each monitor and of its fourth derivative from `tau` to `end` after the start (theory §12, H2).
    pub fn bounds(&self, phase: &Coupled, rows: Rows, tau: f64, end: f64) -> [Vec<f64>; 2] {
        let (first, last) = phase.bounds();
        let [mut size, mut fourth] = self.inner.bounds(&phase.modes, tau, end);
        let velocity = |i: usize, j: usize| rows.1.map_or(0.0, |r| r[(i, j)]);
        for i in 0..size.len() {
            for (j, (omega, response)) in self.inner.driven().iter().enumerate() {
                let turn = C::new(0.0, *omega);
                let (q, v) = response.split_at(response.len() / 2);
                let mut along = C::default();
                for (e, (q, v)) in q.iter().zip(v).enumerate() {
                    along += q * rows.0[(i, first + e)] + v * velocity(i, first + e);
                }
                for (r, p) in self.driven.get(j).into_iter().flatten().enumerate() {
                    along += p * (rows.0[(i, r)] + turn * velocity(i, r));
                }
                size[i] += along.norm();
                fourth[i] += along.norm() * omega.powi(4);
            }
            // e^{−αt} and polynomials
            let a = phase.alpha.abs();
            let grown = power(C::from((-phase.alpha * end).max(0.0))).re;
            for (r, &[_, dx, force, rate]) in self.rigid.iter().enumerate() {
                let (of_q, of_v) = (rows.0[(i, r)].abs(), velocity(i, r).abs());
                let (dx, force, rate) = (dx.abs(), force.abs(), rate.abs());
                let moved = dx * end + 0.5 * force * end * end + rate * end.powi(3) / 6.0;
                let sped = dx + force * end + 0.5 * rate * end * end;
                let third = a * a * dx + a * force + rate;
                size[i] += grown * (of_q * moved + of_v * sped);
                fourth[i] += grown * (of_q * a + of_v * a * a) * third;
            }
            for (k, &(_, dx)) in self.frozen.iter().enumerate() {
                size[i] += rows.0[(i, last + k)].abs() * dx.abs() * end;
            }
            let [_, ramp] = self.inner.polynomial();
            let along = ramp.iter().take(last - first).enumerate();
            let along = along.map(|(e, r)| rows.0[(i, first + e)] * r);
            size[i] += end * along.sum::<f64>().abs();
        }
        [size, fourth]
    }

    /// How far each monitor may be at `tau` from that of the equations that start in the same state (theory §12, H4).
    pub(super) fn deviations(
        &self,
        phase: &Coupled,
        rows: Rows,
        natural: (Defect, f64),
        tau: f64,
    ) -> Vec<f64> {
        let (first, last) = phase.bounds();
        let of = |m: &DMatrix<f64>| m.columns(first, last - first).into_owned();
        let inner = (of(rows.0), rows.1.map(of));
        self.inner.deviations(&phase.modes, (&inner.0, inner.1.as_ref()), natural, tau)
    }

    /// Whether no amplitude changes.
    pub(crate) fn is_steady(&self, phase: &Coupled) -> bool {
        phase.counts[0] == 0 && phase.counts[2] == 0 && self.inner.is_steady(&phase.modes)
    }
}

#[cfg(test)]
mod tests {
    use super::powers_of_time;

    #[test]
    fn integrals_of_a_decay_are_each_others_derivatives() {
        for alpha in [0.0, 0.3, 2.0, -0.7] {
            for t in [0.1, 0.9, 3.0] {
                let (h, all) = (1e-5, powers_of_time(alpha, t));
                let (up, down) = (powers_of_time(alpha, t + h), powers_of_time(alpha, t - h));
                let slope = |k: usize| (up[k] - down[k]) / (2.0 * h);
                assert!((slope(0) - (-alpha * t).exp()).abs() < 1e-8 * (-alpha * t).exp().max(1.0));
                assert!((slope(1) - all[0]).abs() < 1e-8 * all[0]);
                assert!((slope(2) - all[1]).abs() < 1e-8 * all[1].max(1e-3));
            }
        }
    }
}
