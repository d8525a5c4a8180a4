// What the colours of the plane mean: the motion, or a value of every point.
import { OPEN, isFree, onRamp } from "./labels.js";

// `field` is that of a map; `quantity`, or an SI unit, tells its unit; a map must be asked for `observables` and
// `policy`.
/** @type {Record<string, Layer>} */
export const LAYERS = {
  motion: { text: "Motion" },
  exponent: {
    text: "Lyapunov exponent",
    field: "lyapunov",
    unit: "per forcing period",
    diverging: true,
    missing: "it was not measured",
  },
  speed: {
    text: "Minimum impact speed",
    field: "least_impact_velocity",
    quantity: "velocity",
    missing: "the motion is not periodic, or not decided",
  },
  number: {
    text: "Number of motions",
    field: "motions_found",
    policy: "ensemble",
    isCount: true,
    missing: "no state was followed to a motion",
  },
};

// Whether a map of a policy has the values of a layer.
export const hasLayer = (policy, { policy: needed = policy }) => policy === needed;

// Adds a layer for each observable, { name, unit, description }, of the service's maps.
export function addObservables(observables) {
  for (const { name, unit, description } of observables) {
    const words = name.replaceAll("_", " ");
    LAYERS[name] = {
      text: words[0].toUpperCase() + words.slice(1),
      field: name,
      quantity: unit,
      observables: [name],
      description,
      missing: "the motion has no such value, or is not decided",
    };
  }
}

const UNVERIFIED_SHADE = 0.72;
const SHARE_IN_RANGE = 0.98;
const WELL = 0.4; // of a ramp, at least, are values
const SHADES = 256; // of a ramp
const FAR = 0.5;
export const PALE = 0.35; // of the colours of motions, until the values of a layer come
const ROUND = [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10]; // times a power of ten, where a ramp may end
const MOST_COUNTED = 1024; // points of a window, along a side, that are counted

// The values between which a layer's ramp runs for these tiles, and whether some are beyond; null where they have none.
// The ramp `before` goes on where it shows them well.
/** @param {string} layer  @param {Tile[]} tiles */
export function rangeOf(layer, tiles, before = null) {
  const { field, diverging, isCount } = LAYERS[layer];
  const values = tiles
    .flatMap((tile) => (tile[field] ? [...tile[field].filter((_, k) => k % 37 === 0)] : []))
    .filter(Number.isFinite)
    .map((value) => (diverging ? Math.abs(value) : value))
    .sort((a, b) => a - b);
  if (!values.length) return null;
  const at = (share) => values[Math.floor(share * (values.length - 1))];
  const largest = values.at(-1);
  if (isCount) return [0, largest, false];
  const most = at(SHARE_IN_RANGE) || largest || 1;
  const least = at(1 - SHARE_IN_RANGE);
  const isFar = !diverging && least > FAR * most && most > least; // from 0, which the ramp then leaves out
  const power = 10 ** Math.floor(Math.log10(isFar ? most - least : most));
  if (isFar) {
    const low = Math.floor(least / power) * power;
    const high = Math.ceil((most / power) * (1 - 1e-9)) * power;
    return [low, high, largest > high];
  }
  const goesOn = before && before[0] <= 0 && most <= before[1] && most > WELL * before[1];
  const round = goesOn ? before[1] : ROUND.find((factor) => factor * power >= most * (1 - 1e-9)) * power;
  return [diverging ? -round : 0, round, largest > round];
}

// What points without a value of a layer show: whether there are some of a motion without impacts, and previews.
/** @param {string} layer  @param {Tile[]} tiles */
export function withoutValues(layer, tiles) {
  const { field } = LAYERS[layer];
  const verified = tiles.filter(({ preview }) => !preview);
  const isOpen = (/** @type {Tile} */ { labels, motion, [field]: values }) => {
    const free = labels.findIndex(isFree); // at most one
    return free >= 0 && motion.some((label, k) => label === free && !Number.isFinite(values?.[k]));
  };
  return { isCream: verified.some(isOpen), isPale: verified.length < tiles.length };
}

const isPeriodic = (label) => /^\d/.test(label); // other motions are named by their kind

// A colour as a pixel of image data in one number, as browsers run on little-endian processors.
const packed = ([red, green, blue], shade = 1) =>
  ((255 << 24) | (Math.round(shade * blue) << 16) | (Math.round(shade * green) << 8) | Math.round(shade * red)) >>> 0;

const HIDDEN = packed([128, 128, 128]);
const HIDDEN_APART = 6; // points between these lines

// The pixel of each point: of a motion that is hidden, a grey line or none. Every other point of a periodic motion that is
// not verified is dark, but in previews, which are pale.
function ofMotions({ labels, motion, verified, preview }, hidden, colours) {
  const shades = [1, UNVERIFIED_SHADE];
  const looks = labels.map((label) => {
    if (hidden.has(label)) return null;
    const look = colours.of(label);
    const pixels = [look.channels, look.stripe].map((colour) => shades.map((shade) => packed(colour, shade)));
    return { look, pixels, isPeriodic: isPeriodic(label) };
  });
  return (k, row, column) => {
    const shown = looks[motion[k]];
    if (!shown) return (row + column) % HIDDEN_APART ? 0 : HIDDEN;
    const { look, pixels } = shown;
    const striped = look.hatching && look.at(row, column) !== look.channels ? 1 : 0;
    return pixels[striped][shown.isPeriodic && !preview && !verified[k] && (row + column) % 2 ? 1 : 0];
  };
}

