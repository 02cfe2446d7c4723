//! Continuation on curves that are known: circle, pitchfork, two folds in a step, signatures that change where they are told to.

use std::convert::Infallible;

use faer::Mat;

use super::{Family, Go, Options, Place, Special, Stop, Units, follow};

/// `R(x, λ) = 0` with one unknown, its derivatives, and a signature, all in units `(x, λ)` of their own.
struct Curve {
    residual: fn(f64, f64) -> f64,
    derivative: fn(f64, f64) -> [f64; 2],
    signature: fn(f64, f64) -> Vec<i64>,
    units: (f64, f64),
}

const QUIET: fn(f64, f64) -> Vec<i64> = |_, _| vec![0, 0, 0];

impl Curve {
    fn new(residual: fn(f64, f64) -> f64, derivative: fn(f64, f64) -> [f64; 2]) -> Curve {
        Curve { residual, derivative, signature: QUIET, units: (1.0, 1.0) }
    }

    fn numbers(&self, x: &[f64]) -> (f64, f64) {
        (x[0] / self.units.0, x[1] / self.units.1)
    }
}

impl Family for Curve {
    type Chart = ();
    type Border = Infallible;
    type Error = Infallible;

    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), Infallible> {
        let (y, lambda) = self.numbers(x);
        let d = (self.derivative)(y, lambda);
        let units = [self.units.0, self.units.1];
        Ok((vec![(self.residual)(y, lambda)], Mat::from_fn(1, 2, |_, j| d[j] / units[j])))
    }

    fn units(&self) -> Units {
        Units { unknowns: vec![self.units.0, self.units.1], residual: 1.0 }
    }

    fn rounding(&self, _: &[f64]) -> f64 {
        1e-14
    }

    fn weights(&self, _: &[f64]) -> Vec<f64> {
        vec![self.units.0.powi(-2), self.units.1.powi(-2)]
    }

    fn chart(&self) {}

    fn set_chart(&mut self, (): &()) {}

    fn signature(&mut self, x: &[f64]) -> Result<Vec<i64>, Infallible> {
        let (y, lambda) = self.numbers(x);
        Ok((self.signature)(y, lambda))
    }
}

type Listed = Vec<(Option<Special<Infallible>>, f64, f64)>;

/// All points of a branch from `(x, λ)` towards growing `λ`, in numbers.
fn walk(curve: &mut Curve, (x, lambda): (f64, f64), options: &Options) -> (Listed, Stop) {
    let units = curve.units;
    let options = Options {
        range: (options.range.0 * units.1, options.range.1 * units.1),
        ..options.clone()
    };
    let x = vec![x * units.0, lambda * units.1];
    let place = Place::start(curve, x, 1.0, options.step.0).unwrap().unwrap();
    let mut listed = vec![];
    let stop = follow(curve, place, &options, |curve, p| {
        let (x, lambda) = curve.numbers(&p.x);
        listed.push((p.special, x, lambda));
        Go::Continue(())
    });
    (listed, stop.unwrap())
}

fn specials(listed: &Listed) -> Vec<(Special<Infallible>, f64, f64)> {
    listed.iter().filter_map(|(s, x, l)| s.clone().map(|s| (s, *x, *l))).collect()
}

fn options(range: (f64, f64), step: f64) -> Options {
    Options { range, step: (step, 1e-9, step), points: 60, locate: true, natural: false }
}

fn change(before: &[i64], after: &[i64]) -> Special<Infallible> {
    Special::Stability(before.to_vec(), after.to_vec())
}

fn circle() -> Curve {
    Curve::new(|x, l| x * x + l * l - 1.0, |x, l| [2.0 * x, 2.0 * l])
}

/// `λ = (x³ − x/100)/10`: folds at `x = ±√(1/300)`.
fn two_folds() -> Curve {
    Curve::new(|x, l| l - 0.1 * (x * x * x - 0.01 * x), |x, _| [-0.1 * (3.0 * x * x - 0.01), 1.0])
}

/// The trivial branch `x = 0`.
fn trivial(signature: fn(f64, f64) -> Vec<i64>) -> Curve {
    Curve { signature, ..Curve::new(|x, _| x, |_, _| [1.0, 0.0]) }
}

#[test]
fn folds_of_a_circle_lie_at_its_sides() {
    let (listed, stop) = walk(&mut circle(), (-1.0, 0.0), &options((-2.0, 2.0), 0.3));
    assert_eq!(stop, Stop::Points);
    assert!(listed.iter().all(|(_, x, l)| (x.hypot(*l) - 1.0).abs() < 1e-13));
    let folds = specials(&listed);
    assert!(folds.len() >= 4);
    for (k, (special, x, lambda)) in folds.iter().enumerate() {
        assert_eq!(*special, Special::Fold);
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        assert!((lambda - side).abs() < 1e-14 && x.abs() < 1e-9, "{x} {lambda}");
    }
}

#[test]
fn a_curve_does_not_know_its_units() {
    let walked = |units: (f64, f64)| {
        let mut curve = Curve { units, ..circle() };
        walk(&mut curve, (-1.0, 0.0), &options((-2.0, 0.7), 0.3)).0
    };
    let plain = walked((1.0, 1.0));
    assert_eq!(walked((2f64.powi(-40), 2f64.powi(30))), plain);
    for units in [(1e-9, 1e9), (1e9, 1e-9), (1e-12, 1.0), (1.0, 1e7)] {
        let other = walked(units);
        assert_eq!(other.len(), plain.len());
        for (a, b) in plain.iter().zip(&other) {
            assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-9 && (a.2 - b.2).abs() < 1e-9);
        }
    }
}

