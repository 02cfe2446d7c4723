//! Bodies in space: frequencies with the orders of their elements, energy, what does not depend on how a body lies, what is refused.

use std::f64::consts::PI;

use crate::common::cuboid::cuboid;
use crate::common::rectangle::msh;
use signorini::contact::{Contacts, Gaps, MassChoice, Stress, System};
use signorini::event::{Report, Silent};
use signorini::fem::{Body, DofMap, Facing, Fix, Held, MassForm, Material, StressState, eigen};
use signorini::mesh::slender::stiff_in_bending;
use signorini::mesh::{ElementKind, Family, Mesh, Point};
use signorini::problem::{Problem, ProblemError};
use signorini::scenario::Scene;
use signorini::simulate::simulate;

const SOLIDS: [ElementKind; 8] = [
    ElementKind::Tet4,
    ElementKind::Tet10,
    ElementKind::Hex8,
    ElementKind::Hex20,
    ElementKind::Hex27,
    ElementKind::Prism6,
    ElementKind::Prism15,
    ElementKind::Prism18,
];

const MATERIAL: Material =
    Material { young: 1.0, poisson: 0.3, density: 1.0, state: StressState::Solid };

fn frequencies(mesh: Mesh, held: &[Held], material: Material, n: usize, unit: f64) -> Vec<f64> {
    let dofs = DofMap::new(&mesh, held, &[]).unwrap();
    let body = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
    eigen::lowest(&body.stiffness, &body.mass, n, unit).unwrap().omega
}

/// A cube whose faces slide on rigid walls: shear waves with `ω² = μ/ρ k²`, pressure waves with `ω² = (λ + 2μ)/ρ k²`, `k = π (l, m, n)`.
#[test]
fn a_cube_between_walls_has_the_waves_of_the_closed_form() {
    let (nu, shear) = (0.3, 1.0 / 2.6);
    let pressure = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    // three shear waves (1, 1, 0), two (1, 1, 1), three pressure waves (1, 0, 0)
    let exact = [
        2.0 * shear,
        2.0 * shear,
        2.0 * shear,
        3.0 * shear,
        3.0 * shear,
        pressure,
        pressure,
        pressure,
    ];
    let walls: Vec<Held> = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"]
        .map(|group| Held { group: group.into(), fix: Fix::Normal })
        .to_vec();
    for (kind, coarse, order) in [
        (ElementKind::Tet4, 8, 2.0),
        (ElementKind::Tet10, 4, 4.0),
        (ElementKind::Hex8, 4, 2.0),
        (ElementKind::Hex20, 2, 4.0),
        (ElementKind::Hex27, 2, 4.0),
        (ElementKind::Prism6, 4, 2.0),
        (ElementKind::Prism15, 3, 4.0),
        (ElementKind::Prism18, 3, 4.0),
    ] {
        let errors: Vec<f64> = [coarse, 2 * coarse]
            .iter()
            .map(|&n| {
                let mesh = cuboid(kind, [1.0; 3], [n; 3], 0.0);
                let omega = frequencies(mesh, &walls, MATERIAL, 8, PI);
                let off = |(w, e): (&f64, &f64)| w / (PI * e.sqrt()) - 1.0;
                omega.iter().zip(&exact).map(off).fold(0.0, f64::max)
            })
            .collect();
        let found = (errors[0] / errors[1]).log2();
        println!("{kind:?}: errors {errors:?}, order {found:.2}");
        assert!(errors[1] > 0.0 && (found - order).abs() < 0.45, "{kind:?}: {errors:?} {found}");
    }
}

