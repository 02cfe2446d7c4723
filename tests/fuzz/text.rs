//! Mutations of bytes and of text: what a bad disk, an editor, another program, or a bad day makes of a file.

use crate::common::Splitmix;

/// Tokens that stand in place of a number.
pub const NUMBERS: &[&str] = &[
    "nan",
    "NaN",
    "inf",
    "-inf",
    "-1",
    "0",
    "-0.0",
    "0.0",
    "1",
    "2",
    "1e300",
    "-1e300",
    "1e-300",
    "1e308",
    "1e999",
    "5e-324",
    "1e16",
    "1e-16",
    "255",
    "65536",
    "2147483648",
    "4294967296",
    "4000000000",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999999",
    "0.1e",
    "0x7f",
    "1_000",
    "--1",
    "1.2.3",
    "",
];

/// Words of 8 bytes that stand in place of others: lengths, addresses, counts, numbers.
const WORDS: &[u64] = &[
    0,
    1,
    u64::MAX,
    u64::MAX - 1,
    1 << 63,
    (1 << 63) - 1,
    1 << 32,
    1 << 40,
    0xffff_ffff,
    0x7ff8_0000_0000_0000,
    0x7ff0_0000_0000_0000,
    0xfff0_0000_0000_0000,
    0x7fe1_ccf3_85eb_c8a0,
];

/// What HDF5 begins its structures with: damage near them is damage that matters.
const SIGNATURES: &[&[u8]] =
    &[b"\x89HDF", b"TREE", b"HEAP", b"SNOD", b"OHDR", b"GCOL", b"FRHP", b"BTHD", b"OCHK"];

/// Where to damage: half of the time near a structure, if there is one.
fn place(rng: &Splitmix, bytes: &[u8]) -> usize {
    if rng.below(2) == 0 {
        let signature = rng.pick(SIGNATURES);
        let from = rng.below(bytes.len());
        let found = bytes[from..].windows(signature.len()).position(|w| w == signature);
        if let Some(k) = found {
            return (from + k + rng.below(64)).min(bytes.len() - 1);
        }
    }
    if rng.below(4) == 0 { rng.below(bytes.len().min(2048)) } else { rng.below(bytes.len()) }
}

/// One to four damages of a file as bytes.
pub fn bytes(rng: &Splitmix, bytes: &mut Vec<u8>) {
    for _ in 0..1 + rng.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = place(rng, bytes);
        let end = (at + 1 + rng.below(1 << rng.below(10))).min(bytes.len());
        match rng.below(12) {
            0 | 1 => bytes[at] ^= 1 << rng.below(8),
            2 | 3 => bytes[at] = rng.bits() as u8,
            4 => bytes[at] = rng.pick(&[0, 1, 0x7f, 0x80, 0xff]),
            5 | 6 => {
                let word = rng.pick(WORDS).to_le_bytes();
                let from = if rng.below(2) == 0 { at & !7 } else { at };
                for (b, w) in bytes[from..].iter_mut().zip(word) {
                    *b = w;
                }
            }
            7 => bytes[at..end].fill(rng.pick(&[0, 0xff])),
            8 => bytes[at..end].iter_mut().for_each(|b| *b = rng.bits() as u8),
            9 => drop(bytes.drain(at..end)),
            10 => {
                let copy = bytes[at..end].to_vec();
                let to = rng.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            _ => {
                // a copy that ended too early is short by little as often as by much
                let kept = if rng.below(2) == 0 { at } else { bytes.len() - rng.below(64) };
                bytes.truncate(kept);
            }
        }
    }
}

/// Ranges of the numbers of a text.
pub fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let b = text.as_bytes();
    let word = |c: u8| c.is_ascii_alphanumeric() || c == b'_';
    let mut found = vec![];
    let mut i = 0;
    while i < b.len() {
        let signed = b[i] == b'-' && b.get(i + 1).is_some_and(u8::is_ascii_digit);
        if (b[i].is_ascii_digit() || signed) && (i == 0 || !word(b[i - 1])) {
            let from = i;
            i += 1;
            while i < b.len()
                && (word(b[i])
                    || b[i] == b'.'
                    || (b"+-".contains(&b[i]) && b"eE".contains(&b[i - 1])))
            {
                i += 1;
            }
            found.push(from..i);
        } else {
            i += 1;
        }
    }
    found
}

/// Where each piece of a text begins that is like a pattern.
fn places(text: &str, is_such: impl Fn(char) -> bool) -> Vec<usize> {
    text.char_indices().filter(|c| is_such(c.1)).map(|c| c.0).collect()
}

/// Put an extreme in place of a number.
pub fn number(rng: &Splitmix, text: &mut String, extremes: &[&str]) {
    if let Some(range) = rng.any(&numbers(text)) {
        text.replace_range(range, rng.pick(extremes));
    }
}

