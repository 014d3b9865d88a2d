//! A report as a whole: its files, its numbers, its protection against hostile names.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use medial_reports::{picture_strips, read_header, summary_text, write_report, write_site};
use medial_run::record::{Record, Repetition, Stages, Status};

use super::common::{SHAPES, comparison, documents, failed, header, ok};

const METHODS: [&str; 3] = ["qmat", "angle", "lambda"];
const COUNTS: [usize; 3] = [500, 200, 100];

/// Every file below a folder, by relative path.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                all.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    all
}

fn report_of(records: &[Record]) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let written = write_report(folder.path(), records, &header(&METHODS)).unwrap();
    let all = files(folder.path());
    assert_eq!(written.len(), all.len(), "write_report returns every file of the folder");
    assert_eq!(written.last(), Some(&folder.path().join("index.html")));
    all
}

fn text<'a>(files: &'a BTreeMap<String, Vec<u8>>, name: &str) -> &'a str {
    std::str::from_utf8(&files[name]).unwrap()
}

/// The heads and the rows of `results.csv`.
fn csv_of(records: &[Record]) -> (csv::StringRecord, Vec<csv::StringRecord>) {
    let files = report_of(records);
    let mut reader = csv::Reader::from_reader(&files["results.csv"][..]);
    (reader.headers().unwrap().clone(), reader.records().map(Result::unwrap).collect())
}

#[test]
fn the_same_records_give_the_same_bytes() {
    let records = comparison(&SHAPES[..4], &METHODS, &COUNTS);
    let files = report_of(&records);
    assert_eq!(files, report_of(&records));
    for name in ["results.csv", "header.json", "tables/summary.md", "tables/summary.tex"] {
        assert!(!files[name].is_empty(), "{name}");
    }
    for mesh in &SHAPES[..4] {
        assert!(files.contains_key(&format!("tables/mesh-{mesh}.md")), "{mesh}");
    }
    let plots: Vec<&String> = files.keys().filter(|name| name.ends_with(".svg")).collect();
    assert!(plots.len() > 4, "{plots:?}");
    for plot in plots {
        assert!(text(&files, plot).trim_end().ends_with("</svg>"), "{plot} is cut off");
    }
}

#[test]
fn repeated_times_have_their_spread_beside_them() {
    let mut records = comparison(&SHAPES[..1], &METHODS, &COUNTS);
    assert!(!summary_text(&records).contains("spread"));
    for record in &mut records {
        let median = record.simplify.seconds.unwrap();
        record.repetitions = [0.9, 1.0, 1.5]
            .map(|factor| Repetition {
                seconds: Stages { total: factor * median.total, ..median },
                cpu_seconds: median,
            })
            .to_vec();
    }
    let text = summary_text(&records);
    let rows: Vec<&str> = text.lines().collect();
    assert!(rows[1].contains("seconds  spread %"), "{text}");
    assert!(rows[2..4].iter().all(|row| row.contains("  60.0")), "{text}");
    let files = report_of(&records);
    let table = std::str::from_utf8(&files["tables/mesh-bear.md"]).unwrap();
    assert!(table.contains("spread of times (%)") && table.contains("| 60.0 |"), "{table}");
}

#[test]
fn disturbed_seconds_are_excluded_from_tables() {
    let alone = comparison(&SHAPES[..2], &METHODS, &COUNTS);
    let mut disturbed = alone.clone();
    for record in &mut disturbed {
        record.conditions.jobs = 2;
    }
    let seconds = |records: &[Record]| -> Vec<String> {
        let (names, rows) = csv_of(records);
        let place = names.iter().position(|name| name == "seconds_total").unwrap();
        rows.iter().map(|row| row[place].to_owned()).collect()
    };
    assert!(seconds(&alone).iter().all(|cell| !cell.is_empty()));
    assert!(seconds(&disturbed).iter().all(String::is_empty));
    let times = |records: &[Record]| -> Vec<String> {
        let files = report_of(records);
        let mut rows =
            text(&files, "tables/summary.md").lines().filter(|row| row.starts_with("| "));
        let heads = rows.find(|row| row.contains("time (s)")).unwrap();
        let place = heads.split('|').position(|head| head.contains("time (s)")).unwrap();
        let cells = rows.skip(1).map(|row| row.split('|').nth(place).unwrap());
        cells.take(METHODS.len()).map(|cell| cell.trim().to_owned()).collect()
    };
    assert!(times(&alone).iter().all(|cell| cell != "–"), "{:?}", times(&alone));
    assert!(times(&disturbed).iter().all(|cell| cell == "–"), "{:?}", times(&disturbed));
}

