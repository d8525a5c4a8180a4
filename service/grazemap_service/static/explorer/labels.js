// Names of motions, and their colours: the same for a label in every tile, view and session.

// What a preview, which looks for periodic motions only, leaves open.
export const OPEN = "not decided yet";

const count = (number) => (number === -2 ? "∞" : number < 0 ? `(${number})` : `${number}`);

export const labelOf = (period, right, left) => `${period}-${count(right)}r-${count(left)}l`;

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

// Colours of labels and of values. Motions that the palette does not name never have the colour of one of period 1,
// which have the largest regions.
export class Colours {
  #named;
  #free;
  #known = new Map();

  constructor(palette) {
    this.palette = palette;
    this.#named = { ...palette.kinds, [OPEN]: palette.kinds.unresolved, ...palette.motions };
    const frequent = Object.entries(palette.motions)
      .filter(([label]) => label.startsWith("1-"))
      .map(([, colour]) => colour);
    this.#free = [...Object.values(palette.motions), ...palette["other motions"]].filter(
      (colour) => !frequent.includes(colour),
    );
  }

  of(label) {
    return this.#named[label] ?? this.#free[crc32(label) % this.#free.length];
  }

  channels(label) {
    if (!this.#known.has(label)) this.#known.set(label, channels(this.of(label)));
    return this.#known.get(label);
  }
}

// Ramps that colour-blind people tell apart: cividis (Nunez et al. 2018), and blue to red through white.
const CIVIDIS = ["#00224E", "#35456C", "#666970", "#948E77", "#C8B866", "#FEE838"].map(channels);
const DIVERGING = ["#053061", "#4393C3", "#F7F7F7", "#D6604D", "#67001F"].map(channels);

// The colour of a share from 0 to 1 on a ramp.
export function onRamp(diverging, share) {
  const ramp = diverging ? DIVERGING : CIVIDIS;
  const place = Math.min(1, Math.max(0, share)) * (ramp.length - 1);
  const low = Math.min(ramp.length - 2, Math.floor(place));
  const part = place - low;
  return ramp[low].map((value, k) => Math.round(value + part * (ramp[low + 1][k] - value)));
}
