//! Harmonic balance of the bar by boundary elements: published coefficients, an independent prototype, the closed form.

use std::f64::consts::TAU;

use signorini::hbm::bem::{BarBalance, NoBarSeries};

const BAR: BarBalance =
    BarBalance { length: 1.0, speed: 1.0, stiffness: 1.0, gap: 0.5, rho: 4.0, density: 20 };

/// Period and coefficients of the published solutions (Lu and Legrand 2022, data of their repository).
fn published() -> Vec<(f64, Vec<f64>)> {
    let text =
        std::fs::read_to_string(crate::common::root().join("tests/reference/bem-bar.csv")).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    let numbers = |l: &str| l.split(',').map(|x| x.trim().parse().unwrap()).collect::<Vec<f64>>();
    rows.map(numbers).map(|r| (r[0], r[1..].to_vec())).collect()
}

#[test]
fn published_coefficients_are_solutions() {
    let rows = published();
    assert_eq!(rows.len(), 4);
    for (period, u) in rows {
        assert_eq!(u.len(), 21);
        let s = BAR.solve(TAU / period, &u).unwrap();
        let off = s.u.iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("T = {period}: {off:.1e} after {} steps", s.iterations);
        assert!(off < 5e-5, "T = {period}: {off:e}");
        // weighted conditions are not met between the instants: there is penetration and tension, and not little
        let [penetration, tension] = BAR.violations(&s);
        assert!(
            penetration > 1e-4 && penetration < 0.05 && tension < 0.5,
            "{penetration} {tension}"
        );
    }
}

#[test]
fn one_solution_is_that_of_the_prototype() {
    let (period, u) = published().into_iter().find(|r| r.0 == 3.37).unwrap();
    let s = BAR.solve(TAU / period, &u).unwrap();
    for (a, b) in s.u.iter().zip([-0.2533139754, 0.8462334345, -0.0704534328]) {
        assert!((a - b).abs() < 1e-9, "{:?}", &s.u[..3]);
    }
    let [kinetic, elastic] = BAR.energies(&s, 0.0);
    // the prototype integrates over a mesh, here the integrals are closed forms
    assert!((kinetic + elastic - 0.9130365537).abs() < 1e-7, "{kinetic} {elastic}");
    // the energy of the closed form, within what a short series is worth
    let alpha = 0.5 / (2.0 * (period - 3.0));
    assert!(((kinetic + elastic) / (2.0 * alpha * alpha) - 1.0).abs() < 0.01);
}

/// Other units, and the closed form as a start.
#[test]
fn units_do_not_matter_and_the_closed_form_starts() {
    let omega = TAU / 3.37;
    let start = BAR.closed_form(omega, 20).unwrap();
    // the series of the closed form itself, at t = 0 in mid-contact
    assert!((start.iter().sum::<f64>() - 0.5).abs() < 0.02);
    let here = BAR.solve(omega, &start).unwrap();
    let (l, c, ea, g) = (2.5, 40.0, 300.0, 0.02);
    let there = BarBalance { length: l, speed: c, stiffness: ea, gap: g, ..BAR };
    let start = there.closed_form(omega * c / l, 20).unwrap();
    let there_too = there.solve(omega * c / l, &start).unwrap();
    for (a, b) in here.u.iter().zip(&there_too.u) {
        assert!((a / 0.5 - b / g).abs() < 1e-9, "{a} {b}");
    }
    let here_e = BAR.energies(&here, 0.3 * TAU / omega);
    let unit = ea / l * g * g / 0.25;
    let there_e = there.energies(&there_too, 0.3 * TAU / omega * l / c).map(|e| e / unit);
    for (a, b) in here_e.iter().zip(there_e) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    assert_eq!(BAR.closed_form(TAU / 4.1, 5), None);
    // a quarter wave in the bar
    assert_eq!(BAR.solve(TAU / 4.0, &[0.0, 1.0]), Err(NoBarSeries::Resonance(1)));
}

/// The command: points of a family with their series; a range that is widened later holds the same points as one that was asked for at once.
#[test]
fn backbones_by_boundary_elements_are_files_like_others() {
    use signorini::store::StoredFamily;
    let folder = tempfile::TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let scene = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n\
                 [[support]]\nedge = \"right\"\nfix = [\"x\"]\n[contact]\nedge = \"left\"\ngap = 0.5\n";
    std::fs::write(at("bar.toml"), scene).unwrap();
    let run = |arguments: &[&str]| {
        let output = crate::common::program()
            .current_dir(folder.path())
            .args([
                "backbone",
                "bar.toml",
                "--method",
                "bem",
                "--harmonics",
                "10,20",
                "--step",
                "0.01",
            ])
            .args(arguments)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    assert_eq!(run(&["--range", "1.7,1.9", "-o", "whole.h5"]).0, Some(0));
    assert_eq!(run(&["--range", "1.7,1.8", "-o", "parts.h5"]).0, Some(0));
    assert_eq!(run(&["--range", "1.7,1.9", "-o", "parts.h5", "--resume"]).0, Some(0));
    let read = |name: &str| StoredFamily::read(at(name).as_ref()).unwrap().points;
    let (whole, parts) = (read("whole.h5"), read("parts.h5"));
    assert_eq!(whole.len(), 42);
    for (a, b) in whole.iter().zip(&parts) {
        let energy =
            |p: &signorini::records::PointRecord| p.orbit.as_ref().map(|o| o.energy.to_bits());
        assert_eq!((a.omega, a.branch, energy(a)), (b.omega, b.branch, energy(b)));
    }
    // the contact end at the far point, from the left: u_C along the outward normal is negative there, and the series says the same
    let orbit = whole.iter().filter_map(|p| p.orbit.as_ref()).next().unwrap();
    let end = *orbit.u0.last().unwrap();
    assert!(end.abs() > 0.5 && orbit.amplitude >= end.abs() - 1e-6, "{end}");
    // with damping, loads, other bodies it is refused
    let (code, said) =
        run(&["--range", "1.7,1.8", "--omega", "1.75", "--follow", "arclength", "-o", "x.h5"]);
    assert!(code == Some(2) && said.contains("frequency by frequency"), "{said}");
    std::fs::write(at("bar.toml"), [scene, "[damping]\nrayleigh = [0.1, 0.0]\n"].concat()).unwrap();
    let (code, said) = run(&["--range", "1.7,1.8", "-o", "x.h5"]);
    assert!(code == Some(2), "{said}");
}
