//! Bodies from matrices before obstacles that are along no axis, before several, and on supports that move: against the same body in a frame along the obstacle, and against bodies of elements.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use serde_json::Value;
use signorini::fem::formats::read_matrix;
use signorini::fem::{Body, DofMap, MassForm, Material};
use signorini::mesh::structured;
use signorini::problem::Problem;
use signorini::scenario::Scene;

use crate::common::{hdf5_files, json, root, run};

fn sample(name: &str) -> String {
    root().join("tests/reference/formats").join(name).display().to_string()
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    std::fs::write(folder.join(name), text).unwrap();
    folder.join(name).display().to_string()
}

fn market(a: &DMatrix<f64>) -> String {
    let n = a.nrows();
    let mut text = format!("%%MatrixMarket matrix array real general\n{n} {n}\n");
    a.iter().for_each(|v| {
        let _ = writeln!(text, "{v:.17e}");
    });
    text
}

fn dense(name: &str) -> DMatrix<f64> {
    let a = read_matrix(&std::fs::read(sample(name)).unwrap(), None).unwrap().matrix;
    let mut all = DMatrix::zeros(a.n_rows(), a.n_cols());
    a.triplets().for_each(|(i, j, v)| all[(i, j)] += v);
    all
}

/// The header and the rows of a table.
fn columns(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let words = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let mut lines = text.lines();
    (words(lines.next().unwrap()), lines.map(words).collect())
}

fn times(said: &Value) -> Vec<f64> {
    said["switches"].as_array().unwrap().iter().map(|s| s["t"].as_f64().unwrap()).collect()
}

