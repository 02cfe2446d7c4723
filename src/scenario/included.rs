//! Decks in several files: `*INCLUDE, INPUT=file`, and lines of data in a file of their own (`*NODE, INPUT=file`), as one text.

use std::path::{Path, PathBuf};

use crate::mesh::deck;
use crate::mesh::gmsh::GmshError;

/// Decks are included in one another up to this depth, and so many in all.
const DEPTH: usize = 16;
const MOST: usize = 1000;

/// A file with what it includes.
#[derive(Debug, Default)]
pub struct Whole {
    /// All of it.
    pub bytes: Vec<u8>,
    /// The files that it includes.
    pub others: Vec<PathBuf>,
    /// Where lines come from, piece by piece: the first line of each, of which file, and which line of that; none of a file that includes no other.
    pieces: Vec<(usize, PathBuf, usize)>,
}

impl Whole {
    /// A mesh, or a deck with all that it includes. What goes wrong comes with what helps.
    pub fn read(path: &Path) -> Result<Whole, (String, Option<String>)> {
        let bytes = std::fs::read(path).map_err(|e| (e.to_string(), None))?;
        let mut whole = Whole { bytes, ..Whole::default() };
        let text = match std::str::from_utf8(&whole.bytes) {
            Ok(text) if deck::is_deck(&whole.bytes) && includes(text) => text.to_owned(),
            _ => return Ok(whole),
        };
        whole.bytes.clear();
        let mut written = Written { whole, lines: 0, included: 0 };
        written.put(path, &text, &mut vec![path.to_owned()])?;
        Ok(written.whole)
    }

    /// The files that a deck includes, as far as they can be found.
    pub fn others_of(path: &Path) -> Vec<PathBuf> {
        Whole::read(path).map_or(vec![], |whole| whole.others)
    }

    /// Where something is wrong, with the file where that is an included one.
    pub fn place(&self, e: &GmshError) -> String {
        let piece = self.pieces.iter().rev().find(|(first, ..)| e.line >= *first);
        match piece.filter(|_| e.line > 0) {
            Some((first, file, line)) => {
                let moved = GmshError { line: line + e.line - first, ..e.clone() };
                match self.others.contains(file) {
                    true => format!("{}, {}", file.display(), moved.place()),
                    false => moved.place(),
                }
            }
            None => e.place(),
        }
    }
}

/// A keyword that begins at a line, with the lines on which it goes on, and their number; none of data and comments.
fn keyword(lines: &[&str], at: usize) -> Option<(String, usize)> {
    let mut whole = lines[at].trim().to_owned();
    if !whole.starts_with('*') || whole.starts_with("**") {
        return None;
    }
    let mut count = 1;
    while let (true, Some(more)) = (whole.ends_with(','), lines.get(at + count)) {
        whole += more.trim();
        count += 1;
    }
    Some((whole, count))
}

/// Whether a deck takes lines from other files before its first step.
fn includes(text: &str) -> bool {
    let lines: Vec<&str> = text.lines().collect();
    let keywords = (0..lines.len()).filter_map(|at| keyword(&lines, at));
    let mut before = keywords.map(|(whole, _)| whole).take_while(|k| !deck::begins_step(k));
    before.any(|k| deck::input_of(&k).is_some())
}

/// What has been put together so far.
struct Written {
    whole: Whole,
    lines: usize,
    included: usize,
}

impl Written {
    /// Put a file to the rest; false behind its first step, where the deck ends.
    fn put(
        &mut self,
        path: &Path,
        text: &str,
        within: &mut Vec<PathBuf>,
    ) -> Result<bool, (String, Option<String>)> {
        self.begin(path, 1);
        let lines: Vec<&str> = text.lines().collect();
        let mut next = 0;
        while let Some(line) = lines.get(next) {
            let at = next;
            let found = keyword(&lines, at);
            next += 1;
            if found.as_ref().is_some_and(|(whole, _)| deck::begins_step(whole)) {
                self.line(line);
                return Ok(false);
            }
            let input = found.and_then(|(whole, count)| Some((deck::input_of(&whole)?, count)));
            let Some(((file, rest), count)) = input else {
                self.line(line);
                continue;
            };
            next = at + count;
            self.line(rest.as_deref().unwrap_or("**"));
            let folder = |p: &Path| p.parent().unwrap_or(Path::new("")).join(&file);
            let there = [folder(path), folder(&within[0])];
            let there = there.iter().find(|p| p.is_file()).unwrap_or(&there[0]).clone();
            let fault = |what: String| {
                let place = if within.len() > 1 {
                    path.display().to_string() + ", "
                } else {
                    String::new()
                };
                let help =
                    "give the file beside the deck that names it, or put its lines into the deck";
                (format!("{place}line {}: {what}", at + 1), Some(help.to_owned()))
            };
            self.included += 1;
            if within.contains(&there) {
                return Err(fault(format!("{file} includes itself")));
            }
            if within.len() > DEPTH || self.included > MOST {
                return Err(fault(format!(
                    "more than {DEPTH} files in one another, or {MOST} in all"
                )));
            }
            if !there.is_file() {
                return Err(fault(format!("{file} cannot be read: there is no such file")));
            }
            let more = std::fs::read_to_string(&there)
                .map_err(|e| fault(format!("{file} cannot be read: {e}")))?;
            let more = more.strip_prefix('\u{feff}').unwrap_or(&more);
            if !self.whole.others.contains(&there) {
                self.whole.others.push(there.clone());
            }
            within.push(there.clone());
            let goes_on = self.put(&there, more, within)?;
            within.pop();
            if !goes_on {
                return Ok(false);
            }
            self.begin(path, next + 1);
        }
        Ok(true)
    }

    /// From here on lines are those of a file from `line` on.
    fn begin(&mut self, path: &Path, line: usize) {
        self.whole.pieces.push((self.lines + 1, path.to_owned(), line));
    }

    fn line(&mut self, line: &str) {
        self.whole.bytes.extend_from_slice(line.as_bytes());
        self.whole.bytes.push(b'\n');
        self.lines += 1;
    }
}
