//! One coefficient of friction, and why not two.

use std::fmt;

use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// Why a static coefficient above the kinetic one, or one that falls with velocity, is no law of this program.
const ONE: &str = "has more than one coefficient: a static one above the kinetic one, or one that falls with velocity (Stribeck), lets several motions start from \
                   one state (no Filippov system), and none of them is a reference; give the kinetic one: friction = 0.2";

/// For keys that hold a coefficient.
pub(super) fn one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    struct Coefficient;
    impl<'de> Visitor<'de> for Coefficient {
        type Value = f64;
        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a coefficient of friction")
        }
        fn visit_f64<E: Error>(self, mu: f64) -> Result<f64, E> {
            Ok(mu)
        }
        fn visit_i64<E: Error>(self, mu: i64) -> Result<f64, E> {
            Ok(mu as f64)
        }
        fn visit_u64<E: Error>(self, mu: u64) -> Result<f64, E> {
            Ok(mu as f64)
        }
        fn visit_seq<S: SeqAccess<'de>>(self, _: S) -> Result<f64, S::Error> {
            Err(S::Error::custom(ONE))
        }
        fn visit_map<M: MapAccess<'de>>(self, _: M) -> Result<f64, M::Error> {
            Err(M::Error::custom(ONE))
        }
    }
    deserializer.deserialize_any(Coefficient).map(Some)
}
