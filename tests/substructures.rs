//! Bodies that meet, given by matrices: the same motions as those of their meshes, and what is refused.

use std::collections::BTreeMap;

use crate::common::{problem, program, run_by, scene};

use signorini::fem::{Body, Csr, load};
use signorini::scenario::{Attached, Integrator, Matrix, Scene};

const PULL: [f64; 2] = [0.06, -0.02];

/// A plate: its size, its elements, the edge that is held.
struct Plate {
    size: [f64; 2],
    elements: [usize; 2],
    held: &'static str,
}

const A: Plate = Plate { size: [1.0, 0.4], elements: [4, 2], held: "left" };
const B: Plate = Plate { size: [0.8, 0.5], elements: [3, 3], held: "right" };

impl Plate {
    fn text(&self, head: &str, name: &str, more: &str) -> String {
        let Plate { size, elements, held } = self;
        format!(
            "{head}\nkind = 'plate'\nsize = {size:?}\nelements = {elements:?}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{more}\n[[support]]\nedge = '{name}{held}'\nfix = ['x', 'y']\n"
        )
    }

    /// Alone, without contact.
    fn alone(&self) -> Body {
        let text = self.text("[body]", "", "") + "[run]\nuntil = 1.0\n";
        (*problem(&text).system.body).clone()
    }
}

/// Both as meshes.
fn of_meshes(contact: &str, rest: &str) -> Scene {
    scene(
        &(A.text("[[body]]", "a:", "name = 'a'")
            + &B.text("[[body]]", "b:", "name = 'b'\nmove = [1.02, -0.03]")
            + &format!(
                "[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\n{contact}\n[[load]]\nkind = 'traction'\nedge = 'a:top'\namplitude = {PULL:?}\nomega = 1.3\n{rest}"
            )),
    )
}

/// Both as blocks of matrices; `P` is that of the meshes.
fn of_matrices(meshes: &Scene, contact: &str, rest: &str) -> Scene {
    let (a, b) = (A.alone(), B.alone());
    let (n, of_a) = (a.dofs.n() + b.dofs.n(), a.dofs.n());
    let block = |of: fn(&Body) -> &Csr| Matrix {
        shape: (n, n),
        entries: of(&a)
            .triplets()
            .chain(of(&b).triplets().map(|(i, j, v)| (of_a + i, of_a + j, v)))
            .collect(),
    };
    let row = |body: &Body, node: usize, c: usize| {
        let terms: Vec<(usize, f64)> = body.dofs.terms(node, c).collect();
        assert!(terms.len() == 1 && terms[0].1 == 1.0, "{terms:?}");
        terms[0].0
    };
    let pair = signorini::problem::Problem::new(meshes, None).unwrap().system;
    let nodes = a.mesh.n_nodes();
    let (mut own, mut along) = ([vec![], vec![]], [vec![], vec![]]);
    for (i, point) in pair.body.dofs.contact[..pair.body.dofs.n_facing].iter().enumerate() {
        for c in 0..2 {
            own[c].push(row(&a, point.node, c));
            let masters = pair.body.dofs.against(i).iter();
            let of = |&(j, p): &(usize, f64)| format!("[{}, {p:?}]", of_a + row(&b, j - nodes, c));
            along[c].push(format!("[{}]", masters.map(of).collect::<Vec<_>>().join(", ")));
        }
    }
    let mut force = load::traction(&a, "top", &PULL);
    force.resize(n, 0.0);
    let tangents = match contact.contains("friction") {
        true => format!("tangents = {:?}\ntangents_against = [{}]\n", own[1], along[1].join(", ")),
        false => String::new(),
    };
    let text = format!(
        "[body]\nkind = 'matrices'\nmass_matrix = 'M'\nstiffness_matrix = 'K'\n[contact]\ndisplacements = {:?}\nagainst = [{}]\ngap = 0.02\n{tangents}{contact}\n[[load]]\nkind = 'force'\namplitude = {force:?}\nomega = 1.3\n{rest}",
        own[0],
        along[0].join(", ")
    );
    let mut scene = scene(&text);
    let files = [("M", block(|b| &b.mass)), ("K", block(|b| &b.stiffness))];
    scene.attached = Attached::new(
        files.into_iter().map(|(name, m)| (name.to_owned(), m)).collect::<BTreeMap<_, _>>(),
    );
    scene
}

/// Meshes that do not match, both sides without inertia or one, with friction and without: blocks of matrices with the same `P` move as the meshes do.
#[test]
fn blocks_of_matrices_meet_as_their_meshes_do() {
    let rest = "[damping]\nrayleigh = [0.02, 0.01]\n[run]\nuntil = 12.0\nsamples = 1\n";
    for contact in ["", "sides = 'slave'", "friction = 0.3", "method = 'mass-redistribution'"] {
        let meshes = of_meshes(&format!("gap = 0.02\n{contact}"), rest);
        let matrices = of_matrices(&meshes, contact, rest);
        let [one, two] = [&meshes, &matrices].map(|scene| run_by(scene, Integrator::Modal));
        assert!(one.switches.len() > 6, "{contact}: {}", one.switches.len());
        assert_eq!(one.switches.len(), two.switches.len(), "{contact}");
        for (a, b) in one.switches.iter().zip(&two.switches) {
            assert!((a.t - b.t).abs() < 1e-9 && a.kind == b.kind, "{contact}: {} {}", a.t, b.t);
        }
        assert!((two.energy_end / one.energy_end - 1.0).abs() < 1e-9, "{contact}");
    }
}

