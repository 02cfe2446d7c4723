//! Forces of friction along a series: event-resolved, as those of the contact.
//!
//! What rubs has a component of its own: its displacement `W(θ)` among the projections, its force `F(θ)` among the interface terms.
//!
//! *A slider with a spring* is a play operator ([`super::play`]): `F = k(W − z)`, or `±L`. Its integrals are closed forms, `z = W(θ_z) ∓ L/k` depends on the series at one instant,
//! and `F` does not jump.
//!
//! *Coulomb's friction without a spring* has no force that displacements would tell: its series `F_N` is an unknown, and the condition `Ẇ − V ∈ N_[−P,P](F)` is
//!
//! ```text
//! F_N = Π_N clamp(x, −P, P),     x = F_N + ρ (Ẇ_N − V)
//! ```
//!
//! whatever `ρ > 0` (Nacivet et al., J. Sound Vib. 265, 2003, with integrals in the place of samples): the point sticks where `|x| < P`, and slips elsewhere. The unknown is the
//! force, so that the tangent does not vanish where all points slip. Forces of a point that comes to rest jump, and their series converge like `1/N_h`.

use faer::Mat;

use super::HbmError;
use super::crossing::Crossing;
use super::interface::{Interface, PhaseOperator};
use super::play::{Jenkins, Memory, Piece, Walk};
use super::rub::{Law, Rub};
use super::series::{Function, Integrals, Polynomial, Series};
use crate::contact::{MonitorKind, PointState, States};

/// What one thing that rubs does along a series.
#[derive(Debug)]
pub(super) struct Path {
    point: usize,
    walk: Walk,
}

/// The contact along a series, as what rubs sees it.
pub(super) struct Contact<'a> {
    /// Phases of the contact, and where they begin and end.
    pub phases: Vec<(&'a PhaseOperator, (f64, f64))>,
    pub sets: &'a [States],
}

/// A series of displacements and of forces, with its frequency.
#[derive(Clone, Copy)]
pub(super) struct Along<'a> {
    pub interface: &'a Interface,
    pub y: &'a Series,
    /// Terms of the last iterate; none are known at the start.
    pub n: Option<&'a Series>,
    pub omega: f64,
}

/// Derivative of the terms by the projections, and by the terms themselves where there is friction without a spring.
pub(super) struct Derivatives<'a> {
    pub by_y: &'a mut Mat<f64>,
    pub by_n: Option<&'a mut Mat<f64>>,
}

impl Along<'_> {
    fn count(&self) -> usize {
        self.y.basis.len(self.y.n_h)
    }

    fn polynomial(&self, coefficients: &[f64]) -> Polynomial {
        Polynomial::new(self.y.basis, self.y.n_h, coefficients)
    }

    /// Coefficients of `W` by components: `y_c`.
    fn displacement(&self, rub: &Rub) -> Vec<f64> {
        self.y.component(rub.component)
    }

    /// `ρ`, in components: what moves the highest harmonic by its inertia.
    fn rho(&self) -> f64 {
        self.y.n_h.max(1) as f64 * self.omega
    }

    /// Coefficients of `x = n_c + ρ (ẏ_c − V/s)`.
    fn trial(&self, rub: &Rub, surface: f64) -> Vec<f64> {
        let mut x = self.y.basis.derivative(&self.displacement(rub));
        let factor = self.rho() * self.omega;
        x.iter_mut().for_each(|x| *x *= factor);
        x[0] -= self.rho() * surface / rub.scale;
        if let Some(n) = self.n {
            x.iter_mut().zip(n.component(rub.component)).for_each(|(x, n)| *x += n);
        }
        x
    }

    /// Coefficients of `s P` in a phase of the contact, and the row of its monitor; a slider's is constant.
    fn limit(&self, rub: &Rub, factor: f64, op: &PhaseOperator) -> (Vec<f64>, Option<usize>) {
        let (system, factor) = (&self.interface.system, factor * rub.scale);
        let mut all = vec![0.0; self.count()];
        if let Some(slider) = system.slider(rub.point) {
            all[0] = factor * slider.limit;
            return (all, None);
        }
        let is_pressure = |k: &usize| {
            let m = &op.monitors[*k];
            m.point == rub.point && m.kind == MonitorKind::Pressure
        };
        let row = (0..op.monitors.len()).find(is_pressure);
        if let Some(k) = row {
            all = self.interface.monitor_coefficients(op, k, self.y);
            all.iter_mut().for_each(|x| *x *= factor);
        }
        (all, row)
    }
}

