// Points of a window for the story to show: beside the grazing curve, and inside the regions of motions.
import { along } from "./lattice.js";

const STEPS = 40; // of the part of a window in which regions are looked for, along a side

// A value of a line at x, between its points, which rise; null where it has none.
function valueAt({ x: xs, y: ys }, x) {
  const k = xs.findIndex((right) => right >= x);
  if (k < 1) return null;
  return ys[k - 1] + ((x - xs[k - 1]) / (xs[k] - xs[k - 1])) * (ys[k] - ys[k - 1]);
}

// The points of a line in a window, over a share of its width: on the line, and a share of its height above it and
// below; null: they are outside.
export function besideLine(line, window, { across, apart }) {
  const x = along(window.x, across);
  const y = valueAt(line, x);
  const step = apart * (window.y[1] - window.y[0]);
  if (y === null || y - step < window.y[0] || y + step > window.y[1]) return null;
  return { on: { x, y }, above: { x, y: y + step }, below: { x, y: y - step } };
}

// For each of so many labels with the largest regions, the point that is farthest from other labels. `labelAt(x, y)` is
// null where none is known and where none is wanted; `part` is that of the window, { x, y } as shares of its sides.
export function insides(labelAt, window, part, most) {
  const place = (axis, k) => along(window[axis], along(part[axis], (k + 0.5) / STEPS));
  const steps = [...Array(STEPS).keys()];
  const labels = steps.map((row) => steps.map((column) => labelAt(place("x", column), place("y", row))));
  // the largest square of a label about each point
  const reach = (row, column) => {
    const label = labels[row][column];
    for (let far = 1; ; far++)
      for (let k = -far; k <= far; k++)
        for (const [i, j] of [
          [row - far, column + k],
          [row + far, column + k],
          [row + k, column - far],
          [row + k, column + far],
        ])
          if (labels[i]?.[j] !== label) return far;
  };
  const best = new Map();
  labels.forEach((ofRow, row) =>
    ofRow.forEach((label, column) => {
      if (label === null) return;
      const far = reach(row, column);
      if (far > (best.get(label)?.far ?? 0)) best.set(label, { label, far, x: place("x", column), y: place("y", row) });
    }),
  );
  return [...best.values()].sort((region, other) => other.far - region.far).slice(0, most);
}
