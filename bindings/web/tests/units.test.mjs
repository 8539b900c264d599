// The page's state, engine and words, without a browser.

import assert from "node:assert/strict";
import { readFileSync, readdirSync, statSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { Crashed, Engine, Stopped, Superseded, TRIES, Unloadable } from "../page/engine.js";
import { list, number, two } from "../page/numbers.js";
import * as states from "../page/state.js";
import { verdict } from "../page/verdict.js";
import { inPageWords } from "../page/words.js";
import { ROOT } from "./page.mjs";

test("numbers have a decimal point or a decimal comma", () => {
  for (const [text, expected] of [["162,9", 162.9], ["162.9", 162.9], [" 1e-3 ", 0.001], ["", null], ["1,2,3", NaN], ["12mm", NaN], ["abc", NaN]]) {
    assert.equal(number(text), expected, text);
  }
  for (const [text, expected] of [
    ["345", ["345"]],
    ["162,9±0,1", ["162.9±0.1"]],
    ["345,1; 344,9; 345,0", ["345.1", "344.9", "345.0"]],
    ["345.1,344.9,345.0", ["345.1", "344.9", "345.0"]],
    ["345.1, 344.9, 345.0", ["345.1", "344.9", "345.0"]],
    ["345,344,345", ["345", "344", "345"]],
    ["100=98,5; 50=49,3", ["100=98.5", "50=49.3"]],
    ["0,3%", ["0.3%"]],
    ["", []],
  ]) {
    assert.deepEqual(list(text), expected, text);
  }
  for (const [value, expected] of [[0.01234, "0.012"], [0.15149, "0.15"], [1.27, "1.3"], [12.6, "13"], [0, "0"]]) assert.equal(two(value), expected);
});

/** A state with files as the program would recognise them: name, kind, and whether something is wrong with it. */
function having(...batches) {
  let state = states.EMPTY;
  for (const batch of batches) state = states.withFiles(state, batch.map(([name, kind, faulty, what]) => ({ name, bytes: new Uint8Array(), kind, faulty, what })));
  const known = new Map(batches.flat().map((own) => [own[0], own]));
  for (let file = states.unread(state); file; file = states.unread(state)) {
    const [, kind, faulty, what = ""] = known.get(file.name);
    const using = file.kind === "unread" ? "" : states.reader(state).using;
    state = states.recognised(state, { ...file, using }, { kind, what, fault: faulty ? { message: "wrong" } : null });
  }
  return state;
}

/** With the calibration that is due, answered. */
function calibrated(state) {
  const request = states.due(state);
  return states.ended(states.begun(state, "calibrate", request), "calibrate", request, { Ok: { toml: "" } });
}

const ROBOT = ["robot.toml", "robot"];
const SAMPLES = ["samples.csv", "samples"];
const PRINTER = ["printer.cfg", "printer", false, "Printer with Klipper: 7 heights saved"];
const NONE = "Printer with Marlin: no measurements saved";
const CHOSEN = [
  ["robot and samples", [[ROBOT, SAMPLES]], "robot.toml", ["samples.csv"]],
  ["samples that come later do not replace those in use", [[ROBOT, SAMPLES], [["check.csv", "samples"]]], "robot.toml", ["samples.csv"]],
  ["the newest robot, with the samples beside it", [[PRINTER], [ROBOT, SAMPLES]], "robot.toml", ["samples.csv"]],
  ["a robot that can be read before a newer one that cannot", [[ROBOT, SAMPLES], [["other.toml", "robot", true]]], "robot.toml", ["samples.csv"]],
  ["joints and positions in two files", [[ROBOT, ["q.csv", "joints"], ["x.csv", "positions"]]], "robot.toml", ["q.csv", "x.csv"]],
  ["a plan and the positions of its rows", [[ROBOT], [["poses.csv", "plan"], ["tracker.csv", "positions"]], [["check.csv", "plan"], ["again.csv", "positions"]]], "robot.toml", ["poses.csv", "tracker.csv"]],
  ["a printer's saved measurements", [[PRINTER]], "printer.cfg", []],
  ["a printer's newest answer of its console", [[PRINTER], [["console.txt", "samples"]]], "printer.cfg", ["console.txt"]],
  ["a console's log with its configuration", [[["Configuration.h", "printer", false, NONE], ["console.log", "printer", false, NONE]]], "Configuration.h", ["console.log"]],
  ["a console's log for itself", [[["m503.txt", "printer", false, NONE]]], "m503.txt", []],
  ["no junk in place of a printer's saved measurements", [[PRINTER, ["notes.txt", "samples", true], ["klippy.log", "samples", true]]], "printer.cfg", []],
  ["junk if there is nothing else, so that it is said why", [[ROBOT, ["notes.txt", "samples", true]]], "robot.toml", ["notes.txt"]],
];

for (const [name, batches, robot, samples] of CHOSEN) {
  test(`what is calibrated: ${name}`, () => {
    const state = having(...batches);
    assert.equal(states.robotOf(state), robot);
    assert.deepEqual(states.samplesOf(state), samples);
    assert.deepEqual(states.due(state)?.samples, samples);
  });
}

test("a chosen robot stays chosen, and its tables are read with it", () => {
  let state = states.withFields(having([PRINTER], [ROBOT, SAMPLES]), "calibrate", { robot: "printer.cfg" });
  assert.equal(states.unread(state)?.name, "samples.csv");
  assert.equal(states.due(state), null);
  state = states.recognised(state, { ...states.unread(state), using: states.reader(state).using }, { kind: "samples", what: "", fault: { message: "wrong" } });
  assert.deepEqual(states.due(state)?.samples, []);
});

test("a result goes when its files or its choices change, and only then", () => {
  const before = calibrated(having([ROBOT, SAMPLES]));
  assert.ok(before.asked.calibrate.answer);
  const bytes = new Uint8Array();
  const reading = states.withFiles(before, [{ name: "new", bytes }]);
  const recognised = (state, found) => states.recognised(state, { ...states.find(state, "new"), using: states.reader(state).using }, found);
  const goes = {
    "its samples are replaced": states.withFiles(before, [{ name: "samples.csv", bytes }]),
    "its samples are removed": states.without(before, "samples.csv"),
    "its robot is renamed": states.renamed(before, "robot.toml", "other.toml"),
    "an option changes": states.withFields(before, "calibrate", { robust: true }),
    "another robot comes": recognised(reading, { kind: "printer", what: "", fault: null }),
  };
  for (const [why, after] of Object.entries(goes)) assert.equal(after.asked.calibrate, undefined, why);
  assert.ok(reading.asked.calibrate.answer, "a file that is being read may be of no use");
  assert.ok(recognised(reading, { kind: "samples", what: "", fault: null }).asked.calibrate.answer, "other samples");
  const validation = states.begun(before, "validate", { robot: "calibrated.toml", samples: ["samples.csv"] });
  assert.ok(states.withFields(validation, "plan", { count: "3" }).asked.calibrate, "a field of another form");
  assert.equal(states.withFields(validation, "calibrate", { robust: true }).asked.validate, undefined, "what was made of the result");
});

test("only the newest request of a task is answered", () => {
  const [one, other] = [{ robot: "robot.toml", count: 1 }, { robot: "robot.toml", count: 2 }];
  let state = having([ROBOT, SAMPLES]);
  state = states.begun(states.begun(state, "plan", one), "plan", other);
  assert.equal(states.ended(state, "plan", one, { Ok: 1 }).asked.plan.answer, null);
  assert.deepEqual(states.ended(state, "plan", other, { Ok: 2 }).asked.plan.answer, { Ok: 2 });
});

test("no file is overwritten by a result, nor by one of its name in the same drop", () => {
  const bytes = new Uint8Array();
  const state = calibrated(having([ROBOT, SAMPLES]));
  assert.equal(states.outputOf(state), "calibrated.toml");
  const other = calibrated(having([ROBOT, SAMPLES, ["calibrated.toml", "samples", true]]));
  assert.equal(states.outputOf(other), "calibrated-2.toml");
  const twice = states.withFiles(states.EMPTY, [{ name: "a.csv", bytes }, { name: "a.csv", bytes }]);
  assert.deepEqual(twice.files.map((own) => own.name), ["a.csv", "a-2.csv"]);
});

/** Workers that answer only when told; `calls` are what they were asked. */
function workers() {
  const all = [];
  const start = () => {
    const own = { calls: [], ended: false, postMessage: (message) => message.call && own.calls.push(message), terminate: () => (own.ended = true) };
    own.answer = (answer) => own.onmessage({ data: { id: own.calls.at(-1).id, answer } });
    own.crash = (file) => own.onmessage({ data: { id: own.calls.at(-1).id, crash: "unreachable", file } });
    all.push(own);
    return own;
  };
  return { all, start };
}

test("a program that does not load is tried three times", async () => {
  const { all, start } = workers();
  const engine = new Engine(start, () => []);
  const asked = engine.ask("plan", "plan", "{}");
  while (!all.at(-1).ended) all.at(-1).onmessage({ data: { unloadable: true } });
  await assert.rejects(asked, Unloadable);
  await assert.rejects(engine.ask("plan", "plan", "{}"), Unloadable);
  assert.equal(all.length, TRIES);
});

test("a crash names the file, and the next question is answered by another worker that has all files", async () => {
  const { all, start } = workers();
  const files = [{ name: "a.csv", bytes: new Uint8Array(), stamp: 1 }];
  const engine = new Engine(start, () => files);
  const asked = engine.ask("recognise", "recognise", "a.csv");
  all[0].crash("a.csv");
  await assert.rejects(asked, (error) => error instanceof Crashed && error.file === "a.csv");
  const next = engine.ask("plan", "plan", "{}");
  assert.equal(all[0].ended, true);
  assert.deepEqual(all[1].calls[0].put.map(([name]) => name), ["a.csv"]);
  all[1].answer({ Ok: 1 });
  assert.deepEqual(await next, { Ok: 1 });
});

test("a newer question of a task supersedes what waits and what is computed, but no other task", async () => {
  const { all, start } = workers();
  const engine = new Engine(start, () => []);
  const [first, other] = [engine.ask("plan", "plan", "1"), engine.ask("export", "export", "2")];
  const [second, third] = [engine.ask("plan", "plan", "3"), engine.ask("plan", "plan", "4")];
  await assert.rejects(first, Superseded);
  await assert.rejects(second, Superseded);
  all[0].answer({ Ok: "late" });
  all[0].answer({ Ok: "export" });
  all[0].answer({ Ok: "plan" });
  assert.deepEqual([await other, await third], [{ Ok: "export" }, { Ok: "plan" }]);
  assert.deepEqual(all[0].calls.map((own) => own.values[0]), ["1", "2", "4"]);
});

test("what is stopped is stopped, and files are put once", async () => {
  const { all, start } = workers();
  const engine = new Engine(start, () => [{ name: "a.csv", bytes: new Uint8Array(), stamp: 1 }]);
  const asked = engine.ask("plan", "plan", "1");
  engine.stop();
  await assert.rejects(asked, Stopped);
  const [one, other] = [engine.ask("a", "plan", "2"), engine.ask("b", "plan", "3")];
  all[1].answer({ Ok: 1 });
  all[1].answer({ Ok: 2 });
  assert.deepEqual([await one, await other], [{ Ok: 1 }, { Ok: 2 }]);
  assert.deepEqual(all[1].calls.map((own) => own.put.length), [1, 0]);
});

/** Texts of the program that a page can show. */
function* sources(folder) {
  for (const name of readdirSync(folder)) {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) yield* sources(path);
    else if (name.endsWith(".rs") || name.endsWith(".toml")) yield path;
  }
}

