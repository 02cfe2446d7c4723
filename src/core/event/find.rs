//! The first switch in a window: proved, not sampled (theory §12, H5).
//!
//! Each monitor comes as an enclosure between two polynomials in Bernstein form. An interval is *proved* free of a crossing
//! (lower bound positive), or *proved* to hold one (monotone, signs differ), or halved; what stays undecided at the
//! time resolution is a tangency. A crossing is a descent below `−slack`, where `slack` is the rounding error of the
//! monitor: a monitor that has just switched starts at zero and is not mistaken for a second switch.

use crate::flow::{Bernstein, Flow};

/// A switch that the flow runs into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Time.
    pub t: f64,
    /// Index of the monitor in the phase.
    pub index: usize,
    /// The monitor only touches zero, as far as the time resolution can tell.
    pub tangent: bool,
}

/// The earliest crossing in `[a, b]` over all monitors.
pub fn earliest(
    flow: &dyn Flow,
    slack: &[f64],
    (a, b): (f64, f64),
    resolution: f64,
) -> Option<Root> {
    let mut first: Option<Root> = None;
    for (index, &slack) in slack.iter().enumerate() {
        let until = first.map_or(b, |r| r.t);
        let root = first_crossing(flow, index, slack, (a, until), resolution);
        if root.is_some_and(|root| first.is_none_or(|r| root.t < r.t)) {
            first = root;
        }
    }
    first
}

fn first_crossing(
    flow: &dyn Flow,
    index: usize,
    slack: f64,
    (a, b): (f64, f64),
    resolution: f64,
) -> Option<Root> {
    let root = |t, tangent| Some(Root { t, index, tangent });
    let mut pending = vec![(a, b)];
    while let Some((a, b)) = pending.pop() {
        let e = flow.enclose(index, a, b);
        if e.polynomial.min() - e.error + slack > 0.0 {
            continue;
        }
        let c = e.polynomial.coefficients();
        if !(e.polynomial.min() - e.error).is_finite() {
            // nothing can be proved here, and no halving helps
            return root(a, true);
        }
        let (start, end) = (c[0] + slack, c[c.len() - 1] + slack);
        // the values at both ends are the monitor's own
        if start < 0.0 {
            return root(a, false);
        }
        let slope = e.polynomial.derivative();
        if slope.min() - e.slope_error > 0.0 {
            continue;
        }
        if slope.max() + e.slope_error < 0.0 {
            if end >= 0.0 {
                continue;
            }
            // it does fall below −slack: the switch is where it passes zero, if it was above at all
            let slack = if c[0] > 0.0 { 0.0 } else { slack };
            let guess = polynomial_root(&e.polynomial, slack);
            return root(polish(flow, index, slack, (a, b), guess, resolution), false);
        }
        let middle = 0.5 * (a + b);
        if b - a <= resolution || middle <= a || middle >= b {
            return root(middle.clamp(a, b), true);
        }
        pending.push((middle, b));
        pending.push((a, middle));
    }
    None
}

/// Root in `[0, 1]` of a polynomial plus a constant, positive at 0 and negative at 1, by bisection; and its slope there.
fn polynomial_root(p: &Bernstein, slack: f64) -> (f64, f64) {
    let (mut a, mut b) = (0.0f64, 1.0f64);
    while b - a > 4.0 * f64::EPSILON {
        let t = 0.5 * (a + b);
        if p.at(t) + slack > 0.0 { a = t } else { b = t }
    }
    (b, p.derivative().at(b))
}

