// The panel that chooses what to measure.

import { byId, downloadButton, element, faultBox, options, plain, say, shape } from "./dom.js";
import { waiting } from "./calibrate.js";
import { chart } from "./chart.js";

const COUNTS = [8, 12, 16, 20, 30, 40];

export class Plan {
  #engine;
  #files;

  constructor(engine, files) {
    this.#engine = engine;
    this.#files = files;
    byId("plan").addEventListener("submit", (event) => {
      event.preventDefault();
      this.run();
    });
    byId("plan-curve").addEventListener("click", () => this.curve());
  }

  refresh() {
    const robots = this.#files.names("robot", "printer");
    const pairs = robots.length ? robots.map((name) => [name, name]) : [["", "add a robot file, or make one under New robot"]];
    options(byId("plan-robot"), pairs);
    if (this.#files.find(byId("plan-robot").value)?.kind === "printer") byId("plan-measure").value = "plane|base";
  }

  #request() {
    const [measure, frame] = byId("plan-measure").value.split("|");
    return {
      robot: byId("plan-robot").value,
      measure,
      sensor: frame === "sensor",
      count: Number(byId("plan-count").value),
      accuracy: byId("plan-accuracy").value ? Number(byId("plan-accuracy").value) : null,
      within: byId("plan-within").value || null,
      absolute: byId("plan-absolute").checked,
      shortest: byId("plan-order").value === "shortest",
    };
  }

  async run() {
    const request = this.#request();
    const ask = () => this.#engine.ask("plan", JSON.stringify(request));
    const answer = await waiting(this.#engine, "Planning", ask).catch((error) => ({ Err: { message: error.message } }));
    if (answer.Err) {
      byId("planned").replaceChildren(faultBox(answer.Err));
      return;
    }
    const { text, csv, json, workspace } = answer.Ok;
    const { measurements } = JSON.parse(json);
    say(`${measurements.length} measurements planned.`);
    byId("planned").replaceChildren(
      element(
        "div",
        { class: "row" },
        downloadButton("poses.csv", () => csv, "text/csv"),
        downloadButton("plan.json", () => json, "application/json"),
        element("button", { type: "button", onclick: () => window.print() }, "Print the checklist"),
      ),
      element("pre", { tabindex: 0, "aria-label": "the plan in words" }, plain(text)),
      element(
        "div",
        { class: "pictures" },
        view(measurements, workspace, 0, 1, "From above: x to the right, y upwards"),
        view(measurements, workspace, 0, 2, "From the side: x to the right, z upwards"),
      ),
      element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "checklist" }, checklist(csv)),
    );
  }

  /** What so many measurements bring, one plan after the other. */
  async curve() {
    const request = { ...this.#request(), accuracy: null };
    const found = [];
    try {
      await waiting(this.#engine, "Planning", async (progress) => {
        for (const [index, count] of COUNTS.entries()) {
          progress(`Planning ${count} measurements, ${index + 1} of ${COUNTS.length}`);
          const answer = await this.#engine.ask("plan", JSON.stringify({ ...request, count }));
          if (answer.Err) continue;
          const { before, planned } = JSON.parse(answer.Ok.json);
          found.push({ count, before, planned });
          byId("curve").replaceChildren(this.#drawn(found, request.absolute));
        }
      });
    } catch (error) {
      say(error.message === "stopped" ? "Stopped." : error.message);
    }
    if (found.length === 0) byId("curve").replaceChildren(faultBox({ message: "No plan of up to 40 measurements is possible" }));
  }

  #drawn(found, absolute) {
    const of = (own) => (absolute ? own.absolute : own.relative);
    const points = found.map((own) => ({ x: own.count, y: of(own.planned), title: `${own.count}: ${of(own.planned).toPrecision(2)} mm` }));
    const before = found[0].before && of(found[0].before);
    const rows = found.map((own) =>
      element("tr", {}, element("th", { scope: "row" }, `${own.count}`), element("td", {}, of(own.planned).toPrecision(2))),
    );
    const head = element("tr", {}, element("th", {}, "measurements"), element("th", {}, "expected error, mm (σ)"));
    return element(
      "figure",
      {},
      chart({ x: "measurements", y: "expected error, mm", series: [{ points, class: "is", line: true }], log: true }),
      element("figcaption", {}, before ? `Before any measurement: ${before.toPrecision(2)} mm.` : "No tolerance is stated."),
      element("table", {}, head, ...rows),
    );
  }
}

/** Poses in their order, seen along an axis. */
function view(measurements, workspace, across, up, caption) {
  const at = measurements.map((own) => own.position_mm);
  const all = [...workspace, ...at];
  const range = (axis) => [Math.min(...all.map((own) => own[axis])), Math.max(...all.map((own) => own[axis]))];
  const [[left, right], [low, high]] = [range(across), range(up)];
  const scale = 380 / Math.max(right - left, high - low);
  const place = (own) => [30 + (own[across] - left) * scale, 30 + (high - own[up]) * scale];
  const drawing = shape("svg", { viewBox: `0 0 ${60 + (right - left) * scale} ${60 + (high - low) * scale}`, class: "picture", role: "img", "aria-label": caption });
  for (const own of workspace) {
    const [x, y] = place(own);
    drawing.append(shape("circle", { cx: x, cy: y, r: 2, class: "space-dot" }));
  }
  drawing.append(shape("polyline", { points: at.map((own) => place(own).join(",")).join(" "), class: "way", "stroke-width": 0.7 }));
  for (const [index, own] of at.entries()) {
    const [x, y] = place(own);
    drawing.append(
      shape("circle", { cx: x, cy: y, r: 4, class: "is" }, shape("title", {}, `${index + 1}: ${own.map((value) => value.toFixed(1)).join(", ")} mm`)),
      shape("text", { x: x + 6, y: y + 4 }, `${index + 1}`),
    );
  }
  return element("figure", {}, drawing, element("figcaption", {}, `${caption}; grey: the workspace.`));
}

/** The samples file as a table with a box to tick. */
function checklist(csv) {
  const lines = csv.split("\n").filter((line) => line && !line.startsWith("#"));
  const [head, ...rows] = lines.map((line) => line.split(","));
  return element(
    "table",
    { class: "checklist" },
    element("thead", {}, element("tr", {}, element("th", {}, "no."), ...head.map((own) => element("th", {}, own)), element("th", {}, "done"))),
    element(
      "tbody",
      {},
      ...rows.map((row, index) =>
        element("tr", {}, element("th", { scope: "row" }, `${index + 1}`), ...row.map((own) => element("td", {}, own)), element("td", {}, "☐")),
      ),
    ),
  );
}
