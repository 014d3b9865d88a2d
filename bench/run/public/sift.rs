//! Taking archives apart: a Debian package, a wheel, a tar, with archives and compressed files in them.
//!
//! 1. An archive is read as a stream. Nothing is unpacked to a disk, so that no path in it decides anything; a path
//!    that leads outside ends it all the same, as a sign of what it is.
//! 2. Only plain files with the extension of a surface are read, each to a limit; links are not followed.
//! 3. What comes out of every decompressor counts against one limit, headers and skipped files too, and so does the
//!    number of files.
//! 4. A tar in it is taken apart in turn, to a depth; a `.gz` is unpacked; a JavaScript module with a mesh becomes OFF.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use lzma_rust2::XzReader;
use ruzstd::decoding::StreamingDecoder;
use tar::EntryType;
use zip::ZipArchive;

use super::{PublicError, module};

/// Extensions of what is handed out.
const SURFACES: [&str; 4] = ["off", "obj", "ply", "stl"];

/// Bytes that a decompressor may look back, and so hold in memory.
const MOST_WINDOW: u64 = 1 << 30;

/// What an archive may ask for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Bytes from all decompressors together.
    pub bytes: u64,
    /// Bytes of one mesh, which is read as a whole.
    pub one: u64,
    /// Number of files.
    pub files: u64,
    /// Archives in archives.
    pub depth: usize,
}

impl Limits {
    /// Many times what the packages of the catalogue have.
    pub const USUAL: Self = Self { bytes: 8 << 30, one: 256 << 20, files: 500_000, depth: 3 };
}

/// A mesh in an archive.
#[derive(Debug)]
pub(super) struct Found {
    /// Its path; after `!` the path in an archive in the archive.
    pub path: String,
    /// Its content, unpacked.
    pub bytes: Vec<u8>,
}

/// Hands out the meshes in an archive, in their order there.
///
/// # Errors
/// When it cannot be read, or holds what no package of meshes has: [`PublicError::Archive`]. What `take` refuses ends
/// it, too.
pub(super) fn sift(
    archive: &Path,
    limits: Limits,
    take: &mut dyn FnMut(Found) -> Result<(), PublicError>,
) -> Result<(), PublicError> {
    let mut sieve =
        Sieve { limits, left: &Cell::new(limits.bytes), files: &Cell::new(limits.files), take };
    let file = File::open(archive).map_err(super::io_error(archive))?;
    let refused = |why: String| PublicError::Archive { archive: archive.to_owned(), why };
    let name = archive.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let sifted = if name.ends_with(".deb") {
        sieve.debian(BufReader::new(file))
    } else if name.ends_with(".whl") || name.ends_with(".zip") {
        sieve.zip(BufReader::new(file))
    } else if Packed::of_tar(&name).is_some() {
        sieve.tar(&name, &mut BufReader::new(file), "", 0)
    } else {
        let known = ".deb, .whl, .zip, .tar, .tgz, .tar.gz, .tar.xz, .tar.zst";
        Err(Problem::Refused(format!("its extension is none of {known}")))
    };
    sifted.map_err(|problem| match problem {
        Problem::Refused(why) => refused(why),
        Problem::Io(error) => refused(format!("it cannot be unpacked: {error}")),
        Problem::Taken(error) => error,
    })
}

/// Why it ends.
enum Problem {
    Refused(String),
    Io(io::Error),
    /// Whoever takes the meshes failed.
    Taken(PublicError),
}

impl From<io::Error> for Problem {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// How a file is compressed.
#[derive(Clone, Copy)]
enum Packed {
    Not,
    Gz,
    Xz,
    Zst,
}

impl Packed {
    /// Of a tar, by its name.
    fn of_tar(name: &str) -> Option<Self> {
        let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
        match () {
            () if ends(&[".tar"]) => Some(Self::Not),
            () if ends(&[".tar.gz", ".tgz"]) => Some(Self::Gz),
            () if ends(&[".tar.xz", ".txz"]) => Some(Self::Xz),
            () if ends(&[".tar.zst", ".tzst"]) => Some(Self::Zst),
            () => None,
        }
    }

    fn unpacked<'r>(self, packed: &'r mut dyn Read) -> io::Result<Box<dyn Read + 'r>> {
        Ok(match self {
            Self::Not => Box::new(packed),
            Self::Gz => Box::new(MultiGzDecoder::new(packed)),
            Self::Xz => Box::new(XzReader::new_mem_limit(packed, true, (MOST_WINDOW >> 10) as u32)),
            Self::Zst => Box::new(
                StreamingDecoder::new_with_max_window_size(packed, MOST_WINDOW)
                    .map_err(io::Error::other)?,
            ),
        })
    }
}

