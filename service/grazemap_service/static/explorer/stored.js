// A map that was computed before, by whatever client, as the page shows it: the address says #map=ID.
import { send } from "./api.js";

const NPZ = "application/x-npz";

const isRange = (value) => Number.isFinite(value?.start);

// The stops of a machine, from the clearance of a map, and the range that varies.
function stopsOf(clearance) {
  if (isRange(clearance)) return { stops: "equal", left: null, range: clearance };
  const { right, left } = clearance ?? {};
  if (isRange(right) && left === null) return { stops: "right", left: null, range: right };
  if (isRange(left) && right === null) return { stops: "left", left: null, range: left };
  if (isRange(right) && Number.isFinite(left)) return { stops: "unequal", left, range: right };
  return null;
}

// Half a step beyond the first and the last point, as the points of a tile are in the middle of its parts.
function around({ start, stop, points }) {
  const half = (stop - start) / (points - 1) / 2;
  return [start - half, stop + half];
}

// A map's machine and window, { machine, x, y }, its number of points along a side, which is null where its sides have
// different ones, and `data()`, a promise of its npz. Throws an Error where the page has no such view.
export async function storedMap(id) {
  const job = await (await send(`v1/jobs/${encodeURIComponent(id)}`)).json();
  const { process, request = {} } = job;
  const found = process === "unfolding-maps" && request.policy === "rest" ? stopsOf(request.clearance) : null;
  if (!found || !isRange(request.omega))
    throw new Error("The page shows maps from rest, over ranges of forcing frequency and clearance.");
  const { stops, left, range } = found;
  const isSquare = request.omega.points === range.points && !request.adaptive;
  return {
    machine: { stops, left, periods: request.max_periods, oscillator: request.oscillator },
    x: around(request.omega),
    y: around(range),
    points: isSquare ? range.points : null,
    request,
    data: async () => (await send(`v1/jobs/${id}/result`, { headers: { Accept: NPZ } })).arrayBuffer(),
  };
}
