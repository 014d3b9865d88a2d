//! Tokens of a text file with their line numbers.

use std::fmt;
use std::str::FromStr;

use super::report::{Fault, Place};
use crate::quoted;

/// A position in a text file. Lines end with LF, CRLF or CR.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    /// Number of the current line, from 1.
    pub line: usize,
    /// Starts a comment that lasts to the end of the line.
    pub comment: Option<u8>,
    /// Whether a backslash at the end of a line joins it with the next.
    pub joins: bool,
}

/// A run of bytes between blanks.
#[derive(Clone, Copy)]
pub(super) struct Token<'a> {
    pub text: &'a [u8],
    pub line: usize,
}

impl<'a> Cursor<'a> {
    /// The start of a file, after a byte-order mark.
    pub fn new(bytes: &'a [u8], comment: Option<u8>) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { bytes, at: 0, line: 1, comment, joins: false }
    }

    /// Rows whose first line has this number, without comments.
    pub fn at_line(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, at: 0, line, comment: None, joins: false }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Length of the line end at `at`, or 0.
    fn line_end(&self, at: usize) -> usize {
        match self.bytes.get(at) {
            Some(b'\n') => 1,
            Some(b'\r') if self.bytes.get(at + 1) == Some(&b'\n') => 2,
            Some(b'\r') => 1,
            _ => 0,
        }
    }

    /// Length of a backslash and line end at `at`, or 0.
    fn line_join(&self, at: usize) -> usize {
        if !self.joins || self.bytes.get(at) != Some(&b'\\') {
            return 0;
        }
        // Blanks between the backslash and the line end are forgiven.
        let blanks = self.bytes[at + 1..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        match self.line_end(at + 1 + blanks) {
            0 => 0,
            end => 1 + blanks + end,
        }
    }

    fn skip_blanks(&mut self) {
        while let Some(byte) = self.peek() {
            let join = self.line_join(self.at);
            if join > 0 {
                self.at += join;
                self.line += 1;
            } else if matches!(byte, b' ' | b'\t' | 0x0b | 0x0c) {
                self.at += 1;
            } else {
                break;
            }
        }
        if self.comment.is_some() && self.peek() == self.comment {
            while self.at < self.bytes.len() && self.line_end(self.at) == 0 {
                self.at += 1;
            }
        }
    }

    /// The next token of this line.
    pub fn token_on_line(&mut self) -> Option<Token<'a>> {
        self.skip_blanks();
        let start = self.at;
        while let Some(byte) = self.peek() {
            if byte.is_ascii_whitespace()
                || byte == 0x0b
                || Some(byte) == self.comment
                || self.line_join(self.at) > 0
            {
                break;
            }
            self.at += 1;
        }
        (self.at > start).then(|| Token { text: &self.bytes[start..self.at], line: self.line })
    }

    /// The next token of this or a later line.
    pub fn token(&mut self) -> Option<Token<'a>> {
        loop {
            if let Some(token) = self.token_on_line() {
                return Some(token);
            }
            if !self.next_line() {
                return None;
            }
        }
    }

    /// Passes over the rest of this line; false at the end of the file.
    pub fn next_line(&mut self) -> bool {
        while self.at < self.bytes.len() {
            let join = self.line_join(self.at);
            let end = self.line_end(self.at);
            self.at += (join + end).max(1);
            if join + end > 0 {
                self.line += 1;
            }
            if end > 0 && join == 0 {
                return true;
            }
        }
        false
    }

    /// Goes to the next line that holds a token, unless one is left on this line.
    pub fn skip_empty_lines(&mut self) -> bool {
        loop {
            self.skip_blanks();
            if self.at >= self.bytes.len() {
                return false;
            }
            if self.line_end(self.at) == 0 {
                return true;
            }
            self.next_line();
        }
    }

    /// Number of lines with a token, from here on, counted no further than `limit`.
    pub fn lines_left(&self, limit: usize) -> usize {
        let mut ahead = self.clone();
        let mut count = 0;
        while count < limit && ahead.skip_empty_lines() {
            count += 1;
            ahead.next_line();
        }
        count
    }

    /// A fault: another text, or none, in place of the expected one.
    pub fn expected(&self, expected: impl fmt::Display, found: Option<Token<'_>>) -> Fault {
        let expected = expected.to_string();
        let (at, found) = match found {
            Some(token) => {
                let advice = if token.is_decimal_comma() { ", a decimal comma" } else { "" };
                (Place::Line(token.line), quote(token.text) + advice)
            }
            None if self.at >= self.bytes.len() => return Fault::Ends { expected },
            None => (Place::Line(self.line), "the end of the line".to_owned()),
        };
        Fault::Syntax { at, expected, found }
    }

    // Expectations are formatted for faults alone: millions of numbers are as expected.

    /// The next token of this line as a number.
    pub fn number_on_line<T: FromStr>(&mut self, what: impl fmt::Display) -> Result<T, Fault> {
        let token = self.token_on_line();
        token.and_then(|t| t.parse()).ok_or_else(|| self.expected(what, token))
    }

    /// The next token, on this line or a later one, as a number.
    pub fn number<T: FromStr>(&mut self, what: impl fmt::Display) -> Result<T, Fault> {
        let token = self.token();
        token.and_then(|t| t.parse()).ok_or_else(|| self.expected(what, token))
    }

    /// The next three tokens of this line as numbers.
    pub fn position_on_line(&mut self, what: &str) -> Result<[f64; 3], Fault> {
        Ok([self.number_on_line(what)?, self.number_on_line(what)?, self.number_on_line(what)?])
    }
}

impl Token<'_> {
    /// The token as a number; `nan` and `inf` are floating-point numbers here.
    pub fn parse<T: FromStr>(&self) -> Option<T> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }

    /// Whether the token is a number whose decimals follow a comma.
    fn is_decimal_comma(&self) -> bool {
        let text = String::from_utf8_lossy(self.text);
        text.contains(',') && text.replacen(',', ".", 1).parse::<f64>().is_ok()
    }

    /// Whether the token is this word, in upper or lower case.
    pub fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word.as_bytes())
    }
}

/// Text from a file for a message: shortened, unreadable bytes replaced.
pub(super) fn quote(text: &[u8]) -> String {
    /// More bytes than [`quoted`] takes characters.
    const ENOUGH: usize = 400;
    quoted(&String::from_utf8_lossy(&text[..text.len().min(ENOUGH)]))
}

/// A token as a number of things.
pub(super) fn count(
    cursor: &Cursor<'_>,
    token: Option<Token<'_>>,
    what: impl fmt::Display,
) -> Result<usize, Fault> {
    token
        .and_then(|t| t.parse::<i64>())
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| cursor.expected(what, token))
}
