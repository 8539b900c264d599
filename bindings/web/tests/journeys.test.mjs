// The journeys of the page in a real browser. What the page offers is compared with what the command writes.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { gzipSync } from "node:zlib";
import axe from "axe-core";
import { inPageWords } from "../page/words.js";
import { DIST, FILE, ROOT, alike, command, downloaded, example, figures, give, launch, open, run, same, serve, testCase, text } from "./page.mjs";

let server, browser;

before(async () => {
  server = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.stop();
});

/** A journey; nobody else is asked, and the console stays silent. A browser on a busy machine may lose an event: once more. */
function journey(name, travel, settings, address) {
  const travelled = async () => {
    const opened = await open(browser, address ?? server.address, settings);
    try {
      await travel(opened.page, opened);
      assert.deepEqual(opened.asked, [], "requests to others");
      assert.deepEqual(opened.said, [], "the console");
    } finally {
      await opened.close();
    }
  };
  test(name, { timeout: 240_000 }, async () => {
    try {
      await travelled();
    } catch (error) {
      if (error.name !== "TimeoutError") throw error;
      await travelled();
    }
  });
}

/** Waits for a result or a fault. */
async function settled(page) {
  await page.locator("#result > *").first().waitFor();
}

/** Waits for a result, and unfolds all of it. */
async function result(page) {
  await page.locator("#verdict").waitFor();
  await page.locator("#result").evaluate((own) => {
    for (const folded of own.querySelectorAll("details")) folded.open = true;
  });
}

/** Unfolds the list of files. */
async function list(page) {
  await page.locator("#input").evaluate((own) => (own.open = true));
}

/** Sets fields by their ids, also folded ones: those of a printer are shown once there is one. */
async function set(page, fields) {
  for (const [id, value] of Object.entries(fields)) {
    await page.locator(`select#${id} option[value='${value}'], input#${id}`).first().waitFor({ state: "attached" });
    await page.locator(`#${id}`).evaluate((field, value) => {
      field[field.type === "checkbox" ? "checked" : "value"] = value;
      field.dispatchEvent(new Event("change", { bubbles: true }));
    }, value);
  }
}

/** A file of a text. */
function made(name, text) {
  return { name, mimeType: "text/plain", buffer: Buffer.from(text) };
}

const CALIBRATE = ["calibrate", "robot.toml", "samples.csv", "--output", "calibrated.toml", "--report", "report.html", "--json", "report.json"];

journey("the built-in example calibrates to the bits of the command", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  const written = command(files, ...CALIBRATE);
  assert.equal(written.code, 0, written.said);
  for (const name of ["calibrated.toml", "report.html"]) {
    same(await downloaded(page, `Download ${name}`), written.file(name), name);
  }
  // Probabilities come from the C library's functions.
  alike(await downloaded(page, "Download report.json"), written.file("report.json"), "report.json");
});

