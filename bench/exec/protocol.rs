//! The messages between the supervisor and a worker: JSON, one message per line.
//!
//! Requests go to the worker's standard input. Events come from its standard output, each on a line
//! that begins with `MARK`. Methods may print there, too: lines without the mark are ignored.

use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;

use medial_run::item::{Item, Limits, MethodSpec};
use medial_run::level::Target;
use medial_run::record::{Provenance, Record, Repetition};
use medial_run::timed::Fault;
use serde::{Deserialize, Serialize};

use crate::check::Outcome;

/// The record separator of ASCII, with which no printed text begins.
const MARK: u8 = 0x1e;

/// A longer line is not a message.
const MAX_LINE_BYTES: u64 = 64 << 20;

/// Version of this protocol: one more with each change of [`Request`] or [`Event`] that other builds cannot read.
pub const PROTOCOL: u32 = 1;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Request {
    /// Run all levels of an item, measure, and give records.
    Run {
        item: Item,
        axes: Option<PathBuf>,
        /// The machine and the command, for the records.
        provenance: Box<Provenance>,
    },
    /// Prepare the method of an item on a very small shape, to check its parameters.
    Probe { item: Item },
    /// Time all levels of an item once more.
    Again { item: Item },
    /// Run one case of the conformance corpus on a method.
    Check(CheckItem),
}

impl Request {
    /// The item of the request, if it has one.
    pub fn item(&self) -> Option<&Item> {
        match self {
            Self::Run { item, .. } | Self::Probe { item } | Self::Again { item } => Some(item),
            Self::Check(_) => None,
        }
    }

    /// The threads of the worker that serves it, and its limits.
    pub fn terms(&self) -> (usize, Limits) {
        match self {
            Self::Run { item, .. } | Self::Probe { item } | Self::Again { item } => {
                (item.scene.settings.threads, item.limits)
            }
            Self::Check(item) => (item.threads, item.limits),
        }
    }
}

/// One case of the conformance corpus on one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckItem {
    pub method: MethodSpec,
    pub case: String,
    pub threads: usize,
    /// The limits at which the case is killed.
    pub limits: Limits,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Event {
    /// The first event of a worker: its [`PROTOCOL`].
    Ready(u32),
    /// The input is ready, its SHA-256; the method prepares.
    Preparing(String),
    /// The method simplifies to a level, or searches the fewest spheres within a bound.
    #[serde(rename = "Asked")]
    Simplifying(Target),
    Measuring,
    /// The reason for which the input is refused.
    Refused(String),
    /// The reason for which the method rejects its parameters.
    WrongParameter(String),
    Record(Box<Record>),
    /// The times of a repetition of a level, and a hash of its result.
    Repeated(Target, Result<(Repetition, String), Fault>),
    /// A case of the conformance corpus has reached this step.
    Doing(String),
    Checked(Outcome),
    /// The system has refused memory to the worker, which may end because of it.
    OutOfMemory,
    Finished,
}

/// Writes an event to standard output, where the supervisor reads. Fails when the supervisor has closed the pipe.
pub fn send(event: &Event) -> io::Result<()> {
    let text = serde_json::to_string(event)?;
    // One write, and a line break first: a method may have printed an unfinished line.
    let line = [b"\n", &[MARK][..], text.as_bytes(), b"\n"].concat();
    let mut out = io::stdout().lock();
    out.write_all(&line)?;
    out.flush()
}

/// Writes [`Event::OutOfMemory`] without an allocation and without a lock, from inside the allocator.
pub fn send_out_of_memory() {
    #[cfg(unix)]
    let _ = rustix::io::write(rustix::stdio::stdout(), b"\n\x1e\"OutOfMemory\"\n");
}

/// Reads events until the stream ends. Other lines are ignored.
pub fn receive(mut from: impl BufRead, mut each: impl FnMut(Event)) {
    let mut line = Vec::new();
    // A method may print without end and without a line break: memory stays bounded.
    while from.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
        if let Some(event) = parse(&line) {
            each(event);
        }
        line.clear();
    }
}

fn parse(line: &[u8]) -> Option<Event> {
    let message = line.strip_prefix(&[MARK])?;
    serde_json::from_slice(message).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_event_that_is_written_without_an_allocation_is_an_event() {
        assert!(matches!(parse(b"\x1e\"OutOfMemory\""), Some(Event::OutOfMemory)));
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
            let from = io::BufReader::with_capacity(size, &stream[..]);
            receive(from, |event| events.push(event));
            let [Event::Refused(why), Event::Finished] = &events[..] else {
                panic!("{events:?}");
            };
            assert_eq!(why, "no mesh");
        }
    }
}
