//! Orbits of several periods of the loads, and the branches that begin at period doublings.

use crate::common::{json, run};
use signorini::event::Silent;
use signorini::orbit::period_map::integrate_with;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::PointRecord;
use signorini::scenario::Scene;
use signorini::store::StoredFamily;

/// A bar that rests on its obstacle, driven at more than twice the frequency at which it would swing there.
const BAR: &str = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\narea = 1.0\n\
    [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 0.0\n[damping]\nratio = 0.05\nmode = 1\n\
    [[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.1\nomega = 4.5\n[orbit]\nrange = [1.4, 6.5]\n";

/// Both ends of the band in which the response is unstable lead to one and the same branch, and it to the other end.
#[test]
fn a_branch_of_twice_the_period_goes_from_doubling_to_doubling() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("bar.toml"), BAR).unwrap();
    let (scene, response, doubled) = (at("bar.toml"), at("response.h5"), at("doubled.h5"));
    json(&["response", &scene, "--locate", "-o", &response]);
    json(&["response", &scene, "--doublings", &response, "-o", &doubled]);
    let family = StoredFamily::read(doubled.as_ref()).unwrap();
    assert_eq!(family.branches.len(), 2);
    let (low, high) = (3.7177, 5.7173);
    for branch in 0..2 {
        let points: Vec<&PointRecord> =
            family.points.iter().filter(|p| p.branch == branch && p.orbit.is_some()).collect();
        assert!(points.len() > 60, "{}", points.len());
        let [first, last] = [points[0].omega, points[points.len() - 1].omega];
        let far = if branch == 0 { high } else { low };
        assert!((last - far).abs() < 0.05 && (first - far).abs() > 1.5, "{first} {last}");
        assert!(points.iter().all(|p| p.orbit.as_ref().is_some_and(|o| o.periods == 2)));
        let end = family.ends.iter().find(|e| e.branch == branch).unwrap();
        assert!(end.complete && end.text.contains("a period doubling"), "{}", end.text);
        // where it says that it ends is where the response lost its stability
        let said: f64 =
            end.text.split("omega = ").nth(1).unwrap().split(':').next().unwrap().parse().unwrap();
        assert!((said - far).abs() < 1e-3, "{said} {far}");
    }
    // a finished file has nothing left to do
    let again = run(&["response", &scene, "--doublings", &response, "-o", &doubled, "--resume"]);
    assert!(again.status.success());
    // another scene is refused
    std::fs::write(at("other.toml"), BAR.replace("elements = [4]", "elements = [5]")).unwrap();
    let other = run(&["response", &at("other.toml"), "--doublings", &response, "-o", &at("x.h5")]);
    assert_eq!(other.status.code(), Some(2));
}

/// A stable orbit of two periods is still there after two hundred of them in time, and is none of one period.
#[test]
fn two_hundred_periods_in_time_confirm_a_doubled_orbit() {
    let scene = Scene::parse(BAR, std::path::Path::new("bar.toml")).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    let mut body = Propagator::new(problem.system).unwrap();
    let omega = 4.5;
    body.system.loads_mut().set_frequency(omega);
    // from rest in time: the motion settles on what attracts it
    let period = Closure::FORCED.period(omega);
    let rest = body.state(&vec![0.0; 2 * body.n()]);
    let settled = integrate_with(&body, &rest, 100.0 * period, 0, &mut Silent).unwrap().report.last;
    let guess = body.frame(&settled);
    let closure = Closure::Forced(2);
    let verdict = find(&mut body, closure, &guess, omega, &Effort::default()).unwrap();
    let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}")).clone();
    assert!(orbit.stability.as_ref().unwrap().is_stable());
    assert!((orbit.omega() - omega).abs() < 1e-12 && (orbit.period - 2.0 * period).abs() < 1e-12);
    let size = |z: &[f64]| z.iter().map(|z| z * z).sum::<f64>().sqrt();
    assert!(size(orbit.halfway.as_ref().unwrap()) > 0.3 * size(&orbit.z));
    let after = integrate_with(&body, &orbit.state, 200.0 * period, 0, &mut Silent).unwrap();
    let off: Vec<f64> =
        body.frame(&after.report.last).iter().zip(&orbit.z).map(|(a, b)| a - b).collect();
    assert!(size(&off) < 1e-9 * size(&orbit.z), "{}", size(&off) / size(&orbit.z));
    assert_eq!(after.report.switches.len(), 100 * orbit.switches.len());
    // from the same guess the orbit of one period is another one, and unstable
    let single = find(&mut body, Closure::FORCED, &guess, omega, &Effort::default()).unwrap();
    let single = single.orbit().unwrap();
    assert_eq!(single.stability.as_ref().unwrap().outside, [0, 1, 0]);
    // twice the single orbit is refused as a subharmonic one
    let twice = find(&mut body, closure, &single.z, omega, &Effort::default()).unwrap();
    assert!(
        twice.orbit().is_none() && twice.to_string().contains("repeats after one period"),
        "{twice}"
    );
}

#[test]
fn an_orbit_of_several_periods_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("bar.toml");
    std::fs::write(
        &scene,
        BAR.replace("[orbit]", "[initial]\ndisplacement = [\"-0.15*x\"]\n[orbit]"),
    )
    .unwrap();
    let (scene, file) =
        (scene.display().to_string(), folder.path().join("o.h5").display().to_string());
    let orbit = json(&["orbit", &scene, "--omega", "4.5", "--periods", "2", "-o", &file]);
    assert_eq!(orbit["forcing_periods"], 2);
    let known = signorini::store::StoredFamily::read(file.as_ref());
    assert!(known.is_err(), "an orbit is no family");
    let omega = orbit["omega"].as_f64().unwrap();
    assert!((omega - 4.5).abs() < 1e-12);
    let refused = run(&[
        "orbit",
        "scenarios/half-plate-orbit.toml",
        "--omega",
        "1.8",
        "--periods",
        "2",
        "-o",
        "/dev/null",
    ]);
    assert_eq!(refused.status.code(), Some(2));
}