/// The same switches, to a share of the time of a run.
fn same_switches(a: &Value, b: &Value, until: f64, what: &str) {
    let (a, b) = (times(a), times(b));
    assert!(a.len() == b.len() && a.len() > 1, "{what}: {} {}", a.len(), b.len());
    let apart = a.iter().zip(&b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    eprintln!("{what}: {} switches, {:.1e} of the time apart", a.len(), apart / until);
    assert!(apart < 1e-9 * until, "{what}: {a:?} {b:?}");
}

fn refused(scene: &str, words: &str) {
    let output = run(&["modes", scene]);
    let said = String::from_utf8_lossy(&output.stderr).replace('│', " ");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(output.status.code() == Some(2) && said.contains(words), "{words}: {said}");
}

/// The block of CalculiX before a wall along no axis, with a load, a spring and probes along axes of a node that faces it: the same block in a frame along the wall, whose matrices are turned by
/// hand, all nodes by one rotation. In free-interface form too.
#[test]
fn an_oblique_wall_is_a_turned_frame() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let names = std::fs::read_to_string(sample("block.dof")).unwrap();
    let names: Vec<&str> = names.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    let row = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let n = Vector3::new(2.0, -3.0, 6.0) / 7.0;
    // any rotation whose first axis is n
    let frame = Rotation3::rotation_between(&Vector3::x(), &n).unwrap().into_inner()
        * Rotation3::from_axis_angle(&Vector3::x_axis(), 0.7).into_inner();
    let frame: Matrix3<f64> = frame.transpose();
    assert!((frame.row(0).transpose() - n).norm() < 1e-15);
    let mut turn = DMatrix::zeros(names.len(), names.len());
    for (i, name) in names.iter().enumerate() {
        let (node, c) = name.rsplit_once('.').unwrap();
        for d in 1..=3 {
            let c: usize = c.parse().unwrap();
            turn[(i, row(&format!("{node}.{d}")))] = frame[(c - 1, d - 1)];
        }
    }
    let (k, m) = (dense("block.sti"), dense("block.mas"));
    let mut held = k.clone();
    held[(row("103.2"), row("103.2"))] += 3e4;
    for (name, a) in [("K", &k), ("K-held", &held), ("M", &m)] {
        written(folder, &format!("{name}.mtx"), &market(&(&turn * a * turn.transpose())));
        std::fs::copy(sample("block.dof"), folder.join(format!("{name}.dof"))).unwrap();
    }
    let common = "gap = 2e-3\n[damping]\nmodal = 0.01\n[run]\nuntil = 4e-4\n";
    let load = |node: &str, c: usize, size: f64| {
        format!(
            "[[load]]\nkind = 'force'\ndisplacement = '{node}.{c}'\namplitude = {size:e}\nomega = 6e4\n"
        )
    };
    let probe = |c: usize| {
        format!("[[probe]]\nname = 'p{c}'\nnode = '101.{c}'\nquantity = ['displacement']\n")
    };
    let probes: String = (1..=3).map(probe).collect();
    let along = "[[probe]]\nname = 'p4'\nnode = '101.n'\nquantity = ['displacement']\n";
    let forces = Vector3::new(3e3, -1e4, 2e4);
    // of the free-interface form the same rows have to stay: no spring
    let spring = "[[spring]]\nrow = '103.2'\nstiffness = 3e4\n";
    let free = "[reduction]\nkind = 'free-interface'\nmodes = 9\n";
    let falls = |a: Vector3<f64>| {
        format!(
            "[[load]]\nkind = 'gravity'\namplitude = [{:e}, {:e}, {:e}]\nomega = 4e4\n",
            a[0], a[1], a[2]
        )
    };
    let pull = Vector3::new(-4e5, 9e5, 2e5);
    for (what, more, stiffness) in
        [("block", spring, "K-held"), ("block, free interface", free, "K")]
    {
        let own = format!(
            "[body]\nkind = 'matrices'\nstiffness_matrix = '{}'\nmass_matrix = '{}'\ndeck = '{}'\n\
             [contact]\nnodes = 'TIP'\ndirection = [2, -3, 6]\n{common}{probes}{along}{}{}{more}{}",
            sample("block.sti"),
            sample("block.mas"),
            sample("block.inp"),
            load("145", 1, forces[0]) + &load("145", 2, 4e3),
            load("101", 2, forces[1]) + &load("145", 3, forces[2]),
            if more == free { String::new() } else { falls(pull) },
        );
        let of = |f: Vector3<f64>, node: &str| -> String {
            let turned = frame * f;
            (1..=3).map(|c| load(node, c, turned[c - 1])).collect()
        };
        let hand = format!(
            "[body]\nkind = 'matrices'\nstiffness_matrix = '{stiffness}.mtx'\nmass_matrix = 'M.mtx'\n\
             [contact]\nnodes = [101, 102, 103, 104, 105, 106, 107, 108, 109]\ndirection = 'x'\n{common}{probes}{}{}{}",
            of(Vector3::new(forces[0], 4e3, forces[2]), "145"),
            of(Vector3::new(0.0, forces[1], 0.0), "101"),
            if more == free { free.to_owned() } else { falls(frame * pull) },
        );
        let deck = std::fs::read_to_string(sample("block.inp")).unwrap();
        assert!(deck.contains("NSET=TIP"), "the set of the test");
        let own = written(folder, "own.toml", &own);
        let hand = written(folder, "hand.toml", &hand);
        let [a, b] = [&own, &hand].map(|s| json(&["modes", s, "--count", "6"]));
        let omega = |said: &Value| -> Vec<f64> {
            let all = said["open"]["omega"].as_array().unwrap();
            all.iter().map(|w| w.as_f64().unwrap()).collect()
        };
        let pairs = omega(&a).into_iter().zip(omega(&b));
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-9 * b, "{what}: {a} {b}"));
        let files = ["a.h5", "b.h5"].map(|f| folder.join(f).display().to_string());
        let a = json(&["run", &own, "-o", &files[0], "--force"]);
        let b = json(&["run", &hand, "-o", &files[1], "--force"]);
        same_switches(&a, &b, 4e-4, what);
        assert_eq!(a["switches"][0]["name"].as_str().unwrap().rsplit_once('.').unwrap().1, "n");
        // tables by names
        run(&["export", &files[0], "--nodes", "101.n,101.t2", "-q", "--force"]);
        let (header, rows) = columns(&folder.join("a.csv"));
        let of = |name: &str| {
            let k = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("{header:?}"));
            rows.iter().map(|row| row[k].clone()).collect::<Vec<_>>()
        };
        assert_eq!(of("u[101.n]"), of("u_n[101.n]"));
        assert_ne!(of("u[101.t2]"), of("u[101.n]"));
        let (header, rows) = columns(&folder.join("a-switches.csv"));
        let k = header.iter().position(|h| h == "contact").unwrap();
        let named = a["switches"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap());
        assert!(named.eq(rows.iter().map(|row| &row[k][..])), "{rows:?}");
        let [a, b] = files.map(|f| hdf5_files().open(f).unwrap());
        let at = |file: &hdf5::File, c: usize| -> Vec<f64> {
            file.dataset(&format!("probes/p{c}/displacement")).unwrap().read_raw().unwrap()
        };
        let turned: Vec<Vec<f64>> = (1..=3).map(|c| at(&b, c)).collect();
        for c in 1..=3 {
            let x = at(&a, c);
            let of = |i: usize| (0..3).map(|d| frame[(d, c - 1)] * turned[d][i]).sum::<f64>();
            assert!(x.len() > 300 && x.len() == turned[0].len());
            let size = x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let apart = (0..x.len()).fold(0.0f64, |m, i| m.max((x[i] - of(i)).abs()));
            assert!(apart < 1e-8 * size, "probe {c}: {apart:e} of {size:e}");
        }
        // the probe along the direction is that of the axes
        let own: Vec<Vec<f64>> = (1..=4).map(|c| at(&a, c)).collect();
        let size = own[3].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for i in 0..own[0].len() {
            let along: f64 = (0..3).map(|c| n[c] * own[c][i]).sum();
            assert!((own[3][i] - along).abs() < 1e-12 * size, "{} {along}", own[3][i]);
        }
    }
}

