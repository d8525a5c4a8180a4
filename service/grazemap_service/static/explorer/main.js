// The explorer: a page over the plane of forcing frequency and clearance, or of two other parameters. It is a client of
// the public API only.
import { send, serve } from "./api.js";
import * as address from "./address.js";
import { AxisForm } from "./axisform.js";
import { grazes } from "./contours.js";
import { Curves, MEANINGS, NAMES } from "./curves.js";
import { byId, isPhone } from "./dom.js";
import { hasControl, isFramed, showControls, slidersOf } from "./embed.js";
import { Gallery } from "./gallery.js";
import { listJobs } from "./jobs.js";
import { Gestures } from "./gestures.js";
import { Colours } from "./labels.js";
import { POINTS, exponentFor, isWithin, partsOf, pointsOf, tilesOf } from "./lattice.js";
import { LAYERS, addObservables, paint, rangeOf, reading, shares, withoutValues } from "./layers.js";
import { Legend } from "./legend.js";
import { followed } from "./links.js";
import { Living } from "./living.js";
import { MachineForm } from "./machine.js";
import { arrangeMenus } from "./menus.js";
import { inWords, periodOf } from "./motionwords.js";
import { Overview } from "./overview.js";
import { USUAL, intervalAbout, isUsual, parameter, placeOf, valueOf } from "./parameters.js";
import { PlaceCard } from "./placecard.js";
import { Plane } from "./plane.js";
import { PlaneForm } from "./planeform.js";
import { PointPanel } from "./point.js";
import { PRESETS, likeOf } from "./presets.js";
import * as requests from "./requests.js";
import { Sliders } from "./sliders.js";
import { STARTS, isSweep } from "./starts.js";
import { offer } from "./takehome.js";
import { rounded } from "./ticks.js";
import { storedMap } from "./stored.js";
import { Story } from "./story.js";
import { Tiles } from "./tiles.js";
import { choose, named, shown } from "./units.js";
import { ViewForm } from "./viewform.js";
import * as words from "./words.js";

const MOST_SENSITIVE = 0.9; // share of labels that round-off may change, above which a closer look is of no use
const ORDER_AGAIN = 400; // milliseconds, after which the tiles under the pointer come first
const WHOLE = 1000; // pixels of width of a frame in which cards begin open
const ROOMY = 1000; // pixels of height at which the legend has room below an open point
const SEEN_ON_PHONE = 0.34; // of the height, above an open point, as in the style sheet
const SWEEP_AFTER = 300; // milliseconds after the last step of a window
const BESIDE = 40; // pixels between an open point and its panel
const NOTICE = 8000; // milliseconds that a notice stays
const WINDOW_DIGITS = 6;
const SLIDE_AGAIN = 150; // milliseconds between the machines of a slider that moves

const { paper } = PRESETS;
const STANDARD = { ...address.UNSAID, x: paper.x, y: paper.y };

serve({ trouble: (text) => (byId("says").textContent = text) });
const [palette, observables] = await Promise.all(
  ["palette", "observables"].map(async (name) => (await send(`static/${name}.json`)).json()),
);
addObservables(observables);
const colours = new Colours(palette);
const isBare = !location.hash && !isFramed;
let state = { ...STANDARD };
let ofPoint = { lines: [], marks: [] }; // what the point draws into the plane
let ramp = { layer: "", range: null }; // the last one
let before = { tiles: [], axes: "" }; // the tiles that were in sight last, until those of another machine come
let place = null; // where the pointer is on the canvas of the plane; null: elsewhere
const NEAR_GRAZE =
  "Close by is the grazing curve, on which the motion without impacts just touches a stop, at speed zero; from rest the machine may come to another motion.";
const SHORT_HINT = `${isPhone() ? "Tap" : "Point at"} a colour to see its machine move.`;
let hint = isPhone() ? SHORT_HINT : byId("reading").textContent; // until a point was opened
let rested = null; // where the pointer was last
let stays = null; // on a phone, the point of the plane that was under the finger last
let isWatched = true; // the plane, and not a point that was opened, until the pointer moves again
let foldsLegend = false; // whether the open point has folded the legend
let foldsMachine = false; // and the machine
let errorText = "";
let linkText = ""; // what is wrong with the link, until the next move
let notice = ""; // what is said for a while
let troubleText = "";

