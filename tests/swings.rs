//! Gaps that move from place to place: against a motion of the whole obstacle, against a slow integration of their own equations.

use std::path::{Path, PathBuf};

use serde_json::Value;
use signorini::contact::System;
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::store::Stored;

use crate::common::json;

/// Write a scene, run it, and read what came out.
fn ran(folder: &Path, name: &str, text: &str) -> (PathBuf, Value, Stored) {
    let scene = folder.join(format!("{name}.toml"));
    std::fs::write(&scene, text).unwrap();
    let out = folder.join(format!("{name}.h5"));
    let said = json(&["run", scene.to_str().unwrap(), "-o", out.to_str().unwrap(), "--force"]);
    let stored = Stored::read(&out).unwrap();
    (scene, said, stored)
}

/// A plate that is held at its left and faces an obstacle above.
fn plate(contact: &str, rest: &str) -> String {
    format!(
        r#"
[body]
kind = "plate"
size = [2.0, 1.0]
elements = [6, 3]
young = 1.0
poisson = 0.3
density = 1.0

[[support]]
edge = "left"
fix = ["x", "y"]

[contact]
edge = "right"
{contact}

[run]
until = 20.0
samples = 200

{rest}
"#
    )
}

const LOAD: &str = r#"
[[load]]
kind = "traction"
edge = "top"
amplitude = [0.02, 0.01]
omega = 0.55
"#;

/// A gap that swings alike at all places is an obstacle that moves as a whole, which is computed in a frame of its own: same switches, same forces, same motion of
/// every node when the frame is added.
#[test]
fn a_gap_that_swings_as_a_whole_is_an_obstacle_that_moves() {
    let folder = tempfile::tempdir().unwrap();
    for damping in ["", "[damping]\nrayleigh = [0.01, 0.05]\n"] {
        let rest = format!("{LOAD}\n{damping}\n[[probe]]\nname = \"tip\"\nat = [2.0, 0.9]\n");
        let method = "stress = \"reaction\"\ninertia = \"constant\"";
        let whole = format!(
            "gap = 0.1\n{method}\nmotion = {{ amplitude = 0.08, omega = 0.9, phase = 0.4 }}"
        );
        let own = "gap = \"0.1 + 0.08*cos(0.4 + 0.9*t)\"".to_owned();
        let mut found = vec![];
        for (name, contact) in [("whole", whole), ("own", own)] {
            found.push(ran(folder.path(), name, &plate(&contact, &rest)));
        }
        let [(_, a, whole), (_, _, own)] = <[_; 2]>::try_from(found).ok().unwrap();
        assert!(whole.switch_t.len() > 10, "{a}");
        assert_eq!(whole.switch_t.len(), own.switch_t.len());
        for (s, t) in whole.switch_t.iter().zip(&own.switch_t) {
            assert!((s - t).abs() < 1e-8 * t.max(1.0), "{s} {t}");
        }
        for (s, t) in whole.pressure.iter().zip(&own.pressure) {
            assert!((s - t).abs() < 1e-8, "{s} {t}");
        }
        let held = |s: &Stored, n: usize| s.place(n)[0] == 0.0;
        for (row, t) in whole.t.iter().enumerate() {
            let [moved, rate] = [0.08 * (0.4 + 0.9 * t).cos(), -0.072 * (0.4 + 0.9 * t).sin()];
            for node in (0..whole.nodes.nrows()).filter(|n| !held(&whole, *n)) {
                let (x, y) = (whole.displacement(row, node), own.displacement(row, node));
                let (v, w) = (whole.velocity(row, node), own.velocity(row, node));
                assert!((x[0] + moved - y[0]).abs() < 1e-8 && (x[1] - y[1]).abs() < 1e-8, "{t}");
                assert!((v[0] + rate - w[0]).abs() < 1e-7 && (v[1] - w[1]).abs() < 1e-7, "{t}");
            }
            for i in 0..own.gap.len() {
                let [x, y] = [&whole, &own].map(|s| s.contact_displacement(row, i));
                assert!((x - y).abs() < 1e-8);
            }
        }
        // probes see the body at rest
        let probe = own.probes.iter().find(|p| p.quantity.name() == "displacement").unwrap();
        let node = |s: &Stored, y: f64| {
            let at = |n: &usize| s.place(*n)[0] == 2.0 && (s.place(*n)[1] - y).abs() < 1e-9;
            (0..s.nodes.nrows()).find(at).unwrap()
        };
        let [corner, below] = [1.0, 2.0 / 3.0].map(|y| node(&own, y));
        for (row, _) in own.t.iter().enumerate() {
            let [a, b] = [corner, below].map(|n| own.displacement(row, n)[0]);
            let (at, seen) = (a + (b - a) * 0.3, probe.values[(row, 0)]);
            assert!((seen - at).abs() < 1e-9, "{seen} {at}");
        }
    }
}

