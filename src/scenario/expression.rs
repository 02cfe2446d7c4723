//! Numbers in a scene that may be expressions of the position: `"1.0 + 0.02*y"`.

use std::borrow::Cow;
use std::fmt;

use exmex::{Express, FlatEx, FloatOpsFactory, MatchLiteral, literal_matcher_from_pattern};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

// numbers as TOML writes them, with exponents
literal_matcher_from_pattern!(NumberMatcher, r"^(([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?)");

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The parsed form of an expression.
type Tree = FlatEx<f64, FloatOpsFactory<f64>, NumberMatcher>;

/// What an expression may hold, for messages.
const GRAMMAR: &str = "expected numbers, x, y, z, + - * / ^, PI and functions such as sin(x), cos, tan, exp, ln, \
     sqrt, abs; for example \"1e-3 + 0.02*y^2\"";

/// Letters of an expression (the time to read one grows with their square).
const LONGEST: usize = 4000;

/// A scalar field: a number, or an expression of `x`, `y` and `z`.
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
        if text.len() > LONGEST {
            return Err(format!(
                "an expression of {} letters: at most {LONGEST}; give a shorter one",
                text.len()
            ));
        }
        let tree = Tree::parse(&explicit_powers(text))
            .map_err(|_| format!("cannot read the expression `{text}`, {GRAMMAR}"))?;
        if let Some(name) = tree.var_names().iter().find(|n| !AXES.contains(&n.as_str())) {
            if name == "t" {
                return Err(format!(
                    "t in `{text}`: the time stands in contact.gap alone, of the obstacle in front"
                ));
            }
            return Err(format!("unknown name `{name}` in `{text}`, {GRAMMAR}"));
        }
        Ok(Field::Expression { text: text.to_owned(), tree: Box::new(tree) })
    }

    /// The value at a point (not a number where the expression has none).
    pub fn at(&self, place: [f64; 3]) -> f64 {
        match self {
            Field::Constant(c) => *c,
            Field::Expression { tree, .. } => {
                let axis = |n: &String| AXES.iter().position(|a| a == n).unwrap_or(0);
                let values = tree.var_names().iter().map(|n| place[axis(n)]);
                tree.eval_iter(values).unwrap_or(f64::NAN)
            }
        }
    }

    /// Whether it depends on `z`.
    pub(crate) fn is_in_space(&self) -> bool {
        match self {
            Field::Constant(_) => false,
            Field::Expression { tree, .. } => tree.var_names().iter().any(|n| n == "z"),
        }
    }
}

/// Put every power in parentheses, from the right, so that `-y^2` is `-(y^2)` and `a^b^c` is `a^(b^c)` as in
/// mathematics: the evaluator by itself would read `(-y)^2` and `(a^b)^c`.
fn explicit_powers(text: &str) -> String {
    let mut c: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    let word = |c: char| c.is_alphanumeric() || c == '.' || c == '_';
    let mut caret = c.len();
    while let Some(at) = c[..caret].iter().rposition(|&x| x == '^') {
        // the exponent: signs, then a group, or a word with the group it may call
        let mut end = at + 1;
        while end < c.len() && matches!(c[end], '-' | '+') {
            end += 1;
        }
        while end < c.len()
            && (word(c[end]) || (matches!(c[end], '-' | '+') && exponent_sign(&c, end)))
        {
            end += 1;
        }
        if end < c.len() && c[end] == '(' {
            end = matching(&c, end, 1).map_or(c.len(), |close| close + 1);
        }
        // the base: a group with the word before it, or a word
        let mut start = at;
        if start > 0 && c[start - 1] == ')' {
            start = matching(&c, start - 1, -1).unwrap_or(0);
        }
        while start > 0
            && (word(c[start - 1])
                || (matches!(c[start - 1], '-' | '+') && exponent_sign(&c, start - 1)))
        {
            start -= 1;
        }
        c.insert(end, ')');
        c.insert(start, '(');
        caret = at + 1;
    }
    c.into_iter().collect()
}

/// Whether the sign at `i` belongs to a number's exponent, as in `1e-3`.
fn exponent_sign(c: &[char], i: usize) -> bool {
    let digit = |k: Option<usize>| {
        k.and_then(|k| c.get(k)).is_some_and(|c| c.is_ascii_digit() || *c == '.')
    };
    i >= 2 && matches!(c[i - 1], 'e' | 'E') && digit(Some(i - 2)) && digit(Some(i + 1))
}

/// The other end of the parenthesis at `i`, in direction `step`.
fn matching(c: &[char], i: usize, step: isize) -> Option<usize> {
    let mut depth = 0;
    let mut k = i as isize;
    while let Some(&x) = usize::try_from(k).ok().and_then(|k| c.get(k)) {
        depth += match x {
            '(' => step,
            ')' => -step,
            _ => 0,
        };
        if depth == 0 {
            return Some(k as usize);
        }
        k += step;
    }
    None
}

impl JsonSchema for Field {
    fn schema_name() -> Cow<'static, str> {
        "Field".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "number"},
            {"type": "string", "description": "An expression of `x`, `y`, `z`: `+ - * / ^`, `PI`, `sin cos tan exp ln sqrt abs min max atan2` …; `log` is `ln`."},
        ]})
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

impl JsonSchema for Amplitude {
    fn schema_name() -> Cow<'static, str> {
        "Amplitude".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}}]})
    }
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
    fn expressions_know_the_coordinates() {
        assert_eq!(Field::parse("-2*x + y^2").unwrap().at([1.0, 3.0, 0.0]), 7.0);
        assert_eq!(Field::parse("3*y").unwrap().at([100.0, 2.0, 0.0]), 6.0);
        assert!((Field::parse("sin(PI*x/2)").unwrap().at([1.0, 0.0, 0.0]) - 1.0).abs() < 1e-15);
        assert_eq!(Field::parse("1e-5 + 2.5E+1*x").unwrap().at([2.0, 0.0, 0.0]), 50.00001);
        assert_eq!(Field::parse("-1e-1*x").unwrap().at([2.0, 0.0, 0.0]), -0.2);
        assert!(
            (Field::parse("2*exp(x)").unwrap().at([1.0, 0.0, 0.0]) - 5.43656365691809).abs()
                < 1e-13
        );
        for (text, value) in [
            ("-y^2", -9.0),
            ("-2^2", -4.0),
            ("2^3^2", 512.0),
            ("(-y)^2", 9.0),
            ("1 - y^2/2", -3.5),
            ("(1+y)^2*2", 32.0),
            ("2^-1", 0.5),
            ("1e-2^2", 1e-4),
            ("sqrt(y+1)^4", 16.0),
            ("2^sqrt(y+1)", 4.0),
            ("-(y^2)^2 + x", -79.0),
        ] {
            let got = Field::parse(text).unwrap().at([2.0, 3.0, 0.0]);
            assert!((got - value).abs() < 1e-12, "{text} = {got}");
        }
        assert!(Field::parse("1 +* x").is_err());
        assert!(Field::parse("(1 + x").is_err() && Field::parse("^2").is_err());
        assert!(Field::parse("w + 1").unwrap_err().contains("`w`"));
        let field = Field::parse("x*y - 2*z").unwrap();
        assert!(field.is_in_space() && !Field::parse("x*y").unwrap().is_in_space());
        assert_eq!(field.at([3.0, 2.0, 5.0]), -4.0);
    }
}
