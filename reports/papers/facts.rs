//! What all records that count say together: values that differ stand side by side.

use std::collections::{BTreeMap, BTreeSet};

use crate::comparison::{Comparison, Entry};
use crate::record::Record;
use crate::text::{grouped, megabytes, significant};

/// The values that occur, each once.
#[derive(Default)]
pub(crate) struct Facts {
    versions: BTreeSet<String>,
    /// The first eight digits of the programs' hashes.
    builds: BTreeSet<String>,
    pub(crate) datasets: BTreeSet<String>,
    pub(crate) samplings: BTreeSet<String>,
    pub(crate) duals: BTreeSet<String>,
    /// Area-uniform samples of the surface.
    pub(crate) samples: BTreeSet<usize>,
    pub(crate) second_limits: BTreeSet<String>,
    pub(crate) byte_limits: BTreeSet<String>,
    pub(crate) threads: BTreeSet<usize>,
    pub(crate) machines: BTreeSet<String>,
    /// By purpose.
    pub(crate) seeds: BTreeMap<String, BTreeSet<u64>>,
    /// Timed repetitions of the runs that led to a result.
    pub(crate) repetitions: BTreeSet<usize>,
    /// Vertices of the meshes, by mesh.
    pub(crate) vertices: BTreeMap<usize, u64>,
    /// Spheres of the initial medial meshes, by mesh and conditions.
    pub(crate) initial: BTreeSet<(usize, u64)>,
    /// Samples on the boundaries of the unions.
    pub(crate) reverse_samples: BTreeSet<usize>,
    /// Widths of the certified intervals, as fractions of the diagonal.
    pub(crate) certified: Vec<f64>,
    /// Results that were measured.
    pub(crate) measured: usize,
    /// Whether there are seconds.
    pub(crate) has_seconds: bool,
}

impl Facts {
    /// Of all records that count.
    pub(crate) fn of(comparison: &Comparison<'_>) -> Self {
        let mut facts = Self::default();
        for entry in &comparison.entries {
            facts.add_run(entry.record);
            facts.add_result(entry);
        }
        facts
    }

    /// What is known of a run whatever became of it.
    fn add_run(&mut self, record: &Record) {
        let known = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        self.versions.extend(known(&record.version));
        let build: String = record.binary_hash.chars().take(8).collect();
        self.builds.extend(known(&build));
        self.datasets.extend(record.dataset.clone());
        self.machines.extend(known(&record.machine.to_string()));
        self.threads.extend(record.simplify.threads);
        for (purpose, &seed) in &record.seeds {
            self.seeds.entry(purpose.clone()).or_default().insert(seed);
        }
        let Some(conditions) = &record.conditions else { return };
        self.samplings.extend(known(&conditions.sampling));
        self.duals.extend(known(&conditions.dual));
        self.samples.extend((conditions.samples > 0).then_some(conditions.samples));
        let limit = conditions.seconds_limit;
        let whole = limit >= 1.0 && limit.fract() == 0.0;
        self.second_limits.insert(if whole {
            grouped(limit as u64)
        } else {
            significant(limit, 3)
        });
        self.byte_limits.insert(megabytes(conditions.bytes_limit));
    }

    fn add_result(&mut self, entry: &Entry<'_>) {
        let record = entry.record;
        self.initial.extend(record.initial.map(|initial| (entry.mesh, initial.spheres)));
        if record.status.has_result() && !record.repetitions.is_empty() {
            self.repetitions.insert(record.repetitions.len());
        }
        self.has_seconds |= record.simplify.seconds.is_some();
        let Some(evaluation) = record.evaluate.as_ref().filter(|_| entry.measured()) else {
            return;
        };
        self.measured += 1;
        self.reverse_samples.insert(evaluation.distances.reverse_samples);
        let certified = evaluation.certified.as_ref();
        self.certified.extend(certified.map(|interval| interval.upper - interval.lower));
        // The samples of a surface are the area-uniform ones and every vertex of a face.
        let uniform = record.conditions.as_ref().map(|conditions| conditions.samples);
        let all = evaluation.distances.samples;
        let vertices = uniform.filter(|&n| n > 0).and_then(|n| all.checked_sub(n));
        self.vertices.extend(vertices.filter(|&n| n > 0).map(|n| (entry.mesh, n as u64)));
    }

    /// `Version 0.1.0`, `Versions 0.1.0 and 0.2.0`.
    pub(crate) fn versions(&self, one: &str, many: &str) -> Option<String> {
        named(&self.versions, one, many)
    }

    /// `build 3f9c0d12`.
    pub(crate) fn builds(&self, one: &str, many: &str) -> Option<String> {
        named(&self.builds, one, many)
    }
}

fn named(values: &BTreeSet<String>, one: &str, many: &str) -> Option<String> {
    let word = if values.len() == 1 { one } else { many };
    (!values.is_empty()).then(|| format!("{word} {}", list(values)))
}

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn list<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    let values: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    match values.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// `12`, `12 to 1,500`; `None` of nothing.
pub(crate) fn span(values: impl IntoIterator<Item = u64>) -> Option<String> {
    let ends = values.into_iter().map(|v| (v, v)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    ends.map(|(low, high)| match low == high {
        true => grouped(low),
        false => format!("{} to {}", grouped(low), grouped(high)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_spans_read_as_text() {
        assert_eq!(list(["a"]), "a");
        assert_eq!(list(["a", "b", "c"]), "a, b and c");
        assert_eq!(span([3400, 15_100, 9]).unwrap(), "9 to 15,100");
        assert_eq!(span([7, 7]).unwrap(), "7");
        assert_eq!(span([]), None);
    }
}
