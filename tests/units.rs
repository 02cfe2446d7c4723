//! Families do not know the units that a scene is told in: length, time and mass scaled by anything give the same points.

use crate::common::json;
use signorini::records::PointKind;
use signorini::store::StoredFamily;
use tempfile::TempDir;

/// Units of length, time, mass.
type Units = (f64, f64, f64);

const PLAIN: Units = (1.0, 1.0, 1.0);

/// Powers of two (of four where a root of a mass is taken), and of ten from a billionth to a billion.
const BINARY: [Units; 2] =
    [(9.765625e-4, 1.0, 9.5367431640625e-7), (256.0, 0.015625, 4096.0 * 4096.0)];
const DECIMAL: [Units; 8] = [
    (1e-9, 1.0, 1.0),
    (1e9, 1.0, 1.0),
    (1.0, 1e-9, 1.0),
    (1.0, 1e9, 1.0),
    (1.0, 1.0, 1e-9),
    (1.0, 1.0, 1e9),
    (1e-3, 1.0, 1e6),
    (1e-6, 1e-6, 1e-15),
];

/// A half plate on rollers in other units; `[contact]` and what follows `[run]` are given.
fn scene((l, t, m): Units, contact: &str, rest: &str, elements: (usize, usize)) -> String {
    format!(
        "[body]\nkind = 'plate'\nsize = [{l:?}, {:?}]\nelements = [{}, {}]\nthickness = {l:?}\nyoung = {:?}\npoisson = 0.3\ndensity = {:?}\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n\
         [contact]\nedge = 'right'\ngap = {l:?}\n{contact}\n[run]\nperiods = 1\n{rest}",
        0.3 * l,
        elements.0,
        elements.1,
        m / (l * t * t),
        m / (l * l * l),
    )
}

/// What a family is in numbers: kinds of its points, and frequencies, energies, amplitudes.
#[derive(Debug)]
struct Numbers {
    kinds: Vec<String>,
    values: Vec<[f64; 3]>,
}

fn numbers(text: &str, arguments: &[&str], (l, t, m): Units) -> Numbers {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let (scene, output) = (at("scene.toml"), at("family.h5"));
    json(&[&arguments[..1], &[&scene, "-o", &output, "-q"], &arguments[1..]].concat());
    let family = StoredFamily::read(output.as_ref()).unwrap();
    let kind = |special: &PointKind| special.word().to_owned();
    let value = |p: &signorini::records::PointRecord| {
        let (energy, amplitude) = p.orbit.as_ref().map_or((0.0, 0.0), |o| (o.energy, o.amplitude));
        [p.omega * t, energy / (m * l * l) * (t * t), amplitude / l]
    };
    Numbers {
        kinds: family.points.iter().map(|p| kind(&p.special)).collect(),
        values: family.points.iter().map(value).collect(),
    }
}

