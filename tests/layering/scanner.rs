//! Which modules of a crate a source file names, however it writes them.
//!
//! The text is taken apart into tokens (comments and literals are none), items under `#[cfg(test)]` are left out, and every path
//! is resolved against the module that it stands in: `crate`, `self`, `super`, the crate's own name, and all names that `use` or
//! `extern crate` give to them.

use std::collections::BTreeMap;

/// The crate's own name.
const CRATE: &str = "signorini";

/// A piece of source text: a word, a literal (`""`), `::`, or another character.
#[derive(Debug, Clone, PartialEq)]
struct Token {
    text: String,
    line: usize,
}

impl Token {
    fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

/// A path that a file names.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Line of the text.
    pub line: usize,
    /// From the root of the crate; the last part may be `*`.
    pub path: Vec<String>,
}

/// A path as it is written, with the module that it stands in.
#[derive(Debug, Clone)]
struct Written {
    line: usize,
    module: Vec<String>,
    parts: Vec<String>,
    /// The name that it gets by `use` or `extern crate`.
    name: Option<String>,
}

/// The paths within the crate that the file of `module` names outside of its tests.
pub fn named(text: &str, module: &[&str]) -> Vec<Named> {
    let tokens = without_tests(&tokens(text));
    let module: Vec<String> = module.iter().map(|m| m.to_string()).collect();
    let written = written(&tokens, module);
    let mut names: BTreeMap<String, Vec<String>> = BTreeMap::new();
    // a name may be given to a name
    loop {
        let before = names.len();
        for w in &written {
            if let (Some(name), Some(path)) = (&w.name, resolved(w, &names)) {
                names.entry(name.clone()).or_insert(path);
            }
        }
        if names.len() == before {
            break;
        }
    }
    let absolute = |w: &Written| resolved(w, &names).map(|path| Named { line: w.line, path });
    written.iter().filter_map(absolute).collect()
}

/// Whether a file consists of `pub mod NAME;` alone, and of modules of the numerics that it hands on.
pub fn declares_modules_only(text: &str) -> bool {
    let tokens = tokens(text);
    let mut all: Vec<&str> = tokens.iter().map(|t| t.text.as_str()).collect();
    // its page may show files: documentation is no code
    while all.starts_with(&["#", "!", "[", "doc", "="]) {
        let end = all.iter().position(|t| *t == "]").map_or(all.len(), |k| k + 1);
        all.drain(..end);
    }
    // its own name gives it no other
    let all = all.strip_prefix(&["extern", "crate", "self", "as", CRATE, ";"]).unwrap_or(&all);
    let handed_on = ["pub", "use", "signorini_core", "::", "{"];
    let end = all.windows(handed_on.len()).position(|w| w == handed_on).unwrap_or(all.len());
    let is_list = all[end..].iter().skip(handed_on.len()).all(|t| !matches!(*t, "::" | "as" | "*"));
    let mut modules = &all[..end];
    loop {
        // whether a module has a page is no code either
        let rest = modules.strip_prefix(&["#", "[", "doc", "(", "hidden", ")", "]"]);
        match rest.unwrap_or(modules) {
            ["pub", "mod", _, ";", rest @ ..] => modules = rest,
            rest => return is_list && rest.is_empty(),
        }
    }
}

/// Whether a file takes in other files than those of its modules.
pub fn takes_in_files(text: &str) -> bool {
    let tokens = without_tests(&tokens(text));
    let of = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
    (0..tokens.len()).any(|k| {
        let attribute = (of(k), of(k + 1), of(k + 2)) == ("#", "[", "path");
        attribute || (of(k) == "include" && of(k + 1) == "!")
    })
}

