//! The switching functions of a phase, `h_k ≥ 0` while it is valid: each an affine function of the displacements (theory §3, §5), with friction of the
//! velocities too.
//!
//! ```text
//! h = c + r_O · u_O + r_C · u_C + ρ_O · u̇_O
//! ```
//!
//! The rows share the matrices of the method; gaps are `g − s u_C`, pressures `s (p_f − N_O u_O − N_C u_C)`, or reactions over an area; of a point that
//! slips `σ(v_t − V)`, of one that sticks `μ p ∓ q` with the traction `q = r_t/area` ([`super::friction`]).

use std::sync::Arc;

use super::conditions::Conditions;
use super::lcp::UNITS;
use super::states::PointState;
use crate::fem::Csr;

/// What a monitor watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MonitorKind {
    /// Gap of a free node.
    Gap,
    /// Pressure of a node in contact.
    Pressure,
    /// How deep a node is in an obstacle that yields.
    Depth,
    /// `μ p − q` of a node that sticks: at zero it slips forwards.
    StickPlus,
    /// `μ p + q` of a node that sticks: at zero it slips backwards.
    StickMinus,
    /// `σ (v_t − V)` of a node that slips: at zero it comes to rest.
    Slip,
    /// `θ` of a held node: at zero it goes into contact.
    HeldToContact,
    /// `1 − θ` of a held node: at zero it is released.
    HeldToFree,
}

impl MonitorKind {
    /// All kinds.
    pub const ALL: [MonitorKind; 8] = [
        MonitorKind::Gap,
        MonitorKind::Pressure,
        MonitorKind::Depth,
        MonitorKind::StickPlus,
        MonitorKind::StickMinus,
        MonitorKind::Slip,
        MonitorKind::HeldToContact,
        MonitorKind::HeldToFree,
    ];

    /// Word in files.
    pub fn word(self) -> &'static str {
        match self {
            MonitorKind::Gap => "gap",
            MonitorKind::Pressure => "pressure",
            MonitorKind::Depth => "depth",
            MonitorKind::StickPlus => "stick+",
            MonitorKind::StickMinus => "stick-",
            MonitorKind::Slip => "slip",
            MonitorKind::HeldToContact => "closing",
            MonitorKind::HeldToFree => "opening",
        }
    }

    /// Whether it belongs to friction along the tangent.
    pub(crate) fn is_tangential(self) -> bool {
        matches!(self, MonitorKind::StickPlus | MonitorKind::StickMinus | MonitorKind::Slip)
    }

    /// Whether it is a weight of a held node, and not a function of the displacements.
    pub(crate) fn is_weight(self) -> bool {
        matches!(self, MonitorKind::HeldToContact | MonitorKind::HeldToFree)
    }

    /// The kind of a word in a file.
    pub fn of_word(word: &str) -> Option<MonitorKind> {
        MonitorKind::ALL.into_iter().find(|k| k.word() == word)
    }
}

/// One switching function of a phase: positive inside it, zero where its point changes its state.
#[derive(Debug, Clone)]
pub struct Monitor {
    /// Contact point (index in `u_C`).
    pub point: usize,
    /// What is watched.
    pub kind: MonitorKind,
    /// The state that it leads to.
    pub to: PointState,
    /// Its value.
    pub(super) row: Row,
}

/// Which of the monitors of a phase it is through which a point leaves to the state `to`: what turns back on the surface of the obstacle leaves through the end of its slip; the
/// first of the point where it stays what it is (an impact).
pub fn leading(monitors: &[Monitor], point: usize, to: PointState) -> Option<usize> {
    let turns = to.slip().is_some();
    let of = |leads: &dyn Fn(&Monitor) -> bool| {
        monitors.iter().position(|m| m.point == point && leads(m))
    };
    of(&|m| m.to == to)
        .or_else(|| of(&|m| turns && m.kind == MonitorKind::Slip))
        .or_else(|| of(&|_| true))
}

/// A function of the displacements of a body: `factor` times a row of a matrix that phases share, or one entry.
#[derive(Debug, Clone)]
pub(super) enum Term {
    /// Entry of `u_C`.
    Entry(usize),
    /// Entry of `u_O`.
    Of(usize),
    /// Row of `N_O` on `u_O`.
    StressO(Arc<Conditions>, usize),
    /// Row of `N_C` on `u_C`.
    StressC(Arc<Conditions>, usize),
    /// A row of a matrix over `u_O`.
    Over(Arc<Csr>, usize),
    /// A row of its own on `u_O`.
    Own(Arc<[f64]>),
    /// What a point that sticks feels along its tangent, of all that stick together: of displacements and velocities.
    Traction(usize),
}

