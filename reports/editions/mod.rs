//! Editions: frozen results that others compare against, part of the program.
//!
//! The folder of an edition holds `study.toml`, from which it is made, `edition.toml`, its description, and
//! `records.jsonl.gz`, its records. `scripts/freeze.py` writes both.

use std::io::{self, Read};

use flate2::read::GzDecoder;
use medial_run::journal::{Journaled, parse_records};

/// Most bytes of the records of an edition, unpacked: a small file can unpack to any size.
const MOST_BYTES: u64 = 1 << 28;

/// An edition as it is stored.
pub struct Embedded {
    /// Its name, which is that of its folder.
    pub name: &'static str,
    /// The text of its description.
    pub description: &'static str,
    /// Its packed records.
    pub records: &'static [u8],
}

/// The editions of this build, the oldest first.
pub const EDITIONS: &[Embedded] = &[Embedded {
    name: "2027.1",
    description: include_str!("2027.1/edition.toml"),
    records: include_bytes!("2027.1/records.jsonl.gz"),
}];

/// The records of packed JSON lines.
///
/// # Errors
/// When the bytes are no gzip, or unpack to more than 256 MB.
pub fn unpack(bytes: &[u8]) -> io::Result<Journaled> {
    let mut text = Vec::new();
    GzDecoder::new(bytes).take(MOST_BYTES + 1).read_to_end(&mut text)?;
    if text.len() as u64 > MOST_BYTES {
        return Err(io::Error::other("more than 256 MB unpacked"));
    }
    Ok(parse_records(&text))
}
