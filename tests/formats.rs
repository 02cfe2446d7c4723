//! Matrices of other programs: what CalculiX, Abaqus, Ansys and SciPy wrote of the same bodies, against what these programs say themselves (`tests/reference/formats/checks.json`).

use std::fmt::Write as _;
use std::path::Path;

use crate::common::{json, root, run};
use nalgebra::DMatrix;
use serde_json::Value;
use signorini::fem::Csr;
use signorini::fem::formats::{Written, read_matrix};
use signorini::scenario::Scene;

fn sample(name: &str) -> String {
    root().join("tests/reference/formats").join(name).display().to_string()
}

fn checks() -> Value {
    serde_json::from_str(&std::fs::read_to_string(sample("checks.json")).unwrap()).unwrap()
}

fn read(name: &str) -> Written {
    read_matrix(&std::fs::read(sample(name)).unwrap(), None)
        .unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// A scene of two matrices.
fn scene(folder: &Path, name: &str, [k, m]: [&str; 2], rest: &str) -> String {
    let text =
        format!("[body]\nkind = 'matrices'\nstiffness_matrix = '{k}'\nmass_matrix = '{m}'\n{rest}");
    written(folder, &format!("{name}.toml"), &text)
}

fn close(a: f64, b: f64, slack: f64) -> bool {
    (a - b).abs() <= slack * b.abs()
}

/// A scene is bad input, and why is said in these words.
fn refused(scene: &str, words: &str) {
    let output = run(&["modes", scene]);
    let said = String::from_utf8_lossy(&output.stderr).replace('│', " ");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(output.status.code() == Some(2) && said.contains(words), "{words}: {said}");
}

/// The first six frequencies of a scene are those that CalculiX printed, with nine to twelve digits.
fn same_frequencies(scene: &str, check: &Value, what: &str) {
    let said = json(&["modes", scene, "--count", "6"]);
    let printed = check["frequencies_hz"].as_array().unwrap();
    for (omega, hz) in said["open"]["omega"].as_array().unwrap().iter().zip(printed) {
        let own = omega.as_f64().unwrap() / std::f64::consts::TAU;
        // a punch file has ten digits of stiffnesses that nearly cancel
        let slack = if what.contains("pch") { 1e-8 } else { 1e-9 };
        assert!(close(own, hz.as_f64().unwrap(), slack), "{what}: {own} {hz}");
    }
}

/// Orders, entries, traces, and masses by direction, of files of CalculiX.
#[test]
fn inspect_tells_what_calculix_wrote() {
    let checks = checks();
    for body in ["block", "plate", "brick", "brick_roller"] {
        let check = &checks[body];
        let of = |ending: &str| json(&["inspect", &sample(&format!("{body}.{ending}"))]);
        let (k, m) = (of("sti"), of("mas"));
        assert_eq!((&k["rows"], &k["entries"]), (&check["n"], &check["entries_K"]), "{body}");
        assert_eq!(k["one_triangle"], true);
        for (said, wanted) in [(&k["trace"], &check["trace_K"]), (&m["trace"], &check["trace_M"])] {
            assert!(
                close(said.as_f64().unwrap(), wanted.as_f64().unwrap(), 1e-12),
                "{body} {said} {wanted}"
            );
        }
        for (k, direction) in m["directions"].as_array().unwrap().iter().enumerate() {
            let wanted = check["mass_in_matrix"][direction.to_string()].as_f64().unwrap();
            assert!(close(m["sums"][k].as_f64().unwrap(), wanted, 1e-12), "{body} {direction}");
        }
        if let Some(first) = check["first_dof"].as_str() {
            assert_eq!(k["names"][0], first);
        }
        // stiffness and mass of one name are one body
        let printed = check["frequencies_hz"].as_array().unwrap();
        assert_eq!(k["first_omega"], m["first_omega"]);
        for (omega, hz) in k["first_omega"].as_array().unwrap().iter().zip(printed) {
            let own = omega.as_f64().unwrap() / std::f64::consts::TAU;
            assert!(close(own, hz.as_f64().unwrap(), 1e-9), "{body}: {own} {hz}");
        }
        // a roller along no axis has left its row in another: 1 + tan² 30° = 4/3 of the mass
        let odd: &[&str] = if body == "brick_roller" { &["41"] } else { &[] };
        assert_eq!(m["uneven"], serde_json::json!(odd), "{body}");
    }
    let said = run(&["inspect", &sample("brick_roller.mas")]);
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(
        said.contains("node 41 has 1.333 times the mass in direction 2 that it has in 3"),
        "{said}"
    );
    // scenes that name the node are told so, others are not
    let folder = tempfile::tempdir().unwrap();
    let files = [sample("brick_roller.sti"), sample("brick_roller.mas")];
    for (node, count) in [("41.2", 1), ("43.2", 0)] {
        let rest = format!(
            "[[load]]\nkind = 'force'\ndisplacement = '{node}'\namplitude = 1.0\nomega = 1e4\n[run]\nuntil = 1e-5\n"
        );
        let scene = scene(folder.path(), "roller", [&files[0], &files[1]], &rest);
        let out = folder.path().join("r.h5").display().to_string();
        for said in [json(&["run", &scene, "-o", &out, "--force"]), json(&["modes", &scene])] {
            let warnings = said["warnings"].as_array().unwrap();
            let own = warnings.iter().map(|w| w.as_str().unwrap());
            let own = own.filter(|w| w.contains("1.333 times the mass"));
            assert_eq!(own.count(), count, "{node}: {warnings:?}");
        }
    }
}

/// Names in a list are names beside the matrices; nodes in equations of the deck are not to be named.
#[test]
fn rows_are_listed_and_equations_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let rest = "[contact]\nnodes = [101, 102, 103, 104, 105, 106, 107, 108, 109]\ndirection = 'x'\ngap = 2e-3\n\
        [[load]]\nkind = 'force'\ndisplacement = '145.1'\namplitude = 2e4\nomega = 6e4\n[run]\nuntil = 2e-4\n";
    for file in ["block.sti", "block.mas"] {
        std::fs::copy(sample(file), at(file)).unwrap();
    }
    let names = std::fs::read_to_string(sample("block.dof")).unwrap();
    let rows: Vec<&str> = names.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    let list = |rows: &[&str]| {
        let lines: Vec<String> = rows.iter().map(|row| row.replace('.', "; ")).collect();
        format!("node; direction\n{}\n", lines.join("\n"))
    };
    written(folder.path(), "rows.csv", &list(&rows));
    let own = ["block.sti", "block.mas"];
    let listed = scene(folder.path(), "listed", own, &format!("names = 'rows.csv'\n{rest}"));
    let files = [sample("block.sti"), sample("block.mas")];
    let beside = scene(folder.path(), "beside", [&files[0], &files[1]], rest);
    let [a, b] =
        [(&listed, "a.h5"), (&beside, "b.h5")].map(|(s, o)| json(&["run", s, "-o", &at(o)]));
    assert!(a["switches"].as_array().unwrap().len() > 1);
    assert_eq!(a["switches"], b["switches"]);
    written(folder.path(), "short.csv", &list(&rows[..80]));
    written(folder.path(), "odd.csv", &list(&rows).replace("145; 1", "145; w"));
    for (list, words) in [
        ("short.csv", "has 81 rows, and there are 80 names"),
        ("odd.csv", "is no node and direction"),
        ("none.csv", "none.csv"),
    ] {
        let bad = scene(folder.path(), "bad", own, &format!("names = '{list}'\n{rest}"));
        refused(&bad, words);
    }
    let nameless = scene(folder.path(), "nameless", own, rest);
    refused(&nameless, "names = \"rows.csv\"");
    // a deck with an equation between two nodes, by number and by set
    let deck_text = std::fs::read_to_string(sample("block.inp")).unwrap();
    let with =
        |terms: &str| deck_text.replacen("*NSET", &format!("*EQUATION\n2\n{terms}\n*NSET"), 1);
    for (terms, words) in [
        (
            "145, 1, 1.0, 149, 1, -1.0",
            "load[0].displacement: 145.1 is of a node in an *EQUATION or *MPC",
        ),
        ("TIP, 2, 1.0, 149, 1, -1.0", "contact.nodes: 101.1 is of a node in an *EQUATION or *MPC"),
    ] {
        written(folder.path(), "coupled.inp", &with(terms));
        let deck = format!("deck = 'coupled.inp'\nnames = 'rows.csv'\n{rest}");
        refused(&scene(folder.path(), "coupled", own, &deck), words);
    }
    let held = "[[support]]\nnodes = [149]\nfix = ['x']\n";
    let deck = format!("deck = 'coupled.inp'\nnames = 'rows.csv'\n{held}");
    refused(&scene(folder.path(), "coupled", own, &deck), "149.1 is of a node in an *EQUATION");
    let elsewhere = deck_text.replacen("*NSET", "*EQUATION, INPUT=more.txt\n*NSET", 1);
    written(folder.path(), "coupled.inp", &elsewhere);
    refused(&scene(folder.path(), "coupled", own, &deck), "INPUT= is not read");
    // a list beside names that are others
    let turned: Vec<&str> = rows.iter().rev().copied().collect();
    written(folder.path(), "turned.csv", &list(&turned));
    let both = format!("names = '{}'\n{rest}", at("turned.csv"));
    refused(
        &scene(folder.path(), "both", [&files[0], &files[1]], &both),
        "says other names than the matrices",
    );
}

