//! A witness that knows neither states nor events: small steps, in each the friction by projection (Gauss–Seidel), the normal reactions by trying all sets.
//!
//! ```text
//! y_{k+½} = y_k + ½h v_k,   v_{k+1} = v_k + h M⁻¹(F(t_{k+½}, y_{k+½}, v_k) − Eᵀr),   r_i ∈ μ_i r_n,i Sgn(v_{k+1,i} − V_i),   y_{k+1} = y_{k+½} + ½h v_{k+1}
//! ```

use nalgebra::{DMatrix, DVector};

/// A body of matrices `K` over `(y, u_n)`, mass over `y` alone.
#[derive(Debug, Clone)]
pub struct Scene {
    pub mass: DMatrix<f64>,
    pub stiffness: DMatrix<f64>,
    pub gap: Vec<f64>,
    /// Entries of `y` along the obstacles, one a contact; `μ`, `V`.
    pub tangents: Vec<(usize, f64, f64)>,
    pub alpha: f64,
    /// Constant forces on `(y, u_n)`, and the shape of harmonic ones `cos(ωt)`.
    pub constant: Vec<f64>,
    pub harmonic: (Vec<f64>, f64),
    pub start: (Vec<f64>, Vec<f64>),
}

impl Scene {
    fn n(&self) -> usize {
        self.mass.nrows()
    }

    fn force(&self, t: f64) -> DVector<f64> {
        let turn = (self.harmonic.1 * t).cos();
        let of = self.constant.iter().zip(&self.harmonic.0).map(|(c, h)| c + turn * h);
        DVector::from_iterator(self.constant.len(), of)
    }

    /// `u_n` and reactions `r_n = f − K u ≥ 0` at `y`: the one set of all in which both signs are right.
    fn contact(&self, y: &DVector<f64>, f: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let (n, c) = (self.n(), self.gap.len());
        let k_nn = self.stiffness.view((n, n), (c, c));
        let load = f.rows(n, c) - self.stiffness.view((n, 0), (c, n)) * y;
        let mut best = (f64::INFINITY, DVector::zeros(c), DVector::zeros(c));
        for set in 0..1usize << c {
            let free: Vec<usize> = (0..c).filter(|i| set >> i & 1 == 0).collect();
            let mut u = DVector::from_iterator(c, self.gap.iter().copied());
            free.iter().for_each(|&i| u[i] = 0.0);
            let rest = &load - k_nn * &u;
            let block = DMatrix::from_fn(free.len(), free.len(), |i, j| k_nn[(free[i], free[j])]);
            let rhs = DVector::from_iterator(free.len(), free.iter().map(|&i| rest[i]));
            let solved = if free.is_empty() { Some(rhs) } else { block.lu().solve(&rhs) };
            let Some(x) = solved else { continue };
            free.iter().zip(x.iter()).for_each(|(&i, x)| u[i] = *x);
            let r = &load - k_nn * &u;
            let wrong = |i: usize| (u[i] - self.gap[i]).max(0.0).max(-r[i]);
            let off = (0..c).map(wrong).fold(0.0, f64::max);
            if off < best.0 {
                best = (off, u, r);
            }
        }
        (best.1, best.2)
    }

    /// `(y, v)` at a time, by so many steps, and what friction took.
    pub fn march(&self, until: f64, steps: usize) -> (DVector<f64>, DVector<f64>, f64) {
        let (n, c, h) = (self.n(), self.gap.len(), until / steps as f64);
        let inverse = self.mass.clone().try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
        let mut y = DVector::from_column_slice(&self.start.0);
        let mut v = DVector::from_column_slice(&self.start.1);
        let mut r = vec![0.0; c];
        let mut taken = 0.0;
        for k in 0..steps {
            y += 0.5 * h * &v;
            let f = self.force((k as f64 + 0.5) * h);
            let (u, normal) = self.contact(&y, &f);
            let elastic =
                self.stiffness.view((0, 0), (n, n)) * &y + self.stiffness.view((0, n), (n, c)) * u;
            let force = f.rows(0, n) - elastic - self.alpha * (&self.mass * &v);
            let mut new = &v + h * (&inverse * force);
            for (i, &(e, ..)) in self.tangents.iter().enumerate() {
                new -= h * r[i] * inverse.column(e);
            }
            for _ in 0..200 {
                let mut changed = 0.0f64;
                for (i, &(e, mu, surface)) in self.tangents.iter().enumerate() {
                    let limit = mu * normal[i].max(0.0);
                    let wanted = r[i] + (new[e] - surface) / (h * inverse[(e, e)]);
                    let next = wanted.clamp(-limit, limit);
                    let step = next - r[i];
                    new -= h * step * inverse.column(e);
                    r[i] = next;
                    changed = changed.max(step.abs());
                }
                if changed <= 1e-13 * (1.0 + normal.amax()) {
                    break;
                }
            }
            let slip = |&(e, _, surface): &(usize, f64, f64)| 0.5 * (v[e] + new[e]) - surface;
            taken += h * self.tangents.iter().zip(&r).map(|(t, r)| r * slip(t)).sum::<f64>();
            y += 0.5 * h * &new;
            v = new;
        }
        (y, v, taken)
    }
}
