//! An entry a line: `row column value` of CalculiX and of Abaqus's `COORDINATE`, or `node,direction, node,direction, value` of Abaqus's `MATRIX INPUT`.

use std::collections::HashMap;

use super::{DofName, Written, real, whole};

/// A diagonal of at least so many times the median, with nothing beside it, stands for a displacement that is held.
const HELD: f64 = 1e30;
/// Rows without an entry that a file may have.
const EMPTY_ROWS: usize = 1_000_000;

/// Read either of them.
pub(super) fn read(text: &str) -> Result<Written, String> {
    let is_data = |line: &str| {
        let line = line.trim_start();
        !line.is_empty()
            && !line.starts_with("**")
            && !line.starts_with('*')
            && !line.starts_with('#')
    };
    if text.lines().any(|l| l.trim_start().to_ascii_uppercase().starts_with("*USER ELEMENT")) {
        return Err("is a substructure (*USER ELEMENT), which is not read yet; write its matrices with *MATRIX GENERATE, or as .npz with SciPy".into());
    }
    let lines = || text.lines().enumerate().filter(|(_, line)| is_data(line));
    let Some((_, first)) = lines().next() else { return Err("has no entries".into()) };
    let with_commas = first.contains(',');
    let fields = |line: &str| -> Vec<String> {
        match with_commas {
            true => {
                line.split(',').map(|w| w.trim().to_owned()).filter(|w| !w.is_empty()).collect()
            }
            false => line.split_whitespace().map(str::to_owned).collect(),
        }
    };
    match fields(first).len() {
        3 => coordinates(lines().map(|(k, l)| (k + 1, fields(l)))),
        5 => labelled(lines().map(|(k, l)| (k + 1, fields(l)))),
        _ => Err(format!(
            "\"{}\" is neither an entry (row column value; node,direction, node,direction, value) nor the beginning of a format that is read",
            first.trim().chars().take(60).collect::<String>()
        )),
    }
}

fn coordinates(lines: impl Iterator<Item = (usize, Vec<String>)>) -> Result<Written, String> {
    let (mut entries, mut n) = (vec![], 0);
    for (k, words) in lines {
        let index = |w: &str| w.parse::<usize>().ok().and_then(|i| i.checked_sub(1));
        let entry = match &words[..] {
            [i, j, v] => index(i).zip(index(j)).zip(real(v)),
            _ => None,
        };
        let Some(((i, j), v)) = entry else {
            return Err(format!(
                "line {k}: \"{}\" is no row, column (from 1) and value",
                words.join(" ")
            ));
        };
        n = n.max(i.max(j) + 1);
        entries.push((i, j, v));
    }
    if n > EMPTY_ROWS + entries.len() {
        return Err(format!("{n} rows with {} entries: is a row number damaged?", entries.len()));
    }
    let count = entries.len();
    let (matrix, one_triangle) = whole(n, entries, false)?;
    if let Some(row) = held_rows(&matrix).first() {
        return Err(format!(
            "row {} has nothing but {:e} on its diagonal: a displacement that Abaqus holds. Write the matrices with FORMAT=MATRIX INPUT, whose rows have names",
            row + 1,
            matrix.row(*row).next().map_or(0.0, |e| e.1)
        ));
    }
    let format = "entries by row and column (CalculiX, Abaqus COORDINATE)";
    Ok(Written { format, matrix, entries: count, one_triangle, names: vec![], held: vec![] })
}

