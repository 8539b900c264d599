// The robot before and after, its change drawn many times as large; turned by dragging or with the arrow keys.

import { element } from "./dom.js";

/** @typedef {import("./delta_cal_web.js").Arms} Arms */
/** @typedef {{joints: [number, number, number], times: number, turn: number, tilt: number, found: {before: Arms, after: Arms} | null}} View */

/** @type {(() => void) | null} */
let latest = null;

/** Draws the robot on the page again, in other colours. */
export function redraw() {
  latest?.();
}

/**
 * @param {import("./store.js").Store} store
 * @param {import("./state.js").Calls["skeleton"]["request"]} request the calibration's, and the file with its robot
 * @param {[number, number]} range of the joints
 */
export function robotFigure(store, request, [low, high]) {
  const middle = low + (high - low) * 0.45;
  /** @type {View} */
  const view = { joints: [middle, middle, middle], times: 50, turn: 0.6, tilt: 0.35, found: null };
  const canvas = element("canvas", { class: "picture", width: 640, height: 480, tabindex: 0, role: "img", "aria-label": "the robot before and after in three dimensions; arrow keys turn it" });
  const draw = () => drawRobot(canvas, view);
  latest = draw;
  const ask = async () => {
    const answer = await store.ask("skeleton", "skeleton", { ...request, joints: view.joints });
    const { before, after } = answer?.Ok ?? {};
    if (before && after) view.found = { before, after };
    draw();
  };
  /** @param {string} label @param {number} min @param {number} max @param {number} value @param {(value: number) => void} change */
  const slider = (label, min, max, value, change) =>
    element(
      "label",
      {},
      label,
      element("input", { type: "range", min, max, step: (max - min) / 200, value, oninput: (/** @type {Event} */ event) => change(Number(/** @type {HTMLInputElement} */ (event.target).value)) }),
    );
  const sliders = [0, 1, 2].map((index) =>
    slider(`Joint ${index + 1}`, low, high, middle, (value) => {
      view.joints[index] = value;
      ask();
    }),
  );
  const times = slider("Change, times", 0, 200, view.times, (value) => {
    view.times = value;
    draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    view.turn += event.movementX * 0.01;
    view.tilt = Math.max(-1.5, Math.min(1.5, view.tilt + event.movementY * 0.01));
    draw();
  });
  canvas.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    const [turn, tilt] = steps[/** @type {keyof typeof steps} */ (event.key)] ?? [0, 0];
    if (!turn && !tilt) return;
    event.preventDefault();
    view.turn += turn ?? 0;
    view.tilt += tilt ?? 0;
    draw();
  });
  ask();
  return element("figure", {}, canvas, element("div", { class: "fields" }, ...sliders, times), element("figcaption", {}, "Grey: as the file has it. Blue: calibrated, its change enlarged."));
}

/** @param {HTMLCanvasElement} canvas @param {View} view */
function drawRobot(canvas, { found, times, turn, tilt }) {
  const pen = canvas.getContext("2d");
  if (!found || !pen) return;
  const style = getComputedStyle(document.documentElement);
  /** @param {string} name */
  const colour = (name) => style.getPropertyValue(name).trim();
  const { before, after } = found;
  /** @param {number[]} own @param {number[]} other */
  const enlarged = (own, other) => own.map((value, axis) => value + times * (other[axis] - value));
  const shown = {
    shoulders: before.shoulders.map((own, index) => enlarged(own, after.shoulders[index])),
    elbows: before.elbows.map((own, index) => enlarged(own, after.elbows[index])),
    platform: enlarged(before.platform, after.platform),
  };
  const points = [...before.shoulders, ...before.elbows, before.platform];
  const centre = [0, 1, 2].map((axis) => (Math.min(...points.map((own) => own[axis])) + Math.max(...points.map((own) => own[axis]))) / 2);
  const size = Math.max(...points.map((own) => Math.hypot(...own.map((value, axis) => value - centre[axis]))));
  const scale = 215 / size;
  const [sine, cosine, up, flat] = [Math.sin(turn), Math.cos(turn), Math.sin(tilt), Math.cos(tilt)];
  /** @param {number[]} own @returns {[number, number]} */
  const place = (own) => {
    const [x, y, z] = own.map((value, axis) => value - centre[axis]);
    const [across, depth] = [x * cosine - y * sine, x * sine + y * cosine];
    return [320 + scale * across, 240 - scale * (z * flat - depth * up)];
  };
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.lineCap = "round";
  /** @param {number[]} from @param {number[]} to @param {number} width */
  const line = (from, to, width) => {
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(...place(from));
    pen.lineTo(...place(to));
    pen.stroke();
  };
  /** @param {{[Own in keyof Arms]: Own extends "platform" ? number[] : number[][]}} own @param {string} ink */
  const arms = ({ shoulders, elbows, platform }, ink) => {
    pen.strokeStyle = pen.fillStyle = ink;
    for (const index of [0, 1, 2]) {
      line(shoulders[index], shoulders[(index + 1) % 3], 1);
      line(shoulders[index], elbows[index], 6);
      line(elbows[index], platform, 3);
    }
    pen.beginPath();
    pen.arc(...place(platform), 7, 0, 2 * Math.PI);
    pen.fill();
  };
  arms(before, colour("--grey"));
  arms(shown, colour("--blue"));
  pen.fillStyle = colour("--ink");
  // At least 12 px on the page.
  pen.font = `${Math.max(14, (12 * canvas.width) / (canvas.clientWidth || canvas.width))}px system-ui, sans-serif`;
  for (const index of [0, 1, 2]) {
    const [x, y] = place(before.shoulders[index]);
    pen.fillText(`${index + 1}`, x + 8, y - 8);
  }
}