/// Superelements of Nastran and CalculiX, files of MATLAB: numbers and names of their rows; a file of several matrices asks for the name of one.
#[test]
fn files_of_several_matrices_say_what_they_have() {
    let checks = checks();
    for (body, file, which, trace) in [
        ("super", "super.pch", "KAAX", "trace_K"),
        ("super", "super_hand.pch", "MAAX", "trace_M"),
        ("super", "super.op4", "KAA", "trace_K"),
        ("block", "block.mat", "M", "trace_M"),
        ("brick", "brick_dense.mat", "K", "trace_K"),
        ("brick", "brick_4.mat", "K", "trace_K"),
        // sparse: its blocks on the diagonal
        ("brick", "brick_4.mat", "S", "trace_K"),
        ("brick", "brick_arrays.npz", "K", "trace_K"),
        ("brick_sub", "brick_sub.mtx", "STIFFNESS", "trace_K"),
    ] {
        let said = json(&["inspect", &format!("{}:/{which}", sample(file))]);
        let check = &checks[body];
        assert_eq!(said["rows"], check["n"], "{file}");
        let (own, wanted) = (said["trace"].as_f64().unwrap(), check[trace].as_f64().unwrap());
        // a punch file has ten digits
        assert!(close(own, wanted, 1e-9), "{file}: {own} {wanted}");
        let names = said["names"].as_array().unwrap();
        if let Some(order) = check["order"].as_array().or(check["retained"].as_array()) {
            assert!(names.is_empty() == file.ends_with("op4"), "{file}");
            let mut sorted = [names.clone(), order.clone()];
            sorted.iter_mut().for_each(|l| l.sort_by_key(Value::to_string));
            assert!(names.is_empty() || sorted[0] == sorted[1], "{names:?} {order:?}");
        } else {
            assert_eq!(names[0], check["first_dof"]);
        }
    }
    let own = |name: &str| read_matrix(&std::fs::read(sample(name)).unwrap(), None).unwrap();
    let [little, big] = ["brick_dense.mat", "brick_4_big_endian.mat"].map(own);
    assert_eq!(little.matrix, big.matrix);
    for (file, list) in [
        ("super.pch", "KAAX, MAAX"),
        ("block.mat", "K, M"),
        ("super.op4", "KAA, MAA"),
        ("brick_4.mat", "K, S"),
    ] {
        let bytes = std::fs::read(sample(file)).unwrap();
        let why = read_matrix(&bytes, None).unwrap_err();
        assert!(why.contains(list) && why.contains("FILE:/K"), "{why}");
        let why = read_matrix(&bytes, Some("B")).unwrap_err();
        assert!(why.contains("no matrix B") && why.contains(list), "{why}");
        let said = json(&["inspect", &sample(file)]);
        let named = said["matrices"].as_array().unwrap().iter();
        let square = named.filter(|m| m["shape"][0] == m["shape"][1] && m["shape"][0] != 1);
        let names: Vec<&str> = square.map(|m| m["name"].as_str().unwrap()).collect();
        assert_eq!(names.join(", "), list);
    }
}

