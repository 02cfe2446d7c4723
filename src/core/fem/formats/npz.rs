//! Arrays of NumPy in a zip: SciPy's sparse matrices (`scipy.sparse.save_npz`), or full matrices by their names (`numpy.savez`).

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

use flate2::read::DeflateDecoder;

use super::{Named, Written, by_columns, whole};

/// What an array may come to, unpacked, over the size of its file: compression makes nothing smaller.
const LARGEST: usize = 1100;

/// The numbers of an array, or a word.
enum Array {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Word(String),
}

fn number(bytes: &[u8], at: usize, size: usize) -> Option<u64> {
    let own = bytes.get(at..at.checked_add(size)?)?;
    Some(own.iter().rev().fold(0, |n, b| n << 8 | u64::from(*b)))
}

/// The file by which SciPy says how it keeps a sparse matrix.
const FORMAT: &str = "format.npy";

/// Whether a file is a zip, and none of SciPy's sparse matrices, by the names of its files.
pub(super) fn is_of_arrays(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") && files(bytes).is_ok_and(|all| !all.contains_key(FORMAT))
}

/// A file of a zip.
struct Packed<'b> {
    method: u64,
    /// Bytes unpacked.
    size: usize,
    data: &'b [u8],
}

/// The files of a zip by the list at its end.
fn files(bytes: &[u8]) -> Result<BTreeMap<String, Packed<'_>>, String> {
    let damaged = || "its zip is damaged".to_owned();
    let end = bytes.windows(4).rposition(|w| w == b"PK\x05\x06").ok_or_else(damaged)?;
    let count = number(bytes, end + 10, 2).ok_or_else(damaged)?;
    let mut at = number(bytes, end + 16, 4).ok_or_else(damaged)? as usize;
    let mut all = BTreeMap::new();
    for _ in 0..count {
        let get = |offset: usize, size: usize| number(bytes, at + offset, size).ok_or_else(damaged);
        let (method, packed, size) = (get(10, 2)?, get(20, 4)? as usize, get(24, 4)? as usize);
        let [name, extra, comment] =
            [get(28, 2)? as usize, get(30, 2)? as usize, get(32, 2)? as usize];
        let local = get(42, 4)? as usize;
        let called = bytes.get(at + 46..at + 46 + name).ok_or_else(damaged)?;
        let called = String::from_utf8_lossy(called).into_owned();
        let of_local = |offset: usize| number(bytes, local + offset, 2).ok_or_else(damaged);
        let begin = local + 30 + of_local(26)? as usize + of_local(28)? as usize;
        if packed == u32::MAX as usize || size > bytes.len().saturating_mul(LARGEST) {
            return Err("is larger than 4 GB, or claims to be".into());
        }
        let data = bytes.get(begin..begin.saturating_add(packed)).ok_or_else(damaged)?;
        all.insert(called, Packed { method, size, data });
        at += 46 + name + extra + comment;
    }
    Ok(all)
}

/// The bytes of a file of a zip.
fn unpacked(name: &str, file: &Packed) -> Result<Vec<u8>, String> {
    let damaged = || "its zip is damaged".to_owned();
    let data = match file.method {
        0 => file.data.to_vec(),
        8 => {
            let mut out = vec![];
            let mut unpacked = DeflateDecoder::new(file.data).take(file.size as u64 + 1);
            unpacked.read_to_end(&mut out).map_err(|_| damaged())?;
            out
        }
        method => {
            return Err(format!("{name} is packed by a method (number {method}) that is not read"));
        }
    };
    if data.len() == file.size { Ok(data) } else { Err(damaged()) }
}

