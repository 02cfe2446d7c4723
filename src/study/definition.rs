//! What a study asks for, and the tasks that this means.

use std::collections::HashMap;
use std::hash::Hasher;
use std::path::{Component, Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use siphasher::sip::SipHasher13;
use toml_edit::{DocumentMut, Item, Value};

use crate::compare::Variant;
use crate::scenario::{Change, FileName, Issue, Scene, SceneError, locate, misread, schema_of};

/// Commands that a task may be: each reads a scene and writes one file.
pub(crate) const COMMANDS: [&str; 4] = ["run", "orbit", "backbone", "response"];
/// Options that every task is given already.
const OWN_OPTIONS: [&str; 7] =
    ["-o", "--output", "--force", "--resume", "--json", "--threads", "--quiet"];
/// More tasks than this are a slip of the pen.
const MOST_TASKS: usize = 100_000;

/// A scene, a command, and the keys of the scene or options of the command that are varied: one task for every combination of values.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// The scene, relative to this file.
    #[schemars(extend("examples" = ["bar.toml"]))]
    scene: PathBuf,
    /// The command of every task.
    #[schemars(extend("enum" = COMMANDS))]
    command: String,
    /// Its options; files in them are named from the folder where the study is started.
    #[serde(default)]
    #[schemars(extend("examples" = [["--viscous", "--step=0.02"]]))]
    options: Vec<String>,
    /// The lists go side by side, first with first, second with second; otherwise every value meets every other.
    #[serde(default)]
    zip: bool,
    /// What is varied, a list of values each: keys of the scene (`"contact.gap"`, `"load[0].amplitude"`; `"contact.method"` by the names of `compare --methods`) and options
    /// (`"--omega"`; a flag takes `[true, false]`), in quotation marks.
    #[schemars(with = "HashMap<String, Vec<serde_json::Value>>")]
    vary: toml::Table,
}

/// A key that is varied, with its values as TOML.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Varied {
    /// `contact.gap`, or an option of the command: `--omega`.
    pub key: String,
    /// Values; a text without quotation marks.
    pub values: Vec<String>,
}

impl Varied {
    fn is_option(&self) -> bool {
        self.key.starts_with("--")
    }
}

/// A study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its file.
    pub path: PathBuf,
    /// The whole text.
    pub text: String,
    /// The scene that is varied.
    pub scene: Scene,
    /// The command of all tasks.
    pub command: String,
    /// Its options.
    pub options: Vec<String>,
    /// What is varied, in the order of the file.
    pub vary: Vec<Varied>,
    /// The lists go side by side; otherwise every value meets every other.
    pub zip: bool,
}

/// One command of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// Name of its folder: says what it computes, whatever its place in the study.
    pub id: String,
    /// Value of every varied key, in their order.
    pub values: Vec<String>,
    /// Its scene.
    pub scene: String,
    /// The command and its options.
    pub command: Vec<String>,
}

impl Study {
    /// JSON Schema (draft 7) of a study's file.
    pub fn schema() -> serde_json::Value {
        schema_of::<Keys>("A study of signorini")
    }

