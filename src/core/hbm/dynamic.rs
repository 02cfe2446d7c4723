//! Harmonic balance of bodies that are too large for all their modes: the open body by its dynamic stiffness.
//!
//! Newton's method goes on the interface terms alone, `n = N(ĉ − Ĝ n)` ([`Receptance`]); with `M₀L` the orthonormal directions
//!
//! ```text
//! G_k = (M₀L)ᵀ D_k⁻¹ (M₀L),     D_k = K₀ − k²ω²M₀ + ikω(αM₀ + βK₀ + WᵀW)
//! ```
//!
//! and `D_k u_k = f_k − M₀L n_k` gives the displacements of a solution. Series are those of the projections `y`.
//!
//! With Rayleigh's damping `D_k = (1 + ikωβ)(K₀ − σ_k M₀)`, `σ_k = (k²ω² − ikωα)/(1 + ikωβ)`: the lowest modes and moments of all others answer for every harmonic of every frequency
//! ([`Moments`]). Else each harmonic takes a sparse factorisation.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use faer::{Mat, c64};

use super::interface::{Directions, Form, Interface};
use super::newton::{self, Settings};
use super::receptance::{Receptance, load_series};
use super::series::Series;
use super::solution::Solution;
use super::{Balanced, HbmError};
use crate::contact::System;
use crate::continuation::{dot, norm};
use crate::fem::{
    Csr, Discrete, DynamicFactor, DynamicStiffness, FemError, Moments, SpdFactor, eigen,
    with_elements,
};
use crate::records::GapReason;

/// A large body.
pub struct Dynamic {
    interface: Interface,
    stiffness: DynamicStiffness,
    /// `K₀`, `M₀` where its damping is Rayleigh's.
    pencil: Option<(Csr, Csr)>,
    /// What answers for the harmonics of frequencies up to those of a level; none where it is not to be had.
    expansions: RefCell<BTreeMap<i32, Option<Rc<Expansion>>>>,
    /// Rows on which `M₀L` is not zero, and these rows.
    directions: (Vec<usize>, Mat<f64>),
    /// Forces on `u_O` of the open phase: the constant one, those of the harmonic loads.
    forces: (Vec<f64>, Vec<Vec<f64>>),
    /// The first mode.
    first: FirstMode,
    /// Of the interface terms.
    force_unit: f64,
    /// `√(fᵀM₀⁻¹f)` of the constant force, and of each harmonic load.
    sizes: (f64, Vec<f64>),
    /// What was computed last.
    answers: RefCell<Answers>,
}

/// The first mode of the open body: a coordinate that is never the least of a motion.
struct FirstMode {
    omega: f64,
    /// `φᵀWᵀWφ` of the dampers.
    by_dampers: f64,
    shape: Vec<f64>,
    /// `φᵀM₀L`
    directions: Vec<f64>,
    /// `φᵀf` of the constant force, and of each harmonic load.
    forces: ([f64; 1], Vec<Vec<f64>>),
}

/// Modes and moments of the directions, then of the constant force and of each harmonic load.
struct Expansion {
    moments: Moments,
    /// What they are in the directions.
    among: (Mat<f64>, Vec<Mat<f64>>),
}

/// What one harmonic of a frequency does.
struct Answer {
    /// `G_k`, real and imaginary part.
    receptance: [Mat<f64>; 2],
    /// `c_k`
    of_loads: Vec<c64>,
    by: By,
}

/// What displacements of a harmonic come from.
enum By {
    Moments(Rc<Expansion>),
    /// `D_k⁻¹ [M₀L, f_k]`
    Columns(Mat<c64>),
    /// There was no room for them.
    Nothing,
}

/// The answers at one frequency, from `k = 0` on.
#[derive(Default)]
struct Answers {
    omega: f64,
    level: i32,
    of_harmonic: Vec<Answer>,
}

/// Frequencies up to so many times the first one are those of the lowest level, which most need; from level to level they grow by half.
const LOWEST: f64 = 10.0;
const LEVELS: f64 = 1.5;

/// Answers of modes and moments are taken up to this bound of their error.
const ERROR: f64 = 2e-12;

/// Bytes of displacements that are kept of a frequency, or of moments: what does not fit is computed again.
const ROOM: usize = 1 << 30;

/// A shape that moves the contact by less, over what the contact's own directions move it by, does not move it.
const NO_REACH: f64 = 1e-9;

