// A robot without a file: its numbers in a form, each shown in a drawing to scale, written as robot.toml.

import { byId, element, field, shape } from "./dom.js";
import { number } from "./numbers.js";
import { find, free } from "./state.js";

/** @typedef {[string, string, string, number]} Field section, key, label and value */

/** @type {Field[]} */
const ROTARY = [
  ["nominal", "base_radius_mm", "Base: z axis to a motor's axis, mm", 194],
  ["nominal", "platform_radius_mm", "Platform: centre to a forearm's joint, mm", 30],
  ["nominal", "upper_arm_mm", "Upper arm: motor's axis to elbow, mm", 260],
  ["nominal", "forearm_mm", "Forearm: elbow to platform, mm", 480],
  ["joints", "min_deg", "Smallest joint angle, degrees", -60],
  ["joints", "max_deg", "Largest joint angle, degrees", 90],
];
/** @type {Field[]} */
const LINEAR = [
  ["nominal", "tower_radius_mm", "Towers: centre to a tower, less the platform's radius, mm", 140],
  ["nominal", "forearm_mm", "Rods: carriage to platform, mm", 330],
  ["joints", "min_mm", "Smallest travel of a carriage, mm", 100],
  ["joints", "max_mm", "Largest travel of a carriage, mm", 600],
];
/** @type {Field[]} */
const TOLERANCE = [["tolerance", "length_mm", "Tolerance of lengths (σ), mm", 0.5]];
/** @type {Field[]} */
const OF_ROTARY = [["tolerance", "angle_deg", "Tolerance of angles (σ), degrees", 0.2]];
/** @type {Field[]} */
const OF_LINEAR = [
  ["tolerance", "angle_deg", "Tolerance of a tower's lean (σ), degrees", 0.17],
  ["tolerance", "scale", "Tolerance of the travel (σ), as a fraction", 0.001],
  ["tolerance", "zero_mm", "Tolerance of end stops (σ), mm", 5],
];
/** @type {Field[]} */
const NOISE = [
  ["noise", "position_mm", "Noise of a coordinate (σ), mm", 0.02],
  ["noise", "height_mm", "Noise of a height (σ), mm", 0.02],
  ["noise", "distance_mm", "Noise of a distance (σ), mm", 0.05],
];
/** @type {Record<string, Field>} */
const JOINTS = {
  rotary: ["noise", "joint_deg", "Noise of a joint angle (σ), degrees", 0.002],
  linear: ["noise", "joint_mm", "Noise of a carriage (σ), mm", 0.01],
};
/** Choices, the usual one first. @type {Record<string, [string, string, string[]][]>} */
const CONVENTION = {
  rotary: [
    ["joint_positive", "A positive joint angle swings the arm", ["down", "up"]],
    ["z_axis", "The z axis points", ["up", "down"]],
  ],
  linear: [],
};

export class NewRobot {
  /** `written` is called with the file in the list. @param {import("./store.js").Store} store @param {() => void} written */
  constructor(store, written) {
    this.#show();
    byId("new-kind").addEventListener("change", () => this.#show());
    for (const name of ["input", "focusin"]) {
      byId("new-fields").addEventListener(name, (event) => this.#draw(/** @type {HTMLElement} */ (event.target).dataset.key));
    }
    byId("new").addEventListener("submit", (event) => {
      event.preventDefault();
      if (this.#inputs().some((own) => own.dataset.key && own.tagName === "INPUT" && Number.isNaN(number(own.value)))) return;
      // Only what was written here is written again.
      const { state } = store;
      const wanted = field("new-name").value;
      const own = find(state, wanted);
      const name = own && !own.mine ? free(state.files.map((file) => file.name), wanted) : wanted;
      store.write(name, this.text(), { mine: true });
      written();
    });
  }

  #kind() {
    return /** @type {HTMLInputElement} */ (document.querySelector("[name=kind]:checked")).value;
  }

  #show() {
    const kind = this.#kind();
    const linear = kind === "linear";
    const fields = [...(linear ? LINEAR : ROTARY), ...TOLERANCE, ...(linear ? OF_LINEAR : OF_ROTARY), ...NOISE, ...[JOINTS[kind] ?? []]];
    const inputs = /** @type {Field[]} */ (fields).map(([section, key, label, value]) => {
      const required = section === "nominal" || section === "joints";
      const input = element("input", { inputmode: "decimal", autocomplete: "off", required, value, "data-section": section, "data-key": key, id: `new-${section}-${key}` });
      input.addEventListener("input", () => input.setCustomValidity(Number.isNaN(number(input.value)) ? "a number is needed" : ""));
      return element("label", {}, label, input);
    });
    const choices = (CONVENTION[kind] ?? []).map(([key, label, values]) =>
      element("label", {}, label, element("select", { "data-section": "convention", "data-key": key }, ...values.map((own) => element("option", {}, own)))),
    );
    byId("new-fields").replaceChildren(...inputs, ...choices);
    this.#draw();
  }

  /** @returns {(HTMLInputElement | HTMLSelectElement)[]} */
  #inputs() {
    return [.../** @type {NodeListOf<HTMLInputElement>} */ (byId("new-fields").querySelectorAll("[data-key]"))];
  }

  /** The robot file. */
  text() {
    const linear = this.#kind() === "linear";
    const lines = ["# Nominal robot. Lengths in mm, angles in degrees; tolerance and noise are one σ."];
    let section = "";
    const open = (/** @type {string} */ own) => {
      if (own !== section) lines.push("", `[${(section = own)}]`);
    };
    open("nominal");
    if (linear) lines.push('kind = "linear"');
    for (const own of this.#inputs()) {
      const { section: of = "", key } = own.dataset;
      const chosen = own instanceof HTMLSelectElement;
      if (own.value === "" || (chosen && own.selectedIndex === 0)) continue;
      open(of);
      lines.push(`${key} = ${chosen ? `"${own.value}"` : number(own.value)}`);
    }
    return `${lines.join("\n")}\n`;
  }

