// The page: tabs, the panels behind them, and what concerns them all.

import { Calibrate } from "./calibrate.js";
import { byId, kept, say } from "./dom.js";
import { Export } from "./export.js";
import { FileList } from "./files.js";
import { NewRobot } from "./new.js";
import { Plan } from "./plan.js";
import { redraw } from "./robot3d.js";
import { Simulate } from "./simulate.js";
import { EMPTY } from "./state.js";
import { Store } from "./store.js";
import { Validate } from "./validate.js";
import { Waiting } from "./waiting.js";

/** @type {Record<string, string[]>} */
const EXAMPLES = {
  "paper-robot": ["robot.toml", "samples.csv"],
  "circle-sheet": ["robot.toml", "samples.csv"],
  printer: ["printer.cfg"],
};

const waiting = new Waiting();
const store = new Store((task) => waiting.show(task));
const files = new FileList(store);
/** @type {{show(state: import("./state.js").State): void}[]} */
const panels = [files, new Calibrate(store, files, open), new Export(store), new Validate(store), new Plan(store, waiting), new Simulate(store, waiting)];
new NewRobot(store, () => open("plan"));
store.listen((state) => {
  for (const panel of panels) panel.show(state);
});
store.update((state) => state);

byId("stop").addEventListener("click", () => store.stop());
byId("clear").addEventListener("click", () => store.update(({ next, fields }) => ({ ...EMPTY, next, fields })));
byId("new-button").addEventListener("click", () => open("new"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-example]"))) {
  button.addEventListener("click", async () => {
    const folder = button.dataset.example ?? "";
    const inside = kept("examples");
    const fetched = (EXAMPLES[folder] ?? []).map(async (name) => {
      const path = `examples/${folder}/${name}`;
      if (inside) return { name, bytes: new TextEncoder().encode(JSON.parse(inside)[path]) };
      const response = await fetch(path);
      if (!response.ok) throw new Error(path);
      return { name, bytes: new Uint8Array(await response.arrayBuffer()) };
    });
    try {
      const found = await Promise.all(fetched);
      store.update(({ next }) => ({ ...EMPTY, next }));
      store.add(found);
      open("calibrate");
    } catch {
      say("The example could not be loaded.");
    }
  });
}

// A field of numbers takes nothing else, and its form is not sent.
for (const own of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll("form input[inputmode], #export-home"))) {
  own.pattern = "[\\d.,;+\\-\\s]*";
  own.title = "a number";
}

const tabs = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[role=tab]")]);

/** @param {string} name */
function open(name) {
  select(byId(`tab-${name}`));
}

/** @param {HTMLElement} tab @param {boolean} [focus] */
function select(tab, focus = false) {
  for (const own of tabs) {
    const chosen = own === tab;
    own.setAttribute("aria-selected", String(chosen));
    own.tabIndex = chosen ? 0 : -1;
    byId(own.getAttribute("aria-controls") ?? "").hidden = !chosen;
  }
  if (focus) tab.focus();
}

for (const [index, tab] of tabs.entries()) {
  tab.addEventListener("click", () => select(tab));
  tab.addEventListener("keydown", ({ key }) => {
    const step = key === "ArrowRight" ? 1 : key === "ArrowLeft" ? -1 : 0;
    const next = tabs[(index + step + tabs.length) % tabs.length];
    if (step && next) select(next, true);
  });
}

// Nothing is kept: leaving the page asks.
window.addEventListener("beforeunload", (event) => {
  if (store.state.files.length > 0) event.preventDefault();
});

if ("serviceWorker" in navigator && location.protocol !== "file:") {
  navigator.serviceWorker.register("sw.js").catch(() => {
    // From a server without https the page works, but only while the server does.
  });
}