#[test]
fn every_record_is_a_row_of_the_csv_with_its_numbers() {
    let records = comparison(&SHAPES[..6], &METHODS, &COUNTS);
    let (names, rows) = csv_of(&records);
    let column =
        |name: &str| names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}"));
    let columns = ["mesh", "method", "status", "hausdorff"].map(column);
    let mut found: Vec<[String; 4]> =
        rows.iter().map(|row| columns.map(|k| row[k].to_owned())).collect();
    let mut expected: Vec<[String; 4]> = (records.iter())
        .map(|r| {
            let error = r.evaluate.as_ref().map(|e| e.distances.hausdorff.to_string());
            let (mesh, method) = (r.mesh.clone(), r.simplify.method.clone());
            [mesh, method, r.status.key(), error.unwrap_or_default()]
        })
        .collect();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert!(found.iter().any(|row| row[2] == "panicked" && row[3].is_empty()));
}

#[test]
fn no_method_gains_by_failing() {
    // Both are equal where both have a result; one fails on the mesh that is hard for the other.
    let files = report_of(&[
        with_error(ok("easy", "qmat", 100, 0, 0), 0.0123),
        with_error(ok("hard", "qmat", 100, 1, 0), 0.5),
        with_error(ok("easy", "angle", 100, 0, 0), 0.0123),
        failed("hard", "angle", 100, Status::Panicked, "index out of bounds"),
    ]);
    let summary = text(&files, "tables/summary.md");
    let row = |method: &str| {
        let mut rows = summary.lines().filter(|line| line.contains(&format!("| {method} |")));
        rows.next().unwrap_or_else(|| panic!("{method}: {summary}")).to_owned()
    };
    // Equal where both have a result, as the ratio shows; its mean over fewer meshes is marked.
    assert!(row("angle").contains("| 1.00 | 1 mesh |"), "{}", row("angle"));
    assert!(row("angle").contains("(1.23)") && row("angle").contains("1 of 2"));
    assert!(row("qmat").contains("7.84") && row("qmat").contains("2 of 2"));
    let [_, bulk] = documents(text(&files, "index.html"));
    assert!(bulk["columns"]["item/reason"].to_string().contains("index out of bounds"));
}

/// A method's row of the summary, without the marks of the best.
fn summary_rows(records: &[Record], method: &str) -> Vec<String> {
    let files = report_of(records);
    let rows = text(&files, "tables/summary.md").lines();
    let rows = rows.filter(|line| line.contains(&format!("| {method} |")));
    rows.map(|line| line.replace('*', "")).collect()
}

#[test]
fn a_further_method_changes_no_number_of_the_others() {
    let before = comparison(&SHAPES[..6], &["qmat", "angle"], &COUNTS);
    let mut after = before.clone();
    for (index, mesh) in SHAPES[..6].iter().enumerate() {
        for count in COUNTS {
            // A weak one: off its count on most meshes, failed on one.
            let mut weak = ok(mesh, "weak", count, index, 9);
            match index {
                0 => weak.simplify.reached = Some(count),
                1 => weak = failed(mesh, "weak", count, Status::Panicked, "no"),
                _ => {
                    weak.status = Status::OtherCount;
                    weak.simplify.reached = Some(3 * count);
                }
            }
            after.push(weak);
        }
    }
    for method in ["qmat", "angle"] {
        let rows = summary_rows(&before, method);
        assert_eq!(rows.len(), COUNTS.len(), "{rows:?}");
        assert_eq!(rows, summary_rows(&after, method));
    }
}

#[test]
fn a_curve_is_over_one_set_of_meshes() {
    // The hard mesh is reached at the smaller count alone.
    let mut records = vec![];
    for (count, meshes) in [(500, &["a", "b"][..]), (100, &["a", "b", "hard"][..])] {
        for (shape, mesh) in meshes.iter().enumerate() {
            records.push(ok(mesh, "qmat", count, shape, 0));
        }
    }
    records.push(failed("hard", "qmat", 500, Status::TimedOut, "no result within 300 s"));
    let rows = summary_rows(&records, "qmat");
    assert!(rows[0].contains("| 2 of 3 |") && rows[1].contains("| 2 of 3 |"), "{rows:?}");
}

