// The page: its sections are made from the report's JSON. Text reaches the document as text alone,
// so no name from a file can become markup.
const make = (tag, attributes = {}, ...children) => {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
};
const code = (text) => make("pre", { class: "command" }, make("code", {}, text));
const fold = (id, title, ...children) =>
  make("details", { id, class: "fold" }, make("summary", {}, title), ...children);
const section = (id, title, ...children) => make("section", { id }, make("h2", {}, title), ...children);
const note = (text) => make("p", { class: "note" }, text);
const counted = (count, one, many) => `${count.toLocaleString("en")} ${count === 1 ? one : many}`;

// Gzip in Base64: as bytes or as text.
const unpacked = (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
};
const unpackedText = (id) => unpacked(document.getElementById(id).textContent).text();

// The script of a library that the page holds packed.
const evaluated = async (id) => {
  const script = make("script");
  script.textContent = await unpackedText(id);
  document.head.append(script);
};

const report = JSON.parse(document.getElementById("report").textContent);

// Words of the tables that are not metrics.
const WORDS = [
  ["requested, spheres", "The requested number of spheres, and that of the result. Results are compared at equal numbers, " +
    "reached to within 2 %."],
  ["%", "Lengths are percentages of the diagonal of the input's bounding box; results.jsonl and results.csv hold them as " +
    "fractions."],
  ["substrate, prepare, simplify", "The stages of the time. Substrates are the parts that methods share (samples, Delaunay " +
    "triangulation, inside test, initial medial mesh). Their time counts for each method that uses them, even if another " +
    "method built them. Prepare is the method's work for all levels, simplify its work for this level."],
  ["Betti", "Betti numbers over Z2 of the medial mesh: components, independent loops, enclosed bubbles. A medial axis has " +
    "those of its solid: components, total genus, cavities."],
  ["status", "ok; other count: a result with another number of spheres; unsupported: the method does not support this, which is " +
    "no failure; skipped: the time budget of the method on this mesh was used up; refused: the input was rejected; failed, panicked, timed out, out of memory: how the run ended; " +
    "invalid output: the output is not a valid medial mesh."],
];
const UNITS = "Lengths in % of the bounding-box diagonal of the input; wall-clock seconds, shared substrates included. " +
  "Arrows point in the better direction. Bold: best for this mesh at this number of spheres, among results that reached it to " +
  "within 2 %. results.csv holds every " +
  "recorded number.";
const GLOSSARY = "https://github.com/medial-rs/medial/blob/main/METHODOLOGY.md#glossary";
// Next to the page. The last two where there are means.
const FILES = [
  ["results.jsonl", "the records, one JSON object on each line"],
  ["results.csv", "every number of every record, one row for each"],
  ["tables/summary.md", "means over meshes; further tables next to it"],
  ["tables/summary.tex", "the same as LaTeX"],
];

// Numbers with three significant digits, one decimal, or none, as the metric says.
const written = (value, digits) => {
  if (value === null || value === undefined) return "–";
  if (digits === "tenths") return value.toFixed(1);
  if (digits === "count") return Math.round(value).toLocaleString("en");
  if (value === 0) return "0";
  const rounded = Number(value.toPrecision(3));
  const exponent = Math.floor(Math.log10(Math.abs(rounded)));
  return exponent < -5 || exponent > 8 ? value.toExponential(2) : rounded.toFixed(Math.max(0, 2 - exponent));
};

const dot = (series) => make("span", { class: "dot", style: `background:${report.series[series].colour}` });

// A table as Rust describes it: a cell is a text, or an object where it is the best of its group.
const tableOf = ({ columns, rows, grouped }) => {
  const kind = (k) => (columns[k].number ? "num" : null);
  const head = make("tr", {}, ...columns.map(({ title }, k) => make("th", { scope: "col", class: kind(k) }, title)));
  const body = rows.map((cells, row) =>
    make("tr", { class: grouped && cells[0] !== rows[row - 1]?.[0] ? "group" : null }, ...cells.map((cell, k) => {
      const inner = cell.best === undefined ? cell : make("strong", {}, cell.best);
      const long = !columns[k].number && (cell.best ?? cell).length > 60;
      return make("td", { class: long ? "wrap" : kind(k) }, inner);
    })));
  const table = make("table", {}, make("thead", {}, head), make("tbody", {}, ...body));
  return make("div", { class: "scroll" }, table);
};
const captioned = (table) => [make("h3", {}, table.caption), tableOf(table), ...table.notes.map(note)];

const listOf = (pairs) =>
  make("dl", {}, ...pairs.flatMap(([term, ...texts]) => [make("dt", {}, term), make("dd", {}, ...texts)]));