fn tokens(text: &str) -> Vec<Token> {
    let c: Vec<char> = text.chars().collect();
    let at = |k: usize| c.get(k).copied().unwrap_or('\0');
    let is_word = |x: char| x.is_alphanumeric() || x == '_';
    let (mut found, mut line, mut k) = (vec![], 1, 0);
    while k < c.len() {
        let from = k;
        let mut text = String::new();
        match c[k] {
            '/' if at(k + 1) == '/' => {
                while k < c.len() && c[k] != '\n' {
                    k += 1;
                }
            }
            '/' if at(k + 1) == '*' => k = end_of_comment(&c, k),
            '"' => (k, text) = (end_of_text(&c, k), "\"\"".into()),
            '\'' if at(k + 1) == '\\' => {
                k += 3;
                while k < c.len() && c[k] != '\'' {
                    k += 1;
                }
                (k, text) = (k + 1, "\"\"".into());
            }
            '\'' if at(k + 2) == '\'' => (k, text) = (k + 3, "\"\"".into()),
            x if is_word(x) => {
                while is_word(at(k)) {
                    k += 1;
                }
                text = c[from..k].iter().collect();
                let hashes = c[k..].iter().take_while(|x| **x == '#').count();
                let prefix = matches!(&text[..], "r" | "b" | "br" | "c" | "cr");
                if prefix && at(k + hashes) == '"' && (hashes == 0 || text.ends_with('r')) {
                    let raw = text.ends_with('r');
                    k = if raw { end_of_raw(&c, k, hashes) } else { end_of_text(&c, k) };
                    text = "\"\"".into();
                } else if text == "r" && hashes == 1 && is_word(at(k + 1)) {
                    // r#name is the name
                    (k, text) = (k + 1, String::new());
                }
            }
            ':' if at(k + 1) == ':' => (k, text) = (k + 2, "::".into()),
            x if x.is_whitespace() => k += 1,
            x => (k, text) = (k + 1, x.to_string()),
        }
        if !text.is_empty() {
            found.push(Token { text, line });
        }
        line += c[from..k.min(c.len())].iter().filter(|x| **x == '\n').count();
    }
    found
}

/// Behind a comment that may hold others.
fn end_of_comment(c: &[char], mut k: usize) -> usize {
    let mut depth = 0;
    while k < c.len() {
        match (c[k], c.get(k + 1)) {
            ('/', Some('*')) => (depth, k) = (depth + 1, k + 2),
            ('*', Some('/')) => (depth, k) = (depth - 1, k + 2),
            _ => k += 1,
        }
        if depth == 0 {
            break;
        }
    }
    k
}

/// Behind a text that begins at `k`.
fn end_of_text(c: &[char], mut k: usize) -> usize {
    k += 1;
    while k < c.len() && c[k] != '"' {
        k += if c[k] == '\\' { 2 } else { 1 };
    }
    k + 1
}

/// Behind a raw text with so many hashes from `k`.
fn end_of_raw(c: &[char], k: usize, hashes: usize) -> usize {
    let mut k = k + hashes + 1;
    while k < c.len() {
        let closes =
            c[k] == '"' && c[k + 1..].iter().take(hashes).filter(|x| **x == '#').count() == hashes;
        if closes {
            return k + 1 + hashes;
        }
        k += 1;
    }
    k
}

/// Behind the bracket that closes the one at `k`.
fn closed(tokens: &[Token], mut k: usize) -> usize {
    let mut depth = 0;
    while k < tokens.len() {
        match tokens[k].text.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        k += 1;
        if depth == 0 {
            break;
        }
    }
    k
}

/// The tokens without items that are there for tests only.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let of = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
    let is_attribute = |k: usize| of(k) == "#" && of(k + 1) == "[";
    let (mut kept, mut k) = (vec![], 0);
    while k < tokens.len() {
        let condition = (of(k + 2), of(k + 3), of(k + 4), of(k + 5), of(k + 6));
        let test =
            matches!(condition, ("cfg", "(", "test", ")", _) | ("cfg", "(", "all", "(", "test"));
        if !(is_attribute(k) && test) {
            kept.push(tokens[k].clone());
            k += 1;
            continue;
        }
        while is_attribute(k) {
            k = closed(tokens, k + 1);
        }
        // the item ends with its body or a semicolon
        while k < tokens.len() && of(k) != ";" && of(k) != "{" {
            k = if matches!(of(k), "(" | "[") { closed(tokens, k) } else { k + 1 };
        }
        k = if of(k) == "{" { closed(tokens, k) } else { k + 1 };
    }
    kept
}