/// What a system is made of, as dense rows.
struct Dense {
    k: Vec<Vec<f64>>,
    m: Vec<Vec<f64>>,
    n_o: usize,
}

impl Dense {
    fn of(system: &System) -> Dense {
        let n = system.n();
        let rows = |matrix: &signorini::fem::Csr| -> Vec<Vec<f64>> {
            let row = |i: usize| {
                let mut row = vec![0.0; n];
                matrix.row(i).for_each(|(j, x)| row[j] += x);
                row
            };
            (0..n).map(row).collect()
        };
        Dense { k: rows(&system.body.stiffness), m: rows(system.mass()), n_o: system.n_o() }
    }

    fn dot(row: &[f64], x: &[f64]) -> f64 {
        row.iter().zip(x).map(|(a, b)| a * b).sum()
    }
}

/// Gauss's elimination with pivots.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for c in 0..n {
        let p = (c..n).max_by(|&i, &j| a[i][c].abs().total_cmp(&a[j][c].abs())).unwrap();
        a.swap(c, p);
        b.swap(c, p);
        for i in c + 1..n {
            let f = a[i][c] / a[c][c];
            for j in c..n {
                a[i][j] -= f * a[c][j];
            }
            b[i] -= f * b[c];
        }
    }
    for c in (0..n).rev() {
        for j in c + 1..n {
            b[c] -= a[c][j] * b[j];
        }
        b[c] /= a[c][c];
    }
    b
}

/// The contact displacements at a gap, by projected Gauss-Seidel.
fn contact(d: &Dense, u: &mut [f64], gap: &[f64]) -> Vec<bool> {
    let n = u.len();
    for _ in 0..4000 {
        let mut change = 0.0f64;
        for i in d.n_o..n {
            let rest = Dense::dot(&d.k[i], u) - d.k[i][i] * u[i];
            let new = (-rest / d.k[i][i]).min(gap[i - d.n_o]);
            change = change.max((new - u[i]).abs());
            u[i] = new;
        }
        if change < 1e-15 {
            break;
        }
    }
    (d.n_o..n).map(|i| u[i] >= gap[i - d.n_o] - 1e-13).collect()
}