impl Dynamic {
    /// Find the directions and the first mode.
    pub fn new(system: System, form: Form) -> Result<Dynamic, HbmError> {
        super::check_frequencies(&system)?;
        let form = form.of(&system);
        let open = system.open_phase();
        let (k, m) = open.matrices();
        // what springs of sliders remember by takes part in no motion
        let held = system.sliders().iter().filter_map(|s| s.elastic).map(|e| {
            let (row, stiffness) = (vec![(e.memory, 1.0)], system.units.highest.powi(2));
            Discrete { row, stiffness, mass: 0.0 }
        });
        let k = with_elements(k, &held.collect::<Vec<_>>(), |e| e.stiffness);
        let n = system.n_o();
        let factor = SpdFactor::new(&m, "mass matrix of the open phase")?;
        let mut scratch = factor.scratch();
        let directions = Directions::new(&system, |column| {
            let mut b = vec![0.0; n];
            column.iter().for_each(|&(i, v)| b[i] = v);
            let mut x = b.clone();
            factor.solve(&mut x, &mut scratch);
            (b, x)
        });
        // (M₀L, L)
        let basis = &directions.pairs;
        let support: Vec<usize> =
            (0..n).filter(|&i| basis.iter().any(|(b, _)| b[i] != 0.0)).collect();
        let rows = Mat::from_fn(support.len(), basis.len(), |i, c| basis[c].0[support[i]]);
        let forces = (
            open.constant_force(),
            system.loads.harmonics.iter().map(|h| open.reduce(&h.force)).collect(),
        );
        let mut size = |f: &Vec<f64>| {
            let mut x = f.clone();
            factor.solve(&mut x, &mut scratch);
            dot(f, &x).max(0.0).sqrt()
        };
        let of_loads: &Vec<Vec<f64>> = &forces.1;
        let sizes = (size(&forces.0), of_loads.iter().map(&mut size).collect());
        let lowest = eigen::lowest(&k, &m, 1, system.units.frequency)?;
        let Some((omega, shape)) = lowest.omega.into_iter().zip(lowest.shapes).next() else {
            return Err(FemError::Singular { what: "mass matrix of the open phase" }.into());
        };
        if omega == 0.0 {
            return Err(HbmError::Free(n));
        }
        let of_shape = basis.iter().map(|(b, _)| dot(b, &shape)).collect();
        let of_first =
            ([dot(&forces.0, &shape)], of_loads.iter().map(|f| vec![dot(f, &shape)]).collect());
        // a first mode that does not move the contact has no say
        let reach = |(_, x): &(Vec<f64>, Vec<f64>)| system.reach(x);
        let (of_first_mode, locally) =
            (system.reach(&shape), basis.iter().map(reach).fold(0.0, f64::max));
        let furthest = if of_first_mode > NO_REACH * locally { of_first_mode } else { locally };
        let force_unit = omega * omega * system.units.length / furthest;
        let (damps, dampers) = (open.damping_stiffness(), system.dampers.as_ref());
        let by_dampers = dampers.map_or(0.0, |d| d.power(&shape));
        let dampers = dampers.map(|d| d.matrix());
        let is_plain = damps.is_none() && dampers.is_none();
        let stiffness = DynamicStiffness::new((&k, &m), damps.as_ref(), dampers.as_ref())?;
        Ok(Dynamic {
            stiffness,
            pencil: is_plain.then_some((k, m)),
            expansions: RefCell::default(),
            directions: (support, rows),
            forces,
            first: FirstMode { omega, by_dampers, shape, directions: of_shape, forces: of_first },
            force_unit,
            sizes,
            answers: RefCell::default(),
            interface: Interface::new(system, form, directions.lifted(), directions),
        })
    }

    /// `D_k`, factorised.
    fn factor(&self, k: usize, omega: f64) -> Result<DynamicFactor, HbmError> {
        let damping = self.interface.damping();
        Ok(self.stiffness.factor(k as f64 * omega, damping)?)
    }

    /// Coefficients of the loads on `u_O`.
    fn loads(&self, n_h: usize) -> Series {
        load_series(&self.interface, n_h, &self.forces.0, &self.forces.1)
    }

    /// Which expansion answers for so many harmonics: the same whatever was asked before.
    fn level(&self, n_h: usize, omega: f64) -> i32 {
        let highest = n_h.max(1) as f64 * omega / (LOWEST * self.first.omega);
        highest.log(LEVELS).ceil().clamp(0.0, 60.0) as i32
    }

