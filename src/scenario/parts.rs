//! `[body]`, or several `[[body]]`: each of its own kind, with a name, and a place.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use super::number::finite;
use super::{Body, BodyKind, Issue, Scene, State};

/// The tables of a scene: `[body]`, or `[[body]]`.
#[derive(Debug, Clone, Default)]
pub(super) struct Bodies {
    all: Vec<Body>,
    is_list: bool,
}

impl JsonSchema for Bodies {
    fn schema_name() -> Cow<'static, str> {
        "Bodies".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<Body>();
        json_schema!({"anyOf": [table, {"type": "array", "items": table}]})
    }
}

impl<'de> Deserialize<'de> for Bodies {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> Visitor<'de> for OneOrSeveral {
            type Value = Bodies;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a table [body], or tables [[body]]")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Bodies, A::Error> {
                let table = Body::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Bodies { all: vec![table], is_list: false })
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Bodies, A::Error> {
                let mut all = vec![];
                while let Some(table) = seq.next_element()? {
                    all.push(table);
                }
                Ok(Bodies { all, is_list: true })
            }
        }
        deserializer.deserialize_any(OneOrSeveral)
    }
}

/// An axis that a body is mirrored along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// `x → −x`.
    X,
    /// `y → −y`.
    Y,
    /// `z → −z`.
    Z,
}

impl Bodies {
    /// The body, or what several have in common with them.
    pub(super) fn merge(self) -> Result<(Body, Vec<Body>), Issue> {
        let Bodies { mut all, is_list } = self;
        if !is_list {
            let body = all.pop().unwrap_or_default();
            for (key, given) in [
                ("name", body.name.is_some()),
                ("move", body.shift.is_some()),
                ("turn", body.turn.is_some()),
                ("mirror", body.mirror.is_some()),
            ] {
                if given {
                    let message = "is that of one of several bodies";
                    let help = "write [[body]] in place of [body], or remove the key";
                    return Err(Issue::new(format!("body.{key}"), message, help));
                }
            }
            return Ok((body, vec![]));
        }
        let Some(first) = all.first() else {
            return Err(Issue::new("body", "has no table", "[[body]] with name and kind"));
        };
        let state = |b: &Body| match b.kind {
            BodyKind::Plate => Some(State::PlaneStress),
            _ => b.state,
        };
        let body = Body {
            kind: BodyKind::Parts,
            state: state(first),
            mass: first.mass,
            ..Body::default()
        };
        for (k, b) in all.iter().enumerate() {
            let issue = |key: &str, message: String, help: &str| {
                Err(Issue::new(format!("body[{k}].{key}"), message, help))
            };
            let Some(name) = &b.name else {
                let message = "is missing: other tables call the body by it".to_owned();
                return issue("name", message, "name = \"first\"");
            };
            if name.is_empty() || name.contains([':', '"', '\n']) {
                return issue("name", format!("is {name:?}"), "give a word without a colon");
            }
            if all[..k].iter().any(|other| other.name == b.name) {
                return issue(
                    "name",
                    format!("is that of another body, \"{name}\""),
                    "give each its own",
                );
            }
            if b.kind == BodyKind::Matrices {
                let message = "\"matrices\" are one body: several of them do not know their places";
                return issue(
                    "kind",
                    message.to_owned(),
                    "couple them before, or give bars, plates or meshes",
                );
            }
            if b.dim() != first.dim() {
                let message = format!(
                    "is a body in {} beside one in {}",
                    DIMENSIONS[b.dim()],
                    DIMENSIONS[first.dim()]
                );
                return issue("kind", message, "give bodies that fill the same space");
            }
            if state(b) != state(first) {
                let message = "differs from that of another body".to_owned();
                return issue("state", message, "give all the same (plates are in plane stress)");
            }
            if b.mass != first.mass {
                let message = "differs from that of another body: it is one choice for the scene";
                return issue("mass", message.to_owned(), "give all the same");
            }
            if let Some(shift) = &b.shift {
                if shift.len() != b.dim() {
                    let message = format!("has {} numbers", shift.len());
                    return issue(
                        "move",
                        message,
                        b.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"]),
                    );
                }
                shift.iter().try_for_each(|x| finite(&format!("body[{k}].move"), *x))?;
            }
            if let Some(turn) = b.turn {
                finite(&format!("body[{k}].turn"), turn)?;
                if b.dim() == 1 {
                    let message = "turns what lies in a plane, and this is a bar".to_owned();
                    return issue("turn", message, "remove it; mirror = \"x\" turns a bar round");
                }
                if b.state == Some(State::Axisymmetric) {
                    let message = "would turn the axis of revolution".to_owned();
                    return issue("turn", message, "remove it");
                }
            }
            let axes = [Some(Axis::X), Some(Axis::Y), Some(Axis::Z)];
            if b.mirror.is_some() && !axes[..b.dim()].contains(&b.mirror) {
                let message = "is not one of its axes".to_owned();
                return issue(
                    "mirror",
                    message,
                    b.example(["\"x\"", "\"x\" or \"y\"", "\"x\", \"y\" or \"z\""]),
                );
            }
            b.check(&format!("body[{k}]"))?;
        }
        Ok((body, all))
    }
}

/// Spaces by their dimension.
const DIMENSIONS: [&str; 4] = ["no space", "one dimension", "the plane", "space"];

impl Scene {
    /// The bodies with the keys of their tables; one alone has no name.
    pub(crate) fn bodies(&self) -> Vec<(String, &Body)> {
        match self.parts.is_empty() {
            true => vec![("body".to_owned(), &self.body)],
            false => {
                let key = |(k, b)| (format!("body[{k}]"), b);
                self.parts.iter().enumerate().map(key).collect()
            }
        }
    }

    /// What a name of a side or of cells is called in one of the bodies; nothing where it is another's.
    pub(crate) fn within<'w>(&self, body: &Body, word: &'w str) -> Option<&'w str> {
        match &body.name {
            None => Some(word),
            Some(name) => word.strip_prefix(name.as_str())?.strip_prefix(':'),
        }
    }
}
