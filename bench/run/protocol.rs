//! What the supervisor and a worker say to each other: JSON, one message a line.
//!
//! Requests go to the worker's standard input. Events come from its standard output, each on a line
//! of its own that begins with [`MARK`]: whatever else a method prints there is talk, and passed
//! over.

use std::io::{self, Read, Write};
use std::path::PathBuf;

use medial::simplifier::Level;
use medial_reports::Repetition;
use serde::{Deserialize, Serialize};

use crate::check::Outcome;

use super::{Fault, Item, Kept, Limits, MethodSpec, Provenance};

/// The record separator of ASCII, which no text begins with.
const MARK: u8 = 0x1e;

/// A longer line is no message.
const MAX_LINE_BYTES: usize = 64 << 20;

/// What a worker is asked to do.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Request {
    /// Run all levels of an item, measure, and give records.
    Run {
        /// The item.
        item: Item,
        /// Folder for results as `.ma`.
        axes: Option<PathBuf>,
        /// What the records say of machine and command.
        provenance: Box<Provenance>,
    },
    /// Prepare the method of an item on the smallest of shapes, to see whether it takes its parameters.
    Probe {
        /// The item.
        item: Item,
    },
    /// Time all levels of an item once more.
    Again {
        /// The item.
        item: Item,
    },
    /// Put a method to one case of the conformance corpus.
    Check(CheckItem),
}

impl Request {
    /// The item that it is about, where it is about one.
    pub fn item(&self) -> Option<&Item> {
        match self {
            Self::Run { item, .. } | Self::Probe { item } | Self::Again { item } => Some(item),
            Self::Check(_) => None,
        }
    }

    /// Threads of the worker that serves it, and what ends it by force.
    pub fn terms(&self) -> (usize, Limits) {
        match self {
            Self::Run { item, .. } | Self::Probe { item } | Self::Again { item } => {
                (item.threads, item.limits)
            }
            Self::Check(item) => (item.threads, item.limits),
        }
    }
}

/// One case of the conformance corpus on one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckItem {
    /// The method.
    pub method: MethodSpec,
    /// Name of the case.
    pub case: String,
    /// Number of threads.
    pub threads: usize,
    /// What ends the case by force.
    pub limits: Limits,
}

/// What a worker tells.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Event {
    /// The input is being read and prepared.
    Loading,
    /// The input is ready, its SHA-256; the method prepares.
    Preparing(String),
    /// The method is asked for a level.
    Asked(Level),
    /// The fewest spheres within a bound are searched, on a clock of their own.
    Searching(Level),
    /// The results are being measured.
    Measuring,
    /// The input is refused: why.
    Refused(String),
    /// The method does not take its parameters: why.
    WrongParameter(String),
    /// The record of a level.
    Record(Box<Kept>),
    /// What a level took once more, and a hash of its result.
    Repeated(Level, Result<(Repetition, String), Fault>),
    /// A case of the conformance corpus begins, or goes on to this.
    Doing(String),
    /// How the case ended.
    Checked(Outcome),
    /// The request is done.
    Finished,
}

/// Writes an event where the supervisor reads.
///
/// # Errors
/// When nobody reads any more.
pub fn send(event: &Event) -> io::Result<()> {
    let text = serde_json::to_string(event)?;
    // In one piece, and on a line of its own whatever was printed before.
    let line = [b"\n", &[MARK][..], text.as_bytes(), b"\n"].concat();
    let mut out = io::stdout().lock();
    out.write_all(&line)?;
    out.flush()
}

/// Reads events until the stream ends. Lines that are none are passed over, however long.
pub fn receive(mut from: impl Read, mut each: impl FnMut(Event)) {
    let mut line = Vec::new();
    let mut block = vec![0; 1 << 16];
    loop {
        let read = match from.read(&mut block) {
            Ok(0) => return,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        let mut rest = &block[..read];
        while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
            line.extend_from_slice(&rest[..end]);
            rest = &rest[end + 1..];
            if let Some(event) = parse(&line) {
                each(event);
            }
            line.clear();
        }
        // Talk is not collected, nor a message longer than any.
        if line.is_empty() && rest.first() != Some(&MARK) {
            // The rest of such a line is told from a message by its missing mark.
            line.extend(rest.first().map(|_| b' '));
        } else if line.first() == Some(&MARK) || line.is_empty() {
            line.extend_from_slice(rest);
        }
        if line.len() > MAX_LINE_BYTES {
            line.truncate(1);
            line[0] = b' ';
        }
    }
}

fn parse(line: &[u8]) -> Option<Event> {
    let message = line.strip_prefix(&[MARK])?;
    serde_json::from_slice(message).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time.
    struct Drops<'a>(&'a [u8], usize);

    impl Read for Drops<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let length = self.1.min(self.0.len()).min(buffer.len());
            buffer[..length].copy_from_slice(&self.0[..length]);
            self.0 = &self.0[length..];
            Ok(length)
        }
    }

    #[test]
    fn messages_are_found_among_talk() {
        let message = |event: &Event| {
            let text = serde_json::to_string(event).unwrap();
            [b"\n", &[MARK][..], text.as_bytes(), b"\n"].concat()
        };
        let talk: &[u8] = b"hello\n\x00\xff{\"Finished\": 1}\nno end of line";
        let broken: &[u8] = b"\n\x1e{\"Refused\":\n";
        let stream = [
            talk,
            &message(&Event::Refused("no mesh".into())),
            broken,
            talk,
            &message(&Event::Finished),
            talk,
        ]
        .concat();
        for size in [1, 2, 7, 1000] {
            let mut events = Vec::new();
            receive(Drops(&stream, size), |event| events.push(event));
            let [Event::Refused(why), Event::Finished] = &events[..] else {
                panic!("{events:?}");
            };
            assert_eq!(why, "no mesh");
        }
    }
}
