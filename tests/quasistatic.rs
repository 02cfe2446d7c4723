//! The quasi-static driver: closed forms of bars on rough floors and of sliders, a block of another program, small steps that know no phases, relations between paths.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::{Splitmix, datasets, program, relative, run};
use nalgebra::{DMatrix, DVector};
use signorini::event::{Report, Silent};
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::simulate;

/// A folder with a scene and the paths of its loads.
fn folder(scene: &str, paths: &[(&str, &[(f64, f64)])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, corners) in paths {
        let lines: Vec<String> = corners.iter().map(|(t, f)| format!("{t:?},{f:?}")).collect();
        std::fs::write(folder.path().join(name), lines.join("\n")).unwrap();
    }
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

fn report_of(folder: &Path) -> (Problem, Report) {
    let scene = Scene::read(&folder.join("scene.toml")).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    assert!(report.energy_drift_total < 1e-12, "{} {text}", report.energy_drift_total);
    assert!(report.is_certified(), "{:?}", report.proof);
    (problem, report)
}

fn driven(scene: &str, paths: &[(&str, &[(f64, f64)])]) -> (Problem, Report) {
    report_of(folder(scene, paths).path())
}

fn work(r: &Report) -> f64 {
    r.rubbed.as_ref().unwrap().work()
}

/// Pressed by 0.2 and sheared: what an independent program found (`validate/friction`), states and all.
#[test]
fn a_block_slips_as_in_another_program() {
    let at = |until: f64| {
        let scene = format!(
            "[body]\nkind = 'plate'\nsize = [0.25, 1.0]\nelements = [6, 12]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.5\n\
             [[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.0]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 1.0]\ntable = 'shear.csv'\n\
             [run]\nquasistatic = true\nuntil = {until}\n"
        );
        driven(&scene, &[("shear.csv", &[(0.0, 0.0), (1.0, 1.0)])]).1
    };
    let [a, b, c] = [0.07, 0.08, 0.09].map(at);
    assert_eq!((a.active.to_string(), work(&a)), ("SSSSSSSSSSSSS".into(), 0.0));
    assert!(relative(&[work(&b)], &[2.516451067e-5]) < 1e-9, "{}", work(&b));
    assert!(relative(&[work(&c)], &[2.545739990e-4]) < 1e-9, "{}", work(&c));
    assert_eq!(
        [b.active.to_string(), c.active.to_string()],
        ["+SSSSSS+++SSS".to_owned(), ".SSS+++++++SS".to_owned()]
    );
}

/// A bar on a rough floor, `EA = 1`, friction `q` a length, pulled by `F`: the end moves by `F²/2qEA` on every mesh, half of it stays, and a cycle of ±F takes
/// `2F³/3qEA + h²/20`.
#[test]
fn a_bar_on_a_rough_floor_slips_as_in_closed_form() {
    let (f, q) = (0.3, 0.5);
    for m in [10, 20] {
        let h = 1.0 / m as f64;
        let slider = |k: usize| {
            let share = if k == 0 || k == m { 0.5 } else { 1.0 };
            format!("[[slider]]\nat = [{:?}]\nlimit = {:?}\n", k as f64 * h, share * q * h)
        };
        let scene = format!(
            "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [{m}]\nyoung = 1.0\ndensity = 1.0\n{}[[load]]\nkind = 'point'\nat = [1.0]\namplitude = {f}\ntable = 'pull.csv'\n",
            (0..=m).map(slider).collect::<String>()
        );
        let until = |t: f64| {
            let scene = scene.clone() + &format!("[run]\nquasistatic = true\nuntil = {t:?}\n");
            let corners = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (3.0, -1.0), (5.0, 1.0)];
            driven(&scene, &[("pull.csv", &corners)]).1
        };
        let end = |r: &Report| {
            r.last.u.iter().fold(0.0f64, |m, u| if u.abs() > m.abs() { *u } else { m })
        };
        let [pulled, unloaded, pushed, again] = [1.0, 2.0, 3.0, 5.0].map(until);
        assert!((end(&pulled) - 0.09).abs() < 1e-13, "{m}: {}", end(&pulled));
        let tip = unloaded.last.u[m];
        assert!((tip - 0.045).abs() < 1e-13, "{m}: {tip}");
        assert!((end(&pushed) + 0.09).abs() < 1e-13, "{m}: {}", end(&pushed));
        let cycle = work(&again) - work(&pulled);
        let closed = 2.0 * f * f * f / (3.0 * q) + 0.05 * h * h;
        println!("{m}: {cycle} {closed}");
        assert!((cycle - closed).abs() < 1e-13, "{m}: {cycle} {closed}");
    }
}

