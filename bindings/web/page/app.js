// The page: files, tabs, and the panels that use them.

import { Calibrate } from "./calibrate.js";
import { byId, kept, say } from "./dom.js";
import { Engine } from "./engine.js";
import { Export } from "./export.js";
import { Files } from "./files.js";
import { NewRobot } from "./new.js";
import { Plan } from "./plan.js";
import { Simulate } from "./simulate.js";
import { Validate } from "./validate.js";

const EXAMPLES = {
  "paper-robot": ["robot.toml", "samples.csv"],
  "circle-sheet": ["robot.toml", "samples.csv"],
  printer: ["printer.cfg"],
};

const engine = new Engine();
const files = new Files(engine, () => {
  calibrate.refresh();
  for (const panel of panels) panel.refresh(calibrate.result);
});
const calibrate = new Calibrate(engine, files, (result) => {
  for (const panel of panels) panel.refresh(result);
});
const panels = [new Export(engine, files), new Validate(engine, files), new Plan(engine, files), new Simulate(engine, files)];
new NewRobot(files, () => select(byId("tab-plan")));

byId("stop").addEventListener("click", () => engine.stop());
byId("clear").addEventListener("click", () => files.clear());
byId("new-button").addEventListener("click", () => select(byId("tab-new")));

for (const button of document.querySelectorAll("[data-example]")) {
  button.addEventListener("click", async () => {
    const folder = button.dataset.example;
    const inside = kept("examples");
    const fetched = EXAMPLES[folder].map(async (name) => {
      const path = `examples/${folder}/${name}`;
      if (inside) return [name, new TextEncoder().encode(JSON.parse(inside)[path])];
      const response = await fetch(path);
      return [name, new Uint8Array(await response.arrayBuffer())];
    });
    try {
      const found = await Promise.all(fetched);
      await files.clear();
      await files.add(found);
      select(byId("tab-calibrate"));
    } catch {
      say("The example could not be loaded.");
    }
  });
}

const tabs = [...document.querySelectorAll("[role=tab]")];

function select(tab, focus = false) {
  for (const own of tabs) {
    const chosen = own === tab;
    own.setAttribute("aria-selected", String(chosen));
    own.tabIndex = chosen ? 0 : -1;
    byId(own.getAttribute("aria-controls")).hidden = !chosen;
  }
  if (focus) tab.focus();
}

for (const [index, tab] of tabs.entries()) {
  tab.addEventListener("click", () => select(tab));
  tab.addEventListener("keydown", ({ key }) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[key];
    if (step) select(tabs[(index + step + tabs.length) % tabs.length], true);
  });
}

// Nothing is kept: leaving the page asks.
window.addEventListener("beforeunload", (event) => {
  if (engine.files.size > 0) event.preventDefault();
});

if ("serviceWorker" in navigator && location.protocol !== "file:") {
  navigator.serviceWorker.register("sw.js").catch(() => {
    // From a server without https the page works, but only while the server does.
  });
}