#[test]
fn both_of_two_folds_in_one_step_are_found() {
    let (listed, _) = walk(&mut two_folds(), (-0.5, -0.012), &options((-1.0, 0.1), 1.0));
    let folds = specials(&listed);
    let at = (1.0f64 / 300.0).sqrt();
    assert_eq!(folds.len(), 3, "{folds:?}");
    for (fold, at) in folds.iter().zip([-at, at]) {
        assert!(fold.0 == Special::Fold && (fold.1 - at).abs() < 1e-7, "{fold:?}");
    }
    assert_eq!(folds[2].0, Special::End);
    assert!((folds[2].2 - 0.1).abs() < 1e-14);
}

#[test]
fn a_pitchfork_and_its_multiplier_are_told_once() {
    let mut pitchfork = Curve {
        signature: |_, l| vec![i64::from(l > 0.0), 0, 0],
        ..Curve::new(|x, l| x * (l - x * x), |x, l| [l - 3.0 * x * x, x])
    };
    for locate in [true, false] {
        let options = Options { locate, ..options((-1.0, 1.0), 0.3) };
        let (listed, stop) = walk(&mut pitchfork, (0.0, -0.95), &options);
        assert_eq!(stop, Stop::Range);
        let found = specials(&listed);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].0 == Special::BranchPoint && found[0].2.abs() < 1e-4);
    }
}

#[test]
fn a_doubling_beside_a_branch_point_is_not_lost() {
    let mut pitchfork = Curve {
        signature: |_, l| vec![i64::from(l > 0.0), i64::from(l > 0.02), 0],
        ..Curve::new(|x, l| x * (l - x * x), |x, l| [l - 3.0 * x * x, x])
    };
    let (listed, _) = walk(&mut pitchfork, (0.0, -0.95), &options((-1.0, 1.0), 0.3));
    let found = specials(&listed);
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(found[0].0, Special::BranchPoint);
    assert_eq!(found[1].0, change(&[1, 0, 0], &[1, 1, 0]));
    assert!((found[1].2 - 0.02).abs() < 2e-4, "{}", found[1].2);
}

#[test]
fn a_doubling_beside_a_fold_is_not_lost() {
    // the multiplier of the fold, and a doubling at x = 0.05 behind it
    let signature = |x: f64, _: f64| vec![i64::from(x > 0.0), i64::from(x > 0.05), 0];
    let mut circle = Curve { signature, ..circle() };
    for (locate, near) in [(true, 2e-4), (false, 0.3)] {
        let options = Options { locate, points: 12, ..options((-2.0, 2.0), 0.3) };
        let (listed, _) = walk(&mut circle, (-1.0, 0.0), &options);
        let found = specials(&listed);
        assert_eq!(found[0].0, Special::Fold);
        let before = if locate { [1, 0, 0] } else { [0, 0, 0] };
        assert_eq!(found[1].0, change(&before, &[1, 1, 0]), "{found:?}");
        assert!((found[1].1 - 0.05).abs() < near);
    }
}

#[test]
fn what_changes_in_the_last_step_before_the_end_of_the_range_is_listed() {
    let mut doubling = trivial(|_, l| vec![0, i64::from(l > 0.97), 0]);
    let (listed, _) = walk(&mut doubling, (0.0, 0.0), &options((0.0, 1.0), 0.3));
    let found = specials(&listed);
    assert_eq!(found.len(), 2, "{found:?}");
    assert_eq!(found[0].0, change(&[0, 0, 0], &[0, 1, 0]));
    assert!((found[0].2 - 0.97).abs() < 1e-3);
    assert_eq!((found[1].0.clone(), found[1].2), (Special::End, 1.0));
}

#[test]
fn several_changes_of_stability_in_a_step_are_located_each() {
    // a Neimark-Sacker bifurcation between two doublings
    let mut busy =
        trivial(|_, l| vec![0, i64::from(l > 0.31) + i64::from(l > 0.52), 2 * i64::from(l > 0.47)]);
    let (listed, _) = walk(&mut busy, (0.0, 0.3), &options((0.0, 1.0), 0.4));
    let found = specials(&listed);
    let wanted = [
        (change(&[0, 0, 0], &[0, 1, 0]), 0.31),
        (change(&[0, 1, 0], &[0, 1, 2]), 0.47),
        (change(&[0, 1, 2], &[0, 2, 2]), 0.52),
        (Special::End, 1.0),
    ];
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    for (found, wanted) in found.iter().zip(wanted) {
        assert!(found.0 == wanted.0 && (found.2 - wanted.1).abs() < 2e-4, "{found:?}");
    }
}

#[test]
fn a_cusp_is_passed_without_a_fold() {
    // λ = x³: the tangent is along x, and λ goes on
    let mut cusp = Curve::new(|x, l| l - x * x * x, |x, _| [-3.0 * x * x, 1.0]);
    let (listed, stop) = walk(&mut cusp, (-1.0, -1.0), &options((-2.0, 1.0), 0.11));
    assert_eq!(stop, Stop::Range);
    assert_eq!(specials(&listed).len(), 1);
    assert!(listed.iter().all(|(_, x, l)| (l - x * x * x).abs() < 1e-13));
}
