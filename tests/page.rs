//! The page of `signorini view`: what it is made of, and what it refuses. How it behaves in a browser: `make page`.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::root;
use base64::Engine;
use serde_json::Value;
use signorini::store::{Stored, StoredFamily};

fn signorini(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signorini"));
    command.args(arguments).current_dir(root()).output().unwrap()
}

fn fine(arguments: &[&str]) {
    let output = signorini(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
}

/// The data of a page.
fn data(page: &Path) -> Value {
    let text = fs::read_to_string(page).unwrap();
    let begin = "<script type=\"application/json\" id=\"data\">";
    let data = text.split_once(begin).unwrap().1.split_once("</script>").unwrap().0;
    serde_json::from_str(data).unwrap()
}

/// The numbers of a block.
fn numbers(block: &Value) -> Vec<f64> {
    let text = block["data"].as_str().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
    let scale = block["scale"].as_f64().unwrap();
    match block["kind"].as_str().unwrap() {
        "f8" => bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect(),
        "f4" => bytes
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())))
            .collect(),
        "i4" => bytes
            .chunks_exact(4)
            .map(|b| f64::from(i32::from_le_bytes(b.try_into().unwrap())))
            .collect(),
        "i2" => bytes
            .chunks_exact(2)
            .map(|b| scale * f64::from(i16::from_le_bytes(b.try_into().unwrap())))
            .collect(),
        other => panic!("{other}"),
    }
}

#[test]
fn a_page_holds_what_its_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let scene = fs::read_to_string(root().join("scenarios/plate-half.toml")).unwrap();
    // a title that would end the element that it stands in, or be taken for a place in the frame
    let first = scene.lines().find(|l| l.starts_with("title")).unwrap();
    let title = "title = \"A </script><b> & {{DATA}} {{TITLE}}\"";
    fs::write(at("s.toml"), scene.replace(first, title)).unwrap();
    fine(&["run", &at("s.toml"), "-o", &at("r.h5"), "-q"]);
    fine(&["view", &at("r.h5"), "--no-open"]);
    // words of its author, and what the run says of itself
    let text = ["--title", "A </b> of mine", "--text", "One.\n\nTwo."];
    fine(&[&["view", &at("r.h5"), "--no-open", "-o", &at("own.html")][..], &text].concat());
    let own = data(Path::new(&at("own.html")));
    assert_eq!(
        (&own["title"], own["text"].as_array().unwrap().len()),
        (&"A </b> of mine".into(), 2)
    );
    let said = own["views"][0]["said"].as_array().unwrap();
    let method = said.iter().find(|pair| pair[0] == "method").unwrap();
    assert_eq!(method[1], "nodal boundary method");
    let command = own["views"][0]["command"].as_str().unwrap();
    assert!(!command.contains(folder.path().to_str().unwrap()), "{command}");
    let text = fs::read_to_string(at("r.html")).unwrap();
    assert!(text.contains("<title>A &lt;/script&gt;&lt;b&gt; &amp; {{DATA}} {{TITLE}}</title>"));
    // nothing is fetched: no address but those of namespaces and licences
    let script = text.rsplit_once("<script>").unwrap().1;
    for (k, _) in script.match_indices("http") {
        assert!(script[k..].starts_with("http://www.w3.org/"), "{}", &script[k..k + 60]);
    }
    let view = &data(Path::new(&at("r.html")))["views"][0];
    let stored = Stored::read(Path::new(&at("r.h5"))).unwrap();
    assert_eq!(view["title"], stored.title.as_str());
    let frames = &view["motion"]["frames"];
    assert_eq!(numbers(&frames["t"]), stored.t);
    let u = numbers(&frames["u"]);
    let n = stored.nodes.nrows();
    let largest = u.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (r, row) in u.chunks_exact(2 * n).enumerate() {
        for (i, x) in row.chunks_exact(2).enumerate() {
            let own = stored.displacement(r, i);
            assert!((0..2).all(|c| (x[c] - own[c]).abs() < 2e-5 * largest), "{r} {i}");
        }
    }
    assert_eq!(numbers(&view["motion"]["ledger"]["elastic"]), stored.energy[1]);
    // an own page is drawn anew, a foreign file stays
    fine(&["plot", &at("r.h5"), "--html"]);
    fs::write(at("r.html"), "<p>mine</p>").unwrap();
    assert_eq!(signorini(&["view", &at("r.h5")]).status.code(), Some(2));
    assert_eq!(fs::read_to_string(at("r.html")).unwrap(), "<p>mine</p>");
}