const familyOf = (names = []) => JSON.stringify([state.machine, state.plane, names, state.policy]);
const family = () => familyOf(LAYERS[state.layer].observables);
const domains = () => ({ x: parameter(state.plane.horizontal).domain, y: parameter(state.plane.vertical).domain });
const levels = () => ({
  x: exponentFor(state.x, plane.width, domains().x),
  y: exponentFor(state.y, plane.height, domains().y),
});

function fail(error) {
  errorText = error.message;
  refresh();
}

const tiles = new Tiles({ changed: () => refresh(), failed: fail });
const curves = new Curves({ changed: () => refresh(), failed: fail, palette });
const act = {
  moved: (view) => {
    story.end();
    linkText = "";
    change(view);
  },
  resized: () => {
    ask();
    refresh();
  },
  settled: () => remember(),
  pick: (at, { byKey = false } = {}) => {
    if (!plane.holds(at) || !hasControl(state.embed, "point")) return;
    open(pointAt(at, reading(seen(), at.x, at.y)));
    if (byKey) byId("point-name").focus();
  },
  point: (at) => {
    place = at;
    isWatched = true;
    const seenTiles = seen();
    say(seenTiles);
    live(seenTiles);
    orderAgain();
  },
  home: () => plane.go(first(), { now: true }),
  // a page of others scrolls on over the plane until a press is on it
  takesWheel: () => !isFramed || document.activeElement === plane.canvas,
  mayZoomIn: () => {
    const { x: across, y: up } = levels();
    return !across.ended && !up.ended && !roundOffDecides();
  },
};
const plane = new Plane(byId("plane"), act);
new Gestures(plane, act);
const point = new PointPanel({
  colours,
  hidden: () => {
    plane.reveal(null);
    if (foldsLegend) byId("legend-section").open = true;
    if (foldsMachine) byId("machine-section").open = true;
    foldsLegend = foldsMachine = false;
  },
  drawn: (made) => {
    ofPoint = made;
    refresh();
  },
  closed: () => {
    stays = { x: state.at[0], y: state.at[1] };
    state.at = null;
    point.clear();
    remember();
    refresh();
    plane.canvas.focus();
  },
});
const living = new Living(byId("living"));
byId("living").addEventListener("click", () => rested && act.pick(plane.value(rested))); // on a phone
const story = new Story({ changed: () => refresh() });
// The window to begin with: that of the link where the page is a part of another one, else one for the machine.
function first() {
  if (linked) return linked;
  if (isUsual(state.plane)) {
    const like = PRESETS[likeOf(state.machine)];
    const isThere = like && (overview.curve === null || overview.meets(like));
    const { x, y } = (isThere && like) || overview.suggested() || state;
    return { x, y };
  }
  const about = (name) => intervalAbout(name, valueOf(state.machine, name, openPlace()));
  return { x: about(state.plane.horizontal), y: about(state.plane.vertical) };
}

// Whether a part of another page shows the window that it began with.
const isAtHome = () =>
  Boolean(linked) && ["x", "y"].every((side) => linked[side].every((end, k) => end === state[side][k]));