    fn expansion(&self, level: i32) -> Option<Rc<Expansion>> {
        let mut known = self.expansions.borrow_mut();
        known.entry(level).or_insert_with(|| self.expand(level).map(Rc::new)).clone()
    }

    fn expand(&self, level: i32) -> Option<Expansion> {
        let (k, m) = self.pencil.as_ref()?;
        let (support, rows) = &self.directions;
        let (n, r) = (k.n_rows(), rows.ncols());
        let forces: Vec<&Vec<f64>> =
            std::iter::once(&self.forces.0).chain(&self.forces.1).collect();
        if Moments::bytes(n, r + forces.len()) > ROOM {
            return None;
        }
        let mut columns = Mat::zeros(n, r + forces.len());
        for (i, &row) in support.iter().enumerate() {
            (0..r).for_each(|c| columns[(row, c)] = rows[(i, c)]);
        }
        for (c, f) in forces.iter().enumerate() {
            columns.col_as_slice_mut(r + c).copy_from_slice(f);
        }
        let top = (LOWEST * self.first.omega * LEVELS.powi(level)).powi(2);
        // modes that do not converge, a shift that hits one: factorisations know no such trouble
        let moments = Moments::new((k, m), &columns, top, self.first.omega).unwrap_or(None);
        moments.map(|moments| Expansion { among: moments.among(support, rows), moments })
    }

    /// `σ_k` and `1/(1 + ikωβ)`.
    fn shifted(&self, k: usize, omega: f64) -> (c64, c64) {
        let (alpha, beta) = self.interface.damping();
        let kw = k as f64 * omega;
        let factor = c64::new(1.0, kw * beta).inv();
        (c64::new(kw * kw, -kw * alpha) * factor, factor)
    }

    /// How much of the constant force and of each harmonic load there is in a harmonic.
    fn shares(&self, k: usize, n_h: usize) -> Vec<c64> {
        let count = self.forces.1.len() + 1;
        let unit = |at: usize| (0..count).map(|i| f64::from(u8::from(i == at))).collect::<Vec<_>>();
        let units: Vec<Vec<f64>> = (1..count).map(unit).collect();
        let series = load_series(&self.interface, n_h.max(1), &unit(0), &units);
        let (cos, sin) = series.basis.places(k);
        let of = |i: usize| c64::new(series.of(cos)[i], -sin.map_or(0.0, |s| series.of(s)[i]));
        (0..count).map(of).collect()
    }

    /// `G_k` and `c_k` of one harmonic.
    fn answer(&self, k: usize, omega: f64, loads: &Series, level: i32) -> Result<Answer, HbmError> {
        let (sigma, factor) = self.shifted(k, omega);
        match self.expansion(level).filter(|e| e.moments.error(sigma) <= ERROR) {
            Some(expansion) => Ok(self.by_moments(k, (sigma, factor), loads.n_h, expansion)),
            None => self.by_factor(k, omega, loads),
        }
    }

    /// `G_k` and `c_k` by modes and moments.
    fn by_moments(
        &self,
        k: usize,
        (sigma, factor): (c64, c64),
        n_h: usize,
        expansion: Rc<Expansion>,
    ) -> Answer {
        let r = self.directions.1.ncols();
        let all = expansion.moments.between(sigma, &expansion.among);
        let shares = self.shares(k, n_h);
        let of_load = |i: usize| -> c64 {
            let sum: c64 = shares.iter().enumerate().map(|(c, s)| all[(i, r + c)] * s).sum();
            sum * factor
        };
        let part = |of: fn(c64) -> f64| Mat::from_fn(r, r, |i, j| of(all[(i, j)] * factor));
        Answer {
            receptance: [part(|z| z.re), part(|z| z.im)],
            of_loads: (0..r).map(of_load).collect(),
            by: By::Moments(expansion),
        }
    }