/// The stress at the centre of a cell, against the closed form of a uniform stretch.
#[test]
fn stresses_are_those_of_a_uniform_stretch() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    fine(&["run", "scenarios/plate.toml", "-o", &at("r.h5"), "-q"]);
    fine(&["view", &at("r.h5"), "--no-open"]);
    let view = &data(Path::new(&at("r.html")))["views"][0];
    let stored = Stored::read(Path::new(&at("r.h5"))).unwrap();
    let rows = numbers(&view["body"]["stress"]["rows"]);
    // E = 1, ν = 0.3, plane stress: u = (x, −ν y) is a tension of 1
    for k in 0..stored.elements.nrows() {
        let mut s = [0.0; 4];
        for (j, node) in stored.nodes_of(k).into_iter().enumerate() {
            let u = [stored.nodes[(node, 0)], -0.3 * stored.nodes[(node, 1)]];
            for c in 0..2 {
                for d in 0..4 {
                    s[d] += rows[(k * 8 + 2 * j + c) * 4 + d] * u[c];
                }
            }
        }
        let wrong = [s[0] - 1.0, s[1], s[2], s[3]].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(wrong < 1e-4, "{k}: {s:?}");
    }
}

/// Orbits and series of a family close, and begin at the states of the file.
#[test]
fn orbits_of_a_family_are_those_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let plate = "scenarios/half-plate-orbit.toml";
    let response = "scenarios/half-plate-response.toml";
    let viscous = "scenarios/half-plate-redistribution.toml";
    for (name, words) in [
        ("o.h5", &["backbone", plate, "--range", "1.7,1.72"][..]),
        (
            "h.h5",
            &["backbone", plate, "--range", "1.7,1.71", "--method", "hbm", "--harmonics", "7"],
        ),
        ("r.h5", &["response", response, "--range", "1.4,1.45", "--ratios", "0.02,0.05"]),
        ("v.h5", &["backbone", viscous, "--viscous", "--quick", "--range", "1.7,1.72"]),
    ] {
        fine(&[words, &["-o", &at(name), "-q"]].concat());
        fine(&["view", &at(name), "--no-open"]);
        let page = Path::new(&at(name)).with_extension("html");
        let view = &data(&page)["views"][0];
        let family = StoredFamily::read(Path::new(&at(name))).unwrap();
        let rest = Stored::body(Path::new(&at(name))).unwrap();
        let mut played = 0;
        for (point, record) in view["points"].as_array().unwrap().iter().zip(&family.points) {
            if record.orbit.is_none() && record.series.is_none() {
                assert!(point["frames"].is_null());
                continue;
            }
            played += 1;
            let (t, u) = (numbers(&point["frames"]["t"]), numbers(&point["frames"]["u"]));
            let period = std::f64::consts::TAU / record.omega;
            assert!((t[t.len() - 1] / period - 1.0).abs() < 1e-9, "{name}: {}", t[t.len() - 1]);
            let n = 2 * rest.nodes.nrows();
            let largest = u.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let apart = |a: &[f64], b: &[f64]| {
                a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / largest
            };
            assert!(apart(&u[..n], &u[u.len() - n..]) < 1e-4, "{name} at {}", record.omega);
            if let Some(orbit) = record.orbit.as_ref().filter(|_| record.series.is_none()) {
                let nodal: Vec<f64> = (0..n)
                    .map(|i| {
                        usize::try_from(rest.dof_map[(i / 2, i % 2)]).map_or(0.0, |d| orbit.u0[d])
                    })
                    .collect();
                assert!(apart(&u[..n], &nodal) < 1e-4, "{name} at {}", record.omega);
            }
        }
        assert!(played >= 2, "{name}: {played}");
    }
}