let choosing = null; // the machine that is about to be shown
const form = new MachineForm({
  chosen: async (chosen, window) => {
    choosing = chosen;
    refresh();
    await overview.show(chosen, state);
    if (choosing !== chosen) return; // another one was chosen meanwhile
    choosing = null;
    const kept = window || !isUsual(state.plane) ? null : state.at; // to compare machines at
    Object.assign(state, { machine: chosen, plane: USUAL, at: kept });
    planeForm.show(state);
    if (!kept) point.clear();
    const isThere = overview.curve === null || overview.meets(state);
    const wanted = window ?? ((!isThere && overview.suggested()) || state);
    plane.go({ x: wanted.x, y: wanted.y }, { now: true });
    if (kept) openPanel();
  },
});
const viewForm = new ViewForm((part) => {
  change(part);
  if (part.units) {
    form.show(state.machine);
    planeForm.show(state);
  }
  remember();
  if (state.at && (part.units || part.policy)) openPanel();
});
const windowForm = new AxisForm("window-form", {
  domains,
  closed: true,
  digits: WINDOW_DIGITS,
  valuesOf: () => plane.view && Object.values(plane.beside).flatMap(address.endsOf),
  chosen: ([left, right, low, high]) => {
    plane.fit({ x: [left, right], y: [low, high] });
    byId("view-section").open = false;
  },
});
const pointForm = new AxisForm("point-form", {
  domains,
  valuesOf: ({ at }) => at,
  chosen: ([x, y]) => {
    const { x: across, y: up } = domains();
    plane.go({ x: around(x, state.x, across), y: around(y, state.y, up) });
    open([x, y]);
    byId("view-section").open = false;
    byId("point-name").focus();
  },
});
const planeForm = new PlaneForm({
  chosen: (chosen) => {
    const [omega, clearance] = openPlace();
    const fixed = (name, value) => (chosen.horizontal === name || chosen.vertical === name ? null : value);
    const next = {
      ...chosen,
      omega: fixed("omega", chosen.omega ?? omega),
      clearance: fixed("clearance", chosen.clearance ?? clearance),
    };
    const kept = { [state.plane.horizontal]: state.x, [state.plane.vertical]: state.y };
    const interval = (name) => kept[name] ?? intervalAbout(name, valueOf(state.machine, name, [omega, clearance]));
    Object.assign(state, { plane: next, at: null });
    planeForm.show(state);
    point.clear();
    plane.domains = domains();
    plane.go({ x: interval(next.horizontal), y: interval(next.vertical) }, { now: true });
  },
});
let sliding = null;
const sliders = new Sliders({
  changed: (part) => {
    Object.assign(state, part);
    sliding ??= setTimeout(() => {
      sliding = null;
      change({});
    }, SLIDE_AGAIN);
  },
  settled: () => {
    form.show(state.machine);
    change({});
    remember();
    if (state.at) openPanel();
  },
});
const legend = new Legend({ colours, names: NAMES, meanings: MEANINGS, changed: () => refresh() });
const overview = new Overview({
  chosen: (window) => {
    usual();
    plane.fit(window);
  },
});

// Goes back to the plane of forcing frequency and clearance.
function usual() {
  if (isUsual(state.plane)) return;
  Object.assign(state, { plane: USUAL, at: null });
  planeForm.show(state);
  point.clear();
  plane.domains = domains();
}

// The forcing frequency and the clearance of the open point, or of the middle of the window.
function openPlace() {
  const { x, y } = plane.centre;
  return placeOf(state.machine, state.plane, state.at ?? [x, y]).at;
}

// How a window of a machine's plane is told in the units of its axes.
const unitsOf =
  ({ machine, plane: { horizontal, vertical } }) =>
  ({ x, y }) => ({
    x: shown(machine, parameter(horizontal).quantity, x),
    y: shown(machine, parameter(vertical).quantity, y),
  });

let noticing = null;
function notify(text) {
  if (!text) return;
  notice = text;
  clearTimeout(noticing);
  noticing = setTimeout(() => {
    notice = "";
    refresh();
  }, NOTICE);
}

// Shows a changed part of the state.
function change(part) {
  Object.assign(state, part);
  notify(taken?.dropped());
  choose(state.units);
  plane.domains = domains();
  errorText = "";
  ask();
  refresh();
}

function ask() {
  const { x: columns, y: rows } = levels();
  const centre = place ? plane.value(place) : plane.centre;
  const { machine, plane: axes, policy, layer } = state;
  const options = { observables: LAYERS[layer].observables, policy };
  const hurried = sliders.isMoving;
  const request = (across, up, preview) => requests.map(machine, axes, across, up, { preview, ...options });
  if (isSweep(policy)) askSweep(request);
  else {
    const wanted = tilesOf(state, columns.exponent, rows.exponent, centre, domains());
    tiles.show(family(), request, wanted, domains(), { hurried, hasValues: Boolean(LAYERS[layer].field) });
  }
  curves.show(hurried ? { ...state, curves: "grazing", borders: false } : state, domains());
}

// A sweep goes over the whole window, once that is settled.
let sweeping = null;
function askSweep(request) {
  clearTimeout(sweeping);
  sweeping = setTimeout(() => {
    sweeping = null;
    if (!isSweep(state.policy)) return refresh();
    const { x, y } = { x: address.endsOf(state.x), y: address.endsOf(state.y) };
    tiles.showWhole(family(), request(partsOf(x), partsOf(y), false), { x, y }, POINTS);
    return refresh();
  }, SWEEP_AFTER);
}

