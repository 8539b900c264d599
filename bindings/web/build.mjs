// Builds the page into dist/ and as one file, delta-cal.html: `node bindings/web/build.mjs`. Needs cargo with the target
// wasm32-unknown-unknown, xz, and `npm ci` in this folder.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { cpSync, mkdirSync, readFileSync, readdirSync, renameSync, rmSync, statSync, writeFileSync } from "node:fs";
import { homedir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { brotliCompressSync, gzipSync } from "node:zlib";
import bundler from "esbuild";
import { unpacked } from "./page/unpack.js";

const HERE = dirname(fileURLToPath(import.meta.url));
const ROOT = join(HERE, "../..");
const TARGET = process.env.CARGO_TARGET_DIR ?? join(ROOT, "target/web");
const DIST = join(HERE, "dist");
/** A browser downloads the program: half as much is inlined as for speed alone, the hash is a loop, and the sources' paths say nothing there. */
const FLAGS = `--cfg sha2_backend_soft="compact" -Cllvm-args=-inline-threshold=8 -Cllvm-args=-inlinehint-threshold=35 --remap-path-prefix=${process.env.CARGO_HOME ?? join(homedir(), ".cargo")}=.`;
/** Of everything together, compressed as all static hosts do it: with gzip. */
const LARGEST = 720_000;
/** Where the header of an `.lzma` file states how long its content is. */
const LENGTH_AT = 5;
const EXAMPLES = ["paper-robot/robot.toml", "paper-robot/samples.csv", "circle-sheet/robot.toml", "circle-sheet/samples.csv", "printer/printer.cfg"];

function run(program, ...values) {
  const env = { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: FLAGS, ...process.env };
  execFileSync(program, values, { cwd: ROOT, stdio: "inherit", env });
}

const program = "wasm32-unknown-unknown/web/delta_cal_web.wasm";
run("cargo", "build", "--profile", "web", "--target", "wasm32-unknown-unknown", "--package", "delta-cal-web", "--target-dir", TARGET);
rmSync(DIST, { recursive: true, force: true });
mkdirSync(DIST);
run("cargo", "run", "--quiet", "--package", "delta-cal-web-bindgen", "--target-dir", TARGET, "--", join(TARGET, program), DIST);

// The types of the boundary are for `npm run check`, and not of the page.
const TYPES = join(HERE, "types");
rmSync(TYPES, { recursive: true, force: true });
mkdirSync(TYPES);
for (const name of readdirSync(DIST).filter((name) => name.endsWith(".d.ts"))) renameSync(join(DIST, name), join(TYPES, name));
const schema = JSON.parse(readFileSync(join(ROOT, "docs/calibration.schema.json"), "utf8"));
writeFileSync(join(TYPES, "calibration.d.ts"), `export type Report = ${typed(schema)};\n`);

const module = join(DIST, "delta_cal_web_bg.wasm");
const features = ["--enable-bulk-memory", "--enable-nontrapping-float-to-int", "--enable-sign-ext", "--enable-mutable-globals", "--enable-reference-types", "--enable-multivalue", "--enable-simd"];
run("node", join(HERE, "node_modules/binaryen/bin/wasm-opt"), "-Os", "-Os", "-Os", "--strip-producers", ...features, module, "-o", module);
const optimised = readFileSync(module);
// In a program the byte before predicts more than the place does: with these settings it is half a percent smaller.
const packed = execFileSync("xz", ["--format=lzma", "--lzma1=preset=9e,lc=4,pb=0", "--stdout", module], { maxBuffer: 2 * LARGEST });
// xz states no length.
packed.writeBigUInt64LE(BigInt(optimised.length), LENGTH_AT);
if (!optimised.equals(unpacked(packed))) throw new Error("the program is not what was packed");
writeFileSync(join(DIST, "delta_cal_web.lzma"), packed);
rmSync(module);

cpSync(join(HERE, "page"), DIST, { recursive: true });
await bundled();
for (const example of EXAMPLES) cpSync(join(ROOT, "host/examples", example), join(DIST, "examples", example));

const inside = (folder, prefix = "") =>
  readdirSync(folder).flatMap((name) => {
    const path = join(folder, name);
    return statSync(path).isDirectory() ? inside(path, `${prefix}${name}/`) : [`${prefix}${name}`];
  });
const files = inside(DIST).filter((file) => file !== "sw.js").sort();
const hash = createHash("sha256");
for (const file of files) hash.update(readFileSync(join(DIST, file)));
const worker = readFileSync(join(DIST, "sw.js"), "utf8")
  .replace("const FILES = [];", `const FILES = ${JSON.stringify(["./", ...files])};`)
  .replace("delta-cal-unbuilt", `delta-cal-${hash.digest("hex").slice(0, 16)}`);
writeFileSync(join(DIST, "sw.js"), worker);

await oneFile();

let [all, compressed, zipped] = [0, 0, 0];
for (const file of [...files, "sw.js"]) {
  const bytes = readFileSync(join(DIST, file));
  all += bytes.length;
  compressed += brotliCompressSync(bytes).length;
  zipped += gzipSync(bytes, { level: 9 }).length;
}
console.log(`dist: ${files.length + 1} files, ${kilobytes(all)}; Brotli ${kilobytes(compressed)}, gzip ${kilobytes(zipped)}`);
if (zipped > LARGEST) {
  console.error(`The page is larger than ${kilobytes(LARGEST)}.`);
  process.exit(1);
}

/** A JSON Schema as a type of TypeScript. */
function typed({ type, properties, items, anyOf, enum: values }) {
  if (anyOf) return anyOf.map(typed).join(" | ");
  if (values) return values.map((own) => JSON.stringify(own)).join(" | ");
  const kinds = {
    array: () => `(${typed(items)})[]`,
    object: () => `{ ${Object.entries(properties).map(([name, own]) => `${name}: ${typed(own)}`).join("; ")} }`,
    integer: () => "number",
  };
  return [type].flat().map((kind) => kinds[kind]?.() ?? kind).join(" | ");
}

/** Two scripts in place of all modules, without what only people read. */
async function bundled() {
  const entries = ["app.js", "worker.js"].map((name) => join(DIST, name));
  for (const entry of [...entries, join(DIST, "style.css")]) {
    await bundler.build({ entryPoints: [entry], bundle: true, format: "esm", minifyWhitespace: true, minifySyntax: true, minifyIdentifiers: true, outdir: DIST, allowOverwrite: true });
  }
  const kept = ["app.js", "worker.js", "sw.js"];
  for (const name of readdirSync(DIST).filter((name) => name.endsWith(".js") && !kept.includes(name))) rmSync(join(DIST, name));
}

/** The page in one file, which a browser opens without a server: it loads neither modules nor workers from files. */
async function oneFile() {
  const bundle = async (entry) => {
    const define = { "import.meta.url": '""' };
    const built = await bundler.build({ entryPoints: [join(DIST, entry)], bundle: true, minify: true, write: false, define });
    return built.outputFiles[0].text;
  };
  const inDist = (name, encoding = "utf8") => readFileSync(join(DIST, name), encoding);
  const examples = Object.fromEntries(EXAMPLES.map((name) => [`examples/${name}`, inDist(`examples/${name}`)]));
  const kept = {
    program: inDist("delta_cal_web.lzma", "base64"),
    worker: await bundle("worker.js"),
    examples: JSON.stringify(examples),
  };
  const script = await bundle("app.js");
  const style = inDist("style.css");
  const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
  // The worker is subject to the page's policy, and begins with its program.
  const policy = `default-src 'none'; script-src ${hash(script)} blob: 'wasm-unsafe-eval'; style-src ${hash(style)}; img-src data:; worker-src blob:; base-uri 'none'; form-action 'none'`;
  const inside = (text) => text.replaceAll("</", "<\\/");
  const data = Object.entries(kept).map(([name, text]) => `<script type="text/plain" data-kept="${name}">${inside(text)}</script>`);
  const page = inDist("index.html")
    .replace(/(Content-Security-Policy" content=)"[^"]*"/, (_, before) => `${before}"${policy}"`)
    .replace('<link rel="stylesheet" href="style.css">', () => `<style>${style}</style>`)
    .replace('<script type="module" src="app.js"></script>', "")
    .replace("</body>", () => `${data.join("\n")}\n<script>${script}</script>\n</body>`);
  writeFileSync(join(HERE, "delta-cal.html"), page);
  console.log(`delta-cal.html: ${kilobytes(page.length)}`);
}

function kilobytes(bytes) {
  return `${(bytes / 1000).toFixed(0)} KB`;
}
