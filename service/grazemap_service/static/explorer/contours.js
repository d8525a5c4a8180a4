// Lines on which a value of the points of a tile is zero, as where the steady motion touches a stop.
import { along, isWithin } from "./lattice.js";

const ROUND_OFF = 1e-9; // of the values around

// The places of n points along a side in shares of it, with the ends, and their values there, which go on straight.
const shares = (n) => [0, ...Array.from({ length: n }, (_, k) => (k + 0.5) / n), 1];
function toTheEnds(values) {
  const [first, second] = values;
  const [before, last] = values.slice(-2);
  return [first - (second - first) / 2, ...values, last + (last - before) / 2];
}

// The values [column][row] of n x n points, a row after the other from below, and at the edges.
function grid(values, n) {
  const rows = Array.from({ length: n }, (_, row) => toTheEnds([...values.subarray(row * n, (row + 1) * n)]));
  return rows[0].map((_, column) => toTheEnds(rows.map((row) => row[column])));
}

// The zeros of values of n x n points, a row after the other from below, as the ends of short lines in shares of the
// tile's sides: x0, y0, x1, y1, and so on. Between two points, and as far as the edges, the value is taken to be linear.
// A line is left out where the value of `others` on it is negative, by more than round-off.
export function zeros(values, n, others = null) {
  const columns = grid(values, n);
  const limits = others && grid(others, n);
  const at = shares(n);
  const ends = [];
  for (let row = 0; row + 1 < at.length; row++)
    for (let column = 0; column + 1 < at.length; column++) {
      const corners = [
        [column, row],
        [column + 1, row],
        [column + 1, row + 1],
        [column, row + 1],
      ];
      const crossed = [];
      const sizes = limits ? corners.map(([i, j]) => Math.abs(limits[i][j])) : [];
      const least = -ROUND_OFF * Math.max(...sizes);
      for (let k = 0; k < 4; k++) {
        const [[i, j], [to, up]] = [corners[k], corners[(k + 1) % 4]];
        const [start, end] = [columns[i][j], columns[to][up]];
        if (start < 0 === end < 0 || !Number.isFinite(start + end)) continue;
        const part = start / (start - end);
        if (limits && along([limits[i][j], limits[to][up]], part) < least) continue;
        crossed.push(at[i] + part * (at[to] - at[i]), at[j] + part * (at[up] - at[j]));
      }
      ends.push(...crossed.slice(0, 2 * 2 * Math.floor(crossed.length / 4)));
    }
  return Float64Array.from(ends);
}

const TEXTS = Object.fromEntries(
  ["right", "left"].map((stop) => [stop, `Grazing curve: on it the steady motion just touches the ${stop} stop.`]),
);

// Where the steady motion touches a stop: of each tile, the coarsest first, where no finer one is over it.
/** @param {Tile[]} tiles  @param {string} colour  @returns {Line[]} */
export function grazes(tiles, colour) {
  return ["right", "left"].flatMap((stop) => {
    const line = { x: [], y: [], colour, text: TEXTS[stop], isGraze: true };
    tiles.forEach((tile, number) => {
      const ends = tile[`graze_${stop}`] ?? [];
      const finer = tiles.slice(number + 1);
      for (let k = 0; k < ends.length; k += 4) {
        const [left, right] = [along(tile.x, ends[k]), along(tile.x, ends[k + 2])];
        const [low, high] = [along(tile.y, ends[k + 1]), along(tile.y, ends[k + 3])];
        if (finer.some(({ x, y }) => isWithin((left + right) / 2, x) && isWithin((low + high) / 2, y))) continue;
        line.x.push(left, right, null);
        line.y.push(low, high, null);
      }
    });
    return line.x.length ? [line] : [];
  });
}
