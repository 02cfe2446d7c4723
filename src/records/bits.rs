//! Numbers in JSON by their bits: what is read is what was written.

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

/// Switches: time, node, whether it closes.
pub mod switches {
    use super::*;
    pub fn serialize<S: Serializer>(x: &[(f64, usize, bool)], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(x.iter().map(|&(t, n, c)| (t.to_bits(), n, c)))
    }
    pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<(f64, usize, bool)>, D::Error> {
        let list = Vec::<(u64, usize, bool)>::deserialize(d)?;
        Ok(list.into_iter().map(|(t, n, c)| (f64::from_bits(t), n, c)).collect())
    }
}
