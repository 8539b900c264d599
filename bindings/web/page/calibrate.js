// The panel that calibrates: which files, how, and what it means.

import { byId, copyButton, downloadButton, element, faultBox, field, folded, options, say, titled } from "./dom.js";
import { list, number } from "./numbers.js";
import { bedFigure, samplesFigure } from "./pictures.js";
import { reportElement } from "./report.js";
import { robotFigure } from "./robot3d.js";
import { calibrationOf, find, isMeasured, measurementsOf, outputOf, robotOf, robots, samplesOf, tables, unread, withFields } from "./state.js";
import { verdict } from "./verdict.js";
import { FIELDS, WITHOUT_MEASUREMENTS } from "./words.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Answer<"calibrate">} Answer */
/** @typedef {import("./state.js").Fault} Fault */

/** Warnings beside the verdict; the report has all. */
const WARNINGS = 3;

/** How the text of each field is read. @type {Record<string, (own: HTMLInputElement) => any>} */
const READ = {
  limit: (own) => number(own.value),
  robust: (own) => own.checked,
  rods: (own) => list(own.value),
  radius: (own) => list(own.value).slice(0, 1),
  printed: (own) => list(own.value.replaceAll(/\s*=\s*/g, "=")),
  shrinkage: (own) => list(own.value.replaceAll(/\s*%/g, "%")).slice(0, 1),
};

export class Calibrate {
  #store;
  #files;
  #open;
  /** @type {Answer | null | undefined} */
  #shown;
  #missed = "";
  #said = "";

  /**
   * @param {import("./store.js").Store} store
   * @param {import("./files.js").FileList} files
   * @param {(tab: string) => void} open
   */
  constructor(store, files, open) {
    this.#store = store;
    this.#files = files;
    this.#open = open;
    const form = byId("calibrate");
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("change", (event) => {
      const own = /** @type {HTMLInputElement} */ (event.target);
      const value = READ[own.id]?.(own) ?? own.value;
      const wrong = Number.isNaN(value);
      own.setCustomValidity(wrong ? "a number is needed" : "");
      own.reportValidity();
      if (!wrong) store.update((state) => withFields(state, "calibrate", { [own.id]: value }));
    });
  }

