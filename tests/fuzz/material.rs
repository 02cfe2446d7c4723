//! Proper inputs, as small as they can be: what the mutations start from.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Free motions of a bar: periodic orbits and their families take milliseconds.
pub const BAR: &str = r#"title = "Bar"

[body]
kind = "bar"
size = [1.0]
elements = [3]
young = 1.0
density = 1.0

[[support]]
edge = "left"
fix = ["x"]

[contact]
edge = "right"
gap = 1.0

[initial]
displacement = ["-2*x"]

[run]
until = 3.0
samples = 8
integrator = "modal"

[orbit]
omega = 1.8
range = [1.7, 1.8]
harmonics = 3
"#;

/// Nearly every key there is.
pub const PLATE: &str = r#"title = "Plate"

[body]
kind = "plate"
size = [1.0, 0.4]
elements = [3, 1]
young = 1.0
poisson = 0.3
density = 1.0
thickness = 1.0
mass = "consistent"

[[support]]
edge = "left"
fix = ["x", "y"]

[contact]
edge = "right"
gap = "1.0 + 0.02*y"
boundary_mass = "lumped"
method = "nbm"

[damping]
rayleigh = [0.0, 0.01]

[[load]]
kind = "mode"
mode = 2
amplitude = 0.1
omega = 1.6
phase = 0.1

[[load]]
kind = "gravity"
amplitude = [0.0, -0.01]

[[load]]
kind = "traction"
edge = "top"
amplitude = [0.0, 0.001]

[[load]]
kind = "point"
at = [0.6, 0.2]
amplitude = [0.01, 0.0]

[initial]
mode = 2
amplitude = -1.2

[run]
periods = 1
integrator = "dopri5"
rtol = 1e-6
atol = 1e-9
samples = 8
switch_limit = 40.0
"#;

/// A forced and damped bar: responses.
pub const FORCED: &str = r#"title = "Forced bar"

[body]
kind = "bar"
size = [1.0]
elements = [2]
young = 1.0
density = 1.0
area = 1.0
mass = "lumped"

[[support]]
edge = "left"
fix = ["x"]

[contact]
edge = "right"
gap = 1.0
boundary_mass = "consistent"

[damping]
ratio = 0.05
mode = 1

[[load]]
kind = "mode"
mode = 1
peak = 2.0
omega = 1.7

[run]
periods = 3
samples = 12
rtol = 1e-7

[orbit]
range = [1.5, 1.6]
ratios = [0.05]
harmonics = 3
"#;

/// Falls on a floor: no support, a constant load, expressions.
pub const FALLING: &str = r#"title = "Falling bar"

[body]
kind = "bar"
size = [2.0]
elements = [3]
young = 100.0
density = 1.0

[contact]
edge = "left"
gap = "0.1 + 0*x"

[[load]]
kind = "gravity"
amplitude = -1.0

[initial]
displacement = ["0.01*x"]
velocity = ["-0.1*exp(-x)"]

[run]
until = 1.0
samples = 8
integrator = "auto"
"#;

/// A chain of masses given by matrices; `{}` is where they come from.
const CHAIN: &str = r#"title = "Chain"

[body]
kind = "matrices"
mass_matrix = "chain{M}"
stiffness_matrix = "chain{K}"
damping_matrix = "chain{C}"

[contact]
displacements = [2, 3]
gaps = [1.0, 1.1]
n_c = "chain{NC}"
n_o = "chain{NO}"

[initial]
mode = 1
amplitude = -1.4

[run]
until = 6.0
samples = 8
integrator = "modal"
"#;

/// The matrices of the chain by name, rows, columns, values.
const MATRICES: &[(&str, usize, usize, &[f64])] = &[
    ("M", 4, 4, &[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.2, 0., 0., 0.2, 1.]),
    ("K", 4, 4, &[2., -1., 0., 0., -1., 2., -1., 0., 0., -1., 2., -1., 0., 0., -1., 1.]),
    ("C", 4, 4, &[0.1, 0., 0., 0., 0., 0.1, 0., 0., 0., 0., 0.1, 0.02, 0., 0., 0.02, 0.1]),
    ("NC", 2, 2, &[2., -0.9, -0.1, 1.]),
    ("NO", 2, 2, &[0., -1., 0.3, -0.8]),
];

/// Rows, columns, values row by row.
type Matrix<'a> = (usize, usize, &'a [f64]);

