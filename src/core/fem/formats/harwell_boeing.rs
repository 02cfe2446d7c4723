//! Harwell–Boeing, as Ansys's `HBMAT` writes it: columns of the lower triangle in fields of fixed width.
//!
//! ```text
//! title                                                                   key            72 + 8
//! lines in all, of pointers, of rows, of values, of right sides                          5I14
//! type, rows, columns, entries, 0                                                        A3,11X,4I14
//! format of pointers, of rows, of values, of right sides                                 2A16,2A20
//! ```

use super::{Written, real, whole};

/// The third line says so.
pub(super) fn is_one(text: &str) -> bool {
    let mut lines = text.lines();
    let (sizes, kind) = (lines.nth(1), lines.next());
    let numbers = sizes.is_some_and(|l| {
        let words: Vec<&str> = l.split_whitespace().collect();
        (4..=5).contains(&words.len()) && words.iter().all(|w| w.parse::<u64>().is_ok())
    });
    let letters = |k: &str| {
        let b = k.as_bytes();
        b.len() >= 3
            && b"RCPrcp".contains(&b[0])
            && b"SUHZRsuhzr".contains(&b[1])
            && b"AEae".contains(&b[2])
    };
    numbers && kind.is_some_and(letters)
}

/// Width of a field of a format such as `(10I8)`, `(1P,3D25.16)`, and how many a line has.
fn format(text: &str) -> Option<(usize, usize)> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let last = inner.rsplit(',').next()?.trim();
    let letter = last.find(|c: char| "IiEeDdFfGg".contains(c))?;
    let count = match last[..letter].trim() {
        "" => 1,
        // 1P3D25.16
        words => words.rsplit(['P', 'p']).next()?.trim().parse().ok()?,
    };
    let width = last[letter + 1..].split('.').next()?.trim().parse().ok()?;
    (width > 0 && count > 0).then_some((width, count))
}

/// So many fields of lines.
fn fields<'t>(
    lines: &mut impl Iterator<Item = (usize, &'t str)>,
    count: usize,
    (width, of_line): (usize, usize),
    what: &str,
) -> Result<Vec<&'t str>, String> {
    let mut all = vec![];
    while all.len() < count {
        let Some((k, line)) = lines.next() else {
            return Err(format!("ends within its {what}: {} of {count}", all.len()));
        };
        if !line.is_ascii() {
            return Err(format!("line {}: is no text in ASCII", k + 1));
        }
        let mut at = 0;
        for _ in 0..of_line.min(count - all.len()) {
            let field = line.get(at..line.len().min(at + width)).map(str::trim).unwrap_or_default();
            if field.is_empty() {
                return Err(format!("line {}: a field of the {what} is empty", k + 1));
            }
            all.push(field);
            at += width;
        }
    }
    Ok(all)
}

/// Read it.
pub(super) fn read(text: &str) -> Result<Written, String> {
    let mut lines = text.lines().enumerate().skip(1);
    let mut next = || lines.next().map(|(_, l)| l).ok_or("ends within its head");
    let numbers = |line: &str| -> Vec<usize> {
        line.split_whitespace().filter_map(|w| w.parse().ok()).collect()
    };
    let of_right = numbers(next()?).get(4).copied().unwrap_or(0);
    let sizes = next()?;
    let kind = sizes.get(..3).unwrap_or_default().to_ascii_uppercase();
    if kind != "RSA" && kind != "RUA" {
        return Err(format!(
            "is of type {kind}: RSA (real, symmetric, assembled) and RUA are read; write real matrices, without damping that makes them complex"
        ));
    }
    let [rows, columns, entries, ..] = numbers(sizes.get(3..).unwrap_or_default())[..] else {
        return Err("has no sizes in its third line".into());
    };
    if rows != columns {
        return Err(format!("is {rows} × {columns}"));
    }
    // every entry takes at least four bytes, of row and value
    if entries > text.len() / 4 || rows > text.len() {
        return Err(format!("promises {rows} rows and {entries} entries in {} bytes", text.len()));
    }
    let formats = next()?;
    let part =
        |from: usize, to: usize| formats.get(from..formats.len().min(to)).unwrap_or_default();
    let [pointers, indices, values] = [part(0, 16), part(16, 32), part(32, 52)].map(format);
    let (Some(pointers), Some(indices), Some(values)) = (pointers, indices, values) else {
        return Err(format!("\"{}\" are no formats of its numbers", formats.trim()));
    };
    if of_right > 0 {
        next()?;
    }
    let whole_numbers = |all: Vec<&str>, what: &str| -> Result<Vec<usize>, String> {
        let read = |w: &&str| w.parse::<usize>().ok().filter(|i| *i > 0);
        let bad = || format!("one of its {what} is no whole number from 1 on");
        all.iter().map(|w| read(w).ok_or_else(bad)).collect()
    };
    let first = whole_numbers(fields(&mut lines, columns + 1, pointers, "pointers")?, "pointers")?;
    if first[0] != 1 || first.windows(2).any(|w| w[0] > w[1]) || first[columns] != entries + 1 {
        return Err(format!(
            "column pointers end at {}, with {entries} entries: version 9 of Ansys wrote superelements so; write the matrix anew, or with another version",
            first[columns]
        ));
    }
    let row = whole_numbers(fields(&mut lines, entries, indices, "rows")?, "rows")?;
    let numbers = fields(&mut lines, entries, values, "values")?;
    let mut all = Vec::with_capacity(entries);
    for column in 0..columns {
        for k in first[column] - 1..first[column + 1] - 1 {
            let value =
                real(numbers[k]).ok_or_else(|| format!("\"{}\" is no number", numbers[k]))?;
            if row[k] > rows {
                return Err(format!("row {} of {rows}", row[k]));
            }
            all.push((row[k] - 1, column, value));
        }
    }
    let (matrix, one_triangle) = whole(rows, all, false)?;
    let format = "Harwell-Boeing";
    Ok(Written { format, matrix, entries, one_triangle, names: vec![], held: vec![] })
}

#[cfg(test)]
mod tests {
    use super::{format, read};

    const SMALL: &str = "title                                                                   key\n             5             1             1             2             0\nRSA                        2             2             3             0\n(3I4)           (3I4)           (2D12.4)            (2D12.4)\n   1   3   4\n   1   2   2\n  2.0000D+00 -1.0000D+00\n  3.0000D+00\n";

    #[test]
    fn fields_touch_and_pointers_end_where_entries_do() {
        assert_eq!(format("(1P,3D25.16)"), Some((25, 3)));
        assert_eq!(format("(I14)"), Some((14, 1)));
        assert_eq!(format("(1P5E16.8)"), Some((16, 5)));
        let a = read(SMALL).unwrap();
        let all: Vec<_> = a.matrix.triplets().collect();
        assert_eq!(all, [(0, 0, 2.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 3.0)]);
        assert!(a.one_triangle);
        for (from, to, words) in [
            ("   1   3   4", "   1   3   5", "pointers end at 5"),
            ("RSA", "CSA", "type CSA"),
            ("(2D12.4) ", "2D12.4   ", "no formats"),
            ("   1   2   2", "   1   9   2", "row 9"),
            ("  3.0000D+00\n", "", "ends within its values"),
        ] {
            let said = read(&SMALL.replacen(from, to, 1)).unwrap_err();
            assert!(said.contains(words), "{from}: {said}");
        }
    }
}
