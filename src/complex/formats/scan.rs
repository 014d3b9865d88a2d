//! Lines and words of a text file, with the place of each for error messages.

use std::borrow::Cow;

use super::{MaError, MaErrorKind, Radii};
use crate::Vec3;
use crate::complex::Sphere;

/// A line that holds something, split into words.
pub(super) struct Line<'a> {
    file: &'a str,
    number: usize,
    text: Cow<'a, str>,
}

/// The lines of `bytes` that are neither empty nor comments (`#`), numbered from 1.
///
/// Bytes that are not UTF-8 become replacement characters: harmless in a comment, and refused
/// with their line number anywhere else.
pub(super) fn lines<'a>(bytes: &'a [u8], file: &'a str) -> impl Iterator<Item = Line<'a>> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.split(|&byte| byte == b'\n').enumerate().filter_map(move |(index, raw)| {
        let content = raw.split(|&byte| byte == b'#').next().unwrap_or(raw).trim_ascii();
        let line = Line { file, number: index + 1, text: String::from_utf8_lossy(content) };
        (!content.is_empty()).then_some(line)
    })
}

impl Line<'_> {
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn words(&self) -> Words<'_> {
        Words { line: self, rest: self.text.split_ascii_whitespace() }
    }

    pub(super) fn error(&self, kind: MaErrorKind) -> MaError {
        MaError { file: self.file.to_owned(), line: Some(self.number), kind }
    }
}

/// The words of one line, taken one by one.
pub(super) struct Words<'a> {
    line: &'a Line<'a>,
    rest: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Words<'a> {
    pub(super) fn next_word(&mut self) -> Option<&'a str> {
        self.rest.next()
    }

    pub(super) fn required(&mut self, field: &'static str) -> Result<&'a str, MaError> {
        self.rest.next().ok_or_else(|| self.line.error(MaErrorKind::Missing { field }))
    }

    pub(super) fn number(&mut self, field: &'static str) -> Result<f64, MaError> {
        let text = self.required(field)?;
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.line.error(MaErrorKind::Number { field, text: shortened(text) })),
        }
    }

    pub(super) fn point(&mut self) -> Result<Vec3, MaError> {
        let x = self.number("x coordinate")?;
        let y = self.number("y coordinate")?;
        let z = self.number("z coordinate")?;
        Ok(Vec3::new(x, y, z))
    }

    /// Centre and radius, which may be negative; radius 0 where none stands and none is needed.
    pub(super) fn sphere(&mut self, radii: Radii) -> Result<Sphere, MaError> {
        let centre = self.point()?;
        if radii == Radii::NotNeeded && self.rest.clone().next().is_none() {
            return Ok(Sphere::new(centre, 0.0));
        }
        let radius = self.number("radius")?;
        if radii == Radii::NotNegative && radius < 0.0 {
            return Err(self.line.error(MaErrorKind::NegativeRadius(radius)));
        }
        Ok(Sphere::new(centre, radius))
    }

    /// `N` indices below `spheres`.
    pub(super) fn indices<const N: usize>(&mut self, spheres: u64) -> Result<[u32; N], MaError> {
        let mut indices = [0; N];
        for index in &mut indices {
            let text = self.required("index of a sphere")?;
            *index =
                text.parse::<u32>().ok().filter(|&i| u64::from(i) < spheres).ok_or_else(|| {
                    self.line.error(MaErrorKind::Index { text: shortened(text), spheres })
                })?;
        }
        Ok(indices)
    }

    /// The words not yet taken.
    pub(super) fn rest(self) -> impl Iterator<Item = &'a str> {
        self.rest
    }
}

/// A word as it may be repeated in a message.
pub(super) fn shortened(text: &str) -> String {
    const LIMIT: usize = 40;
    match text.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
