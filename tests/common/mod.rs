//! Shared test problems: each with its reference solution.
#![allow(dead_code)]

#[path = "../../validate/bodies/cuboid.rs"]
pub mod cuboid;
#[path = "../../validate/bodies/rectangle.rs"]
pub mod rectangle;
mod unavailable;

#[allow(unused_imports)]
pub use unavailable::{Kind, python, unavailable};

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use faer::Mat;
use serde_json::Value;
use signorini::contact::{State, System};
use signorini::event::{self, Observer, Options, Report, Silent};
use signorini::flow::Tolerances;
use signorini::orbit::shooting::linearised;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};
use signorini::simulate::{by_name, simulate};

/// The project's folder.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The program, in the project's folder.
pub fn program() -> std::process::Command {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_signorini"));
    command.current_dir(root());
    command
}

/// Until what another process has begun, and will surely do, is done. A test that waits in vain fails here, with words: it does not hold up a suite.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = std::time::Instant::now();
    while !is_so() {
        assert!(begun.elapsed().as_secs() < 600, "ten minutes, and still not: {what}");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

/// The program with arguments, on one thread.
pub fn run(arguments: &[&str]) -> std::process::Output {
    program().args(arguments).args(["--threads", "1"]).output().unwrap()
}

/// What it prints with `--json`; it must succeed.
pub fn json(arguments: &[&str]) -> Value {
    let output = run(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// One displacement before an elastic stop: M = K = B = 1, damped by 0.1 M, a harmonic load.
pub fn elastic_stop(
    (load, omega): (f64, f64),
    stiffness: f64,
    gap: f64,
    range: [f64; 2],
) -> String {
    format!(
        "title = \"oscillator\"\n[body]\nkind = \"matrices\"\nmass_matrix = \"one.mtx\"\nstiffness_matrix = \"one.mtx\"\n\
         [contact]\ndisplacements = [0]\ngap = {gap:?}\nmethod = \"penalty\"\nstiffness = {stiffness:?}\n\
         [damping]\nrayleigh = [0.1, 0.0]\n[[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = {load:?}\nomega = {omega:?}\n\
         [orbit]\nrange = {range:?}\n"
    )
}

/// The motion of that oscillator (gap 1) from a state, by Runge–Kutta's method with so many small steps a period; told of each step with its time and the state before it. The state at the end.
pub fn small_steps(
    (damping, stiffness): (f64, f64),
    (load, omega): (f64, f64),
    start: [f64; 2],
    (periods, steps): (u32, u32),
    mut each: impl FnMut(u32, f64, [f64; 2]),
) -> [f64; 2] {
    let force = |t: f64, [q, v]: [f64; 2]| {
        [v, load * (omega * t).cos() - damping * v - q - stiffness * (q - 1.0).max(0.0)]
    };
    let h = std::f64::consts::TAU / omega / f64::from(steps);
    let at = |x: [f64; 2], d: [f64; 2], s: f64| [x[0] + s * d[0], x[1] + s * d[1]];
    let mut x = start;
    for k in 0..periods * steps {
        let t = f64::from(k) * h;
        each(k, t, x);
        let a = force(t, x);
        let b = force(t + 0.5 * h, at(x, a, 0.5 * h));
        let c = force(t + 0.5 * h, at(x, b, 0.5 * h));
        let d = force(t + h, at(x, c, h));
        x = at(x, [0, 1].map(|i| a[i] + 2.0 * (b[i] + c[i]) + d[i]), h / 6.0);
    }
    x
}

/// A command is refused as bad input, with words of why.
pub fn refused(arguments: &[&str], words: &str) {
    let output = run(arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{arguments:?}: {text}");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert!(text.contains(words), "{arguments:?}: {text}");
}

/// The path of a scene written into a folder, beside `one.mtx`, a matrix of 1.
pub fn with_unit_matrix(folder: &Path, scene: &str) -> String {
    let one = "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 1.0\n";
    std::fs::write(folder.join("one.mtx"), one).unwrap();
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    path.display().to_string()
}

/// How tests open HDF5 files: without a lock. A child that another thread starts meanwhile inherits the lock until it
/// has become the program, and the program is then refused a file that nobody holds.
pub fn hdf5_files() -> hdf5::FileBuilder {
    let mut files = hdf5::File::with_options();
    files.with_fapl(|access| access.file_locking(false));
    files
}

/// All datasets of an HDF5 file: shape and bytes.
pub fn datasets(path: &Path) -> BTreeMap<String, (Vec<usize>, Vec<u8>)> {
    fn walk(g: &hdf5::Group, all: &mut BTreeMap<String, (Vec<usize>, Vec<u8>)>) {
        for d in g.datasets().unwrap() {
            use hdf5::types::TypeDescriptor::*;
            let bytes: Vec<u8> = match d.dtype().unwrap().to_descriptor().unwrap() {
                Float(_) => d
                    .read_raw::<f64>()
                    .unwrap()
                    .iter()
                    .flat_map(|x| x.to_bits().to_le_bytes())
                    .collect(),
                Integer(_) => {
                    d.read_raw::<i64>().unwrap().iter().flat_map(|x| x.to_le_bytes()).collect()
                }
                Unsigned(_) => d.read_raw::<u8>().unwrap(),
                FixedAscii(_) => {
                    let words = d.read_raw::<hdf5::types::FixedAscii<256>>().unwrap();
                    words.iter().flat_map(|w| [w.as_bytes(), b";"].concat()).collect()
                }
                FixedUnicode(_) => {
                    let words = d.read_raw::<hdf5::types::FixedUnicode<256>>().unwrap();
                    words.iter().flat_map(|w| [w.as_bytes(), b";"].concat()).collect()
                }
                VarLenUnicode => {
                    let words = d.read_raw::<hdf5::types::VarLenUnicode>().unwrap();
                    words.iter().flat_map(|w| [w.as_bytes(), b";"].concat()).collect()
                }
                other => panic!("{}: {other:?}", d.name()),
            };
            all.insert(d.name(), (d.shape(), bytes));
        }
        for group in g.groups().unwrap() {
            walk(&group, all);
        }
    }
    let mut all = BTreeMap::new();
    walk(&hdf5_files().open(path).unwrap(), &mut all);
    assert!(!all.is_empty());
    all
}

/// A scene from its text.
pub fn scene(text: &str) -> Scene {
    Scene::parse(text, Path::new("test.toml")).unwrap_or_else(|e| panic!("{e}"))
}

/// The problem of a scene's text.
pub fn problem(text: &str) -> Problem {
    Problem::new(&scene(text), None).unwrap_or_else(|e| panic!("{e}"))
}

/// A whole run of a scene by an integrator, at tight tolerances.
pub fn run_by(scene: &Scene, integrator: Integrator) -> Report {
    let mut scene = scene.clone();
    if let Some(run) = &mut scene.run {
        (run.integrator, run.rtol, run.atol) = (integrator, 1e-12, 1e-15);
    }
    let problem = Problem::new(&scene, None).unwrap();
    let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    assert_eq!(report.proof.missed, 0);
    report
}

/// A bar of unit length and gap.
pub fn bar(n: usize) -> String {
    format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\n"
    )
}

/// The half plate of `scenarios/half-plate-orbit.toml` on any mesh.
pub fn half_plate(nx: usize, ny: usize, method: &str) -> String {
    format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n\
         [contact]\nedge = \"right\"\ngap = 1.0\n{method}"
    )
}

/// A shipped scene.
pub fn shipped(name: &str) -> Scene {
    Scene::read(&root().join("scenarios").join(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// `‖a − b‖ / ‖b‖`
pub fn relative(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distance: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (distance / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// One switch of a reference file; several nodes may switch at once.
pub struct ReferenceSwitch {
    pub t: f64,
    pub y: Vec<f64>,
    pub kind: String,
    pub energy_jump: f64,
}

/// An independent solution with the problem that it solves.
pub struct Reference {
    pub text: String,
    pub problem: Problem,
    pub until: f64,
    /// Final `u = (u_O, u_C)` and its rate.
    pub u: Vec<f64>,
    pub v: Vec<f64>,
    pub switches: Vec<ReferenceSwitch>,
    pub energy: (f64, f64),
    pub omega_open: Vec<f64>,
    pub omega_closed: Vec<f64>,
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Read `tests/reference/NAME.json` and build its problem from a scene.
pub fn reference_problem(name: &str) -> Reference {
    let path = root().join("tests/reference").join(format!("{name}.json"));
    let json: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let case = &json["case"];
    let size = numbers(&case["size"]);
    let roller = if case["roller_bottom"].as_bool().unwrap() {
        "[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n"
    } else {
        ""
    };
    let text = format!(
        "[body]\nkind = \"plate\"\nsize = [{}, {}]\nelements = [{}, {}]\nyoung = {}\npoisson = {}\n\
         density = {}\nthickness = {}\nmass = {}\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n{roller}\
         [contact]\nedge = \"right\"\ngap = {}\nboundary_mass = {}\n\
         [initial]\nmode = {}\namplitude = {}\n[run]\nuntil = {}\n",
        size[0],
        size[1],
        case["nx"],
        case["ny"],
        case["young"],
        case["poisson"],
        case["density"],
        case["thickness"],
        case["mass"],
        case["gap"],
        case["boundary_mass"],
        case["initial_mode_index_1based"],
        case["amplitude"],
        case["until"],
    );
    let problem = problem(&text);
    let body = &problem.system.body;
    // the file's nodes in their own order → ours
    let place: Vec<usize> = json["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| {
            let p = numbers(p);
            let node = body.mesh.nearest_node([p[0], p[1], 0.0]);
            let q = body.mesh.nodes()[node];
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12);
            node
        })
        .collect();
    let state = |key: &str| {
        let mut nodal = vec![0.0; 2 * body.mesh.n_nodes()];
        for (row, &node) in json[key].as_array().unwrap().iter().zip(&place) {
            nodal[2 * node..2 * node + 2].copy_from_slice(&numbers(row));
        }
        body.dofs.gather(&nodal)
    };
    let u0 = state("u0");
    let n_o = problem.system.n_o();
    assert!(relative(&problem.initial.u, &u0[..n_o]) < 1e-11, "initial state");
    let switches = json["switches"].as_array().unwrap().iter().map(|s| ReferenceSwitch {
        t: s["t"].as_f64().unwrap(),
        y: numbers(&s["y"]),
        kind: s["kind"].as_str().unwrap().to_owned(),
        energy_jump: s["energy_jump"].as_f64().unwrap(),
    });
    Reference {
        until: case["until"].as_f64().unwrap(),
        u: state("uT"),
        v: state("vT"),
        switches: switches.collect(),
        energy: (json["energy_start"].as_f64().unwrap(), json["energy_end"].as_f64().unwrap()),
        omega_open: numbers(&json["omega_open"]),
        omega_closed: numbers(&json["omega_closed"]),
        text,
        problem,
    }
}

/// splitmix64: from the same seed the same numbers everywhere.
pub struct Splitmix(Cell<u64>);

impl Splitmix {
    pub fn new(seed: u64) -> Splitmix {
        Splitmix(Cell::new(seed))
    }

    /// 64 random bits.
    pub fn bits(&self) -> u64 {
        self.0.set(self.0.get().wrapping_add(0x9e37_79b9_7f4a_7c15));
        let mut z = self.0.get();
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number below `n`, or 0 if there is none.
    pub fn below(&self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// One of a list.
    pub fn pick<T: Copy>(&self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    /// One of a list that may be empty.
    pub fn any<T: Clone>(&self, list: &[T]) -> Option<T> {
        list.get(self.below(list.len())).cloned()
    }
}

/// Numbers in [−1, 1) from a seed.
pub fn random(n: usize, seed: u64) -> Vec<f64> {
    let source = Splitmix::new(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    (0..n).map(|_| (source.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0).collect()
}

/// Keeps every stored state.
#[derive(Default)]
pub struct Collector {
    pub t: Vec<f64>,
    pub u: Vec<Vec<f64>>,
    pub v: Vec<Vec<f64>>,
    pub pressure: Vec<Vec<f64>>,
    pub active: Vec<signorini::contact::States>,
}

impl signorini::event::Observer for Collector {
    type Error = std::convert::Infallible;
    fn sample(&mut self, s: &signorini::event::Sample) -> Result<(), Self::Error> {
        self.t.push(s.t);
        self.u.push(s.u.to_vec());
        self.v.push(s.v.to_vec());
        self.pressure.push(s.pressure.to_vec());
        self.active.push(s.active.clone());
        Ok(())
    }
}

/// An event-driven run at tight tolerances, seen by `observer`.
pub fn observed<O: Observer<Error: std::fmt::Debug>>(
    system: &System,
    initial: &State,
    until: f64,
    integrator: Integrator,
    observer: &mut O,
) -> Report {
    let options = Options { until, samples: 1, switch_limit: 40.0 };
    let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-12, atol: 1e-15 });
    event::run(system, initial, &options, flow.as_mut(), observer).unwrap()
}

/// The same run, seen by no one.
pub fn event_driven(
    system: &System,
    initial: &State,
    until: f64,
    integrator: Integrator,
) -> Report {
    observed(system, initial, until, integrator, &mut Silent)
}

/// A bar of `n` elements with the method `contact`, from the far point of its nonsmooth mode of period 3.36.
pub fn bar_with(contact: &str, n: usize) -> Problem {
    problem(&format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{contact}\
         [initial]\ndisplacement = [\"-x/0.36\"]\n"
    ))
}

/// The half plate of the reference file with the method `contact`, which keeps the displacements of contact nodes: all of the file's state.
pub fn half_plate_with(contact: &str) -> Problem {
    let reference = reference_problem("half-plate-10x3");
    let text = reference.text.replace("[contact]\n", &format!("[contact]\n{contact}"));
    let text = text.replace("boundary_mass = \"consistent\"\n", "");
    let system = problem(&text).system;
    let paper = &reference.problem.system;
    let (u, v) = reference.problem.initial.full(paper).unwrap();
    let moved =
        |x: &[f64]| system.body.dofs.gather(&paper.body.dofs.scatter(x))[..system.n_o()].to_vec();
    let initial = State { u: moved(&u), v: moved(&v) };
    Problem { system, initial, notes: Default::default() }
}

/// How far the derivative of a closure's residual is from central differences, in four directions, over its size.
pub fn derivative_error(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    period: f64,
    h: f64,
) -> f64 {
    let (_, j) = linearised(body, closure, z, period).unwrap();
    let mut worst = 0.0f64;
    for k in 0..4 {
        let d = random(z.len(), 77 + k);
        let mut at = |s: f64| {
            let y: Vec<f64> = z.iter().zip(&d).map(|(z, d)| z + s * d).collect();
            linearised(body, closure, &y, period).unwrap().0
        };
        let (up, down) = (at(h), at(-h));
        let exact = &j * Mat::from_fn(d.len(), 1, |i, _| d[i]);
        let scale = (0..up.len()).map(|i| exact[(i, 0)].abs()).fold(0.0, f64::max);
        for i in 0..up.len() {
            worst = worst.max(((up[i] - down[i]) / (2.0 * h) - exact[(i, 0)]).abs() / scale);
        }
    }
    worst
}
