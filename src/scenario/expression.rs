//! Numbers in a scene that may be expressions of the position: `"1.0 + 0.02*y"`.

use std::fmt;

use exmex::{Express, FlatEx, FloatOpsFactory, MatchLiteral, literal_matcher_from_pattern};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

// numbers as TOML writes them, with exponents
literal_matcher_from_pattern!(NumberMatcher, r"^(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?)");

/// The parsed form of an expression.
type Tree = FlatEx<f64, FloatOpsFactory<f64>, NumberMatcher>;

/// What an expression may hold, for messages.
const GRAMMAR: &str = "expected numbers, x, y, + - * / ^, PI and functions such as sin(x), cos, tan, exp, ln, \
     sqrt, abs; for example \"1e-3 + 0.02*y^2\"";

/// A scalar field: a number, or an expression of `x` and `y`.
///
/// The grammar is exmex's: `+ - * / ^`, `sin cos tan exp ln sqrt abs …`, and `PI`.
#[derive(Debug, Clone)]
pub enum Field {
    /// The same everywhere.
    Constant(f64),
    /// An expression, with its text.
    Expression {
        /// As written in the scene.
        text: String,
        /// Parsed form.
        tree: Box<Tree>,
    },
}

impl Field {
    /// Parse an expression; the error text says what went wrong.
    pub fn parse(text: &str) -> Result<Field, String> {
        let tree = Tree::parse(text)
            .map_err(|_| format!("cannot read the expression `{text}`, {GRAMMAR}"))?;
        if let Some(name) = tree.var_names().iter().find(|n| !["x", "y"].contains(&n.as_str())) {
            return Err(format!("unknown name `{name}` in `{text}`, {GRAMMAR}"));
        }
        Ok(Field::Expression { text: text.to_owned(), tree: Box::new(tree) })
    }

    /// The value at a point (not a number where the expression has none).
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Field::Constant(c) => *c,
            Field::Expression { tree, .. } => {
                let values = tree.var_names().iter().map(|n| if n == "x" { x } else { y });
                tree.eval_iter(values).unwrap_or(f64::NAN)
            }
        }
    }
}

impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FieldVisitor;
        impl Visitor<'_> for FieldVisitor {
            type Value = Field;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(
                    "a number or an expression of x and y in quotes, such as \"1 + 0.02*y\"",
                )
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Field, E> {
                Ok(Field::Constant(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Field, E> {
                Ok(Field::Constant(v as f64))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Field, E> {
                Field::parse(v).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(FieldVisitor)
    }
}

/// A number or a list of numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Amplitude {
    /// `amplitude = 0.1`
    Scalar(f64),
    /// `amplitude = [0.0, -9.81]`
    Vector(Vec<f64>),
}

impl<'de> Deserialize<'de> for Amplitude {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AmplitudeVisitor;
        impl<'de> Visitor<'de> for AmplitudeVisitor {
            type Value = Amplitude;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or a list of numbers, such as 0.1 or [0.0, -9.81]")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Amplitude, E> {
                Ok(Amplitude::Scalar(v))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Amplitude, E> {
                Ok(Amplitude::Scalar(v as f64))
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Amplitude, A::Error> {
                let mut list = vec![];
                while let Some(v) = seq.next_element::<f64>()? {
                    list.push(v);
                }
                Ok(Amplitude::Vector(list))
            }
        }
        deserializer.deserialize_any(AmplitudeVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_know_x_and_y() {
        assert_eq!(Field::parse("-2*x + y^2").unwrap().at([1.0, 3.0]), 7.0);
        assert_eq!(Field::parse("3*y").unwrap().at([100.0, 2.0]), 6.0);
        assert!((Field::parse("sin(PI*x/2)").unwrap().at([1.0, 0.0]) - 1.0).abs() < 1e-15);
        assert_eq!(Field::parse("1e-5 + 2.5E+1*x").unwrap().at([2.0, 0.0]), 50.00001);
        assert_eq!(Field::parse("-1e-1*x").unwrap().at([2.0, 0.0]), -0.2);
        assert!(
            (Field::parse("2*exp(x)").unwrap().at([1.0, 0.0]) - 5.43656365691809).abs() < 1e-13
        );
        assert!(Field::parse("1 +* x").is_err());
        assert!(Field::parse("z + 1").unwrap_err().contains("`z`"));
    }
}
