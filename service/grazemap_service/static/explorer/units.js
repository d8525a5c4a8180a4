// Units of the numbers of a machine, with a space before them; nondimensional numbers have none.

const SI = {
  frequency: "rad/s",
  length: "m",
  time: "s",
  velocity: "m/s",
  power: "W",
  mass: "kg",
  stiffness: "N/m",
};

export const unitOf = ({ oscillator }, quantity) =>
  oscillator?.units === "SI" && SI[quantity] ? ` ${SI[quantity]}` : "";
