//! Harmonic balance against finite differences, the numbers of an independent program, and true orbits.

use crate::common::{json, random, root, shipped};
use signorini::continuation::Go;
use signorini::hbm::check::{Candidate, Likeness, check, series_of_orbit};
use signorini::hbm::modes::{directional, solve};
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{Summary, Track, Walk, ladder, mode_start, sequential};
use signorini::hbm::{Basis, Form, Quadrature, Reduction, Series, Solution};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator, branch, census};
use signorini::problem::Problem;
use signorini::records::GapReason;
use signorini::records::VerdictKind;

fn half_plate(form: Form) -> Reduction {
    Reduction::new(Problem::new(&shipped("half-plate-orbit.toml"), None).unwrap().system, form)
        .unwrap()
}

fn forced(form: Form, omega: f64) -> Reduction {
    let system = Problem::new(&shipped("half-plate-response.toml"), None).unwrap().system;
    let mut r = Reduction::new(system, form).unwrap();
    r.set_frequency(omega);
    r
}

/// Solutions for several numbers of harmonics at the last frequency of a sequential continuation.
fn backbone(
    r: &mut Reduction,
    harmonics: &[usize],
    grid: &[f64],
) -> Vec<(f64, usize, Result<Solution, GapReason>)> {
    let mut tracks = vec![Track::default(); harmonics.len() + 1];
    let mut list = vec![];
    let settings = Settings::default();
    let walk = Walk::new(harmonics, grid, &settings);
    sequential(r, &walk, &mut tracks, |_, p| {
        list.push((p.omega, p.n_h, p.solution));
        Go::Continue(())
    })
    .unwrap();
    list
}

fn grid(from: f64, to: f64) -> Vec<f64> {
    let steps = ((to - from) / 0.005_f64).round() as usize;
    (0..=steps).map(|k| from + (to - from) * k as f64 / steps as f64).collect()
}

fn perturbed(q: &Series, share: f64, seed: u64) -> Series {
    let mut p = q.clone();
    let size = q.a.iter().map(|x| x * x).sum::<f64>().sqrt();
    let noise = random(q.a.len(), seed);
    let of_noise = noise.iter().map(|x| x * x).sum::<f64>().sqrt();
    p.a.iter_mut().zip(&noise).for_each(|(p, n)| *p += share * size * n / of_noise);
    p
}

/// The Jacobian, moving switches included, against central differences: both forms, reversible and forced-damped.
#[test]
fn jacobian_is_exact() {
    for (r, omega) in [
        (half_plate(Form::Force), 1.8),
        (half_plate(Form::Acceleration), 1.8),
        (forced(Form::Force, 1.65), 1.65),
        (forced(Form::Acceleration, 1.65), 1.65),
    ] {
        let n_h = 5;
        let mut q = Series::zeros(r.basis, n_h, r.n());
        q.of_mut(1)[0] =
            -1.4 / r.open.shapes.col_as_slice(0).iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let q = perturbed(&q, 0.05, 3);
        let mut worst = 0.0f64;
        for k in 0..3 {
            let mut d = Series::zeros(r.basis, n_h, r.n());
            d.a.copy_from_slice(&random(q.a.len(), 40 + k));
            let h = 1e-6;
            let at = |s: f64| {
                let mut y = q.clone();
                y.a.iter_mut().zip(&d.a).for_each(|(y, d)| *y += s * d);
                directional(&r, &y, &d, omega, Quadrature::EventResolved).unwrap().0
            };
            let (up, down) = (at(h), at(-h));
            let exact = directional(&r, &q, &d, omega, Quadrature::EventResolved).unwrap().1;
            let scale = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for i in 0..up.len() {
                worst = worst.max(((up[i] - down[i]) / (2.0 * h) - exact[i]).abs() / scale);
            }
        }
        println!("{:?} {:?}: Jacobian against differences {worst:.1e}", r.form, r.basis);
        assert!(worst < 1e-7, "{:?} {:?}: {worst:e}", r.form, r.basis);
    }
}

