//! Matrices as text: Matrix Market (`.mtx`, coordinate or array, real, general or symmetric).

use super::Csr;

/// Rows without an entry that a matrix may have.
const EMPTY_ROWS: usize = 1_000_000;

/// What the first line of a Matrix Market file says.
#[derive(Clone, Copy)]
struct Format {
    is_dense: bool,
    is_symmetric: bool,
}

impl Format {
    fn parse(header: &str) -> Result<Format, String> {
        let words: Vec<String> = header.split_whitespace().map(str::to_lowercase).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let ["%%matrixmarket", "matrix", format, "real" | "integer", symmetry] = words[..] else {
            return Err(
                "does not begin with %%MatrixMarket matrix coordinate|array real general|symmetric"
                    .into(),
            );
        };
        let is_dense = match format {
            "coordinate" => false,
            "array" => true,
            other => return Err(format!("format \"{other}\" is neither coordinate nor array")),
        };
        let is_symmetric = match symmetry {
            "general" => false,
            "symmetric" => true,
            other => return Err(format!("symmetry \"{other}\" is neither general nor symmetric")),
        };
        Ok(Format { is_dense, is_symmetric })
    }
}

/// What the line of sizes says.
#[derive(Clone, Copy)]
struct Sizes {
    rows: usize,
    columns: usize,
    /// Number of entries that follow.
    count: usize,
}

impl Sizes {
    fn parse(line: &str, format: Format) -> Result<Sizes, String> {
        let sizes: Option<Vec<usize>> = line.split_whitespace().map(|w| w.parse().ok()).collect();
        let sizes = sizes.ok_or("its sizes are not whole numbers")?;
        let (rows, columns, count) = match (format.is_dense, &sizes[..]) {
            (false, [rows, columns, count]) => (*rows, *columns, Some(*count)),
            (true, [rows, columns]) if format.is_symmetric => {
                let twice = rows.checked_add(1).and_then(|m| rows.checked_mul(m));
                (*rows, *columns, Some(twice.unwrap_or(usize::MAX) / 2))
            }
            (true, [rows, columns]) => (*rows, *columns, rows.checked_mul(*columns)),
            _ => return Err("its line of sizes has the wrong length".into()),
        };
        if format.is_symmetric && rows != columns {
            return Err(format!("is symmetric and {rows} × {columns}"));
        }
        Ok(Sizes { rows, columns, count: count.unwrap_or(usize::MAX) })
    }

    /// Whether a text of so many bytes can hold that.
    fn check(self, bytes: usize) -> Result<(), String> {
        let Sizes { rows, columns, count } = self;
        // every entry takes at least a digit and a line's end; sizes alone take no memory
        if count > bytes / 2 {
            return Err(format!(
                "promises {count} entries in {bytes} bytes: is its line of sizes right?"
            ));
        }
        if rows.max(columns) > EMPTY_ROWS + count {
            return Err(format!(
                "is {rows} × {columns} with {count} entries: is its line of sizes right?"
            ));
        }
        Ok(())
    }
}

/// Reads the entries one by one.
struct Entries {
    format: Format,
    sizes: Sizes,
    /// Where the next entry of a dense matrix stands.
    place: (usize, usize),
}

impl Entries {
    fn parse(&mut self, line: &str) -> Option<(usize, usize, f64)> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (i, j, word) = match (self.format.is_dense, &words[..]) {
            (false, [i, j, v]) => {
                let index = |w: &str| w.parse::<usize>().ok().and_then(|i| i.checked_sub(1));
                (index(i)?, index(j)?, *v)
            }
            (true, [v]) => {
                let (i, j) = self.place;
                // column by column; of a symmetric matrix the lower triangle
                self.place = match i + 1 < self.sizes.rows {
                    true => (i + 1, j),
                    false => (if self.format.is_symmetric { j + 1 } else { 0 }, j + 1),
                };
                (i, j, *v)
            }
            _ => return None,
        };
        let value: f64 = word.parse().ok()?;
        let inside = i < self.sizes.rows && j < self.sizes.columns;
        (inside && value.is_finite()).then_some((i, j, value))
    }
}

/// Parse the text of a Matrix Market file.
pub fn parse_matrix_market(text: &str) -> Result<Csr, String> {
    let mut lines = text.lines().enumerate();
    let (_, header) = lines.next().ok_or("is empty")?;
    let format = Format::parse(header)?;
    let mut data = lines.filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('%'));
    let (_, sizes) = data.next().ok_or("has no sizes")?;
    let sizes = Sizes::parse(sizes, format)?;
    sizes.check(text.len())?;
    let Sizes { rows, columns, count } = sizes;
    let mut reader = Entries { format, sizes, place: (0, 0) };
    let mut entries = vec![];
    let mut found = 0;
    for (k, line) in data {
        let (i, j, value) = reader.parse(line).ok_or_else(|| {
            format!("line {}: \"{line}\" is no entry of a {rows} × {columns} matrix", k + 1)
        })?;
        found += 1;
        entries.push((i, j, value));
        if format.is_symmetric && i != j {
            entries.push((j, i, value));
        }
    }
    if found != count {
        return Err(format!("holds {found} entries and promises {count}: is it complete?"));
    }
    Ok(Csr::from_triplets(rows, columns, entries))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_of_matrix_market() {
        let general = "%%MatrixMarket matrix coordinate real general\n% a comment\n2 3 2\n1 1 2.5\n2 3 -1e-3\n";
        let a = parse_matrix_market(general).unwrap();
        assert_eq!((a.n_rows(), a.n_cols()), (2, 3));
        assert_eq!(a.triplets().collect::<Vec<_>>(), vec![(0, 0, 2.5), (1, 2, -1e-3)]);
        let symmetric = "%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n3\n";
        let a = parse_matrix_market(symmetric).unwrap();
        assert_eq!(
            a.triplets().collect::<Vec<_>>(),
            vec![(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 3.0)]
        );
        for bad in [
            "",
            "hello",
            "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1\n",
            "%%MatrixMarket matrix coordinate real general\n2 2 1\n3 1 1.0\n",
            "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.0\n",
            "%%MatrixMarket matrix array real general\n2 2\n1.0\n2.0\n3.0\n",
            "%%MatrixMarket matrix coordinate real general\n2000000000000000000 2000000000000000000 0\n",
            "%%MatrixMarket matrix coordinate real general\n1000000000000000000 1000000000000000000 0\n",
            "%%MatrixMarket matrix coordinate real general\n4000000000 4000000000 7\n1 1 1.0\n",
            "%%MatrixMarket matrix coordinate real general\n18446744073709551615 2 1\n1 1 1.0\n",
            "%%MatrixMarket matrix coordinate real symmetric\n2 5 1\n1 5 1.0\n",
            "%%MatrixMarket matrix array real general\n4294967296 4294967296\n1.0\n",
            "%%MatrixMarket matrix array real symmetric\n18446744073709551615 18446744073709551615\n1.0\n",
        ] {
            assert!(parse_matrix_market(bad).is_err(), "{bad}");
        }
    }
}
