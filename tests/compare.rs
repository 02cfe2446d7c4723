//! Contact methods side by side. Reference numbers: an independent prototype in another language, printed to two or three digits: a number may differ by one in
//! its last digit or by two percent.

use crate::common::{json, root, run, scene};
use serde_json::Value;
use signorini::compare::reference::Named;
use signorini::compare::{Means, Plan, Request, Variant, outline, rows};
use signorini::continuation::Go;
use signorini::problem::Problem;
use signorini::records::{Compared, Comparison, Quantity, Row};
use signorini::scenario::{Elements, Scene};
use signorini::store::read_comparison;

/// The bar from the far point of its nonsmooth mode of period 3.36 over half of it.
fn bar() -> Scene {
    scene(&format!(
        "{}[initial]\ndisplacement = [\"-x/0.36\"]\n[run]\nuntil = 1.68\n",
        crate::common::bar(20)
    ))
}

fn variants(names: &[&str]) -> Vec<Variant> {
    names.iter().map(|n| Variant::of_name(n).unwrap()).collect()
}

fn meshes(list: &str) -> Vec<Elements> {
    list.split(',').map(|mesh| Elements::parse(mesh).unwrap()).collect()
}

fn compared(scene: &Scene, compared: Compared, request: Request) -> Comparison {
    let mut plan = Plan::new(scene, compared, request).unwrap();
    let set_up = |scene: &Scene| Problem::new(scene, None).map_err(|e| e.to_string());
    if compared == Compared::Viscous {
        plan.beta = Some(signorini::compare::orbits::common_beta(&plan, &set_up).unwrap());
    }
    let mut comparison = outline(&plan, String::new());
    let means = Means { set_up: &set_up, stop: &|| false };
    rows(&plan, means, &[], &mut |row, _, _| {
        comparison.rows.extend(row);
        Go::Continue(())
    })
    .unwrap();
    comparison
}

/// The rows of a variant.
fn of<'c>(comparison: &'c Comparison, variant: &str) -> Vec<&'c Row> {
    let all: Vec<&Row> = comparison.rows.iter().filter(|r| r.variant == variant).collect();
    assert!(!all.is_empty(), "{variant}");
    all
}

