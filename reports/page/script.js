"use strict";
(() => {
  const table = document.querySelector("table.sortable");
  const form = document.querySelector("form.filters");
  if (table && form) {
    const body = table.tBodies[0];
    const rows = [...body.rows];
    const count = form.querySelector("output");

    const show = () => {
      const words = form.elements.text.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const row of rows) {
        const chosen = ["mesh", "method", "asked", "status"].every((name) => {
          const value = form.elements[name].value;
          return value === "" || row.dataset[name] === value;
        });
        const text = words.length ? row.textContent.toLowerCase() : "";
        row.hidden = !(chosen && words.every((word) => text.includes(word)));
        if (!row.hidden) shown += 1;
      }
      count.textContent = `${shown} of ${rows.length} rows`;
    };
    form.hidden = false;
    form.addEventListener("input", show);
    form.addEventListener("reset", () => setTimeout(show));
    form.addEventListener("submit", (event) => event.preventDefault());
    show();

    // Cells without a value sort last in both directions; equal ones keep their order.
    const key = (row, column) => {
      const cell = row.cells[column];
      if (!table.tHead.rows[0].cells[column].classList.contains("num")) return cell.textContent;
      return cell.dataset.v === undefined ? null : Number(cell.dataset.v);
    };
    const sort = (head) => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const sign = down ? -1 : 1;
      const column = head.cellIndex;
      const keyed = rows.map((row, index) => ({ row, index, key: key(row, column) }));
      keyed.sort((a, b) => {
        if (a.key === null || b.key === null) {
          return (a.key === null) - (b.key === null) || a.index - b.index;
        }
        const order = typeof a.key === "number" ? a.key - b.key : a.key.localeCompare(b.key);
        return sign * order || a.index - b.index;
      });
      body.append(...keyed.map((entry) => entry.row));
    };
    for (const head of table.tHead.rows[0].cells) {
      head.tabIndex = 0;
      head.addEventListener("click", () => sort(head));
      head.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") {
          event.preventDefault();
          sort(head);
        }
      });
    }
  }

  const meshes = [...document.querySelectorAll("details.mesh")];
  const fold = document.querySelector(".fold");
  if (fold) {
    fold.hidden = false;
    fold.addEventListener("click", (event) => {
      const wanted = event.target.dataset.fold;
      if (wanted !== undefined) for (const mesh of meshes) mesh.open = wanted === "open";
    });
  }
  const openTarget = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target instanceof HTMLDetailsElement) {
      target.open = true;
      target.scrollIntoView();
    }
  };
  window.addEventListener("hashchange", openTarget);
  openTarget();
  window.addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details")) details.open = true;
  });
})();
