// `node bindings/web/tests/times.mjs`: how long the first results take, each in a browser that has nothing of the page. Medians of
// seven, and what else the machine did meanwhile; with `--write` into docs/web.md.

import { loadavg } from "node:os";
import { example, launch, open, serve, text, write } from "./page.mjs";

const ROUNDS = 7;
const [head, ...rows] = text(example("paper-robot/samples.csv")).split("\n").filter((line) => line && !line.startsWith("#"));
// Equal rows count once: the last digits differ.
const many = Array.from({ length: 1000 }, (_, index) => rows[index % rows.length].split(",").map((own, place) => (place === 3 ? `${own}${String(index).padStart(4, "0")}` : own)).join(","));
const robot = { name: "robot.toml", mimeType: "text/plain", buffer: Buffer.from(text(example("paper-robot/robot.toml"))) };
const files = (some) => [robot, { name: "samples.csv", mimeType: "text/csv", buffer: Buffer.from([head, ...some, ""].join("\n")) }];

const found = {};
const server = await serve();
for (let round = 0; round < ROUNDS; round++) {
  const browser = await launch();
  const { page } = await open(browser, server.address, { serviceWorkers: "block" });
  /** From files given to the verdict on the page, ms. */
  const result = async (name, some) => {
    await page.evaluate(() => {
      globalThis.verdict = new Promise((resolve) => {
        new MutationObserver((_, own) => document.querySelector("#verdict") && (own.disconnect(), resolve(performance.now()))).observe(document.querySelector("#result"), { childList: true });
        document.querySelector("#choose").addEventListener("change", () => (globalThis.given = performance.now()), { once: true });
      });
    });
    await page.setInputFiles("#choose", files(some));
    (found[name] ??= []).push(await page.evaluate(async () => (await globalThis.verdict) - globalThis.given));
  };
  (found["page loaded, its program not yet"] ??= []).push(await page.evaluate(() => performance.getEntriesByType("navigation")[0].duration));
  await result("40 rows, cold", rows);
  await result("40 rows, again", [...rows].reverse());
  await result("1,000 rows", many);
  await browser.close();
}
server.stop();
const middle = {};
for (const [name, all] of Object.entries(found)) {
  middle[name] = all.sort((one, other) => one - other)[ROUNDS >> 1];
  console.log(`${name}: ${middle[name].toFixed(0)} ms (${all[0].toFixed(0)} to ${all.at(-1).toFixed(0)})`);
}
console.log(`load: ${loadavg()[0].toFixed(1)}`);
const [first, again, thousand] = ["40 rows, cold", "40 rows, again", "1,000 rows"].map((name) => (middle[name] / 1000).toFixed(2));
if (process.argv.includes("--write")) write({ first, again, thousand });
