//! The projections `n_k` of the interface terms along a series, and their exact derivative.
//!
//! Event-resolved: on `(θ_s, θ_{s+1})` the set α is fixed and `n = Σ_l (P_α + lω V_α J − l²ω² A_α) y_l f_l(θ) − s_α(θ)`, so that
//! `∫ n f_k` is a sum of closed forms. A switch moves with the series, `∂θ_s/∂y_l = −m f_l(θ_s)/h′(θ_s)`, which adds
//! `(n⁻ − n⁺) f_k(θ_s) ∂θ_s/∂y_l` to the derivative. Sampled (AFT): the integrals by `N_t` samples, sets from each sample; the derivative
//! does not see the switches move, and the residual is a discontinuous function of the coefficients.

use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

use super::HbmError;
use super::crossing::{Crossing, SWITCHES, spans};
use super::interface::{Interface, PhaseOperator};
use super::rubbing::{self, Along, Contact, Derivatives, Path};
use super::series::{Integrals, Series};
use crate::contact::{Monitor, PointState, States};

/// How the projections are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// From switch to switch, in closed form.
    EventResolved,
    /// Alternating frequency–time with this number of samples a period: an approximation.
    Sampled(usize),
}

/// Projections along a series.
#[derive(Debug)]
pub struct Balance {
    /// `n_k`, function by function, `r` components.
    pub n: Series,
    /// `∂n/∂y`: `(functions · r) × (functions · r_in)`.
    pub derivative: Mat<f64>,
    /// `∂N/∂n`, where the force of something that rubs is an unknown.
    pub by_n: Option<Mat<f64>>,
    /// What all that rubs does.
    pub(super) paths: Vec<Path>,
    /// Switches on the interval of the balance (half a period for a cosine series).
    pub crossings: Vec<Crossing>,
    /// Active sets between them.
    pub sets: Vec<States>,
    /// Nothing touches or rubs: no terms, and the derivative is zero.
    pub(super) is_open: bool,
    /// Touches that may be crossings: tangencies that could not be decided, and switches whose monitor has no slope (the derivative knows
    /// nothing of how they move).
    pub undecided: usize,
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
    let v = |i: usize, j: usize| {
        let (alpha, beta) = op.damping;
        beta * op.p[(i, j)] + op.a.as_ref().map_or(0.0, |a| alpha * a[(i, j)])
    };
    let partner = (op.is_damped() && l > 0)
        .then(|| Mat::from_fn(op.p.nrows(), op.p.ncols(), |i, j| sign * v(i, j)));
    (own, partner)
}

/// The monitor that crosses zero at a switch, of the phase before it, and its slope there.
#[derive(Debug)]
struct Crossed {
    monitor: usize,
    slope: f64,
}

/// Active sets along a series, the switches between them, what crosses zero at each, and the number of undecided touches.
type Walked = (Vec<States>, Vec<Crossing>, Vec<Crossed>, usize);

/// The switches of the contact along a series.
fn walk(interface: &Interface, y: &Series) -> Result<Walked, HbmError> {
    let system = &interface.system;
    let n_c = system.n_contact();
    let u = interface.representative(&y.at(0.0).0);
    let mut set = interface.contact_of(&system.select(0.0, &u, &States::open(n_c))?.set);
    let (basis, n_h) = (y.basis, y.n_h);
    let (mut sets, mut crossings, mut crossed) = (vec![set.clone()], vec![], vec![]);
    let mut theta = 0.0;
    let mut undecided = 0;
    let limit = SWITCHES * n_c * (n_h + 1);
    loop {
        let op = interface.phase(&set)?;
        let mut first: Option<(f64, usize, f64)> = None;
        for k in 0..op.monitors.len() {
            let h = interface.monitor(&op, k, y);
            let end = first.map_or(basis.end(), |f| f.0);
            // a monitor may vanish altogether (at rest on the obstacle)
            let slack = 1e-13 * h.size + 1e-15 * op.units[k];
            if let Some(t) = h.first_crossing(theta, end, slack, &mut undecided)
                && t < end
            {
                first = Some((t.max(theta), k, h.at(t).1));
            }
        }
        let Some((t, monitor, slope)) = first else {
            return Ok((sets, crossings, crossed, undecided));
        };
        let &Monitor { point, to, .. } = &op.monitors[monitor];
        crossings.push(Crossing { theta: t, point, from: set.at(point), to });
        crossed.push(Crossed { monitor, slope });
        set.set(point, PointState::of_contact(to.touches()));
        sets.push(set.clone());
        theta = t;
        if crossings.len() > limit {
            return Err(HbmError::Switches(limit));
        }
    }
}

