//! Surfaces that slide along bodies in space: the plane slab, how a body lies, what comes to rest, refusals.

use crate::common::cuboid::cuboid;
use crate::common::rectangle::msh;
use crate::common::{problem, run, run_by};
use signorini::event::{Outcome, Report};
use signorini::mesh::{ElementKind, Mesh, Point};
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};

const SIZE: Point = [0.5, 1.0, 0.125];
const DEPTH: f64 = SIZE[2];

fn slab() -> Mesh {
    cuboid(ElementKind::Hex8, SIZE, [4, 8, 1], 0.0)
}

fn vector(v: Point) -> String {
    let words: Vec<String> = v.iter().map(|x| format!("\"{x:?}\"")).collect();
    format!("[{}]", words.join(", "))
}

/// A slab thrown against a wall that slides; without Poisson's ratio nothing moves along its depth.
fn thrown(contact: &str, velocity: Point, more: &str) -> String {
    format!(
        "[body]\nkind = 'mesh'\nfile = 'body.msh'\n[[material]]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0\n\
         [contact]\ngroup = 'xmax'\ngap = 0.02\n{contact}\n[initial]\nvelocity = {}\n[run]\nuntil = 2.6\n{more}",
        vector(velocity)
    )
}

fn written(mesh: &Mesh, text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("body.msh"), msh(mesh, |_| 0)).unwrap();
    let file = place.path().join("scene.toml");
    std::fs::write(&file, text).unwrap();
    (place, file)
}

fn moved(mesh: &Mesh, text: &str, integrator: Integrator) -> Report {
    let (_place, file) = written(mesh, text);
    run_by(&Scene::read(&file).unwrap(), integrator)
}

fn books(r: &Report) -> [f64; 4] {
    let rubbed = r.rubbed.as_ref().unwrap();
    [r.energy_start, r.energy_end, rubbed.work(), rubbed.belt]
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

/// One element deep it moves as the plate does, by both flows.
#[test]
fn a_slab_in_space_slides_as_the_plate_does() {
    let plate = "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [4, 8]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0\n\
         [contact]\nedge = 'right'\ngap = 0.02\nfriction = 0.3\nsurface = [0.0, 1.0]\n[initial]\nvelocity = ['0.2', '0.1']\n[run]\nuntil = 2.6\n";
    let flat = Scene::parse(plate, std::path::Path::new("plate.toml")).unwrap();
    let text = thrown("friction = 0.3\nsurface = [0.0, 1.0, 0.0]", [0.2, 0.1, 0.0], "");
    for integrator in [Integrator::Modal, Integrator::Dop853] {
        let (a, b) = (run_by(&flat, integrator), moved(&slab(), &text, integrator));
        println!("{}: {} and {} switches", integrator.name(), a.switches.len(), b.switches.len());
        assert!(a.switches.len() > 10 && b.switches.len() == 2 * a.switches.len());
        for (flat, deep) in books(&a).into_iter().zip(books(&b)) {
            assert!(near(deep, DEPTH * flat, 1e-9), "{deep} {flat}");
        }
        for (k, switch) in a.switches.iter().enumerate() {
            let both = [b.switches[2 * k].t, b.switches[2 * k + 1].t];
            assert!(both.iter().all(|t| (t - switch.t).abs() < 1e-8), "{both:?} {}", switch.t);
        }
    }
}

/// Turned about the normal with the surface's velocity, and about any axis.
#[test]
fn how_a_sliding_body_lies_does_not_matter() {
    let velocities: [Point; 2] = [[0.0, 1.0, 0.0], [0.2, 0.1, 0.05]];
    let motion = |turn: &dyn Fn(Point) -> Point| {
        let [surface, start] = velocities.map(turn);
        let text = thrown(&format!("friction = 0.3\nsurface = {surface:?}"), start, "");
        moved(&slab().moved(turn), &text, Integrator::Dop853)
    };
    let straight = motion(&|p| p);
    for (a, b, c) in [(0.9273, 0.0, 0.0), (0.4, -0.7, 1.1)] {
        let turn = nalgebra::Rotation3::from_euler_angles(a, b, c);
        let turned = motion(&|[x, y, z]: Point| {
            let p = turn * nalgebra::Vector3::new(x, y, z);
            [p.x, p.y, p.z]
        });
        assert_eq!(turned.switches.len(), straight.switches.len());
        for (x, y) in books(&turned).into_iter().zip(books(&straight)) {
            assert!(near(x, y, 1e-9), "{x} {y}");
        }
    }
}

/// A surface that is not faster than the body ends the run: what is there is told, and kept.
#[test]
fn what_comes_to_rest_in_space_ends_the_run() {
    let text = thrown("friction = 0.3\nsurface = [0.0, 0.15, 0.0]", [0.2, 0.1, 0.0], "");
    let (place, file) = written(&slab(), &text);
    let out = place.path().join("out.h5");
    let output = run(&["run", file.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("come to rest on the surface") && out.exists(), "{said}");
    let report = {
        let scene = Scene::read(&file).unwrap();
        let problem = Problem::new(&scene, None).unwrap();
        let silent = &mut signorini::event::Silent;
        signorini::simulate::simulate(&scene, &problem, false, silent).unwrap()
    };
    let Outcome::Rests { t, nodes } = report.outcome else { panic!("{}", report.outcome) };
    assert!(t > 0.1 && t < 0.3 && nodes.len() == 1, "{t} {nodes:?}");
}

#[test]
fn what_sliding_in_space_does_not_go_with_is_said() {
    let start = [0.2, 0.1, 0.0];
    for (text, words) in [
        (thrown("friction = 0.3", start, ""), "in space a point that sticks may slip"),
        (thrown("friction = 0.3\nsurface = [0.0, 0.0, 0.0]", start, ""), "in space a point"),
        (thrown("friction = 0.3\nsurface = [0.0, 0.5]", start, ""), "another length"),
        (thrown("friction = 0.3\nsurface = [0.1, 0.5, 0.0]", start, ""), "along its normal"),
        (
            thrown("friction = 0.3\nsurface = [0.0, 0.5, 0.0]", start, "")
                .replace("[initial]\nvelocity = [\"0.2\", \"0.1\", \"0.0\"]\n", "")
                + "quasistatic = true\n",
            "a run without inertia decides what sticks",
        ),
    ] {
        let (_place, file) = written(&slab(), &text);
        let found = Scene::read(&file).map_err(|e| e.to_string());
        let error = match found {
            Ok(scene) => Problem::new(&scene, None).map(|_| ()).unwrap_err().to_string(),
            Err(e) => e,
        };
        assert!(error.contains(words), "{words}: {error}");
    }
    let load =
        "[[load]]\nkind = 'traction'\ngroup = 'xmin'\namplitude = [0.01, 0.0, 0.0]\nomega = 1.0\n";
    let text = thrown("friction = 0.3\nsurface = [0.0, 0.5, 0.0]", start, load);
    let (place, file) = written(&slab(), &text);
    let out = place.path().join("out.h5");
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let output = run(&["response", file, "-o", out, "--method", "hbm", "--range", "0.9,1.1"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("slides along a body in space"), "{said}");
    // the plane knows no such thing
    let plane = problem(
        "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 2]\nyoung = 1.0\npoisson = 0.0\ndensity = 1.0\n\
         [contact]\nedge = 'right'\ngap = 0.02\nfriction = 0.3\n[initial]\nvelocity = ['0.2', '0.1']\n[run]\nuntil = 2.6\n",
    );
    assert!(plane.system.tangents().unwrap().iter().flatten().all(|t| !t.only_slips));
}
