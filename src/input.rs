//! Files that come from elsewhere, and their texts in messages.

use std::path::Path;
use std::{fs, io};

/// Refuses a path whose reader could wait or read forever: a device, a pipe, a folder. A missing file is left to the
/// reader.
///
/// # Errors
/// If the path exists and is not a regular file.
pub fn check_regular(path: impl AsRef<Path>) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(target) if !target.is_file() => Err(io::Error::other("not a regular file")),
        _ => Ok(()),
    }
}

/// The content of a regular file.
///
/// # Errors
/// As [`check_regular`], and when the file cannot be read.
pub fn read_regular(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    check_regular(&path).and_then(|()| fs::read(path))
}

/// The text of a regular file.
///
/// # Errors
/// As [`read_regular`], and when the content is not UTF-8.
pub fn read_regular_text(path: impl AsRef<Path>) -> io::Result<String> {
    check_regular(&path).and_then(|()| fs::read_to_string(path))
}

/// Characters of a text from a file that a message repeats.
const LIMIT: usize = 40;

/// A text from a file as a message repeats it: control characters escaped, cut after 40 characters.
///
/// ```
/// assert_eq!(medial::shortened("left\narm"), r"left\narm");
/// assert_eq!(medial::shortened(&"x".repeat(50)), format!("{}...", "x".repeat(40)));
/// ```
pub fn shortened(text: &str) -> String {
    let (text, more) = match text.char_indices().nth(LIMIT) {
        Some((end, _)) => (&text[..end], "..."),
        None => (text, ""),
    };
    // Without its quotation marks.
    let escaped = format!("{text:?}");
    format!("{}{more}", &escaped[1..escaped.len() - 1])
}

/// [`shortened`] in quotation marks.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", shortened(text))
}

/// The message of a parser in one line, with each text that it quotes as [`shortened`] has it.
///
/// ```
/// let message = format!("unknown field `{}`, expected `a`", "x".repeat(50));
/// assert_eq!(medial::parser_message(&message), format!("unknown field `{}...`, expected `a`", "x".repeat(40)));
/// ```
pub fn parser_message(message: &str) -> String {
    /// Characters between two quotations, and of the whole message. Parsers use fewer of their own.
    const BETWEEN: usize = 120;
    const WHOLE: usize = 1_000;
    let mut line = String::new();
    for (k, part) in message.split_inclusive(['`', '"']).enumerate() {
        let text = part.trim_end_matches(['`', '"']);
        let is_quotation = k % 2 == 1;
        match is_quotation {
            true => line += &shortened(text),
            false => line
                .extend(text.chars().take(BETWEEN).map(|c| if c.is_control() { ' ' } else { c })),
        }
        line += &part[text.len()..];
        if line.len() > WHOLE {
            break;
        }
    }
    line
}
