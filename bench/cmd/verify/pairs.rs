//! Which surface a medial mesh is of.

use std::fs;
use std::path::{Path, PathBuf};

use crate::exit::Failure;
use crate::files::{extension, is_medial};

/// Extensions of surfaces, those that hold least beside the surface first.
const SURFACES: [&str; 4] = ["off", "obj", "ply", "stl"];

/// Every file that is asked for, and its surface.
///
/// # Errors
/// When a folder cannot be read, or there is no file.
pub(super) fn find(
    asked: &[PathBuf],
    folders: &[PathBuf],
) -> Result<Vec<(PathBuf, Option<PathBuf>)>, Failure> {
    let mut pairs = Vec::new();
    for path in asked {
        if path.is_dir() {
            for file in medial_meshes(path)? {
                let surface = surface_of(&file, folders)?;
                pairs.push((file, surface));
            }
        } else if let Some((file, surface)) = named(path) {
            pairs.push((file, Some(surface)));
        } else {
            pairs.push((path.clone(), surface_of(path, folders)?));
        }
    }
    if pairs.is_empty() {
        let names: Vec<_> = asked.iter().map(|path| path.display().to_string()).collect();
        return Err(Failure::input(format!("{}: no medial mesh in it", names.join(", "))));
    }
    Ok(pairs)
}

/// `X.ma=MESH`, unless a file has that name.
fn named(path: &Path) -> Option<(PathBuf, PathBuf)> {
    let text = path.to_str().filter(|_| !path.exists())?;
    let (file, surface) = text.split_once('=')?;
    Some((file.into(), surface.into()))
}

/// The medial meshes of a folder, by name.
fn medial_meshes(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut files = files(folder)?;
    files.retain(|file| is_medial(file).unwrap_or(false));
    Ok(files)
}

/// The surface whose name is that of a medial mesh, or the longest beginning of it up to a `_`, `-` or `.`.
fn surface_of(file: &Path, folders: &[PathBuf]) -> Result<Option<PathBuf>, Failure> {
    let own = file.parent().map(Path::to_owned).unwrap_or_default();
    let own = if own.as_os_str().is_empty() { PathBuf::from(".") } else { own };
    let folders = if folders.is_empty() { std::slice::from_ref(&own) } else { folders };
    let Some(name) = file.file_stem().and_then(|stem| stem.to_str()) else { return Ok(None) };
    let mut best: Option<(usize, usize, PathBuf)> = None;
    for folder in folders {
        for candidate in files(folder)? {
            let kind = SURFACES.iter().position(|known| *known == extension(&candidate));
            let stem = candidate.file_stem().and_then(|stem| stem.to_str());
            let (Some(kind), Some(stem)) = (kind, stem) else { continue };
            let rest = name.strip_prefix(stem);
            let belongs =
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['_', '-', '.']));
            // A medial mesh as PLY or OBJ is no surface of itself.
            if candidate == file || !belongs || is_medial(&candidate).unwrap_or(true) {
                continue;
            }
            let better = |(length, of, _): &(usize, usize, PathBuf)| {
                (stem.len(), SURFACES.len() - kind) > (*length, SURFACES.len() - of)
            };
            if best.as_ref().is_none_or(better) {
                best = Some((stem.len(), kind, candidate));
            }
        }
    }
    Ok(best.map(|(_, _, surface)| surface))
}

/// The files of a folder, by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |error| Failure::input(format!("{}: {error}", folder.display()));
    let entries = fs::read_dir(folder).map_err(failed)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut files: Vec<PathBuf> = paths.collect::<Result<_, _>>().map_err(failed)?;
    files.retain(|path| path.is_file());
    files.sort_unstable();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_name_before_a_separator_is_the_surface() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for name in
            ["ant.off", "ant.obj", "ant_2.off", "an.off", "ant_2_qmat.ma", "ant-x.ma", "antler.ma"]
        {
            fs::write(at(name), "v 0 0 0\n").unwrap();
        }
        let surface = |name: &str| surface_of(&at(name), &[]).unwrap();
        assert_eq!(surface("ant_2_qmat.ma"), Some(at("ant_2.off")));
        assert_eq!(surface("ant-x.ma"), Some(at("ant.off")));
        assert_eq!(surface("antler.ma"), None);
        let pairs = find(&[dir.path().to_owned()], &[]).unwrap();
        assert_eq!(pairs.len(), 3);
        let given = format!("{}=elsewhere/x.off", at("antler.ma").display());
        let pairs = find(&[given.into()], &[]).unwrap();
        assert_eq!(pairs, [(at("antler.ma"), Some("elsewhere/x.off".into()))]);
        assert!(find(&[], &[]).is_err());
        assert!(find(&[at("nowhere").join("x.ma")], &[]).is_err());
    }
}
