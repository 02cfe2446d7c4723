//! Phases that natural modes do not decouple: structural damping beside springs of the obstacle, forces without a potential.
//!
//! In coordinates `q` in which the mass is the identity,
//!
//! ```text
//! q̈ + D q̇ + K̂ q = F₀ + Σ_j F_j cos(Ω_j t + φ_j),      A = [0, I; −K̂, −D],      A U = U Λ,      W = U⁻¹
//! ```
//!
//! and the state is a sum of exponentials, `x(t) = Re Σ_k U_k a_k e^{λ_k t} + x₀ + Re Σ_j P_j e^{iΩ_j t}`, over the eigenvalues with `Im λ ≥ 0`:
//! known at every time to rounding errors, as far as the eigenvectors are independent. Work and dissipation are integrals of products of
//! exponentials, in closed form.

use std::cell::OnceCell;

use faer::{Mat, MatRef};
use nalgebra::{Complex, DMatrix};

use super::defect::{Defect, dot};
use super::eigenpairs::{Eigenpairs, companion};
use super::exponential::{Term, difference, integral, pair_integral, power};
use crate::fem::FemError;
use crate::fem::dense::product;

type C = Complex<f64>;

/// A load this near to an eigenvalue, over its size, has no steady response that could be computed with.
const RESONANCE: f64 = 1e-7;

/// The gradients of the monitors over `q` and, where there are such, over `q̇`.
pub type Rows<'a> = (&'a DMatrix<f64>, Option<&'a DMatrix<f64>>);

/// The operators of a coupled phase.
#[derive(Debug, Clone)]
pub struct Operators {
    /// `K̂`
    pub stiffness: Mat<f64>,
    /// `D`
    pub damping: Mat<f64>,
    /// `(N, r)`: forces without a potential, `N q + r`.
    pub skew: Option<(Mat<f64>, Vec<f64>)>,
}

/// What is left of damping beside rigid motions by rounding, over the largest.
const APART: f64 = 1e-12;

impl Operators {
    /// Whether nothing but `α` damps the first `rigid` of the coordinates that move, and no other damps with them: dampers and ratios of modes may.
    pub fn leave_apart(&self, (rigid, n): (usize, usize), alpha: f64) -> bool {
        let d = &self.damping;
        let largest = (0..n).fold(0.0f64, |m, i| m.max(d[(i, i)].abs()));
        let plain = |i: usize, j: usize| if i == j { alpha } else { 0.0 };
        let is_plain = |i: usize, j: usize| (d[(i, j)] - plain(i, j)).abs() <= APART * largest;
        // they damp nothing; what damps them besides, by the others' rates, comes after these
        (0..rigid).all(|i| (0..n).all(|j| is_plain(j, i)))
    }
}

/// The complex modes of a phase.
#[derive(Debug)]
pub struct Coupling {
    operators: Operators,
    lambda: Vec<C>,
    /// Real and imaginary part of `U`, `q` over `q̇`, those of complex pairs twice.
    right: [Mat<f64>; 2],
    /// Of `W`.
    left: [Mat<f64>; 2],
    /// `∇h U`, one row a monitor, with velocities and what follows the coordinates.
    rows: Vec<Vec<C>>,
    /// `F₀`'s and, for each harmonic load, `W (0, F)`.
    forces: Vec<Vec<C>>,
    /// `‖(I − U W)(0, F)‖` of these forces.
    force_defects: Vec<f64>,
    /// Units of `q`: norms are those of `(S q, q̇)`.
    scale: Vec<f64>,
    /// `‖A U_k − λ_k U_k‖`: near a multiple eigenvalue `‖a‖` is large beside the state, and what these add up to with it.
    residuals: Vec<f64>,
    /// What a perturbation grows by at most where nothing is fed, one where the energy is a norm: `‖U‖ ‖W‖` otherwise.
    spread: f64,
    /// Products of all pairs of modes in the dissipated power.
    gram: OnceCell<Gram>,
}