/// A result without a triangle has no angle: the mean angle is over the others, with their number.
#[test]
fn missing_values_are_excluded_from_means() {
    let mut records = vec![];
    for (shape, mesh) in SHAPES[..4].iter().enumerate() {
        for count in [500, 100] {
            records.push(ok(mesh, "qmat", count, shape, 0));
        }
    }
    // At one count alone: the mesh counts at neither, so that both means are over the same meshes.
    records[7].evaluate.as_mut().unwrap().quality.min_angle_mean = None;
    let means = |records: &[Record]| -> Vec<bool> {
        let rows = summary_rows(records, "qmat").into_iter();
        let rows = rows.filter(|row| row.contains("| 4 of 4 |"));
        rows.map(|row| row.contains("; 3) |")).collect()
    };
    assert_eq!(means(&records), [true, true]);
    let few = |record: &mut Record| {
        record.evaluate.as_mut().unwrap().quality.min_angle_mean = None;
    };
    records[1..6].iter_mut().for_each(few);
    assert_eq!(means(&records), [false, false], "less than half of the meshes");
}

#[test]
fn error_bounds_and_native_levels_have_separate_tables() {
    use medial_run::level::Target;

    let mut records = Vec::new();
    for (shape, mesh) in SHAPES[..4].iter().enumerate() {
        for (rank, method) in ["qmat", "angle"].iter().enumerate() {
            for (count, level) in [(900, 30.0), (300, 60.0), (90, 90.0)] {
                let mut record = ok(mesh, method, count, shape, rank);
                record.simplify.level = Target::Native(level);
                records.push(record);
            }
            let mut within = ok(mesh, method, 200 * (1 + rank), shape, rank);
            within.simplify.level = Target::MaxError(0.01);
            if (shape, rank) == (3, 1) {
                within = failed(mesh, method, 1, Status::BoundMissed, "the lowest is 1.2 %");
                within.simplify.level = Target::MaxError(0.01);
            }
            records.push(within);
        }
    }
    let files = report_of(&records);
    let summary = text(&files, "tables/summary.md");
    let rows: Vec<&str> = summary.lines().filter(|line| line.starts_with("| 1 | ")).collect();
    assert_eq!(rows.len(), 2, "{summary}");
    assert!(rows[0].contains("| qmat | 4 of 4 | 200 | 1.00 | 4 meshes |"), "{}", rows[0]);
    assert!(rows[1].contains("| angle | 3 of 4 | 400 | 2.00 | 3 meshes |"), "{}", rows[1]);
    assert!(summary.contains("| angle | 60 theta (degrees) | 4 of 4 | 300 |"), "{summary}");
    let svg = text(&files, "plots/overview-hausdorff.svg");
    assert!(svg.contains("angle (native levels)"), "{svg}");
    assert!(svg.contains("font-family=\"Helvetica, Arial, sans-serif\""), "{svg}");
    let [_, bulk] = documents(text(&files, "index.html"));
    let reasons = bulk["columns"]["item/reason"].as_array().unwrap();
    assert_eq!((reasons.len(), reasons.iter().filter(|r| !r.is_null()).count()), (32, 1));
    assert!(reasons.contains(&"the lowest is 1.2 %".into()));
}

