//! A scene with some keys changed: what comparisons and studies vary. The text is changed, with its comments and lines kept, and read again: a changed scene is
//! checked like any other.

use toml_edit::{DocumentMut, Item, Table, TableLike, TomlError, Value};

use super::{Issue, Scene, SceneError};

/// A key, and the value that it is given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Path of the key: `contact.gamma`, `load[0].amplitude`.
    pub key: String,
    /// Its value as TOML; a word that is no TOML is text. None: the key is removed.
    pub value: Option<String>,
}

impl Change {
    /// Give a key a value.
    pub fn set(key: impl Into<String>, value: impl Into<String>) -> Change {
        Change { key: key.into(), value: Some(value.into()) }
    }

    /// Take a key away; nothing happens if it is not there.
    pub fn remove(key: impl Into<String>) -> Change {
        Change { key: key.into(), value: None }
    }

    fn issue(&self, message: &str) -> Issue {
        let help = "give a key as TABLE.KEY, for example contact.gap, or load[0].amplitude";
        Issue::new(self.key.clone(), message, help)
    }

    /// Carry it out on a document.
    fn apply(&self, document: &mut DocumentMut) -> Result<(), Issue> {
        let parts: Vec<&str> = self.key.split('.').collect();
        let is_name = |part: &&str| {
            let name = part.split('[').next().unwrap_or_default();
            !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-')
        };
        let is_key = parts.last().is_some_and(|last| !last.contains('['));
        let (Some((last, folders)), true, true) =
            (parts.split_last(), parts.iter().all(is_name), is_key)
        else {
            return Err(self.issue("is no key of a scene"));
        };
        self.carry_out(document.as_table_mut(), folders, last)
    }

    /// In the table that `folders` lead to; a name without a number means all tables of a list.
    fn carry_out(
        &self,
        table: &mut dyn TableLike,
        folders: &[&str],
        key: &str,
    ) -> Result<(), Issue> {
        let Some((part, folders)) = folders.split_first() else {
            self.put(table, key);
            return Ok(());
        };
        let (name, index) = match part.split_once('[') {
            None => (*part, None),
            Some((name, rest)) => {
                let index = rest.strip_suffix(']').and_then(|i| i.parse::<usize>().ok());
                (name, Some(index.ok_or_else(|| self.issue("is no key of a scene"))?))
            }
        };
        if index.is_none() && self.value.is_some() && !table.contains_key(name) {
            table.insert(name, Item::Table(Table::new()));
        }
        let found: Vec<&mut dyn TableLike> = match (table.get_mut(name), index) {
            (Some(Item::ArrayOfTables(list)), None) => {
                list.iter_mut().map(|t| t as &mut dyn TableLike).collect()
            }
            (Some(Item::ArrayOfTables(list)), Some(k)) => {
                list.get_mut(k).map(|t| t as &mut dyn TableLike).into_iter().collect()
            }
            // [{ … }, { … }], as programs write lists of tables
            (Some(Item::Value(Value::Array(list))), _) => {
                let tables = list.iter_mut().enumerate();
                let chosen = tables.filter(|(k, _)| index.is_none_or(|i| i == *k));
                let inline = chosen.filter_map(|(_, v)| v.as_inline_table_mut());
                inline.map(|t| t as &mut dyn TableLike).collect()
            }
            (Some(item), None) => item.as_table_like_mut().into_iter().collect(),
            _ => vec![],
        };
        if found.is_empty() && self.value.is_some() {
            return Err(self.issue("there is no such table in the scene"));
        }
        found.into_iter().try_for_each(|t| self.carry_out(t, folders, key))
    }

    fn put(&self, table: &mut dyn TableLike, key: &str) {
        let Some(text) = &self.value else {
            table.remove(key);
            return;
        };
        // `.5` is a number to everybody but TOML
        let number = || text.trim().parse::<f64>().ok().map(Value::from);
        let word = || Value::from(text.as_str());
        let value = text.parse::<Value>().ok().or_else(number).unwrap_or_else(word);
        match table.get_mut(key).and_then(Item::as_value_mut) {
            // what stands around a value (comments) stays
            Some(old) => {
                let decor = old.decor().clone();
                *old = value;
                *old.decor_mut() = decor;
            }
            None => {
                table.insert(key, Item::Value(value));
            }
        }
    }
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.value {
            Some(value) => write!(f, "{} = {value}", self.key),
            None => write!(f, "without {}", self.key),
        }
    }
}

/// A step on the way to a number of a scene.
#[derive(Debug, Clone, Copy)]
enum Step<'k> {
    Name(&'k str),
    Place(usize),
}

/// `load[0].amplitude`, `damping.rayleigh[1]`: names, with places in lists of tables and of numbers.
fn steps(key: &str) -> Option<Vec<Step<'_>>> {
    let mut all = vec![];
    for part in key.split('.') {
        let (name, mut rest) = part.split_at(part.find('[').unwrap_or(part.len()));
        all.push(Step::Name(name));
        while !rest.is_empty() {
            let (place, more) = rest.strip_prefix('[')?.split_once(']')?;
            all.push(Step::Place(place.parse().ok()?));
            rest = more;
        }
    }
    Some(all)
}

