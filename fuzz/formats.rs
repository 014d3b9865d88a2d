//! Readers: any bytes give a typed error or a valid result.

use std::path::Path;

use medial::complex::{self, LoadedMa, Radii, ReadOptions};
use medial::surface::{self, Format};
use medial_bench::plugin;
use medial_bench::study::Study;
use medial_run::journal::parse_records;

/// Larger meshes are not put to checks that take longer than reading.
const SMALL: usize = 2000;

fn surface(bytes: &[u8], format: Format) {
    let Ok(loaded) = surface::read_bytes(bytes, format) else { return };
    // Reading guarantees all that checking demands.
    let checked = surface::validate(&loaded.mesh).expect("a surface that was read is valid");
    assert_eq!(checked.faces, loaded.mesh.faces.len());
}

pub(crate) fn off(bytes: &[u8]) {
    surface(bytes, Format::Off);
}

pub(crate) fn obj(bytes: &[u8]) {
    surface(bytes, Format::Obj);
}

pub(crate) fn ply(bytes: &[u8]) {
    surface(bytes, Format::Ply);
}

pub(crate) fn stl(bytes: &[u8]) {
    surface(bytes, Format::Stl);
}

fn medial(loaded: &LoadedMa) {
    let mesh = &loaded.mesh;
    assert_eq!(mesh.check(), Ok(()));
    if mesh.spheres.len() + mesh.faces.len() < SMALL {
        let [b0, b1, b2] = complex::betti(mesh).map(|number| number as i64);
        assert_eq!(b0 - b1 + b2, complex::euler(mesh));
    }
}

fn ma_with(bytes: &[u8], options: ReadOptions) {
    if let Ok(loaded) = complex::parse_ma(bytes, "x.ma", options) {
        medial(&loaded);
    }
}

pub(crate) fn ma(bytes: &[u8]) {
    ma_with(bytes, ReadOptions::default());
}

pub(crate) fn ma_lenient(bytes: &[u8]) {
    ma_with(bytes, ReadOptions { lenient: true, block: Some(2), radii: Radii::Needed });
    ma_with(bytes, ReadOptions { lenient: true, block: None, radii: Radii::NotNegative });
}

pub(crate) fn ma_points(bytes: &[u8]) {
    ma_with(bytes, ReadOptions { lenient: false, block: None, radii: Radii::NotNeeded });
}

pub(crate) fn medial_ply(bytes: &[u8]) {
    for radii in [Radii::Needed, Radii::NotNeeded] {
        let options = ReadOptions { radii, ..ReadOptions::default() };
        if let Ok(loaded) = complex::parse_ply(bytes, "x.ply", options) {
            medial(&loaded);
        }
    }
}

pub(crate) fn spheres(bytes: &[u8]) {
    for name in ["x.csv", "x.xyzr", "x.json", "x.yaml", "x.xml"] {
        if let Ok(loaded) = complex::read_content(name, bytes, ReadOptions::default()) {
            medial(&loaded);
        }
    }
}

pub(crate) fn medial_obj(bytes: &[u8]) {
    for radii in [Radii::Needed, Radii::NotNeeded] {
        let options = ReadOptions { radii, ..ReadOptions::default() };
        if let Ok(loaded) = complex::parse_obj(bytes, "x.obj", options) {
            medial(&loaded);
        }
    }
}

pub(crate) fn study(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(study) = toml::from_str::<Study>(text) else { return };
    if study.check().is_err() {
        return;
    }
    // Numbers without a form in TOML are reported as errors; all else reads back.
    if let Ok(written) = study.to_text() {
        let again: Study = toml::from_str(&written).expect("the written text can be read");
        assert_eq!(again.to_text().ok(), Some(written));
    }
}

pub(crate) fn plugins(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // In a folder that is not there, so that no program of this machine is meant.
    let _ = plugin::parse(Path::new("/nowhere/plugins.toml"), text, &["qmat"]);
}

pub(crate) fn records(bytes: &[u8]) {
    let read = parse_records(bytes);
    for record in &read.records {
        let line = serde_json::to_string(record).expect("a record is JSON");
        let again = parse_records(line.as_bytes());
        assert_eq!((again.records.len(), again.bad_lines.len()), (1, 0), "{line}");
        assert_eq!(serde_json::to_string(&again.records[0]).ok(), Some(line));
    }
}
