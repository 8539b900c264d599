// The panel that calibrates simulated robots: what a calibration with these measurements will be worth.

import { chart } from "./chart.js";
import { byId, choice, downloadButton, element, faultBox, field, options, plain, say, titled } from "./dom.js";
import { number } from "./numbers.js";
import { begun, dropped, ended, names } from "./state.js";

/** @typedef {import("./state.js").State} State */

/** How long the worker computes before it tells what it has, ms. */
const TURN = 300;
/** Points of a curve. */
const POINTS = 200;

export class Simulate {
  #store;
  #waiting;
  /** @type {unknown} */
  #answer;

  /** @param {import("./store.js").Store} store @param {import("./waiting.js").Waiting} waiting */
  constructor(store, waiting) {
    this.#store = store;
    this.#waiting = waiting;
    byId("simulate").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#run();
    });
    byId("simulate").addEventListener("change", () => store.update((state) => dropped(state, "simulate")));
  }

  /** @param {State} state */
  show(state) {
    const robots = names(state, "robot");
    options("simulate-robot", robots.length ? titled(robots) : [["", "add or make a robot file"]]);
    const answer = state.asked.simulate?.answer ?? null;
    if (answer === this.#answer) return;
    this.#answer = answer;
    if (!answer) byId("simulated").replaceChildren();
    else byId("simulated").replaceChildren(...(answer.Err ? [faultBox(answer.Err)] : shown(answer.Ok)));
  }

  /** Asks for a range of robots after the other, until there are all or something else is asked for. */
  async #run() {
    const robots = number(field("simulate-robots").value) ?? 0;
    const request = { robot: choice("simulate-robot").value, robots, poses: number(field("simulate-poses").value) ?? 0 };
    this.#store.update((state) => begun(state, "simulate", request));
    let [first, count] = [0, 4];
    do {
      const begin = performance.now();
      const answer = await this.#store.ask("simulate", "simulate", { ...request, first, count });
      if (!answer || this.#store.state.asked.simulate?.request !== request) return;
      if (answer.Err || answer.Ok.done >= robots) {
        this.#store.update((state) => ended(state, "simulate", request, answer));
        return;
      }
      first = answer.Ok.done;
      const fits = (count * TURN) / (performance.now() - begin);
      count = Math.ceil(Math.min(2 * count, fits));
      this.#waiting.progress(`${first} of ${robots} robots`, first / robots);
    } while (first < robots);
  }
}

/** @param {import("./state.js").Found["simulate"]} found @returns {Node[]} */
function shown({ toml, done, summary }) {
  if (!summary) return [];
  const { text, csv, json, errors } = summary;
  say(`${done} robots simulated.`);
  return [
    element(
      "div",
      { class: "row" },
      downloadButton("rows.csv", csv, { type: "text/csv" }),
      downloadButton("summary.json", json, { type: "application/json" }),
      downloadButton("campaign.toml", toml),
    ),
    element("pre", { tabindex: 0, "aria-label": "the campaign in words" }, plain(text)),
    element(
      "figure",
      {},
      chart({
        x: "robots, %",
        y: "position error at most, mm",
        log: true,
        series: [
          { points: quantiles(errors.map((/** @type {number[]} */ [before]) => before)), class: "was", line: true },
          { points: quantiles(errors.map((/** @type {number[]} */ [, after]) => after)), class: "is", line: true },
        ],
      }),
      element("figcaption", {}, "Grey: before. Blue: calibrated."),
    ),
  ];
}

/** The error that this part of the robots does not exceed. @param {number[]} errors */
function quantiles(errors) {
  const sorted = errors.toSorted((one, other) => one - other);
  const count = Math.min(POINTS, sorted.length);
  return Array.from({ length: count }, (_, index) => {
    const place = Math.floor(((index + 1) * sorted.length) / count) - 1;
    return { x: (100 * (place + 1)) / sorted.length, y: sorted[place] ?? 0 };
  });
}
