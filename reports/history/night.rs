//! One night: what one build measured in one study, a line for each series.
//!
//! The lines are text of few digits in a fixed order, so that a repository keeps years of them small: it
//! stores what differs from night to night, packed. What is exact (counts, topology, errors to six digits, the
//! result's hash) is the same until a commit changes it; seconds have as many digits as clocks can tell.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::path::Path;

use super::HistoryError;
use super::steps::median;
use crate::record::{Machine, Record, Status};
use crate::text::printable;

/// The first line of each file.
const HEAD: &str = "# medial history 1";
/// The line above the series.
const COLUMNS: &str =
    "mesh\trow\tlevel\tstatus\tseconds\tbytes\thausdorff\tmean\tspheres\ttopology\tresult";
/// What stands where there is nothing.
const NONE: &str = "-";

/// What a line is of: a method with its parameters on a mesh at a level.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SeriesName {
    /// Name of the mesh.
    pub mesh: String,
    /// The method with its parameters, and the name of the variant where it has one.
    pub row: String,
    /// The level in words: `1000 spheres`, `level 0.3`.
    pub level: String,
}

/// The figures of a series in one night.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// What became of it.
    pub status: Status,
    /// CPU seconds of the method itself, without shared substrates, median over the repetitions; for the initial
    /// medial mesh, whose work these are, with them.
    pub seconds: Option<f64>,
    /// The most memory at one time.
    pub bytes: Option<u64>,
    /// Two-sided Hausdorff error, a fraction of the diagonal.
    pub hausdorff: Option<f64>,
    /// Mean error, a fraction of the diagonal.
    pub mean: Option<f64>,
    /// Spheres of the result.
    pub spheres: Option<u64>,
    /// Whether the Betti numbers are those of the solid.
    pub topology: Option<bool>,
    /// The first digits of the result's hash.
    pub result: Option<String>,
}

/// The results of one build in one study.
#[derive(Clone, Debug, PartialEq)]
pub struct Night {
    /// `YYYY-MM-DD`.
    pub date: String,
    /// Hash of the commit.
    pub commit: String,
    /// Which one of the nights of this date, from 1.
    pub turn: u32,
    /// Version of the program.
    pub version: String,
    /// Where it ran.
    pub machine: String,
    /// What seconds and results depend on beside mesh, method and level.
    pub conditions: String,
    /// The first digits of the hash of each mesh.
    pub meshes: BTreeMap<String, String>,
    /// The series.
    pub series: BTreeMap<SeriesName, Figures>,
}

impl Night {
    /// The night that some records tell of: of several records of one series the last one counts, of several builds the
    /// one that ran last.
    ///
    /// # Errors
    /// When there is none, they are of several machines or studies, or commit or date are none.
    pub fn of_records(records: &[Record], commit: &str, date: &str) -> Result<Self, HistoryError> {
        check_commit(commit)?;
        check_date(date)?;
        let last = records.last().ok_or(HistoryError::Empty)?;
        let mut night = Self {
            date: date.to_owned(),
            commit: commit.to_ascii_lowercase(),
            turn: 1,
            version: printable(&last.version),
            machine: machine(&last.machine),
            conditions: conditions(last),
            meshes: BTreeMap::new(),
            series: BTreeMap::new(),
        };
        for record in records.iter().filter(|record| record.binary_hash == last.binary_hash) {
            night.add(record)?;
        }
        Ok(night)
    }

    fn add(&mut self, record: &Record) -> Result<(), HistoryError> {
        let name = SeriesName::of(record);
        let mixed = |what| {
            let SeriesName { mesh, row, .. } = name.clone();
            Err(HistoryError::Mixed { mesh, row, what })
        };
        if machine(&record.machine) != self.machine {
            return mixed("the machine");
        }
        if conditions(record) != self.conditions {
            return mixed("sampling, dual, samples, seed or threads");
        }
        // A run that ended before its input was read knows no hash.
        if let Some(hash) = record.mesh_hash.as_deref().map(|hash| first_digits(hash, 12)) {
            let known = self.meshes.entry(name.mesh.clone()).or_insert_with(|| hash.clone());
            if *known != hash {
                return mixed("the mesh's content");
            }
        }
        self.series.insert(name, Figures::of(record));
        Ok(())
    }

    /// Name of the night's file.
    pub fn file_name(&self) -> String {
        format!("{}-{}.tsv", self.date, first_digits(&self.commit, 8))
    }

