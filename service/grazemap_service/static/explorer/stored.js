// A map that was computed before, by whatever client, as the page shows it: the address says #map=ID.
import { send } from "./api.js";

const NPZ = "application/x-npz";

const isRange = (value) => Number.isFinite(value?.start);

// The stops of a machine, from the clearance that varies and those of the stops that do not.
function stopsOf({ vertical, clearance }) {
  if (vertical?.vary === "clearance") return { stops: "equal", left: null };
  const { right, left } = clearance ?? {};
  if (vertical?.vary === "clearance_left" && right === null) return { stops: "left", left: null };
  if (vertical?.vary === "clearance_right" && left === null) return { stops: "right", left: null };
  if (vertical?.vary === "clearance_right" && Number.isFinite(left)) return { stops: "unequal", left };
  return null;
}

// Half a step beyond the first and the last point, as the points of a tile are in the middle of its parts.
function around({ start, stop, points }) {
  const half = (stop - start) / (points - 1) / 2;
  return [start - half, stop + half];
}

// A map's machine and window, { machine, x, y }, its number of points along a side, which is null where its sides have
// different ones, and `data()`, a promise of its npz. Throws an Error where the page has no such view.
/** @param {string} id */
export async function storedMap(id) {
  const job = await (await send(`v1/jobs/${encodeURIComponent(id)}`)).json();
  const { process, request = {} } = job;
  const stops = process === "unfolding-maps" && request.policy === "rest" ? stopsOf(request) : null;
  const [across, up] = [request.horizontal?.values, request.vertical?.values];
  if (!stops || request.horizontal.vary !== "omega" || !isRange(across) || !isRange(up) || up.start <= 0)
    throw new Error("The page shows maps from rest, over ranges of forcing frequency and clearance.");
  const isSquare = across.points === up.points && !request.adaptive;
  return {
    machine: { ...stops, periods: request.max_periods, oscillator: request.oscillator },
    x: around(across),
    y: around(up),
    points: isSquare ? up.points : null,
    request,
    data: async () => (await send(`v1/jobs/${id}/result`, { headers: { Accept: NPZ } })).arrayBuffer(),
  };
}