/// All paths as they are written in the file of a module.
fn written(tokens: &[Token], file: Vec<String>) -> Vec<Written> {
    let of = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
    let mut found: Vec<Written> = vec![];
    // modules within the file, each with the depth of its braces
    let mut inner: Vec<(String, usize)> = vec![];
    let (mut depth, mut k) = (0usize, 0);
    while k < tokens.len() {
        let line = tokens[k].line;
        let module: Vec<String> =
            file.iter().cloned().chain(inner.iter().map(|m| m.0.clone())).collect();
        match of(k) {
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                inner.retain(|m| m.1 <= depth);
            }
            "mod" if of(k + 2) == "{" => {
                inner.push((of(k + 1).to_owned(), depth + 1));
                k += 1;
            }
            "extern" if of(k + 1) == "crate" => {
                let is_self = of(k + 2) == "self";
                let root = if is_self { "crate" } else { of(k + 2) }.to_owned();
                let name = if of(k + 3) == "as" { of(k + 4) } else { of(k + 2) }.to_owned();
                found.push(Written { line, module, parts: vec![root], name: Some(name) });
                k += 3;
            }
            "use" if of(k + 1) != "<" => {
                k = tree(tokens, k + 1, vec![], &module, &mut found);
                continue;
            }
            _ if tokens[k].is_word() => {
                let mut parts = vec![];
                if k > 0 && of(k - 1) == "::" {
                    let continued = k > 1 && (tokens[k - 2].is_word() || of(k - 2) == ">");
                    if continued {
                        k += 1;
                        continue;
                    }
                    parts.push("::".to_owned());
                }
                parts.push(of(k).to_owned());
                while of(k + 1) == "::" && tokens.get(k + 2).is_some_and(Token::is_word) {
                    k += 2;
                    parts.push(of(k).to_owned());
                }
                found.push(Written { line, module, parts, name: None });
            }
            _ => {}
        }
        k += 1;
    }
    found
}

/// Read a tree of `use` from `k`; behind it.
fn tree(
    tokens: &[Token],
    mut k: usize,
    mut parts: Vec<String>,
    module: &[String],
    found: &mut Vec<Written>,
) -> usize {
    let of = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
    while k < tokens.len() {
        let line = tokens[k].line;
        let module = module.to_vec();
        match of(k) {
            "::" if parts.is_empty() => parts.push("::".into()),
            "::" => {}
            "{" => {
                k += 1;
                while k < tokens.len() && of(k) != "}" {
                    k = if of(k) == "," {
                        k + 1
                    } else {
                        tree(tokens, k, parts.clone(), &module, found)
                    };
                }
                return k + 1;
            }
            "*" => {
                parts.push("*".into());
                found.push(Written { line, module, parts, name: None });
                return k + 1;
            }
            word => {
                parts.push(word.to_owned());
                if of(k + 1) != "::" {
                    let renamed = of(k + 1) == "as";
                    let last = parts.iter().rev().find(|p| *p != "self").cloned();
                    let name = if renamed { Some(of(k + 2).to_owned()) } else { last };
                    found.push(Written { line, module, parts, name });
                    return if renamed { k + 3 } else { k + 1 };
                }
            }
        }
        k += 1;
    }
    k
}

/// A path from the root of the crate, if it lies in the crate.
fn resolved(w: &Written, names: &BTreeMap<String, Vec<String>>) -> Option<Vec<String>> {
    let (first, rest) = w.parts.split_first()?;
    let (mut path, rest) = match first.as_str() {
        "::" => match rest.split_first() {
            Some((name, rest)) if name == CRATE => (vec![], rest),
            _ => return None,
        },
        "crate" | CRATE => (vec![], rest),
        "self" => (w.module.clone(), rest),
        "super" => (w.module[..w.module.len().saturating_sub(1)].to_vec(), rest),
        name => (names.get(name)?.clone(), rest),
    };
    for part in rest {
        match part.as_str() {
            "super" => drop(path.pop()),
            "self" => {}
            part => path.push(part.to_owned()),
        }
    }
    Some(path)
}

/// What a file of the module `contact::lcp` names of the crate, without doubles.
fn of_lcp(text: &str) -> Vec<String> {
    let mut all: Vec<String> = named(text, &["contact", "lcp"])
        .into_iter()
        .filter_map(|n| n.path.into_iter().next())
        .collect();
    all.sort();
    all.dedup();
    all
}

