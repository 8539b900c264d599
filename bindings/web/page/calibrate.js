// The panel that calibrates: which files, how, and the result.

import { byId, copyButton, downloadButton, element, faultBox, options, say } from "./dom.js";
import { Stopped } from "./engine.js";
import { pictures } from "./pictures.js";
import { reportElement } from "./report.js";

/** Options of the command that a message may name, and the fields that they are here. */
const FIELDS = [
  ["--frame sensor", "frame", "Positions in the sensor frame", "sensor"],
  ["--robust", "robust", "Leave out samples that disagree", true],
  ["--method fkm", "method", "Method FKM", "fkm"],
  ["--rods", "rods", "State the rods' length"],
  ["--radius", "radius", "State the delta radius"],
  ["--printed", "printed", "State a printed length"],
  ["--columns", "columns", "State the columns"],
  ["M665", "firmware", "Say which firmware"],
];

/** What the owner of a printer states. */
const STATED = ["rods", "radius", "printed", "shrinkage"];

/** Calibrates as soon as the files suffice. */
export class Calibrate {
  /** Files and options of the last result, and the result. */
  result = null;
  #engine;
  #files;
  #done;
  #asked = "";
  #turn = 0;

  /** `done` is told of every result. */
  constructor(engine, files, done) {
    this.#engine = engine;
    this.#files = files;
    this.#done = done;
    byId("calibrate").addEventListener("submit", (event) => {
      event.preventDefault();
      this.run();
    });
    for (const id of ["robot", "samples", "second", "frame", "method", "robust", "limit", "columns", "firmware", ...STATED]) {
      byId(id).addEventListener("change", () => this.run());
    }
  }

  /** After the files changed: chooses those that belong together, and calibrates. */
  refresh() {
    const files = this.#files;
    const robots = files.names("robot", "printer");
    const tables = files.names("samples", "joints", "positions", "plan", "table");
    const pairs = (names, none) => [...(none ? [["", none]] : []), ...names.map((name) => [name, name])];
    options(byId("robot"), pairs(robots, robots.length ? null : "add a robot file"));
    const printer = files.find(byId("robot").value)?.kind === "printer";
    const saved = printer ? "measurements saved in the configuration" : null;
    const before = byId("samples").value;
    options(byId("samples"), pairs(tables, saved ?? (tables.length ? null : "add a samples file")));
    // Joints in one file, positions in another.
    const joints = files.names("joints")[0];
    const positions = files.names("positions")[0];
    options(byId("second"), pairs(tables, "none"), joints && positions ? positions : undefined);
    if (joints && positions && files.names("samples").length === 0) byId("samples").value = joints;
    if (printer && !before && files.names("samples").length) byId("samples").value = files.names("samples")[0];
    byId("printer-options").hidden = !printer;
    this.run({ quietly: true });
  }

  request() {
    const samples = [byId("samples").value, byId("second").value].filter(Boolean);
    return {
      robot: byId("robot").value,
      samples,
      method: byId("method").value || null,
      robust: byId("robust").checked,
      sensor: byId("frame").value === "sensor",
      limit: byId("limit").value ? Number(byId("limit").value) : null,
      ...Object.fromEntries(STATED.map((id) => [id, byId(id).value])),
      columns: byId("columns").value || null,
      firmware: byId("firmware").value || null,
    };
  }