/// `n` at `θ` in a phase of the contact.
fn value(
    op: &PhaseOperator,
    interface: &Interface,
    y: &Series,
    omega: f64,
    theta: f64,
) -> Vec<f64> {
    let mut n: Vec<f64> = op.s.iter().map(|s| -s).collect();
    for (load, part) in interface.system.loads.harmonics.iter().zip(&op.loads) {
        let c = load.size() * (theta + load.angle()).cos();
        n.iter_mut().zip(part).for_each(|(n, p)| *n -= c * p);
    }
    // P y + (αA + βP) ẏ + A ÿ
    let (mut now, rate, mut curvature) = derivatives(y, theta);
    let (alpha, beta) = op.damping;
    now.iter_mut().zip(&rate).for_each(|(y, v)| *y += omega * beta * v);
    add_product(&mut n, &op.p, &now);
    if let Some(a) = &op.a {
        let all = curvature.iter_mut().zip(&rate);
        all.for_each(|(c, v)| *c = omega * (omega * *c + alpha * v));
        add_product(&mut n, a, &curvature);
    }
    n
}

/// `n += A y`
fn add_product(n: &mut [f64], a: &Mat<f64>, y: &[f64]) {
    for (c, y) in y.iter().enumerate().take(a.ncols()) {
        n.iter_mut().zip(a.col_as_slice(c)).for_each(|(n, a)| *n += a * y);
    }
}

/// A series and its first two derivatives by `θ`.
fn derivatives(y: &Series, theta: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (now, rate) = y.at(theta);
    let mut curvature = vec![0.0; y.n];
    for (f, (k, is_sine)) in y.basis.functions(y.n_h).into_iter().enumerate() {
        let k = k as f64;
        let (sin, cos) = (k * theta).sin_cos();
        let value = -k * k * if is_sine { sin } else { cos };
        curvature.iter_mut().zip(y.of(f)).for_each(|(x, c)| *x += value * c);
    }
    (now, rate, curvature)
}

impl Balance {
    /// Projections of the interface terms along a series of projections `y` at frequency `omega`.
    pub(super) fn new(at: &Along, quadrature: Quadrature) -> Result<Balance, HbmError> {
        match quadrature {
            Quadrature::EventResolved => event_resolved(at),
            Quadrature::Sampled(_) if !at.interface.rubs.is_empty() => Err(HbmError::Samples),
            Quadrature::Sampled(samples) => sampled(at.interface, at.y, at.omega, samples),
        }
    }
}

fn event_resolved(at: &Along) -> Result<Balance, HbmError> {
    let &Along { interface, y, omega, .. } = at;
    let (sets, crossings, crossed, mut undecided) = walk(interface, y)?;
    let (basis, n_h) = (y.basis, y.n_h);
    let functions = basis.functions(n_h);
    let (r, r_in, count) = (interface.rank(), y.n, functions.len());
    let mut n = Series::zeros(basis, n_h, r);
    let mut derivative = Mat::<f64>::zeros(count * r, count * r_in);
    let operators: Result<Vec<Rc<PhaseOperator>>, HbmError> =
        sets.iter().map(|s| interface.phase(s)).collect();
    let operators = operators?;
    let ends = spans(&crossings, basis).map(|(_, end)| end);
    let tables: Vec<Integrals> =
        std::iter::once(0.0).chain(ends).map(|theta| Integrals::new(n_h, theta)).collect();
    // the open phase has no interface terms
    let active: Vec<usize> = (0..sets.len()).filter(|&j| sets[j].count_closed() > 0).collect();
    // ∫ f_k f_l over every phase, phase by phase for all k ≤ l
    let mut integrals = Mat::<f64>::zeros(active.len(), pair(0, count));
    for (place, &j) in active.iter().enumerate() {
        let (a, b, op) = (&tables[j], &tables[j + 1], &operators[j]);
        for l in 0..count {
            for k in 0..=l {
                let (f, g) = (functions[k], functions[l]);
                integrals[(place, pair(k, l))] = b.product(f, g) - a.product(f, g);
            }
        }
        for k in 0..count {
            let scale = 1.0 / basis.weight(functions[k]);
            let over = |l: usize| scale * integrals[(place, pair(k, l))];
            let constant = over(0);
            n.of_mut(k).iter_mut().zip(&op.s).for_each(|(n, s)| *n -= constant * s);
            for (load, part) in interface.system.loads.harmonics.iter().zip(&op.loads) {
                // cos(θ + φ) = cos φ cos θ − sin φ sin θ
                let (sin, cos) = load.angle().sin_cos();
                let c = load.size() * (cos * over(1) - sin * over(2));
                n.of_mut(k).iter_mut().zip(part).for_each(|(n, p)| *n -= c * p);
            }
        }
    }
    let of_phases: Vec<&PhaseOperator> = active.iter().map(|&j| operators[j].as_ref()).collect();
    add_phases(&of_phases, &integrals, y, omega, &mut derivative);
    let is_open = active.is_empty() && interface.rubs.is_empty();
    // n is affine in y with the derivative at fixed switches
    for column in (0..count * r_in).filter(|_| !is_open) {
        let yc = y.a[column];
        if yc != 0.0 {
            n.a.iter_mut().zip(derivative.col_as_slice(column)).for_each(|(n, d)| *n += d * yc);
        }
    }
    let path = Moving { interface, y, omega, operators: &operators, crossed: &crossed };
    if !crossings.is_empty() {
        undecided += path.add(&crossings, &mut derivative);
    }
    // forces of friction do not jump with the series
    let unknown = interface.has_unknown_forces();
    let mut by_n = unknown.then(|| Mat::<f64>::zeros(count * r, count * r));
    let phases = operators.iter().map(|op| op.as_ref()).zip(spans(&crossings, basis)).collect();
    let contact = Contact { phases, sets: &sets };
    let mut derivatives = Derivatives { by_y: &mut derivative, by_n: by_n.as_mut() };
    let (paths, more) = rubbing::add(at, &contact, &mut n, &mut derivatives)?;
    undecided += more;
    let (crossings, sets) = rubbing::merge((crossings, sets), &paths);
    Ok(Balance { n, derivative, by_n, paths, crossings, sets, is_open, undecided })
}