/// Frequencies and static displacements are those that CalculiX printed; the same body by Abaqus's, Ansys's and SciPy's files has them too.
#[test]
fn every_format_has_the_frequencies_of_its_program() {
    let folder = tempfile::tempdir().unwrap();
    let checks = checks();
    for (body, k, m) in [
        ("block", "block.sti", "block.mas"),
        ("plate", "plate.sti", "plate.mas"),
        ("brick", "brick.sti", "brick.mas"),
        ("brick_roller", "brick_roller.sti", "brick_roller.mas"),
        ("brick", "brick_STIF1.mtx", "brick_MASS1.mtx"),
        ("brick", "brick_K.matrix", "brick_M.matrix"),
        ("block", "block_K.npz", "block_M.npz"),
        ("block", "block.mat:/K", "block.mat:/M"),
        ("brick", "brick_dense.mat", "brick.mas"),
        ("super", "super.pch:/KAAX", "super.pch:/MAAX"),
        ("super", "super_hand.pch:/kaax", "super_hand.pch:/maax"),
        ("super", "super.op4:/KAA", "super.op4:/MAA"),
    ] {
        let scene = scene(folder.path(), "s", [&sample(k), &sample(m)], "");
        same_frequencies(&scene, &checks[body], k);
    }
    for body in ["block", "plate", "brick"] {
        let check = &checks[body]["static"];
        let mut rest =
            "[initial]\nequilibrium = true\n[run]\nuntil = 1e-9\nsamples = 1\n".to_owned();
        for load in check["loads"].as_array().unwrap() {
            let _ = write!(
                rest,
                "[[load]]\nkind = 'force'\ndisplacement = '{}.{}'\namplitude = {:?}\n",
                load["node"],
                load["direction"],
                load["force"].as_f64().unwrap()
            );
        }
        let file = |ending: &str| sample(&format!("{body}.{ending}"));
        let scene = scene(folder.path(), "s", [&file("sti"), &file("mas")], &rest);
        let said = json(&[
            "run",
            &scene,
            "-o",
            &folder.path().join("s.h5").display().to_string(),
            "--force",
        ]);
        let names: Vec<String> = std::fs::read_to_string(file("dof"))
            .unwrap()
            .lines()
            .map(|l| l.trim().to_owned())
            .collect();
        for (node, solved) in check["displacements_solved"].as_object().unwrap() {
            for (direction, u) in solved.as_object().unwrap() {
                let row = names.iter().position(|n| *n == format!("{node}.{direction}")).unwrap();
                let own = said["final"]["u"][row].as_f64().unwrap();
                assert!(
                    (own - u.as_f64().unwrap()).abs() < 1e-9 * 2e-2,
                    "{body} {node}.{direction}: {own} {u}"
                );
            }
        }
    }
}