  /** @param {string} [lit] */
  #draw(lit) {
    /** @param {string} key */
    const value = (key) => number(this.#inputs().find((own) => own.dataset.key === key)?.value ?? "") || 0;
    byId("new-drawing").replaceChildren(this.#kind() === "linear" ? towers(value, lit) : arm(value, lit));
  }
}

/** One arm in its plane, to scale. @param {(key: string) => number} value @param {string} [lit] */
function arm(value, lit) {
  const [base, platform, upper, fore] = ["base_radius_mm", "platform_radius_mm", "upper_arm_mm", "forearm_mm"].map(value);
  const [low, high] = [value("min_deg"), value("max_deg")].map((own) => (own * Math.PI) / 180);
  const angle = Math.min(Math.max(Math.PI / 6, low), high);
  const reach = base + upper;
  const elbow = [base + upper * Math.cos(angle), -upper * Math.sin(angle)];
  const drop = Math.sqrt(Math.max(0, fore ** 2 - (elbow[0] - platform) ** 2));
  const end = [platform, elbow[1] - drop];
  // A joint limit may raise the arm above the base.
  const top = Math.max(0, -upper * Math.sin(low), -upper * Math.sin(high));
  const scale = 330 / Math.max(reach * 1.25, top - end[1], 1);
  /** @param {number[]} own */
  const at = ([x, y]) => [40 + x * scale, 40 + (top - y) * scale];
  /** @param {string} key @param {...Node} shapes */
  const group = (key, ...shapes) => shape("g", { "data-for": key, class: key === lit ? "lit" : "" }, ...shapes);
  /** @param {number[]} from @param {number[]} to */
  const part = (from, to, kind = "part") => {
    const [[x1, y1], [x2, y2]] = [at(from), at(to)];
    return shape("line", { x1, y1, x2, y2, class: kind });
  };
  /** @param {number[]} where @param {string} text */
  const label = (where, text, dx = 0, dy = -8) => {
    const [x, y] = at(where);
    return shape("text", { x: x + dx, y: y + dy, "text-anchor": "middle" }, text);
  };
  /** @param {number} own */
  const limit = (own) => [base + upper * Math.cos(own), -upper * Math.sin(own)];
  return shape(
    "svg",
    { viewBox: "0 0 420 420", class: "picture view", role: "img", "aria-label": "one arm of the robot, to scale" },
    part([0, 0.05 * reach], [0, end[1]], "grid"),
    group("min_deg", part([base, 0], limit(low), "dimension"), label(limit(low), "min", 12)),
    group("max_deg", part([base, 0], limit(high), "dimension"), label(limit(high), "max", -22)),
    group("base_radius_mm", part([0, 0], [base, 0]), label([base / 2, 0], "base radius")),
    group("upper_arm_mm", part([base, 0], elbow), label([(base + elbow[0]) / 2, elbow[1] / 2], "upper arm", 42)),
    group("forearm_mm", part(elbow, end), label([(elbow[0] + end[0]) / 2, (elbow[1] + end[1]) / 2], "forearm", 44, 22)),
    group("platform_radius_mm", part([0, end[1]], end), label([platform, end[1]], "platform radius", 20, 22)),
  );
}

/** One tower, to scale. @param {(key: string) => number} value @param {string} [lit] */
function towers(value, lit) {
  const [radius, rod] = [value("tower_radius_mm"), value("forearm_mm")];
  const [low, high] = [value("min_mm"), value("max_mm")];
  const drop = Math.sqrt(Math.max(0, rod ** 2 - radius ** 2));
  const carriage = Math.min(Math.max(drop * 1.2, low), high);
  const nozzle = carriage - drop;
  const scale = 360 / Math.max(high, radius * 1.6, 1);
  /** @param {number} x @param {number} y */
  const at = (x, y) => [60 + x * scale, 390 - y * scale];
  /** @param {string} key @param {...Node} shapes */
  const group = (key, ...shapes) => shape("g", { "data-for": key, class: key === lit ? "lit" : "" }, ...shapes);
  /** @param {number} x1 @param {number} y1 @param {number} x2 @param {number} y2 */
  const line = (x1, y1, x2, y2, kind = "part") => {
    const [from, to] = [at(x1, y1), at(x2, y2)];
    return shape("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], class: kind });
  };
  /** @param {number} x @param {number} y @param {string} text */
  const label = (x, y, text, dx = 8, dy = 0) => {
    const own = at(x, y);
    return shape("text", { x: own[0] + dx, y: own[1] + dy }, text);
  };
  return shape(
    "svg",
    { viewBox: "0 0 420 420", class: "picture view", role: "img", "aria-label": "one tower of the printer, to scale" },
    line(radius, 0, radius, high, "dimension"),
    line(0, 0, radius, 0, "grid"),
    group("min_mm", line(radius * 0.95, low, radius * 1.05, low), label(radius, low, "smallest travel")),
    group("max_mm", line(radius * 0.95, high, radius * 1.05, high), label(radius, high, "largest travel")),
    group("tower_radius_mm", line(0, nozzle, radius, nozzle, "dimension"), label(0, nozzle, "tower radius", -50, 20)),
    group("forearm_mm", line(radius, carriage, 0, nozzle), label(radius / 2, (carriage + nozzle) / 2, "rod", -40)),
  );
}