/// Where a product of two functions stands among those of all.
fn pair(k: usize, l: usize) -> usize {
    let (k, l) = (k.min(l), k.max(l));
    l * (l + 1) / 2 + k
}

/// The derivative at fixed switches: column by column of the operators, that of all phases times their integrals.
fn add_phases(
    phases: &[&PhaseOperator],
    integrals: &Mat<f64>,
    y: &Series,
    omega: f64,
    derivative: &mut Mat<f64>,
) {
    let (Some(first), functions) = (phases.first(), y.basis.functions(y.n_h)) else { return };
    let (r, r_in, count) = (first.p.nrows(), y.n, functions.len());
    let rank = derivative.nrows() / count;
    let (alpha, beta) = first.damping;
    let is_damped = first.is_damped();
    // Σ_j ∫ f_k f_l of a column of every phase
    let mut sums = [0; 2].map(|_| Mat::<f64>::zeros(r, integrals.ncols()));
    let mut columns = Mat::<f64>::zeros(r, phases.len());
    let mut sum_up =
        |c: usize, of: &dyn Fn(&PhaseOperator) -> Option<&Mat<f64>>, sum: &mut Mat<f64>| {
            for (j, phase) in phases.iter().enumerate() {
                let Some(matrix) = of(phase) else { return false };
                columns.col_as_slice_mut(j).copy_from_slice(matrix.col_as_slice(c));
            }
            let (target, left, right) = (sum.as_mut(), columns.as_ref(), integrals.as_ref());
            matmul(target, Accum::Replace, left, right, 1.0, Par::Seq);
            true
        };
    for c in 0..first.p.ncols() {
        let [of_p, of_a] = &mut sums;
        sum_up(c, &|op| Some(&op.p), of_p);
        let has_inertia = sum_up(c, &|op| op.a.as_ref(), of_a);
        for (l, &(harmonic, is_sine)) in functions.iter().enumerate() {
            let lw = harmonic as f64 * omega;
            // (cos lθ)′ = −l sin lθ, (sin lθ)′ = l cos lθ
            let (partner, rate) = if is_sine { (l.wrapping_sub(1), lw) } else { (l + 1, -lw) };
            let column = derivative.col_as_slice_mut(l * r_in + c);
            for (k, target) in column.chunks_exact_mut(rank).enumerate() {
                let scale = 1.0 / y.basis.weight(functions[k]);
                let mut add = |sum: &Mat<f64>, function: usize, factor: f64| {
                    let factor = scale * factor;
                    let of = sum.col_as_slice(pair(k, function));
                    target.iter_mut().zip(of).for_each(|(t, s)| *t += factor * s);
                };
                add(of_p, l, 1.0);
                if has_inertia {
                    add(of_a, l, -lw * lw);
                }
                if is_damped && harmonic > 0 {
                    add(of_p, partner, rate * beta);
                    if has_inertia {
                        add(of_a, partner, rate * alpha);
                    }
                }
            }
        }
    }
}

