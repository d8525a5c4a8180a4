// What an animation shows of a trajectory.
import { contactOf, stopsOf } from "./contact.js";

// `path` is a trajectory of a machine at [omega, clearance]; a periodic motion is repeated, another one is shown whole.
export function moving(machine, at, path, colour) {
  const { time, displacement, impacts, motion, meta } = path;
  // of the forces, which may be a part of that of omega
  const period = (time[1] - time[0]) * meta.request.samples_per_period;
  const whole = time[time.length - 1] - time[0];
  const { contact = 1, matrices } = machine.oscillator ?? {};
  const isChain = !matrices && !contact.row;
  const [struck, bearer] = Array.isArray(contact) ? contact : [contact, null];
  const repeats = motion.kind === "periodic" ? motion.period * period : whole;
  return {
    time,
    ...(isChain
      ? { masses: displacement, struck: struck - 1, bearer: bearer && bearer - 1 }
      : { masses: [contactOf(machine, displacement)], struck: 0, bearer: null }),
    stops: stopsOf(machine, at[1]),
    period,
    loop: Math.min(whole, repeats),
    impacts: impacts.time.map((moment, k) => ({
      time: moment,
      stop: impacts.stop[k],
      speed: Math.abs(impacts.velocity[k]),
    })),
    colour,
  };
}

export const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
