// The form of the open point: its two numbers, which one may enter instead of clicking the plane.
import { byId, numberOf } from "./dom.js";
import { parameter } from "./parameters.js";
import { named } from "./units.js";

const AXES = { across: "horizontal", up: "vertical" };

export class PointForm {
  // `chosen([x, y])` is called with a point inside the `domains` of the plane's parameters.
  constructor({ chosen, domains }) {
    this.form = byId("point-form");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      const { x, y } = domains();
      const at = [numberOf(this.form.elements.across, x), numberOf(this.form.elements.up, y)];
      if (!at.includes(null)) chosen(at);
    });
  }

  // Names the numbers, and writes those of the open point of a state of the page.
  show({ machine, plane, at }) {
    const shown = JSON.stringify([machine, plane, at]);
    if (shown === this.shown) return; // so that what is being entered stays
    this.shown = shown;
    Object.entries(AXES).forEach(([field, axis], k) => {
      const { text, quantity } = parameter(plane[axis], machine);
      byId(`point-${field}`).textContent = named(text, machine, quantity);
      const entered = this.form.elements[field];
      entered.value = at?.[k] ?? "";
      entered.removeAttribute("aria-invalid");
      entered.setCustomValidity("");
    });
  }
}
