//! Writing a report: tables, plots and the page into one folder.

use std::path::{Path, PathBuf};
use std::{fs, io};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use medial::{parser_message, read_regular};
use medial_run::error::FileError;
use medial_run::journal::replace_file;
use medial_run::record::Record;
use medial_run::text::file_stems;

use crate::answers::{equal_error_table, purpose_table};
use crate::comparison::Comparison;
use crate::differences::{difference_tables, differences_csv};
use crate::header::Header;
use crate::overview::overview_table;
use crate::page::{MeshPart, MeshPicture, MeshView, Page, gzip};
use crate::pictures::{FOLDER, PictureStrip, VIEWS, strips};
use crate::plots::{Figure, mean_figures, mesh_figures, styles};
use crate::summary::{MEANS, by_count, means_table, native_curves, native_table};
use crate::tables::{Table, mesh_table, to_csv, to_latex, to_markdown, topic_tables};
use crate::view3d::text_of;

/// Writes the report of some records into a folder, which is created where it is missing:
/// `results.csv`, `tables/*.md`, `tables/*.tex`, `tables/*.csv`, `tables/methods.*`, `plots/*.svg`, `header.json` and
/// `index.html`. Returns the paths that were written, `index.html` last.
///
/// Each file is written under a temporary name and renamed. The same records and header give the
/// same bytes. Files in `tables/` and `plots/` that an earlier report left there under a name
/// such as `mesh-*` and that this one does not write are removed, so that no stale number remains. `results.jsonl` is
/// the runner's and is not touched.
///
/// Of several records of one item the last one counts. Records without any result give a page that reports that
/// nothing was measured; the caller sets the exit code.
///
/// # Errors
/// When a file cannot be written, or a CSV cannot be made.
pub fn write_report(
    dir: &Path,
    records: &[Record],
    header: &Header,
) -> Result<Vec<PathBuf>, FileError> {
    let comparison = Comparison::new(records);
    let is_one = comparison.meshes.len() == 1;
    let summaries = by_count(&comparison);
    let natives = native_curves(&comparison);
    let how = header.how();
    let mut files = Files { dir, written: Vec::new() };
    let csv = to_csv(&comparison).map_err(|error| FileError::at("results.csv", error))?;
    // Nobody keeps a site for its CSV.
    match header.is_site {
        true => files.write("results.csv.gz", &gzip(&csv))?,
        false => files.write("results.csv", &csv)?,
    }

    let answers = Vec::from_iter(purpose_table(&comparison, &how));
    let mut equal_error: Vec<Table> = equal_error_table(&comparison, &how).into_iter().collect();
    let mut means = vec![means_table(&comparison, &summaries, &how)];
    if !natives.is_empty() {
        means.push(native_table(&comparison, &natives, header, &how));
    }
    means.retain(|table| !table.rows.is_empty()); // a study of error bounds alone has none
    let all_means: Vec<Table> = equal_error.iter().chain(&means).cloned().collect();
    files.write_tables("summary", "Summary", &all_means)?;
    let [structure, cover] = topic_tables(&comparison, &how).map(Vec::from_iter);
    let differences = if is_one { vec![] } else { difference_tables(&comparison, &how) };
    for (stem, title, tables) in [
        ("overview-purpose", "Methods by criterion", &answers),
        ("overview-structure", "Structure", &structure),
        ("overview-cover", "Cover", &cover),
        ("overview-differences", "Differences between methods", &differences),
    ] {
        if !tables.is_empty() {
            files.write_tables(stem, title, tables)?;
        }
    }
    if !is_one {
        let name = "tables/overview-differences.csv";
        let csv = differences_csv(&comparison).map_err(|error| FileError::at(name, error))?;
        files.write(name, &csv)?;
    }
    let figures = mean_figures(&comparison, &summaries, &natives);
    let styles = styles(header, &comparison);
    files.write_plots(&figures.iter().collect::<Vec<_>>(), &styles)?;

    let stems = file_stems(comparison.meshes.iter().map(String::as_str));
    let has_plots = stems.len() <= MOST_PLOTTED;
    let pictures = strips(&comparison);
    // A site is a folder: nothing in it needs to be there twice.
    let [mut room, mut room_3d] = if header.is_site { [0; 2] } else { [PICTURES, VIEWS_INSIDE] };
    let mut meshes = Vec::new();
    for (mesh, stem) in stems.into_iter().enumerate() {
        let part = MeshPart {
            figures: if has_plots { mesh_figures(&comparison, mesh, &stem) } else { vec![] },
            picture: picture(dir, pictures.get(&mesh), &mut room),
            view: view(dir, pictures.get(&mesh), &mut room_3d),
            stem,
        };
        let table = mesh_table(&comparison, mesh, &how);
        let name = format!("mesh-{}", part.stem);
        files.write_tables(&name, &comparison.meshes[mesh], std::slice::from_ref(&table))?;
        // A site has the two that its pages show.
        let drawn: Vec<&Figure> =
            part.figures.iter().filter(|figure| figure.leading || !header.is_site).collect();
        files.write_plots(&drawn, &styles)?;
        meshes.push(part);
    }
    let bibtex = header.bibtex(&comparison.methods);
    if !comparison.entries.is_empty() {
        files.write(BIBTEX, bibtex.as_bytes())?;
    }
    let header_json =
        serde_json::to_vec_pretty(header).map_err(|error| FileError::at("header.json", error))?;
    files.write("header.json", &header_json)?;
    let shown = pictures.values().flat_map(|strip| [strip.file.clone(), strip.view_file()]);
    files.remove_stale(&shown.map(|file| dir.join(file)).collect::<Vec<_>>())?;
    if is_one {
        // Means over one mesh are its results.
        means.retain(|table| table.caption != MEANS);
    }
    let [structure, cover] =
        [structure, cover].map(|tables| tables.into_iter().map(Table::known).collect());
    for table in means.iter_mut().chain(&mut equal_error) {
        let known = table.clone().known();
        *table = if is_one { known.of_one_mesh() } else { known };
    }
    let sections = [
        ("differences", "Which differences are established?", differences),
        ("equal-error", "Equal error", equal_error),
        ("structure", "Structure", structure),
        ("cover", "Cover", cover),
        ("means", if is_one { "Native levels" } else { "Means over meshes" }, means),
    ];
    let page = Page {
        header,
        comparison: &comparison,
        answers: answers.into_iter().next(),
        overview: overview_table(&comparison, &summaries, &header.methods),
        sections: sections.into_iter().filter(|section| !section.2.is_empty()).collect(),
        figures: &figures,
        meshes: &meshes,
        bibtex: &bibtex,
    };
    files.write("index.html", page.to_html().as_bytes())?;
    Ok(files.written)
}