const ramps = new Map(); // pixels of equal shares
function ramp(diverging) {
  if (!ramps.has(diverging))
    ramps.set(
      diverging,
      Uint32Array.from({ length: SHADES }, (_, k) => packed(onRamp(diverging, k / (SHADES - 1)))),
    );
  return ramps.get(diverging);
}

// Points without a value show their motion: pale in a preview, and in other tiles where it has no impacts; else they are grey.
function ofValues(tile, field, { diverging, range, colours }) {
  const values = tile[field];
  const others = tile.labels.map((label) => {
    if (!tile.preview) return packed(colours.of(isFree(label) ? label : OPEN).channels);
    return packed(colours.of(label).channels.map((value) => Math.round(255 - PALE * (255 - value))));
  });
  if (!values || !range) return (k) => others[tile.motion[k]];
  const pixels = ramp(diverging);
  const [low, high] = range;
  const place = (value) => Math.round(((value - low) / (high - low)) * (SHADES - 1));
  return (k) =>
    Number.isFinite(values[k]) ? pixels[Math.min(SHADES - 1, Math.max(0, place(values[k])))] : others[tile.motion[k]];
}

// Paints a tile on a canvas of one pixel a point.
/** @param {Tile} tile */
export function paint(tile, layer, { hidden, range, colours }) {
  const n = tile.points;
  const canvas = tile.image ?? new OffscreenCanvas(n, n);
  const pen = canvas.getContext("2d");
  const image = pen.createImageData(n, n);
  const pixels = new Uint32Array(image.data.buffer);
  const { field, diverging } = LAYERS[layer];
  const pixelOf = field ? ofValues(tile, field, { diverging, range, colours }) : ofMotions(tile, hidden, colours);
  for (let row = 0; row < n; row++)
    for (let column = 0; column < n; column++)
      pixels[(n - 1 - row) * n + column] = pixelOf(row * n + column, row, column);
  pen.putImageData(image, 0, 0);
  return canvas;
}

// The labels in a window with their shares, the largest first. Where tiles cover one another the last one counts.
/** @param {Tile[]} tiles  @param {View} window */
export function shares(tiles, { x, y }) {
  const step = (axis, [low, high]) => {
    const steps = tiles.map((tile) => (tile[axis][1] - tile[axis][0]) / tile.points);
    return Math.max((high - low) / MOST_COUNTED, Math.min(...steps));
  };
  const [dx, dy] = [step("x", x), step("y", y)];
  const [columns, rows] = [(x[1] - x[0]) / dx, (y[1] - y[0]) / dy].map((number) => Math.max(1, Math.round(number)));
  const labels = [...new Set(tiles.flatMap((tile) => tile.labels))];
  const numberOf = new Map(labels.map((label, number) => [label, number]));
  const seen = new Int32Array(columns * rows).fill(-1);
  for (const tile of tiles) {
    const { points, motion } = tile;
    const numbers = tile.labels.map((label) => numberOf.get(label));
    // the point of the tile that is nearest to each column or row, -1 beyond it
    const places = ([low, high], from, width, count) =>
      Int32Array.from({ length: count }, (_, k) => {
        const place = Math.floor(((from + (k + 0.5) * width - low) / (high - low)) * points);
        return place < points ? Math.max(-1, place) : -1;
      });
    const across = places(tile.x, x[0], dx, columns);
    places(tile.y, y[0], dy, rows).forEach((row, i) => {
      if (row < 0) return;
      for (let j = 0; j < columns; j++)
        if (across[j] >= 0) seen[i * columns + j] = numbers[motion[row * points + across[j]]];
    });
  }
  const counts = new Uint32Array(labels.length);
  let all = 0;
  for (const number of seen)
    if (number >= 0) {
      counts[number] += 1;
      all += 1;
    }
  return labels
    .map((label, number) => ({ label, share: counts[number] / all }))
    .filter(({ share }) => share > 0)
    .sort((motion, other) => other.share - motion.share);
}

export const percent = (share) => (share < 0.001 ? "< 0.1 %" : `${(100 * share).toFixed(1)} %`);

// A reason without what a client of the API would do about it.
export const withoutRemedy = (reason) => reason.replace(/\.? Remedy:.*/s, "");

// What the finest of the tiles says about a point of the plane, `at` its own point there; null where none has come.
/** @param {Tile[]} tiles  @param {number} x  @param {number} y */
export function reading(tiles, x, y) {
  const covers = ({ x: [left, right], y: [low, high] }) => left <= x && x < right && low <= y && y < high;
  const tile = tiles.findLast(covers);
  if (!tile) return null;
  const place = (value, [low, high]) =>
    Math.min(tile.points - 1, Math.floor(((value - low) / (high - low)) * tile.points));
  const k = place(y, tile.y) * tile.points + place(x, tile.x);
  return {
    label: tile.labels[tile.motion[k]],
    verified: Boolean(tile.verified[k]),
    sensitive: Boolean(tile.sensitive?.[k]),
    preview: tile.preview,
    reason: tile.reasons[tile.reason[k]],
    figures: Object.values(LAYERS).flatMap((layer) =>
      layer.field && Number.isFinite(tile[layer.field]?.[k]) ? [{ layer, value: tile[layer.field][k] }] : [],
    ),
    at: [
      tile.x[0] + ((place(x, tile.x) + 0.5) / tile.points) * (tile.x[1] - tile.x[0]),
      tile.y[0] + ((place(y, tile.y) + 0.5) / tile.points) * (tile.y[1] - tile.y[0]),
    ],
  };
}