#[test]
fn condensed_and_whole_newton_steps_are_the_same() {
    for (r, omega) in [
        (half_plate(Form::Force), 1.75),
        (half_plate(Form::Acceleration), 1.75),
        (forced(Form::Force, 1.65), 1.65),
        (forced(Form::Acceleration, 1.65), 1.65),
    ] {
        let settings = Settings::default();
        let start = match r.basis {
            Basis::Cosine => mode_start(&r, 1.4).unwrap(),
            Basis::Full => Series::zeros(Basis::Full, 1, r.n()),
        };
        // a start that need not be a solution
        let near = match solve(&r, &start, omega, &settings).unwrap() {
            Ok(s) => s.q,
            Err(_) => perturbed(&start, 0.1, 5),
        };
        let guess = perturbed(&near.with_harmonics(4), 0.01, 8);
        // one step of each from the same point
        let step = |full: bool| {
            let settings = Settings { full, iterations: 1, tolerance: f64::INFINITY, ..settings };
            solve(&r, &guess, omega, &settings).unwrap()
        };
        let (Ok(a), Ok(b)) = (step(false), step(true)) else {
            panic!("{:?} {:?}", r.form, r.basis)
        };
        let size = a.q.a.iter().map(|x| x * x).sum::<f64>().sqrt();
        let d = a.q.a.iter().zip(&b.q.a).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size;
        println!("{:?} {:?}: condensed and whole differ by {d:.1e}", r.form, r.basis);
        assert!(d < 1e-12, "{:?} {:?}: {d:e}", r.form, r.basis);
    }
}

/// Force form, ω = 1.87: energies at the far point of an independent implementation.
#[test]
fn energies_of_the_table() {
    let mut r = half_plate(Form::Force);
    let table =
        [(1, 0.95187), (3, 1.51672), (5, 1.63183), (7, 1.58760), (11, 1.66398), (15, 1.66325)];
    // the base of the ladder is continued from the linear mode
    let mut path = grid(1.586, 1.866);
    path.push(1.87);
    let one: Vec<_> = backbone(&mut r, &[1], &path);
    let (_, _, last) = one.last().unwrap();
    let mut q = last.as_ref().unwrap().q.clone();
    for n_h in 1..=15 {
        if n_h > 1 {
            q = ladder(&r, &q, n_h, 1.87, &Settings::default()).unwrap().unwrap().q;
        }
        let s = solve(&r, &q, 1.87, &Settings::default()).unwrap().unwrap();
        let summary = Summary::new(&r, &s).unwrap();
        if let Some((_, energy)) = table.iter().find(|t| t.0 == n_h) {
            println!(
                "N_h = {n_h}: energy {:.6}, {} switches",
                summary.energy,
                summary.switches.len()
            );
            assert!((summary.energy / energy - 1.0).abs() < 1e-4, "{n_h}: {}", summary.energy);
            assert_eq!(summary.switches.len(), 8);
        }
    }
}

/// Acceleration form with 31 harmonics beside the orbits at 1.80 and 2.00, from the orbits' own Fourier series.
#[test]
fn thirty_one_harmonics_beside_true_orbits() {
    let r = half_plate(Form::Acceleration);
    let mut body =
        Propagator::new(Problem::new(&shipped("half-plate-orbit.toml"), None).unwrap().system)
            .unwrap();
    let starts = census::starts(&body, 4.0, 16);
    for (omega, of_orbit, of_series) in [(1.80, 1.04367, 1.03947), (2.00, 7.16476, 7.16212)] {
        let effort = Effort { multipliers: false, ..Effort::default() };
        let all = census::all(&mut body, Closure::Reversible, &starts, omega, &effort, |_, _| ())
            .unwrap()
            .orbits;
        let orbit = all.iter().find(|o| (o.energy - of_orbit).abs() < 1e-5).unwrap();
        let series = series_of_orbit(&body, &orbit.z, omega, 31).unwrap();
        let n = r.n();
        let mut q = Series::zeros(Basis::Cosine, 31, n);
        for k in 0..=31 {
            let f = if k == 0 { 0 } else { 2 * k - 1 };
            q.of_mut(k).copy_from_slice(&r.modal(&series.coefficients[f * n..(f + 1) * n]));
        }
        let s = solve(&r, &q, omega, &Settings::default()).unwrap().unwrap();
        let energy = Summary::new(&r, &s).unwrap().energy;
        println!(
            "{omega}: energy {energy:.6} beside the orbit's {:.6}, {} steps",
            orbit.energy, s.iterations
        );
        assert!((energy / of_series - 1.0).abs() < 1e-4);
    }
}

