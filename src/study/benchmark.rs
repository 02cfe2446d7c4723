//! Benchmarks: problems with numbers that other codes can be held against as well.
//!
//! A benchmark is a folder with a scene and `benchmark.toml`: what is measured, by which command, against which number of which source, and how near is near enough. Those of
//! `validate/benchmarks` are built in; what another code finds for them comes in [`Results`].

use std::collections::BTreeMap;
use std::path::Path;

use exmex::{Express, FlatEx};
use serde::Deserialize;
use serde_json::Value;

/// Where a reference comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Origin {
    /// Pencil and paper.
    #[serde(rename = "closed form")]
    ClosedForm,
    /// Printed.
    #[serde(rename = "published")]
    Published,
    /// Computed by a program of other design.
    #[serde(rename = "other program")]
    OtherProgram,
}

impl Origin {
    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Origin::ClosedForm => "closed form",
            Origin::Published => "published",
            Origin::OtherProgram => "other program",
        }
    }
}

/// A number that is asked for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// What it is.
    pub name: String,
    /// Where its parts stand in the answer of the command.
    find: BTreeMap<String, String>,
    /// What is made of them; absent: there is one, and it is that.
    formula: Option<String>,
    /// The number of the source.
    pub reference: f64,
    /// How far from it is near enough, relative.
    pub within: f64,
    /// What is to be known about it.
    pub note: Option<String>,
}

/// A command and what it finds.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measure {
    /// The command with its options, without the scene and the file of its results.
    pub command: Vec<String>,
    /// What is read from its answer.
    #[serde(rename = "quantity")]
    pub quantities: Vec<Quantity>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    title: String,
    about: String,
    kind: Origin,
    source: String,
    #[serde(rename = "measure")]
    measures: Vec<Measure>,
}

/// A problem with numbers of others.
#[derive(Debug, Clone)]
pub struct Benchmark {
    /// That of its folder.
    pub name: String,
    /// In a line.
    pub title: String,
    /// What it asks of a code.
    pub about: String,
    /// Where its numbers come from.
    pub kind: Origin,
    /// Who says so.
    pub source: String,
    /// What is measured.
    pub measures: Vec<Measure>,
    /// Its files: `benchmark.toml`, `scene.toml` and what that names.
    pub files: Vec<(String, Vec<u8>)>,
}

macro_rules! built_in {
    ($($name:literal: $($file:literal)*;)*) => {
        [$(($name, include_str!(concat!("../../validate/benchmarks/", $name, "/benchmark.toml")), &[
            ("scene.toml", include_str!(concat!("../../validate/benchmarks/", $name, "/scene.toml"))),
            $(($file, include_str!(concat!("../../validate/benchmarks/", $name, "/", $file))),)*
        ])),*]
    };
}

/// A file by name.
type File = (&'static str, &'static str);

/// Names, definitions, files.
static BUILT_IN: [(&str, &str, &[File]); 11] = built_in! {
    "two-element-bar":;
    "nonsmooth-mode":;
    "bouncing-bar":;
    "rod-against-wall":;
    "sphere-on-plane": "sphere-ring.msh";
    "elastic-stop-mode": "one.mtx";
    "elastic-stop-response": "one.mtx";
    "dry-oscillator":;
    "den-hartog":;
    "jenkins-element":;
    "two-frequencies": "two-mass-stop-M.mtx" "two-frequencies-K.mtx";
};

impl Benchmark {
    /// Those that are built in.
    pub fn all() -> Result<Vec<Benchmark>, String> {
        let read = |(name, text, files): &(&str, &str, &[File])| {
            let files =
                files.iter().map(|(name, text)| (String::from(*name), text.as_bytes().to_vec()));
            Benchmark::parse(name, text, files.collect())
        };
        BUILT_IN.iter().map(read).collect()
    }

    /// That of a folder, with all files beside `benchmark.toml`.
    pub fn read(folder: &Path) -> Result<Benchmark, String> {
        let failed = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
        let path = folder.join("benchmark.toml");
        let definition = std::fs::read_to_string(&path).map_err(|e| failed(&path, e))?;
        let mut files = vec![];
        collect(folder, folder, &mut files).map_err(|e| failed(folder, e))?;
        files.sort();
        let name = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = name.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Benchmark::parse(&name, &definition, files)
    }

