// The form of the machine: presets, its fields with their errors, and its natural frequencies while one types.
import { byId, element, notNumber } from "./dom.js";
import { EXAMPLE, complete } from "./parameters.js";
import { PRESETS, likeOf, presetOf } from "./presets.js";
import { sketch } from "./sketch.js";
import { structureOf } from "./structures.js";
import { toRead } from "./ticks.js";
import { entry, inSI, unitOf, withUnit } from "./units.js";

const FIELDS = ["masses", "stiffnesses", "damping", "forcing", "restitution"];
const LISTS = ["masses", "stiffnesses", "forcing"];
const OF_CHAIN = ["masses", "stiffnesses", "damping"]; // what matrices stand in place of
const TYPING_PAUSE = 300;

const textOf = (name, value) => {
  if (value === undefined) return "";
  // elsewhere a list of one number keeps its brackets: a damping that is a number is not a list of dampings
  const isPlain = Array.isArray(value) && value.every(Number.isFinite) && (value.length > 1 || LISTS.includes(name));
  return isPlain ? value.join(", ") : JSON.stringify(value);
};

const NUMBERS = "a number as 2.5, or several with commas between them";
const ALLOWED = { restitution: "a number from 0 to 1" };
const DECIMAL_COMMA = { forcing: /^[+-]?\d+,0\d+$/ }; // 0 and 1 may be two forces, but hardly two of anything else
const ANY_DECIMAL_COMMA = /^[+-]?(0,\d+|\d+,0\d+)$/;

// What JSON says of a field or of several. Throws an Error with what is wrong.
function parsed(text) {
  try {
    const value = JSON.parse(text);
    if (value && typeof value === "object") return value;
  } catch {
    // said below
  }
  throw new Error('This is not JSON; an example: {"contact": [1, 2]}.');
}