/// The words at the beginning of an array of NumPy, and its bytes.
fn taken_apart<'b>(name: &str, bytes: &'b [u8]) -> Result<(Cow<'b, str>, &'b [u8]), String> {
    let fail = |what: &str| Err(format!("{name}: {what}"));
    if !bytes.starts_with(b"\x93NUMPY") {
        return fail("is no array of NumPy");
    }
    let (size, begin): (_, usize) = match bytes.get(6) {
        Some(1) => (number(bytes, 8, 2), 10),
        Some(2 | 3) => (number(bytes, 8, 4), 12),
        _ => return fail("is of an unknown version"),
    };
    let Some(head) = size.and_then(|s| bytes.get(begin..begin.checked_add(s as usize)?)) else {
        return fail("ends within its head");
    };
    Ok((String::from_utf8_lossy(head), &bytes[begin + head.len()..]))
}

/// What stands behind a key of such words.
fn after<'h>(head: &'h str, key: &str) -> &'h str {
    let rest = head.split(key).nth(1).unwrap_or_default();
    rest.trim_start_matches([':', ' ', '\'', '"'])
}

/// The numbers of an array of NumPy.
fn array(name: &str, bytes: &[u8]) -> Result<Array, String> {
    let fail = |what: &str| Err(format!("{name}: {what}"));
    let (head, data) = taken_apart(name, bytes)?;
    let kind: String = after(&head, "'descr'").chars().take_while(|c| *c != '\'').collect();
    let items = |size: usize| data.chunks_exact(size);
    let signed = |b: &[u8]| -> i64 {
        let unused = 64 - 8 * b.len() as u32;
        ((number(b, 0, b.len()).unwrap_or(0) << unused) as i64) >> unused
    };
    Ok(match kind.as_str() {
        "<f8" => {
            Array::Real(items(8).map(|b| f64::from_bits(number(b, 0, 8).unwrap_or(0))).collect())
        }
        "<f4" => Array::Real(
            items(4)
                .map(|b| f64::from(f32::from_bits(number(b, 0, 4).unwrap_or(0) as u32)))
                .collect(),
        ),
        "<i4" => Array::Whole(items(4).map(signed).collect()),
        "<i8" => Array::Whole(items(8).map(signed).collect()),
        "|b1" | "|i1" => Array::Whole(items(1).map(signed).collect()),
        word if word.starts_with("|S") => {
            Array::Word(String::from_utf8_lossy(data).trim_end_matches('\0').to_owned())
        }
        word if word.starts_with("<U") => {
            let letters = items(4).filter_map(|b| char::from_u32(number(b, 0, 4)? as u32));
            Array::Word(letters.filter(|c| *c != '\0').collect())
        }
        word if word.contains('O') => {
            return fail(
                "holds objects of Python, which are not read; save a sparse matrix of numbers",
            );
        }
        word if word.contains('c') => return fail("is complex; save its real part"),
        word if word.starts_with('>') => {
            return fail("has its bytes in the order of another machine; save it anew");
        }
        other => return fail(&format!("has numbers of type \"{other}\", which are not read")),
    })
}

/// The arrays of a file, each a matrix, one of a single dimension a column.
pub(super) fn read_arrays(bytes: &[u8]) -> Result<Vec<Named>, String> {
    let mut found = vec![];
    for (file, packed) in files(bytes)? {
        let name = file.strip_suffix(".npy").unwrap_or(&file).to_owned();
        let own = unpacked(&file, &packed)?;
        let (head, _) = taken_apart(&file, &own)?;
        let sizes = after(&head, "'shape'").trim_start_matches('(').split(')').next();
        let sizes = sizes.unwrap_or_default().split(',').map(str::trim).filter(|w| !w.is_empty());
        let sizes: Option<Vec<usize>> = sizes.map(|w| w.parse().ok()).collect();
        let (rows, columns) = match sizes.as_deref() {
            Some([rows]) => (*rows, 1),
            Some([rows, columns]) => (*rows, *columns),
            // numbers, and arrays of more dimensions
            _ => continue,
        };
        let values = match array(&file, &own) {
            Ok(Array::Real(values)) => values,
            Ok(Array::Whole(values)) => values.into_iter().map(|v| v as f64).collect(),
            Ok(Array::Word(_)) => continue,
            Err(why) => {
                let why = why.strip_prefix(&format!("{file}: ")).unwrap_or(&why).to_owned();
                found.push(Named::new(name, Err(why)));
                continue;
            }
        };
        if rows.checked_mul(columns) != Some(values.len()) {
            found.push(Named::refused(name, "has another number of entries than its sizes say"));
            continue;
        }
        let matrix = match after(&head, "'fortran_order'").starts_with("True") {
            true => by_columns((rows, columns), &values),
            false => by_columns((columns, rows), &values).transposed(),
        };
        found.push(Named::new(name, Ok(matrix)));
    }
    Ok(found)
}

