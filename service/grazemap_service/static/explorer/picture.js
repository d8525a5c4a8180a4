// The view as a picture of its own: the plane with its axes, curves and marks, the legend of what is in sight, the
// machine, and a caption.
import { drawnAxes, layout, path, scales } from "./axes.js";
import { drawing, element } from "./dom.js";
import { rampOf } from "./labels.js";
import { percent } from "./layers.js";
import { complete } from "./parameters.js";
import { DRAWN } from "./plane.js";
import { sketch } from "./sketch.js";

const WIDTH = 960;
const MARGIN = 14;
const SIDE = 72; // of the names and texts on the left
const BELOW = 52;
const COLUMN = 236; // of the legend
const SKETCH = { width: 240, height: 75 };
const TALLEST = 1.4; // heights of the plane over its width
const FONT = 12;
const LINE = 17;
const LETTER = 0.56; // of the size of letters, about the width of one
const WIDE_LETTER = 0.72; // in a link
const SWATCH = 11;
const INK = "#1a1a1a";
const SOFT = "#55585c";
const ARCS = [1, -1].map((way) => `a${DRAWN.circle} ${DRAWN.circle} 0 1 0 ${2 * way * DRAWN.circle} 0`);
const SHAPES = {
  circle: `M-${DRAWN.circle} 0${ARCS.join("")}z`,
  diamond: `M0 -${DRAWN.diamond}L${DRAWN.diamond} 0L0 ${DRAWN.diamond}L-${DRAWN.diamond} 0z`,
};
const SCALE = 2; // pixels of the PNG over lengths of the drawing

const text = (content, x, y, attributes = {}) =>
  drawing("text", { x, y, "font-size": FONT, fill: INK, ...attributes }, content);

// The lines into which a text is broken, at spaces or, of a long word, anywhere.
export function broken(content, width, size = FONT) {
  const lengthIn = (letter) => Math.max(8, Math.floor(width / (letter * size)));
  const most = lengthIn(LETTER);
  const piece = new RegExp(`.{1,${lengthIn(WIDE_LETTER)}}`, "g");
  const words = content.split(" ").flatMap((word) => (word.length > most ? word.match(piece) : word || []));
  const lines = [];
  for (const word of words) {
    const last = lines.at(-1);
    if (last !== undefined && last.length + 1 + word.length <= most) lines[lines.length - 1] = `${last} ${word}`;
    else lines.push(word);
  }
  return lines;
}

// A column of texts and drawings, one below the other, from a place on.
class Column {
  parts = [];

  constructor(x, y, width) {
    this.x = x;
    this.y = y;
    this.width = width;
  }

  /** @param {string} content  @param {{ indent?: number, [attribute: string]: any }} [how] */
  write(content, { indent = 0, ...attributes } = {}) {
    for (const line of broken(content, this.width - indent)) {
      this.parts.push(text(line, this.x + indent, this.y + FONT, attributes));
      this.y += LINE;
    }
  }

  put(height, ...parts) {
    this.parts.push(...parts);
    this.y += height;
  }
}

// The square of a look, with its stripes.
function square(look, x, y) {
  const place = { x, y: y + 1, width: SWATCH, height: SWATCH };
  if (!look.hatching) return drawing("rect", { ...place, fill: look.colour });
  const canvas = element("canvas", { width: SWATCH, height: SWATCH });
  const pen = canvas.getContext("2d");
  const image = pen.createImageData(SWATCH, SWATCH);
  for (let k = 0; k < SWATCH ** 2; k++) image.data.set([...look.at(Math.floor(k / SWATCH), k % SWATCH), 255], 4 * k);
  pen.putImageData(image, 0, 0);
  return drawing("image", { ...place, href: canvas.toDataURL(), "image-rendering": "pixelated" });
}

// A mark of a shape, or a square, about the middle of a square of the legend.
const symbol = (shape, colour, x, y) =>
  SHAPES[shape]
    ? drawing("path", {
        d: SHAPES[shape],
        transform: `translate(${x + SWATCH / 2} ${y + 1 + SWATCH / 2})`,
        fill: colour,
      })
    : square({ colour }, x, y);

