//! Harmonic balance against closed forms in the number of harmonics: an acceleration that jumps.

use std::f64::consts::{PI, TAU};

use signorini::hbm::modes::solve;
use signorini::hbm::newton::Settings;
use signorini::hbm::{Basis, Form, Reduction, Series};
use signorini::problem::Problem;

use super::slope;
use super::steps::oscillator;
use crate::common::shipped;

/// The period of the oscillator from its far point `−a`.
fn period(a: f64) -> f64 {
    let g = 0.5f64;
    let (open, closed) = (0.75f64.sqrt(), 3f64.sqrt());
    let v = open * (a * a - g * g).sqrt();
    2.0 * ((-g / a).acos() / open + (v / closed).atan2(0.5 * g) / closed)
}

/// Two bar elements: where the node meets the obstacle its acceleration jumps, so that coefficients fall as `k⁻³` and what a series of `N` leaves out as `N^{−5/2}`
/// in the mean square. The acceleration form, solved for `ü` in every phase, is as good. The force form multiplies a mass that jumps with the second derivative
/// of a series, which does not converge where it jumps: order one.
#[test]
fn series_of_motions_whose_acceleration_jumps() {
    let a = 1.7;
    let t = period(a);
    let samples = 4096;
    let place = |k: usize| PI * (k as f64 + 0.5) / samples as f64;
    let exact: Vec<f64> = (0..samples).map(|k| oscillator(a, place(k) * t / TAU).0.0).collect();
    let mut orders = vec![];
    for form in [Form::Force, Form::Acceleration] {
        let system = Problem::new(&shipped("oscillator.toml"), None).unwrap().system;
        let r = Reduction::new(system, form).unwrap();
        let (mut best, mut found) = (vec![], vec![]);
        for n_h in [8, 12, 16, 24, 32, 48, 64, 96] {
            let mut q = Series::zeros(Basis::Cosine, n_h, 1);
            for j in 0..=n_h {
                let weight = if j == 0 { 1.0 } else { 2.0 } / samples as f64;
                let c: f64 =
                    (0..samples).map(|k| weight * exact[k] * (j as f64 * place(k)).cos()).sum();
                q.of_mut(j).copy_from_slice(&r.modal(&[c]));
            }
            let s = solve(&r, &q, TAU / t, &Settings::default()).unwrap().unwrap();
            let distance = |q: &Series| {
                let square = |k: usize| {
                    let (x, dx) = q.at(place(k));
                    (r.state(&x, &dx, TAU / t).u[0] - exact[k]).powi(2)
                };
                ((0..samples).map(square).sum::<f64>() / samples as f64).sqrt()
            };
            best.push((n_h as f64, distance(&q)));
            found.push((n_h as f64, distance(&s.q)));
        }
        println!("{form:?}: cut off {:.3} {best:.1?}", slope(&best));
        println!("{form:?}: balanced {:.3} {found:?}", slope(&found));
        orders.push((slope(&best), slope(&found)));
    }
    assert!(orders.iter().all(|o| (o.0 + 2.5).abs() < 0.1), "{orders:?}");
    let [force, acceleration] = [orders[0].1, orders[1].1];
    assert!((acceleration + 2.5).abs() < 0.1, "{acceleration}");
    assert!((force + 1.0).abs() < 0.1, "{force}");
}