/// What Coulomb's friction without a spring does: phase by phase of the contact.
fn projected(
    at: &Along,
    rub: &Rub,
    (factor, surface): (f64, f64),
    contact: &Contact,
) -> Result<Walk, HbmError> {
    let mut walk = Walk::new(at.y.n_h * contact.phases.len());
    let x = at.trial(rub, surface);
    let is_slider = at.interface.system.slider(rub.point).is_some();
    let memory = Memory::default();
    for (phase, (op, (begin, end))) in contact.phases.iter().enumerate() {
        let (mut theta, end) = (*begin, *end);
        if !is_slider && !contact.sets[phase].touches(rub.point) {
            walk.push(Piece { begin: theta, end, state: PointState::Open, memory, phase })?;
            continue;
        }
        let (limit, _) = at.limit(rub, factor, op);
        // a P + b x
        let sum = |a: f64, b: f64| {
            let all: Vec<f64> = limit.iter().zip(&x).map(|(p, x)| a * p + b * x).collect();
            at.polynomial(&all)
        };
        let value = at.polynomial(&x).at(theta).0;
        let mut state = match value.abs() > at.polynomial(&limit).at(theta).0 {
            true => PointState::of_slip(value),
            false => PointState::Stick,
        };
        loop {
            let found = match state.slip() {
                None => walk.next(&[sum(1.0, -1.0), sum(1.0, 1.0)], (theta, end)),
                Some(sigma) => walk.next(&[sum(-1.0, sigma)], (theta, end)),
            };
            let until = found.map_or(end, |f| f.0);
            walk.push(Piece { begin: theta, end: until, state, memory, phase })?;
            let Some((there, monitor)) = found else { break };
            state = match state.slip() {
                None => PointState::of_slip(if monitor == 0 { 1.0 } else { -1.0 }),
                Some(_) => PointState::Stick,
            };
            theta = there;
        }
    }
    Ok(walk)
}

/// Add the forces of all that rubs to the terms `n` and to their derivatives; says what each does, and how many touches were undecided.
pub(super) fn add(
    at: &Along,
    contact: &Contact,
    n: &mut Series,
    derivatives: &mut Derivatives,
) -> Result<(Vec<Path>, usize), HbmError> {
    let (mut paths, mut undecided) = (vec![], 0);
    for rub in &at.interface.rubs {
        let walk = match rub.law {
            Law::Elastic { spring, .. } => {
                let w = at.polynomial(&at.displacement(rub)).affine(rub.scale, 0.0);
                let walk = spring.play(&w, at.y.basis.end())?;
                let mut sums = Sums { at, rub, n, derivatives };
                walk.pieces.iter().for_each(|p| sums.elastic(p, &spring));
                walk
            }
            Law::Rigid { factor, surface } => {
                let walk = projected(at, rub, (factor, surface), contact)?;
                let mut sums = Sums { at, rub, n, derivatives };
                let x = at.trial(rub, surface);
                walk.pieces.iter().for_each(|p| sums.rigid(p, &x, factor, contact));
                if walk.pieces.iter().all(|p| p.state == PointState::Stick) {
                    sums.keep_mean();
                }
                walk
            }
        };
        undecided += walk.undecided;
        paths.push(Path { point: rub.point, walk });
    }
    Ok((paths, undecided))
}

/// Sums over the pieces of what one thing does.
struct Sums<'a, 'b> {
    at: &'a Along<'a>,
    rub: &'a Rub,
    n: &'a mut Series,
    derivatives: &'a mut Derivatives<'b>,
}

/// `∫ f_k f_l` over a piece, over the norm of `f_k`.
struct Products {
    ends: [Integrals; 2],
    functions: Vec<Function>,
    scale: Vec<f64>,
}

impl Products {
    fn new(y: &Series, piece: &Piece) -> Products {
        let functions = y.basis.functions(y.n_h);
        let scale = functions.iter().map(|f| 1.0 / y.basis.weight(*f)).collect();
        let ends = [piece.begin, piece.end].map(|theta| Integrals::new(y.n_h, theta));
        Products { ends, functions, scale }
    }

    fn at(&self, k: usize, l: usize) -> f64 {
        let (f, g) = (self.functions[k], self.functions[l]);
        let [a, b] = &self.ends;
        self.scale[k] * (b.product(f, g) - a.product(f, g))
    }
}

impl Sums<'_, '_> {
    /// Row of function `k` in the terms, and column of function `l`'s component `c` in the projections.
    fn row(&self, k: usize) -> usize {
        k * self.n.n + self.rub.component
    }

    fn column(&self, l: usize, c: usize) -> usize {
        l * self.at.y.n + c
    }

