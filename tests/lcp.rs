//! The complementarity problem against enumeration and an interior-point method.

use nalgebra::DMatrix;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use signorini::contact::lcp::{residual, solve};
use signorini::contact::oracle::{clarabel, enumerate};
use signorini::event::{self, Options, Silent};
use signorini::flow::Modal;

use crate::common::problem;

/// A P-matrix of three kinds: symmetric positive definite, unsymmetric with positive definite symmetric
/// part, and a row-scaled one whose symmetric part may be indefinite.
fn p_matrix(size: usize, entries: &[f64], kind: usize) -> DMatrix<f64> {
    let a = DMatrix::from_fn(size, size, |i, j| entries[i * size + j]);
    let mut n = &a * a.transpose() + DMatrix::identity(size, size) * 0.1;
    if kind >= 1 {
        n += (&a - a.transpose()) * 1.5;
    }
    if kind == 2 {
        for i in 0..size {
            let scale = 10f64.powf(2.0 * entries[i]);
            n.row_mut(i).scale_mut(scale);
        }
    }
    n
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, rng_seed: RngSeed::Fixed(20261120), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pivoting_agrees_with_enumeration_and_interior_point(
        size in 1usize..9,
        kind in 0usize..3,
        entries in prop::collection::vec(-1.0f64..1.0, 81),
        q in prop::collection::vec(-1.0f64..1.0, 9),
        start in prop::collection::vec(any::<bool>(), 9),
        exponent in -9i32..9,
    ) {
        let n = p_matrix(size, &entries, kind);
        let unit = 10f64.powi(exponent);
        let q: Vec<f64> = q[..size].iter().map(|x| x * unit).collect();
        let scale: Vec<f64> = q.iter().map(|x| x.abs()).collect();
        let s = solve(&n.clone().into(), &q, &scale, &start[..size]).unwrap();
        let largest = s.w.iter().fold(unit, |m, w| m.max(w.abs()));
        prop_assert!(residual(&n, &q, &s.w) < 1e-10 * largest);
        for i in 0..size {
            // zeros are exact
            let zero = if s.active[i] { s.w[i] } else { s.p[i] };
            prop_assert_eq!(zero, 0.0);
            prop_assert!(s.w[i] >= 0.0 && s.p[i] >= 0.0);
        }
        let all = enumerate(&n, &q);
        prop_assert_eq!(all.len(), 1, "a P-matrix has one solution");
        for (a, b) in s.w.iter().zip(&all[0]) {
            prop_assert!((a - b).abs() < 1e-8 * largest);
        }
        if kind < 2 {
            let x = clarabel(&n, &q).unwrap();
            for (a, b) in s.w.iter().zip(&x) {
                prop_assert!((a - b).abs() < 2e-5 * largest, "{} {}", a, b);
            }
        }
        let again = solve(&n.clone().into(), &q, &scale, &s.active).unwrap();
        prop_assert_eq!(again.pivots, 0);
    }

    /// The kind that occurs on a straight edge with lumped boundary mass: tridiagonal, many nodes.
    #[test]
    fn long_tridiagonal_problems(q in prop::collection::vec(-1.0f64..1.0, 200)) {
        let size = q.len();
        let n = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
            0 => 2.0 / 3.0,
            1 => 1.0 / 6.0,
            _ => 0.0,
        });
        let scale = vec![1.0; size];
        let s = solve(&n.clone().into(), &q, &scale, &vec![false; size]).unwrap();
        prop_assert!(residual(&n, &q, &s.w) < 1e-12);
        prop_assert!(s.pivots < 40, "{} pivots", s.pivots);
        let x = clarabel(&n, &q).unwrap();
        for (a, b) in s.w.iter().zip(&x) {
            prop_assert!((a - b).abs() < 1e-5);
        }
    }

    /// Solutions made to measure, with pressures and gaps down to 1e-9 of the largest: each index on its right side.
    #[test]
    fn nine_orders_between_pressures(
        size in 2usize..40,
        exponents in prop::collection::vec(-9.0f64..0.0, 40),
        closed in prop::collection::vec(any::<bool>(), 40),
        stiffness in -6i32..12,
    ) {
        let unit = 10f64.powi(stiffness);
        let n = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
            0 => 2.0 / 3.0 * unit,
            1 => 1.0 / 6.0 * unit,
            _ => 0.0,
        });
        let value = |i: usize| 10f64.powf(exponents[i]);
        let w: Vec<f64> = (0..size).map(|i| if closed[i] { 0.0 } else { value(i) }).collect();
        let p: Vec<f64> = (0..size).map(|i| if closed[i] { unit * value(i) } else { 0.0 }).collect();
        let product = |i: usize| (0..size).map(|j| n[(i, j)] * w[j]).sum::<f64>();
        let q: Vec<f64> = (0..size).map(|i| p[i] - product(i)).collect();
        let scale = vec![unit; size];
        let s = solve(&n.clone().into(), &q, &scale, &vec![false; size]).unwrap();
        prop_assert_eq!(&s.active, &closed[..size].to_vec());
        for i in 0..size {
            prop_assert!((s.w[i] - w[i]).abs() < 1e-14 && (s.p[i] - p[i]).abs() < 1e-14 * unit);
        }
    }
}

/// A body at rest on one of two obstacles: far from the other one nothing but rounding errors of the whole solution decides, which have no terms of their own.
#[test]
fn a_body_that_lies_on_one_of_two_obstacles_begins() {
    for (elements, stress) in
        [("[3, 3]", ""), ("[6, 2]", ""), ("[3, 3]", "stress = 'reaction'\ninertia = 'constant'\n")]
    {
        let method = if stress.is_empty() { "method = 'mass-redistribution'\n" } else { stress };
        let p = problem(&format!(
            "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = {elements}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
             [[contact]]\nedge = 'bottom'\ngap = 0.0\n{method}[[contact]]\nedge = 'right'\ngap = 0.02\n{method}\
             [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.0, -0.2]\n"
        ));
        let options = Options { until: 1.0, samples: 1, switch_limit: 40.0 };
        let mut flow = Modal::new(&p.system);
        let report = event::run(&p.system, &p.initial, &options, &mut flow, &mut Silent).unwrap();
        assert!(report.outcome.is_complete(), "{elements}: {}", report.outcome);
        assert!(report.energy_drift_total < 1e-10);
    }
}
