//! Curves over a number of the scene: against closed forms, scaling laws, and the numbers of an independent program.

use serde_json::Value;
use tempfile::TempDir;

use crate::common::{elastic_stop, json, run, with_unit_matrix as written};

/// One displacement before an elastic stop.
fn oscillator(load: f64, stiffness: f64, gap: f64, range: [f64; 2]) -> String {
    elastic_stop((load, 1.3), stiffness, gap, range)
}

const WIDE: [f64; 2] = [0.8, 1.6];

/// Unit masses, a load on the first.
fn two_masses(
    folder: &TempDir,
    springs: [f64; 3],
    contact: &str,
    load: (f64, f64),
    range: [f64; 2],
) -> String {
    let [a, b, c] = springs;
    let file = |name: &str, m: [[f64; 2]; 2]| {
        let mut text = "%%MatrixMarket matrix array real general\n2 2\n".to_owned();
        (0..4).for_each(|k| text += &format!("{:?}\n", m[k % 2][k / 2]));
        std::fs::write(folder.path().join(name), text).unwrap();
    };
    file("m.mtx", [[1.0, 0.0], [0.0, 1.0]]);
    file("k.mtx", [[a + b, -b], [-b, b + c]]);
    let (amplitude, alpha) = load;
    format!(
        "[body]\nkind = \"matrices\"\nmass_matrix = \"m.mtx\"\nstiffness_matrix = \"k.mtx\"\n\
         [contact]\nmethod = \"penalty\"\n{contact}\n[damping]\nrayleigh = [{alpha:?}, 0.0]\n\
         [[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = {amplitude:?}\nomega = {:?}\n[orbit]\nrange = {range:?}\n",
        range[0]
    )
}

/// Ten elements before an obstacle, contact nodes without mass, at 1.6 times the load under which resonance grazes.
fn bar() -> String {
    // the first mode of ten elements whose last node has no mass
    let (w, phi) = (1.573_373_595_909_213_4, 1.401_143_989_460_057_5);
    let (beta, load) = (0.02 / w, 1.6 * 0.02 * w * w / phi);
    format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [10]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"mass-redistribution\"\nmass = \"condensed\"\n\
         [damping]\nrayleigh = [0.0, {beta:?}]\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = {load:?}\nomega = 1.58\n\
         [orbit]\nrange = [1.55, 1.66]\n"
    )
}

/// A curve.
struct Curve {
    omega: Vec<f64>,
    value: Vec<f64>,
    amplitude: Vec<f64>,
    theta: Vec<Option<f64>>,
    special: Vec<String>,
    node: Option<u64>,
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
}

/// The curves of a scene that stands in a folder.
fn curves_in(folder: &TempDir, text: &str, of: &str, over: &str, more: &[&str]) -> Vec<Curve> {
    let scene = written(folder.path(), text);
    let file = folder.path().join("curve.h5").display().to_string();
    let own = ["curve", &scene, "-o", &file, "--of", of, "--over", over, "--force"];
    let found = json(&[&own, more].concat());
    let curve = |c: &Value| Curve {
        omega: numbers(&c["omega"]),
        value: numbers(&c["value"]),
        amplitude: numbers(&c["amplitude"]),
        theta: c["theta"].as_array().unwrap().iter().map(Value::as_f64).collect(),
        special: c["special"]
            .as_array()
            .unwrap()
            .iter()
            .map(|s| s.as_str().unwrap().to_owned())
            .collect(),
        node: c["node"].as_u64(),
    };
    found["curves"].as_array().unwrap().iter().map(curve).collect()
}

fn curves(text: &str, of: &str, over: &str) -> Vec<Curve> {
    curves_in(&TempDir::new().unwrap(), text, of, over, &[])
}

impl Curve {
    /// The rows of a word.
    fn rows(&self, word: &str) -> Vec<usize> {
        (0..self.special.len()).filter(|&k| self.special[k] == word).collect()
    }

    /// The frequency at the one point of a word.
    fn at(&self, word: &str) -> (f64, f64) {
        let rows = self.rows(word);
        assert_eq!(rows.len(), 1, "{word} in {:?}", self.special);
        (self.omega[rows[0]], self.value[rows[0]])
    }

