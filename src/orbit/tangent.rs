//! Tangents of the motion through a chain: propagators of the phases, saltation or free switching times (theory §8).

use faer::{Mat, MatRef};

use super::chain::{Chain, Propagator, product};
use super::saltation;
use super::walk::{Walk, dot};
use crate::fem::FemError;

/// How a tangent passes a switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switches {
    /// The switch follows the state.
    Saltation,
    /// Switching times are variables of their own.
    Free,
}

/// What is varied, and how.
#[derive(Debug, Clone, Copy)]
pub struct Variation<'a> {
    /// Columns at the start: frame vectors, `2n` rows, or `n` for displacements only.
    pub start: MatRef<'a, f64>,
    /// How tangents pass switches.
    pub switches: Switches,
    /// Whether one more column is the derivative by `α` of a body that is fed by `−αM u̇`.
    pub by_feedback: bool,
    /// `α` of a feedback that is a prescribed load to the tangent: the variation of the body that does without it.
    pub released: f64,
}

impl<'a> Variation<'a> {
    /// The derivative of the event-driven map.
    pub fn of_map(start: MatRef<'a, f64>) -> Self {
        let switches = Switches::Saltation;
        Variation { start, switches, by_feedback: false, released: 0.0 }
    }

    /// With switching times as variables of their own.
    pub fn free(start: MatRef<'a, f64>) -> Self {
        Variation { switches: Switches::Free, ..Variation::of_map(start) }
    }
}

/// Columns at the end of a chain, and the rows of the switch equations.
#[derive(Debug)]
pub struct Tangent {
    /// `2n × k`, frame vectors.
    pub end: Mat<f64>,
    /// `m × k`.
    pub equations: Mat<f64>,
}

impl Propagator {
    /// Carry columns along a walk.
    ///
    /// With `Switches::Saltation` the result is the derivative of the event-driven map. With `Switches::Free` one column a
    /// switching time is added at the right, with `by_feedback` one more behind all others.
    pub fn tangent(
        &self,
        chain: &Chain,
        walk: &Walk,
        variation: &Variation,
    ) -> Result<Tangent, FemError> {
        let Variation { start, switches, by_feedback, released } = *variation;
        let (n, given, m) = (self.n(), start.ncols(), chain.events());
        let free = switches == Switches::Free;
        let k = given + if free { m } else { 0 } + usize::from(by_feedback);
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
        let mut place = &self.open_set;
        for (j, set) in chain.sets.iter().enumerate() {
            if let Some(t) = self.transform(place, set)? {
                b = product(t.as_ref().as_ref(), b.as_ref());
            }
            place = set;
            if j > 0 && free {
                let column = k + given + j - 1;
                for (i, &jump) in walk.events[j - 1].jump.iter().enumerate() {
                    b[(i, column)] += jump;
                }
            }
            let link = &walk.links[j];
            let event = walk.events.get(j);
            if let Some(e) = event.filter(|e| free && e.from_start) {
                e.row(&mut equations, j, &b, k);
            }
            link.carry(&mut b, k, released);
            if by_feedback {
                link.feed(&mut b, k, k - 1);
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
                let gradient = link.row(chain.nodes[j]);
                let slopes: Vec<f64> = (0..k).map(|c| dot(&gradient, b.col_as_slice(c))).collect();
                let next = &chain.sets[j + 1];
                if let Some(t) = self.transform(place, next)? {
                    b = product(t.as_ref().as_ref(), b.as_ref());
                }
                place = next;
                for (c, &slope) in slopes.iter().enumerate() {
                    saltation::pass(&e.jump, e.rate, slope, b.col_as_slice_mut(k + c));
                }
            }
        }
        if let Some(t) = self.transform(place, &self.open_set)? {
            b = product(t.as_ref().as_ref(), b.as_ref());
        }
        let end = Mat::from_fn(2 * n, k, |i, c| {
            if i < n { self.scale[i] * b[(i, c)] } else { b[(i - n, k + c)] }
        });
        Ok(Tangent { end, equations })
    }
}
