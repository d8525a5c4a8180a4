// Small line charts as SVG.
import { drawnAxes, layout, path, scales } from "./axes.js";
import { drawing } from "./dom.js";
import { ticks, toRead } from "./ticks.js";

const SIZE = { width: 320, height: 200 };
const MARGIN = { left: 62, right: 14, top: 8, bottom: 36 };
const SMALL = { left: 44, right: 12, top: 6, bottom: 32 };
const FONT = 11; // as in the style sheet
const GAP = 14; // beside the texts of an axis
const SMALLEST_BAND = 4;
const ROUND_OFF = 1e-9; // share of values below which their differences say nothing

export function extent(values, share = 0.05) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value === null) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const isFlat = high - low <= ROUND_OFF * Math.max(Math.abs(low), Math.abs(high));
  const margin = isFlat ? 0.5 * Math.abs(high) || 1 : share * (high - low);
  return [low - margin, high + margin];
}

const pen = new OffscreenCanvas(1, 1).getContext("2d");
pen.font = `${FONT}px system-ui, sans-serif`; // as in the style sheet
const lengthOf = (text) => pen.measureText(text).width;

// `series` are { x, y, kind }, lines; `dots` { x, y, kind, text }; `bars` { x } or { y }, straight lines across the
// chart. `kind` is the class that the style sheet knows. `image` is the address of a picture that fills the axes. With
// `equal` both axes have one scale.
export function chart({
  title,
  x,
  y,
  names,
  size = SIZE,
  series = [],
  dots = [],
  bars = [],
  image = null,
  equal = false,
}) {
  const { width } = size;
  const usual = size === SIZE ? MARGIN : SMALL;
  const longest = (ends, count) => Math.max(...ticks(ends, count).marks.map(({ text }) => lengthOf(text)));
  const most = { x: width / 64, y: size.height / 32 };
  const margin = { ...usual, left: Math.max(usual.left, FONT + GAP + longest(y, most.y)) };
  most.x = Math.min(most.x, (width - margin.left - margin.right) / (longest(x, most.x) + GAP));
  const height = equal ? width - margin.left - margin.right + margin.top + margin.bottom : size.height;
  const right = width - margin.right;
  const bottom = height - margin.bottom;
  const box = { left: margin.left, right, top: margin.top, bottom };
  const { px, py } = scales({ x, y }, box);
  const frame = { x: margin.left, y: margin.top, width: right - margin.left, height: bottom - margin.top };
  const at = (value) => value.toFixed(1);
  const line = (x1, y1, x2, y2, kind) =>
    drawing("line", { x1: at(x1), y1: at(y1), x2: at(x2), y2: at(y2), class: kind });
  const axes = layout({
    view: { x, y },
    frame: box,
    names,
    places: {
      x: { x: (margin.left + right) / 2, y: bottom + margin.bottom - 8 },
      y: { x: 8, y: (margin.top + bottom) / 2 },
    },
    gaps: { x: 12, y: 6 },
    most,
    font: FONT,
    measure: lengthOf,
  });
  // names and numbers stay inside, narrower where they are too long
  for (const text of axes.texts.filter(({ anchor }) => anchor === "middle")) {
    const [along, room] = text.turned ? ["y", height] : ["x", width];
    text.length = Math.min(lengthOf(text.text), room);
    text[along] = Math.min(Math.max(text[along], text.length / 2), room - text.length / 2);
  }
  return drawing(
    "svg",
    { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": title, class: "chart" },
    ...(image ? [drawing("image", { ...frame, href: image, preserveAspectRatio: "none" })] : []),
    drawing("rect", { ...frame, class: "frame" }),
    ...bars.map((bar) =>
      "x" in bar
        ? line(px(bar.x), margin.top, px(bar.x), bottom, bar.kind)
        : line(margin.left, py(bar.y), right, py(bar.y), bar.kind),
    ),
    ...series.map((curve) => drawing("path", { d: path(curve, { px, py }), class: curve.kind })),
    ...dots.map((dot) =>
      drawing(
        "circle",
        { cx: at(px(dot.x)), cy: at(py(dot.y)), r: 3.5, class: dot.kind },
        ...(dot.text ? [drawing("title", {}, dot.text)] : []),
      ),
    ),
    ...drawnAxes(axes),
  );
}

// The frame of a chart in its own lengths.
function frameOf(svg) {
  const frame = svg.querySelector(".frame");
  const [left, top, width, height] = ["x", "y", "width", "height"].map((name) => Number(frame.getAttribute(name)));
  return { frame, left, top, width, height, right: left + width, bottom: top + height };
}

const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] };