// Folder, files, fields of the page with their values, arguments of the command.
const SENSOR = { frame: "sensor" };
const CASES = [
  ["tracker-byte-identical-rows", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["tracker-clockwise-arms-called-mirrored", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["tracker-sign-with-limits-in-same-sign", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["tracker-encoder-slip-called-drift", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["tracker-noise-in-um", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["tracker-sensor-sigma-and-expected-error", ["robot.toml", "samples.csv"], {}, []],
  ["../../examples/circle-sheet", ["robot.toml", "samples.csv"], SENSOR, ["--frame", "sensor"]],
  ["../../examples/plate", ["robot.toml", "touches.csv"], {}, []],
  ["../../examples/printer", ["printer.cfg"], {}, []],
  ["klipper-41-touches", ["printer_7_of_41.cfg"], {}, []],
  ["klipper1610-rotary-endstop", ["printer.cfg"], {}, []],
  ["klipper5455-distance-below-bed", ["printer.cfg"], {}, []],
  ["printers-cfg", ["rods-267.cfg"], { rods: "267" }, ["--rods", "267mm"]],
  ["printers-cfg", ["zero-off.cfg"], { radius: "126±0.3", printed: "100=98.5", shrinkage: "0.3%" }, ["--radius", "126±0.3mm", "--printed", "100=98.5", "--shrinkage", "0.3%"]],
  ["printers-cfg", ["paper-and-probe.cfg"], {}, []],
  ["printers-cfg", ["rrf-config.g"], {}, []],
  ["printers-cfg", ["marlin-octoprint.txt"], {}, []],
  ["instrument-files", ["robot.toml", "tracker/joints.txt", "tracker/position_SMR_1.txt"], SENSOR, ["--frame", "sensor"]],
];

for (const [folder, names, fields, values] of CASES) {
  journey(`${[folder, ...names].join(" ")}: as the command calibrates or refuses`, async (page) => {
    const files = names.map((name) => testCase(`${folder}/${name}`));
    const own = names.map((name) => basename(name));
    const written = command(files, "calibrate", ...own, ...values, "--output", "calibrated.toml", "--json", "report.json");
    await set(page, fields);
    await give(page, ...files);
    await settled(page);
    if (written.code === 0) {
      await result(page);
      same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
      alike(await downloaded(page, "Download report.json"), written.file("report.json"), "report.json");
      return;
    }
    const said = plain(await page.locator("#result .fault").first().innerText());
    for (const line of plain(written.said).matchAll(/(?:error|refused|diagnosis|help): (.*?)(?= diagnosis: | help: |$)/g)) {
      // The command shows the line at fault between cause and help.
      const [cause] = line[1].split(/ \| ?\d* ?\|| +\d* \| /);
      assert.ok(said.includes(inPageWords(cause.trim())), `${cause}\n---\n${said}`);
    }
  });
}

function plain(text) {
  return text.replaceAll(/\s+/g, " ").trim();
}

journey("from a printer's configuration to the lines to paste", async (page) => {
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await result(page);
  const written = command([example("printer/printer.cfg")], "calibrate", "printer.cfg", "--paste", "paste.cfg", "--report", "report.html");
  same(await downloaded(page, "Download paste.cfg"), written.file("paste.cfg"), "paste.cfg");
  same(await downloaded(page, "Download report.html"), written.file("report.html"), "report.html");
  await page.getByRole("button", { name: "Copy the lines" }).click();
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), written.file("paste.cfg"));
  await page.locator("#bed-picture svg").first().hover();
  assert.match(await page.locator("#bed-picture output").innerText(), /mm at x/);
  assert.equal(await page.locator("#verdict button.first").count(), 1);
  await page.locator("#report footer").waitFor();
  const meanings = await page.locator("#report .report").evaluate((own) => own.shadowRoot.textContent);
  assert.match(meanings, /where a tower stands/);
  assert.doesNotMatch(meanings, /motor/);
});

journey("a file at fault is mended in the editor beside its message", async (page) => {
  const robot = text(example("paper-robot/robot.toml")).replace("forearm_mm = 480", "forearm_mm = 48O");
  await give(page, { name: "robot.toml", mimeType: "text/plain", buffer: Buffer.from(robot) }, example("paper-robot/samples.csv"));
  const fault = page.locator("[data-name='robot.toml'] .fault");
  await fault.waitFor();
  assert.match(await fault.innerText(), /robot\.toml:7/);
  await fault.getByRole("button", { name: "Fix robot.toml" }).click();
  const editor = page.locator("#editor-text");
  const selected = await editor.evaluate((area) => area.value.slice(area.selectionStart, area.selectionEnd));
  assert.equal(selected, "forearm_mm = 48O");
  await page.keyboard.type("forearm_mm = 480");
  await result(page);
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  same(await downloaded(page, "Download calibrated.toml"), command(files, ...CALIBRATE).file("calibrated.toml"), "calibrated.toml");
});

journey("a binary, a file that is gone and one that is too large are named, and the rest still calibrates", async (page) => {
  await page.evaluate(() => {
    const [{ get }, read] = [Object.getOwnPropertyDescriptor(Blob.prototype, "size"), Blob.prototype.arrayBuffer];
    Object.defineProperty(Blob.prototype, "size", { get() { return this.name === "huge.csv" ? 500e6 : get.call(this); } });
    Blob.prototype.arrayBuffer = function () { return this.name === "gone.csv" ? Promise.reject(new Error()) : read.call(this); };
  });
  const picture = { name: "photo.png", mimeType: "image/png", buffer: Buffer.from("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "latin1") };
  await give(page, picture, made("huge.csv", "1"), made("gone.csv", "1"), example("paper-robot/robot.toml"), example("paper-robot/samples.csv"));
  await page.locator("#status", { hasText: "huge.csv has too many rows for a browser (500 MB): use the command delta-cal. gone.csv could not be read." }).waitFor();
  await result(page);
  assert.match(await page.locator("[data-name='photo.png'] .fault").innerText(), /photo\.png: is not a text file/);
  assert.equal(await page.locator("[data-name='photo.png'] button").count(), 2, "what is not text is saved or removed");
});

// Chromium lets one page download ten files in a row, more only sometimes.
for (const part of [0, 1, 2, 3]) journey(`every export is what the command writes: ${part + 1} of 4`, async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  const calibrated = await downloaded(page, "Download calibrated.toml");
  await page.getByRole("tab", { name: "Export" }).click();
  await page.locator("#export-target option[value=klipper]").waitFor({ state: "attached" });
  const targets = await page.locator("#export-target option").evaluateAll((all) => all.map((own) => own.value));
  assert.ok(targets.length >= 12, targets.join());
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "calibrated.toml"), calibrated);
  const files = [join(folder, "calibrated.toml"), example("paper-robot/robot.toml")];
  for (const target of targets.filter((_, index) => index % 4 === part)) {
    const values = ["--for", target, "--nominal", "robot.toml", "--output", "lines", "--json", "lines.json"];
    const written = command(files, "export", "calibrated.toml", ...values);
    await page.selectOption("#export-target", target);
    await page.locator("#export").getByRole("button", { name: "Export" }).click();
    if (written.code !== 0) {
      await page.locator("#exported .fault").waitFor();
      continue;
    }
    const button = page.locator("#exported").getByRole("button", { name: new RegExp(`Download ${target}\\.(?!json)`) });
    await button.waitFor();
    same(await downloaded(page, await button.innerText()), written.file("lines"), target);
    alike(await downloaded(page, `Download ${target}.json`), written.file("lines.json"), target);
  }
});

journey("from four lengths to a plan", async (page) => {
  await page.getByRole("button", { name: "New robot from four lengths" }).click();
  const lengths = [["Base:", "200"], ["Platform:", "40"], ["Upper arm:", "250"], ["Forearm:", "500"]];
  for (const [label, value] of lengths) await page.getByLabel(label).fill(value);
  await page.getByLabel("Forearm:").focus();
  assert.equal(await page.locator("#new-drawing .lit").getAttribute("data-for"), "forearm_mm");
  await page.getByRole("button", { name: "Write the robot file" }).click();
  assert.match(await page.locator("[data-name='robot.toml'] .what").textContent(), /upper arms 250\.0 mm/);
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.locator("#planned svg").first().waitFor();
  assert.doesNotMatch(await page.locator("#planned pre").innerText(), /\u001b|\[1m/);
  await list(page);
  const robot = await downloaded(page, "Save robot.toml");
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "robot.toml"), robot);
  const values = ["--count", "20", "--frame", "sensor", "--output", "poses.csv", "--json", "plan.json"];
  const written = command([join(folder, "robot.toml")], "plan", "robot.toml", ...values);
  same(await downloaded(page, "Download poses.csv"), written.file("poses.csv"), "poses.csv");
  alike(await downloaded(page, "Download plan.json"), written.file("plan.json"), "plan.json");
  assert.equal(await page.locator(".checklist tbody tr").count(), 21);
  await page.getByLabel("Absolute error, in the base's frame").check();
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.getByText("state [datum.NAME] points").waitFor();
});

test("docs/web.md says how large the page is", () => {
  const files = readdirSync(DIST, { recursive: true, withFileTypes: true }).filter((own) => own.isFile());
  const bytes = files.map((own) => readFileSync(join(own.parentPath, own.name)));
  const sum = (sizes) => sizes.reduce((one, other) => one + other);
  const sizes = { gzip: sum(bytes.map((own) => gzipSync(own, { level: 9 }).length)), dist: sum(bytes.map((own) => own.length)), file: text(FILE).length };
  for (const [name, size] of Object.entries(sizes)) assert.ok(Math.abs((1000 * figures()[name]) / size - 1) < 0.01, `${name}: ${size}`);
});

journey("a second file of readings validates the result", async (page) => {
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  const file = (name, some) => ({ name, mimeType: "text/csv", buffer: Buffer.from([head, ...some, ""].join("\n")) });
  await give(page, example("paper-robot/robot.toml"), file("samples.csv", rows.slice(0, 20)));
  await result(page);
  await give(page, file("check.csv", rows.slice(20)));
  await page.locator("[data-name='check.csv']").waitFor({ state: "attached" });
  await page.getByRole("tab", { name: "Validate" }).click();
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "check.csv"), file("", rows.slice(20)).buffer);
  await page.getByRole("tab", { name: "Calibrate" }).click();
  writeFileSync(join(folder, "calibrated.toml"), await downloaded(page, "Download calibrated.toml"));
  await page.getByRole("tab", { name: "Validate" }).click();
  await page.locator("#validate").getByRole("button", { name: "Validate" }).click();
  await page.locator("#validated .report").waitFor();
  const values = ["--limit", "0.1mm", "--report", "certificate.html", "--json", "validation.json"];
  const written = command([join(folder, "calibrated.toml"), join(folder, "check.csv")], "validate", "calibrated.toml", "check.csv", ...values);
  same(await downloaded(page, "Download certificate.html"), written.file("certificate.html"), "certificate.html");
  alike(await downloaded(page, "Download validation.json"), written.file("validation.json"), "validation.json");
});