/// A spring beside Jenkins sliders under a force: Masing's rule, turning points and loss in closed form.
#[test]
fn sliders_with_springs_obey_masing() {
    let scene = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 2.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                 [[slider]]\nat = [1.0]\nlimit = 0.5\nstiffness = 3.0\n[[load]]\nkind = 'point'\nat = [1.0]\namplitude = 1.0\ntable = 'f.csv'\n[run]\nquasistatic = true\nuntil = 3.0\n";
    let corners = [(0.0, 0.0), (1.0, 1.5), (2.0, -1.5), (3.0, 1.5)];
    let (_, report) = driven(scene, &[("f.csv", &corners)]);
    let top = (1.5 - 0.5) / 2.0;
    assert!((report.last.u[0] - top).abs() < 1e-14, "{:?}", report.last.u);
    // to the first turn it slides from f_s/k_t on, then by the width less 2 f_s/k_t each way
    let slides = (top - 0.5 / 3.0) + 2.0 * (2.0 * top - 1.0 / 3.0);
    assert!((work(&report) - 0.5 * slides).abs() < 1e-14, "{} {slides}", work(&report));
    // it breaks loose at u = f_s/k_t, f = 5/6
    assert!((report.switches[0].t - 5.0 / 9.0).abs() < 1e-14, "{}", report.switches[0].t);
}

const PLATE: &str = "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n";

/// A plate with random friction, presses, belts and paths.
fn random_plate(random: &Splitmix) -> (String, BTreeMap<String, Vec<(f64, f64)>>) {
    let support = random.pick(&["", "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n"]);
    let mu = random.pick(&[0.2, 0.5, 0.9]);
    let gap = if support.is_empty() { 0.0 } else { random.pick(&[-0.02, 0.01]) };
    let press = if support.is_empty() { 0.3 } else { random.pick(&[0.0, 0.1]) };
    let edge = if support.is_empty() { "left" } else { "top" };
    let most = if support.is_empty() { 0.5 * mu * press } else { 0.1 };
    let belt = if support.is_empty() { 0.0 } else { random.pick(&[0.0, 0.02]) };
    let scene = format!(
        "{PLATE}{support}[contact]\nedge = 'right'\ngap = {gap}\nfriction = {mu}\nsurface = [0.0, {belt}]\n\
         [[load]]\nkind = 'traction'\nedge = '{edge}'\namplitude = [{press}, 0.0]\n[[load]]\nkind = 'traction'\nedge = '{edge}'\namplitude = [0.0, {most}]\ntable = 'y.csv'\n\
         [[load]]\nkind = 'traction'\nedge = '{edge}'\namplitude = [{}, 0.0]\ntable = 'x.csv'\n[run]\nquasistatic = true\nuntil = 3.0\nsamples = 6\n",
        0.3 * press + 0.02
    );
    let path = || {
        let mut corners = vec![(0.0, 0.0)];
        corners.extend(
            [0.7, 1.4, 2.2, 3.0].map(|t| (t, 2.0 * random.below(1001) as f64 / 1000.0 - 1.0)),
        );
        corners
    };
    (scene, [("x.csv".to_owned(), path()), ("y.csv".to_owned(), path())].into())
}

fn borrowed(paths: &BTreeMap<String, Vec<(f64, f64)>>) -> Vec<(&str, &[(f64, f64)])> {
    paths.iter().map(|(name, corners)| (name.as_str(), &corners[..])).collect()
}

