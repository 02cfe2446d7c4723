//! Bodies from meshes, through scenes: what does not depend on how a body lies, is meshed, or is halved; obstacles on any group; what is refused.

use std::path::{Path, PathBuf};

use crate::common::rectangle::{msh, rectangle};
use crate::common::{json, root, run, shipped};
use signorini::event::{Report, Silent};
use signorini::mesh::{ElementKind, Mesh, structured};
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::Stored;

/// A folder with a mesh in it.
fn folder(mesh: &Mesh) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("body.msh"), msh(mesh, |_| 0)).unwrap();
    place
}

/// A scene of the mesh in a folder: its state, and everything behind the material.
fn text(state: &str, rest: &str) -> String {
    format!(
        "[body]\nkind = \"mesh\"\nfile = \"body.msh\"\nstate = \"{state}\"\n[[material]]\ngroup = \"body\"\nyoung = 1.0\npoisson = 0.3\n\
         density = 1.0\n{rest}"
    )
}

fn scene(place: &Path, text: &str) -> Scene {
    Scene::parse(text, &place.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
}

fn problem(scene: &Scene) -> Problem {
    Problem::new(scene, None).unwrap_or_else(|e| panic!("{e}"))
}

fn solved(scene: &Scene) -> (Problem, Report) {
    let problem = problem(scene);
    let report = simulate(scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete() && report.is_certified(), "{}", report.outcome);
    (problem, report)
}

/// Times of the switches must agree (those after `t = 1` in proportion), and energies with a factor.
fn same_motion(a: &Report, b: &Report, factor: f64, most: f64) {
    assert_eq!(a.switches.len(), b.switches.len());
    assert!(a.switches.len() > 5);
    for (a, b) in a.switches.iter().zip(&b.switches) {
        assert!((a.t - b.t).abs() < most * a.t.max(1.0), "{} {}", a.t, b.t);
    }
    let off = (factor * a.energy_end / b.energy_end - 1.0).abs();
    assert!(off < most, "energies differ by {off:e}");
}

fn turned(angle: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    let (sin, cos) = angle.to_radians().sin_cos();
    move |[x, y, _]| [cos * x - sin * y, sin * x + cos * y, 0.0]
}

const CLAMP: &str = "[[support]]\ngroup = \"left\"\nfix = [\"x\", \"y\"]\n";
const MOTION: &str = "[initial]\nmode = 2\namplitude = -1.6\n[run]\nuntil = 9.0\n";
const PAPER: &str =
    "[contact]\ngroup = \"right\"\ngap = 0.3\nstress = \"projection\"\ninertia = \"paper\"\n";

/// `kind = "plate"` with the numbers of the meshes here.
fn plate(nx: usize, ny: usize) -> Scene {
    let text = format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = 0.3\n{MOTION}"
    );
    crate::common::scene(&text)
}

#[test]
fn a_plate_that_gmsh_meshed_is_the_plate() {
    let (_, plate) = solved(&plate(12, 6));
    let meshes = root().join("tests/reference/meshes");
    let text = text("plane stress", &format!("{CLAMP}{PAPER}{MOTION}"));
    let scene = scene(&meshes, &text.replace("body.msh", "q4_rectangles.msh"));
    same_motion(&plate, &solved(&scene).1, 1.0, 1e-12);
}