function split(csv) {
  const [head, ...rows] = csv.split("\n").filter((line) => line && !line.startsWith("#"));
  return [head, rows];
}

journey("a sample tells its line, by pointer and by keys", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  const picture = page.locator("#samples-picture svg");
  await picture.focus();
  await page.keyboard.press("ArrowRight");
  const told = await page.locator("#samples-picture output").innerText();
  assert.match(told, /^Line 4: .* before, .* after/);
  await page.locator("#robot-picture canvas").waitFor();
});

journey("what takes long is stopped, and the page goes on", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  await page.getByRole("tab", { name: "Plan" }).click();
  // As of every field of numbers.
  await page.getByLabel("Measurements", { exact: true }).fill("many");
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  assert.equal(await page.locator("#plan input:invalid").count(), 1);
  await page.getByLabel("Measurements", { exact: true }).fill("500");
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.locator("#planned .fault").waitFor();
  await page.getByLabel("Measurements", { exact: true }).fill("12");
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.locator("#planned svg").first().waitFor();
});

journey("100,000 rows calibrate", async (page) => {
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  const many = [head];
  for (let index = 0; index < 100_000; index++) {
    // Equal rows count once: the last digits differ.
    const cells = rows[index % rows.length].split(",");
    cells[3] = `${cells[3]}${String(index).padStart(6, "0")}`;
    many.push(cells.join(","));
  }
  const path = join(mkdtempSync(join(tmpdir(), "delta-cal-web-")), "many.csv");
  writeFileSync(path, many.join("\n"));
  await give(page, example("paper-robot/robot.toml"), path);
  await page.locator("#verdict").waitFor({ timeout: 110_000 });
  await list(page);
  assert.match(await page.locator("[data-name='many.csv'] .what").innerText(), /100.?000 samples/);
  assert.ok((await page.locator("#samples-picture path").count()) <= 3, "as many nodes as of few rows");
  console.log(`100,000 rows: ${await page.locator("#status").innerText()}`);
});