/// A sphere of a few tetrahedra: of its 56 contact nodes twelve evenly chosen ones reach 0.0647 of the largest pressure 0.0773.
const SPHERE: &str = r#"
title = "Sphere"
[body]
kind = "mesh"
file = "MESH"
mass = "lumped"
[[material]]
young = 1.0
poisson = 0.3
density = 1.0
[[support]]
group = "first"
fix = ["normal"]
[[support]]
group = "second"
fix = ["normal"]
[contact]
group = "sole"
plane = { normal = [0.0, 0.0, -1.0], offset = 1.001 }
stress = "reaction"
[initial]
velocity = ["0", "0", "-0.002"]
[run]
until = 6.0
samples = 60
"#;

#[test]
fn the_largest_pressures_have_curves_and_page_and_picture_choose_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let mesh = root().join("tests/reference/meshes/sphere-eighth-coarse.msh");
    let mesh = mesh.display().to_string().replace('\\', "/");
    fs::write(at("s.toml"), SPHERE.replace("MESH", &mesh)).unwrap();
    fine(&["run", &at("s.toml"), "-o", &at("s.h5"), "-q"]);
    fine(&["view", &at("s.h5"), "--no-open"]);
    let view = &data(Path::new(&at("s.html")))["views"][0];
    let stored = Stored::read(Path::new(&at("s.h5"))).unwrap();
    let shown: Vec<usize> =
        serde_json::from_value(view["motion"]["frames"]["shown"].clone()).unwrap();
    assert_eq!((shown.len(), stored.gap.len()), (12, 56));
    // at every time the largest pressure of those drawn is that of all, to a hundredth of the largest
    let of = |r: usize, i: usize| stored.pressure[(r, i)];
    let peak = stored.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    for r in 0..stored.t.len() {
        let all = (0..stored.gap.len()).map(|i| of(r, i)).fold(0.0, f64::max);
        let drawn = shown.iter().map(|&i| of(r, i)).fold(0.0, f64::max);
        assert!(all - drawn <= 0.01 * peak, "{r}: {drawn} of {all}");
    }
    // the picture of the same nodes, asked for one by one
    let nodes: Vec<String> = shown.iter().map(|&i| stored.contact_nodes[i].to_string()).collect();
    fine(&["plot", &at("s.h5"), "--only", "contact", "-o", &at("own"), "-q"]);
    let chosen = nodes.join(",");
    fine(&["plot", &at("s.h5"), "--only", "contact", "--nodes", &chosen, "-o", &at("same"), "-q"]);
    let svg = |name: &str| fs::read_to_string(at(name)).unwrap();
    assert_eq!(svg("own-contact.svg"), svg("same-contact.svg"));
    assert!(svg("own-contact.svg").contains("12 of 56 nodes"));
    surface_is_that_of(view, &stored);
    // curves of others
    let two = format!("{},{}", nodes[1], nodes[4]);
    fine(&["view", &at("s.h5"), "--no-open", "--nodes", &two, "-o", &at("two.html")]);
    let shown = &data(Path::new(&at("two.html")))["views"][0]["motion"]["frames"]["shown"];
    assert_eq!(shown.as_array().unwrap().len(), 2);
    let none = signorini(&["view", &at("s.h5"), "--nodes", "999999"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&none.stderr).contains("999999: not a contact node"));
}

