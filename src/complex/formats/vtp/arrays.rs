//! Decodes the arrays of a VTK XML file.
//!
//! Bytes stand behind a header of one word, their number; compressed ones behind one of three words and more: the
//! number of blocks, the length of a block and of the last one (0: as the others) once they are inflated, and the
//! length of each as it stands in the file. In base64 the header of compressed data is encoded apart, that of others
//! together with them.

use std::io::Read;

use base64::prelude::{BASE64_STANDARD, Engine};
use flate2::read::ZlibDecoder;

use super::VtpError;

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coding {
    pub is_big_endian: bool,
    /// Bytes of a word of headers.
    pub header: usize,
    pub is_compressed: bool,
}

/// An array as it stands in the file.
#[derive(Clone, Debug)]
pub(super) struct DataArray<'a> {
    /// Section and name, for errors.
    label: String,
    kind: String,
    components: u64,
    format: String,
    offset: Option<u64>,
    text: &'a [u8],
}

impl<'a> DataArray<'a> {
    pub fn new(
        label: String,
        kind: &str,
        components: u64,
        format: &str,
        offset: Option<u64>,
        text: &'a [u8],
    ) -> Self {
        let (kind, format) = (kind.to_owned(), format.to_owned());
        Self { label, kind, components, format, offset, text: text.trim_ascii() }
    }

    fn error(&self, why: impl Into<String>) -> VtpError {
        VtpError::Array { array: self.label.clone(), why: why.into() }
    }
}

/// Types of numbers.
#[derive(Clone, Copy)]
enum Scalar {
    Float(usize),
    Signed(usize),
    Unsigned(usize),
}

impl Scalar {
    fn of(array: &DataArray<'_>) -> Result<Self, VtpError> {
        Ok(match array.kind.as_str() {
            "Float32" => Self::Float(4),
            "Float64" => Self::Float(8),
            "Int8" => Self::Signed(1),
            "Int16" => Self::Signed(2),
            "Int32" => Self::Signed(4),
            "Int64" => Self::Signed(8),
            "UInt8" => Self::Unsigned(1),
            "UInt16" => Self::Unsigned(2),
            "UInt32" => Self::Unsigned(4),
            "UInt64" => Self::Unsigned(8),
            _ => return Err(array.error("its type is none of Int8 to UInt64, Float32 and Float64")),
        })
    }

    fn size(self) -> usize {
        let (Self::Float(size) | Self::Signed(size) | Self::Unsigned(size)) = self;
        size
    }
}

/// Bytes that inflated arrays may have in any file, and for each byte of it.
const FREE_BYTES: u64 = 64 << 20;
const INFLATION: u64 = 100;

pub(super) struct Decoder<'a> {
    coding: Coding,
    appended: Option<(&'a [u8], bool)>,
    most: u64,
    inflated: u64,
}