    fn parse(name: &str, text: &str, files: Vec<(String, Vec<u8>)>) -> Result<Benchmark, String> {
        let at = |what: String| format!("{name}/benchmark.toml: {what}");
        let keys: Keys = toml::from_str(text).map_err(|e| at(e.to_string()))?;
        let Keys { title, about, kind, source, measures } = keys;
        let mut names = vec![];
        for q in measures.iter().flat_map(|m| &m.quantities) {
            let of = |what: String| at(format!("{}: {what}", q.name));
            if q.find.is_empty() {
                return Err(of("find: where in the answer the number stands".into()));
            }
            // a formula that cannot be read, or knows other names, is found before anything is computed
            let known: BTreeMap<String, f64> = q.find.keys().map(|k| (k.clone(), 1.0)).collect();
            q.of(&known).map_err(of)?;
            if !q.reference.is_finite() || q.reference == 0.0 {
                return Err(of(
                    "reference: a number, and not zero, because within is relative".into()
                ));
            }
            if !(q.within.is_finite() && q.within > 0.0) {
                return Err(of("within: a positive number".into()));
            }
            if names.contains(&&q.name) {
                return Err(of("two quantities are called so".into()));
            }
            names.push(&q.name);
        }
        if names.is_empty() || measures.iter().any(|m| m.quantities.is_empty()) {
            return Err(at("measure: each has a quantity at least".into()));
        }
        if measures.iter().any(|m| m.command.is_empty()) {
            return Err(at("command: the name of a command, and its options".into()));
        }
        if !files.iter().any(|(name, _)| name == "scene.toml") {
            return Err(at("scene.toml is missing beside it".into()));
        }
        let (name, mut files) = (name.to_owned(), files);
        files.push(("benchmark.toml".to_owned(), text.as_bytes().to_vec()));
        Ok(Benchmark { name, title, about, kind, source, measures, files })
    }

    /// All quantities in their order.
    pub fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        self.measures.iter().flat_map(|m| &m.quantities)
    }
}

impl Quantity {
    /// The formula of its parts.
    fn of(&self, parts: &BTreeMap<String, f64>) -> Result<f64, String> {
        let Some(formula) = &self.formula else {
            let mut values = parts.values();
            return match (values.next(), values.next()) {
                (Some(x), None) => Ok(*x),
                _ => Err("find has several parts: give formula = \"…\" of their names".into()),
            };
        };
        let tree = FlatEx::<f64>::parse(formula).map_err(|e| format!("formula: {e}"))?;
        let value = |name: &String| {
            parts.get(name).copied().ok_or_else(|| format!("formula: no part is called {name}"))
        };
        let values = tree.var_names().iter().map(value).collect::<Result<Vec<f64>, String>>()?;
        tree.eval(&values).map_err(|e| format!("formula: {e}"))
    }

    /// Its number in the answer of the command.
    pub fn in_answer(&self, answer: &Value) -> Result<f64, String> {
        let part = |(name, path): (&String, &String)| {
            let there = at(answer, path);
            let found = there.as_ref().and_then(Value::as_f64);
            let found = found.ok_or_else(|| match there {
                Some(Value::Array(list)) if !list.is_empty() => {
                    format!("a list stands at {path} of the answer: say which, {path}/0")
                }
                _ => format!("no number at {path} of the answer"),
            })?;
            Ok((name.clone(), found))
        };
        let found = self.of(&self.find.iter().map(part).collect::<Result<_, String>>()?)?;
        match found.is_finite() {
            true => Ok(found),
            false => Err(format!("the formula gives {found}")),
        }
    }

    /// How far a number is from the reference, relative.
    pub fn off(&self, x: f64) -> f64 {
        (x - self.reference).abs() / self.reference.abs()
    }

    /// Whether a number is within the tolerance.
    pub fn accepts(&self, x: f64) -> bool {
        self.off(x) <= self.within
    }
}

/// The files of a folder and of those in it, but `benchmark.toml` and what is hidden, by their names from there.
fn collect(folder: &Path, root: &Path, files: &mut Vec<(String, Vec<u8>)>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().into_owned();
        let is_hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        match path.is_dir() {
            _ if is_hidden || name == "benchmark.toml" => {}
            true => collect(&path, root, files)?,
            false => files.push((name, std::fs::read(&path)?)),
        }
    }
    Ok(())
}

/// What stands at a path of an answer: names and numbers between strokes; `-1` is the last of a list, `special=fold` all of a list of which the entry `special` begins so.
fn at(answer: &Value, path: &str) -> Option<Value> {
    let mut here = answer.clone();
    for part in path.split('/').filter(|p| !p.is_empty()) {
        here = match &here {
            Value::Object(map) => map.get(part)?.clone(),
            Value::Array(list) => match part.split_once('=') {
                Some((key, word)) => {
                    let fits = |v: &&Value| {
                        v.get(key).and_then(Value::as_str).is_some_and(|s| s.starts_with(word))
                    };
                    Value::Array(list.iter().filter(fits).cloned().collect())
                }
                None => {
                    let k: isize = part.parse().ok()?;
                    let from_end = |k: isize| list.len().checked_sub(k.unsigned_abs());
                    let k = if k < 0 { from_end(k)? } else { k.unsigned_abs() };
                    list.get(k)?.clone()
                }
            },
            _ => return None,
        };
    }
    Some(here)
}

/// What another code found.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// Its name and version.
    pub code: String,
    /// Who ran it, how, on what.
    #[serde(default)]
    pub note: String,
    /// By benchmark, and in it by quantity.
    #[serde(default)]
    pub values: BTreeMap<String, BTreeMap<String, f64>>,
    /// Seconds by benchmark.
    #[serde(default)]
    pub seconds: BTreeMap<String, f64>,
}

