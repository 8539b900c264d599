// A report of the program inside the page: the same HTML, in a shadow tree so that its style stays its own.

import { inPageWords } from "./words.js";

/** The text of figures keeps its size, and tables fit the page, which is narrower than the report's. */
const OWN = `
@media screen { figure svg { min-width: 36rem } .views { display: block } .views svg { max-width: 36rem } .wide :is(th, td) { padding: .12rem .3rem } }
@media print { .scroll table { font-size: 7pt } .scroll :is(th, td) { padding: 0 .3em } }`;
/** Sections, rows of a table or marks of a figure that are added at once: a long report does not hold the page. */
const [SECTIONS, AT_ONCE] = [2, 100];

/** The report's page as an element. @param {string} html @param {string} label */
export function reportElement(html, label) {
  // Read as text: the page's policy allows no style elements, and a shadow tree has no :root and no body.
  const style = /<style>([^]*?)<\/style>/.exec(html)?.[1] ?? "";
  const main = /<main>([^]*)<\/main>/.exec(html)?.[1] ?? "";
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(style.replaceAll(":root", ":host").replace(/\bbody\b/g, ".page").replace(/^main\b/gm, ".page") + OWN);
  const host = document.createElement("div");
  host.className = "report";
  host.setAttribute("role", "region");
  host.setAttribute("aria-label", label);
  const shadow = host.attachShadow({ mode: "open" });
  shadow.adoptedStyleSheets = [sheet];
  const page = document.createElement("div");
  page.className = "page";
  shadow.append(page);
  const parts = main.split(/(?=<section[ >]|<footer>)/);
  for (const part of parts.slice(0, SECTIONS)) page.append(...parsed(part).childNodes);
  rest(page, parts.slice(SECTIONS));
  return host;
}

/** @param {Element} page @param {string[]} parts */
async function rest(page, parts) {
  for (const part of parts) {
    await pause();
    const body = parsed(part);
    const long = [...body.querySelectorAll("tbody, svg, svg g")].filter((own) => own.childElementCount > AT_ONCE);
    const held = long.map((own) => /** @type {const} */ ([own, [...own.childNodes]]));
    for (const [own] of held) own.replaceChildren();
    page.append(...body.childNodes);
    for (const [own, children] of held) {
      for (let first = 0; first < children.length; first += AT_ONCE) {
        own.append(...children.slice(first, first + AT_ONCE));
        await pause();
      }
    }
  }
}

/** Long enough for a frame to be drawn. */
function pause() {
  return new Promise((next) => setTimeout(next, 16));
}

/** A part of a page; its scrolling tables can be reached with the keys. @param {string} part */
function parsed(part) {
  const { body } = new DOMParser().parseFromString(part, "text/html");
  for (const scroll of /** @type {NodeListOf<HTMLElement>} */ (body.querySelectorAll(".scroll, pre"))) {
    scroll.tabIndex = 0;
    scroll.setAttribute("role", "region");
    scroll.setAttribute("aria-label", scroll.closest("section")?.querySelector("h2")?.textContent || "table");
  }
  // Only here: what is downloaded is the command's.
  const texts = document.createTreeWalker(body, NodeFilter.SHOW_TEXT);
  for (let own = texts.nextNode(); own; own = texts.nextNode()) {
    const words = inPageWords(own.nodeValue ?? "");
    if (words !== own.nodeValue) own.nodeValue = words;
  }
  return body;
}