/// The switches of a series move with it: `∂θ_s/∂y_l = −m f_l(θ_s)/h′(θ_s)` adds `(n⁻ − n⁺) f_k(θ_s) ∂θ_s/∂y_l` to the derivative.
struct Moving<'a> {
    interface: &'a Interface,
    y: &'a Series,
    omega: f64,
    operators: &'a [Rc<PhaseOperator>],
    crossed: &'a [Crossed],
}

impl Moving<'_> {
    /// Add the part of every switch; returns the number of those whose monitor has no slope.
    fn add(&self, crossings: &[Crossing], derivative: &mut Mat<f64>) -> usize {
        let Moving { interface, y, omega, operators, crossed } = *self;
        let (basis, n_h) = (y.basis, y.n_h);
        let functions = basis.functions(n_h);
        let (r, r_in, count) = (interface.rank(), y.n, functions.len());
        // columns: f_k (n⁻ − n⁺) over the norm of f_k, and −m f_l / h′ of every switch
        let mut steps = Mat::<f64>::zeros(count * r, crossings.len());
        let mut delays = Mat::<f64>::zeros(crossings.len(), count * r);
        let mut undecided = 0;
        let mut f = vec![];
        for (j, crossing) in crossings.iter().enumerate() {
            let Crossed { monitor, slope } = crossed[j];
            if slope == 0.0 {
                undecided += 1;
                continue;
            }
            let before = value(&operators[j], interface, y, omega, crossing.theta);
            let after = value(&operators[j + 1], interface, y, omega, crossing.theta);
            basis.values(n_h, crossing.theta, &mut f);
            for (k, target) in steps.col_as_slice_mut(j).chunks_exact_mut(r).enumerate() {
                let scale = f[k] / basis.weight(functions[k]);
                let step = before.iter().zip(&after).map(|(a, b)| scale * (a - b));
                target.iter_mut().zip(step).for_each(|(t, s)| *t = s);
            }
            for l in 0..count {
                for c in 0..operators[j].gradients.nrows() {
                    delays[(j, l * r + c)] = -operators[j].gradients[(c, monitor)] * f[l] / slope;
                }
            }
        }
        for l in 0..count {
            // monitors know y₁ alone
            let target = derivative.subcols_mut(l * r_in, r);
            let right = delays.subcols(l * r, r);
            matmul(target, Accum::Add, steps.as_ref(), right, 1.0, Par::Seq);
        }
        undecided
    }
}

fn sampled(
    interface: &Interface,
    y: &Series,
    omega: f64,
    samples: usize,
) -> Result<Balance, HbmError> {
    let (basis, n_h) = (y.basis, y.n_h);
    let functions = basis.functions(n_h);
    let (r, r_in, count) = (interface.rank(), y.n, functions.len());
    let mut n = Series::zeros(basis, n_h, r);
    let mut derivative = Mat::<f64>::zeros(count * r, count * r_in);
    let system = &interface.system;
    let mut set = States::open(system.n_contact());
    let (mut sets, mut crossings) = (vec![], vec![]);
    let mut f = vec![];
    // midpoints: the same rule for half and whole periods
    let h = basis.end() / samples as f64;
    for t in 0..samples {
        let theta = (t as f64 + 0.5) * h;
        let u = interface.representative(&y.at(theta).0);
        let now = system.select(theta / omega, &u, &set)?.set;
        if t > 0 {
            for (point, from, to) in set.changes(&now) {
                crossings.push(Crossing { theta: theta - 0.5 * h, point, from, to });
                sets.push(now.clone());
            }
        } else {
            sets.push(now.clone());
        }
        set = now;
        if set.count_closed() == 0 {
            continue;
        }
        let op = interface.phase(&set)?;
        let value = value(&op, interface, y, omega, theta);
        basis.values(n_h, theta, &mut f);
        for k in 0..count {
            let scale = f[k] * h / basis.weight(functions[k]);
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
                            value * f[k] * h / basis.weight(functions[k]);
                    }
                }
            }
        }
    }
    // samples decide nothing between them
    let (by_n, paths) = (None, vec![]);
    Ok(Balance { n, derivative, by_n, paths, crossings, sets, is_open: false, undecided: 0 })
}
