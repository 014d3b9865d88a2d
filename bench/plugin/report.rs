//! What a program says of its own run: a JSON object on a line of standard output.

use serde_json::Value;

/// More or longer warnings than this are a program that writes its log there.
const MOST_WARNINGS: usize = 50;
/// Characters of a warning.
const LONGEST_WARNING: usize = 1000;

/// Seconds that a program measured by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OwnSeconds {
    /// Work that does not depend on the level.
    pub prepare: Option<f64>,
    /// The rest.
    pub simplify: Option<f64>,
}

/// What a program said, as far as it can be understood.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Report {
    pub seconds: Option<OwnSeconds>,
    pub native_level: Option<f64>,
    /// Its own, then those on the report.
    pub warnings: Vec<String>,
}

impl Report {
    /// The last line that is a JSON object, or nothing.
    pub fn of(stdout: &str) -> Self {
        let object = |line: &str| match serde_json::from_str(line.trim()) {
            Ok(Value::Object(object)) => Some(object),
            _ => None,
        };
        let mut report = Self::default();
        let Some(object) = stdout.lines().rev().find_map(object) else { return report };
        let mut remarks = Vec::new();
        for (key, value) in object {
            let understood = match key.as_str() {
                "seconds" => report.set_seconds(&value, &mut remarks),
                "native_level" => value.as_f64().map(|level| report.native_level = Some(level)),
                "warnings" => report.set_warnings(&value),
                _ => {
                    remarks.push(format!("its report has a key `{}`, ignored", clean(&key)));
                    Some(())
                }
            };
            if understood.is_none() {
                remarks.push(format!("its report has no sensible `{key}`, ignored"));
            }
        }
        report.warnings.extend(remarks);
        report
    }

    fn set_seconds(&mut self, value: &Value, remarks: &mut Vec<String>) -> Option<()> {
        let mut seconds = OwnSeconds::default();
        for (key, value) in value.as_object()? {
            let number = value.as_f64().filter(|seconds| *seconds >= 0.0);
            match key.as_str() {
                "prepare" => seconds.prepare = Some(number?),
                "simplify" => seconds.simplify = Some(number?),
                other => {
                    remarks
                        .push(format!("its report has a key `seconds.{}`, ignored", clean(other)));
                }
            }
        }
        self.seconds = Some(seconds);
        Some(())
    }

    fn set_warnings(&mut self, value: &Value) -> Option<()> {
        let list = value.as_array()?;
        let texts: Option<Vec<&str>> = list.iter().map(Value::as_str).collect();
        self.warnings = texts?.into_iter().take(MOST_WARNINGS).map(clean).collect();
        Some(())
    }
}

/// The last line that is not empty, fit to stand in a sentence.
pub(super) fn last_line(text: &str) -> Option<String> {
    text.lines().rev().map(clean).find(|line| !line.is_empty())
}

/// A text of a program without what would disturb a terminal or a table.
fn clean(text: &str) -> String {
    let printable = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    printable.take(LONGEST_WARNING).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_object_counts_and_what_is_odd_in_it_is_named() {
        let text = "log\n{\"native_level\": 1}\n{\"native_level\": 2.5, \"seconds\": {\"simplify\": 3, \
                    \"io\": 1}, \"warnings\": [\"thin\\u0007\"], \"extra\": 0}\nbye\n[1]\n";
        let report = Report::of(text);
        assert_eq!(report.native_level, Some(2.5));
        assert_eq!(report.seconds, Some(OwnSeconds { prepare: None, simplify: Some(3.0) }));
        assert_eq!(report.warnings[0], "thin");
        assert!(report.warnings[1].contains("seconds.io") && report.warnings[2].contains("extra"));
        for odd in ["{\"seconds\": 3}", "{\"seconds\": {\"prepare\": -1}}", "{\"warnings\": [1]}"] {
            let report = Report::of(odd);
            assert!(report.warnings[0].contains("no sensible"), "{odd}: {report:?}");
            assert_eq!(report.seconds, None);
        }
        assert_eq!(Report::of("nothing\n"), Report::default());
    }

    #[test]
    fn last_lines_are_fit_to_be_read() {
        assert_eq!(last_line("one\ntwo\u{1b}[0m \n\n").as_deref(), Some("two [0m"));
        assert_eq!(last_line(" \n"), None);
    }
}
