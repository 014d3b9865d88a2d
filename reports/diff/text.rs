//! A difference as Markdown: the summary line first, then the evidence.

use std::collections::{BTreeMap, BTreeSet};

use medial_run::text::{counted, significant};
use serde_json::Value;

use super::results::MEMORY;
use super::{Change, Diff, ItemName, LEAST_SLOWDOWN, Meaning, Unlike};
use crate::metric::METRICS;
use crate::tables::{Cell, Table, escape, to_markdown};

/// Names of missing results in a sentence.
const MOST_NAMES: usize = 5;

impl Diff {
    /// The difference as Markdown, for a pull request.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("{}\n\n{}\n\n", heading(self), sides(self));
        for (meaning, caption) in [
            (Meaning::Regression, "Worse"),
            (Meaning::Improvement, "Better"),
            (Meaning::Changed, "Changed otherwise"),
        ] {
            let changes: Vec<&Change> =
                self.changes.iter().filter(|change| change.meaning == meaning).collect();
            if !changes.is_empty() {
                text += &format!("{}\n", to_markdown(&change_table(caption, &changes)));
            }
        }
        if !self.timings.is_empty() {
            text += &format!("{}\n", to_markdown(&timing_table(self)));
        }
        for why in &self.untimed {
            text += &format!("Not compared: {}.\n\n", escape(why));
        }
        let only = [(&self.missing, "only in the older"), (&self.added, "only in the newer")];
        for (names, what) in only.into_iter().filter(|(names, _)| !names.is_empty()) {
            text += &format!("{}: {}.\n\n", results(names.len(), what), listed(names));
        }
        text + &unlike(&self.unlike)
    }
}

fn heading(diff: &Diff) -> String {
    let worse = diff.changes.iter().filter(|change| change.meaning == Meaning::Regression);
    let slower = diff.timings.iter().filter(|timing| timing.meaning == Some(Meaning::Regression));
    let slower = slower.map(|timing| (timing.method.clone(), timing.mesh.clone(), timing.ratio));
    let summary = match headline(&worse.collect::<Vec<_>>(), slower.collect(), &diff.meshes) {
        Some(summary) => summary,
        None if diff.compared == 0 => "Nothing could be compared".to_owned(),
        None => "No regression".to_owned(),
    };
    let [worse, better, changed] = [Meaning::Regression, Meaning::Improvement, Meaning::Changed]
        .map(|meaning| diff.count(meaning));
    let missing = match diff.missing.len() {
        0 => String::new(),
        count => format!("; {} missing in the newer", counted(count, "result", "results")),
    };
    format!(
        "# {}\n\n{}, {}, {} among {}{missing}.",
        escape(&summary),
        counted(worse, "regression", "regressions"),
        counted(better, "improvement", "improvements"),
        counted(changed, "result changed otherwise", "results changed otherwise"),
        counted(diff.compared, "result", "results"),
    )
}

/// A sentence on changes for the worse, and on slower methods as method, mesh and ratio of seconds; `None` without any.
/// `meshes` has the number of compared meshes of each method.
pub(crate) fn headline(
    worse: &[&Change],
    slower: Vec<(String, Option<String>, f64)>,
    meshes: &BTreeMap<String, usize>,
) -> Option<String> {
    let mut clauses = vec![];
    let mut of_methods: BTreeMap<&str, Vec<&Change>> = BTreeMap::new();
    for &change in worse {
        of_methods.entry(&change.item.method).or_default().push(change);
    }
    for (method, changes) in of_methods {
        let of = |what: &str| -> Vec<&Change> {
            changes.iter().copied().filter(|change| change.what == what).collect()
        };
        // The quantity that matters most, in words.
        let first = ["status", "evaluate.betti", "evaluate.hausdorff"].into_iter();
        let what = first.chain([changes[0].what.as_str()]).find(|what| !of(what).is_empty())?;
        let word = match what {
            "status" => "result lost".to_owned(),
            "evaluate.betti" => "topology lost".to_owned(),
            _ => format!("{}{}", word(what), range(&of(what))),
        };
        let on: BTreeSet<&str> = changes.iter().map(|change| &*change.item.mesh).collect();
        let all = meshes.get(method).copied().unwrap_or(on.len());
        let all = counted(all, "mesh", "meshes");
        clauses.push(format!("{method} worse on {} of {all}, {word}", on.len()));
    }
    let mut times: BTreeMap<String, (Option<String>, f64)> = BTreeMap::new();
    for (method, mesh, ratio) in slower {
        let largest = times.entry(method).or_insert((mesh.clone(), ratio));
        // The row over all meshes represents its method.
        if largest.0.is_some() && (mesh.is_none() || ratio > largest.1) {
            *largest = (mesh, ratio);
        }
    }
    for (method, (mesh, ratio)) in times {
        let on = mesh.map_or_else(String::new, |mesh| format!(" on {mesh}"));
        clauses.push(match ratio {
            2.0.. => format!("{method} {ratio:.1} times slower{on}"),
            _ => format!("{method} {:.0} % slower{on}", 100.0 * (ratio - 1.0)),
        });
    }
    (!clauses.is_empty()).then(|| clauses.join("; "))
}