/// A plate between a rough wall along no axis, which slides, and a smooth one above: by elements, whose own frames take the wall, and by its matrices with two tables of nodes.
#[test]
fn matrices_before_two_obstacles_rub_as_elements_do() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let plate = "[body]\nkind = 'plate'\nsize = [2.0, 1.0]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x', 'y']\n";
    let free = written(folder, "free.toml", plate);
    let system = Problem::new(&Scene::read(free.as_ref()).unwrap(), None).unwrap().system;
    let (mesh, dofs, size) = (&system.body.mesh, &system.body.dofs, system.n());
    let mut names = vec![String::new(); size];
    for (node, c) in (0..mesh.n_nodes()).flat_map(|node| [(node, 0), (node, 1)]) {
        if let Some(i) = dofs.column(node, c) {
            names[i] = format!("{}.{}", node + 1, c + 1);
        }
    }
    for (name, a) in [("K", &system.body.stiffness), ("M", &system.body.mass)] {
        let mut all = DMatrix::zeros(size, size);
        a.triplets().for_each(|(i, j, v)| all[(i, j)] += v);
        written(folder, &format!("{name}.mtx"), &market(&all));
        written(folder, &format!("{name}.dof"), &names.join("\n"));
    }
    let place = |node: usize| mesh.nodes()[node];
    let right: Vec<usize> = mesh.group_nodes("right");
    let top: Vec<usize> = mesh
        .group_nodes("top")
        .into_iter()
        .filter(|n| (0.3..1.4).contains(&place(*n)[0]))
        .collect();
    let numbers = |nodes: &[usize]| {
        let all: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
        all.join(", ")
    };
    let middle = (0..mesh.n_nodes()).find(|n| {
        let [x, y, _] = place(*n);
        (x - 1.0).abs() < 1e-9 && (y - 1.0 / 3.0).abs() < 1e-9
    });
    let middle = middle.unwrap() + 1;
    let rest = "[damping]\nrayleigh = [0.02, 0.01]\n[run]\nuntil = 12.0\n";
    let force = |place: &str, size: &str| {
        format!("[[load]]\n{place}\namplitude = {size}\nomega = 0.9\nphase = 0.4\n")
    };
    let mut slips = 0;
    // near the axis of x, near that of y, and against both
    for n in [[0.8, 0.6], [0.6, 0.8], [0.8, -0.6]] {
        let offset = n[0] * 2.0 + f64::max(n[1], 0.0) + 0.02;
        let slope = [-n[1] * 0.05, n[0] * 0.05];
        let walls = format!(
            "[[contact]]\nedge = 'right'\nplane = {{ normal = [{}, {}], offset = {offset} }}\nfriction = 0.3\nsurface = [{}, {}]\n\
             [[contact]]\nedge = 'top'\nwhere = '0.3 < x and x < 1.4'\ngap = 0.03\n",
            n[0], n[1], slope[0], slope[1]
        );
        let own = plate.to_owned()
            + &walls
            + &force("kind = 'point'\nat = [1.0, 0.33333333333333333]", "[0.06, 0.08]")
            + rest;
        let own = written(folder, "own.toml", &own);
        let along = |node: &usize| n[0] * place(*node)[0] + n[1] * place(*node)[1];
        let gaps: Vec<String> =
            right.iter().map(|node| format!("{:.17e}", offset - along(node))).collect();
        // where the plane leaves a choice it is said: the same
        for tangents in [String::new(), {
            let all: Vec<String> = right.iter().map(|n| format!("'{}.t'", n + 1)).collect();
            format!("tangents = [{}]\n", all.join(", "))
        }] {
            let hand = format!(
                "[body]\nkind = 'matrices'\nstiffness_matrix = 'K.mtx'\nmass_matrix = 'M.mtx'\n\
                 [[contact]]\nnodes = [{}]\ndirection = [{}, {}]\ngaps = [{}]\nfriction = 0.3\nsurface = [0.05]\n{tangents}\
                 [[contact]]\nnodes = [{}]\ndirection = 'y'\ngap = 0.03\n{}{}{rest}",
                numbers(&right),
                4.0 * n[0],
                4.0 * n[1],
                gaps.join(", "),
                numbers(&top),
                force(&format!("kind = 'force'\ndisplacement = '{middle}.1'"), "0.06"),
                force(&format!("kind = 'force'\ndisplacement = '{middle}.2'"), "0.08"),
            );
            let hand = written(folder, "hand.toml", &hand);
            let [a, b] = [(&own, "a.h5"), (&hand, "b.h5")].map(|(s, o)| {
                json(&["run", s, "-o", &folder.join(o).display().to_string(), "--force"])
            });
            same_switches(&a, &b, 12.0, &format!("plate, n = {n:?}"));
            let words = |said: &Value, key: &str| -> Vec<String> {
                let all = said["switches"].as_array().unwrap();
                all.iter().map(|s| s[key].to_string()).collect()
            };
            for key in ["from", "to"] {
                assert_eq!(words(&a, key), words(&b, key));
            }
            slips += words(&b, "to").iter().filter(|w| w.contains("slip")).count();
            // both obstacles are touched, and told apart
            let of = |k: usize| {
                let force = &b["forces"][k];
                assert_eq!(force["group"], format!("contact[{k}]"), "{}", b["forces"]);
                force["maximum"].as_f64().unwrap()
            };
            assert!(of(0) > 0.0 && of(1) > 0.0);
        }
    }
    assert!(slips > 10, "{slips}");
}

