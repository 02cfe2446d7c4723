//! Two bodies that meet, under relations that hold without another program: images, turns, other orders, momentum, files, reductions; and what is refused.

use crate::common::{Splitmix, json, problem, program, relative, run_by, scene};

use signorini::event::Report;
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::store::Stored;

/// A plate: name, size, elements, material, and where it stands.
fn plate(
    name: &str,
    size: [f64; 2],
    elements: [usize; 2],
    [e, nu, rho]: [f64; 3],
    place: &str,
) -> String {
    format!(
        "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = {size:?}\nelements = {elements:?}\nyoung = {e:?}\npoisson = {nu:?}\ndensity = {rho:?}\n{place}\n"
    )
}

fn hold(edge: &str) -> String {
    format!("[[support]]\nedge = '{edge}'\nfix = ['x', 'y']\n")
}

fn energy(report: &Report) -> f64 {
    report.energy_end
}

/// A body and its image meet as the body meets a wall half as far away: random plates, loads, dampings, stresses.
#[test]
fn images_meet_as_one_body_meets_a_wall() {
    let random = Splitmix::new(37);
    for case in 0..12 {
        let between =
            |a: f64, b: f64| a + (b - a) * (random.bits() >> 11) as f64 / (1u64 << 53) as f64;
        let (length, height) = (between(0.6, 1.4), between(0.3, 0.8));
        let elements = [3 + case % 3, 2 + case % 2];
        let material = [between(0.5, 2.0), between(0.0, 0.35), between(0.5, 2.0)];
        let (gap, speed, twist) = (between(0.03, 0.1), between(0.5, 1.0), between(-0.3, 0.3));
        let damping =
            ["", "[damping]\nrayleigh = [0.1, 0.0]\n", "[damping]\nrayleigh = [0.02, 0.01]\n"]
                [case % 3];
        let choice = [
            "stress = 'reaction'\ninertia = 'constant'\n",
            "stress = 'nodal-mean'\ninertia = 'constant'\n",
            "stress = 'projection'\ninertia = 'paper'\n",
            "method = 'mass-redistribution'\n",
        ][case % 4];
        let until = 6.0;
        let run = format!("{damping}[run]\nuntil = {until}\nsamples = 1\n");
        let single = format!(
            "[body]\nkind = 'plate'\nsize = {:?}\nelements = {elements:?}\nyoung = {:?}\npoisson = {:?}\ndensity = {:?}\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[contact]]\nedge = 'right'\ngap = {gap:?}\n{choice}[initial]\nvelocity = ['{speed:?}*x', '{twist:?}*x*y']\n{run}",
            [length, height],
            material[0],
            material[1],
            material[2]
        );
        let shift = 2.0 * length;
        let double = plate("a", [length, height], elements, material, "")
            + &plate(
                "b",
                [length, height],
                elements,
                material,
                &format!("mirror = 'x'\nmove = [{shift:?}, 0.0]"),
            )
            + &hold("a:left")
            + &hold("b:left")
            + &format!(
                "[[contact]]\nslave = 'a:right'\nmaster = 'b:right'\ngap = {:?}\n{choice}[initial]\nvelocity = {{ a = ['{speed:?}*x', '{twist:?}*x*y'], b = ['-{speed:?}*({shift:?}-x)', '{twist:?}*({shift:?}-x)*y'] }}\n{run}",
                2.0 * gap
            );
        let (one, two) = (
            run_by(&scene(&single), Integrator::Modal),
            run_by(&scene(&double), Integrator::Modal),
        );
        assert!(one.switches.len() >= 2, "case {case}");
        assert!(
            (energy(&two) / 2.0 / energy(&one) - 1.0).abs() < 1e-8,
            "case {case}: {} {}",
            energy(&two) / 2.0,
            energy(&one)
        );
        assert_eq!(one.switches.len(), two.switches.len(), "case {case}");
        for (a, b) in one.switches.iter().zip(&two.switches) {
            assert!((a.t - b.t).abs() < 1e-8 * until, "case {case}: {} {}", a.t, b.t);
        }
    }
}

