// The motion at a point of the plane, in the side panel: its name and figures, pictures, and what can be asked next.
import { compute, isAborted } from "./api.js";
import { Animation } from "./animation.js";
import { chart, circle, extent } from "./charts.js";
import { lineOf } from "./curves.js";
import { byId, element } from "./dom.js";
import * as requests from "./requests.js";
import { toRead } from "./ticks.js";
import { unitOf } from "./units.js";

const PERIODS_SHOWN = 12;
const BASIN_POINTS = 96;

// The contact coordinate of displacements [mass][time].
function contactOf({ oscillator }, displacement) {
  const contact = oscillator?.contact ?? 1;
  if (Array.isArray(contact)) return displacement[contact[0] - 1].map((value, k) => value - displacement[contact[1] - 1][k]);
  if (contact.row) return displacement[0].map((_, k) => contact.row.reduce((sum, part, mass) => sum + part * displacement[mass][k], 0));
  return displacement[contact - 1];
}

// The places of the left and the right stop; null where absent.
function stopsOf(machine, value) {
  const clearance = requests.clearance(machine, value);
  if (typeof clearance === "number") return [-clearance, clearance];
  return [clearance.left === null ? null : -clearance.left, clearance.right];
}

export class PointPanel {
  #abort = new AbortController();
  #animation = new Animation(byId("animation"));

  // `colours` are those of motions; `drawn` is called with the { lines, marks } of the point in the plane.
  constructor({ colours, drawn }) {
    Object.assign(this, { colours, drawn });
    byId("play").addEventListener("click", () => this.#toggle());
    byId("ask-basins").addEventListener("click", () => this.#work("Basins", () => this.#basins()));
    byId("ask-branch").addEventListener("click", () => this.#work("The branch", () => this.#branch()));
    byId("ask-curves").addEventListener("click", () => this.#work("The curves", () => this.#curves()));
  }

  clear() {
    this.#abort.abort();
    this.#animation.stop();
    byId("point").hidden = true;
    byId("no-point").hidden = false;
    this.inPlane = {};
    this.drawn({ lines: [], marks: [] });
  }

  // Draws the lines and marks of the branch or of the curves into the plane, in place of those before.
  #draw(name, lines, marks = []) {
    this.inPlane[name] = { lines, marks };
    const all = Object.values(this.inPlane);
    this.drawn({ lines: all.flatMap((one) => one.lines), marks: all.flatMap((one) => one.marks) });
  }

  async show(machine, at, window) {
    this.clear();
    this.#abort = new AbortController();
    Object.assign(this, { machine, at, window });
    byId("point").hidden = false;
    byId("no-point").hidden = true;
    byId("basins").replaceChildren();
    byId("branch").replaceChildren();
    byId("own-curves").textContent = "";
    byId("pictures").hidden = true;
    const frequency = unitOf(machine, "frequency"), length = unitOf(machine, "length");
    byId("point-place").textContent = `ω = ${at[0]}${frequency}, clearance ${at[1]}${length}`;
    byId("point-name").textContent = "Computing …";
    byId("point-figures").replaceChildren();
    await this.#work("The motion", async () => {
      await Promise.all([this.#trajectory(), this.#orbit()]);
      byId("point-says").textContent = "";
    });
  }

  async #work(what, task) {
    byId("point-says").textContent = `${what}: computing …`;
    try {
      await task();
    } catch (error) {
      if (!isAborted(error)) byId("point-says").textContent = `${what}: ${error.message}`;
    }
  }

  async #compute(process, request) {
    const { signal } = this.#abort;
    const { data } = await compute(process, request, {
      signal, priority: 8, onJob: (job) => { if (job.waiting_for) byId("point-says").textContent = `Waiting for ${job.waiting_for}.`; },
    });
    signal.throwIfAborted();
    return data;
  }

  async #trajectory() {
    const { machine, at } = this;
    const path = await this.#compute("trajectories", requests.trajectory(machine, at, { transient: machine.periods, periods: PERIODS_SHOWN }));
    const { motion } = path, label = motion.label ?? motion.kind, units = (quantity) => unitOf(machine, quantity);
    byId("point-name").replaceChildren(swatch(this.colours.of(label)), label);
    byId("point-why").textContent = motion.kind === "unresolved" ? motion.reason ?? "" : "";
    const q = contactOf(machine, path.displacement), v = contactOf(machine, path.velocity), stops = stopsOf(machine, at[1]);
    const present = stops.filter((stop) => stop !== null), period = 2 * Math.PI / at[0];
    const last = path.time.findLastIndex((time) => time <= Math.min(PERIODS_SHOWN, Math.max(4, 2 * (motion.period ?? 4))) * period + 1e-9);
    byId("portrait").replaceChildren(chart({
      title: "Phase portrait: velocity over displacement of the contact, with the stops",
      x: extent([...q, ...present]), y: extent(v), names: { x: `displacement${units("length")}`, y: `velocity${units("velocity")}` },
      series: [{ x: q, y: v, kind: "motion" }], bars: present.map((x) => ({ x, kind: "stop" })),
    }));
    const { impacts } = path, place = (stop) => (stop > 0 ? stops[1] : stops[0]);
    byId("history").replaceChildren(chart({
      title: "Displacement of the contact over time, with its impacts",
      x: [0, path.time[last]], y: extent([...q, ...present]), names: { x: `time${units("time")}`, y: `displacement${units("length")}` },
      series: [{ x: path.time.slice(0, last + 1), y: q.slice(0, last + 1), kind: "motion" }],
      bars: present.map((y) => ({ y, kind: "stop" })),
      dots: impacts.time.flatMap((time, k) => (time > path.time[last] ? [] : [{ x: time, y: place(impacts.stop[k]), kind: "impact", text: `${impacts.kind[k]} at ${toRead(Math.abs(impacts.velocity[k]))}${units("velocity")}` }])),
    }));
    const chain = (machine.oscillator?.contact ?? 1) === 1 && !machine.oscillator?.matrices;
    byId("pictures").hidden = false;
    this.#animation.show({ time: path.time, masses: chain ? path.displacement : [q], stops, period, colour: this.colours.of(label) });
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.#animation.play();
    this.#name();
  }