let pictures = 0; // made so far
const strip = (mesh, link) => {
  if (!mesh.picture) return null;
  const words = `${mesh.name}: medial meshes at one requested number of spheres (in parentheses: another number, which the method reached instead), the least ` +
    "Hausdorff error (in % of the diagonal) first, coloured by radius. Below them the surface: red where the reconstruction reaches beyond it, blue " +
    "where it falls short. Errors beyond the scale have its last colour.";
  const { address, layout: { whole: [width, height], panel, axes, errors, bars }, captions } = mesh.picture;
  const svg = (name, attributes, ...inside) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...inside);
    return element;
  };
  // The file is read once; each panel shows a part of it.
  const id = `picture-${pictures++}`;
  const source = svg("svg", { class: "source", "aria-hidden": "true" }, svg("defs", {}, svg("image", { id, href: address, width, height })));
  const part = (box, name) => svg("svg", { viewBox: box.join(" "), role: "img", "aria-label": name }, svg("use", { href: `#${id}` }));
  const panels = captions.map((caption, k) => make("figure", { class: "panel" }, part([...axes[k], ...panel], `medial mesh: ${caption}`),
    part([...errors[k], ...panel], `errors: ${caption}`), make("figcaption", {}, caption)));
  const scales = make("div", { class: "panel scales" }, ...bars.map((bar, k) => part(bar, ["scale of radii", "scale of errors"][k])));
  const all = make("div", { class: "panels" }, ...panels, scales);
  const more = link ? [" ", make("a", { href: link }, "More of this mesh."), ] : [];
  return make("figure", { class: "strip" }, source, all, make("figcaption", {}, words, ...more));
};

// Picture, 3D view, initial medial mesh and curves of one mesh.
const meshParts = (index, withPicture, plots) => {
  const mesh = report.meshes[index];
  const facts = mesh.initial.map(([term, text, bad]) =>
    make("div", {}, make("dt", {}, term), make("dd", {}, bad ? make("strong", {}, text) : text)));
  return [
    withPicture ? strip(mesh) : null,
    mesh.view ? viewOf(mesh.view) : null,
    facts.length ? make("dl", { class: "initial" }, ...facts) : null,
    mesh.measured ? null : make("p", { class: "notice bad" }, "Nothing was measured on this mesh."),
    plots.length ? plotsOf(plots) : null,
  ];
};

// A text with a button that copies it.
const paste = (title, file, text) => {
  const message = make("output");
  const pre = make("pre", { tabindex: 0 }, text);
  const button = make("button", { type: "button" }, "Copy");
  button.addEventListener("click", async () => {
    try {
      // Pages from disk may lack a clipboard, and a browser may refuse it.
      await navigator.clipboard.writeText(text);
      message.textContent = "Copied.";
    } catch {
      getSelection().selectAllChildren(pre);
      pre.focus();
      message.textContent = "Selected: copy it with the keyboard.";
    }
  });
  const link = make("a", { href: file }, file.replace("./", ""));
  return make("div", { class: "paste" }, make("h3", {}, title), make("p", {}, button, " ", link, " ", message), pre);
};

const methodsOf = (methods) => make("dl", {}, ...methods.flatMap(({ id, title, summary, home, published, citation, page }) => [
  make("dt", {}, page ? make("a", { href: page }, `${id}: ${title}`) : `${id}: ${title}`),
  make("dd", {}, [summary, home && `Best suited for: ${home}`, published && `Published level: ${published}.`]
    .filter(Boolean).join(" "), make("cite", {}, citation)),
]));

// A fold whose content is made when it is first opened, or printed.
const late = (details, build) => {
  details.fill = () => {
    delete details.fill;
    details.append(...build());
  };
  details.addEventListener("toggle", () => details.open && details.fill?.());
  return details;
};

const meshFolds = (bulk) => report.meshes.map((mesh, index) => late(
  make("details", { class: "mesh", id: `mesh-${mesh.stem}` }, make("summary", {}, `${mesh.name} `, make("small", {}, mesh.brief))),
  () => [...meshParts(index, true, bulk.figures[index] ?? []).filter(Boolean),
    make("p", {}, make("a", { href: `#results?mesh=${encodeURIComponent(mesh.name)}` }, "Results of this mesh"), " as ",
      ...(report.site ? [make("a", { href: `./mesh-${mesh.stem}.html` }, "a page"), ", "] : []),
      make("a", { href: `./tables/mesh-${mesh.stem}.md` }, "Markdown"), ", ",
      make("a", { href: `./tables/mesh-${mesh.stem}.tex` }, "LaTeX"))]));

// Opens the element of the address, with the folds around it.
const openTarget = () => {
  let id = location.hash.slice(1).split("?")[0];
  try {
    id = decodeURIComponent(id);
  } catch {
    // Not encoded: taken as it is.
  }
  const target = document.getElementById(id);
  for (let around = target; around; around = around.parentElement) {
    if (around.localName === "details") {
      around.open = true;
      around.fill?.();
    }
  }
  target?.scrollIntoView();
};

