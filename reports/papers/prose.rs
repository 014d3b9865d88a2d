//! How the results were made, in sentences to be pasted into a paper.

use std::collections::BTreeSet;

use crate::Target;

use crate::comparison::Comparison;
use crate::header::Header;
use crate::papers::bibtex::Bibliography;
use crate::papers::facts::{Facts, list, span};
use crate::record::Status;
use crate::tables::escape_latex;
use crate::text::{counted, grouped, printable, significant};

/// More names of meshes than these are not listed.
const NAMED_MESHES: usize = 24;

/// Paragraphs, and what no record tells.
pub(crate) struct Prose {
    paragraphs: Vec<Vec<Piece>>,
    missing: Vec<&'static str>,
}

/// A piece of a paragraph.
enum Piece {
    Words(String),
    /// Keys of citations.
    Cite(Vec<String>),
}

impl Prose {
    /// From the header and the records that count, of which there is one at least.
    pub(crate) fn of(
        header: &Header,
        comparison: &Comparison<'_>,
        facts: &Facts,
        bibliography: &Bibliography,
    ) -> Self {
        let mut runs = program(facts, bibliography);
        runs.extend(methods(header, comparison, bibliography));
        let mut sentences = vec![parameters(comparison), meshes(comparison, facts)];
        sentences.extend(initial(comparison, facts));
        sentences.extend(levels(comparison));
        sentences.push(outcomes(comparison));
        runs.push(Piece::Words(format!(" {}", sentences.join(" "))));

        let measuring = [errors(facts), certificates(facts), seeds(facts), times(facts)];
        let machine = [machines(facts), limits(facts)];
        let measuring: Vec<String> = measuring.into_iter().chain(machine).flatten().collect();
        let mut paragraphs = vec![runs];
        if !measuring.is_empty() {
            paragraphs.push(vec![Piece::Words(measuring.join(" "))]);
        }
        Self { paragraphs, missing: missing(comparison, facts) }
    }

    /// Plain text; keys of citations in brackets.
    pub(crate) fn to_text(&self) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Words(words) => printable(words),
            Piece::Cite(keys) => format!(" [{}]", keys.join(", ")),
        };
        let mut text = self.paragraphs(piece);
        if !self.missing.is_empty() {
            let missing = self.missing.join("; ");
            text.push_str(&format!("\nNot in the records, to be added by hand: {missing}.\n"));
        }
        text
    }

    /// LaTeX that needs no package; what is missing stands in a comment.
    pub(crate) fn to_latex(&self) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Words(words) => escape_latex(words),
            Piece::Cite(keys) => format!("~\\cite{{{}}}", keys.join(",")),
        };
        let mut text =
            String::from("% The keys are those of methods.bib: \\bibliography{methods}\n");
        if !self.missing.is_empty() {
            let missing = self.missing.join("; ");
            text.push_str(&format!("% Not in the records, to be added by hand: {missing}.\n"));
        }
        text + &self.paragraphs(piece)
    }

    fn paragraphs(&self, write: impl Fn(&Piece) -> String) -> String {
        let paragraph = |pieces: &Vec<Piece>| pieces.iter().map(&write).collect::<String>() + "\n";
        self.paragraphs.iter().map(paragraph).collect::<Vec<_>>().join("\n")
    }
}

/// The program, its version and its build.
fn program(facts: &Facts, bibliography: &Bibliography) -> Vec<Piece> {
    let mut text = String::from("All results were computed with medial");
    if let Some(version) = facts.versions("version", "versions") {
        text.push_str(&format!(", {version}"));
    }
    if let Some(build) = facts.builds("build", "builds") {
        text.push_str(&format!(" ({build})"));
    }
    let cite = Piece::Cite(vec![bibliography.program.clone()]);
    vec![Piece::Words(text), cite, Piece::Words(".".to_owned())]
}

