//! Pictures of families: what is shown, what the legends say, where a band lies.

use std::path::Path;

use signorini::records::{
    Branch, Changed, CheckRow, Direction, ErrorStatement, FamilyKind, Grid, OrbitRecord,
    PointMethod, PointRecord, Variation, VerdictKind, Walk,
};
use signorini::report::families::{Axis, pictures_of_family};
use signorini::report::figure::Style;
use signorini::report::overlay;
use signorini::store::{Outputs, StoredFamily, write_statement};
use tempfile::TempDir;

const SCENE: &str = "scenarios/half-plate-orbit.toml";

fn scene(elements: &str, contact: &str) -> String {
    let text = std::fs::read_to_string(crate::common::root().join(SCENE)).unwrap();
    text.replace("elements = [10, 3]", &format!("elements = {elements}"))
        .replace("gap = 1.0", &format!("gap = 1.0\n{contact}"))
}

/// A family of some frequencies and energies on the mesh of 10 × 3 elements.
fn family(method: PointMethod, points: &[(f64, f64)]) -> StoredFamily {
    let arclength = points.windows(2).any(|w| w[1].0 < w[0].0);
    let walk = match arclength {
        true => Walk::Branch { start: 1.6, step: 0.005, locate: false, natural: false },
        false => Walk::Grid(Grid { origin: 1.6, step: 0.1 }),
    };
    let identity = FamilyKind { method, walk, problem: 7 };
    let branch = match (method, arclength) {
        (PointMethod::HarmonicBalance { .. }, _) => {
            Branch::Series { harmonics: 7, direction: None }
        }
        (_, true) => Branch::Along(Direction::Up),
        (_, false) => Branch::Sequential,
    };
    let point = |(k, &(omega, energy)): (usize, &(f64, f64))| PointRecord {
        omega,
        index: k as i64,
        orbit: Some(OrbitRecord {
            energy,
            amplitude: 0.9 + energy / 10.0,
            stable: Some(k % 2 == 0),
            multipliers: vec![[1.0, 0.0], [1.0 + 0.1 * k as f64, 0.0]],
            trivial: 1,
            ..OrbitRecord::default()
        }),
        ..PointRecord::default()
    };
    StoredFamily {
        title: "Half plate".into(),
        scene: scene("[10, 3]", ""),
        identity,
        branches: vec![branch],
        points: points.iter().enumerate().map(point).collect(),
        ..StoredFamily::default()
    }
}

const UP: [(f64, f64); 5] = [(1.6, 1.0), (1.7, 1.2), (1.8, 1.5), (1.9, 2.0), (2.0, 3.0)];
const FOLDED: [(f64, f64); 5] = [(1.6, 1.0), (1.8, 1.2), (1.9, 1.5), (1.8, 2.0), (1.85, 3.0)];
const VISCOUS: PointMethod = PointMethod::Viscous { beta: 0.01, mode: 1 };
const SERIES: PointMethod =
    PointMethod::HarmonicBalance { acceleration: false, samples: None, shot: false };

fn stated(points: &[(f64, f64)]) -> ErrorStatement {
    let variation = |changed, factor: f64| Variation {
        changed,
        text: String::new(),
        energy: points.iter().map(|p| p.1 * factor).collect(),
    };
    ErrorStatement {
        omega: points.iter().map(|p| p.0).collect(),
        energy: points.iter().map(|p| p.1).collect(),
        slope: vec![f64::NAN; points.len()],
        variations: vec![
            variation(Changed::HalfViscosity, 1.2),
            variation(Changed::HalfMesh, 0.96),
        ],
    }
}

fn picture(family: &StoredFamily, axis: Option<Axis>, name: &str) -> String {
    let drawn = pictures_of_family(family, axis, Path::new("x"), &[name.to_owned()]).unwrap();
    assert_eq!(drawn.len(), 1);
    drawn[0].sheet.svg(&Style::default()).unwrap()
}

fn together(families: &[StoredFamily], axis: Axis) -> String {
    let options = overlay::Options { axis, ..overlay::Options::default() };
    overlay::picture(families, &options, Path::new("x"))
        .unwrap()
        .sheet
        .svg(&Style::default())
        .unwrap()
}

