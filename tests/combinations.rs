//! Which command takes which scene: `docs/reference/combinations.md` is what the program did with all of them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Output;

use rayon::prelude::*;
use serde_json::Value;

use crate::common::cuboid::cuboid;
use crate::common::rectangle::{msh, rectangle};
use crate::common::{root, run};
use signorini::mesh::ElementKind;

const BAR: &str = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [4]\nyoung = 1.0\narea = 1.0\ndensity = 1.0\n\
                   [[support]]\nedge = \"left\"\nfix = [\"x\"]\n";
const PLATE: &str = "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
                     [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n";
const MATRICES: &str =
    "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n";
const NAMED: &str = "[body]\nkind = \"matrices\"\nmass_matrix = \"M_named.mtx\"\nstiffness_matrix = \"K_named.mtx\"\n";
const CALCULIX: &str =
    "[body]\nkind = \"matrices\"\nmass_matrix = \"block.mas\"\nstiffness_matrix = \"block.sti\"\n";
const NASTRAN: &str = "[body]\nkind = \"matrices\"\nmass_matrix = \"super.pch:/MAAX\"\nstiffness_matrix = \"super.pch:/KAAX\"\n";
const PLANE: &str = "[body]\nkind = \"matrices\"\nmass_matrix = \"M_plane.mtx\"\nstiffness_matrix = \"K_plane.mtx\"\n";
const SHAKEN: &str = "[body]\nkind = \"matrices\"\nmass_matrix = \"M_based.mtx\"\nstiffness_matrix = \"K_based.mtx\"\n\
                      [[support]]\nnodes = [1]\nfix = [\"x\"]\n";
const SOLID: &str = "[body]\nkind = \"mesh\"\nfile = \"body.msh\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
                     [[support]]\ngroup = \"xmin\"\nfix = [\"x\", \"y\", \"z\"]\n";
/// A body of a mesh of one kind of element, in the plane or in space.
macro_rules! mesh {
    ($kind:literal, $state:literal) => {
        concat!(
            "[body]\nkind = \"mesh\"\nfile = \"",
            $kind,
            ".msh\"\nstate = \"",
            $state,
            "\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\ngroup = \"left\"\nfix = [\"x\", \"y\"]\n"
        )
    };
    ($kind:literal) => {
        concat!(
            "[body]\nkind = \"mesh\"\nfile = \"",
            $kind,
            ".msh\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\ngroup = \"xmin\"\nfix = [\"x\", \"y\", \"z\"]\n"
        )
    };
}
/// Two half plates of meshes that do not match.
const TWO: &str = "[[body]]\nname = \"a\"\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
                   [[body]]\nname = \"b\"\nkind = \"plate\"\nsize = [0.8, 0.3]\nelements = [3, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmove = [2.0, 0.0]\n\
                   [[support]]\nedge = \"a:left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"a:bottom\"\nfix = [\"y\"]\n\
                   [[support]]\nedge = \"b:right\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"b:bottom\"\nfix = [\"y\"]\n";
const DAMPING: &str = "[damping]\nratio = 0.05\nmode = 1\n";
/// Without damping no peak.
const UNDAMPED: &str = "[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.02\nomega = 1.7\n";
const LOAD: &str = "[[load]]\nkind = \"mode\"\nmode = 1\npeak = 2.0\nomega = 1.7\n";

/// A scene, in the parts that one or the other command wants changed.
#[derive(Clone)]
struct Row {
    name: &'static str,
    body: &'static str,
    contact: String,
    damping: &'static str,
    load: String,
    extra: &'static str,
    run: &'static str,
}

impl Row {
    fn of_contact(name: &'static str, body: &'static str, contact: &str) -> Row {
        let place = match body {
            MATRICES => "displacements = [3]",
            _ if body.contains("xmin") => "group = \"xmax\"",
            _ if body.contains(".msh") => "group = \"right\"",
            _ => "edge = \"right\"",
        };
        let contact = format!("[contact]\n{place}\ngap = 1.0\n{contact}\n");
        Row { name, body, contact, damping: DAMPING, load: LOAD.into(), extra: "", run: "" }
    }

    fn plate(name: &'static str, contact: &str) -> Row {
        Row::of_contact(name, PLATE, contact)
    }

    /// Two bodies.
    fn pair(name: &'static str, contact: &str) -> Row {
        let pair = "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\ngap = 1.0\n";
        let contact = format!("{pair}{contact}\n");
        Row { name, body: TWO, contact, damping: DAMPING, load: LOAD.into(), extra: "", run: "" }
    }

    fn text(&self, of: Scene) -> String {
        let (damping, load) = match of {
            Scene::Forced => (self.damping, &*self.load),
            Scene::Free => ("", ""),
        };
        format!(
            "{}{}{damping}{load}[orbit]\nomega = 1.7\nrange = [1.7, 1.9]\nharmonics = 5\nbeta = 0.3\n{}[run]\nuntil = 8.0\n{}",
            self.body, self.contact, self.extra, self.run
        )
    }
}

/// With its damping and its loads, or without.
#[derive(Clone, Copy, PartialEq)]
enum Scene {
    Forced,
    Free,
}

fn rows() -> Vec<(&'static str, Vec<Row>)> {
    let plate = |name, contact: &str| Row::plate(name, contact);
    let with = |name, extra, contact: &str| Row { extra, ..Row::plate(name, contact) };
    let integrator = |name, run| Row { run, ..Row::plate(name, "") };
    let damped = |name, damping| Row { damping, ..Row::plate(name, "") };
    let loaded = |name, more: &str| Row { load: more.into(), ..Row::plate(name, "") };
    let free = "[reduction]\nkind = \"free-interface\"\nmodes = 6\n";
    let fixed = "[reduction]\nkind = \"fixed-interface\"\nmodes = 6\n";
    let optimal = "method = \"mass-redistribution\"\nmass = \"optimal\"";
    let redistribution = "method = \"mass-redistribution\"";
    let impact = |name, e: &str| {
        let contact = format!("method = \"impact\"\nrestitution = {e}");
        Row { damping: "[damping]\nrayleigh = [0.1, 0.0]\n", ..Row::plate(name, &contact) }
    };
    vec![
        (
            "Bodies",
            vec![
                Row::of_contact("bar", BAR, ""),
                plate("plate", ""),
                Row::of_contact("matrices, `mass-redistribution`", MATRICES, redistribution),
                Row {
                    contact: "[contact]\ndisplacements = [\"12.1\"]\ngap = 1.0\nmethod = \"mass-redistribution\"\n".into(),
                    ..Row::of_contact("matrices of Abaqus, rows by names", NAMED, "")
                },
                Row {
                    contact: "[contact]\nnodes = [12]\ndirection = \"x\"\ngap = 1.0\n".into(),
                    extra: "[reduction]\nkind = \"free-interface\"\nmodes = 2\n",
                    ..Row::of_contact("matrices in free-interface form, contact by nodes", NAMED, "")
                },
                Row {
                    contact: "[contact]\ndisplacements = [\"12.1\"]\ngap = 1.0\nmethod = \"mass-redistribution\"\n".into(),
                    extra: "[[probe]]\nname = \"tip\"\nnode = \"12.1\"\n",
                    load: format!("{LOAD}[[load]]\nkind = \"gravity\"\namplitude = [0.05, 0.0, 0.0]\n"),
                    ..Row::of_contact("matrices of CalculiX, `[[probe]]`, gravity", CALCULIX, "")
                },
                Row {
                    contact: "[contact]\ndisplacements = [\"12.1\"]\ngap = 1.0\nmethod = \"mass-redistribution\"\n".into(),
                    ..Row::of_contact("matrices of Nastran (punch)", NASTRAN, "")
                },
                Row {
                    contact: "[[contact]]\nnodes = [12]\ndirection = [0.8, 0.6]\ngap = 1.0\nfriction = 0.2\n\
                              [[contact]]\nnodes = [5]\ndirection = \"-y\"\ngap = 1.2\n"
                        .into(),
                    ..Row::of_contact("matrices, an oblique rough wall and a smooth one", PLANE, "")
                },
                Row {
                    contact: "[contact]\nnodes = [12]\ndirection = \"x\"\ngap = 1.0\n".into(),
                    load: "[[load]]\nkind = \"base\"\namplitude = [0.05, 0.0, 0.0]\nomega = 1.7\nphase = -1.5707963267948966\n"
                        .into(),
                    ..Row::of_contact("matrices on supports that move", SHAKEN, "")
                },
                Row {
                    extra: "[[probe]]\nname = \"tip\"\nat = [1.0, 0.3]\nquantity = [\"displacement\", \"acceleration\", \"stress\", \"recovered-stress\"]\n[[probe]]\nname = \"face\"\nedge = \"right\"\n",
                    ..plate("`[[probe]]`", "")
                },
            ],
        ),
        (
            "Elements",
            vec![
                Row::of_contact("T3", mesh!("T3", "plane strain"), ""),
                Row::of_contact("T6", mesh!("T6", "plane strain"), ""),
                Row::of_contact("Q8", mesh!("Q8", "plane strain"), ""),
                Row::of_contact("Q9, `friction`", mesh!("Q9", "plane strain"), "friction = 0.3"),
                Row::of_contact(
                    "Q4, axisymmetric, `friction`",
                    mesh!("Q4", "axisymmetric"),
                    "friction = 0.3",
                ),
                Row::of_contact("Tet10", mesh!("Tet10"), ""),
                Row::of_contact("Hex20, `mass-redistribution`", mesh!("Hex20"), redistribution),
                Row::of_contact("prisms of 15 nodes", mesh!("Prism15"), ""),
            ],
        ),
        (
            "Contact",
            vec![
                plate("`stress = \"nodal-mean\"`", "stress = \"nodal-mean\""),
                plate("`stress = \"projection\"`", "stress = \"projection\""),
                plate("`inertia = \"constant\"`", "inertia = \"constant\""),
                plate("`mass-redistribution`", redistribution),
                plate("`mass = \"optimal\"`", optimal),
                plate("`penalty`", "method = \"penalty\""),
                plate("`nitsche`", "method = \"nitsche\""),
                plate("`nitsche`, `theta = 0`", "method = \"nitsche\"\ntheta = 0"),
                plate("`stop`", "method = \"stop\"\nstiffness = 20.0"),
                plate(
                    "`stop` with `preload`",
                    "method = \"stop\"\nstiffness = 20.0\npreload = 0.05",
                ),
                impact("`impact`, `restitution = 1`", "1.0"),
                impact("`impact`, `restitution = 0`", "0.0"),
                impact("`impact`, `restitution = 0.5`", "0.5"),
                plate("`moreau-jean`", "method = \"moreau-jean\""),
                Row {
                    damping: "",
                    load: String::new(),
                    ..Row::of_contact("`waves`, a bar without loads", BAR, "method = \"waves\"")
                },
                plate("`gap_behind`", "gap_behind = 1.0"),
                plate("a part of an edge, `from`", "from = [0.5, 1.0]"),
                plate("a part of an edge, `where`", "where = \"y < 0.2\"\nmethod = \"penalty\""),
                plate("chosen nodes, `nodes`", "nodes = [13]"),
                plate("`friction`", "friction = 0.3"),
                plate("`friction` on a belt", "friction = 0.3\nsurface = [0.0, 0.1]"),
                plate(
                    "`friction`, `tangent = \"massless\"`",
                    "friction = 0.3\ntangent = \"massless\"",
                ),
                Row::of_contact(
                    "`friction` in space, a surface that slides",
                    SOLID,
                    "friction = 0.3\nsurface = [0.0, 5.0, 0.0]",
                ),
                plate("`motion` of the obstacle", "motion = { amplitude = 0.1, omega = 1.7 }"),
                Row {
                    contact: "[contact]\nedge = \"right\"\ngap = \"1.0 + 0.1*cos(2*y - 1.7*t)\"\n"
                        .into(),
                    ..plate("a `gap` that moves from place to place", "")
                },
            ],
        ),
        (
            "Two bodies",
            vec![
                Row::pair("`slave`, `master`", ""),
                Row::pair(
                    "`stress = \"nodal-mean\"`, meshes that do not match",
                    "stress = \"nodal-mean\"",
                ),
                Row {
                    contact: "[contact]\ndisplacements = [3]\nagainst = [0]\ngap = 1.0\n".into(),
                    ..Row::of_contact("matrices, `against`", MATRICES, "")
                },
                Row::pair("`friction`", "friction = 0.3"),
                Row::pair("`friction`, `surface`", "friction = 0.3\nsurface = [0.0, 0.05]"),
                // around the equilibrium of a press fit, which opens
                Row {
                    contact: "[[contact]]\nslave = \"a:right\"\nmaster = \"b:left\"\ngap = -0.02\npress = true\n".into(),
                    load: UNDAMPED.into(),
                    extra: "[initial]\nequilibrium = true\n",
                    ..Row::pair("`press`, `equilibrium`", "")
                },
                Row::pair("`penalty`", "method = \"penalty\""),
                Row::pair("`impact`", "method = \"impact\""),
                Row {
                    extra: "[reduction]\nkind = \"fixed-interface\"\nmodes = 8\n",
                    ..Row::pair("fixed-interface", "")
                },
                Row {
                    extra: "[reduction]\nkind = \"free-interface\"\nmodes = 8\n",
                    ..Row::pair("free-interface", "")
                },
            ],
        ),
        (
            "Reductions",
            vec![
                with("`fixed-interface`", fixed, ""),
                with("`free-interface`", free, ""),
                with("`free-interface`, `mass-redistribution`", free, redistribution),
                with("`free-interface`, `penalty`", free, "method = \"penalty\""),
                with("`fixed-interface`, `mass = \"optimal\"`", fixed, optimal),
                with(
                    "`fixed-interface`, `[[slider]]` with `stiffness`",
                    "[reduction]\nkind = \"fixed-interface\"\nmodes = 6\n[[slider]]\nat = [0.5, 0.3]\ndirection = [1.0, 0.0]\nlimit = 0.02\nstiffness = 1.0\n",
                    "",
                ),
            ],
        ),
        (
            "Damping",
            vec![
                damped("`rayleigh`, mass alone", "[damping]\nrayleigh = [0.1, 0.0]\n"),
                damped("`ratios`", "[damping]\nratios = [[1, 0.03], [2, 0.05]]\n"),
                damped("`modal`", "[damping]\nmodal = 0.03\n"),
                Row { load: UNDAMPED.into(), ..damped("none", "") },
            ],
        ),
        (
            "Elements at nodes",
            vec![
                with(
                    "`[[spring]]`, `[[mass]]`",
                    "[[spring]]\nat = [0.5, 0.3]\ndirection = [0.0, 1.0]\nstiffness = 0.2\n[[mass]]\nat = [0.5, 0.3]\ndirection = [0.0, 1.0]\nmass = 0.02\n",
                    "",
                ),
                with(
                    "`[[damper]]`",
                    "[[damper]]\nat = [0.5, 0.3]\ndirection = [0.0, 1.0]\nviscosity = 0.05\n",
                    "",
                ),
                with(
                    "`[[slider]]`",
                    "[[slider]]\nat = [0.5, 0.3]\ndirection = [1.0, 0.0]\nlimit = 0.02\n",
                    "",
                ),
                with(
                    "`[[slider]]` with `stiffness`",
                    "[[slider]]\nat = [0.5, 0.3]\ndirection = [1.0, 0.0]\nlimit = 0.02\nstiffness = 1.0\n",
                    "",
                ),
            ],
        ),
        (
            "Loads",
            vec![
                loaded(
                    "`base`",
                    "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [0.3, 0.0]\nomega = 1.7\n",
                ),
                loaded(
                    "gravity beside a harmonic one",
                    &format!("{LOAD}[[load]]\nkind = \"gravity\"\namplitude = [0.05, 0.0]\n"),
                ),
                loaded(
                    "two frequencies",
                    &format!(
                        "{LOAD}[[load]]\nkind = \"mode\"\nmode = 2\namplitude = 0.1\nomega = 2.3\n"
                    ),
                ),
                loaded(
                    "`table`",
                    "[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.1\ntable = \"load.csv\"\n",
                ),
            ],
        ),
        (
            "Integrators",
            vec![
                integrator("`dop853`", "integrator = \"dop853\"\n"),
                integrator("`chebyshev`", "integrator = \"chebyshev\"\n"),
                integrator("`modal`", "integrator = \"modal\"\n"),
            ],
        ),
    ]
}

/// A command: its heading, the scene it wants, its arguments; `@` is the scene's file, `=NAME` the file that the command with that heading wrote, `&` a study of the scene, `#` the key of its gap.
const COLUMNS: [(&str, Scene, &[&str]); 26] = [
    ("run", Scene::Forced, &["run", "@"]),
    ("picture", Scene::Forced, &["plot", "=run"]),
    ("table", Scene::Forced, &["export", "=run", "--format", "csv"]),
    ("fields", Scene::Forced, &["export", "=run", "--format", "vtkhdf"]),
    ("page", Scene::Forced, &["view", "=run"]),
    ("modes", Scene::Forced, &["modes", "@"]),
    ("compare", Scene::Forced, &["compare", "@"]),
    ("reduce", Scene::Forced, &["reduce", "@"]),
    ("trust", Scene::Forced, &["trust", "@"]),
    ("precision", Scene::Forced, &["precision", "@", "--repeats", "1"]),
    ("study", Scene::Forced, &["study", "run", "&", "--workers", "1"]),
    ("orbit", Scene::Forced, &["orbit", "@"]),
    ("derived", Scene::Forced, &["orbit", "@", "--sensitivity", "omega"]),
    ("response", Scene::Forced, &["response", "@", "--points", "10"]),
    ("resumed", Scene::Forced, &["response", "@", "--points", "14", "--resume"]),
    ("bands", Scene::Forced, &["bands", "=response", "--deviation", "#=2%"]),
    ("hbm", Scene::Forced, &["response", "@", "--method", "hbm", "--step", "0.4"]),
    ("crosscheck", Scene::Forced, &["crosscheck", "=hbm", "@"]),
    ("sweep", Scene::Forced, &["response", "@", "--sweep", "up", "--step", "0.4"]),
    ("through", Scene::Forced, &["response", "@", "--through", "=sweep", "--points", "10"]),
    (
        "curve",
        Scene::Forced,
        &["curve", "@", "--of", "peak", "--over", "#=0.95,1.05", "--points", "2"],
    ),
    ("diagram", Scene::Forced, &["diagram", "@", "--over", "#=1.0,1.1", "--steps", "2"]),
    ("resonance", Scene::Forced, &["phase-resonance", "@", "--over", "#=1.0,1.1", "--steps", "2"]),
    ("basins", Scene::Forced, &["basins", "@", "--size", "3"]),
    ("backbone", Scene::Free, &["backbone", "@", "--step", "0.02"]),
    ("viscous", Scene::Free, &["backbone", "@", "--viscous", "--points", "6"]),
];

/// Those whose answers are points.
const FAMILIES: [&str; 8] =
    ["response", "resumed", "hbm", "crosscheck", "sweep", "through", "backbone", "viscous"];

/// What a command made of a scene.
#[derive(Debug, Clone, PartialEq)]
enum Outcome {
    Works,
    /// The message.
    Refused(String),
}

/// The message of a refusal and its advice, without the place and without the lines of the scene.
fn refusal(stderr: &str) -> String {
    let mut words = vec![];
    let mut takes = true;
    let is_warning = |l: &&str| l.starts_with("signorini: WARNING");
    for line in stderr.lines().filter(|l| !is_warning(l)) {
        let bare = line.trim().trim_start_matches(['×', '│', ' ']);
        if line.contains('╭') {
            takes = false;
        } else if bare.starts_with("help:") || (!takes && line.contains("help:")) {
            takes = true;
        }
        if takes && !line.contains('╰') {
            words.extend(bare.split_whitespace());
        }
    }
    let text = words.join(" ");
    let text = text.strip_prefix("signorini: ").unwrap_or(&text);
    // a file of results; scene.toml:12:1: load: …
    let text = text.split_once("run.h5: ").map_or(text, |(_, rest)| rest);
    let place = text.split_once(".toml:").map_or(text, |(_, rest)| {
        rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':').trim_start()
    });
    place.replace(" help: ", "; ").trim_end_matches(['\n', ' ']).to_owned()
}

