//! What the open body answers at the interface, harmonic by harmonic: `y = ĉ − Ĝ n`.
//!
//! With the dynamic stiffness `D_k` the body obeys `D_k q_k = f_k − Q n_k`, so that `y₁ = Qᵀq = c_k − G_k n_k` with
//!
//! ```text
//! G_k = Qᵀ D_k⁻¹ Q,     c_k = Qᵀ D_k⁻¹ f_k
//! ```
//!
//! of `r` rows. The second projection of the acceleration form needs no more: `D_k = (1 + ikωβ) Ω² − σ_k` with `σ_k = k²ω² − ikωα`, hence
//!
//! ```text
//! y₂ = QᵀΩ²q = (Qᵀf_k − n_k + σ_k y₁) / (1 + ikωβ)
//! ```
//!
//! A pair `a cos kθ + b sin kθ` is the complex number `a − ib`.

use faer::{Mat, MatRef, c64};

use super::interface::{Form, Interface};
use super::series::{Basis, Series};

/// The answers of the open body at one frequency.
pub struct Receptance {
    basis: Basis,
    n_h: usize,
    /// `G_k`: real and imaginary part.
    g: Vec<[Mat<f64>; 2]>,
    /// `c_k`
    c: Series,
    /// `Qᵀf_k` and harmonic by harmonic `(σ_k, 1/(1 + ikωβ))`; none in the force form.
    second: Option<(Series, Vec<(c64, c64)>)>,
    /// What rigid motions of the open body ask for, if it has any and they are unknowns.
    pub(super) rigid: Option<Rigid>,
}

/// Rigid motions of the open body, whose mean positions `a` no stiffness tells: `y₁ += B a` at `k = 0`, and their mean forces vanish, `Bᵀ n₀ = f₀`.
pub(super) struct Rigid {
    /// `B`, `r × m`.
    pub motions: Mat<f64>,
    /// `f₀` of each.
    pub forces: Vec<f64>,
}

impl Rigid {
    /// Of the modes `rigid` of the open body, under constant modal forces; none where there are none.
    pub(super) fn of(q: &Mat<f64>, rigid: &[usize], constant: &[f64]) -> Option<Rigid> {
        (!rigid.is_empty()).then(|| Rigid {
            motions: Mat::from_fn(q.ncols(), rigid.len(), |c, m| q[(rigid[m], c)]),
            forces: rigid.iter().map(|m| constant[*m]).collect(),
        })
    }
}

/// Coefficients of the constant and the harmonic loads, function by function; `of_load` has those of each.
pub(super) fn load_series(
    interface: &Interface,
    n_h: usize,
    constant: &[f64],
    of_load: &[Vec<f64>],
) -> Series {
    let mut f = Series::zeros(interface.basis, n_h, constant.len());
    f.of_mut(0).copy_from_slice(constant);
    for (load, forces) in interface.system.loads.harmonics.iter().zip(of_load) {
        // cos(θ + φ) = cos φ cos θ − sin φ sin θ
        let (sin, cos) = load.angle().sin_cos();
        let (sin, cos) = (load.size() * sin, load.size() * cos);
        if n_h >= 1 {
            f.of_mut(1).iter_mut().zip(forces).for_each(|(x, p)| *x += cos * p);
            if interface.basis == Basis::Full {
                f.of_mut(2).iter_mut().zip(forces).for_each(|(x, p)| *x -= sin * p);
            }
        }
    }
    f
}

impl Receptance {
    /// From `G_k` and `c_k` at a frequency.
    pub(super) fn new(
        interface: &Interface,
        omega: f64,
        g: Vec<[Mat<f64>; 2]>,
        c: Series,
    ) -> Receptance {
        let (basis, n_h) = (c.basis, c.n_h);
        let (alpha, beta) = interface.damping();
        let second = (interface.form == Form::Acceleration).then(|| {
            let factors = (0..=n_h).map(|k| {
                let kw = k as f64 * omega;
                (c64::new(kw * kw, -kw * alpha), c64::new(1.0, kw * beta).inv())
            });
            let (constant, of_load) = &interface.forces;
            (load_series(interface, n_h, constant, of_load), factors.collect())
        });
        Receptance { basis, n_h, g, c, second, rigid: None }
    }

    fn rank(&self) -> usize {
        self.c.n
    }

    fn rank_in(&self) -> usize {
        self.rank() * if self.second.is_some() { 2 } else { 1 }
    }

    /// `y = ĉ − Ĝ n`; without interface terms the linear response.
    pub fn answer(&self, n: Option<&Series>) -> Series {
        let r = self.rank();
        let mut y = Series::zeros(self.basis, self.n_h, self.rank_in());
        for (k, [re, im]) in self.g.iter().enumerate() {
            let (cos, sin) = self.basis.places(k);
            let pair =
                |x: &Series, i: usize| c64::new(x.of(cos)[i], -sin.map_or(0.0, |sin| x.of(sin)[i]));
            let mut first: Vec<c64> = (0..r).map(|i| pair(&self.c, i)).collect();
            if let Some(n) = n {
                for j in 0..r {
                    let nj = pair(n, j);
                    let (re, im) = (re.col_as_slice(j), im.col_as_slice(j));
                    for (y, (re, im)) in first.iter_mut().zip(re.iter().zip(im)) {
                        *y -= c64::new(*re, *im) * nj;
                    }
                }
            }
            let mut put = |i: usize, z: c64| {
                y.of_mut(cos)[i] = z.re;
                if let Some(sin) = sin {
                    y.of_mut(sin)[i] = -z.im;
                }
            };
            for (i, &y1) in first.iter().enumerate() {
                put(i, y1);
                if let Some((f, factors)) = &self.second {
                    let (sigma, mu) = factors[k];
                    let force = pair(f, i) - n.map_or(c64::new(0.0, 0.0), |n| pair(n, i));
                    put(r + i, mu * (force + sigma * y1));
                }
            }
        }
        y
    }

