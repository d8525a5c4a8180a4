// The motion at a point of the plane, in the side panel: its name and figures, pictures, and what can be asked next.
import { compute, isAborted } from "./api.js";
import { Animation } from "./animation.js";
import { chart, circle, extent } from "./charts.js";
import { stopsOf, withImpacts } from "./contact.js";
import { byId, element, swatch, term } from "./dom.js";
import { showBasins, showBranch, showCurves } from "./further.js";
import { LONGER, explain, mark, showOthers, verdictOf } from "./others.js";
import { USUAL, parameter, placeOf } from "./parameters.js";
import { FREE, isFree } from "./labels.js";
import { withoutRemedy } from "./layers.js";
import { inWords, periodOf, speedsOf } from "./motionwords.js";
import { isStill, moving } from "./moving.js";
import * as requests from "./requests.js";
import { knock } from "./sound.js";
import { toRead } from "./ticks.js";
import { named, shown, symbolOf, unitOf } from "./units.js";

const AWAY = 100; // times a clearance, where no stop is reached
const PERIODS_SHOWN = 12;
const PERIODS_OF_CHAOS = 60; // or of another motion that does not repeat
const NEARLY = ", ready in about 0 s";
const NEIGHBOURS = "neighbouring-motions"; // a heading of the glossary
const HALF = { width: 160, height: 132 };
const LOW = { width: 320, height: 110 };
const least = (velocities) => (velocities.length ? Math.min(...velocities.map(Math.abs)) : null);

// Whether there is no orbit with impacts as the motion has none.
const isOfFree = ({ reason }) => Boolean(reason?.includes("without impacts"));

// A multiplier with its sign, or the modulus of a complex one.
const multiplierText = ([real, imaginary]) =>
  imaginary ? `${toRead(Math.hypot(real, imaginary))}, the modulus of a complex pair` : toRead(real);

export class PointPanel {
  ofPoint = new AbortController(); // what is asked of the point, whatever its motion is
  #motion = new AbortController();
  #isLoud = false;
  #isOnGraze = false;
  #isFromRest = true;
  #working = []; // what is asked for at the open point
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
      byId(`ask-${name}`).addEventListener("click", async ({ target }) => {
        const answer = byId(result);
        if (!(await this.#work(what, () => show(this)))) return;
        byId("answers").prepend(answer); // the newest one, below the questions
        // in sight, as far as the question stays there
        for (const part of [answer, target]) part.scrollIntoView({ block: "nearest" });
      });
    ask("basins", "Basins", showBasins, "basins");
    ask("branch", "The branch", showBranch, "branch");
    ask("others", "The motions", showOthers, "others");
    ask("curves", "The curves", showCurves, "own-curves");
    byId("ask-graze").addEventListener("click", () =>
      this.choose(
        this.#isFromRest ? { label: FREE, note: "It just touches a stop, at speed zero.", isTouching: true } : {},
      ),
    );
    byId("ask-longer").addEventListener("click", () => {
      byId("point-name").focus(); // which says what has come of it
      this.choose({ periods: LONGER * this.machine.periods });
    });
  }

  // Offers the motion that just touches where the point is on the grazing curve, or the way back from another motion.
  offer(isOnGraze = this.#isOnGraze) {
    this.#isOnGraze = isOnGraze;
    byId("ask-graze").hidden = this.#isFromRest && !this.#isOnGraze;
    byId("ask-graze").textContent = `Show the motion ${this.#isFromRest ? "that just touches" : "from rest"}`;
  }

  clear() {
    this.#leave();
    this.hidden();
  }

  // Gives up what is being computed.
  stop() {
    this.ofPoint.abort();
    this.#motion.abort();
  }

  // Draws the machine again, as after a change of colours or of the size.
  redraw() {
    if (!byId("pictures").hidden) this.#animation.redraw();
  }

  #leave() {
    this.stop();
    this.#working = [];
    this.#forget();
    byId("point-section").hidden = true;
  }

