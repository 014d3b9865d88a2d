//! `medial check [ID ...]`: runs the conformance corpus on methods, built-in or plug-ins.

use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};

use crate::args::{self, Global};
use crate::check::{Case, Outcome, cases, find};
use crate::exec::protocol::CheckItem;
use crate::exec::{RunError, Supervisor};
use crate::exit::{Exit, Failure};
use crate::host::Host;
use crate::interrupt;
use crate::output::{counted, print_json, print_line};
use crate::provenance::{Provenance, shell_line};
use crate::study::item::MethodSpec;
use crate::study::registry::{Entry, Registry};
use crate::study::{Here, Study};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Methods [default: all but those on request, those of `--plugins` too].
    ids: Vec<String>,
    /// Run these cases alone; can be given several times [default: all].
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// Set a parameter of the methods; can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// End a case after so many seconds [default: 300].
    #[arg(long, value_name = "SECONDS")]
    timeout: Option<f64>,
    /// End a case that needs more megabytes [default: three quarters of the machine's].
    #[arg(long, value_name = "MB")]
    memory: Option<u64>,
}

/// How many cases ended in each way.
#[derive(Default)]
struct Counts {
    passed: usize,
    failed: usize,
    skipped: usize,
}

/// Runs the verb.
///
/// # Errors
/// When a method, a case or a parameter does not exist, or no worker can be started. A case that a
/// method fails is no error here: it is a line of the output, and sets the exit code.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let entries = arguments.entries(registry)?;
    let cases = arguments.cases()?;
    let mut items = arguments.items(&entries, &cases, global)?;
    let interrupted = interrupt::listen();
    let mut supervisor =
        Supervisor::new(registry.files(), &Provenance::default(), None, interrupted);
    let (mut counts, mut list) = (Counts::default(), Vec::new());
    for (item, case) in &mut items {
        let begun = Instant::now();
        let outcome = match supervisor.check(item) {
            Err(RunError::Interrupted) => return Ok(Exit::Interrupted),
            outcome => outcome?,
        };
        counts.add(&outcome);
        let line = Line {
            case,
            outcome: &outcome,
            seconds: begun.elapsed().as_secs_f64(),
            command: arguments.command(item, global),
            id: &item.method.id,
        };
        if global.json {
            list.push(line.as_json());
        } else {
            line.print();
        }
    }
    counts.print(list, global);
    Ok(if counts.failed > 0 { Exit::SomeFailed } else { Exit::Done })
}

impl Arguments {
    fn entries<'r>(&self, registry: &'r Registry) -> Result<Vec<&'r Entry>, Failure> {
        if self.ids.is_empty() {
            return Ok(registry.usual().collect());
        }
        self.ids.iter().map(|id| args::method(registry, id)).collect()
    }

    fn cases(&self) -> Result<Vec<&'static Case>, Failure> {
        if self.cases.is_empty() {
            return Ok(cases().iter().collect());
        }
        let mut chosen = Vec::new();
        for name in &self.cases {
            chosen.push(find(name).ok_or_else(|| {
                let known: Vec<&str> = cases().iter().map(|case| case.name).collect();
                let known = known.join(", ");
                Failure::usage(format!("no case is called `{name}`; there are: {known}"))
            })?);
        }
        Ok(chosen)
    }

    /// Every case on every method.
    fn items(
        &self,
        entries: &[&Entry],
        cases: &[&'static Case],
        global: &Global,
    ) -> Result<Vec<(CheckItem, &'static Case)>, Failure> {
        let plain = Study::default();
        let timeout = self.timeout.unwrap_or(plain.timeout);
        let study = Study { timeout, memory: self.memory, threads: global.threads, ..plain };
        study.check()?;
        let here = Here::of(&Provenance::here());
        let params = args::params(&self.set)?;
        let mut items = Vec::new();
        for entry in entries {
            let documented = &entry.method().info().params;
            // Refused at once, because every case would fail.
            if let Some(key) =
                params.0.keys().find(|key| documented.iter().all(|p| p.name != **key))
            {
                let id = entry.id();
                return Err(Failure::usage(format!("--set {key}: {id} has no such parameter")));
            }
            let method = MethodSpec {
                id: entry.id().to_owned(),
                name: None,
                params: params.clone(),
                fingerprint: entry.fingerprint().map(str::to_owned),
            };
            items.extend(cases.iter().map(|&case| {
                let item = CheckItem {
                    method: method.clone(),
                    case: case.name.to_owned(),
                    threads: global.threads.unwrap_or(here.threads),
                    limits: study.limits(&here),
                };
                (item, case)
            }));
        }
        Ok(items)
    }

    /// The command that repeats one case on one method.
    fn command(&self, item: &CheckItem, global: &Global) -> String {
        let mut words = vec![program(), "check".into(), item.method.id.clone()];
        let mut options = vec![("--case", item.case.clone())];
        options.extend(self.set.iter().map(|set| ("--set", set.clone())));
        options.extend(self.timeout.map(|seconds| ("--timeout", seconds.to_string())));
        options.extend(self.memory.map(|megabytes| ("--memory", megabytes.to_string())));
        options.extend(global.threads.map(|threads| ("--threads", threads.to_string())));
        let plugins = global.plugins.iter().map(|file| ("--plugins", file.display().to_string()));
        for (option, value) in options.into_iter().chain(plugins) {
            words.extend([option.to_owned(), value]);
        }
        shell_line(&words)
    }
}

