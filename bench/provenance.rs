//! The origin of a record: machine, program, command line.

use std::borrow::Cow;
use std::{env, fs, thread};

use medial_run::hash::hex_digest;
use medial_run::record::{Machine, Provenance};
use medial_run::text::command_line;

use crate::host::Host;

/// The provenance of the running process.
pub fn provenance() -> Provenance {
    let words = Host::here().map(|host| &host.words[..]).unwrap_or_default();
    let words = words.iter().map(|word| word.to_string_lossy());
    Provenance {
        machine: machine(),
        binary_hash: Host::here()
            .and_then(|host| fs::read(&host.code))
            // A program that cannot be read leaves no hash, and costs no result.
            .map_or_else(|_| String::new(), |bytes| hex_digest(&bytes)),
        // With the bare name of the program.
        command: command_line([Cow::Borrowed("medial")].into_iter().chain(words)),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn machine() -> Machine {
    let memory = proc_field("/proc/meminfo", "MemTotal").and_then(|value| kibibytes(&value));
    Machine {
        cpu: proc_field("/proc/cpuinfo", "model name").unwrap_or_else(|| "unknown".into()),
        cores: thread::available_parallelism().map_or(1, usize::from),
        os: format!("{} {}", env::consts::OS, env::consts::ARCH),
        memory: memory.unwrap_or(0),
    }
}

/// Largest resident size of this process so far, in bytes; `None` if the system does not provide it.
pub fn peak_bytes() -> Option<u64> {
    proc_field("/proc/self/status", "VmHWM").and_then(|value| kibibytes(&value))
}

fn proc_field(path: &str, key: &str) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    text.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        (name.trim() == key).then(|| value.trim().to_owned())
    })
}

fn kibibytes(value: &str) -> Option<u64> {
    Some(value.strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
