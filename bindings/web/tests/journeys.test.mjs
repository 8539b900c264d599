// The journeys of the page in a real browser. What the page offers is compared with what the command writes.

import assert from "node:assert/strict";
import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import axe from "axe-core";
import { FILE, alike, command, downloaded, example, give, launch, open, same, serve, testCase, text } from "./page.mjs";

let server, browser;

before(async () => {
  server = await serve();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.stop();
});

/** A journey; nobody else is asked, and the console stays silent. */
function journey(name, travel, settings, address) {
  test(name, { timeout: 120_000 }, async () => {
    const opened = await open(browser, address ?? server.address, settings);
    try {
      await travel(opened.page, opened);
      assert.deepEqual(opened.asked, [], "requests to others");
      assert.deepEqual(opened.said, [], "the console");
    } finally {
      await opened.close();
    }
  });
}

/** Waits for a result or a fault. */
async function settled(page) {
  await page.locator("#result > *").first().waitFor();
}

const CALIBRATE = ["calibrate", "robot.toml", "samples.csv", "--output", "calibrated.toml", "--report", "report.html", "--json", "report.json"];

journey("the built-in example calibrates to the bits of the command", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
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
    await page.locator("#options summary").click();
    // Those of a printer are shown once there is one.
    for (const [id, value] of Object.entries(fields)) {
      await page.locator(`#${id}`).evaluate((field, value) => (field.value = value), value);
    }
    await give(page, ...files);
    await page.locator(".file").nth(names.length - 1).waitFor();
    await settled(page);
    if (written.code === 0) {
      await page.locator("#downloads").waitFor();
      same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
      alike(await downloaded(page, "Download report.json"), written.file("report.json"), "report.json");
      return;
    }
    const said = plain(await page.locator("#result .fault").innerText());
    for (const line of plain(written.said).matchAll(/(?:error|refused|diagnosis|help): (.*?)(?= diagnosis: | help: |$)/g)) {
      // The command shows the line at fault between cause and help.
      const [cause] = line[1].split(/ \| ?\d* ?\|| +\d* \| /);
      assert.ok(said.includes(cause.trim()), `${cause}\n---\n${said}`);
    }
  });
}

function plain(text) {
  return text.replaceAll(/\s+/g, " ").trim();
}

journey("from a printer's configuration to the lines to paste", async (page) => {
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await page.locator("#paste").waitFor();
  const written = command([example("printer/printer.cfg")], "calibrate", "printer.cfg", "--paste", "paste.cfg", "--report", "report.html");
  same(await downloaded(page, "Download paste.cfg"), written.file("paste.cfg"), "paste.cfg");
  same(await downloaded(page, "Download report.html"), written.file("report.html"), "report.html");
  await page.getByRole("button", { name: "Copy the lines to paste" }).click();
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), written.file("paste.cfg"));
  await page.locator("#bed-picture rect").nth(100).hover();
  assert.match(await page.locator("#bed-picture output").innerText(), /mm at x/);
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
  await page.locator("#downloads").waitFor();
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  same(await downloaded(page, "Download calibrated.toml"), command(files, ...CALIBRATE).file("calibrated.toml"), "calibrated.toml");
});

journey("a binary dropped by mistake is named, and the rest still calibrates", async (page) => {
  const picture = { name: "photo.png", mimeType: "image/png", buffer: Buffer.from("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "latin1") };
  await give(page, picture, example("paper-robot/robot.toml"), example("paper-robot/samples.csv"));
  await page.locator("#downloads").waitFor();
  assert.match(await page.locator("[data-name='photo.png'] .fault").innerText(), /photo\.png: is not a text file/);
});

// Chromium lets one page download some twenty files in a row.
for (const half of [0, 1]) journey(`every export is what the command writes: ${half + 1} of 2`, async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
  const calibrated = await downloaded(page, "Download calibrated.toml");
  await page.getByRole("tab", { name: "Export" }).click();
  await page.locator("#export-target option[value=klipper]").waitFor({ state: "attached" });
  const targets = await page.locator("#export-target option").evaluateAll((all) => all.map((own) => own.value));
  assert.ok(targets.length >= 12, targets.join());
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "calibrated.toml"), calibrated);
  const files = [join(folder, "calibrated.toml"), example("paper-robot/robot.toml")];
  for (const target of targets.filter((_, index) => index % 2 === half)) {
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
  assert.match(await page.locator("[data-name='robot.toml'] .what").innerText(), /upper arms 250\.0 mm/);
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.locator("#planned svg").first().waitFor();
  assert.doesNotMatch(await page.locator("#planned pre").innerText(), /\u001b|\[1m/);
  const robot = await downloaded(page, "Save robot.toml");
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  writeFileSync(join(folder, "robot.toml"), robot);
  const values = ["--count", "20", "--frame", "sensor", "--output", "poses.csv", "--json", "plan.json"];
  const written = command([join(folder, "robot.toml")], "plan", "robot.toml", ...values);
  same(await downloaded(page, "Download poses.csv"), written.file("poses.csv"), "poses.csv");
  alike(await downloaded(page, "Download plan.json"), written.file("plan.json"), "plan.json");
  assert.equal(await page.locator(".checklist tbody tr").count(), 21);
});

journey("a second file of readings validates the result", async (page) => {
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  const file = (name, some) => ({ name, mimeType: "text/csv", buffer: Buffer.from([head, ...some, ""].join("\n")) });
  await give(page, example("paper-robot/robot.toml"), file("samples.csv", rows.slice(0, 20)));
  await page.locator("#downloads").waitFor();
  await give(page, file("check.csv", rows.slice(20)));
  await page.locator("[data-name='check.csv']").waitFor();
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
  const picture = page.locator("#samples-picture svg");
  await picture.focus();
  await page.keyboard.press("ArrowRight");
  const told = await page.locator("#samples-picture output").innerText();
  assert.match(told, /^Line 4: .* before, .* after/);
  await page.locator("#robot-picture canvas").waitFor();
});

journey("what takes long is stopped, and the page goes on", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
  await page.getByRole("tab", { name: "Plan" }).click();
  await page.getByLabel("Measurements", { exact: true }).fill("500");
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.locator("#planned .fault").waitFor();
  await page.getByLabel("Measurements", { exact: true }).fill("12");
  await page.locator("#plan").getByRole("button", { name: "Plan", exact: true }).click();
  await page.locator("#planned svg").first().waitFor();
});