/// Counts what comes out of a decompressor.
struct Counted<'l, R> {
    inner: R,
    left: &'l Cell<u64>,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        let left = self.left.get().checked_sub(read as u64);
        let left = left.ok_or_else(|| io::Error::other("it unpacks to more than is taken"))?;
        self.left.set(left);
        Ok(read)
    }
}

struct Sieve<'a> {
    limits: Limits,
    left: &'a Cell<u64>,
    files: &'a Cell<u64>,
    take: &'a mut dyn FnMut(Found) -> Result<(), PublicError>,
}

impl Sieve<'_> {
    /// A Debian package: an `ar` with `data.tar` in it. Headers of 60 bytes: the name in the first 16, the size in
    /// decimals from byte 48 on; contents begin at even places. By hand, since a reader of all dialects of `ar` holds
    /// tables in memory that are as large as a header says.
    fn debian(&mut self, mut file: impl Read) -> Result<(), Problem> {
        let mut magic = [0; 8];
        file.read_exact(&mut magic)?;
        if magic != *b"!<arch>\n" {
            return Err(Problem::Refused("it is no Debian package".into()));
        }
        let mut header = [0; 60];
        loop {
            file.read_exact(&mut header)?;
            self.count()?;
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
            let name = text(&header[..16]);
            let size: u64 = text(&header[48..58])
                .parse()
                .map_err(|_| Problem::Refused(format!("the size of {name:?} is no number")))?;
            if name.starts_with("data.tar") {
                return self.tar(name.trim_end_matches('/'), &mut file.take(size), "", 0);
            }
            io::copy(&mut (&mut file).take(size.next_multiple_of(2)), &mut io::sink())?;
        }
    }

    /// A wheel, or another zip.
    fn zip(&mut self, file: impl Read + io::Seek) -> Result<(), Problem> {
        let wrong = |error: zip::result::ZipError| Problem::Refused(error.to_string());
        let mut archive = ZipArchive::new(file).map_err(wrong)?;
        for place in 0..archive.len() {
            self.count()?;
            let mut entry = archive.by_index(place).map_err(wrong)?;
            let path = checked(entry.name_raw())?;
            if entry.is_file() {
                self.file(&path, &mut entry, 0)?;
            }
        }
        Ok(())
    }

    fn tar(
        &mut self,
        name: &str,
        packed: &mut dyn Read,
        within: &str,
        depth: usize,
    ) -> Result<(), Problem> {
        let kind = Packed::of_tar(name)
            .ok_or_else(|| Problem::Refused(format!("{name} is compressed in an unknown way")))?;
        let counted: Box<dyn Read + '_> =
            Box::new(Counted { inner: kind.unpacked(packed)?, left: self.left });
        let mut archive = tar::Archive::new(counted);
        // Raw: an extended header could ask for any amount of memory. The long names that stand in them are lost, and
        // the names serve messages alone.
        for entry in archive.entries()?.raw(true) {
            let mut entry = entry?;
            self.count()?;
            let path = checked(&entry.path_bytes())?;
            let kind = entry.header().entry_type();
            if matches!(kind, EntryType::Regular | EntryType::Continuous) {
                self.file(&format!("{within}{path}"), &mut entry, depth)?;
            }
        }
        Ok(())
    }

    /// A plain file: an archive, a mesh, or nothing of ours.
    fn file(&mut self, path: &str, content: &mut dyn Read, depth: usize) -> Result<(), Problem> {
        let lower = path.to_ascii_lowercase();
        if Packed::of_tar(&lower).is_some() {
            if depth == self.limits.depth {
                return Err(Problem::Refused(format!(
                    "{path}: archives in archives beyond all use"
                )));
            }
            return self.tar(&lower, content, &format!("{path}!"), depth + 1);
        }
        let (plain, is_gz) = match lower.strip_suffix(".gz") {
            Some(plain) => (plain, true),
            None => (&*lower, false),
        };
        let Some((_, extension)) = plain.rsplit_once('.') else { return Ok(()) };
        if extension != "js" && !SURFACES.contains(&extension) {
            return Ok(());
        }
        let kind = if is_gz { Packed::Gz } else { Packed::Not };
        let bytes = self.whole(path, kind.unpacked(content)?)?;
        let bytes = if extension == "js" { module::to_off(&bytes) } else { Some(bytes) };
        let Some(bytes) = bytes else { return Ok(()) };
        (self.take)(Found { path: path.to_owned(), bytes }).map_err(Problem::Taken)
    }

    /// A file as a whole, to a limit.
    fn whole(&self, path: &str, content: impl Read) -> Result<Vec<u8>, Problem> {
        let mut bytes = Vec::new();
        let mut counted = Counted { inner: content, left: self.left }.take(self.limits.one + 1);
        counted.read_to_end(&mut bytes)?;
        if bytes.len() as u64 > self.limits.one {
            let most = self.limits.one;
            return Err(Problem::Refused(format!("{path} has more than {most} bytes")));
        }
        Ok(bytes)
    }

    fn count(&self) -> Result<(), Problem> {
        let left = self.files.get().checked_sub(1);
        let left = left.ok_or_else(|| Problem::Refused("it holds files without end".into()))?;
        self.files.set(left);
        Ok(())
    }
}

