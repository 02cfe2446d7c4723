//! A schema as a page: a heading and a list of keys for every table of the file.

use serde_json::{Map, Value};

use crate::cli::wrap::{item, paragraph};

/// Reads a schema with its references.
struct Reader<'a> {
    definitions: Option<&'a Value>,
}

/// The page.
pub fn of(schema: &Value, title: &str) -> String {
    let reader = Reader { definitions: schema.get("definitions") };
    let mut out = format!("# {title}\n");
    out += &said(schema);
    let (tables, plain): (Vec<_>, Vec<_>) =
        properties(schema).partition(|(_, s)| reader.table(s).is_some());
    if !plain.is_empty() {
        out += "\n";
        for (key, value) in plain {
            out += &reader.row(key, value, is_required(schema, key));
        }
    }
    for (key, value) in tables {
        let Some((table, is_list)) = reader.table(value) else { continue };
        let name = if is_list { format!("[[{key}]]") } else { format!("[{key}]") };
        out += &format!("\n## {name}\n");
        out += &said(if says(value) { value } else { table });
        out += "\n";
        out += &reader.rows("", table);
    }
    out
}

fn text<'a>(schema: &'a Value, key: &str) -> &'a str {
    schema.get(key).and_then(Value::as_str).unwrap_or_default()
}

fn says(schema: &Value) -> bool {
    !text(schema, "description").is_empty()
}

/// What it says of itself, on lines of its own.
fn said(schema: &Value) -> String {
    format!("\n{}", paragraph(text(schema, "description")))
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn properties(schema: &Value) -> impl Iterator<Item = (&String, &Value)> {
    schema.get("properties").and_then(Value::as_object).into_iter().flat_map(Map::iter)
}

fn list<'a>(schema: &'a Value, key: &str) -> &'a [Value] {
    schema.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn is_required(schema: &Value, key: &str) -> bool {
    list(schema, "required").iter().any(|r| r == key)
}

/// A value as TOML writes it.
fn toml(value: &Value) -> String {
    format!("`{}`", value.to_string().replace(',', ", "))
}

impl<'a> Reader<'a> {
    /// What a reference stands for.
    fn resolve(&self, schema: &'a Value) -> &'a Value {
        let reference = match list(schema, "allOf") {
            [only] => only,
            _ => schema,
        };
        let name = text(reference, "$ref").strip_prefix("#/definitions/");
        let found = name.and_then(|n| self.definitions?.get(n));
        found.map_or(reference, |s| self.resolve(s))
    }

    /// The table that a key holds, and whether it is a list of tables.
    fn table(&self, schema: &'a Value) -> Option<(&'a Value, bool)> {
        let schema = self.resolve(schema);
        let choices = list(schema, "anyOf");
        if let Some(found) = choices.iter().find_map(|c| self.table(c)) {
            return Some(found);
        }
        if let Some(items) = schema.get("items") {
            return self.table(items).map(|(table, _)| (table, true));
        }
        (text(schema, "type") == "object").then_some((schema, false))
    }

    /// The keys of a table; those of a table in it by their paths.
    fn rows(&self, path: &str, table: &'a Value) -> String {
        let mut out = String::new();
        // keys of the user's choice
        if properties(table).next().is_none() {
            let values = table.get("additionalProperties").unwrap_or(table);
            return item(0, &format!("any key: {}", self.value(values)));
        }
        for (key, value) in properties(table) {
            let whole = format!("{path}{key}");
            out += &self.row(&whole, value, is_required(table, key));
            if let Some((inner, _)) = self.table(value) {
                out += &self.rows(&format!("{whole}."), inner);
            }
        }
        out
    }

    fn row(&self, key: &str, schema: &'a Value, is_required: bool) -> String {
        let found = self.resolve(schema);
        let default = match schema.get("default").or(found.get("default")) {
            _ if is_required => "; required".to_owned(),
            Some(value) => format!("; absent: {}", toml(value)),
            None => String::new(),
        };
        let mut meaning = one_line(text(if says(schema) { schema } else { found }, "description"));
        let examples: Vec<String> = list(schema, "examples").iter().map(toml).collect();
        if !examples.is_empty() {
            meaning += &format!(" For example {}.", examples.join(" or "));
        }
        let value = self.value(schema);
        let mut out = item(0, &format!("**`{key}`** ({value}{default}): {meaning}"));
        for word in self.words(found) {
            let said = one_line(text(word, "description"));
            if let (Some(value), false) = (word.get("const"), said.is_empty()) {
                out += &item(1, &format!("{}: {}", toml(value), said.trim_end_matches('.')));
            }
        }
        out
    }

    /// The words that a key may be, or the items of its list.
    fn words(&self, schema: &'a Value) -> &'a [Value] {
        let choices = [list(schema, "oneOf"), list(schema, "anyOf")];
        let choices = choices.into_iter().find(|c| !c.is_empty()).unwrap_or_default();
        match schema.get("items") {
            Some(items) if choices.is_empty() => self.words(self.resolve(items)),
            _ => choices,
        }
    }

    /// What values it takes, in words.
    fn value(&self, schema: &'a Value) -> String {
        let found = self.resolve(schema);
        if let Some(value) = found.get("const") {
            return toml(value);
        }
        let listed = [list(schema, "enum"), list(found, "enum")];
        if let Some(all) = listed.into_iter().find(|e| !e.is_empty()) {
            return all.iter().map(toml).collect::<Vec<_>>().join(", ");
        }
        for key in ["oneOf", "anyOf"] {
            let choices = list(found, key);
            if !choices.is_empty() {
                let all: Vec<String> = choices.iter().map(|c| self.value(c)).collect();
                return all.join(", ");
            }
        }
        match text(found, "type") {
            "number" => "number".to_owned(),
            "integer" => "whole number".to_owned(),
            "string" => "text".to_owned(),
            "boolean" => "`true`, `false`".to_owned(),
            "object" => "table".to_owned(),
            "array" => match found.get("items") {
                Some(Value::Array(items)) => {
                    let items: Vec<String> = items.iter().map(|i| self.value(i)).collect();
                    format!("list: {}", items.join(", "))
                }
                Some(items) => match list(self.resolve(items), "oneOf") {
                    [] => format!("list of {}", plural(&self.value(items))),
                    _ => format!("list of {}", self.value(items)),
                },
                None => "list".to_owned(),
            },
            _ => "any value".to_owned(),
        }
    }
}

fn plural(value: &str) -> String {
    match value {
        "number" | "whole number" | "text" | "any value" | "table" => format!("{value}s"),
        other => match other.strip_prefix("list") {
            Some(rest) => format!("lists{rest}"),
            None => other.to_owned(),
        },
    }
}
