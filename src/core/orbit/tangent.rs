//! Tangents of the motion through a chain: propagators of the phases, saltation or free switching times (theory §8).

use faer::{Mat, MatRef};

use super::chain::{Chain, Propagator};
use super::parameter::Parameter;
use super::saltation;
use super::walk::Walk;
use crate::fem::FemError;
use crate::flow::oscillator::Oscillator;

/// How a tangent passes a switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switches {
    /// The switch follows the state.
    Saltation,
    /// Switching times are variables of their own.
    Free,
}

/// What a tangent is taken by, beside the state.
#[derive(Debug, Clone, Copy)]
pub enum By<'a> {
    /// `α` of a body that is fed by `−αM u̇`.
    Feedback,
    /// `ω` of all harmonic loads.
    Frequency,
    /// A number that the equations depend on, times held.
    Parameter(&'a Parameter),
}

/// What is varied, and how.
#[derive(Debug, Clone, Copy)]
pub struct Variation<'a> {
    /// How tangents pass switches.
    pub switches: Switches,
    /// One more column is the derivative by this.
    pub by: Option<By<'a>>,
    /// `α` of a feedback that is a prescribed load to the tangent: the variation of the body that does without it.
    pub released: f64,
    /// Of the end only velocities are wanted: its displacements are zero.
    pub to_velocities: bool,
}

impl Variation<'_> {
    /// The derivative of the event-driven map.
    pub(crate) const OF_MAP: Variation<'static> =
        Variation { switches: Switches::Saltation, by: None, released: 0.0, to_velocities: false };
    /// With switching times as variables of their own.
    pub const FREE: Variation<'static> =
        Variation { switches: Switches::Free, ..Variation::OF_MAP };
}

/// Columns at the end of a chain, and the rows of the switch equations.
#[derive(Debug)]
pub struct Tangent {
    /// `2n × k`, frame vectors.
    pub end: Mat<f64>,
    /// `m × k`.
    pub equations: Mat<f64>,
    /// `m × k`: by how much each switch is later, with `Switches::Saltation`.
    pub delays: Mat<f64>,
}

/// A perturbation that is smaller than this when the first switch comes, over what it was, is none.
const DIES: f64 = 1e-10;

impl Propagator {
    /// The derivative along a walk by each of the first `columns` entries of the frame vector, with what [`Self::tangent`] adds at the right.
    ///
    /// Perturbations by modes that damping takes away before the first switch are not carried: their columns are zero to rounding. Of a fine mesh
    /// these are most.
    pub fn derivative(
        &self,
        (chain, walk): (&Chain, &Walk),
        columns: usize,
        variation: Variation<'_>,
    ) -> Result<Tangent, FemError> {
        let n = self.n();
        let first = walk.links[0].span.1;
        let begins_open = chain.sets[0] == self.home_set && self.home.is_decoupled();
        let survives = |i: usize| {
            let m = self.home.modes[i];
            let m = Oscillator { c: m.c + 0.5 * variation.released, ..m };
            let x = m.basis(first);
            let sizes = [x.c, x.ds, m.omega * x.s, self.scale[i] * x.s];
            sizes.iter().any(|s| s.abs() > DIES)
        };
        let modes: Vec<usize> = (0..n).filter(|&i| !begins_open || survives(i)).collect();
        let velocities = modes.iter().map(|i| n + i);
        let kept: Vec<usize> =
            modes.iter().copied().chain(velocities).filter(|i| *i < columns).collect();
        let start = Mat::from_fn(columns, kept.len(), |i, c| f64::from(u8::from(i == kept[c])));
        let carried = self.tangent((chain, walk), start.as_ref(), variation)?;
        let added = carried.end.ncols() - kept.len();
        let places: Vec<usize> = kept.into_iter().chain(columns..columns + added).collect();
        let spread = |narrow: &Mat<f64>| {
            let mut all = Mat::zeros(narrow.nrows(), columns + added);
            for (c, &place) in places.iter().enumerate() {
                all.col_as_slice_mut(place).copy_from_slice(narrow.col_as_slice(c));
            }
            all
        };
        Ok(Tangent {
            end: spread(&carried.end),
            equations: spread(&carried.equations),
            delays: spread(&carried.delays),
        })
    }