/// What a file holds are displacements of rows; the relative ones follow.
#[test]
fn files_hold_the_rows_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    // two masses on springs, tips without mass: rows 0, 1 and 2, 3
    let matrix =
        |entries: &[(usize, usize, f64)]| Matrix { shape: (4, 4), entries: entries.to_vec() };
    let k = matrix(&[
        (0, 0, 4.0),
        (0, 1, -3.0),
        (1, 0, -3.0),
        (1, 1, 3.0),
        (3, 3, 7.0),
        (3, 2, -6.0),
        (2, 3, -6.0),
        (2, 2, 6.0),
    ]);
    let m = matrix(&[(0, 0, 1.0), (3, 3, 2.0)]);
    for (name, matrix) in [("m.mtx", m), ("k.mtx", k)] {
        std::fs::write(at(name), matrix.to_matrix_market()).unwrap();
    }
    let text = "[body]\nkind = 'matrices'\nmass_matrix = 'm.mtx'\nstiffness_matrix = 'k.mtx'\n[contact]\ndisplacements = [1]\nagainst = [2]\ngap = 0.1\n\
        [[load]]\nkind = 'force'\ndisplacement = 0\namplitude = 0.5\nomega = 0.9\n[run]\nuntil = 20.0\nsamples = 400\n";
    std::fs::write(at("two.toml"), text).unwrap();
    let run = |words: &[&str]| {
        let done = program().args(words).current_dir(folder.path()).output().unwrap();
        assert!(done.status.success(), "{words:?}: {}", String::from_utf8_lossy(&done.stderr));
    };
    run(&["run", "two.toml", "-q", "-o", "two.h5"]);
    let file = crate::common::hdf5_files().open(at("two.h5")).unwrap();
    let table =
        |name: &str| -> ndarray::Array2<f64> { file.dataset(name).unwrap().read_2d().unwrap() };
    let dof: ndarray::Array2<i64> = file.dataset("mesh/dof_map").unwrap().read_2d().unwrap();
    let (u, p, t) = (
        table("trajectory/u"),
        table("trajectory/pressure"),
        file.dataset("trajectory/t").unwrap().read_raw::<f64>().unwrap(),
    );
    let mut touched = 0;
    for row in 0..t.len() {
        let x = |i: usize| u[(row, dof[(i, 0)] as usize)];
        let force = p[(row, 0)];
        // the tips are in equilibrium under the force between them, which pushes them apart
        assert!((3.0 * (x(1) - x(0)) + force).abs() < 1e-12, "{}", t[row]);
        assert!((6.0 * (x(2) - x(3)) - force).abs() < 1e-12, "{}", t[row]);
        assert!(x(1) - x(2) < 0.1 + 1e-12 && force > -1e-12);
        touched += usize::from(force > 1e-6);
    }
    assert!(touched > 20, "{touched}");
    for words in [
        &["plot", "two.h5", "-q", "-o", "pictures"][..],
        &["export", "two.h5", "-q", "-o", "table"],
        &["export", "two.h5", "-q", "--force", "-o", "table", "--nodes", "0,3"],
        &["modes", "two.toml", "-q"],
        &["orbit", "two.toml", "--omega", "0.9", "-q", "-o", "orbit.h5"],
        &["run", "two.toml", "-q", "--force", "-o", "two.h5"],
    ] {
        run(words);
    }
    // neither the ground nor a place is a row
    for (words, said) in [
        (["--nodes", "4"], "the nodes count from 0 to 3"),
        (["--place", "0.5"], "a body from matrices"),
    ] {
        let all = [&["export", "two.h5", "-o", "table"][..], &words].concat();
        let done = program().args(&all).current_dir(folder.path()).output().unwrap();
        let told = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(2) && told.contains(said), "{told}");
    }
    // what cannot be
    for (old, new, said) in [
        ("against = [2]", "against = [2, 3]", "2 entries for 1 contact displacements"),
        (
            "against = [2]",
            "against = [1]",
            "1 is no row of the matrices, or is a contact displacement",
        ),
        ("against = [2]", "against = [9]", "9 is no row of the matrices"),
        ("against = [2]", "against = [-2]", "-2 is no row: they count from 0"),
        ("against = [2]", "against = [[]]", "entry 0 is empty"),
        ("against = [2]", "against = [[[2, 0.5, 1]]]", "list of two values"),
        ("gap = 0.1", "gap = 0.1\ngap_behind = 1.0", "is that of a rigid obstacle"),
        ("gap = 0.1", "gap = 0.1\nmethod = 'penalty'\nstiffness = 1.0", "knows rigid obstacles"),
        ("gap = 0.1", "gap = 0.1\nn_c = 'a.mtx'\nn_o = 'b.mtx'", "is not read"),
        (
            "gap = 0.1",
            "gap = 0.1\nfriction = 0.1\ntangents = [0]",
            "contact.tangents_against: is missing",
        ),
        (
            "gap = 0.1",
            "gap = 0.1\nfriction = 0.1\ntangents = [0]\ntangents_against = [2]",
            "2 is no row of the matrices, or is a contact displacement",
        ),
        (
            "gap = 0.1",
            "gap = 0.1\nfriction = 0.1\ntangents = [2]\ntangents_against = [3]",
            "beside the contact displacements",
        ),
        (
            "gap = 0.1",
            "gap = 0.1\nfriction = 0.1\ntangents = [0]\ntangents_against = [[[3, 0.5], [1, 0.5]]]",
            "1 is no row of the matrices, or is a contact displacement",
        ),
    ] {
        std::fs::write(at("bad.toml"), text.replace(old, new)).unwrap();
        let done = program().args(["run", "bad.toml"]).current_dir(folder.path()).output().unwrap();
        let words = String::from_utf8_lossy(&done.stderr);
        let plain: Vec<&str> = words.split_whitespace().filter(|w| *w != "│").collect();
        assert_eq!(done.status.code(), Some(2), "{new}: {words}");
        assert!(plain.join(" ").contains(said), "{new}: {words}");
    }
}