    /// A piece of a slider with a spring.
    fn elastic(&mut self, piece: &Piece, &Jenkins { limit, stiffness }: &Jenkins) {
        let (count, c, scale) = (self.at.count(), self.rub.component, self.rub.scale);
        let products = Products::new(self.at.y, piece);
        if let Some(sigma) = piece.state.slip() {
            (0..count)
                .for_each(|k| self.n.of_mut(k)[c] += scale * sigma * limit * products.at(k, 0));
            return;
        }
        // s k (s y_c − z),  z = s y_c(θ_z) ∓ L/k
        let mut then = vec![];
        match piece.memory.set_at {
            Some(theta) => self.at.y.basis.values(self.at.y.n_h, theta, &mut then),
            None => then.resize(count, 0.0),
        }
        let factor = stiffness * scale * scale;
        for k in 0..count {
            let constant = products.at(k, 0);
            let mut force = -stiffness * scale * piece.memory.z * constant;
            for (l, then) in then.iter().enumerate() {
                let product = products.at(k, l);
                force += factor * product * self.at.y.of(l)[c];
                let place = (self.row(k), self.column(l, c));
                self.derivatives.by_y[place] += factor * (product - then * constant);
            }
            self.n.of_mut(k)[c] += force;
        }
    }

    /// A piece of Coulomb's friction: `x` where it sticks, `±sP` where it slips.
    fn rigid(&mut self, piece: &Piece, x: &[f64], factor: f64, contact: &Contact) {
        let (count, c) = (self.at.count(), self.rub.component);
        if piece.state == PointState::Open || piece.begin == piece.end {
            return;
        }
        let products = Products::new(self.at.y, piece);
        if let Some(sigma) = piece.state.slip() {
            let op = contact.phases[piece.phase].0;
            let (limit, row) = self.at.limit(self.rub, factor, op);
            for k in 0..count {
                for l in 0..count {
                    let product = sigma * products.at(k, l);
                    self.n.of_mut(k)[c] += product * limit[l];
                    let Some(row) = row else { break };
                    for j in 0..op.gradients.nrows() {
                        let place = (self.row(k), self.column(l, j));
                        self.derivatives.by_y[place] +=
                            product * factor * self.rub.scale * op.gradients[(j, row)];
                    }
                }
            }
            return;
        }
        let slope = self.at.rho() * self.at.omega;
        for k in 0..count {
            for l in 0..count {
                let product = products.at(k, l);
                self.n.of_mut(k)[c] += product * x[l];
                let place = (self.row(k), self.row(l));
                if let Some(by_n) = &mut self.derivatives.by_n {
                    by_n[place] += product;
                }
                // x_l has l b_l in the place of a cosine, and −l a_l in that of a sine
                let (harmonic, is_sine) = products.functions[l];
                if harmonic > 0 {
                    let (partner, sign) = if is_sine { (l - 1, -1.0) } else { (l + 1, 1.0) };
                    let place = (self.row(k), self.column(partner, c));
                    self.derivatives.by_y[place] += product * slope * sign * harmonic as f64;
                }
            }
        }
    }

    /// Where a point never slips the mean of its force is that of the guess: any is a solution.
    fn keep_mean(&mut self) {
        let place = (self.row(0), self.row(0));
        if let Some(by_n) = &mut self.derivatives.by_n {
            by_n[place] = 0.0;
        }
    }
}

/// The switches of the contact and of all that rubs in one order, with the sets between them.
pub(super) fn merge(
    (crossings, sets): (Vec<Crossing>, Vec<States>),
    paths: &[Path],
) -> (Vec<Crossing>, Vec<States>) {
    if paths.is_empty() {
        return (crossings, sets);
    }
    // the contact decides whether a point touches, what rubs decides how
    let mut all: Vec<(f64, usize, PointState)> =
        crossings.iter().map(|c| (c.theta, c.point, c.to)).collect();
    let mut first = sets[0].clone();
    for path in paths {
        all.retain(|a| a.1 != path.point);
        first.set(path.point, path.walk.pieces[0].state);
        let pairs = path.walk.pieces.windows(2).filter(|w| w[0].state != w[1].state);
        all.extend(pairs.map(|w| (w[1].begin, path.point, w[1].state)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut set, mut merged) = (first.clone(), (vec![], vec![first]));
    for (theta, point, to) in all {
        merged.0.push(Crossing { theta, point, from: set.at(point), to });
        set.set(point, to);
        merged.1.push(set.clone());
    }
    merged
}

/// What springs remember at a phase angle: entry of `u_O`, and `z`.
pub(super) fn remembered(rubs: &[Rub], paths: &[Path], theta: f64) -> Vec<(usize, f64)> {
    let of = |(rub, path): (&Rub, &Path)| {
        let Law::Elastic { memory, .. } = rub.law else { return None };
        Some((memory, path.walk.at(theta).memory.z))
    };
    rubs.iter().zip(paths).filter_map(of).collect()
}
