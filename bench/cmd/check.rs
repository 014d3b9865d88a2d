//! `medial check [ID ...]`: runs the conformance corpus on methods, built-in or plug-ins.

use std::time::Instant;

use clap::Args;
use medial_run::item::MethodSpec;
use medial_run::record::Provenance;
use serde_json::json;

use crate::args::{self, Global, key_value, positive};
use crate::check::{Case, Outcome, cases, find};
use crate::exec::Supervisor;
use crate::exec::protocol::CheckItem;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{counted, print_json, print_line};
use crate::provenance::provenance;
use crate::study::Study;
use crate::study::registry::{Entry, Registry};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Methods [default: all, with plug-ins, but those that run on request].
    ids: Vec<String>,
    /// Run this case; repeatable [default: all].
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// Set a parameter of the methods; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Stop a case after SECONDS [default: 300].
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    timeout: Option<f64>,
    /// Stop a case that uses more than MB megabytes [default: 3/4 of the machine's memory].
    #[arg(long, value_name = "MB")]
    memory: Option<u64>,
}

/// Runs the verb. Fails when a method, a case or a parameter does not exist, or no worker can be started. A failed case
/// is a line of the output and sets the exit code.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let items = arguments.items(registry)?;
    let interrupted = interrupt::listen();
    // A case has no record and needs no provenance.
    let mut supervisor =
        Supervisor::new(&registry.files, &Provenance::default(), None, interrupted);
    let (mut counts, mut list) = ([0; 3], Vec::new());
    for (item, case) in &items {
        let begun = Instant::now();
        let outcome = supervisor.check(item)?;
        let seconds = begun.elapsed().as_secs_f64();
        let (place, end, reason, remarks) = match &outcome {
            Outcome::Passed(remarks) => (0, "ok", None, remarks.as_slice()),
            Outcome::Failed(why) => (1, "failed", Some(why), &[][..]),
            Outcome::Skipped(why) => (2, "skipped", Some(why), &[][..]),
        };
        counts[place] += 1;
        let (id, name, demands) = (&item.method.id, case.name, case.demands);
        if global.json {
            list.push(json!({
                "method": id, "case": name, "demands": demands, "outcome": end,
                "reason": reason, "remarks": remarks, "seconds": seconds,
            }));
            continue;
        }
        let end = match &outcome {
            Outcome::Passed(remarks) if remarks.is_empty() => "ok".to_owned(),
            Outcome::Passed(remarks) => format!("ok ({})", remarks.join("; ")),
            Outcome::Failed(why) => format!("FAILED: {why} (expected: {demands})"),
            Outcome::Skipped(why) => format!("skipped: {why}"),
        };
        print_line(&format!("{id:<14} {name:<18} {seconds:>6.1} s  {end}"));
    }
    let [passed, failed, skipped] = counts;
    if global.json {
        let object =
            json!({ "cases": list, "passed": passed, "failed": failed, "skipped": skipped });
        print_json(&object, &[]);
    } else {
        let all = counted(items.len() as u64, "case");
        print_line(&format!("{all}: {passed} ok, {failed} failed, {skipped} skipped"));
    }
    Ok(if failed > 0 { Exit::SomeFailed } else { Exit::Done })
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
        let known = || cases().iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
        let found = self.cases.iter().map(|name| {
            find(name).ok_or_else(|| {
                Failure::usage(format!("unknown case `{name}` (expected one of: {})", known()))
            })
        });
        found.collect()
    }

    /// Every case on every method.
    fn items(&self, registry: &Registry) -> Result<Vec<(CheckItem, &'static Case)>, Failure> {
        let (entries, cases) = (self.entries(registry)?, self.cases()?);
        let plain = Study::default();
        let timeout = self.timeout.unwrap_or(plain.timeout);
        let study = Study { timeout, memory: self.memory, ..plain };
        study.check()?;
        let here = provenance();
        let params = args::params(&self.set);
        let mut items = Vec::new();
        for entry in entries {
            let (id, documented) = (entry.id(), &entry.method().info().params);
            // Refused at once, because every case would fail.
            if let Some(key) =
                params.0.keys().find(|key| documented.iter().all(|p| p.name != **key))
            {
                let advice = format!("list them by `medial methods {id}`");
                return Err(Failure::usage(format!("--set {key}: unknown parameter; {advice}")));
            }
            items.extend(cases.iter().map(|&case| {
                let method = MethodSpec {
                    id: id.to_owned(),
                    name: None,
                    params: params.clone(),
                    fingerprint: entry.fingerprint.clone(),
                };
                let threads = rayon::current_num_threads();
                let limits = study.limits(&here);
                (CheckItem { method, case: case.name.to_owned(), threads, limits }, case)
            }));
        }
        Ok(items)
    }
}