#[test]
fn names_from_files_are_escaped() {
    let hostile = "<script>alert(1)</script>|a\\b_c%&/../x";
    let mut record = ok(hostile, "qmat", 100, 0, 0);
    record.simplify.warnings.push("</script><img src=x onerror=alert(2)>".to_owned());
    let files = report_of(&[record, failed(hostile, "angle", 100, Status::Failed, "<b>no</b>")]);
    let page = text(&files, "index.html");
    let [report, _] = documents(page);
    assert_eq!(report["meshes"][0]["name"], hostile);
    for forbidden in ["<script>alert", "<img src=x", "<b>no</b>"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    for (name, bytes) in &files {
        assert!(name.split('/').all(|part| part != ".."), "{name} leaves the folder");
        if name.ends_with(".svg") {
            assert!(!String::from_utf8_lossy(bytes).contains("<script>"), "{name}");
        }
    }
}

/// Formulas and controls are inert, and numbers stay.
#[test]
fn csv_cells_are_never_formulas() {
    let cases = [
        ("=cmd|' !A0", "'=cmd|' !A0"),
        ("+1+1", "'+1+1"),
        ("-2+3", "'-2+3"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\t=1", "' =1"),
        ("\r=1", "' =1"),
        ("a\u{1b}[2Jb", "a\u{fffd}[2Jb"),
        ("-0.5", "-0.5"),
        ("+3e-7", "+3e-7"),
        ("bear", "bear"),
    ];
    let mut records: Vec<Record> =
        cases.iter().map(|(mesh, _)| ok(mesh, "qmat", 100, 0, 0)).collect();
    let error = records[0].evaluate.as_ref().unwrap().distances.hausdorff.to_string();
    let mut refused = failed("@bear", "qmat", 100, Status::Refused, "-1 faces");
    refused.command = "+medial".to_owned();
    records.push(refused);
    let (_, rows) = csv_of(&records);
    let cells: Vec<&str> = rows.iter().flat_map(csv::StringRecord::iter).collect();
    for cell in cells.iter().filter(|cell| cell.starts_with(['=', '+', '-', '@', '\t', '\r'])) {
        assert!(cell.parse::<f64>().is_ok(), "{cell}");
    }
    let shown = cases.iter().map(|(_, shown)| *shown);
    // The last is the Euler characteristic.
    for cell in shown.chain(["'@bear", "'-1 faces", "'+medial", &error, "-2"]) {
        assert!(cells.contains(&cell), "{cell}: {cells:?}");
    }
}

#[test]
fn files_of_an_earlier_report_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let write = |records: &[Record]| write_report(folder.path(), records, &header(&METHODS));
    write(&[ok("bear", "qmat", 100, 0, 0), ok("plane", "qmat", 100, 1, 0)]).unwrap();
    fs::write(folder.path().join("results.jsonl"), "the runner's").unwrap();
    fs::write(folder.path().join("tables/mine.md"), "the user's").unwrap();
    assert!(folder.path().join("tables/mesh-plane.md").exists());
    write(&[ok("bear", "qmat", 100, 0, 0)]).unwrap();
    let left = files(folder.path());
    assert!(left.keys().all(|name| !name.contains("plane")), "{:?}", left.keys());
    assert_eq!(left["results.jsonl"], b"the runner's");
    assert_eq!(left["tables/mine.md"], b"the user's");
    assert_eq!(read_header(folder.path()).unwrap(), header(&METHODS));
}

#[test]
fn a_page_without_measurements_has_a_notice() {
    let records = [failed("bear", "qmat", 100, Status::TimedOut, "no result within 300 s")];
    let alert = |records: &[Record]| {
        let [report, _] = documents(text(&report_of(records), "index.html"));
        report["alert"].as_str().map(str::to_owned)
    };
    for records in [&records[..], &[]] {
        assert!(alert(records).unwrap().starts_with("Nothing was measured"));
    }
    assert_eq!(alert(&[ok("bear", "qmat", 100, 0, 0)]), None);
    assert_eq!(summary_text(&[]), "");
    assert_eq!(summary_text(&records), "");
}

/// Sets the Hausdorff error, a fraction of the diagonal.
fn with_error(mut record: Record, error: f64) -> Record {
    record.evaluate.as_mut().unwrap().distances.hausdorff = error;
    record
}

#[test]
fn a_comparison_ends_with_one_table_of_100_columns() {
    let mut records = comparison(&SHAPES[..2], &METHODS, &COUNTS);
    for mesh in &SHAPES[..2] {
        records.push(failed(mesh, "sat", 100, Status::OtherCount, "200 spheres"));
        records.push(failed(mesh, "aof", 100, Status::TimedOut, "no result within 300 s"));
        records.push(with_error(ok(mesh, &"long ".repeat(20), 100, 0, 0), 0.001));
        records.push(with_error(ok(mesh, "angle", 100, 0, 0), 0.002));
        records.push(with_error(ok(mesh, "angle", 200, 0, 0), 0.003));
    }
    let text = summary_text(&records);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.iter().all(|line| line.chars().count() <= 100), "{text}");
    assert_eq!(lines[0], "100 spheres, 2 meshes");
    // A title, the heads, a line for each method with a result, the least error first.
    let methods = lines[2..6].iter().map(|line| line.split(' ').next().unwrap());
    assert_eq!(methods.collect::<Vec<_>>(), ["long", "angle", "lambda", "qmat"], "{text}");
    assert!(lines[3].contains(" 0.200 "), "{text}");
    assert!(
        text.contains("No result at this count: sat (other count); aof (timed out)."),
        "{text}"
    );
    assert_eq!(text.matches("spheres, 2 meshes").count(), 1, "one count: {text}");
}