const NOSE: &str = "gap = 0.002\nmethod = 'mass-redistribution'\n[[load]]\nkind = 'force'\ndisplacement = '145.1'\namplitude = 2e4\nomega = 6e4\n\
[[probe]]\nname = 'corner'\nnode = '109.3'\n[run]\nuntil = 4e-4\nsamples = 40\n";

/// Rows by names are rows by numbers; a name with a minus is the same as matrices of which that row and column have the other sign; tables have the names.
#[test]
fn names_stand_for_rows() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let files = [sample("block.sti"), sample("block.mas")];
    let files = [files[0].as_str(), files[1].as_str()];
    let tip = ["101.1", "102.1", "103.1", "104.1", "105.1", "106.1", "107.1", "108.1", "109.1"];
    let names = std::fs::read_to_string(sample("block.dof")).unwrap();
    let row = |name: &str| names.lines().position(|l| l.trim() == name).unwrap();
    let numbered = |text: &str| {
        text.replace("'145.1'", &row("145.1").to_string())
            .replace("'109.3'", &row("109.3").to_string())
    };
    let by_name = scene(
        folder.path(),
        "names",
        files,
        &format!("[contact]\ndisplacements = {tip:?}\n{NOSE}"),
    );
    let rows: Vec<usize> = tip.iter().map(|n| row(n)).collect();
    let by_row = scene(
        folder.path(),
        "rows",
        files,
        &numbered(&format!("[contact]\ndisplacements = {rows:?}\n{NOSE}")),
    );
    let [a, b] =
        [(&by_name, "a.h5"), (&by_row, "b.h5")].map(|(s, o)| json(&["run", s, "-o", &at(o)]));
    assert!(a["switches"].as_array().unwrap().len() > 4, "{a}");
    assert_eq!(a["switches"], b["switches"]);
    assert_eq!((&a["final"], &a["probes"]), (&b["final"], &b["probes"]));
    // the file is read again where the matrices are not
    std::fs::create_dir(folder.path().join("elsewhere")).unwrap();
    std::fs::copy(at("a.h5"), at("elsewhere/a.h5")).unwrap();
    json(&["export", &at("elsewhere/a.h5")]);
    let csv = std::fs::read_to_string(at("elsewhere/a.csv")).unwrap();
    let head = csv.lines().next().unwrap();
    assert!(head.contains("u_n[105.1]") && head.contains("displacement_z[corner]"), "{head}");
    // towards −x: by a minus, and by matrices whose rows are turned by hand
    let turned: Vec<String> = tip.iter().map(|n| format!("-{n}")).collect();
    let minus = scene(
        folder.path(),
        "minus",
        files,
        &format!("[contact]\ndisplacements = {turned:?}\n{NOSE}"),
    );
    for (name, out) in [("block.sti", "K.mtx"), ("block.mas", "M.mtx")] {
        let a = read(name).matrix;
        let sign = |i: usize| if rows.contains(&i) { -1.0 } else { 1.0 };
        let mut text = format!(
            "%%MatrixMarket matrix coordinate real general\n81 81 {}\n",
            a.triplets().count()
        );
        a.triplets().for_each(|(i, j, v)| {
            let _ = writeln!(text, "{} {} {:e}", i + 1, j + 1, sign(i) * sign(j) * v);
        });
        written(folder.path(), out, &text);
    }
    let by_hand = scene(
        folder.path(),
        "hand",
        ["K.mtx", "M.mtx"],
        &numbered(&format!("[contact]\ndisplacements = {rows:?}\n{NOSE}")),
    );
    let [c, d] =
        [(&minus, "c.h5"), (&by_hand, "d.h5")].map(|(s, o)| json(&["run", s, "-o", &at(o)]));
    // nodes that mirror each other switch at one time, in the order of rounding
    let times = |said: &Value| -> Vec<f64> {
        said["switches"].as_array().unwrap().iter().map(|s| s["t"].as_f64().unwrap()).collect()
    };
    let (of_a, of_c, of_d) = (times(&a), times(&c), times(&d));
    assert!(of_c.len() == of_d.len() && of_c.len() > 4, "{} {}", of_c.len(), of_d.len());
    assert!(of_c.iter().zip(&of_d).all(|(c, d)| (c - d).abs() < 1e-8 * 4e-4), "{of_c:?} {of_d:?}");
    assert!((of_a[0] - of_c[0]).abs() > 1e-6, "{of_a:?}");
    for (names, words) in [
        ("['1019.1']", "no row is called \"1019.1\""),
        ("['109.4']", "this node has 109.1, 109.2, 109.3"),
        ("['TIP']", "no row is called"),
    ] {
        let scene = scene(
            folder.path(),
            "bad",
            files,
            &format!("[contact]\ndisplacements = {names}\ngap = 1.0\n"),
        );
        refused(&scene, words);
    }
}

