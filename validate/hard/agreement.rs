//! Two courses of one motion side by side, switch by switch.
//!
//! Each switch of the one takes as its partner the first switch of the other that is still free, of the same node, in the same
//! direction, within 10⁻⁴ of the period: simultaneous switches may so stand in any order, and a repeated one
//! finds no partner. How near the partners are to each other is a second question.

use super::witness::{Change, Course};

/// Partners are sought this far, in periods.
pub const REACH: f64 = 1e-4;
/// This near to a grazing, in periods, nothing is compared: its time is known to half the digits.
const BLUR: f64 = 1e-3;

/// A switch without a partner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alone {
    /// In the first course only.
    Missed,
    /// In the second course only.
    Invented,
}

/// How two courses agree, up to the end of the shorter one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// The earliest switch without a partner, and its time.
    pub alone: Option<(f64, Alone)>,
    /// Largest difference of the times of partners, in periods.
    pub time: f64,
    /// Difference of the final states over the largest of the motion; zero if they end at different times.
    pub state: f64,
}

impl Agreement {
    /// Compare a course with a second one.
    pub fn new(first: &Course, second: &Course, period: f64) -> Agreement {
        // what happens at the very end may have its partner beyond it
        let margin = if first.grazes || second.grazes { BLUR } else { 2.0 * REACH };
        let end = first.end.min(second.end) - margin * period;
        let mut free: Vec<&Change> = second.changes.iter().collect();
        let (mut missed, mut time) = (None, 0.0f64);
        for x in &first.changes {
            let fits = |y: &&Change| {
                (x.contact, x.closes) == (y.contact, y.closes)
                    && (x.t - y.t).abs() <= REACH * period
            };
            if let Some(place) = free.iter().position(fits) {
                time = time.max((x.t - free.remove(place).t).abs() / period);
            } else if x.t < end && missed.is_none() {
                missed = Some(x.t);
            }
        }
        let invented = free.iter().map(|y| y.t).find(|t| *t < end);
        let alone = match (missed, invented) {
            (Some(x), Some(y)) if y < x => Some((y, Alone::Invented)),
            (Some(x), _) => Some((x, Alone::Missed)),
            (None, y) => y.map(|y| (y, Alone::Invented)),
        };
        let distance = |a: &[f64], b: &[f64], size: f64| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
        };
        let mut state = 0.0;
        if first.end == second.end {
            let (u, v) = first.largest;
            state = distance(&first.u, &second.u, u).max(distance(&first.v, &second.v, v));
        }
        Agreement { alone, time, state }
    }

    /// Whether the switches part, or the second course grazes, not later than `t`.
    pub fn parts_by(&self, t: f64, second: &Course) -> bool {
        (second.grazes && second.end <= t) || self.alone.is_some_and(|(at, _)| at <= t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(changes: &[(f64, usize, bool)]) -> Course {
        let change = |&(t, contact, closes): &_| Change { t, contact, closes };
        Course {
            changes: changes.iter().map(change).collect(),
            end: 1.0,
            u: vec![0.5],
            v: vec![0.0],
            largest: (1.0, 1.0),
            grazes: false,
        }
    }

    const WHOLE: [(f64, usize, bool); 4] =
        [(0.2, 0, true), (0.2, 1, true), (0.5, 1, false), (0.7, 0, false)];

    #[test]
    fn simultaneous_switches_may_be_permuted() {
        let mut other = WHOLE;
        other.swap(0, 1);
        let agreement = Agreement::new(&course(&WHOLE), &course(&other), 1.0);
        assert_eq!(agreement, Agreement { alone: None, time: 0.0, state: 0.0 });
    }

    #[test]
    fn what_is_missed_or_invented_is_told_with_its_time() {
        let told = |a: &[_], b: &[_]| Agreement::new(&course(a), &course(b), 1.0).alone;
        for k in 0..WHOLE.len() {
            let mut less = WHOLE.to_vec();
            let gone = less.remove(k);
            assert_eq!(told(&WHOLE, &less), Some((gone.0, Alone::Missed)));
            assert_eq!(told(&less, &WHOLE), Some((gone.0, Alone::Invented)));
            // the same switch twice
            let mut twice = WHOLE.to_vec();
            twice.insert(k, gone);
            assert_eq!(told(&WHOLE, &twice), Some((gone.0, Alone::Invented)));
        }
        let mut other = WHOLE;
        other[2].1 = 0;
        assert!(matches!(told(&WHOLE, &other), Some((0.5, _))));
    }

    #[test]
    fn beyond_a_grazing_nothing_is_compared() {
        let mut grazes = course(&WHOLE[..2]);
        (grazes.grazes, grazes.end) = (true, 0.4);
        assert_eq!(Agreement::new(&grazes, &course(&WHOLE), 1.0).alone, None);
    }

    #[test]
    fn distances_are_measured() {
        let mut other = course(&WHOLE);
        other.changes[3].t += 3e-5;
        other.u[0] += 2e-3;
        let agreement = Agreement::new(&course(&WHOLE), &other, 2.0);
        assert_eq!(agreement.alone, None);
        assert!((agreement.time - 1.5e-5).abs() < 1e-15 && (agreement.state - 2e-3).abs() < 1e-15);
    }
}
