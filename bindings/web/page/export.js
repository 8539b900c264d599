// The panel that writes a robot for another controller.

import { byId, copyButton, downloadButton, element, faultBox, numbers, options } from "./dom.js";
import { waiting } from "./calibrate.js";

const ENDINGS = {
  klipper: "cfg",
  reprapfirmware: "g",
  marlin: "gcode",
  "correction-table": "csv",
  linuxcnc: "hal",
  "linuxcnc-component": "hal",
};

export class Export {
  #engine;
  #files;
  #result = null;

  constructor(engine, files) {
    this.#engine = engine;
    this.#files = files;
    byId("export").addEventListener("submit", (event) => {
      event.preventDefault();
      this.run();
    });
    byId("export-robot").addEventListener("change", () => this.#targets());
  }

  refresh(result) {
    this.#result = result;
    const robots = this.#files.names("robot");
    const own = result ? [[result.output, `${result.output} (this calibration)`]] : [];
    const pairs = robots.map((name) => [name, name]);
    const none = own.length + pairs.length ? [] : [["", "calibrate a robot first"]];
    options(byId("export-robot"), [...own, ...pairs, ...none], result?.output);
    const before = this.#files.find(result?.request.robot)?.kind === "robot" ? result.request.robot : "";
    options(byId("export-nominal"), [["", "the nearest symmetric robot"], ...pairs], before);
    const tables = this.#files.names("samples", "positions", "table").map((name) => [name, name]);
    const heights = result?.home ? result.request.samples[0] : undefined;
    options(byId("export-bed"), [["", "none"], ...tables], heights);
    options(byId("export-positions"), [["", "all over the workspace"], ...tables]);
    if (result?.home) byId("export-home").value = result.home.map((own) => own.toFixed(6)).join(", ");
    byId("exported").replaceChildren();
    this.#targets();
  }

  async #targets() {
    const robot = byId("export-robot").value;
    if (!robot) return options(byId("export-target"), [["", "—"]]);
    const answer = await this.#engine.ask("targets", robot).catch(() => ({}));
    options(byId("export-target"), (answer.Ok ?? []).map(({ name, title }) => [name, title]));
  }

  async run() {
    const number = (id) => (byId(id).value ? Number(byId(id).value) : null);
    const target = byId("export-target").value;
    const request = {
      robot: byId("export-robot").value,
      target,
      nominal: byId("export-nominal").value || null,
      positions: byId("export-positions").value || null,
      bed: byId("export-bed").value || null,
      home: numbers(byId("export-home").value),
      height: number("export-height"),
      platform_radius: number("export-platform"),
      inches: byId("export-inches").checked,
      limit: number("export-limit"),
    };
    const ask = () => this.#engine.ask("export", JSON.stringify(request));
    const answer = await waiting(this.#engine, "Exporting", ask).catch((error) => ({ Err: { message: error.message } }));
    if (answer.Err) {
      byId("exported").replaceChildren(faultBox(answer.Err));
      return;
    }
    const { text, summary, json } = answer.Ok;
    const name = `${target}.${ENDINGS[target] ?? "txt"}`;
    byId("exported").replaceChildren(
      element(
        "div",
        { class: "row" },
        downloadButton(name, () => text),
        copyButton(() => text),
        downloadButton(`${target}.json`, () => json, "application/json"),
      ),
      element("pre", { tabindex: 0, "aria-label": "what is kept and lost" }, summary),
      element("h3", {}, "Lines for the controller"),
      element("pre", { id: "lines", tabindex: 0, "aria-label": "lines for the controller" }, shortened(text)),
    );
  }
}

/** A table of corrections is long. */
function shortened(text) {
  const lines = text.split("\n");
  return lines.length > 400 ? [...lines.slice(0, 400), `… ${lines.length - 400} more lines in the download`].join("\n") : text;
}
