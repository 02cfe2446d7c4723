//! Meshes of Gmsh. Reference numbers: an independent prototype (its matrices agree with scikit-fem).

use crate::common::root;
use signorini::contact::Gaps;
use signorini::contact::phase_modes;
use signorini::contact::{ContactError, Contacts, MassChoice, State, States, Stress, System};
use signorini::fem::{
    Body, DofMap, Facing, Held, MassForm, Material, Shape, StressState, eigen, shape,
};
use signorini::mesh::ElementKind;
use signorini::mesh::gmsh::{GmshError, Imported, Sides, read};
use signorini::scenario::{Inertia, Integrator};

fn imported(name: &str) -> Imported {
    let bytes = std::fs::read(root().join("tests/reference/meshes").join(name)).unwrap();
    read(&bytes).unwrap().body(1.0, &[]).unwrap()
}

/// The face at `x = 0`, all components.
fn clamped(dim: usize) -> Vec<Held> {
    let group = if dim == 3 { "xmin" } else { "left" };
    (0..dim).map(|axis| Held::along(group, axis)).collect()
}

const STRESS: StressState = StressState::PlaneStress { thickness: 1.0 };
const STRAIN: StressState = StressState::PlaneStrain { thickness: 1.0 };
const SOLID: StressState = StressState::Solid;

#[test]
fn bodies_have_the_matrices_of_the_prototype() {
    for (name, kind, nodes, cells, state, trace, frequencies) in [
        (
            "t3_plate.msh",
            ElementKind::Tri3,
            28,
            38,
            STRESS,
            101.8057536258,
            [0.4679568264, 1.5879349259, 1.8366059647],
        ),
        (
            "t6_plate.msh",
            ElementKind::Tri6,
            57,
            22,
            STRESS,
            300.6689735513,
            [0.4364113203, 1.5789117284, 1.6740082162],
        ),
        (
            "q4_distorted.msh",
            ElementKind::Quad4,
            28,
            18,
            STRAIN,
            86.0748357547,
            [0.4758005606, 1.6753364026, 1.8389771510],
        ),
        (
            "hex8_box.msh",
            ElementKind::Hex8,
            45,
            16,
            SOLID,
            23.1056401553,
            [0.4809459728, 0.4855359080, 0.9964184677],
        ),
    ] {
        let file = imported(name);
        assert_eq!((file.mesh.n_nodes(), file.mesh.n_elements()), (nodes, cells), "{name}");
        assert!(file.mesh.elements().all(|e| e.kind == kind) && file.unused == 0);
        assert_eq!(file.regions, [["body"]]);
        let names: Vec<&String> = file.sides.keys().collect();
        let dim = kind.dim();
        match dim {
            2 => assert_eq!(names, ["bottom", "left", "right", "top"]),
            _ => assert_eq!(names, ["xmax", "xmin", "ymax", "ymin", "zmax", "zmin"]),
        }
        let material = Material { young: 1.0, poisson: 0.3, density: 1.0, state };
        // the whole body, before its supports
        let free = DofMap::new(&file.mesh, &[], &[]).unwrap();
        let body = Body::assemble(file.mesh.clone(), free, &[material], MassForm::Consistent);
        let n = body.stiffness.n_rows();
        let found: f64 = body.stiffness.triplets().filter(|t| t.0 == t.1).map(|t| t.2).sum();
        assert!((found / trace - 1.0).abs() < 1e-10, "{name}: trace {found}");
        let mass = body.mass.quadratic(&vec![1.0; n]) / dim as f64;
        let exact = if dim == 2 { 0.5 } else { 0.25 };
        assert!((mass - exact).abs() < 1e-10, "{name}: mass {mass}");
        let held = DofMap::new(&file.mesh, &clamped(dim), &[]).unwrap();
        let body = Body::assemble(file.mesh, held, &[material], MassForm::Consistent);
        let modes = eigen::lowest(&body.stiffness, &body.mass, 3, 1.0).unwrap();
        for (w, exact) in modes.omega.iter().zip(frequencies) {
            assert!((w / exact - 1.0).abs() < 1e-8, "{name}: {w} {exact}");
        }
    }
}