    /// Frequencies at both ends.
    fn ends(&self) -> [f64; 2] {
        [self.omega[0], self.omega[self.omega.len() - 1]]
    }
}

fn near(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within * b.abs().max(1.0), "{a:.12} for {b:.12}");
}

/// Both folds of the main resonance lie on one curve with a cusp, 1.2 % above the load that grazes. Numbers of an independent program.
#[test]
fn folds_of_an_oscillator_meet_in_a_cusp() {
    let found = curves(&oscillator(0.2, 20.0, 1.0, WIDE), "fold", "load[0].amplitude=0.09,0.3");
    assert_eq!(found.len(), 1, "the second fold is on the curve of the first");
    let curve = &found[0];
    near(curve.at("start").0, 1.274_989_135_261_5, 1e-9);
    let (omega, load) = curve.at("cusp");
    near(omega, 1.005_321_570_4, 1e-8);
    near(load, 0.101_178_515_9, 1e-9);
    // the other fold at the load of the scene, from there
    let text = oscillator(0.2, 20.0, 1.0, WIDE);
    let low = curves(&text, "fold", "load[0].amplitude=0.199999,0.200001");
    let low: Vec<&Curve> = low.iter().filter(|c| c.at("start").0 < 1.1).collect();
    near(low[0].at("start").0, 1.080_862_849_471_7, 1e-9);
}

/// Gap and load together scale every length: the curve over the one is that over the inverse of the other. And how folds move with each number.
#[test]
fn folds_move_as_another_program_says() {
    let text = oscillator(0.2, 20.0, 1.0, WIDE);
    let ends = |over: &str| curves(&text, "fold", over)[0].ends();
    let [high, low] = ends("contact.gap=0.8,1.25");
    let [least, most] = ends(&format!("load[0].amplitude={:?},{:?}", 0.2 / 1.25, 0.2 / 0.8));
    near(high, most, 1e-10);
    near(low, least, 1e-10);
    // dω/d ln p: of differences of two widths the one that has their errors taken out
    for (key, value, rate) in [
        ("load[0].amplitude", 0.2, 0.308_645_206),
        ("contact.gap", 1.0, -0.308_645_206),
        ("damping.rayleigh[0]", 0.1, -0.304_148_053),
        ("contact.stiffness", 20.0, 0.058_984_700),
    ] {
        let slope = |h: f64| {
            let (low, high) = (value * (1.0 - h), value * (1.0 + h));
            let [a, b] = ends(&format!("{key}={low:?},{high:?}"));
            (b - a) / (2.0 * h)
        };
        near((4.0 * slope(0.01) - slope(0.02)) / 3.0, rate, 1e-7);
    }
}