/// `normal` is read from the faces of the deck: of a face along an axis that axis, of a deck that is turned by 20° about z the turned one.
#[test]
fn normals_are_those_of_the_faces_of_the_deck() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let text = std::fs::read_to_string(sample("block.inp")).unwrap();
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let mut of_nodes = false;
    let turned = text.lines().map(|line| {
        of_nodes = if line.starts_with('*') { line.starts_with("*NODE") } else { of_nodes };
        let words: Vec<&str> = line.split(',').map(str::trim).collect();
        match words[..] {
            [node, x, y, z] if of_nodes => {
                let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
                format!("{node}, {:.17e}, {:.17e}, {z}", cos * x - sin * y, sin * x + cos * y)
            }
            _ => line.to_owned(),
        }
    });
    let turned: Vec<String> = turned.collect();
    written(folder, "turned.inp", &turned.join("\n"));
    written(folder, "straight.inp", &text);
    let scene = |deck: &str, direction: &str| {
        format!(
            "[body]\nkind = 'matrices'\nstiffness_matrix = '{}'\nmass_matrix = '{}'\ndeck = '{deck}'\n\
             [contact]\nnodes = 'TIP'\ndirection = {direction}\ngap = 2e-3\n\
             [[load]]\nkind = 'force'\ndisplacement = '145.1'\namplitude = 2e4\nomega = 6e4\n[run]\nuntil = 2e-4\n",
            sample("block.sti"),
            sample("block.mas")
        )
    };
    for (deck, direction) in
        [("straight.inp", "'x'".to_owned()), ("turned.inp", format!("[{cos:.17e}, {sin:.17e}]"))]
    {
        let of = |direction: &str, name: &str| {
            let scene = written(folder, &format!("{name}.toml"), &scene(deck, direction));
            let out = folder.join(format!("{name}.h5")).display().to_string();
            json(&["run", &scene, "-o", &out, "--force"])
        };
        same_switches(&of("'normal'", "own"), &of(&direction, "hand"), 2e-4, deck);
    }
    // a set of nodes that make no face
    let odd = text.replacen("*SURFACE", "*NSET, NSET=LINE\n101, 102\n*SURFACE", 1);
    written(folder, "odd.inp", &odd);
    let bad = scene("odd.inp", "'normal'").replace("'TIP'", "'LINE'");
    refused(&written(folder, "bad.toml", &bad), "no face of the boundary has all its nodes in");
}

