// The form of the open point: its two numbers, which one may enter instead of clicking the plane.
import { byId, numberOf } from "./dom.js";
import { parameter } from "./parameters.js";
import { entry, inSI, named, unitOf } from "./units.js";

const AXES = { across: "horizontal", up: "vertical" };

export class PointForm {
  // `chosen([x, y])` is called with a point inside the `domains` of the plane's parameters.
  constructor({ chosen, domains }) {
    this.form = byId("point-form");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      const { x, y } = domains();
      const { across, up } = this.form.elements;
      const at = [numberOf(across, x), numberOf(up, y)].map((value, k) =>
        inSI(this.machine, this.quantities[k], value),
      );
      if (!at.includes(null)) chosen(at);
    });
  }

  // Names the numbers, and writes those of the open point of a state of the page.
  show({ machine, plane, at }) {
    const names = Object.values(AXES).map((axis) => parameter(plane[axis], machine));
    const shown = JSON.stringify([machine, plane, at, names.map(({ quantity }) => unitOf(machine, quantity))]);
    if (shown === this.shown) return; // so that what is being entered stays
    this.shown = shown;
    this.machine = machine;
    this.quantities = names.map(({ quantity }) => quantity);
    Object.keys(AXES).forEach((field, k) => {
      const { text, quantity } = names[k];
      byId(`point-${field}`).textContent = named(text, machine, quantity);
      const entered = this.form.elements[field];
      entered.value = entry(machine, quantity, at?.[k]);
      entered.removeAttribute("aria-invalid");
      entered.setCustomValidity("");
    });
  }
}