/// A path in an archive, without `./`, unless it leads out of it.
fn checked(path: &[u8]) -> Result<String, Problem> {
    let text: String = String::from_utf8_lossy(path).escape_debug().take(300).collect();
    let is_outside = text.starts_with('/') || text.split(['/', '\\']).any(|part| part == "..");
    if is_outside {
        return Err(Problem::Refused(format!("`{text}` is a path outside of it")));
    }
    Ok(text.strip_prefix("./").unwrap_or(&text).to_owned())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn gz(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    /// A tar with one file, whatever its name is.
    fn tar_of(name: &str, kind: EntryType, content: &[u8]) -> Vec<u8> {
        let mut builder = tar::Builder::new(Vec::new());
        let mut header = tar::Header::new_gnu();
        header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_entry_type(kind);
        header.set_size(content.len() as u64);
        header.set_cksum();
        builder.append(&header, content).unwrap();
        builder.into_inner().unwrap()
    }

    fn sifted(name: &str, bytes: &[u8], limits: Limits) -> Result<Vec<(String, Vec<u8>)>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let mut found = Vec::new();
        let mut take = |mesh: Found| {
            found.push((mesh.path, mesh.bytes));
            Ok(())
        };
        sift(&path, limits, &mut take).map_err(|error| error.to_string())?;
        Ok(found)
    }

    #[test]
    fn archives_in_archives_are_taken_apart() {
        let inner = gz(&tar_of("./data/a.off", EntryType::Regular, b"OFF"));
        let outer = tar_of("./doc/data.tar.gz", EntryType::Regular, &inner);
        let mut deb = b"!<arch>\n".to_vec();
        for (name, bytes) in [("debian-binary", &b"2.0"[..]), ("data.tar", &outer)] {
            deb.extend(format!("{name:<48}{:<10}`\n", bytes.len()).bytes());
            deb.extend(bytes);
            deb.extend((bytes.len() % 2 == 1).then_some(b'\n'));
        }
        let found = sifted("p.deb", &deb, Limits::USUAL).unwrap();
        assert_eq!(found, [("doc/data.tar.gz!data/a.off".to_owned(), b"OFF".to_vec())]);
        let squeezed = tar_of("p/a.ply.gz", EntryType::Regular, &gz(b"ply"));
        let found = sifted("p.tgz", &gz(&squeezed), Limits::USUAL).unwrap();
        assert_eq!(found, [("p/a.ply.gz".to_owned(), b"ply".to_vec())]);
    }

    #[test]
    fn what_could_do_harm_is_refused_and_links_are_not_followed() {
        let small = Limits { bytes: 20_000, one: 1000, files: 3, depth: 1 };
        let plain = |name| tar_of(name, EntryType::Regular, b"OFF");
        let nested = |depth| {
            (0..depth).fold(plain("a.off"), |inner, _| tar_of("n.tar", EntryType::Regular, &inner))
        };
        let cases = [
            ("../a.off", plain("../a.off"), "path outside"),
            ("/a.off", plain("/etc/a.off"), "path outside"),
            ("large", tar_of("a.off", EntryType::Regular, &[b' '; 1001]), "more than 1000 bytes"),
            ("bomb", tar_of("a.off.gz", EntryType::Regular, &gz(&[b' '; 100_000])), "more than"),
            ("skipped", tar_of("a.bin", EntryType::Regular, &[0; 30_000]), "more than is taken"),
            ("deep", nested(2), "beyond all use"),
            ("cut", plain("a.off")[..513].to_vec(), "cannot be unpacked"),
        ];
        for (name, tar, why) in cases {
            let said = sifted("x.tar", &tar, small).unwrap_err();
            assert!(said.contains(why), "{name}: {said}");
        }
        assert!(sifted("x.tar", &nested(1), small).is_ok_and(|found| found.len() == 1));
        let mut many = tar::Builder::new(Vec::new());
        for _ in 0..4 {
            let mut header = tar::Header::new_gnu();
            header.set_size(0);
            header.set_cksum();
            many.append_data(&mut header, "a.bin", &b""[..]).unwrap();
        }
        let said = sifted("x.tar", &many.into_inner().unwrap(), small).unwrap_err();
        assert!(said.contains("without end"), "{said}");
        for kind in [EntryType::Symlink, EntryType::Link, EntryType::Char] {
            let found = sifted("x.tar", &tar_of("a.off", kind, b""), small).unwrap();
            assert!(found.is_empty(), "{kind:?}");
        }
        assert!(sifted("x.rar", b"", small).unwrap_err().contains("extension"));
    }
}