/// Put a word in place of another, wherever it stands or up to so many times.
fn exchange(rng: &Splitmix, text: &mut String, pairs: &[(&str, &str)], most: usize) {
    let (from, to) = rng.pick(pairs);
    let times = if most > 1 { 1 + rng.below(most) } else { 1 };
    *text = text.replacen(from, to, times);
}

/// Put another ordinary number in place of a number.
pub fn nudge(rng: &Splitmix, text: &mut String) {
    let Some(range) = rng.any(&numbers(text)) else { return };
    let Ok(x) = text[range.clone()].parse::<f64>() else { return };
    let y = match rng.below(5) {
        0 => x + 1.0,
        1 => -x,
        _ => x * rng.pick(&[0.5, 0.9, 1.1, 2.0, 3.0, 10.0, 0.1, 1e-3, 1e3, 1e-6, 1e6, 1e-12]),
    };
    // a whole number stays one
    let whole = !text[range.clone()].contains(['.', 'e', 'E']);
    let y = if whole { format!("{}", y.round()) } else { format!("{y:?}") };
    text.replace_range(range, &y);
}

/// How many changes: more often few, so that some are not hidden by others.
fn some(rng: &Splitmix) -> usize {
    rng.pick(&[1, 1, 1, 2, 2, 3])
}

/// Change a digit.
pub fn digit(rng: &Splitmix, text: &mut String) {
    if let Some(at) = rng.any(&places(text, |c| c.is_ascii_digit())) {
        text.replace_range(at..at + 1, &rng.below(10).to_string());
    }
}

/// Remove, double, exchange, cut or join lines.
pub fn lines(rng: &Splitmix, text: &mut String) {
    let mut list: Vec<String> = text.split_inclusive('\n').map(str::to_owned).collect();
    if list.is_empty() {
        return;
    }
    let (a, b) = (rng.below(list.len()), rng.below(list.len()));
    match rng.below(7) {
        0 | 1 => drop(list.remove(a)),
        2 => list.insert(b, list[a].clone()),
        3 => list.swap(a, b),
        4 => list.truncate(a),
        5 => {
            let kept = rng.below(list[a].len() + 1);
            list[a] = list[a].chars().take(kept).collect();
        }
        _ => list[a] = list[a].trim_end().to_owned(),
    }
    *text = list.concat();
}

/// Other ends of lines, a byte order mark, separators of another country, blanks.
pub fn dialect(rng: &Splitmix, text: &mut String) {
    *text = match rng.below(8) {
        0 => text.replace('\n', "\r\n"),
        1 => text.replace('\n', "\r"),
        2 => format!("\u{feff}{text}"),
        3 => text.replace(',', ";"),
        4 => text.replace('.', ","),
        5 => text.replace(' ', "\t"),
        6 => text.replace('\n', "\n\n"),
        _ => text.to_uppercase(),
    };
}

/// A text as bytes, now and then with some that are not text.
pub fn encoded(rng: &Splitmix, text: String) -> Vec<u8> {
    let mut out = text.into_bytes();
    match rng.below(16) {
        0 => {
            let at = rng.below(out.len() + 1);
            let what = rng.pick(&[
                &b"\xff"[..],
                b"\xc3\x28",
                b"\0",
                b"\x1b[2J",
                b"\xed\xa0\x80",
                "é→∂".as_bytes(),
            ]);
            out.splice(at..at, what.iter().copied());
        }
        1 => bytes(rng, &mut out),
        2 => out.truncate(rng.below(out.len() + 1)),
        _ => {}
    }
    out
}

/// Values that stand in place of any other in a scene.
const VALUES: &[&str] = &[
    "true",
    "\"\"",
    "\"x\"",
    "\"1/0\"",
    "\"sqrt(-1)\"",
    "\"x^x^x^x\"",
    "\"1e400*y\"",
    "\"0*x\"",
    "\"((((\"",
    "\"-1\"",
    "\"1.0 + 0.02*y\"",
    "\"nan\"",
    "\"left\"",
    "\"right\"",
    "\"top\"",
    "\"modal\"",
    "\"chebyshev\"",
    "\"dopri5\"",
    "\"auto\"",
    "\"lumped\"",
    "\"bar\"",
    "\"plate\"",
    "\"matrices\"",
    "\"point\"",
    "\"traction\"",
    "\"../../x\"",
    "\"bar.toml\"",
    "[]",
    "[[]]",
    "[1.0]",
    "[0.0, 0.0]",
    "[-1.0, 1.0]",
    "[1.0, 2.0, 3.0]",
    "[nan, inf]",
    "[1e300, 1e300]",
    "[\"x\", \"y\"]",
    "[\"-2*x\", \"0\"]",
    "[[1, 0.01], [2, 0.02]]",
    "[[1, 0.01], [1, 0.01]]",
    "{}",
    "{ a = 1 }",
    "1979-05-27",
    "'''x",
    "\"\\u0000\"",
    "\"\\u001b[31m\"",
];

