//! What guards `--resume`: everything that a result hangs on is in the text of the scene or in its fingerprint.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;
use std::sync::Arc;

use crate::common::{program, root};
use serde_json::Value;
use signorini::contact::Rayleigh;
use signorini::fem::{Course, Spline};
use signorini::problem::Problem;
use signorini::records::fingerprint;
use signorini::scenario::Scene;
use tempfile::TempDir;

/// Keys of scenes that name files.
const FILES: [&str; 16] = [
    "body.file",
    "body.deck",
    "body.names",
    "body[].deck",
    "body[].names",
    "body.mass_matrix",
    "body.stiffness_matrix",
    "body.damping_matrix",
    "body[].file",
    "body[].mass_matrix",
    "body[].stiffness_matrix",
    "body[].damping_matrix",
    "contact.n_c",
    "contact.n_o",
    "load[].table",
    "initial.file",
];

/// Keys whose values are texts that name no file.
const WORDS: [&str; 54] = [
    "title",
    "contact.nodes",
    "contact.direction",
    "contact.gap",
    "contact.gap_behind",
    "contact.group",
    "contact.slave",
    "contact.edge",
    "support[].edge",
    "load[].edge",
    "spring[].edge",
    "damper[].edge",
    "mass[].edge",
    "slider[].edge",
    "iwan[].edge",
    "contact.master",
    "body.name",
    "body[].name",
    "initial.displacement[]",
    "initial.velocity[]",
    "load[].group",
    "material[].group",
    "run.store[]",
    "support[].group",
    "support[].nodes",
    "support[].where",
    "spring[].group",
    "spring[].to",
    "damper[].group",
    "damper[].to",
    "mass[].group",
    "mass[].to",
    "slider[].group",
    "slider[].to",
    "iwan[].group",
    "iwan[].to",
    "contact.displacements[]",
    "contact.tangents[]",
    "contact.where",
    "load[].displacement",
    "probe[].edge",
    "probe[].group",
    "probe[].name",
    "probe[].node",
    "spring[].row",
    "spring[].to_row",
    "damper[].row",
    "damper[].to_row",
    "mass[].row",
    "mass[].to_row",
    "slider[].row",
    "slider[].to_row",
    "iwan[].row",
    "iwan[].to_row",
];

/// Every key of a schema below `place` that may hold a text of the user's own, and the number of all keys.
fn texts(all: &Value, schema: &Value, place: &str, found: &mut BTreeSet<String>) -> usize {
    if let Some(name) = schema["$ref"].as_str() {
        let of = name.rsplit('/').next().unwrap();
        return texts(all, &all["definitions"][of], place, found);
    }
    if schema["type"] == "string" && schema["enum"].is_null() && schema["const"].is_null() {
        found.insert(place.to_owned());
    }
    if schema["type"].as_array().is_some_and(|t| t.iter().any(|t| t == "string")) {
        found.insert(place.to_owned());
    }
    let mut count = 1;
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        let dot = if place.is_empty() { "" } else { "." };
        count += texts(all, inner, &format!("{place}{dot}{key}"), found);
    }
    for many in ["anyOf", "oneOf", "allOf"] {
        for inner in schema[many].as_array().into_iter().flatten() {
            count += texts(all, inner, place, found);
        }
    }
    if schema["items"].is_object() {
        count += texts(all, &schema["items"], &format!("{place}[]"), found);
    }
    count
}

/// A key to come is in the text of its scene, which is compared letter for letter; one that names a file must be told here, and in the tests below.
#[test]
fn every_key_that_may_name_a_file_is_known() {
    let schema = Scene::schema();
    let mut found = BTreeSet::new();
    let count = texts(&schema, &schema, "", &mut found);
    assert!(count > 60, "{count} keys: the walk has lost its way");
    // a table, or a list of tables
    let plain: BTreeSet<String> = found.iter().map(|k| k.replace("contact[]", "contact")).collect();
    let known = |k: &String| FILES.contains(&k.as_str()) || WORDS.contains(&k.as_str());
    let unknown: Vec<&String> = plain.iter().filter(|k| !known(k)).collect();
    assert!(unknown.is_empty(), "do these name files? {unknown:?}; the schema has {plain:?}");
    for file in FILES {
        assert!(plain.contains(file), "{file} is no key any more: {plain:?}");
    }
}

