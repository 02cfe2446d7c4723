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

/// The earliest crossing in `[a, b]` over all monitors. Where there is none, each of `least` lies below all values of its monitor but those of pieces that were
/// proved monotone.
pub fn earliest(
    flow: &dyn Flow,
    slack: &[f64],
    (a, b): (f64, f64),
    resolution: f64,
    least: &mut [f64],
) -> Option<Root> {
    let mut first: Option<Root> = None;
    for (index, (&slack, least)) in slack.iter().zip(least).enumerate() {
        let until = first.map_or(b, |r| r.t);
        let root = first_crossing(flow, index, slack, (a, until), resolution, least);
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
    least: &mut f64,
) -> Option<Root> {
    *least = f64::INFINITY;
    let root = |t, tangent| Some(Root { t, index, tangent });
    let mut pending = vec![(a, b)];
    while let Some((a, b)) = pending.pop() {
        let e = flow.enclose(index, a, b);
        let bound = e.polynomial.min() - e.error;
        if bound + slack > 0.0 {
            *least = least.min(bound);
            continue;
        }
        let c = e.polynomial.coefficients();
        if !bound.is_finite() {
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
        // a monitor at rest, to rounding: it misses nothing, and has no least value to look for; of what is known to more than the level that cannot be said
        let spread = e.polynomial.max() - e.polynomial.min();
        let same = spread <= (2.0 * e.error).max(SLIGHT * level);
        if b - a >= wide && same && e.error <= level {
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

    /// A flow of which monitors alone are known, by their enclosures.
    struct Given<F>(F);

    impl<F: Fn(usize, f64, f64) -> Enclosure> Flow for Given<F> {
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
            self.0(index, a, b)
        }
        fn counters(&self) -> Counters {
            Counters::default()
        }
        fn name(&self) -> &'static str {
            "given"
        }
    }

    /// Polynomials on [0, 1], with errors of values and slopes.
    fn given(
        monitors: Vec<Bernstein>,
        [error, slope_error]: [f64; 2],
    ) -> Given<impl Fn(usize, f64, f64) -> Enclosure> {
        Given(move |index: usize, a: f64, b: f64| {
            let polynomial = monitors[index].restrict(a, b);
            Enclosure { polynomial, error, slope_error }
        })
    }

    /// A monitor at rest near its obstacle ends the search: bodies that touch while nothing moves them.
    #[test]
    fn what_rests_is_no_near_miss() {
        let still = given(vec![Bernstein::new(&[1e-16, -1e-16, 1e-16])], [1e-15, 1e-12]);
        assert_eq!(near_miss(&still, 0, 1e-9, (0.0, 1.0), 1e-14), None);
    }

    /// A minimum that stands out of a window, and is flat to rounding over a thousandth of it: as many pieces as there are instants would be looked through.
    #[test]
    fn what_is_flat_to_rounding_ends_the_search() {
        let flat =
            parabola(0.5, 0.5, 0.0).coefficients().iter().map(|c| 1e-9 * c).collect::<Vec<_>>();
        let slow = given(vec![Bernstein::new(&flat)], [1e-15, 1e-12]);
        let (t, h) = near_miss(&slow, 0, 1e-12, (0.0, 1.0), 1e-14).unwrap();
        assert!((t - 0.5).abs() < 3e-3 && h.abs() < 1e-14, "{t} {h}");
    }

    /// `(t − r₁)(t − r₂) + shift` as Bernstein coefficients of degree 2.
    fn parabola(r1: f64, r2: f64, shift: f64) -> Bernstein {
        let (c, b) = (r1 * r2 + shift, -(r1 + r2));
        Bernstein::new(&[c, c + 0.5 * b, c + b + 1.0])
    }

    const RESOLUTION: f64 = 1e-15;

    fn first(flow: &dyn Flow, slack: &[f64], window: (f64, f64), resolution: f64) -> Option<Root> {
        earliest(flow, slack, window, resolution, &mut vec![0.0; slack.len()])
    }

    /// Sums of sines and a constant, enclosed by cubic interpolants with their proved errors, and how often that was asked for.
    struct Waves(Vec<(f64, Vec<[f64; 3]>)>, std::cell::Cell<usize>);

    impl Waves {
        fn value(&self, index: usize, t: f64) -> f64 {
            let (c, waves) = &self.0[index];
            c + waves.iter().map(|[a, w, p]| a * (w * t + p).sin()).sum::<f64>()
        }

        fn rate(&self, index: usize, t: f64) -> f64 {
            self.0[index].1.iter().map(|[a, w, p]| a * w * (w * t + p).cos()).sum()
        }

        fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
            self.1.set(self.1.get() + 1);
            let at = |t: f64| (self.value(index, t), self.rate(index, t));
            let fourth = self.0[index].1.iter().map(|[a, w, _]| a.abs() * w.powi(4)).sum();
            Enclosure::hermite(at(a), at(b), b - a, fourth)
        }

        fn flow(&self) -> Given<impl Fn(usize, f64, f64) -> Enclosure> {
            Given(|index: usize, a: f64, b: f64| self.enclose(index, a, b))
        }
    }

    fn waves(case: usize) -> Waves {
        let random = |k: usize| {
            let x = (12.9898 * (case * 31 + k) as f64).sin() * 43758.5453;
            2.0 * (x - x.floor()) - 1.0
        };
        let wave =
            |k: usize| [random(3 * k), 4.0 + 3.5 * random(3 * k + 1), 3.0 * random(3 * k + 2)];
        let monitor =
            |m: usize| (0.9 + 0.6 * random(90 + m), (0..4).map(|k| wave(7 * m + k)).collect());
        Waves((0..2).map(monitor).collect(), 0.into())
    }

    /// The first instant below zero of all monitors, by looking at twenty thousand of them; none where one comes so near to zero that these cannot tell.
    fn first_below(flow: &Waves, (a, b): (f64, f64)) -> Option<Option<(usize, f64)>> {
        const INSTANTS: usize = 20_000;
        let at = |k: usize| a + (b - a) * k as f64 / INSTANTS as f64;
        for k in 0..=INSTANTS {
            for index in 0..flow.0.len() {
                let h = flow.value(index, at(k));
                if h < 0.0 && k == 0 {
                    return Some(Some((index, a)));
                }
                if h < 0.0 {
                    let (mut above, mut below) = (at(k - 1), at(k));
                    for _ in 0..60 {
                        let t = 0.5 * (above + below);
                        if flow.value(index, t) > 0.0 { above = t } else { below = t }
                    }
                    return Some(Some((index, below)));
                }
                if h < 1e-6 {
                    return None;
                }
            }
        }
        Some(None)
    }

    #[test]
    fn crossings_of_waves_are_those_of_a_dense_walk() {
        let (mut found, mut none) = (0, 0);
        for case in 0..300 {
            let flow = waves(case);
            let window = (0.3, 0.8 + 0.01 * (case % 70) as f64);
            let Some(expected) = first_below(&flow, window) else { continue };
            let root = first(&flow.flow(), &[1e-15; 2], window, RESOLUTION);
            match (root, expected) {
                (Some(root), Some((index, t))) => {
                    assert_eq!(root.index, index, "case {case}");
                    assert!((root.t - t).abs() < 1e-11 && !root.tangent, "{case}: {root:?} {t}");
                    found += 1;
                }
                (None, None) => none += 1,
                other => panic!("case {case}: {other:?}"),
            }
        }
        assert!(found > 100 && none > 50, "{found} {none}");
    }

    /// The least minimum inside of a window where it lies below the level, and none that is an end. Windows are short, as those of flows: what an enclosure cannot tell from a monitor
    /// at rest is not looked into.
    #[test]
    fn near_misses_of_waves_are_those_of_a_dense_walk() {
        let (mut found, mut none, level) = (0, 0, 1e-5);
        for case in 0..600 {
            let mut flow = waves(case);
            let (a, b) = (0.3, 0.4 + 0.001 * (case % 70) as f64);
            let at = |k: usize| a + (b - a) * k as f64 / 4000.0;
            let h: Vec<f64> = (0..=4000).map(|k| flow.value(0, at(k))).collect();
            let inner = (1..4000).filter(|&k| h[k] <= h[k - 1] && h[k] < h[k + 1]);
            let Some(k) = inner.min_by(|&i, &j| h[i].total_cmp(&h[j])) else {
                assert_eq!(near_miss(&flow.flow(), 0, 9.0, (a, b), 1e-9), None, "case {case}");
                none += 1;
                continue;
            };
            let whole = flow.enclose(0, a, b);
            if whole.polynomial.max() - whole.polynomial.min() < 4.0 * whole.error {
                continue;
            }
            for (height, is_near) in [(1e-6, true), (2e-5, false)] {
                flow.0[0].0 += height - flow.value(0, at(k));
                let miss = near_miss(&flow.flow(), 0, level, (a, b), 1e-9);
                let Some((t, value)) = miss.filter(|_| is_near) else {
                    assert!(!is_near && miss.is_none(), "case {case}: {miss:?}");
                    continue;
                };
                let near = (t - at(k)).abs() <= 1.01 * (b - a) / 4000.0;
                assert!(near && (value - height).abs() < 1e-6, "case {case}: {t} {value}");
                assert!((value - flow.value(0, t)).abs() < 1e-12, "case {case}");
                found += 1;
            }
        }
        assert!(found > 20 && none > 100, "{found} {none}");
    }

    /// A monitor is below zero where it falls below the rounding error of its values, and its switch is where it passes zero, if it was above.
    #[test]
    fn slack_is_no_crossing_and_moves_none_that_was_above() {
        let one = |c: &[f64]| given(vec![Bernstein::new(c)], [0.0; 2]);
        let slack = 2f64.powi(-10);
        let found = |c: &[f64]| first(&one(c), &[slack], (0.0, 1.0), RESOLUTION);
        // ends within it, begins within it and rises, begins at its end and rises
        assert_eq!(found(&[1.0, 0.5, -0.5 * slack]), None);
        assert_eq!(found(&[1.0, 0.5, -slack]), None);
        assert_eq!(found(&[-0.5 * slack, 0.5, 1.0]), None);
        assert_eq!(found(&[-slack, 0.5, 1.0]), None);
        // below it from the beginning
        let root = found(&[-2.0 * slack, 0.5, 1.0]).unwrap();
        assert!(root.t == 0.0 && !root.tangent);
        // falls from above, and from zero
        let root = found(&[0.5, 0.0, -0.5]).unwrap();
        assert!((root.t - 0.5).abs() < 1e-14 && !root.tangent, "{root:?}");
        let root = found(&[0.0, -0.25, -1.0]).unwrap();
        // −t/2 − t²/2 = −slack
        let exact = -0.5 + (0.25 + 2.0 * slack).sqrt();
        assert!((root.t - exact).abs() < 1e-14, "{root:?} {exact}");
    }

    /// What stays undecided at the resolution is a tangency there.
    #[test]
    fn a_touch_is_told_to_the_resolution() {
        let flow = given(vec![parabola(0.5, 0.5, 0.0)], [0.0; 2]);
        let root = first(&flow, &[0.0], (0.0, 1.0), 0.1).unwrap();
        assert!(root.t == 0.46875 && root.tangent, "{root:?}");
        let off = given(vec![parabola(0.3, 0.3, 0.0)], [0.0; 2]);
        let root = first(&off, &[0.0], (0.0, 1.0), 0.0).unwrap();
        assert!((root.t - 0.3).abs() < 1e-7, "{root:?}");
    }

    /// A root of a smooth monitor takes no bisection.
    #[test]
    fn a_root_costs_a_few_values() {
        let flow = Waves(vec![(0.2, vec![[1.0, 1.1, 1.6]])], 0.into());
        let root = first(&flow.flow(), &[1e-16], (1.2, 1.9), RESOLUTION).unwrap();
        let exact = (std::f64::consts::PI + 0.2f64.asin() - 1.6) / 1.1;
        assert!((root.t - exact).abs() < 4e-16, "{} {exact}", root.t);
        assert!(flow.1.get() < 16, "{}", flow.1.get());
    }

    #[test]
    fn two_roots_in_one_step_are_not_missed() {
        // both ends positive: a test of signs at the ends sees nothing
        let flow = given(vec![parabola(0.4, 0.400001, 0.0)], [0.0; 2]);
        let root = first(&flow, &[1e-16], (0.0, 1.0), RESOLUTION).unwrap();
        assert!((root.t - 0.4).abs() < 1e-9 && !root.tangent, "{root:?}");
    }

    #[test]
    fn the_earliest_of_several_monitors_is_found() {
        let flow = given(
            vec![parabola(0.7, 2.0, 0.0), parabola(0.3, 1.5, 0.0), parabola(-1.0, -2.0, 0.0)],
            [0.0; 2],
        );
        let root = first(&flow, &[1e-16; 3], (0.0, 1.0), RESOLUTION).unwrap();
        assert_eq!(root.index, 1);
        assert!((root.t - 0.3).abs() < 1e-14);
    }

    #[test]
    fn a_monitor_that_starts_at_zero_and_rises_has_no_root() {
        let flow = given(vec![parabola(0.0, -1.0, 0.0)], [0.0; 2]);
        assert_eq!(first(&flow, &[1e-15], (0.0, 1.0), RESOLUTION), None);
        let back = given(vec![Bernstein::new(&[0.0, 0.5, -1.0])], [0.0; 2]);
        assert!((first(&back, &[1e-15], (0.0, 1.0), RESOLUTION).unwrap().t - 0.5).abs() < 1e-13);
    }

    #[test]
    fn what_is_no_number_is_not_free_of_roots() {
        let flow =
            given(vec![Bernstein::new(&[1.0, f64::NAN, 1.0]), parabola(-1.0, -2.0, 0.0)], [0.0; 2]);
        let root = first(&flow, &[1e-16; 2], (0.0, 1.0), RESOLUTION).unwrap();
        assert!(root.index == 0 && root.tangent);
        assert_eq!(near_miss(&flow, 0, 1e-9, (0.0, 1.0), 1e-9), None);
    }

    #[test]
    fn a_touch_is_a_near_miss_and_no_switch() {
        let flow = given(vec![parabola(0.5, 0.5, 1e-12)], [0.0; 2]);
        assert_eq!(first(&flow, &[1e-16], (0.0, 1.0), RESOLUTION), None);
        let (t, h) = near_miss(&flow, 0, 1e-9, (0.0, 1.0), 1e-9).unwrap();
        assert!((t - 0.5).abs() < 1e-8 && (h - 1e-12).abs() < 1e-15);
        assert_eq!(near_miss(&flow, 0, 1e-13, (0.0, 1.0), 1e-9), None);
    }
}
