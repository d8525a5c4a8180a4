// The motion at a point of the plane, in the side panel: its name and figures, pictures, and what can be asked next.
import { compute, isAborted } from "./api.js";
import { Animation } from "./animation.js";
import { chart, circle, extent } from "./charts.js";
import { stopsOf, withImpacts } from "./contact.js";
import { byId, element, swatch } from "./dom.js";
import { showBasins, showBranch, showCurves } from "./further.js";
import { explain, showLonger, showOthers, verdictOf } from "./others.js";
import { USUAL, parameter, placeOf } from "./parameters.js";
import { FREE, isFree } from "./labels.js";
import { withoutRemedy } from "./layers.js";
import { inWords, speedsOf } from "./motionwords.js";
import { isStill, moving } from "./moving.js";
import * as requests from "./requests.js";
import { knock } from "./sound.js";
import { toRead } from "./ticks.js";
import { named, shown, symbolOf, unitOf } from "./units.js";

const COMPUTING = "Computing …";
const AWAY = 100; // times a clearance, where no stop is reached
const PERIODS_SHOWN = 12;
const HALF = { width: 160, height: 132 };
const LOW = { width: 320, height: 110 };
const least = (velocities) => (velocities.length ? Math.min(...velocities.map(Math.abs)) : null);

// Whether there is no orbit with impacts as the motion has none.
const isOfFree = ({ reason }) => Boolean(reason?.includes("without impacts"));

// A multiplier with its sign, or the modulus of a complex one.
const multiplierText = ([real, imaginary]) =>
  imaginary ? `${toRead(Math.hypot(real, imaginary))}, the modulus of a complex pair` : toRead(real);

export class PointPanel {
  #abort = new AbortController();
  #isLoud = false;
  #working = new Set(); // what is asked for at the open point
  #animation = new Animation(byId("animation"), { hit: (share) => this.#isLoud && knock(share) });