fn problem(scene: &Scene) -> Problem {
    Problem::new(scene, None).unwrap_or_else(|e| panic!("{e}"))
}

fn sum(place: &Path) -> u64 {
    let scene = Scene::read(place).unwrap_or_else(|e| panic!("{e}"));
    fingerprint(&scene, &problem(&scene))
}

/// A change of a problem.
type Change = Box<dyn Fn(&mut Problem)>;

/// Everything of a problem that no file and no text need say: each alone makes another fingerprint.
#[test]
fn every_number_of_a_problem_counts() {
    let text = std::fs::read_to_string(root().join("scenarios/plate-forced.toml")).unwrap();
    let scene = Scene::parse(&text, "plate-forced.toml".as_ref()).unwrap();
    let made = problem(&scene);
    assert!(!made.system.loads.harmonics.is_empty(), "a scene with a harmonic load");
    let first = fingerprint(&scene, &made);
    assert_eq!(first, fingerprint(&scene, &problem(&scene)), "the same twice");
    let course = |scale: f64, late: f64| {
        let t = vec![0.0, 1.0 + late, 2.0, 3.0];
        Course::Measured(Arc::new(Spline::new(t, vec![0.0, scale, -1.0, 0.5])))
    };
    let changes: [(&str, Change); 18] = [
        ("alpha", Box::new(|p| p.system.damping = Some(Rayleigh { alpha: 0.01, beta: 0.0 }))),
        ("beta", Box::new(|p| p.system.damping = Some(Rayleigh { alpha: 0.0, beta: 0.01 }))),
        ("no damping", Box::new(|p| p.system.damping = None)),
        ("force", Box::new(|p| p.system.loads_mut().harmonics[0].force[1] += 1e-12)),
        ("omega", Box::new(|p| p.system.loads_mut().harmonics[0].omega *= 1.0 + 1e-15)),
        ("phase", Box::new(|p| p.system.loads_mut().harmonics[0].phase += 0.1)),
        ("derivative", Box::new(|p| p.system.loads_mut().harmonics[0].derivative += 1)),
        ("one load less", Box::new(|p| drop(p.system.loads_mut().harmonics.pop()))),
        (
            "constant",
            Box::new(|p| {
                let n = p.system.n();
                p.system.loads_mut().follow(vec![1e-9; n], 0, &Course::Constant);
            }),
        ),
        (
            "history",
            Box::new(move |p| p.system.loads_mut().follow(vec![1.0], 0, &course(1.0, 0.0))),
        ),
        ("values", Box::new(move |p| p.system.loads_mut().follow(vec![1.0], 0, &course(1.1, 0.0)))),
        ("times", Box::new(move |p| p.system.loads_mut().follow(vec![1.0], 0, &course(1.0, 0.1)))),
        ("order", Box::new(move |p| p.system.loads_mut().follow(vec![1.0], 1, &course(1.0, 0.0)))),
        ("displacement", Box::new(|p| p.initial.u[0] += 1e-12)),
        ("velocity", Box::new(|p| p.initial.v[0] += 1e-12)),
        ("area", Box::new(|p| p.system.constraints[0].area *= 1.0 + 1e-15)),
        ("normal", Box::new(|p| p.system.constraints[0].normal[0] *= -1.0)),
        ("gap", Box::new(|p| p.system.constraints[0].gap += 1e-12)),
    ];
    let mut sums = vec![("nothing", first)];
    for (what, change) in &changes {
        let mut other = made.clone();
        change(&mut other);
        sums.push((what, fingerprint(&scene, &other)));
    }
    let same_damping = made.system.damping.is_none();
    for (k, (a, of_a)) in sums.iter().enumerate() {
        for (b, of_b) in &sums[..k] {
            let trivial = same_damping && *a == "no damping" && *b == "nothing";
            assert!(of_a != of_b || trivial, "{a} and {b} have one fingerprint");
        }
    }
}