// Lets a point of the picture in a chart be pressed, or be found with arrow keys and taken with Enter; calls `moved` and
// `chosen` with its column, from the left, and its row, from below.
export function onPick(svg, columns, rows, { moved, chosen }) {
  const { frame, left, top, width, height } = frameOf(svg);
  const mark = drawing("path", { class: "mark" });
  svg.append(mark);
  let at = [columns >> 1, rows >> 1];
  const go = (...to) => {
    at = to.map((place, k) => Math.min((k ? rows : columns) - 1, Math.max(0, Math.floor(place))));
    const x = left + ((at[0] + 0.5) / columns) * width;
    const y = top + height - ((at[1] + 0.5) / rows) * height;
    mark.setAttribute("d", `M${x} ${top}v${height}M${left} ${y}h${width}`);
    moved(...at);
  };
  svg.setAttribute("tabindex", "0");
  svg.setAttribute("role", "application");
  svg.querySelector("image").addEventListener("click", ({ clientX, clientY }) => {
    const box = frame.getBoundingClientRect();
    go(((clientX - box.left) / box.width) * columns, ((box.bottom - clientY) / box.height) * rows);
    chosen(...at);
  });
  svg.addEventListener("keydown", (event) => {
    const step = STEPS[event.key];
    if (!step && event.key !== "Enter") return null;
    event.preventDefault();
    if (!step) return chosen(...at);
    svg.scrollIntoView({ block: "nearest" });
    return go(...at.map((place, k) => place + step[k]));
  });
}

// Lets the points of a chart over `view`, { x, y }, be read in their order: the nearest one to the pointer, or the next
// one by arrow keys. `read` is called with its number.
export function onRead(svg, view, points, read) {
  const frame = frameOf(svg);
  const { px, py } = scales(view, frame);
  const places = points.map(({ x, y }) => ({ x: px(x), y: py(y) }));
  const dot = drawing("circle", { r: 4, class: "read" });
  let at = null;
  const go = (k) => {
    at = Math.min(places.length - 1, Math.max(0, k));
    dot.setAttribute("cx", places[at].x);
    dot.setAttribute("cy", places[at].y);
    svg.append(dot);
    read(at);
  };
  svg.setAttribute("tabindex", "0");
  svg.setAttribute("role", "application");
  const follow = ({ clientX, clientY }) => {
    const box = frame.frame.getBoundingClientRect();
    const x = frame.left + ((clientX - box.left) / box.width) * frame.width;
    const y = frame.top + ((clientY - box.top) / box.height) * frame.height;
    const apart = places.map((place) => Math.hypot(place.x - x, place.y - y));
    go(apart.indexOf(Math.min(...apart)));
  };
  svg.addEventListener("pointermove", follow);
  svg.addEventListener("pointerdown", follow);
  svg.addEventListener("keydown", (event) => {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    go(at === null ? 0 : at + (step[0] || step[1]));
  });
}

// Calls `chosen` with the two values of x between which one drags over a chart, the smaller first.
export function onDrag(svg, x, chosen) {
  const { left: start, top, width, height } = frameOf(svg);
  const band = drawing("rect", { y: top, height, class: "band" });
  const place = (event) => {
    const box = svg.getBoundingClientRect();
    const at = ((event.clientX - box.left) / box.width) * SIZE.width;
    return Math.min(start + width, Math.max(start, at));
  };
  const value = (at) => x[0] + ((at - start) / width) * (x[1] - x[0]);
  let from = null;
  const ends = (event) => [from, place(event)].sort((a, b) => a - b);
  svg.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    from = place(event);
    svg.setPointerCapture(event.pointerId);
    svg.append(band);
  });
  svg.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const [left, right] = ends(event);
    band.setAttribute("x", left);
    band.setAttribute("width", right - left);
  });
  svg.addEventListener("pointercancel", () => {
    from = null;
    band.remove();
  });
  svg.addEventListener("pointerup", (event) => {
    if (from === null) return;
    const [left, right] = ends(event);
    from = null;
    band.remove();
    if (right - left > SMALLEST_BAND) chosen(value(left), value(right));
  });
}

// Multipliers in the complex plane, with the unit circle.
export function circle(multipliers, size) {
  const reach = 1.1 * Math.max(1, ...multipliers.flat().map(Math.abs));
  const angles = Array.from({ length: 181 }, (_, k) => (k * Math.PI) / 90);
  return chart({
    title: "Multipliers of the orbit on the complex plane, with the unit circle",
    size,
    x: [-reach, reach],
    y: [-reach, reach],
    equal: true,
    names: { x: "real part", y: "imaginary part" },
    series: [{ x: angles.map(Math.cos), y: angles.map(Math.sin), kind: "circle" }],
    dots: multipliers.map(([re, im]) => ({
      x: re,
      y: im,
      kind: Math.hypot(re, im) < 1 ? "inside" : "outside",
      text: `${toRead(re)} ${im < 0 ? "−" : "+"} ${toRead(Math.abs(im))} i, modulus ${toRead(Math.hypot(re, im))}`,
    })),
  });
}