/// Two squares of one unit, one over the other, in both formats.
const TWO: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n1 7 \"low side\"\n1 8 \"seam\"\n2 5 \"steel\"\n2 6 \"rubber\"\n$EndPhysicalNames\n\
    $Entities\n0 2 2 0\n1 0 0 0 1 0 0 1 -7 0\n2 0 1 0 1 1 0 1 8 0\n1 0 0 0 1 1 0 1 5 0\n2 0 1 0 1 2 0 1 6 0\n$EndEntities\n\
    $Nodes\n1 7 1 40\n2 1 0 7\n1\n2\n3\n4\n5\n6\n40\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n1 2 0\n0 2 0\n9 9 9\n$EndNodes\n\
    $Elements\n4 4 1 4\n1 1 1 1\n1 1 2\n1 2 1 1\n2 4 3\n2 1 3 1\n3 1 2 3 4\n2 2 3 1\n4 4 6 5 3\n$EndElements\n";
const TWO_OLD: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n1 7 \"low side\"\n1 8 \"seam\"\n2 5 \"steel\"\n2 6 \"rubber\"\n$EndPhysicalNames\n\
    $Nodes\n7\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 1 2 0\n6 0 2 0\n40 9 9 9\n$EndNodes\n\
    $Elements\n4\n1 1 2 7 1 1 2\n2 1 2 8 2 4 3\n3 3 2 5 1 1 2 3 4\n4 3 2 6 2 4 6 5 3\n$EndElements\n";

/// A quarter of a tube in prisms: volumes of cells, areas of faces, places of nodes and shape functions are Gmsh's own, curved sides included; the order of
/// the nodes in other programs is VTK's (`meshes/prisms.py` wrote the numbers).
#[test]
fn prisms_are_those_of_gmsh() {
    let text = std::fs::read_to_string(root().join("tests/reference/meshes/prisms.json")).unwrap();
    let known: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    let point = |v: &serde_json::Value| [0, 1, 2].map(|c| number(&v[c]));
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-14);
    for kind in [ElementKind::Prism6, ElementKind::Prism15, ElementKind::Prism18] {
        let own = &known["elements"][kind.name()];
        assert_eq!(own["number"], kind.gmsh().0);
        for (k, &place) in shape::places(kind).iter().enumerate() {
            assert!(near(place, point(&own["places"][k])), "{kind:?} {k}");
        }
        for (j, at) in own["at"].as_array().unwrap().iter().enumerate() {
            let (values, slopes) =
                (shape::values(kind, point(at)), shape::gradients(kind, point(at)));
            for k in 0..kind.nodes() {
                assert!((values[k] - number(&own["values"][j][k])).abs() < 1e-14, "{kind:?} {k}");
                assert!(near(slopes[k], point(&own["gradients"][j][k])), "{kind:?} {k}");
            }
        }
        let vtk = &known["vtk"][kind.name()];
        assert_eq!(vtk["number"], kind.vtk());
        let order = kind.ordered(&(0..kind.nodes()).collect::<Vec<_>>());
        for (k, &n) in order.iter().enumerate() {
            let [x, y, z] = shape::places(kind)[n as usize];
            assert!(near([x, y, 0.5 * (z + 1.0)], point(&vtk["places"][k])), "{kind:?} {k}");
        }
        let name = kind.name().to_lowercase();
        let (file, known) = (imported(&format!("{name}.msh")), &known["meshes"][&name]);
        let mesh = &file.mesh;
        assert_eq!(known["cells"], mesh.n_elements());
        assert_eq!(known["nodes"], mesh.n_nodes());
        let material = Material { young: 1.0, poisson: 0.3, density: 2.0, state: SOLID };
        for (e, tag) in mesh.elements().zip(&file.cell_tags[0]) {
            assert_eq!(e.kind, kind);
            let volume = Shape { kind, x: &mesh.corners(e) }.volume(&material);
            let exact = number(&known["volumes"][tag.to_string()]);
            assert!((volume / exact - 1.0).abs() < 1e-13, "{kind:?} {tag}: {volume} {exact}");
        }
        let areas = known["areas"].as_object().unwrap();
        assert_eq!(areas.len(), 6);
        for (group, area) in areas {
            let of_side = |&f: &signorini::mesh::Facet| -> f64 {
                let e = mesh.element(f);
                let points = Shape { kind, x: &mesh.corners(e) }.side(f.side);
                points.iter().map(|p| p.area).sum()
            };
            let found: f64 = mesh.group(group).iter().map(of_side).sum();
            // of a curved face a root of polynomials, by three points along each edge
            let within = if kind.is_quadratic() { 1e-5 } else { 1e-13 };
            let off = (found / number(area) - 1.0).abs();
            assert!(off < within, "{kind:?} {group}: {found} {area}");
        }
    }
}

