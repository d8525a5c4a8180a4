// Machines to begin with, each with a window that shows something.
import { complete } from "./parameters.js";

/** @type {Omit<Machine, "oscillator">} */
const chain = { stops: "equal", left: null, periods: 400 };

/** @type {Record<string, View & { text: string, machine: Machine }>} */
export const PRESETS = {
  paper: {
    text: "Three masses (paper)",
    machine: { ...chain, oscillator: null },
    x: [0.25, 0.3125],
    y: [1.5, 2.25],
  },
  hammer: {
    text: "One mass, one stop",
    machine: {
      ...chain,
      stops: "right",
      oscillator: { units: "SI", masses: [0.5], stiffnesses: [2000], damping: [1.5], forcing: [5], restitution: 0.7 },
    },
    x: [40, 80],
    y: [0.001, 0.025],
  },
  bumper: {
    text: "Two masses, unequal stops",
    machine: {
      ...chain,
      stops: "unequal",
      left: 0.003,
      oscillator: {
        units: "SI",
        masses: [0.5, 2],
        stiffnesses: [2000, 8000],
        damping: [1.5, 6],
        forcing: [5, 0],
        bias: [2, 0],
        restitution: { right: 0.7, left: 0.5 },
      },
    },
    x: [40, 70],
    y: [0.001, 0.025],
  },
  damper: {
    text: "Impact damper",
    machine: {
      ...chain,
      oscillator: {
        units: "SI",
        masses: [1, 10],
        stiffnesses: [10, 4000],
        damping: [0.2, 8],
        forcing: [0, 10],
        contact: [1, 2],
        restitution: 0.6,
      },
    },
    x: [15, 25],
    y: [0.005, 0.05],
  },
  rotor: {
    text: "Rotor with an unbalance",
    machine: {
      ...chain,
      oscillator: {
        units: "SI",
        masses: [8, 40],
        stiffnesses: [2e5, 4e6],
        damping: [60, 600],
        forcing: { amplitude: [4e-4, 0], law: "unbalance" },
        contact: [1, 2],
        restitution: 0.8,
      },
    },
    x: [120, 200],
    y: [0.0001, 0.001],
  },
  rack: {
    text: "Three floors on a shaken base",
    machine: {
      ...chain,
      oscillator: {
        units: "SI",
        masses: [2, 3, 3],
        stiffnesses: [3000, 6000, 6000],
        damping: [2, 4, 4],
        restitution: 0.7,
        base: { amplitude: 0.002, stops_move: true },
      },
    },
    x: [18, 30],
    y: [0.004, 0.036],
  },
};

const named = (idOf, machine) => Object.keys(PRESETS).find((name) => idOf(PRESETS[name].machine) === idOf(machine));

// The name of the preset of a machine, however long one watches; undefined: it is none.
/** @param {Machine} machine  @returns {string | undefined} */
export const presetOf = (machine) =>
  named(({ oscillator, stops, left }) => JSON.stringify([oscillator, stops, left]), machine);

// The name of the preset that a machine is, or that sliders make it of; undefined: there is none.
/** @param {Machine} machine  @returns {string | undefined} */
export const likeOf = (machine) =>
  named(({ oscillator, stops }) => {
    const { masses, stiffnesses, contact } = complete(oscillator);
    return JSON.stringify([masses, stiffnesses, contact, stops]);
  }, machine);