/// The surface of a body in space on its page: closed and outward, where the file has it, with the file's pressures.
fn surface_is_that_of(view: &Value, stored: &Stored) {
    let body = &view["body"];
    assert_eq!(body["dim"], 3);
    let solid = &body["solid"];
    let whole = |name: &str| -> Vec<usize> {
        numbers(&solid[name]).into_iter().map(|x| x as usize).collect()
    };
    let (triangles, places) = (whole("triangles"), numbers(&solid["nodes"]));
    let n = places.len() / 3;
    // Euler: a ball without holes
    assert_eq!(triangles.len() / 3, 2 * n - 4);
    let mut sides = std::collections::HashSet::new();
    for t in triangles.chunks_exact(3) {
        assert!((0..3).all(|k| sides.insert([t[k], t[(k + 1) % 3]])), "a side twice, {t:?}");
    }
    assert!(sides.iter().all(|[a, b]| sides.contains(&[*b, *a])), "a side without a neighbour");
    // outward: by Gauss the volume of an eighth of a ball, which flat triangles cut a little short
    let p = |k: usize| [places[3 * k], places[3 * k + 1], places[3 * k + 2]];
    let volume: f64 = triangles
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [p(t[0]), p(t[1]), p(t[2])];
            let cross =
                [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
            (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
        })
        .sum();
    let ball = std::f64::consts::PI / 6.0;
    assert!(volume < 1.01 * ball && volume > 0.9 * ball, "{volume} of {ball}");
    // each drawn node is one of the mesh, and moves as it does
    let node = |k: usize| {
        let near = |m: &usize| {
            let at = stored.place(*m);
            (0..3).all(|c| (at[c] - p(k)[c]).abs() < 1e-6)
        };
        (0..stored.nodes.nrows()).find(near).unwrap()
    };
    let of: Vec<usize> = (0..n).map(node).collect();
    let frames = &view["motion"]["frames"];
    let u = numbers(&frames["u"]);
    let largest = u.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (r, row) in u.chunks_exact(3 * n).enumerate() {
        for (x, &m) in row.chunks_exact(3).zip(&of) {
            let own = stored.displacement(r, m);
            assert!((0..3).all(|c| (x[c] - own[c]).abs() < 2e-5 * largest), "{r} {m}");
        }
    }
    // pressures of contact nodes
    let (bearing, bears) = (whole("bearing"), numbers(&frames["bears"]));
    let peak = stored.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    assert_eq!(bears.len(), bearing.len() * stored.t.len());
    for (i, &m) in stored.contact_nodes.iter().enumerate() {
        let k = bearing.iter().position(|&k| of[k] == m).unwrap();
        for r in 0..stored.t.len() {
            let shown = bears[r * bearing.len() + k];
            assert!((shown - stored.pressure[(r, i)]).abs() < 1e-4 * peak, "{r} {i}");
        }
    }
    let touching = numbers(&body["contact"]["node"]);
    assert!(touching.iter().zip(&stored.contact_nodes).all(|(k, m)| of[*k as usize] == *m));
}

/// Of a family so many orbits play as are asked for, those that are special among them.
#[test]
fn a_page_of_a_family_plays_as_many_orbits_as_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let scene = "scenarios/half-plate-response.toml";
    let words = ["response", scene, "--range", "1.4,1.6", "--ratios", "0.02"];
    fine(&[&words[..], &["-o", &at("r.h5"), "-q"]].concat());
    let size = |words: &[&str], count: usize| {
        fine(&[&["view", &at("r.h5"), "--no-open"], words].concat());
        let page = data(Path::new(&at("r.html")));
        let view = &page["views"][0];
        let plays = |p: &&Value| !p["frames"].is_null();
        let points = view["points"].as_array().unwrap();
        assert_eq!(points.iter().filter(plays).count(), count, "{words:?}");
        let said = view["why"].as_str().map(str::to_owned);
        (fs::metadata(at("r.html")).unwrap().len(), points.len(), said)
    };
    let family = StoredFamily::read(Path::new(&at("r.h5"))).unwrap();
    let all = family.points.iter().filter(|p| p.orbit.is_some()).count();
    let (whole, _, said) = size(&[], all);
    assert_eq!(said, None);
    let (small, points, said) = size(&["--orbits", "5"], 5);
    assert!(small < whole && points == family.points.len());
    assert_eq!(said.unwrap(), format!("5 of {all} orbits play"));
    assert_eq!(signorini(&["view", &at("r.h5"), "--orbits", "0"]).status.code(), Some(2));
}
