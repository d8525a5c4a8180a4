// The choice of the plane: its two parameters, and where the forcing frequency and the clearance are if they are not axes.
import { byId, element, numberOf } from "./dom.js";
import { FIXED, namesOf, parameter } from "./parameters.js";
import { entry, inSI, unitOf } from "./units.js";

const AXES = ["horizontal", "vertical"];

export class PlaneForm {
  // `chosen({ horizontal, vertical, omega, clearance })` is called with a plane; null where a number is not given.
  constructor({ chosen }) {
    this.form = byId("plane-form");
    this.form.addEventListener("submit", (event) => event.preventDefault());
    this.form.addEventListener("change", ({ target }) => {
      const { plane } = this;
      const fields = this.form.elements;
      const next = Object.fromEntries(AXES.map((axis) => [axis, fields[axis].value]));
      // the axes change places where one is given the parameter of the other
      if (next.horizontal === next.vertical)
        Object.assign(next, { horizontal: plane.vertical, vertical: plane.horizontal });
      const number = FIXED.includes(target.name) ? numberOf(target) : undefined;
      const inRequest = (value) => inSI(this.machine, parameter(target.name).quantity, value);
      const entered = number !== undefined && { [target.name]: inRequest(number) };
      if (entered[target.name] !== null) chosen({ ...plane, ...next, ...entered });
    });
  }

  show({ machine, plane }) {
    this.machine = machine;
    this.plane = plane;
    const names = namesOf(machine);
    for (const axis of AXES) {
      const options = names.map((name) =>
        element("option", { value: name, textContent: parameter(name, machine).text }),
      );
      this.form.elements[axis].replaceChildren(...options);
      this.form.elements[axis].value = plane[axis];
    }
    for (const name of FIXED) {
      byId(`fixed-${name}`).hidden = plane[name] === null;
      const { quantity } = parameter(name);
      this.form.elements[name].value = entry(machine, quantity, plane[name]);
      byId(`fixed-${name}-unit`).textContent = unitOf(machine, quantity);
    }
  }
}