#[test]
fn a_turned_plate_switches_as_the_straight_one() {
    let (straight, plate) = solved(&plate(8, 4));
    let mesh = structured::rectangle(1.0, 0.5, 8, 4).moved(turned(30.0));
    let place = folder(&mesh);
    let oblique = scene(place.path(), &text("plane stress", &format!("{CLAMP}{PAPER}{MOTION}")));
    let (problem, report) = solved(&oblique);
    same_motion(&plate, &report, 1.0, 1e-10);
    // N_C is the same matrix, and the displacements are turned
    let (a, b) = (straight.system.conditions(), problem.system.conditions());
    let (a, b) = (a.n_c.dense(), b.n_c.dense());
    assert!((&a - b).norm() < 1e-13 * a.norm());
    let nodal =
        |p: &Problem, r: &Report| p.system.body.dofs.scatter(&r.last.full(&p.system).unwrap().0);
    let (a, b) = (nodal(&straight, &plate), nodal(&problem, &report));
    for (a, b) in a.chunks(2).zip(b.chunks(2)) {
        let [x, y, _] = turned(30.0)([a[0], a[1], 0.0]);
        assert!((x - b[0]).abs() < 1e-10 && (y - b[1]).abs() < 1e-10);
    }
    // and so are they in the file, along the axes
    std::fs::write(place.path().join("scene.toml"), &oblique.source.text).unwrap();
    let (toml, out) = (place.path().join("scene.toml"), place.path().join("run.h5"));
    let output = run(&["run", toml.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stored = Stored::read(&out).unwrap();
    for (n, b) in b.chunks(2).enumerate() {
        let u = stored.displacement(stored.t.len() - 1, n);
        assert!((u[0] - b[0]).abs() < 1e-12 && (u[1] - b[1]).abs() < 1e-12);
    }
    assert!((stored.contact_normals[(0, 0)] - 30f64.to_radians().cos()).abs() < 1e-15);
    // a run goes on from a file of another one
    let text = oblique.source.text.replace("mode = 2\namplitude = -1.6", "file = \"run.h5\"");
    std::fs::write(&toml, text).unwrap();
    let again = place.path().join("again.h5");
    let going_on = json(&["run", toml.to_str().unwrap(), "-o", again.to_str().unwrap()]);
    let energy = going_on["energy_start"].as_f64().unwrap();
    assert!((energy / report.energy_end - 1.0).abs() < 1e-9, "{energy}");
}

/// The half of a plate above an oblique plane of symmetry moves as the whole, whatever the stress and the mass.
#[test]
fn a_half_on_an_oblique_plane_of_symmetry_equals_the_whole() {
    for kind in [ElementKind::Quad4, ElementKind::Tri6, ElementKind::Quad9] {
        // the whole is the half and its mirror image
        let (nx, ny) = if kind == ElementKind::Quad4 { (8, 3) } else { (4, 2) };
        let half = rectangle(kind, [0.0, 1.0], 0.3, (nx, ny), 0.0);
        let whole = mirrored(&half);
        let choices: &[&str] = match kind {
            ElementKind::Tri6 => &["", "stress = \"reaction\"\n", "inertia = \"paper\"\n"],
            _ => &["stress = \"projection\"\ninertia = \"paper\"\n", "", "stress = \"reaction\"\n"],
        };
        for choice in choices {
            let of = |mesh: Mesh, more: &str| {
                let place = folder(&mesh.moved(turned(-40.0)));
                let rest = format!(
                    "{CLAMP}{more}[contact]\ngroup = \"right\"\ngap = 0.3\n{choice}[initial]\nvelocity = [\"0.4*(x*0.766044443118978 - y*0.6427876096865393)*0.766044443118978\", \
                     \"-0.4*(x*0.766044443118978 - y*0.6427876096865393)*0.6427876096865393\"]\n[run]\nuntil = 6.0\n"
                );
                let scene = scene(place.path(), &text("plane strain", &rest));
                solved(&scene)
            };
            let symmetry = "[[support]]\ngroup = \"bottom\"\nfix = [\"normal\"]\n";
            let (_, of_half) = of(half.clone(), symmetry);
            let (_, of_whole) = of(whole.clone(), "");
            // the whole has most switches twice: a node and its image
            let mut times: Vec<f64> = of_whole.switches.iter().map(|s| s.t).collect();
            times.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            let mut own: Vec<f64> = of_half.switches.iter().map(|s| s.t).collect();
            own.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            assert_eq!(times.len(), own.len(), "{kind:?} {choice}");
            for (a, b) in times.iter().zip(&own) {
                assert!((a - b).abs() < 1e-9, "{kind:?} {choice}: {a} {b}");
            }
            let off = 2.0 * of_half.energy_end / of_whole.energy_end - 1.0;
            assert!(off.abs() < 1e-9, "{kind:?} {choice}: {off}");
        }
    }
}

/// A mesh above `y = 0` with its mirror image.
fn mirrored(half: &Mesh) -> Mesh {
    use signorini::mesh::{Block, Facet};
    let n = half.n_nodes();
    let mut nodes = half.nodes().to_vec();
    let mut image = vec![0; n];
    for (k, &[x, y, _]) in half.nodes().iter().enumerate() {
        image[k] = if y == 0.0 { k } else { nodes.len() };
        if y != 0.0 {
            nodes.push([x, -y, 0.0]);
        }
    }
    let block = &half.blocks()[0];
    let mut connectivity = block.connectivity.clone();
    let count = half.n_elements();
    let corners = block.kind.corners();
    for cell in block.connectivity.chunks(block.kind.nodes()) {
        // the other way round: corners from the last to the first, the middles between them
        let reversed = |k: usize| match k {
            k if k < corners => corners - 1 - k,
            k if k < 2 * corners => corners + (2 * corners - 2 - k + corners) % corners,
            k => k,
        };
        connectivity.extend((0..cell.len()).map(|k| image[cell[reversed(k)]]));
    }
    // sides of the images are found by their nodes
    let facets = |name: &str| -> Vec<Facet> {
        let own = half.group(name);
        let of_image = own.iter().map(|f| {
            let element = half.element(*f);
            let mut wanted: Vec<usize> =
                element.kind.side(f.side).iter().map(|&l| image[element.nodes[l]]).collect();
            wanted.sort_unstable();
            let width = block.kind.nodes();
            let cell = count + f.element;
            let nodes = &connectivity[width * cell..width * (cell + 1)];
            let side = (0..block.kind.sides()).find(|&s| {
                let mut own: Vec<usize> = block.kind.side(s).iter().map(|&l| nodes[l]).collect();
                own.sort_unstable();
                own == wanted
            });
            Facet { block: 0, element: cell, side: side.unwrap() }
        });
        own.iter().copied().chain(of_image).collect()
    };
    let groups = [("left".to_owned(), facets("left")), ("right".to_owned(), facets("right"))];
    let block = Block { connectivity: connectivity.clone(), ..block.clone() };
    Mesh::new(2, nodes, vec![block], groups.into_iter().collect())
}

/// A square before two walls, thrown along its diagonal: its corner has two contact directions, and the motion stays symmetric about the diagonal.
#[test]
fn a_corner_meets_two_obstacles() {
    for (kind, choice) in [
        (ElementKind::Quad4, "stress = \"projection\"\n"),
        (ElementKind::Quad4, ""),
        (ElementKind::Quad9, ""),
        (ElementKind::Tri3, "stress = \"reaction\"\n"),
    ] {
        let n = 4;
        let mesh = rectangle(kind, [0.0, 1.0], 1.0, (n, n), 0.0);
        let place = folder(&mesh.moved(turned(20.0)));
        let along = turned(20.0)([0.1, 0.1, 0.0]);
        let rest = format!(
            "[[contact]]\ngroup = \"right\"\ngap = 0.05\n{choice}[[contact]]\ngroup = \"top\"\ngap = 0.05\n\
             [initial]\nvelocity = [\"{}\", \"{}\"]\n[run]\nuntil = 4.0\n",
            along[0], along[1]
        );
        let scene = scene(place.path(), &text("plane stress", &rest));
        let (problem, report) = solved(&scene);
        let system = &problem.system;
        let corner = mesh.nearest_node([1.0, 1.0, 0.0]);
        assert_eq!(system.constraints.iter().filter(|c| c.node == corner).count(), 2);
        let drift = (report.energy_end / report.energy_start - 1.0).abs();
        assert!(report.switches.len() > 4 && drift < 1e-11, "{kind:?}: {drift}");
        let nodal = system.body.dofs.scatter(&report.last.full(system).unwrap().0);
        let back = turned(-20.0);
        let at = |p: [f64; 3]| {
            let k = mesh.nearest_node(p);
            back([nodal[2 * k], nodal[2 * k + 1], 0.0])
        };
        for &[x, y, _] in mesh.nodes() {
            let (a, b) = (at([x, y, 0.0]), at([y, x, 0.0]));
            assert!((a[0] - b[1]).abs() < 1e-9 && (a[1] - b[0]).abs() < 1e-9, "{kind:?}");
        }
    }
}

/// A beam between two stops: what it does above, it does below if it starts the other way.
#[test]
fn stops_on_both_sides_are_mirror_images() {
    let scene = shipped("beam.toml");
    let of = |speed: f64| {
        let text = scene.source.text.split("[damping]").next().unwrap().to_owned();
        let rest =
            format!("[initial]\nvelocity = [\"0\", \"{speed}*x^2\"]\n[run]\nuntil = 120.0\n");
        let scene = Scene::parse(&(text + &rest), &scene.source.file).unwrap();
        solved(&scene)
    };
    let ((p, up), (_, down)) = (of(2e-3), of(-2e-3));
    let group = |k: usize| p.system.constraints[k].group;
    assert!(up.switches.iter().any(|s| group(s.point) == 0));
    assert!(up.switches.iter().any(|s| group(s.point) == 1));
    same_motion(&up, &down, 1.0, 1e-6);
    for (a, b) in up.switches.iter().zip(&down.switches) {
        assert!(group(a.point) + group(b.point) == 1);
    }
}

/// Constant inertia keeps the energy, on every element, in every state, by every way to the pressure.
#[test]
fn energy_is_kept_on_every_element() {
    let mut worst = 0.0f64;
    for kind in ElementKind::ALL.into_iter().filter(|k| k.dim() == 2) {
        let (nx, ny) = if kind.nodes() > 4 { (4, 2) } else { (6, 3) };
        let mesh = rectangle(kind, [0.0, 1.0], 0.5, (nx, ny), 0.12);
        let place = folder(&mesh);
        for (state, support, choice) in [
            ("plane stress", "", ""),
            ("plane strain", "", "stress = \"reaction\"\n"),
            ("axisymmetric", "", "method = \"mass-redistribution\"\n"),
        ] {
            let rest = format!(
                "{CLAMP}{support}[contact]\ngroup = \"right\"\ngap = 0.3\n{choice}\
                 [initial]\ndisplacement = [\"-x*(1 + 0.1*y)\", \"0.03*x*y\"]\n[run]\nuntil = 200.0\n"
            );
            let (_, report) = solved(&scene(place.path(), &text(state, &rest)));
            let drift = (report.energy_end / report.energy_start - 1.0).abs();
            assert!(report.switches.len() > 100, "{kind:?} {state}: {}", report.switches.len());
            assert!(drift < 1e-10, "{kind:?} {state}: {drift:e}");
            worst = worst.max(drift);
        }
    }
    println!("energies drift by {worst:.1e} at the most over 50 periods");
}

/// The same over fifty periods of the first mode, or fifty bounces, of every shipped scene on a mesh, without damping and driving loads.
#[test]
fn energy_is_kept_on_every_scene() {
    for (name, rest) in [
        ("beam", "[initial]\nvelocity = [\"0\", \"2e-3*x^2\"]\n[run]\nuntil = 6000.0\n"),
        ("bracket", "[initial]\nmode = 1\namplitude = -1.5\n[run]\nuntil = 0.038\n"),
        (
            "half-disc",
            "[[load]]\nkind = \"gravity\"\namplitude = [0.0, -0.05]\n[initial]\nvelocity = [\"0\", \"-0.1\"]\n[run]\nuntil = 300.0\n",
        ),
        ("valve", "[initial]\nvelocity = [\"0\", \"-0.05*(1.5 - y)\"]\n[run]\nuntil = 600.0\n"),
    ] {
        let shipped = shipped(&format!("{name}.toml"));
        let text = &shipped.source.text;
        let end = ["[damping]", "[initial]"].iter().filter_map(|t| text.find(t)).min().unwrap();
        for method in ["", "stress = \"reaction\"\n"] {
            // in the last table, [contact]
            let text = format!("{}{method}{rest}", &text[..end]);
            let scene = Scene::parse(&text, &shipped.source.file).unwrap();
            let problem = problem(&scene);
            let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
            assert!(report.outcome.is_complete(), "{name}: {}", report.outcome);
            let scale = report.energy_start.abs().max(report.energy_end.abs());
            let gained = report.energy_end - report.energy_start - report.energy_external;
            let drift = gained.abs() / scale;
            println!("{name}: {} switches, energy {drift:.1e}", report.switches.len());
            assert!(report.switches.len() > 60 && drift < 1e-10, "{name} {method}: {drift:e}");
        }
    }
}

/// The words of a scene that is refused.
fn refusal(place: &Path, text: &str) -> String {
    let refused = Scene::parse(text, &place.join("scene.toml")).map_err(|e| format!("{e} {e:?}"));
    match refused {
        Err(words) => words,
        Ok(scene) => match Problem::new(&scene, None) {
            Err(e) => format!("{e} {e:?}"),
            Ok(_) => panic!("not refused: {text}"),
        },
    }
}

#[test]
fn what_a_mesh_cannot_do_is_said() {
    let mesh = rectangle(ElementKind::Quad4, [0.0, 1.0], 0.5, (4, 2), 0.0);
    let place = folder(&mesh);
    let contact = "[contact]\ngroup = \"right\"\ngap = 0.3\n";
    let good = text("plane stress", &format!("{CLAMP}{contact}"));
    problem(&scene(place.path(), &good));
    for (from, to, words) in [
        ("file = \"body.msh\"\n", "", "body.file: is missing"),
        ("body.msh", "none.msh", "No such file"),
        ("body.msh", "scene.toml", "body.file"),
        ("state = \"plane stress\"\n", "", "body.state: is missing"),
        ("plane stress", "plane", "plane strain"),
        ("kind = \"mesh\"\n", "kind = \"mesh\"\nyoung = 1.0\n", "belongs to a bar or a plate"),
        ("kind = \"mesh\"\n", "kind = \"mesh\"\nscale = -1.0\n", "body.scale"),
        ("group = \"body\"\n", "group = \"steel\"\n", "no group of cells \\\"steel\\\""),
        ("poisson = 0.3\n", "poisson = 1.0\n", "material[0].poisson"),
        ("density = 1.0\n", "", "density"),
        ("group = \"left\"\n", "edge = \"left\"\n", "a mesh has groups"),
        ("group = \"left\"\n", "group = \"lefd\"\n", "(#1, 2 sides)"),
        ("group = \"left\"\n", "group = \"body\"\n", "is a group of cells"),
        ("group = \"left\"\n", "", "support[0].group: is missing"),
        ("group = \"right\"\n", "group = \"#7\"\n", "no group of sides"),
        ("gap = 0.3\n", "", "contact.gap: is missing"),
        ("gap = 0.3\n", "gap = 0.3\nplane = { normal = [1.0, 0.0], offset = 1.3 }\n", "beside gap"),
        ("gap = 0.3\n", "plane = { normal = [1.0], offset = 1.3 }\n", "contact.plane.normal"),
        ("gap = 0.3\n", "plane = { normal = [0.0, 0.0], offset = 1.3 }\n", "contact.plane.normal"),
        ("gap = 0.3\n", "plane = { normal = [1.0, 3.0], offset = 1.3 }\n", "71.6° off the normal"),
        ("group = \"right\"\n", "group = \"left\"\n", "are prescribed"),
        ("fix = [\"x\", \"y\"]\n", "fix = []\n", "fixes nothing"),
    ] {
        let changed = good.replacen(from, to, 1);
        assert_ne!(changed, good, "{from}");
        let said = refusal(place.path(), &changed);
        assert!(said.contains(words) || said.contains(&words.replace('\\', "")), "{words}: {said}");
    }
    let second = |more: &str| {
        format!("{good}[[material]]\n{more}young = 2.0\npoisson = 0.3\ndensity = 1.0\n")
    };
    assert!(refusal(place.path(), &second("")).contains("material[1].group"));
    assert!(refusal(place.path(), &second("group = \"body\"\n")).contains("and material[0]"));
    let many = good.replace("[contact]", "[[contact]]");
    let more = "[[contact]]\ngroup = \"top\"\ngap = 0.1\nmethod = \"penalty\"\n";
    assert!(
        refusal(
            place.path(),
            &format!("{}{more}", many.replace("gap = 0.3\n", "gap = 0.3\nmethod = \"nbm\"\n"))
        )
        .contains("contact[1].method")
    );
    // a support along an oblique direction of the contact
    let oblique = "[[support]]\ngroup = \"top\"\nfix = [\"normal\"]\n[contact]\ngroup = \"right\"\nplane = { normal = [1.0, 0.4], offset = 1.3 }\n";
    let said = refusal(place.path(), &text("plane stress", &format!("{CLAMP}{oblique}")));
    assert!(said.contains("holds a part of the contact displacement"), "{said}");
    assert!(said.contains("lie between the two, and from 80° on"), "{said}");
    // two directions that are neither one nor two
    let crossing = "[[contact]]\ngroup = \"right\"\nplane = { normal = [1.0, 0.7], offset = 1.9 }\n[[contact]]\ngroup = \"top\"\nplane = { normal = [0.7, 1.0], offset = 1.9 }\n";
    let said = refusal(place.path(), &text("plane stress", &format!("{CLAMP}{crossing}")));
    assert!(said.contains("two directions 20.0° apart"), "{said}");
    // a ring that may leave its axis
    let said = refusal(place.path(), &text("axisymmetric", contact));
    assert!(said.contains("lies on the axis and may move off it"), "{said}");
    let shifted = folder(&mesh.moved(|[x, y, z]| [x - 0.5, y, z]));
    let said = refusal(shifted.path(), &text("axisymmetric", contact));
    assert!(said.contains("has the radius -0.5"), "{said}");
    // a plane of symmetry that is bent
    let bent = folder(&mesh.moved(|[x, y, z]| [x + 0.2 * y * y, y, z]));
    let normal = CLAMP.replace("[\"x\", \"y\"]", "[\"normal\"]");
    let said = refusal(bent.path(), &text("plane stress", &format!("{normal}{contact}")));
    assert!(said.contains("needs a flat group"), "{said}");
    // a side of second order that folds its element, and parts that do not share their nodes
    let fold = rectangle(ElementKind::Quad8, [0.0, 1.0], 0.5, (4, 2), 0.0);
    let fold = folder(
        &fold.moved(|[x, y, z]| if x == 0.125 && y == 0.0 { [x, 0.35, z] } else { [x, y, z] }),
    );
    let said = refusal(fold.path(), &good);
    assert!(said.contains("is folded: det J"), "{said}");
    let mut hanging = msh(&mesh, |_| 0);
    let node = mesh.n_nodes() + 1;
    hanging = hanging
        .replace("$EndNodes", &format!("{node} 1.0 0.125 0\n{} 1.5 0.1 0\n$EndNodes", node + 1));
    hanging = hanging.replacen(
        &format!("$Nodes\n{}", mesh.n_nodes()),
        &format!("$Nodes\n{}", mesh.n_nodes() + 2),
        1,
    );
    let count = mesh.n_elements()
        + ["left", "right", "bottom", "top"].map(|g| mesh.group(g).len()).iter().sum::<usize>();
    let corner = mesh.group_nodes("right")[0] + 1;
    hanging =
        hanging.replacen(&format!("$Elements\n{count}"), &format!("$Elements\n{}", count + 1), 1);
    hanging = hanging.replace(
        "$EndElements",
        &format!("{} 2 2 10 1 {corner} {} {node}\n$EndElements", count + 1, node + 1),
    );
    std::fs::write(bent.path().join("body.msh"), hanging).unwrap();
    let said = refusal(bent.path(), &good);
    assert!(said.contains("hangs on a side of element"), "{said}");
    // a group that goes round a corner, and a cell that is there twice
    let corner = msh(&mesh, |_| 0).replace("\"top\"", "\"right\"");
    std::fs::write(bent.path().join("body.msh"), corner).unwrap();
    let said = refusal(bent.path(), &good);
    assert!(said.contains("turns by 90.0°"), "{said}");
    let twice = msh(&mesh, |_| 0);
    let last = twice.lines().rev().nth(1).unwrap().to_owned();
    let again = last.replacen(&count.to_string(), &(count + 1).to_string(), 1);
    let twice = twice
        .replacen(&format!("$Elements\n{count}"), &format!("$Elements\n{}", count + 1), 1)
        .replace("$EndElements", &format!("{again}\n$EndElements"));
    std::fs::write(bent.path().join("body.msh"), twice).unwrap();
    let said = refusal(bent.path(), &good);
    assert!(said.contains("they overlap, or are one twice"), "{said}");
    // how far a mode may go
    let mode = format!("{good}[initial]\nmode = 1\namplitude = -1.5\n");
    let said = refusal(place.path(), &mode);
    assert!(said.contains("give an amplitude from -1.0"), "{said}");
    // what does not go with elements
    let triangles = folder(&rectangle(ElementKind::Tri6, [0.0, 1.0], 0.5, (4, 2), 0.0));
    let projection = format!("{good}stress = \"projection\"\n");
    let said = refusal(triangles.path(), &projection);
    assert!(said.contains("fewer values than there are contact nodes"), "{said}");
    let lumped = good.replace("kind = \"mesh\"\n", "kind = \"mesh\"\nmass = \"lumped\"\n");
    assert!(refusal(triangles.path(), &lumped).contains("second-order elements"));
    problem(&scene(place.path(), &lumped));
    // of several bodies the one with these elements
    let of =
        |name: &str, rest: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"lumped\"\n{rest}");
    let two = of(
        "a",
        "kind = \"plate\"\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n",
    ) + &of(
        "b",
        "kind = \"mesh\"\nfile = \"body.msh\"\nstate = \"plane stress\"\nmove = [1.1, 0.0]\n",
    ) + "[[material]]\ngroup = \"b\"\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
           [[support]]\nedge = \"a:left\"\nfix = [\"x\", \"y\"]\n[[support]]\ngroup = \"b:right\"\nfix = [\"x\", \"y\"]\n";
    let said = refusal(triangles.path(), &two);
    assert!(said.contains("body[1].mass") && said.contains("second-order elements"), "{said}");
    // on the axis of a ring Simpson's rule has no weight
    let ring = folder(&rectangle(ElementKind::Quad9, [0.0, 1.0], 0.5, (4, 2), 0.0));
    let axis = "[[support]]\ngroup = \"left\"\nfix = [\"x\", \"y\"]\n";
    let ring_text = text("axisymmetric", &format!("{axis}{contact}"));
    let lumped = ring_text.replace("kind = \"mesh\"\n", "kind = \"mesh\"\nmass = \"lumped\"\n");
    let said = refusal(ring.path(), &lumped);
    assert!(said.contains("nodes on the axis no mass") && !said.contains("nine nodes"), "{said}");
    problem(&scene(ring.path(), &lumped.replace("\"lumped\"", "\"scaled-diagonal\"")));
    // plates name edges
    let said = refusal(
        place.path(),
        &plate(4, 2).source.text.replace("edge = \"right\"", "group = \"right\""),
    );
    assert!(said.contains("a bar or a plate has edges"), "{said}");
}

/// The paper's mass on slender elements is warned about, in the words of the summary.
#[test]
fn growth_of_the_papers_mass_is_announced() {
    let place = folder(&structured::rectangle(1.0, 0.5, 4, 12));
    let rest = format!("{CLAMP}{PAPER}[initial]\nmode = 1\namplitude = -0.9\n[run]\nuntil = 1.0\n");
    let toml: PathBuf = place.path().join("scene.toml");
    std::fs::write(&toml, text("plane stress", &rest)).unwrap();
    let out = place.path().join("out.h5");
    let output = run(&["run", toml.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert!(said.contains("gains energy within periods"), "{said}");
    assert!(said.contains("μ = 24.7"), "{said}");
}

/// Two stops on one displacement: a bar's end between two obstacles, against one bar that meets the front and its mirror image that meets the one behind;
/// against stiff springs on both sides; and every stored state against enumeration and an interior-point method.
#[test]
fn a_displacement_moves_between_two_stops() {
    let bar = |contact: &str, initial: &str| {
        let text = format!(
            "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [12]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
             [contact]\nedge = \"right\"\n{contact}{initial}[run]\nuntil = 20.0\n"
        );
        crate::common::scene(&text)
    };
    for method in ["", "inertia = \"constant\"\n", "method = \"mass-redistribution\"\n"] {
        let of = |gaps: [f64; 2], sign: f64| {
            let contact = format!("gap = {:?}\ngap_behind = {:?}\n{method}", gaps[0], gaps[1]);
            let scene = bar(&contact, &format!("[initial]\nvelocity = [\"{sign:?}*x\"]\n"));
            let problem = problem(&scene);
            let report = simulate(&scene, &problem, true, &mut Silent).unwrap();
            assert!(report.outcome.is_complete() && report.is_certified());
            let check = report.lcp_check.unwrap();
            assert!(check.enumeration.unwrap() < 1e-11 && check.interior_point < 1e-5, "{check:?}");
            (problem, report)
        };
        let ((p, here), (_, there)) = (of([0.3, 0.2], 1.0), of([0.2, 0.3], -1.0));
        assert_eq!(p.system.n_contact(), 2);
        assert!(here.switches.iter().any(|s| s.point == 0));
        assert!(here.switches.iter().any(|s| s.point == 1));
        same_motion(&here, &there, 1.0, 1e-9);
        assert!(here.switches.iter().zip(&there.switches).all(|(a, b)| a.point != b.point));
        if !method.is_empty() {
            assert!((here.energy_end / here.energy_start - 1.0).abs() < 1e-12);
        }
        // far behind nothing changes
        let (_, far) = of([0.3, 50.0], 1.0);
        let alone = bar(&format!("gap = 0.3\n{method}"), "[initial]\nvelocity = [\"1.0*x\"]\n");
        same_motion(&far, &solved(&alone).1, 1.0, 1e-12);
    }
    // stiff springs on both sides come to the first switches
    let rigid = bar(
        "gap = 0.3\ngap_behind = 0.2\nmethod = \"mass-redistribution\"\n",
        "[initial]\nvelocity = [\"1.0*x\"]\n",
    );
    let springs = bar(
        "gap = 0.3\ngap_behind = 0.2\nmethod = \"penalty\"\nstiffness = 1e4\n",
        "[initial]\nvelocity = [\"1.0*x\"]\n",
    );
    let (rigid, springs) = (solved(&rigid).1, solved(&springs).1);
    let first = |r: &Report, point: usize| r.switches.iter().find(|s| s.point == point).unwrap().t;
    for point in 0..2 {
        let (a, b) = (first(&rigid, point), first(&springs, point));
        assert!((a - b).abs() < 0.05, "{a} {b}");
    }
    // no room
    let said = refusal(
        Path::new(""),
        &bar("gap = 0.3\n", "")
            .source
            .text
            .replace("gap = 0.3\n", "gap = 0.3\ngap_behind = -0.3\n"),
    );
    assert!(said.contains("leaves no room"), "{said}");
}

/// A beam of one row of nodes at its tip, between stops at one displacement of a body of given matrices: orbits, backbones and files know them.
#[test]
fn orbits_between_two_stops_are_found_and_stored() {
    let place = tempfile::tempdir().unwrap();
    let toml = place.path().join("scene.toml");
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
                [contact]\nedge = \"right\"\ngap = 1.0\ngap_behind = 1.0\nmethod = \"mass-redistribution\"\n[damping]\nratio = 0.02\nmode = 1\n\
                [[load]]\nkind = \"mode\"\nmode = 1\npeak = 2.0\nomega = 1.5\n[orbit]\nrange = [1.3, 1.9]\n[run]\nperiods = 40\n";
    std::fs::write(&toml, text).unwrap();
    let out = place.path().join("response.h5");
    let found =
        json(&["response", toml.to_str().unwrap(), "-o", out.to_str().unwrap(), "--step", "0.02"]);
    assert!(found["points"].as_u64().unwrap_or(0) > 10 || found.to_string().len() > 100, "{found}");
    // the motion stays symmetric: as long at the one stop as at the other, half a period later
    let orbit = place.path().join("orbit.h5");
    let o =
        json(&["orbit", toml.to_str().unwrap(), "--omega", "1.55", "-o", orbit.to_str().unwrap()]);
    let switches = o["switches"].as_array().unwrap();
    assert!(switches.len() >= 4 && switches.len().is_multiple_of(2), "{o}");
    let period = o["period"].as_f64().unwrap();
    let times: Vec<f64> = switches.iter().map(|s| s["t"].as_f64().unwrap()).collect();
    for t in &times {
        let image = (t + period / 2.0) % period;
        let near =
            times.iter().any(|x| ((x - image + 1.5 * period) % period - period / 2.0).abs() < 1e-8);
        assert!(near, "{t} has no image: {times:?}");
    }
    let stored = Stored::read(&orbit).unwrap();
    assert_eq!((stored.gap.len(), stored.contact_normals[(1, 0)]), (2, -1.0));
    // one node, two points
    assert_eq!(stored.contact_nodes[0], stored.contact_nodes[1]);
    assert!(stored.switch_point.contains(&0) && stored.switch_point.contains(&1));
    for row in 0..stored.t.len() {
        for i in 0..2 {
            assert!(stored.contact_displacement(row, i) <= 1.0 + 1e-12);
        }
        assert_eq!(stored.contact_displacement(row, 0), -stored.contact_displacement(row, 1));
    }
}

/// Modes, orbits, families, harmonic balance and its cross-check, responses, reduction, pictures, exports: each command takes a body from a mesh.
#[test]
fn every_command_takes_a_mesh() {
    let place = tempfile::tempdir().unwrap();
    let mesh = root().join("tests/reference/meshes/t6_plate.msh");
    std::fs::copy(mesh, place.path().join("body.msh")).unwrap();
    let contact = "[contact]\ngroup = \"right\"\ngap = 0.3\n";
    let orbit = "[orbit]\nrange = [1.62, 1.9]\nmode = 2\n[initial]\nmode = 2\namplitude = -1.1\n[run]\nuntil = 10.0\n";
    let free = text("plane stress", &format!("{CLAMP}{contact}{orbit}"));
    let forced = text(
        "plane stress",
        &format!(
            "{CLAMP}{contact}stress = \"reaction\"\n[damping]\nratio = 0.03\nmode = 2\n[[load]]\nkind = \"mode\"\nmode = 2\npeak = 2.0\nomega = 1.6\n\
             [orbit]\nrange = [1.5, 1.9]\n[reduction]\nmodes = 30\n[run]\nperiods = 3\n"
        ),
    );
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("free.toml"), &free).unwrap();
    std::fs::write(at("forced.toml"), &forced).unwrap();
    let modes = json(&["modes", &at("free.toml"), "--count", "3"]);
    // the frequencies of the prototype
    for (w, exact) in modes["open"]["omega"].as_array().unwrap().iter().zip([
        0.4364137015,
        1.5789117546,
        1.6740181250,
    ]) {
        assert!((w.as_f64().unwrap() / exact - 1.0).abs() < 1e-8);
    }
    let runs: [&[&str]; 8] = [
        &["run", "free.toml", "-o", "run.h5"],
        &["backbone", "free.toml", "--step", "0.07", "-o", "b.h5"],
        &[
            "backbone",
            "free.toml",
            "--method",
            "hbm",
            "--harmonics",
            "9",
            "--step",
            "0.07",
            "-o",
            "h.h5",
        ],
        &["crosscheck", "h.h5", "free.toml", "-o", "x.h5"],
        &["backbone", "free.toml", "--viscous", "--quick", "--step", "0.1", "-o", "v.h5"],
        &["response", "forced.toml", "--step", "0.05", "-o", "r.h5"],
        &["compare", "free.toml", "--methods", "nbm,mass-redistribution,penalty", "-o", "c.h5"],
        &["precision", "free.toml", "-o", "p"],
    ];
    for arguments in runs {
        let all = [arguments, &["--threads", "1", "-q"]].concat();
        let output =
            crate::common::program().current_dir(place.path()).args(&all).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {said}");
    }
    for file in ["run.h5", "b.h5", "h.h5", "v.h5", "r.h5", "x.h5", "c.h5"] {
        let output = run(&["plot", &at(file)]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "plot {file}: {said}");
    }
    for format in ["csv", "vtu", "xdmf"] {
        let output = run(&["export", &at("run.h5"), "--format", format]);
        assert!(output.status.success(), "{format}");
    }
    // a start from the end of that run, on a mesh of quadrilaterals: its displacements are interpolated
    let other = place.path().join("other");
    std::fs::create_dir(&other).unwrap();
    std::fs::copy(at("run.h5"), other.join("run.h5")).unwrap();
    std::fs::copy(root().join("tests/reference/meshes/q4_rectangles.msh"), other.join("body.msh"))
        .unwrap();
    let start = free.replace("mode = 2\namplitude = -1.1", "file = \"run.h5\"");
    std::fs::write(other.join("scene.toml"), start).unwrap();
    let toml = other.join("scene.toml");
    let found = json(&["run", toml.to_str().unwrap(), "-o", other.join("o.h5").to_str().unwrap()]);
    let end = Stored::read(Path::new(&at("run.h5"))).unwrap();
    let last = end.t.len() - 1;
    let energy = end.energy[0][last] + end.energy[1][last];
    let off = found["energy_start"].as_f64().unwrap() / energy - 1.0;
    assert!(off.abs() < 0.2, "{off}");
}

/// Every contact method, moving obstacles and moving supports: a plate that is turned, as a mesh, does what the straight one does.
#[test]
fn every_method_works_in_any_direction() {
    let (nx, ny) = (6, 3);
    let place = folder(&structured::rectangle(1.0, 0.5, nx, ny).moved(turned(30.0)));
    let paper = "stress = \"projection\"\ninertia = \"paper\"\n";
    let damping = "[damping]\nrayleigh = [0.02, 1e-3]\n";
    let moving = "motion = { amplitude = 0.05, omega = 1.3, phase = 0.4 }\n";
    let base = |edge: &str, x: f64, y: f64| {
        format!(
            "{damping}[[load]]\nkind = \"base\"\n{edge} = \"left\"\namplitude = [{x:?}, {y:?}]\nomega = 1.4\n"
        )
    };
    let [bx, by, _] = turned(30.0)([0.1, 0.02, 0.0]);
    let [tx, ty, _] = turned(30.0)([0.02, -0.01, 0.0]);
    let traction = |edge: &str, x: f64, y: f64| {
        format!("[[load]]\nkind = \"traction\"\n{edge} = \"top\"\namplitude = [{x:?}, {y:?}]\n")
    };
    for (keys, of_mesh, more, of_turned) in [
        ("method = \"penalty\"\n", "", String::new(), String::new()),
        ("method = \"nitsche\"\n", "", String::new(), String::new()),
        ("method = \"nitsche\"\ntheta = 0\n", "", String::new(), String::new()),
        // nodes that mirror each other strike together, or one after the other, as rounding has it: without symmetry
        ("method = \"impact\"\n", "", traction("edge", 0.02, -0.01), traction("group", tx, ty)),
        ("method = \"moreau-jean\"\nstep = 0.01\n", "", String::new(), String::new()),
        ("method = \"mass-redistribution\"\n", "", String::new(), String::new()),
        (
            "method = \"mass-redistribution\"\nmass = \"optimal\"\n",
            "",
            String::new(),
            String::new(),
        ),
        ("method = \"mass-redistribution\"\ngap_behind = 0.5\n", "", String::new(), String::new()),
        (moving, paper, damping.to_owned(), damping.to_owned()),
        ("", paper, base("edge", 0.1, 0.02), base("group", bx, by)),
        ("", paper, traction("edge", 0.02, -0.01), traction("group", tx, ty)),
    ] {
        let straight =
            plate(nx, ny).source.text.replace("gap = 0.3\n", &format!("gap = 0.3\n{keys}"));
        let straight = crate::common::scene(&format!("{straight}{more}"));
        let rest = format!(
            "{CLAMP}[contact]\ngroup = \"right\"\ngap = 0.3\n{keys}{of_mesh}{MOTION}{of_turned}"
        );
        let oblique = scene(place.path(), &text("plane stress", &rest));
        let run = |scene: &Scene| simulate(scene, &problem(scene), false, &mut Silent).unwrap();
        let (mut a, mut b) = (run(&straight), run(&oblique));
        assert!(a.outcome.is_complete(), "{keys}: {}", a.outcome);
        if keys.contains("impact") {
            // how many of the impacts at the end of an accumulation are told from rest is a matter of rounding
            a.switches.retain(|s| s.energy_jump.abs() > 1e-7);
            b.switches.retain(|s| s.energy_jump.abs() > 1e-7);
        }
        if keys.contains("moreau-jean") {
            assert!((a.energy_end / b.energy_end - 1.0).abs() < 1e-9);
            continue;
        }
        println!("{keys}{more}: {} switches", a.switches.len());
        same_motion(&a, &b, 1.0, 1e-8);
    }
}

/// The optimal mass does not know where a body lies: moments are about its middle, and those that the nodes left cannot carry are refused.
#[test]
fn the_optimal_mass_follows_a_body_that_is_moved() {
    let optimal = "method = \"mass-redistribution\"\nmass = \"optimal\"\n";
    let rest = format!(
        "{CLAMP}[contact]\ngroup = \"right\"\ngap = 0.3\n{optimal}[initial]\nvelocity = [\"0.8\", \"0.05\"]\n[run]\nuntil = 6.0\nintegrator = \"modal\"\n"
    );
    let mesh = structured::rectangle(1.0, 0.4, 5, 2);
    let at = |x: f64| {
        let place = folder(&mesh.moved(|[a, b, c]| [a + x, b - 0.5 * x, c]));
        let scene = scene(place.path(), &text("plane stress", &rest));
        let p = problem(&scene);
        let report = simulate(&scene, &p, false, &mut Silent).unwrap();
        assert!(report.outcome.is_complete() && report.switches.len() > 1);
        let modes = signorini::contact::phase_modes(&p.system, &p.system.open_phase(), 6).unwrap();
        (modes.omega, report.last.u, report.switches.len())
    };
    let (omega, u, n) = at(0.0);
    for x in [10.0, 1000.0, 1e5] {
        let (moved, last, m) = at(x);
        // coordinates themselves lose digits
        let most = 1e-13 * x + 1e-11;
        let off = omega.iter().zip(&moved).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(n == m && off < most, "{x}: {off}");
        assert!(
            crate::common::relative(&last, &u) < 100.0 * most,
            "{x}: {}",
            crate::common::relative(&last, &u)
        );
    }
    let one = crate::common::half_plate(1, 1, optimal);
    let error = Problem::new(&crate::common::scene(&one), None).unwrap_err().to_string();
    assert!(error.contains("contact.mass") && error.contains("moments"), "{error}");
}
