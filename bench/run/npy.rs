//! Arrays of numbers in NumPy's file format: points in, cells out.
//!
//! The format: R. Kern and others, NEP 1, *A simple file format for NumPy arrays*,
//! <https://numpy.org/neps/nep-0001-npy-format.html>. Six bytes of magic, two of version, the length
//! of the header (two bytes in version 1, four in 2 and 3), the header (a Python dictionary with the
//! keys `descr`, `fortran_order` and `shape`), the numbers.
//!
//! An own reader because `npyz` 0.9 allocates what a header claims, multiplies its shape without a check, and
//! brings twenty crates, some with C sources, for a dictionary of three keys; `ndarray-npy` stands on the same
//! parser.
//!
//! Supported are two-dimensional arrays of little-endian f8 and f4, in C or Fortran order. Memory grows
//! with the numbers in the file, never with the size that its header claims.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use medial::write_atomically;

use super::npy_header::{Element, Header, HeaderError, header_length, parse_header};

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// The longest header that is read; NumPy's own are 64 to 128 bytes for plain arrays.
const MAX_HEADER: usize = 1 << 16;

/// Bytes that are decoded at a time, a multiple of the size of every element.
const BLOCK: usize = 1 << 16;

/// A two-dimensional array of f64.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    fortran_order: bool,
    values: Vec<f64>,
}

impl Matrix {
    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// An element.
    ///
    /// # Panics
    /// If there is no such row or column.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        assert!(row < self.rows && column < self.columns, "({row}, {column}) is outside the array");
        let index =
            if self.fortran_order { column * self.rows + row } else { row * self.columns + column };
        self.values[index]
    }
}

/// Why a file is not an array of numbers that can be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct NpyError {
    /// The file.
    pub path: PathBuf,
    /// The defect.
    #[source]
    pub kind: NpyErrorKind,
}

/// A defect of an `.npy` file.
#[derive(Debug, thiserror::Error)]
pub enum NpyErrorKind {
    /// The file cannot be opened or read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file does not begin as the format demands.
    #[error("not an .npy file: it does not begin with \\x93NUMPY; write it with numpy.save")]
    Magic,
    /// A version of the format from the future.
    #[error("version {0} of the .npy format; known are 1, 2 and 3")]
    Version(u8),
    /// The header is longer than that of any plain array.
    #[error("the header claims {0} bytes; that of a plain array has at most {MAX_HEADER}")]
    HeaderLength(usize),
    /// The header is not what the format demands, or describes what is not read.
    #[error(transparent)]
    Header(#[from] HeaderError),
    /// The array is not a list of rows.
    #[error("the array has the shape {0:?}; needed are two dimensions, a row for each point")]
    Dimensions(Vec<u64>),
    /// The shape's numbers are too large for any file.
    #[error("the header claims the shape {0:?}, more than any file can hold")]
    Overflow(Vec<u64>),
    /// The file ends before the numbers that its header announces.
    #[error("the file ends after {found} of the {announced} bytes that its header announces")]
    Truncated {
        /// Bytes of numbers announced by the header.
        announced: u64,
        /// Bytes there are, in whole elements.
        found: u64,
    },
    /// There is more in the file than the header announces.
    #[error("the file goes on after the {announced} bytes that its header announces")]
    Surplus {
        /// Bytes of numbers announced by the header.
        announced: u64,
    },
}

/// Reads a two-dimensional array of f8 or f4.
///
/// # Errors
/// When the file cannot be read, is no `.npy` file, holds elements of another type or another
/// number of dimensions, or more or fewer numbers than its header announces.
pub fn read_matrix(path: &Path) -> Result<Matrix, NpyError> {
    let named = |kind| NpyError { path: path.to_owned(), kind };
    let file = File::open(path).map_err(|error| named(error.into()))?;
    parse_matrix(BufReader::with_capacity(BLOCK, file)).map_err(named)
}

/// [`read_matrix`] of bytes from anywhere.
///
/// # Errors
/// As [`read_matrix`], without the file's name.
pub fn parse_matrix(mut input: impl Read) -> Result<Matrix, NpyErrorKind> {
    let Header { element, fortran_order, shape } = read_header(&mut input)?;
    let [rows, columns] = shape[..] else { return Err(NpyErrorKind::Dimensions(shape)) };
    let announced = rows.checked_mul(columns).and_then(|n| n.checked_mul(element.size() as u64));
    let (Some(announced), Ok(rows), Ok(columns)) = (announced, rows.try_into(), columns.try_into())
    else {
        return Err(NpyErrorKind::Overflow(shape));
    };
    let values = read_values(&mut input, element, announced)?;
    if input.read(&mut [0])? > 0 {
        return Err(NpyErrorKind::Surplus { announced });
    }
    Ok(Matrix { rows, columns, fortran_order, values })
}

fn read_header(input: &mut impl Read) -> Result<Header, NpyErrorKind> {
    let mut start = [0; 8];
    read_exactly(input, &mut start, NpyErrorKind::Magic)?;
    if start[..6] != *MAGIC {
        return Err(NpyErrorKind::Magic);
    }
    let width = match start[6] {
        1 => 2,
        2 | 3 => 4,
        version => return Err(NpyErrorKind::Version(version)),
    };
    let mut length = [0; 4];
    read_exactly(input, &mut length[..width], HeaderError::Incomplete.into())?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_HEADER {
        return Err(NpyErrorKind::HeaderLength(length));
    }
    let mut text = vec![0; length];
    read_exactly(input, &mut text, HeaderError::Incomplete.into())?;
    Ok(parse_header(&text)?)
}

/// Fills the buffer; `short` is the error if the input ends before.
fn read_exactly(
    input: &mut impl Read,
    buffer: &mut [u8],
    short: NpyErrorKind,
) -> Result<(), NpyErrorKind> {
    match input.read_exact(buffer) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(short),
        other => Ok(other?),
    }
}

