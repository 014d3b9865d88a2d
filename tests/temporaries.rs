//! Removal of half-written files: alone in its process, whose other writes it would end too.

use std::{env, fs, process};

#[test]
fn temporaries_can_be_removed_while_they_are_written() {
    let folder = env::temp_dir().join(format!("medial-temporaries-{}", process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    let files = || fs::read_dir(&folder).expect("a folder").count();
    let failed = medial::write_atomically(folder.join("a"), |out| {
        out.write_all(b"half")?;
        assert_eq!(files(), 1);
        medial::remove_temporaries();
        assert_eq!(files(), 0);
        Ok(())
    });
    assert!(failed.is_err());
    assert_eq!(files(), 0);
    fs::remove_dir_all(&folder).expect("removed");
}