/// Why the answer of a command is none: every frequency has an orbit, a row, a verdict.
fn flaw(heading: &str, answer: &Value) -> Option<String> {
    let points = answer["points"].as_array();
    if heading == "trust" {
        let figures = answer["figures"].as_array().map_or(0, Vec::len);
        return (figures < 3).then(|| "no figures".into());
    }
    if heading == "modes" {
        let modes = answer["open"]["omega"].as_array().map_or(0, Vec::len);
        return (modes == 0).then(|| "no modes".into());
    }
    if !FAMILIES.contains(&heading) {
        return None;
    }
    let Some(points) = points.filter(|p| !p.is_empty()) else { return Some("no points".into()) };
    let is_orbit = |p: &Value| p["converged"] == true;
    if heading == "viscous" {
        return (!points.iter().any(is_orbit)).then(|| "no orbit".into());
    }
    if ["response", "resumed", "through"].contains(&heading) {
        if let Some(p) = points.iter().find(|p| !is_orbit(p)) {
            return Some(p.to_string());
        }
        let is_end = |s: &&Value| !["range", "points"].contains(&s["end"].as_str().unwrap());
        return answer["stops"].as_array().unwrap().iter().find(is_end).map(Value::to_string);
    }
    None
}

fn outcome(heading: &str, output: &Output) -> Result<Outcome, String> {
    let said = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(2) => Ok(Outcome::Refused(refusal(&said))),
        // the number of points is reached; of series some frequencies may have none
        Some(0 | 3) => {
            let answer = serde_json::from_slice(&output.stdout).map_err(|e| e.to_string())?;
            flaw(heading, &answer).map_or(Ok(Outcome::Works), Err)
        }
        code => Err(format!("{code:?}: {said}")),
    }
}