impl<'a> Decoder<'a> {
    /// A decoder for a file of `size` bytes.
    pub fn new(coding: Coding, appended: Option<(&'a [u8], bool)>, size: usize) -> Self {
        let most = FREE_BYTES + INFLATION * size as u64;
        Self { coding, appended, most, inflated: 0 }
    }

    /// An array of `count` elements of `components` numbers.
    pub fn floats(
        &mut self,
        array: &DataArray<'_>,
        count: u64,
        components: u64,
    ) -> Result<Vec<f64>, VtpError> {
        if array.components.max(1) != components {
            let found = array.components;
            return Err(array.error(format!("it has {found} components instead of {components}")));
        }
        let numbers = count.saturating_mul(components);
        let scalar = Scalar::of(array)?;
        if array.format == "ascii" {
            return words(array, numbers, |word| word.parse().ok());
        }
        let bytes = self.bytes(array, numbers.saturating_mul(scalar.size() as u64))?;
        let number = |bytes: &[u8]| match scalar {
            Scalar::Float(4) => f64::from(f32::from_bits(self.unsigned(bytes) as u32)),
            Scalar::Float(_) => f64::from_bits(self.unsigned(bytes)),
            Scalar::Signed(_) => self.signed(bytes) as f64,
            Scalar::Unsigned(_) => self.unsigned(bytes) as f64,
        };
        Ok(bytes.chunks_exact(scalar.size()).map(number).collect())
    }

    /// An array of `count` whole numbers that are not negative.
    pub fn indices(&mut self, array: &DataArray<'_>, count: u64) -> Result<Vec<u64>, VtpError> {
        let scalar = Scalar::of(array)?;
        if let Scalar::Float(_) = scalar {
            return Err(array.error("its numbers are not whole"));
        }
        if array.format == "ascii" {
            return words(array, count, |word| word.parse().ok());
        }
        let bytes = self.bytes(array, count.saturating_mul(scalar.size() as u64))?;
        let number = |bytes: &[u8]| match scalar {
            Scalar::Signed(_) => u64::try_from(self.signed(bytes))
                .map_err(|_| array.error(format!("{} is negative", self.signed(bytes)))),
            _ => Ok(self.unsigned(bytes)),
        };
        bytes.chunks_exact(scalar.size()).map(number).collect()
    }

    /// The bytes of an array that is not text; as many as expected.
    fn bytes(&mut self, array: &DataArray<'_>, expected: u64) -> Result<Vec<u8>, VtpError> {
        let (data, is_base64) = match (array.format.as_str(), self.appended) {
            ("binary", _) => (array.text, true),
            ("appended", Some((data, is_base64))) => {
                let offset = array.offset.and_then(|offset| usize::try_from(offset).ok());
                let rest = offset.and_then(|offset| data.get(offset..));
                (
                    rest.ok_or_else(|| array.error("its offset is not in the appended data"))?,
                    is_base64,
                )
            }
            ("appended", None) => return Err(VtpError::Missing("AppendedData")),
            _ => return Err(array.error("its format is none of ascii, binary and appended")),
        };
        let source = Source { data, is_base64, array };
        if self.coding.is_compressed {
            let bytes = self.inflated(&source, expected)?;
            // A header of no block that still names a last one adds up, and holds nothing.
            let found = bytes.len() as u64;
            return match found == expected {
                true => Ok(bytes),
                false => Err(VtpError::Length { array: array.label.clone(), expected, found }),
            };
        }
        let word = self.coding.header;
        let length = self.unsigned(&source.take(0, word)?);
        if length != expected {
            return Err(VtpError::Length { array: array.label.clone(), expected, found: length });
        }
        // What does not fit into memory is not in the file either.
        let length = usize::try_from(length).map_err(|_| source.cut_off())?;
        let all = source.take(0, word.checked_add(length).ok_or_else(|| source.cut_off())?)?;
        Ok(all[word..].to_vec())
    }

    fn inflated(&mut self, source: &Source<'_>, expected: u64) -> Result<Vec<u8>, VtpError> {
        let word = self.coding.header;
        let header = source.take(0, 3 * word)?;
        let [blocks, size, last] = [0, 1, 2].map(|k| self.unsigned(&header[k * word..][..word]));
        let all = blocks.saturating_mul(size);
        let length = if last == 0 { all } else { all.saturating_sub(size).saturating_add(last) };
        if length != expected {
            let array = source.array.label.clone();
            return Err(VtpError::Length { array, expected, found: length });
        }
        self.inflated = self.inflated.saturating_add(length);
        if self.inflated > self.most {
            return Err(VtpError::Inflated { bytes: self.inflated, most: self.most });
        }
        let header_length = usize::try_from(blocks)
            .ok()
            .and_then(|blocks| blocks.checked_add(3)?.checked_mul(word))
            .ok_or_else(|| source.cut_off())?;
        let header = source.take(0, header_length)?;
        let lengths: Vec<u64> =
            header[3 * word..].chunks_exact(word).map(|bytes| self.unsigned(bytes)).collect();
        let compressed = lengths.iter().try_fold(0_u64, |sum, &length| sum.checked_add(length));
        let compressed = compressed.and_then(|length| usize::try_from(length).ok());
        let behind = source.encoded(header_length);
        let data = source.take(behind, compressed.ok_or_else(|| source.cut_off())?)?;
        let mut bytes = Vec::new();
        let mut at = 0;
        for (block, &length) in lengths.iter().enumerate() {
            let wanted = if block + 1 == lengths.len() && last > 0 { last } else { size };
            // Sums of lengths were checked against the data.
            let end = at + length as usize;
            let before = bytes.len() as u64;
            // One more than announced, to see that there is none.
            let mut inflating = ZlibDecoder::new(&data[at..end]).take(wanted.saturating_add(1));
            let read = inflating.read_to_end(&mut bytes);
            if read.is_err() || bytes.len() as u64 - before != wanted {
                return Err(source.array.error(format!("block {block} cannot be inflated")));
            }
            at = end;
        }
        Ok(bytes)
    }

    fn unsigned(&self, bytes: &[u8]) -> u64 {
        let join = |sum: u64, &byte: &u8| sum << 8 | u64::from(byte);
        match self.coding.is_big_endian {
            true => bytes.iter().fold(0, join),
            false => bytes.iter().rev().fold(0, join),
        }
    }

    fn signed(&self, bytes: &[u8]) -> i64 {
        let unused = 64 - 8 * bytes.len() as u32;
        // Shifted up and back, the sign fills what is above.
        ((self.unsigned(bytes) << unused) as i64) >> unused
    }
}

/// Bytes of an array, plain or in base64.
struct Source<'a> {
    data: &'a [u8],
    is_base64: bool,
    array: &'a DataArray<'a>,
}

impl Source<'_> {
    /// Bytes that so many take when they are encoded.
    fn encoded(&self, count: usize) -> usize {
        if self.is_base64 { count.div_ceil(3).saturating_mul(4) } else { count }
    }

    /// `count` bytes, decoded from a place in what stands in the file.
    fn take(&self, from: usize, count: usize) -> Result<Vec<u8>, VtpError> {
        let end = from.checked_add(self.encoded(count)).ok_or_else(|| self.cut_off())?;
        let data = self.data.get(from..end).ok_or_else(|| self.cut_off())?;
        if !self.is_base64 {
            return Ok(data.to_vec());
        }
        // What is asked for may end within a longer text: whole groups are decoded, and the rest is cut.
        let mut bytes = BASE64_STANDARD
            .decode(data)
            .map_err(|error| self.array.error(format!("not base64: {error}")))?;
        if bytes.len() < count {
            return Err(self.cut_off());
        }
        bytes.truncate(count);
        Ok(bytes)
    }

    fn cut_off(&self) -> VtpError {
        self.array.error("it is cut off: fewer bytes than it announces")
    }
}

/// Exactly `count` numbers in text.
fn words<T>(
    array: &DataArray<'_>,
    count: u64,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Vec<T>, VtpError> {
    let text = std::str::from_utf8(array.text).map_err(|_| array.error("it is not text"))?;
    let number = |word: &str| {
        parse(word).ok_or_else(|| {
            let word: String = word.chars().take(40).collect();
            array.error(format!("{word:?} is no number of type {}", array.kind))
        })
    };
    let values: Vec<T> = text.split_ascii_whitespace().map(number).collect::<Result<_, _>>()?;
    match values.len() as u64 == count {
        true => Ok(values),
        false => Err(array.error(format!("{} numbers instead of {count}", values.len()))),
    }
}