    /// What the terms of `ĉ − Ĝ n` come to in magnitude, `|ĉ| + |Ĝ| |n|`.
    pub(super) fn sizes(&self, n: &Series) -> Series {
        let r = self.rank();
        let mut y = Series::zeros(self.basis, self.n_h, self.rank_in());
        for (k, [re, im]) in self.g.iter().enumerate() {
            let (cos, sin) = self.basis.places(k);
            let size = |x: &Series, i: usize| x.of(cos)[i].hypot(sin.map_or(0.0, |s| x.of(s)[i]));
            for i in 0..r {
                let through = (0..r).map(|j| re[(i, j)].hypot(im[(i, j)]) * size(n, j));
                let first = size(&self.c, i) + through.sum::<f64>();
                let second = self.second.as_ref().map(|(f, factors)| {
                    let (sigma, mu) = factors[k];
                    (r + i, mu.norm() * (size(f, i) + size(n, i) + sigma.norm() * first))
                });
                for (place, size) in second.into_iter().chain([(i, first)]) {
                    y.of_mut(cos)[place] = size;
                    sin.into_iter().for_each(|sin| y.of_mut(sin)[place] = size);
                }
            }
        }
        y
    }

    /// `I + N′ Ĝ`: columns of `N′` taken together as `Ĝ` takes them.
    pub(super) fn jacobian(&self, derivative: &Mat<f64>) -> Mat<f64> {
        let (r, r_in) = (self.rank(), self.rank_in());
        let mut out = Mat::<f64>::zeros(derivative.nrows(), self.basis.len(self.n_h) * r);
        let block = |function: usize, second: bool| {
            derivative.subcols(function * r_in + if second { r } else { 0 }, r)
        };
        for (k, [re, im]) in self.g.iter().enumerate() {
            let (cos, sin) = self.basis.places(k);
            let pair = |second: bool| Pair {
                cos: block(cos, second).to_owned(),
                sin: sin.map(|sin| block(sin, second).to_owned()),
            };
            let mut of_first = pair(false);
            let mut direct = None;
            if let Some((_, factors)) = &self.second {
                // y₂ = μ n + μσ G n
                let (sigma, mu) = factors[k];
                let of_second = pair(true);
                of_first.add(&of_second.turned(mu * sigma));
                direct = Some(of_second.turned(mu));
            }
            let mut through = of_first.through(re, im);
            if let Some(direct) = &direct {
                through.add(direct);
            }
            out.subcols_mut(cos * r, r).copy_from(&through.cos);
            if let (Some(sin), Some(of_sin)) = (sin, &through.sin) {
                out.subcols_mut(sin * r, r).copy_from(of_sin);
            }
        }
        (0..out.nrows()).for_each(|i| out[(i, i)] += 1.0);
        out
    }
}

/// Columns of a derivative for the cosine and the sine of one harmonic.
struct Pair {
    cos: Mat<f64>,
    sin: Option<Mat<f64>>,
}

impl Pair {
    fn add(&mut self, other: &Pair) {
        self.cos += &other.cos;
        if let (Some(a), Some(b)) = (&mut self.sin, &other.sin) {
            *a += b;
        }
    }

    /// The columns for `x` where these are for `z x`: `z (a − ib)` has the cosine `p a + q b` and the sine `p b − q a`, `z = p + iq`.
    fn turned(&self, z: c64) -> Pair {
        let scaled = |m: &Mat<f64>, s: f64| m * faer::Scale(s);
        match &self.sin {
            None => Pair { cos: scaled(&self.cos, z.re), sin: None },
            Some(sin) => Pair {
                cos: scaled(&self.cos, z.re) - scaled(sin, z.im),
                sin: Some(scaled(&self.cos, z.im) + scaled(sin, z.re)),
            },
        }
    }

    /// The columns for `n` where these are for `G n`.
    fn through(&self, re: &Mat<f64>, im: &Mat<f64>) -> Pair {
        match &self.sin {
            None => Pair { cos: &self.cos * re, sin: None },
            Some(sin) => {
                Pair { cos: &self.cos * re - sin * im, sin: Some(&self.cos * im + sin * re) }
            }
        }
    }
}

/// `Qᵀ diag(v) Q`
pub(super) fn weighted(q: MatRef<f64>, v: &[f64]) -> Mat<f64> {
    let scaled = Mat::from_fn(q.nrows(), q.ncols(), |i, j| v[i] * q[(i, j)]);
    q.transpose() * scaled
}