fn says(svg: &str, words: &str) -> bool {
    svg.lines().any(|line| line.trim() == words)
}

fn expect(svg: &str, words: &[&str]) {
    let texts: Vec<&str> = svg.lines().filter(|line| !line.starts_with('<')).collect();
    for word in words {
        assert!(says(svg, word), "{word} in {texts:?}");
    }
}

/// Filled areas with more corners than a mark.
fn areas(svg: &str) -> usize {
    let corners = |line: &str| line.split("points=\"").nth(1).map_or(0, |p| p.matches(',').count());
    svg.lines().filter(|line| line.starts_with("<polygon") && corners(line) > 6).count()
}

#[test]
fn the_axis_is_energy_or_amplitude_or_both() {
    let family = family(PointMethod::Shooting, &UP);
    let (energy, amplitude) = ("largest energy H", "largest contact displacement");
    for (axis, shown) in [
        (None, [true, true]),
        (Some(Axis::Energy), [true, false]),
        (Some(Axis::Amplitude), [false, true]),
    ] {
        let svg = picture(&family, axis, "backbone");
        assert_eq!([says(&svg, energy), says(&svg, amplitude)], shown);
    }
    let svg = together(&[family.clone(), family], Axis::Amplitude);
    expect(&svg, &[amplitude, "Half plate: amplitude against frequency"]);
}

#[test]
fn families_of_one_picture_are_called_by_what_tells_them_apart() {
    let [conservative, viscous, series] =
        [PointMethod::Shooting, VISCOUS, SERIES].map(|method| family(method, &UP));
    let svg = together(&[conservative.clone(), viscous.clone(), series.clone()], Axis::Energy);
    expect(
        &svg,
        &[
            "conservative shooting",
            "viscous shooting, β = 0.01",
            "backbone by harmonic balance:",
            "N_h = 7",
            "energy H: the largest, of viscous motions that at t = 0",
        ],
    );
    let finer = StoredFamily { scene: scene("[20, 6]", ""), ..viscous.clone() };
    let other = "method = \"mass-redistribution\"";
    let other = StoredFamily { scene: scene("[20, 6]", other), ..viscous.clone() };
    let svg = together(&[viscous.clone(), finer, other], Axis::Energy);
    expect(
        &svg,
        &[
            "viscous shooting, β = 0.01, 10 × 3 elements, nodal boundary method",
            "viscous shooting, β = 0.01, 20 × 6 elements, nodal boundary method",
            "viscous shooting, β = 0.01, 20 × 6 elements, mass redistribution",
            "energy H at t = 0",
        ],
    );
    // series of two meshes are no longer told by their harmonics
    let coarse = StoredFamily { scene: scene("[5, 2]", ""), ..series.clone() };
    let svg = together(&[series.clone(), coarse], Axis::Energy);
    let names = ["10 × 3", "5 × 2"].map(|m| format!("harmonic balance, {m} elements, N_h = 7"));
    expect(&svg, &[&names[0], &names[1]]);
    // nothing but the files
    let named = |name: &str| StoredFamily { path: name.into(), ..conservative.clone() };
    let svg = together(&[named("a.h5"), named("b.h5")], Axis::Energy);
    let names = ["a", "b"].map(|f| format!("conservative shooting, sequential, {f}"));
    expect(&svg, &[&names[0], &names[1]]);
}

/// Peaks of the amplitude on the responses of some damping ratios; a response without a peak broke off.
fn responses(name: &str, ratios: &[(f64, bool)]) -> StoredFamily {
    let mut family = family(PointMethod::Shooting, &UP);
    let walk = Walk::Response(Grid { origin: 1.6, step: 0.02 });
    family.identity = FamilyKind { method: PointMethod::Shooting, walk, problem: 7 };
    family.path = format!("{name}.h5").into();
    family.branches =
        ratios.iter().map(|r| Branch::Response { percent: Some(r.0), series: None }).collect();
    let orbit = |branch: usize, k: usize| {
        let x = -1.0 + 0.1 * k as f64;
        let amplitude =
            1.0 / ratios[branch].0 * (if ratios[branch].1 { 2.0 - x * x } else { 2.0 + x });
        let orbit = OrbitRecord { energy: amplitude, amplitude, ..OrbitRecord::default() };
        PointRecord {
            omega: 1.8 + 0.1 * x,
            branch,
            index: k as i64,
            orbit: Some(orbit),
            ..PointRecord::default()
        }
    };
    family.points = (0..ratios.len())
        .flat_map(|b| (0..21).map(move |k| (b, k)))
        .map(|(b, k)| orbit(b, k))
        .collect();
    family
}