  /** Calibrates what is chosen; quietly only if something changed. */
  async run({ quietly = false } = {}) {
    const request = this.request();
    const printer = this.#files.find(request.robot)?.kind === "printer";
    const ready = request.robot && (request.samples.length || printer);
    byId("go").disabled = !ready;
    if (!ready) {
      if (!this.#files.known.length) this.clear();
      this.#asked = "";
      return;
    }
    const involved = [request.robot, ...request.samples, ...this.#files.names("included")];
    const asked = JSON.stringify([request, involved.map((name) => stamp(this.#engine.files.get(name)))]);
    if (quietly && asked === this.#asked) return;
    this.#asked = asked;
    const turn = ++this.#turn;
    const now = Math.floor(Date.now() / 1000);
    let answer;
    try {
      answer = await waiting(this.#engine, "Calibrating", () =>
        this.#engine.ask("calibrate", JSON.stringify({ ...request, now })),
      );
    } catch (error) {
      if (error instanceof Stopped) say("Stopped.");
      else this.#fault({ message: `the computation failed: ${error.message}`, remedy: "reload the page, and report this file" });
      return;
    }
    if (turn !== this.#turn) return;
    if (answer.Err) this.#fault(answer.Err);
    else this.#show(request, answer.Ok, answer.milliseconds);
  }

  clear() {
    this.result = null;
    byId("result").replaceChildren();
    this.#done(null);
  }

  #fault(fault) {
    this.result = null;
    const said = `${fault.message} ${fault.diagnosis ?? ""} ${fault.remedy ?? ""}`;
    const actions = FIELDS.filter(([option]) => said.includes(option)).map(([, id, label, value]) =>
      element("button", { type: "button", onclick: () => this.#set(id, value) }, label),
    );
    if (fault.file && this.#files.find(fault.file)) {
      actions.unshift(
        element("button", { type: "button", onclick: () => this.#files.edit(fault.file, fault.line) }, `Fix ${fault.file}`),
      );
    }
    if (fault.json) actions.push(downloadButton("refusal.json", () => fault.json, "application/json"));
    byId("result").replaceChildren(faultBox(fault, ...actions));
    say(fault.refused ? "Refused." : "Error.");
    this.#done(null);
  }

  #set(id, value) {
    const field = byId(id);
    byId("options").open = true;
    if (value === undefined) {
      field.focus();
      return;
    }
    if (field.type === "checkbox") field.checked = value;
    else field.value = value;
    this.run();
  }

  async #show(request, found, milliseconds) {
    const output = this.#files.putResult("calibrated.toml", found.toml);
    this.result = { request, output, ...found };
    const paste = found.paste;
    const parts = [
      element(
        "div",
        { class: "row", id: "downloads" },
        downloadButton(output, () => found.toml),
        copyButton(() => found.toml, `Copy ${output}`),
        downloadButton("report.html", () => found.html, "text/html"),
        downloadButton("report.json", () => found.json, "application/json"),
        paste && downloadButton("paste.cfg", () => paste),
        paste && copyButton(() => paste, "Copy the lines to paste"),
        element("button", { type: "button", onclick: () => window.print() }, "Print"),
      ),
    ];
    if (paste) parts.push(element("pre", { id: "paste", tabindex: 0, "aria-label": "lines to paste" }, paste));
    const drawn = element("div", { id: "pictures" });
    parts.push(drawn, reportElement(found.html, "report"));
    byId("result").replaceChildren(...parts);
    say(`Calibrated from ${request.samples.join(" and ") || request.robot} in ${milliseconds.toFixed(0)} ms.`);
    this.#done(this.result);
    drawn.replaceChildren(...(await pictures(this.#engine, this.result)));
  }
}

/** Which content a name had when it was used: another array is another content. */
const stamps = new WeakMap();
let stampsGiven = 0;
function stamp(bytes) {
  if (!bytes) return 0;
  if (!stamps.has(bytes)) stamps.set(bytes, ++stampsGiven);
  return stamps.get(bytes);
}

/**
 * Shows what is being computed and for how long, with a button that stops it. `ask` is given a function that shows another
 * text, and which part is done.
 */
export async function waiting(engine, what, ask) {
  const bar = byId("waiting");
  const begin = performance.now();
  const drawn = bar.querySelector("progress");
  drawn.removeAttribute("value");
  const show = () => {
    const seconds = Math.round((performance.now() - begin) / 1000);
    byId("waiting-text").textContent = seconds ? `${what} … ${seconds} s` : `${what} …`;
  };
  show();
  const later = setTimeout(() => (bar.hidden = false), 200);
  const timer = setInterval(show, 500);
  try {
    return await ask((text, part) => {
      what = text;
      if (part !== undefined) drawn.value = part;
      show();
    });
  } finally {
    clearTimeout(later);
    clearInterval(timer);
    bar.hidden = true;
  }
}
