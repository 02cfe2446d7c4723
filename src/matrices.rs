//! Matrices from files: those of [`crate::fem::formats`], or a dense HDF5 dataset (`FILE.h5:/path`, also of MATLAB v7.3 files).

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::fem::Csr;
use crate::fem::formats::{self, Written};
use crate::scenario::FileName;

/// Read a matrix; the message says what is wrong with the file.
pub(crate) fn read_matrix(folder: &Path, name: &str) -> Result<Csr, String> {
    read_written(folder, name).map(|written| written.matrix)
}

/// HDF5, which MATLAB puts a header of its own before.
fn is_hdf5(bytes: &[u8]) -> bool {
    const SIGN: &[u8] = b"\x89HDF\r\n\x1a\n";
    [0, 512].iter().any(|&at| bytes.get(at..).is_some_and(|b| b.starts_with(SIGN)))
}

/// Read a matrix that some program wrote, with what else its file says.
pub(crate) fn read_written(folder: &Path, name: &str) -> Result<Written, String> {
    let FileName { file, dataset } = FileName::parse(name);
    let path = folder.join(file);
    let fail = |e: std::io::Error| format!("{}: {e}", path.display());
    let mut start = vec![];
    std::fs::File::open(&path).and_then(|f| f.take(520).read_to_end(&mut start)).map_err(fail)?;
    if let Some(dataset) = dataset.filter(|_| is_hdf5(&start)) {
        let matrix = read_hdf5(&path, dataset)?;
        let entries = matrix.n_entries();
        let (one_triangle, names, held) = (false, vec![], vec![]);
        return Ok(Written { format: "HDF5", matrix, entries, one_triangle, names, held });
    }
    let bytes = std::fs::read(&path).map_err(fail)?;
    formats::read_matrix(&bytes, dataset).map_err(|e| format!("{}: {e}", path.display()))
}

/// Read a dense dataset. MATLAB writes its matrices column by column, which HDF5 shows transposed, and says so by an attribute.
fn read_hdf5(path: &Path, dataset: &str) -> Result<Csr, String> {
    let fail = |e: hdf5::Error| {
        let text = e.to_string();
        let first = text.lines().next().unwrap_or_default().to_owned();
        format!("{}:/{dataset}: {first}", path.display())
    };
    if !path.is_file() {
        return Err(format!("{}: no such file", path.display()));
    }
    let data = hdf5::File::open(path).and_then(|f| f.dataset(dataset)).map_err(fail)?;
    check_size(&data, size_of::<f64>()).map_err(fail)?;
    if data.size() == 0 {
        return Err(format!("{}:/{dataset}: is empty, {:?}", path.display(), data.shape()));
    }
    let a: ndarray::Array2<f64> = data.read_2d().map_err(fail)?;
    let a = if data.attr("MATLAB_class").is_ok() { a.reversed_axes() } else { a };
    if let Some(((i, j), v)) = a.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(format!(
            "{}:/{dataset}: entry ({i}, {j}), counted from 0, is {v}",
            path.display()
        ));
    }
    let (rows, columns) = a.dim();
    let entries = a.indexed_iter().filter(|(_, v)| **v != 0.0).map(|((i, j), v)| (i, j, *v));
    Ok(Csr::from_triplets(rows, columns, entries.collect()))
}

/// Refuse a dataset that claims more elements than its file can hold: sizes are not believed before the data are there.
pub(crate) fn check_size(data: &hdf5::Dataset, bytes: usize) -> Result<(), hdf5::Error> {
    /// The compression that HDF5 offers makes nothing smaller than this.
    const LEAST: usize = 1100;
    let wanted = data.shape().iter().try_fold(bytes, |n, &k| n.checked_mul(k));
    let file = std::fs::metadata(data.filename()).map_or(0, |m| m.len() as usize);
    match wanted {
        Some(n) if n <= file.saturating_mul(LEAST) => check_words(data, file),
        _ => {
            Err(format!("claims to be of size {:?}, in a file of {file} bytes", data.shape())
                .into())
        }
    }
}

/// The same for words of any length, which lie elsewhere in the file: HDF5 sets aside as much memory as the dataset says that they need before it looks there. A
/// word is four bytes of length and where it lies, sixteen in all.
fn check_words(data: &hdf5::Dataset, file: usize) -> Result<(), hdf5::Error> {
    use hdf5::types::TypeDescriptor::{VarLenAscii, VarLenUnicode};
    const WORD: usize = 16;
    let is_of_words = matches!(data.dtype()?.to_descriptor()?, VarLenAscii | VarLenUnicode);
    // only datasets in one piece say where they lie; this program writes no others of words
    let (true, Some(offset)) = (is_of_words, data.offset()) else { return Ok(()) };
    let failed = |e: std::io::Error| hdf5::Error::from(e.to_string());
    let mut opened = std::fs::File::open(data.filename()).map_err(failed)?;
    opened.seek(SeekFrom::Start(offset)).map_err(failed)?;
    // what is not yet on the disk was not read from there
    let mut words = vec![];
    opened.take((data.size() * WORD) as u64).read_to_end(&mut words).map_err(failed)?;
    let mut lengths =
        words.chunks_exact(WORD).map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]]));
    match lengths.find(|&length| length as usize > file) {
        None => Ok(()),
        Some(length) => {
            Err(format!("a word claims {length} bytes, in a file of {file} bytes").into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four bytes of a file that say 4 GB: refused before HDF5 asks for that memory.
    #[test]
    fn a_word_is_not_longer_than_its_file() {
        use hdf5::types::VarLenUnicode;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words.h5");
        let words: Vec<VarLenUnicode> = ["one", "", "three"].map(|w| w.parse().unwrap()).to_vec();
        let file = hdf5::File::create(&path).unwrap();
        file.new_dataset_builder().with_data(&words).create("words").unwrap();
        let offset = file.dataset("words").unwrap().offset().unwrap() as usize;
        file.close().unwrap();
        let check = || {
            let file = hdf5::File::open(&path).unwrap();
            check_size(&file.dataset("words").unwrap(), size_of::<VarLenUnicode>())
        };
        check().unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes[offset + 32..][..4], [5, 0, 0, 0]);
        bytes[offset + 35] = 0xff;
        std::fs::write(&path, bytes).unwrap();
        let said = check().unwrap_err().to_string();
        assert!(said.contains("a word claims"), "{said}");
    }

    /// Four thousand million rows of no column take no place in a file, and are given none in memory.
    #[test]
    fn a_matrix_of_no_entries_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("a.h5")).unwrap();
        file.new_dataset::<f64>().shape((4_000_000_000usize, 0)).create("K").unwrap();
        file.close().unwrap();
        let said = read_matrix(folder.path(), "a.h5:/K").unwrap_err();
        assert!(said.contains("is empty, [4000000000, 0]"), "{said}");
    }
}