/// Whether a number is the one that was printed.
fn is_printed(found: f64, printed: &str) -> bool {
    let value: f64 = printed.parse().unwrap();
    let (mantissa, exponent) = printed.split_once('e').unwrap_or((printed, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len()) as i32;
    let unit = 10f64.powi(exponent.parse::<i32>().unwrap() - decimals);
    let near = (0.02 * value.abs()).max(unit) + 0.5 * unit;
    (found - value).abs() <= near
}

fn check(rows: &[&Row], quantity: Quantity, printed: &str) {
    for (row, word) in rows.iter().zip(printed.split_whitespace()) {
        let found = row.get(quantity);
        let what =
            format!("{} on {}: {} = {found}, not {word}", row.variant, row.mesh, quantity.name());
        match quantity {
            // one more or less below ten, a tenth above
            Quantity::Switches => {
                let count: f64 = word.parse().unwrap();
                let near = if count < 10.0 { 1.0 } else { 0.1 * count };
                assert!((found - count).abs() <= near, "{what}");
            }
            _ => assert!(word == "-" || is_printed(found, word), "{what}"),
        }
    }
}

#[test]
fn a_bar_has_the_errors_of_the_prototype_under_refinement() {
    // error, penetration, switches, p_max, rms of the pressure on 10, 20, 40, 80, 160 elements
    let table = [
        (
            "nbm",
            "4.85e-2 1.92e-2 9.23e-3 4.45e-3 2.31e-3",
            "0 0 0 0 0",
            "1 1 1 1 1",
            "1.28 1.13 1.11 1.10 1.07",
            ".38 .26 .18 .13 .09",
        ),
        (
            "mass-redistribution",
            "4.87e-2 1.91e-2 8.95e-3 3.84e-3 2.10e-3",
            "0 0 0 0 0",
            "1 1 1 1 1",
            "1.44 1.25 1.32 1.30 1.30",
            ".41 .28 .20 .14 .10",
        ),
        (
            "mass-redistribution:optimal",
            "9.77e-2 4.26e-2 1.96e-2 9.42e-3 4.62e-3",
            "0 0 0 0 0",
            "1 1 1 1 1",
            "1.62 1.35 1.23 1.18 1.12",
            ".48 .26 .20 .14 .10",
        ),
        (
            "nitsche",
            "2.93e-2 1.02e-2 7.88e-3 4.57e-3 2.36e-3",
            ".19 .086 .044 .022 .011",
            "1 1 1 1 1",
            "1.54 1.59 1.57 1.57 1.57",
            ".40 .39 .26 .20 .15",
        ),
        (
            "nitsche:10",
            "4.16e-2 1.95e-2 9.70e-3 4.62e-3 2.41e-3",
            ".076 .020 .013 .006 .003",
            "5 8 22 45 88",
            "3.7 2.4 2.8 2.6 2.6",
            "- - - - -",
        ),
        (
            "nitsche:5:theta=0",
            "3.90e-2 1.97e-2 9.79e-3 4.65e-3 2.42e-3",
            ".097 - - - .004",
            "1 1 1 1 1",
            "2.7 - - - 1.8",
            "- - - - -",
        ),
        (
            "nitsche:1:theta=-1",
            "3.76e-2 2.04e-2 9.95e-3 4.86e-3 2.45e-3",
            ".15 - - - .010",
            "1 1 1 1 1",
            "1.5 1.5 - 1.5 1.7",
            "- - - .2 .2",
        ),
        (
            "penalty",
            "9.99e-2 6.01e-2 3.28e-2 1.67e-2 8.41e-3",
            ".33 .18 .084 .040 .020",
            "1 1 1 1 1",
            "1.18 1.27 1.20 1.17 1.13",
            ".41 .32 .23 .16 .11",
        ),
        (
            "penalty:10",
            "4.81e-2 2.12e-2 1.07e-2 5.04e-3 2.58e-3",
            ".097 - - - .004",
            "6 5 25 49 102",
            "3.5 - - - 2.4",
            "- - - .8 .8",
        ),
        // chatter of stiff springs is no accumulation
        (
            "penalty:100",
            "4.17e-2 1.98e-2 9.89e-3 4.70e-3 2.48e-3",
            ".029 - - - .0013",
            "7 20 32 66 128",
            "- - - - -",
            "- - 2.1 2.1 2.1",
        ),
        ("impact", "4.96e-2 2.05e-2 9.66e-3", "0 0 0", "1 1 1", "- - -", "- - -"),
        ("impact:1", "5.26e-2 2.05e-2 1.07e-2", "0 0 0", "4 11 17", "- - -", "- - -"),
        (
            "moreau-jean",
            "4.96e-2 2.01e-2 1.00e-2",
            "9e-3 3e-3 2e-3",
            "- - -",
            "4.2 2.1 2.8",
            "- - -",
        ),
    ];
    let names: Vec<&str> = table.iter().map(|t| t.0).chain(["waves"]).collect();
    let request = Request {
        variants: variants(&names),
        elements: meshes("10,20,40,80,160"),
        ..Request::default()
    };
    let c = compared(&bar(), Compared::Run, request);
    assert!(c.exact && c.rows.len() == 5 * names.len());
    for (name, error, penetration, switches, peak, rms) in table {
        let rows = of(&c, name);
        check(&rows, Quantity::Error, error);
        check(&rows, Quantity::Penetration, penetration);
        if name != "moreau-jean" {
            check(&rows, Quantity::Switches, switches);
        }
        check(&rows, Quantity::Overshoot, peak);
        check(&rows, Quantity::PressureError, rms);
        // first order, all of them, on this motion
        assert!((c.orders_of_error(&rows).mean() - 1.0).abs() < 0.15, "{name}");
        // half the time of contact, (4 − T)/2, under the pressure 1/(T − 3)
        let impulse = rows[4].get(Quantity::Impulse);
        assert!((impulse - 8.0 / 9.0).abs() < 0.025 * 8.0 / 9.0, "{name}: {impulse}");
    }
    let energy = |name: &str, k: usize| of(&c, name)[k].get(Quantity::EnergyChange);
    for (name, first, last) in [("nbm", -0.07, -0.004), ("nitsche:1:theta=-1", 0.024, 0.013)] {
        assert!((energy(name, 0) - first).abs() < 0.005 && (energy(name, 4) - last).abs() < 0.002);
    }
    for (name, changes) in
        [("impact", [-0.058, -0.008, -0.008]), ("moreau-jean", [-0.058, -0.007, -0.007])]
    {
        (0..3).for_each(|k| assert!((energy(name, k) - changes[k]).abs() < 6e-4, "{name}"));
    }
    for name in ["mass-redistribution", "nitsche", "penalty:10", "impact:1", "waves"] {
        (0..5).for_each(|k| assert!(energy(name, k).abs() < 1e-11, "{name}"));
    }
    for row in of(&c, "waves") {
        assert!(
            row.get(Quantity::Error) < 1e-13 && row.get(Quantity::PressureError) < 1e-6,
            "{row:?}"
        );
    }
}

#[test]
fn parameters_are_scanned_as_in_the_prototype() {
    let list =
        |key: &str, values: &str| (key.to_owned(), values.split(',').map(str::to_owned).collect());
    let request = Request {
        variants: variants(&["nitsche", "penalty"]),
        elements: meshes("40"),
        parameters: vec![
            list("contact.gamma", "1.01,1.5,2,3,5,10,100"),
            list("contact.stiffness", ".5,1,2,5,10,100,1000"),
        ],
        ..Request::default()
    };
    let c = compared(&bar(), Compared::Run, request);
    // each method reads one of the keys
    assert_eq!(c.rows.len(), 14);
    for (changed, error, penetration, switches, peak) in [
        ("contact.gamma = 1.01", "3.9e-2", ".92", "1", "1.4"),
        ("contact.gamma = 1.5", "6.4e-3", ".069", "1", "1.57"),
        ("contact.gamma = 2", "7.9e-3", ".044", "1", "1.57"),
        ("contact.gamma = 3", "9.8e-3", ".029", "1", "1.6"),
        ("contact.gamma = 5", "9.7e-3", ".020", "1", "2.0"),
        ("contact.gamma = 10", "9.7e-3", ".013", "22", "2.8"),
        ("contact.gamma = 100", "1.0e-2", ".0049", "32", "8.0"),
        ("contact.stiffness = .5", "5.8e-2", ".16", "1", "1.12"),
        ("contact.stiffness = 1", "3.3e-2", ".084", "1", "1.2"),
        ("contact.stiffness = 2", "2.0e-2", ".051", "1", "1.46"),
        ("contact.stiffness = 5", "1.2e-2", ".027", "1", "1.96"),
        ("contact.stiffness = 10", "1.1e-2", ".018", "25", "2.65"),
        ("contact.stiffness = 100", "9.9e-3", ".0056", "32", "8.0"),
        ("contact.stiffness = 1000", "1.0e-2", ".0017", "34", "24"),
    ] {
        let row: Vec<&Row> = c.rows.iter().filter(|r| r.changed == changed).collect();
        assert_eq!(row.len(), 1, "{changed}");
        check(&row, Quantity::Error, error);
        check(&row, Quantity::Penetration, penetration);
        check(&row, Quantity::Switches, switches);
        check(&row, Quantity::Overshoot, peak);
    }
    // a lumped mass; the prototype's redistribution leaves out the mass of the contact node, this one moves it to the neighbour
    let request = Request {
        variants: variants(&["nbm", "penalty", "nitsche", "mass-redistribution"]),
        elements: meshes("40"),
        parameters: vec![list("body.mass", "lumped")],
        ..Request::default()
    };
    let c = compared(&bar(), Compared::Run, request);
    for (name, error) in [
        ("nbm", "8.7e-3"),
        ("penalty", "3.0e-2"),
        ("nitsche", "9.7e-3"),
        ("mass-redistribution", "8.5e-3"),
    ] {
        check(&of(&c, name), Quantity::Error, error);
    }
}

#[test]
fn a_half_plate_has_the_impulses_of_the_prototype_under_refinement() {
    let table = [
        ("nbm", "7.6e-2 2.9e-2", ".0804 .1005", "8 16"),
        ("mass-redistribution", "9.4e-2 2.8e-2", ".1298 .1201", "8 18"),
        ("mass-redistribution:optimal", "7.8e-2 4.0e-2", ".1283 .1265", "8 14"),
        ("nitsche", "7.5e-2 2.9e-2", ".1158 .1205", "16 38"),
        ("nitsche:5", "7.7e-2 3.2e-2", ".1231 .1208", "24 92"),
        ("penalty", "6.9e-2 4.2e-2", ".1130 .1183", "12 30"),
        ("penalty:10", "7.6e-2 3.4e-2", ".1244 .1221", "50 202"),
    ];
    let names: Vec<&str> = table.iter().map(|t| t.0).collect();
    let request = Request {
        variants: variants(&names),
        elements: meshes("10,20"),
        reference: Some(Named::Mesh(
            Variant::of_name("mass-redistribution").unwrap(),
            Elements::parse("40x12").unwrap(),
        )),
        ..Request::default()
    };
    let c = compared(&crate::common::shipped("half-plate-transient.toml"), Compared::Run, request);
    assert!(!c.exact && c.rows.iter().all(|r| r.mesh == "10x3" || r.mesh == "20x6"));
    for (name, distance, impulse, switches) in table {
        let rows = of(&c, name);
        check(&rows, Quantity::Impulse, impulse);
        check(&rows, Quantity::Switches, switches);
        // the prototype's distances are at the nodes of 10 × 3, these at those of the mesh
        for (row, printed) in rows.iter().zip(distance.split(' ')) {
            let (found, printed) = (row.get(Quantity::Error), printed.parse::<f64>().unwrap());
            assert!((found / printed - 1.0).abs() < 0.15, "{name}: {found}, not {printed}");
        }
    }
}

#[test]
fn orbits_of_a_half_plate_are_those_of_the_prototype() {
    let request = Request {
        variants: variants(&[
            "mass-redistribution",
            "mass-redistribution:optimal",
            "penalty",
            "nitsche",
        ]),
        omega: vec![1.80],
        ..Request::default()
    };
    let c = compared(&crate::common::shipped("half-plate-orbit.toml"), Compared::Orbit, request);
    for (name, energy, switches) in [
        ("mass-redistribution", 0.8715447210, 8.0),
        ("mass-redistribution:optimal", 1.2486616740, 8.0),
        ("penalty", 1.5795871110, 12.0),
        ("nitsche", 0.7846731695, 12.0),
    ] {
        let row = of(&c, name)[0];
        assert!((row.get(Quantity::Energy) - energy).abs() < 1e-8, "{row:?}");
        assert_eq!(row.get(Quantity::Switches), switches);
        assert!(row.get(Quantity::Multiplier) > 1.0 && row.get(Quantity::EnergyError).is_nan());
    }
}

#[test]
fn orbits_of_a_bar_scatter_about_the_closed_form_as_in_the_prototype() {
    let request = Request {
        variants: variants(&["nbm", "mass-redistribution", "penalty"]),
        elements: meshes("10,20,40"),
        omega: vec![1.87],
        ..Request::default()
    };
    let c = compared(&bar(), Compared::Orbit, request);
    for (name, errors) in [
        ("nbm", "-.13 .14 .17"),
        ("mass-redistribution", "-.035 .005 .07"),
        ("penalty", ".60 .32 .18"),
    ] {
        check(&of(&c, name), Quantity::EnergyError, errors);
    }
    let row = of(&c, "mass-redistribution")[0];
    assert!((row.get(Quantity::ContactTime) - 0.5964552328).abs() < 1e-9);
    assert!((row.get(Quantity::Energy) - 3.7232169992).abs() < 1e-8);
}

/// The viscous nonlinear mode of the half plate at ω = 1.8, β = 0.01: one limit.
fn one_limit(names: &[&str], counts: &str, limits: &[(&str, f64)]) -> Comparison {
    let request = Request {
        variants: variants(names),
        elements: meshes(counts),
        omega: vec![1.8],
        beta: Some(0.01),
        ..Request::default()
    };
    let c =
        compared(&crate::common::shipped("half-plate-viscous.toml"), Compared::Viscous, request);
    for (name, order) in limits {
        let rows = of(&c, name);
        let found = c.limits_of(&rows, Quantity::Energy);
        let limit = found.last().unwrap();
        assert!((limit - 0.735).abs() < 0.005, "{name}: {found:?}");
        let orders = c.orders_of(&rows, Quantity::Energy).0;
        assert!((orders.last().unwrap() - order).abs() < 0.05, "{name}: {orders:?}");
    }
    c
}

#[test]
fn viscous_modes_of_nodal_methods_have_one_limit() {
    let names = ["nbm", "nbm:constant", "mass-redistribution"];
    let limits = [("nbm", 1.52), ("nbm:constant", 1.77), ("mass-redistribution", 1.75)];
    let c = one_limit(&names, "10x3,20x6,30x9,40x12", &limits);
    // another program: .65675 .70052 .71646 .72296 and .67634 .70361 .71093 (another redistribution)
    check(&of(&c, "nbm"), Quantity::Energy, ".65675 .70052 .71646 .72296");
    assert!(of(&c, "nbm")[0].note.contains("sharper fronts"));
}

#[test]
#[ignore = "some forty seconds"]
fn viscous_modes_of_springs_approach_the_same_limit() {
    let c = one_limit(&["nitsche", "penalty"], "10x3,20x6,30x9,40x12", &[]);
    check(&of(&c, "nitsche"), Quantity::Energy, ".6921 .7056 .7150 .7236");
    check(&of(&c, "penalty"), Quantity::Energy, ".8497 .7931 .7749 .7651");
}

/// Two bars, and two half plates, of meshes that do not match: the viscous modes of another program (bodies of that program's own two-body formulation).
#[test]
fn viscous_modes_of_two_bodies_converge_as_the_prototype_says() {
    let bars = "[[body]]\nname = 'a'\nkind = 'bar'\nsize = [1.0]\nelements = [20]\nyoung = 1.0\ndensity = 1.0\n\
        [[body]]\nname = 'b'\nkind = 'bar'\nsize = [0.7]\nelements = [14]\nyoung = 1.0\ndensity = 1.0\nmove = [2.0]\n\
        [[support]]\nedge = 'a:left'\nfix = ['x']\n[[support]]\nedge = 'b:right'\nfix = ['x']\n\
        [[contact]]\nslave = 'a:right'\nmaster = 'b:left'\ngap = 1.0\n";
    let half = |name: &str, length: f64, elements: &str, far: &str, place: &str| {
        format!(
            "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = [{length}, 0.3]\nelements = {elements}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{place}\n\
             [[support]]\nedge = '{name}:{far}'\nfix = ['x', 'y']\n[[support]]\nedge = '{name}:bottom'\nfix = ['y']\n"
        )
    };
    let plates = half("a", 1.0, "[10, 3]", "left", "")
        + &half("b", 0.8, "[8, 4]", "right", "move = [2.0, 0.0]")
        + "[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\ngap = 1.0\n";
    let uneven = "5x2+4x3,10x3+8x4,15x5+12x6";
    for (text, sides, list, energies) in [
        (bars, "both", "20,40,80", "1.893858 1.919210 1.926345"),
        (bars, "slave", "20,40,80", "1.911197 1.922914 1.927133"),
        (&plates, "both", uneven, ".49819 .70352 .78434"),
        (&plates, "slave", uneven, ".60976 .75741 .80629"),
    ] {
        let request = Request {
            variants: variants(&["nbm"]),
            elements: meshes(list),
            omega: vec![1.65],
            beta: Some(0.01),
            ..Request::default()
        };
        let scene = scene(&format!("{text}sides = '{sides}'\n"));
        let c = compared(&scene, Compared::Viscous, request);
        let rows = of(&c, "nbm");
        for (row, printed) in rows.iter().zip(energies.split_whitespace()) {
            let wanted: f64 = printed.parse().unwrap();
            let found = row.get(Quantity::Energy);
            assert!((found - wanted).abs() < 6e-6, "{} {sides}: {found} {printed}", row.mesh);
        }
    }
}

/// A motion of two bodies on finer and finer meshes approaches that on the finest; bodies that touch keep to their own displacements.
#[test]
fn motions_of_two_bodies_approach_that_of_the_finest_meshes() {
    let text = "[[body]]\nname = 'a'\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [5, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[body]]\nname = 'b'\nkind = 'plate'\nsize = [0.5, 0.4]\nelements = [3, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmove = [1.0, 0.0]\n\
        [[support]]\nedge = 'a:left'\nfix = ['x', 'y']\n\
        [[contact]]\nslave = 'b:left'\nmaster = 'a:right'\n\
        [initial]\nvelocity = { b = ['-0.3', '0'] }\n[damping]\nrayleigh = [0.0, 0.03]\n[run]\nuntil = 1.5\n";
    let request = Request {
        variants: variants(&["nbm"]),
        elements: meshes("5,10,20"),
        reference: Some(Named::Mesh(
            Variant::of_name("nbm").unwrap(),
            Elements::parse("60x24+36x36").unwrap(),
        )),
        ..Request::default()
    };
    let c = compared(&scene(text), Compared::Run, request);
    let rows = of(&c, "nbm");
    let names: Vec<&str> = rows.iter().map(|r| r.mesh.as_str()).collect();
    assert_eq!(names, ["5x2+3x3", "10x4+6x6", "20x8+12x12"]);
    // b has flown away: a node of a's face that took b's motion would be off by all of it
    let errors: Vec<f64> = rows.iter().map(|r| r.get(Quantity::Error)).collect();
    assert!(errors.windows(2).all(|e| e[1] < 0.6 * e[0]) && errors[2] < 5e-3, "{errors:?}");
}

fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn the_command_writes_table_file_and_picture_and_goes_on() {
    let folder = temporary();
    let stem = folder.path().join("c");
    let stem = stem.to_str().unwrap();
    let base = ["compare", "scenarios/bar.toml", "--elements", "10,20,40", "-o", stem];
    let first = json(&[&base[..], &["--methods", "nbm,waves"]].concat());
    assert_eq!(first["rows"].as_array().unwrap().len(), 6);
    assert_eq!(first["written"].as_array().unwrap().len(), 5);
    let order = first["series"][0]["order"]["mean"].as_f64().unwrap();
    assert!((0.5..0.9).contains(&order), "{order}");
    for ending in [".h5", ".csv", ".svg", ".png", ".pdf"] {
        let path = format!("{stem}{ending}");
        assert!(std::fs::metadata(path).unwrap().len() > 300);
    }
    // not twice by accident
    assert_eq!(run(&[&base[..], &["--methods", "nbm"]].concat()).status.code(), Some(2));
    // what is there is not computed again
    let more = json(&[&base[..], &["--methods", "nbm,penalty,waves", "--resume"]].concat());
    let wall = |v: &Value, k: usize| v["rows"][k]["wall_s"].as_f64().unwrap();
    assert_eq!(more["rows"].as_array().unwrap().len(), 9);
    assert!((0..3).all(|k| wall(&more, k) == wall(&first, k)));
    assert_eq!(more["rows"][4]["variant"], "penalty");
    let stored = read_comparison(format!("{stem}.h5").as_ref()).unwrap();
    assert_eq!(stored.comparison.rows.len(), 9);
    assert_eq!(stored.status.to_string(), "complete");
    assert_eq!(stored.comparison.rows[4].get(Quantity::Wall), wall(&more, 4));
    // another scene is another comparison
    let other = run(&["compare", "scenarios/bouncing-bar.toml", "-o", stem, "--resume"]);
    assert_eq!(other.status.code(), Some(2));
    // looked at again
    let shown = json(&["inspect", &format!("{stem}.h5")]);
    assert_eq!(shown["rows"].as_array().unwrap().len(), 9);
    let drawn = folder.path().join("again");
    json(&["plot", &format!("{stem}.h5"), "-o", drawn.to_str().unwrap()]);
    let text = |path: String| std::fs::read_to_string(path).unwrap();
    assert_eq!(text(format!("{}.svg", drawn.display())), text(format!("{stem}.svg")));
    let table = folder.path().join("table");
    json(&["export", &format!("{stem}.h5"), "--format", "csv", "-o", table.to_str().unwrap()]);
    assert_eq!(text(format!("{}.csv", table.display())), text(format!("{stem}.csv")));
}

#[test]
fn a_run_in_a_file_is_a_reference() {
    let folder = temporary();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = "scenarios/half-plate-transient.toml";
    let changed =
        std::fs::read_to_string(root().join(scene)).unwrap().replace("[10, 3]", "[20, 6]");
    let changed = changed.replace("gap = 1.0", "gap = 1.0\nmethod = \"mass-redistribution\"");
    let changed = changed.replace("until = 3.36", "until = 3.36\nsamples = 2000");
    std::fs::write(at("fine.toml"), changed).unwrap();
    json(&["run", &at("fine.toml"), "-o", &at("fine.h5")]);
    let common = ["compare", scene, "--methods", "nbm", "--force", "-o", &at("c"), "--reference"];
    let with = |reference: &str| json(&[&common[..], &[reference]].concat())["rows"][0].clone();
    let (file, mesh) = (with(&at("fine.h5")), with("mass-redistribution@20x6"));
    for key in ["error", "overshoot", "pressure_error"] {
        let (a, b) = (file[key].as_f64().unwrap(), mesh[key].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-3, "{key}: {a} {b}");
    }
    // the file is of one problem, and serves no other
    let other = ["--parameter", "contact.gap=0.9"];
    let output = run(&[&common[..], &[&at("fine.h5")], &other].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("[contact] differs"));
    let longer = at("longer.toml");
    let text = std::fs::read_to_string(root().join(scene)).unwrap();
    std::fs::write(&longer, text.replace("3.36", "4.0")).unwrap();
    let output = run(&["compare", &longer, "-o", &at("d"), "--reference", &at("fine.h5")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("ends at t = 3.36"));
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = temporary();
    let stem = folder.path().join("c");
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let all = [&["compare"], arguments, &["-o", stem.to_str().unwrap(), "--force"]].concat();
        let output = run(&all);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
        assert!(text.contains(words), "{arguments:?}: {text}");
    };
    let bar = "scenarios/bar.toml";
    refused(&[bar, "--methods", "nmb"], 2, "there are nbm");
    refused(&[bar, "--methods", "nbm:optimal"], 2, "paper, constant");
    refused(&[bar, "--elements", "10x3"], 2, "no mesh of this body");
    refused(&[bar, "--elements", "ten"], 2, "give 20, or 20x6");
    refused(&[bar, "--parameter", "contact.gpa=1"], 2, "contact.gpa");
    refused(&[bar, "--parameter", "contact.gap"], 2, "KEY=VALUE");
    refused(&[bar, "--omega", "1.8"], 2, "--orbit or --viscous");
    refused(&[bar, "--orbit"], 2, "--omega 1.8");
    refused(&[bar, "--reference", "nowhere.h5"], 2, "no such file");
    refused(&["scenarios/two-mass-stop.toml", "--elements", "10"], 2, "a body of matrices");
    refused(&["scenarios/plate.toml", "--methods", "waves"], 2, "no row");
    refused(&[bar, "--methods", "nitsche:0.5"], 2, "gamma");
    refused(&[bar, "--methods", "nbm:constant:paper"], 2, "inertia twice");
    refused(&[bar, "--methods", "nbm,"], 2, "empty item");
    // what a row is called is what was computed
    refused(&[bar, "--parameter", "contact.method=waves"], 2, "--methods");
    refused(&[bar, "--parameter", "body.elements=[20]"], 2, "--elements");
    refused(&[bar, "--orbit", "--omega", "1.8", "--parameter", "orbit.beta=0.1"], 2, "--beta");
    refused(&[bar, "--methods", "nitsche:3", "--parameter", "contact.gamma=4"], 2, "nitsche:3");
    let twice = ["--parameter", "contact.gap=0.5", "--parameter", "contact.gap=0.7"];
    refused(&[&[bar][..], &twice].concat(), 2, "varied twice");
    refused(&[bar, "--methods", "nbm", "--parameter", "contact.stiffness=1"], 2, "is read by none");
    refused(&[bar, "--orbit", "--omega", "1.8", "--beta", "0.01"], 2, "--viscous");
    // what would take for ever
    refused(&[bar, "--methods", "nbm", "--parameter", "run.until=1e9"], 2, "natural periods");
    refused(&[bar, "--methods", "moreau-jean:step=1e-12"], 2, "steps");
    refused(&[bar, "--methods", "nbm", "--orbit", "--omega", "1e-5"], 2, "natural periods");
    refused(&["scenarios/plate.toml", "--reference", "waves"], 2, "the motion of a bar");
    // schemes that go through time in their own way do not read the integrator of the others
    let output = json(&[
        "compare",
        bar,
        "--methods",
        "nbm,waves,moreau-jean",
        "--parameter",
        "run.integrator=modal",
        "-o",
        stem.to_str().unwrap(),
        "--force",
    ]);
    assert!((0..3).all(|k| output["rows"][k]["error"].as_f64().is_some()), "{output}");
    // with friction there is one method, whatever it is called, with mass along the obstacle and without
    let plate = folder.path().join("plate.toml");
    let text = "[body]\nkind = 'plate'\nsize = [0.5, 1.0]\nelements = [2, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
                [contact]\nedge = 'right'\ngap = 0.01\nfriction = 0.4\n[initial]\nvelocity = ['0.3*x', '0.2*x']\n[run]\nuntil = 1.0\n";
    std::fs::write(&plate, text).unwrap();
    let plate = plate.display().to_string();
    let output = json(&["compare", &plate, "-o", stem.to_str().unwrap(), "--force"]);
    let variants = [0, 1].map(|k| output["rows"][k]["variant"].as_str().unwrap_or_default());
    assert_eq!(variants, ["mass-redistribution:inertia", "mass-redistribution:massless"]);
    assert_eq!(output["rows"].as_array().unwrap().len(), 2, "{output}");
    // one that is refused does not take the others with it
    let output = json(&[
        "compare",
        bar,
        "--methods",
        "nitsche",
        "--parameter",
        "contact.gamma=0.9,2",
        "-o",
        stem.to_str().unwrap(),
        "--force",
    ]);
    assert!(output["rows"][0]["note"].as_str().unwrap().contains("gamma"), "{}", output["rows"][0]);
    assert!(output["rows"][1]["error"].as_f64().is_some());
    // parameters that make another problem have references of their own
    let output = json(&[
        "compare",
        bar,
        "--methods",
        "waves",
        "--parameter",
        "contact.gap=1.0,1.2",
        "-o",
        stem.to_str().unwrap(),
        "--force",
    ]);
    assert!((0..2).all(|k| output["rows"][k]["error"].as_f64().unwrap() < 1e-13), "{output}");
}

#[test]
fn a_signal_ends_a_row_and_keeps_the_others() {
    let folder = temporary();
    let stem = folder.path().join("c");
    let arguments = [
        "compare",
        "scenarios/bar.toml",
        "--methods",
        "nbm,moreau-jean:step=1e-8,penalty",
        "--elements",
        "10",
        "-q",
        "-o",
    ];
    // the first row looks for signals some hundred times, the second one, of 10⁸ steps, at every step
    let mut program = crate::common::program();
    program.args(arguments).arg(&stem).env("SIGNORINI_AT_LOOK", "INT 100000");
    assert_eq!(program.output().unwrap().status.code(), Some(130));
    let stored = read_comparison(&stem.with_extension("h5")).unwrap();
    assert_eq!(stored.status.to_string(), "interrupted");
    assert_eq!(stored.comparison.rows.len(), 1);
}

#[test]
fn files_of_matrices_that_change_are_noticed() {
    let folder = temporary();
    for name in ["two-mass-stop.toml", "two-mass-stop-M.mtx", "two-mass-stop-K.mtx"] {
        std::fs::copy(root().join("scenarios").join(name), folder.path().join(name)).unwrap();
    }
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, stem) = (at("two-mass-stop.toml"), at("c"));
    // of the default methods those that the body has
    let found = json(&["compare", &scene, "-o", &stem]);
    assert_eq!(found["rows"].as_array().unwrap().len(), 1, "{found}");
    let mass = at("two-mass-stop-M.mtx");
    let text = std::fs::read_to_string(&mass).unwrap();
    let line = text.lines().last().unwrap().to_owned();
    let (place, _) = line.rsplit_once(' ').unwrap();
    std::fs::write(&mass, text.replace(&line, &format!("{place} 7.0"))).unwrap();
    let output = run(&["compare", &scene, "-o", &stem, "--resume"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("files that these name have changed"));
}
