// The view as a program and as a command: they compute the very points that the page shows.
import { CURVE_POINTS, leavesGraze } from "./curves.js";
import { LAYERS } from "./layers.js";
import { isUsual } from "./parameters.js";
import * as requests from "./requests.js";
import { USUAL_UNITS, isSI } from "./units.js";

// The request of one map with the points of a view; `ranges` are { x, y }, ranges of the API.
const mapOf = ({ machine, plane, layer, policy }, { x, y }) =>
  requests.map(machine, plane, x, y, { observables: LAYERS[layer].observables, policy });

/** @param {State} state  @param {{ x: PointValues, y: PointValues }} ranges  @param {string} address */
export function asCurl(state, ranges, address) {
  const body = JSON.stringify(mapOf(state, ranges)).replaceAll("'", "'\\''");
  const headers = "-H 'Content-Type: application/json' \\\n  -H 'Prefer: wait=30, return=representation'";
  return `curl -s ${address}/v1/unfolding-maps ${headers} \\\n  -d '${body}'`;
}

// A value of JSON in Python.
const python = (value) => {
  if (value === null) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (Array.isArray(value)) return `[${value.map(python).join(", ")}]`;
  if (typeof value !== "object") return JSON.stringify(value);
  const fields = Object.entries(value).map(([name, field]) => `${JSON.stringify(name)}: ${python(field)}`);
  return `{${fields.join(", ")}}`;
};

// Arguments of the SDK; an axis is a tuple of its name and its ends.
const argument = (value) =>
  value?.vary ? `("${value.vary}", ${value.values.start}, ${value.values.stop})` : python(value);
const call = (values, indent = "    ") =>
  Object.entries(values)
    .map(([name, value]) => `${indent}${name}=${argument(value)},\n`)
    .join("");

// What is drawn over the map: the name of the argument, and the call that gives it.
function* overlays({ machine, plane, curves }, { x, y }) {
  const ends = ({ start, stop }) => `(${start}, ${stop})`;
  const { clearance } = requests.curve(machine, x);
  const ofStops = clearance ? `, clearance=${python(clearance)}` : "";
  if (isUsual(plane)) {
    yield ["curve", `client.grazing_curve(machine, omega=${ends(x)}, points=${CURVE_POINTS}${ofStops})`];
    yield ["points", `client.codimension_two_points(machine, omega=${ends(x)}${ofStops})`];
  }
  if (curves === "all" && leavesGraze(plane)) {
    const { oscillator, ...window } = requests.over(machine, plane, x, y);
    yield ["curves", `client.bifurcation_curves(\n    machine,\n${call(window)})`];
  }
}

// The lines that draw the map in the layer of the view.
function drawing({ layer, machine, units, plane }, over) {
  const isUsualIn = Object.entries(USUAL_UNITS).every(([kind, unit]) => units[kind] === unit);
  const inUnits = isSI(machine) && !isUsualIn ? `.in_units(${Object.values(units).map(python).join(", ")})` : "";
  const { field, observables, text } = LAYERS[layer];
  const given = over.map(([name]) => `${name}=${name}`);
  if (!field || observables)
    return [`axes = umap${inUnits}.plot(${[...(field ? [python(field)] : []), ...given].join(", ")})`];
  return [
    "axes = matplotlib.pyplot.figure().add_subplot()",
    `values = axes.pcolormesh(umap.horizontal, umap.vertical, umap.${field})`,
    `axes.figure.colorbar(values, label=${python(text)})`,
    `axes.set(xlabel=${python(plane.horizontal)}, ylabel=${python(plane.vertical)})`,
  ];
}

/** @param {State} state  @param {{ x: PointValues, y: PointValues }} ranges  @param {string} address */
export function asPython(state, ranges, address) {
  const fields = Object.entries(state.machine.oscillator ?? {})
    .map(([name, value]) => `${name}=${python(value)}`)
    .join(", ");
  const { oscillator, ...values } = mapOf(state, ranges);
  const over = [...overlays(state, ranges)];
  const drawn = drawing(state, over);
  const needsPyplot = drawn.length > 1;
  return `${needsPyplot ? "import matplotlib.pyplot\n" : ""}from grazemap import Client, Oscillator

client = Client("${address}")
machine = Oscillator(${fields})
umap = client.unfolding_map(
    machine,
${call(values)}    shape=(${ranges.y.points}, ${ranges.x.points}),
)
${needsPyplot ? "" : over.map(([name, made]) => `${name} = ${made}\n`).join("")}${drawn.join("\n")}
axes.figure.savefig("map.png")
`;
}