/// The value at the end of a way.
fn at<'d>(document: &'d mut DocumentMut, key: &str) -> Option<&'d mut Value> {
    let mut item = document.as_item_mut();
    for step in steps(key)? {
        item = match step {
            Step::Name(name) => item.get_mut(name)?,
            Step::Place(k) => item.get_mut(k)?,
        };
    }
    item.as_value_mut()
}

impl Scene {
    fn document(&self) -> Result<DocumentMut, SceneError> {
        let unreadable = |e: TomlError| {
            self.error(Issue::new("scene", e.to_string(), "give a scene that can be read"))
        };
        self.source.text.parse().map_err(unreadable)
    }

    /// The scene of a changed text.
    fn changed(&self, document: &DocumentMut) -> Result<Scene, SceneError> {
        let changed = Scene::parse(&document.to_string(), &self.source.file)?;
        Ok(Scene { attached: self.attached.clone(), unlimited: self.unlimited, ..changed })
    }

    /// The number that stands at a key: `contact.gap`, `load[0].amplitude`, `damping.rayleigh[1]`.
    pub fn number(&self, key: &str) -> Result<f64, SceneError> {
        let mut document = self.document()?;
        let found = at(&mut document, key);
        let number = found.and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
        number.ok_or_else(|| {
            let message = "is no number that stands in the scene";
            let help = "write it there as one number; tables of a list and numbers of a list by their places from 0: contact.gap, load[0].amplitude, damping.rayleigh[1]";
            self.error(Issue::new(key, message, help))
        })
    }

    /// The scene with another number at a key, checked anew.
    pub fn with_number(&self, key: &str, number: f64) -> Result<Scene, SceneError> {
        let mut document = self.document()?;
        if let Some(value) = at(&mut document, key) {
            let decor = value.decor().clone();
            *value = Value::from(number);
            *value.decor_mut() = decor;
        }
        self.changed(&document)
    }

    /// The scene with some keys changed, one after the other, checked anew.
    pub fn with(&self, changes: &[Change]) -> Result<Scene, SceneError> {
        let mut document = self.document()?;
        for change in changes {
            change.apply(&mut document).map_err(|issue| self.error(issue))?;
        }
        self.changed(&document)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"t\"\n[body] # a bar\nkind = \"bar\"\nsize = [1.0]\nelements = [4] # few\nyoung = 1.0\ndensity = 1.0\n\
                        [contact]\nedge = \"right\"\ngap = 1.0\nstress = \"projection\"\n\
                        [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.1\n";

    fn scene() -> Scene {
        Scene::parse(TEXT, "t.toml".as_ref()).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn keys_change_and_comments_stay() {
        let changed = scene()
            .with(&[
                Change::set("body.elements", "[8]"),
                Change::set("contact.method", "penalty"),
                Change::remove("contact.stress"),
                Change::remove("damping.ratio"),
                Change::set("load[0].amplitude", "0.5"),
                Change::set("run.until", "2"),
                Change::set("run.rtol", ".01"),
            ])
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(changed.body.elements, [8]);
        assert_eq!(changed.contact.as_ref().map(|c| c.method.name()), Some("penalty"));
        assert_eq!(changed.until(), Some(2.0));
        assert!(changed.source.text.contains("elements = [8] # few\n"), "{}", changed.source.text);
        assert!(changed.source.text.contains("amplitude = 0.5"));
        assert!(changed.source.text.contains("[body] # a bar"));
        let moved = changed.with(&[
            Change::set("contact.motion", "{amplitude = 0.1, omega = 2.0}"),
            Change::set("contact.motion.omega", "3.0"),
        ]);
        let motion = moved.unwrap_or_else(|e| panic!("{e}")).contact.and_then(|c| c.motion);
        assert_eq!(motion.map(|m| m.omega), Some(3.0));
    }

    #[test]
    fn numbers_are_found_and_changed_where_they_stand() {
        let scene = scene();
        let number = |key: &str| scene.number(key).ok();
        assert_eq!(number("contact.gap"), Some(1.0));
        assert_eq!(number("body.size[0]"), Some(1.0));
        for key in [
            "load.amplitude",
            "load[1].amplitude",
            "load[0].edge",
            "contact.edge",
            "",
            "a[",
            "run.until",
        ] {
            assert_eq!(number(key), None, "{key}");
        }
        let changed = scene.with_number("contact.gap", 2.5).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(changed.number("contact.gap").ok(), Some(2.5));
        assert_eq!(number("load[0].amplitude"), Some(0.1));
        assert_eq!(number("body.elements[0]"), Some(4.0));
        let plain = scene.with_number("load[0].amplitude", 0.25);
        let plain = plain.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(plain.number("load[0].amplitude").ok(), Some(0.25));
    }

    #[test]
    fn what_is_no_key_is_refused() {
        for (key, value) in [
            ("contact.", "1"),
            ("", "1"),
            ("load[1].amplitude", "1.0"),
            ("load[x].amplitude", "1.0"),
            ("contact.gpa", "1.0"),
            ("contact.gap.x", "1.0"),
            ("contact.gap", "-"),
        ] {
            assert!(scene().with(&[Change::set(key, value)]).is_err(), "{key} = {value}");
        }
    }
}
