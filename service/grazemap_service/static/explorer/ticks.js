// Round values on an axis, with their texts, and numbers for reading.

const BASE_DIGITS = 6;
const LEAST = 2; // ticks of an axis
const PLAIN = [-3, 5]; // powers of ten between which numbers are written without one

// Where neighbours differ only in late digits, the texts say the difference from a `base`; where all are small, or
// large, they are multiples of a `power` of ten.
export function ticks([low, high], most) {
  const unit = 10 ** Math.floor(Math.log10((high - low) / most));
  const countOf = (step) => Math.floor(high / step) - Math.ceil(low / step) + 1;
  const coarsest = [1, 2, 5, 10].find((factor) => (high - low) / (factor * unit) <= most);
  const step =
    unit *
    [coarsest, ...[5, 2, 1, 0.5].filter((factor) => factor < coarsest)].find(
      (factor) => countOf(factor * unit) >= LEAST,
    );
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const digits = Math.ceil(Math.log10(largest / step));
  const first = Math.ceil(low / step);
  const count = Math.floor(high / step) - first + 1;
  const base = digits > BASE_DIGITS ? rounded((first + Math.floor(count / 2)) * step, step) : 0;
  const order = Math.floor(Math.log10(largest));
  const power = base || (PLAIN[0] <= order && order < PLAIN[1]) ? 0 : order;
  const marks = Array.from({ length: count }, (_, k) => {
    const value = (first + k) * step;
    return { value, text: base ? signed(value - base, step) : `${rounded(value / 10 ** power, step / 10 ** power)}` };
  });
  return { marks, base, power };
}

const signed = (value, step) =>
  Math.abs(value) < step / 2 ? "0" : (value > 0 ? "+" : "−") + Math.abs(rounded(value, step));

const raised = (power) => `10${[...`${power}`].map((digit) => (digit === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit])).join("")}`;

// The name of an axis, such as "displacement (m)", with its ticks' base or power: "displacement (10⁻⁶ m)".
export function axisName(name, { base, power }) {
  if (base) return `${name} − ${base}`;
  if (!power) return name;
  return name.endsWith(")") ? name.replace(/\(([^(]*)\)$/, `(${raised(power)} $1)`) : `${name} (${raised(power)})`;
}

// A number with the digits that tell it from one a step away.
export const rounded = (value, step) =>
  Number(value.toPrecision(Math.min(17, Math.max(1, Math.ceil(Math.log10(Math.abs(value) / step + 1)) + 1))));

// A number for reading: four digits, more where a window needs them to tell its points apart.
export function toRead(value, width = Math.abs(value)) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const digits = value && width ? Math.ceil(Math.log10(Math.abs(value) / width)) + 4 : 4;
  const number = Number(value.toPrecision(Math.min(17, Math.max(4, digits))));
  return number && Math.abs(number) < 10 ** PLAIN[0] ? number.toExponential() : `${number}`;
}