/// A state is taken by rows: refused where these count along other directions, taken where they are the same.
#[test]
fn states_know_along_what_their_rows_count() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = |name: &str, direction: &str, more: &str| {
        let text = format!(
            "[body]\nkind = 'matrices'\nstiffness_matrix = '{}'\nmass_matrix = '{}'\n\
             [contact]\nnodes = [101]\ndirection = {direction}\ngap = 0.5\n\
             [[load]]\nkind = 'force'\ndisplacement = '105.3'\namplitude = 1e3\n{more}[run]\nuntil = 1e-5\n",
            sample("block.sti"),
            sample("block.mas")
        );
        written(folder, name, &text)
    };
    let from = "[initial]\nfile = 'a.h5'\n";
    for (direction, others) in
        [("'-z'", ["'z'", "[0.6, 0.0, 0.8]"]), ("[0.6, 0.8]", ["'x'", "[0.8, 0.6]"])]
    {
        let out = |name: &str| folder.join(name).display().to_string();
        json(&["run", &scene("a.toml", direction, ""), "-o", &out("a.h5"), "--force"]);
        json(&["run", &scene("b.toml", direction, from), "-o", &out("b.h5"), "--force"]);
        let energies = |name: &str| -> Vec<f64> {
            let file = hdf5_files().open(folder.join(name)).unwrap();
            let read = |of: &str| -> Vec<f64> { file.dataset(of).unwrap().read_raw().unwrap() };
            read("energy/kinetic").iter().zip(read("energy/elastic")).map(|(a, b)| a + b).collect()
        };
        let (a, b) = (energies("a.h5"), energies("b.h5"));
        let (end, start) = (a[a.len() - 1], b[0]);
        assert!(end > 0.0 && (end - start).abs() < 1e-12 * end, "{direction}: {end} {start}");
        for other in others {
            refused(&scene("c.toml", other, from), "initial.file");
        }
    }
}

