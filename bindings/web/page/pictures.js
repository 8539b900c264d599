// Pictures of a calibration: every sample with its line, a printer's bed before and after, the robot with its change made
// visible.

import { element, shape } from "./dom.js";
import { chart } from "./chart.js";

/** Figures for a result; those that it has nothing for are missing. */
export async function pictures(engine, result) {
  const bed = await engine.ask("bed").catch(() => ({}));
  const drawn = [samples(result.report.samples), bed.Ok && bedFigure(bed.Ok), await robot(engine, result)];
  return [element("div", { class: "pictures" }, ...drawn.filter(Boolean))];
}

function millimetres(value) {
  return value === null ? "not reached" : `${value.toPrecision(3)} mm`;
}

/** Errors before and after over the lines of the file; the one under the pointer is told. */
function samples(all) {
  if (!all?.length) return null;
  const told = element("output", {}, "Point at a sample, or use the arrow keys, for its line.");
  const points = (key) => all.map((own) => ({ x: own.line, y: own[key], own }));
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

/** Heights above the bed as colours. */
function bedFigure({ radius, step, before, after }) {
  const largest = Math.max(...before.map(([, , height]) => Math.abs(height)), 1e-6);
  const told = element("output", {}, `Colour: up to ${largest.toFixed(2)} mm too high (orange) or too low (blue).`);
  const map = (nodes, name) => {
    const drawing = shape("svg", { viewBox: "-110 -110 220 220", class: "picture", role: "img", "aria-label": `height of the nozzle over the bed, ${name}` });
    for (const [x, y, height] of nodes) {
      const part = Math.min(1, Math.abs(height) / largest);
      const cell = shape("rect", {
        x: ((x - step / 2) / radius) * 100,
        y: ((-y - step / 2) / radius) * 100,
        width: (step / radius) * 101,
        height: (step / radius) * 101,
        fill: height > 0 ? "#d55e00" : "#0072b2",
        "fill-opacity": (0.06 + 0.94 * part).toFixed(3),
      });
      cell.addEventListener("pointerenter", () => {
        told.textContent = `${name}: ${height.toFixed(3)} mm at x ${x.toFixed(0)}, y ${y.toFixed(0)} mm.`;
      });
      drawing.append(cell);
    }
    drawing.append(shape("text", { x: -105, y: -96 }, name));
    return drawing;
  };
  const maps = [map(before, "before"), ...(after ? [map(after, "with the lines")] : [])];
  return element(
    "figure",
    { id: "bed-picture" },
    element("div", { class: "pair" }, ...maps),
    element("figcaption", {}, "Nozzle above the bed where the controller expects contact. ", told),
  );
}

/** The robot before and after, its change drawn many times as large; turned by dragging or with the arrow keys. */
async function robot(engine, { joints: [low, high] }) {
  const middle = low + (high - low) * 0.45;
  const state = { joints: [middle, middle, middle], times: 50, turn: 0.6, tilt: 0.35, found: null };
  const canvas = element("canvas", { class: "picture", width: 640, height: 480, tabindex: 0, role: "img", "aria-label": "the robot before and after in three dimensions; arrow keys turn it" });
  const draw = () => drawRobot(canvas, state);
  const ask = async () => {
    const answer = await engine.ask("skeleton", new Float64Array(state.joints)).catch(() => ({}));
    if (answer.Ok) state.found = answer.Ok;
    draw();
  };
  const slider = (label, min, max, value, change) =>
    element("label", {}, label, element("input", { type: "range", min, max, step: (max - min) / 200, value, oninput: (event) => change(Number(event.target.value)) }));
  const sliders = [0, 1, 2].map((index) =>
    slider(`Joint ${index + 1}`, low, high, middle, (value) => {
      state.joints[index] = value;
      ask();
    }),
  );
  const times = slider("Change, times", 0, 200, state.times, (value) => {
    state.times = value;
    draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    state.turn += event.movementX * 0.01;
    state.tilt = Math.max(-1.5, Math.min(1.5, state.tilt + event.movementY * 0.01));
    draw();
  });
  canvas.addEventListener("keydown", (event) => {
    const [turn, tilt] = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key] ?? [0, 0];
    if (!turn && !tilt) return;
    event.preventDefault();
    state.turn += turn;
    state.tilt += tilt;
    draw();
  });
  await ask();
  if (!state.found) return null;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  return element(
    "figure",
    { id: "robot-picture" },
    canvas,
    element("div", { class: "fields" }, ...sliders, times),
    element("figcaption", {}, "Grey: as the robot file has it. Blue: calibrated, its change enlarged."),
  );
}

function drawRobot(canvas, { found, times, turn, tilt }) {
  if (!found) return;
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  const { before, after } = found;
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
  const place = (own) => {
    const [x, y, z] = own.map((value, axis) => value - centre[axis]);
    const [across, depth] = [x * cosine - y * sine, x * sine + y * cosine];
    return [320 + scale * across, 240 - scale * (z * flat - depth * up)];
  };
  const pen = canvas.getContext("2d");
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.lineCap = "round";
  const line = (from, to, width) => {
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(...place(from));
    pen.lineTo(...place(to));
    pen.stroke();
  };
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
  pen.font = "14px system-ui, sans-serif";
  for (const index of [0, 1, 2]) {
    const [x, y] = place(before.shoulders[index]);
    pen.fillText(`${index + 1}`, x + 8, y - 8);
  }
}