journey("a campaign counts its robots, can be cancelled, and has the rows of the command", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  await page.getByRole("tab", { name: "Simulate" }).click();
  const [robots, button] = [page.getByLabel("Robots", { exact: true }), page.locator("#simulate").getByRole("button", { name: "Simulate" })];
  await robots.fill("100000");
  await button.click();
  await page.getByText(/[1-9]\d* of 100000 robots/).waitFor();
  assert.ok((await page.locator("#waiting progress").evaluate((own) => own.position)) > 0);
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.locator("#simulated .fault").waitFor();
  await robots.fill("200");
  await button.click();
  await page.locator("#simulated svg").waitFor();
  const campaign = join(mkdtempSync(join(tmpdir(), "delta-cal-web-")), "campaign.toml");
  writeFileSync(campaign, await downloaded(page, "Download campaign.toml"));
  const written = command([campaign, example("paper-robot/robot.toml")], "simulate", "campaign.toml", "--output", "rows.csv");
  same(await downloaded(page, "Download rows.csv"), written.file("rows.csv"), "rows.csv");
});

journey("the page in one file works without a server", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  const written = command(files, ...CALIBRATE);
  same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
  alike(await downloaded(page, "Download report.json"), written.file("report.json"), "report.json");
  await list(page);
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await page.locator("#bed-picture").waitFor();
}, {}, pathToFileURL(FILE).href);

journey("after the first visit the page works without its server", async (page, { context }) => {
  await page.evaluate(() => navigator.serviceWorker.ready);
  await context.setOffline(true);
  await page.reload();
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
});

journey("leaving the page with files asks", async (page, { said }) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  const asked = page.waitForEvent("dialog");
  page.reload().catch(() => {});
  assert.equal((await asked).type(), "beforeunload");
  said.length = 0;
});

// Tab, and what to do there before it is looked at.
const LOOKS = [
  ["Calibrate", null],
  ["Export", "Export"],
  ["Validate", null],
  ["Plan", "Plan touches"],
  ["Simulate", null],
  ["New robot", null],
  ["Plan", "Plan", "paper-robot/robot.toml"],
];
for (const settings of [
  { colorScheme: "light", viewport: { width: 1200, height: 900 } },
  { colorScheme: "dark", viewport: { width: 360, height: 800 } },
  // As wide as 1280 px at 400 %.
  { colorScheme: "light", forcedColors: "active", viewport: { width: 320, height: 640 } },
]) {
  const look = `${settings.colorScheme}-${settings.viewport.width}`;
  journey(`no barrier that axe finds: ${look}`, async (page) => {
    await page.getByRole("button", { name: "Printer with Klipper" }).click();
    await result(page);
    await page.locator("#report .report").waitFor();
    // The tests may add a script; the page's policy does not allow it to others.
    for (const [tab, button, robot] of LOOKS) {
      await page.getByRole("tab", { name: tab }).click();
      const panel = page.getByRole("tabpanel", { name: tab });
      if (robot) {
        await give(page, example(robot));
        await page.locator("#plan-robot option[value='robot.toml']").waitFor({ state: "attached" });
        await page.selectOption("#plan-robot", "robot.toml");
      }
      if (button) {
        await panel.getByRole("button", { name: button, exact: true }).click();
        await panel.locator("pre").first().waitFor();
      }
      if (process.env.SCREENSHOTS) {
        await page.screenshot({ path: join(process.env.SCREENSHOTS, `${look}-${tab.replace(" ", "-")}.png`), fullPage: true });
      }
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 0, `${tab} is ${wide} px too wide`);
      assert.deepEqual(await page.evaluate(unreadable), [], tab);
      await page.evaluate(axe.source);
      const { violations } = await page.evaluate(() => window.axe.run({ runOnly: ["wcag2a", "wcag2aa", "wcag21aa"] }));
      assert.deepEqual(violations.map((own) => `${tab}: ${own.id}: ${own.nodes[0].html}`), []);
    }
  }, settings);
}

/** What is too small to read, cut off in its field, or drawn outside its picture. */
function unreadable() {
  const inside = (root) => [...root.querySelectorAll("*")].flatMap((own) => [own, ...(own.shadowRoot ? inside(own.shadowRoot) : [])]);
  const pen = document.createElement("canvas").getContext("2d");
  return inside(document.body).filter((own) => own.getClientRects().length).flatMap((own) => {
    const style = getComputedStyle(own);
    const text = own instanceof HTMLSelectElement ? (own.selectedOptions[0]?.text ?? "") : [...own.childNodes].map((child) => (child.nodeType === Node.TEXT_NODE ? child.nodeValue.trim() : "")).join("");
    if (!text) return [];
    const picture = own.ownerSVGElement;
    const scale = picture ? Math.hypot(own.getScreenCTM().a, own.getScreenCTM().b) : 1;
    const [box, frame] = [own, picture ?? own].map((each) => each.getBoundingClientRect());
    pen.font = style.font;
    const faults = {
      "smaller than 11 px": parseFloat(style.fontSize) * scale < 10.95,
      "outside its picture": box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1,
      "cut off": own instanceof HTMLSelectElement && pen.measureText(text).width > own.clientWidth - 2 * parseFloat(style.paddingLeft) - 18,
    };
    return Object.keys(faults).filter((name) => faults[name]).map((name) => `${name}: ${own.tagName} ${text.slice(0, 40)}`);
  });
}

