// Where the trajectories of a map start, and what the page says of it.
export const STATES = 8; // of an ensemble, at each point

const swept = (from, first) =>
  `Each column of the window is swept: a point starts where the motion ${from} it has ended, the ${first} one from rest. ` +
  "So the colours hang on the window; it has fewer points than tiles have.";

export const STARTS = {
  rest: { text: "rest", said: "from rest" },
  "sweep-up": { text: "the point below (sweep up)", said: "in a sweep up", means: swept("below", "lowest") },
  "sweep-down": { text: "the point above (sweep down)", said: "in a sweep down", means: swept("above", "highest") },
  ensemble: {
    text: "random states",
    said: "from most of several random states",
    means: `The colour is the motion to which most of ${STATES} random states lead.`,
  },
};
export const isSweep = (policy) => policy.startsWith("sweep");
