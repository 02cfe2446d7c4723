//! Lines of Markdown that are not too long to read.

/// Letters of a line.
const WIDTH: usize = 118;

/// A paragraph.
pub fn paragraph(text: &str) -> String {
    wrapped("", text)
}

/// An item of a list, so many lists deep.
pub fn item(depth: usize, text: &str) -> String {
    let indent = "    ".repeat(depth);
    let all = wrapped(&format!("{indent}    "), text);
    format!("{indent}- {}", all.trim_start())
}

/// Words on lines that begin like this.
fn wrapped(indent: &str, text: &str) -> String {
    let mut out = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let full = line.chars().count() + 1 + word.chars().count() > WIDTH - indent.len();
        if full && !line.is_empty() {
            out += &format!("{indent}{line}\n");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    out + &format!("{indent}{line}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_short_and_words_stay_whole() {
        let words: Vec<String> = (0..100).map(|k| format!("wörd{k}")).collect();
        for text in [item(1, &words.join("  \n ")), paragraph(&words.join(" "))] {
            assert!(text.lines().all(|l| l.chars().count() <= 120), "{text}");
            let found: Vec<&str> = text.split_whitespace().filter(|w| *w != "-").collect();
            assert_eq!(found, words);
        }
        assert_eq!(item(0, "a b"), "- a b\n");
        assert!(item(1, &words.join(" ")).lines().skip(1).all(|l| l.starts_with("        w")));
    }
}
