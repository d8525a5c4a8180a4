// Places worth seeing: each a machine, of PRESETS or made of one, with a window; `shows` are motions that are there.
import { PRESETS } from "./presets.js";

const { paper, hammer, bumper, damper, rotor, rack } = PRESETS;
const softer = { ...hammer.machine, oscillator: { ...hammer.machine.oscillator, restitution: 0.4 } };

export const PLACES = [
  {
    ...paper,
    text: "A codimension-two point",
    says: "From a point on the grazing curve of the paper's machine a wedge of many motions opens.",
    x: [0.279, 0.288],
    y: [1.88, 1.97],
    shows: ["1-1r-(-1)l", "1-(-1)r-1l", "1-1r-1l"],
  },
  {
    ...hammer,
    text: "A staircase of periods",
    says: "The faster it is shaken, the longer a hammer flies: it hits in every period, in every second, every third.",
    x: [100, 420],
    y: [0.00005, 0.0008],
    shows: ["1-1r-(-1)l", "2-1r-(-1)l", "3-1r-(-1)l", "4-1r-(-1)l"],
  },
  {
    machine: softer,
    text: "Chatter that comes to rest",
    says: "One impact in a period becomes two, then three, then infinitely many: the hammer comes to rest on its stop.",
    x: [12, 46],
    y: [0.0002, 0.0034],
    shows: ["1-1r-(-1)l", "1-2r-(-1)l", "1-3r-(-1)l", "1-∞r-(-1)l"],
  },
  {
    ...paper,
    text: "Islands among islands",
    says: "A crowd of rhythms in bands and islands, which have bands and islands themselves: zoom in.",
    x: [0.305, 0.3125],
    y: [1.72, 1.84],
    shows: ["1-2r-2l", "2-3r-4l", "9-13r-13l"],
  },
  {
    ...damper,
    text: "Chaos, measured",
    says: "Red is chaos, by its Lyapunov exponent, and blue is order: thin bands of it lie in the chaos of a damper.",
    x: [18, 21.5],
    y: [0.005, 0.035],
    layer: "exponent",
    shows: ["chaotic", "1-1r-1l", "1-2r-2l"],
  },
  {
    ...hammer,
    says: "A hammer on its spring. Begin at its grazing curve, and go down.",
    shows: ["1-1r-(-1)l", "2-1r-(-1)l", "1-2r-(-1)l"],
  },
  {
    ...bumper,
    says: "The left stop is fixed, the right one moves away: then the left one alone is hit.",
    shows: ["1-(-1)r-1l", "1-1r-1l", "1-2r-1l"],
  },
  {
    ...damper,
    says: "A ball between two walls of a shaken frame, which loses energy at each impact.",
    shows: ["1-1r-1l", "1-2r-2l"],
  },
  {
    ...rotor,
    says: "A rotor between two stops: its force grows with the square of its speed.",
    shows: ["1-1r-1l", "3-1r-1l"],
  },
  {
    ...rack,
    says: "The ground moves, and takes the stops along.",
    shows: ["1-1r-1l", "2-1r-1l"],
  },
];
