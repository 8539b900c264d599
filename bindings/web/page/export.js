// The panel that writes a robot for another controller.

import { byId, choice, copyButton, downloadButton, element, faultBox, field, options, titled } from "./dom.js";
import { number, numbers } from "./numbers.js";
import { inPageWords } from "./words.js";
import { dropped, find, names, outputOf } from "./state.js";

/** @typedef {import("./state.js").State} State */

/** @type {Record<string, string>} */
const ENDINGS = {
  klipper: "cfg",
  reprapfirmware: "g",
  marlin: "gcode",
  "correction-table": "csv",
  linuxcnc: "hal",
  "linuxcnc-component": "hal",
};

export class Export {
  #store;
  /** @type {unknown} */
  #shown;
  /** Of which content the targets are. @type {unknown} */
  #targeted;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
    byId("export").addEventListener("submit", (event) => {
      event.preventDefault();
      store.run("export", "export", made(store.state));
    });
    byId("export").addEventListener("change", () => store.update((state) => dropped(state, "export")));
  }

  /** @param {State} state */
  show(state) {
    const output = outputOf(state);
    const { request, answer } = state.asked.calibrate ?? {};
    const robots = names(state, "robot");
    /** @type {[string, string][]} */
    const own = output ? [[output, `${output} (this calibration)`]] : [];
    const all = [...own, ...titled(robots)];
    options("export-robot", all.length ? all : [["", "calibrate a robot first"]], this.#shown === answer ? undefined : (output ?? undefined));
    const nominal = find(state, request?.robot ?? "")?.kind === "robot" ? request?.robot : "";
    options("export-nominal", [["", "the nearest symmetric robot"], ...titled(robots)], this.#shown === answer ? undefined : nominal);
    const tables = titled(names(state, "samples", "positions", "table"));
    options("export-positions", [["", "all over the workspace"], ...tables]);
    const ofPrinter = answer?.Ok?.home && choice("export-robot").value === output;
    options("export-bed", [["", ofPrinter ? "as calibrated" : "none"], ...tables]);
    field("export-home").placeholder = ofPrinter ? "as configured" : "the smallest or largest";
    this.#shown = answer;
    this.#result(state);
    this.#targets(choice("export-robot").value, state);
  }

  /** @param {string} robot @param {State} state */
  async #targets(robot, state) {
    const content = find(state, robot)?.stamp ?? `${robot} ${state.asked.calibrate?.key}`;
    if (content === this.#targeted || !robot) return;
    this.#targeted = content;
    const answer = await this.#store.ask("targets", "targets", { robot });
    if (answer) options("export-target", (answer.Ok ?? []).map(({ name, title }) => [name, title]));
  }

  /** @type {unknown} */
  #answer;

  /** @param {State} state */
  #result(state) {
    const { answer = null, request } = state.asked.export ?? {};
    if (answer === this.#answer) return;
    this.#answer = answer;
    if (!answer) return byId("exported").replaceChildren();
    if (answer.Err) return byId("exported").replaceChildren(faultBox(answer.Err));
    const { text, summary, json } = answer.Ok;
    // They begin with the summary as their comment.
    const lines = text.replace(/^([#;].*\n)+/, "");
    const { target } = request ?? {};
    byId("exported").replaceChildren(
      element(
        "div",
        { class: "row" },
        copyButton(text, "Copy", true),
        downloadButton(`${target}.${ENDINGS[target] ?? "txt"}`, text),
        downloadButton(`${target}.json`, json, { type: "application/json" }),
      ),
      element("pre", { tabindex: 0, "aria-label": "what is kept and lost" }, inPageWords(summary)),
      element("h3", {}, "Lines for the controller"),
      element("pre", { id: "lines", tabindex: 0, "aria-label": "lines for the controller" }, inPageWords(shortened(lines))),
    );
  }
}

/** @param {State} state @returns {import("./state.js").Calls["export"]["request"]} */
function made(state) {
  const robot = choice("export-robot").value;
  const { request, answer } = state.asked.calibrate ?? {};
  const printed = robot !== "" && robot === outputOf(state) && answer?.Ok?.home;
  return {
    robot,
    calibrated_from: printed ? request : null,
    target: choice("export-target").value,
    nominal: choice("export-nominal").value || null,
    positions: choice("export-positions").value || null,
    bed: choice("export-bed").value || null,
    home: numbers(field("export-home").value),
    height: number(field("export-height").value),
    platform_radius: number(field("export-platform").value),
    inches: field("export-inches").checked,
    limit: number(field("export-limit").value),
  };
}

/** A table of corrections is long. @param {string} text */
function shortened(text) {
  const lines = text.split("\n");
  return lines.length > 400 ? [...lines.slice(0, 400), `… ${lines.length - 400} more lines in the download`].join("\n") : text;
}
