// The contact of a machine, and where its stops are.
import { complete } from "./parameters.js";
import { clearance } from "./requests.js";

// The contact coordinate of displacements [mass][time].
/** @param {Machine} machine  @param {number[][]} displacement */
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

// The number of masses.
/** @param {Machine} machine */
export function sizeOf({ oscillator }) {
  const { masses, matrices } = complete(oscillator);
  return masses?.length ?? matrices.mass.length;
}

// The contact coordinate of a displacement 1 of mass 1 alone.
/** @param {Machine} machine */
export const weightOf = (machine) =>
  contactOf(
    machine,
    Array.from({ length: sizeOf(machine) }, (_, mass) => [mass ? 0 : 1]),
  )[0];

// The places of the left and the right stop; null where absent.
export function stopsOf(machine, value) {
  const stops = clearance(machine, value);
  if (typeof stops === "number") return [-stops, stops];
  return [stops.left === null ? null : -stops.left, stops.right];
}

// The contact of a trajectory with its stops at { time, q, v }: the samples, and both velocities of every impact.
export function withImpacts(machine, { time, displacement, velocity, impacts }, stops) {
  const places = contactOf(machine, displacement);
  const speeds = contactOf(machine, velocity);
  const { restitution } = complete(machine.oscillator);
  const after = (k) => {
    if (impacts.kind[k] !== "impact") return 0; // the contact rests, or is released
    return -(impacts.stop[k] > 0 ? (restitution.right ?? restitution) : (restitution.left ?? restitution));
  };
  const motion = { time: [], q: [], v: [] };
  const add = (...values) => Object.values(motion).forEach((list, k) => list.push(values[k]));
  let next = 0;
  time.forEach((now, k) => {
    for (; next < impacts.time.length && impacts.time[next] <= now; next++) {
      const place = impacts.stop[next] > 0 ? stops[1] : stops[0];
      add(impacts.time[next], place, impacts.velocity[next]);
      add(impacts.time[next], place, after(next) * impacts.velocity[next]);
    }
    add(now, places[k], speeds[k]);
  });
  return motion;
}
