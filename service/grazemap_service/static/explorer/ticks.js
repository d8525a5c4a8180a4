// Round values on an axis, with their texts. Where neighbours differ only in late digits, the texts say the difference
// from a `base`.

const BASE_DIGITS = 6;

export function ticks([low, high], most) {
  const power = 10 ** Math.floor(Math.log10((high - low) / most));
  const step = power * [1, 2, 5, 10].find((factor) => (high - low) / (factor * power) <= most);
  const digits = Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / step));
  const first = Math.ceil(low / step);
  const count = Math.floor(high / step) - first + 1;
  const base = digits > BASE_DIGITS ? Number(((first + Math.floor(count / 2)) * step).toPrecision(digits + 1)) : 0;
  const marks = Array.from({ length: count }, (_, k) => {
    const value = (first + k) * step;
    return { value, text: base ? signed(value - base, step) : brief(value, step) };
  });
  return { marks, base };
}

const brief = (value, step) =>
  `${Number(value.toPrecision(Math.max(1, Math.ceil(Math.log10(Math.abs(value) / step + 1)) + 1)))}`;
const signed = (value, step) =>
  Math.abs(value) < step / 2 ? "0" : (value > 0 ? "+" : "−") + Math.abs(value).toPrecision(1);

// A number for reading: four digits, more where a window needs them to tell its points apart.
export function toRead(value, width = Math.abs(value)) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const digits = value && width ? Math.ceil(Math.log10(Math.abs(value) / width)) + 4 : 4;
  return `${Number(value.toPrecision(Math.min(17, Math.max(4, digits))))}`;
}