fn outcomes(row: &Row, folder: &Path) -> Vec<Result<Outcome, String>> {
    std::fs::create_dir_all(folder).unwrap();
    let matrix = |name: &str, entries: &[(usize, usize, f64)]| {
        let mut text =
            format!("%%MatrixMarket matrix coordinate real symmetric\n4 4 {}\n", entries.len());
        entries.iter().for_each(|(i, j, x)| writeln!(text, "{i} {j} {x}").unwrap());
        std::fs::write(folder.join(name), text).unwrap();
        // the same with names: node 12 in direction 1 stands last
        let name_of = |i: &usize| ["3,1", "5,1", "7,1", "12,1"][i - 1];
        let lines =
            entries.iter().map(|(i, j, x)| format!("{}, {}, {x:e}", name_of(i), name_of(j)));
        let lines: Vec<String> = lines.collect();
        let named = name.replace(".mtx", "_named.mtx");
        std::fs::write(folder.join(named), lines.join("\n") + "\n").unwrap();
        // as CalculiX and Nastran write them
        let upper: String = entries.iter().map(|(i, j, x)| format!("{j} {i} {x:e}\n")).collect();
        let ending = if name.starts_with('K') { "sti" } else { "mas" };
        std::fs::write(folder.join(format!("block.{ending}")), upper).unwrap();
        std::fs::write(folder.join("block.dof"), "3.1\n5.1\n7.1\n12.1\n").unwrap();
        let called = format!("{}AAX", &name[..1]);
        let mut punch = format!("DMIG    {called:<8}{:>8}{:>8}{:>8}{:>8}\n", 0, 6, 2, 0);
        for (i, j, x) in entries {
            let [row, column] = [i, j].map(|k| ["3", "5", "7", "12"][k - 1]);
            writeln!(punch, "DMIG*   {called:<16}{column:>16}{:>16}", 1).unwrap();
            let value = format!("{x:.9E}");
            writeln!(punch, "*       {row:>16}{:>16}{value:>16}", 1).unwrap();
        }
        let path = folder.join("super.pch");
        let before = std::fs::read_to_string(&path).unwrap_or_default();
        std::fs::write(path, before + &punch).unwrap();
        // and with the node that the first spring hangs on
        let base: &[&str] = match name.starts_with('K') {
            true => &["1,1, 1,1, 16.0", "3,1, 1,1, -16.0"],
            false => &["1,1, 1,1, 0.5"],
        };
        let lines: Vec<&str> =
            lines.iter().map(String::as_str).chain(base.iter().copied()).collect();
        let based = name.replace(".mtx", "_based.mtx");
        std::fs::write(folder.join(based), lines.join("\n") + "\n").unwrap();
        // a chain along x and one along y, tied a little where they have one node
        let node = |i: usize| ["3", "5", "7", "12"][i - 1];
        let along = |axis: u32, factor: f64| {
            let line = move |(i, j, x): &(usize, usize, f64)| {
                format!("{},{axis}, {},{axis}, {:e}", node(*i), node(*j), factor * x)
            };
            entries.iter().map(line).collect::<Vec<_>>()
        };
        let stiff = name.starts_with('K');
        let mut lines = [along(1, 1.0), along(2, if stiff { 1.5 } else { 1.0 })].concat();
        if stiff {
            lines.push("12,1, 12,2, 2.0".into());
        }
        let plane = name.replace(".mtx", "_plane.mtx");
        std::fs::write(folder.join(plane), lines.join("\n") + "\n").unwrap();
    };
    matrix("M.mtx", &[(1, 1, 1.0), (2, 2, 1.0), (3, 3, 1.0), (4, 4, 0.5)]);
    let stiffness = [
        (1, 1, 32.0),
        (2, 1, -16.0),
        (2, 2, 32.0),
        (3, 2, -16.0),
        (3, 3, 32.0),
        (4, 3, -16.0),
        (4, 4, 16.0),
    ];
    matrix("K.mtx", &stiffness);
    let table: Vec<String> =
        (0..40).map(|k| format!("{},{}", 0.4 * k as f64, (0.7 * k as f64).cos())).collect();
    std::fs::write(folder.join("load.csv"), table.join("\n") + "\n").unwrap();
    let solid = cuboid(ElementKind::Hex8, [1.0, 0.3, 0.3], [4, 2, 1], 0.0);
    std::fs::write(folder.join("body.msh"), msh(&solid, |_| 0)).unwrap();
    for kind in ElementKind::ALL.into_iter().filter(|k| k.dim() > 1) {
        let mesh = match kind.dim() {
            2 => rectangle(kind, [0.0, 1.0], 0.3, (3, 1), 0.0),
            _ => cuboid(kind, [1.0, 0.3, 0.3], [2, 1, 1], 0.0),
        };
        let name = format!("{}.msh", kind.name());
        std::fs::write(folder.join(name), msh(&mesh, |_| 0)).unwrap();
    }
    let mut done: BTreeMap<&str, Result<Outcome, String>> = BTreeMap::new();
    let file = |heading: &str| {
        let name = match heading {
            "resumed" => "response.h5".to_owned(),
            // beginnings of names
            "picture" | "table" | "fields" | "compare" | "precision" | "study" => {
                heading.to_owned()
            }
            "page" => "page.html".to_owned(),
            _ => format!("{heading}.h5"),
        };
        folder.join(name).display().to_string()
    };
    for (heading, of, arguments) in COLUMNS {
        let scene = folder.join(if of == Scene::Free { "free.toml" } else { "scene.toml" });
        std::fs::write(&scene, row.text(of)).unwrap();
        let gap =
            if row.contact.contains("[[contact]]") { "contact[0].gap" } else { "contact.gap" };
        let study = folder.join("study.toml");
        let text =
            format!("scene = \"scene.toml\"\ncommand = \"run\"\n[vary]\n\"{gap}\" = [1.0, 1.05]\n");
        std::fs::write(&study, text).unwrap();
        let earlier = arguments.iter().find_map(|a| a.strip_prefix('='));
        let refused =
            earlier.map(|name| &done[name]).filter(|d| **d != Ok(Outcome::Works)).cloned();
        let found = refused.unwrap_or_else(|| {
            let arguments = arguments.iter().map(|a| match a.strip_prefix('=') {
                Some(name) => file(name),
                None => a
                    .replace('@', &scene.display().to_string())
                    .replace('&', &study.display().to_string())
                    .replace('#', gap),
            });
            let mut arguments: Vec<String> = arguments.collect();
            if !["trust", "modes"].contains(&heading) {
                arguments.extend(["-o".into(), file(heading)]);
            }
            arguments.extend(["--json".into(), "--quiet".into()]);
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            outcome(heading, &run(&arguments)).map_err(|e| format!("{}, {heading}: {e}", row.name))
        });
        done.insert(heading, found);
    }
    COLUMNS.iter().map(|(heading, ..)| done[heading].clone()).collect()
}

