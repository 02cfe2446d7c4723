//! Numbers in JSON by their bits: what is read is what was written.

// functions that serde calls
#![allow(missing_docs)]

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One number.
pub mod one {
    use super::*;
    pub fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        x.to_bits().serialize(s)
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<f64, D::Error> {
        Ok(f64::from_bits(u64::deserialize(d)?))
    }
}

/// One number as people write it; none where it is not finite.
pub mod plain {
    use super::*;
    pub fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        x.is_finite().then_some(*x).serialize(s)
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(d)?.unwrap_or(f64::NAN))
    }
}

/// A number that may be missing.
pub mod maybe {
    use super::*;
    pub fn serialize<S: Serializer>(x: &Option<f64>, s: S) -> Result<S::Ok, S::Error> {
        x.map(f64::to_bits).serialize(s)
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Option<f64>, D::Error> {
        Ok(Option::<u64>::deserialize(d)?.map(f64::from_bits))
    }
}

/// A list.
pub mod many {
    use super::*;
    pub fn serialize<S: Serializer>(x: &[f64], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(x.iter().map(|x| x.to_bits()))
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<f64>, D::Error> {
        Ok(Vec::<u64>::deserialize(d)?.into_iter().map(f64::from_bits).collect())
    }
}

/// A list of pairs.
pub mod pairs {
    use super::*;
    pub fn serialize<S: Serializer>(x: &[[f64; 2]], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(x.iter().map(|x| x.map(f64::to_bits)))
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<[f64; 2]>, D::Error> {
        Ok(Vec::<[u64; 2]>::deserialize(d)?.into_iter().map(|x| x.map(f64::from_bits)).collect())
    }
}

/// Switches: time, node, the name of the kind.
pub mod switches {
    use super::*;
    use crate::event::SwitchKind;
    type Switch = (f64, usize, SwitchKind);
    pub fn serialize<S: Serializer>(x: &[Switch], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(x.iter().map(|&(t, n, kind)| (t.to_bits(), n, kind.name())))
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<Switch>, D::Error> {
        let list = Vec::<(u64, usize, String)>::deserialize(d)?;
        let of =
            |(t, n, kind): (u64, usize, String)| (f64::from_bits(t), n, SwitchKind::of_name(&kind));
        Ok(list.into_iter().map(of).collect())
    }
}
