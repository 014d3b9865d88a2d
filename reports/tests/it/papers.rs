//! What a paper takes over: BibTeX, and the text on the methods.

use std::fs;
use std::path::Path;

use super::common::{SHAPES, comparison, failed, header, ok};
use medial::metrics::{Certificate, Witness, WitnessSide};
use medial_reports::Target;
use medial_reports::{Conditions, Header, Record, Status, write_report};

const METHODS: [&str; 3] = ["qmat", "angle", "tight"];

/// A header with citations of each form that methods have.
fn cited() -> Header {
    let mut header = header(&METHODS);
    let citations = [
        "Pan Li, Bin Wang 2015. Q-MAT: Computing It. ACM Transactions on Graphics 35(1). \
         https://doi.org/10.1145/2753755",
        "Attali, Montanvert 1996, Modeling noise, ICIP, doi:10.1109/ICIP.1996.560357; Foskey, Lin, \
         Manocha 2003, Efficient computation, JCISE 3(4), doi:10.1115/1.1631582",
        "This project; not published, 100 % new_",
    ];
    for (note, citation) in header.methods.iter_mut().zip(citations) {
        note.citation = citation.to_owned();
    }
    header
}

/// The files of a report by name.
struct Report(tempfile::TempDir);

impl Report {
    fn of(records: &[Record], header: &Header) -> Self {
        let folder = tempfile::tempdir().unwrap();
        write_report(folder.path(), records, header).unwrap();
        Self(folder)
    }

