// Answers the questions of engine.js, one after the other.

import init, { Session } from "./delta_cal_web.js";

// In a page in one file the program stands before this.
const { program } = globalThis;
const bytes = program && { module_or_path: Uint8Array.from(atob(program), (own) => own.charCodeAt(0)) };
const ready = init(bytes).then(() => new Session());

/** What the page draws of a report; the rest of it stays text. */
const DRAWN = ["samples", "warnings", "position_error_mm", "expected_error"];

function parsed(call, answer) {
  if (typeof answer !== "string" || call === "text") return answer;
  const found = JSON.parse(answer);
  if (call === "calibrate" && found.Ok) {
    const report = JSON.parse(found.Ok.json);
    found.Ok.report = Object.fromEntries(DRAWN.map((key) => [key, report[key]]));
  }
  return found;
}

self.addEventListener("message", async ({ data: { id, call, values } }) => {
  try {
    const session = await ready;
    const begin = performance.now();
    const answer = session[call](...values);
    const milliseconds = performance.now() - begin;
    const found = parsed(call, answer);
    if (found?.Ok) found.milliseconds = milliseconds;
    self.postMessage({ id, answer: found });
  } catch (error) {
    self.postMessage({ id, crash: String(error?.message ?? error) });
  }
});