#[test]
fn means_over_fewer_meshes_are_in_parentheses() {
    let mut records = vec![];
    for mesh in &SHAPES[..3] {
        records.push(with_error(ok(mesh, "qmat", 100, 0, 0), 0.002));
        records.push(with_error(ok(mesh, "angle", 100, 0, 0), 0.003));
    }
    assert!(!summary_text(&records).contains('('));
    // Without its hardest mesh a method must not read as the better one.
    records[1] = failed(SHAPES[0], "angle", 100, Status::TimedOut, "no result within 300 s");
    let text = summary_text(&records);
    assert!(text.contains(" (0.300) ") && text.contains(" 0.200 "), "{text}");
    assert!(text.contains("In parentheses: means over fewer meshes"), "{text}");
}

#[test]
fn the_initial_mesh_and_errors_above_5_percent_are_not_ranked() {
    let mut records = vec![];
    for (shape, mesh) in SHAPES[..2].iter().enumerate() {
        records.push(with_error(ok(mesh, "initial", 100, shape, 0), 0.001));
        records.push(with_error(ok(mesh, "sat", 100, shape, 0), 0.226));
        let mut wrong = with_error(ok(mesh, "qmat", 100, shape, 0), 0.009);
        wrong.evaluate.as_mut().unwrap().betti = [1, 9, 9];
        records.push(wrong);
    }
    let files = report_of(&records);
    let table = text(&files, "tables/overview-purpose.md");
    assert!(table.contains("| lowest error at 100 spheres | **qmat** | 0.900 % |"), "{table}");
    assert!(table.contains("| fastest within 1 % error | **qmat** |"), "{table}");
    assert!(table.contains("| topology right everywhere, lowest error at 100 spheres | none |"));
    assert!(!table.contains("| **initial**") && !table.contains("sat |"), "{table}");
}

#[test]
fn captions_have_the_recorded_error_and_the_least_one_first() {
    let mut records = vec![];
    for (mesh, errors) in [("a", [0.01, 0.012]), ("b", [0.04, 0.01])] {
        for (method, error) in METHODS.iter().zip(errors) {
            let mut record = with_error(ok(mesh, method, 100, 0, 0), error);
            record.artifact = Some(format!("axes/{mesh}-{method}.ma"));
            records.push(record);
        }
        records.push(failed(mesh, "lambda", 100, Status::Failed, "no"));
    }
    records[0].simplify.reached = Some(98);
    let strips = picture_strips(&records);
    let captions = strips.iter().map(|strip| -> Vec<&str> {
        strip.panels.iter().map(|(_, caption)| caption.as_str()).collect()
    });
    let captions: Vec<Vec<&str>> = captions.collect();
    assert_eq!(captions[0], ["qmat (98): Hausdorff 1.00 %", "angle: Hausdorff 1.20 %"]);
    assert_eq!(captions[1], ["angle: Hausdorff 1.00 %", "qmat: Hausdorff 4.00 %"]);
}

/// The addresses of a page's elements, without those of other hosts.
fn local_addresses(html: &str) -> Vec<String> {
    let elements =
        html.split(['<', '>']).filter(|part| part.starts_with("a ") || part.starts_with("img "));
    let addresses =
        elements.filter_map(|part| part.split_once("href=\"").or(part.split_once("src=\"")));
    let addresses = addresses.filter_map(|(_, rest)| rest.split('"').next());
    let files = addresses.map(|address| address.split('#').next().unwrap().to_owned());
    files.filter(|file| !file.starts_with("https://")).collect()
}