/// From solutions disturbed by 2 %, event-resolved Newton comes back to a solution every time.
#[test]
fn newton_comes_back_from_two_per_cent() {
    let mut r = half_plate(Form::Force);
    let points = backbone(&mut r, &[3, 7, 15], &grid(1.70, 1.93));
    let (mut tried, mut converged) = (0, 0);
    for (k, (omega, n_h, solution)) in points.iter().enumerate() {
        let Ok(s) = solution else { continue };
        tried += 1;
        let guess = perturbed(&s.q, 0.02, 100 + k as u64);
        match solve(&r, &guess, *omega, &Settings::default()).unwrap() {
            Ok(_) => converged += 1,
            Err(e) => println!("{omega} N_h = {n_h}: {e}"),
        }
    }
    println!("{converged} of {tried}");
    assert!(tried >= 130);
    // a random 2 % reaches all harmonics alike: the highest are then far larger than they were
    assert!(converged as f64 >= 0.97 * f64::from(tried), "{converged} of {tried}");
}

/// The forced response converges with the number of harmonics to the orbit that shooting finds.
#[test]
fn a_forced_response_converges_to_the_orbit() {
    let omega = 1.62;
    let system = Problem::new(&shipped("half-plate-response.toml"), None).unwrap().system;
    let mut body = Propagator::new(system).unwrap();
    let mut distances = vec![];
    for form in [Form::Force, Form::Acceleration] {
        let mut last = f64::INFINITY;
        for n_h in [3, 7, 15, 31] {
            let mut r = forced(form, omega);
            let grid: Vec<f64> = (0..=40).map(|k| 1.42 + 0.005 * f64::from(k)).collect();
            let points = backbone(&mut r, &[n_h], &grid);
            let s =
                points.last().unwrap().2.as_ref().unwrap_or_else(|e| panic!("{form:?} {n_h}: {e}"));
            let (q, dq) = s.q.at(0.0);
            let z = body.frame(&r.state(&q, &dq, omega));
            let verdict = find(&mut body, Closure::FORCED, &z, omega, &Effort::default()).unwrap();
            let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}"));
            let size = orbit.z.iter().map(|z| z * z).sum::<f64>().sqrt();
            let d = orbit.z.iter().zip(&z).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size;
            println!("{form:?} N_h = {n_h}: distance to the orbit {d:.1e}");
            assert!(d < 1.5 * last, "{form:?} {n_h}: {d:e}");
            last = d;
        }
        distances.push(last);
    }
    assert!(distances[0] < 2e-2 && distances[1] < 2e-3, "{distances:?}");
}

