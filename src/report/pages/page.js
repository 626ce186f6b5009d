"use strict";
(() => {
  const hint = document.getElementById("hint");
  const hide = () => { hint.hidden = true; };
  const show = (mark) => {
    hint.textContent = mark.getAttribute("aria-label");
    hint.hidden = false;
    const at = mark.getBoundingClientRect(), own = hint.getBoundingClientRect();
    const width = document.documentElement.clientWidth;
    const middle = at.left + at.width / 2 - own.width / 2;
    const left = Math.max(8, Math.min(middle, width - own.width - 8));
    const above = at.top - own.height - 8;
    hint.style.left = `${left + scrollX}px`;
    hint.style.top = `${(above > 0 ? above : at.bottom + 8) + scrollY}px`;
  };
  for (const mark of document.querySelectorAll(".mark")) {
    // The browser's own tooltip would cover this one.
    mark.querySelector("title")?.remove();
    mark.addEventListener("pointerenter", () => show(mark));
    mark.addEventListener("pointerleave", () => { if (document.activeElement !== mark) hide(); });
    mark.addEventListener("focus", () => show(mark));
    mark.addEventListener("blur", hide);
  }
  addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });

  const make = (name, properties, ...children) => {
    const element = Object.assign(document.createElement(name), properties);
    element.append(...children);
    return element;
  };
  const slider = (pair, before, after, [left, right]) => {
    const [a, b] = [before, after].map((img) => make("img", { src: img.src, alt: img.alt }));
    const edge = make("div", { className: "edge" });
    const range = make("input", { type: "range", min: 0, max: 100, step: 1, value: 50 });
    range.setAttribute(
      "aria-label",
      `${pair.dataset.label}: share of ${left} that is shown; the rest shows ${right}`,
    );
    const set = () => {
      b.style.clipPath = `inset(0 0 0 ${range.value}%)`;
      edge.style.left = `${range.value}%`;
    };
    range.addEventListener("input", set);
    const stack = make("div", { className: "stack" }, a, b, edge);
    stack.addEventListener("pointermove", (event) => {
      const box = stack.getBoundingClientRect();
      range.value = Math.round(100 * (event.clientX - box.left) / box.width);
      set();
    });
    set();
    const names = [left, right].map((textContent) => make("span", { textContent }));
    const ends = make("div", { className: "ends" }, ...names);
    pair.prepend(make("div", { className: "slider" }, stack, range, ends));
  };
  for (const pair of document.querySelectorAll(".pair[data-sizes=same]")) {
    const [before, after] = pair.querySelectorAll("img");
    slider(pair, before, after, ["A", "B"]);
  }
  for (const pair of document.querySelectorAll(".pair.against-reference")) {
    const reference = pair.closest("section").querySelector(".reference img");
    slider(pair, reference, pair.querySelector("img"), ["the reference", "this"]);
  }

  const sort = (table, i, header) => {
    const down = header.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", down ? "descending" : "ascending");
    const key = (row) => {
      const cell = row.cells[i];
      return cell.dataset.value === undefined ? null : Number(cell.dataset.value);
    };
    const order = (a, b) => {
      const [p, q] = [key(a), key(b)];
      if (p !== null && q !== null) return p - q;
      if (p !== null || q !== null) return p !== null ? -1 : 1;
      return a.cells[i].textContent.localeCompare(b.cells[i].textContent, "en", { numeric: true });
    };
    const rows = [...table.tBodies[0].rows].sort((a, b) => {
      const missing = [a, b].map((row) => row.cells[i].textContent === "—");
      if (missing[0] !== missing[1]) return missing[0] ? 1 : -1;
      return down ? order(b, a) : order(a, b);
    });
    table.tBodies[0].append(...rows);
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((header, i) => {
      const textContent = header.textContent;
      const button = make("button", { type: "button", textContent, title: "Sort by this column" });
      button.addEventListener("click", () => sort(table, i, header));
      header.replaceChildren(button);
    });
  }
})();
