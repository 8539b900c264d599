// The computation, in a worker: the page stays free, what takes too long can be stopped, and what fails is named.

/** @typedef {import("./state.js").Answered<any>} Answer */
/** @typedef {{name: string, bytes: Uint8Array, stamp: number | string}} Held */
/**
 * A question: `task` is what it belongs to, and a later one of the same task supersedes it.
 * @typedef {{id: number, call: string, values: unknown[], task: string, begun: number, resolve: (answer: Answer) => void, reject: (reason: Error) => void}} Question
 */
/**
 * What a worker is to the engine.
 * @typedef {{postMessage(message: unknown): void, terminate(): void, onmessage: ((event: {data: any}) => void) | null, onerror: ((event: any) => void) | null}} Worker
 */

/** Why there is no answer. */
export class Stopped extends Error {}
/** A later question of the same task came. */
export class Superseded extends Error {}
/** The program failed; `file` is the one that it was given last, if that is why. */
export class Crashed extends Error {
  /** @type {string | null} */
  file = null;
}
/** The program cannot be loaded. */
export class Unloadable extends Error {}

/** Starts that fail in a row before the page gives up. */
export const TRIES = 3;
/** A superseded question that has been computed for longer is stopped, ms; until then it ends sooner than a new worker starts. */
const PATIENCE = 300;

/** Asks one question after the other. */
export class Engine {
  #start;
  #files;
  #shown;
  /** @type {Worker | null} */
  #worker = null;
  /** What the worker has: name to stamp. */
  #has = new Map();
  /** @type {Question[]} */
  #queue = [];
  /** @type {Question | null} */
  #running = null;
  /** The compiled program, for the next worker. */
  #program = null;
  #failed = 0;
  #next = 0;

  /**
   * `start` makes a worker, `files` says what it must have, `shown` is told what is being computed, or `null`.
   * @param {() => Worker} start
   * @param {() => Held[]} files
   * @param {(task: string | null) => void} [shown]
   */
  constructor(start, files, shown = () => {}) {
    this.#start = start;
    this.#files = files;
    this.#shown = shown;
    this.#open();
  }

  /** Whether the program could not be loaded. */
  get dead() {
    return this.#failed >= TRIES;
  }

  /** @returns {void} */
  #open() {
    this.#has.clear();
    this.#worker = null;
    if (this.dead) {
      for (const own of this.#queue.splice(0)) own.reject(new Unloadable());
      return;
    }
    let worker;
    try {
      worker = this.#start();
    } catch {
      this.#failed++;
      return this.#open();
    }
    worker.onmessage = ({ data }) => this.#told(data);
    worker.onerror = () => this.#told({ unloadable: true });
    worker.postMessage({ program: this.#program });
    this.#worker = worker;
  }

  /** @param {any} data */
  #told(data) {
    if (data.unloadable) {
      this.#failed++;
      this.#restart(null);
    } else if (data.program !== undefined) {
      this.#failed = 0;
      this.#program = data.program;
    } else if (this.#running?.id === data.id) {
      const own = this.#running;
      if (own === null) return;
      if (data.crash !== undefined) {
        const crash = new Crashed(data.crash);
        crash.file = data.file ?? null;
        this.#restart(crash);
        return;
      }
      this.#running = null;
      own.resolve(data.answer);
      this.#ask();
    }
  }

  /**
   * Another worker in place of this one; with a reason the running question is rejected, without one it is asked again.
   * @param {Error | null} reason
   */
  #restart(reason) {
    this.#worker?.terminate();
    const own = this.#running;
    this.#running = null;
    if (own && reason) own.reject(reason);
    else if (own) this.#queue.unshift(own);
    this.#open();
    this.#ask();
  }

  #ask() {
    if (this.#running || !this.#worker) return;
    const own = this.#queue.shift();
    this.#shown(own?.task ?? null);
    if (!own) return;
    this.#running = own;
    own.begun = performance.now();
    const files = this.#files();
    const wanted = new Set(files.map(({ name }) => name));
    const removed = [...this.#has.keys()].filter((name) => !wanted.has(name));
    const put = files.filter(({ name, stamp }) => this.#has.get(name) !== stamp);
    for (const name of removed) this.#has.delete(name);
    for (const { name, stamp } of put) this.#has.set(name, stamp);
    this.#worker.postMessage({ id: own.id, removed, put: put.map(({ name, bytes }) => [name, bytes]), call: own.call, values: own.values });
  }

  /**
   * An answer of `Session` in `src/lib.rs`: `{Ok}` or `{Err}`.
   * @param {string} task
   * @param {string} call
   * @param {...unknown} values
   * @returns {Promise<Answer>}
   */
  ask(task, call, ...values) {
    if (this.dead) return Promise.reject(new Unloadable());
    this.supersede(task);
    return new Promise((resolve, reject) => {
      this.#queue.push({ id: this.#next++, call, values, task, begun: 0, resolve, reject });
      this.#ask();
    });
  }

  /**
   * Ends the questions of a task.
   * @param {string} task
   */
  supersede(task) {
    const waiting = this.#queue.filter((own) => own.task === task);
    this.#queue = this.#queue.filter((own) => own.task !== task);
    for (const own of waiting) own.reject(new Superseded());
    const running = this.#running;
    if (running?.task !== task) return;
    if (performance.now() - running.begun > PATIENCE) this.#restart(new Superseded());
    else running.reject(new Superseded());
  }

  /** Ends what is being computed and what waits. */
  stop() {
    for (const own of this.#queue.splice(0)) own.reject(new Stopped());
    this.#restart(new Stopped());
  }
}