/// `V_jᵀ L_k` and `V_jᵀ L̄_k`, with the velocity `V` and the dissipative force `L` of a mode.
#[derive(Debug)]
struct Gram {
    plain: Mat<C>,
    mixed: Mat<C>,
}

/// Amplitudes of the modes, one column a motion: real and imaginary part.
pub(super) struct Amplitudes(pub [Mat<f64>; 2]);

impl Amplitudes {
    /// Each mode times a number of its own.
    pub fn scaled(&self, factors: &[C]) -> Amplitudes {
        let of = |part: fn(C) -> f64| {
            Mat::from_fn(factors.len(), self.0[0].ncols(), |i, j| {
                part(C::new(self.0[0][(i, j)], self.0[1][(i, j)]) * factors[i])
            })
        };
        Amplitudes([of(|z| z.re), of(|z| z.im)])
    }

    /// What is left without others.
    pub fn minus(&self, others: &Amplitudes) -> Amplitudes {
        Amplitudes([0, 1].map(|part| &self.0[part] - &others.0[part]))
    }

    /// `Re(R C)` of a matrix over the modes, real and imaginary part.
    pub fn seen_by(&self, [re, im]: &[Mat<f64>; 2]) -> Mat<f64> {
        product(re.as_ref(), self.0[0].as_ref()) - product(im.as_ref(), self.0[1].as_ref())
    }
}

/// A vector in time: `Re(q e^{s (t − a)})`, its velocity likewise.
#[derive(Debug, Clone)]
struct Wave {
    s: C,
    q: Vec<C>,
    v: Vec<C>,
}

impl Coupling {
    /// The complex modes; `scale` are frequencies of the order of those of the coordinates, `rows` the gradients of the monitors over `q`,
    /// `forces` the constant force and the shapes of the harmonic loads.
    pub fn new(
        operators: Operators,
        scale: &[f64],
        rows: Rows,
        forces: &[&[f64]],
    ) -> Result<Coupling, FemError> {
        let n = scale.len();
        let (k, d) = (&operators.stiffness, &operators.damping);
        let a = companion(&operators, scale);
        let Eigenpairs { lambda, right: u, left: w, spread } =
            Eigenpairs::of(&operators, &a, scale)?;
        let p = lambda.len();
        let size = |x: &mut dyn Iterator<Item = C>| x.map(|x| x.norm_sqr()).sum::<f64>().sqrt();
        // what rounding leaves of A U = U Λ, and what it hides of that
        let parts = [|x: &C| x.re, |x: &C| x.im].map(|part| {
            product(a.as_ref(), Mat::from_fn(2 * n, p, |i, c| part(&u[(i, c)])).as_ref())
        });
        let hidden = 4.0 * f64::EPSILON * a.norm_l2();
        let residual = |(c, l): (usize, &C)| {
            let twice = if l.im > 0.0 { 2.0 } else { 1.0 };
            let image = |i: usize| C::new(parts[0][(i, c)], parts[1][(i, c)]);
            let rest = size(&mut (0..2 * n).map(|i| image(i) - l * u[(i, c)]));
            twice * (rest + hidden * size(&mut (0..2 * n).map(|i| u[(i, c)])))
        };
        let residuals = lambda.iter().enumerate().map(residual).collect();
        // (S q, q̇) of springs and dampers is a norm that does not grow
        let is_elastic = operators.skew.is_none()
            && lambda.iter().all(|l| l.re <= 0.0)
            && (0..n).all(|i| d[(i, i)] >= 0.0 && k[(i, i)] == scale[i] * scale[i]);
        let spread = if is_elastic { 1.0 } else { spread };
        let of_u = |i: usize, c: usize| {
            let twice = if lambda[c].im > 0.0 { 2.0 } else { 1.0 };
            let unit = if i < n { scale[i] } else { 1.0 };
            u[(i, c)] * (twice / unit)
        };
        let of_w = |c: usize, j: usize| {
            let unit = if j < n { scale[j] } else { 1.0 };
            w[(c, j)] * unit
        };
        let right = [
            Mat::from_fn(2 * n, p, |i, c| of_u(i, c).re),
            Mat::from_fn(2 * n, p, |i, c| of_u(i, c).im),
        ];
        let left = [
            Mat::from_fn(p, 2 * n, |c, j| of_w(c, j).re),
            Mat::from_fn(p, 2 * n, |c, j| of_w(c, j).im),
        ];
        let row = |i: usize| -> Vec<C> {
            let mut r: Vec<f64> = rows.0.row(i).iter().copied().collect();
            if let Some(of_velocity) = rows.1 {
                r.extend(of_velocity.row(i).iter());
            }
            let over = |m: &Mat<f64>, c: usize| dot(&r, m.col_as_slice(c));
            (0..p).map(|c| C::new(over(&right[0], c), over(&right[1], c))).collect()
        };
        let rows = (0..rows.0.nrows()).map(row).collect();
        let mut new = Coupling {
            operators,
            lambda,
            right,
            left,
            rows,
            forces: vec![],
            force_defects: vec![],
            scale: scale.to_vec(),
            residuals,
            spread,
            gram: OnceCell::new(),
        };
        for f in forces {
            let x = [vec![0.0; n], f.to_vec()].concat();
            let modal = new.to_modes(&x);
            new.force_defects.push(new.beside(&x, &modal));
            new.forces.push(modal);
        }
        Ok(new)
    }

