//! Points before rough obstacles that have no mass in any direction: their displacements follow quasi-statically, and which of them stick is no matter of the other
//! displacements alone.
//!
//! ```text
//! r = p_f − N_C u_C − N_O u_O,      0 ≤ w = g − u_n ⟂ r_n ≥ 0,      |r_t| ≤ μ r_n,   r_t s = μ r_n |s|
//! ```
//!
//! with `s = u̇_t − V`, or, of a state whose past is not known, `s = u_t − z` (the return mapping). The same holds one order up on the points that are undecided. With `μ` below a bound that
//! the contact block of the stiffness sets there is one solution ([`critical_friction`]); it is found by pivoting: every point that violates a condition of its state goes to
//! the neighbouring one.

use nalgebra::DMatrix;

use super::ContactError;
use super::conditions::Conditions;
use super::method::Selection;
use super::phase::Phase;
use super::states::{PointState, States};
use super::system::System;
use crate::fem::largest;

/// What a point does at a state, or one order up.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Touch {
    /// `w`
    pub gap: f64,
    /// `s`
    pub slide: f64,
    /// `r_n` over the area.
    pub normal: f64,
    /// `r_t` over the area.
    pub tangential: f64,
    /// Sizes of the terms of displacements and of reactions.
    pub sizes: [f64; 2],
}

/// Between which states a point is undecided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Choice {
    pub opens: bool,
    pub sticks: bool,
    /// To which sides it may slip.
    pub slips: [bool; 2],
}

impl Choice {
    /// All states.
    pub const ALL: Choice = Choice { opens: true, sticks: true, slips: [true; 2] };

    /// The present state or rest, of a point that slips.
    pub fn of_slip(sigma: f64) -> Choice {
        Choice { opens: false, sticks: true, slips: [sigma > 0.0, sigma < 0.0] }
    }

    /// Whether it may slip to a side.
    pub fn may_slip(&self, sigma: f64) -> bool {
        self.slips[usize::from(sigma < 0.0)]
    }

    /// Its states, of a point with friction or without.
    fn states(&self, has_friction: bool) -> Vec<PointState> {
        let touching = match has_friction {
            false => vec![(true, PointState::Closed)],
            true => vec![
                (self.sticks, PointState::Stick),
                (self.slips[0], PointState::SlipPlus),
                (self.slips[1], PointState::SlipMinus),
            ],
        };
        let all = std::iter::once((self.opens, PointState::Open)).chain(touching);
        all.filter(|s| s.0).map(|s| s.1).collect()
    }
}

/// A condition that is violated by less than this share of the size of its terms is not.
const VIOLATED: f64 = 1e-10;

/// Rounds in which all violating points change together; after these one at a time.
const TOGETHER: usize = 12;

/// So many combinations of states are tried where pivoting goes round in circles.
const COMBINATIONS: usize = 4096;

impl System {
    /// What the points do in a phase: at a state `x = u_O` (order 0), or where `x` is a derivative of it of this order, with what moves the surface in its entries `z`.
    pub(crate) fn touches(&self, phase: &Phase, (t, order): (f64, u32), x: &[f64]) -> Vec<Touch> {
        let c = self.conditions();
        let mut full = vec![0.0; self.n()];
        match order {
            0 => phase.expand_displacement(t, x, &mut full),
            _ => phase.expand(x, &mut full),
        }
        let (x_o, x_c) = full.split_at(self.n_o());
        let load = if order == 0 { self.load_pressure(t) } else { None };
        let reaction = |d: usize| {
            let load = load.as_ref().map_or(0.0, |p| p[d]);
            load - c.n_o.row_dot(d, x_o) - c.n_c.row_dot(d, x_c)
        };
        let (of_o, of_c) = (largest(x_o), largest(x_c));
        let point = |i: usize| -> Touch {
            let (d, sign) = c.points[i];
            let sums = c.sums(d);
            let gap = if order == 0 { c.gap[i] } else { 0.0 };
            let sizes = [of_c.max(gap.abs()), sums.0 * of_o + sums.1 * of_c];
            let touch = Touch {
                gap: gap - sign * x_c[d],
                normal: sign * reaction(d),
                sizes,
                ..Touch::default()
            };
            let Some(tangent) = self.tangent(i) else { return touch };
            let Some(anchor) = tangent.anchor else { return touch };
            let along = c.sums(anchor.displacement);
            let behind = match order {
                0 => x_o[anchor.memory],
                1 => tangent.surface,
                _ => 0.0,
            };
            let along = along.0 * of_o + along.1 * of_c;
            Touch {
                slide: x_c[anchor.displacement] - behind,
                tangential: reaction(anchor.displacement),
                sizes: [sizes[0].max(behind.abs()), sizes[1].max(along)],
                ..touch
            }
        };
        (0..self.facing().len()).map(point).collect()
    }

