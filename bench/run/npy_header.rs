//! The header of an `.npy` file: a Python dictionary of three known keys.

/// The type of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Element {
    F4,
    F8,
}

impl Element {
    pub(super) fn size(self) -> usize {
        match self {
            Self::F4 => 4,
            Self::F8 => 8,
        }
    }

    /// Appends the elements in `bytes`, a multiple of their size.
    pub(super) fn decode(self, bytes: &[u8], values: &mut Vec<f64>) {
        match self {
            Self::F4 => {
                let (elements, _) = bytes.as_chunks();
                values.extend(elements.iter().map(|&e| f64::from(f32::from_le_bytes(e))));
            }
            Self::F8 => {
                let (elements, _) = bytes.as_chunks();
                values.extend(elements.iter().map(|&e| f64::from_le_bytes(e)));
            }
        }
    }
}

/// The contents of the header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) element: Element,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<u64>,
}

/// A defect of the header of an `.npy` file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeaderError {
    /// The file ends within the header.
    #[error("the header is incomplete: the file ends within it")]
    Incomplete,
    /// The header is not a dictionary as the format demands.
    #[error("the header is not understood at byte {at}: expected {expected}")]
    Syntax {
        /// Where, in bytes of the header.
        at: usize,
        /// What should be there.
        expected: &'static str,
    },
    /// A key is missing.
    #[error("the header lacks the key '{0}'")]
    Missing(&'static str),
    /// Elements that are not read.
    #[error("the elements are '{0}'; read are '<f8' and '<f4': save array.astype('<f8')")]
    Element(String),
}

/// The length of the header for a dictionary of this length: padded so that the numbers, which follow
/// ten bytes of preamble and the header with its line feed, begin at a multiple of 64.
pub(super) fn header_length(dictionary: usize) -> usize {
    (10 + dictionary + 1).next_multiple_of(64) - 10
}

/// Parses the header's text.
pub(super) fn parse_header(text: &[u8]) -> Result<Header, HeaderError> {
    let mut reader = Reader { text, at: 0 };
    let (mut element, mut fortran_order, mut shape) = (None, None, None);
    reader.expect(b'{', "{")?;
    while !reader.accept(b'}') {
        let key = reader.string("a key in quotes or }")?;
        reader.expect(b':', ":")?;
        match key.as_slice() {
            b"descr" => element = Some(reader.element()?),
            b"fortran_order" => fortran_order = Some(reader.boolean()?),
            b"shape" => shape = Some(reader.shape()?),
            _ => return Err(reader.fault("one of the keys descr, fortran_order, shape")),
        }
        if !reader.accept(b',') {
            reader.expect(b'}', ", or }")?;
            break;
        }
    }
    reader.skip_blanks();
    if reader.at < text.len() {
        return Err(reader.fault("nothing after the dictionary"));
    }
    Ok(Header {
        element: element.ok_or(HeaderError::Missing("descr"))?,
        fortran_order: fortran_order.ok_or(HeaderError::Missing("fortran_order"))?,
        shape: shape.ok_or(HeaderError::Missing("shape"))?,
    })
}

struct Reader<'t> {
    text: &'t [u8],
    at: usize,
}

impl Reader<'_> {
    fn fault(&self, expected: &'static str) -> HeaderError {
        HeaderError::Syntax { at: self.at, expected }
    }

    fn take_while(&mut self, belongs: impl Fn(u8) -> bool) -> &[u8] {
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|&b| !belongs(b)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn skip_blanks(&mut self) {
        self.take_while(|b| b.is_ascii_whitespace());
    }

    fn accept(&mut self, byte: u8) -> bool {
        self.skip_blanks();
        let found = self.text.get(self.at) == Some(&byte);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, byte: u8, expected: &'static str) -> Result<(), HeaderError> {
        if self.accept(byte) { Ok(()) } else { Err(self.fault(expected)) }
    }

    /// A text in single or double quotes, without escapes.
    fn string(&mut self, expected: &'static str) -> Result<Vec<u8>, HeaderError> {
        let quote = if self.accept(b'\'') {
            b'\''
        } else if self.accept(b'"') {
            b'"'
        } else {
            return Err(self.fault(expected));
        };
        let content = self.take_while(|b| b != quote).to_vec();
        self.expect(quote, "the end of the quotes")?;
        Ok(content)
    }

    fn element(&mut self) -> Result<Element, HeaderError> {
        if self.accept(b'[') {
            return Err(HeaderError::Element("[...], records of several fields".to_owned()));
        }
        match self.string("the type of the elements in quotes")?.as_slice() {
            b"<f4" => Ok(Element::F4),
            b"<f8" => Ok(Element::F8),
            other => Err(HeaderError::Element(String::from_utf8_lossy(other).into_owned())),
        }
    }

    fn boolean(&mut self) -> Result<bool, HeaderError> {
        self.skip_blanks();
        let fault = self.fault("True or False");
        match self.take_while(|b| b.is_ascii_alphabetic()) {
            b"True" => Ok(true),
            b"False" => Ok(false),
            _ => Err(fault),
        }
    }

    fn shape(&mut self) -> Result<Vec<u64>, HeaderError> {
        self.expect(b'(', "( before the shape")?;
        let mut shape = Vec::new();
        while !self.accept(b')') {
            self.skip_blanks();
            let fault = self.fault("a size that is a natural number below 2^64");
            let digits = self.take_while(|b| b.is_ascii_digit());
            let size = std::str::from_utf8(digits).ok().and_then(|d| d.parse().ok());
            shape.push(size.ok_or(fault)?);
            // Files from Python 2 have long integers.
            self.accept(b'L');
            if !self.accept(b',') {
                self.expect(b')', ", or ) after a size")?;
                break;
            }
        }
        Ok(shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dictionaries_as_written_by_others() {
        let expected = Header { element: Element::F8, fortran_order: false, shape: vec![10, 3] };
        for text in [
            "{'descr': '<f8', 'fortran_order': False, 'shape': (10, 3), }          \n",
            "{\"shape\":(10,3),\"fortran_order\":False,\"descr\":\"<f8\"}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (10L, 3L), }\n",
        ] {
            assert_eq!(parse_header(text.as_bytes()), Ok(expected.clone()), "{text}");
        }
    }

    #[test]
    fn faults_are_named() {
        let error = |text: &str| parse_header(text.as_bytes()).expect_err("a fault").to_string();
        let with = |descr: &str| {
            error(&format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (1, 3)}}"))
        };
        assert!(with("'>f8'").contains("'>f8'"));
        assert!(with("'<i8'").contains("astype"));
        assert!(with("[('x', '<f8')]").contains("several fields"));
        assert!(error("{'descr': '<f8'}").contains("fortran_order"));
        assert!(error("{'fortran_order': 0}").contains("True or False"));
        assert!(error("{'shape': (-1, 3)}").contains("byte 11"));
        assert!(error("{'shape': (99999999999999999999, 3)}").contains("natural number"));
        assert!(error("{'shape': (1, 3").contains(", or )"));
        assert!(error("{'other': 1}").contains("one of the keys"));
        assert!(error("{} {}").contains("nothing after"));
        assert!(error("").contains("expected {"));
    }

    #[test]
    fn every_prefix_of_a_header_is_refused() {
        let text = b"{'descr': '<f8', 'fortran_order': False, 'shape': (10, 3), }";
        for length in 0..text.len() {
            assert!(parse_header(&text[..length]).is_err(), "{length}");
        }
    }
}