    /// The eigenvalues with `Im λ ≥ 0`.
    pub(super) fn lambda(&self) -> &[C] {
        &self.lambda
    }

    /// `U_k`, `q` over `q̇`, of complex pairs twice.
    pub(super) fn shape(&self, k: usize) -> Vec<C> {
        let parts = self.right[0].col_as_slice(k).iter().zip(self.right[1].col_as_slice(k));
        parts.map(|(&re, &im)| C::new(re, im)).collect()
    }

    /// Add to what a mode is in a monitor: what follows the coupled coordinates.
    pub(super) fn add_to_row(&mut self, monitor: usize, mode: usize, x: C) {
        self.rows[monitor][mode] += x;
    }

    fn n(&self) -> usize {
        self.right[0].nrows() / 2
    }

    /// `W x`
    fn to_modes(&self, x: &[f64]) -> Vec<C> {
        let column = MatRef::from_column_major_slice(x, x.len(), 1);
        let [re, im] = [0, 1].map(|k| product(self.left[k].as_ref(), column));
        (0..self.lambda.len()).map(|k| C::new(re[(k, 0)], im[(k, 0)])).collect()
    }

    /// `Re(U c)`
    fn expand(&self, c: &[C], x: &mut [f64]) {
        let sum = self.expand_all(&[c]);
        x.copy_from_slice(sum.col_as_slice(0));
    }

    /// The same of several vectors, a column each.
    fn expand_all<A: AsRef<[C]>>(&self, c: &[A]) -> Mat<f64> {
        let of = |part: fn(&C) -> f64| {
            Mat::from_fn(self.lambda.len(), c.len(), |k, j| part(&c[j].as_ref()[k]))
        };
        Amplitudes([of(|z| z.re), of(|z| z.im)]).seen_by(&self.right)
    }

    /// `‖x − Re(U c)‖`
    fn beside(&self, x: &[f64], c: &[C]) -> f64 {
        let mut y = vec![0.0; x.len()];
        self.expand(c, &mut y);
        let units = self.scale.iter().copied().chain(std::iter::repeat(1.0));
        let rest = x.iter().zip(&y).zip(units).map(|((x, y), s)| s * (x - y));
        rest.map(|r| r * r).sum::<f64>().sqrt()
    }

    /// `U c`, halves of complex pairs: so that `x + x̄` is the whole.
    fn column(&self, k: usize, c: C) -> (Vec<C>, Vec<C>) {
        let n = self.n();
        let (re, im) = (self.right[0].col_as_slice(k), self.right[1].col_as_slice(k));
        let all: Vec<C> = re.iter().zip(im).map(|(&r, &i)| C::new(r, i) * c).collect();
        (all[..n].to_vec(), all[n..].to_vec())
    }

