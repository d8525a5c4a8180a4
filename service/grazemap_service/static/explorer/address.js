// The state of the page in the address: #omega=0.25..0.3125&clearance=1.25..2&layer=motion&at=0.28,1.6&machine={...}
// Of a plane of other parameters: #horizontal=omega&vertical=restitution&omega=0.25..0.3125&restitution=0.5..1&clearance=1.6
import { EMBEDDED } from "./embed.js";
import { isPart, isWithin } from "./lattice.js";
import { LAYERS, hasLayer } from "./layers.js";
import { FIXED, USUAL, isUsual, namesOf, parameter } from "./parameters.js";
import { PRESETS } from "./presets.js";
import { SIDES } from "./sketch.js";
import { STARTS } from "./starts.js";
import { rounded } from "./ticks.js";
import { UNITS, USUAL_UNITS } from "./units.js";

const SHARE = 1e-6; // of a window, to which its ends are said
const MOST_PERIODS = 1e6;
const LONGEST = 40; // characters of a wrong part that are repeated

// What an address means that does not say a part, whatever the page begins with.
/** @type {Omit<State, "x" | "y">} */
export const UNSAID = {
  plane: USUAL,
  layer: "motion",
  policy: "rest",
  units: USUAL_UNITS,
  curves: "grazing",
  borders: false,
  at: null,
  embed: null,
  machine: PRESETS.paper.machine,
};

const RENAMED = { power: "dissipated_power" }; // layers in older links

const numbers = (text, separator) => {
  const parts = text.split(separator);
  const values = parts.map((part) => (part.trim() ? Number(part) : NaN));
  return values.length === 2 && values.every(Number.isFinite) ? values : null;
};
const positive = (text) => (Number.isFinite(Number(text)) && Number(text) > 0 ? Number(text) : null);
const oneOf = (names) => (text) => (names.includes(text) ? text : null);
const written = ([low, high]) => `${low}..${high}`;
const domainText = ([least, most]) =>
  most < Infinity ? `from ${least} to ${most}` : least > -Infinity ? `from ${least} on` : "of any size";

// Reads parts of an address, and keeps what is wrong with them.
class Parts {
  faults = [];
  known = new Set(["map", ...FIXED]); // names of parts that mean something

