// The parameters that the axes of a plane may be, and the machine at a point of a plane. A plane is
// { horizontal, vertical, omega, clearance }: the names of two parameters, and the values of those two where they are
// not axes.

export const FIXED = ["omega", "clearance"]; // what has a value where it is no axis
export const USUAL = { horizontal: "omega", vertical: "clearance", omega: null, clearance: null };
/** @type {(plane: { horizontal: string, vertical: string }) => boolean} */
export const isUsual = ({ horizontal, vertical }) => horizontal === "omega" && vertical === "clearance";

// What the service takes for an oscillator that is not described: the example of the paper.
export const EXAMPLE = {
  masses: [1, 10, 10],
  stiffnesses: [1, 5, 5],
  damping: 0.05,
  forcing: [1, 0, 0],
  restitution: 0.8,
};

// An oscillator with what the service takes for what it does not say.
export function complete(oscillator) {
  if (!oscillator) return EXAMPLE;
  const { masses, matrices, base, units } = oscillator;
  const { forcing, restitution, damping, ...chain } = EXAMPLE;
  return {
    ...(!matrices && chain),
    ...(!matrices && units !== "SI" && { damping }),
    ...(!base && !matrices && !masses && { forcing }),
    ...(!base && Array.isArray(masses) && { forcing: masses.map((_, k) => Number(k === 0)) }),
    restitution,
    ...oscillator,
  };
}
const oscillatorOf = ({ oscillator }) => complete(oscillator);

const SINGLE = {
  omega: { text: "forcing frequency ω", symbol: "ω", quantity: "frequency" },
  clearance: { text: "clearance", quantity: "length" },
  clearance_left: { text: "clearance of the left stop", quantity: "length" },
  restitution: {
    text: "restitution",
    domain: [0, 1],
    hint: "Of the speed of a hit, so much is left after it: 1 is a ball of steel, 0 a lump of clay.",
  },
  forcing: { text: "factor of the forces", short: "forces", factor: true },
  damping: { text: "factor of the damping", short: "damping", factor: true },
  bias: { text: "factor of the bias", factor: true, domain: [-Infinity, Infinity] },
};
const LISTED = {
  masses: { text: "mass", quantity: "mass" },
  stiffnesses: { text: "stiffness", quantity: "stiffness" },
};
const PLACES = ["omega", "clearance", "clearance_left"];
const POSITIVE = [0, Infinity];
const WIDE = 0.25; // of a value, to each side of it, in a window to begin with

const listed = (name) => /^(\w+)\[(\d+)\]$/.exec(name);

const RIGHT = { text: "clearance of the right stop" };

// An interval of a parameter in a request: many parameters are not 0.
/** @param {Interval} interval  @param {Interval} domain  @returns {Interval} */
export const within = ([low, high], domain) => [domain[0] === 0 ? Math.max(low, (high - low) / 2 ** 10) : low, high];

// A parameter of a machine: { name, text, quantity, domain, factor }; null if no machine has one of this name.
/** @param {string} name  @param {Partial<Machine>} [machine]  @returns {Parameter | null} */
export function parameter(name, { stops } = {}) {
  const [, list, number] = listed(name) ?? [];
  if (Object.hasOwn(LISTED, list ?? ""))
    return { ...LISTED[list], name, text: `${LISTED[list].text} ${number}`, domain: POSITIVE };
  if (!Object.hasOwn(SINGLE, name)) return null;
  const isOfRight = name === "clearance" && stops === "unequal";
  return { domain: POSITIVE, ...SINGLE[name], ...(isOfRight && RIGHT), name };
}

// The names of the parameters of a machine.
/** @param {Machine} machine  @returns {string[]} */
export function namesOf(machine) {
  const oscillator = oscillatorOf(machine);
  const has = {
    bias: Array.isArray(oscillator.bias) && oscillator.bias.some(Boolean),
    clearance_left: machine.stops === "unequal",
  };
  const single = Object.keys(SINGLE).filter((name) => has[name] ?? name !== "bias");
  const lists = Object.keys(LISTED).filter((list) => Array.isArray(oscillator[list]));
  return [...single, ...lists.flatMap((list) => oscillator[list].map((_, k) => `${list}[${k + 1}]`))];
}