    /// `W X` of columns `x = (q, q̇)`.
    pub(super) fn amplitudes_of(&self, x: MatRef<f64>) -> Amplitudes {
        Amplitudes([0, 1].map(|part| product(self.left[part].as_ref(), x)))
    }

    /// `Re(U C)`: columns `(q, q̇)`.
    pub(super) fn columns_of(&self, c: &Amplitudes) -> Mat<f64> {
        c.seen_by(&self.right)
    }

    /// `r ∂q(τ)`, then `r ∂q̇(τ)`: each by `q` and by `q̇` at the start, for a row `r`.
    pub(crate) fn row_carried(&self, r: &[f64], tau: f64) -> [Vec<f64>; 4] {
        let n = self.n();
        let of_part = |first: usize| -> [Vec<f64>; 2] {
            let over = |m: &Mat<f64>, c: usize| dot(r, &m.col_as_slice(c)[first..first + n]);
            let c: Vec<C> = (0..self.lambda.len())
                .map(|k| {
                    let u = C::new(over(&self.right[0], k), over(&self.right[1], k));
                    u * power(self.lambda[k] * tau)
                })
                .collect();
            let of = |j: usize| -> f64 {
                let w = self.left[0].col_as_slice(j).iter().zip(self.left[1].col_as_slice(j));
                c.iter().zip(w).map(|(c, (re, im))| c.re * re - c.im * im).sum()
            };
            [(0..n).map(of).collect(), (n..2 * n).map(of).collect()]
        };
        let ([a, b], [c, d]) = (of_part(0), of_part(n));
        [a, b, c, d]
    }

    /// `L = D v + N q` of a complex vector.
    fn loss(&self, q: &[C], v: &[C]) -> Vec<C> {
        let n = self.n();
        let times = |m: &Mat<f64>, x: &[C], sum: &mut [C]| {
            for (j, x) in x.iter().enumerate() {
                m.col_as_slice(j).iter().zip(sum.iter_mut()).for_each(|(m, s)| *s += x * m);
            }
        };
        let mut l = vec![C::default(); n];
        times(&self.operators.damping, v, &mut l);
        if let Some((skew, _)) = &self.operators.skew {
            times(skew, q, &mut l);
        }
        l
    }

    fn gram(&self) -> &Gram {
        self.gram.get_or_init(|| {
            let n = self.n();
            let of = |m: &Mat<f64>, first: usize| m.subrows(first, n).to_owned();
            let v = [of(&self.right[0], n), of(&self.right[1], n)];
            let mut l = [0, 1].map(|k| product(self.operators.damping.as_ref(), v[k].as_ref()));
            if let Some((skew, _)) = &self.operators.skew {
                for (k, l) in l.iter_mut().enumerate() {
                    *l += product(skew.as_ref(), of(&self.right[k], 0).as_ref());
                }
            }
            self.pairs(&v, &l)
        })
    }

    fn pairs(&self, v: &[Mat<f64>; 2], l: &[Mat<f64>; 2]) -> Gram {
        let of = |i: usize, j: usize| product(v[i].transpose(), l[j].as_ref());
        let (rr, ri, ir, ii) = (of(0, 0), of(0, 1), of(1, 0), of(1, 1));
        let p = rr.nrows();
        Gram {
            plain: Mat::from_fn(p, p, |j, k| {
                C::new(rr[(j, k)] - ii[(j, k)], ri[(j, k)] + ir[(j, k)])
            }),
            mixed: Mat::from_fn(p, p, |j, k| {
                C::new(rr[(j, k)] + ii[(j, k)], ir[(j, k)] - ri[(j, k)])
            }),
        }
    }
}

/// Acceleration `F − D q̇ − K̂ q` at a state, `force` the loads there.
pub(super) fn acceleration(
    operators: &Operators,
    q: &[f64],
    v: &[f64],
    force: &[f64],
    a: &mut [f64],
) {
    a.copy_from_slice(force);
    let of = |m: &Mat<f64>, x: &[f64]| {
        product(m.as_ref(), MatRef::from_column_major_slice(x, x.len(), 1))
    };
    let (k, d) = (of(&operators.stiffness, q), of(&operators.damping, v));
    a.iter_mut().enumerate().for_each(|(i, a)| *a -= k[(i, 0)] + d[(i, 0)]);
}

