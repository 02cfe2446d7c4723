//! Harmonic balance with friction: closed forms, orbits in time, alternating frequency–time with samples that know no events.

use std::f64::consts::TAU;

use crate::common::{json, problem, program, random, run};
use signorini::continuation::Family;
use signorini::hbm::amplitudes::{Amplitudes, follow};
use signorini::hbm::damped::DampedMode;
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{Harmonics, Track, Walk, sequential};
use signorini::hbm::{Balanced, Form, Series, Solution, prepare};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::records::PointRecord;

/// `m = 1` on a spring `k` under `F cos ωt`.
fn oscillator(k: f64, tables: &str, (f, omega): (f64, f64)) -> String {
    format!(
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = {k:?}\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n{tables}\
         [[load]]\nkind = 'point'\nat = [1.0]\namplitude = {f:?}\nomega = {omega:?}\n"
    )
}

/// JuliaJIM's oscillator: a slider of limit 1 with a spring 5.
fn jenkins(omega: f64) -> String {
    let tables =
        "[damping]\nrayleigh = [0.02, 0.0]\n[[slider]]\nat = [1.0]\nlimit = 1.0\nstiffness = 5.0\n";
    oscillator(4.0, tables, (0.1, omega))
}

/// A plate held on the left, with a rough wall on the right that it presses, or meets.
pub fn plate(gap: f64, load: [f64; 2], more: &str) -> String {
    let [x, y] = load;
    format!(
        "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
         [damping]\nrayleigh = [0.1, 0.02]\n[contact]\nedge = 'right'\ngap = {gap:?}\nfriction = 0.4\n\
         [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [{x:?}, {y:?}]\nomega = 2.1\n{more}"
    )
}

fn body(text: &str) -> Box<dyn Balanced> {
    prepare(problem(text).system, Form::Acceleration).unwrap()
}

/// The solution of so many harmonics, from nothing.
fn from_rest(body: &mut dyn Balanced, n_h: usize, omega: f64) -> Solution {
    let (harmonics, grid, settings) = ([n_h], [omega], Settings::default());
    let walk = Walk::new(&harmonics, &grid, &settings);
    let (mut tracks, mut found) = (vec![Track::default(); 2], None);
    sequential(body, &walk, &mut tracks, |_, p| {
        found = Some(p.solution);
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    found.unwrap().unwrap()
}

/// Largest of a scalar series.
fn largest(u: &Series) -> f64 {
    (0..20_000).map(|k| u.at(TAU * f64::from(k) / 2e4).0[0].abs()).fold(0.0, f64::max)
}

/// Forces of a slider with a spring are those of its play: amplitudes against an independent march, errors like `N_h⁻³`; and the equations hold with forces that are
/// sampled in the form of NLvib and others, step by step, without events.
#[test]
fn a_jenkins_element_is_balanced_exactly() {
    let found = [
        (2.94, 0.212305195004),
        (2.96, 0.214393681635),
        (2.98, 0.214692204523),
        (3.0, 0.213898058872),
    ];
    for (omega, wanted) in found {
        let mut errors = vec![];
        for n_h in [1, 7, 31] {
            let mut body = body(&jenkins(omega));
            let s = from_rest(body.as_mut(), n_h, omega);
            assert!(
                s.residual < 1e-13 && s.crossings.len() == 4,
                "{} {:?}",
                s.residual,
                s.crossings
            );
            let u = body.displacements(&s).unwrap();
            let u = Series { n: 1, a: u.component(0), ..u };
            errors.push((largest(&u) - wanted).abs());
            let off = sampled_residual(&u, omega);
            assert!(off < 1e-8, "{omega}, N_h = {n_h}: {off:e}");
        }
        println!("{omega}: {errors:?}");
        assert!(errors[0] < 1e-4 && errors[1] < 2e-6 && errors[2] < 2e-8, "{errors:?}");
    }
}

/// `‖D q + N − f‖` of the Jenkins oscillator with the force sampled at many instants of the second of two periods.
fn sampled_residual(u: &Series, omega: f64) -> f64 {
    let (samples, stiffness, limit) = (200_000, 5.0, 1.0);
    let (mut z, mut terms) = (0.0, vec![0.0; u.a.len()]);
    let mut f = vec![];
    for k in 0..2 * samples {
        let theta = TAU * f64::from(k % samples) / f64::from(samples);
        let trial = stiffness * (u.at(theta).0[0] - z);
        let force = f64::clamp(trial, -limit, limit);
        z += (trial - force) / stiffness;
        if k >= samples {
            u.basis.values(u.n_h, theta, &mut f);
            let weight = |i: usize| if i == 0 { 1.0 } else { 2.0 } / f64::from(samples);
            terms
                .iter_mut()
                .zip(&f)
                .enumerate()
                .for_each(|(i, (t, f))| *t += weight(i) * force * f);
        }
    }
    terms[0] += 4.0 * u.a[0];
    for k in 1..=u.n_h {
        let kw = k as f64 * omega;
        let (a, b) = (u.a[2 * k - 1], u.a[2 * k]);
        terms[2 * k - 1] += (4.0 - kw * kw) * a + 0.02 * kw * b;
        terms[2 * k] += (4.0 - kw * kw) * b - 0.02 * kw * a;
    }
    terms[1] -= 0.1;
    terms.iter().map(|t| t * t).sum::<f64>().sqrt()
}

/// Den Hartog's amplitudes without a stop: forces of a point that comes to rest jump, and errors fall like `1/N_h`.
#[test]
fn dry_friction_converges_like_one_over_the_harmonics() {
    for (r, limit) in [(0.8, 0.3), (1.25, 0.3), (1.5, 0.5), (2.0, 0.4)] {
        let (v, angle) = (1.0 / (1.0 - r * r), std::f64::consts::PI / r);
        let w = angle.sin() / (r * (1.0 + angle.cos()));
        let wanted = f64::sqrt(v * v - limit * limit * w * w);
        let errors: Vec<f64> = [15, 31, 63]
            .into_iter()
            .map(|n_h| {
                let slider = format!("[[slider]]\nat = [1.0]\nlimit = {limit:?}\n");
                let mut body = body(&oscillator(1.0, &slider, (1.0, r)));
                let s = from_rest(body.as_mut(), n_h, r);
                (largest(&body.displacements(&s).unwrap()) - wanted) / wanted
            })
            .collect();
        println!("{r}: {errors:?}");
        assert!(errors[2].abs() < 5e-3);
        for pair in errors.windows(2) {
            let ratio = pair[1] / pair[0];
            assert!((0.45..0.55).contains(&ratio), "{r}: {errors:?}");
        }
    }
}

/// The Jacobian of the balance against central differences, where springs are played and forces are unknowns, with contact that opens.
#[test]
fn jacobians_are_exact() {
    let slider = "[[slider]]\nat = [0.25, 1.0]\ndirection = [0.0, 1.0]\nlimit = 0.01\n";
    let spring = "[[slider]]\nat = [0.25, 0.5]\ndirection = [0.0, 1.0]\nlimit = 0.01\nstiffness = 0.7\n[[damper]]\nat = [0.25, 1.0]\ndirection = [1.0, 0.0]\nviscosity = 0.1\n";
    for text in [
        plate(-0.02, [0.0, 0.1], ""),
        plate(0.01, [0.1, 0.1], slider),
        plate(0.01, [0.1, 0.1], spring),
    ] {
        let (n_h, omega) = (5, 2.1);
        let mut body = body(&text);
        let s = from_rest(body.as_mut(), n_h, omega);
        let mut family = Harmonics { body: body.as_mut(), n_h };
        let mut x = Harmonics::unknowns(&s);
        let size = x[..x.len() - 1].iter().map(|n| n * n).sum::<f64>().sqrt();
        let noise = random(x.len(), 5);
        let last = x.len() - 1;
        x.iter_mut().zip(&noise).take(last).for_each(|(x, n)| *x += 1e-3 * size * n);
        let (r, j) = family.linearise(&x).unwrap();
        let h = 1e-7;
        let mut worst = 0.0f64;
        for k in 0..4 {
            let mut d = random(x.len(), 60 + k);
            d[last] = 0.0;
            let mut at = |s: f64| {
                let y: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + s * d).collect();
                family.residual(&y).unwrap()
            };
            let (up, down) = (at(h), at(-h));
            let exact: Vec<f64> =
                (0..r.len()).map(|i| (0..x.len()).map(|c| j[(i, c)] * d[c]).sum()).collect();
            let scale = exact.iter().fold(0.0f64, |m, e| m.max(e.abs()));
            for i in 0..r.len() {
                worst = worst.max(((up[i] - down[i]) / (2.0 * h) - exact[i]).abs() / scale);
            }
        }
        println!("Jacobian against differences {worst:.1e}");
        assert!(worst < 1e-6, "{worst:e}");
    }
}

/// How far a body's series are from the orbits that shooting finds from them, over the orbits.
fn distances(text: &str, harmonics: &[usize], omega: f64) -> Vec<f64> {
    let mut shooter = Propagator::new(problem(text).system).unwrap();
    shooter.system.loads_mut().set_frequency(omega);
    let of = |n_h: &usize| {
        let mut body = body(text);
        let s = from_rest(body.as_mut(), *n_h, omega);
        let u = body.displacements(&s).unwrap();
        let (u, v) = u.at(0.0);
        let v = v.iter().map(|v| omega * v).collect();
        let z = shooter.frame(&signorini::contact::State { u, v });
        let verdict = find(&mut shooter, Closure::FORCED, &z, omega, &Effort::default()).unwrap();
        let orbit = verdict.orbit().unwrap_or_else(|| panic!("{verdict}"));
        let size = orbit.z.iter().map(|z| z * z).sum::<f64>().sqrt();
        orbit.z.iter().zip(&z).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size
    };
    harmonics.iter().map(of).collect()
}

/// Coulomb's friction at a wall that is pressed, or met and left; dampers and modal ratios; a block that nothing holds: series converge to the orbits in time.
#[test]
fn series_converge_to_the_orbits() {
    let dampers = "[[damper]]\nedge = 'top'\ndirection = [0.0, 1.0]\nviscosity = 0.3\n";
    let rayleigh = "[damping]\nrayleigh = [0.1, 0.02]\n";
    let modal = plate(0.01, [0.05, 0.1], "").replace(rayleigh, "[damping]\nmodal = 0.05\n");
    let smooth = modal.replace("friction = 0.4\n", "stress = 'reaction'\ninertia = 'constant'\n");
    let block = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[contact]\nedge = 'bottom'\ngap = 0.0\nfriction = 0.5\n\
                 [damping]\nrayleigh = [0.3, 0.02]\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.0, -0.2]\n\
                 [[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.06, 0.0]\nomega = 2.1\n";
    for (what, text, most) in [
        ("pressed", plate(-0.02, [0.0, 0.1], ""), 1e-2),
        ("met and left", plate(0.01, [0.05, 0.1], dampers), 1e-2),
        ("modal ratios", modal, 1e-2),
        ("without friction", smooth, 1e-3),
        ("a block", block.to_owned(), 2e-2),
    ] {
        let off = distances(&text, &[3, 7, 15], 2.1);
        println!("{what}: {off:?}");
        assert!(off[2] < most && off[2] < 0.5 * off[0], "{what}: {off:?}");
    }
}

/// `response --method hbm` and `crosscheck` of a body on sliders; foreign series know nothing of what springs remember.
#[test]
fn series_are_confronted_with_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, series, checked) = (path("jenkins.toml"), path("series.h5"), path("checked.h5"));
    std::fs::write(&scene, jenkins(2.96)).unwrap();
    let range = ["--range", "2.94,2.98", "--harmonics", "7"];
    let hbm = ["response", &scene, "--method", "hbm", "-q", "-o", &series];
    let said = json(&[&hbm[..], &range].concat());
    let points = said["points"].as_array().unwrap();
    assert!(points.len() == 10 && points.iter().all(|p| p["switches"] == 4));
    let csv = path("series.csv");
    let file = hdf5::File::open(&series).unwrap();
    let of_all: Vec<f64> = file.dataset("hbm/coefficients").unwrap().read_raw().unwrap();
    let omega: Vec<f64> = file.dataset("hbm/omega").unwrap().read_raw().unwrap();
    let mut text = "point,omega,k,part,u_1\n".to_owned();
    for (p, w) in omega.iter().enumerate() {
        // 15 functions of the displacement and of what the spring remembers
        for f in 0..15usize {
            let part = if f > 0 && f % 2 == 0 { "sin" } else { "cos" };
            let c = of_all[(p * 15 + f) * 2];
            text += &format!("{p},{w:?},{},{part},{c:?}\n", f.div_ceil(2));
        }
    }
    std::fs::write(&csv, text).unwrap();
    for of in [&series, &csv] {
        let said = json(&["crosscheck", of, &scene, "-q", "--force", "-o", &checked]);
        let rows = said["points"].as_array().unwrap();
        assert_eq!(rows.len(), 10);
        for row in rows {
            assert_eq!(row["verdict"], "orbit");
            assert!(row["moved"].as_f64().unwrap() < 1e-3, "{row}");
            assert!(row["residual"].as_f64().unwrap() < 1e-2, "{row}");
        }
    }
}

