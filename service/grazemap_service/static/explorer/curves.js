// The curves and points over the plane: the grazing curve with its codimension-two points, and on request the
// bifurcation curves that leave it, and the borders of the regions with what explains them. Asked for by dyadic intervals,
// so that neighbouring views share them.
import { compute, isAborted } from "./api.js";
import { indices } from "./lattice.js";
import { percent } from "./layers.js";
import { isUsual, within } from "./parameters.js";
import * as requests from "./requests.js";

export const CURVE_POINTS = 513; // of a grazing curve
const BORDER_POINTS = 96;
const KEPT = 50;
export const NAMES = {
  SN: "saddle-node",
  PD: "period doubling",
  SB: "symmetry breaking",
  NS: "Neimark-Sacker",
  GR: "graze of a further contact",
};
// What happens where one crosses such a curve.
export const MEANINGS = {
  SN: "a motion begins, or ends",
  PD: "a motion comes to repeat only every other time",
  SB: "right and left cease to be alike",
  NS: "a slow beat begins",
  GR: "a stop is touched once more",
};

// The dyadic interval of at most eight parts that contains an interval, inside a domain; it begins no lower than at half
// of what is seen, as a curve at slow forcing takes long.
/** @param {Interval} interval  @param {Interval} domain  @returns {Interval} */
function around([low, high], domain) {
  const exponent = Math.min(Math.ceil(Math.log2((high - low) / 4)), Math.log2(domain[1] - domain[0]));
  const parts = indices([low, high], exponent, domain);
  const size = 2 ** exponent;
  const slowest = low > 0 ? 2 ** Math.floor(Math.log2(low)) : -Infinity;
  return within([Math.max(parts[0] * size, slowest), (parts[parts.length - 1] + 1) * size], domain);
}

// Whether there are bifurcation curves over a plane without a motion to begin with.
const OF_STOPS = ["clearance", "clearance_left", "restitution", "forcing", "bias"];
/** @type {(plane: PlaneAxes) => boolean} */
export const leavesGraze = ({ horizontal, vertical }) =>
  (horizontal === "omega" && OF_STOPS.includes(vertical)) || (vertical === "omega" && OF_STOPS.includes(horizontal));

/** @type {(curve: any) => string} */
const named = ({ type, motion }) => `${type}, ${NAMES[type]} of ${motion}`;

// How a piece of a bifurcation curve is drawn: thin where no motion beside it is stable.
/** @returns {Line[]} */
export function linesOf({ admissible, stable_beside: stable, ...curve }, palette) {
  const whole = {
    x: curve.omega ?? curve.horizontal,
    y: curve.clearance ?? curve.clearance_right ?? curve.clearance_left ?? curve.vertical,
    type: curve.type,
    colour: palette.bifurcations[curve.type],
    dashed: !admissible,
    text: `${named(curve)}${admissible ? "" : ", where its orbits are not admissible"}`,
  };
  const [ends, unstable] = split(whole, stable);
  const text = `${whole.text}; the motion is unstable on both sides`;
  return [unstable && { ...unstable, thin: true, text }, ends].filter(Boolean);
}

// Why two motions meet at a border.
function explained({ explanation, explanations, reason, reasons, curve, curves }, k) {
  if (curve[k] >= 0) return `${named(curves[curve[k]])}.`;
  const kind = explanations[explanation[k]];
  return { coexistence: COEXISTENCE, "goes on": GOES_ON }[kind] ?? `unexplained: ${reasons[reason[k]]}.`;
}
const COEXISTENCE = "both motions exist on both sides; here the motion from rest changes from one to the other.";
const GOES_ON = "the periodic motion goes on beyond it; there the motion from rest is another one.";

// A curve that explains borders; an admissible piece is drawn whole.
const borderCurve = ({ admissible, ...curve }, palette) => ({
  x: curve.omega ?? curve.horizontal,
  y: (curve.clearance ?? curve.vertical).map((value, k) => (admissible[k] ? value : null)),
  type: curve.type,
  colour: palette.bifurcations[curve.type],
  text: `${named(curve)}, which explains ${curve.pairs} pairs of points`,
});

// Where a curve has a value, as a number of points from its first one; linear between its points, which are close.
const crossings = (y, value) =>
  y.flatMap((end, k) => {
    const [before, after] = [y[k - 1] - value, end - value];
    return !k || before * after > 0 || before === after ? [] : [k - 1 + before / (before - after)];
  });
// The value so many points from the first one.
const valueAt = (values, place) => {
  const k = Math.min(Math.floor(place), values.length - 2);
  return values[k] + (place - k) * (values[k + 1] - values[k]);
};

const OTHER = { right: "left", left: "right" };
const grazeText = (stop) =>
  `Grazing curve: on it the steady motion just touches the ${stop}, at speed zero; above it that motion stays clear, ` +
  "beside motions that hit.";