    /// `G_k` and `c_k` by a factorisation.
    fn by_factor(&self, k: usize, omega: f64, loads: &Series) -> Result<Answer, HbmError> {
        let (support, rows) = &self.directions;
        let (n, r) = (self.interface.system.n_o(), rows.ncols());
        let (cos, sin) = loads.basis.places(k);
        let mut right = Mat::<c64>::zeros(n, r + 1);
        for (i, &row) in support.iter().enumerate() {
            (0..r).for_each(|c| right[(row, c)] = c64::new(rows[(i, c)], 0.0));
        }
        for i in 0..n {
            right[(i, r)] = c64::new(loads.of(cos)[i], -sin.map_or(0.0, |s| loads.of(s)[i]));
        }
        let x = self.factor(k, omega)?.solve(right.as_ref())?;
        let of = |part: fn(c64) -> f64| {
            let x = Mat::from_fn(support.len(), r + 1, |i, c| part(x[(support[i], c)]));
            rows.transpose() * x
        };
        let (re, im) = (of(|z| z.re), of(|z| z.im));
        let of_loads = (0..r).map(|i| c64::new(re[(i, r)], im[(i, r)])).collect();
        let receptance = [re.subcols(0, r).to_owned(), im.subcols(0, r).to_owned()];
        let fits = (k + 1) * n * (r + 1) * size_of::<c64>() <= ROOM;
        Ok(Answer { receptance, of_loads, by: if fits { By::Columns(x) } else { By::Nothing } })
    }

    /// Size of the terms of the residual: loads, interface terms, stiffness times displacements (of which the projections and the first mode are known).
    fn terms(&self, y: &Series, n: &Series, omega: f64) -> f64 {
        let (rank, functions) = (self.interface.rank(), y.basis.len(y.n_h));
        let of_first: Vec<f64> = (0..functions).map(|i| norm(&y.of(i)[..rank])).collect();
        let loads = self.interface.system.loads.harmonics.iter();
        let of_loads = loads.zip(&self.sizes.1).map(|(load, size)| load.size().abs() * size);
        let forces = of_loads.fold(self.sizes.0, f64::max);
        let mode = self.first_coordinate(n, omega);
        norm(&n.a).max(forces).max(self.stiffness_unit() * norm(&of_first).max(mode))
    }

    /// Size of the first mode's coordinate under the interface terms `n`.
    fn first_coordinate(&self, n: &Series, omega: f64) -> f64 {
        let FirstMode { omega: natural, by_dampers, directions, forces, .. } = &self.first;
        let loads = load_series(&self.interface, n.n_h, &forces.0, &forces.1);
        let (alpha, beta) = self.interface.damping();
        let mut sum = 0.0;
        for k in 0..=n.n_h {
            let kw = k as f64 * omega;
            let (re, im) =
                (natural * natural - kw * kw, kw * (alpha + beta * natural * natural + by_dampers));
            let (cos, sin) = n.basis.places(k);
            for function in [Some(cos), sin].into_iter().flatten() {
                let force = loads.of(function)[0] - dot(directions, n.of(function));
                sum += force * force / (re * re + im * im);
            }
        }
        sum.sqrt()
    }
}

impl Balanced for Dynamic {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn set_frequency(&mut self, omega: f64) {
        self.interface.set_frequency(omega);
    }

    fn components(&self) -> usize {
        self.interface.rank_in()
    }

    fn stiffness_unit(&self) -> f64 {
        self.first.omega.powi(2)
    }

    fn force_unit(&self) -> f64 {
        self.force_unit
    }

    fn mode_start(&self, amplitude: f64) -> Option<Series> {
        let FirstMode { omega, shape, directions, .. } = &self.first;
        let scale = crate::contact::grazing_of(&self.interface.system, shape)?;
        let r = directions.len();
        let mut y = Series::zeros(self.interface.basis, 1, self.components());
        let first = y.of_mut(1);
        first.iter_mut().zip(directions).for_each(|(y, d)| *y = -amplitude * scale * d);
        let (y1, y2) = first.split_at_mut(r);
        y2.iter_mut().zip(y1).for_each(|(y2, y1)| *y2 = omega * omega * *y1);
        Some(y)
    }

    fn solve(
        &self,
        guess: &Series,
        omega: f64,
        settings: &Settings,
    ) -> Result<Result<Solution, GapReason>, HbmError> {
        let receptance = self.receptance(guess.n_h, omega)?;
        let terms = |y: &Series, n: &Series| self.terms(y, n, omega);
        let at = (omega, settings);
        newton::on_terms(&self.interface, &receptance, guess, at, terms, |y, _, _| y.clone())
    }