/// Rows of nothing but a huge number on the diagonal.
fn held_rows(a: &crate::fem::Csr) -> Vec<usize> {
    let diagonal = |i: usize| a.row(i).find(|e| e.0 == i).map_or(0.0, |e| e.1.abs());
    let mut sizes: Vec<f64> = (0..a.n_rows()).map(diagonal).filter(|d| *d > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    // of those that are held the median may be one itself
    let ordinary: Vec<f64> = sizes.iter().copied().filter(|d| *d < HELD).collect();
    let median = ordinary.get(ordinary.len() / 2).copied().unwrap_or(1.0);
    let is_held = |i: &usize| {
        diagonal(*i) >= HELD * median.min(1.0)
            && diagonal(*i) >= 1e20 * median
            && a.row(*i).all(|e| e.0 == *i || e.1 == 0.0)
    };
    (0..a.n_rows()).filter(is_held).collect()
}

fn labelled(lines: impl Iterator<Item = (usize, Vec<String>)>) -> Result<Written, String> {
    let mut row_of: HashMap<DofName, usize> = HashMap::new();
    let mut names: Vec<DofName> = vec![];
    let mut entries = vec![];
    for (k, words) in lines {
        let fail = |what: &str| Err(format!("line {k}: {what}: \"{}\"", words.join(", ")));
        let [n, d, m, e, v] = &words[..] else {
            return fail("no node, direction, node, direction, value");
        };
        let mut place = [0; 2];
        for (place, (node, direction)) in place.iter_mut().zip([(n, d), (m, e)]) {
            if node.parse::<i64>().is_ok_and(|n| n <= 0) {
                return fail(
                    "an internal node (Lagrange multipliers, connectors, hybrid elements), whose stiffness has no energy: couple without multipliers, or make a substructure",
                );
            }
            let direction = match direction.parse::<u8>() {
                Ok(d @ 0..=6) => d,
                Ok(7) => {
                    return fail(
                        "direction 7 is warping, and no displacement: write matrices of solid elements",
                    );
                }
                Ok(8) => {
                    return fail(
                        "direction 8 is a pressure, and no displacement: write matrices of the solid alone",
                    );
                }
                Ok(11..=30) => {
                    return fail(
                        "a temperature, and no displacement: write matrices of the solid alone",
                    );
                }
                _ => return fail("no direction from 1 to 6"),
            };
            let name = DofName { node: node.clone(), direction };
            let next = names.len();
            *place = *row_of.entry(name.clone()).or_insert(next);
            if *place == next {
                names.push(name);
            }
        }
        let Some(v) = real(v) else { return fail("no number at the end") };
        entries.push((place[0], place[1], v));
    }
    let count = entries.len();
    let (matrix, one_triangle) = whole(names.len(), entries, true)?;
    let gone = held_rows(&matrix);
    let kept: Vec<usize> = (0..names.len()).filter(|i| gone.binary_search(i).is_err()).collect();
    let held: Vec<DofName> = gone.iter().map(|&i| names[i].clone()).collect();
    let mut place = vec![usize::MAX; names.len()];
    kept.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let inside = matrix.triplets().filter(|e| place[e.0] != usize::MAX && place[e.1] != usize::MAX);
    let entries_kept = inside.map(|(i, j, v)| (place[i], place[j], v)).collect();
    let matrix = crate::fem::Csr::from_triplets(kept.len(), kept.len(), entries_kept);
    let names = kept.iter().map(|&i| names[i].clone()).collect();
    let format = "Abaqus MATRIX INPUT";
    Ok(Written { format, matrix, entries: count, one_triangle, names, held })
}

#[cfg(test)]
mod tests {
    use super::read;

    #[test]
    fn triangles_are_mirrored_and_halves_refused() {
        let upper = read("1 1  2.0\n1 2 -1.0\n2 2  3.0\n").unwrap();
        assert!(upper.one_triangle);
        assert_eq!(upper.matrix.triplets().count(), 4);
        let both = read("1 1 2.0\n1 2 -1\n2 1 -1\n2 2 3\n").unwrap();
        assert!(!both.one_triangle && both.matrix == upper.matrix);
        for (bad, words) in [
            ("", "no entries"),
            ("1 2\n", "neither an entry"),
            ("1 1 2.0\n1 x 3.0\n", "line 2"),
            ("0 1 2.0\n", "line 1"),
            ("1 1 2\n1 1 2\n", "twice"),
            ("1 1 1\n2 2 1\n3 3 1\n1 2 1\n3 1 1\n", "no partner"),
            ("1 1 1e36\n2 2 1\n3 3 2\n", "that Abaqus holds"),
            ("1 1 1\n99999999 99999999 1\n", "damaged"),
            ("1,1, 1,1, x\n", "no number"),
            ("-3,1, -3,1, 1.0\n", "internal node"),
            ("3,8, 3,8, 1.0\n", "pressure"),
            ("*USER ELEMENT, NODES=2, LINEAR\n1 1 2\n", "substructure"),
        ] {
            let said = read(bad).unwrap_err();
            assert!(said.contains(words), "{bad:?}: {said}");
        }
    }

    #[test]
    fn labels_come_with_their_rows_and_held_ones_go() {
        let text =
            "** made by hand\n3,1, 3,1, 1.0e+36\n7,1, 7,1, 5.0\n7,2, 7,1, -1.0\n7,2, 7,2, 4.0\n";
        let read = read(text).unwrap();
        let names: Vec<String> = read.names.iter().map(ToString::to_string).collect();
        assert_eq!(
            (names, read.held[0].to_string()),
            (vec!["7.1".to_owned(), "7.2".into()], "3.1".into())
        );
        let all: Vec<_> = read.matrix.triplets().collect();
        assert_eq!(all, [(0, 0, 5.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 4.0)]);
    }
}