/// The name of this program. A crate that adds methods builds a program of its own.
fn program() -> String {
    if Host::here().is_ok_and(Host::is_foreign) {
        return "medial".to_owned();
    }
    let path = std::env::args_os().next().map(std::path::PathBuf::from);
    let name = path.as_ref().and_then(|path| path.file_stem());
    name.map_or_else(|| "medial".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// How one case ended, for people and for programs.
struct Line<'a> {
    id: &'a str,
    case: &'a Case,
    outcome: &'a Outcome,
    seconds: f64,
    command: String,
}

impl Line<'_> {
    fn print(&self) {
        let (id, name, seconds) = (self.id, self.case.name, self.seconds);
        let end = match self.outcome {
            Outcome::Passed(remarks) if remarks.is_empty() => "ok".to_owned(),
            Outcome::Passed(remarks) => format!("ok ({})", remarks.join("; ")),
            Outcome::Failed(why) => format!("FAILED: {why}"),
            Outcome::Skipped(why) => format!("skipped: {why}"),
        };
        print_line(&format!("{id:<14} {name:<18} {seconds:>6.1} s  {end}"));
        if matches!(self.outcome, Outcome::Failed(_)) {
            print_line(&format!(
                "{:<14} demanded: {}; again: {}",
                "", self.case.demands, self.command
            ));
        }
    }

    fn as_json(&self) -> Value {
        let (outcome, reason, remarks) = match self.outcome {
            Outcome::Passed(remarks) => ("ok", None, remarks.as_slice()),
            Outcome::Failed(why) => ("failed", Some(why), &[][..]),
            Outcome::Skipped(why) => ("skipped", Some(why), &[][..]),
        };
        json!({
            "method": self.id, "case": self.case.name, "demands": self.case.demands,
            "outcome": outcome, "reason": reason, "remarks": remarks,
            "seconds": self.seconds, "command": self.command,
        })
    }
}

impl Counts {
    fn add(&mut self, outcome: &Outcome) {
        match outcome {
            Outcome::Passed(_) => self.passed += 1,
            Outcome::Failed(_) => self.failed += 1,
            Outcome::Skipped(_) => self.skipped += 1,
        }
    }

    fn print(&self, list: Vec<Value>, global: &Global) {
        let Self { passed, failed, skipped } = *self;
        if global.json {
            let object =
                json!({ "cases": list, "passed": passed, "failed": failed, "skipped": skipped });
            print_json(&object, &[]);
            return;
        }
        let all = counted((passed + failed + skipped) as u64, "case");
        print_line(&format!("{all}: {passed} ok, {failed} failed, {skipped} skipped"));
    }
}