const virtualText = (stop, other) =>
  `Here the steady motion would just touch the ${stop} stop, if it did not meet the ${other} stop before.`;

// The parts of a line where flags are true, and where they are false, as far as the other part begins; null for a part
// without a point.
function split(line, flags) {
  const part = (isDrawn) => ({ ...line, y: line.y.map((value, k) => (isDrawn(k) ? value : null)) });
  const isFalse = (k) => [k - 1, k, k + 1].some((near) => flags[near] === false);
  return [flags.includes(true) ? part((k) => flags[k]) : null, flags.includes(false) ? part(isFalse) : null];
}

// Of a codimension-two point that is no recurrence.
const TOUCHES = {
  "double-graze": "the steady motion touches both stops",
  corner: "the steady motion touches a stop twice in a period",
};

// What is drawn: the process that is asked for it, and its name.
const WHAT = {
  graze: ["grazing-curves", "the grazing curve"],
  beside: ["grazing-curves", "the graze of the fixed stop"],
  bifurcations: ["bifurcation-curves", "bifurcation curves"],
  borders: ["unfolding-diagrams", "borders"],
};

export class Curves {
  #kept = new Map();
  #running = new Map(); // what is being computed -> { abort, done }, the share in words
  #failed = new Set();

  constructor({ changed, failed, palette }) {
    this.changed = changed;
    this.failed = failed;
    this.palette = palette;
    this.wanted = {};
  }

