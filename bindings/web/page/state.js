// What the page knows, as one value: files, what was chosen, and what was computed from which of it. No function here touches
// the document; each returns a new state. A result whose files or choices changed is no longer in the state.

/** @typedef {"calibrate" | "export" | "validate" | "plan" | "curve" | "simulate"} Task */
/** @typedef {import("./delta_cal_web.js").Session} Session */
/** @typedef {Partial<import("./delta_cal_web.js").Fault> & {message: string}} Fault */
/**
 * What the program is asked: request and answer of each call, as its Rust says.
 * @typedef {{[Own in Call]: {request: NonNullable<Parameters<Session[Own]>[0]["of"]>, answer: NonNullable<NonNullable<ReturnType<Session[Own]>["of"]>["Ok"]>}}} Calls
 * @typedef {Exclude<Extract<keyof Session, string>, "put" | "remove" | "text" | "free">} Call
 */
/** @typedef {{count: number, before: number | null, after: number}} Point expected error by count */
/** @typedef {Calls["calibrate"]["answer"] & {report: Pick<import("./calibration.js").Report, typeof import("./worker.js").SHOWN[number]>}} Calibrated */
/**
 * What each task finds.
 * @typedef {{calibrate: Calibrated, export: Calls["export"]["answer"], validate: Calls["validate" | "compare"]["answer"], plan: Calls["plan"]["answer"], curve: Point[], simulate: Calls["simulate"]["answer"]}} Found
 */
/** @template T @typedef {{Ok: T, Err?: undefined, milliseconds?: number} | {Ok?: undefined, Err: Fault, milliseconds?: number}} Answered */
/** @template {Task} Own @typedef {Answered<Found[Own]>} Answer */
/**
 * A file. `stamp`: another content has another one; `batch`: those that came together have the same; `kind` is "unread" until
 * the program said what it is, with `using` as the robot of its tables; `mine`: written on this page.
 * @typedef {{name: string, bytes: Uint8Array, stamp: number, batch: number, kind: string, what: string, fault: Fault | null, using: string, mine: boolean}} File
 */
/** @typedef {Record<string, any>} Request */
/** @template {Task} Own @typedef {{key: string, request: Request, answer: Answer<Own> | null}} Asked */
/** @typedef {Record<string, string | boolean>} Fields */
/** @typedef {{files: File[], fields: Partial<Record<Task, Fields>>, asked: {[Own in Task]?: Asked<Own>}, next: number}} State */
/** @typedef {{name: string, bytes: Uint8Array}} Given */

/** Kinds of files that a robot is read from, and those with measurements. */
const ROBOTS = ["robot", "printer"];
const TABLES = ["samples", "joints", "positions", "plan", "table"];

/** @type {State} */
export const EMPTY = { files: [], fields: {}, asked: {}, next: 1 };

/**
 * @param {State} state
 * @param {string} name
 */
export function find(state, name) {
  return state.files.find((own) => own.name === name);
}

/**
 * @param {State} state
 * @param {...string} kinds
 */
export function names(state, ...kinds) {
  return state.files.filter((own) => kinds.includes(own.kind)).map((own) => own.name);
}

/** @param {State} state */
export const robots = (state) => names(state, ...ROBOTS);

/** @param {State} state */
export const tables = (state) => names(state, ...TABLES);

/**
 * A name that no file has: of this one, or with a number.
 * @param {Iterable<string>} taken
 * @param {string} name
 */
export function free(taken, name) {
  const all = new Set(taken);
  const dot = name.lastIndexOf(".");
  const [stem, end] = dot > 0 ? [name.slice(0, dot), name.slice(dot)] : [name, ""];
  let own = name;
  for (let number = 2; all.has(own); number++) own = `${stem}-${number}${end}`;
  return own;
}

/**
 * With files that came together. One with the name of an earlier file replaces it; of two with one name in the same batch the
 * second gets a number.
 * @param {State} state
 * @param {Given[]} given
 * @param {{mine?: boolean}} [how]
 * @returns {State}
 */
export function withFiles(state, given, { mine = false } = {}) {
  const files = [...state.files];
  let { next } = state;
  const batch = next++;
  for (const { name, bytes } of given) {
    const before = files.findIndex((own) => own.name === name);
    const twice = before >= 0 && files[before]?.batch === batch;
    const own = twice ? free(files.map((file) => file.name), name) : name;
    /** @type {File} */
    const file = { name: own, bytes, stamp: next++, batch, kind: "unread", what: "", fault: null, using: "", mine };
    if (before >= 0 && !twice) files[before] = file;
    else files.push(file);
  }
  return settled({ ...state, files, next });
}

