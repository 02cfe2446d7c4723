//! What `[contact]` says of the contact method and its parameters.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::pair::Pair;

/// Contact methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactMethod {
    /// The nodal boundary method: `u_C = A u_O + d`, no energy of its own.
    #[default]
    #[serde(rename = "nbm")]
    NodalBoundary,
    /// No inertia at the contact points: `nbm` with nodal reactions and a constant mass.
    MassRedistribution,
    /// Springs at two points of Gauss an edge, which the body enters by O(h/κ₀).
    Penalty,
    /// Nitsche's method: consistent springs.
    Nitsche,
    /// Bilinear stops: springs behind the gap that somebody measured, which may be compressed already.
    Stop,
    /// Newton's law of impact, event-driven.
    Impact,
    /// The time-stepping scheme of Moreau and Jean.
    MoreauJean,
    /// Waves along the characteristics of a uniform bar.
    Waves,
}

impl ContactMethod {
    /// All methods.
    pub const ALL: [ContactMethod; 8] = [
        ContactMethod::NodalBoundary,
        ContactMethod::MassRedistribution,
        ContactMethod::Penalty,
        ContactMethod::Nitsche,
        ContactMethod::Stop,
        ContactMethod::Impact,
        ContactMethod::MoreauJean,
        ContactMethod::Waves,
    ];

    /// Whether a key of `[contact]` is read by this method; what is no key of a method is read by all.
    pub fn reads(self, key: &str) -> bool {
        METHOD_KEYS.iter().all(|(name, by)| *name != key || by.contains(&self))
    }

    /// Name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            ContactMethod::NodalBoundary => "nbm",
            ContactMethod::MassRedistribution => "mass-redistribution",
            ContactMethod::Penalty => "penalty",
            ContactMethod::Nitsche => "nitsche",
            ContactMethod::Stop => "stop",
            ContactMethod::Impact => "impact",
            ContactMethod::MoreauJean => "moreau-jean",
            ContactMethod::Waves => "waves",
        }
    }
}

/// Keys of `[contact]` that some methods read and others do not.
pub(crate) const METHOD_KEYS: [(&str, &[ContactMethod]); 13] = {
    use ContactMethod::{
        Impact, MassRedistribution, MoreauJean, Nitsche, NodalBoundary, Penalty, Stop, Waves,
    };
    [
        ("stress", &[NodalBoundary]),
        ("inertia", &[NodalBoundary]),
        ("boundary_mass", &[NodalBoundary]),
        ("mass", &[MassRedistribution]),
        ("stiffness", &[Penalty, Stop]),
        ("preload", &[Stop]),
        ("gamma", &[Nitsche]),
        ("theta", &[Nitsche]),
        ("restitution", &[Impact, MoreauJean]),
        ("step", &[MoreauJean]),
        ("instants", &[Waves]),
        ("activation", &[MoreauJean]),
        ("gap_behind", &[NodalBoundary, MassRedistribution, Penalty, Nitsche, Stop]),
    ]
};

/// `inertia`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Inertia {
    /// The paper's mass `A*ᵀMA*`, which jumps at switches, and the energy with it.
    Paper,
    /// The open phase's mass in every phase: energy is conserved.
    Constant,
}

/// `tangent` of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TangentKey {
    /// They keep it: one motion from every state, whatever the coefficient.
    Inertia,
    /// The boundary is quasi-static along the obstacle too: a second discretisation, below a coefficient that depends on the mesh, for runs, orbits and responses by shooting.
    Massless,
}

/// `instants` of `waves`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Instants {
    /// Where contact closes and opens.
    Exact,
    /// Once an element's travel time: the wave finite element method.
    Step,
}

/// `activation` of `moreau-jean`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// Those whose gap closes within half a step.
    HalfStep,
    /// Those that come closer and whose gap closes within the step.
    FullStep,
}

/// `mass` of mass redistribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RedistributedMass {
    /// `A_∅ᵀ M A_∅`: the inertia of the contact points is condensed on the others.
    Condensed,
    /// Nearest to `M` with all moments up to the second kept; bodies of elements. Half of a symmetric body is another discretisation under it than the whole.
    Optimal,
}

/// `stress`: a name, or (kind `matrices`) the terms `[displacement, coefficient]` of each contact stress.
#[derive(Debug, Clone, PartialEq)]
pub enum StressKey {
    /// The stress of the displacement field.
    Projection,
    /// The mean of the stresses in the elements at a node.
    NodalMean,
    /// The nodal reaction.
    Reaction,
    /// A nodal operator.
    Terms(Vec<Vec<(usize, f64)>>),
}

impl JsonSchema for StressKey {
    fn schema_name() -> Cow<'static, str> {
        "Stress".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"const": "projection", "description": "The stress of the displacement field, projected onto the boundary."},
            {"const": "nodal-mean", "description": "The mean of the stresses in the elements at a node, by volume."},
            {"const": "reaction", "description": "The nodal reaction over the area of the node."},
            {
                "description": "Bodies from matrices: the terms `[displacement, coefficient]` of each contact stress.",
                "type": "array",
                "items": {"type": "array", "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}},
            },
        ]})
    }
}

impl<'de> Deserialize<'de> for StressKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words;
        impl<'de> Visitor<'de> for Words {
            type Value = StressKey;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("\"projection\", \"nodal-mean\", \"reaction\", or lists of [displacement, coefficient]")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<StressKey, E> {
                match word {
                    "projection" => Ok(StressKey::Projection),
                    "nodal-mean" => Ok(StressKey::NodalMean),
                    "reaction" => Ok(StressKey::Reaction),
                    _ => Err(E::unknown_variant(word, &["projection", "nodal-mean", "reaction"])),
                }
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<StressKey, A::Error> {
                let mut all = vec![];
                while let Some(terms) = seq.next_element::<Vec<Pair<usize, f64>>>()? {
                    all.push(terms.into_iter().map(|Pair(row, factor)| (row, factor)).collect());
                }
                Ok(StressKey::Terms(all))
            }
        }
        deserializer.deserialize_any(Words)
    }
}