  // Of a state of the page; `domains` are those of the parameters.
  show({ machine, plane, x, y, curves, borders }, domains) {
    const family = JSON.stringify([machine, plane]);
    if (this.family !== family) {
      // the grazing curve stands until the one of the next machine comes, as the plane does
      for (const name of Object.keys(WHAT)) if (name !== "graze") this.#forget(name);
      this.stop();
    }
    this.family = family;
    const [across, up] = [around(x, domains.x), around(y, domains.y)];
    const range = { start: across[0], stop: across[1], points: CURVE_POINTS };
    const isOfStops = plane.horizontal === "omega" && ["clearance", "clearance_left"].includes(plane.vertical);
    this.fixed = null; // the stop that does not vary, and its clearance
    if (isOfStops && machine.stops === "unequal")
      this.fixed = isUsual(plane) ? { stop: "left", at: machine.left } : { stop: "right", at: plane.clearance };
    const { stop, at } = this.fixed ?? {};
    const besides = (clearance) => requests.curve(machine, range, { clearance });
    this.#ask("graze", isOfStops, () => (stop ? besides({ [stop]: at }) : requests.curve(machine, range)));
    this.#ask("beside", Boolean(stop), () => besides({ [OTHER[stop]]: null }));
    this.#ask("bifurcations", curves === "all" && leavesGraze(plane), () =>
      requests.curves(machine, plane, across, up),
    );
    this.#ask("borders", borders, () => requests.borders(machine, plane, across, up, BORDER_POINTS));
    this.up = up;
  }

  #forget(what) {
    for (const name of [...this.#kept.keys()]) if (name.startsWith(`${what} `)) this.#kept.delete(name);
  }

  #ask(what, asked, requestOf) {
    if (asked) this.#want(what, requestOf());
    else this.#leave(what);
  }

  #leave(what) {
    this.#running.get(what)?.abort.abort();
    this.#running.delete(what);
    delete this.wanted[what];
  }

  // Gives up what is being computed.
  stop() {
    for (const what of Object.keys(this.wanted)) this.#leave(what);
  }

  // Forgets what has failed, so that it is asked for again; returns whether anything has.
  forgive() {
    const hadFailed = this.#failed.size > 0;
    this.#failed.clear();
    return hadFailed;
  }

  // What is being computed, in words.
  pending() {
    return [...this.#running].map(([what, { done }]) => `${WHAT[what][1]}${done ? ` (${done})` : ""}`);
  }

  async #want(what, request) {
    const name = `${what} ${JSON.stringify(request)}`;
    if (this.wanted[what]?.name === name) return;
    this.#leave(what);
    if (this.#failed.has(name)) return;
    this.wanted[what] = { name, request };
    if (this.#kept.has(name)) return;
    const running = { abort: new AbortController(), done: "" };
    this.#running.set(what, running);
    try {
      const onJob = ({ progress: { done, total } }) => {
        running.done = total ? percent(done / total) : "";
        this.changed();
      };
      const { id, data } = await compute(WHAT[what][0], request, { signal: running.abort.signal, priority: 8, onJob });
      this.#kept.set(name, { ...data, id });
      const wanted = new Set(Object.values(this.wanted).map((question) => question.name));
      if (this.#kept.size > KEPT) this.#kept.delete([...this.#kept.keys()].find((other) => !wanted.has(other)));
    } catch (error) {
      if (!isAborted(error) && !running.abort.signal.aborted) {
        this.#failed.add(name);
        this.#forget(what);
        delete this.wanted[what];
        this.failed(error);
      }
    }
    if (this.#running.get(what) === running) this.#running.delete(what);
    this.changed();
  }

  // What has come of the present question, or else of the one before.
  answer(what) {
    const wanted = this.wanted[what];
    if (!wanted) return null;
    return (
      this.#kept.get(wanted.name) ?? [...this.#kept].findLast(([name]) => name.startsWith(`${what} `))?.[1] ?? null
    );
  }

  lines() {
    const ink = this.palette.ink;
    const curve = this.answer("graze");
    const lines = [];
    if (curve) {
      const x = curve.omega;
      if (curve.clearance) lines.push({ x, y: curve.clearance, colour: ink, text: grazeText("stops"), isGraze: true });
      for (const [stop, other] of Object.entries(OTHER)) {
        const y = curve[`clearance_${stop}`];
        if (!y) continue;
        const [virtual, real] = split({ x, y, colour: ink }, curve[`virtual_${stop}`]);
        if (real) lines.push({ ...real, text: grazeText(`${stop} stop`), isGraze: true });
        if (virtual) lines.push({ ...virtual, text: virtualText(stop, other), dashed: true });
      }
    }
    const beside = this.answer("beside");
    if (beside && this.fixed) {
      const [low, high] = this.up;
      const { stop, at } = this.fixed;
      for (const place of crossings(beside[`clearance_${stop}`] ?? [], at)) {
        const x = valueAt(beside.omega, place);
        // nearer than where it is touched, the other stop is met first
        const other = curve?.[`clearance_${OTHER[stop]}`];
        const touched = other ? valueAt(other, place) : low;
        const from = Math.min(Math.max(low, touched), high);
        const line = (start, end, more) => lines.push({ x: [x, x], y: [start, end], colour: ink, ...more });
        const text = `Here the steady motion just touches the ${stop} stop, which is fixed.`;
        if (from < high) line(from, high, { text });
        if (low < from) line(low, from, { text: virtualText(stop, OTHER[stop]), dashed: true });
      }
    }
    return [...lines, ...(this.answer("bifurcations")?.curves ?? []).flatMap((piece) => linesOf(piece, this.palette))];
  }

  // The borders of the regions, those of one explanation as one line, and the curves that explain them.
  borders() {
    const { borders, unfolding_map: map } = this.answer("borders") ?? {};
    if (!borders) return [];
    const [x, y] = [map.omega ?? map.horizontal, map.clearance ?? map.vertical];
    const label = (row, column) => map.motions[map.motion[row][column]].label;
    const lines = new Map();
    borders.row.forEach((row, k) => {
      const column = borders.column[k];
      const upwards = borders.along[k] === 0;
      const motions = [label(row, column), upwards ? label(row + 1, column) : label(row, column + 1)];
      const why = explained(borders, k);
      const name = `Border between ${motions.sort().join(" and ")}: ${why}`;
      const line = lines.get(name) ?? {
        x: [],
        y: [],
        colour: this.palette.ink,
        thin: true,
        isBorder: true,
        text: name,
      };
      lines.set(name, line);
      const between = (axis, number) => (axis[number] + axis[number + 1]) / 2;
      const beside = (axis, number) => [-1, 1].map((side) => axis[number] + (side * (axis[1] - axis[0])) / 2);
      const xs = upwards ? beside(x, column) : [between(x, column), between(x, column)];
      const ys = upwards ? [between(y, row), between(y, row)] : beside(y, row);
      line.x.push(...xs, null);
      line.y.push(...ys, null);
    });
    return [...lines.values(), ...borders.curves.map((curve) => borderCurve(curve, this.palette))];
  }

  #meaningOf({ kind, bifurcation, multiple, order }) {
    if (kind === "resonant")
      return `Resonant point: a ${NAMES[bifurcation]} curve of motions of period ${multiple} leaves the grazing curve here.`;
    if (kind === "recurrence")
      return `Recurrence point of order ${order}: the graze recurs after ${order} half periods.`;
    return `Codimension-two point: ${TOUCHES[kind]}.`;
  }

  marks() {
    const ink = this.palette.ink;
    return (this.answer("graze")?.points ?? []).map((point) => {
      const resonant = point.kind === "resonant";
      const virtual =
        point.margin < 0 ? " The steady motion meets the other stop before, so no motion begins here." : "";
      return {
        x: point.omega,
        y: point.clearance,
        shape: resonant ? "diamond" : "circle",
        type: point.bifurcation,
        order: point.order,
        colour: resonant
          ? this.palette.bifurcations[point.bifurcation]
          : (point.order && this.palette.orders[point.order - 1]) || ink,
        text: this.#meaningOf(point) + virtual,
      };
    });
  }
}
