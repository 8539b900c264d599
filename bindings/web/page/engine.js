// The computation, in a worker: the page stays free, and what takes too long can be stopped.

import { kept } from "./dom.js";

/** Thrown by a question that was stopped. */
export class Stopped extends Error {}

/** In a page in one file the worker and its program stand inside it. */
function worker() {
  const text = kept("worker");
  if (!text) return new Worker("worker.js", { type: "module" });
  const address = URL.createObjectURL(new Blob([`globalThis.program="${kept("program")}";`, text], { type: "text/javascript" }));
  const own = new Worker(address);
  URL.revokeObjectURL(address);
  return own;
}

/** Asks the worker, and tells a new one the files again after the old one was stopped. */
export class Engine {
  /** The files: name to bytes. */
  files = new Map();
  #worker;
  #open = new Map();
  #next = 0;

  constructor() {
    this.#start();
  }

  #start() {
    this.#worker = worker();
    this.#worker.addEventListener("message", ({ data }) => {
      const question = this.#open.get(data.id);
      this.#open.delete(data.id);
      if (data.crash === undefined) {
        question?.resolve(data.answer);
      } else {
        this.#restart(new Error(data.crash));
        question?.reject(new Error(data.crash));
      }
    });
    this.#worker.addEventListener("error", (event) => {
      this.#restart(new Error(event.message || "the program could not be loaded"));
    });
    for (const [name, bytes] of this.files) this.#send("put", [name, bytes]);
  }

  #send(call, values) {
    const id = this.#next++;
    this.#worker.postMessage({ id, call, values });
    return id;
  }

  #restart(reason) {
    this.#worker.terminate();
    const open = [...this.#open.values()];
    this.#open.clear();
    this.#start();
    for (const question of open) question.reject(reason);
  }

  /** An answer of `Session` in `src/lib.rs`: `{Ok}` or `{Err}`. */
  ask(call, ...values) {
    const id = this.#send(call, values);
    return new Promise((resolve, reject) => this.#open.set(id, { resolve, reject }));
  }

  put(name, bytes) {
    this.files.set(name, bytes);
    this.#send("put", [name, bytes]);
  }

  remove(name) {
    this.files.delete(name);
    this.#send("remove", [name]);
  }

  /** Ends what is being computed. */
  stop() {
    this.#restart(new Stopped("stopped"));
  }
}
