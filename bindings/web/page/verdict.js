// What a calibration means, in three sentences: what is wrong now and then, how sure that is, and what to do next.

import { chance, millimetres } from "./numbers.js";
import { inPageWords } from "./words.js";

/** @typedef {import("./state.js").Calibrated["report"]} Report */
/** @typedef {NonNullable<Report["printer"]>} Printer */
/** @typedef {NonNullable<Printer["before"]>} Off */
/** @typedef {NonNullable<Printer["next"]>} Next */
/**
 * `crash`: a warning that must be read before anything is pasted; `next`: a tab with what to do next.
 * @typedef {{good: boolean, crash: string | null, sentences: [string, string, string], warnings: string[], notes: string[], next: "plan" | "validate" | null}} Verdict
 */

/**
 * @param {import("./state.js").Calibrated} found the answer of `calibrate`
 * @returns {Verdict}
 */
export function verdict(found) {
  const { report, paste } = found;
  const crash = /WARNING: (.*)/.exec(paste ?? "")?.[1] ?? null;
  const warnings = report.warnings.map(inPageWords);
  const sentences = report.printer ? ofPrinter(report, paste) : ofRobot(report);
  return { good: warnings.length === 0 && report.acceptance?.passed !== false, crash, warnings, notes: (report.printer?.notes ?? []).map(inPageWords), ...sentences };
}

/**
 * @param {Report} report
 * @param {string | null} paste
 * @returns {Pick<Verdict, "sentences" | "next">}
 */
function ofPrinter(report, paste) {
  const { before, after, heights, distances, better_probability: better, next } = report.printer;
  /** @param {Off} off */
  const bed = (off) => millimetres(off.height_rms_mm);
  /** @param {Off} off */
  const size = (off) => `${off.hundred_mm_become_mm.toFixed(2)} mm`;
  const measured = heights > 0 && before;
  const sized = report.determined.scale && before;
  const what = [];
  if (measured && paste && after) what.push(`The bed is off by ${bed(before)} (rms) now, and by ${bed(after)} with the new lines`);
  else if (measured) what.push(`The bed is off by ${bed(before)} (rms), and no other settings would print clearly better`);
  if (sized && paste && after) what.push(`100 mm come out as ${size(before)}, with the new lines as ${size(after)}`);
  else if (sized) what.push(`100 mm come out as ${size(before)}`);
  const sure = [];
  if (better?.height != null) sure.push(`a flatter bed with ${chance(better.height)} probability`);
  if (better?.xy != null) sure.push(`better x and y with ${chance(better.xy)} probability`);
  const from = [heights && `${heights} heights`, distances && `${distances} distances`].filter(Boolean).join(" and ");
  const unknown = distances ? "; the size of parts is uncertain: state the shrinkage of prints (Options), or measure more lengths" : "; the size of parts is not measured";
  return {
    sentences: [`${what.join("; ") || "Nothing was measured of the bed"}.`, `From ${from}: ${sure.join(", ") || "not known how much better"}${sized ? "" : unknown}.`, nextOf(report.printer, paste)],
    next: !heights || (next && worthwhile(next.sigma_with_heights_mm, next)) ? "plan" : null,
  };
}

/**
 * @param {number | null | undefined} sigma
 * @param {Next} next
 */
function worthwhile(sigma, next) {
  return sigma != null && sigma < 0.9 * (next.sigma_now_mm ?? 0);
}

/**
 * @param {Printer} printer
 * @param {string | null} paste
 */
function nextOf({ next, firmware, heights }, paste) {
  const first = paste ? "Copy the lines, replace the old ones, and home" : "Keep the configuration";
  const object = next?.sigma_with_printed_object_mm ?? null;
  if (next && firmware === "klipper" && worthwhile(object, next)) {
    return `${first}; then print Klipper's calibrate_size.stl and measure it with DELTA_ANALYZE, which brings the expected error from ${millimetres(next.sigma_now_mm)} to ${millimetres(object)}.`;
  }
  if (next && worthwhile(next.sigma_with_heights_mm, next)) {
    return `${first}; then touch the bed at more places, which brings the expected error from ${millimetres(next.sigma_now_mm)} to ${millimetres(next.sigma_with_heights_mm)}.`;
  }
  return `${first}; ${heights ? "more heights bring little" : "then touch the bed, which is not measured"}.`;
}

/**
 * @param {Report} report
 * @returns {Pick<Verdict, "sentences" | "next">}
 */
function ofRobot(report) {
  const { position_error_mm: positions, residuals, expected_error: expected, expanded_uncertainty: expanded, acceptance, workspace, next_poses: poses } = report;
  const absolute = expanded ? expanded.of === "absolute" : report.determined.place;
  const expects = expected && (absolute === false ? expected.relative_rms_mm : expected.absolute_rms_mm);
  const what = positions
    ? `The measured positions are off by ${millimetres(positions.before.rms)} (rms) with the robot file, and by ${millimetres(positions.after.rms)} calibrated.`
    : `${residuals.map((own) => `The ${own.kind}s are off by ${millimetres(own.before_rms_mm)} (rms) with the robot file, and by ${millimetres(own.after_rms_mm)} calibrated`).join("; ")}.`;
  const sure = [];
  if (expects != null) sure.push(`The calibrated robot is expected to be off by ${millimetres(expects)} (${absolute === false ? "relative, " : ""}σ, rms over its workspace)`);
  if (workspace?.chance_of_harm != null) sure.push(`the chance that it got worse is ${chance(workspace.chance_of_harm)}`);
  if (acceptance) sure.push(`the limit of ${acceptance.limit_mm} mm is ${acceptance.passed ? "met" : "not met"}`);
  const then_mm = poses.at(-1)?.expected_error_mm ?? Infinity;
  const then = expects != null && then_mm < 0.9 * expects
    ? `Use calibrated.toml; ${poses.length} more poses would bring the expected error to ${millimetres(then_mm)} (the report lists them).`
    : "Use calibrated.toml, and check it with some 20 poses that were not used.";
  return { sentences: [what, `${sure.join("; ") || "How far off the calibrated robot is cannot be told"}.`, then], next: "validate" };
}
