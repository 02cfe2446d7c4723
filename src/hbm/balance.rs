//! The projections `n_k` of the interface terms along a series, and their exact derivative.
//!
//! Event-resolved: on `(θ_s, θ_{s+1})` the set α is fixed and `n = Σ_l (P_α + lω V_α J − l²ω² A_α) y_l f_l(θ) − s_α(θ)`, so that
//! `∫ n f_k` is a sum of closed forms. A switch moves with the series, `∂θ_s/∂y_l = −m f_l(θ_s)/h′(θ_s)`, which adds
//! `(n⁻ − n⁺) f_k(θ_s) ∂θ_s/∂y_l` to the derivative. Sampled (AFT): the integrals by `N_t` samples, sets from each sample; the derivative
//! does not see the switches move, and the residual is a discontinuous function of the coefficients.

use std::rc::Rc;

use faer::Mat;

use super::HbmError;
use super::reduction::{PhaseOperator, Reduction};
use super::series::{Basis, Function, Integrals, Polynomial, Series};
use crate::contact::ActiveSet;

/// How the projections are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// From switch to switch, in closed form.
    EventResolved,
    /// Alternating frequency–time with this number of samples a period: an approximation.
    Sampled(usize),
}

/// A switch along a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Where.
    pub theta: f64,
    /// Contact node.
    pub contact: usize,
    /// Whether it closes.
    pub closes: bool,
}

/// Projections along a series.
#[derive(Debug)]
pub struct Balance {
    /// `n_k`, function by function, `r` components.
    pub n: Series,
    /// `∂n/∂y`: `(functions · r) × (functions · r_in)`.
    pub derivative: Mat<f64>,
    /// Switches on the interval of the balance (half a period for a cosine series).
    pub crossings: Vec<Crossing>,
    /// Active sets between them.
    pub sets: Vec<ActiveSet>,
    /// Touches that may be crossings: tangencies that could not be decided, and switches whose monitor has no slope (the derivative knows
    /// nothing of how they move).
    pub undecided: usize,
}

/// Most switches of one node a harmonic.
const SWITCHES: usize = 8;

/// `y = Q̂ᵀ q`, function by function.
pub fn project_in(reduction: &Reduction, q: &Series) -> Series {
    let r = reduction.q_in.ncols();
    let mut y = Series::zeros(q.basis, q.n_h, r);
    for i in 0..q.basis.len(q.n_h) {
        for c in 0..r {
            let d: f64 =
                reduction.q_in.col_as_slice(c).iter().zip(q.of(i)).map(|(a, b)| a * b).sum();
            y.of_mut(i)[c] = d;
        }
    }
    y
}

/// Norm of a function squared, over the interval of its basis.
fn weight(basis: Basis, (k, _): Function) -> f64 {
    let half = 0.5 * basis.end();
    if k == 0 { 2.0 * half } else { half }
}

/// The coefficients by which a phase multiplies `y_l f_l`: `P f_l + ωV f_l′ + ω²A f_l″` as one matrix for `f_l`, and one for its partner
/// (`cos ↔ sin`).
fn blocks(op: &PhaseOperator, l: usize, is_sine: bool, omega: f64) -> (Mat<f64>, Option<Mat<f64>>) {
    let lw = l as f64 * omega;
    let own = match &op.a {
        Some(a) => {
            Mat::from_fn(op.p.nrows(), op.p.ncols(), |i, j| op.p[(i, j)] - lw * lw * a[(i, j)])
        }
        None => op.p.clone(),
    };
    // (cos lθ)′ = −l sin lθ, (sin lθ)′ = l cos lθ
    let sign = if is_sine { lw } else { -lw };
    let partner =
        op.v.as_ref()
            .filter(|_| l > 0)
            .map(|v| Mat::from_fn(v.nrows(), v.ncols(), |i, j| sign * v[(i, j)]));
    (own, partner)
}

/// Active sets along a series, the switches between them, the slope of the monitor at each, and the number of undecided touches.
type Path = (Vec<ActiveSet>, Vec<Crossing>, Vec<f64>, usize);