let ordering = null;
function orderAgain() {
  ordering ??= setTimeout(() => {
    ordering = null;
    if (place && plane.view && !isSweep(state.policy)) ask();
  }, ORDER_AGAIN);
}

function remember() {
  if (following !== null) return;
  if ([tiles.forgive(), curves.forgive()].includes(true)) ask();
  linkText = "";
  const hash = address.write(state);
  // the history of a frame is that of the page around it
  if (hash !== location.hash) history[isFramed ? "replaceState" : "pushState"](null, "", hash);
  showEmbedded();
  overview.show(state.machine, isUsual(state.plane) ? state : null);
}

const showEmbedded = () => showControls(state.embed, address.write({ ...state, embed: null }));

let linked = null; // the window of the link by which the page is a part of another one
let following = null; // the address that is about to be shown: what changes meanwhile does not replace it

// Shows what the address says, and completes it.
async function restore() {
  const { hash } = location;
  following = hash;
  choosing = null;
  const id = address.mapOf(hash);
  const map = id ? await storedMap(id).catch((error) => error) : null;
  const { state: next, faults } = await followed(map ? addressOf(map, hash) : hash, STANDARD);
  if (hash !== location.hash) return;
  following = null;
  const old = state;
  const differs = (name) => JSON.stringify(old[name]) !== JSON.stringify(state[name]);
  state = { ...next };
  if (!hasControl(state.embed, "point")) state.at = null;
  linked = state.embed && { x: state.x, y: state.y };
  linkText = faults.join(" ");
  history.replaceState(null, "", address.write(state));
  choose(state.units);
  if (!plane.view || differs("machine") || differs("units")) form.show(state.machine);
  planeForm.show(state);
  plane.domains = domains();
  plane.view = { x: state.x, y: state.y };
  story.forget();
  change({});
  if (!state.at) {
    const isRead = byId("point-section").contains(document.activeElement);
    point.clear();
    if (isRead) plane.canvas.focus();
  } else if (["at", "machine", "plane", "policy", "units"].some(differs)) {
    uncover();
    openPanel();
  }
  overview.show(state.machine, isUsual(state.plane) ? state : null);
  showEmbedded();
  if (map instanceof Error) fail(map);
  else if (map?.points && !faults.length) showStored(map, id); // else the points are those of another view
}

// The address of the view of a stored map, with the controls of a hash; of a fault, that of the usual view.
function addressOf(map, hash) {
  const { embed } = address.read(hash, STANDARD).state;
  const { machine, ...view } = map.view ?? { machine: {} };
  return address.write({ ...STANDARD, ...view, machine: { ...STANDARD.machine, ...machine }, embed });
}

// Shows the points of a stored map, as a tile of what is shown now.
function showStored({ data, view, ...map }, id) {
  const tile = { ...map, ...view, name: `map ${id}`, id, family: familyOf() };
  data()
    .then((content) => tiles.add({ ...tile, data: content }))
    .catch(fail);
}

// The point that is meant by a place on the plane: that of a mark, or the one of a tile, where its point is `known` and
// as near as a few pixels.
function pointAt(at, known) {
  const near = plane.markAt(at);
  if (near) return [near.x, near.y];
  const own = known?.at;
  return own && plane.areNear(at, { x: own[0], y: own[1] }) ? own : ofPixel(at);
}

// A point with the digits that a pixel has.
function ofPixel({ x, y }) {
  const [across, up] = [state.x, state.y].map(([low, high]) => high - low);
  return [rounded(x, across / plane.width), rounded(y, up / plane.height)];
}

function open(at) {
  story.end();
  hint = "";
  state.at = at;
  uncover();
  openPanel();
  if (!isPhone()) makeRoom();
  remember();
  refresh();
}

// Moves the window where the open point lies under its panel.
function makeRoom() {
  const { px } = plane.place({ x: state.at[0], y: state.at[1] });
  const beyond = px - byId("right").getBoundingClientRect().left + BESIDE;
  if (!byId("point-section").hidden && beyond > 0) plane.pan(beyond / plane.width, 0);
}