/// What cannot be is refused: a displacement that is missing, a node of two tables, tangents that were turned or are none.
#[test]
fn what_an_oblique_wall_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    let body = format!(
        "[body]\nkind = 'matrices'\nstiffness_matrix = '{}'\nmass_matrix = '{}'\n[[support]]\nnodes = [109]\nfix = ['y']\n",
        sample("block.sti"),
        sample("block.mas")
    );
    let first = "[[contact]]\nnodes = [101, 102]\ndirection = [0.6, 0.8]\ngap = 1.0\n";
    for (contact, words) in [
        ("[contact]\nnodes = [109]\ndirection = [0.6, 0.8]\ngap = 1.0\n".to_owned(), "needs 109.2"),
        ("[contact]\nnodes = [101]\ndirection = [0, 0, 0]\ngap = 1.0\n".into(), "is no direction"),
        ("[contact]\nnodes = [101]\ndirection = 'w'\ngap = 1.0\n".into(), "is no axis"),
        (
            "[contact]\nnodes = [101]\ndirection = 'normal'\ngap = 1.0\n".into(),
            "is that of a set of body.deck",
        ),
        (
            format!(
                "{first}[[contact]]\nnodes = [103, 101]\ndirection = 'z'\ngap = 1.0\n[[contact]]\nnodes = [102]\ndirection = [0.8, -0.6]\ngap = 1.0\n"
            ),
            "names 102, which a table has turned",
        ),
        (
            format!("{first}[[contact]]\nnodes = [101]\ndirection = '-y'\ngap = 1.0\n"),
            "names 101, which a table has turned",
        ),
        (format!("{first}friction = 0.2\n"), "is missing beside friction"),
        (format!("{first}friction = 0.2\ntangents = ['101.2', '102.2']\n"), "give \"101.t\""),
        (
            format!("{first}friction = 0.2\ntangents = ['101.t', '107.t']\n"),
            "no row is called \"107.t\"",
        ),
        (format!("{first}stress = [[[0, 1.0]], [[3, 1.0]]]\n"), "turned to an oblique direction"),
        ("[contact]\nnodes = []\ndirection = 'x'\ngap = 1.0\n".into(), "names no node"),
        ("[[support]]\nnodes = []\nfix = ['x']\n".into(), "names no node"),
        ("[[probe]]\nname = 'p'\nnode = '101.n'\n".into(), "no row is called \"101.n\""),
        (format!("{first}[[probe]]\nname = 'p'\nnode = '101.t1'\n"), "no row is called"),
        // a number that is no row
        ("[[probe]]\nname = 'p'\nnode = 9999\n".into(), "9999: the rows count from 0 to"),
        (
            format!(
                "{first}[[contact]]\nnodes = [103]\ndirection = 'x'\ngap = 1.0\n[[contact]]\nnodes = [103]\ndirection = '-x'\ngap = 1.0\n"
            ),
            "contact[2].nodes: 103.1 stands there twice",
        ),
        (
            format!("{first}[[contact]]\ndisplacements = ['101.3', '102.3', '101.3']\ngap = 1.0\n"),
            "stands there twice",
        ),
    ] {
        let bad = written(folder.path(), "bad.toml", &(body.clone() + &contact));
        refused(&bad, words);
    }
}

