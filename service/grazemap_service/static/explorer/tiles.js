// The tiles of a view: asks for what is missing, the nearest first, gives up what the view has left, and keeps what came.
// Before the tiles come maps of fewer points: first a preview of the tile which contains 4 x 4 of them, then one of each, a
// preview unless values are shown, which previews do not have.
import { compute, isAborted } from "./api.js";
import { OPEN } from "./labels.js";
import { POINTS, ancestor, bounds, isPart, range } from "./lattice.js";

const PREVIEW_POINTS = 32;
const PREVIEW_LEVELS = 2; // a tile so many levels up has points as far apart as a preview
const GLANCE_LEVELS = 4;
const AT_ONCE = 4; // as browsers open six connections to a host
const KEPT = 150;
const PRIORITY = { preview: 8, nearest: 7, tile: 5 };

// Whether a map that is wanted is a verified one of all points.
const isFine = ({ preview, points }) => !preview && points === POINTS;

export class Tiles {
  #decoder;
  #decoding = new Map(); // number -> called with the tile, or without one that cannot be read
  #number = 0;
  #running = new Map(); // name -> { abort, job }
  #wanted = [];
  #failed = new Set();
  #kept = new Map(); // name -> tile, the last used at the end
  #whole = []; // the names of the map that is wanted over its window, and of the one that was seen before it

  // `requestOf(across, up, preview)` is the request of a map over two ranges; `changed` is called when something has come or
  // failed, `failed` with the error.
  constructor({ changed, failed }) {
    this.changed = changed;
    this.failed = failed;
    this.#startDecoder();
  }

  #startDecoder() {
    this.#decoder = new Worker(new URL("decoder.js", import.meta.url), { type: "module" });
    this.#decoder.onmessage = ({ data: { number, tile } }) => this.#decoded(number, tile);
    this.#decoder.onerror = this.#decoder.onmessageerror = () => {
      this.#decoder.terminate();
      this.#decoder = null; // another one may do, or not: the next map tells
      for (const number of [...this.#decoding.keys()]) this.#decoded(number);
    };
  }

