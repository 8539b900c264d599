// Pictures of a calibration: every sample with its line, and a printer's bed before and after.

import { chart } from "./chart.js";
import { element, shape } from "./dom.js";

/** @param {number | null} value */
function millimetres(value) {
  return value === null ? "not reached" : `${value.toPrecision(3)} mm`;
}

/**
 * Errors before and after over the lines of the file; the one under the pointer is told.
 * @param {import("./state.js").Calibrated["report"]["samples"]} all
 */
export function samplesFigure(all) {
  if (!all?.length) return null;
  const told = element("output", {}, "Point at a sample, or use the arrow keys, for its line.");
  /** @param {"error_before_mm" | "error_after_mm"} key */
  const points = (key) => all.map((own) => ({ x: own.line, y: own[key] ?? NaN, own }));
  const drawing = chart({
    x: "line of the samples file",
    y: "error, mm",
    log: true,
    label: `Errors of ${all.length} samples before and after over their lines; arrow keys go through them`,
    series: [
      { points: points("error_before_mm"), class: "was" },
      { points: points("error_after_mm"), class: "is" },
    ],
    chosen: ({ own }) => {
      told.textContent =
        `Line ${own.line}: ${millimetres(own.error_before_mm)} before, ${millimetres(own.error_after_mm)} after ` +
        `(${own.error_after_sigma.toPrecision(2)} σ)${own.weight === 0 ? ", left out" : ""}.`;
    },
  });
  return element("figure", { id: "samples-picture" }, drawing, element("figcaption", {}, "Grey: before. Blue: after. ", told));
}

/** How much brighter each step of height is. */
const SHADES = 10;

/**
 * Heights above the bed as colours.
 * @param {import("./delta_cal_web.js").Bed} bed
 */
export function bedFigure({ radius, step, before, after }) {
  const heights = [...before, ...(after ?? [])].map(([, , height = 0]) => Math.abs(height));
  const largest = Math.max(...heights, 1e-6);
  const words = `Colour: up to ${largest.toFixed(2)} mm too high (orange) or too low (blue).`;
  const told = element("output", {}, words);
  /** @param {number[][]} nodes @param {string} name */
  const map = (nodes, name) => {
    const drawing = shape("svg", { viewBox: "-110 -110 220 220", class: "picture", role: "img", "aria-label": `height of the nozzle over the bed, ${name}` });
    // One path for each shade: few nodes, however many places.
    const shades = new Map();
    for (const [x = 0, y = 0, height = 0] of nodes) {
      const shade = Math.sign(height) * Math.ceil((SHADES * Math.abs(height)) / largest);
      const [left, top, side] = [(x - step / 2) / radius, (-y - step / 2) / radius, step / radius].map((own) => (100 * own).toFixed(2));
      shades.set(shade, `${shades.get(shade) ?? ""}M${left} ${top}h${side}v${side}h-${side}z`);
    }
    for (const [shade, d] of shades) {
      drawing.append(shape("path", { d, class: shade > 0 ? "high" : "low", "fill-opacity": (0.05 + (0.95 * Math.abs(shade)) / SHADES).toFixed(2) }));
    }
    drawing.addEventListener("pointermove", (event) => {
      const box = drawing.getBoundingClientRect();
      const [x, y] = [((event.clientX - box.left) / box.width - 0.5) * 2.2 * radius, -((event.clientY - box.top) / box.height - 0.5) * 2.2 * radius];
      const near = nodes.find(([left = 0, top = 0]) => Math.abs(left - x) <= step / 2 && Math.abs(top - y) <= step / 2);
      if (near) told.textContent = `${name}: ${near[2]?.toFixed(3)} mm at x ${near[0]?.toFixed(0)}, y ${near[1]?.toFixed(0)} mm.`;
    });
    return element("div", {}, element("p", { class: "name" }, name), drawing);
  };
  const maps = [map(before, "Now"), ...(after ? [map(after, "With the new lines")] : [])];
  return element("figure", { id: "bed-picture" }, element("div", { class: "pair" }, ...maps), element("figcaption", {}, "Nozzle above the bed where the printer expects contact. ", told));
}
