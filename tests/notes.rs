//! What a summary says of a scene beside its result: which nodes places name, and what of it has no effect.

use crate::common::{problem, root, shipped};
use serde_json::Value;
use signorini::problem::{Notes, Problem};
use signorini::scenario::Scene;

fn plate(rest: &str) -> String {
    format!("{}{rest}", crate::common::half_plate(8, 3, "method = \"mass-redistribution\"\n"))
}

fn notes(rest: &str) -> Notes {
    problem(&plate(rest)).notes
}

/// A shipped scene with more in it.
fn with(name: &str, more: &str) -> Scene {
    let text = format!("{}\n{more}\n", shipped(name).source.text);
    Scene::parse(&text, &root().join("scenarios").join(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// In space a place has three coordinates: opposite poles are opposite nodes.
#[test]
fn a_point_load_acts_where_its_place_is() {
    let mut forces = vec![];
    for z in [1.0, -1.0] {
        let load = format!(
            "[[load]]\nkind = \"point\"\nat = [0, 0, {z:?}]\namplitude = [0.0, 0.0, -1e-3]"
        );
        let p = Problem::new(&with("sphere-eighth.toml", &load), None).unwrap();
        let [place] = &p.notes.places[..] else { panic!("{:?}", p.notes) };
        let at = p.system.body.mesh.nodes()[place.node];
        assert!((at[2] - z).abs() < 1e-9 && at[0].hypot(at[1]) < 1e-9, "{at:?}");
        assert_eq!((place.found, place.wanted.len(), place.key.as_str()), (at, 3, "load[0].at"));
        assert!(place.distance < 1e-9);
        // the whole force, at this node alone
        let force = p.system.loads.constant.clone().unwrap();
        let nodal = p.system.body.dofs.scatter(&force);
        assert!((nodal[3 * place.node + 2] + 1e-3).abs() < 1e-15, "{}", nodal[3 * place.node + 2]);
        forces.push(force);
    }
    assert_ne!(forces[0], forces[1]);
}

/// Every place in a body is near it, also where nodes are far apart; what lies outside is refused, and the message says how far.
#[test]
fn places_far_outside_are_refused() {
    for name in ["bracket.toml", "sphere-eighth.toml"] {
        let scene = shipped(name);
        let mesh = signorini::problem::mesh(&scene).unwrap();
        for e in mesh.elements().step_by(17) {
            let corners = mesh.corners(e);
            let n = corners.len() as f64;
            let middle = std::array::from_fn(|c| corners.iter().map(|p| p[c]).sum::<f64>() / n);
            assert!(mesh.is_near(middle), "{name}: {middle:?}");
        }
        let [low, high] = signorini::mesh::bounds(mesh.nodes());
        let beyond = std::array::from_fn(|c| high[c] + 0.7 * (high[c] - low[c]));
        assert!(!mesh.is_near(beyond) && !mesh.is_near([f64::NAN; 3]));
    }
    for (name, at) in [
        ("bracket.toml", "[1e6, 1e6]"),
        ("bracket.toml", "[0.3, 0.0]"),
        ("bracket.toml", "[nan, 0.0]"),
        ("sphere-eighth.toml", "[0, 0, 1.6]"),
    ] {
        let zeros = if name == "bracket.toml" { "[0.0, 1.0]" } else { "[0.0, 0.0, 1.0]" };
        let load = format!("[[load]]\nkind = \"point\"\nat = {at}\namplitude = {zeros}");
        let error = Problem::new(&with(name, &load), None).unwrap_err().to_string();
        assert!(error.contains("load[0].at") && error.contains("half an element"), "{error}");
    }
}

#[test]
fn loads_on_held_places_are_said() {
    let load = |what: &str| format!("[[load]]\n{what}\nomega = 1.3\n");
    for (what, words) in [
        (
            "kind = \"point\"\nat = [0.0, 0.1]\namplitude = [1.0, 0.5]",
            "load[0] (\"point\") acts on",
        ),
        ("kind = \"point\"\nat = [0.5, 0.0]\namplitude = [1.0, 0.5]", "the y component of load[0]"),
        (
            "kind = \"traction\"\nedge = \"bottom\"\namplitude = [1.0, 0.5]",
            "the y component of load[0]",
        ),
        (
            "kind = \"traction\"\nedge = \"left\"\namplitude = [1.0, 0.5]",
            "load[0] (\"traction\") acts on",
        ),
        ("kind = \"traction\"\nedge = \"top\"\namplitude = [1.0, 0.5]", ""),
        ("kind = \"point\"\nat = [0.5, 0.1]\namplitude = [1.0, 0.5]", ""),
        ("kind = \"point\"\nat = [0.5, 0.0]\namplitude = [1.0, 0.0]", ""),
        ("kind = \"gravity\"\namplitude = [0.0, -9.81]", ""),
        ("kind = \"base\"\nedge = \"left\"\namplitude = [1.0, 0.0]", ""),
    ] {
        let said = notes(&load(what)).warnings;
        match words {
            "" => assert!(said.is_empty(), "{what}: {said:?}"),
            _ => assert!(said.len() == 1 && said[0].contains(words), "{what}: {said:?}"),
        }
    }
}

#[test]
fn initial_states_that_contradict_a_support_are_said() {
    let base = "[[load]]\nkind = \"base\"\nedge = \"left\"\namplitude = [0.5, 0.0]\nomega = 0.4\nphase = 0.3\n";
    let motion = |text: &str| {
        plate(text).replace(
            "gap = 1.0\n",
            "gap = 1.0\nmotion = { amplitude = 0.5, omega = 0.4, phase = 0.3 }\n",
        )
    };
    let (at, rate) = (0.5 * f64::cos(0.3), -0.2 * f64::sin(0.3));
    let initial = |u: f64, v: f64| {
        format!(
            "[initial]\ndisplacement = [\"{u} - 0.1*x\", \"0.2*y*x\"]\nvelocity = [\"{v}\", \"0\"]\n"
        )
    };
    let said = |text: &str| problem(text).notes.warnings;
    assert!(said(&plate(&initial(0.0, 0.0))).is_empty());
    assert!(said(&plate(&format!("{base}{}", initial(at, rate)))).is_empty());
    // the support stays where it is, and only the obstacle moves
    assert!(said(&motion(&initial(0.0, 0.0))).is_empty());
    let wrong = said(&plate(&initial(0.3, 0.0)));
    assert!(
        wrong.len() == 1
            && wrong[0].contains("initial.displacement contradicts a support by up to 3.000e-1"),
        "{wrong:?}"
    );
    let wrong = said(&plate(&format!("{base}{}", initial(at, 0.0))));
    assert!(wrong.len() == 1 && wrong[0].contains("initial.velocity"), "{wrong:?}");
    assert_eq!(said(&plate(&format!("{base}{}", initial(0.0, 0.0)))).len(), 2);
}

/// A state of the fifth mode under three modes: what is left is that of the projection, and the share is its complement.
#[test]
fn what_a_reduction_cuts_off_is_said() {
    let start = "[initial]\nmode = 5\namplitude = 0.2\n";
    let whole = problem(&plate(start));
    assert!(whole.notes.warnings.is_empty());
    let said = problem(&plate(&format!("{start}[reduction]\nmodes = 3\n"))).notes.warnings;
    assert!(
        said.len() == 1 && said[0].contains("of the elastic energy off the initial displacement"),
        "{said:?}"
    );
    let share: f64 = said[0].split(' ').find_map(|w| w.parse().ok()).unwrap();
    // the elastic energy over u_O alone, before and after
    let energy =
        |p: &Problem| p.system.body.stiffness.leading(p.system.n_o()).quadratic(&p.initial.u);
    let kept = energy(&problem(&plate(&format!("{start}[reduction]\nmodes = 3\n"))));
    assert!((share - (1.0 - kept / energy(&whole))).abs() < 0.01 * share, "{share} {kept}");
    assert!(share > 1e-3);
    let all = problem(&plate(&format!("{start}[reduction]\ncutoff = 1e9\n"))).notes.warnings;
    assert!(all.is_empty(), "{all:?}");
}

/// All of it stands in the summary, in words and in JSON; a tolerance counts only where a Runge–Kutta method took part.
#[test]
fn summaries_tell_places_and_warnings() {
    let folder = tempfile::tempdir().unwrap();
    let run = |integrator: &str, as_json: bool| -> String {
        let text = plate(&format!(
            "[[load]]\nkind = \"point\"\nat = [0.52, 0.0]\namplitude = [0.01, 0.5]\n[run]\nuntil = 2.0\nrtol = 1e-9\nintegrator = \"{integrator}\"\n"
        ));
        let scene = folder.path().join("scene.toml");
        std::fs::write(&scene, text).unwrap();
        let mut command = crate::common::program();
        command.arg("run").arg(&scene).arg("-o").arg(folder.path().join("out.h5")).arg("--force");
        if as_json {
            command.arg("--json");
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let said = |integrator: &str| serde_json::from_str::<Value>(&run(integrator, true)).unwrap();
    let exact = said("modal");
    let words: Vec<&str> =
        exact["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    assert!(
        words.len() == 2
            && words[0].contains("the y component of load[0]")
            && words[1].contains("run.rtol"),
        "{words:?}"
    );
    assert_eq!(exact["places"][0]["key"], "load[0].at");
    assert_eq!(exact["places"][0]["place"], serde_json::json!([0.52, 0.0]));
    assert_eq!(exact["places"][0]["at"], serde_json::json!([0.5, 0.0]));
    assert_eq!(said("dop853")["warnings"].as_array().unwrap().len(), 1);
    let text = run("modal", false);
    let node = &exact["places"][0]["node"];
    assert!(
        text.contains(&format!(
            "load[0].at: node {node}, nearest to (0.5200000, 0): at (0.5000000, 0), 0.0200 away"
        )),
        "{text}"
    );
    assert!(
        text.contains("the y component of load[0]") && text.contains("run.rtol has no effect"),
        "{text}"
    );
}

/// Gaps of a body from matrices: a list under the wrong key, and none at all.
#[test]
fn messages_on_gaps_name_what_fits() {
    let scene = |gap: &str| {
        let text = format!(
            "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n[contact]\ndisplacements = [0, 1, 2]\n{gap}\n"
        );
        let error = Scene::parse(&text, std::path::Path::new("scene.toml")).unwrap_err();
        format!("{error} / {}", miette::Diagnostic::help(&error).unwrap())
    };
    let list = scene("gap = [1e-3, 2e-3, 3e-3]");
    assert!(list.contains("contact.gap") && list.contains("gaps = ["), "{list}");
    let none = scene("");
    assert!(
        none.contains("contact.gap: is missing") && none.contains("gaps = [1.0, 1.0, 1.0]"),
        "{none}"
    );
    let expression = scene("gap = \"1 + x\"");
    assert!(expression.contains("expression") && expression.contains("gap = 1.0"), "{expression}");
    let both = scene("gap = 1.0\ngaps = [1.0, 1.0, 1.0]");
    assert!(both.contains("stands beside gaps"), "{both}");
}
