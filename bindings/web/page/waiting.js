// What is being computed and for how long, with a button that stops it.

import { byId } from "./dom.js";

/** Of a task of less, nothing is shown, ms. */
const SHORT = 200;

/** @type {Record<string, string>} */
const WORDS = {
  recognise: "Reading files",
  calibrate: "Calibrating",
  export: "Exporting",
  validate: "Validating",
  plan: "Planning",
  curve: "Planning",
  simulate: "Simulating",
};

export class Waiting {
  #task = "";
  #begin = 0;
  #what = "";
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later;
  /** @type {ReturnType<typeof setInterval> | undefined} */
  #timer;

  /** @param {string | null} task what is computed now */
  show(task) {
    const name = task && WORDS[task];
    if (!name) return this.#hide();
    clearTimeout(this.#end);
    if (task === this.#task) return;
    this.#stop();
    this.#task = task;
    this.#what = name;
    this.#begin = performance.now();
    byId("waiting").querySelector("progress")?.removeAttribute("value");
    this.#later = setTimeout(() => {
      this.#write();
      byId("waiting").hidden = false;
    }, SHORT);
    this.#timer = setInterval(() => this.#write(), 500);
  }

  /** Another text for the task, and which part is done. @param {string} text @param {number} [part] */
  progress(text, part) {
    this.#what = text;
    const drawn = byId("waiting").querySelector("progress");
    if (drawn && part !== undefined) drawn.value = part;
    this.#write();
  }

  #write() {
    const seconds = Math.round((performance.now() - this.#begin) / 1000);
    byId("waiting-text").textContent = seconds ? `${this.#what} … ${seconds} s` : `${this.#what} …`;
  }

  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #end;

  /** One question of a task may follow another at once. */
  #hide() {
    clearTimeout(this.#end);
    this.#end = setTimeout(() => {
      this.#stop();
      byId("waiting").hidden = true;
    }, 20);
  }

  #stop() {
    this.#task = "";
    clearTimeout(this.#later);
    clearInterval(this.#timer);
  }
}