  async #orbit() {
    const { machine, at } = this, units = (quantity) => unitOf(machine, quantity);
    const orbit = await this.#compute("periodic-orbits", requests.orbit(machine, at));
    const yes = (value) => (value ? "yes" : "no");
    const rows = orbit.converged
      ? [["verified", yes(orbit.verified)], ["isolated", yes(orbit.isolated)], ["admissible", yes(orbit.admissible)],
        ["stable", yes(orbit.stable)], ["largest multiplier", toRead(Math.hypot(...orbit.multipliers?.[0] ?? [NaN]))],
        ["impacts in a forcing period", toRead(orbit.impact_rate)],
        ["peak impact speed", `${toRead(orbit.peak_impact_speed)}${units("velocity")}`],
        ["dissipated power", `${toRead(orbit.dissipated_power)}${units("power")}`]]
      : [["periodic orbit", "none found"]];
    if (orbit.reason) rows.push(["because", orbit.reason]);
    byId("point-figures").replaceChildren(...rows.flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]));
    byId("multipliers").replaceChildren(...(orbit.converged && orbit.multipliers?.length ? [circle(orbit.multipliers)] : []));
    this.orbit = orbit;
    byId("ask-branch").disabled = byId("ask-curves").disabled = !orbit.converged;
  }

  #toggle() {
    if (this.#animation.playing) this.#animation.stop();
    else this.#animation.play();
    this.#name();
  }

  #name() {
    byId("play").textContent = this.#animation.playing ? "Pause" : "Play";
  }

  async #basins() {
    const basins = await this.#compute("basins", requests.basins(this.machine, this.at, BASIN_POINTS));
    const { label, attractors, horizontal, vertical } = basins, rows = label.length, columns = label[0].length;
    const canvas = element("canvas", { width: columns, height: rows, className: "basins", role: "img", "aria-label": "Basins of attraction over initial displacement and velocity of mass 1" });
    const names = attractors.map((one) => one.label ?? one.kind), unresolved = this.colours.channels("unresolved");
    const taken = names.map((name, k) => (names.indexOf(name) < k ? unresolved.map((value) => 255 - value / 2) : this.colours.channels(name)));
    const pen = canvas.getContext("2d"), image = pen.createImageData(columns, rows);
    label.forEach((row, i) => row.forEach((number, j) => image.data.set([...(taken[number] ?? unresolved), 255], 4 * ((rows - 1 - i) * columns + j))));
    pen.putImageData(image, 0, 0);
    const ends = (values, unit) => `${toRead(values[0])} to ${toRead(values[values.length - 1])}${unit}`;
    byId("basins").replaceChildren(
      canvas,
      element("p", { textContent: `Initial displacement ${ends(horizontal, unitOf(this.machine, "length"))} to the right, velocity ${ends(vertical, unitOf(this.machine, "velocity"))} upwards, of mass 1; the rest starts at rest.` }),
      element("ul", {}, ...attractors.map((one, k) => element("li", {}, swatch(`rgb(${taken[k]})`), `${names[k]}: ${(100 * one.share).toFixed(1)} %`))),
    );
    byId("point-says").textContent = "";
  }

  async #branch() {
    const { machine, at: [omega], window } = this, [low, high] = window.y;
    const branch = await this.#compute("orbit-branches", requests.branch(machine, this.at, [Math.min(low, this.at[1]), Math.max(high, this.at[1])]));
    if (!branch.parameter.length) throw new Error(branch.reason);
    const speed = branch.velocities.map((all) => Math.abs(all[0] ?? 0)), all = branch.parameter.map((_, k) => k);
    const part = (chosen) => ({ x: branch.parameter, y: all.map((k) => (chosen(k) || chosen(Math.max(0, k - 1)) ? speed[k] : null)) });
    const stable = (k) => branch.stable[k] && branch.admissible[k];
    byId("branch").replaceChildren(
      chart({
        title: "Branch: speed of the first impact over the clearance",
        x: extent(branch.parameter), y: extent(speed), names: { x: `clearance${unitOf(machine, "length")}`, y: `impact speed${unitOf(machine, "velocity")}` },
        series: [{ ...part((k) => !stable(k)), kind: "unstable" }, { ...part(stable), kind: "motion" }],
        dots: branch.special_points.map((point) => ({ x: point.parameter, y: Math.abs(point.velocities[0] ?? 0), kind: point.type, text: `${point.type} at ${point.parameter}` })),
      }),
      element("p", { textContent: "Dashed: unstable or not admissible." }),
      element("ul", {}, ...branch.special_points.map((point) => element("li", { textContent: `${point.type} at clearance ${toRead(point.parameter)}${point.admissible ? "" : " (not admissible)"}` }))),
    );
    byId("point-says").textContent = "";
    const ends = extent(branch.parameter, 0), { bifurcations, ink } = this.colours.palette;
    const line = { x: [omega, omega], y: ends, colour: ink, dashed: true, text: "The branch that was followed" };
    this.#draw("branch", [line], branch.special_points.map((point) => ({ x: omega, y: point.parameter, shape: "diamond", colour: bifurcations[point.type], text: `${point.type} of the branch, at clearance ${point.parameter}` })));
  }

  async #curves() {
    const { machine, at, window } = this, data = await this.#compute("bifurcation-curves", requests.curvesOf(machine, at, this.orbit, window.x, window.y));
    const lines = data.curves.map((piece) => lineOf(piece, this.colours.palette)), reason = data.motions?.[0]?.reason;
    byId("own-curves").textContent = reason ?? `${lines.length} pieces of bifurcation curves of ${data.motions?.[0]?.label} are drawn into the plane.`;
    this.#draw("curves", lines);
    byId("point-says").textContent = "";
  }
}

function swatch(colour) {
  const square = element("i", { className: "swatch" });
  square.style.backgroundColor = colour;
  return square;
}