/// A block thrown obliquely against another one; both fly. `turn` in degrees, `swap`: the other order of the tables.
fn thrown(turn: f64, swap: bool, friction: f64) -> String {
    let (sin, cos) = turn.to_radians().sin_cos();
    let at = |x: f64, y: f64| {
        format!("move = [{:?}, {:?}]\nturn = {turn:?}", cos * x - sin * y, sin * x + cos * y)
    };
    let first = plate("a", [0.8, 0.6], [5, 4], [1.0, 0.3, 1.0], &at(0.0, 0.0));
    let second = plate("b", [0.5, 0.4], [3, 3], [2.0, 0.2, 1.5], &at(0.9, 0.1));
    let bodies = if swap { second + &first } else { first + &second };
    let (vx, vy) = (cos * -0.5 - sin * 0.2, sin * -0.5 + cos * 0.2);
    bodies
        + &format!(
            "[[contact]]\nslave = 'b:left'\nmaster = 'a:right'\nfriction = {friction:?}\n[initial]\nvelocity = {{ b = ['{vx:?}', '{vy:?}'] }}\n[run]\nuntil = 2.5\nsamples = 1\n"
        )
}

/// `Σ M v` along both axes, and the friction taken.
fn momentum(text: &str) -> ([f64; 2], Report) {
    let scene = scene(text);
    let report = run_by(&scene, Integrator::Modal);
    let system = problem(text).system;
    let (mut v, mut p) = (vec![0.0; system.n()], vec![0.0; system.n()]);
    system.phase(&report.active).expand_velocity(report.t_end, &report.last.v, &mut v);
    system.mass().mul(&v, &mut p);
    let along = |axis: usize| {
        let nodes = system.body.mesh.n_nodes();
        let field: Vec<f64> = (0..2 * nodes).map(|k| f64::from(u8::from(k % 2 == axis))).collect();
        system.body.dofs.gather(&field).iter().zip(&p).map(|(a, b)| a * b).sum::<f64>()
    };
    ([along(0), along(1)], report)
}

#[test]
fn what_one_body_loses_the_other_has() {
    let mass = 0.5 * 0.4 * 1.5;
    for friction in [0.0, 0.4] {
        let ([x, y], report) = momentum(&thrown(0.0, false, friction));
        assert!((x + 0.5 * mass).abs() < 1e-12 && (y - 0.2 * mass).abs() < 1e-12, "{x} {y}");
        assert!(report.switches.len() > 6 && report.energy_drift_total < 1e-12);
        let taken = report.rubbed.as_ref().map_or(0.0, |r| r.work());
        assert_eq!(taken > 1e-5, friction > 0.0, "{taken}");
        // turned by 30 degrees, and the tables in another order, it is the same motion
        for (turn, swap) in [(30.0, false), (0.0, true), (-75.0, true)] {
            let (_, other) = momentum(&thrown(turn, swap, friction));
            assert_eq!(other.switches.len(), report.switches.len(), "{turn} {swap}");
            for (a, b) in report.switches.iter().zip(&other.switches) {
                assert!((a.t - b.t).abs() < 1e-9, "{turn} {swap}: {} {}", a.t, b.t);
            }
            let apart = (other.energy_end - report.energy_end).abs();
            assert!(apart < 1e-11, "{turn} {swap}: {apart:e}");
        }
        // by steps of Dormand and Prince, and without modes
        let by = |integrator| run_by(&scene(&thrown(0.0, false, friction)), integrator);
        let steps = by(Integrator::Dop853);
        assert!(relative(&report.last.u, &steps.last.u) < 1e-8);
        if friction == 0.0 {
            assert!(relative(&report.last.u, &by(Integrator::Chebyshev).last.u) < 1e-9);
        }
    }
}

/// Numbers in other units are the same numbers: lengths by 1e-3, stiffness by 2e11, density by 8e3.
#[test]
fn pairs_know_no_units() {
    let text = |l: f64, e: f64, rho: f64| {
        let t = l * (rho / e).sqrt();
        plate("a", [l, 0.5 * l], [4, 3], [e, 0.3, rho], "")
            + &plate(
                "b",
                [0.6 * l, 0.4 * l],
                [3, 2],
                [2.0 * e, 0.2, rho],
                &format!("move = [{:?}, {:?}]", 1.1 * l, 0.05 * l),
            )
            + &hold("a:left")
            + &format!(
                "[[contact]]\nslave = 'b:left'\nmaster = 'a:right'\n[initial]\nvelocity = {{ b = ['{:?}', '0'] }}\n[run]\nuntil = {:?}\nsamples = 1\n",
                -0.5 * l / t,
                3.0 * t
            )
    };
    let one = run_by(&scene(&text(1.0, 1.0, 1.0)), Integrator::Modal);
    let (l, e, rho) = (1e-3, 2e11, 8e3);
    let si = run_by(&scene(&text(l, e, rho)), Integrator::Modal);
    assert_eq!(one.switches.len(), si.switches.len());
    assert!((si.energy_end / (e * l * l) / one.energy_end - 1.0).abs() < 1e-9);
    let t = l * (rho / e).sqrt();
    assert!((si.switches[0].t / t - one.switches[0].t).abs() < 1e-10);
}