/** That nothing ends beyond the margins of A4, 180 mm apart. */
async function fitsA4(page, within) {
  await page.emulateMedia({ media: "print" });
  await page.setViewportSize({ width: 680, height: 1000 });
  const beyond = await page.locator(within).evaluateAll((all) => {
    const inside = (own) => [own, ...[...(own.shadowRoot ?? own).querySelectorAll("*")].filter((child) => child.getClientRects().length)];
    return all.flatMap(inside).filter((own) => own.getBoundingClientRect().right > 681).map((own) => own.outerHTML.slice(0, 80));
  });
  assert.deepEqual(beyond, []);
  if (process.env.SCREENSHOTS) await page.pdf({ path: join(process.env.SCREENSHOTS, `${within.replace(/\W/g, "")}.pdf`), preferCSSPageSize: true });
}

journey("checklist and certificate are whole on A4", async (page) => {
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  await give(page, example("paper-robot/robot.toml"), made("samples.csv", [head, ...rows.slice(0, 20), ""].join("\n")));
  await result(page);
  await give(page, made("check.csv", [head, ...rows.slice(20), ""].join("\n")));
  await page.locator("[data-name='check.csv']").waitFor({ state: "attached" });
  await page.getByRole("tab", { name: "Validate" }).click();
  await page.locator("#validate").getByRole("button", { name: "Validate" }).click();
  await page.locator("#validated footer").waitFor();
  await fitsA4(page, "#validated .report");
  await page.emulateMedia({ media: null });
  await page.getByRole("tab", { name: "Plan" }).click();
  await page.getByRole("button", { name: "Plan", exact: true }).click();
  await page.locator(".checklist").waitFor();
  await fitsA4(page, ".checklist");
});

journey("what was computed from other files or choices is not shown", async (page) => {
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await result(page);
  await give(page, example("paper-robot/robot.toml"), example("paper-robot/samples.csv"));
  await page.locator("#chosen", { hasText: "robot.toml, with samples.csv" }).waitFor();
  await result(page);
  assert.equal(await page.locator("#paste").count(), 0);
  await list(page);
  assert.match(await page.locator("[data-name='samples.csv'] .what").innerText(), /40 samples/);
  await page.locator("#options").evaluate((own) => (own.open = true));
  await page.selectOption("#robot", "printer.cfg");
  await page.locator("#paste").waitFor({ state: "attached" });
  await page.selectOption("#robot", "robot.toml");
  await page.locator("#paste").waitFor({ state: "detached" });
  await result(page);
  await page.getByRole("button", { name: "Remove samples.csv" }).click();
  await page.locator("#verdict").waitFor({ state: "detached" });
});

journey("one bad file harms no other, and nothing that was dropped is overwritten", async (page) => {
  await give(page, example("printer/printer.cfg"), made("klippy.log", "Starting Klippy...\nStats 1.0\n"), made("notes.txt", "Starting from the left, level the bed\n"));
  await page.locator("#bed-picture").waitFor();
  await list(page);
  await page.getByRole("button", { name: "Remove all" }).click();
  const own = text(example("paper-robot/robot.toml"));
  await give(page, made("robot.toml", own), example("paper-robot/samples.csv"));
  await result(page);
  await list(page);
  await page.getByRole("button", { name: "New robot from four lengths" }).click();
  await page.getByRole("button", { name: "Write the robot file" }).click();
  await page.locator("[data-name='robot-2.toml']").waitFor({ state: "attached" });
  await list(page);
  assert.equal(await downloaded(page, "Save robot.toml"), own);
});

journey("a decimal comma is one: 162,9 is not 162", async (page) => {
  await give(page, example("printer/printer.cfg"));
  await result(page);
  const written = command([example("printer/printer.cfg")], "calibrate", "printer.cfg", "--radius", "162.9±0.1mm", "--printed", "100=98.5", "--printed", "50=49.2", "--paste", "paste.cfg");
  await page.locator("#options").evaluate((own) => (own.open = true));
  await page.getByLabel("Delta radius").fill("162,9±0,1");
  await page.getByLabel("Printed lengths").fill("100=98,5; 50=49,2");
  await page.getByLabel("Printed lengths").press("Tab");
  await page.locator("#verdict", { hasText: "distances" }).waitFor();
  await result(page);
  same(await downloaded(page, "Download paste.cfg"), written.file("paste.cfg"), "paste.cfg");
});

// Configuration, count.
for (const [folder, name, count] of [["../../examples/printer", "printer.cfg", "16"], ["console-answers", "config.g", "12"], ["marlin-m665-b", "m503_new.txt", "16"]]) {
  journey(`${name}: touches are planned as the command plans them`, async (page) => {
    const file = testCase(`${folder}/${name}`);
    await give(page, file);
    await settled(page);
    const way = page.locator("#result").getByRole("button", { name: "Plan touches" });
    if (await way.count()) await way.click();
    else await page.getByRole("tab", { name: "Plan" }).click();
    await page.locator("#plan-count").fill(count);
    await page.locator("#plan-go").click();
    const written = command([file], "plan", name, "--count", count, "--output", "touches.gcode");
    assert.equal(written.code, 0, written.said);
    await page.locator("#planned svg").waitFor();
    same(await downloaded(page, "Download touches.gcode"), written.file("touches.gcode"), "touches.gcode");
  });
}

