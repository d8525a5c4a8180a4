// The worker that reads maps: an npz file in, the arrays of a tile out, with every motion as its number in a list of
// labels, and where the steady motion touches a stop.
import { zeros } from "./contours.js";
import { arrays } from "./npz.js";
import { labelOf } from "./labels.js";

const NAMES = [
  "kind",
  "kinds",
  "period",
  "impacts_right",
  "impacts_left",
  "verified",
  "sensitive",
  "reason",
  "reasons",
  "lyapunov",
  "least_impact_velocity",
  "motions_found",
  "margin_right",
  "margin_left",
];

function labelled({ kind, kinds, period, impacts_right, impacts_left }) {
  const labels = [];
  const numbers = new Map();
  const motion = new Uint16Array(kind.length);
  for (let k = 0; k < kind.length; k++) {
    const name = kinds[kind[k]];
    const label = name === "periodic" ? labelOf(period[k], impacts_right[k], impacts_left[k]) : name;
    let number = numbers.get(label);
    if (number === undefined) {
      number = labels.push(label) - 1;
      numbers.set(label, number);
    }
    motion[k] = number;
  }
  return { labels, motion };
}

async function tileOf(buffer, observables) {
  const { margin_right, margin_left, ...values } = await arrays(buffer, [...NAMES, ...observables]);
  const { kind, kinds, period, impacts_right, impacts_left, ...rest } = values;
  /** @type {Partial<Tile>} */
  const tile = { ...labelled({ kind, kinds, period, impacts_right, impacts_left }), ...rest };
  const points = Math.sqrt(kind.length);
  if (tile.sensitive) tile.sensitiveShare = tile.sensitive.reduce((sum, flag) => sum + Number(flag), 0) / kind.length;
  if (margin_right) tile.graze_right = zeros(margin_right, points, margin_left);
  if (margin_left) tile.graze_left = zeros(margin_left, points, margin_right);
  return tile;
}

/** @type {any} */
const worker = globalThis;
worker.onmessage = async ({ data: { number, buffer, observables } }) => {
  try {
    const tile = await tileOf(buffer, observables);
    worker.postMessage(
      { number, tile },
      Object.values(tile)
        .filter(ArrayBuffer.isView)
        .map((array) => array.buffer),
    );
  } catch {
    worker.postMessage({ number });
  }
};
