// What can be asked about the motion of an open point: its basins of attraction, its branch and its bifurcation curves.
import { chart, extent, onPick, onRead } from "./charts.js";
import { MEANINGS, NAMES, linesOf } from "./curves.js";
import { byId, element, swatch, term } from "./dom.js";
import { numbered } from "./labels.js";
import { percent } from "./layers.js";
import { parameter, within } from "./parameters.js";
import * as requests from "./requests.js";
import { toRead } from "./ticks.js";
import { named, shown, unitOf, withUnit } from "./units.js";

const BASIN_POINTS = 96;

export async function showBasins(panel) {
  const { machine, at } = panel;
  const ofRest = requests.trajectory(machine, at, { transient: 0, periods: 1, samples: 1 });
  const [basins, rest] = await Promise.all([
    panel.compute("basins", requests.basins(machine, at, BASIN_POINTS), panel.ofPoint),
    panel.compute("trajectories", ofRest, panel.ofPoint),
  ]);
  const { label, attractors, horizontal, vertical } = basins;
  const rows = label.length;
  const columns = label[0].length;
  const canvas = element("canvas", { width: columns, height: rows });
  const labelOf = (attractor) => attractor.label ?? attractor.kind;
  const names = numbered(attractors.map(labelOf));
  const looks = panel.colours.beside([...names, "unresolved"]);
  const pen = canvas.getContext("2d");
  const image = pen.createImageData(columns, rows);
  label.forEach((row, i) =>
    row.forEach((number, j) => {
      const look = looks.get(names[number] ?? "unresolved");
      image.data.set([...look.at(i, j), 255], 4 * ((rows - 1 - i) * columns + j));
    }),
  );
  pen.putImageData(image, 0, 0);
  const edges = (values) => {
    const half = (values[1] - values[0]) / 2;
    return [values[0] - half, values[values.length - 1] + half];
  };
  const drawn = chart({
    title: "Basins of attraction over initial displacement and velocity of mass 1",
    x: shown(machine, "length", edges(horizontal)),
    y: edges(vertical),
    names: {
      x: named("displacement of mass 1", machine, "length"),
      y: named("velocity of mass 1", machine, "velocity"),
    },
    image: canvas.toDataURL(),
    equal: true,
  });
  drawn.setAttribute("aria-describedby", "basins-say");
  const spoken = element("p", { role: "status" });
  const others = rest.displacement.length > 1 ? ", the other masses at rest" : "";
  const all = label.flat();
  const open = all.filter((number) => number < 0).length / all.length;
  const isOne = names.length === 1 && !open;
  const place = (column, row) =>
    `displacement ${withUnit(machine, "length", horizontal[column])}, velocity ${withUnit(machine, "velocity", vertical[row])}`;
  onPick(drawn, columns, rows, {
    moved: (column, row) =>
      (spoken.textContent = `${place(column, row)}: ${names[label[row][column]] ?? "unresolved"}`),
    chosen: (column, row) => {
      const displacement = rest.displacement.map(([value], mass) => (mass ? value : horizontal[column]));
      panel.choose({
        start: { displacement, velocity: displacement.map((_, mass) => (mass ? 0 : vertical[row])) },
        label: labelOf(attractors[label[row][column]] ?? {}),
        note: `From ${place(column, row)} of mass 1${others}.`,
      });
    },
  });
  const text =
    `Each point is a start: mass 1 with this displacement and velocity${others}. Its colour is the ` +
    "motion that follows. Press it, or go there with arrow keys and Enter, to see that motion. " +
    (isOne
      ? "All starts of this picture lead to the same motion."
      : "The shares count these starts. Motions that none of them leads to were met from random states.");
  byId("basins").replaceChildren(
    drawn,
    spoken,
    element("p", { id: "basins-say" }, text),
    element(
      "ul",
      {},
      ...attractors.map((attractor, k) => {
        const { colour, image: stripes } = looks.get(names[k]);
        return element("li", {}, swatch(colour, stripes), `${names[k]}: ${percent(attractor.share)}`);
      }),
      ...(open
        ? [element("li", {}, swatch(looks.get("unresolved").colour), `unresolved: ${percent(open)} of these starts`)]
        : []),
    ),
  );
}