/// Supports hold rows by the numbers of their nodes, or a set of the deck: the same as matrices without these rows, in frequencies and in a motion whose contact is named.
#[test]
fn supports_hold_rows() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let files = [sample("block.sti"), sample("block.mas")];
    let files = [files[0].as_str(), files[1].as_str()];
    let names = std::fs::read_to_string(sample("block.dof")).unwrap();
    let names: Vec<&str> = names.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    let deck = format!("deck = '{}'\n", sample("block.inp"));
    let tip: Vec<String> = (101..=109).map(|n| format!("{n}.2")).collect();
    let rest = |contact: &str| {
        format!(
            "[contact]\ndisplacements = ['145.1']\ngap = 5e-3\nstress = 'reaction'\n[[load]]\nkind = 'force'\ndisplacement = {contact}\namplitude = 2e4\nomega = 6e4\n[run]\nuntil = 4e-4\n"
        )
    };
    for (supports, held) in [
        ("[[support]]\nnodes = 'TIP'\nfix = ['y']\n", tip),
        (
            "[[support]]\nnodes = [109, 107]\nfix = ['x', 'z']\n[[support]]\nnodes = [101]\nfix = ['y']\n",
            ["109.1", "109.3", "107.1", "107.3", "101.2"].map(String::from).to_vec(),
        ),
    ] {
        let kept: Vec<usize> =
            (0..names.len()).filter(|k| !held.iter().any(|h| h == names[*k])).collect();
        assert_eq!(kept.len(), names.len() - held.len());
        for (name, out) in [("block.sti", "K.mtx"), ("block.mas", "M.mtx")] {
            let a = read(name).matrix;
            let place = |i: usize| kept.iter().position(|k| *k == i);
            let entries: Vec<_> =
                a.triplets().filter_map(|(i, j, v)| Some((place(i)?, place(j)?, v))).collect();
            let (n, count) = (kept.len(), entries.len());
            let mut text =
                format!("%%MatrixMarket matrix coordinate real general\n{n} {n} {count}\n");
            entries.iter().for_each(|(i, j, v)| {
                let _ = writeln!(text, "{} {} {v:e}", i + 1, j + 1);
            });
            written(folder.path(), out, &text);
        }
        let row = |name: &str| kept.iter().position(|k| names[*k] == name).unwrap();
        let own = scene(folder.path(), "own", files, &(deck.clone() + supports + &rest("'105.1'")));
        let hand = rest(&row("105.1").to_string()).replace("'145.1'", &row("145.1").to_string());
        let hand = scene(folder.path(), "hand", ["K.mtx", "M.mtx"], &hand);
        let [a, b] = [&own, &hand].map(|s| json(&["modes", s, "--count", "6"]));
        assert_eq!(a["n_o"], b["n_o"]);
        for (a, b) in a["open"]["omega"]
            .as_array()
            .unwrap()
            .iter()
            .zip(b["open"]["omega"].as_array().unwrap())
        {
            assert!(close(a.as_f64().unwrap(), b.as_f64().unwrap(), 1e-11), "{a} {b}");
        }
        let [a, b] = [(&own, "a.h5"), (&hand, "b.h5")]
            .map(|(s, o)| json(&["run", s, "-o", &at(o), "--force"]));
        let times = |said: &Value| -> Vec<f64> {
            said["switches"].as_array().unwrap().iter().map(|s| s["t"].as_f64().unwrap()).collect()
        };
        let (a, b) = (times(&a), times(&b));
        assert!(a.len() == b.len() && a.len() > 1, "{} {}", a.len(), b.len());
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * 4e-4), "{a:?} {b:?}");
    }
    for (supports, words) in [
        ("[[support]]\nnodes = [1019]\nfix = ['x']\n", "no row is called \"1019.1\""),
        ("[[support]]\nnodes = 'TOP'\nfix = ['x']\n", "there is no set \"TOP\""),
        ("[[support]]\nedge = 'left'\nfix = ['x']\n", "has no edges"),
        ("[[support]]\nnodes = [109]\nfix = ['normal']\n", "displacements along axes"),
        (
            "[[support]]\nnodes = 'TIP'\nfix = ['x']\n[contact]\ndisplacements = ['105.1']\ngap = 1.0\n",
            "no row is called \"105.1\"",
        ),
    ] {
        let bad = scene(folder.path(), "bad", files, &(deck.clone() + supports));
        refused(&bad, words);
    }
    // rows without names cannot be held
    let nameless = scene(
        folder.path(),
        "nameless",
        ["K.mtx", "M.mtx"],
        "[[support]]\nnodes = [3]\nfix = ['x']\n",
    );
    refused(&nameless, "support");
}