// The interval, or another one of its width about a value that it does not contain.
const around = (value, [low, high], [least, most]) => {
  if (isWithin(value, [low, high])) return [low, high];
  const half = (high - low) / 2;
  return [Math.max(least, value - half), Math.min(most, value + half)];
};

// Folds the machine's card where it lies over the open point.
function uncover() {
  const { px, py } = plane.place({ x: state.at[0], y: state.at[1] });
  const { left, right, top, bottom } = byId("left").getBoundingClientRect();
  const isCovered = isWithin(px, [left, right]) && isWithin(py, [top, bottom]);
  foldsMachine ||= isCovered && byId("machine-section").open;
  if (isCovered) byId("machine-section").open = false;
}

// Whether a point is on the grazing curve, as far as that is there.
const touches = (/** @type {number[]} */ [x, y]) => Boolean(plane.nearestLine({ x, y })?.isGraze);

function openPanel() {
  if (!hasControl(state.embed, "point")) return;
  isWatched = false;
  if (innerHeight < ROOMY && byId("legend-section").open) {
    byId("legend-section").open = false;
    foldsLegend = true;
  }
  const [x, y] = state.at;
  plane.reveal(isPhone() ? { x, y } : null, innerHeight * SEEN_ON_PHONE);
  const here = state.policy === "rest" ? null : reading(seen(), x, y);
  const start = here && `On the map, ${STARTS[state.policy].phrase}: ${here.label}. Below is the motion from rest.`;
  const marked = plane.markText({ x, y });
  const note = marked
    ? `${marked} Below is the motion from rest exactly there.`
    : touches(state.at)
      ? NEAR_GRAZE
      : null;
  point.show({ ...state, note: [start, note].filter(Boolean).join(" ") });
}

const seen = () => tiles.within(family(), state);

// The verified tiles of the window that are as fine as its pixels.
function finestSeen(seenTiles = seen()) {
  const size = 2 ** levels().x.exponent;
  return seenTiles.filter(({ preview, points, x }) => !preview && points === POINTS && x[1] - x[0] === size);
}

// The tiles that may be seen: no previews where all verified tiles of the window are there.
function uncovered(seenTiles) {
  const { done, total } = tiles.progress();
  return total > 0 && done === total ? seenTiles.filter(({ preview }) => !preview) : seenTiles;
}

// Whether labels are not known better than to the distance of neighbouring points.
function roundOffDecides(seenTiles) {
  const finest = finestSeen(seenTiles);
  const sensitive = finest.reduce((sum, tile) => sum + tile.sensitiveShare, 0);
  return finest.length > 0 && sensitive > MOST_SENSITIVE * finest.length;
}

let refreshing = null;
function refresh() {
  refreshing ??= requestAnimationFrame(() => {
    refreshing = null;
    show();
  });
}

function show() {
  const seenTiles = seen();
  if (ramp.layer !== state.layer) ramp = { layer: state.layer, range: null };
  const range = LAYERS[state.layer].field ? rangeOf(state.layer, seenTiles, ramp.range) : null;
  ramp.range = range ?? ramp.range;
  const motions = LAYERS[state.layer].field ? [] : shares(seenTiles, state);
  const labels = [...motions.map(({ label }) => label), ...seenTiles.flatMap((tile) => tile.labels)];
  if (motions.length) colours.see([...new Set(labels)]);
  const style = JSON.stringify([state.layer, range, [...legend.hidden], colours.version]);
  for (const tile of seenTiles) {
    if (tile.paintedAs === style) continue;
    tile.image = paint(tile, state.layer, { hidden: legend.hidden, range, colours });
    tile.paintedAs = style;
  }
  // the motions stand until other values come, and a machine until another one does
  const motionsBelow = family() === familyOf() ? [] : tiles.within(familyOf(), state).filter(({ image }) => image);
  const { horizontal, vertical } = state.plane;
  const axes = `${horizontal} ${vertical}`;
  const below = motionsBelow.length ? motionsBelow : before.axes === axes ? before.tiles : [];
  if (seenTiles.length) before = { tiles: seenTiles, axes };
  const axis = (name) => {
    const { text, symbol = text, quantity } = parameter(name, state.machine);
    return named(isPhone() ? symbol : text, state.machine, quantity); // which leaves room for numbers
  };
  plane.scene = {
    below,
    tiles: seenTiles,
    lines: [
      ...(isUsual(state.plane) ? [] : grazes(seenTiles, palette.ink)),
      ...curves.lines(),
      ...curves.borders(),
      ...ofPoint.lines,
    ],
    marks: [...curves.marks(), ...ofPoint.marks],
    at: state.at && { x: state.at[0], y: state.at[1] },
    names: { x: axis(horizontal), y: axis(vertical) },
    inUnits: unitsOf(state),
  };
  plane.draw();
  byId("home").hidden = isAtHome();
  point.offer(Boolean(state.at) && touches(state.at));
  viewForm.show(state);
  windowForm.show(state);
  pointForm.show(state);
  legend.show(state, motions, range, LAYERS[state.layer].field ? withoutValues(state.layer, uncovered(seenTiles)) : {});
  legend.explain(plane.scene, state);
  if (!plane.view) return say(seenTiles); // the first one is not there yet
  story.look({
    window: state,
    centre: plane.centre,
    line: curves.lines().find(({ isGraze }) => isGraze),
    labelAt: (x, y) => reading(seenTiles, x, y)?.label ?? null,
    placeOf: (at) => plane.place(at),
  });
  sliders.show(state, slidersOf(state.embed));
  point.redraw();
  say(seenTiles);
  return live(seenTiles);
}

