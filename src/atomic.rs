//! Files that are either complete or not there.
//!
//! By hand because `tempfile`, whose files can be renamed too, follows no links, keeps no permissions of the
//! file that is replaced, and has no list to remove from when a signal comes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary files that are being written, for [`remove_temporaries`].
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Links followed before a chain of them is taken for a ring, as the kernel does.
const MOST_LINKS: usize = 40;

/// Writes a file under a temporary name in the same folder and renames it when it is complete.
///
/// A reader never sees half a file, and a failed write leaves the old file as it was. A file that
/// is replaced keeps its permissions. A symbolic link is followed, also to a file that is not there
/// yet; a target that is no regular file (such as `/dev/stdout`) is written directly.
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
    let target = followed(path)?;
    let (file, temporary) = create_beside(&target)?;
    let permitted = match replaced {
        Some(replaced) => file.set_permissions(replaced.permissions()),
        None => Ok(()),
    };
    // On the disk before the name: after a crash the name must not stand for an empty file.
    permitted
        .and_then(|()| fill(&file, content))
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&temporary.0, &target))
}

/// Removes the temporary files of all writes that are under way, for a program that is about to be
/// ended by a signal. These writes then fail.
pub fn remove_temporaries() {
    for temporary in live().drain(..) {
        let _ = fs::remove_file(temporary);
    }
}

fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is whole after any panic.
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file that is removed when it is dropped, unless it was renamed.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut live = live();
        if let Some(place) = live.iter().position(|path| *path == self.0) {
            live.swap_remove(place);
            // Not there once it was renamed. What could not be removed is only a stray file.
            let _ = fs::remove_file(&self.0);
        }
    }
}

/// The file that a path stands for: where it is a link, even a dangling one, that which it names.
fn followed(path: &Path) -> io::Result<PathBuf> {
    if let Ok(target) = fs::canonicalize(path) {
        return Ok(target);
    }
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(named) = fs::read_link(&target) else {
            return Ok(target);
        };
        // Joining an absolute path replaces the folder.
        target = target.parent().unwrap_or(Path::new("")).join(named);
    }
    Err(io::Error::other("too many symbolic links"))
}

fn fill(file: &File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.flush()
}

/// A new file with a name of its own, hidden, in the folder of `target`.
///
/// The name does not grow with the target's, which may be as long as the file system allows.
fn create_beside(target: &Path) -> io::Result<(File, Temporary)> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    if target.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    }
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let temporary = target.with_file_name(format!(".medial-{}-{number}.tmp", process::id()));
        // Listed before it is there, under the lock: a signal finds either both or nothing.
        let mut live = live();
        match File::create_new(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            other => {
                let file = other?;
                live.push(temporary.clone());
                return Ok((file, Temporary(temporary)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::env;

    use super::*;

    /// A folder of its own, removed at the end of the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = env::temp_dir().join(format!("medial-atomic-{}-{name}", process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn write(path: &Path) {
        write_atomically(path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(path).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn a_replaced_file_keeps_its_mode() {
        use std::os::unix::fs::PermissionsExt;
        let folder = Folder::new("mode");
        let path = folder.0.join("a");
        for mode in [0o600, 0o640, 0o755] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            write(&path);
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_dangling_link_is_followed() {
        use std::os::unix::fs::symlink;
        let folder = Folder::new("link");
        let [first, second, target] = ["first", "second", "target"].map(|n| folder.0.join(n));
        symlink("second", &first).unwrap();
        symlink(&target, &second).unwrap();
        write(&first);
        assert!(fs::symlink_metadata(&first).unwrap().is_symlink());
        assert!(fs::symlink_metadata(&target).unwrap().is_file());
        let ring = folder.0.join("ring");
        symlink("ring", &ring).unwrap();
        assert!(write_atomically(&ring, |_| Ok(())).is_err());
    }

    #[test]
    fn a_name_may_be_as_long_as_the_file_system_allows() {
        let folder = Folder::new("long");
        write(&folder.0.join("a".repeat(255)));
    }
}