/// A file knows what its contact points are counted against; a run goes on from it; forces are rates of momentum.
#[test]
fn files_know_what_meets_what() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text =
        thrown(0.0, false, 0.0).replace("until = 2.5\nsamples = 1", "until = 2.5\nsamples = 400");
    std::fs::write(at("whole.toml"), &text).unwrap();
    let path = |name: &str| at(name).display().to_string();
    let said = json(&["run", &path("whole.toml"), "-q", "-o", &path("whole.h5")]);
    let stored = Stored::read(&at("whole.h5")).unwrap();
    let scene = scene(&text);
    let system = Problem::new(&scene, None).unwrap().system;
    let last = stored.t.len() - 1;
    for i in 0..system.n_contact() {
        assert!(stored.meets(i));
        let gap = stored.gap[i] - stored.contact_displacement(last, i);
        let first = stored.gap[i] - stored.contact_displacement(0, i);
        assert!((first - 0.1).abs() < 1e-12 && gap > -1e-12, "{first} {gap}");
        let closed = (0..=last).filter(|&row| stored.active[(row, i)] == 1);
        for row in closed {
            assert!((stored.gap[i] - stored.contact_displacement(row, i)).abs() < 1e-12);
        }
    }
    // what b gets is what it has gained
    let force = &said["forces"][0];
    assert_eq!(force["group"], "b:left");
    let impulse = force["impulse"][0].as_f64().unwrap();
    let (mass, nodes) = (0.5 * 0.4 * 1.5, system.body.mesh.nodes());
    let parts = system.body.mesh.parts();
    let phase = system.phase(&run_by(&scene, Integrator::Modal).active);
    let report = run_by(&scene, Integrator::Modal);
    let (mut v, mut p) = (vec![0.0; system.n()], vec![0.0; system.n()]);
    phase.expand_velocity(2.5, &report.last.v, &mut v);
    system.mass().mul(&v, &mut p);
    let of_b: Vec<f64> = (0..2 * nodes.len())
        .map(|k| f64::from(u8::from(k % 2 == 0 && parts[k / 2] == 1)))
        .collect();
    let after: f64 = system.body.dofs.gather(&of_b).iter().zip(&p).map(|(a, b)| a * b).sum();
    assert!((impulse - (after + 0.5 * mass)).abs() < 1e-4, "{impulse} {}", after + 0.5 * mass);
    // the last state of a first half is where the second half begins
    std::fs::write(at("half.toml"), text.replace("until = 2.5", "until = 1.0")).unwrap();
    json(&["run", &path("half.toml"), "-q", "-o", &path("half.h5")]);
    let (head, _) = text.split_once("[initial]").unwrap();
    std::fs::write(
        at("rest.toml"),
        format!("{head}[initial]\nfile = 'half.h5'\n[run]\nuntil = 1.5\nsamples = 1\n"),
    )
    .unwrap();
    let rest = json(&["run", &path("rest.toml"), "-q", "-o", &path("rest.h5")]);
    let (a, b) = (said["energy_end"].as_f64().unwrap(), rest["energy_end"].as_f64().unwrap());
    assert!((a - b).abs() < 1e-12);
    let again = Stored::read(&at("rest.h5")).unwrap();
    for n in 0..nodes.len() {
        let off = (0..2).map(|c| {
            (stored.displacement(last, n)[c] - again.displacement(again.t.len() - 1, n)[c]).abs()
        });
        assert!(off.fold(0.0, f64::max) < 1e-9);
    }
    let kept = text.replace("samples = 400", "samples = 40\nstore = 'contact'");
    std::fs::write(at("kept.toml"), kept).unwrap();
    json(&["run", &path("kept.toml"), "-q", "-o", &path("kept.h5")]);
    let kept = Stored::read(&at("kept.h5")).unwrap();
    assert!(kept.contact_displacement(3, 0).is_finite());
}

