//! `results.jsonl`: written records read back, and an interrupted write costs one line.

use std::fs;

use medial_run::journal::{Journal, parse_records, read_records, write_records};
use medial_run::record::Status;

use super::common::{comparison, ok, request};

#[test]
fn records_read_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("results.jsonl");
    let records = comparison(&["bear", "dolphin"], &["qmat", "angle"], &[500, 100]);
    let mut journal = Journal::open(&path).unwrap();
    journal.append(&records).unwrap();
    let read = read_records(&path).unwrap();
    assert_eq!((read.records.as_slice(), read.bad_lines.len()), (records.as_slice(), 0));
    write_records(&path, &records[1..]).unwrap();
    assert_eq!(read_records(&path).unwrap().records, records[1..]);
}

#[test]
fn numbers_without_a_json_form_are_rejected_and_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("results.jsonl");
    let mut journal = Journal::open(&path).unwrap();
    for value in [f64::NAN, f64::INFINITY] {
        let mut record = ok("bear", "qmat", 100, 0, 0);
        record.evaluate.as_mut().unwrap().distances.mean = value;
        let error = journal.append(&[record]).unwrap_err().to_string();
        assert!(error.contains("no JSON form"), "{error}");
    }
    assert_eq!(fs::read(&path).unwrap(), b"");
}

/// Wherever a crash cuts the file off, complete lines survive, the torn one is reported, and the next record has its
/// own line.
#[test]
fn a_torn_line_costs_one_record() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("results.jsonl");
    let records = [300, 200, 100].map(|count| request("bear", "qmat", count, Status::Failed));
    let last = ok("plane", "angle", 100, 1, 1);
    write_records(&path, &records).unwrap();
    let bytes = fs::read(&path).unwrap();
    let ends: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i] == b'\n').collect();
    for cut in 0..bytes.len() {
        fs::write(&path, &bytes[..cut]).unwrap();
        // A line that lacks only its line break is complete.
        let complete = ends.iter().filter(|&&end| end <= cut).count();
        let torn = cut > 0 && bytes[cut - 1] != b'\n' && !ends.contains(&cut);
        let read = read_records(&path).unwrap();
        assert_eq!(read.records, records[..complete]);
        assert!(read.bad_lines.len() == usize::from(torn) && read.bad_lines.iter().all(|l| l.torn));
        Journal::open(&path).unwrap().append(std::slice::from_ref(&last)).unwrap();
        let read = read_records(&path).unwrap();
        assert_eq!((read.records.len(), read.records.last()), (complete + 1, Some(&last)));
    }
}

#[test]
fn the_message_of_a_bad_line_is_short() {
    let long = format!("\u{1b}[2J{}", "x".repeat(1_000_000));
    for line in
        [format!("{{\"{long}\": 1}}"), format!("\"{long}\""), format!("{{\"key\": [\"{long}\"]}}")]
    {
        let message = parse_records(line.as_bytes()).bad_lines[0].to_string();
        assert!(message.len() < 400 && !message.contains(char::is_control), "{message:.1000}");
    }
}
