// The state of the page in the address: #omega=0.25..0.3125&clearance=1.25..2&layer=motion&at=0.28,1.6&machine={...}
// Of a plane of other parameters: #horizontal=omega&vertical=restitution&omega=0.25..0.3125&restitution=0.5..1&clearance=1.6
import { controlsOf } from "./embed.js";
import { LAYERS } from "./layers.js";
import { USUAL, isUsual, parameter } from "./parameters.js";
import { SIDES } from "./sketch.js";
import { rounded } from "./ticks.js";

const SHARE = 1e-6; // of a window, to which its ends are said

const numbers = (text, separator) => {
  const values = (text ?? "").split(separator).map(Number);
  return text && values.length === 2 && values.every(Number.isFinite) ? values : null;
};
const interval = (text) => {
  const bounds = numbers(text, "..");
  return bounds && bounds[0] < bounds[1] ? bounds : null;
};
const number = (text) => (text && Number.isFinite(Number(text)) ? Number(text) : null);

// The plane and its window: the usual one where the address does not say another one whole.
function planeOf(query, standard) {
  const [horizontal, vertical] = ["horizontal", "vertical"].map((name) => query.get(name) ?? USUAL[name]);
  const [x, y] = [horizontal, vertical].map((name) => interval(query.get(name)));
  const [omega, clearance] = ["omega", "clearance"].map((name) => number(query.get(name)));
  const varies = (name) => horizontal === name || vertical === name;
  const isWhole = x && y && (varies("omega") || omega) && (varies("clearance") || clearance);
  if (isWhole && horizontal !== vertical && parameter(horizontal) && parameter(vertical))
    return { x, y, plane: { horizontal, vertical, omega, clearance } };
  return {
    x: interval(query.get("omega")) ?? standard.x,
    y: interval(query.get("clearance")) ?? standard.y,
    plane: USUAL,
  };
}

// The map that an address opens, by its job; null: none.
export const mapOf = (hash) => new URLSearchParams(hash.replace(/^#/, "")).get("map");

// The state that an address says; what it does not say, or says wrongly, is that of `standard`.
export function read(hash, standard) {
  const query = new URLSearchParams(hash.replace(/^#/, ""));
  let machine = standard.machine;
  try {
    machine = { ...standard.machine, ...JSON.parse(query.get("machine") ?? "{}") };
  } catch {
    /* an address that was cut off */
  }
  if (!Object.hasOwn(SIDES, machine.stops)) machine = { ...machine, stops: standard.machine.stops };
  return {
    ...planeOf(query, standard),
    layer: Object.hasOwn(LAYERS, query.get("layer") ?? "") ? query.get("layer") : standard.layer,
    curves: query.get("curves") === "all" ? "all" : standard.curves,
    borders: query.get("borders") === "explained",
    at: numbers(query.get("at"), ","),
    embed: controlsOf(query),
    machine,
  };
}

const ends = ([low, high]) => [low, high].map((value) => rounded(value, SHARE * (high - low))).join("..");

export function write({ x, y, plane, layer, curves, borders, at, embed, machine }, standard) {
  const { horizontal, vertical, ...fixed } = plane;
  const query = new URLSearchParams({
    ...(!isUsual(plane) && { horizontal, vertical }),
    [horizontal]: ends(x),
    [vertical]: ends(y),
  });
  for (const [name, value] of Object.entries(fixed)) if (value !== null) query.set(name, value);
  if (layer !== standard.layer) query.set("layer", layer);
  if (curves !== standard.curves) query.set("curves", curves);
  if (borders) query.set("borders", "explained");
  if (at) query.set("at", at.join(","));
  if (embed) query.set("embed", embed.join(","));
  const { machine: usual } = standard;
  const own = Object.entries(machine).filter(([name, value]) => value !== usual[name]);
  if (own.length) query.set("machine", JSON.stringify(Object.fromEntries(own)));
  return `#${query}`;
}