/// The same by small steps that know neither phases nor events: in each the increments of the contact points are found by projected Gauss–Seidel on the condensed body.
fn by_steps(problem: &Problem, paths: &BTreeMap<String, Vec<(f64, f64)>>, steps: usize) -> f64 {
    let system = &problem.system;
    let (n, n_c) = (system.n(), system.n_contact());
    let dense = |a: &signorini::fem::Csr| {
        let mut d = DMatrix::<f64>::zeros(n, n);
        a.triplets().for_each(|(i, j, v)| d[(i, j)] += v);
        d
    };
    let k = dense(&system.body.stiffness);
    // free bodies are held by what their contact points are held by: a weak spring on all, far below what is compared
    let weak = 1e-9 * k.diagonal().max();
    let inverse = (&k + weak * DMatrix::identity(n, n)).try_inverse().unwrap();
    let normal: Vec<DVector<f64>> = (0..n_c)
        .map(|i| {
            let mut unit = DVector::zeros(n);
            unit[system.n_o() + i] = 1.0;
            unit
        })
        .collect();
    let tangents = system.tangents().unwrap();
    let along: Vec<Option<DVector<f64>>> = tangents
        .iter()
        .map(|t| {
            t.as_ref().map(|t| {
                let mut row = DVector::zeros(n);
                t.row.iter().for_each(|&(j, w)| row[j] = w);
                row
            })
        })
        .collect();
    let value = |corners: &[(f64, f64)], t: f64| {
        let i = corners.iter().position(|c| c.0 >= t).unwrap_or(corners.len() - 1).max(1);
        let ((ta, a), (tb, b)) = (corners[i - 1], corners[i]);
        a + (b - a) * (t - ta) / (tb - ta)
    };
    // in the order of the scene: y, then x
    let histories = [&paths["y.csv"], &paths["x.csv"]];
    let force = |t: f64| {
        let mut f = DVector::from_vec(system.loads.constant.clone().unwrap_or(vec![0.0; n]));
        for (load, corners) in system.loads.measured.iter().zip(histories) {
            f += value(corners, t) * DVector::from_column_slice(&load.force);
        }
        f
    };
    let (mut r_n, mut r_t) = (vec![0.0; n_c], vec![0.0; n_c]);
    let mut last: Vec<f64> = vec![0.0; n_c];
    let mut lost = 0.0;
    for step in 0..=steps {
        let t = 3.0 * step as f64 / steps as f64;
        let mut u = &inverse * force(t);
        for i in 0..n_c {
            u -= &inverse * (r_n[i] * &normal[i]);
            if let Some(row) = &along[i] {
                u -= &inverse * (r_t[i] * row);
            }
        }
        // a surface that moves has done so for long
        let dt = if step == 0 { 1e6 } else { 3.0 / steps as f64 };
        for _ in 0..4000 {
            let mut change = 0.0f64;
            for i in 0..n_c {
                let column = &inverse * &normal[i];
                let gap = system.constraints[i].gap - normal[i].dot(&u);
                let new = (r_n[i] - gap / normal[i].dot(&column)).max(0.0);
                u -= (new - r_n[i]) * &column;
                change = change.max((new - r_n[i]).abs());
                r_n[i] = new;
                let Some(row) = &along[i] else { continue };
                let column = &inverse * row;
                let tangent = tangents[i].as_ref().unwrap();
                let slip = row.dot(&u) - last[i] - tangent.surface * dt;
                let limit = tangent.coefficient * r_n[i];
                let new = (r_t[i] + slip / row.dot(&column)).clamp(-limit, limit);
                u -= (new - r_t[i]) * &column;
                change = change.max((new - r_t[i]).abs());
                r_t[i] = new;
            }
            if change < 1e-13 {
                break;
            }
        }
        for i in 0..n_c {
            let Some(row) = &along[i] else { continue };
            let now = row.dot(&u);
            if step > 0 {
                lost += r_t[i] * (now - last[i] - tangents[i].as_ref().unwrap().surface * dt);
            }
            last[i] = now;
        }
    }
    lost
}

/// Twelve random scenes against small steps: what friction takes, to the order of the step.
#[test]
fn random_paths_are_those_of_small_steps() {
    let random = Splitmix::new(36);
    let (mut switches, mut compared) = (0, 0);
    for k in 0..12 {
        // what projected sweeps converge on
        let (scene, paths) = loop {
            let (scene, paths) = random_plate(&random);
            if scene.contains("[[support]]") {
                break (scene, paths);
            }
        };
        let (problem, report) = driven(&scene, &borrowed(&paths));
        switches += report.switches.len();
        let exact = work(&report);
        let [coarse, fine] =
            [150, 600].map(|steps| (by_steps(&problem, &paths, steps) - exact).abs());
        println!(
            "{k}: {exact:.6e}, {} switches, off by {coarse:.1e}, {fine:.1e}",
            report.switches.len()
        );
        let size = exact.abs().max(report.energy_end.abs()).max(1e-4);
        assert!(
            fine < 2e-2 * size && fine < 0.5 * coarse.max(1e-4 * size),
            "{k}: {coarse:.1e} {fine:.1e} of {size:.1e}"
        );
        compared += usize::from(exact > 1e-3 * size);
    }
    assert!(switches > 60 && compared > 6, "{switches} {compared}");
}

