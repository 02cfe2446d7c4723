//! Bodies from files, springs.

use std::path::Path;

use nalgebra::DMatrix;
use signorini::contact::{States, System};
use signorini::mesh::ElementKind;
use signorini::problem::Problem;
use signorini::scenario::Scene;

use super::dense;
use crate::common::rectangle::{msh, rectangle};
use crate::common::{bar, problem};

fn written(place: &Path, name: &str, a: &DMatrix<f64>) {
    let mut text =
        format!("%%MatrixMarket matrix array real general\n{} {}\n", a.nrows(), a.ncols());
    a.iter().for_each(|v| text.push_str(&format!("{v:?}\n")));
    std::fs::write(place.join(name), text).unwrap();
}

fn of_files(place: &Path, tables: &str) -> Result<Problem, String> {
    let text = format!(
        "[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n{tables}"
    );
    let scene = Scene::parse(&text, &place.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
    Problem::new(&scene, None).map_err(|e| e.to_string())
}

/// `given.rs`: rows of files in the order of `u = (u_O, u_C)`, gaps one by one; `damping.rs`: `α`, `β` of a matrix that is `αM + βK`, and no other.
#[test]
fn matrices_of_files_are_put_in_order() {
    let place = tempfile::tempdir().unwrap();
    let m = DMatrix::from_row_slice(
        4,
        4,
        &[2.0, 0.1, 0.0, 0.2, 0.1, 3.0, 0.3, 0.0, 0.0, 0.3, 4.0, 0.4, 0.2, 0.0, 0.4, 5.0],
    );
    let k = DMatrix::from_row_slice(
        4,
        4,
        &[5.0, -1.0, 0.0, -0.5, -1.0, 6.0, -2.0, 0.0, 0.0, -2.0, 7.0, -3.0, -0.5, 0.0, -3.0, 8.0],
    );
    written(place.path(), "M.mtx", &m);
    written(place.path(), "K.mtx", &k);
    let contact = "[contact]\ndisplacements = [2, 0]\ngaps = [0.3, 0.7]\nstress = 'reaction'\n";
    let p = of_files(place.path(), contact).unwrap();
    // free rows 1 and 3 in their order, then the contact rows as they are named
    let order = [1, 3, 2, 0];
    let (found_m, found_k) = (dense(&p.system.body.mass), dense(&p.system.body.stiffness));
    for i in 0..4 {
        for j in 0..4 {
            assert_eq!(found_m[(i, j)], m[(order[i], order[j])]);
            assert_eq!(found_k[(i, j)], k[(order[i], order[j])]);
        }
    }
    assert_eq!(p.system.constraints.iter().map(|c| c.gap).collect::<Vec<_>>(), [0.3, 0.7]);
    for (alpha, beta) in [(0.3, 0.02), (0.0, 0.02), (0.3, 0.0), (1e-6, 10.0)] {
        written(place.path(), "C.mtx", &(alpha * &m + beta * &k));
        let text = contact.replace("[contact]", "damping_matrix = 'C.mtx'\n[contact]");
        let found = of_files(place.path(), &text).unwrap().system.damping.unwrap();
        let off = (found.alpha - alpha).abs().max((found.beta - beta).abs());
        assert!(off < 1e-9 * (alpha + beta), "{alpha} {beta}: {found:?}");
    }
    let mut other = 0.3 * &m;
    other[(0, 0)] += 0.1;
    written(place.path(), "C.mtx", &other);
    let text = contact.replace("[contact]", "damping_matrix = 'C.mtx'\n[contact]");
    assert!(of_files(place.path(), &text).unwrap_err().contains("left over"));
    let force = "[[load]]\nkind = 'force'\ndisplacement = 3\namplitude = 0.7\n[[load]]\nkind = 'force'\namplitude = [1.0, 2.0, 3.0, 4.0]\n";
    let p = of_files(place.path(), &contact.replace("[contact]", &format!("{force}[contact]")))
        .unwrap();
    let mut found = vec![0.0; 4];
    p.system.loads.at(0.0, &mut found);
    assert_eq!(found, [2.0, 4.0 + 0.7, 3.0, 1.0]);
    // what is not symmetric, or of another size, is refused
    let mut skew = k.clone();
    skew[(0, 1)] = 3.0;
    written(place.path(), "K.mtx", &skew);
    assert!(of_files(place.path(), contact).unwrap_err().contains("not symmetric"));
    written(place.path(), "K.mtx", &k.clone().remove_row(3).remove_column(3));
    assert!(of_files(place.path(), contact).unwrap_err().contains("3 × 3"));
}

/// `imported.rs`: every cell has the material of its group, sides are where the file puts them.
#[test]
fn materials_of_a_mesh_go_to_their_groups() {
    let place = tempfile::tempdir().unwrap();
    let mesh = rectangle(ElementKind::Quad4, [0.0, 2.0], 1.0, (4, 2), 0.0);
    // a second group right of the middle
    let text = msh(&mesh, |p| usize::from(p[0] > 1.0));
    let named = text.replace("10 \"body\"", "10 \"near\"\n2 11 \"far\"");
    let count: usize =
        text.lines().skip_while(|l| *l != "$PhysicalNames").nth(1).unwrap().parse().unwrap();
    let named = named.replacen(
        &format!("$PhysicalNames\n{count}\n"),
        &format!("$PhysicalNames\n{}\n", count + 1),
        1,
    );
    std::fs::write(place.path().join("body.msh"), named).unwrap();
    let scene = "[body]\nkind = 'mesh'\nfile = 'body.msh'\nstate = 'plane stress'\nthickness = 0.5\n\
        [[material]]\ngroup = 'far'\nyoung = 3.0\npoisson = 0.2\ndensity = 7.0\n[[material]]\ngroup = 'near'\nyoung = 1.0\npoisson = 0.3\ndensity = 2.0\n\
        [[support]]\ngroup = 'left'\nfix = ['x', 'y']\n[contact]\ngroup = 'right'\ngap = 0.1\n";
    let read = |text: &str| Scene::parse(text, &place.path().join("scene.toml")).unwrap();
    let p = Problem::new(&read(scene), None).unwrap();
    let body = &p.system.body;
    for e in body.mesh.elements() {
        let x: f64 = e.nodes.iter().map(|&n| body.mesh.nodes()[n][0]).sum::<f64>() / 4.0;
        assert_eq!(body.materials()[e.region].density, if x > 1.0 { 7.0 } else { 2.0 });
    }
    let mass: f64 = body.scalar_mass().triplets().map(|t| t.2).sum();
    assert!((mass - 0.5 * (2.0 + 7.0)).abs() < 1e-12, "{mass}");
    assert!(p.system.constraints.iter().all(|c| c.position[0] == 2.0));
    assert_eq!(p.system.constraints.len(), 3);
    for (old, new, said) in [
        ("group = 'far'", "group = 'near'", "material"),
        ("group = 'right'", "group = 'nowhere'", "no group of sides"),
        ("state = 'plane stress'\nthickness = 0.5\n", "", "is missing"),
    ] {
        let error =
            Problem::new(&read(&scene.replacen(old, new, 1)), None).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

/// `springs.rs`: an obstacle of springs adds its stiffness to that of the body where it pushes, and `½ k d²` to the energy, on both sides where there are two.
#[test]
fn springs_push_where_the_body_has_passed_the_gap() {
    let text = |more: &str| {
        bar(4).replace(
            "[contact]\n",
            &format!("[contact]\nmethod = 'penalty'\nstiffness = 3.0\n{more}"),
        )
    };
    let one = problem(&text("")).system;
    assert_eq!((one.n_o(), one.n_contact()), (4, 1));
    let open = dense(&one.open_phase().matrices().0);
    let closed = dense(&one.phase(&States::closed(1)).matrices().0);
    let springs = closed - &open;
    let end = (0..4).find(|&j| springs[(j, j)] != 0.0).unwrap();
    let stiffness = springs[(end, end)];
    assert!((stiffness - 3.0 * 4.0).abs() < 1e-13, "{stiffness}");
    for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let expected = if (i, j) == (end, end) { stiffness } else { 0.0 };
        assert!((springs[(i, j)] - expected).abs() < 1e-13);
    }
    // the body alone is the bar: 4 elements of stiffness 4
    let of_bar = DMatrix::from_fn(4, 4, |i, j| match i.abs_diff(j) {
        0 => {
            if i == end {
                4.0
            } else {
                8.0
            }
        }
        1 => -4.0,
        _ => 0.0,
    });
    assert!((open - of_bar).norm() < 1e-12);
    // a body that is moved as a whole: strained at the support, and pressed by what is beyond the gap
    let energy = |system: &System, moved: f64| {
        let mut u = vec![moved; 4];
        u.resize(system.n(), 0.0);
        system.elastic(0.0, &u)
    };
    for (moved, pressed) in [(0.5, 0.0), (1.5, 0.5), (-1.5, 0.0)] {
        let expected = 0.5 * 4.0 * moved * moved + 0.5 * stiffness * pressed * pressed;
        assert!((energy(&one, moved) - expected).abs() < 1e-12);
    }
    let two = problem(&text("gap_behind = 0.4\n")).system;
    assert_eq!(two.constraints.iter().map(|c| c.gap).collect::<Vec<_>>(), [1.0, 0.4]);
    let [normal, ..] = two.obstacle_rows().unwrap();
    let normal = dense(normal);
    assert_eq!((normal[(0, end)], normal[(1, end)]), (1.0, -1.0));
    let expected = 0.5 * 4.0 * 1.5 * 1.5 + 0.5 * stiffness * 1.1 * 1.1;
    assert!((energy(&two, -1.5) - expected).abs() < 1e-12);
}
