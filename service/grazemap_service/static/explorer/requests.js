// Requests of the API about a machine, { oscillator, stops, left, periods }: `stops` is "equal", "right" or "left" (the
// only stop) or "unequal", where the clearance of the right stop varies and `left` is that of the left one.

import { weightOf } from "./contact.js";
import { USUAL } from "./parameters.js";
import { STATES } from "./starts.js";

const NEXT = 1e-9; // of a value, to another one

const oscillatorOf = ({ oscillator }) => (oscillator ? { oscillator } : {});

/** @param {Machine} machine  @param {number} value */
export function clearance({ stops, left }, value) {
  if (stops === "right") return { right: value, left: null };
  if (stops === "left") return { right: null, left: value };
  return stops === "unequal" ? { right: value, left } : value;
}

function fixedClearance({ stops, left }) {
  if (stops === "right") return { clearance: { left: null } };
  if (stops === "left") return { clearance: { right: null } };
  return stops === "unequal" ? { clearance: { left } } : {};
}

// The name by which a request varies a parameter: a clearance is that of the stop that moves.
const varied = ({ stops }, name) =>
  name === "clearance" && stops !== "equal" ? `clearance_${stops === "left" ? "left" : "right"}` : name;

// What a request over ranges of a plane says.
/** @param {Machine} machine  @param {PlaneAxes} plane  @param {PointValues} across  @param {PointValues} up */
export function over(machine, plane, across, up) {
  const { horizontal, vertical } = plane;
  return {
    ...oscillatorOf(machine),
    horizontal: { vary: varied(machine, horizontal), values: across },
    vertical: { vary: varied(machine, vertical), values: up },
    ...(plane.omega !== null && { omega: plane.omega }),
    ...besideAxes(machine, plane),
  };
}

// The clearance of what does not vary.
function besideAxes(machine, { horizontal, vertical, clearance: fixed }) {
  const [right, left] = ["clearance", "clearance_left"].map((name) => horizontal === name || vertical === name);
  if (right) return left ? {} : fixedClearance(machine);
  return { clearance: left ? { right: fixed } : clearance(machine, fixed) };
}

// A preview leaves motions open that settle late, which are few and take most of the time.
/** @type {(machine: Machine, plane: PlaneAxes, across: PointValues, up: PointValues, options: { preview?: object, observables?: string[], policy?: string }) => object} */
export const map = (machine, plane, across, up, { preview, observables, policy = "rest" }) => ({
  ...over(machine, plane, across, up),
  max_periods: preview ? Math.ceil(machine.periods / 4) : machine.periods,
  ...(policy !== "rest" && { policy }),
  ...(policy === "ensemble" && { initial_conditions: STATES }),
  // the page does not show what a sample of other starts finds
  ...(preview ? { preview } : policy === "rest" && { other_starts: 0 }),
  ...(observables && { observables }),
});

// The grazing curve over omega, of the stops that `clearance` does not fix or leave out.
export const curve = (machine, omega, fixed = fixedClearance(machine)) => ({
  ...oscillatorOf(machine),
  ...fixed,
  axis: { vary: "omega", values: omega },
});

const ends = ([start, stop]) => ({ start, stop });

// The bifurcation curves that leave the grazing curve.
export const curves = (machine, plane, across, up) => over(machine, plane, ends(across), ends(up));

// A map whose first point is the given one; the least that a map has is two values a side.
export const pointMap = (machine, point) => {
  const [across, up] = point.map((value) => [value, value * (1 + NEXT)]);
  return { ...over(machine, USUAL, across, up), max_periods: machine.periods };
};

// The motions to which random states at a point lead; of two values, as few as there may be, at the point and beside it.
export const fractions = (machine, [omega, value], states) => ({
  ...oscillatorOf(machine),
  axis: { vary: "omega", values: [omega, omega * (1 + NEXT)] },
  clearance: clearance(machine, value),
  states,
  max_periods: machine.periods,
});

// A map with its borders explained.
export const borders = (machine, plane, across, up, points) => ({
  ...over(machine, plane, { ...ends(across), points }, { ...ends(up), points }),
  max_periods: machine.periods,
  borders: true,
});

const at = (machine, [omega, value]) => ({ ...oscillatorOf(machine), omega, clearance: clearance(machine, value) });

// Of the motion to which an `initial` state leads, in place of rest, where there is one.
const from = (initial) => (initial ? { initial } : {});

export const trajectory = (machine, point, { transient, periods, samples = 128, initial = null }) => ({
  ...at(machine, point),
  ...from(initial),
  transient_periods: transient,
  periods,
  samples_per_period: samples,
});

export const orbit = (machine, point, initial = null) => ({
  ...at(machine, point),
  ...from(initial),
  transient_periods: machine.periods,
  observables: ["impact_rate", "peak_impact_speed", "dissipated_power"],
});

export const branch = (machine, point, name, range, initial = null) => ({
  ...at(machine, point),
  ...from(initial),
  transient_periods: machine.periods,
  axis: { vary: varied(machine, name), values: ends(range) },
});

// The curves of the motion of an orbit at a point of a plane, in a window that contains it.
export function curvesOf(machine, plane, [x, y], { period, stops, phases, velocities }, window) {
  return {
    ...curves(machine, plane, window.x, window.y),
    motions: [{ period, stops, phases, velocities, horizontal: x, vertical: y }],
  };
}

// Initial displacements and velocities of a mass in a rectangle that leaves the contact between the stops.
export function basins(machine, point, points) {
  const [omega, value] = point;
  const reach = 0.99 * value;
  const low = { right: -value, left: -reach, unequal: -0.99 * machine.left }[machine.stops] ?? -reach;
  const high = machine.stops === "left" ? value : reach;
  const weight = weightOf(machine) || 1; // where mass 1 does not move the contact, it may be anywhere
  const [least, most] = [low / weight, high / weight].sort((end, other) => end - other);
  const fastest = Math.abs((omega * value) / weight);
  const coordinate = (quantity, start, stop) => ({ quantity, mass: 1, values: { start, stop, points } });
  return {
    ...at(machine, point),
    max_periods: machine.periods,
    horizontal: coordinate("displacement", least, most),
    vertical: coordinate("velocity", -fastest, fastest),
  };
}

export const structure = ({ oscillator }) => ({ ...(oscillator && { oscillator }) });