/// Shot, balanced and reduced, a forced response of two bodies is one.
#[test]
fn families_of_two_bodies() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = "[[body]]\nname = 'a'\nkind = 'bar'\nsize = [1.0]\nelements = [8]\nyoung = 1.0\ndensity = 1.0\n[[body]]\nname = 'b'\nkind = 'bar'\nsize = [0.7]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\nmove = [1.5]\n\
        [[support]]\nedge = 'a:left'\nfix = ['x']\n[[support]]\nedge = 'b:right'\nfix = ['x']\n[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\n\
        [damping]\nrayleigh = [0.02, 0.02]\n[[load]]\nkind = 'point'\nat = [0.5]\namplitude = 0.3\nomega = 1.7\n[orbit]\nomega = 1.7\nrange = [1.6, 1.8]\n";
    std::fs::write(path("bars.toml"), text).unwrap();
    let orbit = json(&["orbit", &path("bars.toml"), "-q", "-o", &path("orbit.h5")]);
    assert!(orbit["residual"].as_f64().unwrap() < 1e-12 && orbit["stable"] == true);
    let amplitude = orbit["amplitude"].as_f64().unwrap();
    // all modes of the body whose interface is held: the same body
    std::fs::write(
        path("reduced.toml"),
        format!("{text}[reduction]\nkind = 'fixed-interface'\nmodes = 12\n"),
    )
    .unwrap();
    let reduced = json(&["orbit", &path("reduced.toml"), "-q", "-o", &path("reduced.h5")]);
    assert!((reduced["amplitude"].as_f64().unwrap() / amplitude - 1.0).abs() < 1e-9);
    json(&[
        "response",
        &path("bars.toml"),
        "--method",
        "hbm",
        "--harmonics",
        "15",
        "-q",
        "-o",
        &path("hbm.h5"),
    ]);
    let checked =
        json(&["crosscheck", &path("hbm.h5"), &path("bars.toml"), "-q", "-o", &path("check.h5")]);
    let tally = &checked["tally"];
    assert!(
        checked.to_string().contains("orbit") && !tally.is_null() || checked["points"].is_array(),
        "{checked}"
    );
    for command in ["plot", "view", "export"] {
        let out = path(command);
        let done = program().args([command, &path("orbit.h5"), "-q", "-o", &out]).output().unwrap();
        assert!(done.status.success(), "{command}: {}", String::from_utf8_lossy(&done.stderr));
    }
}

/// A node that is held along its normal is none of the contact, and that is said.
#[test]
fn held_nodes_of_a_slave_are_counted() {
    let text = plate("a", [1.0, 0.5], [4, 2], [1.0, 0.3, 1.0], "")
        + &plate("b", [1.0, 0.5], [3, 2], [1.0, 0.3, 1.0], "move = [0.0, 0.6]")
        + "[[support]]\nedge = 'a:bottom'\nfix = ['x', 'y']\n[[support]]\nedge = 'b:left'\nfix = ['x', 'y']\n[[contact]]\nslave = 'b:bottom'\nmaster = 'a:top'\n[run]\nuntil = 1.0\n";
    let problem = problem(&text);
    let warned = &problem.notes.warnings;
    let said = "1 node of \"b:bottom\" is held along the normal: no contact node";
    assert!(warned.iter().any(|w| w == said), "{warned:?}");
    assert_eq!(problem.system.facing().len(), 3);
    assert_eq!(warned.len(), 1);
    // energies of the paper's mass jump
    let paper =
        text.replace("[[contact]]\n", "[[contact]]\nstress = 'reaction'\ninertia = 'paper'\n");
    let warned = crate::common::problem(&paper).notes.warnings;
    assert!(warned.iter().any(|w| w.starts_with("inertia = \"paper\" where")), "{warned:?}");
}