const scaled = (value, by) => {
  if (typeof value === "number") return by * value;
  return Array.isArray(value) ? value.map((entry) => scaled(entry, by)) : value;
};
const scaledFields = (fields, names, by) =>
  Object.fromEntries(
    Object.entries(fields).map(([name, value]) => [name, names.includes(name) ? scaled(value, by) : value]),
  );

// A force, or a list of them, times a factor.
function scaledForcing(forcing, by) {
  if (Array.isArray(forcing) && typeof forcing[0] === "object")
    return forcing.map((harmonic) => scaledForcing(harmonic, by));
  return Array.isArray(forcing) ? scaled(forcing, by) : scaledFields(forcing, ["amplitude"], by);
}

// A damping as an oscillator or its matrices have it, times a factor.
const scaledDamping = (damping, by) =>
  typeof damping === "object" && !Array.isArray(damping)
    ? scaledFields(damping, ["modal", "rayleigh"], by)
    : scaled(damping, by);

// An oscillator with a parameter at a value; factors are those of what it has.
export function withParameter(oscillator, name, value) {
  const [, list, number] = listed(name) ?? [];
  if (list) return { ...oscillator, [list]: oscillator[list].with(Number(number) - 1, value) };
  if (name === "restitution") return { ...oscillator, restitution: value };
  if (name === "bias") return { ...oscillator, bias: scaled(oscillator.bias, value) };
  if (name === "damping" && oscillator.matrices)
    return {
      ...oscillator,
      matrices: { ...oscillator.matrices, damping: scaledDamping(oscillator.matrices.damping, value) },
    };
  if (name === "damping") return { ...oscillator, damping: scaledDamping(oscillator.damping, value) };
  const { base, forcing } = oscillator;
  return {
    ...oscillator,
    ...(forcing && { forcing: scaledForcing(forcing, value) }),
    ...(base && { base: scaledFields(base, ["amplitude"], value) }),
  };
}

// The machine at a point [x, y] of a plane, and [omega, clearance] there.
/** @param {Machine} machine  @param {PlaneAxes} plane  @param {number[]} point  @returns {{ machine: Machine, at: number[] }} */
export function placeOf(machine, plane, [x, y]) {
  const values = { omega: plane.omega, clearance: plane.clearance, [plane.horizontal]: x, [plane.vertical]: y };
  const others = [plane.horizontal, plane.vertical].filter((name) => !PLACES.includes(name));
  const changed = others.reduce(
    (oscillator, name) => withParameter(oscillator, name, values[name]),
    oscillatorOf(machine),
  );
  return {
    machine: {
      ...machine,
      ...(others.length && { oscillator: changed }),
      ...("clearance_left" in values && { left: values.clearance_left }),
    },
    at: [values.omega, values.clearance],
  };
}

// The value of a parameter of a machine; 1 of a factor.
/** @param {Machine} machine  @param {string} name  @param {number[]} place  @returns {number} */
export function valueOf(machine, name, [omega, clearance]) {
  const oscillator = oscillatorOf(machine);
  const [, list, number] = listed(name) ?? [];
  if (list) return oscillator[list][Number(number) - 1];
  const { restitution } = oscillator;
  const among = { omega, clearance, clearance_left: machine.left, restitution: restitution.right ?? restitution };
  return among[name] ?? 1;
}

// The values of a parameter to begin with.
/** @param {string} name  @param {number} value  @returns {Interval} */
export function intervalAbout(name, value) {
  const { domain } = parameter(name);
  const reach = WIDE * (domain[1] === 1 ? 1 : Math.abs(value));
  return [Math.max(domain[0], value - reach), Math.min(domain[1], value + reach)];
}
