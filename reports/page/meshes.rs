//! One foldable section for each mesh: its topology, its plots, its table.

use crate::page::packed::packed;
use crate::page::{MeshPart, MeshView, Page, html};
use crate::text::{betti, counted, escape_html, grouped};
use crate::write::MOST_PLOTTED;

/// Meshes whose sections stand in the document; the script unpacks further ones when they are opened.
const INLINE: usize = 12;

/// The sections of all meshes; the first one is open.
pub(crate) fn section(page: &Page<'_>) -> String {
    let mut html = String::from(
        "<section id=\"meshes\">\n<h2>Meshes</h2>\n\
         <p class=\"fold\" hidden><button type=\"button\" data-fold=\"open\">open all</button> \
         <button type=\"button\" data-fold=\"\">close all</button></p>\n",
    );
    for (mesh, part) in page.meshes.iter().enumerate() {
        html.push_str(&of_mesh(page, mesh, part));
    }
    html.push_str("</section>\n");
    html
}

fn of_mesh(page: &Page<'_>, mesh: usize, part: &MeshPart) -> String {
    let comparison = page.comparison;
    let runs = comparison.of_mesh(mesh).count();
    let missing =
        comparison.of_mesh(mesh).filter(|entry| !entry.record.status.has_result()).count();
    let mut brief = vec![counted(runs, "run", "runs")];
    if missing > 0 {
        brief.push(format!("{missing} without a result"));
    }
    let stem = escape_html(&part.stem);
    let inside = inside(page, mesh, part);
    format!(
        "<details class=\"mesh\" id=\"mesh-{stem}\"{}><summary>{} <small>{}</small></summary>\n{}</details>\n",
        if mesh == 0 { " open" } else { "" },
        escape_html(&comparison.meshes[mesh]),
        escape_html(&brief.join(", ")),
        if mesh < INLINE { inside } else { packed(None, &inside) }
    )
}

/// What a section shows when it is open.
fn inside(page: &Page<'_>, mesh: usize, part: &MeshPart) -> String {
    let stem = escape_html(&part.stem);
    let mut html = initial(page, mesh);
    if let Some((address, words)) = &part.picture {
        html.push_str(&format!(
            "<figure class=\"strip\"><img src=\"{address}\" alt=\"{words}\"{loading}>\
             <figcaption>{words}</figcaption></figure>\n",
            words = escape_html(words),
            // What the page holds is there at once, on paper too.
            loading = if address.starts_with("data:") { "" } else { " loading=\"lazy\"" },
        ));
    }
    html.push_str(&part.view.as_ref().map_or(String::new(), view));
    if page.meshes.len() > MOST_PLOTTED {
        html.push_str(&format!(
            "<p class=\"note\">Of more than {MOST_PLOTTED} meshes none has plots of its own.</p>\n"
        ));
    } else if part.plots.is_empty() {
        html.push_str("<p class=\"notice bad\">Nothing was measured on this mesh.</p>\n");
    } else {
        html.push_str(&html::plots(&part.plots));
    }
    html.push_str(&html::table(&part.table));
    html.push_str(&format!(
        "<p class=\"note\">This table as <a href=\"./tables/mesh-{stem}.md\">Markdown</a> and \
         <a href=\"./tables/mesh-{stem}.tex\">LaTeX</a>.</p>\n"
    ));
    html
}

/// Where the script puts a 3D view.
fn view(view: &MeshView) -> String {
    let place = format!(
        "<div class=\"view3d\" data-view=\"{}\" data-src=\"./{}\"></div>\n",
        escape_html(&view.name),
        escape_html(&view.file)
    );
    let text = view.text.as_ref().map_or(String::new(), |text| {
        format!(
            "<script type=\"text/plain\" class=\"view\" id=\"view-{}\">{text}</script>\n",
            escape_html(&view.name)
        )
    });
    place + &text
}

/// The initial medial mesh beside the solid.
fn initial(page: &Page<'_>, mesh: usize) -> String {
    let Some(initial) = page.comparison.of_mesh(mesh).find_map(|entry| entry.record.initial) else {
        return "<p class=\"note\">The initial medial mesh was not recorded.</p>\n".to_owned();
    };
    let known = |numbers: Option<[u64; 3]>| numbers.map_or("unknown".to_owned(), betti);
    let verdict = match (initial.betti, initial.expected_betti) {
        (Some(found), Some(expected)) if found == expected => "the same as the solid's",
        (Some(_), Some(_)) => {
            "<strong>not the solid's</strong>: no method that starts from it can be blamed for \
             what is wrong already here"
        }
        _ => "not compared",
    };
    format!(
        "<dl class=\"initial\"><div><dt>initial medial mesh</dt><dd>{} spheres, {} edges, {} faces\
         </dd></div><div><dt>its Betti numbers</dt><dd>{}</dd></div><div><dt>the solid's</dt>\
         <dd>{}</dd></div><div><dt>topology</dt><dd>{verdict}</dd></div></dl>\n",
        grouped(initial.spheres),
        grouped(initial.edges),
        grouped(initial.faces),
        known(initial.betti),
        known(initial.expected_betti),
    )
}