/// Series of a foreign code, of a Jenkins element that it steps from sample to sample and of a law that it regularises: near orbits of the exact laws, every one of them; those of the
/// element have the amplitudes of a third program.
#[test]
fn foreign_series_with_friction_are_told_from_orbits() {
    let folder = tempfile::tempdir().unwrap();
    for (name, count, moved, residual) in [("jenkins", 4, 1e-5, 1e-3), ("coulomb", 5, 3e-3, 0.3)] {
        let [series, scene] = ["csv", "toml"].map(|end| format!("validate/foreign/{name}.{end}"));
        let checked = folder.path().join(format!("{name}.h5")).display().to_string();
        let said = json(&["crosscheck", &series, &scene, "-q", "-o", &checked]);
        let rows = said["points"].as_array().unwrap();
        assert_eq!(rows.len(), count);
        for row in rows {
            assert_eq!(row["verdict"], "orbit", "{row}");
            assert!(row["moved"].as_f64().unwrap() < moved, "{row}");
            assert!(row["residual"].as_f64().unwrap() < residual, "{row}");
        }
    }
}

/// Points of a damped nonlinear mode at some amplitudes: frequency, `α`, initial state.
fn damped_mode(text: &str, n_h: usize, grid: &[f64]) -> Vec<PointRecord> {
    let mode = DampedMode::new(problem(text).system, 0).unwrap();
    let settings = Settings::default();
    let mut found = vec![];
    follow(&mode, &Amplitudes { grid, n_h, settings: &settings }, &[], |p| {
        found.push(p);
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    found
}

/// The damped nonlinear mode of a Jenkins oscillator: with one harmonic the describing function, `ω² = k + k_eq(X)` and `α = 4L(X − L/k_t)/(πωX²)`; with 31 the motion in
/// time, marched in small steps under `−αu̇`, comes back.
#[test]
fn a_damped_nonlinear_mode_has_the_frequency_and_the_ratio_of_its_amplitude() {
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 4.0\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [[slider]]\nat = [1.0]\nlimit = 1.0\nstiffness = 5.0\n";
    let (k, spring, limit) = (4.0f64, 5.0f64, 1.0f64);
    let grid = [0.1, 0.19, 0.21, 0.3, 0.5, 1.0, 3.0, 10.0];
    for (p, x) in damped_mode(text, 1, &grid).iter().zip(grid) {
        let orbit = p.orbit.as_ref().unwrap();
        let alpha = orbit.viscous.as_ref().unwrap().alpha;
        let slip = limit / spring;
        let (stiffness, loss) = match x > slip {
            false => (spring, 0.0),
            true => {
                let angle = (1.0 - 2.0 * slip / x).acos();
                let pi = std::f64::consts::PI;
                let stiffness = spring / pi * (angle - 0.5 * (2.0 * angle).sin());
                (stiffness, 4.0 * limit * (x - slip) / (pi * x * x))
            }
        };
        let omega = (k + stiffness).sqrt();
        assert!((p.omega - omega).abs() < 1e-11, "{x}: {} {omega}", p.omega);
        assert!((alpha - loss / omega).abs() < 1e-11, "{x}: {alpha} {}", loss / omega);
    }
    for p in damped_mode(text, 31, &grid) {
        let orbit = p.orbit.as_ref().unwrap();
        let (alpha, steps) = (orbit.viscous.as_ref().unwrap().alpha, 400_000);
        let h = TAU / p.omega / f64::from(steps);
        let (u0, v0) = (orbit.u0[0], orbit.v0[0]);
        let (mut u, mut v, mut z) = (u0, v0, orbit.u0[1]);
        for _ in 0..steps {
            // the midpoint rule of the second order
            let middle = u + 0.5 * h * v;
            let trial = spring * (middle - z);
            let force = trial.clamp(-limit, limit);
            z += (trial - force) / spring;
            let a = -k * middle - force;
            let next = (v * (1.0 + 0.5 * h * alpha) + h * a) / (1.0 - 0.5 * h * alpha);
            u = middle + 0.5 * h * next;
            v = next;
        }
        let size = u0.abs() + v0.abs() / p.omega;
        let off = ((u - u0).abs() + (v - v0).abs() / p.omega) / size;
        println!("omega {} zeta {}: {off:.1e}", p.omega, 0.5 * alpha / p.omega);
        assert!(off < 3e-6, "{}: {off:e}", p.omega);
    }
}

/// `backbone --amplitudes`: one mode of the Brake–Reuß beam on an Iwan element has the published frequencies and ratios that it was fitted to; an interrupted family goes on; what has
/// no such mode is refused.
#[test]
fn damped_modes_are_families() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let file = path("damped.h5");
    let scene = "scenarios/brake-reuss.toml";
    let asked = ["--method", "hbm", "--harmonics", "7", "-q", "--force", "-o", &file];
    for (amplitude, omega, zeta) in [
        ("9.73e-8,1e-6", 1058.731, 8.728e-4),
        ("1.7092e-6,1e-5", 1057.968, 1.3277e-3),
        ("6.74e-5,1e-4", 984.411, 3.0630e-2),
    ] {
        let options = ["backbone", scene, "--amplitudes", amplitude, "--step", "1"];
        let said = json(&[&options[..], &asked].concat());
        let first = &said["points"][0];
        let number = |key: &str| first[key].as_f64().unwrap();
        assert!((number("omega") / omega - 1.0).abs() < 2e-4, "{first}");
        assert!((number("zeta") / zeta - 1.0).abs() < 0.07, "{first}");
        assert!(number("residual") < 1e-13);
    }
    let (part, whole) = (path("part.h5"), path("whole.h5"));
    let family = |out: &str, more: &[&str]| {
        let options = ["backbone", scene, "--amplitudes", "1e-6,1e-4", "--method", "hbm"];
        let all = [&options[..], &["--harmonics", "1,7", "-q", "-o", out], more].concat();
        let mut program = program();
        program.args(all);
        program
    };
    assert!(family(&whole, &[]).status().unwrap().success());
    let mut ended = family(&part, &["--threads", "1"]);
    ended.env("SIGNORINI_AT_LOOK", "INT 12");
    assert!(!ended.status().unwrap().success());
    assert!(family(&part, &["--resume"]).status().unwrap().success());
    let read = |name: &str, what: &str| -> Vec<f64> {
        hdf5::File::open(name).unwrap().dataset(what).unwrap().read_raw().unwrap()
    };
    for what in ["backbone/omega", "backbone/amplitude", "hbm/coefficients"] {
        assert_eq!(read(&part, what), read(&whole, what), "{what}");
    }
    // more sliders than displacements
    for (picture, arguments) in [
        ("page.html", vec!["view", &whole, "-q", "-o"]),
        ("table.csv", vec!["export", &whole, "-q", "-o"]),
    ] {
        let out = path(picture);
        assert!(run(&[&arguments[..], &[&out]].concat()).status.success(), "{picture}");
    }
    assert!(run(&["plot", &whole, "-q"]).status.success());
    let loaded = path("loaded.toml");
    std::fs::write(&loaded, jenkins(2.96)).unwrap();
    for (arguments, words) in [
        (&["backbone", scene, "--amplitudes", "1e-6,1e-4"][..], "--method hbm"),
        (&["backbone", scene, "--amplitudes", "1e-4", "--method", "hbm"], "two displacements"),
        (&["backbone", &loaded, "--amplitudes", "0.1,1", "--method", "hbm"], "changes in time"),
        (
            &[
                "backbone",
                "scenarios/half-plate-orbit.toml",
                "--amplitudes",
                "0.1,1",
                "--method",
                "hbm",
            ],
            "has no friction",
        ),
        (&["backbone", scene, "--viscous", "--range", "900,1000"], "--amplitudes"),
    ] {
        let out = run(arguments);
        let said = String::from_utf8_lossy(&out.stderr).replace("│ ", "");
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{words}: {said}");
    }
}
