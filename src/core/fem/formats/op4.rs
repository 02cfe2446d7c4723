//! Nastran's `OUTPUT4` as text: matrices by columns, each column whole from its first row, or as strings of rows.
//!
//! ```text
//! columns, rows, form, type, name, format                    4I8, A8, "1P,3E23.16"
//! column, first row, words                                   3I8; first row 0: strings
//! ```

use super::{Named, real};
use crate::fem::Csr;

/// Most rows that are believed.
const MOST: i64 = 50_000_000;

fn whole_numbers(line: &str) -> Option<Vec<i64>> {
    let text = line.trim_end();
    if text.is_empty() || !text.is_ascii() || text.contains('.') {
        return None;
    }
    let word = |k: usize| text.get(8 * k..(8 * (k + 1)).min(text.len()))?.trim().parse().ok();
    (0..text.len().div_ceil(8)).map(word).collect()
}

/// What its first line says: columns, rows, form, type, name, and how wide a number is.
fn header(line: &str) -> Option<(i64, i64, i64, String, usize)> {
    let (numbers, rest) = (whole_numbers(line.get(..32)?)?, line.get(32..)?);
    let [columns, rows, form, kind] = numbers[..] else { return None };
    let is_one =
        (1..=MOST).contains(&columns) && (1..=9).contains(&form) && (1..=4).contains(&kind);
    let name = rest.get(..8).unwrap_or(rest).trim().to_uppercase();
    let format = rest.get(8..).unwrap_or("").trim().trim_matches(['(', ')']);
    let letter = format.rfind(['E', 'D', 'e', 'd'])?;
    let width = format[letter + 1..].split('.').next()?.parse().ok()?;
    (is_one && !name.is_empty() && width > 0).then_some((columns, rows, kind, name, width))
}

/// Its first line is a header.
pub(super) fn is_one(text: &str) -> bool {
    text.lines().next().is_some_and(|l| header(l).is_some())
}

/// All matrices of a file.
pub(super) fn read(text: &str) -> Result<Vec<Named>, String> {
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()).peekable();
    let mut found = vec![];
    while let Some((k, line)) = lines.next() {
        let Some((columns, rows, kind, name, width)) = header(line) else {
            return Err(format!("line {}: is no beginning of a matrix of OUTPUT4", k + 1));
        };
        let count = rows.abs();
        if count > MOST {
            return Err(format!("line {}: {count} rows", k + 1));
        }
        let mut entries = vec![];
        loop {
            let Some((k, line)) = lines.next() else {
                return Err(format!("ends within {name}"));
            };
            let fault = |why: &str| format!("line {}: {why}", k + 1);
            let head = whole_numbers(line).filter(|h| h.len() == 3);
            let Some([column, first, _]) = head.as_deref() else {
                return Err(fault("no column begins here"));
            };
            let (column, mut row) = (*column, *first);
            // a column that is none ends the matrix; a number stands in it
            let is_last = column > columns;
            if column < 1 {
                return Err(fault("a column before the first"));
            }
            while let Some((at, line)) = lines.peek().copied() {
                let fault = |why: &str| format!("line {}: {why}", at + 1);
                if let Some(numbers) = whole_numbers(line) {
                    // of a string: its first row and length, in one number or in two
                    match (numbers[..].as_ref(), *first) {
                        ([one], 0) => row = one % 65_536,
                        ([_, own], 0) => row = *own,
                        _ => break,
                    }
                    lines.next();
                    continue;
                }
                if header(line).is_some() {
                    break;
                }
                lines.next();
                for field in line.as_bytes().chunks(width) {
                    let field = std::str::from_utf8(field).unwrap_or("");
                    if field.trim().is_empty() {
                        continue;
                    }
                    let value = real(field).ok_or_else(|| fault("a field is no number"))?;
                    if is_last {
                        continue;
                    }
                    if !(1..=count).contains(&row) {
                        return Err(fault("a row that the matrix does not have"));
                    }
                    entries.push((row as usize - 1, column as usize - 1, value));
                    row += 1;
                }
            }
            if is_last {
                break;
            }
        }
        if kind > 2 {
            found.push(Named::refused(name, "is complex"));
            continue;
        }
        let stored = entries.len();
        let nonzero = entries.into_iter().filter(|e| e.2 != 0.0).collect();
        let matrix = Csr::from_triplets(count as usize, columns as usize, nonzero);
        found.push(Named { entries: stored, ..Named::new(name, Ok(matrix)) });
    }
    Ok(found)
}