/// A motion of a coupled phase.
#[derive(Debug)]
pub struct CoupledMotion {
    /// `a_k` at the start.
    amplitudes: Vec<C>,
    /// `x₀`
    steady: Vec<f64>,
    /// `x₁` of what grows with time, `x₀ + x₁ t`.
    ramp: Option<Vec<f64>>,
    /// `Ω` and `P e^{i(Ω t₀ + φ)}` of each harmonic load.
    driven: Vec<(f64, Vec<C>)>,
    /// Amplitudes of the modes in `x₀` and all `P`.
    steady_sizes: Vec<f64>,
    /// How far the sums are from the state at the start, and from the loads.
    beside: (f64, f64),
}

impl CoupledMotion {
    /// The motion from `x = (q, q̇)` at the start; of each harmonic load `Ω`, its angle there and its size. A constant force, and one that grows with the
    /// time, may come besides. None where a load is at an eigenvalue.
    pub(super) fn new(
        coupling: &Coupling,
        x: &[f64],
        loads: &[(f64, f64, f64)],
        (more, growing): (&[f64], &[f64]),
    ) -> Option<CoupledMotion> {
        let n = coupling.n();
        let p = coupling.lambda.len();
        let mut steady = vec![0.0; 2 * n];
        let mut constant = coupling.forces[0].clone();
        let of_force = |f: &[f64]| coupling.to_modes(&[&vec![0.0; n], f].concat());
        if more.iter().any(|f| *f != 0.0) {
            constant.iter_mut().zip(of_force(more)).for_each(|(c, f)| *c += f);
        }
        // A x₁ + F₁ = 0, A x₀ + F₀ = x₁
        let ramp = growing.iter().any(|f| *f != 0.0).then(|| {
            let mut x1 = vec![0.0; 2 * n];
            let of_mode = |(f, l): (C, &C)| -f / l;
            let modal: Vec<C> =
                of_force(growing).into_iter().zip(&coupling.lambda).map(of_mode).collect();
            coupling.expand(&modal, &mut x1);
            constant.iter_mut().zip(&modal).for_each(|(c, x)| *c -= x);
            x1
        });
        let mut steady_sizes = vec![0.0; p];
        let mut lost = 0.0;
        if constant.iter().any(|f| *f != C::default()) {
            let quiet = |k: usize| match constant[k] == C::default() {
                true => constant[k],
                false => -constant[k] / coupling.lambda[k],
            };
            let quiet: Vec<C> = (0..p).map(quiet).collect();
            coupling.expand(&quiet, &mut steady);
            steady_sizes.iter_mut().zip(&quiet).for_each(|(s, q)| *s += q.norm());
            lost += coupling.force_defects[0];
        }
        let mut driven = vec![];
        let shapes = coupling.forces[1..].iter().zip(&coupling.force_defects[1..]);
        for (&(omega, angle, size), (force, defect)) in loads.iter().zip(shapes) {
            lost += size.abs() * defect;
            let turn = C::from_polar(0.5 * size, angle);
            let mut response = vec![C::default(); 2 * n];
            for (k, (l, f)) in coupling.lambda.iter().zip(force).enumerate() {
                let near = C::new(0.0, omega) - l;
                if near.norm() < RESONANCE * omega.max(l.norm()) {
                    return None;
                }
                let (forth, back) = (f * turn / near, f * turn.conj() / (C::new(0.0, -omega) - l));
                steady_sizes[k] += forth.norm() + back.norm();
                let (re, im) =
                    (coupling.right[0].col_as_slice(k), coupling.right[1].col_as_slice(k));
                for (r, (&re, &im)) in response.iter_mut().zip(re.iter().zip(im)) {
                    let u = C::new(re, im);
                    *r += u * forth + (u * back).conj();
                }
            }
            driven.push((omega, response));
        }
        let beside = (0.0, lost);
        let amplitudes = vec![];
        let mut motion = CoupledMotion { amplitudes, steady, ramp, driven, steady_sizes, beside };
        let mut rest = x.to_vec();
        rest.iter_mut().zip(motion.response()).for_each(|(x, r)| *x -= r);
        motion.amplitudes = coupling.to_modes(&rest);
        motion.beside.0 = coupling.beside(&rest, &motion.amplitudes);
        let CoupledMotion { amplitudes, steady, .. } = &motion;
        let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
        (finite(steady) && amplitudes.iter().all(|a| a.re.is_finite() && a.im.is_finite()))
            .then_some(motion)
    }