function writeLegend(column, { motions, ramp, key, meanings }, lookOf) {
  if (ramp) {
    const stops = rampOf(ramp.diverging).map((colour, k, { length }) =>
      drawing("stop", { offset: k / (length - 1), "stop-color": colour }),
    );
    const bar = { x: column.x, y: column.y, width: column.width, height: SWATCH, fill: "url(#ramp)" };
    column.put(LINE - 2, drawing("linearGradient", { id: "ramp" }, ...stops), drawing("rect", bar));
    const places = ["start", "middle", "end"].map((anchor, k) => ({ x: column.x + (k / 2) * column.width, anchor }));
    const ends = ramp.ends.map((end, k) =>
      text(end, places[k].x, column.y + FONT, { "text-anchor": places[k].anchor, fill: SOFT }),
    );
    column.put(ends.length ? LINE : 0, ...ends);
    column.write(ramp.text);
    column.write(ramp.missing, { fill: SOFT });
  }
  for (const { label, share } of motions) {
    column.put(
      0,
      square(lookOf(label), column.x, column.y),
      share && text(percent(share), column.x + column.width, column.y + FONT, { "text-anchor": "end", fill: SOFT }),
    );
    column.write(label, { indent: 1.6 * SWATCH });
  }
  if (key) column.write(key, { fill: SOFT });
  column.y += LINE / 2;
  for (const { text: meaning, before, numbered, shape } of meanings) {
    column.put(0, ...before.map((colour) => symbol(shape, colour, column.x, column.y)));
    column.write(meaning, { indent: before.length ? 1.6 * SWATCH : 0 });
    const apart = 2.4 * SWATCH;
    const beside = numbered.flatMap((colour, k) => [
      symbol(shape, colour, column.x + k * apart, column.y),
      text(k + 1, column.x + k * apart + 1.2 * SWATCH, column.y + FONT),
    ]);
    column.put(numbered.length ? LINE : 0, ...beside);
  }
}

const OF_SKETCH = {
  polyline: { fill: "none", stroke: INK },
  rect: { fill: "none", stroke: INK },
  text: { "text-anchor": "middle", "font-size": 11, fill: INK },
  mass: { fill: "#ffffff" },
  frame: { stroke: SOFT, "stroke-dasharray": "4 3" },
  wall: { "stroke-width": 3 },
  stop: { "stroke-width": 3, stroke: "#a3161f" },
};

// The drawing of a machine, if there is room for one, and what it shows in words.
function machineOf(machine) {
  const parts = sketch(machine);
  const words = parts.at(-1);
  const [drawn] = parts;
  if (drawn === words) return { picture: null, words };
  for (const part of drawn.children)
    for (const name of [part.tagName, part.getAttribute("class")])
      for (const [key, value] of Object.entries(OF_SKETCH[name] ?? {})) part.setAttribute(key, value);
  return { picture: drawn, words };
}

// The numbers of a machine, a text for each field.
function numbersOf({ oscillator, stops, left }) {
  const { units, ...fields } = { ...oscillator, ...complete(oscillator) }; // in the order of its own
  const plain = (value) =>
    Array.isArray(value) && !value.some((part) => typeof part === "object")
      ? `[${value.join(", ")}]`
      : JSON.stringify(value);
  return [
    ...Object.entries(fields).map(([name, value]) => `${name} ${plain(value)}`),
    ...(stops === "unequal" ? [`clearance of the left stop ${left}`] : []),
    ...(units ? [`all in ${units}`] : []),
  ];
}

