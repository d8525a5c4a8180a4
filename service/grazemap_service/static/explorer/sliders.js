// Sliders for what a machine has beside the axes of the plane.
import { byId, element } from "./dom.js";
import { FIXED, complete, namesOf, parameter, valueOf, withParameter } from "./parameters.js";
import { unitOf, withUnit } from "./units.js";

export const SLIDERS = ["restitution", "damping", "forcing", "omega", "clearance", "clearance_left"];
const STEPS = 200;
const DOUBLINGS = 2; // of a positive value, to either side

export class Sliders {
  #of = null; // the machine to which factors refer
  #values = {}; // what sliders have made
  #fixed = {}; // frequency and clearance where their sliders began
  isMoving = false;

  // `changed({ machine, plane })` is called while a slider moves, and `settled()` after it.
  constructor({ changed, settled }) {
    this.changed = changed;
    this.form = byId("sliders");
    this.form.addEventListener("input", ({ target }) => {
      this.isMoving = true;
      this.#move(target);
    });
    const end = () => {
      if (!this.isMoving) return;
      this.isMoving = false;
      settled();
    };
    // a swipe that begins on a slider scrolls, and leaves its value
    let before = null;
    this.form.addEventListener("pointerdown", ({ target }) => {
      before = target instanceof HTMLInputElement ? { target, place: target.value, values: { ...this.#values } } : null;
    });
    this.form.addEventListener("pointercancel", () => {
      if (!before || !this.isMoving) return;
      before.target.value = before.place;
      this.#values = before.values;
      this.#apply(before.target);
    });
    // a key that is held changes the value again and again
    let isHeld = false;
    this.form.addEventListener("keydown", () => {
      isHeld = true;
    });
    this.form.addEventListener("keyup", () => {
      isHeld = false;
      end();
    });
    this.form.addEventListener("change", () => !isHeld && end());
    // no change follows where a drag ends at the value with which it began, or is broken off
    for (const name of ["pointerup", "pointercancel", "focusout"])
      this.form.addEventListener(name, () => {
        isHeld = false;
        setTimeout(end);
      });
  }

  // Shows the values of a state of the page, of those sliders that are `allowed`; its machine is the one to which factors refer unless a slider made it.
  show({ machine, plane }, allowed = SLIDERS) {
    this.allowed = allowed;
    if (machine !== this.made) this.#begin(machine);
    this.plane = plane;
    for (const name of FIXED) {
      if (plane[name] === this.#value(name)) continue;
      this.#fixed[name] = plane[name];
      delete this.#values[name];
    }
    const axes = [plane.horizontal, plane.vertical];
    const shown = JSON.stringify([
      this.#of,
      axes,
      this.#fixed,
      allowed,
      ...FIXED.map((name) => unitOf(machine, parameter(name).quantity)),
    ]);
    if (this.isMoving || shown === this.shown) return; // so that a slider keeps the focus
    this.shown = shown;
    const names = namesOf(machine);
    const sliders = this.allowed
      .filter((name) => names.includes(name) && !axes.includes(name))
      .filter((name) => !FIXED.includes(name) || plane[name] !== null);
    this.form.replaceChildren(...sliders.map((name) => this.#slider(name)));
  }

  #begin(machine) {
    this.#of = machine;
    this.made = machine;
    this.#values = {};
    this.shown = null; // what a slider has moved is not that machine's
  }

  #value(name) {
    return this.#values[name] ?? this.#first(name);
  }

  // The value of a position from 0 to 1: over the domain of a share, else in doublings about the value at first.
  #at(name, position) {
    const [low, high] = parameter(name).domain;
    if (high === 1) return low + position * (high - low);
    return this.#first(name) * 2 ** (DOUBLINGS * (2 * position - 1));
  }
  #position(name, value) {
    if (parameter(name).domain[1] === 1) return value;
    return 0.5 + Math.log2(value / this.#first(name)) / (2 * DOUBLINGS);
  }
  #first(name) {
    return FIXED.includes(name) ? this.#fixed[name] : valueOf(this.#of, name, []);
  }

  #slider(name) {
    const { text, short = text, hint = "" } = parameter(name, this.#of);
    const position = Math.round(STEPS * this.#position(name, this.#value(name)));
    const input = element("input", { type: "range", name, min: 0, max: STEPS, value: position });
    const output = element("output", { textContent: this.#text(name) });
    input.setAttribute("aria-valuetext", this.#text(name));
    return element("label", { title: hint }, short, output, input);
  }

  #text(name) {
    const { quantity, factor } = parameter(name, this.#of);
    return `${factor ? "× " : ""}${withUnit(this.#of, quantity, this.#value(name))}`;
  }

  #move(input) {
    this.#values[input.name] = Number(this.#at(input.name, input.value / STEPS).toPrecision(3));
    this.#apply(input);
  }

  // Says the value of a slider, and what it changes.
  #apply(input) {
    const { name } = input;
    input.setAttribute("aria-valuetext", this.#text(name));
    input.parentElement.querySelector("output").textContent = this.#text(name);
    if (FIXED.includes(name)) return this.changed({ plane: { ...this.plane, [name]: this.#value(name) } });
    const made = Object.entries(this.#values).filter(([other]) => !FIXED.includes(other));
    const left = this.#values.clearance_left ?? this.#of.left;
    const oscillator = made
      .filter(([other]) => other !== "clearance_left")
      .reduce((changing, [other, number]) => withParameter(changing, other, number), complete(this.#of.oscillator));
    this.made = made.length ? { ...this.#of, oscillator, left } : this.#of;
    return this.changed({ machine: this.made });
  }
}