const BODY: &str = "title = \"c\"\n[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\ndamping_matrix = \"C.mtx\"\n\
    [contact]\ndisplacements = [0]\ngap = 1.0\nmethod = \"penalty\"\nstiffness = 10.0\n\
    [[load]]\nkind = \"force\"\ndisplacement = 1\namplitude = 0.1\nomega = 0.65\n";

fn put(folder: &TempDir, name: &str, text: &str) {
    std::fs::write(folder.path().join(name), text).unwrap();
}

/// Two masses between springs, as `scenarios/two-mass-stop.toml`, with its damping in a file.
fn masses(damping: f64) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (from, to) in [("two-mass-stop-M.mtx", "M.mtx"), ("two-mass-stop-K.mtx", "K.mtx")] {
        std::fs::copy(root().join("scenarios").join(from), folder.path().join(to)).unwrap();
    }
    set_damping(&folder, damping);
    folder
}

/// `C = beta K`.
fn set_damping(folder: &TempDir, beta: f64) {
    let k = std::fs::read_to_string(folder.path().join("K.mtx")).unwrap();
    let mut lines: Vec<String> = vec![];
    let mut sizes_are_told = false;
    for line in k.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if line.starts_with('%') || !sizes_are_told {
            sizes_are_told |= !line.starts_with('%');
            lines.push(line.to_owned());
        } else if let [i, j, v] = words[..] {
            lines.push(format!("{i} {j} {:e}", beta * v.parse::<f64>().unwrap()));
        }
    }
    put(folder, "C.mtx", &(lines.join("\n") + "\n"));
}

/// The content of every file that a scene names, changed one after the other, and nothing else.
#[test]
fn the_content_of_every_file_counts() {
    // matrices
    let folder = masses(0.06);
    put(&folder, "s.toml", BODY);
    let scene = folder.path().join("s.toml");
    let first = sum(&scene);
    set_damping(&folder, 0.12);
    let damped = sum(&scene);
    assert!(damped != first, "damping_matrix");
    for name in ["M.mtx", "K.mtx"] {
        let folder = masses(0.06);
        put(&folder, "s.toml", &BODY.replace("damping_matrix = \"C.mtx\"\n", ""));
        let scene = folder.path().join("s.toml");
        let before = sum(&scene);
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        // twice the last diagonal entry
        let (head, last) = text.trim_end().rsplit_once('\n').unwrap();
        let (place, value) = last.rsplit_once(' ').unwrap();
        let value = 2.0 * value.parse::<f64>().unwrap();
        put(&folder, name, &format!("{head}\n{place} {value}\n"));
        assert!(sum(&scene) != before, "{name}");
    }
    // the boundary operator
    let folder = TempDir::new().unwrap();
    let foreign = root().join("validate/foreign");
    for name in ["M.mtx", "K.mtx", "N_C.mtx", "N_O.mtx", "half-plate.toml"] {
        std::fs::copy(foreign.join(name), folder.path().join(name)).unwrap();
    }
    let scene = folder.path().join("half-plate.toml");
    let mut known = vec![sum(&scene)];
    for name in ["N_C.mtx", "N_O.mtx"] {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let (head, last) = text.trim_end().rsplit_once('\n').unwrap();
        let (place, value) = last.rsplit_once(' ').unwrap();
        let value = value.parse::<f64>().unwrap() * (1.0 + 1e-12);
        put(&folder, name, &format!("{head}\n{place} {value:e}\n"));
        known.push(sum(&scene));
    }
    assert!(known[0] != known[1] && known[1] != known[2], "n_c, n_o");
    // a measured history: one value, one time
    let folder = TempDir::new().unwrap();
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
        [contact]\nedge = \"right\"\ngap = 1.0\n[[load]]\nkind = \"gravity\"\namplitude = 1.0\ntable = \"t.csv\"\n[run]\nuntil = 2.0\n";
    put(&folder, "s.toml", text);
    let scene = folder.path().join("s.toml");
    let of = |table: &str| {
        put(&folder, "t.csv", table);
        sum(&scene)
    };
    let sums: BTreeSet<u64> =
        ["0,0\n1,1\n2,0\n3,0\n", "0,0\n1,1.5\n2,0\n3,0\n", "0,0\n1.1,1\n2,0\n3,0\n"]
            .into_iter()
            .map(of)
            .collect();
    assert_eq!(sums.len(), 3, "table");
    // a mesh: what belongs to which group is in its file alone
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios/half-disc.toml")).unwrap();
    let mesh = text.lines().find_map(|l| l.strip_prefix("file = \"")?.split('"').next()).unwrap();
    let inside = folder.path().join(mesh);
    std::fs::create_dir_all(inside.parent().unwrap()).unwrap();
    std::fs::copy(root().join("scenarios").join(mesh), &inside).unwrap();
    put(&folder, "s.toml", &text);
    let scene = folder.path().join("s.toml");
    let before = sum(&scene);
    let content = std::fs::read_to_string(&inside).unwrap();
    std::fs::write(&inside, content.trim_end().to_owned() + "\n\n").unwrap();
    assert!(sum(&scene) != before, "body.file");
}