    /// The steady response `(q, q̇)` to the loads at the start.
    pub(super) fn response(&self) -> Vec<f64> {
        let mut x = self.steady.clone();
        for (_, response) in &self.driven {
            x.iter_mut().zip(response).for_each(|(x, r)| *x += r.re);
        }
        x
    }

    /// `Ω` and response `(q, q̇)` of each harmonic load, `P e^{i(Ωt₀ + φ)}`.
    pub(super) fn driven(&self) -> &[(f64, Vec<C>)] {
        &self.driven
    }

    /// `x₀` and `x₁`, which may be empty.
    pub(super) fn polynomial(&self) -> [&[f64]; 2] {
        [&self.steady, self.ramp.as_deref().unwrap_or_default()]
    }

    /// Amplitudes of the modes at the start.
    pub(super) fn amplitudes(&self) -> &[C] {
        &self.amplitudes
    }

    /// `(q, q̇)` at some times after the start, a column each, and the amplitudes of the modes there.
    pub fn at(&self, coupling: &Coupling, taus: &[f64]) -> (Mat<f64>, Vec<Vec<C>>) {
        let grown = |tau: &f64| -> Vec<C> {
            let each = self.amplitudes.iter().zip(&coupling.lambda);
            each.map(|(a, l)| a * power(l * *tau)).collect()
        };
        let grown: Vec<Vec<C>> = taus.iter().map(grown).collect();
        let mut all = coupling.expand_all(&grown);
        for (j, &tau) in taus.iter().enumerate() {
            let x = all.col_as_slice_mut(j);
            x.iter_mut().zip(&self.steady).for_each(|(x, s)| *x += s);
            if let Some(ramp) = &self.ramp {
                x.iter_mut().zip(ramp).for_each(|(x, r)| *x += r * tau);
            }
            for (omega, response) in &self.driven {
                let turn = C::from_polar(1.0, omega * tau);
                x.iter_mut().zip(response).for_each(|(x, r)| *x += (r * turn).re);
            }
        }
        (all, grown)
    }

    /// Bounds of what the modes are in each monitor, and of its fourth derivative, from `tau` to `end` after the start (theory §12, H2).
    pub fn bounds(&self, coupling: &Coupling, tau: f64, end: f64) -> [Vec<f64>; 2] {
        let sizes: Vec<f64> = self
            .amplitudes
            .iter()
            .zip(&coupling.lambda)
            .map(|(a, l)| a.norm() * power(C::from(l.re * if l.re > 0.0 { end } else { tau })).re)
            .collect();
        let (mut size, mut fourth) = (vec![], vec![]);
        for row in &coupling.rows {
            let (mut s, mut f) = (0.0, 0.0);
            for ((r, a), l) in row.iter().zip(&sizes).zip(&coupling.lambda) {
                s += r.norm() * a;
                f += r.norm() * a * l.norm_sqr().powi(2);
            }
            size.push(s);
            fourth.push(f);
        }
        [size, fourth]
    }

