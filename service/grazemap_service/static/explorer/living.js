// The machine beside the pointer, in the motion of the point under it.
import { compute, isAborted } from "./api.js";
import { Animation } from "./animation.js";
import { element } from "./dom.js";
import { isStill, moving } from "./moving.js";
import * as requests from "./requests.js";

const APART = 60; // milliseconds between two questions
const KEPT = 60; // answers
const GAP = 18; // pixels from the pointer
const EDGE = 4; // pixels from the edges of the plane
const OVER_PLANE = "header, aside > .card, footer, #tools, #story, #place, #story-tag"; // what floats over the figure
const SHOWN = { periods: 8, samples: 32 };

export class Living {
  #kept = new Map(); // request -> trajectory
  #asking = null;
  #next = null;
  #last = 0;
  #played = ""; // the request whose motion is played

  // `figure` has a canvas and a caption.
  constructor(figure) {
    this.figure = figure;
    this.animation = new Animation(figure.querySelector("canvas"));
  }

  hide() {
    this.#next = null;
    this.#asking?.abort();
    this.figure.hidden = true;
    this.animation.stop();
  }

  // Shows a machine at [omega, clearance] beside a place on the canvas, in the colour of its motion, with its name and
  // `words` for it; it repeats after so many forcing periods where `period` is not null.
  show({ machine, at, colour, text, words, period, place, size }) {
    this.figure.querySelector("figcaption").replaceChildren(text, element("small", { textContent: words }));
    this.#put(place, size);
    this.#next = { machine, at, colour, periods: Math.max(SHOWN.periods, period ?? 0) };
    this.#ask();
  }

  #put({ px, py }, { width, height }) {
    const { style } = this.figure;
    this.figure.hidden = this.figure.hidden && !this.animation.time;
    const { offsetWidth, offsetHeight } = this.figure;
    const covers = [
      { left: px, right: px + 1, top: py, bottom: py + 1 },
      ...[...document.querySelectorAll(OVER_PLANE)].map((card) => card.getBoundingClientRect()),
    ];
    const common = (low, size, least, most) => Math.max(0, Math.min(low + size, most) - Math.max(low, least));
    const hidden = (/** @type {number[]} */ [left, top]) =>
      covers.reduce(
        (sum, box) =>
          sum + common(left, offsetWidth, box.left, box.right) * common(top, offsetHeight, box.top, box.bottom),
        0,
      );
    const beside = (at, size, whole) =>
      [at + GAP, at - GAP - size].map((start) => Math.max(EDGE, Math.min(start, whole - size - EDGE)));
    const corners = beside(px, offsetWidth, width).flatMap((left) =>
      beside(py, offsetHeight, height).map((top) => [left, top]),
    );
    const [left, top] = corners.reduce((best, corner) => (hidden(corner) < hidden(best) ? corner : best));
    style.left = `${left}px`;
    style.top = `${top}px`;
  }

  async #ask() {
    if (this.#asking || !this.#next) return;
    const { machine, at, colour, periods } = this.#next;
    const request = requests.trajectory(machine, at, { transient: machine.periods, ...SHOWN, periods });
    const name = JSON.stringify(request);
    this.#next = null;
    const kept = this.#kept.get(name);
    if (kept) this.#play(name, { machine, at, path: kept, colour });
    else {
      this.#asking = new AbortController();
      const wait = this.#last + APART - performance.now();
      if (wait > 0) await new Promise((resolve) => setTimeout(resolve, wait));
      this.#last = performance.now();
      try {
        if (!this.#next) {
          const { data } = await compute("trajectories", request, { priority: 8, signal: this.#asking.signal });
          this.#kept.set(name, data);
          if (this.#kept.size > KEPT) this.#kept.delete(this.#kept.keys().next().value);
          if (!this.#next && !this.#asking.signal.aborted) this.#play(name, { machine, at, path: data, colour });
        }
      } catch (error) {
        if (!isAborted(error)) this.hide(); // what is wrong is said where the plane's own questions fail
      }
      this.#asking = null;
    }
    this.#ask();
  }

  #play(name, { machine, at, path, colour }) {
    this.figure.hidden = false;
    if (name === this.#played && this.animation.playing) {
      this.animation.colour = colour; // the motion goes on
      return;
    }
    this.#played = name;
    this.animation.show(moving(machine, at, path, colour));
    if (!isStill() && !this.animation.playing) this.animation.play();
  }
}