/// The family in all units; `tolerance` at powers of ten, relative to the largest of a column.
fn check(of: impl Fn(Units) -> Numbers, decimal: &[Units], tolerance: f64) {
    let plain = of(PLAIN);
    assert!(plain.values.len() > 12, "{}", plain.values.len());
    let largest = |c: usize| plain.values.iter().fold(0.0f64, |m, v| m.max(v[c].abs()));
    let sizes = [largest(0), largest(1), largest(2)];
    // powers of two round nothing; one number in a thousand is another one in its last digit all the same
    for units in BINARY {
        let other = of(units);
        assert_eq!(other.kinds, plain.kinds, "{units:?}");
        let off =
            |(a, b): (&[f64; 3], &[f64; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 4e-16 * sizes[c]);
        let first = plain.values.iter().zip(&other.values).find(|pair| off(*pair));
        assert!(first.is_none(), "{units:?}: {first:?}");
    }
    for &units in decimal {
        let other = of(units);
        assert_eq!(other.kinds, plain.kinds, "{units:?}");
        for (k, (a, b)) in plain.values.iter().zip(&other.values).enumerate() {
            let off = (0..3).map(|c| (a[c] - b[c]).abs() / sizes[c]).fold(0.0, f64::max);
            // at a branch point the corrector's matrix is singular: the root of rounding
            let limit = if plain.kinds[k] == "branch point" { 1e-7 } else { tolerance };
            assert!(off < limit, "{units:?}, {}: {off:.1e}", plain.kinds[k]);
        }
    }
}

fn forced(units: Units, contact: &str) -> String {
    let (l, t, _) = units;
    let rest = format!(
        "[damping]\nrayleigh = [{:?}, {:?}]\n[[load]]\nkind = 'gravity'\namplitude = [{:?}, 0.0]\nomega = {:?}\n",
        0.03 / t,
        0.01 * t,
        0.2 * l / t / t,
        1.6 / t
    );
    scene(units, contact, &rest, (4, 1))
}

fn free(units: Units, contact: &str) -> String {
    let t = units.1;
    let rest = format!(
        "[initial]\nmode = 1\namplitude = -1.1\n[orbit]\nomega = {:?}\nrange = [{:?}, {:?}]\n",
        1.8 / t,
        1.586 / t,
        2.08 / t
    );
    scene(units, contact, &rest, (10, 3))
}

#[test]
fn responses_by_shooting() {
    for contact in ["inertia = 'constant'", "method = 'mass-redistribution'", "method = 'penalty'"]
    {
        let of = |units: Units| {
            let range = format!("{:?},{:?}", 1.45 / units.1, 1.75 / units.1);
            let arguments = ["response", "--range", &range, "--step", "0.1"];
            numbers(&forced(units, contact), &arguments, units)
        };
        check(of, &DECIMAL, 1e-9);
    }
}

/// (With penalty, on 16 points: behind the next bifurcations a branch at constant frequency magnifies rounding errors, and places its points by them.)
#[test]
fn backbones_by_shooting_along_the_branch() {
    for (contact, points) in [("", "15"), ("method = 'penalty'", "7")] {
        let of = |units: Units| {
            let omega = format!("{:?}", 1.8 / units.1);
            let arguments =
                ["backbone", "--follow", "arclength", "--omega", &omega, "--points", points];
            numbers(&free(units, contact), &arguments, units)
        };
        check(of, &DECIMAL[..6], 1e-9);
    }
}

/// (Up to 1.757: at 1.7605 the branch ends in ever shorter steps, which rounding places.)
#[test]
fn backbones_by_harmonic_balance() {
    for contact in ["", "method = 'penalty'"] {
        let of = |units: Units| {
            let omega = format!("{:?}", 1.75 / units.1);
            let range = format!("{:?},{:?}", 1.7 / units.1, 1.757 / units.1);
            let arguments = [
                &["backbone", "--method", "hbm", "--harmonics", "7", "--range", &range][..],
                &["--follow", "arclength", "--omega", &omega, "--points", "30"],
            ]
            .concat();
            numbers(&free(units, contact), &arguments, units)
        };
        check(of, &DECIMAL, 1e-9);
    }
}

/// The identical dimensionless problem in real materials: steel, silicon, rubber.
#[test]
fn steel_silicon_and_rubber_are_their_dimensionless_twin() {
    // size, young, density, thickness, gap
    let real = |size: f64, young: f64, density: f64, thickness: f64, gap: f64| {
        let time = size * (density / young).sqrt();
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [{size:?}, {:?}]\nelements = [4, 1]\nthickness = {thickness:?}\nyoung = {young:?}\npoisson = 0.3\ndensity = {density:?}\n\
             [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n\
             [contact]\nedge = 'right'\ngap = {gap:?}\ninertia = 'constant'\n[damping]\nratio = 0.02\nmode = 1\n\
             [[load]]\nkind = 'mode'\nmode = 1\npeak = 3.0\nomega = {:?}\n[run]\nperiods = 1\n",
            0.3 * size,
            1.7 / time
        );
        let range = format!("{:?},{:?}", 1.45 / time, 1.85 / time);
        // energies in units of m l²/t² of the gap
        let mass = density * size * size * thickness;
        numbers(&text, &["response", "--range", &range, "--step", "0.1"], (gap, time, mass))
    };
    let twin = real(1.0, 1.0, 1.0, 1.0, 1.0);
    for material in [
        real(0.1, 2.1e11, 7800.0, 1e-3, 1e-6),
        real(1e-4, 1.6e11, 2330.0, 2e-6, 1e-6),
        real(0.05, 1e5, 1000.0, 1e-3, 1e-4),
    ] {
        assert_eq!(material.kinds, twin.kinds);
        for (a, b) in twin.values.iter().zip(&material.values) {
            assert!(
                (0..3).all(|c| (a[c] - b[c]).abs() < 1e-8 * a[c].abs().max(1.0)),
                "{a:?} {b:?}"
            );
        }
    }
}
