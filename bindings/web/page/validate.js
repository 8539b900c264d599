// The panel that checks a robot against measurements that the calibration did not use.

import { byId, choice, downloadButton, element, faultBox, field, options, plain, say, titled } from "./dom.js";
import { number } from "./numbers.js";
import { reportElement } from "./report.js";
import { dropped, names, outputOf } from "./state.js";
import { inPageWords } from "./words.js";

/** @typedef {import("./state.js").State} State */

/** @type {Record<string, string>} */
const VERDICTS = { pass: "Passed.", fail: "Failed.", undecided: "Undecided.", not_judged: "Not judged." };

export class Validate {
  /** @type {unknown} */
  #answer;
  /** @type {string | null} */
  #output = null;
  /** Files that were offered before. @type {string[][]} */
  #known = [];

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    byId("validate").addEventListener("submit", (event) => {
      event.preventDefault();
      const isEarlier = store.state.files.some(({ name, kind }) => name === choice("validate-samples").value && kind === "robot");
      const { robot, samples = [], ...request } = made();
      if (isEarlier) store.run("validate", "compare", { robot: samples[0], samples: [robot ?? ""] });
      else store.run("validate", "validate", { robot, samples, ...request });
    });
    byId("validate").addEventListener("change", () => store.update((state) => dropped(state, "validate")));
  }

  /** @param {State} state */
  show(state) {
    const output = outputOf(state);
    /** @type {[string, string][]} */
    const own = output ? [[output, `${output} (this calibration)`]] : [];
    const all = [...own, ...titled(names(state, "robot"))];
    options("validate-robot", all.length ? all : [["", "calibrate a robot first"]], output !== this.#output && !state.asked.validate ? (output ?? undefined) : undefined);
    if (output && output !== this.#output) choice("validate-frame").value = state.asked.calibrate?.request.sensor ? "sensor" : "base";
    this.#output = output;
    const used = state.asked.calibrate?.request.samples ?? [];
    const robot = choice("validate-robot").value;
    const unused = (/** @type {string[]} */ ...kinds) => titled(names(state, ...kinds).filter((name) => !used.includes(name)));
    /** @type {[string, string][]} */
    const earlier = names(state, "robot").filter((name) => name !== robot).map((name) => [name, `${name} (what changed since)`]);
    const lists = [unused("samples", "joints", "plan"), unused("positions")];
    const [checks = [], positions = []] = lists;
    const other = [...checks, ...earlier];
    // The newest are what the robot is to be checked with.
    const [added, second] = lists.map((own, index) => own.find(([name]) => !this.#known[index]?.includes(name))?.[0]);
    this.#known = lists.map((own) => own.map(([name]) => name));
    options("validate-samples", other.length ? other : [["", "add a file"]], added);
    options("validate-second", [["", "none"], ...positions], second);
    const isEarlier = earlier.some(([name]) => name === choice("validate-samples").value);
    for (const own of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#validate .of-samples"))) own.hidden = isEarlier;
    byId("validate-go").textContent = isEarlier ? "Compare" : "Validate";
    const answer = state.asked.validate?.answer ?? null;
    if (answer === this.#answer) return;
    this.#answer = answer;
    if (!answer) return byId("validated").replaceChildren();
    if (answer.Err) return byId("validated").replaceChildren(faultBox(answer.Err));
    if (!("html" in answer.Ok)) {
      const { text, json } = answer.Ok;
      const words = element("pre", { tabindex: 0, "aria-label": "what changed" }, inPageWords(plain(text)));
      return byId("validated").replaceChildren(words, downloadButton("comparison.json", json, { type: "application/json" }));
    }
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

/** @returns {import("./state.js").Calls["validate"]["request"]} */
function made() {
  const frame = choice("validate-frame").value;
  return {
    robot: choice("validate-robot").value,
    samples: [choice("validate-samples").value, choice("validate-second").value].filter(Boolean),
    limit: number(field("validate-limit").value),
    sensor: frame !== "base",
    stored: frame === "stored",
    guard: field("validate-guard").checked,
  };
}
