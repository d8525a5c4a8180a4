// Lines on which a value of the points of a tile is zero.

// The zeros of values of n x n points, a row after the other from below, as the ends of short lines in shares of the
// tile's sides: x0, y0, x1, y1, and so on. Between two points the value is taken to be linear.
export function zeros(values, n) {
  const ends = [];
  const share = (k) => (k + 0.5) / n;
  for (let row = 0; row + 1 < n; row++)
    for (let column = 0; column + 1 < n; column++) {
      const corners = [
        [column, row],
        [column + 1, row],
        [column + 1, row + 1],
        [column, row + 1],
      ];
      const at = corners.map(([i, j]) => values[j * n + i]);
      const crossed = [];
      for (let k = 0; k < 4; k++) {
        const [start, end] = [at[k], at[(k + 1) % 4]];
        if (start < 0 === end < 0 || !Number.isFinite(start + end)) continue;
        const part = start / (start - end);
        const [[i, j], [to, up]] = [corners[k], corners[(k + 1) % 4]];
        crossed.push(share(i + part * (to - i)), share(j + part * (up - j)));
      }
      ends.push(...crossed.slice(0, 2 * 2 * Math.floor(crossed.length / 4)));
    }
  return Float64Array.from(ends);
}