/// The methods with their citations, in the order of the header; those that it does not know last.
fn methods(
    header: &Header,
    comparison: &Comparison<'_>,
    bibliography: &Bibliography,
) -> Vec<Piece> {
    let ran = |id: &str| comparison.methods.contains(&id);
    let noted = header.methods.iter().filter(|note| ran(&note.id));
    let mut all: Vec<(&str, &str)> =
        noted.map(|note| (note.id.as_str(), note.title.as_str())).collect();
    for &id in &comparison.methods {
        if !all.iter().any(|(known, _)| *known == id) {
            all.push((id, id));
        }
    }
    let begin = match all.len() {
        1 => " One method was run: ".to_owned(),
        many => format!(" {many} methods were run: "),
    };
    let mut pieces = vec![Piece::Words(begin)];
    for (index, (id, title)) in all.iter().enumerate() {
        let before = match index {
            0 => "",
            _ if index + 1 == all.len() => " and ",
            _ => ", ",
        };
        let keys = bibliography.keys(id);
        let title = if title.is_empty() { id } else { title };
        let after = if keys.is_empty() { " (no citation is known)" } else { "" };
        pieces.push(Piece::Words(format!("{before}{title}{after}")));
        if !keys.is_empty() {
            pieces.push(Piece::Cite(keys.to_vec()));
        }
    }
    pieces.push(Piece::Words(".".to_owned()));
    pieces
}

/// Which parameters were set.
fn parameters(comparison: &Comparison<'_>) -> String {
    let mut set = BTreeSet::new();
    for entry in &comparison.entries {
        let simplify = &entry.record.simplify;
        let params: BTreeSet<String> = (simplify.params.0.iter())
            .map(|(key, value)| format!("{key}={}", value.to_string().trim_matches('"')))
            .collect();
        if !params.is_empty() {
            let params: Vec<String> = params.into_iter().collect();
            set.insert(format!("{} with {}", simplify.method, params.join(", ")));
        }
    }
    match set.is_empty() {
        true => "No parameter was changed from its default.".to_owned(),
        false => {
            let set: Vec<String> = set.into_iter().collect();
            format!("Parameters other than the defaults: {}.", set.join("; "))
        }
    }
}

fn meshes(comparison: &Comparison<'_>, facts: &Facts) -> String {
    let count = comparison.meshes.len();
    let mut text = format!("The input was n = {}", counted(count, "mesh", "meshes"));
    if !facts.datasets.is_empty() {
        text.push_str(&format!(", from {}", list(&facts.datasets)));
    }
    if let Some(vertices) = span(facts.vertices.values().copied()) {
        let known = match facts.vertices.len() {
            known if known == count => String::new(),
            known => format!(" (known of n = {known})"),
        };
        text.push_str(&format!(", of {vertices} vertices{known}"));
    }
    if count <= NAMED_MESHES {
        text.push_str(&format!(": {}", list(&comparison.meshes)));
    }
    text + "."
}

/// Samples, polygons and sizes of the initial medial meshes.
fn initial(comparison: &Comparison<'_>, facts: &Facts) -> Option<String> {
    let mut parts = Vec::new();
    if !facts.samplings.is_empty() {
        let samples = list(facts.samplings.iter().map(|sampling| samples_in_words(sampling)));
        parts.push(format!("boundary samples were {samples}"));
    }
    if !facts.duals.is_empty() {
        let duals = list(facts.duals.iter().map(|dual| dual_in_words(dual)));
        parts.push(format!("its Voronoi polygons were cut into triangles {duals}"));
    }
    if let Some(spheres) = span(facts.initial.iter().map(|&(_, spheres)| spheres)) {
        let meshes: BTreeSet<usize> = facts.initial.iter().map(|&(mesh, _)| mesh).collect();
        let of = match meshes.len() {
            known if known == comparison.meshes.len() => String::new(),
            known => format!(" (known of n = {})", counted(known, "mesh", "meshes")),
        };
        parts.push(format!("it had {spheres} spheres{of}"));
    }
    // Not each method starts from it.
    let start = "The initial medial mesh that all methods were offered was the part of the \
                 samples' Voronoi diagram whose vertices are inside the solid";
    (!parts.is_empty()).then(|| format!("{start}: {}.", parts.join("; ")))
}