/// Root of a monotone monitor between two signs, from the root and slope of its interpolant: corrections with that
/// slope, which is right to the accuracy of the interpolant, and bisection where they do not end.
fn polish(
    flow: &dyn Flow,
    index: usize,
    slack: f64,
    (mut a, mut b): (f64, f64),
    (theta, slope): (f64, f64),
    resolution: f64,
) -> f64 {
    let value = |t: f64| flow.enclose(index, t, t).polynomial.coefficients()[0] + slack;
    let rate = slope / (b - a);
    let mut t = a + theta * (b - a);
    for k in 0..100 {
        if b - a <= resolution {
            break;
        }
        let h = value(t);
        if h > 0.0 {
            a = t
        } else {
            b = t
        }
        let next = t - h / rate;
        if k < 8 && next >= a && next <= b {
            if (next - t).abs() <= resolution {
                return next;
            }
            t = next;
        } else {
            t = 0.5 * (a + b);
        }
    }
    b
}

/// What does not change over this share of a window, but for rounding, rests there.
const REST: f64 = 1.0 / 64.0;

/// Pieces of a window after which a search goes no deeper than it can tell: motions hardly above rounding have minima as flat as they are many. A minimum that stands out takes fifty.
const PIECES: usize = 256;

/// A part of the level that makes no difference to a near miss.
const SLIGHT: f64 = 0.01;