/// Rows without mass follow statically: the same motion as of matrices that are condensed by hand.
#[test]
fn what_has_no_mass_follows() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (k, m) = (read("block.sti").matrix, read("block.mas").matrix);
    let n = k.n_rows();
    let gone: Vec<usize> = (30..36).chain([50, 51]).collect();
    let kept: Vec<usize> = (0..n).filter(|i| !gone.contains(i)).collect();
    let dense = |a: &Csr| {
        let mut d = DMatrix::zeros(n, n);
        a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
        d
    };
    let (k, mut m) = (dense(&k), dense(&m));
    gone.iter().for_each(|&i| {
        m.row_mut(i).fill(0.0);
        m.column_mut(i).fill(0.0);
    });
    let part = |a: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| a[(rows[i], columns[j])])
    };
    let inner = part(&k, &gone, &gone).cholesky().unwrap().solve(&part(&k, &gone, &kept));
    let condensed = part(&k, &kept, &kept) - part(&k, &kept, &gone) * inner;
    let condensed = 0.5 * (&condensed + condensed.transpose());
    let file = |name: &str, a: &DMatrix<f64>| {
        let mut text =
            format!("%%MatrixMarket matrix array real general\n{} {}\n", a.nrows(), a.ncols());
        a.iter().for_each(|v| {
            let _ = writeln!(text, "{v:e}");
        });
        written(folder.path(), name, &text);
    };
    file("K.mtx", &k);
    file("M.mtx", &m);
    file("K2.mtx", &condensed);
    file("M2.mtx", &part(&m, &kept, &kept));
    let rest = "[contact]\ndisplacements = [0, 3, 6, 9, 12]\ngap = 0.002\nmethod = 'mass-redistribution'\n\
                [[load]]\nkind = 'force'\ndisplacement = 12\namplitude = 4e3\nomega = 6e4\n[run]\nuntil = 4e-4\nsamples = 10\n";
    let whole = scene(folder.path(), "whole", ["K.mtx", "M.mtx"], rest);
    let small = scene(folder.path(), "small", ["K2.mtx", "M2.mtx"], rest);
    let [a, b] = [(&whole, "a.h5"), (&small, "b.h5")].map(|(s, o)| json(&["run", s, "-o", &at(o)]));
    let times = |said: &Value| -> Vec<f64> {
        said["switches"].as_array().unwrap().iter().map(|s| s["t"].as_f64().unwrap()).collect()
    };
    let (a, b) = (times(&a), times(&b));
    assert!(a.len() == b.len() && a.len() > 4, "{a:?} {b:?}");
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-9 * 4e-4, "{a} {b}");
    }
    // without contact too
    let free = scene(folder.path(), "free", ["K.mtx", "M.mtx"], "");
    let held = scene(folder.path(), "held", ["K2.mtx", "M2.mtx"], "");
    let [a, b] =
        [&free, &held].map(|s| json(&["modes", s, "--count", "5"])["open"]["omega"].clone());
    for (a, b) in a.as_array().unwrap().iter().zip(b.as_array().unwrap()) {
        assert!(close(a.as_f64().unwrap(), b.as_f64().unwrap(), 1e-9), "{a} {b}");
    }
    let springs = scene(
        folder.path(),
        "springs",
        ["K.mtx", "M.mtx"],
        "[contact]\ndisplacements = [0]\ngap = 0.1\nmethod = 'penalty'\nstiffness = 1e5\n",
    );
    let output = run(&["modes", &springs]);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
}

/// The content of a file with something cut off, changed, left out or put in.
fn spoilt(bytes: &[u8], seed: &mut u64) -> Vec<u8> {
    let mut random = |n: usize| {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 33) as usize % n
    };
    let mut bad = bytes.to_vec();
    match random(4) {
        0 => bad.truncate(random(bytes.len())),
        1 => (0..1 + random(5)).for_each(|_| {
            let at = random(bytes.len());
            bad[at] = random(256) as u8;
        }),
        2 => {
            let at = random(bytes.len());
            bad.drain(at..(at + 1 + random(40)).min(bytes.len()));
        }
        _ => {
            let at = random(bytes.len());
            bad.splice(at..at, (0..1 + random(9)).map(|_| b"0123456789-.,eD \n"[random(17)]));
        }
    }
    bad
}

/// Damaged in every way that comes to mind: refused with a reason or read, never a panic; and what is cut short, or says something else than it holds, is refused.
#[test]
fn damaged_files_are_refused() {
    let samples = [
        "block.sti",
        "brick_STIF1.mtx",
        "brick_COORD_MASS1.mtx",
        "brick_K.matrix",
        "brick_K.npz",
        "block_M.npz",
        "block.mat",
        "brick_dense.mat",
        "brick_4.mat",
        "brick_arrays.npz",
        "super.pch",
        "super_hand.pch",
        "super.op4",
        "brick_sub.mtx",
    ];
    let mut seed = 20261127u64;
    let mut refused = 0;
    for name in samples {
        let bytes = std::fs::read(sample(name)).unwrap();
        for _ in 0..200 {
            let bad = spoilt(&bytes, &mut seed);
            if let Err(why) = read_matrix(&bad, None) {
                assert!(!why.is_empty());
                refused += 1;
            }
        }
    }
    assert!(refused > 600, "{refused}");
}

