//! `[initial]`: the state at the start.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use super::number::{Check, count_from_one, finite, length};
use super::{Field, Issue, Scene};

/// `[initial]`
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// A mode of the open body, from 1; with `equilibrium` of the phase at rest.
    pub mode: Option<usize>,
    /// With `mode`: its contact displacement of largest magnitude, over the gap; negative: away from the obstacle. With `equilibrium`: over the first opening or closing on the way from there.
    pub amplitude: Option<f64>,
    /// Components of the displacement, numbers or expressions; what a support holds is left out. Those of contact nodes along the normal follow from the contact conditions, where they have no mass.
    /// Of several bodies also by their names, `{ first = ["-2*x", "0"] }`, zero for the others; where one mesh has several materials their groups are such names.
    #[schemars(extend("examples" = [["-2*x", "0"]]))]
    pub displacement: Option<Components>,
    /// Components of the velocity, likewise.
    pub velocity: Option<Components>,
    /// An orbit, or the last state of a run, relative to the scene; interpolated from another mesh of the same body.
    pub file: Option<PathBuf>,
    /// The static equilibrium under the constant loads, contact included; `velocity`, or `mode` and `amplitude`, may be given with it. Without friction it is what modes, amplitudes
    /// and energies of orbits and families are told around.
    #[serde(default)]
    pub equilibrium: bool,
}

/// Components of a field: one list for all bodies, or one for each that is named.
#[derive(Debug, Clone)]
pub enum Components {
    /// The same expressions everywhere.
    Everywhere(Vec<Field>),
    /// By the names of the bodies; zero on the others.
    ByPart(BTreeMap<String, Vec<Field>>),
}

impl Components {
    /// All lists, with the names of the bodies where they have one.
    pub fn lists(&self) -> Vec<(Option<&str>, &[Field])> {
        match self {
            Components::Everywhere(list) => vec![(None, list)],
            Components::ByPart(parts) => {
                parts.iter().map(|(name, list)| (Some(name.as_str()), &list[..])).collect()
            }
        }
    }
}

impl JsonSchema for Components {
    fn schema_name() -> Cow<'static, str> {
        "Components".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let list = generator.subschema_for::<Vec<Field>>();
        json_schema!({"anyOf": [list, {"type": "object", "additionalProperties": list}]})
    }
}

impl<'de> Deserialize<'de> for Components {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Components;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(
                    "a list of numbers or expressions, or such lists by the names of bodies",
                )
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Components, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Components::Everywhere)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Components, A::Error> {
                BTreeMap::deserialize(MapAccessDeserializer::new(map)).map(Components::ByPart)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl Scene {
    /// Whether modes, amplitudes and energies are told around the static equilibrium: where the scene begins at it, nothing rubs, and no velocity jumps.
    pub fn is_around_equilibrium(&self) -> bool {
        let jumps = self.contact.as_ref().is_some_and(|c| c.has_impacts());
        self.initial.equilibrium && !self.rubs() && !jumps
    }

    pub(super) fn check_initial(&self) -> Check {
        let s = &self.initial;
        let field = s.displacement.is_some() || s.velocity.is_some();
        // a velocity, or a mode, may be added to an equilibrium
        let is_added = s.mode.is_some() || s.velocity.is_some();
        let alone = s.equilibrium && (s.displacement.is_some() || !is_added);
        let forms = [s.mode.is_some(), field, s.file.is_some(), alone];
        if forms.iter().filter(|&&g| g).count() > 1 {
            return Err(Issue::new(
                "initial",
                "mixes several forms",
                "give mode and amplitude, or displacement and velocity, or equilibrium alone or with velocity or with mode and amplitude, or file",
            ));
        }
        match (s.mode, s.amplitude) {
            (Some(m), Some(a)) => {
                count_from_one("initial.mode", m)?;
                finite("initial.amplitude", a)?;
                let scalable = match &self.contact {
                    Some(c) => {
                        let first = c.obstacles.first().and_then(|o| o.gap.as_ref());
                        !matches!(first, Some(Field::Constant(0.0)))
                    }
                    None => true,
                };
                if !scalable && !s.equilibrium {
                    return Err(Issue::new(
                        "initial.amplitude",
                        "counts in gaps, and the gap is 0",
                        "give the initial state as displacement = [\"…\"]",
                    ));
                }
            }
            (Some(_), None) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "is missing",
                    "give amplitude = -1.4 (in gaps)",
                ));
            }
            (None, Some(_)) => {
                return Err(Issue::new(
                    "initial.amplitude",
                    "goes with `mode` only",
                    "give mode = 1",
                ));
            }
            (None, None) => {}
        }
        for (key, list) in
            [("initial.displacement", &s.displacement), ("initial.velocity", &s.velocity)]
        {
            let Some(components) = list else { continue };
            let all = ["[\"-2*x\"]", "[\"-2*x\", \"0\"]", "[\"-2*x\", \"0\", \"0\"]"];
            for (name, list) in components.lists() {
                let key = name.map_or_else(|| key.to_owned(), |name| format!("{key}.{name}"));
                length(&key, list.len(), self.dim(), self.example(all))?;
            }
        }
        Ok(())
    }
}
