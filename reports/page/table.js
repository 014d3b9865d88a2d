// The table of all results. Only the rows near those in sight stand in the document: laying out a
// table costs far more than choosing and ordering its rows.
(async () => {
  const table = document.querySelector("table.sortable");
  const form = document.querySelector("form.filters");
  if (!table || !form) return;
  const FACETS = ["mesh", "method", "asked", "status"];
  const CHUNK = 250;
  const box = table.parentElement;
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  // Rows of the document have an element; those that come packed have what filters and columns ask for, and get
  // their element when they come into sight.
  const packed = document.getElementById("rows");
  const rows = [...body.querySelectorAll("tr")].map((element) => ({ element }));
  if (packed) {
    for (const [facets, values, html] of JSON.parse(await page.unpack(packed))) rows.push({ facets, values, html });
  }
  const numbers = new Map();
  const parser = document.createElement("template");
  const elementOf = (index) => {
    const row = rows[index];
    if (!row.element) {
      parser.innerHTML = row.html;
      row.element = parser.content.firstElementChild;
    }
    numbers.set(row.element, index);
    return row.element;
  };
  const output = form.querySelector("output");
  const boxes = [...form.querySelectorAll("input[name=column]")];
  const make = (tag, className, text) => {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    return element;
  };

  // What is asked of the rows, once for each column.
  const cached = (compute) => {
    const known = new Map();
    return (key) => {
      if (!known.has(key)) known.set(key, compute(key));
      return known.get(key);
    };
  };
  const facet = cached((name) => {
    const place = FACETS.indexOf(name);
    return rows.map((row) => (row.facets ? row.facets[place] : row.element.dataset[name]));
  });
  const textOf = (row) => (row.html ? row.html.replace(/<[^>]*>/g, "") : row.element.textContent);
  const texts = cached(() => rows.map((row) => textOf(row).toLowerCase()));
  const collator = new Intl.Collator("en", { numeric: true });
  // Numbers to sort by; NaN where there is none. Texts count by their rank.
  const keys = cached((column) => {
    const cell = (row) => row.element.children[column];
    if (heads[column].classList.contains("num")) {
      return rows.map((row) => (row.values ? (row.values[column] ?? NaN) : parseFloat(cell(row).dataset.v)));
    }
    const words = rows.map((row) => (row.values ? row.values[column] : cell(row).textContent));
    const ranks = new Map();
    for (const word of [...new Set(words)].sort(collator.compare)) ranks.set(word, ranks.size);
    return words.map((word) => ranks.get(word));
  });

  // Equal rows keep their order; rows without a value come last in both directions.
  let sorted = null;
  let order = rows.map((_, index) => index);
  const sort = (column, down) => {
    sorted = column < 0 ? null : { column, down };
    order = rows.map((_, index) => index);
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
      if (index === column) head.setAttribute("aria-sort", down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
  };

  const chosen = () => {
    const wanted = FACETS.map((name) => [facet(name), form.elements[name].value]);
    const asked = wanted.filter(([, value]) => value !== "");
    const words = form.elements.text.value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = words.length ? texts() : null;
    return order.filter(
      (index) =>
        asked.every(([values, value]) => values[index] === value) &&
        words.every((word) => text[index].includes(word)),
    );
  };

  const opened = new Map();
  const rest = make("tr", "rest");
  const restCell = rest.appendChild(make("td"));
  const restButton = restCell.appendChild(make("button"));
  restCell.colSpan = heads.length;
  restButton.type = "button";
  let matched = [];
  let attached = 0;
  const attach = (count) => {
    const fragment = document.createDocumentFragment();
    const end = Math.min(matched.length, attached + count);
    for (; attached < end; attached += 1) {
      const index = matched[attached];
      const row = elementOf(index);
      const head = row.firstElementChild;
      if (head.firstElementChild.localName !== "button") {
        const button = make("button", "more");
        const { mesh, method, asked } = row.dataset;
        button.type = "button";
        button.setAttribute("aria-label", `details of ${mesh}, ${method}, ${asked}`);
        button.setAttribute("aria-expanded", "false");
        head.prepend(button);
      }
      fragment.append(row);
      if (opened.has(index)) fragment.append(opened.get(index));
    }
    if (attached < matched.length) {
      restButton.textContent = `${matched.length - attached} more rows`;
      fragment.append(rest);
    }
    return fragment;
  };
  const more = (count) => {
    rest.remove();
    body.append(attach(count));
  };
  const show = () => {
    matched = chosen();
    attached = 0;
    body.replaceChildren(attach(CHUNK));
    box.scrollTop = 0;
    output.textContent = `${matched.length} of ${rows.length} rows`;
  };
  restButton.addEventListener("click", () => more(CHUNK));
  new IntersectionObserver(
    (entries) => {
      if (entries.some((entry) => entry.isIntersecting)) more(CHUNK);
    },
    { root: box, rootMargin: "800px" },
  ).observe(rest);
  window.addEventListener("beforeprint", () => more(Infinity));

  // Columns are left out by one rule, not cell by cell.
  const rules = document.head.appendChild(make("style"));
  const chooseColumns = () => {
    const left = boxes.filter((input) => !input.checked).map((input) => {
      const place = 1 + heads.findIndex((head) => head.dataset.key === input.value);
      return `.sortable > * > tr:not(.detail, .rest) > :nth-child(${place})`;
    });
    const rule = left.length ? `${left.join(",\n")} { display: none; }` : "";
    if (rules.textContent !== rule) rules.textContent = rule;
  };

  // The state stands in the address: #results?method=qmat&asked=100&sort=-hausdorff.
  const PREFIX = "#results?";
  const write = () => {
    const state = new URLSearchParams();
    for (const name of [...FACETS, "text"]) {
      if (form.elements[name].value) state.set(name, form.elements[name].value);
    }
    if (sorted) state.set("sort", (sorted.down ? "-" : "") + heads[sorted.column].dataset.key);
    if (boxes.some((input) => input.checked !== input.defaultChecked)) {
      state.set("columns", boxes.filter((input) => input.checked).map((i) => i.value).join(" "));
    }
    const text = state.toString();
    if (!text && !location.hash.startsWith(PREFIX)) return;
    try {
      history.replaceState(null, "", text ? PREFIX + text : "#results");
    } catch {
      // Where the page may not change its address, the state is not kept.
    }
  };
  const read = () => {
    if (!location.hash.startsWith(PREFIX)) return false;
    const state = new URLSearchParams(location.hash.slice(PREFIX.length));
    for (const name of [...FACETS, "text"]) {
      const field = form.elements[name];
      field.value = state.get(name) ?? "";
      // A value that no row has.
      if (field.selectedIndex === -1) field.selectedIndex = 0;
    }
    const columns = state.get("columns")?.split(" ");
    for (const input of boxes) {
      input.checked = columns ? columns.includes(input.value) : input.defaultChecked;
    }
    const by = state.get("sort") ?? "";
    const key = by.replace(/^-/, "");
    sort(heads.findIndex((head) => key && head.dataset.key === key), by.startsWith("-"));
    return true;
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
  form.addEventListener("reset", () =>
    setTimeout(() => {
      sort(-1, false);
      changed();
    }),
  );

  for (const [column, head] of heads.entries()) {
    const button = make("button", "sort", head.textContent);
    button.type = "button";
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const again = sorted?.column === column;
      sort(again && sorted.down ? -1 : column, again);
      changed();
    });
  }

  // Details. Line 0 of the records holds what they share, the others one record each.
  const lines = cached(async () => (await page.unpack(document.getElementById("records"))).split("\n"));
  const recordOf = async (index) => {
    const all = await lines();
    const { keys, values } = JSON.parse(all[0]);
    const record = JSON.parse(all[index + 1]);
    for (const key of keys) if (key in record) record[key] = values[record[key]];
    return record;
  };
  const isObject = (value) => typeof value === "object" && value !== null;
  const words = (key) => key.replaceAll("_", " ");
  const written = (value) => {
    if (Array.isArray(value)) {
      return value.map(written).join(value.some((item) => typeof item === "string") ? "\n" : ", ");
    }
    if (isObject(value)) return JSON.stringify(value);
    return typeof value === "number" && !Number.isInteger(value)
      ? String(Number(value.toPrecision(6)))
      : String(value);
  };
  const tableOf = (list) => {
    const small = make("table");
    const columns = Object.keys(list[0]);
    const head = small.createTHead().insertRow();
    for (const column of columns) head.append(make("th", "num", words(column)));
    const cells = small.createTBody();
    for (const item of list) {
      const row = cells.insertRow();
      for (const column of columns) row.append(make("td", "num", written(item[column] ?? "")));
    }
    return small;
  };
  const group = (title, object, into) => {
    const section = make("section");
    const list = make("dl");
    section.append(make("h4", "", title), list);
    into.append(section);
    for (const [key, value] of Object.entries(object)) {
      const flat = isObject(value) && Object.values(value).every((inner) => !isObject(inner));
      if (Array.isArray(value) && isObject(value[0]) && Object.values(value[0]).every((v) => !isObject(v))) {
        section.append(make("h5", "", words(key)), tableOf(value));
      } else if (isObject(value) && !Array.isArray(value)) {
        group(flat || title === "item" ? `${title}: ${words(key)}` : words(key), value, into);
      } else {
        list.append(make("dt", "", words(key)), make("dd", "", written(value)));
      }
    }
    if (!list.childElementCount) list.remove();
    if (section.childElementCount === 1) section.remove();
  };
  const detailOf = async (index) => {
    const { repeat, simplify, evaluate, initial, ...item } = await recordOf(index);
    const row = make("tr", "detail");
    const cell = row.appendChild(make("td"));
    cell.colSpan = heads.length;
    const all = cell.appendChild(make("div", "known"));
    all.append(make("h4", "", "the same again"));
    const command = all.appendChild(make("pre", "command")).appendChild(make("code", "", repeat));
    command.parentElement.tabIndex = 0;
    const groups = all.appendChild(make("div", "groups"));
    group("item", item, groups);
    if (simplify) group("simplify", simplify, groups);
    if (evaluate) group("evaluate", evaluate, groups);
    if (initial) group("initial medial mesh", initial, groups);
    all.append(make("p", "note", "As recorded: lengths as fractions of the diagonal; seconds; bytes."));
    return row;
  };
  body.addEventListener("click", async (event) => {
    const button = event.target.closest("button.more");
    if (!button) return;
    const row = button.closest("tr");
    const index = numbers.get(row);
    if (opened.has(index)) {
      opened.get(index).remove();
      opened.delete(index);
    } else {
      const detail = await detailOf(index);
      // Pressed twice meanwhile.
      if (opened.has(index)) return;
      opened.set(index, detail);
      if (row.isConnected) row.after(detail);
    }
    button.setAttribute("aria-expanded", String(opened.has(index)));
  });

  // The columns that stay in sight lie side by side, however wide their texts make them.
  const measure = () => {
    const [first, second] = heads.map((head) => head.getBoundingClientRect().width);
    table.style.setProperty("--left-1", `${first}px`);
    table.style.setProperty("--left-2", `${first + second}px`);
    table.style.setProperty("--box", `${box.clientWidth}px`);
  };
  const observer = new ResizeObserver(measure);
  for (const element of [box, heads[0], heads[1]]) observer.observe(element);

  const chooser = form.querySelector("details.columns");
  document.addEventListener("click", (event) => {
    if (!chooser.contains(event.target)) chooser.open = false;
  });
  chooser.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      chooser.open = false;
      chooser.firstElementChild.focus();
    }
  });

  form.hidden = false;
  const fromAddress = read();
  chooseColumns();
  show();
  if (fromAddress) document.getElementById("results").scrollIntoView();
  window.addEventListener("hashchange", () => {
    if (!read()) return;
    chooseColumns();
    show();
    document.getElementById("results").scrollIntoView();
  });
})();