#[test]
fn both_formats_say_the_same() {
    let of = |text: &str| read(text.as_bytes()).unwrap().body(0.5, &[]).unwrap();
    let (new, old) = (of(TWO), of(TWO_OLD));
    assert_eq!(new, old);
    assert_eq!(new.regions, [["steel"], ["rubber"]]);
    assert_eq!(
        (new.mesh.n_nodes(), new.unused, new.node_tags.as_slice()),
        (6, 1, &[1, 2, 3, 4, 5, 6][..])
    );
    assert_eq!(new.cell_tags, [[3], [4]]);
    assert_eq!(new.mesh.size(), [0.5, 1.0, 0.0]);
    assert!(matches!(&new.sides["low side"], Sides::Boundary(facets) if facets.len() == 1));
    assert_eq!(new.mesh.group_nodes("low side"), [0, 1]);
    // between two cells
    assert_eq!(new.sides["seam"], Sides::Elsewhere { nodes: vec![4, 3], owners: 2 });
    assert!(new.mesh.group("seam").is_empty());
    // the second square goes round the other way, and is turned
    let material = Material::plate(1.0, 0.3, 1.0, 1.0);
    let dofs = DofMap::new(&new.mesh, &[], &[]).unwrap();
    let body = Body::assemble(new.mesh, dofs, &[material, material], MassForm::Consistent);
    assert!((body.nodal_mass().iter().sum::<f64>() - 0.5).abs() < 1e-15);
}