/// A deck of CalculiX is a mesh: its frequencies are those that CalculiX printed, by elements of this program, at the sets and surfaces of the deck.
#[test]
fn decks_are_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let checks = checks();
    for body in ["block", "brick"] {
        let of = |held: &str, rest: &str| {
            let text = format!(
                "[body]\nkind = 'mesh'\nfile = '{}'\n[[material]]\ngroup = 'BODY'\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
                 [[support]]\ngroup = '{held}'\nfix = ['x', 'y', 'z']\n{rest}",
                sample(&format!("{body}.inp"))
            );
            written(folder.path(), "deck.toml", &text)
        };
        same_frequencies(&of("WALL", ""), &checks[body], body);
        // the surface and the set of nodes are the same face
        let by = |group: &str| {
            json(&["inspect", &of("WALL", &format!("[contact]\ngroup = '{group}'\ngap = 0.1\n"))])
        };
        assert_eq!(by("FRONT")["n_contact"], by("TIP")["n_contact"]);
    }
    let said = json(&["inspect", &sample("block.inp")]);
    assert_eq!((&said["format"], &said["nodes"]), (&Value::from("deck"), &Value::from(36)));
}

/// A deck in four files, in folders of their own, is the deck in one; what is wrong is told of the file where it is, and what they say counts to a run that goes on.
#[test]
fn decks_may_be_in_several_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    let text = std::fs::read_to_string(sample("block.inp")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let piece = |from: usize, to: usize| lines[from - 1..to].join("\n") + "\n";
    written(folder.path(), "parts/nodes.dat", &piece(4, 39));
    let cells = piece(40, 52) + "*Include, input=sets.inp\n";
    written(folder.path(), "parts/cells.inp", &cells);
    written(folder.path(), "parts/sets.inp", &piece(53, 63));
    let head = "*HEADING\nin pieces\n*NODE, NSET=ALL, INPUT=parts/nodes.dat\n** the rest\n*INCLUDE,\n INPUT = parts/cells.inp\n*STEP\n*INCLUDE, INPUT=loads.inp\n";
    let deck = written(folder.path(), "whole.inp", head);
    let scene = |file: &str| {
        let text = format!(
            "[body]\nkind = 'mesh'\nfile = '{file}'\n[[material]]\ngroup = 'BODY'\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
             [[support]]\ngroup = 'WALL'\nfix = ['x', 'y', 'z']\n"
        );
        written(folder.path(), "scene.toml", &text)
    };
    let said = |file: &str| json(&["inspect", file]);
    let (whole, pieces) = (said(&sample("block.inp")), said(&deck));
    assert_eq!(whole["nodes"], 36);
    for key in whole.as_object().unwrap().keys().filter(|k| *k != "file") {
        assert_eq!(whole[key], pieces[key], "{key}");
    }
    same_frequencies(&scene(&deck), &checks()["block"], "block");
    // the files are among those that a scene names
    let parsed = Scene::parse(&std::fs::read_to_string(scene(&deck)).unwrap(), Path::new("s.toml"));
    assert_eq!(parsed.unwrap().files().len(), 4);
    for (file, from, to, words) in [
        ("parts/sets.inp", "NSET=TIP", "NSET=TIP, INSTANCE=A-1", "sets.inp, line 5"),
        ("parts/nodes.dat", "101, 30", "101, x", "nodes.dat, line 1"),
        ("parts/cells.inp", "TYPE=C3D8", "TYPE=S4", "cells.inp, line 1"),
        ("parts/cells.inp", "input=sets.inp", "input=set.inp", "line 14: set.inp cannot be read"),
        ("parts/cells.inp", "input=sets.inp", "input=cells.inp", "cells.inp includes itself"),
        ("whole.inp", "in pieces\n", "in pieces\n*EQUATION\n", "whole.inp: line 3"),
    ] {
        let path = folder.path().join(file);
        let before = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, before.replacen(from, to, 1)).unwrap();
        let out = run(&["modes", &scene(&deck)]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{said}");
        let said: String =
            said.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(said.contains(words), "{words}: {said}");
        std::fs::write(&path, before).unwrap();
    }
}

/// One part twice, the second moved and then turned, tied at matching nodes: the frequencies that CalculiX printed of the flat deck with its tie.
#[test]
fn instances_and_ties_are_one_body() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(sample("assembly.inp")).unwrap();
    let scene = |deck: &str, rest: &str| {
        let deck = written(folder.path(), "assembly.inp", deck);
        let text = format!(
            "[body]\nkind = 'mesh'\nfile = '{deck}'\n[[material]]\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
             [[support]]\ngroup = 'Clamp'\nfix = ['x', 'y', 'z']\n{rest}"
        );
        written(folder.path(), "assembly.toml", &text)
    };
    let checks = checks();
    same_frequencies(&scene(&text, ""), &checks["assembly"], "assembly");
    let said = json(&["inspect", &sample("assembly.inp")]);
    assert_eq!(said["nodes"], 20);
    let contact = "[contact]\ngroup = 'Nose'\ngap = 0.1\n[run]\nuntil = 1e-6\n";
    let inspected = json(&["inspect", &scene(&text, contact)]);
    assert_eq!(inspected["n_contact"], 4);
    // sets of parts carry the name of their instance; the free end of the second lies where its twelfth node was said to be
    let named = "[contact]\ngroup = 'Arm-2.Free end'\nplane = { normal = [0.0, 1.0, 0.0], offset = 15.5 }\n";
    assert_eq!(json(&["inspect", &scene(&text, named)])["n_contact"], 4);
    // surfaces that do not match, and parts that are not placed
    for (from, to, words) in [
        ("position tolerance=0.01", "position tolerance=1e-9", ""),
        (
            "          10.,           5.,           0.\n",
            "          10.,           5.,           0.5\n",
            "has no partner within",
        ),
        ("Foot, Seat", "Foot, Nose", "surface \"Nose\""),
        ("instance=Arm-1, generate", "instance=Arm-7, generate", "instance \"Arm-7\""),
        ("*Instance, name=Arm-2", "*Instance, name=Arm-1", "two instances \"Arm-1\""),
        // a tie that would bend elements, and one that may move nothing
        ("tolerance=0.01", "tolerance=3.0", ""),
        ("adjust=yes", "adjust=no", ""),
    ] {
        assert!(text.contains(from), "{from}");
        let output = run(&["inspect", &scene(&text.replacen(from, to, 1), "")]);
        let said = String::from_utf8_lossy(&output.stderr).replace('│', " ");
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code() == Some(2), !words.is_empty(), "{from}: {said}");
        assert!(said.contains(words), "{from}: {said}");
    }
}

