//! Errors of a scene: which key, where in the file, and what would be accepted.

use miette::{Diagnostic, NamedSource, SourceSpan};
use thiserror::Error;
use toml::de::{DeTable, DeValue};

/// What is wrong with a value, before it is known where the value stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Issue {
    /// Path of the key: `body.young`, `load[1].mode`.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What would be accepted.
    pub help: String,
}

impl Issue {
    /// A new issue at `key`.
    pub fn new(
        key: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Issue { key: key.into(), message: message.into(), help: help.into() }
    }
}

/// A scene that cannot be used, with its place in the file.
#[derive(Debug, Error, Diagnostic)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read the scene `{file}`: {reason}")]
    #[diagnostic(help("give the path of a TOML scene; examples are in scenarios/"))]
    Unreadable {
        /// Path as given.
        file: String,
        /// The system's words.
        reason: String,
    },
    /// A value that is missing, of the wrong kind or not physical.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Value(Box<ValueError>),
}

/// A value of a scene that cannot be used.
#[derive(Debug, Error, Diagnostic)]
#[error("{file}:{line}:{column}: {key}: {message}")]
#[diagnostic(help("{help}"))]
pub struct ValueError {
    /// Path of the scene.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// The key.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What would be accepted.
    pub help: String,
    /// The scene's text.
    #[source_code]
    source_code: NamedSource<String>,
    /// The place.
    #[label("here")]
    span: SourceSpan,
}

/// Put an issue at its place in the text; a missing key is shown at its table.
pub(crate) fn locate(issue: Issue, file: &str, text: &str) -> SceneError {
    let span = span_of(&issue.key, text);
    value_error(issue, file, text, span)
}

/// An error of the TOML reader itself.
pub(crate) fn from_toml(error: &toml::de::Error, file: &str, text: &str) -> SceneError {
    let span = error.span().unwrap_or(0..0);
    let message = error.message().trim().to_owned();
    let (summary, help) = match message.split_once(", expected ") {
        Some((head, tail)) => (plain(head), format!("expected {}", plain(tail))),
        None => {
            (plain(&message), "see the reference of scenes (docs/reference/scenes.md)".to_owned())
        }
    };
    let mut key = key_at(text, span.start);
    let is_gap = key.rsplit('.').next() == Some("gap");
    let help = match is_gap && summary.starts_with("invalid type: list") {
        true => format!(
            "{help}; a list is gaps = [1.0, 2.0]: one number a contact displacement of a body from matrices"
        ),
        false => help,
    };
    if key.is_empty() {
        // nothing stands there: the key that is missing
        key = summary.split('`').nth(1).unwrap_or("scene").to_owned();
    }
    value_error(Issue::new(key, summary, help), file, text, span)
}

/// What the reader calls its types, and what a user does.
const WORDS: [(&str, &str); 12] = [
    ("usize", "a whole number, not negative"),
    ("u8", "a whole number, not negative"),
    ("u16", "a whole number, not negative"),
    ("u32", "a whole number, not negative"),
    ("u64", "a whole number, not negative"),
    ("i64", "a whole number"),
    ("f64", "a number"),
    ("floating point", "number"),
    ("sequence", "list"),
    ("map", "table"),
    ("boolean", "true or false"),
    ("bool", "true or false"),
];

/// A message of the reader in words of a user; names between backticks stay.
fn plain(message: &str) -> String {
    let outside = |part: &str| {
        let mut text = format!(" {part} ");
        for (word, ours) in WORDS {
            for (before, after) in [(" ", " "), (" ", ","), (" ", ":")] {
                text = text
                    .replace(&format!("{before}{word}{after}"), &format!("{before}{ours}{after}"));
            }
        }
        text[1..text.len() - 1].to_owned()
    };
    let quoted =
        |(k, part): (usize, &str)| if k % 2 == 0 { outside(part) } else { part.to_owned() };
    let parts: Vec<String> = message.split('`').enumerate().map(quoted).collect();
    parts.join("`")
}

/// Letters of a line that is drawn.
const LONGEST_LINE: usize = 2000;

fn value_error(issue: Issue, file: &str, text: &str, span: std::ops::Range<usize>) -> SceneError {
    // a line that no terminal shows is not drawn; its number and column are said all the same
    let drawn = text.lines().all(|l| l.len() <= LONGEST_LINE);
    let (source, mark) =
        if drawn { (text.to_owned(), span.clone()) } else { (String::new(), 0..0) };
    let before = &text[..span.start.min(text.len())];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    SceneError::Value(Box::new(ValueError {
        file: file.to_owned(),
        line: before.matches('\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        key: issue.key,
        message: issue.message,
        help: issue.help,
        source_code: NamedSource::new(file, source).with_language("toml"),
        span: (mark.start, mark.end - mark.start).into(),
    }))
}

/// The byte range of the value of `key`, or of the nearest table above it.
fn span_of(key: &str, text: &str) -> std::ops::Range<usize> {
    let Ok(root) = DeTable::parse(text) else { return 0..0 };
    let mut span = 0..0;
    let mut table = Some(root.get_ref());
    for part in key.split('.') {
        let (name, index) = match part.split_once('[') {
            Some((name, i)) => (name, i.trim_end_matches(']').parse::<usize>().ok()),
            None => (part, None),
        };
        let Some(mut value) = table.and_then(|t| t.get(name)) else { break };
        if let (Some(i), DeValue::Array(list)) = (index, value.get_ref()) {
            match list.get(i) {
                Some(item) => value = item,
                None => break,
            }
        }
        span = value.span();
        table = match value.get_ref() {
            DeValue::Table(t) => Some(t),
            _ => None,
        };
    }
    span
}

/// The `table.key` on whose line a byte offset stands.
fn key_at(text: &str, offset: usize) -> String {
    let offset = offset.min(text.len());
    let line_end = text[offset..].find('\n').map_or(text.len(), |i| i + offset);
    let mut table = String::new();
    let mut key = String::new();
    for line in text[..line_end].lines() {
        let line = line.trim();
        if line.starts_with('[') {
            let end = line.find(']').unwrap_or(line.len());
            table = line[..end].trim_matches(|c| c == '[' || c == ']' || c == ' ').to_owned();
            key.clear();
        } else if let Some((name, _)) = line.split_once('=') {
            key = name.trim().to_owned();
        }
    }
    match (table.is_empty(), key.is_empty()) {
        (true, _) => key,
        (false, true) => table,
        (false, false) => format!("{table}.{key}"),
    }
}