/// A title, and rows of a name and what each command made of it.
type Table<'a> = (&'a str, Vec<(&'a str, &'a [Outcome])>);

/// Words on lines that begin like this.
fn wrapped(indent: &str, text: &str) -> String {
    let mut lines = vec![indent.to_owned()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().unwrap();
        if last.chars().count() + 1 + word.chars().count() > 118 {
            lines.push(format!("{indent}{word}"));
        } else {
            *last += if last.trim().is_empty() { "" } else { " " };
            *last += word;
        }
    }
    lines.join("\n")
}

fn page(tables: &[Table]) -> String {
    let mut messages: Vec<&str> = vec![];
    let about = "Each cell is a run of the program on a small body (`cargo test combinations::`): *yes*, with every frequency answered, or the number of the refusal below. \
                 `trust` is `signorini trust`; `resumed`: `response --resume`; `hbm`: `response --method hbm`; `crosscheck` of those series; `sweep`: `response --sweep up`; \
                 `through`: `response --through` of that sweep; `study`: two runs; `bands` of the response, `curve` of its peak, `diagram`, `resonance` (`phase-resonance`): over the gap; `backbone` and `viscous` (`backbone --viscous`) of the scene without its damping and its loads; `derived`: \
                 `orbit --sensitivity omega`; `picture`, `table`, `fields`, `page`: `plot`, `export` to CSV and VTKHDF, `view` of the run. What is not said is that of the plate: method \
                 `nbm`, damping by a ratio, a harmonic load in the first mode.";
    let mut text = format!("# What goes with what\n\n{}\n", wrapped("", about));
    for (title, rows) in tables {
        write!(text, "\n## {title}\n\n| |").unwrap();
        COLUMNS.iter().for_each(|(heading, ..)| write!(text, " {heading} |").unwrap());
        text.push_str("\n| --- |");
        COLUMNS.iter().for_each(|_| text.push_str(" --- |"));
        for (name, outcomes) in rows {
            write!(text, "\n| {name} |").unwrap();
            for outcome in *outcomes {
                match outcome {
                    Outcome::Works => text.push_str(" yes |"),
                    Outcome::Refused(message) => {
                        let known = messages.iter().position(|m| m == message);
                        let number = known.unwrap_or_else(|| {
                            messages.push(message);
                            messages.len() - 1
                        });
                        write!(text, " {} |", number + 1).unwrap();
                    }
                }
            }
        }
        text.push('\n');
    }
    text.push_str("\n## Refusals\n\n");
    for (number, message) in messages.iter().enumerate() {
        let item = wrapped("    ", &format!("{}. {message}", number + 1));
        writeln!(text, "{}", item.trim_start()).unwrap();
    }
    text
}