/// The switches along a series.
fn walk(reduction: &Reduction, q: &Series, y: &Series) -> Result<Path, HbmError> {
    let system = &reduction.system;
    let n_c = system.n_contact();
    let (q0, dq0) = q.at(0.0);
    let state = reduction.state(&q0, &dq0, 1.0);
    let mut set = system.select(0.0, &state.u, &ActiveSet::open(n_c))?.set;
    let (basis, n_h) = (y.basis, y.n_h);
    let (mut sets, mut crossings, mut slopes) = (vec![set.clone()], vec![], vec![]);
    let mut theta = 0.0;
    let mut undecided = 0;
    let limit = SWITCHES * n_c * (n_h + 1);
    loop {
        let op = reduction.phase(&set)?;
        let mut first: Option<(f64, usize, f64)> = None;
        for i in 0..n_c {
            let h: Vec<f64> = (0..basis.len(n_h))
                .map(|f| {
                    let dot: f64 =
                        y.of(f).iter().enumerate().map(|(c, y)| op.rows[(i, c)] * y).sum();
                    dot + op.monitor_constant(i, f, &system.loads)
                })
                .collect();
            let h = Polynomial::new(basis, n_h, &h);
            let end = first.map_or(basis.end(), |f| f.0);
            // a monitor may vanish altogether (at rest on the obstacle)
            let slack = 1e-13 * h.size + 1e-15 * reduction.system.units.length;
            if let Some(t) = h.first_crossing(theta, end, slack, &mut undecided)
                && t < end
            {
                first = Some((t.max(theta), i, h.at(t).1));
            }
        }
        let Some((t, contact, slope)) = first else {
            return Ok((sets, crossings, slopes, undecided));
        };
        let closes = !set.is_active(contact);
        set.set(contact, closes);
        sets.push(set.clone());
        crossings.push(Crossing { theta: t, contact, closes });
        slopes.push(slope);
        theta = t;
        if crossings.len() > limit {
            return Err(HbmError::Switches(limit));
        }
    }
}

/// `n` at `θ` in a phase.
fn interface(
    op: &PhaseOperator,
    reduction: &Reduction,
    y: &Series,
    omega: f64,
    theta: f64,
) -> Vec<f64> {
    let mut n: Vec<f64> = op.s.iter().map(|s| -s).collect();
    for (load, part) in reduction.system.loads.harmonics.iter().zip(&op.loads) {
        let c = load.size() * (theta + load.angle()).cos();
        n.iter_mut().zip(part).for_each(|(n, p)| *n -= c * p);
    }
    for (f, (k, is_sine)) in y.basis.functions(y.n_h).into_iter().enumerate() {
        let k = k as f64;
        let (sin, cos) = (k * theta).sin_cos();
        let (value, slope) = if is_sine { (sin, k * cos) } else { (cos, -k * sin) };
        for (c, &yc) in y.of(f).iter().enumerate() {
            for (i, n) in n.iter_mut().enumerate() {
                let mut factor = op.p[(i, c)] * value;
                if let Some(v) = &op.v {
                    factor += omega * v[(i, c)] * slope;
                }
                if let Some(a) = &op.a {
                    factor -= k * k * omega * omega * a[(i, c)] * value;
                }
                *n += factor * yc;
            }
        }
    }
    n
}

impl Balance {
    /// Projections of the interface terms along `q` at frequency `omega`.
    pub fn new(
        reduction: &Reduction,
        q: &Series,
        y: &Series,
        omega: f64,
        quadrature: Quadrature,
    ) -> Result<Balance, HbmError> {
        match quadrature {
            Quadrature::EventResolved => event_resolved(reduction, q, y, omega),
            Quadrature::Sampled(samples) => sampled(reduction, q, y, omega, samples),
        }
    }
}