/// A name that nothing has, or that something else has.
const NAMES: &[&str] = &[
    "body", "contact", "initial", "run", "orbit", "load", "support", "damping", "mode", "gap",
    "edge", "kind", "omega", "file", "x", "until", "periods", "peak", "ratios", "size",
];

/// A value that is nested deeply, or an expression that is.
fn nested(rng: &Splitmix) -> String {
    let depth = rng.pick(&[10, 127, 1000, 20_000, 100_000]);
    let (open, middle, close) = rng.pick(&[
        ("[", "1", "]"),
        ("{a=", "1", "}"),
        ("\"(", "x", ")\""),
        ("\"-", "x", "\""),
        ("\"sin(", "x", ")\""),
        ("\"x^", "2", "\""),
    ]);
    match open.strip_prefix('"') {
        None => format!("{}{middle}{}", open.repeat(depth), close.repeat(depth)),
        Some(open) => {
            let close = close.trim_end_matches('"');
            format!("\"{}{middle}{}\"", open.repeat(depth), close.repeat(depth))
        }
    }
}

/// Line and range of the value of a random key.
fn value(rng: &Splitmix, text: &str) -> Option<std::ops::Range<usize>> {
    let keys: Vec<usize> = text.match_indices(" = ").map(|m| m.0 + 3).collect();
    let from = rng.any(&keys)?;
    let end = text[from..].find('\n').map_or(text.len(), |n| from + n);
    Some(from..end)
}

/// One to three changes of a scene; `other` lends lines.
pub fn scene(rng: &Splitmix, text: &str, other: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..some(rng) {
        match rng.below(20) {
            0..=3 => number(rng, &mut text, NUMBERS),
            4..=8 => nudge(rng, &mut text),
            9 => digit(rng, &mut text),
            16 | 17 => lines(rng, &mut text),
            18 => {
                if let Some(range) = value(rng, &text) {
                    text.replace_range(range, rng.pick(VALUES));
                }
            }
            10 => {
                // two values exchanged
                if let (Some(a), Some(b)) = (value(rng, &text), value(rng, &text)) {
                    let (a, b) = if a.start < b.start { (a, b) } else { (b, a) };
                    if a.end <= b.start {
                        let (x, y) = (text[a.clone()].to_owned(), text[b.clone()].to_owned());
                        text.replace_range(b, &x);
                        text.replace_range(a, &y);
                    }
                }
            }
            11 => {
                // a key of another name
                let keys: Vec<usize> = text.match_indices(" = ").map(|m| m.0).collect();
                if let Some(end) = rng.any(&keys) {
                    let from = text[..end].rfind('\n').map_or(0, |n| n + 1);
                    text.replace_range(from..end, rng.pick(NAMES));
                }
            }
            12 => {
                let pairs = &[
                    ("[contact]", "[[contact]]"),
                    ("[[load]]", "[load]"),
                    ("[[support]]", "[support]"),
                    ("[body]", "[body.body]"),
                    ("[initial]", "[run]"),
                    ("[run]", "[orbit]"),
                    ("[orbit]", "[damping]"),
                    ("]", ""),
                    ("\"", ""),
                ];
                exchange(rng, &mut text, pairs, 1);
            }
            13 => {
                // lines of another scene
                let lent: Vec<&str> = other.split_inclusive('\n').collect();
                let at = rng.below(lent.len());
                let few: String = lent.iter().skip(at).take(1 + rng.below(6)).copied().collect();
                let to = rng.any(&places(&text, |c| c == '\n')).map_or(0, |end| end + 1);
                text.insert_str(to, &few);
            }
            14 => {
                if let Some(range) = value(rng, &text) {
                    text.replace_range(range, &nested(rng));
                }
            }
            _ => match rng.below(3) {
                0 => dialect(rng, &mut text),
                1 => text.push_str(&format!("\n{}.x = 1\n", vec!["a"; 20_000].join("."))),
                _ => text
                    .push_str(&format!("\n[[load]]\nkind = \"mode\"\nmode = {}\n", rng.below(9))),
            },
        }
    }
    text
}