  #decoded(number, tile) {
    this.#decoding.get(number)?.(tile);
    this.#decoding.delete(number);
  }

  // What a map has as the arrays of a tile, from its npz.
  decode(buffer, { observables = [] } = {}) {
    const number = this.#number++;
    if (!this.#decoder) this.#startDecoder();
    return new Promise((resolve, reject) => {
      this.#decoding.set(number, (tile) => (tile ? resolve(tile) : reject(new Error("A map cannot be read."))));
      this.#decoder.postMessage({ number, buffer, observables }, [buffer]);
    });
  }

  // Tells what the view shows. Names tell the requests of one family of maps from those of others; no tile reaches beyond
  // the domains of the parameters.
  // While a slider moves, only what a glance shows is `hurried` to the plane.
  show(family, requestOf, tiles, domains, { hurried = false, hasValues = false } = {}) {
    const steps = [];
    const step = (tile, points, preview) => {
      const name = `${family} ${tile.ex} ${tile.ey} ${tile.i} ${tile.j} ${points} ${preview}`;
      if (steps.some((other) => other.name === name)) return;
      const { ex, ey, i, j } = tile;
      const request = () => requestOf(range(i, ex, points), range(j, ey, points), preview);
      steps.push({ name, family, points, preview, request, x: bounds(i, ex), y: bounds(j, ey) });
    };
    const unseen = (levels) => tiles.filter((tile) => !this.#covered(family, tile, levels));
    unseen(GLANCE_LEVELS)
      .map((tile) => ancestor(tile, PREVIEW_LEVELS))
      .filter(({ ex, ey, i, j }) => isPart(bounds(i, ex), domains.x) && isPart(bounds(j, ey), domains.y))
      .forEach((tile) => step(tile, PREVIEW_POINTS, true));
    if (!hurried) {
      unseen(PREVIEW_LEVELS).forEach((tile) => step(tile, PREVIEW_POINTS, !hasValues));
      tiles.forEach((tile) => step(tile, POINTS, false));
    }
    this.#whole = [];
    this.#want(steps);
  }

  // Tells that the view shows one map over its window, of as many points along each side.
  showWhole(family, request, { x, y }, points) {
    const name = `${family} ${x} ${y}`;
    this.#whole = [name, this.#whole.find((other) => this.#kept.has(other))];
    this.#want([{ name, family, points, preview: false, request: () => request, x, y }]);
  }

  #want(steps) {
    this.#wanted = steps;
    const names = new Set(steps.map(({ name }) => name));
    for (const [name, { abort }] of this.#running) if (!names.has(name)) abort.abort();
    this.#pump();
  }

  // Forgets what has failed, so that it is asked for again; returns whether anything has.
  forgive() {
    const hadFailed = this.#failed.size > 0;
    this.#failed.clear();
    return hadFailed;
  }

  // Whether a tile is there, or one that contains it, up to some levels up.
  #covered(family, tile, levels) {
    return Array.from({ length: levels + 1 }, (_, level) => ancestor(tile, level)).some(({ ex, ey, i, j }) =>
      this.#kept.has(`${family} ${ex} ${ey} ${i} ${j} ${POINTS} false`),
    );
  }

  #pump() {
    const missing = this.#wanted.filter(({ name }) => !this.#failed.has(name) && !this.#kept.has(name));
    for (const step of missing) {
      if (this.#running.size >= AT_ONCE || step.preview !== missing[0].preview) return; // previews are not held up
      if (!this.#running.has(step.name)) this.#fetch(step);
    }
  }

  async #fetch(step) {
    const { name, family, points, preview, x, y } = step;
    const abort = new AbortController();
    const running = { abort };
    this.#running.set(name, running);
    const request = step.request();
    const nearest = this.#wanted.find((other) => isFine(other) && !this.#kept.has(other.name));
    const priority = preview ? PRIORITY.preview : step === nearest || !isFine(step) ? PRIORITY.nearest : PRIORITY.tile;
    try {
      const { id, data } = await compute("unfolding-maps", request, {
        npz: true,
        priority,
        signal: abort.signal,
        onJob: (job) => {
          running.job = job;
          this.changed();
        },
      });
      await this.#read({ name, family, id, request, points, preview, x, y }, data);
    } catch (error) {
      if (!isAborted(error) && !abort.signal.aborted) {
        this.#failed.add(name);
        this.failed(error);
      }
    }
    this.#running.delete(name);
    this.changed();
    this.#pump();
  }

  // Shows a map that is there already, until finer tiles come.
  async add({ data, ...map }) {
    await this.#read({ ...map, preview: Boolean(map.request.preview) }, data);
    this.changed();
  }

  // Keeps a tile with what its npz has.
  async #read(tile, data) {
    const values = await this.decode(data, tile.request);
    if (tile.preview) values.labels = values.labels.map((label) => (label === "unresolved" ? OPEN : label));
    this.#keep({ ...values, ...tile });
  }

  #keep(tile) {
    this.#kept.set(tile.name, tile);
    const wanted = new Set(this.#wanted.map(({ name }) => name));
    for (const name of this.#kept.keys()) {
      if (this.#kept.size <= KEPT) return;
      if (!wanted.has(name)) this.#kept.delete(name);
    }
  }

  // The tiles of a family that meet a window, the coarsest points first, but for previews with finer points than the view
  // has, which a view before it left: these are below all others. Of maps over their windows it is one alone, as two of
  // them have other starts at one point.
  within(family, { x, y }) {
    const meets = (interval, other) => interval[0] < other[1] && other[0] < interval[1];
    const whole = this.#whole.map((name) => this.#kept.get(name)).find((tile) => tile?.family === family);
    if (whole) return meets(whole.x, x) && meets(whole.y, y) ? [whole] : [];
    const tiles = [...this.#kept.values()].filter(
      (tile) => tile.family === family && meets(tile.x, x) && meets(tile.y, y),
    );
    for (const tile of tiles) {
      this.#kept.delete(tile.name);
      this.#kept.set(tile.name, tile);
    }
    const size = ({ x: [left, right], y: [low, high], points }) => ((right - left) * (high - low)) / points ** 2;
    const finest = size(this.#wanted.find(isFine) ?? { x: [0, 0], y: [0, 0], points: 1 });
    const isLeft = (tile) => tile.preview && size(tile) < finest;
    return tiles.sort(
      (tile, other) =>
        Number(isLeft(other)) - Number(isLeft(tile)) || size(other) - size(tile) || other.preview - tile.preview,
    );
  }

  // The verified tiles of the view; of those that have not come, the points alone.
  ofView() {
    return this.#wanted.filter(isFine).map(({ name, points, x, y }) => this.#kept.get(name) ?? { points, x, y });
  }

  // How many maps of the view are there, of how many that are wanted, the same of its verified tiles, and what an unfinished
  // job waits for.
  progress() {
    const full = this.#wanted.filter(isFine);
    const isThere = ({ name }) => this.#kept.has(name);
    return {
      there: this.#wanted.filter(isThere).length,
      wanted: this.#wanted.length,
      done: full.filter(isThere).length,
      total: full.length,
      failed: full.filter(({ name }) => this.#failed.has(name)).length,
      waitingFor: [...this.#running.values()].map(({ job }) => job?.waiting_for).find(Boolean),
    };
  }
}
