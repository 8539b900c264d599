// A chart of points with axes, which says what is under the pointer or chosen with the keys.

import { shape } from "./dom.js";

const [HEIGHT, LEFT, BOTTOM, MARGIN] = [300, 62, 44, 14];
/** As wide as the page, within these, px: the text keeps its size. */
const [NARROWEST, WIDEST] = [280, 640];

/** @typedef {{x: number, y: number, title?: string, own?: any}} Point */
/** @typedef {Point & {at: [number, number]}} Placed */

/** Round steps over a range. @param {number} low @param {number} high */
function steps(low, high) {
  const raw = (high - low) / 6 || 1;
  const size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5].map((own) => own * size).find((own) => own >= raw) ?? 10 * size;
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-9; value += step) found.push(Number(value.toPrecision(12)));
  return found;
}

/** 1, 2 and 5 times powers of ten over a range. @param {number} low @param {number} high */
function decades(low, high) {
  const found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
    for (const own of [1, 2, 5]) {
      const value = Number((own * 10 ** power).toPrecision(2));
      if (value >= low && value <= high) found.push(value);
    }
  }
  return found;
}

/**
 * `series`: `{points: [{x, y, title, …}], class, line}`. `chosen` is told of the point under the pointer; arrow keys go from
 * point to point of the last series.
 * @param {{x: string, y: string, series: {points: Point[], class: string, line?: boolean}[], log?: boolean, label?: string, chosen?: (point: Placed) => void}} what
 */
export function chart({ x: across, y: upwards, series, log = false, label, chosen }) {
  const width = Math.min(WIDEST, Math.max(NARROWEST, document.documentElement.clientWidth - 32));
  /** @param {Point} own */
  const shown = (own) => Number.isFinite(own.y) && (!log || own.y > 0);
  const all = series.flatMap((own) => own.points).filter(shown);
  const drawing = shape("svg", {
    viewBox: `0 0 ${width} ${HEIGHT}`,
    class: "picture",
    role: "img",
    "aria-label": label ?? `${upwards} over ${across}`,
    tabindex: chosen ? 0 : false,
  });
  if (all.length === 0) return drawing;
  /** @param {number[]} values */
  const bounds = (values) => values.reduce(([low, high], own) => /** @type {[number, number]} */ ([Math.min(low, own), Math.max(high, own)]), /** @type {[number, number]} */ ([Infinity, -Infinity]));
  let [left, right] = bounds(all.map((own) => own.x));
  let [low, high] = bounds(all.map((own) => own.y));
  const margin = (right - left) * 0.03 || 1;
  [left, right] = [left - margin, right + margin];
  if (log) [low, high] = [low / 1.5, high * 1.5];
  else [low, high] = [Math.min(0, low), high * 1.08 || 1];
  const of = log ? Math.log10 : (/** @type {number} */ value) => value;
  /** @param {number} value */
  const placeX = (value) => LEFT + ((value - left) / (right - left)) * (width - LEFT - MARGIN);
  /** @param {number} value */
  const placeY = (value) => HEIGHT - BOTTOM - ((of(value) - of(low)) / (of(high) - of(low))) * (HEIGHT - BOTTOM - MARGIN);
  for (const value of steps(left, right)) {
    drawing.append(
      shape("line", { x1: placeX(value), x2: placeX(value), y1: MARGIN, y2: HEIGHT - BOTTOM, class: "grid" }),
      shape("text", { x: placeX(value), y: HEIGHT - BOTTOM + 16, "text-anchor": "middle" }, `${value}`),
    );
  }
  for (const value of log ? thinned(decades(low, high)) : steps(low, high)) {
    drawing.append(
      shape("line", { x1: LEFT, x2: width - MARGIN, y1: placeY(value), y2: placeY(value), class: "grid" }),
      shape("text", { x: LEFT - 6, y: placeY(value) + 4, "text-anchor": "end" }, `${value}`),
    );
  }
  drawing.append(
    shape("text", { x: (LEFT + width) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, across),
    shape("text", { x: 14, y: HEIGHT / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${HEIGHT / 2})` }, upwards),
  );
  /** @type {Placed[]} */
  const placed = [];
  for (const own of series) {
    const points = own.points.filter(shown).map((point) => ({ ...point, at: /** @type {[number, number]} */ ([placeX(point.x), placeY(point.y)]) }));
    // One path for many points.
    const dots = points.map(({ at: [x, y] }) => `M${x.toFixed(1)} ${(y - 3).toFixed(1)}a3 3 0 1 1 0 6a3 3 0 1 1 0 -6z`);
    if (own.line) drawing.append(shape("polyline", { points: points.map(({ at }) => at.join(",")).join(" "), class: "way" }));
    drawing.append(shape("path", { d: dots.join(""), class: own.class }));
    placed.push(...points);
  }
  if (chosen) follow(drawing, placed, chosen);
  return drawing;
}

/** Not so many that their labels touch. @param {number[]} values */
function thinned(values) {
  return values.length > 12 ? values.filter((own) => Number.isInteger(Math.log10(own))) : values;
}

/** @param {SVGSVGElement} drawing @param {Placed[]} placed @param {(point: Placed) => void} chosen */
function follow(drawing, placed, chosen) {
  const ring = shape("circle", { r: 7, class: "cursor", visibility: "hidden" });
  drawing.append(ring);
  let index = -1;
  const choose = (/** @type {Placed} */ point) => {
    ring.setAttribute("visibility", "visible");
    ring.setAttribute("cx", String(point.at[0]));
    ring.setAttribute("cy", String(point.at[1]));
    chosen(point);
  };
  drawing.addEventListener("pointermove", (event) => {
    const box = drawing.getBoundingClientRect();
    const [x, y] = [((event.clientX - box.left) * drawing.viewBox.baseVal.width) / box.width, ((event.clientY - box.top) * HEIGHT) / box.height];
    /** @type {[Placed | null, number]} */
    let [best, nearest] = [null, 400];
    for (const point of placed) {
      const away = (point.at[0] - x) ** 2 + (point.at[1] - y) ** 2;
      if (away < nearest) [best, nearest] = [point, away];
    }
    if (best) choose(best);
  });
  drawing.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (!step) return;
    event.preventDefault();
    index = (index + step + placed.length) % placed.length;
    const point = placed[index];
    if (point) choose(point);
  });
}