/// A sampling in words, as far as this version knows it.
fn samples_in_words(sampling: &str) -> String {
    let mut parts = sampling.split(':');
    let kind = parts.next().unwrap_or_default();
    let count = parts.next().and_then(|count| count.parse().ok()).map(grouped);
    let seed = parts.next().map_or(String::new(), |seed| format!(" (seed {seed})"));
    match (kind, count) {
        ("vertices", None) => "the vertices of each mesh".to_owned(),
        ("auto", None) => {
            "the vertices of each mesh, and further ones where the medial mesh failed".to_owned()
        }
        ("uniform", Some(count)) => format!("{count} area-uniform points{seed}"),
        ("blue", Some(count)) => format!("{count} points of blue noise{seed}"),
        _ => format!("those of the sampling \"{sampling}\""),
    }
}

fn dual_in_words(dual: &str) -> String {
    match dual {
        "fan" => "as fans".to_owned(),
        "delaunay" => "by planar Delaunay triangulation".to_owned(),
        other => format!("by the rule \"{other}\""),
    }
}

/// What was asked of the methods.
fn levels(comparison: &Comparison<'_>) -> Option<String> {
    let levels = || comparison.levels.iter();
    let counts: Vec<String> = comparison.counts().map(|(_, n)| grouped(n as u64)).collect();
    let bounds: Vec<String> = levels()
        .filter_map(|level| match level {
            Target::MaxError(bound) => Some(significant_percent(*bound)),
            _ => None,
        })
        .collect();
    let mut asked = Vec::new();
    if !counts.is_empty() {
        asked.push(format!("at {} spheres", list(&counts)));
    }
    if !bounds.is_empty() {
        asked.push(format!(
            "with the fewest spheres within a Hausdorff error of {} % of the diagonal",
            list(&bounds)
        ));
    }
    if levels().any(|level| matches!(level, Target::Published)) {
        asked.push("at published levels".to_owned());
    }
    if levels().any(|level| matches!(level, Target::Native(_))) {
        asked.push("at levels of the methods' own".to_owned());
    }
    let reached = match counts.is_empty() {
        true => "",
        false => " A number of spheres counts as reached when the result has it to within 2 %.",
    };
    (!asked.is_empty()).then(|| format!("Results were asked for {}.{reached}", list(&asked)))
}

/// A fraction in per cent, without zeros at its end.
fn significant_percent(fraction: f64) -> String {
    let text = significant(100.0 * fraction, 3);
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// How many runs gave what was asked, and what became of the others.
fn outcomes(comparison: &Comparison<'_>) -> String {
    let runs = comparison.entries.len();
    let ok = comparison.statuses().iter().filter(|(status, _)| status.is_ok()).map(|s| s.1).sum();
    let of = format!("Of n = {} of a method on a mesh at a level,", counted(runs, "run", "runs"));
    let mut parts = vec![match ok {
        0 => "none gave what was asked".to_owned(),
        ok if ok == runs => "all gave what was asked".to_owned(),
        ok => format!("{} gave what was asked", grouped(ok as u64)),
    }];
    for (status, count) in comparison.statuses() {
        parts.extend(fate(status).map(|fate| format!("{} {fate}", grouped(count as u64))));
    }
    let unmeasured = (comparison.entries.iter())
        .filter(|entry| entry.record.status.has_result() && !entry.measured())
        .count();
    if unmeasured > 0 {
        parts.push(format!("{} of the results had no evaluation", grouped(unmeasured as u64)));
    }
    format!("{of} {}.", parts.join("; "))
}

/// What became of runs that did not give what was asked.
fn fate(status: Status) -> Option<&'static str> {
    Some(match status {
        Status::Ok | Status::AsGiven => return None,
        Status::OtherCount => "gave another number of spheres",
        Status::BoundMissed => "found no level within the bound",
        Status::Unsupported => "asked for what the method does not do",
        Status::Refused => "had their input refused",
        Status::Failed => "ended in an error",
        Status::Panicked => "crashed",
        Status::TimedOut => "reached the time limit",
        Status::OutOfMemory => "reached the memory limit",
        Status::InvalidOutput => "gave no valid medial mesh",
    })
}