    /// How far each monitor may be at `tau` from that of the equations that start in the same state (theory §12, H4): the sum over the modes obeys the
    /// equations up to the force `(A U − U Λ) a(t)`, and starts beside the state by `x − U a`; with nearly dependent vectors `a` is large beside `x`. The
    /// `defect` of the natural modes, in which the equations are written, comes to it.
    pub(super) fn deviations(
        &self,
        coupling: &Coupling,
        rows: Rows,
        (defect, beta): (Defect, f64),
        tau: f64,
    ) -> Vec<f64> {
        let n = coupling.n();
        let (mut pushed, mut size, mut rate, mut grown) = (0.0, 0.0, 0.0, 1.0f64);
        for (k, l) in coupling.lambda.iter().enumerate() {
            let growth = power(C::from((l.re * tau).max(0.0))).re;
            grown = grown.max(growth);
            let a = self.amplitudes[k].norm() * growth + self.steady_sizes[k];
            pushed += coupling.residuals[k] * a;
            let column = |first: usize| -> f64 {
                let part = |m: &Mat<f64>| -> f64 {
                    let x = &m.col_as_slice(k)[first..first + n];
                    dot(x, x)
                };
                (part(&coupling.right[0]) + part(&coupling.right[1])).sqrt()
            };
            size += column(0) * a;
            rate += column(n) * a;
        }
        let highest = coupling.scale.iter().fold(0.0f64, |m, w| m.max(*w));
        let start = self.beside.0 + defect.orthogonality * (highest * size + rate);
        let natural = defect.residual * (size + beta * rate);
        let off = coupling.spread * grown * (start + tau * (pushed + self.beside.1 + natural));
        let of_row = |i: usize| {
            let row = rows.0.row(i);
            let sum: f64 = row.iter().zip(&coupling.scale).map(|(r, w)| (r / w).powi(2)).sum();
            let of_velocity = rows.1.map_or(0.0, |r| r.row(i).norm_squared());
            (sum + of_velocity).sqrt() * off
        };
        (0..rows.0.nrows()).map(of_row).collect()
    }

    /// Whether no amplitude changes.
    pub(crate) fn is_steady(&self, coupling: &Coupling) -> bool {
        coupling.lambda.iter().all(|l| l.re == 0.0)
    }

    /// What each term of the motion is at `tau` after the start.
    fn waves(&self, tau: f64) -> Vec<Wave> {
        let of_load = |(omega, response): &(f64, Vec<C>)| {
            let turn = C::from_polar(1.0, omega * tau);
            let all: Vec<C> = response.iter().map(|r| r * turn).collect();
            let (q, v) = all.split_at(all.len() / 2);
            Wave { s: C::new(0.0, *omega), q: q.to_vec(), v: v.to_vec() }
        };
        self.driven.iter().map(of_load).collect()
    }

    /// Homogeneous terms at `tau`, with their growth over `h`.
    fn terms(&self, coupling: &Coupling, tau: f64, h: f64) -> Vec<Term> {
        let of = |(a, &s): (&C, &C)| Term { c: a * power(s * tau), s, growth: power(s * h) };
        self.amplitudes.iter().zip(&coupling.lambda).map(of).collect()
    }

