// The contact of a machine, and where its stops are.
import { clearance } from "./requests.js";

// The contact coordinate of displacements [mass][time].
export function contactOf({ oscillator }, displacement) {
  const contact = oscillator?.contact ?? 1;
  if (Array.isArray(contact))
    return displacement[contact[0] - 1].map((value, k) => value - displacement[contact[1] - 1][k]);
  if (contact.row)
    return displacement[0].map((_, k) =>
      contact.row.reduce((sum, part, mass) => sum + part * displacement[mass][k], 0),
    );
  return displacement[contact - 1];
}

// The places of the left and the right stop; null where absent.
export function stopsOf(machine, value) {
  const stops = clearance(machine, value);
  if (typeof stops === "number") return [-stops, stops];
  return [stops.left === null ? null : -stops.left, stops.right];
}