/// How the error was measured.
fn errors(facts: &Facts) -> Option<String> {
    if facts.measured == 0 {
        return None;
    }
    let surface = match facts.samples.is_empty() {
        true => "samples of the surface".to_owned(),
        false => {
            let samples = list(facts.samples.iter().map(|&samples| grouped(samples as u64)));
            format!("{samples} area-uniform samples and all vertices of the surface")
        }
    };
    let union = span(facts.reverse_samples.iter().map(|&samples| samples as u64));
    let union = union.map_or_else(|| "samples".to_owned(), |samples| format!("{samples} samples"));
    Some(format!(
        "The error is the two-sided Hausdorff distance between the surface and the boundary of the \
         union of all spheres, cones and slabs, in % of the diagonal of the bounding box: the larger of \
         the maxima over {surface} and over {union} on that boundary, each sought further by local \
         ascent from the largest samples (n = {}).",
        counted(facts.measured, "result", "results")
    ))
}

fn certificates(facts: &Facts) -> Option<String> {
    let widest = facts.certified.iter().copied().reduce(f64::max)?;
    Some(format!(
        "For n = {} of {} an interval that holds the error was certified, at most {} % of the diagonal \
         wide.",
        grouped(facts.certified.len() as u64),
        counted(facts.measured, "result", "results"),
        significant(100.0 * widest, 2)
    ))
}

fn seeds(facts: &Facts) -> Option<String> {
    let of = |(purpose, seeds): (&String, &BTreeSet<u64>)| format!("{} ({purpose})", list(seeds));
    let seeds: Vec<String> = facts.seeds.iter().map(of).collect();
    (!seeds.is_empty()).then(|| format!("Seeds of random choices: {}.", seeds.join(", ")))
}

/// Repetitions and threads.
fn times(facts: &Facts) -> Option<String> {
    if !facts.has_seconds {
        return None;
    }
    let mut text = "Seconds include the substrates that methods share, for each method that uses \
                    them"
        .to_owned();
    let most = facts.repetitions.last().copied().unwrap_or(0);
    if most == 1 {
        text.push_str("; each run was timed once");
    } else if let Some(times) = span(facts.repetitions.iter().map(|&n| n as u64)) {
        text.push_str(&format!(
            "; each run was made {times} times, and the repetition with the median total counts"
        ));
    }
    if !facts.threads.is_empty() {
        let word = if facts.threads.iter().eq([&1]) { "thread" } else { "threads" };
        text.push_str(&format!("; methods were given {} {word}", list(&facts.threads)));
    }
    Some(text + ".")
}

fn machines(facts: &Facts) -> Option<String> {
    let word = if facts.machines.len() == 1 { "Machine" } else { "Machines" };
    let machines: Vec<&str> = facts.machines.iter().map(String::as_str).collect();
    (!machines.is_empty()).then(|| format!("{word}: {}.", machines.join("; ")))
}

fn limits(facts: &Facts) -> Option<String> {
    let (seconds, bytes) = (&facts.second_limits, &facts.byte_limits);
    (!seconds.is_empty())
        .then(|| format!("Limits: {} s, {} MB of memory.", list(seconds), list(bytes)))
}

/// What a reader of the text will ask for and no record holds.
fn missing(comparison: &Comparison<'_>, facts: &Facts) -> Vec<&'static str> {
    let no_source = comparison.entries.iter().any(|entry| entry.record.dataset.is_none());
    let all = [
        (facts.versions("", "").is_none(), "the version of the program"),
        (no_source, "where the meshes come from"),
        (facts.vertices.len() < comparison.meshes.len(), "the numbers of vertices of all meshes"),
        (facts.samplings.is_empty(), "the boundary samples of the initial medial mesh"),
        (facts.samples.is_empty(), "the number of samples of the error"),
        (facts.threads.is_empty(), "the number of threads"),
        (facts.machines.is_empty(), "the machine"),
    ];
    all.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, what)| what).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samplings_are_told_in_words() {
        assert_eq!(samples_in_words("vertices"), "the vertices of each mesh");
        assert_eq!(samples_in_words("uniform:30000"), "30,000 area-uniform points");
        assert_eq!(samples_in_words("blue:500:7"), "500 points of blue noise (seed 7)");
        assert_eq!(samples_in_words("new:x"), "those of the sampling \"new:x\"");
    }

    #[test]
    fn percentages_have_no_idle_zeros() {
        for (fraction, text) in
            [(0.02, "2"), (0.005, "0.5"), (0.002, "0.2"), (0.1, "10"), (1.0, "100")]
        {
            assert_eq!(significant_percent(fraction), text);
        }
    }
}