/// BibTeX of the methods that ran and of the program.
pub(crate) const BIBTEX: &str = "tables/methods.bib";

/// Studies of more meshes have no plots for each mesh, which would be thousands of files.
pub(crate) const MOST_PLOTTED: usize = 100;

/// Bytes of the pictures that are part of the page; further ones are linked. In Base64 they take a third more.
const PICTURES: usize = 3 << 20;

/// Characters of the 3D views that are part of the page; further ones are read when they are opened.
const VIEWS_INSIDE: usize = 2 << 20;

/// The picture of a mesh's results, if it is in the folder: within the page, while there is room.
fn picture(dir: &Path, strip: Option<&PictureStrip>, room: &mut usize) -> Option<MeshPicture> {
    let strip = strip?;
    let bytes = fs::read(dir.join(&strip.file)).ok()?;
    let address = match room.checked_sub(bytes.len()) {
        Some(left) => {
            *room = left; // first come, first embedded
            format!("data:image/png;base64,{}", BASE64_STANDARD.encode(bytes))
        }
        None => format!("./{}", strip.file),
    };
    let captions = strip.panels.iter().map(|(_, caption)| caption.clone()).collect();
    Some(MeshPicture { address, layout: strip.layout(), captions })
}

/// The 3D view of a mesh's results, if it is in the folder: within the page, while there is room.
fn view(dir: &Path, strip: Option<&PictureStrip>, room: &mut usize) -> Option<MeshView> {
    let strip = strip?;
    let file = strip.view_file();
    let script = fs::read_to_string(dir.join(&file)).ok()?; // drawn by the caller, if at all
    let text = text_of(&script)?;
    let left = room.checked_sub(text.len());
    *room = left.unwrap_or(*room);
    Some(MeshView { name: strip.view.clone(), file, text: left.map(|_| text.to_owned()) })
}

