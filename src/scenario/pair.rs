//! Lists of exactly two values. Tuples and arrays of serde take the first two of a longer list and drop the rest without a word.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, SeqAccess, Visitor};

/// `[a, b]`, and nothing behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair<A, B>(pub A, pub B);

impl<'de, A: Deserialize<'de>, B: Deserialize<'de>> Deserialize<'de> for Pair<A, B> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Values<A, B>(PhantomData<(A, B)>);
        impl<'de, A: Deserialize<'de>, B: Deserialize<'de>> Visitor<'de> for Values<A, B> {
            type Value = Pair<A, B>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of two values")
            }
            fn visit_seq<S: SeqAccess<'de>>(self, mut list: S) -> Result<Pair<A, B>, S::Error> {
                let short = |n| S::Error::invalid_length(n, &"a list of two values");
                let a = list.next_element()?.ok_or_else(|| short(0))?;
                let b = list.next_element()?.ok_or_else(|| short(1))?;
                let mut n = 2;
                while list.next_element::<IgnoredAny>()?.is_some() {
                    n += 1;
                }
                if n == 2 { Ok(Pair(a, b)) } else { Err(short(n)) }
            }
        }
        deserializer.deserialize_seq(Values(PhantomData))
    }
}

impl<T> From<Pair<T, T>> for [T; 2] {
    fn from(Pair(a, b): Pair<T, T>) -> [T; 2] {
        [a, b]
    }
}

/// For keys that hold two values: `[a, b]` as an array.
pub(super) fn array<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[T; 2]>, D::Error> {
    Ok(Some(Pair::deserialize(deserializer)?.into()))
}

/// For keys that hold two pairs: `[[a, b], [a, b]]`.
pub(super) fn pairs<'de, A: Deserialize<'de>, B: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[(A, B); 2]>, D::Error> {
    let Pair(first, second): Pair<Pair<A, B>, Pair<A, B>> = Pair::deserialize(deserializer)?;
    Ok(Some([first, second].map(|Pair(a, b)| (a, b))))
}