/// A matrix as Matrix Market, all entries column by column.
fn dense_text((rows, columns, values): Matrix) -> String {
    let entries = (0..columns).flat_map(|j| (0..rows).map(move |i| values[columns * i + j]));
    let entries: Vec<String> = entries.map(|x| format!("{x}\n")).collect();
    format!("%%MatrixMarket matrix array real general\n{rows} {columns}\n{}", entries.concat())
}

/// A symmetric matrix as Matrix Market, the entries of its lower triangle that are not zero.
fn symmetric_text((rows, columns, values): Matrix) -> String {
    let places = (0..columns).flat_map(|j| (j..rows).map(move |i| (i, j)));
    let entries: Vec<String> = places
        .map(|(i, j)| (i + 1, j + 1, values[columns * i + j]))
        .filter(|entry| entry.2 != 0.0)
        .map(|(i, j, x)| format!("{i} {j} {x:e}\n"))
        .collect();
    format!(
        "%%MatrixMarket matrix coordinate real symmetric\n% chain\n{rows} {columns} {}\n{}",
        entries.len(),
        entries.concat()
    )
}

/// A family that is begun, and gone on with.
pub struct Begun {
    pub name: &'static str,
    /// The command, up to its options that both share.
    pub command: &'static [&'static str],
    /// Options that begin it and leave something to do.
    first: &'static [&'static str],
    /// Options that go on.
    pub rest: &'static [&'static str],
}

/// One family of each kind.
pub const FAMILIES: &[Begun] = &[
    Begun {
        name: "backbone",
        command: &["backbone", "bar.toml", "--step", "0.02"],
        first: &["--range", "1.7,1.75"],
        rest: &[],
    },
    Begun {
        name: "branch",
        command: &["backbone", "bar.toml", "--follow", "arclength"],
        first: &["--points", "4"],
        rest: &["--points", "6"],
    },
    Begun {
        name: "hbm",
        command: &[
            "backbone",
            "bar.toml",
            "--method",
            "hbm",
            "--harmonics",
            "1,3",
            "--step",
            "0.03",
        ],
        first: &["--range", "1.7,1.74"],
        rest: &[],
    },
    Begun {
        name: "viscous",
        command: &[
            "backbone",
            "bar.toml",
            "--viscous",
            "--beta",
            "0.05",
            "--quick",
            "--step",
            "0.02",
        ],
        first: &["--range", "1.7,1.75"],
        rest: &[],
    },
    Begun {
        name: "mode",
        command: &[
            "backbone",
            "bar.toml",
            "--viscous",
            "--beta",
            "0.05",
            "--quick",
            "--follow",
            "arclength",
        ],
        first: &["--points", "4"],
        rest: &["--points", "6"],
    },
    Begun {
        name: "fed",
        command: &[
            "backbone",
            "bar.toml",
            "--viscous",
            "--beta",
            "0.05",
            "--method",
            "hbm",
            "--harmonics",
            "3,7",
            "--step",
            "0.03",
        ],
        first: &["--range", "1.7,1.74"],
        rest: &[],
    },
    Begun {
        name: "tongue",
        command: &[
            "backbone",
            "bar.toml",
            "--viscous",
            "--beta",
            "0.05",
            "--method",
            "hbm",
            "--harmonics",
            "3",
            "--follow",
            "arclength",
        ],
        first: &["--points", "4"],
        rest: &["--points", "6"],
    },
    Begun {
        name: "response",
        command: &["response", "forced.toml"],
        first: &["--points", "4"],
        rest: &["--points", "6"],
    },
];

/// Files that everything starts from, by name.
pub struct Material {
    pub folder: PathBuf,
}

