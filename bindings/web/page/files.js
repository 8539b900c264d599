// The list of files: dropped, chosen, pasted, typed; what each is, and an editor to mend it.

import { byId, download, element, faultBox, field, say } from "./dom.js";
import { Heights } from "./heights.js";
import { find, free, renamed, without } from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").File} File */
/** @typedef {import("./state.js").Given} Given */

/** A longer text is not shown in the editor. */
const LONGEST = 2_000_000;
/** Larger files are not taken: a browser has no memory for their rows. */
const LARGEST = 400_000_000;
/** Until what is typed is read, ms. */
const TYPING = 300;

export class FileList {
  #store;
  /** @type {string | null} */
  #edited = null;
  /** @type {HTMLElement | null} */
  #opener = null;
  /** @type {File[] | null} */
  #shown = null;
  /** The newest files that were folded away. */
  #folded = 0;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
    this.heights = new Heights((text) => store.write(this.#free("heights.csv"), text));
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
      if (event.dataTransfer) this.#take(await dropped(event.dataTransfer));
    });
    const input = field("choose");
    input.addEventListener("change", () => {
      const files = [...(input.files ?? [])];
      input.value = "";
      this.#take(files);
    });
    byId("choose-button").addEventListener("click", () => input.click());
    byId("paste-button").addEventListener("click", () => {
      const name = this.#free("pasted.txt");
      store.write(name, "");
      this.edit(name);
      say("Paste the text into the editor; it is recognised as you type.");
    });
    byId("heights-button").addEventListener("click", () => this.heights.open());
    document.addEventListener("paste", (event) => {
      if (/** @type {Element} */ (event.target).closest("textarea, input")) return;
      const text = event.clipboardData?.getData("text/plain");
      if (text) store.write(this.#free("pasted.txt"), text);
    });
    this.#wireEditor();
  }

