// What one takes home: the link, pictures, data and code.
import { send } from "./api.js";
import { byId, drawing, save } from "./dom.js";
import * as requests from "./requests.js";
import { axisName, ticks } from "./ticks.js";

const CODE_POINTS = 128;

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    byId("copied").textContent = `${what} copied.`;
  } catch {
    // clipboards need a secure address: the text is shown instead
    byId("copied").textContent = "Copy this:";
    byId("to-copy").value = text;
    byId("to-copy").hidden = false;
    byId("to-copy").select();
  }
}

const windowRange = ([start, stop]) => ({ start, stop, points: CODE_POINTS });
const mapRequest = ({ machine, plane, x, y }) => requests.map(machine, plane, windowRange(x), windowRange(y), {});

export function asCurl(state, address) {
  const body = JSON.stringify(mapRequest(state)).replaceAll("'", "'\\''");
  const headers = "-H 'Content-Type: application/json' \\\n  -H 'Prefer: wait=30, return=representation'";
  return `curl -s ${address}/v1/unfolding-maps ${headers} -d '${body}'`;
}

const python = (value) => {
  if (value === null) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (Array.isArray(value)) return `[${value.map(python).join(", ")}]`;
  if (typeof value === "object")
    return `{${Object.entries(value)
      .map(([name, field]) => `${JSON.stringify(name)}: ${python(field)}`)
      .join(", ")}}`;
  return JSON.stringify(value);
};

// The ranges and numbers of a request as the SDK takes them.
function sdkValue(value) {
  if (Array.isArray(value)) return `(${value.join(", ")})`;
  if (value?.vary) return `("${value.vary}", ${value.values.join(", ")})`;
  if (value === null || typeof value !== "object") return python(value);
  return `{${Object.entries(value)
    .map(([name, field]) => `"${name}": ${sdkValue(field)}`)
    .join(", ")}}`;
}

export function asPython({ machine, plane, x, y }, address) {
  const fields = Object.entries(machine.oscillator ?? {})
    .map(([name, value]) => `${name}=${python(value)}`)
    .join(", ");
  const { oscillator, ...ranges } = requests.over(machine, plane, x, y);
  const over = Object.entries(ranges).map(([name, value]) => `${name}=${sdkValue(value)}`);
  return `from grazemap import Client, Oscillator

client = Client("${address}")
machine = Oscillator(${fields})
umap = client.unfolding_map(
    machine, ${over.join(", ")}, shape=(${CODE_POINTS}, ${CODE_POINTS}), max_periods=${machine.periods}
)
umap.plot().figure.savefig("map.png")
`;
}

const isThere = (tile) => Boolean(tile.labels);

// How a file of a view that is not complete is named, and what the page says of it; nothing of a complete one.
function partOf(tiles) {
  const count = tiles.filter(isThere).length;
  if (count === tiles.length) return { name: "", text: "" };
  return {
    name: `-${count}-of-${tiles.length}-tiles`,
    text: `The file has ${count} of the ${tiles.length} tiles, as yet.`,
  };
}

// The points of tiles inside a window, as text with commas: by rows, from below. Those of a tile that is not there are
// "not computed".
export function asCsv(tiles, { plane, x, y }) {
  const lines = [`${plane.horizontal},${plane.vertical},motion,verified,sensitive,lyapunov,least_impact_velocity`];
  const places = ([low, high], points, [from, to]) =>
    Array.from({ length: points }, (_, k) => ({ k, value: low + ((k + 0.5) * (high - low)) / points })).filter(
      ({ value }) => from <= value && value <= to,
    );
  const values = (tile, k) => {
    if (!isThere(tile)) return ["not computed", "", "", "", ""];
    const figures = [tile.lyapunov, tile.least_impact_velocity].map((array) =>
      array && Number.isFinite(array[k]) ? array[k] : "",
    );
    return [tile.labels[tile.motion[k]], tile.verified[k], tile.sensitive[k], ...figures];
  };
  const bands = Map.groupBy(
    [...tiles].sort((tile, other) => tile.y[0] - other.y[0] || tile.x[0] - other.x[0]),
    (tile) => tile.y[0],
  );
  for (const band of bands.values())
    for (const up of places(band[0].y, band[0].points, y))
      for (const tile of band)
        for (const across of places(tile.x, tile.points, x))
          lines.push([across.value, up.value, ...values(tile, up.k * tile.points + across.k)].join(","));
  return `${lines.join("\n")}\n`;
}