/// The frequency equation of a clamped and free Timoshenko beam (Huang 1961, J. Appl. Mech. 28, table 1), `k` of Cowper (1966).
fn timoshenko(length: f64, height: f64, nu: f64) -> f64 {
    let k = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
    let r2 = (height / length).powi(2) / 12.0;
    let s2 = r2 * 2.0 * (1.0 + nu) / k;
    let equation = |b: f64| {
        let root = ((r2 - s2).powi(2) + 4.0 / (b * b)).sqrt();
        let alpha = ((root - r2 - s2) / 2.0).sqrt();
        let beta = ((root + r2 + s2) / 2.0).sqrt();
        2.0 + (b * b * (r2 - s2).powi(2) + 2.0) * (b * alpha).cosh() * (b * beta).cos()
            - b * (r2 + s2) / (1.0 - b * b * r2 * s2).sqrt() * (b * alpha).sinh() * (b * beta).sin()
    };
    let (mut low, mut high) = (1.0, 3.6);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if equation(middle).signum() == equation(low).signum() {
            low = middle
        } else {
            high = middle
        }
    }
    // b² = ρ A L⁴ ω²/(E I)
    low * (height * height / 12.0).sqrt() / (length * length)
}

/// A slender cantilever against beam theory (the clamp of the beam lets the section contract, that of the body does not), and its longitudinal
/// wave without Poisson's ratio against the closed form.
#[test]
fn a_cantilever_has_the_frequencies_of_a_beam() {
    let (length, height) = (10.0, 1.0);
    let clamp = [0, 1, 2].map(|axis| Held::along("xmin", axis));
    let exact = timoshenko(length, height, 0.3);
    for (kind, coarse, [before, most]) in [
        (ElementKind::Tet4, [16, 2, 2], [0.4, 0.2]),
        (ElementKind::Tet10, [8, 1, 1], [0.03, 0.01]),
        (ElementKind::Hex8, [16, 2, 2], [0.2, 0.06]),
        (ElementKind::Hex20, [8, 1, 1], [0.02, 0.01]),
        (ElementKind::Hex27, [8, 1, 1], [0.02, 0.01]),
        (ElementKind::Prism6, [16, 2, 2], [0.3, 0.1]),
        (ElementKind::Prism15, [8, 1, 1], [0.03, 0.01]),
        (ElementKind::Prism18, [8, 1, 1], [0.03, 0.01]),
    ] {
        let at = |factor: usize, poisson: f64, held: &[Held]| {
            let mesh = cuboid(kind, [length, height, height], coarse.map(|n| factor * n), 0.0);
            let material = Material { poisson, ..MATERIAL };
            frequencies(mesh, held, material, 1, 0.1)[0]
        };
        let errors = [1, 2].map(|f| at(f, 0.3, &clamp) / exact - 1.0);
        println!("{kind:?}: bending {errors:?}");
        assert!(errors[0] < before && errors[1] < most && errors[1] > -2e-3, "{kind:?} {errors:?}");
        // waves along the beam alone: ω = π/2 √(E/ρ)/L
        let mut held = clamp.to_vec();
        held.extend(
            ["ymin", "ymax", "zmin", "zmax"].map(|g| Held { group: g.into(), fix: Fix::Normal }),
        );
        let bar = PI / 2.0 / length;
        let errors = [1, 2].map(|f| at(f, 0.0, &held) / bar - 1.0);
        let (found, order) =
            ((errors[0] / errors[1]).log2(), if kind.is_quadratic() { 4.0 } else { 2.0 });
        println!("{kind:?}: longitudinal {errors:?}, order {found:.2}");
        assert!(errors[1] > 0.0 && (found - order).abs() < 0.4, "{kind:?} {errors:?}");
    }
}

