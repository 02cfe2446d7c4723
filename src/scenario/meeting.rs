//! `[[contact]]` between two surfaces: `slave`, `master`, and how they meet.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

use super::number::Check;
use super::swing::Moving;
use super::{BoundaryMass, Contact, ContactMethod, Field, Issue, Obstacle, RedistributedMass};

/// How the slave's nodes are told apart from the master's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ProjectionKey {
    /// Node against node: every node of the slave has its partner on its normal.
    Match,
    /// Dual mortar with exact segments: meshes need not match.
    Dual,
}

/// Whose normal displacements give up their inertia.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SidesKey {
    /// Those of both surfaces: two mirror images are one body before a wall.
    #[default]
    Both,
    /// Those of the slave alone.
    Slave,
}

/// The surface that a slave meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Meeting {
    /// Group of sides.
    pub master: String,
    /// None: what the meshes allow.
    pub projection: Option<ProjectionKey>,
    /// Gaps may be negative: parts that were pressed together.
    pub press: bool,
}

/// `gap`: a distance, or what the two meshes leave between them.
#[derive(Debug, Clone)]
pub(super) enum GapKey {
    /// `"geometry"`
    Geometry,
    /// A number or an expression, of `t` too.
    Given(Moving),
}

impl GapKey {
    fn still(gap: f64) -> GapKey {
        GapKey::Given(Moving { still: Field::Constant(gap), swings: None })
    }
}

impl JsonSchema for GapKey {
    fn schema_name() -> Cow<'static, str> {
        "Gap".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "number"},
            {"type": "string", "description": "`\"geometry\"` between two surfaces, or an expression of `x`, `y`, `z`, and of the time `t` inside sines and cosines, linear: a gap that moves from place to place, such as `\"0.36 + 0.1*cos(2*(atan2(y, x) - 5.0*t))\"`."},
        ]})
    }
}

impl<'de> Deserialize<'de> for GapKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct GapVisitor;
        impl Visitor<'_> for GapVisitor {
            type Value = GapKey;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, an expression of x and y in quotes, such as \"1 + 0.02*y\", or \"geometry\" between two surfaces")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<GapKey, E> {
                Ok(GapKey::still(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<GapKey, E> {
                Ok(GapKey::still(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<GapKey, E> {
                match v {
                    "geometry" => Ok(GapKey::Geometry),
                    _ => Moving::parse(v).map(GapKey::Given).map_err(E::custom),
                }
            }
        }
        deserializer.deserialize_any(GapVisitor)
    }
}

impl Contact {
    /// Whether bodies meet: some table is a pair of surfaces, or displacements of matrices are counted against others.
    pub fn has_pairs(&self) -> bool {
        self.obstacles.iter().any(Obstacle::meets)
    }

    /// The key by which a table names its side of the body.
    pub(crate) fn side_key(&self, table: usize, own: &str) -> String {
        let pair = self.obstacles.get(table).is_some_and(|o| o.meeting.is_some());
        self.key(table, if pair { "slave" } else { own })
    }

    /// What pairs do not go with.
    pub(super) fn check_pairs(&self) -> Check {
        let Some(first) = self.obstacles.iter().position(Obstacle::meets) else {
            if self.sides.is_some() {
                let message = "is not read: no table has a slave and a master";
                return Err(Issue::new(self.key(0, "sides"), message, "remove the key"));
            }
            return Ok(());
        };
        let issue = |key: &str, message: &str, help: &str| {
            Err(Issue::new(self.key(first, key), message, help))
        };
        let methods = [ContactMethod::NodalBoundary, ContactMethod::MassRedistribution];
        if !methods.contains(&self.method) {
            let name = self.method.name();
            let message =
                format!("\"{name}\" knows rigid obstacles, and this is a pair of surfaces");
            return issue(
                "method",
                &message,
                "give \"nbm\" (the default) or \"mass-redistribution\"",
            );
        }
        if self.mass == Some(RedistributedMass::Optimal) {
            let message = "\"optimal\" knows one direction, and two surfaces have two";
            return issue("mass", message, "give mass = \"condensed\" (the default)");
        }
        if self.boundary_mass == BoundaryMass::Lumped {
            let message = "is not read by pairs of surfaces, which take nodal reactions";
            return issue("boundary_mass", message, "remove the key");
        }
        if self.obstacles.iter().any(|o| o.swings.is_some()) {
            let message =
                "moves in time, and this is a pair of surfaces, which know their own motion";
            return issue("gap", message, "give a gap without t; [[support]] moves a body");
        }
        if self.motion.is_some() {
            let message = "is that of rigid obstacles, and this is a pair of surfaces";
            return issue("motion", message, "remove it; [[support]] moves a body");
        }
        self.obstacles.iter().enumerate().try_for_each(|(k, o)| self.check_pair(k, o))
    }

    fn check_pair(&self, k: usize, o: &Obstacle) -> Check {
        let Some(meeting) = &o.meeting else { return Ok(()) };
        let issue =
            |key: &str, message: &str, help: &str| Err(Issue::new(self.key(k, key), message, help));
        if meeting.master == o.group {
            let message = "is the slave itself";
            return issue("master", message, "give the group of the other surface");
        }
        for (key, given) in [("plane", o.plane.is_some()), ("gap_behind", o.gap_behind.is_some())] {
            if given {
                let message = "belongs to a rigid obstacle, and this is a pair of surfaces";
                return issue(key, message, "remove the key");
            }
        }
        Ok(())
    }
}