// The curves and points of a window as a drawing of its own.
export function asSvg({ x, y }, lines, marks, names) {
  const [width, height, left, bottom] = [720, 540, 70, 50];
  const px = (value) => left + ((value - x[0]) / (x[1] - x[0])) * (width - left - 10);
  const py = (value) => height - bottom - ((value - y[0]) / (y[1] - y[0])) * (height - bottom - 10);
  const path = ({ x: xs, y: ys }) =>
    xs
      .map((value, k) =>
        ys[k] === null ? "" : `${k && ys[k - 1] !== null ? "L" : "M"}${px(value).toFixed(2)} ${py(ys[k]).toFixed(2)}`,
      )
      .join("");
  const text = (content, attributes) =>
    drawing("text", { "font-family": "sans-serif", "font-size": 13, ...attributes }, content);
  const frame = { x: left, y: 10, width: width - left - 10, height: height - bottom - 10 };
  const across = ticks(x, 6);
  const up = ticks(y, 6);
  const svg = drawing(
    "svg",
    { xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${width} ${height}`, width, height },
    drawing("clipPath", { id: "frame" }, drawing("rect", frame)),
    drawing("rect", { width, height, fill: "#fff" }),
    drawing(
      "g",
      { "clip-path": "url(#frame)", fill: "none", "stroke-width": 1.5 },
      ...lines.map((line) =>
        drawing(
          "path",
          { d: path(line), stroke: line.colour, ...(line.dashed && { "stroke-dasharray": "6 4" }) },
          drawing("title", {}, line.text),
        ),
      ),
      ...marks.map((mark) =>
        drawing(
          "path",
          {
            d: mark.shape === "circle" ? "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z" : "M0 -6L6 0L0 6L-6 0z",
            transform: `translate(${px(mark.x)} ${py(mark.y)})`,
            fill: mark.colour,
            stroke: "#fff",
          },
          drawing("title", {}, mark.text),
        ),
      ),
    ),
    drawing("rect", { ...frame, fill: "none", stroke: "#000" }),
    ...across.marks.map(({ value, text: label }) =>
      text(label, { x: px(value), y: height - bottom + 18, "text-anchor": "middle" }),
    ),
    ...up.marks.map(({ value, text: label }) => text(label, { x: left - 6, y: py(value) + 4, "text-anchor": "end" })),
    text(axisName(names.x, across), { x: (left + width) / 2, y: height - 8, "text-anchor": "middle" }),
    text(axisName(names.y, up), {
      x: 16,
      y: height / 2,
      "text-anchor": "middle",
      transform: `rotate(-90 16 ${height / 2})`,
    }),
  );
  return new XMLSerializer().serializeToString(svg);
}

// `now()` is { state, tiles, lines, marks, names, canvas }, with all tiles of the view, the middle one last; those that
// are not complete have their points alone.
export function offer(now) {
  const address = new URL(".", location.href).href.replace(/\/$/, "");
  const on = (id, task) =>
    byId(id).addEventListener("click", async () => {
      byId("to-copy").hidden = true;
      byId("copied").textContent = "";
      try {
        await task(now());
      } catch (error) {
        byId("copied").textContent = error.message;
      }
    });
  on("copy-link", () => copy(location.href, "The link was"));
  on("copy-python", ({ state }) => copy(asPython(state, address), "Python was"));
  on("copy-curl", ({ state }) => copy(asCurl(state, address), "The command was"));
  on("save-png", async ({ canvas, tiles }) => {
    const part = partOf(tiles);
    save(`grazemap${part.name}.png`, await new Promise((done) => canvas.toBlob(done)));
    byId("copied").textContent = part.text;
  });
  on("save-svg", ({ state, lines, marks, names }) =>
    save("grazemap.svg", new Blob([asSvg(state, lines, marks, names)], { type: "image/svg+xml" })),
  );
  on("save-csv", ({ state, tiles }) => {
    if (!tiles.some(isThere)) throw new Error("No tile of this window is complete yet.");
    const part = partOf(tiles);
    save(`grazemap${part.name}.csv`, new Blob([asCsv(tiles, state)], { type: "text/csv" }));
    byId("copied").textContent = part.text && `${part.text} The points of the others are “not computed”.`;
  });
  on("save-npz", async ({ tiles }) => {
    const tile = tiles.at(-1);
    if (!tile || !isThere(tile)) throw new Error("The tile in the middle is not complete yet.");
    const answer = await send(`v1/jobs/${tile.id}/result`, { headers: { Accept: "application/x-npz" } });
    save(`grazemap-${tile.id.slice(0, 12)}.npz`, await answer.blob());
  });
}
