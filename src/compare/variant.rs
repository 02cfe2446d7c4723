//! Names of contact methods with what is chosen within them: `nbm:constant`, `penalty:10`, `nitsche:gamma=5:theta=0`.

use crate::scenario::{Change, ContactMethod, METHOD_KEYS};

/// A contact method with choices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variant {
    /// As it was named.
    pub name: String,
    /// The method.
    pub method: ContactMethod,
    /// Keys of `[contact]` and their values.
    options: Vec<(&'static str, String)>,
}

/// A name that is none.
#[derive(Debug, thiserror::Error)]
#[error("{name}: {why}; {help}")]
pub struct UnknownVariant {
    /// The name.
    pub name: String,
    /// What is wrong.
    pub why: String,
    /// What would be accepted.
    pub help: String,
}

/// Words that stand for a key and its value.
const WORDS: [(ContactMethod, &str, &str); 13] = {
    use ContactMethod::{MassRedistribution, MoreauJean, NodalBoundary, Waves};
    [
        (NodalBoundary, "inertia", "paper"),
        (NodalBoundary, "inertia", "constant"),
        (NodalBoundary, "stress", "projection"),
        (NodalBoundary, "stress", "nodal-mean"),
        (NodalBoundary, "stress", "reaction"),
        (MassRedistribution, "mass", "condensed"),
        (MassRedistribution, "mass", "optimal"),
        (MassRedistribution, "tangent", "inertia"),
        (MassRedistribution, "tangent", "massless"),
        (MoreauJean, "activation", "half-step"),
        (MoreauJean, "activation", "full-step"),
        (Waves, "instants", "exact"),
        (Waves, "instants", "step"),
    ]
};

/// The key that a number stands for.
fn number_key(method: ContactMethod) -> Option<&'static str> {
    match method {
        ContactMethod::Penalty | ContactMethod::Stop => Some("stiffness"),
        ContactMethod::Nitsche => Some("gamma"),
        ContactMethod::Impact | ContactMethod::MoreauJean => Some("restitution"),
        _ => None,
    }
}

impl Variant {
    /// A method as it comes.
    pub(crate) fn of_method(method: ContactMethod) -> Variant {
        Variant { name: method.name().to_owned(), method, options: vec![] }
    }

    /// The variant of a name.
    pub fn of_name(name: &str) -> Result<Variant, UnknownVariant> {
        let fail = |why: String, help: String| UnknownVariant { name: name.into(), why, help };
        let mut parts = name.split(':');
        let word = parts.next().unwrap_or_default();
        let method =
            ContactMethod::ALL.into_iter().find(|m| m.name() == word).ok_or_else(|| {
                let all: Vec<&str> = ContactMethod::ALL.iter().map(|m| m.name()).collect();
                fail(
                    format!("there is no contact method \"{word}\""),
                    format!("there are {}", all.join(", ")),
                )
            })?;
        let option = |part: &str| -> Option<(&'static str, String)> {
            if let Some((key, value)) = part.split_once('=') {
                let known = METHOD_KEYS.iter().find(|k| k.0 == key && k.1.contains(&method))?;
                return Some((known.0, value.to_owned()));
            }
            let word = WORDS.iter().find(|w| w.0 == method && w.2 == part);
            let number = || {
                part.parse::<f64>().ok()?;
                Some((number_key(method)?, part.to_owned()))
            };
            word.map(|w| (w.1, part.to_owned())).or_else(number)
        };
        let options: Option<Vec<_>> = parts.map(option).collect();
        let options = options.ok_or_else(|| {
            let words = WORDS.iter().filter(|w| w.0 == method).map(|w| w.2.to_owned());
            let number = number_key(method).map(|key| format!("a number ({key})"));
            let keys =
                METHOD_KEYS.iter().filter(|k| k.1.contains(&method)).map(|k| format!("{}=…", k.0));
            let all: Vec<String> = words.chain(number).chain(keys).collect();
            fail(
                format!("is no choice within {word}"),
                format!("after a colon give {}", all.join(", ")),
            )
        })?;
        let again = |k: usize| options[..k].iter().any(|o| o.0 == options[k].0);
        if let Some(k) = (0..options.len()).find(|k| again(*k)) {
            let why = format!("chooses {} twice", options[k].0);
            return Err(fail(why, "give it once".into()));
        }
        Ok(Variant { name: name.to_owned(), method, options })
    }

    /// What it changes in a scene: keys that the method does not read go.
    pub fn changes(&self) -> Vec<Change> {
        let unread = METHOD_KEYS.iter().filter(|k| !k.1.contains(&self.method));
        let mut changes: Vec<Change> =
            unread.map(|k| Change::remove(format!("contact.{}", k.0))).collect();
        changes.push(Change::set("contact.method", self.method.name()));
        if self.has_own_time() {
            changes.push(Change::remove("run.integrator"));
        }
        let set = |(key, value): &(&str, String)| Change::set(format!("contact.{key}"), value);
        changes.extend(self.options.iter().map(set));
        changes
    }

    /// Whether its name says what a key is.
    pub(crate) fn chooses(&self, key: &str) -> bool {
        self.options.iter().any(|o| key.strip_prefix("contact.") == Some(o.0))
    }

    /// Whether it goes through time in its own way, and reads no integrator.
    fn has_own_time(&self) -> bool {
        matches!(self.method, ContactMethod::MoreauJean | ContactMethod::Waves)
    }

    /// Whether a change means something to this method.
    pub fn reads(&self, change: &Change) -> bool {
        if change.key == "run.integrator" {
            return !self.has_own_time();
        }
        change.key.strip_prefix("contact.").is_none_or(|key| self.method.reads(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_methods_and_choices() {
        let options = |name: &str| Variant::of_name(name).unwrap().options;
        assert_eq!(
            options("nbm:constant:reaction"),
            [("inertia", "constant".into()), ("stress", "reaction".into())]
        );
        assert_eq!(options("nitsche:5:theta=0"), [("gamma", "5".into()), ("theta", "0".into())]);
        assert_eq!(options("penalty:1e1"), [("stiffness", "1e1".into())]);
        assert_eq!(options("waves"), []);
        for name in [
            "",
            "nmb",
            "nbm:constant:paper",
            "nbm:optimal",
            "nbm:2",
            "waves:3",
            "penalty:gamma=2",
            "penalty:",
        ] {
            assert!(Variant::of_name(name).is_err(), "{name}");
        }
        let gamma = Change::set("contact.gamma", "2");
        assert!(Variant::of_name("nitsche").unwrap().reads(&gamma));
        assert!(!Variant::of_name("penalty").unwrap().reads(&gamma));
        assert!(Variant::of_name("penalty").unwrap().reads(&Change::set("contact.gap", "2")));
    }
}
