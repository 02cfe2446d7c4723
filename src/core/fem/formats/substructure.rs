//! Substructures of Abaqus and CalculiX (`*SUBSTRUCTURE MATRIX OUTPUT`), written as user elements.
//!
//! ```text
//! *USER ELEMENT, NODES= 4, LINEAR
//! ** ELEMENT NODES
//! **  2, 3, 5, 8                     nodes, in comments
//!  1, 2, 3                           directions of the first node: valid from there on
//!  3, 1, 2                           of the third: node, directions
//! *MATRIX, TYPE=STIFFNESS            upper triangle column by column, numbers in any lines
//! ```

use super::{DofName, Named, real};
use crate::fem::Csr;

/// It has a user element.
pub(super) fn is_one(text: &str) -> bool {
    let mut keywords = text.lines().filter(|l| l.starts_with('*') && !l.starts_with("**"));
    keywords.next().is_some_and(|l| l.to_uppercase().replace(' ', "").starts_with("*USERELEMENT"))
}

/// The words of a line between commas.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(str::trim).filter(|w| !w.is_empty())
}

/// All matrices of a file.
pub(super) fn read(text: &str) -> Result<Vec<Named>, String> {
    let (mut nodes, mut directions): (Vec<String>, Vec<(usize, Vec<u8>)>) = (vec![], vec![]);
    let mut matrices: Vec<(String, Vec<f64>)> = vec![];
    let (mut in_nodes, mut in_element) = (false, false);
    for (k, line) in text.lines().enumerate() {
        let fault = |why: String| format!("line {}: {why}", k + 1);
        if let Some(comment) = line.strip_prefix("**") {
            let is_list = comment.trim().bytes().all(|b| b.is_ascii_digit() || b" ,-".contains(&b));
            if comment.to_uppercase().contains("ELEMENT NODES") {
                in_nodes = true;
            } else if in_nodes && is_list && !comment.trim().is_empty() {
                nodes.extend(words(comment).map(str::to_owned));
            } else {
                in_nodes = false;
            }
            continue;
        }
        in_nodes = false;
        if line.starts_with('*') {
            let keyword = line.to_uppercase().replace(' ', "");
            in_element = keyword.starts_with("*USERELEMENT");
            if in_element && keyword.contains("UNSYM") {
                return Err(fault("an element that is not symmetric".into()));
            }
            if let Some(rest) = keyword.strip_prefix("*MATRIX") {
                let kind = rest.split("TYPE=").nth(1).unwrap_or("").split(',').next().unwrap_or("");
                matrices.push((kind.to_owned(), vec![]));
            }
            continue;
        }
        if in_element {
            let numbers: Vec<u64> = words(line).map_while(|w| w.parse().ok()).collect();
            let own = |list: &[u64]| -> Option<Vec<u8>> {
                list.iter().map(|d| u8::try_from(*d).ok().filter(|d| *d <= 6)).collect()
            };
            let from =
                if directions.is_empty() { 1 } else { numbers.first().copied().unwrap_or(0) };
            let list = if directions.is_empty() {
                &numbers[..]
            } else {
                numbers.get(1..).unwrap_or_default()
            };
            let list = own(list).filter(|l| !l.is_empty() && from > 0);
            let list = list.ok_or_else(|| fault("no list of directions".into()))?;
            directions.push((from as usize, list));
        } else if let Some((_, values)) = matrices.last_mut() {
            for w in words(line) {
                values.push(real(w).ok_or_else(|| fault(format!("\"{w}\" is no number")))?);
            }
        }
    }
    // the directions of a node are those of the last list that begins at it or before
    let mut names = vec![];
    for (k, node) in nodes.iter().enumerate() {
        let valid = directions.iter().rfind(|d| d.0 <= k + 1);
        for &direction in valid.map_or(&[][..], |d| &d.1) {
            names.push(DofName { node: node.clone(), direction });
        }
    }
    let n = names.len();
    if n == 0 {
        return Err("its comments do not say which nodes it has".into());
    }
    let named = |(kind, values): (String, Vec<f64>)| {
        if values.len() != n * (n + 1) / 2 {
            let (own, wanted) = (values.len(), n * (n + 1) / 2);
            return Named::refused(
                kind,
                &format!("has {own} numbers, and a triangle of {n} rows {wanted}"),
            );
        }
        let places = (0..n).flat_map(|j| (0..=j).map(move |i| (i, j)));
        let entries = places.zip(&values).filter(|e| *e.1 != 0.0).map(|((i, j), v)| (i, j, *v));
        let matrix = Csr::from_triplets(n, n, entries.collect());
        Named { names: names.clone(), entries: values.len(), ..Named::new(kind, Ok(matrix)) }
    };
    Ok(matrices.into_iter().map(named).collect())
}