    fn receptance(&self, n_h: usize, omega: f64) -> Result<Receptance, HbmError> {
        let mut known = self.answers.borrow_mut();
        let level = self.level(n_h, omega);
        if (known.omega, known.level) != (omega, level) {
            *known = Answers { omega, level, of_harmonic: vec![] };
        }
        let loads = self.loads(n_h.max(1));
        for k in known.of_harmonic.len()..=n_h {
            let answer = self.answer(k, omega, &loads, level)?;
            known.of_harmonic.push(answer);
        }
        let basis = self.interface.basis;
        let mut of_loads = Series::zeros(basis, n_h, self.interface.rank());
        for (k, answer) in known.of_harmonic.iter().enumerate().take(n_h + 1) {
            let (cos, sin) = basis.places(k);
            let c = &answer.of_loads;
            of_loads.of_mut(cos).iter_mut().zip(c).for_each(|(x, c)| *x = c.re);
            if let Some(sin) = sin {
                of_loads.of_mut(sin).iter_mut().zip(c).for_each(|(x, c)| *x = -c.im);
            }
        }
        let g = known.of_harmonic.iter().take(n_h + 1).map(|a| a.receptance.clone()).collect();
        Ok(Receptance::new(&self.interface, omega, g, of_loads))
    }

    fn series_of(&self, n: &Series, omega: f64) -> Result<Series, HbmError> {
        Ok(self.receptance(n.n_h, omega)?.answer(Some(n)))
    }

    fn displacements(&self, s: &Solution) -> Result<Series, HbmError> {
        let (support, rows) = &self.directions;
        let size = self.interface.system.n_o();
        let loads = self.loads(s.q.n_h.max(1));
        let mut u = Series::zeros(s.q.basis, s.q.n_h, size);
        let mut put = |k: usize, x: &[c64]| {
            let (cos, sin) = s.q.basis.places(k);
            u.of_mut(cos).iter_mut().zip(x).for_each(|(u, x)| *u = x.re);
            if let Some(sin) = sin {
                u.of_mut(sin).iter_mut().zip(x).for_each(|(u, x)| *u = -x.im);
            }
        };
        // u_k = D_k⁻¹ f_k − D_k⁻¹ M₀L n_k
        let terms = |k: usize| -> Vec<c64> {
            let (cos, sin) = s.q.basis.places(k);
            let of_sin = |c: usize| sin.map_or(0.0, |sin| s.n.of(sin)[c]);
            (0..rows.ncols()).map(|c| c64::new(-s.n.of(cos)[c], of_sin(c))).collect()
        };
        if self.expansion(self.level(s.q.n_h, s.omega)).is_some() {
            self.receptance(s.q.n_h, s.omega)?;
        }
        let mut by_moments: Vec<(usize, Rc<Expansion>)> = vec![];
        let known = self.answers.borrow();
        for k in 0..=s.q.n_h {
            let (cos, sin) = s.q.basis.places(k);
            let kept = known.of_harmonic.get(k).filter(|_| known.omega == s.omega);
            match kept.map(|answer| &answer.by) {
                Some(By::Moments(expansion)) => {
                    by_moments.push((k, expansion.clone()));
                    continue;
                }
                Some(By::Columns(columns)) => {
                    let share: Vec<c64> =
                        terms(k).into_iter().chain([c64::new(1.0, 0.0)]).collect();
                    let x = columns * Mat::from_fn(share.len(), 1, |c, _| share[c]);
                    put(k, x.col_as_slice(0));
                    continue;
                }
                Some(By::Nothing) | None => {}
            }
            let force = |function: usize| {
                let mut f = loads.of(function).to_vec();
                for (i, &row) in support.iter().enumerate() {
                    let n = s.n.of(function).iter().enumerate();
                    f[row] -= n.map(|(c, n)| rows[(i, c)] * n).sum::<f64>();
                }
                f
            };
            let (a, b) = (force(cos), sin.map(force));
            let right =
                Mat::from_fn(size, 1, |i, _| c64::new(a[i], -b.as_ref().map_or(0.0, |b| b[i])));
            let x = self.factor(k, s.omega)?.solve(right.as_ref())?;
            put(k, x.col_as_slice(0));
        }
        // all harmonics of one expansion together
        if let Some((_, expansion)) = by_moments.first() {
            let wanted = |(k, _): &(usize, Rc<Expansion>)| {
                let (sigma, factor) = self.shifted(*k, s.omega);
                let share = terms(*k).into_iter().chain(self.shares(*k, s.q.n_h));
                (sigma, share.map(|z| z * factor).collect())
            };
            let wanted: Vec<(c64, Vec<c64>)> = by_moments.iter().map(wanted).collect();
            let x = expansion.moments.solutions(&wanted);
            by_moments.iter().enumerate().for_each(|(c, (k, _))| put(*k, x.col_as_slice(c)));
        }
        Ok(u)
    }
}