/// The cross-check tells a series of a true orbit from one that is none.
#[test]
fn crosscheck_knows_true_motions() {
    let scene = shipped("half-plate-orbit.toml");
    let mut body = Propagator::new(Problem::new(&scene, None).unwrap().system).unwrap();
    let guess = branch::mode_guess(&body, 1, -1.1).unwrap();
    let verdict = find(&mut body, Closure::Reversible, &guess, 1.8, &Effort::default()).unwrap();
    let orbit = verdict.orbit().unwrap().clone();
    let truth = series_of_orbit(&body, &orbit.z, 1.8, 200).unwrap();
    let checked = check(&mut body, Closure::Reversible, &truth, &Effort::default()).unwrap();
    println!(
        "orbit's own series: residual {:.1e}, return {:.1e}, moved {:.1e}",
        checked.residual, checked.return_error, checked.likeness.moved
    );
    let Likeness { moved, same_sequence } = checked.likeness;
    assert!(moved < 1e-4 && same_sequence && checked.contact_change.abs() < 5e-3);
    assert_eq!(checked.kind(), VerdictKind::Orbit);
    assert!((checked.verdict.orbit().unwrap().energy / orbit.energy - 1.0).abs() < 1e-9);
    let n = body.n();
    let lie = Candidate {
        omega: 1.8,
        coefficients: truth.coefficients[..3 * n].iter().map(|c| 0.3 * c).collect(),
        alpha: None,
    };
    let told = check(&mut body, Closure::Reversible, &lie, &Effort::default()).unwrap();
    println!(
        "a lie: residual {:.1e}, return {:.1e}, moved {:.1e}",
        told.residual, told.return_error, told.likeness.moved
    );
    // a third of a motion that touches is none: what the equations leave over and how far it is from itself a period later are numbers, and large
    assert!(told.residual > 10.0 * checked.residual && told.return_error > 0.1);
    match told.verdict.orbit() {
        Some(_) => assert!(told.kind() == VerdictKind::AnotherOrbit, "{:?}", told.likeness),
        None => assert!(
            told.likeness.moved.is_nan() && !told.likeness.same_sequence,
            "{}",
            told.verdict
        ),
    }
    // the orbit's own series with one displacement for another: shooting ends somewhere, and that is another orbit
    let mut permuted = truth.clone();
    permuted.coefficients.chunks_exact_mut(n).for_each(|c| c.reverse());
    let checked = check(&mut body, Closure::Reversible, &permuted, &Effort::default()).unwrap();
    println!("permuted: {} ({})", checked.kind(), checked.verdict);
    assert_ne!(checked.kind(), VerdictKind::Orbit);
    // a tenth more of everything is near in state, and has other switches or leads elsewhere
    let mut larger = truth;
    larger.coefficients.iter_mut().for_each(|c| *c *= 1.2);
    let checked = check(&mut body, Closure::Reversible, &larger, &Effort::default()).unwrap();
    assert!(checked.verdict.orbit().is_none() || checked.kind() == VerdictKind::AnotherOrbit);
}

/// Sampling: more samples lower the error of what converges.
#[test]
fn samples_approximate_the_event_resolved_balance() {
    let mut r = half_plate(Form::Force);
    let points = backbone(&mut r, &[5], &grid(1.70, 1.75));
    let (omega, _, s) = &points[6];
    let exact = s.as_ref().unwrap();
    let energy = Summary::new(&r, exact).unwrap().energy;
    let mut errors = vec![];
    for samples in [256, 4096] {
        let settings = Settings {
            quadrature: Quadrature::Sampled(samples),
            tolerance: 1e-3,
            ..Settings::default()
        };
        let sampled = solve(&r, &exact.q, *omega, &settings).unwrap().unwrap();
        let e = (Summary::new(&r, &sampled).unwrap().energy / energy - 1.0).abs();
        println!("{samples} samples: energy off by {e:.1e}, residual {:.1e}", sampled.residual);
        errors.push(e);
    }
    assert!(errors[0] < 0.05 && errors[1] < 0.25 * errors[0], "{errors:?}");
}

/// A response that begins in the midst of contact: on a fine mesh Newton's method does not come there from rest, and goes by way of frequencies at which nothing touches. The solutions are
/// those of a coarser mesh, where it does.
#[test]
fn a_forced_response_begins_in_contact() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios/half-plate-response.toml")).unwrap();
    let points = |elements: &str| -> Vec<[f64; 2]> {
        let path = |name: &str| folder.path().join(name).display().to_string();
        let scene = text.replace("elements = [10, 3]", &format!("elements = {elements}"));
        std::fs::write(path("scene.toml"), scene).unwrap();
        let words = ["--method", "hbm", "--harmonics", "3", "--ratios", "0.02", "--step", "0.1"];
        let (scene, output) = (path("scene.toml"), path("out.h5"));
        let rest = ["--range", "1.60,1.61", "-q", "--force", "-o", &output];
        let answer = json(&[&["response", &scene], &words[..], &rest].concat());
        let numbers = |p: &serde_json::Value| {
            assert_eq!(p["converged"], true, "{elements}: {p}");
            ["energy", "amplitude"].map(|key| p[key].as_f64().unwrap())
        };
        answer["points"].as_array().unwrap().iter().map(numbers).collect()
    };
    let (fine, coarse) = (points("[60, 20]"), points("[40, 20]"));
    assert_eq!((fine.len(), coarse.len()), (4, 4));
    for (a, b) in fine.iter().zip(&coarse) {
        assert!(
            (a[0] / b[0] - 1.0).abs() < 0.02 && (a[1] / b[1] - 1.0).abs() < 0.02,
            "{a:?} {b:?}"
        );
    }
}