// What a field says: a number, numbers with commas, or JSON. Throws an Error with what is wrong.
function valueOf(name, text) {
  if (name === "further" || /^[[{]/.test(text)) return parsed(text);
  if ((DECIMAL_COMMA[name] ?? ANY_DECIMAL_COMMA).test(text))
    throw new Error(`${notNumber(text)}${name in ALLOWED ? "" : ", or a space after the comma of a list"}.`);
  const parts = text.split(",").map((part) => part.trim());
  const numbers = parts.map(Number);
  const wrong = parts.find((part, k) => part === "" || !Number.isFinite(numbers[k]));
  if (wrong !== undefined) throw new Error(`${notNumber(wrong)}; allowed: ${ALLOWED[name] ?? NUMBERS}.`);
  return parts.length > 1 ? numbers : numbers[0];
}

export class MachineForm {
  #abort = new AbortController();
  #typing = null;
  #touched = new Set(); // the fields of which it is said that they are empty

  // `chosen(machine, window)` is called with a machine, and with a window if a preset has one.
  constructor({ chosen }) {
    this.chosen = chosen;
    this.form = byId("machine");
    const presets = Object.entries(PRESETS).map(([value, { text }]) => element("option", { value, textContent: text }));
    byId("preset").append(element("option", { value: "" }), ...presets);
    byId("preset").addEventListener("change", ({ target }) => this.#preset(PRESETS[target.value]));
    this.form.addEventListener("input", ({ target }) => {
      if (!target.name) return; // units to read in are of the view
      this.#touched.add(target.name);
      // numbers of a machine in SI are not those of the paper
      if (target.name === "units" && this.#isExample()) for (const name of FIELDS) this.form.elements[name].value = "";
      byId("other-clearance").hidden = this.form.stops.value !== "unequal";
      this.#mark(true);
      clearTimeout(this.#typing);
      this.#typing = setTimeout(() => this.#check(), TYPING_PAUSE);
    });
    this.form.addEventListener("submit", async (event) => {
      event.preventDefault();
      clearTimeout(this.#typing);
      for (const name of [...FIELDS, "left"]) this.#touched.add(name);
      const machine = await this.#check();
      const wrong = [...this.form.elements].find((field) => field.getAttribute("aria-invalid") === "true");
      wrong?.focus();
      if (wrong) byId("error-machine").textContent = `Correct the field “${wrong.name}” first.`;
      if (!machine) return;
      this.#mark(false);
      this.chosen(machine, null);
    });
  }

  // Says whether the form has another machine than the plane.
  #mark(changed) {
    byId("overview-chart").classList.toggle("of-another", changed);
    byId("show-machine").textContent = changed ? "Show this machine (changed)" : "Show this machine";
  }

  #preset(preset) {
    if (!preset) return;
    this.show(preset.machine);
    this.chosen(preset.machine, preset);
  }

  #isExample() {
    const fields = this.form.elements;
    return FIELDS.every((name) => fields[name].value === textOf(name, EXAMPLE[name])) && !fields.further.value;
  }

  show(machine) {
    const { oscillator, stops, left, periods } = machine;
    const [own] = byId("preset").options;
    const like = PRESETS[likeOf(machine)];
    own.textContent = like ? `Changed: ${like.text}` : "Your own";
    own.hidden = Boolean(presetOf(machine));
    byId("preset").value = presetOf(machine) ?? "";
    const { units = "nondimensional", ...others } = complete(oscillator);
    const fields = this.form.elements;
    fields.units.value = units;
    fields.stops.value = stops;
    fields.left.value = entry(machine, "length", left);
    byId("left-unit").textContent = unitOf(machine, "length");
    fields.periods.value = periods;
    if (!fields.periods.value) fields.periods.add(new Option(periods, periods, false, true)); // as links have it
    for (const name of FIELDS) fields[name].value = textOf(name, others[name]);
    const further = Object.fromEntries(Object.entries(others).filter(([name]) => !FIELDS.includes(name)));
    fields.further.value = Object.keys(further).length ? JSON.stringify(further) : "";
    byId("other-clearance").hidden = stops !== "unequal";
    this.#touched.clear();
    this.#mark(false);
    this.#check();
  }

  // The machine that the form says. Errors of single fields are shown there; null if there are some.
  #machine() {
    const fields = this.form.elements;
    const oscillator = {};
    const errors = {};
    if (fields.units.value !== "nondimensional") oscillator.units = fields.units.value;
    for (const name of [...FIELDS, "further"]) {
      const text = fields[name].value.trim();
      if (!text) continue;
      try {
        const value = valueOf(name, text);
        if (name === "further") Object.assign(oscillator, value);
        else oscillator[name] = value;
      } catch (error) {
        errors[name] = error.message;
      }
    }
    const needless = [...(oscillator.matrices ? OF_CHAIN : []), ...(oscillator.base ? ["forcing"] : [])];
    const missing = {};
    for (const name of FIELDS)
      if (!(name in oscillator) && !needless.includes(name)) missing[name] = `Enter ${ALLOWED[name] ?? NUMBERS}.`;
    for (const name of LISTS) if (typeof oscillator[name] === "number") oscillator[name] = [oscillator[name]];
    if (Array.isArray(oscillator.restitution)) errors.restitution = `${notNumber(fields.restitution.value)}.`;
    const stops = fields.stops.value;
    const entered = stops === "unequal" ? Number(fields.left.value || NaN) : null;
    const left = inSI({ oscillator }, "length", entered);
    if (Number.isNaN(left) && fields.left.value) errors.left = `${notNumber(fields.left.value)}.`;
    else if (left !== null && left <= 0) errors.left = "The distance must be above 0.";
    else if (Number.isNaN(left)) missing.left = "Enter the distance of the left stop.";
    const reminders = Object.entries(missing).filter(([name]) => this.#touched.has(name));
    this.#say({ ...Object.fromEntries(reminders), ...errors });
    if (Object.keys(missing).length || Object.keys(errors).length) return null;
    return {
      oscillator: fields.units.value === "nondimensional" && this.#isExample() ? null : oscillator,
      stops,
      left,
      periods: Number(fields.periods.value),
    };
  }

  #say(errors) {
    for (const name of [...FIELDS, "left", "further"]) {
      const field = this.form.elements[name];
      const says = byId(`error-${name}`);
      says.textContent = errors[name] ?? "";
      field.setAttribute("aria-invalid", name in errors);
    }
    byId("error-machine").textContent = errors.machine ?? "";
  }

  // Asks the service for the linear properties; the machine if there are some.
  async #check() {
    this.#abort.abort();
    this.#abort = new AbortController();
    const { signal } = this.#abort;
    const machine = this.#machine();
    if (!machine) return null;
    try {
      const data = await structureOf(machine);
      if (signal.aborted) return null;
      byId("machine-notes").replaceChildren(
        ...(data.meta?.notes ?? []).map(({ detail }) => element("li", { textContent: detail })),
      );
      byId("sketch").replaceChildren(...sketch(machine));
      const ratios = data.damping_ratios;
      const frequency = (value) => (value === null ? "no frequency" : withUnit(machine, "frequency", value));
      byId("modes").replaceChildren(
        ...data.natural_frequencies.map((omega, k) =>
          element("li", { textContent: `${frequency(omega)}, damping ratio ${toRead(ratios[k])}` }),
        ),
      );
      return machine;
    } catch (error) {
      if (signal.aborted) return null;
      const errors = {};
      for (const { pointer, detail, allowed } of error.errors ?? []) {
        const [, , name, ...rest] = pointer.split("/");
        // the service does not repeat unknown fields
        const isFurther = !FIELDS.includes(name) && (name || this.form.elements.further.value);
        const where = isFurther && name ? `${[name, ...rest].join("/")}: ` : "";
        const field = isFurther ? "further" : (name ?? "machine");
        errors[field] ??= `${where}${detail}${allowed ? `; allowed: ${allowed}` : ""}`;
      }
      const [masses, ...others] = LISTS.map((name) => machine.oscillator?.[name]?.length);
      others.forEach((count, k) => {
        const name = LISTS[k + 1];
        if (errors[name] && count && count !== masses) errors.masses ??= `${masses} masses, but ${count} ${name}.`;
      });
      if (!Object.keys(errors).length) errors.machine = error.message;
      this.#say(errors);
      byId("modes").replaceChildren();
      return null;
    }
  }
}