/// One to three changes of a Matrix Market file.
pub fn matrix(rng: &Splitmix, text: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..some(rng) {
        match rng.below(12) {
            0 | 1 => number(rng, &mut text, NUMBERS),
            2 | 10 | 11 => nudge(rng, &mut text),
            3 => {
                // the line of sizes is the second number or the third of the file
                let found = numbers(&text);
                if let Some(range) = rng.any(&found[..found.len().min(3)]) {
                    text.replace_range(range, rng.pick(NUMBERS));
                }
            }
            4 => digit(rng, &mut text),
            5 | 6 => lines(rng, &mut text),
            7 => dialect(rng, &mut text),
            _ => {
                let pairs = &[
                    ("general", "symmetric"),
                    ("symmetric", "general"),
                    ("symmetric", "skew-symmetric"),
                    ("real", "integer"),
                    ("real", "complex"),
                    ("real", "pattern"),
                    ("coordinate", "array"),
                    ("array", "coordinate"),
                    ("matrix", "vector"),
                    ("%%MatrixMarket", "%MatrixMarket"),
                    ("%%MatrixMarket", "%%MatrixMarket matrix"),
                ];
                exchange(rng, &mut text, pairs, 1);
            }
        }
        if numbers(&text).is_empty() {
            break;
        }
    }
    text
}

/// One to three changes of a CSV file.
pub fn csv(rng: &Splitmix, text: &str) -> String {
    let mut text = text.to_owned();
    for _ in 0..some(rng) {
        match rng.below(12) {
            0 | 1 => number(rng, &mut text, NUMBERS),
            2 | 3 | 10 => nudge(rng, &mut text),
            4 => digit(rng, &mut text),
            5 | 6 => lines(rng, &mut text),
            7 => dialect(rng, &mut text),
            _ => {
                let pairs = &[
                    ("cos", "sin"),
                    ("sin", "cos"),
                    ("cos", "tan"),
                    (",", ",,"),
                    (",", ""),
                    ("point", "omega"),
                    ("\n1,", "\n2,"),
                    ("\n2,", "\n1,"),
                ];
                exchange(rng, &mut text, pairs, 3);
            }
        }
    }
    text
}

/// Numbers of a journal, which keeps them by their bits: NaN, infinities, 1e300, −1, the least of all.
const BITS: &[&str] = &[
    "9221120237041090560",
    "9218868437227405312",
    "18442240474082181120",
    "9094988921567168672",
    "13830554455654793216",
    "1",
    "0",
    "-1",
    "18446744073709551615",
    "18446744073709551616",
    "9223372036854775807",
    "4294967296",
    "1.5",
    "null",
    "true",
    "\"x\"",
    "[]",
    "[[1]]",
];

/// One to three changes of a journal; as often as not of its last line only, from which the continuation goes on.
pub fn journal(rng: &Splitmix, text: &str) -> String {
    let mut list: Vec<&str> = text.split_inclusive('\n').collect();
    if rng.below(2) == 0 {
        list.truncate(1 + rng.below(list.len()));
    }
    let from = if rng.below(2) == 0 { 0 } else { list.len() - 1 };
    let (head, mut text) = (list[..from].concat(), list[from..].concat());
    for _ in 0..some(rng) {
        match rng.below(12) {
            0 | 1 => number(rng, &mut text, BITS),
            2 | 3 => digit(rng, &mut text),
            4..=6 => lines(rng, &mut text),
            7 => {
                // a list that lost its end, or all of it
                if let Some(list) = rng.any(&places(&text, |c| c == '[')) {
                    let from = list + 1;
                    let end = text[from..].find(']').map_or(text.len(), |n| from + n);
                    let cut = text[from..end].rfind(',').map_or(from, |n| from + n);
                    let cut = if rng.below(3) == 0 { from } else { cut };
                    text.replace_range(cut..end, "");
                }
            }
            8 => {
                // a list that is longer
                if let Some(at) = rng.any(&places(&text, |c| c == ',')) {
                    text.insert_str(at, &format!(",{}", rng.pick(BITS)));
                }
            }
            9 => {
                let pairs = &[
                    ("regular", "gap: x"),
                    ("regular", "end of range"),
                    ("regular", ""),
                    ("regular", "start"),
                    ("\"orbit\":{", "\"orbit\":null,\"x\":{"),
                    ("\"place\":{", "\"place\":null,\"x\":{"),
                    ("\"branch\":0", "\"branch\":7"),
                    ("\"branch\":0", "\"branch\":18446744073709551615"),
                    ("\"branch\":1", "\"branch\":0"),
                    ("true", "false"),
                    ("false", "true"),
                    ("null", "0"),
                    ("\\n", ""),
                ];
                exchange(rng, &mut text, pairs, 20);
            }
            10 => dialect(rng, &mut text),
            _ => {
                // cut anywhere, as by a kill
                let at = rng.below(text.len() + 1);
                text = text.chars().take(at).collect();
            }
        }
    }
    head + &text
}
