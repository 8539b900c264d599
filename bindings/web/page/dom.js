// Elements in few words, and what several parts of the page need.

import { inPageWords } from "./words.js";

/** @typedef {Node | string | null | undefined | false} Child */

/**
 * An element with attributes, listeners (`onclick`) and children.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, any>} [attributes]
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[Name]}
 */
export function element(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/**
 * The same of a drawing.
 * @template {keyof SVGElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, any>} [attributes]
 * @param {...Child} children
 * @returns {SVGElementTagNameMap[Name]}
 */
export function shape(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

/**
 * @template {Element} Own
 * @param {Own} own
 * @param {Record<string, any>} attributes
 * @param {Child[]} children
 */
function filled(own, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) own.addEventListener(key.slice(2), value);
    else if (value !== false && value !== undefined && value !== null) own.setAttribute(key, value === true ? "" : value);
  }
  own.append(.../** @type {(Node | string)[]} */ (children.filter((child) => child || child === "")));
  return own;
}

/** An element of index.html. @param {string} id */
export function byId(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`index.html has no ${id}`);
  return found;
}

/** A field of index.html. @param {string} id */
export const field = (id) => /** @type {HTMLInputElement} */ (byId(id));

/** @param {string} id */
export const choice = (id) => /** @type {HTMLSelectElement} */ (byId(id));

/** What a page in one file has inside it in place of other files. @param {string} name */
export function kept(name) {
  return document.querySelector(`[data-kept=${name}]`)?.textContent;
}

/**
 * Offers a text as a file.
 * @param {string} name
 * @param {BlobPart} text
 * @param {string} [type]
 */
export function download(name, text, type = "text/plain") {
  const address = URL.createObjectURL(new Blob([text], { type }));
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/**
 * A button that downloads.
 * @param {string} name
 * @param {string} text
 * @param {{type?: string, first?: boolean}} [how]
 */
export function downloadButton(name, text, { type = "text/plain", first = false } = {}) {
  return element("button", { type: "button", class: first && "first", onclick: () => download(name, text, type) }, `Download ${name}`);
}

/**
 * A button that copies a text, and says that it did.
 * @param {string} text
 * @param {string} label
 * @param {boolean} [first]
 */
export function copyButton(text, label, first = false) {
  const button = element("button", { type: "button", class: first && "first" }, label);
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      button.textContent = "Copying is blocked: select the text";
    }
    setTimeout(() => (button.textContent = label), 2000);
  });
  return button;
}

/** For a screen reader, and in the line below the heading. @param {string} text */
export function say(text) {
  byId("status").textContent = text;
}

/**
 * A choice: pairs of value and title, and the one that is chosen.
 * @param {string} id
 * @param {[string, string][]} values
 * @param {string} [chosen]
 */
export function options(id, values, chosen) {
  const select = choice(id);
  const own = chosen ?? select.value;
  const before = [...select.options].map((option) => `${option.value}\n${option.text}`).join("\n");
  if (before !== values.map(([value, title]) => `${value}\n${title}`).join("\n")) {
    select.replaceChildren(...values.map(([value, title]) => element("option", { value }, title)));
  }
  if (values.some(([value]) => value === own)) select.value = own;
}

/** Pairs of a choice of files. @param {string[]} names @returns {[string, string][]} */
export const titled = (names) => names.map((name) => [name, name]);

/** A text for a terminal without its colours. @param {string} text */
export function plain(text) {
  return text.replaceAll(/\u001b\[[0-9;]*m/g, "");
}

/**
 * What is folded away until it is wanted.
 * @param {string} title
 * @param {Record<string, any>} attributes
 * @param {...Child} children
 */
export function folded(title, attributes, ...children) {
  return element("details", attributes, element("summary", {}, title), ...children);
}

/**
 * What is wrong: cause, place, remedy, and buttons to where it can be mended.
 * @param {import("./state.js").Fault} fault
 * @param {...HTMLElement} actions the first of them is the usual one
 */
export function faultBox(fault, ...actions) {
  actions[0]?.classList.add("first");
  const [message, diagnosis, remedy] = [fault.message, fault.diagnosis, fault.remedy].map((own) => inPageWords(own ?? ""));
  return element(
    "div",
    { class: "fault", role: "alert" },
    element("p", {}, element("strong", {}, fault.refused ? "Refused: " : "Error: "), message),
    fault.excerpt && element("pre", { tabindex: 0, "aria-label": "the line at fault" }, fault.excerpt),
    diagnosis && element("p", {}, element("strong", {}, "Diagnosis: "), diagnosis),
    remedy && element("p", {}, element("strong", {}, "Help: "), remedy),
    actions.length > 0 && element("p", { class: "row" }, ...actions),
  );
}