    /// Work of the harmonic loads `forces` (with their angles at the start and sizes) and dissipation from `tau` to `tau + h`.
    pub fn powers(
        &self,
        coupling: &Coupling,
        loads: &[(f64, f64, f64)],
        forces: &[Vec<f64>],
        (tau, h): (f64, f64),
    ) -> [f64; 2] {
        let n = coupling.n();
        let terms = self.terms(coupling, tau, h);
        let waves = self.waves(tau);
        let gram = coupling.gram();
        let mut lost = 0.0;
        for (j, x) in terms.iter().enumerate() {
            for (k, y) in terms.iter().enumerate() {
                lost += pair_integral((gram.plain[(j, k)], gram.mixed[(j, k)]), x, y, h);
            }
        }
        // Re(x)ᵀ Re(y) of two vectors of exponentials
        let over = |x: (&[C], C), y: (&[C], C)| -> f64 {
            let plain: C = x.0.iter().zip(y.0).map(|(a, b)| a * b).sum();
            let mixed: C = x.0.iter().zip(y.0).map(|(a, b)| a * b.conj()).sum();
            let of = |s: C| integral(s, power(s * h), h);
            0.5 * (plain * of(x.1 + y.1) + mixed * of(x.1 + y.1.conj())).re
        };
        let constant: Vec<C> = match &coupling.operators.skew {
            None => vec![],
            Some((_, rest)) => {
                let quiet: Vec<C> = self.steady[..n].iter().map(|&x| C::from(x)).collect();
                let of_steady = coupling.loss(&quiet, &vec![C::default(); n]);
                of_steady.iter().zip(rest).map(|(s, r)| s + r).collect()
            }
        };
        let still = C::default();
        let mut work = 0.0;
        let turned: Vec<(Vec<C>, C)> = loads
            .iter()
            .zip(forces)
            .map(|(&(omega, angle, size), f)| {
                let turn = C::from_polar(size, omega * tau + angle);
                (f.iter().map(|f| turn * f).collect(), C::new(0.0, omega))
            })
            .collect();
        let homogeneous = !waves.is_empty() || !constant.is_empty();
        for (k, t) in terms.iter().enumerate().filter(|_| homogeneous) {
            let (q, v) = coupling.column(k, t.c);
            let l = coupling.loss(&q, &v);
            for w in &waves {
                let of_wave = coupling.loss(&w.q, &w.v);
                lost += over((&v, t.s), (&of_wave, w.s)) + over((&w.v, w.s), (&l, t.s));
            }
            for (f, s) in &turned {
                work += over((&v, t.s), (f, *s));
            }
            lost += over((&v, t.s), (&constant, still));
        }
        for w in &waves {
            for other in &waves {
                let l = coupling.loss(&other.q, &other.v);
                lost += over((&w.v, w.s), (&l, other.s));
            }
            for (f, s) in &turned {
                work += over((&w.v, w.s), (f, *s));
            }
            lost += over((&w.v, w.s), (&constant, still));
        }
        [work, lost]
    }

    /// `∫ q̇ᵀq̇` from `tau` to `tau + h`, without harmonic loads.
    pub(crate) fn squared_speed(&self, coupling: &Coupling, (tau, h): (f64, f64)) -> f64 {
        let n = coupling.n();
        let v = [0, 1].map(|k| coupling.right[k].subrows(n, n).to_owned());
        let gram = coupling.pairs(&v, &v);
        let terms = self.terms(coupling, tau, h);
        let mut sum = 0.0;
        for (j, x) in terms.iter().enumerate() {
            for (k, y) in terms.iter().enumerate() {
                sum += pair_integral((gram.plain[(j, k)], gram.mixed[(j, k)]), x, y, h);
            }
        }
        sum
    }

    /// `∂q/∂α`, `∂q̇/∂α` at `tau` of `D + αI` under constant loads: `ẏ = A y − (0, q̇)` from rest.
    pub(crate) fn by_mass_damping(&self, coupling: &Coupling, tau: f64) -> (Vec<f64>, Vec<f64>) {
        let n = coupling.n();
        let p = coupling.lambda.len();
        let velocity = |m: &Mat<f64>| m.subrows(n, n).to_owned();
        let over_velocity = |m: &Mat<f64>| m.subcols(n, n).to_owned();
        let v = [velocity(&coupling.right[0]), velocity(&coupling.right[1])];
        let w = [over_velocity(&coupling.left[0]), over_velocity(&coupling.left[1])];
        let of = |i: usize, j: usize| product(w[i].as_ref(), v[j].as_ref());
        let (rr, ri, ir, ii) = (of(0, 0), of(0, 1), of(1, 0), of(1, 1));
        let mut y = vec![C::default(); p];
        for (k, y) in y.iter_mut().enumerate() {
            for (j, a) in self.amplitudes.iter().enumerate() {
                // the real part of a mode: half of it and half of its conjugate
                let plain = C::new(rr[(k, j)] - ii[(k, j)], ri[(k, j)] + ir[(k, j)]);
                let mixed = C::new(rr[(k, j)] + ii[(k, j)], ir[(k, j)] - ri[(k, j)]);
                let (l, s) = (coupling.lambda[k], coupling.lambda[j]);
                *y -= 0.5 * plain * a * difference(l, s, tau);
                *y -= 0.5 * mixed * a.conj() * difference(l, s.conj(), tau);
            }
        }
        let mut x = vec![0.0; 2 * n];
        coupling.expand(&y, &mut x);
        let v = x.split_off(n);
        (x, v)
    }
}