#[test]
fn every_link_of_a_site_resolves() {
    let names = ["a,b", "a_b", "Ö & co", "qmat", "no-note"];
    let mut records = vec![];
    for (shape, mesh) in ["bear, large", "bear_ large"].iter().enumerate() {
        for (rank, name) in names.iter().enumerate() {
            let mut record = ok(mesh, name, 100, shape, rank);
            record.artifact = Some(format!("axes/{shape}-{rank}.ma"));
            records.push(record);
        }
        let mut external = ok(mesh, "given", 100, shape, 5);
        external.status = Status::External;
        external.simplify.variant = Some("theirs, too".to_owned());
        records.push(external);
    }
    // One other has no description.
    let header = header(&[&names[..4], &["theirs, too"]].concat());
    let [store, site] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    write_site(site.path(), store.path(), &records, &header).unwrap();
    assert_eq!(fs::read_dir(store.path()).unwrap().count(), 0, "the store stays unchanged");
    let files = files(site.path());
    let mut links = vec![];
    for (page, html) in files.iter().filter(|(name, _)| name.ends_with(".html")) {
        let html = std::str::from_utf8(html).unwrap();
        links.extend(local_addresses(html).into_iter().map(|link| (page.clone(), link)));
    }
    let [page, bulk] = documents(text(&files, "index.html"));
    for method in page["methods"].as_array().unwrap() {
        let has_page =
            names.contains(&method["id"].as_str().unwrap()) || method["id"] == "theirs, too";
        assert_eq!(method["page"].is_string(), has_page, "{method}");
        links
            .extend(method["page"].as_str().map(|link| ("index.html".to_owned(), link.to_owned())));
    }
    for mesh in page["meshes"].as_array().unwrap() {
        let stem = mesh["stem"].as_str().unwrap();
        let of_mesh = [
            format!("mesh-{stem}.html"),
            format!("tables/mesh-{stem}.md"),
            format!("tables/mesh-{stem}.tex"),
        ];
        links.extend(of_mesh.map(|link| ("index.html".to_owned(), link)));
    }
    assert!(bulk["columns"].get("table/link").is_none(), "a site has no medial meshes");
    assert!(links.len() > 40, "{links:?}");
    for (page, link) in links {
        assert!(files.contains_key(link.trim_start_matches("./")), "{page}: {link}");
    }
}

#[test]
fn a_weak_method_changes_no_row_of_which_method() {
    let records = comparison(&SHAPES[..4], &METHODS, &COUNTS);
    let before = report_of(&records);
    let name = "tables/overview-purpose.md";
    let table = text(&before, name);
    for question in ["lowest error at 100 spheres", "topology right everywhere", "smallest file"] {
        assert!(table.contains(question), "{question}: {table}");
    }
    // A copy of the worst one, ten times worse on every mesh and at every level.
    let mut with_weak = records.clone();
    let weak = records.iter().filter(|record| record.simplify.method == "lambda").cloned();
    with_weak.extend(weak.map(|mut record| {
        record.simplify.method = "weak".to_owned();
        let evaluation = record.evaluate.as_mut().unwrap();
        evaluation.distances.hausdorff *= 10.0;
        evaluation.distances.mean *= 10.0;
        evaluation.quality.min_angle_mean = Some(1.0);
        evaluation.betti = [1, 9, 9];
        record.simplify.seconds.as_mut().unwrap().simplify *= 10.0;
        record
    }));
    let after = report_of(&with_weak);
    let [before_rows, after_rows] = [&before, &after].map(|files| {
        let rows = text(files, name).lines().filter(|line| line.starts_with('|'));
        rows.filter(|line| !line.contains("weak")).collect::<Vec<_>>()
    });
    assert!(before_rows.len() == 8, "{table}");
    assert_eq!(before_rows, after_rows);
}

#[test]
fn the_bibliography_has_each_method_that_ran_once() {
    let mut records = comparison(&SHAPES[..2], &["qmat", "angle"], &[100]);
    // A separate row with the entry of another.
    let mut variant = ok("bear", "qmat", 100, 0, 0);
    variant.simplify.params.set("k", "0");
    records.push(variant);
    let files = report_of(&records);
    let bibliography = text(&files, "tables/methods.bib");
    let keys: Vec<&str> = bibliography.lines().filter(|line| line.starts_with('@')).collect();
    assert_eq!(keys, ["@article{qmat,", "@article{angle,", "@misc{medial,"]);
    assert!(bibliography.contains("note = {Version 0.1.0}"), "{bibliography}");
    let [page, _] = documents(text(&files, "index.html"));
    assert_eq!(page["papers"], bibliography);
    let titles = page["methods"].as_array().unwrap().iter().map(|method| &method["home"]);
    assert_eq!(
        titles.collect::<Vec<_>>(),
        ["Few spheres; qmat is made up.", "Few spheres; angle is made up."]
    );
    assert!(!report_of(&[]).contains_key("tables/methods.bib"));
}