journey("100,000 rows calibrate while the page stays free", async (page) => {
  const [head, rows] = split(text(example("paper-robot/samples.csv")));
  const many = [head];
  for (let index = 0; index < 100_000; index++) {
    // Equal rows count once: the last digits differ.
    const cells = rows[index % rows.length].split(",");
    cells[3] = `${cells[3]}${String(index).padStart(6, "0")}`;
    many.push(cells.join(","));
  }
  await page.evaluate(() => {
    window.longest = 0;
    new PerformanceObserver((list) => {
      for (const own of list.getEntries()) window.longest = Math.max(window.longest, own.duration);
    }).observe({ entryTypes: ["longtask"] });
  });
  const path = join(mkdtempSync(join(tmpdir(), "delta-cal-web-")), "many.csv");
  writeFileSync(path, many.join("\n"));
  await give(page, example("paper-robot/robot.toml"), path);
  await page.locator("#result > *").first().waitFor({ timeout: 110_000 });
  assert.match(await page.locator("[data-name='many.csv'] .what").innerText(), /100.?000 samples/);
  const longest = await page.evaluate(() => window.longest);
  console.log(`100,000 rows: ${await page.locator("#status").innerText()}; longest task of the page ${longest.toFixed(0)} ms`);
  assert.ok(longest <= 50, `${longest} ms`);
});

journey("a campaign counts its robots, can be cancelled, and has the rows of the command", async (page) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
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
  await page.locator("#downloads").waitFor();
  const files = [example("paper-robot/robot.toml"), example("paper-robot/samples.csv")];
  const written = command(files, ...CALIBRATE);
  same(await downloaded(page, "Download calibrated.toml"), written.file("calibrated.toml"), "calibrated.toml");
  alike(await downloaded(page, "Download report.json"), written.file("report.json"), "report.json");
  await page.getByRole("button", { name: "Printer with Klipper" }).click();
  await page.locator("#paste").waitFor();
}, {}, pathToFileURL(FILE).href);

journey("after the first visit the page works without its server", async (page, { context }) => {
  await page.evaluate(() => navigator.serviceWorker.ready);
  await context.setOffline(true);
  await page.reload();
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
});

journey("leaving the page with files asks", async (page, { said }) => {
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
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
  ["Plan", "Plan"],
  ["Simulate", null],
  ["New robot", null],
];
for (const settings of [
  { colorScheme: "light", viewport: { width: 1200, height: 900 } },
  { colorScheme: "dark", viewport: { width: 380, height: 800 } },
]) {
  const look = `${settings.colorScheme}-${settings.viewport.width}`;
  journey(`no barrier that axe finds: ${look}`, async (page) => {
    await page.getByRole("button", { name: "Printer with Klipper" }).click();
    await page.locator("#robot-picture").waitFor();
    // The tests may add a script; the page's policy does not allow it to others.
    for (const [tab, button] of LOOKS) {
      await page.getByRole("tab", { name: tab }).click();
      const panel = page.getByRole("tabpanel", { name: tab });
      if (button) {
        await panel.getByRole("button", { name: button, exact: true }).click();
        await panel.locator("pre").first().waitFor();
      }
      if (process.env.SCREENSHOTS) {
        await page.screenshot({ path: join(process.env.SCREENSHOTS, `${look}-${tab.replace(" ", "-")}.png`), fullPage: true });
      }
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 0, `${tab} is ${wide} px too wide`);
      await page.evaluate(axe.source);
      const { violations } = await page.evaluate(() => window.axe.run({ runOnly: ["wcag2a", "wcag2aa", "wcag21aa"] }));
      assert.deepEqual(violations.map((own) => `${tab}: ${own.id}: ${own.nodes[0].html}`), []);
    }
  }, settings);
}

journey("the first result within a second, the example within 60 ms", async (page) => {
  const begin = Date.now();
  await page.reload();
  await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
  await page.locator("#downloads").waitFor();
  const first = Date.now() - begin;
  const times = [];
  for (let round = 0; round < 10; round++) {
    await page.getByRole("button", { name: "Robot of a paper, simulated" }).click();
    await page.waitForTimeout(250);
    times.push(Number(/in (\d+) ms/.exec(await page.locator("#status").innerText())[1]));
  }
  const quickest = Math.min(...times);
  console.log(`first result ${first} ms after the page was asked for; the example ${quickest} ms (${times.join(", ")})`);
  assert.ok(first <= 1000, `${first} ms`);
  assert.ok(quickest <= 60, `${quickest} ms`);
});