test("no message of the program names an option or another command on the page", () => {
  const source = join(ROOT, "host/src");
  const others = /src\/(cli|device|workspace)|src\/campaign\/row/;
  const left = [];
  for (const path of sources(source)) {
    if (others.test(path)) continue;
    const code = readFileSync(path, "utf8").split("#[cfg(test)]")[0].replaceAll(/^\s*(\/\/|#).*$/gm, "").replaceAll(/\\\n\s*/g, "");
    for (const [text] of code.matchAll(/"(?:[^"\\]|\\.)*"/g)) {
      if (!/(^|[\s(`"])--[a-z]|delta-cal [a-z]/.test(text)) continue;
      const words = inPageWords(text.replaceAll(/\{[^}]*\}/g, "x"));
      if (/(^|[\s(`"])--[a-z]|delta-cal (calibrate|plan|import|export|validate|simulate|init)\b/.test(words)) left.push(`${path}: ${words}`);
    }
  }
  assert.deepEqual(left, []);
});

test("a verdict says what is wrong, how sure, and what next; a crash stands before it", () => {
  const off = (rms) => ({ height_rms_mm: rms, hundred_mm_become_mm: 99.5 });
  const printer = { before: off(0.15149), after: off(0.02597), heights: 7, distances: 0, better_probability: { height: 0.97, xy: null }, firmware: "marlin", next: { sigma_now_mm: 0.215, sigma_with_heights_mm: 0.18 } };
  const report = { printer, warnings: [], acceptance: null, determined: { scale: false } };
  const found = verdict({ report, paste: "# WARNING: an end stop moves by 2.4 mm.\nM665 R140\n" });
  assert.deepEqual(found.sentences, [
    "The bed is off by 0.15 mm (rms) now, and by 0.026 mm with the new lines.",
    "From 7 heights: a flatter bed with 97 % probability; the size of parts is not measured.",
    "Copy the lines, replace the old ones, and home; then touch the bed at more places, which brings the expected error from 0.21 mm to 0.18 mm.",
  ]);
  assert.equal(found.crash, "an end stop moves by 2.4 mm.");
  const none = verdict({ report, paste: null });
  assert.match(none.sentences[0], /no other settings would print clearly better/);
  assert.equal(none.crash, null);
});
