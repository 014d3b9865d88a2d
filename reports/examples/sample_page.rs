//! Writes a report of made-up records, to look at the page and the plots:
//! `cargo run -p medial-reports --example sample_page -- FOLDER [METHODS [MESHES]]`.

#[path = "../tests/it/common.rs"]
#[allow(dead_code)]
mod common;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = arguments.first().ok_or("which folder?")?;
    let number = |index: usize, default: usize| -> Result<usize, std::num::ParseIntError> {
        arguments.get(index).map_or(Ok(default), |text| text.parse())
    };
    let names = [
        "qmat",
        "pmat",
        "sat",
        "hem",
        "angle",
        "lambda",
        "dey-zhao",
        "tam-heidrich",
        "aof",
        "vmas",
        "my-own-method",
        "external",
    ];
    let methods = &names[..number(1, 3)?.min(names.len())];
    let shapes: Vec<String> = (0..number(2, 13)?)
        .map(|index| {
            let shape = common::SHAPES[index % common::SHAPES.len()];
            if index < common::SHAPES.len() { shape.to_owned() } else { format!("{shape}-{index}") }
        })
        .collect();
    let shapes: Vec<&str> = shapes.iter().map(String::as_str).collect();
    let records = common::comparison(&shapes, methods, &[1000, 500, 200, 100]);
    medial_reports::write_report(Path::new(folder), &records, &common::header(methods))?;
    Ok(())
}