/// Ends of lines of a picture that are drawn in colours: how many colours there are.
fn colours(svg: &str) -> usize {
    let of = |line: &str| line.split("stroke=\"").nth(1).map(|s| s[..7].to_owned());
    let lines = svg.lines().filter(|line| line.starts_with("<polyline"));
    lines.filter_map(of).collect::<std::collections::BTreeSet<_>>().len()
}

#[test]
fn responses_of_several_files_are_told_apart() {
    let three = responses("three", &[(1.0, true), (2.0, false), (5.0, true)]);
    let other = responses("other", &[(2.0, true)]);
    let one = together(std::slice::from_ref(&three), Axis::Amplitude);
    expect(&one, &["forced response, damping ratio ξ:", "1 %", "2 %", "5 %"]);
    let both = together(&[three.clone(), other.clone()], Axis::Amplitude);
    expect(
        &both,
        &["three, forced response:", "other, forced response:", "1 %", "2 %", "5 %", "ridge"],
    );
    // the same ratio of two files has two colours
    assert_eq!(colours(&both), colours(&one) + 1);
    // no line of the ridge leads over a response that broke off; one that has a peak has its mark
    let whole = responses("three", &[(1.0, true), (2.0, true), (5.0, true)]);
    let lines = |svg: &str| svg.lines().filter(|l| l.starts_with("<polyline")).count();
    let joined = together(std::slice::from_ref(&whole), Axis::Amplitude);
    assert!(lines(&joined) > lines(&one), "{} {}", lines(&joined), lines(&one));
    let diamonds = |svg: &str| svg.matches("<polygon").count();
    assert_eq!(diamonds(&both), diamonds(&one) + 1);
}

/// The points that another program gave are drawn where no other file has them, and their file is named.
#[test]
fn series_that_were_checked_are_drawn() {
    let mut checked = family(PointMethod::Check { quick: false }, &UP[..3]);
    checked.path = "mine.h5".into();
    for p in &mut checked.points {
        p.check = Some(CheckRow {
            omega: p.omega,
            n_h: 7,
            energy: 1.5 * p.orbit.as_ref().unwrap().energy,
            residual: 0.1,
            return_error: 0.1,
            verdict: VerdictKind::Orbit,
            message: String::new(),
            moved: 0.3,
            orbit_energy: 1.0,
            contact_change: 0.0,
            same_sequence: false,
        });
    }
    let series = family(SERIES, &UP);
    let open = |line: &&str| line.starts_with("<circle") && line.contains("fill=\"none\"");
    let circles = |svg: &str| svg.lines().filter(open).count();
    let both = [series.clone(), checked.clone()];
    let svg = together(&both, Axis::Energy);
    expect(&svg, &["orbits in time (mine)", "series that were checked (mine)"]);
    // those that lie on the curve of a file are drawn by it
    let mut same = checked.clone();
    for p in &mut same.points {
        p.check.as_mut().unwrap().energy = p.orbit.as_ref().unwrap().energy;
    }
    let own = together(&[series.clone(), same], Axis::Energy);
    assert!(!own.contains("series that were checked"));
    // three points, and one in the legend
    assert_eq!(circles(&svg), circles(&own) + 4);
    let svg = together(&both, Axis::Amplitude);
    assert!(svg.contains("their amplitudes are not stored"));
}

#[test]
fn viscous_families_are_neither_stable_nor_unstable() {
    let conservative = family(PointMethod::Shooting, &FOLDED);
    expect(&picture(&conservative, None, "backbone"), &["stable", "unstable"]);
    for points in [UP, FOLDED] {
        let viscous = family(VISCOUS, &points);
        let svg = picture(&viscous, None, "backbone");
        assert!(!says(&svg, "stable") && !says(&svg, "unstable"));
        let svg = picture(&viscous, None, "multipliers");
        assert!(svg.contains("multipliers of the self-excited system"));
        assert!(!says(&svg, "limit of stability"));
    }
}

