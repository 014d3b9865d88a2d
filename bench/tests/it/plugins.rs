//! Plug-ins for tests: files in a folder of their own.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

/// Writes a file of plug-ins into a new folder.
pub fn written(toml: &str, files: &[(&str, &str)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let path = folder.path().join("plugins.toml");
    fs::write(&path, toml).expect("written");
    (folder, path)
}

/// A declaration with one entry, and lines that are added to it.
pub fn entry(command: &str, levels: &str, more: &str) -> String {
    format!(
        "[[method]]\nid = \"x\"\ntitle = \"X\"\ncommand = {command}\nlevels = {levels}\n{more}\n"
    )
}

/// Two balls and the edge between them, somewhere in the shape.
pub const VALID: &str = "printf '2 1 0\\nv 0 0 0 0.5\\nv 0.1 0 0 0.5\\ne 0 1\\n' > \"$1\"\n";
