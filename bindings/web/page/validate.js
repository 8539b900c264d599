// The panel that checks a robot against measurements that the calibration did not use.

import { byId, choice, downloadButton, element, faultBox, field, options, say, titled } from "./dom.js";
import { number } from "./numbers.js";
import { reportElement } from "./report.js";
import { dropped, names, outputOf } from "./state.js";

/** @typedef {import("./state.js").State} State */

/** @type {Record<string, string>} */
const VERDICTS = { pass: "Passed.", fail: "Failed.", undecided: "Undecided.", not_judged: "Not judged." };

export class Validate {
  /** @type {unknown} */
  #answer;
  /** @type {string | null} */
  #output = null;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    byId("validate").addEventListener("submit", (event) => {
      event.preventDefault();
      store.run("validate", "validate", made());
    });
    byId("validate").addEventListener("change", () => store.update((state) => dropped(state, "validate")));
  }

  /** @param {State} state */
  show(state) {
    const output = outputOf(state);
    /** @type {[string, string][]} */
    const own = output ? [[output, `${output} (this calibration)`]] : [];
    const all = [...own, ...titled(names(state, "robot"))];
    options("validate-robot", all.length ? all : [["", "calibrate a robot first"]], output !== this.#output ? (output ?? undefined) : undefined);
    this.#output = output;
    const used = state.asked.calibrate?.request.samples ?? [];
    const other = names(state, "samples", "table").filter((name) => !used.includes(name));
    options("validate-samples", other.length ? titled(other) : [["", "add a file"]]);
    const answer = state.asked.validate?.answer ?? null;
    if (answer === this.#answer) return;
    this.#answer = answer;
    if (!answer) return byId("validated").replaceChildren();
    if (answer.Err) return byId("validated").replaceChildren(faultBox(answer.Err));
    const { verdict, html, json } = answer.Ok;
    say(VERDICTS[verdict] ?? "");
    byId("validated").replaceChildren(
      element(
        "div",
        { class: "row" },
        downloadButton("certificate.html", html, { type: "text/html", first: true }),
        downloadButton("validation.json", json, { type: "application/json" }),
        element("button", { type: "button", onclick: () => window.print() }, "Print"),
      ),
      reportElement(html, "certificate"),
    );
  }
}

function made() {
  const frame = choice("validate-frame").value;
  return {
    robot: choice("validate-robot").value,
    samples: [choice("validate-samples").value].filter(Boolean),
    limit: number(field("validate-limit").value),
    sensor: frame !== "base",
    stored: frame === "stored",
  };
}