/// A sparse matrix of SciPy.
pub(super) fn read(bytes: &[u8]) -> Result<Written, String> {
    let files = files(bytes)?;
    let get = |name: &str| -> Result<Array, String> {
        let file = format!("{name}.npy");
        let missing = || format!("has no {file}: save it with scipy.sparse.save_npz");
        array(&file, &unpacked(&file, files.get(&file).ok_or_else(missing)?)?)
    };
    let whole_numbers = |name: &str| match get(name)? {
        Array::Whole(list) => {
            let index = |i: i64| usize::try_from(i).map_err(|_| format!("{name}.npy: {i}"));
            list.into_iter().map(index).collect::<Result<Vec<usize>, String>>()
        }
        _ => Err(format!("{name}.npy: no whole numbers")),
    };
    let Array::Word(format) = get("format")? else { return Err("format.npy: is no word".into()) };
    let data = match get("data")? {
        Array::Real(list) => list,
        Array::Whole(list) => list.into_iter().map(|i| i as f64).collect(),
        Array::Word(_) => return Err("data.npy: words".into()),
    };
    let shape = whole_numbers("shape")?;
    let [rows, columns] = shape[..] else { return Err("shape.npy: no two numbers".into()) };
    if rows != columns || rows > 1_000_000 + data.len() {
        return Err(format!("is {rows} × {columns} with {} entries", data.len()));
    }
    let entries: Vec<(usize, usize, f64)> = match format.as_str() {
        "coo" => {
            let (i, j) = (whole_numbers("row")?, whole_numbers("col")?);
            if i.len() != data.len() || j.len() != data.len() {
                return Err("row, col and data are of different lengths".into());
            }
            // repeated entries add
            let all = i.into_iter().zip(j).zip(data).map(|((i, j), v)| (i, j, v)).collect();
            return finish(rows, all);
        }
        "csr" | "csc" => {
            let (first, other) = (whole_numbers("indptr")?, whole_numbers("indices")?);
            let fits = first.len() == rows + 1
                && first.windows(2).all(|w| w[0] <= w[1])
                && first.last() == Some(&data.len())
                && other.len() == data.len();
            if !fits {
                return Err("indptr, indices and data do not fit together".into());
            }
            let of = |k: usize| (first[k]..first[k + 1]).map(move |p| (k, p));
            let pairs = (0..rows).flat_map(of).map(|(k, p)| (k, other[p], data[p]));
            match format.as_str() {
                "csr" => pairs.collect(),
                _ => pairs.map(|(k, i, v)| (i, k, v)).collect(),
            }
        }
        other => return Err(format!("is of format \"{other}\": save it as csr, csc or coo")),
    };
    finish(rows, entries)
}

fn finish(n: usize, entries: Vec<(usize, usize, f64)>) -> Result<Written, String> {
    if let Some((i, j, v)) = entries.iter().find(|(i, j, v)| *i >= n || *j >= n || !v.is_finite()) {
        return Err(format!("entry ({i}, {j}) is {v}, of {n} rows"));
    }
    let count = entries.len();
    let sum = crate::fem::Csr::from_triplets(n, n, entries);
    let (matrix, one_triangle) = whole(n, sum.triplets().collect(), false)?;
    let format = "SciPy npz";
    Ok(Written { format, matrix, entries: count, one_triangle, names: vec![], held: vec![] })
}