#[test]
fn imports_are_found_however_they_are_written() {
    for text in [
        "use crate::orbit;",
        "use crate :: orbit :: chain;",
        "use\n  crate\n  ::orbit::{self, chain::{Chain, Propagator}};",
        "use super::super::orbit;",
        "use super::{super::{orbit as o}};",
        "use self::super::super::orbit::*;",
        "use crate as x; use x::orbit;",
        "use crate as x; use x as y; fn f() { y::orbit::run() }",
        "use crate::{self as x}; type T = x::orbit::Orbit;",
        "use {std::fmt, crate::orbit::chain};",
        "use ::signorini::orbit;",
        "use signorini::orbit::Orbit;",
        "extern crate self as house; use house::orbit;",
        "extern crate signorini as house; fn f() { house::orbit::run() }",
        "use super::super as up; fn f() { up::orbit::run() }",
        "fn f() -> crate::orbit::Orbit { todo!() }",
        "fn f() { let x = super::super::orbit::run::<f64>(1.0); }",
        "fn f() { vec![crate::/* here */orbit::run()]; }",
        "fn f() { <crate::orbit::Orbit as Clone>::clone(&x) }",
        "mod inner { use super::super::super::orbit; }",
        "macro_rules! m { () => { $crate::orbit::run() } }",
        "fn f() { use crate::r#orbit; }",
        "pub(in crate::orbit) fn f() {}",
        "use crate::{\n    // orbits\n    orbit::{branch::{Start}},\n};",
        "#[cfg(test)] mod tests { use crate::hbm; }\nuse crate::orbit;",
        "#[cfg(test)]\nuse crate::hbm;\nuse crate::orbit;",
        "#[cfg(not(test))] use crate::orbit;",
        "const A: char = '\\''; use crate::orbit; const B: char = '\"';",
        "fn f<'a>(x: &'a str) -> &'a str { crate::orbit::name(x) }",
    ] {
        let found: Vec<String> =
            of_lcp(text).into_iter().filter(|n| ["orbit", "hbm"].contains(&n.as_str())).collect();
        assert_eq!(found, ["orbit"], "{text}");
    }
}

#[test]
fn what_is_no_import_is_not_found() {
    for text in [
        "// use crate::orbit;",
        "/* use crate::orbit; /* crate::hbm */ crate::orbit */",
        "//! Families: [`crate::orbit`].",
        "const A: &str = \"crate::orbit \\\" crate::hbm\";",
        "const A: &str = r#\"\" crate::orbit\"#;",
        "const A: &[u8] = b\"crate::orbit\";",
        "mod inner { fn f() { super::orbit() } }",
        "fn orbit() {} fn f() { self::orbit(); std::orbit::run(); other::crate_orbit() }",
        "#[cfg(test)]\n#[allow(dead_code)]\nmod tests { mod a { use crate::orbit; } fn f() { crate::hbm::f() } }",
        "#[cfg(all(test, unix))] fn f(x: [u8; 2]) { crate::orbit::f() }",
        "pub(crate) fn f() -> impl Iterator + use<'_> { g() }",
        "use ::orbit::x; use orbit::y;",
    ] {
        let found: Vec<String> =
            of_lcp(text).into_iter().filter(|n| ["orbit", "hbm"].contains(&n.as_str())).collect();
        assert!(found.is_empty(), "{text}: {found:?}");
    }
}

#[test]
fn lines_and_whole_paths_are_kept() {
    let text = "/* a\nb */\nuse crate::fem::{\n    Body,\n    sparse::*,\n};";
    let paths: Vec<(usize, String)> =
        named(text, &["contact"]).into_iter().map(|n| (n.line, n.path.join("::"))).collect();
    assert_eq!(paths, [(4, "fem::Body".into()), (5, "fem::sparse::*".into())]);
}

#[test]
fn files_that_are_taken_in_are_seen() {
    assert!(declares_modules_only("//! x\n/// y\npub mod a;\npub mod b;\n"));
    assert!(declares_modules_only("pub mod a;\npub use signorini_core::{b, c};\n"));
    assert!(declares_modules_only("#[doc(hidden)]\npub mod a;\n#[doc(hidden)]\npub mod b;\n"));
    assert!(!declares_modules_only("#[doc(hidden)]\npub use a::B;\n"));
    assert!(declares_modules_only(
        "#![doc = concat!(\"a\", include_str!(\"b.rs\"))]\npub mod a;\n"
    ));
    assert!(!declares_modules_only("#![doc = \"a\"]\npub use a::B;\n"));
    assert!(!declares_modules_only("pub mod a;\npub use a::B;\n"));
    assert!(!declares_modules_only("pub use signorini_core::{b as c};\n"));
    assert!(
        takes_in_files("#[path = \"../x.rs\"] mod x;") && takes_in_files("include!(\"x.rs\");")
    );
    assert!(!takes_in_files("let path = 1; // include!(x)"));
}