for (const [what, folder, ...names] of [
  ["a printer's answer of its console", "console-answers", "m503.txt", "lower.txt"],
  ["a height map of RepRapFirmware", "rrf-heightmap", "config.g", "heightmap.csv"],
]) {
  journey(`${what} calibrates with its configuration, and is no fault`, async (page) => {
    const files = names.map((name) => testCase(`${folder}/${name}`));
    const written = command(files, "calibrate", ...names, "--output", "calibrated.toml", "--paste", "paste.g");
    await give(page, ...files);
    await result(page);
    assert.equal(await page.locator(`[data-name='${names[1]}']`).getAttribute("class"), "file");
    for (const [name, file] of [["calibrated.toml", "calibrated.toml"], ["paste.cfg", "paste.g"]]) same(await downloaded(page, `Download ${name}`), written.file(file), name);
  });
}

journey("heights are typed or pasted into a table", async (page) => {
  const rows = text(testCase("console-answers/xyh.csv")).trim().split("\n").slice(1).map((row) => row.split(","));
  await give(page, testCase("console-answers/config.g"));
  await page.locator("#result .fault").waitFor();
  await page.locator("#result").getByRole("button", { name: "Type heights" }).click();
  // From a spreadsheet, with decimal commas; the first by hand.
  const pasted = rows.slice(1).map((row) => row.join("\t").replaceAll(".", ",")).join("\n");
  const cells = page.locator("#heights-rows input");
  for (const [index, value] of rows[0].entries()) await cells.nth(index).fill(value);
  await cells.nth(3).focus();
  await page.evaluate((text) => navigator.clipboard.writeText(text), pasted);
  await page.keyboard.press("Control+V");
  await page.getByRole("button", { name: "Use these heights" }).click();
  await page.locator("[data-name='heights.csv']").waitFor({ state: "attached" });
  await page.locator("#chosen", { hasText: "heights.csv" }).waitFor();
  await settled(page);
  await list(page);
  const file = text(testCase("console-answers/xyh.csv")).trim().split("\n").map((row) => row.split(",").map((own) => (Number.isNaN(Number(own)) ? own : String(Number(own)))).join(","));
  assert.deepEqual((await downloaded(page, "Save heights.csv")).trim().split("\n"), file);
});

journey("an answer of Marlin's G33 calibrates with its configuration", async (page) => {
  const [settings, answer] = text(testCase("printers-cfg/marlin-octoprint.txt")).replaceAll("Recv: ", "").split("Send: G33 P3 V3\n");
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  const files = ["Configuration.h", "g33.txt"].map((name) => join(folder, name));
  writeFileSync(files[0], `${settings}#define PRINTABLE_RADIUS 100\n`);
  writeFileSync(files[1], answer);
  const written = command(files, "calibrate", "Configuration.h", "g33.txt", "--output", "calibrated.toml");
  await give(page, ...files);
  await result(page);
  assert.match(await page.locator("#verdict").innerText(), /From \d+ heights/);
  same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
});

journey("what waits for another file says which, and a log with Marlin's settings is the answer of its Configuration.h", async (page) => {
  await give(page, made("notes.txt", "levelled today\nagain\n"));
  await page.locator("#result", { hasText: "Add the robot file, or the printer's configuration, of notes.txt" }).waitFor();
  await list(page);
  await page.getByRole("button", { name: "Remove all" }).click();
  await give(page, example("paper-robot/robot.toml"));
  await page.locator("#result", { hasText: "robot.toml has no samples yet" }).waitFor();
  await page.locator("#result").getByRole("button", { name: "Plan" }).click();
  await page.locator("#plan").waitFor();
  await page.getByRole("tab", { name: "Calibrate" }).click();
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  const files = [join(folder, "Configuration.h"), testCase("printers-cfg/marlin-octoprint.txt")];
  writeFileSync(files[0], "#define DELTA_DIAGONAL_ROD 267.0\n#define DELTA_RADIUS 133.3\n#define DELTA_HEIGHT 368.5\n#define PRINTABLE_RADIUS 100\n");
  await list(page);
  await page.getByRole("button", { name: "Remove all" }).click();
  await give(page, ...files);
  await result(page);
  const written = command(files, "calibrate", "Configuration.h", "marlin-octoprint.txt", "--output", "calibrated.toml");
  same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
});

journey("a robot with targets and a tool calibrates as the command does", async (page) => {
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  const files = ["robot.toml", "samples.csv"].map((name) => join(folder, name));
  writeFileSync(files[0], `${text(example("paper-robot/robot.toml"))}\n[tool]\nx_mm = 0\ny_mm = 0\nz_mm = -50\n[targets.A]\nx_mm = 0\ny_mm = 0\nz_mm = 0\nsigma_mm = 0.01\n[targets.B]\nx_mm = 0\ny_mm = 0\nz_mm = 0\nsigma_mm = 0.02\n`);
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  writeFileSync(files[1], [`${head},target`, ...rows.map((row, index) => `${row},${"AB"[index % 2]}`), ""].join("\n"));
  const written = command(files, ...CALIBRATE);
  assert.equal(written.code, 0, written.said);
  await give(page, ...files);
  await result(page);
  for (const name of ["calibrated.toml", "report.html"]) same(await downloaded(page, `Download ${name}`), written.file(name), name);
});