/// The program, in a folder and with limits of memory and of processor time, so that a fault ends the case and not the machine.
pub fn limited(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command
        .args([
            "-c",
            "ulimit -v 4000000 2>/dev/null; ulimit -S -t 10; ulimit -c 0; exec \"$0\" \"$@\"",
        ])
        .arg(env!("CARGO_BIN_EXE_signorini"))
        .args(arguments)
        .args(["--threads", "1"])
        .current_dir(folder)
        .env("RUST_BACKTRACE", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

impl Material {
    /// Make everything, most of it with the program itself.
    pub fn new(folder: &Path) -> Material {
        let made = Material { folder: folder.to_owned() };
        made.write("bar.toml", BAR);
        made.write("plate.toml", PLATE);
        made.write("forced.toml", FORCED);
        made.write("falling.toml", FALLING);
        made.chain();
        // states of files as initial ones: on the same mesh, and on another, where they are interpolated
        let start = "file = \"input.h5\"";
        let bar =
            BAR.replace("displacement = [\"-2*x\"]", start).replace("until = 3.0", "until = 0.5");
        made.write("from.toml", &bar);
        made.write("from-other.toml", &bar.replace("elements = [3]", "elements = [4]"));
        let plate = PLATE
            .replace("mode = 2\namplitude = -1.2", start)
            .replace("periods = 1", "until = 0.5");
        made.write("from-plate.toml", &plate);
        made.run(&["run", "bar.toml", "-o", "bar.h5"]);
        made.run(&["run", "plate.toml", "-o", "plate.h5"]);
        made.run(&["orbit", "bar.toml", "-o", "orbit.h5"]);
        FAMILIES.iter().for_each(|f| made.family(f));
        made.run(&["crosscheck", "hbm.h5", "bar.toml", "--quick", "-o", "checked.h5"]);
        made.series();
        made
    }

    /// The bytes of a file.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The text of a file.
    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.join(name), text).unwrap();
    }

    fn run(&self, arguments: &[&str]) {
        let status = limited(&self.folder, arguments).stderr(Stdio::inherit()).status().unwrap();
        assert!(status.success(), "{arguments:?}: {status}");
    }

    /// A family, with the journal that it keeps while it is computed: a second link holds it when the program removes it.
    fn family(&self, begun: &Begun) {
        let file = format!("{}.h5", begun.name);
        let (journal, kept) = (format!("{file}.journal"), format!("{file}.kept"));
        let (journal, kept) = (self.folder.join(journal), self.folder.join(kept));
        let all = [begun.command, begun.first, &["-o", &file, "--force"]].concat();
        // seldom the journal is gone before it is seen
        for _ in 0..20 {
            let mut child = limited(&self.folder, &all).spawn().unwrap();
            while !ended(&mut child) && std::fs::hard_link(&journal, &kept).is_err() {
                std::thread::sleep(Duration::from_micros(200));
            }
            // 3: not all was done
            let code = child.wait().unwrap().code();
            assert!(matches!(code, Some(0 | 3)), "{all:?}: {code:?}");
            if kept.exists() {
                return;
            }
        }
        panic!("{}: no journal was seen", journal.display());
    }

    /// The chain's matrices as Matrix Market, dense and sparse, and as HDF5; a scene for each.
    fn chain(&self) {
        let file = crate::common::hdf5_files().create(self.folder.join("chain.h5")).unwrap();
        for &(name, rows, columns, values) in MATRICES {
            let array = ndarray::Array2::from_shape_vec((rows, columns), values.to_vec()).unwrap();
            file.new_dataset_builder().with_data(&array).create(name).unwrap();
            let matrix = (rows, columns, values);
            let text = if rows == 4 { symmetric_text(matrix) } else { dense_text(matrix) };
            self.write(&format!("chain-{name}.mtx"), &text);
        }
        let scene = |from: &dyn Fn(&str) -> String| {
            MATRICES
                .iter()
                .fold(CHAIN.to_owned(), |text, m| text.replace(&format!("{{{}}}", m.0), &from(m.0)))
        };
        self.write("chain.toml", &scene(&|name| format!("-{name}.mtx")));
        self.write("chain-hdf5.toml", &scene(&|name| format!(".h5:/{name}")));
    }

    /// The first harmonic-balance points as CSV.
    fn series(&self) {
        let file = crate::common::hdf5_files().open(self.folder.join("hbm.h5")).unwrap();
        let omega: Vec<f64> = file.dataset("hbm/omega").unwrap().read_raw().unwrap();
        let all: ndarray::Array3<f64> = file.dataset("hbm/coefficients").unwrap().read().unwrap();
        let mut text = String::from("point,omega,k,part,u_1,u_2\n");
        for (p, omega) in omega.iter().enumerate().take(3) {
            for f in 0..all.dim().1.min(5) {
                let (k, part) = (f.div_ceil(2), if f > 0 && f % 2 == 0 { "sin" } else { "cos" });
                let (a, b) = (all[(p, f, 0)], all[(p, f, 1)]);
                text.push_str(&format!("{},{omega},{k},{part},{a:e},{b:e}\n", p + 1));
            }
        }
        self.write("series.csv", &text);
    }
}

fn ended(child: &mut Child) -> bool {
    child.try_wait().unwrap().is_some()
}
