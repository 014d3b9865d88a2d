//! Files that are either complete or not there.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file under a temporary name in the same folder and renames it when it is complete.
///
/// A reader never sees half a file, and a failed write leaves the old file as it was. A symbolic
/// link is followed; a target that is no regular file (such as `/dev/stdout`) is written directly.
///
/// ```no_run
/// medial::write_atomically("spheres.txt", |out| writeln!(out, "0 0 0 1"))?;
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
/// When the folder does not exist or is not writable, or `content` fails.
pub fn write_atomically(
    path: impl AsRef<Path>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let path = path.as_ref();
    if fs::metadata(path).is_ok_and(|target| !target.is_file()) {
        return fill(&OpenOptions::new().write(true).open(path)?, content);
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let (file, temporary) = create_beside(&target)?;
    // On the disk before the name: after a crash the name must not stand for an empty file.
    let written = fill(&file, content)
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&temporary, &target));
    if written.is_err() {
        // The first error is the one to report; what is left behind is only a stray file.
        let _ = fs::remove_file(&temporary);
    }
    written
}

fn fill(file: &File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.flush()
}

/// A new file with a name of its own, hidden, in the folder of `target`.
fn create_beside(target: &Path) -> io::Result<(File, PathBuf)> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"))?;
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{number}.tmp", process::id()));
        let temporary = target.with_file_name(hidden);
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            other => return other.map(|file| (file, temporary)),
        }
    }
}