/// A folder with a mesh in it.
/// Too few linear tetrahedra where a body bends are said, and of nothing else.
#[test]
fn linear_tetrahedra_that_cannot_bend_are_said() {
    let layers = |kind, size, cells| {
        stiff_in_bending(&cuboid(kind, size, cells, 0.0)).map(|stiff| stiff.layers)
    };
    let (slender, flat) = ([10.0, 1.0, 1.0], [6.0, 6.0, 0.5]);
    for (size, cells, wanted) in [
        (slender, [20, 2, 2], Some(2.0)),
        (slender, [10, 1, 1], Some(1.0)),
        (flat, [12, 12, 3], Some(3.0)),
        (slender, [40, 4, 4], None),
        ([1.0; 3], [2; 3], None),
    ] {
        let found = layers(ElementKind::Tet4, size, cells);
        let near = |a: f64, b: f64| (a - b).abs() < 0.15 * b;
        assert!(found.is_none() == wanted.is_none(), "{cells:?} {found:?}");
        assert!(found.zip(wanted).is_none_or(|(a, b)| near(a, b)), "{cells:?} {found:?}");
    }
    for kind in [ElementKind::Tet10, ElementKind::Hex8, ElementKind::Hex27] {
        assert_eq!(layers(kind, slender, [10, 1, 1]), None);
    }
    // walls of a wedge that are near each other are none of a slender body
    let sphere = crate::common::root().join("tests/reference/meshes/sphere-eighth-coarse.msh");
    let found = crate::common::json(&["inspect", sphere.to_str().unwrap()]);
    assert!(found["body"]["cells"].is_u64() && found["body"]["warning"].is_null(), "{found}");
    let place = folder(&cuboid(ElementKind::Tet4, slender, [10, 1, 1], 0.0));
    let at = |name: &str| place.path().join(name).display().to_string();
    std::fs::write(at("scene.toml"), format!("{BODY}[run]\nuntil = 1.0\n")).unwrap();
    for (words, key) in [
        (vec!["modes".to_owned(), at("scene.toml")], "warning"),
        (vec!["run".to_owned(), at("scene.toml"), "-o".to_owned(), at("r.h5")], "mesh_warning"),
    ] {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let found = crate::common::json(&words);
        let said = found[key].as_str().unwrap_or_default();
        assert!(said.contains("1.0 linear tetrahedra"), "{words:?} {said}");
    }
}

fn folder(mesh: &Mesh) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("body.msh"), msh(mesh, |_| 0)).unwrap();
    place
}

const BODY: &str = "[body]\nkind = \"mesh\"\nfile = \"body.msh\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
    [[support]]\ngroup = \"xmin\"\nfix = [\"x\", \"y\", \"z\"]\n";
const START: &str = "[initial]\ndisplacement = [\"-x*(1 + 0.1*y)\", \"0.03*x*y\", \"0.02*x*z\"]\n";

