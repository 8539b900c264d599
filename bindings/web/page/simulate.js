// The panel that calibrates simulated robots: what a calibration with these measurements will be worth.

import { byId, downloadButton, element, faultBox, options, plain, say } from "./dom.js";
import { waiting } from "./calibrate.js";
import { chart } from "./chart.js";

/** How long the worker computes before it tells what it has, ms. */
const TURN = 300;
/** Points of a curve. */
const POINTS = 200;

export class Simulate {
  #engine;
  #files;
  #turn = 0;

  constructor(engine, files) {
    this.#engine = engine;
    this.#files = files;
    byId("simulate").addEventListener("submit", (event) => {
      event.preventDefault();
      this.run();
    });
  }

  refresh() {
    const robots = this.#files.names("robot");
    const none = [["", "add a robot file, or make one under New robot"]];
    options(byId("simulate-robot"), robots.length ? robots.map((name) => [name, name]) : none);
  }

  /** Asks for a range of robots after the other. A later campaign ends this one. */
  async run() {
    const turn = ++this.#turn;
    const robots = Number(byId("simulate-robots").value);
    const request = {
      robot: byId("simulate-robot").value,
      robots,
      poses: Number(byId("simulate-poses").value),
    };
    let [first, count, answer] = [0, 4];
    try {
      await waiting(this.#engine, "Simulating", async (progress) => {
        while (first < robots && turn === this.#turn) {
          const begin = performance.now();
          answer = await this.#engine.ask("simulate", JSON.stringify({ ...request, first, count }));
          if (answer.Err) return;
          first = answer.Ok.done;
          const fits = (count * TURN) / (performance.now() - begin);
          count = Math.ceil(Math.min(2 * count, fits));
          progress(`${first} of ${robots} robots`, first / robots);
        }
      });
    } catch (error) {
      answer = { Err: { message: error.message } };
    }
    if (turn !== this.#turn) return;
    byId("simulated").replaceChildren(...(answer.Err ? [faultBox(answer.Err)] : this.#shown(robots, answer.Ok)));
  }

  #shown(robots, { toml, summary: { text, csv, json, errors } }) {
    say(`${robots} robots simulated.`);
    return [
      element(
        "div",
        { class: "row" },
        downloadButton("rows.csv", () => csv, "text/csv"),
        downloadButton("summary.json", () => json, "application/json"),
        downloadButton("campaign.toml", () => toml),
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
            { points: quantiles(errors.map(([before]) => before)), class: "was", line: true },
            { points: quantiles(errors.map(([, after]) => after)), class: "is", line: true },
          ],
        }),
        element("figcaption", {}, "Grey: before. Blue: calibrated."),
      ),
    ];
  }
}

/** The error that this part of the robots does not exceed. */
function quantiles(errors) {
  const sorted = errors.toSorted((one, other) => one - other);
  const count = Math.min(POINTS, sorted.length);
  return Array.from({ length: count }, (_, index) => {
    const place = Math.floor(((index + 1) * sorted.length) / count) - 1;
    return { x: (100 * (place + 1)) / sorted.length, y: sorted[place] };
  });
}
