// The state of the page in the address: #omega=0.25..0.3125&clearance=1.25..2&layer=motion&at=0.28,1.6&machine={...}
import { LAYERS } from "./layers.js";

const numbers = (text, separator) => {
  const found = (text ?? "").split(separator).map(Number);
  return text && found.length === 2 && found.every(Number.isFinite) ? found : null;
};
const interval = (text) => {
  const found = numbers(text, "..");
  return found && found[0] < found[1] ? found : null;
};

// The state that an address says; what it does not say, or says wrongly, is that of `standard`.
export function read(hash, standard) {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  let machine = standard.machine;
  try {
    machine = { ...standard.machine, ...JSON.parse(said.get("machine") ?? "{}") };
  } catch {
    /* an address that was cut off */
  }
  return {
    x: interval(said.get("omega")) ?? standard.x,
    y: interval(said.get("clearance")) ?? standard.y,
    layer: Object.hasOwn(LAYERS, said.get("layer") ?? "") ? said.get("layer") : standard.layer,
    curves: said.get("curves") === "all" ? "all" : standard.curves,
    at: numbers(said.get("at"), ","),
    machine,
  };
}

export function write({ x, y, layer, curves, at, machine }, standard) {
  const said = new URLSearchParams({ omega: x.join(".."), clearance: y.join("..") });
  if (layer !== standard.layer) said.set("layer", layer);
  if (curves !== standard.curves) said.set("curves", curves);
  if (at) said.set("at", at.join(","));
  const { machine: usual } = standard;
  const own = Object.entries(machine).filter(([name, value]) => value !== usual[name]);
  if (own.length) said.set("machine", JSON.stringify(Object.fromEntries(own)));
  return `#${said}`;
}
