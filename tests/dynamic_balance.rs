//! Harmonic balance by dynamic stiffness beside that by all modes: two ways to one series.

use crate::common::{scene, shipped};
use crate::harmonic_friction::plate;
use signorini::continuation::Go;
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{Track, Walk, sequential};
use signorini::hbm::{Balanced, Dynamic, Form, Reduction, prepare};
use signorini::problem::Problem;
use signorini::scenario::{ContactMethod, Scene};

/// Series of `u_O` over a grid: frequency, number of harmonics, coefficients, residual, switches.
type Found = Vec<(f64, usize, Vec<f64>, f64, usize)>;

fn solutions(body: &mut dyn Balanced, harmonics: &[usize], grid: &[f64]) -> Found {
    let mut tracks = vec![Track::default(); harmonics.len() + 1];
    let mut found = vec![];
    let settings = Settings::default();
    let walk = Walk::new(harmonics, grid, &settings);
    sequential(body, &walk, &mut tracks, |body, p| {
        let s = p.solution.unwrap_or_else(|e| panic!("{} with {}: {e}", p.omega, p.n_h));
        let u = body.displacements(&s).unwrap();
        found.push((p.omega, p.n_h, u.a, s.residual, s.crossings.len()));
        Go::Continue(())
    })
    .unwrap();
    found
}

fn both_ways(scene: &Scene, form: Form, harmonics: &[usize], grid: &[f64]) {
    let system = || Problem::new(scene, None).unwrap().system;
    let by_modes = solutions(&mut Reduction::new(system(), form).unwrap(), harmonics, grid);
    let by_stiffness = solutions(&mut Dynamic::new(system(), form).unwrap(), harmonics, grid);
    assert_eq!(by_modes.len(), harmonics.len() * grid.len());
    let mut switches = 0;
    for (a, b) in by_modes.iter().zip(&by_stiffness) {
        assert_eq!((a.0, a.1, a.4), (b.0, b.1, b.4));
        let size = a.2.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let error = a.2.iter().zip(&b.2).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-10 * size, "{form:?} {} {}: {:e}", a.0, a.1, error / size);
        assert!(b.3 < 1e-12, "{:e}", b.3);
        switches += b.4;
    }
    assert!(switches > 0, "no contact");
}

#[test]
fn a_forced_response() {
    let scene = shipped("half-plate-response.toml");
    for form in [Form::Force, Form::Acceleration] {
        both_ways(&scene, form, &[3, 7], &[1.5, 1.55, 1.6]);
    }
}

#[test]
fn another_method_of_contact() {
    let mut scene = shipped("half-plate-response.toml");
    scene.contact.as_mut().unwrap().method = ContactMethod::MassRedistribution;
    both_ways(&scene, Form::Acceleration, &[7], &[1.5, 1.6]);
}

/// Springs do not damp: beside Nitsche's terms the modes do not decouple the open body, and one way inverts a full matrix, the other a sparse one.
#[test]
fn springs_beside_structural_damping() {
    for method in [ContactMethod::Penalty, ContactMethod::Nitsche] {
        let mut scene = shipped("half-plate-response.toml");
        scene.contact.as_mut().unwrap().method = method;
        both_ways(&scene, Form::Acceleration, &[3, 7], &[1.5, 1.6]);
    }
}

#[test]
fn a_family_without_loads() {
    let scene = shipped("half-plate-orbit.toml");
    both_ways(&scene, Form::Acceleration, &[3, 5], &[1.70, 1.705, 1.71]);
}

/// The response of the 10 × 3 half plate with five harmonics has its fold near 1.75: behind it only the motion without contact is left, and the walk goes on with it.
#[test]
fn a_walk_goes_on_behind_a_fold() {
    let scene = shipped("half-plate-response.toml");
    let grid: Vec<f64> = (0..=20).map(|k| 1.5 + 0.02 * f64::from(k)).collect();
    let system = Problem::new(&scene, None).unwrap().system;
    for large in [false, true] {
        let mut body: Box<dyn Balanced> = match large {
            true => Box::new(Dynamic::new(system.clone(), Form::Force).unwrap()),
            false => Box::new(Reduction::new(system.clone(), Form::Force).unwrap()),
        };
        let found = solutions(body.as_mut(), &[5], &grid);
        let last = found.iter().rfind(|f| f.4 > 0).map(|f| f.0).unwrap();
        assert!((1.70..1.80).contains(&last), "{last}");
        assert_eq!(found.len(), grid.len());
        assert!(found.last().is_some_and(|f| f.4 == 0));
    }
}

#[test]
fn a_body_that_is_not_held_is_refused() {
    let system = Problem::new(&shipped("bouncing-bar.toml"), None).unwrap().system;
    let refused = Dynamic::new(system, Form::Force).err().unwrap().to_string();
    assert!(refused.contains("can move rigidly"), "{refused}");
}

/// Size decides: series of a small body are those of its modes, series of a large one those of its projections.
#[test]
fn large_bodies_go_by_dynamic_stiffness() {
    let mut scene = shipped("half-plate-response.toml");
    for (elements, large) in [([10, 3], false), ([40, 15], true)] {
        scene.body.elements = elements.to_vec();
        let system = Problem::new(&scene, None).unwrap().system;
        let n = system.n_o();
        let body = prepare(system, Form::Force).unwrap();
        assert_eq!(body.components() != n, large);
        assert_eq!(body.components() == body.interface().rank_in(), large);
    }
}

/// Coulomb's friction, a slider with a spring, one without, a damper.
#[test]
fn what_rubs() {
    let more = "[[slider]]\nat = [0.25, 1.0]\ndirection = [0.0, 1.0]\nlimit = 0.01\nstiffness = 0.7\n[[slider]]\nat = [0.25, 0.5]\ndirection = [1.0, 0.0]\nlimit = 0.003\n\
                [[damper]]\nat = [0.25, 1.0]\ndirection = [1.0, 0.0]\nviscosity = 0.1\n";
    let scene = scene(&plate(0.01, [0.1, 0.1], more));
    both_ways(&scene, Form::Acceleration, &[3, 9], &[2.1, 2.15, 2.2]);
}