const millimetres = (length = "") => length.replace("mm", "");
// What a reader of the tutorial does on the page for a command with these files and options; the button of its result.
const STEPS = {
  async plan(page, [robot], { measure = "xyz", frame = "base", ...has }) {
    await set(page, { "plan-robot": robot, "plan-measure": `${measure}|${frame}`, "plan-count": has.count, "plan-within": has.within ?? "", "plan-names": has.names ?? "", "plan-seed": has.seed ?? "1", "plan-absolute": "absolute" in has, "plan-check": has.validation ?? "" });
    await page.locator("#plan-go").click();
    return [/Download (poses|check|touches)\./, has.output];
  },
  async calibrate(page, files, has) {
    if (has.frame && (await page.inputValue("#frame")) !== has.frame) await page.getByRole("button", { name: "Positions in the sensor's frame" }).click();
    await set(page, { printed: has.printed ?? "", shrinkage: has.shrinkage ?? "" });
    await result(page);
    return has.paste ? ["Download paste.cfg", has.paste] : ["Download calibrated.toml", has.output];
  },
  async validate(page, [robot, samples, second = ""], { frame, ...has }) {
    await set(page, { "validate-robot": robot, "validate-samples": samples, "validate-second": second, "validate-frame": frame, "validate-limit": millimetres(has.limit), "validate-guard": "guard" in has });
    await page.locator("#validate-go").click();
    return ["Download certificate.html", "certificate.html"];
  },
  async export(page, [robot], has) {
    await set(page, { "export-robot": robot, "export-target": has.for, "export-nominal": has.nominal ?? "", "export-home": has.home ?? "", "export-limit": millimetres(has.limit) });
    await page.locator("#export").getByRole("button", { name: "Export" }).click();
    return [new RegExp(`Download ${has.for}\\.(?!json)`), has.output];
  },
};

// The page has no folders, and its result this name.
const tutorial = text(join(ROOT, "docs/tutorial.md")).replaceAll("packer.toml", "calibrated.toml");
for (const part of tutorial.split(/^##+ /m).reduce((all, own) => (/^\d/.test(own) ? [...all.slice(0, -1), all.at(-1) + own] : [...all, own]), []).filter((own) => own.includes("\n$ "))) {
  journey(`the tutorial on the page: ${part.split("\n")[0]}`, async (page) => {
    const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
    if (part.includes("examples/plant/")) cpSync(example("plant"), folder, { recursive: true });
    const given = new Set(["calibrated.toml"]);
    for (const [, kind, name, body] of part.matchAll(/^```([a-z]+) ?(\S*)\n([^]*?)^```/gm)) {
      if (name) writeFileSync(join(folder, name), body);
      for (const [, line] of kind === "console" ? body.replaceAll("examples/plant/", "").matchAll(/^\$ delta-cal (.*)/gm) : []) {
        const [task, ...words] = line.replaceAll(/ --report \S+/g, "").split(" ");
        const has = Object.fromEntries(line.split(" --").slice(1).map((own) => own.split(" ")));
        const files = words.slice(0, words.findIndex((own) => own.startsWith("--")));
        const written = run(folder, [task, ...words, ...(task === "validate" ? ["--report", "certificate.html"] : [])]);
        const added = [...files, has.nominal, has.validation].filter((own) => own && !given.has(own));
        for (const own of added) given.add(own);
        if (added.length) await give(page, ...added.map((own) => join(folder, own)));
        await page.locator(`#tab-${task}`).click();
        const [label, output] = await STEPS[task](page, files, has);
        const button = page.locator(`#panel-${task}`).getByRole("button", { name: label }).first();
        await button.waitFor();
        if (output) same(await downloaded(page, await button.innerText()), written.file(output), line);
        if (task === "plan") assert.ok(plain(written.said).startsWith(plain(await page.locator("#planned pre").first().innerText())) || has.validation || output === "touches.gcode", written.said);
      }
    }
  });
}

journey("a calibration is compared with the file that it comes from", async (page) => {
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  await give(page, ...files);
  await result(page);
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "calibrated.toml"), await downloaded(page, "Download calibrated.toml"));
  await page.getByRole("tab", { name: "Validate" }).click();
  await page.selectOption("#validate-samples", "robot.toml");
  await page.getByRole("button", { name: "Compare" }).click();
  const written = command([files[0], join(folder, "calibrated.toml")], "validate", "robot.toml", "calibrated.toml", "--json", "comparison.json");
  alike(await downloaded(page, "Download comparison.json"), written.file("comparison.json"), "comparison.json");
});

journey("what more measurements bring is drawn over their number", async (page) => {
  await give(page, example("paper-robot/robot.toml"));
  await page.getByRole("tab", { name: "Plan" }).click();
  await page.locator("#plan-robot option[value='robot.toml']").waitFor({ state: "attached" });
  await page.getByRole("button", { name: "Expected error by count" }).click();
  await page.locator("#curve td").first().waitFor();
  const written = command([example("paper-robot/robot.toml")], "plan", "robot.toml", "--count", "8", "--frame", "sensor", "--json", "plan.json", "--output", "poses.csv");
  const { planned } = JSON.parse(written.file("plan.json"));
  assert.equal(await page.locator("#curve td").first().innerText(), planned.relative_rms_mm.toPrecision(2));
});