  /** @param {State} state */
  show(state) {
    const robot = find(state, robotOf(state));
    const printer = robot?.kind === "printer";
    const samples = samplesOf(state);
    const all = robots(state);
    options("robot", all.length ? titled(all) : [["", "add a robot file"]], robot?.name ?? "");
    const none = printer ? "saved in the configuration" : "add a samples file";
    const those = titled(measurementsOf(state).map((own) => own.name));
    options("samples", printer || !those.length ? [["saved", none], ...those] : those, samples[0] ?? "saved");
    options("second", [["", "none"], ...those], samples[1] ?? "");
    byId("printer-options").hidden = !printer;
    byId("options").hidden = !robot;
    const from = samples.join(" and ") || (isMeasured(robot) ? "the measurements saved in it" : "no measurements yet");
    byId("chosen").textContent = robot ? `${robot.name}, with ${from}. Options` : "Options";
    const answer = state.asked.calibrate?.answer ?? null;
    const missing = missingOf(state);
    if (answer === this.#shown && missing === this.#missed) return;
    [this.#shown, this.#missed] = [answer, missing];
    if (!answer) this.#missing(missing, state);
    else if (answer.Err) this.#fault(answer.Err);
    else this.#result(state, answer.Ok, answer.milliseconds ?? 0);
  }

  /** Says what is to be added before anything can be calibrated. @param {string} missing @param {State} state */
  #missing(missing, state) {
    if (byId("status").textContent === this.#said) say("");
    const [tab, label] = robotOf(state) ? ["plan", "Plan"] : ["new", "New robot"];
    const way = element("button", { type: "button", onclick: () => this.#open(tab) }, label);
    byId("result").replaceChildren(...(missing ? [element("p", {}, missing, " ", way)] : []));
  }

  /** @param {string} text */
  #say(text) {
    this.#said = text;
    say(text);
  }

  /** @param {Fault} fault */
  #fault(fault) {
    const said = `${fault.message} ${fault.diagnosis ?? ""} ${fault.remedy ?? ""}`;
    /** @type {(label: string, onclick: () => void) => HTMLElement} */
    const button = (label, onclick) => element("button", { type: "button", onclick }, label);
    const named = FIELDS.filter(([option]) => said.includes(option));
    const actions = named.map(([, id, label, value]) => button(label, () => this.#set(id, value)));
    const { file } = fault;
    if (file && find(this.#store.state, file)) {
      // An option whose value is known helps at once.
      const at = named.filter(([, , , value]) => value !== undefined).length;
      actions.splice(at, 0, button(`Fix ${file}`, () => this.#files.edit(file, fault.line)));
    }
    if (WITHOUT_MEASUREMENTS.test(said)) {
      actions.unshift(button("Type heights", () => this.#files.heights.open()));
      actions.unshift(button("Plan touches", () => this.#open("plan")));
    }
    if (fault.json) actions.push(downloadButton("refusal.json", fault.json, { type: "application/json" }));
    byId("result").replaceChildren(faultBox(fault, ...actions));
    this.#say(fault.refused ? "Refused." : "Error.");
  }

  /** @param {string} id @param {string | boolean | undefined} value */
  #set(id, value) {
    const own = field(id);
    /** @type {HTMLDetailsElement} */ (byId("options")).open = true;
    if (value === undefined) {
      own.focus();
      return;
    }
    if (typeof value === "boolean") own.checked = value;
    else own.value = value;
    own.dispatchEvent(new Event("change", { bubbles: true }));
  }

  /** @param {State} state @param {import("./state.js").Calibrated} found @param {number} milliseconds */
  #result(state, found, milliseconds) {
    const output = outputOf(state) ?? "calibrated.toml";
    const { good, crash, sentences, warnings, notes, next } = verdict(found);
    const request = state.asked.calibrate?.request ?? {};
    const { paste, toml, html, json, report } = found;
    // A printer whose lines are to stay needs no file.
    const primary = paste ? copyButton(paste, "Copy the lines", true) : !report.printer && downloadButton(output, toml, { first: true });
    const then = { plan: "Plan touches", validate: "Check it" };
    const shown = warnings.slice(0, WARNINGS).map((own) => element("li", {}, own));
    const more = warnings.length - shown.length;
    const parts = [
      element(
        "section",
        { id: "verdict", class: good ? "good" : "doubtful", "aria-label": "verdict" },
        crash && element("p", { class: "crash", role: "alert" }, element("strong", {}, "Before you paste: "), crash),
        ...sentences.map((own) => element("p", {}, own)),
        ...notes.map((own) => element("p", { class: "note" }, own)),
        shown.length > 0 && element("div", { class: "fault" }, element("strong", {}, warnings.length === 1 ? "A warning:" : `${warnings.length} warnings:`), element("ul", {}, ...shown), more > 0 && `${more} more in the report.`),
        element("div", { class: "row" }, primary, next && element("button", { type: "button", class: !primary && "first", onclick: () => this.#open(next) }, then[next])),
      ),
      found.bed ? bedFigure(found.bed) : samplesFigure(report.samples),
    ];
    if (paste) parts.push(folded("The lines", {}, element("pre", { id: "paste", tabindex: 0, "aria-label": "lines to paste" }, paste)));
    if (found.bed) parts.push(folded("Error of each measurement", {}, samplesFigure(report.samples)));
    parts.push(
      opened("The robot in 3D", { id: "robot-picture" }, () => robotFigure(this.#store, { ...request, after: output }, found.joints)),
      opened("Full report: parameters, uncertainty, warnings", { id: "report" }, () => reportElement(html, "report")),
      folded(
        "Downloads",
        { id: "downloads" },
        element(
          "div",
          { class: "row" },
          (paste || report.printer) && downloadButton(output, toml),
          paste && downloadButton("paste.cfg", paste),
          copyButton(toml, `Copy ${output}`),
          downloadButton("report.html", html, { type: "text/html" }),
          downloadButton("report.json", json, { type: "application/json" }),
        ),
      ),
    );
    byId("result").replaceChildren(...parts.filter((own) => own !== null));
    this.#say(`Calibrated from ${request.samples?.join(" and ") || request.robot} in ${milliseconds.toFixed(0)} ms.`);
  }
}

/** What is to be added to the files; empty where there is enough, or nothing yet. @param {State} state */
function missingOf(state) {
  if (unread(state) || calibrationOf(state)) return "";
  const robot = robotOf(state);
  if (robot) return `${robot} has no samples yet: add their file, or plan what to measure.`;
  const others = tables(state);
  return others.length ? `Add the robot file, or the printer's configuration, of ${others.join(" and ")}.` : "";
}

/**
 * What is made when it is unfolded first: most results are not looked at in all parts.
 * @param {string} title
 * @param {Record<string, any>} attributes
 * @param {() => HTMLElement} make
 */
function opened(title, attributes, make) {
  const own = folded(title, attributes);
  own.addEventListener("toggle", () => own.append(make()), { once: true });
  return own;
}