#[test]
fn an_error_statement_is_a_band_or_bars_around_the_energy() {
    let entries = ["error of the energy:", "mesh and contact", "viscosity"];
    let graph = StoredFamily { statement: Some(stated(&UP)), ..family(VISCOUS, &UP) };
    let svg = picture(&graph, None, "backbone");
    expect(&svg, &entries);
    assert_eq!(areas(&svg), 2);
    let svg = picture(&graph, Some(Axis::Amplitude), "backbone");
    assert!(areas(&svg) == 0 && !says(&svg, entries[0]));
    let svg = together(&[graph.clone(), family(PointMethod::Shooting, &UP)], Axis::Energy);
    expect(&svg, &entries);
    assert_eq!(areas(&svg), 2);
    assert_eq!(areas(&together(std::slice::from_ref(&graph), Axis::Amplitude)), 0);
    // a curve that turns back has bars
    let folded = StoredFamily { statement: Some(stated(&FOLDED)), ..family(VISCOUS, &FOLDED) };
    let svg = picture(&folded, None, "backbone");
    expect(&svg, &entries);
    assert_eq!(areas(&svg), 0);
    // nothing more to draw for a viscosity that does less than the mesh
    let mut small = graph.clone();
    small.statement.as_mut().unwrap().variations[0].energy = UP.map(|p| p.1 * 1.01).to_vec();
    let svg = picture(&small, None, "backbone");
    expect(&svg, &["mesh and contact (the viscosity within)"]);
    assert!(areas(&svg) == 1 && !says(&svg, "viscosity"));
    // nothing is known where no orbit was found, and less than nothing makes no band
    let mut lacking = graph;
    let statement = lacking.statement.as_mut().unwrap();
    statement.variations.remove(0);
    statement.variations[0].energy[1..].fill(f64::NAN);
    let svg = picture(&lacking, None, "backbone");
    assert!(areas(&svg) == 0 && !says(&svg, entries[0]));
}

fn signorini(folder: &TempDir, arguments: &[&str], code: i32) -> String {
    let output =
        crate::common::program().current_dir(folder.path()).args(arguments).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    error
}

#[test]
fn files_of_families_are_drawn_together() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene("[10, 3]", "")).unwrap();
    let range = ["--range", "1.7,1.8", "--step", "0.02", "-q"];
    let make = |more: &[&str]| {
        signorini(&folder, &[&["backbone", "scene.toml"], more, &range[..]].concat(), 0)
    };
    make(&["-o", "conservative.h5"]);
    make(&["--viscous", "--beta", "0.04", "-o", "viscous.h5"]);
    let path = folder.path().join("viscous.h5");
    let viscous = StoredFamily::read(&path).unwrap();
    let orbits = viscous.points.iter().filter_map(|p| Some((p.omega, p.orbit.as_ref()?.energy)));
    let points: Vec<(f64, f64)> = orbits.collect();
    assert!(points.len() > 3);
    write_statement(&path, &Outputs::new(true), &stated(&points)).unwrap();
    signorini(&folder, &["plot", "conservative.h5", "viscous.h5", "-o", "both"], 0);
    let svg = std::fs::read_to_string(folder.path().join("both.svg")).unwrap();
    expect(&svg, &["conservative shooting", "viscous shooting, β = 0.04", "mesh and contact"]);
    signorini(&folder, &["plot", "viscous.h5", "--axis", "energy"], 0);
    let svg = std::fs::read_to_string(folder.path().join("viscous-backbone.svg")).unwrap();
    assert_eq!(areas(&svg), 2);
    // limits belong to the axis that is shown
    let both = ["plot", "conservative.h5", "viscous.h5", "--axis", "amplitude"];
    signorini(&folder, &[&both[..], &["--amplitude", "1,2"]].concat(), 0);
    let error = signorini(&folder, &[&both[..], &["--energy", "1,2"]].concat(), 2);
    assert!(error.contains("--energy"), "{error}");
}