fn event_resolved(
    reduction: &Reduction,
    q: &Series,
    y: &Series,
    omega: f64,
) -> Result<Balance, HbmError> {
    let (sets, crossings, slopes, mut undecided) = walk(reduction, q, y)?;
    let (basis, n_h) = (y.basis, y.n_h);
    let functions = basis.functions(n_h);
    let (r, r_in, count) = (reduction.q.ncols(), y.n, functions.len());
    let mut n = Series::zeros(basis, n_h, r);
    let mut derivative = Mat::<f64>::zeros(count * r, count * r_in);
    let operators: Result<Vec<Rc<PhaseOperator>>, HbmError> =
        sets.iter().map(|s| reduction.phase(s)).collect();
    let operators = operators?;
    let bound = |j: usize| match j {
        0 => 0.0,
        j if j <= crossings.len() => crossings[j - 1].theta,
        _ => basis.end(),
    };
    let tables: Vec<Integrals> =
        (0..=operators.len()).map(|j| Integrals::new(n_h, bound(j))).collect();
    for (j, op) in operators.iter().enumerate() {
        // the open phase has no interface terms
        if sets[j].count() == 0 {
            continue;
        }
        let (a, b) = (&tables[j], &tables[j + 1]);
        let mut integral = vec![0.0; count * count];
        for k in 0..count {
            for l in 0..=k {
                let x =
                    b.product(functions[k], functions[l]) - a.product(functions[k], functions[l]);
                (integral[k * count + l], integral[l * count + k]) = (x, x);
            }
        }
        for k in 0..count {
            let scale = 1.0 / weight(basis, functions[k]);
            let constant = scale * integral[k * count];
            n.of_mut(k).iter_mut().zip(&op.s).for_each(|(n, s)| *n -= constant * s);
            for (load, part) in reduction.system.loads.harmonics.iter().zip(&op.loads) {
                // cos(θ + φ) = cos φ cos θ − sin φ sin θ
                let (sin, cos) = load.angle().sin_cos();
                let c = load.size()
                    * scale
                    * (cos * integral[k * count + 1] - sin * integral[k * count + 2]);
                n.of_mut(k).iter_mut().zip(part).for_each(|(n, p)| *n -= c * p);
            }
        }
        for (l, &(harmonic, is_sine)) in functions.iter().enumerate() {
            let (own, partner) = blocks(op, harmonic, is_sine, omega);
            let other = if is_sine { l.wrapping_sub(1) } else { l + 1 };
            for c in 0..r_in {
                let column = derivative.col_as_slice_mut(l * r_in + c);
                let of_own = own.col_as_slice(c);
                let of_partner = partner.as_ref().map(|p| p.col_as_slice(c));
                for (k, target) in column.chunks_exact_mut(r).enumerate() {
                    let scale = 1.0 / weight(basis, functions[k]);
                    let x = scale * integral[k * count + l];
                    target.iter_mut().zip(of_own).for_each(|(t, o)| *t += x * o);
                    if let Some(p) = of_partner {
                        let z = scale * integral[k * count + other];
                        target.iter_mut().zip(p).for_each(|(t, p)| *t += z * p);
                    }
                }
            }
        }
    }
    // n is affine in y with the derivative at fixed switches
    for column in 0..count * r_in {
        let yc = y.a[column];
        if yc != 0.0 {
            n.a.iter_mut().zip(derivative.col_as_slice(column)).for_each(|(n, d)| *n += d * yc);
        }
    }
    let path = Moving { reduction, y, omega, operators: &operators, slopes: &slopes };
    undecided += path.add(&crossings, &mut derivative);
    Ok(Balance { n, derivative, crossings, sets, undecided })
}

/// The switches of a series move with it: `∂θ_s/∂y_l = −m f_l(θ_s)/h′(θ_s)` adds `(n⁻ − n⁺) f_k(θ_s) ∂θ_s/∂y_l` to the derivative.
struct Moving<'a> {
    reduction: &'a Reduction,
    y: &'a Series,
    omega: f64,
    operators: &'a [Rc<PhaseOperator>],
    slopes: &'a [f64],
}