    /// Read a study and its scene.
    pub fn read(path: &Path) -> Result<Study, SceneError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|e| SceneError::Unreadable { file: file.clone(), reason: e.to_string() })?;
        let keys: Keys = toml::from_str(&text).map_err(|e| misread(&e, &file, &text))?;
        let issue = |key: &str, message: String, help: &str| {
            locate(Issue::new(key, message, help), &file, &text)
        };
        if !COMMANDS.contains(&keys.command.as_str()) {
            let help = format!("give one of {}", COMMANDS.join(", "));
            return Err(issue(
                "command",
                format!("\"{}\" is no command of tasks", keys.command),
                &help,
            ));
        }
        let own = |o: &&String| OWN_OPTIONS.contains(&o.split('=').next().unwrap_or(o));
        if let Some(own) = keys.options.iter().find(own) {
            let help =
                "leave it out: every task writes into its own folder, on the threads of its worker";
            return Err(issue("options", format!("{own} is what the study says itself"), help));
        }
        let vary = ordered(&keys, &text).map_err(|i| locate(i, &file, &text))?;
        let count = |v: &Varied| v.values.len();
        if keys.zip && vary.iter().any(|v| count(v) != count(&vary[0])) {
            let counts: Vec<String> =
                vary.iter().map(|v| format!("{} has {}", v.key, count(v))).collect();
            let message =
                format!("lists side by side have to be of one length: {}", counts.join(", "));
            return Err(issue("vary", message, "give lists of one length, or leave zip out"));
        }
        let product = vary.iter().fold(1usize, |n, v| n.saturating_mul(count(v)));
        if product > MOST_TASKS && !keys.zip {
            let message = format!("{product} tasks are more than {MOST_TASKS}");
            return Err(issue("vary", message, "give fewer values, or zip = true"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let scene = Scene::read(&folder.join(&keys.scene))?;
        let Keys { command, options, zip, .. } = keys;
        Ok(Study { path: path.to_owned(), text, scene, command, options, vary, zip })
    }

    /// The file name without folder and ending.
    pub fn stem(&self) -> String {
        self.path.file_stem().map_or_else(|| "study".into(), |s| s.to_string_lossy().into_owned())
    }

    /// An issue at its place in the file.
    fn error(&self, key: &str, message: String, help: &str) -> SceneError {
        let file = self.path.display().to_string();
        locate(Issue::new(key, message, help), &file, &self.text)
    }

    /// All tasks in the order of the file, the last key fastest; every scene is checked. `place`: where the folders of the tasks will stand (files that the scene names
    /// are named from there).
    pub fn tasks(&self, place: &Path) -> Result<Vec<Task>, SceneError> {
        let mut sums = Sums::default();
        let count = match self.zip {
            true => self.vary.first().map_or(1, |v| v.values.len()),
            false => self.vary.iter().map(|v| v.values.len()).product(),
        };
        let mut tasks: Vec<Task> = vec![];
        for k in 0..count {
            let mut rest = k;
            let mut chosen = vec![0; self.vary.len()];
            for (at, varied) in chosen.iter_mut().zip(&self.vary).rev() {
                *at = if self.zip { k } else { rest % varied.values.len() };
                rest /= varied.values.len();
            }
            let task = self.task(&chosen, place, &mut sums)?;
            if let Some(twin) = tasks.iter().position(|t| t.id == task.id) {
                let said = |t: &Task| t.values.join(", ");
                let message =
                    format!("task {} ({}) computes what task {twin} does", k, said(&task));
                return Err(self.error("vary", message, "give every value once"));
            }
            tasks.push(task);
        }
        Ok(tasks)
    }

    fn task(&self, chosen: &[usize], place: &Path, sums: &mut Sums) -> Result<Task, SceneError> {
        let (mut changes, mut command) = (vec![], vec![self.command.clone()]);
        command.extend(self.options.iter().cloned());
        let mut values = vec![];
        for (varied, &at) in self.vary.iter().zip(chosen) {
            let value = &varied.values[at];
            values.push(value.clone());
            match varied.key.as_str() {
                key if varied.is_option() => command.extend(option(key, value)),
                // a method takes the keys with it that it does not read
                "contact.method" => {
                    let variant = Variant::of_name(value).map_err(|e| {
                        self.error(
                            &quoted(&varied.key),
                            e.to_string(),
                            "name methods as compare --methods does",
                        )
                    })?;
                    // other keys that are varied come after it, whatever their order in the file
                    changes.splice(0..0, variant.changes());
                }
                key => changes.push(Change::set(key, value)),
            }
        }
        let changed = self.scene.with(&changes).and_then(|scene| self.seen_from(place, &scene));
        let scene = changed.map_err(|e| {
            let said: Vec<String> =
                self.vary.iter().zip(&values).map(|(v, x)| format!("{} = {x}", v.key)).collect();
            self.error(
                "vary",
                format!("with {}: {e}", said.join(", ")),
                "give keys and values that the scene takes (signorini schema --markdown lists them), or leave this combination out (zip = true names combinations one by one)",
            )
        })?;
        let mut all = command.join("\0");
        for (_, name) in scene.named_files() {
            let path = plain(&place.join("task").join(FileName::parse(&name).file));
            let sum = sums.of(&path).map_err(|e| {
                let message = format!("{}: {e}", path.display());
                self.error("vary", message, "files are named from the folder of the scene")
            })?;
            all += &format!("\0{sum:016x}");
        }
        let scene = scene.source.text;
        all += &format!("\0{scene}");
        Ok(Task { id: format!("{:016x}", checksum(all.as_bytes())), values, scene, command })
    }

    /// The way from the folder of a task to that of the scene.
    fn way(&self, place: &Path) -> PathBuf {
        let folder = self.scene.source.file.parent().unwrap_or(Path::new(""));
        way(&place.join("task"), folder)
    }

    /// A scene with the files that it names as they are seen from the folder of a task: a scene names them from its own.
    fn seen_from(&self, place: &Path, scene: &Scene) -> Result<Scene, SceneError> {
        let way = self.way(place);
        let files = scene.named_files().into_iter();
        let relative = files.filter(|(_, name)| Path::new(name).is_relative());
        let changes: Vec<Change> = relative
            .map(|(key, name)| {
                let seen = way.join(&name).display().to_string();
                Change::set(key, Value::from(seen).to_string())
            })
            .collect();
        scene.with(&changes)
    }
}

/// A checksum of 64 bits, the same on every machine (SipHash 1-3, no key).
fn checksum(bytes: &[u8]) -> u64 {
    let mut hasher = SipHasher13::new();
    hasher.write(bytes);
    hasher.finish()
}

/// Checksums of files that scenes name, each read once.
#[derive(Default)]
struct Sums(HashMap<PathBuf, u64>);

impl Sums {
    fn of(&mut self, path: &Path) -> std::io::Result<u64> {
        if let Some(sum) = self.0.get(path) {
            return Ok(*sum);
        }
        let sum = checksum(&std::fs::read(path)?);
        self.0.insert(path.to_owned(), sum);
        Ok(sum)
    }
}

/// An option with a value as a command line has it: a list by commas, a flag alone or not at all.
fn option(key: &str, value: &str) -> Option<String> {
    match value {
        "true" => Some(key.to_owned()),
        "false" => None,
        _ => {
            let list = value.strip_prefix('[').and_then(|v| v.strip_suffix(']'));
            let plain = list.map(|l| l.split(',').map(str::trim).collect::<Vec<_>>().join(","));
            Some(format!("{key}={}", plain.unwrap_or_else(|| value.to_owned())))
        }
    }
}

/// A path without `.` and `..`, which need not lead through folders that are there.
fn plain(path: &Path) -> PathBuf {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut parts = PathBuf::new();
    for part in full.components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            Component::CurDir => {}
            other => parts.push(other),
        }
    }
    parts
}

