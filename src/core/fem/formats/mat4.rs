//! MATLAB's files of version 4: one matrix after the other, each five whole numbers, a name, and its numbers by columns.
//!
//! The first of the five, `MOPT`, says in its decimal digits in which order the bytes stand (`M`), the type of the numbers (`P`), and what they are (`T`: 0 a full matrix,
//! 1 words, 2 a sparse one: a row of row, column and value for each entry, the last with the sizes). Rows, columns, whether it is complex, and the length of the name follow.

use super::{Named, Sizes, by_columns, sparse};
use crate::fem::Csr;

/// What stands before the numbers of a matrix.
struct Head {
    is_big_endian: bool,
    /// `P`
    precision: u32,
    /// `T`
    kind: u32,
    sizes: Sizes,
    is_complex: bool,
    name: String,
    /// Bytes of all this.
    length: usize,
}

/// Longest name: MATLAB's own have 63 letters.
const LONGEST: usize = 256;

/// The numbers of five that a matrix begins with, its name behind them.
const FIVE: usize = 20;

impl Head {
    fn read(bytes: &[u8]) -> Option<Head> {
        let own: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
        let is_big_endian = u32::from_le_bytes(own) > 52;
        let of_bytes = if is_big_endian { u32::from_be_bytes } else { u32::from_le_bytes };
        let word = |k: usize| Some(of_bytes(bytes.get(4 * k..4 * k + 4)?.try_into().ok()?));
        let option = word(0)?;
        let (order, precision, kind) = (option / 1000, option / 10 % 10, option % 10);
        let is_known = option / 100 % 10 == 0 && precision <= 5 && kind <= 2;
        if !is_known || order != u32::from(is_big_endian) {
            return None;
        }
        let (is_complex, long) = (word(3)?, word(4)? as usize);
        let length = FIVE + long;
        if is_complex > 1 || !(2..=LONGEST).contains(&long) {
            return None;
        }
        let (end, name) = bytes.get(FIVE..length)?.split_last()?;
        let is_name = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
        if *end != 0 || !name.iter().all(is_name) {
            return None;
        }
        let sizes = (word(1)? as usize, word(2)? as usize);
        let (name, is_complex) = (String::from_utf8_lossy(name).into_owned(), is_complex == 1);
        Some(Head { is_big_endian, precision, kind, sizes, is_complex, name, length })
    }

    /// Bytes of a number.
    fn size(&self) -> usize {
        [8, 4, 4, 2, 2, 1][self.precision as usize]
    }

    /// One of its numbers.
    fn number(&self, bytes: &[u8]) -> f64 {
        let mut own = bytes.to_vec();
        if self.is_big_endian {
            own.reverse();
        }
        let bits = own.iter().rev().fold(0u64, |n, b| n << 8 | u64::from(*b));
        match self.precision {
            0 => f64::from_bits(bits),
            1 => f64::from(f32::from_bits(bits as u32)),
            2 => f64::from(bits as u32 as i32),
            3 => f64::from(bits as u16 as i16),
            _ => bits as f64,
        }
    }
}

/// Whether a file begins as these do.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    Head::read(bytes).is_some()
}

/// All matrices of a file.
pub(super) fn read(mut bytes: &[u8]) -> Result<Vec<Named>, String> {
    let mut found = vec![];
    while !bytes.is_empty() {
        let head = Head::read(bytes).ok_or("what follows a matrix of it is none")?;
        let (rows, columns) = head.sizes;
        let count = rows.checked_mul(columns);
        let each = head.size() * if head.is_complex { 2 } else { 1 };
        let end = count.and_then(|n| n.checked_mul(each)?.checked_add(head.length));
        let cut = || format!("{} is {rows} × {columns}, and the file ends within it", head.name);
        let own = end.and_then(|end| bytes.get(head.length..end)).ok_or_else(cut)?;
        let real = own.chunks_exact(head.size()).take(rows * columns);
        let values: Vec<f64> = real.map(|b| head.number(b)).collect();
        bytes = &bytes[head.length + own.len()..];
        match head.kind {
            1 => {}
            // a sparse one that is complex has a column more
            _ if head.is_complex || (head.kind == 2 && columns == 4) => {
                found.push(Named::refused(head.name, "is complex"));
            }
            0 => found.push(Named::new(head.name, Ok(by_columns(head.sizes, &values)))),
            _ => found.push(Named::new(head.name, by_lines(head.sizes, &values))),
        }
    }
    Ok(found)
}

/// A sparse matrix from rows of row, column, value.
fn by_lines((lines, width): Sizes, values: &[f64]) -> Result<Csr, String> {
    let whole = |x: f64| (x.fract() == 0.0 && (0.0..1e9).contains(&x)).then_some(x as usize);
    let line = |k: usize| -> Option<(usize, usize, f64)> {
        Some((whole(values[k])?, whole(values[lines + k])?, values[2 * lines + k]))
    };
    let all = || {
        let last = lines.checked_sub(1).filter(|_| width == 3)?;
        let (rows, columns, _) = line(last)?;
        // they count from one
        let from_zero =
            |(i, j, v): (usize, usize, f64)| Some((i.checked_sub(1)?, j.checked_sub(1)?, v));
        let entries = (0..last).map(|k| line(k).and_then(from_zero)).collect::<Option<Vec<_>>>()?;
        Some(sparse((rows, columns), entries))
    };
    all().ok_or("has lines that are no row, column and value")?
}
