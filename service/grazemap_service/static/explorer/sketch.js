// A drawing of a machine: its masses and what connects them, the contact with its stops, forces and base.
import { drawing } from "./dom.js";
import { EXAMPLE } from "./parameters.js";

const WIDTH = 320;
const HEIGHT = 100;
const MIDDLE = 60;
const WALL = WIDTH - 8;
const MOST = 10; // masses that have room
const GAP = 5; // between a mass and its stop

const line = (points, kind = "") =>
  drawing("polyline", { points: points.map((point) => point.join(",")).join(" "), class: kind });

function spring(from, to) {
  const coils = 7;
  const step = (to - from) / (coils + 1);
  const turns = Array.from({ length: coils }, (_, k) => [from + step * (k + 1), MIDDLE + (k % 2 ? 5 : -5)]);
  return line([[from, MIDDLE], ...turns, [to, MIDDLE]]);
}

// An arrow from a place to the right, or both ways.
function arrow(x, y, both) {
  const head = (at, side) =>
    line([
      [at - 4 * side, y - 3],
      [at, y],
      [at - 4 * side, y + 3],
    ]);
  return [
    line([
      [x - 10, y],
      [x + 10, y],
    ]),
    head(x + 10, 1),
    ...(both ? [head(x - 10, -1)] : []),
  ];
}

// The amplitudes of a forcing, a list for each harmonic.
function amplitudes(forcing) {
  if (!Array.isArray(forcing)) return [forcing.amplitude];
  return typeof forcing[0] === "object" ? forcing.map(({ amplitude }) => amplitude) : [forcing];
}

// Where the stops of a machine are.
export const SIDES = { equal: [-1, 1], unequal: [-1, 1], right: [1], left: [-1] };

function words(count, contact, stops, base) {
  const number = SIDES[stops].length === 2 ? "between two stops" : `with a stop on the ${stops}`;
  const of = Array.isArray(contact) ? ` on mass ${contact[1]}` : base?.stops_move ? " that move with the base" : "";
  const what = contact.row ? "a sum of displacements" : `mass ${Array.isArray(contact) ? contact[0] : contact}`;
  return `${count === 1 ? "One mass" : `${count} masses`}: ${what} ${number}${of}.`;
}

// The drawing, with what it shows in words; of a machine whose fields the service has accepted.
/** @param {Machine} machine */
export function sketch({ oscillator, stops }) {
  const { masses, matrices, contact = 1, base, forcing } = oscillator ?? EXAMPLE;
  const count = masses?.length ?? matrices.mass.length;
  const description = words(count, contact, stops, base);
  const picture = drawing("svg", {
    viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
    role: "img",
    "aria-label": description,
    class: "sketch",
  });
  if (count > MOST) return [description];
  const cell = (WALL - 14) / (count + 0.4);
  const size = Math.min(30, cell * 0.4);
  const home = (k) => 14 + cell * (k + 0.5);
  const forces = forcing ? amplitudes(forcing) : base ? [] : [[1]];
  const parts = [
    line(
      [
        [WALL, MIDDLE - 24],
        [WALL, MIDDLE + 24],
      ],
      "wall",
    ),
  ];
  for (let k = 0; k < count; k++) {
    const x = home(k);
    if (!matrices) parts.push(spring(x + size / 2, k + 1 < count ? home(k + 1) - size / 2 : WALL));
    const place = { x: x - size / 2, y: MIDDLE - size / 2, width: size, height: size, class: "mass" };
    parts.push(drawing("rect", place), drawing("text", { x, y: MIDDLE + 4 }, `${k + 1}`));
    if (forces.some((harmonic) => harmonic[k])) parts.push(...arrow(x, MIDDLE - size / 2 - 7));
  }
  if (matrices) {
    const frame = { x: 4, y: MIDDLE - 24, width: WALL - 4, height: 48, rx: 6, class: "frame" };
    const text = drawing("text", { x: WIDTH / 2, y: HEIGHT - 4 }, "mass, damping and stiffness matrices");
    parts.push(drawing("rect", frame), text);
  }
  if (base) parts.push(...arrow(WALL - 12, MIDDLE + 32, true));
  if (!contact.row) {
    const [struck, bearer] = Array.isArray(contact) ? contact : [contact, null];
    for (const side of SIDES[stops]) {
      const x = home(struck - 1) + side * (size / 2 + GAP);
      const high = MIDDLE - size / 2 - 16;
      const ground = [
        [x - 7, high],
        [x + 7, high],
      ];
      const arm = bearer && [
        [home(bearer - 1), MIDDLE - size / 2],
        [home(bearer - 1), high],
      ];
      // the stop ends above the spring
      parts.push(line([...(arm ?? ground), [x, high], [x, MIDDLE - 7]], "stop"));
    }
  }
  picture.append(...parts);
  return [picture, description];
}
