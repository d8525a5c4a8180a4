// Names of motions, and their colours.

// What a preview, which looks for periodic motions only, leaves open.
export const OPEN = "not decided yet";

const count = (number) => (number === -2 ? "∞" : number < 0 ? `(${number})` : `${number}`);

export const labelOf = (period, right, left) => `${period}-${count(right)}r-${count(left)}l`;

// The motion in which no stop is touched, of one period.
export const FREE = labelOf(1, -1, -1);

// Whether no stop is touched in a motion of this name.
export const isFree = (label) => label.endsWith("-(-1)r-(-1)l");

// The names of attractors, of which those of one name are numbered from the second on.
export const numbered = (names) =>
  names.map((name, k) => {
    const number = names.slice(0, k).filter((other) => other === name).length;
    return number ? `${name}, ${number + 1}` : name;
  });

// CRC-32 of a text, as in the SDK's pictures.
function crc32(text) {
  let crc = -1;
  for (const byte of new TextEncoder().encode(text)) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

const channels = (colour) => [1, 3, 5].map((start) => Number.parseInt(colour.slice(start, start + 2), 16));

export const NAMED = 24; // labels that the legend names
const LARGEST = 3; // labels that choose before the others
const STRIPED = 8; // ways in which those are striped that it does not

const DIRECTIONS = [
  { across: 1, up: 1, angle: "45deg" },
  { across: 1, up: -1, angle: "-45deg" },
  { across: 0, up: 1, angle: "0deg" },
  { across: 1, up: 0, angle: "90deg" },
];
const CLOSEST = 4; // points between stripes
const STEP = 2; // by which they are farther apart in every further round of directions

// What a label looks like: a colour, and stripes; hatching 0 has none.
class Look {
  constructor(colour, hatching = 0) {
    this.colour = colour;
    this.hatching = hatching;
    this.text = `${colour} ${hatching}`;
    this.channels = channels(colour);
    const isDark = Math.max(...this.channels) < 160;
    this.stripe = this.channels.map((value) => Math.round(isDark ? (value + 255) / 2 : value / 2));
    this.direction = DIRECTIONS[(hatching - 1) % DIRECTIONS.length];
    this.apart = CLOSEST + STEP * Math.floor((hatching - 1) / DIRECTIONS.length);
  }

  // The colour of a point of a map.
  at(row, column) {
    if (!this.hatching) return this.channels;
    return (column * this.direction.across + row * this.direction.up) % this.apart ? this.channels : this.stripe;
  }

  // The stripes as a background of CSS.
  get image() {
    if (!this.hatching) return "none";
    const { angle } = this.direction;
    return `repeating-linear-gradient(${angle}, rgb(${this.stripe}) 0 1.5px, transparent 1.5px ${this.apart}px)`;
  }
}

const made = new Map();
function lookOf(colour, hatching = 0) {
  const name = `${colour} ${hatching}`;
  if (!made.has(name)) made.set(name, new Look(colour, hatching));
  return made.get(name);
}

// Motions with a short period and few impacts come first, and what has no numbers last.
const simplestFirst = (label, other) => {
  const numbersOf = (text) => (text.match(/\d+|∞/g) ?? ["∞"]).map((part) => (part === "∞" ? Infinity : Number(part)));
  const [size, otherSize] = [label, other].map(numbersOf);
  const k = size.findIndex((number, place) => number !== otherSize[place]);
  return k < 0 ? (label < other ? -1 : 1) : size[k] - (otherSize[k] ?? 0);
};

// The looks of labels. No two of those that the legend names in a view look the same, and no other label looks like one
// of them. A motion that the palette names always has its colour. Others have the colour that the label gives or the next
// one that is free, one of a motion of period 1 only where no other is left, and then stripes. A motion that had
// a colour chooses first, and takes it again; then come the largest shares, and then simple motions. What the legend
// names before and after a change of the view keeps its look.
export class Colours {
  #named;
  #free;
  #frequent;
  #looks = new Map();
  #shown = [];
  #had = new Map(); // the last looks without stripes
  version = 0; // changes where a label looks otherwise than before

  constructor(palette) {
    this.palette = palette;
    this.#named = { ...palette.kinds, [OPEN]: palette.kinds.other, ...palette.motions };
    const isFrequent = (label) => label.startsWith("1-");
    const motions = Object.entries(palette.motions);
    const colours = (some) => some.map(([, colour]) => colour);
    this.#frequent = colours(motions.filter(([label]) => isFrequent(label)));
    this.#free = [...colours(motions.filter(([label]) => !isFrequent(label))), ...palette["other motions"]];
  }

  // The look without stripes that a label had when it was named, unless its name gives its colour.
  #before(label) {
    return this.#named[label] ? null : this.#had.get(label);
  }

  // The looks that a label may have, the first ones first.
  *#candidates(label) {
    const before = this.#before(label);
    if (before) yield before;
    const first = crc32(label) % this.#free.length;
    const own = this.#named[label];
    const colours = own ? [own] : [...this.#free.slice(first), ...this.#free.slice(0, first)];
    for (const colour of own ? colours : [...colours, ...this.#frequent]) yield lookOf(colour);
    for (let hatching = 1; ; hatching++) for (const colour of colours) yield lookOf(colour, hatching);
  }

  // The look, with stripes, of a label that the legend does not name.
  *#striped(label) {
    const number = crc32(label);
    for (let k = number % STRIPED; ; k++) yield lookOf(this.#free[number % this.#free.length], 1 + k);
  }

  // The looks of different labels that are seen together, the largest share first, in a map; the legend names so many.
  // Labels with a `given` look have it, and no other label has one of these.
  together(labels, most = NAMED, given = new Map()) {
    const taken = new Set([...given.values()].map(({ text }) => text));
    const looks = new Map(labels.filter((label) => given.has(label)).map((label) => [label, given.get(label)]));
    const give = (label, candidates) => {
      for (const look of candidates) {
        if (taken.has(look.text)) continue;
        looks.set(label, look);
        return look.text;
      }
      return null;
    };
    const seen = new Set(labels);
    const named = Object.keys(this.#named).filter((label) => seen.has(label) && !looks.has(label));
    const shown = labels.slice(0, most);
    const isKnown = (label) => Boolean(this.#before(label));
    const fresh = shown.filter((label) => !isKnown(label));
    const first = [...shown.filter(isKnown), ...fresh.slice(0, LARGEST), ...fresh.slice(LARGEST).sort(simplestFirst)];
    for (const label of named) taken.add(give(label, this.#candidates(label)));
    for (const label of first) if (!looks.has(label)) taken.add(give(label, this.#candidates(label)));
    for (const label of labels) if (!looks.has(label)) give(label, this.#striped(label));
    return looks;
  }

  // Takes note of the labels in a view, the largest share first.
  see(labels) {
    const kept = this.#kept(labels);
    this.#shown = labels;
    for (const [label, look] of this.together(labels, NAMED, kept)) {
      const before = this.#looks.get(label);
      if (before && before.text !== look.text) this.version += 1;
      this.#looks.set(label, look);
      if (!look.hatching) this.#had.set(label, look);
    }
  }

  // The looks that the legend's labels keep: not those that belong to another label by its name.
  #kept(labels) {
    const named = labels.map((label) => this.#named[label]);
    const before = new Set(this.#shown.slice(0, NAMED));
    const staying = labels.slice(0, NAMED).filter((label) => before.has(label) && !this.#named[label]);
    const looks = staying.map((label) => [label, this.#looks.get(label)]);
    return new Map(looks.filter(([, { colour, hatching }]) => hatching || !named.includes(colour)));
  }

  // The looks of labels that are shown beside the view: those of its labels are as there.
  beside(labels) {
    return this.together(labels, Infinity, new Map(this.#shown.map((label) => [label, this.of(label)])));
  }

  of(label) {
    if (!this.#looks.has(label)) this.#looks.set(label, this.beside([label]).get(label));
    return this.#looks.get(label);
  }
}

// Ramps that colour-blind people tell apart: cividis (Nunez et al. 2018), and blue to red through white.
const CIVIDIS = ["#00224E", "#35456C", "#666970", "#948E77", "#C8B866", "#FEE838"];
const DIVERGING = ["#053061", "#4393C3", "#F7F7F7", "#D6604D", "#67001F"];

// The colours of a ramp, as far apart as one another.
export const rampOf = (diverging) => (diverging ? DIVERGING : CIVIDIS);

// The colour of a share from 0 to 1 on a ramp.
/** @returns {[number, number, number]} */
export function onRamp(diverging, share) {
  const ramp = rampOf(diverging).map(channels);
  const place = Math.min(1, Math.max(0, share)) * (ramp.length - 1);
  const low = Math.min(ramp.length - 2, Math.floor(place));
  const part = place - low;
  const mixed = (k) => Math.round(ramp[low][k] + part * (ramp[low + 1][k] - ramp[low][k]));
  return [mixed(0), mixed(1), mixed(2)];
}
