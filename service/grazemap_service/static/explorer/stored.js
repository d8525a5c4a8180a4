// A map that was computed before, by whatever client, as the page shows it: the address says #map=ID.
import { mapOf, send } from "./api.js";
import { parameter } from "./parameters.js";
import { STARTS } from "./starts.js";

const isRange = (value) => Number.isFinite(value?.start);
const middle = ({ start, stop }) => (start + stop) / 2;

// Half a step beyond the first and the last point, as the points of a tile are in the middle of its parts.
/** @returns {Interval} */
function around({ start, stop, points }) {
  const half = (stop - start) / (points - 1) / 2;
  return [start - half, stop + half];
}

// The stops of a machine, and the clearance that does not vary: the reverse of what requests.js asks for.
function stopsOf({ horizontal, vertical, clearance = {} }) {
  const varies = Object.fromEntries([horizontal, vertical].map(({ vary, values }) => [vary, values]));
  if ("clearance" in varies) return { stops: "equal", left: null, fixed: null };
  if (Number.isFinite(clearance)) return { stops: "equal", left: null, fixed: clearance };
  const of = (stop) =>
    varies[`clearance_${stop}`] ? middle(varies[`clearance_${stop}`]) : (clearance?.[stop] ?? null);
  const [right, left] = [of("right"), of("left")];
  const isFixed = (stop) => !varies[`clearance_${stop}`];
  if (left === null) return { stops: "right", left: null, fixed: isFixed("right") ? right : null };
  if (right === null) return { stops: "left", left: null, fixed: isFixed("left") ? left : null };
  return { stops: "unequal", left, fixed: isFixed("right") ? right : null };
}

// The view of a request of a map, { machine, plane, policy, x, y }; null where the page has no such view.
export function viewOf(request) {
  const { horizontal, vertical, policy = "rest", initial_conditions: states } = request;
  const ranges = [horizontal?.values, vertical?.values];
  if (!ranges.every(isRange) || !STARTS[policy] || (policy === "ensemble" && !Number.isFinite(states))) return null;
  const { stops, left, fixed } = stopsOf(request);
  const nameOf = ({ vary }) =>
    vary === "clearance_right" || (vary === "clearance_left" && stops === "left") ? "clearance" : vary;
  const names = [horizontal, vertical].map(nameOf);
  const [x, y] = ranges.map(around);
  const isOf = (name, [low, high]) => {
    const { domain = [0, 0] } = parameter(name) ?? {};
    return domain[0] <= low && high <= domain[1];
  };
  if (!isOf(names[0], x) || !isOf(names[1], y)) return null;
  return {
    machine: { stops, left, periods: request.max_periods, oscillator: request.oscillator },
    plane: { horizontal: names[0], vertical: names[1], omega: request.omega ?? null, clearance: fixed },
    policy,
    x,
    y,
  };
}

// A map's view, its number of points along a side, which is null where its sides have different ones, and `data()`, a
// promise of its npz. Throws an Error where the page has no such view.
/** @param {string} id */
export async function storedMap(id) {
  const { process, request = {} } = await (await send(`v1/jobs/${encodeURIComponent(id)}`)).json();
  const view = process === "unfolding-maps" ? viewOf(request) : null;
  if (!view)
    throw new Error("The page shows maps over ranges of two parameters, from rest, swept, or from random states.");
  const { horizontal, vertical } = request;
  const isSquare = horizontal.values.points === vertical.values.points && !request.adaptive;
  return {
    view,
    points: isSquare ? vertical.values.points : null,
    request,
    data: () => mapOf(id, request),
  };
}