/// A path has no clock and no grain: three times as slow, and with more corners on its lines, it is the same; without friction only its end counts.
#[test]
fn paths_have_no_clock() {
    let random = Splitmix::new(37);
    for k in 0..20 {
        let (scene, paths) = random_plate(&random);
        let (_, report) = driven(&scene, &borrowed(&paths));
        let mut slow = paths.clone();
        slow.values_mut().flatten().for_each(|c| c.0 *= 3.0);
        let slowly = scene.replace("until = 3.0", "until = 9.0");
        let still = scene.contains("surface = [0.0, 0]");
        let mut cut = paths.clone();
        for corners in cut.values_mut() {
            let middle =
                |w: &[(f64, f64)]| [w[0], (0.5 * (w[0].0 + w[1].0), 0.5 * (w[0].1 + w[1].1))];
            let end = corners[corners.len() - 1];
            *corners = corners.windows(2).flat_map(middle).chain([end]).collect();
        }
        let mut others = vec![driven(&scene, &borrowed(&cut)).1];
        if still {
            others.push(driven(&slowly, &borrowed(&slow)).1);
        }
        for other in others {
            assert!(relative(&other.last.u, &report.last.u) < 1e-9, "{k}");
            assert!(
                (work(&other) - work(&report)).abs() < 1e-10 * (work(&report) + report.energy_end),
                "{k}"
            );
        }
        let law = "method = 'mass-redistribution' # friction = 0.";
        let smooth = scene.replace("friction = 0.", law).replace("surface", "# surface");
        if smooth.contains("[[support]]") {
            let whole = driven(&smooth, &borrowed(&paths)).1;
            let mut ends = paths.clone();
            ends.values_mut().for_each(|c| *c = vec![c[0], c[c.len() - 1]]);
            let straight = driven(&smooth, &borrowed(&ends)).1;
            assert!(relative(&whole.last.u, &straight.last.u) < 1e-10, "{k}");
        }
    }
}

/// Files, resumption, what is refused; a run that nothing holds any more ends where it breaks away.
#[test]
fn a_quasistatic_run_is_a_run() {
    let random = Splitmix::new(38);
    let (scene, paths) = loop {
        let (scene, paths) = random_plate(&random);
        if driven(&scene, &borrowed(&paths)).1.switches.len() > 10 {
            break (scene, paths);
        }
    };
    let place = folder(&scene, &borrowed(&paths));
    let call = |output: &str, more: &[&str], look: Option<&str>| {
        let mut command = program();
        command
            .current_dir(place.path())
            .args(["run", "scene.toml", "-q", "-o", output])
            .args(more);
        look.map(|look| command.env("SIGNORINI_AT_LOOK", look));
        command.status().unwrap().code()
    };
    assert_eq!(call("whole.h5", &[], None), Some(0));
    assert_eq!(call("parts.h5", &[], Some("INT 5")), Some(130));
    assert_eq!(call("parts.h5", &["--resume"], None), Some(0));
    let [whole, parts] = ["whole.h5", "parts.h5"].map(|name| datasets(&place.path().join(name)));
    for (name, value) in &whole {
        assert!(parts[name] == *value, "{name}");
    }
    // readers and pictures take it: one row a time
    assert!(run(&["plot", place.path().join("whole.h5").to_str().unwrap()]).status.success());
    let gone = PLATE.to_owned()
        + "[contact]\nedge = 'right'\ngap = 0.0\nfriction = 0.5\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.2, 0.0]\n[[load]]\nkind = 'traction'\nedge = 'left'\namplitude = [0.0, 1.0]\ntable = 'y.csv'\n[run]\nquasistatic = true\nuntil = 1.0\n";
    let place = folder(&gone, &[("y.csv", &[(0.0, 0.0), (1.0, 1.0)])]);
    let path = place.path().join("scene.toml");
    let out =
        run(&["run", path.to_str().unwrap(), "-o", place.path().join("o.h5").to_str().unwrap()]);
    let said =
        String::from_utf8_lossy(&out.stderr).into_owned() + &String::from_utf8_lossy(&out.stdout);
    assert_eq!(out.status.code(), Some(3), "{said}");
    assert!(run(&["plot", place.path().join("o.h5").to_str().unwrap()]).status.success());
    // all slip where the shear is μ times the pressure
    assert!(said.contains("0.1000000") || said.contains("0.09999999"), "{said}");
    for (from, to, words) in [
        ("table = 'y.csv'", "omega = 1.0", "load[1].omega"),
        ("[run]", "[initial]\nmode = 1\namplitude = 0.5\n[run]", "initial"),
        ("friction = 0.5", "method = 'impact'", "contact.method"),
    ] {
        std::fs::write(&path, gone.replace(from, to)).unwrap();
        let out = run(&[
            "run",
            path.to_str().unwrap(),
            "-o",
            place.path().join("x.h5").to_str().unwrap(),
        ]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && said.contains(words), "{words}: {said}");
    }
}