// The lines below the plane: what is under the pointer, and how far the tiles are.
function say(seenTiles = seen()) {
  const progress = tiles.progress();
  const isRefining = progress.done + progress.failed < progress.total || Boolean(sweeping);
  const { x: across, y: up } = levels();
  const troubles = [troubleText, linkText, errorText, notice].filter(Boolean);
  const pending = curves.pending();
  const work = words.ofWork({
    progress,
    isRefining,
    policy: state.policy,
    hasPicture: seenTiles.length > 0,
    isChoosing: Boolean(choosing),
    pending,
    isEnded: across.ended || up.ended,
    isSensitive: roundOffDecides(seenTiles),
  });
  if (!isRefining && !progress.failed && seenTiles.length) taken?.complete();
  const { wanted: max, there: value } = progress;
  Object.assign(byId("progress"), { max, value, className: isRefining ? "" : "done" });
  // what is wrong, and curves that were asked for, have room on a phone too
  byId("says").className = troubles.length ? "wrong" : pending.length && !isRefining ? "busy" : "";
  byId("says").textContent = [...troubles, work].join(" ");
  byId("reading").textContent =
    place && plane.view
      ? readingAt(plane.value(place), seenTiles)
      : (hasControl(state.embed, "point") && hint) || SHORT_HINT;
}

function readingAt(at, seenTiles) {
  const drawn = plane.markText(at) ?? plane.nearestLine(at)?.text;
  const here = reading(seenTiles, at.x, at.y);
  const [x, y] = pointAt(at, here);
  return words.ofPoint(state, { x, y }, { drawn, here });
}

// Forgets where the pointer was, as before another view.
function forget() {
  place = rested = stays = null;
}

// The open point where it is in sight; null: elsewhere, or none.
function openPoint() {
  const at = state.at && { x: state.at[0], y: state.at[1] };
  return at && isWithin(at.x, state.x) && isWithin(at.y, state.y) ? at : null;
}

// Marks a place on the plane, or none.
function mark(spot) {
  if (spot?.px === plane.spot?.px && spot?.py === plane.spot?.py) return;
  plane.spot = spot;
  plane.draw();
}

// Shows the machine of the point under the pointer, or of the middle of the plane, in its motion there.
function live(seenTiles) {
  if (choosing || !plane.view || (state.at && (isPhone() || !isWatched || !place))) {
    mark(null);
    return living.hide();
  }
  const kept = isPhone() && stays && plane.holds(stays) ? plane.place(stays) : null;
  rested = place ?? (story.point && plane.place(story.point)) ?? kept ?? rested ?? plane.middle;
  const here = rested;
  const value = plane.value(here);
  stays = value;
  if (!plane.holds(value)) return living.hide();
  mark((place && !isPhone()) || story.point ? null : here); // a finger leaves no pointer there
  const known = reading(seenTiles, value.x, value.y);
  const { machine, at } = placeOf(state.machine, state.plane, known?.at ?? ofPixel(value));
  const isFromRest = known && state.policy === "rest"; // as the machine that is shown
  living.show({
    machine,
    at,
    colour: isFromRest ? colours.of(known.label).colour : palette.kinds.other,
    text: known?.label ?? "",
    words: isFromRest ? inWords(known.label, machine) : known ? `The machine moves as ${STARTS.rest.phrase}.` : "",
    period: known && periodOf(known.label),
    place: here,
    size: plane,
  });
}