/**
 * @param {State} state
 * @param {string} name
 * @returns {State}
 */
export function without(state, name) {
  return settled({ ...state, files: state.files.filter((own) => own.name !== name) });
}

/**
 * With a file under another name.
 * @param {State} state
 * @param {string} name
 * @param {string} other
 * @returns {State}
 */
export function renamed(state, name, other) {
  if (find(state, other)) return state;
  let { next } = state;
  const files = state.files.map((own) => (own.name === name ? { ...own, name: other, kind: "unread", using: "", stamp: next++ } : own));
  return settled({ ...state, files, next });
}

/**
 * With what the program said of a file; void if that has changed since.
 * @param {State} state
 * @param {{name: string, stamp: number, using: string}} of
 * @param {{kind: string, what: string, fault: Fault | null}} found
 * @returns {State}
 */
export function recognised(state, of, found) {
  const files = state.files.map((own) => (own.name === of.name && own.stamp === of.stamp ? { ...own, ...found, using: of.using } : own));
  return settled({ ...state, files });
}

/**
 * With the fields of a form.
 * @param {State} state
 * @param {Task} task
 * @param {Fields} fields
 * @returns {State}
 */
export function withFields(state, task, fields) {
  return settled({ ...state, fields: { ...state.fields, [task]: { ...state.fields[task], ...fields } } });
}

/**
 * With a request that has begun: an earlier one of the same task, and its result, are void.
 * @param {State} state
 * @param {Task} task
 * @param {Request} request
 * @returns {State}
 */
export function begun(state, task, request) {
  return { ...state, asked: { ...state.asked, [task]: { key: keyOf(state, request), request, answer: null } } };
}

/**
 * With an answer, if its request is still the one.
 * @template {Task} Own
 * @param {State} state
 * @param {Own} task
 * @param {Request} request
 * @param {Answer<Own>} answer
 * @returns {State}
 */
export function ended(state, task, request, answer) {
  const own = state.asked[task];
  if (own?.request !== request) return state;
  return settled({ ...state, asked: { ...state.asked, [task]: { ...own, answer } } });
}

/** Fields of a request that name files. */
const NAMING = ["robot", "samples", "nominal", "positions", "bed"];

/**
 * A request with the content of what it names, as a text: equal keys have equal results.
 * @param {State} state
 * @param {Request} request
 * @returns {string}
 */
export function keyOf(state, request) {
  const named = NAMING.flatMap((field) => request[field] ?? []);
  const included = names(state, "included");
  const stamps = [...named, ...included].map((name) => find(state, name)?.stamp ?? (name === outputOf(state) ? state.asked.calibrate?.key : 0));
  return JSON.stringify([request, stamps]);
}

/**
 * The file that the calibration's robot is in: a name of no other file. `null` without a result.
 * @param {State} state
 * @returns {string | null}
 */
export function outputOf(state) {
  return state.asked.calibrate?.answer?.Ok ? free(state.files.map((own) => own.name), "calibrated.toml") : null;
}

/**
 * Without what its files or choices have changed of.
 * @param {State} state
 * @returns {State}
 */
function settled(state) {
  let own = state;
  const current = own.asked.calibrate;
  const calibration = calibrationOf(own);
  if (current && (!calibration || keyOf(own, calibration) !== current.key)) own = dropped(own, "calibrate");
  for (const task of /** @type {Task[]} */ (["export", "validate", "plan", "curve", "simulate"])) {
    const asked = own.asked[task];
    if (asked && keyOf(own, asked.request) !== asked.key) own = dropped(own, task);
  }
  return own;
}

/**
 * Without the request and the result of a task, whose form has changed.
 * @param {State} state
 * @param {Task} task
 * @returns {State}
 */
export function dropped(state, task) {
  const { [task]: _, ...asked } = state.asked;
  return { ...state, asked };
}

/**
 * The newest of these files, the first of its batch.
 * @param {File[]} files
 */
function newest(files) {
  const batch = Math.max(...files.map((own) => own.batch));
  return files.find((own) => own.batch === batch);
}

/**
 * The robot that is calibrated: the chosen one, or the newest that can be read; a console's log only where there is no
 * configuration that it may be the answer of.
 * @param {State} state
 * @returns {string}
 */
