//! The schema of scenes: what editors complete and check, and what the reference of scenes is made from.

use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema};
use serde_json::Value;

use super::Scene;

impl Scene {
    /// JSON Schema (draft 7, which editors of TOML know) of a scene: keys, their types, words, defaults and meaning. It takes every scene that is read; what hangs on other
    /// keys, or on the body, is checked when a scene is read.
    pub fn schema() -> Value {
        schema_of::<Scene>("A scene of signorini")
    }
}

/// The schema of what a TOML file holds.
pub(crate) fn schema_of<T: JsonSchema>(title: &str) -> Value {
    let settings = SchemaSettings::draft07().with_transform(Toml);
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.insert("title".into(), title.into());
    schema.to_value()
}

/// What TOML does not have: null; and what only Rust has: sizes of its numbers.
#[derive(Debug, Clone)]
struct Toml;

impl Transform for Toml {
    fn transform(&mut self, schema: &mut Schema) {
        let Some(object) = schema.as_object_mut() else { return };
        let is_nothing =
            |v: &Value| v.is_null() || v == "" || v.as_array().is_some_and(Vec::is_empty);
        if object.get("default").is_some_and(is_nothing) {
            object.remove("default");
        }
        object.remove("format");
        if let Some(Value::Array(types)) = object.get_mut("type") {
            types.retain(|t| t != "null");
            if let [only] = &types[..] {
                let only = only.clone();
                object.insert("type".into(), only);
            }
        }
        if let Some(Value::Array(choices)) = object.get_mut("anyOf") {
            choices.retain(|c| c.get("type").is_none_or(|t| t != "null"));
            // a reference with words beside it: draft 7 reads nothing that stands beside $ref
            if let [only] = &choices[..] {
                let only = only.clone();
                object.remove("anyOf");
                object.insert("allOf".into(), Value::Array(vec![only]));
            }
        }
        transform_subschemas(self, schema);
    }
}