  constructor(hash) {
    this.query = new URLSearchParams(hash.replace(/^#/, ""));
  }

  wrong(what, allowed, instead) {
    this.faults.push(`The link’s ${what}; allowed: ${allowed}. Shown instead: ${instead}.`);
  }

  // The value that `parse` makes of a part, null: it is wrong; `instead` where there is none, or a wrong one.
  take(name, parse, allowed, instead, text = `${instead}`) {
    const given = this.query.get(name);
    this.known.add(name);
    if (given === null) return instead;
    const value = parse(given);
    if (value !== null) return value;
    const repeated = given.length > LONGEST ? `${given.slice(0, LONGEST)}…` : given;
    this.wrong(`${name} is “${repeated}”`, allowed, text);
    return instead;
  }

  interval(name, instead) {
    const { domain } = parameter(name);
    const parse = (text) => {
      const ends = numbers(text, "..");
      return ends && ends[0] < ends[1] && isPart(ends, domain) ? ends : null;
    };
    const allowed = `two numbers ${domainText(domain)}, the smaller one first, as ${written(instead)}`;
    return this.take(name, parse, allowed, instead, written(instead));
  }
}

// The plane and its window: the usual one where the address does not say another one whole.
function planeOf(parts, standard, machine) {
  const { query } = parts;
  const names = namesOf(machine);
  const [horizontal, vertical] = ["horizontal", "vertical"].map((name) =>
    parts.take(name, oneOf(names), `one of ${names.join(", ")}`, USUAL[name]),
  );
  parts.known.add(horizontal).add(vertical);
  const usual = () => ({
    x: parts.interval("omega", standard.x),
    y: parts.interval("clearance", standard.y),
    plane: USUAL,
  });
  if (isUsual({ horizontal, vertical })) return usual();
  const varies = (name) => horizontal === name || vertical === name;
  const fixed = FIXED.filter((name) => !varies(name));
  const isOf = (name) => numbers(query.get(name) ?? "", "..") !== null;
  const missing = [
    ...[horizontal, vertical].filter((name) => !isOf(name)),
    ...fixed.filter((name) => !positive(query.get(name))),
  ];
  const whole = `an interval of ${horizontal} and of ${vertical}${fixed.map((name) => `, and ${name}, a number > 0`).join("")}`;
  if (horizontal === vertical || missing.length) {
    const what = horizontal === vertical ? "two axes are one parameter" : `plane lacks ${missing.join(" and ")}`;
    parts.wrong(what, horizontal === vertical ? "two different ones" : whole, "forcing frequency and clearance");
    return { x: standard.x, y: standard.y, plane: USUAL };
  }
  const about = (name) => {
    const [low, high] = numbers(query.get(name), "..");
    const [least, most] = parameter(name).domain;
    const inside = [Math.max(low, least), Math.min(high, most)];
    return inside[0] < inside[1] ? inside : most < Infinity ? [least, most] : [1, 2];
  };
  const value = (name) => (varies(name) ? null : positive(query.get(name)));
  return {
    x: parts.interval(horizontal, about(horizontal)),
    y: parts.interval(vertical, about(vertical)),
    plane: { horizontal, vertical, omega: value("omega"), clearance: value("clearance") },
  };
}

// The machine that an address says, of which the service has not been asked.
function machineOf(parts) {
  const usual = UNSAID.machine;
  const given = parts.take(
    "machine",
    (text) => {
      try {
        const value = JSON.parse(text);
        return value && typeof value === "object" && !Array.isArray(value) ? value : null;
      } catch {
        return null;
      }
    },
    'JSON as {"stops":"right"}',
    {},
    "the paper’s machine",
  );
  const check = (name, isRight, allowed) => {
    if (!(name in given) || isRight(given[name])) return given[name] ?? usual[name];
    parts.wrong(`machine has ${name} ${JSON.stringify(given[name])}`, allowed, JSON.stringify(usual[name]));
    return usual[name];
  };
  const isOscillator = (value) => value === null || (typeof value === "object" && !Array.isArray(value));
  const machine = {
    oscillator: check("oscillator", isOscillator, "the fields of an oscillator"),
    stops: check("stops", (value) => Object.hasOwn(SIDES, value), Object.keys(SIDES).join(", ")),
    left: check("left", (value) => value === null || (Number.isFinite(value) && value > 0), "a number > 0"),
    periods: check(
      "periods",
      (value) => Number.isInteger(value) && 0 < value && value <= MOST_PERIODS,
      "whole numbers > 0",
    ),
  };
  const unknown = Object.keys(given).filter((name) => !Object.hasOwn(machine, name));
  if (unknown.length) parts.wrong(`machine has ${unknown.join(", ")}`, Object.keys(machine).join(", "), "the rest");
  if (machine.stops === "unequal" && machine.left === null) {
    parts.wrong("machine has unequal stops without left", "the distance of the left stop", "equal stops");
    machine.stops = usual.stops;
  }
  return machine;
}

// The units of frequencies and lengths that an address says, as units=Hz,mm.
function unitsOf(parts) {
  const parse = (text) => {
    const [frequency, length, ...more] = text.split(",");
    const isThere = Object.hasOwn(UNITS.frequency, frequency) && Object.hasOwn(UNITS.length, length ?? "");
    return isThere && !more.length ? { frequency, length } : null;
  };
  const [frequencies, lengths] = [UNITS.frequency, UNITS.length].map((units) => Object.keys(units).join(", "));
  const allowed = `a frequency’s and a length’s, of ${frequencies} and of ${lengths}, as Hz,mm`;
  return parts.take("units", parse, allowed, UNSAID.units, Object.values(UNSAID.units).join(","));
}

// The controls that an address names for a page within another one; null: the page is whole.
function controlsOf(parts) {
  const names = parts.query.get("embed")?.split(",").filter(Boolean);
  parts.known.add("embed");
  if (!names) return null;
  const unknown = names.filter((name) => !EMBEDDED.includes(name));
  if (unknown.length) parts.wrong(`embed has ${unknown.join(", ")}`, EMBEDDED.join(", "), "the rest");
  return EMBEDDED.filter((name) => names.includes(name));
}

// The map that an address opens, by its job; null: none.
export const mapOf = (hash) => new URLSearchParams(hash.replace(/^#/, "")).get("map");

// The state that an address says, and its faults in words. What it says wrongly is that of `standard`, as is the window
// that it does not say; an empty address says `standard`.
/** @param {string} hash  @param {State} standard  @returns {{ state: State, faults: string[] }} */
export function read(hash, standard) {
  if (hash.length < 2) return { state: standard, faults: [] };
  const parts = new Parts(hash);
  const machine = machineOf(parts);
  const window = planeOf(parts, standard, machine);
  const policy = parts.take("policy", oneOf(Object.keys(STARTS)), Object.keys(STARTS).join(", "), UNSAID.policy);
  const layers = Object.keys(LAYERS).filter((name) => hasLayer(policy, LAYERS[name]));
  const [across, up] = [window.plane.horizontal, window.plane.vertical].map((name) => parameter(name).domain);
  const state = {
    ...window,
    layer: parts.take("layer", (text) => oneOf(layers)(RENAMED[text] ?? text), layers.join(", "), UNSAID.layer),
    policy,
    units: unitsOf(parts),
    curves: parts.take("curves", oneOf(["grazing", "all"]), "grazing, all", UNSAID.curves),
    borders: parts.take("borders", oneOf(["explained"]), "explained", UNSAID.borders, "no borders") === "explained",
    at: parts.take(
      "at",
      (text) => {
        const place = numbers(text, ",");
        return place && isWithin(place[0], across) && isWithin(place[1], up) ? place : null;
      },
      "two numbers of the plane with a comma between them",
      UNSAID.at,
      "no point",
    ),
    embed: controlsOf(parts),
    machine,
  };
  const unknown = [...parts.query.keys()].filter((name) => !parts.known.has(name));
  if (unknown.length) parts.faults.push(`The link’s ${unknown.join(", ")} means nothing here and is left out.`);
  return { state, faults: parts.faults };
}

// The ends of a window as an address says them.
/** @type {(interval: Interval) => Interval} */
export const endsOf = ([low, high]) => [rounded(low, SHARE * (high - low)), rounded(high, SHARE * (high - low))];

// The whole state; what it leaves out is as UNSAID has it.
/** @param {State} state */
export function write({ x, y, plane, layer, policy, units, curves, borders, at, embed, machine }) {
  const { horizontal, vertical, ...fixed } = plane;
  const query = new URLSearchParams({
    ...(!isUsual(plane) && { horizontal, vertical }),
    [horizontal]: written(endsOf(x)),
    [vertical]: written(endsOf(y)),
  });
  for (const [name, value] of Object.entries(fixed)) if (value !== null) query.set(name, `${value}`);
  if (layer !== UNSAID.layer) query.set("layer", layer);
  if (policy !== UNSAID.policy) query.set("policy", policy);
  const inUnits = Object.values(units).join(",");
  if (inUnits !== Object.values(UNSAID.units).join(",")) query.set("units", inUnits);
  if (curves !== UNSAID.curves) query.set("curves", curves);
  if (borders) query.set("borders", "explained");
  if (at) query.set("at", at.join(","));
  if (embed) query.set("embed", embed.join(","));
  const own = Object.entries(machine).filter(([name, value]) => value !== UNSAID.machine[name]);
  if (own.length) query.set("machine", JSON.stringify(Object.fromEntries(own)));
  return `#${query}`;
}
