// The dyadic lattice of tiles: on an axis, tile i at exponent e covers i 2^e to (i + 1) 2^e, and its points lie in the
// middle of POINTS equal parts. All of these numbers are exact in double precision.

export const POINTS = 128;
const ROUNDINGS = 64; // neighbouring points are at least so many roundings apart
const TILE_PIXELS = 240;

// Whether an interval has a value, and the value at a share of it.
/** @type {(value: number, interval: Interval) => boolean} */
export const isWithin = (value, [low, high]) => low <= value && value <= high;
/** @type {(part: Interval, whole: Interval) => boolean} */
export const isPart = ([low, high], whole) => isWithin(low, whole) && isWithin(high, whole);
/** @type {(interval: Interval, share: number) => number} */
export const along = ([low, high], share) => low + share * (high - low);

const binade = (value) => {
  let exponent = Math.floor(Math.log2(value));
  if (2 ** exponent > value) exponent -= 1;
  return exponent;
};

// The smallest exponent whose points double precision separates at values up to `largest`.
const finest = (largest) => binade(largest) - 52 + Math.log2(ROUNDINGS) + Math.log2(POINTS);

// The exponent for which a tile has about TILE_PIXELS pixels and fits into a domain, and whether double precision
// forbids it.
/** @param {Interval} interval  @param {number} pixels  @param {Interval} domain */
export function exponentFor([low, high], pixels, [least, most]) {
  const wanted = Math.min(Math.round(Math.log2(((high - low) * TILE_PIXELS) / pixels)), Math.log2(most - least));
  const end = finest(Math.max(Math.abs(low), Math.abs(high)));
  return { exponent: Math.max(wanted, end), ended: wanted < end };
}

// The numbers of the tiles that an interval meets, inside a domain.
/** @param {Interval} interval  @param {number} exponent  @param {Interval} domain */
export function indices([low, high], exponent, [least, most]) {
  const size = 2 ** exponent;
  const first = Math.max(Math.ceil(least / size), Math.floor(low / size));
  const last = Math.min(Math.floor(most / size), Math.ceil(high / size)) - 1;
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) => first + k);
}

/** @type {(index: number, exponent: number) => Interval} */
export const bounds = (index, exponent) => [index * 2 ** exponent, (index + 1) * 2 ** exponent];

// The values of a tile's points as a range of the API.
/** @returns {PointValues} */
export function range(index, exponent, points) {
  const [start, stop] = bounds(index, exponent);
  const half = 2 ** exponent / points / 2;
  return { start: start + half, stop: stop - half, points };
}

// The points of the lattice in an interval, inside a domain, as a range of the API; of more than `limit` every second
// one, or every fourth, and so on.
/** @param {Interval} interval  @param {number} exponent  @param {Interval} domain  @returns {PointValues} */
export function pointsOf([low, high], exponent, [least, most], limit = Infinity) {
  const step = 2 ** exponent / POINTS;
  const first = Math.ceil(Math.max(low, least) / step - 0.5);
  const last = Math.floor(Math.min(high, most) / step - 0.5);
  let every = 1;
  while ((last - first) / every + 1 > limit) every *= 2;
  const count = Math.floor((last - first) / every) + 1;
  const value = (k) => (k + 0.5) * step;
  return { start: value(first), stop: value(first + (count - 1) * every), points: count };
}

// The points of a window of its own, in the middle of POINTS equal parts.
/** @param {Interval} interval  @returns {PointValues} */
export function partsOf([low, high]) {
  const half = (high - low) / POINTS / 2;
  return { start: low + half, stop: high - half, points: POINTS };
}

// The tile that contains a tile, some levels up.
export const ancestor = ({ ex, ey, i, j }, levels) => ({
  ex: ex + levels,
  ey: ey + levels,
  i: Math.floor(i / 2 ** levels),
  j: Math.floor(j / 2 ** levels),
});

// The tiles of a window, the nearest to `centre` first.
/** @param {View} view  @param {number} ex  @param {number} ey  @param {Place} centre  @param {View} domains */
export function tilesOf({ x, y }, ex, ey, centre, domains) {
  const tiles = indices(y, ey, domains.y).flatMap((j) => indices(x, ex, domains.x).map((i) => ({ ex, ey, i, j })));
  const distance = ({ i, j }) => Math.hypot(i + 0.5 - centre.x / 2 ** ex, j + 0.5 - centre.y / 2 ** ey);
  return tiles.sort((tile, other) => distance(tile) - distance(other));
}