impl Moving<'_> {
    /// Add the part of every switch; returns the number of those whose monitor has no slope.
    fn add(&self, crossings: &[Crossing], derivative: &mut Mat<f64>) -> usize {
        let Moving { reduction, y, omega, operators, slopes } = *self;
        let (basis, n_h) = (y.basis, y.n_h);
        let functions = basis.functions(n_h);
        let (r, r_in, count) = (reduction.q.ncols(), y.n, functions.len());
        let mut undecided = 0;
        let mut f = vec![];
        for (j, crossing) in crossings.iter().enumerate() {
            let before = interface(&operators[j], reduction, y, omega, crossing.theta);
            let after = interface(&operators[j + 1], reduction, y, omega, crossing.theta);
            basis.values(n_h, crossing.theta, &mut f);
            let slope = slopes[j];
            if slope == 0.0 {
                undecided += 1;
                continue;
            }
            let step: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a - b).collect();
            for l in 0..count {
                for c in 0..r_in {
                    let delay = -operators[j].rows[(crossing.contact, c)] * f[l] / slope;
                    let column = derivative.col_as_slice_mut(l * r_in + c);
                    for (k, target) in column.chunks_exact_mut(r).enumerate() {
                        let scale = f[k] * delay / weight(basis, functions[k]);
                        target.iter_mut().zip(&step).for_each(|(t, s)| *t += scale * s);
                    }
                }
            }
        }
        undecided
    }
}

fn sampled(
    reduction: &Reduction,
    q: &Series,
    y: &Series,
    omega: f64,
    samples: usize,
) -> Result<Balance, HbmError> {
    let (basis, n_h) = (y.basis, y.n_h);
    let functions = basis.functions(n_h);
    let (r, r_in, count) = (reduction.q.ncols(), y.n, functions.len());
    let mut n = Series::zeros(basis, n_h, r);
    let mut derivative = Mat::<f64>::zeros(count * r, count * r_in);
    let system = &reduction.system;
    let mut set = ActiveSet::open(system.n_contact());
    let (mut sets, mut crossings) = (vec![], vec![]);
    let mut f = vec![];
    // midpoints: the same rule for half and whole periods
    let h = basis.end() / samples as f64;
    for t in 0..samples {
        let theta = (t as f64 + 0.5) * h;
        let (x, dx) = q.at(theta);
        let state = reduction.state(&x, &dx, omega);
        let now = system.select(theta / omega, &state.u, &set)?.set;
        if t > 0 {
            for contact in 0..system.n_contact() {
                if now.is_active(contact) != set.is_active(contact) {
                    crossings.push(Crossing {
                        theta: theta - 0.5 * h,
                        contact,
                        closes: now.is_active(contact),
                    });
                    sets.push(now.clone());
                }
            }
        } else {
            sets.push(now.clone());
        }
        set = now;
        if set.count() == 0 {
            continue;
        }
        let op = reduction.phase(&set)?;
        let value = interface(&op, reduction, y, omega, theta);
        basis.values(n_h, theta, &mut f);
        for k in 0..count {
            let scale = f[k] * h / weight(basis, functions[k]);
            n.of_mut(k).iter_mut().zip(&value).for_each(|(n, v)| *n += scale * v);
        }
        for (l, &(harmonic, is_sine)) in functions.iter().enumerate() {
            let (own, partner) = blocks(&op, harmonic, is_sine, omega);
            let other = if is_sine { l.wrapping_sub(1) } else { l + 1 };
            for c in 0..r_in {
                for i in 0..r {
                    let mut value = own[(i, c)] * f[l];
                    if let Some(p) = &partner {
                        value += p[(i, c)] * f[other];
                    }
                    for k in 0..count {
                        derivative[(k * r + i, l * r_in + c)] +=
                            value * f[k] * h / weight(basis, functions[k]);
                    }
                }
            }
        }
    }
    // samples decide nothing between them
    Ok(Balance { n, derivative, crossings, sets, undecided: 0 })
}
