// The list of files: dropped, chosen, pasted, written here; what each is, and an editor to mend it.

import { byId, download, element, faultBox, say } from "./dom.js";

/** A longer text is not shown in the editor. */
const LONGEST = 2_000_000;

/** The files of the page, and what each was taken for. */
export class Files {
  /** As `recognise` says: name, kind, what, fault. */
  known = [];
  /** Results, which are files for the worker and not for the list. */
  results = new Set();
  #engine;
  #changed;
  #edited = null;
  #turn = 0;

  /** `changed` is told after every recognition. */
  constructor(engine, changed) {
    this.#engine = engine;
    this.#changed = changed;
    const zone = byId("drop");
    for (const name of ["dragover", "dragenter"]) {
      document.addEventListener(name, (event) => {
        event.preventDefault();
        zone.classList.add("over");
      });
    }
    document.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) zone.classList.remove("over");
    });
    document.addEventListener("drop", async (event) => {
      event.preventDefault();
      zone.classList.remove("over");
      this.add(await dropped(event.dataTransfer));
    });
    const input = byId("choose");
    input.addEventListener("change", async () => {
      const files = [...input.files];
      input.value = "";
      this.add(await Promise.all(files.map(read)));
    });
    byId("choose-button").addEventListener("click", () => input.click());
    byId("paste-button").addEventListener("click", () => {
      const name = this.#free("pasted.txt");
      this.put(name, "");
      this.edit(name);
      say("Paste the text into the editor; it is recognised as you type.");
    });
    document.addEventListener("paste", (event) => {
      if (event.target.closest("textarea, input")) return;
      const text = event.clipboardData.getData("text/plain");
      if (text) this.add([[this.#free("pasted.txt"), new TextEncoder().encode(text)]]);
    });
    this.#wireEditor();
  }

  names(...kinds) {
    return this.known.filter((own) => kinds.includes(own.kind)).map((own) => own.name);
  }

  find(name) {
    return this.known.find((own) => own.name === name);
  }

  /** Files as pairs of name and bytes; of two with one name in the same drop the second gets a number. */
  add(files) {
    const taken = new Set();
    for (const [given, bytes] of files) {
      const name = taken.has(given) ? this.#free(given) : given;
      taken.add(name);
      this.results.delete(name);
      this.#engine.put(name, bytes);
    }
    return this.refresh();
  }

  /** A result under a name that no file has. */
  putResult(name, text) {
    const taken = this.#engine.files.has(name) && !this.results.has(name);
    const own = taken ? this.#free(name) : name;
    this.results.add(own);
    this.#engine.put(own, new TextEncoder().encode(text));
    return own;
  }

  put(name, text) {
    return this.add([[name, new TextEncoder().encode(text)]]);
  }

  remove(name) {
    this.#engine.remove(name);
    if (this.#edited === name) this.#closeEditor();
    return this.refresh();
  }

  clear() {
    for (const name of [...this.#engine.files.keys()]) this.#engine.remove(name);
    this.#closeEditor();
    return this.refresh();
  }

  /** Asks what each file is. A later question makes this one's answer void. */
  async refresh() {
    const turn = ++this.#turn;
    const answer = await this.#engine.ask("recognise").catch(() => null);
    if (!answer || turn !== this.#turn) return;
    this.known = answer.Ok.filter((own) => !this.results.has(own.name));
    this.#show();
    this.#changed();
  }

  #free(name) {
    if (!this.#engine.files.has(name)) return name;
    const dot = name.lastIndexOf(".");
    const [stem, end] = dot > 0 ? [name.slice(0, dot), name.slice(dot)] : [name, ""];
    for (let number = 2; ; number++) {
      const other = `${stem}-${number}${end}`;
      if (!this.#engine.files.has(other)) return other;
    }
  }

  #show() {
    byId("files").replaceChildren(
      ...this.known.map((own) =>
        element(
          "li",
          { class: own.fault ? "file faulty" : "file", "data-name": own.name, "data-kind": own.kind },
          element(
            "div",
            { class: "row" },
            element("strong", {}, own.name),
            element("span", { class: "what" }, own.what),
            element("span", { class: "space" }),
            this.#button("Edit", own, () => this.edit(own.name)),
            this.#button("Save", own, () => download(own.name, this.#engine.files.get(own.name), "text/plain")),
            this.#button("Remove", own, () => this.remove(own.name)),
          ),
          own.fault && faultBox(own.fault, this.#button("Fix", own, () => this.edit(own.name, own.fault.line))),
        ),
      ),
    );
    byId("clear").hidden = this.known.length === 0;
  }

  #button(label, own, onclick) {
    return element("button", { type: "button", "aria-label": `${label} ${own.name}`, onclick }, label);
  }

  #wireEditor() {
    const [text, gutter] = [byId("editor-text"), byId("editor-lines")];
    text.addEventListener("scroll", () => (gutter.scrollTop = text.scrollTop));
    let timer;
    text.addEventListener("input", () => {
      this.#number(text.value);
      clearTimeout(timer);
      const name = this.#edited;
      timer = setTimeout(() => this.put(name, text.value), 300);
    });
    byId("editor-close").addEventListener("click", () => this.#closeEditor());
    byId("editor-name").addEventListener("change", (event) => {
      const name = event.target.value.trim();
      if (!name || name === this.#edited || this.#engine.files.has(name)) {
        event.target.value = this.#edited;
        return;
      }
      this.#engine.remove(this.#edited);
      this.#edited = name;
      this.put(name, text.value);
    });
  }

  #number(text, fault) {
    const lines = text.split("\n").length;
    byId("editor-lines").replaceChildren(
      ...Array.from({ length: lines }, (_, index) =>
        element("div", { class: index + 1 === fault ? "at" : false }, `${index + 1}`),
      ),
    );
  }

  /** Opens a file in the editor, at a line. */
  async edit(name, line) {
    const text = await this.#engine.ask("text", name);
    if (text === undefined || text.length > LONGEST) {
      say(`${name} cannot be edited here: ${text === undefined ? "it is not text" : "it is too long"}.`);
      return;
    }
    this.#edited = name;
    byId("editor").hidden = false;
    byId("editor-name").value = name;
    const area = byId("editor-text");
    area.value = text;
    this.#number(text, line);
    area.focus();
    if (line) {
      const before = text.split("\n").slice(0, line - 1).join("\n").length;
      const start = line > 1 ? before + 1 : 0;
      const end = text.indexOf("\n", start);
      area.setSelectionRange(start, end < 0 ? text.length : end);
      area.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(area).lineHeight));
    } else {
      area.setSelectionRange(0, 0);
    }
  }

  #closeEditor() {
    this.#edited = null;
    byId("editor").hidden = true;
  }
}

async function read(file) {
  return [file.name, new Uint8Array(await file.arrayBuffer())];
}

/** The files of a drop, also those in folders. */
async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return Promise.all([...transfer.files].map(read));
  const all = await Promise.all(entries.map(inside));
  return Promise.all(all.flat().map(read));
}

async function inside(entry) {
  if (entry.isFile) return [await new Promise((resolve, reject) => entry.file(resolve, reject))];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    found.push(...some);
  }
  return (await Promise.all(found.map(inside))).flat();
}