    /// Where a point goes whose state violates a condition; `blur` are the errors of displacements and reactions.
    fn leaves(
        &self,
        point: usize,
        (state, choice): (PointState, Choice),
        touch: &Touch,
        blur: [f64; 2],
    ) -> Option<PointState> {
        let least = [0, 1].map(|k| VIOLATED * touch.sizes[k] + blur[k]);
        let Some(tangent) = self.tangent(point) else {
            return match state.touches() {
                false if touch.gap < -least[0] => Some(PointState::Closed),
                true if touch.normal < -least[1] => Some(PointState::Open),
                _ => None,
            };
        };
        let sides = || [1.0, -1.0].into_iter().filter(|s| choice.may_slip(*s));
        if state == PointState::Open {
            if touch.gap >= -least[0] {
                return None;
            }
            let slides = |s: &f64| s * touch.slide > least[0] || !choice.sticks;
            let slip = sides().find(slides).map(PointState::of_slip);
            return Some(slip.unwrap_or(PointState::Stick));
        }
        if choice.opens && touch.normal < -least[1] {
            return Some(PointState::Open);
        }
        match state.slip() {
            Some(sigma) => {
                let back = sigma * touch.slide < -least[0];
                (back && choice.sticks).then_some(PointState::Stick)
            }
            None => {
                let margin = |s: f64| tangent.coefficient * touch.normal - s * touch.tangential;
                let worst = sides().min_by(|a, b| margin(*a).total_cmp(&margin(*b)));
                worst.filter(|s| margin(*s) < -least[1]).map(PointState::of_slip)
            }
        }
    }

    /// The states of the undecided points, from those of `set`, and what all points do in them; none where no combination is found. `at` gives the latter in a phase.
    pub(crate) fn pivot_adhesion(
        &self,
        mut set: States,
        undecided: &[(usize, Choice)],
        blur: [f64; 2],
        at: impl Fn(&Phase) -> Vec<Touch>,
    ) -> Option<(States, Vec<Touch>)> {
        let moves = |set: &States| {
            let touches = at(&self.phase(set));
            let of = |&(i, choice): &(usize, Choice)| {
                let to = self.leaves(i, (set.at(i), choice), &touches[i], blur)?;
                Some((i, to))
            };
            let moves: Vec<(usize, PointState)> = undecided.iter().filter_map(of).collect();
            (moves, touches)
        };
        for round in 0..TOGETHER + 8 * undecided.len() {
            let (wrong, touches) = moves(&set);
            let few = if round < TOGETHER { wrong.len() } else { wrong.len().min(1) };
            if few == 0 {
                return Some((set, touches));
            }
            wrong[..few].iter().for_each(|&(i, to)| set.set(i, to));
        }
        let choices: Vec<(usize, Vec<PointState>)> = undecided
            .iter()
            .map(|(i, choice)| (*i, choice.states(self.tangent(*i).is_some())))
            .collect();
        let count = choices.iter().try_fold(1usize, |n, c| n.checked_mul(c.1.len()))?;
        if count > COMBINATIONS {
            return None;
        }
        (0..count).find_map(|mut k| {
            for (i, states) in &choices {
                set.set(*i, states[k % states.len()]);
                k /= states.len();
            }
            let (wrong, touches) = moves(&set);
            wrong.is_empty().then(|| (set.clone(), touches))
        })
    }

    /// The states of all points whose past is not known: they would stick at `z`, the entries of `u_O`.
    pub(super) fn select_adhering(
        &self,
        t: f64,
        u_o: &[f64],
        start: &States,
    ) -> Result<Selection, ContactError> {
        let all: Vec<(usize, Choice)> =
            (0..self.facing().len()).map(|i| (i, Choice::ALL)).collect();
        let begin = start.iter().enumerate().map(|(i, state)| match self.tangent(i) {
            Some(_) if state == PointState::Closed => PointState::Stick,
            _ => state,
        });
        let at = |phase: &Phase| self.touches(phase, (t, 0), u_o);
        // a single condition that only rounding violates is not
        let found = self.pivot_adhesion(begin.collect(), &all, [0.0; 2], at);
        let (set, _) = found.ok_or(ContactError::NoAdhesion { t })?;
        Ok(Selection { set, degenerate: vec![] })
    }