/// Every command with every kind of scene: it works, or says why not and what to do. The page says which.
#[test]
#[ignore = "four minutes"]
fn the_page_of_combinations_is_what_the_program_does() {
    let place = tempfile::tempdir().unwrap();
    let groups = rows();
    let all: Vec<&Row> = groups.iter().flat_map(|(_, rows)| rows).collect();
    let done: Vec<_> = all
        .par_iter()
        .enumerate()
        .flat_map_iter(|(k, row)| outcomes(row, &place.path().join(k.to_string())))
        .collect();
    let flawed: Vec<&String> = done.iter().filter_map(|d| d.as_ref().err()).collect();
    assert!(flawed.is_empty(), "{flawed:#?}");
    let done: Vec<Outcome> = done.into_iter().map(Result::unwrap).collect();
    let mut done = done.chunks(COLUMNS.len());
    let tables: Vec<Table> = groups
        .iter()
        .map(|(title, rows)| {
            let rows = rows.iter().map(|row| (row.name, done.next().unwrap()));
            (*title, rows.collect::<Vec<_>>())
        })
        .collect();
    let now = page(&tables);
    let known = std::fs::read_to_string(root().join("docs/reference/combinations.md"));
    if !known.is_ok_and(|known| known == now) {
        let new = root().join("target/combinations.md");
        std::fs::write(&new, now).unwrap();
        panic!("{} is what the program does; docs/reference/combinations.md is not", new.display());
    }
}