/// What rows are functions of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    /// `x_O`
    pub of_o: &'a [f64],
    /// `x_C`
    pub of_c: &'a [f64],
    /// Linear parts of the tractions of all that stick.
    pub tractions: &'a [f64],
}

impl Term {
    fn value(&self, seen: &Seen) -> f64 {
        let Seen { of_o: x_o, of_c: x_c, tractions } = *seen;
        match self {
            Term::Entry(d) => x_c[*d],
            Term::Of(j) => x_o[*j],
            Term::StressO(c, d) => c.n_o.row_dot(*d, x_o),
            Term::StressC(c, d) => c.n_c.row_dot(*d, x_c),
            Term::Over(matrix, i) => matrix.row_dot(*i, x_o),
            Term::Own(row) => row.iter().zip(x_o).map(|(r, x)| r * x).sum(),
            Term::Traction(i) => tractions[*i],
        }
    }
}

/// Size of the terms of a monitor, for displacements of the order of `u`: `(a u + b max(u, |g|))/c`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub a: f64,
    pub b: f64,
    /// The gap of the point.
    pub gap: f64,
    pub c: f64,
}

impl Size {
    fn of(&self, u: f64) -> f64 {
        (self.a * u + self.b * u.max(self.gap.abs())) / self.c
    }

    /// `x` times it, and `y` times another.
    pub fn plus(&self, x: f64, other: &Size, y: f64) -> Size {
        let of = |this: f64, that: f64| x * this / self.c + y * that / other.c;
        Size {
            a: of(self.a, other.a),
            b: of(self.b, other.b),
            gap: self.gap.abs().max(other.gap.abs()),
            c: 1.0,
        }
    }
}

/// One switching function.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// At `u = 0`, without drives.
    pub constant: f64,
    /// The linear part: factors and terms.
    pub terms: Vec<(f64, Term)>,
    /// Of velocities, over `u̇_O` alone.
    pub rates: Vec<(f64, Term)>,
    /// What each drive of the phase adds.
    pub drives: Vec<f64>,
    /// Of its value, and of its rates (or second derivatives).
    pub size: [Size; 2],
    /// Size of its terms in velocities of the order of one.
    pub rate_size: f64,
}

impl Row {
    /// Without velocities.
    pub fn of_displacements(
        constant: f64,
        terms: Vec<(f64, Term)>,
        drives: Vec<f64>,
        size: [Size; 2],
    ) -> Row {
        Row { constant, terms, rates: vec![], drives, size, rate_size: 0.0 }
    }

    /// `c + r_O · x_O + r_C · x_C`, or the linear part.
    pub fn value(&self, seen: &Seen, is_affine: bool) -> f64 {
        let constant = if is_affine { self.constant } else { 0.0 };
        self.terms.iter().fold(constant, |h, (factor, term)| h + factor * term.value(seen))
    }

    /// `ρ_O · x_O`
    pub fn of_velocity(&self, v_o: &[f64]) -> f64 {
        let seen = Seen { of_o: v_o, of_c: &[], tractions: &[] };
        self.rates.iter().map(|(factor, term)| factor * term.value(&seen)).sum()
    }

    /// Its rounding error when displacements are of the order of `u`, velocities of that of `v`.
    pub fn rounding(&self, u: f64, v: f64) -> f64 {
        UNITS * (self.size[0].of(u) + self.rate_size * v)
    }

    /// The linear part over `u_O` and `u_C`, entry by entry; tractions, which know velocities too, are left out.
    pub fn entries(&self, mut of_o: impl FnMut(usize, f64), mut of_c: impl FnMut(usize, f64)) {
        for (factor, term) in &self.terms {
            match term {
                Term::Entry(d) => of_c(*d, *factor),
                Term::Of(j) => of_o(*j, *factor),
                Term::StressO(c, d) => c.n_o.row(*d).for_each(|(j, v)| of_o(j, factor * v)),
                Term::StressC(c, d) => c.n_c.row(*d).for_each(|(j, v)| of_c(j, factor * v)),
                Term::Over(matrix, i) => matrix.row(*i).for_each(|(j, v)| of_o(j, factor * v)),
                Term::Own(row) => row.iter().enumerate().for_each(|(j, v)| of_o(j, factor * v)),
                Term::Traction(_) => {}
            }
        }
    }

    /// That of its rate (or second derivative) when `u̇_O` (`ü_O`) is of the order of `size`.
    pub(crate) fn rate_rounding(&self, size: f64) -> f64 {
        UNITS * self.size[1].of(size)
    }
}