export async function showBranch(panel) {
  const { watched: machine, at, state } = panel;
  const [x, y] = state.at;
  const [low, high] = state.y;
  const { name, text, quantity, factor, domain } = parameter(state.plane.vertical, machine);
  const times = factor ? y : 1; // a branch starts where its factor is 1
  const range = within([Math.min(low, y), Math.max(high, y)], domain).map((end) => end / times);
  const branch = await panel.compute("orbit-branches", requests.branch(machine, at, name, range, panel.start));
  if (!branch.parameter.length) throw new Error(branch.reason);
  const read = (value) => shown(machine, quantity, times * value);
  const values = branch.parameter.map((value) => times * value);
  const across = branch.parameter.map(read);
  const speed = branch.velocities.map((all) => Math.abs(all[0] ?? 0));
  const all = branch.parameter.map((_, k) => k);
  const part = (chosen) => ({
    x: across,
    y: all.map((k) => (chosen(k) || chosen(Math.max(0, k - 1)) ? speed[k] : null)),
  });
  const stable = (k) => branch.stable[k] && branch.admissible[k];
  const view = { x: extent(across), y: extent(speed) };
  const drawn = chart({
    title: `Branch: speed of the first impact over the ${text}`,
    ...view,
    names: { x: named(text, machine, quantity), y: named("impact speed", machine, "velocity") },
    series: [
      { ...part((k) => !stable(k)), kind: "unstable" },
      { ...part(stable), kind: "motion" },
    ],
    bars: [{ x: shown(machine, quantity, y), kind: "here" }],
    dots: branch.special_points.map((point) => ({
      x: read(point.parameter),
      y: Math.abs(point.velocities[0] ?? 0),
      kind: point.type,
    })),
  });
  const spoken = element("p", {
    role: "status",
    textContent: "Point at the branch, or press an arrow key, to read it.",
  });
  onRead(
    drawn,
    view,
    all.map((k) => ({ x: across[k], y: speed[k] })),
    (k) => {
      const kind = branch.admissible[k] ? (branch.stable[k] ? "stable" : "unstable") : "not admissible";
      const number = toRead(across[k], view.x[1] - view.x[0]);
      const hit = `${toRead(speed[k], view.y[1] - view.y[0])}${unitOf(machine, "velocity")}`;
      spoken.textContent = `${text} ${number}${unitOf(machine, quantity)}: impact speed ${hit}, ${kind}`;
    },
  );
  byId("branch").replaceChildren(
    drawn,
    spoken,
    element("p", {}, "Dashed: unstable or not ", term("admissible"), ". Grey line: the open point."),
    element(
      "ul",
      {},
      ...branch.special_points.map((point) =>
        element("li", {
          textContent:
            `${point.type} at ${text} ${toRead(read(point.parameter))}${unitOf(machine, quantity)}` +
            (point.admissible ? "" : " (not admissible)"),
        }),
      ),
    ),
    ...[...new Set(branch.special_points.map(({ type }) => type))].map((type) =>
      element("small", { textContent: `${type}: ${NAMES[type]}; ${MEANINGS[type]}. ` }),
    ),
  );
  const ends = extent(values, 0);
  const { bifurcations, ink } = panel.colours.palette;
  const line = { x: [x, x], y: ends, colour: ink, thin: true, text: "The branch that was followed" };
  panel.draw(
    "branch",
    [line],
    branch.special_points.map((point) => ({
      x,
      y: times * point.parameter,
      shape: "diamond",
      type: point.type,
      colour: bifurcations[point.type],
      text: `${point.type} of the branch, at ${text} ${toRead(read(point.parameter))}${unitOf(machine, quantity)}`,
    })),
  );
}

export async function showCurves(panel) {
  const { machine, plane, at } = panel.state;
  const [x, y] = ["x", "y"].map((side, k) => {
    const name = [plane.horizontal, plane.vertical][k];
    return within(panel.state[side], parameter(name, machine).domain);
  });
  const data = await panel.compute("bifurcation-curves", requests.curvesOf(machine, plane, at, panel.orbit, { x, y }));
  const lines = data.curves.flatMap((piece) => linesOf(piece, panel.colours.palette));
  const reason = data.motions?.[0]?.reason;
  byId("own-curves").textContent =
    reason ??
    `The bifurcation curves of ${data.motions?.[0]?.label} are drawn into the plane, in ${lines.length} parts.`;
  panel.draw("curves", lines);
}
