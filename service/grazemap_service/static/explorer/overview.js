// The grazing curve over all frequencies of a machine, in which a window is chosen.
import { compute } from "./api.js";
import { chart, extent, onDrag } from "./charts.js";
import { byId, numberOf } from "./dom.js";
import * as requests from "./requests.js";
import { structureOf } from "./structures.js";
import { toRead } from "./ticks.js";
import { inSI, named, shown, withUnit } from "./units.js";

const POINTS = 801;
const RESOLVED = 0.98; // of a peak, in the points beside it, for the peak to be told
const BELOW = 0.3;
const ABOVE = 1.6; // times the lowest and the highest natural frequency
const LOWEST = 0.02;
const HIGHEST = 1.1; // times the largest clearance of the curve in the window
const ABOUT_FIRST_MODE = [0.65, 1.25]; // times the lowest natural frequency

// The clearance at which a stop is touched: of the curves of two stops the larger one, as that stop is touched first.
function firstTouched({ clearance_right: right, clearance_left: left }) {
  return right && left ? right.map((value, k) => Math.max(value, left[k])) : (right ?? left);
}
// Whether another stop, which is fixed, is met before.
const metBefore = ({ clearance_right: right, clearance_left: left, ...curve }) =>
  right && left ? null : (curve.virtual_right ?? curve.virtual_left);

export class Overview {
  #abort = new AbortController();

  // `chosen(window)` is called with the window of a part of the curve.
  constructor({ chosen }) {
    this.chosen = chosen;
    byId("overview").addEventListener("submit", (event) => {
      event.preventDefault();
      const { from, to } = event.target.elements;
      const ends = [numberOf(from), numberOf(to)].map((value) => inSI(this.machine, "frequency", value));
      if (!ends.includes(null)) this.#choose(...ends);
    });
  }

  #choose(from, to) {
    const window = this.window(from, to);
    if (window) this.chosen(window);
  }

  // Shows the curve of a machine, and the part of it that a window has; null: the window is of another plane.
  async show(machine, view) {
    const name = JSON.stringify(machine);
    if (name !== this.name) this.asked = this.#ask(machine, name);
    await this.asked;
    if (this.curve && name === this.name) this.#draw(machine, view);
  }

  async #ask(machine, name) {
    this.#abort.abort();
    this.#abort = new AbortController();
    this.name = name;
    this.curve = null;
    const { signal } = this.#abort;
    try {
      const linear = await structureOf(machine);
      if (signal.aborted) return;
      const modes = linear.natural_frequencies.filter((omega) => omega > 0);
      const range = { start: BELOW * modes[0], stop: ABOVE * modes[modes.length - 1], points: POINTS };
      const { data } = await compute("grazing-curves", requests.curve(machine, range), { signal });
      if (signal.aborted) return;
      this.first = modes[0];
      const y = data.clearance ?? firstTouched(data);
      this.curve = { x: data.omega, y, isVirtual: metBefore(data) ?? y.map(() => false) };
      byId("overview-says").textContent = "";
    } catch (error) {
      if (!signal.aborted) byId("overview-says").textContent = error.message;
    }
  }

  #draw(machine, view) {
    this.machine = machine;
    const x = shown(machine, "frequency", this.curve.x);
    const y = shown(machine, "length", this.curve.y);
    const ends = view && shown(machine, "frequency", view.x);
    const { from, to } = byId("overview").elements;
    const drawn = chart({
      title: "Grazing curve over all frequencies; the lines are the ends of the window",
      x: extent(x, 0),
      y: extent(y),
      names: { x: named("ω", machine, "frequency"), y: named("clearance", machine, "length") },
      series: [
        { x, y: y.map((value, k) => (this.curve.isVirtual[k] ? value : null)), kind: "unstable" },
        { x, y: y.map((value, k) => (this.curve.isVirtual[k] ? null : value)), kind: "motion" },
      ],
      bars: (ends ?? []).filter((end) => x[0] < end && end < x[x.length - 1]).map((end) => ({ x: end, kind: "end" })),
    });
    onDrag(drawn, extent(x, 0), (...part) => this.#choose(...part.map((value) => inSI(machine, "frequency", value))));
    byId("overview-chart").replaceChildren(drawn);
    byId("overview-most").textContent = view ? this.#most(machine, view.x) : "";
    if (view) [from.value, to.value] = ends.map((value) => toRead(value, ends[1] - ends[0]));
  }

  // The largest clearance of the curve between two frequencies, in words.
  #most(machine, [low, high]) {
    const { x, y, isVirtual } = this.curve;
    const inside = x.flatMap((omega, k) => (low <= omega && omega <= high && y[k] > 0 ? [k] : []));
    if (!inside.length || inside.some((k) => isVirtual[k])) return "";
    const k = inside.reduce((best, other) => (y[other] > y[best] ? other : best));
    const [before, top, after] = [k - 1, k, k + 1].map((near) => y[near] ?? y[k]);
    if (Math.min(before, after) < RESOLVED * top) return ""; // a peak between the points of the curve
    const isPeak = before < top && after < top;
    const most = isPeak ? top + (before - after) ** 2 / (16 * top - 8 * before - 8 * after) : top;
    return (
      `In the window the motion without impacts needs a clearance of up to ${withUnit(machine, "length", most)}, near ` +
      `${withUnit(machine, "frequency", x[k])}. Motions with impacts may exist above that, too.`
    );
  }

  // The window of a part of the frequencies, about the curve there; null without a curve there.
  window(from, to) {
    const { x, y } = this.curve ?? { x: [], y: [] };
    const step = x[1] - x[0];
    const read = (omega) => toRead(shown(this.machine, "frequency", omega));
    const within = y.filter((value, k) => value > 0 && from - step < x[k] && x[k] < to + step);
    if (!within.length || !(from < to)) {
      byId("overview-says").textContent =
        from < to
          ? `The curve has no point between these frequencies: it goes from ${read(x[0])} to ${read(x.at(-1))}.`
          : "The first frequency must be below the second one.";
      return null;
    }
    byId("overview-says").textContent = "";
    const most = Math.max(...within);
    return { x: [from, to], y: [LOWEST * most, HIGHEST * most] };
  }

  // A window to begin with, about the lowest natural frequency; null before the curve is there.
  suggested() {
    return this.curve && this.window(...ABOUT_FIRST_MODE.map((factor) => factor * this.first));
  }

  // Whether the curve passes through a window.
  meets({ x: [left, right], y: [low, high] }) {
    return this.curve.x.some(
      (omega, k) => left <= omega && omega <= right && low <= this.curve.y[k] && this.curve.y[k] <= high,
    );
  }
}