  // `colours` are those of motions; `drawn` is called with the { lines, marks } of the point in the plane, `closed` when
  // a person closes the point, `hidden` when none is shown any more.
  constructor({ colours, drawn, closed, hidden }) {
    this.colours = colours;
    this.hidden = hidden;
    this.drawn = drawn;
    byId("close-point").addEventListener("click", closed);
    byId("sound").addEventListener("click", ({ target }) => {
      this.#isLoud = !this.#isLoud;
      target.setAttribute("aria-pressed", this.#isLoud);
    });
    byId("play").addEventListener("click", () => this.#toggle());
    const ask = (name, what, show, result) =>
      byId(`ask-${name}`).addEventListener("click", async () => {
        if (await this.#work(what, () => show(this))) byId(result).scrollIntoView({ block: "nearest" });
      });
    ask("basins", "Basins", showBasins, "basins");
    ask("branch", "The branch", showBranch, "branch");
    ask("others", "The motions", showOthers, "others");
    ask("longer", "The motion", showLonger, "unresolved-longer");
    ask("graze", "The motion that just touches", () => this.#graze(), "stage");
    ask("curves", "The curves", showCurves, "own-curves");
  }

  clear() {
    this.#leave();
    this.hidden();
  }

  // Gives up what is being computed.
  stop() {
    this.#abort.abort();
  }

  // Draws the machine again, as after a change of colours or of the size.
  redraw() {
    if (!byId("pictures").hidden) this.#animation.redraw();
  }

  #leave() {
    this.stop();
    this.#working = new Set();
    this.#animation.stop();
    byId("point-section").hidden = true;
    this.inPlane = {};
    this.drawn({ lines: [], marks: [] });
  }

  // Draws the lines and marks of the branch or of the curves into the plane, in place of those before.
  draw(name, lines, marks = []) {
    this.inPlane[name] = { lines, marks };
    const all = Object.values(this.inPlane);
    this.drawn({ lines: all.flatMap((part) => part.lines), marks: all.flatMap((part) => part.marks) });
  }

  // Shows the motion at the point of a state of the page, from rest or from the state `start`, with a `note`; `machine` and `at`, [omega, clearance], are
  // those there.
  async show(state, start = null) {
    this.#leave();
    this.start = start;
    this.#abort = new AbortController();
    const { machine, at } = placeOf(state.machine, state.plane, state.at);
    this.machine = machine;
    this.at = at;
    this.state = state;
    byId("point-section").hidden = false;
    byId("point-section").scrollTop = 0;
    byId("basins").replaceChildren();
    byId("branch").replaceChildren();
    byId("others").replaceChildren();
    byId("unresolved").hidden = true;
    byId("unresolved-longer").textContent = "";
    byId("own-curves").textContent = "";
    byId("pictures").hidden = true;
    const { plane, x, y } = state;
    const widths = { [plane.horizontal]: x[1] - x[0], [plane.vertical]: y[1] - y[0] };
    const read = (name, quantity, value) => {
      const [number, width] = shown(machine, quantity, [value, widths[name] ?? value]);
      return toRead(number, Math.abs(width)) + unitOf(machine, quantity);
    };
    const others = ["horizontal", "vertical"].flatMap((axis, k) => {
      const { name, text, quantity } = parameter(state.plane[axis], machine);
      return Object.hasOwn(USUAL, name) ? [] : [`${text} ${read(name, quantity, state.at[k])}`];
    });
    byId("point-place").textContent = [
      `${symbolOf(machine)} = ${read("omega", "frequency", at[0])}`,
      `${parameter("clearance", machine).text} ${read("clearance", "length", at[1])}`,
      ...others,
    ].join(", ");
    byId("ask-branch").textContent = `Follow the branch over the ${parameter(state.plane.vertical, machine).text}`;
    byId("point-name").textContent = COMPUTING;
    byId("point-words").textContent = byId("point-why").textContent = "";
    byId("point-figures").replaceChildren();
    byId("multipliers").replaceChildren();
    this.orbit = null;
    byId("ask-branch").disabled = byId("ask-curves").disabled = true;
    await this.#work("The motion", () => Promise.all([this.#trajectory(), this.#orbit()]));
  }

  // Says what is being computed until it is there, or what is wrong; returns whether it is there.
  async #work(what, task) {
    const { signal } = this.#abort;
    const working = this.#working;
    working.add(what);
    this.#sayWork();
    try {
      await task();
      working.delete(what);
      this.#sayWork();
      return true;
    } catch (error) {
      working.delete(what);
      if (isAborted(error) || signal.aborted) return false;
      if (byId("point-name").textContent === COMPUTING) byId("point-name").textContent = "Not computed";
      byId("point-says").textContent = `${what}: ${error.message}`;
      return false;
    }
  }

  // Says what is being computed, or what it waits for.
  #sayWork(waitingFor = null) {
    const what = [...this.#working].join(", ");
    byId("point-says").textContent = waitingFor ? `Waiting for ${waitingFor}.` : what && `${what}: computing …`;
  }

  async compute(process, request) {
    const { signal } = this.#abort;
    const { data } = await compute(process, request, {
      signal,
      priority: 8,
      onJob: (job) => this.#sayWork(job.waiting_for),
    });
    signal.throwIfAborted();
    return data;
  }

  async #trajectory() {
    const { machine, at } = this;
    const over = (periods) =>
      this.compute(
        "trajectories",
        requests.trajectory(machine, at, { transient: machine.periods, periods, initial: this.start }),
      );
    let path = await over(PERIODS_SHOWN);
    const { motion } = path;
    if (motion.kind === "periodic" && motion.period > PERIODS_SHOWN) path = await over(motion.period);
    const { label, why } =
      motion.kind === "unresolved" && !this.start ? await this.#ofMap() : { label: motion.label ?? motion.kind };
    const before = motion.kind === "periodic" ? ", at" : "; hits at";
    const speeds = isFree(label) ? "" : speedsOf(path.impacts, unitOf(machine, "velocity"), before);
    byId("point-name").replaceChildren(swatch(this.colours.of(label).colour, this.colours.of(label).image), label);
    byId("point-words").textContent = `${inWords(label, machine)}${speeds}.`;
    byId("point-why").textContent = [why, this.state.note].filter(Boolean).join(" ");
    this.#draw(path, label);
  }

  // Shows the motion of a trajectory, between the stops of the open point, in the colour of a label.
  #draw(path, label) {
    const { machine, at } = this;
    const units = (quantity) => unitOf(machine, quantity);
    const stops = stopsOf(machine, at[1]);
    const { time: times, q: displacements, v } = withImpacts(machine, path, stops);
    const q = shown(machine, "length", displacements);
    const [left, right] = shown(machine, "length", stops);
    const present = [left, right].filter((stop) => stop !== null);
    const animated = moving(machine, at, path, this.colours.of(label).colour);
    const last = times.findLastIndex(
      (time) => time <= Math.max(4 * animated.period, Math.min(2 * animated.loop, times.at(-1))) + 1e-9,
    );
    byId("pictures").hidden = false;
    this.#animation.show(animated);
    if (!isStill()) this.#animation.play();
    byId("portrait").replaceChildren(
      chart({
        title: "Phase portrait: velocity over displacement of the contact, with the stops",
        size: HALF,
        x: extent([...q, ...present]),
        y: extent(v),
        names: { x: named("displacement", machine, "length"), y: named("velocity", machine, "velocity") },
        series: [{ x: q, y: v, kind: "motion" }],
        bars: present.map((x) => ({ x, kind: "stop" })),
      }),
    );
    const { impacts } = path;
    const place = (stop) => (stop > 0 ? right : left);
    byId("history").replaceChildren(
      chart({
        title: "Displacement of the contact over time, with its impacts",
        size: LOW,
        x: [0, times[last]],
        y: extent([...q, ...present]),
        names: { x: named("time", machine, "time"), y: named("contact", machine, "length") },
        series: [{ x: times.slice(0, last + 1), y: q.slice(0, last + 1), kind: "motion" }],
        bars: present.map((y) => ({ y, kind: "stop" })),
        dots: impacts.time.flatMap((time, k) =>
          time > times[last]
            ? []
            : [
                {
                  x: time,
                  y: place(impacts.stop[k]),
                  kind: "impact",
                  text: `${impacts.kind[k]} at ${toRead(Math.abs(impacts.velocity[k]))}${units("velocity")}`,
                },
              ],
        ),
      }),
    );
    this.#name();
  }