/// The name of a quantity in a sentence.
fn word(what: &str) -> String {
    let path = what.strip_prefix("evaluate.").unwrap_or(what);
    let metric = METRICS.iter().find(|metric| metric.path == path);
    match metric {
        Some(metric) => metric.title.to_owned(),
        None if what == MEMORY => "memory".to_owned(),
        None => what.rsplit('.').next().unwrap_or(what).to_owned(),
    }
}

/// The least and largest relative change: ` +10 to +68 %`.
fn range(changes: &[&Change]) -> String {
    let shares = changes.iter().filter_map(|change| change.relative);
    let mut shares: Vec<String> = {
        let mut sorted: Vec<f64> = shares.collect();
        sorted.sort_by(f64::total_cmp);
        let ends = sorted.first().into_iter().chain(sorted.last());
        ends.map(|share| format!("{:+}", significant(100.0 * share, 2).parse().unwrap_or(0.0_f64)))
            .collect()
    };
    shares.dedup();
    if shares.is_empty() { String::new() } else { format!(" {} %", shares.join(" to ")) }
}

/// Both sets: name, builds, machines.
fn sides(diff: &Diff) -> String {
    let lines = diff.sides.iter().zip(["old", "new"]).map(|(side, which)| {
        let builds: Vec<String> = side.builds.iter().map(|hash| format!("{hash:.12}")).collect();
        let [versions, machines] = [&side.versions, &side.machines]
            .map(|set| escape(&set.iter().map(String::as_str).collect::<Vec<_>>().join(", ")));
        let (name, builds) = (escape(&side.name), builds.join(", "));
        format!("- {which}: {name}, version {versions}, build {builds}, on {machines}")
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn change_table(caption: &str, changes: &[&Change]) -> Table {
    Table::of_changes(caption, changes, |rows| {
        rows.text("mesh", |change| change.item.mesh.clone())
            .text("method", |change| change.item.method.clone())
            .text("level", |change| change.item.level.clone())
            .text("what", |change| change.what.clone())
            .text("old", |change| shown(&change.old))
            .text("new", |change| shown(&change.new))
            .text("change", |change| {
                change.relative.map(|share| format!("{:+.2} %", 100.0 * share))
            })
    })
}

pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(), // appeared or vanished
        Value::String(text) => format!("{text:.16}"),
        Value::Number(number) if number.is_f64() => significant(number.as_f64().unwrap_or(0.0), 6),
        other => format!("{:.48}", other.to_string()),
    }
}

fn timing_table(diff: &Diff) -> Table {
    let rows = Table::of(&diff.timings)
        .text("method", |timing| timing.method.clone())
        .text("mesh", |timing| timing.mesh.clone().unwrap_or_else(|| "all".to_owned()))
        .text("results × repetitions", |t| format!("{} × {}", t.results, t.repetitions))
        .text("new ÷ old", |timing| format!("{:.3}", timing.ratio))
        .text("99 % interval", |t| format!("{:.3} to {:.3}", t.interval[0], t.interval[1]))
        .text("agree", |timing| format!("{:.0} %", 100.0 * timing.agreement))
        .text("", |timing| match timing.meaning {
            Some(Meaning::Regression) => Cell { best: true, ..Cell::from("slower") },
            Some(Meaning::Improvement) => Cell { best: true, ..Cell::from("faster") },
            _ => Cell::from(""),
        });
    let together = match diff.alternating {
        true => "Both builds ran alternately.",
        false => {
            "The two did not run alternately: a machine that was busier on one of the two occasions looks like a \
             slower program (`medial diff --run` runs both in turn)."
        }
    };
    let note = format!(
        "The methods' own seconds, without shared substrates. Slower or faster: the whole interval is beyond {:.0} % of \
         CPU seconds ({:.0} % on a single mesh), the fastest repetitions differ by as much, and nine of ten repetitions \
         agree. All intervals hold together with a probability of 99 %. {together}",
        100.0 * LEAST_SLOWDOWN,
        200.0 * LEAST_SLOWDOWN // one mesh has fewer results to average
    );
    Table { caption: "Seconds".to_owned(), notes: vec![note], ..rows.table }
}

fn results(count: usize, what: &str) -> String {
    format!("{} {what}", counted(count, "result", "results"))
}

fn listed(names: &[ItemName]) -> String {
    let first = names.iter().take(MOST_NAMES);
    let mut all: Vec<String> = first
        .map(|ItemName { mesh, method, level }| format!("{mesh} / {method} / {level}"))
        .collect();
    if names.len() > MOST_NAMES {
        all.push(format!("and {} more", names.len() - MOST_NAMES));
    }
    escape(&all.join(", "))
}

/// Why results cannot be compared, each reason once.
fn unlike(unlike: &[Unlike]) -> String {
    let mut reasons: Vec<&str> = unlike.iter().map(|unlike| unlike.why.as_str()).collect();
    reasons.sort_unstable(); // equal reasons become neighbours
    reasons.dedup();
    let mut text = String::new();
    for why in reasons {
        let names: Vec<ItemName> =
            unlike.iter().filter(|u| u.why == why).map(|u| u.item.clone()).collect();
        let count = results(names.len(), "not compared");
        text.push_str(&format!("{count} ({}): {}.\n\n", escape(why), listed(&names)));
    }
    text
}
