//! Surfaces that slide over each other by themselves: a disc and its pad, where they stand.

use crate::common::cuboid::cuboid;
use crate::common::rectangle::msh;
use crate::common::{problem, relative, run_by, scene};

use signorini::event::Report;
use signorini::mesh::ElementKind;
use signorini::scenario::{Integrator, Scene};

fn plate(name: &str, elements: [usize; 2], place: &str) -> String {
    format!(
        "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = [0.8, 0.6]\nelements = {elements:?}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{place}\n"
    )
}

const RUN: &str = "[damping]\nrayleigh = [0.05, 0.01]\n[run]\nuntil = 8.0\nsamples = 1\n";

fn same(one: &Report, two: &Report, off: f64) {
    assert_eq!(one.switches.len(), two.switches.len());
    for (a, b) in one.switches.iter().zip(&two.switches) {
        assert!((a.t - b.t).abs() < off && a.kind == b.kind, "{} {}", a.t, b.t);
    }
    assert!((one.energy_end / two.energy_end - 1.0).abs() < off);
    let [one, two] = [one, two].map(|r| r.rubbed.as_ref().unwrap());
    assert!((one.belt / two.belt - 1.0).abs() < off, "{} {}", one.belt, two.belt);
    assert!((one.work() / two.work() - 1.0).abs() < off, "{} {}", one.work(), two.work());
}

fn sticks_and_slips(report: &Report) {
    let kinds: std::collections::BTreeSet<&str> =
        report.switches.iter().map(|s| s.kind.name()).collect();
    assert!(kinds.contains("sticking") && kinds.contains("slipping"), "{kinds:?}");
}

/// A master whose nodes are all held is a rigid belt.
#[test]
fn a_held_master_is_a_belt() {
    let thrown = "[initial]\nvelocity = ['0.1*x', '0.05*x']\n";
    let one = format!(
        "[body]\nkind = 'plate'\nsize = [0.8, 0.6]\nelements = [4, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
         [contact]\nedge = 'right'\ngap = -0.02\nfriction = 0.3\nsurface = [0.0, 0.1]\n{thrown}{RUN}"
    );
    let two = plate("a", [4, 3], "")
        + &plate("b", [3, 2], "move = [0.8, 0.0]")
        + "[[support]]\nedge = 'a:left'\nfix = ['x', 'y']\n[[support]]\nedge = 'b:left'\nfix = ['x', 'y']\n\
           [[contact]]\nslave = 'a:right'\nmaster = 'b:left'\ngap = -0.02\npress = true\nfriction = 0.3\nsurface = [0.0, 0.1]\n\
           [initial]\nvelocity = { a = ['0.1*x', '0.05*x'] }\n"
        + RUN;
    let [one, two] = [one, two].map(|text| run_by(&scene(&text), Integrator::Modal));
    sticks_and_slips(&one);
    assert!(one.rubbed.as_ref().unwrap().belt.abs() > 1e-3);
    same(&one, &two, 1e-9);
}

fn pressed(pair: &str, speed: f64, elements: [[usize; 2]; 2]) -> Scene {
    scene(
        &(plate("a", elements[0], "")
            + &plate("b", elements[1], "move = [0.8, 0.0]")
            + &format!(
                "[[support]]\nedge = 'a:left'\nfix = ['x', 'y']\n[[support]]\nedge = 'b:right'\nfix = ['x', 'y']\n\
                 [[contact]]\n{pair}\ngap = -0.02\npress = true\nfriction = 0.3\nsurface = [0.0, {speed:?}]\n\
                 [initial]\nvelocity = {{ a = ['0.1*x', '0.05*x'] }}\n{RUN}"
            )),
    )
}