  // Ends what is shown of a motion.
  #forget() {
    this.#motion.abort();
    this.#animation.stop();
    this.inPlane = {};
    this.drawn({ lines: [], marks: [] });
  }

  // Draws the lines and marks of the branch or of the curves into the plane, in place of those before.
  draw(name, lines, marks = []) {
    this.inPlane[name] = { lines, marks };
    const all = Object.values(this.inPlane);
    this.drawn({ lines: all.flatMap((part) => part.lines), marks: all.flatMap((part) => part.marks) });
  }

  // Shows the motion from rest at the point of a state of the page, with a `note`; `machine` and `at`, [omega,
  // clearance], are those there.
  async show(state) {
    this.#leave();
    this.ofPoint = new AbortController();
    const { machine, at } = placeOf(state.machine, state.plane, state.at);
    this.machine = machine;
    this.at = at;
    this.state = state;
    byId("point-section").hidden = false;
    for (const name of ["basins", "others"]) byId(name).replaceChildren();
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
    this.place = [
      `${symbolOf(machine)} = ${read("omega", "frequency", at[0])}`,
      `${parameter("clearance", machine).text} ${read("clearance", "length", at[1])}`,
      ...others,
    ].join(", ");
    byId("ask-branch").textContent = `Follow the branch over the ${parameter(state.plane.vertical, machine).text}`;
    await this.choose({});
  }

  // Shows another motion of the open point, in place of the one before: from rest or from the state `start`, or the one
  // without impacts that `isTouching` a stop. It has a `label` where no other is found; a `note` is said.
  async choose({ start = null, isTouching = false, label = null, note = "", periods = this.machine.periods }) {
    this.#forget();
    const motion = (this.#motion = new AbortController());
    this.start = start;
    this.watched = { ...this.machine, periods };
    this.#isFromRest = !start && !isTouching;
    this.orbit = null;
    this.offer();
    byId("point-section").scrollTop = 0;
    if (!start) byId("basins").querySelector(".mark")?.removeAttribute("d");
    byId("point-name").textContent = "Computing …";
    byId("point-place").textContent = this.place;
    byId("point-words").textContent = byId("point-why").textContent = "";
    for (const name of ["point-figures", "multipliers", "branch", "own-curves"]) byId(name).replaceChildren();
    byId("unresolved").hidden = byId("ask-needs").hidden = true;
    Object.assign(byId("pictures"), { className: "waiting", hidden: false });
    byId("ask").disabled = byId("ask-branch").disabled = byId("ask-curves").disabled = true;
    mark((this.label = null)); // of the motion that is shown
    const isThere = await this.#work("The motion", () => {
      const told = this.#trajectory(isTouching, label, this.#isFromRest ? this.state.note : note);
      return Promise.all([told, this.#orbit(isTouching, told)]);
    });
    if (isThere || this.label || motion !== this.#motion) return;
    byId("point-name").textContent = "Not computed";
    byId("pictures").hidden = true;
    byId("ask").disabled = false;
  }

  // Says what is being computed until it is there, or what is wrong; returns whether it is there.
  async #work(what, task) {
    const working = this.#working;
    let wrong = "";
    working.push(what);
    this.#sayWork();
    try {
      await task();
      return true;
    } catch (error) {
      if (isAborted(error)) return false;
      wrong = `${what}: ${error.message}`;
      return false;
    } finally {
      working.splice(working.indexOf(what), 1);
      if (working === this.#working) this.#sayWork(wrong);
    }
  }

  // Says what is being computed, or something else of it.
  #sayWork(text = "") {
    const what = [...new Set(this.#working)].join(", ");
    byId("point-says").textContent = text || (what && `${what}: computing …`);
  }

  async compute(process, request, { signal } = this.#motion) {
    try {
      const onJob = (job) => this.#sayWork(job.waiting_for && `Waiting for ${job.waiting_for.replace(NEARLY, "")}.`);
      return (await compute(process, request, { signal, priority: 8, onJob })).data;
    } finally {
      signal.throwIfAborted();
    }
  }

  async #trajectory(isTouching, known, note) {
    const { watched: machine, at } = this;
    const away = isTouching ? AWAY : 1; // where stops are out of reach, the motion does not leave the grazing curve
    const free = { ...machine, left: machine.left && away * machine.left };
    let transient = machine.periods;
    const over = (periods) => {
      const options = { transient, initial: this.start, periods };
      return this.compute("trajectories", requests.trajectory(free, [at[0], away * at[1]], options));
    };
    let path = await over(PERIODS_SHOWN);
    const isOpen = path.motion.kind === "unresolved" && this.#isFromRest;
    const { label, exponent = null } = isOpen
      ? await this.#ofMap()
      : { label: path.motion.label ?? known ?? path.motion.kind };
    if (isOpen && periodOf(label)) {
      transient *= LONGER; // a map solves for the motion before it has settled as closely as a trajectory has to
      path = await over(PERIODS_SHOWN);
    }
    const { motion } = path;
    if (motion.kind === "periodic" && motion.period > PERIODS_SHOWN) path = await over(motion.period);
    else if (!periodOf(label)) path = await over(PERIODS_OF_CHAOS);
    const before = motion.kind === "periodic" ? ", at" : "; hits at";
    const speeds = isFree(label) ? "" : speedsOf(path.impacts, unitOf(machine, "velocity"), before);
    const { colour, image } = this.colours.of(label);
    const after = machine.periods > this.machine.periods ? ` (after ${machine.periods} periods)` : "";
    byId("point-name").replaceChildren(swatch(colour, image), label + after);
    byId("point-words").textContent = `${inWords(label, machine)}${speeds}.`;
    byId("point-why").textContent = note;
    if (exponent !== null)
      byId("point-why").prepend(term("Lyapunov exponent", NEIGHBOURS), ` ${toRead(exponent)} per forcing period. `);
    if (this.#isFromRest) this.labelFromRest = label;
    mark((this.label = label));
    byId("ask").disabled = false;
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
    const end = periodOf(label) ? times.at(-1) : PERIODS_SHOWN * animated.period;
    const last = times.findLastIndex(
      (time) => time <= Math.max(4 * animated.period, Math.min(2 * animated.loop, end)) + 1e-9,
    );
    byId("pictures").className = "";
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
        names: { x: named("time", machine, "time"), y: named("displacement", machine, "length") },
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
    const verdict = verdictOf(await this.compute("unfolding-maps", requests.pointMap(this.watched, this.at)));
    explain(verdict, this.watched.periods);
    byId("ask-longer").hidden = this.watched.periods > this.machine.periods;
    return verdict;
  }

  // The figures of the orbit, below the motion, when that is there.
  async #orbit(isTouching, told) {
    const { watched: machine, at, start } = this;
    const units = (quantity) => unitOf(machine, quantity);
    const ask = (periods) => this.compute("periodic-orbits", requests.orbit({ ...machine, periods }, at, start));
    let orbit = isTouching ? {} : await ask(machine.periods);
    const isSteady = isTouching || isOfFree(orbit);
    await told;
    const repeats = periodOf(this.label);
    const isKnown = isSteady || (!repeats && this.label !== "unresolved");
    if (!orbit.converged && !isSteady && repeats) orbit = await ask(LONGER * machine.periods);
    const rows = orbit.converged
      ? [
          ...["verified", "isolated", "admissible", "stable"].map((name) => [term(name), orbit[name] ? "yes" : "no"]),
          ["largest multiplier", multiplierText(orbit.multipliers?.[0] ?? [NaN, 0])],
          ["impacts in a forcing period", toRead(orbit.impact_rate)],
          ["minimum impact speed", `${toRead(least(orbit.velocities))}${units("velocity")}`],
          ["peak impact speed", `${toRead(orbit.peak_impact_speed)}${units("velocity")}`],
          ["dissipated power", `${toRead(orbit.dissipated_power)}${units("power")}`],
        ]
      : [
          [
            "periodic orbit",
            isSteady ? "the steady motion, without impacts" : isKnown ? `none: ${this.label}` : "none found",
          ],
        ];
    if (orbit.converged) byId("point-place").append(`; ${orbit.verified ? "verified" : "not verified"}`);
    if (orbit.reason && !isKnown) rows.push(["because", withoutRemedy(orbit.reason)]);
    byId("point-figures").replaceChildren(
      ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]),
    );
    if (orbit.converged && orbit.multipliers?.length)
      byId("multipliers").append(
        circle(orbit.multipliers, HALF),
        element("small", {}, term("multiplier", NEIGHBOURS), "s inside: stable"),
      );
    this.orbit = orbit;
    byId("ask-needs").hidden = orbit.converged;
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
