// The panel that chooses what to measure: poses of a robot, or touches of a printer's bed.

import { chart } from "./chart.js";
import { byId, choice, copyButton, downloadButton, element, faultBox, field, options, plain, say, shape, titled } from "./dom.js";
import { number } from "./numbers.js";
import { dropped, ended, begun, find, robotOf, robots, tables } from "./state.js";
import { inPageWords } from "./words.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Task} Task */
/** @template {Task} Own @typedef {import("./state.js").Answer<Own>} Answer */

const COUNTS = [8, 12, 16, 20, 30, 40];

export class Plan {
  #store;
  #waiting;
  /** @type {unknown} */
  #planned;
  /** @type {unknown} */
  #drawn;
  #kind = "";

  /** @param {import("./store.js").Store} store @param {import("./waiting.js").Waiting} waiting */
  constructor(store, waiting) {
    this.#store = store;
    this.#waiting = waiting;
    byId("plan").addEventListener("submit", (event) => {
      event.preventDefault();
      store.run("plan", "plan", this.#request());
    });
    byId("plan").addEventListener("change", () => store.update((state) => dropped(dropped(state, "plan"), "curve")));
    byId("plan-curve").addEventListener("click", () => /** @type {HTMLFormElement} */ (byId("plan")).reportValidity() && this.#curve());
  }

  /** @param {State} state */
  show(state) {
    const all = robots(state);
    options("plan-robot", all.length ? titled(all) : [["", "add or make a robot file"]], this.#kind ? undefined : robotOf(state));
    options("plan-check", [["", "no: to calibrate"], ...titled(tables(state))]);
    const kind = find(state, choice("plan-robot").value)?.kind ?? "";
    if (kind !== this.#kind) field("plan-count").value = kind === "printer" ? "16" : "20";
    this.#kind = kind;
    for (const own of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#plan .of-robot"))) own.hidden = kind === "printer";
    byId("plan-go").textContent = kind === "printer" ? "Plan touches" : "Plan";
    this.#show(state.asked.plan?.answer ?? null);
    this.#showCurve(state.asked.curve?.answer ?? null);
  }

  /** @returns {import("./delta_cal_web.js").Request & import("./delta_cal_web.js").PlanRequest} */
  #request() {
    const [measure, frame] = choice("plan-measure").value.split("|");
    const printer = this.#kind === "printer";
    const used = choice("plan-check").value;
    return {
      robot: choice("plan-robot").value,
      count: number(field("plan-count").value),
      ...(!printer && {
        measure,
        sensor: frame === "sensor",
        accuracy: number(field("plan-accuracy").value),
        within: field("plan-within").value.trim() || null,
        absolute: field("plan-absolute").checked,
        shortest: choice("plan-order").value === "shortest",
        seed: number(field("plan-seed").value),
        names: field("plan-names").value.trim() || null,
        samples: used ? [used] : [],
      }),
    };
  }

  /** @param {Answer<"plan"> | null} answer */
  #show(answer) {
    if (answer === this.#planned) return;
    this.#planned = answer;
    const place = byId("planned");
    if (!answer) place.replaceChildren();
    else if (answer.Err) place.replaceChildren(faultBox(answer.Err));
    else place.replaceChildren(...("gcode" in answer.Ok ? touches(answer.Ok) : poses(answer.Ok)));
  }

  /** What so many measurements bring, one plan after the other. */
  async #curve() {
    const request = { ...this.#request(), accuracy: null, samples: [] };
    /** @type {import("./state.js").Point[]} */
    const found = [];
    this.#store.update((state) => begun(state, "curve", request));
    for (const [index, count] of COUNTS.entries()) {
      const answer = this.#store.ask("curve", "plan", { ...request, count });
      this.#waiting.progress(`Planning ${count} measurements, ${index + 1} of ${COUNTS.length}`);
      const { Ok, Err } = (await answer) ?? {};
      if (this.#store.state.asked.curve?.request !== request || Err?.message === "stopped") break;
      if (Ok && "after" in Ok && Ok.after !== null) found.push({ count, before: Ok.before, after: Ok.after });
      const so = Err && !found.length ? { Err } : { Ok: [...found] };
      this.#store.update((state) => ended(state, "curve", request, so));
    }
  }

  /** @param {Answer<"curve"> | null} answer */
  #showCurve(answer) {
    if (answer === this.#drawn) return;
    this.#drawn = answer;
    if (!answer) return byId("curve").replaceChildren();
    if (answer.Err) return byId("curve").replaceChildren(faultBox(answer.Err));
    byId("curve").replaceChildren(curve(answer.Ok));
  }
}

/** @param {import("./delta_cal_web.js").Touches} found @returns {Node[]} */
function touches({ gcode, places, radius }) {
  say(`${places.length} touches planned.`);
  return [
    element("p", {}, `${places.length} touches within ${radius.toFixed(0)} mm of the centre. Run the commands in the printer's console, and drop what it answers here, beside the configuration.`),
    element("div", { class: "row" }, downloadButton("touches.gcode", gcode, { first: true }), copyButton(gcode, "Copy the commands"), printButton()),
    element("div", { class: "pictures" }, view(places.map(([x, y]) => [x, y, 0]), [[-radius, -radius, 0], [radius, radius, 0]], 0, 1, `From above: ${places.length} places in their order`, radius)),
    element("pre", { tabindex: 0, "aria-label": "commands" }, gcode),
    listed(["x_mm,y_mm,height_mm", ...places.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)},`)].join("\n")),
  ];
}

/** @param {string} csv */
const listed = (csv) => element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "checklist" }, checklist(csv));

function printButton() {
  return element("button", { type: "button", onclick: () => window.print() }, "Print the checklist");
}

/** @param {import("./delta_cal_web.js").Poses} found @returns {Node[]} */
function poses({ text, csv, json, places, workspace, after }) {
  say(`${places.length} measurements planned.`);
  return [
    element("div", { class: "row" }, downloadButton(after === null ? "check.csv" : "poses.csv", csv, { type: "text/csv", first: true }), downloadButton("plan.json", json, { type: "application/json" }), printButton()),
    element("pre", { tabindex: 0, "aria-label": "the plan in words" }, inPageWords(plain(text))),
    element("div", { class: "pictures" }, view(places, workspace, 0, 1, "From above: x to the right, y upwards"), view(places, workspace, 0, 2, "From the side: x to the right, z upwards")),
    listed(csv),
  ];
}

/** @param {import("./state.js").Point[]} found */
function curve(found) {
  const points = found.map(({ count, after }) => ({ x: count, y: after, title: `${count}: ${after.toPrecision(2)} mm` }));
  const before = found[0]?.before;
  const rows = found.map(({ count, after }) => element("tr", {}, element("th", { scope: "row" }, `${count}`), element("td", {}, after.toPrecision(2))));
  const head = element("tr", {}, element("th", {}, "measurements"), element("th", {}, "expected error, mm (σ)"));
  return element(
    "figure",
    {},
    chart({ x: "measurements", y: "expected error, mm", series: [{ points, class: "is", line: true }], log: true }),
    element("figcaption", {}, before ? `Before any measurement: ${before.toPrecision(2)} mm.` : "No tolerance is stated."),
    element("table", {}, head, ...rows),
  );
}

/**
 * Poses in their order, seen along an axis.
 * @param {number[][]} at
 * @param {number[][]} space
 * @param {number} across
 * @param {number} up
 * @param {string} caption
 * @param {number} [circle] radius of a bed
 */
function view(at, space, across, up, caption, circle) {
  const all = [...space, ...at];
  const of = (/** @type {number[]} */ own, /** @type {number} */ axis) => own[axis] ?? 0;
  const range = (/** @type {number} */ axis) => [Math.min(...all.map((own) => of(own, axis))), Math.max(...all.map((own) => of(own, axis)))];
  const [[left = 0, right = 0], [low = 0, high = 0]] = [range(across), range(up)];
  const scale = 380 / Math.max(right - left, high - low);
  const place = (/** @type {number[]} */ own) => [30 + (of(own, across) - left) * scale, 30 + (high - of(own, up)) * scale];
  const width = 60 + (right - left) * scale;
  const drawing = shape("svg", { viewBox: `0 0 ${width} ${60 + (high - low) * scale}`, class: "picture view", role: "img", "aria-label": caption });
  if (circle) {
    const [x, y] = place([0, 0, 0]);
    drawing.append(shape("circle", { cx: x, cy: y, r: circle * scale, class: "axis" }));
  } else {
    for (const own of space) {
      const [x, y] = place(own);
      drawing.append(shape("circle", { cx: x, cy: y, r: 2, class: "space-dot" }));
    }
  }
  drawing.append(shape("polyline", { points: at.map((own) => place(own).join(",")).join(" "), class: "way", "stroke-width": 0.7 }));
  /** @type {Label[]} */
  const labels = [];
  for (const [index, own] of at.entries()) {
    const [x = 0, y = 0] = place(own);
    drawing.append(shape("circle", { cx: x, cy: y, r: 4, class: "is" }, shape("title", {}, `${index + 1}: ${own.map((value) => value.toFixed(1)).join(", ")} mm`)));
    labels.push({ x, y, edge: width - 10, numbers: [index + 1] });
  }
  for (const own of shared(shared(labels))) {
    const { x, y } = own;
    const left = isLeft(own);
    drawing.append(shape("text", { x: left ? x - 6 : x + 6, y: y + 4, "text-anchor": left && "end" }, words(own)));
  }
  return element("figure", {}, drawing, element("figcaption", {}, circle ? `${caption}.` : `${caption}; grey: the workspace.`));
}

/** With the right edge of the drawing. @typedef {{x: number, y: number, edge: number, numbers: number[]}} Label */

/** @param {Label} own */
const words = ({ numbers }) => (numbers.length > 5 ? [...numbers.slice(0, 4), "…"] : numbers).join(", ");

/** @param {Label} own */
const widthOf = (own) => 12 + 10 * words(own).length;

/** Whether a label stands to the left of its place. @param {Label} own */
const isLeft = (own) => own.x + widthOf(own) > own.edge;

/** Those whose numbers would touch share a label. @param {Label[]} labels */
function shared(labels) {
  /** @type {Label[]} */
  const found = [];
  /** @param {Label} own */
  const range = (own) => {
    return isLeft(own) ? [own.x - widthOf(own), own.x + 6] : [own.x - 6, own.x + widthOf(own)];
  };
  for (const own of labels) {
    const [left = 0, right = 0] = range(own);
    const near = found.find((other) => {
      const [from = 0, to = 0] = range(other);
      return Math.abs(other.y - own.y) < 18 && from < right && left < to;
    });
    if (near) near.numbers = [...near.numbers, ...own.numbers].sort((one, other) => one - other);
    else found.push({ ...own });
  }
  return found;
}

/** The samples file as a table with a box to tick. @param {string} csv */
function checklist(csv) {
  const lines = csv.split("\n").filter((line) => line && !line.startsWith("#"));
  const [head = [], ...rows] = lines.map((line) => line.split(","));
  // What the nominal robot would read is for comparison: a tenth is enough.
  const nominal = head.map((own) => own.startsWith("_"));
  const named = head.map((own) => own.replace(/^_nominal_/, "nominal ").replace(/^_/, ""));
  const shown = (/** @type {string} */ own, /** @type {number} */ index) => (nominal[index] && number(own) ? Number(own).toFixed(1) : own);
  return element(
    "table",
    { class: "checklist" },
    element("thead", {}, element("tr", {}, element("th", {}, "no."), ...named.map((own) => element("th", {}, own)), element("th", {}, "done"))),
    element(
      "tbody",
      {},
      ...rows.map((row, index) => element("tr", {}, element("th", { scope: "row" }, `${index + 1}`), ...row.map((own, place) => element("td", {}, shown(own, place))), element("td", {}, "☐"))),
    ),
  );
}