/// A brick that meshio and VTK wrote in every way they know (text, base64, appended raw and as base64, zlib or not, either order of bytes) is that of CalculiX.
/// Bulk data of Nastran, as pyNastran wrote them: the frequencies that CalculiX printed for the deck of the same mesh.
#[test]
fn bulk_data_are_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let file = sample("brick.bdf");
    let text = format!(
        "[body]\nkind = 'mesh'\nfile = '{file}'\n[[material]]\ngroup = 'property 1'\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
         [[support]]\ngroup = 'spc 1'\nfix = ['x', 'y', 'z']\n[contact]\ngroup = 'set 2'\ngap = 1.0\nmethod = 'penalty'\n"
    );
    same_frequencies(&written(folder.path(), "bulk.toml", &text), &checks()["brick"], &file);
    let said = json(&["inspect", &file]);
    assert_eq!((&said["format"], &said["nodes"]), (&Value::from("bulk data"), &Value::from(16)));
    let bytes = std::fs::read(&file).unwrap();
    let (mut seed, mut refused) = (20261129u64, 0);
    for _ in 0..300 {
        if let Err(why) = signorini::problem::read_mesh(&spoilt(&bytes, &mut seed)) {
            assert!(!why.to_string().is_empty());
            refused += 1;
        }
    }
    assert!(refused > 30, "{refused}");
}

#[test]
fn files_of_vtk_are_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let checks = checks();
    for file in [
        "brick",
        "brick_zlib",
        "brick_raw",
        "brick_appended",
        "brick_big",
        "brick_binary",
        "brick_inline",
    ] {
        let file = sample(&format!("{file}.vtu"));
        let text = format!(
            "[body]\nkind = 'mesh'\nfile = '{file}'\n[[material]]\ngroup = 'material 1'\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
             [[support]]\ngroup = 'WALL'\nfix = ['x', 'y', 'z']\n[contact]\ngroup = 'TIP'\ngap = 1.0\nmethod = 'penalty'\n"
        );
        same_frequencies(&written(folder.path(), "vtu.toml", &text), &checks["brick"], &file);
        let said = json(&["inspect", &file]);
        assert_eq!((&said["format"], &said["nodes"]), (&Value::from("VTK"), &Value::from(16)));
    }
    // points count from 0, as in the file
    let text = std::fs::read_to_string(sample("brick.vtu")).unwrap();
    let tip = |node: usize| {
        let scene = format!(
            "[body]\nkind = 'mesh'\nfile = '{}'\n[[material]]\nyoung = 210000.0\npoisson = 0.3\ndensity = 7.85e-9\n\
             [[support]]\ngroup = 'WALL'\nfix = ['x', 'y', 'z']\n[contact]\ngroup = 'TIP'\nnodes = [{node}]\ngap = 1.0\n",
            sample("brick.vtu")
        );
        run(&["inspect", &written(folder.path(), "nodes.toml", &scene)]).status.code()
    };
    assert_eq!((tip(12), tip(15), tip(16)), (Some(0), Some(0), Some(2)));
    for (from, to, words) in [
        ("NumberOfPoints=\"16\"", "NumberOfPoints=\"15\"", "says NumberOfPoints"),
        ("Name=\"WALL\"", "Name=\"TIP\"", "two groups \"TIP\""),
    ] {
        assert!(text.contains(from), "{from}");
        let why = signorini::problem::read_mesh(text.replacen(from, to, 1).as_bytes());
        let why = why.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(why.contains(words), "{from}: {why}");
    }
    let mut seed = 20261128u64;
    for name in
        ["brick.vtu", "brick_raw.vtu", "brick_appended.vtu", "brick_big.vtu", "brick_inline.vtu"]
    {
        let bytes = std::fs::read(sample(name)).unwrap();
        let mut refused = 0;
        for _ in 0..300 {
            let bad = spoilt(&bytes, &mut seed);
            if let Err(why) = signorini::problem::read_mesh(&bad) {
                assert!(!why.to_string().is_empty());
                refused += 1;
            }
        }
        assert!(refused > 100, "{name}: {refused}");
    }
}
