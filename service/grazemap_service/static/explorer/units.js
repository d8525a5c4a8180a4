// Units of the numbers of a machine; nondimensional numbers have none.

const SI = {
  frequency: "rad/s",
  length: "m",
  time: "s",
  velocity: "m/s",
  power: "W",
  mass: "kg",
  stiffness: "N/m",
};

// With a space before it, for a number.
export const unitOf = (machine, quantity) =>
  machine?.oscillator?.units === "SI" && SI[quantity] ? ` ${SI[quantity]}` : "";

// What an axis or a field is called: "clearance (m)".
export const named = (text, machine, quantity) => text + unitOf(machine, quantity).replace(/ (.+)/, " ($1)");
