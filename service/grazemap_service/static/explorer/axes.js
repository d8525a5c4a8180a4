// The axes of a picture: their ticks, texts and names, laid out once, for a canvas or for SVG.
import { drawing } from "./dom.js";
import { axisName, ticks } from "./ticks.js";

const TICK = 4; // pixels of a tick beyond the frame
const BETWEEN = 5; // pixels between two texts of an axis
const APART = 8; // pixels between a text and a name on its line

// Lengths of values in a frame.
/** @param {View} view  @param {Box} frame */
export function scales({ x, y }, { left, right, top, bottom }) {
  return {
    px: (value) => left + ((value - x[0]) / (x[1] - x[0])) * (right - left),
    py: (value) => bottom - ((value - y[0]) / (y[1] - y[0])) * (bottom - top),
  };
}

// Lays out the axes of a `view`, { x, y }, whose picture fills a `frame`; the axes stand on the left and the lower edge
// of what is `clear` of the frame. `names` has the names, `places` where they stand, { x, y, anchor }; `gaps` are from
// the edges to the middle of the texts below, and to the end of those on the left; `font` is the size of letters,
// `measure` the length of a text, and `suffix` what follows the names. Gives { ticks, texts }: [x1, y1, x2, y2], and
// { text, x, y, anchor, turned }.
export function layout({ view, frame, clear = frame, names, suffix = "", places, gaps, most, font, measure = null }) {
  const { px, py } = scales(view, frame);
  const across = ticks(view.x, most.x);
  const up = ticks(view.y, most.y);
  const lengthOf = measure ?? ((text) => 0.6 * font * text.length);
  const text = (content, at, turned = false) => ({ text: content, anchor: "middle", ...at, turned });
  const name = { x: axisName(names.x, across) + suffix, y: axisName(names.y, up) + suffix };
  const line = clear.bottom + gaps.x;
  const isBeside = places.x.y === line; // the name stands at the end of the line of the texts
  const end = isBeside ? places.x.x - lengthOf(name.x) - APART : Infinity;
  let free = -Infinity; // where the text before ends
  const laid = { ticks: [], texts: [text(name.x, places.x), text(name.y, places.y, true)] };
  for (const { value, text: content } of across.marks) {
    const x = px(value);
    const half = lengthOf(content) / 2;
    const reach = isBeside ? half : 0;
    if (x - reach < clear.left - 1 || x + reach > end || x - half < free) continue;
    free = x + half + BETWEEN;
    laid.ticks.push([x, clear.bottom, x, clear.bottom + TICK]);
    laid.texts.push(text(content, { x, y: line }));
  }
  for (const { value, text: content } of up.marks) {
    const y = py(value);
    if (isBeside && (y < font || y > clear.bottom - font)) continue;
    laid.ticks.push([clear.left - TICK, y, clear.left, y]);
    laid.texts.push(text(content, { x: clear.left - gaps.y, y, anchor: "end" }));
  }
  return laid;
}

const ALIGN = { start: "left", middle: "center", end: "right" };

// Paints what was laid out, in the colour and font that the pen has.
export function paintAxes(pen, { ticks: strokes, texts }) {
  pen.textBaseline = "middle";
  for (const [x1, y1, x2, y2] of strokes)
    if (x1 === x2) pen.fillRect(x1 - 0.5, y1, 1, y2 - y1);
    else pen.fillRect(x1, y1 - 0.5, x2 - x1, 1);
  for (const { text, x, y, anchor, turned } of texts) {
    pen.save();
    pen.translate(x, y);
    if (turned) pen.rotate(-Math.PI / 2);
    pen.textAlign = ALIGN[anchor];
    pen.fillText(text, 0, 0);
    pen.restore();
  }
}

const short = (value) => Number(value.toFixed(1));

// What was laid out as elements of SVG; `attributes` are those of the texts.
export function drawnAxes({ ticks: strokes, texts }, attributes = {}) {
  return [
    ...strokes.map(([x1, y1, x2, y2]) =>
      drawing("line", { x1: short(x1), y1: short(y1), x2: short(x2), y2: short(y2), class: "tick", stroke: "#000" }),
    ),
    ...texts.map(({ text, x, y, anchor, turned, length }) =>
      drawing(
        "text",
        {
          x: short(x),
          y: short(y),
          "text-anchor": anchor,
          "dominant-baseline": "central",
          ...(length && { textLength: length, lengthAdjust: "spacingAndGlyphs" }),
          ...(turned && { transform: `rotate(-90 ${short(x)} ${short(y)})` }),
          ...attributes,
        },
        text,
      ),
    ),
  ];
}

// The d of an SVG path through points, of which null is a gap; `px` and `py` are lengths of values.
/** @param {{ x: number[], y: (number | null)[] }} line  @param {{ px: (x: number) => number, py: (y: number) => number }} scales */
export function path({ x, y }, { px, py }) {
  let drawn = "";
  let lifted = true;
  x.forEach((value, k) => {
    if (y[k] !== null) drawn += `${lifted ? "M" : "L"}${px(value).toFixed(1)} ${py(y[k]).toFixed(1)}`;
    lifted = y[k] === null;
  });
  return drawn;
}
