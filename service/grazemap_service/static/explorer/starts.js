// Where the trajectories of a map start, and what the page says of it.
import { POINTS } from "./lattice.js";

export const STATES = 8; // of an ensemble, at each point

const swept = (from, first) =>
  `Each column is swept: a point starts where the one ${from} it ended, the window’s ${first} one from rest; ` +
  `of ${POINTS} x ${POINTS} points.`;

export const STARTS = {
  rest: { text: "rest", phrase: "from rest" },
  "sweep-up": { text: "the point below (sweep up)", phrase: "in a sweep up", means: swept("below", "lowest") },
  "sweep-down": { text: "the point above (sweep down)", phrase: "in a sweep down", means: swept("above", "highest") },
  ensemble: {
    text: "random states",
    phrase: "from most of several random states",
    means: `The colour is the motion to which most of ${STATES} random states lead.`,
  },
};
export const isSweep = (policy) => policy.startsWith("sweep");