/// The least interior minimum of a monitor in the window that lies below `level`, if any: a near miss.
pub(crate) fn near_miss(
    flow: &dyn Flow,
    index: usize,
    level: f64,
    (a, b): (f64, f64),
    resolution: f64,
) -> Option<(f64, f64)> {
    let mut least: Option<(f64, f64)> = None;
    let (mut pending, wide) = (vec![(a, b)], REST * (b - a));
    let mut pieces = 0;
    while let Some((a, b)) = pending.pop() {
        pieces += 1;
        let e = flow.enclose(index, a, b);
        // a monitor at rest, to rounding: it misses nothing, and has no least value to look for
        let spread = e.polynomial.max() - e.polynomial.min();
        let same = spread <= (2.0 * e.error).max(SLIGHT * level);
        if b - a >= wide && same {
            continue;
        }
        // what is no number is near nothing; the search for switches says so
        if e.polynomial.min().is_nan() {
            return None;
        }
        let bound = least.map_or(level, |(_, h)| h.min(level));
        let slope = e.polynomial.derivative();
        let monotone = slope.min() > e.slope_error || slope.max() < -e.slope_error;
        if e.polynomial.min() - e.error >= bound || monotone {
            continue;
        }
        let middle = 0.5 * (a + b);
        if pieces > PIECES && same || b - a <= resolution || middle <= a || middle >= b {
            let h = e.polynomial.at(0.5);
            if h < bound {
                least = Some((middle, h));
            }
            continue;
        }
        pending.push((middle, b));
        pending.push((a, middle));
    }
    // an end of the window is no interior minimum
    least.filter(|&(t, _)| t - a > 2.0 * resolution && b - t > 2.0 * resolution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Phase;
    use crate::flow::{Counters, Enclosure, FlowError};

    /// Monitors given as polynomials on [0, 1], with errors of values and slopes.
    struct Given(Vec<Bernstein>, [f64; 2]);

    impl Flow for Given {
        fn begin(&mut self, _: &Phase, _: f64, _: &[f64]) {}
        fn advance(&mut self, _: &Phase, _: f64) -> Result<(), FlowError> {
            Ok(())
        }
        fn cut(&mut self, _: &Phase, _: f64) {}
        fn window(&self) -> (f64, f64) {
            (0.0, 1.0)
        }
        fn end_state(&mut self) -> &[f64] {
            &[]
        }
        fn state(&self, _: f64, _: &mut [f64]) {}
        fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
            let polynomial = self.0[index].restrict(a, b);
            let [error, slope_error] = self.1;
            Enclosure { polynomial, error, slope_error }
        }
        fn counters(&self) -> Counters {
            Counters::default()
        }
        fn name(&self) -> &'static str {
            "given"
        }
    }

    /// A monitor at rest near its obstacle ends the search: bodies that touch while nothing moves them.
    #[test]
    fn what_rests_is_no_near_miss() {
        let still = Given(vec![Bernstein::new(&[1e-16, -1e-16, 1e-16])], [1e-15, 1e-12]);
        assert_eq!(near_miss(&still, 0, 1e-9, (0.0, 1.0), 1e-14), None);
    }

    /// A minimum that stands out of a window, and is flat to rounding over a thousandth of it: as many pieces as there are instants would be looked through.
    #[test]
    fn what_is_flat_to_rounding_ends_the_search() {
        let flat =
            parabola(0.5, 0.5, 0.0).coefficients().iter().map(|c| 1e-9 * c).collect::<Vec<_>>();
        let slow = Given(vec![Bernstein::new(&flat)], [1e-15, 1e-12]);
        let (t, h) = near_miss(&slow, 0, 1e-12, (0.0, 1.0), 1e-14).unwrap();
        assert!((t - 0.5).abs() < 3e-3 && h.abs() < 1e-14, "{t} {h}");
    }

    /// `(t − r₁)(t − r₂) + shift` as Bernstein coefficients of degree 2.
    fn parabola(r1: f64, r2: f64, shift: f64) -> Bernstein {
        let (c, b) = (r1 * r2 + shift, -(r1 + r2));
        Bernstein::new(&[c, c + 0.5 * b, c + b + 1.0])
    }

    const RESOLUTION: f64 = 1e-15;

    #[test]
    fn two_roots_in_one_step_are_not_missed() {
        // both ends positive: a test of signs at the ends sees nothing
        let flow = Given(vec![parabola(0.4, 0.400001, 0.0)], [0.0; 2]);
        let root = earliest(&flow, &[1e-16], (0.0, 1.0), RESOLUTION).unwrap();
        assert!((root.t - 0.4).abs() < 1e-9 && !root.tangent, "{root:?}");
    }

    #[test]
    fn the_earliest_of_several_monitors_is_found() {
        let flow = Given(
            vec![parabola(0.7, 2.0, 0.0), parabola(0.3, 1.5, 0.0), parabola(-1.0, -2.0, 0.0)],
            [0.0; 2],
        );
        let root = earliest(&flow, &[1e-16; 3], (0.0, 1.0), RESOLUTION).unwrap();
        assert_eq!(root.index, 1);
        assert!((root.t - 0.3).abs() < 1e-14);
    }

    #[test]
    fn a_monitor_that_starts_at_zero_and_rises_has_no_root() {
        let flow = Given(vec![parabola(0.0, -1.0, 0.0)], [0.0; 2]);
        assert_eq!(earliest(&flow, &[1e-15], (0.0, 1.0), RESOLUTION), None);
        let back = Given(vec![Bernstein::new(&[0.0, 0.5, -1.0])], [0.0; 2]);
        assert!((earliest(&back, &[1e-15], (0.0, 1.0), RESOLUTION).unwrap().t - 0.5).abs() < 1e-13);
    }

    #[test]
    fn what_is_no_number_is_not_free_of_roots() {
        let flow =
            Given(vec![Bernstein::new(&[1.0, f64::NAN, 1.0]), parabola(-1.0, -2.0, 0.0)], [0.0; 2]);
        let root = earliest(&flow, &[1e-16; 2], (0.0, 1.0), RESOLUTION).unwrap();
        assert!(root.index == 0 && root.tangent);
        assert_eq!(near_miss(&flow, 0, 1e-9, (0.0, 1.0), 1e-9), None);
    }

    #[test]
    fn a_touch_is_a_near_miss_and_no_switch() {
        let flow = Given(vec![parabola(0.5, 0.5, 1e-12)], [0.0; 2]);
        assert_eq!(earliest(&flow, &[1e-16], (0.0, 1.0), RESOLUTION), None);
        let (t, h) = near_miss(&flow, 0, 1e-9, (0.0, 1.0), 1e-9).unwrap();
        assert!((t - 0.5).abs() < 1e-8 && (h - 1e-12).abs() < 1e-15);
        assert_eq!(near_miss(&flow, 0, 1e-13, (0.0, 1.0), 1e-9), None);
    }
}
