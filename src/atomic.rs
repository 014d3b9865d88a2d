//! Files that are either complete or absent.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Temporary files that are being written, for [`remove_temporaries`].
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file under a temporary name in the same folder and renames it when it is complete.
///
/// A reader never sees half a file, and a failed write leaves the old file as it was. A file that
/// is replaced keeps its permissions. A symbolic link to a file is followed. A target that is no
/// regular file (such as `/dev/stdout`) is written directly.
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
    let replaced = fs::metadata(path).ok();
    if replaced.as_ref().is_some_and(|target| !target.is_file()) {
        return fill(&OpenOptions::new().write(true).open(path)?, content);
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
    // The name does not grow with the target's, which may be as long as the file system allows.
    let mut builder = tempfile::Builder::new();
    builder.prefix(".medial-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // Listed as soon as it is there: a signal may come between.
    let temporary = live(|paths| {
        let temporary = builder.tempfile_in(folder.unwrap_or(Path::new(".")))?;
        paths.push(temporary.path().to_owned());
        io::Result::Ok(temporary)
    })?;
    let path = temporary.path().to_owned();
    let written = complete(temporary, &target, replaced, content);
    live(|paths| paths.retain(|other| *other != path));
    written
}

/// Removes the temporary files of writes in progress: for a process that ends itself without
/// unwinding, since no destructor runs then.
pub fn remove_temporaries() {
    live(|paths| {
        for path in paths.drain(..) {
            // It may have been renamed meanwhile.
            let _ = fs::remove_file(path);
        }
    });
}

fn live<T>(change: impl FnOnce(&mut Vec<PathBuf>) -> T) -> T {
    // A list of paths is whole after any panic.
    change(&mut LIVE.lock().unwrap_or_else(PoisonError::into_inner))
}

fn complete(
    temporary: tempfile::NamedTempFile,
    target: &Path,
    replaced: Option<fs::Metadata>,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if let Some(replaced) = replaced {
        temporary.as_file().set_permissions(replaced.permissions())?;
    }
    fill(temporary.as_file(), content)?;
    // On the disk before the name: after a crash the name must not belong to an empty file.
    temporary.as_file().sync_all()?;
    temporary.persist(target)?;
    Ok(())
}

fn fill(file: &File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;

    use super::*;

    fn write(path: &Path) {
        write_atomically(path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(path).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn a_replaced_file_keeps_its_mode_and_a_link_its_target() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["a", "link"].map(|name| folder.path().join(name));
        symlink("a", &link).unwrap();
        for mode in [0o600, 0o640, 0o755] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            write(&link);
            assert_eq!(fs::read(&path).unwrap(), b"new");
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        // A new file has the mode of any new file, not the private one of temporary files.
        let [ours, theirs] = ["ours", "theirs"].map(|name| folder.path().join(name));
        write(&ours);
        fs::write(&theirs, "").unwrap();
        let [ours, theirs] = [ours, theirs].map(|file| fs::metadata(file).unwrap().permissions());
        assert_eq!(ours.mode(), theirs.mode());
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a".repeat(255));
        write(&path);
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "disk full");
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let nowhere = write_atomically(folder.path().join("nowhere/a"), |_| Ok(())).unwrap_err();
        assert_eq!(nowhere.kind(), io::ErrorKind::NotFound);
        assert!(nowhere.to_string().contains("nowhere"), "{nowhere}");
    }
}
