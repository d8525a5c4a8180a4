// The curves and points over the plane: the grazing curve with its codimension-two points, and on request the
// bifurcation curves that leave it. Asked for by dyadic intervals, so that neighbouring views share them.
import { compute, isAborted } from "./api.js";
import { indices } from "./lattice.js";
import * as requests from "./requests.js";

const POINTS = 513;
const KEPT = 50;
const NAMES = {
  SN: "saddle-node",
  PD: "period doubling",
  SB: "symmetry breaking",
  NS: "Neimark-Sacker",
  GR: "graze of a further contact",
};

// The dyadic interval of at most eight parts that contains an interval.
export function around([low, high]) {
  const exponent = Math.ceil(Math.log2((high - low) / 4));
  const found = indices([low, high], exponent);
  const size = 2 ** exponent;
  return [Math.max(found[0] * size, size / 2 ** 10), (found[found.length - 1] + 1) * size];
}

// How a piece of a bifurcation curve is drawn.
export const lineOf = ({ type, motion, admissible, omega, clearance, clearance_right, clearance_left }, palette) => ({
  x: omega,
  y: clearance ?? clearance_right ?? clearance_left,
  colour: palette.bifurcations[type],
  dashed: !admissible,
  text: `${type}, ${NAMES[type]} of ${motion}${admissible ? "" : ", where its orbits are not admissible"}`,
});

export class Curves {
  #kept = new Map();
  #abort = new Map();

  constructor({ changed, failed, palette }) {
    Object.assign(this, { changed, failed, palette, wanted: {} });
  }

  show(machine, { x, y }, all) {
    const family = JSON.stringify(machine);
    const omega = around(x);
    const clearance = around(y);
    this.#want("grazing-curves", family, requests.curve(machine, { start: omega[0], stop: omega[1], points: POINTS }));
    if (all) this.#want("bifurcation-curves", family, requests.borders(machine, omega, clearance));
    else this.#leave("bifurcation-curves");
  }

  #leave(process) {
    this.#abort.get(process)?.abort();
    delete this.wanted[process];
  }

  async #want(process, family, request) {
    const name = `${process} ${JSON.stringify(request)}`;
    if (this.wanted[process]?.name === name) return;
    this.#abort.get(process)?.abort();
    if (this.wanted[process]?.family !== family) this.#kept.clear();
    this.wanted[process] = { name, family, request };
    if (this.#kept.has(name)) return;
    const abort = new AbortController();
    this.#abort.set(process, abort);
    try {
      const { id, data } = await compute(process, request, { signal: abort.signal, priority: 8 });
      this.#kept.set(name, { ...data, id });
      if (this.#kept.size > KEPT) this.#kept.delete(this.#kept.keys().next().value);
      this.changed();
    } catch (error) {
      if (!isAborted(error)) this.failed(error);
    }
  }

  // What has come of the present question, or else of the one before.
  found(process) {
    const wanted = this.wanted[process];
    if (!wanted) return null;
    return (
      this.#kept.get(wanted.name) ?? [...this.#kept].findLast(([name]) => name.startsWith(`${process} `))?.[1] ?? null
    );
  }

  lines() {
    const ink = this.palette.ink;
    const curve = this.found("grazing-curves");
    const lines = [];
    if (curve) {
      const explained = "Grazing curve: on it the steady motion just touches the stop; above it, it does not reach it.";
      if (curve.clearance) lines.push({ x: curve.omega, y: curve.clearance, colour: ink, text: explained });
      for (const stop of ["right", "left"]) {
        const values = curve[`clearance_${stop}`];
        if (values)
          lines.push({
            x: curve.omega,
            y: values,
            colour: ink,
            text: `${explained} (${stop} stop)`,
            dashed: stop === "left",
          });
      }
    }
    return [...lines, ...(this.found("bifurcation-curves")?.curves ?? []).map((piece) => lineOf(piece, this.palette))];
  }

  marks() {
    const ink = this.palette.ink;
    return (this.found("grazing-curves")?.points ?? []).map((point) => {
      const resonant = point.kind === "resonant";
      return {
        x: point.omega,
        y: point.clearance,
        shape: resonant ? "diamond" : "circle",
        colour: resonant
          ? this.palette.bifurcations[point.bifurcation]
          : (this.palette.orders[(point.order ?? 1) - 1] ?? ink),
        text: resonant
          ? `Resonant point: a ${NAMES[point.bifurcation]} curve of motions of period ${point.multiple} leaves the grazing curve here.`
          : point.kind === "recurrence"
            ? `Recurrence point of order ${point.order}: the graze recurs after ${point.order} half periods.`
            : `Codimension-two point: ${point.kind}.`,
      };
    });
  }
}