#[test]
fn bad_pairs_are_named() {
    let two = |contact: &str, more: &str| {
        plate("a", [1.0, 0.5], [4, 2], [1.0, 0.3, 1.0], "")
            + &plate("b", [1.0, 0.5], [3, 2], [1.0, 0.3, 1.0], "move = [0.0, 0.6]")
            + &format!("[[contact]]\n{contact}\n{more}[run]\nuntil = 1.0\n")
    };
    let pair = "slave = 'b:bottom'\nmaster = 'a:top'\n";
    let cases = [
        (two("slave = 'b:bottom'", ""), "contact[0].master: is missing"),
        (two("master = 'a:top'", ""), "contact[0].slave: is missing"),
        (two("slave = 'a:top'\nmaster = 'a:top'", ""), "is the slave itself"),
        (two("slave = 'bottom'\nmaster = 'a:top'", ""), "no [[body]] is called \"bottom\""),
        (two("slave = 'c:bottom'\nmaster = 'a:top'", ""), "no [[body]] is called \"c\""),
        (two("slave = 'b:botom'\nmaster = 'a:top'", ""), "\"b\" has no edge \"b:botom\""),
        (two("slave = 'b:bottom'\nmaster = 'a:left'", ""), "sees \"a:left\" along its normal"),
        (two("slave = 'b:left'\nmaster = 'a:left'", ""), "sees \"a:left\" along its normal"),
        (two(&format!("{pair}gap = -0.01"), ""), "the two surfaces overlap by 1.000e-2"),
        (two(&format!("{pair}projection = 'match'"), ""), "\"match\" needs a node of \"a:top\""),
        (two(&format!("{pair}projection = 'mortar'"), ""), "unknown variant `mortar`"),
        (
            two(&format!("{pair}stress = 'projection'"), ""),
            "compares the stresses of two surfaces node by node",
        ),
        (two(&format!("{pair}method = 'penalty'"), ""), "knows rigid obstacles"),
        (
            two(&format!("{pair}plane = {{ normal = [0.0, 1.0], offset = 1.0 }}"), ""),
            "belongs to a rigid obstacle",
        ),
        (two(&format!("{pair}gap_behind = 1.0"), ""), "belongs to a rigid obstacle"),
        (two(&format!("{pair}edge = 'a:left'"), ""), "stands beside slave and master"),
        (two("edge = 'left'\ngap = 1.0", ""), "does not say of which body"),
        (two("edge = 'a:left'\ngap = 'geometry'", ""), "\"geometry\" is for pairs of surfaces"),
        (
            two("edge = 'a:left'\ngap = 1.0\nsides = 'both'", ""),
            "no table has a slave and a master",
        ),
        (two("edge = 'a:left'\ngap = 1.0\npress = true", ""), "belongs to a pair of surfaces"),
        (two(pair, "[[contact]]\nslave = 'a:top'\nmaster = 'b:bottom'\n"), "refers to itself"),
        (
            two(pair, "")
                + &plate("c", [1.0, 0.2], [3, 1], [1.0, 0.3, 1.0], "move = [0.0, 1.1]")
                + &plate("d", [1.0, 0.5], [3, 2], [1.0, 0.3, 1.0], "move = [0.0, 1.3]")
                + "[[contact]]\nslave = 'c:bottom'\nmaster = 'b:top'\n[[contact]]\nslave = 'd:bottom'\nmaster = 'c:top'\n",
            "\"c\" lies one element thick between two surfaces",
        ),
        (two(pair, "").replace("name = 'b'", "name = 'a'"), "is that of another body"),
        (two(pair, "").replace("name = 'b'\n", ""), "body[1].name: is missing"),
        (two(pair, "").replace("name = 'b'", "name = 'b:c'"), "body[1].name: is \"b:c\""),
        (two(pair, "").replace("move = [0.0, 0.6]", "move = [0.0]"), "has 1 numbers"),
        (two(pair, "").replace("move = [0.0, 0.6]", "mirror = 'z'"), "is not one of its axes"),
        (two(pair, "[initial]\nvelocity = { c = ['1', '0'] }\n"), "no body is called \"c\""),
        (
            two("edge = 'a:left'\ngap = 1.0", "")
                .replace(
                    "kind = 'plate'\nsize = [1.0, 0.5]\nelements = [3, 2]",
                    "kind = 'bar'\nsize = [1.0]\nelements = [3]",
                )
                .replace("move = [0.0, 0.6]", ""),
            "beside one in the plane",
        ),
    ];
    for (text, wanted) in cases {
        let error =
            match signorini::scenario::Scene::parse(&text, std::path::Path::new("test.toml")) {
                Err(e) => e.to_string(),
                Ok(scene) => match Problem::new(&scene, None) {
                    Err(e) => e.to_string(),
                    Ok(_) => panic!("accepted: {wanted}\n{text}"),
                },
            };
        let plain = error.replace("\n", " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(plain.contains(wanted), "{wanted}\n{error}");
    }
}
