//! Matrices from files: Matrix Market (`.mtx`, coordinate or array, real, general or symmetric), or a dense HDF5 dataset
//! (`FILE.h5:/path`, also of MATLAB v7.3 files).

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::Csr;
use crate::scenario::FileName;

/// Read a matrix; the message says what is wrong with the file.
pub fn read_matrix(folder: &Path, name: &str) -> Result<Csr, String> {
    let FileName { file, dataset } = FileName::parse(name);
    match dataset {
        Some(dataset) => read_hdf5(&folder.join(file), dataset),
        None => {
            let path = folder.join(file);
            let text =
                std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            parse_matrix_market(&text).map_err(|e| format!("{}: {e}", path.display()))
        }
    }
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