serve({
  key: ({ isWrong }) =>
    new Promise((resolve) => {
      if (isFramed) {
        // a page of others might imitate the question, or lay something over it
        troubleText = "This service needs a key: open its page by itself.";
        refresh();
        return;
      }
      const dialog = byId("key-dialog");
      byId("key-title").textContent = isWrong ? "The service does not take this key" : "This service needs a key";
      dialog.showModal();
      dialog.addEventListener("close", () => resolve(dialog.querySelector("input").value), { once: true });
    }),
  trouble: (text) => {
    if (text === troubleText) return;
    troubleText = text;
    refresh();
  },
});

// on a phone, and in a small frame, the plane comes first
const isRoomy = !isPhone() && (!isFramed || innerWidth >= WHOLE || location.hash.includes("embed="));
for (const name of ["legend", "machine"]) byId(`${name}-section`).open = isRoomy;
byId("zoom-in").addEventListener("click", () => plane.zoom(2, openPoint()));
byId("zoom-out").addEventListener("click", () => plane.zoom(0.5, openPoint()));
byId("home").addEventListener("click", act.home);
byId("point-section").addEventListener("keydown", ({ key }) => key === "Escape" && plane.canvas.focus());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
addEventListener("popstate", () => {
  placeCard.followed(location.hash);
  restore();
});
plane.canvas.addEventListener("pointerdown", () => story.end());
byId("story-again").addEventListener("click", async () => {
  history.pushState(null, "", location.pathname);
  await restore();
  byId("about-section").open = false;
  forget();
  story.begin();
  byId("story-next").focus();
});
const placeCard = new PlaceCard();
new Gallery({
  opened: (at, hash) => {
    story.end();
    forget();
    placeCard.show(at, hash);
  },
  addressOf: (at) => address.write({ ...STANDARD, ...at }),
  decode: (buffer) => tiles.decode(buffer),
  palette,
});
listJobs();
arrangeMenus();
const taken = offer(() => {
  const { x: across, y: up } = plane.centre;
  const middle = ({ x: [left, right], y: [low, high] }) =>
    Number(left <= across && across < right && low <= up && up < high);
  const [{ x: columns, y: rows }, within] = [levels(), domains()];
  // as it is now, whatever is shown while a picture is made, and beside the strips of the axes
  const whole = { ...state };
  const view = { ...whole, ...plane.beside };
  return {
    state: view,
    link: location.href,
    open: state.at && `+ ${byId("point-place").textContent}: ${byId("point-name").textContent}`,
    ...plane.scene,
    inUnits: unitsOf(view),
    marks: plane.marksApart,
    image: plane.image(), // of that window
    legend: legend.inSight({ ...plane.scene, marks: plane.marksApart }, view),
    pending: curves.pending(),
    lookOf: (label) => colours.of(label),
    ranges: (most) => {
      if (isSweep(view.policy)) return { x: partsOf(address.endsOf(whole.x)), y: partsOf(address.endsOf(whole.y)) };
      const side = Math.floor(Math.sqrt(most));
      return {
        x: pointsOf(view.x, columns.exponent, within.x, side),
        y: pointsOf(view.y, rows.exponent, within.y, side),
      };
    },
    tiles: tiles.ofView().sort((tile, other) => middle(tile) - middle(other)),
  };
});
// The jobs that only this page waits for end with it; a page that comes back from the browser's cache asks again.
addEventListener("pagehide", () => {
  tiles.show("", null, [], domains());
  curves.stop();
  point.stop();
});
addEventListener("pageshow", ({ persisted }) => {
  if (!persisted) return;
  change({});
  if (state.at) openPanel();
});
await restore();
if (isBare && !Story.wasSeen) story.begin();