  // The motion that a map names: it measures exponents, which tell chaos.
  async #ofMap() {
    const verdict = verdictOf(await this.compute("unfolding-maps", requests.pointMap(this.machine, this.at)));
    const { label, exponent } = verdict;
    explain(verdict, this.machine.periods);
    return { label, why: exponent === null ? "" : `Lyapunov exponent ${toRead(exponent)} per forcing period.` };
  }

  // Shows the motion without impacts on the grazing curve: with its stops out of reach it does not leave it.
  async #graze() {
    const { machine, at } = this;
    const far = { ...machine, left: machine.left && AWAY * machine.left };
    const options = { transient: machine.periods, periods: PERIODS_SHOWN };
    const path = await this.compute("trajectories", requests.trajectory(far, [at[0], AWAY * at[1]], options));
    byId("point-words").textContent = "The motion without impacts: it just touches a stop, at speed zero.";
    this.#draw(path, FREE);
  }

  async #orbit() {
    const { machine, at } = this;
    const units = (quantity) => unitOf(machine, quantity);
    const orbit = await this.compute("periodic-orbits", requests.orbit(machine, at, this.start));
    const yes = (value) => (value ? "yes" : "no");
    const rows = orbit.converged
      ? [
          ["verified", yes(orbit.verified)],
          ["isolated", yes(orbit.isolated)],
          ["admissible", yes(orbit.admissible)],
          ["stable", yes(orbit.stable)],
          ["largest multiplier", multiplierText(orbit.multipliers?.[0] ?? [NaN, 0])],
          ["impacts in a forcing period", toRead(orbit.impact_rate)],
          ["minimum impact speed", `${toRead(least(orbit.velocities))}${units("velocity")}`],
          ["peak impact speed", `${toRead(orbit.peak_impact_speed)}${units("velocity")}`],
          ["dissipated power", `${toRead(orbit.dissipated_power)}${units("power")}`],
        ]
      : [["periodic orbit", isOfFree(orbit) ? "the steady motion, without impacts" : "none found"]];
    if (orbit.reason && !isOfFree(orbit)) rows.push(["because", withoutRemedy(orbit.reason)]);
    byId("point-figures").replaceChildren(
      ...rows.flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]),
    );
    byId("multipliers").replaceChildren(
      ...(orbit.converged && orbit.multipliers?.length ? [circle(orbit.multipliers, HALF)] : []),
    );
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
}