/// A wave that goes along the edge, with damping in proportion to mass and stiffness, against Runge-Kutta steps with the complementarity problem solved in each of them: what
/// both have in common are `M` and `K`.
#[test]
fn a_wave_along_the_edge_is_what_small_steps_give() {
    let folder = tempfile::tempdir().unwrap();
    let (alpha, beta) = (0.02, 0.1);
    let text =
        plate("gap = \"0.01 + 0.03*cos(3*y - 0.8*t)\"", "[damping]\nrayleigh = [0.02, 0.1]\n")
            .replace("until = 20.0", "until = 8.0")
            .replace("elements = [6, 3]", "elements = [4, 2]");
    let (path, run, stored) = ran(folder.path(), "wave", &text);
    assert!(stored.switch_t.len() > 4, "{run}");
    let scene = Scene::read(&path).unwrap();
    let system = Problem::new(&scene, None).unwrap().system;
    let d = Dense::of(&system);
    let (n, n_o) = (system.n(), system.n_o());
    let y: Vec<f64> = system.constraints.iter().map(|c| c.position[1]).collect();
    let gap_at = |t: f64| -> Vec<f64> {
        y.iter().map(|y| 0.01 + 0.03 * (3.0 * y - 0.8 * t).cos()).collect()
    };
    let rate_at =
        |t: f64| -> Vec<f64> { y.iter().map(|y| 0.024 * (3.0 * y - 0.8 * t).sin()).collect() };
    let mass: Vec<Vec<f64>> = (0..n_o).map(|i| d.m[i][..n_o].to_vec()).collect();
    // mass matrix inverted once
    let columns: Vec<Vec<f64>> = (0..n_o)
        .map(|j| solve(mass.clone(), (0..n_o).map(|i| f64::from(u8::from(i == j))).collect()))
        .collect();
    let acceleration = |t: f64, u_o: &[f64], v_o: &[f64], guess: &mut Vec<f64>| -> Vec<f64> {
        let mut u = [u_o, &guess[n_o..]].concat();
        let closed = contact(&d, &mut u, &gap_at(t));
        guess.copy_from_slice(&u);
        let free: Vec<usize> = (n_o..n).filter(|i| !closed[i - n_o]).collect();
        let k_ff: Vec<Vec<f64>> =
            free.iter().map(|&i| free.iter().map(|&j| d.k[i][j]).collect()).collect();
        // velocities: closed points go with the gap, free ones follow from K_f u̇ = 0
        let mut v = [v_o, &vec![0.0; n - n_o]].concat();
        for (i, rate) in rate_at(t).into_iter().enumerate().filter(|(i, _)| closed[*i]) {
            v[n_o + i] = rate;
        }
        let right = free.iter().map(|&i| -Dense::dot(&d.k[i], &v)).collect();
        for (&i, x) in free.iter().zip(solve(k_ff.clone(), right)) {
            v[i] = x;
        }
        let damped: Vec<f64> = (0..n).map(|i| beta * Dense::dot(&d.k[i], &v)).collect();
        // free rows weigh with what they follow by: A_f = -K_ff^-1 K_fO
        let through = solve(k_ff, free.iter().map(|&i| damped[i]).collect());
        let force: Vec<f64> = (0..n_o)
            .map(|j| {
                let share: f64 = free.iter().zip(&through).map(|(&i, y)| d.k[i][j] * y).sum();
                -(Dense::dot(&d.k[j], &u) + damped[j] - share)
            })
            .collect();
        (0..n_o)
            .map(|i| (0..n_o).map(|j| columns[j][i] * force[j]).sum::<f64>() - alpha * v_o[i])
            .collect()
    };
    let steps = 40_000usize;
    let full = {
        let h = 8.0 / steps as f64;
        let (mut u, mut v) = (vec![0.0; n_o], vec![0.0; n_o]);
        let mut guess = vec![0.0; n];
        let plus = |x: &[f64], y: &[f64], s: f64| -> Vec<f64> {
            x.iter().zip(y).map(|(x, y)| x + s * y).collect()
        };
        for step in 0..steps {
            let t = h * step as f64;
            let a1 = acceleration(t, &u, &v, &mut guess);
            let (u2, v2) = (plus(&u, &v, 0.5 * h), plus(&v, &a1, 0.5 * h));
            let a2 = acceleration(t + 0.5 * h, &u2, &v2, &mut guess);
            let (u3, v3) = (plus(&u, &v2, 0.5 * h), plus(&v, &a2, 0.5 * h));
            let a3 = acceleration(t + 0.5 * h, &u3, &v3, &mut guess);
            let (u4, v4) = (plus(&u, &v3, h), plus(&v, &a3, h));
            let a4 = acceleration(t + h, &u4, &v4, &mut guess);
            for i in 0..n_o {
                u[i] += h / 6.0 * (v[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
                v[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
            }
        }
        let mut full = [&u[..], &guess[n_o..]].concat();
        contact(&d, &mut full, &gap_at(8.0));
        full
    };
    // accelerations jump where damping acts through the contact: errors are of the order of the step
    let last = stored.t.len() - 1;
    let mut error = 0.0f64;
    for node in 0..stored.nodes.nrows() {
        let seen = stored.displacement(last, node);
        for (c, seen) in seen.into_iter().enumerate().take(2) {
            if let Some(i) = system.body.dofs.column(node, c) {
                error = error.max((seen - full[i]).abs());
            }
        }
    }
    let size = 0.02;
    assert!(error < 1e-5 * size, "{error} of {size}");
    // the balance of energy closes, the work of the wall with it
    assert!(run["energy_drift_total"].as_f64().unwrap() < 1e-8, "{run}");
}

/// Orbits under a gap that swings as a whole are those before an obstacle that moves: one that the body never meets, where it rests, and one that it meets.
#[test]
fn orbits_are_those_before_an_obstacle_that_moves() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |name: &str, contact: &str| {
        let text = format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\n{contact}\n\
             [damping]\nratio = 0.02\nmode = 2\n[orbit]\nomega = 1.3\n"
        );
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    for (amplitude, switches) in [(0.05, 0), (0.15, 8)] {
        let whole = scene(
            "whole",
            &format!(
                "gap = 0.1\nmotion = {{ amplitude = {amplitude}, omega = 1.3 }}\nstress = \"reaction\"\ninertia = \"constant\""
            ),
        );
        let own = scene("own", &format!("gap = \"0.1 + {amplitude}*cos(1.3*t)\""));
        let [a, b] = [whole, own].map(|scene| {
            let out = scene.replace(".toml", "-orbit.h5");
            json(&["orbit", &scene, "-o", &out, "--force"])
        });
        let count = |said: &Value| said["switches"].as_array().map(Vec::len);
        assert_eq!((count(&a), count(&b)), (Some(switches), Some(switches)), "{a} {b}");
        let largest = |said: &Value| said["multipliers"][0].to_string();
        assert!(switches == 0 || largest(&a)[..6] == largest(&b)[..6], "{a} {b}");
    }
}