/// `F = g √((1 − ω²)² + (αω)²)`: a motion that touches nothing is linear.
#[test]
fn grazing_curves_are_the_linear_response() {
    let text = oscillator(0.2, 20.0, 1.0, [0.5, 3.0]);
    let found = curves(&text, "grazing", "load[0].amplitude=0.05,2");
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].node, found[0].rows("turn").len()), (Some(0), 1));
    assert!(found[0].omega.len() > 50);
    for (w, load) in found[0].omega.iter().zip(&found[0].value) {
        let linear = ((1.0 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
        near(*load, linear, 1e-12);
    }
}

/// The second of two nodes grazes while the first touches. A number of an independent program.
#[test]
fn a_node_grazes_while_another_touches() {
    let folder = TempDir::new().unwrap();
    let contact = "displacements = [0, 1]\ngaps = [1.0, 1.6]\nstiffness = 20.0";
    let text = two_masses(&folder, [1.0, 0.5, 1.0], contact, (0.6, 0.05), [0.9, 1.8]);
    let found = curves_in(&folder, &text, "grazing", "load[0].amplitude=0.55,0.65", &[]);
    let starts: Vec<f64> =
        found.iter().filter(|c| c.node == Some(1)).map(|c| c.at("start").0).collect();
    assert!(starts.iter().any(|w| (w - 1.348_519_464_7).abs() < 1e-8), "{starts:?}");
}

/// A stop without a gap knows no load: a doubling, and the angle of a Neimark–Sacker point, stand where they are. Numbers of an independent program.
#[test]
fn without_a_gap_nothing_depends_on_the_load() {
    let text = oscillator(1.0, 200.0, 0.0, [2.4, 2.7]);
    let doubling = &curves(&text, "doubling", "load[0].amplitude=0.5,2")[0];
    let furthest = doubling.omega.iter().map(|w| (w - 2.567_923_906_5).abs()).fold(0.0, f64::max);
    assert!(furthest < 1e-9, "{furthest:e}");
    let folder = TempDir::new().unwrap();
    let contact = "displacements = [0]\ngap = 0.0\nstiffness = 10.0";
    let text = two_masses(&folder, [1.0, 1.0, 1.0], contact, (1.0, 0.04), [2.88, 2.96]);
    let torus = &curves_in(&folder, &text, "torus", "load[0].amplitude=0.8,1.25", &[])[0];
    for (w, theta) in torus.omega.iter().zip(&torus.theta) {
        near(*w, 2.920_952_770_8, 1e-8);
        let rotation = theta.unwrap() / std::f64::consts::TAU;
        near(rotation.min(1.0 - rotation), 0.380_552_234_4, 1e-8);
    }
}

/// A family in place of a point: the multipliers on a torus curve are on the unit circle at every value, by the orbits' own monodromy matrices.
#[test]
fn on_a_torus_curve_two_multipliers_are_on_the_unit_circle() {
    let folder = TempDir::new().unwrap();
    let contact = "displacements = [0]\ngap = 0.0\nstiffness = 10.0";
    let text = two_masses(&folder, [1.0, 1.0, 1.0], contact, (1.0, 0.04), [2.88, 2.96]);
    let torus = &curves_in(&folder, &text, "torus", "contact.stiffness=8,12", &[])[0];
    for (omega, stiffness) in [0, torus.omega.len() - 1].map(|k| (torus.omega[k], torus.value[k])) {
        let scene = written(
            folder.path(),
            &text.replace("stiffness = 10.0", &format!("stiffness = {stiffness:?}")),
        );
        let file = folder.path().join("o.h5").display().to_string();
        let orbit =
            json(&["orbit", &scene, "--omega", &format!("{omega:?}"), "-o", &file, "--force"]);
        let all = orbit["multipliers"].as_array().unwrap();
        let sizes = all.iter().map(numbers).map(|m| m[0].hypot(m[1]));
        assert_eq!(sizes.filter(|size| (size - 1.0).abs() < 1e-8).count(), 2, "{all:?}");
    }
}

/// A bar whose contact node has no mass. Numbers of an independent program.
#[test]
fn folds_of_a_bar_meet_in_a_cusp() {
    let (w, phi) = (1.573_373_595_909_213_4, 1.401_143_989_460_057_5);
    let grazing = 0.02 * w * w / phi;
    let found = curves(&bar(), "fold", "load[0].amplitude=0.034,0.06");
    assert_eq!(found.len(), 1);
    near(found[0].at("start").0, 1.608_056_462_9, 1e-9);
    let (omega, load) = found[0].at("cusp");
    near(omega, 1.575_365_187_7, 1e-8);
    near(load / (1.6 * grazing), 0.631_007_944_2, 1e-8);
}

/// The ridge over the gap: the peak of an independent program, and its slopes from the ends of a short piece.
#[test]
fn peaks_are_followed_as_one_curve() {
    let text = oscillator(0.2, 20.0, 1.0, [1.0, 1.5]);
    let peak = |over: &str| curves(&text, "peak", over).remove(0);
    let h = 1e-3;
    let ridge = peak(&format!("contact.gap={:?},{:?}", 1.0 - h, 1.0 + h));
    let start = ridge.rows("start")[0];
    near(ridge.omega[start], 1.271_772_58, 1e-7);
    near(ridge.amplitude[start], 1.808_939_43, 1e-7);
    let last = ridge.omega.len() - 1;
    near((ridge.amplitude[last] - ridge.amplitude[0]) / (2.0 * h), 0.079_692_35, 1e-5);
}

/// What is no question is refused with words, and nothing is written.
#[test]
fn what_cannot_be_followed_is_said() {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), &oscillator(0.2, 20.0, 1.0, WIDE));
    let file = folder.path().join("curve.h5").display().to_string();
    for (of, over, words) in [
        ("fold", "load[0].amplitude=0.5,0.4", "the lower end first"),
        ("fold", "load[0].amplitude", "its range"),
        ("fold", "load[0].amplitude=0.3,0.4", "outside of 0.3 to 0.4"),
        ("fold", "load[0].omega=1,2", "frequency of the orbit"),
        ("fold", "contact.gapp=0.5,2", "is no number"),
    ] {
        let output = run(&["curve", &scene, "--of", of, "--over", over, "-o", &file]);
        let said = String::from_utf8_lossy(&output.stderr)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert_eq!(output.status.code(), Some(2), "{over}: {said}");
        assert!(said.contains(words), "{over}: {said}");
        assert!(!folder.path().join("curve.h5").exists());
    }
    // a value that no scene may have ends the curve, and does not lose it
    let text = oscillator(0.2, 20.0, 1.0, WIDE);
    let curve = &curves_in(&folder, &text, "fold", "contact.gap=-0.5,1.2", &[])[0];
    assert!(curve.omega.len() > 10);
}

