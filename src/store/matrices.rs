//! Arrays for other programs: HDF5 (`.h5`), MATLAB's files older than 7.3 (`.mat`), NumPy's `.npz`.

use std::path::Path;

use flate2::Crc;

use super::form::write_version;
use super::output::{MARK, replace_with};
use super::{StoreError, write_text};

/// An array of two dimensions, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name.
    pub name: &'static str,
    /// Rows and columns.
    pub shape: (usize, usize),
    /// One number a row: of one dimension where a format has such.
    pub is_list: bool,
    /// Row by row.
    pub values: Vec<f64>,
    /// What it is.
    pub about: &'static str,
}

/// Formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArrayFormat {
    /// HDF5.
    Hdf5,
    /// MATLAB 5.
    Matlab,
    /// NumPy.
    Npz,
}

impl ArrayFormat {
    /// By the ending of a file.
    pub fn of(path: &Path) -> Option<ArrayFormat> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "h5" | "hdf5" => Some(ArrayFormat::Hdf5),
            "mat" => Some(ArrayFormat::Matlab),
            "npz" => Some(ArrayFormat::Npz),
            _ => None,
        }
    }
}

/// Write arrays; the whole file or none.
pub fn write_arrays(
    path: &Path,
    format: ArrayFormat,
    arrays: &[Array],
    scene: &str,
) -> Result<(), StoreError> {
    if format == ArrayFormat::Hdf5 {
        return replace_with(path, |part| {
            hdf5(part, arrays, scene).map_err(|e| std::io::Error::other(e.to_string()))
        });
    }
    let bytes = if format == ArrayFormat::Matlab { matlab(arrays) } else { npz(arrays) };
    replace_with(path, |part| std::fs::write(part, bytes))
}

fn hdf5(path: &Path, arrays: &[Array], scene: &str) -> Result<(), StoreError> {
    let file = hdf5::File::create(path)?;
    write_version(&file)?;
    write_text(&file, "scene", scene)?;
    for a in arrays {
        let table = ndarray::ArrayView2::from_shape(a.shape, &a.values)
            .map_err(|e| hdf5::Error::from(e.to_string()))?;
        let dataset = match a.is_list {
            true => file.new_dataset_builder().with_data(&a.values).create(a.name)?,
            false => file.new_dataset_builder().with_data(&table).create(a.name)?,
        };
        write_text(&dataset, "description", a.about)?;
    }
    Ok(())
}

/// An element of a file of MATLAB: type, length, bytes, padded to eight.
fn element(kind: u32, bytes: &[u8], out: &mut Vec<u8>) {
    out.extend(kind.to_le_bytes());
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(bytes);
    out.resize(out.len().next_multiple_of(8), 0);
}

fn matlab(arrays: &[Array]) -> Vec<u8> {
    let mut out = format!("MATLAB 5.0 MAT-file {MARK}").into_bytes();
    out.resize(124, b' ');
    out.extend([0x00, 0x01, b'I', b'M']);
    for a in arrays {
        let (rows, columns) = a.shape;
        let mut own = vec![];
        let words = |x: &[u32]| x.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
        // doubles
        element(6, &words(&[6, 0]), &mut own);
        element(5, &words(&[rows as u32, columns as u32]), &mut own);
        element(1, a.name.as_bytes(), &mut own);
        let by_columns = (0..columns).flat_map(|j| (0..rows).map(move |i| columns * i + j));
        let values: Vec<u8> = by_columns.flat_map(|k| a.values[k].to_le_bytes()).collect();
        element(9, &values, &mut own);
        element(14, &own, &mut out);
    }
    out
}

/// A file of NumPy: a header that says what its bytes are, and these.
fn npy(kind: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // magic, version and length take ten bytes; the end of the header a line
    let padded = (header.len() + 11).next_multiple_of(64) - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((padded as u16).to_le_bytes());
    out.extend(format!("{header:<width$}\n", width = padded - 1).bytes());
    out.extend(bytes);
    out
}

fn npz(arrays: &[Array]) -> Vec<u8> {
    let mark = npy(&format!("|S{}", MARK.len()), "()", MARK.as_bytes());
    let mut files = vec![("about.npy".to_owned(), mark)];
    for a in arrays {
        let (rows, columns) = a.shape;
        let shape = match a.is_list {
            true => format!("({rows},)"),
            false => format!("({rows}, {columns})"),
        };
        let bytes: Vec<u8> = a.values.iter().flat_map(|v| v.to_le_bytes()).collect();
        files.push((format!("{}.npy", a.name), npy("<f8", &shape, &bytes)));
    }
    // stored as they are
    let (mut out, mut list) = (vec![], vec![]);
    for (name, bytes) in &files {
        let mut crc = Crc::new();
        crc.update(bytes);
        let mut of_file = vec![];
        // version, flags, method, time, date
        of_file.extend([20u16, 0, 0, 0, 0x21].iter().flat_map(|w| w.to_le_bytes()));
        let size = bytes.len() as u32;
        of_file.extend([crc.sum(), size, size].iter().flat_map(|w| w.to_le_bytes()));
        of_file.extend([name.len() as u16, 0].iter().flat_map(|w| w.to_le_bytes()));
        let offset = out.len() as u32;
        out.extend(b"PK\x03\x04");
        out.extend(&of_file);
        out.extend(name.bytes());
        out.extend(bytes);
        list.extend(b"PK\x01\x02");
        list.extend(20u16.to_le_bytes());
        list.extend(&of_file);
        // comment, disk, attributes
        list.extend([0u8; 10]);
        list.extend(offset.to_le_bytes());
        list.extend(name.bytes());
    }
    let (begin, count) = (out.len() as u32, files.len() as u16);
    out.extend(&list);
    out.extend(b"PK\x05\x06");
    out.extend([0u16, 0, count, count].iter().flat_map(|w| w.to_le_bytes()));
    out.extend([list.len() as u32, begin].iter().flat_map(|w| w.to_le_bytes()));
    out.extend(0u16.to_le_bytes());
    out
}