impl Results {
    /// The results of a file; every name in it is one that a benchmark has.
    pub fn read(path: &Path, benchmarks: &[Benchmark]) -> Result<Results, String> {
        let at = |what: String| format!("{}: {what}", path.display());
        let text = std::fs::read_to_string(path).map_err(|e| at(e.to_string()))?;
        let results: Results = toml::from_str(&text).map_err(|e| at(e.to_string()))?;
        if results.values.values().all(BTreeMap::is_empty) {
            return Err(at("values: none is filled in".into()));
        }
        if results.code.chars().any(char::is_control) {
            return Err(at("code: a name in one line".into()));
        }
        if let Some((name, _)) =
            results.seconds.iter().find(|(_, s)| !(s.is_finite() && **s >= 0.0))
        {
            return Err(at(format!("seconds.{name}: a number, not negative")));
        }
        let named = |name: &String| benchmarks.iter().any(|b| b.name == *name);
        if let Some(name) = results.seconds.keys().find(|name| !named(name)) {
            return Err(at(format!("seconds.{name}: no such benchmark")));
        }
        for (name, values) in &results.values {
            let Some(benchmark) = benchmarks.iter().find(|b| b.name == *name) else {
                let mut known: Vec<&str> = benchmarks.iter().map(|b| b.name.as_str()).collect();
                known.sort_unstable();
                known.dedup();
                return Err(at(format!(
                    "values.{name}: no such benchmark; there are {}",
                    known.join(", ")
                )));
            };
            for (key, x) in values {
                if !x.is_finite() {
                    return Err(at(format!("values.{name}.{key:?}: a finite number")));
                }
                if !benchmark.quantities().any(|q| q.name == *key) {
                    let known: Vec<&str> =
                        benchmark.quantities().map(|q| q.name.as_str()).collect();
                    return Err(at(format!(
                        "values.{name}: no quantity \"{key}\"; there are {}",
                        known.join("; ")
                    )));
                }
            }
        }
        Ok(results)
    }

    /// The form in which another code says what it found.
    pub fn form(benchmarks: &[&Benchmark]) -> String {
        let mut out = "# What another code finds: fill in, leave out what it cannot do, and give it to\n#   signorini benchmark --with FILE\n\
             code = \"name and version\"\nnote = \"who ran it, how, on what\"\n\n# seconds by benchmark\n[seconds]\n"
            .to_owned();
        for b in benchmarks {
            out += &format!("# {} =\n", b.name);
        }
        for b in benchmarks {
            let about = &b.about;
            out += &format!("\n# {}: {}\n# {about}\n", b.title, b.source);
            out += &format!("# The scene: signorini benchmark {} --keep FOLDER\n", b.name);
            out += &format!("[values.{}]\n", b.name);
            for q in b.quantities() {
                let within = format!("within {:e} here", q.within);
                out += &format!("# {:?} =    # reference {}, {within}\n", q.name, q.reference);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn places_of_an_answer_are_found() {
        let answer = json!({"points": [{"special": "regular", "w": 1}, {"special": "fold", "w": 2}, {"special": "fold", "w": 3}]});
        let found = |path| at(&answer, path).and_then(|v| v.as_f64());
        assert_eq!(found("/points/0/w"), Some(1.0));
        assert_eq!(found("/points/-1/w"), Some(3.0));
        assert_eq!(found("/points/special=fold/0/w"), Some(2.0));
        assert_eq!(found("/points/special=fold/2/w"), None);
        assert_eq!(found("/points/-4/w"), None);
        assert_eq!(found("/nowhere"), None);
    }

    #[test]
    fn what_a_definition_lacks_is_said() {
        let whole = "title = 'a'\nabout = 'b'\nkind = 'published'\nsource = 'c'\n[[measure]]\ncommand = ['run']\n[[measure.quantity]]\nname = 'q'\n\
                     find = { a = '/a', b = '/b' }\nformula = 'a - b'\nreference = 1.0\nwithin = 1e-3\n";
        let files = || vec![("scene.toml".to_owned(), vec![])];
        let read = |text: &str| Benchmark::parse("x", text, files());
        let b = read(whole).unwrap();
        let q = b.quantities().next().unwrap();
        assert_eq!(q.in_answer(&json!({"a": 3.5, "b": 1.5})), Ok(2.0));
        assert!(q.in_answer(&json!({"a": 3.5})).unwrap_err().contains("/b"));
        for (old, new, said) in [
            ("formula = 'a - b'\n", "", "several parts"),
            ("'a - b'", "'a - c'", "no part is called c"),
            ("reference = 1.0", "reference = 0.0", "not zero"),
            ("within = 1e-3", "within = -1e-3", "positive"),
            ("find = { a = '/a', b = '/b' }", "find = {}", "where in the answer"),
            ("'published'", "'rumour'", "closed form"),
            ("['run']", "[]", "name of a command"),
        ] {
            let error = read(&whole.replace(old, new)).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        assert!(Benchmark::parse("x", whole, vec![]).unwrap_err().contains("scene.toml"));
    }
}