    /// Whether one motion goes on from every state for a simple reason: the comparison matrix of the contact block, scaled to a diagonal of one, with `μ |K_n·|` taken from the rows along
    /// the obstacles, is an M-matrix. `I − B` is one where `max_i (B x)_i/x_i < 1` for some `x > 0`.
    pub fn friction_is_surely_unique(&self) -> bool {
        let c = self.conditions();
        let size = c.count();
        let stiffness = |i: usize, j: usize| c.area[i] * c.n_c[(i, j)];
        let root: Vec<f64> = (0..size).map(|i| stiffness(i, i).sqrt()).collect();
        let scaled = |i: usize, j: usize| stiffness(i, j).abs() / (root[i] * root[j]);
        let mut b = DMatrix::from_fn(size, size, |i, j| if i == j { 0.0 } else { scaled(i, j) });
        for (point, anchor) in self.anchors() {
            let (n, t) = (c.points[point].0, anchor.displacement);
            let mu = self.tangent(point).map_or(0.0, |t| t.coefficient);
            (0..size).for_each(|j| b[(t, j)] += mu * scaled(n, j));
        }
        let mut x = nalgebra::DVector::from_element(size, 1.0);
        for _ in 0..ROUNDS {
            let y = &b * &x;
            if y.iter().zip(x.iter()).all(|(y, x)| y < x) {
                return true;
            }
            // what no other knows of keeps a little
            let most = y.max();
            x = y.map(|y| (y / most).max(1e-6));
        }
        false
    }

    /// The least bound of friction coefficients above which several motions, or none, go on from a state, of neighbouring points; none without such points.
    pub fn critical_friction(&self) -> Option<(f64, Vec<usize>)> {
        let all = self.anchors();
        let windows = all.windows(WINDOW.min(all.len().max(1)));
        let of = |window: &[(usize, super::Anchor)]| {
            let points: Vec<usize> = window.iter().map(|a| a.0).collect();
            let pairs: Vec<[usize; 2]> = window
                .iter()
                .map(|(i, a)| [self.conditions().points[*i].0, a.displacement])
                .collect();
            (critical_friction(self.conditions(), &pairs), points)
        };
        windows.map(of).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Steps of the power method.
const ROUNDS: usize = 60;

/// So many neighbouring points are looked at together.
const WINDOW: usize = 5;

/// `1/max |λ|` over the real eigenvalues of `K_FF⁻¹ Σ σ e_t K_nF`, of all sets of points that are open, slip to either side or stick: below it `det K_EF > 0` in all of them. `pairs`: normal and
/// tangential displacement of each point.
pub(crate) fn critical_friction(conditions: &Conditions, pairs: &[[usize; 2]]) -> f64 {
    let stiffness = |i: usize, j: usize| conditions.area[i] * conditions.n_c[(i, j)];
    let states = 4usize.pow(pairs.len() as u32);
    let mut most = 0.0f64;
    for mut code in 0..states {
        let (mut free, mut slips) = (vec![], vec![]);
        for &[n, t] in pairs {
            match code % 4 {
                0 => free.extend([n, t]),
                1 => {}
                sigma => {
                    slips.push((free.len(), n, if sigma == 2 { 1.0 } else { -1.0 }));
                    free.push(t);
                }
            }
            code /= 4;
        }
        if slips.is_empty() {
            continue;
        }
        let size = free.len();
        let k = DMatrix::from_fn(size, size, |a, b| stiffness(free[a], free[b]));
        let mut rows = DMatrix::<f64>::zeros(size, size);
        for (a, n, sigma) in slips {
            (0..size).for_each(|b| rows[(a, b)] = sigma * stiffness(n, free[b]));
        }
        let Some(product) = k.lu().solve(&rows) else { continue };
        // those of nalgebra may not end where columns vanish
        let product = faer::Mat::from_fn(size, size, |a, b| product[(a, b)]);
        let Ok(all) = product.eigenvalues() else { continue };
        let of_real = |l: &&faer::c64| l.im.abs() <= 1e-9 * l.norm();
        most = all.iter().filter(of_real).fold(most, |m, l| m.max(l.re.abs()));
    }
    1.0 / most
}