/// Whose surface slides, the slave's or the master's, is the sign of the velocity; between two elastic bodies its energy closes.
#[test]
fn sliding_surfaces_change_roles_with_their_sign() {
    let (ab, ba) = ("slave = 'a:right'\nmaster = 'b:left'", "slave = 'b:left'\nmaster = 'a:right'");
    let matching = [[4, 3], [4, 3]];
    let one = run_by(&pressed(ab, 0.1, matching), Integrator::Modal);
    let two = run_by(&pressed(ba, -0.1, matching), Integrator::Modal);
    sticks_and_slips(&one);
    same(&one, &two, 1e-9);
    let uneven = pressed(ab, 0.1, [[4, 3], [3, 4]]);
    let exact = run_by(&uneven, Integrator::Modal);
    sticks_and_slips(&exact);
    assert!(exact.energy_drift_total < 1e-10, "{}", exact.energy_drift_total);
    let steps = run_by(&uneven, Integrator::Dop853);
    assert_eq!(exact.switches.len(), steps.switches.len());
    assert!(relative(&exact.last.u, &steps.last.u) < 1e-7);
    // two elastic bodies: the surface brakes one and drives the other
    let still = run_by(&pressed(ab, 0.0, [[4, 3], [3, 4]]), Integrator::Modal);
    assert!(relative(&exact.last.u, &still.last.u) > 0.05);
}

/// In space too: a block before a sliding face of a held block, and before a sliding wall.
#[test]
fn in_space_a_held_master_is_a_belt() {
    let folder = tempfile::tempdir().unwrap();
    for (name, cells) in [("a", [3, 2, 2]), ("b", [2, 3, 3])] {
        let mesh = cuboid(ElementKind::Hex8, [0.6, 0.4, 0.4], cells, 0.0);
        std::fs::write(folder.path().join(format!("{name}.msh")), msh(&mesh, |_| 0)).unwrap();
    }
    let file = |name: &str| format!("{:?}", folder.path().join(format!("{name}.msh")));
    let material =
        |group: &str| format!("[[material]]\n{group}young = 1.0\npoisson = 0.3\ndensity = 1.0\n");
    let one = format!(
        "[body]\nkind = 'mesh'\nfile = {}\n{}[[support]]\ngroup = 'xmin'\nfix = ['x', 'y', 'z']\n\
         [[contact]]\ngroup = 'xmax'\ngap = -0.02\nfriction = 0.3\nsurface = [0.0, 0.3, 0.1]\n[initial]\nvelocity = ['0.1*x', '0', '0']\n{RUN}",
        file("a"),
        material("")
    );
    let two = format!(
        "[[body]]\nname = 'a'\nkind = 'mesh'\nfile = {}\n[[body]]\nname = 'b'\nkind = 'mesh'\nfile = {}\nmove = [0.6, 0.0, 0.0]\n{}{}\
         [[support]]\ngroup = 'a:xmin'\nfix = ['x', 'y', 'z']\n[[support]]\ngroup = 'b:xmin'\nfix = ['x', 'y', 'z']\n\
         [[contact]]\nslave = 'a:xmax'\nmaster = 'b:xmin'\ngap = -0.02\npress = true\nfriction = 0.3\nsurface = [0.0, 0.3, 0.1]\n\
         [initial]\nvelocity = {{ a = ['0.1*x', '0', '0'] }}\n{RUN}",
        file("a"),
        file("b"),
        material("group = 'a'\n"),
        material("group = 'b'\n")
    );
    let [one, two] = [one, two].map(|text| run_by(&scene(&text), Integrator::Modal));
    assert!(one.switches.len() > 3, "{}", one.switches.len());
    same(&one, &two, 1e-9);
}

/// Across the surface nothing slides.
#[test]
fn a_surface_slides_along_itself() {
    let text = plate("a", [4, 3], "")
        + &plate("b", [3, 2], "move = [0.8, 0.0]")
        + "[[support]]\nedge = 'a:left'\nfix = ['x', 'y']\n[[support]]\nedge = 'b:right'\nfix = ['x', 'y']\n[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\nfriction = 0.3\nsurface = [0.1, 0.1]\n[run]\nuntil = 1.0\n";
    let refused = signorini::problem::Problem::new(&scene(&text), None).err().unwrap().to_string();
    assert!(refused.contains("along its normal"), "{refused}");
    assert!(problem(&text.replace("[0.1, 0.1]", "[0.0, 0.1]")).system.tangents().is_some());
}