const start = async () => {
  const bulk = await unpackedText("bulk").then(JSON.parse);
  await evaluated("d3");
  await evaluated("plot");
  const main = document.querySelector("main");
  document.getElementById("facts").append(...report.facts.map((fact) => make("li", {}, fact)));
  document.getElementById("how").append(make("p", {}, report.lead));
  if (report.command) document.getElementById("how").append(code(report.command));

  const isOne = report.meshes.length === 1;
  const [first] = report.meshes;
  const overview = isOne ? bulk.figures[0] ?? [] : report.figures;
  const curves = overview.filter((figure) => figure.leading);
  const others = overview.filter((figure) => !figure.leading);
  const parts = [];
  if (report.alert) {
    parts.push(make("p", { class: "notice bad", role: "alert" }, report.alert));
  }
  if (report.notices.length) {
    parts.push(make("ul", { class: "notice" }, ...report.notices.map((text) => make("li", {}, text))));
  }
  if (report.answers) {
    const { notes } = report.answers;
    parts.push(section("answers", "Which method?", tableOf(report.answers),
      notes.length ? fold(null, "How the methods are ranked", ...notes.map(note)) : null));
  }
  if (isOne) {
    const inner = meshParts(0, true, []).filter(Boolean);
    if (inner.length) parts.push(make("section", { id: `mesh-${first.stem}` }, make("h2", {}, "Pictures"), ...inner));
  } else if (report.leading !== null) {
    const mesh = report.meshes[report.leading];
    const way = make("a", { href: "#meshes" }, "Pictures, 3D views and curves of each mesh");
    parts.push(section("pictures", "Pictures", strip(mesh, `#mesh-${mesh.stem}`), mesh.view && viewOf(mesh.view), make("p", {}, `${mesh.name} is shown. `, way)));
  }
  if (curves.length) parts.push(section("curves", "Error against spheres and time", plotsOf(curves)));
  if (report.overview) {
    const { caption, notes } = report.overview;
    parts.push(section("overview", `All methods: ${caption}`, tableOf(report.overview), ...notes.map(note)));
  }
  const folds = [];
  if (bulk.rows) folds.push(late(fold("results", "All results"), () => resultsOf(bulk)));
  else if (report.too_many) folds.push(fold("results", "All results", make("p", {}, report.too_many)));
  folds.push(...report.sections.map(({ id, title, tables }) => fold(id, title, ...tables.flatMap(captioned))));
  if (!isOne && report.meshes.length) folds.push(fold("meshes", "Each mesh: pictures, 3D, curves", ...meshFolds(bulk)));
  if (others.length) folds.push(late(fold("plots", "More plots"), () => [plotsOf(others)]));
  if (report.methods.length) folds.push(fold("methods", "Methods", methodsOf(report.methods)));
  folds.push(fold("definitions", "Definitions", listOf([...report.definitions, ...WORDS]),
    make("p", {}, "More terms: ", make("a", { href: GLOSSARY }, "the glossary"), ".")));
  if (report.papers) {
    const about = "plots/ holds all plots as SVG, lettered in Helvetica, Arial or another sans-serif; tables/ holds all " +
      "tables as LaTeX for \\input. They need no package; booktabs gives finer rules, graphicx shrinks wide tables to the " +
      "width of the text. A plot as PDF: rsvg-convert -f pdf -o x.pdf plots/x.svg (librsvg).";
    const bibtex = ["BibTeX of the methods and the program", "./tables/methods.bib", report.papers];
    folds.push(fold("papers", "How to cite, plots and tables for papers", make("p", {}, about), paste(...bibtex)));
  }
  const kept = FILES.slice(report.site ? 1 : 0, report.sections.length ? 4 : 2);
  folds.push(fold("files", "Files", make("ul", {}, ...kept.map(([path, text]) => {
    const file = report.site && path === "results.csv" ? "results.csv.gz" : path;
    return make("li", {}, make("a", { href: `./${file}` }, file), `: ${text}`);
  }))));
  const runs = [
    report.earlier.length && make("h3", {}, `${counted(report.earlier.length, "earlier run", "earlier runs")} that added records`),
    report.earlier.length && make("ul", {}, ...report.earlier.map((line) => make("li", {}, make("code", {}, line)))),
    report.study && make("h3", {}, "Study file of the last run"),
    report.study && code(report.study),
  ].filter(Boolean);
  if (runs.length) folds.push(fold("runs", "Runs and study file", ...runs));
  main.append(...parts, make("section", { id: "more" }, ...folds));
  const named = [...main.querySelectorAll(":scope > section > h2, #more > details.fold > summary")];
  document.querySelector("nav").append(...named.map((head) =>
    make("a", { href: `#${head.parentElement.id}` }, head.textContent)));
  if (report.site) document.querySelector("nav").append(make("a", { href: "https://github.com/medial-rs/medial/blob/main/docs/external.md#handing-in-results" }, "Hand in results"));
  openTarget();
  document.documentElement.dataset.ready = "";
  // Pictures from files move what is below them.
  await Promise.all([...document.images].map((image) => image.decode().catch(() => null)));
  if (location.hash) openTarget();
};
window.addEventListener("hashchange", openTarget);
window.addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details")) {
    details.open = true;
    details.fill?.();
  }
  for (const image of document.images) image.loading = "eager";
});

