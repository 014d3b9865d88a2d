//! Tokens of a text file with their line numbers.

use crate::surface::error::{Fault, Place};

/// A position in a text file. Lines end with LF, CRLF or CR.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    /// Starts a comment that lasts to the end of the line.
    comment: Option<u8>,
    /// Whether a backslash at the end of a line joins it with the next.
    joins: bool,
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

    /// The same with backslashes joining lines.
    pub fn joining_lines(mut self) -> Self {
        self.joins = true;
        self
    }

    /// Continues in the middle of a file.
    pub fn continue_at(bytes: &'a [u8], at: usize, line: usize) -> Self {
        Self { bytes, at, line, comment: None, joins: false }
    }

    /// Number of the current line, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Number of bytes not read.
    pub fn bytes_left(&self) -> usize {
        self.bytes.len() - self.at
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

    /// A fault for what stands here instead of what belongs here.
    pub fn expected(&self, expected: impl Into<String>, found: Option<Token<'_>>) -> Fault {
        match found {
            Some(token) => {
                let at = Place::Line(token.line);
                Fault::Syntax { at, expected: expected.into(), found: quote(token.text) }
            }
            None if self.at >= self.bytes.len() => {
                let found = "nothing more".to_owned();
                Fault::Syntax { at: Place::End, expected: expected.into(), found }
            }
            None => {
                let at = Place::Line(self.line);
                Fault::Syntax { at, expected: expected.into(), found: "the end of the line".into() }
            }
        }
    }

    /// The next token of this line as a number.
    pub fn number_on_line(&mut self, what: &str) -> Result<f64, Fault> {
        let token = self.token_on_line();
        token.and_then(|t| t.number()).ok_or_else(|| self.expected(what, token))
    }

    /// The next token, on whatever line, as a number.
    pub fn number(&mut self, what: &str) -> Result<f64, Fault> {
        let token = self.token();
        token.and_then(|t| t.number()).ok_or_else(|| self.expected(what, token))
    }

    /// The next token of this line as an integer.
    pub fn integer_on_line(&mut self, what: &str) -> Result<i64, Fault> {
        let token = self.token_on_line();
        token.and_then(|t| t.integer()).ok_or_else(|| self.expected(what, token))
    }

    /// The next token, on whatever line, as an integer.
    pub fn integer(&mut self, what: &str) -> Result<i64, Fault> {
        let token = self.token();
        token.and_then(|t| t.integer()).ok_or_else(|| self.expected(what, token))
    }
}

impl Token<'_> {
    /// The token as a floating-point number; `nan` and `inf` are numbers here.
    pub fn number(&self) -> Option<f64> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }

    /// The token as a decimal integer.
    pub fn integer(&self) -> Option<i64> {
        std::str::from_utf8(self.text).ok()?.parse().ok()
    }

    /// Whether the token is this word, in upper or lower case.
    pub fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word.as_bytes())
    }
}

/// Text from a file for a message: shortened, unreadable bytes replaced.
pub(super) fn quote(text: &[u8]) -> String {
    const MAX_BYTES: usize = 40;
    let shown = String::from_utf8_lossy(&text[..text.len().min(MAX_BYTES)]);
    format!("{shown:?}{}", if text.len() > MAX_BYTES { "..." } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(cursor: &mut Cursor<'_>) -> Vec<(String, usize)> {
        std::iter::from_fn(|| cursor.token())
            .map(|t| (String::from_utf8_lossy(t.text).into_owned(), t.line))
            .collect()
    }

    #[test]
    fn lines_are_counted_for_every_kind_of_line_end() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a b", "# c", "", "d#e", "f"].join(end);
            let mut cursor = Cursor::new(text.as_bytes(), Some(b'#'));
            assert_eq!(cursor.lines_left(9), 3);
            let expected = [("a", 1), ("b", 1), ("d", 4), ("f", 5)];
            assert_eq!(tokens(&mut cursor), expected.map(|(t, l)| (t.to_owned(), l)));
        }
    }

    #[test]
    fn a_backslash_joins_lines_only_where_asked() {
        let text = b"f 1 2\\\n 3 \\ \r\n4\ng";
        let mut cursor = Cursor::new(text, Some(b'#')).joining_lines();
        let mut line = Vec::new();
        while let Some(token) = cursor.token_on_line() {
            line.push(String::from_utf8_lossy(token.text).into_owned());
        }
        assert_eq!(line, ["f", "1", "2", "3", "4"]);
        assert!(cursor.next_line());
        assert_eq!(cursor.line(), 4);
        assert_eq!(tokens(&mut Cursor::new(text, None)).len(), 7);
    }
}
