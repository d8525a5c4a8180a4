// What a motion does, in plain words.
import { OPEN } from "./labels.js";
import { toRead } from "./ticks.js";

const SLOW = 0.01; // of the fastest hit, below which the slowest one is not told
const PERIODIC = /^(\d+)-(.+)r-(.+)l$/;
const OTHER = {
  chaotic: "It never repeats, and small differences grow",
  "quasi-periodic": "It never repeats exactly, and small differences do not grow",
  unresolved: "It is not decided which motion this is",
  [OPEN]: "It is not decided yet which motion this is",
};

// The hits of a label on a stop, in words.
function hits(count, where) {
  if (count === "(-1)") return `no hit${where}`;
  if (count === "0") return `rest without a hit${where}`;
  if (count === "∞") return `a series of hits${where} that comes to rest`;
  return `${count} ${count === "1" ? "hit" : "hits"}${where}`;
}

// The number of forcing periods after which a motion repeats; null where its label says none.
/** @param {string} label */
export const periodOf = (label) => Number(PERIODIC.exec(label)?.[1] ?? NaN) || null;

// What a label says of a machine, as "Every 2 periods: 3 hits on the right, 2 hits on the left"; "" of an unknown name.
/** @param {string} label  @param {Machine} machine */
export function inWords(label, { stops }) {
  const [, period, right, left] = PERIODIC.exec(label) ?? [];
  if (!period) return OTHER[label] ?? "";
  const sides = { right: stops !== "left" && right, left: stops !== "right" && left };
  const present = Object.entries(sides).filter(([, count]) => count);
  const every = period === "1" ? "Every period" : `Every ${period} periods`;
  if (present.every(([, count]) => count === "(-1)")) return `${every} the same, and no stop is hit`;
  const where = (side) => (present.length === 1 ? "" : ` on the ${side}`);
  return `${every}: ${present.map(([side, count]) => hits(count, where(side))).join(", ")}`;
}

// The speeds of the impacts of a trajectory, as ", at speeds of 0.11 m/s to 0.25 m/s", after what comes `before`; "" without
// an impact.
export function speedsOf({ kind, velocity }, unit, before = ", at") {
  const speeds = velocity.filter((_, k) => kind[k] === "impact").map(Math.abs);
  if (!speeds.length) return "";
  const [least, most] = [Math.min(...speeds), Math.max(...speeds)];
  const [slowest, fastest] = [least, most].map((speed) => `${toRead(speed)}${unit}`);
  if (slowest === fastest) return `${before} a speed of ${fastest}`;
  return least < SLOW * most ? `${before} speeds up to ${fastest}` : `${before} speeds of ${slowest} to ${fastest}`;
}