fn read_values(
    input: &mut impl Read,
    element: Element,
    announced: u64,
) -> Result<Vec<f64>, NpyErrorKind> {
    let mut values = Vec::new();
    let mut block = Vec::with_capacity(BLOCK);
    let mut found = 0;
    while found < announced {
        block.clear();
        input.by_ref().take((announced - found).min(BLOCK as u64)).read_to_end(&mut block)?;
        let whole = block.len() - block.len() % element.size();
        element.decode(&block[..whole], &mut values);
        found += whole as u64;
        if whole == 0 || whole < block.len() {
            return Err(NpyErrorKind::Truncated { announced, found });
        }
    }
    Ok(values)
}

/// Writes all of an array's file that comes before its numbers, which are little-endian, of the kind
/// `descr` and in C order.
///
/// # Errors
/// Those of `out`.
pub fn write_npy_header(
    out: &mut dyn Write,
    descr: &str,
    [rows, columns]: [usize; 2],
) -> io::Result<()> {
    let dictionary =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    out.write_all(MAGIC)?;
    out.write_all(&[1, 0])?;
    // The numbers begin at a multiple of 64 bytes, as the format asks.
    let padded = header_length(dictionary.len());
    out.write_all(&(padded as u16).to_le_bytes())?;
    writeln!(out, "{dictionary:<width$}", width = padded - 1)
}

/// Writes rows of four vertices as an array of uint32 in C order.
///
/// The file is written under a temporary name and renamed.
///
/// # Errors
/// When the file cannot be written.
pub fn write_cells(
    path: &Path,
    cells: impl ExactSizeIterator<Item = [u32; 4]>,
) -> Result<(), NpyError> {
    let length = cells.len();
    let written = write_atomically(path, |out| {
        write_npy_header(out, "<u4", [length, 4])?;
        for cell in cells {
            let mut bytes = [0; 16];
            for (place, vertex) in bytes.chunks_exact_mut(4).zip(cell) {
                place.copy_from_slice(&vertex.to_le_bytes());
            }
            out.write_all(&bytes)?;
        }
        Ok(())
    });
    written.map_err(|error| NpyError { path: path.to_owned(), kind: error.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn numbers(range: std::ops::Range<u8>) -> Vec<u8> {
        range.flat_map(|x| f64::from(x).to_le_bytes()).collect()
    }

    const SIX: &str = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";

    #[test]
    fn all_versions_orders_and_types() {
        let rows = |m: &Matrix| (0..2).map(|r| [0, 1, 2].map(|c| m.at(r, c))).collect::<Vec<_>>();
        for version in 1..=3 {
            let matrix = parse_matrix(&file(version, SIX, &numbers(0..6))[..]).expect("an array");
            assert_eq!(rows(&matrix), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
            let fortran = SIX.replace("False", "True");
            let matrix = parse_matrix(&file(version, &fortran, &numbers(0..6))[..]).expect("it");
            assert_eq!(rows(&matrix), [[0.0, 2.0, 4.0], [1.0, 3.0, 5.0]]);
            let single: Vec<u8> = (0..6u8).flat_map(|x| f32::from(x).to_le_bytes()).collect();
            let header = SIX.replace("f8", "f4");
            let matrix = parse_matrix(&file(version, &header, &single)[..]).expect("an array");
            assert_eq!(rows(&matrix), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        }
    }

    #[test]
    fn lies_about_sizes_are_found_without_believing_them() {
        let error = |header: &str, data: &[u8]| {
            parse_matrix(&file(1, header, data)[..]).expect_err("a lie").to_string()
        };
        let six = numbers(0..6);
        assert!(error(SIX, &six[..47]).contains("after 40 of the 48 bytes"));
        assert!(error(SIX, &[]).contains("after 0 of the 48 bytes"));
        assert!(error(SIX, &numbers(0..7)).contains("goes on after the 48 bytes"));
        let shaped = |shape: &str| SIX.replace("(2, 3)", shape);
        let huge = error(&shaped("(1000000000000, 3)"), &six);
        assert!(huge.contains("after 48 of the 24000000000000 bytes"), "{huge}");
        let beyond = error(&shaped("(9000000000000000000, 9)"), &six);
        assert!(beyond.contains("more than any file"), "{beyond}");
        assert!(error(&shaped("(6,)"), &six).contains("[6]"));
        assert!(error(&shaped("()"), &six).contains("two dimensions"));
        let long = [&MAGIC[..], &[2, 0, 255, 255, 255, 255]].concat();
        let long = parse_matrix(&long[..]).expect_err("no header").to_string();
        assert!(long.contains("4294967295 bytes"), "{long}");
    }

    #[test]
    fn what_is_no_such_file_is_refused() {
        let error = |bytes: &[u8]| parse_matrix(bytes).expect_err("refused").to_string();
        assert!(error(b"").contains("not an .npy file"));
        assert!(error(b"OFF\n8 12 0\n0 0 0\n").contains("not an .npy file"));
        assert!(error(&file(4, SIX, &[])).contains("version 4"));
        assert!(error(&file(1, SIX, &[])[..40]).contains("incomplete"));
        assert!(error(&file(1, SIX, &[])[..9]).contains("incomplete"));
    }
}
