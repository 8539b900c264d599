// A report of the program inside the page: the same HTML, in a shadow tree so that its style stays its own.

/** Parts of a report that are shown at once; the others follow, so that a long report does not hold the page. */
const FIRST = 2;

/** The report's page as an element. */
export function reportElement(html, label) {
  // Read as text: the page's policy allows no style elements, and a shadow tree has no :root and no body.
  const style = /<style>([^]*?)<\/style>/.exec(html)?.[1] ?? "";
  const main = /<main>([^]*)<\/main>/.exec(html)?.[1] ?? "";
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(style.replaceAll(":root", ":host").replace(/\bbody\b/g, ".page").replace(/^main\b/gm, ".page"));
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
  for (const part of parts.slice(0, FIRST)) page.append(parsed(part));
  rest(page, parts.slice(FIRST));
  return host;
}

async function rest(page, parts) {
  for (const part of parts) {
    await new Promise((next) => setTimeout(next));
    page.append(parsed(part));
  }
}

function parsed(part) {
  const { body } = new DOMParser().parseFromString(part, "text/html");
  for (const scroll of body.querySelectorAll(".scroll, pre")) {
    scroll.tabIndex = 0;
    scroll.setAttribute("role", "region");
    scroll.setAttribute("aria-label", scroll.closest("section")?.querySelector("h2")?.textContent || "table");
  }
  const fragment = document.createDocumentFragment();
  fragment.append(...body.childNodes);
  return fragment;
}