journey("an export for the printer itself has the bed of its lines", async (page) => {
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await result(page);
  const paste = await downloaded(page, "Download paste.cfg");
  await page.getByRole("tab", { name: "Export" }).click();
  await page.locator("#export-target option[value=klipper]").waitFor({ state: "attached" });
  await page.selectOption("#export-target", "klipper");
  await page.locator("#export").getByRole("button", { name: "Export" }).click();
  await page.locator("#lines").waitFor();
  const settings = (lines) => lines.split("\n").filter((line) => /^[a-z_]+:/.test(line) && !line.startsWith("kinematics"));
  assert.deepEqual(settings(await page.locator("#lines").innerText()), settings(paste));
  // Whole in print.
  await page.emulateMedia({ media: "print" });
  assert.equal(await page.locator("#lines").evaluate((own) => own.scrollHeight > own.clientHeight || own.scrollWidth > own.clientWidth), false);
});

journey("the warning of a crash stands above the button, and inside what is copied", async (page) => {
  await give(page, testCase("klipper-41-touches/printer_7_of_41.cfg"));
  await result(page);
  const warning = page.locator("#verdict .crash");
  assert.match(await warning.innerText(), /end stop moves by/);
  const button = page.getByRole("button", { name: "Copy the lines" });
  assert.ok((await warning.boundingBox()).y < (await button.boundingBox()).y);
  await button.click();
  assert.match(await page.evaluate(() => navigator.clipboard.readText()), /WARNING: an end stop moves by/);
});

test("a program that is not there is asked for three times, and the page says so", { timeout: 60_000 }, async () => {
  const context = await browser.newContext({ serviceWorkers: "block" });
  const page = await context.newPage();
  let asked = 0;
  await page.route("**/*.lzma", (route) => {
    asked++;
    return route.fulfill({ status: 404 });
  });
  await page.goto(server.address);
  await give(page, example("printer/printer.cfg"));
  await page.getByText("could not be loaded in 3 tries").waitFor();
  assert.equal(asked, 3);
  await context.close();
});

for (const call of ["recognise", "calibrate"]) {
  test(`a crash in ${call} names the file, and the page goes on`, { timeout: 60_000 }, async () => {
    const context = await browser.newContext({ serviceWorkers: "block" });
    const page = await context.newPage();
    await page.route("**/worker.js", async (route) => {
      const response = await route.fetch();
      const source = await response.text();
      const [, name, values] = source.match(/call:([\w$]+),values:([\w$]+)/);
      const crash = `if (${name} === "${call}" && ${values}.join().includes("bad.toml")) throw new WebAssembly.RuntimeError("unreachable");`;
      const program = source.replace(/(const|let) [\w$]+=performance\.now\(\)/, (begin) => `${crash}${begin}`);
      return route.fulfill({ response, body: program });
    });
    await page.goto(server.address);
    await give(page, made("bad.toml", text(example("paper-robot/robot.toml"))), example("paper-robot/samples.csv"));
    await page.getByText("the program failed on bad.toml").first().waitFor();
    await list(page);
    await page.getByRole("button", { name: "Remove bad.toml" }).click();
    await give(page, example("paper-robot/robot.toml"));
    await page.locator("#verdict").waitFor();
    await context.close();
  });
}

journey("50 calibrations leave no listeners and no nodes behind", async (page, { context }) => {
  const session = await context.newCDPSession(page);
  await session.send("Performance.enable");
  const counts = async () => {
    for (let round = 0; round < 3; round++) await session.send("HeapProfiler.collectGarbage");
    const { metrics } = await session.send("Performance.getMetrics");
    return Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
  };
  await give(page, example("printer/printer.cfg"));
  await result(page);
  await page.locator("#options").evaluate((own) => (own.open = true));
  const again = async (index) => {
    await page.getByLabel("Delta radius").fill(`${161 + index / 100}±1`);
    await page.getByLabel("Delta radius").press("Tab");
    await page.waitForFunction((wanted) => window.shown !== (window.shown = document.querySelector("#verdict")) && wanted !== undefined, index);
    await result(page);
    await page.locator("#robot-picture canvas").waitFor();
    // The end of the report, which is shown part by part.
    await page.locator("#report footer").waitFor();
  };
  for (let index = 0; index < 15; index++) await again(index);
  const before = await counts();
  for (let index = 15; index < 65; index++) await again(index);
  const after = await counts();
  for (const name of ["Nodes", "JSEventListeners", "JSHeapUsedSize"]) {
    assert.ok(after[name] <= 1.05 * before[name] + 50, `${name}: ${before[name]}, then ${after[name]}`);
  }
});

journey("after the editor the focus is where it came from", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await result(page);
  await list(page);
  await page.getByRole("button", { name: "Edit robot.toml" }).click();
  await page.locator("#editor-text").waitFor();
  await page.getByRole("button", { name: "Close editor" }).click();
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("aria-label")), "Edit robot.toml");
});
