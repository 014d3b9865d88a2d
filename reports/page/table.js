// The table of all results. Only the rows near those in sight are in the document: laying out a
// table costs far more than choosing and ordering its rows.
const resultsOf = (bulk) => {
  const CHUNK = 250;
  const FACETS = ["mesh", "method", "asked", "status"];
  const count = bulk.rows;
  const columnOf = (path) => {
    const column = bulk.columns[path];
    if (!column) return () => null;
    return (row) => column[row];
  };
  const table = { mesh: columnOf("table/mesh"), series: columnOf("table/series"), best: columnOf("table/best") };
  const texts = {};
  for (const key of ["asked", "status", "remark", "link", "topology", "warnings"]) texts[key] = columnOf(`table/${key}`);
  texts.mesh = (row) => report.meshes[table.mesh(row)].name;
  texts.method = (row) => report.series[table.series(row)].name;
  const numbers = { asked: columnOf("table/count"), spheres: columnOf("table/spheres"), edges: columnOf("simplify/edges"),
    faces: columnOf("simplify/faces"), memory: columnOf("simplify/peak_bytes") };
  const text = (key, title, shown = true) => ({ key, title, shown, text: texts[key] });
  const number = (key, title, shown, digits, scale = 1) => ({ key, title, shown, number: numbers[key],
    text: (row) => written(numbers[key](row) === null ? null : numbers[key](row) * scale, digits) });
  const columns = [
    { ...text("mesh", "mesh"), always: true },
    { ...text("asked", "requested"), number: numbers.asked, always: true },
    { ...text("method", "method"), always: true },
    text("status", "status"),
    number("spheres", "spheres", true, "count"),
    number("edges", "edges", false, "count"),
    number("faces", "faces", false, "count"),
    ...report.metrics.map(({ key, title, digits, shown }, k) => {
      numbers[key] = columnOf(`table/${key}`);
      return { ...number(key, title, shown, digits), bit: 1 << k };
    }),
    number("memory", "memory (MB) ↓", true, "count", 1e-6),
    text("betti", "Betti"),
    text("topology", "right topology"),
    text("remark", "remark"),
  ];
  const betti = columnOf("evaluate/betti");
  columns.find(({ key }) => key === "betti").text = (row) => betti(row)?.join(", ") ?? "–";

  const collator = new Intl.Collator("en", { numeric: true });
  const cached = (compute) => {
    const known = new Map();
    return (key) => {
      if (!known.has(key)) known.set(key, compute(key));
      return known.get(key);
    };
  };
  const all = [...Array(count).keys()];
  const searched = cached(() => all.map((row) => columns.map((column) => column.text(row)).join(" ").toLowerCase()));
  // Numbers to sort by, NaN where there is none. Texts count by their rank.
  const keys = cached((column) => {
    const { number: value, text: word } = columns[column];
    if (value) return all.map((row) => value(row) ?? NaN);
    const words = all.map(word);
    const ranks = new Map([...new Set(words)].sort(collator.compare).map((each, rank) => [each, rank]));
    return words.map((each) => ranks.get(each));
  });

  const choices = (name) => {
    const values = name === "mesh" ? report.meshes.map((mesh) => mesh.name)
      : name === "method" ? report.series.map((series) => series.name)
      : name === "asked" ? report.levels : [...new Set(all.map(texts.status))].sort();
    const options = values.map((value) => new Option(value, value));
    return make("label", {}, columns.find(({ key }) => key === name).title, " ",
      make("select", { name }, new Option("all", ""), ...options));
  };
  const boxes = columns.filter((column) => !column.always).map(({ key, shown }) =>
    make("input", { type: "checkbox", name: "column", value: key, checked: shown }));
  const titleOf = (key) => columns.find((column) => column.key === key).title;
  const chooser = make("details", { class: "columns" }, make("summary", {}, "columns"),
    make("div", {}, ...boxes.map((input) => make("label", {}, input, ` ${titleOf(input.value)}`))));
  const output = make("output");
  const form = make("form", { class: "filters" }, ...FACETS.map(choices),
    make("label", {}, "text ", make("input", { type: "search", name: "text" })), chooser,
    make("button", { type: "reset" }, "reset"), " ", output);

  const heads = columns.map(({ key, title, number: isNumber }, column) => {
    const button = make("button", { type: "button", class: "sort" }, title);
    button.addEventListener("click", () => {
      const again = sorted?.column === column;
      sort(again && sorted.down ? -1 : column, again);
      changed();
    });
    return make("th", { scope: "col", "data-key": key, class: isNumber ? "num" : null }, button);
  });
  const body = make("tbody");
  const grid = make("table", { class: "sortable" }, make("thead", {}, make("tr", {}, ...heads)), body);
  const box = make("div", { class: "scroll tall", tabindex: 0 }, grid);

  // Equal rows keep their order; rows without a value come last in both directions.
  let [sorted, order] = [null, all];
  const sort = (column, down) => {
    sorted = column < 0 ? null : { column, down };
    order = [...all];
    if (sorted) {
      const key = keys(column);
      const sign = down ? -1 : 1;
      order.sort((a, b) => {
        const [x, y] = [key[a], key[b]];
        if (x !== x || y !== y) return (x !== x) - (y !== y) || a - b;
        return sign * (x - y) || a - b;
      });
    }
    heads.forEach((head, index) => {
      head.ariaSort = index !== column ? null : down ? "descending" : "ascending";
    });
  };
  const chosen = () => {
    const criteria = FACETS.map((name) => [texts[name], form.elements[name].value]).filter(([, value]) => value !== "");
    const words = form.elements.text.value.toLowerCase().split(/\s+/).filter(Boolean);
    const searching = words.length ? searched() : null;
    return order.filter((row) => criteria.every(([value, wanted]) => value(row) === wanted) &&
      words.every((word) => searching[row].includes(word)));
  };

  const cellOf = (row, { key, text: words, number: value, bit }) => {
    const shown = words(row) ?? "";
    if (key === "method") return make("td", {}, dot(table.series(row)), shown);
    if (key === "status") return make("td", {}, make("span", { class: `status ${shown.replaceAll(" ", "_")}` }, shown));
    if (key === "remark") {
      const [link, warnings] = [texts.link(row), texts.warnings(row)];
      return make("td", { class: "wrap" },
        link && make("a", { href: link }, ".ma"),
        warnings && make("span", { title: warnings.join("\n") }, `${link ? ", " : ""}${counted(warnings.length, "warning", "warnings")}`),
        shown && make("div", { class: "brief", title: shown }, shown));
    }
    if (!value) return make("td", {}, shown);
    const best = bit && table.best(row) & bit;
    return make("td", { class: "num", "data-v": value(row) }, best ? make("strong", {}, shown) : shown);
  };
  const opened = new Map();
  const rowOf = (row) => {
    const [mesh, method, level] = ["mesh", "method", "asked"].map((key) => texts[key](row));
    const more = make("button", { type: "button", class: "more", "aria-expanded": String(opened.has(row)),
      "aria-label": `details of ${mesh}, ${method}, ${level}` });
    const element = make("tr", { "data-mesh": mesh, "data-method": method },
      make("th", { scope: "row" }, more, make("a", { href: `#mesh-${report.meshes[table.mesh(row)].stem}` }, mesh)),
      ...columns.slice(1).map((column) => cellOf(row, column)));
    more.addEventListener("click", () => {
      const detail = opened.get(row);
      if (detail) {
        detail.remove();
        opened.delete(row);
      } else {
        opened.set(row, detailOf(row));
        element.after(opened.get(row));
      }
      more.setAttribute("aria-expanded", String(!detail));
    });
    return [element, opened.get(row)];
  };

  const restButton = make("button", { type: "button" });
  const rest = make("tr", { class: "rest" }, make("td", { colspan: columns.length }, restButton));
  let [matched, attached] = [[], 0];
  const more = (number) => {
    const end = Math.min(matched.length, attached + number);
    const rows = matched.slice(attached, end).flatMap(rowOf).filter(Boolean);
    attached = end;
    rest.remove();
    body.append(...rows);
    restButton.textContent = `${matched.length - attached} more rows`;
    if (attached < matched.length) body.append(rest);
  };
  const show = () => {
    matched = chosen();
    attached = 0;
    body.replaceChildren();
    more(CHUNK);
    box.scrollTop = 0;
    output.textContent = `${matched.length} of ${count} rows`;
  };
  restButton.addEventListener("click", () => more(CHUNK));
  new IntersectionObserver((entries) => entries.some((entry) => entry.isIntersecting) && more(CHUNK),
    { root: box, rootMargin: "800px" }).observe(rest);
  window.addEventListener("beforeprint", () => more(Infinity));

  // All recorded values of a row, by the parts of the record.
  const detailOf = (row) => {
    const groups = new Map();
    for (const path of Object.keys(bulk.columns)) {
      const value = columnOf(path)(row);
      const [title, ...names] = path.split("/");
      if (title === "table" || value === null) continue;
      if (!groups.has(title)) groups.set(title, []);
      groups.get(title).push([names.join(": ").replaceAll("_", " "), valueOf(value)]);
    }
    const command = code(columnOf("item/command")(row) ?? "");
    command.tabIndex = 0;
    const sections = [...groups].map(([title, pairs]) => make("section", {}, make("h4", {}, title.replaceAll("_", " ")), listOf(pairs)));
    const known = make("div", { class: "known" }, make("h4", {}, "Command of the run"), command, make("div", { class: "groups" }, ...sections),
      note("As recorded: lengths as fractions of the diagonal, seconds, bytes."));
    return make("tr", { class: "detail" }, make("td", { colspan: columns.length }, known));
  };
  const valueOf = (value) => {
    if (typeof value === "number") return String(Number.isInteger(value) ? value : Number(value.toPrecision(4)));
    if (!Array.isArray(value)) return typeof value === "object" ? JSON.stringify(value) : String(value);
    if (typeof value[0] !== "object") return value.join(typeof value[0] === "string" ? "\n" : ", ");
    const names = Object.keys(value[0]).map((name) => ({ title: name.replaceAll("_", " "), number: true }));
    return tableOf({ columns: names, rows: value.map((item) => Object.values(item).map(valueOf)) });
  };

  // Columns are left out by one rule, not cell by cell.
  const rules = document.head.appendChild(make("style"));
  const chooseColumns = () => {
    const left = boxes.filter((input) => !input.checked).map((input) => 1 + columns.findIndex(({ key }) => key === input.value));
    rules.textContent = left.map((place) => `.sortable > * > tr:not(.detail, .rest) > :nth-child(${place}) { display: none; }`).join("\n");
  };

  // The address stores the state: #results?method=qmat&asked=100&sort=-hausdorff.
  const PREFIX = "#results?";
  const write = () => {
    const state = new URLSearchParams();
    for (const name of [...FACETS, "text"]) {
      if (form.elements[name].value) state.set(name, form.elements[name].value);
    }
    if (sorted) state.set("sort", (sorted.down ? "-" : "") + columns[sorted.column].key);
    if (boxes.some((input) => input.checked !== input.defaultChecked)) {
      state.set("columns", boxes.filter((input) => input.checked).map((input) => input.value).join(" "));
    }
    const words = state.toString();
    if (!words && !location.hash.startsWith(PREFIX)) return;
    // A page from some places may not change its address: the state is then lost.
    try { history.replaceState(null, "", words ? PREFIX + words : "#results"); } catch { }
  };
  const read = () => {
    if (!location.hash.startsWith(PREFIX)) return;
    const state = new URLSearchParams(location.hash.slice(PREFIX.length));
    for (const name of [...FACETS, "text"]) {
      const field = form.elements[name];
      field.value = state.get(name) ?? "";
      // A value that no row has.
      if (field.selectedIndex === -1) field.selectedIndex = 0;
    }
    const wanted = state.get("columns")?.split(" ");
    for (const input of boxes) input.checked = wanted ? wanted.includes(input.value) : input.defaultChecked;
    const by = state.get("sort") ?? "";
    sort(columns.findIndex(({ key }) => by && key === by.replace(/^-/, "")), by.startsWith("-"));
    chooseColumns();
    show();
    document.getElementById("results")?.scrollIntoView();
  };
  let writing;
  const changed = () => {
    chooseColumns();
    show();
    clearTimeout(writing);
    writing = setTimeout(write, 200);
  };
  form.addEventListener("input", changed);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(() => {
    sort(-1, false);
    changed();
  }));
  document.addEventListener("click", (event) => {
    if (!chooser.contains(event.target)) chooser.open = false;
  });
  chooser.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    chooser.open = false;
    chooser.firstElementChild.focus();
  });

  // The columns that stay in sight lie side by side, however wide their texts make them.
  const measure = () => {
    const [first, second] = heads.map((head) => head.getBoundingClientRect().width);
    grid.style.setProperty("--left-1", `${first}px`);
    grid.style.setProperty("--left-2", `${first + second}px`);
    grid.style.setProperty("--box", `${box.clientWidth}px`);
  };
  const observer = new ResizeObserver(measure);
  for (const element of [box, heads[0], heads[1]]) observer.observe(element);
  window.addEventListener("hashchange", read);
  chooseColumns();
  show();
  // The address may name rows: read after the table is in the document.
  queueMicrotask(read);
  return [form, box, note(UNITS)];
};