/// The way from one folder to another, of names and `..`.
fn way(from: &Path, to: &Path) -> PathBuf {
    let (from, to) = (plain(from), plain(to));
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| Component::ParentDir);
    up.chain(to.components().skip(common)).collect()
}

/// A key of `[vary]` as paths of keys name it.
fn quoted(key: &str) -> String {
    format!("vary.\"{key}\"")
}

/// What is varied in the order of the file, values as they are written.
fn ordered(keys: &Keys, text: &str) -> Result<Vec<Varied>, Issue> {
    let help = "give the key of a scene in quotation marks and a list of values: \"contact.gap\" = [0.5, 1.0]";
    let unreadable = |e: toml_edit::TomlError| Issue::new("vary", e.to_string(), help);
    let document: DocumentMut = text.parse().map_err(unreadable)?;
    let table = document.get("vary").and_then(Item::as_table_like);
    let mut all = vec![];
    for (key, item) in table.into_iter().flat_map(|t| t.iter()) {
        let Some(list) = item.as_array().filter(|a| !a.is_empty()) else {
            let what = if item.is_table_like() {
                "is a table: a key with a dot stands in quotation marks"
            } else {
                "is no list of values"
            };
            return Err(Issue::new(quoted(key), what, help));
        };
        let value = |v: &Value| match v {
            Value::String(s) => s.value().clone(),
            other => other.clone().decorated("", "").to_string(),
        };
        // 1 and 1.0 are one number, and texts of scenes that differ
        let number = |v: &Value| v.as_float().or(v.as_integer().map(|i| i as f64));
        let twin = list.iter().enumerate().find(|(k, v)| {
            number(v).is_some_and(|x| list.iter().take(*k).filter_map(number).any(|y| y == x))
        });
        if let (Some((_, v)), false) = (twin, keys.zip) {
            let message = format!("has {} twice", value(v));
            return Err(Issue::new(quoted(key), message, "give every value once"));
        }
        let varied = Varied { key: key.to_owned(), values: list.iter().map(value).collect() };
        if varied.is_option() && OWN_OPTIONS.contains(&key) {
            return Err(Issue::new(quoted(key), "is what the study says itself", help));
        }
        all.push(varied);
    }
    if all.is_empty() {
        return Err(Issue::new("vary", "is empty", help));
    }
    debug_assert_eq!(all.len(), keys.vary.len());
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_between_folders() {
        for (from, to, found) in [
            ("/a/b/c", "/a/d", "../../d"),
            ("/a/b", "/a/b/c", "c"),
            ("/a/x/../b", "/a/b", ""),
            ("/a/b", "/a", ".."),
        ] {
            assert_eq!(way(Path::new(from), Path::new(to)), Path::new(found), "{from} {to}");
        }
    }
}