fn run(arguments: &[&str], at_look: Option<&str>) -> Output {
    let mut command = program();
    command.args(arguments);
    if let Some(what) = at_look {
        command.env("SIGNORINI_AT_LOOK", what);
    }
    command.output().unwrap()
}

/// `--resume` of `run`, `response` and `backbone`, where the damping, or the stiffness, of a named file has changed; and where a comment of the scene has.
#[test]
fn no_file_holds_two_problems() {
    let at_end = "[run]\nperiods = 4000\n[orbit]\nrange = [0.5, 0.85]\nomega = 0.65\n";
    for (command, options) in [
        ("run", &[][..]),
        ("response", &["--method", "shooting", "--threads", "1"]),
        ("backbone", &["--range", "0.64,0.76", "--step", "0.02", "--threads", "1"]),
    ] {
        let folder = masses(0.06);
        let free = BODY.replace("damping_matrix = \"C.mtx\"\n", "");
        let free = &free[..free.find("[[load]]").unwrap()];
        let text = if command == "backbone" { free } else { BODY };
        let scene = folder.path().join("s.toml");
        let file = folder.path().join("out.h5");
        let words =
            [&[command, scene.to_str().unwrap(), "-q", "-o", file.to_str().unwrap()], options]
                .concat();
        let resumed = [&words[..], &["--resume"]].concat();
        let said = |o: &Output| String::from_utf8_lossy(&o.stderr).into_owned();
        put(&folder, "s.toml", &format!("{text}{at_end}"));
        let cut = run(&words, Some("INT 2"));
        assert_eq!(cut.status.code(), Some(130), "{command}: {}", said(&cut));
        // the same scene and files: it goes on
        let further = run(&resumed, Some("INT 2"));
        assert_eq!(further.status.code(), Some(130), "{command}: {}", said(&further));
        if command == "backbone" {
            let k = std::fs::read_to_string(folder.path().join("K.mtx")).unwrap();
            put(&folder, "K.mtx", &k.replace("2.0", "2.5"));
        } else {
            set_damping(&folder, 0.12);
        }
        let refused = run(&resumed, None);
        assert_eq!(refused.status.code(), Some(2), "{command}: {}", said(&refused));
        let words = said(&refused);
        assert!(words.contains("changed since"), "{command}: {words}");
        put(&folder, "s.toml", &format!("{text}{at_end}# a word\n"));
        let refused = run(&resumed, None);
        assert_eq!(refused.status.code(), Some(2), "{command}: {}", said(&refused));
    }
}