    /// Carry columns along a walk: frame vectors, `2n` rows, or `n` for displacements only.
    ///
    /// With `Switches::Saltation` the result is the derivative of the event-driven map. With `Switches::Free` one column a
    /// switching time is added at the right, with a parameter one more behind all others.
    pub fn tangent(
        &self,
        (chain, walk): (&Chain, &Walk),
        start: MatRef<f64>,
        variation: Variation<'_>,
    ) -> Result<Tangent, FemError> {
        self.count(|spent| spent.derivatives += 1);
        let Variation { switches, by, released, to_velocities } = variation;
        let (n, given, m) = (self.n(), start.ncols(), chain.events());
        let free = switches == Switches::Free;
        let k = given + if free { m } else { 0 } + usize::from(by.is_some());
        // [Q | V] in the modes of the present phase
        let mut b = Mat::<f64>::zeros(n, 2 * k);
        for c in 0..given {
            for i in 0..n {
                b[(i, c)] = start[(i, c)] / self.scale[i];
                if start.nrows() > n {
                    b[(i, k + c)] = start[(n + i, c)];
                }
            }
        }
        let mut equations = Mat::<f64>::zeros(if free { m } else { 0 }, k);
        let mut delays = Mat::<f64>::zeros(if free { 0 } else { m }, k);
        let mut place = &self.home_set;
        for (j, set) in chain.sets.iter().enumerate() {
            if let Some(passed) = self.passed(place, set, b.as_ref())? {
                b = passed;
            }
            place = set;
            if j > 0 && free {
                let column = k + given + j - 1;
                for (i, &jump) in walk.events[j - 1].jump.iter().enumerate() {
                    b[(i, column)] += jump;
                }
            }
            let link = &walk.links[j];
            link.hold(&mut b, k);
            let event = walk.events.get(j);
            if let Some(e) = event.filter(|e| free && e.from_start) {
                e.row(&mut equations, j, &b, k);
            }
            if let Some(By::Parameter(p)) = by {
                link.count_from_holds(p, set, &mut b, k, -1.0);
            }
            link.carry(&mut b, k, released)?;
            match by {
                Some(By::Feedback) => link.feed(&mut b, k, k - 1),
                Some(By::Frequency) => link.retune(&self.system.loads, &mut b, k, k - 1),
                Some(By::Parameter(p)) => {
                    link.vary(p, set, &mut b, k)?;
                    link.count_from_holds(p, set, &mut b, k, 1.0);
                }
                None => {}
            }
            let Some(e) = event else { continue };
            if free {
                if !e.from_start {
                    e.row(&mut equations, j, &b, k);
                }
                equations[(j, given + j)] += e.by_time;
                if j > 0 {
                    equations[(j, given + j - 1)] += e.by_last_time;
                }
            } else {
                let mut slopes = link.slopes(e.monitor, &b, k);
                match by {
                    Some(By::Frequency) => slopes[k - 1] += link.monitor_by_frequency(e.monitor),
                    Some(By::Parameter(p)) => {
                        slopes[k - 1] += link.monitor_by(p, set, e.monitor);
                    }
                    _ => {}
                }
                let next = &chain.sets[j + 1];
                if let Some(passed) = self.passed(place, next, b.as_ref())? {
                    b = passed;
                }
                walk.links[j + 1].remember(&self.system, place, &mut b, k);
                walk.links[j + 1].anchor(link, &mut b, k);
                if let Some(blow) = &e.blow {
                    let after = blow.act(b.subcols(k, k));
                    b.subcols_mut(k, k).copy_from(&after);
                }
                if let Some(By::Parameter(p)) = by {
                    let struck = chain.struck.get(j).map_or(&[][..], Vec::as_slice);
                    link.pass_on(p, (place, struck), &walk.links[j + 1], &self.system, &mut b, k);
                }
                place = next;
                for (c, &slope) in slopes.iter().enumerate() {
                    delays[(j, c)] = -slope / e.rate;
                    saltation::pass(&e.jump, e.rate, slope, b.col_as_slice_mut(k + c));
                    if !e.slowed.is_empty() {
                        saltation::pass(&e.slowed, e.rate, slope, b.col_as_slice_mut(c));
                    }
                }
            }
        }
        if let Some(link) = walk.links.last() {
            link.anchor(link, &mut b, k);
        }
        let wanted = if to_velocities { b.subcols(k, k) } else { b.as_ref() };
        if let Some(passed) = self.passed(place, &self.home_set, wanted)? {
            b = passed;
        } else if to_velocities {
            b = wanted.to_owned();
        }
        let velocities = b.ncols() - k;
        let end = Mat::from_fn(2 * n, k, |i, c| match i < n {
            true if to_velocities => 0.0,
            true => self.scale[i] * b[(i, c)],
            false => b[(i - n, velocities + c)],
        });
        Ok(Tangent { end, equations, delays })
    }
}