// The picture as an element of SVG. `view` is { x, y }, `inUnits(view)` the same in the units of the axes, `size`
// { width, height } of the plane, `image` the address of a picture of its tiles, `legend` what is in sight, `lookOf` the
// look of a motion, `caption` lines of text, and
// `link` what its description has.
export function picture({
  view,
  inUnits,
  size,
  image,
  lines,
  marks,
  at,
  names,
  legend,
  lookOf,
  machine,
  caption,
  link,
}) {
  const width = WIDTH - SIDE - COLUMN - 3 * MARGIN;
  const bottom = MARGIN + width * Math.min(TALLEST, size.height / size.width);
  const frame = { left: SIDE, right: SIDE + width, top: MARGIN, bottom };
  const { px, py } = scales(view, frame);
  const height = frame.bottom - frame.top;
  const box = { x: frame.left, y: frame.top, width, height };
  const centre = (frame.left + frame.right) / 2;
  const axes = layout({
    view: inUnits(view),
    frame,
    names,
    places: { x: { x: centre, y: frame.bottom + BELOW - 16 }, y: { x: MARGIN, y: frame.top + height / 2 } },
    gaps: { x: 14, y: 8 },
    most: { x: width / 90, y: Math.max(2, height / 55) },
    font: FONT,
  });
  const kindOf = ({ thin }) => (thin ? "thin" : "line");
  const stroke = (line, halo) => ({
    d: path(line, { px, py }),
    stroke: halo ? "#ffffff" : line.colour,
    "stroke-width": DRAWN[kindOf(line)] + (halo ? DRAWN.rim[kindOf(line)] : 0),
    ...(line.dashed && { "stroke-dasharray": "6 4" }),
  });
  const cross = at && `M${px(at.x) - 9} ${py(at.y)}h18M${px(at.x)} ${py(at.y) - 9}v18`;
  const beside = new Column(frame.right + 2 * MARGIN, frame.top, COLUMN);
  writeLegend(beside, legend, lookOf);
  const below = new Column(frame.left, frame.bottom + BELOW, frame.right - frame.left);
  caption.forEach((line) => below.write(line, { fill: SOFT }));
  below.y += LINE / 2;
  const { picture: machinePicture, words } = machineOf(machine);
  if (machinePicture) {
    const drawn = { x: below.x, y: below.y, width: SKETCH.width, height: SKETCH.height };
    for (const [name, value] of Object.entries(drawn)) machinePicture.setAttribute(name, value);
    below.parts.push(machinePicture);
  }
  const room = machinePicture ? SKETCH.width + 2 * MARGIN : 0;
  const ofMachine = new Column(below.x + room, below.y, below.width - room);
  ofMachine.write(words);
  ofMachine.write(`${numbersOf(machine).join("; ")}.`, { fill: SOFT });
  below.y = Math.max(ofMachine.y, below.y + (machinePicture ? SKETCH.height : 0));
  const tall = Math.ceil(Math.max(beside.y, below.y) + MARGIN);
  return drawing(
    "svg",
    {
      xmlns: "http://www.w3.org/2000/svg",
      viewBox: `0 0 ${WIDTH} ${tall}`,
      width: WIDTH,
      height: tall,
      "font-family": "system-ui, sans-serif",
      "font-size": FONT,
    },
    drawing("title", {}, "grazemap"),
    drawing("desc", {}, link),
    drawing("clipPath", { id: "frame" }, drawing("rect", box)),
    drawing("rect", { width: WIDTH, height: tall, fill: "#ffffff" }),
    ...(image
      ? [drawing("image", { ...box, href: image, preserveAspectRatio: "none", "image-rendering": "pixelated" })]
      : []),
    drawing(
      "g",
      { "clip-path": "url(#frame)", fill: "none" },
      ...lines.flatMap((line) => [
        drawing("path", stroke(line, true)),
        drawing("path", stroke(line, false), drawing("title", {}, line.text)),
      ]),
      ...marks.map((mark) =>
        drawing(
          "path",
          {
            d: SHAPES[mark.shape === "circle" ? "circle" : "diamond"],
            transform: `translate(${px(mark.x).toFixed(1)} ${py(mark.y).toFixed(1)})`,
            fill: mark.colour,
            stroke: "#ffffff",
          },
          drawing("title", {}, mark.text),
        ),
      ),
      ...(cross
        ? [
            drawing("path", { d: cross, stroke: "#ffffff", "stroke-width": 4 }),
            drawing("path", { d: cross, stroke: "#000000", "stroke-width": 1.5 }),
          ]
        : []),
    ),
    drawing("rect", { ...box, fill: "none", stroke: INK }),
    ...drawnAxes(axes, { "font-size": FONT, fill: INK }),
    ...beside.parts.filter(Boolean),
    ...below.parts,
    ...ofMachine.parts,
  );
}

export const asText = (svg) => new XMLSerializer().serializeToString(svg);

// The picture as a PNG.
export async function asPng(svg) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(asText(svg))}`;
  await image.decode();
  const canvas = element("canvas", {
    width: SCALE * svg.getAttribute("width"),
    height: SCALE * svg.getAttribute("height"),
  });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done));
}