fn scene(place: &tempfile::TempDir, text: &str) -> Scene {
    Scene::parse(text, &place.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
}

fn solved(scene: &Scene) -> (Problem, Report) {
    let problem = Problem::new(scene, None).unwrap_or_else(|e| panic!("{e}"));
    let report = simulate(scene, &problem, false, &mut Silent).unwrap();
    assert!(report.outcome.is_complete() && report.is_certified(), "{}", report.outcome);
    (problem, report)
}

/// The same body by hexahedra and by prisms: what lies between their frequencies falls with the order of both.
#[test]
fn prisms_and_hexahedra_agree_at_their_order() {
    let held = ["xmin", "ymin", "zmin"].map(|g| Held { group: g.into(), fix: Fix::Normal });
    for (hexahedron, prism, cells, order) in [
        (ElementKind::Hex8, ElementKind::Prism6, [8, 6, 6], 2.0),
        (ElementKind::Hex20, ElementKind::Prism15, [4, 4, 4], 4.0),
        (ElementKind::Hex27, ElementKind::Prism18, [4, 4, 4], 4.0),
    ] {
        let apart = [1, 2].map(|factor| {
            let of = |kind| {
                let mesh = cuboid(kind, [1.0, 0.8, 0.7], cells.map(|n| factor * n), 0.0);
                frequencies(mesh, &held, MATERIAL, 2, 1.0)
            };
            let (a, b) = (of(hexahedron), of(prism));
            a.iter().zip(&b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        });
        let found = (apart[0] / apart[1]).log2();
        println!("{prism:?}: apart {apart:?}, order {found:.2}");
        assert!((found - order).abs() < 0.4, "{prism:?}: {apart:?} {found}");
    }
}

/// Contact on the triangles at the end of prisms as on their quadrilaterals: the same box, meshed along either axis, moves alike.
#[test]
fn both_faces_of_a_prism_bear_contact() {
    let along = |axis: usize, cells: usize| {
        let turn = |[x, y, z]: Point| if axis == 2 { [z, x, y] } else { [x, y, z] };
        let size = if axis == 2 { [0.5, 0.5, 1.0] } else { [1.0, 0.5, 0.5] };
        let count = if axis == 2 { [cells, cells, 2 * cells] } else { [2 * cells, cells, cells] };
        let place = folder(&cuboid(ElementKind::Prism6, size, count, 0.0).moved(turn));
        let ends = if axis == 2 { ["zmin", "zmax"] } else { ["xmin", "xmax"] };
        let body = BODY.replace("xmin", ends[0]);
        let text = format!(
            "{body}[contact]\ngroup = \"{}\"\ngap = 0.2\nmethod = \"mass-redistribution\"\n[initial]\nvelocity = [\"x\", \"0\", \"0\"]\n[run]\nuntil = 6.0\n",
            ends[1]
        );
        let (_, report) = solved(&scene(&place, &text));
        assert!((report.energy_end / report.energy_start - 1.0).abs() < 1e-10);
        report.switches.iter().map(|s| s.t).fold(f64::INFINITY, f64::min)
    };
    let apart = [2, 4].map(|n| (along(0, n) - along(2, n)).abs());
    println!("first contact {apart:?} apart");
    assert!(apart[1] < 0.5 * apart[0] && apart[0] < 0.05, "{apart:?}");
}

/// Constant inertia keeps the energy over twenty periods on every element, by every way to the pressure that it allows.
#[test]
fn energy_is_kept_on_every_solid_element() {
    for kind in SOLIDS {
        let cells = if kind.is_quadratic() { [2, 1, 1] } else { [4, 2, 2] };
        let place = folder(&cuboid(kind, [1.0, 0.5, 0.5], cells, 0.15));
        let mut choices = vec!["stress = \"nodal-mean\"\n"];
        if kind.family() == Family::Cube {
            choices.push("stress = \"projection\"\n");
        }
        // a face at the end of the box; of prisms along z its quadrilaterals
        if !matches!(kind, ElementKind::Tet10 | ElementKind::Hex20 | ElementKind::Prism15) {
            choices.push("stress = \"reaction\"\n");
        }
        for choice in choices {
            // one period of the first mode is 13
            let text = format!(
                "{BODY}[contact]\ngroup = \"xmax\"\ngap = 0.3\ninertia = \"constant\"\n{choice}{START}[run]\nuntil = 260.0\n"
            );
            let (_, report) = solved(&scene(&place, &text));
            let drift = (report.energy_end / report.energy_start - 1.0).abs();
            println!("{kind:?} {choice:?}: {} switches, {drift:.1e}", report.switches.len());
            assert!(report.switches.len() > 300 && drift < 1e-10, "{kind:?} {choice} {drift:e}");
        }
    }
}

/// A body that is turned about an oblique axis moves as it did, along its normals and towards an oblique plane.
#[test]
fn how_a_body_lies_in_space_does_not_matter() {
    let turn = |[x, y, z]: Point| -> Point {
        let r = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 1.1);
        let p = r * nalgebra::Vector3::new(x, y, z);
        [p.x, p.y, p.z]
    };
    for kind in [ElementKind::Hex8, ElementKind::Tet4] {
        let mesh = cuboid(kind, [1.0, 0.5, 0.5], [3, 2, 2], 0.1);
        let oblique: Point = [0.96, 0.28 * 0.6, 0.28 * 0.8];
        for plane in [None, Some(oblique)] {
            let motion = |mesh: &Mesh, map: &dyn Fn(Point) -> Point| {
                let place = folder(mesh);
                let obstacle = match plane.map(map) {
                    None => "gap = 0.2\n".to_owned(),
                    Some(n) => format!("plane = {{ normal = {n:?}, offset = 1.16 }}\n"),
                };
                // the same field: components are turned with the body
                let text = format!(
                    "{BODY}[contact]\ngroup = \"xmax\"\n{obstacle}[initial]\ndisplacement = [\"0\", \"0\", \"0\"]\n[run]\nuntil = 12.0\n"
                );
                let scene = scene(&place, &text);
                let mut problem = Problem::new(&scene, None).unwrap_or_else(|e| panic!("{e}"));
                let straight = cuboid(kind, [1.0, 0.5, 0.5], [3, 2, 2], 0.1);
                let field = straight.nodes().iter().flat_map(|&[x, y, z]| {
                    map([0.9 * x * (1.0 + 0.1 * y), 0.05 * x * y, 0.04 * x * z])
                });
                let nodal: Vec<f64> = field.collect();
                let n_o = problem.system.n_o();
                problem.initial.v = problem.system.body.dofs.gather(&nodal)[..n_o].to_vec();
                let report = simulate(&scene, &problem, false, &mut Silent).unwrap();
                assert!(report.outcome.is_complete() && report.is_certified());
                report
            };
            let (a, b) = (motion(&mesh, &|p| p), motion(&mesh.moved(turn), &turn));
            assert!(a.switches.len() == b.switches.len() && a.switches.len() > 5, "{kind:?}");
            for (a, b) in a.switches.iter().zip(&b.switches) {
                assert!((a.t - b.t).abs() < 1e-8 && a.point == b.point, "{} {}", a.t, b.t);
            }
            assert!((a.energy_end / b.energy_end - 1.0).abs() < 1e-10);
        }
    }
}

/// A linear field has its stress on every face by the operators that are consistent: the patch test of the contact stress.
#[test]
fn uniform_strain_gives_its_stress_on_faces() {
    let g = [[0.02, -0.01, 0.03], [0.0, -0.01, 0.02], [0.01, 0.04, 0.015]];
    for kind in SOLIDS {
        // the nodal mean is shown to have a P-matrix on faces of Tet10 and Prism15 where they are regular
        let is_regular = matches!(kind, ElementKind::Tet10 | ElementKind::Prism15);
        let skew = if is_regular { 0.0 } else { 0.15 };
        let mesh = cuboid(kind, [1.0, 0.8, 0.6], [2, 2, 2], skew);
        let nodal: Vec<f64> = mesh
            .nodes()
            .iter()
            .flat_map(|p| [0, 1, 2].map(|a| (0..3).map(|b| g[a][b] * p[b]).sum::<f64>()))
            .collect();
        let both = |a: usize, b: usize| g[a][b] + g[b][a];
        let strain =
            nalgebra::Vector6::new(g[0][0], g[1][1], g[2][2], both(0, 1), both(1, 2), both(2, 0));
        let s = MATERIAL.stiffness() * strain;
        for (group, axis) in [("xmax", 0), ("ymin", 1), ("zmax", 2)] {
            for stress in [Stress::NodalMean, Stress::Projection] {
                if stress == Stress::Projection && kind.family() != Family::Cube {
                    continue;
                }
                let dofs = DofMap::new(&mesh, &[], &[Facing::surface(group)]).unwrap();
                let u = dofs.gather(&nodal);
                let body = Body::assemble(mesh.clone(), dofs, &[MATERIAL], MassForm::Consistent);
                let gaps = Gaps::front(vec![1.0; body.dofs.n_c]);
                let contacts = Contacts { gaps, lumped: false };
                let system = System::new(body, &contacts, (stress, MassChoice::Condensed));
                let system = system.unwrap_or_else(|e| panic!("{kind:?} {group}: {e}"));
                let c = system.conditions();
                let (u_o, u_c) = u.split_at(system.n_o());
                for i in 0..c.count() {
                    let found = c.n_o.row_dot(i, u_o) + c.n_c.row_dot(i, u_c);
                    let off = (found - s[axis]).abs();
                    assert!(off < 1e-13, "{kind:?} {stress:?} {group}: {found} {}", s[axis]);
                }
            }
        }
    }
}

fn refused(place: &tempfile::TempDir, text: &str) -> String {
    let scene = match Scene::parse(text, &place.path().join("scene.toml")) {
        Ok(scene) => scene,
        Err(e) => return e.to_string(),
    };
    match Problem::new(&scene, None) {
        Ok(_) => "nothing".into(),
        Err(ProblemError::Scene(e)) => e.to_string(),
        Err(e) => e.to_string(),
    }
}

#[test]
fn what_does_not_work_in_space_is_refused() {
    let contact = "[contact]\ngroup = \"xmax\"\ngap = 0.3\n";
    for (kind, more, words) in [
        (
            ElementKind::Tet10,
            "stress = \"reaction\"\n",
            "contact.stress: contact forces at nodes do not work on Tet10 faces: a uniform pressure has zero or tensile corner forces",
        ),
        (ElementKind::Hex20, "method = \"mass-redistribution\"\n", "zero or tensile corner forces"),
        (ElementKind::Hex20, "method = \"impact\"\n", "zero or tensile corner forces"),
        (
            ElementKind::Prism15,
            "method = \"mass-redistribution\"\n",
            "contact.method: contact forces at nodes do not work on Q8 Prism15 faces",
        ),
        (
            ElementKind::Tet4,
            "stress = \"projection\"\n",
            "\"projection\" does not work on tetrahedra: the projected stress has fewer values than there are contact nodes",
        ),
        (ElementKind::Prism6, "stress = \"projection\"\n", "does not work on prisms"),
        (ElementKind::Tet4, "plane = { normal = [1.0, 0.0], offset = 1.3 }\n", "needs 3 numbers"),
    ] {
        let place = folder(&cuboid(kind, [1.0, 0.5, 0.5], [1, 1, 1], 0.0));
        let contact = match more.contains("plane") {
            true => contact.replace("gap = 0.3\n", ""),
            false => contact.to_owned(),
        };
        let found = refused(&place, &format!("{BODY}{contact}{more}{START}[run]\nuntil = 1.0\n"));
        assert!(found.contains(words), "{found}\nnot: {words}");
    }
    let solid = folder(&cuboid(ElementKind::Hex8, [1.0, 0.5, 0.5], [1, 1, 1], 0.0));
    let flat = folder(&crate::common::rectangle::rectangle(
        ElementKind::Quad4,
        [0.0, 1.0],
        0.5,
        (2, 1),
        0.0,
    ));
    let whole = format!("{BODY}{contact}{START}[run]\nuntil = 1.0\n");
    let of_plane = "file = \"body.msh\"\nstate = \"plane strain\"";
    for (place, text, words) in [
        (
            &solid,
            whole
                .replace("file = \"body.msh\"", of_plane)
                .replace(", \"z\"", "")
                .replace(", \"0.02*x*z\"", ""),
            "body.state: belongs to a body in the plane",
        ),
        (&flat, whole.replace("xmin", "left").replace("xmax", "right"), "body.state: is missing"),
        (
            &flat,
            whole
                .replace("file = \"body.msh\"", of_plane)
                .replace("xmin", "left")
                .replace(", \"0.02*x*z\"", ""),
            "no z displacement",
        ),
        (
            &flat,
            whole
                .replace("file = \"body.msh\"", of_plane)
                .replace(", \"z\"]", "]")
                .replace("\"0.03*x*y\", \"0.02*x*z\"", "\"z\""),
            "expression of z",
        ),
        (
            &solid,
            whole.replace("poisson = 0.3", "poisson = 0.5"),
            "0.5 makes the stiffness indefinite",
        ),
        (
            &solid,
            whole.replace("file = \"body.msh\"", "file = \"body.msh\"\nthickness = 1.0"),
            "one in space has neither",
        ),
        (
            &solid,
            whole.replace("group = \"xmax\"", "group = \"side\""),
            "the mesh has no group of sides \"side\"",
        ),
    ] {
        let found = refused(place, &text);
        assert!(found.contains(words), "{found}\nnot: {words}");
    }
}

/// Nodes at which several obstacles meet: three directions at the corner of a box, in any order of the groups; two groups that lie in one plane are one
/// direction; more directions than dimensions are refused.
#[test]
fn obstacles_meet_at_corners_in_space() {
    let mesh = cuboid(ElementKind::Hex8, [1.0, 0.8, 0.6], [2, 2, 2], 0.0);
    let areas = |order: &[&str]| {
        let facing: Vec<Facing> = order.iter().map(|g| Facing::surface(g)).collect();
        let dofs = DofMap::new(&mesh, &[], &facing).unwrap();
        let body = Body::assemble(mesh.clone(), dofs, &[MATERIAL], MassForm::Consistent);
        let gaps = Gaps::front(vec![1.0; body.dofs.n_c]);
        let contacts = Contacts { gaps, lumped: false };
        let system = System::new(body, &contacts, (Stress::Reaction, MassChoice::Condensed));
        let system = system.unwrap_or_else(|e| panic!("{order:?}: {e}"));
        (system.n_contact(), system.constraints.iter().map(|c| c.area).sum::<f64>())
    };
    for order in [["xmax", "ymax", "zmax"], ["zmax", "xmax", "ymax"], ["ymax", "zmax", "xmax"]] {
        let (count, area) = areas(&order);
        assert_eq!(count, 27);
        assert!((area - (0.48 + 0.6 + 0.8)).abs() < 1e-14, "{order:?}: {area}");
    }
    // the face at x = 1 in two halves
    let half = |low: bool| {
        let of = |f: &&signorini::mesh::Facet| {
            let nodes = mesh.side_nodes(**f);
            let y = nodes.iter().map(|&n| mesh.nodes()[n][1]).sum::<f64>() / nodes.len() as f64;
            (y < 0.4) == low
        };
        mesh.group("xmax").iter().filter(of).copied().collect::<Vec<_>>()
    };
    let groups = ["ymax", "zmax"].map(|g| (g.to_owned(), mesh.group(g).to_vec()));
    let halves = [("low".to_owned(), half(true)), ("high".to_owned(), half(false))];
    let split = mesh.clone().with_groups(groups.into_iter().chain(halves));
    for order in [["zmax", "low", "high", "ymax"], ["low", "high", "zmax", "ymax"]] {
        let facing: Vec<Facing> = order.iter().map(|g| Facing::surface(g)).collect();
        assert_eq!(DofMap::new(&split, &[], &facing).unwrap().n_c, 27, "{order:?}");
    }
    // three walls around a corner that the clamp holds along one of them
    let held = [Held::along("zmin", 2)];
    let oblique = |direction: Point| Facing::plane("xmax", Some(direction));
    let facing = [oblique([1.0, 0.0, 0.0]), oblique([0.8, 0.6, 0.0]), oblique([0.8, -0.6, 0.0])];
    let error = DofMap::new(&mesh, &held, &facing).unwrap_err();
    assert!(matches!(error, signorini::fem::FrameError::TooMany { .. }), "{error}");
    let error = DofMap::new(&mesh, &[], &facing).unwrap_err();
    assert!(matches!(error, signorini::fem::FrameError::TooMany { .. }), "{error}");
}

/// Everything that acts in space at once: gravity, a driven point, a traction, a support that moves, a stop on either side; and every other method.
#[test]
fn loads_supports_and_methods_act_in_space() {
    let place = folder(&cuboid(ElementKind::Hex8, [1.0, 0.5, 0.5], [4, 2, 2], 0.1));
    let weight = "[[load]]\nkind = \"gravity\"\namplitude = [0.02, 0.0, -0.03]\n";
    let point = "[[load]]\nkind = \"point\"\nat = [1.0, 0.5, 0.5]\namplitude = [0.01, 0.02, 0.0]\nomega = 0.4\n";
    let traction =
        "[[load]]\nkind = \"traction\"\ngroup = \"zmax\"\namplitude = [0.0, 0.0, 0.05]\n";
    let base =
        "[[load]]\nkind = \"base\"\ngroup = \"xmin\"\namplitude = [0.02, 0.0, 0.01]\nomega = 0.5\n";
    let start = START.replace("-x*", "-0.1*x*");
    for (contact, loads, least) in [
        ("gap = 0.1\ngap_behind = 0.15\n", format!("{weight}{point}{traction}"), 100),
        ("gap = 0.1\n", format!("{point}{base}"), 1),
        ("gap = 0.1\nmethod = \"penalty\"\n", format!("{weight}{traction}"), 20),
        ("gap = 0.1\nmethod = \"nitsche\"\n", weight.into(), 20),
        ("gap = 0.1\nmethod = \"impact\"\n", weight.into(), 20),
    ] {
        let text = format!(
            "{BODY}[contact]\ngroup = \"xmax\"\n{contact}{loads}{start}[run]\nuntil = 40.0\n"
        );
        let (_, report) = solved(&scene(&place, &text));
        println!("{contact:?}: {} switches, {:.1e}", report.log.switches(), report.energy_drift);
        assert!(report.log.switches() >= least, "{contact}: {}", report.log.switches());
        assert!(report.energy_drift < 1e-10, "{contact}: {:e}", report.energy_drift);
    }
}

/// The viscous nonlinear mode of a rod in space of ten thousand displacements by reduction, eleven orbits; and how fast a mesh is read.
/// `cargo test --release solids:: -- --ignored --nocapture` tells the times.
#[test]
#[ignore = "a minute"]
fn a_viscous_backbone_in_space_of_ten_thousand_displacements() {
    let place = folder(&cuboid(ElementKind::Hex8, [1.0, 0.15, 0.15], [92, 5, 5], 0.0));
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let text = "[body]\nkind = \"mesh\"\nfile = \"body.msh\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\ngroup = \"xmin\"\nfix = [\"x\", \"y\", \"z\"]\n[[support]]\ngroup = \"ymin\"\nfix = [\"normal\"]\n\
        [[support]]\ngroup = \"zmin\"\nfix = [\"normal\"]\n[contact]\ngroup = \"xmax\"\ngap = 1.0\n[reduction]\ncutoff = 35.3\n\
        [orbit]\nomega = 1.8\nrange = [1.6, 2.0]\nbeta = \"auto\"\n[initial]\nmode = 1\namplitude = -1.3\n[run]\nperiods = 1\n";
    std::fs::write(at("rod.toml"), text).unwrap();
    let begun = std::time::Instant::now();
    let words = ["--viscous", "--quick", "--step", "0.04"];
    let family = crate::common::json(
        &[&["backbone", &at("rod.toml"), "-o", &at("rod.h5")], &words[..]].concat(),
    );
    let points = family["points"].as_array().unwrap().len();
    println!("{points} orbits in {:.1} s", begun.elapsed().as_secs_f64());
    assert!(points >= 11, "{family}");

    let file = place.path().join("box.msh");
    let cells = [57, 23, 23];
    std::fs::write(&file, msh(&cuboid(ElementKind::Hex8, [1.0, 0.4, 0.4], cells, 0.1), |_| 0))
        .unwrap();
    let begun = std::time::Instant::now();
    let read = crate::common::json(&["inspect", file.to_str().unwrap()]);
    let seconds = begun.elapsed().as_secs_f64();
    let count = cells.iter().product::<usize>();
    println!("{count} cells in {seconds:.2} s: {:.0} a second", count as f64 / seconds);
    assert_eq!(read["body"]["cells"].as_u64(), Some(count as u64), "{read}");
}
