// The page's state, and all that asks the program: nothing else holds files, choices or results.

import { kept } from "./dom.js";
import { Crashed, Engine, Stopped, Superseded, TRIES, Unloadable } from "./engine.js";
import * as states from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Task} Task */
/** @typedef {import("./state.js").Request} Request */
/** @typedef {import("./state.js").Fault} Fault */
/** @template T @typedef {import("./state.js").Answered<T>} Answered */
/** @typedef {import("./state.js").Calls} Calls */

/** In a page in one file the worker and its program stand inside it. */
function worker() {
  const text = kept("worker");
  if (!text) return new Worker("worker.js", { type: "module" });
  const address = URL.createObjectURL(new Blob([`globalThis.program="${kept("program")}";`, text], { type: "text/javascript" }));
  const own = new Worker(address);
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
  return own;
}

export class Store {
  /** @type {State} */
  state = states.EMPTY;
  /** @type {((state: State) => void)[]} */
  #listeners = [];
  #planned = false;
  #reading = false;
  #engine;

  /** `busy` is told what is being computed, or `null`. @param {(task: string | null) => void} busy */
  constructor(busy) {
    const files = () => {
      const { state } = this;
      const output = states.outputOf(state);
      const own = state.files.filter(({ kind }) => kind !== "unusable").map(({ name, bytes, stamp }) => ({ name, bytes, stamp }));
      if (!output || !state.asked.calibrate) return own;
      const { answer, key } = state.asked.calibrate;
      return [...own, { name: output, bytes: new TextEncoder().encode(answer?.Ok?.toml), stamp: key }];
    };
    this.#engine = new Engine(/** @type {() => any} */ (worker), files, busy);
  }

  /** Told of every state. @param {(state: State) => void} listener */
  listen(listener) {
    this.#listeners.push(listener);
  }

  /** @param {(state: State) => State} change */
  update(change) {
    this.state = change(this.state);
    if (this.#planned) return;
    this.#planned = true;
    queueMicrotask(() => {
      this.#planned = false;
      for (const listener of this.#listeners) listener(this.state);
      this.#go();
    });
  }

  /** @param {import("./state.js").Given[]} given @param {{mine?: boolean}} [how] */
  add(given, how) {
    this.update((state) => states.withFiles(state, given, how));
  }

  /** @param {string} name @param {string} text @param {{mine?: boolean}} [how] */
  write(name, text, how) {
    this.add([{ name, bytes: new TextEncoder().encode(text) }], how);
  }

  stop() {
    this.#engine.stop();
  }

  /** Reads what is unread, then calibrates what is due. */
  async #go() {
    if (this.#reading) return;
    this.#reading = true;
    for (let file = states.unread(this.state); file; file = states.unread(this.state)) {
      const { request, using } = file.kind === "unread" ? { request: { robot: "" }, using: "" } : states.reader(this.state);
      const found = await this.#recognised(file.name, request);
      const { name, stamp } = file;
      this.update((state) => states.recognised(state, { name, stamp, using }, found));
    }
    this.#reading = false;
    const due = states.due(this.state);
    if (due) this.run("calibrate", "calibrate", due);
  }

  /**
   * What a file is. One on which the program fails is not given to it again.
   * @param {string} name
   * @param {Request} request
   * @returns {Promise<{kind: string, what: string, fault: Fault | null}>}
   */
  async #recognised(name, request) {
    try {
      const { Ok, Err } = await this.#engine.ask("recognise", "recognise", JSON.stringify({ ...request, name }));
      return Ok ?? { kind: "unusable", what: "Not readable", fault: Err ?? null };
    } catch (error) {
      return { kind: "unusable", what: "Not readable", fault: faultOf(error, [name]) };
    }
  }

  /**
   * An answer about the state of now; an error is a fault. `null` if a later question of the task came.
   * @template {keyof Calls} Call
   * @param {string} task
   * @param {Call} call
   * @param {Calls[Call]["request"]} request
   * @returns {Promise<Answered<Calls[Call]["answer"]> | null>}
   */
  async ask(task, call, request) {
    try {
      const now = Math.floor(Date.now() / 1000);
      return await this.#engine.ask(task, call, JSON.stringify({ ...request, now }));
    } catch (error) {
      if (error instanceof Superseded) return null;
      const crashed = error instanceof Crashed ? error.file : null;
      const { robot = "", samples = [] } = /** @type {Request} */ (request);
      const fault = faultOf(error, crashed ? [crashed] : [robot, ...samples].filter(Boolean));
      if (crashed) this.update((state) => ({ ...state, files: state.files.map((own) => (own.name === crashed ? { ...own, kind: "unusable", what: "Not readable", fault } : own)) }));
      return { Err: fault };
    }
  }

  /**
   * Computes a task's result into the state.
   * @template {keyof Calls} Call
   * @param {Exclude<Task, "curve">} task
   * @param {Call} call
   * @param {Calls[Call]["request"]} request
   */
  async run(task, call, request) {
    this.update((state) => states.begun(state, task, request));
    const answer = await this.ask(task, call, request);
    if (answer) this.update((state) => states.ended(state, task, request, /** @type {any} */ (answer)));
  }

  /** A file as text, if it is text. @param {string} name @returns {Promise<string | undefined>} */
  async text(name) {
    const answer = await this.#engine.ask("text", "text", name).catch(() => null);
    return answer?.Ok;
  }
}

/** Files that are larger in all may be too many for the memory of a browser, bytes. */
const LARGE = 30_000_000;

/**
 * @param {unknown} error
 * @param {string[]} files
 * @returns {Fault}
 */
function faultOf(error, files) {
  if (error instanceof Stopped) return { message: "stopped" };
  if (error instanceof Unloadable) {
    return { message: `the program could not be loaded in ${TRIES} tries`, remedy: "reload the page; if that does not help, use the page in one file, or another browser" };
  }
  const message = `the program failed on ${files.join(" and ") || "this"}`;
  return { message, remedy: `the page goes on without it. If the file has more than ${LARGE / 1e6} MB, it has too many rows for a browser: use the command delta-cal. Otherwise report it with the file` };
}