    fn text(&self, name: &str) -> String {
        let path: &Path = self.0.path();
        fs::read_to_string(path.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }
}

fn conditions() -> Option<Conditions> {
    Some(Conditions {
        sampling: "vertices".to_owned(),
        dual: "fan".to_owned(),
        samples: 10_000,
        seconds_limit: 300.0,
        bytes_limit: 4_000_000_000,
        fingerprint: None,
    })
}

#[test]
fn each_method_has_entries_under_its_id() {
    let report = Report::of(&comparison(&SHAPES[..2], &METHODS, &[100]), &cited());
    let bib = report.text("tables/methods.bib");
    let keys: Vec<&str> = bib.lines().filter(|line| line.starts_with('@')).collect();
    let expected = [
        "@article{qmat,",
        "@inproceedings{angle,",
        "@article{angle-2,",
        "@misc{tight,",
        "@misc{medial,",
    ];
    assert_eq!(keys, expected);
    assert!(bib.contains("author = {Foskey and Lin and Manocha}"), "{bib}");
    assert!(bib.contains("note = {This project; not published, 100 \\% new\\_}"), "{bib}");
    assert!(bib.contains("note = {Version 0.1.0, build 3f9c0d}"), "{bib}");
    let count = |c: char| bib.chars().filter(|&other| other == c).count();
    assert_eq!(count('{'), count('}'), "{bib}");
}

#[test]
fn methods_that_were_not_run_are_not_cited() {
    let report = Report::of(&comparison(&SHAPES[..2], &METHODS[..1], &[100]), &cited());
    assert!(!report.text("tables/methods.bib").contains("angle"));
    let mut unknown = ok("bear", "vmas", 100, 0, 0);
    unknown.simplify.params.set("k", "0");
    let text = Report::of(&[unknown], &cited()).text("tables/methods.txt");
    assert!(text.contains("One method was run: vmas (no citation is known)."), "{text}");
    assert!(text.contains("Parameters other than the defaults: vmas with k=0."), "{text}");
}

#[test]
fn the_text_says_what_the_records_hold() {
    let mut records = comparison(&SHAPES[..2], &METHODS, &[500, 100]);
    for (index, record) in records.iter_mut().enumerate() {
        record.conditions = conditions();
        if let Some(evaluation) = &mut record.evaluate {
            evaluation.distances.samples = 13_400 + 600 * usize::from(record.mesh == "dolphin");
            let witness = Witness { point: [0.0; 3].into(), on: WitnessSide::Union };
            evaluation.certified = (index < 4).then_some(Certificate {
                lower: 0.01,
                upper: 0.012,
                tolerance: 0.01,
                pieces: 7,
                witness,
            });
        }
    }
    records.push(failed("bear", "qmat", 50, Status::TimedOut, "no result within 300 s"));
    records.last_mut().unwrap().conditions = conditions();
    let report = Report::of(&records, &cited());
    let text = report.text("tables/methods.txt");
    for sentence in [
        "computed with medial, version 0.1.0 (build 3f9c0d) [medial].",
        "3 methods were run: Method qmat [qmat], Method angle [angle, angle-2] and Method tight [tight].",
        "No parameter was changed from its default.",
        "The input was n = 2 meshes, from made-up, of 3,400 to 4,000 vertices: bear and dolphin.",
        "boundary samples were the vertices of each mesh; its Voronoi polygons were cut into \
         triangles as fans; it had 12,000 to 13,000 spheres.",
        "Results were asked for at 500, 100 and 50 spheres.",
        "Of n = 13 runs of a method on a mesh at a level, 12 gave what was asked; 1 reached the time limit.",
        "10,000 area-uniform samples and all vertices of the surface and over 48,000 samples",
        "For n = 4 of 12 results an interval that holds the error was certified, at most 0.20 % of",
        "Seeds of random choices: 7 (evaluation), 1 (method).",
        "each run was timed once; methods were given 1 thread.",
        "Machine: Example 9000, 2 cores, 8,000 MB, Linux x86_64.",
        "Limits: 300 s, 4,000 MB of memory.",
    ] {
        assert!(text.contains(sentence), "{sentence}\n{text}");
    }
    assert!(!text.contains("Not in the records"), "{text}");
    let latex = report.text("tables/methods.tex");
    assert!(latex.contains("Method angle~\\cite{angle,angle-2}"), "{latex}");
    assert!(latex.contains("0.20 \\% of the diagonal"), "{latex}");
}

#[test]
fn what_the_records_do_not_hold_is_named_and_not_said() {
    let mut record = ok("bear", "qmat", 100, 0, 0);
    (record.dataset, record.version) = (None, String::new());
    record.machine = medial_reports::Machine::default();
    record.simplify.level = Target::MaxError(0.005);
    let text = Report::of(&[record], &Header::default()).text("tables/methods.txt");
    let missing = text.lines().last().unwrap();
    for what in ["the version", "where the meshes come from", "vertices", "samples", "the machine"]
    {
        assert!(missing.contains(what), "{what}: {text}");
    }
    for absent in ["version 0", "Machine", "Limits", "certified", " vertices:", "fans"] {
        assert!(!text.contains(absent), "{absent}: {text}");
    }
    assert!(text.contains("within a Hausdorff error of 0.5 % of the diagonal."), "{text}");
}

#[test]
fn the_page_holds_the_files_as_they_are() {
    let records = comparison(&SHAPES[..2], &METHODS, &[100]);
    let report = Report::of(&records, &cited());
    let page = report.text("index.html");
    assert!(page.contains("<section id=\"papers\">") && page.contains("href=\"#papers\""));
    for name in ["tables/methods.txt", "tables/methods.tex", "tables/methods.bib"] {
        let lines = report.text(name);
        let lines: Vec<&str> = lines.lines().collect();
        // Without what HTML escapes.
        let plain = |line: &&&str| !line.contains(['&', '<', '>', '"', '\'']);
        assert!(lines.iter().filter(plain).all(|line| page.contains(*line)), "{name}");
        assert!(page.contains(&format!("href=\"./{name}\"")), "{name}");
    }
    assert!(page.contains("What each method is for") && page.contains("qmat is made up."));
    let nothing = Report::of(&[], &cited());
    assert!(!nothing.text("index.html").contains("id=\"papers\""));
}
