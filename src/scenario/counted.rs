//! Rows of given matrices against which a displacement is counted: one row, or several with weights.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

use super::pair::Pair;

/// `Σ P_j u_j` over rows `j` of the matrices.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted(pub Vec<(usize, f64)>);

impl JsonSchema for Counted {
    fn schema_name() -> Cow<'static, str> {
        "Counted".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"description": "A row of the matrices.", "type": "integer", "minimum": 0},
            {
                "description": "Rows with weights, `[row, weight]` each.",
                "type": "array",
                "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
            },
        ]})
    }
}

impl<'de> Deserialize<'de> for Counted {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rows;
        impl<'de> Visitor<'de> for Rows {
            type Value = Counted;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a row of the matrices, or a list of [row, weight]")
            }
            fn visit_i64<E: Error>(self, row: i64) -> Result<Counted, E> {
                let row = usize::try_from(row)
                    .map_err(|_| E::custom(format!("{row} is no row: they count from 0")))?;
                Ok(Counted(vec![(row, 1.0)]))
            }
            fn visit_u64<E: Error>(self, row: u64) -> Result<Counted, E> {
                Ok(Counted(vec![(row as usize, 1.0)]))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Counted, A::Error> {
                let mut all = vec![];
                while let Some(Pair(row, weight)) = seq.next_element::<Pair<usize, f64>>()? {
                    all.push((row, weight));
                }
                Ok(Counted(all))
            }
        }
        deserializer.deserialize_any(Rows)
    }
}