/// A plate whose supports shake it against a stop: by elements, and by the matrices of the free plate, whose supports stand in the scene. The same switches, forces of supports and energies; one of
/// several supports moves alone.
#[test]
fn supports_of_matrices_move_as_those_of_elements() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = structured::rectangle(2.0, 1.0, 6, 3);
    let dofs = DofMap::new(&mesh, &[], &[]).unwrap();
    let material = Material::plate(1.0, 0.3, 1.0, 1.0);
    let body = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
    let (mesh, size) = (&body.mesh, body.dofs.n());
    let mut names = vec![String::new(); size];
    for (node, c) in (0..mesh.n_nodes()).flat_map(|node| [(node, 0), (node, 1)]) {
        names[body.dofs.column(node, c).unwrap()] = format!("{}.{}", node + 1, c + 1);
    }
    for (name, a) in [("K", &body.stiffness), ("M", &body.mass)] {
        let mut all = DMatrix::zeros(size, size);
        a.triplets().for_each(|(i, j, v)| all[(i, j)] += v);
        written(folder, &format!("{name}.mtx"), &market(&all));
        written(folder, &format!("{name}.dof"), &names.join("\n"));
    }
    let numbers = |group: &str, keep: &dyn Fn(f64) -> bool| {
        let nodes = mesh.group_nodes(group).into_iter().filter(|n| keep(mesh.nodes()[*n][0]));
        nodes.map(|n| (n + 1).to_string()).collect::<Vec<_>>().join(", ")
    };
    let mut deck = "*NODE\n".to_owned();
    for (k, p) in mesh.nodes().iter().enumerate() {
        let _ = writeln!(deck, "{}, {}, {}, 0.0", k + 1, p[0], p[1]);
    }
    let _ = writeln!(deck, "*NSET, NSET=Wall\n{}", numbers("left", &|_| true));
    written(folder, "plate.inp", &deck);
    let right = numbers("right", &|_| true);
    let left = numbers("left", &|_| true);
    let bottom = numbers("bottom", &|x| (0.1..1.1).contains(&x));
    let rest = "[damping]\nrayleigh = [0.05, 0.02]\n[run]\nuntil = 15.0\n";
    let method = "method = 'mass-redistribution'\n";
    let move_by = |at: &str, by: &str, omega: f64| {
        format!("[[load]]\nkind = 'base'\n{at}amplitude = {by}\nomega = {omega}\nphase = 0.3\n")
    };
    let plate = "[body]\nkind = 'plate'\nsize = [2.0, 1.0]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n";
    let given = "[body]\nkind = 'matrices'\nstiffness_matrix = 'K.mtx'\nmass_matrix = 'M.mtx'\ndeck = 'plate.inp'\n";
    let falls = |by: &str| format!("[[load]]\nkind = 'gravity'\namplitude = {by}\nomega = 0.7\n");
    for (what, own, hand) in [
        (
            "all supports",
            "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n".to_owned()
                + &move_by("edge = 'left'\n", "[0.2, 0.1]", 0.7),
            // by a set, however it is written
            "[[support]]\nnodes = 'wall'\nfix = ['x', 'y']\n".to_owned()
                + &move_by("group = 'WALL'\n", "[0.2, 0.1, 0.0]", 0.7),
        ),
        (
            "one of two",
            "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nwhere = '0.0 < x and x < 1.0'\nfix = ['y']\n".to_owned()
                + &move_by("edge = 'left'\n", "[0.2, 0.0]", 0.7),
            format!("[[support]]\nnodes = [{left}]\nfix = ['x', 'y']\n[[support]]\nnodes = [{bottom}]\nfix = ['y']\n")
                + &move_by("group = 'support[0]'\n", "[0.2, 0.0, 0.0]", 0.7),
        ),
        (
            "gravity",
            "[[support]]\nedge = 'left'\nfix = ['x', 'y']\n".to_owned()
                + &falls("[0.05, -0.02]"),
            "[[support]]\nnodes = 'WALL'\nfix = ['x', 'y']\n".to_owned()
                + &falls("[0.05, -0.02, 0.0]"),
        ),
    ] {
        let own = format!("{plate}{own}[contact]\nedge = 'right'\ngap = 0.1\n{method}{rest}");
        let hand = format!(
            "{given}{hand}[contact]\nnodes = [{right}]\ndirection = 'x'\ngap = 0.1\n{method}{rest}"
        );
        let own = written(folder, "own.toml", &own);
        let hand = written(folder, "hand.toml", &hand);
        let [a, b] = [(&own, "a.h5"), (&hand, "b.h5")]
            .map(|(s, o)| json(&["run", s, "-o", &folder.join(o).display().to_string(), "--force"]));
        same_switches(&a, &b, 15.0, what);
        let [a, b] = ["a.h5", "b.h5"].map(|f| hdf5_files().open(folder.join(f)).unwrap());
        let read = |file: &hdf5::File, name: &str| -> Vec<f64> {
            file.dataset(name).unwrap_or_else(|e| panic!("{name}: {e}")).read_raw().unwrap()
        };
        // axes of the supports of elements are supports of one row each here
        let (f, g) = (read(&a, "forces/support/force"), read(&b, "forces/support/force"));
        let count = g.len() / read(&b, "energy/t").len();
        assert_eq!(count, if what == "one of two" { 3 } else { 2 });
        let per = f.len() / read(&a, "energy/t").len();
        let largest = f.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let mut apart = 0.0f64;
        for (f, g) in f.chunks_exact(per).zip(g.chunks_exact(count)) {
            // the second support of elements holds y: its last component
            let f = if count == 2 { f.to_vec() } else { vec![f[0], f[1], f[3]] };
            f.iter().zip(g).for_each(|(f, g)| apart = apart.max((f - g).abs()));
        }
        eprintln!("{what}: supports {apart:.1e} of {largest:.1e}");
        assert!(apart < 1e-8 * largest, "{what}: {apart:e} of {largest:e}");
        for name in ["energy/kinetic", "energy/elastic", "energy/external"] {
            let (x, y) = (read(&a, name), read(&b, name));
            let size = x.iter().fold(0.0f64, |m, x| m.max(*x));
            let apart = x.iter().zip(&y).fold(0.0f64, |m, (x, y)| m.max((x - y).abs()));
            assert!(apart < 1e-9 * size, "{what} {name}: {apart:e} of {size:e}");
        }
    }
    for (load, words) in [
        (move_by("group = 'BASE'\n", "[0.1, 0.0, 0.0]", 1.0), "is held by no support"),
        (move_by("", "[0.0, 0.0, 1.0]", 1.0), "moves along z, and no support"),
        (move_by("", "1.0", 1.0), "needs the x, y and z components"),
        (move_by("edge = 'left'\n", "[0.1, 0.0, 0.0]", 1.0), "has no edges"),
    ] {
        let bad = format!("{given}[[support]]\nnodes = [{left}]\nfix = ['x', 'y']\n{load}");
        refused(&written(folder, "bad.toml", &bad), words);
    }
    // rows that nobody names, modes
    let nameless = given.replace("K.mtx", "plain.mtx").replace("deck = 'plate.inp'\n", "");
    std::fs::copy(folder.join("K.mtx"), folder.join("plain.mtx")).unwrap();
    let contact = format!("[contact]\nnodes = [{right}]\ndirection = 'x'\ngap = 0.1\n");
    let modes = "[reduction]\nkind = 'free-interface'\nmodes = 4\n";
    let held = format!("[[support]]\nnodes = [{left}]\nfix = ['x', 'y']\n");
    for (bad, words) in [
        (nameless + &falls("[0.1, 0.0, 0.0]"), "nobody says along what the rows count"),
        (format!("{given}{held}{contact}{modes}{}", falls("[0.1, 0.0, 0.0]")), "modes have none"),
        (format!("{given}{}", falls("[0.1, 0.0]")), "needs 3 numbers, has 2"),
    ] {
        refused(&written(folder, "bad.toml", &bad), words);
    }
    let free = format!("{given}{}", move_by("", "[0.1, 0.0, 0.0]", 1.0));
    refused(&written(folder, "free.toml", &free), "hold them in the scene");
}