#[test]
fn what_cannot_be_read_is_refused_with_its_reason() {
    let error = |text: &str| -> GmshError {
        match read(text.as_bytes()).and_then(|f| f.body(1.0, &[])) {
            Ok(_) => panic!("read: {text}"),
            Err(e) => e,
        }
    };
    let changed = |from: &str, to: &str| {
        assert!(TWO.contains(from), "{from}");
        TWO.replacen(from, to, 1)
    };
    let old = |from: &str, to: &str| {
        assert!(TWO_OLD.contains(from), "{from}");
        TWO_OLD.replacen(from, to, 1)
    };
    for (text, words) in [
        (String::new(), "is no mesh of Gmsh"),
        ("*Heading\n*Node\n1, 0, 0\n".into(), "gmsh IN -save"),
        (changed("4.1 0 8", "4.1 1 8"), "is binary"),
        (changed("4.1 0 8", "4.0 0 8"), "4.1 and 2.2 are read"),
        (changed("4.1 0 8", ""), "line 2"),
        (TWO[..TWO.find("$Nodes").unwrap()].into(), "no section $Nodes"),
        (TWO[..TWO.find("$Elements").unwrap()].into(), "no section $Elements"),
        (TWO[..TWO.len() - 30].into(), "does not end"),
        (changed("$EndNodes\n", ""), "before $EndNodes"),
        (changed("1 7 1 40\n", "1 8 1 40\n"), "8 nodes are announced, 7 are there"),
        (changed("2 1 0 7\n", "2 1 0 8\n"), "where a coordinate is expected"),
        (changed("2 1 0 7\n", "2 1 0 6\n"), "goes on with"),
        (changed("1 2 0\n", "1 two 0\n"), "\"two\" where a coordinate is expected"),
        (changed("1 2 0\n", "1 nan 0\n"), "the coordinate NaN is none"),
        (changed("1 2 0\n", "1 1e300 0\n"), "is none"),
        (changed("1 2 0\n", "1 2 0.1\n"), "node 5 is not in the plane"),
        (changed("1\n2\n3\n", "1\n2\n2\n"), "node 2 is there twice"),
        (changed("4 4 6 5 3\n", "4 4 6 5 77\n"), "element 4 has node 77"),
        (changed("4 4 6 5 3\n", "4 4 6 3 5\n"), "element 4 is degenerate or folded"),
        (changed("4 4 6 5 3\n", "4 4 6 5 5\n"), "element 4 is degenerate or folded"),
        (changed("2 2 3 1\n4 4 6 5 3\n", "2 2 21 1\n4 4 6 5 3\n"), "elements of type 21"),
        (
            changed("2 2 3 1\n4 4 6 5 3\n", "2 2 9 1\n4 4 6 5 3 1 2\n"),
            "first and second order are mixed",
        ),
        (changed("2 2 3 1\n4 4 6 5 3\n", "3 2 4 1\n4 4 6 5 3\n"), "degenerate or folded"),
        (
            changed("4 4 1 4\n", "2 2 1 4\n")
                .replace("2 1 3 1\n3 1 2 3 4\n2 2 3 1\n4 4 6 5 3\n", ""),
            "mesh the surface or the volume too",
        ),
        (changed("4 4 1 4\n", "4 400000000000 1 4\n"), "more than can be held"),
        (changed("1 7 \"low side\"", "1 seven \"low side\""), "line 6, $PhysicalNames"),
        (changed("1 7 \"low side\"", "1 7 low side"), "quotation marks"),
        (changed("0 2 2 0\n", "0 2 3 0\n"), "$Entities"),
        (old("7\n1 0 0 0", "8\n1 0 0 0"), "where the tag of a node is expected"),
        (old("3 3 2 5 1 1 2 3 4", "3 3 2 5 1 1 2 3"), "$Elements: ends where"),
        (old("4\n1 1 2 7", "5\n1 1 2 7"), "ends where"),
    ] {
        let e = error(&text);
        assert!(e.to_string().contains(words), "{e}\nnot: {words}");
        assert!(!e.help.is_empty() && !e.to_string().contains('\n'));
    }
    // damaged anywhere: refused or read, never a panic
    for cut in 0..TWO.len() {
        let _ = read(&TWO.as_bytes()[..cut]).and_then(|f| f.body(1.0, &[]));
        let mut bytes = TWO.as_bytes().to_vec();
        bytes[cut] = b'9';
        let _ = read(&bytes).and_then(|f| f.body(1.0, &[]));
        bytes[cut] = 0xff;
        let _ = read(&bytes).and_then(|f| f.body(1.0, &[]));
    }
}