  /** Those that can be read; the others are named. @param {globalThis.File[]} files */
  async #take(files) {
    const read = await Promise.all(
      files.map(async (file) => {
        if (file.size > LARGEST) return `${file.name} has too many rows for a browser (${Math.round(file.size / 1e6)} MB): use the command delta-cal.`;
        try {
          return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
        } catch {
          return `${file.name} could not be read.`;
        }
      }),
    );
    const given = /** @type {Given[]} */ (read.filter((own) => typeof own !== "string"));
    const faults = read.filter((own) => typeof own === "string");
    if (given.length) this.#store.add(given);
    if (faults.length) say(faults.join(" "));
  }

  /** @param {string} name */
  #free(name) {
    return free(this.#store.state.files.map((own) => own.name), name);
  }

  /** @param {State} state */
  show({ files }) {
    if (files === this.#shown) return;
    const grown = files.length > 0;
    this.#shown = files;
    if (this.#edited && !files.some((own) => own.name === this.#edited)) this.#closeEditor();
    byId("files").replaceChildren(...files.filter((own) => own.kind !== "unread").map((own) => this.#item(own)));
    byId("clear").hidden = !grown;
    const summary = files.map((own) => own.name).join(", ");
    byId("files-title").textContent = grown ? `Files: ${summary}` : "Files";
    // What was given is one line as soon as all of it is read; what cannot be read is shown.
    const input = /** @type {HTMLDetailsElement} */ (byId("input"));
    const newest = Math.max(0, ...files.map((own) => own.batch));
    if (!grown) input.open = true;
    else if (newest > this.#folded && !this.#edited && !files.some((own) => own.fault || own.kind === "unread")) {
      this.#folded = newest;
      input.open = false;
    }
  }

  /** @param {File} own */
  #item(own) {
    return element(
      "li",
      { class: own.fault ? "file faulty" : "file", "data-name": own.name, "data-kind": own.kind },
      element(
        "div",
        { class: "row" },
        element("strong", {}, own.name),
        element("span", { class: "what" }, own.what),
        element("span", { class: "space" }),
        own.kind !== "unusable" && this.#button("Edit", own, () => this.edit(own.name)),
        this.#button("Save", own, () => download(own.name, /** @type {BlobPart} */ (own.bytes))),
        this.#button("Remove", own, () => this.#store.update((state) => without(state, own.name))),
      ),
      own.fault && faultBox(own.fault, ...(own.kind === "unusable" ? [] : [this.#button("Fix", own, () => this.edit(own.name, own.fault?.line))])),
    );
  }

  /** @param {string} label @param {File} own @param {() => void} onclick */
  #button(label, own, onclick) {
    return element("button", { type: "button", "aria-label": `${label} ${own.name}`, onclick }, label);
  }

  #wireEditor() {
    const text = /** @type {HTMLTextAreaElement} */ (byId("editor-text"));
    const gutter = byId("editor-lines");
    text.addEventListener("scroll", () => (gutter.scrollTop = text.scrollTop));
    /** @type {ReturnType<typeof setTimeout>} */
    let timer;
    text.addEventListener("input", () => {
      this.#number(text.value);
      clearTimeout(timer);
      const name = this.#edited;
      timer = setTimeout(() => name && this.#store.write(name, text.value), TYPING);
    });
    byId("editor-close").addEventListener("click", () => this.#closeEditor());
    byId("editor-name").addEventListener("change", (event) => {
      const input = /** @type {HTMLInputElement} */ (event.target);
      const [before, name] = [this.#edited, input.value.trim()];
      if (!before || !name || find(this.#store.state, name)) {
        input.value = before ?? "";
        return;
      }
      this.#edited = name;
      this.#store.update((state) => renamed(state, before, name));
    });
  }

  /** @param {string} text @param {number | null} [fault] */
  #number(text, fault) {
    const lines = text.split("\n").length;
    byId("editor-lines").replaceChildren(
      ...Array.from({ length: lines }, (_, index) => element("div", { class: index + 1 === fault && "at" }, `${index + 1}`)),
    );
  }

  /** Opens a file in the editor, at a line. @param {string} name @param {number | null} [line] */
  async edit(name, line) {
    this.#opener = /** @type {HTMLElement | null} */ (document.activeElement);
    const text = await this.#store.text(name);
    if (text === undefined || text === null || text.length > LONGEST) {
      say(`${name} cannot be edited here: ${text ? "it is too long" : "it is not text"}.`);
      return;
    }
    this.#edited = name;
    /** @type {HTMLDetailsElement} */ (byId("input")).open = true;
    byId("editor").hidden = false;
    field("editor-name").value = name;
    const area = /** @type {HTMLTextAreaElement} */ (byId("editor-text"));
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

  /** The focus goes back to where it came from, or to that file's button. */
  #closeEditor() {
    const name = this.#edited;
    this.#edited = null;
    byId("editor").hidden = true;
    const again = /** @type {HTMLElement | null} */ (document.querySelector(`[aria-label="Edit ${CSS.escape(name ?? "")}"]`));
    const opener = this.#opener?.isConnected ? this.#opener : again;
    (opener ?? byId("choose-button")).focus();
  }
}

/** The files of a drop, also those in folders. @param {DataTransfer} transfer @returns {Promise<globalThis.File[]>} */
async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter((own) => own !== null && own !== undefined);
  if (entries.length === 0) return [...transfer.files];
  return (await Promise.all(entries.map(inside))).flat();
}

/** @param {any} entry @returns {Promise<globalThis.File[]>} */
async function inside(entry) {
  if (entry.isFile) return new Promise((resolve) => entry.file((/** @type {globalThis.File} */ file) => resolve([file]), () => resolve([])));
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = /** @type {any[]} */ (await new Promise((resolve) => reader.readEntries(resolve, () => resolve([]))));
    if (some.length === 0) break;
    found.push(...some);
  }
  return (await Promise.all(found.map(inside))).flat();
}
