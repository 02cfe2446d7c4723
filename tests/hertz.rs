//! A sphere dropped on a rigid plane beside Hertz's quasi-static theory.
//!
//! `T = 2.87 (m²/(R E*² v))^{1/5}`, `F = 4/3 E* √R δ^{3/2}`, `δ = (15 m v²/(16 √R E*))^{2/5}`, `E* = E/(1 − ν²)` (Johnson, Contact Mechanics, 1985, eq. 11.24 and
//! section 11.4). The theory takes the sphere for a half space: what it leaves out is of the order of `a/R`, the radius of the contact over that of the
//! sphere, and makes the sphere stiffer, the contact shorter. It falls with the velocity, `a/R ~ v^{2/5}`.

use std::f64::consts::PI;

use crate::common::{root, run};
use signorini::store::Stored;

const POISSON: f64 = 0.3;

/// Contact time and largest force of Hertz for `R = E = ρ = 1`.
fn hertz(v: f64) -> [f64; 2] {
    let (mass, modulus) = (4.0 / 3.0 * PI, 1.0 / (1.0 - POISSON * POISSON));
    let depth = (15.0 * mass * v * v / (16.0 * modulus)).powf(0.4);
    [
        2.87 * (mass * mass / (modulus * modulus * v)).powf(0.2),
        4.0 / 3.0 * modulus * depth.powf(1.5),
    ]
}

/// Contact time and largest force of a scene of the share `1/parts` of the sphere, over those of Hertz.
fn dropped(scene: &str, parts: f64, change: &[(&str, &str)]) -> [f64; 2] {
    let place = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios").join(scene)).unwrap();
    let meshes = format!("\"{}/", root().join("scenarios/meshes").display());
    let mut text = text.replace("\"meshes/", &meshes);
    let mut v = 0.002;
    for (old, new) in change {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
        v = new.trim_matches('"').parse().map_or(v, |x: f64| x.abs());
    }
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("scene.toml"), text).unwrap();
    let done = run(&["run", &at("scene.toml"), "-o", &at("run.h5"), "-q"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let stored = Stored::read(&place.path().join("run.h5")).unwrap();
    let force = |row: usize| -> f64 {
        let pressures = stored.pressure.row(row);
        parts * pressures.iter().zip(&stored.contact_area).map(|(p, a)| p * a).sum::<f64>()
    };
    let largest = (0..stored.t.len()).map(force).fold(0.0, f64::max);
    let time = stored.switch_t[stored.switch_t.len() - 1] - stored.switch_t[0];
    let [t, f] = hertz(v);
    [time / t, largest / f]
}

/// Less and less is missing of Hertz's time as the contact becomes small.
#[test]
fn a_sphere_stays_for_the_time_of_hertz() {
    let found = dropped("sphere.toml", 1.0, &[]);
    println!(
        "axisymmetric, v = 0.002: contact time {:.4} of Hertz's, force {:.4}",
        found[0], found[1]
    );
    assert!((0.955..1.0).contains(&found[0]) && (1.0..1.07).contains(&found[1]), "{found:?}");
    // four times as fast: the contact is 1.74 times as wide
    let fast = dropped("sphere.toml", 1.0, &[("\"-0.002\"", "\"-0.008\"")]);
    println!(
        "axisymmetric, v = 0.008: contact time {:.4} of Hertz's, force {:.4}",
        fast[0], fast[1]
    );
    let ratio = (1.0 - fast[0]) / (1.0 - found[0]);
    assert!((1.3..2.3).contains(&ratio), "{ratio}: a/R says 1.74");
}

/// An eighth of it in space, under refinement: within 5 % of Hertz's time and nearer to the fine section with every mesh.
#[test]
fn an_eighth_in_space_converges() {
    let reference = |name: &str| root().join("tests/reference/meshes").join(name);
    let shipped = root().join("scenarios/meshes/sphere-eighth.msh");
    let found: Vec<[f64; 2]> = ["coarse", "", "fine"]
        .iter()
        .map(|name| {
            let other = reference(&format!("sphere-eighth-{name}.msh"));
            let mesh = if name.is_empty() { &shipped } else { &other };
            let change = (shipped.to_str().unwrap(), mesh.to_str().unwrap());
            let found = dropped("sphere-eighth.toml", 8.0, &[change]);
            println!("eighth {name}: contact time {:.4}, force {:.4}", found[0], found[1]);
            found
        })
        .collect();
    let section = dropped("sphere.toml", 1.0, &[]);
    let off = |k: usize| (found[k][0] - section[0]).abs();
    assert!(off(1) < 0.75 * off(0) && off(2) < 0.75 * off(1), "{found:?} {section:?}");
    assert!((0.95..1.0).contains(&found[2][0]) && (1.0..1.07).contains(&found[2][1]), "{found:?}");
}
