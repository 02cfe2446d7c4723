//! Nastran's `DMIG`, as a punch file or the bulk data have it: fields of 8 or 16 letters, or with commas.
//!
//! ```text
//! DMIG    NAME    0       IFO     TIN     TOUT    POLAR           NCOL       IFO 1 square, 6 symmetric, 2 9 rectangular
//! DMIG*   NAME            GJ              CJ
//! *       G1              C1              A1                               row G1.C1 of column GJ.CJ
//! ```

use std::collections::HashMap;

use super::{DofName, Named, real, whole};

/// The first card says so, behind comments and what stands before the bulk data.
pub(super) fn is_one(text: &str) -> bool {
    let mut cards = text.lines().filter(|l| !l.starts_with('$') && !l.trim().is_empty());
    cards.any(|l| l.get(..4).is_some_and(|w| w.eq_ignore_ascii_case("DMIG")))
}

/// A card: its line, and its fields behind the first.
struct Card<'t> {
    line: usize,
    name: String,
    fields: Vec<&'t str>,
}

/// The fields of a line behind its first, four or eight.
fn fields(line: &str) -> Vec<&str> {
    if line.contains(',') {
        let mut all: Vec<&str> = line.split(',').skip(1).map(str::trim).collect();
        all.resize(all.len().next_multiple_of(8).max(8), "");
        return all;
    }
    let is_large = line.get(..8).unwrap_or(line).contains('*');
    let (width, count) = if is_large { (16, 4) } else { (8, 8) };
    let at = |k: usize| {
        let (begin, end) = (8 + width * k, (8 + width * (k + 1)).min(line.len()));
        line.get(begin..end.max(begin)).unwrap_or("").trim()
    };
    (0..count).map(at).collect()
}

fn cards(text: &str) -> Vec<Card<'_>> {
    let mut all: Vec<Card> = vec![];
    for (k, line) in text.lines().enumerate() {
        if line.starts_with('$') || line.trim().is_empty() || !line.is_ascii() {
            continue;
        }
        let first = line.split(',').next().unwrap_or(line);
        let first = first.get(..8).unwrap_or(first).trim();
        match first.chars().next() {
            None | Some('*' | '+') => {
                if let Some(card) = all.last_mut() {
                    card.fields.extend(fields(line));
                }
            }
            Some(_) => {
                let name = first.trim_end_matches('*').to_uppercase();
                all.push(Card { line: k + 1, name, fields: fields(line) });
            }
        }
    }
    all
}

/// A matrix as it comes together.
#[derive(Default)]
struct Coming {
    form: u32,
    names: Vec<DofName>,
    place: HashMap<DofName, usize>,
    entries: Vec<(usize, usize, f64)>,
    refused: Option<String>,
}

impl Coming {
    fn at(&mut self, node: &str, direction: &str, line: usize) -> Result<usize, String> {
        let number = node.parse::<i64>().ok().filter(|n| *n > 0);
        let direction = if direction.is_empty() { "0" } else { direction };
        let direction = direction.parse::<u8>().ok().filter(|d| *d <= 6);
        let (Some(number), Some(direction)) = (number, direction) else {
            return Err(format!("line {line}: \"{node}\" and its component are no displacement"));
        };
        let name = DofName { node: number.to_string(), direction };
        let next = self.names.len();
        let place = *self.place.entry(name.clone()).or_insert(next);
        if place == next {
            self.names.push(name);
        }
        Ok(place)
    }
}

/// All matrices of a file.
pub(super) fn read(text: &str) -> Result<Vec<Named>, String> {
    let mut order: Vec<String> = vec![];
    let mut all: HashMap<String, Coming> = HashMap::new();
    for card in cards(text).iter().filter(|c| c.name == "DMIG") {
        let line = card.line;
        let field = |k: usize| card.fields.get(k).copied().unwrap_or("");
        let name = field(0).to_uppercase();
        if field(1) == "0" {
            let number = |k: usize| field(k).parse::<u32>().unwrap_or(0);
            let (form, kind) = (number(2), number(3));
            let mut coming = Coming { form, ..Coming::default() };
            if kind > 2 {
                coming.refused = Some("is complex".into());
            }
            if !matches!(form, 1 | 6) {
                coming.refused = Some("is rectangular: loads, and no matrix of a body".into());
            }
            if all.insert(name.clone(), coming).is_some() {
                return Err(format!("line {line}: {name} begins a second time"));
            }
            order.push(name);
            continue;
        }
        let Some(coming) = all.get_mut(&name) else {
            return Err(format!("line {line}: a column of {name}, which no header announces"));
        };
        let column = coming.at(field(1), field(2), line)?;
        for group in card.fields.get(4..).unwrap_or_default().chunks(4) {
            let at = |k: usize| group.get(k).copied().unwrap_or("");
            if at(0).is_empty() {
                continue;
            }
            let row = coming.at(at(0), at(1), line)?;
            let Some(value) = real(at(2)) else {
                return Err(format!("line {line}: \"{}\" is no number", at(2)));
            };
            coming.entries.push((row, column, value));
        }
    }
    let named = |name: String| {
        let coming = all.remove(&name).unwrap_or_default();
        if let Some(why) = coming.refused {
            return Named::refused(name, &why);
        }
        let (n, count) = (coming.names.len(), coming.entries.len());
        let (matrix, triangle) = match whole(n, coming.entries, coming.form == 6) {
            Ok((matrix, triangle)) => (Ok(matrix), triangle),
            Err(why) => (Err(why), false),
        };
        Named {
            names: coming.names,
            entries: count,
            one_triangle: triangle,
            ..Named::new(name, matrix)
        }
    };
    Ok(order.into_iter().map(named).collect())
}
