// A table of x, y and height, typed or pasted from a spreadsheet, as a file.

import { byId, element, say } from "./dom.js";
import { list, number } from "./numbers.js";

const COLUMNS = ["x", "y", "height"];
/** Rows of an empty table. */
const ROWS = 8;

export class Heights {
  /** @param {(text: string) => void} written is given the file */
  constructor(written) {
    const [body, form] = [byId("heights-rows"), byId("heights")];
    form.addEventListener("input", () => this.#grow());
    form.addEventListener("paste", (event) => this.#paste(/** @type {ClipboardEvent} */ (event)));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const rows = [...body.children].map((row) => cells(row).map((own) => own.value));
      const filled = rows.filter((row) => row.some((own) => own.trim()));
      const read = filled.map((row) => row.map(number));
      const at = read.findIndex((row) => row.some((own) => own === null || Number.isNaN(own)));
      if (at >= 0 || read.length === 0) {
        say(at < 0 ? "The table is empty." : `Row ${at + 1}: x, y and height are numbers, in mm.`);
        if (at >= 0) cells(body.children[rows.indexOf(filled[at] ?? [])] ?? body)[0]?.focus();
        return;
      }
      this.close();
      written(["x_mm,y_mm,height_mm", ...read.map((row) => row.join(",")), ""].join("\n"));
    });
    byId("heights-close").addEventListener("click", () => this.close());
  }

  open() {
    byId("heights-rows").replaceChildren(...Array.from({ length: ROWS }, row));
    /** @type {HTMLDetailsElement} */ (byId("input")).open = true;
    byId("heights").hidden = false;
    cells(byId("heights-rows"))[0]?.focus();
  }

  close() {
    byId("heights").hidden = true;
    byId("heights-button").focus();
  }

  /** One empty row remains below. */
  #grow() {
    const body = byId("heights-rows");
    const last = body.lastElementChild;
    if (last && cells(last).some((own) => own.value)) body.append(row(0, body.children.length));
  }

  /** Several cells fill those from here on. @param {ClipboardEvent} event */
  #paste(event) {
    const text = event.clipboardData?.getData("text/plain") ?? "";
    const lines = text.split("\n").filter((line) => line.trim());
    const of = (/** @type {string} */ line) => (line.includes("\t") ? line.split("\t") : list(line));
    const rows = lines.map(of).filter((own) => own.every((cell) => !Number.isNaN(number(cell))));
    if (rows.length < 2 && (rows[0]?.length ?? 0) < 2) return;
    event.preventDefault();
    const body = byId("heights-rows");
    const first = [...body.children].findIndex((own) => own.contains(/** @type {Node} */ (event.target)));
    for (const [index, values] of rows.entries()) {
      while (body.children.length <= first + index) body.append(row(0, body.children.length));
      const own = cells(/** @type {Element} */ (body.children[first + index]));
      for (const [place, value] of values.slice(0, COLUMNS.length).entries()) if (own[place]) own[place].value = value.trim();
    }
    this.#grow();
  }
}

/** @param {Element} within */
const cells = (within) => [...within.querySelectorAll("input")];

/** @param {unknown} _ @param {number} index */
function row(_, index) {
  const fields = COLUMNS.map((name) => element("td", {}, element("input", { inputmode: "decimal", autocomplete: "off", "aria-label": `${name} of row ${index + 1}, mm` })));
  return element("tr", {}, element("th", { scope: "row" }, `${index + 1}`), ...fields);
}