#[test]
fn seeds_are_one_row_of_the_median_error() {
    let mut records = vec![];
    for (shape, mesh) in SHAPES.iter().enumerate() {
        records.push(with_error(ok(mesh, "qmat", 100, shape, 0), 0.02));
        for (seed, error) in [(0, 0.009), (1, 0.012), (2, 0.010)] {
            let mut record = with_error(ok(mesh, "tight", 100, shape, 1), error);
            record.simplify.seed = seed;
            record.seeds = [("evaluation".to_owned(), 0), ("method".to_owned(), seed)].into();
            records.push(record);
        }
    }
    records
        .iter_mut()
        .for_each(|record| _ = record.seeds.entry("evaluation".to_owned()).or_insert(0));
    let files = report_of(&records);
    let table = text(&files, "tables/mesh-bear.md");
    let row = table.lines().find(|line| line.contains("| tight |")).unwrap();
    assert!(row.contains("1.00") && row.contains("0.900 to 1.20"), "{row}");
    assert_eq!(table.matches("| tight |").count(), 1, "{table}");
    // Every seed is in the CSV.
    assert_eq!(text(&files, "results.csv").lines().count(), 1 + 4 * SHAPES.len());
    let differences = text(&files, "tables/overview-differences.md");
    let row = differences.lines().find(|line| line.starts_with("| qmat |")).unwrap();
    // Worse on all of 13 meshes: the sign of each is a fair coin.
    let p = 2.0 / 2f64.powi(13);
    assert!(row.contains("| 2.0 \\[2.0, 2.0\\] | 13 | 0, 0, 13 | -1.00 |"), "{row}");
    let csv = text(&files, "tables/overview-differences.csv");
    assert!(csv.contains(&format!(",{p},{p}")), "{csv}");
    let purpose = text(&files, "tables/overview-purpose.md");
    assert!(purpose.contains("| yes, n = 13 |"), "{purpose}");
}

#[test]
fn few_meshes_establish_nothing() {
    let pair = |mesh: &str, shape| {
        [("qmat", 0.02), ("tight", 0.01)].map(|(id, e)| with_error(ok(mesh, id, 100, shape, 0), e))
    };
    let records: Vec<Record> =
        SHAPES[..5].iter().enumerate().flat_map(|(shape, mesh)| pair(mesh, shape)).collect();
    let files = report_of(&records);
    let differences = text(&files, "tables/overview-differences.md");
    assert!(differences.contains("no difference can be established"), "{differences}");
    assert!(differences.contains("| qmat | 2.0 | 5 |"), "without an interval: {differences}");
    let purpose = text(&files, "tables/overview-purpose.md");
    let note = "No difference is established: 5 meshes are too few (the test needs 6).";
    assert!(purpose.contains(note) && !purpose.contains("| difference established"), "{purpose}");
    // The smallest count that ran is a bound, and the fastest is known by its time.
    assert!(purpose.contains("| **tight** | at most 100 spheres | "), "{purpose}");
    assert!(purpose.contains("| fastest within 1 % error | **tight** | "), "{purpose}");
}

#[test]
fn a_page_of_one_mesh_counts_no_meshes() {
    let report = |shapes: &[&str]| {
        let files = report_of(&comparison(shapes, &METHODS, &COUNTS));
        let [report, bulk] = documents(text(&files, "index.html"));
        assert_eq!(bulk["figures"].as_array().unwrap().len(), shapes.len());
        report
    };
    let [one, two] = [&SHAPES[..1], &SHAPES[..2]].map(report);
    for (page, columns) in [(&one, 6), (&two, 7)] {
        assert_eq!(page["answers"]["columns"].as_array().unwrap().len(), columns);
    }
    let sections = |page: &serde_json::Value| {
        ["sections", "overview", "answers"].map(|part| page[part].to_string()).concat()
    };
    for counted in ["1 of 1", "on 1 mesh", "Means over meshes", "edian"] {
        assert!(!sections(&one).contains(counted), "{counted}: {}", sections(&one));
    }
    assert!(sections(&two).contains("Means over meshes") && sections(&two).contains("2 of 2"));
    assert_eq!(one["figures"].as_array().unwrap().len(), 0, "its own curves are those of all");
}
