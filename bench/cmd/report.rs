//! `medial report DIR`: rebuilds tables, plots and page from the records of a folder.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use medial_reports::{Header, Record, read_header, read_records, write_report};
use serde_json::json;

use super::compare::RESULTS;
use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder with `results.jsonl`.
    dir: PathBuf,
}

/// Runs the verb.
///
/// # Errors
/// When the folder has no readable records, or the report cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let Rebuilt { records, files, warnings } = rebuild(&arguments.dir)?;
    if global.json {
        print_json(&json!({ "records": records, "files": files }), &warnings);
    } else {
        for warning in &warnings {
            print_line(&format!("warning: {warning}"));
        }
        let page = arguments.dir.join("index.html");
        print_line(&format!("{records} records; page: {}", page.display()));
    }
    Ok(Exit::Done)
}

/// A report that was rebuilt.
pub struct Rebuilt {
    /// Number of records.
    pub records: usize,
    /// The files that were written.
    pub files: Vec<PathBuf>,
    /// Lines that hold no record.
    pub warnings: Vec<String>,
}

/// Rebuilds the report of a folder from its files.
///
/// # Errors
/// As [`run`].
pub fn rebuild(dir: &Path) -> Result<Rebuilt, Failure> {
    let journaled = read_records(&dir.join(RESULTS)).map_err(Failure::input)?;
    let warnings: Vec<String> = journaled.bad_lines.iter().map(ToString::to_string).collect();
    if journaled.records.is_empty() {
        return Err(Failure {
            code: Exit::NothingMeasured,
            message: match warnings.first() {
                None => format!("{}: no record in {RESULTS}", dir.display()),
                Some(first) => {
                    format!("{}: no readable record in {RESULTS}; {first}", dir.display())
                }
            },
        });
    }
    let mut header = read_header(dir).unwrap_or_else(|_| header_of(&journaled.records));
    header.notes.clone_from(&warnings);
    let files = write_report(dir, &journaled.records, &header).map_err(Failure::input)?;
    Ok(Rebuilt { records: journaled.records.len(), files, warnings })
}

/// A header from the records alone, for a run that was interrupted before its report.
fn header_of(records: &[Record]) -> Header {
    let last = records.last();
    Header {
        title: "Medial axis simplification: a comparison".into(),
        command: last.map(|r| r.command.clone()).unwrap_or_default(),
        version: last.map(|r| r.version.clone()).unwrap_or_default(),
        date: None,
        machine: last.map(|r| r.machine.clone()),
        methods: medial_methods::registry().iter().map(|method| method.info().into()).collect(),
        notes: vec![],
    }
}

/// Today's date in UTC, as `YYYY-MM-DD`.
pub fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (year, month, day) = civil_date((seconds / 86_400) as i64);
    format!("{year:04}-{month:02}-{day:02}")
}

/// Year, month and day of a day number counted from 1970-01-01 in the Gregorian calendar: years
/// are counted from March, so that the leap day is a year's last.
fn civil_date(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, day)
}

#[cfg(test)]
mod tests {
    use super::civil_date;

    #[test]
    fn dates() {
        assert_eq!(civil_date(0), (1970, 1, 1));
        assert_eq!(civil_date(11_016), (2000, 2, 29));
        assert_eq!(civil_date(20_778), (2026, 11, 21));
    }
}
