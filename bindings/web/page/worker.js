// Answers the questions of engine.js, one after the other.

import init, { Session } from "./delta_cal_web.js";
import { unpacked } from "./unpack.js";

/** @type {Session} */
let session;

/** What the page shows of a report; the rest of it stays text. */
export const SHOWN = /** @type {const} */ ([
  "samples", "sample_count", "warnings", "position_error_mm", "residuals", "expected_error", "expanded_uncertainty", "acceptance", "workspace",
  "determined", "next_poses", "printer",
]);

/**
 * @param {string} call
 * @param {any} answer
 */
function parsed(call, answer) {
  const found = JSON.parse(answer);
  if (call === "calibrate" && found.Ok) {
    const report = JSON.parse(found.Ok.json);
    found.Ok.report = Object.fromEntries(SHOWN.map((key) => [key, report[key]]));
  }
  return found;
}

/** Loads the program, or takes the one that an earlier worker compiled. @param {WebAssembly.Module | null} compiled */
async function load(compiled) {
  // In a page in one file the program stands before this.
  const text = /** @type {any} */ (globalThis).program;
  const bytes = async () => (text ? Uint8Array.from(atob(text), (own) => own.charCodeAt(0)) : fetched("delta_cal_web.lzma"));
  const program = compiled ?? (await WebAssembly.compile(unpacked(await bytes())));
  await init({ module_or_path: program });
  session = new Session();
  self.postMessage({ program });
}

/** @param {string} name */
async function fetched(name) {
  const response = await fetch(name);
  if (!response.ok) throw new Error(`${response.status}`);
  return new Uint8Array(await response.arrayBuffer());
}

/** @param {any} question */
function answer({ id, removed, put, call, values }) {
  let file = null;
  try {
    for (const name of removed) session.remove(name);
    for (const [name, bytes] of put) {
      file = name;
      session.put(name, bytes);
    }
    file = call === "recognise" ? JSON.parse(values[0]).name : null;
    const begin = performance.now();
    const text = /** @type {any} */ (session)[call](...values);
    const milliseconds = performance.now() - begin;
    const found = call === "text" ? { Ok: text } : parsed(call, text);
    self.postMessage({ id, answer: { ...found, milliseconds } });
  } catch (error) {
    self.postMessage({ id, file, crash: String(/** @type {any} */ (error)?.message ?? error) });
  }
}

/** @type {Promise<void>} */
let ready;

self.addEventListener("message", async ({ data }) => {
  try {
    ready ??= load(data.program);
    await ready;
  } catch {
    self.postMessage({ unloadable: true });
    return;
  }
  if (data.call) answer(data);
});
