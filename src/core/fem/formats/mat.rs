//! MATLAB's files older than 7.3 (version 5): elements of a type and a length, padded to eight bytes, each perhaps packed.
//!
//! A matrix is an element of elements: flags and class, sizes, name, then its numbers, of a sparse one rows and first entries of columns before. Numbers may be
//! kept in any smaller type. Members of structs are found by their paths, `model/K`.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::{Named, Sparse, by_columns, from_columns};

/// What an element may come to, unpacked, over its size: compression makes nothing smaller.
const LARGEST: u64 = 1100;

/// Structs within structs that are looked into.
const DEEPEST: usize = 8;

const MATRIX: u32 = 14;
const PACKED: u32 = 15;

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

/// The elements one after the other: type and bytes.
struct Elements<'b>(&'b [u8]);

impl<'b> Iterator for Elements<'b> {
    type Item = Result<(u32, &'b [u8]), String>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.len() < 8 {
            return None;
        }
        let damaged = || Some(Err("an element ends behind the file".to_owned()));
        let (Some(kind), Some(size)) = (word(self.0, 0), word(self.0, 4)) else { return damaged() };
        // four bytes or fewer stand in the tag
        let (kind, begin, size): (u32, usize, usize) = match kind >> 16 {
            0 => (kind, 8, size as usize),
            small => (kind & 0xffff, 4, small as usize),
        };
        let Some(own) = begin.checked_add(size).and_then(|end| self.0.get(begin..end)) else {
            self.0 = &[];
            return damaged();
        };
        let padded = if kind == PACKED { begin + size } else { (begin + size).next_multiple_of(8) };
        self.0 = &self.0[padded.min(self.0.len())..];
        Some(Ok((kind, own)))
    }
}

/// Numbers of any type.
fn numbers((kind, bytes): (u32, &[u8])) -> Result<Vec<f64>, String> {
    macro_rules! all {
        ($t:ty) => {
            bytes
                .chunks_exact(size_of::<$t>())
                .filter_map(|b| Some(<$t>::from_le_bytes(b.try_into().ok()?) as f64))
                .collect()
        };
    }
    Ok(match kind {
        1 => all!(i8),
        2 => all!(u8),
        3 => all!(i16),
        4 => all!(u16),
        5 => all!(i32),
        6 => all!(u32),
        7 => all!(f32),
        9 => all!(f64),
        12 => all!(i64),
        13 => all!(u64),
        _ => return Err(format!("numbers of a type ({kind}) that is not read")),
    })
}

/// All matrices of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Named>, String> {
    if bytes.get(126..128) != Some(b"IM") {
        return Err(
            "is a MATLAB file of a machine with the other order of bytes: save it anew".into()
        );
    }
    let mut found = vec![];
    for element in Elements(&bytes[128..]) {
        match element? {
            (PACKED, own) => {
                let mut out = vec![];
                let most = LARGEST * own.len() as u64;
                let mut unpacked = ZlibDecoder::new(own).take(most + 1);
                unpacked.read_to_end(&mut out).map_err(|_| "its compression is damaged")?;
                for inner in Elements(&out) {
                    if let (MATRIX, own) = inner? {
                        array(own, "", 0, &mut found)?;
                    }
                }
            }
            (MATRIX, own) => array(own, "", 0, &mut found)?,
            _ => {}
        }
    }
    Ok(found)
}

/// Take the matrix that an element holds, or those of a struct.
fn array(bytes: &[u8], parent: &str, depth: usize, found: &mut Vec<Named>) -> Result<(), String> {
    let mut parts = Elements(bytes);
    let short = || "a matrix of it is cut off".to_owned();
    let mut next = || parts.next().ok_or_else(short)?;
    let flags = word(next()?.1, 0).ok_or_else(short)?;
    let sizes: Vec<usize> = numbers(next()?)?.into_iter().map(|x| x as usize).collect();
    let own = String::from_utf8_lossy(next()?.1).into_owned();
    let name = [parent, &own].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join("/");
    let (class, is_complex) = (flags & 0xff, flags & 0x0800 != 0);
    let [rows, columns] = sizes[..] else { return Ok(()) };
    match class {
        2 if depth < DEEPEST && rows * columns == 1 => {
            let width = numbers(next()?)?.first().copied().unwrap_or(0.0) as usize;
            let names = next()?.1;
            for member in names.chunks_exact(width.max(1)) {
                let end = member.iter().position(|b| *b == 0).unwrap_or(member.len());
                let member = String::from_utf8_lossy(&member[..end]).into_owned();
                let path = if name.is_empty() { member } else { format!("{name}/{member}") };
                if let (MATRIX, own) = next()? {
                    array(own, &path, depth + 1, found)?;
                }
            }
            Ok(())
        }
        5..=15 => {
            let whole = |x: Vec<f64>| x.into_iter().map(|x| x as usize).collect::<Vec<_>>();
            let sparse = match class {
                5 => Some((whole(numbers(next()?)?), whole(numbers(next()?)?))),
                _ => None,
            };
            let values = numbers(next()?)?;
            let mut imaginary = || numbers(next().ok()?).ok();
            if is_complex && imaginary().is_some_and(|x| x.iter().any(|x| *x != 0.0)) {
                found.push(Named::refused(name, "is complex"));
                return Ok(());
            }
            let sizes = (rows, columns);
            let matrix = match sparse {
                Some((rows, starts)) => {
                    from_columns(&Sparse { sizes, starts: &starts, rows: &rows, values: &values })
                }
                None if rows.checked_mul(columns) != Some(values.len()) => {
                    Err("has another number of entries than its sizes say".into())
                }
                None => Ok(by_columns(sizes, &values)),
            };
            found.push(Named::new(name, matrix));
            Ok(())
        }
        // words, cells, structs of several
        _ => Ok(()),
    }
}