export function robotOf(state) {
  const all = state.files.filter((own) => ROBOTS.includes(own.kind));
  const chosen = all.find((own) => own.name === state.fields.calibrate?.robot);
  const readable = all.filter((own) => !own.fault);
  const own = newest(readable);
  const configured = own && isLog(own) && newest(readable.filter((file) => file.kind === "printer" && !isLog(file) && !isMeasured(file)));
  return (chosen ?? (configured || own) ?? newest(all))?.name ?? "";
}

/**
 * What tables are read with: a request, and its key.
 * @param {State} state
 * @returns {{request: Request, using: string}}
 */
export function reader(state) {
  const request = { robot: robotOf(state), firmware: state.fields.calibrate?.firmware || null };
  return { request, using: keyOf(state, request) };
}

/**
 * The next file of which the program has to say what it is.
 * @param {State} state
 * @returns {File | undefined}
 */
export function unread(state) {
  const { using } = reader(state);
  const first = state.files.find((own) => own.kind === "unread");
  return first ?? state.files.find((own) => isTable(own) && own.using !== using);
}

/** @param {File} file */
const isTable = (file) => TABLES.includes(file.kind);

/** Whether a printer's settings are in the log of its console, which may hold its answers too. @param {File} own */
const isLog = (own) => own.kind === "printer" && /\.(txt|log)$/i.test(own.name);

/**
 * What can be chosen as the measurements of a robot.
 * @param {State} state
 */
export const measurementsOf = (state) => state.files.filter((own) => isTable(own) || (isLog(own) && own.name !== robotOf(state)));

/**
 * Whether a configuration holds measurements.
 * @param {File | undefined} file
 */
export function isMeasured(file) {
  return file?.kind === "printer" && !/no measurements saved/.test(file.what);
}

/**
 * The measurements: those that are chosen; otherwise of a robot the first that were read, which stay when others come, and of a
 * printer the newest. A file that cannot be read is taken only where nothing else can be.
 * @param {State} state
 * @returns {string[]}
 */
export function samplesOf(state) {
  const robot = find(state, robotOf(state));
  const fields = state.fields.calibrate ?? {};
  const all = measurementsOf(state);
  const chosen = [fields.samples, fields.second].map((name) => all.find((own) => own.name === name)?.name);
  if (chosen[0] || fields.samples === "saved") return chosen.filter((own) => own !== undefined);
  const readable = all.filter((own) => own.kind === "samples" && !own.fault);
  const [joints, positions] = [names(state, "joints", "plan")[0], names(state, "positions")[0]];
  let own;
  if (robot?.kind === "printer") own = newest(readable) ?? (isMeasured(robot) ? undefined : newest(all.filter(isLog)));
  else own = readable.find((file) => file.batch === robot?.batch) ?? readable[0];
  if (own) return [own.name, chosen[1]].filter((name) => name !== undefined);
  if (joints && positions) return [joints, positions];
  return isMeasured(robot) || all.length === 0 ? [] : [/** @type {File} */ (newest(all)).name];
}

/** What of the form is not of a robot or of a printer. */
const OF_PRINTER = ["rods", "radius", "printed", "shrinkage"];

/**
 * What is to be calibrated, of the files that are read; `null` as long as something is missing.
 * @param {State} state
 * @returns {Calls["calibrate"]["request"] | null}
 */
export function calibrationOf(state) {
  const robot = find(state, robotOf(state));
  if (!robot) return null;
  const samples = samplesOf(state);
  if (robot.kind === "robot" && samples.length === 0) return null;
  const fields = /** @type {Record<string, any>} */ (state.fields.calibrate ?? {});
  const printed = robot.kind === "printer";
  return {
    robot: robot.name,
    samples,
    method: fields.method || null,
    robust: fields.robust ?? false,
    sensor: fields.frame === "sensor",
    limit: fields.limit ?? null,
    ...Object.fromEntries(OF_PRINTER.map((id) => [id, printed ? (fields[id] ?? []) : []])),
    columns: fields.columns || null,
    firmware: printed ? fields.firmware || null : null,
  };
}

/**
 * The calibration that is to be asked for now.
 * @param {State} state
 * @returns {Calls["calibrate"]["request"] | null}
 */
export function due(state) {
  const request = unread(state) ? null : calibrationOf(state);
  return request && state.asked.calibrate?.key !== keyOf(state, request) ? request : null;
}
