// What the journeys share: the page served as anybody would serve it, a browser that may ask nobody else, and the command.

import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const HERE = dirname(fileURLToPath(import.meta.url));
export const ROOT = join(HERE, "../../..");
/** Where the page is, unpacked: `PAGE` names another folder than where it was built. */
const PAGE = process.env.PAGE ?? join(HERE, "..");
export const DIST = join(PAGE, "dist");
/** The page in one file. */
export const FILE = join(PAGE, "delta-cal.html");
/** All pages and commands are of this time. */
export const NOW = 1_772_000_000;
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";

export function example(path) {
  return join(ROOT, "host/examples", path);
}

export function testCase(path) {
  return join(ROOT, "host/tests/cases", path);
}

export function text(path) {
  return readFileSync(path, "utf8");
}

const ABOUT = join(ROOT, "docs/web.md");
const FIGURE = /([\d.]+)<!--(\w+)-->/g;

/** The figures of docs/web.md, each with its name behind it. */
export function figures() {
  return Object.fromEntries([...text(ABOUT).matchAll(FIGURE)].map(([, shown, name]) => [name, Number(shown)]));
}

/** Writes some of them. */
export function write(measured) {
  const shown = (all, old, name) => (name in measured ? `${measured[name]}<!--${name}-->` : all);
  writeFileSync(ABOUT, text(ABOUT).replaceAll(FIGURE, shown));
}

/** The page on a free port, by the server that the README names. */
export async function serve() {
  if (!existsSync(DIST)) throw new Error("dist/ is not there: node bindings/web/build.mjs");
  const server = spawn("python3", ["-u", "-m", "http.server", "--bind", "127.0.0.1", "-d", DIST, "0"], {
    stdio: ["ignore", "pipe", "pipe"],
  });
  const address = await new Promise((resolve, reject) => {
    server.once("error", reject);
    server.stdout.on("data", (said) => {
      const port = /port (\d+)/.exec(String(said))?.[1];
      if (port) resolve(`http://127.0.0.1:${port}/`);
    });
  });
  server.stderr.resume();
  return { address, stop: () => server.kill() };
}

export function launch() {
  return chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox"] });
}

/** A fresh page; `asked` lists every request to anybody but the server, `said` what the console said. */
export async function open(browser, address, settings = {}) {
  const context = await browser.newContext({ acceptDownloads: true, permissions: ["clipboard-read", "clipboard-write"], ...settings });
  const [asked, said] = [[], []];
  context.on("request", (request) => {
    if (!request.url().startsWith(address) && !/^(data|blob):/.test(request.url())) asked.push(request.url());
  });
  await context.addInitScript((now) => {
    Date.now = () => now * 1000;
  }, NOW);
  const page = await context.newPage();
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) said.push(message.text());
  });
  page.on("pageerror", (error) => said.push(String(error)));
  page.on("dialog", (dialog) => dialog.accept());
  await page.goto(address);
  // A page that is just being left may never say that it is closed.
  const close = () => Promise.race([context.close(), new Promise((resolve) => setTimeout(resolve, 10_000).unref())]);
  return { page, context, asked, said, close };
}

/** Gives the page files as a choice or a drop does. */
export async function give(page, ...files) {
  // By their paths the page itself does no work for it.
  if (files.every((file) => typeof file === "string")) return page.setInputFiles("#choose", files);
  const given = files.map((file) =>
    typeof file === "string" ? { name: basename(file), mimeType: "text/plain", buffer: readFileSync(file) } : file,
  );
  await page.setInputFiles("#choose", given);
}

/** The text of a download. */
export async function downloaded(page, label) {
  const waiting = page.waitForEvent("download");
  await page.getByRole("button", { name: label, exact: true }).click();
  const file = await waiting;
  return text(await file.path());
}

/** Runs the command on the same files; what it wrote by name, and what it said. */
export function command(files, ...values) {
  const folder = mkdtempSync(join(tmpdir(), "delta-cal-web-"));
  for (const file of files) execFileSync("cp", [file, folder]);
  return run(folder, values);
}

/** The same in a folder that has them. */
export function run(folder, values) {
  const program = process.env.DELTA_CAL ?? join(ROOT, "target/debug/delta-cal");
  let said;
  let code = 0;
  try {
    said = execFileSync(program, values, {
      cwd: folder,
      encoding: "utf8",
      stdio: ["ignore", "pipe", "pipe"],
      env: { ...process.env, SOURCE_DATE_EPOCH: String(NOW), NO_COLOR: "1", COLUMNS: "80" },
    });
  } catch (error) {
    if (error.status === undefined || error.status === null) throw error;
    [said, code] = [error.stdout + error.stderr, error.status];
  }
  // The page has no command line to name.
  const line = /<dt>Command<\/dt><dd>.*?<\/dd>|,\s*"command": "[^"]*"/;
  return { said, code, file: (name) => text(join(folder, name)).replace(line, "") };
}

/** That two texts are equal, byte for byte; otherwise where they begin to differ. */
export function same(found, expected, name) {
  if (found === expected) return;
  let at = 0;
  while (found[at] === expected[at]) at++;
  const near = (text) => JSON.stringify(text.slice(Math.max(0, at - 60), at + 60));
  throw new Error(`${name} differs from the command's at byte ${at}:\n${near(found)}\n${near(expected)}`);
}

/**
 * That two JSON texts say the same, numbers to the twelfth digit: where a figure comes from the C library's functions, its last
 * digit differs from machine to machine.
 */
export function alike(found, expected, name) {
  const differ = (one, other, at) => {
    if (typeof one === "number" && typeof other === "number") {
      return Math.abs(one - other) <= 1e-10 * Math.abs(other) + 1e-12 ? [] : [`${at}: ${one}, ${other}`];
    }
    if (one === null || other === null || typeof one !== "object" || typeof other !== "object") {
      return one === other ? [] : [`${at}: ${one}, ${other}`];
    }
    const keys = [...new Set([...Object.keys(one), ...Object.keys(other)])];
    return keys.flatMap((key) => differ(one[key], other[key], `${at}.${key}`));
  };
  const differences = differ(JSON.parse(found), JSON.parse(expected), "");
  if (differences.length) throw new Error(`${name} differs from the command's:\n${differences.slice(0, 5).join("\n")}`);
}