    /// The night as a file.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{HEAD}\n# date\t{}\n# commit\t{}\n# turn\t{}\n# version\t{}\n# machine\t{}\n# conditions\t{}\n",
            self.date, self.commit, self.turn, self.version, self.machine, self.conditions
        );
        for (mesh, hash) in &self.meshes {
            let _ = writeln!(text, "# mesh\t{mesh}\t{hash}");
        }
        let _ = writeln!(text, "{COLUMNS}");
        for (SeriesName { mesh, row, level }, figures) in &self.series {
            let _ = writeln!(text, "{mesh}\t{row}\t{level}\t{figures}");
        }
        text
    }

    /// Reads the file of a night.
    ///
    /// # Errors
    /// [`HistoryError::Damaged`], which names the line.
    pub fn parse(text: &str, path: &Path) -> Result<Self, HistoryError> {
        let mut reader = Reader { path, text, lines: text.lines(), line: 0 };
        let night = reader.night()?;
        // A file that was cut between two lines looks whole; only its last line break may be missing.
        if !text.ends_with('\n') {
            return Err(reader.damaged("the file ends within a line"));
        }
        if path.file_name().is_some_and(|name| *name != *night.file_name()) {
            return Err(reader.damaged(format!(
                "date and commit are those of a file named {}",
                night.file_name()
            )));
        }
        Ok(night)
    }

    /// Whether two nights tell the same but for their turn.
    pub(super) fn same_as(&self, other: &Self) -> bool {
        *self == Self { turn: self.turn, ..other.clone() }
    }
}

impl SeriesName {
    fn of(record: &Record) -> Self {
        let simplify = &record.simplify;
        let params: BTreeMap<&String, String> =
            simplify.params.0.iter().map(|(key, value)| (key, value.to_string())).collect();
        let words = params.iter().map(|(key, value)| format!(" {key}={}", value.trim_matches('"')));
        let method = format!("{}{}", simplify.method, words.collect::<String>());
        let row = match &simplify.variant {
            Some(variant) => format!("{variant}: {method}"),
            None => method,
        };
        Self {
            mesh: printable(&record.mesh),
            row: printable(&row),
            level: simplify.level.to_string(),
        }
    }
}

impl fmt::Display for SeriesName {
    /// Mesh, row, level.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} · {} · {}", self.mesh, self.row, self.level)
    }
}

impl Figures {
    fn of(record: &Record) -> Self {
        let evaluation = record.evaluate.as_ref();
        let error = |error: f64| error.is_finite().then(|| rounded(error, 6));
        let result = record.result_hash.as_ref();
        Self {
            status: record.status,
            seconds: seconds(record).map(|seconds| rounded(seconds, 4)),
            bytes: record.simplify.peak_bytes,
            hausdorff: evaluation.and_then(|e| error(e.distances.hausdorff)),
            mean: evaluation.and_then(|e| error(e.distances.mean)),
            spheres: record.simplify.spheres.map(|spheres| spheres as u64),
            topology: evaluation.and_then(|e| Some(e.betti == e.expected_betti?)),
            result: result.map(|hash| first_digits(hash, 12)),
        }
    }
}

impl fmt::Display for Figures {
    /// The columns of a line from the status on.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let topology = self.topology.map(|right| if right { "right" } else { "wrong" });
        let or_none = |text: Option<String>| text.unwrap_or_else(|| NONE.to_owned());
        let columns = [
            self.status.key().to_owned(),
            or_none(self.seconds.map(|seconds| seconds.to_string())),
            or_none(self.bytes.map(|bytes| bytes.to_string())),
            or_none(self.hausdorff.map(|error| error.to_string())),
            or_none(self.mean.map(|error| error.to_string())),
            or_none(self.spheres.map(|spheres| spheres.to_string())),
            or_none(topology.map(str::to_owned)),
            or_none(self.result.clone()),
        ];
        f.write_str(&columns.join("\t"))
    }
}

/// CPU seconds of the method itself: the median over the repetitions. `None` where it did not get so far.
fn seconds(record: &Record) -> Option<f64> {
    if !record.status.has_result() {
        return None;
    }
    let initial = record.simplify.method == "initial";
    let own = |stages: &crate::record::Stages| match initial {
        true => stages.total,
        false => stages.prepare + stages.simplify,
    };
    let repetitions: Vec<f64> =
        record.repetitions.iter().map(|repetition| own(&repetition.cpu_seconds)).collect();
    let seconds = match repetitions.as_slice() {
        [] => record.simplify.cpu_seconds.as_ref().map(own)?,
        some => median(some),
    };
    seconds.is_finite().then_some(seconds)
}

/// A number as its first significant digits say it.
fn rounded(value: f64, digits: usize) -> f64 {
    // What Rust writes in this form it reads.
    format!("{:.*e}", digits - 1, value).parse().unwrap_or(value)
}

fn first_digits(text: &str, digits: usize) -> String {
    text.chars().take(digits).collect()
}

/// The machine, its memory to the gigabyte: the kernel's own share differs from boot to boot.
fn machine(machine: &Machine) -> String {
    let gigabytes = (machine.memory as f64 / f64::from(1 << 30)).round();
    let Machine { cpu, cores, os, .. } = machine;
    printable(&format!("{cpu}, {cores} cores, {gigabytes} GB, {os}"))
}

fn conditions(record: &Record) -> String {
    let given = record.conditions.clone().unwrap_or_default();
    let seeds: Vec<String> =
        record.seeds.iter().map(|(what, seed)| format!("{what} {seed}")).collect();
    let threads = record.simplify.threads.map_or(NONE.to_owned(), |threads| threads.to_string());
    printable(&format!(
        "sampling {}; dual {}; samples {}; seeds {}; threads {threads}",
        given.sampling,
        given.dual,
        given.samples,
        seeds.join(", ")
    ))
}