/// The content of `results.csv` for some records.
///
/// # Errors
/// When the CSV cannot be made.
pub fn results_csv(records: &[Record]) -> Result<Vec<u8>, FileError> {
    to_csv(&Comparison::new(records)).map_err(|error| FileError::at("results.csv", error))
}

/// Reads the header that [`write_report`] left in a folder, to rebuild its report.
///
/// # Errors
/// When the file is missing or is no header.
pub fn read_header(dir: &Path) -> Result<Header, FileError> {
    let path = dir.join("header.json");
    let read = |bytes: Vec<u8>| {
        let header = serde_json::from_slice(&bytes);
        header.map_err(|error| io::Error::other(parser_message(&error.to_string())))
    };
    read_regular(&path).and_then(read).map_err(|error| FileError::at(&path, error))
}

/// The folder of the report and the written files.
pub(crate) struct Files<'a> {
    pub(crate) dir: &'a Path,
    pub(crate) written: Vec<PathBuf>,
}

impl Files<'_> {
    pub(crate) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), FileError> {
        let path = self.dir.join(name);
        replace_file(&path, bytes).map_err(|error| FileError::at(&path, error))?;
        self.written.push(path); // so that it is not taken for stale
        Ok(())
    }

    fn write_plots(&mut self, figures: &[&Figure], styles: &[usize]) -> Result<(), FileError> {
        for figure in figures {
            if let Some(svg) = figure.to_svg(styles)? {
                self.write(&format!("plots/{}.svg", figure.stem), svg.as_bytes())?;
            }
        }
        Ok(())
    }

    /// The same tables as Markdown and as LaTeX.
    fn write_tables(&mut self, stem: &str, title: &str, tables: &[Table]) -> Result<(), FileError> {
        let mut markdown = format!("# {}\n\n", crate::tables::escape(title));
        let mut latex = String::new();
        for (index, table) in tables.iter().enumerate() {
            if index > 0 {
                markdown.push('\n');
                latex.push('\n');
            }
            markdown.push_str(&to_markdown(table));
            let label = if index == 0 { stem.to_owned() } else { format!("{stem}-{}", index + 1) };
            latex.push_str(&to_latex(table, &label));
        }
        self.write(&format!("tables/{stem}.md"), markdown.as_bytes())?;
        self.write(&format!("tables/{stem}.tex"), latex.as_bytes())
    }

    /// Removes files of an earlier report, by names that only a report gives.
    /// The pictures and views that are `shown` stay.
    fn remove_stale(&self, shown: &[PathBuf]) -> Result<(), FileError> {
        for folder in ["tables", "plots", FOLDER, VIEWS] {
            let folder = self.dir.join(folder);
            let failed = |error| FileError::at(&folder, error);
            let entries = match fs::read_dir(&folder) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                entries => entries.map_err(failed)?,
            };
            for entry in entries {
                let path = entry.map_err(failed)?.path();
                // Files of the user, whose names begin otherwise, stay.
                let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
                let ours = (name.starts_with("mesh-") || name.starts_with("overview-"))
                    && name.rsplit_once('.').is_some_and(|(_, end)| {
                        ["md", "tex", "csv", "svg", "png", "js"].contains(&end)
                    });
                if ours && !self.written.contains(&path) && !shown.contains(&path) {
                    fs::remove_file(&path).map_err(failed)?;
                }
            }
        }
        Ok(())
    }
}
