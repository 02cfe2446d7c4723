//! The schema of scenes against what the program reads: a validator of JSON Schema that is not ours takes what the program takes, and refuses what no scene may say.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{datasets, hdf5_files, root, run};
use serde_json::{Value, json};
use signorini::scenario::Scene;
use signorini::study::Study;

/// What `tests/schema.py` finds wrong with each text; none where there is no validator.
fn validate(
    schema: &Value,
    texts: &[(String, String)],
) -> Option<BTreeMap<String, Option<String>>> {
    let python = crate::common::python("jsonschema", "jsonschema")?;
    let value =
        |text: &str| toml::from_str::<Value>(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    let values: Vec<Value> = texts.iter().map(|(name, t)| json!([name, value(t)])).collect();
    let mut command = Command::new(python);
    command.arg(root().join("tests/schema.py")).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let given = json!({"schema": schema, "values": values}).to_string();
    child.stdin.take().unwrap().write_all(given.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

const BAR: &str =
    "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [4]\nyoung = 1.0\ndensity = 1.0\n";
const FREE: &str = "[contact]\nedge = 'right'\ngap = 1.0\n";
const MATRICES: &str =
    "[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n";

/// Scenes that are read, of every kind of value.
fn taken() -> Vec<(String, String)> {
    let mut all = vec![];
    for entry in std::fs::read_dir(root().join("scenarios")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            all.push((path.file_name().unwrap().to_string_lossy().into_owned(), text));
        }
    }
    assert!(all.len() >= 20);
    let place = tempfile::tempdir().unwrap();
    for kind in ["bar", "plate", "mesh", "space", "response", "matrices"] {
        let stem = place.path().join(kind);
        assert!(run(&["new", kind, stem.to_str().unwrap()]).status.success());
        let text = std::fs::read_to_string(stem.with_extension("toml")).unwrap();
        all.push((format!("new {kind}"), text));
    }
    for (k, more) in [
        "[[contact]]\nedge = 'right'\ngap = 1\n[[contact]]\nedge = 'left'\ngap = '1 + x'",
        "[contact]\nedge = 'right'\nplane = { normal = [1.0], offset = 2 }\nstress = 'reaction'",
        "[contact]\nedge = 'right'\ngap = 1\nmotion = { amplitude = 0.1, omega = 2 }",
        "[contact]\nedge = 'right'\ngap = 1\nmethod = 'nitsche'\ntheta = -1",
        "[run]\nuntil = 1\nstore = ['left']\nprecision = 'single'\nintegrator = 'dopri5'",
        "[run]\nuntil = 1\nstore = 'contact'",
        "[damping]\nratios = [[1, 0.01], [3, 0.02]]",
        "[[load]]\nkind = 'gravity'\namplitude = 1",
        "[[load]]\nkind = 'gravity'\namplitude = [1]\ntable = 'load.csv'",
        "[initial]\ndisplacement = [0]\nvelocity = ['sin(x)']",
        "[orbit]\nperiod = 4\nbeta = 'auto'\nratios = [0.1]\n[damping]\nratio = 0.1",
        "[orbit]\nomega = 4\nbeta = 0.1\nrange = [1, 2]",
        "[reduction]\ncutoff = 10",
    ]
    .iter()
    .enumerate()
    {
        all.push((format!("bar {k}"), format!("{BAR}{more}\n")));
    }
    for (k, more) in [
        "[contact]\ndisplacements = [0]\ngap = 1\nstress = [[[0, 1.0], [1, -1.0]]]",
        "[contact]\ndisplacements = [0, 1]\ngaps = [1, 2]\nn_c = 'C.mtx'\nn_o = 'model.h5:/N_O'",
        "[[load]]\nkind = 'force'\ndisplacement = 0\namplitude = 1",
    ]
    .iter()
    .enumerate()
    {
        all.push((format!("matrices {k}"), format!("{MATRICES}{more}\n")));
    }
    all
}

/// Scenes that are refused for what they say themselves.
fn refused() -> Vec<(String, String)> {
    let more = [
        "elements = 4",
        "shape = 'round'",
        "[contact]\nedge = 'front'\ngap = 1",
        "[contact]\nedge = 'right'\ngap = true",
        "[contact]\nedge = 'right'\ngap = 1\nmethod = 'magic'",
        "[contact]\nedge = 'right'\ngap = 1\nmethod = 'nitsche'\ntheta = 0.5",
        "[contact]\nedge = 'right'\ngap = 1\nmethod = 'impact'\nrestitution = 1.5",
        "[contact]\nedge = 'right'\ngap = 1\nstress = 'mean'",
        "[contact]\nedge = 'right'\ngap = 1\nmotion = { amplitude = 0.1 }",
        "[contact]\nedge = 'right'\nplane = { normal = [1.0], height = 2 }",
        "[[contact]]\nedge = 'right'\ngap = 1\nstif = 2",
        "[[support]]\nedge = 'left'\nfix = ['w']",
        "[[support]]\nedge = 'left'",
        "[support]\nedge = 'left'\nfix = ['x']",
        "[run]\nuntil = '1'",
        "[run]\nuntil = 1\nsamples = 0",
        "[run]\nuntil = 1\nsamples = 2.5",
        "[run]\nuntil = 1\nstore = 'some'",
        "[run]\nuntil = 1\nprecision = 'half'",
        "[damping]\nrayleigh = [1.0]",
        "[damping]\nratios = [[1, 0.01]]",
        "[damping]\nratios = [[1.5, 0.01], [3, 0.01]]",
        "[[load]]\nkind = 'wind'\namplitude = 1",
        "[[load]]\nkind = 'gravity'\namplitude = '1'",
        "[initial]\ndisplacement = 'x'",
        "[initial]\nequilibrium = 1",
        "[orbit]\nomega = 1\nbeta = 'some'",
        "[orbit]\nomega = 1\nrange = [1, 2, 3]",
        "[damping]\nrayleigh = [1, 2, 3]",
        "[damping]\nratios = [[1, 0.01, 2], [3, 0.01]]",
        "[damping]\nratios = [[1, 0.01], [3, 0.01], [4, 0.01]]",
        "[orbit]\nomega = 1\nharmonics = 0",
        "[reduction]\nmodes = 0",
        "[reduce]\nmodes = 1",
    ];
    // the first two stand in [body]
    let text = |m: &str| match m.starts_with('[') {
        true => format!("{BAR}{m}\n"),
        false => BAR.replace("elements = [4]\n", "") + m + "\n",
    };
    more.iter().map(|m| (m.to_string(), text(m))).collect()
}

#[test]
fn the_schema_takes_what_is_read_and_refuses_what_no_scene_may_say() {
    let (taken, refused) = (taken(), refused());
    let path = Path::new("scene.toml");
    for (name, text) in &taken {
        Scene::parse(text, path).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    for (name, text) in &refused {
        assert!(Scene::parse(text, path).is_err(), "{name} is read");
    }
    let Some(said) = validate(&Scene::schema(), &[taken.clone(), refused.clone()].concat()) else {
        return;
    };
    for (name, _) in &taken {
        assert!(said[name].is_none(), "{name}: {:?}", said[name]);
    }
    for (name, _) in &refused {
        assert!(said[name].is_some(), "{name} passes the schema");
    }
}

#[test]
fn the_schema_of_studies_likewise() {
    let study = "scene = 'bar.toml'\ncommand = 'run'\n";
    let pair = |name: &str, text: String| (name.to_owned(), text);
    let taken = [
        pair(
            "keys",
            format!("{study}[vary]\n'contact.gap' = [1, 2.0]\n'contact.method' = ['nbm']\n"),
        ),
        pair(
            "zip",
            format!("{study}zip = true\noptions = ['--verify-lcp']\n[vary]\n'--omega' = [1]\n"),
        ),
    ];
    let refused = [
        pair("no scene", "command = 'run'\n[vary]\na = [1]\n".to_owned()),
        pair("command", format!("{}[vary]\na = [1]\n", study.replace("run", "fly"))),
        pair("no list", format!("{study}[vary]\n'contact.gap' = 1\n")),
        pair("key", format!("{study}varied = 1\n[vary]\n'contact.gap' = [1]\n")),
    ];
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("bar.toml"), format!("{BAR}{FREE}")).unwrap();
    let read = |text: &str| {
        let path = place.path().join("study.toml");
        std::fs::write(&path, text).unwrap();
        Study::read(&path)
    };
    taken.iter().for_each(|(name, t)| drop(read(t).unwrap_or_else(|e| panic!("{name}: {e}"))));
    refused.iter().for_each(|(name, t)| assert!(read(t).is_err(), "{name} is read"));
    let Some(said) = validate(&Study::schema(), &[&taken[..], &refused[..]].concat()) else {
        return;
    };
    taken.iter().for_each(|(name, _)| assert!(said[name].is_none(), "{name}: {:?}", said[name]));
    refused.iter().for_each(|(name, _)| assert!(said[name].is_some(), "{name} passes"));
}

/// What a key is by default, as the schema says, it is: written down, it changes nothing; and another value does change something.
#[test]
fn defaults_are_what_the_schema_says() {
    let schema = Scene::schema();
    let plate = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nBODY\n\
                 [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.1\nCONTACT\n\
                 [damping]\nratio = 0.01\nDAMPING\n[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.02, 0.01]\nomega = 2.0\nLOAD\n[initial]\nmode = 2\namplitude = -1.5\n[run]\nuntil = 4.0\nRUN\n";
    let bar = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [8]\nyoung = 1.0\ndensity = 1.0\nBODY\n\
               [[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = 0.1\nCONTACT\n\
               [[load]]\nkind = 'point'\nat = [1.0]\namplitude = [0.1]\n[initial]\ndisplacement = ['-0.2*x']\n[run]\nuntil = 4.0\nRUN\n";
    let undamped = plate.replace("[damping]\nratio = 0.01\nDAMPING\n", "");
    let waves = bar.replace("[[load]]\nkind = 'point'\nat = [1.0]\namplitude = [0.1]\n", "");
    let place = tempfile::tempdir().unwrap();
    let outcome = |text: &str| -> Value {
        let path = place.path().join("scene.toml");
        let text = ["BODY", "CONTACT", "DAMPING", "LOAD", "RUN"]
            .iter()
            .fold(text.to_owned(), |t, w| t.replace(w, ""));
        std::fs::write(&path, text).unwrap();
        let output = place.path().join("scene.h5");
        let (scene, written) = (path.to_str().unwrap(), output.to_str().unwrap());
        // a run that ends early says why
        let said = run(&["run", scene, "-o", written, "--force", "--json"]).stdout;
        let answer: Value = serde_json::from_slice(&said).unwrap();
        // of the whole file it changes by where the text of the scene ends up in it
        let file = hdf5_files().open(&output).unwrap();
        let names = datasets(&output).into_keys();
        let size: u64 = names.map(|name| file.dataset(&name).unwrap().storage_size()).sum();
        json!([answer["final"], answer["switches"], answer["verdict"], size])
    };
    let cases = [
        (plate, "BODY", "Body", "thickness", "", "2.0"),
        (plate, "BODY", "Body", "mass", "", "'lumped'"),
        (bar, "BODY", "Body", "area", "", "2.0"),
        (plate, "CONTACT", "Table", "boundary_mass", "", "'lumped'"),
        (plate, "CONTACT", "Table", "method", "", "'penalty'"),
        (plate, "CONTACT", "Table", "mass", "method = 'mass-redistribution'\n", "'optimal'"),
        (plate, "CONTACT", "Table", "stiffness", "method = 'penalty'\n", "3.0"),
        (plate, "CONTACT", "Table", "gamma", "method = 'nitsche'\n", "30.0"),
        (plate, "CONTACT", "Table", "theta", "method = 'nitsche'\ngamma = 30.0\n", "0.0"),
        (&undamped, "CONTACT", "Table", "restitution", "method = 'impact'\n", "0.5"),
        (&undamped, "CONTACT", "Table", "activation", "method = 'moreau-jean'\n", "'full-step'"),
        (&waves, "CONTACT", "Table", "instants", "method = 'waves'\n", "'step'"),
        (plate, "DAMPING", "Damping", "mode", "", "2"),
        (plate, "LOAD", "Load", "phase", "", "1.0"),
        (plate, "RUN", "Run", "integrator", "rtol = 1e-5\n", "'dopri5'"),
        (plate, "RUN", "Run", "rtol", "integrator = 'dopri5'\n", "1e-4"),
        (plate, "RUN", "Run", "atol", "integrator = 'dopri5'\n", "1e-3"),
        (plate, "RUN", "Run", "samples", "", "100"),
        (plate, "RUN", "Run", "store", "", "'contact'"),
        (plate, "RUN", "Run", "precision", "", "'single'"),
        (plate, "RUN", "Run", "switch_limit", "", "0.01"),
    ];
    for (scene, mark, table, key, more, other) in cases {
        let said = &schema["definitions"][table]["properties"][key];
        let default = said.get("default").unwrap_or_else(|| panic!("{table}.{key}"));
        let with = |line: &str| outcome(&scene.replace(mark, &format!("{more}{line}")));
        let without = with("");
        let (written, changed) =
            (with(&format!("{key} = {default}")), with(&format!("{key} = {other}")));
        assert!(written == without, "{table}.{key} is not {default} by default");
        assert!(changed != without, "{table}.{key} = {other} changes nothing");
    }
}

/// The pages of keys and of datasets are what the program says.
#[test]
fn the_pages_of_keys_are_what_the_program_says() {
    for (page, words) in [
        ("scenes", &["schema", "--markdown"][..]),
        ("studies", &["schema", "study", "--markdown"]),
        ("datasets", &["schema", "files", "--markdown"]),
    ] {
        let path = root().join(format!("docs/reference/{page}.md"));
        let page = std::fs::read_to_string(path).unwrap();
        let said = String::from_utf8(run(words).stdout).unwrap();
        let at = page.lines().zip(said.lines()).find(|(a, b)| a != b);
        assert!(page == said, "make docs writes it anew; first difference: {at:?}");
    }
}