fn check_commit(commit: &str) -> Result<(), HistoryError> {
    let digits = commit.bytes().all(|byte| byte.is_ascii_hexdigit());
    match digits && (8..=64).contains(&commit.len()) {
        true => Ok(()),
        false => Err(HistoryError::Commit(commit.to_owned())),
    }
}

/// A date as the calendar has it but for the ends of months: what is sorted must be well-formed.
fn check_date(date: &str) -> Result<(), HistoryError> {
    let parts: Vec<&str> = date.split('-').collect();
    let number = |index: usize, digits: usize| -> Option<u32> {
        let part = parts.get(index).filter(|part| part.len() == digits)?;
        part.bytes().all(|byte| byte.is_ascii_digit()).then(|| part.parse().ok())?
    };
    let month = number(1, 2).is_some_and(|month| (1..=12).contains(&month));
    let day = number(2, 2).is_some_and(|day| (1..=31).contains(&day));
    match parts.len() == 3 && number(0, 4).is_some() && month && day {
        true => Ok(()),
        false => Err(HistoryError::Date(date.to_owned())),
    }
}

/// The lines of a file, and where they are.
struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    lines: std::str::Lines<'a>,
    line: usize,
}

impl<'a> Reader<'a> {
    fn damaged(&self, message: impl Into<String>) -> HistoryError {
        let message = message.into();
        HistoryError::Damaged { path: self.path.to_owned(), line: self.line.max(1), message }
    }

    fn next(&mut self) -> Result<&'a str, HistoryError> {
        self.line += 1;
        self.lines.next().ok_or_else(|| self.damaged("the file ends here"))
    }

    /// The value of a line of the head.
    fn head(&mut self, key: &str) -> Result<String, HistoryError> {
        let line = self.next()?;
        let value = line.strip_prefix(&format!("# {key}\t"));
        value.map(str::to_owned).ok_or_else(|| self.damaged(format!("no line \"# {key}\"")))
    }

    fn night(&mut self) -> Result<Night, HistoryError> {
        if self.next()? != HEAD {
            return Err(self.damaged(format!("no line {HEAD:?}")));
        }
        let date = self.head("date")?;
        check_date(&date).map_err(|error| self.damaged(error.to_string()))?;
        let commit = self.head("commit")?;
        check_commit(&commit).map_err(|error| self.damaged(error.to_string()))?;
        let turn = self.head("turn")?;
        let turn = turn.parse().map_err(|_| self.damaged(format!("turn {turn:?}: no number")))?;
        let (version, machine) = (self.head("version")?, self.head("machine")?);
        let conditions = self.head("conditions")?;
        let mut meshes = BTreeMap::new();
        loop {
            let line = self.next()?;
            if line == COLUMNS {
                break;
            }
            let mesh = line.strip_prefix("# mesh\t").and_then(|mesh| mesh.split_once('\t'));
            let (mesh, hash) = mesh.ok_or_else(|| self.damaged("no mesh, and no columns"))?;
            meshes.insert(mesh.to_owned(), hash.to_owned());
        }
        let mut series = BTreeMap::new();
        for _ in self.text.lines().skip(self.line) {
            let line = self.next()?;
            let (name, figures) = self.series(line)?;
            if series.insert(name, figures).is_some() {
                return Err(self.damaged("a series stands here twice"));
            }
        }
        Ok(Night { date, commit, turn, version, machine, conditions, meshes, series })
    }

    fn series(&self, line: &str) -> Result<(SeriesName, Figures), HistoryError> {
        let columns: Vec<&str> = line.split('\t').collect();
        let [mesh, row, level, status, seconds, bytes, hausdorff, mean, spheres, topology, result] =
            columns.as_slice()
        else {
            return Err(self.damaged(format!("{} columns in place of 11", columns.len())));
        };
        let known = Status::ALL.into_iter().find(|known| known.key() == *status);
        let status = known.ok_or_else(|| self.damaged(format!("status {status:?}")))?;
        let topology = match *topology {
            NONE => None,
            "right" => Some(true),
            "wrong" => Some(false),
            other => return Err(self.damaged(format!("topology {other:?}"))),
        };
        let figures = Figures {
            status,
            seconds: self.number("seconds", seconds)?,
            bytes: self.number("bytes", bytes)?,
            hausdorff: self.number("hausdorff", hausdorff)?,
            mean: self.number("mean", mean)?,
            spheres: self.number("spheres", spheres)?,
            topology,
            result: Some((*result).to_owned()).filter(|result| result != NONE),
        };
        let [mesh, row, level] = [mesh, row, level].map(|text| (*text).to_owned());
        Ok((SeriesName { mesh, row, level }, figures))
    }

    fn number<T: std::str::FromStr>(
        &self,
        what: &str,
        text: &str,
    ) -> Result<Option<T>, HistoryError> {
        // A number that is not finite parses as one.
        let finite = text.bytes().all(|byte| b"0123456789.e-+".contains(&byte));
        match text {
            NONE => Ok(None),
            text => match text.parse() {
                Ok(number) if finite => Ok(Some(number)),
                _ => Err(self.damaged(format!("{what} {text:?}: no number"))),
            },
        }
    }
}