/// An isola of orbits of three periods of the load is born where the load turns back on the curve of its folds. Numbers of an independent program.
#[test]
fn an_isola_is_born() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = oscillator(10.0, 20.0, 1.0, [3.0, 5.0]);
    let begin = format!("{text}[initial]\nmode = 1\namplitude = -15.0\n");
    let scene = written(folder.path(), &begin);
    let orbit = path("orbit.h5");
    json(&["orbit", &scene, "--omega", "4.0", "--periods", "3", "-o", &orbit]);
    // a body that begins on it stays there
    let text = format!("{text}[initial]\nfile = \"orbit.h5\"\n");
    let scene = written(folder.path(), &text);
    let (swept, branches) = (path("swept.h5"), path("branches.h5"));
    json(&["response", &scene, "--sweep", "up", "--range", "4.15,4.3", "-o", &swept]);
    json(&["response", &scene, "--through", &swept, "-o", &branches]);
    let more = ["--response", &branches, "--range", "3,5.5"];
    let found = curves_in(&folder, &text, "fold", "load[0].amplitude=1,11", &more);
    let born = found.iter().find(|c| !c.rows("turn").is_empty()).unwrap();
    let (omega, load) = born.at("turn");
    near(omega, 3.655_958_508_5, 1e-8);
    near(load, 1.623_044_101_5, 1e-9);
    near(born.at("start").0, 4.768_849_79, 1e-8);
}

/// A value on the bound of what a scene may say has its differences on one side; a range may be as wide as one likes; starts outside of the frequencies are none.
#[test]
fn ranges_may_be_what_they_are() {
    let text = oscillator(0.2, 20.0, 1.0, WIDE);
    let from_zero = curves(&text, "fold", "damping.rayleigh[1]=0,0.02");
    near(from_zero[0].at("start").0, 1.274_989_135_261_5, 1e-9);
    assert!(from_zero[0].value.iter().all(|v| *v >= 0.0) && from_zero[0].value.len() > 5);
    assert_eq!(from_zero[0].at("start").1, 0.0);
    let narrow = &curves(&text, "fold", "contact.stiffness=10,40")[0];
    let wide = &curves(&text, "fold", "contact.stiffness=10,1e4")[0];
    near(narrow.ends()[0], wide.ends()[0], 1e-9);
    near(wide.value[wide.value.len() - 1], 1e4, 1e-12);
    let folder = TempDir::new().unwrap();
    let low = curves_in(&folder, &text, "fold", "contact.stiffness=19,21", &[]);
    assert_eq!(low.len(), 2);
    let scene = written(folder.path(), &text);
    let path = |name: &str| folder.path().join(name).display().to_string();
    let response = path("response.h5");
    json(&["response", &scene, "-o", &response]);
    let more = ["--response", &response, "--range", "1.2,1.4"];
    let high = curves_in(&folder, &text, "fold", "contact.stiffness=19,21", &more);
    assert_eq!(high.len(), 1);
    let output = run(&[
        "curve",
        &scene,
        "--of",
        "fold",
        "--over",
        "load[0].displacement=0,2",
        "-o",
        &path("x.h5"),
    ]);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}
