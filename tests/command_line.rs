//! The program as a user meets it: exit codes, messages, JSON, files.

use std::path::Path;
use std::process::Output;

use crate::common::root;
use assert_cmd::Command;
use serde_json::Value;

fn signorini(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("signorini").unwrap().current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const GOOD: &str = r#"title = "test"

[body]
kind = "plate"
size = [1.0, 0.4]
elements = [4, 2]
young = 1.0
poisson = 0.3
density = 1.0

[[support]]
edge = "left"
fix = ["x", "y"]

[contact]
edge = "right"
gap = 1.0

[initial]
mode = 2
amplitude = -1.4

[run]
until = 3.0
rtol = 1e-8
samples = 30
"#;

/// What is replaced, by what, and what the message must name: line, key, words.
const BAD: &[(&str, &str, usize, &str, &str)] = &[
    ("young = 1.0", "yuong = 1.0", 7, "body.yuong", "unknown field"),
    ("young = 1.0", "young = \"1.0\"", 7, "body.young", "invalid type"),
    ("elements = [4, 2]", "elements = [4, 2.5]", 6, "body.elements", "a whole number"),
    ("young = 1.0", "young = -1.0", 7, "body.young", "positive"),
    ("young = 1.0", "young = nan", 7, "body.young", "positive"),
    ("density = 1.0", "density = 0", 9, "body.density", "positive"),
    ("poisson = 0.3", "poisson = 1.0", 8, "body.poisson", "indefinite"),
    ("poisson = 0.3", "poisson = -1.5", 8, "body.poisson", "indefinite"),
    ("poisson = 0.3\n", "", 3, "body.poisson", "missing"),
    ("size = [1.0, 0.4]", "size = [1.0]", 5, "body.size", "2 numbers"),
    ("size = [1.0, 0.4]", "size = [1.0, 0.0]", 5, "body.size", "positive"),
    ("elements = [4, 2]", "elements = [4, 0]", 6, "body.elements", "at least one"),
    ("elements = [4, 2]", "elements = [4000000, 200000]", 6, "body.elements", "nodes"),
    ("kind = \"plate\"", "kind = \"shell\"", 4, "body.kind", "unknown variant"),
    ("edge = \"left\"", "edge = \"west\"", 12, "support.edge", "unknown variant"),
    ("fix = [\"x\", \"y\"]", "fix = []", 13, "support[0].fix", "nothing"),
    ("fix = [\"x\", \"y\"]", "fix = [\"y\"]", 11, "support", "rigidly"),
    ("edge = \"right\"", "edge = \"left\"", 16, "contact.edge", "prescribed"),
    ("gap = 1.0", "gap = \"1 + z\"", 17, "contact.gap", "expression of z"),
    ("gap = 1.0", "gap = \"1 +* y\"", 17, "contact.gap", "expression"),
    ("gap = 1.0", "gap = \"1/(y - 0.2)\"", 17, "contact.gap", "inf"),
    ("gap = 1.0", "gap = 0.0", 21, "initial.amplitude", "gap is 0"),
    ("mode = 2", "mode = 0", 20, "initial.mode", "from 1"),
    ("mode = 2", "mode = 1000", 20, "initial.mode", "does not exist"),
    ("amplitude = -1.4", "amplitude = 1.4", 21, "initial.amplitude", "penetrates"),
    (
        "mode = 2\namplitude = -1.4",
        "displacement = [\"2*x\", \"0\"]",
        20,
        "initial.displacement",
        "penetrates",
    ),
    ("mode = 2\namplitude = -1.4", "file = \"none.h5\"", 20, "initial.file", "no such file"),
    ("amplitude = -1.4", "", 19, "initial.amplitude", "missing"),
    ("until = 3.0", "until = -3.0", 24, "run.until", "positive"),
    ("until = 3.0", "periods = 2", 24, "run.periods", "counts periods"),
    ("until = 3.0", "", 23, "run", "exactly one"),
    ("rtol = 1e-8", "rtol = 1e-18", 25, "run.rtol", "rounding"),
    ("rtol = 1e-8", "integrator = \"euler\"", 25, "run.integrator", "unknown variant"),
    ("samples = 30", "samples = 0", 26, "run.samples", "at least one"),
    (
        "[initial]",
        "[damping]\nratio = 0.1\nrayleigh = [0.0, 0.1]\n[initial]",
        19,
        "damping",
        "exactly one",
    ),
    (
        "[initial]",
        "[[load]]\nkind = \"gravity\"\namplitude = 1.0\n[initial]",
        21,
        "load[0].amplitude",
        "components",
    ),
    (
        "[initial]",
        "[[load]]\nkind = \"mode\"\namplitude = 1.0\n[initial]",
        19,
        "load[0].mode",
        "missing",
    ),
    (
        "[initial]",
        "[[load]]\nkind = \"point\"\nat = [2.0, 0.0]\namplitude = [1, 0]\n[initial]",
        21,
        "load[0].at",
        "outside",
    ),
    ("gap = 1.0", "gap = 1.0\nmethod = \"penalti\"", 18, "contact.method", "unknown variant"),
    (
        "gap = 1.0",
        "gap = 1.0\nmass = \"condensed\"",
        18,
        "contact.mass",
        "not read by method = \"nbm\"",
    ),
    (
        "gap = 1.0",
        "gap = 1.0\nmethod = \"mass-redistribution\"\ninertia = \"constant\"",
        19,
        "contact.inertia",
        "not read",
    ),
    (
        "gap = 1.0",
        "gap = 1.0\nmethod = \"mass-redistribution\"\nmass = \"klr\"",
        19,
        "contact.mass",
        "unknown variant",
    ),
    ("gap = 1.0", "gap = 1.0\nstress = \"nodal\"", 18, "contact.stress", "unknown variant"),
    ("gap = 1.0", "gap = 1.0\nstress = [[[1, 2.0]]]", 18, "contact.stress", "matrices"),
    (
        "gap = 1.0",
        "gap = 1.0\nstress = \"reaction\"\nboundary_mass = \"lumped\"",
        19,
        "contact.boundary_mass",
        "not read",
    ),
    (
        "amplitude = -1.4",
        "amplitude = -1.4\nvelocity = [\"0\", \"0\"]\nequilibrium = true",
        19,
        "initial",
        "several forms",
    ),
];

#[test]
fn bad_scenes_end_with_exit_code_2_and_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let mut faults = vec![];
    for &(from, to, line, key, words) in BAD {
        assert!(GOOD.contains(from), "{from}");
        std::fs::write(folder.path().join("bad.toml"), GOOD.replacen(from, to, 1)).unwrap();
        let output = signorini(folder.path(), &["run", "bad.toml", "-o", "out.h5"]);
        let message = text(&output.stderr);
        // the terminal report may wrap lines
        let flat = message.replace("\n  │ ", "").replace('\n', " ");
        let mut expect = |right: bool, what: &str| {
            if !right {
                faults.push(format!("{to:?}: {what}\n{message}"));
            }
        };
        expect(output.status.code() == Some(2), "exit code");
        expect(flat.contains(&format!("bad.toml:{line}:")), "line");
        expect(flat.contains(key), key);
        expect(flat.contains(words), words);
        expect(message.contains("help"), "help");
        expect(output.stdout.is_empty(), "standard output");
        expect(!folder.path().join("out.h5").exists(), "a file was written");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn run_prints_json_and_refuses_to_overwrite() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("good.toml"), GOOD).unwrap();
    let output = signorini(folder.path(), &["run", "good.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in [
        "n_dof",
        "n_contact",
        "t_end",
        "switches",
        "grazings",
        "phases",
        "energy_start",
        "energy_end",
        "energy_drift",
        "max_penetration",
        "max_tension",
        "final",
        "rhs_evaluations",
        "wall_s",
    ] {
        assert!(!json[key].is_null(), "{key}");
    }
    assert_eq!(json["n_dof"], 24);
    assert_eq!(json["n_contact"], 3);
    assert_eq!(json["final"]["u"].as_array().unwrap().len(), 21);
    let switches = json["switches"].as_array().unwrap();
    assert!(!switches.is_empty());
    for s in switches {
        assert!(s["t"].is_f64() && s["node"].is_u64() && s["energy_jump"].is_f64());
        assert!(["close", "open"].contains(&s["kind"].as_str().unwrap()));
    }
    assert!(folder.path().join("good.h5").exists(), "named after the scene by default");

    let again = signorini(folder.path(), &["run", "good.toml"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--force"));
    let forced = signorini(folder.path(), &["run", "good.toml", "--force", "--verify-lcp"]);
    assert_eq!(forced.status.code(), Some(0));
    let summary = text(&forced.stdout);
    assert!(summary.contains("switches") && summary.contains("LCP check"), "{summary}");
    let quiet = signorini(folder.path(), &["run", "good.toml", "--force", "-q"]);
    assert!(quiet.stdout.is_empty() && quiet.stderr.is_empty());

    let nowhere = signorini(folder.path(), &["run", "good.toml", "-o", "no/such/folder.h5"]);
    assert_eq!(nowhere.status.code(), Some(2));
    let missing = signorini(folder.path(), &["run", "none.toml"]);
    assert_eq!(missing.status.code(), Some(2));
    assert_eq!(signorini(folder.path(), &["jump"]).status.code(), Some(2));
}

#[test]
fn accumulation_ends_with_exit_code_3_and_the_partial_file() {
    let folder = tempfile::tempdir().unwrap();
    // a limit that the ordinary motion exceeds: the real thing is not known to occur
    let text_ = GOOD.replace("samples = 30", "samples = 30\nswitch_limit = 0.7");
    std::fs::write(folder.path().join("limit.toml"), text_).unwrap();
    let output = signorini(folder.path(), &["run", "limit.toml", "--json"]);
    assert_eq!(output.status.code(), Some(3));
    let message = text(&output.stderr);
    assert!(
        message.contains("accumulation of switches at t = ") && message.contains("nodes ["),
        "{message}"
    );
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["status"], "failed");
    let shown = signorini(folder.path(), &["inspect", "limit.h5", "--json"]);
    let json: Value = serde_json::from_slice(&shown.stdout).unwrap();
    assert!(json["status"].as_str().unwrap().starts_with("failed: accumulation"));
    assert!(json["states"].as_u64().unwrap() > 5);
}

#[test]
fn a_stored_state_starts_the_next_run() {
    let folder = tempfile::tempdir().unwrap();
    let tight = GOOD.replace("rtol = 1e-8", "rtol = 1e-11");
    std::fs::write(folder.path().join("whole.toml"), &tight).unwrap();
    std::fs::write(folder.path().join("first.toml"), tight.replace("until = 3.0", "until = 1.75"))
        .unwrap();
    let second = tight
        .replace("until = 3.0", "until = 1.25")
        .replace("mode = 2\namplitude = -1.4", "file = \"first.h5\"");
    std::fs::write(folder.path().join("second.toml"), second).unwrap();
    let last = |name: &str| -> Vec<f64> {
        let output = signorini(folder.path(), &["run", name, "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        let both = ["u", "v"].map(|k| json["final"][k].as_array().unwrap().clone());
        both.concat().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let whole = last("whole.toml");
    last("first.toml");
    let parts = last("second.toml");
    let e = crate::common::relative(&parts, &whole);
    assert!(e < 1e-8, "{e:e}");
}

#[test]
fn pictures_exports_modes_and_inspection() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("good.toml"), GOOD).unwrap();
    signorini(folder.path(), &["run", "good.toml", "-q"]);
    let plot = signorini(folder.path(), &["plot", "good.h5"]);
    assert_eq!(plot.status.code(), Some(0), "{}", text(&plot.stderr));
    for name in ["contact", "energy", "gap", "shapes"] {
        let svg = std::fs::read_to_string(folder.path().join(format!("good-{name}.svg"))).unwrap();
        assert!(svg.contains("<svg") && svg.trim_end().ends_with("</svg>"));
        let png = std::fs::read(folder.path().join(format!("good-{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 5000, "{name}");
    }
    let unknown = signorini(folder.path(), &["plot", "good.h5", "--only", "sound"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert_eq!(signorini(folder.path(), &["plot", "good.toml"]).status.code(), Some(2));

    for format in ["csv", "vtu", "xdmf"] {
        let output = signorini(folder.path(), &["export", "good.h5", "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    let csv = std::fs::read_to_string(folder.path().join("good.csv")).unwrap();
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!(columns, 6 + 3 * 3 + 2 * 2);
    assert!(csv.lines().count() > 30 && csv.lines().all(|l| l.split(',').count() == columns));
    assert!(folder.path().join("good-vtu/good-000003.vtu").exists());

    let modes = signorini(folder.path(), &["modes", "good.toml", "--count", "3", "--json"]);
    let json: Value = serde_json::from_slice(&modes.stdout).unwrap();
    let (open, closed) = (&json["open"]["omega"], &json["closed"]["omega"]);
    for k in 0..3 {
        assert!(open[k].as_f64().unwrap() < closed[k].as_f64().unwrap());
    }

    let shown = signorini(folder.path(), &["inspect", "good.h5"]);
    assert!(text(&shown.stdout).contains("complete"));
    let scene = signorini(folder.path(), &["inspect", "good.h5", "--scene"]);
    assert_eq!(text(&scene.stdout), GOOD);
}

/// Growth of energy by the method itself is told, in words and in JSON.
#[test]
fn a_motion_that_the_method_feeds_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[body]\nkind='plate'\nsize=[1.0,0.5]\nelements=[2,10]\nyoung=1.0\npoisson=0.3\ndensity=1.0\n\
        [[support]]\nedge='left'\nfix=['x','y']\n[contact]\nedge='right'\ngap=0.0\n\
        [initial]\nvelocity=['0.1*x','0']\n[run]\nuntil=20\n";
    std::fs::write(folder.path().join("fed.toml"), scene).unwrap();
    let output = signorini(folder.path(), &["run", "fed.toml"]);
    assert!(text(&output.stdout).contains("WARNING"), "{}", text(&output.stdout));
    let output = signorini(folder.path(), &["run", "fed.toml", "--force", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["warning"].as_str().unwrap().contains("feeds"));
}

/// Errors are objects too in JSON mode, an output is never the scene, and odd titles draw.
#[test]
fn odd_requests_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    let odd = GOOD.replace("title = \"test\"", "title = \"\\u001b[31m <&> \\u0001 é\"");
    std::fs::write(folder.path().join("odd.toml"), &odd).unwrap();
    let output = signorini(folder.path(), &["run", "odd.toml", "-o", "odd.toml", "--force"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(folder.path().join("odd.toml")).unwrap(), odd);
    assert_eq!(signorini(folder.path(), &["run", "odd.toml", "-q"]).status.code(), Some(0));
    assert_eq!(signorini(folder.path(), &["plot", "odd.h5"]).status.code(), Some(0));
    let output = signorini(folder.path(), &["run", "none.toml", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["exit_code"], 2);
}

#[test]
fn precision_orders_the_integrators() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("good.toml"), GOOD).unwrap();
    let output = signorini(folder.path(), &["precision", "good.toml", "--repeats", "1", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let error = |method: &str, rtol: Option<f64>| {
        let points = json["study"]["points"].as_array().unwrap();
        let found = points.iter().find(|p| p["method"] == method && p["rtol"].as_f64() == rtol);
        found.unwrap()["error"].as_f64().unwrap()
    };
    assert!(error("chebyshev", None) < 1e-11 && error("modal, cached", None) < 1e-11);
    assert!(error("dop853", Some(1e-10)) < 1e-7);
    assert!(error("dopri5", Some(1e-8)) < 1e-2 * error("dopri5", Some(1e-4)));
    for name in ["good-precision.csv", "good-precision.svg", "good-precision.png"] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
    // a peer that is not there: what to do is said
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_signorini"))
        .current_dir(folder.path())
        .env("SIGNORINI_SUNDIALS", "no-such-program")
        .args(["precision", "good.toml", "--repeats", "1", "--peer", "sundials", "--force"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("make peers"), "{}", text(&output.stderr));
    // others do not know springs of obstacles, nor an obstacle behind
    for more in ["method = \"penalty\"", "gap_behind = 2.0"] {
        let scene = GOOD.replacen("gap = ", &format!("{more}\ngap = "), 1);
        std::fs::write(folder.path().join("other.toml"), scene).unwrap();
        let words = ["precision", "other.toml", "--repeats", "1", "--peer", "scipy", "--force"];
        let output = signorini(folder.path(), &words);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{more}: {said}");
        assert!(said.contains("peers solve undamped scenes"), "{more}: {said}");
    }
    // what chebyshev cannot take is said, with what can
    let table = "[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.1\ntable = \"shock.csv\"\n";
    std::fs::write(folder.path().join("shock.csv"), "0,0\n0.1,1\n0.2,0\n0.3,0\n").unwrap();
    let damped = GOOD.replace("[run]", &format!("{table}[run]\nintegrator = \"chebyshev\""));
    std::fs::write(folder.path().join("damped.toml"), damped).unwrap();
    let output = signorini(folder.path(), &["run", "damped.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("dop853"), "{}", text(&output.stderr));
}

#[test]
fn every_command_has_help_with_an_example() {
    for command in ["run", "modes", "plot", "export", "inspect", "precision", "validate"] {
        let output = signorini(&root(), &[command, "--help"]);
        assert_eq!(output.status.code(), Some(0));
        assert!(text(&output.stdout).contains(&format!("signorini {command}")), "{command}");
    }
}

#[test]
#[ignore = "two minutes"]
fn the_short_validation_passes() {
    let output = signorini(&root(), &["validate", "--short", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["failed"], serde_json::json!([]), "{json:#}");
    assert_eq!(output.status.code(), Some(0));
    let cases = json["cases"].as_array().unwrap();
    assert!(cases.len() >= 5);
    // what takes long runs only where it is named
    let list = signorini(&root(), &["validate", "--list", "--json"]);
    let list: Value = serde_json::from_slice(&list.stdout).unwrap();
    for case in list.as_array().unwrap() {
        let ran = cases.iter().any(|c| c["name"] == case["name"]);
        assert_eq!(case["only_by_name"], !ran, "{}", case["name"]);
    }
}