#[test]
fn inspect_tells_what_is_in_a_mesh() {
    let at = |name: &str| root().join("tests/reference/meshes").join(name).display().to_string();
    let found = crate::common::json(&["inspect", &at("t6_plate.msh")]);
    assert_eq!(found["format"], "4.1");
    assert_eq!(found["body"]["cells"], 22);
    assert_eq!(found["body"]["size"], serde_json::json!([1.0, 0.5, 0.0]));
    let least = found["body"]["quality"]["least"].as_f64().unwrap();
    assert!((0.3..1.0).contains(&least), "{least}");
    assert_eq!(found["groups"].as_array().unwrap().len(), 5);
    assert_eq!(found["groups"][0]["on_boundary"], true);
    let text = String::from_utf8(crate::common::run(&["inspect", &at("q4_distorted.msh")]).stdout)
        .unwrap();
    for words in [
        "18 × quadrilateral of 4 nodes",
        "\"right\" (lines, #3)",
        "for supports, loads, contact",
        "1.00000 × 0.500000",
    ] {
        assert!(text.contains(words), "{text}");
    }
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join("d.msh");
    std::fs::write(&damaged, &TWO.as_bytes()[..300]).unwrap();
    let output = crate::common::run(&["inspect", damaged.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    // a mesh that is no body: what is in it, and why it is none
    std::fs::write(&damaged, TWO.replace("2 2 3 1\n4 4 6 5 3\n", "3 2 4 1\n4 4 6 5 3\n")).unwrap();
    let found = crate::common::json(&["inspect", damaged.to_str().unwrap()]);
    assert!(found["error"].as_str().unwrap().contains("degenerate"), "{found}");
    let text = crate::common::run(&["inspect", &at("hex8_box.msh")]).stdout;
    let text = String::from_utf8(text).unwrap();
    for words in [
        "16 × hexahedron of 8 nodes",
        "\"xmax\" (surface, #3)",
        "faces, 8 of them sides of the boundary",
        "1.00000 × 0.500000 × 0.500000",
    ] {
        assert!(text.contains(words), "{text}");
    }
}

/// Stress and inertia on the meshes of the prototype: boundary operator, open frequencies, and the motion from `u = (−x(1 + y/10), 3xy/100)` at rest before a
/// gap of 0.3 on the right, over 8 units of time; in space with `xz/50` as the third component.
#[test]
fn contact_on_meshes_is_that_of_the_prototype() {
    use Inertia::{Constant, Paper};
    use Stress::{NodalMean, Projection, Reaction};
    for (name, state, stress, first, operator, open, runs) in [
        (
            "t3_plate.msh",
            STRESS,
            NodalMean,
            4.1639654625,
            [11.0641822420, 11.5010437774],
            [0.4680744243, 1.5911682274, 1.8445901413],
            [
                (Paper, [0.2462721694, 1.2543138933, 16.0, 0.1910165844, 1.1754275491]),
                (Constant, [0.2462721694, 1.2543138933, 18.0, 0.2462721694, 1.3765394989]),
            ],
        ),
        (
            "t3_plate.msh",
            STRESS,
            Reaction,
            6.9229350201,
            [15.1714997869, 14.0032608243],
            [0.4679606923, 1.5907385575, 1.8382672219],
            [
                (Paper, [0.2460315193, 1.2652678950, 16.0, 0.1947938912, 1.2390883621]),
                (Constant, [0.2460315193, 1.2652678950, 17.0, 0.2460315193, 1.4191133384]),
            ],
        ),
        (
            "t6_plate.msh",
            STRESS,
            NodalMean,
            9.4791829307,
            [33.7220915098, 45.2037492059],
            [0.4364137015, 1.5789117546, 1.6740181250],
            [
                (Paper, [0.2691653922, 1.2676810063, 22.0, 0.2584570647, 1.4755773129]),
                (Constant, [0.2691653922, 1.2676810063, 22.0, 0.2691653922, 1.5441513193]),
            ],
        ),
        (
            "t6_plate.msh",
            STRESS,
            Reaction,
            14.8700499199,
            [34.7108002685, 41.7523363254],
            [0.4364115489, 1.5792191805, 1.6740983849],
            [
                (Paper, [0.2663198672, 1.2748536392, 22.0, 0.2502088889, 1.4729069713]),
                (Constant, [0.2663198672, 1.2748536392, 24.0, 0.2663198672, 1.5464808134]),
            ],
        ),
        (
            "q4_distorted.msh",
            STRAIN,
            Projection,
            7.6030733301,
            [16.8216340565, 21.4481394039],
            [0.4758423232, 1.6795310846, 1.8433816342],
            [
                (Paper, [0.2963821455, 1.1835758308, 21.0, 0.2246000739, 1.3934515727]),
                (Constant, [0.2963821455, 1.1835758308, 20.0, 0.2963821455, 1.8584826675]),
            ],
        ),
        (
            "q4_distorted.msh",
            STRAIN,
            Reaction,
            7.2507412560,
            [15.2268561276, 13.9663744525],
            [0.4758045543, 1.6786583099, 1.8405893705],
            [
                (Paper, [0.2960832773, 1.1895471137, 20.0, 0.2068231357, 1.4304921362]),
                (Constant, [0.2960832773, 1.1895471137, 20.0, 0.2960832773, 1.8938845168]),
            ],
        ),
        (
            "hex8_box.msh",
            SOLID,
            Projection,
            5.4132208143,
            [16.5345325321, 23.3417080292],
            [0.4814527814, 0.4860663334, 0.9965147128],
            [
                (Paper, [0.1323481240, 1.2000535997, 56.0, 0.0729229754, 1.0513255169]),
                (Constant, [0.1323481240, 1.2000535997, 45.0, 0.1323481240, 1.5097578324]),
            ],
        ),
        (
            "hex8_box.msh",
            SOLID,
            Reaction,
            4.0845598357,
            [12.0602649909, 11.1089269422],
            [0.4809580193, 0.4855478495, 0.9964185608],
            [
                (Paper, [0.1321730469, 1.2081596933, 39.0, 0.0826399798, 0.9272348628]),
                (Constant, [0.1321730469, 1.2081596933, 45.0, 0.1321730469, 1.3491453628]),
            ],
        ),
    ] {
        let file = imported(name);
        let material = Material { young: 1.0, poisson: 0.3, density: 1.0, state };
        let dim = file.mesh.dim();
        let (facing, tag) = if dim == 3 { ("xmax", 5) } else { ("right", 2) };
        for (inertia, [e0, t1, switches, end, norm]) in runs {
            let dofs = DofMap::new(&file.mesh, &clamped(dim), &[Facing::surface(facing)]).unwrap();
            let body = Body::assemble(file.mesh.clone(), dofs, &[material], MassForm::Consistent);
            let (n_o, n_c) = (body.dofs.n_o, body.dofs.n_c);
            // the first contact node of the prototype is that with the lowest tag
            let node = file.node_tags.iter().position(|t| *t == tag).unwrap();
            let i = body.dofs.contact.iter().position(|c| c.node == node).unwrap();
            let contacts = Contacts { gaps: Gaps::front(vec![0.3; n_c]), lumped: false };
            let mass = if inertia == Paper { MassChoice::Paper } else { MassChoice::Condensed };
            let system = System::new(body, &contacts, (stress, mass)).unwrap();
            let conditions = system.conditions();
            let near = |found: f64, exact: f64, most: f64, what: &str| {
                let off = (found / exact - 1.0).abs();
                assert!(off < most, "{name} {stress:?} {inertia:?}, {what}: {found} {exact}");
            };
            near(conditions.n_c[(i, i)], first, 1e-8, "N_C");
            near(conditions.n_c.dense().norm(), operator[0], 1e-8, "|N_C|");
            let square: f64 = conditions.n_o.triplets().map(|t| t.2 * t.2).sum();
            near(square.sqrt(), operator[1], 1e-8, "|N_O|");
            let modes = phase_modes(&system, &system.phase(&States::open(n_c)), 3).unwrap();
            for (w, exact) in modes.omega.iter().zip(open) {
                near(*w, exact, 1e-8, "open frequency");
            }
            let u: Vec<f64> = file
                .mesh
                .nodes()
                .iter()
                .map(|[x, y, z]| [-x * (1.0 + 0.1 * y), 0.03 * x * y, 0.02 * x * z])
                .flat_map(|u| u.into_iter().take(dim))
                .collect();
            let u = system.body.dofs.gather(&u)[..n_o].to_vec();
            let initial = State { v: vec![0.0; u.len()], u };
            let report = crate::common::event_driven(&system, &initial, 8.0, Integrator::Modal);
            near(report.energy_start, e0, 1e-7, "energy at the start");
            near(report.switches[0].t, t1, 1e-8, "first switch");
            assert_eq!(report.switches.len() as f64, switches, "{name} {stress:?} {inertia:?}");
            near(report.energy_end, end, 1e-7, "energy at the end");
            let size = report.last.u.iter().map(|x| x * x).sum::<f64>().sqrt();
            near(size, norm, 1e-7, "norm at the end");
        }
    }
}

#[test]
fn a_projected_stress_on_triangles_is_refused() {
    for name in ["t3_plate.msh", "t6_plate.msh"] {
        let file = imported(name);
        let dofs = DofMap::new(&file.mesh, &clamped(2), &[Facing::surface("right")]).unwrap();
        let material = Material::plate(1.0, 0.3, 1.0, 1.0);
        let body = Body::assemble(file.mesh, dofs, &[material], MassForm::Consistent);
        let gap = vec![0.3; body.dofs.n_c];
        let contacts = Contacts { gaps: Gaps::front(gap), lumped: false };
        let refused = System::new(body, &contacts, (Stress::Projection, MassChoice::Paper));
        assert!(matches!(refused, Err(ContactError::NotPMatrix { .. })), "{name}");
    }
}
