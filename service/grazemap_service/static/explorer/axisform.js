// Forms of numbers of the two axes: of the open point, and of the window.
import { byId, numberOf } from "./dom.js";
import { parameter } from "./parameters.js";
import { entry, inSI, named, unitOf } from "./units.js";

const READ_DIGITS = 12;

// A field of the form is of the axis that its `data-axis` names, "horizontal" or "vertical"; an element with `data-names`
// has the name of that axis. Numbers of one axis rise.
export class AxisForm {
  // `valuesOf(state)` are the numbers of the fields, null: none; `chosen(values)` is called with others, inside the
  // `domains` of the axes, and at their lower ends where a form is `closed`.
  constructor(id, { valuesOf, digits = READ_DIGITS, chosen, domains, closed = false }) {
    this.form = byId(id);
    this.fields = [...this.form.querySelectorAll("input")];
    this.valuesOf = valuesOf;
    this.digits = digits;
    this.ends = closed ? { isClosed: true } : {};
    // a number may be wrong beside another one alone
    this.form.addEventListener("input", () => this.fields.forEach((field) => field.setCustomValidity("")));
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      const values = this.#entered(domains());
      if (values) chosen(values);
    });
  }

  // The numbers that were entered; null, and a field says what is wrong.
  #entered({ x, y }) {
    const values = this.fields.map((field) => {
      const value = numberOf(field, field.dataset.axis === "horizontal" ? x : y, this.ends);
      return inSI(this.machine, this.#quantity(field), value);
    });
    if (values.includes(null)) return null;
    const falls = this.fields.findIndex(
      (field, k) => field.dataset.axis === this.fields[k - 1]?.dataset.axis && values[k] <= values[k - 1],
    );
    if (falls < 0) return values;
    this.fields[falls].setCustomValidity("The second number must be above the first one.");
    this.fields[falls].reportValidity();
    return null;
  }

  #quantity({ dataset }) {
    return parameter(this.plane[dataset.axis]).quantity;
  }

  // Names the numbers, and writes those of a state of the page.
  /** @param {State} state */
  show(state) {
    const { machine, plane } = state;
    const values = this.valuesOf(state) ?? [];
    const names = ["horizontal", "vertical"].map((axis) => parameter(plane[axis], machine));
    const shown = JSON.stringify([machine, plane, values, names.map(({ quantity }) => unitOf(machine, quantity))]);
    if (shown === this.shown) return; // so that what is being entered stays
    this.shown = shown;
    this.machine = machine;
    this.plane = plane;
    for (const label of this.form.querySelectorAll("[data-names]")) {
      const { text, quantity } = names[label.dataset.names === "horizontal" ? 0 : 1];
      label.textContent = named(text, machine, quantity);
    }
    this.fields.forEach((field, k) => {
      field.value = entry(machine, this.#quantity(field), values[k], this.digits);
      field.removeAttribute("aria-invalid");
      field.setCustomValidity("");
    });
  }
}
