// Elements in few words, and what several parts of the page need.

/** An element with attributes, listeners (`onclick`) and children. */
export function element(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** The same of a drawing. */
export function shape(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function filled(own, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) own.addEventListener(key.slice(2), value);
    else if (value !== false && value !== undefined && value !== null) own.setAttribute(key, value === true ? "" : value);
  }
  own.append(...children.filter((child) => child !== null && child !== undefined));
  return own;
}

export const byId = (id) => document.getElementById(id);

/** What a page in one file has inside it in place of other files. */
export function kept(name) {
  return document.querySelector(`[data-kept=${name}]`)?.textContent;
}

/** Offers a text as a file. */
export function download(name, text, type = "text/plain") {
  const address = URL.createObjectURL(new Blob([text], { type }));
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** A button that downloads. */
export function downloadButton(name, text, type) {
  return element("button", { type: "button", onclick: () => download(name, text(), type) }, `Download ${name}`);
}

/** A button that copies a text, and says that it did. */
export function copyButton(text, label = "Copy") {
  const button = element("button", { type: "button" }, label);
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text());
      button.textContent = "Copied";
    } catch {
      button.textContent = "Copying is blocked: select the text";
    }
    setTimeout(() => (button.textContent = label), 2000);
  });
  return button;
}

/** For a screen reader, and in the line below the heading. */
export function say(text) {
  byId("status").textContent = text;
}

/** A choice. */
export function options(select, values, chosen) {
  const before = chosen ?? select.value;
  select.replaceChildren(...values.map(([value, title]) => element("option", { value }, title)));
  if (values.some(([value]) => value === before)) select.value = before;
}

/** A text for a terminal without its colours. */
export function plain(text) {
  return text.replaceAll(/\u001b\[[0-9;]*m/g, "");
}

/** Numbers in a field: "345" or "345.1, 344.9, 345.0". */
export function numbers(text) {
  const parts = text.split(/[\s,;]+/).filter(Boolean);
  return parts.map(Number);
}

/** What is wrong: cause, place, remedy, and buttons to where it can be mended. */
export function faultBox(fault, ...actions) {
  return element(
    "div",
    { class: "fault", role: "alert" },
    element("p", {}, element("strong", {}, fault.refused ? "Refused: " : "Error: "), fault.message),
    fault.excerpt && element("pre", { tabindex: 0, "aria-label": "the line at fault" }, fault.excerpt),
    fault.diagnosis && element("p", {}, element("strong", {}, "Diagnosis: "), fault.diagnosis),
    fault.remedy && element("p", {}, element("strong", {}, "Help: "), fault.remedy),
    actions.length ? element("p", { class: "row" }, ...actions) : null,
  );
}
