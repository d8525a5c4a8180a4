// Units of the numbers of a machine; nondimensional numbers have none. Requests are in SI; a person may choose others
// to read and write frequencies and lengths in.
import { toRead } from "./ticks.js";

const SI = {
  frequency: "rad/s",
  length: "m",
  time: "s",
  velocity: "m/s",
  power: "W",
  mass: "kg",
  stiffness: "N/m",
};
const DIGITS = 12;
const TURN = 2 * Math.PI;

// The units to choose from, the first one that of SI, with how many of them one of SI is.
export const UNITS = {
  frequency: { "rad/s": 1, Hz: 1 / TURN, rpm: 60 / TURN },
  length: { m: 1, mm: 1000 },
};
export const USUAL_UNITS = { frequency: "rad/s", length: "m" };

let chosen = USUAL_UNITS;

// Takes note of the units that a person reads, { frequency, length }.
/** @param {State["units"]} units */
export function choose(units) {
  chosen = units;
}

/** @type {(machine: Machine) => boolean} */
export const isSI = (machine) => machine?.oscillator?.units === "SI";

// A quantity may also be told by its unit in SI.
const kindOf = (quantity) => Object.keys(SI).find((kind) => SI[kind] === quantity) ?? quantity;
const factor = (machine, quantity) => (isSI(machine) && UNITS[kindOf(quantity)]?.[chosen[kindOf(quantity)]]) || 1;

// A number of a request in the unit that is read, or several.
/** @param {Machine} machine  @param {string} quantity  @param {any} value  @returns {any} */
export function shown(machine, quantity, value) {
  if (Array.isArray(value)) return value.map((part) => shown(machine, quantity, part));
  return value === null ? null : value * factor(machine, quantity);
}
export const inSI = (machine, quantity, value) => (value === null ? null : value / factor(machine, quantity));

// The text of a number for a field: as it is in SI; in another unit without what the conversion rounds.
export function entry(machine, quantity, value, digits = DIGITS) {
  if (value === null || value === undefined) return "";
  return factor(machine, quantity) === 1
    ? `${value}`
    : `${Number(shown(machine, quantity, value).toPrecision(digits))}`;
}

// With a space before it, for a number.
/** @param {Machine} machine  @param {string} quantity */
export function unitOf(machine, quantity) {
  const kind = kindOf(quantity);
  return isSI(machine) && quantity ? ` ${chosen[kind] ?? SI[kind] ?? quantity}` : "";
}

// A number of a request for reading, with its unit.
/** @type {(machine: Machine, quantity: string, value: number) => string} */
export const withUnit = (machine, quantity, value) =>
  toRead(shown(machine, quantity, value)) + unitOf(machine, quantity);

// How a frequency is written in the unit that is read.
const SYMBOLS = { Hz: "f", rpm: "n" };
export const symbolOf = (machine) => (isSI(machine) && SYMBOLS[chosen.frequency]) || "ω";

// What an axis or a field is called: "clearance (m)".
export const named = (text, machine, quantity) =>
  text.replace(/ω$/, symbolOf(machine)) + unitOf(machine, quantity).replace(/ (.+)/, " ($1)");
