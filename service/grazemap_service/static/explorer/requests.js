// Requests of the API about a machine, { oscillator, stops, left, periods }: `stops` is "equal", "right" or "left" (the
// only stop) or "unequal", where the clearance of the right stop varies and `left` is that of the left one.

const oscillatorOf = ({ oscillator }) => (oscillator ? { oscillator } : {});

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

export const map = (machine, omega, clearances, { preview, observables }) => ({
  ...oscillatorOf(machine),
  omega,
  clearance: clearance(machine, clearances),
  max_periods: machine.periods,
  ...(preview && { preview }),
  ...(observables && { observables }),
});

export const curve = (machine, omega) => ({ ...oscillatorOf(machine), ...fixedClearance(machine), omega });

export const borders = (machine, [left, right], [low, high]) => ({
  ...oscillatorOf(machine),
  omega: { start: left, stop: right },
  clearance: clearance(machine, { start: low, stop: high }),
});

const at = (machine, [omega, value]) => ({ ...oscillatorOf(machine), omega, clearance: clearance(machine, value) });

export const trajectory = (machine, point, { transient, periods }) => ({
  ...at(machine, point),
  transient_periods: transient,
  periods,
  samples_per_period: 128,
});

export const orbit = (machine, point) => ({
  ...at(machine, point),
  transient_periods: machine.periods,
  observables: ["impact_rate", "peak_impact_speed", "dissipated_power"],
});

export const branch = (machine, point, [start, stop]) => ({
  ...at(machine, point),
  transient_periods: machine.periods,
  vary: { equal: "clearance", left: "clearance_left" }[machine.stops] ?? "clearance_right",
  range: { start, stop },
});

// The curves of the motion of an orbit, in a window that contains the orbit.
export const curvesOf = (
  machine,
  [omega, value],
  { period, stops, phases, velocities },
  [left, right],
  [low, high],
) => ({
  ...borders(machine, [left, right], [low, high]),
  motions: [{ period, stops, phases, velocities, omega, clearance: clearance(machine, value) }],
});

// Initial displacements and velocities of a mass in a rectangle that leaves the contact between the stops.
export function basins(machine, point, points) {
  const [omega, value] = point;
  const reach = 0.99 * value;
  const low = { right: -value, left: -reach, unequal: -0.99 * machine.left }[machine.stops] ?? -reach;
  const high = machine.stops === "left" ? value : reach;
  const coordinate = (quantity, start, stop) => ({ quantity, mass: 1, values: { start, stop, points } });
  return {
    ...at(machine, point),
    max_periods: machine.periods,
    horizontal: coordinate("displacement", low, high),
    vertical: coordinate("velocity", -omega * value, omega * value),
  };
}

export const structure = ({ oscillator }, rest = {}) => ({ ...(oscillator && { oscillator }), ...rest });
