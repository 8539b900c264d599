// The panel that checks a robot against measurements that the calibration did not use.

import { byId, downloadButton, element, faultBox, options, say } from "./dom.js";
import { waiting } from "./calibrate.js";
import { reportElement } from "./report.js";

const VERDICTS = { pass: "Passed.", fail: "Failed.", undecided: "Undecided.", not_judged: "Not judged." };

export class Validate {
  #engine;
  #files;
  #result = null;

  constructor(engine, files) {
    this.#engine = engine;
    this.#files = files;
    byId("validate").addEventListener("submit", (event) => {
      event.preventDefault();
      this.run();
    });
  }

  refresh(result) {
    const own = result ? [[result.output, `${result.output} (this calibration)`]] : [];
    const pairs = this.#files.names("robot").map((name) => [name, name]);
    const none = own.length + pairs.length ? [] : [["", "calibrate a robot first"]];
    options(byId("validate-robot"), [...own, ...pairs, ...none], result !== this.#result ? result?.output : undefined);
    this.#result = result;
    const tables = this.#files.names("samples", "table");
    const other = tables.filter((name) => !result?.request.samples.includes(name));
    options(byId("validate-samples"), [...(other.length ? other : ["add a file"])].map((name) => [other.length ? name : "", name]));
    byId("validated").replaceChildren();
  }

  async run() {
    const frame = byId("validate-frame").value;
    const request = {
      robot: byId("validate-robot").value,
      samples: [byId("validate-samples").value].filter(Boolean),
      limit: Number(byId("validate-limit").value),
      sensor: frame !== "base",
      stored: frame === "stored",
      now: Math.floor(Date.now() / 1000),
    };
    const ask = () => this.#engine.ask("validate", JSON.stringify(request));
    const answer = await waiting(this.#engine, "Validating", ask).catch((error) => ({ Err: { message: error.message } }));
    if (answer.Err) {
      byId("validated").replaceChildren(faultBox(answer.Err));
      return;
    }
    const { verdict, html, json } = answer.Ok;
    say(VERDICTS[verdict]);
    byId("validated").replaceChildren(
      element(
        "div",
        { class: "row" },
        downloadButton("certificate.html", () => html, "text/html"),
        downloadButton("validation.json", () => json, "application/json"),
        element("button", { type: "button", onclick: () => window.print() }, "Print"),
      ),
      reportElement(html, "certificate"),
    );
  }
}
